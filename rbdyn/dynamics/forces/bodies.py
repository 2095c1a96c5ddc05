"""Bodies: how rings and cage move, what turns and loads the rings, and what the surroundings do to all bodies.

The outer ring is fixed, or on a flexible support with a damper. The centre of mass of a cage may lie off its geometric
centre x, which the state holds. With the centre of mass at x + e u(angle), Newton and Euler give

    a = F/m - e d^2u/dt^2,   J d(speed)/dt = M - e u x F

with the moment M of the forces about x. The drives here are steady; ``schedule`` has those that change with time. The
surroundings are the drag of the oil-air mixture on orbiting rollers, and gravity or the steady part of a manoeuvre.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import law_of
from rbdyn.dynamics.forces.state import SUPPORT_VX, SUPPORT_VY, SUPPORT_X, SUPPORT_Y


class RingMotion(NamedTuple):
    """Centre [m] and its velocity [m/s], speed of rotation [rad/s], direction of the ring's mark."""

    x: float
    y: float
    vx: float
    vy: float
    speed: float
    cos: float
    sin: float


class HeldRing(NamedTuple):
    """Outer ring whose centre is fixed."""


@law_of(HeldRing)
def outer_motion(ring, y, speed, cosine, sine):
    """Motion of the outer ring that turns at ``speed``."""
    return RingMotion(0.0, 0.0, 0.0, 0.0, speed, cosine, sine)


@law_of(HeldRing)
def support_motion(ring, gravity, force_x, force_y, y, row, dy):
    """Write the outer ring's rates under the forces [N] on it; returns the power lost in the damper [W]."""
    return 0.0


@law_of(HeldRing)
def support_energy(ring, gravity, y):
    """Kinetic, elastic and potential energy [J] of the outer ring on its support."""
    return 0.0, 0.0, 0.0


class SupportedRing(NamedTuple):
    """Outer ring (with its share of the housing) on a squirrel cage with a damper."""

    start: int  # place of its first coordinate in the state
    mass: float  # [kg]
    stiffness: float  # [N/m]
    damping: float  # [N s/m]


@outer_motion.body(SupportedRing)
def _(ring, y, speed, cosine, sine):
    i = ring.start
    return RingMotion(y[i + SUPPORT_X], y[i + SUPPORT_Y], y[i + SUPPORT_VX], y[i + SUPPORT_VY], speed, cosine, sine)


@support_motion.body(SupportedRing)
def _(ring, gravity, force_x, force_y, y, row, dy):
    i = ring.start
    vx, vy = y[i + SUPPORT_VX], y[i + SUPPORT_VY]
    dy[row, i + SUPPORT_X] = vx
    dy[row, i + SUPPORT_Y] = vy
    dy[row, i + SUPPORT_VX] = (force_x - ring.stiffness * y[i + SUPPORT_X] - ring.damping * vx) / ring.mass
    dy[row, i + SUPPORT_VY] = (force_y - ring.stiffness * y[i + SUPPORT_Y] - ring.damping * vy) / ring.mass
    add_weight(gravity, i + SUPPORT_VX, 1, row, dy)
    return ring.damping * (vx * vx + vy * vy)


@support_energy.body(SupportedRing)
def _(ring, gravity, y):
    i = ring.start
    x, y_ = y[i + SUPPORT_X], y[i + SUPPORT_Y]
    return (
        0.5 * ring.mass * (y[i + SUPPORT_VX] ** 2 + y[i + SUPPORT_VY] ** 2),
        0.5 * ring.stiffness * (x**2 + y_**2),
        height_energy(gravity, ring.mass, x, y_),
    )


class BalancedCage(NamedTuple):
    """Centre of mass at the geometric centre."""

    mass: float  # [kg]
    inertia: float  # about the centre of mass [kg m^2]


class UnbalancedCage(NamedTuple):
    """Centre of mass at a distance from the geometric centre, along the mid-line of the first pocket."""

    mass: float
    inertia: float
    offset: float  # e [m]


@law_of(BalancedCage)
def cage_acceleration(cage, fx, fy, moment, cosine, sine, speed):
    """Acceleration of the geometric centre x, y and of the rotation; ``cosine, sine``: of the cage angle."""
    return fx / cage.mass, fy / cage.mass, moment / cage.inertia


@cage_acceleration.body(UnbalancedCage)
def _(cage, fx, fy, moment, cosine, sine, speed):
    spin_up = (moment - cage.offset * (cosine * fy - sine * fx)) / cage.inertia
    inward, ahead = cage.offset * speed * speed, cage.offset * spin_up
    return (fx / cage.mass + inward * cosine + ahead * sine, fy / cage.mass + inward * sine - ahead * cosine, spin_up)


@law_of(BalancedCage)
def cage_kinetic_energy(cage, vx, vy, cosine, sine, speed):
    """Kinetic energy [J]."""
    return 0.5 * cage.mass * (vx * vx + vy * vy) + 0.5 * cage.inertia * speed * speed


