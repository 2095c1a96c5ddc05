"""Ring growth, fits and mounted clearance: closed forms, an independent solution of the rotating ring, limits."""

import copy
import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_bvp

from rbdyn.base.faults import InputError, validated
from rbdyn.mounting.rings import MountedRings, Ring, interface_pressure, mounted_clearance
from rbdyn.properties.materials import MATERIALS, Material
from rbdyn.scene import Scene
from rbdyn.scene.bearing import Bearing, CustomMaterial, Materials, material_of
from rbdyn.scene.fits import operating_clearance
from rbdyn.scene.operation import Mounting, misfits

STEEL = MATERIALS["bearing_steel"]
OMEGA = 24000.0 * math.pi / 30.0
BEARING = Bearing(
    kind="cylindrical_roller",
    rollers=10,
    roller_diameter_mm=9.0,
    roller_length_mm=5.0,
    effective_length_mm=3.5,
    pitch_diameter_mm=43.5,
    radial_clearance_mm=0.020,
)
MOUNTING = Mounting(bore_mm=27.0, outside_diameter_mm=62.0, housing_diameter_mm=90.0)


def stress(ring, radius, inside, outside):
    """Radial stress [Pa] from the growth, differentiated by the fourth-order central difference."""
    h = 1e-3 * radius
    u = [ring.growth(radius + k * h, inside, outside) for k in (-2, -1, 1, 2)]
    slope = (u[0] - 8.0 * u[1] + 8.0 * u[2] - u[3]) / (12.0 * h)
    hoop = ring.growth(radius, inside, outside) / radius
    nu, thermal = ring.material.poisson_ratio, ring.material.thermal_expansion * ring.temperature_rise
    return ring.material.elastic_modulus / (1.0 - nu**2) * (slope + nu * hoop - (1.0 + nu) * thermal)


def test_literature_inner_ring_at_24000_rpm():
    """Literature: a free steel ring of 13.5/17.25 mm grows 0.84 um at the raceway at 24000 rpm (printed digits)."""
    ring = Ring(13.5e-3, 17.25e-3, STEEL, speed=OMEGA)
    assert ring.rotation_growth(17.25e-3) == pytest.approx(0.84e-6, abs=0.005e-6)
    # The form at the outer radius alone: rho w^2 b/(4E) [(1 - nu) b^2 + (3 + nu) a^2].
    closed = 7827.0 * OMEGA**2 * 17.25e-3 / (4.0 * 206e9) * (0.7 * 17.25e-3**2 + 3.3 * 13.5e-3**2)
    assert ring.rotation_growth(17.25e-3) == pytest.approx(closed, rel=1e-13)


def test_unit_lame_at_its_surfaces():
    """Unit: textbook growths at bore and outside, p a/E [(a^2 + b^2)/(b^2 - a^2) + nu] and 2 p a^2 b/[E (b^2 - a^2)]."""
    a, b, p, e, nu = 10e-3, 16e-3, 50e6, STEEL.elastic_modulus, STEEL.poisson_ratio
    ring = Ring(a, b, STEEL)
    wall = b**2 - a**2
    assert ring.pressure_growth(a, inside=p) == pytest.approx(p * a / e * ((a**2 + b**2) / wall + nu), rel=1e-13)
    assert ring.pressure_growth(b, inside=p) == pytest.approx(2.0 * p * a**2 * b / (e * wall), rel=1e-13)
    outside = -p * b / e * ((a**2 + b**2) / wall - nu)
    assert ring.pressure_growth(b, outside=p) == pytest.approx(outside, rel=1e-13)
    # Under one pressure all round, a plane body shrinks evenly.
    even = -(1.0 - nu) * p / e
    for radius in (a, 12e-3, b):
        assert ring.pressure_growth(radius, p, p) == pytest.approx(even * radius, rel=1e-12)


def test_unit_solid_disk():
    """Unit: a solid shaft is the limit of no bore, at its centre too."""
    solid = Ring(0.0, 20e-3, STEEL, temperature_rise=30.0, speed=OMEGA)
    hollow = replace(solid, inner_radius=1e-9)
    for radius in (5e-3, 20e-3):
        assert solid.growth(radius, outside=4e7) == pytest.approx(hollow.growth(radius, outside=4e7), rel=1e-12)
    b, nu, e = 20e-3, STEEL.poisson_ratio, STEEL.elastic_modulus
    assert solid.rotation_growth(b) == pytest.approx(STEEL.density * OMEGA**2 * b**3 * (1.0 - nu) / (4.0 * e))
    assert solid.pressure_growth(b, outside=4e7) == pytest.approx(-(1.0 - nu) * 4e7 * b / e)
    assert solid.growth(0.0, outside=4e7) == 0.0


