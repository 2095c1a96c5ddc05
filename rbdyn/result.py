"""What a simulation returns: a frozen record that saves and loads itself as JSON."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Self, TypeVar

from rbdyn.base.blocks import Column, Sheet, columns_of, within
from rbdyn.base.files import read_record, write_json
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, keyed, nullable, shown, spread, written
from rbdyn.base.words import Brief, Figure, counted, error_alone, quantity, value_alone, with_error
from rbdyn.clearances import DIFFERENCE
from rbdyn.verdict.orbits import CageVerdict

if TYPE_CHECKING:
    import pandas as pd

Saved = TypeVar("Saved")
# What tables say of figures and of their errors.
OF_FIGURE, HALF_WIDTHS = "of the result", "half widths of the 95 % intervals"


class SimulatedValue(Record):
    """A simulated value with the half-widths of its 95 % intervals; None where an error was not estimated."""

    value: float = shown(
        "value", cell=lambda figure: figure.value_text, unit=OF_FIGURE, meaning="mean over all turns and replicates"
    )
    statistical_error: float | None = shown(
        "statistical error (95 %)", error_alone, missing="not estimated", unit=OF_FIGURE, meaning=HALF_WIDTHS
    )
    numerical_error: float | None = shown(
        "numerical error (95 %)", error_alone, missing="not estimated", unit=OF_FIGURE, meaning=HALF_WIDTHS
    )

    @property
    def error(self) -> float | None:
        """Half-width of the 95 % interval that is stated: statistical and numerical error as root sum of squares.

        They err independently, and a sum would be too wide. None where neither was estimated.
        """
        errors = [error for error in (self.statistical_error, self.numerical_error) if error is not None]
        return math.hypot(*errors) if errors else None

    @property
    def stated_error(self) -> float | None:
        """The error to print next to the value; None where the statistical one is unknown.

        An error of the time steps alone says nothing of a figure that scatters.
        """
        return None if self.statistical_error is None else self.error

    @property
    def text(self) -> str:
        """The value with its stated error."""
        return with_error(self.value, self.stated_error)

    @property
    def value_text(self) -> str:
        """The value to the digits that its stated error bears; to five without one."""
        return value_alone(self.value, self.stated_error)

    @property
    def simulated_value(self) -> "SimulatedValue":
        """The value with its errors and nothing else."""
        return SimulatedValue(self.value, self.statistical_error, self.numerical_error)


class Quantity(SimulatedValue):
    """A figure with its errors, and what these rest on.

    ``effective_samples``: number of independent batches that would carry as much information as those of the run;
    ``degrees_of_freedom``: of Student's t in the statistical error, None without one.
    """

    effective_samples: float = written("independent samples behind the statistical error")
    degrees_of_freedom: int | None = written("those of Student's t in the statistical error", default=None)

    def __str__(self) -> str:
        parts = {"statistical": self.statistical_error, "numerical": self.numerical_error}
        errors = [f"{error_alone(error)} ({kind})" for kind, error in parts.items() if error is not None]
        return " ".join((self.value_text, *errors))


def arrays_of(figures: Sequence[Any]) -> Any:
    """Figures as arrays (4, ...): values, statistical and numerical half-widths (NaN: unknown), degrees of freedom (infinite: normal).

    ``figures``: of any number of dimensions; None counts as a figure that was not reported.
    """
    import numpy as np

    table = np.array(figures, dtype=object)
    names = ("value", "statistical_error", "numerical_error", "degrees_of_freedom")
    columns = np.array([[getattr(figure, name, None) for figure in table.flat] for name in names], dtype=float)
    columns[3] = np.nan_to_num(columns[3], nan=np.inf, posinf=np.inf)
    return columns.reshape(4, *table.shape)


def full_status(result: Any) -> str:
    """Status of a result with the reason of its heat balance, where that has no steady state."""
    reason = result.thermal and result.thermal.reason
    return f"{result.status}: {reason}" if reason and result.status != "ok" else str(result.status)


def figure_sheet(figures: Mapping[str, Quantity]) -> Sheet[tuple[str, Quantity]]:
    """A row a figure by its name, or its words."""
    name: Column[tuple[str, Quantity]] = Column("figure", at=0, meaning="name of the result, its unit at the end")
    columns = (name, *within(1, columns_of(Quantity)))
    return Sheet(
        "", columns, tuple(figures.items()), file="figures.csv", content="One row per result of `rbdyn simulate`."
    )


def cage_column() -> Column[Any]:
    """Column with the class of the cage, of rows that have a ``verdict``."""
    return Column(
        "cage",
        words="cage",
        at=lambda row: "" if row.verdict is None else row.verdict.name,
        cell=lambda row: "" if row.verdict is None else row.verdict.cell,
        text=True,
        meaning="class of the cage by its orbit, undecided or not judged; empty where the scene leaves it out",
    )


def start_sheet(start: "StartResult | None" = None) -> Sheet[Mapping[str, float]]:
    """A row a moment of a start: operating point, temperatures, heat of the nodes, clearances, and their ranges."""
    columns = dict[str, list[float]]()
    if start is not None:
        path = start.path
        columns = {"time_s": path.time_s, "speed_rpm": path.speed_rpm, "load_N": path.load_N}
        columns |= {f"{node}_temperature_C": column for node, column in path.temperatures_C.items()}
        columns |= {f"{node}_heat_W": column for node, column in path.heat_W.items()}
        plays = {name: name.replace("_um", "_clearance_um") for name in path.figures}
        columns |= {key: path.figures[name] for name, key in plays.items()}
        columns |= {
            f"{end}_{plays.get(name, f'{name}_temperature_C')}": row
            for name, rows in path.ranges.items()
            for end, row in zip(("low", "high"), rows, strict=True)
        }
    listed = [Column[Mapping[str, float]](name) for name in columns] or [
        Column[Mapping[str, float]]("time_s", meaning="time from the start of the machine"),
        Column[Mapping[str, float]]("{figure}", meaning="speed, load, temperatures, heat and clearances then"),
        Column[Mapping[str, float]]("low_{figure}, high_{figure}", meaning="5 and 95 % over the inputs of the balance"),
    ]
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    content = "One row per moment of a start ([thermal.start]), of `rbdyn simulate` and `rbdyn ball`."
    return Sheet("", listed, rows, file="start.csv", content=content)


def figure_columns(names: Iterable[str]) -> tuple[Column[Any], ...]:
    """Columns of files with each figure and its two errors, of rows that have ``figures`` by name."""
    quantity_columns = columns_of(Quantity)[:3]

    def column(name: str, of_quantity: Column[Quantity]) -> Column[Any]:
        key = name if of_quantity.key == "value" else f"{name}_{of_quantity.key}"
        return replace(within(("figures", name), [of_quantity])[0], key=key, screen=False)

    return tuple(column(name, of_quantity) for name in names for of_quantity in quantity_columns)


class SavedRecord(Record):
    """A record in a file: ``FORMAT`` is in the file, ``WHAT`` names it in messages."""

    FORMAT: ClassVar[str]
    WHAT: ClassVar[str]
    format: str = derived(lambda self: self.FORMAT)

    def save(self, path: Path | str) -> None:
        """Write JSON, whole or not at all."""
        write_json(path, self.as_dict())

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a saved record. Raises InputError when the file is missing or another one."""
        return read_record(path, cls.FORMAT, cls.WHAT, cls.from_dict)


