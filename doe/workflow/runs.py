"""Runs of a study: those of its design, simulated with others in place of failed ones, or those of a table.

Design runs have few replicates at first, and get the others where noise would be much of what a surface predicts: a surface of p
terms fitted to n runs averages their noise, so that its predictions at the runs have p/n of the variance of that. They also get them
where the first ones differ about a limit on the class of the cage: then all judge it together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from operator import itemgetter
from pathlib import Path
from statistics import fmean
from typing import Self

import numpy as np
from scipy import special

from doe import clearance
from doe.designs import Design
from doe.designs.design import SAME_POINT
from doe.designs.model import Evaluation, lattice, lost_terms
from doe.designs.optimal import Remaining, added_points
from doe.duty import Simulated, cages_of, main_scene
from doe.running.runner import Progress
from doe.running.store import Cause, Failure, alike, grouped, sentence
from doe.study_file.sections import at_point
from doe.study_file.table import read_table
from doe.workflow.design import DesignRun, all_terms, check_runs, design_runs, evaluation, realised, terms_of
from doe.workflow.problem import Problem, RunPlan
from rbdyn.base.arrays import Array, Mask, Whole
from rbdyn.base.estimate import Estimate
from rbdyn.base.faults import RunError, given
from rbdyn.base.notes import DANGER, Note, Notes
from rbdyn.base.records import Record, finite
from rbdyn.base.tables.sheet import listed
from rbdyn.base.words import Notice, are, counted, with_error

# Times that failed runs are replaced: the last ones may fail too.
REPLACED = 3
# Largest share of noise in the variance of a predicted response.
NOISY = 0.1
# Least room between a run and a limit, in half-widths of the run: a limit farther away does not decide the pick.
CLEAR = 2.0
# Of bearings of `rbdyn new` at their own clearance the two lives have a ratio of 1.9 to 3.5, without clearance of 2.5 and more.
PLAIN_ROLLERS = Note(
    "omission",
    "life_h: the rollers are plain cylinders, whose edge stress it leaves out. The reference profile of ISO/TS 16281 gives about half to a "
    'fifth of it; for that write bearing.roller_profile = "logarithmic".',
)


class Runs(Record):
    """Design runs: coded and actual factors (n, k), responses (n, m) and their 95 % half-widths.

    ``notes``: distinct warnings of the simulations, or how a table was read; its responses without a value are NaN. ``replicates``, (n,) or (n, m), count the independent
    values of each half-width (0: unknown; None: all unknown). ``block`` (n,) labels each run; None: one block.
    ``failures``: failed design runs, which are not in the arrays. ``turns``: shaft turns of all runs. ``at_points``: by
    point of the duty, the same runs with the figures of the simulation there as responses; empty without a duty. ``design``: of
    simulated runs, with those added in place of failed ones. ``replicates_a_point``: replicates of each simulated run. ``other_cages`` (n, p): by point of the duty, the part of the replicates
    whose cage has no class that the study allows; None without a limit.
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
    other_cages: Array | None = None
    replicates_a_point: int = 0

    @property
    def places(self) -> list[int]:
        """Place in the design, from 0, of each row."""
        failed = {failure.run for failure in self.failures}
        return [row for row in range(len(self.coded) + len(failed)) if row + 1 not in failed]

    @property
    def cages_missed(self) -> Mask | None:
        """Whether most replicates of a run (n,) have a cage of no class that the study allows; None where none or all have."""
        if self.other_cages is None:
            return None
        missed: Mask = np.asarray((self.other_cages > 0.5).any(axis=1))
        return missed if missed.any() and not missed.all() else None

    @property
    def has_open_cages(self) -> bool:
        """Whether replicates of a run differ about the classes that the study allows."""
        return self.other_cages is not None and bool(((self.other_cages > 0.0) & (self.other_cages < 1.0)).any())

    def with_cages(self, other_cages: Array | None) -> Self:
        """The same with these parts of other cages, and a note on the runs outside the limit."""
        runs = replace(self, other_cages=other_cages)
        notes = [note for note in self.notes if note.code != "cage-class"]
        if (missed := runs.cages_missed) is not None:
            count = int(missed.sum())
            words = f"{counted(count, 'design run')} of {len(missed)} {are(count)} outside limits.cage.verdict."
            fix = "Front and selected design stay where the cage of the nearest run meets it."
            notes.insert(0, Note("cage-class", f"{words} {fix}"))
        return replace(runs, notes=tuple(notes))

    def only(self, places: list[int]) -> Self:
        """The rows at these places."""
        coded, actual, values, errors = (array[places] for array in (self.coded, self.actual, self.values, self.errors))
        replicates, block = (None if array is None else array[places] for array in (self.replicates, self.block))
        return type(self)(coded, actual, values, errors, self.notes, replicates, block)


