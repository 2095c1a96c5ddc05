"""Design and runs of a study: points and their evaluation, the region of the design, and runs from simulations or a table."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from operator import itemgetter
from pathlib import Path
from statistics import fmean
from typing import Any, NamedTuple, Self

import numpy as np

from doe import clearance, designs
from doe.designs import Design
from doe.designs.design import SAME_POINT, replicate_groups
from doe.designs.model import Model, Terms, lattice, lost_terms, model_terms
from doe.designs.remaining import Remaining, added_points
from doe.duty import DutyResult, Run
from doe.running.runner import AgendaKeeper, Progress
from doe.running.store import Failure, Store, alike, sentence
from doe.study_file import Study
from doe.study_file.duty import at_point
from doe.study_file.sections import KEYS_OF
from doe.study_file.sections import Design as DesignSettings
from doe.study_file.table import Table, read_table
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, MethodError, RunError, refuse
from rbdyn.base.notes import DANGER, Note, Notes
from rbdyn.base.tables.sheet import read_sheet
from rbdyn.base.words import are, counted
from rbdyn.result import SimulationResult

OPTIMAL = {f"{criterion}_optimal": partial(designs.optimal, criterion=criterion) for criterion in ("d", "i")}
MAKERS: dict[str, Callable[..., Design]] = {
    **OPTIMAL,
    **{kind: getattr(designs, kind) for kind in KEYS_OF if kind not in OPTIMAL},
}
SEEDED = {"latin_hypercube", "sobol", *OPTIMAL}
# Steps from the centre within which all stated runs lie: those of the star points of a rotatable design in 8 factors.
FARTHEST = 4.0
# Most whole numbers of a factor from which an optimal design chooses; evenly spread if there are more.
MOST_LEVELS = 41
# Times that failed runs are replaced: the last ones may fail too.
REPLACED = 3
RUNS_TABLE = "design_runs.csv"  # of a study, in its folder
Values = tuple[float, ...]


class OptimalBasis(NamedTuple):
    """The basis of an optimal design beyond its settings: the terms, and coded levels of each factor (None: any value).

    ``earlier_runs`` and ``block``: coded points and blocks of the runs that the design adds to.
    """

    terms: Terms
    levels: tuple[Values | None, ...]
    earlier_runs: tuple[Values, ...]
    block: tuple[int, ...]


def terms_of(study: Study, model: Model) -> Terms:
    """Terms of a model in the factors that are active at the study's categories."""
    return model_terms(len(study.factors), model, study.inactive)


def design_of(study: Study) -> Design:
    """The design in the order of its runs; whole numbers are rounded, and inactive factors are at their centre.

    Raises InputError for impossible settings.
    """
    settings = study.file.design
    basis = _optimal_basis(study) if settings.kind in OPTIMAL else None
    try:
        design = _design(settings.model_dump_json(exclude_unset=True), len(study.factors), basis)
    except MethodError as error:
        raise InputError([f"{study.path}: design.{error}"]) from None
    design = replace(design, coded=_realised(study, design.coded, design.reach))
    return _without_inactive(design, list(study.inactive)) if study.inactive else design


def _realised(study: Study, coded: Array, reach: float) -> Array:
    """Coded points (n, k) with whole numbers rounded."""
    whole, half = np.array([factor.whole for factor in study.file.factor]), reach * study.step
    rounded = _whole(study.actual(coded), study.centre, study.centre - half, study.centre + half)
    return np.where(whole, study.coded(rounded), coded)


def _whole(actual: Array, centre: Array, low: Array, high: Array) -> Array:
    """The nearest whole numbers, halves outward, that do not lie beyond the ends of the region."""
    nearest = np.where(actual < centre, np.ceil(actual - 0.5), np.floor(actual + 0.5))
    slack = 1e-9 * (high - low)
    return nearest.clip(np.ceil(low - slack), np.floor(high + slack))


def _without_inactive(design: Design, inactive: list[int]) -> Design:
    """Runs with the inactive factors at their centre, without the repetitions that this makes."""
    centred = design.coded.copy()
    centred[:, inactive] = 0.0
    rows = np.argsort((centred != design.coded).any(axis=1), kind="stable")
    groups, earlier_groups = (replicate_groups(points[rows], design.block[rows]) for points in (centred, design.coded))
    return replace(design, coded=centred).rows(np.sort(rows[earlier_groups == earlier_groups[groups]]))


