"""Results of ball bearings in equilibrium: ``BallResult`` with its reports, remarks, and columns of many equilibria.

Reports hold contact angles, loads, stress, contacts, film, stiffness and life. Remarks warn of balls clear of a race, dents,
steep angles, slip, and a ring that tips. Columns have units in their names.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self

import numpy as np

from rbdyn.base.arrays import Array, Mask
from rbdyn.base.faults import MethodError
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, outside_json, spread
from rbdyn.base.table import Column, Sheet
from rbdyn.base.words import Brief, Figure, counted
from rbdyn.contact import point_contact
from rbdyn.contact.film_thickness import lambda_ratio
from rbdyn.contact.hertz_line import BALLS, SHAKEDOWN, dent_sentence, overload_sentence
from rbdyn.contact.point_contact import PointContact, peak_pressure
from rbdyn.life import Life, Turning, turning_rings
from rbdyn.life.balls import LOAD_LIFE, RACE_EXPONENT, WEIBULL, dynamic_capacity, rated_capacities, row_life
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.quasistatic.row.ball import FixedShare, FrictionShare
from rbdyn.quasistatic.row.equilibrium import INNER_ANGLE, INNER_LOAD, MOMENT, OUTER_ANGLE, OUTER_LOAD, PULL, Solution
from rbdyn.quasistatic.row.model import RowModel
from rbdyn.result import SavedRecord
from rbdyn.scene.ball import BallRow, BallScene
from rbdyn.scene.fits import race_film_temperature

if TYPE_CHECKING:
    import pandas as pd


# Smallest groove factor in the table of ISO 281; closer grooves get no higher rating.
CLOSEST_RATED = 0.52


def capacity_of(drawing: BallRow) -> float:
    """C_r of a row [N], from the catalogue or else by ISO 281 from the dimensions."""
    if drawing.dynamic_capacity_N is not None:
        return drawing.dynamic_capacity_N
    inner, outer = (max(factor, CLOSEST_RATED) for factor in drawing.groove_factors)
    sizes = drawing.balls, drawing.ball_diameter, drawing.pitch_diameter, drawing.contact_angle
    return dynamic_capacity(*sizes, inner, outer)


def reference_capacities(drawing: BallRow) -> tuple[float, float]:
    """Ball loads [N] that the inner and the outer race bear for 1e6 turns by ISO/TS 16281."""
    angle = drawing.contact_angle
    return rated_capacities(capacity_of(drawing), drawing.balls, drawing.gamma, angle, *drawing.groove_factors)


def solution_life(solution: Solution, capacities: tuple[float, float], turning: Turning = "inner") -> Life:
    """Life of a row in equilibrium."""
    return row_life(solution.inner_load, solution.outer_load, capacities, turning)


# Contact angle above which a contact is beyond any shoulder [rad].
STEEPEST = math.radians(80.0)
# Friction coefficient above which oiled contacts slip about the axis of the gyroscopic moment.
OILED_FRICTION = 0.07
# Makers allow angular contact bearings about this misalignment, deep groove ones up to three times as much [rad].
TIPPED = 1e-3
Race = Literal["inner", "outer"]
RACES: tuple[Race, Race] = ("inner", "outer")
# Ball load [N] below which a ball counts as unloaded.
NO_LOAD = 1e-9


class Rating(NamedTuple):
    """Data of a row for pressures, life and remarks: capacities of both races [N], speeds of both rings [rad/s]."""

    drawing: BallRow
    model: RowModel
    capacities: tuple[float, float]
    speeds: tuple[float, float]


class Remark(NamedTuple):
    """A note: its code, its subject in a word, the mask of the points (n,) that it is about, and its sentence for each point."""

    code: str
    word: str
    where: Mask
    say: Callable[[int], str]
    row: str = ""

    def note(self, place: int) -> Note:
        """The note for a point, with the row of balls in a bearing of two rows."""
        return Note(self.code, self.row + self.say(place))


def pressures(balls: Array, ratings: Sequence[Rating]) -> dict[str, Array]:
    """Largest Hertz pressure (n,) on each race [Pa] of ``balls`` (n, Z, FIGURES)."""
    peaks = {}
    for race, place in (("inner", INNER_LOAD), ("outer", OUTER_LOAD)):
        contact = PointContact(*np.array([getattr(rating.model, f"{race}_contact") for rating in ratings]).T)
        peaks[race] = peak_pressure(contact, balls[:, :, place].max(axis=1))
    return peaks


def overloads(balls: Array, ratings: Sequence[Rating]) -> dict[int, str]:
    """Points with a contact ellipse too long for its groove or a pressure above shakedown, and a sentence for each."""
    causes: dict[int, str] = {}
    for race, place in (("inner", INNER_LOAD), ("outer", OUTER_LOAD)):
        loads = balls[:, :, place]
        factor = np.array([getattr(rating.drawing, f"{race}_groove_factor") for rating in ratings])
        groove = factor * np.array([rating.drawing.ball_diameter for rating in ratings])
        unit = np.array([getattr(rating.model, f"{race}_contact").semi_major for rating in ratings])
        half = unit * np.cbrt(loads.max(axis=1))
        for k in np.flatnonzero(half > groove).tolist():
            azimuth, load = 360.0 * loads[k].argmax() / loads.shape[1], loads[k].max()
            length, radius = 2e3 * half[k], 1e3 * groove[k]
            causes.setdefault(
                k,
                f"overloaded: the ball at {azimuth:.0f} deg would carry {load:.4g} N on the {race} race over "
                f"{length:.3g} mm in a groove of {radius:.3g} mm radius; reduce the load",
            )
    for race, peaks in pressures(balls, ratings).items():
        for k in np.flatnonzero(peaks > SHAKEDOWN[BALLS]).tolist():
            causes.setdefault(k, f"overloaded: {race} race by {overload_sentence(float(peaks[k]), BALLS)}")
    return causes


def edge_angles(balls: Array, ratings: Sequence[Rating], race: Race) -> Array:
    """Angles (n, Z) [rad] at the edge of the contact ellipse that is nearer to the shoulder; -inf without a contact.

    The ellipse lies along the groove: a semi-axis a adds asin(a/(f D)) to the contact angle. Negative angles of a bearing with
    one shoulder are not counted.
    """
    loads = balls[:, :, INNER_LOAD if race == "inner" else OUTER_LOAD]
    angles = balls[:, :, INNER_ANGLE if race == "inner" else OUTER_ANGLE]
    grooves = [getattr(rating.drawing, f"{race}_groove_factor") * rating.drawing.ball_diameter for rating in ratings]
    units = [getattr(rating.model, f"{race}_contact").semi_major for rating in ratings]
    shouldered = np.array([rating.drawing.contact_angle > 0.0 for rating in ratings])[:, np.newaxis]
    share = (np.array(units) / np.array(grooves))[:, np.newaxis] * np.cbrt(np.maximum(loads, 0.0))
    size = np.where(shouldered, angles, np.abs(angles))
    return np.where((loads > NO_LOAD) & (size >= 0.0), size + np.arcsin(np.minimum(share, 1.0)), -np.inf)


def climbing(balls: Array, ratings: Sequence[Rating], race: Race, row: str) -> Remark:
    """Remark on contacts whose ellipse climbs over the shoulder of a race."""
    edges = edge_angles(balls, ratings, race)
    shoulders = np.array([rating.drawing.shoulder_angle(race) for rating in ratings])
    beyond, key = edges.max(axis=1) - shoulders, f"{race}_shoulder_height_mm"

    def sentence(k: int) -> str:
        drawing = ratings[k].drawing
        azimuth, groove = 360.0 * edges[k].argmax() / edges.shape[1], getattr(drawing, f"{race}_groove_factor")
        height = groove * drawing.ball_diameter_mm * (1.0 - math.cos(shoulders[k]))
        kind = "estimated" if getattr(drawing, key) is None else "stated"
        remedy = f"state {key}" if kind == "estimated" else "make it higher"
        return (
            f"the ellipse of the ball at {azimuth:.0f} deg climbs {math.degrees(beyond[k]):.2g} deg over the {kind} "
            f"{race} shoulder of {height:.3g} mm; {remedy}, or reduce load or clearance"
        )

    steep = np.abs(balls[:, :, INNER_ANGLE]).max(axis=1) > STEEPEST
    return Remark("shoulder", f"{row}{race} shoulder", (beyond > 0.0) & ~steep, sentence, row)


def needed_friction(balls: Array, ratings: Sequence[Rating]) -> Array:
    """Largest friction coefficient (n,) that a contact needs for its share of the gyroscopic moment, 2 s M_g/(D Q)."""
    inner, outer = balls[:, :, INNER_LOAD], balls[:, :, OUTER_LOAD]
    controls = [rating.model.control for rating in ratings]
    # All points of a sweep have the same kind of control.
    if not isinstance(controls[0], FixedShare | FrictionShare):
        return np.zeros(len(ratings))
    share = np.array([[control[0]] for control in controls])
    diameter = np.array([[rating.drawing.ball_diameter] for rating in ratings])
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(controls[0], FrictionShare):
            models = [rating.model for rating in ratings]
            ratio = np.array([[m.outer_contact.stiffness / m.inner_contact.stiffness] for m in models])
            weight = share * (inner / outer * ratio) ** (4.0 / 3.0)
            share = weight / (1.0 + weight)
        pull = 2.0 * np.abs(balls[:, :, MOMENT]) / diameter
        needed = np.maximum(share * pull / inner, (1.0 - share) * pull / outer)
    return np.where((inner > 0.0) & (outer > 0.0), needed, 0.0).max(axis=1)


def remarks(balls: Array, ratings: Sequence[Rating], name: str = "") -> list[Remark]:
    """Remarks on n equilibria of a row, ``balls`` (n, Z, FIGURES); ``name`` of the row, where there are two."""
    row = f"{name} row: " if name else ""
    touching, angle = balls[:, :, INNER_LOAD] > NO_LOAD, np.degrees(balls[:, :, INNER_ANGLE])
    size = touching.shape[1]
    clear = size - touching.sum(axis=1)
    steepest = np.where(touching, np.abs(angle), 0.0).max(axis=1)
    steep = steepest > math.degrees(STEEPEST)
    turned = np.sum(touching & (angle < 0.0), axis=1)
    shouldered = np.array([rating.drawing.contact_angle > 0.0 for rating in ratings])
    needed, (inner, outer) = needed_friction(balls, ratings), pressures(balls, ratings).values()
    # fmt: off
    listed = [
        ("loose-ring", "unloaded", clear == size, lambda k:
            "no ball touches the inner race, so the position of the ring is undetermined; load the ring or reduce the clearance"),
        ("clear-balls", "clear balls", (clear > 0) & (clear < size), lambda k: f"{clear[k]} of {size} balls are clear of the inner race"),
        ("dent", "inner dent", inner > BALLS, lambda k: dent_sentence(float(inner[k]), BALLS, "inner")),
        ("dent", "outer dent", outer > BALLS, lambda k: dent_sentence(float(outer[k]), BALLS, "outer")),
        ("no-shoulder", "steep angle", steep, lambda k:
            f"inner angles reach {steepest[k]:.0f} deg, beyond any shoulder: rotation pushes the inner ring off its balls; "
            "preload it axially or reduce the speed"),
        ("no-shoulder", "negative angle", shouldered & (turned > 0) & ~steep, lambda k:
            f"{turned[k]} balls carry load at negative angles, where an angular contact bearing has no shoulder; reverse the "
            "thrust or pair the bearing"),
        ("gyroscopic-slip", "gyroscopic slip", needed > OILED_FRICTION, lambda k:
            f"the gyroscopic moment needs a friction coefficient of {needed[k]:.2f}, more than oil gives: the balls slip "
            "about its axis; raise the load or reduce the speed"),
    ]
    # fmt: on
    over = [climbing(balls, ratings, race, row) for race in RACES]
    return [*(Remark(code, row + word, where, say, row) for code, word, where, say in listed), *over]


def tipping(tilts: Array, scene: BallScene) -> Remark:
    """Remark on a ring that is free to tilt and does, from ``tilts`` (n, 2) [rad]."""
    rigid = np.array([value is not None for value in scene.operation.displacements[3:]])
    tilt = np.hypot(*np.where(rigid, 0.0, tilts).T)
    # fmt: off
    return Remark("tipped-ring", "tipped ring", tilt > TIPPED, lambda k:
        f"the free ring tips by {1e3 * tilt[k]:.2g} mrad ({math.degrees(tilt[k]) * 60.0:.0f} arc minutes), more than a ring can on "
        "a shaft; set operation.tilt = 'fixed' if a shaft holds the ring")
    # fmt: on


def notes_of(entries: Sequence[Remark]) -> list[Note]:
    """Notes of the remarks on the first equilibrium."""
    return [remark.note(0) for remark in entries if remark.where[0]]


class RowReport(Record):
    """Equilibrium of one row, units in the names: displacement of its inner ring, figures of each ball and of each race.

    ``life``: None without a load; its hours also None where nothing turns. ``searches``: starting values that the finite
    search tried. ``reaction``: load that the ring takes, of a single-row bearing only.
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

    @property
    def figures(self) -> dict[str, float | None]:
        """Pressures, life, films, and the extremes of the balls' loads and angles, units in the names."""
        loaded = [ball for ball in self.balls if ball["inner_load_N"] > NO_LOAD]
        angles = [ball["inner_angle_deg"] for ball in loaded]
        figures: dict[str, float | None] = {f"{race}_pressure_MPa": p for race, p in self.max_stress_MPa.items()}
        figures["life_Mrev" if self.life["L10_h"] is None else "life_h"] = self.life["L10_h"] or self.life["L10_Mrev"]
        for race, contact in self.contacts.items():
            figures |= {
                f"{race}_{key}": contact.get(key)
                for key in ("load_N", "central_film_um", "lambda_ratio", "edge_angle_deg")
            }
        if angles:
            figures |= {"inner_angle_min_deg": min(angles), "inner_angle_max_deg": max(angles)}
        return figures | {"loaded_balls": float(len(loaded)), "needed_friction": self.needed_friction}


