"""Linear least squares of any matrix, accurate where its columns are nearly dependent. The runs that a surface is fitted to, and whether they determine its terms.

numpy's QR factors after scaling the columns by powers of two, which rounds nothing, and one step of refinement whose sums are
exact. All numbers are doubles, so every machine reaches the same accuracy. Sources: Björck, Numerical Methods for Least Squares
Problems, 2.4 and 2.9; Golub and Van Loan, Matrix Computations, 5.2.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from doe.designs.evaluation import block_contrasts
from doe.designs.model import Terms
from rbdyn.base.arrays import Array, Rows, Whole
from rbdyn.base.faults import MethodError
from rbdyn.base.words import are, counted

DEPENDENT = 1e-9  # share of a column's length left over by the others below which it depends on them
SPLIT = 2.0**27 + 1.0  # divides the digits of a double into halves
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

    Residuals below the rounding of the response count as zero, and so does a coefficient whose column contributes no more
    than that.
    """
    columns, values = np.asarray(matrix, float), np.asarray(response, float)
    weight = np.ones(len(values)) if weights is None else np.asarray(weights, float)
    root = np.sqrt(weight)
    scale = _powers_of_two(columns * root[:, None])
    unit, target = columns * root[:, None] / scale, values * root
    orthogonal, triangle = np.linalg.qr(unit)
    back = linalg.solve_triangular(triangle, np.eye(len(triangle)))
    scaled, rest = _refined(unit, target, orthogonal, back)
    rounding = ROUNDING * np.linalg.norm(target)
    if np.linalg.norm(rest) <= rounding:
        rest = np.zeros_like(rest)
    scaled = np.where(np.abs(scaled) * np.linalg.norm(unit, axis=0) <= rounding, 0.0, scaled)
    inverse = (back @ back.T) / np.outer(scale, scale)
    dof = columns.shape[0] - columns.shape[1]
    share = weight / weight.sum()
    spread = (weight[:, None] * (columns - share @ columns) ** 2).sum(axis=0)
    varies = spread > ROUNDING**2 * (weight[:, None] * columns**2).sum(axis=0)
    return LeastSquares(
        coefficients=scaled / scale,
        inverse=inverse,
        residuals=rest / root,
        weights=weight,
        leverage=(orthogonal**2).sum(axis=1),
        inflation=np.where(varies, np.diag(inverse) * spread, np.nan),
        mean_square=float((rest**2).sum() / dof),
        dof=dof,
    )


def dependent_columns(matrix: Array) -> list[int]:
    """Columns that the others determine, found by a pivoted triangularisation of unit columns."""
    unit = matrix / np.linalg.norm(matrix, axis=0).clip(1e-300)
    _, triangle, pivots = linalg.qr(unit, mode="economic", pivoting=True)
    return sorted(pivots[np.abs(np.diag(triangle)) <= DEPENDENT].tolist())


def _refined(columns: Array, target: Array, orthogonal: Array, back: Array) -> tuple[Array, Array]:
    """Coefficients (p,) and residuals (n,) by the factor Q (n, p) and the inverse (p, p) of the triangle, refined once.

    What both leave of target = columns b + r and columns' r = 0 is summed exactly, so that factors of ten digits give fifteen.
    """
    coefficients = back @ (orthogonal.T @ target)
    rest = target - columns @ coefficients
    open_values = _exact_sums(np.column_stack([target, -rest, -columns]), np.concatenate([[1.0, 1.0], coefficients]))
    open_slopes = -_exact_sums(columns.T, rest)
    along = orthogonal.T @ open_values - back.T @ open_slopes
    return coefficients + back @ along, rest + open_values - orthogonal @ along


def _exact_sums(rows: Array, factors: Array) -> Array:
    """Product (n,) of rows (n, m) and factors (m,), each sum rounded once. Source: Dekker, A floating-point technique for
    extending the available precision, Numerische Mathematik 18 (1971) 224."""
    product = rows * factors
    (high, low), (factor_high, factor_low) = _halves(rows), _halves(factors)
    lost = ((high * factor_high - product) + high * factor_low + low * factor_high) + low * factor_low
    return np.array([math.fsum(parts) for parts in np.hstack([product, lost]).tolist()])


def _halves(numbers: Array) -> tuple[Array, Array]:
    """Numbers as sums of two of half as many digits."""
    large = SPLIT * numbers
    high = large - (large - numbers)
    return high, numbers - high


def _powers_of_two(columns: Array) -> Array:
    """The power of two nearest each column's largest number, by which division is exact."""
    largest = np.abs(columns).max(axis=0)
    return np.asarray(np.ldexp(1.0, np.frexp(largest)[1]))


