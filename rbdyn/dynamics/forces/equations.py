"""Equations of motion: forces gathered into accelerations, the power of each loss, and the energy that balances it.

Newton for rollers, cage and rings in Cartesian coordinates, Euler for spins: Chen et al. 2022, eq 19-21 in the plane,
without their centrifugal terms because the frame does not turn. The rings turn at prescribed speeds. At rest, the load on
the inner ring decides how its rollers sit between the races and share it.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.elementary import fast_cos_sin
from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.contact.hertz_line import line_energy, line_load
from rbdyn.dynamics.forces import bodies, state
from rbdyn.dynamics.forces.cage import (
    guide_energy,
    guide_forces,
    has_stopping_film,
    pocket_contact,
    pocket_energy,
    pocket_gap,
)
from rbdyn.dynamics.forces.race_lanes import race_forces, with_open_films
from rbdyn.dynamics.forces.races import Race, form_at, roller_radius
from rbdyn.losses import (
    DRAG,
    INNER_ROLLING,
    INNER_TRACTION,
    LAND_DAMPING,
    LAND_FILM,
    LAND_FRICTION,
    LOAD,
    OUTER_TRACTION,
    POCKET_DAMPING,
    POCKET_FILM,
    POCKET_FORCE,
    POCKET_FRICTION,
    POCKET_SQUEEZE,
    RACE_DAMPING,
    ROLLING,
    SHAFT,
    SUPPORT_DAMPING,
)


class RollerBearing(NamedTuple):
    """Everything that compiled code reads, in SI. Laws are NamedTuples whose types choose the compiled bodies."""

    rollers: int
    sizes: Any
    roller_mass: float
    roller_inertia: float
    outer: Race
    inner: Race
    open_film: Any
    pocket: Any
    pocket_cos: NDArray[np.float64]
    pocket_sin: NDArray[np.float64]
    guide: Any
    drag: Any
    cage: Any
    outer_ring: Any
    inner_ring_mass: float
    drive: Any
    gravity: Any
    impacts: Any
    samples: Any


# Laws of motion alone, and what else rollers that rest between the races do not meet.
OF_MOTION = ("open_film", "drag", "impacts", "samples")
OFF_RACES = (*OF_MOTION, "pocket", "guide", "cage", "outer_ring", "drive", "gravity")


def without(bearing: RollerBearing, fields: tuple[str, ...]) -> RollerBearing:
    """The bearing with None for these fields, and for what races do to a roller that moves.

    Functions that read none of them are compiled once, whatever laws a scene has there.
    """
    left_out: dict[str, Any] = dict.fromkeys(fields)
    outer, inner = (
        race._replace(damping=None, traction=None, rolling=None, tangential=None)
        for race in (bearing.outer, bearing.inner)
    )
    return bearing._replace(outer=outer, inner=inner, **left_out)


@kernel
def roller_count(bearing):
    """Number of rollers, never negative: so the compiler reads and writes neighbours as vectors, not one by one."""
    return max(bearing.rollers, 0)


@kernel
def pocket_direction(bearing, cosine, sine, j):
    """Unit vector of the mid-line of pocket ``j``, for the cosine and sine of the cage angle."""
    ex = cosine * bearing.pocket_cos[j] - sine * bearing.pocket_sin[j]
    ey = sine * bearing.pocket_cos[j] + cosine * bearing.pocket_sin[j]
    return ex, ey


@kernel
def cage_motion(y, body):
    """Motion of the cage, whose coordinates begin at ``body``; its mark is the mid-line of the first pocket."""
    cosine, sine = fast_cos_sin(y[body + state.CAGE_ANGLE])
    return bodies.RingMotion(
        y[body + state.CAGE_X],
        y[body + state.CAGE_Y],
        y[body + state.CAGE_VX],
        y[body + state.CAGE_VY],
        y[body + state.CAGE_SPEED],
        cosine,
        sine,
    )


@kernel
def inner_motion(y, body, acting):
    """Motion of the inner ring."""
    return bodies.RingMotion(
        y[body + state.RING_X],
        y[body + state.RING_Y],
        y[body + state.RING_VX],
        y[body + state.RING_VY],
        acting.inner_speed,
        acting.inner_cos,
        acting.inner_sin,
    )


@kernel
def motions(bearing, y):
    """``Action`` on the bearing in a state, and the motions of cage, inner and outer ring."""
    body = state.ROLLER_STATES * roller_count(bearing)
    acting = bodies.action(bearing.drive, y)
    outer = bodies.outer_motion(bearing.outer_ring, y, acting.outer_speed, acting.outer_cos, acting.outer_sin)
    return acting, cage_motion(y, body), inner_motion(y, body, acting), outer


@kernel
def roller_pocket(bearing, y, cage, j):
    """``pocket_contact`` of roller ``j``."""
    z = roller_count(bearing)
    ex, ey = pocket_direction(bearing, cage.cos, cage.sin, j)
    return pocket_contact(
        bearing.pocket, roller_radius(bearing.sizes, j), ex, ey,
        y[j] - cage.x, y[z + j] - cage.y, y[2 * z + j] - cage.vx, y[3 * z + j] - cage.vy, y[4 * z + j], cage.speed,
    )  # fmt: skip


@kernel
def roller_gap(bearing, y, cage, j):
    """``pocket_gap`` of roller ``j``."""
    z = roller_count(bearing)
    ex, ey = pocket_direction(bearing, cage.cos, cage.sin, j)
    dx, dy = y[j] - cage.x, y[z + j] - cage.y
    return pocket_gap(bearing.pocket, roller_radius(bearing.sizes, j), dy * ex - dx * ey, dx * ex + dy * ey)


class OnCage(NamedTuple):
    """What the rollers do to the cage: force [N] and moment [N m]; powers lost [W]; largest loads of a wall [N].

    Then the sum of the forces on all walls [N], and the squeeze power of their films [W].
    """

    x: float
    y: float
    moment: float
    friction: float
    damping: float
    film: float
    load: float
    contact_load: float
    force: float
    squeeze: float


@kernel
def touching_rollers(bearing, cage, y, scratch):
    """Number of rollers on which their pockets act; ``scratch.touching`` lists them."""
    z = roller_count(bearing)
    for j in range(z):
        scratch.gap[j] = roller_gap(bearing, y, cage, j)
    # Counted without a branch, which the processor could not predict.
    touching = 0
    for j in range(z):
        scratch.touching[touching] = j
        touching += 0 if scratch.gap[j] > 0.0 else 1
    return touching


@kernel
def pocket_forces(bearing, cage, touching, y, row, dy, scratch):
    """Add the forces of the pocket walls to row ``row`` of ``dy``, which still holds forces and moments on the rollers.

    The contact loads of the rollers that touch take the places of their gaps, negative.
    """
    z = roller_count(bearing)
    fx = fy = moment = friction = damping = film = 0.0
    load = contact_load = force = squeeze = 0.0
    for i in range(touching):
        j = scratch.touching[i]
        wall = roller_pocket(bearing, y, cage, j)
        dy[row, 2 * z + j] += wall.x
        dy[row, 3 * z + j] += wall.y
        dy[row, 4 * z + j] += wall.roller_moment
        fx -= wall.x
        fy -= wall.y
        moment += wall.cage_moment
        load = max(load, abs(wall.on_wall))
        contact_load = max(contact_load, wall.load)
        scratch.gap[j] = -wall.load
        friction += wall.friction
        damping += wall.damping
        film += wall.film
        force += abs(wall.on_wall)
        squeeze += wall.squeeze
    return OnCage(fx, fy, moment, friction, damping, film, load, contact_load, force, squeeze)


@kernel
def accelerate_rollers(bearing, row, dy):
    """Turn forces and moments on the rollers in row ``row`` of ``dy`` into accelerations."""
    z = roller_count(bearing)
    per_mass, per_inertia = 1.0 / bearing.roller_mass, 1.0 / bearing.roller_inertia
    for j in range(z):
        dy[row, 2 * z + j] *= per_mass
        dy[row, 3 * z + j] *= per_mass
        dy[row, 4 * z + j] *= per_inertia
    bodies.add_weight(bearing.gravity, 2 * z, z, row, dy)


@kernel
def accelerate_cage(bearing, cage, pockets, land, row, dy):
    """Rates of the cage's coordinates into row ``row`` of ``dy``."""
    body = state.ROLLER_STATES * roller_count(bearing)
    fx, fy, moment = pockets.x + land.cage_x, pockets.y + land.cage_y, pockets.moment + land.cage_moment
    ax, ay, spin_up = bodies.cage_acceleration(bearing.cage, fx, fy, moment, cage.cos, cage.sin, cage.speed)
    dy[row, body + state.CAGE_X] = cage.vx
    dy[row, body + state.CAGE_Y] = cage.vy
    dy[row, body + state.CAGE_ANGLE] = cage.speed
    dy[row, body + state.CAGE_VX] = ax
    dy[row, body + state.CAGE_VY] = ay
    dy[row, body + state.CAGE_SPEED] = spin_up
    bodies.add_weight(bearing.gravity, body + state.CAGE_VX, 1, row, dy)


