"""Decisions under unknown inputs whose truth is known: shares under noise, and how sure they are."""

import numpy as np
import pytest
from decisions import noisy
from scipy import stats

from doe.unknown.decision import _shares, decisive_inputs, gain_chances, in_doubt
from doe.unknown.inputs import nested
from rbdyn.base.estimate import wilson


def test_noise_is_taken_off_the_share_of_cases() -> None:
    """Gains normal about 1 with sd 1: 84 % positive; noise of sd 2 would make 67 % of it."""
    quantiles, chance = nested(1, 1024, 1), stats.norm.cdf(1.0)
    truth = 1.0 + stats.norm.ppf(quantiles)
    gains = noisy(truth, 2.0, 1)
    assert float((gains.values > 0.0).mean()) == pytest.approx(0.67, abs=0.03)
    found = gain_chances("ab"[: gains.values.shape[1]], gains.values, gains.smooth(quantiles), 1)
    assert found.gains["a"].value == pytest.approx(chance, abs=0.04)
    assert found.gains["a"].low < chance < found.gains["a"].high


@pytest.mark.slow
def test_noise_leaves_no_bias_in_the_share_of_cases() -> None:
    """Mean of twelve samples of that noise, whose single shares scatter by 0.04."""
    quantiles, random, every = nested(1, 1024, 1), np.random.default_rng(1), np.ones(1024, dtype=np.int64)
    shares = []
    for seed in range(12):
        gains = noisy(1.0 + stats.norm.ppf(quantiles), 2.0, seed)
        shares.append(_shares(gains.values, gains.smooth(quantiles), every, lambda points: points > 0.0, random)[-1, 0])
    assert np.mean(shares) == pytest.approx(stats.norm.cdf(1.0), abs=0.03)


def test_gains_that_go_together_are_not_multiplied() -> None:
    """Two gains of one sign always: all is as likely as each, a half, not a quarter."""
    quantiles = nested(1, 256, 2)
    one = stats.norm.ppf(quantiles)
    gains = noisy(np.hstack([one, 2.0 * one]), 0.05, 2)
    found = gain_chances("ab"[: gains.values.shape[1]], gains.values, gains.smooth(quantiles), 1)
    assert found.all.value == pytest.approx(0.5, abs=0.03)
    assert [each.value for each in found.gains.values()] == pytest.approx([0.5, 0.5], abs=0.03)


@pytest.mark.slow
def test_intervals_of_shares_cover() -> None:
    held = []
    for seed in range(60):
        random = np.random.default_rng(seed)
        quantiles = random.random((128, 1))
        gains = noisy(0.5 + stats.norm.ppf(quantiles), 0.5, seed)
        share = gain_chances("a", gains.values, gains.smooth(quantiles), seed).gains["a"]
        held.append(share.low <= stats.norm.cdf(0.5) <= share.high)
    assert 0.9 <= np.mean(held) <= 0.99  # nor are they too wide


def test_a_design_that_always_wins_is_sure_within_its_rows() -> None:
    quantiles = nested(3, 256, 3)
    gains = noisy(np.full((256, 2), 0.2), 0.02, 3)
    gains, variances = gains.values, gains.smooth(quantiles)
    found = gain_chances("ab", gains, variances, 1)
    assert found.all.value > 0.98 and found.all.low > 0.97
    sure = decisive_inputs(quantiles, gains, variances, nested(3, 4096, 4), 1)
    assert all(each.worth < 0.01 for each in sure.inputs)
    assert in_doubt(gains, variances).size == 0


def test_wilsons_interval() -> None:
    """Wilson's own formula at 10 of 20."""
    assert wilson(0.5, 20) == pytest.approx((0.2993, 0.7007), abs=1e-4)
    assert wilson(1.0, 100)[0] == pytest.approx(0.963, abs=1e-3)
