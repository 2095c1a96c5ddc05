"""Tables of runs: a column a factor and a response, optionally errors, replicates and blocks."""

import csv
import io
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from doe.arrays import Array, Whole
from rbdyn.faults import LONGEST_NAME, InputError, one_line, read_text, refuse
from rbdyn.records.cells import NUMBER, plain_cell
from rbdyn.records.words import counted

# Squares of larger values, and their sums, overflow; larger labels and counts are no whole numbers in floating point.
LARGEST, LARGEST_WHOLE = 1e100, 1e9
COUNT, LABELS = "replicates", ("block", "run")


@dataclass(frozen=True)
class Table:
    """Factor values (n, k), responses and their 95 % half widths (n, m; NaN where there is none).

    ``replicates`` (n,) behind the errors (0: unknown) and ``block`` (n,) of each run (all 0 without blocks).
    """

    actual: Array
    values: Array
    errors: Array
    replicates: Whole
    block: Whole


def read_table(path: Path, factors: list[str], responses: list[str], named_in: Path) -> Table:
    """Read a CSV table in UTF-8 with a column for each factor and response, if any, commas between fields, points in numbers.

    A column "<response>_error" holds 95 % half widths (empty or "nan" where unknown), "replicates" and "block" whole
    numbers; all three kinds may be missing. ``named_in`` is the file that names the columns. Rows of one number in a
    column "run" are replicates: their mean is one run, with the half width that their scatter tells.

    Raises InputError, with all faults, when the file, a column or a number is missing, a row has more or fewer fields
    than the header, a column comes twice, a number is not finite or impossible, or replicates have different factors.
    """
    header, rows = fields(path)
    wanted, errors = [*factors, *responses], [f"{name}_error" for name in responses]
    mend = f"add it, or rename the factor or response in {named_in} to one of {listed(header)}"
    faults = [f"{path}: column {_cut(name)} is missing; {mend}" for name in wanted if name not in header]
    columns = {}
    for name in (*wanted, *errors, COUNT, *LABELS):
        if name in header:
            place = header.index(name)
            columns[name], bad = _numbers(name, [row[place].strip() for row in rows], optional=name in errors)
            faults += [f"{path}: {fault}" for fault in bad]
    refuse(faults)
    if "run" in columns and len(set(columns["run"].tolist())) < len(rows):
        columns = _means_of_replicates(path, columns, factors, responses)
    size = len(columns[factors[0]])
    return Table(
        actual=np.column_stack([columns[name] for name in factors]),
        values=np.column_stack([np.empty((size, 0)), *(columns[name] for name in responses)]),
        errors=np.column_stack([np.empty((size, 0)), *(columns.get(name, np.full(size, np.nan)) for name in errors)]),
        replicates=np.asarray(columns.get(COUNT, np.zeros(size)), np.int64),
        block=np.asarray(columns.get("block", np.zeros(size)), np.int64),
    )


def columns_of(path: Path) -> dict[str, bool]:
    """Names of the columns of a table, and whether all in it are numbers. Raises InputError."""
    header, rows = fields(path)
    named = ((place, name) for place, name in enumerate(header) if name)
    return {name: all(NUMBER.fullmatch(row[place].strip()) for row in rows) for place, name in named}


def listed(names: Iterable[str]) -> str:
    """Names of columns for a message."""
    return ", ".join(one_line(name, LONGEST_NAME) for name in names)


