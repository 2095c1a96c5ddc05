"""Waviness: the form itself, its force and moment as virtual work, and the rule that only orders kZ +- 1 shake a ring."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from rbdyn.contact.damping import NoDamping
from rbdyn.contact.hertz_line import dowson_higginson, palmgren
from rbdyn.contact.rolling_resistance import NoRollingResistance
from rbdyn.contact.tangential import RigidContact
from rbdyn.contact.traction import CoulombTraction, NoTraction
from rbdyn.dynamics.forces.races import Race, RoundRace, form_at, largest_rise, race_contact, wavy_race

RADIUS, ROLLER, Z = {1.0: 26.25e-3, -1.0: 17.25e-3}, 4.5e-3, 10
CONTACT = palmgren(226.4e9, 3.5e-3)


@njit
def compiled_form(form, nx, ny, ring_cos, ring_sin):
    return form_at(form, nx, ny, ring_cos, ring_sin)


@njit
def compiled_contact(race, side, radius, dx, dy, dvx, dvy, spin, speed, ring_cos, ring_sin):
    return race_contact(race, side, radius, dx, dy, dvx, dvy, spin, speed, ring_cos, ring_sin, 0.0)


def race_of(side, form, contact=CONTACT, traction=NoTraction()):  # noqa: B008
    return Race(RADIUS[side], 1.0, form, contact, NoDamping(), traction, NoRollingResistance(), RigidContact())


def waves(*harmonics):
    """A form from (order, amplitude [m], phase [rad])."""
    order, amplitude, phase = map(np.array, zip(*harmonics, strict=True))
    return wavy_race(order, amplitude.astype(float), phase.astype(float))


@given(
    order=st.integers(1, 2000),
    amplitude=st.floats(-1e-5, 1e-5),
    phase=st.floats(-7.0, 7.0),
    azimuth=st.floats(-math.pi, math.pi),
    turned=st.floats(-50.0, 50.0),
)
@settings(max_examples=200, deadline=None)
def test_oracle_form(order, amplitude, phase, azimuth, turned):
    """Oracle: a cos(n (psi - angle - phase)) and its slope by the library's cosine, up to round-off times the order."""
    form = waves((order, amplitude, phase), (2, 3e-6, 0.5))
    directions = (math.cos(azimuth), math.sin(azimuth), math.cos(turned), math.sin(turned))
    rise, slope = compiled_form(form, *directions)
    phi = azimuth - turned
    assert rise == pytest.approx(
        amplitude * math.cos(order * (phi - phase)) + 3e-6 * math.cos(2.0 * (phi - 0.5)), abs=1e-18 * order + 1e-19
    )
    expected = -amplitude * order * math.sin(order * (phi - phase)) - 6e-6 * math.sin(2.0 * (phi - 0.5))
    assert slope == pytest.approx(expected, abs=1e-18 * order**2 + 1e-18)
    assert form_at(form, *directions) == pytest.approx((rise, slope), abs=1e-18 * order**2 + 1e-18)
    assert abs(rise) <= largest_rise(form) * (1.0 + 1e-12)


def test_unit_lobe_stands_at_its_phase():
    """Unit: with a positive amplitude the radius is largest at the phase, counted on the ring; a round race is level."""
    form = waves((3, 2e-6, 0.4))
    for turned in (0.0, 1.0):
        place = 0.4 + turned
        rise, slope = form_at(form, math.cos(place), math.sin(place), math.cos(turned), math.sin(turned))
        assert (rise, slope) == pytest.approx((2e-6, 0.0), abs=1e-19)
    assert form_at(RoundRace(), 0.6, 0.8, 1.0, 0.0) == (0.0, 0.0)
    assert largest_rise(RoundRace()) == 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("contact", [CONTACT, dowson_higginson(226.4e9, 3.5e-3, 0.2)], ids=["power", "log"])
