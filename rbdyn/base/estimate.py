"""Estimates: figures with errors, their differences, means and the largest of them, and intervals that hold together.

Half-widths are of 95 %, by Student's t at their degrees of freedom; infinite ones are normal. Sources: B. L. Welch, Biometrika 34
(1947) 28, eq. 28; C. E. Bonferroni for intervals that hold together; E. B. Wilson, JASA 22 (1927) 209, for shares.

The largest of several estimates exceeds the largest true value on average, because the luckiest error wins. Its error is not that
of the estimate that happens to be largest. Both are found by simulation: errors are drawn about the estimates, and the maximum is
taken of every draw.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from rbdyn.base.arrays import Array

LEVEL = 0.95  # probability that a stated interval holds the truth
# Draws of the errors, each with its mirror image, and their seed.
DRAWS, SEED = 2048, 1


class Estimate(NamedTuple):
    """Independent figures, arrays of one shape: values, standard errors (NaN: unknown), and degrees of freedom of these.

    ``numerical``: standard errors of the numerical method, which are normal. Figures of a mean or a maximum are on the last axis.
    """

    value: Array
    error: Array
    freedom: Array
    numerical: ArrayLike = 0.0

    @property
    def joint(self) -> "Estimate":
        """The same with the numerical errors among the others."""
        return Estimate(self.value, *_joint(self._sources))

    def __sub__(self, other: "Estimate") -> "Estimate":
        """Differences, with the freedom of Welch."""
        return Estimate(self.value - other.value, *_joint([*self._sources, *other._sources]))

    @property
    def _sources(self) -> list[tuple[Array, Array]]:
        numerical = np.broadcast_to(self.numerical, np.shape(self.error))
        return [(self.error, self.freedom), (numerical, np.full_like(numerical, np.inf))]

    @property
    def half_width(self) -> Array:
        """Half-widths of 95 % of the errors without the numerical ones."""
        return np.asarray(self.error * quantile(self.freedom))

    @property
    def inverse(self) -> "Estimate":
        """Inverse values, with errors of first order."""
        return Estimate(1.0 / self.value, self.error / self.value**2, self.freedom)

    def columns(self, places: Sequence[int]) -> "Estimate":
        """The same of the figures at these places."""
        return Estimate(self.value[..., places], self.error[..., places], self.freedom[..., places])

    def mean(self, weights: Array) -> "Estimate":
        """Means (n,) of figures (n, p) with ``weights`` (p,) that sum to 1; their errors have the freedom of Welch."""
        counted = np.flatnonzero(weights > 0.0).tolist()
        parts = self.columns(counted)
        if len(counted) == 1:
            return Estimate(*(array[:, 0] for array in parts[:3]))
        errors = weights[counted] * parts.error
        freedom = welch([*errors.T], [*parts.freedom.T])
        return Estimate((weights[counted] * parts.value).sum(axis=1), np.sqrt((errors**2).sum(axis=1)), freedom)

    def largest(self) -> tuple["Estimate", Array]:
        """The largest (n,) of figures (n, p), and the probability (n, p) of each figure to be it.

        The median of the maximum over drawn errors, less the largest estimate, is its bias. The figures are lowered to the maximum
        without it, and what their drawn maximum still exceeds the estimate by is taken off too. This is the iterated bootstrap of
        P. Hall, The Bootstrap and Edgeworth Expansion (1992), section 1.4, with a median, which exists for any freedom. Each
        figure's half-width counts, in root mean square, by the odds that it is the largest; that of the drawn maximum covers too
        seldom, for errors that are level there hide each other. A figure that is the largest in every draw is the answer with its
        own error.
        """
        rows = [_largest(*row) for row in zip(*self[:3], strict=True)]
        value, error, freedom, odds = (np.array(column) for column in zip(*rows, strict=True))
        return Estimate(value, error, freedom), odds


def quantile(freedom: ArrayLike, probability: float = 0.5 + 0.5 * LEVEL) -> Array:
    """Student's t at a probability: by default, half-widths of 95 % over their standard errors."""
    return np.asarray(special.stdtrit(freedom, probability))


