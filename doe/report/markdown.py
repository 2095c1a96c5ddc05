"""A study as Markdown: the same answer and tables as the page, with links to the pictures."""

import re
from collections.abc import Sequence

from doe.report.sections import sections
from doe.report.sections.blocks import Block, Bullets, Heading, Table, Tiles, Words
from doe.report.sections.contents import title
from doe.report.sections.record import Record, known

# What Markdown or the HTML in it would take for its own: marks anywhere, underscores at the rim of a word, links.
SPECIAL = re.compile(r"[\\`*|]|(?<![^\W_])_|_(?![^\W_])|(?<=\])[(\[:]|^(?:[#>+-]|\d+\.)(?=\s)")
HTML = {"&": "&amp;", "<": "&lt;"}


def markdown_report(summary: Record, pictures: Sequence[str] = ()) -> str:
    """Markdown of the record of ``doe study --json``; ``pictures`` are files beside it."""
    clean = known(dict(summary))
    parts = [f"# {_plain(title(clean))}"]
    for section in sections(clean):
        written = [text for block in section.blocks if (text := _render(block))]
        if written:
            parts += [f"## {_plain(section.title)}", *written]
    if pictures:
        parts.append("## Pictures")
        parts += [f"![{_plain(name.rsplit('.', 1)[0].replace('_', ' '))}](<{name}>)" for name in pictures]
    return "\n\n".join(parts) + "\n"


def _render(block: Block) -> str:
    match block:
        case Words(text, role):
            return f"**{_plain(text)}**" if role == "statement" else _plain(text)
        case Heading(text):
            return f"### {_plain(text)}"
        case Bullets(items):
            return "\n".join(f"- {_plain(item)}" for item in items)
        case Tiles(tiles):
            rows = [(each.name, f"{each.value} {each.unit}".strip(), ", ".join(each.beneath)) for each in tiles]
            return _table(Table("", ("clearance", "value", ""), rows, text_columns=(2,)))
        case Table():
            return _table(block)
    return ""


def _table(table: Table) -> str:
    words = {0, *table.text_columns}
    lines = [f"**{_plain(table.caption)}**", ""] if table.caption else []
    lines.append(_row(table.header))
    lines.append("|" + "|".join(" :-- " if place in words else " --: " for place in range(len(table.header))) + "|")
    lines += [_row(row) for row in table.rows]
    return "\n".join(lines + (["", _plain(table.note)] if table.note else []))


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(map(_plain, cells)) + " |"


def _plain(text: str) -> str:
    """Text as it stands: no mark of it is Markdown or HTML."""
    text = SPECIAL.sub(lambda mark: f"\\{mark[0]}", text.replace("\n", " "))
    return re.sub("[&<]", lambda mark: HTML[mark[0]], text)
