"""The whole study: from the design over runs, surfaces, front and pick to tolerances and dimension chains.

Its faults are found before anything runs. Its result also holds the clearances in operation and the comparison with a
published table.
"""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from doe.clearance import Simulations, every_scene, points_of, work_of
from doe.designs import Design
from doe.dimension_chain import Chain, ChainResult, chain_from, solve
from doe.dimension_chain.allocation import Allocation
from doe.dimension_chain.refusal import allocated_reason
from doe.duty import OPERATION, Duty, Simulated
from doe.pareto import ParetoFront
from doe.running.runner import ANSWER, AgendaKeeper, Part, Stage, rows_of
from doe.running.store import Failure
from doe.workflow import confirmation
from doe.workflow.adaptive import Adaptive, FrontComparison, advice, check_adaptive, compare_fronts, find_adaptive
from doe.workflow.design import check_runs
from doe.workflow.duty import DutyAnswer, OperatingClearances, duty_answer, operating_clearances
from doe.workflow.effort import Effort
from doe.workflow.front import OutOfReachError, check_goals, find_front, with_survival
from doe.workflow.obstacles import Obstacles, first_look, obstacles_of, without_broken
from doe.workflow.parts import Made, grade_of_parts
from doe.workflow.pick import Edge, SearchedPick, choose, draws_about, edge_of, neighbourhood
from doe.workflow.problem import Problem
from doe.workflow.region import region_that_runs
from doe.workflow.robust import Robust, case_of_study, judge
from doe.workflow.runs import Runs, run_by_need, with_remaining
from doe.workflow.status import DESIGN, FRONT, STEPS_S, TOLERANCES, inputs_digest, shorter_by, study_stages
from doe.workflow.surfaces import PublishedComparison, compare_with_published, fit_surfaces, reference_runs, with_rivals
from doe.workflow.tolerances import PickParts, PickTolerances
from rbdyn.base.arrays import Array, one_thread
from rbdyn.base.faults import InputError, MethodError, check_all
from rbdyn.base.notes import Note, Notes
from rbdyn.life import life_notes
from rbdyn.scene import Scene


def check_chains(study: Problem) -> None:
    """Raises InputError for a chain without a solution at the centre, or without a half width.

    If the study computes the half width later, the widest in the region stands for it.
    """
    half_widths, numbers = _widest_half_widths(study), range(len(study.file.chain))
    check_all(partial(_chain, study, number, study.centre, half_widths) for number in numbers)


def unmet_chains(study: Problem) -> list[str]:
    """Sentences on chains that no tolerances of their free parts can meet, wherever the pick is."""
    half_widths, sentences = _widest_half_widths(study), []
    for number, chain in enumerate(study.file.chain):
        try:
            search = Allocation(_chain(study, number, study.centre, half_widths))
            if not search.chain.is_stated and not search.fits(search.narrowest()):
                sentences.append(f"chain {chain.name} will violate its limits: {allocated_reason(search)}")
        except (InputError, MethodError):
            continue  # a fault of the study, which its checks report with all others
    return sentences


def _widest_half_widths(study: Problem) -> Array:
    """Half widths (k,) of the region where the study computes tolerances later, else unknown."""
    if study.file.tolerances is None:
        return np.full(study.step.size, np.nan)
    return study.half_ranges


def solve_chains(
    study: Problem, pick: Array, tolerances: PickTolerances | None
) -> tuple[dict[str, ChainResult], list[Note]]:
    """Every chain by name at the picked point (k,), and notes on chains without a solution."""
    half_widths = np.full(pick.size, np.nan) if tolerances is None else tolerances.half_widths
    solved, notes = {}, list[Note]()
    for number, chain in enumerate(study.file.chain):
        limit, half_width = half_widths[study.factors.index(chain.factor)], chain.half_width_mm
        if half_width is not None and half_width > limit:
            sentence = (
                f"{study.path}: chain {chain.name}: half_width_mm = {half_width:g}: is wider than the {limit:.3g} within which "
                "the gains are kept as [tolerances] asks; narrow it, or require less there"
            )
            notes.append(Note("chain", sentence))
        try:
            parts = _chain(study, number, pick, half_widths)
            solved[chain.name] = solve(parts, source=f"{study.path}: chain {chain.name}")
        except InputError as error:
            notes += [Note("missed-chain", fault) for fault in error.faults]
    return solved, notes


