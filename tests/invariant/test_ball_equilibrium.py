"""Equilibrium of a row of balls: 30 digits, closed forms, invariants, stiffness, rate, starts."""

import math

import numpy as np
import pytest
from ball_oracle import angles, doubled, root
from ball_scenes import AT_REST, CAGE, DEEP, HARD, LARGE, SMALL, balanced, model_of, scene
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp
from scipy.optimize import brentq

from rbdyn.properties.materials import MATERIALS
from rbdyn.quasistatic.row.equilibrium import solve
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of

STEEL = MATERIALS["bearing_steel"]
SQUARE = np.array([np.nan, np.nan, np.nan, 0.0, 0.0])
# Which components of load and displacement turn their sign when y does: forces along y, moments about x.
MIRROR_Y = np.array([1.0, -1.0, 1.0, -1.0, 1.0])
MIRROR_Z = np.array([1.0, 1.0, -1.0, -1.0, -1.0])


def turned(load, angle):
    """A load or displacement turned about the axis."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z, u, v = load
    return np.array([c * x - s * y, s * x + c * y, z, c * u - s * v, s * u + c * v])


@pytest.mark.parametrize("table", [SMALL, LARGE, DEEP], ids=["71808 outer", "218 hybrid", "209 with clearance"])
def test_oracle_equilibrium_to_30_digits(table):
    """Oracle: the root of all equations written once more, found to 30 digits, is this solution to 1e-10 and better."""
    case = scene(table)
    load, given = load_of(case), constraint_of(case)
    found = balanced(*row_of(case)[:2], load, given)
    exact, rough = doubled(table, STEEL, STEEL)
    q, balls, worst = root(exact, rough, found.displacement, found.balls, load, np.isnan(given))
    assert worst < mp.mpf(10) ** -30
    place = np.array([float(value) for value in q])
    assert found.displacement[:3] == pytest.approx(place[:3], rel=0.0, abs=1e-12 * np.abs(place[:3]).max())
    assert found.displacement[3:] == pytest.approx(place[3:], rel=0.0, abs=1e-10 * np.abs(place).max())
    loaded = 0
    for j, (x, y) in enumerate(balls):
        centre = exact.place(q, j)
        _, _, loads, (pull, moment) = exact.ball(*centre, x, y)
        assert (found.inner_load[j], found.outer_load[j]) == pytest.approx(loads, rel=1e-10)
        assert found.centrifugal_force[j] == pytest.approx(float(pull), rel=1e-10)
        assert found.gyroscopic_moment[j] == pytest.approx(float(moment), rel=1e-9, abs=1e-15)
        inner, outer = angles(*(float(value) for value in (*centre, x, y)))
        assert found.outer_angle[j] == pytest.approx(outer, abs=1e-10)
        if loads[0] > 0:
            loaded += 1
            assert found.inner_angle[j] == pytest.approx(inner, abs=1e-10)
    assert loaded == (exact.size if table is not DEEP else 4)


@pytest.mark.parametrize("equal", [True, False])
@pytest.mark.parametrize("thrust", [20.0, 17_800.0, 300_000.0])
def test_literature_contact_angle_under_thrust(equal, thrust):
    """Literature: F_a/(Z K B^1.5) = sin a (cos a0/cos a - 1)^1.5 of a ball bearing at rest (Jones; Harris), to 1e-9.

    K of both contacts in series, whatever their grooves.
    """
    factor = 0.5232 if equal else 0.5350
    row, control = model_of(LARGE, operation=AT_REST, model=HARD, bearing={"outer_groove_factor": factor})
    found = balanced(row, control, np.array([0.0, 0.0, thrust, 0.0, 0.0]))
    between, angle = (0.5232 + factor - 1.0) * 22.225e-3, math.radians(40.0)
    series = (row.inner_stiffness ** (-2 / 3) + row.outer_stiffness ** (-2 / 3)) ** -1.5
    unit = 16 * series * between**1.5

    def lacking(a):
        return math.sin(a) * (math.cos(angle) / math.cos(a) - 1.0) ** 1.5 - thrust / unit

    a = brentq(lacking, angle, 1.5, xtol=1e-15)
    assert found.inner_angle == pytest.approx(np.full(16, a), abs=1e-9)
    assert found.outer_angle == pytest.approx(found.inner_angle, abs=1e-12)
    assert found.inner_load == pytest.approx(np.full(16, thrust / (16 * math.sin(a))), rel=1e-9)
    # Approach: B sin(a - a0)/cos a.
    assert found.displacement[2] == pytest.approx(between * math.sin(a - angle) / math.cos(a), rel=1e-9)


@pytest.mark.parametrize("clearance", [0.0, 0.015, 0.2])
def test_literature_radial_load_on_a_deep_groove_bearing(clearance):
    """Literature: Q = K (d_r cos psi - P_d/2)^1.5 (Stribeck, Sjovall), the axial shift of the clearance taken back."""
    row, control = model_of(DEEP, operation=AT_REST, bearing={"radial_clearance_mm": clearance})
    load = 8900.0
    found = balanced(row, control, np.array([load, 0.0, 0.0, 0.0, 0.0]), SQUARE)
    series = (row.inner_stiffness ** (-2 / 3) + row.outer_stiffness ** (-2 / 3)) ** -1.5

    def loads(shift):
        return series * np.maximum(shift * row.cosine - 0.5e-3 * clearance, 0.0) ** 1.5

    shift = brentq(lambda x: float(loads(x) @ row.cosine) - load, 1e-7, 1e-3, xtol=1e-18)
    assert found.displacement[0] == pytest.approx(shift, rel=1e-9)
    assert found.displacement[2] == pytest.approx(-row.axial[0], abs=1e-12)
    assert found.inner_load == pytest.approx(loads(shift), rel=1e-8, abs=1e-8)
    assert found.outer_load == pytest.approx(found.inner_load, rel=1e-9, abs=1e-8)


def test_limit_stribeck_number():
    """Limit: many balls and no clearance: the most loaded one bears 4.37 F/Z."""
    row, control = model_of(
        DEEP, operation=AT_REST, bearing={"balls": 100, "ball_diameter_mm": 1.5, "radial_clearance_mm": 0.0}
    )
    found = balanced(row, control, np.array([300.0, 0.0, 0.0, 0.0, 0.0]), SQUARE)
    assert found.inner_load.max() * 100 / 300.0 == pytest.approx(4.37, abs=0.01)


FORCE = st.floats(-1.0, 1.0)


@given(pitches=st.integers(1, 28), x=FORCE, y=FORCE, z=FORCE, u=FORCE, v=FORCE)
@settings(max_examples=20, deadline=None)
def test_invariant_load_turned_by_a_pitch_permutes_the_balls(pitches, x, y, z, u, v):
    """Invariant: a load turned by some ball pitches turns the displacement and hands each ball's load on."""
    row, control = model_of(SMALL, operation={"tilt": "free"})
    load = np.array([300.0 * x, 300.0 * y, 500.0 + 300.0 * z, 2.0 * u, 2.0 * v])
    angle = 2.0 * math.pi * pitches / 29
    one, other = balanced(row, control, load), balanced(row, control, turned(load, angle))
    assert other.displacement == pytest.approx(turned(one.displacement, angle), rel=0.0, abs=1e-13)
    assert other.inner_load == pytest.approx(np.roll(one.inner_load, pitches), rel=1e-8, abs=1e-8)
    assert other.outer_angle == pytest.approx(np.roll(one.outer_angle, pitches), rel=0.0, abs=1e-9)
    assert other.gyroscopic_moment == pytest.approx(np.roll(one.gyroscopic_moment, pitches), rel=1e-8, abs=1e-12)


