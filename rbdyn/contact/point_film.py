"""Oil film of a ball on a race: thickness and stiffness after Hamrock and Dowson (1977).

Plain functions of floats or arrays, for reports. With U = eta u/(E' R_x), G = alpha E', W = Q/(E' R_x^2), where R_x is
the reduced radius along the rolling direction, u the mean speed of the two surfaces and k = a/b the ellipticity.
Chang, Hu and Cao 2024, eq 14, print two exponents wrong (0.69 for 0.67, 0.061 for 0.61); their film stiffness, eq 15,
is the derivative of the right form. Roughness and film meet in ``film_thickness.lambda_ratio``.
"""

from typing import Any, NamedTuple

import numpy as np

from rbdyn.contact.film_thickness import inlet_heating
from rbdyn.contact.hertz_point import PointContact, peak_pressure
from rbdyn.properties.lubricants import Oil

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
    """Isothermal, flooded film where it is thinnest [m] under loads [N] above 0.

    3.63 R_x U^0.68 G^0.49 W^-0.073 (1 - exp(-0.68 k)).
    """
    speed, material, weight = _groups(ball, oil, load)
    ellipse = 1.0 - np.exp(-0.68 * ball.contact.ellipticity)
    return 3.63 * ball.radius * speed**0.68 * material**0.49 * weight**-THINNEST_LOAD * ellipse


def thermal_factor(ball: RollingBall, oil: Oil, load: Any, slip: Any = 0.0) -> Any:
    """What shear heating of the inlet leaves of the film, at a slip [m/s]; the fit was made for line contacts."""
    pressure = peak_pressure(ball.contact, load) / ball.equivalent_modulus
    return inlet_heating(pressure, oil, ball.entrainment_speed, slip)


def film_stiffness(ball: RollingBall, oil: Oil, load: Any) -> Any:
    """How much more load thins the central film by a metre, -dQ/dh [N/m].

    Q/(0.067 h), which is E' R_x/(0.067 * 2.69) W^1.067/[U^0.67 G^0.53 (1 - 0.61 exp(-0.73 k))]: the magnitude of
    Chang, Hu and Cao 2024, eq 15.
    """
    return load / (CENTRAL_LOAD * central_film(ball, oil, load))
