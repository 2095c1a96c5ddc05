"""Where a run starts: static load share at epicyclic speed, rollers at seeded offsets in their pockets."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.hertz_line import elastic_load
from rbdyn.dynamics.equations import RollerBearing
from rbdyn.dynamics.model import kinematics
from rbdyn.dynamics.state import CAGE_SPEED, CAGE_X, CAGE_Y, RING_X, size
from rbdyn.kernel import entry, kernel, routine
from rbdyn.scene import Scene

BISECTIONS = 60


@kernel
def race_loads(bearing, radius, angle, ring_x):
    """Static loads [N] of a roller at (radius, angle): outer race, inner race with the ring at (ring_x, 0)."""
    outer_approach = radius + bearing.roller_radius - bearing.outer.radius
    distance = math.sqrt(radius**2 - 2.0 * radius * ring_x * math.cos(angle) + ring_x**2)
    inner_approach = bearing.inner.radius + bearing.roller_radius - distance
    outer = elastic_load(bearing.outer.contact, outer_approach) if outer_approach > 0.0 else 0.0
    inner = elastic_load(bearing.inner.contact, inner_approach) if inner_approach > 0.0 else 0.0
    return outer, inner


@routine
def seated_radius(bearing, angle, ring_x, orbit_speed):
    """Orbit radius [m] at which outer load balances inner load and centrifugal force."""
    low = bearing.inner.radius
    high = 2.0 * bearing.outer.radius
    for _ in range(BISECTIONS):
        radius = 0.5 * (low + high)
        outer, inner = race_loads(bearing, radius, angle, ring_x)
        if outer > inner + bearing.roller_mass * radius * orbit_speed**2:
            high = radius
        else:
            low = radius
    return high


@entry
def static_share(bearing, angles, orbit_speed, radii):
    """Ring displacement along x [m] under the radial load; fills the orbit radii [m] of rollers at ``angles``."""
    low, high = 0.0, 1e-5
    settled = False
    while not settled:
        force = 0.0
        for j in range(angles.size):
            radius = seated_radius(bearing, angles[j], high, orbit_speed)
            force += race_loads(bearing, radius, angles[j], high)[1] * math.cos(angles[j])
        settled = force >= bearing.radial_load or high > bearing.roller_radius
        if not settled:
            low, high = high, 2.0 * high
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        force = 0.0
        for j in range(angles.size):
            radii[j] = seated_radius(bearing, angles[j], middle, orbit_speed)
            force += race_loads(bearing, radii[j], angles[j], middle)[1] * math.cos(angles[j])
        if force >= bearing.radial_load:
            high = middle
        else:
            low = middle
    return high


def start_state(scene: Scene, bearing: RollerBearing, generator: np.random.Generator) -> NDArray[np.float64]:
    """State at time zero.

    Rollers stand within +-20 % of the pocket clearance of their pockets' middles and the cage a tenth of the guide
    (or pocket) clearance off centre, both at random; all move as if they rolled without slip.
    """
    z = bearing.rollers
    motion = kinematics(scene)
    pitch_radius = 0.5e-3 * scene.bearing.pitch_diameter_mm
    pocket = 1e-3 * scene.cage.pocket_clearance_mm
    angles = 2.0 * np.pi * np.arange(z) / z + generator.uniform(-0.2, 0.2, z) * pocket / pitch_radius
    direction = generator.uniform(0.0, 2.0 * np.pi)
    offset = 0.1 * min(0.5e-3 * scene.cage.guide_clearance_mm, 0.5 * pocket)
    radii = np.empty(z)
    ring_x = static_share(bearing, angles, motion.cage_speed, radii)
    cosine, sine = np.cos(angles), np.sin(angles)
    y = np.zeros(size(z))
    y[: 5 * z] = np.concatenate(
        (
            radii * cosine,
            radii * sine,
            -radii * motion.cage_speed * sine,
            radii * motion.cage_speed * cosine,
            np.full(z, motion.roller_spin),
        )
    )
    body = y[5 * z :]
    body[CAGE_X], body[CAGE_Y] = offset * math.cos(direction), offset * math.sin(direction)
    body[CAGE_SPEED] = motion.cage_speed
    body[RING_X] = ring_x
    return y
