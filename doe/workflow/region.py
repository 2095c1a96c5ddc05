"""The region of a study where its bearings run: clearances in operation at every point of the design and of the duty.

A region that reaches below the floor of a clearance (``rbdyn.mounting.RunningClearance.floor``) moves upward, and a sentence
says so. The file of the study stays as it is; its runs, fits and picks have the region that runs.

With stated temperatures nothing is simulated. With a heat balance short runs of the centre give the temperatures of all points. Where
these leave few kelvin anywhere, the corner with the least clearances is balanced too, for a land or a pocket that closes heats
itself: it takes more than at the centre, and may close altogether.

Short runs of the baseline tell, before its study is written, the class of its cage and the turns that runs need to discard.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from doe import clearance
from doe.duty import OPERATION, DutyScenes, Run, Simulated, cages_of, main_scene, results_at, scene_at, scenes_of
from doe.running.store import Failure
from doe.study_file.sections import Factor
from doe.workflow.effort import Effort
from doe.workflow.problem import Problem
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, RunError, given, refuse
from rbdyn.base.notes import Note
from rbdyn.base.words import all_of, counted, quantity
from rbdyn.dynamics.figures import why_missing
from rbdyn.mounting.cage import NEARLY_K, RunningClearance
from rbdyn.result import Quantity, SimulationResult
from rbdyn.scene import DrawnScene, Scene
from rbdyn.scene.lubricant import HOTTEST_C
from rbdyn.scene.thermal import Near, Temperatures, at_temperatures, begun_near, ceilings, near_of, part_temperatures
from rbdyn.verdict.orbits import CageVerdict

# Share of its width that a stated region keeps at least: it is narrowed that far, and moves beyond.
KEPT = 0.5
# Most points of a design whose clearances are looked at.
MOST_POINTS = 200
# A run that is long enough for temperatures within 1 K, and ceilings that judge later.
BALANCE = (
    "numerics.turns=5", "numerics.discard_turns=5", "numerics.replicates=2", "numerics.companion=false", "numerics.extend=false",
    f"thermal.oil_ceiling_C={HOTTEST_C:g}", "thermal.cage_ceiling_C=1000",
)  # fmt: skip
# Wider clearances [K of difference between parts] with which the balance is tried where the centre itself seizes.
WIDER_K = (0.0, 60.0, 120.0)
# Difference of temperatures [K] by which a moved region stays above the floors: those at another centre differ a little.
SPARE_K = 2.5
# Share of all that is taken from which a cause is named.
LEAST_CHANGE = 0.2
# Difference of temperatures [K] between two parts that is left at a point of the duty, below which its least corner is balanced.
FEW_K = 30.0
# By how much more a region moves [K] where that corner seizes by its own heat.
HOTTER_K = 10.0
# Times that the region is looked at: it moves for its centre, then for its corner.
MOST_LOOKS = 8
IMPACT_POWER = "pocket_impact_power_W"
# Turns that design runs discard, and those that they discard where a bearing forgets its start as fast as most do.
DISCARDED, FEWER = 20, 7
# Settings of short runs of the baseline beside what the study's runs set: of one as it is, whose replicates are as few as name a
# class of the cage, and of one that counts the turns between. Impacts have windows that fit both.
SHORT_RUN = ("numerics.extend=false", "numerics.impact_window_turns=4")
BETWEEN = (*SHORT_RUN, f"numerics.discard_turns={FEWER}", f"numerics.turns={(DISCARDED - FEWER) // 4 * 4}")
# Largest bias by fewer turns, over the error of six replicates: half of the error of the four of a design run; and over the figure,
# up to which it decides nothing.
SLIGHT_BIAS, NEGLIGIBLE_BIAS = 0.75, 1e-3

# Results of short runs of scenes with these labels.
Balances = Callable[[Sequence[Scene], Sequence[str]], Sequence[Simulated | Failure]]
# Temperatures of the parts that were found, by point of the duty, "" without one.
Heat = Mapping[str, Sequence[Temperatures]]


class Region(NamedTuple):
    """The study with the region in which its bearings run, and what was changed for it."""

    study: Problem
    notes: tuple[Note, ...] = ()


class Taken(NamedTuple):
    """A clearance at the point of the design and of the duty (``place``) that takes most of it, and its floor [m].

    ``hotter``: further difference of temperatures [K] that its own heat makes.
    """

    running: RunningClearance
    place: str
    floor: float
    hotter: float = 0.0

    @property
    def needed(self) -> float:
        """Least value of the drawing that leaves the floor [m]."""
        play = self.running.play
        return self.floor + play.drawn - play.operating + self.hotter * self.running.growth

    @property
    def target(self) -> float:
        """Least value of the drawing that a moved region has [m]: the same with other temperatures is no reason to move again."""
        return self.needed + SPARE_K * self.running.growth

    @property
    def at(self) -> str:
        """The place in words, to begin a sentence's part."""
        return f"at {self.place} " if self.place else ""

    @property
    def causes(self) -> str:
        """What takes of it, in words."""
        play = self.running.play
        changes = {"fits": play.fit, "heat": play.temperature, "rotation": play.rotation}
        taken = play.drawn - play.operating
        names = [name for name, change in changes.items() if -change > LEAST_CHANGE * abs(taken)]
        takes = "takes" if len(names) == 1 and names != ["fits"] else "take"
        risk = f"less than {1e6 * self.floor:.3g} um left would be nearly lost"
        risk += " and heat itself until it closes" if self.hotter else ""
        return f"{all_of(names)} {takes} {1e3 * taken:.3f} mm of it, and {risk}" if taken > 0.0 and names else risk


