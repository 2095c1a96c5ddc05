"""A cage that the oil film of its land stops within a step of ``verlet``: its speeds are implicit in that film.

The film of a land resists the relative motion u of cage and ring with a force C u. So it stops them at rates D = C (1/m + 1/M), with the
masses m of the cage and M of the ring, infinite where that is held. In thick oil these are the fastest of a bearing: 1.4e6 1/s in an
NU 2212 at 300 rpm in oil of VG 220 at 0 C, where contacts vibrate at 3e5 rad/s. An explicit step would have to be shorter than 1/2
over them. From the forces with the speeds v* predicted, and with the share theta of the rates at the end, one iteration of Newton's
method gives for the relative motion

    u* = u_0 + (I + theta h D_0)^-1 h a_0,
    d = (I + theta h D_1)^-1 (u_0 + h (1 - theta) a_0 + h theta a_1* - u*),
    u_1 = u* + d,        a_1 = a_1* - D_1 d.

Each body has its share of these changes, so that their momentum remains, and moves by x_1 = x_0 + h (v_0 + v*)/2. The share theta is
1/2 up to z = h tr D = 6, and 2/3 - 1/z beyond, where a constant rate reverses half of u in a step. The trapezoidal rule errs by h^3/12
of the second change of the small resultant of film and contacts. Pade's approximation (3 + z)/(6 + z), though exact to third order for a
decay, errs by that of the large contact forces alone: ten times as much at the same steps, which took 7 % off the impacts of a bearing with
a PEEK cage on its inner ring at -10 C (Hairer and Wanner, Solving ODEs II, IV.15).
"""

from typing import NamedTuple

from rbdyn.compiled.kernel import kernel, law_of
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.bodies import HeldRing, SupportedRing
from rbdyn.dynamics.forces.cage import InnerGuide, NoGuide, OuterGuide
from rbdyn.dynamics.forces.equations import roller_count

# h tr D above which the speeds are implicit. Below, the formulas of ``verlet`` are stable.
STIFF = 0.25
# Share of the relative motion that a step reverses, at most.
REVERSED = 0.5
# Rows of ``Scratch.resistance``: at the latest right-hand side, and at the start of the step.
LATEST, AT_START = range(2)
# Rows of ``Carry.k`` in ``verlet``: rates at the start and at the end of the step and at the start of the step before, the errors,
# and the predicted state, until the row is needed for squares.
START, END, PAST, ERROR, PREDICTED = range(5)


class Partner(NamedTuple):
    """The ring on the other side of the film: places of its centre and of that one's speed in the state, and 1/mass [1/kg].

    A held ring has the place -1.
    """

    place: int
    speed: int
    per_mass: float


@law_of(HeldRing)
def outer_partner(ring):
    """The outer ring as a ``Partner``."""
    return Partner(-1, -1, 0.0)


@outer_partner.body(SupportedRing)
def _(ring):
    return Partner(ring.start + state.SUPPORT_X, ring.start + state.SUPPORT_VX, 1.0 / ring.mass)


@law_of(NoGuide)
def partner_of(guide, bearing):
    """The ``Partner`` of the cage."""
    return Partner(-1, -1, 0.0)


@partner_of.body(OuterGuide)
def _(guide, bearing):
    return outer_partner(bearing.outer_ring)


@partner_of.body(InnerGuide)
def _(guide, bearing):
    body = state.ROLLER_STATES * roller_count(bearing)
    return Partner(body + state.RING_X, body + state.RING_VX, 1.0 / bearing.inner_ring_mass)


@kernel
def keep_resistance(scratch):
    """Make the latest resistance of the film that at the start of the next step."""
    for i in range(scratch.resistance.shape[1]):
        scratch.resistance[AT_START, i] = scratch.resistance[LATEST, i]


@kernel
def stop_in_step(bearing, scratch, row, h):
    """h tr D of a step of ``h`` [s]."""
    per_mass = 1.0 / bearing.cage.mass + partner_of(bearing.guide, bearing).per_mass
    return h * per_mass * (scratch.resistance[row, 0] + scratch.resistance[row, 2])


