"""Runs of a table of scenes: every row ends with its figures or the cause of its failure.

Rows are built and simulated in batches, so that memory does not grow with their results.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from doe.clearance import Simulations, work_of
from doe.running.runner import Progress, Stage
from doe.running.store import Cause, Failure, grouped
from doe.study_file.table import DONE, FAILED, STATUS
from doe.workflow.scene_table import SceneRow, SceneTable
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError
from rbdyn.base.files import digest_of
from rbdyn.base.records import finite
from rbdyn.result import SimulationResult, arrays_of
from rbdyn.scene import Scene

# Rows whose results are in memory at a time.
BATCH = 256
ROWS = "rows"


@dataclass(frozen=True)
class RowFigures:
    """Figures of a run: their ``names``, and ``numbers`` (3, n): values, statistical and numerical 95 % half-widths, NaN if unknown."""

    names: tuple[str, ...]
    numbers: Array

    def of(self, kind: int) -> dict[str, float | None]:
        """Numbers of a kind by name of the figure."""
        return dict(zip(self.names, map(finite, self.numbers[kind].tolist()), strict=True))


@dataclass(frozen=True)
class RowRun:
    """A row with the figures of its run, or with the ``cause`` of its failure."""

    row: SceneRow
    figures: RowFigures | None = None
    cause: str = ""

    @property
    def status(self) -> str:
        """Whether it is done or failed."""
        return FAILED if self.figures is None else DONE

    @property
    def failure(self) -> Failure:
        """The failure of the row under its name."""
        return Failure(self.row.name, self.cause, self.row.number)

    @property
    def cells(self) -> dict[str, Any]:
        """The row of a file: its keys, then each figure with the half-width of its 95 % interval."""
        cells: dict[str, Any] = {"name": self.row.name, STATUS: self.status, "fault": self.cause or None}
        cells |= {} if self.row.file is None else {"scene": str(self.row.file)}
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
        record |= {"keys": dict(self.row.values)}
        if self.figures is not None:
            values, statistical, numerical = (self.figures.of(kind) for kind in range(3))
            record["figures"] = {
                name: {"value": value, "statistical_error": statistical[name], "numerical_error": numerical[name]}
                for name, value in values.items()
            }
        return record


def causes_of(runs: Sequence[RowRun]) -> list[Cause]:
    """Failures of rows by cause, the most frequent first."""
    return grouped(run.failure for run in runs if run.figures is None)


def table_digest(table: SceneTable) -> str:
    """Digest of a table: its rows, the files of their scenes and the overrides."""
    files = sorted({file for row in table.rows if (file := row.file or table.base) is not None})
    content = [file.read_bytes() if file.is_file() else b"" for file in files]
    rows = [(row.name, str(row.file), dict(row.values), list(row.faults)) for row in table.rows]
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
            yield RowRun(row, figures)
        else:
            yield RowRun(row, None, faults[row.number] if result is None else result.cause)