@dataclass(frozen=True, eq=False)
class Data:
    """Runs of one response.

    ``points`` (n, k) coded, ``values`` (n,); ``standard_errors`` (n,) of the values or None where they are not
    all known; ``replicates`` (n,) behind each standard error (0: unknown); ``block`` (n,) label of each run;
    ``centre`` and ``step`` (k,) actual value at coded 0 and per coded unit; ``without``: places of factors that no term is
    made of.
    """

    points: Array
    values: Array
    standard_errors: Array | None
    replicates: Whole
    block: Whole
    centre: Array
    step: Array
    without: Collection[int] = ()

    def rows(self, rows: Rows) -> "Data":
        """The runs of these rows alone."""
        errors = None if self.standard_errors is None else self.standard_errors[rows]
        per_run = self.points[rows], self.values[rows], errors, self.replicates[rows], self.block[rows]
        return Data(*per_run, self.centre, self.step, self.without)

    @property
    def block_columns(self) -> Array:
        """Columns that distinguish the blocks, each of mean zero, shape (n, blocks - 1).

        The surface then stands for the mean over all runs, and blocks that are orthogonal leave it as it is.
        """
        return block_contrasts(self.block)


def checked(
    name: str,
    coded: ArrayLike,
    values: ArrayLike,
    centre: ArrayLike,
    step: ArrayLike,
    standard_errors: ArrayLike | None,
    replicates: ArrayLike | None,
    block: ArrayLike | None,
    without: Collection[int] = (),
) -> Data:
    """Runs as arrays. Raises MethodError when shapes differ, a number is not finite, or all values are equal."""
    points, response = np.asarray(coded, float), np.asarray(values, float)
    if points.ndim != 2 or response.shape != (len(points),):
        raise MethodError(
            f"{name}: points of shape {points.shape} and values of shape {response.shape} do not match; give one row "
            "of factors and one value a run"
        )
    if not np.isfinite(points).all():
        raise MethodError(f"{name}: a coded factor is not a finite number; fix or leave out that run")
    bad = np.flatnonzero(~np.isfinite(response))
    if bad.size:
        raise MethodError(f"{name}: the value of run {bad[0] + 1} is {response[bad[0]]}; fix or leave out that run")
    errors = None if standard_errors is None else np.broadcast_to(standard_errors, response.shape)
    known = errors is not None and bool((np.isfinite(errors) & (errors > 0)).all())
    return Data(
        points=points,
        values=response,
        standard_errors=np.array(errors, float) if known else None,
        replicates=_whole(replicates, len(points)),
        block=_whole(block, len(points)),
        centre=np.array(np.broadcast_to(centre, points.shape[1]), float),
        step=np.array(np.broadcast_to(step, points.shape[1]), float),
        without=without,
    )


def check_errors(name: str, standard_errors: ArrayLike | None) -> None:
    """Raises MethodError unless every run has a positive standard error, as weighting by them needs."""
    fix = 'give each run a positive error or use weighting = "equal"'
    if standard_errors is None:
        raise MethodError(f'{name}: weighting = "replicates" needs the errors of the runs; {fix}')
    errors = np.atleast_1d(np.asarray(standard_errors, float))
    bad = np.flatnonzero(~(np.isfinite(errors) & (errors > 0)))
    if bad.size:
        raise MethodError(
            f'{name}: the error of run {bad[0] + 1} is {errors[bad[0]]:g}, but weighting = "replicates" needs '
            f"positive ones; {fix}"
        )


def check_size(name: str, model: str, terms: Terms, block: Whole) -> None:
    """Raises MethodError when runs, by the ``block`` (n,) of each, are too few for the terms and the blocks."""
    runs, more = len(block), len(np.unique(block)) - 1
    size = len(terms) + more
    if runs <= size:
        blocks = f", {more} for the blocks" if more else ""
        raise MethodError(
            f"{name}: {counted(runs, 'run')} {are(runs)} too few for the {model} model; give at least {size + 1} "
            f"({len(terms)} terms{blocks} and one to judge the fit) or choose a simpler model"
        )


def check_matrix(name: str, model: str, terms: Terms, matrix: Array) -> None:
    """Raises MethodError when runs cannot distinguish the columns.

    ``matrix`` (n, p) holds the columns of ``terms``, then those of the blocks.
    """
    if dependent := dependent_columns(matrix):
        names = dict.fromkeys(terms[column] if column < len(terms) else "the blocks" for column in dependent)
        raise MethodError(
            f"{name}: the runs cannot separate {', '.join(sorted(names))} from the other terms of the {model} model "
            "(its matrix is singular); add design points or choose a simpler model"
        )


def _whole(labels: ArrayLike | None, size: int) -> Whole:
    if labels is None:
        return np.zeros(size, dtype=np.int64)
    return np.array(np.broadcast_to(labels, size)).astype(np.int64)
