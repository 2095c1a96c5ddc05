"""The whole study: design, runs, surfaces, front, confirmation, tolerances, dimension chains, a published table to compare with. Clearances in operation, the chains solved at the pick, and what is wrong with a study before anything runs."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from doe import clearance
from doe.clearance import Simulations, declares_unknowns
from doe.designs import Design
from doe.dimension_chain import Chain, ChainResult, chain_from, solve
from doe.pareto import ParetoFront
from doe.pareto.tolerance import WidestTolerances
from doe.response_surface import Surface
from doe.running.keeper import AgendaKeeper
from doe.running.runner import ANSWER, Progress, Stage
from doe.running.store import Failure, Store
from doe.study_file import Study
from doe.study_file.sections import chain_table
from doe.threads import one_thread
from doe.workflow.adaptive import Adaptive, Compared, advice, check_adaptive, compared, find_adaptive
from doe.workflow.confirmation import (
    Confirmed,
    Gain,
    Limit,
    Verdict,
    gains,
    limits_of,
    odds_sentence,
    sentence,
    verdict_of,
    whirl_sentence,
)
from doe.workflow.front import find_front, with_survival
from doe.workflow.goals import check_goals, region_of
from doe.workflow.pick import Chosen, Edge, SearchedPick, choose, draws_about, edge_of, neighbourhood, widest_of
from doe.workflow.robust import Robust, check_robust, judge, robust_advice
from doe.workflow.runs import STORE, Runs, check_given, check_runs, design_of, ordered_runs, run_design
from doe.workflow.status import FRONT, TOLERANCES, inputs_digest, study_stages
from doe.workflow.surfaces import Beside, beside, fit_surfaces, reference_runs, with_rivals
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, MethodError, check_all
from rbdyn.base.records import Record
from rbdyn.base.words import html_table, improvement, label, quantity, shown, with_error
from rbdyn.properties.catalogue import classes_at
from rbdyn.scene import Scene
from rbdyn.scene.notes import catalogued

RADIAL = "bearing.radial_clearance_mm"
# Which clearance of a scene a key holds as drawn.
CLEARANCES = {RADIAL: "radial", "cage.guide_clearance_mm": "guide", "cage.pocket_clearance_mm": "pocket"}


class OperatingClearances(Record):
    """Factors that are clearances, at the baseline and at the pick.

    ``operating``: by name of the factor the clearance in operation [mm] by name of the point; empty without [mounting], which
    alone makes it differ. ``class_sentence``: into which class of ISO 5753-1 the pick's radial clearance falls; empty where
    that is no factor or the bore is unknown.
    """

    operating: dict[str, dict[str, float]]
    class_sentence: str


def operating_clearances(study: Study, points: Mapping[str, Scene]) -> OperatingClearances:
    """Of scenes by name of their point, "pick" among them."""
    operating = {
        factor.name: {name: _operating_mm(scene, factor.key) for name, scene in points.items()}
        for factor in study.file.factor
        if factor.key in CLEARANCES and all(_changes(scene, factor.key) for scene in points.values())
    }
    radial = any(factor.key == RADIAL for factor in study.file.factor)
    pick = points["pick"]
    bore, drawn_um = bore_of(pick), 1e3 * pick.bearing.radial_clearance_mm
    named = "" if bore is None or not radial else class_sentence(bore, drawn_um, pick.bearing.kind)
    return OperatingClearances(operating, named)


def scenes_of(study: Study, baseline: Array, pick: Array) -> dict[str, Scene]:
    """The scenes of both points (k,)."""
    return {
        "baseline": clearance.confirmation_scene(study.at(()), baseline),
        "pick": clearance.confirmation_scene(study, pick),
    }


def bore_of(scene: Scene) -> float | None:
    """Bore of the bearing [mm]; None where the scene does not state it."""
    if scene.mounting is not None:
        return scene.mounting.bore_mm
    listed = catalogued(scene.bearing)
    return None if listed is None else listed[1].bore


def class_sentence(bore: float, drawn_um: float, kind: str) -> str:
    """Which classes of ISO 5753-1 hold a drawn radial clearance [um] at a bore [mm]; empty beyond the table of bores."""
    where = f"ISO 5753-1 at a bore of {bore:g} mm: the pick's radial clearance of {drawn_um:.3g} um"
    try:
        classes = classes_at(bore, drawn_um, kind)
    except MethodError:
        return ""
    if not classes:
        return f"{where} falls in no class."
    first, *others = (f"{each.name} ({each.lower:g} to {each.upper:g} um)" for each in classes)
    return f"{where} falls in {first}{f', also in {others[0]}' if others else ''}."


def _changes(scene: Scene, key: str) -> bool:
    return scene.mounting is not None and scene.clearances[CLEARANCES[key]] is not None


def _operating_mm(scene: Scene, key: str) -> float:
    play = scene.clearances[CLEARANCES[key]]
    assert play is not None
    return 1e3 * play.operating


def check_chains(study: Study) -> None:
    """Raises InputError for a chain that has no solution at the centre, or whose half width nothing gives.

    One whose half width is still to be found is tried with the widest that the region allows.
    """
    computed_later = study.file.tolerances is not None
    half_widths = region_of(study) * study.step if computed_later else np.full(study.step.size, np.nan)
    numbers = range(len(study.file.chain))
    check_all(partial(_chain, study, number, study.centre, half_widths) for number in numbers)


def solve_chains(
    study: Study, pick: Array, tolerances: WidestTolerances | None
) -> tuple[dict[str, ChainResult], list[str]]:
    """Every chain by name at the picked point (k,), and why any has no parts."""
    half_widths = np.full(pick.size, np.nan) if tolerances is None else tolerances.half_widths
    solved, notes = {}, []
    for number, chain in enumerate(study.file.chain):
        if (place := study.factors.index(chain.factor)) in study.inactive:
            notes.append(f"chain {chain.name}: not solved, since {chain.factor} means nothing at the pick's categories")
            continue
        widest, given = half_widths[place], chain.half_width_mm
        if given is not None and given > widest:
            why = f"wider than the {widest:.3g} within which the gains are kept as [tolerances] asks"
            where = f"{study.path}: chain {chain.name}: half_width_mm = {given:g}"
            notes.append(f"{where}: {why}; narrow it, or keep less")
        try:
            parts = _chain(study, number, pick, half_widths)
            solved[chain.name] = solve(parts, source=f"{study.path}: chain {chain.name}")
        except InputError as error:
            notes += error.faults
    return solved, notes


def _chain(study: Study, number: int, point: Array, half_widths: Array) -> Chain:
    chain = study.file.chain[number]
    factor = study.factors.index(chain.factor)
    half_width = float(half_widths[factor]) if half_widths[factor] > 0.0 else None
    source = f"{study.path}: chain {chain.name}"
    try:
        table = chain_table(chain, study.path.parent, float(point[factor]), half_width)
    except InputError as error:
        raise InputError([f"{study.path}: {fault}" for fault in error.faults]) from None
    return chain_from(table, source)


def check_study(study: Study, adaptive: bool = False) -> Runs | None:
    """The published runs, if any; ``adaptive``: also of that search. Raises InputError with all faults of keys, responses, scenes, design and chains."""
    check_all(
        (
            lambda: check_runs(study, ordered_runs(study).design),
            lambda: clearance.confirmation_scene(study, study.baseline),
            lambda: check_chains(study),
            lambda: check_adaptive(study, adaptive),
        )
    )
    return reference_runs(study)


@dataclass(frozen=True, repr=False)
class StudyResult:
    """Everything a report needs.

    ``inputs`` is the hash of all it follows from. ``confirmed`` and ``gains`` by name of the point, "baseline" (without
    gains) and "pick" first; ``tried`` counts the points simulated as the pick until one kept its limits. ``tolerances`` is
    None where the study asks for none, ``adaptive``, what it is ``compared`` with and its ``searched_pick`` unless it was run, ``robust``
    where nothing is declared as unknown and it was not wanted.
    """

    study: Study
    inputs: str
    design: Design
    runs: Runs
    surfaces: list[Surface]
    front: ParetoFront
    adaptive: Adaptive | None
    searched_pick: SearchedPick | None
    compared: Compared | None
    robust: Robust | None
    edge: Edge
    tried: int
    confirmed: Mapping[str, Confirmed]
    gains: Mapping[str, list[Gain]]
    tolerances: WidestTolerances | None
    chains: Mapping[str, ChainResult]
    beside: list[Beside]
    reference_values: Array | None
    failures: tuple[Failure, ...]
    notes: tuple[str, ...]
    cost: Mapping[str, float]

    def __repr__(self) -> str:
        told = [
            f"{quantity(gain.response)[0]} {improvement(gain.percent, gain.error, gain.goal)}"
            for gain in self.gains["pick"]
        ]
        return f"<StudyResult: {', '.join([*told, *([self.limits_sentence] if self.limits_sentence else [])])}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: factors and simulated responses of baseline and pick, and what the pick gains."""
        places = zip(self.study.factors, self.baseline.point.tolist(), self.pick.point.tolist(), strict=True)
        rows = [(label(name), shown(before), shown(after), "") for name, before, after in places]
        both = [each for point in (self.baseline, self.pick) for each in (point.values.tolist(), point.error.tolist())]
        gained = {each.response: improvement(each.percent, each.error, each.goal) for each in self.gains["pick"]}
        for name, value, error, new, new_error in zip(self.study.responses, *both, strict=True):
            rows.append((label(name), with_error(value, error), with_error(new, new_error), gained.get(name, "")))
        return html_table("study: values ± 95 %, simulated", ("", "baseline", "pick", "change"), rows)

    @property
    def baseline(self) -> Confirmed:
        """The original design, simulated."""
        return self.confirmed["baseline"]

    @property
    def pick(self) -> Confirmed:
        """The chosen design, simulated."""
        return self.confirmed["pick"]

    @cached_property
    def clearances(self) -> OperatingClearances:
        """Clearances among the factors in operation, at baseline and pick."""
        points = scenes_of(self.study, self.baseline.point, self.pick.point)
        return operating_clearances(self.study, points)

    @property
    def limits(self) -> list[Limit]:
        """The limits at the pick."""
        return limits_of(self.study, self.pick)

    @property
    def verdict(self) -> Verdict:
        """What became of the limits at the pick; a study that did not keep them has failed."""
        return verdict_of(self.limits)

    @property
    def whirl_sentence(self) -> str:
        """That the whirl which the study improves is a jitter; empty where it is none, or not asked for."""
        return whirl_sentence(self.study, self.confirmed)

    @property
    def limits_sentence(self) -> str:
        """The same in words, and how likely they are kept over the unknown inputs; empty without limits."""
        judged = sentence(self.limits, self.study.file.confirmation.limit_probability, self.tried)
        odds = None if self.robust is None else self.robust.odds
        return f"{judged} {odds_sentence(self.study, odds)}".strip()


