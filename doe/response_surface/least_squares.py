"""Linear least squares for surfaces: the runs of a response and their checks, the solution, and power transforms.

- ``run_data``: runs as arrays, ``Data``; ``check_size`` and ``check_matrix``: whether they determine the terms
- ``solve``: least squares, accurate for nearly dependent columns. The columns are scaled by powers of two, which is exact.
  numpy's QR factors give a first solution, and one step of refinement with exact sums improves it. All numbers are doubles,
  so every machine reaches the same accuracy.
- ``box_cox``: power transform of a positive response, t = (y^lambda - 1)/lambda, or ln y for lambda = 0. It helps where
  the scatter of y grows with y, or where curvature is due to the scale. ``forward`` and ``backward`` convert.

Sources: Björck, Numerical Methods for Least Squares Problems, 2.4 and 2.9; Golub and Van Loan, Matrix Computations, 5.2; Box
and Cox, An analysis of transformations, J. R. Stat. Soc. B 26 (1964) 211-252.
"""

import math
from collections.abc import Callable, Sequence
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg, optimize, special, stats

from doe.designs.model import Terms, block_contrasts
from rbdyn.base.arrays import Array, Rows, Whole
from rbdyn.base.estimate import LEVEL
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record, keyed
from rbdyn.base.words import are, counted

DEPENDENT = 1e-9  # share of a column's length outside the span of the others below which it depends on them
SPLIT = 2.0**27 + 1.0  # divides the digits of a double into halves
ROUNDING = 8 * np.finfo(np.float64).eps  # share of the response below which a value is rounding


class LeastSquares(Record, eq=False):
    """Minimum of the sum of squared residuals.

    ``coefficients`` (p,); ``inverse`` (p, p) of X'X; ``residuals`` (n,) in the unit of the response;
    ``leverage`` (n,), the diagonal of the hat matrix; ``mean_square`` of the residuals over ``dof``;
    ``inflation`` (p,), the variance inflation factor of each column, NaN for one that does not vary.
    """

    coefficients: Array
    inverse: Array
    residuals: Array
    leverage: Array
    inflation: Array
    mean_square: float
    dof: int

    @property
    def residual_sum(self) -> float:
        """Sum of squared residuals."""
        return self.mean_square * self.dof

    def partial_sum(self, columns: Sequence[int]) -> float:
        """Partial (type III) sum of squares: increase of the residual sum without these columns."""
        places = list(columns)
        part = self.coefficients[places]
        return float(part @ np.linalg.solve(self.inverse[np.ix_(places, places)], part))


def solve(matrix: ArrayLike, response: ArrayLike) -> LeastSquares:
    """Fit ``matrix`` (n, p) of full column rank to ``response`` (n,), n > p.

    Residuals below the rounding of the response are zero, and so are coefficients whose columns contribute less.
    """
    columns, values = np.asarray(matrix, float), np.asarray(response, float)
    scale = _powers_of_two(columns)
    unit = columns / scale
    orthogonal, triangle = np.linalg.qr(unit)
    back = linalg.solve_triangular(triangle, np.eye(len(triangle)))
    scaled, residuals = _refinement(unit, values, orthogonal, back)
    rounding = ROUNDING * np.linalg.norm(values)
    if np.linalg.norm(residuals) <= rounding:
        residuals = np.zeros_like(residuals)
    scaled = np.where(np.abs(scaled) * np.linalg.norm(unit, axis=0) <= rounding, 0.0, scaled)
    inverse = (back @ back.T) / np.outer(scale, scale)
    dof = columns.shape[0] - columns.shape[1]
    spread = ((columns - columns.mean(axis=0)) ** 2).sum(axis=0)
    varies = spread > ROUNDING**2 * (columns**2).sum(axis=0)
    return LeastSquares(
        coefficients=scaled / scale,
        inverse=inverse,
        residuals=residuals,
        leverage=(orthogonal**2).sum(axis=1),
        inflation=np.where(varies, np.diag(inverse) * spread, np.nan),
        mean_square=float((residuals**2).sum() / dof),
        dof=dof,
    )


