"""Blocks of a report: one tree that terminal and HTML render. Text is plain: a renderer escapes it.

A ``Sheet`` has its columns declared once, from which the block on a page, the rows of files and of JSON, and the manual's rows
follow. Columns of a record are declared at its fields by ``rbdyn.base.records.shown``.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, Self, TypeVar

from rbdyn.base.notes import DANGER, Note, Notes, condensed, of_level, ranked, verdict
from rbdyn.base.records import Record, plain, save_table
from rbdyn.base.words import label, quantity, shown, with_error

if TYPE_CHECKING:
    import pandas as pd


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


class Paragraph(Record):
    """Sentences; a "statement" is good news, a "danger" or "warning" bad news or an open verdict, "small" is small print."""

    text: str
    role: Role = ""
    detail: Detail = Detail.LEAST


class Verdict(Record):
    """Every danger among the notes of a result, or, where dangers are ``judged``, that there is none; renderings begin with it.

    ``good``: what is well, before the words that there is no danger; ``warnings``: number of those that are none of the notes.
    """

    notes: Notes
    judged: bool = True
    good: str = ""
    warnings: int = 0
    detail: Detail = Detail.LEAST

    @property
    def paragraphs(self) -> list[Paragraph]:
        """The verdict first."""
        dangers = of_level(condensed(self.notes), DANGER)
        if dangers:
            return [Paragraph(note, "danger") for note in dangers]
        return [Paragraph(" ".join(filter(None, [self.good, verdict(self.notes, self.warnings)])))]


class Remarks(Record):
    """The notes of a result that are no dangers, the worst first; below full detail the first of them, merged.

    ``gathers``: whether a terminal shows the warnings of all other blocks among them.
    """

    notes: Notes
    gathers: bool = False
    detail: Detail = Detail.USUAL

    @property
    def listed(self) -> list[Note]:
        """Every one."""
        return [note for note in ranked(self.notes) if note.level != DANGER]


class Heading(Record):
    """A heading inside a section."""

    text: str
    detail: Detail = Detail.LEAST


class Bullets(Record):
    """Sentences, one a line."""

    items: Sequence[str]
    detail: Detail = Detail.LEAST


class Table(Record):
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


class Figures(Record):
    """Still pictures next to each other with one caption; left out where a rendering has no pictures.

    pictures : SVG, or functions that draw it, which only a page calls
    """

    pictures: Sequence[str | Callable[[], str]]
    caption: str = ""
    key: str = ""
    detail: Detail = Detail.LEAST


class Widget(Record):
    """Place of an interactive picture; left out where a rendering has no scripts."""

    name: str
    detail: Detail = Detail.LEAST


Block = Paragraph | Verdict | Remarks | Heading | Bullets | Table | Figures | Widget


class Section(Record):
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


R = TypeVar("R")
# Significant digits, a format (one that ends in " %" takes a share), or a function of a value, and of its error if it has one.
Form = int | str | Callable[..., str]
# Where a value is in a row: a name or a number, several one within the other, or a function of the row.
Place = str | int | tuple[str | int, ...] | Callable[[R], Any]


@dataclass(frozen=True)
class Column(Generic[R]):
    """One column of a table of rows, which are records or mappings.

    key : name in files and JSON, its unit at the end; an empty one is on the screen alone
    form : how the screen writes a value; with an ``error`` as value ± error unless ``form`` is a function of both
    words : heading on the screen; the key in words unless given
    unit : that of the manual; the one in the key unless given
    meaning : words of the manual; neighbours of one meaning share a row, one without a meaning joins the row before
    error : place of the half-width of the value; where it is a name, files have it as the next column
    at : place of the value; the key unless given
    cell : text of a row on the screen in place of value and form
    missing : text of None on the screen
    text : whether the screen aligns it as text; the first column is text anyway
    screen, files : whether the screen, and files and JSON, have it
    """

    key: str
    form: Form = 4
    words: str | None = None
    unit: str | None = None
    meaning: str = ""
    error: Place[R] | None = None
    at: Place[R] | None = None
    cell: Callable[[R], str] | None = None
    missing: str = ""
    text: bool = False
    screen: bool = True
    files: bool = True

    @property
    def heading(self) -> str:
        """Heading on the screen."""
        return label(self.key) if self.words is None else self.words

    def of(self, names: Iterable[str]) -> "tuple[Column[R], ...]":
        """A column a name, which replaces ``{}`` in key, words, error and place."""
        return tuple(self._named(name) for name in names)

    def _named(self, name: str) -> "Column[R]":
        def filled(place: Any) -> Any:
            if isinstance(place, tuple):
                return tuple(map(filled, place))
            return place.replace("{}", name) if isinstance(place, str) else place

        changed = {key: filled(getattr(self, key)) for key in ("key", "words", "error", "at")}
        return replace(self, **changed)

    def value(self, row: R) -> Any:
        """The value of a row; None where there is none."""
        return value_at(row, self.key if self.at is None else self.at)

    def written(self, row: R) -> str:
        """The text of a row on the screen."""
        if self.cell is not None:
            return self.cell(row)
        value = self.value(row)
        if value is None:
            return self.missing
        if self.error is None:
            return formatted(value, self.form)
        return (self.form if callable(self.form) else with_error)(value, value_at(row, self.error))


def value_at(row: Any, place: Place[Any]) -> Any:
    """The value of a row at a place; None where a name on the way is missing from a mapping or leads to None."""
    if callable(place):
        return None if row is None else place(row)
    for name in place if isinstance(place, tuple) else (place,):
        if isinstance(row, Mapping):
            row = row.get(name)
        elif row is not None:
            row = row[name] if isinstance(name, int) else getattr(row, name)
    return row


def formatted(value: Any, form: Form) -> str:
    """A value as text."""
    if isinstance(form, int):
        return shown(value, form)
    if callable(form):
        return form(value)
    return f"{100.0 * value:{form[:-2]}} %" if form.endswith(" %") else format(value, form)


def columns_of(kind: type[R]) -> tuple[Column[R], ...]:
    """Columns of the fields of a record; those that are not ``shown`` are in files alone."""
    return tuple(
        Column(item.name, **item.metadata.get("column", {"screen": False}))
        for item in fields(kind)  # type: ignore[arg-type]
        if item.metadata.get("path", "") is not None
    )


def within(place: Place[R], columns: Iterable[Column[Any]]) -> tuple[Column[R], ...]:
    """Columns of what stands at a place of a row."""

    def moved(inner: Place[Any]) -> Callable[[R], Any]:
        return lambda row: value_at(value_at(row, place), inner)

    return tuple(
        replace(
            column,
            at=moved(column.key if column.at is None else column.at),
            error=None if column.error is None else moved(column.error),
            cell=None if column.cell is None else moved(column.cell),
        )
        for column in columns
    )


def frame_of(columns: Iterable[Column[R]], series: R) -> "pd.DataFrame":
    """A table whose rows are the places of arrays: each column takes its array from ``series``."""
    import pandas as pd

    return pd.DataFrame({column.key: column.value(series) for column in columns})


@dataclass(frozen=True)
class Sheet(Generic[R]):
    """A table of rows by its columns.

    file : name of the file that holds it
    content : sentence of the manual on its rows
    """

    caption: str
    columns: Sequence[Column[R]]
    rows: Sequence[R] = ()
    note: str = ""
    folded: bool = False
    sortable: bool = False
    detail: Detail = Detail.LEAST
    file: str = ""
    content: str = ""

    @property
    def block(self) -> Table:
        """The table on a page and on the screen."""
        columns = [column for column in self.columns if column.screen]
        cells = [[column.written(row) for column in columns] for row in self.rows]
        text = [place for place, column in enumerate(columns) if column.text]
        header = [column.heading for column in columns]
        return Table(self.caption, header, cells, self.note, self.folded, text, self.sortable, self.detail)

    @property
    def keys(self) -> list[str]:
        """Header of a file."""
        return [key for key, _ in self._values()]

    @property
    def records(self) -> list[dict[str, Any]]:
        """A mapping a row, as files and JSON have it."""
        values = self._values()
        return [{key: plain(value_at(row, place)) for key, place in values} for row in self.rows]

    def _values(self) -> list[tuple[str, Place[R]]]:
        """Key and place of every value in a file; an error whose key has no column of its own follows its value."""
        keys = {column.key for column in self.columns}
        values = list[tuple[str, Place[R]]]()
        for column in self.columns:
            if column.files and column.key:
                values.append((column.key, column.key if column.at is None else column.at))
                if isinstance(column.error, str) and column.error not in keys:
                    values.append((column.error, column.error))
        return values

    @property
    def frame(self) -> "pd.DataFrame":
        """The table for pandas."""
        import pandas as pd

        return pd.DataFrame(self.records, columns=self.keys)

    def save(self, folder: Path, float_format: str | None = None) -> str:
        """Write the CSV file; returns its name. Raises OSError."""
        save_table(self.frame, folder / self.file, float_format)
        return self.file

    @property
    def manual(self) -> str:
        """The file, its rows and its columns in Markdown."""
        groups = list[tuple[list[str], list[str], str]]()
        for column in self.columns:
            if not (column.files and column.key):
                continue
            if not groups or column.meaning not in ("", groups[-1][2]):
                groups.append(([], [], column.meaning))
            keys, units, _ = groups[-1]
            keys += [column.key, *([column.error] if isinstance(column.error, str) else [])]
            units.append(quantity(column.key)[1] if column.unit is None else column.unit)
        lines = [
            f"| {', '.join(f'`{key}`' for key in dict.fromkeys(keys))} | {', '.join(dict.fromkeys(filter(None, units)))} | {meaning} |"
            for keys, units, meaning in groups
        ]
        return "\n".join(
            (f"### {self.file}\n", f"{self.content}\n", "| column | unit | meaning |", "|---|---|---|", *lines)
        )
