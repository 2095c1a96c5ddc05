"""Fronts: known Pareto sets, hypervolume against a dense exact front, determinism, knee and pick."""

import numpy as np
import pytest
from pareto_cases import LOWER, UPPER, bowls

from doe.pareto import front, hypervolume, knee_depth, non_dominated
from doe.pareto.front import noisy_hypervolume
from doe.pareto.search import CONCESSION, RULES, Goals, growth, loss_against, pick_all


@pytest.fixture(scope="module")
def two():
    return front(bowls(2), LOWER, UPPER, population=60, generations=80, baseline=[0.7, 0.4, 0.1])


@pytest.fixture(scope="module")
def three():
    return front(bowls(3), LOWER, UPPER, population=100, generations=100)


def test_pareto_set_of_two_bowls_is_the_line_between_their_bottoms(two):
    assert np.abs(two.points[:, 1:]).max() < 0.05
    assert two.points[:, 0].min() == pytest.approx(0, abs=0.01)
    assert two.points[:, 0].max() == pytest.approx(1, abs=0.01)


def test_hypervolume_of_two_bowls_against_the_exact_front(two):
    line = np.linspace(0, 1, 4001)[:, None] * [1.0, 0.0, 0.0]
    exact = bowls(2)(line)
    assert hypervolume(two.values, np.zeros(2), np.ones(2)) >= 0.99 * hypervolume(exact, np.zeros(2), np.ones(2))
    # f2 = (1 - sqrt(f1))^2 leaves 1/6 of the unit square below the front.
    assert hypervolume(exact, np.zeros(2), np.ones(2)) == pytest.approx(1.21 - 1 / 6, abs=1e-3)


def test_volumes_of_a_search_of_five_goals_grow_to_that_of_its_front():
    """Those counted at levels are the exact ones within a percent; the last is exact."""
    random = np.random.default_rng(1)
    sphere = np.abs(random.standard_normal((240, 5)))
    costs = 1.0 - sphere / np.linalg.norm(sphere, axis=1, keepdims=True)
    archives, ends = [costs[:count] for count in (20, 60, 120, 240)], (costs.min(axis=0), costs.max(axis=0))
    exact = [hypervolume(archive, *ends) for archive in archives]
    volumes = growth(archives, *ends)
    assert volumes[-1] == exact[-1]
    assert volumes == pytest.approx(exact, rel=0.02)
    pair = [archive[:, :2] for archive in archives]
    assert growth(pair, *(end[:2] for end in ends))[0] == hypervolume(pair[0], *(end[:2] for end in ends))


def test_hypervolume_of_three_bowls_against_the_exact_front(three):
    u, v = (axis.ravel() for axis in np.meshgrid(*[np.linspace(0, 1, 101)] * 2))
    inside = u + v <= 1
    exact = bowls(3)(np.stack([u[inside], v[inside], 0 * u[inside]], axis=1))
    assert three.hypervolume >= 0.99 * hypervolume(exact, three.ideal, three.nadir)


def test_archive_is_non_dominated_and_bounds_the_thinned_front(three):
    assert three.archive_size > len(three.values) == 200
    assert len(non_dominated(three.values)) == 200
    assert three.values.min(axis=0) == pytest.approx(three.ideal, abs=0)
    assert three.values.max(axis=0) == pytest.approx(three.nadir, abs=0)
    assert (np.diff(three.values[:, 0]) >= 0).all()
    assert bowls(3)(three.points) == pytest.approx(three.values, abs=0)
    assert three.evaluations == 100 * 100


def test_thinning_spreads_the_points(two):
    gaps = np.linalg.norm(np.diff(two.values, axis=0), axis=1)
    assert gaps.max() < 10 * np.median(gaps)


def test_hypervolume_history_never_falls(three):
    assert len(three.hypervolume_history) == 100
    assert (np.diff(three.hypervolume_history) >= -1e-12).all()
    assert three.hypervolume_history[-1] == pytest.approx(three.hypervolume)
    assert hypervolume(three.values, three.ideal, three.nadir) <= three.hypervolume


def test_same_seed_same_bits():
    runs = [front(bowls(2), LOWER, UPPER, population=20, generations=15, seed=seed) for seed in (5, 5, 6)]
    assert np.array_equal(runs[0].points, runs[1].points)
    assert runs[0].hypervolume == runs[1].hypervolume
    assert not np.array_equal(runs[0].points, runs[2].points)


def test_pick_dominates_the_baseline(two):
    pick = two.values[two.pick]
    assert (pick <= two.baseline_values).all()
    assert (pick < two.baseline_values).any()
    better = (two.values <= two.baseline_values).all(axis=1)
    assert knee_depth(two.values)[two.pick] == knee_depth(two.values)[better].max()
    assert "beat the baseline in every response" in two.pick_reason


def test_pick_is_the_knee_without_a_baseline_or_above_it(three):
    assert three.pick == three.knee
    assert "without a baseline" in three.pick_reason
    best = front(bowls(2), LOWER, UPPER, population=20, generations=10, baseline=[0.5, 0.0, 0.0])
    assert best.pick == best.knee
    assert "no point beats it in every response" in best.pick_reason


