"""Figures of many equilibria at once: angles, loads, pressures, stiffnesses, lives, as columns with units in their names."""

import math
from collections.abc import Sequence

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.life import turning_rings
from rbdyn.life.balls import LOAD_LIFE, RACE_EXPONENT, WEIBULL
from rbdyn.quasistatic.result import Rating, pressures
from rbdyn.quasistatic.row.equilibrium import INNER_ANGLE, INNER_LOAD, OUTER_ANGLE, OUTER_LOAD

Columns = dict[str, Array]


def ring_columns(displacement: Array, reaction: Array, stiffness: Array) -> Columns:
    """Place of the ring, load that it takes and diagonal stiffnesses, from arrays (n, 5), (n, 5), (n, 5, 5) in SI."""
    columns = {f"{axis}_mm": 1e3 * displacement[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"tilt_{axis}_mrad": 1e3 * displacement[:, 3 + i] for i, axis in enumerate("xy")}
    columns |= {f"force_{axis}_N": reaction[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"moment_{axis}_Nm": reaction[:, 3 + i] for i, axis in enumerate("xy")}
    columns |= {f"stiffness_{axis}_N_per_um": 1e-6 * stiffness[:, i, i] for i, axis in enumerate("xyz")}
    return columns | {
        f"stiffness_tilt_{axis}_Nm_per_mrad": 1e-3 * stiffness[:, 3 + i, 3 + i] for i, axis in enumerate("xy")
    }


def row_columns(balls: Array, ratings: Sequence[Rating]) -> Columns:
    """Angles, loads, pressures and life of a row, from ``balls`` (n, Z, FIGURES) and as many ratings.

    A ball that lies on the outer race alone has no inner angle: its part in the extremes is left out, and NaN stands for ball 1.
    """
    inner_load, outer_load = balls[:, :, INNER_LOAD], balls[:, :, OUTER_LOAD]
    touching = inner_load > 0.0
    inner_angle, outer_angle = np.degrees(balls[:, :, INNER_ANGLE]), np.degrees(balls[:, :, OUTER_ANGLE])
    lowest = np.where(touching, inner_angle, np.inf).min(axis=1)
    highest = np.where(touching, inner_angle, -np.inf).max(axis=1)
    columns = {
        "inner_angle_min_deg": np.where(np.isfinite(lowest), lowest, np.nan),
        "inner_angle_max_deg": np.where(np.isfinite(highest), highest, np.nan),
        "inner_angle_ball_1_deg": np.where(touching[:, 0], inner_angle[:, 0], np.nan),
        "outer_angle_min_deg": outer_angle.min(axis=1),
        "outer_angle_max_deg": outer_angle.max(axis=1),
        "outer_angle_ball_1_deg": outer_angle[:, 0],
        "loaded_balls": touching.sum(axis=1).astype(float),
        "inner_load_max_N": inner_load.max(axis=1),
        "outer_load_max_N": outer_load.max(axis=1),
    }
    columns |= {f"{race}_pressure_MPa": 1e-6 * pressure for race, pressure in pressures(balls, ratings).items()}
    millions = lives(inner_load, outer_load, ratings)
    speed = np.array([abs(rating.speeds[0] - rating.speeds[1]) for rating in ratings])
    with np.errstate(divide="ignore"):
        hours = np.where(speed > 0.0, 1e6 * millions * 2.0 * math.pi / (3600.0 * speed), np.inf)
    return columns | {"L10_Mrev": millions, "L10_h": hours}


def lives(inner_load: Array, outer_load: Array, ratings: Sequence[Rating]) -> Array:
    """L10 [1e6 turns] from loads (n, Z) [N]: ``life.row_life`` for many; infinite without a load."""
    standing = {"inner": "outer", "outer": "inner", "both": ""}
    damage = np.zeros(len(ratings))
    for i, (race, load) in enumerate((("inner", inner_load), ("outer", outer_load))):
        cubes = load**LOAD_LIFE
        turning = np.mean(cubes, axis=1) ** (1.0 / LOAD_LIFE)
        fixed = np.mean(cubes**WEIBULL, axis=1) ** (1.0 / RACE_EXPONENT)
        stands = np.array([standing[turning_rings(*rating.speeds)] == race for rating in ratings])
        capacity = np.array([rating.capacities[i] for rating in ratings])
        damage += (np.where(stands, fixed, turning) / capacity) ** RACE_EXPONENT
    with np.errstate(divide="ignore"):
        return np.where(damage > 0.0, damage ** (-1.0 / WEIBULL), math.inf)
