"""Point contact of a ball and a race: load against approach, ellipse and pressure by Hertz, and the oil film.

Hertz, with complete elliptic integrals instead of fits:

Q = K delta^1.5. With E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2], the sum of the four principal curvatures S and
k = a/b >= 1 (Harris, Rolling Bearing Analysis, chapter on contact stress; Johnson, Contact Mechanics, 4.2):

    a = (2 k^2 E/pi)^(1/3) [3 Q/(S E')]^(1/3)      b = a/k      p_0 = 3 Q/(2 pi a b)
    delta = (2 K/pi) [pi/(2 k^2 E)]^(1/3) [3 Q/(S E')]^(2/3) S/2

K and E have the parameter m = 1 - 1/k^2. k is the root of ((k^2+1) E - 2 K)/[(k^2-1) E] = F, the difference of the curvatures
over their sum. It is compiled, because sweeps need many roots.

Film: thickness and stiffness by Hamrock and Dowson (1977), with U = eta u/(E' R_x), G = alpha E', W = Q/(E' R_x^2). R_x is the
reduced radius along the rolling direction, u the mean speed of the two surfaces and k = a/b the ellipticity. Chang, Hu and Cao
2024, eq 14, print two wrong exponents (0.69 for 0.67, 0.061 for 0.61); their film stiffness, eq 15, is the derivative of the
right form. ``film_thickness.lambda_ratio`` relates the film to roughness.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.compiled.kernel import entry, kernel
from rbdyn.contact.film_thickness import inlet_heating
from rbdyn.properties.materials import Oil


class PointContact(NamedTuple):
    """Q = K delta^1.5 over an ellipse that grows as Q^(1/3)."""

    stiffness: float  # K [N/m^1.5]
    semi_major: float  # a/Q^(1/3) [m/N^(1/3)]
    semi_minor: float  # b/Q^(1/3) [m/N^(1/3)]
    ellipticity: float  # k = a/b >= 1
    elliptic_second: float  # E(m), also in the friction moment 3/8 mu Q a E of a spinning contact


class Ellipse(NamedTuple):
    """Complete elliptic integrals of the contact ellipse and its curvatures."""

    first: float  # K(m), m = 1 - 1/k^2
    second: float  # E(m)
    curvature_difference: float  # F of this k
    curvature_complement: float  # 1 - F


@kernel
def ellipse(log_ellipticity: float) -> Ellipse:
    """Integrals and curvatures of the ellipse with ln k = ``log_ellipticity`` >= 0, by the arithmetic-geometric mean.

    K = pi/(2 M) and E = K (1 - m/2 - s) with s a sum of squares. So neither F of a near circle nor 1 - F of a long ellipse is a
    small difference of large numbers.
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
    complement_share = 2.0 * complement * (0.5 * m + squares) / (m * share)
    return Ellipse(first, first * share, difference, complement_share)


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
        miss = math.log1p(2.0 * shape.curvature_difference / shape.curvature_complement) - target
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
    ``equivalent_modulus``: E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2] [Pa]. Curvatures that touch in a point have a sum
    above 0 and F from 0 to below 1.
    """
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

    S = (4 - 1/f + 2 g/(1 - g))/D. ``groove_factor`` f is the groove radius over the ball diameter; ``gamma`` g = D cos(alpha)/d_m
    is positive for the inner and negative for the outer race. f is above 0.5, |g| below 1.
    """
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


# Powers of the load in the central and in the thinnest film.
CENTRAL_LOAD, THINNEST_LOAD = 0.067, 0.073


class RollingBall(NamedTuple):
    """A ball that rolls on a race, the long axis of the ellipse across the rolling direction."""

    contact: PointContact
    radius: float  # R_x, reduced along the rolling direction [m]
    equivalent_modulus: float  # E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2] [Pa]
    entrainment_speed: float  # mean of the surface speeds > 0 [m/s]


def rolling_radius(ball_diameter: float, gamma: float) -> float:
    """R_x = D/2 (1 - g) of a ball [m] on a race: g = D cos(alpha)/d_m, negative for the outer race."""
    return 0.5 * ball_diameter * (1.0 - gamma)


def entrainment_speed(pitch_diameter: float, gamma: float, inner_speed: float, outer_speed: float = 0.0) -> float:
    """Mean surface speed [m/s] of both contacts in pure rolling: d_m/4 (1 - g^2) |w_i - w_o|; the speeds in rad/s."""
    return 0.25 * pitch_diameter * (1.0 - gamma**2) * abs(inner_speed - outer_speed)


def _groups(ball: RollingBall, oil: Oil, load: Any) -> tuple[float, float, Any]:
    stiffness = ball.equivalent_modulus * ball.radius
    speed = oil.viscosity * ball.entrainment_speed / stiffness
    return speed, oil.pressure_coefficient * ball.equivalent_modulus, load / (stiffness * ball.radius)


def central_film(ball: RollingBall, oil: Oil, load: Any) -> Any:
    """Isothermal, flooded film in the middle of the contact [m] under loads [N] above 0.

    2.69 R_x U^0.67 G^0.53 W^-0.067 (1 - 0.61 exp(-0.73 k)).
    """
    speed, material, weight = _groups(ball, oil, load)
    ellipse = 1.0 - 0.61 * np.exp(-0.73 * ball.contact.ellipticity)
    return 2.69 * ball.radius * speed**0.67 * material**0.53 * weight**-CENTRAL_LOAD * ellipse


def minimum_film(ball: RollingBall, oil: Oil, load: Any) -> Any:
    """Isothermal, flooded minimum film [m] under loads [N] above 0.

    3.63 R_x U^0.68 G^0.49 W^-0.073 (1 - exp(-0.68 k)).
    """
    speed, material, weight = _groups(ball, oil, load)
    ellipse = 1.0 - np.exp(-0.68 * ball.contact.ellipticity)
    return 3.63 * ball.radius * speed**0.68 * material**0.49 * weight**-THINNEST_LOAD * ellipse


def thermal_factor(ball: RollingBall, oil: Oil, load: Any, slip: Any = 0.0) -> Any:
    """Reduction of the film by shear heating of the inlet, at a slip [m/s], by a fit for line contacts."""
    pressure = peak_pressure(ball.contact, load) / ball.equivalent_modulus
    return inlet_heating(pressure, oil, ball.entrainment_speed, slip)


def film_stiffness(ball: RollingBall, oil: Oil, load: Any) -> Any:
    """Stiffness of the central film, -dQ/dh [N/m].

    Q/(0.067 h), which is E' R_x/(0.067 * 2.69) W^1.067/[U^0.67 G^0.53 (1 - 0.61 exp(-0.73 k))]: the magnitude of
    Chang, Hu and Cao 2024, eq 15.
    """
    return load / (CENTRAL_LOAD * central_film(ball, oil, load))