def dependent_columns(matrix: Array) -> list[int]:
    """Columns that depend on the others, by a pivoted triangularisation of unit columns."""
    unit = matrix / np.linalg.norm(matrix, axis=0).clip(1e-300)
    _, triangle, pivots = linalg.qr(unit, mode="economic", pivoting=True)
    return sorted(pivots[np.abs(np.diag(triangle)) <= DEPENDENT].tolist())


def _refinement(columns: Array, target: Array, orthogonal: Array, back: Array) -> tuple[Array, Array]:
    """Coefficients (p,) and residuals (n,) by the factor Q (n, p) and the inverse (p, p) of the triangle, refined once.

    The residuals of target = columns b + r and columns' r = 0 are exact sums, so that factors of ten digits give fifteen.
    """
    coefficients = back @ (orthogonal.T @ target)
    defect = target - columns @ coefficients
    open_values = _exact_sums(np.column_stack([target, -defect, -columns]), np.concatenate([[1.0, 1.0], coefficients]))
    open_slopes = -_exact_sums(columns.T, defect)
    along = orthogonal.T @ open_values - back.T @ open_slopes
    return coefficients + back @ along, defect + open_values - orthogonal @ along


def _exact_sums(rows: Array, factors: Array) -> Array:
    """Product (n,) of rows (n, m) and factors (m,), each sum rounded once.

    Source: Dekker, A floating-point technique for extending the available precision, Numerische Mathematik 18 (1971) 224.
    """
    product = rows * factors
    (high, low), (factor_high, factor_low) = _halves(rows), _halves(factors)
    lost = ((high * factor_high - product) + high * factor_low + low * factor_high) + low * factor_low
    return np.array([math.fsum(parts) for parts in np.hstack([product, lost]).tolist()])


def _halves(numbers: Array) -> tuple[Array, Array]:
    """Numbers as sums of two numbers of half as many digits."""
    large = SPLIT * numbers
    high = large - (large - numbers)
    return high, numbers - high


def _powers_of_two(columns: Array) -> Array:
    """Power of two near the largest number of each column; division by it is exact."""
    return np.asarray(np.ldexp(1.0, np.frexp(np.abs(columns).max(axis=0))[1]))


class Data(Record, eq=False):
    """Runs of one response.

    ``points`` (n, k) are coded; ``values`` (n,). ``standard_errors`` (n,): None unless all are known. ``replicates`` (n,):
    number behind each standard error, 0 if unknown. ``block`` (n,): label of each run. ``centre``, ``step`` (k,): actual value
    at coded 0 and change per coded unit.
    """

    points: Array
    values: Array
    standard_errors: Array | None
    replicates: Whole
    block: Whole
    centre: Array
    step: Array

    def rows(self, rows: Rows) -> "Data":
        """The runs of these rows alone."""
        errors = None if self.standard_errors is None else self.standard_errors[rows]
        per_run = self.points[rows], self.values[rows], errors, self.replicates[rows], self.block[rows]
        return Data(*per_run, self.centre, self.step)

    @property
    def block_columns(self) -> Array:
        """Columns of the blocks, each of mean zero, shape (n, blocks - 1).

        With them the surface predicts the mean over all runs, and orthogonal blocks do not change it.
        """
        return block_contrasts(self.block)


