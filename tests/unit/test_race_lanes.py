"""Race contacts in vectors: which may share one, and how lanes choose their race."""

import tomllib

import numpy as np
import pytest
from numba import njit
from typer.testing import CliRunner

from rbdyn.cli.app import app
from rbdyn.compiled.kernel import alike, either, kernel
from rbdyn.contact.hertz_line import LineContact, slice_contact
from rbdyn.contact.traction import TractionSurface
from rbdyn.dynamics.forces.bodies import RingMotion
from rbdyn.dynamics.forces.cage import NoPocket, pocket_contact, pocket_gap
from rbdyn.dynamics.forces.equations import motions
from rbdyn.dynamics.forces.race_lanes import OnRing, open_contact, race_forces, scratch, share_vectors, with_open_films
from rbdyn.dynamics.forces.races import RoundRace, race_observed, roller_radius
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.scene import Scene

compiled_alike = njit(lambda one, other: alike(one, other))
compiled_either = njit(lambda first, one, other: either(first, one, other))
compiled_share = njit(lambda one, other: share_vectors(one, other))


@njit
def compiled_films(bearing, ring, y, dy, space):
    nothing = OnRing(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    z = bearing.rollers
    return with_open_films(bearing.open_film, nothing, bearing.inner, bearing.sizes, ring, z, y, 0, dy, space)


@njit
def compiled_film(bearing, ring, y, j):
    z = bearing.rollers
    dx, dy, dvx, dvy = y[j] - ring.x, y[z + j] - ring.y, y[2 * z + j] - ring.vx, y[3 * z + j] - ring.vy
    radius = roller_radius(bearing.sizes, j)
    return open_contact(bearing.open_film, bearing.inner, radius, ring, dx, dy, dvx, dvy, y[4 * z + j])


@njit
def compiled_races(bearing, y, dy, space):
    _, _, inner, outer = motions(bearing, y)
    race_forces(bearing.outer, bearing.inner, bearing.sizes, outer, inner, bearing.rollers, y, 0, dy, space)


@njit
def compiled_contacts(bearing, y, j):
    _, _, inner, outer = motions(bearing, y)
    one = race_observed(bearing.outer, 1.0, bearing, y, j, outer)
    other = race_observed(bearing.inner, -1.0, bearing, y, j, inner)
    return one.x + other.x, one.y + other.y, one.roller_moment + other.roller_moment, one.load, other.load


@njit
def compiled_pocket(pocket, radius, ex, ey, dx, dy):
    gap = pocket_gap(pocket, radius, dy * ex - dx * ey, dx * ex + dy * ey)
    return gap, pocket_contact(pocket, radius, ex, ey, dx, dy, 0.0, 0.0, 900.0, 0.0)


def test_unit_alike_and_either(outer):
    """Unit: parameters of one type made of numbers are alike, others are not; a choice takes every number of one side."""
    bearing = roller_bearing(outer)
    assert compiled_alike(bearing.outer, bearing.inner) and alike(bearing.outer, bearing.inner)
    for first, expected in ((True, bearing.outer), (False, bearing.inner)):
        assert compiled_either(first, bearing.outer, bearing.inner) == expected
        assert either(first, bearing.outer, bearing.inner) == expected
    assert type(compiled_either(True, bearing.outer, bearing.inner).form) is RoundRace
    cut = slice_contact(LineContact(1e9), np.zeros(3), np.zeros(3), 0.0, 0.0)
    for one, other in ((cut, cut), (LineContact(1.0), RoundRace()), (cut, LineContact(1.0))):
        assert not compiled_alike(one, other) and not alike(one, other)
    assert compiled_either(True, LineContact(1.0), RoundRace()) == either(True, LineContact(1.0), RoundRace()) == ()


def test_unit_races_that_share_vectors(outer, everything):
    """Unit: the plain races share vectors; wavy ones with tables, or races of unlike laws, do not."""
    plain, rich = roller_bearing(outer), roller_bearing(everything)
    assert compiled_share(plain.outer, plain.inner) and not compiled_share(rich.outer, rich.inner)
    assert not compiled_share(plain.outer, plain.inner._replace(contact=rich.inner.contact))


def test_unit_races_with_tables_and_elasticity_share_vectors():
    """Unit: traction tables, which differ in size, and places in the state keep the two races of a catalogue bearing in one vector."""
    bearing = roller_bearing(Scene.from_dict(tomllib.loads(CliRunner().invoke(app, ["new", "NU210"]).stdout)))
    one, other = bearing.outer.traction, bearing.inner.traction
    assert type(one) is TractionSurface and one.cells.shape != other.cells.shape
    assert bearing.outer.tangential.start != bearing.inner.tangential.start
    assert compiled_share(bearing.outer, bearing.inner)


WAVES = "bearing.inner_waviness=[{order=3, amplitude_um=4.0}]"
LOBES = "bearing.outer_waviness=[{order=2, amplitude_um=8.0, phase_deg=90.0}, {order=17, amplitude_um=0.3}]"


@pytest.mark.parametrize(
    "assignments",
    [
        (),
        ("bearing.roller_profile=logarithmic",),
        ("bearing.tilt_mrad=2.0",),
        ("bearing.roller_profile=logarithmic", "bearing.tilt_mrad=0.4", "bearing.tilt_direction_deg=30"),
        (LOBES,),
        (LOBES, WAVES, "bearing.roller_diameter_spread_um=3.0", "bearing.roller_profile=logarithmic"),
    ],
)
def test_oracle_lanes_are_contacts(make_scene, assignments):
    """Oracle: side by side rollers feel what each feels alone, to the last bit, whatever waves and slices they meet."""
    bearing = roller_bearing(make_scene("bearing.rollers=13", "bearing.radial_clearance_mm=-0.02", *assignments))
    z, draw, loaded = bearing.rollers, np.random.default_rng(7), 0
    for _ in range(50):
        angle, y = np.arange(z) * 2.0 * np.pi / z + draw.uniform(0.0, 1.0), draw.normal(0.0, 1e-6, 5 * z + 16)
        distance = 21.75e-3 + draw.uniform(-15e-6, 15e-6, z)
        y[:z], y[z : 2 * z] = distance * np.cos(angle), distance * np.sin(angle)
        y[2 * z : 4 * z], y[4 * z : 5 * z] = draw.normal(0.0, 10.0, 2 * z), draw.normal(-7e3, 500.0, z)
        rates = np.zeros((1, y.size))
        compiled_races(bearing, y, rates, scratch(z))
        alone = np.array([compiled_contacts(bearing, y, j) for j in range(z)])
        together, touching = rates[0, 2 * z : 5 * z].reshape(3, z).T, (alone[:, 3:] > 0.0).all(axis=1)
        assert np.array_equal(together[touching], alone[touching, :3])
        # A contact out of reach is left out, where alone it gives round-off.
        assert together[~touching] == pytest.approx(alone[~touching, :3], rel=1e-12, abs=1e-12)
        loaded += np.count_nonzero(touching)
    assert 100 < loaded < 50 * z


@pytest.mark.parametrize(
    "assignments", [(), ("bearing.roller_diameter_spread_um=3.0", WAVES), ("bearing.tilt_mrad=2.0",)]
)
@pytest.mark.parametrize("layer", [(), ("lubricant.inlet_distance=5.0",)])
def test_invariant_rollers_without_a_film_feel_nothing_of_it(make_scene, assignments, layer):
    """Invariant: films leave out only rollers on which they act with nothing: those in contact and those too far away."""
    bearing = roller_bearing(make_scene("model.open_contact_film=true", *assignments, *layer))
    z, ring, draw = bearing.rollers, RingMotion(2e-6, -1e-6, 1e-3, 0.0, 2500.0, 1.0, 0.0), np.random.default_rng(4)
    for _ in range(200):
        angle, y = np.arange(z) * 2.0 * np.pi / z, draw.normal(0.0, 10.0, 5 * z + 10)
        distance = bearing.inner.radius + 4.5e-3 + draw.uniform(-12e-6, 40e-6, z)
        y[:z], y[z : 2 * z] = ring.x + distance * np.cos(angle), ring.y + distance * np.sin(angle)
        rates = np.zeros((1, y.size))
        sums = compiled_films(bearing, ring, y, rates, scratch(z))
        each = np.array([compiled_film(bearing, ring, y, j) for j in range(z)])
        assert np.array_equal(rates[0, 2 * z : 5 * z], each[:, :3].T.ravel())
        assert sums[2] == pytest.approx(each[:, 3].sum(), rel=1e-12) and np.count_nonzero(each[:, 3]) > 0


@pytest.mark.parametrize("assignments", [(), ("cage.guidance=roller", "cage.pocket_radial_clearance_mm=0.06")])
def test_invariant_nothing_acts_across_a_gap(make_scene, assignments):
    """Invariant: where a pocket has a way left it acts with nothing at all; where it acts it has none."""
    pocket = roller_bearing(make_scene(*assignments)).pocket
    draw = np.random.default_rng(5)
    acted = 0
    for _ in range(2000):
        dx, dy = 0.02175 + draw.uniform(-1e-4, 1e-4), draw.uniform(-2e-4, 2e-4)
        gap, wrench = compiled_pocket(pocket, 4.5e-3, 1.0, 0.0, dx, dy)
        assert (gap > 0.0) == (wrench[4] == 0.0)
        assert gap <= 0.0 or not any(wrench)
        acted += gap <= 0.0
    assert 100 < acted < 1900
    assert compiled_pocket(NoPocket(), 4.5e-3, 1.0, 0.0, 0.02, 0.0)[0] > 0.0


@kernel
def thrice(x):
    return 3.0 * x


calls_thrice = njit(lambda x: thrice(x))


def test_unit_kernels_answer_compiled_code_and_python():
    """Unit: a kernel compiled without wrappers serves compiled code, its twin serves Python, and both give the same."""
    assert calls_thrice(0.1) == thrice(0.1) == thrice.py_func(0.1)
    assert not thrice.twin.targetoptions["no_cpython_wrapper"] and thrice.targetoptions["no_cpython_wrapper"]
