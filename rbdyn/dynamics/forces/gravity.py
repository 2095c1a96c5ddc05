"""Gravity, or the steady part of a manoeuvre, on rollers, cage and rings."""

from typing import NamedTuple

from rbdyn.compiled.kernel import law


class NoGravity(NamedTuple):
    """Weightless."""


class Gravity(NamedTuple):
    """Acceleration x, y [m/s^2]."""

    x: float
    y: float


@law
def add_weight(gravity, first, count, row, dy):
    """Add gravity to the accelerations of ``count`` bodies: x from ``first`` on in row ``row`` of ``dy``, then y."""


@add_weight.body(NoGravity)
def _(gravity, first, count, row, dy):
    pass


@add_weight.body(Gravity)
def _(gravity, first, count, row, dy):
    for i in range(first, first + count):
        dy[row, i] += gravity.x
        dy[row, i + count] += gravity.y


@law
def height_energy(gravity, mass, x, y):
    """Potential energy [J] of a mass [kg] at x, y [m]."""


@height_energy.body(NoGravity)
def _(gravity, mass, x, y):
    return 0.0


@height_energy.body(Gravity)
def _(gravity, mass, x, y):
    return -mass * (gravity.x * x + gravity.y * y)
