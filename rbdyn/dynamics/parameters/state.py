"""The state of a scene in SI: its layout, the scales of its errors, and the start of a run.

A run starts with the static load share, rollers at seeded offsets in their pockets. Its replicates start in two groups from
states that are clearly different: everything rolls and the cage is near the middle, or everything slips and the cage is
against its guide and, in turn, against the fronts and the backs of the rollers. Figures of a run that has settled are those of
both groups.
"""

import math
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.records import Record
from rbdyn.contact.hertz_line import palmgren
from rbdyn.contact.traction import traction
from rbdyn.dynamics.forces.bodies import action
from rbdyn.dynamics.forces.equations import OFF_RACES, RollerBearing, static_loads, static_share, without
from rbdyn.dynamics.forces.state import CAGE_ANGLE, CAGE_SPEED, CAGE_VX, CAGE_VY, CAGE_X, CAGE_Y, RING_X, Layout, layout
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.scene import Scene

# Largest scale of errors of contact speeds, as a share of the speed of the faster race. At its limit of stability the explicit
# method leaves the whole tolerance in every contact in every step, and contacts dissipate it. In a slow bearing that must
# stay small compared with the rolling loss. The implicit method damps it. With 0.05 the power balance of verlet misses 0.06 % at
# 2000 rpm in the bearing of Chen et al. 2022 and 2 % under twenty times its load, with 0.02 0.007 and 0.4 % for 1 to 3 % more steps.
SPEED_SHARES = {"rk45": 0.05, "verlet": 0.02, "rosenbrock": 1.0}
# Tolerance of the speeds of the cage over that of a contact speed. Only impacts change them, in two or three explicit steps
# each, which damp an impact where the races alone set the steps. With it impact and whirl of the bearing of Chen et al. 2022
# are off by -0.1 +- 0.2 and -0.5 +- 0.8 % in 890 right-hand sides of verlet a turn.
# The implicit method damps less: whirl goes from +0.6 +- 1.1 to +0.2 +- 0.8 % for a hundredth more right-hand sides.
CAGE_SHARES = {"rk45": 0.01, "verlet": 0.01, "rosenbrock": 0.1}
# Centrifugal force over the mean load share, below which rollers outside the load zone jump.
LIGHT = 0.05
# Scale of errors of a traction coefficient: a fifth of a usual peak.
COEFFICIENT_SCALE = 0.01
# Groups of starts. A replicate of the second starts with this slip and with the cage at so much of its play. A start from rest
# takes the cage of Chen et al. 2022 fifteen turns to come up to speed and forty more to forget, one with a slip of 0.1 twenty
# turns: its whirl with an inner-guided cage is 8 % too large over turns 20 to 40, with a slip of 0.02 2 +- 1 %.
GROUPS = 2
START_SLIP, START_PLAY = 0.02, 0.8
# Gap of the cage that it keeps there [m]: in a thinner film steps are a hundred times shorter.
START_GAP = 2e-6


class Scales(Record):
    """Characteristic load [N], approach [m] and speed [m/s] of a race contact: the scales of errors."""

    load: float
    length: float
    speed: float


def needs_clock(scene: Scene) -> bool:
    """Whether anything depends on time or on the angle of a ring."""
    operation, bearing = scene.operation, scene.bearing
    turning_form = bearing.inner_waviness or (bearing.outer_waviness and operation.speeds[1] != 0.0)
    return bool(operation.schedule or operation.rotating_load_N > 0.0 or operation.unbalance > 0.0 or turning_form)


def layout_of(scene: Scene) -> Layout:
    """Layout of the state vector."""
    present = scene.support is not None, needs_clock(scene), scene.traction.elasticity
    return scene.once("layout", lambda: layout(scene.bearing.rollers, *present))


def scales(scene: Scene) -> Scales:
    """Size of a race contact: the mean load share, or the centrifugal force, or the roller's weight."""
    return scene.once("scales", lambda: _scales(scene))


def _scales(scene: Scene) -> Scales:
    geometry, mass = scene.geometry, scene.geometry.roller_mass
    load = max(scene.operation.largest_load_N / scene.bearing.rollers, geometry.centrifugal_force, 9.81 * mass)
    approach = contact_approach(scene, load)
    return Scales(load, approach, approach * _frequency(load, approach, mass))


def contact_approach(scene: Scene, load: float) -> float:
    """Approach [m] of a race contact under a load [N] by Palmgren's law."""
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    return float((load / palmgren(modulus, scene.bearing.effective_length).stiffness) ** 0.9)


def _frequency(load: float, approach: float, mass: float) -> float:
    return math.sqrt(10.0 / 9.0 * load / approach / mass)


