"""Tables of scenes: a row a run, with the file that it begins with and values of scene keys.

Columns: ``name`` of the row, ``scene`` (a file next to the table), ``replicates`` and ``seed``, and keys of a scene as
"table.key". A cell without a value leaves that key as it is.
"""

import difflib
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.base.faults import LONGEST_NAME, InputError, key_path, one_line, put_key, read_toml, refuse, set_key
from rbdyn.base.notes import Notes
from rbdyn.base.tables.sheet import InputTable, listed, read_sheet, sheet_of_frame
from rbdyn.scene import BallScene, Scene
from rbdyn.scene.keys import key_values, unknown_keys
from rbdyn.scene.thermal import first_guess_faults

if TYPE_CHECKING:
    import pandas as pd

NAME, SCENE = "name", "scene"
# Columns that stand for a key of the scene.
SHORT = {"replicates": "numerics.replicates", "seed": "numerics.seed"}
# Scene files that are kept at a time.
FILES_KEPT = 64


@dataclass(frozen=True)
class SceneRow:
    """A row of a table: its ``number`` from 1, its ``name``, its scene ``file``, ``values`` by scene key, and faults of its cells."""

    number: int
    name: str
    file: Path | None
    values: Mapping[str, Any]
    faults: Sequence[str] = ()


@dataclass(frozen=True)
class SceneTable:
    """A table of scenes with the ``base`` file of rows without one, ``overrides`` of all rows, and their scene ``keys``."""

    path: Path
    rows: Sequence[SceneRow]
    keys: Sequence[str]
    base: Path | None = None
    overrides: Sequence[str] = ()
    notes: Notes = ()

    def scene(self, row: SceneRow) -> Scene:
        """The scene of a row. Raises InputError with its faults."""
        source = (
            f"row {row.number}"
            if row.name == str(row.number)
            else f"row {row.number} ({one_line(row.name, LONGEST_NAME)})"
        )
        refuse(row.faults)
        file = row.file or self.base
        if file is None:
            raise InputError([f"{source}: has no scene; name one in its column {SCENE}, or for all rows by --scene"])
        tables = deepcopy(_tables(file))
        for assignment in self.overrides:
            set_key(tables, assignment)
        for key, value in row.values.items():
            put_key(tables, key, value, source)
        scene = Scene.from_dict(tables, f"{source}: {file}")
        if isinstance(scene, BallScene):
            raise InputError([f"{source}: {file}: is a ball bearing; rbdyn ball computes it, doe run takes rollers"])
        stated = {*row.values, *(".".join(key_path(text)) for text in self.overrides)}
        refuse(f"{source}: {fault}" for fault in first_guess_faults(scene.thermal, scene.lubricant, stated))
        return scene


@lru_cache(FILES_KEPT)
def _tables(file: Path) -> dict[str, Any]:
    return read_toml(file)


def read_scene_table(table: "Path | pd.DataFrame", base: Path | None, overrides: Sequence[str] = ()) -> SceneTable:
    """The rows of a table of text, a workbook, a parquet file or a frame. Raises InputError for faults of the whole table.

    Those of single rows are kept with them.
    """
    _tables.cache_clear()
    sheet = read_sheet(table) if isinstance(table, Path) else sheet_of_frame(table, Path("table"))
    if base is not None:
        read_toml(base)
    keys = _keys(sheet, overrides)
    return SceneTable(sheet.path, list(_rows(sheet, keys)), list(keys.values()), base, overrides, sheet.notes)


def _keys(sheet: InputTable, overrides: Sequence[str]) -> dict[str, str]:
    """Scene key of each column that has one. Raises InputError for other columns, and for keys that are stated twice."""
    sheet.refuse_nameless()
    names = [name for name in sheet.header if name]
    keys = {name: SHORT.get(name, name) for name in names if name in SHORT or "." in name}
    faults = [f"{sheet.path}: {fault}" for fault in unknown_keys(key for key in keys if key not in SHORT)]
    faults += [f"{sheet.path}: {_unknown(name)}" for name in names if name not in (NAME, SCENE, *keys)]
    for name, key in SHORT.items():
        if name in keys and key in keys:
            faults.append(f"{sheet.path}: columns {name} and {key}: both state one value; keep one of them")
    stated = {".".join(key_path(text)) for text in overrides}
    faults += [
        f"{sheet.path}: column {name}: --set {key} states it too; leave out one of them"
        for name, key in keys.items()
        if key in stated
    ]
    if not faults and not {SCENE, *keys} & set(names):
        faults.append(f"{sheet.path}: states neither {SCENE} nor a key of a scene; it has {listed(names)}")
    refuse([*faults, *(sheet.notes if faults else ())])
    return keys


def _unknown(name: str) -> str:
    """The fault of a column that is no key, with the nearest one."""
    known = {key.rpartition(".")[2]: key for key in reversed(dotted_keys())}
    known |= {own: own for own in (NAME, SCENE, *SHORT)}
    near = difflib.get_close_matches(name[:LONGEST_NAME], known, n=1)
    fix = f"did you mean {known[near[0]]}?" if near else "rename or remove it"
    return f"column {one_line(name, LONGEST_NAME)}: unknown key; {fix}"


def dotted_keys() -> list[str]:
    """All keys of a scene of rollers with their tables."""
    from rbdyn.scene.keys import keys

    return [key.key for key in keys({"scene": Scene}) if "[]" not in key.key]


def _rows(sheet: InputTable, keys: Mapping[str, str]) -> Iterator[SceneRow]:
    columns = {name: sheet.column(name) for name in (NAME, SCENE) if name in sheet}
    values, faults = dict[str, list[Any]](), dict[str, Iterator[str]]()
    for name, key in keys.items():
        # An empty cell is one of the choices, so it has a value.
        values[key], sentences = key_values(replace(sheet.column(name), name=key), ("",))
        faults[key] = iter(sentences)
    for row in range(len(sheet.rows)):
        texts = {name: column.texts[row] for name, column in columns.items()}
        own = {key: column[row] for key, column in values.items() if column[row] != ""}
        bad = [next(faults[key]) for key, value in own.items() if value is None]
        file = texts.get(SCENE) or None
        yield SceneRow(
            row + 1, texts.get(NAME) or str(row + 1), None if file is None else sheet.path.parent / file, own, bad
        )
