"""Interference of bearings of normal tolerances on their seats: the maker's tables of resultant fits, classes that are not listed."""

import math

import pytest

from rbdyn.base.faults import MethodError
from rbdyn.properties.tolerances import (
    HOUSING_SMOOTHING,
    SHAFT_SMOOTHING,
    Interference,
    housing_interference,
    shaft_interference,
)

# SKF, shaft tolerances and resultant fits: bore, class, the theoretical ends and the probable ones; there negative is tight [um].
SKF_SHAFTS = [
    (5, "k5", -14, -1, -13, -2), (5, "n5", -21, -8, -20, -9), (9, "m6", -23, -6, -21, -8), (15, "k6", -20, -1, -18, -3),
    (25, "g5", -3, 16, -1, 14), (25, "h6", -10, 13, -7, 10), (25, "j5", -15, 4, -13, 2), (25, "k5", -21, -2, -19, -4),
    (25, "m5", -27, -8, -25, -10), (25, "n5", -34, -15, -32, -17), (40, "g6", -3, 25, 1, 21), (40, "h5", -12, 11, -9, 8),
    (40, "j6", -23, 5, -19, 1), (40, "js5", -17.5, 5.5, -15, 3), (40, "k5", -25, -2, -22, -5), (40, "k6", -30, -2, -26, -6),
    (40, "m5", -32, -9, -29, -12), (40, "m6", -37, -9, -33, -13), (40, "n5", -40, -17, -37, -20), (65, "g6", -5, 29, -1, 25),
    (65, "js6", -24.5, 9.5, -20, 5), (65, "k5", -30, -2, -26, -6), (65, "k6", -36, -2, -32, -6), (65, "js7", -30, 15, -25, 10),
    (100, "h5", -20, 15, -15, 10), (100, "js7", -37.5, 17.5, -31, 11), (100, "j5", -26, 9, -21, 4), (150, "g5", -11, 32, -5, 26),
    (150, "h6", -25, 25, -18, 18), (200, "g6", -15, 44, -7, 36),
]  # fmt: skip


@pytest.mark.parametrize(("bore", "zone", "tightest", "loosest", "probably_tight", "probably_loose"), SKF_SHAFTS)
def test_literature_resultant_fits(bore, zone, tightest, loosest, probably_tight, probably_loose):
    """Literature: both ends to the printed half um; the probable ends lie three deviations from the mean, to 1.5 um."""
    fit = shaft_interference(bore, zone)
    low, high, mean = (value + fit.smoothing for value in (fit.low, fit.high, fit.mean))
    assert (low, high) == pytest.approx((-loosest, -tightest), abs=1e-9)
    assert mean == pytest.approx(0.5 * (low + high))
    assert mean + 3.0 * fit.sd == pytest.approx(-probably_tight, abs=1.5)
    assert mean - 3.0 * fit.sd == pytest.approx(-probably_loose, abs=1.5)


@pytest.mark.parametrize(
    ("outside", "zone", "lower", "upper"),
    [
        (90, "G7", 12, 47), (90, "H6", 0, 22), (90, "H7", 0, 35), (90, "H8", 0, 54), (90, "J6", -6, 16), (90, "J7", -13, 22),
        (90, "JS5", -7.5, 7.5), (90, "JS7", -17.5, 17.5), (90, "K6", -18, 4), (90, "K7", -25, 10), (90, "M6", -28, -6),
        (90, "M7", -35, 0), (90, "N6", -38, -16), (90, "N7", -45, -10), (90, "P6", -52, -30), (90, "P7", -59, -24),
    ],
)  # fmt: skip
def test_literature_housings_of_catalogues(outside, zone, lower, upper):
    """Literature: deviations of housings of 80 to 120 mm (maker's tables); the ring's outside is 0 to 15 um below its nominal."""
    fit = housing_interference(outside, zone)
    ends = fit.low + fit.smoothing, fit.high + fit.smoothing
    assert ends == pytest.approx((-15.0 - upper, -lower))
    assert fit.sd == pytest.approx(math.hypot(15.0, upper - lower) / 6.0)


@pytest.mark.parametrize(("ring_class", "bore", "outside"), [("P6", 10.0, 11.0), ("P5", 8.0, 9.0), ("P4", 6.0, 7.0)])
def test_literature_seats_of_finer_rings(ring_class, bore, outside):
    """Literature: a 40 x 80 mm ring of class P6, P5 or P4 has a narrower bore and outside diameter (ISO 492) in the fit of k5 and H7."""
    inner, outer = shaft_interference(40, "k5", ring_class), housing_interference(80, "H7", ring_class)
    assert (inner.low + 1.75, inner.high + 1.75) == pytest.approx((2.0, 13.0 + bore))
    assert (outer.low, outer.high) == pytest.approx((-30.0 - outside, 0.0))


def test_unit_smoothing_takes_from_tight_fits_alone():
    """Unit: a ground shaft loses 1.75 um and a machined housing 6 um, a slack fit nothing, and none becomes loose by it."""
    assert shaft_interference(50, "k5") == pytest.approx(
        Interference(13.5 - 1.75, math.hypot(12, 11) / 6, 0.25, 23.25, 1.75)
    )
    assert housing_interference(90, "N7").smoothing == HOUSING_SMOOTHING and SHAFT_SMOOTHING == 1.75
    assert housing_interference(90, "H7") == pytest.approx(Interference(-25.0, math.hypot(15, 35) / 6, -50.0, 0.0, 0.0))
    slight = shaft_interference(50, "g5")
    assert slight.mean < 0.0 and slight.smoothing == 0.0
    assert shaft_interference(50, "h5").mean == pytest.approx(0.0) and shaft_interference(
        50, "h5"
    ).smoothing == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("reader", "size", "zone", "words"),
    [
        (shaft_interference, 50, "x5", 'such as "k5"'),
        (shaft_interference, 50, "k8", 'such as "k5"'),
        (shaft_interference, 50, "K5", 'such as "k5"'),
        (shaft_interference, 50, "j4", "j has the grades"),
        (shaft_interference, 600, "k5", "tables of ISO 286"),
        (lambda bore, zone: shaft_interference(bore, zone, "P2"), 50, "k5", "rings of class P2 are not listed here"),
        (lambda bore, zone: shaft_interference(bore, zone, "P4"), 260, "k5", "bore of rings of class P4 is listed"),
        (housing_interference, 90, "h7", 'such as "H7"'),
        (housing_interference, 90, "S7", 'such as "H7"'),
        (housing_interference, 90, "J5", "J has the grades"),
    ],
)
def test_unit_unlisted_classes_are_refused(reader, size, zone, words):
    """Unit: what is no class of a seat here is a sentence that names those that are."""
    with pytest.raises(MethodError, match=words):
        reader(size, zone)
