"""Runs of a noisy simulator, an emulator for each response, and what these predict of costs and limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from doe.emulator import Emulator, NoisyValues, fit_emulator
from doe.pareto.goals import Goals
from rbdyn.base.arrays import Array, Mask, Whole

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


@dataclass(frozen=True, eq=False)
class Emulators:
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
