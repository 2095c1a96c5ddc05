"""Ratings and fatigue life of a row of balls: Lundberg and Palmgren, ISO 281, ISO 76 and ISO/TS 16281.

The factors follow common restatements of the standards, not their text. f_c = 0.41 * 98.0665 * 0.95 times Lundberg and
Palmgren's terms gives the printed table of ISO 281 within 0.1 % with both grooves at 0.52. The static rating follows from its
definition (4200 MPa) instead of f_0. Lengths are in m, angles in rad.

The life of a race is (Q_c/Q_e)^3 million turns. Q_c is the ball load for one million turns, from the catalogue's C_r; Q_e is the
equivalent of its loads. Races combine by a Weibull slope of 10/9 (Sensors 2023 paper on preload, eqs 9-10). Lubrication,
cleanliness and the fatigue limit (a_ISO) are left out.
"""

import math

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM
from rbdyn.contact.point_contact import PointContact, peak_pressure
from rbdyn.life import Life, Turning

# Largest n d_m of bearings at their reference speed in SKF's catalogue [m/s]: 1.2 and 0.7 million mm/min.
FASTEST = {"deep_groove_ball": 1.2e3 * RPM, "angular_contact_ball": 0.7e3 * RPM}

# lambda of a single row, the reduction of practice against theory (ISO/TR 1281-1), and the theory's constant [N, mm].
REDUCTION = 0.95
CAPACITY_CONSTANT = 0.41 * 98.0665
RATING_FACTOR = 1.3  # b_m of ball bearings of contemporary steel
# Widest grooves, inner and outer, that ISO 281 rates by its table of f_c, which is that of RATED_GROOVE.
WIDEST_RATED, RATED_GROOVE = (0.52, 0.53), 0.52
LARGEST_PLAIN_BALL = 25.4  # [mm]; above, capacity grows as the power 1.4 of the diameter
STATIC_PRESSURE = 4.2e9  # [Pa]
MOST_LOADED = 5.0  # Stribeck's Q_max Z cos(alpha)/F_r


def groove_ratio(inner_groove_factor: float, outer_groove_factor: float) -> float:
    """[r_i (2 r_e - D)/(r_e (2 r_i - D))]^0.41: effect of the grooves on the capacity of the inner race over the outer."""
    closeness = inner_groove_factor / (2.0 * inner_groove_factor - 1.0)
    return float((closeness * (2.0 * outer_groove_factor - 1.0) / outer_groove_factor) ** 0.41)


def ball_size_term(ball_diameter: float) -> float:
    """D^1.8 of a ball [mm^1.8], 3.647 D^1.4 above 25.4 mm; the diameter in m."""
    millimetres = ball_diameter * 1e3
    return millimetres**1.8 if millimetres <= LARGEST_PLAIN_BALL else 3.647 * millimetres**1.4


def capacity_factor(gamma: float, inner_groove_factor: float = 0.52, outer_groove_factor: float = 0.52) -> float:
    """f_c of a radial or angular contact ball bearing (ISO 281, in N and mm), gamma = D cos(alpha)/d_m.

    ``rated_capacity`` has the grooves for which the standard's own table holds.
    """
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


def rated_capacity(
    balls: int,
    ball_diameter: float,
    pitch_diameter: float,
    contact_angle: float,
    inner_groove_factor: float,
    outer_groove_factor: float,
) -> float:
    """C_r [N] as ISO 281 rates a row: grooves up to ``WIDEST_RATED`` by the standard's table, wider ones lower as in its theory."""
    sizes = balls, ball_diameter, pitch_diameter, contact_angle
    inner, outer = max(inner_groove_factor, WIDEST_RATED[0]), max(outer_groove_factor, WIDEST_RATED[1])
    tabled = dynamic_capacity(*sizes, RATED_GROOVE, RATED_GROOVE)
    return tabled * dynamic_capacity(*sizes, inner, outer) / dynamic_capacity(*sizes, *WIDEST_RATED)


