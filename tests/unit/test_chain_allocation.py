"""Allocation of tolerances: by cost, for a yield, in grades and at positions; fits given by a code."""

import re
from math import sqrt

import numpy as np
import pytest
from chains import by_name, chain, with_functions
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.special import ndtri
from synthetic_study import summary

from doe.dimension_chain import grade_tolerances, solve
from doe.dimension_chain.allocation import cheapest, total_cost
from doe.dimension_chain.closing import total
from doe.dimension_chain.links import Cost
from doe.report.page import sections
from doe.report.sections.chain import chain_blocks
from doe.report.summary import Summary
from rbdyn.base import terminal
from rbdyn.base.blocks import Detail
from rbdyn.base.faults import InputError
from rbdyn.base.terminal import text


def costly(coefficient, nominal, b, k=1.0, **limits):
    return (coefficient, nominal, {"cost": {"b": b, "k": k} | limits})


def test_worst_case_optimum_of_reciprocal_costs():
    # With b/T the tolerances go as the root of b/|c|.
    widths = cheapest([Cost(b=4.0), Cost(b=1.0)], [1.0, -1.0], 0.03, "worst_case")
    assert widths == pytest.approx([0.02, 0.01])
    assert total_cost([Cost(a=1.0, b=4.0), Cost(b=1.0)], widths) == pytest.approx(1 + 200 + 100)


def test_root_sum_square_optimum_of_reciprocal_squared_costs():
    # With b/T^2 the tolerances go as the fourth root of b (Spotts 1973).
    widths = cheapest([Cost(b=16.0, k=2.0), Cost(b=1.0, k=2.0)], [1.0, 1.0], 0.05, "rss")
    assert widths == pytest.approx([0.1 / sqrt(5), 0.05 / sqrt(5)])


curves = st.builds(Cost, a=st.just(0.5), b=st.floats(0.1, 5), k=st.floats(0.3, 3))
slopes = st.floats(0.2, 3).flatmap(lambda size: st.sampled_from([size, -size]))


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(curves, slopes), min_size=2, max_size=5),
    st.sampled_from(["worst_case", "rss"]),
    st.integers(0, 2**16),
)
def test_no_other_tolerances_of_the_same_width_are_cheaper(links, mode, seed):
    costs, coefficients = zip(*links, strict=True)
    widths = np.array(cheapest(costs, coefficients, 0.1, mode))
    assert total([abs(c) * t for c, t in zip(coefficients, widths, strict=True)], mode) == pytest.approx(0.1)
    other = widths * np.random.default_rng(seed).uniform(0.8, 1.2, len(widths))
    other *= 0.1 / total([abs(c) * t for c, t in zip(coefficients, other, strict=True)], mode)
    assert total_cost(costs, other) >= total_cost(costs, widths) * (1 - 1e-9)


def test_a_general_optimiser_finds_the_same_with_process_limits():
    costs = [Cost(b=1.0, k=0.5), Cost(b=0.3, k=1.2), Cost(b=0.02, k=0.8, narrowest_mm=0.015)]
    coefficients = [1.0, -0.79, 2.0]
    widths = cheapest(costs, coefficients, 0.12, "worst_case")
    found = minimize(
        lambda t: total_cost(costs, t),
        [0.02, 0.018, 0.02],
        bounds=[(1e-4, None), (1e-4, None), (0.015, None)],
        constraints={"type": "eq", "fun": lambda t: 100 * (np.abs(coefficients) @ t - 0.12)},
        options={"ftol": 1e-12, "maxiter": 500},
    )
    assert widths == pytest.approx(found.x, rel=1e-3)


def test_narrowest_processes_that_fill_too_much_are_refused():
    links = [costly(1, 9.0, 1.0, narrowest_mm=0.03), costly(-1, 8.0, 1.0, narrowest_mm=0.03)]
    result = solve(chain(links, (0.9, 0.95), method="cost"), samples=10)
    assert "narrowest tolerances of the cost curves fill 0.0600 mm of 0.0500 mm" in result.status and result.refused


@pytest.mark.parametrize("mode", ["worst_case", "rss"])
def test_cost_allocation_beats_the_others_and_tells_its_cost(mode):
    links = [costly(1, 30.0, 0.5, 0.7), costly(-1, 10.0, 0.02, 0.4), costly(-1, 19.9, 0.1, 1.0)]
    results = {
        method: solve(chain(links, (0.05, 0.15), method=method, mode=mode), samples=10)
        for method in ("cost", "equal", "iso286")
    }
    assert results["cost"].cost < min(results["equal"].cost, results["iso286"].cost)
    interval = results["cost"].worst_case_mm if mode == "worst_case" else results["cost"].rss_mm
    assert interval == pytest.approx((0.05, 0.15))


