"""The selected design of the simulator's own front: what tolerances leave of it, and its limits."""

import numpy as np
import pytest

from doe.pareto import Goals
from doe.pareto.manufacture import Quadratic, ToleranceBox
from doe.pareto.tolerance import Neighbourhood, pick_among, simulated_aware

GOALS = Goals.of(["min", "min"])
FLAT = [Quadratic(1.0, np.zeros(2), np.zeros((2, 2))), Quadratic(2.0, np.zeros(2), np.zeros((2, 2)))]


def test_runs_nearby_correct_the_shape_of_the_surfaces():
    """Surfaces that know no slope, runs on a plane: the slopes found are those of the plane, the level is the point's."""
    runs = np.random.default_rng(1).uniform(-1.0, 1.0, (80, 2))
    slopes = np.array([[3.0, -1.0], [0.5, 2.0]])
    here = Neighbourhood.of(FLAT, np.zeros((1, 2)), np.array([[10.0, 20.0]]), runs, runs @ slopes)
    assert here.slopes[0] == pytest.approx(slopes, abs=1e-9)
    parts = here.parts(np.array([[0.1, 0.0], [0.0, -0.2]]))
    assert parts[0] == pytest.approx(np.array([[10.3, 19.9], [9.9, 19.6]]))


def test_along_what_was_not_varied_the_surfaces_alone_tell():
    runs = np.column_stack([np.linspace(-1.0, 1.0, 50), np.zeros(50)])
    here = Neighbourhood.of(FLAT, np.zeros((1, 2)), np.zeros((1, 2)), runs, runs @ np.array([[3.0, 0.0], [9.0, 9.0]]))
    assert here.slopes[0] == pytest.approx(np.array([[3.0, 0.0], [0.0, 0.0]]), abs=1e-9)


def test_worst_case_of_a_slope_is_its_corner_and_limits_count_it():
    slopes = np.array([[[2.0, 0.0], [1.0, 0.0]]])
    goals = Goals.of(["min", "min"], upper=[13.5, None])
    here = Neighbourhood(FLAT, np.zeros((1, 2)), np.array([[11.0, 5.0]]), slopes)
    base = Neighbourhood(FLAT, np.zeros((1, 2)), np.array([[20.0, 6.0]]), slopes)
    none = np.zeros((1, 2))
    box = ToleranceBox(np.array([1.0, 0.5]), "worst_case")
    found = simulated_aware(box, here, goals, base, none, none)
    assert found.costs[0] == pytest.approx([13.5, 5.0]) and found.violations[0] == pytest.approx([0.0])
    assert found.survives[0] == 1.0 and found.robust_baseline == pytest.approx([22.5, 6.0])
    doubted = simulated_aware(box, here, goals, base, none, none + 1.0)
    assert doubted.violations[0] == pytest.approx([1.0])


def test_only_what_keeps_its_limits_is_picked():
    costs = np.array([[0.0, 4.0], [1.0, 1.0], [1.5, 1.5], [4.0, 0.0]])
    broken = np.array([[0.0], [1.0], [0.0], [0.0]])
    row, reason = pick_among(costs, broken, GOALS, [np.array([5.0, 5.0])], "knee")
    assert row == 2 and "meet their limits" in reason
    row, reason = pick_among(costs, broken + 1.0, GOALS, [], "knee")
    assert row == 0 and "none of which meets all limits" in reason