# Radius of the cage's orbit over its radial clearance below which the cage only jitters. From the example and five catalogue
# bearings at 1700 to 12000 rpm, 0.1 to 10 % of C and all guidances: cages that a film keeps at one place move by 0.01 to 0.1 of
# their play, and none goes round its guide (whirl rate within 0.015 of 0). Those that rollers throw about move by 0.1 to 0.36.
# The two that go round (rates of 0.15 and 0.84 of the cage speed) move by 0.51 and 0.25.
JITTER = 0.1


# Temperatures of a heat balance as figures of their own, and the node that each is of.
TEMPERATURES = {
    "oil_temperature_C": "oil",
    "outer_temperature_C": "outer",
    "inner_temperature_C": "inner",
    "roller_temperature_C": "rollers",
}


class StartFigure(NamedTuple):
    """A figure of a start: its ``name`` among the ranges, its ``place`` in the JSON of a start, meaning, and which value is worst."""

    name: str
    place: str
    meaning: str
    worst: Literal["largest", "least", "none"] = "largest"


PRESSURE, SETTLING, SEIZING = "race_pressure_MPa", "time_to_steady_s", "share_of_seizure"
_PLAYS = ("radial", "guide", "pocket")
START_FIGURES = {
    **{
        f"start_{name}_clearance_um": StartFigure(
            f"{name}_um", f"{name}_um.least", f"least {name} clearance while the cold machine warms", "least"
        )
        for name in _PLAYS
    },
    "start_inner_minus_outer_K": StartFigure(
        DIFFERENCE,
        "temperature_difference_K",
        "largest lead of the inner ring over the outer one while the cold machine warms",
    ),
    **{
        f"start_{name}_time_s": StartFigure(
            f"{name}_um_time_s",
            f"{name}_um.time_s",
            f"time of the least {name} clearance; without a minimum 0 or the time to steady",
            "none",
        )
        for name in _PLAYS
    },
    "start_time_to_steady_s": StartFigure(
        SETTLING,
        SETTLING,
        "time from which on the temperatures of the warming machine stay within 1 K of the last ones",
    ),
    "start_race_pressure_MPa": StartFigure(
        PRESSURE, PRESSURE, "largest raceway pressure where the radial clearance is least while the machine warms"
    ),
    "start_share_of_seizure": StartFigure(
        SEIZING, SEIZING, "share of the input sets of the heat balance in which a part seizes while the machine warms"
    ),
}