def standard_errors(half_widths: ArrayLike, freedom: ArrayLike) -> Array:
    """Standard errors from half-widths of 95 %, any shape; 0 for an unknown half-width (NaN)."""
    return np.asarray(np.nan_to_num(np.asarray(half_widths, float)) / quantile(freedom))


def welch(errors: Sequence[Array], freedom: Sequence[Array]) -> Array:
    """Degrees of freedom of the root sum square of independent standard ``errors``; infinite where all errors are 0."""
    variances = [error**2 for error in errors]
    spread = np.sum([variance**2 / dof for variance, dof in zip(variances, freedom, strict=True)], axis=0)
    total = np.sum(variances, axis=0)
    return np.divide(total**2, spread, out=np.full_like(total, np.inf), where=spread > 0.0)


def _joint(sources: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Root sum square of independent standard errors, each with its degrees of freedom, and those of the sum."""
    errors, freedom = zip(*sources, strict=True)
    return np.sqrt(np.sum([error**2 for error in errors], axis=0)), welch(errors, freedom)


def times_wider(freedom: ArrayLike, count: int) -> Array:
    """Factor by which half-widths of 95 % grow so that ``count`` of them hold together (Bonferroni)."""
    return one_sided(freedom, 1.0 - 0.5 * (1.0 - LEVEL) / count)


def one_sided(freedom: ArrayLike, probability: float) -> Array:
    """Share of a half-width of 95 % that holds on one side with a ``probability``."""
    return np.asarray(quantile(freedom, probability) / quantile(freedom))


def chance_above(room: ArrayLike, half_width: ArrayLike, freedom: ArrayLike) -> Array:
    """Probability that a value, estimated ``room`` above a bound with a ``half_width`` of 95 %, lies above it."""
    return np.asarray(special.stdtr(freedom, np.asarray(room) / np.asarray(half_width) * quantile(freedom)))


def errors_of_differences(first: Array, second: Array) -> tuple[Array, Array]:
    """95 % half-widths (m,) of the differences of figures alone, and of all of them together; NaN where a statistical error is unknown.

    ``first``, ``second``: figures (4, m) as `rbdyn.result.arrays_of` gives them. Statistical errors are those of Welch with the
    freedom of the fewer replicates for both: with its own, many replicates on one side lend theirs to the few on the other
    wherever these scatter little by chance (3 against 16: 13 % of five equal figures showed a difference, 2 % by this rule).
    Numerical errors are added as normal ones.
    """
    _, statistical, numerical, freedom = np.stack([first, second], axis=1)
    errors = np.where(np.isnan(statistical), np.nan, standard_errors(statistical, freedom))
    joint = Estimate(first[0], *_joint([(error, freedom.min(axis=0)) for error in errors]))
    known = np.hypot(*np.nan_to_num(numerical))
    alone = np.hypot(joint.half_width, known)
    count = max(int((np.nan_to_num(alone) > 0.0).sum()), 1)
    wide = joint.half_width * times_wider(joint.freedom, count)
    return alone, np.hypot(wide, known * times_wider(np.inf, count))


def wilson(share: float, count: int) -> tuple[float, float]:
    """95 % interval of a share of ``count`` independent cases."""
    z = float(special.ndtri(0.5 + 0.5 * LEVEL))
    middle = (share + z * z / (2.0 * count)) / (1.0 + z * z / count)
    half = z / (1.0 + z * z / count) * np.sqrt(share * (1.0 - share) / count + z * z / (4.0 * count * count))
    return max(middle - half, 0.0), min(middle + half, 1.0)


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
    return float(values[top]) - bias - excess, half / float(quantile(joint)), joint, odds


@cache
def _student(freedom: tuple[float, ...]) -> Array:
    """Draws (d, p) of Student's t, symmetrical about 0; those of a figure depend on its place and freedom alone."""
    uniform = np.column_stack([np.random.default_rng((SEED, place)).random(DRAWS) for place in range(len(freedom))])
    drawn = special.stdtrit(np.array(freedom), uniform)
    return np.asarray(np.vstack([drawn, -drawn]))
