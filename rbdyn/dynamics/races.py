"""Roller against raceway: normal load, traction and rolling resistance as one wrench at the contact point.

The wrench acts with opposite sign on roller and ring at the same point, so that force, moment and power balance
exactly. ``side`` is +1 for the outer race (the ring encloses the roller) and -1 for the inner race.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.damping import damped_load
from rbdyn.contact.film import rolling_force
from rbdyn.contact.hertz_line import (
    LineContact,
    LogarithmicLineContact,
    PowerLineContact,
    SlicedLineContact,
    TiltedLineContact,
    around,
    line_load,
)
from rbdyn.contact.traction import (
    BlendedFourConstantTraction,
    CoulombTraction,
    FourConstantTraction,
    MixedTraction,
    NoTraction,
    TractionSurface,
    traction,
)
from rbdyn.dynamics.race_form import RoundRace, WavyRace, form_at, sloped
from rbdyn.kernel import VECTOR, kernel, law

# Contacts are worked through in blocks of LANES, VECTOR at a time; each quantity is a row of a block. Rollers that are
# picked out bring their coordinates and, as one row more, their radii.
LANES, COORDINATES, OUTPUTS = 16, 5, 8
RADII = COORDINATES * LANES

# Below this a speed is round-off; it keeps the roots of the laws finite.
SMALLEST_SPEED = 1e-12


class Scratch(NamedTuple):
    """Work space of one thread."""

    packed: NDArray[np.float64]  # ((COORDINATES + 1) * LANES,)
    lanes: NDArray[np.float64]  # (OUTPUTS * LANES,)
    roller: NDArray[np.int64]  # (LANES,) number of each packed roller


def scratch() -> Scratch:
    """Work space for the race contacts."""
    return Scratch(np.ones((COORDINATES + 1) * LANES), np.empty(OUTPUTS * LANES), np.zeros(LANES, np.int64))


class Race(NamedTuple):
    """One raceway: its radius, the largest distance of ring and roller centres at which they may touch [m], its laws."""

    radius: float
    reach: float
    form: Any
    contact: Any
    damping: Any
    traction: Any
    rolling: Any


class EqualRollers(NamedTuple):
    """Rollers of one radius [m]."""

    radius: float


class UnequalRollers(NamedTuple):
    """Each roller with its own radius [m]; masses are those of the mean."""

    radii: NDArray[np.float64]  # padded to whole vectors


def unequal_rollers(radii: NDArray[np.float64]) -> UnequalRollers:
    """Rollers of these radii [m]."""
    return UnequalRollers(np.concatenate((radii, np.full(-len(radii) % VECTOR, radii[0]))))


@law
def roller_radius(sizes, number):
    """Radius of a roller [m]."""


@roller_radius.body(EqualRollers)
def _(sizes, number):
    return sizes.radius


@roller_radius.body(UnequalRollers)
def _(sizes, number):
    return sizes.radii[number]


@law
def radii_in_order(sizes, unused):
    """Where the radii of all rollers stand; ``unused`` where there are none to read."""


@radii_in_order.body(EqualRollers)
def _(sizes, unused):
    return unused


@radii_in_order.body(UnequalRollers)
def _(sizes, unused):
    return sizes.radii


@law
def lane_radius(sizes, radii, place):
    """Radius of the roller in a lane, from ``radii`` where rollers differ [m]."""


@lane_radius.body(EqualRollers)
def _(sizes, radii, place):
    return sizes.radius


@lane_radius.body(UnequalRollers)
def _(sizes, radii, place):
    return radii[place]


@kernel
def race_contact(race, side, radius, dx, dy, dvx, dvy, roller_spin, ring_speed, ring_cos, ring_sin):
    """Wrench of one race on one roller; zero, but for round-off, where they do not touch.

    ``dx, dy, dvx, dvy``: position [m] and velocity [m/s] of the roller's centre less those of the ring's centre;
    spins [rad/s]; ``ring_cos, ring_sin``: direction of the ring's mark. Returns (force x, force y, moment on the
    roller, moment on the ring about its centre, load, powers lost in traction, in rolling and in damping, slip) in
    N, N m, W and m/s. The force on the ring is the opposite.

    Load: Chen et al. 2022, eq 5-6; slip at the point that halves the approach: eq 7-10; rolling resistance with
    the pressure offset 2 F_R R_x/R_b: Biboulet and Houpert 2010. On a wavy race the load points along the gradient of
    the overlap: through the roller's centre, past the ring's; so it does between tilted races, whose tilt, being
    prescribed, bears the moment that this makes about the ring's centre.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / distance
    nx, ny = dx * inverse, dy * inverse
    rise, slope = form_at(race.form, nx, ny, ring_cos, ring_sin)
    # Terms that a round race lacks are subtracted: x - 0 is the one sum with zero that the compiler may drop.
    overlap = side * (distance - race.radius - rise) + radius
    tangential = dvy * nx - dvx * ny
    orbit_rate = tangential * inverse
    elastic, stiffness, approach, lean = line_load(race.contact, overlap, nx, ny)
    approach_rate = side * (dvx * nx + dvy * ny - sloped(race.form, slope, orbit_rate - ring_speed))
    approach_rate -= around(race.contact, -lean, orbit_rate)
    damped = damped_load(race.damping, elastic, stiffness, approach, approach_rate)
    load = 0.0 if elastic == 0.0 else damped

    roller_lever = side * (radius - 0.5 * approach)
    ring_lever = distance + roller_lever
    slip = ring_speed * ring_lever - tangential - roller_spin * roller_lever
    traction_force = traction(race.traction, slip, load) * load

    # Seen from the line of centres both surfaces run the same way at the entrainment speed.
    roller_surface = (roller_spin - orbit_rate) * roller_lever
    ring_surface = (ring_speed - orbit_rate) * ring_lever
    entrainment = 0.5 * (roller_surface + ring_surface)
    resistance = rolling_force(race.rolling, load, max(abs(entrainment), SMALLEST_SPEED))
    rolling = math.copysign(resistance, entrainment)
    normal = -side * load
    along = traction_force + rolling * (ring_lever + roller_lever) * inverse
    along -= sloped(race.form, slope, normal * inverse) + around(race.contact, lean, load * inverse)
    return (
        normal * nx - along * ny,
        normal * ny + along * nx,
        roller_lever * (traction_force - rolling),
        -ring_lever * (traction_force + rolling) - sloped(race.form, slope, -normal),
        load,
        traction_force * slip,
        2.0 * rolling * entrainment,
        (load - elastic) * approach_rate,
        slip,
    )


