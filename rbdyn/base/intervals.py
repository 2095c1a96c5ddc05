"""Intervals of figures with errors: standard errors from half-widths, their sums by Welch, several that hold together.

Half-widths are of 95 %, by Student's t at their degrees of freedom; infinite ones are normal. Sources: B. L. Welch, Biometrika 34
(1947) 28, eq. 28; C. E. Bonferroni for intervals that hold together.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from rbdyn.base.arrays import Array

if TYPE_CHECKING:
    from rbdyn.result import Quantity

LEVEL = 0.95  # probability that a stated interval holds the truth


def standard_errors(half_widths: ArrayLike, freedom: ArrayLike) -> Array:
    """Standard errors from half-widths of 95 %, any shape; 0 for an unknown half-width (NaN)."""
    return np.nan_to_num(np.asarray(half_widths, float)) / special.stdtrit(freedom, 0.5 + 0.5 * LEVEL)


def joint_freedom(errors: Sequence[Array], freedom: Sequence[Array]) -> Array:
    """Degrees of freedom of the root sum square of independent standard ``errors``; infinite where all errors are 0."""
    variances = [error**2 for error in errors]
    spread = np.sum([variance**2 / dof for variance, dof in zip(variances, freedom, strict=True)], axis=0)
    total = np.sum(variances, axis=0)
    return np.divide(total**2, spread, out=np.full_like(total, np.inf), where=spread > 0.0)


def joint_half_width(errors: Sequence[Array], freedom: Sequence[Array]) -> tuple[Array, Array]:
    """95 % half-widths of sums or differences of figures with independent standard ``errors``, and their degrees of freedom."""
    joint = joint_freedom(errors, freedom)
    total = np.sqrt(np.sum([error**2 for error in errors], axis=0))
    return total * special.stdtrit(joint, 0.5 + 0.5 * LEVEL), joint


def times_wider(freedom: ArrayLike, count: int) -> Array:
    """Factor by which half-widths of 95 % grow so that ``count`` of them hold together (Bonferroni)."""
    level = 1.0 - 0.5 * (1.0 - LEVEL) / count
    return np.asarray(special.stdtrit(freedom, level) / special.stdtrit(freedom, 0.5 + 0.5 * LEVEL))


def one_sided(freedom: ArrayLike, probability: float) -> Array:
    """Share of a half-width of 95 % that holds on one side with a ``probability``."""
    return np.asarray(special.stdtrit(freedom, probability) / special.stdtrit(freedom, 0.5 + 0.5 * LEVEL))


def chance_above(room: ArrayLike, half_width: ArrayLike, freedom: ArrayLike) -> Array:
    """Probability that a value, estimated ``room`` above a bound with a ``half_width`` of 95 %, lies above it."""
    scaled = np.asarray(room) / np.asarray(half_width) * special.stdtrit(freedom, 0.5 + 0.5 * LEVEL)
    return np.asarray(special.stdtr(freedom, scaled))


def errors_of_differences(first: Sequence["Quantity"], second: Sequence["Quantity"]) -> tuple[Array, Array]:
    """95 % half-widths (m,) of the differences of figures alone, and of all of them together; NaN where a statistical error is unknown.

    Statistical errors are those of Welch with the freedom of the fewer replicates for both: with its own, many replicates on one
    side lend theirs to the few on the other wherever these scatter little by chance (3 against 16: 13 % of five equal figures
    showed a difference, 2 % by this rule). Numerical errors are added as normal ones.
    """
    statistical, numerical, freedom = (
        np.array([[getattr(figure, kind) for figure in side] for side in (first, second)], float)
        for kind in ("statistical_error", "numerical_error", "degrees_of_freedom")
    )
    freedom = np.nan_to_num(freedom, nan=np.inf, posinf=np.inf)
    errors = np.where(np.isnan(statistical), np.nan, standard_errors(statistical, freedom))
    fewer = freedom.min(axis=0)
    half, joint = joint_half_width([*errors], [fewer, fewer])
    known = np.hypot(*np.nan_to_num(numerical))
    alone = np.hypot(half, known)
    count = max(int((np.nan_to_num(alone) > 0.0).sum()), 1)
    return alone, np.hypot(half * times_wider(joint, count), known * times_wider(np.inf, count))
