"""Goals, limits and picks: each against a case whose answer is known."""

import numpy as np
import pytest
from pareto_cases import LOWER, UPPER, bowls

from doe.pareto import Goals, InfeasibleError, front
from doe.pareto.search import RULES, desirability, pick_all, tchebycheff

SMALL = {"population": 40, "generations": 30}
LINE = np.column_stack([np.linspace(0, 1, 101)] * 2) * [1, -1] + [0, 1]  # costs x and 1 - x


def negated(points):
    return bowls(2)(points) * [1.0, -1.0]


def test_goal_max_is_goal_min_of_the_negative():
    plain = front(bowls(2), LOWER, UPPER, **SMALL)
    mixed = front(negated, LOWER, UPPER, goals=Goals.of(["min", "max"]), **SMALL)
    assert np.array_equal(plain.points, mixed.points)
    assert np.array_equal(mixed.values, plain.values * [1.0, -1.0])
    assert mixed.hypervolume == plain.hypervolume


def test_target_is_met_where_it_can_be():
    # x between 0 and 2, one response x^2 near 1, the other x small: the front is x from 0 to 1.
    def responses(x):
        return np.hstack([x**2, x])

    goals = Goals.of(["target", "min"], target=[1.0, None])
    found = front(responses, [0.0], [2.0], goals=goals, **SMALL)
    assert found.points.min() == pytest.approx(0.0, abs=1e-3)
    assert found.points.max() == pytest.approx(1.0, abs=1e-3)
    assert found.values[:, 0] == pytest.approx(found.points[:, 0] ** 2, abs=0)


def test_watched_response_takes_no_part_in_dominance():
    def responses(x):
        return np.hstack([bowls(2)(x), x[:, :1]])

    found = front(responses, LOWER, UPPER, goals=Goals.of(["min", "min", "none"]), **SMALL)
    assert np.array_equal(found.points, front(bowls(2), LOWER, UPPER, **SMALL).points)
    assert found.values.shape == (len(found.points), 3) and found.costs.shape == (len(found.points), 2)


def test_limits_cut_the_front_where_they_lie():
    goals = Goals.of(["min", "min"], upper=[0.25, None], lower=[None, 0.16])
    found = front(bowls(2), LOWER, UPPER, goals=goals, population=60, generations=60)
    # On the line from 0 to 1: x^2 <= 0.25 and (1 - x)^2 >= 0.16.
    assert (found.values[:, 0] <= 0.25).all() and (found.values[:, 1] >= 0.16).all()
    assert found.points[:, 0].max() == pytest.approx(0.5, abs=0.01)
    assert 0.0 < found.feasible < 1.0


def test_impossible_limits_name_the_least_violation():
    goals = Goals.of(["min", "min"], upper=[0.09, 0.09])
    with pytest.raises(InfeasibleError) as refused:
        front(bowls(2), LOWER, UPPER, goals=goals, population=60, generations=60)
    # Nearest to both limits, in shares of either, is the middle of the line: 0.25 each.
    assert refused.value.violations == pytest.approx([0.16, 0.16], abs=0.02)
    assert refused.value.point == pytest.approx([0.5, 0.0, 0.0], abs=0.05)


def test_limits_and_costs_of_ranges_are_those_of_the_worse_end():
    goals = Goals.of(["min", "max", "target", "none"], target=[None, None, 5.0, None], upper=[None, None, 9.0, 1.0])
    low, high = np.array([[1.0, 2.0, 3.0, 4.0]]), np.array([[10.0, 20.0, 6.0, 5.0]])
    assert goals.worst(low, high).tolist() == [[10.0, -2.0, 2.0]]
    assert goals.violations(low, high).tolist() == [[0.0, 4.0]]
    assert goals.slopes(low).tolist() == [[1.0, -1.0, -1.0]]


def test_weights_pull_the_tchebycheff_pick():
    # Of x and 1 - x with weights w and 1 - w, the least weighted maximum is where both are equal.
    for weight in (0.2, 0.5, 0.8):
        goals = Goals.of(["min", "min"], weight=[weight, 1.0 - weight])
        best = tchebycheff(LINE, goals.cost_weight).argmin()
        assert LINE[best, 0] == pytest.approx(1.0 - weight, abs=0.011)


def test_desirability_is_the_geometric_mean_of_the_ramps():
    goals = Goals.of(["min", "min"])
    assert desirability(LINE, goals) == pytest.approx(np.sqrt((1 - LINE[:, 0]) * (1 - LINE[:, 1])))
    weighed = Goals.of(["min", "max"], weight=[3.0, 1.0])
    # Half way between ideal and nadir of the first, three quarters up the second: (0.5^3 * 0.75)^(1/4).
    costs = np.array([[0.4, -1.5], [0.6, 0.0], [0.2, -2.0]])
    assert desirability(costs, weighed) == pytest.approx([(0.5**3 * 0.75) ** 0.25, 0.0, 1.0])


def test_every_rule_picks_among_those_that_dominate_the_baseline():
    picks, among = pick_all(LINE, Goals.of(["min", "min"]), np.array([0.8, 0.5]))
    assert set(picks) == set(RULES)
    assert all(0.5 <= LINE[row, 0] <= 0.8 for row in picks.values())
    assert "31 (of 101)" in among
    found = front(bowls(2), LOWER, UPPER, baseline=[0.7, 0.4, 0.1], pick="weights", **SMALL)
    assert found.pick == found.picks["weights"] and "by the weights" in found.pick_reason


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"kinds": ["min", "target"]}, "response 2: .* needs its target"),
        ({"kinds": ["min"], "lower": [2.0], "upper": [1.0]}, "response 1: lower limit must be below"),
    ],
)
def test_goals_that_contradict_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        Goals.of(**arguments)
