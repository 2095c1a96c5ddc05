"""How often a simulated point is the selected design under the errors of its simulation."""

import math

import numpy as np
import pytest

from doe.pareto.front import NOISE_DRAWS, pick_shares


def lowest(costs: np.ndarray, shift: np.ndarray) -> int:
    """The point of the lowest first cost."""
    return int(costs[:, 0].argmin())


@pytest.mark.parametrize("apart", [0.0, 1.0, 2.0])
def test_two_points_are_picked_by_the_normal_law_of_their_difference(apart: float) -> None:
    """The lower one in Phi(d/(s sqrt 2)) of the draws."""
    costs, errors = np.array([[0.0, 1.0], [apart, 0.0]]), np.full((2, 2), 0.7)
    shares = pick_shares(lowest, costs, errors, np.full((2, 2), 1e9))
    expected = 0.5 * (1.0 + math.erf(apart / (0.7 * math.sqrt(2.0)) / math.sqrt(2.0)))
    assert shares.sum() == pytest.approx(1.0)
    assert abs(shares[0] - expected) < 4.0 * math.sqrt(max(expected * (1.0 - expected), 0.01) / NOISE_DRAWS)


def test_without_errors_the_pick_is_sure_and_the_same_seed_gives_the_same_bits() -> None:
    costs = np.array([[1.0, 0.0], [0.5, 0.2], [0.0, 1.0]])
    assert pick_shares(lowest, costs, np.zeros((3, 2)), np.full((3, 2), 5.0)).tolist() == [0.0, 0.0, 1.0]
    noisy = [pick_shares(lowest, costs, np.full((3, 2), 0.3), np.full((3, 2), 5.0), seed=4) for _ in range(2)]
    assert (noisy[0] == noisy[1]).all()


def test_the_baseline_shifts_by_the_median_error() -> None:
    """A pick that depends on the shift alone changes as often as a normal number exceeds one of its standard deviations."""
    errors = np.array([[0.1], [0.2], [9.0]])
    shares = pick_shares(lambda _, shift: int(shift[0] > 0.2), np.zeros((3, 1)), errors, np.full((3, 1), 1e9))
    assert abs(shares[1] - 0.1587) < 4.0 * math.sqrt(0.1587 * 0.8413 / NOISE_DRAWS)