def _chain(study: Problem, number: int, point: Array, half_widths: Array) -> Chain:
    chain = study.file.chain[number]
    factor = study.factors.index(chain.factor)
    # Where no tolerance follows, parts are made to the one that the study states.
    half_width = float(half_widths[factor]) if half_widths[factor] > 0.0 else study.known_tolerances.get(chain.factor)
    source = f"{study.path}: chain {chain.name}"
    try:
        table = study.chain_table(chain, float(point[factor]), half_width)
    except InputError as error:
        raise InputError([f"{study.path}: {fault}" for fault in error.faults]) from None
    return chain_from(table, source)


def check_study(study: Problem, adaptive: bool = False, robust: bool = False) -> Runs | None:
    """The published runs, if any; ``adaptive``, ``robust``: whether the study also searches adaptively, and judges unknown inputs.

    Raises InputError with all faults of keys, responses, scenes, design and chains.
    """
    check_all(
        (
            lambda: check_runs(study, study.plan.design),
            lambda: study.confirmation_scene(study.baseline),
            lambda: check_chains(study),
            lambda: check_adaptive(study) if adaptive else None,
            lambda: case_of_study(study) if robust else None,
        )
    )
    return reference_runs(study)


@dataclass(frozen=True, repr=False)
class StudyResult:
    """Everything a report needs.

    ``inputs``: digest of the study, its files and the code. ``confirmed`` is by name of the point,
    "baseline" and "pick" first. ``tries``: points simulated as the pick until one kept its limits.

    ``tolerances`` is None if the study asks for none. ``adaptive``, ``searched_pick`` and ``front_comparison`` are None
    without the adaptive search, ``robust`` without the robust judgement, ``duty`` without a duty.
    """

    study: Problem
    inputs: str
    design: Design
    runs: Runs
    front: ParetoFront
    adaptive: Adaptive | None
    searched_pick: SearchedPick | None
    front_comparison: FrontComparison | None
    robust: Robust | None
    edge: Edge
    tries: int
    confirmed: Mapping[str, confirmation.Confirmed]
    tolerances: PickTolerances | None
    chains: Mapping[str, ChainResult]
    published_comparisons: dict[str, PublishedComparison]
    reference_values: Array | None
    failures: tuple[Failure, ...]
    notes: Notes
    cost: Mapping[str, float]
    duty: DutyAnswer | None = None

    @property
    def baseline(self) -> confirmation.Confirmed:
        """The original design, simulated."""
        return self.confirmed["baseline"]

    @property
    def pick(self) -> confirmation.Confirmed:
        """The chosen design, simulated."""
        return self.confirmed["pick"]

    @cached_property
    def gains(self) -> dict[str, dict[str, confirmation.Gain]]:
        """Simulated gains over the baseline, by name of the point and by response."""
        points = {name: point for name, point in self.confirmed.items() if name != "baseline"}
        return {name: confirmation.gains(self.study, self.baseline, point) for name, point in points.items()}

    @cached_property
    def scenes(self) -> dict[str, Scene]:
        """Scenes of baseline and pick; those with a heat balance at the temperatures of their runs."""
        return {name: self.confirmed[name].scenes(self.study)[self.main_point] for name in ("baseline", "pick")}

    @property
    def main_point(self) -> str:
        """The point of the duty that ``scenes`` are at."""
        duty = Duty.of(self.study)
        return OPERATION if duty is None else duty.main

    @property
    def cage_classes(self) -> dict[str, str]:
        """Class of the cage in these scenes; without one where they leave it out."""
        cages = {name: self.confirmed[name].cages.get(self.main_point) for name in ("baseline", "pick")}
        return {name: cage.name for name, cage in cages.items() if cage is not None}

    @cached_property
    def clearances(self) -> OperatingClearances:
        """Clearances among the factors in operation, at baseline and pick."""
        return operating_clearances(self.study, self.scenes)

    @property
    def made(self) -> dict[str, Made]:
        """By factor the half width that its parts are made to, and their grades: of the narrowest chain that closes on it."""
        made: dict[str, Made] = {}
        for chain in self.study.file.chain:
            result = self.chains.get(chain.name)
            if result is None or result.refused:
                continue
            half_width = 0.5 * (result.limits_mm[1] - result.limits_mm[0])
            if chain.factor not in made or half_width < made[chain.factor].half_width:
                grade = grade_of_parts(result.parts)
                made[chain.factor] = Made(half_width, grade and grade.name, chain.name)
        return made

    @property
    def limits(self) -> list[confirmation.Limit]:
        """The limits at the pick."""
        return confirmation.limits_of(self.study, self.pick)

    @property
    def missed_chains(self) -> dict[str, str]:
        """Why, by name: chains that miss their limits, and chains of a known width that no parts close."""
        missed = {name: chain.status for name, chain in self.chains.items() if chain.refused}
        for chain in self.study.file.chain:
            place = self.study.factors.index(chain.factor)
            widest = 0.0 if self.tolerances is None else self.tolerances.half_widths[place]
            if chain.name not in self.chains and (chain.half_width_mm or widest > 0.0):
                missed[chain.name] = "no parts close it, as the notes say"
        return missed

    @cached_property
    def obstacles(self) -> Obstacles:
        """All that keeps the study from its demands."""
        return obstacles_of(
            self.study, self.front, self.pick, self.missed_chains, self.tolerances, self.adaptive is not None
        )

    @property
    def status(self) -> str:
        """The verdict on the limits unless they are kept; then "missed" where a chain or the tolerances are, else "ok"."""
        if self.verdict != "kept":
            return self.verdict
        return "missed" if self.obstacles.sentences else "ok"

    @property
    def verdict(self) -> confirmation.Verdict:
        """The worst verdict on the limits at the pick; a study that did not keep them has failed."""
        return confirmation.verdict_of(self.limits)

    @property
    def every_note(self) -> Notes:
        """The dangers of the pick first, then those of its runs and of the baseline's, then all other notes."""
        pick = (*self.obstacles.notes, *confirmation.worse_notes(self.gains["pick"]))
        runs = (
            note.about(f"at the {confirmation.point_words(name)}")
            for name in ("pick", "baseline")
            for note in self.confirmed[name].dangers
        )
        duty, points = self.duty, self.study.file.duty
        hours = math.inf if duty is None else duty.life["pick"].L10_h or math.inf
        life = () if duty is None else life_notes(hours, sum(point.share for point in points))
        return (*pick, *life, *runs, *self.notes)


