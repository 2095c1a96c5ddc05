"""Tangential elasticity of a rolling contact: traction that follows its steady law through a spring.

A steady law responds to a change of slip at once, as if the bodies were rigid. Elastic bodies act as a spring in series with the
steady contact (Johnson and Tevaarwerk 1977, Proc. R. Soc. A 356, 215): T' = k (s - s_c(T)), where s_c is the slip at which the
steady law gives T. The tangential stiffness k is, for plane contact of equal materials, the normal one, dQ/dx (Johnson 1985,
Contact Mechanics, 7 and 8; Kalker 1990). The curve is not inverted; near the present slip it is a power law, so that

    T' = k s (1 - sign(T s) |T/T_s|^n),    n = d ln s/d ln T_s, from 1 to 12,

with T_s, the steady traction at s. The straight part of the curve has n = 1, which is exact. Close to the limit of traction n is
large: the spring acts alone until T_s is almost reached. Traction opposite to the slip, as after a reversal, adds to the rate.
Traction above T_s, which the unloading contact has when its slip or its load falls, decreases along the tangent of the power,
so that its rate stays finite: T' = n k s (1 - T/T_s). What a peak of an impact on a roller differs from that of the inverted curve
is below 1.5 % of it (``tests/oracle/test_tangential_elasticity.py``).

Explicit steps must follow the rates, so no time is shorter than w, three quarters of a radian of a roller between its races, which stability allows for its vibrations too. Material damping c acts
parallel to the spring, beta = c/k. With tau = T_s/(k s) the coefficient mu = T/Q of the state and the one that acts are

    mu' = mu_s (1 - sign |mu/mu_s|^m)/t,    mu_a = mu + (beta + r (1 - tau (1 + 1/n)/(r + l))) mu',
    r = max(tau, w),    l = max(tau/n, w),    t = r + beta,    m = t/(l + beta).

The integral of 1 - T/T_s over a step of the slip is about tau (1 + 1/n)/2. Where w is longer than tau or tau/n, a share of the steady
traction acts at once, so that this integral remains. A contact with tau far below w acts as a rigid one. The acting
coefficient stays within those of the steady law, no work comes out of the contact, and traction vanishes with the load. The work
on the slip counts as loss, including the elastic energy of the contact (some microjoules).

The state of an open contact dies away in the time w + beta. Up to a light load the rate goes over to that, as a cubic of the load,
because a jump at touch would leave no tight tolerance any step. What acts hardly feels it: tau is far below w there.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.elementary import fast_exp, fast_log
from rbdyn.compiled.kernel import kernel, law
from rbdyn.contact.traction import tangent, tangent_by_table, traction, traction_by_table

SMALLEST_SLIP = 1e-12  # [m/s], keeps the slope of the law finite
SMALLEST_RATIO = 1e-30  # of tractions, keeps the logarithm finite
LARGEST_EXPONENT = 12.0


class RigidContact(NamedTuple):
    """Traction follows the steady law at once."""


class ElasticContact(NamedTuple):
    """The traction coefficient of each roller at a race is a state."""

    start: int  # where those of this race begin
    shortest_time: float  # w [s]
    damping_time: float  # beta [s]
    light_density: float  # 1/Q_l of the load up to which the state fades in [1/N]


class SteadyTraction(NamedTuple):
    """Traction coefficient of the steady law, and its slope over the slip [s/m]; 0 in a rigid contact, which needs none."""

    coefficient: float
    slope: float


class Response(NamedTuple):
    """Traction coefficient that acts, and the rate of the state [1/s]."""

    coefficient: float
    rate: float


@law
def steady_traction(tangential, model, slip, load):
    """``SteadyTraction`` of a traction law at a slip [m/s] and a load [N]."""


@steady_traction.body(RigidContact)
def _(tangential, model, slip, load):
    return SteadyTraction(traction(model, slip, load), 0.0)


@steady_traction.body(ElasticContact)
def _(tangential, model, slip, load):
    return SteadyTraction(traction(model, slip, load), tangent(model, slip, load))


@law
def steady_by_table(tangential, model, slip, load, value, slope):
    """``steady_traction`` of a law without its table, from its ``table_value``."""


@steady_by_table.body(RigidContact)
def _(tangential, model, slip, load, value, slope):
    return SteadyTraction(traction_by_table(model, slip, load, value), 0.0)


@steady_by_table.body(ElasticContact)
def _(tangential, model, slip, load, value, slope):
    steady = traction_by_table(model, slip, load, value)
    return SteadyTraction(steady, tangent_by_table(model, slip, load, value, slope))


@law
def response(tangential, steady, coefficient, load, slip, stiffness):
    """``Response`` of a contact of this stiffness [N/m] whose state is ``coefficient``; without load the state dies away."""


@response.body(RigidContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    return Response(steady.coefficient, 0.0)


@response.body(ElasticContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    compliance = load / stiffness if load > 0.0 else 0.0
    target = steady.coefficient if load > 0.0 else 0.0
    secant = abs(steady.coefficient) * compliance / max(abs(slip), SMALLEST_SLIP)
    along = min(max(steady.slope * compliance, secant / LARGEST_EXPONENT), secant)
    rise, last = max(secant, tangential.shortest_time), max(along, tangential.shortest_time)
    whole = rise + tangential.damping_time
    rate = (target - yielding(target, coefficient, whole / (last + tangential.damping_time))) / whole
    at_once = tangential.damping_time + rise * (1.0 - (secant + along) / (rise + last))
    engaged = min(max(load * tangential.light_density, 0.0), 1.0)
    engaged = engaged * engaged * (3.0 - 2.0 * engaged)
    dying = coefficient / (tangential.shortest_time + tangential.damping_time)
    return Response(coefficient + at_once * rate, engaged * (rate + dying) - dying)


@kernel
def yielding(steady, coefficient, exponent):
    """The coefficient as the slider sees it: the steady one times a power of their ratio, with the tangent of the power above it."""
    limit, size = abs(steady), abs(coefficient)
    ratio = max(size / limit if size < limit else 1.0, SMALLEST_RATIO)
    within = limit * fast_exp(exponent * fast_log(ratio))
    return math.copysign(within + exponent * max(size - limit, 0.0), coefficient)


@law
def coefficient_of(tangential, y, j):
    """Traction coefficient of roller ``j`` in the state ``y``; 0 where it is no state."""


@coefficient_of.body(RigidContact)
def _(tangential, y, j):
    return 0.0


@coefficient_of.body(ElasticContact)
def _(tangential, y, j):
    return y[tangential.start + j]


@law
def keep_coefficient_rate(tangential, rate, lanes, place):
    """Write the rate of a contact to a work space."""


@keep_coefficient_rate.body(RigidContact)
def _(tangential, rate, lanes, place):
    pass


@keep_coefficient_rate.body(ElasticContact)
def _(tangential, rate, lanes, place):
    lanes[place] = rate


@law
def add_coefficient_rate(tangential, rate, j, row, dy):
    """Put the rate of roller ``j`` into row ``row`` of ``dy``."""


@add_coefficient_rate.body(RigidContact)
def _(tangential, rate, j, row, dy):
    pass


@add_coefficient_rate.body(ElasticContact)
def _(tangential, rate, j, row, dy):
    dy[row, tangential.start + j] = rate


@law
def relax_coefficients(tangential, rollers, y, row, dy):
    """Let the coefficients of all rollers die away, as where they do not touch, in row ``row`` of ``dy``."""


@relax_coefficients.body(RigidContact)
def _(tangential, rollers, y, row, dy):
    pass


@relax_coefficients.body(ElasticContact)
def _(tangential, rollers, y, row, dy):
    for j in range(rollers):
        coefficient = y[tangential.start + j]
        dy[row, tangential.start + j] = response(tangential, SteadyTraction(0.0, 0.0), coefficient, 0.0, 0.0, 1.0).rate
