"""Normal damping: the load of a contact that closes or opens. It never pulls."""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import law_of


class NoDamping(NamedTuple):
    """Elastic contact only."""


class ViscousDamping(NamedTuple):
    """A fixed share of critical damping at every load, engaged smoothly over a short first approach.

    c = 2 zeta sqrt(k m) with the tangent stiffness k. The engagement represents the oil film that the surfaces squeeze out before
    they touch.
    """

    scale: float  # 2 zeta sqrt(m) [sqrt(kg)]
    per_engagement: float  # 1/(approach at which it is fully engaged) [1/m]


class HuntCrossleyDamping(NamedTuple):
    """Hunt and Crossley 1975: Q (1 + 1.5 alpha v); for small speeds the restitution is e = 1 - alpha v."""

    alpha: float  # [s/m]


def alpha_of_restitution(restitution: float, speed: float) -> float:
    """Hunt and Crossley's alpha [s/m] that gives a restitution in (0, 1] at an impact speed [m/s].

    Exact, and the same for any power law: m v dv = -K x^n (1 + 1.5 alpha v) dx, integrated from v to -e v, gives
    d (1 + e) = ln[(1 + d)/(1 - e d)] with d = 1.5 alpha v.
    """
    if restitution == 1.0:
        return 0.0

    def excess(d: float) -> float:
        return math.log1p(d) - math.log1p(-restitution * d) - d * (1.0 + restitution)

    # Below the root the linear term is larger; towards d = 1/e the logarithm is unbounded: bisection cannot fail.
    low, high = 0.0, 1.0 / restitution
    for _ in range(200):
        middle = 0.5 * (low + high)
        if restitution * middle < 1.0 and excess(middle) < 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high) / (1.5 * speed)


@law_of(NoDamping)
def damped_load(damping, elastic_load, root_stiffness, approach, approach_rate):
    """Load [N] >= 0 of a closed contact.

    From the elastic load [N], the root of the tangent stiffness [sqrt(N/m)], the approach [m] > 0 and its rate [m/s].
    """
    return elastic_load


@damped_load.body(ViscousDamping)
def _(damping, elastic_load, root_stiffness, approach, approach_rate):
    coefficient = damping.scale * root_stiffness
    engaged = min(approach * damping.per_engagement, 1.0)
    engaged = engaged * engaged * (3.0 - 2.0 * engaged)
    return max(elastic_load + coefficient * engaged * approach_rate, 0.0)


@damped_load.body(HuntCrossleyDamping)
def _(damping, elastic_load, root_stiffness, approach, approach_rate):
    return max(elastic_load * (1.0 + 1.5 * damping.alpha * approach_rate), 0.0)
