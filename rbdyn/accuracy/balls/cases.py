"""A battery of seeded random scenes: what every solver of the equilibrium is tried on.

8 to 32 balls of 3 to 40 mm, contact angles of 0 to 45 deg, D n up to 3e6 mm/min, loads over seven decades, clearance and
interference, standing and turning rings, every raceway control, tilt free and fixed. A case is kept as the tables of its scene
file; ``posed`` builds from them what a solver takes, past the validation that a file goes through.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.arrays import Array
from rbdyn.properties.materials import MATERIALS, Material
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.model import row_model
from rbdyn.quasistatic.row.ring import Row
from rbdyn.scene.ball import BallBearing, BallModel, BallOperation, Prescribed

CONTROLS = ("outer", "inner", "half", "hybrid", "common_cage")
LOADS = ("radial", "axial", "combined", "moment", "preload_force", "preload_displacement")
SCENES = 5000
SEED = 1
# Ranges; logarithmic where they span decades.
BALLS = (8, 32)
BALL_DIAMETER_MM = (3.0, 40.0)
CROWDING = (1.15, 1.6)  # pitch circle over the balls laid side by side
LARGEST_ANGLE_DEG = 45.0
GROOVE_FACTOR = (0.505, 0.54)
SPEED_FACTOR = (1e3, 3e6)  # pitch diameter [mm] times speed [rpm]
LOAD_DECADES = (-1.0, 6.0)  # log10 of N for the largest ball; others with the square of the diameter
CLEARANCE_CHANGE_UM = 40.0
PRELOAD_UM = (0.5, 50.0)
TILT_MRAD = 2.0
# Shares of the scenes.
DEEP_GROOVE, OUTER_TURNS, STANDING, FITTED, TILT_FIXED = 0.15, 0.3, 0.1, 0.5, 0.3


class Case(NamedTuple):
    """One scene: its number, its kind of load, and its tables as in a file."""

    number: int
    load: str
    bearing: dict[str, Any]
    operation: dict[str, Any]
    model: dict[str, Any]

    @property
    def control(self) -> str:
        """Raceway control."""
        return str(self.model["raceway_control"])


class Problem(NamedTuple):
    """What a solver takes: ``solver(*problem)``."""

    row: Row
    control: Control
    load: Array
    given: Array


def cases(count: int = SCENES, seed: int = SEED, **model: Any) -> list[Case]:
    """The first ``count`` scenes of the battery of this seed; ``model``: keys of [model] besides the raceway control."""
    draw = np.random.default_rng(seed)
    return [_case(draw, number, model) for number in range(count)]


def posed(case: Case, ball: Material | None = None, rings: Material | None = None) -> Problem:
    """Row, control, load and prescribed displacements of a case; bearing steel unless told."""
    steel = MATERIALS["bearing_steel"]
    ball, rings = ball or steel, rings or steel
    prescribed = Prescribed.model_construct(**case.operation.get("prescribed", {}))
    operation = BallOperation.model_construct(**{**case.operation, "prescribed": prescribed})
    drawing, model = BallBearing.model_construct(**case.bearing), BallModel.model_construct(**case.model)
    built = row_model(drawing, model, ball, rings, rings, *operation.speeds)
    load, given = np.array([*operation.load, *operation.moment]), np.array(operation.given, float)
    return Problem(built.row, built.control, load, given)


def _case(draw: np.random.Generator, number: int, model: dict[str, Any]) -> Case:
    bearing = _bearing(draw)
    diameter, pitch = bearing["ball_diameter_mm"], bearing["pitch_diameter_mm"]
    force = 10.0 ** draw.uniform(*LOAD_DECADES) * (diameter / BALL_DIAMETER_MM[1]) ** 2
    kind = LOADS[int(draw.integers(len(LOADS)))]
    operation = {**_speeds(draw, pitch), **_load(draw, kind, float(force), 1e-3 * pitch), "tilt": "free"}
    if kind != "moment" and draw.random() < TILT_FIXED:
        operation["tilt"] = "fixed"
        if draw.random() < 0.5:
            tilt_x, tilt_y = (float(tilt) for tilt in draw.uniform(-TILT_MRAD, TILT_MRAD, 2))
            operation["prescribed"] = {"tilt_x_mrad": tilt_x, "tilt_y_mrad": tilt_y}
    return Case(number, kind, bearing, operation, {**model, "raceway_control": CONTROLS[number % len(CONTROLS)]})


def _bearing(draw: np.random.Generator) -> dict[str, Any]:
    balls = int(draw.integers(BALLS[0], BALLS[1] + 1))
    diameter = _log_uniform(draw, BALL_DIAMETER_MM)
    pitch = max(diameter * balls / math.pi * float(draw.uniform(*CROWDING)), 2.5 * diameter)
    deep = draw.random() < DEEP_GROOVE
    inner, outer = (float(factor) for factor in draw.uniform(*GROOVE_FACTOR, 2))
    bearing = {
        "kind": "deep_groove_ball" if deep else "angular_contact_ball",
        "balls": balls,
        "ball_diameter_mm": diameter,
        "pitch_diameter_mm": pitch,
        "contact_angle_deg": 0.0 if deep else float(draw.uniform(0.0, LARGEST_ANGLE_DEG)),
        "inner_groove_factor": inner,
        "outer_groove_factor": outer,
    }
    if draw.random() < FITTED:
        bearing["clearance_change_um"] = float(draw.uniform(-CLEARANCE_CHANGE_UM, CLEARANCE_CHANGE_UM))
    return bearing


def _speeds(draw: np.random.Generator, pitch_mm: float) -> dict[str, float]:
    inner = _log_uniform(draw, SPEED_FACTOR) / pitch_mm
    outer = float(draw.uniform(-1.0, 1.0)) * inner if draw.random() < OUTER_TURNS else 0.0
    if draw.random() < STANDING:
        inner, outer = 0.0, 0.0
    return {"inner_speed_rpm": inner, "outer_speed_rpm": outer}


def _load(draw: np.random.Generator, kind: str, force: float, pitch: float) -> dict[str, Any]:
    """Tables of a load of so many N on a bearing of this pitch diameter [m]."""
    way = float(draw.uniform(0.0, 2.0 * math.pi))
    across = 0.7 * force * math.cos(way), 0.7 * force * math.sin(way)
    if kind == "radial":
        return {"radial_load_N": force}
    if kind == "axial":
        return {"axial_load_N": force}
    if kind == "combined":
        return {"load_N": [*across, float(draw.uniform(0.1, 1.0)) * force]}
    if kind == "moment":
        moment = [float(part) for part in force * pitch * draw.uniform(-0.5, 0.5, 2)]
        return {"load_N": [0.5 * across[0], 0.5 * across[1], force], "moment_Nm": moment}
    if kind == "preload_force":
        return {"load_N": [*across, 0.0], "preload_N": float(draw.uniform(0.1, 1.0)) * force}
    return {"load_N": [*across, 0.0], "preload_um": _log_uniform(draw, PRELOAD_UM)}


def _log_uniform(draw: np.random.Generator, limits: tuple[float, float]) -> float:
    return float(math.exp(draw.uniform(math.log(limits[0]), math.log(limits[1]))))
