"""The search: design, batches where most is to be gained, a check of the predictions, fresh runs at the finalists; when it moves
a face of its region, when it stops, and its result.

Predictions at the points that a search chooses are optimistic: their errors made it choose them. So only fresh runs at the
finalists are reported, which had no part in the choice of their points. A batch of them helps to choose the finalists after it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy import special
from scipy.stats import qmc

from doe.adaptive.emulators import (
    FRONT_DRAWS,
    SCATTER_SHARE,
    Emulators,
    Evaluate,
    Levels,
    Region,
    Runs,
    batch,
    candidates,
    dominance_of,
    fit_emulators,
    front_rows,
    levels_of,
    shares_of,
)
from doe.designs.optimal import Remaining
from doe.pareto import InfeasibleError
from doe.pareto.front import Samples, SimulatedFront
from doe.pareto.search import NAMES, Goals, Rule, best_for_hypervolume, dominates, hypervolume, pick_all, spread
from rbdyn.base.arrays import Array, Rows, Whole, one_thread
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record, keyed, outside_json
from rbdyn.base.words import counted

FRESH = 0.2  # of the budget: fresh runs at the finalists
TESTED = 4  # last batches that show how right the emulators' deviations are
ROUNDS = 3  # of candidates for a front that is reported
SHOWN, FEW = 200, 2048  # points that represent a predicted front, and levels by which its hypervolume is computed
SHARE = 0.25  # of the deviation of the hypervolume over the fronts drawn: a batch that gains less gains nothing
LEAST = 0.0025  # of the hypervolume: the error by the choice of the points that represent a front
BATCHES = 3  # that gain nothing in a row; with the first alone prototypes stopped with 2 % still to gain
CHECKS = 8  # fresh runs on the front
DOUBT = 0.05  # chance of calling right emulators wrong
NEAR = 0.05  # of the range of a factor: as near to a face a pick lies at it
AHEAD, BETTER = 0.1, 0.9  # of the range beyond a face; chance there of a response that no point of the front dominates
GROWTH, MOST_MOVES = 0.5, 3  # of the range a move; moves of a search
FUNCTIONS = 64  # drawn for that chance


class Plan(Record):
    """How a search goes: ``budget`` of runs, those of the design and the fresh ones included; runs a ``batch``; ``seed``.

    A run has from ``least`` to ``most`` replicates, a fresh one ``usual``, and the ``pick`` is made by that rule. Two replicates
    are too few: both may miss a regime that the bearing is in for half of the time, and then agree.
    """

    budget: int
    batch: int = 8
    seed: int = 1
    least: int = 4
    most: int = 16
    usual: int = 8
    pick: Rule = "knee"

    @property
    def fresh(self) -> int:
        """Fresh runs."""
        return round(FRESH * self.budget)


class Batch(Record, kw_only=True):
    """State of the search after ``runs`` runs that went well, those of the design included.

    ``hypervolume`` of the predicted front and its standard ``deviation`` over the functions drawn from the emulators; ``gained``
    by the last batch (None before the first); ``remaining``: mean of what would be gained if all were known, and its standard
    deviation ``remaining_error`` over these functions. All are on the scale of the predicted front at that time. ``reached`` is the hypervolume of that front by the last emulators, on the scale of the last front.
    ``why`` the next batch was made: "improvement", "check" of the predicted front, or "extension"; "" after the last.
    """

    runs: int
    reached: float = keyed("hypervolume", default=float("nan"))
    deviation: float
    gained: float | None
    remaining: float = keyed("left")
    remaining_error: float = keyed("left_error")
    why: str
    hypervolume: float = outside_json(default=float("nan"))


# Takes the state after a batch, the finished runs and those of the whole search.
Watch = Callable[[Batch, int, int], None]


class AdaptiveFront(Record, eq=False):
    """A front found by emulators and confirmed by fresh runs.

    - ``front``: its finalists in factor units with their fresh runs alone, and all runs of the search
    - ``archive`` (a, k): the whole front that the emulators predict, with its ``predictions`` and their ``deviations`` (a, m);
      the rows ``representatives`` of it have the largest hypervolume
    - ``emulators`` and ``region`` in the end
    - ``history``: state after every batch; ``fronts``: points (s, k), in coded units, that represent the predicted front at each
    - ``searched`` (n,): all runs of design and search, in factor units, ``why`` each was made ("design", "improvement", "check",
      "extension") and the replicates ``spent`` on it (n,)
    - ``moves``: faces moved and where to (coded); ``faces`` that the pick lies at in the end
    - ``bias`` and ``spread`` (m,): mean of the residuals of the fresh runs at the finalists to the predictions, in standard
      deviations, and root mean square about it
    - ``fresh``: number of the fresh runs; ``stopped``: why the search ended; ``seconds`` of the emulators and of the choice of runs
    """

    front: SimulatedFront
    archive: Array
    representatives: Rows
    predictions: Array
    deviations: Array
    emulators: Emulators
    region: Region
    history: tuple[Batch, ...]
    fronts: tuple[Array, ...]
    moves: tuple[tuple[Face, float], ...]
    faces: tuple[Face, ...]
    searched: Samples
    why: tuple[str, ...]
    spent: Whole
    bias: Array
    spread: Array
    fresh: int
    stopped: str
    seconds: float


def check_budget(plan: Plan, design: int) -> None:
    """Raises MethodError where the budget has no room for the runs of the design, a batch and the fresh runs."""
    searched = design + plan.batch
    if searched > plan.budget - plan.fresh:
        least = next(budget for budget in range(searched, 4 * searched) if budget - round(FRESH * budget) >= searched)
        raise MethodError(
            f"budget = {plan.budget}: {design} runs of the design, a batch of {plan.batch} and {plan.fresh} fresh runs at the end "
            f"do not fit; give at least {least}"
        )


class _Finals(NamedTuple):
    """Fresh ``runs`` at the finalists and the one at the ``base``.

    ``predictions`` (f, m) are those by which the finalists were chosen; ``residuals`` (g, m) are those of the good runs to
    them, in standard deviations.
    """

    runs: Runs
    base: Runs
    predictions: Array
    residuals: Array


@dataclass(eq=False)
class AdaptiveSearch:
    """A search for the front; the same seed and the same runs give the same bits.

    ``centre`` and ``step`` (k,) turn coded units into those of the factors, which ``evaluate`` and the ``baseline`` have.
    ``runs`` are those of the design at first, then all so far, failed ones too; ``residuals`` are those of every batch to its
    predictions. The region may grow as far as the ``border``, not at all without one. ``lost`` (l, k): points to stay away
    from as from failed runs.
    """

    evaluate: Evaluate
    centre: Array
    step: Array
    region: Region
    runs: Runs
    goals: Goals
    plan: Plan
    baseline: Array
    watch: Watch = lambda state, runs, budget: None
    border: Border | None = None
    lost: Array | None = None
    history: list[Batch] = field(default_factory=list)
    fronts: list[Array] = field(default_factory=list)
    why: list[str] = field(default_factory=list)
    moves: list[tuple[Face, float]] = field(default_factory=list)
    residuals: list[Array] = field(default_factory=list)
    emulators: Emulators | None = None
    seconds: float = 0.0

    @one_thread
    def front(self) -> AdaptiveFront:
        """Find the front.

        Raises MethodError where the budget has no room for the design, a batch and the fresh runs, or too few runs go well;
        InfeasibleError where no run comes near to keeping the limits.
        """
        check_budget(self.plan, len(self.runs.points))
        self.why = ["design"] * len(self.runs.points)
        return self.finish(self.spend())

    @cached_property
    def shares(self) -> tuple[float, ...]:
        """Shares of the steps in the centre for factors whose logarithms may be emulated."""
        limits = self.border or self.region
        return shares_of(self.centre, self.step, limits.low, limits.high)

    def spend(self) -> str:
        """Make batches until the budget is spent or nothing is left to gain; returns which."""
        room, since = self.plan.budget - self.plan.fresh, -1
        while True:
            started = time.perf_counter()
            emulators = self._fit(self.runs)
            random = np.random.default_rng([self.plan.seed, len(self.history)])
            pool = self._candidates(emulators, self.runs, self.runs.points, random)
            levels, improvable, state = self._state(emulators, pool, random)
            count = min(self.plan.batch, room - len(self.runs.points))
            rows, _ = batch(emulators, pool, levels, improvable, count, self.region.apart)
            check = len(pool) > 0 and nothing_gained(self.history, since) and count >= CHECKS
            if check:
                rows = self._check(emulators, pool, levels)
            points, why = pool[rows], "" if not rows else "check" if check else "improvement"
            if self.history and rows and (beyond := self._beyond(emulators, pool, count, random)) is not None:
                points, why, check, since = beyond, "extension", False, len(self.history)
            self.history.append(replace(state, why=why))
            self.watch(self.history[-1], len(self.runs.points), self.plan.budget)
            replicates = self._replicates(emulators, points)
            self.seconds += time.perf_counter() - started
            if not rows:
                return "the budget is spent" if count <= 0 else "no point is left that may gain"
            fresh = self._run(points, replicates)
            self.residuals.append(residuals_of(emulators, fresh.rows(fresh.good)))
            self.runs, self.why = self.runs.plus(fresh), [*self.why, *[why] * len(points)]
            if check:
                if as_predicted(emulators, fresh):
                    return "batches gained nothing more and fresh runs on the front were as predicted"
                since = len(self.history) - 1

    def _candidates(
        self, emulators: Emulators, runs: Runs, avoid: Array, random: np.random.Generator, rounds: int = 1
    ) -> Array:
        """Candidates (n, k) that are no twins of ``avoid`` (a, k) and lie nearer to a good run than to a failed or a lost one.

        If none is as near, those farther off.
        """
        failed = runs.points[~runs.good]
        points = candidates(emulators, self.region, random, np.vstack([failed, avoid]), rounds)
        if self.lost is not None:
            failed = np.vstack([self.lost, failed])
        remain = Remaining(runs.points[runs.good], failed).excess(points) < 0.0
        return points[remain] if remain.any() else points

    def _fit(self, runs: Runs) -> Emulators:
        good = int(runs.good.sum())
        if good < 2 + len(self.centre):
            raise MethodError(f"only {counted(good, 'run')} went well; emulators need {2 + len(self.centre)}")
        self.emulators = fit_emulators(self.goals, runs, self.emulators, self.shares)
        return self.emulators

    def _state(self, emulators: Emulators, points: Array, random: np.random.Generator) -> tuple[Levels, Array, Batch]:
        """Levels, the probability that each is still to be gained (u,), and where the search stands.

        Gains are those of the predicted front, not of the runs: these fill it up whatever they show.
        """
        everything = np.vstack([points, emulators.runs.points])
        rows, costs = front_rows(emulators, everything)
        deviations = emulators.predict(everything)[1][:, self.goals.objectives]
        levels = levels_of(costs[rows], (costs - deviations).min(axis=0), random)
        draws = emulators.draws(FRONT_DRAWS, random)
        front = everything[rows[spread(costs[rows], SHOWN)]]
        by_runs = dominance_of(levels, emulators, draws(emulators.runs.points))
        before = self.fronts[-1] if self.fronts else front[:0]
        few = levels.first(FEW)
        now, previous, best = (
            dominance_of(few, emulators, draws(part)).hypervolumes for part in (front, before, everything)
        )
        self.fronts.append(front)
        state = Batch(
            runs=len(emulators.runs.points),
            hypervolume=float(now.mean()),
            deviation=float(now.std()),
            gained=float((now - previous).mean()) if len(self.fronts) > 1 else None,
            remaining=float((best - now).mean()),
            remaining_error=float((best - now).std()),
            why="",
        )
        return levels, by_runs.improvable, state

    def _faces(self, emulators: Emulators, points: Array, random: np.random.Generator) -> list[Face]:
        """Faces at which the predicted pick lies."""
        place = Place(emulators, self.region, points, len(self.moves))
        border = self.border or Border(self.region.low, self.region.high, lambda corners: False)
        return faces(place, border, self.plan.pick, random)

    def _beyond(self, emulators: Emulators, points: Array, count: int, random: np.random.Generator) -> Array | None:
        """Points (n, k) all over the new part of the region after a face has moved; None where no face is worth it."""
        if self.border is None or (face := face_to_move(self._faces(emulators, points, random))) is None:
            return None
        self.region = extended(self.border, self.region, face.factor, face.side)
        low, high = self.region.low.copy(), self.region.high.copy()
        self.moves.append((face, float((high if face.side > 0 else low)[face.factor])))
        (low if face.side > 0 else high)[face.factor] = face.position
        even = qmc.Sobol(low.size, seed=random).random_base2(count.bit_length())[:count]
        return self.region.snap(low + (high - low) * even)

    def _check(self, emulators: Emulators, points: Array, levels: Levels) -> list[int]:
        """Rows of points spread over the predicted front."""
        rows, _ = front_rows(emulators, points)
        places, _ = batch(emulators, points[rows], levels, np.ones(len(levels.costs)), CHECKS, self.region.apart)
        return rows[places].tolist()

    def _replicates(self, emulators: Emulators, points: Array) -> Whole:
        """As many (n,) as make the scatter of a run small compared with the uncertainty of it."""
        columns = self.goals.objectives
        single, deviations = emulators.scatter(points)[:, columns], emulators.predict(points)[1][:, columns]
        enough = np.ceil((single / (SCATTER_SHARE * deviations**2)).max(axis=1))
        return enough.clip(self.plan.least, self.plan.most).astype(np.int64)

    def _run(self, points: Array, replicates: Whole) -> Runs:
        values, errors, freedom = self.evaluate(self.centre + self.step * points, replicates)
        return Runs(points, values, errors, freedom, replicates)

    def finish(self, stopped: str) -> AdaptiveFront:
        """Fresh runs at the finalists, and the front by all runs together."""
        random = np.random.default_rng([self.plan.seed, len(self.history), 1])
        finals = self._finals((self.baseline - self.centre) / self.step, random)
        if not finals.runs.good.any():
            raise MethodError("every run at the finalists failed; see the failures of the runs")
        started = time.perf_counter()
        runs = self.runs.plus(finals.runs)
        emulators = self._tested(self._fit(runs))
        points = self._candidates(emulators, runs, runs.points[~runs.good], random, ROUNDS)
        rows, costs = front_rows(emulators, points)
        archive, self.fronts[-1] = points[rows], points[rows[spread(costs[rows], SHOWN)]]
        predictions, deviations = emulators.predict(archive)
        self.seconds += time.perf_counter() - started
        return AdaptiveFront(
            front=self._front(finals),
            archive=self.centre + self.step * archive,
            representatives=best_for_hypervolume(costs[rows], SHOWN),
            predictions=predictions,
            deviations=deviations,
            emulators=emulators,
            region=self.region,
            history=tuple(self._on_one_scale(emulators, costs[rows])),
            fronts=tuple(self.fronts),
            moves=tuple(self.moves),
            faces=tuple(self._faces(emulators, points, random)),
            searched=Samples(self.centre + self.step * self.runs.points, self.runs.values, self.runs.errors),
            why=tuple(self.why),
            spent=self.runs.replicates,
            bias=finals.residuals.mean(axis=0),
            spread=finals.residuals.std(axis=0, ddof=1 if len(finals.residuals) > 1 else 0),
            fresh=len(finals.runs.points) + 1,
            stopped=stopped,
            seconds=self.seconds,
        )

    def _finals(self, original: Array, random: np.random.Generator) -> _Finals:
        """Fresh runs at the finalists and at the original point (k,), a batch at a time: each shows where the next gains most.

        All of them are reported, whatever they show.
        """
        runs = self.runs.rows(slice(0))
        predictions: list[Array] = []
        residuals: list[Array] = []
        sizes = np.diff(np.linspace(0, self.plan.fresh - 1, -(-self.plan.fresh // self.plan.batch) + 1).round())
        for size in sizes.astype(int).tolist():
            started = time.perf_counter()
            emulators = self._fit(self.runs.plus(runs))
            finalists = self._finalists(emulators, runs, size, random)
            self.seconds += time.perf_counter() - started
            points = finalists if predictions else np.vstack([finalists, original])
            more = self._run(points, np.full(len(points), self.plan.usual))
            if not predictions:
                base, more = more.rows(slice(-1, None)), more.rows(slice(-1))
            runs = runs.plus(more)
            predictions.append(emulators.predict(finalists)[0])
            residuals.append(residuals_of(self._tested(emulators), more.rows(more.good)))
            self.residuals.append(residuals_of(emulators, more.rows(more.good)))
        return _Finals(runs, base, np.vstack(predictions), np.vstack(residuals))

    def _tested(self, emulators: Emulators) -> Emulators:
        """Emulators with deviations within which the last batches lay: runs left out one at a time have neighbours that a point
        yet to be run has not. Source: Dawid, Statistical theory: the prequential approach (1984)."""
        last = np.vstack([np.ones((1, len(emulators.stretch))), *self.residuals[-TESTED:]])
        return replace(emulators, stretch=emulators.stretch * np.sqrt((last**2).mean(axis=0)).clip(1.0))

    def _finalists(self, emulators: Emulators, finals: Runs, count: int, random: np.random.Generator) -> Array:
        """Points of the predicted front that are expected to gain most next to the runs at ``finals`` before."""
        before = finals.points
        points = self._candidates(emulators, self.runs.plus(finals), before, random, ROUNDS)
        if len(points):
            self._check_limits(emulators, points)
        rows, costs = front_rows(emulators, np.vstack([points, before]))
        levels = levels_of(costs[rows], costs[rows].min(axis=0), random)
        improvable = dominance_of(levels, emulators, emulators.draws(FRONT_DRAWS, random)(before)).improvable
        archive = points[rows[rows < len(points)]]
        return archive[batch(emulators, archive, levels, improvable, count, self.region.apart)[0]]

    def _on_one_scale(self, emulators: Emulators, front: Array) -> list[Batch]:
        """The history with the hypervolumes of all predicted fronts, by the last emulators, on the scale of the last front
        (f, q)."""
        ideal, nadir = front.min(axis=0), front.max(axis=0)
        reached = [hypervolume(self.goals.costs(emulators.predict(points)[0]), ideal, nadir) for points in self.fronts]
        return [replace(state, reached=value) for state, value in zip(self.history, reached, strict=True)]

    def _check_limits(self, emulators: Emulators, points: Array) -> None:
        """Raises InfeasibleError where nothing predicted is likely to keep all limits, with the nearest point."""
        means, deviations = emulators.predict(points)
        feasibility = emulators.feasibility(means, deviations)
        if feasibility.max() < 0.5 and (violations := self.goals.violations(means, means)).size:
            row = int((violations / violations.max(axis=0).clip(1e-300)).sum(axis=1).argmin())
            if violations[row].any():
                raise InfeasibleError(self.centre + self.step * points[row], violations[row])

    def _front(self, finals: _Finals) -> SimulatedFront:
        """The finalists by their fresh runs, in ascending order of the first predicted cost; the pick is by the predictions."""
        goals = self.goals
        predicted_costs = goals.costs(finals.predictions)
        rows = np.array([row for row in predicted_costs[:, 0].argsort(kind="stable") if finals.runs.good[row]])
        runs, predicted_costs = finals.runs.rows(rows), predicted_costs[rows]
        values, errors = runs.values, np.nan_to_num(runs.errors)
        costs = goals.costs(values)
        base_values = finals.base.values[0] if finals.base.good.all() else None
        picks, among = pick_all(predicted_costs, goals, None if base_values is None else goals.costs(base_values))
        span = np.ptp(costs, axis=0)
        actual = [self.centre + self.step * part.points for part in (runs, self.runs)]
        return SimulatedFront(
            points=actual[0],
            values=values,
            standard_errors=errors,
            costs=costs,
            cost_errors=errors[:, goals.objectives],
            optimism=(costs - predicted_costs).mean(axis=0) / np.where(span > 0.0, span, 1.0),
            pick=picks[self.plan.pick],
            pick_reason=f"{NAMES[self.plan.pick]} {among}",
            baseline_values=base_values,
            seed=self.plan.seed,
            goals=goals,
            searched=Samples(actual[1], self.runs.values, self.runs.errors),
            freedom=np.where(runs.freedom > 0, runs.freedom, np.inf),
        )


def nothing_gained(history: Sequence[Batch], since: int) -> bool:
    """Whether the last batches after the one numbered ``since`` gained nothing."""
    last = history[since + 1 :][-BATCHES:]
    return len(last) == BATCHES and all(
        state.gained is not None and state.gained < max(SHARE * state.deviation, LEAST * state.hypervolume)
        for state in last
    )


def residuals_of(emulators: Emulators, runs: Runs) -> Array:
    """Residuals (n, m) of runs that the emulators were not fitted to, in standard deviations of the two together."""
    means, deviations = emulators.predict(runs.points)
    scatter = emulators.scatter(runs.points) / runs.replicates[:, None] + emulators.nuggets()
    return np.asarray((runs.values - means) / np.sqrt(deviations**2 + scatter))


def as_predicted(emulators: Emulators, runs: Runs) -> bool:
    """Whether fresh runs lie within the predictions' errors, all responses with a goal or a limit together."""
    goals = emulators.goals
    columns = sorted({*goals.objectives.tolist(), *(index for index, _, _ in goals.limited)})
    residuals = residuals_of(emulators, runs.rows(runs.good))[:, columns]
    return residuals.size > 0 and bool(special.chdtrc(residuals.size, float((residuals**2).sum())) > DOUBT)


