"""Studies of ``rbdyn ball``: sweeps over keys, runout, preload, clearance, wear, race limits; their tables and files."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from rbdyn.base.blocks import Block, Detail, Paragraph, Table, with_notes
from rbdyn.base.command import FAILED, checkpoint_message, deliver, progress_bar
from rbdyn.base.faults import InputError, MethodError, axis_values
from rbdyn.base.files import write_json
from rbdyn.base.folder import OutputFolder
from rbdyn.base.identity import identity_of
from rbdyn.base.records import plain
from rbdyn.base.table import Column, Sheet
from rbdyn.base.words import counted, label, shown, with_error
from rbdyn.quasistatic.preload import Scan, over_clearance, over_preload, over_wear
from rbdyn.quasistatic.result import RACES, remarks, ring_columns, row_columns, tipping
from rbdyn.quasistatic.row.equilibrium import OK
from rbdyn.quasistatic.runout.lots import Lot, bench_of, design, follow_ring, single_row
from rbdyn.quasistatic.runout.measures import ToleranceClass, running_accuracy
from rbdyn.quasistatic.runout.turn import RingPath
from rbdyn.quasistatic.sweep import SweepResult, notes_by_topic
from rbdyn.scene import BallScene
from rbdyn.scene.ball import SingleRowScene

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


def run_sweep(
    scene: "BallScene", texts: Sequence[str], folder: OutputFolder, source: Path, as_json: bool, quiet: bool
) -> int:
    """Sweep the scene of the file ``source`` as ``--sweep`` asks for; returns the exit code. Raises InputError."""
    from rbdyn.quasistatic.sweep import keys_of_texts

    keys = keys_of_texts(texts)
    folder.claim(source)
    from rbdyn.quasistatic.sweep import sweep

    kept_in = folder.path / "sweep.part" if folder.path else None
    with checkpoint_message(kept_in), progress_bar("sweeping", quiet or as_json) as progress:
        result = sweep(scene, keys, progress, kept_in)
    identity = identity_of("rbdyn ball --sweep", result.scene, [source], swept=result.keys)
    answer, write = partial(sweep_blocks, result), partial(write_sweep, result)
    deliver(folder, identity, result.as_dict, answer, write, as_json, Detail.of(quiet))
    for places in result.failures.values():
        print(f"{result.where(places)}: {result.statuses[places[0]]}", file=sys.stderr)
    return FAILED if result.failures else 0


def sweep_blocks(result: "SweepResult") -> list[Block]:
    """The points, what they cost and the notes."""
    points = counted(len(result.statuses), "point")
    spent = f"{points} in {result.wall_s:.3g} s, {result.cold} of them not started from a neighbour"
    return with_notes(result.placed_notes, [points_table(result), Paragraph(spent)])


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
    keys = [f"{value:.6g}" for value in result.key_values(place).values()]
    if result.statuses[place] != "ok":
        return keys + ["failed"] * len(HEADER)
    return keys + [_cell(result, names, place) for names in HEADER.values()]


def _cell(result: "SweepResult", names: Sequence[str], place: int) -> str:
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


def runout_record(scene: BallScene) -> tuple[dict[str, Any], RingPath]:
    """Runout of the turning ring over the form errors of its scene [um], and the path. Raises InputError, RunError."""
    followed = follow_ring(scene)
    runout = asdict(followed.runout(bench_of(scene).face_radius))
    turns = runout.pop("turns")
    return {**{f"{name}_um": 1e6 * value for name, value in runout.items()}, "turns": turns}, followed


def optimum_study(scene: BallScene, swept: str, values: Sequence[float]) -> tuple[dict[str, Any], SweepResult]:
    """Peak pressure and life over preload [N], clearance or wear of the balls [um], and where each is best; also as a sweep.

    Raises InputError for a double-decker, or for values that cannot be swept.
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
        "notes": plain((*scan.notes, *table.placed_notes)),
    }, table


def _table(scene: BallScene, key: str, values: Sequence[float], scan: Scan) -> SweepResult:
    """Figures, balls and notes of the points scanned."""
    points, places = scan.points, np.arange(len(values))
    solutions, ratings = [point.solution for point in points], [point.rating for point in points]
    names = ("figures", "displacement", "reaction", "stiffness")
    balls, displacement, reaction, stiffness = (np.array([getattr(s, name) for s in solutions]) for name in names)
    statuses = tuple(solution.status for solution in solutions)
    columns = ring_columns(displacement, reaction, stiffness) | row_columns(balls, ratings)
    for column in columns.values():
        column[[status != OK for status in statuses]] = np.nan
    placed = [(0, remark) for remark in (*remarks(balls, ratings), tipping(displacement[:, 3:], scene))]
    notes, rows = notes_by_topic(placed, places, statuses), {"row": [(places, balls)]}
    return SweepResult({key: tuple(values)}, columns, statuses, 0, 0.0, scene.model_dump(mode="json"), rows, notes)


def _best(scan: Scan, which: str, si: float) -> dict[str, float]:
    point = getattr(scan, which)
    return {"value": point.value / si, "max_stress_MPa": 1e-6 * point.peak_pressure, "L10_Mrev": point.million_turns}