@cage_kinetic_energy.body(UnbalancedCage)
def _(cage, vx, vy, cosine, sine, speed):
    ahead = cage.offset * speed
    ux, uy = vx - ahead * sine, vy + ahead * cosine
    return 0.5 * cage.mass * (ux * ux + uy * uy) + 0.5 * cage.inertia * speed * speed


@law_of(BalancedCage)
def mass_centre(cage, x, y, cosine, sine):
    """Centre of mass x, y [m]."""
    return x, y


@mass_centre.body(UnbalancedCage)
def _(cage, x, y, cosine, sine):
    return x + cage.offset * cosine, y + cage.offset * sine


class Action(NamedTuple):
    """Ring speeds [rad/s], the force on the inner ring [N], directions of the marks on the rings."""

    inner_speed: float
    outer_speed: float
    load_x: float
    load_y: float
    inner_cos: float
    inner_sin: float
    outer_cos: float
    outer_sin: float


class SteadyDrive(NamedTuple):
    """Inner ring at constant speed under a constant load along x, outer ring at rest."""

    inner_speed: float
    load_x: float


class TwoSpeedDrive(NamedTuple):
    """Both rings at constant speeds under a constant load along x."""

    inner_speed: float
    outer_speed: float
    load_x: float


@law_of(SteadyDrive)
def action(drive, y):
    """The action at a state."""
    return Action(drive.inner_speed, 0.0, drive.load_x, 0.0, 1.0, 0.0, 1.0, 0.0)


@action.body(TwoSpeedDrive)
def _(drive, y):
    return Action(drive.inner_speed, drive.outer_speed, drive.load_x, 0.0, 1.0, 0.0, 1.0, 0.0)


@law_of(SteadyDrive, TwoSpeedDrive)
def tick(drive, acting, row, dy):
    """Write the derivatives of the clock, where there is one."""


@law_of(SteadyDrive, TwoSpeedDrive)
def load_power(drive, acting, vx, vy):
    """Power [W] that the load gives to the inner ring, where it has no potential."""
    return 0.0


@law_of(SteadyDrive, TwoSpeedDrive)
def load_potential(drive, ring_x):
    """Potential energy [J] of a constant load; zero where its work is booked as power."""
    return -drive.load_x * ring_x


AIR_DENSITY = 1.2  # [kg/m^3] at 20 C and 1 bar


class NoDrag(NamedTuple):
    """Rollers in a vacuum."""


class CylinderDrag(NamedTuple):
    """Cylinder in cross-flow: F = factor |v| v."""

    factor: float  # rho_e C_d A/2 [kg/m]


def cylinder_drag(
    oil_density: float, oil_fraction: float, coefficient: float, diameter: float, length: float
) -> CylinderDrag:
    """Drag of a roller in a mixture of density X rho_oil + (1 - X) rho_air, with A = D L."""
    density = oil_fraction * oil_density + (1.0 - oil_fraction) * AIR_DENSITY
    return CylinderDrag(0.5 * density * coefficient * diameter * length)


@law_of(NoDrag)
def drag_forces(drag, rollers, y, row, dy):
    """Write the drag on each roller into row ``row`` of ``dy``; returns the power lost [W]."""
    for i in range(2 * rollers, 4 * rollers):
        dy[row, i] = 0.0
    return 0.0


@drag_forces.body(CylinderDrag)
def _(drag, rollers, y, row, dy):
    for j in range(rollers):
        vx, vy = y[2 * rollers + j], y[3 * rollers + j]
        per_speed = drag.factor * math.sqrt(vx * vx + vy * vy)
        dy[row, 2 * rollers + j] = -per_speed * vx
        dy[row, 3 * rollers + j] = -per_speed * vy
    # A sum in a loop of its own leaves the one above free to vectorise.
    power = 0.0
    for j in range(2 * rollers, 3 * rollers):
        power -= dy[row, j] * y[j] + dy[row, rollers + j] * y[rollers + j]
    return power


class NoGravity(NamedTuple):
    """Weightless."""


class Gravity(NamedTuple):
    """Acceleration x, y [m/s^2]."""

    x: float
    y: float


@law_of(NoGravity)
def add_weight(gravity, first, count, row, dy):
    """Add gravity to the accelerations of ``count`` bodies: x from ``first`` on in row ``row`` of ``dy``, then y."""


@add_weight.body(Gravity)
def _(gravity, first, count, row, dy):
    for i in range(first, first + count):
        dy[row, i] += gravity.x
        dy[row, i + count] += gravity.y


@law_of(NoGravity)
def height_energy(gravity, mass, x, y):
    """Potential energy [J] of a mass [kg] at x, y [m]."""
    return 0.0


@height_energy.body(Gravity)
def _(gravity, mass, x, y):
    return -mass * (gravity.x * x + gravity.y * y)
