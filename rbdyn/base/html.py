"""Blocks as HTML, where every text is escaped, and vector copies of the pictures that a command draws, for its page.

Whoever draws into a file asks ``is_copying`` and hands over the same picture as SVG by ``add_copy``.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from html import escape
from itertools import groupby
from pathlib import Path

from rbdyn.base.blocks import (
    ALARMS,
    Block,
    Bullets,
    Figures,
    Heading,
    Paragraph,
    Remarks,
    Section,
    Table,
    Verdict,
    Widget,
    has_content,
)

# Classes of the style sheet by the role of a paragraph.
CLASSES = {"": "", "small": ' class="note"'} | {role: f' class="{role}"' for role in ("statement", "danger", "warning")}


def section(part: Section, widget: Callable[[str], str] = lambda name: "") -> str:
    """A section with its heading; ``widget`` writes the place of a named interactive picture."""
    body = []
    blocks = [block for block in part.blocks if has_content(block)]
    # Small tables that follow each other are set next to each other where there is room.
    for together, group in groupby(
        blocks, lambda block: isinstance(block, Table) and not block.folded and block.tiles is None
    ):
        pieces = [widget(block.name) if isinstance(block, Widget) else render(block) for block in group]
        body += [f'<div class="tables">{"".join(pieces)}</div>'] if together else pieces
    heading = f'<h2 id="{part.key}_title">{escape(part.title)}</h2>'
    opening = f'<section id="{part.key}" aria-labelledby="{part.key}_title">'
    return f"{opening}\n{heading}\n{''.join(body)}\n</section>"


def render(block: Block) -> str:
    """HTML of a block without scripts. Raises TypeError for a widget."""
    match block:
        case Paragraph(text, role):
            word = f"<strong>{ALARMS[role]}:</strong> " if role in ALARMS else ""
            return f"<p{CLASSES[role]}>{word}{prose(text)}</p>"
        case Verdict(paragraphs=paragraphs):
            return "".join(map(render, paragraphs))
        case Remarks(listed=listed):
            return "".join(f"<p>{note.level.capitalize()}: {prose(note)}</p>" for note in listed)
        case Heading(text):
            return f"<h3>{escape(text)}</h3>"
        case Bullets(items):
            return f"<ul>{''.join(f'<li>{prose(item)}</li>' for item in items)}</ul>"
        case Table():
            if block.tiles is None:
                return _table(block)
            tiles = "".join(_tile(block, row) for row in block.rows)
            return f'<dl class="tiles">{tiles}</dl>{_note(block)}'
        case Figures(pictures, caption, key):
            name = f' id="{key}"' if key else ""
            words = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
            four = " four" if len(pictures) == 4 and not key else ""
            images = "".join(picture if isinstance(picture, str) else picture() for picture in pictures)
            return f'<figure{name}><div class="pictures{four}">{images}</div>{words}</figure>'
    raise TypeError(f"{type(block).__name__} has no HTML of its own")


def prose(text: str) -> str:
    """Escaped text without line breaks between a number and its sign or unit."""
    return escape(text).replace(" %", "&nbsp;%").replace(" ± ", "&nbsp;±&nbsp;")


def _tile(table: Table, row: Sequence[str]) -> str:
    """A row as a tile: its name, the prominent value, and the other cells that are not empty, each with the unit of the name."""
    name, _, unit = row[0].rstrip("]").partition(" [")
    small = f' <span class="unit">{escape(unit)}</span>' if unit else ""
    further = "".join(
        f'<span class="beneath">{escape(f"{head} {cell}" if head in (table.tiles or ()) else f"{head} {cell} {unit}".rstrip())}</span>'
        for head, cell in zip(table.header[2:], row[2:], strict=True)
        if cell
    )
    return f'<div class="tile"><dt>{escape(name)}</dt><dd><strong>{escape(row[1])}{small}</strong>{further}</dd></div>'


def _note(table: Table) -> str:
    return f'<p class="note">{escape(table.note)}</p>' if table.note else ""


def _table(table: Table) -> str:
    words = {0, *table.text_columns}
    heads = enumerate(table.header)
    header = "".join(f"<th scope='col'{_kind(place, words)}>{escape(cell)}</th>" for place, cell in heads)
    rows = []
    for name, *cells in table.rows:
        columns = "".join(f"<td{_kind(place, words)}>{_cell(cell)}</td>" for place, cell in enumerate(cells, 1))
        rows.append(f"<tr><th scope='row'>{escape(name)}</th>{columns}</tr>")
    caption, sort = escape(table.caption), ' class="sortable"' if table.sortable else ""
    inside = f"<caption>{caption}</caption><thead><tr>{header}</tr></thead><tbody>{''.join(rows)}</tbody>"
    body = f'<div class="scroll" role="region" aria-label="{caption}"><table{sort}>{inside}</table></div>{_note(table)}'
    folded = f"<details><summary>{caption}</summary>{body}</details>"
    return folded if table.folded else f'<div class="table">{body}</div>'


def _cell(text: str) -> str:
    """Escaped text of a cell; a narrow page may break it before its error only."""
    return escape(text).replace(" %", "&nbsp;%").replace("± ", "±&nbsp;")


def _kind(place: int, words: set[int]) -> str:
    return " class='words'" if place in words else ""


_copies: ContextVar[dict[str, str] | None] = ContextVar("copies", default=None)
# What a page does not need of an SVG file: declarations, its style sheet (which would hold for the page), sizes, metadata.
FILE_ONLY = re.compile(r"^.*?(?=<svg)|<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", re.DOTALL)
OPENING, VIEW = re.compile(r"<svg[^>]*>"), re.compile(r'viewBox="\S+ \S+ (\S+) [^"]*"')
NAME, REFERENCE = re.compile(r' id="([^"]*)"'), re.compile(r'(?:url\(#|href="#)([^)"]+)')


@contextmanager
def vector_copies() -> Iterator[dict[str, str]]:
    """SVG of the pictures that are drawn inside, by their names in words."""
    copies: dict[str, str] = {}
    token = _copies.set(copies)
    try:
        yield copies
    finally:
        _copies.reset(token)


def is_copying() -> bool:
    """Whether a page is made of the pictures that are drawn now."""
    return _copies.get() is not None


def add_copy(path: Path, svg: str) -> None:
    """Hand over the picture of a file as the text of an SVG file."""
    copies = _copies.get()
    if copies is not None:
        words = path.stem.replace("_", " ")
        copies[words] = inline(svg, words)


def inline(svg: str, words: str) -> str:
    """An SVG file as an element of a page; ``words`` are for readers who cannot see it. Names that nothing refers to are dropped."""
    bare = FILE_ONLY.sub("", svg)
    used = set(REFERENCE.findall(bare))
    bare = NAME.sub(lambda name: name[0] if name[1] in used else "", bare)
    view = VIEW.search(bare)
    box, width = (view[0], view[1]) if view else ("", "480")
    look = f'class="picture" style="max-width: {width}pt; stroke-linejoin: round; stroke-linecap: butt"'
    opening = f'<svg {box} {look} role="img" aria-label="{escape(words)}">'
    return OPENING.sub(lambda _: opening, bare, count=1).replace("xlink:href", "href")
