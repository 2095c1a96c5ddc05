"""What an equilibrium of a ball bearing reports, saves and loads: angles, loads, stress, contacts, film, life."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from rbdyn.arrays import Array
from rbdyn.base.words import Brief, Figure, counted
from rbdyn.contact import point_film
from rbdyn.contact.film_thickness import lambda_ratio
from rbdyn.contact.hertz_point import PointContact, peak_pressure
from rbdyn.faults import MethodError
from rbdyn.life.turns import turning_rings
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.quasistatic.fatigue import solution_life
from rbdyn.quasistatic.remarks import Rating, needed_friction
from rbdyn.quasistatic.row.equilibrium import INNER_ANGLE, INNER_LOAD, MOMENT, OUTER_ANGLE, OUTER_LOAD, PULL, Solution
from rbdyn.records.record import Record, outside_json, spread
from rbdyn.result import SavedRecord
from rbdyn.scene.ball import BallScene

if TYPE_CHECKING:
    import pandas as pd


class RowReport(Record):
    """Equilibrium of one row, units in the names: place of its inner ring, a table a ball, and what each race bears.

    ``life``: None where nothing is loaded, in hours also where nothing turns. ``searches``: starting values tried, of a solver
    that tries some. ``reaction``: the load that the ring takes, of a bearing of this row alone.
    """

    displacement_mm: dict[str, float]
    tilt_mrad: dict[str, float]
    balls: list[dict[str, float]]
    max_stress_MPa: dict[str, float]  # noqa: N815
    contacts: dict[str, dict[str, float]]
    stiffness: dict[str, Any]
    life: dict[str, Any]
    needed_friction: float
    residual_N: float  # noqa: N815
    iterations: int
    searches: int | None = None
    reaction: dict[str, dict[str, float]] | None = None


class DoubleDeckerReport(Record):
    """Equilibrium of a double-decker: of its inner ring, its middle ring and both rows."""

    displacement_mm: dict[str, float]
    tilt_mrad: dict[str, float]
    stiffness: dict[str, Any]
    reaction: dict[str, dict[str, float]]
    middle_ring: dict[str, Any]
    residual_N: float  # noqa: N815
    iterations: int
    inner: RowReport
    outer: RowReport


class BallResult(Brief, SavedRecord, kw_only=True):
    """Equilibrium of a ball bearing, ``scene`` the resolved input; ``status``: "ok", or why there is none.

    ``report``: what was found, None where nothing was. ``ring_growth_um``, ``fits``: where the scene asks for growth or tells
    a mounting. ``other_roots``: more equilibria of the same load, where they are looked for. ``runout``: of the turning ring,
    where the command has followed it. ``rows``: the solved rows in SI, one, or the inner and the outer one of a
    double-decker; empty for a result that was loaded or that found no equilibrium. ``ratings``: what their pressures and lives
    rest on.
    """

    FORMAT = "rbdyn.ball/1"
    WHAT = "equilibrium"
    status: str
    raceway_control: str
    solver: str
    report: RowReport | DoubleDeckerReport | None = spread(default=None)
    ring_growth_um: dict[str, float] | None = None
    fits: dict[str, Any] | None = None
    other_roots: list[dict[str, Any]] | None = None
    notes: list[str] | None = None
    cost: dict[str, float]
    versions: dict[str, str]
    scene: dict[str, Any]
    runout: dict[str, float] | None = None
    rows: tuple[Solution, ...] = outside_json(default=())
    ratings: tuple[Rating, ...] = outside_json(default=())

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``as_dict``. Raises KeyError or TypeError for anything else."""
        result = super().from_dict(data)
        if result.found and result.report is None:
            raise KeyError("an equilibrium without its figures")
        return result

    @property
    def found(self) -> bool:
        """Whether an equilibrium was found."""
        return self.status == "ok"

    @property
    def displacement(self) -> Array:
        """(x, y, z [m], theta_x, theta_y [rad]) of the inner ring. Raises MethodError where there is no equilibrium."""
        report = self.reached
        place, tilt = report.displacement_mm, report.tilt_mrad
        return 1e-3 * np.array([place["x"], place["y"], place["z"], tilt["x"], tilt["y"]])

    @property
    def reached(self) -> RowReport | DoubleDeckerReport:
        """What was found. Raises MethodError where nothing was."""
        if self.report is None:
            raise MethodError(f"there is no equilibrium: {self.status}")
        return self.report

    @property
    def row_reports(self) -> dict[str, RowReport]:
        """What was found of each row, by its name: "inner" and "outer", or "" for a single one. Raises MethodError as ``reached``."""
        report = self.reached
        return {"": report} if isinstance(report, RowReport) else {"inner": report.inner, "outer": report.outer}

    def brief(self) -> tuple[str, list[Figure]]:
        """Status and notes; of each row pressures, life and place, and the stiffness: exact figures of the model."""
        figures = []
        for name, row in self.row_reports.items() if self.report else ():
            of_row = f"{name} row " if name else ""
            stress = row.max_stress_MPa.items()
            figures += [Figure(f"{of_row}pressure, {race} race", p, None, "MPa") for race, p in stress]
            figures.append(Figure(f"{of_row}life L10", row.life["L10_Mrev"], None, "million turns"))
        for axis in "xyz" if self.report else "":
            figures.append(Figure(f"displacement {axis}", 1e3 * self.reached.displacement_mm[axis], None, "µm"))
            figures.append(Figure(f"stiffness {axis}", self.reached.stiffness[f"{axis}_N_per_um"], None, "N/µm"))
        return f"{self.status}, {counted(len(self.notes or ()), 'note')}", figures

    def table(self) -> "pd.DataFrame":
        """A row a ball: azimuth, angles, loads, centrifugal force, gyroscopic moment; units in the names."""
        import pandas as pd

        layers = {name: pd.DataFrame(row.balls) for name, row in self.row_reports.items()}
        return layers[""] if "" in layers else pd.concat(layers, names=["row", "ball"]).reset_index()


