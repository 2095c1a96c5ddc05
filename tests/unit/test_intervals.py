"""Student's intervals that hold together, at few degrees of freedom."""

import numpy as np
import pytest
from scipy import special

from doe.workflow.confirmation import Confirmed, Gain
from rbdyn.base.estimate import chance_above, one_sided, times_wider, welch

REPEATS, TOGETHER = 40_000, 3
# Three standard errors of a share of so many repeats of 95 %.
SAMPLING = 3.0 * np.sqrt(0.95 * 0.05 / REPEATS)


def simulated(random, replicates, spread=1.0):
    """A point whose responses are the means of so many replicates each, about 0; all repeats at once."""
    drawn = spread * random.standard_normal((REPEATS * TOGETHER, replicates))
    half = special.stdtrit(replicates - 1, 0.975) * drawn.std(axis=1, ddof=1) / np.sqrt(replicates)
    behind = np.full(len(drawn), replicates - 1.0)
    return Confirmed(np.zeros(1), drawn.mean(axis=1), half, np.full(len(drawn), np.nan), freedom=behind)


def together(values, half_widths):
    """In what share of the repeats all intervals hold the truth, which is 0."""
    return float((np.abs(values) <= half_widths).reshape(REPEATS, TOGETHER).all(axis=1).mean())


@pytest.mark.parametrize("replicates", [3, 5, 7])
def test_invariant_intervals_of_few_replicates_hold_together(replicates):
    """Invariant: of three independent values all hold in 95 % (Bonferroni: 0.9508), and in fewer by the normal ratio."""
    point = simulated(np.random.default_rng(replicates), replicates)
    held = together(point.values, point.error * times_wider(point.joint_freedom, TOGETHER))
    assert held == pytest.approx((1.0 - 0.05 / 3) ** 3, abs=SAMPLING)
    normal = special.ndtri(1.0 - 0.025 / TOGETHER) / special.ndtri(0.975)
    assert together(point.values, normal * point.error) < 0.95 - {3: 0.04, 5: 0.015, 7: 0.008}[replicates]


@pytest.mark.parametrize("replicates", [3, 4, 5, 6, 7])
@pytest.mark.parametrize("spread", [1.0, 2.0])
def test_invariant_gains_of_few_replicates_hold_together(replicates, spread):
    """Invariant: differences of two points, alike or not in scatter, hold together in 95 % to what Welch's approximation errs,
    and not in far more."""
    random = np.random.default_rng(10 + replicates)
    one, other = simulated(random, replicates), simulated(random, replicates, spread)
    change = one.estimate - other.estimate
    held = together(one.values - other.values, change.half_width * times_wider(change.freedom, TOGETHER))
    assert 0.95 - 0.007 - SAMPLING < held < 0.95 + 0.023 + SAMPLING


def test_closed_form_of_joint_degrees_of_freedom():
    """Closed form: equal errors add their degrees of freedom, one alone keeps its own, and what is known has no end of them."""
    one, none = np.array([1.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    found = welch([one, none], [np.full(3, 4.0), np.full(3, 4.0)])
    assert found.tolist() == [8.0, 4.0, np.inf]
    half = np.full(1, 3.0), np.full(1, 4.0)
    point = Confirmed(np.zeros(1), np.zeros(1), *half, freedom=np.full(1, 7.0))
    assert point.error.tolist() == [5.0]
    errors = 3.0 / special.stdtrit(7, 0.975), 4.0 / special.ndtri(0.975)
    assert point.standard_error == pytest.approx([np.hypot(*errors)])
    assert point.joint_freedom == pytest.approx([7.0 * (1.0 + (errors[1] / errors[0]) ** 2) ** 2])


def test_limit_case_of_known_errors_is_normal():
    """Limit case: with infinitely many degrees of freedom all is as with normal errors; few make it wider."""
    gain = Gain(9.0, 8.0)
    assert gain.error_among(2) == pytest.approx(8.0 * special.ndtri(0.9875) / special.ndtri(0.975))
    assert Gain(9.0, 8.0, freedom=3.0).error_among(2) > gain.error_among(2)
    assert "freedom" not in gain.as_dict()
    assert one_sided(np.inf, 0.95) == pytest.approx(1.6449 / 1.96, abs=1e-4)
    for freedom in (2.0, np.inf):
        # On the bound of the one-sided interval the probability is the one that it was made for.
        assert chance_above(3.0 * one_sided(freedom, 0.9), 3.0, freedom) == pytest.approx(0.9)