def run_design(study: Problem, simulations: clearance.Simulations, progress: Progress) -> Runs:
    """Design runs, from the store or simulated; runs that failed are replaced by others where the models need them.

    Failed runs are left out. Raises InputError, KeyboardInterrupt, and RunError if too few runs remain.
    """
    ordered = study.plan
    check_runs(study, ordered.design)
    simulations = replace(simulations, turns_of={})
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
    # Whether few replicates suffice is judged by what the surfaces make of them.
    left_out = "few-samples" if study.further_replicates else ""
    notes = _distinct_notes([[note for note in result.notes if note.code != left_out] for result in sound])
    if "life_h" in study.figures and main_scene(study.usual_run).bearing.roller_profile == "cylinder":
        notes.append(PLAIN_ROLLERS)
    if failures:
        added = len(results) - planned
        instead = (
            f" {counted(added, 'other run')} in the rest of the region {are(added)} in their place." if added else ""
        )
        lost = f"{counted(len(failures), 'design run')} failed and {are(len(failures))} left out: {sentence(failures).rstrip('.')}."
        notes.insert(0, Note("lost-runs", f"{lost}{instead} Front and selected design stay near runs that went well."))
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
        replicates_a_point=study.first_replicates,
    ).with_cages(other_cages(study, sound))
    at_points = {}
    for name in study.shares:
        columns = [at_point(name, figure) for figure in study.figures]
        values, errors, independent = clearance.figures(columns, sound)
        at_points[name] = replace(runs, values=values, errors=errors, replicates=independent)
    return replace(runs, at_points=at_points)


def _lacking(study: Problem, design: Design, rows: list[int]) -> str:
    """What the models lack if only these runs of the design went well, to end a sentence; empty where they lack nothing."""
    # A run for each term, for each block beyond the first, and one to judge the fit.
    needed = design.blocks + max(len(terms_of(study, response.model)) for response in study.file.response)
    if len(rows) < needed:
        return f", but the response models need {needed}"
    lost = lost_terms(design.coded[rows], all_terms(study), design.block[rows])
    return f", which cannot separate {', '.join(lost)} from the other terms of the response models" if lost else ""


def _with_replacements(study: Problem, ordered: RunPlan, results: Sequence[Simulated | Failure]) -> RunPlan | None:
    """The plan with another run for each that failed, in what remains of the region; None where the models need none, or none is left."""
    failed = np.array([isinstance(result, Failure) for result in results])
    design, rows = ordered.design, np.flatnonzero(~failed)
    if not failed.any() or not rows.size or not _lacking(study, design, rows.tolist()):
        return None
    remaining = Remaining(design.coded[rows], design.coded[failed])
    places = lattice(len(study.factors), design.reach)
    if design.region == "ball":
        places = places[np.linalg.norm(places, axis=1) <= design.extent + SAME_POINT]
    candidates = realised(study, places[remaining.excess(places) < -SAME_POINT], design.reach)
    if not len(candidates):
        return None
    lacking = len(design.coded) - len(rows) - design.kind.count("added")
    coded = added_points(design.coded[rows], candidates, all_terms(study), max(int(lacking), 1))
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
        [*ordered.scenes, *study.design_scenes(actual, order.tolist())],
        [*ordered.labels, *(f"design run {first + number}" for number in range(1, count + 1))],
        [*ordered.factors, *map(study.by_factor, actual)],
    )


