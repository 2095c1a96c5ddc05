"""Roller against the two walls of its cage pocket."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rbdyn.contact.damping import damped_load
from rbdyn.contact.hertz_line import elastic_energy, elastic_load
from rbdyn.contact.traction import traction
from rbdyn.kernel import law


class NoPocket(NamedTuple):
    """Rollers pass through the cage."""


class Pocket(NamedTuple):
    """Plane walls, parallel to the pocket's mid-line."""

    half_clearance: float  # (pocket width - roller diameter)/2 [m]
    contact: Any
    damping: Any
    friction: Any


@law
def pocket_contact(pocket, roller_radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    """Wrench of a pocket on its roller.

    ``ex, ey``: unit vector of the pocket's mid-line, outward; ``dx ... dvy``: centre of the roller less that of the
    cage, position [m] and velocity [m/s]; spins [rad/s]. Returns (force x, force y, moment on the roller, moment on
    the cage about its centre, wall load, powers lost in friction and in damping). The force on the cage is the
    opposite. Chen et al. 2022, eq 16, for the front and the rear wall alike.
    """


@pocket_contact.body(NoPocket)
def _(pocket, roller_radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@pocket_contact.body(Pocket)
def _(pocket, roller_radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    offset = dy * ex - dx * ey
    approach = abs(offset) - pocket.half_clearance
    if approach <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    wall = math.copysign(1.0, offset)
    height = dx * ex + dy * ey
    approach_rate = wall * (dvy * ex - dvx * ey - cage_speed * height)
    elastic = elastic_load(pocket.contact, approach)
    load = damped_load(pocket.damping, elastic, approach, approach_rate)

    lever = wall * roller_radius
    roller_surface = dvx * ex + dvy * ey - roller_spin * lever
    slip = -cage_speed * (offset + lever) - roller_surface
    friction = traction(pocket.friction, slip) * load
    normal = -wall * load
    return (
        friction * ex - normal * ey,
        friction * ey + normal * ex,
        -lever * friction,
        -height * normal + (offset + lever) * friction,
        load,
        friction * slip,
        (load - elastic) * approach_rate,
    )


@law
def pocket_energy(pocket, ex, ey, dx, dy):
    """Elastic energy [J] of a pocket contact, arguments as in ``pocket_contact``."""


@pocket_energy.body(NoPocket)
def _(pocket, ex, ey, dx, dy):
    return 0.0


@pocket_energy.body(Pocket)
def _(pocket, ex, ey, dx, dy):
    approach = abs(dy * ex - dx * ey) - pocket.half_clearance
    return elastic_energy(pocket.contact, approach) if approach > 0.0 else 0.0
