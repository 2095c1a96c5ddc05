"""The command ``rbdyn ball``, and what it prints and writes of an equilibrium. Physics is imported inside it, so that help comes at once."""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.base.blocks import Block, Detail, Heading, Paragraph, Table, with_notes
from rbdyn.base.command import (
    FAILED,
    Force,
    Json,
    Quiet,
    SceneFile,
    Set,
    alarm,
    deliver,
    folder_option,
    guarded,
    notice,
    valued,
    verbose_flag,
)
from rbdyn.base.faults import InputError
from rbdyn.base.folder import output_folder
from rbdyn.base.identity import identity_of
from rbdyn.base.notes import status_notes
from rbdyn.base.page import REPORT_FILES
from rbdyn.base.records import save_table
from rbdyn.base.words import counted, range_ends, shown
from rbdyn.mounting import other_ranges
from rbdyn.quasistatic.result import BallResult, DoubleDeckerReport, RowReport, ball_sheet
from rbdyn.scene import BallScene

if TYPE_CHECKING:
    import pandas as pd


# Names of the files of an equilibrium, of a sweep, of the other studies and of all pictures; and what a sweep keeps.
EQUILIBRIUM_FILES, SWEEP_FILES = ("result.json", "balls.csv", "runout.csv"), ("sweep.json", "sweep.csv")
STUDY_FILES = tuple(
    f"{name}.{kind}" for name in ("preload", "clearance", "wear", "race_limits") for kind in ("json", "csv")
)
PICTURES = (
    "loads.png", "angles.png", "section.png", "pressure_and_life.png", "stiffness.png", "azimuth.png", "map.png",
)  # fmt: skip
FILES, KEPT = (*EQUILIBRIUM_FILES, *SWEEP_FILES, *STUDY_FILES, *PICTURES, *REPORT_FILES), ("sweep.part",)

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
    target_yield: Annotated[
        float | None, valued("SHARE", "Share of bearings that must meet --race-limits.", "0.95", "--yield")
    ] = None,
    seed: Annotated[
        int | None,
        valued("N", "Seed of form errors, or of the lot of --race-limits.", "errors.seed; of the lot 1", min=0),
    ] = None,
    out: Annotated[Path | None, folder_option("Write the result as JSON here, with its tables and pictures.")] = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, verbose_flag("Also the stiffness matrix and cost.")] = False,
) -> None:
    """Find the equilibrium of a ball bearing: contact angles, loads, stiffness, stress, life."""
    with guarded(as_json), output_folder(out, "rbdyn ball", FILES, KEPT if sweeps else (), force) as folder:
        from rbdyn.scene import Scene, balls_only

        loaded = balls_only(Scene.load(scene, assignments or []))
        notice(quiet)
        if seed is not None and race_limits is None:
            loaded = _seeded(loaded, seed)
        studies = {"preload": preload, "clearance": clearance, "wear": wear, "race_limits": race_limits}
        requested = _requested(sweeps, target_yield, studies)
        if sweeps:
            from rbdyn.cli.ball_studies import run_sweep

            raise typer.Exit(run_sweep(loaded, sweeps, folder, scene, as_json, quiet))
        for name, value in requested.items():
            from rbdyn.cli.ball_studies import run as run_study

            share = 0.95 if target_yield is None else target_yield
            draw = 1 if seed is None else seed
            raise typer.Exit(run_study(loaded, name, value, share, draw, folder, scene, as_json, quiet))
        folder.claim(scene)
        from rbdyn.quasistatic.bearing import equilibrium

        result, path = with_runout(loaded, equilibrium(loaded))
        identity = identity_of("rbdyn ball", result.scene, [scene])
        answer, files = partial(blocks, result), partial(write, result, path)
        deliver(folder, identity, result.as_dict, answer, files, as_json, Detail.of(quiet, verbose))
    if not result.is_equilibrium:
        if as_json:
            alarm(status_notes(result.status))
        else:
            subject = "no equilibrium" if result.thermal is None else "temperatures"
            print(f"{subject}: {result.status}", file=sys.stderr)
        raise typer.Exit(FAILED)