def test_oracle_force_is_virtual_work(side, contact):
    """Oracle: force on roller and moment on ring are minus the energy's slopes over place and angle of the ring."""
    from rbdyn.dynamics.forces.bodies import RingMotion
    from rbdyn.dynamics.forces.equations import race_energy

    draw = np.random.default_rng(4)
    race = race_of(side, waves((2, 8e-6, 0.3), (17, 1e-6, 1.0)), contact)
    for _ in range(20):
        azimuth, turned = draw.uniform(-3.0, 3.0, 2)
        distance = RADIUS[side] - side * (ROLLER - draw.uniform(1.2e-5, 2e-5))
        place = distance * np.array([math.cos(azimuth), math.sin(azimuth)])

        def energy(x, y, angle):
            ring = RingMotion(0.0, 0.0, 0.0, 0.0, 0.0, math.cos(angle), math.sin(angle))
            return race_energy(race, side, ROLLER, x, y, ring)

        def slope(shift, turn, step):
            ends = [
                energy(place[0] + s * shift[0], place[1] + s * shift[1], turned + s * turn)  # noqa: B023
                for s in (step, -step, 2.0 * step, -2.0 * step)
            ]
            return (8.0 * (ends[0] - ends[1]) - ends[2] + ends[3]) / (12.0 * step)

        expected = [-slope((1.0, 0.0), 0.0, 1e-8), -slope((0.0, 1.0), 0.0, 1e-8), -slope((0.0, 0.0), 1.0, 1e-5)]
        found = compiled_contact(race, side, ROLLER, *place, 0.0, 0.0, 0.0, 0.0, math.cos(turned), math.sin(turned))
        assert found.load > 10.0
        # Round-off of millijoules over the steps.
        assert found[:2] == pytest.approx(expected[:2], rel=1e-7, abs=1e-6)
        assert found.roller_moment == 0.0 and found.ring_moment == pytest.approx(expected[2], rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("side", [1.0, -1.0])
@given(seed=st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_invariant_contact_wrench(side, seed):
    """Invariant: no moment is left between roller and wavy ring; power lost is friction and what the contact stores."""
    draw = np.random.default_rng(seed)
    race = race_of(side, waves((3, 5e-6, 0.1), (11, 1e-6, 1.0)), traction=CoulombTraction(0.1, 0.02))
    azimuth, turned, speed, spin = draw.uniform((-3.0, -3.0, -3e3, -6e3), (3.0, 3.0, 3e3, 6e3))
    place = (RADIUS[side] - side * (ROLLER - 1e-5)) * np.array([math.cos(azimuth), math.sin(azimuth)])
    velocity = draw.uniform(-20.0, 20.0, 2)
    state = (*place, *velocity, spin, speed, math.cos(turned), math.sin(turned))
    fx, fy, on_roller, on_ring, load, friction, rolling, damping, *_ = compiled_contact(race, side, ROLLER, *state)
    assert place[0] * fy - place[1] * fx + on_roller + on_ring == pytest.approx(0.0, abs=1e-14 * load)
    lost = -(fx * velocity[0] + fy * velocity[1] + on_roller * spin + on_ring * speed)

    def overlap(time):
        x, y = place + time * velocity
        rise, _ = form_at(
            race.form,
            x / math.hypot(x, y),
            y / math.hypot(x, y),
            math.cos(turned + speed * time),
            math.sin(turned + speed * time),
        )
        return side * (math.hypot(x, y) - race.radius - rise) + ROLLER

    rate = (overlap(1e-8) - overlap(-1e-8)) / 2e-8
    assert lost == pytest.approx(friction + load * rate, rel=1e-6, abs=1e-6 * load)
    assert rolling == damping == 0.0 and friction >= 0.0


def force_on_inner_ring(order, amplitude, angle, phase):
    """Force of equally spaced, rigidly orbiting rollers in preload on a ring whose race is wavy."""
    race = race_of(-1.0, waves((order, amplitude, phase)))
    distance = RADIUS[-1.0] + ROLLER - 5e-6
    force = np.zeros(2)
    for j in range(Z):
        azimuth = angle + 2.0 * math.pi * j / Z
        found = compiled_contact(
            race, -1.0, ROLLER, distance * math.cos(azimuth), distance * math.sin(azimuth), 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
        )
        force -= found[:2]
    return force


@pytest.mark.parametrize("order", range(1, 33))
def test_literature_orders_that_shake_a_ring(order):
    """Literature: to first order in its height, waviness shakes the ring radially only where n = kZ +- 1.

    The ring turns against the rollers; even and odd powers of the height are parted by its sign.
    """
    height, forces = 1e-9, []
    for angle in np.linspace(0.0, 2.0 * math.pi / Z, 7)[:-1]:
        up, down = (force_on_inner_ring(order, sign * height, angle, 0.2) for sign in (1.0, -1.0))
        forces.append(math.hypot(*(0.5 * (up - down))))
    load = CONTACT.stiffness * 5e-6 ** (10.0 / 9.0)
    stiffness = 10.0 / 9.0 * load / 5e-6
    if order % Z in (1, Z - 1):
        # Z/2 times stiffness times height, turning with the rollers; the race leans by n a/r below a roller's centre.
        lean = load * order / (RADIUS[-1.0] + ROLLER - 5e-6)
        turning = stiffness - lean if order % Z == 1 else stiffness + lean
        assert forces == pytest.approx([0.5 * Z * turning * height] * 6, rel=1e-6)
    else:
        # Third powers of the height, and round-off of ten loads of 600 N.
        assert max(forces) < 1e-6 * Z * stiffness * height


def test_unit_scene_makes_the_form(make_scene):
    """Unit: order, amplitude and phase of a scene; a clock only where a form turns; the reach holds the highest wave."""
    from rbdyn.dynamics.parameters.model import roller_bearing
    from rbdyn.dynamics.parameters.state import layout_of

    standing = make_scene("bearing.outer_waviness=[{order=2, amplitude_um=10.0, phase_deg=90.0}]")
    bearing = roller_bearing(standing)
    assert layout_of(standing).clock is None and isinstance(bearing.inner.form, RoundRace)
    rise, _ = form_at(bearing.outer.form, 0.0, 1.0, 1.0, 0.0)
    assert rise == pytest.approx(10e-6, rel=1e-9)
    turning = make_scene(
        "bearing.inner_waviness=[{order=5, amplitude_um=2.0}, {order=9, amplitude_um=1.0}]",
        "bearing.roller_diameter_errors_um=[0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -4.0]",
    )
    assert layout_of(turning).clock == 60
    inner = roller_bearing(turning).inner
    assert inner.reach == pytest.approx(inner.radius + 4.5e-3 + 2e-6 + 3e-6, rel=1e-12)
    driven = make_scene("bearing.outer_waviness=[{order=2, amplitude_um=10.0}]", "operation.outer_speed_rpm=100.0")
    assert layout_of(driven).clock == 60
