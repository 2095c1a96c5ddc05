"""Tables of a user: text with commas, semicolons or tabs in several encodings, and workbooks; cells by the names of columns.

All numbers are read by one reader with bounds. Only what can be read in one way is read, and a note says how where it is not UTF-8 with commas and decimal points.
"""

import csv
import io
import math
import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections import Counter
from collections.abc import Collection, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import LONGEST_NAME, MOST_FAULTS, InputError, not_utf_8, one_line, read_bytes, refuse
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import NUMBER, Record, plain_cell, quoted_cell
from rbdyn.base.tables.decimal_marks import POINT, Exact, Marks, is_like_number, marks_of
from rbdyn.base.words import all_of, counted

if TYPE_CHECKING:
    import pandas as pd

PARQUET = (".parquet", ".pq")
SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
SEMICOLONS = ", or save it with semicolons if its numbers have decimal commas"
WORKBOOKS, SHEET_PATH = (".xlsx", ".xlsm"), re.compile(r"(.+\.xls[xm]):([^:]+)", re.IGNORECASE | re.DOTALL)
# Endings by which a command that reads TOML too knows a table.
TABLES = (".csv", ".tsv", ".txt", *WORKBOOKS, *PARQUET)
# First bytes of an archive, as of a workbook, and of an old or encrypted workbook.
ARCHIVES = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
# Excel's own line on the separator of a file.
HINT = re.compile(r"\s*sep=([,;\t])\r?\n", re.IGNORECASE)
# Most rows and cells of a text; those of a workbook are fewer, for it takes ten times as long to read.
MOST_LINES, MOST_FIELDS = 1_000_000, 4_000_000
# Rows of another length than the header that are named one by one.
MOST_ROWS_NAMED = 2
# Characters of no text: a file with them is something else.
CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")


class Limits(NamedTuple):
    """Numbers that a column may have: up to ``most`` in magnitude, 0 or at least ``least``, with a ``sign``, whole or not."""

    most: float
    least: float = 0.0
    sign: Literal["any", "not negative", "positive"] = "any"
    integer: bool = False

    def fault(self, value: float) -> str:
        """The fault of a value outside the limits, with its fix."""
        if not math.isfinite(value) or (self.integer and value != round(value)):
            return f"is not a {'whole' if self.integer else 'finite'} number; write a plain one"
        if abs(value) > self.most:
            return f"is beyond {self.most:g}; check the unit"
        if value < 0.0 and self.sign == "not negative":
            return "is below 0; check the sign"
        if value <= 0.0 and self.sign == "positive":
            return "is not above 0; check the sign"
        return f"is nearer to 0 than {self.least:g}; check the unit"

    def contains(self, value: float) -> bool:
        """Whether a value is within the limits."""
        return not self.broken(np.array([value]))

    def broken(self, values: Array) -> list[int]:
        """Places of the values (n,) outside the limits."""
        size = np.abs(values)
        valid = (size <= self.most) & ((size >= self.least) | (size == 0.0))
        valid &= (values == np.round(values)) | (not self.integer)
        valid &= (values > 0.0) | ((values == 0.0) & (self.sign != "positive")) | (self.sign == "any")
        return np.flatnonzero(~valid).tolist()


