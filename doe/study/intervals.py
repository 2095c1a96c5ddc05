"""Intervals of simulated values by Student's t at the degrees of freedom that are behind their errors.

A half-width of 95 % holds one value with 95 %. Of several that are to hold together each takes its share of the 5 %
(Bonferroni), and how much wider it becomes depends on the degrees of freedom: 1.2 times for three of many, 1.8 times for
three of two. A sum of independent errors has those of Welch and Satterthwaite; what is known has infinitely many.

Sources: Satterthwaite, An approximate distribution of estimates of variance components (1946); Welch, The generalization of
"Student's" problem when several different population variances are involved (1947).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from doe.arrays import Array

LEVEL = 0.95  # that a stated interval holds the truth


def standard_errors(half_widths: ArrayLike, freedom: ArrayLike) -> Array:
    """Standard errors from half-widths of 95 %, any shape; of an unknown half-width (NaN) none."""
    return np.nan_to_num(np.asarray(half_widths, float)) / special.stdtrit(freedom, 0.5 + 0.5 * LEVEL)


def joint_freedom(errors: Sequence[Array], freedom: Sequence[Array]) -> Array:
    """Degrees of freedom of the root sum square of independent standard ``errors``, each with its own; infinitely many of
    none."""
    variances = [each**2 for each in errors]
    spread = np.sum([each**2 / behind for each, behind in zip(variances, freedom, strict=True)], axis=0)
    total = np.sum(variances, axis=0)
    return np.divide(total**2, spread, out=np.full_like(total, np.inf), where=spread > 0.0)


def times_wider(freedom: ArrayLike, count: int) -> Array:
    """How many times wider half-widths of 95 % are where ``count`` of them are to hold together (Bonferroni)."""
    together = 1.0 - 0.5 * (1.0 - LEVEL) / count
    return np.asarray(special.stdtrit(freedom, together) / special.stdtrit(freedom, 0.5 + 0.5 * LEVEL))


def one_sided(freedom: ArrayLike, probability: float) -> Array:
    """What part of a half-width of 95 % holds on one side with a ``probability``."""
    return np.asarray(special.stdtrit(freedom, probability) / special.stdtrit(freedom, 0.5 + 0.5 * LEVEL))


def chance_above(room: ArrayLike, half_width: ArrayLike, freedom: ArrayLike) -> Array:
    """Probability that a value, estimated ``room`` above a bound with a ``half_width`` of 95 %, lies above it."""
    scaled = np.asarray(room) / np.asarray(half_width) * special.stdtrit(freedom, 0.5 + 0.5 * LEVEL)
    return np.asarray(special.stdtr(freedom, scaled))
