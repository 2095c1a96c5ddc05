"""Tangential elasticity of a rolling contact: traction builds up over a relaxation length, as that of a tyre does.

A steady law of creep and film answers a change of slip at once. Real material has to pass the contact first, some tens of
microseconds, while the bodies give way tangentially (Kalker 1990, Three-Dimensional Elastic Bodies in Rolling Contact;
Johnson 1985, Contact Mechanics, 8). To first order the traction coefficient follows the steady one by

    (tau + beta) d mu/dt = mu_steady - mu,    tau = C/k,

with Carter's creep slope C = 2 R Q/(a u) and the tangential stiffness k of the contact, which for plane contact of like
materials is its normal one, dQ/dx = 10/9 Q/x: tau u = 1.8 R x/a, x being the approach, a the half-width and u the
entrainment speed. Material damping c beside the spring lets the share beta/(tau + beta), beta = c/k, of the steady traction
act at once. The coefficient that acts stays within those of the steady law, and traction ends with the load. What the
contact does on the slip counts as lost, the elastic energy that it stores, some microjoules, with it.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import kernel, law

# Of tau u = 1.8 R x/a: Carter's 2 over 10/9.
RELAXATION = 1.8


class RigidContact(NamedTuple):
    """Traction follows the steady law at once."""


class ElasticContact(NamedTuple):
    """The traction coefficient of each roller at a race is a state."""

    start: int  # where those of this race begin
    length_scale: float  # relaxation length over sqrt(load) [m/sqrt(N)]
    smallest_load: float  # the length stays below it [N]
    smallest_speed: float  # entrainment counts no less [m/s]
    damping_time: float  # beta [s]


def elastic_contact(
    start: int,
    radius: float,
    half_width_scale: float,
    load: float,
    approach: float,
    smallest_load: float,
    smallest_speed: float,
    damping_time: float,
) -> ElasticContact:
    """Law of a race of reduced ``radius`` [m], whose half-width is ``half_width_scale`` sqrt(load) [m/sqrt(N)].

    The relaxation length goes as load^0.4; it is exact at ``load`` [N], of ``approach`` [m], and taken as sqrt(load).
    """
    scale = RELAXATION * radius * approach / (half_width_scale * load)
    return ElasticContact(start, scale, smallest_load, smallest_speed, damping_time)


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
def relaxation_rate(tangential, load, entrainment_speed):
    """1/tau [1/s] at a load [N] and an entrainment speed [m/s]; without load that of the smallest."""
    length = tangential.length_scale * math.sqrt(max(load, tangential.smallest_load))
    speed = entrainment_speed if load > 0.0 else 0.0
    return max(speed, tangential.smallest_speed) / length


@law
def acting_coefficient(tangential, steady, coefficient, load, entrainment_speed):
    """Traction coefficient that acts, of the steady law's and the state's, at a load [N] and entrainment speed [m/s] >= 0."""


@acting_coefficient.body(RigidContact)
def _(tangential, steady, coefficient, load, entrainment_speed):
    return steady


@acting_coefficient.body(ElasticContact)
def _(tangential, steady, coefficient, load, entrainment_speed):
    damped = tangential.damping_time * relaxation_rate(tangential, load, entrainment_speed)
    return coefficient + (steady - coefficient) * damped / (1.0 + damped)


@law
def coefficient_rate(tangential, steady, coefficient, load, entrainment_speed):
    """Rate at which the state follows the steady coefficient [1/s]; arguments as above. Without load it dies away."""


@coefficient_rate.body(RigidContact)
def _(tangential, steady, coefficient, load, entrainment_speed):
    return 0.0


@coefficient_rate.body(ElasticContact)
def _(tangential, steady, coefficient, load, entrainment_speed):
    rate = relaxation_rate(tangential, load, entrainment_speed)
    target = steady if load > 0.0 else 0.0
    return (target - coefficient) * rate / (1.0 + tangential.damping_time * rate)


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
        dy[row, tangential.start + j] = coefficient_rate(tangential, 0.0, y[tangential.start + j], 0.0, 0.0)
