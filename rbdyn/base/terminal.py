"""Blocks as text in the width of the terminal. Loads ``rich`` only for tables."""

import io
import os
import shutil
import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from textwrap import shorten, wrap
from typing import NamedTuple

from rbdyn.base.blocks import ALARMS, Block, Bullets, Detail, Heading, Paragraph, Remarks, Table, Verdict, has_content
from rbdyn.base.notes import CODES, DANGER, NOTE, WARNING, condensed, of_level
from rbdyn.base.streams import escaped, styled
from rbdyn.base.words import counted

# Characters around the text of each column of a table, and around the whole table.
PADDING, FRAME = 3, 1
# Longest cell that is never broken, unless it is a value with its error.
SHORT = 20
# Notes that are shown below full detail, dangers among them.
MOST_NOTES = 5
# Width of tables in a file or a pipe.
WIDE = 160


def show(blocks: Iterable[Block], detail: Detail = Detail.USUAL) -> None:
    """Print blocks on standard output, within the width of a terminal."""
    if not sys.stdout.isatty():
        print(text(blocks, detail), end="")
        return
    bold = os.environ.get("TERM", "dumb") != "dumb"
    styled(sys.stdout).write(text(blocks, detail, shutil.get_terminal_size().columns, bold))


def text(blocks: Iterable[Block], detail: Detail = Detail.USUAL, width: int | None = None, bold: bool = False) -> str:
    """Text of the blocks up to a level of detail, each on lines of its own, without pictures.

    The verdict comes first. Warnings of remarks have numbers, with those of other blocks that they gather. Below full detail there are at most
    `MOST_NOTES` warnings and notes, but every warning of the blocks.

    width : columns of the terminal; None for a file, whose sentences are one line each.
    bold : whether headings, captions and warnings are in bold type.
    """
    page = Page(width, bold)
    shown = [block for block in blocks if block.detail <= detail and has_content(block)]
    alarms = [block for block in shown if isinstance(block, Paragraph) and block.role == "warning"]
    if not any(isinstance(block, Remarks) and block.gathers for block in shown):
        alarms = []
    written = ""
    for block in sorted(shown, key=lambda block: not isinstance(block, Verdict)):
        if block in alarms:
            continue
        if isinstance(block, Verdict):
            block = replace(block, warnings=len(alarms))
        titled = isinstance(block, Heading) or (isinstance(block, Table) and block.caption)
        written += "\n" if titled and written and not written.endswith("\n\n") else ""
        written += (
            _remarks(block, [alarm.text for alarm in alarms], page, detail)
            if isinstance(block, Remarks)
            else _render(block, page)
        )
    return written


def _remarks(block: Remarks, alarms: Sequence[str], page: "Page", detail: Detail) -> str:
    """The warnings with their numbers, those of other blocks first, then notes; below full detail merged, without general ones.

    Remarks that are no warnings are then cut, and a line says where the others are. There is one fewer where the warnings of other blocks
    are among them.
    """
    every, first = condensed(block.listed), block.listed
    if detail < Detail.ALL:
        room = max(MOST_NOTES - block.gathers - len(of_level(condensed(block.notes), DANGER)) - len(alarms), 0)
        first = [note for note in every if not CODES[note.code].general][:room]
    warnings = [*alarms, *(note for note in first if note.level == WARNING)]
    numbered = [f"warning: {text}" for text in warnings]
    if len(warnings) > 1:
        numbered = ["\nWarnings", *(f"{number}. {text}" for number, text in enumerate(warnings, 1))]
    notes = [f"{note.level}: {note}" for note in first if note.level == NOTE]
    if detail == Detail.ALL:
        return "".join(map(page.lines, [*numbered, *notes]))
    short, left = [page.short(line) for line in notes], len(every) - len(first)
    where = f"{counted(left, 'more note')} in the report (--out)" if left else "notes in full: in the report (--out)"
    return "".join(map(page.lines, [*numbered, *short, *([where] if left or short != notes else [])]))


class Page(NamedTuple):
    """Page of output: its width in characters, None without a limit, and whether it has bold type."""

    width: int | None
    bold: bool

    def lines(self, text: str) -> str:
        """A text with line breaks between words at the width of the page, its control characters escaped."""
        text = escaped(text)
        if self.width is None:
            return f"{text}\n"
        broken = (wrap(part, self.width, break_long_words=False, break_on_hyphens=False) for part in text.split("\n"))
        return "".join(f"{line}\n" for lines in broken for line in lines or [""])

    def short(self, text: str) -> str:
        """As much of a note as fits in a line of the page."""
        return text if self.width is None else shorten(text, max(self.width, len("warning …")), placeholder=" …")

    def title(self, text: str) -> str:
        """A heading or a caption."""
        return f"\033[1m{self.lines(text)}\033[0m" if self.bold else self.lines(text)


