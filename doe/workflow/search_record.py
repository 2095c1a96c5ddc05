"""The search in few runs as its record: the front by fresh runs, the batches, every run, and the emulators."""

from collections.abc import Sequence
from typing import Self

import numpy as np

from doe.adaptive import Batch
from doe.adaptive.emulators import LEAST_DEVIATION
from doe.pareto.front import NOISE_DRAWS, noisy_hypervolume
from doe.workflow.adaptive import Adaptive, FrontComparison
from doe.workflow.pick import SearchedPick
from doe.workflow.problem import Problem
from doe.workflow.surface_front import EstimatedPoint
from rbdyn.base.arrays import Rows
from rbdyn.base.records import Record, derived, keyed
from rbdyn.base.words import NORMAL


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
        return cls(
            front=points,
            pick=SearchedPoint(**vars(points[front.pick]), reason=front.pick_reason),
            runs=len(search.spent),
            fresh=search.fresh,
            hypervolume=search.history[-1].reached,
            hypervolume_fresh=fresh,
            hypervolume_fresh_error=NORMAL * fresh_error,
            history=list(search.history),
            stopped=search.stopped,
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
