"""The loop over steps, one for all methods: step control, work and loads of a step, the search for peaks.

A PI controller on the error of a step over its tolerance sets the next step (Hairer, Norsett and Wanner, Solving ODEs I,
II.4); with ``beta`` = 0 it is the plain controller. The error of a step is the Euclidean norm of all components, each over
its own absolute tolerance. It is no average, so it is never smaller than the error of the worst component.

One set of records serves all methods: ``Control`` is the input, ``Carry`` goes from call to call, ``Tally`` is the output.
What the loop asks of a method are laws, so that stages and weights are compiled in. A method is a NamedTuple:

- ``last``: row of ``Carry.k`` at the end of the step, which is the first row of the next step
- ``free``: a row of no stage, work space once a step was tried
- ``exponent`` of the error of this step and ``beta`` of the error before, in the step control
- ``rejected``: exponent of the error of a step that is refused
"""

import math
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.elementary import rough_power
from rbdyn.compiled.kernel import entry, kernel, law, routine
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.equations import pocket_loads, roller_count
from rbdyn.dynamics.forces.impacts import book_impacts
from rbdyn.dynamics.forces.race_lanes import Scratch, scratch
from rbdyn.dynamics.forces.race_samples import book_races
from rbdyn.losses import POWERS

# Places in ``Carry.clock``: time, next step, next sample time [s], error of the last step over the tolerance, rate of the
# frame [rad/s], next time of the trace and of the samples of the races [s], size of the step before [s].
NOW, STEP, ERROR, SAMPLE, FRAME, TRACED, RACES, BEFORE, CLOCK = range(9)
# In ``Carry.counts``: steps, right-hand sides, and the component that made the last step impossible.
ACCEPTED, REJECTED, DERIVATIVES, WORST, COUNTS = range(5)
# In ``Carry.stiffness``: steps tested, those that stability limits, sum of their |eigenvalue| [1/s].
TESTED, LIMITED, EIGENVALUES, STIFFNESS = range(4)
# In ``Tally.whirl``: samples, sum and sum of squares of the speed of the cage's centre, sums of its places x and y and of
# x^2 + y^2.
SAMPLES, SPEEDS, SQUARES, PLACES_X, PLACES_Y, PLACE_SQUARES, WHIRL = range(7)
# Rows of stages: of the longest method, with its end of the step and a free one.
ROWS = 8
PI_START_ERROR = 1e-4


class Status(Enum):
    """Why ``advance`` returned, in the order of the numbers that it returns: a template of a message, and the remedy."""

    FINISHED = "", ""
    STEP_UNDERFLOW = (
        "the step fell below {smallest_step:.2g} s because of {component}",
        "loosen numerics.rtol or soften the law that acts on it (damping, friction blend, film floor)",
    )
    NOT_FINITE = "{component} is not finite at any step size", "check the laws that act on it"
    STEP_BUDGET = (
        "step budget of {step_budget} used up after {spent_s:.3g} s of running (last step {step:.2g} s)",
        "raise numerics.step_budget_per_turn, loosen numerics.rtol, or soften the stiffest law",
    )


FINISHED, STEP_UNDERFLOW, NOT_FINITE, STEP_BUDGET = range(len(Status))


class Control(NamedTuple):
    """Step control: inverse absolute tolerance of each component, step limits [s], step budget."""

    inverse_tolerance: NDArray[np.float64]
    smallest_step: float
    largest_step: float
    step_budget: int


class Trace(NamedTuple):
    """Record of some ``components`` of the state at times ``spacing`` [s] apart, which its reader empties.

    ``samples``: (room, components). ``counts``: samples, and those whose step ends with a loaded contact of the inner race.
    """

    components: NDArray[np.int64]
    spacing: float
    samples: NDArray[np.float64]
    counts: NDArray[np.int64]


def trace_of(components: list[int], spacing: float, room: int) -> Trace:
    """An empty trace with room for so many samples."""
    return Trace(
        np.array(components, dtype=np.int64), spacing, np.empty((room, len(components))), np.zeros(2, dtype=np.int64)
    )