def displacement_record(displacement: Array) -> dict[str, Any]:
    """Displacement of a ring in mm and mrad."""
    x, y, z, tilt_x, tilt_y = (1e3 * float(value) for value in displacement)
    return {"displacement_mm": {"x": x, "y": y, "z": z}, "tilt_mrad": {"x": tilt_x, "y": tilt_y}}


def ball_columns(balls: Array) -> dict[str, Array]:
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


def ball_records(figures: Array) -> list[dict[str, float]]:
    """One record a ball, from the figures (Z, FIGURES) of ``solve_row``."""
    columns = ball_columns(figures[np.newaxis])
    return [{name: float(values[0, j]) for name, values in columns.items()} for j in range(len(figures))]


def stiffness_record(stiffness: Array) -> dict[str, Any]:
    """Diagonal stiffnesses and the whole matrix."""
    across, tilt = (np.diag(stiffness)[:3] * 1e-6).tolist(), (np.diag(stiffness)[3:] * 1e-3).tolist()
    return {
        **{f"{axis}_N_per_um": value for axis, value in zip("xyz", across, strict=True)},
        **{f"tilt_{axis}_Nm_per_mrad": value for axis, value in zip("xy", tilt, strict=True)},
        "matrix_SI": stiffness.tolist(),
    }


def row_report(rating: Rating, solution: Solution, film: dict[str, Any], reaction: dict[str, Any] | None) -> RowReport:
    """Report of one row; ``film``: as ``film_record`` gives it."""
    contacts = {"inner": rating.model.inner_contact, "outer": rating.model.outer_contact}
    loads = {"inner": solution.inner_load, "outer": solution.outer_load}
    life = solution_life(solution, rating.capacities, turning_rings(*rating.speeds))
    return RowReport(
        **displacement_record(solution.displacement),
        balls=ball_records(solution.figures),
        max_stress_MPa={race: 1e-6 * float(np.max(peak_pressure(contacts[race], loads[race]))) for race in contacts},
        contacts={
            race: {**contact_record(contacts[race], float(loads[race].max())), **film.get(race, {})}
            for race in contacts
        },
        stiffness=stiffness_record(solution.stiffness),
        life={**life.as_record(*rating.speeds), "method": "ISO/TS 16281"},
        needed_friction=float(needed_friction(solution.figures[np.newaxis], [rating])[0]),
        residual_N=solution.residual,
        iterations=solution.steps,
        searches=solution.searches,
        reaction=reaction,
    )


def contact_record(contact: PointContact, load: float) -> dict[str, float]:
    """Ellipse of a contact under a load [N]."""
    grown = load ** (1.0 / 3.0)
    semi_major, semi_minor = 1e3 * contact.semi_major * grown, 1e3 * contact.semi_minor * grown
    return {
        "load_N": load,
        "semi_major_mm": semi_major,
        "semi_minor_mm": semi_minor,
        "area_mm2": math.pi * semi_major * semi_minor,
    }


def film_record(scene: BallScene, rating: Rating, solution: Solution, rings: tuple[str, str]) -> dict[str, Any]:
    """Film of each race at its largest load, the thermal factor included, between ``rings``, the names of the inner and outer one.

    Empty where the scene tells no oil, and where nothing turns or bears.
    """
    if scene.lubricant is None:
        return {}
    lubricant, drawing, model = scene.lubricant, rating.drawing, rating.model
    ball, inner, outer = (scene.material(part) for part in ("ball", *rings))
    gamma = drawing.gamma
    entrainment = point_film.entrainment_speed(drawing.pitch_diameter, gamma, *rating.speeds)
    oil, films = lubricant.in_service, {}
    for race, contact, ring, side, loads in (
        ("inner", model.inner_contact, inner, gamma, solution.inner_load),
        ("outer", model.outer_contact, outer, -gamma, solution.outer_load),
    ):
        load = float(loads.max())
        if entrainment == 0.0 or load == 0.0:
            continue
        radius = point_film.rolling_radius(drawing.ball_diameter, side)
        rolling = point_film.RollingBall(contact, radius, equivalent_modulus(ball, ring), entrainment)
        heat = float(point_film.thermal_factor(rolling, oil, load))
        central = float(point_film.central_film(rolling, oil, load)) * heat
        roughness = lubricant.roller_roughness, lubricant.race_roughness
        films[race] = {
            "central_film_um": 1e6 * central,
            "minimum_film_um": 1e6 * float(point_film.minimum_film(rolling, oil, load)) * heat,
            "lambda_ratio": float(lambda_ratio(central, *roughness)),
            "film_stiffness_N_per_um": 1e-6 * float(point_film.film_stiffness(rolling, oil, load)),
        }
    return films
