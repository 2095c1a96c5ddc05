"""The cage pocket: film of a wall against Reynolds' equation, its wrench, hand-over to contact, and the lips."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.integrate import quad
from scipy.optimize import brentq

from rbdyn.contact.damping import HuntCrossleyDamping, NoDamping
from rbdyn.contact.hertz_line import LineContact
from rbdyn.contact.pocket_film import pocket_film, wall_film
from rbdyn.contact.traction import CoulombTraction, NoTraction
from rbdyn.dynamics.pocket import LippedPocket, LubricatedPocket, Pocket, pocket_contact, pocket_energy

VISCOSITY, RADIUS, LENGTH, FLOOR = 2.87e-3, 4.5e-3, 5e-3, 0.8e-6
FILM = pocket_film(VISCOSITY, RADIUS, LENGTH, FLOOR, 1.0)
CONTACT = LineContact(3.73e8)
HALF = 0.15e-3
DRY = Pocket(HALF, RADIUS, CONTACT, HuntCrossleyDamping(0.75), CoulombTraction(0.05, 0.02))
WET = LubricatedPocket(DRY._replace(half_clearance=HALF - FLOOR), FILM, HALF, RADIUS)
LIPPED = LippedPocket(
    DRY, 21.75e-3, 30e-6, RADIUS, CONTACT, HuntCrossleyDamping(0.75), CoulombTraction(0.05, 0.02)
)
LIPPED_WET = LIPPED._replace(walls=WET)
POCKETS = {"dry": DRY, "wet": WET, "lips": LIPPED, "lips, wet": LIPPED_WET}


@njit
def compiled_pocket(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    return pocket_contact(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed)


def reynolds(gap):
    """Martin's load, shear and rolling force of a rigid cylinder on a plane at unit entrainment, by quadrature.

    With x = sqrt(2 R h) tan(g) the half-Sommerfeld pressure is 12 eta u sqrt(2 R h)/h^2 [g/2 + sin(2g)/4 - s (3g/8 +
    sin(2g)/4 + sin(4g)/32) + c], where the film ends at g_2 with pressure and slope of nil, s = 1/cos^2(g_2).
    """

    def shape(g, s):
        return (
            0.5 * g
            + 0.25 * math.sin(2.0 * g)
            - s * (3.0 * g / 8.0 + math.sin(2.0 * g) / 4.0 + math.sin(4.0 * g) / 32.0)
        )

    def at_inlet(end):
        s = 1.0 / math.cos(end) ** 2
        return shape(-0.5 * math.pi, s) - shape(end, s)

    end = brentq(at_inlet, 0.1, 1.2, xtol=1e-15)
    s = 1.0 / math.cos(end) ** 2
    width = math.sqrt(2.0 * RADIUS * gap)
    scale = 12.0 * VISCOSITY * width / gap**2

    def pressure(g):
        return scale * (shape(g, s) - shape(end, s))

    def over(function):
        return quad(lambda g: function(g) * width / math.cos(g) ** 2, -0.5 * math.pi, end, epsrel=1e-11)[0]

    load = over(pressure)
    # Rolling force per surface: half the gap times the pressure's slope, whose integral over the film is the moment of
    # the pressure about the line of centres, over the radius.
    rolling = -over(lambda g: pressure(g) * width * math.tan(g)) / (2.0 * RADIUS)
    return load * LENGTH, rolling * LENGTH


@pytest.mark.parametrize("gap", [1e-6, 1e-5, 1e-4])
def test_literature_martin(gap):
    """Literature: load 4.895 eta u l R/h and rolling force 4.60 eta u l sqrt(R/h) per surface, as Reynolds' equation of
    a rigid cylinder with the film torn off where its pressure ends flat gives them (printed digits).
    """
    load, rolling = reynolds(gap)
    # Half the entrainment is 1 m/s: both surfaces run at 1 m/s.
    push, tangential, on_roller, power = wall_film(FILM, gap, 0.0, 1.0, 1.0)
    assert push == pytest.approx(load, rel=2e-3)
    assert tangential == pytest.approx(-on_roller, rel=1e-12)
    assert -on_roller == pytest.approx(rolling, rel=5e-3)
    assert power == pytest.approx(2.0 * tangential, rel=1e-12)


@pytest.mark.parametrize("gap", [2e-6, 5e-5])
def test_literature_squeeze_and_shear(gap):
    """Literature: squeeze force 3 sqrt(2) pi eta l (R/h)^1.5 v and shear pi sqrt(2) eta U l sqrt(R/h), by quadrature."""
    push, *_ = wall_film(FILM, gap, 0.3, 0.0, 0.0)

    def film(x):
        return gap + x * x / (2.0 * RADIUS)

    # dp/dx = 12 eta v x/h^3 without rolling; the load is minus the first moment of that slope.
    far = 1000.0 * math.sqrt(2.0 * RADIUS * gap)
    slope = quad(lambda x: 12.0 * VISCOSITY * 0.3 * x * x / film(x) ** 3, -far, far, points=[0.0], limit=500)[
        0
    ]
    assert push == pytest.approx(slope * LENGTH, rel=1e-5)
    _, sliding, *_ = wall_film(FILM, gap, 0.0, -0.5, 0.5)
    couette = quad(lambda x: VISCOSITY * 1.0 / film(x), -far, far, points=[0.0], limit=500)[0]
    # Beyond a thousand half-widths a share of 2/(pi 1000) of the shear is left.
    assert sliding == pytest.approx(couette * LENGTH, rel=1e-3)


def test_unit_squeeze_never_pulls():
    """Unit: a parting film gives no squeeze force; below its floor the film counts as that thick."""
    assert wall_film(FILM, 1e-5, -2.0, 0.0, 0.0)[0] == 0.0
    assert wall_film(FILM, -1e-6, 0.1, 3.0, 1.0) == wall_film(FILM, FLOOR, 0.1, 3.0, 1.0)
    assert wall_film(FILM, 1e-5, 0.0, 0.0, 0.0) == (0.0, 0.0, 0.0, 0.0)


@given(gap=st.floats(1e-7, 3e-4), roller=st.floats(-60.0, 60.0), wall=st.floats(-60.0, 60.0))
@settings(max_examples=200, deadline=None)
def test_invariant_steady_sliding_costs_power(gap, roller, wall):
    """Invariant: at a steady gap the film takes power and pushes, whichever way the surfaces run."""
    push, tangential, on_roller, power = wall_film(FILM, gap, 0.0, roller, wall)
    assert push >= 0.0 and power >= 0.0
    on_wall = -tangential
    # What the film takes from both surfaces, but for the pressure's couple on the wall, which does not turn.
    assert power == pytest.approx(-(on_roller * roller + on_wall * wall), rel=1e-9, abs=1e-12)


motions = st.tuples(
    st.floats(-math.pi, math.pi),  # mid-line
    st.floats(-1.6e-4, 1.6e-4),  # offset
    st.floats(-6e-5, 6e-5),  # height above the orbit
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(-7e3, 7e3),
    st.floats(-1.5e3, 1.5e3),
)


def wrench(pocket, motion, call=compiled_pocket):
    """``pocket_contact`` and its arguments, for velocities on top of those of the turning cage."""
    angle, offset, height, across, along, spin, cage = motion
    ex, ey = math.cos(angle), math.sin(angle)
    height += 21.75e-3
    dx, dy = height * ex - offset * ey, height * ey + offset * ex
    vx, vy = along * ex - across * ey - cage * dy, along * ey + across * ex + cage * dx
    arguments = (RADIUS, ex, ey, dx, dy, vx, vy, spin, cage)
    return arguments, call(pocket, *arguments)


@pytest.mark.parametrize("name", POCKETS)
@given(motion=motions)
@settings(max_examples=80, deadline=None)
def test_invariant_pocket_wrench(name, motion):
    """Invariant: no moment is left over between roller and cage; what both lose is what is booked or stored."""
    pocket, (_, offset, height, *_) = POCKETS[name], motion
    # The difference below must not step over a wall or lip that is about to touch.
    limits = (abs(offset) - HALF, abs(offset) - HALF + FLOOR, abs(height) - LIPPED.half_clearance)
    assume(min(map(abs, limits)) > 1e-8)
    (_, ex, ey, dx, dy, vx, vy, spin, cage), found = wrench(pocket, motion)
    fx, fy, on_roller, on_cage, load, friction, damping, film = found
    size = abs(fx) + abs(fy)
    assert dx * fy - dy * fx + on_roller + on_cage == pytest.approx(0.0, abs=1e-13 * size + 1e-18)
    # The pocket turns: the energy's rate by a difference along the motion.
    step = 1e-10

    def energy(time):
        c, s = math.cos(cage * time), math.sin(cage * time)
        return pocket_energy(pocket, RADIUS, c * ex - s * ey, s * ex + c * ey, dx + vx * time, dy + vy * time)

    stored = (energy(step) - energy(-step)) / (2.0 * step)
    lost = -(fx * vx + fy * vy + on_roller * spin + on_cage * cage)
    # What is stored and what is lost may cancel.
    tolerance = 1e-6 * (abs(stored) + damping + friction) + 1e-5 * size + 1e-9
    assert lost == pytest.approx(friction + damping + film + stored, rel=1e-5, abs=tolerance)
    assert load >= 0.0 and friction >= 0.0 and damping >= 0.0


@pytest.mark.parametrize("name", POCKETS)
def test_invariant_pocket_sees_no_common_rotation(name):
    """Invariant: roller and cage that turn as one rigid body feel no film and no friction, whatever the speed."""
    for speed in (0.0, 900.0, -2000.0):
        for offset in (0.0, 1e-4, -1.49e-4):
            _, found = wrench(POCKETS[name], (0.7, offset, 0.0, 0.0, 0.0, speed, speed))
            assert np.abs(found).max() < 1e-10


@pytest.mark.parametrize("name", POCKETS)
@given(motion=motions)
@settings(max_examples=40, deadline=None)
def test_unit_pocket_compiled_equals_interpreted(name, motion):
    """Unit: compiled equals interpreted, to the round-off of the approach."""
    _, found = wrench(POCKETS[name], motion)
    _, expected = wrench(POCKETS[name], motion, pocket_contact)
    for mine, theirs in zip(found, expected, strict=True):
        assert mine == pytest.approx(theirs, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_unit_film_hands_over_to_contact(side):
    """Unit: at the floor the film is as thick as it gets thin and contact begins; beyond, contact grows from nil."""
    for gap, closed in ((FLOOR + 1e-9, False), (FLOOR - 1e-9, True)):
        _, found = wrench(WET, (0.0, side * (HALF - gap), 0.0, 0.0, 0.0, 0.0, 0.0))
        assert (found[4] > 0.0) == closed
        assert found[4] < CONTACT.stiffness * 1e-9 ** (10.0 / 9.0) * (1.0 + 1e-6)
    _, dry = wrench(DRY, (0.0, side * (HALF + 2e-6), 0.0, 0.0, 0.0, 0.0, 0.0))
    _, wet = wrench(WET, (0.0, side * (HALF + 2e-6 - FLOOR), 0.0, 0.0, 0.0, 0.0, 0.0))
    assert wet[4] == pytest.approx(dry[4], rel=1e-9)


def test_unit_lips_hold_radially():
    """Unit: inside its play a lipped pocket is the plain one; past it, it pushes back along the mid-line."""
    plain = Pocket(HALF, RADIUS, CONTACT, NoDamping(), NoTraction())
    lipped = LippedPocket(plain, 21.75e-3, 30e-6, RADIUS, CONTACT, NoDamping(), NoTraction())
    for height in (0.0, 29e-6, -29e-6):
        motion = (0.3, 1e-5, height, 0.0, 0.0, 100.0, 900.0)
        assert wrench(lipped, motion)[1] == wrench(plain, motion)[1] == (0.0,) * 8
    for height in (33e-6, -33e-6):
        _, found = wrench(lipped, (0.3, 0.0, height, 0.0, 0.0, 0.0, 0.0))
        expected = -math.copysign(CONTACT.stiffness * 3e-6 ** (10.0 / 9.0), height)
        along = (
            found[0] * math.cos(0.3) + found[1] * math.sin(0.3),
            found[1] * math.cos(0.3) - found[0] * math.sin(0.3),
        )
        assert along == pytest.approx((expected, 0.0), rel=1e-9, abs=1e-9)


def test_unit_scene_makes_the_pocket(make_scene):
    """Unit: film, floor, lips and restitution of a scene reach the pocket."""
    from rbdyn.contact.damping import alpha_of_restitution
    from rbdyn.dynamics.model import roller_bearing

    scene = make_scene(
        "cage.guidance=roller", "cage.pocket_radial_clearance_mm=0.06", "model.pocket_film=true",
        "model.pocket_film_floor_um=1.5", "model.pocket_fill=0.5", "model.pocket_restitution=0.6",
    )  # fmt: skip
    pocket = roller_bearing(scene).pocket
    assert isinstance(pocket, LippedPocket) and isinstance(pocket.walls, LubricatedPocket)
    assert pocket.half_clearance == pytest.approx(30e-6) and pocket.orbit_radius == pytest.approx(21.75e-3)
    assert pocket.walls.half_clearance == pytest.approx(150e-6)
    assert pocket.walls.walls.half_clearance == pytest.approx(148.5e-6)
    assert pocket.walls.film.floor == pytest.approx(1.5e-6)
    alpha = alpha_of_restitution(0.6, 0.5)
    assert pocket.damping.alpha == pocket.walls.walls.damping.alpha == pytest.approx(alpha, rel=1e-12)
    half = roller_bearing(make_scene("model.pocket_film=true", "model.pocket_fill=0.5")).pocket.film
    full = roller_bearing(make_scene("model.pocket_film=true")).pocket.film
    assert [2.0 * value for value in half[:4]] == pytest.approx(full[:4], rel=1e-12)
