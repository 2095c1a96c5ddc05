"""Dormand and Prince's pair of order 5(4): six right-hand sides a step, first-same-as-last.

Dormand and Prince 1980; continuous extension after Hairer, Norsett and Wanner, Solving ODEs I, II.6.
"""

from typing import NamedTuple

import numpy as np

from rbdyn.compiled.elementary import fma
from rbdyn.dynamics.integrators.method_laws import (
    early_stage_state,
    mean_rate,
    quartic_rate,
    rate_error,
    stage_state,
    tableau,
)

A = np.array(
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
C = np.array([0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1])
B1, B3, B4, B5, B6 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
E1, E3, E4, E5, E6, E7 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
D1, D3, D4 = -12715105075 / 11282082432, 87487479700 / 32700410799, -10690763975 / 1880347072
D5, D6, D7 = 701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423


class DormandPrince(NamedTuple):
    """The pair of order 5(4), six right-hand sides a step; fields as in ``method_laws``."""

    last: int = 6
    free: int = 7
    exponent: float = 0.2 - 0.75 * 0.04
    beta: float = 0.04
    rejected: float = 0.2
    # Stable up to 3.3 for decay and about 2.4 for a loaded contact that vibrates.
    limit: float = 2.0


@tableau.body(DormandPrince)
def _(pair):
    return A, C


@mean_rate.body(DormandPrince)
def _(pair, rows, i):
    return B1 * rows[0, i] + B3 * rows[2, i] + B4 * rows[3, i] + B5 * rows[4, i] + B6 * rows[5, i]


@rate_error.body(DormandPrince)
def _(pair, k, i):
    return E1 * k[0, i] + E3 * k[2, i] + E4 * k[3, i] + E5 * k[4, i] + E6 * k[5, i] + E7 * k[6, i]


@quartic_rate.body(DormandPrince)
def _(pair, k, i):
    return D1 * k[0, i] + D3 * k[2, i] + D4 * k[3, i] + D5 * k[4, i] + D6 * k[5, i] + D7 * k[6, i]


@stage_state.body(DormandPrince)
def _(pair, s, y, k, h, state):
    n = y.size
    w0, w1, w2, w3, w4, w5 = h * A[s, 0], h * A[s, 1], h * A[s, 2], h * A[s, 3], h * A[s, 4], h * A[s, 5]
    if s <= 3:
        early_stage_state(s, y, k, w0, w1, w2, state)
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
