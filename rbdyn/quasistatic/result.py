"""Results of ball bearings in equilibrium: ``BallResult`` with its reports, remarks, and figures of a point of a sweep.

Reports hold contact angles, loads, stress, contacts, film, stiffness and life. Remarks warn of balls clear of a race, dents,
steep angles, slip, and a ring that tips. Figures have units in their names.
"""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Column, Sheet, columns_of, within
from rbdyn.base.faults import MethodError
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, outside_json, shown, spread, written
from rbdyn.base.words import Brief, Figure, counted
from rbdyn.contact import point_contact
from rbdyn.contact.film_thickness import lambda_ratio
from rbdyn.contact.hertz_line import BALLS, SHAKEDOWN, dent_sentence, overload_sentence
from rbdyn.contact.point_contact import PointContact, peak_pressure
from rbdyn.life import Life, LifeFigures, Turning, turning_rings
from rbdyn.life.balls import rated_capacities, rated_capacity, row_life
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.quasistatic.row.ball import FixedShare, FrictionShare
from rbdyn.quasistatic.row.equilibrium import INNER_ANGLE, INNER_LOAD, MOMENT, OUTER_ANGLE, OUTER_LOAD, PULL, Solution
from rbdyn.quasistatic.row.model import IDLE, RowModel, carrying
from rbdyn.quasistatic.runout.turn import Runout
from rbdyn.result import BallHeatBalance, ColdSeizure, Film, SavedRecord, StartResult
from rbdyn.scene.ball import BallRow, BallScene
from rbdyn.scene.fits import Fits, race_film_temperature

if TYPE_CHECKING:
    import pandas as pd


def capacity_of(drawing: BallRow) -> float:
    """C_r of a row [N], from the catalogue or else by ISO 281 from the dimensions."""
    if drawing.dynamic_capacity_N is not None:
        return drawing.dynamic_capacity_N
    sizes = drawing.balls, drawing.ball_diameter, drawing.pitch_diameter, drawing.rated_angle
    return rated_capacity(*sizes, *drawing.groove_factors)


def reference_capacities(drawing: BallRow) -> tuple[float, float]:
    """Ball loads [N] that the inner and the outer race bear for 1e6 turns by ISO/TS 16281."""
    angle = drawing.rated_angle
    gamma = drawing.ball_diameter * math.cos(angle) / drawing.pitch_diameter
    return rated_capacities(capacity_of(drawing), drawing.balls, gamma, angle, *drawing.groove_factors)


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


class Rating(NamedTuple):
    """Data of a row for pressures, life and remarks: capacities of both races [N], speeds of both rings [rad/s]."""

    drawing: BallRow
    model: RowModel
    capacities: tuple[float, float]
    speeds: tuple[float, float]

    def contact(self, race: Race) -> PointContact:
        """The contact of a ball with a race."""
        return self.model.inner_contact if race == "inner" else self.model.outer_contact

    def groove(self, race: Race) -> float:
        """Radius of the groove of a race [m]."""
        inner, outer = self.drawing.groove_factors
        return (inner if race == "inner" else outer) * self.drawing.ball_diameter


class Remark(NamedTuple):
    """A note on an equilibrium, and its subject in a word."""

    word: str
    note: Note


def loads_on(solution: Solution, race: Race) -> Array:
    """Loads (Z,) of the balls on a race [N]."""
    return solution.inner_load if race == "inner" else solution.outer_load


def pressures(solution: Solution, rating: Rating) -> dict[Race, float]:
    """Largest Hertz pressure on each race [Pa]."""
    return {race: float(peak_pressure(rating.contact(race), loads_on(solution, race).max())) for race in RACES}


def overload(solution: Solution, rating: Rating) -> str:
    """A sentence on a contact ellipse too long for its groove or a pressure above shakedown; empty without."""
    for race in RACES:
        loads, groove = loads_on(solution, race), rating.groove(race)
        half = rating.contact(race).semi_major * np.cbrt(loads.max())
        if half > groove:
            azimuth = 360.0 * loads.argmax() / len(loads)
            return (
                f"overloaded: the ball at {azimuth:.0f} deg would carry {loads.max():.4g} N on the {race} raceway over "
                f"{2e3 * half:.3g} mm in a groove of {1e3 * groove:.3g} mm radius; reduce the load"
            )
    over = (item for item in pressures(solution, rating).items() if item[1] > SHAKEDOWN[BALLS])
    return next((f"overloaded: {race} raceway by {overload_sentence(peak, BALLS)}" for race, peak in over), "")