# Those of a ball bearing alone.
BALL_START_FIGURES = {"start_axial_load_N": "axial_load_N", "start_contact_pressure_MPa": "contact_pressure_MPa"}


class Ranges(Record):
    """5 %, 50 % and 95 % of each figure by its name over the inputs that vary, and the share of input sets without a steady state.

    Without a steady state there are none.
    """

    figures: dict[str, tuple[float, ...]] | None = keyed("ranges")
    inputs: tuple[str, ...] | None = None
    unsteady: float | None = keyed("share_without_steady_state", default=None)

    @property
    def notes(self) -> Notes:
        """A note where some sets have no steady state."""
        if self.inputs is None or not self.unsteady:
            return ()
        share = f"{100.0 * self.unsteady:.0f} % of the input sets ({', '.join(self.inputs)})"
        return (Note("undecided", f"temperatures: {share} have no steady state"),)


class NodeBalance(Record, kw_only=True):
    """End of a heat balance, and heat, conductances and temperatures by node or way out.

    - ``status``: "steady", or with its ``reason`` "undecided", "no steady state", "seizure" or "too hot"
    - ``gain`` of the loop; ``path_C``: temperatures of the states visited
    """

    status: str
    reason: str | None = None
    gain: float
    heat_W: dict[str, float]  # noqa: N815
    carried_off_W: dict[str, float]  # noqa: N815
    conductances_W_K: dict[str, float]  # noqa: N815
    ranges: Ranges = spread()
    path_C: list[dict[str, float]]  # noqa: N815


class HeatBalance(NodeBalance, kw_only=True):
    """Heat balance of a roller bearing; ``slopes`` of the loop where it is steady."""

    slopes: list[list[float]] | None = None
    windage_W: float  # noqa: N815
    oil_fraction: float | None


class BallHeatBalance(NodeBalance, kw_only=True):
    """Heat balance of a row of balls.

    - ``friction_W`` "rolling" and "sliding", and the loads of the friction model
    - ``clearance_um`` and ``unloaded_angle_deg``: "drawn" and "operating"
    - ``path_heat_W`` and ``path_clearance_um`` of the states visited
    """

    clearance_um: dict[str, float]
    unloaded_angle_deg: dict[str, float]
    friction_W: dict[str, float]  # noqa: N815
    friction_loads_N: dict[str, float]  # noqa: N815
    path_heat_W: list[float]  # noqa: N815
    path_clearance_um: list[float]


class ColdSeizure(Record):
    """Heat balance of a bearing that is impossible before any heat, at the temperatures of the cold machine."""

    status: str
    reason: str
    gain: None
    path_C: list[dict[str, float]]  # noqa: N815