@one_thread
def run_study(
    study: Study,
    folder: Path,
    workers: int | None,
    progress: Callable[[str], Progress],
    scheduler: str | None = None,
    retry: bool = False,
    adaptive: bool = False,
    robust: bool = False,
    agenda: AgendaKeeper | None = None,
) -> StudyResult:
    """All of it; ``progress(title)`` gives the progress of a stage, ``scheduler`` is the address of a cluster to run on.

    ``retry``: run those again that failed before. ``adaptive``: also search the front of the simulator
    itself. ``robust``: judge the pick over the unknown inputs, which is also done where something is declared so. ``agenda``:
    where all runs are counted. Raises InputError, RunError, KeyboardInterrupt.
    """
    clock, inputs = _Clock(agenda), inputs_digest(study, adaptive, robust)
    check_goals(study)
    check_given(study, folder)
    if robust := robust or declares_unknowns(study):
        check_robust(study)
    reference = check_study(study, adaptive)
    clock.plan(study_stages(study, adaptive, robust))
    runs = run_design(study, folder, workers, progress("design runs"), scheduler, retry, agenda)
    clock.lap("design_s", FRONT)
    turns = runs.turns
    surfaces, found = _surfaces_and_front(study, runs, clock)
    with Store(folder / STORE, study.path.stem) as store:
        simulations = Simulations(store, workers, scheduler, retry, progress, agenda)
        searched = find_adaptive(study, runs, simulations) if adaptive else None
        if searched is not None:
            study, runs, surfaces, found = _with_its_categories(searched, runs, surfaces, found)
            clock.lap("adaptive_s")
        chosen = choose(study, surfaces, found, searched, simulations)
        confirmed, pick = chosen.confirmed, chosen.confirmed["pick"].point
        edge = _edge(study, surfaces, chosen, searched, simulations)
        clock.lap("confirmation_s")
        judged = judge(study, pick, simulations) if robust else None
        clock.lap("robust_s", TOLERANCES)
    tolerances = _tolerances(study, surfaces, searched, confirmed)
    chains, notes = solve_chains(study, pick, tolerances)
    clock.enter(ANSWER)
    reference = reference and reference.only(runs.places)
    lost = [failure for each in (searched, judged) if each for failure in each.failures]
    return StudyResult(
        study=study,
        inputs=inputs,
        design=design_of(study),
        runs=runs,
        surfaces=surfaces,
        front=with_survival(study, surfaces, chosen.front, confirmed),
        adaptive=searched,
        searched_pick=chosen.searched,
        compared=None if searched is None else compared(study, searched, found.points),
        robust=judged,
        edge=edge,
        tried=chosen.tried,
        confirmed=confirmed,
        gains=_gains(study, confirmed),
        tolerances=tolerances,
        chains=chains,
        beside=[] if reference is None else beside(study, runs, reference),
        reference_values=None if reference is None else reference.values,
        failures=(*runs.failures, *lost, *chosen.failures),
        notes=(*runs.notes, *notes, *_offers(study, surfaces, searched, judged)),
        cost=clock.total() | {"turns": turns + simulations.turns},
    )


