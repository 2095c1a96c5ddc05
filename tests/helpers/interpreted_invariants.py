"""Invariants of the right-hand side over scenes that hypothesis makes. ``test_invariants`` runs this interpreted.

Every scene is another set of law types, which the interpreter takes as it comes and the compiler would chew on for
seconds each.
"""

import numpy as np
import pytest
from conftest import EVERYTHING, UNSAMPLED, make, right_hand_side, state_near_contact
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy_twin import cross

from rbdyn.contact.hertz_line import SlicedLineContact, TiltedLineContact
from rbdyn.contact.traction import MixedTraction
from rbdyn.dynamics.forces.bodies import (
    BalancedCage,
    Gravity,
    NoGravity,
    SteadyDrive,
    TwoSpeedDrive,
    UnbalancedCage,
    action,
    mass_centre,
    outer_motion,
)
from rbdyn.dynamics.forces.cage import guide_forces
from rbdyn.dynamics.forces.equations import cage_motion, inner_motion, mechanical_energy
from rbdyn.dynamics.forces.race_lanes import race_forces, scratch
from rbdyn.dynamics.forces.races import EqualRollers, RoundRace, WavyRace, unequal_rollers
from rbdyn.dynamics.forces.schedule import ClockedDrive, Constant
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.losses import LOAD, SHAFT

WAVINESS = "[{order=2, amplitude_um=5.0, phase_deg=10.0}, {order=13, amplitude_um=0.5, phase_deg=-30.0}]"
SCHEDULE = (
    "operation.schedule.time_s=[0.0, 3e-3, 9e-3]",
    "operation.schedule.inner_speed_rpm=[15000.0, 24000.0, 20000.0]",
    "operation.schedule.radial_load_N=[500.0, 1300.0, 900.0]",
)
SUPPORT = ("support.stiffness_N_m=3e7", "support.damping_N_s_m=3e3")
# One choice of each line makes a scene. Guidance is chosen with what goes with it.
CHOICES = (
    ((), ("cage.guidance=inner",), ("model.guide_land=dry",), ("cage.guidance=roller", "cage.pocket_radial_clearance_mm=0.06")),
    ((), ("operation.outer_speed_rpm=9000.0",), ("operation.outer_speed_rpm=-24000.0",)),
    ((), ("operation.rotating_load_N=300.0", "operation.unbalance_g_mm=5.0"), SCHEDULE),
    ((), ("operation.gravity_m_s2=50.0", "operation.gravity_direction_deg=60.0")),
    ((), ("cage.imbalance_um=60.0",)),
    ((), ("bearing.roller_diameter_spread_um=1.0",)),
    ((), (f"bearing.outer_waviness={WAVINESS}",)),
    ((), (f"bearing.inner_waviness={WAVINESS}",)),
    ((), ("bearing.roller_profile=logarithmic",)),
    tuple((f"model.line_contact={name}",) for name in ("palmgren", "dowson_higginson", "houpert")),
    tuple((f"model.race_damping={name}",) for name in ("viscous", "hunt_crossley", "off")),
    ((), ("model.pocket_film=true",)),
    (("model.pocket_restitution=0.6",), ("model.pocket_bar_stiffness_N_m=rigid",)),
    ((), ("traction.friction=mixed",), ("traction.mu_0=0.02",), ("traction.model=coulomb",)),
    ((), ("model.drag=off",)),
)  # fmt: skip


@st.composite
def scenes(draw, *always):
    """A scene made of one choice each, and the seed of a state."""
    chosen = [part for choice in CHOICES for part in draw(st.sampled_from(choice))]
    return make(UNSAMPLED, *chosen, *always), draw(st.integers(0, 10**6))


def rings_of(bearing, y):
    """Motions of cage, inner and outer ring, and their wrenches (force x, force y, moment) as the equations have them."""
    z = bearing.rollers
    acting = action(bearing.drive, y)
    cage, inner = cage_motion(y, 5 * z), inner_motion(y, 5 * z, acting)
    outer = outer_motion(bearing.outer_ring, y, acting.outer_speed, acting.outer_cos, acting.outer_sin)
    dy = np.zeros((1, y.size))
    races = (bearing.outer, bearing.inner, bearing.sizes, outer, inner)
    on_outer, on_inner = race_forces(*races, z, y, 0, dy, scratch(z))
    land = guide_forces(bearing.guide, cage, inner, outer)
    on_outer = np.add(on_outer[:3], (land.outer_x, land.outer_y, land.outer_moment))
    on_inner = np.add(on_inner[:3], (land.inner_x, land.inner_y, land.inner_moment))
    return cage, inner, outer, acting, on_inner, on_outer


@given(scenes())
@settings(max_examples=150, deadline=None, derandomize=True)
def test_invariant_momentum_power_and_losses(made):
    """Invariant: whatever the laws and the state, forces and moments of all bodies together are those from outside (load, weight,
    drag, shafts); shaft and load power = losses + rate of change of all energy; no law gives power to the motion."""
    scene, seed = made
    bearing, y = roller_bearing(scene), state_near_contact(scene, seed)
    found = right_hand_side(bearing, y)
    check_action(scene, bearing, y, found)
    check_power(bearing, y, found)
    assert (found.power[:SHAFT] >= 0.0).all()
    assert (found.loads >= 0.0).all()


