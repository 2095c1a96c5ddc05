"""Contacts of the cage: pockets on their rollers, and the land of the ring that guides it.

A pocket has a front and a rear wall, dry or with a film, and may have lips that hold the cage radially. A land has a
short-journal film, and dry contact below the film's floor. The part that runs inside the other is the journal: the cage
under outer guidance, the inner ring under inner guidance.
"""

import math
from typing import Any, NamedTuple

from rbdyn.compiled.kernel import kernel, law_of
from rbdyn.contact.cage_film import PocketFilm, ShortJournalFilm, StoppingFilm, journal_film_force, wall_film
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


class NoImpacts(NamedTuple):
    """Impacts in the pockets are not followed."""


class Impacts(NamedTuple):
    """Which contacts in the pockets are impacts, and how their peak forces are summed."""

    speed: float  # of the first approach, above which a contact is an impact [m/s]
    exponent: float  # of the sum of peak forces


class PocketWrench(NamedTuple):
    """What a pocket does to its roller: force [N]; moments on the roller and on the cage about its centre [N m].

    Then the contact load [N], the powers lost [W], and ``on_wall``: force of contact and film on the more loaded wall [N],
    negative on the rear one. ``squeeze``: power of the films' push by closing [W], part of ``film``. The force on the cage is the
    opposite.
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
    squeeze: float


@kernel
def clearance_of(pocket, radius):
    """Half the clearance that a roller of ``radius`` has in a pocket or between lips [m]."""
    return pocket.half_clearance - (radius - pocket.nominal_radius)


@law_of(NoPocket)
def pocket_gap(pocket, radius, offset, height):
    """Gap between a roller and where its pocket begins to act on it [m]; ``pocket_contact`` is zero where it is positive.

    ``offset, height``: centre of the roller less that of the cage, across and along the pocket's mid-line [m].
    """
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


@law_of(Pocket, LubricatedPocket)
def pocket_approach(pocket, radius, offset, height, across, along):
    """Speed at which a roller nears the wall or lip that it is nearest to [m/s].

    ``across, along``: rates of ``offset`` and ``height``, which are as in ``pocket_gap``.
    """
    return across if offset > 0.0 else -across


@pocket_approach.body(LippedPocket)
def _(pocket, radius, offset, height, across, along):
    to_wall = clearance_of(pocket.walls, radius) - abs(offset)
    to_lip = clearance_of(pocket, radius) - abs(height - pocket.orbit_radius)
    if to_wall <= to_lip:
        return pocket_approach(pocket.walls, radius, offset, height, across, along)
    return along if height > pocket.orbit_radius else -along


@law_of(NoPocket)
def pocket_contact(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    """``PocketWrench`` of a pocket on its roller: Chen et al. 2022, eq 16, for the front and the rear wall alike.

    ``ex, ey``: unit vector of the pocket's mid-line, outward; ``dx ... dvy``: centre of the roller less that of the
    cage, position [m] and velocity [m/s]; spins [rad/s].
    """
    return PocketWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pocket_contact.body(Pocket)
def _(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    return dry_walls(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed)


@kernel
def dry_walls(pocket, radius, ex, ey, dx, dy, dvx, dvy, roller_spin, cage_speed):
    """``pocket_contact`` of plain walls."""
    offset = dy * ex - dx * ey
    approach = abs(offset) - clearance_of(pocket, radius)
    if approach <= 0.0:
        return PocketWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
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
        0.0,
    )


@kernel
def film_on_wall(film, wall, half_clearance, radius, offset, height, across, along, roller_spin, cage_speed):
    """``PocketWrench`` by the film of one wall (+1 front, -1 rear), x along and y across the mid-line.

    ``across, along``: velocity of the roller's centre less that of the cage, in the directions of offset and height.
    """
    closing = wall * (across - cage_speed * height)
    lever = wall * radius
    # Speeds along the wall, seen from a frame that moves with the roller's centre and turns with the wall.
    roller_surface = (cage_speed - roller_spin) * lever
    wall_surface = -cage_speed * offset - along
    push, tangential, shear, power = wall_film(
        film, half_clearance - wall * offset, closing, roller_surface, wall_surface
    )
    normal = -wall * push
    # The pressure on the wall acts off the contact point, so that the film as a whole has no moment.
    cage_moment = -height * normal + offset * tangential + lever * shear
    return PocketWrench(tangential, normal, -lever * shear, cage_moment, 0.0, 0.0, 0.0, power, -normal, push * closing)


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
        front.squeeze + rear.squeeze,
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
        walls.squeeze,
    )


@law_of(NoPocket)
def pocket_energy(pocket, radius, ex, ey, dx, dy):
    """Elastic energy [J] of a pocket contact, arguments as in ``pocket_contact``."""
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


class NoFilm(NamedTuple):
    """A dry land."""


class NoContact(NamedTuple):
    """A land where the film alone supports the cage."""


class DryContact(NamedTuple):
    """Land contact once the eccentricity passes ``play`` [m]: the radial clearance less the film's floor."""

    play: float
    contact: Any
    damping: Any
    friction: Any