def _surfaces_and_front(study: Study, runs: Runs, clock: "_Clock") -> tuple[list[Surface], ParetoFront]:
    surfaces = with_rivals(fit_surfaces(study, runs))
    clock.lap("fit_s")
    front = find_front(study, surfaces)
    clock.lap("front_s")
    return surfaces, front


def _offers(study: Study, surfaces: list[Surface], searched: Adaptive | None, judged: Robust | None) -> list[str]:
    """What further searches would bring that were not made."""
    return [*([] if searched else advice(study, surfaces)), *([] if judged else robust_advice(study))]


def _with_its_categories(
    searched: Adaptive, runs: Runs, surfaces: list[Surface], found: ParetoFront
) -> tuple[Study, Runs, list[Surface], ParetoFront]:
    """Study, runs, surfaces and their front with the categories of a search's pick."""
    if searched.runs is not runs:
        surfaces = with_rivals(fit_surfaces(searched.study, searched.runs))
        found = find_front(searched.study, surfaces)
    return searched.study, searched.runs, surfaces, found


def _edge(
    study: Study, surfaces: list[Surface], chosen: Chosen, searched: Adaptive | None, simulations: Simulations
) -> Edge:
    """Where the pick lies at the edge of what was searched; the simulator shows what is beyond where it was searched."""
    pick, front = chosen.confirmed["pick"], chosen.front.points
    if searched is None:
        return edge_of(study, surfaces, pick, front, None, None)
    return edge_of(study, surfaces, pick, front, searched.front.points, simulations, searched.edges)


