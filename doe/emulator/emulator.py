"""A noisy simulation as a trend plus a Gaussian process, with variances of the runs that are known.

y = h(x)' b + Z(x) + e: the trend h is a polynomial with a flat prior on its coefficients, Z has a Matern correlation of
smoothness 5/2 with a length a factor, and the variance of e is what the replicates of a run tell plus one nugget, for
replicates miss what they share. Hyperparameters are those of the largest restricted likelihood under a weak prior of the lengths.

Sources: Santner, Williams and Notz, The Design and Analysis of Computer Experiments, chapter 3; Dubrule, Cross validation
of kriging in a unique neighborhood (1983); Wilson et al., Pathwise conditioning of Gaussian processes (2021).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from doe.designs.model import model_matrix, model_terms
from doe.emulator.covariance import Features, correlation, random_features, squares
from doe.emulator.likelihood import (
    Hyperparameters,
    Solved,
    back_substituted,
    covariance_of,
    forward_substituted,
    loss,
    of_logarithms,
    solved,
)
from doe.threads import one_thread
from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError

Trend = Literal["none", "constant", "linear", "quadratic"]

# Bounds of lengths in units of the points' half range, of variances in units of that of the values about their trend.
LENGTHS, VARIANCES, NUGGETS = (0.1, 50.0), (1e-3, 1e4), (1e-8, 1.0)
# Prior of the logarithm of a length in half ranges: mean, to which half the logarithm of the number of factors is added, and
# deviation. Weak, it keeps few runs from lengths that forget between neighbours. Source: Hvarfner, Hellsten and Nardi (2024).
PRIOR = (2.0**0.5 + 0.6931, 3.0**0.5)
# Starts of the search: lengths in half ranges and variances as above. One alone lost 1 to 2 fits in 8 on Ishigami's function.
STARTS = ((1.0, 1.0, 1e-3), (0.4, 1.0, 1e-5), (4.0, 10.0, 1e-2))
# The search costs the cube of the runs: of more than so many, every third, fourth, ... tells the hyperparameters.
MOST_SEARCHED = 200
FEATURES = 512
ENOUGH = {"ftol": 1e-7, "maxiter": 100}  # of a logarithm of the likelihood


@dataclass(frozen=True, eq=False)
class Emulator:
    """A fitted emulator of one response.

    ``points`` (n, k), ``values`` (n,) and known ``variances`` (n,) of the runs; ``terms`` of the trend; hyperparameters;
    ``restricted_likelihood`` is its logarithm, of the runs that were searched.
    """

    points: Array
    values: Array
    variances: Array
    terms: tuple[str, ...]
    hyperparameters: Hyperparameters
    restricted_likelihood: float
    solution: Solved

    @one_thread
    def predict(self, points: ArrayLike) -> tuple[Array, Array]:
        """Mean and standard deviation (n,) of the response without scatter at points (n, k)."""
        columns, across = self._beside(np.asarray(points, float))
        inside, left = self._explained(columns, across)
        variance = self.hyperparameters.variance - (inside**2).sum(axis=0) + (left**2).sum(axis=0)
        return columns @ self.solution.coefficients + across @ self.solution.weights, np.sqrt(variance.clip(0.0))

    @one_thread
    def mean(self, points: ArrayLike) -> Array:
        """Mean (n,) of the response at points (n, k), for a fraction of the time of ``predict``."""
        columns, across = self._beside(np.asarray(points, float))
        return np.asarray(columns @ self.solution.coefficients + across @ self.solution.weights)

    @one_thread
    def covariance(self, points: ArrayLike, other: ArrayLike) -> Array:
        """Covariance (n, m) of the uncertainty of the response at points (n, k) and (m, k)."""
        first, second, given = np.asarray(points, float), np.asarray(other, float), self.hyperparameters
        (inside, left), (inside_other, left_other) = (self._explained(*self._beside(at)) for at in (first, second))
        between = given.variance * correlation(first, second, given.lengths)
        return between - inside.T @ inside_other + left.T @ left_other

    def _beside(self, points: Array) -> tuple[Array, Array]:
        """Trend columns (n, p) at points (n, k), and covariances (n, runs) with the runs."""
        given = self.hyperparameters
        return model_matrix(points, self.terms), given.variance * correlation(points, self.points, given.lengths)

    def _explained(self, columns: Array, across: Array) -> tuple[Array, Array]:
        """What the runs explain (n, m) and what the trend leaves open (p, m) at m points, as square roots."""
        inside = forward_substituted(self.solution.factor, across.T)
        left = np.linalg.solve(self.solution.root.T, (columns - inside.T @ self.solution.trend).T)
        return inside, np.asarray(left)

    @one_thread
    def leave_one_out(self) -> tuple[Array, Array]:
        """What the others predict of every run: mean and standard deviation (n,), its own scatter included."""
        projection = self.solution.projection
        variance = 1.0 / np.diag(projection)
        return self.values - variance * (projection @ self.values), np.sqrt(variance)

    def q2(self) -> float:
        """Share of the values' variance that the other runs predict."""
        missed = self.values - self.leave_one_out()[0]
        return 1.0 - float((missed**2).sum() / ((self.values - self.values.mean()) ** 2).sum())

    @one_thread
    def draw(self, count: int, random: np.random.Generator) -> "Draws":
        """Functions that the runs might as well have come from, ``count`` of them."""
        given = self.hyperparameters
        features = random_features(given.lengths, FEATURES, random)
        loads = np.sqrt(given.variance) * random.standard_normal((FEATURES, count))
        noise = np.sqrt(self.variances + given.nugget)[:, None] * random.standard_normal((len(self.points), count))
        left = self.values[:, None] - features(self.points) @ loads - noise
        inside = forward_substituted(self.solution.factor, left)
        coefficients = np.asarray(np.linalg.lstsq(self.solution.trend, inside, rcond=None)[0], float)
        weights = back_substituted(self.solution.factor, inside - self.solution.trend @ coefficients)
        return Draws(self, features, loads, coefficients, weights)


