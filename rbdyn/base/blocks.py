"""Blocks of a report: one tree that terminal and HTML render. Text is plain: a renderer escapes it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, Literal, Self

from rbdyn.base.notes import DANGER, Note, Notes, condensed, of_level, ranked, verdict


class Detail(IntEnum):
    """Level of detail on the terminal; files hold all blocks."""

    LEAST = 0
    USUAL = 1
    ALL = 2

    @classmethod
    def of(cls, quiet: bool, verbose: bool = False) -> Self:
        """Level by the options ``--quiet`` and ``--verbose``; the first prevails."""
        return cls.LEAST if quiet else cls.ALL if verbose else cls.USUAL


Role = Literal["", "statement", "danger", "warning", "small"]
# First word of bad news in every rendering: no reader depends on a colour.
ALARMS = {"danger": "Danger", "warning": "Warning"}


@dataclass(frozen=True)
class Paragraph:
    """Sentences; a "statement" is good news, a "danger" or "warning" bad news or an open verdict, "small" is small print."""

    text: str
    role: Role = ""
    detail: Detail = Detail.LEAST


@dataclass(frozen=True)
class Verdict:
    """Every danger among the notes of a result, or, where dangers are ``judged``, that there is none; renderings begin with it."""

    notes: Notes
    judged: bool = True
    detail: Detail = Detail.LEAST

    @property
    def paragraphs(self) -> list[Paragraph]:
        """The verdict first."""
        further = of_level(condensed(self.notes), DANGER)[1:]
        role: Role = "danger" if of_level(self.notes, DANGER) else ""
        return [Paragraph(verdict(self.notes), role), *(Paragraph(note, "danger") for note in further)]


@dataclass(frozen=True)
class Remarks:
    """The notes of a result that are no dangers, the worst first; below full detail the first of them, merged."""

    notes: Notes
    detail: Detail = Detail.USUAL

    @property
    def listed(self) -> list[Note]:
        """Every one."""
        return [note for note in ranked(self.notes) if note.level != DANGER]


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str
    detail: Detail = Detail.LEAST


@dataclass(frozen=True)
class Bullets:
    """Sentences, one a line."""

    items: Sequence[str]
    detail: Detail = Detail.LEAST


@dataclass(frozen=True)
class Table:
    """A table whose first column names the row; a ``folded`` one opens on demand, a ``sortable`` one sorts by any column.

    ``text_columns``: further columns that hold text rather than numbers. ``tiles``: headings of columns without a unit; where they
    are given, a page shows each row as a tile, its second cell prominent.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    folded: bool = False
    text_columns: Sequence[int] = ()
    sortable: bool = False
    detail: Detail = Detail.LEAST
    tiles: Sequence[str] | None = None

    def without_empty_columns(self) -> Self:
        """The same table without its empty columns."""
        full = [place for place in range(len(self.header)) if place == 0 or any(row[place] for row in self.rows)]
        return replace(
            self,
            header=[self.header[place] for place in full],
            rows=[[row[place] for place in full] for row in self.rows],
            text_columns=[full.index(place) for place in self.text_columns if place in full],
        )


@dataclass(frozen=True)
class Figures:
    """Still pictures next to each other with one caption; left out where a rendering has no pictures.

    pictures : SVG, or functions that draw it, which only a page calls
    """

    pictures: Sequence[str | Callable[[], str]]
    caption: str = ""
    key: str = ""
    detail: Detail = Detail.LEAST


@dataclass(frozen=True)
class Widget:
    """Place of an interactive picture; left out where a rendering has no scripts."""

    name: str
    detail: Detail = Detail.LEAST


Block = Paragraph | Verdict | Remarks | Heading | Bullets | Table | Figures | Widget


@dataclass(frozen=True)
class Section:
    """Part of a report; ``key`` is its anchor. Empty blocks are left out of the report."""

    key: str
    title: str
    blocks: Sequence[Block]


def with_notes(notes: Iterable[Note | Mapping[str, Any]], blocks: Iterable[Block], judged: bool = True) -> list[Block]:
    """The blocks between the verdict of ``notes``, or of their JSON forms, and those of them that are no dangers."""
    every = tuple(map(Note.of, notes))
    return [Verdict(every, judged), *blocks, Remarks(every)]


def has_content(block: Block) -> bool:
    """Whether a block has content: a table rows, a list items, a paragraph words."""
    match block:
        case Table(rows=content) | Bullets(items=content) | Figures(pictures=content):
            return bool(content)
        case Paragraph(text=content) | Heading(text=content) | Remarks(listed=content):
            return bool(content)
        case Verdict(notes=content, judged=judged):
            return judged or bool(of_level(content, DANGER))
    return True
