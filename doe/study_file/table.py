"""Tables of runs: a column a factor and a response, optionally errors, replicates and blocks."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from doe.arrays import Array, Whole
from doe.study_file.cells import UNKNOWN, Limits, Sheet, listed, quoted, read_sheet
from rbdyn.faults import InputError, refuse

# Fourth powers of larger values overflow; larger labels and counts are no whole numbers in floating point.
RUN, ERROR = Limits(1e50, 1e-50), Limits(1e50, 1e-50, "not negative")
NUMBERED, COUNTED = Limits(1e9, whole=True), Limits(1e9, sign="not negative", whole=True)
COUNT, LABELS = "replicates", ("block", "run")
# Runs of which statistics in pairs take seconds and half a gigabyte, and a test of normality is still exact.
MOST_RUNS = 5000


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
    than the header, a column comes twice, a number is not finite or impossible, replicates have different factors, or there
    are more than `MOST_RUNS` runs.
    """
    return table_of(read_sheet(path), factors, responses, named_in)


def table_of(sheet: Sheet, factors: list[str], responses: list[str], named_in: Path) -> Table:
    """The table in a CSV file that is read already, as ``read_table`` has it. Raises InputError."""
    path, errors = sheet.path, [f"{name}_error" for name in responses]
    limits = dict.fromkeys([*factors, *responses], RUN) | dict.fromkeys(errors, ERROR)
    limits |= {COUNT: COUNTED, **dict.fromkeys(LABELS, NUMBERED)}
    fix = f"add it, or rename the factor or response in {named_in} to one of {listed(sheet.header)}"
    faults = [
        f"{path}: column {quoted(name)} is missing; {fix}" for name in [*factors, *responses] if name not in sheet
    ]
    columns, optional = {}, set(errors)
    for name in (name for name in limits if name in sheet):
        columns[name], bad = sheet.column(name).numbers(limits[name], UNKNOWN if name in optional else ())
        faults += bad
    refuse(faults)
    if "run" in columns and len(set(columns["run"].tolist())) < len(sheet.rows):
        twice = (
            "rows of one run are its replicates, whose scatter tells it; remove the column, or number the runs apart"
        )
        refuse(f"{path}: column {name}: {twice}" for name in (*errors, COUNT) if name in columns)
        columns = _means_of_replicates(path, columns, factors, responses)
    size = len(columns[factors[0]])
    if size > MOST_RUNS:
        fix = f"give {MOST_RUNS} at most, or number replicates alike in a column run"
        raise InputError([f"{path}: has {size} runs; {fix}"])
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
    """One row a run, in the order of the first rows: mean, half width and number of its replicates."""
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
    # Student's quantile; a run without replicates has no scatter, and its half width stays unknown.
    reach = special.stdtrit(np.maximum(count - 1, 1), 0.975) / np.sqrt(count)
    for name in responses:
        mean = np.bincount(group, columns[name]) / count
        squares = np.bincount(group, (columns[name] - mean[group]) ** 2)
        spread = np.sqrt(np.where(count > 1, squares, np.nan) / np.maximum(count - 1, 1))
        joined[name], joined[f"{name}_error"] = mean[order], (spread * reach)[order]
    return joined
