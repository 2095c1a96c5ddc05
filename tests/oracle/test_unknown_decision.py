"""Decisions under unknown inputs whose truth is known: shares under noise, flip values, worths in closed form."""

import numpy as np
import pytest
from scipy import stats

from doe.arrays import Array
from doe.emulator import pooled_variances
from doe.unknown.decision import better, decides, in_doubt, wilson
from doe.unknown.joint import nested


def _noisy(truth: Array, sd: float, seed: int) -> tuple[Array, Array, Array]:
    """Gains (n, m) with noise of a known size, their variances from seven degrees of freedom."""
    random = np.random.default_rng(seed)
    variances = sd**2 * random.chisquare(7, truth.shape) / 7.0
    return truth + sd * random.standard_normal(truth.shape), variances, np.full(truth.shape, 7)


def _smooth(quantiles: Array, variances: Array, freedom: Array) -> Array:
    columns = zip(variances.T, freedom.T, strict=True)
    return np.column_stack([pooled_variances(quantiles, *each) for each in columns])


def test_noise_is_taken_off_the_share_of_cases() -> None:
    """Gains normal about 1 with sd 1: 84 % positive; noise of sd 2 would make 67 % of it."""
    truth = 1.0 + stats.norm.ppf(nested(1, 1024, 1))
    gains, variances, _ = _noisy(truth, 2.0, 1)
    assert float((gains > 0.0).mean()) == pytest.approx(0.67, abs=0.03)
    found = better(gains, variances, 1)
    assert found.each[0].value == pytest.approx(stats.norm.cdf(1.0), abs=0.04)
    assert found.each[0].low < stats.norm.cdf(1.0) < found.each[0].high


def test_gains_that_go_together_are_not_multiplied() -> None:
    """Two gains of one sign always: all is as likely as each, a half, not a quarter."""
    one = stats.norm.ppf(nested(1, 256, 2))
    gains, variances, _ = _noisy(np.hstack([one, 2.0 * one]), 0.05, 2)
    found = better(gains, variances, 1)
    assert found.all.value == pytest.approx(0.5, abs=0.03)
    assert [each.value for each in found.each] == pytest.approx([0.5, 0.5], abs=0.03)


@pytest.mark.slow
def test_intervals_of_shares_cover() -> None:
    held = []
    for seed in range(60):
        random = np.random.default_rng(seed)
        gains, variances, _ = _noisy(0.5 + random.standard_normal((128, 1)), 0.5, seed)
        share = better(gains, variances, seed).each[0]
        held.append(share.low <= stats.norm.cdf(0.5) <= share.high)
    assert np.mean(held) >= 0.9


def test_a_design_that_always_wins_is_sure_within_its_rows() -> None:
    gains, variances, freedom = _noisy(np.full((256, 2), 0.2), 0.02, 3)
    found = better(gains, variances, 1)
    assert found.all.value > 0.98 and found.all.low > 0.97
    sure = decides(nested(3, 256, 3), gains, _smooth(nested(3, 256, 3), variances, freedom), nested(3, 4096, 4), 1)
    assert all(each.worth < 0.01 for each in sure.inputs)
    assert in_doubt(gains, variances).size == 0


def test_wilsons_interval() -> None:
    """Wilson's own formula at 10 of 20."""
    assert wilson(0.5, 20) == pytest.approx((0.2993, 0.7007), abs=1e-4)
    assert wilson(1.0, 100)[0] == pytest.approx(0.963, abs=1e-3)


def test_the_input_that_decides_and_where_it_flips() -> None:
    """The pick wins below 0.4 of the second input: probability 0.4, worth 0.4, flip there; a third input does nothing."""
    quantiles, fresh = nested(4, 256, 5), nested(4, 8192, 6)
    truth = np.column_stack([0.4 - quantiles[:, 1], np.full(256, 1.0) + 0.2 * quantiles[:, 0]])
    gains, variances, freedom = _noisy(truth, 0.05, 5)
    assert better(gains, variances, 1).all.value == pytest.approx(0.4, abs=0.05)
    found = decides(quantiles, gains, _smooth(quantiles, variances, freedom), fresh, 1)
    first = found.inputs[0]
    assert first.place == 1
    assert first.flip == pytest.approx(0.4, abs=0.03)
    assert first.worth == pytest.approx(0.4, abs=0.05)
    assert all(each.worth < 0.02 and each.flip is None for each in found.inputs[1:])
    assert min(found.foretold) > 0.9


def test_two_inputs_that_decide_only_together() -> None:
    """The sign of a product: neither input alone tells anything, both tell all, 0.5."""
    quantiles, fresh = nested(4, 512, 7), nested(4, 8192, 8)
    truth = ((quantiles[:, 0] - 0.5) * (quantiles[:, 2] - 0.5))[:, None]
    gains, variances, freedom = _noisy(truth, 0.005, 7)
    found = decides(quantiles, gains, _smooth(quantiles, variances, freedom), fresh, 1)
    assert max(each.worth for each in found.inputs) < 0.05
    assert found.pair is not None and found.pair[:2] == (0, 2)
    assert found.pair[2] > 0.4


def test_what_cannot_be_foretold_is_worth_nothing() -> None:
    """Gains of pure scatter beyond the noise: every share is a half, no input decides."""
    random = np.random.default_rng(9)
    gains, variances, freedom = _noisy(random.standard_normal((256, 1)), 0.1, 9)
    found = decides(nested(3, 256, 9), gains, _smooth(nested(3, 256, 9), variances, freedom), nested(3, 4096, 10), 1)
    assert found.foretold[0] < 0.2
    assert max(each.worth for each in found.inputs) < 0.06


def test_worth_of_knowing_a_normal_input() -> None:
    """D = a + 3 b of normals plus 1: p = Phi(1/sqrt 10), given b Phi(1 + 3 b), whose E max(p, 1 - p) is known by quadrature."""
    quantiles, fresh = nested(3, 512, 11), nested(3, 8192, 12)
    gains, variances, freedom = _noisy(1.0 + stats.norm.ppf(quantiles[:, :2]) @ [[1.0], [3.0]], 0.1, 11)
    found = decides(quantiles, gains, _smooth(quantiles, variances, freedom), fresh, 1)
    b = stats.norm.ppf((np.arange(20000) + 0.5) / 20000)
    given = stats.norm.cdf(1.0 + 3.0 * b)
    truth = float(np.maximum(given, 1.0 - given).mean() - stats.norm.cdf(1.0 / np.sqrt(10.0)))
    assert found.inputs[0].place == 1 and found.inputs[0].above
    assert found.inputs[0].worth == pytest.approx(truth, abs=0.02 * 0.87)
    assert found.inputs[0].flip == pytest.approx(stats.norm.cdf(-1.0 / 3.0), abs=0.03)