class LightContact(NamedTuple):
    """A roller on the outer race under its centrifugal force alone: frequency [rad/s] and the damping ratio of the law there."""

    frequency: float
    damping: float


def light_contact(scene: Scene) -> LightContact | None:
    """Vibration of a roller outside the load zone on the outer race; None where its centrifugal force is not light.

    Viscous damping is a share of the critical one, as far as the contact engages it. Of Hunt and Crossley's, c = 3/2 alpha F, and with
    k = 10/9 F/x the ratio c omega/(2 k) is 27/40 alpha x omega.
    """
    force, mass, laws = scene.geometry.centrifugal_force, scene.geometry.roller_mass, scene.model
    if not 0.0 < force < LIGHT * scales(scene).load:
        return None
    approach = contact_approach(scene, force)
    frequency = _frequency(force, approach, mass)
    engaged = min(approach * laws.race_damping_rate, 1.0)
    damping = {
        "viscous": laws.race_damping_ratio * engaged * engaged * (3.0 - 2.0 * engaged),
        "hunt_crossley": 0.675 * laws.race_damping_alpha_s_m * approach * frequency,
        "off": 0.0,
    }
    return LightContact(frequency, damping[laws.race_damping])


def fastest_surface(scene: Scene) -> float:
    """Largest speed of a raceway at any time [m/s]."""
    outer, inner = scene.geometry.raceways
    inner_speed, outer_speed = scene.operation.speeds
    fastest = max(abs(inner_speed), scene.operation.fastest_inner_speed)
    return max(abs(outer_speed) * outer, fastest * inner)


def slip_scale(bearing: RollerBearing, load: float) -> float:
    """Slip [m/s] at which the tangent of the steeper traction curve at rest would reach its peak; infinite without traction.

    Errors of slips must be below a part of this at any speed, or friction is wrong.
    """
    slips = np.logspace(-9.0, 3.0, 241)
    scale = math.inf
    for race in (bearing.outer, bearing.inner):
        curve = np.array([traction(race.traction, float(slip), load) for slip in slips])
        slope = float(curve[0] / slips[0])
        scale = min(scale, float(curve.max()) / slope if slope > 0.0 else math.inf)
    return scale


def absolute_tolerance(scene: Scene, bearing: RollerBearing, rtol: float, method: str = "rk45") -> Array:
    """Tolerance of each state component: ``rtol`` of the approach or contact speed that the component can make.

    - In a slow bearing the contact speed is at most the method's share of the speed of the faster race. The approach
      decreases with it.
    - The spin of a roller counts by its slip. That is at most the scale of the traction curve at the load of the most loaded
      roller (Stribeck). Traction coefficients that are states have a scale of their own.
    - Speeds of the cage count by the method's share of a contact speed.
    - The clock has an infinite tolerance, since methods integrate it exactly, but for kinks of a schedule within a step.
    """
    scale, state = scales(scene), layout_of(scene)
    speed = min(scale.speed, SPEED_SHARES[method] * fastest_surface(scene))
    length = scale.length * speed / scale.speed
    slip = speed
    if not scene.traction.elasticity:
        slip = min(speed, scene.once("slip_scale", lambda: slip_scale(bearing, 5.0 * scale.load)))
    roller, cage = scene.geometry.roller_radius, 0.5 * scene.bearing.pitch_diameter
    sizes = {"m": length, "m/s": speed}
    cage_speed = CAGE_SHARES[method] * speed
    sizes_of = {
        "roller": sizes | {"rad/s": slip / roller},
        "cage": {"m": length, "rad": length / cage, "m/s": cage_speed, "rad/s": cage_speed / cage},
        "inner ring": sizes,
        "outer ring": sizes,
        "contact": {"1": COEFFICIENT_SCALE},
        "clock": {"s": math.inf, "rad": math.inf},
    }
    return rtol * state.values(lambda part: sizes_of[part.body][part.unit])


def increments(scene: Scene, bearing: RollerBearing) -> Array:
    """Increment of each state component in a difference quotient (n,).

    The geometric mean of its round-off and of the scale on which laws change makes round-off and truncation alike.
    """
    layout, length = layout_of(scene), 0.5 * scene.bearing.pitch_diameter
    turning = max(abs(speed) for speed in scene.operation.speeds)
    sizes = {"m": length, "rad": 1.0, "m/s": length * turning, "rad/s": turning, "s": scene.turn_s}
    spin = max(abs(scene.geometry.motion.roller_spin), turning)
    size = layout.values(lambda part: spin if (part.body, part.unit) == ("roller", "rad/s") else sizes[part.unit])
    scale = np.minimum(absolute_tolerance(scene, bearing, 1.0, "rosenbrock"), size)
    return np.sqrt(np.finfo(float).eps * size * scale)


