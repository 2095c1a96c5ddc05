"""The cage as a rigid body: balanced, or with its centre of mass off its geometric centre.

The state holds the geometric centre x. With the centre of mass at x + e u(angle), Newton and Euler about it give
a = F/m - e d^2u/dt^2 and J d(speed)/dt = M - e u x F, where M is the moment of the forces about x.
"""

from typing import NamedTuple

from rbdyn.compiled.kernel import law


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
