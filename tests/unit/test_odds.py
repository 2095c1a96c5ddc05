"""The odds that a design keeps a limit while inputs are unknown."""

import numpy as np
import pytest
from scipy import special

from doe.unknown.decision import gain_chances, odds
from rbdyn.base.estimate import wilson

COUNT, SPREAD = 256, 3.0


def simulated(noise, count=COUNT, seed=1):
    """Values that scatter by SPREAD about 10 over the inputs, simulated with noise of its own variance at each."""
    random = np.random.default_rng(seed)
    variances = noise**2 * random.uniform(0.5, 1.5, count)
    truth = 10.0 + SPREAD * random.standard_normal(count)
    return truth, truth + np.sqrt(variances) * random.standard_normal(count), variances


@pytest.mark.parametrize("noise", [0.0, 1.0, 3.0])
def test_closed_form_of_normal_values(noise):
    """Closed form: the normal law of the inputs alone, however much the simulation scatters; rows counted raw say less."""
    _, values, variances = simulated(noise)
    at = 10.0 + 1.5 * SPREAD
    found, truth = odds(values, variances, -np.inf, at, 1), special.ndtr(1.5)
    assert found.value == pytest.approx(truth, abs=0.05) and found.low < truth < found.high
    if noise == 3.0:
        assert (values <= at).mean() < truth - 0.05
    both = odds(values, variances, 10.0 - SPREAD, 10.0 + SPREAD, 1)
    assert both.value == pytest.approx(special.ndtr(1.0) - special.ndtr(-1.0), abs=0.1)


def test_limit_case_without_noise_counts_the_rows():
    """Limit case: the share of the input sets that keep both limits, with ends no nearer than Wilson's."""
    values = np.arange(100.0)
    found = odds(values, np.zeros(100), 5.0, 84.5, 1)
    low, high = wilson(0.8, 100)
    assert found.value == pytest.approx(0.8) and found.low <= low and found.high >= high
    none, every = (odds(values, np.zeros(100), *ends, 1) for ends in ((200.0, np.inf), (-np.inf, 200.0)))
    assert none[:2] == (0.0, 0.0) and 0.0 < none.high < 0.05 and every.value == every.high == 1.0 and every.low > 0.95


def test_invariant_a_lower_limit_is_a_gain_above_it():
    """Invariant: the odds of a limit are the chance that the value less the limit is positive, bar rounding. That 95 % intervals of
    this chance hold it in at least 90 of 100 repeats, but not in all, test_intervals_of_shares_cover and test_unknown_chances show."""
    _, values, variances = simulated(1.0, 128)
    limit = 10.0 - 0.8 * SPREAD
    chance = gain_chances("a", values[:, None] - limit, variances[:, None], 1).gains["a"]
    assert odds(values, variances, limit, np.inf, 1) == pytest.approx(chance, abs=1e-9)
