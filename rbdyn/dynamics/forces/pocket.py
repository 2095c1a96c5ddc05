"""Roller against its cage pocket: front and rear wall, dry or with a film, and the lips that hold the cage radially."""

import math
from typing import Any, NamedTuple

from rbdyn.compiled.kernel import kernel, law
from rbdyn.contact.cage_film import PocketFilm, wall_film
from rbdyn.contact.damping import damped_load
from rbdyn.contact.hertz_line import root_stiffness, whole_energy, whole_load
from rbdyn.contact.traction import traction


class NoPocket(NamedTuple):
    """Rollers pass through the cage."""


class Pocket(NamedTuple):
    """Plane walls, parallel to the pocket's mid-line; with a film, the clearance down to its floor.

    A roller larger than the nominal one has so much less clearance.
    """

    half_clearance: float  # (pocket width - nominal roller diameter)/2 [m]
    nominal_radius: float  # [m]
    contact: Any
    damping: Any
    friction: Any


class LubricatedPocket(NamedTuple):
    """Walls with a film that hands over to contact at its floor."""

    walls: Pocket
    film: PocketFilm
    half_clearance: float  # true one of the nominal roller [m]
    nominal_radius: float  # [m]


class LippedPocket(NamedTuple):
    """A pocket, dry or lubricated, whose lips stop the cage radially on its rollers (roller guidance)."""

    walls: Any
    orbit_radius: float  # at which roller and pocket are concentric [m]
    half_clearance: float  # radial play of the nominal roller either way [m]
    nominal_radius: float  # [m]
    contact: Any
    damping: Any
    friction: Any


class PocketWrench(NamedTuple):
    """What a pocket does to its roller: force [N]; moments on the roller and on the cage about its centre [N m].

    Then the contact load [N], the powers lost [W], and the force on the more loaded wall by contact and film together,
    negative on the rear one [N]. The force on the cage is the opposite.
    """

    x: float
    y: float
    roller_moment: float
    cage_moment: float
    load: float
    friction: float
    damping: float
    film: float
    on_wall: float


@kernel
def clearance_of(pocket, radius):
    """Half the clearance that a roller of ``radius`` has in a pocket or between lips [m]."""
    return pocket.half_clearance - (radius - pocket.nominal_radius)


@law
def pocket_gap(pocket, radius, offset, height):
    """Way that a roller has left until its pocket acts on it [m]; ``pocket_contact`` is zero where this is positive.

    ``offset, height``: centre of the roller less that of the cage, across and along the pocket's mid-line [m].
    """


@pocket_gap.body(NoPocket)
def _(pocket, radius, offset, height):
    return 1.0


@pocket_gap.body(Pocket)
def _(pocket, radius, offset, height):
    return clearance_of(pocket, radius) - abs(offset)


@pocket_gap.body(LubricatedPocket)
def _(pocket, radius, offset, height):
    return 0.0  # the film acts always


@pocket_gap.body(LippedPocket)
def _(pocket, radius, offset, height):
    walls = pocket_gap(pocket.walls, radius, offset, height)
    return min(walls, clearance_of(pocket, radius) - abs(height - pocket.orbit_radius))


