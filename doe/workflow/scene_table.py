"""Tables of scenes and their runs: a row a run, with the file that it begins with and values of scene keys.

Columns: ``name`` of the row, ``scene`` (a file next to the table), ``replicates`` and ``seed``, and keys of a scene as
"table.key". A cell without a value leaves that key as it is.

Every row ends with its figures or the cause of its failure. Rows are built and simulated in batches, so that memory does not grow with their results.
"""

import difflib
import json
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from doe.clearance import Simulations, work_of
from doe.running.runner import Progress, Stage
from doe.running.store import Failure
from doe.study_file.table import DONE, FAILED, STATUS
from rbdyn.base.arrays import Array
from rbdyn.base.faults import LONGEST_NAME, InputError, key_path, one_line, put_key, read_toml, refuse, set_key
from rbdyn.base.files import digest_of
from rbdyn.base.notes import DANGER, Notes, of_level
from rbdyn.base.records import Record, finite
from rbdyn.base.tables.sheet import InputTable, listed, read_sheet, sheet_of_frame
from rbdyn.draft.text import tables_of
from rbdyn.result import SimulationResult, arrays_of
from rbdyn.scene import Scene
from rbdyn.scene.ball import BALL_KINDS
from rbdyn.scene.keys import key_values, unknown_keys
from rbdyn.scene.thermal import first_guess_faults

if TYPE_CHECKING:
    import pandas as pd


NAME, SCENE, DESIGNATION = "name", "scene", "designation"
# Columns that stand for a key of the scene.
SHORT = {"replicates": "numerics.replicates", "seed": "numerics.seed"}
# Scene files that are kept at a time.
FILES_KEPT = 64


class SceneRow(Record):
    """A row of a table: its ``number`` from 1, its ``name``, ``values`` by scene key, and faults of its cells.

    ``file``: its scene, or ``designation``: the bearing of the catalogue that it begins with; the base of the table without both.
    """

    number: int
    name: str
    file: Path | None
    designation: str
    values: Mapping[str, Any]
    faults: Sequence[str] = ()


class SceneTable(Record):
    """A table of scenes with the ``base`` file of rows without one, and ``overrides`` of all rows."""

    path: Path
    rows: Sequence[SceneRow]
    base: Path | None = None
    overrides: Sequence[str] = ()
    notes: Notes = ()

    def scene(self, row: SceneRow) -> Scene:
        """The scene of a row. Raises InputError with its faults."""
        name = "" if row.name == str(row.number) else f" ({one_line(row.name, LONGEST_NAME)})"
        source = f"row {row.number}{name}"
        refuse(row.faults)
        if row.file is not None and row.designation:
            raise InputError(
                f"{source}: has a {SCENE} and a {DESIGNATION}, which both state the bearing; keep one of them"
            )
        file = row.designation or row.file or self.base
        if file is None:
            fix = f"name one in its column {SCENE}, a bearing in {DESIGNATION}, or a scene for all rows by --scene"
            raise InputError(f"{source}: has no scene; {fix}")
        tables = deepcopy(_tables(file))
        bearing = tables.get("bearing")
        if isinstance(bearing, dict) and bearing.get("kind") in BALL_KINDS:
            raise InputError(f"{source}: {file}: is a ball bearing; rbdyn ball computes it, doe run takes rollers")
        for assignment in self.overrides:
            set_key(tables, assignment)
        for key, value in row.values.items():
            put_key(tables, key, value, source)
        scene = Scene.from_dict(tables, f"{source}: {file}")
        stated = {*row.values, *(".".join(key_path(text)) for text in self.overrides)}
        refuse(f"{source}: {fault}" for fault in first_guess_faults(scene.thermal, scene.lubricant, stated))
        return scene


@lru_cache(FILES_KEPT)
def _tables(file: Path | str) -> dict[str, Any]:
    """Tables of a scene file, or of a designation."""
    return read_toml(file) if isinstance(file, Path) else tables_of(file)


def read_scene_table(table: "Path | pd.DataFrame", base: Path | None, overrides: Sequence[str] = ()) -> SceneTable:
    """The rows of a table of text, a workbook, a parquet file or a frame. Raises InputError for faults of the whole table.

    Those of single rows are kept with them.
    """
    _tables.cache_clear()
    sheet = read_sheet(table) if isinstance(table, Path) else sheet_of_frame(table, Path("table"))
    if base is not None:
        read_toml(base)
    return SceneTable(sheet.path, list(_rows(sheet, _keys(sheet, overrides))), base, overrides, sheet.notes)


