"""Dormand and Prince's explicit pair of order 5(4), six right-hand sides a step: first-same-as-last, dense output.

After Hairer, Norsett and Wanner, Solving ODEs I, II.4 and for the continuous extension II.6.

The main weights integrate the powers of the losses from the same stages, so that the power balance tests the integrator
too.

Rollers run round the bearing thousands of times farther than they move against each other. In fixed axes a step would
follow that circle, and its stages, which cut the corner, would jolt the stiff race contacts. In a frame that turns with
the rollers they hardly move. So their coordinates are integrated in such a frame, from forces in fixed axes: an exact
change of variables (Lawson 1967, for a linear part that is a rotation). The frame coincides with the fixed axes at the
start of the step. At the time t of the step it has turned by phi, with tan(phi/2) = rate t/2: cosine, sine and speed of
such a turn are rational.
"""

import math
from typing import NamedTuple

import numpy as np

from rbdyn.compiled.elementary import fma
from rbdyn.compiled.kernel import kernel, routine
from rbdyn.dynamics.forces.equations import derivative, roller_count
from rbdyn.dynamics.integrators import advance as laws
from rbdyn.dynamics.integrators.advance import DERIVATIVES, EIGENVALUES, FRAME, LIMITED, TESTED

WEIGHTS = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
NODES = np.array([0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1])
B1, B3, B4, B5, B6 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
E1, E3, E4, E5, E6, E7 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
D1, D3, D4 = -12715105075 / 11282082432, 87487479700 / 32700410799, -10690763975 / 1880347072
D5, D6, D7 = 701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423


class DormandPrince(NamedTuple):
    """Fields as in ``advance``; ``limit``: h |eigenvalue| above which stability limits a step."""

    last: int = 6
    free: int = 7
    exponent: float = 0.2 - 0.75 * 0.04
    beta: float = 0.04
    rejected: float = 0.2
    # Stable up to 3.3 for decay and about 2.4 for a loaded contact that vibrates.
    limit: float = 2.0


@kernel
def mean_rate(rows, i):
    """Mean over the step of rate ``i``, by the main weights."""
    return B1 * rows[0, i] + B3 * rows[2, i] + B4 * rows[3, i] + B5 * rows[4, i] + B6 * rows[5, i]


@kernel
def rate_error(k, i):
    """Main less embedded mean of rate ``i``."""
    return E1 * k[0, i] + E3 * k[2, i] + E4 * k[3, i] + E5 * k[4, i] + E6 * k[5, i] + E7 * k[6, i]


@kernel
def quartic_rate(k, i):
    """Coefficient of theta^2 (1 - theta)^2 in the dense output, added to the cubic through values and slopes at both ends."""
    return D1 * k[0, i] + D3 * k[2, i] + D4 * k[3, i] + D5 * k[4, i] + D6 * k[5, i] + D7 * k[6, i]


@kernel
def stage_state(s, y, k, h, state):
    """State at which row ``s`` is evaluated. One pass a stage: rows of weight zero may hold anything."""
    n = y.size
    w0, w1, w2, w3, w4, w5 = (
        h * WEIGHTS[s, 0],
        h * WEIGHTS[s, 1],
        h * WEIGHTS[s, 2],
        h * WEIGHTS[s, 3],
        h * WEIGHTS[s, 4],
        h * WEIGHTS[s, 5],
    )
    if s == 0:
        for i in range(n):
            state[i] = y[i]
    elif s == 1:
        for i in range(n):
            state[i] = fma(w0, k[0, i], y[i])
    elif s == 2:
        for i in range(n):
            state[i] = fma(w1, k[1, i], fma(w0, k[0, i], y[i]))
    elif s == 3:
        for i in range(n):
            state[i] = fma(w2, k[2, i], fma(w1, k[1, i], fma(w0, k[0, i], y[i])))
    elif s == 4:
        for i in range(n):
            state[i] = fma(w3, k[3, i], fma(w2, k[2, i], fma(w1, k[1, i], fma(w0, k[0, i], y[i]))))
    elif s == 5:
        for i in range(n):
            early = fma(w2, k[2, i], fma(w1, k[1, i], w0 * k[0, i]))
            state[i] = y[i] + fma(w4, k[4, i], fma(w3, k[3, i], early))
    else:
        for i in range(n):
            early = fma(w3, k[3, i], fma(w2, k[2, i], w0 * k[0, i]))
            state[i] = y[i] + fma(w5, k[5, i], fma(w4, k[4, i], early))


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
def in_frame(turn, x_rate, y_rate, x, y):
    """Rate of change in the frame of a vector (x, y) of the fixed axes."""
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
    """Turn rates of change of the rollers in row ``row`` of ``dy`` into those in the frame; ``y``: fixed axes."""
    for i in range(z):
        dy[row, i], dy[row, z + i] = in_frame(turn, dy[row, i], dy[row, z + i], y[i], y[z + i])
        dy[row, 2 * z + i], dy[row, 3 * z + i] = in_frame(
            turn, dy[row, 2 * z + i], dy[row, 3 * z + i], y[2 * z + i], y[3 * z + i]
        )