def test_unit_thin_ring():
    """Unit: p r^2/(E t) under pressure and rho w^2 r^3/E in rotation, to the thinness t/r."""
    r, e = 50e-3, STEEL.elastic_modulus
    for thinness in (1e-2, 1e-3, 1e-4):
        t = thinness * r
        ring = Ring(r - 0.5 * t, r + 0.5 * t, STEEL, speed=1000.0)
        assert ring.pressure_growth(r, inside=1e6) == pytest.approx(1e6 * r**2 / (e * t), rel=thinness)
        assert ring.rotation_growth(r) == pytest.approx(STEEL.density * 1e6 * r**3 / e, rel=thinness)


@pytest.mark.parametrize("inner", [0.0, 8e-3])
def test_oracle_ring_against_a_boundary_value_solver(inner):
    """Oracle: equilibrium of the turning, heated, pressed ring solved for displacement and stress, to its 1e-8."""
    ring = Ring(inner, 20e-3, MATERIALS["titanium_6al4v"], temperature_rise=40.0, speed=3000.0)
    material, nu = ring.material, ring.material.poisson_ratio
    inside, outside = (6e7, 3e7) if inner else (0.0, 3e7)
    start = inner or 1e-5  # a solid disk is solved from a small core that strains evenly
    scale = 1e8 / material.elastic_modulus * 20e-3
    expansion = material.thermal_expansion * ring.temperature_rise

    def slopes(r, y):
        """d(u)/dr and d(sigma_r)/dr, with u in ``scale`` and sigma_r in 1e8 Pa."""
        u, radial = y[0] * scale, y[1] * 1e8
        hoop = nu * radial + material.elastic_modulus * (u / r - expansion)
        strain = (radial - nu * hoop) / material.elastic_modulus + expansion
        force = (hoop - radial) / r - material.density * ring.speed**2 * r
        return np.vstack((strain / scale, force / 1e8))

    def ends(left, right):
        # In a solid core radial and hoop stress agree: u/r = (1 - nu) sigma/E + alpha dT.
        core = left[0] * scale / start - (1.0 - nu) * left[1] * 1e8 / material.elastic_modulus - expansion
        first = left[1] + inside / 1e8 if inner else core / (scale / 20e-3)
        return np.array([first, right[1] + outside / 1e8])

    radii = np.geomspace(start, 20e-3, 400)
    solved = solve_bvp(slopes, ends, radii, np.vstack((radii / 20e-3, -np.ones(400))), tol=1e-9, max_nodes=50_000)
    assert solved.success
    for radius in np.linspace(start, 20e-3, 7)[1:]:
        expected = float(solved.sol(radius)[0]) * scale
        assert ring.growth(radius, inside, outside) == pytest.approx(expected, rel=1e-6)


@given(
    bore=st.floats(0.0, 0.9),
    wall=st.floats(1.05, 3.0),
    interference=st.floats(-200e-6, 200e-6),
    speed=st.floats(0.0, 3000.0),
    rises=st.tuples(st.floats(-50.0, 150.0), st.floats(-50.0, 150.0)),
    names=st.tuples(*2 * [st.sampled_from(["bearing_steel", "titanium_6al4v", "bronze", "silicon_nitride"])]),
)
@settings(max_examples=200, deadline=None)
def test_invariant_fits_match_and_never_pull(bore, wall, interference, speed, rises, names):
    """Invariant: no pull; a tight fit closes its gap and presses alike from both sides; a loose one has a gap."""
    r = 25e-3
    shaft = Ring(bore * r, r, MATERIALS[names[0]], rises[0], speed)
    ring = Ring(r, wall * r, MATERIALS[names[1]], rises[1], speed)
    pressure = interface_pressure(shaft, ring, interference)
    assert pressure >= 0.0
    gap = ring.growth(r, inside=pressure) - shaft.growth(r, outside=pressure) - 0.5 * interference
    if pressure > 0.0:
        # Round-off of displacements of some 100 um.
        assert abs(gap) < 1e-15
        # The difference formula is good to 1e-9 of stresses that run to GPa.
        assert stress(shaft, r, 0.0, pressure) == pytest.approx(-pressure, abs=1e3, rel=1e-5)
        assert stress(ring, r, pressure, 0.0) == pytest.approx(-pressure, abs=1e3, rel=1e-5)
    else:
        assert gap >= -1e-15


def test_unit_fit_comes_loose():
    """Unit: a loose fit has no pressure; a tight one loses it to speed and to a hot ring."""
    shaft, ring = Ring(0.0, 13.5e-3, STEEL), Ring(13.5e-3, 17.25e-3, STEEL)
    assert interface_pressure(shaft, ring, -5e-6) == interface_pressure(shaft, ring, 0.0) == 0.0
    cold = interface_pressure(shaft, ring, 5e-6)
    spun = interface_pressure(replace(shaft, speed=OMEGA), replace(ring, speed=OMEGA), 5e-6)
    assert 0.0 < spun < cold
    assert interface_pressure(shaft, replace(ring, temperature_rise=20.0), 5e-6) == 0.0


