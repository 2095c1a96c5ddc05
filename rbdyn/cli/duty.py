"""A duty on a map of ``rbdyn map``, and what ``rbdyn simulate --duty`` prints and writes of each point.

Both show its points with speed and load, and the life there and over the duty.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rbdyn.base.blocks import Block, Paragraph, Table, with_notes
from rbdyn.base.faults import key_path
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, finite
from rbdyn.base.table import Column, Sheet
from rbdyn.base.words import quantity, shown, with_error
from rbdyn.dynamics.figures import BEARING, of_kind
from rbdyn.life.duty import PointLife, life_notes, life_sheet
from rbdyn.scene import Scene
from rbdyn.scene.duty import AXES, DutyPoint, duty_scenes, read_duty, shares_of_time

if TYPE_CHECKING:
    from rbdyn.dynamics.duty_simulation import DutySimulation, SimulatedPoint, Worst
    from rbdyn.result import Quantity

# Figures of a point on the screen by the heading of their column, and their factor; all of them stand in points.csv.
SHOWN = {figure.panel[1]: (figure.key, figure.percent) for figure in BEARING if figure.panel}
CLEARANCES = {figure.source[0]: (figure.key, 1.0) for figure in of_kind("clearance")}


class MapDuty(Record):
    """Points of a duty, the life over it, and notes on what a map does not show of it."""

    points: tuple[PointLife, ...]
    life: dict[str, float | None]
    notes: Notes

    @property
    def marks(self) -> dict[str, tuple[float, float]]:
        """Speed [rpm] and load [N] by the name of the point."""
        return {point.name: (point.inner_speed_rpm, point.radial_load_N) for point in self.points}

    @property
    def blocks(self) -> list[Block]:
        """The points with their lives, and the life over the duty."""
        return duty_blocks(self.points, self.life)


def duty_blocks(points: "Sequence[PointLife | SimulatedPoint]", life: Mapping[str, float | None]) -> list[Block]:
    """Table of points with name, share, speed, load, life and share of the damage, and the life over the duty."""
    return [life_sheet(points).block, Paragraph(life_sentence(life))]


def life_sentence(life: Mapping[str, float | None]) -> str:
    """Life over a duty in words; empty where it has no end."""
    if life.get("L10_h") is None:
        return ""
    return (
        f"Life over the duty, L10r: {shown(life['L10_h'], 3)} h (ISO/TS 16281 static loads, Palmgren and Miner); equivalent load "
        f"{shown(life['equivalent_load_N'], 4)} N."
    )


def map_duty(scene: Scene, path: Path, speeds_rpm: Sequence[float], loads_N: Sequence[float]) -> MapDuty:  # noqa: N803
    """The duty of a file on a map of these speeds and loads, with [thermal] at the steady temperatures of each point.

    Raises InputError with all faults at once, RunError for a point without steady temperatures.
    """
    from rbdyn.dynamics.duty import roller_duty_life
    from rbdyn.dynamics.simulate import steady_scene

    stated = read_duty(path)
    scenes = [steady_scene(hot) for hot in duty_scenes(scene, stated, str(path))]
    shares = shares_of_time(stated)
    life = roller_duty_life(scenes, shares)
    points = tuple(
        PointLife(point.name, share, *_place(scene), finite(hours), damage)
        for point, share, scene, hours, damage in zip(
            stated, shares, scenes, life.point_hours, life.damage, strict=True
        )
    )
    notes = (
        *life_notes(life.hours, sum(point.share for point in stated)),
        *_notes(stated, scenes, speeds_rpm, loads_N),
    )
    return MapDuty(points, life.as_record(), notes)


def _notes(
    points: Sequence[DutyPoint], scenes: Sequence[Scene], speeds: Sequence[float], loads: Sequence[float]
) -> Notes:
    """Notes on points off the map, and on keys that the map keeps at the values of the scene."""
    notes = list[Note]()
    for point, scene in zip(points, scenes, strict=True):
        speed, load = _place(scene)
        if not (speeds[0] <= speed <= speeds[-1] and loads[0] <= load <= loads[-1]):
            sentence = (
                f"duty {point.name!r}: {speed:g} rpm and {load:g} N are off the map, so its mark is at the edge; widen --speed "
                "or --load"
            )
            notes.append(Note("off-map", sentence))
        others = [".".join(path) for text in point.set if (path := key_path(text)) and ".".join(path) not in AXES]
        if others:
            sentence = f"duty {point.name!r}: sets {', '.join(others)} too, which the map keeps at the scene's values"
            notes.append(Note("off-map", sentence))
    return tuple(notes)


def _place(scene: Scene) -> tuple[float, float]:
    return scene.operation.inner_speed_rpm, scene.operation.radial_load_N


def simulated_blocks(found: "DutySimulation") -> list[Block]:
    """The verdict, the worst points in words, figures and clearances in operation at each point, lives, notes."""
    names = [name for name, _ in (*SHOWN.values(), *CLEARANCES.values()) if name in found.worst]
    lifeless = [point.name for point in found.points if point.L10_h is None and point.status != "ok"]
    blocks = [
        Paragraph(f"Worst: {', '.join(_worst(name, found.worst[name]) for name in names)}." if names else ""),
        _point_table("Figures", found, SHOWN),
        _point_table("Clearances in operation [µm]", found, CLEARANCES),
        *duty_blocks(found.points, found.life or {}),
        Paragraph("" if found.life else f"Life over the duty: unknown, for there is none at {', '.join(lifeless)}."),
    ]
    return with_notes(found.notes, blocks)


def _point_table(caption: str, found: "DutySimulation", figures: Mapping[str, tuple[str, float]]) -> Table:
    """A row a point that has figures; ``figures``: name and factor by heading."""

    def column(heading: str, name: str, factor: float) -> "Column[SimulatedPoint]":
        return Column(name, words=heading, cell=lambda point: _with_error(point.figures.get(name), factor))

    point_name: Column[SimulatedPoint] = Column("name", words="point", cell=_marked)
    columns = [point_name, *(column(heading, *figure) for heading, figure in figures.items())]
    return Sheet(caption, columns, [point for point in found.points if point.figures]).block.without_empty_columns()


def _marked(point: "SimulatedPoint") -> str:
    return point.name if point.status == "ok" else f"{point.name} (failed)"


def _with_error(figure: "Quantity | None", factor: float) -> str:
    """A figure with the error to print next to it; a clearance, which is exact, to a tenth of a micrometre."""
    if figure is None:
        return ""
    if figure.error == 0.0:
        return f"{factor * figure.value:.1f}"
    error = figure.stated_error
    return with_error(factor * figure.value, None if error is None else factor * error)


def _worst(name: str, worst: "Worst") -> str:
    doubt = f" (not told apart from {', '.join(worst.not_told_apart)})" if worst.not_told_apart else ""
    return f"{quantity(name)[0].replace(' operating', '')} at {worst.point}{doubt}"


def write_simulated(found: "DutySimulation", folder: Path) -> list[str]:
    """Write duty.json and points.csv; returns their names."""
    found.save(folder / "duty.json")
    return ["duty.json", found.sheet.save(folder, "%.8g")]
