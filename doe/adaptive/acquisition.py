"""Acquisition: candidate points, all over the region and about the fronts that the emulators hold for possible, and their expected gain.

Expected gain in hypervolume of runs to come, as an integral over levels of the costs that are not yet dominated.

The hypervolume that a point adds is the volume of the levels that it dominates and nothing known does. Its expectation is
the integral of the product of the two probabilities: no cells need to be cut, and a batch is greedy, for each point takes
its share of the levels with it. What is known is not known exactly either: its fronts are drawn from the emulators.

Sources: Emmerich, Yang, Deutz, Wang and Fonseca, A multicriteria generalization of Bayesian global optimization (2016);
Daulton, Balandat and Bakshy, Parallel Bayesian optimization of multiple noisy objectives with expected hypervolume
improvement (2021).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from doe.adaptive.emulators import Emulators, Inactive, settled
from doe.pareto.search import REFERENCE, non_dominated
from rbdyn.base.arrays import Array, Mask, Rows

EVERYWHERE = 9  # 2^9 points all over the region
PAST = 1.3  # times the region: what lies beyond is moved to its faces, where fronts like to end
CHILDREN = 128  # points about a front a round
ROUNDS = (0.2, 0.1, 0.05, 0.02)  # how far from their parents, in shares of the region
MOVED = 0.6  # chance of each factor to be moved
PRICE = 0.03  # of one cost, for what is gained of another
SWITCHED = 0.2  # chance of each category to be drawn anew
LIKELY = 0.5  # chance of keeping all limits at which a point counts as allowed


class Region(NamedTuple):
    """The box from ``low`` to ``high`` (k,) in coded units. A drawing has the values ``origin`` and whole numbers of ``finest``
    (k,) from it (NaN: any); points are twins unless they are more than ``apart`` (k,) from each other in some factor. The last
    coordinates are of categories of so many ``levels``, spread evenly from -1 to 1; ``inactive`` factors are drawn at 0."""

    low: Array
    high: Array
    origin: Array
    finest: Array
    apart: Array
    levels: tuple[int, ...] = ()
    inactive: Inactive = ()

    def snap(self, points: Array) -> Array:
        """Points (n, k) as they can be drawn within the box."""
        ends = (self.low - self.origin) / self.finest, (self.high - self.origin) / self.finest
        steps = np.round((points - self.origin) / self.finest).clip(np.ceil(ends[0] - 1e-6), np.floor(ends[1] + 1e-6))
        free = points.clip(self.low, self.high)
        drawn = np.where(np.isnan(self.finest), free, self.origin + steps * self.finest)
        return settled(drawn, self.levels, self.inactive)

    def twins(self, points: Array, others: Array) -> Mask:
        """Whether each of points (n, k) is a twin of any of the others (o, k)."""
        found = np.zeros(len(points), dtype=bool)
        for other in others:
            found |= (np.abs(points - other) <= self.apart).all(axis=1)
        return found


def front_rows(emulators: Emulators, points: Array) -> tuple[Rows, Array]:
    """Rows of points (n, k) whose predicted costs nothing allowed dominates, and all costs (n, q).

    Where no point is likely to keep all limits, of the points that come nearest.
    """
    return _front(emulators, *emulators.predict(points))


def candidates(
    emulators: Emulators, region: Region, random: np.random.Generator, avoid: Array, rounds: int = 1
) -> Array:
    """Points (n, k) of the region, none a twin of those to ``avoid`` (a, k); the children of predicted fronts and of fronts
    drawn.

    ``rounds``: how often the children of each distance are made.
    """
    span, goals = region.high - region.low, emulators.goals
    even = (0.5 + PAST * (qmc.Sobol(len(span), seed=random).random_base2(EVERYWHERE) - 0.5)).clip(0.0, 1.0)
    draws = emulators.draws(len(ROUNDS), random)
    pool, new = np.empty((0, len(span))), np.vstack([region.low + span * even, emulators.runs.points])
    count = emulators.runs.values.shape[1]
    means, deviations, believed = (np.empty((*shape, 0, count)) for shape in ((), (), (len(ROUNDS),)))
    for number, reach in enumerate(np.repeat(ROUNDS, rounds)):
        pool, believed = np.vstack([pool, new]), np.concatenate([believed, draws(new)], axis=1)
        means, deviations = (np.vstack(both) for both in zip((means, deviations), emulators.predict(new), strict=True))
        drawn = believed[number % len(ROUNDS)]
        kept = (goals.violations(drawn, drawn) <= 0.0).all(axis=-1)
        allowed = np.flatnonzero(kept) if kept.any() else np.arange(len(pool))
        possible = allowed[non_dominated(goals.costs(drawn[allowed]))]
        sure = _front(emulators, means, deviations)[0]
        parents = pool[np.concatenate([random.choice(rows, CHILDREN // 2) for rows in (sure, possible)])]
        moved = random.random(parents.shape) < MOVED
        new = (parents + reach * span * moved * random.standard_normal(parents.shape)).clip(region.low, region.high)
        for column, count in enumerate(region.levels, len(span) - len(region.levels)):
            drawn_anew = 2.0 * random.integers(0, count, len(new)) / (count - 1) - 1.0
            new[:, column] = np.where(random.random(len(new)) < SWITCHED, drawn_anew, parents[:, column])
    found = np.unique(region.snap(np.vstack([pool, new])), axis=0)
    return found[~region.twins(found, avoid)]


def _front(emulators: Emulators, means: Array, deviations: Array) -> tuple[Rows, Array]:
    costs, kept = emulators.goals.costs(means), emulators.kept(means, deviations)
    allowed = np.flatnonzero(kept >= min(LIKELY, float(kept.max())))
    return allowed[worth_it(costs[allowed])], costs


def worth_it(costs: Array) -> Rows:
    """Rows of the non-dominated of costs (n, q) that gain more of a cost than `PRICE` of what they lose of another, in shares
    of the front's ranges.

    Where a front has a flat end, errors of the emulators make a front of what is as good in one cost and far worse in
    another. Source: Geoffrion, Proper efficiency and the theory of vector maximization (1968).
    """
    rows = non_dominated(costs)
    while True:
        span = np.ptp(costs[rows], axis=0)
        scaled = costs[rows] / np.where(span > 0.0, span, 1.0)
        kept = rows[non_dominated((1.0 - PRICE) * scaled + PRICE * scaled.sum(axis=1, keepdims=True))]
        if len(kept) == len(rows):
            return rows
        rows = kept


LEVELS = 13  # 2^13 levels, of which only those count that something may still gain
MOST_LEVELS = 1500  # of those
DRAWS = 32  # fronts drawn
WORTH = 0.25  # of an emulator's variance: as small the scatter of a run is to be
NOTICED, SURE = 0.97, 1e-3  # changes of a deviation that are followed, and the least that is left of it
BEYOND = 1.0  # of the range of a cost: as far below the best predicted a level may lie


@dataclass(frozen=True, eq=False)
class Levels:
    """Levels (u, q) spread evenly over the box of costs from ``low`` to ``high`` (q,).

    ``ideal`` and ``nadir`` (q,) of the predicted front are the scale of the hypervolume.
    """

    at: Array
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
        return replace(self, at=self.at[:count])


def levels_of(front: Array, hopes: Array, random: np.random.Generator) -> Levels:
    """Levels from the best that is hoped for (q,) to the reference point of a predicted front (f, q)."""
    ideal, nadir = front.min(axis=0), front.max(axis=0)
    span = np.where(nadir > ideal, nadir - ideal, np.maximum(np.abs(ideal), 1e-12))
    high = ideal + REFERENCE * span
    low = np.clip(hopes, ideal - BEYOND * span, ideal)
    even = qmc.Sobol(len(ideal), seed=random).random_base2(LEVELS)
    return Levels(low + (high - low) * even, low, high, ideal, ideal + span)


def dominated(costs: Array, kept: Mask, levels: Array) -> Mask:
    """Whether each of levels (u, q) is dominated by any of the drawn costs (s, n, q) that keep their limits (s, n): (s, u)."""
    found = np.zeros((len(costs), len(levels)), dtype=bool)
    # What lies beyond the highest level in any cost dominates none.
    near = kept & (costs <= levels.max(axis=0)).all(axis=2)
    for row, drawn, allowed in zip(found, costs, near, strict=True):
        below = np.ones((int(allowed.sum()), len(levels)), dtype=bool)
        for column, level in zip(drawn[allowed].T, levels.T, strict=True):
            below &= column[:, None] <= level[None]
        row[:] = below.any(axis=0)
    return found


@dataclass(frozen=True, eq=False)
class Known:
    """What runs dominate of the levels on each drawn front, (s, u)."""

    levels: Levels
    dominated: Mask

    @property
    def hypervolumes(self) -> Array:
        """Of each drawn front, (s,)."""
        volume: Array = self.levels.volume * self.dominated.mean(axis=1)
        return volume

    @property
    def left(self) -> Array:
        """Probability (u,) that a level is not dominated."""
        return 1.0 - self.dominated.mean(axis=0)


def known_of(levels: Levels, emulators: Emulators, drawn: Array) -> Known:
    """Of responses (s, n, m) drawn at the runs."""
    goals = emulators.goals
    kept = np.all(goals.violations(drawn, drawn) <= 0.0, axis=-1)
    return Known(levels, dominated(goals.costs(drawn), kept, levels.at))


def batch(
    emulators: Emulators, candidates: Array, levels: Levels, left: Array, count: int, apart: Array
) -> tuple[list[int], Array]:
    """Rows of ``candidates`` (n, k) that together are expected to gain most, one after the other, and their gains.

    ``left`` (u,) is the probability that a level is still to be gained. Candidates within ``apart`` (k,) of one taken are
    its twins, and refused. Each is taken to turn out as predicted (Ginsbourger, Le Riche and Carraro's kriging believer). There are fewer rows than ``count`` where nothing else is left to gain.
    """
    if not len(candidates):
        return [], np.empty(0)
    means, deviations = emulators.predict(candidates)
    # The first of a Sobol sequence are even; every second one is not.
    still = np.flatnonzero(left > 0.0)
    still, share = still[:MOST_LEVELS], levels.volume * len(still) / len(left) / max(min(len(still), MOST_LEVELS), 1)
    at, free, left = levels.at[still], np.ones(len(candidates), dtype=bool), left[still]

    def chances(some: Any) -> Array:
        kept = emulators.kept(means[some], deviations[some])
        return emulators.below(means[some], deviations[some], at) * kept[:, None]

    chance, used, learnt = chances(slice(None)), deviations.copy(), np.empty((0, *means.shape))
    rows: list[int] = []
    gains: list[float] = []
    while len(rows) < count:
        expected = np.where(free, chance @ left, 0.0)
        row = int(expected.argmax())
        if expected[row] <= 0.0:
            break
        rows.append(row)
        gains.append(share * float(expected[row]))
        left *= 1.0 - chance[row]
        free &= ~(np.abs(candidates - candidates[row]) <= apart).all(axis=1)
        # What the run will say about its neighbours: they are not other chances of the same luck.
        shared = emulators.covariance(candidates, candidates[row]) - np.einsum("rnm,rm->nm", learnt, learnt[:, row])
        new = shared / np.sqrt((1.0 + WORTH) * deviations[row] ** 2)
        learnt = np.concatenate([learnt, new[None]])
        deviations = np.maximum(np.sqrt((deviations**2 - new**2).clip(0.0)), SURE * used)
        changed = np.flatnonzero((deviations < NOTICED * used).any(axis=1))
        chance[changed], used[changed] = chances(changed), deviations[changed]
    return rows, np.array(gains)
