"""The loop over steps, one for all methods: how long the next step is, what is kept of a step, and the search for peaks.

How long the next step is: a PI controller on the error of a step over its tolerance (Hairer, Norsett and Wanner, Solving
ODEs I, II.4), which with ``beta`` = 0 is the plain one.

The error of a step is the Euclidean norm of all components, each over its own absolute tolerance, and not averaged
over them: it is never smaller than that of the worst component, however many rollers there are.
"""

import math

import numpy as np

from rbdyn.compiled.elementary import rough_power
from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.dynamics.forces.equations import LOADS, POCKET_CONTACT_LOAD, POCKET_LOAD, POWERS, pocket_loads, roller_count
from rbdyn.dynamics.forces.state import CAGE_VX, CAGE_VY, CAGE_X, CAGE_Y, PARTS
from rbdyn.dynamics.integrators import method_laws as laws
from rbdyn.dynamics.integrators import records as at
from rbdyn.dynamics.integrators.records import ERROR, PLACE_SQUARES, PLACES_X, PLACES_Y, SAMPLES, SPEEDS, SQUARES, STEP

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0


@kernel
def after_accepted(method, clock, h, cut, error, refused, largest_step):
    """Set the step after one of ``h`` [s] that was accepted. ``cut``: it ended early, which says nothing against the step it
    was cut from; ``refused``: the one before was refused, so that this is no time to grow.
    """
    error = max(error, 1e-4)
    factor = SAFETY * rough_power(error, -method.exponent) * rough_power(clock[ERROR], method.beta)
    proposal = min(h * min(max(factor, SHRINK), 1.0 if refused else GROW), largest_step)
    clock[STEP] = max(proposal, clock[STEP]) if cut else proposal
    clock[ERROR] = error


@kernel
def shortened(method, h, error):
    """Step [s] in place of one of ``h`` that was refused."""
    return h * (max(SAFETY * rough_power(error, -method.rejected), SHRINK) if math.isfinite(error) else SHRINK)


@routine
def worst_component(method, k, h, inverse_tolerance):
    """Component that limits the step: the first that is not finite, else the one of the largest error."""
    worst, largest = 0, -1.0
    for i in range(inverse_tolerance.size):
        e = abs(laws.step_error(method, k, h, i)) * inverse_tolerance[i]
        if not math.isfinite(e):
            return i
        if e > largest:
            worst, largest = i, e
    return worst


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


LOOK_EVERY = 8  # Stiffness is looked at in every eighth step.


@routine
def refine_peak(bearing, carry, h, tally):
    """Look inside a step for its largest pocket loads: eight points, then the vertex of a parabola."""
    method, y, stage, k, loads = carry.method, carry.y, carry.stage, carry.k, carry.loads
    values = np.empty((2, PEAK_POINTS + 2))
    inside = np.empty_like(y)
    book_point(values, 0, loads, 0)
    book_point(values, PEAK_POINTS + 1, loads, method.last)
    spacing = 1.0 / (PEAK_POINTS + 1)
    for p in range(1, PEAK_POINTS + 1):
        for i in range(y.size):
            inside[i] = laws.interpolate(method, y, stage, k, h, p * spacing, i)
        laws.to_fixed_axes_at(method, carry.clock, p * spacing * h, bearing.rollers, inside)
        pocket_loads(bearing, inside, method.free, loads, carry.scratch)
        book_point(values, p, loads, method.free)
    book_peaks(values, carry.clock[at.NOW], h, tally)


