"""Acquisition: candidate points of the region, and the gain in hypervolume that runs at them are expected to bring.

Candidates are spread over the region and about the fronts that the emulators hold for possible. The hypervolume that a point
adds is the volume of the levels of the costs that it alone dominates. Its expectation is an integral over levels: of the
probability that the point dominates the level, times that nothing else does. No cells need to be cut. A batch is greedy:
each point takes its share of the levels with it. Fronts of the runs are uncertain too: they are drawn from the emulators.

Sources: Emmerich, Yang, Deutz, Wang and Fonseca, A multicriteria generalization of Bayesian global optimization (2016);
Daulton, Balandat and Bakshy, Parallel Bayesian optimization of multiple noisy objectives with expected hypervolume
improvement (2021).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from doe.adaptive.emulators import Emulators
from doe.pareto.search import REFERENCE, non_dominated
from rbdyn.base.arrays import Array, Mask, Rows

EVERYWHERE = 9  # 2^9 points all over the region
PAST = 1.3  # times the region: points beyond it are moved to its faces, where fronts like to end
CHILDREN = 128  # points about a front a round
ROUNDS = (0.2, 0.1, 0.05, 0.02)  # how far from their parents, in shares of the region
MUTATION = 0.6  # chance of each factor to change
PRICE = 0.03  # of one cost, for the gain of another
LIKELY = 0.5  # chance of keeping all limits at which a point counts as feasible
LEVELS = 13  # 2^13 levels, of which only those count that something may still gain
MOST_LEVELS = 1500  # of those
FRONT_DRAWS = 32  # fronts drawn
SCATTER_SHARE = 0.25  # of an emulator's variance: as small the scatter of a run is to be
NOTICEABLE, LEAST_SHARE = 0.97, 1e-3  # changes of a deviation that are followed, and its least share
BEYOND = 1.0  # of the range of a cost: as far below the best predicted a level may lie


class Region(NamedTuple):
    """The box from ``low`` to ``high`` (k,) in coded units.

    A drawing has the values ``origin`` and whole numbers of ``finest`` (k,) from it (NaN: any). Points are twins unless they are
    more than ``apart`` (k,) from each other in some factor.
    """

    low: Array
    high: Array
    origin: Array
    finest: Array
    apart: Array

    def snap(self, points: Array) -> Array:
        """Points (n, k) as a drawing can have them within the box."""
        ends = (self.low - self.origin) / self.finest, (self.high - self.origin) / self.finest
        steps = np.round((points - self.origin) / self.finest).clip(np.ceil(ends[0] - 1e-6), np.floor(ends[1] + 1e-6))
        free = points.clip(self.low, self.high)
        return np.where(np.isnan(self.finest), free, self.origin + steps * self.finest)

    def twins(self, points: Array, others: Array) -> Mask:
        """Whether each of points (n, k) is a twin of any of the others (o, k)."""
        twin = np.zeros(len(points), dtype=bool)
        for other in others:
            twin |= (np.abs(points - other) <= self.apart).all(axis=1)
        return twin


def front_rows(emulators: Emulators, points: Array) -> tuple[Rows, Array]:
    """Rows of points (n, k) whose predicted costs nothing feasible dominates, and all costs (n, q).

    Where no point is likely to keep all limits, of the points that come nearest.
    """
    return _front(emulators, *emulators.predict(points))


def candidates(
    emulators: Emulators, region: Region, random: np.random.Generator, avoid: Array, rounds: int = 1
) -> Array:
    """Candidates (n, k) of the region, none a twin of the points to ``avoid`` (a, k).

    Some are all over it, others children of the predicted front and of fronts drawn from the emulators; ``rounds``: how often
    children are made at each distance.
    """
    span, goals = region.high - region.low, emulators.goals
    even = (0.5 + PAST * (qmc.Sobol(len(span), seed=random).random_base2(EVERYWHERE) - 0.5)).clip(0.0, 1.0)
    draws = emulators.draws(len(ROUNDS), random)
    pool, new = np.empty((0, len(span))), np.vstack([region.low + span * even, emulators.runs.points])
    count = emulators.runs.values.shape[1]
    means, deviations, responses = (np.empty((*shape, 0, count)) for shape in ((), (), (len(ROUNDS),)))
    for number, reach in enumerate(np.repeat(ROUNDS, rounds)):
        pool, responses = np.vstack([pool, new]), np.concatenate([responses, draws(new)], axis=1)
        means, deviations = (np.vstack(both) for both in zip((means, deviations), emulators.predict(new), strict=True))
        draw = responses[number % len(ROUNDS)]
        feasible = (goals.violations(draw, draw) <= 0.0).all(axis=-1)
        rows = np.flatnonzero(feasible) if feasible.any() else np.arange(len(pool))
        drawn_front = rows[non_dominated(goals.costs(draw[rows]))]
        mean_front = _front(emulators, means, deviations)[0]
        parents = pool[np.concatenate([random.choice(front, CHILDREN // 2) for front in (mean_front, drawn_front)])]
        new = _children(region, parents, reach, random)
    points = np.unique(region.snap(np.vstack([pool, new])), axis=0)
    return points[~region.twins(points, avoid)]


def _children(region: Region, parents: Array, reach: float, random: np.random.Generator) -> Array:
    """Children (n, k) of parents (n, k), as far from them as ``reach`` shares of the region."""
    span, mutation = region.high - region.low, random.random(parents.shape) < MUTATION
    children = parents + reach * span * mutation * random.standard_normal(parents.shape)
    return children.clip(region.low, region.high)


def _front(emulators: Emulators, means: Array, deviations: Array) -> tuple[Rows, Array]:
    """Rows of the predicted front of responses (n, m), and all costs (n, q)."""
    costs, feasibility = emulators.goals.costs(means), emulators.feasibility(means, deviations)
    feasible = np.flatnonzero(feasibility >= min(LIKELY, float(feasibility.max())))
    return feasible[proper_rows(costs[feasible])], costs


def proper_rows(costs: Array) -> Rows:
    """Rows of the non-dominated of costs (n, q) without those that buy a little of one cost with much of another.

    A point gains more of a cost than `PRICE` of its loss in another, in shares of the front's ranges. Without this rule errors
    of the emulators add points at a flat end of a front that are far worse in another cost.

    Source: Geoffrion, Proper efficiency and the theory of vector maximization (1968).
    """
    rows = non_dominated(costs)
    while True:
        span = np.ptp(costs[rows], axis=0)
        scaled = costs[rows] / np.where(span > 0.0, span, 1.0)
        proper = rows[non_dominated((1.0 - PRICE) * scaled + PRICE * scaled.sum(axis=1, keepdims=True))]
        if len(proper) == len(rows):
            return rows
        rows = proper


@dataclass(frozen=True, eq=False)
class Levels:
    """Levels ``costs`` (u, q) spread evenly over the box of costs from ``low`` to ``high`` (q,).

    ``ideal`` and ``nadir`` (q,) of the predicted front are the scale of the hypervolume.
    """

    costs: Array
    low: Array
    high: Array
    ideal: Array
    nadir: Array

    @property
    def volume(self) -> float:
        """Hypervolume of the whole box, normalised costs."""
        span = np.where(self.nadir > self.ideal, self.nadir - self.ideal, 1.0)
        return float(np.prod((self.high - self.low) / span))

    def first(self, count: int) -> Levels:
        """The first of them."""
        return replace(self, costs=self.costs[:count])


def levels_of(front: Array, hopes: Array, random: np.random.Generator) -> Levels:
    """Levels from the best costs hoped for (q,) to the reference point of a predicted front (f, q)."""
    ideal, nadir = front.min(axis=0), front.max(axis=0)
    span = np.where(nadir > ideal, nadir - ideal, np.maximum(np.abs(ideal), 1e-12))
    high = ideal + REFERENCE * span
    low = np.clip(hopes, ideal - BEYOND * span, ideal)
    even = qmc.Sobol(len(ideal), seed=random).random_base2(LEVELS)
    return Levels(low + (high - low) * even, low, high, ideal, ideal + span)


def dominated(costs: Array, feasible: Mask, levels: Array) -> Mask:
    """Whether each of levels (u, q) is dominated by any of the drawn costs (s, n, q) that are feasible (s, n): (s, u)."""
    mask = np.zeros((len(costs), len(levels)), dtype=bool)
    # A point beyond the highest level in any cost dominates none.
    near = feasible & (costs <= levels.max(axis=0)).all(axis=2)
    for row, draw, rows in zip(mask, costs, near, strict=True):
        below = np.ones((int(rows.sum()), len(levels)), dtype=bool)
        for column, level in zip(draw[rows].T, levels.T, strict=True):
            below &= column[:, None] <= level[None]
        row[:] = below.any(axis=0)
    return mask


@dataclass(frozen=True, eq=False)
class Dominance:
    """Which levels runs dominate on each drawn front, ``dominated`` (s, u)."""

    levels: Levels
    dominated: Mask

    @property
    def hypervolumes(self) -> Array:
        """Of each drawn front, (s,)."""
        volume: Array = self.levels.volume * self.dominated.mean(axis=1)
        return volume

    @property
    def improvable(self) -> Array:
        """Probability (u,) that a level is not dominated."""
        return 1.0 - self.dominated.mean(axis=0)


def dominance_of(levels: Levels, emulators: Emulators, responses: Array) -> Dominance:
    """Of responses (s, n, m) drawn at the runs."""
    goals = emulators.goals
    feasible = np.all(goals.violations(responses, responses) <= 0.0, axis=-1)
    return Dominance(levels, dominated(goals.costs(responses), feasible, levels.costs))


def batch(
    emulators: Emulators, candidates: Array, levels: Levels, improvable: Array, count: int, apart: Array
) -> tuple[list[int], Array]:
    """Rows of ``candidates`` (n, k) that together are expected to gain most, one after the other, and their gains.

    ``improvable`` (u,) is the probability that a level is still to be gained. Candidates within ``apart`` (k,) of one in the
    batch are its twins, and refused. Each is expected to turn out as predicted (the kriging believer of Ginsbourger, Le Riche and
    Carraro). There are fewer rows than ``count`` where nothing else is left to gain.
    """
    if not len(candidates):
        return [], np.empty(0)
    means, deviations = emulators.predict(candidates)
    # The first of a Sobol sequence are even; every second one is not.
    open_levels = np.flatnonzero(improvable > 0.0)
    places = open_levels[:MOST_LEVELS]
    share = levels.volume * len(open_levels) / len(improvable) / max(len(places), 1)
    costs, free, improvable = levels.costs[places], np.ones(len(candidates), dtype=bool), improvable[places]

    def chances(rows: Any) -> Array:
        feasibility = emulators.feasibility(means[rows], deviations[rows])
        return emulators.below(means[rows], deviations[rows], costs) * feasibility[:, None]

    chance, used, reductions = chances(slice(None)), deviations.copy(), np.empty((0, *means.shape))
    rows: list[int] = []
    gains: list[float] = []
    while len(rows) < count:
        expected = np.where(free, chance @ improvable, 0.0)
        row = int(expected.argmax())
        if expected[row] <= 0.0:
            break
        rows.append(row)
        gains.append(share * float(expected[row]))
        improvable *= 1.0 - chance[row]
        free &= ~(np.abs(candidates - candidates[row]) <= apart).all(axis=1)
        # The run will also show its neighbours: they are not other chances of the same luck.
        shared = emulators.covariance(candidates, candidates[row])
        shared = shared - np.einsum("rnm,rm->nm", reductions, reductions[:, row])
        reduction = shared / np.sqrt((1.0 + SCATTER_SHARE) * deviations[row] ** 2)
        reductions = np.concatenate([reductions, reduction[None]])
        deviations = np.maximum(np.sqrt((deviations**2 - reduction**2).clip(0.0)), LEAST_SHARE * used)
        changed = np.flatnonzero((deviations < NOTICEABLE * used).any(axis=1))
        chance[changed], used[changed] = chances(changed), deviations[changed]
    return rows, np.array(gains)