@kernel
def accelerate_inner_ring(bearing, inner, fx, fy, row, dy):
    """Rates of the inner ring's coordinates under a force [N] into row ``row`` of ``dy``."""
    body = state.ROLLER_STATES * roller_count(bearing)
    dy[row, body + state.RING_X] = inner.vx
    dy[row, body + state.RING_Y] = inner.vy
    dy[row, body + state.RING_VX] = fx / bearing.inner_ring_mass
    dy[row, body + state.RING_VY] = fy / bearing.inner_ring_mass
    bodies.add_weight(bearing.gravity, body + state.RING_VX, 1, row, dy)


@kernel
def derivative(bearing, y, row, dy, power, loads, scratch):
    """Fill row ``row`` of ``dy``, of the powers [W] and of the largest loads [N], for the state ``y``."""
    z = roller_count(bearing)
    acting, cage, inner, outer = motions(bearing, y)
    bodies.tick(bearing.drive, acting, row, dy)
    drag_loss = bodies.drag_forces(bearing.drag, z, y, row, dy)
    for j in range(z):
        dy[row, j], dy[row, z + j], dy[row, 4 * z + j] = y[2 * z + j], y[3 * z + j], 0.0
    touching = touching_rollers(bearing, cage, y, scratch)
    # Two long chains of roots and quotients, which take little more time together than one.
    land = guide_forces(bearing.guide, cage, inner, outer)
    if has_stopping_film(bearing.guide):
        for i in range(3):
            scratch.resistance[0, i] = land.resistance[i]
    pockets = pocket_forces(bearing, cage, touching, y, row, dy, scratch)
    on_outer, on_inner = race_forces(bearing.outer, bearing.inner, bearing.sizes, outer, inner, z, y, row, dy, scratch)
    on_inner = with_open_films(bearing.open_film, on_inner, bearing.inner, bearing.sizes, inner, z, y, row, dy, scratch)
    accelerate_rollers(bearing, row, dy)
    accelerate_cage(bearing, cage, pockets, land, row, dy)
    ring_fx, ring_fy = on_inner.x + land.inner_x + acting.load_x, on_inner.y + land.inner_y + acting.load_y
    accelerate_inner_ring(bearing, inner, ring_fx, ring_fy, row, dy)
    support_fx, support_fy = on_outer.x + land.outer_x, on_outer.y + land.outer_y
    support_loss = bodies.support_motion(bearing.outer_ring, bearing.gravity, support_fx, support_fy, y, row, dy)
    power[row, OUTER_TRACTION] = on_outer.traction
    power[row, INNER_TRACTION] = on_inner.traction
    power[row, ROLLING] = on_outer.rolling + on_inner.rolling
    power[row, RACE_DAMPING] = on_outer.damping + on_inner.damping
    power[row, POCKET_FRICTION] = pockets.friction
    power[row, POCKET_DAMPING] = pockets.damping
    power[row, POCKET_FILM] = pockets.film
    power[row, LAND_FILM] = land.film
    power[row, LAND_FRICTION] = land.friction
    power[row, LAND_DAMPING] = land.damping
    power[row, DRAG] = drag_loss
    power[row, SUPPORT_DAMPING] = support_loss
    inner_moment, outer_moment = on_inner.moment + land.inner_moment, on_outer.moment + land.outer_moment
    power[row, SHAFT] = -inner_moment * inner.speed - outer_moment * outer.speed
    power[row, LOAD] = bodies.load_power(bearing.drive, acting, inner.vx, inner.vy)
    power[row, INNER_ROLLING] = on_inner.rolling
    power[row, POCKET_FORCE] = pockets.force
    power[row, POCKET_SQUEEZE] = pockets.squeeze
    loads[row, state.POCKET_LOAD] = pockets.load
    loads[row, state.OUTER_LOAD] = on_outer.load
    loads[row, state.INNER_LOAD] = on_inner.load
    loads[row, state.LAND_LOAD] = land.load
    loads[row, state.POCKET_CONTACT_LOAD] = pockets.contact_load


