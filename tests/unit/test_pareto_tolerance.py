"""Tolerances: exact ranges of quadratics, quantiles, tolerance-aware fronts, widest tolerances by closed forms."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from doe.pareto import Goals, front
from doe.pareto.manufacture import Quadratic, ToleranceBox, even_offsets, offsets, random_offsets, tolerance_aware_front
from doe.pareto.search import Archive
from doe.pareto.tolerance import RIM, Parts

BOX = {"lower": np.full(2, -10.0), "upper": np.full(2, 10.0)}


def some_quadratic(seed, factors):
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(factors, factors))
    return Quadratic(1.0, random.normal(size=factors), (matrix + matrix.T) / 2)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), factors=st.integers(1, 3))
def test_range_over_a_box_is_that_of_brute_force(seed, factors):
    surface, half = some_quadratic(seed, factors), np.linspace(0.3, 1.2, factors)
    centre = np.random.default_rng(seed).normal(size=(1, factors))
    low, high = surface.range_over_box(centre, half)
    axes = [np.linspace(-width, width, 41) for width in half]
    values = surface.predict(centre + np.array(list(product(*axes))))
    # Nothing on the grid goes beyond, and the grid comes as near as its spacing lets it.
    slack = np.abs(surface.matrix).sum() * (half.max() / 20) ** 2
    assert low[0] <= values.min() + 1e-9 and values.min() - low[0] <= slack
    assert high[0] >= values.max() - 1e-9 and high[0] - values.max() <= slack


def test_range_with_many_factors_holds_all_parts():
    for seed in range(5):
        surface, half = some_quadratic(seed, 6), np.full(6, 0.8)
        centre = np.zeros((1, 6))
        low, high = surface.range_over_box(centre, half)
        parts = surface.around(centre, np.random.default_rng(seed).uniform(-0.8, 0.8, (20000, 6)))
        assert low[0] < parts.min() and parts.max() < high[0]


def test_factor_without_tolerance_stays_where_it_is():
    surface = some_quadratic(3, 3)
    point = np.array([[0.2, -0.4, 0.6]])
    low, high = surface.range_over_box(point, np.zeros(3))
    assert low[0] == high[0] == pytest.approx(surface.predict(point)[0])


def test_values_around_a_point_are_those_at_the_sums():
    surface = some_quadratic(4, 3)
    centres, shifts = np.random.default_rng(1).normal(size=(2, 5, 3))
    sums = centres[:, None, :] + shifts[None, :, :]
    assert surface.around(centres, shifts) == pytest.approx(surface.predict(sums), rel=1e-12)


def test_link_turns_the_range_with_it():
    falling = Quadratic(4.0, np.array([1.0]), np.zeros((1, 1)), lambda value: 1.0 / value)
    low, high = falling.range_over_box(np.zeros((1, 1)), np.ones(1))
    assert (low[0], high[0]) == pytest.approx((1 / 5, 1 / 3))


def test_parts_have_the_documented_distribution():
    shares = np.array([0.5, 1.0 - 1e-12])
    assert offsets(shares, "normal") == pytest.approx([0.0, 1.0], abs=1e-6)
    assert offsets(np.array([0.25]), "uniform") == pytest.approx([-0.5])
    for sample in (even_offsets(1024, 3, "normal"), random_offsets(20000, 3, "normal", 1)):
        # Six standard deviations, the ends cut off: 0.986578 of the standard deviation is left.
        assert sample.std(axis=0) == pytest.approx(0.986578 / 3, rel=0.02)
        assert np.abs(sample).max() <= 1.0
    assert np.array_equal(even_offsets(64, 2, "uniform"), even_offsets(64, 2, "uniform"))


@pytest.mark.parametrize("distribution", ["normal", "uniform"])
def test_quantile_of_parts_is_that_of_brute_force(distribution):
    surfaces, goals = [some_quadratic(1, 3), some_quadratic(2, 3)], Goals.of(["min", "max"])
    box = ToleranceBox(np.array([0.3, 0.5, 0.2]), "quantile", 0.95, distribution, 1024)
    points = np.random.default_rng(5).normal(size=(4, 3))
    costs = box.judge(surfaces, goals, points).costs
    many = box.half * random_offsets(100_000, 3, distribution, 1)
    brute = np.column_stack(
        [
            np.quantile(sign * surface.around(points, many), 0.95, axis=1)
            for sign, surface in zip((1, -1), surfaces, strict=True)
        ]
    )
    assert costs == pytest.approx(brute, abs=0.015 * np.ptp(brute))


# A sharp valley on the left and a flat one on the right: x from -1 to 1 in the first factor, both minimised.
SHARP = Quadratic(0.0, np.array([0.0, 0.0]), np.diag([1.0, 1.0]))
SHIFTED = Quadratic(1.0, np.array([-2.0, 0.0]), np.diag([1.0, 8.0]))


def robust(box, **settings):
    goals = Goals.of(["min", "min"])
    plain = front(
        lambda points: np.column_stack([SHARP.predict(points), SHIFTED.predict(points)]),
        [-2.0, -2.0],
        [2.0, 2.0],
        population=40,
        generations=30,
        baseline=[0.5, 0.4],
    )
    return tolerance_aware_front(
        [SHARP, SHIFTED],
        box,
        np.array([-2.0, -2.0]),
        np.array([2.0, 2.0]),
        goals,
        baseline=np.array([0.5, 0.4]),
        plain=Archive(plain.points, plain.costs),
        plain_pick=plain.pick,
        population=40,
        generations=30,
        **settings,
    )


def test_worst_case_front_of_two_bowls_is_known():
    # Over +- h, (|x| + h)^2 + h^2 and (|1 - x| + h)^2 + 8 h^2 are worst; the front is still the line from 0 to 1.
    half = 0.05
    found = robust(ToleranceBox(np.full(2, half)))
    x = found.points[:, 0]
    assert np.abs(found.points[:, 1]).max() < 0.05
    assert x.min() == pytest.approx(0.0, abs=0.01) and x.max() == pytest.approx(1.0, abs=0.01)
    middle = np.abs(found.points[:, 1])
    exact = np.column_stack(
        [(np.abs(x) + half) ** 2 + (middle + half) ** 2, (np.abs(1 - x) + half) ** 2 + 8 * (middle + half) ** 2]
    )
    assert found.costs == pytest.approx(exact, abs=1e-12)
    assert found.survival.pick == 1.0 and "at the ends of their tolerances" in found.pick_reason
    assert found.costs[found.pick] == pytest.approx(exact[found.pick])


def test_no_tolerance_costs_nothing():
    found = robust(ToleranceBox(np.full(2, 1e-9)))
    assert found.nominal_loss_percent == pytest.approx(0.0, abs=0.1)
    assert found.robust_gain_percent == pytest.approx(0.0, abs=0.1)


def test_wide_tolerances_cost_and_parts_fail():
    found = robust(ToleranceBox(np.full(2, 0.6), "quantile"))
    assert found.survival.plain_pick < 0.9
    assert found.survival.pick >= found.survival.plain_pick - 3 * found.survival.standard_error
    assert (np.abs(found.points) <= 2.0).all()


def falling(**settings):
    """The front of two costs that fall with x, searched from -1 to 1 with a tolerance of 0.1."""
    surfaces = [Quadratic(0.0, np.array([slope, 0.0]), np.diag([0.0, 1.0])) for slope in (-1.0, -2.0)]
    points = np.array([[1.0, 0.0], [0.9, 0.0]])
    return tolerance_aware_front(
        surfaces,
        ToleranceBox(np.full(2, 0.1)),
        np.full(2, -1.0),
        np.full(2, 1.0),
        Goals.of(["min", "min"]),
        baseline=np.zeros(2),
        plain=Archive(points, np.column_stack([surface.predict(points) for surface in surfaces])),
        plain_pick=0,
        population=40,
        generations=30,
        **settings,
    )


def test_designs_reach_the_bounds_of_the_region_and_parts_lie_beyond():
    found = falling()
    assert found.points[:, 0] == pytest.approx(1.0, abs=1e-3)
    # The worst part is a tolerance short of the bound in x, and a tolerance off in y.
    assert found.plain_pick_costs == pytest.approx([-0.9 + 0.01, -1.8 + 0.01])


def test_no_part_lies_where_points_are_barred():
    found = falling(barred=lambda points: points[:, 0] - 0.5)
    assert found.points[:, 0] == pytest.approx(0.4, abs=1e-3)
    assert found.points[:, 0].max() <= 0.4


def first_factor(points):
    return points[:, :1]


def widest(objectives, pick, limits, ratios, **options):
    """The widest tolerances about a pick."""
    parts = Parts(objectives=objectives, centre=np.array(pick), limits=np.array(limits), **options)
    return parts.widest(np.array(ratios))


@pytest.mark.parametrize("distribution", ["uniform", "normal"])
def test_widest_tolerance_of_one_linear_limit_is_the_closed_form(distribution):
    # Parts at h u keep the limit 1 while u <= 1/h: at 95 % for a uniform u where 1/h = 0.9.
    found = widest(
        first_factor, [0.0, 0.0], [1.0], [1.0, 1.0], names=["x"], distribution=distribution, samples=40000, **BOX
    )
    outside = norm.cdf(-3)
    at = 0.9 if distribution == "uniform" else norm.ppf(outside + 0.95 * (1 - 2 * outside)) / 3
    assert found.half_widths == pytest.approx([1 / at] * 2, rel=0.02)
    assert found.probability == pytest.approx(0.95, abs=4 * found.standard_error)
    assert found.limited_by == "x" and not found.at_rim.any()


def test_ratios_are_kept_and_the_first_limit_is_named():
    found = widest(lambda points: points, [0.0, 0.0], [1.0, 1.0], [1.0, 3.0], names=["a", "b"], **BOX)
    assert found.half_widths[1] == pytest.approx(3 * found.half_widths[0])
    assert found.limited_by == "b"


def test_region_ends_what_no_limit_ends():
    found = widest(first_factor, [9.0, 0.0], [99.0], [1.0, 1.0], names=["x"], **BOX)
    assert found.half_widths.tolist() == [1.0, 10.0]
    assert found.limited_by == RIM and found.probability == 1.0
    assert "no run shows" in found.sentence


def test_pick_that_fails_or_just_keeps_leaves_no_tolerance():
    for at, words in ((1.1, "even the exact selected design"), (1.0, "as soon as parts differ")):
        found = widest(first_factor, [at, 0.0], [1.0], [1.0, 1.0], names=["x"], **BOX)
        assert found.half_widths.tolist() == [0.0, 0.0]
        assert words in found.sentence and found.limited_by == "x"


def test_uncertain_surfaces_leave_less():
    random = np.random.default_rng(1).normal(0.0, 0.3, (4096, 1))
    sure, unsure = (
        widest(lambda p, e=e: p[:, :1] + e, [0.0, 0.0], [1.0], [1.0, 1.0], names=["x"], **BOX) for e in (0.0, random)
    )
    assert 0.5 < unsure.half_widths[0] / sure.half_widths[0] < 0.95
