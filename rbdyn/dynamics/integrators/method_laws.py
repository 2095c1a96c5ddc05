"""What the loop of ``advance`` asks of a method, and ``runge_kutta`` of an embedded pair. Each is a law, so that stages and weights are
compiled in.

A method is a NamedTuple: ``last``, the row of ``Carry.k`` at the end of the step, which is the first of the next one;
``free``, a row of no stage that is needed once a step was tried; the ``exponent`` of the error of this step and ``beta`` of
the one before in the control of the step, ``rejected`` that of the error of a step that is refused.

A pair is a method that also has ``limit``: h |eigenvalue| from which stability is said to hold a step.
"""

from rbdyn.compiled.elementary import fma
from rbdyn.compiled.kernel import kernel, law


@law
def begin(method, bearing, y, k, power, loads, scratch, clock, counts):
    """What a step needs of the state, where it is not carried along. Returns its first component that is not finite, else -1."""


@law
def trial_step(method, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h):
    """Stages of a step of ``h`` [s] from ``y``; the end state is left in ``stage``. ``refused``: the last trial from here was."""


@law
def error_norm(method, k, h, inverse_tolerance):
    """Norm of the embedded error over the tolerances: a sum of squares, so that any NaN comes through."""


@law
def step_error(method, k, h, i):
    """Embedded error of component ``i``."""


@law
def look_at_stiffness(method, k, stiffness, h, inverse_tolerance):
    """Book whether stability, not accuracy, holds an accepted step."""


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
