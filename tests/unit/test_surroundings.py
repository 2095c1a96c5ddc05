"""What surrounds the bearing: schedules, drive and rotating loads, support, weight, an unbalanced cage."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.integrate import quad, solve_ivp

from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.bodies import (
    BalancedCage,
    Gravity,
    HeldRing,
    NoGravity,
    SteadyDrive,
    SupportedRing,
    TwoSpeedDrive,
    UnbalancedCage,
    action,
    cage_acceleration,
    cage_kinetic_energy,
    height_energy,
    load_potential,
    load_power,
    mass_centre,
    support_energy,
    support_motion,
)
from rbdyn.dynamics.forces.schedule import ClockedDrive, Constant, Ramps, SmoothRamps, Steps, value_at
from rbdyn.dynamics.integrators.advance import NOW
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.run import Run

TIMES, VALUES = np.array([0.0, 2.0, 3.0, 7.0]), np.array([10.0, -4.0, 6.0, 6.5])


@njit
def compiled_value(schedule, time):
    return value_at(schedule, time)


@njit
def compiled_acceleration(cage, fx, fy, moment, cosine, sine, speed):
    return cage_acceleration(cage, fx, fy, moment, cosine, sine, speed)


@pytest.mark.parametrize("call", [compiled_value, value_at], ids=["compiled", "interpreted"])
def test_unit_schedule_values(call):
    """Unit: each shape at its points, between them and beyond both ends."""
    steps, ramps, smooth = (kind(TIMES, VALUES) for kind in (Steps, Ramps, SmoothRamps))
    for schedule in (steps, ramps, smooth):
        assert [call(schedule, t) for t in TIMES] == pytest.approx(VALUES.tolist(), abs=1e-15)
        assert call(schedule, -1.0) == 10.0 and call(schedule, 7.0) == call(schedule, 1e9) == 6.5
    assert [call(steps, t) for t in (1.999, 2.5, 6.999)] == [10.0, -4.0, 6.0]
    assert [call(ramps, t) for t in (0.5, 2.5, 5.0)] == pytest.approx([6.5, 1.0, 6.25], rel=1e-15)
    # A quarter along a half cosine: (1 - cos(pi/4))/2 of the way; half-way: half.
    assert call(smooth, 0.5) == pytest.approx(10.0 - 14.0 * 0.5 * (1.0 - math.sqrt(0.5)), rel=1e-14)
    assert call(smooth, 2.5) == pytest.approx(1.0, rel=1e-14)
    assert call(Constant(3.0), -5.0) == call(Constant(3.0), 5.0) == 3.0
    single = Ramps(np.array([1.0]), np.array([8.0]))
    assert [call(single, t) for t in (0.0, 1.0, 2.0)] == [8.0] * 3


@given(time=st.floats(-1.0, 9.0))
@settings(max_examples=100, deadline=None)
def test_invariant_schedules_stay_between_their_points(time):
    """Invariant: no shape overshoots; smooth ramps have no jump of slope."""
    for kind in (Steps, Ramps, SmoothRamps):
        assert VALUES.min() <= compiled_value(kind(TIMES, VALUES), time) <= VALUES.max()
    smooth = SmoothRamps(TIMES, VALUES)
    before, here, after = (compiled_value(smooth, time + h) for h in (-1e-4, 0.0, 1e-4))
    # The curvature is at most pi^2/2 times the fall over the squared duration; it alone may jump.
    assert abs(after - 2.0 * here + before) < 0.5 * math.pi**2 * 14.0 * 1e-8


def drive_of(scene):
    return roller_bearing(scene.changed({"damage.races": False})).drive


def test_unit_scene_makes_the_drive(make_scene):
    """Unit: a clock only where something depends on it; units of speeds, loads and unbalance."""
    assert drive_of(make_scene()) == SteadyDrive(24000.0 * math.pi / 30.0, 1300.0)
    both = drive_of(make_scene("operation.outer_speed_rpm=-3000.0"))
    assert both == TwoSpeedDrive(24000.0 * math.pi / 30.0, -100.0 * math.pi, 1300.0)
    rotating = drive_of(make_scene("operation.rotating_load_N=50.0", "operation.unbalance_g_mm=2.0"))
    assert isinstance(rotating, ClockedDrive) and isinstance(rotating.load, Constant)
    assert (rotating.start, rotating.rotating_load, rotating.unbalance) == (60, 50.0, pytest.approx(2e-6))
    scheduled = drive_of(
        make_scene("operation.schedule.time_s=[0.0, 1.0]", "operation.schedule.radial_load_N=[1.0, 2.0]")
    )
    assert isinstance(scheduled.load, SmoothRamps) and isinstance(scheduled.inner_speed, Constant)


@given(time=st.floats(0.0, 1.0), angle=st.floats(-50.0, 50.0))
@settings(max_examples=50, deadline=None)
def test_oracle_rotating_load(time, angle):
    """Oracle: load along x by the clock plus (rotating load + m e w^2) along the mark of the inner ring."""
    speed = Ramps(np.array([0.0, 1.0]), np.array([100.0, 300.0]))
    drive = ClockedDrive(2, speed, -7.0, Constant(40.0), 15.0, 1e-3)
    found = action(drive, np.array([0.0, 0.0, time, angle, 0.3]))
    omega = 100.0 + 200.0 * time
    turning = 15.0 + 1e-3 * omega**2
    assert found.inner_speed == pytest.approx(omega) and found.outer_speed == -7.0
    assert found.load_x == pytest.approx(40.0 + turning * math.cos(angle), abs=1e-12)
    assert found.load_y == pytest.approx(turning * math.sin(angle), abs=1e-12)
    assert (found.outer_cos, found.outer_sin) == pytest.approx((math.cos(0.3), math.sin(0.3)))
    power = load_power(drive, found, 0.5, -2.0)
    assert power == pytest.approx(0.5 * found.load_x - 2.0 * found.load_y, rel=1e-12, abs=1e-12)
    assert load_potential(drive, 1e-3) == 0.0
    steady = SteadyDrive(100.0, 40.0)
    assert load_power(steady, found, 0.5, -2.0) == 0.0 and load_potential(steady, 1e-3) == -0.04


def test_oracle_angle_is_the_integral_of_speed(everything):
    """Oracle: the clock runs on time; the angle of the inner ring is the integral of its schedule, by quadrature."""
    run = Run(everything, roller_bearing(everything), 0, 1e-2, Stop())
    run.to(2.0)
    clock = layout_of(everything).clock
    time, inner, outer = run.carry.y[clock:]
    assert time == pytest.approx(run.carry.clock[NOW], rel=1e-12) and time == pytest.approx(2.0 * everything.turn_s)
    speed = run.bearing.drive.inner_speed
    expected, _ = quad(lambda t: value_at(speed, t), 0.0, time, points=[2e-3], epsrel=1e-12)
    # The clock does not limit the steps, which are short against its ramps of milliseconds; the trapezoid misses kinks in a step.
    assert inner == pytest.approx(expected, rel=1e-7)
    assert outer == pytest.approx(-200.0 * math.pi * time, rel=1e-12)
    assert run.clock_angles() == pytest.approx([inner, outer], abs=0.0)


def test_oracle_support_alone():
    """Oracle: a ring on its support swings as a damped oscillator does, and loses what the damper takes."""
    ring, gravity = SupportedRing(0, 0.5, 2e7, 1e3), Gravity(3.0, -9.81)
    omega, zeta = math.sqrt(2e7 / 0.5), 1e3 / (2.0 * math.sqrt(2e7 * 0.5))
    rest = np.array([(30.0 + 0.5 * 3.0) / 2e7, -0.5 * 9.81 / 2e7])

    def flow(_, y):
        dy = np.zeros((1, 5))
        loss = support_motion(ring, gravity, 30.0, 0.0, y[:4], 0, dy)
        dy[0, 4] = loss
        return dy[0]

    end = 5e-4
    found = solve_ivp(flow, (0.0, end), [1e-5, 0.0, 0.0, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-18).y[:, -1]
    damped = omega * math.sqrt(1.0 - zeta**2)
    swing = math.exp(-zeta * omega * end) * (math.cos(damped * end) + zeta * omega / damped * math.sin(damped * end))
    assert found[:2] == pytest.approx(rest + (np.array([1e-5, 0.0]) - rest) * swing, rel=1e-8)

    def energy(y):
        return sum(support_energy(ring, gravity, y)) - 30.0 * y[0]

    start = energy(np.array([1e-5, 0.0, 0.0, 0.0]))
    assert energy(found[:4]) + found[4] == pytest.approx(start, rel=1e-9)
    assert support_motion(HeldRing(), gravity, 1.0, 1.0, found, 0, np.zeros((1, 4))) == 0.0
    assert support_energy(HeldRing(), NoGravity(), found) == (0.0, 0.0, 0.0)
    assert height_energy(gravity, 2.0, 1.0, 1.0) == pytest.approx(2.0 * (9.81 - 3.0))


@given(
    force=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-5.0, 5.0)),
    angle=st.floats(-3.0, 3.0),
    speed=st.floats(-2e3, 2e3),
    velocity=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
)
@settings(max_examples=100, deadline=None)
def test_oracle_unbalanced_cage(force, angle, speed, velocity):
    """Oracle: force is mass times the acceleration of the centre of mass; power is the rate of kinetic energy."""
    fx, fy, moment = force
    cage = UnbalancedCage(0.045, 2.2e-5, 80e-6)
    c, s = math.cos(angle), math.sin(angle)
    ax, ay, spin_up = compiled_acceleration(cage, fx, fy, moment, c, s, speed)
    centre = (ax - 80e-6 * (spin_up * s + speed**2 * c), ay + 80e-6 * (spin_up * c - speed**2 * s))
    assert np.multiply(0.045, centre) == pytest.approx((fx, fy), rel=1e-11, abs=1e-9)
    step = 1e-7

    def energy(h):
        turned = angle + h * speed
        return cage_kinetic_energy(
            cage, velocity[0] + h * ax, velocity[1] + h * ay, math.cos(turned), math.sin(turned), speed + h * spin_up
        )

    rate = (energy(step) - energy(-step)) / (2.0 * step)
    given_power = fx * velocity[0] + fy * velocity[1] + moment * speed
    assert rate == pytest.approx(given_power, rel=1e-5, abs=1e-4)
    assert mass_centre(cage, 1.0, 2.0, c, s) == (1.0 + 80e-6 * c, 2.0 + 80e-6 * s)
    balanced = compiled_acceleration(BalancedCage(0.045, 2.2e-5), fx, fy, moment, c, s, speed)
    level = compiled_acceleration(cage._replace(offset=0.0), fx, fy, moment, c, s, speed)
    assert balanced == pytest.approx(level, rel=1e-13, abs=1e-12)


def test_literature_free_unbalanced_cage():
    """Literature: a free body turns about its centre of mass: its geometric centre circles with radius e."""
    cage, speed, e = UnbalancedCage(0.045, 2.2e-5, 50e-6), 1000.0, 50e-6

    def flow(_, y):
        c, s = math.cos(y[2]), math.sin(y[2])
        return [*y[3:], *cage_acceleration(cage, 0.0, 0.0, 0.0, c, s, y[5])]

    start = [-e, 0.0, 0.0, 0.0, -e * speed, speed]
    turns = solve_ivp(flow, (0.0, 0.02), start, "DOP853", rtol=1e-12, atol=1e-15)
    assert np.hypot(turns.y[0], turns.y[1]) == pytest.approx(np.full(turns.t.size, e), rel=1e-9)
    assert turns.y[5] == pytest.approx(np.full(turns.t.size, speed), rel=1e-12)


def short_path(scene, turns=0.05):
    """State after a short path at a tight tolerance."""
    run = Run(scene, roller_bearing(scene), 0, 1e-8, Stop())
    run.to(turns)
    return run.carry.y[:60]


def test_invariant_constant_schedule_is_steady(make_scene, everything):
    """Invariant: a schedule that names the same speed and load at every time gives the path of a steady drive."""
    constant = everything.operation.schedule.model_copy(
        update={"inner_speed_rpm": [24000.0] * 3, "radial_load_N": [1300.0] * 3}
    )
    steady = everything.operation.model_copy(update={"schedule": None})
    scheduled = everything.operation.model_copy(update={"schedule": constant})
    bearing, other = (
        roller_bearing(everything.model_copy(update={"operation": operation})) for operation in (scheduled, steady)
    )
    # Written with points of the same value, so that both are of one type.
    drive = other.drive._replace(
        inner_speed=SmoothRamps(np.zeros(1), np.array([other.drive.inner_speed.value])),
        load=SmoothRamps(np.zeros(1), np.array([other.drive.load.value])),
    )
    paths = []
    for one in (bearing, other._replace(drive=drive)):
        run = Run(everything.model_copy(update={"operation": scheduled}), one, 0, 1e-6, Stop())
        run.to(0.1)
        paths.append(run.carry.y.copy())
    assert paths[0] == pytest.approx(paths[1], rel=1e-9, abs=1e-15)


def test_rate_stiff_support_is_a_rigid_one(outer, make_scene, evaluate):
    """Rate: the stiffer the support the nearer the path to that in a rigid housing, in proportion to the compliance."""
    rigid = short_path(outer)
    errors = []
    for stiffness in (1e9, 1e10, 1e11):
        # Damped at a tenth of critical, so that the start dies away.
        damping = 0.2 * math.sqrt(stiffness * 0.5)
        scene = make_scene(f"support.stiffness_N_m={stiffness}", f"support.damping_N_s_m={damping}")
        errors.append(np.abs(short_path(scene)[:20] - rigid[:20]).max())
    assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2]
    # The sag of 1300 N on 1e11 N/m, and rollers that follow it.
    assert errors[2] < 5.0 * 1300.0 / 1e11


def test_invariant_spin_up_from_rest(make_scene):
    """Invariant: a shaft that starts from rest drags rollers and cage along, none of them past rolling without slip,
    and the power balance closes on the way.
    """
    from conftest import EVERYTHING

    from rbdyn.losses import LOAD, SHAFT

    scene = make_scene(
        *EVERYTHING,
        "bearing.tilt_mrad=1e-6",
        "operation.outer_speed_rpm=0.0",
        "operation.schedule.time_s=[0.0, 2e-2]",
        "operation.schedule.inner_speed_rpm=[0.0, 12000.0]",
        "operation.schedule.radial_load_N=[1300.0, 1300.0]",
    )
    run = Run(scene, roller_bearing(scene), 0, 1e-3, Stop())
    assert (run.carry.y[40:50] == 0.0).all() and run.carry.y[55] == 0.0
    start, cage = sum(run.energies()), []
    for turns in (2.0, 4.0, 6.0, 8.0):
        run.to(turns)
        cage.append(run.carry.y[55])
    change = sum(run.energies()) - start
    put_in = run.tally.work[SHAFT] + run.tally.work[LOAD]
    assert abs(put_in - run.tally.work[:SHAFT].sum() - change) < 0.005 * put_in
    assert (np.diff(cage) > 0.0).all() and cage[0] > 0.0
    rolling = scene.geometry.rolling(12000.0 * math.pi / 30.0, 0.0).cage_speed
    assert 0.9 * rolling < cage[-1] < 1.02 * rolling


def test_unit_history_on_a_support(everything):
    """Unit: a history holds the outer ring's place, the angle that the schedule gives, and loads by their names."""
    import rbdyn

    found = rbdyn.history(everything, 0.25, samples_per_turn=64)
    assert len(found.time) == 16 and np.ptp(found.outer_x) > 0.0
    # 900 N and more on 5e7 N/m.
    assert 25e-6 < found.outer_x.mean() < 32e-6
    inward, side = found.guide_eccentricity
    assert (inward == found.cage_x - found.outer_x).all() and (side == found.cage_y - found.outer_y).all()
    run = Run(everything, roller_bearing(everything), 0, everything.numerics.rtol, Stop())
    run.to(everything.numerics.discard_turns)
    assert found.inner_angle[0] == run.clock_angles()[0]
    speed = np.diff(found.inner_angle) / np.diff(found.time)
    # By then the schedule has come near its last value.
    assert speed == pytest.approx(np.full(15, 22600.0 * math.pi / 30.0), rel=0.03)
    assert found.outer_load.shape == (16, 10) and found.inner_load.max() > 100.0


def test_unit_kinematic_cage_angle_follows_the_angles(make_scene):
    """Unit: the slip is measured against rolling without slip over what both rings really turned."""
    from rbdyn.dynamics.recording import kinematic_cage_angle

    scene = make_scene("bearing.radial_clearance_mm=0.0", "operation.outer_speed_rpm=-6000.0", "numerics.turns=4")
    turned = np.array([4.0, -1.0]) * 2.0 * math.pi
    found = kinematic_cage_angle(scene, np.array([3.0, 5.0]), np.array([3.0, 5.0]) + turned)
    assert found == pytest.approx((4.0 * 17.25 - 1.0 * 26.25) / 43.5 * 2.0 * math.pi, rel=1e-12)
