"""What a function of ``doe`` returns: the record of its command, which shows, tabulates and saves itself."""

import copy
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rbdyn.base import html, terminal
from rbdyn.base.blocks import Block, Detail, Section, Table, Widget, has_content
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line
from rbdyn.base.files import write_json
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
        return copy.deepcopy(dict(self.record))

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
            raise InputError([f"name = {shown}: is no table of this answer; choose one of {', '.join(rows)}"])
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
        first, *rest = (section for section in map(_still, self.sections()) if section.blocks)
        folded = (
            f"<details><summary>{html.prose(section.title)}</summary>{_rendered(section)}</details>" for section in rest
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
