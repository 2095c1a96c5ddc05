"""What the surroundings do to the bodies: drag of the oil-air mixture on orbiting rollers; gravity, or the steady part of a manoeuvre,
on rollers, cage and rings.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import law

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


@law
def drag_forces(drag, rollers, y, row, dy):
    """Write the drag on each roller into row ``row`` of ``dy``; returns the power lost [W]."""


@drag_forces.body(NoDrag)
def _(drag, rollers, y, row, dy):
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
