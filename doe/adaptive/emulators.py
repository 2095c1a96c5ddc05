"""Runs of a noisy simulator, an emulator for each response, and what these predict of costs and limits.

Acquisition: runs go where the gain in hypervolume that they are expected to bring is largest. Candidates are spread over the region and about the fronts that the emulators hold for possible. The hypervolume that a point
adds is the volume of the levels of the costs that it alone dominates. Its expectation is an integral over levels: of the
probability that the point dominates the level, times that nothing else does. No cells need to be cut. A batch is greedy:
each point takes its share of the levels with it. Fronts of the runs are uncertain too: they are drawn from the emulators.

Sources: Emmerich, Yang, Deutz, Wang and Fonseca, A multicriteria generalization of Bayesian global optimization (2016);
Daulton, Balandat and Bakshy, Parallel Bayesian optimization of multiple noisy objectives with expected hypervolume
improvement (2021).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy import special
from scipy.stats import qmc

from doe.emulator import Emulator, NoisyValues, fit_emulator
from doe.pareto.search import REFERENCE, Goals, non_dominated
from rbdyn.base.arrays import Array, Mask, Rows, Whole
from rbdyn.base.records import Record

# Prior of the logarithm of a length scale in half ranges. The bearing's whirl turns several times between two levels of a
# design: the emulators' own prior, of longer lengths, lost 1.5 % of its front in 5 of 5 searches.
PRIOR = (0.0, 1.0)
# Ratio of the ends of a factor up to which its logarithm may be emulated: of a wider one, an end may lie at a zero that means
# nothing. Where the runs prefer logarithms, these gained 1 % of the front of a table of the bearing in 100 runs.
LARGEST_RATIO = 10.0
LEAST_DEVIATION = 1e-12  # of a response's scale: an exact response still lies on a side of a level


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
        """Whether each run has all its values, (n,)."""
        return np.asarray(np.isfinite(self.values).all(axis=1))

    def rows(self, which: Any) -> Runs:
        """Some of them."""
        return Runs(*(part[which] for part in self))

    def plus(self, more: Runs) -> Runs:
        """These and more."""
        return Runs(*(np.concatenate(both) for both in zip(self, more, strict=True)))


# Runs points (n, k) in factor units with (n,) replicates each, every row with a seed of its own: values, errors, freedom.
Evaluate = Callable[[Array, Whole], tuple[Array, Array, Whole]]


class Emulators(Record, eq=False):
    """Emulators ``by_response`` (m) from the runs that went well.

    ``shares`` (m) are of the factors whose logarithms an emulator takes. Deviations are multiplied by ``stretch`` (m,), at
    least 1, so that runs left out one at a time lie within them.
    """

    goals: Goals
    runs: Runs
    by_response: Sequence[Emulator]
    stretch: Array
    shares: tuple[tuple[float, ...], ...] = ()

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Means and standard deviations (n, m) of the responses without scatter at points (n, k)."""
        pairs = zip(self.by_response, self._coordinates(points), strict=True)
        means, deviations = zip(*(emulator.predict(places) for emulator, places in pairs), strict=True)
        stretched = np.column_stack(deviations) * self.stretch
        floor = LEAST_DEVIATION * np.maximum(np.abs(self.runs.values).max(axis=0), 1e-300)
        return np.column_stack(means), np.maximum(stretched, floor)

    def covariance(self, points: Array, point: Array) -> Array:
        """Covariances (n, m) of the uncertainty of each response at points (n, k) and at one point (k,)."""
        parts = zip(self.by_response, self._coordinates(points), self._coordinates(point[None]), strict=True)
        columns = [emulator.covariance(places, place)[:, 0] for emulator, places, place in parts]
        return np.column_stack(columns) * self.stretch**2

    def scatter(self, points: Array) -> Array:
        """Variances (n, m) of single replicates at points (n, k)."""
        return _pooled(self.runs, points)

    def nuggets(self) -> Array:
        """Variances (m,) that the replicates of a run share and do not show."""
        return np.array([emulator.hyperparameters.nugget for emulator in self.by_response])

    def draws(self, count: int, random: np.random.Generator) -> Callable[[Array], Array]:
        """Functions of points (n, k) drawn from the emulators, with responses (s, n, m)."""
        draws = [emulator.draw(count, random) for emulator in self.by_response]

        def functions(points: Array) -> Array:
            pairs = zip(draws, self._coordinates(points), strict=True)
            return np.stack([draw(places) for draw, places in pairs], axis=-1)

        return functions

    def feasibility(self, means: Array, deviations: Array) -> Array:
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
                distance = mean - self.goals.target[index]
                ends = (special.ndtr((side * level - distance) / deviation) for side in (1.0, -1.0))
                chance *= np.subtract(*ends).clip(0.0)
        return chance

    def _coordinates(self, points: Array) -> list[Array]:
        """Coordinates of points (n, k) for the emulator of each response."""
        return [coordinates(points, shares) for shares in self.shares]