@pytest.mark.parametrize("ratio", [0.70, 0.75, 0.80, 0.85])
def test_literature_fit_loss(ratio):
    """Literature: on a solid shaft of like steel the raceway grows by bore/raceway of the interference: 0.7 to 0.85."""
    raceway = 17.25e-3
    rings = MountedRings(
        shaft=Ring(0.0, ratio * raceway, STEEL),
        inner_ring=Ring(ratio * raceway, raceway, STEEL),
        outer_ring=Ring(26.25e-3, 31e-3, STEEL),
        housing=Ring(31e-3, 45e-3, STEEL),
        inner_interference=10e-6,
        outer_interference=0.0,
    )
    mounted = mounted_clearance(20e-6, rings, 9e-3, STEEL)
    loss = -mounted.inner_fit / 10e-6
    assert loss == pytest.approx(ratio, rel=1e-12)
    assert 0.70 <= round(loss, 12) <= 0.85
    assert mounted.outer_fit == mounted.temperature == mounted.rotation == mounted.outer_pressure == 0.0


def test_literature_ten_kelvin():
    """Literature: an inner ring 10 K hotter than the outer takes about 5 um of a 43.5 mm bearing."""
    mounting = MOUNTING.model_copy(
        update={"inner_ring_temperature_C": 110.0, "outer_ring_temperature_C": 100.0, "rotation": False}
    )
    mounted = operating_clearance(mounting, BEARING, Materials(), OMEGA)
    # Rollers at the mean: alpha [52.5 (80 K) - 34.5 (90 K) - 2 (9) (85 K)] = -alpha 43.5 (10 K), exactly.
    assert mounted.temperature == pytest.approx(-12e-6 * 43.5e-3 * 10.0, rel=1e-9)
    assert mounted.temperature == pytest.approx(-5e-6, abs=0.5e-6)


def test_unit_uniform_heat_scales_a_steel_bearing():
    """Unit: all of one steel at one temperature, the loose parts only scale: no clearance beyond play times strain."""
    hot = {f"{part}_temperature_C": 220.0 for part in ("inner_ring", "outer_ring")}
    mounting = MOUNTING.model_copy(update=hot)
    mounted = operating_clearance(mounting, BEARING, Materials(), 0.0)
    assert abs(mounted.temperature) < 1e-18
    assert mounted.operating == pytest.approx(20e-6, rel=1e-12)
    hybrid = operating_clearance(mounting, BEARING, Materials(roller="silicon_nitride"), 0.0)
    assert hybrid.temperature == pytest.approx(2.0 * (12e-6 - 3.2e-6) * 200.0 * 9e-3, rel=1e-9)


@given(
    inner=st.floats(-30.0, 60.0),
    outer=st.floats(-30.0, 60.0),
    rpm=st.floats(-30000.0, 30000.0),
    outer_rpm=st.floats(-15000.0, 15000.0),
    hot=st.floats(-40.0, 250.0),
)
@settings(max_examples=100, deadline=None)
def test_invariant_contributions_add_up(inner, outer, rpm, outer_rpm, hot):
    """Invariant: the parts make up the whole; fits and inner speed only take clearance, outer speed only gives it."""
    mounting = MOUNTING.model_copy(
        update={
            "inner_interference_um": inner,
            "outer_interference_um": outer,
            "inner_ring_temperature_C": hot,
            "housing_material": "titanium_6al4v",
        }
    )
    speeds = (rpm * math.pi / 30.0, outer_rpm * math.pi / 30.0)
    mounted = operating_clearance(mounting, BEARING, Materials(), *speeds)
    parts = (mounted.inner_fit, mounted.outer_fit, mounted.temperature, mounted.rotation)
    assert mounted.operating == pytest.approx(mounted.initial + sum(parts), abs=1e-18)
    assert mounted.inner_fit <= 0.0 and mounted.outer_fit <= 0.0
    assert operating_clearance(mounting, BEARING, Materials(), speeds[0]).rotation <= 0.0
    assert operating_clearance(mounting, BEARING, Materials(), 0.0, speeds[1]).rotation >= 0.0
    # The sense of rotation does not matter.
    assert operating_clearance(mounting, BEARING, Materials(), *(-s for s in speeds)) == mounted