def _tolerances(
    study: Study, surfaces: list[Surface], searched: Adaptive | None, confirmed: Mapping[str, Confirmed]
) -> WidestTolerances | None:
    pick, wished = confirmed["pick"], study.file.tolerances
    if wished is None:
        return None
    if searched is None:
        return widest_of(study, surfaces, pick.point, wished, confirmed)
    here = neighbourhood(study, surfaces, searched, study.coded(pick.point)[None], pick.values[None])
    drawn = draws_about(study, searched, here, pick, confirmed["baseline"])
    return widest_of(study, surfaces, pick.point, wished, confirmed, here, drawn)


def _gains(study: Study, confirmed: Mapping[str, Confirmed]) -> dict[str, list[Gain]]:
    return {name: gains(study, confirmed["baseline"], each) for name, each in confirmed.items() if name != "baseline"}


class _Clock:
    """Wall time of each stage [s]; stages without runs are entered in the agenda."""

    def __init__(self, agenda: AgendaKeeper | None) -> None:
        self._agenda = agenda
        self._started = self._last = time.perf_counter()
        self._laps: dict[str, float] = {}

    def plan(self, stages: Sequence[Stage]) -> None:
        """The stages to come."""
        if self._agenda is not None:
            self._agenda.plan(stages)

    def lap(self, name: str, following: str = "") -> None:
        """The stage ``name`` ends here, and the ``following`` one of the agenda begins."""
        now = time.perf_counter()
        self._laps[name], self._last = now - self._last, now
        self.enter(following)

    def enter(self, stage: str) -> None:
        """The ``stage`` of the agenda begins, if it is among those planned."""
        if self._agenda is not None and stage in [each.name for each in self._agenda.agenda.stages]:
            self._agenda.enter(stage)

    def total(self) -> dict[str, float]:
        """All stages and the whole."""
        return {**self._laps, "total_s": time.perf_counter() - self._started}
