"""Runs of a noisy simulator with what their replicates say, an emulator for each response, and what they say together of costs and limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from doe.emulator import Emulator, fit_emulator, pooled_variances
from doe.pareto.goals import Goals
from rbdyn.base.arrays import Array, Mask, Whole


class Runs(NamedTuple):
    """Runs at points (n, k) in coded units of the region, which is -1 to 1 at the start of a search.

    ``values`` (n, m), NaN where a run failed; standard ``errors`` (n, m) of these, their degrees of ``freedom`` (n, m; 0:
    unknown), and ``replicates`` (n,).
    """

    points: Array
    values: Array
    errors: Array
    freedom: Whole
    replicates: Whole

    @property
    def good(self) -> Mask:
        """Whether each run gave all its values, (n,)."""
        return np.asarray(np.isfinite(self.values).all(axis=1))

    def rows(self, which: Any) -> Runs:
        """Some of them."""
        return Runs(*(part[which] for part in self))

    def plus(self, more: Runs) -> Runs:
        """These and more."""
        return Runs(*(np.concatenate(both) for both in zip(self, more, strict=True)))


class Border(NamedTuple):
    """How far the faces of a region may be moved: to ``low`` and ``high`` (k,) in coded units, as long as runs are ``possible``
    at all corners (c, k) of it."""

    low: Array
    high: Array
    possible: Callable[[Array], bool]


class Face(NamedTuple):
    """A face that the pick lies ``at`` (coded): of a ``factor``, upper (``side`` 1) or lower (-1); ``better`` is the chance that
    the front goes on beyond. ``held`` by "allowed", "scene" (no run is possible beyond), "moves" (no more are made) or, "",
    by that chance alone."""

    factor: int
    side: int
    at: float
    better: float
    held: str


# Runs points (n, k) in factor units with (n,) replicates each, every row with a seed of its own: values, errors, freedom.
Evaluate = Callable[[Array, Whole], tuple[Array, Array, Whole]]


# Prior of the logarithm of a length in half ranges. On the bearing's whirl, which turns several times between two levels of a
# design, the emulators' own prior believed in 5 of 5 searches in lengths that no run had told, and lost 1.5 % of the front.
PRIOR = (0.0, 1.0)
# Factors that mean nothing at a level of a category: places of the category, of its level, and of the factors.
Inactive = tuple[tuple[int, int, tuple[int, ...]], ...]
# Ends of a factor whose logarithm is told: farther apart, one may lie at a zero that means nothing. A clearance acts by its
# shares: where the runs say so, logarithms found 1 % more of the front of a table of the bearing in 100 runs.
WIDEST = 10.0
LEAST_DEVIATION = 1e-12  # of a response's scale: what is known exactly still has a side of a level


@dataclass(frozen=True, eq=False)
class Emulators:
    """Emulators of m responses from runs that went well.

    The last coordinates of points are of categories of so many ``levels``, at which ``inactive`` factors mean nothing;
    ``shares`` (m) of factors are those that each emulator knows by their logarithms. Their deviations are stretched by ``stretch`` (m,), at least 1, so that runs left out one at a time lie within them.
    """

    goals: Goals
    runs: Runs
    each: Sequence[Emulator]
    stretch: Array
    levels: tuple[int, ...] = ()
    inactive: Inactive = ()
    shares: tuple[tuple[float, ...], ...] = ()

    def _told(self, points: Array) -> list[Array]:
        known = settled(points, self.levels, self.inactive)
        return [embedded(known, self.levels, each) for each in self.shares]

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Means and standard deviations (n, m) of the responses without scatter at points (n, k)."""
        told = zip(self.each, self._told(points), strict=True)
        means, deviations = zip(*(one.predict(at) for one, at in told), strict=True)
        stretched = np.column_stack(deviations) * self.stretch
        floor = LEAST_DEVIATION * np.maximum(np.abs(self.runs.values).max(axis=0), 1e-300)
        return np.column_stack(means), np.maximum(stretched, floor)

    def covariance(self, points: Array, point: Array) -> Array:
        """Covariances (n, m) of the uncertainty of each response at points (n, k) and at one point (k,)."""
        told = zip(self.each, self._told(points), self._told(point[None]), strict=True)
        columns = [one.covariance(at, other)[:, 0] for one, at, other in told]
        return np.column_stack(columns) * self.stretch**2

    def scatter(self, points: Array) -> Array:
        """Variances (n, m) of single replicates at points (n, k)."""
        return _pooled(self.runs, points)

    def nuggets(self) -> Array:
        """Variances (m,) that the replicates of a run share and do not show."""
        return np.array([one.hyperparameters.nugget for one in self.each])

    def draws(self, count: int, random: np.random.Generator) -> Callable[[Array], Array]:
        """Functions of points (n, k) drawn from the emulators, with responses (s, n, m)."""
        drawn = [one.draw(count, random) for one in self.each]

        def functions(points: Array) -> Array:
            return np.stack([each(at) for each, at in zip(drawn, self._told(points), strict=True)], axis=-1)

        return functions

    def kept(self, means: Array, deviations: Array) -> Array:
        """Probability (n,) that a point keeps all limits, the responses as independent."""
        chance = np.ones(len(means))
        for index, sense, limit in self.goals.limited:
            sign = 1.0 if sense == "<=" else -1.0
            chance = chance * special.ndtr(sign * (limit - means[:, index]) / deviations[:, index])
        return chance

    def below(self, means: Array, deviations: Array, levels: Array) -> Array:
        """Probability (n, u) that a point's costs are all below the ``levels`` (u, q), the responses as independent."""
        chance = np.ones((len(means), len(levels)))
        for column, index in enumerate(self.goals.objectives.tolist()):
            mean, deviation, level = means[:, index, None], deviations[:, index, None], levels[None, :, column]
            if self.goals.kinds[index] == "min":
                chance *= special.ndtr((level - mean) / deviation)
            elif self.goals.kinds[index] == "max":
                chance *= special.ndtr((mean + level) / deviation)
            else:
                off = mean - self.goals.target[index]
                ends = (special.ndtr((side * level - off) / deviation) for side in (1.0, -1.0))
                chance *= np.subtract(*ends).clip(0.0)
        return chance