class Carry(NamedTuple):
    """Memory from one call to the next. Arrays, changed in place."""

    y: NDArray[np.float64]  # state
    k: NDArray[np.float64]  # (ROWS, n) stage derivatives; row 0 belongs to y
    stage: NDArray[np.float64]  # (n,) state of the current stage, at last of the end of the step
    power: NDArray[np.float64]  # (ROWS, POWERS)
    loads: NDArray[np.float64]  # (ROWS, LOADS)
    scratch: Scratch
    clock: NDArray[np.float64]
    counts: NDArray[np.int64]
    stiffness: NDArray[np.float64]
    followed: NDArray[np.float64]  # (FOLLOWED, rollers) impacts and entries under way
    method: Any  # the implicit one with its work space
    trace: Trace  # begins at the time in the clock, infinite for never


class Tally(NamedTuple):
    """Sums and extremes over a batch. Arrays, changed in place."""

    work: NDArray[np.float64]  # (POWERS,) integrals of the powers [J]
    largest: NDArray[np.float64]  # (LOADS,) largest loads [N]
    largest_time: NDArray[np.float64]  # (LOADS,) and when [s]
    whirl: NDArray[np.float64]
    impacts: NDArray[np.float64]  # (rollers, IMPACT_SUMS)
    races: NDArray[np.float64]  # (SAMPLED, 2 + SAMPLE_BINS)


def carry_from(y: NDArray[np.float64], rollers: int, first_step: float, method: Any) -> Carry:
    """Memory of an integration from the state ``y`` on, which tries ``first_step`` [s] first."""
    clock = np.zeros(CLOCK)
    clock[STEP], clock[ERROR], clock[TRACED] = first_step, PI_START_ERROR, math.inf
    k, power, loads = (np.zeros((ROWS, columns)) for columns in (y.size, POWERS, state.LOADS))
    counts = np.zeros(COUNTS, dtype=np.int64)
    followed, stiffness, trace = np.zeros((state.FOLLOWED, rollers)), np.zeros(STIFFNESS), trace_of([], math.inf, 0)
    return Carry(
        y, k, np.zeros(y.size), power, loads, scratch(rollers), clock, counts, stiffness, followed, method, trace
    )


def empty_tally(rollers: int, followed: bool = True, sampled: bool = True) -> Tally:
    """A tally of nothing of so many rollers; without sums of impacts unless these are ``followed``, of race contacts unless ``sampled``."""
    impacts = np.zeros((rollers * followed, state.IMPACT_SUMS))
    races = np.zeros((state.SAMPLED * sampled, state.SAMPLES_TOTAL + 1 + state.SAMPLE_BINS))
    return Tally(np.zeros(POWERS), np.zeros(state.LOADS), np.zeros(state.LOADS), np.zeros(WHIRL), impacts, races)


SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0


