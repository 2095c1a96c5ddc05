"""The emulator: scikit-learn's own kernels at equal hyperparameters, leaving out = refitting, moments of draws, recovery."""

import warnings

import numpy as np
import pytest
from doe_command import loaded_by
from scipy import optimize
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, DotProduct, Matern, WhiteKernel

from doe.designs.model import model_matrix
from doe.emulator import Hyperparameters, fit_emulator, pooled_variances
from doe.emulator.emulator import DEGREES
from doe.emulator.regression import Trended, regression

RANDOM = np.random.default_rng(4)
POINTS = RANDOM.uniform(-1.0, 1.0, (30, 3))
NEW = RANDOM.uniform(-1.0, 1.0, (40, 3))
VARIANCES = RANDOM.uniform(0.001, 0.01, 30)
VALUES = np.sin(3.0 * POINTS[:, 0]) + POINTS[:, 1] ** 2 + RANDOM.normal(0.0, np.sqrt(VARIANCES))
GIVEN = Hyperparameters(np.array([0.6, 1.3, 4.0]), 0.8, 2e-3, 0.7, 50.0)


def fitted(trend="quadratic", rows=slice(None), search=False):
    given = GIVEN._replace(level=0.0) if trend == "none" else GIVEN
    return fit_emulator(POINTS[rows], VALUES[rows], VARIANCES[rows], trend=trend, start=given, search=search)


def composed(trend):
    """The kernel by scikit-learn's own parts and operators; logarithms in the order of ours but for that of a missing trend."""
    kernel = ConstantKernel(GIVEN.variance) * Matern(GIVEN.lengths, nu=2.5) + WhiteKernel(GIVEN.nugget)
    if DEGREES[trend]:
        kernel = ConstantKernel(GIVEN.trend) * DotProduct(1.0, "fixed") ** DEGREES[trend] + kernel
    return kernel if trend == "none" else ConstantKernel(GIVEN.level, "fixed") + kernel


@pytest.mark.parametrize("trend", list(DEGREES))
def test_oracle_kernels_of_scikit_learn(trend):
    """Mean, deviation, covariance, likelihood and its gradient of the regressor with kernels composed of scikit-learn's."""
    theirs = GaussianProcessRegressor(composed(trend), alpha=VARIANCES, optimizer=None)
    ours, middle = fitted(trend), 0.0 if trend == "none" else VALUES.mean()
    theirs.fit(POINTS, VALUES - middle)
    mean, covariance = theirs.predict(NEW, return_cov=True)
    covariance[np.diag_indices(40)] -= GIVEN.nugget
    assert ours.predict(NEW)[0] == pytest.approx(middle + mean, abs=1e-9)
    assert ours.mean(NEW) == pytest.approx(middle + mean, abs=1e-9)
    assert ours.covariance(NEW, NEW) == pytest.approx(covariance, abs=1e-8)
    assert ours.predict(NEW)[1] ** 2 == pytest.approx(np.diag(covariance), abs=1e-8)
    likelihood, slope = theirs.log_marginal_likelihood(theirs.kernel_.theta, eval_gradient=True)
    assert ours.likelihood == pytest.approx(likelihood, rel=1e-9)
    found = ours.regressor.log_marginal_likelihood(ours.regressor.kernel_.theta, eval_gradient=True)
    assert found[0] == pytest.approx(likelihood, rel=1e-9)
    assert found[1][-len(slope) :] == pytest.approx(slope, rel=1e-7)


def test_the_trend_is_a_power_of_the_product_of_points():
    kernel = Trended(*GIVEN, 2)
    alike = np.array([[0.3, -0.4, 0.1], [0.3, -0.4, 0.9]])
    process = GIVEN.variance * Matern(GIVEN.lengths, nu=2.5)(alike)
    assert kernel(alike, alike) - process == pytest.approx(50.0 + 0.7 * (1.0 + alike @ alike.T) ** 2)
    assert kernel.diag(alike) == pytest.approx(np.diag(kernel(alike, alike)))
    assert not kernel.is_stationary() and Trended(*GIVEN, 0).is_stationary()


@pytest.mark.parametrize("trend", list(DEGREES))
def test_terms_and_their_variances_are_the_kernel_of_the_trend(trend):
    """Closed form: a mean is the trend by its coefficients plus the process by its weights."""
    emulator = fitted(trend)
    columns, runs = (model_matrix(x, emulator.terms) for x in (NEW, POINTS))
    process = GIVEN.variance * Matern(GIVEN.lengths, nu=2.5)(NEW, POINTS)
    assert (columns * emulator.term_variances) @ runs.T + process == pytest.approx(
        emulator.prior(NEW, POINTS), rel=1e-9
    )
    mean = columns @ emulator.coefficients + process @ emulator.weights
    assert mean == pytest.approx(emulator.mean(NEW), abs=1e-9)


def test_the_search_ends_at_the_mode_of_the_posterior():
    """Its slope is 0, from whatever start: a search from the end stays, one from far away comes back."""
    emulator = fitted(search=True)
    far = emulator.hyperparameters._replace(lengths=np.full(3, 0.3), variance=10.0, nugget=1e-5)
    for start in (emulator.hyperparameters, far):
        again = fit_emulator(POINTS, VALUES, VARIANCES, start=start)
        assert again.predict(NEW)[0] == pytest.approx(emulator.predict(NEW)[0], abs=0.02 * np.ptp(VALUES))
        assert again.likelihood == pytest.approx(emulator.likelihood, abs=0.05)
    bits = [fitted(search=True).predict(NEW)[0].tobytes() for _ in range(2)]
    assert bits[0] == bits[1], "the same runs, the same bits"


