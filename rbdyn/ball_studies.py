"""Studies of a ball bearing beside its equilibrium: runout over a turn, preload, clearance, limits of race errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast, get_args

from rbdyn.faults import InputError
from rbdyn.quasistatic.preload import Sweep, over_clearance, over_preload, over_wear
from rbdyn.quasistatic.runout_class import ToleranceClass, running_accuracy
from rbdyn.quasistatic.runout_lots import Lot
from rbdyn.quasistatic.runout_model import bench_of, follow_ring, single_row
from rbdyn.quasistatic.tolerance_design import RaceLimits, design
from rbdyn.quasistatic.turn import Followed
from rbdyn.ranges import axis_values
from rbdyn.result import write_json
from rbdyn.scene import BallScene
from rbdyn.scene.ball import SingleRowScene
from rbdyn.terminal import output_folder, print_json, print_table

# What a study sweeps: function, unit of the values and that unit in SI.
SWEPT = {
    "preload": (over_preload, "N", 1.0),
    "clearance": (over_clearance, "um", 1e-6),
    "wear": (over_wear, "um", 1e-6),
}
# Bearings of a lot that are solved in full to size the limits of race errors.
SOLVED = 100


def runout_record(scene: BallScene) -> tuple[dict[str, Any], Followed]:
    """Runout of the turning ring over the form errors of its scene [um], and the path. Raises InputError, RunError."""
    followed = follow_ring(scene)
    told = asdict(followed.runout(bench_of(scene).face_radius))
    turns = told.pop("turns")
    return {**{f"{name}_um": 1e6 * value for name, value in told.items()}, "turns": turns}, followed


def optimum_study(scene: BallScene, swept: str, values: Sequence[float]) -> dict[str, Any]:
    """Peak pressure and life over preload [N], clearance or wear of the balls [um], and where each is best.

    Raises InputError for a double-decker, or where the sweep is refused.
    """
    run, unit, si = SWEPT[swept]
    try:
        found = run(_single(scene, swept), [si * value for value in values])
    except ValueError as error:
        raise InputError([f"--{swept}: {error}"]) from None
    return {
        "swept": f"{swept}_{unit}",
        "points": [_point(found, place, si) for place in range(len(found.points))],
        "least_stress": _best(found, "least_stress", si),
        "longest_life": _best(found, "longest_life", si),
        "notes": list(found.notes),
    }


def _point(found: Sweep, place: int, si: float) -> dict[str, Any]:
    point = found.points[place]
    if point.life is None:
        return {"value": point.value / si, "status": point.solution.status}
    return {
        "value": point.value / si,
        "inner_stress_MPa": 1e-6 * point.inner_pressure,
        "outer_stress_MPa": 1e-6 * point.outer_pressure,
        "L10_Mrev": point.million_turns if math.isfinite(point.million_turns) else None,
        "status": point.solution.status,
    }


def _best(found: Sweep, which: str, si: float) -> dict[str, float]:
    point = getattr(found, which)
    return {"value": point.value / si, "max_stress_MPa": 1e-6 * point.peak_pressure, "L10_Mrev": point.million_turns}


def race_limits(scene: BallScene, tolerance_class: str, wanted: float, seed: int = 1) -> dict[str, Any]:
    """Limits of roundness and side-sway of both races with which bearings meet a class with a wanted yield.

    The lot has amplitudes that fall as 1/order from order 1 to 40 (``runout_lots.Lot``). Raises InputError.
    """
    row = _single(scene, "race-limits")
    if tolerance_class not in get_args(ToleranceClass):
        raise InputError(
            [
                f"--race-limits {tolerance_class}: is no tolerance class; choose one of {', '.join(get_args(ToleranceClass))}"
            ]
        )
    if row.bearing.bore_mm is None:
        raise InputError(["bearing.bore_mm: missing; tolerance classes go by the bore, add it"])
    try:
        allowed = running_accuracy(cast(ToleranceClass, tolerance_class), 1e-3 * row.bearing.bore_mm)
        if allowed.axial is None:
            raise ValueError(f"class {tolerance_class} sets no limit on axial runout; choose P2, P4 or P5")
        found = design(
            bench_of(row),
            Lot(),
            radial_limit=allowed.radial,
            axial_limit=allowed.axial,
            wanted=wanted,
            seed=seed,
            solved=SOLVED,
        )
    except ValueError as error:
        raise InputError([f"--race-limits {tolerance_class}: {error}"]) from None
    return {"class": tolerance_class, "wanted": wanted, **_limits(found)}


def _limits(found: RaceLimits) -> dict[str, Any]:
    lengths = ("inner_roundness", "outer_roundness", "inner_sway", "outer_sway", "radial_limit", "axial_limit")
    return {
        **{f"{name}_um": 1e6 * getattr(found, name) for name in lengths},
        "yield": found.yielded,
        "standard_error": found.standard_error,
        "yield_in_proportion": found.proportional,
        "homogenisation": {"radial": found.homogenisation[0], "axial": found.homogenisation[1]},
        "bearings": found.bearings,
        "solved_in_full": SOLVED,
        "seed": found.seed,
    }


def _single(scene: BallScene, option: str) -> SingleRowScene:
    try:
        return single_row(scene)
    except InputError:
        raise InputError([f"--{option}: is a study of one row of balls; a double-decker has two"]) from None


def run(
    scene: BallScene, asked: Mapping[str, str | None], wanted: float, out: Path | None, source: Path, as_json: bool
) -> int:
    """Carry out the one study asked for, print and write it; returns the exit code. Raises InputError."""
    chosen = {name: value for name, value in asked.items() if value is not None}
    if len(chosen) > 1:
        flags = " and ".join(f"--{name.replace('_', '-')}" for name in chosen)
        raise InputError([f"{flags}: are studies of their own; choose one"])
    ((name, value),) = chosen.items()
    folder = output_folder(out, "rbdyn ball", source) if out else None
    if name == "race_limits":
        record = race_limits(scene, value, wanted)
    else:
        record = optimum_study(scene, name, axis_values(value, f"--{name}"))
    if folder:
        write_json(folder / f"{name}.json", record)
    if as_json:
        print_json(record)
        return 0
    _print_limits(record) if name == "race_limits" else _print_optimum(record)
    if folder:
        print(f"written to {folder}: {name}.json")
    return 0


def _print_optimum(record: dict[str, Any]) -> None:
    what = record["swept"].replace("_", " [") + "]"
    rows = [
        (f"{point['value']:.4g}", point["status"], "", "")
        if "L10_Mrev" not in point
        else (
            f"{point['value']:.4g}",
            f"{point['inner_stress_MPa']:.0f}",
            f"{point['outer_stress_MPa']:.0f}",
            "unloaded" if point["L10_Mrev"] is None else f"{point['L10_Mrev']:.4g}",
        )
        for point in record["points"]
    ]
    print_table("", (what, "inner stress [MPa]", "outer stress [MPa]", "L10r [million turns]"), rows)
    for best, title in (("least_stress", "least stress"), ("longest_life", "longest life")):
        at = record[best]
        print(f"{title} at {at['value']:.4g}: {at['max_stress_MPa']:.0f} MPa, {at['L10_Mrev']:.4g} million turns")
    for note in record["notes"]:
        print(f"note: {note}")


def _print_limits(record: dict[str, Any]) -> None:
    rows = [
        (race, f"{record[f'{race}_roundness_um']:.3g}", f"{record[f'{race}_sway_um']:.3g}")
        for race in ("inner", "outer")
    ]
    title = f"class {record['class']}: {record['radial_limit_um']:g} um radial, {record['axial_limit_um']:g} um axial runout"
    print_table(title, ("race", "roundness up to [um]", "side-sway up to [um]"), rows)
    print(
        f"yield {100.0 * record['yield']:.1f} +- {100.0 * record['standard_error']:.1f} % (standard error) of {record['bearings']} bearings, "
        f"{record['solved_in_full']} of them solved in full, seed {record['seed']}"
    )
