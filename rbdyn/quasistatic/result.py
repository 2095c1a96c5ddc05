"""What an equilibrium of a ball bearing reports, saves and loads."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.quasistatic.remarks import Rating
from rbdyn.quasistatic.row.equilibrium import INNER_ANGLE, INNER_LOAD, MOMENT, OUTER_ANGLE, OUTER_LOAD, PULL, Solution
from rbdyn.result import read_record, write_json

if TYPE_CHECKING:
    import pandas as pd

FORMAT = "rbdyn.ball/1"


@dataclass(frozen=True)
class BallResult:
    """Equilibrium of a ball bearing.

    ``record``: what ``as_dict`` gives and ``save`` writes, units in the names. ``rows``: the solved rows in SI, one, or the
    inner and the outer one of a double-decker; empty for a result that was loaded or that found no equilibrium. ``ratings``: what
    their pressures and lives rest on.
    """

    record: dict[str, Any]
    rows: tuple[Solution, ...] = ()
    ratings: tuple[Rating, ...] = ()

    @property
    def status(self) -> str:
        """ "ok", or why there is no equilibrium."""
        return str(self.record["status"])

    @property
    def found(self) -> bool:
        """Whether an equilibrium was found."""
        return self.status == "ok"

    @property
    def displacement(self) -> NDArray[np.float64]:
        """(x, y, z [m], theta_x, theta_y [rad]) of the inner ring. Raises KeyError where there is no equilibrium."""
        place, tilt = self.record["displacement_mm"], self.record["tilt_mrad"]
        return 1e-3 * np.array([place["x"], place["y"], place["z"], tilt["x"], tilt["y"]])

    def as_dict(self) -> dict[str, Any]:
        """JSON form, which shares nothing with the result."""
        return copy.deepcopy(self.record)

    def table(self) -> pd.DataFrame:
        """A row a ball: azimuth, angles, loads, centrifugal force, gyroscopic moment; units in the names."""
        import pandas as pd

        if "balls" in self.record:
            return pd.DataFrame(self.record["balls"])
        layers = {name: pd.DataFrame(self.record[name]["balls"]) for name in ("inner", "outer")}
        return pd.concat(layers, names=["row", "ball"]).reset_index()

    def save(self, path: Path | str) -> None:
        """Write JSON, whole or not at all."""
        write_json(path, self.record)

    @classmethod
    def load(cls, path: Path | str) -> BallResult:
        """Read a saved result. Raises InputError when the file is missing or not such a result."""
        return cls(read_record(path, FORMAT, "equilibrium"))


def displacement_record(displacement: NDArray[np.float64]) -> dict[str, Any]:
    """Displacement of a ring in mm and mrad."""
    x, y, z, tilt_x, tilt_y = (1e3 * float(value) for value in displacement)
    return {"displacement_mm": {"x": x, "y": y, "z": z}, "tilt_mrad": {"x": tilt_x, "y": tilt_y}}


def ball_columns(balls: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """A value a ball, (n, Z) each, named as ``BallResult.table`` names them."""
    size = balls.shape[1]
    return {
        "azimuth_deg": np.broadcast_to(360.0 * np.arange(size) / size, balls.shape[:2]),
        "inner_angle_deg": np.degrees(balls[:, :, INNER_ANGLE]),
        "outer_angle_deg": np.degrees(balls[:, :, OUTER_ANGLE]),
        "inner_load_N": balls[:, :, INNER_LOAD],
        "outer_load_N": balls[:, :, OUTER_LOAD],
        "centrifugal_force_N": balls[:, :, PULL],
        "gyroscopic_moment_Nmm": 1e3 * balls[:, :, MOMENT],
    }


def ball_records(figures: NDArray[np.float64]) -> list[dict[str, float]]:
    """One record a ball, from the figures (Z, FIGURES) of ``solve_row``."""
    columns = ball_columns(figures[np.newaxis])
    return [{name: float(values[0, j]) for name, values in columns.items()} for j in range(len(figures))]


def stiffness_record(stiffness: NDArray[np.float64]) -> dict[str, Any]:
    """Diagonal stiffnesses and the whole matrix."""
    across, tilt = np.diag(stiffness)[:3] * 1e-6, np.diag(stiffness)[3:] * 1e-3
    return {
        "x_N_per_um": float(across[0]),
        "y_N_per_um": float(across[1]),
        "z_N_per_um": float(across[2]),
        "tilt_x_Nm_per_mrad": float(tilt[0]),
        "tilt_y_Nm_per_mrad": float(tilt[1]),
        "matrix_SI": stiffness.tolist(),
    }