def edge_angles(solution: Solution, rating: Rating, race: Race) -> Array:
    """Angles (Z,) [rad] at the edge of the contact ellipse that is nearer to the shoulder; -inf without a contact.

    The ellipse lies along the groove: a semi-axis a adds asin(a/(f D)) to the contact angle. Negative angles of a bearing with
    one shoulder are not counted.
    """
    loads = loads_on(solution, race)
    angles = solution.inner_angle if race == "inner" else solution.outer_angle
    share = rating.contact(race).semi_major / rating.groove(race) * np.cbrt(np.maximum(loads, 0.0))
    size = np.abs(angles) if rating.drawing.both_ways else angles
    return np.where(carrying(loads) & (size >= 0.0), size + np.arcsin(np.minimum(share, 1.0)), -np.inf)


def _climbing(solution: Solution, rating: Rating, race: Race) -> tuple[bool, str]:
    """Whether a contact ellipse climbs over the shoulder of a race, and a sentence on it."""
    edges, shoulder, drawing = edge_angles(solution, rating, race), rating.drawing.shoulder_angle(race), rating.drawing
    key = f"{race}_shoulder_height_mm"
    azimuth, beyond = 360.0 * edges.argmax() / len(edges), float(edges.max() - shoulder)
    height = 1e3 * rating.groove(race) * (1.0 - math.cos(shoulder))
    kind = "estimated" if getattr(drawing, key) is None else "stated"
    remedy = f"state {key}" if kind == "estimated" else "make it higher"
    return beyond > 0.0, (
        f"the ellipse of the ball at {azimuth:.0f} deg climbs {math.degrees(beyond):.2g} deg over the {kind} "
        f"{race} shoulder of {height:.3g} mm; {remedy}, or reduce load or clearance"
    )