@routine
def pocket_loads(bearing, y, row, loads, scratch):
    """Fill row ``row`` of ``loads`` with those of the pocket walls [N] alone, for the state ``y``."""
    cage = cage_motion(y, state.ROLLER_STATES * roller_count(bearing))
    load = contact_load = 0.0
    for i in range(touching_rollers(bearing, cage, y, scratch)):
        wall = roller_pocket(bearing, y, cage, scratch.touching[i])
        load = max(load, abs(wall.on_wall))
        contact_load = max(contact_load, wall.load)
    loads[row, state.POCKET_LOAD] = load
    loads[row, state.POCKET_CONTACT_LOAD] = contact_load


@routine
def derivative_once(bearing, y, row, dy, power, loads, scratch):
    """``derivative`` for calls outside the innermost loop, each of which would otherwise compile a copy of it.

    More than a hundred numbers are passed one by one, which costs a quarter of the evaluation.
    """
    derivative(bearing, y, row, dy, power, loads, scratch)


@kernel
def race_energy(race, side, radius, dx, dy, ring):
    """Elastic energy [J] of one race contact; ``dx, dy``: roller's centre less the ring's [m]."""
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    rise, _ = form_at(race.form, nx, ny, ring.cos, ring.sin)
    return line_energy(race.contact, side * (distance - race.radius - rise) + radius, nx, ny)


