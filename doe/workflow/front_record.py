"""The fronts of a study as their records: points, picks, gains and limits on the surfaces, with tolerances, and of the search in few runs."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from doe.adaptive import Batch
from doe.adaptive.emulators import LEAST_DEVIATION
from doe.pareto import ParetoFront
from doe.pareto.front import NOISE_DRAWS, Dominance, noisy_hypervolume
from doe.pareto.manufacture import Survival, ToleranceAware
from doe.pareto.search import REFERENCE, dominates
from doe.workflow.adaptive import Adaptive, FrontComparison
from doe.workflow.confirmation import point_words
from doe.workflow.front import SurfaceDoubt
from doe.workflow.pick import SearchedPick, place_of
from doe.workflow.problem import Problem
from doe.workflow.surfaces import PredictedGain, half_widths, predict_all, predicted_gains, statement
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.notes import Note
from rbdyn.base.records import Record, derived, finite, keyed
from rbdyn.base.words import NORMAL

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
        return cls.from_attributes(
            aware,
            kind=aware.box.kind,
            quantile=aware.box.quantile if aware.box.kind == "quantile" else None,
            distribution=aware.box.distribution,
            half_widths=study.by_factor(aware.box.half * study.step),
            front=front,
            pick=RobustPick.from_attributes(front[aware.pick], reason=aware.pick_reason),
            picks={rule: front[row] for rule, row in aware.picks.items()},
            baseline_robust=robust(aware.baseline_costs),
            plain_pick_robust=robust(aware.plain_pick_costs),
            robust_gain_percent=finite(aware.robust_gain_percent),
            pick_gains_percent={gain.response: gain.percent for gain in predicted_gains(study, points[aware.pick])},
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
        return cls.from_attributes(
            cls.predicted(study, point),
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
            FrontPoint.from_attributes(EstimatedPoint.of(study, *row), non_dominated_probability=float(probability))
            for row, probability in zip(rows, sure.non_dominated, strict=True)
        ]
        gains, place = (predicted_gains(study, front.points[front.pick]), place_of(study, front.points[front.pick]))
        with_tolerances = None if aware is None else ToleranceFront.of(study, aware)
        picks: dict[str, FrontPoint | RobustPick] = {rule: points[row] for rule, row in front.picks.items()}
        return cls.from_attributes(
            front,
            front=points,
            largest_hypervolume=REFERENCE ** front.costs.shape[1],
            hypervolume_history=front.hypervolume_history.tolist(),
            ideal=_extreme(study, front, front.costs.argmin(axis=0)),
            nadir=_extreme(study, front, front.costs.argmax(axis=0)),
            knee=points[front.knee],
            pick=FrontPick.from_attributes(
                points[front.pick], reason=front.pick_reason, beyond_runs=place.beyond, at_bounds=place.at_bounds
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


class SearchedPoint(EstimatedPoint):
    """The pick of the searched front by the rule of the study, and why it is that."""

    reason: str


class Extension(Record):
    """A face of the region that the search moved, in factor units."""

    factor: str
    side: str
    start: float = keyed("from")
    end: float = keyed("to")


class SearchedRun(Record):
    """A run of design or search, with its replicates and its reason."""

    factors: dict[str, float]
    replicates: int
    why: str


class Missed(Record):
    """By how many standard deviations the emulators missed fresh runs: their mean and its spread."""

    bias: float
    spread: float


class EmulatedResponse(Record):
    """A trend of ``terms`` with ``coefficients``, A being the first factor, plus a process: the covariances of the point with the
    runs times ``weights`` (n,).

    They are Matern of smoothness 5/2, with ``lengths`` by coordinate and ``variance``. The runs' ``values`` (n,) have the variances
    ``noise`` (n,), the coefficients the prior variances ``coefficient_variances``. The deviation is that of the posterior times
    ``stretch``, and ``least`` at least. With ``shares`` s of factors the coordinates are ln(1 + s x)/s.
    """

    terms: list[str]
    coefficients: list[float]
    coefficient_variances: list[float]
    lengths: list[float]
    variance: float
    weights: list[float]
    values: list[float]
    noise: list[float]
    stretch: float
    shares: list[float]
    least: float


class Emulated(Record):
    """Emulators of every response for the scripts of the page: mean and standard deviation without scatter, anywhere.

    The coordinates of a point are x = (factor - ``centre``) / ``half_range``; ``points`` (n, k) are those of the runs.
    """

    centre: list[float]
    half_range: list[float]
    points: list[list[float]]
    responses: dict[str, EmulatedResponse]

    @classmethod
    def of(cls, study: Problem, adaptive: Adaptive) -> Self:
        """The emulators at the end of a search."""
        emulators = adaptive.search.emulators
        parts = zip(study.responses, emulators.by_response, emulators.stretch.tolist(), emulators.shares, strict=True)
        return cls(
            centre=study.centre.tolist(),
            half_range=study.half_ranges.tolist(),
            points=emulators.runs.points.tolist(),
            responses={
                name: EmulatedResponse(
                    terms=list(emulator.terms),
                    coefficients=emulator.coefficients.tolist(),
                    coefficient_variances=emulator.term_variances.tolist(),
                    lengths=emulator.hyperparameters.lengths.tolist(),
                    variance=emulator.hyperparameters.variance,
                    weights=emulator.weights.tolist(),
                    values=emulator.values.tolist(),
                    noise=emulator.noise.tolist(),
                    stretch=stretch,
                    shares=list(shares),
                    least=LEAST_DEVIATION * float(abs(emulator.values).max()),
                )
                for name, emulator, stretch, shares in parts
            },
        )


class OtherRow(Record):
    """The row that is the pick in most of the other draws."""

    row: int
    share: float


class Chosen(Record):
    """Why the pick is this ``row`` of the searched front, and the share of its parts that still dominate the baseline, None without
    tolerances.

    ``share``: of draws of the simulation's errors in which it is the pick; ``next``: the most frequent other row, if any.
    """

    row: int
    reason: str
    survives: float | None
    share: float
    next: OtherRow | None

    @classmethod
    def of(cls, pick: SearchedPick) -> Self:
        """The pick of a searched front."""
        others = np.where(np.arange(len(pick.shares)) == pick.row, 0.0, pick.shares)
        rival, survives = int(others.argmax()), None if pick.aware is None else pick.aware.survives
        return cls(
            row=pick.row,
            reason=pick.reason,
            survives=None if survives is None else float(survives[pick.row]),
            share=float(pick.shares[pick.row]),
            next=OtherRow(rival, float(others[rival])) if others[rival] > 0.0 else None,
        )


class SearchResult(Record, kw_only=True):
    """A search.

    - ``front``: its points by their fresh runs, with 95 % half widths
    - ``runs``, ``fresh``: numbers of runs of design and search, and of fresh ones
    - ``hypervolume``: of the predicted front, on the scale of its own ideal and nadir
    - ``predicted_front``: the 200 points of the predicted front that have most of its hypervolume
    - ``points``: every run of design and search
    - ``held``: the one of the ``sentences`` on what limits the pick
    """

    front: list[EstimatedPoint]
    pick: SearchedPoint
    runs: int
    fresh: int
    hypervolume: float
    hypervolume_fresh: float
    hypervolume_fresh_error: float
    history: list[Batch]
    stopped: str
    extended: list[Extension]
    region: dict[str, list[float]]
    points: list[SearchedRun]
    predicted_front_points: int
    predicted_front: list[dict[str, float | None]]
    missed: dict[str, Missed]
    emulators: Emulated
    failed: int
    seed: int
    seconds: float
    emulator_seconds: float
    compared: FrontComparison
    held: str
    sentences: list[str]
    sentence: str = derived(lambda self: " ".join(self.sentences))
    chosen: Chosen | None = None

    @classmethod
    def of(
        cls,
        study: Problem,
        adaptive: Adaptive,
        volumes: FrontComparison,
        held: str = "",
        sentences: Sequence[str] = (),
        pick: SearchedPick | None = None,
    ) -> Self:
        """A search, its fronts compared with that on the surfaces, and what to say of it."""
        search, front = adaptive.search, adaptive.search.front
        rows = zip(map(study.rounded, front.points), front.values, front.half_widths, strict=True)
        points = [EstimatedPoint.of(study, *row) for row in rows]
        costs = front.goals.costs(search.predictions)
        scale = costs.min(axis=0), costs.max(axis=0)
        fresh, fresh_error = noisy_hypervolume(front.costs, front.cost_errors, *scale, NOISE_DRAWS, front.seed)
        half_ranges = study.half_ranges
        return cls.from_attributes(
            search,
            front=points,
            pick=SearchedPoint.from_attributes(points[front.pick], reason=front.pick_reason),
            runs=len(search.spent),
            hypervolume=search.history[-1].reached,
            hypervolume_fresh=fresh,
            hypervolume_fresh_error=NORMAL * fresh_error,
            history=list(search.history),
            extended=[
                Extension(
                    study.factors[face.factor],
                    "upper" if face.side > 0 else "lower",
                    *(
                        float(study.centre[face.factor] + half_ranges[face.factor] * coded)
                        for coded in (face.position, to)
                    ),
                )
                for face, to in search.moves
            ],
            region=dict(zip(study.factors, adaptive.edges.tolist(), strict=True)),
            points=[
                SearchedRun(study.by_factor(point if why == "design" else study.rounded(point)), int(count), why)
                for point, count, why in zip(search.searched.points, search.spent, search.why, strict=True)
            ],
            predicted_front_points=len(search.archive),
            predicted_front=predicted_rows(study, adaptive, search.representatives),
            missed={
                name: Missed(float(bias), float(spread))
                for name, bias, spread in zip(study.responses, search.bias, search.spread, strict=True)
            },
            emulators=Emulated.of(study, adaptive),
            failed=len(adaptive.failures),
            seed=front.seed,
            seconds=adaptive.seconds,
            emulator_seconds=search.seconds,
            compared=volumes,
            held=held,
            sentences=list(sentences),
            chosen=None if pick is None else Chosen.of(pick),
        )


def predicted_rows(
    study: Problem, adaptive: Adaptive, rows: Rows | slice = slice(None)
) -> list[dict[str, float | None]]:
    """Rows of the front that the emulators predict, all by default, with 95 % half widths."""
    search = adaptive.search
    parts = zip(search.archive[rows], search.predictions[rows], NORMAL * search.deviations[rows], strict=True)
    return [EstimatedPoint.of(study, study.rounded(point), *figures).row for point, *figures in parts]
