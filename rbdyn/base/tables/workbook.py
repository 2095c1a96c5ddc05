"""Excel workbooks as tables: the cells of one sheet as texts, numbers with all their digits.

``file.xlsx:Sheet`` names a sheet; without a name it is the first visible one. Only the parts that hold its cells are read, within
bounds of bytes and seconds, so that no file takes long or much memory: it is an archive of XML files, unpacked and parsed piece
by piece.
"""

import io
import posixpath
import re
import zipfile
from collections.abc import Callable, Mapping
from datetime import datetime, time, timedelta
from itertools import islice
from pathlib import Path
from time import thread_time
from typing import Any, NamedTuple
from xml.parsers import expat

from rbdyn.base.faults import LARGEST_FILE, LONGEST_NAME, MOST_FAULTS, InputError, one_line, refuse
from rbdyn.base.records import NUMBER
from rbdyn.base.tables.decimal_marks import Exact
from rbdyn.base.words import counted

# Most parts, most bytes of a part once it is unpacked, and most bytes of a single tag or comment, deepest nesting of tags.
MOST_PARTS, LARGEST_PART, LONGEST_TAG, DEEPEST, PIECE = 10_000, 50_000_000, 1_000_000, 100, 65536
# Seconds of processor time that a part may take; a sheet as large as the bounds takes five.
LONGEST_S = 8.0
ENTRY = b"PK\x01\x02"
WAYS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)

Start = Callable[[str, Mapping[str, str]], None]


class DamageError(Exception):
    """A workbook that no spreadsheet writes; the message says where."""


