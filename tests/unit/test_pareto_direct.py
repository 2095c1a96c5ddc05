"""The front of a noisy simulator: dominance under noise, honest ends, failures, what a surrogate loses."""

from dataclasses import replace

import numpy as np
import pytest
from direct_search import compare_with_surrogate, direct_front, dominance, error_aware_dominance, order, ranks
from pareto_cases import LOWER, UPPER, bowls, noisy_bowls

from doe.pareto import Goals, front, hypervolume
from doe.pareto.front import noisy_hypervolume

GOALS = Goals.of(["min", "min"])
BUDGET = {"evaluations": 800, "population": 40, "baseline": [0.7, 0.4, 0.1]}
NOISE = 0.2


def true_volume(points):
    return hypervolume(bowls(2)(points), np.zeros(2), np.ones(2))


@pytest.fixture(scope="module")
def found():
    """Fronts of several seeds."""
    return [direct_front(noisy_bowls(seed, NOISE), LOWER, UPPER, goals=GOALS, seed=seed, **BUDGET) for seed in range(8)]


def scores(fronts, of):
    """How many standard errors each response is too large, of the values and errors that ``of`` takes from a front."""
    parts = []
    for each in fronts:
        values, errors = of(each)
        parts.append((values - bowls(2)(each.points)) / errors)
    return np.vstack(parts).ravel()


def as_searched(front):
    """What the search itself saw at the points of a front."""
    rows = [int(np.flatnonzero((front.searched.points == point).all(axis=1))[0]) for point in front.points]
    return front.searched.values[rows], NOISE


def test_what_is_reported_is_unbiased_and_what_was_searched_is_not(found):
    reported, searched = scores(found, lambda each: (each.values, each.standard_errors)), scores(found, as_searched)
    assert abs(reported.mean()) < 3.0 / np.sqrt(reported.size)
    assert reported.std() == pytest.approx(1.0, abs=3.0 / np.sqrt(2 * reported.size))
    assert searched.mean() < -0.8
    assert all((each.optimism > 0.0).any() for each in found)


def test_budget_is_never_exceeded_and_the_front_is_in_order(found):
    for each in found:
        assert 0.9 * BUDGET["evaluations"] < each.evaluations <= BUDGET["evaluations"]
        assert each.repeats >= 4 and 0 <= each.pick < len(each.points)
        assert each.values.shape == each.standard_errors.shape == (len(each.points), 2)


def believed(run):
    """Values taken at their word."""
    return lambda points: run(points)[0]


def test_finds_more_than_a_search_that_believes_its_luck(found):
    believing = [
        front(
            believed(noisy_bowls(100 + seed, NOISE)),
            LOWER,
            UPPER,
            population=40,
            generations=20,
            seed=seed,
            keep=len(each.points),
        )
        for seed, each in enumerate(found)
    ]
    ours, theirs = (np.mean([true_volume(each.points) for each in fronts]) for fronts in (found, believing))
    assert ours > theirs
    # And it believes in what is not there: its costs are the lucky ones.
    luck = np.mean([(each.costs - bowls(2)(each.points)).mean() / NOISE for each in believing])
    assert luck < -1.0


def test_same_seed_and_runs_give_the_same_bits(found):
    again = direct_front(noisy_bowls(3, NOISE), LOWER, UPPER, goals=GOALS, seed=3, **BUDGET)
    assert np.array_equal(again.points, found[3].points)
    assert np.array_equal(again.values, found[3].values)


def test_failed_points_are_kept_apart():
    each = direct_front(noisy_bowls(1, 0.05, failing=True), LOWER, UPPER, goals=GOALS, seed=1, **BUDGET)
    assert len(each.failures) > 10 and (each.failures[:, 2] > 0.5).all()
    assert (each.points[:, 2] <= 0.5).all() and np.isfinite(each.values).all()
    with pytest.raises(ValueError, match="every run failed"):
        direct_front(lambda points: (np.full((len(points), 2), np.nan),) * 2, LOWER, UPPER, goals=GOALS, **BUDGET)


def test_limits_hold_in_the_direct_front():
    goals = Goals.of(["min", "min"], upper=[0.25, None])
    each = direct_front(noisy_bowls(1, 0.01), LOWER, UPPER, goals=goals, seed=1, **BUDGET)
    assert (each.values[:, 0] < 0.25 + 3 * each.standard_errors[:, 0]).all()
    assert each.points[:, 0].max() > 0.3


def test_dominance_beyond_errors_needs_every_cost():
    costs = np.array([[0.0, 0.0], [1.0, 1.0], [3.0, 0.1]])
    none, some = np.zeros((3, 2)), np.full((3, 2), 0.3)
    assert error_aware_dominance(costs, none, 0.95).tolist() == dominance(costs).tolist()
    # 1.645 times 0.3 sqrt 2 is 0.698: only the first is better than the second in both by more.
    expected = np.zeros((3, 3), dtype=bool)
    expected[0, 1] = True
    assert error_aware_dominance(costs, some, 0.95).tolist() == expected.tolist()
    assert not error_aware_dominance(costs, 10 * some, 0.95).any()


def test_places_go_by_errors_first_and_by_means_then():
    costs = np.array([[0.0, 0.0], [0.1, 0.1], [5.0, 5.0]])
    assert order(costs, np.full((3, 2), 0.3), 0.95).tolist() == [0, 1, 2]
    assert ranks(error_aware_dominance(costs, np.full((3, 2), 0.3), 0.95)).tolist() == [0, 0, 1]
    assert ranks(np.array([[False, True], [True, False]])).tolist() == [0, 0]


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


def test_surrogate_that_stops_short_loses_what_it_misses(found):
    direct = replace(found[0], costs=bowls(2)(np.linspace(0, 1, 21)[:, None] * [1.0, 0.0, 0.0]))
    direct = replace(direct, cost_errors=np.full(direct.costs.shape, 0.002))
    half = direct.costs[:11]
    errors = np.full(half.shape, 0.002)
    loss = compare_with_surrogate(direct, half, errors)
    ideal, nadir = np.zeros(2), np.ones(2)
    exact = 100.0 * (1.0 - hypervolume(half, ideal, nadir) / hypervolume(direct.costs, ideal, nadir))
    assert loss.loss_percent == pytest.approx(exact, abs=2.0 * loss.loss_error_percent)
    assert loss.loss_percent > loss.loss_error_percent and loss.sentence.startswith("Loss of the surfaces: +")
    same = compare_with_surrogate(direct, direct.costs, np.full(direct.costs.shape, 0.05))
    assert "not significant" in same.sentence
    with pytest.raises(ValueError, match="every run at the surrogate's points failed"):
        compare_with_surrogate(direct, np.full((2, 2), np.nan), np.ones((2, 2)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"evaluations": 100}, "at least five populations"),
        ({"resample": 1.0}, "must be in"),
        ({"upper": LOWER}, "below"),
    ],
)
def test_bad_settings_are_refused(change, words):
    arguments = {"lower": LOWER, "upper": UPPER, "goals": GOALS, **BUDGET} | change
    with pytest.raises(ValueError, match=words):
        direct_front(noisy_bowls(1, NOISE), **arguments)