def region_that_runs(study: Problem, folder: Path, effort: Effort, kept: float = KEPT) -> Region:
    """The region of a study that runs, with a heat balance from the store in ``folder`` or simulated there.

    The notice of the ``effort`` hears of it at once. ``kept``: share of its width that a region keeps at least. Raises InputError
    for a region that nothing can move, RunError where its centre has no steady temperatures.
    """
    notice = effort.notice

    def balance(scenes: Sequence[Scene], labels: Sequence[str]) -> Sequence[Simulated | Failure]:
        if notice is not None:
            notice(f"{counted(len(scenes), 'short run')} for the temperatures of {labels[0].partition(' at ')[0]}")
        with effort.simulations(folder, study.path) as simulations:
            return simulations.run(list(scenes), labels, simulations.progress("heat balance"))

    region = moved_region(study, balance, kept)
    if notice is not None:
        for note in region.notes:
            notice(note)
    return region


class _UnknownError(Exception):
    """A run is not in the store."""


def region_in_store(study: Problem, folder: Path) -> Problem:
    """The study with the region that runs, if the runs in the store of ``folder`` tell; nothing is simulated."""

    def balance(scenes: Sequence[Scene], labels: Sequence[str]) -> Sequence[Simulated | Failure]:
        if (results := clearance.stored(folder, scenes, labels)) is None:
            raise _UnknownError
        return results

    try:
        return moved_region(study, balance).study
    except (_UnknownError, RunError):
        return study


def moved_region(study: Problem, balance: Balances, kept: float = KEPT) -> Region:
    """The study with its region moved to where every clearance stays above its floor at every point of the duty."""
    if not study.states("mounting"):
        return Region(study)
    heat, notes, near = _heat(study, balance)
    study = original = replace(study, near=near) if near else study
    stays = study.file.reference is not None
    hotter, moves, seen = dict[str, float](), dict[str, Taken](), set[tuple[float, ...]]()
    for _ in range(MOST_LOOKS):
        worst = _worst(study, heat, hotter)
        short = {key: taken for key, taken in worst.items() if _low_mm(study, taken) < 1e3 * taken.needed - 1e-6}
        movable = {} if stays else {key: taken for key, taken in short.items() if _place(study, key) is not None}
        if movable:
            study, moves = _moved(study, movable, kept), moves | movable
        elif stays or (corner := tuple(_corner(study, heat).tolist())) in seen:
            break
        else:
            seen.add(corner)
            _hear_of_corner(study, balance, np.array(corner), heat, hotter)
    notes += [_moved_note(original, study, key, taken) for key, taken in moves.items()]
    notes += [_lost_note(study, taken, heat) for key, taken in short.items() if key not in movable]
    if not moves:
        return Region(study, (*notes, *_scene_notes(study, heat)))
    study, baseline_notes = _with_baseline(original, study, balance, heat)
    return Region(study, (*notes, *baseline_notes))