class Parts:
    """The parts of a workbook with ``data``. Every method raises InputError for a damaged or too large one."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self._end = path, thread_time() + LONGEST_S
        # An entry of the directory takes half a kilobyte of memory.
        if data.count(ENTRY) > MOST_PARTS:
            raise self.too_large(f"has more than {MOST_PARTS} parts")
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
        # A damaged directory of parts can raise anything.
        except Exception:
            raise self.damaged("its archive") from None

    def damaged(self, place: str) -> InputError:
        """The fault of a workbook that is damaged at a place."""
        return InputError(f"{self.path}: is a damaged workbook ({place}); open it in Excel and save it again")

    def too_large(self, words: str) -> InputError:
        """The fault of a workbook beyond a bound."""
        return InputError(f"{self.path}: {words}; save the table alone in a new workbook or as CSV")

    def related(self, name: str) -> dict[str, tuple[str, str]]:
        """Kind and name by identity of the parts that a part refers to; of the whole archive for an empty name."""
        folder, file = posixpath.split(name)
        parts = dict[str, tuple[str, str]]()

        def start(tag: str, keys: Mapping[str, str]) -> None:
            if tag == "Relationship" and keys.get("TargetMode") != "External":
                target = posixpath.normpath(posixpath.join("/", folder, keys.get("Target", ""))).lstrip("/")
                parts[keys.get("Id", "")] = keys.get("Type", "").rpartition("/")[2], target

        self.parse(posixpath.join(folder, "_rels", f"{file}.rels"), start)
        return parts

    def parse(
        self,
        name: str,
        start: Start,
        end: Callable[[str], None] | None = None,
        text: Callable[[str], None] | None = None,
    ) -> None:
        """Read a part; ``start``, ``end`` and ``text`` get its tags, with local names and keys, and its text."""
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        depth = 0

        def started(tag: str, keys: Mapping[str, str]) -> None:
            nonlocal depth
            depth += 1
            if depth > DEEPEST:
                raise DamageError
            start(tag.rpartition(" ")[2], keys)

        def ended(tag: str) -> None:
            nonlocal depth
            depth -= 1
            if end is not None:
                end(tag.rpartition(" ")[2])

        def refuse(*declaration: object) -> None:
            raise DamageError

        parser.StartElementHandler, parser.EndElementHandler = started, ended
        if text is not None:
            parser.CharacterDataHandler = text
        # A workbook declares no entities: these could multiply a text without bound.
        parser.StartDoctypeDeclHandler = refuse
        try:
            info = self._archive.getinfo(name)
            if info.file_size > LARGEST_PART:
                raise self.too_large(f"part {name} unpacks to more than {LARGEST_PART / 1e6:g} MB")
            if info.compress_type not in WAYS:
                raise self.damaged(f"part {name}")
            with self._archive.open(info) as file:
                fed = 0
                while piece := file.read(PIECE):
                    parser.Parse(piece, False)
                    fed += len(piece)
                    if fed - parser.CurrentByteIndex > LONGEST_TAG:
                        raise DamageError
                    if thread_time() > self._end:
                        raise self.too_large(f"takes longer than {LONGEST_S:g} s to read")
                parser.Parse(b"", True)
        except (InputError, MemoryError):
            raise
        except DamageError as damage:
            raise self.damaged(f"part {name}{damage}") from None
        # A damaged part can raise anything in the libraries.
        except Exception:
            raise self.damaged(f"part {name}") from None


SHEET_PATH = re.compile(r"(.+\.xls[xm]):([^:]+)", re.IGNORECASE | re.DOTALL)
SUFFIXES = (".xlsx", ".xlsm")
# First bytes of a zip archive, which an .xlsx is, and of an old or encrypted workbook.
ARCHIVE, OLD = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
# Most rows with cells, columns, and cells of all rows up to the last column.
MOST_ROWS, MOST_COLUMNS, MOST_CELLS = 200_000, 16_384, 1_000_000
# Rows of a sheet, characters of a cell and of a format, sheets and formats that a workbook has at most.
LAST_ROW, LONGEST_CELL, LONGEST_FORMAT, MOST_SHEETS, MOST_FORMATS = 1_048_576, 32_767, 1000, 10_000, 65_536
PLACE = re.compile(r"([A-Z]{1,3})([0-9]{1,7})", re.ASCII)
# Numbers of the East Asian formats of dates, which have no code in a file.
DATE_FORMATS = {*range(27, 37), *range(50, 59)}
UNCALCULATED = "has a formula without a saved value; open the file in Excel and save it"


class SheetCells(NamedTuple):
    """Texts of the cells, row by row, the number of each row in its sheet, and a note on which sheet was read."""

    rows: list[list[str]]
    numbers: list[int]
    note: str


class _Listed(NamedTuple):
    """A sheet of a workbook: its name, the part with its cells, and whether it is visible."""

    name: str
    part: str
    visible: bool


class _Book(NamedTuple):
    """Sheets, the kind of each format of cells ("", "date" or "span"), the texts that cells share, the day 0 of dates, and
    whether the program that wrote the formulas left their values to the next one.
    """

    sheets: list[_Listed]
    kinds: list[str]
    shared: list[str]
    epoch: datetime
    uncalculated: bool


def split_path(path: Path) -> tuple[Path, str | None]:
    """The file of a path, and the sheet that ``file.xlsx:Sheet`` names, if any."""
    named = None if path.exists() else SHEET_PATH.fullmatch(str(path))
    return (Path(named[1]), named[2]) if named else (path, None)


def read_workbook(path: Path, data: bytes, sheet: str | None) -> SheetCells:
    """The cells of a sheet of the workbook in ``data``.

    Raises InputError for a damaged, encrypted, old or too large workbook, a sheet that is not there, and formulas without values.
    """
    if data.startswith(OLD):
        raise InputError(f"{path}: is an encrypted or an old workbook (.xls); save it as .xlsx without a password")
    if not data.startswith(ARCHIVE):
        raise InputError(f"{path}: is not an Excel workbook; give a table of text a name that ends in .csv")
    parts = Parts(path, data)
    book = _book(parts)
    listed = ", ".join(one_line(item.name, LONGEST_NAME) for item in book.sheets[:20])
    if not book.sheets:
        raise InputError(f"{path}: has no sheet with cells; save the table in one")
    visible = [candidate for candidate in book.sheets if candidate.visible] or book.sheets
    named = (candidate for candidate in book.sheets if sheet is not None and candidate.name.lower() == sheet.lower())
    found = visible[0] if sheet is None else next(named, None)
    if found is None:
        raise InputError(f"{path}: has no sheet {one_line(sheet or '', LONGEST_NAME)!r}; name one of {listed}")
    cells = _Cells(parts, book)
    parts.parse(found.part, cells.start, cells.end, cells.text)
    place = f"of sheet {one_line(found.name, LONGEST_NAME)!r}"
    refuse(f"{path}: cell {name} {place}: {UNCALCULATED}" for name in cells.uncalculated())
    note = f"from sheet {one_line(found.name, LONGEST_NAME)!r}"
    if cells.hidden:
        note += f" with its {counted(cells.hidden, 'hidden row')}"
    if len(book.sheets) > 1 and sheet is None:
        first = "first" if found is book.sheets[0] else "first visible"
        note += f", the {first} of {len(book.sheets)} ({listed}); {path.name}:NAME names another"
    return SheetCells(cells.rows, cells.numbers, note)


def letters(place: int) -> str:
    """Letters of the column at a place, from 0."""
    before, last = divmod(place, 26)
    return (letters(before - 1) if before else "") + chr(ord("A") + last)


def _column(text: str) -> int:
    """Place, from 0, of the column of these letters."""
    place = 0
    for letter in text:
        place = 26 * place + ord(letter) - ord("A") + 1
    return place - 1


def _number_of(text: str) -> int:
    """The whole number of a place or a format; -1 for any other text."""
    return int(text) if text.isdecimal() and len(text) < 8 else -1


def _book(parts: Parts) -> _Book:
    """What the sheets of a workbook share."""
    main = next((name for kind, name in parts.related("").values() if kind == "officeDocument"), "xl/workbook.xml")
    related = parts.related(main)
    sheets, switches = list[_Listed](), set[str]()

    def start(tag: str, keys: Mapping[str, str]) -> None:
        if tag == "sheet":
            local = {key.rpartition(" ")[2]: value for key, value in keys.items()}
            kind, name = related.get(local.get("id", ""), ("", ""))
            if kind == "worksheet":
                sheets.append(_Listed(local.get("name", ""), name, local.get("state", "visible") == "visible"))
            if len(sheets) > MOST_SHEETS:
                raise parts.too_large(f"has more than {MOST_SHEETS} sheets")
        switches.update(key for key in ("date1904", "fullCalcOnLoad") if keys.get(key) in ("1", "true"))

    parts.parse(main, start)
    names = {kind: name for kind, name in related.values()}
    shared = _Texts(parts)
    if "sharedStrings" in names:
        parts.parse(names["sharedStrings"], shared.start, shared.end, shared.text)
    kinds = _kinds(parts, names["styles"]) if "styles" in names else []
    epoch = datetime(1904, 1, 1) if "date1904" in switches else datetime(1899, 12, 30)
    return _Book(sheets, kinds, shared.texts, epoch, "fullCalcOnLoad" in switches)


def _kinds(parts: Parts, name: str) -> list[str]:
    """The kind of each format of cells: dates, spans of time, or anything else."""
    codes, formats, inside = dict[str, str](), list[str](), list[str]()

    def start(tag: str, keys: Mapping[str, str]) -> None:
        if tag == "numFmt":
            codes[keys.get("numFmtId", "")] = keys.get("formatCode", "")[:LONGEST_FORMAT]
        if tag == "xf" and inside:
            formats.append(keys.get("numFmtId", "0"))
        if tag == "cellXfs":
            inside.append(tag)
        if max(len(codes), len(formats)) > MOST_FORMATS:
            raise parts.too_large(f"has more than {MOST_FORMATS} formats of cells")

    def end(tag: str) -> None:
        if tag == "cellXfs":
            inside.clear()

    parts.parse(name, start, end)
    kinds = {number: _kind(number, codes.get(number)) for number in set(formats)}
    return [kinds[number] for number in formats]


def _kind(number: str, code: str | None) -> str:
    """The kind of the format with a number, and a code unless it is one of Excel's own."""
    if number == "0":
        return ""
    if _number_of(number) in DATE_FORMATS:
        return "date"
    from openpyxl.styles import numbers

    code = numbers.BUILTIN_FORMATS.get(_number_of(number), "General") if code is None else code
    return "span" if numbers.is_timedelta_format(code) else "date" if numbers.is_date_format(code) else ""