@law
def pocket_contact(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    """``PocketWrench`` of a pocket on its roller: Chen et al. 2022, eq 16, for the front and the rear wall alike.

    ``ex, ey``: unit vector of the pocket's mid-line, outward; ``dx ... dvy``: centre of the roller less that of the
    cage, position [m] and velocity [m/s]; spins [rad/s].
    """


@pocket_contact.body(NoPocket)
def _(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    return PocketWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pocket_contact.body(Pocket)
def _(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    return dry_walls(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed)


@kernel
def dry_walls(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    """``pocket_contact`` of plain walls."""
    offset = dy * ex - dx * ey
    approach = abs(offset) - clearance_of(pocket, radius)
    if approach <= 0.0:
        return PocketWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    wall = math.copysign(1.0, offset)
    height = dx * ex + dy * ey
    approach_rate = wall * (dvy * ex - dvx * ey - cage_speed * height)
    elastic, stiffness = whole_load(pocket.contact, approach)
    root = root_stiffness(pocket.contact, stiffness, approach)
    load = damped_load(pocket.damping, elastic, root, approach, approach_rate)

    lever = wall * radius
    roller_surface = dvx * ex + dvy * ey - roller_spin * lever
    slip = -cage_speed * (offset + lever) - roller_surface
    friction = traction(pocket.friction, slip, load) * load
    normal = -wall * load
    return PocketWrench(
        friction * ex - normal * ey,
        friction * ey + normal * ex,
        -lever * friction,
        -height * normal + (offset + lever) * friction,
        load,
        friction * slip,
        (load - elastic) * approach_rate,
        0.0,
        wall * load,
    )


@kernel
def film_on_wall(film, wall, half_clearance, radius, offset, height, across, along, roller_spin, cage_speed):
    """``PocketWrench`` by the film of one wall (+1 front, -1 rear), x along and y across the mid-line.

    ``across, along``: velocity of the roller's centre less that of the cage, in the directions of offset and height.
    """
    closing = wall * (across - cage_speed * height)
    lever = wall * radius
    # Speeds along the wall as an observer sees them who stays with the contact: moves with the roller's centre and
    # turns with the wall.
    roller_surface = (cage_speed - roller_spin) * lever
    wall_surface = -cage_speed * offset - along
    push, tangential, shear, power = wall_film(
        film, half_clearance - wall * offset, closing, roller_surface, wall_surface
    )
    normal = -wall * push
    # The pressure on the wall stands off the contact, so that the film as a whole has no moment.
    cage_moment = -height * normal + offset * tangential + lever * shear
    return PocketWrench(tangential, normal, -lever * shear, cage_moment, 0.0, 0.0, 0.0, power, -normal)


@pocket_contact.body(LubricatedPocket)
def _(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    dry = dry_walls(pocket.walls, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed)
    offset, height = dy * ex - dx * ey, dx * ex + dy * ey
    across, along = dvy * ex - dvx * ey, dvx * ex + dvy * ey
    play = clearance_of(pocket, radius)
    front = film_on_wall(pocket.film, 1.0, play, radius, offset, height, across, along, roller_spin, cage_speed)
    rear = film_on_wall(pocket.film, -1.0, play, radius, offset, height, across, along, roller_spin, cage_speed)
    tangential, normal = front.x + rear.x, front.y + rear.y
    on_front, on_rear = max(dry.on_wall, 0.0) + front.on_wall, max(-dry.on_wall, 0.0) - rear.on_wall
    return PocketWrench(
        dry.x + (tangential * ex - normal * ey),
        dry.y + (tangential * ey + normal * ex),
        dry.roller_moment + (front.roller_moment + rear.roller_moment),
        dry.cage_moment + (front.cage_moment + rear.cage_moment),
        dry.load,
        dry.friction,
        dry.damping,
        front.film + rear.film,
        on_front if on_front >= on_rear else -on_rear,
    )


@pocket_contact.body(LippedPocket)
def _(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    walls = pocket_contact(pocket.walls, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed)
    offset, height = dy * ex - dx * ey, dx * ex + dy * ey
    approach = abs(height - pocket.orbit_radius) - clearance_of(pocket, radius)
    if approach <= 0.0:
        return walls
    lip = math.copysign(1.0, height - pocket.orbit_radius)
    approach_rate = lip * (dvx * ex + dvy * ey + cage_speed * offset)
    elastic, stiffness = whole_load(pocket.contact, approach)
    root = root_stiffness(pocket.contact, stiffness, approach)
    load = damped_load(pocket.damping, elastic, root, approach, approach_rate)
    lever = lip * radius
    roller_surface = dvy * ex - dvx * ey + roller_spin * lever
    slip = cage_speed * (height + lever) - roller_surface
    friction = traction(pocket.friction, slip, load) * load
    along, across = -lip * load, friction
    return PocketWrench(
        walls.x + along * ex - across * ey,
        walls.y + along * ey + across * ex,
        walls.roller_moment + lever * friction,
        walls.cage_moment + offset * along - (height + lever) * across,
        max(walls.load, load),
        walls.friction + friction * slip,
        walls.damping + (load - elastic) * approach_rate,
        walls.film,
        walls.on_wall if abs(walls.on_wall) >= load else math.copysign(load, offset),
    )


@law
def pocket_energy(pocket, radius, ex, ey, dx, dy):
    """Elastic energy [J] of a pocket contact, arguments as in ``pocket_contact``."""


@pocket_energy.body(NoPocket)
def _(pocket, radius, ex, ey, dx, dy):
    return 0.0


@pocket_energy.body(Pocket)
def _(pocket, radius, ex, ey, dx, dy):
    approach = abs(dy * ex - dx * ey) - clearance_of(pocket, radius)
    return whole_energy(pocket.contact, approach) if approach > 0.0 else 0.0


@pocket_energy.body(LubricatedPocket)
def _(pocket, radius, ex, ey, dx, dy):
    return pocket_energy(pocket.walls, radius, ex, ey, dx, dy)


@pocket_energy.body(LippedPocket)
def _(pocket, radius, ex, ey, dx, dy):
    approach = abs(dx * ex + dy * ey - pocket.orbit_radius) - clearance_of(pocket, radius)
    lip = whole_energy(pocket.contact, approach) if approach > 0.0 else 0.0
    return pocket_energy(pocket.walls, radius, ex, ey, dx, dy) + lip