class InputColumn(Record):
    """A column of a table: its ``name``, the stripped ``texts`` of its cells, and the ``marks`` of the table's numbers.

    ``cells``: names of the cells in a workbook.
    """

    path: Path
    name: str
    texts: Sequence[str]
    marks: Marks
    cells: Sequence[str] = ()

    @cached_property
    def plain(self) -> list[str]:
        """The texts with decimal points in numbers; empty for a number that may have two meanings."""
        return ["" if doubt else text for text, doubt in map(self.marks.plain, self.texts)]

    def doubt(self, row: int) -> str:
        """The reason why the number in ``row`` may have two meanings; empty for any other text."""
        return self.marks.plain(self.texts[row])[1]

    def fault(self, row: int, words: str, value: bool = True) -> str:
        """A sentence on the cell in ``row`` (from 0), with its text if ``value``; the sentence counts rows from 1."""
        text = self.texts[row]
        plain = bool(NUMBER.fullmatch(text)) and len(text) < LONGEST_NAME
        cell = f" = {text if plain else quoted(text)}" if value else ""
        place = f"row {row + 1} ({self.cells[row]})" if self.cells else f"row {row + 1}"
        return f"{self.path}: {one_line(self.name, LONGEST_NAME)} in {place}{cell}: {words}"

    def numbers(self, limits: Limits, unknown: Collection[str] = ()) -> tuple[Array, list[str]]:
        """Numbers (n,) of the cells, and a sentence for each cell without a number within the ``limits``.

        Cells whose text in lower case is in ``unknown`` are NaN, without a fault.
        """
        values = np.array([float(text) if is_number(text) else math.nan for text in self.plain])
        faults, doubts = list[str](), Counter[str]()
        for row in limits.broken(values):
            if self.texts[row].lower() in unknown:
                continue
            if len(faults) > MOST_FAULTS:
                # It is counted, but no message lists it.
                faults.append("")
                continue
            doubt = self.doubt(row)
            kind = doubt.partition(" ")[0]
            doubts[kind] += 1
            # One such cell shows how all of them are written.
            if not doubt or doubts[kind] == 1:
                faults.append(self.fault(row, doubt or _slip(self.texts[row]) or limits.fault(values[row])))
        return values, faults


class InputTable(Record):
    """A table as it is read: names of its columns, rows of fields as they are written, marks of its numbers, and how it was read
    (no words: the usual way).

    ``numbers``: the row of a workbook's sheet that each row is; empty for text.
    """

    path: Path
    header: list[str]
    rows: list[list[str]]
    marks: Marks
    manner: str
    numbers: Sequence[int] = ()

    @property
    def notes(self) -> Notes:
        """A note on how the table was read, where that is not UTF-8 with commas and decimal points."""
        return (Note("table", f"{self.path}: {self.manner}"),) if self.manner else ()

    @cached_property
    def places(self) -> dict[str, int]:
        """Place of each column with a name."""
        return {name: place for place, name in enumerate(self.header) if name}

    def __contains__(self, name: str) -> bool:
        return name in self.places

    def column(self, name: str) -> InputColumn:
        """The column of this name."""
        place = self.places[name]
        texts = [plain_cell(row[place].strip()) for row in self.rows]
        cells = list[str]()
        if self.numbers:
            from openpyxl.utils import get_column_letter

            cells = [f"cell {get_column_letter(place + 1)}{number}" for number in self.numbers]
        return InputColumn(self.path, name, texts, self.marks, cells)

    @property
    def nameless(self) -> list[int]:
        """Numbers, from 1, of columns with cells and no name."""
        places = [place for place, name in enumerate(self.header) if not name]
        return [place + 1 for place in places if any(row[place].strip() for row in self.rows)]

    def refuse_nameless(self) -> None:
        """Raises InputError for columns with cells and no name."""
        refuse(f"{self.path}: column {number} has no name; name it or remove it" for number in self.nameless)


def read_sheet(path: Path) -> InputTable:
    """Header and rows of a table of any of the formats, without blank rows and empty columns at the end.

    Raises InputError where it cannot be read in one way alone, has no rows, has a name twice, or a row has more or fewer fields
    than the header.
    """
    file, sheet = split_path(path)
    if file.suffix.lower() in PARQUET:
        return _table(path, _frame_rows(_parquet(file)), POINT, "", "")
    if file.suffix.lower() in WORKBOOKS:
        # openpyxl takes a fifth of a second to import.
        from rbdyn.base.tables.workbook import read_workbook

        table = read_workbook(file, read_bytes(file), sheet)
        rows, numbers = table.rows, table.numbers
        width = max(map(len, rows), default=0)
        rows = [[*row, *[""] * (width - len(row))] for row in rows]
        return _table(path, rows, None, "", table.note, numbers)
    data = read_bytes(file)
    if file.suffix.lower() == ".ods" or data.startswith(ARCHIVES):
        raise InputError(f"{path}: is not a text table; save it as .xlsx or as CSV, with that ending of its name")
    text, encoding = _decoded(path, data)
    separator, rows = _fields(path, text)
    words = "" if separator == "," else SEPARATORS.get(separator, "")
    return _table(path, rows, POINT if separator == "," else None, words, encoding)