class _Texts:
    """Texts that cells share, in ``texts``, as their part is parsed."""

    tag = "si"

    def __init__(self, parts: Parts) -> None:
        self.parts, self.texts = parts, list[str]()
        self._pieces, self._length, self._open, self._spoken = list[str](), 0, False, False

    def start(self, tag: str, keys: Mapping[str, str]) -> None:
        """A tag begins."""
        if tag == self.tag:
            self._pieces, self._length = [], 0
        elif tag == "rPh":
            # How a text is spoken is no part of it.
            self._spoken = True
        elif tag in ("t", "v"):
            self._open = not self._spoken

    def text(self, piece: str) -> None:
        """A piece of text within a tag."""
        if self._open:
            self._pieces.append(piece)
            self._length += len(piece)
            if self._length > LONGEST_CELL:
                raise DamageError(f": a cell of more than {LONGEST_CELL} characters")

    def end(self, tag: str) -> None:
        """A tag ends."""
        if tag == self.tag:
            self.keep("".join(self._pieces))
        elif tag == "rPh":
            self._spoken = False
        elif tag in ("t", "v"):
            self._open = False

    def keep(self, text: str) -> None:
        """Take up a whole text."""
        self.texts.append(text)
        if len(self.texts) > MOST_CELLS:
            raise self.parts.too_large(f"has more than {MOST_CELLS} texts")


