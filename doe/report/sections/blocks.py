"""What a section is made of. Text is plain: whoever renders it escapes it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self


@dataclass(frozen=True)
class Words:
    """A paragraph; ``role`` is "", "statement" (the verdict) or "note" (small print)."""

    text: str
    role: str = ""


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Bullets:
    """Sentences, one a line."""

    items: Sequence[str]


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

    def without_empty_columns(self) -> Self:
        """The same table, columns in which no row says anything left out."""
        kept = [place for place in range(len(self.header)) if place == 0 or any(row[place] for row in self.rows)]
        return replace(
            self,
            header=[self.header[place] for place in kept],
            rows=[[row[place] for place in kept] for row in self.rows],
            text_columns=[kept.index(place) for place in self.text_columns if place in kept],
        )


@dataclass(frozen=True)
class Tile:
    """One figure that the eye finds first: what, how much, its unit, and what stands beneath."""

    name: str
    value: str
    unit: str
    beneath: Sequence[str]


@dataclass(frozen=True)
class Tiles:
    """Figures beside each other."""

    tiles: Sequence[Tile]


@dataclass(frozen=True)
class Figures:
    """Static pictures (SVG) beside each other with one caption; left out where pictures cannot be shown."""

    pictures: Sequence[str]
    caption: str = ""
    key: str = ""


@dataclass(frozen=True)
class Widget:
    """Place of an interactive picture; left out where there are no scripts."""

    name: str


Block = Words | Heading | Bullets | Table | Tiles | Figures | Widget


@dataclass(frozen=True)
class Section:
    """Part of a report; ``key`` is its anchor. Empty blocks are left out of the report."""

    key: str
    title: str
    blocks: Sequence[Block]
