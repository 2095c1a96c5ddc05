"""The duty in a study's answer: baseline and pick at every point, and what the compromise costs there.

The pick is the compromise of all points. The front on the surfaces of one point's runs alone has a pick of its own. The change from
the study's pick to that, on these surfaces, is what the compromise costs at the point; no run is made for it.

With or without a duty: the clearances in operation at baseline and pick.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.duty import DutyResult
from doe.study_file.study import PointResponse, Response
from doe.workflow.confirmation import Confirmed, Gain, gains
from doe.workflow.front import find_front, out_of_reach
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs
from doe.workflow.surfaces import PredictedGain, fit_surfaces, predict_all, predicted_gains
from rbdyn.base.arrays import Array, one_thread
from rbdyn.base.faults import InputError, MethodError, given
from rbdyn.base.records import Record, finite, keyed
from rbdyn.base.words import chance
from rbdyn.clearances import REPORTED
from rbdyn.life import DutyLife, DutyLifeFigures
from rbdyn.properties.catalogue import classes_at
from rbdyn.result import SimulatedValue, arrays_of
from rbdyn.scene import Scene
from rbdyn.scene.notes import catalogue_entry

# Most generations of the search for the pick of a point alone, of which no run is made.
GENERATIONS = 50
RADIAL = "bearing.radial_clearance_mm"
# Clearance of a scene by the key of its value on the drawing.
NAMES = {clearance.key: clearance.name for clearance in REPORTED}


class OperatingClearances(Record):
    """Factors that are clearances, at the baseline and at the pick.

    ``operating``: by factor, the clearance in operation [mm] by name of the point; empty without [mounting], because
    nothing else changes it. ``class_sentence``: the class of the pick's radial clearance by ISO 5753-1; empty if that is
    no factor or the bore is unknown.
    """

    operating: dict[str, dict[str, float]]
    class_sentence: str


def operating_clearances(study: Problem, points: Mapping[str, Scene]) -> OperatingClearances:
    """Clearances in operation of scenes by name of their point, "pick" among them."""
    operating = {
        factor.name: {name: _operating_mm(scene, factor.key) for name, scene in points.items()}
        for factor in study.file.factor
        if factor.key in NAMES and all(_changes(scene, factor.key) for scene in points.values())
    }
    radial = any(factor.key == RADIAL for factor in study.file.factor)
    pick = points["pick"]
    bore, drawn_um = bore_of(pick), 1e3 * pick.bearing.radial_clearance_mm
    class_words = "" if bore is None or not radial else class_sentence(bore, drawn_um, pick.bearing.kind)
    return OperatingClearances(operating, class_words)


def bore_of(scene: Scene) -> float | None:
    """Bore of the bearing [mm]; None if the scene does not state it."""
    if scene.mounting is not None:
        return scene.mounting.bore_mm
    listed = catalogue_entry(scene.bearing)
    return None if listed is None else listed[1].bore


def class_sentence(bore: float, drawn_um: float, kind: str) -> str:
    """The classes of ISO 5753-1 that hold a drawn radial clearance [um] at a bore [mm]; empty beyond the table of bores."""
    try:
        classes = classes_at(bore, drawn_um, kind)
    except MethodError:
        return ""
    clearance_words = f"ISO 5753-1 at a bore of {bore:g} mm: the selected radial clearance of {drawn_um:.3g} um"
    if not classes:
        return f"{clearance_words} falls in no class."
    first, *others = (f"{iso_class.name} ({iso_class.lower:g} to {iso_class.upper:g} um)" for iso_class in classes)
    return f"{clearance_words} falls in {first}{f', also in {others[0]}' if others else ''}."


def _changes(scene: Scene, key: str) -> bool:
    return scene.mounting is not None and scene.clearances[NAMES[key]] is not None


def _operating_mm(scene: Scene, key: str) -> float:
    return 1e3 * given(scene.clearances[NAMES[key]]).operating


class OwnPick(Record):
    """The pick at a point of the duty alone by factor, its responses on the surfaces of the point, and why it is.

    ``gains_over_pick``: how much better it is there than the study's pick, with the errors of these surfaces.
    """

    factors: dict[str, float]
    responses: dict[str, float]
    reason: str
    gains_over_pick: dict[str, PredictedGain]


class AtPoint(Record):
    """A point of the duty: its share of the time, its overrides, and the simulated figures of baseline and pick there.

    ``gains``: those of the pick over the baseline. ``own``: the pick of this point alone, or None with the reason in
    ``own_note``. ``operating_clearances_mm``: by factor, the clearance in operation by name of the end.
    """

    name: str
    share: float
    overrides: list[str] = keyed("set")
    baseline: dict[str, SimulatedValue]
    pick: dict[str, SimulatedValue]
    gains: dict[str, Gain]
    own: OwnPick | None
    own_note: str
    operating_clearances_mm: dict[str, dict[str, float]]
    origin: str | None = keyed("from", default=None)


class WorstPoint(Record):
    """The likeliest worst point of the duty, and the probability that it is."""

    point: str
    probability: float

    @property
    def words(self) -> str:
        """'cruise (probability 0.625)'."""
        return f"{self.point} (probability {chance(self.probability)})"


class LifeOverDuty(DutyLifeFigures):
    """Life over the duty by static loads, with that at each point alone [h] and the damage there; None where it has no end."""

    point_hours: dict[str, float | None]
    damage: dict[str, float]

    @classmethod
    def of(cls, life: DutyLife, names: Sequence[str]) -> "LifeOverDuty":
        """The life of a bearing over the points of these names."""
        hours = dict(zip(names, map(finite, life.point_hours), strict=True))
        return cls.from_attributes(life.figures, point_hours=hours, damage=dict(zip(names, life.damage, strict=True)))


class DutyAnswer(Record):
    """The points of a duty in the order of the study, and how each response follows from them.

    ``worst``: by simulated point, then by response that is a worst one, the likeliest worst point. ``life``: at "baseline"
    and "pick".
    """

    points: list[AtPoint]
    aggregate: dict[str, str]
    worst: dict[str, dict[str, WorstPoint]]
    life: dict[str, LifeOverDuty]


def duty_answer(study: Problem, runs: Runs, confirmed: Mapping[str, Confirmed]) -> DutyAnswer | None:
    """The answer at every point of the duty; None for a study without one."""
    if not study.shares:
        return None
    baseline, pick = confirmed["baseline"], confirmed["pick"]
    both = {"baseline": baseline, "pick": pick}
    scenes, points = {end: point.scenes(study) for end, point in both.items()}, []
    for point in study.file.duty:
        name, here = point.name, study_at(study, point.name)
        ends = [_at_point(here, end, name) for end in (baseline, pick)]
        alone, note = None, ""
        try:
            alone = own_pick(here, runs.at_points[name], pick.point)
        except InputError as error:
            note = f"{name} alone has no selected design: {'; '.join(error.faults)}"
        before, after = (
            {figure: quantity.simulated_value for figure, quantity in end.at_points[name].items()}
            for end in (baseline, pick)
        )
        at_ends = gains(here, *ends)
        plays = operating_clearances(study, {end: at_points[name] for end, at_points in scenes.items()}).operating
        ours = (name, study.shares[name], [*point.set], before, after, at_ends, alone, note, plays, point.origin)
        points.append(AtPoint(*ours))
    aggregate: dict[str, str] = {
        response.name: response.aggregate for response in study.file.response if not isinstance(response, PointResponse)
    }
    names = [point.name for point in points]
    worst = {
        end: {response: WorstPoint(*worst) for response, worst in confirmed.result.worst.items()}
        for end, confirmed in both.items()
        if isinstance(confirmed.result, DutyResult)
    }
    life = {end: LifeOverDuty.of(figures, names) for end, figures in lives(study, scenes).items()}
    return DutyAnswer(points, aggregate, worst, life)


def lives(study: Problem, ends: Mapping[str, Mapping[str, Scene]]) -> dict[str, DutyLife]:
    """Life over the duty of designs by name, of their scenes at each point."""
    from rbdyn.dynamics.part_figures import roller_duty_life

    names = [point.name for point in study.file.duty]
    shares = [study.shares[name] for name in names]
    return {end: roller_duty_life([scenes[name] for name in names], shares) for end, scenes in ends.items()}


def study_at(study: Problem, name: str) -> Problem:
    """The study of one point of the duty alone: with its figures as responses, and the limits that hold there.

    Wishes in ratios to the baseline are none for the figure itself.
    """
    limits = {
        response.figure: {"lower": response.lower, "upper": response.upper}
        for response in study.file.response
        if isinstance(response, PointResponse) and response.point == name
    }
    responses = list[Response]()
    for response in study.file.response:
        if isinstance(response, PointResponse):
            continue
        changes: dict[str, Any] = {"aggregate": "mean", "points": None, **limits.get(response.name, {})}
        if response.aggregate == "worst_relative" and response.goal == "target":
            changes |= {"goal": "none", "target": None}
        responses.append(response.model_copy(update=changes))
    front = study.file.front
    front = front.model_copy(update={"tolerance_aware": "none", "generations": min(front.generations, GENERATIONS)})
    return study.with_file(response=responses, duty=[], front=front)


@one_thread
def own_pick(study: Problem, runs: Runs, pick: Array) -> OwnPick:
    """The pick by the study's rule on the surfaces of a point's ``runs``, next to the ``pick`` (k,) of the whole duty.

    ``study`` is that of the point alone. Raises InputError where it has no front.
    """
    study = study.with_surfaces(fit_surfaces(study, runs))
    front = find_front(study)
    if front.violations is not None:
        raise out_of_reach(study, front.points[0], front.violations)
    point = study.rounded_within(front.points[front.pick])
    values = predict_all(study.surfaces, study.coded(point)[None])[0]
    over_pick = predicted_gains(study.with_file(baseline=study.by_factor(pick)), point)
    responses = dict(zip(study.responses, values.tolist(), strict=True))
    return OwnPick(study.by_factor(point), responses, front.pick_reason, {gain.response: gain for gain in over_pick})


def _at_point(study: Problem, confirmed: Confirmed, name: str) -> Confirmed:
    """A simulated point at one point of the duty, whose study it is."""
    figures = [confirmed.at_points[name][response] for response in study.responses]
    values, statistical, numerical, freedom = arrays_of(figures)
    return Confirmed(confirmed.point, values, statistical, numerical, freedom=freedom)
