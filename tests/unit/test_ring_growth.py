"""Growth of ball races: printed form, limits, heat, fits and the speed at which a ring leaves its shaft."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn import BallScene, equilibrium
from rbdyn.base.faults import InputError
from rbdyn.mounting.rings import Ring, groove_change, interface_pressure, loosening_speed, printed_growth
from rbdyn.properties.materials import MATERIALS
from rbdyn.scene.fits import layer_changes, mounted_of, row_change

STEEL, CERAMIC = MATERIALS["bearing_steel"], MATERIALS["silicon_nitride"]
SPEED = 40000.0 * math.pi / 30.0
ANGLE = math.radians(15.0)


def race_radii(pitch_diameter, ball_diameter, contact_angle):
    """Radii [m] of the circles on which balls touch inner and outer race: (dm -+ D cos alpha0)/2."""
    reach = ball_diameter * math.cos(contact_angle)
    return 0.5 * (pitch_diameter - reach), 0.5 * (pitch_diameter + reach)


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
    assert inner_ring().rotation_growth(inner_ring().outer_radius) / printed == pytest.approx(0.759, abs=0.001)


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
    still = groove_change(inner_ring(speed=0.0), outer_ring(), 3e-3, (0.515, 0.525), ANGLE, ball_material=STEEL)
    assert still == (0.0, 0.0, 0.0)
    inner = groove_change(inner_ring(), outer_ring(), 3e-3, (0.515, 0.525), ANGLE, ball_material=STEEL)
    outer = groove_change(
        inner_ring(speed=0.0), outer_ring(speed=SPEED), 3e-3, (0.515, 0.525), ANGLE, ball_material=STEEL
    )
    both = groove_change(inner_ring(), outer_ring(speed=SPEED), 3e-3, (0.515, 0.525), ANGLE, ball_material=STEEL)
    assert inner.radial == inner_ring().rotation_growth(inner_ring().outer_radius) > 0.0 > outer.radial
    assert both.radial == pytest.approx(inner.radial + outer.radial, rel=1e-12)
    assert inner[1:] == outer[1:] == (0.0, 0.0)


def test_unit_uniform_heat_scales_the_row():
    """Unit: of one steel at one temperature, groove centres and reaches grow as all lengths do; ceramic balls do not."""
    strain = STEEL.thermal_expansion * 80.0
    rings = inner_ring(speed=0.0, rise=80.0), outer_ring(rise=80.0)
    hot = groove_change(*rings, 3e-3, (0.515, 0.525), ANGLE, ball_material=STEEL, ball_temperature_rise=80.0)
    # B cos a_0 lies radially between the groove centres.
    assert hot.radial == pytest.approx(strain * 0.04 * 3e-3 * math.cos(ANGLE), rel=1e-9)
    assert hot.inner_reach == pytest.approx(strain * 0.015 * 3e-3, rel=1e-9)
    assert hot.outer_reach == pytest.approx(strain * 0.025 * 3e-3, rel=1e-9)
    hybrid = groove_change(*rings, 3e-3, (0.515, 0.525), ANGLE, ball_material=CERAMIC, ball_temperature_rise=80.0)
    assert hybrid.inner_reach - hot.inner_reach == pytest.approx(1.5e-3 * 80.0 * (12e-6 - 3.2e-6), rel=1e-9)


def test_unit_fits_press_the_races():
    """Unit: a press fit on the shaft closes the gap as Lame says, and so does a tight housing."""
    change = groove_change(
        inner_ring(speed=0.0), outer_ring(), 3e-3, (0.515, 0.525), ANGLE, ball_material=STEEL,
        inner_pressure=20e6, outer_pressure=10e6,
    )  # fmt: skip
    inner = inner_ring().pressure_growth(inner_ring().outer_radius, inside=20e6)
    outer = outer_ring().pressure_growth(outer_ring().inner_radius, outside=10e6)
    assert outer < 0.0 < inner
    assert change.radial == pytest.approx(inner - outer, rel=1e-12)


@given(bore=st.floats(0.0, 0.9), interference=st.floats(0.1e-6, 60e-6), rise=st.floats(-20.0, 5.0))
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


def deep_groove(**tables):
    """A 6206 between two radial loads: bore 30, outside 62 mm."""
    scene = {
        "bearing": {
            "kind": "deep_groove_ball", "balls": 9, "ball_diameter_mm": 9.525, "pitch_diameter_mm": 46.0,
            "inner_groove_factor": 0.515, "outer_groove_factor": 0.525, "radial_clearance_mm": 0.02,
        },
        "operation": {"inner_speed_rpm": 12000.0, "radial_load_N": 1000.0, "axial_load_N": 300.0},
        "mounting": {"bore_mm": 30.0, "outside_diameter_mm": 62.0, "housing_diameter_mm": 90.0},
    }  # fmt: skip
    for name, table in tables.items():
        scene[name] = scene.get(name, {}) | table
    return BallScene.from_dict(scene)


def test_limit_mounting_of_a_ball_bearing_is_a_change_of_clearance():
    """Limit: fits and rotation change a ball bearing just as the diametral clearance that they take."""
    mounted = deep_groove(mounting={"inner_interference_um": 15.0, "outer_interference_um": 8.0})
    rings = mounted_of(mounted)
    taken = -2e6 * row_change(mounted).radial
    assert -15.0 - 8.0 < taken < -10.0
    by_lame = rings.inner_ring.growth(rings.inner_ring.outer_radius, inside=rings.inner_pressure)
    by_lame -= rings.outer_ring.growth(rings.outer_ring.inner_radius, outside=rings.outer_pressure)
    assert taken == pytest.approx(-2e6 * by_lame, rel=1e-12)
    plain = mounted.model_dump(mode="json") | {"mounting": None}
    plain["bearing"]["clearance_change_um"] = taken
    first, second = equilibrium(mounted), equilibrium(BallScene.from_dict(plain))
    assert first.displacement == pytest.approx(second.displacement, abs=1e-12)
    record = first.as_dict()["fits"]
    assert record["inner_ring_loosens_rpm"] > 12000.0 and not record["inner_ring_loose"]
    assert record["inner_pressure_MPa"] > record["outer_pressure_MPa"] > 0.0


def test_unit_rotation_loosens_a_light_fit():
    """Unit: a fit of 1 um has let go at 12000 rpm, and the record says from which speed."""
    record = equilibrium(deep_groove(mounting={"inner_interference_um": 0.3})).as_dict()["fits"]
    assert record["inner_ring_loose"] and 0.0 < record["inner_ring_loosens_rpm"] < 12000.0
    loose = equilibrium(deep_groove(mounting={"inner_interference_um": -3.0})).as_dict()["fits"]
    assert loose["inner_ring_loosens_rpm"] == 0.0


def test_unit_hot_hybrid_bearing():
    """Unit: ceramic balls between hot steel rings leave the grooves deeper and the clearance wider."""
    hot = {"inner_ring_temperature_C": 120.0, "outer_ring_temperature_C": 120.0, "rotation": False}
    steel = row_change(deep_groove(mounting=hot))
    hybrid = row_change(deep_groove(mounting=hot, materials={"ball": "silicon_nitride"}))
    assert hybrid.radial == steel.radial
    assert hybrid.inner_reach - steel.inner_reach == pytest.approx(0.5 * 9.525e-3 * 100.0 * 8.8e-6, rel=1e-9)
    warm = equilibrium(deep_groove(mounting=hot, materials={"ball": "silicon_nitride"}))
    cold = equilibrium(deep_groove(mounting={"rotation": False}, materials={"ball": "silicon_nitride"}))
    assert warm.displacement[2] > cold.displacement[2]


@pytest.mark.parametrize("form", ["thick_ring", "paper"])
def test_unit_growth_of_a_single_row(form):
    """Unit: ring_expansion grows the inner ring of a single row in either form, and closes the contact angle."""
    expanding = {"ring_expansion": True, "ring_expansion_form": form}
    data = deep_groove().model_dump(mode="json") | {"mounting": None}
    data["bearing"]["bore_mm"] = 30.0
    plain = equilibrium(BallScene.from_dict(data))
    data["model"] = data["model"] | expanding
    scene = BallScene.from_dict(data)
    ring = Ring(15e-3, 0.5e-3 * scene.bearing.raceway_diameters_mm[0], STEEL, speed=12000.0 * math.pi / 30.0)
    thick = ring.rotation_growth(ring.outer_radius)
    expected = thick if form == "thick_ring" else printed_growth(46e-3, 30e-3, STEEL, ring.speed)
    assert row_change(scene).radial == pytest.approx(expected, rel=1e-12)
    grown = equilibrium(scene)
    assert grown.as_dict()["ring_growth_um"]["inner_less_outer_race"] == pytest.approx(1e6 * expected)
    assert grown.displacement[0] < plain.displacement[0]


def test_unit_mounted_double_decker():
    """Unit: a press fit closes the inner row, a tight housing the outer one, heat of a steel bearing only scales."""
    file = Path(__file__).parents[2] / "examples" / "double_decker.toml"
    text = tomllib.loads(file.read_text().replace("bore_mm = 12.0", "").replace("outside_diameter_mm = 42.0", ""))
    text["operation"]["inner_speed_rpm"] = 0.0
    text["mounting"] = {"bore_mm": 12.0, "outside_diameter_mm": 42.0, "housing_diameter_mm": 60.0}

    def changed(**mounting):
        scene = BallScene.from_dict(text | {"mounting": text["mounting"] | mounting})
        return layer_changes(scene, 0.0)

    inner, outer = changed(inner_interference_um=4.0)
    assert inner.radial > 0.0 == outer.radial
    inner, outer = changed(outer_interference_um=4.0)
    assert outer.radial > 0.0 == inner.radial
    for change in changed(inner_ring_temperature_C=100.0, outer_ring_temperature_C=100.0):
        assert change.radial / change.inner_reach == pytest.approx(0.04 / 0.015 * math.cos(ANGLE), rel=1e-9)


def test_unit_contradictory_rings_are_refused():
    """Unit: what is told twice in different ways, or cannot go together, is named with a mend."""
    cases = (
        ({"bearing": {"bore_mm": 29.0}}, "mounting.bore_mm = 30"),
        ({"bearing": {"clearance_change_um": -5.0}}, "clearance_change_um = -5"),
        ({"model": {"ring_expansion": True, "ring_expansion_form": "paper"}}, "has no fits"),
        ({"mounting": {"bore_mm": 37.0}}, "mounting.bore_mm = 37"),
    )
    for tables, words in cases:
        with pytest.raises(InputError) as caught:
            deep_groove(**tables)
        assert any(words in fault for fault in caught.value.faults)