@given(x=FORCE, y=FORCE, z=FORCE, u=FORCE, v=FORCE)
@settings(max_examples=20, deadline=None)
def test_invariant_mirror_images(x, y, z, u, v):
    """Invariant: a mirrored load mirrors everything: in the plane of x and z, and without contact angle in that of the balls."""
    load = np.array([800.0 * x, 800.0 * y, 800.0 * z, 4.0 * u, 4.0 * v])
    row, control = model_of(DEEP, bearing={"radial_clearance_mm": -0.01})
    plain = balanced(row, control, load)
    for signs, order in ((MIRROR_Y, -np.arange(9) % 9), (MIRROR_Z, np.arange(9))):
        mirrored = balanced(row, control, signs * load)
        assert mirrored.displacement == pytest.approx(signs * plain.displacement, rel=0.0, abs=1e-12)
        assert mirrored.inner_load == pytest.approx(plain.inner_load[order], rel=1e-7, abs=1e-7)
        side = signs[2]
        assert mirrored.outer_angle == pytest.approx(side * plain.outer_angle[order], rel=0.0, abs=1e-8)


CASES = {
    "71808": model_of(SMALL),
    "218": model_of(LARGE),
    "218 cage": model_of(LARGE, model=CAGE),
    "209": model_of(DEEP),
    "209 cage": model_of(DEEP, model=CAGE),
}
LOADS = {"71808": np.array([150.0, -40.0, 260.0, 0.6, -0.9]), "218": load_of(scene(LARGE)), "209": load_of(scene(DEEP))}


def case(name):
    """Row, control and load."""
    return *CASES[name], LOADS[name.split()[0]]


