"""Duty of a study from a table: a row a point of operation, with its name, its share of the time and values of scene keys."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from doe.study_file.table import Limits, Sheet, listed, read_sheet
from doe.workflow.key_columns import key_values, unknown_keys
from rbdyn.base.faults import InputError, refuse, validated
from rbdyn.scene import Scene
from rbdyn.scene.duty import DutyPoint, duty_scenes

NAME, SHARE = "name", "share"
SHARES = Limits(1.0, sign="not negative")
POINT = """[[duty]]
name = {name}
share = {share!r} # of the time
set = {set}
"""


def read_points(path: Path, scene: Scene) -> list[DutyPoint]:
    """Points of the duty in a table of text or a workbook; a cell without a value leaves that key at the scene's value.

    Raises InputError with all faults: columns that are neither name, share nor keys, bad cells, and points that the scene refuses.
    """
    sheet = read_sheet(path)
    keys = _keys(sheet)
    shares, faults = sheet.column(SHARE).numbers(SHARES)
    values = {}
    for key in keys:
        # An empty cell is one of the choices, so it has a value.
        values[key], slips = key_values(sheet.column(key), ("",))
        faults += slips
    refuse(faults)
    points = []
    for row, name in enumerate(sheet.column(NAME).texts):
        table = {"name": name, "share": float(shares[row]), "set": list(_assignments(values, row))}
        try:
            points.append(validated(DutyPoint, table, f"{path}: row {row + 1}"))
        except InputError as error:
            faults += error.faults
    refuse(faults)
    duty_scenes(scene, points, str(path))
    return points


def _keys(sheet: Sheet) -> list[str]:
    """Scene keys among the columns. Raises InputError for any other column but name and share, and where one of these is missing."""
    sheet.refuse_nameless()
    names = [name for name in sheet.header if name]
    keys = [name for name in names if "." in name]
    faults = [
        f"{sheet.path}: column {name} is missing; add it, or rename one of {listed(sheet.header)}"
        for name in (NAME, SHARE)
        if name not in names
    ]
    faults += [
        f"{sheet.path}: column {listed([name])}: neither {NAME}, {SHARE} nor a key of a scene (table.key); rename or remove it"
        for name in names
        if name not in (NAME, SHARE, *keys)
    ]
    faults += [f"{sheet.path}: {fault}" for fault in unknown_keys(keys)]
    # A wrong sheet or separator may be the reason.
    refuse([*faults, *(sheet.notes if faults else ())])
    return keys


def _assignments(values: dict[str, list[Any]], row: int) -> Iterator[str]:
    for key, column in values.items():
        if column[row] != "":
            yield f"{key}={_text(column[row])}"


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return str(value).lower() if isinstance(value, bool) else repr(value).removesuffix(".0")


def _quoted(value: str | list[str]) -> str:
    """A value in TOML, without the characters that have a meaning in a template."""
    text = json.dumps(value, ensure_ascii=False)
    return "".join(f"\\u{ord(character):04x}" if character in "{}#" else character for character in text)


def duty_text(points: list[DutyPoint]) -> str:
    """The [[duty]] tables of a study."""
    return "\n".join(
        POINT.format(name=_quoted(point.name), share=point.share, set=_quoted(point.set)) for point in points
    )
