"""``rbdyn ball``: equilibrium of a ball bearing, its output, its studies (runout, preload, wear) and sweeps over keys."""

import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast, get_args

import numpy as np
import typer

from rbdyn.base.blocks import Block, Detail, Paragraph, Table, notes
from rbdyn.base.faults import InputError, MethodError
from rbdyn.base.options import Json, Quiet, SceneFile, Set, folder_option, valued, verbose_flag
from rbdyn.base.ranges import axis_values
from rbdyn.base.records import save_table
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import FAILED, guarded, hand_over, keeping, output_folder, progress_bar
from rbdyn.base.words import counted, label, with_error
from rbdyn.quasistatic.preload import Sweep, over_clearance, over_preload, over_wear
from rbdyn.quasistatic.result import BallResult, DoubleDeckerReport, RowReport, remarks, tipping
from rbdyn.quasistatic.row.equilibrium import OK
from rbdyn.quasistatic.runout.lots import Lot, design
from rbdyn.quasistatic.runout.measures import ToleranceClass, running_accuracy
from rbdyn.quasistatic.runout.model import bench_of, follow_ring, single_row
from rbdyn.quasistatic.runout.turn import Followed
from rbdyn.quasistatic.sweep.figures import ring_columns, row_columns
from rbdyn.quasistatic.sweep.result import SweepResult
from rbdyn.quasistatic.sweep.run import grouped
from rbdyn.result import write_json
from rbdyn.scene import BallScene
from rbdyn.scene.ball import SingleRowScene

if TYPE_CHECKING:
    import pandas as pd


def blocks(result: BallResult) -> list[Block]:
    """Balls, places, contacts, life and stiffness of each row, what the rings do, notes; nothing without an equilibrium."""
    if not result.found:
        return []
    found = [
        block
        for name, row in result.row_reports.items()
        for block in (*_row_tables(f"{name} row" if name else "", row), *map(Paragraph, _row_sentences(row)))
    ]
    sentences = []
    report = result.reached
    if isinstance(report, DoubleDeckerReport):
        sentences += _middle_ring(report)
    moment = report.reaction["moment_Nm"] if report.reaction else {}
    if any(moment.values()):
        sentences.append(
            "moment on the inner ring: " + ", ".join(f"about {axis} {moment[axis]:.4g} N m" for axis in "xy")
        )
    if result.fits is not None:
        sentences.append(_fits(result.fits))
    if result.runout is not None:
        sentences.append(_runout(result.runout))
    from rbdyn.compiled.kernel import compiler_notes

    return [*found, *map(Paragraph, sentences), *notes(result.notes or ()), *notes(compiler_notes(), Detail.ALL)]


def with_runout(scene: BallScene, result: BallResult) -> "tuple[BallResult, pd.DataFrame | None]":
    """The result with the runout of its ring and the path it takes, where the scene has form errors."""
    if scene.errors is None or not result.found:
        return result, None

    record, followed = runout_record(scene)
    return replace(result, runout=record), followed.table()


def write(result: BallResult, folder: Path, path: "pd.DataFrame | None" = None) -> list[str]:
    """Write result.json, balls.csv, pictures and the ``path`` of a turning ring; returns the names of the files."""
    result.save(folder / "result.json")
    if not result.found:
        return ["result.json"]
    from rbdyn.plots.ball import pictures

    save_table(result.table(), folder / "balls.csv", "%.8g")
    files = ["result.json", "balls.csv", *pictures(result, folder)]
    if path is not None:
        save_table(path, folder / "runout.csv", "%.8g")
        files.append("runout.csv")
    return files


def _row_tables(title: str, row: RowReport) -> list[Block]:
    """The balls; for who asks for all also the stiffness matrix and what the search cost."""
    header = ("azimuth [deg]", "inner angle [deg]", "outer angle", "inner load [N]", "outer load", "centrifugal [N]")
    keys = ("azimuth_deg", "inner_angle_deg", "outer_angle_deg", "inner_load_N", "outer_load_N", "centrifugal_force_N")
    balls = [(f"{ball['azimuth_deg']:.1f}", *(f"{ball[key]:.4g}" for key in keys[1:])) for ball in row.balls]
    names = ("x", "y", "z", "tilt x", "tilt y")
    matrix = [
        (name, *(f"{value:.4g}" for value in values))
        for name, values in zip(names, row.stiffness["matrix_SI"], strict=True)
    ]
    searches = "" if row.searches is None else f"{row.searches} searches, "
    spent = f"{searches}{row.iterations} Newton steps, {row.residual_N:.2g} N left over"
    return [
        Table(title, header, balls),
        Table("Stiffness [N/m, N, N m]", ("", *names), matrix, detail=Detail.ALL),
        Paragraph(spent, detail=Detail.ALL),
    ]


