"""Design and runs of a study: its points and what they can say about the models asked for; runs, simulated or read from a table."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from doe import clearance, designs
from doe.designs import Design
from doe.designs.design import replicate_groups
from doe.designs.model import Model, Terms, model_terms
from doe.running.keeper import AgendaKeeper
from doe.running.runner import Progress
from doe.running.store import Failure, Store, alike, sentence
from doe.study_file import Study
from doe.study_file.sections import KEYS_OF
from doe.study_file.sections import Design as DesignSettings
from doe.study_file.table import Table, read_table
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, MethodError, RunError, refuse
from rbdyn.base.words import are, counted
from rbdyn.scene import Scene

OPTIMAL = {f"{criterion}_optimal": partial(designs.optimal, criterion=criterion) for criterion in ("d", "i")}
MAKERS: dict[str, Callable[..., Design]] = {
    **OPTIMAL,
    **{kind: getattr(designs, kind) for kind in KEYS_OF if kind not in OPTIMAL},
}
SEEDED = {"latin_hypercube", "sobol", *OPTIMAL}
# Steps from the centre beyond which no run that is given lies: those of the star points of a rotatable design in 8 factors.
FARTHEST = 4.0
# Whole numbers of a factor from which an optimal design chooses, at most; of more, evenly spread ones.
MOST_LEVELS = 41
RUNS_TABLE = "design_runs.csv"  # of a study, in its folder
Values = tuple[float, ...]


class Given(NamedTuple):
    """What an optimal design knows beyond its settings: the terms, of each factor the coded values that it may take (none:
    any), and the coded points and blocks of runs that were made."""

    terms: Terms
    levels: tuple[Values | None, ...]
    made: tuple[Values, ...]
    block: tuple[int, ...]


def terms_of(study: Study, model: Model) -> Terms:
    """Terms of a model in the factors that mean something at the study's categories."""
    return model_terms(len(study.factors), model, study.inactive)


def design_of(study: Study) -> Design:
    """The design in the order of its runs; whole numbers and factors that mean nothing rounded.

    Raises InputError when its settings are impossible.
    """
    settings = study.file.design
    given = _given(study) if settings.kind in OPTIMAL else None
    try:
        design = _design(settings.model_dump_json(exclude_unset=True), len(study.factors), given)
    except MethodError as error:
        raise InputError([f"{study.path}: design.{error}"]) from None
    whole = np.array([factor.whole for factor in study.file.factor])
    reach = design.reach * study.step
    rounded = _whole(study.actual(design.coded), study.centre, study.centre - reach, study.centre + reach)
    design = replace(design, coded=np.where(whole, study.coded(rounded), design.coded))
    return _without(design, list(study.inactive)) if study.inactive else design


def _whole(actual: Array, centre: Array, low: Array, high: Array) -> Array:
    """The nearest whole numbers, halves outward, that do not lie beyond the ends of the region."""
    nearest = np.where(actual < centre, np.ceil(actual - 0.5), np.floor(actual + 0.5))
    slack = 1e-9 * (high - low)
    return nearest.clip(np.ceil(low - slack), np.floor(high + slack))


def _without(design: Design, inactive: list[int]) -> Design:
    """Runs with the inactive factors at their centre; of runs that differ in these alone the ones that were there, or the
    first."""
    settled = design.coded.copy()
    settled[:, inactive] = 0.0
    rows = np.argsort((settled != design.coded).any(axis=1), kind="stable")
    first, before = (replicate_groups(each[rows], design.block[rows]) for each in (settled, design.coded))
    return replace(design, coded=settled).rows(np.sort(rows[before == before[first]]))


@cache
def _design(text: str, factors: int, given: Given | None) -> Design:
    """The design of settings in JSON; several steps of a study ask for it, and some designs take a while."""
    settings = DesignSettings.model_validate_json(text)
    seed, known = {"seed"} if settings.kind in SEEDED else set(), {} if given is None else given._asdict()
    keys = settings.model_dump(include=(KEYS_OF[settings.kind] | seed) - {"augment"})
    design = MAKERS[settings.kind](factors, centre_replicates=settings.centres, **keys, **known)
    return design.by_blocks(settings.seed if settings.order == "random" else None)


