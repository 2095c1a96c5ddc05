"""The Pareto front on the surfaces as its record: points, picks, gains, limits, and the front with tolerances."""

from dataclasses import replace
from typing import Self

import numpy as np

from doe.pareto import ParetoFront
from doe.pareto.front import Dominance
from doe.pareto.manufacture import Survival, ToleranceAware
from doe.pareto.search import REFERENCE, dominates
from doe.workflow.confirmation import point_words
from doe.workflow.front import SurfaceDoubt
from doe.workflow.pick import place_of
from doe.workflow.problem import Problem
from doe.workflow.surfaces import PredictedGain, half_widths, predict_all, predicted_gains, statement
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.notes import Note
from rbdyn.base.records import Record, finite

WITHOUT = point_words("without_tolerances")


class Point(Record):
    """Factors and responses of a point, by name."""

    factors: dict[str, float]
    responses: dict[str, float]


class EstimatedPoint(Point):
    """A point with the 95 % half widths of its responses, None where they are unknown."""

    errors: dict[str, float | None]

    @classmethod
    def of(cls, study: Problem, point: Array, values: Array, errors: Array) -> "EstimatedPoint":
        """Factors (k,), responses (m,) and half widths (m,) by name."""
        return EstimatedPoint(
            factors=study.by_factor(point),
            responses=dict(zip(study.responses, values.tolist(), strict=True)),
            errors=dict(zip(study.responses, map(finite, errors.tolist()), strict=True)),
        )

    @classmethod
    def predicted(cls, study: Problem, point: Array) -> "EstimatedPoint":
        """A point (k,) in factor units by the surfaces."""
        coded = study.coded(point)[None]
        return EstimatedPoint.of(
            study, point, predict_all(study.surfaces, coded)[0], half_widths(study.surfaces, coded)[0]
        )

    @property
    def row(self) -> dict[str, float | None]:
        """Factors, responses, and their half widths."""
        errors = {f"{name}_error": error for name, error in self.errors.items()}
        return {**self.factors, **self.responses, **errors}


class FrontPoint(EstimatedPoint):
    """A point of the front with the probability that no other dominates it."""

    non_dominated_probability: float


class FrontPick(FrontPoint):
    """The pick, why it is that, whether it lies farther out than any run, and its factors at bounds of the region."""

    reason: str
    beyond_runs: bool
    at_bounds: dict[str, str]


class RobustPoint(Point):
    """A point of the front with tolerances; ``robust``: what manufacture leaves of its responses with a goal (of the distance from
    a target)."""

    robust: dict[str, float]


class RobustPick(RobustPoint):
    """The pick of the front with tolerances."""

    reason: str

    @property
    def row(self) -> dict[str, float]:
        """Factors and responses."""
        return {**self.factors, **self.responses}


class SurfaceLimit(Record):
    """A limit at a point: what the surfaces say there, and the probability of keeping it, found and demanded."""

    response: str
    sense: str
    limit: float
    value: float
    error: float | None
    kept: bool
    probability: float
    demanded_probability: float


class ToleranceFront(Record, kw_only=True):
    """The front with tolerances: ``quantile`` of the parts, None for the worst case of them."""

    kind: str
    quantile: float | None
    distribution: str
    half_widths: dict[str, float]
    front: list[RobustPoint]
    hypervolume: float
    pick: RobustPick
    picks: dict[str, RobustPoint]
    baseline_robust: dict[str, float]
    plain_pick_robust: dict[str, float]
    plain_pick_inside: bool
    nominal_loss_percent: float
    robust_gain_percent: float | None
    pick_gains_percent: dict[str, float]
    survival: Survival

    @classmethod
    def of(cls, study: Problem, aware: ToleranceAware) -> Self:
        """A tolerance-aware front."""
        goals = [response for response in study.file.response if response.goal != "none"]
        sign = np.array([-1.0 if response.goal == "max" else 1.0 for response in goals])

        def robust(costs: Array) -> dict[str, float]:
            return dict(zip((response.name for response in goals), (sign * costs).tolist(), strict=True))

        points = study.actual(aware.points)
        front = [
            RobustPoint(study.by_factor(point), dict(zip(study.responses, values.tolist(), strict=True)), robust(costs))
            for point, values, costs in zip(points, aware.values, aware.costs, strict=True)
        ]
        return cls(
            kind=aware.box.kind,
            quantile=aware.box.quantile if aware.box.kind == "quantile" else None,
            distribution=aware.box.distribution,
            half_widths=study.by_factor(aware.box.half * study.step),
            front=front,
            hypervolume=aware.hypervolume,
            pick=RobustPick(**vars(front[aware.pick]), reason=aware.pick_reason),
            picks={rule: front[row] for rule, row in aware.picks.items()},
            baseline_robust=robust(aware.baseline_costs),
            plain_pick_robust=robust(aware.plain_pick_costs),
            plain_pick_inside=aware.plain_inside,
            nominal_loss_percent=aware.nominal_loss_percent,
            robust_gain_percent=finite(aware.robust_gain_percent),
            pick_gains_percent={gain.response: gain.percent for gain in predicted_gains(study, points[aware.pick])},
            survival=aware.survival,
        )


