"""Simulated points that are better than the pick in every response, and why none of them is the pick.

The pick is chosen before it is simulated: by predicted responses, at the ends of its tolerances where the study asks for that. A
point with worse predictions may turn out better in every response.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from doe.pareto import Goals, ParetoFront
from doe.workflow.adaptive import Adaptive
from doe.workflow.confirmation import ORDER, Confirmed, limits_of, point_words, verdict_of
from doe.workflow.pick import SearchedPick
from doe.workflow.problem import Problem
from doe.workflow.surfaces import predict_all, quadratics
from rbdyn.base.arrays import Array, Mask
from rbdyn.base.words import improvement, quantity


class Prediction(NamedTuple):
    """Costs (q,) that count in the choice of the pick, and whether the point keeps all limits there."""

    costs: Array
    keeps: bool


@dataclass(frozen=True, eq=False)
class Forecast:
    """Predictions by which the pick of a study was chosen, and the ``source`` of these in words.

    ``searched`` and ``searched_pick`` are None where the pick is one of the front on the surfaces.
    """

    study: Problem
    front: ParetoFront
    searched: Adaptive | None
    searched_pick: SearchedPick | None

    @property
    def with_tolerances(self) -> bool:
        """Whether the ends of the tolerances count in the choice."""
        if self.searched_pick is not None:
            return self.searched_pick.aware is not None
        return self.front.tolerance_aware is not None

    @property
    def source(self) -> str:
        """What predicts the responses."""
        return "the surfaces predict" if self.searched is None else f"the runs of the {self.searched.name} front have"

    def at(self, point: Array) -> Prediction | None:
        """The prediction at a point (k,) in factor units; None for a point that was no candidate."""
        goals = self.study.goals
        if self.searched is None or self.searched_pick is None:
            return self._on_surfaces(goals, self.study.coded(point)[None])
        front, aware = self.searched.front, self.searched_pick.aware
        same = [np.array_equal(self.study.rounded_within(row), point) for row in front.points]
        if not any(same):
            return None
        costs, violations = (front.costs, goals.violations(front.values, front.values))
        if aware is not None:
            costs, violations = aware.costs, aware.violations
        row = same.index(True)
        return Prediction(costs[row], not (violations[row] > 0.0).any())

    def _on_surfaces(self, goals: Goals, coded: Array) -> Prediction:
        if (aware := self.front.tolerance_aware) is not None:
            judged = aware.box.judge(quadratics(self.study.surfaces, len(self.study.factors)), goals, coded)
            return Prediction(judged.costs[0], not (judged.violations[0] > 0.0).any())
        values = predict_all(self.study.surfaces, coded)
        return Prediction(goals.costs(values)[0], not (goals.violations(values, values)[0] > 0.0).any())


def better_points(study: Problem, confirmed: Mapping[str, Confirmed]) -> list[str]:
    """Names of the simulated points that are better than the pick in every response with a goal."""
    goals = study.goals
    costs = {name: goals.costs(point.values) for name, point in confirmed.items()}
    return [name for name in confirmed if name not in ("baseline", "pick") and (costs[name] < costs["pick"]).all()]


def rivals_sentences(forecast: Forecast, confirmed: Mapping[str, Confirmed]) -> list[str]:
    """For each point that is better than the pick in every response as simulated: why it is not the pick, in one sentence."""
    return [
        f"Point {point_words(name)} is better than the pick in every response as simulated"
        f"{_uncertain(forecast.study, confirmed[name], confirmed['pick'])}, {_reason(forecast, confirmed[name], confirmed['pick'])}."
        for name in better_points(forecast.study, confirmed)
    ]


def _uncertain(study: Problem, rival: Confirmed, pick: Confirmed) -> str:
    """The responses whose difference is within its error."""
    goals = study.goals
    apart = np.abs(rival.values - pick.values) <= np.nan_to_num((rival.estimate - pick.estimate).half_width, nan=np.inf)
    names = [quantity(study.responses[index])[0] for index in goals.objectives if apart[index]]
    return f" ({' and '.join(names)} only within the error)" if names else ""


def _reason(forecast: Forecast, rival: Confirmed, pick: Confirmed) -> str:
    """Why a point is not the pick, by what was known of both when the pick was chosen."""
    study = forecast.study
    limits = limits_of(study, rival)
    if ORDER.index(verdict_of(limits)) > ORDER.index(verdict_of(limits_of(study, pick))):
        worst = max(limits, key=lambda limit: ORDER.index(limit.verdict))
        bound = f"{quantity(worst.response)[0]} {worst.sense} {worst.bound:g}"
        return (
            f"but it breaks the limit {bound}" if worst.verdict == "broken" else f"but its limit {bound} is undecided"
        )
    here, there = forecast.at(rival.point), forecast.at(pick.point)
    if here is None and forecast.searched is not None:
        return f"but it is no point of the {forecast.searched.name} front, from which the pick is chosen"
    where = " at the ends of its tolerances" if forecast.with_tolerances else ""
    if here is not None and there is not None:
        if there.keeps and not here.keeps:
            return f"but {forecast.source} a broken limit{where}"
        if (worse := here.costs > there.costs).any():
            return (
                f"but{where} {forecast.source} {_losses(study, here.costs, there.costs, worse, pick)} than at the pick"
            )
    return "and nothing that the study knows speaks against it: consider it"


def _losses(study: Problem, costs: Array, pick_costs: Array, worse: Mask, pick: Confirmed) -> str:
    """'power loss 1.2 % more' of the responses in which a point is predicted worse than the pick."""
    goals = study.goals
    percent = 100.0 * (pick_costs - costs) / np.abs(pick.values[goals.objectives])
    return " and ".join(
        f"{quantity(study.responses[index])[0]} {improvement(float(change), None, study.file.response[index].goal)}"
        for index, change, loss in zip(goals.objectives, percent, worse, strict=True)
        if loss
    )
