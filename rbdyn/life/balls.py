"""Fatigue life of a row of balls from the loads on them: Lundberg and Palmgren, and ISO/TS 16281.

A race lives (Q_c/Q_e)^3 million turns, Q_c being the ball load it bears for one million, from the catalogue's C_r, and Q_e
the equivalent of its loads; races combine by a Weibull slope of 10/9 (Sensors 2023 paper on preload, eqs 9-10).
Lubrication, cleanliness and the fatigue limit (a_ISO) are left out.
"""

import math

import numpy as np

from rbdyn.arrays import Array
from rbdyn.faults import MethodError
from rbdyn.life.ball_capacity import groove_ratio
from rbdyn.life.turns import Life, Turning

LOAD_LIFE = 3.0
WEIBULL = 10.0 / 9.0
RACE_EXPONENT = LOAD_LIFE * WEIBULL
# Parts of Z cos(alpha) Q_max that make the rating, when half of the balls are loaded (ISO/TS 16281).
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

    From C_r [N], of a catalogue or ``rating.dynamic_capacity``. The standard divides by cos(alpha)^0.7; Lundberg and
    Palmgren's statics would have cos(alpha), which lets an angular contact bearing live cos(alpha)^-0.9 as long.
    """
    inner_to_outer = 1.044 * ((1.0 - gamma) / (1.0 + gamma)) ** 1.72
    inner_to_outer *= groove_ratio(inner_groove_factor, outer_groove_factor)
    each = capacity / (balls * (math.cos(contact_angle) * rows) ** 0.7)
    inner = each / INNER_SHARE * (1.0 + inner_to_outer**RACE_EXPONENT) ** (1.0 / RACE_EXPONENT)
    outer = each / OUTER_SHARE * (1.0 + inner_to_outer**-RACE_EXPONENT) ** (1.0 / RACE_EXPONENT)
    return inner, outer


def turning_race_load(loads: Array) -> float:
    """Equivalent ball load [N] of the race that turns against the load, from loads (samples, Z): the cube mean."""
    return float(np.mean(loads**LOAD_LIFE) ** (1.0 / LOAD_LIFE))


def standing_race_load(loads: Array) -> float:
    """Equivalent ball load [N] of the race that stands against the load, from loads (samples, Z) at fixed places.

    A cube mean over the samples at each place, then a mean of the power 10/3 over the places.
    """
    damage = np.mean(loads**LOAD_LIFE, axis=0)
    return float(np.mean(damage**WEIBULL) ** (1.0 / RACE_EXPONENT))


def row_life(inner_load: Array, outer_load: Array, capacities: tuple[float, float], turning: Turning = "inner") -> Life:
    """Life of a row from the loads on its balls, (Z,) or (samples, Z), on the inner and on the outer race [N].

    ``capacities``: of the inner and the outer race [N], by one of the functions above. ``turning``: the rings that
    turn against the load. Raises MethodError for arrays that do not match, or hold negative loads or NaN.
    """
    inner, outer = _loads(inner_load, "inner"), _loads(outer_load, "outer")
    if inner.shape != outer.shape:
        raise MethodError(f"loads of shape {inner.shape} inside and {outer.shape} outside do not match")
    inner_equivalent = standing_race_load(inner) if turning == "outer" else turning_race_load(inner)
    outer_equivalent = standing_race_load(outer) if turning == "inner" else turning_race_load(outer)
    inner_capacity, outer_capacity = capacities
    damage = (inner_equivalent / inner_capacity) ** RACE_EXPONENT
    damage += (outer_equivalent / outer_capacity) ** RACE_EXPONENT
    million_turns = damage ** (-1.0 / WEIBULL) if damage > 0.0 else math.inf
    return Life(million_turns, inner_equivalent, outer_equivalent, inner_capacity, outer_capacity)


def _loads(loads: Array, race: str) -> Array:
    array = np.atleast_2d(np.asarray(loads, dtype=np.float64))
    if array.ndim != 2 or array.size == 0:
        raise MethodError(f"{race} loads of shape {np.shape(loads)}: give (Z,) or (samples, Z)")
    if not np.all(array >= 0.0) or not np.all(np.isfinite(array)):
        raise MethodError(f"{race} loads hold negative values, NaN or infinity")
    return array
