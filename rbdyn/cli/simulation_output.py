"""What ``rbdyn simulate`` prints and writes of a roller bearing, and of the points of a duty, also on a map of ``rbdyn map``.

A duty is shown by its points with speed and load, and the life there and over the duty.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rbdyn.base.blocks import Block, Column, Detail, Paragraph, Remarks, Sheet, Table, Verdict, with_notes
from rbdyn.base.faults import RPM, key_path
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, finite, save_table
from rbdyn.base.words import counted, error_alone, label, quantity, range_ends, shown, value_alone, with_error
from rbdyn.clearances import DIFFERENCE, REPORTED, other_ranges
from rbdyn.dynamics.figures import BEARING, DAMAGE, of_kind, repeated
from rbdyn.life import DutyLifeFigures, PointLife, life_notes, life_sheet
from rbdyn.properties.rexs import Attributes, write_rexs
from rbdyn.result import (
    FrictionCheck,
    GreatestValue,
    LeastClearance,
    Quantity,
    RollerContact,
    SimulationResult,
    StartResult,
    TargetRun,
    cage_column,
    figure_sheet,
    start_sheet,
)
from rbdyn.scene import Scene
from rbdyn.scene.duty import AXES, DutyPoint, duty_scenes, read_duty, shares_of_time
from rbdyn.scene.notes import catalogue_entry

if TYPE_CHECKING:
    from rbdyn.dynamics.duty_simulation import DutySimulation, SimulatedPoint, Worst


# Length of the history that --out draws.
TRACE_TURNS = 10.0
# Nodes of a heat balance by their names in REXS.
REXS_NODES = {
    "temperature_lubricant": "oil",
    "mean_operating_temperature_inner_ring": "inner",
    "mean_operating_temperature_outer_ring": "outer",
}


def blocks(result: SimulationResult, folder: Path | None = None) -> list[Block]:
    """The verdict, figures with their errors, the target, loads and balance, races, clearances, life, friction, losses, notes, inputs, cost.

    ``folder``: where the result is saved, for what to do next.
    """
    from rbdyn.compiled.kernel import compiler_notes

    figures = _figures(result)
    costs = [(label(key), shown(float(value))) for key, value in result.cost.items()]
    samples = [(words, f"{figure.effective_samples:.0f}") for words, figure in figures.items()]
    return [
        Verdict(result.notes),
        *([] if result.verdict is None else [Paragraph(result.verdict.words)]),
        figure_sheet(figures).block,
        *([] if result.target is None else [Paragraph(_target_sentence(result.target))]),
        Paragraph(_run_sentence(result)),
        *_temperatures(result),
        *start_blocks(result.start),
        *(Paragraph(_race_sentence(race, contact)) for race, contact in result.races.items()),
        *_clearances(result),
        Paragraph(_life_sentence(result)),
        Paragraph(_stiffness_sentence(result)),
        *([] if result.friction_check is None else [Paragraph(_friction_sentence(result.friction_check))]),
        *_losses(result),
        Remarks((*result.notes, *compiler_notes())),
        _inputs(result),
        Table("Effective samples", ("figure", "samples"), samples, detail=Detail.ALL),
        Table("Cost", ("", ""), costs, detail=Detail.ALL),
        Paragraph("" if folder is None else f"next: rbdyn show {folder} --animate"),
    ]


def write(scene: Scene, result: SimulationResult, folder: Path) -> None:
    """Write result.json, figures.csv, history.csv, bearing.rexs and pictures, of a start too."""
    from rbdyn import plots
    from rbdyn.dynamics.motion import history, most_turns

    result.save(folder / "result.json")
    figure_sheet(result.quantities).save(folder, "%.8g")
    turns = min(TRACE_TURNS, scene.numerics.turns, most_turns(scene))
    motion = history(scene, turns, notice=None)
    save_table(motion.table(), folder / "history.csv", "%.6g")
    title = f"first {turns:g} counted shaft turns"
    plots.roller_loads(motion, folder / "roller_loads.png")
    classes = {} if result.verdict is None else {title: result.verdict.name}
    plots.cage_orbit({title: motion}, folder / "cage_orbit.png", classes)
    plots.pocket_forces({title: motion}, folder / "pocket_forces.png")
    _write_rexs(scene, result, folder)
    if result.stiffness_N_um is not None:
        plots.stiffness_over_clearance(scene, folder / "stiffness.png")
    if result.start is not None:
        start_sheet(result.start).save(folder)
        plots.start(result.start, folder / "start.png")


def _write_rexs(scene: Scene, result: SimulationResult, folder: Path) -> None:
    """Write what REXS has a name for: the bearing, its operating point, speeds, loss, clearances and pressures."""
    bearing, operation, clearance = scene.bearing, scene.operation, result.clearance_um
    speed_rpm = operation.inner_speed_rpm - operation.outer_speed_rpm
    torque = result.power_loss_W.value / abs(speed_rpm * RPM) if speed_rpm else None
    temperatures, stiffness = result.temperatures_C or {}, result.stiffness_N_um or {}
    # A race without a load has none.
    pressures = {race: contact.max_pressure_MPa for race, contact in result.races.items()}
    listed = catalogue_entry(bearing)
    sizes = listed[1] if listed else None
    nodes = {key: temperatures[node].value if node in temperatures else None for key, node in REXS_NODES.items()}
    oil = nodes.pop("temperature_lubricant") or scene.lubricant.temperature_C
    attributes: Attributes = {
        "bearing_type": ("none", "radial_roller_bearing"),
        "catalogue_designation": ("none", bearing.designation),
        "inner_diameter": ("mm", sizes and sizes.bore),
        "outer_diameter": ("mm", sizes and sizes.outside),
        "width": ("mm", sizes and sizes.width),
        "radial_bearing_clearance": ("mum", clearance["drawn"]),
        "operating_radial_bearing_clearance": ("mum", clearance["operating"]),
        "speed_inner_ring": ("1 / min", operation.inner_speed_rpm),
        "speed_outer_ring": ("1 / min", operation.outer_speed_rpm),
        "speed_rolling_element_set": ("1 / min", result.cage_speed_rpm.value),
        "force_acting_on_inner_component_v": ("N", operation.radial_load_N),
        "temperature_lubricant": ("C", oil),
        **{key: ("C", value) for key, value in nodes.items()},
        "total_frictional_power_loss": ("W", result.power_loss_W.value),
        "total_frictional_torque": ("N m", torque),
        "maximum_hertzian_pressure_inner_ring": ("MPa", pressures.get("inner")),
        "maximum_hertzian_pressure_outer_ring": ("MPa", pressures.get("outer")),
        "operating_point_stiffness_f_v_d_v": ("N / m", 1e6 * stiffness["xx"] if stiffness else None),
        "operating_point_stiffness_f_w_d_w": ("N / m", 1e6 * stiffness["yy"] if stiffness else None),
    }
    row: Attributes = {
        "number_of_rolling_elements": ("none", bearing.rollers),
        "reference_diameter_rolling_bearing": ("mm", bearing.pitch_diameter_mm),
        "pressure_angle": ("deg", 0.0),
    }
    element: Attributes = {
        "diameter_of_rolling_element": ("mm", bearing.roller_diameter_mm),
        "length_of_rolling_element": ("mm", bearing.roller_length_mm),
    }
    lubricant: Attributes = {"name": ("none", scene.lubricant.oil)}
    name = bearing.designation or "cylindrical roller bearing"
    write_rexs(folder / "bearing.rexs", name, attributes, row, element, lubricant)


def _figures(result: SimulationResult) -> "dict[str, Quantity]":
    """Figures of a run by their words."""
    window, repeats = counted(result.impact_window_turns, "shaft turn"), repeated(result.figures)
    found = result.quantities
    return {
        figure.words.format(window=window) or label(figure.key): found[figure.key]
        for figure in (*BEARING, *DAMAGE)
        if figure.key in found and figure.key not in repeats
    }


def _error(error: float | None) -> str:
    return "not estimated" if error is None else error_alone(error)


def _run_sentence(result: SimulationResult) -> str:
    return (
        f"raceway loads up to {result.loads.max_inner_N:.0f} N (inner), {result.loads.max_outer_N:.0f} N (outer); power "
        f"balance closes to {100.0 * result.power_balance.relative_gap:.2g} %; {counted(result.replicates, 'replicate')}, seed "
        f"{result.seed}; {result.cost['wall_s']:.2f} s, {result.cost['compile_s']:.1f} s to "
        "load or compile"
    )


def _race_sentence(race: str, contact: RollerContact) -> str:
    film = contact.film
    oil = "" if film is None else f", film {film.central_film_um:.2g} µm, lambda {film.lambda_ratio:.2g}"
    return (
        f"{race} raceway at its largest load: {contact.max_pressure_MPa:.0f} MPa over {contact.half_width_um:.0f} "
        f"µm each way{oil}"
    )


# Nodes of the heat balance in words.
NODE_NAMES = {
    "oil": "oil",
    "outer": "outer ring and housing",
    "inner": "inner ring and shaft",
    "rollers": "rollers and cage",
}


def _temperatures(result: SimulationResult) -> list[Block]:
    """Temperatures with what the inputs of the balance leave open first, and the heat of each node; nothing without a balance."""
    balance, figures = result.thermal, result.temperatures_C
    if balance is None or figures is None:
        return []
    ranges = balance.ranges.figures or {}

    def value(row: tuple[str, Quantity]) -> str:
        # Where the inputs leave kelvins open, hundredths say nothing.
        node, figure = row
        return value_alone(figure.value, 0.5 * (ranges[node][-1] - ranges[node][0])) if ranges else figure.value_text

    columns: tuple[Column[tuple[str, Quantity]], ...] = (
        Column("", words="temperature [°C]", cell=lambda row: NODE_NAMES[row[0]]),
        Column("value", cell=value),
        Column("", words="inputs (90 %)", cell=lambda row: range_ends(ranges[row[0]]) if ranges else ""),
        Column("", error_alone, "statistical (95 %)", at=(1, "statistical_error")),
        Column("", error_alone, "numerical (95 %)", at=(1, "numerical_error")),
        Column("", words="heat [W]", cell=lambda row: f"{balance.heat_W[row[0]]:.3g}"),
    )
    ways = ", ".join(f"{way} {power:.3g} W" for way, power in balance.carried_off_W.items() if power)
    state = "steady state" if balance.status == "steady" else balance.status
    inputs = ", ".join(balance.ranges.inputs or ())
    return [
        Sheet("", columns, list(figures.items())).block,
        Paragraph(f"{state}; thermal loop gain {balance.gain:+.2f}; removed: {ways}"),
        *([Paragraph(other_ranges(ranges))] if ranges else []),
        *([Paragraph(f"inputs that vary: {inputs}", detail=Detail.ALL)] if inputs else []),
    ]


def start_blocks(start: StartResult | None) -> list[Block]:
    """Least clearances of a start with what the inputs leave open first, and how it goes; nothing without a start."""
    if start is None:
        return []
    names = {clearance.words: f"{clearance.name}_um" for clearance in REPORTED}
    names |= {"largest axial load [N]": "axial_load_N", "largest contact pressure [MPa]": "contact_pressure_MPa"}
    found = ((words, name, getattr(start, name)) for words, name in names.items())
    rows = [_start_row(start, words, name, extreme) for words, name, extreme in found if extreme is not None]
    header = ("start: least clearance [µm]", "value", "inputs (90 %)", "error (95 %)", "after [s] (inputs)")
    heat = "SKF's friction model at each moment"
    if start.moments:
        heat = f"{counted(len(start.moments) - 1, 'short simulation')} and the steady state"
    inputs = f"start: heat by {heat}; inputs that vary: {', '.join(start.inputs)}"
    return [Table("", header, rows), Paragraph(_start_sentence(start)), Paragraph(inputs, detail=Detail.ALL)]


def _start_row(start: StartResult, words: str, name: str, found: LeastClearance | GreatestValue) -> tuple[str, ...]:
    """A figure of a start with its range and error, and when."""
    # A load has no range where no input set has an equilibrium at its largest one.
    spread, extreme = start.ranges.get(name), found.least if isinstance(found, LeastClearance) else found.greatest
    digits = 0.5 * (spread[-1] - spread[0] if spread else 0.0) or extreme.stated_error
    value, ends = value_alone(extreme.value, digits), range_ends(spread) if spread else ""
    return words, value, ends, _error(extreme.stated_error), _when(start, name, extreme, found.time_s)


def _when(start: StartResult, name: str, extreme: Quantity, time: float | None) -> str:
    """When a figure is extreme; times over the inputs, where these have any, and the share of these that have a minimum."""
    if time is None:
        first, last = (abs(start.path.figures[name][place] - extreme.value) for place in (0, -1))
        return "at the start" if first <= last else "at the end"
    times, share = start.ranges.get(f"{name}_time_s"), start.share_with_minimum.get(name)
    few = "" if share in (None, 1.0) else f"; a minimum in {100.0 * share:.0f} % of the input sets"
    return f"{shown(time, 3)} ({range_ends(times)}{few})" if times else shown(time, 3)


def _start_sentence(start: StartResult) -> str:
    """How a start goes, in a line."""
    lead, spread = start.temperature_difference_K, start.ranges[DIFFERENCE]
    steady = start.reason or start.status
    if start.time_to_steady_s is not None and start.reason is None:
        times = start.ranges.get("time_to_steady_s")
        steady = f"steady after {shown(start.time_to_steady_s, 3)} s{f' ({range_ends(times)})' if times else ''}"
    lost = start.radial_um.least.value <= 0.0 and start.race_pressure_MPa is not None
    pressure = f"; raceways reach {start.race_pressure_MPa:.0f} MPa without clearance" if lost else ""
    return (
        f"start: inner ring up to {lead.text} K ({range_ends(spread)}) warmer than the outer ring; {steady}{pressure}"
    )


def _clearances(result: SimulationResult) -> list[Block]:
    """Each clearance from the drawing to operation, in a line; without a mounting only in a report."""
    changes = result.clearance_um
    # The radial one has its own parts.
    plays = {clearance.words: changes.get(clearance.name) for clearance in REPORTED} | {REPORTED[0].words: changes}
    sentences = []
    for name, play in plays.items():
        parts = [
            f"{part.replace('_', ' ')} {value:+z.1f} µm"
            for part, value in (play or {}).items()
            if isinstance(value, float) and (value or part in ("drawn", "operating"))
        ]
        if parts:
            sentences.append(f"{name}: {', '.join(parts)}")
    detail = Detail.LEAST if result.scene.get("mounting") else Detail.ALL
    return [Paragraph(sentence, detail=detail) for sentence in sentences]


# Laminae of the reference profile; 31 and 101 give one life within 1 %.
PROFILE_SLICES = 31


def _life_sentence(result: SimulationResult) -> str:
    """Reference life by static loads; empty where it has no end, or the bearing had no steady temperatures."""
    from rbdyn.dynamics.part_figures import static_life
    from rbdyn.scene.thermal import simulated_scene

    if result.status != "ok":
        return ""
    scene = simulated_scene(result)
    life = static_life(scene).figures(*scene.operation.speeds)
    if life.L10_h is None:
        return ""
    sentence = (
        f"life L10r: {shown(life.L10_h, 2)} h, {shown(life.L10_Mrev, 2)} million turns ({life.method}, static loads)"
    )
    if scene.bearing.roller_profile != "cylinder":
        return sentence
    # Plain cylinders have no edge stress here, though the capacity of the standard's laminae leaves room for it.
    reference = scene.changed({"bearing.roller_profile": "logarithmic", "model.slices": PROFILE_SLICES})
    profiled = static_life(reference).figures(*scene.operation.speeds)
    return f"{sentence}; {shown(profiled.L10_h, 2)} h with the standard's profile and edge stress, which plain cylinders leave out"


def _stiffness_sentence(result: SimulationResult) -> str:
    """Stiffness by static loads in a line; empty where no roller carries load, or the bearing had no steady temperatures."""
    if result.status != "ok" or result.stiffness_N_um is None:
        return ""
    parts = result.part_figures or {}
    along, across, travel = (
        with_error(figure.value, figure.stated_error) if figure.stated_error else shown(figure.value, 3)
        for figure in (parts[figure.key] for figure in of_kind("stiffness"))
    )
    return (
        f"stiffness: {along} N/µm along the load, {across} N/µm across it; the shaft's centre moves by {travel} µm while the "
        "rollers pass a pitch (ISO/TS 16281, static loads)"
    )


# Tables of a scene that a drawing, a machine and its oil give.
INPUTS = ("bearing", "cage", "operation", "mounting", "lubricant", "thermal", "materials")


def _inputs(result: SimulationResult) -> Table:
    """What the scene states of bearing, machine and oil; zeros and what is left out are not listed."""
    rows = [
        (f"{table}: {label(key)}", shown(value, 5))
        for table in INPUTS
        for key, value in (result.scene.get(table) or {}).items()
        if value not in (None, 0.0, [], {}) and not isinstance(value, dict | list)
    ]
    return Table("Inputs", ("key", "value"), rows, text_columns=(1,), detail=Detail.ALL)


def _friction_sentence(check: FrictionCheck) -> str:
    """The maker's friction in a line."""
    none = "no ratio, because the oil starves it" if check.skf_power_W else "no ratio at zero load or speed"
    share = none if check.ratio is None else f"power loss is {check.ratio:.2f} of SKF's"
    moments = (
        f"rolling {shown(check.skf_rolling_moment_N_mm, 3)}, sliding {shown(check.skf_sliding_moment_N_mm, 3)} N mm"
    )
    heat = f"heat at the reference speed by ISO 15312 {shown(check.iso_15312_heat_W, 3)} W"
    return f"friction by SKF's model {shown(check.skf_power_W, 3)} W ({moments}): {share}; {heat}"


