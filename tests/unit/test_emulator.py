"""The emulator: scikit-learn at equal hyperparameters, leaving out = refitting, draws' moments, gradient, recovery."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import optimize
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from doe.designs.model import model_matrix
from doe.emulator import fit_emulator, pooled_variances
from doe.emulator.covariance import squares
from doe.emulator.likelihood import Hyperparameters, loss

RANDOM = np.random.default_rng(4)
POINTS = RANDOM.uniform(-1.0, 1.0, (30, 3))
NEW = RANDOM.uniform(-1.0, 1.0, (40, 3))
VARIANCES = RANDOM.uniform(0.001, 0.01, 30)
VALUES = np.sin(3.0 * POINTS[:, 0]) + POINTS[:, 1] ** 2 + RANDOM.normal(0.0, np.sqrt(VARIANCES))
GIVEN = Hyperparameters(np.array([0.6, 1.3, 4.0]), 0.8, 2e-3)


def fitted(trend="quadratic", rows=slice(None), search=False):
    return fit_emulator(POINTS[rows], VALUES[rows], VARIANCES[rows], trend=trend, start=GIVEN, search=search)


def test_oracle_scikit_learn_without_a_trend():
    """Mean, deviation and likelihood of scikit-learn's regressor at the same hyperparameters."""
    kernel = ConstantKernel(GIVEN.variance) * Matern(GIVEN.lengths, nu=2.5)
    alpha = VARIANCES + GIVEN.nugget + 1e-10 * GIVEN.variance
    theirs = GaussianProcessRegressor(kernel, alpha=alpha, optimizer=None).fit(POINTS, VALUES)
    ours = fitted("none")
    mean, deviation = theirs.predict(NEW, return_std=True)
    assert ours.predict(NEW)[0] == pytest.approx(mean, abs=1e-6)
    assert ours.predict(NEW)[1] == pytest.approx(deviation, abs=1e-6)
    assert ours.restricted_likelihood == pytest.approx(theirs.log_marginal_likelihood_value_, abs=1e-6)


def test_a_flat_prior_on_the_trend_is_the_limit_of_a_wide_one():
    """Coefficients of variance 1e4 in the kernel of scikit-learn's regressor."""
    ours, wide = fitted("linear"), 1e4
    across, runs = (np.column_stack([np.ones(len(x)), x]) for x in (NEW, POINTS))
    kernel = ConstantKernel(GIVEN.variance) * Matern(GIVEN.lengths, nu=2.5)
    noise = np.diag(VARIANCES + GIVEN.nugget)
    weights = np.linalg.inv(kernel(POINTS) + wide * runs @ runs.T + noise)
    between = kernel(NEW, POINTS) + wide * across @ runs.T
    assert ours.predict(NEW)[0] == pytest.approx(between @ weights @ VALUES, abs=1e-3)
    variance = np.diag(kernel(NEW) + wide * across @ across.T - between @ weights @ between.T)
    assert ours.predict(NEW)[1] ** 2 == pytest.approx(variance, abs=1e-3)


@pytest.mark.parametrize("trend", ["none", "constant", "quadratic"])
def test_gradient_of_the_likelihood_by_finite_differences(trend):
    terms = fitted(trend).terms
    rest = (squares(POINTS, POINTS), model_matrix(POINTS, terms), VALUES, VARIANCES)
    _, slope = loss(GIVEN.logarithms, *rest)
    numerical = optimize.approx_fprime(GIVEN.logarithms, lambda x: loss(x, *rest)[0], 1e-6)
    assert slope == pytest.approx(numerical, rel=1e-3, abs=1e-4)


def test_leaving_out_is_refitting_without():
    emulator = fitted()
    mean, deviation = emulator.leave_one_out()
    for row in (0, 7, 29):
        refit = fitted(rows=np.arange(30) != row)
        foretold, spread = refit.predict(POINTS[row : row + 1])
        assert mean[row] == pytest.approx(foretold[0], abs=1e-7)
        whole = np.sqrt(spread[0] ** 2 + VARIANCES[row] + GIVEN.nugget)
        assert deviation[row] == pytest.approx(whole, rel=1e-5)
    assert emulator.q2() > 0.9


def test_draws_have_the_moments_that_are_foretold():
    """Far outside too, where the trend's coefficients are most of the deviation; and they pass close to the runs."""
    emulator, at = fitted(), np.vstack([NEW[:6], [[2.0, 2.0, 2.0]]])
    draws = np.vstack([emulator.draw(200, np.random.default_rng(seed))(at) for seed in range(20)])
    mean, deviation = emulator.predict(at)
    assert (draws.mean(axis=0) - mean) / deviation == pytest.approx(np.zeros(7), abs=5.0 / np.sqrt(4000))
    assert draws.std(axis=0) / deviation == pytest.approx(np.ones(7), abs=0.08)


def test_draws_are_correlated_as_the_posterior():
    emulator, near = fitted(), np.array([[0.9, 0.9, 0.9], [0.95, 0.9, 0.9], [-0.9, -0.9, 0.0]])
    draws = np.vstack([emulator.draw(200, np.random.default_rng(seed))(near) for seed in range(10)])
    found = np.corrcoef(draws.T)
    assert found[0, 1] > 0.97
    assert abs(found[0, 2]) < 0.5


def test_the_search_finds_what_the_runs_were_made_of():
    random = np.random.default_rng(1)
    points = random.uniform(-1.0, 1.0, (150, 2))
    truth = Hyperparameters(np.array([0.5, 2.0]), 1.0, 0.01)
    prior = fit_emulator(points[:2], np.zeros(2), 1e12, trend="none", start=truth, search=False)
    values = prior.draw(1, random)(points)[0] + random.normal(0.0, 0.1, 150)
    found = fit_emulator(points, values, 0.0, trend="constant").hyperparameters
    assert found.lengths == pytest.approx(truth.lengths, rel=0.35)
    assert found.nugget == pytest.approx(0.01, rel=0.35)


def test_known_variances_are_not_taken_for_the_nugget():
    random = np.random.default_rng(2)
    points = random.uniform(-1.0, 1.0, (80, 2))
    values = points @ [1.0, 2.0] + random.normal(0.0, 0.1, 80)
    stated, hidden = (fit_emulator(points, values, each).hyperparameters.nugget for each in (0.01, 0.0))
    assert stated < 0.002 < hidden
    assert len(fit_emulator(points[:9], values[:9], 0.01).terms) == 3


def test_variances_of_few_replicates_are_pooled_without_bias():
    random = np.random.default_rng(3)
    points = random.uniform(-1.0, 1.0, (2000, 2))
    truth = np.exp(0.5 + points[:, 0])
    freedom = np.full(2000, 3)
    estimates = truth * random.chisquare(3, 2000) / 3
    assert pooled_variances(points, estimates, freedom) / truth == pytest.approx(np.ones(2000), rel=0.1)
    assert pooled_variances(points, np.full(2000, np.nan), freedom).max() == 0.0


def test_it_refuses_what_is_no_number():
    with pytest.raises(ValueError, match="not a finite number"):
        fit_emulator(POINTS, np.full(30, np.nan), 0.1)
    with pytest.raises(ValueError, match="give two runs"):
        fit_emulator(POINTS, VALUES[:3], 0.1)
