"""What every method keeps of a step: samples of the cage's speed, and the largest pocket load within it."""

from __future__ import annotations

import math

from rbdyn.dynamics.equations import POCKET_LOAD
from rbdyn.kernel import kernel, routine

PEAK_POINTS = 8  # interior points at which a step that holds a new largest pocket load is looked at


@kernel
def book_whirl(whirl, vx, vy):
    """Take a sample of the velocity of the cage's centre [m/s]."""
    square = vx * vx + vy * vy
    whirl[0] += 1.0
    whirl[1] += math.sqrt(square)
    whirl[2] += square


@routine
def book_peak(values, start, h, tally):
    """Keep the largest of pocket loads at even points of a step of ``h`` [s] from ``start`` on, or the vertex of the
    parabola through it and its neighbours, where it is larger than any before.
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
    if best > tally.largest[POCKET_LOAD]:
        tally.largest[POCKET_LOAD] = best
        tally.largest_time[POCKET_LOAD] = start + theta * h