def _row_sentences(row: RowReport) -> list[str]:
    tilts = ", ".join(f"tilt {axis} {row.tilt_mrad[axis]:.4g} mrad" for axis in "xy")
    sentences = [f"ring (x along the radial load, z along the axis): {_place(row.displacement_mm)}, {tilts}"]
    for race, contact in row.contacts.items():
        film = ""
        if "central_film_um" in contact:
            film = f", film {contact['central_film_um']:.3g} µm, lambda {contact['lambda_ratio']:.2g}"
        sentences.append(
            f"{race} race: up to {contact['load_N']:.4g} N, {row.max_stress_MPa[race]:.0f} MPa over "
            f"{2e3 * contact['semi_major_mm']:.3g} x {2e3 * contact['semi_minor_mm']:.3g} µm{film}"
        )
    life = row.life
    if life["L10_Mrev"] is not None:
        hours = f", {life['L10_h']:.4g} h" if life["L10_h"] is not None else ""
        sentences.append(f"life L10r: {life['L10_Mrev']:.4g} million turns{hours} ({life['method']})")
    return [*sentences, f"stiffness: {_diagonal(row.stiffness)}"]


def _place(place: dict[str, float]) -> str:
    return ", ".join(f"{axis} {1e3 * place[axis]:.4g} µm" for axis in "xyz")


def _diagonal(stiffness: dict[str, Any]) -> str:
    return ", ".join(f"{axis} {stiffness[f'{axis}_N_per_um']:.4g} N/µm" for axis in "xyz")


def _middle_ring(report: DoubleDeckerReport) -> list[str]:
    middle = report.middle_ring
    share = "" if middle["speed_share"] is None else f", {100.0 * middle['speed_share']:.4g} % of the speed"
    return [
        f"middle ring: {middle['speed_rpm']:.5g} rpm{share} ({middle['speed_status']})",
        f"both rows: {_place(report.displacement_mm)}; stiffness {_diagonal(report.stiffness)}",
    ]


def _fits(fits: dict[str, Any]) -> str:
    loosens = fits["inner_ring_loosens_rpm"]
    state = "loose" if fits["inner_ring_loose"] else "tight"
    when = "at no speed" if loosens is None else f"at {loosens:.4g} rpm"
    return (
        f"fits: {fits['inner_pressure_MPa']:.4g} MPa on the shaft, {fits['outer_pressure_MPa']:.4g} MPa in the "
        f"housing; the inner ring is {state}, rotation loosens it {when}"
    )


def _runout(runout: dict[str, Any]) -> str:
    return (
        f"runout over {counted(runout['turns'], 'turn')}: radial {runout['indicator_um']:.3g} µm by an indicator, "
        f"{runout['minimum_zone_um']:.3g} µm between circles, axial {runout['axial_um']:.3g} µm, face "
        f"{runout['face_um']:.3g} µm; asynchronous {runout['asynchronous_radial_um']:.3g} µm"
    )


# Points of a long table that are shown from its start, and from its end.
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


def run_sweep(
    scene: "BallScene", texts: Sequence[str], out: Path | None, source: Path, as_json: bool, quiet: bool
) -> int:
    """Sweep the scene of the file ``source`` as ``--sweep`` asks for; returns the exit code. Raises InputError."""
    from rbdyn.quasistatic.sweep.points import parsed

    keys = parsed(texts)
    folder = output_folder(out, "rbdyn ball", source) if out else None
    from rbdyn.quasistatic.sweep.run import sweep

    kept_in = folder / "sweep.part" if folder else None
    with keeping(kept_in), progress_bar("sweeping", quiet or as_json) as progress:
        result = sweep(scene, keys, progress, kept_in)
    files = write_sweep(result, folder) if folder else []
    hand_over(result.as_dict, as_json, lambda: show(sweep_blocks(result), Detail.of(quiet)), folder, files)
    for places in result.failures.values():
        print(f"{result.where(places)}: {result.statuses[places[0]]}", file=sys.stderr)
    return FAILED if result.failures else 0


def sweep_blocks(result: "SweepResult") -> list[Block]:
    """The points, what they cost and the notes."""
    points = counted(len(result.statuses), "point")
    spent = f"{points} in {result.wall_s:.3g} s, {result.cold} of them not started from a neighbour"
    remarks = (f"{result.where(note['points'])}: {note['note']}" for note in result.notes)
    return [points_table(result), Paragraph(spent), *notes(remarks)]


