"""The adaptive search: its integral in closed form, greed without twins, goals, limits, when it stops, known fronts."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from coarse_search import coarsely
from known_fronts import box, first_runs, noisy, search
from scipy import special

from doe.adaptive import AdaptiveSearch, Batch, Border, Plan
from doe.adaptive.emulators import (
    Dominance,
    Region,
    Runs,
    batch,
    candidates,
    coordinates,
    dominated,
    fit_emulators,
    levels_of,
    proper_rows,
    shares_of,
)
from doe.adaptive.search import as_predicted, nothing_gained, residuals_of
from doe.pareto.search import Goals, InfeasibleError, best_for_hypervolume, hypervolume, spread

TWO = Goals.of(["min", "min"])
POINTS = np.random.default_rng(1).uniform(-1.0, 1.0, (24, 2))


@pytest.fixture
def coarse(monkeypatch):
    """Searches with few candidates and levels, where the quality of their front is not the subject."""
    coarsely(monkeypatch.setattr)


def bowls(points):
    """Squared distances to two points; the front is the line between them."""
    return np.column_stack([((points - 0.5) ** 2).sum(axis=1), ((points + 0.5) ** 2).sum(axis=1)])


def emulators(goals=TWO, noise=0.01):
    return fit_emulators(goals, first_runs(noisy(bowls, 3, noise), 2, 24, 1))


def test_volume_of_levels_not_dominated_is_the_hypervolume():
    front = np.column_stack([np.linspace(0.0, 1.0, 15), 1.0 - np.sqrt(np.linspace(0.0, 1.0, 15))])
    levels = levels_of(front, np.zeros(2), np.random.default_rng(1))
    dominance = Dominance(levels, dominated(front[None], np.ones((1, 15), dtype=bool), levels.costs))
    assert dominance.hypervolumes[0] == pytest.approx(hypervolume(front, np.zeros(2), np.ones(2)), rel=0.005)
    none = dominated(front[None], np.zeros((1, 15), dtype=bool), levels.costs)
    assert not none.any(), "points that break a limit dominate nothing"


def test_expected_gain_of_one_point_is_the_product_of_two_expected_gains():
    """Closed form: with nothing known, levels up to r gain E(r1 - y1)+ E(r2 - y2)+ of independent normals, as expected
    improvement has it (Jones, Schonlau and Welch 1998)."""
    found, at = emulators(), np.array([[0.1, -0.2]])
    means = found.predict(at)[0]
    wide = replace(found, by_response=[_Certain(means[0, j], 0.2) for j in range(2)], stretch=np.ones(2))
    levels = levels_of(np.array([[0.0, 2.0], [2.0, 0.0]]), np.array([-2.0, -2.0]), np.random.default_rng(1))
    _, gains = batch(wide, at, levels, np.ones(len(levels.costs)), 1, np.zeros(2))
    z = (levels.high - means[0]) / 0.2
    each = 0.2 * (z * special.ndtr(z) + np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi))
    assert gains[0] == pytest.approx(np.prod(each / 2.0), rel=0.02)


class _Certain:
    def __init__(self, mean, deviation):
        self.mean, self.deviation = mean, deviation

    def predict(self, points):
        return np.full(len(points), self.mean), np.full(len(points), self.deviation)

    def covariance(self, points, other):
        return np.full((len(points), len(other)), self.deviation**2)


@pytest.mark.parametrize(("kind", "target"), [("min", None), ("max", None), ("target", 0.4)])
def test_chance_below_a_level_is_that_of_drawn_costs(kind, target):
    goals = Goals.of([kind, "min"], target=[target, None])
    found, random = emulators(goals), np.random.default_rng(2)
    means, deviations = np.array([[0.3, 0.5]]), np.array([[0.2, 0.1]])
    drawn = goals.costs(means + deviations * random.standard_normal((200_000, 2)))
    levels = np.array([[-0.2, 0.6], [0.1, 0.5], [0.3, 0.45]])
    share = (drawn[:, None] <= levels).all(axis=-1).mean(axis=0)
    assert found.below(means, deviations, levels)[0] == pytest.approx(share, abs=0.005)


def test_a_batch_shares_out_the_levels_and_refuses_twins():
    found = emulators()
    points = np.vstack([np.zeros((5, 2)), [[0.004, 0.0]], np.linspace([-0.5, -0.5], [0.5, 0.5], 9)])
    costs = TWO.costs(found.predict(points)[0])
    levels = levels_of(costs, costs.min(axis=0), np.random.default_rng(1))
    rows, gains = batch(found, points, levels, np.ones(len(levels.costs)), 6, np.full(2, 0.01))
    assert len({tuple(np.round(points[row], 1)) for row in rows}) == 6
    assert (np.diff(gains) <= 1e-12).all()


def test_candidates_are_on_the_drawing_inside_and_no_run_again():
    found, random = emulators(), np.random.default_rng(1)
    region = box(2)._replace(finest=np.full(2, 0.1), low=np.array([-0.5, -0.5]), apart=np.full(2, 0.05))
    runs = np.round(found.runs.points, 1)
    points = candidates(found, region, random, runs)
    assert points == pytest.approx(np.round(points, 1), abs=1e-12)
    assert points.min() >= -0.5
    assert not region.twins(points, runs).any()
    assert len(points) > 100


def test_what_gains_next_to_nothing_for_much_is_no_front():
    """A flat end, where errors of 1e-3 buy any loss; a round front keeps all but its steepest ends."""
    flat = np.array([[0.0, 1.0], [0.5, 0.4], [1.0, 0.0], [-1e-3, 3.0], [-2e-3, 9.0]])
    assert set(proper_rows(flat)) == {0, 1, 2}
    angle = np.linspace(0.0, 0.5 * np.pi, 200)
    kept = proper_rows(-np.column_stack([np.cos(angle), np.sin(angle)]))
    assert 190 <= len(kept) < 200
    assert np.ptp(-np.cos(angle[kept])) > 0.96


def state(gained):
    measures = {"hypervolume": 1.0, "deviation": 0.04, "remaining": 0.1, "remaining_error": 0.05}
    return Batch(runs=20, gained=gained, why="improvement", **measures)


def test_three_batches_in_a_row_must_gain_nothing():
    idle, good = state(0.009), state(0.02)
    assert nothing_gained([good, idle, idle, idle], -1)
    assert not nothing_gained([idle, good, idle, idle], -1)
    assert not nothing_gained([idle, idle, idle], 0), "those before a failed check do not count"


def failing_bowls(seed):
    """The bowls, whose runs fail in a corner that holds an end of their front."""
    run = noisy(bowls, seed, 0.01)

    def evaluate(points, replicates):
        values, errors, freedom = run(points, replicates)
        return np.where(points.sum(axis=1, keepdims=True) > 0.4, np.nan, values), errors, freedom

    return evaluate


def searched(evaluate, seed, **more):
    """A search of 60 runs, 16 of them first ones."""
    zero, plan = np.zeros(2), Plan(60, seed=seed, least=1, most=1, usual=1)
    design = first_runs(evaluate, 2, 16, seed)
    return AdaptiveSearch(evaluate, zero, np.ones(2), box(2), design, TWO, plan, zero, **more)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_search_stays_away_from_where_its_runs_fail(coarse, seed):
    """Without that 11 to 14 of its 32 runs in batches failed, and 3 of the 11 at the finalists."""
    search = searched(failing_bowls(seed), seed)
    front = search.front().front
    assert (~search.runs.good[16:]).sum() <= 4
    assert len(front.points) == 11
    assert front.points.sum(axis=1).max() > 0.3, "it goes as near as runs go well"


def test_a_search_stays_away_from_points_that_were_lost_before_it(coarse):
    lost = np.array([[0.25, 0.25]])
    nearest = []
    for more in ({"lost": lost}, {}):
        search = searched(noisy(bowls, 1, 0.01), 1, **more)
        points = np.vstack([search.front().front.points, search.runs.points[16:]])
        nearest.append(np.linalg.norm(points - lost, axis=1).min())
    assert nearest[0] > 2.0 * nearest[1]


def test_fresh_runs_must_lie_where_they_were_predicted():
    found = emulators()
    points = np.random.default_rng(5).uniform(-0.5, 0.5, (8, 2))
    ones = np.ones(8, dtype=np.int64)
    fresh = Runs(points, *noisy(bowls, 9, 0.01)(points, ones), ones)
    assert as_predicted(found, fresh)
    assert not as_predicted(found, fresh._replace(values=fresh.values + 0.05))
    assert not as_predicted(found, fresh._replace(values=fresh.values * np.nan))
    assert residuals_of(found, fresh).std() < 2.0


def test_it_stops_before_the_budget_is_spent_only_when_the_front_is_found():
    found = search(bowls, 1, budget=150, first=12, factors=2, noise=0.005)
    assert "as predicted" in found.stopped
    assert len(found.spent) < 90
    assert found.history[-1].why == "check"
    mean = bowls(found.front.points).sum(axis=1)
    # On the line between the two centres the root distances add up to its length.
    assert np.sqrt(bowls(found.front.points)).sum(axis=1) == pytest.approx(np.full(len(mean), np.sqrt(2.0)), rel=0.02)


@pytest.fixture(scope="module")
def forty():
    """A coarse search with a budget of forty runs."""
    with pytest.MonkeyPatch.context() as patch:
        coarsely(patch.setattr)
        return search(bowls, 2, budget=40, first=12, factors=2)


@pytest.mark.usefixtures("coarse")
def test_same_seed_same_bits_and_the_budget_is_kept(forty):
    one, two = forty, search(bowls, 2, budget=40, first=12, factors=2)
    assert np.array_equal(one.front.points, two.front.points)
    assert np.array_equal(one.front.searched.values, two.front.searched.values)
    assert repr(one.history) == repr(two.history)
    assert len(one.spent) == 32
    assert one.fresh <= 8
    assert [each.runs for each in one.history] == [12, 20, 28, 32]


def test_reported_values_are_of_fresh_runs_alone(forty):
    assert not set(map(tuple, forty.front.values)) & set(map(tuple, forty.front.searched.values))
    assert forty.front.values == pytest.approx(bowls(forty.front.points), abs=0.1)


def test_a_limit_is_kept_and_the_front_ends_there():
    goals = Goals.of(["min", "min", "none"], upper=[None, None, 0.2])

    def function(points):
        return np.column_stack([bowls(points), points.sum(axis=1)])

    found = search(function, 1, budget=44, first=12, factors=2, goals=goals, noise=0.005)
    assert found.front.points.sum(axis=1).max() < 0.22
    assert found.front.points.sum(axis=1).max() > 0.1
    with pytest.raises(InfeasibleError) as error:
        search(
            function,
            1,
            budget=30,
            first=12,
            factors=2,
            goals=Goals.of(["min", "min", "none"], upper=[None, None, -5.0]),
        )
    assert error.value.point == pytest.approx([-1.0, -1.0], abs=0.1)
    assert error.value.violations[0] == pytest.approx(3.0, abs=0.2)


@pytest.mark.usefixtures("coarse")
def test_failed_runs_are_left_out_and_not_tried_again():
    def failing(points):
        values = bowls(points)
        values[points[:, 0] > 0.3] = np.nan
        return values

    found = search(failing, 4, budget=38, first=14, factors=2)
    assert found.front.searched.failed.any()
    assert np.isfinite(found.front.values).all()
    whole = found.front.searched.points
    assert len(np.unique(np.round(whole, 6), axis=0)) == len(whole)


def test_it_refuses_a_budget_without_room():
    with pytest.raises(ValueError, match=r"budget = 20: 16 runs of the design, a batch of 8 .* give at least 30"):
        search(bowls, 1, budget=20, factors=2)
    with pytest.raises(ValueError, match="only 0 runs went well"):
        search(lambda points: bowls(points) * np.nan, 1, budget=40, factors=2)


@pytest.mark.usefixtures("coarse")
def test_replicates_are_made_where_they_matter():
    """Far from all runs few suffice; where the emulator knows much, many."""
    asked = []

    def evaluate(points, replicates):
        asked.append(replicates)
        values, errors, freedom = noisy(bowls, 1, 0.05)(points, replicates)
        return values, errors, freedom

    design = first_runs(evaluate, 2, 12, 1)
    plan = Plan(60, least=2, most=16, usual=5)
    found = AdaptiveSearch(evaluate, np.zeros(2), np.ones(2), box(2), design, TWO, plan, np.zeros(2)).front()
    searched, fresh = asked[1 : len(found.history)], asked[len(found.history) :]
    spent = np.concatenate(searched)
    assert spent.min() >= 2
    assert spent.max() == 16
    assert np.mean(searched[0]) < np.mean(searched[-1])
    assert set(np.concatenate(fresh)) == {5}
    assert sum(map(len, fresh)) == plan.fresh and max(map(len, fresh)) <= plan.batch, "learnt a batch at a time"


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("levels", [2, 3])
def test_unit_a_region_of_few_points_is_searched_to_its_end(levels):
    """Unit: where every point that can be drawn was run, the search ends and reports the front of these few."""
    evaluate, zero = noisy(bowls, 1, 1e-6), np.zeros(2)
    spacing = 2.0 / (levels - 1)
    region = Region(-np.ones(2), np.ones(2), -np.ones(2), np.full(2, spacing), np.full(2, 0.5 * spacing))
    points = np.array([[x, y] for x in np.linspace(-1, 1, levels) for y in np.linspace(-1, 1, levels)])
    ones = np.ones(len(points), dtype=np.int64)
    design = Runs(points, *evaluate(points, ones), ones)
    plan = Plan(40, least=1, most=1, usual=1)
    found = AdaptiveSearch(evaluate, zero, np.ones(2), region, design, TWO, plan, zero).front()
    assert "no point is left" in found.stopped and len(found.front.points) >= 1
    assert region.twins(found.front.points, points).all()


def shifted(points):
    """Squared distances to two points outside the region."""
    return np.column_stack([((points - end) ** 2).sum(axis=1) for end in ([1.9, 0.4], [1.9, -0.4])])


def beyond(border, budget=70):
    evaluate = noisy(shifted, 1, 0.02)
    design, plan = first_runs(evaluate, 2, 12, 1), Plan(budget, least=1, most=1, usual=1)
    zero, one = np.zeros(2), np.ones(2)
    return AdaptiveSearch(evaluate, zero, one, box(2), design, TWO, plan, zero, border=border).front()


@pytest.mark.usefixtures("coarse")
def test_the_region_grows_where_the_front_goes_on_and_no_farther_than_allowed():
    asked = []
    wide = beyond(Border(np.array([-1.0, -1.0]), np.array([2.5, 1.0]), lambda corners: asked.append(corners) or True))
    face = wide.moves[0][0]
    assert (face.factor, face.side, face.position) == (0, 1, 1.0)
    assert wide.moves[0][1] == 2.0, "half of the range"
    assert asked[0].tolist() == [[-1.0, -1.0], [-1.0, 1.0], [2.0, -1.0], [2.0, 1.0]]
    assert 2.0 <= wide.region.high[0] <= 2.5 and wide.region.low.tolist() == [-1.0, -1.0]
    assert wide.why.count("extension") == 8 * len(wide.moves)
    assert wide.front.points[:, 0].mean() == pytest.approx(1.9, abs=0.1)
    close = beyond(Border(np.array([-1.0, -1.0]), np.array([1.3, 1.0]), lambda corners: True), budget=48)
    assert close.front.points[:, 0].max() <= 1.3
    assert {face.limited_by for face in close.faces} <= {"allowed"}


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(
    ("border", "limited_by"),
    [(None, "allowed"), (Border(-np.ones(2), np.full(2, 3.0), lambda corners: False), "scene")],
)
def test_what_limits_the_pick_is_stated(border, limited_by):
    found = beyond(border, budget=40)
    assert not found.moves and found.region.high.tolist() == [1.0, 1.0]
    face = next(face for face in found.faces if face.factor == 0)
    assert (face.side, face.limited_by) == (1, limited_by) and face.better > 0.9


def test_factors_that_are_never_near_zero_may_be_emulated_by_their_logarithms():
    """Shares of 4/10: from 6 to 14; the second passes zero, and the ends of the third are more than ten times apart."""
    centre, step, one = np.array([10.0, 1.0, 5.0, 0.0]), np.array([4.0, 3.0, 4.9, 1.0]), np.ones(4)
    shares = shares_of(centre, step, -one, one)
    assert shares == (0.4, 0.0, 0.0, 0.0)
    assert shares_of(-centre, step, -one, one) == (-0.4, 0.0, 0.0, 0.0)
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 4))
    at = coordinates(points, shares)
    assert at[:, 0] == pytest.approx(np.log((10.0 + 4.0 * points[:, 0]) / 10.0) / 0.4)
    assert np.array_equal(at[:, 1:], points[:, 1:])


def test_what_acts_by_its_logarithm_is_predicted_better_by_it():
    """Waves that are as long everywhere by the logarithm of a factor from 1 to 9, and others that are so by itself."""
    one, points = Goals.of(["min"]), np.linspace(-1.0, 1.0, 101)[:, None]

    def waves(at):
        return np.sin(3.0 * np.log(5.0 + 4.0 * at))

    errors = []
    for seed in range(1, 6):
        runs = first_runs(noisy(waves, seed, 0.01), 1, 20, seed)
        plain, warped = (fit_emulators(one, runs, shares=shares) for shares in ((), (0.8,)))
        assert (plain.shares, warped.shares) == (((),), ((0.8,),))
        errors.append([np.std(fitted.predict(points)[0] - waves(points)) for fitted in (plain, warped)])
    by_itself, by_logarithm = np.exp(np.mean(np.log(errors), axis=0))
    assert by_logarithm < 0.5 * by_itself
    even = first_runs(noisy(lambda at: np.sin(4.0 * at), 1, 0.01), 1, 20, 1)
    assert fit_emulators(one, even, shares=(0.8,)).shares == ((),)


def test_the_best_points_of_a_front_have_its_hypervolume():
    front = -np.abs(np.random.default_rng(1).standard_normal((3000, 3)))
    front = front / np.linalg.norm(front, axis=1, keepdims=True)
    ends = front.min(axis=0), front.max(axis=0)
    best, even = (hypervolume(front[rows(front, 20)], *ends) for rows in (best_for_hypervolume, spread))
    assert best > even
    few = front[:12]
    ends = few.min(axis=0), few.max(axis=0)
    every = max(hypervolume(few[list(rows)], *ends) for rows in combinations(range(12), 3))
    assert hypervolume(few[best_for_hypervolume(few, 3)], *ends) > 0.95 * every
