"""The regression behind an emulator: scikit-learn's Gaussian process regressor with our kernel and prior.

Its import takes about a second: only a fit of an emulator loads it.

The kernel is the sum of scikit-learn's ``DotProduct`` to a power and ``Matern``. It is one class, as its gradient by the
operators of scikit-learn takes about four times as long. Hyperparameters are the mode of their posterior: where runs are
few, the likelihood alone has several maxima, some at lengths or nuggets that no run shows.

Sources: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), sections 4.2 and 5.4; Pedregosa et al.,
Scikit-learn: machine learning in Python, J. Machine Learning Research 12 (2011).
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy import optimize
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import DotProduct, Kernel, Matern

from rbdyn.base.arrays import Array

# Prior deviation of the level, in root mean squares of the values: wide, so that the runs decide.
PRIOR_DEVIATION = 10.0
# Ends of the search: of length scales in half ranges of the points, of variances in mean squares of the values.
LENGTHS, VARIANCES, NUGGETS, TRENDS = (0.1, 50.0), (1e-3, 1e3), (1e-8, 1.0), (1e-4, 1e2)
# Normal priors of the logarithms of these variances: mean and deviation. Weak, they decide where the runs do not.
VARIANCE_PRIOR, NUGGET_PRIOR, TREND_PRIOR = (0.0, 2.0), (-4.0, 6.0), (-1.0, 3.0)
# The box of the candidates, which fill it evenly.
LENGTH_BOX, VARIANCE_BOX, NUGGET_BOX, TREND_BOX = (0.3, 6.0), (0.1, 10.0), (1e-5, 0.5), (1e-3, 3.0)
CANDIDATES = 32
ENOUGH = {"ftol": 1e-7, "maxiter": 100}  # of a logarithm of the posterior


class Trended(Kernel):
    """level + trend (1 + x'y)^degree + variance Matern(x, y; lengths), plus the nugget between a run and itself.

    Hyperparameters are the logarithms of trend, variance, lengths and nugget, in this order; the level is fixed.
    """

    def __init__(self, lengths: Array, variance: float, nugget: float, trend: float, level: float, degree: int):
        self.lengths, self.variance, self.nugget = lengths, variance, nugget
        self.trend, self.level, self.degree = trend, level, degree
        self._runs: Array | None = None

    @property
    def theta(self) -> Array:
        """Logarithms (k + 3,) of the hyperparameters."""
        return np.log([self.trend, self.variance, *self.lengths, self.nugget])

    @theta.setter
    def theta(self, theta: Array) -> None:
        self.trend, self.variance, *lengths, self.nugget = np.exp(theta).tolist()
        self.lengths = np.array(lengths)

    @property
    def bounds(self) -> Array:
        """None: the search has its own, and scikit-learn would warn of a mode that lies at one."""
        return np.full((self.lengths.size + 3, 2), [-np.inf, np.inf])

    def is_stationary(self) -> bool:
        """Whether the kernel depends on differences of points alone."""
        return self.degree == 0

    def __call__(self, X: Array, Y: Array | None = None, eval_gradient: bool = False) -> Any:  # noqa: N803
        """Kernel (n, m) of points (n, k) and (m, k), or of runs (n, k), then also its gradient (n, n, k + 3) where asked for."""
        if eval_gradient:
            return self._with_gradient(X)
        kernel = self.level + self.variance * Matern(self.lengths, nu=2.5)(X, Y)
        if self.degree:
            kernel += self.trend * self._power(X, Y)
        if Y is None:
            kernel.flat[:: len(X) + 1] += self.nugget
        return kernel

    def diag(self, X: Array) -> Array:  # noqa: N803
        """Prior variance (n,) of the response at points (n, k)."""
        variance = np.full(len(X), self.level + self.variance)
        if self.degree:
            variance += self.trend * DotProduct(1.0).diag(X) ** self.degree
        return variance

    def _power(self, points: Array, other: Array | None = None) -> Array:
        """(1 + x'y)^degree (n, m)."""
        return np.asarray(DotProduct(1.0)(points, other) ** self.degree)

    def _with_gradient(self, runs: Array) -> tuple[Array, Array]:
        """Kernel (n, n) of runs (n, k) and its gradient, valid until the next call: the search asks for it hundreds of times."""
        if self._runs is not runs:
            self._runs, self._squares = runs, (runs.T[:, :, None] - runs.T[:, None]) ** 2
            self._powers = self._power(runs) if self.degree else np.zeros((len(runs), len(runs)))
            self._gradient = np.zeros((self.lengths.size + 3, len(runs), len(runs)))
        inverse, gradient, diagonal = 1.0 / self.lengths**2, self._gradient, slice(None, None, len(runs) + 1)
        distance = np.sqrt(5.0 * np.tensordot(inverse, self._squares, axes=1))
        decay = self.variance * np.exp(-distance)
        slope = (1.0 + distance) * decay
        np.multiply(self.trend, self._powers, out=gradient[0])
        np.add(slope, distance**2 * decay / 3.0, out=gradient[1])
        np.multiply(self._squares, 5.0 / 3.0 * slope, out=gradient[2:-1])
        gradient[2:-1] *= inverse[:, None, None]
        gradient[-1].flat[diagonal] = self.nugget
        kernel = self.level + gradient[0] + gradient[1]
        kernel.flat[diagonal] += self.nugget
        return kernel, np.moveaxis(gradient, 0, -1)


@lru_cache(maxsize=16)
def _even(parameters: int) -> Array:
    """Candidates (n, parameters) that fill the unit box evenly."""
    return np.asarray(qmc.Sobol(parameters, seed=1).random(CANDIDATES))


class Search(NamedTuple):
    """Search for the mode of the posterior of the logarithms of hyperparameters (p,), an optimizer of scikit-learn's regressor.

    Within ``bounds`` (p, 2) their prior is normal of ``mean`` and ``deviation`` (p,). Few runs may be followed closely or taken for
    noise: each is a maximum of its own. So the search starts from the most probable candidate with a small nugget and from that
    with a large one, the last of the hyperparameters. Candidates fill the ``box`` (p, 2); ``start`` (p,), of nearly the same
    runs, takes the place of one of the two.
    """

    bounds: Array
    mean: Array
    deviation: Array
    box: Array
    start: Array | None

    def __call__(self, loss: Callable, initial: Array, bounds: Array) -> tuple[Array, float]:
        """The mode and the negative logarithm of the posterior there, by that of the likelihood."""
        candidates = self.box[:, 0] + np.ptp(self.box, axis=1) * _even(len(self.box))
        values = np.array([loss(theta, eval_gradient=False) + self._penalty(theta)[0] for theta in candidates])
        noisy = candidates[:, -1] > self.box[-1].mean()
        starts = [candidates[side][values[side].argmin()] for side in (noisy, ~noisy)]
        if self.start is not None:
            starts[int(self.start[-1] <= self.box[-1].mean())] = self.start.clip(*self.bounds.T)

        def posterior(theta: Array) -> tuple[float, Array]:
            value, slope = loss(theta)
            penalty, gradient = self._penalty(theta)
            return value + penalty, slope + gradient

        modes = [
            optimize.minimize(posterior, theta, method="L-BFGS-B", jac=True, bounds=self.bounds, options=ENOUGH)
            for theta in starts
        ]
        highest = min(modes, key=lambda mode: mode.fun)
        return highest.x, float(highest.fun)

    def _penalty(self, theta: Array) -> tuple[float, Array]:
        """Negative logarithm of the prior and its gradient (p,)."""
        distance = (theta - self.mean) / self.deviation
        return 0.5 * float(distance @ distance), distance / self.deviation


def mode(
    points: Array,
    values: Array,
    variances: Array,
    degree: int,
    prior: tuple[float, float],
    start: Trended | None,
    level: bool,
) -> Trended:
    """The kernel with the hyperparameters at the mode of their posterior, for runs at points (n, k) with values (n,) and known
    variances (n,).

    ``prior``: mean and deviation of the logarithm of a length scale in half ranges, of one input alone; ``start``: kernel of
    nearly the same runs; ``level``: whether there is one.
    """
    unit = float(np.mean(values**2)) or 1.0
    half = 0.5 * np.ptp(points, axis=0)
    half, inputs = np.where(half > 0.0, half, 1.0), half.size
    scale = np.log([unit, unit, *half, unit])
    length_prior = prior[0] + 0.5 * np.log(inputs), prior[1]
    mean, deviation = np.array([TREND_PRIOR, VARIANCE_PRIOR, *[length_prior] * inputs, NUGGET_PRIOR]).T
    search = Search(
        bounds=np.log([TRENDS, VARIANCES, *[LENGTHS] * inputs, NUGGETS]) + scale[:, None],
        mean=mean + scale,
        deviation=deviation,
        box=np.log([TREND_BOX, VARIANCE_BOX, *[LENGTH_BOX] * inputs, NUGGET_BOX]) + scale[:, None],
        start=None if start is None else start.theta,
    )
    kernel = Trended(half, unit, unit, unit, PRIOR_DEVIATION**2 * unit if level else 0.0, degree)
    return regression(kernel, points, values, variances, search).kernel_


def regression(
    kernel: Trended, points: Array, values: Array, variances: Array, search: Search | None = None
) -> GaussianProcessRegressor:
    """The regressor of runs at points (n, k) with values (n,) and known variances (n,); without ``search`` with the
    hyperparameters of the kernel."""
    return GaussianProcessRegressor(kernel, alpha=variances, optimizer=search).fit(points, values)
