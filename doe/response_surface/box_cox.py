"""Power transforms of a positive response: which one, with what certainty, and the way there and back.

A transformed response t = (y^lambda - 1)/lambda, or ln y for lambda = 0, is fitted in place of y where the
scatter of y grows with its size or a bend is only one of scale.

Source: Box and Cox, An analysis of transformations, J. R. Stat. Soc. B 26 (1964) 211-252.
"""

import math
from collections.abc import Callable
from operator import itemgetter
from typing import TypedDict, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg, optimize, special, stats

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError
from rbdyn.base.words import counted

USUAL = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
SEARCHED = (-5.0, 5.0)
LEVEL = 0.95  # of the interval
NAMES = {-2.0: "1/y^2", -1.0: "1/y", -0.5: "1/sqrt(y)", 0.0: "ln y", 0.5: "sqrt(y)", 2.0: "y^2"}

BoxCox = TypedDict(
    "BoxCox", {"lambda": float, "interval": list[float], "searched": list[float], "recommended": float, "sentence": str}
)


def box_cox(matrix: ArrayLike, values: ArrayLike, *, name: str = "response") -> BoxCox:
    """Profile likelihood of the transform's exponent for a response fitted by the columns of ``matrix``.

    matrix : model matrix (n, p) of the runs, with a column of ones.
    values : response of each run, shape (n,), all positive.
    name : name of the response, for the sentences.

    Returns ``lambda`` of the largest likelihood; ``interval`` of those whose likelihood-ratio statistic is within the
    chi-squared quantile of `LEVEL`, cut at the range ``searched``; ``recommended``: 1 (no transform) if that
    lies in the interval, else the usual exponent in it nearest to ``lambda``, else ``lambda`` itself; 1 again
    where the whole interval lies beyond the usual ones, which speaks of outliers or missing terms.

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
    heights = np.array([log_likelihood(each) for each in grid])
    top = int(heights.argmax())
    bracket, fine = (grid[max(top - 1, 0)], grid[min(top + 1, grid.size - 1)]), {"xatol": 1e-7}
    peak = optimize.minimize_scalar(lambda x: -log_likelihood(x), bounds=bracket, method="bounded", options=fine)
    height, best = max((float(heights[top]), float(grid[top])), (float(-peak.fun), float(peak.x)), key=itemgetter(0))
    threshold = height - stats.chi2.ppf(LEVEL, 1) / 2

    def end(outwards: Array) -> float:
        """Where the likelihood first falls to the threshold on the way from the best exponent."""
        inner = best
        for outer in outwards:
            if log_likelihood(outer) < threshold:
                return float(optimize.brentq(lambda x: log_likelihood(x) - threshold, inner, outer))
            inner = outer
        return float(inner)

    interval = [end(grid[grid < best][::-1]), end(grid[grid > best])]
    inside = [each for each in USUAL if interval[0] <= each <= interval[1]]
    beyond = interval[1] < USUAL[0] or interval[0] > USUAL[-1]
    nearest = min(inside, key=lambda each: abs(each - best), default=best)
    recommended = 1.0 if beyond or 1.0 in inside else nearest
    sentence = _sentence(name, best, interval, recommended)
    profile = {"lambda": best, "interval": interval, "searched": list(SEARCHED), "recommended": recommended}
    return cast(BoxCox, profile | {"sentence": sentence})


def _log_likelihood(columns: Array, response: Array) -> Callable[[float], float]:
    """Of an exponent, for a positive ``response`` (n,) fitted by ``columns`` (n, p), but for a constant."""
    basis = linalg.qr(columns, mode="economic")[0]
    # Taken relative to the geometric mean, residuals of different exponents compare without a Jacobian.
    logarithm = np.log(response)
    logarithm -= logarithm.mean()

    def log_likelihood(exponent: float) -> float:
        transformed = special.boxcox(np.exp(logarithm), exponent)
        residual = transformed - basis @ (basis.T @ transformed)
        # An exact fit is as good as round-off lets it be, not infinitely good.
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
    """The inverse of `forward`: of the mean of t, it is the median of y, not its mean.

    Where no y has this t, the limit: 0 (lambda > 0) or infinity (lambda < 0).
    """
    t = np.asarray(transformed, float)
    if exponent == 0.0:
        return np.asarray(np.exp(t))
    base = 1.0 + exponent * t
    values: Array = special.inv_boxcox(np.where(base > 0.0, t, 0.0), exponent)
    return np.asarray(np.where(base > 0.0, values, 0.0 if exponent > 0.0 else np.inf))


def slope(values: ArrayLike, exponent: float) -> Array:
    """dt/dy = y^(lambda - 1) at positive values of y: a small standard error of y times it is that of t."""
    return np.asarray(values, float) ** (exponent - 1.0)


def _sentence(name: str, best: float, interval: list[float], recommended: float) -> str:
    cut = ", cut at what was searched" if set(interval) & set(SEARCHED) else ""
    estimate = (
        f"{name}: the likelihood is largest for the exponent {best:.2f}, {100 * LEVEL:g} % interval "
        f"{interval[0]:.2f} to {interval[1]:.2f}{cut}"
    )
    if interval[0] <= 1.0 <= interval[1]:
        return f"{estimate}, which holds 1: no transform is called for."
    if recommended == 1.0:
        return (
            f"{estimate}, beyond all usual exponents: keep the response as it is, and look for an outlier or a "
            "missing term."
        )
    power = NAMES.get(recommended, f"y^{recommended:.3g}")
    return f"{estimate}, which does not hold 1: fit {power} instead of y (transform = {recommended:.3g})."