@law
def in_vectors(parameters):
    """Whether neighbouring contacts with this law share vector instructions."""


@in_vectors.body(
    LineContact,
    PowerLineContact,
    LogarithmicLineContact,
    RoundRace,
    NoTraction,
    FourConstantTraction,
    BlendedFourConstantTraction,
)
def _(parameters):
    return True


# Loops within, table look-ups and calls of the C library keep a contact to itself.
@in_vectors.body(
    SlicedLineContact, TiltedLineContact, WavyRace, CoulombTraction, TractionSurface, MixedTraction
)
def _(parameters):
    return False


@kernel
def lanes_to_fill(race, count):
    """Whole vectors, where contacts run in vectors and a scalar rest would cost as much; else just ``count``."""
    if in_vectors(race.contact) and in_vectors(race.form) and in_vectors(race.traction):
        return (count + VECTOR - 1) // VECTOR * VECTOR
    return count


@kernel
def race_block(race, side, sizes, ring, source, first, stride, radii, first_radius, lanes, count):
    """Contacts of ``count`` rollers, maybe rounded up to whole vectors, into the rows of ``lanes``.

    x, y, vx, vy and spin of roller i stand at ``source[first + i + row * stride]``, its radius at
    ``radii[first_radius + i]``.
    Straight-line code over rows at constant distances, which the compiler turns into vector instructions; the lanes
    past ``count`` hold nothing.
    """
    for i in range(lanes_to_fill(race, count)):
        j = first + i
        out = race_contact(
            race,
            side,
            lane_radius(sizes, radii, first_radius + i),
            source[j] - ring.x,
            source[j + stride] - ring.y,
            source[j + 2 * stride] - ring.vx,
            source[j + 3 * stride] - ring.vy,
            source[j + 4 * stride],
            ring.speed,
            ring.cos,
            ring.sin,
        )
        lanes[i] = out[0]
        lanes[LANES + i] = out[1]
        lanes[2 * LANES + i] = out[2]
        lanes[3 * LANES + i] = out[3]
        lanes[4 * LANES + i] = out[4]
        lanes[5 * LANES + i] = out[5]
        lanes[6 * LANES + i] = out[6]
        lanes[7 * LANES + i] = out[7]


