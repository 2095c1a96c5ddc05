"""Cage against the land of the guiding ring: a short-journal film, and dry contact below the film's floor.

Whichever part runs inside the other is the journal: the cage under outer guidance, the inner ring under inner
guidance.
"""

import math
from typing import Any, NamedTuple

from rbdyn.compiled.kernel import kernel, law
from rbdyn.contact.cage_film import ShortJournalFilm, journal_film_force
from rbdyn.contact.damping import damped_load
from rbdyn.contact.hertz_line import root_stiffness, whole_energy, whole_load
from rbdyn.contact.traction import traction


class NoFilm(NamedTuple):
    """A dry land."""


class NoContact(NamedTuple):
    """A land whose film alone holds the cage."""


class DryContact(NamedTuple):
    """Land contact once the eccentricity passes ``play`` [m]: the radial clearance less the film's floor."""

    play: float
    contact: Any
    damping: Any
    friction: Any


class NoGuide(NamedTuple):
    """No guide land: the rollers alone hold the cage."""


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


class JournalWrench(NamedTuple):
    """Force on the journal [N], moments on journal and bearing [N m], dry load [N], powers lost [W]."""

    x: float
    y: float
    journal_moment: float
    bearing_moment: float
    load: float
    film: float
    friction: float
    damping: float


class LandForces(NamedTuple):
    """Forces [N] and moments [N m] on cage, inner and outer ring, dry load [N], powers lost [W]."""

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


@law
def film_wrench(film, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    """``JournalWrench`` of the film alone.

    ``ex, ey, e``: direction and size [m] of the journal's offset; ``evx, evy``: its velocity [m/s].
    """


@film_wrench.body(NoFilm)
def _(film, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    return JournalWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@film_wrench.body(ShortJournalFilm)
def _(film, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    per_clearance = 1.0 / film.clearance
    eccentricity = min(e * per_clearance, film.largest_eccentricity)
    radial_rate = (evx * ex + evy * ey) * per_clearance
    whirl_rate = 2.0 * (evy * ex - evx * ey) * per_clearance
    wedge_rate = eccentricity * (journal_speed + bearing_speed) - whirl_rate
    radial, across = journal_film_force(film.force_scale, eccentricity, radial_rate, wedge_rate)
    shear = film.shear_scale * (journal_speed - bearing_speed) / math.sqrt(1.0 - eccentricity * eccentricity)
    fx, fy = radial * ex - across * ey, radial * ey + across * ex
    journal_moment = -shear - 0.5 * e * across
    bearing_moment = shear - 0.5 * e * across
    power = -(fx * evx + fy * evy + journal_moment * journal_speed + bearing_moment * bearing_speed)
    return JournalWrench(fx, fy, journal_moment, bearing_moment, 0.0, power, 0.0, 0.0)


@law
def dry_wrench(dry, radius, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    """``JournalWrench`` of the contact, without a film."""


@dry_wrench.body(NoContact)
def _(dry, radius, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    return JournalWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dry_wrench.body(DryContact)
def _(dry, radius, ex, ey, e, evx, evy, journal_speed, bearing_speed):
    approach = e - dry.play
    if approach <= 0.0:
        return JournalWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
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
    )


@law
def guide_forces(guide, cage, inner, outer):
    """Land forces, from the motions (``RingMotion``) of cage, inner and outer ring."""


@guide_forces.body(NoGuide)
def _(guide, cage, inner, outer):
    return LandForces(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@guide_forces.body(OuterGuide)
def _(guide, cage, inner, outer):
    dx, dy, dvx, dvy = cage.x - outer.x, cage.y - outer.y, cage.vx - outer.vx, cage.vy - outer.vy
    on = journal_wrench(guide, dx, dy, dvx, dvy, cage.speed, outer.speed)
    return LandForces(
        on.x, on.y, on.journal_moment, 0.0, 0.0, 0.0, -on.x, -on.y, on.bearing_moment,
        on.load, on.film, on.friction, on.damping,
    )  # fmt: skip


@guide_forces.body(InnerGuide)
def _(guide, cage, inner, outer):
    dx, dy, dvx, dvy = inner.x - cage.x, inner.y - cage.y, inner.vx - cage.vx, inner.vy - cage.vy
    on = journal_wrench(guide, dx, dy, dvx, dvy, inner.speed, cage.speed)
    return LandForces(
        -on.x, -on.y, on.bearing_moment, on.x, on.y, on.journal_moment, 0.0, 0.0, 0.0,
        on.load, on.film, on.friction, on.damping,
    )  # fmt: skip


@law
def dry_energy(dry, e):
    """Elastic energy [J] of the land contact at an eccentricity [m]."""


@dry_energy.body(NoContact)
def _(dry, e):
    return 0.0


@dry_energy.body(DryContact)
def _(dry, e):
    return whole_energy(dry.contact, e - dry.play) if e > dry.play else 0.0


@law
def guide_energy(guide, cage_x, cage_y, inner_x, inner_y, outer_x, outer_y):
    """Elastic energy [J] stored in the guide land, from the centres [m]."""


@guide_energy.body(NoGuide)
def _(guide, cage_x, cage_y, inner_x, inner_y, outer_x, outer_y):
    return 0.0


@guide_energy.body(OuterGuide)
def _(guide, cage_x, cage_y, inner_x, inner_y, outer_x, outer_y):
    return dry_energy(guide.dry, math.sqrt((cage_x - outer_x) ** 2 + (cage_y - outer_y) ** 2))


@guide_energy.body(InnerGuide)
def _(guide, cage_x, cage_y, inner_x, inner_y, outer_x, outer_y):
    return dry_energy(guide.dry, math.sqrt((cage_x - inner_x) ** 2 + (cage_y - inner_y) ** 2))
