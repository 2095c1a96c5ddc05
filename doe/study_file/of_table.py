"""A study made of a table alone: some columns are its factors, others its responses."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from doe.study_file.study import Study, StudyFile
from doe.study_file.table import COUNT, LABELS, columns_of, listed, read_table
from rbdyn.faults import InputError, refuse, validated


def study_of_table(path: Path, factors: Sequence[str], responses: Sequence[str], model: str) -> Study:
    """The study of the columns named, without a scene; where only one kind is named, the other is all further columns of
    numbers. A factor is 0 in coded units amid its range in the table, and -1 and 1 at the ends.

    Raises InputError for names that are no columns, a factor that never changes, and a table that cannot be read.
    """
    columns = columns_of(path)
    has = f"it has {listed(columns)}"
    refuse(
        f"--{kind} {name}: is no column of {path}; {has}"
        for kind, names in (("factor", factors), ("response", responses))
        for name in names
        if name not in columns
    )
    if not factors and not responses:
        raise InputError([f"{path}: name its factors by --factor NAME and its responses by --response NAME; {has}"])
    beside = {COUNT, *LABELS, *factors, *responses, *(f"{name}_error" for name in columns)}
    rest = [name for name, numbers in columns.items() if numbers and name not in beside]
    factors, responses = list(factors or rest), list(responses or rest)
    if not factors or not responses:
        raise InputError([f"{path}: has no further column of numbers; {has}"])
    actual = read_table(path, factors, responses, path).actual
    low, high = actual.min(axis=0), actual.max(axis=0)
    always = [(factors[place], low[place]) for place in np.flatnonzero(low == high)]
    refuse(f"--factor {name}: is {value:g} in every row of {path}; leave it out" for name, value in always)
    scales = zip(factors, (0.5 * (low + high)).tolist(), (0.5 * (high - low)).tolist(), strict=True)
    data = {
        "factor": [{"name": name, "centre": centre, "step": step} for name, centre, step in scales],
        "response": [{"name": name, "model": model} for name in responses],
    }
    return Study(path, validated(StudyFile, data, str(path)))
