"""Growth of ball races: printed form, limits, heat, fits and the speed at which a ring leaves its shaft."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn.materials import MATERIALS
from rbdyn.quasistatic.ring_growth import groove_change, printed_growth, race_radii
from rbdyn.ring_expansion import Ring, interface_pressure, loosening_speed

STEEL, CERAMIC = MATERIALS["bearing_steel"], MATERIALS["silicon_nitride"]
SPEED = 40000.0 * math.pi / 30.0
ANGLE = math.radians(15.0)


def inner_ring(material=STEEL, speed=SPEED, rise=0.0):
    """Inner ring of a 71901C: 12 mm bore, 18 mm pitch, 3 mm balls."""
    return Ring(6e-3, race_radii(18e-3, 3e-3, ANGLE)[0], material, rise, speed)


def outer_ring(material=STEEL, speed=0.0, rise=0.0):
    """Its outer ring of 24 mm."""
    return Ring(race_radii(18e-3, 3e-3, ANGLE)[1], 12e-3, material, rise, speed)


def test_literature_printed_growth_is_a_free_annulus_of_the_pitch_circle():
    """Literature: eq 4 with 1/(32 E) is the rotating annulus at its outer radius, taken at the pitch circle."""
    annulus = Ring(6e-3, 9e-3, STEEL, speed=SPEED)
    printed = printed_growth(18e-3, 12e-3, STEEL, SPEED)
    assert printed == pytest.approx(annulus.rotation_growth(9e-3), rel=1e-13)
    # On the race, where balls touch, the ring grows a quarter less.
    assert inner_ring().rotation_growth(inner_ring().outer_radius) / printed == pytest.approx(
        0.759, abs=0.001
    )


@pytest.mark.parametrize("form", ["thick", "printed"])
def test_literature_ceramic_grows_a_quarter_of_steel(form):
    """Literature: growth goes as rho/E, against Hu et al.'s "ceramic larger than steel"; nu matters by some per cent."""

    def growth(material):
        return printed_growth(18e-3, 12e-3, material, SPEED) if form == "printed" else (
            inner_ring(material).rotation_growth(7.5e-3)
        )  # fmt: skip

    by_density = CERAMIC.density / CERAMIC.elastic_modulus * STEEL.elastic_modulus / STEEL.density
    assert growth(CERAMIC) / growth(STEEL) == pytest.approx(by_density, rel=0.03)
    assert by_density == pytest.approx(0.269, abs=0.001)


def test_limit_middle_ring_of_no_wall():
    """Limit: bore and outside of a thin ring grow alike, by rho w^2 r^3/E; of a thick one the outside grows more."""
    thin = Ring(12e-3, 12.001e-3, STEEL, speed=SPEED)
    hoop = STEEL.density * SPEED**2 * 12e-3**3 / STEEL.elastic_modulus
    for radius in (thin.inner_radius, thin.outer_radius):
        assert thin.rotation_growth(radius) == pytest.approx(hoop, rel=3e-4)
    thick = Ring(10.45e-3, 14.7e-3, STEEL, speed=SPEED)
    assert thick.rotation_growth(10.45e-3) > thick.rotation_growth(14.7e-3) > 0.0


def test_unit_which_race_grows():
    """Unit: a turning inner ring closes the gap, a turning outer ring opens it; rotation leaves the grooves' radii."""
    still = groove_change(inner_ring(speed=0.0), outer_ring(), 3e-3, (0.515, 0.525), ball_material=STEEL)
    assert still == (0.0, 0.0, 0.0)
    inner = groove_change(inner_ring(), outer_ring(), 3e-3, (0.515, 0.525), ball_material=STEEL)
    outer = groove_change(
        inner_ring(speed=0.0), outer_ring(speed=SPEED), 3e-3, (0.515, 0.525), ball_material=STEEL
    )
    both = groove_change(inner_ring(), outer_ring(speed=SPEED), 3e-3, (0.515, 0.525), ball_material=STEEL)
    assert inner.radial == inner_ring().rotation_growth(inner_ring().outer_radius) > 0.0 > outer.radial
    assert both.radial == pytest.approx(inner.radial + outer.radial, rel=1e-12)
    assert inner[1:] == outer[1:] == (0.0, 0.0)


