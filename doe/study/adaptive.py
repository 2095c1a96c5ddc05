"""The front found in few runs: emulators learn the simulator, and each run goes where it is expected to gain most."""

import time
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.stats import qmc

from doe import clearance
from doe.adaptive import AdaptiveFront, Batch, Border, Plan, adaptive_front
from doe.adaptive import Runs as Known
from doe.adaptive.candidates import Region
from doe.adaptive.search import check_budget
from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.pareto.direct import DirectFront, Samples
from doe.pareto.nsga2 import InfeasibleError
from doe.response_surface import Surface
from doe.running.failure import Failure, grouped
from doe.study.design import design_of
from doe.study.direct import Direct, Evaluator
from doe.study.front import named_faults
from doe.study.goals import goals_of, region_of
from doe.study.runs import Runs
from doe.study.surfaces import independent_values, standard_errors
from doe.study_file import Study
from rbdyn.faults import InputError, RunError, refuse

SIGNIFICANT = 0.05
# Where a drawing has no resolution, points are twins within this share of the half range of the region.
ALIKE = 0.01
# What the emulators say about a finalist, for its tolerances: 2^6 points within half a level of the design.
ABOUT, HALF_LEVEL = 6, 0.5


@dataclass(frozen=True, eq=False)
class Adaptive:
    """Front found in few runs, every failed run, and wall time [s] of the search and of its emulators alone.

    ``edges`` (k, 2) are the ends of the region, in factor units, that was searched in the end.
    """

    name: ClassVar[str] = "adaptive"
    found: AdaptiveFront
    front: DirectFront
    edges: Array
    failures: tuple[Failure, ...]
    seconds: float


Searched = Direct | Adaptive


def check_adaptive(study: Study) -> None:
    """Raises InputError where the budget has no room for the design."""
    border_of(study)
    try:
        check_budget(plan_of(study), len(design_of(study).coded))
    except ValueError as error:
        raise InputError([f"{study.path}: adaptive.{error}"]) from None


def plan_of(study: Study) -> Plan:
    """How the search goes; a fresh run at a finalist has the replicates of a design run."""
    settings = study.file.adaptive
    usual = clearance.design_scenes(study, study.baseline[None])[0].numerics.replicates
    return Plan(settings.budget, settings.batch, settings.seed, usual=usual, pick=study.file.front.pick)


def find_adaptive(study: Study, runs: Runs, simulations: Simulations) -> Adaptive:
    """Search the front from the runs of the design on, in batches that are the same for any number of workers.

    Raises RunError where the runs of a stage fail, InputError for impossible settings or limits, KeyboardInterrupt.
    """
    plan, goals, started = plan_of(study), goals_of(study), time.perf_counter()
    evaluate = _Evaluator(study, simulations, plan.budget - len(runs.coded))
    step = region_of(study) * study.step
    region = region_in_units(study)
    with named_faults(study, goals, lambda point: point, ""):
        try:
            found = adaptive_front(
                evaluate,
                study.centre,
                step,
                region,
                _known(study, runs, plan),
                goals,
                plan,
                study.baseline,
                evaluate.tell,
                border_of(study),
            )
        except InfeasibleError:
            raise
        except ValueError as error:
            if evaluate.failures:
                causes = "; ".join(group["cause"] for group in grouped(evaluate.failures))
                raise RunError(f"adaptive front: {error} ({causes})") from None
            raise InputError([f"{study.path}: adaptive.{error}"]) from None
    edges = study.centre[:, None] + step[:, None] * np.column_stack([found.region.low, found.region.high])
    front = replace(found.front, searched=_about(study, found))
    return Adaptive(found, front, edges, tuple(evaluate.failures), time.perf_counter() - started)


def region_in_units(study: Study) -> Region:
    """The region of the design as -1 to 1, its points at the resolution of the drawing."""
    half = region_of(study) * study.step
    finest = np.array([factor.resolution or np.nan for factor in study.file.factor]) / half
    apart = np.where(np.isnan(finest), ALIKE, finest * (1.0 + 1e-9))
    return Region(-np.ones(half.size), np.ones(half.size), -study.centre / half, finest, apart)