@kernel
def keep(method, body, y, stage, k, power, loads, clock, work, largest, largest_time, whirl, h, sample_step):
    """Book an accepted step: work, largest loads, samples; the cage's coordinates stand from ``body`` on.

    Returns whether a stage saw a new largest pocket load.
    """
    for p in range(POWERS):
        work[p] += laws.work_done(method, power, h, p)
    time = clock[at.NOW]
    on_wall = contact = 0.0
    for s in range(1, method.last + 1):
        on_wall = max(on_wall, loads[s, POCKET_LOAD])
        contact = max(contact, loads[s, POCKET_CONTACT_LOAD])
    for force in range(LOADS):
        if loads[method.last, force] > largest[force]:
            largest[force] = loads[method.last, force]
            largest_time[force] = time + h
    while clock[at.SAMPLE] <= time + h:
        theta = (clock[at.SAMPLE] - time) / h
        cage_x = laws.interpolate(method, y, stage, k, h, theta, body + CAGE_X)
        cage_y = laws.interpolate(method, y, stage, k, h, theta, body + CAGE_Y)
        vx = laws.interpolate(method, y, stage, k, h, theta, body + CAGE_VX)
        vy = laws.interpolate(method, y, stage, k, h, theta, body + CAGE_VY)
        book_whirl(whirl, cage_x, cage_y, vx, vy)
        clock[at.SAMPLE] += sample_step
    return on_wall > largest[POCKET_LOAD] or contact > largest[POCKET_CONTACT_LOAD]


@entry
def advance(bearing, control, carry, tally, t_end, sample_step):
    """Integrate from the carried time to ``t_end`` [s]; returns FINISHED or why not: see ``Status``.

    Steps end exactly at ``t_end``. On any other status ``carry`` holds the last good state, and
    ``carry.counts[WORST]`` the component that made it impossible.
    """
    # Taken out of their tuples once: each time counts references, atomically.
    y, k, stage, clock, counts = carry.y, carry.k, carry.stage, carry.clock, carry.counts
    power, loads, scratch, stiffness = carry.power, carry.loads, carry.scratch, carry.stiffness
    work, largest, largest_time, whirl = tally.work, tally.largest, tally.largest_time, tally.whirl
    inverse_tolerance, method = control.inverse_tolerance, carry.method
    z = roller_count(bearing)
    worst = laws.begin(method, bearing, y, k, power, loads, scratch, clock, counts)
    if worst >= 0:
        counts[at.WORST] = worst
        return at.NOT_FINITE
    refused = False
    while clock[at.NOW] < t_end:
        if counts[at.ACCEPTED] + counts[at.REJECTED] >= control.step_budget:
            return at.STEP_BUDGET
        remaining = t_end - clock[at.NOW]
        cut = clock[at.STEP] >= remaining
        h = remaining if cut else clock[at.STEP]
        laws.trial_step(method, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h)
        error = laws.error_norm(method, k, h, inverse_tolerance)
        if error <= 1.0:
            if counts[at.ACCEPTED] % LOOK_EVERY == 0:
                laws.look_at_stiffness(method, k, stiffness, h, inverse_tolerance)
            laws.end_step(method, bearing, stage, k, power, loads, scratch, counts)
            if keep(
                method, PARTS * z, y, stage, k, power, loads, clock, work, largest, largest_time, whirl, h, sample_step
            ):
                refine_peak(bearing, carry, h, tally)
            counts[at.ACCEPTED] += 1
            clock[at.NOW] = t_end if cut else clock[at.NOW] + h
            for i in range(y.size):
                y[i] = stage[i]
                k[0, i] = k[method.last, i]
            for p in range(POWERS):
                power[0, p] = power[method.last, p]
            for force in range(LOADS):
                loads[0, force] = loads[method.last, force]
            laws.next_frame(method, clock, h, z, y, k)
            after_accepted(method, clock, h, cut, error, refused, control.largest_step)
            refused = False
        else:
            counts[at.REJECTED] += 1
            refused = True
            shorter = shortened(method, h, error)
            if shorter < control.smallest_step:
                counts[at.WORST] = worst_component(method, k, h, inverse_tolerance)
                return at.STEP_UNDERFLOW if math.isfinite(error) else at.NOT_FINITE
            clock[at.STEP] = shorter
    return at.FINISHED
