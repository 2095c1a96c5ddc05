"""Kutta's 3/8 rule with its embedded third order: four right-hand sides a step, first-same-as-last.

Kutta 1901; Hairer, Norsett and Wanner, Solving ODEs I, II.1 and II.4. A right-hand side of it carries a step a quarter
(decay) and three quarters (vibration) farther than one of Dormand and Prince before stability holds it, so it is the
cheaper one where that does. The dense output is the cubic through values and slopes at both ends, third-order accurate.
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

A = np.array([[0, 0, 0, 0], [1 / 3, 0, 0, 0], [-1 / 3, 1, 0, 0], [1, -1, 1, 0], [1 / 8, 3 / 8, 3 / 8, 1 / 8]])
C = np.array([0, 1 / 3, 2 / 3, 1, 1])
B1, B2, B3, B4 = 1 / 8, 3 / 8, 3 / 8, 1 / 8
E1, E2, E3, E4, E5 = 1 / 24, -1 / 8, 1 / 8, 1 / 8, -1 / 6


class Kutta(NamedTuple):
    """The pair. The PI controller is Gustafsson's (0.7 and 0.4 over the order of the error): with the milder one of the
    other pair every sixth step held by stability is refused."""

    last: int = 4
    free: int = 5
    exponent: float = 0.7 / 4
    beta: float = 0.4 / 4
    rejected: float = 1 / 4
    # Stable up to 2.8 both for decay and for vibration.
    limit: float = 2.3


@tableau.body(Kutta)
def _(pair):
    return A, C


@stage_state.body(Kutta)
def _(pair, s, y, k, h, state):
    n = y.size
    w0, w1, w2, w3 = h * A[s, 0], h * A[s, 1], h * A[s, 2], h * A[s, 3]
    if s <= 3:
        early_stage_state(s, y, k, w0, w1, w2, state)
    else:
        for i in range(n):
            state[i] = fma(w3, k[3, i], fma(w2, k[2, i], fma(w1, k[1, i], fma(w0, k[0, i], y[i]))))


@mean_rate.body(Kutta)
def _(pair, rows, i):
    return B1 * rows[0, i] + B2 * rows[1, i] + B3 * rows[2, i] + B4 * rows[3, i]


@rate_error.body(Kutta)
def _(pair, k, i):
    return E1 * k[0, i] + E2 * k[1, i] + E3 * k[2, i] + E4 * k[3, i] + E5 * k[4, i]


@quartic_rate.body(Kutta)
def _(pair, k, i):
    return 0.0