def test_a_yield_of_equal_normal_parts_follows_the_normal_law():
    links, target = [(1, 9.0), (-1, 8.0)], 0.99
    result = solve(chain(links, (0.9, 1.1), mode="yield", target_yield=target), samples=100)
    # Reach of 0.1 mm at the quantile of 0.995: sigma of the closing link is T sqrt(2)/6.
    width = 6 / sqrt(2) * 0.1 / ndtri(0.995)
    assert [part.tolerance_mm for part in result.allocation] == pytest.approx([width, width], rel=1e-6)
    assert result.exact_yields["as_given"] == pytest.approx(target, abs=1e-7)
    assert sum(result.worst_case_mm) / 2 == pytest.approx(1.0)


def test_tolerances_for_a_yield_lie_between_those_of_no_and_of_all_failures():
    links = [(1, 9.0, {"distribution": "uniform"}), (-1, 8.0, {"distribution": "triangular"})]
    widths = [
        solve(chain(links, (0.9, 1.1), mode="yield", target_yield=target), samples=10).allocation[0].tolerance_mm
        for target in (0.999999, 0.99, 0.9)
    ]
    assert 0.1 < widths[0] < widths[1] < widths[2]


def test_a_yield_through_a_press_fit_is_kept():
    fixed = {"fixed": True}
    links = [(1, 34.65), (-1, 34.5), (0, 27.0, 0.006, 0.0, fixed), (0, 27.0, 0.0, -0.006, fixed)]
    fit = {"name": "fit", "coefficient": -1, "press_fit": {"shaft": "c", "bore": "d", "raceway_mm": 34.5}}
    wish = {"mode": "yield", "target_yield": 0.99, "resolution_mm": 0.0}
    result = solve(with_functions(chain(links, (0.12, 0.15)), fit, allocate=wish), samples=200_000)
    assert 0.99 - 3 * result.standard_errors["as_given"] < result.yields["as_given"] < 0.993
    assert result.status.startswith("ok")


def test_given_deviations_are_judged_by_the_yield():
    links = [(1, 9.0, 0.03, -0.03), (-1, 8.0, 0.03, -0.03)]
    good = solve(chain(links, (0.96, 1.04), mode="yield", target_yield=0.99), samples=1000)
    assert good.status == "ok"
    bad = solve(chain(links, (0.97, 1.03), mode="yield", target_yield=0.99), samples=1000)
    assert "yield 0.9" in bad.status and " of 0.99; the nearest" in bad.status
    assert "the nearest that fits is a " in bad.status


@pytest.mark.parametrize(
    ("mode", "moved"),
    # 1.000 +- 0.024 beside 0.993 to 1.043 in worst case, +- 0.012 sqrt(2) by root sum square: the least moves in steps of 0.001.
    [("worst_case", 0.017), ("rss", 0.010)],
)
def test_stated_tolerances_that_fit_stay_and_one_nominal_moves_as_little_as_it_must(mode, moved):
    links, limits = [(1, 9.0, 0.012, -0.012), (-1, 8.0, 0.012, -0.012)], (0.993, 1.043)
    rule = {"mode": mode, "resolution_mm": 0.001}
    result = solve(chain(links, limits, **rule), samples=1000)
    assert result.refused
    first, second = result.allocation
    assert first.nominal_mm == pytest.approx(9.0 + moved) and first.moved_mm == pytest.approx(moved)
    assert (first.upper_mm, first.lower_mm) == (0.012, -0.012)
    assert (second.nominal_mm, second.upper_mm, second.lower_mm) == (8.0, 0.012, -0.012)
    assert result.status.endswith(f"the nearest that fits is a {9.0 + moved:.3f} +0.012/-0.012")
    again = solve(chain([(1, 9.0 + moved, 0.012, -0.012), links[1]], limits, **rule), samples=1000)
    less = solve(chain([(1, 8.999 + moved, 0.012, -0.012), links[1]], limits, **rule), samples=1000)
    assert again.status == "ok" and less.refused


