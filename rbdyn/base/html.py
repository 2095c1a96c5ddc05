"""A report as one HTML page that can be mailed: it fetches nothing and can be read without scripts and on paper.

Blocks are rendered with every text escaped. Whoever draws into a file asks ``is_copying`` and hands over the same picture as SVG
by ``add_copy``. ``page`` fills the skeleton ``page.html`` with the style sheet ``report.css``; ``result_page`` is that of a
command with a result and pictures: the blocks of the terminal first, the table of the identity last.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from html import escape
from importlib.resources import files as resources
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
from rbdyn.base.folder import OutputFolder, files_in
from rbdyn.base.identity import Identity, identity_line, identity_table
from rbdyn.base.words import filled_page
from rbdyn.base.workbook import NAME, write_workbook

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
IDENTIFIER, REFERENCE = re.compile(r' id="([^"]*)"'), re.compile(r'(?:url\(#|href="#)([^)"]+)')


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
    bare = IDENTIFIER.sub(lambda name: name[0] if name[1] in used else "", bare)
    view = VIEW.search(bare)
    box, width = (view[0], view[1]) if view else ("", "480")
    look = f'class="picture" style="max-width: {width}pt; stroke-linejoin: round; stroke-linecap: butt"'
    opening = f'<svg {box} {look} role="img" aria-label="{escape(words)}">'
    return OPENING.sub(lambda _: opening, bare, count=1).replace("xlink:href", "href")


REPORT = "report.html"
# Files that ``with_report`` adds to those of a command.
REPORT_FILES = (REPORT, NAME)
# Rows from which a table is folded.
LONG = 40


def write_with_report(
    folder: OutputFolder,
    identity: Identity | None,
    blocks: Callable[[], Sequence[Block]],
    write: Callable[[Path], object],
) -> list[str]:
    """Write ``with_report`` into the folder of a command, without an identity the files alone; names of the files, none without
    a folder. Raises OSError.
    """

    def make(stage: Path) -> list[str]:
        if identity is not None:
            return with_report(stage, folder.files, identity, blocks, write)
        write(stage)
        return files_in(stage, folder.files)

    return [] if folder.path is None else folder.write(make)


def with_report(
    folder: Path,
    files: Sequence[str],
    identity: Identity,
    blocks: Callable[[], Sequence[Block]],
    write: Callable[[Path], object],
    prefix: str = "",
) -> list[str]:
    """Let ``write`` write the files of a command into an empty ``folder``, then report.html with its pictures and tables.xlsx.

    files : patterns of their names; the names are returned in this order with the two further ones
    blocks : makes the blocks of the terminal
    prefix : before these two names, where the folder has others that must stay. Raises OSError.
    """
    with vector_copies() as pictures:
        write(folder)
    names = files_in(folder, files)
    report, workbook = f"{prefix}{REPORT}", f"{prefix}{NAME}"
    (folder / report).write_text(result_page(identity, blocks(), pictures), encoding="utf-8")
    write_workbook(folder / workbook, [folder / name for name in names if name.endswith(".csv")], identity)
    return [*names, report, workbook]


def page(
    title: str,
    heading: str,
    sections: Iterable[Section],
    widget: Callable[[str], str] = lambda name: "",
    notice: str = "",
    scripts: str = "",
) -> str:
    """A whole page.

    title, heading : name of the window, and the first heading
    widget : writes the place of a named interactive picture
    notice, scripts : HTML before the sections, and after them
    """
    chapters = list(sections)
    marks = {
        "TITLE": escape(title),
        "HEADING": escape(heading),
        "STYLE": _text("report.css"),
        "CONTENTS": "".join(f'<li><a href="#{part.key}">{escape(part.title)}</a></li>' for part in chapters),
        "NOTICE": notice,
        "SECTIONS": "\n".join(section(part, widget) for part in chapters),
        "SCRIPTS": scripts,
    }
    return filled_page(_text("page.html"), marks)


def result_page(identity: Identity, blocks: Sequence[Block], pictures: Mapping[str, str]) -> str:
    """Page of a result: its verdict, its blocks at every detail with long tables folded, its pictures (SVG by name), its identity."""
    opening = "".join(render(block) for block in blocks if isinstance(block, Verdict) and has_content(block))
    blocks = [_folded(block) for block in blocks if not isinstance(block, Verdict)]
    drawn = [Figures([picture], name) for name, picture in pictures.items()]
    parts = [
        Section("result", "Result", [identity_line(identity), *blocks]),
        Section("pictures", "Pictures", drawn),
        identity_section(identity),
    ]
    return page(identity.title, identity.title, [part for part in parts if part.blocks], notice=opening)


def _folded(block: Block) -> Block:
    """A long table folded below its caption; any other block as it is."""
    if isinstance(block, Table) and block.caption and len(block.rows) > LONG:
        return replace(block, folded=True)
    return block


def identity_section(identity: Identity) -> Section:
    """Section of a page: bearing, operating point, date, version, hashes of the input files."""
    return Section("identity", "Bearing, operating point, inputs", [replace(identity_table(identity), caption="")])


def _text(name: str) -> str:
    """A file of the page."""
    return resources("rbdyn.base").joinpath(name).read_text(encoding="utf-8")