@kernel
def gather_touching(reach, sizes, ring, rollers, start, y, packed, index):
    """Copy the state of rollers that touch the inner race, from ``start`` on, until a block is full.

    Returns how many there are and where to go on.
    """
    count = 0
    j = start
    while j < rollers and count < LANES:
        dx, dy = y[j] - ring.x, y[rollers + j] - ring.y
        if dx * dx + dy * dy < reach * reach:
            for row in range(COORDINATES):
                packed[row * LANES + count] = y[row * rollers + j]
            packed[RADII + count] = roller_radius(sizes, j)
            index[count] = j
            count += 1
        j += 1
    return count, j


@kernel
def add_block(lanes, i, j, rollers, row, dy, sums):
    """Add contact ``i`` of a block to roller ``j`` and to the sums of its race."""
    force_x, force_y = lanes[i], lanes[LANES + i]
    dy[row, 2 * rollers + j] += force_x
    dy[row, 3 * rollers + j] += force_y
    dy[row, 4 * rollers + j] += lanes[2 * LANES + i]
    return (
        sums[0] - force_x,
        sums[1] - force_y,
        sums[2] + lanes[3 * LANES + i],
        max(sums[3], lanes[4 * LANES + i]),
        sums[4] + lanes[5 * LANES + i],
        sums[5] + lanes[6 * LANES + i],
        sums[6] + lanes[7 * LANES + i],
    )


@kernel
def outer_race_forces(race, sizes, ring, rollers, y, row, dy, scratch):
    """All contacts of the outer race: adds forces and moments on the rollers to row ``row`` of ``dy``.

    Returns (force x, force y, moment on the ring, largest load, powers lost in traction, rolling and damping).
    Nearly every roller touches this race, so none is picked out.
    """
    sums = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    radii = radii_in_order(sizes, scratch.packed)
    start = 0
    while start < rollers:
        count = min(LANES, rollers - start)
        race_block(race, 1.0, sizes, ring, y, start, rollers, radii, start, scratch.lanes, count)
        for i in range(count):
            sums = add_block(scratch.lanes, i, start + i, rollers, row, dy, sums)
        start += LANES
    return sums


@kernel
def inner_race_forces(race, sizes, ring, rollers, y, row, dy, scratch):
    """All contacts of the inner race, as ``outer_race_forces``.

    Only rollers of the load zone touch this race: they are picked out first.
    """
    sums = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    start = 0
    while start < rollers:
        count, start = gather_touching(
            race.reach, sizes, ring, rollers, start, y, scratch.packed, scratch.roller
        )
        if count > 0:
            packed, lanes = scratch.packed, scratch.lanes
            race_block(race, -1.0, sizes, ring, packed, 0, LANES, packed, RADII, lanes, count)
        for i in range(count):
            sums = add_block(scratch.lanes, i, scratch.roller[i], rollers, row, dy, sums)
    return sums
