"""Restricted likelihood of a trend plus a Gaussian process, with its gradient.

What the trend takes out of the values tells nothing of the process; the likelihood of what is left does not count the
trend's coefficients as known. Source: Harville, Bayesian inference for variance components using only error contrasts,
Biometrika 61 (1974); Santner, Williams and Notz, The Design and Analysis of Computer Experiments, section 3.3.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from doe.emulator.covariance import correlation, with_falls
from rbdyn.base.arrays import Array

JITTER = 1e-10  # of the process's variance: keeps the matrix of runs invertible where runs repeat without scatter


class Hyperparameters(NamedTuple):
    """Lengths (k,) in units of the points, variance of the process, and that of the nugget: what runs scatter beyond what
    they state."""

    lengths: Array
    variance: float
    nugget: float

    @property
    def logarithms(self) -> Array:
        """(k + 2,): all of them."""
        return np.log([*self.lengths, self.variance, self.nugget])


def of_logarithms(logarithms: Array) -> Hyperparameters:
    """The hyperparameters of their logarithms (k + 2,)."""
    *lengths, variance, nugget = np.exp(logarithms).tolist()
    return Hyperparameters(np.array(lengths), variance, nugget)


class Solved(NamedTuple):
    """Values split into trend and process: Cholesky factor (n, n) of the covariance of runs, trend in its coordinates
    (n, p), root (p, p) of the trend's information, coefficients (p,) and weights (n,) of the process."""

    factor: Array
    trend: Array
    root: Array
    coefficients: Array
    weights: Array

    @property
    def projection(self) -> Array:
        """P (n, n): the inverse covariance of what the trend leaves."""
        half = back_substituted(self.factor, self.trend)
        inside = lapack.dtrtrs(self.root, half.T, trans=True)[0] if half.size else half.T
        lower: Array = lapack.dpotri(self.factor, lower=True)[0]
        whole = lower + lower.T
        np.fill_diagonal(whole, np.diag(lower))
        return whole - np.asarray(inside.T @ inside)


def forward_substituted(factor: Array, right: Array) -> Array:
    """Solution of a lower triangular system. LAPACK itself: SciPy's checks take longer than matrices as small as these."""
    found: Array = lapack.dtrtrs(factor, right, lower=True)[0]
    return found


def back_substituted(factor: Array, right: Array) -> Array:
    """Solution of the transposed system."""
    if not right.size:
        return right
    found: Array = lapack.dtrtrs(factor, right, lower=True, trans=True)[0]
    return found


def solved(covariance: Array, trend: Array, values: Array) -> Solved:
    """Generalised least squares of values (n,) on trend columns (n, p), which may be none. Raises LinAlgError."""
    factor, failed = lapack.dpotrf(covariance, lower=True, clean=True)
    if failed:
        raise np.linalg.LinAlgError("covariance of the runs is not positive definite")
    inside = forward_substituted(factor, np.column_stack([trend, values]))
    across, target = inside[:, :-1], inside[:, -1]
    # The last column of the triangle is the target along the trend: the orthogonal base itself is not needed.
    rows = np.asarray(np.linalg.qr(inside, mode="r"))[: across.shape[1]]
    root = rows[:, :-1]
    coefficients = np.linalg.solve(root, rows[:, -1])
    return Solved(factor, across, root, coefficients, back_substituted(factor, target - across @ coefficients))


def covariance_of(points: Array, variances: Array, given: Hyperparameters) -> Array:
    """Covariance (n, n) of runs at points (n, k) with known variances (n,)."""
    between = given.variance * correlation(points, points, given.lengths)
    return between + np.diag(variances + given.nugget + JITTER * given.variance)


def loss(logarithms: Array, along: Array, trend: Array, values: Array, variances: Array) -> tuple[float, Array]:
    """Negative logarithm of the restricted likelihood and its gradient by the logarithms (k + 2,) of the hyperparameters.

    ``along`` (k, n, n) are squared distances of the runs along each factor. Infinite where the matrix is singular.
    """
    given, count = of_logarithms(logarithms), len(values)
    near, falls = with_falls(along, given.lengths)
    covariance = given.variance * near
    covariance.flat[:: count + 1] += variances + given.nugget + JITTER * given.variance
    try:
        found = solved(covariance, trend, values)
        projection = found.projection
    except np.linalg.LinAlgError:
        return np.inf, np.zeros_like(logarithms)
    determinants = np.log(np.diag(found.factor)).sum() + np.log(np.abs(np.diag(found.root))).sum()
    gram = 0.5 * np.linalg.slogdet(trend.T @ trend)[1] if trend.size else 0.0
    constant = 0.5 * (count - trend.shape[1]) * np.log(2.0 * np.pi)
    value = determinants - gram + constant + 0.5 * float(values @ found.weights)
    # Half the trace of (P - a a') dV for every hyperparameter.
    change = 0.5 * (projection - np.outer(found.weights, found.weights))
    by_length = given.variance * np.tensordot(along, falls * change, axes=2) / given.lengths**2
    by_variance = given.variance * (np.vdot(near, change) + JITTER * np.trace(change))
    return float(value), np.array([*by_length, by_variance, given.nugget * np.trace(change)])
