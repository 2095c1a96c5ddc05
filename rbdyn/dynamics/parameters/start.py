"""Where a run starts: static load share at epicyclic speed, rollers at seeded offsets in their pockets."""

import math

import numpy as np

from rbdyn.arrays import Array
from rbdyn.dynamics.forces.drive import action
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.forces.state import CAGE_ANGLE, CAGE_SPEED, CAGE_X, CAGE_Y, RING_X
from rbdyn.dynamics.parameters.scales import layout_of
from rbdyn.dynamics.parameters.static_load import static_share
from rbdyn.scene import Scene


def start_state(scene: Scene, bearing: RollerBearing, generator: np.random.Generator) -> Array:
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
    motion = scene.geometry.rolling(acting.inner_speed, acting.outer_speed)
    pocket = scene.pocket_clearance_m
    offsets = generator.uniform(-0.2, 0.2, z) * pocket / (0.5 * scene.bearing.pitch_diameter)
    direction, cage_angle = generator.uniform(0.0, 2.0 * np.pi, 2)
    angles = cage_angle + 2.0 * np.pi * np.arange(z) / z + offsets
    guide = scene.guide_play_m
    offset = 0.1 * (0.5 * pocket if guide is None else min(0.5 * guide, 0.5 * pocket))
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
