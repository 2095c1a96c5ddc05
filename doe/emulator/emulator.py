"""A noisy simulation as a trend plus a Gaussian process, with known variances of the runs.

y = m + h(x)'b + Z(x) + e. The level m has a wide normal prior about the mean of the runs. The coefficients b of the
polynomial trend have a normal prior: together they have the kernel v (1 + x'y)^d. Z has a Matern correlation of smoothness 5/2
with a length scale an input. The variance of e is that of the run's mean by its replicates, plus one nugget, as replicates
do not show what they share. Hyperparameters are the mode of their posterior under weak priors, in ``regression``.

Sources: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), sections 2.7, 4.2 and 5.4; Sundararajan and
Keerthi, Predictive approaches for choosing hyperparameters in Gaussian processes, Neural Computation 13 (2001), for
leave-one-out; Wilson et al., Pathwise conditioning of Gaussian processes, J. Machine Learning Research 22 (2021), and Rahimi
and Recht, Random features for large-scale kernel machines (2007), for draws.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special
from scipy.linalg import lapack

from doe.designs.model import model_matrix, model_terms, term_powers
from rbdyn.base.arrays import Array, Whole, one_thread
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sklearn.gaussian_process import GaussianProcessRegressor

Trend = Literal["none", "constant", "linear", "quadratic"]
DEGREES: dict[Trend, int] = {"none": 0, "constant": 0, "linear": 1, "quadratic": 2}
# Prior of the logarithm of a length scale in half ranges: mean, to which half the logarithm of the number of inputs is added,
# and deviation. Weak, it keeps few runs from lengths that forget between neighbours. Source: Hvarfner, Hellsten and Nardi (2024).
PRIOR = (2.0**0.5 + 0.6931, 3.0**0.5)
# The search costs the cube of the runs: of more than so many it takes every second, third, ...
MOST_SEARCHED = 200
FEATURES = 512
FREEDOM = 5  # of Student's distribution that is the spectral density of the Matern correlation 5/2


class Hyperparameters(NamedTuple):
    """Length scales (k,) in units of the points; variances of the process, of the nugget, of the trend's coefficients and of
    the level."""

    lengths: Array
    variance: float
    nugget: float
    trend: float
    level: float


class Emulator(Record, eq=False):
    """A fitted emulator of one response.

    ``points`` (n, k), ``values`` (n,) and known ``variances`` (n,) of the runs; the trend has the ``degree`` 0 to 2;
    ``middle``: mean of the runs; ``likelihood``: logarithm of that of the hyperparameters; ``regressor``: scikit-learn's, of the
    values about their middle.
    """

    points: Array
    values: Array
    variances: Array
    degree: int
    middle: float
    hyperparameters: Hyperparameters
    likelihood: float
    regressor: GaussianProcessRegressor

    @one_thread
    def predict(self, points: ArrayLike) -> tuple[Array, Array]:
        """Mean and standard deviation (n,) of the response without scatter at points (n, k)."""
        places = np.asarray(points, float)
        across = self.prior(places, self.points)
        variance = self.regressor.kernel_.diag(places) - (self._explained(across) ** 2).sum(axis=0)
        return self.middle + across @ self.weights, np.sqrt(variance.clip(0.0))

    @one_thread
    def mean(self, points: ArrayLike) -> Array:
        """Mean (n,) of the response at points (n, k), for a fraction of the time of ``predict``."""
        return np.asarray(self.middle + self.prior(np.asarray(points, float), self.points) @ self.weights)

    @one_thread
    def covariance(self, points: ArrayLike, other: ArrayLike) -> Array:
        """Covariance (n, m) of the uncertainty of the response at points (n, k) and (m, k)."""
        first, second = np.asarray(points, float), np.asarray(other, float)
        explained, explained_other = (self._explained(self.prior(part, self.points)) for part in (first, second))
        return self.prior(first, second) - explained.T @ explained_other

    @one_thread
    def leave_one_out(self) -> tuple[Array, Array]:
        """What the others predict of every run: mean and standard deviation (n,), its own scatter included."""
        residuals, variances = leave_one_out(self.regressor.L_, self.weights)
        return self.values - residuals, np.sqrt(variances)

    def q2(self) -> float:
        """Share of the values' variance that the other runs predict."""
        residuals = self.values - self.leave_one_out()[0]
        return 1.0 - float((residuals**2).sum() / ((self.values - self.values.mean()) ** 2).sum())

    @one_thread
    def draw(self, count: int, random: np.random.Generator) -> Draws:
        """Random functions of the posterior, ``count`` of them."""
        features = random_features(self.hyperparameters.lengths, FEATURES, random)
        loads = np.sqrt(self.hyperparameters.variance) * random.standard_normal((FEATURES, count))
        coefficients = np.sqrt(self.term_variances)[:, None] * random.standard_normal((len(self.terms), count))
        noise = np.sqrt(self.noise)[:, None] * random.standard_normal((len(self.points), count))
        prior = features(self.points) @ loads + model_matrix(self.points, self.terms) @ coefficients
        residuals = (self.values - self.middle)[:, None] - prior - noise
        return Draws(self, features, loads, coefficients, lapack.dpotrs(self.regressor.L_, residuals, lower=True)[0])

    def prior(self, points: Array, other: Array) -> Array:
        """Prior covariance (n, m) of the response at points (n, k) and (m, k)."""
        return np.asarray(self.regressor.kernel_(points, other))

    @property
    def weights(self) -> Array:
        """Weights (n,) of the prior covariances with the runs in the mean."""
        return np.asarray(self.regressor.alpha_)

    @property
    def noise(self) -> Array:
        """Variances (n,) of the runs about the response."""
        return self.variances + self.hyperparameters.nugget

    @cached_property
    def terms(self) -> tuple[str, ...]:
        """Terms of the trend, the level included."""
        level = ("1",) if self.hyperparameters.level > 0.0 else ()
        inputs = self.points.shape[1]
        return (level, model_terms(inputs, "linear"), model_terms(inputs, "quadratic"))[self.degree]

    @cached_property
    def term_variances(self) -> Array:
        """Prior variances (p,) of the coefficients of the terms: the kernel of the trend is their sum over products of terms."""
        powers = term_powers(self.terms, self.points.shape[1])
        constant = powers.sum(axis=1) == 0
        # The square of 1 + x'y has every product of two different of its parts twice.
        twice = (self.degree == 2) & (powers.max(axis=1, initial=0) == 1)
        trend = self.hyperparameters.trend if self.degree else 0.0
        return trend * np.where(twice, 2.0, 1.0) + self.hyperparameters.level * constant

    @cached_property
    def coefficients(self) -> Array:
        """Mean coefficients (p,) of the terms, the middle in the constant."""
        middle = self.middle * (np.array(self.terms) == "1")
        return middle + self.term_variances * (model_matrix(self.points, self.terms).T @ self.weights)

    def _explained(self, across: Array) -> Array:
        """What the runs explain (n, m), as a square root, by prior covariances (m, n) with them. LAPACK itself: SciPy's checks
        take longer than matrices as small as these."""
        return np.asarray(lapack.dtrtrs(self.regressor.L_, across.T, lower=True)[0])


