"""An outer ring on a flexible, damped support. Imported only for a scene that has one."""

from typing import NamedTuple

from rbdyn.dynamics.forces.gravity import add_weight, height_energy
from rbdyn.dynamics.forces.ring_motion import RingMotion, outer_motion, support_energy, support_motion
from rbdyn.dynamics.forces.state import SUPPORT_VX, SUPPORT_VY, SUPPORT_X, SUPPORT_Y


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
