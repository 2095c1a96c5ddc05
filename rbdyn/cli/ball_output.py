"""What ``rbdyn ball`` prints and writes."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.cli.terminal import print_table
from rbdyn.quasistatic.result import BallResult
from rbdyn.scene import BallScene

if TYPE_CHECKING:
    import pandas as pd


def print_result(result: BallResult, quiet: bool, verbose: bool) -> None:
    """Print a result as tables; the reason on standard error where there is none."""
    record = result.record
    if not result.found:
        print(f"no equilibrium: {result.status}", file=sys.stderr)
        return
    for name in ("inner", "outer") if "inner" in record else ("",):
        _print_row(f"{name} row" if name else "", record[name] if name else record, verbose)
    if "middle_ring" in record:
        _print_middle_ring(record)
    held = record["reaction"]["moment_Nm"]
    if any(held.values()):
        print("moment on the inner ring: " + ", ".join(f"about {axis} {held[axis]:.4g} N m" for axis in "xy"))
    if "fits" in record:
        _print_fits(record["fits"])
    if "runout" in record:
        told = record["runout"]
        print(
            f"runout over {told['turns']} turns: radial {told['indicator_um']:.3g} um by an indicator, {told['minimum_zone_um']:.3g} um "
            f"between circles, axial {told['axial_um']:.3g} um, face {told['face_um']:.3g} um; asynchronous {told['asynchronous_radial_um']:.3g} um"
        )
    if not quiet:
        for note in record.get("notes", ()):
            print(f"note: {note}")


def with_runout(scene: BallScene, result: BallResult) -> tuple[BallResult, pd.DataFrame | None]:
    """The result with the runout of its ring and the path it takes, where the scene has form errors."""
    if scene.errors is None or not result.found:
        return result, None
    from rbdyn.cli.ball_studies import runout_record

    record, followed = runout_record(scene)
    return replace(result, record={**result.record, "runout": record}), followed.table()


def write(result: BallResult, folder: Path, path: pd.DataFrame | None = None) -> list[str]:
    """Write result.json, balls.csv, pictures and the ``path`` of a turning ring; returns the names of the files."""
    result.save(folder / "result.json")
    if not result.found:
        return ["result.json"]
    from rbdyn.plots.ball import pictures

    result.table().to_csv(folder / "balls.csv", index=False, float_format="%.8g")
    files = ["result.json", "balls.csv", *pictures(result, folder)]
    if path is not None:
        path.to_csv(folder / "runout.csv", index=False, float_format="%.8g")
        files.append("runout.csv")
    return files


def _print_row(title: str, record: dict[str, Any], verbose: bool) -> None:
    place, tilt, stiffness = record["displacement_mm"], record["tilt_mrad"], record["stiffness"]
    header = ("azimuth [deg]", "inner angle [deg]", "outer angle", "inner load [N]", "outer load", "centrifugal [N]")
    keys = ("azimuth_deg", "inner_angle_deg", "outer_angle_deg", "inner_load_N", "outer_load_N", "centrifugal_force_N")
    rows = [(f"{ball['azimuth_deg']:.1f}", *(f"{ball[key]:.4g}" for key in keys[1:])) for ball in record["balls"]]
    print_table(title, header, rows)
    print(
        "ring: "
        + ", ".join(f"{axis} {1e3 * place[axis]:.4g} um" for axis in "xyz")
        + ", "
        + ", ".join(f"tilt {axis} {tilt[axis]:.4g} mrad" for axis in "xy")
    )
    for race, contact in record["contacts"].items():
        film = (
            f", film {contact['central_film_um']:.3g} um, lambda {contact['lambda_ratio']:.2g}"
            if "central_film_um" in contact
            else ""
        )
        print(
            f"{race} race: up to {contact['load_N']:.4g} N, {record['max_stress_MPa'][race]:.0f} MPa over "
            f"{2e3 * contact['semi_major_mm']:.3g} x {2e3 * contact['semi_minor_mm']:.3g} um{film}"
        )
    life = record["life"]
    if life["L10_Mrev"] is not None:
        hours = f", {life['L10_h']:.4g} h" if life["L10_h"] is not None else ""
        print(f"life L10r: {life['L10_Mrev']:.4g} million turns{hours} ({life['method']})")
    print("stiffness: " + ", ".join(f"{axis} {stiffness[f'{axis}_N_per_um']:.4g} N/um" for axis in "xyz"))
    if verbose:
        print_table(
            "stiffness [N/m, N, N m]",
            ("", "x", "y", "z", "tilt x", "tilt y"),
            [
                (name, *(f"{value:.4g}" for value in row))
                for name, row in zip(("x", "y", "z", "tilt x", "tilt y"), stiffness["matrix_SI"], strict=True)
            ],
        )
        searches = f"{record['searches']} searches, " if "searches" in record else ""
        print(f"{searches}{record['iterations']} Newton steps, {record['residual_N']:.2g} N left over")


def _print_middle_ring(record: dict[str, Any]) -> None:
    middle, place, stiffness = record["middle_ring"], record["displacement_mm"], record["stiffness"]
    share = "" if middle["speed_share"] is None else f", {100.0 * middle['speed_share']:.4g} % of the speed"
    print(f"middle ring: {middle['speed_rpm']:.5g} rpm{share} ({middle['speed_status']})")
    print(
        "both rows: "
        + ", ".join(f"{axis} {1e3 * place[axis]:.4g} um" for axis in "xyz")
        + "; stiffness "
        + ", ".join(f"{axis} {stiffness[f'{axis}_N_per_um']:.4g} N/um" for axis in "xyz")
    )


def _print_fits(fits: dict[str, Any]) -> None:
    loosens = fits["inner_ring_loosens_rpm"]
    state = "loose" if fits["inner_ring_loose"] else "tight"
    when = "at no speed" if loosens is None else f"at {loosens:.4g} rpm"
    print(
        f"fits: {fits['inner_pressure_MPa']:.4g} MPa on the shaft, {fits['outer_pressure_MPa']:.4g} MPa in the housing; the inner "
        f"ring is {state}, rotation loosens it {when}"
    )