class _Cells(_Texts):
    """Cells of a sheet, row by row in ``rows`` with their ``numbers``, as its part is parsed; empty rows are left out.

    ``hidden``: number of rows with cells that a filter or the user has hidden.
    """

    tag = "c"

    def __init__(self, parts: Parts, book: _Book) -> None:
        super().__init__(parts)
        self.book, self.rows, self.numbers, self.hidden = book, list[list[str]](), list[int](), 0
        self._row, self._number, self._column = list[str](), 0, -1
        self._keys: Mapping[str, str] = {}
        self._hides, self._formula, self._has_value = False, False, False
        self._characters, self._width = 0, 0
        # Formulas without values, corners of the ranges that one formula fills, and empty texts among their values.
        self._missing, self._ranges, self._blank = list[str](), list[tuple[Any, Any]](), set[tuple[int, int]]()

    def start(self, tag: str, keys: Mapping[str, str]) -> None:
        """A tag begins."""
        super().start(tag, keys)
        if tag == "c":
            self._keys, self._formula, self._has_value = keys, False, False
            self._begin_cell(keys.get("r"))
        elif tag == "v":
            self._has_value = True
        elif tag == "f":
            self._formula = True
            corners = [PLACE.fullmatch(corner) for corner in keys.get("ref", "").split(":")]
            if keys.get("t") in ("array", "dataTable") and len(self._ranges) < MOST_FAULTS and all(corners):
                self._ranges.append((corners[0], corners[-1]))
        elif tag == "row":
            number = keys.get("r", str(self._number + 1))
            if not self._number < _number_of(number) <= LAST_ROW:
                raise DamageError(f": row number {one_line(number, LONGEST_NAME)} after {self._number}")
            self._row, self._number, self._column = [], _number_of(number), -1
            self._hides = keys.get("hidden") in ("1", "true")

    def end(self, tag: str) -> None:
        """A tag ends."""
        super().end(tag)
        if tag == "row":
            self._end_row()

    def keep(self, text: str) -> None:
        """Take up the value of a cell."""
        row, column = self._row, self._column
        value = self._value(text)
        has_value = value != "" or (self._has_value and self._keys.get("t") == "str")
        if self._formula and (self.book.uncalculated or not has_value) and len(self._missing) <= MOST_FAULTS:
            self._missing.append(f"{letters(column)}{self._number}")
        if value != "":
            row += [""] * (column - len(row))
            row.append(value)
            self._characters += len(value)
            if self._characters > LARGEST_FILE:
                raise self.parts.too_large(f"has more than {LARGEST_FILE / 1e6:g} million characters in its cells")
        elif has_value and self._ranges and len(self._blank) < MOST_ROWS:
            self._blank.add((self._number, column))

    def uncalculated(self) -> list[str]:
        """Names of cells with a formula, or within that of a range, that have no saved value; of many only the first."""
        rows = dict(zip(self.numbers, self.rows, strict=True))
        places = (
            (row, column)
            for first, last in self._ranges
            for row in range(int(first[2]), int(last[2]) + 1)
            for column in range(_column(first[1]), _column(last[1]) + 1)
        )
        empty = (
            f"{letters(column)}{row}"
            for row, column in islice(places, MOST_CELLS)
            if (column >= len(cells := rows.get(row, [])) or cells[column] == "") and (row, column) not in self._blank
        )
        return list(dict.fromkeys([*self._missing, *islice(empty, MOST_FAULTS)]))

    def _begin_cell(self, reference: str | None) -> None:
        if reference is None:
            self._column += 1
        else:
            place = PLACE.fullmatch(reference)
            column = _column(place[1]) if place else -1
            if place is None or int(place[2]) != self._number or column <= self._column:
                raise DamageError(f": cell {one_line(reference, LONGEST_NAME)} in row {self._number}")
            self._column = column
        if self._column >= MOST_COLUMNS:
            raise self.parts.too_large(f"has more than {MOST_COLUMNS} columns")

    def _end_row(self) -> None:
        row = self._row
        while row and not row[-1].strip():
            row.pop()
        if not row:
            return
        self.rows.append(row)
        self.numbers.append(self._number)
        self.hidden += self._hides
        self._width = max(self._width, len(row))
        for count, most, words in (
            (len(self.rows), MOST_ROWS, "rows"),
            (len(self.rows) * self._width, MOST_CELLS, "cells"),
        ):
            if count > most:
                raise self.parts.too_large(f"has more than {most} {words}")

    def _value(self, text: str) -> str:
        """Text of a cell: a number with all its digits, dates as ISO 8601 has them."""
        kind = self._keys.get("t", "n")
        if kind == "s":
            place = _number_of(text.strip())
            if not 0 <= place < len(self.book.shared):
                raise DamageError(f": shared text of cell {letters(self._column)}{self._number}")
            return self.book.shared[place]
        if kind == "b":
            return {"1": "true", "0": "false"}.get(text.strip(), text)
        if kind != "n" or not (text := text.strip()):
            return text
        if not NUMBER.fullmatch(text):
            raise DamageError(f": number of cell {letters(self._column)}{self._number}")
        style, kinds = _number_of(self._keys.get("s", "0")), self.book.kinds
        form = kinds[style] if 0 <= style < len(kinds) else ""
        return _time(float(text), form, self.book.epoch) if form else Exact(_number(text))


def _number(text: str) -> str:
    """A number with the fewest digits that give its double; a whole number as it is."""
    return text if text.isdecimal() and len(text) < 16 else repr(float(text))


def _time(value: float, form: str, epoch: datetime) -> str:
    """Text of a date or a span of time, stored as a number of days."""
    from openpyxl.utils.datetime import from_excel

    try:
        moment = from_excel(value, epoch, timedelta=form == "span")
    except (OverflowError, ValueError):
        return f"#{value!r}"
    if isinstance(moment, timedelta):
        minutes, seconds = divmod(round(abs(moment.total_seconds())), 60)
        return f"{'-' if value < 0.0 else ''}{minutes // 60}:{minutes % 60:02}:{seconds:02}"
    if isinstance(moment, datetime):
        return moment.date().isoformat() if moment.time() == time() else moment.isoformat(" ")
    return moment.isoformat()
