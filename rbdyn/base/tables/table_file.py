"""Files of tables as they come: text with commas, semicolons or tabs in several encodings, and Excel workbooks.

Only what can be read in one way is read, and a note says how where it is not UTF-8 with commas and decimal points.
"""

import csv
import io
import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rbdyn.base.faults import InputError, not_utf_8, read_bytes, refuse
from rbdyn.base.tables.decimal_marks import POINT, Marks, is_like_number, marks_of
from rbdyn.base.tables.workbook import ARCHIVE, OLD, SUFFIXES, letters, read_workbook, split_path
from rbdyn.base.words import counted

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
SEMICOLONS = ", or save it with semicolons if its numbers have decimal commas"
# Excel's own line on the separator of a file.
HINT = re.compile(r"\s*sep=([,;\t])\r?\n", re.IGNORECASE)
# Most rows and cells of a text; those of a workbook are fewer, for it takes ten times as long to read.
MOST_LINES, MOST_FIELDS = 1_000_000, 4_000_000
# Rows of another length than the header that are named one by one.
MOST_ROWS_NAMED = 2
# Characters of no text: a file with them is something else.
CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")


@dataclass(frozen=True)
class TableFile:
    """Header and rows of a file's fields, its marks, how it was read (no words: the usual way), and its rows' cells.

    ``numbers``: the row of a workbook's sheet that each row is; empty for text.
    """

    header: list[str]
    rows: list[list[str]]
    marks: Marks
    manner: str
    numbers: Sequence[int] = ()

    def cell(self, row: int, place: int) -> str:
        """Name of a cell in its sheet; empty for text."""
        return f"cell {letters(place)}{self.numbers[row]}" if self.numbers else ""


def read_table_file(path: Path) -> TableFile:
    """Read a table of any of the formats. Raises InputError where none or more than one reading is possible."""
    file, sheet = split_path(path)
    if file.suffix.lower() in SUFFIXES:
        table = read_workbook(file, read_bytes(file), sheet)
        rows, numbers = table.rows, table.numbers
        width = max(map(len, rows), default=0)
        rows = [[*row, *[""] * (width - len(row))] for row in rows]
        return _table_file(path, rows, None, "", table.note, numbers)
    data = read_bytes(file)
    if file.suffix.lower() == ".ods" or data.startswith((ARCHIVE, OLD)):
        raise InputError([f"{path}: is no table of text; save it as .xlsx or as CSV, with that ending of its name"])
    text, encoding = _decoded(path, data)
    separator, rows = _fields(path, text)
    words = "" if separator == "," else SEPARATORS.get(separator, "")
    return _table_file(path, rows, POINT if separator == "," else None, words, encoding)


def _table_file(
    path: Path, rows: list[list[str]], default: str | None, separator: str, origin: str, numbers: Sequence[int] = ()
) -> TableFile:
    """The table of rows of fields, the first of which is its header; ``separator`` and ``origin`` in words."""
    header, body = rows[0] if rows else [], rows[1:]
    if not header:
        raise InputError([f"{path}: is empty; write a header of names and a row for each run"])
    marks = marks_of((field.strip() for row in body for field in row), default)
    _refuse_words(path, header, body)
    # Commas between fields are usual with decimal points; other files say which mark their numbers have.
    points = ["decimal points"] if default is None and marks.decimal == POINT else []
    signs = [*([separator] if separator else []), *points, *marks.words]
    together = " and ".join([*([", ".join(signs[:-1])] if signs[1:] else []), *signs[-1:]])
    words = [*([f"with {together}"] if signs else []), *([origin] if origin else [])]
    return TableFile(header, body, marks, f"read {' '.join(words)}" if words else "", numbers[1:])


def _decoded(path: Path, data: bytes) -> tuple[str, str]:
    """The text of a file, and the encoding in words unless it is UTF-8. Raises InputError."""
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        try:
            return data.decode("utf-16"), "in UTF-16"
        except UnicodeDecodeError:
            raise InputError([f"{path}: cannot be read as UTF-16; save the file as UTF-8"]) from None
    if data[:1000].count(0) > len(data[:1000]) // 4:
        raise InputError([f"{path}: is no text in UTF-8; save the file as UTF-8"])
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
                raise InputError([f"{path}: has more than {most}; check that it is the right file"])
            # A quoted empty field is a cell; a blank line, also one of separators, is none.
            if (len(row) == 1 and row[0] == "") or any(field.strip() for field in row):
                rows.append(row)
            start = lines.line_num + 1
    except csv.Error as error:
        fix = "close the quotes that open there" if "unexpected end" in str(error) else "fix that line"
        raise InputError([f"{path}: line {start}: is not CSV ({error}); {fix}"]) from None
    return rows


def _tidy(path: Path, rows: list[list[str]]) -> list[list[str]]:
    """Rows of equal length, without empty columns at the end. Raises InputError for rows of another length."""
    if not rows:
        raise InputError([f"{path}: is empty; write a header of names and a row for each run"])
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
            [f"{path}: names columns such as {words[0]!r} below another row; remove what is above the names"]
        )
    raise InputError(
        [f"{path}: row 1 has words where the others have numbers, such as {words[0]!r}; remove that row of units"]
    )