class Border(NamedTuple):
    """How far the faces of a region may be moved: to ``low`` and ``high`` (k,) in coded units, as long as runs are ``possible``
    at all corners (c, k) of it."""

    low: Array
    high: Array
    possible: Callable[[Array], bool]


class Face(NamedTuple):
    """A face that the pick lies at: of a ``factor``, upper (``side`` 1) or lower (-1), at the ``position`` (coded).

    ``better``: chance that the front goes on beyond. The face is ``limited_by`` "allowed" (the border), "scene" (no run is possible
    beyond), "moves" (no more are made) or, "", that chance alone.
    """

    factor: int
    side: int
    position: float
    better: float
    limited_by: str


class Place(NamedTuple):
    """Where a search stands: its emulators, its region, points (n, k) of it, and how many faces it has moved."""

    emulators: Emulators
    region: Region
    points: Array
    moves: int


def faces(place: Place, border: Border, rule: Rule, random: np.random.Generator) -> list[Face]:
    """Faces of the region at which the pick of the predicted front lies."""
    emulators, region, points, moves = place
    rows, costs = front_rows(emulators, points)
    pick = points[rows[pick_all(costs[rows], emulators.goals, None)[0][rule]]]
    span, draws = region.high - region.low, emulators.draws(FUNCTIONS, random)
    at_pick = []
    for factor, side in product(range(pick.size), (-1, 1)):
        position = (region.high if side > 0 else region.low)[factor]
        if abs(pick[factor] - position) > NEAR * span[factor]:
            continue
        beyond = pick.copy()
        beyond[factor] = position + side * AHEAD * span[factor]
        responses = emulators.goals.costs(draws(np.vstack([beyond, points[rows]])))
        better = 1.0 - float(dominates(responses[:, 1:], responses[:, :1]).any(axis=1).mean())
        limited_by = "moves" if moves == MOST_MOVES else _limit(border, region, factor, side)
        at_pick.append(Face(factor, side, float(position), better, limited_by))
    return at_pick


def face_to_move(faces: list[Face]) -> Face | None:
    """The face to be moved: the surest of those that nothing limits and that the front goes on beyond."""
    free = [face for face in faces if not face.limited_by and face.better > BETTER]
    return max(free, key=lambda face: face.better, default=None)


def extended(border: Border, region: Region, factor: int, side: int) -> Region:
    """The region with a face moved outward, as far as the border permits."""
    low, high = region.low.copy(), region.high.copy()
    by = GROWTH * (high - low)[factor]
    if side > 0:
        high[factor] = max(min(high[factor] + by, border.high[factor]), high[factor])
    else:
        low[factor] = min(max(low[factor] - by, border.low[factor]), low[factor])
    return region._replace(low=low, high=high)


def _limit(border: Border, region: Region, factor: int, side: int) -> str:
    """What limits a face before it has moved as often as it may: "allowed", "scene" or nothing, ""."""
    wider = extended(border, region, factor, side)
    before, after = ((part.high - part.low)[factor] for part in (region, wider))
    if after < (1.0 + AHEAD) * before:
        return "allowed"
    return "" if border.possible(np.array(list(product(*zip(wider.low, wider.high, strict=True))))) else "scene"
