"""What ``rbdyn ball --sweep`` runs, prints and writes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.cli.terminal import FAILED, hand_over, keeping, output_folder, print_table, progress_bar
from rbdyn.result import write_json

if TYPE_CHECKING:
    from rbdyn.quasistatic.sweep.result import SweepResult
    from rbdyn.scene import BallScene

# Points of a long table that are shown from its start, and from its end.
SHOWN = 8
# Header and columns of the table: the larger of two columns; of a double-decker, those of both rows.
HEADER = {
    "x [um]": ("x_mm",),
    "axial, z [um]": ("z_mm",),
    "inner angle": ("inner_angle_max_deg",),
    "outer angle": ("outer_angle_max_deg",),
    "largest load [N]": ("inner_load_max_N", "outer_load_max_N"),
    "pressure [MPa]": ("inner_pressure_MPa", "outer_pressure_MPa"),
    "stiffness x [N/um]": ("stiffness_x_N_per_um",),
    "axial, z": ("stiffness_z_N_per_um",),
    "L10 [Mrev]": ("L10_Mrev",),
}


def run(scene: BallScene, texts: Sequence[str], out: Path | None, source: Path, as_json: bool, quiet: bool) -> int:
    """Sweep the scene of the file ``source`` as ``--sweep`` asks for; returns the exit code. Raises InputError."""
    from rbdyn.quasistatic.sweep.points import parsed

    keys = parsed(texts)
    folder = output_folder(out, "rbdyn ball", source) if out else None
    from rbdyn.quasistatic.sweep.run import sweep

    kept_in = folder / "sweep.part.npz" if folder else None
    with keeping(kept_in), progress_bar("sweeping", quiet or as_json) as progress:
        found = sweep(scene, keys, progress, kept_in)
    files = write(found, folder) if folder else []
    hand_over(found.as_dict, as_json, lambda: show(found, quiet), folder, files)
    for places in found.failures.values():
        print(f"{found.where(places)}: {found.statuses[places[0]]}", file=sys.stderr)
    return FAILED if found.failures else 0


def show(found: SweepResult, quiet: bool) -> None:
    """Print the points, what they cost and the notes."""
    print_points(found)
    print(f"{len(found.statuses)} points in {found.wall_s:.3g} s, {found.cold} of them not started from a neighbour")
    for note in found.notes if not quiet else ():
        print(f"note: {found.where(note['points'])}: {note['note']}")


def print_points(found: SweepResult) -> None:
    """Print the points, of a long sweep the first and the last ones."""
    count = len(found.statuses)
    rows = [_row(found, place) for place in range(count) if count <= 2 * SHOWN or _outer(place, count)]
    if count > 2 * SHOWN:
        rows.insert(SHOWN, ["..."] * len(rows[0]))
    units = [key.rpartition(".")[2] for key in found.keys]
    print_table("", [*units, *HEADER], rows)


def write(found: SweepResult, folder: Path) -> list[str]:
    """Write sweep.json, sweep.csv and pictures; returns the names of the files."""
    from rbdyn.plots.ball_sweep import pictures

    write_json(folder / "sweep.json", found.as_dict())
    found.save(folder / "sweep.csv")
    return ["sweep.json", "sweep.csv", *pictures(found, folder)]


def _outer(place: int, count: int) -> bool:
    return place < SHOWN or place >= count - SHOWN


def _row(found: SweepResult, place: int) -> list[str]:
    keys = [f"{value:.6g}" for value in found.at(place).values()]
    if found.statuses[place] != "ok":
        return keys + ["failed"] * len(HEADER)
    return keys + [_cell(found, names, place) for names in HEADER.values()]


def _cell(found: SweepResult, names: Sequence[str], place: int) -> str:
    columns: dict[str, Any] = found.columns
    rows = ("",) if names[0] in columns else ("inner_row_", "outer_row_")
    values = [max(float(columns[f"{row}{name}"][place]) for name in names) for row in rows]
    unit = 1e3 if names[0].endswith("_mm") else 1.0
    return " / ".join(f"{unit * value:.4g}" for value in values)
