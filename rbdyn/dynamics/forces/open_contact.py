"""Oil films between the inner race and the rollers that do not touch it: they drive rollers and cage where no load does."""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import VECTOR, kernel, law
from rbdyn.contact.rolling_resistance import OpenFilm, film_forces
from rbdyn.contact.tangential_elasticity import RigidContact
from rbdyn.dynamics.forces.race_form import form_at
from rbdyn.dynamics.forces.race_lanes import LANES, add_to_ring, add_to_roller, keep_lane
from rbdyn.dynamics.forces.races import RaceWrench, roller_radius


class NoOpenFilm(NamedTuple):
    """Contacts that do not touch exchange no force."""


@kernel
def open_contact(film, race, radius, ring, dx, dy, dvx, dvy, roller_spin):
    """``RaceWrench`` of the film of one roller at the inner race, without load; its slip counts as traction.

    Arguments and signs as in ``races.race_contact``: one point of action, so that force, moment and power balance.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / distance
    nx, ny = dx * inverse, dy * inverse
    rise, _ = form_at(race.form, nx, ny, ring.cos, ring.sin)
    overlap = race.radius + rise + radius - distance
    tangential = dvy * nx - dvx * ny
    orbit_rate = tangential * inverse
    ring_lever = distance - radius
    slip = ring.speed * ring_lever - tangential + roller_spin * radius
    entrainment = 0.5 * ((ring.speed - orbit_rate) * ring_lever - (roller_spin - orbit_rate) * radius)
    rolling, shear = film_forces(film, overlap, entrainment, slip)
    along = shear + rolling * (ring_lever - radius) * inverse
    return RaceWrench(
        -along * ny,
        along * nx,
        -radius * (shear - rolling),
        -ring_lever * (shear + rolling),
        0.0,
        shear * slip,
        2.0 * rolling * entrainment,
        0.0,
        slip,
        0.0,
    )


@law
def with_open_films(film, on_ring, race, sizes, ring, rollers, y, row, dy, lanes):
    """``OnRing`` of the inner ring with the films of all rollers, whose forces and moments go to row ``row`` of ``dy``.

    ``lanes``: work space, as ``race_lanes.Scratch`` has it.
    """


@with_open_films.body(NoOpenFilm)
def _(film, on_ring, race, sizes, ring, rollers, y, row, dy, lanes):
    return on_ring


@with_open_films.body(OpenFilm)
def _(film, on_ring, race, sizes, ring, rollers, y, row, dy, lanes):
    sums = on_ring
    for start in range(0, rollers, LANES):
        count = min(LANES, rollers - start)
        # Whole vectors: behind the last roller stand other numbers of the state, and lanes past ``count`` hold nothing.
        for i in range((count + VECTOR - 1) // VECTOR * VECTOR):
            j = start + i
            dx, dy_ = y[j] - ring.x, y[rollers + j] - ring.y
            dvx, dvy = y[2 * rollers + j] - ring.vx, y[3 * rollers + j] - ring.vy
            radius, spin = roller_radius(sizes, j), y[4 * rollers + j]
            keep_lane(RigidContact(), lanes, i, open_contact(film, race, radius, ring, dx, dy_, dvx, dvy, spin))
        for i in range(count):
            add_to_roller(lanes, i, start + i, rollers, row, dy)
            sums = add_to_ring(lanes, i, sums)
    return sums