def quarter(count):
    """Costs of the exact front f2 = (1 - sqrt(f1))^2, evenly along the line between the bottoms."""
    return bowls(2)(np.linspace(0, 1, count)[:, None] * [1.0, 0.0, 0.0])


@pytest.mark.parametrize("share", [0.1, 0.25, 0.5, 0.75, 0.9])
def test_a_baseline_that_the_front_just_misses_loses_no_more_than_the_concession(share):
    """The knee lies at 0.5: with a baseline elsewhere on the front, it would lose up to 0.16 of a range."""
    costs, goals = quarter(2001), Goals.of(["min", "min"])
    on_front = np.array([share**2, (1 - share) ** 2])
    just_within, just_beyond = (pick_all(costs, goals, on_front + shift)[0] for shift in (1e-6, -1e-6))
    for rule in RULES:
        assert (costs[just_within[rule]] <= on_front + 1e-6).all()
        lost = costs[just_beyond[rule]] - on_front
        assert lost.max() <= CONCESSION + 1e-3
        # A convex front gives at least as much as it takes; at the knee itself nothing is to be had.
        assert -lost.min() >= lost.max() or share == 0.5


def test_what_no_point_avoids_decides_nothing():
    """Where the front does not reach the baseline in one response, the others are still judged."""
    costs = np.array([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]])
    assert loss_against(costs, np.array([-9.0, 0.4])) == pytest.approx([0.6, 0.5, 1.0])
    assert loss_against(costs, np.array([0.6, 9.0])) == pytest.approx([0.0, 0.0, 0.4])
    level = np.column_stack([costs, np.full(3, 7.0)])
    assert loss_against(level, np.array([0.6, 9.0, 1.0])) == pytest.approx([0.0, 0.0, 0.4])


def test_knee_of_two_bowls_is_halfway(two):
    # The deepest point of f2 = (1 - sqrt(f1))^2 below the line f1 + f2 = 1 has f1 = f2.
    assert two.points[two.knee, 0] == pytest.approx(0.5, abs=0.02)


def test_knee_of_a_corner_and_of_degenerate_fronts():
    assert knee_depth(np.array([[0.0, 10.0], [1.0, 1.0], [10.0, 0.0]])).argmax() == 1
    assert knee_depth(np.array([[3.0, 4.0]])).tolist() == pytest.approx([2**-0.5])
    assert np.isfinite(knee_depth(np.array([[0.0, 1.0, 5.0], [1.0, 0.0, 5.0]]))).all()


def test_non_dominated_drops_repeats_and_weakly_dominated():
    values = np.array([[2.0, 0.0], [0.0, 1.0], [0.0, 2.0], [1.0, 0.0], [1.0, 0.0]])
    assert non_dominated(values).tolist() == [1, 3]


def test_non_dominated_agrees_with_the_definition_on_many_points():
    values = np.random.default_rng(1).random((20000, 3)) ** 2
    rows = non_dominated(values)
    kept = values[rows]
    for row in np.random.default_rng(2).integers(0, 20000, 300):
        beaten = ((kept <= values[row]).all(axis=1) & (kept < values[row]).any(axis=1)).any()
        assert beaten == (row not in rows)


def test_agreeing_objectives_leave_one_point():
    only = front(lambda x: np.column_stack([x[:, 0], 2 * x[:, 0]]), [0.0], [1.0], population=10, generations=5)
    assert only.values.shape == (1, 2)
    assert only.knee == only.pick == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lower": [0.0, 2.0, 0.0]}, "factor 2: lower bound 2 must be below upper bound 2"),
        ({"upper": [1.0, np.inf, 1.0]}, "finite"),
        ({"upper": [1.0]}, "equally long"),
        ({"population": 1}, "population = 1: must be at least 4"),
        ({"generations": 0}, "generations = 0: must be at least 1"),
        ({"keep": 1}, "keep = 1: must be at least 2"),
        ({"baseline": [0.0]}, "baseline"),
        ({"objectives": lambda x: x[:, :1]}, "at least two objectives"),
        ({"objectives": lambda x: np.where(x > 0.5, np.nan, x)[:, :2]}, "objective 1 is"),
    ],
)
def test_bad_input_is_refused_with_the_mend(change, words):
    arguments = {"objectives": bowls(2), "lower": [-1.0] * 3, "upper": UPPER} | change
    with pytest.raises(ValueError, match=words):
        front(**arguments)


def test_hypervolume_of_noisy_points_is_corrected_for_luck():
    line = np.linspace(0, 1, 15)[:, None] * [1.0, 0.0, 0.0]
    exact, errors = bowls(2)(line), np.full((15, 2), 0.05)
    random, scale = np.random.default_rng(3), (np.zeros(2), np.ones(2))
    drawn = [exact + errors * random.standard_normal(exact.shape) for _ in range(40)]
    believed = np.mean([hypervolume(costs, *scale) for costs in drawn])
    volumes, stated = zip(*(noisy_hypervolume(costs, errors, *scale, draws=60) for costs in drawn), strict=True)
    truth = hypervolume(exact, *scale)
    assert abs(np.mean(volumes) - truth) < 0.5 * abs(believed - truth)
    # A spread from 40 draws has an error of 11 %: three of these.
    assert np.std(volumes) == pytest.approx(np.mean(stated), rel=0.33)