def race_limits(scene: BallScene, tolerance_class: str, target_yield: float, seed: int = 1) -> dict[str, Any]:
    """Limits of roundness and side-sway of both races with which the share ``target_yield`` of bearings meets a class.

    The lot has amplitudes that fall as 1/order from order 1 to 40 (``lots.Lot``). Raises InputError.
    """
    row = _single(scene, "race-limits")
    if tolerance_class not in get_args(ToleranceClass):
        classes = ", ".join(get_args(ToleranceClass))
        raise InputError([f"--race-limits {tolerance_class}: is no tolerance class; choose one of {classes}"])
    if row.bearing.bore_mm is None:
        raise InputError(["bearing.bore_mm: missing; tolerance classes go by the bore, add it"])
    try:
        allowed = running_accuracy(cast(ToleranceClass, tolerance_class), 1e-3 * row.bearing.bore_mm)
        if allowed.axial is None:
            raise MethodError(f"class {tolerance_class} sets no limit on axial runout; choose P2, P4 or P5")
        targets: dict[str, Any] = {
            "radial_limit": allowed.radial,
            "axial_limit": allowed.axial,
            "target_yield": target_yield,
        }
        limits = design(bench_of(row), Lot(), **targets, seed=seed, solved=SOLVED)
    except MethodError as error:
        raise InputError([f"--race-limits {tolerance_class}: {error}"]) from None
    lengths = ("inner_roundness", "outer_roundness", "inner_sway", "outer_sway", "radial_limit", "axial_limit")
    return {
        "class": tolerance_class,
        "wanted": target_yield,
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
    if scene.thermal is not None:
        other = f"; --sweep {SWEPT_KEYS[option]} follows them" if option in SWEPT_KEYS else ""
        raise InputError(
            [f"--{option}: is a study at stated temperatures; state them in [mounting], not [thermal]{other}"]
        )
    try:
        return single_row(scene)
    except InputError:
        raise InputError([f"--{option}: is a study of one row of balls; a double-decker has two"]) from None


def run(
    scene: BallScene,
    name: str,
    value: str,
    target_yield: float,
    seed: int,
    folder: OutputFolder,
    source: Path,
    as_json: bool,
    quiet: bool,
) -> int:
    """Carry out the study ``name`` over ``value``, print and write it; returns the exit code. Raises InputError."""
    folder.claim(source)
    table: SweepResult | None = None
    if name == "race_limits":
        record = race_limits(scene, value, target_yield, seed)
    else:
        record, table = optimum_study(scene, name, axis_values(value, f"--{name}"))
    command = f"rbdyn ball --{name.replace('_', '-')}"
    swept = table.keys if table else {}
    identity = identity_of(command, scene.model_dump(mode="json"), [source], swept=swept)
    answer, write = partial(blocks, record, table), partial(write_study, name, record, table)
    deliver(folder, identity, lambda: record, answer, write, as_json, Detail.of(quiet))
    return 0


def write_study(name: str, record: dict[str, Any], table: SweepResult | None, folder: Path) -> list[str]:
    """Write the record of a study, its points and their pictures, or the limits of race errors; returns the names of the files."""
    write_json(folder / f"{name}.json", record)
    if table is None:
        return [f"{name}.json", limit_sheet(record).save(folder)]
    from rbdyn.plots.ball import sweep_pictures

    table.save(folder / f"{name}.csv")
    return [f"{name}.json", f"{name}.csv", *sweep_pictures(table, folder)]


def limit_sheet(record: Mapping[str, Any]) -> Sheet[Mapping[str, Any]]:
    """A row a race: its largest roundness and side-sway [um]."""
    columns: tuple[Column[Mapping[str, Any]], ...] = (
        Column("race", meaning="inner or outer"),
        Column(
            "roundness_um", ".3g", "roundness up to [µm]", meaning="largest roundness and side-sway that meet the class"
        ),
        Column("sway_um", ".3g", "side-sway up to [µm]"),
    )
    rows = [
        {"race": race, **{name: record.get(f"{race}_{name}") for name in ("roundness_um", "sway_um")}} for race in RACES
    ]
    content = "A row a race, of `rbdyn ball --race-limits`."
    return Sheet("", columns, rows, file="race_limits.csv", content=content)


def blocks(record: dict[str, Any], table: SweepResult | None) -> list[Block]:
    """The limits of race errors; or the points of a study, where they are best, and notes."""
    if table is None:
        return _limits(record)
    best = [
        Paragraph(
            f"{title} at {point['value']:.4g}: {point['max_stress_MPa']:.0f} MPa, {shown(point['L10_Mrev'], 3)} million turns"
        )
        for title, point in (("least stress", record["least_stress"]), ("longest life", record["longest_life"]))
    ]
    return with_notes(record["notes"], [points_table(table), *best])


def _limits(record: dict[str, Any]) -> list[Block]:
    title = f"class {record['class']}: {record['radial_limit_um']:g} µm radial, {record['axial_limit_um']:g} µm axial runout"
    good = f"{with_error(100.0 * record['yield'], 100.0 * record['standard_error'])} % (standard error)"
    solved = f"{record['solved_in_full']} of them solved in full, seed {record['seed']}"
    return [
        replace(limit_sheet(record).block, caption=title),
        Paragraph(f"yield {good} of {record['bearings']} bearings, {solved}"),
    ]
