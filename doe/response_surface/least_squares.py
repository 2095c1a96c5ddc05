"""Linear least squares of any matrix, accurate where its columns are nearly dependent.

Householder triangularisation in extended precision (64 bits of mantissa on x86, 53 where the machine has no
more), after scaling the columns by powers of two, which rounds nothing. The numbers of a designed experiment
are so few that the extra bits cost microseconds. Sources: Björck, Numerical Methods for Least Squares Problems,
2.4; Golub and Van Loan, Matrix Computations, 5.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg

from doe.arrays import Array

Extended = NDArray[np.longdouble]

DEPENDENT = 1e-9  # share of a column's length left over by the others below which it depends on them
ROUNDING = 8 * np.finfo(np.float64).eps  # what is below this share of the response is its rounding


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Minimum of sum(weights * residuals^2).

    ``coefficients`` (p,); ``inverse`` (p, p) of X'WX; ``residuals`` (n,) in the unit of the response;
    ``leverage`` (n,), the diagonal of the hat matrix; ``mean_square`` of the weighted residuals over ``dof``;
    ``inflation`` (p,), the variance inflation factor of each column, NaN for one that does not vary.
    """

    coefficients: Array
    inverse: Array
    residuals: Array
    weights: Array
    leverage: Array
    inflation: Array
    mean_square: float
    dof: int

    @property
    def residual_sum(self) -> float:
        """Weighted sum of squared residuals."""
        return self.mean_square * self.dof

    def partial_sum(self, columns: Sequence[int]) -> float:
        """Partial (type III) sum of squares: what the residual sum grows by without these columns."""
        chosen = list(columns)
        part = self.coefficients[chosen]
        return float(part @ np.linalg.solve(self.inverse[np.ix_(chosen, chosen)], part))


def solve(matrix: ArrayLike, response: ArrayLike, weights: ArrayLike | None = None) -> LeastSquares:
    """Fit ``matrix`` (n, p) of full column rank to ``response`` (n,), n > p; weights (n,) positive, 1 if None.

    Arrays of extended precision are taken as such; all results are doubles. Residuals below the rounding of
    the response count as zero, and so does a coefficient whose column contributes no more than that.
    """
    columns = np.asarray(matrix, np.longdouble)
    values = np.asarray(response, np.longdouble)
    weight = np.ones(len(values)) if weights is None else np.asarray(weights, float)
    root = np.sqrt(np.asarray(weight, np.longdouble))
    scale = _powers_of_two(columns * root[:, None])
    orthogonal, triangle = _triangularise(columns * root[:, None] / scale)
    back = _inverse_of_triangle(triangle)
    scaled = back @ (orthogonal.T @ (values * root))
    # One step of refinement takes away what the reflections rounded.
    scaled = scaled + back @ (orthogonal.T @ ((values - columns @ (scaled / scale)) * root))
    residuals = values - columns @ (scaled / scale)
    rounding = ROUNDING * _length(values * root)
    if _length(residuals * root) <= rounding:
        residuals = np.zeros_like(residuals)
    scaled = np.where(np.abs(scaled) * _length(columns * root[:, None] / scale) <= rounding, 0, scaled)
    inverse = (back @ back.T) / np.outer(scale, scale)
    dof = columns.shape[0] - columns.shape[1]
    share = weight / weight.sum()
    spread = (weight[:, None] * (columns - share @ columns) ** 2).sum(axis=0)
    varies = spread > ROUNDING**2 * (weight[:, None] * columns**2).sum(axis=0)
    return LeastSquares(
        coefficients=(scaled / scale).astype(float),
        inverse=inverse.astype(float),
        residuals=residuals.astype(float),
        weights=weight,
        leverage=(orthogonal**2).sum(axis=1).astype(float),
        inflation=np.where(varies, np.diag(inverse) * spread, np.nan).astype(float),
        mean_square=float(((residuals * root) ** 2).sum() / dof),
        dof=dof,
    )


def dependent_columns(matrix: Array) -> list[int]:
    """Columns that the others determine, found by a pivoted triangularisation of unit columns."""
    unit = matrix / np.linalg.norm(matrix, axis=0).clip(1e-300)
    _, triangle, pivots = linalg.qr(unit, mode="economic", pivoting=True)
    return sorted(pivots[np.abs(np.diag(triangle)) <= DEPENDENT].tolist())


def _length(columns: Extended) -> Extended:
    """Euclidean length of each column."""
    return np.sqrt((columns**2).sum(axis=0))


def _powers_of_two(columns: Extended) -> Extended:
    """The power of two nearest each column's largest number, by which division is exact."""
    largest = np.abs(columns).max(axis=0)
    return np.ldexp(np.ones_like(largest), np.frexp(largest)[1])


def _triangularise(columns: Extended) -> tuple[Extended, Extended]:
    """Orthonormal (n, p) and upper triangular (p, p) factors by Householder reflections."""
    work = columns.copy()
    runs, size = work.shape
    reflectors = []
    for column in range(size):
        reflector = work[column:, column].copy()
        reflector[0] += np.copysign(_length(reflector), reflector[0])
        reflector /= _length(reflector)
        _reflect(reflector, work[column:, column:])
        reflectors.append(reflector)
    orthogonal = np.eye(runs, size, dtype=np.longdouble)
    for column in reversed(range(size)):
        _reflect(reflectors[column], orthogonal[column:, column:])
    return orthogonal, np.triu(work[:size])


def _reflect(reflector: Extended, block: Extended) -> None:
    block -= 2 * np.outer(reflector, reflector @ block)


def _inverse_of_triangle(triangle: Extended) -> Extended:
    inverse = np.zeros_like(triangle)
    for row in reversed(range(len(triangle))):
        inverse[row] = -(triangle[row, row + 1 :] @ inverse[row + 1 :])
        inverse[row, row] += 1
        inverse[row] /= triangle[row, row]
    return inverse