def _requested(sweeps: list[str] | None, target_yield: float | None, studies: dict[str, str | None]) -> dict[str, str]:
    """The study asked for, with its values. Raises InputError for two, and for a yield of none."""
    requested = {name: value for name, value in studies.items() if value is not None}
    flags = [f"--{name.replace('_', '-')}" for name in (*(["sweep"] if sweeps else []), *requested)]
    if len(flags) > 1:
        raise InputError([f"{' and '.join(flags)}: are studies of their own; choose one"])
    if target_yield is not None and studies["race_limits"] is None:
        raise InputError([f"--yield {target_yield:g}: is a share of --race-limits; add that or leave it out"])
    return requested


def _seeded(scene: "BallScene", seed: int) -> "BallScene":
    """The scene with other draws of its form errors. Raises InputError where there are none."""
    if scene.errors is None:
        raise InputError(
            [f"--seed {seed}: no random numbers are used here; it is for the table errors and --race-limits"]
        )
    return scene.changed({"errors.seed": seed})


def blocks(result: BallResult) -> list[Block]:
    """Places, contacts, life and stiffness of each row, forces of the rings, balls, notes; without an equilibrium nothing but the
    temperatures of the search for steady ones."""
    if not result.is_equilibrium:
        thermal = result.thermal or {}
        return with_notes(status_notes(result.status), [_search_table(thermal)] if "path_heat_W" in thermal else [])
    titles = {name: f"{name} row" if name else "" for name in result.row_reports}
    rows: list[Block] = []
    for name, row in result.row_reports.items():
        rows += [Heading(titles[name]), *map(Paragraph, _row_sentences(row))]
    tables = [block for name, row in result.row_reports.items() for block in _row_tables(titles[name], row)]
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
    if result.temperatures_C is not None and result.thermal is not None:
        sentences += _temperatures(result.temperatures_C, result.thermal)
    if result.runout is not None:
        sentences.append(_runout(result.runout))
    from rbdyn.compiled.kernel import compiler_notes

    whole = Heading("whole bearing" if sentences and any(titles.values()) else "")
    answer = [*rows, whole, *map(Paragraph, sentences), *tables]
    return with_notes((*(result.notes or ()), *compiler_notes()), answer)


def with_runout(scene: BallScene, result: BallResult) -> "tuple[BallResult, pd.DataFrame | None]":
    """The result with the runout of its ring, and the path of that, where the scene has form errors."""
    if scene.errors is None or not result.is_equilibrium:
        return result, None
    from rbdyn.cli.ball_studies import runout_record

    record, followed = runout_record(scene)
    return replace(result, runout=record), followed.table()


def write(result: BallResult, path: "pd.DataFrame | None", folder: Path) -> list[str]:
    """Write result.json, balls.csv, pictures and the ``path`` of a turning ring; returns the names of the files."""
    result.save(folder / "result.json")
    if not result.is_equilibrium:
        return ["result.json"]
    from rbdyn.plots.ball import pictures

    files = ["result.json", ball_sheet(result.row_reports).save(folder, "%.8g"), *pictures(result, folder)]
    if path is not None:
        save_table(path, folder / "runout.csv", "%.8g")
        files.append("runout.csv")
    return files


