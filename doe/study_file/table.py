"""Tables of runs, and the CSV files that hold them.

A table has a column for each factor and response, and optional ones of errors, replicates and blocks. Cells of a CSV file are
read by the names of their columns, and all numbers by one reader with bounds.
"""

import csv
import io
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

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, read_text, refuse
from rbdyn.base.records import NUMBER, plain_cell, quoted_cell
from rbdyn.base.words import counted

WHOLE = re.compile(r"[+-]?\d+", re.ASCII)
# Characters of a number: every double has a shorter form, and Python converts no integer of thousands of digits.
LONGEST_NUMBER = 400
# Cells of an unknown number.
UNKNOWN = ("", "nan")
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
    """A column of a CSV file: its ``name``, and the stripped ``texts`` of its cells."""

    path: Path
    name: str
    texts: Sequence[str]

    def fault(self, row: int, words: str, value: bool = True) -> str:
        """A sentence on the cell in ``row`` (from 0), with its text if ``value``; the sentence counts rows from 1."""
        text = self.texts[row]
        plain = bool(NUMBER.fullmatch(text)) and len(text) < LONGEST_NAME
        cell = f" = {text if plain else quoted(text)}" if value else ""
        return f"{self.path}: {one_line(self.name, LONGEST_NAME)} in row {row + 1}{cell}: {words}"

    def numbers(self, limits: Limits, unknown: Collection[str] = ()) -> tuple[Array, list[str]]:
        """Numbers (n,) of the cells, and a sentence for each cell without a number within the ``limits``.

        Cells whose text in lower case is in ``unknown`` are NaN, without a fault.
        """
        values = np.array([float(text) if is_number(text) else math.nan for text in self.texts])
        faults = []
        for row in limits.broken(values):
            if self.texts[row].lower() not in unknown:
                faults.append(self.fault(row, _slip(self.texts[row]) or limits.fault(values[row])))
        return values, faults


@dataclass(frozen=True)
class Sheet:
    """A CSV file: names in its ``header``, and ``rows`` of fields as they are written."""

    path: Path
    header: list[str]
    rows: list[list[str]]

    @cached_property
    def places(self) -> dict[str, int]:
        """Place of each column with a name."""
        return {name: place for place, name in enumerate(self.header) if name}

    def __contains__(self, name: str) -> bool:
        return name in self.places

    def column(self, name: str) -> Column:
        """The column of this name."""
        place = self.places[name]
        return Column(self.path, name, [plain_cell(row[place].strip()) for row in self.rows])

    @property
    def nameless(self) -> list[int]:
        """Numbers, from 1, of columns with cells and no name."""
        places = [place for place, name in enumerate(self.header) if not name]
        return [place + 1 for place in places if any(row[place].strip() for row in self.rows)]

    def refuse_nameless(self) -> None:
        """Raises InputError for columns with cells and no name."""
        refuse(f"{self.path}: column {number} has no name; name it or remove it" for number in self.nameless)


def read_sheet(path: Path) -> Sheet:
    """Header and rows of a CSV file, without its blank lines.

    Raises InputError if it is no CSV, has no rows, has a name twice, or a row has more or fewer fields than the header.
    """
    lines = csv.reader(io.StringIO(read_text(path), newline=""), strict=True)
    fields, start = [], 1
    try:
        for row in lines:
            # A quoted empty field is a cell; a blank line is none.
            if len(row) > 1 or (row and (row[0] == "" or row[0].strip())):
                fields.append(row)
            start = lines.line_num + 1
    except csv.Error as error:
        fix = "close the quotes that open there" if "unexpected end" in str(error) else "fix that line"
        raise InputError([f"{path}: line {start}: is not CSV ({error}); {fix}"]) from None
    if not fields:
        raise InputError([f"{path}: is empty; write a header of names and a row for each run"])
    header, rows = [plain_cell(name.strip()) for name in fields[0]], fields[1:]
    if len(header) == 1 and (marks := [mark for mark in ";\t|" if mark in header[0]]):
        raise InputError([f"{path}: has {marks[0]!r} between its fields; write commas there and points in numbers"])
    repeated = {name: count for name, count in Counter(header).items() if count > 1 and name}
    faults = [f"{path}: column {quoted(name)} comes {count} times; keep one" for name, count in repeated.items()]
    if not rows:
        faults.append(f"{path}: has a header and no rows; add a row for each run")
    for number, row in enumerate(rows, 1):
        if len(row) != len(header):
            only_commas = len(row) > len(header) and not any(field.strip() for field in row[len(header) :])
            fix = "remove the commas at its end" if only_commas else "give it a field for each column, in their order"
            faults.append(f"{path}: row {number} has {counted(len(row), 'field')} and the header {len(header)}; {fix}")
    refuse(faults)
    return Sheet(path, header, rows)


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
    return "is not a finite number; write a point for the decimal comma" if "," in text else None