class StatedPoint(EstimatedPoint):
    """A point that was asked for: its gains over the baseline, and what the front makes of it."""

    predicted_gains: dict[str, PredictedGain]
    dominated_by: int
    beyond_runs: bool
    at_bounds: dict[str, str]
    constraints: list[SurfaceLimit]
    sentences: list[str]
    statement: str

    @classmethod
    def at(cls, study: Problem, front: ParetoFront, point: Array) -> Self:
        """A point (k,) in factor units, compared with a front."""
        gains, place = predicted_gains(study, point), place_of(study, point)
        costs = study.goals.costs(predict_all(study.surfaces, study.coded(point)[None])[0])
        return cls(
            **vars(cls.predicted(study, point)),
            predicted_gains={gain.response: gain for gain in gains},
            dominated_by=int(dominates(front.costs, costs).sum()),
            beyond_runs=place.beyond,
            at_bounds=place.at_bounds,
            constraints=surface_limits(study, point),
            sentences=[gain.sentence for gain in gains],
            statement=f"{statement(gains)} {place.sentence('The point')}".rstrip(),
        )


class SurfaceFront(Record, kw_only=True):
    """The front on the surfaces, factors and responses in their own units and senses.

    ``hypervolume`` is that of the ``archive``; ``picks`` are by rule. ``tolerance_aware`` is None where the study asks for none,
    ``point`` where none was asked for.
    """

    front: list[FrontPoint]
    hypervolume: float
    largest_hypervolume: float
    hypervolume_history: list[float]
    ideal: dict[str, float]
    nadir: dict[str, float]
    knee: FrontPoint
    pick: FrontPick
    picks: dict[str, FrontPoint | RobustPick]
    baseline: EstimatedPoint
    pick_dominates_baseline: Dominance
    predicted_gains: dict[str, PredictedGain]
    statement: str
    constraints: list[SurfaceLimit]
    archive: int
    feasible_share: float
    evaluations: int
    generations: int
    seed: int
    tolerance_aware: ToleranceFront | None = None
    notes: list[Note] | None = None
    point: StatedPoint | None = None

    @classmethod
    def of(cls, study: Problem, front: ParetoFront) -> Self:
        """A front with its uncertainty."""
        sure, aware = front.uncertainty, front.tolerance_aware
        assert sure is not None
        rows = zip(front.points, front.values, half_widths(study.surfaces, study.coded(front.points)), strict=True)
        points = [
            FrontPoint(**vars(EstimatedPoint.of(study, *row)), non_dominated_probability=float(probability))
            for row, probability in zip(rows, sure.non_dominated, strict=True)
        ]
        gains, place = (predicted_gains(study, front.points[front.pick]), place_of(study, front.points[front.pick]))
        with_tolerances = None if aware is None else ToleranceFront.of(study, aware)
        picks: dict[str, FrontPoint | RobustPick] = {rule: points[row] for rule, row in front.picks.items()}
        return cls(
            front=points,
            hypervolume=front.hypervolume,
            largest_hypervolume=REFERENCE ** front.costs.shape[1],
            hypervolume_history=front.hypervolume_history.tolist(),
            ideal=_extreme(study, front, front.costs.argmin(axis=0)),
            nadir=_extreme(study, front, front.costs.argmax(axis=0)),
            knee=points[front.knee],
            pick=FrontPick(
                **vars(points[front.pick]),
                reason=front.pick_reason,
                beyond_runs=place.beyond,
                at_bounds=place.at_bounds,
            ),
            picks=picks if with_tolerances is None else picks | {"tolerance_aware": with_tolerances.pick},
            baseline=EstimatedPoint.predicted(study, study.baseline),
            pick_dominates_baseline=sure.pick_dominates,
            predicted_gains={
                gain.response: replace(gain, selection_optimism_percent=100.0 * excess / abs(gain.baseline))
                for gain, excess in zip(gains, sure.optimism.tolist(), strict=True)
            },
            statement=f"{statement(gains)} {place.sentence('The selected design' if aware is None else f'The {WITHOUT}')}".rstrip(),
            constraints=surface_limits(study, front.points[front.pick]),
            archive=front.archive_size,
            feasible_share=front.feasible,
            evaluations=front.evaluations,
            generations=front.generations,
            seed=front.seed,
            tolerance_aware=with_tolerances,
        )


def _extreme(study: Problem, front: ParetoFront, rows: Rows) -> dict[str, float]:
    """The responses with a goal where each is best or worst."""
    pairs = zip(front.goals.objectives, rows.tolist(), strict=True)
    return {study.responses[index]: float(front.values[row, index]) for index, row in pairs}


def surface_limits(study: Problem, point: Array) -> list[SurfaceLimit]:
    """Every limit at a point (k,) in factor units."""
    coded = study.coded(point)
    values, errors = predict_all(study.surfaces, coded[None])[0], half_widths(study.surfaces, coded[None])[0]
    doubt = SurfaceDoubt(study)
    return [
        SurfaceLimit(
            response=study.responses[index],
            sense=sense,
            limit=limit,
            value=float(values[index]),
            error=finite(errors[index]),
            kept=bool(values[index] <= limit if sense == "<=" else values[index] >= limit),
            probability=doubt.kept_with(index, sense, limit, coded),
            demanded_probability=study.file.confirmation.limit_probability,
        )
        for index, sense, limit in study.goals.limited
    ]