@kernel
def share_at_end(bearing, scratch, row, h):
    """Share theta of the rates at the end of a step of ``h`` [s]."""
    stiffness = stop_in_step(bearing, scratch, row, h)
    return max(0.5, 1.0 / (1.0 + REVERSED) - 1.0 / max(stiffness, STIFF))


@kernel
def film_impulse(bearing, scratch, row, duration, x, y):
    """Impulse [N s] of the film in a ``duration`` [s], where ``x, y`` is the change of u without it: C (I + D duration)^-1 (x, y) duration."""
    per_mass = duration * (1.0 / bearing.cage.mass + partner_of(bearing.guide, bearing).per_mass)
    resist_xx, resist_xy, resist_yy = scratch.resistance[row, 0], scratch.resistance[row, 1], scratch.resistance[row, 2]
    xx, xy, yy = 1.0 + per_mass * resist_xx, per_mass * resist_xy, 1.0 + per_mass * resist_yy
    inverse = duration / (xx * yy - xy * xy)
    ux, uy = inverse * (yy * x - xy * y), inverse * (xx * y - xy * x)
    return resist_xx * ux + resist_xy * uy, resist_xy * ux + resist_yy * uy


@kernel
def predict_body(place, speed, per_mass, h, impulse, start, k, end):
    """Predict a body at the end of a step of ``h`` [s] on which its present rates and the ``impulse`` [N s] act."""
    for axis in range(2):
        change = h * k[START, speed + axis] + per_mass * impulse[axis]
        end[speed + axis] = start[speed + axis] + change
        end[place + axis] = start[place + axis] + h * (start[speed + axis] + 0.5 * change)


@kernel
def correct_body(place, speed, per_mass, share, h, impulse, start, k, end):
    """Correct speed and rate of a body at the end of a step of ``h`` [s] by the ``impulse`` [N s]; its place is as predicted."""
    for axis in range(2):
        i = speed + axis
        push = per_mass * impulse[axis]
        end[i] = start[i] + (h * ((1.0 - share) * k[START, i] + share * k[END, i]) + push)
        k[END, i] += push / (share * h)
        end[place + axis] = k[PREDICTED, place + axis]


@kernel
def missing(i, share, h, start, k):
    """What a predicted speed lacks."""
    return start[i] - k[PREDICTED, i] + h * ((1.0 - share) * k[START, i] + share * k[END, i])


@kernel
def predict_cage(bearing, scratch, h, y, k, end):
    """Predict cage and ring at the end of a step of ``h`` [s], and keep that state for ``correct_cage``."""
    cage, ring = state.ROLLER_STATES * roller_count(bearing), partner_of(bearing.guide, bearing)
    speed, other = cage + state.CAGE_VX, ring.speed
    x, y_ = h * k[START, speed], h * k[START, speed + 1]
    if other >= 0:
        x, y_ = x - h * k[START, other], y_ - h * k[START, other + 1]
    impulse = film_impulse(bearing, scratch, AT_START, h * share_at_end(bearing, scratch, AT_START, h), x, y_)
    predict_body(cage + state.CAGE_X, speed, -1.0 / bearing.cage.mass, h, impulse, y, k, end)
    if other >= 0:
        predict_body(ring.place, other, ring.per_mass, h, impulse, y, k, end)
    for i in range(end.size):
        k[PREDICTED, i] = end[i]


@kernel
def correct_cage(bearing, scratch, h, y, k, end):
    """Correct cage and ring at the end of a step of ``h`` [s], from the rates there with the predicted speeds."""
    cage, ring = state.ROLLER_STATES * roller_count(bearing), partner_of(bearing.guide, bearing)
    speed, other, share = cage + state.CAGE_VX, ring.speed, share_at_end(bearing, scratch, LATEST, h)
    x, y_ = missing(speed, share, h, y, k), missing(speed + 1, share, h, y, k)
    if other >= 0:
        x, y_ = x - missing(other, share, h, y, k), y_ - missing(other + 1, share, h, y, k)
    impulse = film_impulse(bearing, scratch, LATEST, share * h, x, y_)
    correct_body(cage + state.CAGE_X, speed, -1.0 / bearing.cage.mass, share, h, impulse, y, k, end)
    if other >= 0:
        correct_body(ring.place, other, ring.per_mass, share, h, impulse, y, k, end)