def split_path(path: Path) -> tuple[Path, str | None]:
    """The file of a path, and the sheet that ``file.xlsx:Sheet`` names, if any."""
    named = None if path.exists() else SHEET_PATH.fullmatch(str(path))
    return (Path(named[1]), named[2]) if named else (path, None)


def sheet_of_frame(frame: "pd.DataFrame", path: Path) -> InputTable:
    """A frame as a table that messages call ``path``. Raises InputError as ``read_sheet``."""
    return _table(path, _frame_rows(frame), POINT, "", "")


def _table(
    path: Path, rows: list[list[str]], default: str | None, separator: str, origin: str, numbers: Sequence[int] = ()
) -> InputTable:
    """The table of rows of fields, the first of which is its header; ``separator`` and ``origin`` in words."""
    header, body = rows[0] if rows else [], rows[1:]
    if not header:
        raise InputError(f"{path}: is empty; write a header of names and a row for each run")
    marks = marks_of((field.strip() for row in body for field in row), default)
    _refuse_words(path, header, body)
    # Commas between fields are usual with decimal points; other files say which mark their numbers have.
    points = ["decimal points"] if default is None and marks.decimal == POINT else []
    signs = [*([separator] if separator else []), *points, *marks.words]
    words = [*([f"with {all_of(signs)}"] if signs else []), *([origin] if origin else [])]
    names = [plain_cell(name.strip()) for name in header]
    if len(names) == 1 and "|" in names[0]:
        raise InputError(f"{path}: has '|' between its fields; write commas there and points in numbers")
    repeated = {name: count for name, count in Counter(names).items() if count > 1 and name}
    faults = [f"{path}: column {quoted(name)} comes {count} times; keep one" for name, count in repeated.items()]
    if not body:
        faults.append(f"{path}: has a header and no rows; add a row for each run")
    refuse(faults)
    return InputTable(path, names, body, marks, f"read {' '.join(words)}" if words else "", numbers[1:])


def _parquet(path: Path) -> "pd.DataFrame":
    """The frame of a parquet file. Raises InputError where pandas cannot read it."""
    import pandas as pd

    data = read_bytes(path)
    try:
        return pd.read_parquet(io.BytesIO(data))
    except ImportError:
        raise InputError(f"{path}: pandas reads parquet with pyarrow; pip install pyarrow, or save it as CSV") from None
    except Exception as error:
        raise InputError(f"{path}: no parquet file ({one_line(str(error), LONGEST_NAME)}); save it again") from None


def _frame_rows(frame: "pd.DataFrame") -> list[list[str]]:
    """Header and rows of a frame as fields; missing values are empty."""
    columns = [map(_field, frame.iloc[:, place].tolist()) for place in range(frame.shape[1])]
    return [[str(name) for name in frame.columns], *map(list, zip(*columns, strict=True))]


def _field(value: Any) -> str:
    if value is None or value != value:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else Exact(repr(value) if isinstance(value, float) else str(value))


def _decoded(path: Path, data: bytes) -> tuple[str, str]:
    """The text of a file, and the encoding in words unless it is UTF-8. Raises InputError."""
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        try:
            return data.decode("utf-16"), "in UTF-16"
        except UnicodeDecodeError:
            raise InputError(f"{path}: cannot be read as UTF-16; save the file as UTF-8") from None
    if data[:1000].count(0) > len(data[:1000]) // 4:
        raise InputError(f"{path}: is not text in UTF-8; save the file as UTF-8")
    try:
        return data.decode("utf-8-sig"), ""
    except UnicodeDecodeError as error:
        refused = not_utf_8(path, data, error)
    try:
        text = data.decode("cp1252")
    except UnicodeDecodeError:
        raise refused from None
    if data.startswith(BOM_UTF8) or CONTROL.search(text):
        raise refused
    return text, "in Windows-1252"


