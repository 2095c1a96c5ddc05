"""Blocks as Markdown; marks of Markdown and HTML in their texts are escaped."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

from rbdyn.base.blocks import ALARMS, Block, Bullets, Heading, Paragraph, Remarks, Section, Table, Tiles, Verdict, says

# Rows of a table that a text has whole, and the page that has all of a longer one.
LONG, WHOLE = 12, "report.html"
# Characters to escape: marks of Markdown anywhere, underscores at the edge of a word, links.
SPECIAL = re.compile(r"[\\`*|]|(?<![^\W_])_|_(?![^\W_])|(?<=\])[(\[:]|^(?:[#>+-]|\d+\.)(?=\s)")
HTML = {"&": "&amp;", "<": "&lt;"}


def page(title: str, sections: Iterable[Section], pictures: Sequence[str] = ()) -> str:
    """A whole text; ``pictures`` are files next to it."""
    parts = [f"# {plain(title)}"]
    for section in sections:
        if written := text(section.blocks):
            parts += [f"## {plain(section.title)}", written]
    if pictures:
        parts.append("## Pictures")
        parts += [f"![{plain(name.rsplit('.', 1)[0].replace('_', ' '))}](<{name}>)" for name in pictures]
    return "\n\n".join(parts) + "\n"


def text(blocks: Iterable[Block]) -> str:
    """Blocks with an empty line between them; pictures are left out."""
    return "\n\n".join(written for block in blocks if says(block) and (written := _render(block)))


def plain(text: str) -> str:
    """Escaped text, which Markdown renders unchanged."""
    text = SPECIAL.sub(lambda mark: f"\\{mark[0]}", text.replace("\n", " "))
    return re.sub("[&<]", lambda mark: HTML[mark[0]], text)


def _render(block: Block) -> str:
    match block:
        case Paragraph(text, role) if role in ALARMS:
            return f"**{ALARMS[role]}: {plain(text)}**"
        case Paragraph(text, role):
            return f"**{plain(text)}**" if role == "statement" else plain(text)
        case Verdict(paragraphs=paragraphs):
            return "\n\n".join(map(_render, paragraphs))
        case Remarks(listed=listed):
            return "\n".join(f"- {note.level}: {plain(note)}" for note in listed)
        case Heading(text):
            return f"### {plain(text)}"
        case Bullets(items):
            return "\n".join(f"- {plain(item)}" for item in items)
        case Tiles():
            return _table(block.table)
        case Table():
            return _table(block)
    return ""


def _table(table: Table) -> str:
    """A table; of a long one the first rows and where all are, of a long folded one only the latter."""
    words = {0, *table.text_columns}
    lines = [f"**{plain(table.caption)}**", ""] if table.caption else []
    count = len(table.rows)
    if count > LONG:
        place = plain(table.file or WHOLE)
        if table.folded:
            return "\n".join([*lines, f"{count} rows, in {place}."])
        rest = f"The first {LONG} of {count} rows; all are in {place}."
        table = replace(table, rows=table.rows[:LONG], note=". ".join(filter(None, (table.note.rstrip("."), rest))))
    lines.append(_row(table.header))
    lines.append("|" + "|".join(" :-- " if place in words else " --: " for place in range(len(table.header))) + "|")
    lines += [_row(row) for row in table.rows]
    return "\n".join(lines + (["", plain(table.note)] if table.note else []))


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(map(plain, cells)) + " |"