# Fourth powers of larger values overflow; larger labels and counts are not exact in floating point.
RUN, ERROR = Limits(1e50, 1e-50), Limits(1e50, 1e-50, "not negative")
NUMBERED, COUNTED = Limits(1e9, whole=True), Limits(1e9, sign="not negative", whole=True)
COUNT, LABELS = "replicates", ("block", "run")
# Most runs of a table: pairwise statistics take seconds and half a gigabyte, and a test of normality is still exact.
MOST_RUNS = 5000


@dataclass(frozen=True)
class Table:
    """Factor values (n, k), responses (n, m) and their 95 % half widths (n, m; NaN if unknown).

    ``replicates`` (n,) of the errors (0: unknown) and ``block`` (n,) of each run (0 without blocks).
    """

    actual: Array
    values: Array
    errors: Array
    replicates: Whole
    block: Whole


def read_table(path: Path, factors: list[str], responses: list[str], named_in: Path) -> Table:
    """Read a CSV table in UTF-8 with a column for each factor and response, commas between fields, points in numbers.

    A column "<response>_error" holds 95 % half widths (empty or "nan" if unknown), "replicates" and "block" whole numbers;
    all three kinds may be missing. ``named_in`` is the file that names the columns. Rows of one number in a column "run"
    are replicates: their mean is one run, with the half width of their scatter.

    Raises InputError with all faults: a missing file, column or number; a row with more or fewer fields than the header; a
    repeated column; an infinite or impossible number; replicates with different factors; more than `MOST_RUNS` runs.
    """
    return table_of(read_sheet(path), factors, responses, named_in)


def table_of(sheet: Sheet, factors: list[str], responses: list[str], named_in: Path) -> Table:
    """The table in a CSV file that is already read. See ``read_table``."""
    path, errors = sheet.path, [f"{name}_error" for name in responses]
    limits = dict.fromkeys([*factors, *responses], RUN) | dict.fromkeys(errors, ERROR)
    limits |= {COUNT: COUNTED, **dict.fromkeys(LABELS, NUMBERED)}
    faults = [
        f"{path}: column {quoted(name)} is missing; add it, or rename the factor or response in {named_in} to one of "
        f"{listed(sheet.header)}"
        for name in [*factors, *responses]
        if name not in sheet
    ]
    columns, optional = {}, set(errors)
    for name in (name for name in limits if name in sheet):
        columns[name], bad = sheet.column(name).numbers(limits[name], UNKNOWN if name in optional else ())
        faults += bad
    refuse(faults)
    if "run" in columns and len(set(columns["run"].tolist())) < len(sheet.rows):
        refuse(
            (
                f"{path}: column {name}: rows of one run are its replicates, and it follows from their scatter; remove the "
                "column, or number the runs apart"
            )
            for name in (*errors, COUNT)
            if name in columns
        )
        columns = _means_of_replicates(path, columns, factors, responses)
    size = len(columns[factors[0]])
    if size > MOST_RUNS:
        raise InputError(
            [f"{path}: has {size} runs; give {MOST_RUNS} at most, or number replicates alike in a column run"]
        )
    return Table(
        actual=np.column_stack([columns[name] for name in factors]),
        values=np.column_stack([np.empty((size, 0)), *(columns[name] for name in responses)]),
        errors=np.column_stack([np.empty((size, 0)), *(columns.get(name, np.full(size, np.nan)) for name in errors)]),
        replicates=np.asarray(columns.get(COUNT, np.zeros(size)), np.int64),
        block=np.asarray(columns.get("block", np.zeros(size)), np.int64),
    )


def _means_of_replicates(
    path: Path, columns: dict[str, Array], factors: list[str], responses: list[str]
) -> dict[str, Array]:
    """A row for each run, in the order of the first rows: mean, half width and number of its replicates."""
    from scipy import special

    _, first, group, count = np.unique(columns["run"], return_index=True, return_inverse=True, return_counts=True)
    refuse(
        f"{path}: {name} of run {columns['run'][row]:g} is {columns[name][row]:g} in one replicate and "
        f"{columns[name][first[group[row]]]:g} in another; replicates have the same factors: fix them, or number the "
        "runs apart"
        for name in (*factors, *({"block"} & set(columns)))
        for row in np.flatnonzero(columns[name] != columns[name][first[group]])
    )
    order = np.argsort(first)
    joined = {name: column[first[order]] for name, column in columns.items()} | {COUNT: count[order].astype(float)}
    # The quantile is Student's; the half width of a run without replicates is unknown.
    reach = special.stdtrit(np.maximum(count - 1, 1), 0.975) / np.sqrt(count)
    for name in responses:
        mean = np.bincount(group, columns[name]) / count
        squares = np.bincount(group, (columns[name] - mean[group]) ** 2)
        spread = np.sqrt(np.where(count > 1, squares, np.nan) / np.maximum(count - 1, 1))
        joined[name], joined[f"{name}_error"] = mean[order], (spread * reach)[order]
    return joined