@cache
def _design(text: str, factors: int, basis: OptimalBasis | None) -> Design:
    """The design of settings in JSON; cached, because several steps of a study ask for it and some designs are slow."""
    settings = DesignSettings.model_validate_json(text)
    seed, basis_keys = {"seed"} if settings.kind in SEEDED else set(), {} if basis is None else basis._asdict()
    keys = settings.model_dump(include=(KEYS_OF[settings.kind] | seed) - {"augment"})
    design = MAKERS[settings.kind](factors, centre_replicates=settings.centres, **keys, **basis_keys)
    return design.by_blocks(settings.seed if settings.order == "random" else None)


def _all_terms(study: Study) -> Terms:
    """Terms of all response models together."""
    return tuple(dict.fromkeys(term for response in study.file.response for term in terms_of(study, response.model)))


def _optimal_basis(study: Study) -> OptimalBasis:
    """The basis of an optimal design. Raises InputError for a table with impossible runs."""
    terms = _all_terms(study)
    earlier_points, block = np.empty((0, 1)), np.empty(0, np.int64)
    if (name := study.file.design.augment) is not None:
        table = _table(study, name)
        earlier_points, block = study.coded(table.actual), np.unique(table.block, return_inverse=True)[1]
    reach = np.abs(earlier_points).max(initial=1.0)
    levels: list[Values | None] = []
    for place, factor in enumerate(study.file.factor):
        if place in study.inactive:
            levels.append((0.0,))
        elif factor.whole:
            ends = factor.centre + reach * factor.step * np.array([-1.0, 1.0])
            low, high = np.ceil(ends[0] - 1e-9), np.floor(ends[1] + 1e-9)
            numbers = np.unique(np.rint(np.linspace(low, high, min(int(high - low) + 1, MOST_LEVELS))))
            levels.append(tuple(((numbers - factor.centre) / factor.step).tolist()))
        else:
            levels.append(None)
    return OptimalBasis(terms, tuple(levels), tuple(map(tuple, earlier_points.tolist())), tuple(block.tolist()))


def _table(study: Study, name: str) -> Table:
    """The table of stated runs. Raises InputError for a table that cannot be read or has impossible runs."""
    where = f"{study.path}: design.augment = {name!r}"
    try:
        table = read_table(study.path_of(name), study.factors, [], study.path)
    except InputError as error:
        raise InputError([f"{where}: {fault}" for fault in error.faults]) from None
    distance = np.abs(study.coded(table.actual))
    refuse(
        f"{where}: {study.factors[column]} in row {row + 1} = {table.actual[row, column]:g}: lies {distance[row, column]:.4g} "
        f"steps from the centre, outside any region of a design (at most {FARTHEST:g}); check its unit, or widen step"
        for row, column in np.argwhere(distance > FARTHEST).tolist()
    )
    refuse(
        f"{where}: {factor.name} in row {row + 1} = {table.actual[row, column]:g}: whole = true has no such value; fix the row"
        for column, factor in enumerate(study.file.factor)
        for row in np.flatnonzero(factor.whole & (table.actual[:, column] % 1.0 != 0.0)).tolist()
    )
    return table


def actual_of(study: Study, design: Design) -> Array:
    """Factor values (n, k) of the runs; those of stated runs are exact, because coding may change their last bits."""
    actual, name = study.actual(design.coded), study.file.design.augment
    if name is not None and not study.inactive:
        rows = [row for row, kind in enumerate(design.kind) if kind == "given"]
        actual[rows] = _table(study, name).actual[design.order[rows]]
    return actual


def region_of(study: Study) -> Array:
    """Half ranges (k,), in coded units about the centre 0, of the box in which the study searches."""
    return np.full(len(study.factors), design_of(study).reach)


