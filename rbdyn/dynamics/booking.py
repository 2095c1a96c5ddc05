"""What every method keeps of a step: samples of the cage's speed, and the largest pocket loads within it."""

from __future__ import annotations

import math

from rbdyn.dynamics.equations import POCKET_CONTACT_LOAD, POCKET_LOAD
from rbdyn.kernel import kernel, routine

PEAK_POINTS = 8  # interior points at which a step that holds a new largest pocket load is looked at


@kernel
def book_whirl(whirl, vx, vy):
    """Take a sample of the velocity of the cage's centre [m/s]."""
    square = vx * vx + vy * vy
    whirl[0] += 1.0
    whirl[1] += math.sqrt(square)
    whirl[2] += square


@kernel
def book_point(values, point, loads, row):
    """Take the pocket loads in row ``row`` as those at a point of a step."""
    values[0, point] = loads[row, POCKET_LOAD]
    values[1, point] = loads[row, POCKET_CONTACT_LOAD]


@routine
def book_peaks(values, start, h, tally):
    """Keep the peaks of both pocket loads, given at even points of a step of ``h`` [s] from ``start`` on."""
    book_peak(values[0], start, h, tally, POCKET_LOAD)
    book_peak(values[1], start, h, tally, POCKET_CONTACT_LOAD)


@routine
def book_peak(values, start, h, tally, force):
    """Keep the largest of these loads, or the vertex of the parabola through it and its neighbours, where it is larger
    than any before.
    """
    best, place, spacing = 0.0, 0, 1.0 / (values.size - 1)
    for p in range(values.size):
        if values[p] > best:
            best, place = values[p], p
    theta = place * spacing
    if 0 < place < values.size - 1:
        left, right = values[place - 1], values[place + 1]
        bend = left - 2.0 * best + right
        if bend < 0.0:
            shift = 0.5 * (left - right) / bend
            best -= 0.25 * (left - right) * shift
            theta += shift * spacing
    if best > tally.largest[force]:
        tally.largest[force] = best
        tally.largest_time[force] = start + theta * h