def test_unit_rotation_can_be_left_out():
    """Unit: without rotation, speed changes nothing; with it, 1.7 um of the diametral clearance go at 24000 rpm."""
    still = operating_clearance(MOUNTING.model_copy(update={"rotation": False}), BEARING, Materials(), OMEGA)
    assert still == operating_clearance(MOUNTING, BEARING, Materials(), 0.0)
    spun = operating_clearance(MOUNTING, BEARING, Materials(), OMEGA)
    assert spun.rotation == pytest.approx(-1.7e-6, abs=0.05e-6)
    # Two raceway growths of 0.84 um; a shaft that fits without interference is left behind by its ring.
    assert spun.inner_pressure == 0.0
    assert spun.operating == pytest.approx(20e-6 + spun.rotation, rel=1e-12)


def test_unit_temperatures_left_out():
    """Unit: a shaft follows its ring, a housing its own, rollers the mean; spelling it out changes nothing."""
    short = {"inner_ring_temperature_C": 120.0, "outer_ring_temperature_C": 90.0, "inner_interference_um": 12.0}
    long = {"shaft_temperature_C": 120.0, "housing_temperature_C": 90.0, "roller_temperature_C": 105.0}
    first = operating_clearance(MOUNTING.model_copy(update=short), BEARING, Materials(), OMEGA)
    assert first == operating_clearance(MOUNTING.model_copy(update=short | long), BEARING, Materials(), OMEGA)
    colder = operating_clearance(
        MOUNTING.model_copy(update=short | {"shaft_temperature_C": 100.0}), BEARING, Materials(), OMEGA
    )
    assert colder.inner_pressure < first.inner_pressure
    assert colder.operating > first.operating


def mounting_faults(**changes):
    """Sentences with which a mounting is refused."""
    table = {"bore_mm": 27.0, "outside_diameter_mm": 62.0, "housing_diameter_mm": 90.0} | changes
    with pytest.raises(InputError) as caught:
        validated(Mounting, table, "bearing.toml")
    return caught.value.faults


def test_unit_bad_mountings_are_refused():
    """Unit: each fault is one sentence with key, value and mend, all at once."""
    (fault,) = mounting_faults(shaft_bore_mm=27.0)
    assert "mounting.shaft_bore_mm = 27" in fault and "smaller" in fault
    two = mounting_faults(housing_diameter_mm=62.0, inner_interference_um=500.0)
    assert len(two) == 2
    assert "mounting.housing_diameter_mm = 62" in two[0] and "mounting.inner_interference_um = 500" in two[1]
    (fault,) = mounting_faults(outside_diameter_mm=27.0)
    assert "mounting.outside_diameter_mm = 27" in fault
    assert not list(misfits(MOUNTING, BEARING))
    tight = MOUNTING.model_copy(update={"bore_mm": 34.5, "outside_diameter_mm": 52.5})
    bore, outside = misfits(tight, BEARING)
    assert "mounting.bore_mm = 34.5" in bore and "34.5 mm" in bore and "smaller" in bore
    assert "mounting.outside_diameter_mm = 52.5" in outside and "larger" in outside


def test_unit_materials_expand():
    """Unit: every material has an expansion of its kind; numbers of one's own reach SI, steel's by default."""
    assert MATERIALS["silicon_nitride"].thermal_expansion < 4e-6 < 8e-6 < STEEL.thermal_expansion == 12e-6
    assert all(3e-6 < material.thermal_expansion < 50e-6 for material in MATERIALS.values())
    assert Material(206e9, 0.3, 7800.0).thermal_expansion == 12e-6
    numbers = {"elastic_modulus_GPa": 200.0, "poisson_ratio": 0.3, "density_kg_m3": 7800.0}
    assert material_of(CustomMaterial(**numbers)).thermal_expansion == pytest.approx(12e-6)
    invar = CustomMaterial(**numbers, thermal_expansion_1e_6_K=1.2)
    assert material_of(invar) == Material(200e9, 0.3, 7800.0, pytest.approx(1.2e-6))
    assert "thermal_expansion" in {field.name for field in fields(Material)}


def test_unit_scene_materials_expand():
    """Unit: a scene passes the expansion of its own materials on."""
    table = {
        "bearing": BEARING.model_dump(),
        "cage": {"guidance": "outer", "guide_clearance_mm": 0.15, "pocket_clearance_mm": 0.3, "mass_g": 45.0},
        "lubricant": {"oil": "MIL-L-7808", "temperature_C": 100.0},
        "operation": {"inner_speed_rpm": 24000.0, "radial_load_N": 1300.0},
        "materials": {
            "roller": {
                "elastic_modulus_GPa": 317.0,
                "poisson_ratio": 0.25,
                "density_kg_m3": 3240.0,
                "thermal_expansion_1e_6_K": 3.2,
            }
        },
    }
    scene = Scene.from_dict(copy.deepcopy(table))
    assert scene.material("roller").thermal_expansion == pytest.approx(3.2e-6)
    assert scene.material("rings") == STEEL