def test_unit_uniform_heat_scales_the_row():
    """Unit: of one steel at one temperature, groove centres and reaches grow as all lengths do; ceramic balls do not."""
    strain = STEEL.thermal_expansion * 80.0
    rings = inner_ring(speed=0.0, rise=80.0), outer_ring(rise=80.0)
    hot = groove_change(*rings, 3e-3, (0.515, 0.525), ball_material=STEEL, ball_temperature_rise=80.0)
    # Between races that leave no play: (f_i + f_o - 1) D of the drawing, seen radially, is grooves less a ball.
    apart = rings[0].outer_radius + 0.515 * 3e-3 - (rings[1].inner_radius - 0.525 * 3e-3)
    assert hot.radial == pytest.approx(strain * apart, rel=1e-12)
    assert hot.inner_reach == pytest.approx(strain * 0.015 * 3e-3, rel=1e-9)
    assert hot.outer_reach == pytest.approx(strain * 0.025 * 3e-3, rel=1e-9)
    hybrid = groove_change(*rings, 3e-3, (0.515, 0.525), ball_material=CERAMIC, ball_temperature_rise=80.0)
    assert hybrid.inner_reach - hot.inner_reach == pytest.approx(1.5e-3 * 80.0 * (12e-6 - 3.2e-6), rel=1e-9)


def test_unit_fits_press_the_races():
    """Unit: a press fit on the shaft closes the gap as Lame says, and so does a tight housing."""
    change = groove_change(
        inner_ring(speed=0.0), outer_ring(), 3e-3, (0.515, 0.525), ball_material=STEEL,
        inner_pressure=20e6, outer_pressure=10e6,
    )  # fmt: skip
    inner = inner_ring().pressure_growth(inner_ring().outer_radius, inside=20e6)
    outer = outer_ring().pressure_growth(outer_ring().inner_radius, outside=10e6)
    assert outer < 0.0 < inner
    assert change.radial == pytest.approx(inner - outer, rel=1e-12)


@given(
    bore=st.floats(0.0, 0.9),
    interference=st.floats(0.1e-6, 60e-6),
    rise=st.floats(-20.0, 5.0),
)
@settings(max_examples=100, deadline=None)
def test_invariant_pressure_vanishes_at_the_loosening_speed(bore, interference, rise):
    """Invariant: just below that speed the fit presses, just above it does not."""
    shaft, ring = Ring(bore * 6e-3, 6e-3, STEEL), replace(inner_ring(), temperature_rise=rise)
    speed = loosening_speed(shaft, ring, interference)

    def pressure(at):
        return interface_pressure(replace(shaft, speed=at), replace(ring, speed=at), interference)

    if speed == 0.0:
        assert pressure(0.0) == 0.0
    else:
        assert pressure(0.999 * speed) > 0.0 == pressure(1.001 * speed)


def test_unit_a_stiffer_lighter_ring_never_lets_go():
    """Unit: a ring that grows less than its shaft tightens with speed."""
    shaft = Ring(5.9e-3, 6e-3, MATERIALS["titanium_6al4v"])
    light = Ring(6e-3, 6.05e-3, replace(CERAMIC, elastic_modulus=900e9))
    assert loosening_speed(shaft, light, 2e-6) == math.inf
    assert loosening_speed(shaft, light, -2e-6) == 0.0


def test_literature_inner_ring_leaves_its_shaft():
    """Literature: closed form on a solid shaft of like steel, 71901C pressed by 2 um.

    The ring's bore opens by rho w^2 a/(4E) [(3 + nu) b^2 + (1 - nu) a^2], a solid shaft's outside by (1 - nu) of it.
    """
    a, b, nu = 6e-3, inner_ring().outer_radius, STEEL.poisson_ratio
    per_square = STEEL.density * a / (4.0 * STEEL.elastic_modulus) * (3.0 + nu) * b**2
    speed = loosening_speed(Ring(0.0, a, STEEL), inner_ring(), 2e-6)
    assert speed == pytest.approx(math.sqrt(1e-6 / per_square), rel=1e-12)