def test_tolerances_too_wide_for_any_nominal_are_allocated_anew():
    links = [(1, 9.0, 0.03, -0.03), (-1, 8.0, 0.03, -0.03)]
    result = solve(chain(links, (0.96, 1.04)), samples=1000)
    assert result.refused and all(part.tolerance_mm < 0.06 for part in result.allocation)


def test_symmetric_parts_keep_the_closing_link_in_the_middle_where_grades_leave_room():
    """IT9 and IT10 take 0.194 of 0.2026 mm: the guide clearance that a study selected stays the mean, as many parts lie below as above."""
    links = [(1, 70.333, {"position": "symmetric"}), (-1, 70.073, {"position": "symmetric"})]
    rule = {"method": "iso286", "grades": True, "spend_slack": True, "adjust": "b", "resolution_mm": 0.001}
    result = solve(chain(links, (0.18771, 0.39029), **rule), samples=1000)
    assert [part.grade for part in result.allocation] == ["IT10", "IT9"]
    assert result.allocation[1].nominal_mm == 70.044
    assert result.nominal_mm == pytest.approx(0.289) and sum(result.worst_case_mm) / 2 == pytest.approx(0.289)


def test_slack_after_snapping_widens_the_finest_grade_that_still_fits():
    links, limits = [(1, 9.0), (-1, 8.0)], (0.9, 0.938)
    plain = by_name(solve(chain(links, limits, grades=True), samples=10))
    assert [plain[name].grade for name in "ab"] == ["IT7", "IT7"]  # 0.015 each of 0.019
    spent = solve(chain(links, limits, grades=True, spend_slack=True), samples=10)
    assert sorted(part.grade for part in spent.allocation) == ["IT7", "IT8"]  # 0.015 + 0.022 of 0.038
    assert spent.worst_case_mm[0] >= 0.9 and spent.worst_case_mm[1] == pytest.approx(0.938)


def test_slack_goes_where_it_saves_most():
    links, limits = [costly(1, 9.0, 1.0), costly(-1, 8.0, 3.0)], (0.9, 0.938)
    wish = {"grades": True, "spend_slack": True, "method": "equal"}
    assert [part.grade for part in solve(chain(links, limits, **wish), samples=10).allocation] == ["IT7", "IT8"]


@pytest.mark.parametrize("mode", ["rss", "yield"])
def test_spent_slack_still_keeps_the_limits(mode):
    wish = {"grades": True, "spend_slack": True, "mode": mode, "target_yield": 0.999}
    links, limits = [(1, 90.0), (-1, 40.0), (-1, 49.9)], (0.05, 0.15)
    result = solve(chain(links, limits, **wish), samples=10)
    low, high = result.rss_mm
    if mode == "rss":
        assert low >= 0.05 - 1e-9 and high <= 0.15 + 1e-9
    else:
        assert result.exact_yields["as_given"] >= 0.999
    for part in result.allocation:
        assert part.tolerance_mm == pytest.approx(grade_tolerances(part.nominal_mm)[part.grade])


def test_positions_by_letter_and_on_both_sides():
    links = [(1, 25.1, {"position": "F"}), (-1, 25.0, {"position": "g"}), (-0.001, 4.0, {"position": "symmetric"})]
    part = by_name(solve(chain(links, (0.05, 0.15)), samples=10))
    width = part["a"].tolerance_mm
    assert (part["a"].lower_mm, part["a"].upper_mm) == pytest.approx((0.020, 0.020 + width))
    assert (part["b"].lower_mm, part["b"].upper_mm) == pytest.approx((-0.007 - width, -0.007))
    assert part["c"].lower_mm == -part["c"].upper_mm


def test_a_code_of_the_standard_gives_the_deviations():
    coded = [(1, 60.0, {"fit": "K6", "fixed": True}), (-1, 60.0, {"fit": "P5 outside", "fixed": True}), (1, 5.0)]
    part = by_name(solve(chain(coded, (4.9, 5.1)), samples=10))
    assert (part["a"].lower_mm, part["a"].upper_mm) == (-0.015, 0.004)
    assert (part["b"].lower_mm, part["b"].upper_mm) == (-0.009, 0.0)


def test_limits_that_fixed_links_consume_come_with_the_nearest_that_can_be_met():
    links = [(1, 9.0, 0.03, 0.0, {"fixed": True}), (-1, 8.0)]
    strict = solve(chain(links, (1.0, 1.02)), samples=10)
    assert strict.refused and "widen the limits to more than 0.9950 to 1.0250 mm" in strict.status
    loose = solve(chain(links, (1.0, 1.02), mode="yield"), samples=10)
    reason = r"yield = 0\.9973: the fixed links alone give 0\.9545.* more than 0\.99\d+ to 1\.02\d+ mm"
    assert loose.refused and re.search(reason, loose.status)