def fit_emulators(
    goals: Goals, runs: Runs, previous: Emulators | None = None, shares: tuple[float, ...] = ()
) -> Emulators:
    """Emulators of all responses; ``previous`` ones, of nearly the same runs, shorten the search for their hyperparameters.

    Each takes the logarithms of the factors that have ``shares`` where that makes its runs likelier.
    """
    good = runs.rows(runs.good)
    variances = _pooled(good, good.points) / good.replicates[:, None]
    responses = good.values.shape[1]
    starts = [None] * responses if previous is None else [emulator.hyperparameters for emulator in previous.by_response]
    choices = [(), shares] if any(shares) else [()]
    by_response, shares_by_response = [], []
    for values, variance, start in zip(good.values.T, variances.T, starts, strict=True):
        rivals = [
            fit_emulator(coordinates(good.points, choice), values, variance, start=start, prior=PRIOR)
            for choice in choices
        ]
        best = max(range(len(choices)), key=lambda place: rivals[place].likelihood)
        by_response.append(rivals[best])
        shares_by_response.append(choices[best])
    stretch = np.array([_stretch(emulator) for emulator in by_response])
    return Emulators(goals, good, by_response, stretch, tuple(shares_by_response))


def shares_of(centre: Array, step: Array, low: Array, high: Array) -> tuple[float, ...]:
    """Shares (k,) of ``step`` in ``centre`` for factors whose logarithms may be emulated, 0 for others.

    Those keep their sign from ``low`` to ``high`` (k,), in steps from the centre, and their ends are not too far apart.
    """
    ends = np.sort(np.abs([centre + step * low, centre + step * high]), axis=0)
    one_sign = (centre + step * low) * (centre + step * high) > 0.0
    where = (ends[0] * LARGEST_RATIO > ends[1]) & one_sign
    return tuple(np.divide(step, centre, out=np.zeros(len(step)), where=where).tolist())


def coordinates(points: Array, shares: tuple[float, ...] = ()) -> Array:
    """Coordinates of points (n, k) for an emulator. A factor that has a share is given by its logarithm, with slope 1 where it is 0.

    Source: Snoek, Swersky, Zemel and Adams, Input warping for Bayesian optimization of non-stationary functions, ICML (2014).
    """
    share = np.array(shares)
    logarithmic = np.flatnonzero(share)
    if not logarithmic.size:
        return points
    warped = points.copy()
    warped[:, logarithmic] = np.log1p(share[logarithmic] * points[:, logarithmic]) / share[logarithmic]
    return warped


def _stretch(emulator: Emulator) -> float:
    """Root mean square, at least 1, of the residuals of runs left out one at a time, in standard deviations."""
    mean, deviation = emulator.leave_one_out()
    return max(float(np.sqrt(np.mean(((emulator.values - mean) / deviation) ** 2))), 1.0)


def _pooled(runs: Runs, points: Array) -> Array:
    """Variances (n, m) of single replicates at points (n, k), by the replicates of runs."""
    single = runs.errors**2 * runs.replicates[:, None]
    return NoisyValues(runs.values, single, runs.freedom).smooth(runs.points, new=points)


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


class Levels(Record, eq=False):
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


class Dominance(Record, eq=False):
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
