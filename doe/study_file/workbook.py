"""Excel workbooks as tables: the cells of one sheet as texts, numbers with all their digits.

``file.xlsx:Sheet`` names a sheet; without a name it is the first one. openpyxl reads them and is imported only then.
"""

import re
import warnings
import zipfile
from collections.abc import Iterator
from datetime import date, datetime, time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from doe.study_file.decimal_marks import Exact
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, refuse

if TYPE_CHECKING:
    from openpyxl.workbook import Workbook

NAMED = re.compile(r"(.+\.xls[xm]):([^:]+)", re.IGNORECASE | re.DOTALL)
SUFFIXES = (".xlsx", ".xlsm")
# First bytes of a zip archive, which an .xlsx is, and of an old or encrypted workbook.
ARCHIVE, OLD = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
# Most bytes of a workbook's parts once they are unpacked, and most cells of a sheet.
LARGEST_PARTS, MOST_CELLS = 200_000_000, 4_000_000


class SheetCells(NamedTuple):
    """Texts of the cells, row by row, the number of each row in its sheet, and a note on which sheet was read."""

    rows: list[list[str]]
    numbers: list[int]
    note: str


def split_path(path: Path) -> tuple[Path, str | None]:
    """The file of a path, and the sheet that ``file.xlsx:Sheet`` names, if any."""
    named = None if path.exists() else NAMED.fullmatch(str(path))
    return (Path(named[1]), named[2]) if named else (path, None)


def read_workbook(path: Path, sheet: str | None) -> SheetCells:
    """The cells of a sheet. Raises InputError for a damaged, encrypted or old workbook, and a sheet that is not there."""
    _check_parts(path)
    book = _opened(path, as_values=True)
    names = [worksheet.title for worksheet in book.worksheets]
    listed = ", ".join(one_line(name, LONGEST_NAME) for name in names[:20])
    if not names:
        raise InputError([f"{path}: has no sheet with cells; save the table in one"])
    name = names[0] if sheet is None else next((name for name in names if name.lower() == sheet.lower()), None)
    if name is None:
        raise InputError([f"{path}: has no sheet {one_line(sheet or '', LONGEST_NAME)!r}; name one of {listed}"])
    rows = _cells(path, book, name)
    _refuse_uncalculated(path, name, rows)
    note = f"from sheet {one_line(name, LONGEST_NAME)!r}"
    if len(names) > 1 and sheet is None:
        note += f", the first of {len(names)} ({listed}); {path.name}:NAME names another"
    kept = [(number, [_text(value) for value in row]) for number, row in enumerate(rows, 1) if any(_filled(row))]
    return SheetCells([texts for _, texts in kept], [number for number, _ in kept], note)


def letters(place: int) -> str:
    """Letters of the column at a place, from 0."""
    before, last = divmod(place, 26)
    return (letters(before - 1) if before else "") + chr(ord("A") + last)


def _check_parts(path: Path) -> None:
    """Raises InputError for what is no workbook, or unpacks to too much."""
    with path.open("rb") as file:
        start = file.read(4)
    if start == OLD:
        raise InputError([f"{path}: is an encrypted or an old workbook (.xls); save it as .xlsx without a password"])
    if start != ARCHIVE:
        raise InputError([f"{path}: is no Excel workbook; give a table of text a name that ends in .csv"])
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
    # A damaged directory of parts can raise anything, too.
    except Exception:
        raise _damaged(path) from None
    if size > LARGEST_PARTS:
        raise InputError([f"{path}: unpacks to more than {LARGEST_PARTS / 1e6:g} MB; check that it is the right file"])


def _opened(path: Path, as_values: bool) -> "Workbook":
    """The workbook, with the saved values of its formulas or else their texts."""
    import openpyxl

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return openpyxl.load_workbook(path, read_only=True, data_only=as_values)
        except MemoryError:
            raise
        # A damaged part can raise anything in the library.
        except Exception:
            raise _damaged(path) from None


def _cells(path: Path, book: "Workbook", name: str) -> list[list[Any]]:
    """Values of a sheet's cells."""
    rows, count = list[list[Any]](), 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            worksheet = book[name]
            # The stated size may be the whole sheet.
            worksheet.reset_dimensions()
            for row in worksheet.iter_rows(values_only=True):
                values = _without_tail(list(row))
                rows.append(values)
                count += len(values)
                if count > MOST_CELLS:
                    break
        except MemoryError:
            raise
        except Exception:
            raise _damaged(path) from None
    if count > MOST_CELLS:
        raise InputError([f"{path}: sheet {name!r} has more than {MOST_CELLS} cells; keep the table alone"])
    return rows


def _damaged(path: Path) -> InputError:
    return InputError([f"{path}: is a damaged workbook; open it in Excel and save it anew"])


def _without_tail(row: list[Any]) -> list[Any]:
    while row and (row[-1] is None or row[-1] == ""):
        row.pop()
    return row


def _filled(row: list[Any]) -> Iterator[bool]:
    return (value is not None and str(value).strip() != "" for value in row)


def _refuse_uncalculated(path: Path, name: str, rows: list[list[Any]]) -> None:
    """Raises InputError for formulas whose values were not saved: their cells look empty."""
    formulas = _cells(path, _opened(path, as_values=False), name)
    refuse(
        f"{path}: cell {letters(place)}{number} of sheet {name!r}: has a formula without a saved value; open the file in "
        "Excel and save it"
        for number, row in enumerate(formulas, 1)
        for place, value in enumerate(row)
        if isinstance(value, str) and value.startswith("=") and _missing(rows, number - 1, place)
    )


def _missing(rows: list[list[Any]], row: int, place: int) -> bool:
    return row >= len(rows) or place >= len(rows[row]) or rows[row][place] is None


def _text(value: Any) -> str:
    """Text of a cell: a number with all its digits, dates as ISO 8601 has them."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return Exact(repr(value))
    if isinstance(value, datetime):
        return value.date().isoformat() if value.time() == time() else value.isoformat(" ")
    return value.isoformat() if isinstance(value, date | time) else str(value)
