"""Sheets of tables: cells by the names of their columns, and all numbers by one reader with bounds."""

import math
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import LONGEST_NAME, MOST_FAULTS, InputError, one_line, refuse
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import NUMBER, plain_cell, quoted_cell
from rbdyn.base.tables.decimal_marks import Marks
from rbdyn.base.tables.table_file import TableFile, read_table_file

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


class Limits(NamedTuple):
    """Numbers that a column may have: up to ``most`` in magnitude, 0 or at least ``least``, with a ``sign``, whole or not."""

    most: float
    least: float = 0.0
    sign: Literal["any", "not negative", "positive"] = "any"
    whole: bool = False

    def fault(self, value: float) -> str:
        """The fault of a value outside the limits, with its fix."""
        if not math.isfinite(value) or (self.whole and value != round(value)):
            return f"is not a {'whole' if self.whole else 'finite'} number; write a plain one"
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
        valid &= (values == np.round(values)) | (not self.whole)
        valid &= (values > 0.0) | ((values == 0.0) & (self.sign != "positive")) | (self.sign == "any")
        return np.flatnonzero(~valid).tolist()


@dataclass(frozen=True)
class Column:
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


@dataclass(frozen=True)
class Sheet:
    """A table as it is read: names in its ``header``, and the ``file`` with its rows of fields."""

    path: Path
    header: list[str]
    file: TableFile

    @property
    def rows(self) -> list[list[str]]:
        """Rows of fields as they are written."""
        return self.file.rows

    @property
    def notes(self) -> Notes:
        """A note on how the table was read, where that is not UTF-8 with commas and decimal points."""
        return (Note("table", f"{self.path}: {self.file.manner}"),) if self.file.manner else ()

    @cached_property
    def places(self) -> dict[str, int]:
        """Place of each column with a name."""
        return {name: place for place, name in enumerate(self.header) if name}

    def __contains__(self, name: str) -> bool:
        return name in self.places

    def column(self, name: str) -> Column:
        """The column of this name."""
        place = self.places[name]
        texts = [plain_cell(row[place].strip()) for row in self.rows]
        cells = [self.file.cell(row, place) for row in range(len(texts))] if self.file.numbers else ()
        return Column(self.path, name, texts, self.file.marks, cells)

    @property
    def nameless(self) -> list[int]:
        """Numbers, from 1, of columns with cells and no name."""
        places = [place for place, name in enumerate(self.header) if not name]
        return [place + 1 for place in places if any(row[place].strip() for row in self.rows)]

    def refuse_nameless(self) -> None:
        """Raises InputError for columns with cells and no name."""
        refuse(f"{self.path}: column {number} has no name; name it or remove it" for number in self.nameless)


def read_sheet(path: Path) -> Sheet:
    """Header and rows of a table of text or of a workbook, without blank rows and empty columns at the end.

    Raises InputError where it cannot be read in one way alone, has no rows, has a name twice, or a row has more or fewer fields
    than the header.
    """
    file = read_table_file(path)
    header = [plain_cell(name.strip()) for name in file.header]
    if len(header) == 1 and "|" in header[0]:
        raise InputError([f"{path}: has '|' between its fields; write commas there and points in numbers"])
    repeated = {name: count for name, count in Counter(header).items() if count > 1 and name}
    faults = [f"{path}: column {quoted(name)} comes {count} times; keep one" for name, count in repeated.items()]
    if not file.rows:
        faults.append(f"{path}: has a header and no rows; add a row for each run")
    refuse(faults)
    return Sheet(path, header, file)


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