def check_action(scene, bearing, y, found):
    """Momentum and moment of all bodies, and the power of the shafts."""
    z = bearing.rollers
    cage, inner, outer, acting, on_inner, on_outer = rings_of(bearing, y)
    weight = np.array([bearing.gravity.x, bearing.gravity.y]) if scene.operation.gravity_m_s2 else np.zeros(2)
    load = np.array([acting.load_x, acting.load_y])
    place = y[: 2 * z].reshape(2, z)
    drag = np.zeros((2, z))
    if scene.model.drag == "cylinder":
        velocity = y[2 * z : 4 * z].reshape(2, z)
        drag = -bearing.drag.factor * np.hypot(*velocity) * velocity

    # Momentum of rollers, cage (about its centre of mass) and inner ring.
    pushed = bearing.roller_mass * found.dy[2 * z : 4 * z].reshape(2, z)
    centre = np.array(mass_centre(bearing.cage, cage.x, cage.y, cage.cos, cage.sin))
    offset = centre - (cage.x, cage.y)
    spin_up = found.dy[5 * z + 5]
    centre_acceleration = (
        found.dy[5 * z + 3 : 5 * z + 5] + spin_up * np.array([-offset[1], offset[0]]) - cage.speed**2 * offset
    )
    cage_push = bearing.cage.mass * centre_acceleration
    ring_push = bearing.inner_ring_mass * found.dy[5 * z + 8 : 5 * z + 10]
    force = pushed.sum(axis=1) + cage_push + ring_push + on_outer[:2]
    outside = load + drag.sum(axis=1) + bearing.roller_mass * z * weight
    outside += (bearing.cage.mass + bearing.inner_ring_mass) * weight
    # Round-off of a sum of some forty forces of up to a few thousand newtons.
    size = found.loads.max() + np.abs(load).max() + np.abs(pushed).max() + np.abs(cage_push).max()
    assert force == pytest.approx(outside, abs=1e-11 * size)

    # Moments about the origin. The rings' spins are prescribed: what the contacts take, the shafts supply.
    moment = cross(place, pushed).sum() + bearing.roller_inertia * found.dy[4 * z : 5 * z].sum()
    moment += cross(centre, cage_push) + bearing.cage.inertia * spin_up
    moment += cross((inner.x, inner.y), ring_push) + on_inner[2]
    moment += cross((outer.x, outer.y), on_outer[:2]) + on_outer[2]
    outside = cross((inner.x, inner.y), load) + cross(place, drag).sum()
    outside += bearing.roller_mass * cross(place.sum(axis=1), weight)
    outside += bearing.cage.mass * cross(centre, weight)
    outside += bearing.inner_ring_mass * cross((inner.x, inner.y), weight)
    assert moment == pytest.approx(outside, abs=1e-11 * size)
    shaft = -on_inner[2] * inner.speed - on_outer[2] * outer.speed
    assert found.power[SHAFT] == pytest.approx(shaft, rel=1e-12, abs=1e-9)


def energy_rate(bearing, y, dy):
    """Rate of change of the energy along ``dy``, by a difference of fourth order, and its round-off [W]."""
    step = 1e-9

    def energy(steps):
        return np.array(mechanical_energy(bearing, y + steps * step * dy))

    rate = (8.0 * (energy(1.0) - energy(-1.0)) - energy(2.0) + energy(-2.0)) / (12.0 * step)
    return rate.sum(), 4.0 * 2.2e-16 * np.abs(energy(0.0)).sum() / step


def test_invariant_power_with_every_law():
    """Invariant: the power balance with all at once, the traction table and the tilt included; the table takes a second."""
    scene = make(UNSAMPLED, *EVERYTHING)
    bearing = roller_bearing(scene)
    for seed in range(8):
        y = state_near_contact(scene, seed)
        check_power(bearing, y, right_hand_side(bearing, y))


def check_power(bearing, y, found):
    """The power balance of the right-hand side."""
    z = bearing.rollers
    rate, round_off = energy_rate(bearing, y, found.dy)
    gap = found.power[SHAFT] + found.power[LOAD] - found.power[:SHAFT].sum() - rate
    flow = np.abs(bearing.roller_mass * found.dy[2 * z : 4 * z] * y[2 * z : 4 * z]).sum()
    # The difference errs by (1e-9 s over a contact's 3e-6 s)^4; contacts closing just now add a little.
    assert abs(gap) < 1e-9 * flow + 4.0 * round_off


@given(scenes("bearing.tilt_mrad=6.0", "bearing.tilt_direction_deg=50.0"))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_invariant_power_between_tilted_rings(made):
    """Invariant: the same between rings tilted so far that rollers bear on their ends."""
    scene, seed = made
    bearing, y = roller_bearing(scene), state_near_contact(scene, seed)
    check_power(bearing, y, right_hand_side(bearing, y))


