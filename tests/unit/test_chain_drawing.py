"""Sizes on a drawing: allocated ones on its steps and judged so, stated ones as they are written; chains that nothing closes."""

import math

import pytest
from chains import chain, with_functions
from hypothesis import example, given, settings
from hypothesis import strategies as st
from synthetic_study import summary

from doe.dimension_chain import solve
from doe.dimension_chain.links import size_text
from doe.report.page import sections
from doe.report.sections.chain import chain_blocks
from doe.report.summary import Summary
from rbdyn.base import terminal
from rbdyn.base.blocks import Detail
from rbdyn.base.terminal import text

STEP = 0.001
METHODS, MODES = st.sampled_from(["equal", "iso286"]), st.sampled_from(["worst_case", "rss", "yield"])
POSITIONS = st.sampled_from(["unilateral", "symmetric", "H", "h", "js"])
# Bought parts: stated to any digit, or by a code of ISO 286 or ISO 492.
widths = st.floats(0.0, 0.02)
BOUGHT = st.one_of(
    st.tuples(st.floats(1.0, 100.0), widths, widths).map(
        lambda stated: {"nominal_mm": stated[0], "upper_mm": stated[1], "lower_mm": -stated[2]}
    ),
    st.tuples(st.floats(10.0, 100.0), st.sampled_from(["k5", "H7", "P5 bore", "Normal outside"])).map(
        lambda stated: {"nominal_mm": stated[0], "fit": stated[1]}
    ),
)  # fmt: skip


def on_steps(size: float, step: float = STEP) -> bool:
    """Whether a size is a whole number of steps."""
    return math.isclose(size / step, round(size / step), abs_tol=1e-6)


def bought_chain(free, bought, width, **allocate):
    """Free links, and links that are bought, with the limits about what their nominals make."""
    links = [(sign, nominal, {"position": position}) for sign, nominal, position in free]
    links += [(sign, stated["nominal_mm"], stated) for sign, stated in bought]
    middle = sum(sign * nominal for sign, nominal, *_ in links)
    return chain(links, (middle - width / 2, middle + width / 2), resolution_mm=STEP, **allocate)


SIGNS = st.sampled_from([1.0, -1.0])
free_links = st.lists(st.tuples(SIGNS, st.floats(3.0, 100.0), POSITIONS), min_size=1, max_size=3)
bought_links = st.lists(st.tuples(SIGNS, BOUGHT), min_size=0, max_size=3)


@settings(max_examples=25, deadline=None)
@given(free_links, bought_links, st.floats(0.002, 0.3), METHODS, MODES, st.booleans())
def test_unit_allocated_sizes_lie_on_the_steps_and_keep_the_limits(free, bought, width, method, mode, grades):
    """Unit: what the drawing states is on its resolution, and is what the verdict and the yield are of."""
    one = bought_chain(free, bought, width, method=method, mode=mode, grades=grades, spend_slack=grades)
    result = solve(one, samples=10)
    for part in result.parts:
        if part.origin == "allocated":
            assert all(on_steps(size) for size in (part.nominal_mm, part.upper_mm, part.lower_mm))
            assert part.tolerance_mm >= STEP - 1e-9
    low, high = result.rss_mm if mode == "rss" else result.worst_case_mm
    inside = one.closing_link.lower_mm - 1e-9 <= low and high <= one.closing_link.upper_mm + 1e-9
    if mode == "yield":
        inside = result.exact_yields["as_given"] >= one.allocate.target_yield - 1e-12
    assert inside is not result.refused
    stated = [part.nominal_mm + 0.5 * (part.upper_mm + part.lower_mm) for part in result.parts]
    middle = sum(part.coefficient * size for part, size in zip(result.parts, stated, strict=True))
    assert sum(result.rss_mm) / 2 == pytest.approx(middle, abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.tuples(SIGNS, BOUGHT), min_size=1, max_size=4),
    free_links,
    st.booleans(),
    st.floats(0.001, 0.3),
    MODES,
    st.booleans(),
)
@example([(1.0, {"nominal_mm": 1.0, "upper_mm": 0.0, "lower_mm": -5e-228})], [], True, 0.25, "worst_case", False)
@example([(1.0, {"nominal_mm": 1.0, "upper_mm": 0.0, "lower_mm": -5e-324})], [], True, 0.25, "worst_case", False)
def test_unit_stated_parts_are_never_rewritten(bought, free, all_stated, width, mode, grades):
    """Unit: nominal, deviations and code of a stated part are bit for bit those of its link, whatever becomes of the chain."""
    one = bought_chain([] if all_stated else free, bought, width, mode=mode, grades=grades)
    result = solve(one, samples=10)
    record = result.as_dict()
    for part, link in zip(result.parts, one.link, strict=True):
        if not link.has_deviations:
            continue
        size = record["parts"][link.name]
        assert (part.nominal_mm, part.fit, part.moved_mm, part.origin) == (link.nominal_mm, link.fit, 0.0, "stated")
        assert (size["nominal_mm"], size["fit"], size["grade"]) == (link.nominal_mm, link.fit, None)
        if link.fit is None:
            assert (size["upper_mm"], size["lower_mm"]) == (link.upper_mm, link.lower_mm)
        else:
            assert link.fit in size["text"]
        # The nearest sizes of a chain that misses leave what is bought by a code alone.
        if link.fit is not None or not all_stated:
            assert record["allocation"][link.name]["nominal_mm"] == link.nominal_mm
            assert record["allocation"][link.name]["upper_mm"] == size["upper_mm"]


