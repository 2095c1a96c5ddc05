"""A study made of a table alone: some columns are its factors, others its responses."""

import re
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from doe.study_file.cells import Column, Sheet, is_number, listed, quoted, read_sheet
from doe.study_file.study import MOST_FACTORS, Study, StudyFile
from doe.study_file.table import COUNT, LABELS, table_of
from rbdyn.faults import InputError, one_line, refuse, validated

# Texts that a date or a time of day begins with, and those that were meant as numbers.
DATE = re.compile(r"\d{1,4}([-/.])\d{1,2}\1\d{1,4}|\d{1,2}:\d\d")
NEARLY_NUMBER = re.compile(r"\W{0,3}\d")
# Responses that are fitted without being named: each takes of the order of a second.
MOST_UNNAMED = 100


def study_of_table(path: Path, factors: list[str], responses: list[str], model: str) -> tuple[Study, tuple[str, ...]]:
    """The study of the columns named, without a scene, and notes on columns that it leaves out.

    Where only one kind is named, the other is all further columns of numbers. A factor is 0 in coded units amid its range in
    the table, and -1 and 1 at the ends.

    Raises InputError for names that are no columns, a column of which only some cells are numbers, a factor that never
    changes, and a table that cannot be read.
    """
    sheet = read_sheet(path)
    has = f"it has {listed(sheet.places)}"
    refuse(
        f"--{kind} {one_line(name)}: is no column of {path}; {has}"
        for kind, names in (("factor", factors), ("response", responses))
        for name in names
        if name not in sheet
    )
    if not factors and not responses:
        raise InputError([f"{path}: name its factors by --factor NAME and its responses by --response NAME; {has}"])
    notes = list[str]()
    if not factors or not responses:
        rest, notes = _rest(sheet, {*factors, *responses}, responses)
        factors, responses = factors or rest, responses or rest
    if not factors or not responses:
        raise InputError([*notes, f"{path}: has no further column of numbers; {has}"])
    for kind, names, most in (("factor", factors, MOST_FACTORS), ("response", responses, MOST_UNNAMED)):
        if len(names) > most:
            raise InputError([f"{path}: has {len(names)} columns for {kind}s; name {most} at most by --{kind} NAME"])
    actual = table_of(sheet, factors, responses, path).actual
    low, high = actual.min(axis=0), actual.max(axis=0)
    always = [(factors[place], low[place]) for place in np.flatnonzero(low == high).tolist()]
    refuse(f"--factor {name}: is {value:g} in every row of {path}; leave it out" for name, value in always)
    scales = zip(factors, (0.5 * (low + high)).tolist(), (0.5 * (high - low)).tolist(), strict=True)
    data = {
        "factor": [{"name": name, "centre": centre, "step": step} for name, centre, step in scales],
        "response": [{"name": name, "model": model} for name in responses],
    }
    return Study(path, validated(StudyFile, data, str(path))), tuple(notes)


def _rest(sheet: Sheet, named: Collection[str], responses: Sequence[str]) -> tuple[list[str], list[str]]:
    """Columns of numbers that are not ``named``, and notes on what else is there.

    Errors belong to ``responses``, or to the rest where that is the responses. A column that is nearly one of numbers is
    taken for one: whoever reads it refuses its other cells.
    """
    others = [name for name in sheet.places if name not in {COUNT, *LABELS, *named}]
    of = set(responses or others)
    errors = {f"{name}_error" for name in of}
    idle = {f"{name}_error" for name in sheet.places if name not in of}
    apart = errors | idle
    words = {name: _words(sheet.column(name)) for name in others if name not in apart}
    rest = [name for name, label in words.items() if label is None]
    labels = [label for label in words.values() if label is not None]
    unused = [name for name in others if name in idle and name not in errors]
    reasons = [("no numbers", labels), ("errors of no response", unused)]
    reasons.append(("without a name", [f"column {number}" for number in sheet.nameless]))
    return rest, [f"{sheet.path}: left out as {why}: {listed(names)}" for why, names in reasons if names]


def _words(column: Column) -> str | None:
    """Name and first text of a column that is clearly none of numbers; None of any other."""
    texts = [text for text in column.texts if text]
    if any(is_number(text) or (NEARLY_NUMBER.match(text) and not DATE.match(text)) for text in texts):
        return None
    return f"{column.name} ({quoted(texts[0]) if texts else 'empty'})"
