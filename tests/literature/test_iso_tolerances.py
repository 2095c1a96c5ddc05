"""ISO 286 and ISO 492 as data: rows that catalogues and textbooks print."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from doe.dimension_chain import fit_limits, grade_tolerances, ring_limits, tolerance_unit
from rbdyn.properties.tolerances import RANGES, STANDARD_TOLERANCES, position_limits


@pytest.mark.parametrize(
    ("nominal", "code", "lower", "upper"),
    [
        # Shafts and housings of bearing catalogues: g6 to m6, H7 to N7, j5, j6, J7, K5.
        (40, "g6", -25, -9), (40, "h6", -16, 0), (40, "k6", 2, 18), (40, "m6", 9, 25),
        (300, "g6", -49, -17), (300, "k6", 4, 36), (300, "m6", 20, 52), (5, "k6", 1, 9),
        (40, "K7", -18, 7), (40, "M7", -25, 0), (40, "N7", -33, -8), (25, "P7", -35, -14),
        (300, "K7", -36, 16), (300, "M7", -52, 0), (300, "N7", -66, -14), (480, "K7", -45, 18),
        (100, "K7", -25, 10), (100, "N7", -45, -10), (150, "N7", -52, -12), (450, "N7", -80, -17),
        (40, "j5", -5, 6), (40, "j6", -5, 11), (70, "j5", -7, 6), (70, "J7", -12, 18), (60, "JS6", -9.5, 9.5),
        (40, "K5", -9, 2), (70, "K5", -10, 3), (100, "K5", -13, 2), (200, "K5", -18, 2),
        # Textbook examples: 29 h7 and H7, 50 H7/s6, and the hole M6 that the standard excepts from its rule.
        (29, "h7", -21, 0), (29, "H7", 0, 21), (50, "s6", 43, 59), (280, "M6", -41, -9),
        (60, "r6", 41, 60), (70, "r6", 43, 62), (25, "f7", -41, -20), (25, "E9", 40, 92), (3, "N9", -29, -4),
        (25, "N9", -52, 0), (10, "D10", 40, 98), (18, "p6", 18, 29), (24, "n5", 15, 24), (24, "k8", 0, 33),
    ],
)  # fmt: skip
def test_published_tolerance_classes(nominal, code, lower, upper):
    assert fit_limits(nominal, code) == pytest.approx((1e-3 * lower, 1e-3 * upper))


@pytest.mark.parametrize(
    ("nominal", "code", "lower"),
    [
        (27, "Normal bore", -10), (27, "P6 bore", -8), (27, "P5 bore", -6), (27, "P4 bore", -5),
        (60, "Normal outside", -13), (60, "P6 outside", -11), (60, "P5 outside", -9), (60, "P4 outside", -7),
        (150, "P5 bore", -13), (150, "P5 outside", -11), (151, "P5 outside", -13), (480, "Normal bore", -45),
        # SKF's table of class P5, and Schaeffler's of spindle bearings, whose diameters are those of P4.
        (90, "P5 bore", -10), (300, "P5 outside", -18), (450, "P5 bore", -28), (200, "P4 bore", -12), (160, "P4 outside", -10),
        (240, "P4 outside", -11), (310, "P4 outside", -13), (390, "P4 outside", -15),
    ],
)  # fmt: skip
def test_published_ring_classes(nominal, code, lower):
    assert ring_limits(nominal, code) == pytest.approx((1e-3 * lower, 0.0))


# Multiples of the tolerance unit of ISO 286-1 from IT5 to IT18.
GRADE_UNITS = (7, 10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500)


def test_rounding_of_the_standard_stays_close_to_its_formulas():
    for low, high in pairwise(RANGES):
        middle = (low * high) ** 0.5
        listed = grade_tolerances(middle)
        for number, units in enumerate(GRADE_UNITS, 5):
            assert listed[f"IT{number}"] == pytest.approx(units * tolerance_unit(middle), rel=0.095), (number, middle)


def test_each_row_grows_with_the_grade_and_with_the_size():
    for row in STANDARD_TOLERANCES.values():
        assert len(row) == len(RANGES) and list(row) == sorted(row)
    for nominal in RANGES:
        widths = list(grade_tolerances(nominal).values())
        assert widths == sorted(set(widths))


@settings(max_examples=60, deadline=None)
@given(st.floats(0.5, 500), st.sampled_from("defgh"), st.integers(5, 11))
def test_clearance_fits_mirror_between_hole_and_shaft(nominal, letter, grade):
    shaft, hole = fit_limits(nominal, f"{letter}{grade}"), fit_limits(nominal, f"{letter.upper()}{grade}")
    assert hole == pytest.approx((-shaft[1], -shaft[0]))


@settings(max_examples=60, deadline=None)
@given(st.floats(3.1, 500), st.sampled_from("kmnprs"), st.integers(6, 7))
def test_shaft_based_fits_hold_as_tight_as_hole_based_ones(nominal, letter, grade):
    # H7/p6 and P7/h6 have the same greatest interference: what the delta is for (but for M6 of 250 to 315 mm).
    # K is rounded apart from k.
    tightest = fit_limits(nominal, f"{letter}{grade - 1}")[1]
    mirrored = -fit_limits(nominal, f"{letter.upper()}{grade}")[0]
    excepted = letter == "m" and grade == 6 and 250 < nominal <= 315
    assert mirrored == pytest.approx(tightest - (0.002 if excepted else 0.0), abs=1e-9)


@pytest.mark.parametrize("letter", ["d", "h", "js", "n", "H", "F", "JS"])
def test_any_width_can_stand_at_the_position_of_a_letter(letter):
    width = grade_tolerances(40)["IT6"]
    assert position_limits(40, letter, width) == pytest.approx(fit_limits(40, f"{letter}6"))


@pytest.mark.parametrize(
    ("nominal", "code", "words"),
    [
        (40, "q6", "is not a tolerance class"),
        (40, "h19", "is not a tolerance class"),
        (501, "h6", "outside the tables of ISO 286"),
        (0, "h6", "outside the tables of ISO 286"),
        (40, "j9", "j has the grades 5, 6, 7"),
        (40, "K9", "K ends at grade 8"),
        (40, "N2", "begin at grade 3"),
    ],
)
def test_unlisted_classes_are_refused(nominal, code, words):
    with pytest.raises(ValueError, match=words):
        fit_limits(nominal, code)


@pytest.mark.parametrize(
    ("nominal", "code", "words"),
    [
        (27, "P3 bore", "is not a ring class"),
        (27, "P5 raceway", "is not a ring class"),
        (260, "P4 bore", "0 to 250 mm"),
    ],
)
def test_unlisted_ring_classes_are_refused(nominal, code, words):
    with pytest.raises(ValueError, match=words):
        ring_limits(nominal, code)