def _row_tables(title: str, row: RowReport) -> list[Block]:
    """The balls; in full detail also the stiffness matrix and the cost of the search."""
    names = ("x", "y", "z", "tilt x", "tilt y")
    matrix = [
        (name, *(f"{value:.4g}" for value in values))
        for name, values in zip(names, row.stiffness["matrix_SI"], strict=True)
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
    sentences = [f"ring (x along the radial load, z along the axis): {_place(row.displacement_mm)}, {tilts}"]
    for race, contact in row.contacts.items():
        film = ""
        if "central_film_um" in contact:
            film = f", film {contact['central_film_um']:.3g} µm, lambda {contact['lambda_ratio']:.2g}"
        axes = " x ".join(shown(1e3 * contact[f"semi_{axis}_mm"], 3) for axis in ("major", "minor"))
        pressed = f"up to {contact['load_N']:.4g} N, {row.max_stress_MPa[race]:.0f} MPa"
        sentences.append(f"{race} race: {pressed} on an ellipse of semi-axes {axes} µm{_edge(contact)}{film}")
    life = row.life
    if life["L10_Mrev"] is not None:
        hours = f", {shown(life['L10_h'], 3)} h" if life["L10_h"] is not None else ""
        sentences.append(f"life L10r: {shown(life['L10_Mrev'], 3)} million turns{hours} ({life['method']})")
    return [*sentences, f"stiffness: {_diagonal(row.stiffness)}"]


def _edge(contact: dict[str, float]) -> str:
    """How near the ellipse comes to the shoulder; empty without a contact."""
    if "edge_angle_deg" not in contact:
        return ""
    return f", its edge at {contact['edge_angle_deg']:.3g} deg (shoulder at {contact['shoulder_angle_deg']:.3g})"


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
    pressed = f"{fits['inner_pressure_MPa']:.4g} MPa on the shaft, {fits['outer_pressure_MPa']:.4g} MPa in the housing"
    return f"fits: {pressed}; the inner ring is {state}, rotation loosens it {when}"


NODE_NAMES = {"oil": "oil", "outer": "outer ring", "inner": "inner ring", "rollers": "balls"}


def _temperatures(nodes: dict[str, float], thermal: dict[str, Any]) -> list[str]:
    """Steady temperatures with their ranges, heat and its ways out, clearance and contact angle in operation."""
    spans = thermal["ranges"]
    parts = ", ".join(f"{part} {nodes[node]:.1f} ({range_ends(spans[node])})" for node, part in NODE_NAMES.items())
    friction = thermal["friction_W"]
    ways = ", ".join(f"{way} {heat:.4g} W" for way, heat in thermal["carried_off_W"].items() if heat != 0.0)
    clearance, angle = thermal["clearance_um"], thermal["unloaded_angle_deg"]
    return [
        f"temperatures [°C], with 5 to 95 % of the unknown inputs: {parts}; gain of the loop {thermal['gain']:.2g}",
        f"heat by SKF's friction model: {sum(friction.values()):.4g} W, rolling {friction['rolling']:.4g} and sliding "
        f"{friction['sliding']:.4g}; carried off by {ways}",
        f"clearance in operation {clearance['operating']:.4g} µm of {clearance['drawn']:.4g} drawn, unloaded contact angle "
        f"{angle['operating']:.4g} deg of {angle['drawn']:.4g}",
        other_ranges(spans),
    ]


def _search_table(thermal: dict[str, Any]) -> Table:
    """Temperatures, heat and clearance of the states visited."""
    header = (*(f"{part} [°C]" for part in NODE_NAMES.values()), "heat [W]", "clearance [µm]")
    states = zip(thermal["path_C"], thermal["path_heat_W"], thermal["path_clearance_um"], strict=True)
    rows = [
        [*(f"{state[node]:.1f}" for node in NODE_NAMES), f"{heat:.4g}", f"{clearance:.4g}"]
        for state, heat, clearance in states
    ]
    return Table("search for steady temperatures", header, rows)


def _runout(runout: dict[str, Any]) -> str:
    radial = f"{runout['indicator_um']:.3g} µm by an indicator, {runout['minimum_zone_um']:.3g} µm between circles"
    axial = f"axial {runout['axial_um']:.3g} µm, face {runout['face_um']:.3g} µm"
    asynchronous = f"asynchronous {runout['asynchronous_radial_um']:.3g} µm"
    return f"runout over {counted(runout['turns'], 'turn')}: radial {radial}, {axial}; {asynchronous}"
