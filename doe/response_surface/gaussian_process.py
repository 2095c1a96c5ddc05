"""Gaussian process of a response: the rival of a polynomial surface, which bends wherever the runs say so.

The response is a constant plus a random function whose correlation falls with distance, at a rate of its
own along each factor (Matern, smoothness 5/2), plus the scatter of the runs. Hyperparameters are those of
the largest marginal likelihood.

Source: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), eqs 2.25, 2.26, 4.17, 5.8.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from string import ascii_uppercase
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from threadpoolctl import ThreadpoolController

from doe.arrays import Array
from doe.response_surface.data import points_and_values

# Bounds of the hyperparameters: lengths in coded units, variances relative to that of the values. Beyond
# 100 units a factor has no effect within any design; below 0.1 no two runs know of each other.
LENGTHS, VARIANCES, NOISES = (0.1, 100.0), (1e-2, 1e4), (1e-8, 10.0)
RESTARTS = 4
# Steps of a search from scratch, and of one that starts from the fit of nearly the same runs.
STEPS, STEPS_FROM_START = 200, 10
# The matrices are small: one thread is up to ten times as fast as several, and has the same bits everywhere.
THREADS = ThreadpoolController()
# Hyperparameters of more runs are searched on so many of them: each step costs the cube of their number.
MOST_SEARCHED = 150
JITTER = 1e-10  # variance, relative to that of the values, that keeps the matrix of runs invertible


@dataclass(frozen=True, eq=False)
class GaussianSurface:
    """A fitted Gaussian process.

    ``length_scales`` (k,) in coded units: distance along each factor over which the response forgets.
    ``deviation``: standard deviation of the random function, ``noise``: that of a run's scatter (None where
    the scatter was given), both in units of the response.
    """

    name: str
    length_scales: Array
    deviation: float
    noise: float | None
    log_likelihood: float
    mean: float
    scale: float
    regressor: Any

    def predict(self, coded: ArrayLike) -> Array:
        """Mean response at coded points (..., k), shape (...)."""
        points = np.asarray(coded, float)
        values: Array = self.regressor.predict(points.reshape(-1, points.shape[-1]))
        return self.mean + self.scale * values.reshape(points.shape[:-1])

    def prediction_standard_error(self, coded: ArrayLike) -> Array:
        """Standard error of the mean response at coded points (..., k), shape (...); hyperparameters as known."""
        points = np.asarray(coded, float)
        with warnings.catch_warnings():
            # Round-off below zero at a run without scatter; scikit-learn sets it to zero and says so.
            warnings.filterwarnings("ignore", "Predicted variances smaller than 0")
            deviation = self.regressor.predict(points.reshape(-1, points.shape[-1]), return_std=True)[1]
        # The white kernel counts the scatter of a new run in; the mean response has none.
        variance = self.scale**2 * deviation**2 - (self.noise or 0.0) ** 2
        return np.sqrt(variance.clip(0.0)).reshape(points.shape[:-1])

    def as_dict(self) -> dict[str, Any]:
        """Hyperparameters, ready for JSON; length scales by letter of the factor."""
        return {
            "kernel": "Matern 5/2",
            "length_scales": dict(zip(ascii_uppercase, self.length_scales.tolist(), strict=False)),
            "deviation": self.deviation,
            "noise": self.noise,
            "log_likelihood": self.log_likelihood,
        }


def fit_gaussian(
    coded: ArrayLike,
    values: ArrayLike,
    *,
    name: str,
    standard_errors: ArrayLike | None = None,
    seed: int = 1,
    start: GaussianSurface | None = None,
    search: bool = True,
) -> GaussianSurface:
    """Fit a Gaussian process to one response.

    Parameters
    ----------
    coded : runs in coded units, shape (n, k).
    values : response of each run, shape (n,).
    name : name of the response, for messages.
    standard_errors : known standard error of each value, shape (n,); without them one scatter of all runs
        is estimated with the other hyperparameters.
    seed : of the restarts of the search for the hyperparameters.
    start : a fit of nearly the same runs from whose hyperparameters to search, a few steps without restarts.
    search : False keeps the hyperparameters of ``start``.

    Of more than `MOST_SEARCHED` runs the hyperparameters are those of so many, drawn by ``seed``; all runs count in
    the surface itself.

    Raises
    ------
    ValueError when shapes differ, a number is not finite or a standard error is negative.
    """
    points, response = points_and_values(name, coded, values)
    if not (np.isfinite(points).all() and np.isfinite(response).all()):
        raise ValueError(f"{name}: a factor or value is not a finite number; mend or leave out that run")
    errors = np.broadcast_to(0.0 if standard_errors is None else np.asarray(standard_errors, float), response.shape)
    if not (np.isfinite(errors) & (errors >= 0.0)).all():
        raise ValueError(f"{name}: a standard error is not a number of at least 0; mend or leave all out")
    if start is None and len(points) > MOST_SEARCHED:
        some = np.sort(np.random.default_rng(seed).permutation(len(points))[:MOST_SEARCHED])
        given = None if standard_errors is None else errors[some]
        start = fit_gaussian(points[some], response[some], name=name, standard_errors=given, seed=seed)
        search = False
    mean, scale = float(response.mean()), float(response.std()) or 1.0
    regressor = GaussianProcessRegressor(
        _kernel(points.shape[1], standard_errors is None) if start is None else start.regressor.kernel_,
        alpha=JITTER + (errors / scale) ** 2,
        optimizer=partial(_search, steps=STEPS if start is None else STEPS_FROM_START) if search else None,
        n_restarts_optimizer=RESTARTS if start is None else 0,
        random_state=seed,
    )
    with warnings.catch_warnings(), THREADS.limit(limits=1):
        # A hyperparameter at its bound is an answer (no effect, no scatter), not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        regressor.fit(points, (response - mean) / scale)
    parameters = regressor.kernel_.get_params()
    field = "k1__k" if standard_errors is None else "k"
    return GaussianSurface(
        name=name,
        length_scales=np.atleast_1d(parameters[f"{field}2__length_scale"]),
        deviation=scale * math.sqrt(parameters[f"{field}1__constant_value"]),
        noise=scale * math.sqrt(parameters["k2__noise_level"]) if standard_errors is None else None,
        log_likelihood=float(regressor.log_marginal_likelihood_value_ - len(response) * math.log(scale)),
        mean=mean,
        scale=scale,
        regressor=regressor,
    )


def _search(
    objective: Callable[[Array], tuple[float, Array]], first: Array, bounds: Array, steps: int
) -> tuple[Array, float]:
    optimum = optimize.minimize(
        objective, first, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": steps}
    )
    return optimum.x, optimum.fun


def _kernel(factors: int, scatter: bool) -> Any:
    function = ConstantKernel(1.0, VARIANCES) * Matern(np.full(factors, 2.0), LENGTHS, nu=2.5)
    return function + WhiteKernel(0.05, NOISES) if scatter else function