def static_capacity(balls: int, contact_angle: float, races: tuple[PointContact, PointContact]) -> float:
    """Basic static radial load rating C_0 [N] of a row by its definition in ISO 76, from the contacts with its ``races``.

    The most loaded ball bears 5 F_r/(Z cos alpha) and has 4200 MPa at the race with the higher pressure: the outer race up to
    about D cos(alpha)/d_m = 0.09, the inner race above.
    """
    sharpest = max(float(peak_pressure(contact, 1.0)) for contact in races)
    return balls * math.cos(contact_angle) * (STATIC_PRESSURE / sharpest) ** 3 / MOST_LOADED


LOAD_LIFE = 3.0
WEIBULL = 10.0 / 9.0
RACE_EXPONENT = LOAD_LIFE * WEIBULL
# Parts of Z cos(alpha) Q_max in the rating with half of the balls loaded (ISO/TS 16281).
INNER_SHARE, OUTER_SHARE = 0.407, 0.389


def rated_capacities(
    capacity: float,
    balls: int,
    gamma: float,
    contact_angle: float,
    inner_groove_factor: float,
    outer_groove_factor: float,
    rows: int = 1,
) -> tuple[float, float]:
    """Ball load [N] that the inner and the outer race bear for 1e6 turns: Q_ci, Q_ce of ISO/TS 16281.

    From C_r [N], of a catalogue or ``dynamic_capacity``. The standard divides by cos(alpha)^0.7. Lundberg and Palmgren's statics
    would have cos(alpha), which multiplies the life of an angular contact bearing by cos(alpha)^-0.9.
    """
    inner_to_outer = 1.044 * ((1.0 - gamma) / (1.0 + gamma)) ** 1.72
    inner_to_outer *= groove_ratio(inner_groove_factor, outer_groove_factor)
    ball_capacity = capacity / (balls * (math.cos(contact_angle) * rows) ** 0.7)
    inner = ball_capacity / INNER_SHARE * (1.0 + inner_to_outer**RACE_EXPONENT) ** (1.0 / RACE_EXPONENT)
    outer = ball_capacity / OUTER_SHARE * (1.0 + inner_to_outer**-RACE_EXPONENT) ** (1.0 / RACE_EXPONENT)
    return inner, outer


def turning_race_load(loads: Array) -> float:
    """Equivalent ball load [N] of a race that rotates relative to the load, from loads (samples, Z): the cubic mean."""
    return float(np.mean(loads**LOAD_LIFE) ** (1.0 / LOAD_LIFE))


def standing_race_load(loads: Array) -> float:
    """Equivalent ball load [N] of a race at rest relative to the load, from loads (samples, Z) at fixed places.

    A cubic mean over the samples at each place, then a mean of the power 10/3 over the places.
    """
    damage = np.mean(loads**LOAD_LIFE, axis=0)
    return float(np.mean(damage**WEIBULL) ** (1.0 / RACE_EXPONENT))


def row_life(inner_load: Array, outer_load: Array, capacities: tuple[float, float], turning: Turning = "inner") -> Life:
    """Life of a row from the loads [N] of its balls, (Z,) or (samples, Z), on the inner and the outer race.

    ``capacities``: of the inner and the outer race [N], by ``rated_capacities``. ``turning``: the rings that rotate relative to
    the load.
    """
    inner, outer = np.atleast_2d(inner_load), np.atleast_2d(outer_load)
    inner_equivalent = standing_race_load(inner) if turning == "outer" else turning_race_load(inner)
    outer_equivalent = standing_race_load(outer) if turning == "inner" else turning_race_load(outer)
    inner_capacity, outer_capacity = capacities
    damage = (inner_equivalent / inner_capacity) ** RACE_EXPONENT
    damage += (outer_equivalent / outer_capacity) ** RACE_EXPONENT
    million_turns = damage ** (-1.0 / WEIBULL) if damage > 0.0 else math.inf
    return Life(million_turns, inner_equivalent, outer_equivalent, inner_capacity, outer_capacity)
