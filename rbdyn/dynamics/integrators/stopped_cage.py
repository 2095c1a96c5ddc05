"""A cage that the oil film of its land stops within a step of ``verlet``: its speeds are implicit in that film.

The film of a land resists the motion of the cage's centre with a force C v, so that it stops a cage of mass m at rates D = C/m.
In thick oil these are the fastest of a bearing: 1.4e6 1/s in an NU 2212 at 300 rpm in oil of VG 220 at 0 C, where contacts
vibrate at 3e5 rad/s. An explicit step would have to be shorter than 1/2 over them. From the forces with the speeds v* predicted,
and with the share theta of the rates at the end, one iteration of Newton's method gives

    v* = v_0 + (I + theta h D_0)^-1 h a_0,        x_1 = x_0 + h (v_0 + v*)/2,
    d = (I + theta h D_1)^-1 (v_0 + h (1 - theta) a_0 + h theta a_1* - v*),
    v_1 = v* + d,        a_1 = a_1* - D_1 d.

With theta = (3 + z)/(6 + z), z = h tr D, a constant rate z/h stops by (6 - 2 z)/(6 + 4 z + z^2), Pade's approximation of exp(-z):
exact to third order, and zero at infinity (Hairer and Wanner, Solving ODEs II, IV.3). Bodies on the other side of the film are
heavier, and explicit.
"""

from rbdyn.compiled.kernel import kernel
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.equations import roller_count

# h tr D above which the speeds are implicit. Below, the formulas of ``verlet`` are stable.
STIFF = 0.25
# Rows of ``Scratch.resistance``: at the latest right-hand side, and at the start of the step.
LATEST, AT_START = range(2)
# Rows of ``Carry.k``, as in ``verlet``.
START, END = range(2)


@kernel
def keep_resistance(scratch):
    """Make the latest resistance of the film that at the start of the next step."""
    for i in range(scratch.resistance.shape[1]):
        scratch.resistance[AT_START, i] = scratch.resistance[LATEST, i]


@kernel
def stop_in_step(bearing, scratch, row, h):
    """h tr D of a step of ``h`` [s]."""
    return h * (scratch.resistance[row, 0] + scratch.resistance[row, 2]) / bearing.cage.mass


@kernel
def share_at_end(bearing, scratch, row, h):
    """Share theta of the rates at the end of a step of ``h`` [s]."""
    stiffness = stop_in_step(bearing, scratch, row, h)
    return (3.0 + stiffness) / (6.0 + stiffness)


@kernel
def stopped(bearing, scratch, row, duration, x, y):
    """(I + D times the ``duration`` [s])^-1 (x, y)."""
    per_mass = duration / bearing.cage.mass
    xx, xy = 1.0 + per_mass * scratch.resistance[row, 0], per_mass * scratch.resistance[row, 1]
    yy = 1.0 + per_mass * scratch.resistance[row, 2]
    inverse = 1.0 / (xx * yy - xy * xy)
    return inverse * (yy * x - xy * y), inverse * (xx * y - xy * x)


@kernel
def cage_of(bearing, y):
    """Centre of the cage in a state, x and y [m], and its velocity [m/s]."""
    body = state.ROLLER_STATES * roller_count(bearing)
    return y[body + state.CAGE_X], y[body + state.CAGE_Y], y[body + state.CAGE_VX], y[body + state.CAGE_VY]


@kernel
def keep_cage(bearing, x, y, vx, vy, end):
    """Write what ``cage_of`` returns to a state."""
    body = state.ROLLER_STATES * roller_count(bearing)
    end[body + state.CAGE_X], end[body + state.CAGE_Y] = x, y
    end[body + state.CAGE_VX], end[body + state.CAGE_VY] = vx, vy


@kernel
def predict_cage(bearing, scratch, h, y, k, end):
    """Predict the cage at the end of a step of ``h`` [s]: x_1 and v*."""
    speed = state.ROLLER_STATES * roller_count(bearing) + state.CAGE_VX
    duration = h * share_at_end(bearing, scratch, AT_START, h)
    dx, dy = stopped(bearing, scratch, AT_START, duration, h * k[START, speed], h * k[START, speed + 1])
    x, y_, vx, vy = cage_of(bearing, y)
    keep_cage(bearing, x + h * (vx + 0.5 * dx), y_ + h * (vy + 0.5 * dy), vx + dx, vy + dy, end)


@kernel
def correct_cage(bearing, scratch, h, y, k, predicted, end):
    """Correct the speeds of a ``predicted`` cage, and its rates at the end of the step of ``h`` [s]."""
    speed = state.ROLLER_STATES * roller_count(bearing) + state.CAGE_VX
    x, y_, vx, vy = predicted
    share = share_at_end(bearing, scratch, LATEST, h)
    missing_x = y[speed] - vx + h * ((1.0 - share) * k[START, speed] + share * k[END, speed])
    missing_y = y[speed + 1] - vy + h * ((1.0 - share) * k[START, speed + 1] + share * k[END, speed + 1])
    dx, dy = stopped(bearing, scratch, LATEST, share * h, missing_x, missing_y)
    k[END, speed] += (dx - missing_x) / (share * h)
    k[END, speed + 1] += (dy - missing_y) / (share * h)
    keep_cage(bearing, x, y_, vx + dx, vy + dy, end)