def _given(study: Study) -> Given:
    """What an optimal design is to know. Raises InputError for a table of runs that are impossible."""
    terms = tuple(dict.fromkeys(term for each in study.file.response for term in terms_of(study, each.model)))
    made, block = np.empty((0, 1)), np.empty(0, np.int64)
    if (name := study.file.design.augment) is not None:
        table = _table(study, name)
        made, block = study.coded(table.actual), np.unique(table.block, return_inverse=True)[1]
    reach = np.abs(made).max(initial=1.0)
    levels: list[Values | None] = []
    for place, factor in enumerate(study.file.factor):
        if place in study.inactive:
            levels.append((0.0,))
        elif factor.whole:
            ends = factor.centre + reach * factor.step * np.array([-1.0, 1.0])
            low, high = np.ceil(ends[0] - 1e-9), np.floor(ends[1] + 1e-9)
            some = np.unique(np.rint(np.linspace(low, high, min(int(high - low) + 1, MOST_LEVELS))))
            levels.append(tuple(((some - factor.centre) / factor.step).tolist()))
        else:
            levels.append(None)
    return Given(terms, tuple(levels), tuple(map(tuple, made.tolist())), tuple(block.tolist()))


def _table(study: Study, name: str) -> Table:
    """The runs that are given. Raises InputError for a table that cannot be read or has impossible ones."""
    where = f"{study.path}: design.augment = {name!r}"
    try:
        table = read_table(study.beside(name), study.factors, [], study.path)
    except InputError as error:
        raise InputError([f"{where}: {fault}" for fault in error.faults]) from None
    away = np.abs(study.coded(table.actual))
    refuse(
        f"{where}: {study.factors[column]} in row {row + 1} = {table.actual[row, column]:g}: lies {away[row, column]:.4g} "
        f"steps from the centre, outside any region of a design (at most {FARTHEST:g}); check its unit, or widen step"
        for row, column in np.argwhere(away > FARTHEST).tolist()
    )
    refuse(
        f"{where}: {factor.name} in row {row + 1} = {table.actual[row, column]:g}: whole = true has no such value; fix the row"
        for column, factor in enumerate(study.file.factor)
        for row in np.flatnonzero(factor.whole & (table.actual[:, column] % 1.0 != 0.0)).tolist()
    )
    return table


def actual_of(study: Study, design: Design) -> Array:
    """Factor values (n, k) of the runs; of those that are given to the last bit, which coding them may change."""
    actual, name = study.actual(design.coded), study.file.design.augment
    if name is not None and not study.inactive:
        given = [row for row, kind in enumerate(design.kind) if kind == "given"]
        actual[given] = _table(study, name).actual[design.order[given]]
    return actual


def check_given(study: Study, folder: Path) -> None:
    """Raises InputError where the runs that are given stand in the table that the study writes into its folder."""
    name = study.file.design.augment
    if name is not None and study.beside(name).resolve() == (folder / RUNS_TABLE).resolve():
        raise InputError(
            [
                f"{study.path}: design.augment = {name!r}: the study writes its own runs there; copy it next to the "
                "study and name the copy"
            ]
        )


def check_runs(study: Study, design: Design) -> None:
    """Raises InputError with every response whose model the runs do not suffice for."""
    from doe.designs.evaluation import lost_terms

    runs = len(design.coded)

    def lost(model: Model) -> list[str]:
        return lost_terms(design.coded, terms_of(study, model), design.block)

    def needed(model: Model) -> int:
        return len(terms_of(study, model)) + design.blocks

    def simpler(model: Model) -> str:
        others: tuple[Model, ...] = "pure_quadratic", "interaction", "linear"
        less = [each for each in others if set(terms_of(study, each)) < set(terms_of(study, model))]
        fitting = [each for each in less if runs >= needed(each) and not lost(each)]
        return f"choose a simpler model{' (' + ' or '.join(fitting) + ')' if fitting else ''}"

    faults = []
    for number, response in enumerate(study.file.response, 1):
        model, least = response.model, needed(response.model)
        where = f"{study.path}: response[{number}].model = {model!r}"
        if runs < least:
            effects = f", {counted(design.blocks - 1, 'block effect')}" if design.blocks > 1 else ""
            what = f"{least - design.blocks} terms{effects}"
            few = f"the {counted(runs, 'run')} of the design {are(runs)} too few; it needs {least} ({what} and one to judge the fit)"
            key = "runs" if "runs" in KEYS_OF[study.file.design.kind] else "centre_replicates"
            more = "enlarge the design" if key != "runs" and lost(model) else f"raise design.{key}"
            faults.append(f"{where}: {few}: {more} or {simpler(model)}")
        elif gone := lost(model):
            fix = f"add levels or centre points, or {simpler(model)}"
            faults.append(
                f"{where}: the runs of the design cannot separate {', '.join(gone)} from the other terms; {fix}"
            )
    refuse(faults)


def evaluation(study: Study, design: Design) -> dict[str, Any]:
    """How good the design is for the largest model that a response asks for, with its name as ``model``.

    See `doe.designs.evaluation.evaluate`. Raises InputError when the runs do not suffice.
    """
    from doe.designs.evaluation import evaluate

    check_runs(study, design)
    model = max((response.model for response in study.file.response), key=lambda each: len(terms_of(study, each)))
    judged = evaluate(design.coded, terms_of(study, model), design.block, region=design.region, reach=design.extent)
    return {"model": model, **judged}


