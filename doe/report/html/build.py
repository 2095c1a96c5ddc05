"""The page, put together from its parts: blocks as HTML; every text is escaped here."""

import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from itertools import groupby
from typing import Any

from doe.report.html.data import page_data
from doe.report.sections import sections
from doe.report.sections.blocks import Block, Bullets, Figures, Heading, Section, Table, Tile, Tiles, Widget, Words
from doe.report.sections.contents import title
from doe.report.sections.record import Record, known
from rbdyn.records.words import filled_page

# In the order in which they need each other; the moving bearing is drawn by the script of ``rbdyn show``.
SCRIPTS = {
    "page": ("page.js", "tables.js"),
    "surface": ("model.js", "emulator.js", "viridis.js", "contours.js", "surface.js", "surface_view.js"),
    "front": ("front.js",),
    "bearing": ("motion.js",),
}


def html_report(summary: Record, motion: Mapping[str, Any] | None = None) -> str:
    """A study as one HTML page.

    summary : record of ``doe study --json``; parts that are missing or null are left out.
    motion : record of ``doe.clearance.motion_record``; without it nothing moves.
    """
    clean = known(dict(summary))
    moving = known(dict(motion or {}))
    found = sections(clean, moving)
    widgets = {block.name for section in found for block in section.blocks if isinstance(block, Widget)}
    marks = {
        "TITLE": escape(title(clean)),
        "STYLE": text("report.css"),
        "CONTENTS": "".join(f'<li><a href="#{each.key}">{escape(each.title)}</a></li>' for each in found),
        "SECTIONS": "\n".join(_section(each) for each in found),
        "DATA": _json(page_data(clean, moving)),
        "SCRIPTS": "\n".join(f"<script>\n{script}</script>" for script in _scripts(widgets)),
    }
    return filled_page(text("page.html"), marks)


def text(name: str) -> str:
    """A file of this package."""
    return files("doe.report.html").joinpath(name).read_text(encoding="utf-8")


def _section(section: Section) -> str:
    body = []
    # Small tables that follow each other stand beside each other where there is room.
    for together, blocks in groupby(section.blocks, lambda block: isinstance(block, Table) and not block.folded):
        parts = [text(f"{block.name}.html") if isinstance(block, Widget) else render(block) for block in blocks]
        body += [f'<div class="tables">{"".join(parts)}</div>'] if together else parts
    heading = f'<h2 id="{section.key}_title">{escape(section.title)}</h2>'
    opening = f'<section id="{section.key}" aria-labelledby="{section.key}_title">'
    return f"{opening}\n{heading}\n{''.join(body)}\n</section>"


def _scripts(widgets: set[str]) -> list[str]:
    found = []
    for part, names in SCRIPTS.items():
        if part in widgets | {"page"}:
            if part == "bearing":
                found.append(files("rbdyn").joinpath("plots", "bearing.js").read_text(encoding="utf-8"))
            found += [text(name) for name in names]
    return found


def _json(record: Mapping[str, Any]) -> str:
    """Data inside a script element: no name in it can end the element."""
    return json.dumps(record, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def render(block: Block) -> str:
    """HTML of a block that needs no scripts."""
    match block:
        case Words(text, role):
            return f'<p class="{role}">{prose(text)}</p>' if role else f"<p>{prose(text)}</p>"
        case Heading(text):
            return f"<h3>{escape(text)}</h3>"
        case Bullets(items):
            return f"<ul>{''.join(f'<li>{prose(item)}</li>' for item in items)}</ul>"
        case Tiles(tiles):
            return f'<dl class="tiles">{"".join(map(_tile, tiles))}</dl>'
        case Table():
            return _table(block)
        case Figures(pictures, caption, key):
            name = f' id="{key}"' if key else ""
            words = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
            four = " four" if len(pictures) == 4 and not key else ""
            return f'<figure{name}><div class="pictures{four}">{"".join(pictures)}</div>{words}</figure>'
    raise TypeError(f"{type(block).__name__} has no HTML of its own")


def prose(text: str) -> str:
    """Escaped text whose numbers stay with their signs and units."""
    return escape(text).replace(" %", "&nbsp;%").replace(" ± ", "&nbsp;±&nbsp;")


def _tile(tile: Tile) -> str:
    unit = f' <span class="unit">{escape(tile.unit)}</span>' if tile.unit else ""
    beneath = "".join(f'<span class="beneath">{escape(words)}</span>' for words in tile.beneath)
    return f'<div class="tile"><dt>{escape(tile.name)}</dt><dd><strong>{escape(tile.value)}{unit}</strong>{beneath}</dd></div>'


def _table(table: Table) -> str:
    words = {0, *table.text_columns}
    heads = enumerate(table.header)
    header = "".join(f"<th scope='col'{_kind(place, words)}>{escape(cell)}</th>" for place, cell in heads)
    rows = []
    for name, *cells in table.rows:
        columns = "".join(f"<td{_kind(place, words)}>{_cell(cell)}</td>" for place, cell in enumerate(cells, 1))
        rows.append(f"<tr><th scope='row'>{escape(name)}</th>{columns}</tr>")
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    caption, sort = escape(table.caption), ' class="sortable"' if table.sortable else ""
    inside = f"<caption>{caption}</caption><thead><tr>{header}</tr></thead><tbody>{''.join(rows)}</tbody>"
    body = f'<div class="scroll" role="region" aria-label="{caption}"><table{sort}>{inside}</table></div>{note}'
    folded = f"<details><summary>{caption}</summary>{body}</details>"
    return folded if table.folded else f'<div class="table">{body}</div>'


def _cell(text: str) -> str:
    """Escaped; on a narrow page it may break before its error, nowhere else."""
    return escape(text).replace(" %", "&nbsp;%").replace("± ", "±&nbsp;")


def _kind(place: int, words: set[int]) -> str:
    return " class='words'" if place in words else ""
