"""The whole study: design, runs, surfaces, front, confirmation, dimension chains, and the published table beside."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from doe.designs import central_composite, to_actual, to_coded
from doe.study_file import Study, chain_table
from rbdyn.faults import InputError

if TYPE_CHECKING:
    from doe.dimension_chain import ChainResult
    from doe.pareto import ParetoFront
    from doe.response_surface import Surface

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Runs:
    """Design runs: coded and actual factors (n, k), responses (n, m) and their 95 % half-widths.

    ``notes``: what the simulations warn of, once each; none for a table that was read.
    """

    coded: Array
    actual: Array
    values: Array
    errors: Array
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Confirmed:
    """Simulated responses (m,) at a point, with 95 % statistical and numerical half-widths."""

    point: Array
    values: Array
    statistical: Array
    numerical: Array


@dataclass(frozen=True)
class Gain:
    """Relative improvement [%] of a response at the pick over the baseline, with its 95 % half-width."""

    response: str
    percent: float
    error: float

    @property
    def verdict(self) -> str:
        """Whether the change is larger than its error."""
        if abs(self.percent) <= self.error:
            return "within error"
        return "better" if self.percent > 0.0 else "worse"


@dataclass(frozen=True)
class Beside:
    """One response next to a published table of the same design.

    ``effects``: factor name to the pair of linear effects per coded unit (ours, theirs), each with whether it is
    significant at 5 %. ``rank_correlation`` is Spearman's over the runs.
    """

    response: str
    our_range: tuple[float, float, float]
    their_range: tuple[float, float, float]
    effects: dict[str, tuple[tuple[float, bool], tuple[float, bool]]]
    rank_correlation: float
    why: str

    @property
    def verdict(self) -> str:
        """In a sentence: level, signs of the effects that the published table shows, ranks."""
        shown = {factor: pair for factor, pair in self.effects.items() if pair[1][1]}
        opposite = [factor for factor, (ours, theirs) in shown.items() if ours[0] * theirs[0] <= 0.0]
        signs = f"sign differs for {', '.join(opposite)}" if opposite else "all with our sign"
        return (
            f"{self.response}: our mean is {self.our_range[1] / self.their_range[1]:.2f} of theirs; of their "
            f"{len(shown)} significant linear effects, {signs}; rank correlation {self.rank_correlation:+.2f}."
        )


@dataclass(frozen=True)
class Outcome:
    """Everything a report needs."""

    study: Study
    runs: Runs
    surfaces: list[Surface]
    front: ParetoFront
    baseline: Confirmed
    pick: Confirmed
    gains: list[Gain]
    chains: dict[str, ChainResult]
    beside: list[Beside]
    reference_values: Array | None
    cost: dict[str, float]


def design_points(study: Study) -> Array:
    """Coded design points (n, k)."""
    design = study.file.design
    return central_composite(
        len(study.factors), alpha=design.alpha, centre_replicates=design.centre_replicates
    )


def run_design(study: Study, folder: Path, workers: int | None, progress: Progress) -> Runs:
    """Design runs, from the store in ``folder`` or simulated. Raises InputError, RunError, KeyboardInterrupt."""
    from doe import clearance
    from doe.store import Store

    clearance.check_responses(study)
    coded = design_points(study)
    actual = to_actual(coded, study.centre, study.step)
    scenes = clearance.design_scenes(study, actual)
    labels = [f"design run {run + 1}" for run in range(len(scenes))]
    with Store(folder / "study.sqlite") as store:
        results = clearance.run_scenes(scenes, labels, store, workers, progress)
    notes = dict.fromkeys(note for result in results for note in result.notes)
    return Runs(coded, actual, *clearance.responses(study, results), tuple(notes))


def read_runs(study: Study, path: Path) -> Runs:
    """Runs of a CSV table instead of simulated ones. Raises InputError."""
    actual, values = study.read_table(path)
    return Runs(to_coded(actual, study.centre, study.step), actual, values, np.full_like(values, np.nan))


def fit_surfaces(study: Study, runs: Runs) -> list[Surface]:
    """A surface a response. Raises InputError when the runs do not suffice."""
    from doe.response_surface import fit

    surfaces, faults = [], []
    for response, values in zip(study.file.response, runs.values.T, strict=True):
        try:
            surfaces.append(
                fit(
                    runs.coded,
                    values,
                    name=response.name,
                    model=response.model,
                    centre=study.centre,
                    step=study.step,
                )
            )
        except ValueError as error:
            faults.append(f"{study.path}: {error}")
    if faults:
        raise InputError(faults)
    return surfaces


def find_front(study: Study, surfaces: Sequence[Surface]) -> ParetoFront:
    """Pareto front on the surfaces, within the axial points; all signs turned so that small is good."""
    from doe.designs import axial_distance
    from doe.pareto import front

    if len(surfaces) < 2:
        raise InputError([f"{study.path}: response: one alone has no front; add a second"])
    reach = max(1.0, axial_distance(len(study.factors), study.file.design.alpha)) * study.step

    def objectives(points: Array) -> Array:
        coded = to_coded(points, study.centre, study.step)
        return np.column_stack([surface.predict(coded) for surface in surfaces]) * study.signs

    settings = study.file.front
    return front(
        objectives,
        study.centre - reach,
        study.centre + reach,
        population=settings.population,
        generations=settings.generations,
        seed=settings.seed,
        baseline=study.baseline,
    )


def run_study(
    study: Study, folder: Path, workers: int | None, progress: Callable[[str], Progress]
) -> Outcome:
    """All of it; ``progress(title)`` gives the progress of a stage. Raises InputError, RunError, KeyboardInterrupt."""
    from doe import clearance
    from doe.dimension_chain import solve
    from doe.store import Store

    started = time.perf_counter()
    # Whatever can be refused is refused before anything runs.
    clearance.check_responses(study)
    clearance.design_scenes(study, to_actual(design_points(study), study.centre, study.step))
    clearance.confirmation_scene(study, study.baseline)
    _chains(study, study.centre)
    reference = _reference_runs(study)
    prepared = time.perf_counter()
    runs = run_design(study, folder, workers, progress("design runs"))
    simulated = time.perf_counter()
    surfaces = fit_surfaces(study, runs)
    found = find_front(study, surfaces)
    points = (study.baseline, study.rounded(found.points[found.pick]))
    scenes = [clearance.confirmation_scene(study, point) for point in points]
    with Store(folder / "study.sqlite") as store:
        results = clearance.run_scenes(scenes, ["baseline", "pick"], store, workers, progress("confirmation"))
    confirmed = [
        Confirmed(point, *_with_errors(study, result.as_dict()))
        for point, result in zip(points, results, strict=True)
    ]
    chains = {name: solve(chain) for name, chain in _chains(study, confirmed[1].point).items()}
    return Outcome(
        study=study,
        runs=runs,
        surfaces=surfaces,
        front=found,
        baseline=confirmed[0],
        pick=confirmed[1],
        gains=_gains(study, *confirmed),
        chains=chains,
        beside=[] if reference is None else _beside(study, runs, reference),
        reference_values=None if reference is None else reference.values,
        cost={"design_s": simulated - prepared, "total_s": time.perf_counter() - started},
    )


def _chains(study: Study, point: Array) -> dict[str, Any]:
    from doe.dimension_chain import chain_from

    values = dict(zip(study.factors, point.tolist(), strict=True))
    return {
        chain.name: chain_from(chain_table(chain, values[chain.factor]), f"{study.path}: chain {chain.name}")
        for chain in study.file.chain
    }


def _with_errors(study: Study, record: dict[str, Any]) -> tuple[Array, Array, Array]:
    quantities = [record[name] for name in study.responses]
    keys = ("value", "statistical_error", "numerical_error")
    columns = [np.array([q[key] if q[key] is not None else np.nan for q in quantities]) for key in keys]
    return columns[0], columns[1], columns[2]


def _gains(study: Study, baseline: Confirmed, pick: Confirmed) -> list[Gain]:
    """Improvements with the statistical and numerical errors of both runs, taken as independent."""
    parts = (baseline.statistical, baseline.numerical, pick.statistical, pick.numerical)
    error = np.sqrt(sum(np.nan_to_num(part) ** 2 for part in parts))
    scale = 100.0 / np.abs(baseline.values)
    percent = study.signs * (baseline.values - pick.values) * scale
    return [
        Gain(name, float(p), float(e))
        for name, p, e in zip(study.responses, percent, error * scale, strict=True)
    ]


def _reference_runs(study: Study) -> Runs | None:
    """The published table in the order of our design. Raises InputError when it is of another design."""
    if study.file.reference is None:
        return None
    path = study.beside(study.file.reference.file)
    table = read_runs(study, path)
    left = list(range(len(table.coded)))
    order = []
    for point in design_points(study):
        distance = [float(np.abs(table.coded[row] - point).max()) for row in left]
        if not distance or min(distance) > 0.02:
            raise InputError(
                [
                    f"{path}: no run left for the design point {point.round(3).tolist()} (coded); mend the reference"
                ]
            )
        order.append(left.pop(int(np.argmin(distance))))
    return Runs(table.coded[order], table.actual[order], table.values[order], table.errors[order])


def _beside(study: Study, ours: Runs, theirs: Runs) -> list[Beside]:
    from scipy.stats import spearmanr

    assert study.file.reference is not None
    pairs = zip(fit_surfaces(study, ours), fit_surfaces(study, theirs), strict=True)
    rows = []
    for index, (name, (our_surface, their_surface)) in enumerate(zip(study.responses, pairs, strict=True)):
        our_values, their_values = ours.values[:, index], theirs.values[:, index]
        our_effects, their_effects = (_linear_effects(study, each) for each in (our_surface, their_surface))
        rows.append(
            Beside(
                response=name,
                our_range=(our_values.min(), our_values.mean(), our_values.max()),
                their_range=(their_values.min(), their_values.mean(), their_values.max()),
                effects={factor: (our_effects[factor], their_effects[factor]) for factor in study.factors},
                rank_correlation=float(spearmanr(our_values, their_values).statistic),
                why=study.file.reference.why.get(name, ""),
            )
        )
    return rows


def _linear_effects(study: Study, surface: Surface) -> dict[str, tuple[float, bool]]:
    coefficients = dict(zip(surface.terms, surface.coefficients.tolist(), strict=True))
    significant = {row["source"]: row["p"] is not None and row["p"] < 0.05 for row in surface.anova}
    letters = "ABCDEFGH"[: len(study.factors)]
    return {
        factor: (coefficients.get(letter, 0.0), significant.get(letter, False))
        for factor, letter in zip(study.factors, letters, strict=True)
    }
