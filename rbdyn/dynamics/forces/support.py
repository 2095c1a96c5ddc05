"""An outer ring on a flexible, damped support. Imported only for a scene that has one."""

from __future__ import annotations

from typing import NamedTuple

from rbdyn.dynamics.forces.gravity import add_weight, height_energy
from rbdyn.dynamics.forces.ring_motion import RingMotion, outer_motion, support_energy, support_motion


class SupportedRing(NamedTuple):
    """Outer ring (with its share of the housing) on a squirrel cage with a damper."""

    start: int  # where its coordinates stand in the state
    mass: float  # [kg]
    stiffness: float  # [N/m]
    damping: float  # [N s/m]


@outer_motion.body(SupportedRing)
def _(ring, y, speed, cosine, sine):
    i = ring.start
    return RingMotion(y[i], y[i + 1], y[i + 2], y[i + 3], speed, cosine, sine)


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


@support_energy.body(SupportedRing)
def _(ring, gravity, y):
    i = ring.start
    return (
        0.5 * ring.mass * (y[i + 2] ** 2 + y[i + 3] ** 2),
        0.5 * ring.stiffness * (y[i] ** 2 + y[i + 1] ** 2),
        height_energy(gravity, ring.mass, y[i], y[i + 1]),
    )
