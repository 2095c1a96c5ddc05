"""The duty in a study's answer: baseline and pick at every point, and what the compromise costs there.

The pick is the compromise of all points. The front on the surfaces of one point's runs alone has a pick of its own. The change from
the study's pick to that, on these surfaces, is what the compromise costs at the point; no run is made for it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from doe.duty import scenes_of
from doe.study_file.study import PointResponse, Response
from doe.threads import one_thread
from doe.workflow.confirmation import Confirmed, Gain, gains
from doe.workflow.front import find_front, out_of_reach
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs
from doe.workflow.surfaces import PredictedGain, fit_surfaces, predict_all, predicted_gains
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError
from rbdyn.base.records import finite
from rbdyn.life.duty import DutyLife
from rbdyn.result import Quantity, arrays_of
from rbdyn.scene import Scene

Figures = Mapping[str, Quantity]


@dataclass(frozen=True, eq=False)
class OwnPick:
    """The pick (k,) at a point of the duty alone, why it is, and its responses by name on the surfaces of the point.

    ``gains``: how much better it is there than the study's pick, with the errors of these surfaces.
    """

    point: Array
    reason: str
    values: Mapping[str, float]
    gains: list[PredictedGain]

    def as_dict(self, study: Problem) -> dict[str, Any]:
        """JSON: factors, responses, reason, and by response the gain over the study's pick."""
        gains = {gain.response: gain.as_dict() for gain in self.gains}
        return {
            "factors": study.by_factor(self.point),
            "responses": dict(self.values),
            "reason": self.reason,
            "gains_over_pick": gains,
        }


@dataclass(frozen=True, eq=False)
class AtPoint:
    """A point of the duty: its share of the time, its overrides, and the simulated figures of baseline and pick there.

    ``gains``: those of the pick over the baseline. ``own``: the pick of this point alone, or None with the reason in ``note``.
    """

    name: str
    share: float
    overrides: list[str]
    baseline: Figures
    pick: Figures
    gains: list[Gain]
    own: OwnPick | None
    note: str = ""


@dataclass(frozen=True, eq=False)
class DutyAnswer:
    """The points of a duty in the order of the study, and how each response follows from them.

    ``worst``: by simulated point, then by response that is a worst one, the likeliest worst point of the duty and the
    probability that it is. ``life``: life over the duty at "baseline" and "pick", by static loads.
    """

    study: Problem
    points: list[AtPoint]
    aggregate: Mapping[str, str]
    worst: Mapping[str, Mapping[str, tuple[str, float]]]
    life: Mapping[str, DutyLife]

    def as_dict(self) -> dict[str, Any]:
        """JSON."""
        return {
            "points": [self._point(point) for point in self.points],
            "aggregate": dict(self.aggregate),
            "worst": {
                name: {
                    response: {"point": point, "probability": probability}
                    for response, (point, probability) in worst.items()
                }
                for name, worst in self.worst.items()
            },
            "life": {name: self._life(life) for name, life in self.life.items()},
        }

    def _life(self, life: DutyLife) -> dict[str, Any]:
        names = [point.name for point in self.points]
        return {
            **life.as_record(),
            "point_hours": dict(zip(names, map(finite, life.point_hours), strict=True)),
            "damage": dict(zip(names, life.damage, strict=True)),
        }

    def _point(self, point: AtPoint) -> dict[str, Any]:
        return {
            "name": point.name,
            "share": point.share,
            "set": list(point.overrides),
            "baseline": quantities_record(point.baseline),
            "pick": quantities_record(point.pick),
            "gains": {gain.response: gain.as_dict() for gain in point.gains},
            "own": None if point.own is None else point.own.as_dict(self.study),
            "own_note": point.note,
        }


def quantities_record(figures: Figures) -> dict[str, Any]:
    """JSON of figures by name: value, statistical and numerical error."""
    return {
        name: {key: getattr(quantity, key) for key in ("value", "statistical_error", "numerical_error")}
        for name, quantity in figures.items()
    }


def duty_answer(study: Problem, runs: Runs, confirmed: Mapping[str, Confirmed]) -> DutyAnswer | None:
    """The answer at every point of the duty; None for a study without one."""
    if not study.shares:
        return None
    baseline, pick = confirmed["baseline"], confirmed["pick"]
    points = []
    for point in study.file.duty:
        name, here = point.name, study_at(study, point.name)
        ends = [_at_point(here, end, name) for end in (baseline, pick)]
        own, note = None, ""
        try:
            own = own_pick(here, runs.at_points[name], pick.point)
        except InputError as error:
            note = f"{name} alone has no pick: {'; '.join(error.faults)}"
        figures = baseline.at_points[name], pick.at_points[name]
        points.append(AtPoint(name, study.shares[name], point.set, *figures, gains(here, *ends), own, note))
    aggregate = {
        response.name: response.aggregate for response in study.file.response if not isinstance(response, PointResponse)
    }
    worst = {"baseline": baseline.worst, "pick": pick.worst}
    life = lives(study, {"baseline": baseline.point, "pick": pick.point}, {"baseline": baseline.hot, "pick": pick.hot})
    return DutyAnswer(study, points, aggregate, worst, life)


def lives(
    study: Problem, ends: Mapping[str, Array], hot: Mapping[str, Mapping[str, Scene]] = MappingProxyType({})
) -> dict[str, DutyLife]:
    """Life over the duty of the original design, "baseline", and of others, points (k,) by name.

    ``hot``: scenes at the temperatures of a heat balance by name of the design and point.
    """
    from rbdyn.dynamics.duty import roller_duty_life

    names, life = [point.name for point in study.file.duty], {}
    for name, place in ends.items():
        run = study.confirmation_run(place)
        by_name = {**dict(zip(study.shares, scenes_of(run), strict=True)), **hot.get(name, {})}
        life[name] = roller_duty_life([by_name[point] for point in names], [study.shares[point] for point in names])
    return life


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
    front = study.file.front.model_copy(update={"tolerance_aware": "none"})
    return replace(study, file=study.file.model_copy(update={"response": responses, "duty": [], "front": front}))


@one_thread
def own_pick(study: Problem, runs: Runs, pick: Array) -> OwnPick:
    """The pick by the study's rule on the surfaces of a point's ``runs``, next to the ``pick`` (k,) of the whole duty.

    ``study`` is that of the point alone. Raises InputError where it has no front.
    """
    surfaces = fit_surfaces(study, runs)
    front = find_front(study, surfaces)
    if front.violations is not None:
        raise out_of_reach(study, front.points[0], front.violations)
    point = study.rounded_within(front.points[front.pick])
    values = predict_all(surfaces, study.coded(point)[None])[0]
    from_pick = study.file.model_copy(update={"baseline": study.by_factor(pick)})
    over_pick = predicted_gains(replace(study, file=from_pick), surfaces, point)
    return OwnPick(point, front.pick_reason, dict(zip(study.responses, values.tolist(), strict=True)), over_pick)


def _at_point(study: Problem, confirmed: Confirmed, name: str) -> Confirmed:
    """A simulated point at one point of the duty, whose study it is."""
    figures = [confirmed.at_points[name][response] for response in study.responses]
    values, statistical, numerical, freedom = arrays_of(figures)
    return Confirmed(confirmed.point, values, statistical, numerical, freedom=freedom)