def _losses(result: SimulationResult) -> list[Block]:
    """Full detail: the transient, and the losses by size with their sum."""
    parts = result.part_figures or {}
    errors = {power.source[0]: parts[power.key].stated_error for power in of_kind("power") if power.key in parts}
    terms = sorted(((power, term) for term, power in result.power_terms_W.items() if power), reverse=True)
    total = sum(power for power, _ in terms) or 1.0
    losses = [
        (term.replace("_", " "), with_error(power, errors.get(term)), f"{100.0 * power / total:.2g} %")
        for power, term in terms
    ]
    losses.append(("all", result.power_loss_W.text, "100 %"))
    losses += [
        (f"rolling resistance, {race} raceway alone", shown(power, 3), f"{100.0 * power / total:.2g} %")
        for race, power in result.rolling_resistance_W.items()
    ]
    gap = result.power_balance.relative_gap * result.power_loss_W.value
    turns = result.transient_turns
    return [
        Paragraph("" if turns is None else f"transient: {counted(turns, 'shaft turn')}", detail=Detail.ALL),
        Table(f"Power lost; the balance closes to {gap:.2g} W", ("term", "W", "share"), losses, detail=Detail.ALL),
    ]


def _target_sentence(target: TargetRun) -> str:
    errors = target.relative_error.items()
    reached = ", ".join(f"{label(name)} {'unknown' if e is None else f'{100.0 * e:.2g} %'}" for name, e in errors)
    return (
        f"target {100.0 * target.asked:g} % {'met' if target.met else 'not met'} ({reached}) by "
        f"{counted(target.replicates, 'replicate')} of {counted(target.turns, 'turn')} at rtol "
        f"{target.rtol:g}; {target.rhs_evaluations / 1e6:.1f} million right-hand sides, "
        f"{target.pilot_rhs_evaluations / 1e6:.1f} of them for pilots; the seconds include pilots and all runs"
    )


