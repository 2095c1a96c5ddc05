"""Report of a study: one record, tables to print, sheets and pictures to write."""

import logging
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, field
from pathlib import Path
from typing import Any, TypeVar

from rbdyn.base import terminal
from rbdyn.base.blocks import Block, Detail, Paragraph, Table
from rbdyn.base.files import versions, write_json
from rbdyn.base.records import Record, save_table
from rbdyn.base.words import NOTABLE_S, counted, estimate
from rbdyn.compiled.kernel import COMPILING
from rbdyn.dynamics.ensemble import LOOK_S, Reporter

T = TypeVar("T")
LOGGER = logging.getLogger("rbdyn.accuracy")
# Keys of the scene that make a study shorter.
KEYS = ("numerics.turns", "numerics.replicates")


class Report(Record):
    """Outcome of a study: ``record`` becomes ``stem.json``, each sheet a CSV, each picture a PNG; ``failed``: the
    command ends with an error."""

    stem: str
    record: dict[str, Any]
    tables: Sequence[Table]
    sentences: Sequence[str]
    sheets: Mapping[str, Sequence[Mapping[str, Any]]]
    pictures: Mapping[str, Callable[[Path], None]] = field(default_factory=dict)
    failed: bool = False

    @property
    def blocks(self) -> list[Block]:
        """Tables, conclusions and the machine; in full detail also the versions."""
        used = ", ".join(f"{name} {text}" for name, text in self.record["versions"].items())
        sentences = map(Paragraph, (*self.sentences, self.record["machine"]))
        return [*self.tables, *sentences, Paragraph(used, detail=Detail.ALL)]


class Progress:
    """Counts steps, whose number is logged before the first and whose time after it.

    ``works``: of the steps, in any unit; a number of equal ones.
    """

    def __init__(self, report: Reporter, works: Sequence[float] | int) -> None:
        works = [1.0] * works if isinstance(works, int) else works
        self.report, self.total, self.count = report, len(works), 0
        self.works, self.started, self.estimated = works, self._now(), False
        LOGGER.info(counted(self.total, "step"))

    def step(self, *part: int) -> None:
        """Count one more step; the counts of a ``part`` itself do not matter."""
        self.count += 1
        spent_s = self._now() - self.started
        rest_s = spent_s * sum(self.works[self.count :]) / sum(self.works[: self.count])
        if not self.estimated and spent_s >= LOOK_S and rest_s >= NOTABLE_S:
            self.estimated = True
            LOGGER.info(estimate(rest_s, KEYS))
        if self.report is not None:
            self.report(self.count, self.total)

    def _now(self) -> float:
        """A clock [s] that stands still while something is compiled."""
        return time.perf_counter() - COMPILING.seconds

    def over(self, items: Iterable[T]) -> Iterator[T]:
        """The items; each counts as a step when the next one is requested."""
        for item in items:
            yield item
            self.step()


def records(rows: Iterable[Any]) -> list[dict[str, Any]]:
    """JSON of rows that are dataclasses."""
    return [asdict(row) for row in rows]


def flat(row: Mapping[str, Any], opened: str = "") -> dict[str, Any]:
    """A record without nesting, for a sheet: figures of a table within it become ``name_table``.

    Those of the table ``opened`` become plain ``name``.
    """
    row = {key: value for key, value in row.items() if key != opened} | (row.get(opened) or {})
    nested = {key: value for key, value in row.items() if isinstance(value, dict)}
    plain = {key: value for key, value in row.items() if key not in nested}
    return plain | {f"{name}_{key}": value for key, table in nested.items() for name, value in table.items()}


def record(form: str, **parts: Any) -> dict[str, Any]:
    """JSON of a study of this format: its parts, the machine and the versions."""
    return {"format": form, "status": "ok", **parts, "machine": processor(), "versions": versions()}


def reported(
    stem: str,
    tables: Sequence[Table],
    sentences: Sequence[str],
    sheet: Sequence[Mapping[str, Any]],
    draw: Callable[[Path], None] | None = None,
    form: str = "",
    **parts: Any,
) -> Report:
    """Report of one sheet and at most one picture, named like the format; ``parts`` go into the record."""
    pictures = {} if draw is None else {stem: draw}
    return Report(stem, record(form or f"rbdyn.{stem}/1", **parts), tables, sentences, {stem: sheet}, pictures)


def write(report: Report, folder: Path) -> list[str]:
    """Write the record, the sheets and the pictures; returns the file names."""
    files = [f"{report.stem}.json"]
    write_json(folder / files[0], report.record)
    for name, rows in report.sheets.items():
        files.append(f"{name}.csv")
        save_table(rows, folder / files[-1])
    for name, draw in report.pictures.items():
        files.append(f"{name}.png")
        draw(folder / files[-1])
    return files


def show(report: Report, verbose: bool = False) -> None:
    """Print the blocks of a report."""
    terminal.show(report.blocks, Detail.of(False, verbose))


def processor() -> str:
    """Name of the processor, as far as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