class NoGuide(NamedTuple):
    """No guide land: the rollers alone guide the cage."""


class OuterGuide(NamedTuple):
    """Cage inside the outer ring."""

    radius: float
    film: Any
    dry: Any


class InnerGuide(NamedTuple):
    """Cage around the inner ring."""

    radius: float
    film: Any
    dry: Any


class Resistance(NamedTuple):
    """By how much the force of a film falls per speed [N s/m]; by ``xy`` that along x per speed along y, and that along y per speed along x."""

    xx: float
    xy: float
    yy: float


NO_RESISTANCE = Resistance(0.0, 0.0, 0.0)


class JournalWrench(NamedTuple):
    """Force on the journal [N], moments on journal and bearing [N m], dry load [N], powers lost [W], resistance of the film."""

    x: float
    y: float
    journal_moment: float
    bearing_moment: float
    load: float
    film: float
    friction: float
    damping: float
    resistance: Resistance


class LandForces(NamedTuple):
    """Forces [N] and moments [N m] on cage, inner and outer ring, dry load [N], powers lost [W], resistance of the film."""

    cage_x: float
    cage_y: float
    cage_moment: float
    inner_x: float
    inner_y: float
    inner_moment: float
    outer_x: float
    outer_y: float
    outer_moment: float
    load: float
    film: float
    friction: float
    damping: float
    resistance: Resistance


@law_of(NoFilm)
def film_wrench(film, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    """``JournalWrench`` of the film alone.

    ``ex, ey, e``: direction and size [m] of the journal's offset; ``evx, evy``: its velocity [m/s].
    """
    return JournalWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_RESISTANCE)