@kernel
def rates_to_fixed_axes(turn, z, y, row, dy):
    """Inverse of ``rates_to_frame``."""
    for first in (0, 2 * z):
        for i in range(first, first + z):
            along, across = turned(turn, dy[row, i], dy[row, z + i])
            dy[row, i], dy[row, z + i] = along - turn.speed * y[z + i], across + turn.speed * y[i]


@kernel
def begin_step(z, y, k):
    """Rate of the frame [rad/s] of the step from ``y``, whose first stage, given in fixed axes, is turned into it."""
    rate = mean_orbit_rate(z, y)
    rates_to_frame(turn_of(rate, 0.0), z, y, 0, k)
    return rate


@laws.begin.body(DormandPrince)
def _(pair, bearing, y, k, power, loads, scratch, clock, counts):
    if counts[DERIVATIVES] == 0:
        for i in range(y.size):
            if not math.isfinite(y[i]):
                return i
        clock[FRAME] = mean_orbit_rate(roller_count(bearing), y)
    return -1


@laws.trial_step.body(DormandPrince)
def _(pair, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h):
    # One loop of a length that the compiler does not know: unrolled, the derivatives would overflow the instruction cache.
    # Only the very first step computes its first row.
    z, rate = roller_count(bearing), clock[FRAME]
    first = 0 if counts[DERIVATIVES] == 0 else 1
    for s in range(first, pair.last + 1):
        turn = turn_of(rate, NODES[s] * h)
        stage_state(s, y, k, h, stage)
        to_fixed_axes(turn, z, stage)
        derivative(bearing, stage, s, k, power, loads, scratch)
        rates_to_frame(turn, z, stage, s, k)
    counts[DERIVATIVES] += pair.last + 1 - first


@laws.error_norm.body(DormandPrince)
def _(pair, k, h, inverse_tolerance):
    # Squares in vectors, into a row that is free.
    n, squares = inverse_tolerance.size, pair.free
    for i in range(n):
        e = rate_error(k, i) * inverse_tolerance[i]
        k[squares, i] = e * e
    return h * math.sqrt(laws.row_sum(k, squares, n))


@laws.step_error.body(DormandPrince)
def _(pair, k, h, i):
    return h * rate_error(k, i)


@laws.interpolate.body(DormandPrince)
def _(pair, y, end, k, h, theta, i):
    # To the order of the pair less one; rollers' in the frame of the step.
    difference = h * mean_rate(k, i)
    slope = h * k[0, i] - difference
    curve = difference - h * k[pair.last, i] - slope
    quartic = h * quartic_rate(k, i)
    left = 1.0 - theta
    return y[i] + theta * (difference + left * (slope + theta * (curve + left * quartic)))


@laws.end_step.body(DormandPrince)
def _(pair, bearing, stage, k, power, loads, scratch, counts):
    pass


@laws.work_done.body(DormandPrince)
def _(pair, power, h, p):
    return h * mean_rate(power, p)


@laws.to_fixed_axes_at.body(DormandPrince)
def _(pair, clock, time, z, y):
    to_fixed_axes(turn_of(clock[FRAME], time), z, y)


@laws.next_frame.body(DormandPrince)
def _(pair, clock, h, z, y, k):
    rates_to_fixed_axes(turn_of(clock[FRAME], h), z, y, 0, k)
    clock[FRAME] = begin_step(z, y, k)


@laws.test_stiffness.body(DormandPrince)
def _(pair, k, stiffness, h, inverse_tolerance):
    compare_last_stages(pair, k, stiffness, h, inverse_tolerance)


@routine
def compare_last_stages(pair, k, stiffness, h, inverse_tolerance):
    """Book whether stability limits the step (Hairer and Wanner, Solving ODEs II, IV.2).

    |eigenvalue| = |difference of rates|/|difference of states| over the tolerances, of the last two stages, which are both at
    the end of the step.
    """
    last, way = pair.last, pair.free
    for i in range(inverse_tolerance.size):
        k[way, i] = 0.0
    for s in range(last):
        change = WEIGHTS[last, s] - WEIGHTS[last - 1, s]
        if change != 0.0:
            for i in range(inverse_tolerance.size):
                k[way, i] += change * k[s, i]
    rates = places = 0.0
    for i in range(inverse_tolerance.size):
        rate = (k[last, i] - k[last - 1, i]) * inverse_tolerance[i]
        place = k[way, i] * (h * inverse_tolerance[i])
        rates += rate * rate
        places += place * place
    stiffness[TESTED] += 1.0
    if h * h * rates > pair.limit * pair.limit * places > 0.0:
        stiffness[LIMITED] += 1.0
        stiffness[EIGENVALUES] += math.sqrt(rates / places)
