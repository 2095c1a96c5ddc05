"""Tables of runs: a column a factor and a response, optionally errors, replicates and blocks."""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rbdyn.faults import InputError

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


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
    """Read a CSV table with a column for each factor and response.

    A column "<response>_error" holds 95 % half widths (empty where unknown), "replicates" and "block" whole
    numbers; all three kinds may be missing. ``named_in`` is the file that names the columns. Rows of one number in a
    column "run" are replicates: their mean is one run, with the half width that their scatter tells.

    Raises InputError, with all faults, when the file, a column or a number is missing, a column comes twice, or
    replicates have different factors.
    """
    import pandas as pd

    try:
        table = pd.read_csv(path)
        with path.open(encoding="utf-8", newline="") as lines:
            header = Counter(next(csv.reader(lines)))
    except FileNotFoundError:
        raise InputError([f"{path}: no such file; check the path"]) from None
    except (OSError, ValueError) as error:
        raise InputError([f"{path}: cannot be read as a CSV table ({error}); mend the file"]) from None
    wanted, errors = [*factors, *responses], [f"{name}_error" for name in responses]
    faults = [
        f"{path}: column {name!r} is missing; add it, or rename the factor or response in {named_in}"
        for name in wanted
        if name not in table.columns
    ]
    used = [name for name in (*wanted, *errors, "replicates", "block", "run") if name in table.columns]
    faults += [f"{path}: column {name!r} comes {header[name]} times; keep one" for name in used if header[name] > 1]
    for name in used:
        faults += _faults_of(path, name, table[name], optional=name in errors, whole=name not in wanted + errors)
    if faults:
        raise InputError(faults)
    if "run" in table.columns and table["run"].duplicated().any():
        table = _means_of_replicates(path, table, factors, responses)
    nothing = pd.Series(np.nan, index=table.index)
    return Table(
        actual=table[factors].to_numpy(float),
        values=table[responses].to_numpy(float),
        errors=np.column_stack([table.get(name, nothing).to_numpy(float) for name in errors]),
        replicates=np.asarray(table.get("replicates", nothing).fillna(0), np.int64),
        block=np.asarray(table.get("block", nothing).fillna(0), np.int64),
    )


def _means_of_replicates(path: Path, table: pd.DataFrame, factors: list[str], responses: list[str]) -> pd.DataFrame:
    """One row a run: mean, half width and number of its replicates."""
    from scipy import special

    groups = table.groupby("run", sort=False)
    lowest, highest = groups[factors].min(), groups[factors].max()
    faults = [
        f"{path}: {name} of run {run} is {lowest.loc[run, name]:g} in one replicate and {highest.loc[run, name]:g} in "
        "another; replicates have the same factors: mend them, or number the runs apart"
        for run in lowest.index
        for name in factors
        if lowest.loc[run, name] != highest.loc[run, name]
    ]
    if faults:
        raise InputError(faults)
    joined, count = groups.first(), groups.size().to_numpy()
    joined["replicates"] = count
    # Student's quantile; a run without replicates has no scatter, and its half width stays unknown.
    reach = special.stdtrit(np.maximum(count - 1, 1), 0.975) / np.sqrt(count)
    for name in responses:
        joined[name] = groups[name].mean()
        joined[f"{name}_error"] = groups[name].std() * reach
    return joined


def _faults_of(path: Path, name: str, column: pd.Series, optional: bool, whole: bool) -> list[str]:
    import pandas as pd

    numbers = pd.to_numeric(column, errors="coerce").to_numpy(float)
    bad = ~np.isfinite(numbers) & ~(optional & column.isna().to_numpy())
    if whole:
        bad |= numbers != np.round(numbers)
    kind = "whole" if whole else "finite"
    return [
        f"{path}: {name} in row {row + 1} = {column.tolist()[row]!r}: is not a {kind} number; mend it"
        for row in np.flatnonzero(bad)
    ]