def _render(block: Block, page: Page) -> str:
    match block:
        case Paragraph(text, role):
            return page.title(f"{ALARMS[role]}: {text}") if role in ALARMS else page.lines(text)
        case Verdict(paragraphs=paragraphs):
            return "".join(_render(paragraph, page) for paragraph in paragraphs)
        case Heading(text):
            return page.title(text)
        case Bullets(items):
            return "".join(map(page.lines, items))
        case Table():
            return _table(block, page)
    return ""


def _table(table: Table, page: Page) -> str:
    """A table; one wider than the page continues below with its first column repeated, so that no word is broken."""
    from rich import box
    from rich.console import Console
    from rich.table import Table as Grid

    rows = [[escaped(cell) for cell in row] for row in (table.header, *table.rows)]
    texts = [*zip(*rows, strict=True)]
    words = {0, *table.text_columns}
    paper = io.StringIO()
    console = Console(file=paper, width=page.width or WIDE, highlight=False, markup=False, color_system=None)
    for part in fitting_parts(texts, console.width):
        grid = Grid(box=box.SIMPLE_HEAD)
        for place, width in part:
            justify = "left" if place in words else "right"
            grid.add_column(rows[0][place], justify=justify, width=width, overflow="fold")  # type: ignore[arg-type]
        for row in rows[1:]:
            grid.add_row(*(row[place] for place, _ in part))
        console.print(grid)
    caption = page.title(table.caption) if table.caption else ""
    note = page.lines(table.note) if table.note else ""
    # rich fills every line to the width of the table and sets empty ones around it.
    lines = [line.rstrip() for line in paper.getvalue().splitlines()]
    body = "".join(f"{line}\n" for line in lines[1 if caption else 0 : len(lines) - 1 if note else None])
    return f"{caption}{body}{note}"


def fitting_parts(texts: Sequence[Sequence[str]], room: int) -> list[list[tuple[int, int]]]:
    """Parts of a table no wider than ``room``, each with the (place, width) of its columns; ``texts``: the cells by column.

    A column is never narrower than its longest word and its short cells, such as a value with its error. The first column is in
    every part, and its names are broken between words where that saves a part. Cells too wide for the room next to it are broken.
    """
    lengths = [[_length(line) for text in column for line in text.splitlines()] or [1] for column in texts]
    least = [_least(column) for column in texts]
    named = [_longest(word for text in texts[0] for word in text.split()), *least[1:]]
    ways = [_parts(widths, room - FRAME) for widths in (least, named)]
    widths, parts = min(ways, key=lambda way: len(way[1]))
    return [
        list(zip(part, _widths([(widths[place], lengths[place]) for place in part], room - FRAME), strict=True))
        for part in parts
    ]


def _parts(least: Sequence[int], room: int) -> tuple[list[int], list[list[int]]]:
    """Least widths that fit in the room, and the places of the columns of each part."""
    half = max(room // 2 - PADDING, 1)
    first = (
        min(least[0], max(half, room - 2 * PADDING - max(least[1:])))
        if len(least) > 1
        else min(least[0], room - PADDING)
    )
    limit = max(room - first - 2 * PADDING, 1)
    widths = [first, *(min(width, limit) for width in least[1:])]
    parts: list[list[int]] = [[0]]
    for column in range(1, len(least)):
        if sum(widths[place] + PADDING for place in [*parts[-1], column]) > room and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(column)
    return widths, parts


def _least(column: Sequence[str]) -> int:
    """Width of a column whose heading is broken between words, and of whose cells only long ones are."""
    return _longest([*column[0].split(), *(piece for text in column[1:] for piece in _pieces(text))])


def _longest(pieces: Iterable[str]) -> int:
    return max(map(_length, pieces), default=1)


def _length(text: str) -> int:
    """Columns that a text takes on a terminal."""
    from rich.cells import cell_len

    return cell_len(text)


def _pieces(text: str) -> list[str]:
    """Pieces of a cell that are never broken."""
    return [text] if len(text) <= SHORT or "±" in text else text.split()


def _widths(columns: Sequence[tuple[int, Sequence[int]]], room: int) -> list[int]:
    """Widths of columns from the least width and the lengths of the cells of each.

    The column with the most broken cells is widened first, of equal ones the narrowest.
    """
    widths = [least for least, _ in columns]
    spare = room - sum(width + PADDING for width in widths)
    while spare > 0:
        broken = [
            sum(length > width for length in lengths) for width, (_, lengths) in zip(widths, columns, strict=True)
        ]
        if not any(broken):
            break
        widths[min(range(len(widths)), key=lambda place: (-broken[place], widths[place]))] += 1
        spare -= 1
    return widths