def other_cages(study: Problem, results: Sequence[Simulated]) -> Array | None:
    """Part (n, p) of the replicates whose cage has no class of the limit, by point of the duty; None without a limit."""
    if not (classes := study.file.limits.classes):
        return None
    return np.array([[found.part_other_than(classes) for found in cages_of(each).values()] for each in results])


def with_remaining(study: Problem, runs: Runs) -> Problem:
    """The study with what remains of its region where runs failed, or their cages have no class of the limit."""
    missed = np.zeros(len(runs.coded), bool) if runs.cages_missed is None else runs.cages_missed
    failed = [[failure.factors[name] for name in study.factors] for failure in runs.failures]
    if not failed and not missed.any():
        return study
    lost = study.coded(np.array(failed).reshape(-1, len(study.factors)))
    return replace(study, remaining=Remaining(runs.coded[~missed], np.vstack([lost, runs.coded[missed]])))


def _distinct_notes(notes: Sequence[Sequence[Note]]) -> list[Note]:
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
            distinct.append(Note("corner", f"{group[0]} ({some}{'' if alone else '; values of the first'})"))
        else:
            distinct.append(group[0] if alone else group[0].about(f"{some}; values of the first"))
    return distinct


def independent_values(runs: Runs) -> Whole:
    """Number of independent values (n, m) of each half width, from ``runs.replicates``; 0: unknown."""
    samples = np.zeros(len(runs.values)) if runs.replicates is None else np.asarray(runs.replicates)
    per_response = samples if samples.ndim == 2 else samples[:, None]
    return np.array(np.broadcast_to(per_response, runs.values.shape), np.int64)


def standard_errors(half_widths: Array, number: Whole) -> Array:
    """Standard errors of means from the half widths (n, m) of their 95 % intervals.

    The quantile is Student's with ``number`` - 1 degrees of freedom, where ``number`` (n, m) counts the independent
    values of each mean; for unknown numbers (0) it is the normal one.
    """
    student = special.stdtrit(np.maximum(number - 1, 1), 0.975)
    return half_widths / np.where(number > 1, student, special.ndtri(0.975))


def run_by_need(study: Problem, simulations: clearance.Simulations, progress: Progress, notice: Notice) -> Runs:
    """The design runs, with all their replicates where the first ones are too few; ``notice`` hears why. Raises as `run_design`."""
    runs = run_design(study, simulations, progress)
    if not study.further_replicates:
        return runs
    if not (names := [*noisy(study, runs), *["limits.cage.verdict"] * runs.has_open_cages]):
        return runs
    if notice is not None:
        notice(
            f"{study.first_replicates} replicates are too few for {listed(names)}: all runs continue to {study.usual_replicates}"
        )
    return _continued(study, runs, simulations)


def noisy(study: Problem, runs: Runs) -> list[str]:
    """Responses with a goal whose predictions have too much noise, or an unknown amount, and those with a limit near a run.

    Noise widens the margin to a limit.
    """
    errors = standard_errors(runs.errors, independent_values(runs))
    noise = np.ma.masked_invalid(errors**2).mean(axis=0).filled(np.inf)
    spread = np.ma.masked_invalid(runs.values).var(axis=0, ddof=1).filled(0.0)
    terms = np.array([len(terms_of(study, response.model)) for response in study.file.response])
    hidden = noise * terms / len(runs.coded) > NOISY * spread
    places = {place for place in study.goals.objectives if hidden[place]}
    for place, sense, limit in study.goals.limited:
        room = (limit - runs.values[:, place]) * (1.0 if sense == "<=" else -1.0)
        if (room <= CLEAR * runs.errors[:, place]).any():
            places.add(place)
    return [study.responses[place] for place in sorted(places)]