def rounded_within(study: Study, point: Array) -> Array:
    """A point (k,) in factor units, rounded to the resolution of the drawing without leaving the region."""
    reach, rounded = region_of(study) * study.step, study.rounded(point)
    finest = np.array([factor.finest or 0.0 for factor in study.file.factor])
    outside = np.abs(rounded - study.centre) > reach * (1.0 + 1e-9)
    inward = study.rounded(rounded + np.sign(study.centre - rounded) * finest)
    return np.where(outside & (np.abs(inward - study.centre) <= reach * (1.0 + 1e-9)), inward, rounded)


def beyond_runs(study: Study, coded: Array) -> bool:
    """Whether a coded point (k,) lies beyond the region that the runs reach, where the surfaces extrapolate."""
    design = design_of(study)
    distance = np.linalg.norm(coded) if design.region == "ball" else np.abs(coded).max()
    return bool(distance > design.extent * (1.0 + 1e-4))


def check_runs(study: Study, design: Design) -> None:
    """Raises InputError with every response whose model needs more or other runs."""
    runs = len(design.coded)

    def inseparable_terms(model: Model) -> list[str]:
        return lost_terms(design.coded, terms_of(study, model), design.block)

    def least_runs(model: Model) -> int:
        return len(terms_of(study, model)) + design.blocks

    def simpler_fix(model: Model) -> str:
        others: tuple[Model, ...] = "pure_quadratic", "interaction", "linear"
        smaller = [candidate for candidate in others if set(terms_of(study, candidate)) < set(terms_of(study, model))]
        fitting = [
            candidate for candidate in smaller if runs >= least_runs(candidate) and not inseparable_terms(candidate)
        ]
        return f"choose a simpler model{' (' + ' or '.join(fitting) + ')' if fitting else ''}"

    faults = []
    for number, response in enumerate(study.file.response, 1):
        model, needed = response.model, least_runs(response.model)
        where = f"{study.path}: response[{number}].model = {model!r}"
        if runs < needed:
            effects = f", {counted(design.blocks - 1, 'block effect')}" if design.blocks > 1 else ""
            key = "runs" if "runs" in KEYS_OF[study.file.design.kind] else "centre_replicates"
            enlargement = "enlarge the design" if key != "runs" and inseparable_terms(model) else f"raise design.{key}"
            faults.append(
                f"{where}: the {counted(runs, 'run')} of the design {are(runs)} too few; it needs {needed} "
                f"({needed - design.blocks} terms{effects} and one to judge the fit): {enlargement} or {simpler_fix(model)}"
            )
        elif names := inseparable_terms(model):
            faults.append(
                f"{where}: the runs of the design cannot separate {', '.join(names)} from the other terms; add levels "
                f"or centre points, or {simpler_fix(model)}"
            )
    refuse(faults)


def evaluation(study: Study, design: Design) -> dict[str, Any]:
    """Quality of the design for the largest model of a response, with the name of the model as ``model``.

    See `doe.designs.model.evaluate`. Raises InputError if the runs are too few.
    """
    from doe.designs.model import evaluate

    check_runs(study, design)
    model = max(
        (response.model for response in study.file.response), key=lambda candidate: len(terms_of(study, candidate))
    )
    figures = evaluate(design.coded, terms_of(study, model), design.block, region=design.region, reach=design.extent)
    return {"model": model, **figures}


# Name of the store in the folder of a study.
STORE = "study.sqlite"


@dataclass(frozen=True)
class Runs:
    """Design runs: coded and actual factors (n, k), responses (n, m) and their 95 % half-widths.

    ``notes``: distinct warnings of the simulations, or how a table was read; its responses without a value are NaN. ``replicates``, (n,) or (n, m), count the independent
    values of each half-width (0: unknown; None: all unknown). ``block`` (n,) labels each run; None: one block.
    ``failures``: failed design runs, which are not in the arrays. ``turns``: shaft turns of all runs. ``at_points``: by
    point of the duty, the same runs with the figures of the simulation there as responses; empty without a duty. ``design``: of
    simulated runs, with those added in place of failed ones.
    """

    coded: Array
    actual: Array
    values: Array
    errors: Array
    notes: Notes = ()
    replicates: Whole | None = None
    block: Whole | None = None
    failures: tuple[Failure, ...] = ()
    turns: float = 0.0
    at_points: Mapping[str, "Runs"] = field(default_factory=dict)
    design: Design | None = None

    @property
    def places(self) -> list[int]:
        """Place in the design, from 0, of each row."""
        failed = {failure.run for failure in self.failures}
        return [row for row in range(len(self.coded) + len(failed)) if row + 1 not in failed]

    def only(self, places: list[int]) -> Self:
        """The rows at these places."""
        coded, actual, values, errors = (array[places] for array in (self.coded, self.actual, self.values, self.errors))
        replicates, block = (None if array is None else array[places] for array in (self.replicates, self.block))
        return type(self)(coded, actual, values, errors, self.notes, replicates, block)


