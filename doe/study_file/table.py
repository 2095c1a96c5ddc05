"""Tables of runs, and the files that hold them.

A table has a column for each factor and response, and optional ones of errors, replicates and blocks.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, refuse
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record
from rbdyn.base.tables.sheet import UNKNOWN, InputTable, Limits, listed, quoted, read_sheet

# Fourth powers of larger values overflow; larger labels and counts are not exact in floating point.
RUN, ERROR = Limits(1e50, 1e-50), Limits(1e50, 1e-50, "not negative")
NUMBERED, COUNTED = Limits(1e9, integer=True), Limits(1e9, sign="not negative", integer=True)
COUNT, LABELS = "replicates", ("block", "run")
# Column of a table by ``doe run`` with the outcome of each row, and what it says.
STATUS, DONE, FAILED = "status", "done", "failed"
# Most runs of a table: pairwise statistics take seconds and half a gigabyte, and a test of normality is still exact.
MOST_RUNS = 5000


class Table(Record):
    """Factor values (n, k), responses (n, m) and their 95 % half widths (n, m; NaN if unknown).

    A response without a value is NaN. ``replicates`` (n,) or (n, m) of the errors (0: unknown) and ``block`` (n,) of each run
    (0 without blocks). ``notes`` say how the table was read, and which responses have no value in which rows.
    """

    actual: Array
    values: Array
    errors: Array
    replicates: Whole
    block: Whole
    notes: Notes = ()


def read_table(path: Path, factors: list[str], responses: list[str], named_in: Path) -> Table:
    """Read a table with a column for each factor and response, from a file of text or a workbook.

    A response may have no value in some rows (empty or "nan"), but not in all. A column "<response>_error" holds 95 % half widths (empty or "nan" if unknown), "replicates" and "block" whole numbers;
    all three kinds may be missing. ``named_in`` is the file that names the columns. Rows of one number in a column "run"
    are replicates: their mean is one run, with the half width of their scatter.

    Raises InputError with all faults: a missing file, column or number; a row with more or fewer fields than the header; a
    repeated column; an infinite or impossible number; replicates with different factors; more than `MOST_RUNS` runs.
    """
    return table_of(done_rows(read_sheet(path)), factors, responses, named_in)


def done_rows(sheet: InputTable) -> InputTable:
    """The table without its failed rows, which a note counts; any other table than one by ``doe run`` as it is.

    Raises InputError where no row is done.
    """
    texts = sheet.column(STATUS).texts if STATUS in sheet else []
    if FAILED not in texts or not {DONE, FAILED}.issuperset(texts):
        return sheet
    kept = [place for place, text in enumerate(texts) if text == DONE]
    refuse([] if kept else [f"{sheet.path}: all its {len(texts)} rows failed; run it again, or name another table"])
    numbers = [sheet.numbers[place] for place in kept] if sheet.numbers else ()
    left_out = f"{len(texts) - len(kept)} of {len(texts)} rows failed and are left out"
    manner = "; ".join(filter(None, (sheet.manner, left_out)))
    return replace(sheet, rows=[sheet.rows[place] for place in kept], numbers=numbers, manner=manner)


def table_of(sheet: InputTable, factors: list[str], responses: list[str], named_in: Path) -> Table:
    """The table in a file that is already read. See ``read_table``."""
    path, errors = sheet.path, [f"{name}_error" for name in responses]
    limits = dict.fromkeys([*factors, *responses], RUN) | dict.fromkeys(errors, ERROR)
    limits |= {COUNT: COUNTED, **dict.fromkeys(LABELS, NUMBERED)}
    faults = [
        f"{path}: column {quoted(name)} is missing; add it, or rename the factor or response in {named_in} to one of "
        f"{listed(sheet.header)}"
        for name in [*factors, *responses]
        if name not in sheet
    ]
    # A wrong sheet or separator may be the reason.
    faults += sheet.notes if faults else ()
    columns, optional = {}, set(errors)
    for name in (name for name in limits if name in sheet):
        column = sheet.column(name)
        gaps = name in optional or (name in responses and any(text.lower() not in UNKNOWN for text in column.texts))
        columns[name], bad = column.numbers(limits[name], UNKNOWN if gaps else ())
        faults += bad
    refuse(faults)
    notes = (*sheet.notes, *gap_notes(path, {name: columns[name] for name in responses}))
    replicates = None
    if "run" in columns and len(set(columns["run"].tolist())) < len(sheet.rows):
        refuse(
            (
                f"{path}: column {name}: rows of one run are its replicates, and it follows from their scatter; remove the "
                "column, or number the runs apart"
            )
            for name in (*errors, COUNT)
            if name in columns
        )
        columns, replicates = _means_of_replicates(path, columns, factors, responses)
    size = len(columns[factors[0]])
    if size > MOST_RUNS:
        raise InputError(
            f"{path}: has {size} runs; give {MOST_RUNS} at most, or number replicates alike in a column run"
        )
    return Table(
        actual=np.column_stack([columns[name] for name in factors]),
        values=np.column_stack([np.empty((size, 0)), *(columns[name] for name in responses)]),
        errors=np.column_stack([np.empty((size, 0)), *(columns.get(name, np.full(size, np.nan)) for name in errors)]),
        replicates=np.asarray(columns.get(COUNT, np.zeros(size)) if replicates is None else replicates, np.int64),
        block=np.asarray(columns.get("block", np.zeros(size)), np.int64),
        notes=notes,
    )


def gap_notes(path: Path, columns: Mapping[str, Array]) -> list[Note]:
    """A note on each response or output without a value in some rows: the others of these rows serve all the same."""
    notes = list[Note]()
    for name, values in columns.items():
        rows = [str(row + 1) for row in np.flatnonzero(np.isnan(values)).tolist()]
        if rows:
            those = "that row, which serves" if len(rows) == 1 else "those rows, which serve"
            sentence = (
                f"{path}: {one_line(name, LONGEST_NAME)} has no value in {'row' if len(rows) == 1 else 'rows'} {listed(rows)}; "
                f"it does without {those} the others"
            )
            notes.append(Note("table", sentence))
    return notes


def _means_of_replicates(
    path: Path, columns: dict[str, Array], factors: list[str], responses: list[str]
) -> tuple[dict[str, Array], Whole]:
    """A row for each run, in the order of the first rows: means and half widths of its replicates; their numbers."""
    from scipy import special

    _, first, group = np.unique(columns["run"], return_index=True, return_inverse=True)
    refuse(
        f"{path}: {name} of run {columns['run'][row]:g} is {columns[name][row]:g} in one replicate and "
        f"{columns[name][first[group[row]]]:g} in another; replicates have the same factors: fix them, or number the "
        "runs apart"
        for name in (*factors, *({"block"} & set(columns)))
        for row in np.flatnonzero(columns[name] != columns[name][first[group]])
    )
    order = np.argsort(first)
    joined = {name: column[first[order]] for name, column in columns.items()}
    numbers = np.zeros((len(first), len(responses)), np.int64)
    for place, name in enumerate(responses):
        values = columns[name]
        valid = ~np.isnan(values)
        count = np.bincount(group, valid)
        size = np.where(count > 0, count, np.nan)
        mean = np.bincount(group, np.where(valid, values, 0.0)) / size
        squares = np.bincount(group, np.where(valid, (values - mean[group]) ** 2, 0.0))
        spread = np.sqrt(np.where(count > 1, squares, np.nan) / np.maximum(count - 1, 1))
        # The quantile is Student's; the half width of a run without replicates is unknown.
        reach = special.stdtrit(np.maximum(count - 1, 1), 0.975) / np.sqrt(size)
        joined[name], joined[f"{name}_error"] = mean[order], (spread * reach)[order]
        numbers[:, place] = count[order]
    alike = (numbers == numbers[:, :1]).all() and len(responses)
    return joined, numbers[:, 0] if alike else numbers
