"""Points that are worth asking about: all over the region, and about the fronts that the emulators hold for possible."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from doe.adaptive.emulators import Emulators, Inactive, settled
from doe.arrays import Array, Mask, Rows
from doe.pareto.search import non_dominated

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
    """Rows of points (n, k) whose foretold costs nothing allowed dominates, and all costs (n, q).

    Where no point is likely to keep all limits, of the points that come nearest.
    """
    return _front(emulators, *emulators.predict(points))


def candidates(
    emulators: Emulators, region: Region, random: np.random.Generator, avoid: Array, rounds: int = 1
) -> Array:
    """Points (n, k) of the region, none a twin of those to ``avoid`` (a, k); the children of fronts foretold and of fronts
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