class DoubleDeckerReport(Record):
    """Equilibrium of a double-decker bearing: its inner ring, its middle ring and both rows."""

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
    """Equilibrium of a ball bearing.

    ``scene``: resolved input. ``status``: "ok", or the cause of the failure. ``report``: figures of the equilibrium, None
    without one. ``ring_growth_um``, ``fits``: where the scene has ring growth or a mounting. ``other_roots``: other
    equilibria of the same load, where the solver searches for them. ``runout``: of the turning ring, where the command
    computed it. ``temperatures_C``: of "oil", "outer" ring, "inner" ring and balls ("rollers"), where the scene has a heat balance.
    ``thermal``: the balance: its "status" ("steady", "undecided", "no steady state", "seizure" or "too hot") and the "reason" of any but the
    first, the "gain" of the loop, heat by node, friction and its loads, heat by way out, conductances, ranges of the temperatures
    over the documented inputs, and the "path_C" of the search. The figures of the report are also attributes, by the keys of the JSON form: ``displacement_mm``, ``life``,
    ``max_stress_MPa``, and ``inner`` and ``outer`` of a double-decker bearing. ``rows``: solutions in SI, one, or those of the inner and outer row of a double-decker bearing; empty for a
    loaded result or without an equilibrium. ``ratings``: data of their pressures and lives.
    """

    FORMAT = "rbdyn.ball/2"
    WHAT = "equilibrium"
    status: str
    raceway_control: str
    solver: str
    report: RowReport | DoubleDeckerReport | None = spread(default=None)
    ring_growth_um: dict[str, float] | None = None
    fits: dict[str, Any] | None = None
    other_roots: list[dict[str, Any]] | None = None
    notes: Notes | None = None
    cost: dict[str, float]
    versions: dict[str, str]
    scene: dict[str, Any]
    runout: dict[str, float] | None = None
    temperatures_C: dict[str, float] | None = None  # noqa: N815
    thermal: dict[str, Any] | None = None
    rows: tuple[Solution, ...] = outside_json(default=())
    ratings: tuple[Rating, ...] = outside_json(default=())

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``as_dict``. Raises KeyError or TypeError for anything else."""
        result = super().from_dict(data)
        if result.is_equilibrium and result.report is None:
            raise KeyError("an equilibrium without its figures")
        return result

    def __getattr__(self, name: str) -> Any:
        report = self.__dict__.get("report")
        if report is not None and name in type(report).__dataclass_fields__:
            return getattr(report, name)
        status = self.__dict__.get("status", "ok")
        why = "" if status == "ok" else f"; there is no equilibrium: {status}"
        raise AttributeError(f"BallResult has no attribute {name!r}{why}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *({} if self.report is None else type(self.report).__dataclass_fields__)]

    @property
    def is_equilibrium(self) -> bool:
        """Whether there is an equilibrium."""
        return self.status == "ok"

    @property
    def displacement(self) -> Array:
        """(x, y, z [m], theta_x, theta_y [rad]) of the inner ring. Raises MethodError where there is no equilibrium."""
        report = self.reached
        place, tilt = report.displacement_mm, report.tilt_mrad
        return 1e-3 * np.array([place["x"], place["y"], place["z"], tilt["x"], tilt["y"]])

    @property
    def reached(self) -> RowReport | DoubleDeckerReport:
        """The report. Raises MethodError without an equilibrium."""
        if self.report is None:
            raise MethodError(f"there is no equilibrium: {self.status}")
        return self.report

    @property
    def row_reports(self) -> dict[str, RowReport]:
        """Report of each row by name: "inner" and "outer", or "" for a single row. Raises MethodError as ``reached``."""
        report = self.reached
        return {"": report} if isinstance(report, RowReport) else {"inner": report.inner, "outer": report.outer}

    @property
    def figures(self) -> dict[str, float]:
        """All figures by name, units in the names; none without an equilibrium."""
        if self.report is None:
            return {}
        report, heat = self.report, self.thermal or {}
        figures: dict[str, float | None] = {}
        for name, row in self.row_reports.items():
            figures |= {f"{name}_row_{key}" if name else key: value for key, value in row.figures.items()}
        figures |= {f"displacement_{axis}_um": 1e3 * report.displacement_mm[axis] for axis in "xyz"}
        figures |= {f"tilt_{axis}_mrad": report.tilt_mrad[axis] for axis in "xy"}
        figures |= {f"stiffness_{key}": value for key, value in report.stiffness.items() if key != "matrix_SI"}
        if isinstance(report, DoubleDeckerReport):
            figures["middle_ring_speed_rpm"] = report.middle_ring["speed_rpm"]
        figures |= {f"fit_{race}_pressure_MPa": (self.fits or {}).get(f"{race}_pressure_MPa") for race in RACES}
        nodes = {("ball" if node == "rollers" else node): value for node, value in (self.temperatures_C or {}).items()}
        figures |= {f"{node}_temperature_C": value for node, value in nodes.items()}
        if "clearance_um" in heat:
            figures["operating_clearance_um"] = heat["clearance_um"]["operating"]
            figures["friction_W"] = math.fsum(heat["friction_W"].values())
        return {name: float(value) for name, value in figures.items() if value is not None}

    def brief(self) -> tuple[str, list[Figure]]:
        """Status and number of notes; pressures and life of each row, displacement and stiffness, exact in the model."""
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
        return ball_sheet(self.row_reports).frame


BALL_COLUMNS: tuple[Column[Mapping[str, Any]], ...] = (
    Column("azimuth_deg", ".1f", "azimuth [deg]", meaning="place from x towards y"),
    Column("inner_angle_deg", ".4g", "inner angle [deg]", meaning="contact angles, signed"),
    Column("outer_angle_deg", ".4g", "outer angle"),
    Column("inner_load_N", ".4g", "inner load [N]", meaning="contact loads"),
    Column("outer_load_N", ".4g", "outer load"),
    Column("centrifugal_force_N", ".4g", "centrifugal [N]", meaning="outwards"),
    Column("gyroscopic_moment_Nmm", screen=False, unit="N mm", meaning="negative with the inner ring turning"),
)
ROW_AND_BALL: tuple[Column[Mapping[str, Any]], ...] = (
    Column("row", meaning="of a double-decker: which row, and the ball in it"),
    Column("ball"),
)


def ball_sheet(rows: Mapping[str, RowReport]) -> Sheet[Mapping[str, Any]]:
    """A row a ball of the rows by name; a single row has no name."""
    balls = [{"row": name, "ball": place, **ball} for name, row in rows.items() for place, ball in enumerate(row.balls)]
    columns = BALL_COLUMNS if "" in rows else (*ROW_AND_BALL, *BALL_COLUMNS)
    return Sheet("", columns, balls, file="balls.csv", content="A row a ball of `rbdyn ball`.")


def displacement_record(displacement: Array) -> dict[str, Any]:
    """Displacement of a ring in mm and mrad."""
    x, y, z, tilt_x, tilt_y = (1e3 * float(value) for value in displacement)
    return {"displacement_mm": {"x": x, "y": y, "z": z}, "tilt_mrad": {"x": tilt_x, "y": tilt_y}}


def ball_columns(balls: Array) -> dict[str, Array]:
    """Figures of the balls, (n, Z) each, by the column names of ``BallResult.table``."""
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
            race: {
                **contact_record(contacts[race], float(loads[race].max())),
                **_shoulder_record(rating, solution, race),
                **film.get(race, {}),
            }
            for race in RACES
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


def _shoulder_record(rating: Rating, solution: Solution, race: Race) -> dict[str, float]:
    """Largest angle at the edge of a contact ellipse, if any ball touches, and that of the shoulder [deg]."""
    edge = float(edge_angles(solution.figures[np.newaxis], [rating], race).max())
    reached = {"edge_angle_deg": math.degrees(edge)} if math.isfinite(edge) else {}
    return {**reached, "shoulder_angle_deg": math.degrees(rating.drawing.shoulder_angle(race))}


def film_record(scene: BallScene, rating: Rating, solution: Solution, rings: tuple[str, str]) -> dict[str, Any]:
    """Film of each race at its largest load, the thermal factor included; ``rings``: names of the inner and the outer ring.

    Empty for a scene without oil, and for races without load or rolling speed.
    """
    if scene.lubricant is None:
        return {}
    lubricant, drawing, model = scene.lubricant, rating.drawing, rating.model
    ball, inner, outer = (scene.material(part) for part in ("ball", *rings))
    gamma = drawing.gamma
    entrainment = point_contact.entrainment_speed(drawing.pitch_diameter, gamma, *rating.speeds)
    films = {}
    for race, contact, ring, side, loads in (
        ("inner", model.inner_contact, inner, gamma, solution.inner_load),
        ("outer", model.outer_contact, outer, -gamma, solution.outer_load),
    ):
        load = float(loads.max())
        if entrainment == 0.0 or load == 0.0:
            continue
        oil = lubricant.at(race_film_temperature(scene, race))
        radius = point_contact.rolling_radius(drawing.ball_diameter, side)
        rolling = point_contact.RollingBall(contact, radius, equivalent_modulus(ball, ring), entrainment)
        heat = float(point_contact.thermal_factor(rolling, oil, load))
        central = float(point_contact.central_film(rolling, oil, load)) * heat
        roughness = lubricant.roller_roughness, lubricant.race_roughness
        films[race] = {
            "central_film_um": 1e6 * central,
            "minimum_film_um": 1e6 * float(point_contact.minimum_film(rolling, oil, load)) * heat,
            "lambda_ratio": float(lambda_ratio(central, *roughness)),
            "film_stiffness_N_per_um": 1e-6 * float(point_contact.film_stiffness(rolling, oil, load)),
        }
    return films


Columns = dict[str, Array]


def ring_columns(displacement: Array, reaction: Array, stiffness: Array) -> Columns:
    """Displacement, reaction and diagonal stiffnesses of a ring, from arrays (n, 5), (n, 5), (n, 5, 5) in SI."""
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

    A ball on the outer race alone has no inner angle: the extremes leave it out, and its angle as ball 1 is NaN.
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
    """L10 [1e6 turns] from loads (n, Z) [N], ``life.row_life`` of many points; infinite without a load."""
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
