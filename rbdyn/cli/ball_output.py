"""What ``rbdyn ball`` prints and writes of an equilibrium."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.base.blocks import Block, Detail, Heading, Paragraph, Table, with_notes
from rbdyn.base.notes import status_notes
from rbdyn.base.records import save_table
from rbdyn.base.words import counted, range_ends, shown
from rbdyn.clearances import other_ranges
from rbdyn.quasistatic.result import BallResult, DoubleDeckerReport, RowReport, ball_sheet
from rbdyn.scene import BallScene

if TYPE_CHECKING:
    import pandas as pd


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