def test_unit_stated_sizes_that_meet_the_limits_stay_on_the_drawing():
    """Unit: wider sizes that would do too are no part of the answer."""
    result = solve(chain([(1, 9.29, 0.0, -0.0047), (-1, 9.0, 0.002, 0.0)], (0.28, 0.29)), samples=10)
    assert result.status == "ok" and [part.lower_mm for part in result.allocation] == [-0.0047, 0.0]
    assert "9.2900 0/-0.0047" in text(chain_blocks("pocket", result))


@pytest.mark.parametrize(
    ("size", "words"),
    [
        ((9.29, 0.0, -0.005, None), "9.290 0/-0.005"),
        ((9.0, 0.0005, -0.0005, None), "9.0000 +0.0005/-0.0005"),
        ((27.0, 0.011, 0.002, "k5"), "27 k5 (+0.011/+0.002)"),
        ((60.0, 0.0, -0.009, "P5 outside"), "60 P5 outside (0/-0.009)"),
    ],
)
def test_unit_sizes_are_written_as_drawings_write_them(size, words):
    """Unit: micrometres at least, further digits where they are stated, codes as they stand."""
    assert size_text(*size) == words


def test_unit_rounding_inwards_uses_no_more_than_the_limits():
    """Closed form: 9.4 um for two parts are 4 um each, and the nominal follows; 4.7 um stand nowhere."""
    result = solve(chain([(1, 9.2257), (-1, 9.0)], (0.2163, 0.2257), resolution_mm=STEP), samples=10)
    assert [part.text for part in result.allocation] == ["9.225 0/-0.004", "9.000 +0.004/0"]
    assert result.worst_case_mm == pytest.approx((0.217, 0.225))
    report = reported({"chains": {"pocket": result.as_dict()}})
    assert "9.225 0/-0.004" in report and "0047" not in report


def test_unit_coarse_and_fine_drawings_have_their_own_steps():
    """Unit: the resolution is a key of the chain."""
    links, limits = [(1, 9.2257), (-1, 9.0)], (0.2, 0.26)
    coarse, fine = (solve(chain(links, limits, resolution_mm=step), samples=10) for step in (0.01, 0.0001))
    assert [part.text for part in coarse.allocation] == ["9.260 0/-0.030", "9.000 +0.030/0"]
    assert all(on_steps(part.nominal_mm, 0.0001) for part in fine.allocation)
    odd = solve(chain([(1, 9.2257), (-1, 9.0)], (0.2, 0.25), resolution_mm=0.01), samples=10)
    assert [part.tolerance_mm for part in odd.allocation] == pytest.approx([0.02, 0.02])


