"""Expected gain in hypervolume of runs to come, as an integral over levels of the costs that are not yet dominated.

The hypervolume that a point adds is the volume of the levels that it dominates and nothing known does. Its expectation is
the integral of the product of the two probabilities: no cells need to be cut, and a batch is greedy, for each point takes
its share of the levels with it. What is known is not known exactly either: its fronts are drawn from the emulators.

Sources: Emmerich, Yang, Deutz, Wang and Fonseca, A multicriteria generalization of Bayesian global optimization (2016);
Daulton, Balandat and Bakshy, Parallel Bayesian optimization of multiple noisy objectives with expected hypervolume
improvement (2021).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import qmc

from doe.adaptive.emulators import Emulators
from doe.arrays import Array, Mask
from doe.pareto.search import REFERENCE

LEVELS = 13  # 2^13 levels, of which only those count that something may still gain
MOST_LEVELS = 1500  # of those
DRAWS = 32  # fronts drawn
WORTH = 0.25  # of an emulator's variance: as small the scatter of a run is to be
NOTICED, SURE = 0.97, 1e-3  # changes of a deviation that are followed, and the least that is left of it
BEYOND = 1.0  # of the range of a cost: as far below the best foretold a level may lie


@dataclass(frozen=True, eq=False)
class Levels:
    """Levels (u, q) spread evenly over the box of costs from ``low`` to ``high`` (q,).

    ``ideal`` and ``nadir`` (q,) of the front foretold are the scale of the hypervolume.
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
    """Levels from the best that is hoped for (q,) to the reference point of a front foretold (f, q)."""
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
    its twins, and refused. Each is taken to turn out as foretold (Ginsbourger, Le Riche and Carraro's kriging believer). There are fewer rows than ``count`` where nothing else is left to gain.
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
        # What the run will tell of its neighbours: they are not other chances of the same luck.
        shared = emulators.covariance(candidates, candidates[row]) - np.einsum("rnm,rm->nm", learnt, learnt[:, row])
        new = shared / np.sqrt((1.0 + WORTH) * deviations[row] ** 2)
        learnt = np.concatenate([learnt, new[None]])
        deviations = np.maximum(np.sqrt((deviations**2 - new**2).clip(0.0)), SURE * used)
        changed = np.flatnonzero((deviations < NOTICED * used).any(axis=1))
        chance[changed], used[changed] = chances(changed), deviations[changed]
    return rows, np.array(gains)