@dataclass(frozen=True)
class RunPlan:
    """The design runs before their simulation: design, actual factors (n, k), and by run the scene, label and factors."""

    design: Design
    actual: Array
    scenes: list[Run]
    labels: list[str]
    factors: list[dict[str, float]]


def ordered_runs(study: Study) -> RunPlan:
    """Every run of the study's design. Raises InputError for an impossible design, scene or response."""
    clearance.check_responses(study)
    design = design_of(study)
    actual = actual_of(study, design)
    scenes = clearance.design_scenes(study, actual, design.order.tolist())
    labels = [f"design run {run}" for run in range(1, len(actual) + 1)]
    return RunPlan(design, actual, scenes, labels, [study.by_factor(point) for point in actual])


def run_design(
    study: Study,
    folder: Path,
    workers: int | None,
    progress: Progress,
    scheduler: str | None = None,
    retry: bool = False,
    agenda: AgendaKeeper | None = None,
) -> Runs:
    """Design runs, from the store in ``folder`` or simulated in threads or on a cluster.

    Failed runs are left out. Raises InputError, KeyboardInterrupt, and RunError if too few runs remain.
    """
    ordered = ordered_runs(study)
    check_runs(study, ordered.design)
    with Store(folder / STORE, study.path.stem) as store:
        simulations = clearance.Simulations(store, workers, scheduler, retry, lambda title: progress, agenda)
        return runs_of(study, ordered, simulations, progress)


def runs_of(study: Study, ordered: RunPlan, simulations: clearance.Simulations, progress: Progress) -> Runs:
    """The same for checked runs; runs that failed are replaced by others where the models need them."""
    results = simulations.run(ordered.scenes, ordered.labels, progress, ordered.factors)
    planned = len(results)
    for _ in range(REPLACED):
        if (more := _with_replacements(study, ordered, results)) is None:
            break
        ordered = more
        results = replace(simulations, retry=False).run(ordered.scenes, ordered.labels, progress, ordered.factors)
    design, coded, actual = ordered.design, ordered.design.coded, ordered.actual
    failures = tuple(result for result in results if isinstance(result, Failure))
    rows = [row for row, result in enumerate(results) if not isinstance(result, Failure)]
    if failures and (lacking := _lacking(study, design, rows)):
        raise RunError(f"only {len(rows)} of {len(results)} design runs succeeded{lacking}: {sentence(failures)}")
    sound = [result for result in results if not isinstance(result, Failure)]
    notes = _distinct_notes([result.notes for result in sound])
    if failures:
        added = len(results) - planned
        instead = (
            f" {counted(added, 'other run')} in the rest of the region {are(added)} in their place." if added else ""
        )
        left_out = f"{counted(len(failures), 'design run')} failed and {are(len(failures))} left out: {sentence(failures).rstrip('.')}."
        notes.insert(0, Note("lost-runs", f"{left_out}{instead} Front and pick stay where the nearest run went well."))
    values, errors, independent = clearance.figures(study.responses, sound)
    block = np.array(design.block_numbers)[rows] if design.blocks > 1 else None
    runs = Runs(
        coded[rows],
        actual[rows],
        values,
        errors,
        tuple(notes),
        independent,
        block,
        failures,
        turns=simulations.turns,
        design=design,
    )
    at_points = {}
    for name in study.shares:
        columns = [at_point(name, figure) for figure in study.figures]
        values, errors, independent = clearance.figures(columns, sound)
        at_points[name] = replace(runs, values=values, errors=errors, replicates=independent)
    return replace(runs, at_points=at_points)


