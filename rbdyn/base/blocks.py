"""What a result says, as one tree of blocks that terminal, Markdown and HTML render. Text is plain: a renderer escapes it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Literal, Self


class Detail(IntEnum):
    """How much a reader of the terminal asks for: quietly the least, usually more, verbosely all. Files hold all."""

    LEAST = 0
    USUAL = 1
    ALL = 2

    @classmethod
    def of(cls, quiet: bool, verbose: bool = False) -> Self:
        """That of the options ``--quiet`` and ``--verbose``, of which the first counts."""
        return cls.LEAST if quiet else cls.ALL if verbose else cls.USUAL


@dataclass(frozen=True)
class Paragraph:
    """Sentences; a "statement" is a verdict, "small" is small print."""

    text: str
    role: Literal["", "statement", "small"] = ""
    detail: Detail = Detail.LEAST


@dataclass(frozen=True)
class Note:
    """A limit of the model that was met, or another remark on how far the result can be trusted."""

    text: str
    detail: Detail = Detail.USUAL


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
    """A table whose first column names the row; ``folded`` ones are opened on demand, ``sortable`` ones sorted by any column.

    ``text_columns``: further columns that hold text rather than numbers.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    folded: bool = False
    text_columns: Sequence[int] = ()
    sortable: bool = False
    detail: Detail = Detail.LEAST

    def without_empty_columns(self) -> Self:
        """The same table, columns in which no row says anything left out."""
        full = [place for place in range(len(self.header)) if place == 0 or any(row[place] for row in self.rows)]
        return replace(
            self,
            header=[self.header[place] for place in full],
            rows=[[row[place] for place in full] for row in self.rows],
            text_columns=[full.index(place) for place in self.text_columns if place in full],
        )


@dataclass(frozen=True)
class Tile:
    """One figure that the eye finds first: its name, value and unit, and further figures of the same unit by what they are."""

    name: str
    value: str
    unit: str
    further: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Tiles:
    """Figures next to each other; ``value`` says what their values are."""

    caption: str
    value: str
    tiles: Sequence[Tile]
    detail: Detail = Detail.LEAST

    @property
    def table(self) -> Table:
        """The same figures as a table, a row each."""
        names = list(dict.fromkeys(name for tile in self.tiles for name, _ in tile.further))
        rows = [
            [
                f"{tile.name} [{tile.unit}]" if tile.unit else tile.name,
                tile.value,
                *(dict(tile.further).get(name, "") for name in names),
            ]
            for tile in self.tiles
        ]
        return Table(self.caption, ("", self.value, *names), rows, detail=self.detail)


@dataclass(frozen=True)
class Figures:
    """Still pictures next to each other with one caption; left out where pictures cannot be shown.

    pictures : SVG, or what draws it; only a page calls for it
    """

    pictures: Sequence[str | Callable[[], str]]
    caption: str = ""
    key: str = ""
    detail: Detail = Detail.LEAST


@dataclass(frozen=True)
class Widget:
    """Place of an interactive picture; left out where there are no scripts."""

    name: str
    detail: Detail = Detail.LEAST


Block = Paragraph | Note | Heading | Bullets | Table | Tiles | Figures | Widget


@dataclass(frozen=True)
class Section:
    """Part of a report; ``key`` is its anchor. Empty blocks are left out of the report."""

    key: str
    title: str
    blocks: Sequence[Block]


def notes(texts: Iterable[str], detail: Detail = Detail.USUAL) -> list[Block]:
    """A note a text."""
    return [Note(text, detail=detail) for text in texts]


def says(block: Block) -> bool:
    """Whether there is anything in a block: a table has rows, a list items, a paragraph words."""
    match block:
        case Table(rows=content) | Bullets(items=content) | Tiles(tiles=content) | Figures(pictures=content):
            return bool(content)
        case Paragraph(text=content) | Note(text=content) | Heading(text=content):
            return bool(content)
    return True
