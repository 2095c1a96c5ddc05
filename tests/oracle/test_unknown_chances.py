"""Chances under simulation noise for true gains of any form: skewed, with rare bad cases, normal, of two kinds."""

import numpy as np
import pytest
from scipy import stats

from doe.unknown.decision import _shares, gain_chances, odds

ROWS = 128


def true_gains(kind: str, random: np.random.Generator, count: int) -> np.ndarray:
    """Gains whose scale of noise is 1."""
    normal = random.standard_normal(count)
    if kind == "skewed":
        return random.exponential(1.0, count) + np.log(0.43)
    if kind == "rare bad":
        return np.where(random.random(count) < 0.03, -10.0 + 2.0 * normal, 1.0 + 0.3 * normal)
    if kind == "bimodal":
        return np.where(random.random(count) < 0.65, 1.0, -1.0) + 0.3 * normal
    return 0.25 + normal


CHANCE = {"skewed": 0.43, "rare bad": 0.97, "normal": float(stats.norm.cdf(0.25)), "bimodal": 0.65}


def gains_with_noise(kind: str, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Gains (n, 1) and their variances, which differ threefold from row to row."""
    random = np.random.default_rng(seed)
    variances = noise**2 * random.uniform(0.5, 1.5, (ROWS, 1))
    truth = true_gains(kind, random, ROWS)[:, None]
    return truth + np.sqrt(variances) * random.standard_normal((ROWS, 1)), variances


@pytest.mark.parametrize("kind", CHANCE)
def test_chance_of_gains_of_any_form(kind: str) -> None:
    """Mean of twelve samples; a normal law in place of the form gives 0.52 for skewed gains and 0.87 with rare bad cases."""
    shares, random = [], np.random.default_rng(1)
    for seed in range(12):
        gains, variances = gains_with_noise(kind, 0.6, seed)
        every = np.ones(ROWS, dtype=np.int64)
        shares.append(_shares(gains, variances, every, lambda points: points > 0.0, random)[1, 0])
    assert np.mean(shares) == pytest.approx(CHANCE[kind], abs=0.05)


def test_odds_of_a_limit_are_of_any_form_too() -> None:
    gains, variances = gains_with_noise("skewed", 0.6, 1)
    chance, limit = (
        gain_chances("a", gains, variances, 1).gains["a"],
        odds(gains[:, 0], variances[:, 0], 0.0, np.inf, 1),
    )
    assert limit.value == pytest.approx(chance.value, abs=0.04)
    nothing = odds(np.full(20, 3.0), np.zeros(20), 0.0, 2.0, 1)
    assert nothing.value == 0.0 and nothing.high < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.6, 1.0])
@pytest.mark.parametrize("kind", CHANCE)
def test_intervals_of_chances_cover_gains_of_any_form(kind: str, noise: float) -> None:
    """In 60 samples each; noise as large as the scatter of the gains, for rare bad cases over three times that."""
    found = [gain_chances("a", *gains_with_noise(kind, noise, seed), seed).gains["a"] for seed in range(60)]
    held = np.mean([share.low <= CHANCE[kind] <= share.high for share in found])
    bias = np.mean([share.value for share in found]) - CHANCE[kind]
    print(f"{kind}, noise {noise:g}: coverage {held:.3f}, bias {bias:+.3f}")
    assert held >= 0.9 and abs(bias) < 0.05