class LeastClearance(Record):
    """Least diametral clearance of a start [um], and when; ``time_s``: None where it falls to its steady value without a minimum."""

    least: Quantity
    time_s: float | None


class GreatestValue(Record):
    """Largest value of a start, and when; ``time_s``: None where it is at an end of the course."""

    greatest: Quantity
    time_s: float | None


class StartMoment(Record):
    """A simulated moment of a start: its time, operating point, and the temperatures and powers there."""

    time_s: float | None
    speed_rpm: float
    load_N: float  # noqa: N815
    temperatures_C: dict[str, float]  # noqa: N815
    power_loss_W: float  # noqa: N815


class StartPath(Record):
    """Columns over time: operating point, and by name temperatures, heat, conductances, figures, and both ends of ranges."""

    time_s: list[float]
    speed_rpm: list[float]
    load_N: list[float]  # noqa: N815
    temperatures_C: dict[str, list[float]]  # noqa: N815
    heat_W: dict[str, list[float]]  # noqa: N815
    conductances_W_K: dict[str, list[float]]  # noqa: N815
    figures: dict[str, list[float]]
    ranges: dict[str, tuple[list[float], ...]]


class StartResult(Record, kw_only=True):
    """Start of a cold machine: least clearances, the lead of the inner ring, and temperatures over time.

    - ``status``: "steady", or with its ``reason`` "seizure", "too hot", "no steady state" or "undecided"
    - ``axial_load_N`` and ``contact_pressure_MPa``: largest ones of a ball bearing, which has no cage here, and no ``moments``
    - ``temperature_difference_K``: largest lead of the inner ring over the outer one; ``time_to_steady_s``: from which on all
      temperatures stay within 1 K of the last ones, None without a steady state
    - ``race_pressure_MPa``: largest pressure of the raceways where the radial clearance is least, None where that is impossible
    - ``quantities``: figures of a roller bearing by ``START_FIGURES``, with errors
    - ``ranges``: 5, 50 and 95 % of figures over the ``inputs``, ``share_of_seizure`` of the input sets, and
      ``share_with_minimum`` of them by clearance; without a minimum its time is 0 or that to steady
    - ``path``: with the capacities its columns satisfy C dT/dt = heat - what the conductances carry off
    """

    status: str
    reason: str | None = None
    radial_um: LeastClearance
    guide_um: LeastClearance | None = None
    pocket_um: LeastClearance | None = None
    axial_load_N: GreatestValue | None = None  # noqa: N815
    contact_pressure_MPa: GreatestValue | None = None  # noqa: N815
    temperature_difference_K: Quantity  # noqa: N815
    time_to_steady_s: float | None
    race_pressure_MPa: float | None  # noqa: N815
    quantities: dict[str, Quantity] = field(default_factory=dict)
    ranges: dict[str, tuple[float, ...]]
    inputs: tuple[str, ...]
    share_of_seizure: float
    share_with_minimum: dict[str, float] = field(default_factory=dict)
    capacities_J_K: dict[str, float]  # noqa: N815
    boundaries_C: dict[str, float]  # noqa: N815
    moments: tuple[StartMoment, ...]
    path: StartPath

    @property
    def lost_clearance(self) -> Notes:
        """A note where the radial clearance is lost on the way, or can be over the inputs."""
        play, low = self.radial_um, self.ranges.get("radial_um", (0.0,))[0]
        if play.least.value < 0.0:
            when = "" if play.time_s is None else f" after {play.time_s:.3g} s"
            return (Note("clearance", f"start: the radial clearance falls to {play.least.value:.0f} µm{when}"),)
        sentence = f"start: over its inputs the radial clearance can fall to {low:.0f} µm; widen it or warm up slowly"
        return (Note("clearance", sentence),) if low < 0.0 else ()

    def seizure_notes(self, part: str) -> Notes:
        """A note where a ``part`` of a machine with a steady state seizes over the inputs."""
        if self.status != "steady" or self.share_of_seizure == 0.0:
            return ()
        share = f"{100.0 * self.share_of_seizure:.0f} % of the input sets ({', '.join(self.inputs)})"
        return (Note("undecided", f"start: {part} seizes in {share}"),)

    @property
    def figures(self) -> dict[str, Quantity]:
        """Figures that a study or a sweep may name, by ``START_FIGURES`` and ``BALL_START_FIGURES``."""
        names = {key: figure.place.removesuffix(".least") for key, figure in START_FIGURES.items()} | BALL_START_FIGURES
        parts = {key: getattr(self, name, None) for key, name in names.items()}
        found = {key: getattr(part, "least", getattr(part, "greatest", part)) for key, part in parts.items()}
        return {key: part for key, part in found.items() if isinstance(part, Quantity)} | self.quantities


