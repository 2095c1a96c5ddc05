"""Velocity Verlet for bearings: one right-hand side a step, order 2, steps of any size.

With one right-hand side a staggered step of a vibration is stable up to h omega = 2, and up to 1.4 with a damping ratio of 0.1. A
step of Dormand and Prince's pair reaches 2.4 with six. So Verlet is the cheaper explicit method where stability limits the steps, in slow
bearings and with tangential elasticity. It damps no vibration of a loaded contact, as pairs at their limit do. With a = a(x, v) and the rates a_0, a_1 at both
ends of a step and a_-1 at the start of the step before,

    x_1 = x_0 + h v_0 + h^2/2 a_0,   v* = v_0 + h a_0 + h/2 (a_0 - a_-1),   a_1 = a(x_1, v*),   v_1 = v_0 + h/2 (a_0 + a_1)

in equal steps. Components without a position (spins, the clock) have the formula of v. The usual v* = v_0 + h a_0 is too large
by h^2/2 a', which for a vibration adds the share (h omega)^2/2 to all damping: in fixed steps of 900 a turn it takes 9 % off the
whirl of the bearing of Chen et al. 2022, and the last change of the rates all but 0.8 %.

Spins of rigid contacts have the usual v*. Traction makes each relax towards rolling at a rate lambda, and its step is stable up
to h lambda = 1, with the last change of the rates only up to 1/2. That would set the steps of slow bearings: the same one takes
6950 instead of 9870 at 2000 rpm, with the same whirl.

Traction coefficients act like positions: slip drives them, and they decelerate the slip. So they must be staggered against
speeds too. They follow the trapezoidal rule, implicit in the coefficient, which ``contact.tangential`` solves in the contact:
mu_1 = mu_0 + h/2 (g_0 + g_1) with g_1 = g(x_1, v*, mu_1). Relaxation alone is then stable in steps of any size. The rate g_1 is
that of v* and not of v_1, so that the vibration of slip against spring is stable up to h omega = 1.2 to 1.5, for the damping
ratios 0.05 to 0.17 of loaded contacts. With the usual v* this is 0.7 to 1.3.

A cage that thick oil stops on its land within a step has implicit speeds (``stopped_cage``).

Rollers run round the bearing. Coordinates stay in fixed axes, where h v_0 overshoots the orbit. With the angle phi of the orbit in
a step, (1 - phi^2/6) h v_0 takes its place.

The local errors are h^3/12 a'' in speeds, by divided differences of three rates, and h^2/6 (a_1 - a_0) in positions. The
trapezoidal rule integrates the powers of the losses. Dense output is the cubic through values and slopes at both ends.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import kernel, law_of, routine
from rbdyn.contact.tangential import half_step_ahead, spin_lookahead, staggered
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.bodies import HeldRing, SupportedRing
from rbdyn.dynamics.forces.cage import has_stopping_film
from rbdyn.dynamics.forces.equations import RollerBearing, derivative, derivative_once, roller_count
from rbdyn.dynamics.forces.races import with_laws
from rbdyn.dynamics.integrators import advance as laws
from rbdyn.dynamics.integrators.advance import BEFORE, DERIVATIVES, EIGENVALUES, GROW, LIMITED, STEP, TESTED
from rbdyn.dynamics.integrators.stopped_cage import (
    AT_START,
    END,
    ERROR,
    PAST,
    PREDICTED,
    START,
    STIFF,
    correct_cage,
    keep_resistance,
    predict_cage,
    stop_in_step,
)

# Largest ratio of a step to the one before in predicted speeds: behind a step cut short the change of the rates is round-off.
LONGEST_RATIO = 2.0
# Second over first change of the rates, at most: of a vibration it is h omega, and 2 of motions at the limit of their stability,
# where the rates change their sign in each step and h |eigenvalue| is 1 (spins) to 1.4 (contacts).
SHARPEST_VIBRATION, SHARPEST_BEND = 1.7, 2.2


class Verlet(NamedTuple):
    """Velocity Verlet; fields as in ``advance``. The PI controller is Gustafsson's: 0.7 and 0.4 over the order of the error.

    ``speeds``: place of the first component that is no position of a roller. ``limit``: h |eigenvalue| above which stability
    limits a step.
    """

    speeds: int
    last: int = 1
    free: int = PREDICTED
    exponent: float = 0.7 / 3
    beta: float = 0.4 / 3
    rejected: float = 1 / 3
    limit: float = 1.2


@kernel
def staggered_race(race, half_step):
    """A race at the end of a step of twice ``half_step`` [s]."""
    return with_laws(race, race.traction, staggered(race.tangential, half_step))


@kernel
def staggered_bearing(bearing, half_step):
    """A bearing at the end of a step of twice ``half_step`` [s]."""
    return RollerBearing(
        bearing.rollers,
        bearing.sizes,
        bearing.roller_mass,
        bearing.roller_inertia,
        staggered_race(bearing.outer, half_step),
        staggered_race(bearing.inner, half_step),
        bearing.open_film,
        bearing.pocket,
        bearing.pocket_cos,
        bearing.pocket_sin,
        bearing.guide,
        bearing.drag,
        bearing.cage,
        bearing.outer_ring,
        bearing.inner_ring_mass,
        bearing.drive,
        bearing.gravity,
        bearing.impacts,
        bearing.samples,
    )


@kernel
def move(place, speed, count, duration, h, y, k, end):
    """Positions from ``place`` on at the end of a step of ``h`` [s], from speeds over a ``duration`` [s] and their rates."""
    for i in range(count):
        end[place + i] = y[place + i] + (duration * y[speed + i] + 0.5 * h * h * k[START, speed + i])


@kernel
def finish(place, speed, count, h, k, end):
    """Rates at the end and errors of positions from ``place`` on."""
    for i in range(count):
        k[END, place + i] = end[speed + i]
    for i in range(count):
        k[ERROR, place + i] = h * h / 6.0 * (k[END, speed + i] - k[START, speed + i])


@law_of(HeldRing)
def move_support(ring, h, y, k, end):
    """``move`` the outer ring, where it has coordinates."""


@move_support.body(SupportedRing)
def _(ring, h, y, k, end):
    move(ring.start, ring.start + state.SUPPORT_VX, 2, h, h, y, k, end)


@law_of(HeldRing)
def finish_support(ring, h, k, end):
    """``finish`` the outer ring, where it has coordinates."""


@finish_support.body(SupportedRing)
def _(ring, h, k, end):
    finish(ring.start, ring.start + state.SUPPORT_VX, 2, h, k, end)


@kernel
def move_bodies(bearing, h, y, k, end):
    """``move`` cage and rings."""
    body = state.ROLLER_STATES * roller_count(bearing)
    move(body + state.CAGE_X, body + state.CAGE_VX, 3, h, h, y, k, end)
    move(body + state.RING_X, body + state.RING_VX, 2, h, h, y, k, end)
    move_support(bearing.outer_ring, h, y, k, end)


@kernel
def finish_positions(bearing, h, k, end):
    """``finish`` all bodies."""
    z = roller_count(bearing)
    body = state.ROLLER_STATES * z
    finish(0, 2 * z, 2 * z, h, k, end)
    finish(body + state.CAGE_X, body + state.CAGE_VX, 3, h, k, end)
    finish(body + state.RING_X, body + state.RING_VX, 2, h, k, end)
    finish_support(bearing.outer_ring, h, k, end)


@kernel
def look_ahead(first, stop, h, ahead, y, k, end):
    """Speeds predicted at the end of a step of ``h`` [s] from their rates and ``ahead`` [s] of the last change of these."""
    for i in range(first, stop):
        end[i] = y[i] + (h * k[START, i] + ahead * (k[START, i] - k[PAST, i]))


@kernel
def predict(bearing, film_stops, scratch, h, before, y, k, end):
    """State at which the rates of the end are evaluated; traction coefficients without the half step of those rates.

    ``film_stops``: whether the film of the land stops the cage within the step.
    """
    z, n = roller_count(bearing), y.size
    angle = h * y[state.ROLLER_STATES * z + state.CAGE_SPEED]
    ratio = min(h / before, LONGEST_RATIO)
    look_ahead(2 * z, 4 * z, h, 0.5 * h * ratio, y, k, end)
    look_ahead(4 * z, 5 * z, h, spin_lookahead(bearing.outer.tangential) * h * ratio, y, k, end)
    look_ahead(5 * z, n, h, 0.5 * h * ratio, y, k, end)
    move(0, 2 * z, 2 * z, h * (1.0 - angle * angle / 6.0), h, y, k, end)
    move_bodies(bearing, h, y, k, end)
    if film_stops:
        predict_cage(bearing, scratch, h, y, k, end)
    half_step_ahead(bearing.outer.tangential, z, 0.5 * h, y, k, START, end)
    half_step_ahead(bearing.inner.tangential, z, 0.5 * h, y, k, START, end)


@kernel
def correct(bearing, film_stops, scratch, h, before, y, k, end):
    """State at the end of the step, and the errors."""
    z, n = roller_count(bearing), y.size
    for i in range(2 * z, n):
        end[i] = y[i] + 0.5 * h * (k[START, i] + k[END, i])
    move_bodies(bearing, h, y, k, end)
    if film_stops:
        correct_cage(bearing, scratch, h, y, k, end)
    # After a step cut short the difference before it would be round-off.
    change = h * h / (6.0 * (h + before))
    change_before = change * min(h / before, GROW)
    for i in range(2 * z, n):
        k[ERROR, i] = change * (k[END, i] - k[START, i]) - change_before * (k[START, i] - k[PAST, i])
    finish_positions(bearing, h, k, end)


@laws.begin.body(Verlet)
def _(method, bearing, y, k, power, loads, scratch, clock, counts):
    if counts[DERIVATIVES] == 0:
        for i in range(y.size):
            if not math.isfinite(y[i]):
                return i
        derivative_once(bearing, y, START, k, power, loads, scratch)
        counts[DERIVATIVES] = 1
        for i in range(y.size):
            k[PAST, i] = k[START, i]
        keep_resistance(scratch)
        clock[BEFORE] = clock[STEP]
    return -1


@laws.trial_step.body(Verlet)
def _(method, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h):
    film_stops = has_stopping_film(bearing.guide) and stop_in_step(bearing, scratch, AT_START, h) > STIFF
    predict(bearing, film_stops, scratch, h, clock[BEFORE], y, k, stage)
    derivative(staggered_bearing(bearing, 0.5 * h), stage, END, k, power, loads, scratch)
    counts[DERIVATIVES] += 1
    correct(bearing, film_stops, scratch, h, clock[BEFORE], y, k, stage)


@laws.error_norm.body(Verlet)
def _(method, k, h, inverse_tolerance):
    # Squares in vectors, into a row that is free.
    n, squares = inverse_tolerance.size, method.free
    for i in range(n):
        e = k[ERROR, i] * inverse_tolerance[i]
        k[squares, i] = e * e
    return math.sqrt(laws.row_sum(k, squares, n))


@laws.step_error.body(Verlet)
def _(method, k, h, i):
    return k[ERROR, i]


@laws.test_stiffness.body(Verlet)
def _(method, k, stiffness, h, inverse_tolerance):
    compare_changes(method, k, stiffness, h, inverse_tolerance)


@routine
def compare_changes(method, k, stiffness, h, inverse_tolerance):
    """Book whether stability limits the step: second over first changes of the rates, h omega for a vibration.

    Smooth motion has hardly any second change, a relaxation whose rate changes its sign in each step twice the first one, and a
    kink of the rates at a touch often a larger one than any of these.
    """
    second = first = 0.0
    for i in range(method.speeds, inverse_tolerance.size):
        bend = 12.0 / h * k[ERROR, i] * inverse_tolerance[i]
        change = (k[END, i] - k[START, i]) * inverse_tolerance[i]
        second += bend * bend
        first += change * change
    stiffness[TESTED] += 1.0
    if method.limit * method.limit * first < second < SHARPEST_BEND * SHARPEST_BEND * first:
        bend = math.sqrt(second / first)
        stiffness[LIMITED] += 1.0
        stiffness[EIGENVALUES] += (bend if bend < SHARPEST_VIBRATION else 1.0) / h


@laws.end_step.body(Verlet)
def _(method, bearing, stage, k, power, loads, scratch, counts):
    for i in range(stage.size):
        k[PAST, i] = k[START, i]
    keep_resistance(scratch)


@laws.interpolate.body(Verlet)
def _(method, y, end, k, h, theta, i):
    difference = end[i] - y[i]
    slope = h * k[START, i] - difference
    curve = difference - h * k[END, i] - slope
    return y[i] + theta * (difference + (1.0 - theta) * (slope + theta * curve))


@laws.work_done.body(Verlet)
def _(method, power, h, p):
    return 0.5 * h * (power[START, p] + power[END, p])


@laws.to_fixed_axes_at.body(Verlet)
def _(method, clock, time, z, y):
    pass


@laws.next_frame.body(Verlet)
def _(method, clock, h, z, y, k):
    clock[BEFORE] = h