def _keys(sheet: InputTable, overrides: Sequence[str]) -> dict[str, str]:
    """Scene key of each column that has one. Raises InputError for other columns, and for keys that are stated twice."""
    sheet.refuse_nameless()
    names = [name for name in sheet.header if name]
    keys = {name: SHORT.get(name, name) for name in names if name in SHORT or "." in name}
    faults = [f"{sheet.path}: {fault}" for fault in unknown_keys(key for key in keys if key not in SHORT)]
    faults += [f"{sheet.path}: {_unknown(name)}" for name in names if name not in (NAME, SCENE, DESIGNATION, *keys)]
    for name, key in SHORT.items():
        if name in keys and key in keys:
            faults.append(f"{sheet.path}: columns {name} and {key}: both state one value; keep one of them")
    stated = {".".join(key_path(text)) for text in overrides}
    faults += [
        f"{sheet.path}: column {name}: --set {key} states it too; leave out one of them"
        for name, key in keys.items()
        if key in stated
    ]
    if not faults and not {SCENE, DESIGNATION, *keys} & set(names):
        faults.append(
            f"{sheet.path}: states neither {SCENE}, {DESIGNATION} nor a key of a scene; it has {listed(names)}"
        )
    refuse([*faults, *(sheet.notes if faults else ())])
    return keys


def _unknown(name: str) -> str:
    """The fault of a column that is no key, with the nearest one."""
    fields = (NAME, SCENE, DESIGNATION, *SHORT)
    known = {key.rpartition(".")[2]: key for key in reversed(dotted_keys())} | dict(zip(fields, fields, strict=True))
    near = difflib.get_close_matches(name[:LONGEST_NAME], known, n=len(fields))
    # Of keys that are equally near, such as those of both rings, the first one.
    best = max(reversed(known), key=lambda key: difflib.SequenceMatcher(None, key, name[:LONGEST_NAME]).ratio())
    fix = f"did you mean {known[best]}?" if near else "rename or remove it"
    return f"column {one_line(name, LONGEST_NAME)}: unknown key; {fix}"


def dotted_keys() -> list[str]:
    """All keys of a scene of rollers, with their tables, that a cell can state: those of a value."""
    from rbdyn.scene.keys import keys

    return [key.key for key in keys({"scene": Scene}) if "[]" not in key.key and not key.values.startswith("list")]


def _rows(sheet: InputTable, keys: Mapping[str, str]) -> Iterator[SceneRow]:
    columns = {name: sheet.column(name) for name in (NAME, SCENE, DESIGNATION) if name in sheet}
    values, faults = dict[str, list[Any]](), dict[str, Iterator[str]]()
    for name, key in keys.items():
        # An empty cell is one of the choices, so it has a value.
        values[key], sentences = key_values(replace(sheet.column(name), name=key), ("",))
        faults[key] = iter(sentences)
    for row in range(len(sheet.rows)):
        texts = {name: column.texts[row] for name, column in columns.items()}
        stated = {key: column[row] for key, column in values.items() if column[row] != ""}
        bad = [next(faults[key]) for key, value in stated.items() if value is None]
        name, designation = texts.get(NAME) or str(row + 1), texts.get(DESIGNATION, "")
        file = sheet.path.parent / texts[SCENE] if texts.get(SCENE) else None
        yield SceneRow(row + 1, name, file, designation, stated, bad)


# Rows whose results are in memory at a time.
BATCH = 256
ROWS = "rows"


class RowFigures(Record):
    """Figures of a run: their ``names``, and ``numbers`` (3, n): values, statistical and numerical 95 % half-widths, NaN if unknown."""

    names: tuple[str, ...]
    numbers: Array