def needed_friction(solution: Solution, rating: Rating) -> float:
    """Largest friction coefficient that a contact needs for its share of the gyroscopic moment, 2 s M_g/(D Q)."""
    control, inner, outer = rating.model.control, solution.inner_load, solution.outer_load
    if not isinstance(control, FixedShare | FrictionShare):
        return 0.0
    share: Any = control[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(control, FrictionShare):
            ratio = rating.contact("outer").stiffness / rating.contact("inner").stiffness
            weight = share * (inner / outer * ratio) ** (4.0 / 3.0)
            share = weight / (1.0 + weight)
        pull = 2.0 * np.abs(solution.gyroscopic_moment) / rating.drawing.ball_diameter
        needed = np.maximum(share * pull / inner, (1.0 - share) * pull / outer)
    return float(np.where(carrying(solution.inner_load) & (outer > 0.0), needed, 0.0).max())


def remarks(solution: Solution, rating: Rating, name: str = "") -> list[Remark]:
    """Remarks on the equilibrium of a row; ``name`` of the row, where there are two."""
    row = f"{name} row: " if name else ""
    touching, angle = carrying(solution.inner_load), np.degrees(solution.inner_angle)
    size, clear = len(touching), int(np.sum(solution.inner_load == 0.0))
    idle = size - clear - int(np.sum(touching))
    steepest = float(np.where(touching, np.abs(angle), 0.0).max())
    steep, turned = steepest > math.degrees(STEEPEST), int(np.sum(touching & (angle < 0.0)))
    needed, (inner, outer) = needed_friction(solution, rating), pressures(solution, rating).values()
    climbs = {race: _climbing(solution, rating, race) for race in RACES}
    # fmt: off
    listed = [
        ("loose-ring", "unloaded", clear == size,
            "no ball touches the inner raceway, so the position of the ring is undetermined; load the ring or reduce the clearance"),
        ("clear-balls", "clear balls", 0 < clear < size, f"{clear} of {size} balls are clear of the inner raceway"),
        ("clear-balls", "idle balls", idle > 0,
            f"{idle} of {size} balls carry less than {100.0 * IDLE:g} % of the largest ball load; more axial preload would load them"),
        ("dent", "inner dent", inner > BALLS, dent_sentence(inner, BALLS, "inner")),
        ("dent", "outer dent", outer > BALLS, dent_sentence(outer, BALLS, "outer")),
        ("no-shoulder", "steep angle", steep,
            f"inner angles reach {steepest:.0f} deg, beyond any shoulder: rotation pushes the inner ring off its balls; "
            "raise its axial preload or reduce the speed"),
        ("no-shoulder", "negative angle", turned > 0 and not rating.drawing.both_ways and not steep,
            f"{turned} of {size} balls carry load at negative angles, where an angular contact bearing has no shoulder; reverse the "
            "thrust or pair the bearing"),
        ("gyroscopic-slip", "gyroscopic slip", needed > OILED_FRICTION,
            f"the gyroscopic moment needs a friction coefficient of {needed:.2f}, more than oil gives: the balls slip "
            "about its axis; raise the load or reduce the speed"),
        *(("shoulder", f"{race} shoulder", climbs and not steep, words) for race, (climbs, words) in climbs.items()),
    ]
    # fmt: on
    return [Remark(row + word, Note(code, row + sentence)) for code, word, holds, sentence in listed if holds]


def tipping(displacement: Array, scene: BallScene) -> list[Remark]:
    """Remark on a ring that is free to tilt and does, by its displacement (5,) [m, rad]."""
    free = [value is None for value in scene.operation.displacements[3:]]
    tilt = float(np.hypot(*np.where(free, displacement[3:], 0.0)))
    sentence = (
        f"the free ring tips by {1e3 * tilt:.2g} mrad ({math.degrees(tilt) * 60.0:.0f} arc minutes), more than a ring can on "
        "a shaft; set operation.tilt = 'fixed' if a shaft holds the ring"
    )
    return [Remark("tipped ring", Note("tipped-ring", sentence))] if tilt > TIPPED else []


class RingPlace(Record):
    """Displacement of a ring by axis, units in the names."""

    displacement_mm: dict[str, float]
    tilt_mrad: dict[str, float]


class RingLoad(Record):
    """Load that a ring takes, and its moment, by axis."""

    load_N: dict[str, float]  # noqa: N815
    moment_Nm: dict[str, float]  # noqa: N815

    @classmethod
    def of(cls, load: Array) -> Self:
        """The load (5,) of an equilibrium."""
        return cls(dict(zip("xyz", load[:3].tolist(), strict=True)), dict(zip("xy", load[3:].tolist(), strict=True)))


class Ball(Record):
    """Angles, loads and moment of one ball, units in the names."""

    azimuth_deg: float = shown("azimuth [deg]", ".1f", meaning="place from x towards y")
    inner_angle_deg: float = shown("inner angle [deg]", ".4g", meaning="contact angles, signed")
    outer_angle_deg: float = shown("outer angle", ".4g")
    inner_load_N: float = shown("inner load [N]", ".4g", meaning="contact loads")  # noqa: N815
    outer_load_N: float = shown("outer load", ".4g")  # noqa: N815
    centrifugal_force_N: float = shown("centrifugal [N]", ".4g", meaning="outwards")  # noqa: N815
    gyroscopic_moment_Nmm: float = written("negative with the inner ring turning", unit="N mm")  # noqa: N815


class BallFilm(Film):
    """Oil film of a ball with its stiffness."""

    film_stiffness_N_per_um: float  # noqa: N815


class BallContact(Record, kw_only=True):
    """Contact of the most loaded ball with a race: its ellipse, and its film if there is one.

    ``edge_angle_deg``: largest angle at the edge of an ellipse of the row, None where no ball touches.
    """

    load_N: float  # noqa: N815
    semi_major_mm: float
    semi_minor_mm: float
    area_mm2: float = derived(lambda self: math.pi * self.semi_major_mm * self.semi_minor_mm)
    edge_angle_deg: float | None = None
    shoulder_angle_deg: float
    film: BallFilm | None = spread(default=None)


class Stiffness(Record):
    """Stiffness of a ring: its diagonal, and all of it (5, 5) in SI."""

    x_N_per_um: float = derived(lambda self: 1e-6 * self.matrix_SI[0][0])  # noqa: N815
    y_N_per_um: float = derived(lambda self: 1e-6 * self.matrix_SI[1][1])  # noqa: N815
    z_N_per_um: float = derived(lambda self: 1e-6 * self.matrix_SI[2][2])  # noqa: N815
    tilt_x_Nm_per_mrad: float = derived(lambda self: 1e-3 * self.matrix_SI[3][3])  # noqa: N815
    tilt_y_Nm_per_mrad: float = derived(lambda self: 1e-3 * self.matrix_SI[4][4])  # noqa: N815
    matrix_SI: list[list[float]]  # noqa: N815

    @property
    def by_axis(self) -> dict[str, float]:
        """Against displacements along the axes [N/um]."""
        return {"x": self.x_N_per_um, "y": self.y_N_per_um, "z": self.z_N_per_um}

    @property
    def figures(self) -> dict[str, float]:
        """Its diagonal, units in the names."""
        return {f"stiffness_{key}": value for key, value in self.as_dict().items() if key != "matrix_SI"}


class RowState(RingPlace):
    """Equilibrium of one row: displacement of its inner ring, and its balls."""

    balls: list[Ball]


class RowReport(RowState):
    """Equilibrium of one row with figures of each race, units in the names.

    ``life``: None without a load; its hours also None where nothing turns. ``searches``: starting values that the finite
    search tried. ``reaction``: load that the ring takes, of a single-row bearing only.
    """

    max_stress_MPa: dict[str, float]  # noqa: N815
    contacts: dict[str, BallContact]
    stiffness: Stiffness
    life: LifeFigures
    needed_friction: float
    residual_N: float  # noqa: N815
    iterations: int
    searches: int | None = None
    reaction: RingLoad | None = None

    @property
    def figures(self) -> dict[str, float | None]:
        """Pressures, life, films, and the extremes of the balls' loads and angles, units in the names."""
        loaded = [ball for ball in self.balls if ball.inner_load_N > 0.0]
        angles = [ball.inner_angle_deg for ball in loaded]
        figures: dict[str, float | None] = {f"{race}_pressure_MPa": p for race, p in self.max_stress_MPa.items()}
        figures["life_Mrev" if self.life.L10_h is None else "life_h"] = self.life.L10_h or self.life.L10_Mrev
        for race, contact in self.contacts.items():
            figures[f"{race}_load_N"] = contact.load_N
            if contact.film is not None:
                figures[f"{race}_central_film_um"] = contact.film.central_film_um
                figures[f"{race}_lambda_ratio"] = contact.film.lambda_ratio
            figures[f"{race}_edge_angle_deg"] = contact.edge_angle_deg
        if angles:
            figures |= {"inner_angle_min_deg": min(angles), "inner_angle_max_deg": max(angles)}
        return figures | {"loaded_balls": float(len(loaded)), "needed_friction": self.needed_friction}


class MiddleRing(RingPlace):
    """Middle ring of a double-decker: its displacement, its speed and share of the rings' speed, and the load that it takes."""

    speed_rpm: float
    speed_share: float | None
    speed_status: str
    friction_torque_Nmm: float | None  # noqa: N815
    load: RingLoad = spread()


class DoubleDeckerReport(RingPlace):
    """Equilibrium of a double-decker bearing: its inner ring, its middle ring and both rows."""

    stiffness: Stiffness
    reaction: RingLoad
    middle_ring: MiddleRing
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
    ``start``: of the cold machine, with [thermal.start]. ``thermal``: the heat balance. The figures of the report are also attributes, by the keys of the JSON form: ``displacement_mm``, ``life``,
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
    fits: Fits | None = None
    other_roots: list[RowState] | None = None
    notes: Notes | None = None
    cost: dict[str, float]
    versions: dict[str, str]
    scene: dict[str, Any]
    runout: Runout | None = None
    temperatures_C: dict[str, float] | None = None  # noqa: N815
    thermal: BallHeatBalance | ColdSeizure | None = None
    start: StartResult | None = None
    rows: tuple[Solution, ...] = outside_json(default=())
    ratings: tuple[Rating, ...] = outside_json(default=())

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``as_dict``. Raises KeyError or TypeError for anything else."""
        result = super().from_dict(data)
        if result.is_equilibrium and result.report is None:
            raise KeyError("an equilibrium without its results")
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
        return 1e-3 * np.array([*self.reached.displacement_mm.values(), *self.reached.tilt_mrad.values()])

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
        report, figures = self.report, dict[str, float | None]()
        for name, row in self.row_reports.items():
            figures |= {f"{name}_row_{key}" if name else key: value for key, value in row.figures.items()}
        figures |= {f"displacement_{axis}_um": 1e3 * report.displacement_mm[axis] for axis in "xyz"}
        figures |= {f"tilt_{axis}_mrad": report.tilt_mrad[axis] for axis in "xy"}
        figures |= report.stiffness.figures
        if isinstance(report, DoubleDeckerReport):
            figures["middle_ring_speed_rpm"] = report.middle_ring.speed_rpm
        if self.fits is not None:
            figures["fit_inner_pressure_MPa"] = self.fits.inner_pressure_MPa
            figures["fit_outer_pressure_MPa"] = self.fits.outer_pressure_MPa
        nodes = {("ball" if node == "rollers" else node): value for node, value in (self.temperatures_C or {}).items()}
        figures |= {f"{node}_temperature_C": value for node, value in nodes.items()}
        if isinstance(self.thermal, BallHeatBalance):
            figures["operating_clearance_um"] = self.thermal.clearance_um["operating"]
            figures["friction_W"] = math.fsum(self.thermal.friction_W.values())
        figures |= {} if self.start is None else {name: each.value for name, each in self.start.figures.items()}
        return {name: float(value) for name, value in figures.items() if value is not None}

    def brief(self) -> tuple[str, list[Figure]]:
        """Status and number of notes; pressures and life of each row, displacement and stiffness, exact in the model."""
        figures = []
        for name, row in self.row_reports.items() if self.report else ():
            of_row = f"{name} row " if name else ""
            stress = row.max_stress_MPa.items()
            figures += [Figure(f"{of_row}pressure, {race} raceway", p, None, "MPa") for race, p in stress]
            figures.append(Figure(f"{of_row}life L10", row.life.L10_Mrev, None, "million turns"))
        for axis, stiffness in self.report.stiffness.by_axis.items() if self.report else ():
            figures.append(Figure(f"displacement {axis}", 1e3 * self.reached.displacement_mm[axis], None, "µm"))
            figures.append(Figure(f"stiffness {axis}", stiffness, None, "N/µm"))
        return f"{self.status}, {counted(len(self.notes or ()), 'note')}", figures

    def table(self) -> "pd.DataFrame":
        """A row a ball: azimuth, angles, loads, centrifugal force, gyroscopic moment; units in the names."""
        return ball_sheet(self.row_reports).frame


BALL_COLUMNS: tuple[Column[tuple[str, int, Ball]], ...] = (
    Column("row", at=0, meaning="of a double-decker: which row, and the ball in it"),
    Column("ball", at=1),
    *within(2, columns_of(Ball)),
)


def ball_sheet(rows: Mapping[str, RowReport]) -> Sheet[tuple[str, int, Ball]]:
    """A row a ball of the rows by name; a single row has no name."""
    balls = [(name, place, ball) for name, row in rows.items() for place, ball in enumerate(row.balls)]
    columns = BALL_COLUMNS[2:] if "" in rows else BALL_COLUMNS
    return Sheet("", columns, balls, file="balls.csv", content="One row per ball of `rbdyn ball`.")


def displacement_record(displacement: Array) -> dict[str, Any]:
    """Displacement of a ring in mm and mrad."""
    x, y, z, tilt_x, tilt_y = (1e3 * float(value) for value in displacement)
    return {"displacement_mm": {"x": x, "y": y, "z": z}, "tilt_mrad": {"x": tilt_x, "y": tilt_y}}


def ball_columns(figures: Array) -> dict[str, Array]:
    """Figures of the balls (..., Z), by the column names of ``BallResult.table``, from those (..., Z, FIGURES) of ``solve_row``."""
    shape = figures.shape[:-1]
    return {
        "azimuth_deg": np.broadcast_to(360.0 * np.arange(shape[-1]) / shape[-1], shape),
        "inner_angle_deg": np.degrees(figures[..., INNER_ANGLE]),
        "outer_angle_deg": np.degrees(figures[..., OUTER_ANGLE]),
        "inner_load_N": figures[..., INNER_LOAD],
        "outer_load_N": figures[..., OUTER_LOAD],
        "centrifugal_force_N": figures[..., PULL],
        "gyroscopic_moment_Nmm": 1e3 * figures[..., MOMENT],
    }


def balls_of(figures: Array) -> list[Ball]:
    """The balls, from the figures (Z, FIGURES) of ``solve_row``."""
    columns = [values.tolist() for values in ball_columns(figures).values()]
    return [Ball(*values) for values in zip(*columns, strict=True)]


def row_report(
    rating: Rating, solution: Solution, films: Mapping[Race, BallFilm], reaction: RingLoad | None
) -> RowReport:
    """Report of one row; ``films``: of ``films_of``."""
    life = solution_life(solution, rating.capacities, turning_rings(*rating.speeds))
    return RowReport(
        **displacement_record(solution.displacement),
        balls=balls_of(solution.figures),
        max_stress_MPa={race: 1e-6 * pressure for race, pressure in pressures(solution, rating).items()},
        contacts={race: _contact(rating, solution, race, films.get(race)) for race in RACES},
        stiffness=Stiffness(solution.stiffness.tolist()),
        life=life.figures(*rating.speeds),
        needed_friction=needed_friction(solution, rating),
        residual_N=solution.residual,
        iterations=solution.steps,
        searches=solution.searches,
        reaction=reaction,
    )


def _contact(rating: Rating, solution: Solution, race: Race, film: BallFilm | None) -> BallContact:
    load, edge = float(loads_on(solution, race).max()), float(edge_angles(solution, rating, race).max())
    contact, grown = rating.contact(race), load ** (1.0 / 3.0)
    return BallContact(
        load_N=load,
        semi_major_mm=1e3 * contact.semi_major * grown,
        semi_minor_mm=1e3 * contact.semi_minor * grown,
        edge_angle_deg=math.degrees(edge) if math.isfinite(edge) else None,
        shoulder_angle_deg=math.degrees(rating.drawing.shoulder_angle(race)),
        film=film,
    )


def films_of(scene: BallScene, rating: Rating, solution: Solution, rings: tuple[str, str]) -> dict[Race, BallFilm]:
    """Film of each race at its largest load; ``rings``: names of the inner and the outer ring.

    Empty for a scene without oil, and without races that have no load or no rolling speed.
    """
    if scene.lubricant is None:
        return {}
    lubricant, drawing = scene.lubricant, rating.drawing
    roughness = lubricant.roller_roughness, lubricant.race_roughness
    entrainment = point_contact.entrainment_speed(drawing.pitch_diameter, drawing.gamma, *rating.speeds)
    films = dict[Race, BallFilm]()
    for race, ring, side in zip(RACES, rings, (drawing.gamma, -drawing.gamma), strict=True):
        load = float(loads_on(solution, race).max())
        if entrainment == 0.0 or load == 0.0:
            continue
        oil = lubricant.at(race_film_temperature(scene, race))
        radius = point_contact.rolling_radius(drawing.ball_diameter, side)
        modulus = equivalent_modulus(scene.material("ball"), scene.material(ring))
        rolling = point_contact.RollingBall(rating.contact(race), radius, modulus, entrainment)
        heat = float(point_contact.thermal_factor(rolling, oil, load))
        central = float(point_contact.central_film(rolling, oil, load)) * heat
        films[race] = BallFilm(
            central_film_um=1e6 * central,
            minimum_film_um=1e6 * float(point_contact.minimum_film(rolling, oil, load)) * heat,
            lambda_ratio=float(lambda_ratio(central, *roughness)),
            film_stiffness_N_per_um=1e-6 * float(point_contact.film_stiffness(rolling, oil, load)),
        )
    return films


def ring_figures(displacement: Array, reaction: RingLoad, stiffness: Stiffness) -> dict[str, float]:
    """Displacement, reaction and stiffnesses of a ring, from a ``displacement`` (5,) in SI."""
    figures = {f"{axis}_mm": 1e3 * displacement[i] for i, axis in enumerate("xyz")}
    figures |= {f"tilt_{axis}_mrad": 1e3 * displacement[3 + i] for i, axis in enumerate("xy")}
    figures |= {f"force_{axis}_N": force for axis, force in reaction.load_N.items()}
    figures |= {f"moment_{axis}_Nm": moment for axis, moment in reaction.moment_Nm.items()}
    return figures | stiffness.figures


def row_figures(solution: Solution, rating: Rating) -> dict[str, float]:
    """Angles, loads, pressures and life of a row.

    A ball on the outer race alone has no inner angle: the extremes leave it out, and its angle as ball 1 is NaN.
    """
    touching = solution.inner_load > 0.0
    inner, outer = np.where(touching, np.degrees(solution.inner_angle), np.nan), np.degrees(solution.outer_angle)
    loaded = inner[touching] if touching.any() else np.array([np.nan])
    life = solution_life(solution, rating.capacities, turning_rings(*rating.speeds))
    return {
        "inner_angle_min_deg": loaded.min(),
        "inner_angle_max_deg": loaded.max(),
        "inner_angle_ball_1_deg": inner[0],
        "outer_angle_min_deg": outer.min(),
        "outer_angle_max_deg": outer.max(),
        "outer_angle_ball_1_deg": outer[0],
        "loaded_balls": touching.sum(),
        "inner_load_max_N": solution.inner_load.max(),
        "outer_load_max_N": solution.outer_load.max(),
        **{f"{race}_pressure_MPa": 1e-6 * pressure for race, pressure in pressures(solution, rating).items()},
        "L10_Mrev": life.million_turns,
        "L10_h": life.hours(*rating.speeds),
    }