def settled(points: Array, levels: tuple[int, ...], inactive: Inactive) -> Array:
    """Points (n, k) with the factors at 0 that mean nothing at their levels: all values of these are the same point."""
    found, numbers = points.copy() if inactive else points, points.shape[1] - len(levels)
    for category, place, factors in inactive:
        there = np.rint(0.5 * (points[:, numbers + category] + 1.0) * (levels[category] - 1)) == place
        found[np.ix_(there, factors)] = 0.0
    return found


def shares_of(centre: Array, step: Array, low: Array, high: Array) -> tuple[float, ...]:
    """What ``step`` is of ``centre`` (k,) for factors that have the same sign from ``low`` to ``high`` (k,), in steps from the
    centre, and whose ends are not too far apart; 0 for others."""
    ends = np.sort(np.abs([centre + step * low, centre + step * high]), axis=0)
    told = (ends[0] * WIDEST > ends[1]) & ((centre + step * low) * (centre + step * high) > 0.0)
    return tuple(np.divide(step, centre, out=np.zeros(len(step)), where=told).tolist())


def embedded(points: Array, levels: tuple[int, ...], shares: tuple[float, ...] = ()) -> Array:
    """Points (n, k) whose last coordinates are of categories, with a coordinate for every level in the place of each of these,
    and the logarithms of the factors that have ``shares``, which have the slope of the points where these are 0.

    Any two levels of a category are so as unlike as the lengths of their coordinates say. Source: Garrido-Merchan and
    Hernandez-Lobato, Dealing with categorical and integer-valued variables in Bayesian optimization with Gaussian processes,
    Neurocomputing 380 (2020). Logarithms: Snoek, Swersky, Zemel and Adams, Input warping for Bayesian optimization of
    non-stationary functions, ICML (2014).
    """
    share, numbers = np.array(shares), points.shape[1] - len(levels)
    told = np.flatnonzero(share)
    if told.size:
        points = points.copy()
        points[:, told] = np.log1p(share[told] * points[:, told]) / share[told]
    parts = [points[:, :numbers]]
    for count, column in zip(levels, points[:, numbers:].T, strict=True):
        parts.append(np.eye(count)[np.rint(0.5 * (column + 1.0) * (count - 1)).astype(np.int64)])
    return np.hstack(parts) if levels else points


def fit_emulators(
    goals: Goals,
    runs: Runs,
    known: Emulators | None = None,
    levels: tuple[int, ...] = (),
    inactive: Inactive = (),
    shares: tuple[float, ...] = (),
) -> Emulators:
    """Emulators of all responses; ``known`` of nearly the same runs shorten the search for their hyperparameters.

    Each knows the factors that have ``shares`` by their logarithms where that makes its runs likelier.
    """
    good = runs.rows(runs.good)
    variances = _pooled(good, good.points) / good.replicates[:, None]
    starts = [None] * good.values.shape[1] if known is None else [one.hyperparameters for one in known.each]
    numbers, ways = good.points.shape[1] - len(levels), [(), shares] if any(shares) else [()]
    points = settled(good.points, levels, inactive)
    each, told = [], []
    for value, variance, start in zip(good.values.T, variances.T, starts, strict=True):
        found = [
            fit_emulator(embedded(points, levels, way), value, variance, start=start, prior=PRIOR, trended=numbers)
            for way in ways
        ]
        best = max(range(len(ways)), key=lambda way: found[way].restricted_likelihood)
        each.append(found[best])
        told.append(ways[best])
    return Emulators(goals, good, each, np.array([_stretch(one) for one in each]), levels, inactive, tuple(told))


def _stretch(emulator: Emulator) -> float:
    """Root mean square of what runs left out one at a time miss the others' forecast by, in standard deviations; at least 1."""
    foretold, deviation = emulator.leave_one_out()
    return max(float(np.sqrt(np.mean(((emulator.values - foretold) / deviation) ** 2))), 1.0)


def _pooled(runs: Runs, points: Array) -> Array:
    single = runs.errors**2 * runs.replicates[:, None]
    columns = zip(single.T, runs.freedom.T, strict=True)
    return np.column_stack([pooled_variances(runs.points, each, behind, points) for each, behind in columns])
