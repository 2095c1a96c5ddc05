"""Blocks as text in the width of the terminal. Loads ``rich`` only for tables."""

import io
import os
import shutil
import sys
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import NamedTuple

from rbdyn.base.blocks import Block, Bullets, Detail, Heading, Note, Paragraph, Table, Tiles, says

# Characters around the text of each column of a table, and around the whole table.
PADDING, FRAME = 3, 1
# Longest cell that is never broken.
SHORT = 20
# Width of tables in a file or a pipe.
WIDE = 160


def show(blocks: Iterable[Block], detail: Detail = Detail.USUAL) -> None:
    """Print blocks on standard output, within the width of a terminal."""
    if not sys.stdout.isatty():
        print(text(blocks, detail), end="")
        return
    bold = os.environ.get("TERM", "dumb") != "dumb"
    print(text(blocks, detail, shutil.get_terminal_size().columns, bold), end="")


def text(blocks: Iterable[Block], detail: Detail = Detail.USUAL, width: int | None = None, bold: bool = False) -> str:
    """Text of the blocks up to a level of detail, each on lines of its own, without pictures.

    width : columns of the terminal; None for a file, whose sentences are one line each.
    bold : whether headings and captions are in bold type.
    """
    page = Page(width, bold)
    written = ""
    for block in blocks:
        if block.detail <= detail and says(block):
            titled = isinstance(block, Heading) or (isinstance(block, Table | Tiles) and block.caption)
            written += ("\n" if titled and written and not written.endswith("\n\n") else "") + _render(block, page)
    return written


class Page(NamedTuple):
    """Page of output: its width in characters, None without a limit, and whether it has bold type."""

    width: int | None
    bold: bool

    def lines(self, text: str) -> str:
        """A text with line breaks between words at the width of the page."""
        if self.width is None:
            return f"{text}\n"
        broken = (wrap(part, self.width, break_long_words=False, break_on_hyphens=False) for part in text.split("\n"))
        return "".join(f"{line}\n" for lines in broken for line in lines or [""])

    def title(self, text: str) -> str:
        """A heading or a caption."""
        return f"\033[1m{self.lines(text)}\033[0m" if self.bold else self.lines(text)


def _render(block: Block, page: Page) -> str:
    match block:
        case Paragraph(text):
            return page.lines(text)
        case Note(text):
            return page.lines(f"note: {text}")
        case Heading(text):
            return page.title(text)
        case Bullets(items):
            return "".join(map(page.lines, items))
        case Tiles():
            return _table(block.table, page)
        case Table():
            return _table(block, page)
    return ""


def _table(table: Table, page: Page) -> str:
    """A table; one wider than the page continues below with its first column repeated, so that no word is broken."""
    from rich import box
    from rich.console import Console
    from rich.table import Table as Grid

    texts = [*zip(table.header, *table.rows, strict=True)]
    words = {0, *table.text_columns}
    paper = io.StringIO()
    console = Console(file=paper, width=page.width or WIDE, highlight=False, markup=False, color_system=None)
    for part in fitting_parts(texts, console.width):
        grid = Grid(box=box.SIMPLE_HEAD)
        for place, width in part:
            justify = "left" if place in words else "right"
            grid.add_column(table.header[place], justify=justify, width=width, overflow="fold")  # type: ignore[arg-type]
        for row in table.rows:
            grid.add_row(*(row[place] for place, _ in part))
        console.print(grid)
    caption = page.title(table.caption) if table.caption else ""
    note = page.lines(table.note) if table.note else ""
    # rich fills every line to the width of the table.
    body = "".join(f"{line.rstrip()}\n" for line in paper.getvalue().splitlines())
    return f"{caption}{body}{note}"


def fitting_parts(texts: Sequence[Sequence[str]], room: int) -> list[list[tuple[int, int]]]:
    """Parts of a table no wider than ``room``, each with the (place, width) of its columns; ``texts``: the cells by column.

    A column is never narrower than its longest word and its short cells, such as a value with its error. The first column is in
    every part. Cells too wide for the room next to it are broken.
    """
    from rich.cells import cell_len

    room -= FRAME
    whole_cells = ([*column[0].split(), *(part for text in column[1:] for part in _pieces(text))] for column in texts)
    least = [max(map(cell_len, cells), default=1) for cells in whole_cells]
    whole = [max((cell_len(line) for text in column for line in text.splitlines()), default=1) for column in texts]
    first = min(least[0], max(room // 2 - PADDING, 1)) if len(texts) > 1 else min(least[0], room - PADDING)
    limit = max(room - first - 2 * PADDING, 1)
    least = [first, *(min(width, limit) for width in least[1:])]
    parts: list[list[int]] = [[0]]
    for column in range(1, len(texts)):
        if sum(least[place] + PADDING for place in [*parts[-1], column]) > room and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(column)
    return [
        list(zip(part, _widths([(least[place], whole[place]) for place in part], room), strict=True)) for part in parts
    ]


def _pieces(text: str) -> list[str]:
    """Pieces of a cell that are never broken."""
    return text.split() if len(text) > SHORT else [text]


def _widths(ends: Sequence[tuple[int, int]], room: int) -> list[int]:
    """Widths of columns between their least and their whole width, the narrowest widened first."""
    widths = [least for least, _ in ends]
    spare = room - sum(width + PADDING for width in widths)
    while spare > 0:
        short = [place for place, (_, whole) in enumerate(ends) if widths[place] < whole]
        if not short:
            break
        widths[min(short, key=lambda place: widths[place])] += 1
        spare -= 1
    return widths
