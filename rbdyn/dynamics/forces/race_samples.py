"""Samples of the race contacts at even times: heat of sliding, flash temperature, and entries into the load zone.

Power density of a contact: mu Q |s| over the area 2 b l of the Hertz contact. Flash temperature: 1.11 mu (Q/l) |sqrt u1 -
sqrt u2|/(e sqrt(2 b)) (Blok 1937, as in AGMA 925 and ISO/TS 6336-20) with the mean effusivity e of both bodies; u1 is the speed
at which the race passes the contact, u2 = u1 - s that of the roller.

Entry: the load of a roller on the inner race passes a tenth of the largest static load. Its energy is the sum of mu Q |s|
until |s| is below 2 % of the rolling speed, or until the load falls below half that tenth. A roller enters once in half a turn
of the cage at most, since a load that vibrates passes a limit many times.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import kernel, law_of, routine
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.equations import motions
from rbdyn.dynamics.forces.races import RaceWrench, race_observed


class NoRaceSamples(NamedTuple):
    """Race contacts are not sampled."""


class RaceScale(NamedTuple):
    """Constants of the contacts of a race."""

    density: float  # power density times area, over the root of the load: 1/(2 l b/sqrt Q) [sqrt(N)/m2]
    flash: float  # flash temperature over friction force, difference of the roots of speeds, and Q^(-1/4)
    speed: float  # at which the race passes the contact, without slip of the cage [m/s]


class RaceSamples(NamedTuple):
    """When and how race contacts are sampled."""

    spacing: float  # [s]
    inner: RaceScale
    outer: RaceScale
    entry_load: float  # on the inner race, from which a roller is in the load zone [N]
    rolling_slip: float  # below which an entry has ended [m/s]
    pause: float  # fewest samples between two entries of a roller


@law_of(NoRaceSamples)
def book_races(samples, bearing, y, time, next_time, followed, sums):
    """Sample the race contacts in state ``y`` where it is ``time`` [s] for it; returns when the next sample is due [s].

    ``followed`` (FOLLOWED, rollers) and ``sums`` (SAMPLED, columns) change in place.
    """
    return math.inf


@book_races.body(RaceSamples)
def _(samples, bearing, y, time, next_time, followed, sums):
    if time < next_time:
        return next_time
    sample_races(samples, bearing, y, int(next_time / samples.spacing + 0.5), followed, sums)
    return max(next_time + samples.spacing, time)


# Contacts of a roller are booked in one of so many samples, in turn; its entry is followed in all of them.
ROUNDS = 3


@routine
def sample_races(samples, bearing, y, number, followed, sums):
    """``book_races`` at the time of the sample of this ``number``."""
    _, _, inner, outer = motions(bearing, y)
    z, reach2 = bearing.rollers, bearing.inner.reach * bearing.inner.reach
    for j in range(z):
        booked = (j + number) % ROUNDS == 0
        if booked:
            contact = race_observed(bearing.outer, 1.0, bearing, y, j, outer)
            book_contact(samples.outer, contact, state.OUTER_DENSITIES, state.OUTER_FLASHES, sums)
        dx, dy = y[j] - inner.x, y[z + j] - inner.y
        contact = RaceWrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if dx * dx + dy * dy < reach2:
            contact = race_observed(bearing.inner, -1.0, bearing, y, j, inner)
            if booked:
                book_contact(samples.inner, contact, state.INNER_DENSITIES, state.INNER_FLASHES, sums)
        follow_entry(samples, contact, j, followed, sums)


@kernel
def book_value(sums, row, value):
    """Add a value to number, total and logarithmic histogram in row ``row`` of ``sums``."""
    place = state.SAMPLE_STEPS * math.log10(max(value, state.SAMPLE_LOWEST) / state.SAMPLE_LOWEST)
    sums[row, state.SAMPLES_NUMBER] += 1.0
    sums[row, state.SAMPLES_TOTAL] += value
    sums[row, state.SAMPLES_TOTAL + 1 + min(int(place), state.SAMPLE_BINS - 1)] += 1.0


@kernel
def book_contact(scale, contact, density, flash, sums):
    """Add power density [W/m2] and flash temperature [K] of a loaded contact to the rows of ``sums``."""
    if contact.load <= 0.0:
        return
    slip = abs(contact.slip)
    book_value(sums, density, contact.traction * scale.density / math.sqrt(contact.load))
    friction = contact.traction / slip if slip > 0.0 else 0.0
    roots = abs(math.sqrt(scale.speed) - math.sqrt(max(scale.speed - slip, 0.0)))
    book_value(sums, flash, scale.flash * friction * roots / math.sqrt(math.sqrt(contact.load)))


@kernel
def follow_entry(samples, contact, j, followed, sums):
    """Follow roller ``j`` into the load zone by its contact with the inner race, and book entries that end.

    ``ENTRY_OUTSIDE``: whether its load was below the limit since. ``ENTRY_SAMPLES``: samples since its last entry. ``ENTRY_SLIP``:
    its slip there, 0 where that entry has ended.
    """
    followed[state.ENTRY_SAMPLES, j] += 1.0
    slip = abs(contact.slip)
    if followed[state.ENTRY_SLIP, j] == 0.0:
        outside, rested = followed[state.ENTRY_OUTSIDE, j] > 0.0, followed[state.ENTRY_SAMPLES, j] > samples.pause
        followed[state.ENTRY_OUTSIDE, j] = 1.0 if contact.load < samples.entry_load else 0.0
        if outside and rested and contact.load >= samples.entry_load:
            followed[state.ENTRY_SLIP, j], followed[state.ENTRY_ENERGY, j] = max(slip, state.SAMPLE_LOWEST), 0.0
            followed[state.ENTRY_SAMPLES, j] = 0.0
    if followed[state.ENTRY_SLIP, j] > 0.0:
        if slip < samples.rolling_slip or contact.load < 0.5 * samples.entry_load:
            book_value(sums, state.ENTRY_SLIPS, followed[state.ENTRY_SLIP, j])
            book_value(sums, state.ENTRY_ENERGIES, followed[state.ENTRY_ENERGY, j])
            followed[state.ENTRY_SLIP, j] = 0.0
        else:
            followed[state.ENTRY_ENERGY, j] += contact.traction * samples.spacing
