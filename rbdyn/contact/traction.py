"""Traction coefficient against sliding speed."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbdyn.elementary import fast_exp
from rbdyn.kernel import law


class NoTraction(NamedTuple):
    """Frictionless contact."""


class FourConstantTraction(NamedTuple):
    """Gupta's law mu(u) = (A + B u) exp(-C u) + D (Chen et al. 2022, eq 12) with mu(0) = 0, that is A = -D."""

    a: float  # [-]
    b: float  # [s/m]
    c: float  # [s/m]
    d: float  # [-]


class BlendedFourConstantTraction(NamedTuple):
    """Gupta's law with mu(0) > 0: its jump at rest is blended, mu(u) v/sqrt(u^2 + u_r^2)."""

    a: float  # [-]
    b: float  # [s/m]
    c: float  # [s/m]
    d: float  # [-]
    blend_speed: float  # u_r [m/s]


class CoulombTraction(NamedTuple):
    """Dry friction mu tanh(u/u_r)."""

    coefficient: float  # [-]
    blend_speed: float  # u_r [m/s]


def four_constants(mu_0: float, mu_m: float, mu_inf: float, u_m: float) -> tuple[float, float, float, float]:
    """Gupta's A, B, C, D from mu at rest, the peak mu_m at the sliding speed u_m [m/s], and mu far beyond it.

    D = mu_inf, A = mu_0 - mu_inf; with x = A + B u_m the peak conditions give x exp(-(x - A)/x) = mu_m - mu_inf
    and C = B/x. Needs mu_m > mu_inf, mu_m > mu_0 and u_m > 0, else ValueError.
    """
    if not (mu_m > mu_inf and mu_m > mu_0 and u_m > 0.0):
        raise ValueError("the peak traction must lie above the values at rest and at high sliding speed")
    a, peak = mu_0 - mu_inf, mu_m - mu_inf

    def excess(x: float) -> float:
        return x * math.exp(-(x - a) / x) - peak

    # The left side rises from below the peak at the lower end, without bound: bisection cannot fail.
    low = max(a, 0.0) if a > 0.0 else 1e-300
    high = max(4.0 * peak, 2.0 * abs(a), 1e-12)
    while excess(high) < 0.0:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    x = 0.5 * (low + high)
    b = (x - a) / u_m
    return a, b, b / x, mu_inf


@law
def traction(model, slip):
    """Signed traction coefficient at a signed slip [m/s]; traction times slip is never negative."""


@traction.body(NoTraction)
def _(model, slip):
    return 0.0


@traction.body(FourConstantTraction)
def _(model, slip):
    speed = abs(slip)
    return math.copysign((model.a + model.b * speed) * fast_exp(-model.c * speed) + model.d, slip)


@traction.body(BlendedFourConstantTraction)
def _(model, slip):
    speed = abs(slip)
    coefficient = (model.a + model.b * speed) * fast_exp(-model.c * speed) + model.d
    return coefficient * slip / math.sqrt(slip * slip + model.blend_speed * model.blend_speed)


@traction.body(CoulombTraction)
def _(model, slip):
    return model.coefficient * math.tanh(slip / model.blend_speed)
