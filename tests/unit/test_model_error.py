"""What a model misses: coverage of the intervals of a mean, estimate and field against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import special
from surface_intervals import interval

from doe.designs import central_composite
from doe.response_surface import describe, fit
from doe.response_surface.adequacy import ModelError, correlation, draw_fields

POINTS = central_composite(3, centre_replicates=6).coded
KEYWORDS = {"name": "y", "model": "quadratic", "centre": np.zeros(3), "step": np.ones(3)}
NOISE = 0.3


def wavy(seed, size, reach):
    """A quadratic with waves of a wavelength that no quadratic follows."""
    random = np.random.default_rng(seed)
    waves, phases = random.normal(size=(60, 3)) / reach, random.uniform(0.0, 2.0 * np.pi, 60)
    shares = random.normal(size=60) * np.sqrt(2.0 / 60.0)
    return lambda x: size * np.cos(x @ waves.T + phases) @ shares + 10.0 + x.sum(axis=1) + (x**2).sum(axis=1)


def coverage(points, size, repeats=40, noise=NOISE, model="quadratic", **keywords):
    """Shares of fresh points whose true mean the 95 % interval holds, without and with the model error, and of fits that
    have one."""
    found = []
    for seed in range(repeats):
        random, truth = np.random.default_rng(1000 + seed), wavy(seed, size, 0.7)
        values = truth(points) + noise * random.normal(size=len(points))
        surface = fit(points, values, **KEYWORDS | {"model": model}, **keywords)
        new = random.uniform(-1.0, 1.0, (200, 3))
        shares = []
        for each in (replace(surface, model_error=None), surface):
            low, high = interval(each, new)
            shares.append(np.mean((low <= truth(new)) & (truth(new) <= high)))
        found.append((*shares, surface.model_error is not None))
    return np.mean(found, axis=0)


def test_interval_of_a_mean_covers_what_the_model_misses():
    before, after, told = coverage(POINTS, 3.0)
    assert told > 0.95 and before < 0.65 and 0.93 < after <= 1.0


def test_known_variances_tell_it_where_no_run_is_repeated():
    points = np.random.default_rng(5).uniform(-1.2, 1.2, (24, 3))
    known = {"standard_errors": np.full(24, NOISE), "replicates": np.full(24, 8)}
    before, after, told = coverage(points, 3.0, **known)
    assert told > 0.95 and before < 0.9 and after > 0.93


def test_interval_of_a_true_model_covers_it_and_is_that_of_the_textbook_without_an_excess():
    before, after, told = coverage(POINTS, 0.0)
    assert 0.3 < told < 0.7 and 0.9 < before <= after < 0.995
    surface = fit(POINTS, wavy(1, 0.0, 1.0)(POINTS) + NOISE * np.random.default_rng(4).normal(size=20), **KEYWORDS)
    lack, pure = surface.lack_of_fit, surface.pure_error
    assert lack.ss / lack.df < pure.ms
    assert surface.model_error is None and surface.interval_dof == surface.residual_dof == 10
    low, high = interval(surface, [0.5, 0.5, 0.5])
    half = special.stdtrit(10, 0.975) * surface.prediction_standard_error([0.5, 0.5, 0.5])
    assert (high - low) / 2 == pytest.approx(half, rel=1e-12)


def test_without_noise_the_whole_residual_is_model_error():
    """Repeated runs that agree exactly, and single runs: nothing of the residual is scatter."""
    truth = wavy(3, 1.0, 0.7)
    exact = fit(POINTS, truth(POINTS), **KEYWORDS)
    assert exact.lack_of_fit.p == 0.0 and exact.lack_of_fit.f is None
    assert exact.model_error.source == "repeats" and exact.model_error.dof == 5
    assert sum("lack of fit is certain" in line for line in describe(exact)) == 1
    single = fit(POINTS[:15], truth(POINTS[:15]), **KEYWORDS)
    assert single.model_error.source == "residual" and single.interval_dof == single.residual_dof == 5
    assert any("no scatter of a run is known" in line for line in describe(single))
    for points, textbook in ((POINTS, 0.75), (POINTS[:15], 0.95)):
        before, after, told = coverage(points, 1.0, noise=0.0)
        assert before < textbook and after > 0.95 and told == 1.0
    quadratic = fit(POINTS, 1.0 + POINTS.sum(axis=1) + (POINTS**2).sum(axis=1), **KEYWORDS)
    assert quadratic.model_error is None and any("lack of fit is none" in line for line in describe(quadratic))


def test_variance_is_that_of_the_field_on_average():
    """Independent errors of one point each: the estimate is unbiased, here where hardly any fit is without."""
    random, found = np.random.default_rng(7), []
    alone = np.abs(POINTS).max(axis=1) > 0
    for _ in range(300):
        field = np.where(alone, 2.0 * random.normal(size=20), 2.0 * random.normal())
        error = fit(POINTS, 5.0 + field + 0.1 * random.normal(size=20), **KEYWORDS).model_error
        found.append(0.0 if error is None else error.variance)
    assert np.mean(found) == pytest.approx(4.0, abs=4 * np.std(found) / np.sqrt(300))


def test_words_and_figures_of_it():
    surface = fit(POINTS, wavy(2, 3.0, 0.7)(POINTS) + NOISE * np.random.default_rng(2).normal(size=20), **KEYWORDS)
    lack, pure = surface.lack_of_fit, surface.pure_error
    # With the repeats at the centre, which the model meets by a term of its own, the share is one a run of the rest.
    assert surface.model_error.variance == pytest.approx(lack.ss / lack.df - pure.ms, rel=0.05)
    assert surface.as_dict()["model_error"]["dof"] == lack.df == surface.interval_dof
    assert sum("shown by repeats" in line for line in describe(surface)) == 1


def test_field_is_alike_nearby_and_strange_far_away():
    error = ModelError(4.0, 1000, "repeats")
    points = np.array([[0.0, 0.0], [0.1, 0.0], [3.0, 0.0]])
    drawn = draw_fields(error, points, 20000, np.random.default_rng(1))
    assert np.cov(drawn.T) == pytest.approx(4.0 * correlation(points, points), abs=0.15)
    assert draw_fields(None, points, 5, np.random.default_rng(1)) is None
