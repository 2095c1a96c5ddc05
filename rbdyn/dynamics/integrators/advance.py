"""The loop over steps, one for all methods: step control, booking and the search for peaks."""

import math

import numpy as np

from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.dynamics.forces.equations import LOADS, POCKET_CONTACT_LOAD, POCKET_LOAD, POWERS, pocket_loads, roller_count
from rbdyn.dynamics.forces.state import CAGE_VX, CAGE_VY, CAGE_X, CAGE_Y, PARTS
from rbdyn.dynamics.integrators import method_laws as laws
from rbdyn.dynamics.integrators import records as at
from rbdyn.dynamics.integrators.booking import PEAK_POINTS, book_peaks, book_point, book_whirl
from rbdyn.dynamics.integrators.step_control import after_accepted, shortened, worst_component

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
