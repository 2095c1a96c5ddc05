"""SKF's friction of ball bearings: the formulas typed apart, the maker's example, limits, reference speeds and a NASA test."""

import math

import pytest

from rbdyn.life import friction
from rbdyn.life.rollers import iso_15312_heat
from rbdyn.properties import table
from rbdyn.properties.catalogue import Envelope, diameter_series
from rbdyn.properties.materials import oil_at

RPM = math.pi / 30.0
# Sizes and reference speeds of SKF's General Catalogue 6000: series, bore, outside diameter, width [mm], C0 [kN], speed [rpm].
DEEP = [
    ("62", 25, 52, 15, 7.8, 28000), ("60", 40, 68, 15, 11.6, 22000), ("62", 40, 80, 18, 19.0, 18000), ("62", 50, 90, 20, 23.2, 15000),
    ("62", 75, 130, 25, 49.0, 10000), ("63", 40, 90, 23, 24.0, 17000), ("63", 50, 110, 27, 38.0, 13000), ("64", 40, 110, 27, 36.5, 14000),
]  # fmt: skip
ANGULAR = [
    (25, 52, 15, 10.0, 17000), (40, 80, 18, 26.0, 11000), (50, 90, 20, 31.0, 9000),
    (40, 90, 23, 32.5, 10000), (50, 110, 27, 51.0, 8000), (75, 130, 25, 60.0, 5600),
]  # fmt: skip
# Constants as typed apart from table 3a: R1 [1e-7], S1 [1e-3], S2; R2 is 1.7 for all.
TABLE_3A = {
    "60": (4.1, 3.73, 14.6), "62": (3.9, 3.23, 36.5), "63": (3.7, 2.84, 92.8), "64": (3.6, 2.43, 198.0),
    "160": (4.3, 4.63, 4.25), "618": (4.7, 6.50, 0.78), "619": (4.3, 4.75, 3.6),
}  # fmt: skip


def factors(bore, outside, rpm, cst, k_z, film, k_rs=3e-8):
    """phi_ish phi_rs (nu n)^0.6 and mu_sl in SKF's own units."""
    mean = (bore + outside) / 2
    ish = 1 / (1 + 1.84e-9 * (rpm * mean) ** 1.28 * cst**0.64)
    rs = math.e ** -(k_rs * cst * rpm * (bore + outside) * (k_z / 2 / (outside - bore)) ** 0.5)
    boundary = math.e ** -(2.6e-8 * (rpm * cst) ** 1.4 * mean)
    return ish * rs * (cst * rpm) ** 0.6, boundary * 0.12 + (1 - boundary) * film


def test_literature_example_of_the_maker():
    """Literature: the factors of SKF's example, a 22208 E at 3500 rpm with 68 mm2/s: 0.85, 0.8, 297 N mm rolling, 21.7 sliding."""
    speed, oil = 3500.0 * RPM, 68e-6
    heated, starved = (
        friction.inlet_heating_factor(0.06, speed, oil),
        friction.starvation_factor(5.5, friction.Running(0.04, 0.08, speed, oil)),
    )
    assert heated == pytest.approx(0.85, abs=0.005) and starved == pytest.approx(0.8, abs=0.005)
    assert 0.26 * (68 * 3500) ** 0.6 * heated * starved == pytest.approx(0.85 * 0.8 * 437, rel=0.01)
    assert 434 * friction.sliding_friction(friction.MINERAL_FILM, 0.06, speed, oil) == pytest.approx(21.7, abs=0.05)


@pytest.mark.parametrize("series", TABLE_3A)
def test_literature_deep_groove_moments(series):
    """Literature: the formulas of table 2a as typed apart in their own units, with and without axial load, bath and grease."""
    (r1, s1, s2), (bore, outside), capacity = TABLE_3A[series], (40.0, 80.0), 19000.0
    mean = (bore + outside) / 2
    for rpm, cst, radial, axial in ((900, 60, 800, 0), (9000, 12, 950, 0), (9000, 12, 300, 2000), (18000, 5, 0, 1500)):
        for supply, k_rs in (("bath", 3e-8), ("grease", 6e-8)):
            rolls, slides = factors(bore, outside, rpm, cst, 3.1, 0.05, k_rs)
            if axial:
                sine = math.sin(math.radians(24.6 * (axial / capacity) ** 0.24))
                g_rr = 1e-7 * r1 * mean**1.96 * (radial + 1.7 / sine * axial) ** 0.54
                g_sl = 1e-3 * s1 * mean**-0.145 * (radial**5 + s2 * mean**1.5 / sine * axial**4) ** (1 / 3)
            else:
                g_rr, g_sl = 1e-7 * r1 * mean**1.96 * radial**0.54, 1e-3 * s1 * mean**-0.26 * radial ** (5 / 3)
            at = friction.Running(1e-3 * bore, 1e-3 * outside, rpm * RPM, 1e-6 * cst, supply)
            moments = friction.deep_groove_moments(series, at, radial, axial, capacity)
            assert [1e3 * moment for moment in moments] == pytest.approx([g_rr * rolls, g_sl * slides], rel=1e-12)


