"""Tangential elasticity of a rolling contact: bodies give way before traction follows slip.

A steady law of creep and film answers a change of slip at once, as if the bodies were rigid. They give way tangentially: spring
and steady contact are in series, so that a traction T builds up by k (s - s_c(T)), s_c being the slip at which the steady law
has T and k the tangential stiffness, for plane contact of like materials the normal one, dQ/dx (Johnson 1985, Contact Mechanics,
7 and 8; Kalker 1990). With s_c = s T/T_steady(s), which is exact on the straight part of the law, the traction coefficient is

    (tau + beta) d mu/dt = mu_steady - mu,    tau = T_steady(s)/(s k) + 1/omega.

On the straight part tau is the creep slope over k, the time of a way of about the contact's width; a fast slip, as in an impact,
meets the spring alone and finds the limit of traction in the time T/(k s). ``omega``, that of a roller's vibration between its
races, bounds the rate where a flat curve answers faster than anything moves. Material damping c next to the spring lets the share
beta/(tau + beta), beta = c/k, of the steady traction act at once. The coefficient that acts stays within those of the steady
law, and traction ends with the load. What the contact does on the slip counts as lost, the elastic energy that it stores, some
microjoules, with it.
"""

from typing import NamedTuple

from rbdyn.compiled.kernel import kernel, law

SMALLEST_SLIP = 1e-12  # [m/s], keeps the slope of the law finite


class RigidContact(NamedTuple):
    """Traction follows the steady law at once."""


class ElasticContact(NamedTuple):
    """The traction coefficient of each roller at a race is a state."""

    start: int  # where those of this race begin
    shortest_time: float  # 1/omega [s]
    damping_time: float  # beta [s]


@law
def coefficient_of(tangential, y, j):
    """Traction coefficient of roller ``j`` in the state ``y``; 0 where it is no state."""


@coefficient_of.body(RigidContact)
def _(tangential, y, j):
    return 0.0


@coefficient_of.body(ElasticContact)
def _(tangential, y, j):
    return y[tangential.start + j]


@kernel
def relaxation_time(tangential, steady, load, slip, stiffness):
    """tau [s] of a steady coefficient at a load [N] and a slip [m/s], with the contact's stiffness [N/m]; shortest without load."""
    creep = abs(steady) * load / (max(abs(slip), SMALLEST_SLIP) * stiffness) if load > 0.0 else 0.0
    return creep + tangential.shortest_time


@law
def acting_coefficient(tangential, steady, coefficient, load, slip, stiffness):
    """Traction coefficient that acts, of the steady law's and the state's; the rest as in ``relaxation_time``."""


@acting_coefficient.body(RigidContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    return steady


@acting_coefficient.body(ElasticContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    damped = tangential.damping_time / relaxation_time(tangential, steady, load, slip, stiffness)
    return coefficient + (steady - coefficient) * damped / (1.0 + damped)


@law
def coefficient_rate(tangential, steady, coefficient, load, slip, stiffness):
    """Rate at which the state follows the steady coefficient [1/s]; arguments as above. Without load it dies away."""


@coefficient_rate.body(RigidContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    return 0.0


@coefficient_rate.body(ElasticContact)
def _(tangential, steady, coefficient, load, slip, stiffness):
    target = steady if load > 0.0 else 0.0
    whole = relaxation_time(tangential, steady, load, slip, stiffness) + tangential.damping_time
    return (target - coefficient) / whole


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
        dy[row, tangential.start + j] = coefficient_rate(tangential, 0.0, y[tangential.start + j], 0.0, 0.0, 1.0)