# Figures of a point on the screen by the heading of their column, and their factor; all of them stand in points.csv.
SHOWN = {figure.panel[1]: (figure.key, figure.percent) for figure in BEARING if figure.panel}
CLEARANCE_COLUMNS = {figure.source[0]: (figure.key, 1.0) for figure in of_kind("clearance")}


class MapDuty(Record):
    """Points of a duty, the life over it, and notes on what a map does not show of it."""

    points: tuple[PointLife, ...]
    life: DutyLifeFigures
    notes: Notes

    @property
    def marks(self) -> dict[str, tuple[float, float]]:
        """Speed [rpm] and load [N] by the name of the point."""
        return {point.name: (point.inner_speed_rpm, point.radial_load_N) for point in self.points}

    @property
    def blocks(self) -> list[Block]:
        """The points with their lives, and the life over the duty."""
        return duty_blocks(self.points, self.life)


def duty_blocks(points: "Sequence[PointLife | SimulatedPoint]", life: DutyLifeFigures | None) -> list[Block]:
    """Table of points with name, share, speed, load, life and share of the damage, and the life over the duty."""
    return [life_sheet(points).block, Paragraph(life_sentence(life))]


def life_sentence(life: DutyLifeFigures | None) -> str:
    """Life over a duty in words; empty where it has no end."""
    if life is None or life.L10_h is None:
        return ""
    return (
        f"Life over the duty, L10r: {shown(life.L10_h, 3)} h (ISO/TS 16281 static loads, Palmgren and Miner); equivalent load "
        f"{shown(life.equivalent_load_N, 4)} N."
    )


