"""Catalogue ratings of a single row of balls from its dimensions: ISO 281 (dynamic), ISO 76 (static).

The factors follow the standards as they are commonly restated, not their text. f_c = 0.41 * 98.0665 * 0.95 times
Lundberg and Palmgren's terms gives the printed table of ISO 281 within 0.1 % with both grooves at 0.52; the static
rating is worked out from its definition (4200 MPa) instead of read from f_0.
Lengths in m, angles in rad.
"""

import math

from rbdyn.contact.hertz_point import PointContact, peak_pressure
from rbdyn.faults import MethodError

# lambda of a single row: what practice falls short of the theory (ISO/TR 1281-1), and the theory's constant [N, mm].
REDUCTION = 0.95
CAPACITY_CONSTANT = 0.41 * 98.0665
RATING_FACTOR = 1.3  # b_m of ball bearings of contemporary steel
LARGEST_PLAIN_BALL = 25.4  # [mm]; above, capacity grows as the power 1.4 of the diameter
STATIC_PRESSURE = 4.2e9  # [Pa]
MOST_LOADED = 5.0  # Stribeck's Q_max Z cos(alpha)/F_r


def groove_ratio(inner_groove_factor: float, outer_groove_factor: float) -> float:
    """[r_i (2 r_e - D)/(r_e (2 r_i - D))]^0.41: how much the grooves favour the inner race over the outer."""
    closeness = inner_groove_factor / (2.0 * inner_groove_factor - 1.0)
    return float((closeness * (2.0 * outer_groove_factor - 1.0) / outer_groove_factor) ** 0.41)


def ball_size_term(ball_diameter: float) -> float:
    """D^1.8 of a ball [mm^1.8], 3.647 D^1.4 above 25.4 mm; the diameter in m."""
    millimetres = ball_diameter * 1e3
    return millimetres**1.8 if millimetres <= LARGEST_PLAIN_BALL else 3.647 * millimetres**1.4


def refuse_impossible(gamma: float, inner_groove_factor: float, outer_groove_factor: float) -> None:
    """Raise MethodError unless 0 < gamma < 1 and both groove factors exceed 0.5."""
    if not 0.0 < gamma < 1.0:
        raise MethodError(f"gamma = {gamma:g}: the ball must be smaller than the pitch circle")
    if not min(inner_groove_factor, outer_groove_factor) > 0.5:
        what = f"groove factors {inner_groove_factor:g} and {outer_groove_factor:g} must be above 0.5"
        raise MethodError(f"{what}, or the ball jams")


def capacity_factor(gamma: float, inner_groove_factor: float = 0.52, outer_groove_factor: float = 0.52) -> float:
    """f_c of a radial or angular contact ball bearing (ISO 281, in N and mm), gamma = D cos(alpha)/d_m.

    The standard's own table holds for 0.52; it grants a closer groove no more. Raises MethodError unless
    0 < gamma < 1 and both factors exceed 0.5.
    """
    refuse_impossible(gamma, inner_groove_factor, outer_groove_factor)
    inner_to_outer = 1.04 * ((1.0 - gamma) / (1.0 + gamma)) ** 1.72
    inner_to_outer *= groove_ratio(inner_groove_factor, outer_groove_factor)
    races = (1.0 + inner_to_outer ** (10.0 / 3.0)) ** -0.3
    shape = gamma**0.3 * (1.0 - gamma) ** 1.39 / (1.0 + gamma) ** (1.0 / 3.0)
    groove = (2.0 * inner_groove_factor / (2.0 * inner_groove_factor - 1.0)) ** 0.41
    return CAPACITY_CONSTANT * REDUCTION * races * shape * groove


def dynamic_capacity(
    balls: int,
    ball_diameter: float,
    pitch_diameter: float,
    contact_angle: float = 0.0,
    inner_groove_factor: float = 0.52,
    outer_groove_factor: float = 0.52,
    rows: int = 1,
    rating_factor: float = RATING_FACTOR,
) -> float:
    """Basic dynamic radial load rating C_r [N] by ISO 281: b_m f_c (i cos alpha)^0.7 Z^(2/3) D^1.8.

    Raises MethodError as ``capacity_factor``.
    """
    gamma = ball_diameter * math.cos(contact_angle) / pitch_diameter
    factor = rating_factor * capacity_factor(gamma, inner_groove_factor, outer_groove_factor)
    return factor * (rows * math.cos(contact_angle)) ** 0.7 * balls ** (2.0 / 3.0) * ball_size_term(ball_diameter)


def static_capacity(balls: int, contact_angle: float, races: tuple[PointContact, PointContact]) -> float:
    """Basic static radial load rating C_0 [N] of a row by its definition in ISO 76, from the contacts with its ``races``.

    The load that makes 4200 MPa on the most loaded ball, which bears 5 F_r/(Z cos alpha), at the race that has it first: the
    outer one up to some D cos(alpha)/d_m = 0.09, the inner one beyond.
    """
    sharpest = max(float(peak_pressure(contact, 1.0)) for contact in races)
    return balls * math.cos(contact_angle) * (STATIC_PRESSURE / sharpest) ** 3 / MOST_LOADED
