"""The width of predictions: whether they are too wide or too narrow, and whether a design of measurements can show it.

Both count against a calibration. Rows are predicted in turn, each from those before it, so residuals of different rows are
independent. Each cell becomes a normal score by its rank among the draws of its prediction. The scores of a row are made
independent by their correlation among the draws. The sum of their squares is small if predictions are too wide and large if
they are too narrow. It is judged for all cells together and for each output apart; the draws themselves show how small the
smallest of these chances may be.

Of right predictions these sums are chi-square distributed, by the numbers of cells alone. So the probability that a table shows
predictions of another width is known of its design, before anything is simulated.

Sources: Dawid, Statistical theory: the prequential approach, J. R. Statist. Soc. A 147 (1984) 278; Westfall and Young,
Resampling-based multiple testing (1993), section 2.3, for the smallest of several chances.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy import special

from rbdyn.base.arrays import Array, Mask, Whole
from rbdyn.base.records import Record, keyed, outside_json, spread

# Probability of a rejection, of either side, if predictions are right.
REJECTION_LEVEL = 0.05
# Predictions this factor too wide or too narrow must be rejected at least this often, else the design cannot judge them.
TWICE, OFTEN = 2.0, 0.5
# Tables that a power is counted in, which gives it to 0.005.
TABLES = 100_000


class Scores(NamedTuple):
    """Predicted cells as independent standard normal scores.

    They are of the measured values (k,) and of draws of the predictions (s, k); ``output`` (k,) is that of each cell."""

    measured: Array
    draws: Array
    output: Whole


class Power(Record):
    """What a design shows of the width of its predictions.

    cells : number of cells that are predicted
    wide, narrow : probabilities of rejecting predictions that are twice too wide, and twice too narrow
    """

    wide: float = keyed("power_too_wide")
    narrow: float = keyed("power_too_narrow")
    cells: int = outside_json(default=0)

    @property
    def enough(self) -> bool:
        """Whether both are found in half of such tables."""
        return min(self.wide, self.narrow) >= OFTEN


class Width(Record):
    """The width of predictions of ``cells`` many cells.

    ratio : scatter of the residuals over the predicted scatter
    chance : probability of as much in either direction if predictions are right
    power : what the design shows of it, where that is known
    output, worst : place of the output that shows it most (None: all together), and its own ratio
    """

    cells: int = keyed("values")
    ratio: float
    chance: float
    power: Power | None = spread(default=None)
    output: int | None = outside_json(default=None)
    worst: float = outside_json(default=1.0)

    @property
    def rejected(self) -> bool:
        """Whether predictions are too wide or too narrow."""
        return self.chance <= REJECTION_LEVEL


def scores_of(draws: Array, measured: Array, output: Whole) -> Scores:
    """Scores of the cells of a row, by draws (s, a) of its joint prediction."""
    count = len(draws)
    ranks = np.argsort(np.argsort(draws, axis=0, kind="stable"), axis=0)
    places = np.vstack([(draws < measured).sum(axis=0) * (count / (count + 1.0)), ranks])
    scores = special.ndtri((places + 0.5) / count)
    correlation = np.corrcoef(scores[1:].T).reshape(measured.size, measured.size)
    # Cells of one sensor may be almost identical.
    root = np.linalg.cholesky(correlation + 1e-6 * np.eye(measured.size))
    independent = np.linalg.solve(root, scores.T).T
    return Scores(independent[0], independent[1:], output)


def width(parts: Sequence[Scores], power: Power | None = None) -> Width:
    """The width of predictions, from the scores of all predicted rows."""
    output = np.concatenate([row.output for row in parts])
    squares = np.hstack([np.vstack([row.measured, row.draws]) for row in parts]) ** 2
    names = np.unique(output)
    groups = np.column_stack([np.ones(output.size), *(output == name for name in names)]).astype(float)
    groups = groups if names.size > 1 else groups[:, :1]
    sums = squares @ groups
    sorted_sums = np.sort(sums[1:], axis=0)
    least = np.sort(_chances(sorted_sums, sums[1:]).min(axis=1))
    observed = _chances(sorted_sums, sums[:1])[0]
    worst = int(np.argmin(observed))
    ratios = np.sqrt(sums[0] / groups.sum(axis=0))
    chance = (1.0 + float(np.searchsorted(least, observed.min(), "right"))) / (len(least) + 1.0)
    name = None if worst == 0 else int(names[worst - 1])
    return Width(output.size, float(ratios[0]), chance, power, name, float(ratios[worst]))


def _chances(sorted_sums: Array, sums: Array) -> Array:
    """Probabilities (n, g) of sums (n, g) as small or as large among the sorted ones (s, g), the smaller of both."""
    count, pairs = len(sorted_sums), list(zip(sorted_sums.T, sums.T, strict=True))
    below = np.column_stack([np.searchsorted(listed, draws, "right") for listed, draws in pairs])
    above = count - np.column_stack([np.searchsorted(listed, draws) for listed, draws in pairs])
    return (1.0 + np.minimum(below, above)) / (count + 1.0)


def prequential(row: Whole, validation: Mask, random: np.random.Generator) -> tuple[list[Whole], int]:
    """Places of the cells of each row in the order of their prediction, and the number of rows that are only learned from.

    These are half of the training rows, in random order; rows held out come last. ``row``, ``validation``: (c,)
    """
    training, held = (
        [places[row[places] == number] for number in random.permutation(np.unique(row[places]))]
        for places in (np.flatnonzero(~validation), np.flatnonzero(validation))
    )
    return [*training, *held], (len(training) + 1) // 2


def power_of(output: Whole, row: Whole, validation: Mask, seed: int) -> Power:
    """The power of a design by the output, the row and the use of each cell (c,); ``seed`` is that of the calibration."""
    order, start = prequential(row, validation, np.random.default_rng(seed))
    return _power_of_counts(*np.unique(output[np.concatenate(order[start:])], return_counts=True)[1].tolist())


@cache
def _power_of_counts(*numbers: int) -> Power:
    """The power by the number of predicted cells of each output."""
    counts = np.array(numbers)
    apart = np.random.default_rng(0).chisquare(counts, (TABLES, counts.size))
    sums, freedom = (np.column_stack([parts.sum(axis=1), parts]) for parts in (apart, counts[None]))
    limit = np.sort(_exact_chances(freedom, sums))[int(REJECTION_LEVEL * TABLES)]
    # Measured values that scatter half as much as predicted, or twice.
    wide, narrow = (float((_exact_chances(freedom, by * sums) <= limit).mean()) for by in (TWICE**-2, TWICE**2))
    return Power(wide, narrow, int(counts.sum()))


def _exact_chances(freedom: Array, sums: Array) -> Array:
    """The smallest probability (n,) of sums (n, g) as small or as large, all together and by output."""
    below = special.chdtr(freedom, sums)
    return np.asarray(np.minimum(below, 1.0 - below).min(axis=1))
