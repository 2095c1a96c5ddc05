"""Decisions under unknown inputs whose truth is known: shares under noise, and how sure they are."""

import numpy as np
import pytest
from decisions import noisy, smooth
from scipy import stats

from doe.unknown.decision import better, decides, in_doubt, wilson
from doe.unknown.inputs import nested


def test_noise_is_taken_off_the_share_of_cases() -> None:
    """Gains normal about 1 with sd 1: 84 % positive; noise of sd 2 would make 67 % of it.

    Noise twice the scatter leaves the form of the distribution open, and no form is assumed.
    """
    truth = 1.0 + stats.norm.ppf(nested(1, 1024, 1))
    gains, variances, _ = noisy(truth, 2.0, 1)
    assert float((gains > 0.0).mean()) == pytest.approx(0.67, abs=0.03)
    found = better(gains, variances, 1)
    assert found.gains[0].value == pytest.approx(stats.norm.cdf(1.0), abs=0.06)
    assert found.gains[0].low < stats.norm.cdf(1.0) < found.gains[0].high


def test_gains_that_go_together_are_not_multiplied() -> None:
    """Two gains of one sign always: all is as likely as each, a half, not a quarter."""
    one = stats.norm.ppf(nested(1, 256, 2))
    gains, variances, _ = noisy(np.hstack([one, 2.0 * one]), 0.05, 2)
    found = better(gains, variances, 1)
    assert found.all.value == pytest.approx(0.5, abs=0.03)
    assert [each.value for each in found.gains] == pytest.approx([0.5, 0.5], abs=0.03)


@pytest.mark.slow
def test_intervals_of_shares_cover() -> None:
    held = []
    for seed in range(60):
        random = np.random.default_rng(seed)
        gains, variances, _ = noisy(0.5 + random.standard_normal((128, 1)), 0.5, seed)
        share = better(gains, variances, seed).gains[0]
        held.append(share.low <= stats.norm.cdf(0.5) <= share.high)
    assert np.mean(held) >= 0.9


def test_a_design_that_always_wins_is_sure_within_its_rows() -> None:
    gains, variances, freedom = noisy(np.full((256, 2), 0.2), 0.02, 3)
    found = better(gains, variances, 1)
    assert found.all.value > 0.98 and found.all.low > 0.97
    sure = decides(nested(3, 256, 3), gains, smooth(nested(3, 256, 3), variances, freedom), nested(3, 4096, 4), 1)
    assert all(each.worth < 0.01 for each in sure.inputs)
    assert in_doubt(gains, variances).size == 0


def test_wilsons_interval() -> None:
    """Wilson's own formula at 10 of 20."""
    assert wilson(0.5, 20) == pytest.approx((0.2993, 0.7007), abs=1e-4)
    assert wilson(1.0, 100)[0] == pytest.approx(0.963, abs=1e-3)
