"""What ``runge_kutta`` asks of an embedded pair. Each is a law, so that stages and weights are compiled in.

A pair is a method as in ``method_laws``, and has h |eigenvalue| from which stability is said to hold a step, ``limit``.
"""

from rbdyn.compiled.elementary import fma
from rbdyn.compiled.kernel import kernel, law


@law
def tableau(pair):
    """Weights: row s holds those of the rows before it in the state at which row s is evaluated, the last ones make the
    new state. Nodes: time of each row since the start of the step, over its size.
    """


@law
def stage_state(pair, s, y, k, h, state):
    """State at which row ``s`` is evaluated. One pass a stage: rows of weight zero may hold anything."""


@kernel
def early_stage_state(s, y, k, w0, w1, w2, state):
    """``stage_state`` of rows 0 to 3 by the weights of rows 0 to 2, times the step."""
    n = y.size
    if s == 0:
        for i in range(n):
            state[i] = y[i]
    elif s == 1:
        for i in range(n):
            state[i] = fma(w0, k[0, i], y[i])
    elif s == 2:
        for i in range(n):
            state[i] = fma(w1, k[1, i], fma(w0, k[0, i], y[i]))
    else:
        for i in range(n):
            state[i] = fma(w2, k[2, i], fma(w1, k[1, i], fma(w0, k[0, i], y[i])))


@law
def mean_rate(pair, rows, i):
    """Mean over the step of rate ``i``, by the main weights."""


@law
def rate_error(pair, k, i):
    """Main less embedded mean of rate ``i``."""


@law
def quartic_rate(pair, k, i):
    """What the dense output adds to the cubic through values and slopes at both ends: coefficient of theta^2 (1 - theta)^2."""
