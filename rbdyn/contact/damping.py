"""Normal damping: the load of a contact that closes or opens. It never pulls."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbdyn.kernel import law


class NoDamping(NamedTuple):
    """Elastic contact only."""


class ViscousDamping(NamedTuple):
    """A fixed share of critical damping at every load, engaged smoothly over a short first approach.

    c = 2 zeta sqrt(k m) with the tangent stiffness k = (10/9) Q/delta; the engagement stands for the oil film
    that the surfaces press out before they touch.
    """

    ratio: float  # zeta [-]
    mass: float  # [kg]
    per_engagement: float  # 1/(approach at which it is fully engaged) [1/m]


class HuntCrossleyDamping(NamedTuple):
    """Hunt and Crossley 1975: Q (1 + 1.5 alpha v); for small speeds the restitution is e = 1 - alpha v."""

    alpha: float  # [s/m]


@law
def damped_load(damping, elastic_load, approach, approach_rate):
    """Load [N] >= 0 of a closed contact: elastic load [N], approach [m] > 0 and its rate [m/s]."""


@damped_load.body(NoDamping)
def _(damping, elastic_load, approach, approach_rate):
    return elastic_load


@damped_load.body(ViscousDamping)
def _(damping, elastic_load, approach, approach_rate):
    tangent_stiffness = 10.0 / 9.0 * elastic_load / approach
    coefficient = 2.0 * damping.ratio * math.sqrt(tangent_stiffness * damping.mass)
    engaged = min(approach * damping.per_engagement, 1.0)
    engaged = engaged * engaged * (3.0 - 2.0 * engaged)
    return max(elastic_load + coefficient * engaged * approach_rate, 0.0)


@damped_load.body(HuntCrossleyDamping)
def _(damping, elastic_load, approach, approach_rate):
    return max(elastic_load * (1.0 + 1.5 * damping.alpha * approach_rate), 0.0)
