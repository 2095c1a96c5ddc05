"""What a function of ``doe`` takes and returns: arguments checked, a folder, and a record that shows, tabulates and saves itself."""

import copy
import re
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from doe.running.store import STORE, at_work
from rbdyn.base import html, terminal
from rbdyn.base.blocks import Block, Detail, Section, Table, Widget, has_content
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, path_of, refuse
from rbdyn.base.files import write_json
from rbdyn.base.folder import OutputFolder, output_folder
from rbdyn.base.html import REPORT_FILES, with_report
from rbdyn.base.identity import Identity, identity_line

if TYPE_CHECKING:
    import pandas as pd


# Rows of a table by its column names, units in these.
Rows = Sequence[Mapping[str, Any]]


@dataclass(frozen=True, repr=False, eq=False)
class Answer(Mapping[str, Any]):
    """What a function of ``doe`` returns. ``answer["status"]`` reads a key of the command's JSON.

    - ``as_dict()``: the JSON object of the command; ``save(path)`` writes it
    - ``tables``: tables of numbers by name; ``table(name)``: one of them as a pandas DataFrame, by default the first
    - ``print(answer)``: the text of the command; a notebook shows the same tree of blocks, later chapters folded
    - ``folder`` and ``files``: where the function wrote its files, None and none without ``out``
    - ``identity``: bearing, operating point, date and input files; None where the blocks begin with them
    """

    record: Mapping[str, Any]
    folder: Path | None = None
    files: tuple[str, ...] = ()
    identity: Identity | None = field(default=None, kw_only=True)

    def blocks(self) -> list[Block]:
        """The answer as the command prints it, one tree that every rendering shares."""
        raise NotImplementedError

    def screen(self) -> list[Block]:
        """The answer on a terminal, which begins with bearing, point and date, or else the input files."""
        return [*([] if self.identity is None else [identity_line(self.identity, Detail.USUAL)]), *self.blocks()]

    @property
    def closing(self) -> list[str]:
        """Lines below the answer on a terminal: where its files are."""
        return [f"written to {self.folder}: {', '.join(self.files)}"] if self.folder else []

    @property
    def unmet(self) -> list[str]:
        """Sentences on demands that are not met, for which the command fails; ``shows_unmet``: whether the answer has them."""
        return []

    shows_unmet: ClassVar[bool] = False

    def sections(self) -> list[Section]:
        """Chapters of a notebook's page, the first of which is open."""
        return [Section("answer", type(self).__name__, self.blocks())]

    def rows(self) -> Mapping[str, Rows]:
        """Rows of each table by its name, the main one first."""
        raise NotImplementedError

    def brief(self) -> str:
        """The answer in a line."""
        raise NotImplementedError

    def as_dict(self) -> dict[str, Any]:
        """JSON object of the command, which shares nothing with the answer."""
        return {key: self[key] for key in self}

    def save(self, path: Path | str) -> None:
        """Write the JSON object of the command to a file, whole or not at all. Raises OSError."""
        write_json(path, self.as_dict())

    @property
    def tables(self) -> "dict[str, pd.DataFrame]":
        """Every table by its name, the main one first; units in the names of columns."""
        import pandas as pd

        return {name: pd.DataFrame(list(rows)) for name, rows in self.rows().items()}

    def table(self, name: str | None = None) -> "pd.DataFrame":
        """The table of this name, by default the main one. Raises InputError for a name that is none of ``tables``."""
        import pandas as pd

        rows = self.rows()
        if name is None:
            return pd.DataFrame(list(next(iter(rows.values()))))
        if name not in rows:
            shown = one_line(repr(name), LONGEST_NAME)
            raise InputError(f"name = {shown}: is not a table of this answer; choose one of {', '.join(rows)}")
        return pd.DataFrame(list(rows[name]))

    def __getitem__(self, key: str) -> Any:
        """A value of the record, which shares nothing with the answer."""
        return copy.deepcopy(self.record[key])

    def __iter__(self) -> Iterator[str]:
        return iter(self.record)

    def __len__(self) -> int:
        return len(self.record)

    def __hash__(self) -> int:
        """Equal answers have equal keys."""
        return hash(frozenset(self.record))

    def __str__(self) -> str:
        width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
        return terminal.text(self.screen(), Detail.USUAL, width).rstrip("\n")

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.brief()}>"

    def _repr_html_(self) -> str:
        first, *tail = (section for section in map(_still, self.sections()) if section.blocks)
        folded = (
            f"<details><summary>{html.prose(section.title)}</summary>{_rendered(section)}</details>" for section in tail
        )
        return f"<div>{_rendered(first)}{''.join(folded)}</div>"


def _still(section: Section) -> Section:
    """The section without empty blocks and interactive pictures, and with tables for tiles: a cell has no scripts or styles."""
    blocks = [block for block in section.blocks if has_content(block) and not isinstance(block, Widget)]
    return replace(
        section, blocks=[replace(block, tiles=None) if isinstance(block, Table) else block for block in blocks]
    )


def _rendered(section: Section) -> str:
    return "".join(map(html.render, section.blocks))


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
        raise InputError(f"{name} = {shown}: must be the path of a file or a folder; check the call") from None


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
        raise InputError(f"--part {shown}: this part does not exist; write {number}, such as 3/40")
    return part, parts


def registered(source: Path, folder: Path | None) -> AbstractContextManager[None]:
    """Register that the file ``source`` runs in a folder, for ``doe status``; nothing without a folder."""
    return nullcontext() if folder is None else at_work(source, folder / STORE)


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

    def write(stage: Path) -> None:
        write_json(stage / name, answer.as_dict())
        for table, rows in tables().items():
            save_table(rows, stage / table)

    prefix = f"{Path(name).stem}_" if (folder.path / "summary.json").exists() else ""
    identity = answer.identity
    return tuple(folder.write(lambda stage: with_report(stage, folder.files, identity, answer.blocks, write, prefix)))