def _fields(path: Path, text: str) -> tuple[str, list[list[str]]]:
    """The separator of a text, and its rows of fields. Raises InputError."""
    if hint := HINT.match(text):
        return hint[1], _tidy(path, _parsed(path, text[hint.end() :], hint[1]))
    widths = {mark: _width(text, mark) for mark in SEPARATORS}
    marks = sorted((mark for mark, width in widths.items() if width > 1), key=lambda mark: -widths[mark])
    if not marks:
        return _one_column(path, text)
    readings = dict[str, list[list[str]]]()
    for mark in marks:
        with suppress(InputError):
            readings[mark] = _tidy(path, _parsed(path, text, mark))
    if not readings:
        return marks[0], _tidy(path, _parsed(path, text, marks[0]))
    mark = max((mark for mark in SEPARATORS if mark in readings), key=lambda mark: _share_of_numbers(readings[mark]))
    return mark, readings[mark]


def _one_column(path: Path, text: str) -> tuple[str, list[list[str]]]:
    """A table of one column: its commas can only be decimal ones where every cell is such a number."""
    try:
        return ",", _tidy(path, _parsed(path, text, ","))
    except InputError:
        with_semicolon = _parsed(path, text, ";")
        if not all(is_like_number(row[0].strip()) for row in with_semicolon[1:]):
            raise
        return "", _tidy(path, with_semicolon)


def _width(text: str, separator: str) -> int:
    """Number of fields in the header."""
    try:
        rows = csv.reader(io.StringIO(text, newline=""), strict=True, delimiter=separator)
        return len(next(row for row in rows if any(field.strip() for field in row)))
    except (csv.Error, StopIteration):
        return 0


def _share_of_numbers(rows: list[list[str]]) -> float:
    """Share of the cells that are numbers or empty."""
    texts = [field.strip() for row in rows[1:] for field in row]
    return sum(not text or is_like_number(text) for text in texts) / max(len(texts), 1)


def _parsed(path: Path, text: str, separator: str) -> list[list[str]]:
    """Rows of fields, without blank lines. Raises InputError."""
    lines = csv.reader(io.StringIO(text, newline=""), strict=True, delimiter=separator)
    rows, start, fields = list[list[str]](), 1, 0
    try:
        for row in lines:
            fields += len(row)
            if fields > MOST_FIELDS or len(rows) >= MOST_LINES:
                most = f"{MOST_LINES} rows or {MOST_FIELDS} fields"
                raise InputError(f"{path}: has more than {most}; check that it is the right file")
            # A quoted empty field is a cell; a blank line, also one of separators, is none.
            if (len(row) == 1 and row[0] == "") or any(field.strip() for field in row):
                rows.append(row)
            start = lines.line_num + 1
    except csv.Error as error:
        fix = "close the quotes that open there" if "unexpected end" in str(error) else "fix that line"
        raise InputError(f"{path}: line {start}: is not CSV ({error}); {fix}") from None
    return rows


def _tidy(path: Path, rows: list[list[str]]) -> list[list[str]]:
    """Rows of equal length, without empty columns at the end. Raises InputError for rows of another length."""
    if not rows:
        raise InputError(f"{path}: is empty; write a header of names and a row for each run")
    lengths = [_filled_length(row) for row in rows]
    width = len(rows[0]) if any(lengths[0] < length <= len(rows[0]) for length in lengths) else max(lengths[0], 1)
    rows = [row[: max(width, length)] for row, length in zip(rows, lengths, strict=True)]
    wrong = [(number, len(row)) for number, row in enumerate(rows) if len(row) != width]
    # Of columns without a name every row is a case; one stands for them.
    others = f"; {len(wrong) - 1} more rows are like it" if len(wrong) > MOST_ROWS_NAMED else ""
    refuse(
        f"{path}: row {number} has {counted(length, 'field')} and the header {width}; give it a field for each column, "
        f"in their order{SEMICOLONS if length > width else ''}{others}"
        for number, length in (wrong[:1] if others else wrong)
    )
    return rows