@dataclass(frozen=True, eq=False)
class Draws:
    """Functions drawn from an emulator: the prior's, moved by what it takes to pass the runs."""

    emulator: Emulator
    features: Features
    loads: Array
    coefficients: Array
    weights: Array

    @one_thread
    def __call__(self, points: ArrayLike) -> Array:
        """Values (s, n) at points (n, k)."""
        at, given = np.asarray(points, float), self.emulator.hyperparameters
        across = given.variance * correlation(at, self.emulator.points, given.lengths)
        trend = model_matrix(at, self.emulator.terms) @ self.coefficients
        return (trend + self.features(at) @ self.loads + across @ self.weights).T


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
    trended: int | None = None,
) -> Emulator:
    """Fit an emulator to runs at points (n, k) with values (n,) and known variances (n,) of these.

    The trend is the largest up to the one asked for with at most a term for two runs. ``start``: hyperparameters of nearly
    the same runs, from which the search starts in the place of the last of its own starts; without ``search`` they stay as
    they are. ``prior``: mean and deviation of the logarithm of a length in half ranges of one factor alone. ``trended``: the
    first so many coordinates, all by default, are those of the trend. Raises MethodError for
    numbers that are not finite, variances below 0 or fewer than two runs.
    """
    at, y = np.asarray(points, float), np.asarray(values, float)
    known = np.array(np.broadcast_to(np.asarray(variances, float), y.shape))
    if at.ndim != 2 or y.shape != (len(at),) or len(at) < 2:
        raise MethodError(f"emulator: points {at.shape} and values {y.shape}: give two runs at least, a value each")
    if not (np.isfinite(at).all() and np.isfinite(y).all() and np.isfinite(known).all() and (known >= 0.0).all()):
        raise MethodError(
            "emulator: a point, value or variance is not a finite number, or a variance is below 0; fix it"
        )
    terms = _terms(trend, len(at), at.shape[1] if trended is None else trended)
    fitted = start
    if search or fitted is None:
        rows = slice(None, None, -(-len(at) // MOST_SEARCHED))
        fitted = _search(at[rows], y[rows], known[rows], terms, start, prior)
    columns = model_matrix(at, terms)
    rest = solved(covariance_of(at, known, fitted), columns, y)
    likelihood = -loss(fitted.logarithms, squares(at, at), columns, y, known)[0]
    return Emulator(at, y, known, terms, fitted, likelihood, rest)


def _terms(trend: Trend, runs: int, factors: int) -> tuple[str, ...]:
    kinds = {
        "quadratic": model_terms(factors, "quadratic"),
        "linear": model_terms(factors, "linear"),
        "constant": ("1",),
        "none": (),
    }
    smaller = list(kinds)[list(kinds).index(trend) :]
    return kinds[next(each for each in smaller if len(kinds[each]) <= max(runs // 2, 1))]


def _search(
    points: Array,
    values: Array,
    variances: Array,
    terms: tuple[str, ...],
    start: Hyperparameters | None,
    prior: tuple[float, float],
) -> Hyperparameters:
    """The hyperparameters of the largest restricted likelihood from every start."""
    columns = model_matrix(points, terms)
    left = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0] if terms else values
    unit = float(left @ left) / max(len(values) - len(terms), 1) or float(np.var(values)) or 1.0
    half = 0.5 * np.ptp(points, axis=0)
    half = np.where(half > 0.0, half, 1.0)
    scale = np.log([*half, unit, unit])
    ends = np.log([LENGTHS] * half.size + [VARIANCES, NUGGETS]) + scale[:, None]
    firsts = [np.log([*[length] * half.size, variance, nugget]) + scale for length, variance, nugget in STARTS]
    if start is not None:
        firsts[-1] = start.logarithms.clip(*ends.T)
    along = squares(points, points)
    centre = prior[0] + 0.5 * np.log(half.size) + np.log(half)

    def penalised(logarithms: Array) -> tuple[float, Array]:
        value, slope = loss(logarithms, along, columns, values, variances)
        off = (logarithms[:-2] - centre) / prior[1] ** 2
        return value + 0.5 * prior[1] ** 2 * float(off @ off), slope + np.concatenate([off, [0.0, 0.0]])

    best = min(
        (
            optimize.minimize(penalised, first, method="L-BFGS-B", jac=True, bounds=ends, options=ENOUGH)
            for first in firsts
        ),
        key=lambda each: each.fun,
    )
    return of_logarithms(best.x)