@pytest.mark.parametrize(
    ("extra", "wish", "words"),
    [
        ({}, {"method": "cost"}, 'link "a": method = "cost" needs a curve'),
        ({"fit": "H7", "upper_mm": 0.1, "lower_mm": 0.0}, {}, 'fit = "H7": already sets the deviations'),
        ({"fit": "Q7"}, {}, 'link "a": fit = "Q7": is not a tolerance class'),
        ({"fit": "P9 bore"}, {}, 'fit = "P9 bore": is not a ring class'),
        ({"nominal_mm": 600.0}, {"grades": True}, "nominal_mm = 600: the grades here end at 500 mm"),
        ({"nominal_mm": 600.0, "position": "h"}, {}, 'position = "h": lies outside the tables'),
        ({"nominal_mm": None}, {}, 'link "a": nominal_mm: missing; add it'),
    ],
)
def test_wrong_wishes_are_refused_with_key_value_and_mend(extra, wish, words):
    with pytest.raises(InputError) as caught:
        solve(chain([(1, 9.0, extra)], (8.9, 9.1), **wish), samples=10)
    assert len(caught.value.faults) == 1
    assert words in caught.value.faults[0]


def test_given_deviations_stay_where_others_are_allocated():
    """Closed form: of 0.04 mm the given part takes 0.004; 0.036 is left for the other, as with fixed = true."""
    links = [(1, 9.22), (-1, 9.0, 0.0, -0.004)]
    result = solve(chain(links, (0.20, 0.24)), samples=10)
    part = by_name(result)
    assert (part["b"].upper_mm, part["b"].lower_mm, part["b"].nominal_mm) == (0.0, -0.004, 9.0)
    assert part["a"].tolerance_mm == pytest.approx(0.036) and result.worst_case_mm == pytest.approx((0.20, 0.24))
    assert result.status == "ok: deviations allocated"
    fixed = solve(chain([links[0], (*links[1], {"fixed": True})], (0.20, 0.24)), samples=10)
    assert fixed.as_dict() == result.as_dict()
    # Nor does a given one need what only an allocated one does.
    costs = solve(chain([costly(1, 9.22, 1.0), links[1]], (0.20, 0.24), method="cost"), samples=10)
    assert by_name(costs)["a"].tolerance_mm == pytest.approx(0.036) and costs.cost is not None


def printed(name, result):
    """What the terminal shows of a chain."""
    return text(chain_blocks(name, result))


def test_a_moved_nominal_is_marked():
    """In the record, on the terminal and in the report; where none is moved, no column stands for it."""
    moved = solve(chain([(1, 9.22), (-1, 9.0, 0.0, -0.004)], (0.20, 0.24)), samples=10)
    record = moved.as_dict()["allocation"]
    assert (record["a"]["moved_mm"], record["b"]["moved_mm"]) == (pytest.approx(0.016), 0.0)
    assert "nominal moved [mm]" in (shown := printed("pocket", moved)) and "+0.016 " in shown
    report = reported({"chains": {"pocket": moved.as_dict()}})
    assert "nominal moved" in report and "+0.016 " in report
    still = solve(chain([(1, 9.236), (-1, 9.0, 0.0, -0.004)], (0.20, 0.24)), samples=10)
    assert "nominal moved" not in printed("pocket", still) + reported({"chains": {"pocket": still.as_dict()}})


def test_tolerances_in_proportion_to_the_unit_say_that_they_are_no_grades():
    links = [(1, 60.0), (-1, 10.0), (-1, 50.0)]
    plain, grades = (
        solve(chain(links, (-0.1, 0.1), method="iso286", grades=graded), samples=10) for graded in (False, True)
    )
    assert plain.status.endswith(
        "in proportion to ISO 286's tolerance units (grades = true narrows them to its grades)"
    )
    assert plain.status.removeprefix("ok") in printed("x", plain)
    assert grades.status == "ok: deviations allocated" and all(part.grade for part in grades.allocation)


def reported(record):
    """The report of a record in words."""
    return "".join(terminal.text(part.blocks, Detail.ALL) for part in sections(Summary.from_dict(summary() | record)))