def map_duty(scene: Scene, path: Path, speeds_rpm: Sequence[float], loads_N: Sequence[float]) -> MapDuty:  # noqa: N803
    """The duty of a file on a map of these speeds and loads, with [thermal] at the steady temperatures of each point.

    Raises InputError with all faults at once, RunError for a point without steady temperatures.
    """
    from rbdyn.dynamics.part_figures import roller_duty_life
    from rbdyn.dynamics.simulate import steady_scene

    stated = read_duty(path)
    scenes = [steady_scene(hot) for hot in duty_scenes(scene, stated, str(path))]
    shares = shares_of_time(stated)
    life = roller_duty_life(scenes, shares)
    points = tuple(
        PointLife(point.name, share, *_place(scene), finite(hours), damage)
        for point, share, scene, hours, damage in zip(
            stated, shares, scenes, life.point_hours, life.damage, strict=True
        )
    )
    notes = (
        *life_notes(life.hours, sum(point.share for point in stated)),
        *_notes(stated, scenes, speeds_rpm, loads_N),
    )
    return MapDuty(points, life.figures, notes)


def _notes(
    points: Sequence[DutyPoint], scenes: Sequence[Scene], speeds: Sequence[float], loads: Sequence[float]
) -> Iterator[Note]:
    """Notes on points off the map, and on keys that the map keeps at the values of the scene."""
    for point, scene in zip(points, scenes, strict=True):
        speed, load = _place(scene)
        if not (speeds[0] <= speed <= speeds[-1] and loads[0] <= load <= loads[-1]):
            sentence = (
                f"duty {point.name!r}: {speed:g} rpm and {load:g} N are off the map, so its mark is at the edge; widen --speed "
                "or --load"
            )
            yield Note("off-map", sentence)
        others = [".".join(path) for text in point.set if (path := key_path(text)) and ".".join(path) not in AXES]
        if others:
            sentence = f"duty {point.name!r}: sets {', '.join(others)} too, which the map keeps at the scene's values"
            yield Note("off-map", sentence)