def _lacking(study: Study, design: Design, rows: list[int]) -> str:
    """What the models lack if only these runs of the design went well, to end a sentence; empty where they lack nothing."""
    # A run for each term, for each block beyond the first, and one to judge the fit.
    needed = design.blocks + max(len(terms_of(study, response.model)) for response in study.file.response)
    if len(rows) < needed:
        return f", but the response models need {needed}"
    terms = _all_terms(study)
    lost = lost_terms(design.coded[rows], terms, design.block[rows])
    return f", which cannot separate {', '.join(lost)} from the other terms of the response models" if lost else ""


def _with_replacements(
    study: Study, ordered: RunPlan, results: Sequence[SimulationResult | DutyResult | Failure]
) -> RunPlan | None:
    """The plan with another run for each that failed, in what remains of the region; None where the models need none, or none is left."""
    failed = np.array([isinstance(result, Failure) for result in results])
    design, rows = ordered.design, np.flatnonzero(~failed)
    if not failed.any() or not rows.size or not _lacking(study, design, rows.tolist()):
        return None
    remaining = Remaining(design.coded[rows], design.coded[failed])
    places = lattice(len(study.factors), design.reach)
    places[:, list(study.inactive)] = 0.0
    if design.region == "ball":
        places = places[np.linalg.norm(places, axis=1) <= design.extent + SAME_POINT]
    candidates = _realised(study, places[remaining.excess(places) < -SAME_POINT], design.reach)
    if not len(candidates):
        return None
    lacking = len(design.coded) - len(rows) - design.kind.count("added")
    coded = added_points(design.coded[rows], candidates, _all_terms(study), max(int(lacking), 1))
    count, first = len(coded), len(design.coded)
    order = np.arange(first, first + count)
    longer = replace(
        design,
        coded=np.vstack([design.coded, coded]),
        block=np.concatenate([design.block, np.full(count, design.block[-1])]),
        kind=(*design.kind, *["added"] * count),
        order=np.concatenate([design.order, order]),
    )
    actual = study.actual(coded)
    return RunPlan(
        longer,
        np.vstack([ordered.actual, actual]),
        [*ordered.scenes, *clearance.design_scenes(study, actual, order.tolist())],
        [*ordered.labels, *(f"design run {first + number}" for number in range(1, count + 1))],
        [*ordered.factors, *map(study.by_factor, actual)],
    )


def with_remaining(study: Study, runs: Runs) -> Study:
    """The study with what remains of its region where runs failed."""
    if not runs.failures:
        return study
    failed = [[failure.factors[name] for name in study.factors] for failure in runs.failures]
    return replace(study, remaining=Remaining(runs.coded, study.coded(np.array(failed))))


def _distinct_notes(notes: Sequence[Notes]) -> list[Note]:
    """Notes of all runs in the order of their mean place in a run, the most important first.

    Of notes that differ in their numbers only the first is kept, with the number of its runs. A danger of some of them is none
    of the pick, and so a warning.
    """
    placed = [(place, note) for of_run in notes for place, note in enumerate(of_run)]
    groups = sorted(alike(placed, itemgetter(1)), key=lambda group: fmean(place for place, _ in group))
    texts = [[note for _, note in group] for group in groups]
    distinct = []
    for group in texts:
        some, alone = f"in {len(group)} of {len(notes)} runs", len(set(group)) == 1
        if len(group) < len(notes) and group[0].level == DANGER:
            distinct.append(Note("corner", f"{group[0]} ({some}{'' if alone else '; figures of the first'})"))
        else:
            distinct.append(group[0] if alone else group[0].about(f"{some}; figures of the first"))
    return distinct


def read_runs(study: Study, path: Path) -> Runs:
    """Runs of a table instead of simulated ones; a response without a value is NaN. Raises InputError."""
    table = read_table(path, study.factors, study.responses, study.path)
    coded = study.coded(table.actual)
    return Runs(coded, table.actual, table.values, table.errors, table.notes, table.replicates, table.block)


def augment_notes(study: Study) -> Notes:
    """How the table of design.augment was read, where that is unusual. Raises InputError."""
    name = study.file.design.augment
    return () if name is None else read_sheet(study.path_of(name)).notes