@kernel
def after_accepted(method, clock, h, cut, error, refused, largest_step):
    """Set the step after one of ``h`` [s] that was accepted.

    ``cut``: it ended early, so the step before the cut may still be right; ``refused``: the trial before was refused, so the
    step must not grow.
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


@kernel
def row_sum(k, row, n):
    """Sum of a row: four sums side by side, in an order that no compiler chooses."""
    vectors = n // 4 * 4
    sum_0 = sum_1 = sum_2 = sum_3 = 0.0
    for i in range(0, vectors, 4):
        sum_0 += k[row, i]
        sum_1 += k[row, i + 1]
        sum_2 += k[row, i + 2]
        sum_3 += k[row, i + 3]
    for i in range(vectors, n):
        sum_0 += k[row, i]
    return (sum_0 + sum_1) + (sum_2 + sum_3)


@routine
def worst_component(method, k, h, inverse_tolerance):
    """Component that limits the step: the first that is not finite, else the one of the largest error."""
    worst, largest = 0, -1.0
    for i in range(inverse_tolerance.size):
        e = abs(step_error(method, k, h, i)) * inverse_tolerance[i]
        if not math.isfinite(e):
            return i
        if e > largest:
            worst, largest = i, e
    return worst


PEAK_POINTS = 8  # interior points for the peak of a step with a new largest pocket load


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
    values[0, point] = loads[row, state.POCKET_LOAD]
    values[1, point] = loads[row, state.POCKET_CONTACT_LOAD]


@routine
def book_peaks(values, start, h, tally):
    """Book the peaks of both pocket loads, sampled at even points of a step of ``h`` [s] from ``start`` on.

    The peak is the largest sample, or the vertex of the parabola through it and its neighbours. It counts where it is larger
    than any before.
    """
    last = values.shape[1] - 1
    # Of a length that the compiler does not know: unrolled, this would be compiled twice.
    for row in range(values.shape[0]):
        force = state.POCKET_CONTACT_LOAD if row else state.POCKET_LOAD
        best, place, spacing = 0.0, 0, 1.0 / last
        for p in range(last + 1):
            if values[row, p] > best:
                best, place = values[row, p], p
        theta = place * spacing
        if 0 < place < last:
            before, after = values[row, place - 1], values[row, place + 1]
            bend = before - 2.0 * best + after
            if bend < 0.0:
                shift = 0.5 * (before - after) / bend
                best -= 0.25 * (before - after) * shift
                theta += shift * spacing
        if best > tally.largest[force]:
            tally.largest[force] = best
            tally.largest_time[force] = start + theta * h


TEST_EVERY = 8  # Every eighth step is tested for stiffness.


@routine
def refine_peak(bearing, carry, h, tally):
    """Search a step for its largest pocket loads: eight points, then the vertex of a parabola."""
    method, y, stage, k, loads = carry.method, carry.y, carry.stage, carry.k, carry.loads
    values = np.empty((2, PEAK_POINTS + 2))
    inside = np.empty_like(y)
    book_point(values, 0, loads, 0)
    book_point(values, PEAK_POINTS + 1, loads, method.last)
    spacing = 1.0 / (PEAK_POINTS + 1)
    for p in range(1, PEAK_POINTS + 1):
        for i in range(y.size):
            inside[i] = interpolate(method, y, stage, k, h, p * spacing, i)
        to_fixed_axes_at(method, carry.clock, p * spacing * h, bearing.rollers, inside)
        pocket_loads(bearing, inside, method.free, loads, carry.scratch)
        book_point(values, p, loads, method.free)
    book_peaks(values, carry.clock[NOW], h, tally)


@routine
def book_trace(carry, h):
    """Book the samples of the trace within a step of ``h`` [s], as far as there is room."""
    trace, clock, method = carry.trace, carry.clock, carry.method
    while clock[TRACED] <= clock[NOW] + h:
        row = trace.counts[0]
        if row < trace.samples.shape[0]:
            theta = (clock[TRACED] - clock[NOW]) / h
            for c in range(trace.components.size):
                i = trace.components[c]
                trace.samples[row, c] = interpolate(method, carry.y, carry.stage, carry.k, h, theta, i)
            trace.counts[0] += 1
            trace.counts[1] += carry.loads[method.last, state.INNER_LOAD] > 0.0
        clock[TRACED] += trace.spacing


@kernel
def keep(method, body, y, stage, k, power, loads, clock, work, largest, largest_time, whirl, h, sample_step):
    """Book an accepted step: work, largest loads, samples; the cage's coordinates begin at ``body``.

    Returns whether a stage saw a new largest pocket load.
    """
    for p in range(POWERS):
        work[p] += work_done(method, power, h, p)
    time = clock[NOW]
    on_wall = contact = 0.0
    for s in range(1, method.last + 1):
        on_wall = max(on_wall, loads[s, state.POCKET_LOAD])
        contact = max(contact, loads[s, state.POCKET_CONTACT_LOAD])
    for force in range(state.LOADS):
        if loads[method.last, force] > largest[force]:
            largest[force] = loads[method.last, force]
            largest_time[force] = time + h
    while clock[SAMPLE] <= time + h:
        theta = (clock[SAMPLE] - time) / h
        cage_x = interpolate(method, y, stage, k, h, theta, body + state.CAGE_X)
        cage_y = interpolate(method, y, stage, k, h, theta, body + state.CAGE_Y)
        vx = interpolate(method, y, stage, k, h, theta, body + state.CAGE_VX)
        vy = interpolate(method, y, stage, k, h, theta, body + state.CAGE_VY)
        book_whirl(whirl, cage_x, cage_y, vx, vy)
        clock[SAMPLE] += sample_step
    return on_wall > largest[state.POCKET_LOAD] or contact > largest[state.POCKET_CONTACT_LOAD]


@kernel
def end_to_start(method, y, stage, k, power, loads):
    """Make the end of a step the start of the next one."""
    for i in range(y.size):
        y[i] = stage[i]
        k[0, i] = k[method.last, i]
    for p in range(POWERS):
        power[0, p] = power[method.last, p]
    for force in range(state.LOADS):
        loads[0, force] = loads[method.last, force]


@entry
def advance(bearing, control, carry, tally, t_end, sample_step):
    """Integrate from the time in ``carry`` to ``t_end`` [s]; returns FINISHED or why not: see ``Status``.

    Steps end exactly at ``t_end``. On any other status ``carry`` holds the last good state, and
    ``carry.counts[WORST]`` the component that made it impossible.
    """
    # References to arrays are counted here, in atomic instructions, and nowhere in the steps.
    return steps_to(bearing, control, carry, tally, t_end, sample_step)


@routine
def steps_to(bearing, control, carry, tally, t_end, sample_step):
    """``advance`` without references to count."""
    y, k, stage, clock, counts = carry.y, carry.k, carry.stage, carry.clock, carry.counts
    power, loads, scratch, stiffness = carry.power, carry.loads, carry.scratch, carry.stiffness
    work, largest, largest_time, whirl = tally.work, tally.largest, tally.largest_time, tally.whirl
    followed, impacts = carry.followed, tally.impacts
    inverse_tolerance, method = control.inverse_tolerance, carry.method
    z = roller_count(bearing)
    worst = begin(method, bearing, y, k, power, loads, scratch, clock, counts)
    if worst >= 0:
        counts[WORST] = worst
        return NOT_FINITE
    refused = False
    while clock[NOW] < t_end:
        if counts[ACCEPTED] + counts[REJECTED] >= control.step_budget:
            return STEP_BUDGET
        remaining = t_end - clock[NOW]
        cut = clock[STEP] >= remaining
        h = remaining if cut else clock[STEP]
        trial_step(method, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h)
        error = error_norm(method, k, h, inverse_tolerance)
        if error <= 1.0:
            if counts[ACCEPTED] % TEST_EVERY == 0:
                test_stiffness(method, k, stiffness, h, inverse_tolerance)
            end_step(method, bearing, stage, k, power, loads, scratch, counts)
            book_impacts(bearing.impacts, bearing, y, scratch.gap, followed, impacts)
            if keep(
                method,
                state.ROLLER_STATES * z,
                y,
                stage,
                k,
                power,
                loads,
                clock,
                work,
                largest,
                largest_time,
                whirl,
                h,
                sample_step,
            ):
                refine_peak(bearing, carry, h, tally)
            if clock[TRACED] <= clock[NOW] + h:
                book_trace(carry, h)
            # At the end of the step that is nearest: always the next one would be half a step late.
            clock[RACES] = book_races(
                bearing.samples, bearing, stage, clock[NOW] + 1.5 * h, clock[RACES], followed, tally.races
            )
            counts[ACCEPTED] += 1
            clock[NOW] = t_end if cut else clock[NOW] + h
            end_to_start(method, y, stage, k, power, loads)
            next_frame(method, clock, h, z, y, k)
            after_accepted(method, clock, h, cut, error, refused, control.largest_step)
            refused = False
        else:
            counts[REJECTED] += 1
            refused = True
            shorter = shortened(method, h, error)
            if shorter < control.smallest_step:
                counts[WORST] = worst_component(method, k, h, inverse_tolerance)
                return STEP_UNDERFLOW if math.isfinite(error) else NOT_FINITE
            clock[STEP] = shorter
    return FINISHED


@law
def begin(method, bearing, y, k, power, loads, scratch, clock, counts):
    """Compute what a step needs of the state and ``Carry`` lacks. Returns the first component that is not finite, else -1."""


@law
def trial_step(method, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h):
    """Stages of a step of ``h`` [s] from ``y``; the end state goes to ``stage``. ``refused``: the last trial from here was."""


@law
def error_norm(method, k, h, inverse_tolerance):
    """Norm of the embedded error over the tolerances: a sum of squares, so that any NaN comes through."""


@law
def step_error(method, k, h, i):
    """Embedded error of component ``i``."""


@law
def test_stiffness(method, k, stiffness, h, inverse_tolerance):
    """Book whether stability, not accuracy, limits an accepted step."""


@law
def end_step(method, bearing, stage, k, power, loads, scratch, counts):
    """Fill row ``last``, which belongs to the end of an accepted step, and what its dense output needs."""


@law
def interpolate(method, y, end, k, h, theta, i):
    """Component ``i`` at the fraction ``theta`` of the step from ``y`` to ``end``."""


@law
def work_done(method, power, h, p):
    """Integral of power ``p`` over the step [J]."""


@law
def to_fixed_axes_at(method, clock, time, z, y):
    """Turn an interpolated state at a time [s] since the start of the step into the fixed axes."""


@law
def next_frame(method, clock, h, z, y, k):
    """From the frame of a step of ``h`` [s] to that of the next one, whose start ``y`` and row 0 are."""