def _corner(study: Problem, heat: Heat) -> Array:
    """The drawing (k,) with the least clearances of the region, other factors at their centre."""
    corner = study.centre.copy()
    for _, running in _running(study, corner, heat):
        if (place := _place(study, running.key)) is not None:
            corner[place] = study.ends[place, 0]
    return corner


def _hear_of_corner(
    study: Problem, balance: Balances, corner: Array, heat: dict[str, list[Temperatures]], hotter: dict[str, float]
) -> None:
    """Add to ``heat`` the temperatures of the corner (k,) where few kelvin are left, or to ``hotter`` where it has none."""
    ends = _endangered(study, corner, heat)
    for name, outcome in _balanced(study, balance, corner, list(ends), "the least clearances").items():
        if isinstance(outcome, Temperatures):
            heat[name].append(outcome)
        else:
            lost = ends[name]
            hotter[lost.key] = max(hotter.get(lost.key, 0.0), lost.kelvins_left - NEARLY_K + HOTTER_K)


def _endangered(study: Problem, point: Array, heat: Heat) -> dict[str, RunningClearance]:
    """By point of the duty with a heat balance, the clearance of a drawing (k,) that the fewest kelvin close; of few enough alone."""
    least: dict[str, RunningClearance] = {}
    for name, running in _running(study, point, heat) if heat else ():
        if running.kelvins_left < min(FEW_K, least[name].kelvins_left if name in least else FEW_K):
            least[name] = running
    return least


def _balanced(
    study: Problem,
    balance: Balances,
    point: Array,
    names: Sequence[str],
    words: str,
    near: dict[str, Near] | None = None,
) -> dict[str, Temperatures | str]:
    """Temperatures of a drawing (k,) at these points of the duty by short runs, or why it has none; those undecided are left out.

    ``near`` gets the balances.
    """
    if not names:
        return {}
    found: dict[str, Temperatures | str] = {}
    try:
        scenes = {name: begun_near(at, study.near.get(name)) for name, at in _scenes(study, point, BALANCE).items()}
    except InputError as error:
        return dict.fromkeys(names, str(error))
    labels = [f"{words}{f' at {name}' if name else ''}" for name in names]
    for name, result in zip(names, balance([scenes[name] for name in names], labels), strict=True):
        if isinstance(result, SimulationResult):
            nodes = result.temperatures_C or {}
            found[name] = Temperatures(*(nodes[node].value for node in Temperatures._fields))
            if near is not None and (balanced := near_of(result)) is not None:
                near[name] = balanced
        elif isinstance(result, Failure) and not result.cause.startswith("undecided"):
            found[name] = result.cause
    return found


def _place(study: Problem, key: str) -> int | None:
    """Place of the factor with this key of the scene; None where it is no factor."""
    return next((place for place, factor in enumerate(study.file.factor) if factor.key == key), None)


def _low_mm(study: Problem, taken: Taken) -> float:
    """Lowest value of a clearance on the drawings of the region [mm]."""
    place = _place(study, taken.running.key)
    return 1e3 * taken.running.play.drawn if place is None else float(study.ends[place, 0])


def _scenes(
    study: Problem, point: Array, overrides: Sequence[str] = (), kind: type[Scene] = Scene
) -> Mapping[str, Scene]:
    """Scenes of a drawing (k,) by point of the duty. Raises InputError for an impossible one."""
    seed = study.file.design.seed
    run = study.over_duty(lambda sets: study.scene_at(point, seed, [*sets, *overrides], kind))
    return {"": run} if isinstance(run, Scene) else run.scenes


def _running(study: Problem, point: Array, heat: Heat) -> Iterator[tuple[str, RunningClearance]]:
    """Clearances in operation of a drawing (k,) by point of the duty, at each of the temperatures found there."""
    for name, scene in _scenes(study, point, kind=DrawnScene).items():
        if (mounting := scene.mounting) is None:
            continue
        mountings = [mounting]
        if (thermal := scene.thermal) is not None:
            mountings = [mounting.model_copy(update=part_temperatures(thermal, nodes)) for nodes in heat[name]]
        yield from ((name, running) for hot in mountings for running in scene.running_clearances(hot).values())


