"""Whether predictive distributions are as wide as they should be: too narrow and too wide both count against them.

Cells are predicted row by row, each row from those before it, so what is left over of one row tells nothing of the next.
Each cell becomes a normal score by its rank among the draws of its prediction (its probability integral transform), and the
scores of a row are made independent by their correlation among the draws. The sum of their squares is small where
predictions are too wide and large where they are too narrow. It is judged for all cells together and for each output apart;
the draws themselves, put in the place of the measured values, tell how small the smallest of all these chances may be.

Sources: Dawid, Statistical theory: the prequential approach, J. R. Statist. Soc. A 147 (1984) 278; Westfall and Young,
Resampling-based multiple testing (1993), section 2.3, for the smallest of several chances.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import special

from doe.arrays import Array, Whole

# Chance of a rejection, of either side, where predictions are right.
LEVEL = 0.05
# Predictions twice too wide, or too narrow, must be found at least this often, or the cells are too few to tell.
TWICE, OFTEN = 2.0, 0.5


class Scores(NamedTuple):
    """Predicted cells as independent standard normal scores: of the measured values (k,), of draws of the predictions
    (s, k), and the ``output`` (k,) that each belongs to."""

    measured: Array
    draws: Array
    output: Whole


@dataclass(frozen=True)
class Width:
    """How wide predictions of ``cells`` many cells are: the ``ratio`` of what the residuals scatter to what is predicted,
    the ``chance`` of as much in either direction, the ``output`` that shows it most (None: all together) and its own ratio;
    the ``power`` by which predictions twice too wide, and twice too narrow, would be rejected."""

    cells: int
    ratio: float
    chance: float
    output: int | None
    worst: float
    power: tuple[float, float]

    @property
    def rejected(self) -> bool:
        """Whether predictions are too wide or too narrow."""
        return self.chance <= LEVEL

    @property
    def enough(self) -> bool:
        """Whether the cells would tell predictions that are twice too wide or too narrow."""
        return min(self.power) >= OFTEN


def scores_of(draws: Array, measured: Array, output: Whole) -> Scores:
    """Scores of the cells of a row, by draws (s, a) of its joint prediction."""
    count = len(draws)
    ranks = np.argsort(np.argsort(draws, axis=0, kind="stable"), axis=0)
    places = np.vstack([(draws < measured).sum(axis=0) * (count / (count + 1.0)), ranks])
    scores = special.ndtri((places + 0.5) / count)
    correlation = np.corrcoef(scores[1:].T).reshape(measured.size, measured.size)
    # Cells of one sensor may be as good as one.
    root = np.linalg.cholesky(correlation + 1e-6 * np.eye(measured.size))
    independent = np.linalg.solve(root, scores.T).T
    return Scores(independent[0], independent[1:], output)


def width(parts: Sequence[Scores]) -> Width:
    """How wide predictions are, of the scores of all rows that were predicted."""
    output = np.concatenate([each.output for each in parts])
    squares = np.hstack([np.vstack([each.measured, each.draws]) for each in parts]) ** 2
    names = np.unique(output)
    groups = np.column_stack([np.ones(output.size), *(output == name for name in names)]).astype(float)
    groups = groups if names.size > 1 else groups[:, :1]
    sums = squares @ groups
    sorted_sums = np.sort(sums[1:], axis=0)
    count = len(sorted_sums)

    def chances(of: Array) -> Array:
        """Chances (n, g) of sums (n, g) as small or as large among the draws, the smaller of both."""
        below = np.column_stack([np.searchsorted(s, v, "right") for s, v in zip(sorted_sums.T, of.T, strict=True)])
        above = count - np.column_stack([np.searchsorted(s, v) for s, v in zip(sorted_sums.T, of.T, strict=True)])
        return (1.0 + np.minimum(below, above)) / (count + 1.0)

    least = np.sort(chances(sums[1:]).min(axis=1))
    limit = least[max(int(LEVEL * count) - 1, 0)]
    found = chances(sums[:1])[0]
    worst = int(np.argmin(found))
    # Truths that scatter half as much as predicted, or twice.
    power = [float((chances(sums[1:] * by).min(axis=1) <= limit).mean()) for by in (TWICE**-2, TWICE**2)]
    ratios = np.sqrt(sums[0] / groups.sum(axis=0))
    chance = (1.0 + float(np.searchsorted(least, found.min(), "right"))) / (count + 1.0)
    name = None if worst == 0 else int(names[worst - 1])
    return Width(output.size, float(ratios[0]), chance, name, float(ratios[worst]), (power[0], power[1]))