def points_table(result: "SweepResult") -> Table:
    """The points, of a long sweep the first and the last ones."""
    count = len(result.statuses)
    ends = (*range(SHOWN), *range(count - SHOWN, count)) if count > 2 * SHOWN else range(count)
    rows = [_row(result, place) for place in ends]
    if len(ends) < count:
        rows.insert(SHOWN, ["..."] * len(rows[0]))
    units = [label(key.rpartition(".")[2]) for key in result.keys]
    return Table("", [*units, *HEADER], rows)


def write_sweep(result: "SweepResult", folder: Path) -> list[str]:
    """Write sweep.json, sweep.csv and pictures; returns the names of the files."""
    from rbdyn.plots.ball import sweep_pictures

    write_json(folder / "sweep.json", result.as_dict())
    result.save(folder / "sweep.csv")
    return ["sweep.json", "sweep.csv", *sweep_pictures(result, folder)]


def _row(result: "SweepResult", place: int) -> list[str]:
    keys = [f"{value:.6g}" for value in result.at(place).values()]
    if result.statuses[place] != "ok":
        return keys + ["failed"] * len(HEADER)
    return keys + [_cell(result, names, place) for names in HEADER.values()]


def _cell(result: "SweepResult", names: Sequence[str], place: int) -> str:
    columns: dict[str, Any] = result.columns
    rows = ("",) if names[0] in columns else ("inner_row_", "outer_row_")
    values = [max(float(columns[f"{row}{name}"][place]) for name in names) for row in rows]
    unit = 1e3 if names[0].endswith("_mm") else 1.0
    return " / ".join(f"{unit * value:.4g}" for value in values)


# What a study sweeps: function, unit of the values and that unit in SI.
SWEPT = {
    "preload": (over_preload, "N", 1.0),
    "clearance": (over_clearance, "um", 1e-6),
    "wear": (over_wear, "um", 1e-6),
}
# What its record holds of a point, by column of the table.
SWEPT_FIGURES = {f"{race}_stress_MPa": f"{race}_pressure_MPa" for race in ("inner", "outer")} | {"L10_Mrev": "L10_Mrev"}
# Bearings of a lot that are solved in full to size the limits of race errors.
SOLVED = 100


def runout_record(scene: BallScene) -> tuple[dict[str, Any], Followed]:
    """Runout of the turning ring over the form errors of its scene [um], and the path. Raises InputError, RunError."""
    followed = follow_ring(scene)
    told = asdict(followed.runout(bench_of(scene).face_radius))
    turns = told.pop("turns")
    return {**{f"{name}_um": 1e6 * value for name, value in told.items()}, "turns": turns}, followed


def optimum_study(scene: BallScene, swept: str, values: Sequence[float]) -> tuple[dict[str, Any], SweepResult]:
    """Peak pressure and life over preload [N], clearance or wear of the balls [um], and where each is best; and the points
    as a sweep shows them. Raises InputError for a double-decker, or where the sweep is refused.
    """
    run, unit, si = SWEPT[swept]
    try:
        scan = run(_single(scene, swept), [si * value for value in values])
    except MethodError as error:
        raise InputError([f"--{swept}: {error}"]) from None
    table = _table(scene, f"{swept}_{unit}", values, scan)
    names = {"value": f"{swept}_{unit}", **SWEPT_FIGURES, "status": "status"}
    points = [{name: point[column] for name, column in names.items() if column in point} for point in table.points()]
    return {
        "swept": f"{swept}_{unit}",
        "points": points,
        "least_stress": _best(scan, "least_stress", si),
        "longest_life": _best(scan, "longest_life", si),
        "notes": [*scan.notes, *(f"{table.where(note['points'])}: {note['note']}" for note in table.notes)],
    }, table


def _table(scene: BallScene, key: str, values: Sequence[float], scan: Sweep) -> SweepResult:
    """Figures, balls and notes of the points scanned."""
    points, places = scan.points, np.arange(len(values))
    solutions, ratings = [point.solution for point in points], [point.rating for point in points]
    told_of = ("figures", "displacement", "reaction", "stiffness")
    balls, displacement, reaction, stiffness = (np.array([getattr(s, of) for s in solutions]) for of in told_of)
    statuses = tuple(solution.status for solution in solutions)
    columns = ring_columns(displacement, reaction, stiffness) | row_columns(balls, ratings)
    for column in columns.values():
        column[[status != OK for status in statuses]] = np.nan
    told = [(0, remark) for remark in (*remarks(balls, ratings), tipping(displacement[:, 3:], scene))]
    notes, rows = grouped(told, places, statuses), {"row": [(places, balls)]}
    return SweepResult({key: tuple(values)}, columns, statuses, 0, 0.0, scene.model_dump(mode="json"), rows, notes)


