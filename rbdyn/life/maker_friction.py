"""What makers say of the friction of a cylindrical roller bearing: SKF's model, and the heat of ISO 15312.

SKF's formulas (Rolling Bearings, catalogue of 2013) are in mm, N, rpm and mm^2/s; here all is in SI. What stands from memory
says so.

They are a maker's model, not measurements: at the reference speed they are 0.94 to 2.2 times the heat of ISO 15312.
"""

import math
from typing import NamedTuple

from rbdyn.base.fields import RPM
from rbdyn.properties.catalogue import Envelope


class SeriesFactors(NamedTuple):
    """Factors of one dimension series: R1 and S1 of SKF's friction model, and k_r of its minimum load."""

    rolling: float
    sliding: float
    minimum_load: float


# k_r of series 10 is from memory; the others were read.
SERIES = {
    "10": SeriesFactors(1.12e-6, 0.17, 0.10),
    "2": SeriesFactors(1.09e-6, 0.16, 0.15),
    "22": SeriesFactors(1.40e-6, 0.16, 0.20),
    "3": SeriesFactors(1.09e-6, 0.16, 0.15),
    "23": SeriesFactors(1.48e-6, 0.16, 0.25),
}
RADIAL_SLIDING = 0.0015  # S2
ROLLER_GEOMETRY = 5.1  # K_Z of cylindrical roller bearings with a cage
# K_rs: 3e-8 of baths and jets, 6e-8 of grease and oil-air; SKF names no drop feed, which is taken as a bath.
STARVATION, SCARCE_STARVATION = 3e-8, 6e-8
SCARCE = ("grease", "oil_air")
# mu_bl of a bearing that turns: 0.12 in the catalogue of 2018, from memory; that of 2013 has 0.15 for all.
BOUNDARY_FRICTION, FILM_FRICTION = 0.12, 0.02
# ISO 15312: heat flow density at 50 K above the surroundings, up to a seat of 50 000 mm^2; above it falls with the power
# -0.34 of the seat (from memory) [W/mm^2], [mm^2].
HEAT_FLOW, LARGE_SEAT, LARGE_SEAT_EXPONENT = 0.016, 5e4, -0.34


class FrictionMoments(NamedTuple):
    """Rolling and sliding frictional moment [N m], without drag of a bath and without seals."""

    rolling: float
    sliding: float


def inlet_heating_factor(mean_diameter: float, speed: float, viscosity: float) -> float:
    """phi_ish, what shear in the inlet leaves of the rolling moment: 1/(1 + 1.84e-9 (n d_m)^1.28 nu^0.64).

    Mean diameter [m], speed [rad/s], kinematic viscosity [m^2/s].
    """
    fast = abs(speed) / RPM * mean_diameter * 1e3
    return 1.0 / (1.0 + 1.84e-9 * fast**1.28 * (viscosity * 1e6) ** 0.64)


def starvation_factor(bore: float, outside: float, speed: float, viscosity: float, supply: str | None = None) -> float:
    """phi_rs, what starvation leaves of the rolling moment: exp(-K_rs nu n (d + D) sqrt(K_Z/(2 (D - d)))).

    Bore and outside diameter [m], speed [rad/s], kinematic viscosity [m^2/s]; ``supply`` as ``lubricant.supply``.
    """
    constant = SCARCE_STARVATION if supply in SCARCE else STARVATION
    inner, outer = bore * 1e3, outside * 1e3
    room = math.sqrt(ROLLER_GEOMETRY / (2.0 * (outer - inner)))
    return math.exp(-constant * viscosity * 1e6 * abs(speed) / RPM * (inner + outer) * room)


def sliding_friction(mean_diameter: float, speed: float, viscosity: float) -> float:
    """mu_sl = phi_bl mu_bl + (1 - phi_bl) mu_EHL with phi_bl = exp(-2.6e-8 (n nu)^1.4 d_m); units as above."""
    flow = abs(speed) / RPM * viscosity * 1e6
    boundary = math.exp(-2.6e-8 * flow**1.4 * mean_diameter * 1e3)
    return boundary * BOUNDARY_FRICTION + (1.0 - boundary) * FILM_FRICTION


def skf_moments(
    series: str,
    bore: float,
    outside: float,
    speed: float,
    viscosity: float,
    radial_load: float,
    axial_load: float = 0.0,
    supply: str | None = None,
) -> FrictionMoments:
    """Frictional moments of a bearing with a cage by SKF's model.

    M_rr = phi_ish phi_rs R1 d_m^2.41 F_r^0.31 (nu n)^0.6 and M_sl = (S1 d_m^0.9 F_a + S2 d_m F_r) mu_sl, d_m = (d + D)/2.
    Bore and outside diameter [m], speed [rad/s], kinematic viscosity [m^2/s], loads [N]. Raises KeyError for a series
    that is not in ``SERIES``.
    """
    factors, mean = SERIES[series], 0.5 * (bore + outside)
    diameter, flow = mean * 1e3, abs(speed) / RPM * viscosity * 1e6
    left = inlet_heating_factor(mean, speed, viscosity) * starvation_factor(bore, outside, speed, viscosity, supply)
    rolling = left * factors.rolling * diameter**2.41 * radial_load**0.31 * flow**0.6
    sliding = factors.sliding * diameter**0.9 * axial_load + RADIAL_SLIDING * diameter * radial_load
    return FrictionMoments(1e-3 * rolling, 1e-3 * sliding * sliding_friction(mean, speed, viscosity))


def iso_15312_heat(sizes: Envelope) -> float:
    """Heat that leaves a bearing through its seats pi B (D + d) at 70 C in surroundings of 20 C [W].

    The conditions of the reference speed: 0.05 C0, 12 mm^2/s at 70 C, a bath to the middle of the lowest roller.
    """
    seat = math.pi * sizes.width * (sizes.bore + sizes.outside)
    return HEAT_FLOW * seat * max(seat / LARGE_SEAT, 1.0) ** LARGE_SEAT_EXPONENT
