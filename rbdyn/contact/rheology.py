"""Traction of an elastohydrodynamic film from the rheology of its oil: shear stress over the Hertz pressure.

A rheology gives the shear stress at a pressure, for a slip across a film. Plain functions of floats or arrays that broadcast, for
the construction of laws; the simulation itself uses ``contact.traction``.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from rbdyn.contact.film_thickness import RollingContact, half_width, hertz_pressure
from rbdyn.properties.materials import ABSOLUTE_ZERO_C

# Gauss-Legendre in the angle theta, x = b sin(theta). Relative error up to 4 GPa, against adaptive quadrature: below
# 3e-7 for aircraft oils at 100 C, 3e-6 for ten times their pressure coefficient; with limiting shear below 2e-5,
# with a cap below 5e-4.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_COSINES = np.cos(0.25 * math.pi * (_NODES + 1.0))
_SHARES = _WEIGHTS * _COSINES  # (2/(pi p_H)) 2 (pi/4) sum(w cos(theta) tau) = sum(share tau)/p_H
# Largest exponent of the pressure, against overflow; such an oil is solid at far lower pressure.
LARGEST_EXPONENT = 300.0


class Rheology(Protocol):
    """Shear stress of an oil."""

    def stress(self, pressure: Any, slip: Any, film: Any) -> Any:
        """Shear stress [Pa] at a pressure [Pa] > 0, a slip [m/s] >= 0 and a film thickness [m]."""

    def __hash__(self) -> int:
        """Of its constants, by which a table of tractions is known."""


class OilConstants(NamedTuple):
    """Gupta, Flamand, Berthe and Godet 1981: viscosity and its thermal coefficient inside a traction contact.

    eta* = viscosity exp(rate (313 - T)), beta* = thermal (T/313)^power, growing with pressure as exp(alpha* p).
    Fitted to traction measured near 0.8 to 1.5 GPa; elsewhere they extrapolate.
    """

    viscosity: float  # at 313 K [Pa s]
    rate: float  # [1/K]
    pressure_coefficient: float  # alpha* [1/Pa]
    thermal: float  # at 313 K [1/K]
    power: float  # [-]


# Tabulated with ADORE-style oil data. Santotrac 50 differs by a factor of 25 in viscosity and in its power of temperature:
# the values are unchanged, but unreliable without the original paper.
OIL_CONSTANTS: dict[str, OilConstants] = {
    "MIL-L-7808": OilConstants(0.11431, 0.033723, 5.2214e-9, 0.041745, 0.60873),
    "MIL-L-23699": OilConstants(0.26529, 0.036358, 5.8015e-9, 0.033398, 1.3075),
    "MIL-L-27502": OilConstants(0.21655, 0.039221, 5.8015e-9, 0.032577, 1.0723),
    "Santotrac 30": OilConstants(0.40063, 0.050459, 9.4275e-9, 0.034104, 1.093),
    "Santotrac 50": OilConstants(10.076, 0.044097, 7.2519e-9, 0.020794, 6.2743),
    "Mobil DTE SAE30": OilConstants(0.28407, 0.023743, 7.2516e-9, 0.028939, 2.1402),
}


def _barus(viscosity: float, coefficient: float, pressure: Any) -> Any:
    return viscosity * np.exp(np.minimum(coefficient * pressure, LARGEST_EXPONENT))


def _capped(stress: Any, cap: Any) -> Any:
    """The smaller of two stresses with a smooth transition: 0.05 % less at half the cap, 2 % at 0.8, 8 % at one."""
    small, large = np.minimum(stress, cap), np.maximum(stress, cap)
    eighth = np.square(np.square(np.square(small / large)))
    return small / np.sqrt(np.sqrt(np.sqrt(1.0 + eighth)))


@dataclass(frozen=True)
class ThermalNewtonian:
    """Newtonian oil that heats up in its midplane (Crook; Gupta et al. 1981).

    tau = eta_p (u/h) asinh(y)/(y sqrt(1 + y^2)), y = u sqrt(eta_p beta/(8 k)), eta_p = eta exp(alpha p). Its peak is unbounded,
    proportional to the root of eta_p, so the stress may be capped at ``largest_ratio`` of the pressure.
    """

    viscosity: float  # eta [Pa s]
    pressure_coefficient: float  # alpha [1/Pa]
    thermal_coefficient: float  # beta [1/K]
    conductivity: float  # k [W/(m K)]
    largest_ratio: float = math.inf  # [-]

    def stress(self, pressure: Any, slip: Any, film: Any) -> Any:
        """Shear stress [Pa]."""
        viscosity = _barus(self.viscosity, self.pressure_coefficient, pressure)
        heating = np.sqrt(viscosity * self.thermal_coefficient / (8.0 * self.conductivity))
        y = np.maximum(slip * heating, 1e-12)  # asinh(y)/y is one to round-off below, and 0/0 at rest
        stress = viscosity * slip / film * (np.arcsinh(y) / y / np.sqrt(1.0 + y * y))
        return _capped(stress, self.largest_ratio * pressure)


@dataclass(frozen=True)
class Eyring:
    """tau = tau_0 asinh(eta gd/tau_0) with eta = eta_0 exp(alpha p), capped at ``largest_ratio`` of the pressure."""

    viscosity: float  # eta_0 [Pa s]
    pressure_coefficient: float  # alpha [1/Pa]
    eyring_stress: float  # tau_0 [Pa]
    largest_ratio: float = math.inf  # [-]

    def stress(self, pressure: Any, slip: Any, film: Any) -> Any:
        """Shear stress [Pa]."""
        viscosity = _barus(self.viscosity, self.pressure_coefficient, pressure)
        stress = self.eyring_stress * np.arcsinh(viscosity * slip / (film * self.eyring_stress))
        return _capped(stress, self.largest_ratio * pressure)


@dataclass(frozen=True)
class LimitingShear:
    """tau = tau_L [1 - exp(-eta gd/tau_L)], tau_L = ratio p, eta = eta_0 exp(alpha p) (Bair and Winer 1979)."""

    viscosity: float  # eta_0 [Pa s]
    pressure_coefficient: float  # alpha [1/Pa]
    ratio: float  # [-]

    def stress(self, pressure: Any, slip: Any, film: Any) -> Any:
        """Shear stress [Pa]."""
        limit = self.ratio * pressure
        viscosity = _barus(self.viscosity, self.pressure_coefficient, pressure)
        return -limit * np.expm1(-viscosity * slip / (film * limit))


def thermal_newtonian(
    oil: str, temperature_c: float, conductivity: float, largest_ratio: float = math.inf
) -> ThermalNewtonian:
    """Rheology of an oil of ``OIL_CONSTANTS`` at a temperature [C], with its conductivity [W/(m K)].

    Raises KeyError for an unknown oil.
    """
    constants = OIL_CONSTANTS[oil]
    kelvin = temperature_c - ABSOLUTE_ZERO_C
    return ThermalNewtonian(
        constants.viscosity * math.exp(constants.rate * (313.0 - kelvin)),
        constants.pressure_coefficient,
        constants.thermal * (kelvin / 313.0) ** constants.power,
        conductivity,
        largest_ratio,
    )


def traction_coefficient(rheology: Rheology, contact: RollingContact, slip: Any, load: Any, film: Any) -> Any:
    """Traction coefficient [-] at slips [m/s] >= 0, loads [N] > 0 and films [m], which broadcast.

    mu = (l/Q) times the integral of the stress over the Hertz pressure p_H sqrt(1 - (x/b)^2).
    """
    # Separate axes, so that functions of the load alone are computed once for all slips.
    slip, load, film = (np.asarray(value, float)[..., np.newaxis] for value in (slip, load, film))
    peak = hertz_pressure(contact, load)
    stress = rheology.stress(peak * _COSINES, slip, film)
    return (stress / peak) @ _SHARES


def with_body_creep(coefficient: Any, contact: RollingContact, slip: Any, load: Any) -> Any:
    """Traction coefficient of a film between elastic bodies, from that of the film alone at a slip [m/s] > 0.

    Rolling bodies creep: even a solid film gives at most mu = 2 R u/(b u_e) at small slip u (Carter 1926), with b the half-width
    and u_e the entrainment speed. This bounds the slope where pressure makes a film nearly solid. Film and bodies combine by
    1/mu^2 = 1/mu_film^2 + 1/mu_creep^2.
    """
    creep = 2.0 * contact.radius * slip / (half_width(contact, load) * contact.entrainment_speed)
    return coefficient / np.sqrt(1.0 + np.square(coefficient / creep))