def _filled_length(row: list[str]) -> int:
    """Length of a row without the empty fields at its end."""
    length = len(row)
    while length and not row[length - 1].strip():
        length -= 1
    return length


def _refuse_words(path: Path, header: list[str], body: list[list[str]]) -> None:
    """Raises InputError for a first row of words over columns of numbers: their units, or their names below a title."""
    if len(body) < 2:
        return
    places = [place for place, field in enumerate(body[0]) if field.strip()]
    words = [body[0][place].strip() for place in places]
    below = ([row[place].strip() for row in body[1:]] for place in places)
    numbers = [any(texts) and all(not text or is_like_number(text) for text in texts) for texts in below]
    if len(words) < 2 or any(map(is_like_number, words)) or not all(numbers):
        return
    if sum(bool(name.strip()) for name in header) < len(words):
        raise InputError(
            f"{path}: names columns such as {words[0]!r} below another row; remove the rows above the names"
        )
    raise InputError(
        f"{path}: row 1 has words where the others have numbers, such as {words[0]!r}; remove that row of units"
    )


WHOLE = re.compile(r"[+-]?\d+", re.ASCII)
# Characters of a number: every double has a shorter form, and Python converts no integer of thousands of digits.
LONGEST_NUMBER = 400
# Cells of an unknown number.
UNKNOWN = ("", "nan")
# Beginnings of a date, of a time of day or a span of time, and of a day and a month as Excel shows them in English or German.
DATE = re.compile(r"\d{1,4}([-/.])\d{1,2}\1\d{1,4}|\d{1,2}:\d\d")
SPAN = re.compile(r"-?\d+:\d\d(:\d\d)?", re.ASCII)
MONTH = "(?:jan|feb|m[aä]r|apr|ma[iy]|ju[nl]|aug|sep|o[ck]t|nov|de[cz])[a-zä]*"
DAY_AND_MONTH = re.compile(rf"\d{{1,2}}[-. ]{{1,2}}{MONTH}\b|{MONTH}[-. ]{{1,2}}\d", re.IGNORECASE)
# Most names that a message lists.
MOST_NAMES = 20


def is_number(text: str) -> bool:
    """Whether a text is a number of bounded length; it may still be larger than any double."""
    return len(text) <= LONGEST_NUMBER and NUMBER.fullmatch(text) is not None


def text_of(value: Any) -> Any:
    """Value for a CSV writer that reads back as the same: TOML's words for booleans, no formulas."""
    return str(value).lower() if isinstance(value, bool) else quoted_cell(value)


def listed(names: Collection[str]) -> str:
    """Names of columns for a message; of many only the first."""
    remainder = [f"{len(names) - MOST_NAMES} more"] if len(names) > MOST_NAMES else []
    return ", ".join([*(one_line(name, LONGEST_NAME) for name in islice(names, MOST_NAMES)), *remainder])


def quoted(text: str) -> str:
    """Text in quotes, cut where it is long."""
    return repr(one_line(text, LONGEST_NAME))


def _slip(text: str) -> str | None:
    """The slip that makes a text no number, with its fix; None for an unknown one."""
    if len(text) > LONGEST_NUMBER:
        return f"is longer than {LONGEST_NUMBER} characters; write a shorter number"
    if text.lower() in UNKNOWN:
        return "is not a finite number; fill it in or remove the row"
    if SPAN.fullmatch(text):
        return "is a time of day or a span of time; format the cell as a number and write a plain one"
    if DATE.match(text) or DAY_AND_MONTH.match(text):
        return "is a date, which Excel makes of numbers such as 1.2; format the cell as text and write the number again"
    if text.startswith("#"):
        return "is the fault of a formula; correct it in the spreadsheet"
    # A comma between words is no decimal one.
    comma = re.search(r"\d,\d", text)
    return "is not a finite number; write a point for the decimal comma" if comma else None