def fields(path: Path) -> tuple[list[str], list[list[str]]]:
    """Names in the header and fields of the rows, as many in each; blank lines are none. Raises InputError.

    A quote that kept a spreadsheet from taking text for a formula is taken off.
    """
    lines = csv.reader(io.StringIO(read_text(path), newline=""), strict=True)
    found, start = [], 1
    try:
        for row in lines:
            if len(row) > 1 or (row and row[0].strip()):
                found.append(row)
            start = lines.line_num + 1
    except csv.Error as error:
        mend = "close the quotes that open there" if "unexpected end" in str(error) else "mend that line"
        raise InputError([f"{path}: line {start}: is not CSV ({error}); {mend}"]) from None
    if not found:
        raise InputError([f"{path}: is empty; write a header of names and a row a run"])
    header, *rows = [[plain_cell(text.strip()) for text in row] for row in found]
    if len(header) == 1 and (marks := [mark for mark in ";\t|" if mark in header[0]]):
        raise InputError([f"{path}: has {marks[0]!r} between its fields; write commas there and points in numbers"])
    several = {name: count for name, count in Counter(header).items() if count > 1 and name}
    faults = [f"{path}: column {_cut(name)} comes {count} times; keep one" for name, count in several.items()]
    if not rows:
        faults.append(f"{path}: has a header and no rows; add a row a run")
    for number, row in enumerate(rows, 1):
        if len(row) != len(header):
            only_commas = len(row) > len(header) and not any(field.strip() for field in row[len(header) :])
            mend = "remove the commas at its end" if only_commas else "give it a field a column, in the header's order"
            faults.append(f"{path}: row {number} has {counted(len(row), 'field')} and the header {len(header)}; {mend}")
    refuse(faults)
    return header, rows


def _numbers(name: str, texts: Sequence[str], optional: bool) -> tuple[Array, list[str]]:
    """Numbers of a column (NaN where an ``optional`` one is unknown), and what is wrong with them by row."""
    values = [float(text) if NUMBER.fullmatch(text) else math.nan for text in texts]
    filled = [row for row, text in enumerate(texts, 1) if not (optional and text.lower() in ("", "nan"))]
    wrong = (_wrong(name, values[row - 1], texts[row - 1], row, optional) for row in filled)
    return np.array(values), [fault for fault in wrong if fault]


def _wrong(name: str, value: float, text: str, row: int, is_error: bool) -> str | None:
    """What is wrong with a number in a row, from 1; None if nothing is."""
    whole = name == COUNT or name in LABELS
    where = f"{one_line(name, LONGEST_NAME)} in row {row}"
    given = f"{where} = {text if NUMBER.fullmatch(text) and len(text) < LONGEST_NAME else _cut(text)}"
    limit = LARGEST_WHOLE if whole else LARGEST
    if not math.isfinite(value) or (whole and value != round(value)):
        mend = "write a point for the decimal comma" if "," in text else "mend it"
        return f"{given}: is not a {'whole' if whole else 'finite'} number; {mend}"
    if abs(value) > limit:
        return f"{given}: is beyond {limit:g}; check the unit"
    if value < 0.0 and (is_error or name == COUNT):
        what = "error" if is_error else "number of replicates"
        return f"{where}: the {what} of run {row} is {value:g}; give none below 0, or leave out what is not known"
    return None


def _means_of_replicates(
    path: Path, columns: dict[str, Array], factors: list[str], responses: list[str]
) -> dict[str, Array]:
    """One row a run, in the order of the first rows: mean, half width and number of its replicates."""
    from scipy import special

    _, first, group, count = np.unique(columns["run"], return_index=True, return_inverse=True, return_counts=True)
    refuse(
        f"{path}: {name} of run {columns['run'][row]:g} is {columns[name][row]:g} in one replicate and "
        f"{columns[name][first[group[row]]]:g} in another; replicates have the same factors: mend them, or number the "
        "runs apart"
        for name in (*factors, *({"block"} & set(columns)))
        for row in np.flatnonzero(columns[name] != columns[name][first[group]])
    )
    order = np.argsort(first)
    joined = {name: column[first[order]] for name, column in columns.items()} | {COUNT: count[order].astype(float)}
    # Student's quantile; a run without replicates has no scatter, and its half width stays unknown.
    reach = special.stdtrit(np.maximum(count - 1, 1), 0.975) / np.sqrt(count)
    for name in responses:
        mean = np.bincount(group, columns[name]) / count
        squares = np.bincount(group, (columns[name] - mean[group]) ** 2)
        spread = np.sqrt(np.where(count > 1, squares, np.nan) / np.maximum(count - 1, 1))
        joined[name], joined[f"{name}_error"] = mean[order], (spread * reach)[order]
    return joined


def _cut(text: str) -> str:
    """Text in quotes, cut where it is long."""
    return repr(one_line(text, LONGEST_NAME))