@entry
def mechanical_energy(bearing, y):
    """(kinetic, elastic, potential) energy [J] of a state, without the prescribed rotation of the rings."""
    z = bearing.rollers
    _, cage, inner, outer = motions(bearing, y)
    kinetic, elastic, potential = bodies.support_energy(bearing.outer_ring, bearing.gravity, y)
    kinetic += bodies.cage_kinetic_energy(bearing.cage, cage.vx, cage.vy, cage.cos, cage.sin, cage.speed)
    kinetic += 0.5 * bearing.inner_ring_mass * (inner.vx**2 + inner.vy**2)
    elastic += guide_energy(bearing.guide, cage.x, cage.y, inner.x, inner.y, outer.x, outer.y)
    centre_x, centre_y = bodies.mass_centre(bearing.cage, cage.x, cage.y, cage.cos, cage.sin)
    potential += bodies.load_potential(bearing.drive, inner.x)
    potential += bodies.height_energy(bearing.gravity, bearing.cage.mass, centre_x, centre_y)
    potential += bodies.height_energy(bearing.gravity, bearing.inner_ring_mass, inner.x, inner.y)
    for j in range(z):
        x, y_ = y[j], y[z + j]
        radius = roller_radius(bearing.sizes, j)
        kinetic += 0.5 * bearing.roller_mass * (y[2 * z + j] ** 2 + y[3 * z + j] ** 2)
        kinetic += 0.5 * bearing.roller_inertia * y[4 * z + j] ** 2
        potential += bodies.height_energy(bearing.gravity, bearing.roller_mass, x, y_)
        elastic += race_energy(bearing.outer, 1.0, radius, x - outer.x, y_ - outer.y, outer)
        elastic += race_energy(bearing.inner, -1.0, radius, x - inner.x, y_ - inner.y, inner)
        ex, ey = pocket_direction(bearing, cage.cos, cage.sin, j)
        elastic += pocket_energy(bearing.pocket, radius, ex, ey, x - cage.x, y_ - cage.y)
    return kinetic, elastic, potential


