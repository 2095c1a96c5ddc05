"""Point contact by Hertz: load against approach, ellipse and pressure, with complete elliptic integrals and no fits.

Q = K delta^1.5. With E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2], the sum of the four principal curvatures S and
k = a/b >= 1 (Harris, Rolling Bearing Analysis, chapter on contact stress; Johnson, Contact Mechanics, 4.2):

    a = (2 k^2 E/pi)^(1/3) [3 Q/(S E')]^(1/3)      b = a/k      p_0 = 3 Q/(2 pi a b)
    delta = (2 K/pi) [pi/(2 k^2 E)]^(1/3) [3 Q/(S E')]^(2/3) S/2

K and E have the parameter m = 1 - 1/k^2; k is the root of ((k^2+1) E - 2 K)/[(k^2-1) E] = F, the difference of the
curvatures over their sum. Plain functions for setting up rows of balls and for reports; the root is compiled, for sweeps seek
many.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.compiled.kernel import entry, kernel


class PointContact(NamedTuple):
    """Q = K delta^1.5 over an ellipse that grows as Q^(1/3)."""

    stiffness: float  # K [N/m^1.5]
    semi_major: float  # a/Q^(1/3) [m/N^(1/3)]
    semi_minor: float  # b/Q^(1/3) [m/N^(1/3)]
    ellipticity: float  # k = a/b >= 1
    elliptic_second: float  # E(m), also in the friction moment 3/8 mu Q a E of a spinning contact


class Ellipse(NamedTuple):
    """Complete elliptic integrals of the contact ellipse and the curvatures that make it."""

    first: float  # K(m), m = 1 - 1/k^2
    second: float  # E(m)
    curvature_difference: float  # F of this k
    curvature_rest: float  # 1 - F


@kernel
def ellipse(log_ellipticity: float) -> Ellipse:
    """Integrals and curvatures of the ellipse with ln k = ``log_ellipticity`` >= 0, by the arithmetic-geometric mean.

    K = pi/(2 M) and E = K (1 - m/2 - s) with s a sum of squares, which leaves neither F of a near circle nor 1 - F of
    a long ellipse as a small difference of large numbers.
    """
    complement, m = math.exp(-2.0 * log_ellipticity), -math.expm1(-2.0 * log_ellipticity)
    mean, geometric = 1.0, math.sqrt(complement)
    half_gap, squares, weight = 0.5 * m / (1.0 + geometric), 0.0, 1.0
    while half_gap > 1e-17 * mean:
        squares += weight * half_gap**2
        mean, geometric = 0.5 * (mean + geometric), math.sqrt(mean * geometric)
        half_gap = half_gap**2 / (2.0 * (mean + geometric))
        weight *= 2.0
    first = 0.5 * math.pi / mean
    share = 1.0 - 0.5 * m - squares
    if m == 0.0:
        return Ellipse(first, first, 0.0, 1.0)
    difference = (0.5 * m * m - (2.0 - m) * squares) / (m * share)
    rest = 2.0 * complement * (0.5 * m + squares) / (m * share)
    return Ellipse(first, first * share, difference, rest)


@entry
def _shape(curvature_difference: float) -> tuple[float, Ellipse]:
    """Root ln k >= 0 of F(k) = ``curvature_difference`` by secants, and the ellipse there.

    ln[(1 + F)/(1 - F)] is almost a straight line in ln k (pi/2 at its start, 1.6 at k = 10, 2 in the end): few steps,
    each well inside the range.
    """
    if curvature_difference == 0.0:
        return 0.0, ellipse(0.0)
    target = math.log1p(2.0 * curvature_difference / (1.0 - curvature_difference))
    last, now, last_miss = 0.0, target / 1.5, -target
    for _ in range(50):
        shape = ellipse(now)
        miss = math.log1p(2.0 * shape.curvature_difference / shape.curvature_rest) - target
        if miss == last_miss:
            break
        step = miss * (now - last) / (miss - last_miss)
        last, now, last_miss = now, now - step, miss
        if abs(step) <= 1e-15 * now:
            break
    return now, ellipse(now)


def point_contact(curvature_sum: float, curvature_difference: float, equivalent_modulus: float) -> PointContact:
    """Contact of two bodies whose principal curvatures sum to ``curvature_sum`` [1/m].

    ``curvature_difference``: F = |r_I1 - r_I2 + r_II1 - r_II2| over that sum, for principal planes in common.
    ``equivalent_modulus``: E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2] [Pa]. Raises ValueError for curvatures that touch in
    no point (sum <= 0, or F outside [0, 1)) and for E' <= 0.
    """
    if not curvature_sum > 0.0 or not 0.0 <= curvature_difference < 1.0:
        what = f"curvature sum {curvature_sum:g}/m and difference {curvature_difference:g}"
        raise ValueError(f"{what}: a point contact needs a sum above 0 and a difference from 0 to below 1")
    if not equivalent_modulus > 0.0:
        raise ValueError(f"equivalent modulus {equivalent_modulus:g} Pa must be positive")
    log_ellipticity, shape = _shape(curvature_difference)
    return _contact(curvature_sum, equivalent_modulus, math.exp(log_ellipticity), shape.first, shape.second)


def _contact(
    curvature_sum: float, equivalent_modulus: float, ellipticity: float, first: float, second: float
) -> PointContact:
    stretch = (2.0 * ellipticity**2 * second / math.pi) ** (1.0 / 3.0)
    scale = 3.0 / (curvature_sum * equivalent_modulus)
    semi_major = stretch * scale ** (1.0 / 3.0)
    compliance = first / (math.pi * stretch) * scale ** (2.0 / 3.0) * curvature_sum
    return PointContact(compliance**-1.5, semi_major, semi_major / ellipticity, ellipticity, second)


def race_curvature(ball_diameter: float, groove_factor: float, gamma: float) -> tuple[float, float]:
    """Sum of curvatures [1/m] and F of a ball on a race.

    S = (4 - 1/f + 2 g/(1 - g))/D, with ``groove_factor`` f (groove radius over ball diameter) and ``gamma``
    g = D cos(alpha)/d_m, positive for the inner and negative for the outer race. Raises ValueError for a groove that
    is narrower than the ball, or |gamma| >= 1.
    """
    if not groove_factor > 0.5:
        raise ValueError(f"groove factor {groove_factor:g} must be above 0.5, or the ball jams in its groove")
    if not -1.0 < gamma < 1.0:
        raise ValueError(f"gamma = {gamma:g}: the ball must be smaller than the pitch circle")
    along, across = 2.0 * gamma / (1.0 - gamma), 1.0 / groove_factor
    total = 4.0 - across + along
    return total / ball_diameter, (across + along) / total


def ball_on_race(ball_diameter: float, groove_factor: float, gamma: float, equivalent_modulus: float) -> PointContact:
    """Contact of a ball [m] with a race; the long axis lies across the groove. Arguments as ``race_curvature``."""
    total, difference = race_curvature(ball_diameter, groove_factor, gamma)
    return point_contact(total, difference, equivalent_modulus)


def peak_pressure(contact: PointContact, load: Any) -> Any:
    """Largest Hertz pressure [Pa], 3 Q/(2 pi a b), under loads [N]."""
    return 1.5 * np.cbrt(load) / (math.pi * contact.semi_major * contact.semi_minor)