@one_thread
def run_study(
    study: Problem,
    folder: Path,
    effort: Effort,
    adaptive: bool = False,
    robust: bool = False,
    agenda: AgendaKeeper | None = None,
) -> StudyResult:
    """Run the whole study, with its runs in ``folder``.

    ``adaptive``: also search the front of the simulator itself. ``robust``: judge the pick over unknown inputs, as [robust] asks.
    ``agenda``: counts all runs. Raises InputError, RunError, KeyboardInterrupt.
    """
    clock, inputs = _Clock(agenda), inputs_digest(study, adaptive, robust)
    check_goals(study)
    robust = robust or study.asks_robust
    study, moves = region_that_runs(study, folder, effort)
    reference = check_study(study, adaptive, robust)
    if agenda is not None:
        agenda.plan(study_stages(study, adaptive, robust), shorter_by(study, adaptive, robust), STEPS_S)
    with effort.simulations(folder, study.path, agenda) as simulations:
        original = confirmation.simulate_original(study, simulations)
        clock.lap("baseline_s")
        watched = first_look(study, folder, original, simulations.progress(DESIGN), effort.notice)
        runs = run_by_need(study, simulations, watched, effort.notice)
        clock.lap("design_s", FRONT)
        study, turns = with_remaining(study, runs), runs.turns
        study = study.with_surfaces(with_rivals(fit_surfaces(study, runs)))
        clock.lap("fit_s")
        surface_front = find_front(study)
        clock.lap("front_s")
        searched, unsearched = _searched(study, runs, simulations, clock) if adaptive else (None, [])
        selection = choose(study, surface_front, searched, original, simulations)
        confirmed, pick = selection.confirmed, selection.confirmed["pick"].point
        edge = edge_of(study, confirmed["pick"], selection.front.points, searched, simulations)
        clock.lap("confirmation_s")
        robustness = judge(study, pick, simulations) if robust else None
        clock.lap("robust_s", TOLERANCES)
    tolerances = _tolerances(study, searched, confirmed)
    chains, notes = solve_chains(study, pick, tolerances)
    clock.enter(ANSWER)
    reference = reference and reference.only([place for place in runs.places if place < len(reference.coded)])
    steps = (runs, searched, robustness, selection)
    notes += [*moves, *unsearched, *(reference.notes if reference else ())]
    return StudyResult(
        study=study,
        inputs=inputs,
        design=runs.design or study.design,
        runs=runs,
        front=with_survival(study, selection.front, confirmed),
        adaptive=searched,
        searched_pick=selection.searched,
        front_comparison=None if searched is None else compare_fronts(study, searched, surface_front.points),
        robust=robustness,
        edge=edge,
        tries=selection.tries,
        confirmed=confirmed,
        tolerances=tolerances,
        chains=chains,
        published_comparisons={} if reference is None else compare_with_published(study, runs, reference),
        reference_values=None if reference is None else reference.values,
        failures=tuple(failure for step in steps if step for failure in step.failures),
        notes=(*notes, *(Note("advice", text) for text in ([] if searched else advice(study))), *runs.notes),
        duty=duty_answer(study, runs, confirmed),
        cost=clock.total() | {"turns": turns + simulations.turns},
    )


