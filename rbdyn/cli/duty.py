"""A duty on a map of ``rbdyn map``: its points with speed and load, where they lie, and the life over the duty."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.base.blocks import Block, Paragraph, Table
from rbdyn.base.faults import key_path
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import finite, plain
from rbdyn.base.words import shown
from rbdyn.life.duty import SHARE_ROUNDING
from rbdyn.scene import Scene
from rbdyn.scene.duty import DutyPoint, duty_scenes, read_duty

if TYPE_CHECKING:
    import pandas as pd

    from rbdyn.life.duty import DutyLife

# Keys of the axes of a map.
AXES = ("operation.inner_speed_rpm", "operation.radial_load_N")


@dataclass(frozen=True)
class MapDuty:
    """Points of a duty with the scene at each, the life over it, and notes on what a map does not show of it."""

    points: Sequence[DutyPoint]
    scenes: Sequence[Scene]
    life: "DutyLife"
    notes: Notes

    @property
    def marks(self) -> dict[str, tuple[float, float]]:
        """Speed [rpm] and load [N] by the name of the point."""
        return {point.name: _place(scene) for point, scene in zip(self.points, self.scenes, strict=True)}

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row a point: share of the time, place on the map, life there, share of the damage."""
        whole = sum(point.share for point in self.points)
        lives = zip(self.life.point_hours, self.life.damage, strict=True)
        return [
            {
                "name": point.name,
                "share": point.share / whole,
                "inner_speed_rpm": speed,
                "radial_load_N": load,
                "L10_h": finite(hours),
                "damage_share": damage,
            }
            for point, (speed, load), (hours, damage) in zip(self.points, self.marks.values(), lives, strict=True)
        ]

    def as_record(self) -> dict[str, Any]:
        """JSON of the duty."""
        return {"points": self.rows, "life": self.life.as_record(), "notes": plain(self.notes)}

    def table(self) -> "pd.DataFrame":
        """A row a point; units in the names."""
        import pandas as pd

        return pd.DataFrame(self.rows)

    def blocks(self) -> list[Block]:
        """The points with their lives, and the life over the duty."""
        header = ("point", "share of time", "speed [rpm]", "load [N]", "life [h]", "share of damage")
        rows = [
            (
                row["name"],
                f"{100.0 * row['share']:.4g} %",
                f"{row['inner_speed_rpm']:g}",
                f"{row['radial_load_N']:g}",
                shown(row["L10_h"], 3),
                f"{100.0 * row['damage_share']:.3g} %",
            )
            for row in self.rows
        ]
        return [Table("Duty", header, rows), Paragraph(life_sentence(self.life.as_record()))]


def life_sentence(life: Mapping[str, float | None]) -> str:
    """Life over a duty in words; empty where it has no end."""
    if life["L10_h"] is None:
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

    points = read_duty(path)
    scenes = [steady_scene(hot) for hot in duty_scenes(scene, points, str(path))]
    whole = sum(point.share for point in points)
    life = roller_duty_life(scenes, [point.share / whole for point in points])
    notes = (*life_notes(life.hours, whole), *_notes(points, scenes, speeds_rpm, loads_N))
    return MapDuty(points, scenes, life, notes)


def life_notes(life: float, hours: float) -> Notes:
    """A note on a ``life`` [h] below the ``hours`` of the duty: the sum of its shares, where it is not that of shares of 1."""
    if abs(hours - 1.0) <= SHARE_ROUNDING or life >= hours:
        return ()
    return (Note("short-life", f"life: {life:.3g} h over the duty, below its {hours:.6g} h (the sum of the shares)"),)


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
