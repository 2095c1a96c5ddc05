"""Rigid bodies: rings, of which the outer one may stand on a flexible, damped support, and the cage, balanced or not.

A cage whose centre of mass lies off its geometric centre: the state holds the geometric centre x. With the centre of mass at
x + e u(angle), Newton and Euler about it give a = F/m - e d^2u/dt^2 and J d(speed)/dt = M - e u x F, where M is the moment of the
forces about x.
"""

from typing import NamedTuple

from rbdyn.compiled.kernel import law
from rbdyn.dynamics.forces.state import SUPPORT_VX, SUPPORT_VY, SUPPORT_X, SUPPORT_Y
from rbdyn.dynamics.forces.surroundings import add_weight, height_energy


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
    """Outer ring whose centre stays."""


@law
def outer_motion(ring, y, speed, cosine, sine):
    """Motion of the outer ring that turns at ``speed``."""


@outer_motion.body(HeldRing)
def _(ring, y, speed, cosine, sine):
    return RingMotion(0.0, 0.0, 0.0, 0.0, speed, cosine, sine)


@law
def support_motion(ring, gravity, force_x, force_y, y, row, dy):
    """Write the outer ring's derivatives under the forces [N] on it; returns the power lost in the damper [W]."""


@support_motion.body(HeldRing)
def _(ring, gravity, force_x, force_y, y, row, dy):
    return 0.0


@law
def support_energy(ring, gravity, y):
    """Kinetic, elastic and potential energy [J] of the outer ring on its support."""


@support_energy.body(HeldRing)
def _(ring, gravity, y):
    return 0.0, 0.0, 0.0


class SupportedRing(NamedTuple):
    """Outer ring (with its share of the housing) on a squirrel cage with a damper."""

    start: int  # where its coordinates stand in the state
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


@law
def cage_acceleration(cage, fx, fy, moment, cosine, sine, speed):
    """Acceleration of the geometric centre x, y and of the rotation; ``cosine, sine``: of the cage angle."""


@cage_acceleration.body(BalancedCage)
def _(cage, fx, fy, moment, cosine, sine, speed):
    return fx / cage.mass, fy / cage.mass, moment / cage.inertia


@cage_acceleration.body(UnbalancedCage)
def _(cage, fx, fy, moment, cosine, sine, speed):
    spin_up = (moment - cage.offset * (cosine * fy - sine * fx)) / cage.inertia
    inward, ahead = cage.offset * speed * speed, cage.offset * spin_up
    return (fx / cage.mass + inward * cosine + ahead * sine, fy / cage.mass + inward * sine - ahead * cosine, spin_up)


@law
def cage_kinetic_energy(cage, vx, vy, cosine, sine, speed):
    """Kinetic energy [J]."""


@cage_kinetic_energy.body(BalancedCage)
def _(cage, vx, vy, cosine, sine, speed):
    return 0.5 * cage.mass * (vx * vx + vy * vy) + 0.5 * cage.inertia * speed * speed


@cage_kinetic_energy.body(UnbalancedCage)
def _(cage, vx, vy, cosine, sine, speed):
    ahead = cage.offset * speed
    ux, uy = vx - ahead * sine, vy + ahead * cosine
    return 0.5 * cage.mass * (ux * ux + uy * uy) + 0.5 * cage.inertia * speed * speed


@law
def mass_centre(cage, x, y, cosine, sine):
    """Centre of mass x, y [m]."""


@mass_centre.body(BalancedCage)
def _(cage, x, y, cosine, sine):
    return x, y


@mass_centre.body(UnbalancedCage)
def _(cage, x, y, cosine, sine):
    return x + cage.offset * cosine, y + cage.offset * sine