def _continued(study: Problem, runs: Runs, simulations: clearance.Simulations) -> Runs:
    """The runs with the replicates that they left out; a run whose others fail keeps its own."""
    places = runs.places
    scenes = study.design_scenes(runs.actual, given(runs.design).order[places].tolist(), further=True)
    labels = [f"design run {place + 1}" for place in places]
    found = simulations.run(scenes, labels, simulations.progress("design runs"))
    rows = [row for row, result in enumerate(found) if not isinstance(result, Failure)]
    sound = [result for result in found if not isinstance(result, Failure)]
    usual = study.usual_replicates

    def joined(before: Runs, names: Sequence[str]) -> Runs:
        first_runs, (value, half_width, samples) = before.only(rows), clearance.figures(names, sound)
        further_runs = replace(first_runs, values=value, errors=half_width, replicates=samples)
        mean = _mean(first_runs, further_runs, np.array([study.first_replicates, study.further_replicates]) / usual)
        values, errors, number = before.values.copy(), before.errors.copy(), independent_values(before)
        values[rows], errors[rows] = mean.value, mean.half_width
        number[rows] = np.where(np.isfinite(mean.freedom), np.round(mean.freedom) + 1.0, 0.0).astype(np.int64)
        return replace(before, values=values, errors=errors, replicates=number, replicates_a_point=usual)

    at_points = {
        name: joined(at, [at_point(name, figure) for figure in study.figures]) for name, at in runs.at_points.items()
    }
    cages = None if runs.other_cages is None else runs.other_cages.copy()
    if cages is not None and (further := other_cages(study, sound)) is not None:
        cages[rows] += (further - cages[rows]) * study.further_replicates / usual
    return replace(joined(runs, study.responses), at_points=at_points).with_cages(cages)


def _mean(first: Runs, further: Runs, shares: Array) -> Estimate:
    """Means (n, m) of two runs at each point, of which each has its share of the replicates."""
    pairs = []
    for runs in (first, further):
        number = independent_values(runs)
        freedom = np.where(number > 1, number - 1.0, np.inf)
        pairs.append([array.ravel() for array in (runs.values, standard_errors(runs.errors, number), freedom)])
    mean = Estimate(*(np.column_stack(pair) for pair in zip(*pairs, strict=True))).mean(shares)
    return Estimate(*(array.reshape(first.values.shape) for array in mean[:3]))


def read_runs(study: Problem, path: Path) -> Runs:
    """Runs of a table instead of simulated ones; a response without a value is NaN. Raises InputError."""
    table = read_table(path, study.factors, study.responses, study.path)
    coded = study.coded(table.actual)
    return Runs(coded, table.actual, table.values, table.errors, table.notes, table.replicates, table.block)


class EstimatedValue(Record):
    """A value with the half width of its 95 % interval, None where that is unknown."""

    value: float
    error: float | None

    @property
    def text(self) -> str:
        """The value with its error."""
        return with_error(self.value, self.error)


class StudyRun(DesignRun):
    """A run with its responses by name, none of a failed one."""

    responses: dict[str, EstimatedValue]


class StudyDesign(Record, kw_only=True):
    """The design of a study with the results of its runs, how good it is, and what failed."""

    kind: str
    runs: int
    factors: list[str]
    responses: list[str]
    points: list[StudyRun]
    evaluation: Evaluation
    failures: list[Cause]

    @classmethod
    def of(cls, study: Problem, design: Design, runs: Runs) -> Self:
        """The design with its ``runs``. Raises InputError if these are too few."""
        rows = zip(runs.values.tolist(), runs.errors.tolist(), strict=True)
        results = {
            place: {
                name: EstimatedValue(value, finite(error))
                for name, value, error in zip(study.responses, values, errors, strict=True)
            }
            for place, (values, errors) in zip(runs.places, rows, strict=True)
        }
        return cls.from_attributes(
            study,
            kind=study.file.design.kind,
            runs=len(design.coded),
            points=[
                StudyRun.from_attributes(run, responses=results.get(place, {}))
                for place, run in enumerate(design_runs(study, design))
            ],
            evaluation=evaluation(study, design),
            failures=grouped(runs.failures),
        )
