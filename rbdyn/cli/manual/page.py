"""The page: chapters in Markdown, with keys of input files and options of commands of every floor of the house, put into one
HTML file with contents and search."""

import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import typer
from markdown_it import MarkdownIt
from markdown_it.renderer import RendererProtocol
from markdown_it.token import Token
from pydantic import BaseModel

from rbdyn.base.words import filled_page
from rbdyn.cli.keys import Key, keys, lines
from rbdyn.cli.manual.docstrings import equations, library, trees_of

OPTION = re.compile(r"(?<!\S)(--?[a-z][\w-]*)")
# Headings deeper than this stand on the page and in the search, not in the contents.
DEEPEST = 3


class Part(NamedTuple):
    """A package with its chapters, its command and the kinds of its input files."""

    package: str
    prose: Path  # folder of chapters, NN_name.md
    commands: Any  # group of commands, as typer makes it
    kinds: Mapping[str, type[BaseModel]]


class Heading(NamedTuple):
    """A heading as it stands in the contents."""

    level: int
    key: str
    html: str


def page(parts: Sequence[Part]) -> str:
    """The manual of these parts as one HTML page, the same bytes each time."""
    contents, sections = [], []
    for name, text in chapters(parts):
        headings, html = rendered(text, name)
        contents.append(_entry(headings))
        sections.append(f'<section aria-labelledby="{name}">\n{html}</section>')
    here = Path(__file__)
    marks = {
        "VERSION": escape(version("rbdyn")),
        "STYLE": here.with_name("manual.css").read_text(encoding="utf-8"),
        "SCRIPT": here.with_name("manual.js").read_text(encoding="utf-8"),
        "CONTENTS": "\n".join(contents),
        "SECTIONS": "\n".join(sections),
    }
    return filled_page(here.with_name("manual.html").read_text(encoding="utf-8"), marks)


def chapters(parts: Sequence[Part]) -> Iterator[tuple[str, str]]:
    """Name and Markdown of each chapter, in the order of the file names; some go on with what is generated."""
    trees = trees_of(part.package for part in parts)
    generated = {
        "keys": keys_of,
        "commands": commands_of,
        "equations": lambda part: equations(trees, part.package),
        "library": lambda part: library(trees, part.package),
    }
    for path in sorted((path for part in parts for path in part.prose.glob("*.md")), key=lambda path: path.name):
        name = path.stem.partition("_")[2]
        more = (block for part in parts for block in generated[name](part)) if name in generated else ()
        yield name, "\n\n".join((path.read_text(encoding="utf-8"), *more))


def rendered(text: str, chapter: str) -> tuple[list[Heading], str]:
    """Headings and HTML of a chapter; every heading has a key of its own, its first that of the chapter."""
    parser = MarkdownIt("commonmark", {"html": False}).enable("table").disable("lheading")
    parser.add_render_rule("code_inline", _code)
    tokens = parser.parse(text)
    headings: list[Heading] = []
    keys: dict[str, int] = {}
    for opening, inline, closing in zip(tokens, tokens[1:], tokens[2:], strict=False):
        if opening.type == "heading_open":
            level = int(opening.tag[1])
            words = re.sub(r"[^\w.]+", "-", inline.content).strip("-")
            key = f"{chapter}-{words}" if headings else chapter
            keys[key] = keys.get(key, 0) + 1
            key += f"-{keys[key]}" if keys[key] > 1 else ""
            opening.attrSet("id", key)
            # The title of the page is the only one of the first level.
            opening.tag = closing.tag = f"h{level + 1}"
            headings.append(Heading(level, key, parser.renderInline(inline.content)))
    html = parser.renderer.render(tokens, parser.options, {})
    # A table may be wider than a narrow screen.
    return headings, html.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")


def _code(renderer: RendererProtocol, tokens: Sequence[Token], place: int, *_: Any) -> str:
    """Code within a line, whose options a line never breaks."""
    return "<code>{}</code>".format(OPTION.sub(r"<span>\1</span>", escape(tokens[place].content)))


def _entry(headings: Sequence[Heading]) -> str:
    """A chapter in the contents, with what is in it folded."""
    shown = (each for each in headings if each.level <= DEEPEST)
    title, *inner = (f'<a class="l{each.level}" href="#{each.key}">{each.html}</a>' for each in shown)
    return f"<li><details><summary>{title}</summary>{''.join(inner)}</details></li>" if inner else f"<li>{title}</li>"


def keys_of(part: Part) -> Iterator[str]:
    """A heading a kind of file, a table and a key, and what the key means."""
    tables: dict[tuple[str, str], list[Key]] = {}
    for key in keys(part.kinds):
        tables.setdefault((key.file, key.key.rpartition(".")[0]), []).append(key)
    kind = ""
    for (file, table), found in tables.items():
        if file != kind:
            kind = file
            yield f"## {file.capitalize()}"
        yield f"### {file}, " + (f"table `{table}`" if table else "outside all tables")
        for key in found:
            head = lines(key)[0].removeprefix(f"{key.key}: ")
            # Its description, and what else a key says behind it.
            told = (plain(str(each)) for each in (head, *key[Key._fields.index("description") :]))
            yield "\n\n".join((f"#### `{key.key}`", *told))


def commands_of(part: Part) -> Iterator[str]:
    """A heading a command: its usage, what it does, its options."""
    for name, command in part.commands.commands.items():
        whole = f"{part.package} {name}"
        context = typer.Context(command, info_name=whole)
        usage = " ".join(command.get_usage(context).removeprefix("Usage: ").split())
        records = filter(None, (each.get_help_record(context) for each in command.params))
        options = "\n".join(f"- `{option}`: {plain(says)}" for option, says in records)
        yield f"## `{whole}`\n\n```sh\n{usage}\n```\n\n{plain(command.help)}\n\n{options}"


def plain(text: str) -> str:
    """Text in which Markdown sees no emphasis."""
    return text.replace("*", r"\*")
