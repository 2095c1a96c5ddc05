"""What turns the rings and loads the shaft: steadily, or by the clock."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rbdyn.dynamics.schedule import value_at
from rbdyn.dynamics.state import INNER_ANGLE, OUTER_ANGLE, TIME
from rbdyn.kernel import law


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


class ClockedDrive(NamedTuple):
    """Inner speed and load along x by schedule; a load and an unbalance that turn with the inner ring."""

    start: int  # where the clock stands in the state
    inner_speed: Any  # schedule [rad/s]
    outer_speed: float  # [rad/s]
    load: Any  # schedule [N]
    rotating_load: float  # [N]
    unbalance: float  # mass times eccentricity [kg m]


@law
def action(drive, y):
    """The action at a state."""


@action.body(SteadyDrive)
def _(drive, y):
    return Action(drive.inner_speed, 0.0, drive.load_x, 0.0, 1.0, 0.0, 1.0, 0.0)


@action.body(TwoSpeedDrive)
def _(drive, y):
    return Action(drive.inner_speed, drive.outer_speed, drive.load_x, 0.0, 1.0, 0.0, 1.0, 0.0)


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


@law
def tick(drive, acting, row, dy):
    """Write the derivatives of the clock, where there is one."""


@tick.body(SteadyDrive, TwoSpeedDrive)
def _(drive, acting, row, dy):
    pass


@tick.body(ClockedDrive)
def _(drive, acting, row, dy):
    dy[row, drive.start + TIME] = 1.0
    dy[row, drive.start + INNER_ANGLE] = acting.inner_speed
    dy[row, drive.start + OUTER_ANGLE] = acting.outer_speed


@law
def load_power(drive, acting, vx, vy):
    """Power [W] that the load gives to the inner ring, where it has no potential."""


@load_power.body(SteadyDrive, TwoSpeedDrive)
def _(drive, acting, vx, vy):
    return 0.0


@load_power.body(ClockedDrive)
def _(drive, acting, vx, vy):
    return acting.load_x * vx + acting.load_y * vy


@law
def load_potential(drive, ring_x):
    """Potential energy [J] of a constant load; zero where its work is booked as power."""


@load_potential.body(SteadyDrive, TwoSpeedDrive)
def _(drive, ring_x):
    return -drive.load_x * ring_x


@load_potential.body(ClockedDrive)
def _(drive, ring_x):
    return 0.0
