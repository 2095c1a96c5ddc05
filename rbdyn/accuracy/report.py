"""What a study hands over: one record, tables to print, sheets and pictures to write."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from rbdyn.result import versions, write_json


class Table(NamedTuple):
    """A table for the terminal; cells are text."""

    title: str
    header: Sequence[str]
    cells: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Report:
    """Outcome of a study: ``record`` becomes ``stem.json``, each sheet a CSV, each picture a PNG; ``failed``: the
    command ends with an error."""

    stem: str
    record: dict[str, Any]
    tables: Sequence[Table]
    sentences: Sequence[str]
    sheets: Mapping[str, Sequence[Mapping[str, Any]]]
    pictures: Mapping[str, Callable[[Path], None]] = field(default_factory=dict)
    failed: bool = False


class Progress:
    """Counts what is done out of a known total."""

    def __init__(self, told: Callable[[int, int], None] | None, total: int) -> None:
        self.told, self.total, self.done = told, total, 0

    def step(self) -> None:
        """One more is done."""
        self.done += 1
        if self.told is not None:
            self.told(self.done, self.total)


def record(form: str, **parts: Any) -> dict[str, Any]:
    """JSON of a study of this format: its parts, the machine and the versions."""
    return {"format": form, "status": "ok", **parts, "machine": processor(), "versions": versions()}


def write(report: Report, folder: Path) -> list[str]:
    """Write the record, the sheets and the pictures; returns the file names."""
    import pandas as pd

    files = [f"{report.stem}.json"]
    write_json(folder / files[0], report.record)
    for name, rows in report.sheets.items():
        files.append(f"{name}.csv")
        pd.DataFrame(rows).to_csv(folder / files[-1], index=False)
    for name, draw in report.pictures.items():
        files.append(f"{name}.png")
        draw(folder / files[-1])
    return files


def show(report: Report, verbose: bool = False) -> None:
    """Print tables, conclusions and the machine."""
    from rbdyn.cli.terminal import print_table

    for table in report.tables:
        print_table(*table)
    for sentence in report.sentences:
        print(sentence)
    print(report.record["machine"])
    if verbose:
        print(", ".join(f"{name} {text}" for name, text in report.record["versions"].items()))


def processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