def border_of(study: Study) -> Border | None:
    """How far the region may grow; None where it may not at all. Raises InputError where it would have to shrink."""
    reach = region_of(study) * study.step
    inside = np.column_stack([study.centre - reach, study.centre + reach])
    ends = np.array([factor.allowed or own for factor, own in zip(study.file.factor, inside.tolist(), strict=True)])
    slack = 1e-9 * reach
    refuse(
        f"{study.path}: factor.allowed of {name} = {given.tolist()}: must reach over the region of the design, {own[0]:.6g} to "
        f"{own[1]:.6g}; widen it or narrow the design"
        for name, given, own, off in zip(study.factors, ends, inside, slack, strict=True)
        if given[0] > own[0] + off or given[1] < own[1] - off
    )
    if not study.file.adaptive.extend or all(factor.allowed is None for factor in study.file.factor):
        return None

    def possible(corners: Array) -> bool:
        try:
            clearance.adaptive_scenes(study, study.centre + reach * corners, [2] * len(corners), 0)
        except InputError:
            return False
        return True

    low, high = (ends - study.centre[:, None]).T / reach
    return Border(low, high, possible)


def advice(study: Study, surfaces: list[Surface]) -> list[str]:
    """Where surfaces miss more than noise explains, what the adaptive search would bring; else nothing."""
    lacking = [each.name for each in surfaces if (p := each.lack_of_fit["p"]) is not None and p < SIGNIFICANT]
    if not lacking:
        return []
    design = len(design_of(study).coded)
    return [
        f"lack of fit is significant for {', '.join(lacking)}: the front on the surfaces misses what bends there; --adaptive "
        f"would search it with emulators of the simulator, in {max(study.file.adaptive.budget - design, 0)} runs beyond the {design} "
        "of the design"
    ]


class _Evaluator(Evaluator):
    """Runs batches of points with replicates of their own; the bar tells where the search stands."""

    def __init__(self, study: Study, simulations: Simulations, total: int) -> None:
        super().__init__(study, simulations, simulations.progress("adaptive front"), total)

    def tell(self, state: Batch, done: int, total: int) -> None:
        """A new bar a batch."""
        left = 100.0 * state.left / max(state.hypervolume, 1e-300)
        words = f"adaptive front: hypervolume {state.hypervolume:.3f}, at most {left:.1f} % to gain"
        self._progress = self._simulations.progress(words)

    def batch(self, points: Array, replicates: Whole) -> tuple[Array, Array, Whole]:
        """Responses (n, m), their standard errors (n, m) and the degrees of freedom (n, m) of these."""
        # As a drawing writes them: no trace of how they were worked out.
        drawn = np.array([self._study.rounded(point) for point in points])
        scenes = clearance.adaptive_scenes(self._study, drawn, replicates.tolist(), self.done)
        values, errors, samples = self.run(scenes, "adaptive run")
        return values, standard_errors(errors, samples), np.maximum(samples - 1, 0)

    __call__ = batch  # type: ignore[assignment]


def _known(study: Study, runs: Runs, plan: Plan) -> Known:
    """The design's runs as the search wants them."""
    number = independent_values(runs)
    errors = standard_errors(runs.errors, number)
    replicates = np.full(len(runs.coded), plan.usual)
    return Known(runs.coded / region_of(study), runs.values, errors, np.maximum(number - 1, 0), replicates)


def _about(study: Study, found: AdaptiveFront) -> Samples:
    """What the emulators say about the finalists, in factor units: it stands for runs where slopes are asked for."""
    reach, factors = region_of(study), len(study.factors)
    offsets = HALF_LEVEL * (2.0 * qmc.Sobol(factors, seed=found.front.seed).random_base2(ABOUT) - 1.0)
    coded = (study.coded(found.front.points)[:, None] + offsets).reshape(-1, factors)
    means, deviations = found.emulators.predict(coded / reach)
    return Samples(study.actual(coded), means, deviations)