def run_data(
    name: str,
    coded: ArrayLike,
    values: ArrayLike,
    centre: ArrayLike,
    step: ArrayLike,
    standard_errors: ArrayLike | None,
    replicates: ArrayLike | None,
    block: ArrayLike | None,
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
    usable = errors is not None and bool((np.isfinite(errors) & (errors > 0)).all())
    return Data(
        points=points,
        values=response,
        standard_errors=np.array(errors, float) if usable else None,
        replicates=_labels(replicates, len(points)),
        block=_labels(block, len(points)),
        centre=np.array(np.broadcast_to(centre, points.shape[1]), float),
        step=np.array(np.broadcast_to(step, points.shape[1]), float),
    )


def check_size(name: str, model: str, terms: Terms, block: Whole) -> None:
    """Raises MethodError when the runs, with their ``block`` (n,), are too few for the terms and the blocks."""
    runs, size = len(block), len(terms) + len(np.unique(block)) - 1
    if runs <= size:
        raise MethodError(
            f"{name}: {counted(runs, 'run')} {are(runs)} too few for the {model} model; give at least {size + 1}, one more than "
            "its terms and block effects, or choose a simpler model"
        )


def check_matrix(name: str, model: str, terms: Terms, matrix: Array) -> None:
    """Raises MethodError when the runs cannot separate the columns.

    ``matrix`` (n, p) has the columns of ``terms``, then those of the blocks.
    """
    if dependent := dependent_columns(matrix):
        names = dict.fromkeys(terms[column] if column < len(terms) else "the blocks" for column in dependent)
        raise MethodError(
            f"{name}: the runs cannot separate {', '.join(sorted(names))} from the other terms of the {model} model "
            "(its matrix is singular); add design points or choose a simpler model"
        )


def _labels(labels: ArrayLike | None, size: int) -> Whole:
    if labels is None:
        return np.zeros(size, dtype=np.int64)
    return np.array(np.broadcast_to(labels, size)).astype(np.int64)


USUAL = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
SEARCHED = (-5.0, 5.0)
NAMES = {-2.0: "1/y^2", -1.0: "1/y", -0.5: "1/sqrt(y)", 0.0: "ln y", 0.5: "sqrt(y)", 2.0: "y^2"}


class BoxCox(Record):
    """Advice on the exponent of a transform, as `box_cox` gives it."""

    exponent: float = keyed("lambda")
    interval: list[float]
    searched: list[float]
    recommended: float
    sentence: str


def box_cox(matrix: ArrayLike, values: ArrayLike, *, name: str = "response") -> BoxCox:
    """Profile likelihood of the transform's exponent for a response fitted by the columns of ``matrix``.

    matrix : model matrix (n, p) of the runs, with a column of ones.
    values : response of each run, shape (n,), all positive.
    name : name of the response, for the sentences.

    Returns the ``exponent`` of the largest likelihood and its ``interval``, cut at the range ``searched``. In the interval the
    likelihood-ratio statistic is below the chi-squared quantile of `LEVEL`. ``recommended`` is 1 (no transform) if that is in the
    interval, else the usual exponent in it nearest to ``exponent``, else ``exponent``. An interval beyond all usual exponents
    indicates outliers or missing terms, and 1 is recommended.

    Raises MethodError when a value is not positive, the values are all equal, or no more runs than columns are given.

    Source: Box and Cox (1964), maximized likelihood.
    """
    columns, response = np.asarray(matrix, float), np.asarray(values, float)
    check_positive(response, name)
    runs, terms = columns.shape
    if runs <= terms:
        raise MethodError(f"{name}: {counted(runs, 'run')} leave no residual for {counted(terms, 'term')}; add runs")
    if np.ptp(response) == 0.0:
        raise MethodError(f"{name}: all values are equal, so no transform can be judged; leave it out")
    log_likelihood = _log_likelihood(columns, response)
    grid = np.union1d(np.linspace(*SEARCHED, 81), USUAL)
    heights = np.array([log_likelihood(exponent) for exponent in grid])
    top = int(heights.argmax())
    bracket, fine = (grid[max(top - 1, 0)], grid[min(top + 1, grid.size - 1)]), {"xatol": 1e-7}
    peak = optimize.minimize_scalar(lambda x: -log_likelihood(x), bounds=bracket, method="bounded", options=fine)
    height, best = max((float(heights[top]), float(grid[top])), (float(-peak.fun), float(peak.x)), key=itemgetter(0))
    threshold = height - stats.chi2.ppf(LEVEL, 1) / 2

    def end(outwards: Array) -> float:
        """First exponent outwards from the best one at which the likelihood is at the threshold."""
        inner = best
        for outer in outwards:
            if log_likelihood(outer) < threshold:
                return float(optimize.brentq(lambda x: log_likelihood(x) - threshold, inner, outer))
            inner = outer
        return float(inner)

    interval = [end(grid[grid < best][::-1]), end(grid[grid > best])]
    inside = [exponent for exponent in USUAL if interval[0] <= exponent <= interval[1]]
    beyond = interval[1] < USUAL[0] or interval[0] > USUAL[-1]
    nearest = min(inside, key=lambda exponent: abs(exponent - best), default=best)
    recommended = 1.0 if beyond or 1.0 in inside else nearest
    return BoxCox(best, interval, list(SEARCHED), recommended, _sentence(name, best, interval, recommended))


def _log_likelihood(columns: Array, response: Array) -> Callable[[float], float]:
    """Log-likelihood of an exponent up to a constant, for a positive ``response`` (n,) fitted by ``columns`` (n, p)."""
    basis = linalg.qr(columns, mode="economic")[0]
    # Relative to the geometric mean, residuals of different exponents compare without a Jacobian.
    logarithm = np.log(response)
    logarithm -= logarithm.mean()

    def log_likelihood(exponent: float) -> float:
        transformed = special.boxcox(np.exp(logarithm), exponent)
        residual = transformed - basis @ (basis.T @ transformed)
        # Rounding limits the likelihood of an exact fit, which is not infinite.
        floor = (1e-14 * np.abs(transformed).max()) ** 2
        return -0.5 * len(response) * math.log(max(float(residual @ residual) / len(response), floor))

    return log_likelihood


def check_positive(values: ArrayLike, name: str) -> None:
    """Raises MethodError, naming the first run at fault, unless all values are finite and positive."""
    response = np.asarray(values, float)
    bad = np.flatnonzero(~(np.isfinite(response) & (response > 0.0)))
    if bad.size:
        raise MethodError(
            f"{name}: the value of run {bad[0] + 1} is {response[bad[0]]:g}, but a power transform needs positive "
            'values; use transform = "none"'
        )


def forward(values: ArrayLike, exponent: float) -> Array:
    """Transformed values t = (y^lambda - 1)/lambda, or ln y for lambda = 0, of positive ``values``.

    Raises MethodError when a value is not positive.
    """
    check_positive(values, "transform")
    return special.boxcox(np.asarray(values, float), exponent)


def backward(transformed: ArrayLike, exponent: float) -> Array:
    """Inverse of `forward`; the mean of t gives the median of y, not its mean.

    Where no y has this t it returns the limit, 0 for lambda > 0 or infinity for lambda < 0.
    """
    t = np.asarray(transformed, float)
    if exponent == 0.0:
        return np.asarray(np.exp(t))
    base = 1.0 + exponent * t
    values: Array = special.inv_boxcox(np.where(base > 0.0, t, 0.0), exponent)
    return np.asarray(np.where(base > 0.0, values, 0.0 if exponent > 0.0 else np.inf))


def slope(values: ArrayLike, exponent: float) -> Array:
    """Slope dt/dy = y^(lambda - 1) at positive values of y, the ratio of small standard errors of t and y."""
    return np.asarray(values, float) ** (exponent - 1.0)


def _sentence(name: str, best: float, interval: list[float], recommended: float) -> str:
    cut = " (cut at the search range)" if set(interval) & set(SEARCHED) else ""
    estimate = (
        f"{name}: the likelihood is largest for the exponent {best:.2f}, {100 * LEVEL:g} % interval "
        f"{interval[0]:.2f} to {interval[1]:.2f}{cut}"
    )
    if interval[0] <= 1.0 <= interval[1]:
        return f"{estimate}. It contains 1, so no transform is needed."
    if recommended == 1.0:
        return f"{estimate}, beyond all usual exponents. Fit the response itself, and check for an outlier or a missing term."
    power = NAMES.get(recommended, f"y^{recommended:.3g}")
    return f"{estimate}. The interval excludes 1: fit {power} instead of y (transform = {recommended:.3g})."