class Film(Record):
    """Oil film of a contact at its load, heating at its inlet included; ``lambda_ratio`` of the central film."""

    central_film_um: float
    minimum_film_um: float
    lambda_ratio: float


class RollerContact(Record):
    """Contact of the most loaded roller with a race, and its film where the races roll."""

    max_pressure_MPa: float  # noqa: N815
    half_width_um: float
    film: Film | None = spread(default=None)


class PowerBalance(Record):
    """Relative gap between power supplied and lost."""

    relative_gap: float


class LargestLoads(Record):
    """Largest contact loads of a run."""

    max_inner_N: float  # noqa: N815
    max_outer_N: float  # noqa: N815
    max_land_N: float  # noqa: N815


class FrictionCheck(Record):
    """A power loss against SKF's model, and the heat of ISO 15312 at its reference speed.

    ``ratio``: over SKF's power, None where that is zero or starvation removes the rolling friction.
    """

    skf_power_W: float  # noqa: N815
    skf_rolling_moment_N_mm: float  # noqa: N815
    skf_sliding_moment_N_mm: float  # noqa: N815
    iso_15312_heat_W: float  # noqa: N815
    ratio: float | None
    skf_starvation_factor: float = 1.0


class TargetRun(Record):
    """Run to a target accuracy: its errors by figure, None where unknown, the choice that it made, and its cost."""

    asked: float
    met: bool
    relative_error: dict[str, float | None]
    rtol: float = keyed("chosen", "rtol")
    turns: float = keyed("chosen", "turns")
    replicates: int = keyed("chosen", "replicates")
    runs: int
    rhs_evaluations: int = keyed("cost", "rhs_evaluations")
    pilot_rhs_evaluations: int = keyed("cost", "pilot_rhs_evaluations")


class FigureOf:
    """A figure that every result has, as an attribute of its key."""

    def __set_name__(self, owner: type, key: str) -> None:
        self.key = key

    def __get__(self, result: Any, owner: type) -> Quantity:
        figure: Quantity = result.figures[self.key]
        return figure