def _searched(
    study: Problem, runs: Runs, simulations: Simulations, clock: "_Clock"
) -> tuple[Adaptive | None, list[Note]]:
    """The adaptive search; None, with the reason in a note, where no point that it knows comes near to keeping the limits."""
    try:
        return find_adaptive(study, runs, simulations), []
    except OutOfReachError:
        sentence = (
            "the adaptive search ended without a front, because no predicted point is likely to meet all limits; the selected design is "
            "taken from the surfaces"
        )
        return None, [Note("advice", sentence)]
    finally:
        clock.lap("adaptive_s")


def _tolerances(
    study: Problem, searched: Adaptive | None, confirmed: Mapping[str, confirmation.Confirmed]
) -> PickTolerances | None:
    pick, settings = confirmed["pick"], study.file.tolerances
    if settings is None:
        return None
    scene, asked = study.confirmation_scene(pick.point), len(study.goals.limited)
    study = without_broken(study, pick)
    limits = "all limits" if len(study.goals.limited) == asked else "the limits that the selected design meets"
    parts = PickParts(study, pick.point, settings, confirmed, scene=scene, limits=limits)
    if searched is not None:
        neighbours = neighbourhood(study, searched, study.coded(pick.point)[None], pick.values[None])
        draws = draws_about(study, searched, neighbours, pick, confirmed["baseline"])
        parts = replace(parts, neighbours=neighbours, search_draws=draws)
    return parts.widest()


class _Clock:
    """Wall time of each stage [s]; it also enters stages without runs in the agenda."""

    def __init__(self, agenda: AgendaKeeper | None) -> None:
        self._agenda = agenda
        self._started = self._last = time.perf_counter()
        self._laps: dict[str, float] = {}

    def lap(self, name: str, next_stage: str = "") -> None:
        """The stage ``name`` ends here, and the ``next_stage`` of the agenda begins."""
        now = time.perf_counter()
        self._laps[name], self._last = now - self._last, now
        self.enter(next_stage)

    def enter(self, name: str) -> None:
        """Enter the stage of that name in the agenda, if it is planned."""
        if self._agenda is not None and name in [stage.name for stage in self._agenda.agenda.stages]:
            self._agenda.enter(name)

    def total(self) -> dict[str, float]:
        """Wall times [s] of all stages by name, and of the whole, to milliseconds."""
        times = {**self._laps, "total_s": time.perf_counter() - self._started}
        return {name: round(seconds, 3) for name, seconds in times.items()}


def run_part(
    study: Problem, folder: Path, effort: Effort, part: Part, agenda: AgendaKeeper
) -> list[Simulated | Failure]:
    """Simulate the design runs of a part of a study, with their store in ``folder``. Raises as ``run_study``."""
    study, _ = region_that_runs(study, folder, effort)
    check_study(study)
    ordered, rows = study.plan, rows_of(part)
    scenes, labels = ordered.scenes[rows], ordered.labels[rows]
    points = points_of(scenes, labels)
    works = {point.key: work_of(scene) for point, scene in zip(points, every_scene(scenes), strict=True)}
    if not works:
        raise InputError(f"--part {part[0]}/{part[1]}: has no run of {len(ordered.scenes)}; name fewer parts")
    agenda.plan([Stage(DESIGN, (DESIGN,), len(works), sum(works.values()))])
    with effort.simulations(folder, study.path, agenda) as simulations:
        return simulations.run(scenes, labels, simulations.progress(DESIGN), ordered.factors[rows])