def same(bearing, first, second):
    """Two derivatives, powers and loads equal to the round-off of positions over approaches."""
    z = bearing.rollers
    for part in (slice(2 * z, 4 * z), slice(4 * z, 5 * z), slice(5 * z + 3, 5 * z + 10)):
        mine, theirs = first.dy[part], second.dy[part]
        assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max() + 1e-9
    assert first.power == pytest.approx(second.power, rel=1e-8, abs=1e-8 * np.abs(second.power).max())
    assert first.loads == pytest.approx(second.loads, rel=1e-8, abs=1e-9)


# Replacements that change the type of a law, not what it says: from the bearing to the same bearing written otherwise.
def no_waves():
    return WavyRace(np.array([7, 20]), np.zeros(2), np.zeros(2))


def flat_slices(contact, tilted):
    relief, share, place = np.zeros(32), np.array([1.0 / 31] * 31 + [0.0]), np.arange(31)
    if tilted:
        return TiltedLineContact(contact, relief, share, place, np.zeros(32), 1.0, 0.0)
    return SlicedLineContact(contact, relief, share, place)


def on_both(bearing, **changes):
    """Both races with a key replaced by a function of the race."""
    for name in ("outer", "inner"):
        race = getattr(bearing, name)
        change = {key: make_new(race) for key, make_new in changes.items()}
        bearing = bearing._replace(**{name: race._replace(**change)})
    return bearing


REWRITTEN = {
    "31 slices": lambda b: on_both(b, contact=lambda race: flat_slices(race.contact, False)),
    "31 slices, tilt of nothing": lambda b: on_both(b, contact=lambda race: flat_slices(race.contact, True)),
    "waves of no height": lambda b: on_both(b, form=lambda race: no_waves()),
    "rollers of equal radii": lambda b: b._replace(sizes=unequal_rollers(np.full(b.rollers, b.sizes.radius))),
    "no imbalance": lambda b: b._replace(cage=UnbalancedCage(*b.cage, 0.0)),
    "no weight": lambda b: b._replace(gravity=Gravity(0.0, 0.0)),
    "outer ring at no speed": lambda b: b._replace(drive=TwoSpeedDrive(b.drive.inner_speed, 0.0, b.drive.load_x)),
    "asperities that carry nothing": lambda b: on_both(
        b, traction=lambda race: MixedTraction(race.traction, 0.1, 0.02, 1e6, 0.1)
    ),
}


@pytest.mark.parametrize("name", REWRITTEN)
@pytest.mark.parametrize("law", ["palmgren", "dowson_higginson", "houpert"])
def test_unit_equal_where_both_hold(name, law):
    """Unit: a law that says nothing new gives what the bearing without it gives, to the round-off of its sums."""
    scene = make(UNSAMPLED, f"model.line_contact={law}")
    bearing = roller_bearing(scene)
    assert isinstance(bearing.sizes, EqualRollers) and isinstance(bearing.cage, BalancedCage)
    assert isinstance(bearing.gravity, NoGravity) and isinstance(bearing.outer.form, RoundRace)
    for seed in range(6):
        y = state_near_contact(scene, seed)
        same(bearing, right_hand_side(REWRITTEN[name](bearing), y), right_hand_side(bearing, y))


def test_unit_a_clock_that_changes_nothing():
    """Unit: constant speed and load by the clock act as without one; work that had a potential is booked as power."""
    scene = make(UNSAMPLED)
    bearing = roller_bearing(scene)
    assert isinstance(bearing.drive, SteadyDrive)
    steady = bearing.drive
    drive = ClockedDrive(60, Constant(steady.inner_speed), 0.0, Constant(steady.load_x), 0.0, 0.0)
    for seed in range(6):
        y = state_near_contact(scene, seed)
        plain = right_hand_side(bearing, y)
        clocked = right_hand_side(bearing._replace(drive=drive), np.append(y, (0.01, 2.0, 0.0)))
        assert (clocked.dy[:60] == plain.dy).all() and clocked.dy[60:].tolist() == [1.0, steady.inner_speed, 0.0]
        assert (clocked.power[:LOAD] == plain.power[:LOAD]).all()
        assert plain.power[LOAD] == 0.0 and clocked.power[LOAD] == steady.load_x * y[58]


def test_unit_a_support_that_has_not_moved():
    """Unit: with its outer ring at the centre and at rest, a bearing on a support moves as one in a rigid housing."""
    rigid, supported = make(UNSAMPLED), make(UNSAMPLED, *SUPPORT)
    for seed in range(6):
        y = state_near_contact(rigid, seed)
        plain = right_hand_side(roller_bearing(rigid), y)
        found = right_hand_side(roller_bearing(supported), np.append(y, np.zeros(4)))
        assert (found.dy[:60] == plain.dy).all() and (found.power == plain.power).all()
        assert layout_of(supported).support == 60


def test_unit_the_interpreter_runs_this():
    """Unit: nothing here is compiled."""
    import numba

    assert numba.config.DISABLE_JIT