def test_unit_a_chain_that_only_rounding_breaks_says_so():
    """Unit: 1.5 um for two parts are too little for steps of 1 um; the key to write stands in the sentence."""
    links, limits = [(1, 9.05), (-1, 9.0)], (0.28, 0.2815)
    result = solve(chain(links, limits, resolution_mm=STEP), samples=10)
    assert result.refused and "rounded to allocate.resolution_mm = 0.001" in result.status
    assert "write a finer resolution_mm" in result.status
    assert not solve(chain(links, limits, resolution_mm=0.0001), samples=10).refused


def test_unit_a_refused_chain_shows_who_takes_what_and_that_a_yield_meets_it():
    """Closed form: three fixed links of 10 um leave nothing of 20 um in worst case, and 17.3 um of root sum square."""
    fixed = {"fixed": True}
    links = [(1, 30.0), *((-1, 5.0, 0.005, -0.005, fixed) for _ in range(3))]
    result = solve(chain(links, (14.99, 15.01), resolution_mm=STEP), samples=1000)
    assert "the fixed links consume 0.0300 mm of the closing link's 0.0200 mm" in result.status
    assert result.contributions_mm["b"]["worst_case_mm"] == pytest.approx(0.010)
    assert result.contributions["b"]["worst_case_percent"] == pytest.approx(100 * 10 / 31)
    assert result.missed.width_mm == pytest.approx(0.011)  # with a step for the free part
    assert result.remedy.mode_yield_meets and 0.9973 <= result.remedy.mode_yield < 1.0
    shown = text(chain_blocks("length", result))
    for words in (
        'Write mode = "yield" under allocate',
        "Contributions",
        "violates its limits: ",
        "0.0310 mm in worst case",
    ):
        assert words in shown, words
    assert solve(chain(links, (14.99, 15.01), resolution_mm=STEP, mode="yield"), samples=1000).status.startswith("ok")


def test_unit_a_chain_that_matching_meets_names_the_classes_to_write():
    """Closed form: two tolerances of 20 um in four classes leave a worst case of 2 (20/4) um of the 10 um allowed."""
    links, limits = [(1, 9.31, 0.0, -0.02), (-1, 9.0, 0.02, 0.0)], (0.285, 0.295)
    refused = solve(chain(links, limits), samples=1000)
    assert refused.refused and not refused.remedy.mode_yield_meets
    assert refused.remedy.selective_classes == 4 and refused.remedy.selective_pair == ("a", "b")
    assert 'selective = { first = "a", second = "b", classes = 4 }' in refused.remedy.sentence
    pair = {"first": "a", "second": "b", "classes": 4}
    matched = solve(with_functions(chain(links, limits), selective=pair), samples=1000)
    assert matched.status == "ok: matched in 4 classes; random assemblies violate the limits"


def test_unit_a_chain_off_its_place_is_met_by_neither():
    """Unit: no yield and no matching moves a nominal."""
    result = solve(chain([(1, 9.05, 0.0, -0.01), (-1, 9.0, 0.01, 0.0)], (0.28, 0.29)), samples=1000)
    assert (
        result.remedy.sentence == 'Neither mode = "yield" (yield 0 of 0.9973) nor selective assembly meets the limits.'
    )
    assert result.missed.below_mm == pytest.approx(0.25)


def test_unit_fixed_links_that_fill_the_limits_leave_nothing():
    """Unit: with or without fixed = true, a miss and no fault of the input."""
    for extra in ({"fixed": True}, {}):
        result = solve(chain([(1, 9.0, 1.0, 0.0, extra), (1, 8.0)], resolution_mm=STEP), samples=10)
        assert result.refused and "consume 1.0000 mm of the closing link's 1.0000 mm" in result.status


def reported(record):
    """The report of a record in words."""
    return "".join(terminal.text(part.blocks, Detail.ALL) for part in sections(Summary.from_dict(summary() | record)))