@film_wrench.body(ShortJournalFilm, StoppingFilm)
def _(film, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    per_clearance = 1.0 / film.clearance
    eccentricity = min(e * per_clearance, film.largest_eccentricity)
    radial_rate = (evx * ex + evy * ey) * per_clearance
    whirl_rate = 2.0 * (evy * ex - evx * ey) * per_clearance
    wedge_rate = eccentricity * (journal_speed + bearing_speed) - whirl_rate
    pushed = journal_film_force(film.force_scale, eccentricity, radial_rate, wedge_rate)
    radial, across = pushed.radial, pushed.across
    shear = film.shear_scale * (journal_speed - bearing_speed) / math.sqrt(1.0 - eccentricity * eccentricity)
    fx, fy = radial * ex - across * ey, radial * ey + across * ex
    journal_moment = -shear - 0.5 * e * across
    bearing_moment = shear - 0.5 * e * across
    power = -(fx * evx + fy * evy + journal_moment * journal_speed + bearing_moment * bearing_speed)
    resist_rr, resist_tt = pushed.resist_rr * per_clearance, pushed.resist_tt * per_clearance
    resist_rt = pushed.resist_rt * per_clearance
    both = 2.0 * ex * ey * resist_rt
    return JournalWrench(
        fx,
        fy,
        journal_moment,
        bearing_moment,
        0.0,
        power,
        0.0,
        0.0,
        Resistance(
            ex * ex * resist_rr - both + ey * ey * resist_tt,
            ex * ey * (resist_rr - resist_tt) + (ex * ex - ey * ey) * resist_rt,
            ey * ey * resist_rr + both + ex * ex * resist_tt,
        ),
    )


@law_of(NoFilm, ShortJournalFilm)
def stops_cage(film):
    """Whether a film stops the cage so fast that its resistance is needed."""
    return False


@stops_cage.body(StoppingFilm)
def _(film):
    return True


@law_of(NoContact)
def dry_wrench(dry, radius, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    """``JournalWrench`` of the contact, without a film."""
    return JournalWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_RESISTANCE)


@dry_wrench.body(DryContact)
def _(dry, radius, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    approach = e - dry.play
    if approach <= 0.0:
        return JournalWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_RESISTANCE)
    approach_rate = evx * ex + evy * ey
    elastic, stiffness = whole_load(dry.contact, approach)
    root = root_stiffness(dry.contact, stiffness, approach)
    load = damped_load(dry.damping, elastic, root, approach, approach_rate)
    slip = bearing_speed * (e + radius) - journal_speed * radius - (evy * ex - evx * ey)
    friction = traction(dry.friction, slip, load) * load
    return JournalWrench(
        -load * ex - friction * ey,
        -load * ey + friction * ex,
        radius * friction,
        -(radius + e) * friction,
        load,
        0.0,
        friction * slip,
        (load - elastic) * approach_rate,
        NO_RESISTANCE,
    )


@kernel
def journal_wrench(guide, dx, dy, dvx, dvy, journal_speed, bearing_speed):
    """``JournalWrench`` of film and dry contact together."""
    e = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / e if e > 0.0 else 0.0
    ex, ey = (dx * inverse, dy * inverse) if e > 0.0 else (1.0, 0.0)
    film = film_wrench(guide.film, ex, ey, e, dvx, dvy, journal_speed, bearing_speed)
    dry = dry_wrench(guide.dry, guide.radius, ex, ey, e, dvx, dvy, journal_speed, bearing_speed)
    return JournalWrench(
        film.x + dry.x,
        film.y + dry.y,
        film.journal_moment + dry.journal_moment,
        film.bearing_moment + dry.bearing_moment,
        dry.load,
        film.film,
        dry.friction,
        dry.damping,
        film.resistance,
    )


@law_of(NoGuide)
def guide_forces(guide, cage, inner, outer):
    """Land forces, from the motions (``RingMotion``) of cage, inner and outer ring."""
    return LandForces(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_RESISTANCE)


@guide_forces.body(OuterGuide)
def _(guide, cage, inner, outer):
    dx, dy, dvx, dvy = cage.x - outer.x, cage.y - outer.y, cage.vx - outer.vx, cage.vy - outer.vy
    on = journal_wrench(guide, dx, dy, dvx, dvy, cage.speed, outer.speed)
    return LandForces(
        on.x, on.y, on.journal_moment, 0.0, 0.0, 0.0, -on.x, -on.y, on.bearing_moment,
        on.load, on.film, on.friction, on.damping, on.resistance,
    )  # fmt: skip


@guide_forces.body(InnerGuide)
def _(guide, cage, inner, outer):
    dx, dy, dvx, dvy = inner.x - cage.x, inner.y - cage.y, inner.vx - cage.vx, inner.vy - cage.vy
    on = journal_wrench(guide, dx, dy, dvx, dvy, inner.speed, cage.speed)
    return LandForces(
        -on.x, -on.y, on.bearing_moment, on.x, on.y, on.journal_moment, 0.0, 0.0, 0.0,
        on.load, on.film, on.friction, on.damping, on.resistance,
    )  # fmt: skip


@law_of(NoGuide)
def has_stopping_film(guide):
    """Whether the film of the guide ``stops_cage``."""
    return False


@has_stopping_film.body(OuterGuide, InnerGuide)
def _(guide):
    return stops_cage(guide.film)


@law_of(NoContact)
def dry_energy(dry, e):
    """Elastic energy [J] of the land contact at an eccentricity [m]."""
    return 0.0


@dry_energy.body(DryContact)
def _(dry, e):
    return whole_energy(dry.contact, e - dry.play) if e > dry.play else 0.0


@law_of(NoGuide)
def guide_energy(guide, cage_x, cage_y, inner_x, inner_y, outer_x, outer_y):
    """Elastic energy [J] stored in the guide land, from the centres [m]."""
    return 0.0


@guide_energy.body(OuterGuide)
def _(guide, cage_x, cage_y, inner_x, inner_y, outer_x, outer_y):
    return dry_energy(guide.dry, math.sqrt((cage_x - outer_x) ** 2 + (cage_y - outer_y) ** 2))


@guide_energy.body(InnerGuide)
def _(guide, cage_x, cage_y, inner_x, inner_y, outer_x, outer_y):
    return dry_energy(guide.dry, math.sqrt((cage_x - inner_x) ** 2 + (cage_y - inner_y) ** 2))
