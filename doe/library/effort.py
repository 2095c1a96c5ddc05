"""Arguments of the functions of ``doe`` checked, their folders registered, and their answers saved."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from doe.running.store import STORE, at_work
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, path_of, refuse
from rbdyn.base.files import write_json
from rbdyn.base.folder import OutputFolder, output_folder
from rbdyn.base.page import REPORT_FILES, with_report

if TYPE_CHECKING:
    from doe.library.answer import Answer

# Largest number of parts: each has a folder of its own.
MOST_PARTS = 10_000
# Rows of tables by the name of their CSV file.
Tables = Mapping[str, Sequence[Mapping[str, Any]]]


def path_given(argument: Any, name: str) -> Path:
    """The argument ``name`` of a call as a path. Raises InputError where it is none."""
    try:
        return path_of(argument)
    except InputError:
        shown = one_line(repr(argument), LONGEST_NAME)
        raise InputError([f"{name} = {shown}: must be the path of a file or a folder; check the call"]) from None


def optional_path(argument: Any, name: str) -> Path | None:
    """The same of an argument that may be left out; None where it is."""
    return None if argument is None else path_given(argument, name)


def texts_given(argument: Any, name: str, example: str) -> list[str]:
    """The argument ``name`` of a call as a list of texts; None is an empty one. Raises InputError for anything else."""
    if argument is None:
        return []
    # The order of a set changes from one process to the next.
    words = "a set has no order; write" if isinstance(argument, set | frozenset) else "must be"
    valid = isinstance(argument, list | tuple) and all(isinstance(text, str) for text in argument)
    refuse([] if valid else [f"{name} = {one_line(repr(argument), LONGEST_NAME)}: {words} a list such as {example}"])
    return list(argument)


def part_given(text: Any) -> tuple[int, int] | None:
    """Part and number of parts of "K/N"; None where nothing is stated. Raises InputError for anything else."""
    if text is None:
        return None
    match = re.fullmatch(r"\s*(\d{1,9})\s*/\s*(\d{1,9})\s*", text, re.ASCII) if isinstance(text, str) else None
    part, parts = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= part <= parts <= MOST_PARTS:
        shown = one_line(str(text), LONGEST_NAME)
        number = f"a part from 1 to {parts}" if match and 1 <= parts <= MOST_PARTS else f"K/N with N up to {MOST_PARTS}"
        raise InputError([f"--part {shown}: there is no such part; write {number}, such as 3/40"])
    return part, parts


@contextmanager
def registered(source: Path, folder: Path | None) -> Iterator[None]:
    """Register that the file ``source`` runs in a folder, for ``doe status``; nothing without a folder."""
    if folder is None:
        yield
        return
    with at_work(source, folder / STORE):
        yield


def step_folder(
    out: Path | None, step: str, tables: Sequence[str], force: bool
) -> AbstractContextManager[OutputFolder]:
    """Folder of a step alone, such as "fit", and of the CSV files of its ``tables``; see ``saved``."""
    reports = (*REPORT_FILES, *(f"{step}_{name}" for name in REPORT_FILES))
    return output_folder(out, "doe", (f"{step}.json", *(f"{table}.csv" for table in tables), *reports), force=force)


def saved(folder: OutputFolder, name: str, answer: "Answer", tables: Callable[[], Tables]) -> tuple[str, ...]:
    """Write the answer of a step into its folder, if there is one; names of the files.

    These are its JSON record ``name``, its ``tables`` as CSV, report.html of its blocks and tables.xlsx. In the folder of a
    finished study the last two begin with the name of the step, so that the study keeps its own.
    """
    if folder.path is None or answer.identity is None:
        return ()
    from rbdyn.base.records import save_table

    def write(stage: Path) -> list[str]:
        write_json(stage / name, answer.as_dict())
        rows_by_file = tables()
        for table, rows in rows_by_file.items():
            save_table(rows, stage / table)
        return [name, *rows_by_file]

    prefix = f"{Path(name).stem}_" if (folder.path / "summary.json").exists() else ""
    identity = answer.identity
    return tuple(folder.write(lambda stage: with_report(stage, identity, answer.blocks, write, prefix)))