@pytest.mark.parametrize("name", CASES)
def test_invariant_stiffness_is_the_slope_of_the_reaction(name):
    """Invariant: the stiffness matrix against differences of the equilibrium at prescribed displacements.

    With one common cage speed there is an energy, and the matrix is symmetric.
    """
    row, control, load = case(name)
    found = balanced(row, control, load)
    unit = np.array([1.0, 1.0, 1.0, row.lever, row.lever])
    scaled = found.stiffness / np.outer(unit, unit)
    largest = np.abs(scaled).max()
    for i in range(5):
        step = np.zeros(5)
        step[i] = 2e-9 / unit[i]
        ahead, behind = (
            solve(row, control, load, found.displacement + side * step, found).reaction for side in (1.0, -1.0)
        )
        slope = (ahead - behind) / 4e-9 / unit
        assert scaled[:, i] == pytest.approx(slope, rel=0.0, abs=1e-6 * largest)
    gap = np.abs(scaled - scaled.T).max()
    assert gap < 1e-10 * largest if "cage" in name else gap > 1e-5 * largest
    assert np.linalg.eigvalsh(scaled + scaled.T).min() > 0.0


@pytest.mark.parametrize("name", CASES)
def test_rate_newton_with_this_stiffness_squares_its_error(name):
    """Rate: Newton's method on the ring alone, with the reaction and stiffness of prescribed displacements, is of order two."""
    row, control, load = case(name)
    found = balanced(row, control, load)
    unit = np.array([1.0, 1.0, 1.0, row.lever, row.lever])
    q = found.displacement + np.array([3e-7, -2e-7, 4e-7, 0.0, 0.0])
    errors = []
    for _ in range(4):
        errors.append(float(np.abs((q - found.displacement) * unit).max()))
        told = solve(row, control, load, q, found)
        q = q + np.linalg.solve(told.stiffness, load - told.reaction)
    orders = [
        math.log(errors[k + 2] / errors[k + 1]) / math.log(errors[k + 1] / errors[k])
        for k in range(2)
        if errors[k + 2] > 1e-15
    ]
    assert orders and min(orders) > 1.75


@pytest.mark.parametrize("name", CASES)
def test_rate_a_near_start_takes_few_steps(name):
    """Rate: from the solution itself no step, from 1e-10 m away one, from 1e-7 m a few, and the same equilibrium."""
    row, control, load = case(name)
    found = balanced(row, control, load)
    assert solve(row, control, load, start=found).steps == 0
    for away, most in ((1e-10, 2), (1e-7, 4)):
        start = found._replace(
            displacement=found.displacement + np.array([away, -away, away, 0.0, 0.0]), balls=found.balls + 0.3 * away
        )
        again = balanced(row, control, load, start=start)
        assert 1 <= again.steps <= most
        assert again.displacement == pytest.approx(found.displacement, rel=0.0, abs=1e-12)


