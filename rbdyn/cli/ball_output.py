"""What ``rbdyn ball`` prints and writes."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.cli.terminal import print_notes, print_table
from rbdyn.quasistatic.result import BallResult, DoubleDeckerReport, RowReport
from rbdyn.records.cells import save_table
from rbdyn.records.words import counted
from rbdyn.scene import BallScene

if TYPE_CHECKING:
    import pandas as pd


def print_result(result: BallResult, quiet: bool, verbose: bool) -> None:
    """Print a result as tables; the reason on standard error where there is none."""
    from rbdyn.compiled.kernel import compiler_notes

    if not result.found:
        print(f"no equilibrium: {result.status}", file=sys.stderr)
        return
    for name, row in result.row_reports.items():
        _print_row(f"{name} row" if name else "", row, verbose)
    report = result.reached
    if isinstance(report, DoubleDeckerReport):
        _print_middle_ring(report)
    held = report.reaction["moment_Nm"] if report.reaction else {}
    if any(held.values()):
        print("moment on the inner ring: " + ", ".join(f"about {axis} {held[axis]:.4g} N m" for axis in "xy"))
    if result.fits is not None:
        _print_fits(result.fits)
    if (runout := result.runout) is not None:
        radial = f"{runout['indicator_um']:.3g} um by an indicator, {runout['minimum_zone_um']:.3g} um between circles"
        axial = f"axial {runout['axial_um']:.3g} um, face {runout['face_um']:.3g} um"
        asynchronous = f"asynchronous {runout['asynchronous_radial_um']:.3g} um"
        print(f"runout over {counted(runout['turns'], 'turn')}: radial {radial}, {axial}; {asynchronous}")
    print_notes([*(result.notes or ()), *(compiler_notes() if verbose else ())], quiet)


def with_runout(scene: BallScene, result: BallResult) -> "tuple[BallResult, pd.DataFrame | None]":
    """The result with the runout of its ring and the path it takes, where the scene has form errors."""
    if scene.errors is None or not result.found:
        return result, None
    from rbdyn.cli.ball_studies import runout_record

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


def _print_row(title: str, row: RowReport, verbose: bool) -> None:
    place, tilt, stiffness = row.displacement_mm, row.tilt_mrad, row.stiffness
    header = ("azimuth [deg]", "inner angle [deg]", "outer angle", "inner load [N]", "outer load", "centrifugal [N]")
    keys = ("azimuth_deg", "inner_angle_deg", "outer_angle_deg", "inner_load_N", "outer_load_N", "centrifugal_force_N")
    rows = [(f"{ball['azimuth_deg']:.1f}", *(f"{ball[key]:.4g}" for key in keys[1:])) for ball in row.balls]
    print_table(title, header, rows)
    tilts = ", ".join(f"tilt {axis} {tilt[axis]:.4g} mrad" for axis in "xy")
    print(f"ring (x along the radial load, z along the axis): {_place(place)}, {tilts}")
    for race, contact in row.contacts.items():
        film = ""
        if "central_film_um" in contact:
            film = f", film {contact['central_film_um']:.3g} um, lambda {contact['lambda_ratio']:.2g}"
        ellipse = f"{2e3 * contact['semi_major_mm']:.3g} x {2e3 * contact['semi_minor_mm']:.3g} um"
        pressed = f"up to {contact['load_N']:.4g} N, {row.max_stress_MPa[race]:.0f} MPa"
        print(f"{race} race: {pressed} over {ellipse}{film}")
    life = row.life
    if life["L10_Mrev"] is not None:
        hours = f", {life['L10_h']:.4g} h" if life["L10_h"] is not None else ""
        print(f"life L10r: {life['L10_Mrev']:.4g} million turns{hours} ({life['method']})")
    print(f"stiffness: {_diagonal(stiffness)}")
    if verbose:
        names = ("x", "y", "z", "tilt x", "tilt y")
        lines = [[f"{value:.4g}" for value in values] for values in stiffness["matrix_SI"]]
        print_table("stiffness [N/m, N, N m]", ("", *names), [(a, *b) for a, b in zip(names, lines, strict=True)])
        searches = "" if row.searches is None else f"{row.searches} searches, "
        print(f"{searches}{row.iterations} Newton steps, {row.residual_N:.2g} N left over")


def _place(place: dict[str, float]) -> str:
    return ", ".join(f"{axis} {1e3 * place[axis]:.4g} um" for axis in "xyz")


def _diagonal(stiffness: dict[str, Any]) -> str:
    return ", ".join(f"{axis} {stiffness[f'{axis}_N_per_um']:.4g} N/um" for axis in "xyz")


def _print_middle_ring(report: DoubleDeckerReport) -> None:
    middle = report.middle_ring
    share = "" if middle["speed_share"] is None else f", {100.0 * middle['speed_share']:.4g} % of the speed"
    print(f"middle ring: {middle['speed_rpm']:.5g} rpm{share} ({middle['speed_status']})")
    print(f"both rows: {_place(report.displacement_mm)}; stiffness {_diagonal(report.stiffness)}")


def _print_fits(fits: dict[str, Any]) -> None:
    loosens = fits["inner_ring_loosens_rpm"]
    state = "loose" if fits["inner_ring_loose"] else "tight"
    when = "at no speed" if loosens is None else f"at {loosens:.4g} rpm"
    pressed = f"{fits['inner_pressure_MPa']:.4g} MPa on the shaft, {fits['outer_pressure_MPa']:.4g} MPa in the housing"
    print(f"fits: {pressed}; the inner ring is {state}, rotation loosens it {when}")
