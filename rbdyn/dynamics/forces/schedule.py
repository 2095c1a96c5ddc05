"""Speeds and loads over time: constant, in steps, in straight or smooth ramps; a load and an unbalance that turn with the inner ring.

Imported only for a scene that has one.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import kernel, law_of
from rbdyn.dynamics.forces.bodies import Action, action, load_potential, load_power, tick
from rbdyn.dynamics.forces.state import INNER_ANGLE, OUTER_ANGLE, TIME


class Constant(NamedTuple):
    """The same at all times."""

    value: float


class Steps(NamedTuple):
    """Each value holds from its time to the next."""

    time: NDArray[np.float64]  # rising [s]
    value: NDArray[np.float64]


class Ramps(NamedTuple):
    """Straight lines between the points, constant before the first and after the last."""

    time: NDArray[np.float64]
    value: NDArray[np.float64]


class SmoothRamps(NamedTuple):
    """As ``Ramps``, with half cosines: no jump of the rate of change."""

    time: NDArray[np.float64]
    value: NDArray[np.float64]


@kernel
def segment(times, time):
    """Number of the last point at or before ``time``; -1 before the first."""
    low, high = -1, times.size
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle] <= time:
            low = middle
        else:
            high = middle
    return low


@kernel
def share_of_segment(times, i, time):
    """How far ``time`` is from point i to the next, 0 to 1."""
    return (time - times[i]) / (times[i + 1] - times[i])


@law_of(Constant)
def value_at(schedule, time):
    """Value of a schedule at a time [s]."""
    return schedule.value


@value_at.body(Steps)
def _(schedule, time):
    return schedule.value[max(segment(schedule.time, time), 0)]


@value_at.body(Ramps)
def _(schedule, time):
    i = segment(schedule.time, time)
    if i < 0 or i == schedule.time.size - 1:
        return schedule.value[max(i, 0)]
    return schedule.value[i] + share_of_segment(schedule.time, i, time) * (schedule.value[i + 1] - schedule.value[i])


@value_at.body(SmoothRamps)
def _(schedule, time):
    i = segment(schedule.time, time)
    if i < 0 or i == schedule.time.size - 1:
        return schedule.value[max(i, 0)]
    share = 0.5 - 0.5 * np.cos(np.pi * share_of_segment(schedule.time, i, time))
    return schedule.value[i] + share * (schedule.value[i + 1] - schedule.value[i])


class ClockedDrive(NamedTuple):
    """Inner speed and load along x by schedule; a load and an unbalance that turn with the inner ring."""

    start: int  # place of the clock in the state
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
