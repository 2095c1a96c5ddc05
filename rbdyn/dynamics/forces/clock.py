"""A drive by the clock: speed and load by schedule, a load and an unbalance that turn with the inner ring.

Imported only for a scene that has one.
"""

import math
from typing import Any, NamedTuple

from rbdyn.dynamics.forces.drive import Action, action, load_potential, load_power, tick
from rbdyn.dynamics.forces.schedule import value_at
from rbdyn.dynamics.forces.state import INNER_ANGLE, OUTER_ANGLE, TIME


class ClockedDrive(NamedTuple):
    """Inner speed and load along x by schedule; a load and an unbalance that turn with the inner ring."""

    start: int  # where the clock stands in the state
    inner_speed: Any  # schedule [rad/s]
    outer_speed: float  # [rad/s]
    load: Any  # schedule [N]
    rotating_load: float  # [N]
    unbalance: float  # mass times eccentricity [kg m]


@action.body(ClockedDrive)
def _(drive, y):
    speed = value_at(drive.inner_speed, y[drive.start + TIME])
    inner, outer = y[drive.start + INNER_ANGLE], y[drive.start + OUTER_ANGLE]
    cosine, sine = math.cos(inner), math.sin(inner)
    rotating = drive.rotating_load + drive.unbalance * speed * speed
    return Action(
        speed,
        drive.outer_speed,
        value_at(drive.load, y[drive.start + TIME]) + rotating * cosine,
        rotating * sine,
        cosine,
        sine,
        math.cos(outer),
        math.sin(outer),
    )


@tick.body(ClockedDrive)
def _(drive, acting, row, dy):
    dy[row, drive.start + TIME] = 1.0
    dy[row, drive.start + INNER_ANGLE] = acting.inner_speed
    dy[row, drive.start + OUTER_ANGLE] = acting.outer_speed


@load_power.body(ClockedDrive)
def _(drive, acting, vx, vy):
    return acting.load_x * vx + acting.load_y * vy


@load_potential.body(ClockedDrive)
def _(drive, ring_x):
    return 0.0