class RowRun(Record):
    """A row with the figures of its run and the dangers that it found, or with the ``cause`` of its failure."""

    row: SceneRow
    figures: RowFigures | None = None
    cause: str = ""
    dangers: Notes = ()

    @property
    def status(self) -> str:
        """Whether it is done or failed."""
        return FAILED if self.figures is None else DONE

    @property
    def failure(self) -> Failure:
        """The failure of the row under its name."""
        return Failure(self.row.name, self.cause, self.row.number)

    def value(self, name: str) -> float | None:
        """A figure of the run; None where it failed or has none of this name."""
        if self.figures is None or name not in self.figures.names:
            return None
        return finite(float(self.figures.numbers[0, self.figures.names.index(name)]))

    @property
    def cells(self) -> dict[str, Any]:
        """The row of a file: its keys, then each figure with the half-width of its 95 % interval."""
        cells: dict[str, Any] = {"name": self.row.name, STATUS: self.status, "fault": self.cause or None}
        cells["danger"] = "; ".join(self.dangers) or None
        cells |= {} if self.row.file is None else {SCENE: str(self.row.file)}
        cells |= {DESIGNATION: self.row.designation} if self.row.designation else {}
        cells |= self.row.values
        if self.figures is not None:
            errors = np.hypot(np.nan_to_num(self.figures.numbers[1]), np.nan_to_num(self.figures.numbers[2]))
            errors[np.isnan(self.figures.numbers[1])] = np.nan
            for name, value, error in zip(self.figures.names, self.figures.numbers[0], errors, strict=True):
                cells |= {name: finite(value), f"{name}_error": finite(error)}
        return cells

    def as_dict(self) -> dict[str, Any]:
        """The row in the JSON of the command."""
        record: dict[str, Any] = {"row": self.row.number, "name": self.row.name, "status": self.status}
        record |= {"keys": dict(self.row.values), "dangers": [str(note) for note in self.dangers]}
        if self.figures is not None:
            kinds = ("value", "statistical_error", "numerical_error")
            rows = zip(self.figures.names, self.figures.numbers.T.tolist(), strict=True)
            record["figures"] = {name: dict(zip(kinds, map(finite, numbers), strict=True)) for name, numbers in rows}
        return record


def table_digest(table: SceneTable) -> str:
    """Digest of a table: its rows, the files of their scenes and the overrides."""
    files = sorted({file for row in table.rows if (file := row.file or table.base) is not None})
    content = [file.read_bytes() if file.is_file() else b"" for file in files]
    rows = [(row.name, str(row.file), row.designation, dict(row.values), list(row.faults)) for row in table.rows]
    return digest_of(b"".join((json.dumps([rows, list(table.overrides)], default=str).encode(), *content)))


def rows_stage(table: SceneTable, rows: Sequence[SceneRow]) -> Stage:
    """The stage of these rows; the first sound row stands for the work of all."""
    for row in rows:
        try:
            return Stage.of(ROWS, len(rows), work_of(table.scene(row)))
        except InputError:
            continue
    return Stage(ROWS)


def run_rows(table: SceneTable, rows: Sequence[SceneRow], simulations: Simulations) -> Iterator[RowRun]:
    """Simulate rows, or read them from the store, in their order. Raises as ``Simulations.run``."""
    progress, size = simulations.progress(ROWS), BATCH if simulations.scheduler is None else 8 * BATCH
    for begin in range(0, len(rows), size):
        yield from _batch(table, rows[begin : begin + size], simulations, _onward(progress, begin, len(rows)))


def _onward(progress: Progress, begin: int, total: int) -> Progress:
    return lambda done, _: progress(begin + done, total)


def _batch(
    table: SceneTable, rows: Sequence[SceneRow], simulations: Simulations, progress: Progress
) -> Iterator[RowRun]:
    scenes, faults = dict[int, Scene](), dict[int, str]()
    for row in rows:
        try:
            scenes[row.number] = table.scene(row)
        except InputError as error:
            faults[row.number] = "; ".join(error.faults)
    labels = [row.name for row in rows if row.number in scenes]
    results = dict(zip(scenes, simulations.run([*scenes.values()], labels, progress), strict=True)) if scenes else {}
    names: dict[tuple[str, ...], tuple[str, ...]] = {}
    for row in rows:
        result = results.get(row.number)
        if isinstance(result, SimulationResult):
            # Rows of one kind share the names of their figures.
            keys = tuple(result.responses)
            figures = RowFigures(names.setdefault(keys, keys), arrays_of([*result.responses.values()])[:3])
            yield RowRun(row, figures, dangers=tuple(of_level(result.notes or (), DANGER)))
        else:
            yield RowRun(row, None, result.cause if isinstance(result, Failure) else faults[row.number])