class Features(NamedTuple):
    """Cosines of random frequencies (k, f) and phases (f,): weighted by standard normals, a random function of variance 1."""

    frequencies: Array
    phases: Array

    def __call__(self, points: Array) -> Array:
        """Values (n, f) at points (n, k)."""
        return np.sqrt(2.0 / self.phases.size) * np.cos(points @ self.frequencies + self.phases)


def random_features(lengths: Array, count: int, random: np.random.Generator) -> Features:
    """Features whose correlation is the Matern one on average."""
    normal = random.standard_normal((lengths.size, count)) / lengths[:, None]
    return Features(
        normal * np.sqrt(FREEDOM / random.chisquare(FREEDOM, count)), random.uniform(0.0, 2.0 * np.pi, count)
    )


class Draws(Record, eq=False):
    """Random functions of an emulator's posterior: those of the prior, moved by what it takes to pass the runs."""

    emulator: Emulator
    features: Features
    loads: Array
    coefficients: Array
    weights: Array

    @one_thread
    def __call__(self, points: ArrayLike) -> Array:
        """Values (s, n) at points (n, k)."""
        places, emulator = np.asarray(points, float), self.emulator
        prior = model_matrix(places, emulator.terms) @ self.coefficients + self.features(places) @ self.loads
        return (emulator.middle + prior + emulator.prior(places, emulator.points) @ self.weights).T


