"""Motion of the rings: an outer ring held still at the centre, or free on a flexible, damped support."""

from __future__ import annotations

from typing import NamedTuple

from rbdyn.dynamics.gravity import add_weight, height_energy
from rbdyn.kernel import law


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


class SupportedRing(NamedTuple):
    """Outer ring (with its share of the housing) on a squirrel cage with a damper."""

    start: int  # where its coordinates stand in the state
    mass: float  # [kg]
    stiffness: float  # [N/m]
    damping: float  # [N s/m]


@law
def outer_motion(ring, y, speed, cosine, sine):
    """Motion of the outer ring that turns at ``speed``."""


@outer_motion.body(HeldRing)
def _(ring, y, speed, cosine, sine):
    return RingMotion(0.0, 0.0, 0.0, 0.0, speed, cosine, sine)


@outer_motion.body(SupportedRing)
def _(ring, y, speed, cosine, sine):
    i = ring.start
    return RingMotion(y[i], y[i + 1], y[i + 2], y[i + 3], speed, cosine, sine)


@law
def support_motion(ring, gravity, force_x, force_y, y, row, dy):
    """Write the outer ring's derivatives under the forces [N] on it; returns the power lost in the damper [W]."""


@support_motion.body(HeldRing)
def _(ring, gravity, force_x, force_y, y, row, dy):
    return 0.0


@support_motion.body(SupportedRing)
def _(ring, gravity, force_x, force_y, y, row, dy):
    i = ring.start
    vx, vy = y[i + 2], y[i + 3]
    dy[row, i] = vx
    dy[row, i + 1] = vy
    dy[row, i + 2] = (force_x - ring.stiffness * y[i] - ring.damping * vx) / ring.mass
    dy[row, i + 3] = (force_y - ring.stiffness * y[i + 1] - ring.damping * vy) / ring.mass
    add_weight(gravity, i + 2, 1, row, dy)
    return ring.damping * (vx * vx + vy * vy)


@law
def support_energy(ring, gravity, y):
    """Kinetic, elastic and potential energy [J] of the outer ring on its support."""


@support_energy.body(HeldRing)
def _(ring, gravity, y):
    return 0.0, 0.0, 0.0


@support_energy.body(SupportedRing)
def _(ring, gravity, y):
    i = ring.start
    return (
        0.5 * ring.mass * (y[i + 2] ** 2 + y[i + 3] ** 2),
        0.5 * ring.stiffness * (y[i] ** 2 + y[i + 1] ** 2),
        height_energy(gravity, ring.mass, y[i], y[i + 1]),
    )
