"""Blocks as the text of a terminal, as wide as that is. Loads ``rich`` only where there is a table."""

import io
import os
import shutil
import sys
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import NamedTuple

from rbdyn.base.blocks import Block, Bullets, Detail, Heading, Note, Paragraph, Table, Tiles, says

# Columns of the terminal about the text of a table's column, and about all of them.
PADDING, FRAME = 3, 1
# Characters of a cell that is never broken.
SHORT = 20
# Width of a file or a pipe, which has none of its own: enough for any table.
WIDE = 160


def show(blocks: Iterable[Block], detail: Detail = Detail.USUAL) -> None:
    """Print blocks on standard output; on a terminal no line is longer than that is wide."""
    if not sys.stdout.isatty():
        print(text(blocks, detail), end="")
        return
    bold = os.environ.get("TERM", "dumb") != "dumb"
    print(text(blocks, detail, shutil.get_terminal_size().columns, bold), end="")


def text(blocks: Iterable[Block], detail: Detail = Detail.USUAL, width: int | None = None, bold: bool = False) -> str:
    """The blocks that a reader asks for, each on lines of its own; pictures are left out.

    width : columns of the terminal; None for a file, whose sentences are one line each.
    bold : whether headings and captions are.
    """
    page = Page(width, bold)
    written = ""
    for block in blocks:
        if block.detail <= detail and says(block):
            titled = isinstance(block, Heading) or (isinstance(block, Table | Tiles) and block.caption)
            written += ("\n" if titled and written and not written.endswith("\n\n") else "") + _render(block, page)
    return written


class Page(NamedTuple):
    """What is written to: its columns, None without an end, and whether it knows bold type."""

    width: int | None
    bold: bool

    def lines(self, text: str) -> str:
        """A text broken between words where the page ends."""
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
    """A table; one that is wider than the terminal goes on below, its first column repeated, for no word is broken."""
    from rich import box
    from rich.console import Console
    from rich.table import Table as Grid

    texts = [*zip(table.header, *table.rows, strict=True)]
    words = {0, *table.text_columns}
    paper = io.StringIO()
    console = Console(file=paper, width=page.width or WIDE, highlight=False, markup=False, color_system=None)
    for part in parts(texts, console.width):
        grid = Grid(box=box.SIMPLE_HEAD)
        for place, wide in part:
            justify = "left" if place in words else "right"
            grid.add_column(table.header[place], justify=justify, width=wide, overflow="fold")  # type: ignore[arg-type]
        for row in table.rows:
            grid.add_row(*(row[place] for place, _ in part))
        console.print(grid)
    caption = page.title(table.caption) if table.caption else ""
    note = page.lines(table.note) if table.note else ""
    # rich fills every line to the width of the table.
    body = "".join(f"{line.rstrip()}\n" for line in paper.getvalue().splitlines())
    return f"{caption}{body}{note}"


def parts(texts: Sequence[Sequence[str]], room: int) -> list[list[tuple[int, int]]]:
    """Columns of texts (one sequence of cells a column), in parts that are no wider than ``room``: (place, width) of each.

    A column is never narrower than its longest word and its short cells, such as a value with its error; the first stands in
    every part. What has no room next to the first column is broken.
    """
    from rich.cells import cell_len

    room -= FRAME
    whole_cells = ([*column[0].split(), *(part for text in column[1:] for part in _pieces(text))] for column in texts)
    least = [max(map(cell_len, cells), default=1) for cells in whole_cells]
    whole = [max((cell_len(line) for text in column for line in text.splitlines()), default=1) for column in texts]
    first = min(least[0], max(room // 2 - PADDING, 1)) if len(texts) > 1 else min(least[0], room - PADDING)
    widest = max(room - first - 2 * PADDING, 1)
    least = [first, *(min(each, widest) for each in least[1:])]
    found: list[list[int]] = [[0]]
    for place in range(1, len(texts)):
        if sum(least[each] + PADDING for each in [*found[-1], place]) > room and len(found[-1]) > 1:
            found.append([0])
        found[-1].append(place)
    return [
        list(zip(part, _widths([(least[each], whole[each]) for each in part], room), strict=True)) for part in found
    ]


def _pieces(text: str) -> list[str]:
    """What of a cell stands in one line."""
    return text.split() if len(text) > SHORT else [text]


def _widths(ends: Sequence[tuple[int, int]], room: int) -> list[int]:
    """Widths from the least to the whole of each column, as far as there is room: the least is widened first."""
    widths = [least for least, _ in ends]
    spare = room - sum(width + PADDING for width in widths)
    while spare > 0:
        short = [place for place, (_, whole) in enumerate(ends) if widths[place] < whole]
        if not short:
            break
        widths[min(short, key=lambda place: widths[place])] += 1
        spare -= 1
    return widths