@one_thread
def fit_emulator(
    points: ArrayLike,
    values: ArrayLike,
    variances: ArrayLike,
    *,
    trend: Trend = "quadratic",
    start: Hyperparameters | None = None,
    search: bool = True,
    prior: tuple[float, float] = PRIOR,
) -> Emulator:
    """Fit an emulator to runs at points (n, k) with values (n,) and known variances (n,) of these.

    Points are in units in which the region has a size of about 1, as coded units or quantiles: the prior of the trend asks for
    that. ``trend``: "none" (about 0), "constant", "linear" or "quadratic". ``start``: hyperparameters of nearly the same runs, from
    which the search starts; without ``search`` they stay. ``prior``: mean and deviation of the logarithm of a length scale in
    half ranges, of one input alone.

    Raises MethodError for numbers that are not finite and variances below 0.
    """
    from doe.emulator.regression import Trended, mode, regression

    places, responses = np.asarray(points, float), np.asarray(values, float)
    noise = np.array(np.broadcast_to(np.asarray(variances, float), responses.shape))
    if not (all(np.isfinite(part).all() for part in (places, responses, noise)) and (noise >= 0.0).all()):
        raise MethodError(
            "emulator: a point, value or variance is not a finite number, or a variance is below 0; fix it"
        )
    middle = 0.0 if trend == "none" else float(responses.mean())
    degree = DEGREES[trend]
    hyperparameters, about = start, responses - middle
    if search or hyperparameters is None:
        rows = slice(None, None, -(-len(places) // MOST_SEARCHED))
        runs = places[rows], about[rows], noise[rows]
        warm = None if start is None else Trended(*start, degree)
        kernel = mode(*runs, degree, prior, warm, level=trend != "none")
        hyperparameters = Hyperparameters(kernel.lengths, kernel.variance, kernel.nugget, kernel.trend, kernel.level)
    regressor = regression(Trended(*hyperparameters, degree), places, about, noise)
    likelihood = float(regressor.log_marginal_likelihood_value_)
    return Emulator(places, responses, noise, degree, middle, hyperparameters, likelihood, regressor)


def leave_one_out(factor: Array, weights: Array) -> tuple[Array, Array]:
    """Residuals (n,) of runs to what the others predict of each, and the variances (n,) of these, its own scatter included.

    ``factor`` (n, n): lower Cholesky factor of the covariance of the runs; ``weights`` (n,): its inverse times the values.
    """
    variances = 1.0 / np.diag(lapack.dpotri(factor, lower=True)[0])
    return weights * variances, variances


class NoisyValues(NamedTuple):
    """Values of runs, their variances by the scatter of replicates, and the degrees of freedom of these; arrays of one shape."""

    values: Array
    variances: Array
    freedom: Whole

    @classmethod
    def stacked(cls, parts: Sequence[NoisyValues]) -> NoisyValues:
        """Values of equal runs, one along the first axis for each part."""
        return cls(*map(np.array, zip(*parts, strict=True)))

    def at(self, place: Any) -> NoisyValues:
        """The values at places of the arrays."""
        return NoisyValues(*(array[place] for array in self))

    def averaged(self, other: NoisyValues) -> NoisyValues:
        """Means over the replicates of both, equally many of each."""
        values, variances = 0.5 * (self.values + other.values), 0.25 * (self.variances + other.variances)
        return NoisyValues(values, variances, self.freedom + other.freedom + 1)

    def smooth(self, points: Array, effort: Array | Whole | float = 1.0, new: Array | None = None) -> Array:
        """Variances (n, m), smoothed over points (n, k), at ``new`` points where given; ``effort`` (n,): replicates over those of
        the other runs."""
        columns = zip(effort * self.variances.T, self.freedom.T, strict=True)
        smooth = np.column_stack([pooled_variances(points, *column, new) for column in columns])
        return np.asarray(smooth / np.reshape(effort, (-1, 1)))


def pooled_variances(points: Array, variances: Array, freedom: Whole, new: Array | None = None) -> Array:
    """Variances (n,) of single replicates at points (n, k) as a log-linear function of the inputs, at ``new`` points where given.

    ``freedom`` (n,): degrees of freedom of each (0: no estimate). The logarithm of an estimate lies below that of the truth by
    psi(f/2) - log(f/2) on average and scatters by the root of psi'(f/2). The first is taken off, the second weighs the runs.
    Zero where no run has an estimate.

    Source: Bartlett and Kendall, The statistical analysis of variance-heterogeneity (1946).
    """
    places = points if new is None else new
    estimated = np.isfinite(variances) & (variances > 0.0) & (freedom > 0)
    if not estimated.any():
        return np.zeros(len(places))
    half = 0.5 * freedom[estimated]
    logarithms = np.log(variances[estimated]) - special.digamma(half) + np.log(half)
    weight = 1.0 / np.sqrt(special.polygamma(1, half))
    # Runs fewer than twice the coefficients of a plane give one level only.
    plane = estimated.sum() >= 2 * (points.shape[1] + 1)
    columns, rows = (np.column_stack([np.ones(len(x)), *([x] if plane else [])]) for x in (points[estimated], places))
    return np.exp(rows @ np.linalg.lstsq(columns * weight[:, None], logarithms * weight, rcond=None)[0])