# Name of the store in the folder of a study.
STORE = "study.sqlite"


@dataclass(frozen=True)
class Runs:
    """Design runs: coded and actual factors (n, k), responses (n, m) and their 95 % half-widths.

    ``notes``: what the simulations warn of, once each; none for a table that was read. ``replicates``, (n,) or (n, m),
    count the independent values behind the half-widths (0: unknown), ``block`` (n,) labels each run; None: all unknown,
    one block. ``failures``: design runs that failed; they are not in the arrays. ``turns``: shaft turns that all runs took.
    """

    coded: Array
    actual: Array
    values: Array
    errors: Array
    notes: tuple[str, ...] = ()
    replicates: Whole | None = None
    block: Whole | None = None
    failures: tuple[Failure, ...] = ()
    turns: float = 0.0

    @property
    def places(self) -> list[int]:
        """Place in the design, from 0, of every row."""
        failed = {failure.run for failure in self.failures}
        return [row for row in range(len(self.coded) + len(failed)) if row + 1 not in failed]

    def only(self, places: list[int]) -> Self:
        """The rows at these places."""
        coded, actual, values, errors = (array[places] for array in (self.coded, self.actual, self.values, self.errors))
        replicates, block = (None if array is None else array[places] for array in (self.replicates, self.block))
        return type(self)(coded, actual, values, errors, self.notes, replicates, block)


@dataclass(frozen=True)
class Ordered:
    """The design runs as they are to be simulated: coded and actual factors (n, k), and of each run its scene, its label
    and its factors by name."""

    design: Design
    actual: Array
    scenes: list[Scene]
    labels: list[str]
    factors: list[dict[str, float]]


def ordered_runs(study: Study) -> Ordered:
    """Every run of the study's design. Raises InputError when the design, a scene or a response is impossible."""
    clearance.check_responses(study)
    design = design_of(study)
    actual = actual_of(study, design)
    scenes = clearance.design_scenes(study, actual, design.order.tolist())
    labels = [f"design run {run}" for run in range(1, len(actual) + 1)]
    return Ordered(design, actual, scenes, labels, [study.by_factor(point) for point in actual])


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

    Runs that fail are left out. Raises InputError, KeyboardInterrupt, and RunError when too few are left.
    """
    ordered = ordered_runs(study)
    check_runs(study, ordered.design)
    with Store(folder / STORE, study.path.stem) as store:
        simulations = clearance.Simulations(store, workers, scheduler, retry, lambda title: progress, agenda)
        return runs_of(study, ordered, simulations, progress)


def runs_of(study: Study, ordered: Ordered, simulations: clearance.Simulations, progress: Progress) -> Runs:
    """The same of runs that were checked."""
    design, coded, actual = ordered.design, ordered.design.coded, ordered.actual
    results = simulations.run(ordered.scenes, ordered.labels, progress, ordered.factors)
    failures = tuple(result for result in results if isinstance(result, Failure))
    left = [row for row, result in enumerate(results) if not isinstance(result, Failure)]
    # One a term, one a block beyond the first, one to judge the fit.
    needed = design.blocks + max(len(terms_of(study, response.model)) for response in study.file.response)
    if failures and len(left) < needed:
        raise RunError(
            f"only {len(left)} of {len(results)} design runs went well, of which the response models need {needed}: "
            f"{sentence(failures)}"
        )
    sound = [result for result in results if not isinstance(result, Failure)]
    notes = _each_once((note for result in sound for note in result.notes), len(sound))
    if failures:
        notes.append(
            f"{counted(len(failures), 'design run')} failed and {are(len(failures))} left out: {sentence(failures)}"
        )
    values, errors, independent = clearance.figures(study.responses, sound)
    block = np.array(design.block_numbers)[left] if design.blocks > 1 else None
    return Runs(
        coded[left], actual[left], values, errors, tuple(notes), independent, block, failures, turns=simulations.turns
    )


def _each_once(notes: Iterable[str], runs: int) -> list[str]:
    """Notes of so many ``runs``; of those that differ in their numbers only the first, and in how many runs there are."""
    same = ((group, len(set(group)) == 1) for group in alike(notes, str))
    return [
        group[0] if one else f"{group[0]} (in {len(group)} of {runs} runs; figures of the first)" for group, one in same
    ]


def read_runs(study: Study, path: Path) -> Runs:
    """Runs of a CSV table instead of simulated ones. Raises InputError."""
    table = read_table(path, study.factors, study.responses, study.path)
    coded = study.coded(table.actual)
    return Runs(coded, table.actual, table.values, table.errors, replicates=table.replicates, block=table.block)