def test_the_gradient_that_the_search_follows_is_that_of_the_posterior(monkeypatch):
    """Finite differences of what L-BFGS-B is given."""
    seen = []

    def watched(function, start, **named):
        seen.append((function, start))
        return minimize(function, start, **named)

    minimize = optimize.minimize
    monkeypatch.setattr(optimize, "minimize", watched)
    fitted(search=True)
    for function, start in seen:
        numerical = optimize.approx_fprime(start, lambda x, f=function: f(x)[0], 1e-6)
        assert function(start)[1] == pytest.approx(numerical, rel=1e-3, abs=1e-3)
    assert len(seen) == 2


def test_leaving_out_is_refitting_without():
    """About the same middle: refits have one of their own."""
    emulator = fitted()
    mean, deviation = emulator.leave_one_out()
    for row in (0, 7, 29):
        rows = np.arange(30) != row
        kernel = Trended(*GIVEN, 2)
        refit = regression(kernel, POINTS[rows], VALUES[rows] - emulator.middle, VARIANCES[rows])
        predicted, spread = refit.predict(POINTS[row : row + 1], return_cov=True)
        assert mean[row] == pytest.approx(emulator.middle + predicted[0], abs=1e-7)
        assert deviation[row] ** 2 == pytest.approx(spread[0, 0] + VARIANCES[row], rel=1e-5)
    assert emulator.q2() > 0.9


def test_predictions_err_as_they_state():
    """95 % intervals hold the truth over 20 seeds of a bent function once 60 runs show its shape; 15 runs are too few for
    their length scales, so two thirds. Errors fall as runs grow."""
    new = qmc.Sobol(3, seed=9).random(256) * 2.0 - 1.0

    def bent(x):
        return np.exp(0.5 * x[:, 0]) * np.cos(2.0 * x[:, 1]) + 0.3 * np.sin(3.0 * x[:, 2]) * x[:, 0]

    errors, inside = {}, {}
    for count in (15, 60):
        misses, deviations = [], []
        for seed in range(20):
            random, points = np.random.default_rng(seed), qmc.LatinHypercube(3, seed=seed).random(count) * 2.0 - 1.0
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                emulator = fit_emulator(points, bent(points) + random.normal(0.0, 0.02, count), 4e-4)
            mean, deviation = emulator.predict(new)
            misses.append(mean - bent(new))
            deviations.append(deviation)
        errors[count] = float(np.std(misses))
        inside[count] = float((np.abs(misses) < 1.96 * np.array(deviations)).mean())
    assert errors[60] < 0.4 * errors[15]
    assert inside[15] > 0.65 and inside[60] > 0.93


def test_draws_have_the_moments_that_are_predicted():
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
    covariance = emulator.covariance(near, near)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(emulator.predict(near)[1], rel=1e-9)
    assert found == pytest.approx(covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance))), abs=0.1)


def test_the_search_finds_what_the_runs_were_made_of():
    random = np.random.default_rng(1)
    points = random.uniform(-1.0, 1.0, (150, 2))
    truth = Hyperparameters(np.array([0.5, 2.0]), 1.0, 0.01, 1.0, 0.0)
    prior = fit_emulator(points[:2], np.zeros(2), 1e12, trend="none", start=truth, search=False)
    values = prior.draw(1, random)(points)[0] + random.normal(0.0, 0.1, 150)
    found = fit_emulator(points, values, 0.0, trend="constant").hyperparameters
    assert found.lengths == pytest.approx(truth.lengths, rel=0.35)
    assert found.nugget == pytest.approx(0.01, rel=0.5)


@pytest.mark.parametrize("trend", ["constant", "quadratic"])
def test_noise_is_not_followed(trend):
    """Runs of nothing but noise may be followed closely, by short lengths, or taken for scatter: the second is likelier."""
    nuggets, means = [], []
    for seed in range(6):
        points = qmc.LatinHypercube(3, seed=seed).random(60) * 2.0 - 1.0
        emulator = fit_emulator(points, np.random.default_rng(seed).standard_normal(60), 0.0, trend=trend)
        nuggets.append(emulator.hyperparameters.nugget)
        means.append(emulator.mean(NEW))
    assert min(nuggets) > 0.5 and np.mean(nuggets) == pytest.approx(0.9, abs=0.15)
    assert np.std(means) < 0.4


def test_known_variances_are_not_taken_for_the_nugget():
    random = np.random.default_rng(2)
    points = random.uniform(-1.0, 1.0, (80, 2))
    values = points @ [1.0, 2.0] + random.normal(0.0, 0.1, 80)
    stated, hidden = (fit_emulator(points, values, each).hyperparameters.nugget for each in (0.01, 0.0))
    assert stated < 0.002 < hidden


def test_variances_of_few_replicates_are_pooled_without_bias():
    random = np.random.default_rng(3)
    points = random.uniform(-1.0, 1.0, (2000, 2))
    truth = np.exp(0.5 + points[:, 0])
    freedom = np.full(2000, 3)
    estimates = truth * random.chisquare(3, 2000) / 3
    assert pooled_variances(points, estimates, freedom) / truth == pytest.approx(np.ones(2000), rel=0.1)
    assert pooled_variances(points, np.full(2000, np.nan), freedom).max() == 0.0


def test_only_a_fit_loads_scikit_learn():
    """Its import takes about a second."""
    assert "sklearn" not in loaded_by("import doe.adaptive, doe.emulator, doe.response_surface, doe.workflow")
    assert "sklearn" in loaded_by(
        "from doe.emulator import fit_emulator; fit_emulator([[0.0], [1.0]], [1.0, 2.0], 0.1)"
    )


def test_it_refuses_what_is_no_number():
    with pytest.raises(ValueError, match="not a finite number"):
        fit_emulator(POINTS, np.full(30, np.nan), 0.1)
