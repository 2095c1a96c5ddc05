"""Excel workbooks as tables: the cells of one sheet as texts, numbers with all their digits.

``file.xlsx:Sheet`` names a sheet; without a name it is the first visible one. openpyxl reads the parts of the archive and its cells,
within bounds of bytes and of cells. Its reader of a sheet is extended, because only that sees formulas next to their saved values,
hidden rows, and rows in their order.
"""

import io
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, time, timedelta
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from openpyxl import load_workbook
from openpyxl.utils import get_column_letter, range_boundaries
from openpyxl.worksheet._reader import FORMULA_TAG, VALUE_TAG, WorkSheetParser

from rbdyn.base.faults import LONGEST_NAME, MOST_FAULTS, InputError, one_line, refuse
from rbdyn.base.tables.decimal_marks import Exact
from rbdyn.base.words import counted

# Most parts of a workbook; most bytes of a part once it is unpacked, and of a part above ``SMALL_PART`` most per packed one: cells
# have 10 to 30.
MOST_PARTS, LARGEST_PART, DENSEST_PART, SMALL_PART = 10_000, 50_000_000, 100, 1_000_000
# First bytes of a zip archive, which an .xlsx is, of an entry in its directory, and of an old or encrypted workbook.
ARCHIVE, ENTRY, OLD = b"PK\x03\x04", b"PK\x01\x02", b"\xd0\xcf\x11\xe0"
# Most rows with cells, columns, and cells of all rows up to the last column.
MOST_ROWS, MOST_COLUMNS, MOST_CELLS = 200_000, 16_384, 1_000_000
# Rows of a sheet, and characters of a cell.
LAST_ROW, LONGEST_CELL = 1_048_576, 32_767
# Numbers of the East Asian formats of dates, which have no code in a file.
DATE_FORMATS = {*range(27, 37), *range(50, 59)}
UNCALCULATED = "has a formula without a saved value; open the file in Excel and save it"


class SheetCells(NamedTuple):
    """Texts of the cells, row by row, the number of each row in its sheet, and a note on which sheet was read."""

    rows: list[list[str]]
    numbers: list[int]
    note: str


def read_workbook(path: Path, data: bytes, sheet: str | None) -> SheetCells:
    """The cells of a sheet of the workbook in ``data``.

    Raises InputError for a damaged, encrypted, old or too large workbook, a sheet that is not there, and formulas without values.
    """
    if data.startswith(OLD):
        raise InputError(f"{path}: is an encrypted or an old workbook (.xls); save it as .xlsx without a password")
    if not data.startswith(ARCHIVE):
        raise InputError(f"{path}: is not an Excel workbook; give a table of text a name that ends in .csv")
    with _damage_told(path, "its parts"):
        _refuse_large_parts(path, data)
        book = load_workbook(io.BytesIO(data), read_only=True, data_only=True)
    sheets = book.worksheets
    listed = ", ".join(one_line(item.title, LONGEST_NAME) for item in sheets[:20])
    if not sheets:
        raise InputError(f"{path}: has no sheet with cells; save the table in one")
    visible = [candidate for candidate in sheets if candidate.sheet_state == "visible"] or sheets
    named = (candidate for candidate in sheets if sheet is not None and candidate.title.lower() == sheet.lower())
    found = visible[0] if sheet is None else next(named, None)
    if found is None:
        raise InputError(f"{path}: has no sheet {one_line(sheet or '', LONGEST_NAME)!r}; name one of {listed}")
    place = f"sheet {one_line(found.title, LONGEST_NAME)!r}"
    with _damage_told(path, place), found._get_source() as source:
        cells = _Cells(path, source, book, found)
        cells.read()
    refuse(f"{path}: cell {cell} of {place}: {UNCALCULATED}" for cell in cells.uncalculated())
    note = f"from {place}"
    if cells.hidden:
        note += f" with its {counted(cells.hidden, 'hidden row')}"
    if len(sheets) > 1 and sheet is None:
        first = "first" if found is sheets[0] else "first visible"
        note += f", the {first} of {len(sheets)} ({listed}); {path.name}:NAME names another"
    return SheetCells(cells.rows, cells.numbers, note)


class DamageError(Exception):
    """A sheet that no spreadsheet writes; the message says where."""