class LoadDistribution(NamedTuple):
    """Static loads of the rollers on the outer and the inner race [N], (positions, rollers)."""

    outer: Array
    inner: Array


def load_distribution(scene: Scene, bearing: RollerBearing, load: float, positions: int = 8) -> LoadDistribution:
    """Loads of rollers in static equilibrium of the inner ring under a ``load`` [N] along x, with clearance and centrifugal force.

    The cage stands at ``positions`` angles, which divide a pitch evenly: the mean over them is the mean over a turn.
    """
    count, speed, races = bearing.rollers, scene.geometry.motion.cage_speed, without(bearing, OFF_RACES)
    outer, inner = np.empty((positions, count)), np.empty((positions, count))
    radii = np.empty(count)
    for row in range(positions):
        angles = 2.0 * np.pi * (np.arange(count) + (row + 0.5) / positions) / count
        ring_x = static_share(races, angles, speed, load, radii)
        static_loads(races, angles, ring_x, radii, outer[row], inner[row])
    return LoadDistribution(outer, inner)


def group_of(scene: Scene, replicate: int) -> int:
    """The group of starts that a replicate belongs to: they take turns. A schedule prescribes the start of all."""
    return 0 if scene.operation.schedule is not None else replicate % GROUPS


def wall_of(scene: Scene, replicate: int) -> int:
    """Wall of the pockets that rollers of a replicate start at: 1 the front, -1 the back, in turn; 0 in the first group."""
    return (1, -1)[replicate // GROUPS % 2] if group_of(scene, replicate) else 0


def start_state(scene: Scene, bearing: RollerBearing, generator: np.random.Generator, wall: int = 0) -> Array:
    """State at time zero.

    The angle of the cage is random, and so are the offsets of rollers from the middles of their pockets, within +-20 % of the
    pocket clearance. The cage is off centre by a tenth of the guide (or pocket) clearance in a random direction. All bodies
    move as if they rolled without slip. With one cage angle, replicates would share the passage of the rollers through the
    load zone, which no mean over them removes.

    With a ``wall`` of the pockets, 1 the front and -1 the back, rollers are up to 40 % of the pocket clearance away from it,
    the cage is off centre by most of its play and circles with its own speed, and all bodies are slower by
    ``START_SLIP``.
    """
    z = bearing.rollers
    state = layout_of(scene)
    y = np.zeros(state.size)
    acting = action(bearing.drive, y)
    motion = scene.geometry.rolling(acting.inner_speed, acting.outer_speed)
    pocket, pitch_radius = scene.pocket_clearance_m, 0.5 * scene.bearing.pitch_diameter
    shares = generator.uniform(-0.2, 0.2, z)
    direction, cage_angle = generator.uniform(0.0, 2.0 * np.pi, 2)
    guide = scene.guide_play_m
    play = 0.5 * pocket if guide is None else min(0.5 * guide, 0.5 * pocket)
    offset, rolled, circling = 0.1 * play, 1.0, 0.0
    pockets = cage_angle + 2.0 * np.pi * np.arange(z) / z
    angles = pockets + shares * pocket / pitch_radius
    if wall:
        offset, rolled, circling = max(offset, min(START_PLAY * play, play - START_GAP)), 1.0 - START_SLIP, 1.0
        # Pockets move with the cage.
        angles = pockets + (offset * np.sin(direction - pockets) + wall * (0.3 + shares) * pocket) / pitch_radius
    cage_speed = rolled * motion.cage_speed
    radii = np.empty(z)
    ring_x = static_share(without(bearing, OFF_RACES), angles, cage_speed, acting.load_x, radii)
    cosine, sine = np.cos(angles), np.sin(angles)
    y[: 5 * z] = np.concatenate(
        (
            radii * cosine,
            radii * sine,
            -radii * cage_speed * sine,
            radii * cage_speed * cosine,
            np.full(z, rolled * motion.roller_spin),
        )
    )
    body = y[5 * z :]  # cage, ring and what the scene adds, which starts at rest
    body[CAGE_X], body[CAGE_Y] = offset * math.cos(direction), offset * math.sin(direction)
    body[CAGE_VX], body[CAGE_VY] = -circling * cage_speed * body[CAGE_Y], circling * cage_speed * body[CAGE_X]
    body[CAGE_ANGLE], body[CAGE_SPEED] = cage_angle, cage_speed
    body[RING_X] = ring_x
    if state.support is not None:
        # The outer ring carries all other bodies and sags under the load.
        sag = acting.load_x / bearing.outer_ring.stiffness
        y[:z] += sag
        y[state.support] = sag
        body[CAGE_X] += sag
        body[RING_X] += sag
    return y
