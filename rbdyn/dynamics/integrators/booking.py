"""What every method keeps of a step: samples of the cage's speed and place, and the largest pocket loads within it."""

import math

from rbdyn.compiled.kernel import kernel, routine
from rbdyn.dynamics.forces.equations import POCKET_CONTACT_LOAD, POCKET_LOAD
from rbdyn.dynamics.integrators.records import PLACE_SQUARES, PLACES_X, PLACES_Y, SAMPLES, SPEEDS, SQUARES

PEAK_POINTS = 8  # interior points at which a step that holds a new largest pocket load is looked at


@kernel
def book_whirl(whirl, x, y, vx, vy):
    """Take a sample of place [m] and velocity [m/s] of the cage's centre."""
    square = vx * vx + vy * vy
    whirl[SAMPLES] += 1.0
    whirl[SPEEDS] += math.sqrt(square)
    whirl[SQUARES] += square
    whirl[PLACES_X] += x
    whirl[PLACES_Y] += y
    whirl[PLACE_SQUARES] += x * x + y * y


@kernel
def book_point(values, point, loads, row):
    """Take the pocket loads in row ``row`` as those at a point of a step."""
    values[0, point] = loads[row, POCKET_LOAD]
    values[1, point] = loads[row, POCKET_CONTACT_LOAD]


@routine
def book_peaks(values, start, h, tally):
    """Keep the peaks of both pocket loads, given at even points of a step of ``h`` [s] from ``start`` on: of each the
    largest, or the vertex of the parabola through it and its neighbours, where it is larger than any before.
    """
    last = values.shape[1] - 1
    # Of a length that the compiler does not know: unrolled, this would be compiled twice.
    for row in range(values.shape[0]):
        force = POCKET_CONTACT_LOAD if row else POCKET_LOAD
        best, place, spacing = 0.0, 0, 1.0 / last
        for p in range(last + 1):
            if values[row, p] > best:
                best, place = values[row, p], p
        theta = place * spacing
        if 0 < place < last:
            left, right = values[row, place - 1], values[row, place + 1]
            bend = left - 2.0 * best + right
            if bend < 0.0:
                shift = 0.5 * (left - right) / bend
                best -= 0.25 * (left - right) * shift
                theta += shift * spacing
        if best > tally.largest[force]:
            tally.largest[force] = best
            tally.largest_time[force] = start + theta * h
