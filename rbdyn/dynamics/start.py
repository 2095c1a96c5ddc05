"""Where a run starts: static load share at epicyclic speed, rollers at seeded offsets in their pockets."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.hertz_line import line_load
from rbdyn.dynamics.drive import action
from rbdyn.dynamics.equations import RollerBearing
from rbdyn.dynamics.geometry import kinematics, layout_of
from rbdyn.dynamics.race_form import form_at
from rbdyn.dynamics.races import roller_radius
from rbdyn.dynamics.state import CAGE_ANGLE, CAGE_SPEED, CAGE_X, CAGE_Y, RING_X
from rbdyn.kernel import entry, kernel, routine
from rbdyn.scene import Scene

BISECTIONS = 60
BALANCED = 1e-12  # of the forces at the ends of the bracket


@kernel
def race_loads(bearing, j, radius, angle, ring_x):
    """Static loads [N] of roller ``j`` at (radius, angle): outer race, inner race with the ring at (ring_x, 0)."""
    own_radius = roller_radius(bearing.sizes, j)
    cosine, sine = math.cos(angle), math.sin(angle)
    rise, _ = form_at(bearing.outer.form, cosine, sine, 1.0, 0.0)
    overlap = radius + own_radius - bearing.outer.radius - rise
    outer = line_load(bearing.outer.contact, overlap, cosine, sine)[0]
    dx, dy = radius * cosine - ring_x, radius * sine
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    rise, _ = form_at(bearing.inner.form, nx, ny, 1.0, 0.0)
    overlap = bearing.inner.radius + rise + own_radius - distance
    return outer, line_load(bearing.inner.contact, overlap, nx, ny)[0]


@routine
def seated_radius(bearing, j, angle, ring_x, orbit_speed):
    """Orbit radius [m] at which outer load balances inner load and centrifugal force."""
    low = bearing.inner.radius
    high = 2.0 * bearing.outer.radius
    for _ in range(BISECTIONS):
        radius = 0.5 * (low + high)
        outer, inner = race_loads(bearing, j, radius, angle, ring_x)
        if outer > inner + bearing.roller_mass * radius * orbit_speed**2:
            high = radius
        else:
            low = radius
    return high


@routine
def static_force(bearing, angles, orbit_speed, ring_x, radii):
    """Force along x [N] that the rollers at ``angles`` hold against a ring at (ring_x, 0); fills their orbit radii."""
    force = 0.0
    for j in range(angles.size):
        radii[j] = seated_radius(bearing, j, angles[j], ring_x, orbit_speed)
        force += race_loads(bearing, j, radii[j], angles[j], ring_x)[1] * math.cos(angles[j])
    return force


@entry
def static_share(bearing, angles, orbit_speed, load, radii):
    """Ring displacement along x [m] under a load [N] along x; fills the orbit radii [m] of rollers at ``angles``.

    The force rises with the displacement, which is negative where the form of the races alone pushes harder.
    """
    reach = roller_radius(bearing.sizes, 0)
    low, high = -1e-5, 1e-5
    while static_force(bearing, angles, orbit_speed, high, radii) < load and high < reach:
        low, high = high, 2.0 * high
    while static_force(bearing, angles, orbit_speed, low, radii) > load and low > -reach:
        low, high = 2.0 * low, low
    below = static_force(bearing, angles, orbit_speed, low, radii) - load
    above = static_force(bearing, angles, orbit_speed, high, radii) - load
    # False position that halves the stale end (Illinois): a tenth of the forces that bisection takes.
    enough = BALANCED * max(abs(below), abs(above))
    if below >= 0.0 or above <= 0.0:
        # No load within the play, or more than the bracket holds.
        return 0.5 * (low + high) if below == above else low if below >= 0.0 else high
    middle = high
    for _ in range(BISECTIONS):
        middle = (low * above - high * below) / (above - below)
        force = static_force(bearing, angles, orbit_speed, middle, radii) - load
        if abs(force) <= enough:
            break
        if force > 0.0:
            high, above, below = middle, force, 0.5 * below
        else:
            low, below, above = middle, force, 0.5 * above
    return middle


def start_state(scene: Scene, bearing: RollerBearing, generator: np.random.Generator) -> NDArray[np.float64]:
    """State at time zero.

    The cage stands at any angle, rollers within +-20 % of the pocket clearance of their pockets' middles and the cage a
    tenth of the guide (or pocket) clearance off centre, all at random; all move as if they rolled without slip. With one
    angle for all, replicates would share the passage of the rollers through the load zone, which no mean over them
    takes away.
    """
    z = bearing.rollers
    state = layout_of(scene)
    y = np.zeros(state.size)
    acting = action(bearing.drive, y)
    motion = kinematics(scene, acting.inner_speed, acting.outer_speed)
    pitch_radius = 0.5e-3 * scene.bearing.pitch_diameter_mm
    pocket = 1e-3 * scene.cage.pocket_clearance_mm
    offsets = generator.uniform(-0.2, 0.2, z) * pocket / pitch_radius
    direction, cage_angle = generator.uniform(0.0, 2.0 * np.pi, 2)
    angles = cage_angle + 2.0 * np.pi * np.arange(z) / z + offsets
    offset = 0.1 * min(0.5e-3 * scene.cage.guide_clearance_mm, 0.5 * pocket)
    radii = np.empty(z)
    ring_x = static_share(bearing, angles, motion.cage_speed, acting.load_x, radii)
    cosine, sine = np.cos(angles), np.sin(angles)
    y[: 5 * z] = np.concatenate(
        (
            radii * cosine,
            radii * sine,
            -radii * motion.cage_speed * sine,
            radii * motion.cage_speed * cosine,
            np.full(z, motion.roller_spin),
        )
    )
    body = y[5 * z :]  # cage, ring and what the scene adds, which starts at rest at time zero
    body[CAGE_X], body[CAGE_Y] = offset * math.cos(direction), offset * math.sin(direction)
    body[CAGE_ANGLE], body[CAGE_SPEED] = cage_angle, motion.cage_speed
    body[RING_X] = ring_x
    if state.support is not None:
        # All sits on the outer ring, which gives way under the load.
        sag = acting.load_x / bearing.outer_ring.stiffness
        y[:z] += sag
        y[state.support] = sag
        body[CAGE_X] += sag
        body[RING_X] += sag
    return y