def _place(scene: Scene) -> tuple[float, float]:
    return scene.operation.inner_speed_rpm, scene.operation.radial_load_N


def simulated_blocks(found: "DutySimulation") -> list[Block]:
    """The verdict, the worst points in words, figures and clearances in operation at each point, lives, notes."""
    names = [name for name, _ in (*SHOWN.values(), *CLEARANCE_COLUMNS.values()) if name in found.worst]
    lifeless = [point.name for point in found.points if point.L10_h is None and point.status != "ok"]
    blocks = [
        Paragraph(f"Worst: {', '.join(_worst(name, found.worst[name]) for name in names)}." if names else ""),
        _point_table("Figures", found, SHOWN, cage_column()),
        _point_table("Clearances in operation [µm]", found, CLEARANCE_COLUMNS),
        Sheet("On the way to the points", STARTS, [point for point in found.points if point.start]).block,
        *duty_blocks(found.points, found.life),
        Paragraph("" if found.life else f"Life over the duty: unknown, because {', '.join(lifeless)} has none."),
    ]
    return with_notes(found.notes, blocks)


def _point_table(
    caption: str, found: "DutySimulation", figures: Mapping[str, tuple[str, float]], *further: "Column[SimulatedPoint]"
) -> Table:
    """A row a point that has figures; ``figures``: name and factor by heading."""

    def column(heading: str, name: str, factor: float) -> "Column[SimulatedPoint]":
        return Column(name, words=heading, cell=lambda point: _with_error(point.figures.get(name), factor))

    point_name: Column[SimulatedPoint] = Column("name", words="point", cell=_marked)
    columns = [point_name, *(column(heading, *figure) for heading, figure in figures.items()), *further]
    return Sheet(caption, columns, [point for point in found.points if point.figures]).block.without_empty_columns()


