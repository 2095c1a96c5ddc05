"""Explicit Runge-Kutta pairs: adaptive with a PI controller, first-same-as-last, dense output.

Controller after Hairer, Norsett and Wanner, Solving ODEs I, II.4; the pairs stand in modules of their own.

The error of a step is the Euclidean norm of all components, each over its own absolute tolerance, and not averaged
over them: it is never smaller than that of the worst component, however many rollers there are. Loss powers are
integrated with the main weights from the same stages, so that the power balance tests the integrator too.
The rollers are integrated in a frame that turns with them (``orbit_frame``).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.dynamics.forces.equations import (
    LOADS,
    POCKET_CONTACT_LOAD,
    POCKET_LOAD,
    POWERS,
    derivative,
    derivative_once,
    roller_count,
)
from rbdyn.dynamics.forces.race_lanes import Scratch
from rbdyn.dynamics.forces.state import CAGE_VX, CAGE_VY
from rbdyn.dynamics.integrators.booking import PEAK_POINTS, book_peaks, book_point, book_whirl
from rbdyn.dynamics.integrators.dormand_prince import DormandPrince
from rbdyn.dynamics.integrators.embedded_pair import (
    mean_rate,
    quartic_rate,
    rate_error,
    stage_state,
    stage_time,
    stage_weight,
)
from rbdyn.dynamics.integrators.orbit_frame import (
    mean_orbit_rate,
    rates_to_fixed_axes,
    rates_to_frame,
    to_fixed_axes,
    turn_of,
)

FINISHED, STEP_UNDERFLOW, NOT_FINITE, STEP_BUDGET = range(4)

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0
LOOK_EVERY = 8  # Stiffness is looked at in every eighth step.
# As an integer of numpy: for each plain one a right-hand side would be compiled anew.
FIRST_ROW = np.int64(0)
DORMAND_PRINCE = DormandPrince()


class Control(NamedTuple):
    """Step control: inverse absolute tolerance of each component, step limits [s], step budget."""

    inverse_tolerance: NDArray[np.float64]
    smallest_step: float
    largest_step: float
    step_budget: int


class Carry(NamedTuple):
    """What one call hands to the next. Arrays, changed in place."""

    y: NDArray[np.float64]  # state
    k: NDArray[np.float64]  # (7, n) stage derivatives, rollers' in the frame of the step; row 0 belongs to y
    stage: NDArray[np.float64]  # (n,) state of the stage in hand, in the end that at the end of the step
    power: NDArray[np.float64]  # (7, POWERS)
    loads: NDArray[np.float64]  # (7, LOADS)
    scratch: Scratch
    clock: NDArray[np.float64]  # time, next step, previous error, next sample time, rate of the frame
    counts: NDArray[np.int64]  # accepted, rejected, right-hand sides, worst component
    stiffness: NDArray[np.float64]  # steps looked at, those held by stability, sum of their |eigenvalue| [1/s]
    pair: Any = DORMAND_PRINCE


class Tally(NamedTuple):
    """What is kept over a window. Arrays, changed in place."""

    work: NDArray[np.float64]  # (POWERS,) integrals of the powers [J]
    largest: NDArray[np.float64]  # (LOADS,) largest loads [N]
    largest_time: NDArray[np.float64]  # (LOADS,) and when [s]
    whirl: NDArray[np.float64]  # samples, sum and sum of squares of the cage centre's speed


@kernel
def interpolate(y, k, h, theta, i, pair=DORMAND_PRINCE):
    """Component ``i`` at the fraction ``theta`` of the step, to the order of ``pair`` less one; rollers' in the frame of
    the step.
    """
    difference = h * mean_rate(pair, k, i)
    slope = h * k[0, i] - difference
    curve = difference - h * k[pair.last, i] - slope
    quartic = h * quartic_rate(pair, k, i)
    rest = 1.0 - theta
    return y[i] + theta * (difference + rest * (slope + theta * (curve + rest * quartic)))


@kernel
def scaled_error(pair, k, i, inverse_tolerance):
    """Embedded error of component ``i`` per step size, over its tolerance."""
    return rate_error(pair, k, i) * inverse_tolerance[i]


@kernel
def error_norm(pair, k, h, inverse_tolerance):
    """Norm of the embedded error: a sum of squares, so that any NaN comes through.

    Four sums side by side, in an order that does not depend on how the compiler vectorises.
    """
    n = inverse_tolerance.size
    whole = n // 4 * 4
    sum_0 = sum_1 = sum_2 = sum_3 = 0.0
    for i in range(0, whole, 4):
        e_0, e_1 = (scaled_error(pair, k, i, inverse_tolerance), scaled_error(pair, k, i + 1, inverse_tolerance))
        e_2, e_3 = (scaled_error(pair, k, i + 2, inverse_tolerance), scaled_error(pair, k, i + 3, inverse_tolerance))
        sum_0 += e_0 * e_0
        sum_1 += e_1 * e_1
        sum_2 += e_2 * e_2
        sum_3 += e_3 * e_3
    for i in range(whole, n):
        e = scaled_error(pair, k, i, inverse_tolerance)
        sum_0 += e * e
    return h * math.sqrt((sum_0 + sum_1) + (sum_2 + sum_3))


@kernel
def trial_step(bearing, pair, y, k, stage, power, loads, scratch, rate, h):
    """All stages but the first of a step of size ``h`` from ``y``, in a frame of ``rate``; the end state is left in ``stage``."""
    # One loop of a length the compiler does not know: unrolled, the derivatives overflow the instruction cache.
    z = roller_count(bearing)
    for s in range(1, pair.last + 1):
        turn = turn_of(rate, stage_time(pair, s) * h)
        stage_state(pair, s, y, k, h, stage)
        to_fixed_axes(turn, z, stage)
        derivative(bearing, stage, s, k, power, loads, scratch)
        rates_to_frame(turn, z, stage, s, k)


@kernel
def begin_step(z, y, k):
    """Rate of the frame [rad/s] of the step from ``y``, whose first stage, given in fixed axes, is turned into it."""
    rate = mean_orbit_rate(z, y)
    rates_to_frame(turn_of(rate, 0.0), z, y, 0, k)
    return rate


@routine
def worst_component(pair, k, h, inverse_tolerance):
    """Component that limits the step: the first that is not finite, else the one of the largest error."""
    worst, largest = 0, -1.0
    for i in range(inverse_tolerance.size):
        e = abs(h * scaled_error(pair, k, i, inverse_tolerance))
        if not math.isfinite(e):
            return i
        if e > largest:
            worst, largest = i, e
    return worst


@routine
def refine_peak(bearing, carry, h, tally):
    """Look inside a step for its largest pocket loads: eight points, then the vertex of a parabola."""
    pair = carry.pair
    values = np.empty((2, PEAK_POINTS + 2))
    inside = np.empty_like(carry.y)
    book_point(values, 0, carry.loads, 0)
    book_point(values, PEAK_POINTS + 1, carry.loads, pair.last)
    spacing = 1.0 / (PEAK_POINTS + 1)
    for p in range(1, PEAK_POINTS + 1):
        for i in range(carry.y.size):
            inside[i] = interpolate(carry.y, carry.k, h, p * spacing, i, pair)
        to_fixed_axes(turn_of(carry.clock[4], p * spacing * h), bearing.rollers, inside)
        derivative_once(bearing, inside, pair.free, carry.k, carry.power, carry.loads, carry.scratch)
        book_point(values, p, carry.loads, pair.free)
    book_peaks(values, carry.clock[0], h, tally)


@kernel
def keep(pair, body, y, k, power, loads, clock, work, largest, largest_time, whirl, h, sample_step):
    """Book an accepted step: work, largest loads, samples; the cage's coordinates stand from ``body`` on.

    Returns whether a stage saw a new largest pocket load.
    """
    for p in range(POWERS):
        work[p] += h * mean_rate(pair, power, p)
    time = clock[0]
    on_wall = contact = 0.0
    for s in range(1, pair.last + 1):
        on_wall = max(on_wall, loads[s, POCKET_LOAD])
        contact = max(contact, loads[s, POCKET_CONTACT_LOAD])
    for force in range(LOADS):
        if loads[pair.last, force] > largest[force]:
            largest[force] = loads[pair.last, force]
            largest_time[force] = time + h
    while clock[3] <= time + h:
        theta = (clock[3] - time) / h
        vx = interpolate(y, k, h, theta, body + CAGE_VX, pair)
        vy = interpolate(y, k, h, theta, body + CAGE_VY, pair)
        book_whirl(whirl, vx, vy)
        clock[3] += sample_step
    return on_wall > largest[POCKET_LOAD] or contact > largest[POCKET_CONTACT_LOAD]


@routine
def look_at_stiffness(pair, k, stiffness, h, inverse_tolerance):
    """Book whether stability holds the step: |eigenvalue| = |difference of rates|/|difference of states| over the
    tolerances, of the last two stages, both at the end of the step (Hairer and Wanner, Solving ODEs II, IV.2).
    """
    last = pair.last
    rates = places = 0.0
    for i in range(inverse_tolerance.size):
        rate = (k[last, i] - k[last - 1, i]) * inverse_tolerance[i]
        place = 0.0
        for s in range(last):
            weight = stage_weight(pair, last, s) - stage_weight(pair, last - 1, s)
            if weight != 0.0:
                place += weight * k[s, i]
        place *= h * inverse_tolerance[i]
        rates += rate * rate
        places += place * place
    stiffness[0] += 1.0
    if h * h * rates > pair.limit * pair.limit * places > 0.0:
        stiffness[1] += 1.0
        stiffness[2] += math.sqrt(rates / places)


@entry
def advance(bearing, control, carry, tally, t_end, sample_step):
    """Integrate from the carried time to ``t_end`` [s]; returns FINISHED or why not.

    Steps end exactly at ``t_end``. On any other status ``carry`` holds the last good state, and
    ``carry.counts[3]`` the component that made it impossible.
    """
    # Taken out of their tuples once: each time counts references, atomically.
    y, k, stage, clock, counts = carry.y, carry.k, carry.stage, carry.clock, carry.counts
    power, loads, scratch = carry.power, carry.loads, carry.scratch
    work, largest, largest_time, whirl = tally.work, tally.largest, tally.largest_time, tally.whirl
    inverse_tolerance, pair = control.inverse_tolerance, carry.pair
    z = roller_count(bearing)
    if counts[2] == 0:
        derivative_once(bearing, y, FIRST_ROW, k, power, loads, scratch)
        counts[2] = 1
        for i in range(y.size):
            if not math.isfinite(k[0, i]):
                counts[3] = i
                return NOT_FINITE
        clock[4] = begin_step(z, y, k)
    grow = GROW
    while clock[0] < t_end:
        if counts[0] + counts[1] >= control.step_budget:
            return STEP_BUDGET
        remaining = t_end - clock[0]
        last = clock[1] >= remaining
        h = remaining if last else clock[1]
        trial_step(bearing, pair, y, k, stage, power, loads, scratch, clock[4], h)
        counts[2] += pair.last
        error = error_norm(pair, k, h, inverse_tolerance)
        if error <= 1.0:
            if counts[0] % LOOK_EVERY == 0:
                look_at_stiffness(pair, k, carry.stiffness, h, inverse_tolerance)
            if keep(pair, 5 * z, y, k, power, loads, clock, work, largest, largest_time, whirl, h, sample_step):
                refine_peak(bearing, carry, h, tally)
                counts[2] += PEAK_POINTS
            counts[0] += 1
            rates_to_fixed_axes(turn_of(clock[4], h), z, stage, pair.last, k)
            clock[0] = t_end if last else clock[0] + h
            for i in range(y.size):
                y[i] = stage[i]
                k[0, i] = k[pair.last, i]
            for p in range(POWERS):
                power[0, p] = power[pair.last, p]
            for force in range(LOADS):
                loads[0, force] = loads[pair.last, force]
            clock[4] = begin_step(z, y, k)
            error = max(error, 1e-4)
            factor = SAFETY * error**-pair.exponent * clock[2] ** pair.beta
            # A step cut short by t_end says nothing against the step it was cut from.
            proposal = min(h * min(max(factor, SHRINK), grow), control.largest_step)
            clock[1] = max(proposal, clock[1]) if last else proposal
            clock[2] = error
            grow = GROW
        else:
            counts[1] += 1
            finite = math.isfinite(error)
            shrink = max(SAFETY * error**-pair.rejected, SHRINK) if finite else SHRINK
            if h * shrink < control.smallest_step:
                counts[3] = worst_component(pair, k, h, inverse_tolerance)
                return STEP_UNDERFLOW if finite else NOT_FINITE
            clock[1] = h * shrink
            grow = 1.0
    return FINISHED
