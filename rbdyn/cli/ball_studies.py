"""What ``rbdyn ball`` prints and writes: equilibria, sweeps over keys, runout, preload, clearance, wear, race limits."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

from rbdyn.base.blocks import Block, Column, Detail, Heading, Paragraph, Sheet, Table, with_notes
from rbdyn.base.command import Console, Delivery, checkpoint_message
from rbdyn.base.faults import InputError, MethodError, axis_values
from rbdyn.base.files import write_json
from rbdyn.base.identity import identity_of
from rbdyn.base.notes import Notes, status_notes
from rbdyn.base.records import Record, outside_json, save_table
from rbdyn.base.words import counted, label, range_ends, shown, with_error
from rbdyn.clearances import other_ranges
from rbdyn.quasistatic.preload import Point, Scan, over_clearance, over_preload, over_wear
from rbdyn.quasistatic.result import (
    BallContact,
    BallResult,
    DoubleDeckerReport,
    Remark,
    RingLoad,
    RowReport,
    Stiffness,
    ball_sheet,
    remarks,
    ring_figures,
    row_figures,
    tipping,
)
from rbdyn.quasistatic.runout import lots
from rbdyn.quasistatic.runout.lots import RaceLimits, single_row
from rbdyn.quasistatic.runout.turn import Runout, ToleranceClass, running_accuracy
from rbdyn.quasistatic.sweep import PointRecord, SweepResult, keys_of_texts, result_of, sweep
from rbdyn.result import BallHeatBalance, start_sheet
from rbdyn.scene import BallScene
from rbdyn.scene.ball import SingleRowScene
from rbdyn.scene.fits import Fits

if TYPE_CHECKING:
    import pandas as pd

# Points of a long table in the output from its start, and from its end.
SHOWN = 8
# Header and columns of the table: the larger of two columns; of a double-decker, those of both rows.
HEADER = {
    "x [µm]": ("x_mm",),
    "axial, z [µm]": ("z_mm",),
    "inner angle": ("inner_angle_max_deg",),
    "outer angle": ("outer_angle_max_deg",),
    "largest load [N]": ("inner_load_max_N", "outer_load_max_N"),
    "pressure [MPa]": ("inner_pressure_MPa", "outer_pressure_MPa"),
    "stiffness x [N/µm]": ("stiffness_x_N_per_um",),
    "axial, z": ("stiffness_z_N_per_um",),
    "L10 [Mrev]": ("L10_Mrev",),
}


def run_sweep(console: Console, scene: BallScene, texts: Sequence[str], source: Path) -> Delivery:
    """Sweep the scene of the file ``source`` as ``--sweep`` asks for. Raises InputError."""
    keys = keys_of_texts(texts)
    console.folder.claim(source)
    kept_in = console.folder.path / "sweep.part" if console.folder.path else None
    with checkpoint_message(kept_in), console.progress("sweeping") as progress:
        result = sweep(scene, keys, progress, kept_in)
    return Delivery(
        identity_of("rbdyn ball --sweep", result.scene, [source], swept=result.keys),
        result.as_dict,
        partial(sweep_blocks, result),
        partial(write_sweep, result),
        bool(result.failures),
        lambda: _print_failures(result),
    )


def _print_failures(result: SweepResult) -> None:
    for places in result.failures.values():
        print(f"{result.where(places)}: {result.statuses[places[0]]}", file=sys.stderr)


def sweep_blocks(result: SweepResult) -> list[Block]:
    """The points, what they cost and the notes."""
    points = counted(len(result.statuses), "point")
    spent = f"{points} in {result.wall_s:.3g} s, {result.cold} of them not started from a neighbour"
    return with_notes(result.placed_notes, [points_table(result), Paragraph(spent)])


def points_table(result: SweepResult) -> Table:
    """The points, of a long sweep the first and the last ones."""
    count = len(result.statuses)
    ends = (*range(SHOWN), *range(count - SHOWN, count)) if count > 2 * SHOWN else range(count)
    rows = [_row(result, place) for place in ends]
    if len(ends) < count:
        rows.insert(SHOWN, ["..."] * len(rows[0]))
    units = [label(key.rpartition(".")[2]) for key in result.keys]
    return Table("", [*units, *HEADER], rows)


def write_sweep(result: SweepResult, folder: Path) -> None:
    """Write sweep.json, sweep.csv and pictures."""
    from rbdyn.plots.ball import sweep_pictures

    write_json(folder / "sweep.json", result.as_dict())
    result.save(folder / "sweep.csv")
    sweep_pictures(result, folder)


def _row(result: SweepResult, place: int) -> list[str]:
    keys = [f"{value:.6g}" for value in result.key_values(place).values()]
    if result.statuses[place] != "ok":
        return keys + ["failed"] * len(HEADER)
    return keys + [_cell(result, names, place) for names in HEADER.values()]


def _cell(result: SweepResult, names: Sequence[str], place: int) -> str:
    columns: dict[str, Any] = result.columns
    rows = ("",) if names[0] in columns else ("inner_row_", "outer_row_")
    values = [max(float(columns[f"{row}{name}"][place]) for name in names) for row in rows]
    unit = 1e3 if names[0].endswith("_mm") else 1.0
    return " / ".join(f"{unit * value:.4g}" for value in values)


# What a study sweeps: its function, the unit of the values and that unit in SI.
SWEPT = {
    "preload": (over_preload, "N", 1.0),
    "clearance": (over_clearance, "um", 1e-6),
    "wear": (over_wear, "um", 1e-6),
}
# Keys by which ``--sweep`` does the same.
SWEPT_KEYS = {"preload": "operation.preload_N", "clearance": "bearing.radial_clearance_mm"}
# Figures of a point in its record, by column of the table.
SWEPT_FIGURES = {f"{race}_stress_MPa": f"{race}_pressure_MPa" for race in ("inner", "outer")} | {"L10_Mrev": "L10_Mrev"}
# Bearings of a lot that are solved in full to set the limits of race errors.
SOLVED = 100


class Optimum(Record):
    """Where a study is best, and its figures there."""

    value: float
    max_stress_MPa: float  # noqa: N815
    L10_Mrev: float


class OptimumStudy(Record):
    """Peak pressure and life over preload [N], clearance or wear of the balls [um], and where each is best; also as a sweep."""

    swept: str
    points: list[dict[str, Any]]
    least_stress: Optimum
    longest_life: Optimum
    notes: Notes
    table: SweepResult = outside_json()


def optimum_study(scene: BallScene, swept: str, values: Sequence[float]) -> OptimumStudy:
    """Study of preload, clearance or wear. Raises InputError for a double-decker, or for values that cannot be swept."""
    run, unit, si = SWEPT[swept]
    try:
        scan = run(_single(scene, swept), [si * value for value in values])
    except MethodError as error:
        raise InputError(f"--{swept}: {error}") from None
    table = _table(scene, f"{swept}_{unit}", values, scan)
    names = {"value": f"{swept}_{unit}", **SWEPT_FIGURES, "status": "status"}
    points = [{name: point[column] for name, column in names.items() if column in point} for point in table.points()]
    notes = (*scan.notes, *table.placed_notes)
    return OptimumStudy(
        names["value"], points, _optimum(scan.least_stress, si), _optimum(scan.longest_life, si), notes, table
    )


def _optimum(point: Point, si: float) -> Optimum:
    return Optimum(point.value / si, 1e-6 * point.peak_pressure, point.million_turns)


def _table(scene: BallScene, key: str, values: Sequence[float], scan: Scan) -> SweepResult:
    """Figures, balls and notes of the points scanned."""
    points = []
    for point in scan.points:
        solution, rating, figures, found = point.solution, point.rating, dict[str, float](), list[Remark]()
        if solution.is_equilibrium:
            stiffness, reaction = Stiffness(solution.stiffness.tolist()), RingLoad.of(solution.reaction)
            figures = ring_figures(solution.displacement, reaction, stiffness) | row_figures(solution, rating)
            found = [*remarks(solution, rating), *tipping(solution.displacement, scene)]
        points.append(PointRecord(solution.status, figures, {"row": solution.figures}, found, (), cold=False))
    return result_of({key: tuple(values)}, points, 0.0, scene.model_dump(mode="json"))


def race_limits(scene: BallScene, tolerance_class: str, target_yield: float, seed: int = 1) -> RaceLimits:
    """Limits of roundness and side-sway of both races with which the share ``target_yield`` of bearings meets a class.

    The lot has amplitudes that fall as 1/order from order 1 to 40 (``lots.Lot``). Raises InputError.
    """
    row = _single(scene, "race-limits")
    if tolerance_class not in get_args(ToleranceClass):
        classes = ", ".join(get_args(ToleranceClass))
        raise InputError(f"--race-limits {tolerance_class}: is not a tolerance class; choose one of {classes}")
    if row.bearing.bore_mm is None:
        raise InputError("bearing.bore_mm: missing; tolerance classes go by the bore, add it")
    try:
        allowed = running_accuracy(cast(ToleranceClass, tolerance_class), 1e-3 * row.bearing.bore_mm)
        if (axial := allowed.axial) is None:
            raise MethodError(f"class {tolerance_class} sets no limit on axial runout; choose P2, P4 or P5")
        goal: dict[str, Any] = {"target_yield": target_yield, "seed": seed, "solved": SOLVED}
        limits = lots.design(lots.bench_of(row), lots.Lot(), radial_limit=allowed.radial, axial_limit=axial, **goal)
    except MethodError as error:
        raise InputError(f"--race-limits {tolerance_class}: {error}") from None
    return replace(limits, tolerance_class=tolerance_class)


def _single(scene: BallScene, option: str) -> SingleRowScene:
    if scene.thermal is not None:
        other = f"; --sweep {SWEPT_KEYS[option]} follows them" if option in SWEPT_KEYS else ""
        raise InputError(
            f"--{option}: is a study at stated temperatures; state them in [mounting], not [thermal]{other}"
        )
    try:
        return single_row(scene)
    except InputError:
        raise InputError(f"--{option}: is a study of one row of balls; a double-decker has two") from None


def run(
    console: Console, scene: BallScene, name: str, value: str, target_yield: float, seed: int, source: Path
) -> Delivery:
    """Carry out the study ``name`` over ``value``. Raises InputError."""
    console.folder.claim(source)
    study: RaceLimits | OptimumStudy
    if name == "race_limits":
        study, swept = race_limits(scene, value, target_yield, seed), {}
    else:
        study = optimum_study(scene, name, axis_values(value, f"--{name}"))
        swept = study.table.keys
    command = f"rbdyn ball --{name.replace('_', '-')}"
    identity = identity_of(command, scene.model_dump(mode="json"), [source], swept=swept)
    return Delivery(identity, study.as_dict, partial(blocks, study), partial(write_study, name, study))


def write_study(name: str, study: RaceLimits | OptimumStudy, folder: Path) -> None:
    """Write the record of a study, its points and their pictures, or the limits of race errors."""
    from rbdyn.plots.ball import sweep_pictures

    write_json(folder / f"{name}.json", study.as_dict())
    if isinstance(study, RaceLimits):
        limit_sheet(study).save(folder)
    else:
        study.table.save(folder / f"{name}.csv")
        sweep_pictures(study.table, folder)


def limit_sheet(limits: RaceLimits) -> Sheet[lots.RaceHeights]:
    """A row a race: its largest roundness and side-sway."""
    inner = lots.RaceHeights("inner", limits.inner_roundness_um, limits.inner_sway_um)
    return lots.race_sheet(inner, lots.RaceHeights("outer", limits.outer_roundness_um, limits.outer_sway_um))


def blocks(study: RaceLimits | OptimumStudy) -> list[Block]:
    """The limits of race errors; or the points of a study, where they are best, and notes."""
    if isinstance(study, RaceLimits):
        return _limits(study)
    best = [
        Paragraph(
            f"{title} at {point.value:.4g}: {point.max_stress_MPa:.0f} MPa, {shown(point.L10_Mrev, 3)} million turns"
        )
        for title, point in (("least stress", study.least_stress), ("longest life", study.longest_life))
    ]
    return with_notes(study.notes, [points_table(study.table), *best])


def _limits(limits: RaceLimits) -> list[Block]:
    runouts = f"{limits.radial_limit_um:g} µm radial, {limits.axial_limit_um:g} µm axial runout"
    good = f"{with_error(100.0 * limits.yielded, 100.0 * limits.standard_error)} % (standard error)"
    solved = f"{limits.solved} of them solved in full, seed {limits.seed}"
    return [
        replace(limit_sheet(limits).block, caption=f"class {limits.tolerance_class}: {runouts}"),
        Paragraph(f"yield {good} of {limits.bearings} bearings, {solved}"),
    ]


def equilibrium_blocks(result: BallResult) -> list[Block]:
    """Places, contacts, life and stiffness of each row, forces of the rings, balls, notes; without an equilibrium nothing but the
    temperatures of the search for steady ones."""
    if not result.is_equilibrium:
        search = [_search_table(result.thermal)] if isinstance(result.thermal, BallHeatBalance) else []
        return with_notes(status_notes(result.status), [*_start_blocks(result), *search])
    titles = {name: f"{name} row" if name else "" for name in result.row_reports}
    rows: list[Block] = []
    for name, row in result.row_reports.items():
        rows += [Heading(titles[name]), *map(Paragraph, _row_sentences(row))]
    tables = [block for name, row in result.row_reports.items() for block in _row_tables(titles[name], row)]
    sentences = []
    report = result.reached
    if isinstance(report, DoubleDeckerReport):
        sentences += _middle_ring(report)
    moment = report.reaction.moment_Nm if report.reaction else {}
    if any(moment.values()):
        sentences.append(
            "moment on the inner ring: " + ", ".join(f"about {axis} {moment[axis]:.4g} N m" for axis in "xy")
        )
    if result.fits is not None:
        sentences.append(_fits(result.fits))
    if result.temperatures_C is not None and isinstance(result.thermal, BallHeatBalance):
        sentences += _temperatures(result.temperatures_C, result.thermal)
    if result.runout is not None:
        sentences.append(_runout(result.runout))
    from rbdyn.compiled.kernel import compiler_notes

    heading = Heading("whole bearing" if sentences and any(titles.values()) else "")
    answer = [*rows, heading, *map(Paragraph, sentences), *_start_blocks(result), *tables]
    return with_notes((*(result.notes or ()), *compiler_notes()), answer)


def _start_blocks(result: BallResult) -> list[Block]:
    """The start of the cold machine, if the scene has one."""
    if result.start is None:
        return []
    from rbdyn.cli.simulation_output import start_blocks

    return start_blocks(result.start)


def with_runout(scene: BallScene, result: BallResult) -> "tuple[BallResult, pd.DataFrame | None]":
    """The result with the runout of its ring, and the path of that, where the scene has form errors."""
    if scene.errors is None or not result.is_equilibrium:
        return result, None
    ring = lots.follow_ring(scene)
    return replace(result, runout=ring.runout(lots.bench_of(scene).face_radius)), ring.table()


def write_equilibrium(result: BallResult, path: "pd.DataFrame | None", folder: Path) -> None:
    """Write result.json, balls.csv, pictures and the ``path`` of a turning ring."""
    result.save(folder / "result.json")
    if result.start is not None:
        from rbdyn.plots.start import start

        start_sheet(result.start).save(folder)
        start(result.start, folder / "start.png")
    if result.is_equilibrium:
        from rbdyn.plots.ball import pictures

        ball_sheet(result.row_reports).save(folder, "%.8g")
        pictures(result, folder)
    if path is not None:
        save_table(path, folder / "runout.csv", "%.8g")


def _row_tables(title: str, row: RowReport) -> list[Block]:
    """The balls; in full detail also the stiffness matrix and the cost of the search."""
    names = ("x", "y", "z", "tilt x", "tilt y")
    matrix = [
        (name, *(f"{value:.4g}" for value in values))
        for name, values in zip(names, row.stiffness.matrix_SI, strict=True)
    ]
    searches = "" if row.searches is None else f"{row.searches} searches, "
    spent = f"{searches}{row.iterations} Newton steps, {row.residual_N:.2g} N left over"
    return [
        replace(ball_sheet({"": row}).block, caption=title),
        Table("Stiffness [N/m, N, N m]", ("", *names), matrix, detail=Detail.ALL),
        Paragraph(spent, detail=Detail.ALL),
    ]


def _row_sentences(row: RowReport) -> list[str]:
    tilts = ", ".join(f"tilt {axis} {row.tilt_mrad[axis]:.4g} mrad" for axis in "xy")
    sentences = [
        f"ring (x along the radial load; z along the axis, 0 where all balls of the drawing just touch): {_place(row.displacement_mm)}, {tilts}"
    ]
    for race, contact in row.contacts.items():
        film = contact.film
        oil = "" if film is None else f", film {film.central_film_um:.3g} µm, lambda {film.lambda_ratio:.2g}"
        axes = " x ".join(shown(1e3 * semi_axis, 3) for semi_axis in (contact.semi_major_mm, contact.semi_minor_mm))
        pressed = f"up to {contact.load_N:.4g} N, {row.max_stress_MPa[race]:.0f} MPa"
        sentences.append(f"{race} raceway: {pressed} on an ellipse of semi-axes {axes} µm{_edge(contact)}{oil}")
    life = row.life
    if life.L10_Mrev is not None:
        hours = f", {shown(life.L10_h, 3)} h" if life.L10_h is not None else ""
        sentences.append(f"life L10r: {shown(life.L10_Mrev, 3)} million turns{hours} ({life.method})")
    return [*sentences, f"stiffness: {_diagonal(row.stiffness)}"]


def _edge(contact: BallContact) -> str:
    """How near the ellipse comes to the shoulder; empty without a contact."""
    if contact.edge_angle_deg is None:
        return ""
    return f", its edge at {contact.edge_angle_deg:.3g} deg (shoulder at {contact.shoulder_angle_deg:.3g})"


def _place(place: dict[str, float]) -> str:
    return ", ".join(f"{axis} {1e3 * place[axis]:.4g} µm" for axis in "xyz")


def _diagonal(stiffness: Stiffness) -> str:
    return ", ".join(f"{axis} {value:.4g} N/µm" for axis, value in stiffness.by_axis.items())


def _middle_ring(report: DoubleDeckerReport) -> list[str]:
    middle = report.middle_ring
    share = "" if middle.speed_share is None else f", {100.0 * middle.speed_share:.4g} % of the speed"
    return [
        f"middle ring: {middle.speed_rpm:.5g} rpm{share} ({middle.speed_status})",
        f"both rows: {_place(report.displacement_mm)}; stiffness {_diagonal(report.stiffness)}",
    ]


def _fits(fits: Fits) -> str:
    state, loosens = "loose" if fits.inner_ring_loose else "tight", fits.inner_ring_loosens_rpm
    when = "at no speed" if loosens is None else f"at {loosens:.4g} rpm"
    pressed = f"{fits.inner_pressure_MPa:.4g} MPa on the shaft, {fits.outer_pressure_MPa:.4g} MPa in the housing"
    return f"fits: {pressed}; the inner ring is {state}, rotation loosens it {when}"


NODE_NAMES = {"oil": "oil", "outer": "outer ring", "inner": "inner ring", "rollers": "balls"}


def _temperatures(nodes: dict[str, float], thermal: BallHeatBalance) -> list[str]:
    """Steady temperatures with their ranges, heat and its ways out, clearance and contact angle in operation."""
    spans = thermal.ranges.figures or {}
    parts = ", ".join(f"{part} {nodes[node]:.1f} ({range_ends(spans[node])})" for node, part in NODE_NAMES.items())
    friction = thermal.friction_W
    ways = ", ".join(f"{way} {heat:.4g} W" for way, heat in thermal.carried_off_W.items() if heat != 0.0)
    clearance, angle = thermal.clearance_um, thermal.unloaded_angle_deg
    return [
        f"temperatures [°C], with 5 to 95 % of the unknown inputs: {parts}; thermal loop gain {thermal.gain:.2g}",
        f"heat by SKF's friction model: {sum(friction.values()):.4g} W, rolling {friction['rolling']:.4g} and sliding "
        f"{friction['sliding']:.4g}; removed by {ways}",
        f"clearance in operation {clearance['operating']:.4g} µm of {clearance['drawn']:.4g} drawn, unloaded contact angle "
        f"{angle['operating']:.4g} deg of {angle['drawn']:.4g}",
        other_ranges(spans),
    ]


def _search_table(thermal: BallHeatBalance) -> Table:
    """Temperatures, heat and clearance of the states visited."""
    columns: tuple[Column[Any], ...] = (
        *(Column(node, ".1f", f"{part} [°C]", at=(0, node)) for node, part in NODE_NAMES.items()),
        Column("heat_W", ".4g", at=1),
        Column("clearance_um", ".4g", at=2),
    )
    states = tuple(zip(thermal.path_C, thermal.path_heat_W, thermal.path_clearance_um, strict=True))
    return Sheet("search for steady temperatures", columns, states).block


# Smaller runouts [um] are the rounding of equilibria.
NO_RUNOUT = 1e-6


def _runout(runout: Runout) -> str:
    def um(value: float) -> str:
        return f"{value if value > NO_RUNOUT else 0.0:.3g} µm"

    radial = f"{um(runout.indicator_um)} by an indicator, {um(runout.minimum_zone_um)} between circles"
    axial = f"axial {um(runout.axial_um)}, face {um(runout.face_um)}"
    turns, asynchronous = counted(runout.turns, "turn"), um(runout.asynchronous_radial_um)
    return f"runout over {turns}: radial {radial}, {axial}; asynchronous {asynchronous}"
