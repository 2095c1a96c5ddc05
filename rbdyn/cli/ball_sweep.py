"""What ``rbdyn ball --sweep`` runs, says and writes."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.base.blocks import Block, Detail, Paragraph, Table, notes
from rbdyn.base.render.terminal import show
from rbdyn.base.words import counted, label
from rbdyn.cli.terminal import FAILED, hand_over, keeping, output_folder, progress_bar
from rbdyn.result import write_json

if TYPE_CHECKING:
    from rbdyn.quasistatic.sweep.result import SweepResult
    from rbdyn.scene import BallScene

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


def run(scene: "BallScene", texts: Sequence[str], out: Path | None, source: Path, as_json: bool, quiet: bool) -> int:
    """Sweep the scene of the file ``source`` as ``--sweep`` asks for; returns the exit code. Raises InputError."""
    from rbdyn.quasistatic.sweep.points import parsed

    keys = parsed(texts)
    folder = output_folder(out, "rbdyn ball", source) if out else None
    from rbdyn.quasistatic.sweep.run import sweep

    kept_in = folder / "sweep.part" if folder else None
    with keeping(kept_in), progress_bar("sweeping", quiet or as_json) as progress:
        result = sweep(scene, keys, progress, kept_in)
    files = write(result, folder) if folder else []
    hand_over(result.as_dict, as_json, lambda: show(blocks(result), Detail.of(quiet)), folder, files)
    for places in result.failures.values():
        print(f"{result.where(places)}: {result.statuses[places[0]]}", file=sys.stderr)
    return FAILED if result.failures else 0


def blocks(result: "SweepResult") -> list[Block]:
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


def write(result: "SweepResult", folder: Path) -> list[str]:
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
