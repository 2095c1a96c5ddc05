"""Oil film of a rolling line contact: thickness, lambda ratio, and the share of the load that asperities carry.

Plain functions of floats or arrays that broadcast, for the construction of laws and for reports. The groups are
U = eta u/(E' R), G = alpha E', W = Q/(l E' R), with u the mean speed of the two surfaces.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.properties.materials import Oil

# Exponent of viscosity in films: 0.67 of points to 0.69 of lines. The fit of the thermal factor ends where it falls as steeply: beyond,
# a thicker oil would have the thinner film, and the numerator passes zero for cold oil at high speed.
FALL = 0.67
# Steps that halve an interval of 40 down to round-off.
HALVINGS = 60
# End of the starvation fit, from which the inlet counts as flooded.
FLOODED = 8.0


class RollingContact(NamedTuple):
    """Two cylinders that roll on each other."""

    radius: float  # reduced, 1/(1/R_1 +- 1/R_2) [m]
    length: float  # [m]
    equivalent_modulus: float  # E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2] [Pa]
    entrainment_speed: float  # mean of the surface speeds > 0 [m/s]


def hertz_pressure(contact: RollingContact, load: Any) -> Any:
    """Largest Hertz pressure [Pa] under a load [N]."""
    per_length = load / contact.length
    return np.sqrt(per_length * contact.equivalent_modulus / (2.0 * math.pi * contact.radius))


def half_width(contact: RollingContact, load: Any) -> Any:
    """Half-width of the Hertz contact [m] under a load [N]."""
    per_length = load / contact.length
    return np.sqrt(8.0 * per_length * contact.radius / (math.pi * contact.equivalent_modulus))


def _groups(contact: RollingContact, oil: Oil, load: Any) -> tuple[float, float, Any]:
    stiffness = contact.equivalent_modulus * contact.radius
    speed = oil.viscosity * contact.entrainment_speed / stiffness
    return speed, oil.pressure_coefficient * contact.equivalent_modulus, load / (contact.length * stiffness)


def central_film(contact: RollingContact, oil: Oil, load: Any) -> Any:
    """Isothermal, flooded film in the middle of the contact [m]: 3.06 R U^0.69 G^0.56 W^-0.10 (Dowson and Toyoda 1979)."""
    speed, material, weight = _groups(contact, oil, load)
    return 3.06 * contact.radius * speed**0.69 * material**0.56 * weight**-0.10


def minimum_film(contact: RollingContact, oil: Oil, load: Any) -> Any:
    """Isothermal, flooded minimum film [m]: 2.65 R U^0.70 G^0.54 W^-0.13 (Dowson and Higginson 1966)."""
    speed, material, weight = _groups(contact, oil, load)
    return 2.65 * contact.radius * speed**0.70 * material**0.54 * weight**-0.13


def thermal_factor(contact: RollingContact, oil: Oil, load: Any, slip: Any = 0.0) -> Any:
    """Reduction of the film by shear heating of the inlet, at a slip [m/s] (Gupta, Cheng and Zhu 1992).

    (1 - 13.2 (p_H/E') L^0.42)/(1 + 0.213 (1 + 2.23 S^0.83) L^0.64), L = (-d eta/dT) u^2/k, S = slip/u. Zhou and Hoeprich 1991,
    eq 21, print the same constants. Beyond the L where it falls with L^-0.67 it goes on so, and films keep their thickness.
    """
    pressure = hertz_pressure(contact, load) / contact.equivalent_modulus
    return inlet_heating(pressure, oil, contact.entrainment_speed, slip)


def inlet_heating(relative_pressure: Any, oil: Oil, entrainment_speed: Any, slip: Any = 0.0) -> Any:
    """The thermal factor at a Hertz pressure p_H/E', for line and point contacts."""
    heating = oil.viscosity_slope * entrainment_speed**2 / oil.conductivity
    slide_roll = np.abs(slip) / entrainment_speed
    weights = 13.2 * relative_pressure, 0.213 * (1.0 + 2.23 * slide_roll**0.83)
    fitted, beyond = _thermal_fit(heating, *weights), _thermal_fall(heating, *weights) > FALL
    if not np.any(beyond):
        return fitted
    # The steepness grows with L, so halving the interval of its logarithm finds the end to round-off.
    low, high = np.zeros(np.broadcast(heating, *weights).shape), np.log1p(heating)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        steep = _thermal_fall(np.expm1(middle), *weights) > FALL
        low, high = np.where(steep, low, middle), np.where(steep, middle, high)
    end = np.expm1(low)
    return np.where(beyond, _thermal_fit(end, *weights) * (end / heating) ** FALL, fitted)


def _thermal_fit(heating: Any, pressure: Any, slip: Any) -> Any:
    return (1.0 - pressure * heating**0.42) / (1.0 + slip * heating**0.64)


def _thermal_fall(heating: Any, pressure: Any, slip: Any) -> Any:
    """-d ln(factor)/d ln(L) of the fit, infinite where the factor is not positive."""
    above, below = pressure * heating**0.42, slip * heating**0.64
    # A numerator of zero or less has no logarithm.
    left = np.maximum(1.0 - above, 1e-9)
    return 0.42 * above / left + 0.64 * below / (1.0 + below)


def starvation_factor(contact: RollingContact, load: Any, film: Any, inlet_distance: float) -> Any:
    """Reduction of a flooded film [m] by a short inlet; the oil begins ``inlet_distance`` half-widths ahead.

    1 - exp(-1.68005 s^0.8315 + 0.260137 s^1.558 - 0.016146 s^2.296), s = distance (b^2/(2 h R))^(2/3): a fit for ADORE-style
    inputs, where the distance is 10. It is 1 from s = 8.
    """
    width = half_width(contact, load)
    s = np.minimum(inlet_distance * (width**2 / (2.0 * film * contact.radius)) ** (2.0 / 3.0), FLOODED)
    part = 1.0 - np.exp(-1.68005 * s**0.8315 + 0.260137 * s**1.558 - 0.016146 * s**2.296)
    return np.where(s < FLOODED, part, 1.0)


def film_in_service(contact: RollingContact, oil: Oil, load: Any, inlet_distance: float | None = None) -> Any:
    """Central film [m] in pure rolling, with inlet heating and, with an inlet distance, starvation."""
    film = central_film(contact, oil, load) * thermal_factor(contact, oil, load)
    if inlet_distance is None:
        return film
    return film * starvation_factor(contact, load, film, inlet_distance)


def lightest_load(contact: RollingContact, oil: Oil) -> float:
    """Load [N] below which the film of rigid cylinders (Martin: 4.9 R U/W) is thicker than the elastic one."""
    speed, material, _ = _groups(contact, oil, 0.0)
    weight = (4.9 / 3.06 * speed**0.31 * material**-0.56) ** (1.0 / 0.9)
    return float(weight * contact.length * contact.equivalent_modulus * contact.radius)


def lambda_ratio(film: Any, first_roughness: float, second_roughness: float) -> Any:
    """Film over composite roughness, h/sqrt(s_1^2 + s_2^2), from rms roughnesses [m] of which one is > 0."""
    return film / math.hypot(first_roughness, second_roughness)