@pytest.mark.parametrize("name", ["218 cage", "209 cage"])
@given(move=st.lists(FORCE, min_size=5, max_size=5), size=st.floats(-7.0, -3.3), shaken=st.floats(0.0, 1.0))
@settings(max_examples=15, deadline=None)
def test_invariant_convex_equilibrium_wherever_it_starts(name, move, size, shaken):
    """Invariant: with one common cage speed every start leads to the one equilibrium, half a millimetre away or shaken."""
    row, control, load = case(name)
    found = balanced(row, control, load)
    lever = np.array([1.0, 1.0, 1.0, row.lever, row.lever])
    away = np.array(move) * 10.0**size / lever
    draw = np.random.default_rng(int(1e6 * shaken))
    start = found._replace(
        displacement=found.displacement + away,
        balls=found.balls * (1.0 + 0.2 * shaken * draw.uniform(-1.0, 1.0, found.balls.shape)),
        depths=found.depths * (1.0 + shaken * draw.uniform(-1.0, 1.0, found.depths.shape)),
    )
    again = balanced(row, control, load, start=start)
    assert again.displacement * lever == pytest.approx(found.displacement * lever, rel=0.0, abs=1e-12)
    assert again.inner_load == pytest.approx(found.inner_load, rel=1e-7, abs=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_invariant_prescribed_displacement_gives_back_the_load(name):
    """Invariant: the solved displacement, prescribed in any part, gives back load and stiffness."""
    row, control, load = case(name)
    unit = np.array([1.0, 1.0, 1.0, row.lever, row.lever])
    found = balanced(row, control, load)
    for kept in ([True] * 5, [False, False, True, False, False], [True, False, True, False, True]):
        given = np.where(kept, found.displacement, np.nan)
        again = balanced(row, control, load, given)
        assert again.displacement == pytest.approx(found.displacement, rel=0.0, abs=1e-12)
        assert (again.reaction - load) / unit == pytest.approx(np.zeros(5), abs=1e-9 * np.abs(load).max())
        gap = (again.stiffness - found.stiffness) / np.outer(unit, unit)
        assert np.abs(gap).max() < 1e-6 * found.stiffness[0, 0]
    # A load along a prescribed displacement is not used.
    other = solve(row, control, np.array([1e6, 0.0, -3e5, 7.0, 0.0]), found.displacement)
    assert (other.reaction - load) / unit == pytest.approx(np.zeros(5), abs=1e-9 * np.abs(load).max())


@given(radial=FORCE, thrust=st.floats(0.2, 1.0), tilt=FORCE)
@settings(max_examples=20, deadline=None)
def test_limit_nothing_turns(radial, thrust, tilt):
    """Limit: at rest both contacts of a ball have one angle and one load, whatever the race control."""
    row, control = model_of(LARGE, operation=AT_REST, model=HARD)
    found = balanced(row, control, np.array([9000.0 * radial, 500.0, 20_000.0 * thrust, 0.0, 150.0 * tilt]))
    loaded = found.inner_load > 1e-6 * found.inner_load.max()
    assert found.inner_angle[loaded] == pytest.approx(found.outer_angle[loaded], rel=0.0, abs=1e-8)
    assert found.inner_load == pytest.approx(found.outer_load, rel=1e-8, abs=1e-6)
    assert not found.centrifugal_force.any() and not found.gyroscopic_moment.any()


@pytest.mark.parametrize("name", ["71808", "218", "209"])
def test_invariant_action_and_reaction(name):
    """Invariant: load on the inner ring, forces of the outer race on the balls and centrifugal forces sum to nothing.

    From what is reported of each ball: normal loads, angles, and the friction that takes the gyroscopic moment.
    """
    row, control, load = case(name)
    found = balanced(row, control, load)
    spinning = control.spinning
    if name == "218":
        weight = control.inner_weight * (found.depths[:, 0] / found.depths[:, 1]) ** 2
        share = weight / (1.0 + weight)
    else:
        share = np.full(row.cosine.size, control.inner)
    friction = 2.0 * (1.0 - share) * found.gyroscopic_moment / spinning.ball_diameter
    assert np.all(np.abs(friction) < 0.8 * spinning.friction * found.outer_load)
    s, c = np.sin(found.outer_angle), np.cos(found.outer_angle)
    axial = -found.outer_load * s + friction * c
    radial = -found.outer_load * c - friction * s + found.centrifugal_force
    total = load[:3] + np.array([radial @ row.cosine, radial @ row.sine, axial.sum()])
    assert np.abs(total).max() < 1e-9 * np.abs(load[:3]).max()


@pytest.mark.parametrize("table", [SMALL, LARGE, DEEP])
@pytest.mark.parametrize("model", [CAGE, HARD])
def test_limit_a_ring_without_load_floats(table, model):
    """Limit: without a load the balls rest on the outer race under their centrifugal force, and the ring touches none."""
    row, control = model_of(table, model=model)
    found = balanced(row, control, np.zeros(5))
    assert found.outer_load == pytest.approx(np.full(row.cosine.size, row.centrifugal_force), rel=1e-9)
    assert found.inner_load.max() < 1e-9 * row.centrifugal_force
    assert found.outer_angle == pytest.approx(np.zeros(row.cosine.size), abs=1e-9)


def test_invariant_preload_by_force_and_by_displacement():
    """Invariant: a spring's force adds to the load bit for bit; a nut that goes in so far needs that force."""
    apart, together = (
        scene(LARGE, operation={"load_N": None, "radial_load_N": 3000.0, "axial_load_N": z, "preload_N": p})
        for z, p in ((5000.0, 2000.0), (7000.0, 0.0))
    )
    row, control = row_of(apart)[:2]
    by_force = balanced(row, control, load_of(apart), constraint_of(apart))
    assert np.array_equal(by_force.displacement, balanced(row, control, load_of(together)).displacement)
    nut = scene(
        LARGE, operation={"load_N": None, "radial_load_N": 3000.0, "preload_um": 1e6 * float(by_force.displacement[2])}
    )
    by_nut = balanced(row, control, load_of(nut), constraint_of(nut))
    assert by_nut.reaction == pytest.approx(by_force.reaction, rel=1e-8, abs=1e-5)


def test_limit_without_friction_no_gyroscopic_moment_is_held():
    """Limit: where friction can hold next to nothing, the equilibrium is that of balls without a moment of inertia."""
    row, control = model_of(SMALL, operation={"tilt": "free"})
    loose = control._replace(spinning=control.spinning._replace(friction=1e-9))
    slack = balanced(row, loose, LOADS["71808"])
    without = control._replace(spinning=control.spinning._replace(inertia=0.0))
    assert slack.displacement == pytest.approx(balanced(row, without, LOADS["71808"]).displacement, rel=1e-6)