def test_literature_angular_contact_moments():
    """Literature: the formulas of table 2a as typed apart; balls of silicon nitride have 0.41 of R3 and S3."""
    bore, outside, rpm, cst, radial, axial = 40.0, 80.0, 11000.0, 9.0, 700.0, 1800.0
    mean, (rolls, slides) = 60.0, factors(40.0, 80.0, 11000.0, 9.0, 4.4, 0.04)
    for share in (1.0, 0.41):
        rolling, sliding = (radial + share * k * mean**4 * rpm**2 for k in (1.90e-12, 1.91e-12))
        g_rr = 5.03e-7 * mean**1.97 * (rolling + 1.97 * axial) ** 0.54
        g_sl = 1.30e-2 * mean**0.26 * (sliding ** (4 / 3) + 0.68 * axial ** (4 / 3))
        at = friction.Running(1e-3 * bore, 1e-3 * outside, rpm * RPM, 1e-6 * cst)
        moments = friction.angular_contact_moments(at, radial, axial, density_ratio=share, film_friction=0.04)
        assert [1e3 * moment for moment in moments] == pytest.approx([g_rr * rolls, g_sl * slides], rel=1e-12)


def test_unit_first_axial_load():
    """Unit: rolling is continuous at the first axial load, sliding steps by d_m^0.115 as in the maker's form."""
    at = "62", friction.Running(0.04, 0.08, 6000.0 * RPM, 12e-6), 1000.0
    without, least = (friction.deep_groove_moments(*at, axial, 19000.0) for axial in (0.0, 1e-4))
    assert least.rolling == pytest.approx(without.rolling, rel=1e-4)
    assert least.sliding / without.sliding == pytest.approx(60.0**0.115, rel=1e-6)


def test_unit_preload_loads_all_balls_alike():
    """Unit: sums over a half load zone of point contacts give R2 = 1.7 of SKF for rolling, and the 1.80 for sliding."""
    places = 200_000
    angles = [-0.5 * math.pi + math.pi * (k + 0.5) / places for k in range(places)]
    # Half of all balls carry Q_max cos^1.5 with Q_max = 4.37 F_r/Z; the others nothing.
    rolling, sliding = (0.5 * sum(math.cos(a) ** (1.5 * power) for a in angles) / places for power in (0.54, 5.0 / 3.0))
    assert 1.0 / (4.37 * rolling ** (1.0 / 0.54)) == pytest.approx(friction.DEEP_GROOVE["62"].axial_rolling, abs=0.005)
    assert 4.37 * sliding**0.6 == pytest.approx(friction.PRELOAD_SLIDING, abs=0.005)
    at = "62", friction.Running(0.04, 0.08, 6000.0 * RPM, 12e-6)
    both = friction.deep_groove_moments(*at, 1000.0, 0.0, 19000.0, preload=500.0)
    more = friction.deep_groove_moments(*at, 1000.0 + 1.7 * 500.0, 0.0, 19000.0)
    assert both.rolling == pytest.approx(more.rolling) and both.sliding < more.sliding


def test_literature_heat_at_the_reference_speed():
    """Literature: at 0.05 C0 and 12 mm2/s SKF's friction is 0.67 to 0.93 of the heat of ISO 15312, of angular contact 1.9 to 2.7."""
    ratios = {"deep": [], "angular": []}
    for series, bore, outside, width, capacity, rpm in DEEP:
        at = friction.Running(1e-3 * bore, 1e-3 * outside, rpm * RPM, 12e-6, "bath")
        moments = friction.deep_groove_moments(series, at, 50.0 * capacity, 0.0, 1e3 * capacity)
        ratios["deep"].append(rpm * RPM * sum(moments) / iso_15312_heat(Envelope(bore, outside, width)))
    for bore, outside, width, capacity, rpm in ANGULAR:
        at = friction.Running(1e-3 * bore, 1e-3 * outside, rpm * RPM, 12e-6, "bath")
        moments = friction.angular_contact_moments(at, 50.0 * capacity, 0.0)
        ratios["angular"].append(rpm * RPM * sum(moments) / iso_15312_heat(Envelope(bore, outside, width)))
    assert [min(ratios["deep"]), max(ratios["deep"])] == pytest.approx([0.67, 0.93], abs=0.01)
    assert [min(ratios["angular"]), max(ratios["angular"])] == pytest.approx([1.89, 2.70], abs=0.01)


@pytest.mark.parametrize(
    ("rpm", "kelvin", "measured", "ratio", "still"),
    [(28e3, 409.0, 350.0, 2.88, 0.33), (48e3, 425.0, 700.0, 8.5, 0.29), (64e3, 442.0, 1100.0, 14.6, 0.24), (72e3, 455.0, 1400.0, 17.4, 0.21)],
)  # fmt: skip
def test_literature_nasa_losses_are_out_of_reach(rpm, kelvin, measured, ratio, still):
    """Literature: over the losses of NASA TP-2275 (35 mm, 667 N, MIL-L-23699) the model is 2.9 to 17, without terms of n^2 0.33 to 0.21.

    The outside diameter of 62 mm is from memory. The oil is at the outlet temperature of its balance.
    """
    oil = oil_at("MIL-L-23699", kelvin - 273.15)
    at = friction.Running(0.035, 0.062, rpm * RPM, oil.viscosity / oil.density, "jet")
    for share, expected in ((1.0, ratio), (0.0, still)):
        moments = friction.angular_contact_moments(
            at, 0.0, 667.0, density_ratio=share, film_friction=friction.SYNTHETIC_FILM
        )
        assert rpm * RPM * sum(moments) / measured == pytest.approx(expected, rel=0.03)


def test_unit_series_by_diameters():
    """Unit: every listed size has its own diameter series, and sizes of series 4 lie above series 3."""
    for row in table("ball_bearings"):
        assert diameter_series(float(row["bore"]), float(row["outside"])) == row["diameter_series"]
    for bore, outside in ((17, 62), (25, 80), (40, 110), (70, 180)):
        assert diameter_series(bore, outside) == "4"