TRIES = 60
BALANCED = 1e-11  # of the forces at the ends of the bracket
ROUND_OFF = 1e-15  # of a radius
FIRST_APPROACH = 1e-6  # [m], from which a bracket of approaches is widened


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


@kernel
def narrowed(low, below, high, above, moved, middle, force):
    """Bracket with the forces at its ends after a try, and the end that moved: +1 the high one, -1 the low one, 0 none yet.

    False position: the force at an end that stays twice counts half (Illinois), so that both ends close in.
    """
    if force > 0.0:
        return low, 0.5 * below if moved > 0 else below, middle, force, 1
    return middle, force, high, 0.5 * above if moved < 0 else above, -1


@kernel
def seat_force(bearing, j, radius, angle, ring_x, orbit_speed):
    """Outer load less inner load and centrifugal force [N]."""
    outer, inner = race_loads(bearing, j, radius, angle, ring_x)
    return outer - inner - bearing.roller_mass * radius * orbit_speed**2


@routine
def seated_radius(bearing, j, angle, ring_x, orbit_speed):
    """Orbit radius [m] at which outer load balances inner load and centrifugal force."""
    low = bearing.outer.radius - roller_radius(bearing.sizes, j)
    width, below = FIRST_APPROACH, seat_force(bearing, j, low, angle, ring_x, orbit_speed)
    high, above = low, below
    while above <= 0.0 and high < 2.0 * bearing.outer.radius:
        low, below, high, width = high, above, high + width, 2.0 * width
        above = seat_force(bearing, j, high, angle, ring_x, orbit_speed)
    while below > 0.0 and low > bearing.inner.radius:
        low, high, above, width = low - width, low, below, 2.0 * width
        below = seat_force(bearing, j, low, angle, ring_x, orbit_speed)
    # The bits of its radius limit how well a light roller is balanced.
    enough = BALANCED * max(abs(below), abs(above)) + ROUND_OFF * high * (above - below) / (high - low)
    moved = 0
    for _ in range(TRIES):
        middle = (low * above - high * below) / (above - below)
        force = seat_force(bearing, j, middle, angle, ring_x, orbit_speed)
        if abs(force) <= enough:
            return middle
        low, below, high, above, moved = narrowed(low, below, high, above, moved, middle, force)
    return high


@routine
def static_force(bearing, angles, orbit_speed, ring_x, radii):
    """Force along x [N] of the rollers at ``angles`` on a ring at (ring_x, 0); fills their orbit radii."""
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
    enough = BALANCED * max(abs(below), abs(above))
    if below >= 0.0 or above <= 0.0:
        # No load within the play, or more than the bracket holds.
        return 0.5 * (low + high) if below == above else low if below >= 0.0 else high
    middle = high
    moved = 0
    for _ in range(TRIES):
        middle = (low * above - high * below) / (above - below)
        force = static_force(bearing, angles, orbit_speed, middle, radii) - load
        if abs(force) <= enough:
            break
        low, below, high, above, moved = narrowed(low, below, high, above, moved, middle, force)
    return middle


@entry
def static_loads(bearing, angles, ring_x, radii, outer, inner):
    """Fill the loads [N] of rollers at ``angles`` and ``radii`` on the outer and the inner race, as of ``static_share``."""
    for j in range(angles.size):
        outer[j], inner[j] = race_loads(bearing, j, radii[j], angles[j], ring_x)
