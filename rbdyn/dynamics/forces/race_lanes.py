"""Race contacts side by side: blocks of contacts in straight-line code, which the compiler turns into vector code.

Whole vectors of rollers meet the outer race straight from the state. The remaining ones, and the rollers that touch the
inner race, are packed; where both races follow the same laws they share vectors. A block takes three loops: how rollers and
race meet, look-ups in tables one by one, which are no vector code, and the forces. So the roots and quotients of several
vectors overlap. Waves of a raceway and slices of the rollers are summed ahead of them.

Where a scene asks for them, oil films drive the rollers that do not touch the inner race.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import VECTOR, alike, either, kernel, law_of
from rbdyn.contact import hertz_line
from rbdyn.contact.rolling_resistance import LayerFilm, OpenFilm, film_forces, film_reach
from rbdyn.contact.tangential import (
    RigidContact,
    add_coefficient_rate,
    coefficient_of,
    keep_coefficient_rate,
    relax_coefficients,
    steady_by_table,
)
from rbdyn.contact.traction import (
    TABLELESS,
    MixedTraction,
    SurfaceAxes,
    TractionSurface,
    cubic,
    table_cubic,
    table_place,
    without_table,
)
from rbdyn.dynamics.forces import races
from rbdyn.dynamics.forces.state import ROLLER_STATES

# Blocks hold LANES contacts, VECTOR of them at a time; each quantity is a row of a block. Packed rollers bring their
# coordinates, their radii, the side of the race (+1 outer, -1 inner) and their traction coefficients.
LANES, OUTPUTS = 32, 9
RADII = ROLLER_STATES * LANES
SIDES = RADII + LANES
COEFFICIENTS = SIDES + LANES
# Where the rows of the results of a contact begin: the fields of ``RaceWrench`` but for the slip.
FORCE_X, FORCE_Y, ROLLER_MOMENT, RING_MOMENT, LOAD, TRACTION, ROLLING, DAMPING, COEFFICIENT_RATE = range(
    0, OUTPUTS * LANES, LANES
)
# Where the rows between the loops begin: the fields of ``RaceApproach``, side and traction coefficient, the place in the
# table, four for wavy raceways and sliced rollers, and four coefficients for each lane in turn.
INPUTS = 20
(
    NX, NY, INVERSE, SLOPE, LEAN, MET_LOAD, STIFFNESS, MET_DAMPING, ROLLER_LEVER, RING_LEVER, SLIP, ENTRAINMENT,
    SIDE, COEFFICIENT, ALONG, ACROSS, RADIUS, RISE, OVERLAP, APPROACH,
) = range(0, INPUTS * LANES, LANES)  # fmt: skip
CUBIC = INPUTS * LANES
ROUND_OFF = 1e-9  # of a distance


class OnRing(NamedTuple):
    """What the rollers do to a ring: force [N] and moment [N m]; largest load [N]; powers lost [W]."""

    x: float
    y: float
    moment: float
    load: float
    traction: float
    rolling: float
    damping: float


class Scratch(NamedTuple):
    """Work space of one thread."""

    packed: NDArray[np.float64]  # ((ROLLER_STATES + 3) * LANES,)
    lanes: NDArray[np.float64]  # (OUTPUTS * LANES,)
    met: NDArray[np.float64]  # ((INPUTS + 4) * LANES,)
    roller: NDArray[np.int64]  # (LANES,) number of each packed roller
    gap: NDArray[np.float64]  # (rollers,) gap of each in its pocket [m], or less its contact load there [N]
    touching: NDArray[np.int64]  # (rollers,) numbers of those that touch theirs
    # (2, 3) of a ``StoppingFilm``: ``Resistance`` [N s/m], latest and at the start of a step
    resistance: NDArray[np.float64]


def scratch(rollers: int) -> Scratch:
    """Work space for the contacts of so many rollers."""
    return Scratch(
        np.ones((ROLLER_STATES + 3) * LANES),
        np.empty(OUTPUTS * LANES),
        np.ones((INPUTS + 4) * LANES),
        np.zeros(LANES, np.int64),
        np.empty(rollers),
        np.zeros(rollers, np.int64),
        np.zeros((2, 3)),
    )


@law_of(races.EqualRollers)
def lane_radius(sizes, packed, lane):
    """Radius of the roller in a lane of ``packed`` [m]."""
    return sizes.radius


@lane_radius.body(races.UnequalRollers)
def _(sizes, packed, lane):
    return packed[RADII + lane]


@law_of(hertz_line.LineContact, hertz_line.PowerLineContact, hertz_line.LogarithmicLineContact, races.RoundRace)
def has_loops(parameters):
    """Whether a contact loops over waves of the raceway or slices of the roller, ahead of the vectors."""
    return False


@has_loops.body(hertz_line.SlicedLineContact, hertz_line.TiltedLineContact, races.WavyRace)
def _(parameters):
    return True


@kernel
def lane_race(race):
    """A race as lanes read it, numbers alone: references to arrays would be counted in every lane."""
    shaped = races.with_shape(race, races.without_waves(race.form), hertz_line.without_slices(race.contact))
    return races.with_laws(shaped, without_table(race.traction), race.tangential)


@kernel
def share_vectors(outer, inner):
    """Whether one vector may hold contacts of both races."""
    return not (has_loops(inner.contact) or has_loops(inner.form)) and alike(lane_race(outer), lane_race(inner))


@kernel
def whole_vectors(count):
    """``count`` rounded up to whole vectors: a scalar rest would cost as much as one more."""
    return (count + VECTOR - 1) // VECTOR * VECTOR


@kernel
def keep_lane(tangential, lanes, i, wrench):
    """Write a ``RaceWrench`` to lane ``i``."""
    lanes[FORCE_X + i] = wrench.x
    lanes[FORCE_Y + i] = wrench.y
    lanes[ROLLER_MOMENT + i] = wrench.roller_moment
    lanes[RING_MOMENT + i] = wrench.ring_moment
    lanes[LOAD + i] = wrench.load
    lanes[TRACTION + i] = wrench.traction
    lanes[ROLLING + i] = wrench.rolling
    lanes[DAMPING + i] = wrench.damping
    keep_coefficient_rate(tangential, wrench.coefficient_rate, lanes, COEFFICIENT_RATE + i)


@kernel
def approach_in_lane(race, side, radius, ring, source, j, stride):
    """``race_approach`` of the roller whose x, y, vx, vy and spin stand at ``source[j + row * stride]``."""
    return races.race_approach(
        race,
        side,
        radius,
        source[j] - ring.x,
        source[j + stride] - ring.y,
        source[j + 2 * stride] - ring.vx,
        source[j + 3 * stride] - ring.vy,
        source[j + 4 * stride],
        ring.speed,
        ring.cos,
        ring.sin,
    )


@kernel
def keep_approach(race, side, radius, ring, source, j, stride, coefficient, met, i):
    """Write the ``RaceApproach`` of ``approach_in_lane`` to lane ``i``, with side, traction coefficient and place in the table."""
    approach = approach_in_lane(race, side, radius, ring, source, j, stride)
    met[NX + i] = approach.nx
    met[NY + i] = approach.ny
    met[INVERSE + i] = approach.inverse
    met[SLOPE + i] = approach.slope
    met[LEAN + i] = approach.lean
    met[MET_LOAD + i] = approach.load
    met[STIFFNESS + i] = approach.stiffness
    met[MET_DAMPING + i] = approach.damping
    met[ROLLER_LEVER + i] = approach.roller_lever
    met[RING_LEVER + i] = approach.ring_lever
    met[SLIP + i] = approach.slip
    met[ENTRAINMENT + i] = approach.entrainment
    met[SIDE + i] = side
    met[COEFFICIENT + i] = coefficient
    keep_place(race.traction, approach.slip, approach.load, met, i)


@kernel
def keep_centres(race, radius, dx, dy, met, i):
    """Write where the roller of lane ``i`` is: direction from the ring, distance less the radius of the raceway, own radius."""
    distance = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / distance
    met[NX + i], met[NY + i] = dx * inverse, dy * inverse
    met[OVERLAP + i], met[RADIUS + i] = distance - race.radius, radius


@law_of(races.RoundRace)
def keep_forms(form, ring, met, count):
    """Write rise and slope of a wavy raceway at the first ``count`` lanes."""


@keep_forms.body(races.WavyRace)
def _(form, ring, met, count):
    for i in range(count):
        met[RISE + i], met[SLOPE + i] = races.form_at(form, met[NX + i], met[NY + i], ring.cos, ring.sin)


@law_of(races.RoundRace)
def form_in_lane(form, met, i):
    """The form of a raceway as lane ``i`` meets it."""
    return form


@form_in_lane.body(races.FormInLane)
def _(form, met, i):
    return races.FormInLane(met[RISE + i], met[SLOPE + i])


@law_of(hertz_line.LineContact, hertz_line.PowerLineContact, hertz_line.LogarithmicLineContact)
def keep_slices(contact, form, side, met, count):
    """Write the loads of sliced rollers in the first ``count`` lanes.

    Lanes add their slices side by side, in the order of ``line_load``.
    """


@keep_slices.body(hertz_line.SlicedLineContact, hertz_line.TiltedLineContact)
def _(contact, form, side, met, count):
    laminae, filled = 0, whole_vectors(count)
    for i in range(filled):
        rise, _ = races.form_at(form_in_lane(form, met, i), met[NX + i], met[NY + i], 1.0, 0.0)
        met[OVERLAP + i] = side * (met[OVERLAP + i] - rise) + met[RADIUS + i]
        met[MET_LOAD + i] = met[STIFFNESS + i] = met[APPROACH + i] = met[LEAN + i] = 0.0
    for i in range(count):
        laminae = max(laminae, hertz_line.loaded_slices(contact, met[OVERLAP + i]))
    # Two at a time, which come in whole vectors: a sum is read and written half as often.
    for k in range(0, laminae, 2):
        lamina, next_lamina = hertz_line.slice_of(contact, k), hertz_line.slice_of(contact, k + 1)
        for i in range(filled):
            overlap, nx, ny = met[OVERLAP + i], met[NX + i], met[NY + i]
            first = hertz_line.slice_terms(contact, lamina, overlap, nx, ny)
            second = hertz_line.slice_terms(contact, next_lamina, overlap, nx, ny)
            met[MET_LOAD + i] = met[MET_LOAD + i] + first[0] + second[0]
            met[STIFFNESS + i] = met[STIFFNESS + i] + first[1] + second[1]
            met[APPROACH + i] = met[APPROACH + i] + first[2] + second[2]
            met[LEAN + i] = met[LEAN + i] + first[3] + second[3]
    for i in range(filled):
        total = hertz_line.summed_load(
            contact, met[MET_LOAD + i], met[STIFFNESS + i], met[APPROACH + i], met[LEAN + i], met[NX + i], met[NY + i]
        )
        met[MET_LOAD + i], met[STIFFNESS + i] = total.load, total.stiffness
        met[APPROACH + i], met[LEAN + i] = total.approach, total.lean


@law_of(hertz_line.LineContact, hertz_line.PowerLineContact, hertz_line.LogarithmicLineContact)
def contact_in_lane(contact, met, i):
    """The law of load as lane ``i`` reads it."""
    return contact


@contact_in_lane.body(hertz_line.SummedLoad)
def _(contact, met, i):
    return hertz_line.SummedLoad(met[MET_LOAD + i], met[STIFFNESS + i], met[APPROACH + i], met[LEAN + i])


@kernel
def race_in_lane(race, met, i):
    """A ``lane_race`` as lane ``i`` meets it."""
    return races.with_shape(race, form_in_lane(race.form, met, i), contact_in_lane(race.contact, met, i))


@law_of(*TABLELESS)
def keep_place(traction_model, slip, load, met, i):
    """Write the place of lane ``i`` in the table of a law."""


@keep_place.body(SurfaceAxes)
def _(traction_model, slip, load, met, i):
    met[ALONG + i], met[ACROSS + i] = table_place(traction_model, slip, load)


@keep_place.body(MixedTraction)
def _(traction_model, slip, load, met, i):
    keep_place(traction_model.fluid, slip, load, met, i)


@kernel
def approach_of_lane(met, i):
    """The ``RaceApproach`` in lane ``i``."""
    return races.RaceApproach(
        met[NX + i],
        met[NY + i],
        met[INVERSE + i],
        met[SLOPE + i],
        met[LEAN + i],
        met[MET_LOAD + i],
        met[STIFFNESS + i],
        met[MET_DAMPING + i],
        met[ROLLER_LEVER + i],
        met[RING_LEVER + i],
        met[SLIP + i],
        met[ENTRAINMENT + i],
    )


@law_of(*TABLELESS)
def look_up(traction_model, met, first, count):
    """Write the cubics along the slip of the lanes from ``first`` to ``count``, whose place in the cell replaces that in the table."""


@look_up.body(TractionSurface)
def _(traction_model, met, first, count):
    for i in range(first, count):
        place = CUBIC + 4 * i
        met[place], met[place + 1], met[place + 2], met[place + 3], met[ALONG + i] = table_cubic(
            traction_model, met[ALONG + i], met[ACROSS + i]
        )


@look_up.body(MixedTraction)
def _(traction_model, met, first, count):
    look_up(traction_model.fluid, met, first, count)


@law_of(*TABLELESS)
def from_table(traction_model, met, i):
    """Value and slope over the slip at lane ``i`` from the table of a law, after ``look_up``; 0 without a table."""
    return 0.0, 0.0


@from_table.body(SurfaceAxes)
def _(traction_model, met, i):
    place = CUBIC + 4 * i
    return cubic(met[place], met[place + 1], met[place + 2], met[place + 3], met[ALONG + i])


@from_table.body(MixedTraction)
def _(traction_model, met, i):
    return from_table(traction_model.fluid, met, i)


@kernel
def outer_approaches(race, sizes, ring, y, first, rollers, met, count):
    """How ``count`` rollers from ``first`` on meet the outer race, in whole vectors where it allows, to the lanes of ``met``.

    The lanes past ``count`` hold no contact.
    """
    bare, filled = lane_race(race), whole_vectors(count)
    if has_loops(race.contact) or has_loops(race.form):
        for i in range(filled):
            j = first + i
            keep_centres(bare, races.roller_radius(sizes, j), y[j] - ring.x, y[rollers + j] - ring.y, met, i)
        keep_forms(race.form, ring, met, filled)
        keep_slices(race.contact, bare.form, 1.0, met, count)
    for i in range(filled):
        j = first + i
        coefficient = coefficient_of(bare.tangential, y, j)
        own_race = race_in_lane(bare, met, i)
        keep_approach(own_race, 1.0, races.roller_radius(sizes, j), ring, y, j, rollers, coefficient, met, i)


@kernel
def packed_approaches(outer, inner, sizes, outer_ring, inner_ring, scratch, first, count):
    """As ``outer_approaches``, for the packed contacts in the lanes from ``first`` to ``count``.

    There are those of the outer race only where both races share vectors.
    """
    packed, met, bare_outer, bare_inner = scratch.packed, scratch.met, lane_race(outer), lane_race(inner)
    filled = whole_vectors(count)
    if has_loops(inner.contact) or has_loops(inner.form):
        for i in range(filled):
            dx, dy = packed[i] - inner_ring.x, packed[LANES + i] - inner_ring.y
            keep_centres(bare_inner, lane_radius(sizes, packed, i), dx, dy, met, i)
        keep_forms(inner.form, inner_ring, met, filled)
        keep_slices(inner.contact, bare_inner.form, -1.0, met, count)
    for i in range(first, filled):
        side = packed[SIDES + i]
        race, ring = either(side > 0.0, bare_outer, bare_inner), either(side > 0.0, outer_ring, inner_ring)
        own_race, coefficient = race_in_lane(race, met, i), packed[COEFFICIENTS + i]
        keep_approach(own_race, side, lane_radius(sizes, packed, i), ring, packed, i, LANES, coefficient, met, i)


@kernel
def wrenches(outer, inner, met, lanes, outer_count, count):
    """Write the wrenches from approaches to ``lanes``: of ``outer_count`` contacts of the outer race, then of the inner one."""
    filled, bare_outer, bare_inner = whole_vectors(count), lane_race(outer), lane_race(inner)
    look_up(outer.traction, met, 0, outer_count)
    look_up(inner.traction, met, outer_count, filled)
    for i in range(filled):
        side = met[SIDE + i]
        race, approach = either(side > 0.0, bare_outer, bare_inner), approach_of_lane(met, i)
        value, slope = from_table(race.traction, met, i)
        steady = steady_by_table(race.tangential, race.traction, approach.slip, approach.load, value, slope)
        keep_lane(race.tangential, lanes, i, races.race_wrench(race, side, approach, steady, met[COEFFICIENT + i]))


@kernel
def pack(race, sizes, rollers, y, j, side, scratch, lane):
    """Copy the state of roller ``j`` at a race to a lane."""
    for row in range(ROLLER_STATES):
        scratch.packed[row * LANES + lane] = y[row * rollers + j]
    scratch.packed[RADII + lane] = races.roller_radius(sizes, j)
    scratch.packed[SIDES + lane] = side
    scratch.packed[COEFFICIENTS + lane] = coefficient_of(race.tangential, y, j)


@kernel
def add_to_ring(lanes, i, sums):
    """Add contact ``i`` of a block to the sums of its race."""
    return OnRing(
        sums.x - lanes[FORCE_X + i],
        sums.y - lanes[FORCE_Y + i],
        sums.moment + lanes[RING_MOMENT + i],
        max(sums.load, lanes[LOAD + i]),
        sums.traction + lanes[TRACTION + i],
        sums.rolling + lanes[ROLLING + i],
        sums.damping + lanes[DAMPING + i],
    )


@kernel
def add_to_roller(lanes, i, j, rollers, row, dy):
    """Add contact ``i`` of a block to what acts on roller ``j``."""
    dy[row, 2 * rollers + j] += lanes[FORCE_X + i]
    dy[row, 3 * rollers + j] += lanes[FORCE_Y + i]
    dy[row, 4 * rollers + j] += lanes[ROLLER_MOMENT + i]


@kernel
def add_outer(race, lanes, first, count, rollers, row, dy, sums):
    """``OnRing`` of the outer ring with ``count`` contacts, those of the rollers from ``first`` on, which also go to ``dy``."""
    for i in range(count):
        add_to_roller(lanes, i, first + i, rollers, row, dy)
        add_coefficient_rate(race.tangential, lanes[COEFFICIENT_RATE + i], first + i, row, dy)
    for i in range(count):
        sums = add_to_ring(lanes, i, sums)
    return sums


@kernel
def race_forces(outer, inner, sizes, outer_ring, inner_ring, rollers, y, row, dy, scratch):
    """All contacts of both races: adds forces and moments on the rollers to row ``row`` of ``dy``.

    Returns ``OnRing`` of the outer and of the inner ring. Nearly every roller touches the outer race. Only those of the
    load zone touch the inner one, and are packed first.
    """
    relax_coefficients(inner.tangential, rollers, y, row, dy)
    lanes, met, index, shared = scratch.lanes, scratch.met, scratch.roller, share_vectors(outer, inner)
    on_outer = on_inner = OnRing(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    start = 0
    while start < rollers and not shared:
        count = min(LANES, rollers - start)
        outer_approaches(outer, sizes, outer_ring, y, start, rollers, met, count)
        wrenches(outer, outer, met, lanes, count, count)
        on_outer = add_outer(outer, lanes, start, count, rollers, row, dy, on_outer)
        start += count

    candidate, reach2 = 0, inner.reach * inner.reach
    while start < rollers or candidate < rollers:
        first = start
        count = packed = min(LANES, (rollers - start) // VECTOR * VECTOR) if shared else 0
        outer_approaches(outer, sizes, outer_ring, y, start, rollers, met, count)
        start += count
        while start < rollers and count < LANES:
            pack(outer, sizes, rollers, y, start, 1.0, scratch, count)
            start += 1
            count += 1
        outer_count = count
        while candidate < rollers and count < LANES:
            dx, dy_ = y[candidate] - inner_ring.x, y[rollers + candidate] - inner_ring.y
            if dx * dx + dy_ * dy_ < reach2:
                pack(inner, sizes, rollers, y, candidate, -1.0, scratch, count)
                index[count] = candidate
                count += 1
            candidate += 1
        packed_approaches(outer, inner, sizes, outer_ring, inner_ring, scratch, packed, count)
        wrenches(outer, inner, met, lanes, outer_count, count)
        on_outer = add_outer(outer, lanes, first, outer_count, rollers, row, dy, on_outer)
        for i in range(outer_count, count):
            add_to_roller(lanes, i, index[i], rollers, row, dy)
            add_coefficient_rate(inner.tangential, lanes[COEFFICIENT_RATE + i], index[i], row, dy)
            on_inner = add_to_ring(lanes, i, on_inner)
    return on_outer, on_inner


class NoOpenFilm(NamedTuple):
    """Rollers off the inner race feel no force from it."""


@kernel
def open_contact(film, race, radius, ring, dx, dy, dvx, dvy, roller_spin):
    """``RaceWrench`` of the film of one roller at the inner race, without load; its slip counts as traction.

    Arguments and signs as in ``races.race_contact``: one point of action, so that force, moment and power balance.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / distance
    nx, ny = dx * inverse, dy * inverse
    rise, _ = races.form_at(race.form, nx, ny, ring.cos, ring.sin)
    overlap = race.radius + rise + radius - distance
    tangential = dvy * nx - dvx * ny
    orbit_rate = tangential * inverse
    ring_lever = distance - radius
    slip = ring.speed * ring_lever - tangential + roller_spin * radius
    entrainment = 0.5 * ((ring.speed - orbit_rate) * ring_lever - (roller_spin - orbit_rate) * radius)
    rolling, shear = film_forces(film, overlap, entrainment, slip)
    along = shear + rolling * (ring_lever - radius) * inverse
    return races.RaceWrench(
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


@law_of(NoOpenFilm)
def with_open_films(film, on_ring, race, sizes, ring, rollers, y, row, dy, scratch):
    """``OnRing`` of the inner ring with the films of all rollers, whose forces and moments go to row ``row`` of ``dy``.

    Rollers that touch the race, or are farther from it than the film reaches, are left out.
    """
    return on_ring


@with_open_films.body(OpenFilm, LayerFilm)
def _(film, on_ring, race, sizes, ring, rollers, y, row, dy, scratch):
    packed, lanes, index, sums = scratch.packed, scratch.lanes, scratch.roller, on_ring
    bare, met = lane_race(race), scratch.met
    far = (race.reach + film_reach(film)) * (1.0 + ROUND_OFF)
    j = 0
    while j < rollers:
        count = 0
        while j < rollers and count < LANES:
            # As far below the mean radius of race and roller as ``reach`` is above it.
            near = (2.0 * (race.radius + races.roller_radius(sizes, j)) - race.reach) * (1.0 - ROUND_OFF)
            dx, dy_ = y[j] - ring.x, y[rollers + j] - ring.y
            if near * near < dx * dx + dy_ * dy_ < far * far:
                pack(race, sizes, rollers, y, j, -1.0, scratch, count)
                index[count] = j
                count += 1
            j += 1
        if has_loops(race.form):
            for i in range(whole_vectors(count)):
                radius = lane_radius(sizes, packed, i)
                keep_centres(bare, radius, packed[i] - ring.x, packed[LANES + i] - ring.y, met, i)
            keep_forms(race.form, ring, met, whole_vectors(count))
        for i in range(whole_vectors(count)):
            own_race = race_in_lane(bare, met, i)
            dx, dy_ = packed[i] - ring.x, packed[LANES + i] - ring.y
            dvx, dvy = packed[2 * LANES + i] - ring.vx, packed[3 * LANES + i] - ring.vy
            radius, spin = lane_radius(sizes, packed, i), packed[4 * LANES + i]
            keep_lane(RigidContact(), lanes, i, open_contact(film, own_race, radius, ring, dx, dy_, dvx, dvy, spin))
        for i in range(count):
            add_to_roller(lanes, i, index[i], rollers, row, dy)
            sums = add_to_ring(lanes, i, sums)
    return sums