class SimulationResult(Brief, SavedRecord):
    """Outcome of one scene. Its figures have the names of the keys of its JSON form, units included.

    - ``scene``: the resolved input
    - ``figures``: those of the whole bearing by key (``rbdyn.dynamics.figures``), which are attributes too
    - ``power_terms_W``: parts of the power loss; ``rolling_resistance_W``: the part of that name by race, "outer" and "inner"
    - ``power_balance``: how it closes; ``loads``: largest contact loads
    - ``races``: contacts at the largest load of "inner" and "outer"
    - ``clearance_um``: drawn and operating diametral clearance [um], with the changes by fits, temperature and rotation where a
      mounting is given. "radial", "guide" and "pocket" have the drawn, fit, temperature, rotation and operating share of each
    - ``friction_check``: SKF's friction; None where the scene states no designation
    - ``transient_turns``: shaft turns from the start until the figures settled, None where the run does not show it
    - ``counted_turns``: turns counted of each replicate, more than asked for where it was lengthened
    - ``target``: choice, errors and cost of a run to a target accuracy, None for any other
    - ``temperatures_C``: of "oil", "outer" ring, "inner" ring and "rollers"; None without a heat balance
    - ``thermal``: the heat balance (``HeatBalance``), None without [thermal]. ``status`` is "ok" or that of the balance
    - ``damage``: figures of wear and impacts by key, None in results of older versions
    - ``pocket_impacts``: impacts of each pocket in turn, by the keys of their figures; None where they are not followed
    - ``verdict``: class of the cage by its orbit, None where the scene leaves it out
    - ``part_figures``: power terms, operating clearances, contact pressures and films, life and stiffness by name, each with its
      errors (``rbdyn.dynamics.figures``)
    - ``stiffness_N_um``: "xx" along the load, "yy" across it, of the static loads by ISO/TS 16281; None where no roller carries load
    - ``start``: start of the cold machine (``StartResult``), None without [thermal.start]
    """

    FORMAT = "rbdyn.simulation/5"
    WHAT = "simulation result"
    figures: dict[str, Quantity] = spread()
    power_balance: PowerBalance
    loads: LargestLoads
    notes: Notes
    power_terms_W: dict[str, float]  # noqa: N815
    rolling_resistance_W: dict[str, float]  # noqa: N815
    clearance_um: dict[str, Any]
    friction_check: FrictionCheck | None
    status: str
    races: dict[str, RollerContact]
    impact_window_turns: float
    transient_turns: float | None
    counted_turns: float
    target: TargetRun | None
    cost: dict[str, float]
    replicates: int
    seed: int
    versions: dict[str, str]
    scene: dict[str, Any]
    temperatures_C: dict[str, Quantity] | None = None  # noqa: N815
    thermal: HeatBalance | None = None
    part_figures: dict[str, Quantity] | None = None
    damage: dict[str, Quantity] | None = None
    pocket_impacts: dict[str, list[float]] | None = None
    verdict: CageVerdict | None = nullable(default=None)
    stiffness_N_um: dict[str, float] | None = derived(lambda self: self._stiffness())  # noqa: N815
    start: StartResult | None = None

    impact_force_N, impact_contact_force_N = FigureOf(), FigureOf()  # noqa: N815
    power_loss_W, cage_speed_rpm, cage_slip = FigureOf(), FigureOf(), FigureOf()  # noqa: N815
    whirl_deviation_ratio = FigureOf()

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``as_dict``. Raises KeyError or TypeError for anything else, also without a figure of every bearing."""
        result = super().from_dict(data)
        for name, figure in vars(SimulationResult).items():
            if isinstance(figure, FigureOf) and name not in result.figures:
                raise KeyError(name)
        return result

    def _stiffness(self) -> dict[str, float] | None:
        parts = self.part_figures or {}
        keys = {axis: f"stiffness_{axis}_N_um" for axis in ("xx", "yy")}
        return {axis: parts[key].value for axis, key in keys.items()} if keys["xx"] in parts else None

    @property
    def cage_orbit_radius_share(self) -> Quantity | None:
        """Radius of the cage's orbit over its radial clearance; None where nothing guides the cage."""
        return self.figures.get("cage_orbit_radius_share")

    @property
    def responses(self) -> dict[str, Quantity]:
        """All figures with errors that a study may name: those of the whole bearing, of its parts and of its start."""
        return self.quantities | (self.part_figures or {}) | ({} if self.start is None else self.start.figures)

    @property
    def jitters(self) -> bool:
        """Whether the cage only jitters, so that the whirl deviation ratio shows no whirl."""
        return self.cage_orbit_radius_share is not None and self.cage_orbit_radius_share.value < JITTER

    @property
    def quantities(self) -> dict[str, Quantity]:
        """Figures and damage with errors, by their key, which names the unit; temperatures of a heat balance by ``TEMPERATURES``."""
        nodes = self.temperatures_C
        temperatures = {} if nodes is None else {name: nodes[node] for name, node in TEMPERATURES.items()}
        return self.figures | (self.damage or {}) | temperatures

    def brief(self) -> tuple[str, list[Figure]]:
        """Status, replicates, seed and notes; the figures."""
        figures = [
            Figure(words, figure.value, figure.stated_error, unit)
            for key, figure in self.quantities.items()
            for words, unit in (quantity(key),)
        ]
        return (
            f"{self.status}, {counted(self.replicates, 'replicate')}, seed {self.seed}, {counted(len(self.notes), 'note')}",
            figures,
        )

    def table(self) -> "pd.DataFrame":
        """A row a figure: value, the half-widths of its 95 % errors, effective samples; units in the names."""
        return figure_sheet(self.quantities).frame.set_index("figure").astype(float)