@contextmanager
def _damage_told(path: Path, place: str) -> Iterator[None]:
    """Turn whatever damage at a place of a workbook raises in the libraries into an InputError."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (InputError, MemoryError):
        raise
    except Exception as error:
        where = f"{place}: {error}" if isinstance(error, DamageError) else place
        raise InputError(f"{path}: is a damaged workbook ({where}); open it in Excel and save it again") from None


def _refuse_large_parts(path: Path, data: bytes) -> None:
    # An entry of the directory takes half a kilobyte of memory.
    if data.count(ENTRY) > MOST_PARTS:
        raise _too_large(path, f"has more than {MOST_PARTS} parts")
    for part in zipfile.ZipFile(io.BytesIO(data)).infolist():
        if part.file_size > min(LARGEST_PART, max(SMALL_PART, DENSEST_PART * part.compress_size)):
            raise _too_large(path, f"part {part.filename} unpacks to {part.file_size / 1e6:.0f} MB")


def _too_large(path: Path, words: str) -> InputError:
    """The fault of a workbook beyond a bound."""
    return InputError(f"{path}: {words}; save the table alone in a new workbook or as CSV")


class _Cells(WorkSheetParser):
    """Cells of a sheet, row by row in ``rows`` with their ``numbers``; empty rows are left out.

    ``hidden``: number of rows with cells that a filter or the user has hidden.
    """

    def __init__(self, path: Path, source: Any, book: Any, sheet: Any) -> None:
        styles = book._cell_styles
        dates = {place for place, style in enumerate(styles) if style.numFmtId in DATE_FORMATS} | {*book._date_formats}
        super().__init__(source, sheet._shared_strings, True, book.epoch, dates, {*book._timedelta_formats})
        self.path, self.rows, self.numbers, self.hidden = path, list[list[str]](), list[int](), 0
        # Whether the program that wrote the formulas left their values to the next one.
        self._left = bool(book.calculation and book.calculation.fullCalcOnLoad)
        # Formulas without values, ranges that one formula fills, and empty texts among their values.
        self._missing, self._ranges, self._blank = list[str](), list[Any](), set[tuple[int, int]]()

    def read(self) -> None:
        """Read all rows. Raises InputError for a sheet beyond a bound, and DamageError for cells out of their order."""
        last, width = 0, 0
        for number, cells in self.parse():
            if not last < number <= LAST_ROW:
                raise DamageError(f"row number {number} after {last}")
            texts = list[str]()
            for cell in cells:
                if cell["row"] != number or cell["column"] <= len(texts):
                    raise DamageError(f"cell {_name(cell['row'], cell['column'])} in row {number}")
                if cell["column"] > MOST_COLUMNS:
                    raise _too_large(self.path, f"has more than {MOST_COLUMNS} columns")
                texts += [*[""] * (cell["column"] - 1 - len(texts)), _text(cell["value"])]
            last = number
            while texts and not texts[-1].strip():
                texts.pop()
            if not texts:
                continue
            self.rows.append(texts)
            self.numbers.append(number)
            self.hidden += self.row_dimensions.get(str(number), {}).get("hidden") in ("1", "true")
            width = max(width, len(texts))
            for count, most, words in (
                (len(self.rows), MOST_ROWS, "rows"),
                (len(self.rows) * width, MOST_CELLS, "cells"),
            ):
                if count > most:
                    raise _too_large(self.path, f"has more than {most} {words}")

    def parse_cell(self, element: Any) -> dict[str, Any]:
        """A cell as openpyxl reads it; formulas are noted."""
        cell: dict[str, Any] = super().parse_cell(element)
        formula, place = element.find(FORMULA_TAG), (cell["row"], cell["column"])
        is_blank = cell["value"] is None and element.get("t") == "str" and element.find(VALUE_TAG) is not None
        if formula is not None:
            if (self._left or (cell["value"] is None and not is_blank)) and len(self._missing) <= MOST_FAULTS:
                self._missing.append(_name(*place))
            if formula.get("t") in ("array", "dataTable") and len(self._ranges) < MOST_FAULTS:
                self._ranges.append(range_boundaries(formula.get("ref")))
        elif is_blank and self._ranges:
            self._blank.add(place)
        return cell

    def uncalculated(self) -> list[str]:
        """Names of cells with a formula, or within that of a range, that have no saved value; of many only the first."""
        rows = dict(zip(self.numbers, self.rows, strict=True))
        places = (
            (row, column)
            for left, top, right, bottom in self._ranges
            for row in range(top, bottom + 1)
            for column in range(left, right + 1)
        )
        empty = (
            _name(*place)
            for place in islice(places, MOST_CELLS)
            if not "".join(rows.get(place[0], [])[place[1] - 1 : place[1]]) and place not in self._blank
        )
        return list(dict.fromkeys([*self._missing, *islice(empty, MOST_FAULTS)]))


def _name(row: int, column: int) -> str:
    return f"{get_column_letter(column)}{row}"


def _text(value: Any) -> str:
    """Text of a cell: a number with the fewest digits that give its double, dates as ISO 8601 has them."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return Exact(str(value) if isinstance(value, int) and abs(value) < 10**15 else repr(float(value)))
    if isinstance(value, timedelta):
        minutes, seconds = divmod(round(abs(value.total_seconds())), 60)
        return f"{'-' if value < timedelta() else ''}{minutes // 60}:{minutes % 60:02}:{seconds:02}"
    if isinstance(value, datetime):
        return value.date().isoformat() if value.time() == time() else value.isoformat(" ")
    text = value.isoformat() if isinstance(value, time) else str("" if value is None else value)
    if len(text) > LONGEST_CELL:
        raise DamageError(f"a cell of more than {LONGEST_CELL} characters")
    return text