# How the machine comes to a point of a duty.
STARTS: "tuple[Column[SimulatedPoint], ...]" = (
    Column("name", words="point"),
    Column("from", at=("start", "origin"), text=True),
    Column("", words="least radial clearance [µm]", at=("start", "radial_um", "least", "text")),
    Column("", 3, "after [s]", at=("start", "radial_um", "time_s"), missing="at an end"),
    Column("", words="inner less outer ring [K]", at=("start", "temperature_difference_K", "text")),
    Column("then", at=("start", "status"), text=True),
)


def _marked(point: "SimulatedPoint") -> str:
    return point.name if point.status == "ok" else f"{point.name} (failed)"


def _with_error(figure: "Quantity | None", factor: float) -> str:
    """A figure with the error to print next to it; a clearance, which is exact, to a tenth of a micrometre."""
    if figure is None:
        return ""
    if figure.error == 0.0:
        return f"{factor * figure.value:.1f}"
    error = figure.stated_error
    return with_error(factor * figure.value, None if error is None else factor * error)


def _worst(name: str, worst: "Worst") -> str:
    doubt = f" (not told apart from {', '.join(worst.not_told_apart)})" if worst.not_told_apart else ""
    return f"{quantity(name)[0].replace(' operating', '')} at {worst.point}{doubt}"


def write_simulated(found: "DutySimulation", folder: Path) -> None:
    """Write duty.json and points.csv."""
    found.save(folder / "duty.json")
    found.sheet.save(folder, "%.8g")
