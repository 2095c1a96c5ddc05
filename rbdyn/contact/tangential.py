"""Tangential elasticity of a rolling contact: traction that follows its steady law through a spring.

A steady law responds to a change of slip at once, as if the bodies were rigid. Elastic bodies act as a spring in series with the
steady contact (Johnson and Tevaarwerk 1977, Proc. R. Soc. A 356, 215): T' = k (s - s_c(T)), where s_c is the slip at which the
steady law gives T. The tangential stiffness k is, for plane contact of equal materials, the normal one, dQ/dx (Johnson 1985,
Contact Mechanics, 7 and 8; Kalker 1990). The curve is not inverted; near the present slip it is a hyperbola, so that

    T' = k s (1 - r/(1 + (n - 1)(1 - r))),    r = T/T_s,    n = d ln s/d ln T_s >= 1,

with T_s, the steady traction at s. This is exact for curves T_m s/(s + s_0), and for the straight part of all, where n = 1. Close to
the limit of traction n is large: the spring acts alone until T_s is almost reached. Traction opposite to the slip, as after a
reversal, adds to the rate: r becomes -|r|, its share of the slip is odd. Traction above T_s, which the unloading contact has when
its slip or its load falls, decreases along the tangent, so that its rate stays finite: T' = n k s (1 - r). What a peak of an impact
on a roller differs from that of the inverted curve is below 1.5 % of it (``tests/oracle/test_tangential_elasticity.py``).

Explicit steps must follow the rates, so no time is shorter than w, three quarters of a radian of a roller between its races, which
stability allows for its vibrations too. Material damping c acts parallel to the spring, beta = c/k. With tau = T_s/(k s) the
coefficient mu = T/Q of the state and the one that acts are

    mu' = mu_s (1 - r/(1 + (m - 1) u + m (m - 1)(1 - tau/(n l)) u^2))/t,    u = 1 - r,    r = mu/mu_s,
    mu_a = mu + (beta + h (1 - tau (1 + 1/n)/(h + l))) mu',
    h = max(tau, w),    l = max(tau/n, w),    t = h + beta,    m = t/(l + beta).

Where w hides the slope of the curve at its end, the square of u keeps it as flat below as that end allows: the share of the slip
remains convex in r, so that no rate is steeper than 1/(w + beta).
The integral of 1 - T/T_s over a step of the slip is tau (1 + 1/n)/2. Where w is longer than tau or tau/n, a share of the steady
traction acts at once, so that this integral remains. A contact with tau far below w acts as a rigid one. The acting
coefficient stays within those of the steady law, no work comes out of the contact, and traction vanishes with the load. The work
on the slip counts as loss, including the elastic energy of the contact (some microjoules).

The state of an open contact dies away in the time w + beta. Up to a light load the rate goes over to that, as a cubic of the load,
because a jump at touch would leave no tight tolerance any step. What acts hardly feels it: tau is far below w there.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.elementary import fma
from rbdyn.compiled.kernel import kernel, law_of
from rbdyn.contact.traction import growth, growth_by_table, traction, traction_by_table

SMALLEST_SPRING_RATE = 1e-3  # k s [N/s], keeps times finite
SMALLEST_COEFFICIENT = 1e-30  # of the steady law, keeps the ratio to it finite


class RigidContact(NamedTuple):
    """Traction follows the steady law at once."""


class ElasticContact(NamedTuple):
    """The traction coefficient of each roller at a race is a state."""

    start: int  # where those of this race begin
    shortest_time: float  # w [s]
    damping_time: float  # beta [s]
    light_density: float  # 1/Q_l of the load up to which the state fades in [1/N]


class StaggeredContact(NamedTuple):
    """An elastic contact at the end of a step of ``verlet``: its states come without half a step of their rate at that end."""

    start: int
    shortest_time: float
    damping_time: float
    light_density: float
    half_step: float  # [s]


class SteadyTraction(NamedTuple):
    """Traction coefficient of the steady law, and its growth over the logarithm of the slip; 0 in a rigid contact, which needs none."""

    coefficient: float
    growth: float


class Response(NamedTuple):
    """Traction coefficient that acts, and the rate of the state [1/s]."""

    coefficient: float
    rate: float


@law_of(RigidContact)
def spin_lookahead(tangential):
    """Share of a step by which ``verlet`` adds the last change of the rates to spins that it predicts."""
    return 0.0


@spin_lookahead.body(ElasticContact)
def _(tangential):
    return 0.5


@law_of(RigidContact)
def steady_traction(tangential, model, slip, load):
    """``SteadyTraction`` of a traction law at a slip [m/s] and a load [N]."""
    return SteadyTraction(traction(model, slip, load), 0.0)


@steady_traction.body(ElasticContact, StaggeredContact)
def _(tangential, model, slip, load):
    return SteadyTraction(traction(model, slip, load), growth(model, slip, load))


@law_of(RigidContact)
def steady_by_table(tangential, model, slip, load, value, slope):
    """``steady_traction`` of a law without its table, from value and slope of its ``table_cubic``."""
    return SteadyTraction(traction_by_table(model, slip, load, value), 0.0)


@steady_by_table.body(ElasticContact, StaggeredContact)
def _(tangential, model, slip, load, value, slope):
    steady = traction_by_table(model, slip, load, value)
    return SteadyTraction(steady, growth_by_table(model, slip, load, value, slope))


@law_of(RigidContact)
def response(tangential, steady, coefficient, load, slip, stiffness):
    """``Response`` of a contact of this stiffness [N/m] whose state is ``coefficient``; without load the state dies away."""
    return Response(steady.coefficient, 0.0)


@response.body(ElasticContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    return elastic_response(tangential, steady, coefficient, load, slip, stiffness)


@response.body(StaggeredContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    # Rates are never steeper than 1/(w + beta), so the first try lies between the start and the end of the secant.
    half, time = tangential.half_step, tangential.shortest_time + tangential.damping_time
    start = elastic_response(tangential, steady, coefficient, load, slip, stiffness)
    change = half * start.rate * time / (time + half)
    tried = elastic_response(tangential, steady, coefficient + change, load, slip, stiffness)
    share = (
        half * start.rate / (change - half * (tried.rate - start.rate) + math.copysign(SMALLEST_COEFFICIENT, change))
    )
    return Response(start.coefficient + share * (tried.coefficient - start.coefficient), share * change / half)


@kernel
def elastic_response(tangential, steady, coefficient, load, slip, stiffness):
    """``Response`` of an elastic contact, by the formulas of the module."""
    # Times are multiplied by the spring's rate: forces, so that one division gives all quotients.
    spring = max(stiffness * abs(slip), SMALLEST_SPRING_RATE)
    shortest, damping = tangential.shortest_time * spring, tangential.damping_time * spring
    secant = abs(steady.coefficient) * load
    along = min(max(steady.growth * load, 0.0), secant)
    rise, last = max(secant, shortest), max(along, shortest)
    total, end, both = rise + damping, last + damping, rise + last
    limit, size = max(abs(steady.coefficient), SMALLEST_COEFFICIENT), abs(coefficient)
    within, lack = min(size, limit), limit - min(size, limit)
    # The share of the slip in creep is within/limit over curve/base.
    ending, more = end * limit, (total - end) * lack
    base = last * ending * ending
    curve = last * ending * (ending + more) + (last - along) * total * lack * more
    factor = total * end
    inverse = 1.0 / (factor * both * curve)
    seen = within * base * end * both * inverse + (size - within) * total * both * curve * inverse
    share = steady.coefficient * end * both * curve * inverse - math.copysign(seen, coefficient)
    at_once = damping + rise * (both - secant - along) * factor * curve * inverse
    engaged = min(max(load * tangential.light_density, 0.0), 1.0)
    engaged = engaged * engaged * (3.0 - 2.0 * engaged)
    fading = faded(tangential, coefficient)
    return Response(coefficient + at_once * share, fma(engaged, fma(share, spring, -fading), fading))


@kernel
def faded(tangential, coefficient):
    """Rate of the state of an open contact [1/s]."""
    return -coefficient / (tangential.shortest_time + tangential.damping_time)


@law_of(RigidContact)
def coefficient_of(tangential, y, j):
    """Traction coefficient of roller ``j`` in the state ``y``; 0 where it is no state."""
    return 0.0


@coefficient_of.body(ElasticContact, StaggeredContact)
def _(tangential, y, j):
    return y[tangential.start + j]


@law_of(RigidContact)
def keep_coefficient_rate(tangential, rate, lanes, place):
    """Write the rate of a contact to a work space."""


@keep_coefficient_rate.body(ElasticContact, StaggeredContact)
def _(tangential, rate, lanes, place):
    lanes[place] = rate


@law_of(RigidContact)
def add_coefficient_rate(tangential, rate, j, row, dy):
    """Put the rate of roller ``j`` into row ``row`` of ``dy``."""


@add_coefficient_rate.body(ElasticContact, StaggeredContact)
def _(tangential, rate, j, row, dy):
    dy[row, tangential.start + j] = rate


@law_of(RigidContact)
def relax_coefficients(tangential, rollers, y, row, dy):
    """Let the coefficients of all rollers die away, as where they do not touch, in row ``row`` of ``dy``."""


@relax_coefficients.body(ElasticContact)
def _(tangential, rollers, y, row, dy):
    for j in range(rollers):
        dy[row, tangential.start + j] = faded(tangential, y[tangential.start + j])


@relax_coefficients.body(StaggeredContact)
def _(tangential, rollers, y, row, dy):
    time = tangential.shortest_time + tangential.damping_time + tangential.half_step
    for j in range(rollers):
        dy[row, tangential.start + j] = -y[tangential.start + j] / time


@law_of(RigidContact)
def staggered(tangential, half_step):
    """The law at the end of a step of twice ``half_step`` [s]."""
    return tangential


@staggered.body(ElasticContact)
def _(tangential, half_step):
    return StaggeredContact(
        tangential.start, tangential.shortest_time, tangential.damping_time, tangential.light_density, half_step
    )


@law_of(RigidContact)
def half_step_ahead(tangential, rollers, half_step, y, dy, row, end):
    """Write the coefficients of ``y`` half a step [s] later, by their rates in row ``row`` of ``dy``, to ``end``."""


@half_step_ahead.body(ElasticContact)
def _(tangential, rollers, half_step, y, dy, row, end):
    # Coefficients of open contacts die away to numbers so small that processors are slow with them.
    for i in range(tangential.start, tangential.start + rollers):
        ahead = y[i] + half_step * dy[row, i]
        end[i] = ahead if abs(ahead) > SMALLEST_COEFFICIENT else 0.0
