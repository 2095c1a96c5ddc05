"""Duty of a machine: points of operation, each with its share of the time and the keys of the scene that it changes.

A duty stands in the ``[[duty]]`` tables of a study or of a file of its own, or in a table of text or a workbook: a row a point,
with its name, its share of the time or its hours, and values of scene keys. ``read_duty`` reads them all.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import Field

from rbdyn.base.faults import (
    Consistent,
    InputError,
    Name,
    NonNegative,
    assignment_faults,
    key_path,
    read_toml,
    refuse,
    validated,
)
from rbdyn.base.tables.sheet import InputTable, Limits, listed, read_sheet
from rbdyn.life import SHARE_ROUNDING
from rbdyn.scene import Scene
from rbdyn.scene.keys import key_values, unknown_keys
from rbdyn.scene.thermal import ORIGINS, first_guess_faults
from rbdyn.scene.uncertain import DECLARATIONS, SEEDS

MOST_POINTS = 12
# Keys of speed and load, the axes of a map.
AXES = ("operation.inner_speed_rpm", "operation.radial_load_N")
# Start of a point from a cold machine.
AMBIENT, ORIGIN = "ambient", "from"
# Columns of a table of points besides the keys of the scene: the name, and the share of the time, or hours in its place.
NAME, TIMES = "name", {"share": Limits(1.0, sign="not negative"), "hours": Limits(1e9, sign="not negative")}
# Keys that a point may not set, with the reasons.
OF_EVERY_POINT = {
    ("numerics", "seed"): SEEDS,
    ("numerics", "replicates"): "each kind of run has its own number of them; leave it out",
    ("uncertain",): DECLARATIONS,
    ("calibrate",): DECLARATIONS,
}


class DutyPoint(Consistent):
    """A point of the duty: its share of the time, and what changes in the scene there."""

    name: Name
    """Name of the point in tables and messages."""
    share: NonNegative
    """Time fraction of this point; the fractions of all points sum to 1. A point of share 0 counts only for worst values and
    limits."""
    set: list[str] = []
    """Keys that differ from the scene file at this point, as "key=value". You can set operation, temperatures and oil flow,
    but not factors and seeds."""
    origin: str | None = Field(None, alias="from")
    """State of the machine when this point begins. Write "ambient" for a cold machine, or the name of another point for its
    steady temperatures. Default: this point is steady from the start. Effect: rbdyn simulate --duty and studies follow
    temperatures and clearances until this point is steady, by [thermal.start]."""

    def faults(self) -> Iterator[str]:
        if ": " in self.name:
            yield f"name = {self.name!r}: must not have a colon with a space; leave it out"
        if self.origin == self.name:
            yield f"from = {self.origin!r}: is the point itself; name another point or {AMBIENT!r}"


class DutyTables(Consistent):
    """The duty in a file."""

    duty: list[DutyPoint]
    """The points of operation."""
    normalise_shares: bool = False
    """Whether the shares may have any sum, such as hours: they are then divided by it."""

    def faults(self) -> Iterator[str]:
        yield from point_faults(self.duty, self.normalise_shares)


def point_faults(
    points: Sequence[DutyPoint], normalise: bool, claims: Mapping[tuple[str, ...], str] | None = None
) -> Iterator[str]:
    """A sentence for each fault of the points of a duty; ``claims``: further keys that no point may set, with the reasons."""
    if len(points) > MOST_POINTS:
        yield f"duty: has {len(points)} points, more than {MOST_POINTS}; join or leave out some"
    names = Counter(point.name for point in points)
    for point in points:
        if point.origin not in (None, AMBIENT, *names):
            yield f"duty.from = {point.origin!r} of {point.name}: no such point; choose {AMBIENT!r} or one of {listed(list(names))}"
    yield from (f"duty.name = {name!r}: used more than once; name each once" for name in names if names[name] > 1)
    total = math.fsum(point.share for point in points)
    if not total > 0.0:
        yield "duty.share: is 0 at every point; state the shares of the time"
    elif not normalise and abs(total - 1.0) > SHARE_ROUNDING:
        yield f"duty.share: sums to {total:.6g} over all points, not to 1; change a share or write normalise_shares = true (in a table: name the column hours)"
    for point in points:
        yield from assignment_faults(f"duty.set of {point.name}", point.set, {**(claims or {}), **OF_EVERY_POINT})


def read_duty(path: Path) -> list[DutyPoint]:
    """Points of a duty: ``[[duty]]`` of a TOML file, whose other tables are not read, or the rows of any other table.

    The shares of a duty in hours have any sum. Raises InputError with all faults.
    """
    if path.suffix.lower() != ".toml":
        return _points_of_table(read_sheet(path))
    tables = read_toml(path)
    if not tables.get("duty"):
        raise InputError(f"{path}: duty: missing; add a [[duty]] table for each point of operation")
    return validated(DutyTables, {key: tables[key] for key in DutyTables.model_fields if key in tables}, str(path)).duty


def in_hours(points: Sequence[DutyPoint]) -> bool:
    """Whether the shares are hours, for they do not sum to 1."""
    return abs(math.fsum(point.share for point in points) - 1.0) > SHARE_ROUNDING


def shares_of_time(points: Sequence[DutyPoint]) -> list[float]:
    """Shares of the time, which sum to 1, where those of the points are hours too."""
    total = math.fsum(point.share for point in points)
    return [point.share / total for point in points]


def _points_of_table(sheet: InputTable) -> list[DutyPoint]:
    """Points in the rows of a table; a cell without a value leaves that key at the scene's value.

    Raises InputError with all faults: columns that are neither name, share, hours nor keys, and bad cells.
    """
    keys, time = _columns(sheet)
    shares, faults = sheet.column(time).numbers(TIMES[time])
    values = {}
    for key in keys:
        # An empty cell is one of the choices, so it has a value.
        values[key], slips = key_values(sheet.column(key), ("",))
        faults += slips
    refuse(faults)
    points = []
    for row, name in enumerate(sheet.column(NAME).texts):
        table: dict[str, Any] = {"name": name, "share": float(shares[row]), "set": list(_assignments(values, row))}
        if ORIGIN in sheet.header and (origin := sheet.column(ORIGIN).texts[row].strip()):
            table[ORIGIN] = origin
        try:
            points.append(validated(DutyPoint, table, f"{sheet.path}: row {row + 1}"))
        except InputError as error:
            faults += error.faults
    refuse(faults)
    refuse(f"{sheet.path}: {fault}" for fault in point_faults(points, normalise=time == "hours"))
    return points


def _columns(sheet: InputTable) -> tuple[list[str], str]:
    """Scene keys among the columns, and the column of times. Raises InputError for any other column but the name, and for missing ones."""
    sheet.refuse_nameless()
    names = [name for name in sheet.header if name]
    keys, times = [name for name in names if "." in name], [name for name in TIMES if name in names]
    missing = [NAME] * (NAME not in names) + ["share or hours"] * (not times)
    faults = [
        f"{sheet.path}: column {name} is missing; add it, or rename one of {listed(sheet.header)}" for name in missing
    ]
    if len(times) > 1:
        faults.append(f"{sheet.path}: columns {' and '.join(times)}: both state the time; keep one of them")
    faults += [
        f"{sheet.path}: column {listed([name])}: neither {NAME}, share, hours, {ORIGIN} nor a key of a scene (table.key); rename or remove it"
        for name in names
        if name not in (NAME, ORIGIN, *times, *keys)
    ]
    faults += [f"{sheet.path}: {fault}" for fault in unknown_keys(keys)]
    # A wrong sheet or separator may be the reason.
    refuse([*faults, *(sheet.notes if faults else ())])
    return keys, times[0]


def _assignments(values: Mapping[str, list[Any]], row: int) -> Iterator[str]:
    for key, column in values.items():
        if column[row] != "":
            yield f"{key}={_text(column[row])}"


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return str(value).lower() if isinstance(value, bool) else repr(value).removesuffix(".0")


def duty_scenes(scene: Scene, points: Sequence[DutyPoint], source: str) -> list[Scene]:
    """The scene at each point, in their order. Raises InputError with the faults of all points, which name ``source``."""
    scenes, faults = [], list[str]()
    for point in points:
        try:
            scenes.append(scene.overridden(point.set))
            if point.origin is not None:
                # What the start lacks shows before anything runs.
                warm = [scenes[-1].lubricant.temperature_C] * 6
                starting(scenes[-1], None if point.origin == AMBIENT else warm)
            refuse(
                first_guess_faults(
                    scenes[-1].thermal, scenes[-1].lubricant, {".".join(key_path(text) or ()) for text in point.set}
                )
            )
        except InputError as error:
            faults += [f"{source}: duty {point.name!r}: {fault.removeprefix('scene: ')}" for fault in error.faults]
    refuse(faults)
    return scenes


def starting(scene: Scene, parts: Sequence[float] | None = None, point: Mapping[str, Any] | None = None) -> Scene:
    """The scene with the start of its machine from its surroundings.

    ``parts``: from these temperatures of ``WARMING_NODES`` [C] instead; ``point``: from the steady ones of the scene with these values
    of keys. Raises InputError for a scene without [thermal].
    """
    if scene.thermal is None:
        raise InputError(f"duty.{ORIGIN}: a start needs a heat balance; add [thermal] to the scene or leave it out")
    stated = {} if scene.thermal.start is None else scene.thermal.start.model_dump(mode="json", exclude_none=True)
    kept = {key: value for key, value in stated.items() if key not in ORIGINS}
    origin = {"from_parts_C": parts and list(parts), "from_point": point and dict(point)}
    return scene.changed({"thermal.start": kept | {key: value for key, value in origin.items() if value}})
