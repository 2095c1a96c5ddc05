"""Equations of motion: forces gathered into accelerations, and the power each loss takes.

Newton for rollers, cage and inner ring in Cartesian coordinates (Chen et al. 2022, eq 19-21 in the plane; free of
their centrifugal terms because the frame does not turn), Euler for spins. The inner ring turns at prescribed speed.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.hertz_line import elastic_energy
from rbdyn.dynamics.drag import drag_forces
from rbdyn.dynamics.guide_land import guide_energy, guide_wrench
from rbdyn.dynamics.pocket import pocket_contact, pocket_energy
from rbdyn.dynamics.races import Race, inner_race_forces, outer_race_forces
from rbdyn.dynamics.state import (
    CAGE_ANGLE,
    CAGE_SPEED,
    CAGE_VX,
    CAGE_VY,
    CAGE_X,
    CAGE_Y,
    RING_VX,
    RING_VY,
    RING_X,
    RING_Y,
)
from rbdyn.kernel import entry, kernel, routine

# Powers lost, in the order of the power vector; the power that drives the shaft stands behind them.
LOSSES = (
    "outer_race_traction",
    "inner_race_traction",
    "rolling_resistance",
    "race_damping",
    "pocket_friction",
    "pocket_damping",
    "land_film",
    "land_friction",
    "land_damping",
    "roller_drag",
)
SHAFT = len(LOSSES)
POWERS = SHAFT + 1
# Extremes, in the order of the load vector.
POCKET_LOAD, OUTER_LOAD, INNER_LOAD, LAND_LOAD = range(4)
LOADS = 4


class RollerBearing(NamedTuple):
    """All that the compiled code reads. SI; laws are NamedTuples whose types choose the compiled bodies."""

    rollers: int
    roller_radius: float
    roller_mass: float
    roller_inertia: float
    outer: Race
    inner: Race
    pocket: Any
    pocket_cos: NDArray[np.float64]
    pocket_sin: NDArray[np.float64]
    guide: Any
    drag: Any
    cage_mass: float
    cage_inertia: float
    ring_mass: float
    ring_speed: float
    radial_load: float


@routine
def derivative(bearing, y, row, dy, power, loads, scratch):
    """Fill row ``row`` of ``dy``, of the powers [W] and of the largest loads [N], for the state ``y``."""
    z = bearing.rollers
    body = 5 * z
    cage_x, cage_y = y[body + CAGE_X], y[body + CAGE_Y]
    cage_vx, cage_vy = y[body + CAGE_VX], y[body + CAGE_VY]
    cage_speed = y[body + CAGE_SPEED]
    ring_x, ring_y = y[body + RING_X], y[body + RING_Y]
    ring_vx, ring_vy = y[body + RING_VX], y[body + RING_VY]
    radius, ring_speed = bearing.roller_radius, bearing.ring_speed
    cosine, sine = math.cos(y[body + CAGE_ANGLE]), math.sin(y[body + CAGE_ANGLE])
    cage_fx = cage_fy = cage_moment = pocket_load = pocket_friction = pocket_damping = 0.0
    drag_loss = drag_forces(bearing.drag, z, y, row, dy)
    for j in range(z):
        vx, vy = y[2 * z + j], y[3 * z + j]
        ex = cosine * bearing.pocket_cos[j] - sine * bearing.pocket_sin[j]
        ey = sine * bearing.pocket_cos[j] + cosine * bearing.pocket_sin[j]
        wall = pocket_contact(
            bearing.pocket, radius, ex, ey,
            y[j] - cage_x, y[z + j] - cage_y, vx - cage_vx, vy - cage_vy, y[4 * z + j], cage_speed,
        )  # fmt: skip
        dy[row, j] = vx
        dy[row, z + j] = vy
        dy[row, 2 * z + j] += wall[0]
        dy[row, 3 * z + j] += wall[1]
        dy[row, 4 * z + j] = wall[2]
        cage_fx -= wall[0]
        cage_fy -= wall[1]
        cage_moment += wall[3]
        pocket_load = max(pocket_load, wall[4])
        pocket_friction += wall[5]
        pocket_damping += wall[6]
    ring = (ring_x, ring_y, ring_vx, ring_vy, ring_speed)
    outer = outer_race_forces(bearing.outer, radius, z, y, row, dy, scratch)
    inner = inner_race_forces(bearing.inner, radius, ring, z, y, row, dy, scratch)
    per_mass, per_inertia = 1.0 / bearing.roller_mass, 1.0 / bearing.roller_inertia
    for i in range(2 * z, 4 * z):
        dy[row, i] *= per_mass
    for i in range(4 * z, 5 * z):
        dy[row, i] *= per_inertia
    land = guide_wrench(
        bearing.guide,
        (cage_x, ring_x),
        (cage_y, ring_y),
        (cage_vx, ring_vx),
        (cage_vy, ring_vy),
        cage_speed,
        bearing.ring_speed,
    )
    dy[row, body + CAGE_X] = cage_vx
    dy[row, body + CAGE_Y] = cage_vy
    dy[row, body + CAGE_ANGLE] = cage_speed
    dy[row, body + CAGE_VX] = (cage_fx + land[0]) / bearing.cage_mass
    dy[row, body + CAGE_VY] = (cage_fy + land[1]) / bearing.cage_mass
    dy[row, body + CAGE_SPEED] = (cage_moment + land[2]) / bearing.cage_inertia
    dy[row, body + RING_X] = ring_vx
    dy[row, body + RING_Y] = ring_vy
    dy[row, body + RING_VX] = (inner[0] + land[4] + bearing.radial_load) / bearing.ring_mass
    dy[row, body + RING_VY] = (inner[1] + land[5]) / bearing.ring_mass
    power[row, 0] = outer[4]
    power[row, 1] = inner[4]
    power[row, 2] = outer[5] + inner[5]
    power[row, 3] = outer[6] + inner[6]
    power[row, 4] = pocket_friction
    power[row, 5] = pocket_damping
    power[row, 6] = land[7]
    power[row, 7] = land[8]
    power[row, 8] = land[9]
    power[row, 9] = drag_loss
    power[row, SHAFT] = -(inner[2] + land[3]) * ring_speed
    loads[row, POCKET_LOAD] = pocket_load
    loads[row, OUTER_LOAD] = outer[3]
    loads[row, INNER_LOAD] = inner[3]
    loads[row, LAND_LOAD] = land[6]


@kernel
def race_energy(race, side, roller_radius, dx, dy):
    """Elastic energy [J] of one race contact."""
    approach = side * (math.sqrt(dx * dx + dy * dy) - race.radius) + roller_radius
    return elastic_energy(race.contact, approach) if approach > 0.0 else 0.0


@entry
def mechanical_energy(bearing, y):
    """(kinetic, elastic, load potential) energy [J] of a state. The ring's own rotation, being prescribed, is left out."""
    z = bearing.rollers
    body = 5 * z
    cage_x, cage_y = y[body + CAGE_X], y[body + CAGE_Y]
    ring_x, ring_y = y[body + RING_X], y[body + RING_Y]
    cosine, sine = math.cos(y[body + CAGE_ANGLE]), math.sin(y[body + CAGE_ANGLE])
    kinetic = 0.5 * bearing.cage_mass * (y[body + CAGE_VX] ** 2 + y[body + CAGE_VY] ** 2)
    kinetic += 0.5 * bearing.cage_inertia * y[body + CAGE_SPEED] ** 2
    kinetic += 0.5 * bearing.ring_mass * (y[body + RING_VX] ** 2 + y[body + RING_VY] ** 2)
    elastic = guide_energy(bearing.guide, cage_x, cage_y, ring_x, ring_y)
    for j in range(z):
        px, py = y[j], y[z + j]
        kinetic += 0.5 * bearing.roller_mass * (y[2 * z + j] ** 2 + y[3 * z + j] ** 2)
        kinetic += 0.5 * bearing.roller_inertia * y[4 * z + j] ** 2
        elastic += race_energy(bearing.outer, 1.0, bearing.roller_radius, px, py)
        elastic += race_energy(bearing.inner, -1.0, bearing.roller_radius, px - ring_x, py - ring_y)
        ex = cosine * bearing.pocket_cos[j] - sine * bearing.pocket_sin[j]
        ey = sine * bearing.pocket_cos[j] + cosine * bearing.pocket_sin[j]
        elastic += pocket_energy(bearing.pocket, ex, ey, px - cage_x, py - cage_y)
    return kinetic, elastic, -bearing.radial_load * ring_x


@entry
def pocket_loads(bearing, states):
    """Signed wall loads [N], shape (samples, rollers), of states (samples, 5 Z + 10).

    Positive on the front wall (the roller drives the cage), negative on the rear wall.
    """
    z = bearing.rollers
    body = 5 * z
    result = np.empty((len(states), z))
    for i in range(len(states)):
        y = states[i]
        cosine, sine = math.cos(y[body + CAGE_ANGLE]), math.sin(y[body + CAGE_ANGLE])
        for j in range(z):
            ex = cosine * bearing.pocket_cos[j] - sine * bearing.pocket_sin[j]
            ey = sine * bearing.pocket_cos[j] + cosine * bearing.pocket_sin[j]
            dx, dy = y[j] - y[body + CAGE_X], y[z + j] - y[body + CAGE_Y]
            wall = pocket_contact(
                bearing.pocket,
                bearing.roller_radius,
                ex,
                ey,
                dx,
                dy,
                y[2 * z + j] - y[body + CAGE_VX],
                y[3 * z + j] - y[body + CAGE_VY],
                y[4 * z + j],
                y[body + CAGE_SPEED],
            )
            result[i, j] = math.copysign(wall[4], dy * ex - dx * ey)
    return result
