"""The cage pocket: film of a wall against Reynolds' equation, its wrench, hand-over to contact, and the lips."""

import math

import numpy as np
import pytest
from conftest import UNSAMPLED
from film_oracle import complementary_film, quadrature_shape
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.integrate import quad

from rbdyn.contact.cage_film import film_shape, pocket_film, wall_film
from rbdyn.contact.damping import HuntCrossleyDamping, NoDamping
from rbdyn.contact.hertz_line import LineContact
from rbdyn.contact.traction import CoulombTraction, NoTraction
from rbdyn.dynamics.forces.cage import LippedPocket, LubricatedPocket, Pocket, pocket_contact, pocket_energy
from rbdyn.dynamics.forces.state import LOADS, POCKET_CONTACT_LOAD, POCKET_LOAD
from rbdyn.dynamics.integrators.advance import book_peaks, book_point, empty_tally

VISCOSITY, RADIUS, LENGTH, FLOOR = 2.87e-3, 4.5e-3, 5e-3, 0.8e-6
FILM = pocket_film(VISCOSITY, RADIUS, LENGTH, FLOOR, 1.0)
CONTACT = LineContact(3.73e8)
HALF = 0.15e-3
DRY = Pocket(HALF, RADIUS, CONTACT, HuntCrossleyDamping(0.75), CoulombTraction(0.05, 0.02))
WET = LubricatedPocket(DRY._replace(half_clearance=HALF - FLOOR), FILM, HALF, RADIUS)
LIPPED = LippedPocket(DRY, 21.75e-3, 30e-6, RADIUS, CONTACT, HuntCrossleyDamping(0.75), CoulombTraction(0.05, 0.02))
LIPPED_WET = LIPPED._replace(walls=WET)
POCKETS = {"dry": DRY, "wet": WET, "lips": LIPPED, "lips, wet": LIPPED_WET}


