"""One figure of several uncertain ones: their weighted mean, or the largest of them, with its error.

The largest of several estimates exceeds the largest true value on average, because the luckiest error wins. Its error is not that
of the estimate that happens to be largest. Both are found by simulation: errors are drawn about the estimates, and the maximum is
taken of every draw.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy import special

from rbdyn.base.arrays import Array
from rbdyn.base.intervals import LEVEL, joint_freedom

# Draws of the errors, each with its mirror image, and their seed.
DRAWS, SEED = 2048, 1


class Estimates(NamedTuple):
    """Independent estimates (n, p) of p figures in n cases, their standard errors (NaN: unknown) and degrees of freedom.

    Errors of infinite freedom are normal.
    """

    values: Array
    errors: Array
    freedom: Array

    def columns(self, places: list[int]) -> "Estimates":
        """The same of the figures at these places."""
        return Estimates(self.values[:, places], self.errors[:, places], self.freedom[:, places])


class Aggregated(NamedTuple):
    """One figure (n,) of several, its standard error (n,) and the degrees of freedom (n,) of that.

    ``odds`` (n, p): probability of each figure to be the largest.
    """

    values: Array
    errors: Array
    freedom: Array
    odds: Array


def quantile(freedom: Array) -> Array:
    """Half-widths of 95 % over their standard errors: Student's t."""
    return np.asarray(special.stdtrit(freedom, 0.5 + 0.5 * LEVEL))


def weighted_mean(estimates: Estimates, weights: Array) -> Aggregated:
    """Mean with ``weights`` (p,) that sum to 1; its error has the freedom of Welch and Satterthwaite."""
    odds = np.broadcast_to(weights, estimates.values.shape)
    counted = np.flatnonzero(weights > 0.0).tolist()
    values, errors, freedom = estimates.columns(counted)
    if len(counted) == 1:
        return Aggregated(values[:, 0], errors[:, 0], freedom[:, 0], odds)
    parts = weights[counted] * errors
    joint = joint_freedom([*parts.T], [*freedom.T])
    return Aggregated((weights[counted] * values).sum(axis=1), np.sqrt((parts**2).sum(axis=1)), joint, odds)


def largest(estimates: Estimates) -> Aggregated:
    """Largest figure of each case.

    The median of the maximum over drawn errors, less the largest estimate, is its bias. The figures are lowered to the maximum
    without it, and what their drawn maximum still exceeds the estimate by is taken off too. This is the iterated bootstrap of
    P. Hall, The Bootstrap and Edgeworth Expansion (1992), section 1.4, with a median, which exists for any freedom. Each
    figure's half-width counts, in root mean square, by the odds that it is the largest; that of the drawn maximum covers too
    seldom, for errors that are level there hide each other. A figure that is the largest in every draw is the answer with its
    own error.
    """
    rows = [_largest(*row) for row in zip(*estimates, strict=True)]
    values, errors, freedom, odds = (np.array(column) for column in zip(*rows, strict=True))
    return Aggregated(values, errors, freedom, odds)


def _largest(values: Array, errors: Array, freedom: Array) -> tuple[float, float, float, Array]:
    top = int(values.argmax())
    deviations = np.nan_to_num(errors) * _student(tuple(freedom.tolist()))[:, : values.size]
    drawn = values + deviations
    odds = np.bincount(drawn.argmax(axis=1), minlength=values.size) / len(drawn)
    if odds[top] == 1.0:
        return float(values[top]), float(errors[top]), float(freedom[top]), odds
    bias = float(np.median(drawn.max(axis=1))) - float(values[top])
    lowered = np.minimum(values, values[top] - bias)
    # Such figures would show this much more than was estimated.
    excess = float(np.median((lowered + deviations).max(axis=1))) - float(values[top])
    half = float(np.sqrt((odds * (quantile(freedom) * errors) ** 2).sum()))
    joint = 1.0 / float((odds / freedom).sum()) if np.isfinite(freedom).any() else np.inf
    return float(values[top]) - bias - excess, half / float(quantile(np.array(joint))), joint, odds


@cache
def _student(freedom: tuple[float, ...]) -> Array:
    """Draws (d, p) of Student's t, symmetrical about 0; those of a figure depend on its place and freedom alone."""
    uniform = np.column_stack([np.random.default_rng((SEED, place)).random(DRAWS) for place in range(len(freedom))])
    drawn = special.stdtrit(np.array(freedom), uniform)
    return np.asarray(np.vstack([drawn, -drawn]))
