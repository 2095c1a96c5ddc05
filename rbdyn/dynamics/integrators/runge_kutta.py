"""Explicit Runge-Kutta pairs: first-same-as-last, dense output; Hairer, Norsett and Wanner, Solving ODEs I, II.4.

The pairs stand in modules of their own. Loss powers are integrated with the main weights from the same stages, so that the
power balance tests the integrator too. The rollers are integrated in a frame that turns with them through one step.

Rollers run round the bearing thousands of times farther than they move against each other. In fixed axes a step must
follow that circle, and its stages, which cut the corner, jolt the stiff race contacts; in a frame that turns with
the rollers they all but stand still. So their coordinates are integrated in such a frame, an exact change of variables
(Lawson 1967, for a linear part that is a rotation), while forces are still those of the fixed axes.

The frame stands in the fixed axes at the start of the step and has turned by phi at the time t of the step, with
tan(phi/2) = rate t/2: cosine, sine and speed of such a turn are rational, and it is as smooth.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import kernel, routine
from rbdyn.dynamics.forces.equations import derivative, roller_count
from rbdyn.dynamics.integrators import method_laws as laws
from rbdyn.dynamics.integrators.dormand_prince import DormandPrince
from rbdyn.dynamics.integrators.kutta_pair import Kutta
from rbdyn.dynamics.integrators.method_laws import mean_rate, quartic_rate, rate_error, stage_state, tableau
from rbdyn.dynamics.integrators.records import DERIVATIVES, EIGENVALUES, FRAME, HELD, LOOKED_AT


class Turn(NamedTuple):
    """Frame at one time: cosine and sine of its angle and its speed [rad/s]."""

    cosine: float
    sine: float
    speed: float


@kernel
def turn_of(rate, time):
    """Frame of ``rate`` [rad/s] at a time [s] since the start of the step."""
    tangent = 0.5 * rate * time
    share = 1.0 / (1.0 + tangent * tangent)
    return Turn((1.0 - tangent * tangent) * share, 2.0 * tangent * share, rate * share)


@kernel
def mean_orbit_rate(z, y):
    """Angular momentum of all rollers about the origin over their moment of inertia [rad/s]."""
    momentum = inertia = 0.0
    for j in range(z):
        momentum += y[j] * y[3 * z + j] - y[z + j] * y[2 * z + j]
        inertia += y[j] * y[j] + y[z + j] * y[z + j]
    return momentum / inertia


@kernel
def turned(turn, along, across):
    """A vector of the frame in the fixed axes."""
    return turn.cosine * along - turn.sine * across, turn.sine * along + turn.cosine * across


@kernel
def seen(turn, x_rate, y_rate, x, y):
    """What the frame sees of the rate of change of a vector (x, y)."""
    x_rate, y_rate = x_rate + turn.speed * y, y_rate - turn.speed * x
    return turn.cosine * x_rate + turn.sine * y_rate, turn.cosine * y_rate - turn.sine * x_rate


@kernel
def to_fixed_axes(turn, z, y):
    """Turn positions and velocities of the rollers in ``y`` from the frame into the fixed axes."""
    for i in range(z):
        y[i], y[z + i] = turned(turn, y[i], y[z + i])
        y[2 * z + i], y[3 * z + i] = turned(turn, y[2 * z + i], y[3 * z + i])


@kernel
def rates_to_frame(turn, z, y, row, dy):
    """Turn rates of change of the rollers in row ``row`` of ``dy`` into those that the frame sees; ``y``: fixed axes."""
    for i in range(z):
        dy[row, i], dy[row, z + i] = seen(turn, dy[row, i], dy[row, z + i], y[i], y[z + i])
        dy[row, 2 * z + i], dy[row, 3 * z + i] = seen(
            turn, dy[row, 2 * z + i], dy[row, 3 * z + i], y[2 * z + i], y[3 * z + i]
        )


@kernel
def rates_to_fixed_axes(turn, z, y, row, dy):
    """Inverse of ``rates_to_frame``."""
    for first in (0, 2 * z):
        for i in range(first, first + z):
            along, across = turned(turn, dy[row, i], dy[row, z + i])
            dy[row, i], dy[row, z + i] = along - turn.speed * y[z + i], across + turn.speed * y[i]


PAIRS = (DormandPrince, Kutta)


@kernel
def begin_step(z, y, k):
    """Rate of the frame [rad/s] of the step from ``y``, whose first stage, given in fixed axes, is turned into it."""
    rate = mean_orbit_rate(z, y)
    rates_to_frame(turn_of(rate, 0.0), z, y, 0, k)
    return rate


@laws.begin.body(*PAIRS)
def _(pair, bearing, y, k, power, loads, scratch, clock, counts):
    if counts[DERIVATIVES] == 0:
        for i in range(y.size):
            if not math.isfinite(y[i]):
                return i
        clock[FRAME] = mean_orbit_rate(roller_count(bearing), y)
    return -1


@laws.trial_step.body(*PAIRS)
def _(pair, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h):
    # One loop of a length the compiler does not know: unrolled, the derivatives overflow the instruction cache. The first
    # step of all begins with its first row.
    z, rate = roller_count(bearing), clock[FRAME]
    _, nodes = tableau(pair)
    first = 0 if counts[DERIVATIVES] == 0 else 1
    for s in range(first, pair.last + 1):
        turn = turn_of(rate, nodes[s] * h)
        stage_state(pair, s, y, k, h, stage)
        to_fixed_axes(turn, z, stage)
        derivative(bearing, stage, s, k, power, loads, scratch)
        rates_to_frame(turn, z, stage, s, k)
    counts[DERIVATIVES] += pair.last + 1 - first


@laws.error_norm.body(*PAIRS)
def _(pair, k, h, inverse_tolerance):
    # Squares in vectors, into a row that is free; then four sums side by side, in an order that no compiler chooses.
    n, squares = inverse_tolerance.size, pair.free
    for i in range(n):
        e = rate_error(pair, k, i) * inverse_tolerance[i]
        k[squares, i] = e * e
    whole = n // 4 * 4
    sum_0 = sum_1 = sum_2 = sum_3 = 0.0
    for i in range(0, whole, 4):
        sum_0 += k[squares, i]
        sum_1 += k[squares, i + 1]
        sum_2 += k[squares, i + 2]
        sum_3 += k[squares, i + 3]
    for i in range(whole, n):
        sum_0 += k[squares, i]
    return h * math.sqrt((sum_0 + sum_1) + (sum_2 + sum_3))


@laws.step_error.body(*PAIRS)
def _(pair, k, h, i):
    return h * rate_error(pair, k, i)


@laws.interpolate.body(*PAIRS)
def _(pair, y, end, k, h, theta, i):
    # To the order of the pair less one; rollers' in the frame of the step.
    difference = h * mean_rate(pair, k, i)
    slope = h * k[0, i] - difference
    curve = difference - h * k[pair.last, i] - slope
    quartic = h * quartic_rate(pair, k, i)
    rest = 1.0 - theta
    return y[i] + theta * (difference + rest * (slope + theta * (curve + rest * quartic)))


@laws.end_step.body(*PAIRS)
def _(pair, bearing, stage, k, power, loads, scratch, counts):
    pass


@laws.work_done.body(*PAIRS)
def _(pair, power, h, p):
    return h * mean_rate(pair, power, p)


@laws.to_fixed_axes_at.body(*PAIRS)
def _(pair, clock, time, z, y):
    to_fixed_axes(turn_of(clock[FRAME], time), z, y)


@laws.next_frame.body(*PAIRS)
def _(pair, clock, h, z, y, k):
    rates_to_fixed_axes(turn_of(clock[FRAME], h), z, y, 0, k)
    clock[FRAME] = begin_step(z, y, k)


@laws.look_at_stiffness.body(*PAIRS)
def _(pair, k, stiffness, h, inverse_tolerance):
    compare_last_stages(pair, k, stiffness, h, inverse_tolerance)


@routine
def compare_last_stages(pair, k, stiffness, h, inverse_tolerance):
    """Book whether stability holds the step: |eigenvalue| = |difference of rates|/|difference of states| over the
    tolerances, of the last two stages, both at the end of the step (Hairer and Wanner, Solving ODEs II, IV.2).
    """
    last, (weights, _), way = pair.last, tableau(pair), pair.free
    for i in range(inverse_tolerance.size):
        k[way, i] = 0.0
    for s in range(last):
        weight = weights[last, s] - weights[last - 1, s]
        if weight != 0.0:
            for i in range(inverse_tolerance.size):
                k[way, i] += weight * k[s, i]
    rates = places = 0.0
    for i in range(inverse_tolerance.size):
        rate = (k[last, i] - k[last - 1, i]) * inverse_tolerance[i]
        place = k[way, i] * (h * inverse_tolerance[i])
        rates += rate * rate
        places += place * place
    stiffness[LOOKED_AT] += 1.0
    if h * h * rates > pair.limit * pair.limit * places > 0.0:
        stiffness[HELD] += 1.0
        stiffness[EIGENVALUES] += math.sqrt(rates / places)