@njit
def compiled_pocket(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    return pocket_contact(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed)


# Ratios of squeeze to wedge, from parting fast to closing fast.
SIGMA = (-100.0, -30.0, -10.0, -3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 3.0, 10.0, 100.0)


def closing_at(sigma, entrainment, gap):
    """Closing speed [m/s] at a ratio of squeeze to wedge."""
    return sigma * abs(entrainment) * math.sqrt(gap / (2.0 * RADIUS))


@pytest.mark.parametrize("gap", [1e-6, 1e-5, 1e-4])
def test_literature_martin(gap):
    """Literature: load 4.895 eta u l R/h and rolling force 4.60 eta u l sqrt(R/h) per surface of steady rolling (Martin
    1916 with Reynolds' boundary; printed digits).
    """
    # Half the sum of the surface speeds is 1 m/s: both surfaces run at 1 m/s.
    push, tangential, on_roller, power = wall_film(FILM, gap, 0.0, 1.0, 1.0)
    assert push == pytest.approx(4.895 * VISCOSITY * LENGTH * RADIUS / gap, rel=1e-4)
    assert tangential == pytest.approx(-on_roller, rel=1e-12)
    assert tangential == pytest.approx(4.60 * VISCOSITY * LENGTH * math.sqrt(RADIUS / gap), rel=1e-3)
    assert power == pytest.approx(2.0 * tangential, rel=1e-12)


@pytest.mark.parametrize("gap", [2e-6, 5e-5])
def test_literature_squeeze_and_shear(gap):
    """Literature: closing alone, push 3 sqrt(2) pi eta l (R/h)^1.5 V and shear pi sqrt(2) eta U l sqrt(R/h), as the gap is
    full of oil, by quadrature.
    """
    push, sliding, *_ = wall_film(FILM, gap, 0.3, -0.5, 0.5)

    def film(x):
        return gap + x * x / (2.0 * RADIUS)

    # dp/dx = 12 eta v x/h^3 without rolling; the load is minus the first moment of that slope.
    far = 1000.0 * math.sqrt(2.0 * RADIUS * gap)
    slope, couette = (
        quad(function, -far, far, points=[0.0], limit=500)[0]
        for function in (lambda x: 12.0 * VISCOSITY * 0.3 * x * x / film(x) ** 3, lambda x: VISCOSITY / film(x))
    )
    assert push == pytest.approx(slope * LENGTH, rel=5e-5)
    # Beyond a thousand half-widths a share of 2/(pi 1000) of the shear is left.
    assert sliding == pytest.approx(couette * LENGTH, rel=4e-3)


@pytest.mark.parametrize("entrainment", [15.0, -15.0])
@pytest.mark.parametrize("sigma", SIGMA)
def test_oracle_complementarity(sigma, entrainment):
    """Oracle: push, rolling force and shear are those of Reynolds' equation with p >= 0 solved on a grid, whatever closes
    or parts and whichever way it rolls.
    """
    gap, slide = 1e-5, 2.0
    closing = closing_at(sigma, entrainment, gap)
    load, moment, sheared = complementary_film(VISCOSITY, RADIUS, gap, entrainment, closing)
    push, tangential, on_roller, _ = wall_film(FILM, gap, closing, entrainment - 0.5 * slide, entrainment + 0.5 * slide)
    assert push == pytest.approx(load * LENGTH, rel=1e-4)
    # Half the gap times the pressure's slope; far from a parting contact the grid is coarse beside it.
    held = 0.5 * (tangential - on_roller)
    assert held == pytest.approx(0.5 * moment * LENGTH, rel=3e-3 if sigma < -20.0 else 4e-4)
    assert 0.5 * (tangential + on_roller) == pytest.approx(VISCOSITY * sheared * slide * LENGTH, rel=4e-3)


def test_oracle_film_shape():
    """Oracle: the polynomials keep the errors that they are told to have over all ratios, against quadrature; fast
    parting and fast closing take the forms told.
    """
    for sigma in np.concatenate((-np.logspace(3.0, -3.0, 120), [0.0], np.logspace(-3.0, 4.0, 120))):
        push, held, shear = film_shape.py_func(2.0, 2.0 * sigma)
        expected = quadrature_shape(2.0, 2.0 * sigma)
        assert push == pytest.approx(expected[0], rel=2e-5)
        assert held == pytest.approx(expected[1], rel=9e-5)
        assert shear == pytest.approx(expected[2], rel=3e-3)
        assert film_shape.py_func(-2.0, 2.0 * sigma) == (push, -held, shear)
    push, held, _ = film_shape.py_func(1.0, -1e4)
    assert (push, held) == pytest.approx((16.0 / 81.0 * 1e-8, 16.0 / 27.0 * 1e-4), rel=2e-4)
    push, held, _ = film_shape.py_func(1.0, 1e4)
    assert (push, held) == pytest.approx((math.pi / 8.0 * 1e4, math.pi / 3.0), rel=2e-4)


def test_unit_film_parts_without_pulling():
    """Unit: a film that only parts does nothing; below its floor the film counts as that thick; at rest there is none."""
    assert wall_film(FILM, 1e-5, -2.0, 0.0, 0.0) == (0.0, 0.0, 0.0, 0.0)
    assert wall_film(FILM, -1e-6, 0.1, 3.0, 1.0) == wall_film(FILM, FLOOR, 0.1, 3.0, 1.0)
    assert wall_film(FILM, 1e-5, 0.0, 0.0, 0.0) == (0.0, 0.0, 0.0, 0.0)
    for tiny in (1e-300, -1e-200, 1e-160):
        assert np.isfinite(wall_film(FILM, 1e-5, tiny, 0.0, 0.0)).all()


def test_unit_film_force_is_smooth():
    """Unit: push and rolling force have one slope from both sides where closing turns to parting and where rolling
    turns round under a closing wall.
    """
    step = 1e-6
    for at in ((3.0, 0.0), (0.0, 3.0)):
        for direction in ((1.0, 0.0), (0.0, 1.0)):
            ahead, here, behind = (
                np.array(film_shape.py_func(*(a + side * step * d for a, d in zip(at, direction, strict=True)))[:2])
                for side in (1.0, 0.0, -1.0)
            )
            assert (ahead - here) / step == pytest.approx((here - behind) / step, abs=1e-5)


def speeds(largest):
    """Speeds at rest or of a size that is one: the power of 1e-154 m/s is lost between the smallest numbers."""
    return st.one_of(st.just(0.0), st.floats(1e-9, largest), st.floats(-largest, -1e-9))


@given(gap=st.floats(1e-7, 3e-4), closing=speeds(3.0), roller=speeds(60.0), wall=speeds(60.0))
@settings(max_examples=300, deadline=None)
def test_invariant_film_costs_power(gap, closing, roller, wall):
    """Invariant: the film pushes and takes power, whichever way the surfaces run, closing or parting: what it takes from
    both surfaces and from the pressure's way, but for the pressure's couple on the wall, which does not turn.
    """
    push, tangential, on_roller, power = wall_film(FILM, gap, closing, roller, wall)
    assert push >= 0.0 and power >= 0.0
    taken = push * closing - (on_roller * roller - tangential * wall)
    assert power == pytest.approx(taken, rel=1e-9, abs=1e-12 * abs(push * closing) + 1e-12)
    # More push the faster it closes.
    assert wall_film(FILM, gap, closing + 0.1, roller, wall)[0] >= push


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
    fx, fy, on_roller, on_cage, load, friction, damping, film, on_wall, squeeze = found
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
    assert min(load, friction, damping, film) >= 0.0
    # Opening gives back no more than the film's rolling loses.
    assert squeeze <= film * (1.0 + 1e-4) + 1e-9
    assert abs(on_wall) == load if "wet" not in name else abs(on_wall) >= load


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
        assert (found.load > 0.0) == closed
        assert found.load < CONTACT.stiffness * 1e-9 ** (10.0 / 9.0) * (1.0 + 1e-6)
    _, dry = wrench(DRY, (0.0, side * (HALF + 2e-6), 0.0, 0.0, 0.0, 0.0, 0.0))
    _, wet = wrench(WET, (0.0, side * (HALF + 2e-6 - FLOOR), 0.0, 0.0, 0.0, 0.0, 0.0))
    assert wet.load == pytest.approx(dry.load, rel=1e-9)
    assert (dry.on_wall, wet.on_wall) == pytest.approx((side * dry.load, side * wet.load), rel=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_unit_force_on_the_wall(side):
    """Unit: the force on a wall is that of contact and film together, on whichever wall bears more of it; its sign tells
    the wall.
    """
    spin, rate = -3000.0, 0.2
    for gap in (FLOOR - 1e-7, 5e-6, HALF):
        _, found = wrench(WET, (0.0, side * (HALF - gap), 0.0, side * rate, 0.0, spin, 0.0))
        near = wall_film(FILM, gap, rate, -spin * RADIUS, 0.0)[0]
        far = wall_film(FILM, 2.0 * HALF - gap, -rate, spin * RADIUS, 0.0)[0]
        assert found.on_wall == pytest.approx(side * (near + found.load), rel=1e-6)
        # Along the x axis the pocket's normal is y.
        assert found.y == pytest.approx(-side * (near + found.load - far), rel=1e-6)
        _, parting = wrench(WET, (0.0, side * (HALF - gap), 0.0, -side * 60.0, 0.0, spin, 0.0))
        assert side * parting.on_wall < 0.0 or gap < FLOOR
    _, found = wrench(LIPPED, (0.0, side * 1e-5, 40e-6, 0.0, 0.0, 0.0, 0.0))
    assert found.on_wall == side * found.load != 0.0


def test_unit_both_peaks_are_booked():
    """Unit: contact and whole force keep each its own peak and time, at the vertex of the parabola through three points."""
    tally = empty_tally(10)
    points, values = np.linspace(0.0, 1.0, 10), np.empty((2, 10))
    for point, theta in enumerate(points):
        loads = np.zeros((3, LOADS))
        loads[2, POCKET_LOAD] = 9.0 - 40.0 * (theta - 0.53) ** 2
        loads[2, POCKET_CONTACT_LOAD] = max(5.0 - 80.0 * (theta - 0.71) ** 2, 0.0)
        book_point.py_func(values, point, loads, 2)
    book_peaks(values, 3.0, 0.1, tally)
    found = {force: (tally.largest[force], tally.largest_time[force]) for force in range(LOADS)}
    assert found[POCKET_LOAD] == pytest.approx((9.0, 3.053), rel=1e-9)
    assert found[POCKET_CONTACT_LOAD] == pytest.approx((5.0, 3.071), rel=1e-9)
    assert np.count_nonzero(tally.largest) == 2


def test_unit_lips_hold_radially():
    """Unit: inside its play a lipped pocket is the plain one; past it, it pushes back along the mid-line."""
    plain = Pocket(HALF, RADIUS, CONTACT, NoDamping(), NoTraction())
    lipped = LippedPocket(plain, 21.75e-3, 30e-6, RADIUS, CONTACT, NoDamping(), NoTraction())
    for height in (0.0, 29e-6, -29e-6):
        motion = (0.3, 1e-5, height, 0.0, 0.0, 100.0, 900.0)
        assert wrench(lipped, motion)[1] == wrench(plain, motion)[1] == (0.0,) * 10
    for height in (33e-6, -33e-6):
        _, found = wrench(lipped, (0.3, 0.0, height, 0.0, 0.0, 0.0, 0.0))
        expected = -math.copysign(CONTACT.stiffness * 3e-6 ** (10.0 / 9.0), height)
        along = (found[0] * math.cos(0.3) + found.y * math.sin(0.3), found.y * math.cos(0.3) - found[0] * math.sin(0.3))
        assert along == pytest.approx((expected, 0.0), rel=1e-9, abs=1e-9)


def test_unit_scene_makes_the_pocket(make_scene):
    """Unit: film, floor, lips and restitution of a scene reach the pocket."""
    from rbdyn.contact.damping import alpha_of_restitution
    from rbdyn.dynamics.parameters.model import roller_bearing

    scene = make_scene(
        "cage.guidance=roller", "cage.pocket_radial_clearance_mm=0.06", "model.pocket_film=true",
        "model.pocket_film_floor_um=1.5", "model.pocket_fill=0.5", "model.pocket_restitution=0.6", UNSAMPLED,
    )  # fmt: skip
    pocket = roller_bearing(scene).pocket
    assert isinstance(pocket, LippedPocket) and isinstance(pocket.walls, LubricatedPocket)
    assert pocket.half_clearance == pytest.approx(30e-6) and pocket.orbit_radius == pytest.approx(21.75e-3)
    assert pocket.walls.half_clearance == pytest.approx(150e-6)
    assert pocket.walls.walls.half_clearance == pytest.approx(148.5e-6)
    assert pocket.walls.film.floor == pytest.approx(1.5e-6)
    alpha = alpha_of_restitution(0.6, 0.5)
    assert pocket.damping.alpha == pocket.walls.walls.damping.alpha == pytest.approx(alpha, rel=1e-12)
    half = roller_bearing(make_scene("model.pocket_film=true", "model.pocket_fill=0.5", UNSAMPLED)).pocket.film
    full = roller_bearing(make_scene("model.pocket_film=true", UNSAMPLED)).pocket.film
    scales = ("load", "rolling", "shear")
    assert [2.0 * getattr(half, name) for name in scales] == pytest.approx(
        [getattr(full, name) for name in scales], rel=1e-12
    )


def test_unit_contact_length_of_the_scene(make_scene):
    """Unit: contact, film and lips take the given length; without it the effective length, and a film the whole roller."""
    from rbdyn.dynamics.parameters.model import roller_bearing

    wet = ("model.pocket_film=true", "cage.guidance=roller")
    plain, given = (
        roller_bearing(make_scene(*wet, *more)).pocket for more in ((), ("cage.pocket_contact_length_mm=2.0",))
    )
    share = {3.5: plain.contact.stiffness, 2.0: given.contact.stiffness}
    assert share[2.0] / share[3.5] == pytest.approx((2.0 / 3.5) ** (8.0 / 9.0), rel=1e-12)
    assert given.walls.walls.contact == given.contact
    assert given.walls.film.load / plain.walls.film.load == pytest.approx(2.0 / 5.0, rel=1e-12)
    same = roller_bearing(make_scene(*wet[:1], "cage.pocket_contact_length_mm=3.5")).pocket
    assert same.walls.contact == plain.walls.walls.contact
