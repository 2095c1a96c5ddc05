"""Studies of a ball bearing next to its equilibrium: runout over a turn, preload, clearance, limits of race errors."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from rbdyn.base.blocks import Block, Detail, Paragraph, Table, notes
from rbdyn.base.ranges import axis_values
from rbdyn.base.render.terminal import show
from rbdyn.base.words import with_error
from rbdyn.cli.ball_sweep import points_table
from rbdyn.cli.terminal import hand_over, output_folder
from rbdyn.faults import InputError, MethodError
from rbdyn.quasistatic.preload import Sweep, over_clearance, over_preload, over_wear
from rbdyn.quasistatic.result import remarks, tipping
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

# What a study sweeps: function, unit of the values and that unit in SI.
SWEPT = {
    "preload": (over_preload, "N", 1.0),
    "clearance": (over_clearance, "um", 1e-6),
    "wear": (over_wear, "um", 1e-6),
}
# What its record tells of a point, by column of the table.
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
    as a sweep tells them. Raises InputError for a double-decker, or where the sweep is refused.
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
    hand_over(lambda: record, as_json, lambda: show(blocks(record, table), Detail.of(quiet)), folder, files)
    return 0


def blocks(record: dict[str, Any], table: SweepResult | None) -> list[Block]:
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
    good = f"{with_error(100.0 * record['yield'], 100.0 * record['standard_error'])} % (standard error)"
    solved = f"{record['solved_in_full']} of them solved in full, seed {record['seed']}"
    return [
        Table(title, ("race", "roundness up to [µm]", "side-sway up to [µm]"), rows),
        Paragraph(f"yield {good} of {record['bearings']} bearings, {solved}"),
    ]
