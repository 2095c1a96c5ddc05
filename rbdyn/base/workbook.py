"""Tables of a folder as one workbook: a sheet with the identity of the result, then a sheet for each CSV file.

A table of more than ``MOST_CELLS``, such as a motion in time, stays in its CSV file, as the first sheet says: openpyxl takes
11 us a cell. Equal tables of one date give equal bytes. openpyxl is imported only when a workbook is written.
"""

import csv
import io
import re
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbdyn.base.identity import Identity, identity_table
from rbdyn.base.records import NUMBER

if TYPE_CHECKING:
    from openpyxl import Workbook

NAME = "tables.xlsx"
FIRST = "identity"
# Characters of a sheet's name, and those that no spreadsheet accepts in it.
LONGEST_SHEET, ILLEGAL = 31, re.compile(r"[\\/*?:\[\]\x00-\x1f]")
# Characters that no cell can hold.
CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
# Numbers that a cell cannot hold.
NOT_FINITE = {"nan": None, "inf": "inf", "-inf": "-inf"}
MOST_CELLS = 50_000
WIDEST_COLUMN, ENTRIES_LEFT_FREE = 40, 2
CHANGED = re.compile(rb"(<dcterms:modified[^>]*>)[^<]*")


def write_workbook(path: Path, files: Iterable[Path], identity: Identity) -> None:
    """Write the workbook of CSV files; columns of numbers are numbers. Raises OSError."""
    from openpyxl import Workbook
    from openpyxl.writer.excel import ExcelWriter

    day = datetime.fromisoformat(identity.date)
    book = Workbook(write_only=True)
    book.properties.title, book.properties.creator, book.properties.created = identity.title, "rbdyn", day
    tables, long = dict[str, list[list[str]]](), dict[str, str]()
    for file in files:
        rows, cells = _size(file)
        if cells > MOST_CELLS:
            long[file.name] = f"{rows - 1} rows, in this file only"
        else:
            tables[file.name] = [*_rows(file)]
    _sheet(book, FIRST, [("property", "value"), *identity_table(identity).rows, *long.items()])
    sheets = [FIRST]
    for name, table in tables.items():
        sheets.append(sheet_name(Path(name).stem, sheets))
        _sheet(book, sheets[-1], _typed(table))
    written = io.BytesIO()
    ExcelWriter(book, _Archive(written, day)).save()
    path.write_bytes(written.getvalue())


class _Archive(zipfile.ZipFile):
    """The archive of a workbook, with one date in place of the clock, so that equal tables are equal bytes.

    An archive knows no year before 1980 or after 2107.
    """

    def __init__(self, target: io.BytesIO, day: datetime) -> None:
        super().__init__(target, "w", zipfile.ZIP_DEFLATED)
        self._changed = day.strftime("%Y-%m-%dT%H:%M:%SZ").encode()
        self._date = (min(max(day.year, 1980), 2107), day.month, day.day, 0, 0, 0)

    def writestr(self, zinfo_or_arcname: Any, data: Any, *_: Any, **__: Any) -> None:
        entry = zipfile.ZipInfo(zinfo_or_arcname, self._date)
        entry.compress_type = zipfile.ZIP_DEFLATED
        content = data.encode() if isinstance(data, str) else data
        super().writestr(entry, CHANGED.sub(rb"\g<1>" + self._changed, content))

    def write(self, filename: Any, arcname: Any = None, *_: Any, **__: Any) -> None:
        self.writestr(arcname, Path(filename).read_bytes())


def _rows(path: Path) -> Iterator[list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        yield from csv.reader(file)


def _size(path: Path) -> tuple[int, int]:
    """Numbers of rows, with the header, and of cells of a table."""
    lengths = [len(row) for row in _rows(path)]
    return len(lengths), sum(lengths)


def sheet_name(name: str, taken: Sequence[str]) -> str:
    """A legal name for a sheet that no other of the workbook has; capitals do not count."""
    legal = ILLEGAL.sub("_", name).strip("'") or "table"
    lower, short, number = {other.lower() for other in taken}, legal[:LONGEST_SHEET], 1
    while short.lower() in lower:
        number += 1
        short = f"{legal[: LONGEST_SHEET - len(str(number)) - 1]}_{number}"
    return short


def _typed(rows: Sequence[Sequence[str]]) -> Iterator[Sequence[Any]]:
    """The rows of a table under its header, the cells of columns of numbers as numbers."""
    if not rows:
        return
    header, *body = rows
    numeric = [
        all(not cell or cell in NOT_FINITE or NUMBER.fullmatch(cell) for cell in column)
        for column in zip(*body, strict=True)
    ]
    yield header
    for row in body:
        yield [_number(cell) if number else cell for cell, number in zip(row, numeric, strict=True)]


def _number(cell: str) -> float | int | str | None:
    if not cell or cell in NOT_FINITE:
        return NOT_FINITE.get(cell)
    return int(cell) if cell.lstrip("+-").isdigit() and len(cell) < 16 else float(cell)


def _sheet(book: "Workbook", name: str, rows: Iterable[Sequence[Any]]) -> None:
    """A sheet whose header is bold and stays in view."""
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    sheet = book.create_sheet(name)
    rows = iter(rows)
    header = [str(cell) for cell in next(rows, ())]
    sheet.freeze_panes = "A2"
    for place, words in enumerate(header, 1):
        width = WIDEST_COLUMN if name == FIRST else min(len(words) + ENTRIES_LEFT_FREE, WIDEST_COLUMN)
        sheet.column_dimensions[get_column_letter(place)].width = width
    cells = [WriteOnlyCell(sheet, _text(words)) for words in header]
    for cell in cells:
        cell.font = Font(bold=True)
    sheet.append(cells)
    for row in rows:
        sheet.append([_text(cell) if isinstance(cell, str) else cell for cell in row])


def _text(cell: str) -> str | None:
    """The text of a cell, which no spreadsheet takes for a formula."""
    text = CONTROL.sub(" ", cell)
    return f"'{text}" if text.startswith("=") else text or None