def _worst(study: Problem, heat: Heat, hotter: Mapping[str, float]) -> dict[str, Taken]:
    """The place that takes most of each clearance, by its key, over all points of the design."""
    worst: dict[str, Taken] = {}
    points = np.unique(study.actual(study.design.coded), axis=0)
    for point in points[:: -(-len(points) // MOST_POINTS)]:
        for name, running in _running(study, point, heat):
            taken = Taken(running, name, _floor(study, running), hotter.get(running.key, 0.0))
            if running.key not in worst or taken.needed > worst[running.key].needed:
                worst[running.key] = taken
    return worst


def _floor(study: Problem, running: RunningClearance) -> float:
    """Floor of a clearance [m]; of a bearing that is meant to be preloaded, what the study states or none."""
    if running.touching > -math.inf:
        return running.floor
    if "least_clearance_um" in study.file.adaptive.model_fields_set:
        return 1e-6 * study.file.adaptive.least_clearance_um
    place = _place(study, running.key)
    drawn_mm = 1e3 * running.play.drawn if place is None else study.baseline[place]
    return running.floor if drawn_mm > 0.0 else -math.inf


def _heat(study: Problem, balance: Balances) -> tuple[dict[str, list[Temperatures]], list[Note], dict[str, Near]]:
    """Temperatures at the centre of the region by point of the duty, where they are too high, and the balances there.

    Raises RunError where the bearing has no steady temperatures even with wider clearances.
    """
    scenes = _scenes(study, study.centre, kind=DrawnScene)
    heat, causes, near = dict[str, list[Temperatures]](), dict[str, str](), dict[str, Near]()
    if all(scene.thermal is None for scene in scenes.values()):
        return {}, [], {}
    for kelvins in WIDER_K:
        cold = [name for name in scenes if name not in heat]
        words = "the middle of the region" + (" with wider clearances" if kelvins else "")
        found = _balanced(study, balance, _wider(study, scenes, kelvins), cold, words, near)
        for name in cold:
            outcome = found.get(name, "its temperatures are undecided")
            if isinstance(outcome, Temperatures):
                heat[name] = [outcome]
            else:
                causes[name] = outcome
        if len(heat) == len(scenes):
            notes = [note for name, scene in scenes.items() for note in _too_hot(scene, name, heat[name][0])]
            return heat, notes, near
    raise RunError(
        "; ".join(
            f"the middle of the region has no steady temperatures{f' at {name}' if name else ''}: {causes[name].rstrip('.')}"
            for name in cold
        )
        + "; wider clearances do not change that: give more or cooler oil, or less speed and load"
    )


def _wider(study: Problem, scenes: Mapping[str, Scene], kelvins: float) -> Array:
    """The centre (k,) with clearances as much wider as that many kelvin between the parts would take."""
    point = study.centre.copy()
    for scene in scenes.values():
        for running in scene.running_clearances(scene.mounting).values() if scene.mounting is not None else ():
            if (place := _place(study, running.key)) is not None:
                point[place] = study.centre[place] + 1e3 * kelvins * running.growth
    return point


def _too_hot(scene: Scene, place: str, nodes: Temperatures) -> Iterator[Note]:
    """Notes on the oil and the cage above their ceilings."""
    if scene.thermal is None:
        return
    parts = {"oil": nodes.oil, "cage": nodes.rollers + scene.thermal.cage_offset_K}
    for part, ceiling in ceilings(scene).items():
        if parts[part] > ceiling:
            yield Note(
                "heat",
                f"Too hot: the {part} reaches {parts[part]:.0f} C{f' at {place}' if place else ''} in the middle of the region, above "
                f"its ceiling of {ceiling:g} C (thermal.{part}_ceiling_C).",
            )


def _moved(study: Problem, short: Mapping[str, Taken], kept: float) -> Problem:
    """The study with the regions of these clearances moved. Raises InputError where one cannot move as far."""
    factors, reach, faults = list(study.file.factor), study.design.reach, list[str]()
    for key, taken in short.items():
        place = given(_place(study, key))
        low, high = study.ends[place].tolist()
        factor, needed = factors[place], 1e3 * taken.target
        top = max(high, needed + kept * (high - low))
        if factor.allowed is not None:
            top = min(top, factor.allowed[1])
        centre, step = _rounded(factor, needed, top, reach)
        if step <= 0.0:
            faults.append(
                f"{study.path}: factor.allowed of {factor.name} = {factor.allowed}: its region has to begin at {needed:.4g}, because "
                f"{taken.at}{taken.causes}; raise its upper end"
            )
            continue
        factors[place] = factor.model_copy(update={"centre": centre, "step": step})
    refuse(faults)
    moved = study.with_file(factor=factors)
    try:
        for point in (moved.actual(np.full(len(factors), sign * reach)) for sign in (-1.0, 1.0)):
            _scenes(moved, point, kind=DrawnScene)
    except InputError as error:
        why = "; ".join(f"{taken.at}{taken.causes}" for taken in short.values())
        raise InputError(
            [f"{study.path}: the region has to move ({why}), but there {fault}" for fault in error.faults]
        ) from None
    return moved


def _rounded(factor: Factor, low: float, high: float, reach: float) -> tuple[float, float]:
    """Centre and step of a region between two ends, rounded inward at the lower one, so that other bits of a temperature change neither."""
    step = 0.5 * (high - low) / reach
    if step <= 0.0:
        return low, 0.0
    coarse = factor.finest or 10.0 ** math.floor(math.log10(step) - 1.0)
    fine = coarse if step >= 10.0 * coarse else 0.1 * coarse
    step = round(math.floor(step / fine + 1e-9) * fine, 12)
    return round(math.ceil((low + reach * step) / coarse - 1e-9) * coarse, 12), step


def _moved_note(before: Problem, after: Problem, key: str, taken: Taken) -> Note:
    """How the region of a factor moved, and why."""
    place = given(_place(before, key))
    words, unit = quantity(before.factors[place])
    (low, high), (new_low, new_high) = before.ends[place], after.ends[place]
    verb = "moved" if new_high > high * (1.0 + 1e-9) else "narrowed"
    return Note(
        "region",
        f"The region of the {words} was {verb} to {new_low:.3f} to {new_high:.3f} {unit} (before: {low:.3f} to {high:.3f} {unit}): "
        f"{taken.at}{taken.causes}.",
    )


def _lost_note(study: Problem, taken: Taken, heat: Heat) -> Note:
    """A clearance below its floor that nothing moves. Raises InputError where it is lost in the middle of the region too."""
    running, key = taken.running, taken.running.key
    words, _ = quantity(key.rpartition(".")[2])
    stays = _place(study, key) is not None
    if any(running.seizes for _, running in _running(study, study.centre, heat) if running.key == key):
        fix = "widen the factor's centre" if stays else f"widen it in {study.scene.file}, or make it a factor"
        raise InputError(
            f"{study.path}: {key} = {1e3 * running.play.drawn:g}: {taken.at}{taken.causes}: the cage seizes; {fix}"
        )
    why = "runs of a table keep its region where it is" if stays else "no factor moves it"
    return Note(
        "seizure",
        f"{'Seizure' if running.lost else 'Nearly lost'}: {words} in operation is {1e6 * running.play.operating:.0f} um {taken.at}at "
        f"the edge of the region, where {1e6 * taken.floor:.0f} um are its floor; {why}.",
    )


def _with_baseline(
    original: Problem, moved: Problem, balance: Balances, heat: dict[str, list[Temperatures]]
) -> tuple[Problem, list[Note]]:
    """The moved study with the baseline of the original one, or, where that seizes, with its own centre."""
    point = original.baseline
    seized = [(running, name) for name, running in _running(original, point, heat) if running.lost]
    if not seized:
        ends = _endangered(original, point, heat)
        found = _balanced(original, balance, point, list(ends), "the baseline design")
        seized = [(ends[name], name) for name, outcome in found.items() if not isinstance(outcome, Temperatures)]
    baseline: dict[str, Any] = original.by_factor(point)
    notes = []
    if seized:
        baseline = moved.by_factor(moved.centre)
        notes.append(Note("seizure", _replaced(seized, "the baseline design")))
    return moved.with_file(baseline=baseline), notes


def _scene_notes(study: Problem, heat: Heat) -> list[Note]:
    """A warning where the scene's own clearances seize, and so the study has the middle of its region as baseline."""
    drawn = study.baseline.copy()
    for place, factor in enumerate(study.file.factor):
        table, _, key = factor.key.rpartition(".")
        drawn[place] = study.scene_tables.get(table, {}).get(key, drawn[place])
    if study.file.baseline or (drawn == study.baseline).all():
        return []
    seized = [(running, name) for name, running in _running(study, drawn, heat) if running.lost]
    return [Note("region", _replaced(seized, study.scene.file))] if seized else []


def _replaced(seized: Sequence[tuple[RunningClearance, str]], design: str) -> str:
    """That the middle of the region replaces a ``design`` that seizes, by its clearances at points of the duty."""
    running, name = min(seized, key=lambda pair: pair[0].kelvins_left)
    words, _ = quantity(running.key.rpartition(".")[2])
    left = f"{1e6 * running.play.operating:.0f} um{f' at {name}' if name else ''}"
    heats = "" if running.lost else ", which its own heat closes"
    return (
        f"Seizure: {words} of {design} in operation is {left}{heats}; gains are over the middle of the region instead."
    )


def baseline_cages(study: Problem, folder: Path, effort: Effort) -> dict[str, CageVerdict]:
    """Class of the cage at the baseline by point of the duty, by a short run; empty where none traces it, or the run fails."""
    run = _short_run(study, SHORT_RUN)
    if any(scene.cage_sample_s is None or why_missing(scene, IMPACT_POWER) for scene in scenes_of(run)):
        return {}
    result = _baseline_result(study, run, "the class of the cage", folder, effort)
    return {} if isinstance(result, Failure) else cages_of(result)


def slow_points(study: Problem, folder: Path, effort: Effort) -> list[str]:
    """Points of the duty, or OPERATION, where fewer discarded turns bias a response with a goal, by short runs of the baseline.

    They are all points where a run fails. A heat balance is made once: the turns between are at its temperatures.
    """
    usual = _baseline_result(study, _short_run(study, SHORT_RUN), "", folder, effort)
    if not isinstance(usual, Failure):
        between = _at_temperatures_of(usual, _short_run(study, BETWEEN, more=2))
        early = _baseline_result(study, between, "the turns to discard", folder, effort)
        if not isinstance(early, Failure):
            sooner, turns = results_at(early), main_scene(study.usual_run).numerics.turns
            return [
                point
                for point, found in results_at(usual).items()
                if any(_biased(found.responses[name], sooner[point].responses[name], turns) for name in study.aims)
            ]
    return [*study.shares] or [OPERATION]


def _biased(figure: Quantity, early: Quantity, turns: float) -> bool:
    """Whether a run that counts the ``early`` figure too, of so many turns, is biased by much of its error."""
    bias = (DISCARDED - FEWER) / turns * abs(early.value - figure.value)
    return bias > max(SLIGHT_BIAS * (figure.statistical_error or 0.0), NEGLIGIBLE_BIAS * abs(figure.value))


def _at_temperatures_of(result: Simulated, run: Run) -> Run:
    """The run at the temperatures that the heat balances of a result have."""
    hot = {
        name: at_temperatures(scene_at(run, name), Temperatures(**{node: it.value for node, it in nodes.items()}))
        for name, found in results_at(result).items()
        if (nodes := found.temperatures_C) is not None
    }
    return replace(run, scenes={**run.scenes, **hot}) if isinstance(run, DutyScenes) else hot.get(OPERATION, run)


def _short_run(study: Problem, settings: Sequence[str], more: int = 1) -> Run:
    """A run of the baseline with as few replicates as name a class of the cage, or ``more`` times as many."""

    def scene(sets: Sequence[str]) -> Scene:
        bare = study.scene_at(study.baseline, study.file.design.seed, sets, confirms=True)
        effort = [f"numerics.replicates={more * bare.verdict.limits.fewest_replicates}", *settings]
        return study.scene_at(study.baseline, study.file.design.seed, [*sets, *effort], confirms=True)

    return study.over_duty(scene)


def _baseline_result(study: Problem, run: Run, purpose: str, folder: Path, effort: Effort) -> Simulated | Failure:
    """Result of a short run of the baseline; the notice hears of its ``purpose``, if it has one."""
    if effort.notice is not None and purpose:
        scenes = scenes_of(run)
        numerics = scenes[0].numerics
        turns = numerics.replicates * (numerics.turns + numerics.warm_up_turns)
        effort.notice(f"{counted(len(scenes), 'short run')} of {turns:g} shaft turns for {purpose}")
    with effort.simulations(folder, study.path) as simulations:
        return simulations.run([run], ["baseline"], simulations.progress("baseline"))[0]