def _best(scan: Sweep, which: str, si: float) -> dict[str, float]:
    point = getattr(scan, which)
    return {"value": point.value / si, "max_stress_MPa": 1e-6 * point.peak_pressure, "L10_Mrev": point.million_turns}


def race_limits(scene: BallScene, tolerance_class: str, wanted: float, seed: int = 1) -> dict[str, Any]:
    """Limits of roundness and side-sway of both races with which bearings meet a class with a wanted yield.

    The lot has amplitudes that fall as 1/order from order 1 to 40 (``runout_lots.Lot``). Raises InputError.
    """
    row = _single(scene, "race-limits")
    if tolerance_class not in get_args(ToleranceClass):
        known = ", ".join(get_args(ToleranceClass))
        raise InputError([f"--race-limits {tolerance_class}: is no tolerance class; choose one of {known}"])
    if row.bearing.bore_mm is None:
        raise InputError(["bearing.bore_mm: missing; tolerance classes go by the bore, add it"])
    try:
        allowed = running_accuracy(cast(ToleranceClass, tolerance_class), 1e-3 * row.bearing.bore_mm)
        if allowed.axial is None:
            raise MethodError(f"class {tolerance_class} sets no limit on axial runout; choose P2, P4 or P5")
        asked: dict[str, Any] = {"radial_limit": allowed.radial, "axial_limit": allowed.axial, "wanted": wanted}
        limits = design(bench_of(row), Lot(), **asked, seed=seed, solved=SOLVED)
    except MethodError as error:
        raise InputError([f"--race-limits {tolerance_class}: {error}"]) from None
    lengths = ("inner_roundness", "outer_roundness", "inner_sway", "outer_sway", "radial_limit", "axial_limit")
    return {
        "class": tolerance_class,
        "wanted": wanted,
        **{f"{name}_um": 1e6 * getattr(limits, name) for name in lengths},
        "yield": limits.yielded,
        "standard_error": limits.standard_error,
        "yield_in_proportion": limits.proportional,
        "homogenisation": {"radial": limits.homogenisation[0], "axial": limits.homogenisation[1]},
        "bearings": limits.bearings,
        "solved_in_full": SOLVED,
        "seed": limits.seed,
    }


def _single(scene: BallScene, option: str) -> SingleRowScene:
    try:
        return single_row(scene)
    except InputError:
        raise InputError([f"--{option}: is a study of one row of balls; a double-decker has two"]) from None


def run(
    scene: BallScene,
    name: str,
    value: str,
    wanted: float,
    seed: int,
    out: Path | None,
    source: Path,
    as_json: bool,
    quiet: bool,
) -> int:
    """Carry out the study ``name`` over ``value``, print and write it; returns the exit code. Raises InputError."""
    folder, files = output_folder(out, "rbdyn ball", source) if out else None, [f"{name}.json"]
    table: SweepResult | None = None
    if name == "race_limits":
        record = race_limits(scene, value, wanted, seed)
    else:
        record, table = optimum_study(scene, name, axis_values(value, f"--{name}"))
    if folder:
        write_json(folder / files[0], record)
        if table is not None:
            from rbdyn.plots.ball import sweep_pictures

            table.save(folder / f"{name}.csv")
            files += [f"{name}.csv", *sweep_pictures(table, folder)]
    hand_over(lambda: record, as_json, lambda: show(study_blocks(record, table), Detail.of(quiet)), folder, files)
    return 0


def study_blocks(record: dict[str, Any], table: SweepResult | None) -> list[Block]:
    """The limits of race errors; or the points of a study, where they are best, and notes."""
    if table is None:
        return _limits(record)
    best = [
        Paragraph(f"{title} at {at['value']:.4g}: {at['max_stress_MPa']:.0f} MPa, {at['L10_Mrev']:.4g} million turns")
        for title, at in (("least stress", record["least_stress"]), ("longest life", record["longest_life"]))
    ]
    return [points_table(table), *best, *notes(record["notes"])]


def _limits(record: dict[str, Any]) -> list[Block]:
    of_race = {race: (record[f"{race}_roundness_um"], record[f"{race}_sway_um"]) for race in ("inner", "outer")}
    rows = [(race, f"{roundness:.3g}", f"{sway:.3g}") for race, (roundness, sway) in of_race.items()]
    title = f"class {record['class']}: {record['radial_limit_um']:g} µm radial, {record['axial_limit_um']:g} µm axial runout"
    return [
        Table(title, ("race", "roundness up to [µm]", "side-sway up to [µm]"), rows),
        Paragraph(
            f"yield {with_error(100.0 * record['yield'], 100.0 * record['standard_error'])} % (standard error) of "
            f"{record['bearings']} bearings, {record['solved_in_full']} of them solved in full, seed {record['seed']}"
        ),
    ]


VALUES, UNASKED = "start:stop:count or a,b,c", "the equilibrium alone"


def study_option(metavar: str, says: str) -> Any:
    """An option that asks for a study instead of the equilibrium."""
    return valued(metavar, f"{says}, instead.", UNASKED)


def ball(
    scene: SceneFile,
    assignments: Set = None,
    sweeps: Annotated[
        list[str] | None,
        valued("KEY=VALUES", f"Sweep a number of the scene, {VALUES}; repeatable for a grid.", "one point", "--sweep"),
    ] = None,
    preload: Annotated[str | None, study_option("N", f"Stress and life over axial preload, {VALUES}")] = None,
    clearance: Annotated[str | None, study_option("UM", "The same over the diametral clearance")] = None,
    wear: Annotated[str | None, study_option("UM", "The same over the diameter that balls lose")] = None,
    race_limits: Annotated[
        str | None, study_option("CLASS", "Race errors with which bearings meet P2, P4 or P5")
    ] = None,
    wanted: Annotated[
        float | None, valued("SHARE", "Share of bearings that must meet --race-limits.", "0.95", "--yield")
    ] = None,
    seed: Annotated[
        int | None,
        valued("N", "Seed of form errors, or of the lot of --race-limits.", "errors.seed; of the lot 1", min=0),
    ] = None,
    out: Annotated[Path | None, folder_option("Write the result as JSON here, with its tables and pictures.")] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, verbose_flag("Also the stiffness matrix and cost.")] = False,
) -> None:
    """Find the equilibrium of a ball bearing: contact angles, loads, stiffness, stress, life."""
    with guarded(as_json):
        from rbdyn.scene import Scene, balls_only

        loaded = balls_only(Scene.load(scene, assignments or []))
        if seed is not None and race_limits is None:
            loaded = _seeded(loaded, seed)
        studies = {"preload": preload, "clearance": clearance, "wear": wear, "race_limits": race_limits}
        requested = _requested(sweeps, wanted, studies)
        if sweeps:
            raise typer.Exit(run_sweep(loaded, sweeps, out, scene, as_json, quiet))
        for name, value in requested.items():
            share = 0.95 if wanted is None else wanted
            draw = 1 if seed is None else seed
            raise typer.Exit(run(loaded, name, value, share, draw, out, scene, as_json, quiet))
        folder = output_folder(out, "rbdyn ball", scene) if out else None
        from rbdyn.quasistatic.bearing import equilibrium

        result, path = with_runout(loaded, equilibrium(loaded))
        files = write(result, folder, path) if folder else []
        hand_over(result.as_dict, as_json, lambda: show(blocks(result), Detail.of(quiet, verbose)), folder, files)
    if not result.found:
        if not as_json:
            print(f"no equilibrium: {result.status}", file=sys.stderr)
        raise typer.Exit(FAILED)


def _requested(sweeps: list[str] | None, wanted: float | None, studies: dict[str, str | None]) -> dict[str, str]:
    """The study asked for, with its values. Raises InputError for two, and for a yield of none."""
    requested = {name: value for name, value in studies.items() if value is not None}
    flags = [f"--{name.replace('_', '-')}" for name in (*(["sweep"] if sweeps else []), *requested)]
    if len(flags) > 1:
        raise InputError([f"{' and '.join(flags)}: are studies of their own; choose one"])
    if wanted is not None and studies["race_limits"] is None:
        raise InputError([f"--yield {wanted:g}: is a share of --race-limits; add that or leave it out"])
    return requested


def _seeded(scene: "BallScene", seed: int) -> "BallScene":
    """The scene with other draws of its form errors. Raises InputError where there are none."""
    if scene.errors is None:
        raise InputError(
            [f"--seed {seed}: no random numbers are used here; it is for the table errors and --race-limits"]
        )
    return scene.changed({"errors.seed": seed})
