"""The manual as one page of HTML: prose, keys, commands, equations, and the public functions by their docstrings."""

import ast
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer
from markdown_it import MarkdownIt
from markdown_it.renderer import RendererProtocol
from markdown_it.token import Token

from rbdyn.base.words import filled_page
from rbdyn.draft.options import OIL, TEMPERATURE_C, Options
from rbdyn.draft.text import scene_text
from rbdyn.plots.sketches import Sketch, ball_axes, clearances, roller_axes
from rbdyn.scene.keys import Key, Part, keys, lines

if TYPE_CHECKING:
    from rbdyn.scene import Scene

Named = ast.ClassDef | ast.FunctionDef
# An equation, its number, or the year of its source.
EQUATION = re.compile(r"\S = \S|\beqs? \d|\bSources?: |\b(18|19|20)\d\d\b")
# Begin of the text on a parameter in a docstring.
PARAMETER = re.compile(r"^(\w+(?:, \w+)*) : ", re.MULTILINE)


class Source(NamedTuple):
    """A module: its tree, and its lines for the comments next to the fields of a class."""

    tree: ast.Module
    lines: list[str]


Trees = Mapping[str, Source]


def trees_of(packages: Iterable[str]) -> dict[str, Source]:
    """Every module of the packages by its dotted name, in order of the names."""
    trees = {}
    for package in packages:
        root = Path(str(getattr(find_spec(package), "origin", None))).parent
        for path in (path for path in root.rglob("*.py") if path.name != "__main__.py"):
            parts = (package, *path.relative_to(root).with_suffix("").parts)
            name = ".".join(part for part in parts if part != "__init__")
            text = path.read_text(encoding="utf-8")
            trees[name] = Source(_unquoted(ast.parse(text)), text.splitlines())
    return dict(sorted(trees.items()))


def _unquoted(tree: ast.Module) -> ast.Module:
    """The tree with quoted types as types."""
    for node in ast.walk(tree):
        for key in ("annotation", "returns"):
            quoted = getattr(node, key, None)
            if isinstance(quoted, ast.Constant) and isinstance(quoted.value, str):
                setattr(node, key, ast.parse(quoted.value, mode="eval").body)
    return tree


def equations(trees: Trees, package: str) -> Iterator[str]:
    """Every module with an equation or a source: its docstring, and those in it with an equation or a source."""
    yield f"## `{package}`"
    for name, tree in _within(trees, package):
        nodes = (node for node in ast.walk(tree) if isinstance(node, Named))
        sources = [node for node in nodes if EQUATION.search(ast.get_docstring(node) or "")]
        docstring = ast.get_docstring(tree) or ""
        if sources or EQUATION.search(docstring):
            yield f"### `{name}`\n\n{markdown(docstring)}"
            for node in sorted(sources, key=lambda node: node.lineno):
                yield f"#### `{node.name}`\n\n{_signature(node, trees[name].lines)}{_text(node)}"


def library(trees: Trees, package: str) -> Iterator[str]:
    """Public names of a package and the packages in it, with signatures and docstrings, each once."""
    yield f"## `{package}`"
    listed = set()
    for name, tree in _within(trees, package):
        homes = [_home(trees, name, public) for public in _handed_on(tree, package)]
        fresh = [home for home in homes if home is not None and (home[0], home[1].name) not in listed]
        listed |= {(module, node.name) for module, node in fresh}
        if fresh:
            yield f"### `{name}`\n\n{markdown(ast.get_docstring(tree) or '')}"
            for module, node in fresh:
                yield f"#### `{name}.{node.name}`\n\n{_signature(node, trees[module].lines)}{_text(node)}"
                yield "\n".join(_members(trees, module, node))


def markdown(docstring: str) -> str:
    """A docstring as Markdown, with its lists of parameters and blocks of code."""
    return PARAMETER.sub(r"- ``\1``: ", re.sub("::$", ":", docstring, flags=re.MULTILINE))


def _within(trees: Trees, package: str) -> Iterator[tuple[str, ast.Module]]:
    return ((name, source.tree) for name, source in trees.items() if f"{name}.".startswith(f"{package}."))


def _public(node: ast.Module | ast.ClassDef) -> list[Named]:
    children = (child for child in node.body if isinstance(child, Named))
    return [child for child in children if not child.name.startswith("_") and ast.get_docstring(child)]


def _handed_on(tree: ast.Module, package: str) -> list[str]:
    """Names in ``__all__``; without it, names that a package of imports alone imports from itself."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return list(ast.literal_eval(node.value))
    if not all(isinstance(node, ast.ImportFrom | ast.Expr) for node in tree.body):
        return []
    imports = (node for node in tree.body if isinstance(node, ast.ImportFrom) and str(node.module).startswith(package))
    return [alias.name for node in imports for alias in node.names]


def _home(trees: Trees, module: str, name: str) -> tuple[str, Named] | None:
    """Module and definition of a name in a module; None outside these packages, and for a plain value."""
    for node in ast.walk(trees[module].tree) if module in trees else ():
        if isinstance(node, Named) and node.name == name:
            return module, node
        if isinstance(node, ast.ImportFrom) and name in (alias.name for alias in node.names):
            return _home(trees, str(node.module), name)
    return None


def _signature(node: Named, lines: list[str]) -> str:
    """Signature of a function as code; fields of a class with their comments."""
    if isinstance(node, ast.FunctionDef):
        return f"```python\n{node.name}({ast.unparse(node.args)}){_gives(node)}\n```\n\n"
    fields = (child for child in node.body if isinstance(child, ast.AnnAssign))
    code = (line for field in fields for line in lines[field.lineno - 1 : field.end_lineno])
    return "```python\n{}\n```\n\n".format("\n".join((f"class {node.name}", *code)))


def _gives(node: ast.FunctionDef) -> str:
    return f" -> {ast.unparse(node.returns)}" if node.returns else ""


def _text(node: Named) -> str:
    return markdown(ast.get_docstring(node) or "")


def _members(trees: Trees, module: str, node: Named) -> Iterator[str]:
    """Public methods and properties of a class and of those that it extends, an item each."""
    listed = set()
    waiting = [(module, node)]
    for home, parent in waiting:
        if isinstance(parent, ast.ClassDef):
            waiting += filter(None, (_home(trees, home, ast.unparse(base)) for base in parent.bases))
            for member in _public(parent):
                if member.name not in listed and isinstance(member, ast.FunctionDef):
                    listed.add(member.name)
                    read = any("property" in ast.unparse(decorator) for decorator in member.decorator_list)
                    call = member.name + ("" if read else f"({ast.unparse(member.args)})") + _gives(member)
                    text = _text(member).replace("\n", "\n  ")
                    yield f"- `{call}`: {text}"


OPTION = re.compile(r"(?<!\S)(--?[a-z][\w-]*)")
# Divisions of the manual by the number of their first file, and chapters whose modules are folded.
DIVISIONS = {"10": "Start", "20": "Tutorials", "30": "How-to guides", "50": "Explanation", "60": "Reference"}
FOLDED = ("equations", "library")
# Headings deeper than this are on the page and in the search, not in the contents.
DEEPEST = 3


class Heading(NamedTuple):
    """A heading in the contents."""

    level: int
    key: str
    html: str


def page(parts: Sequence[Part]) -> str:
    """The manual of these parts as one HTML page, the same bytes each time."""
    scene = roller_bearing()
    sketches = {name: sketch for part in parts for name, sketch in part.drawings(scene).items()}
    made = [(division, name, *rendered(text, name, sketches)) for division, name, text in chapters(parts)]
    contents: dict[str, list[str]] = {division: [] for division in DIVISIONS.values()}
    sections = []
    for division, name, headings, html in made:
        contents[division].append(_entry(headings))
        sections.append(f'<section aria-labelledby="{name}">\n{folded(html) if name in FOLDED else html}</section>')
    # A title in quotation marks is a link to its chapter.
    titles = {f"&quot;{headings[0].html}&quot;": headings[0].key for _, _, headings, _ in made}
    quoted = re.compile("|".join(map(re.escape, titles)))
    here = Path(__file__)
    marks = {
        "VERSION": escape(version("rbdyn")),
        "STYLE": here.with_name("manual.css").read_text(encoding="utf-8"),
        "SCRIPT": here.with_name("manual.js").read_text(encoding="utf-8"),
        "CONTENTS": "\n".join(
            f"<li><strong>{division}</strong><ol>{''.join(entries)}</ol></li>" for division, entries in contents.items()
        ),
        "SECTIONS": quoted.sub(lambda each: f'<a href="#{titles[each[0]]}">{each[0]}</a>', "\n".join(sections)),
    }
    return filled_page(here.with_name("manual.html").read_text(encoding="utf-8"), marks)


def chapters(parts: Sequence[Part]) -> Iterator[tuple[str, str, str]]:
    """Division, name and Markdown of each chapter, in the order of the file names; some continue with generated text."""
    trees = trees_of(part.package for part in parts)
    generated = {
        "keys": keys_of,
        "commands": commands_of,
        "equations": lambda part: equations(trees, part.package),
        "library": lambda part: library(trees, part.package),
        "tables": tables_of,
    }
    for path in sorted((path for part in parts for path in part.prose.glob("*.md")), key=lambda path: path.name):
        number, _, name = path.stem.partition("_")
        division = DIVISIONS[max(first for first in DIVISIONS if first <= number)]
        more = (block for part in parts for block in generated[name](part)) if name in generated else ()
        yield division, name, "\n\n".join((path.read_text(encoding="utf-8"), *more))


def tables_of(part: Part) -> Iterator[str]:
    """A heading for each group of tables, and each file with its columns."""
    for heading, sheets in part.tables().items():
        yield f"## {heading}"
        yield from (sheet.manual for sheet in sheets)


def rendered(text: str, chapter: str, sketches: Mapping[str, Sketch] | None = None) -> tuple[list[Heading], str]:
    """Headings and HTML of a chapter; every heading has a key of its own, its first that of the chapter.

    ``![what it shows](NAME)`` is the sketch of this name.
    """
    parser = MarkdownIt("commonmark", {"html": False}).enable("table").disable("lheading")
    parser.add_render_rule("code_inline", _code)
    known = sketches or {}
    parser.add_render_rule("image", lambda _, tokens, place, *__: _figure(known, tokens[place]))
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
    html = html.replace("<p><figure>", "<figure>").replace("</figure></p>", "</figure>")
    # A table may be wider than a narrow screen.
    return headings, html.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")


def folded(html: str) -> str:
    """The HTML of a chapter with each module folded: its heading is the summary, which opens the rest."""
    pieces = re.split(r"(?=<h[34] )", html)
    opened = (re.sub(r"(<h4 .*?</h4>)", r"<summary>\1</summary>", piece, count=1) for piece in pieces)
    return "".join(f"<details>{piece}</details>" if piece.startswith("<summary>") else piece for piece in opened)


def _code(renderer: RendererProtocol, tokens: Sequence[Token], place: int, *_: Any) -> str:
    """Code within a line; no line breaks inside an option."""
    return "<code>{}</code>".format(OPTION.sub(r"<span>\1</span>", escape(tokens[place].content)))


def _figure(sketches: Mapping[str, Sketch], token: Token) -> str:
    """A sketch with its caption; the words in brackets are for those who cannot see it."""
    sketch = sketches[str(token.attrs["src"])]
    svg = sketch.svg.replace("<svg ", f'<svg role="img" aria-label="{escape(token.content)}" ', 1)
    return f"<figure>{svg}<figcaption>{escape(sketch.caption)}</figcaption></figure>"


def _entry(headings: Sequence[Heading]) -> str:
    """A chapter in the contents, with its headings folded."""
    entries = (heading for heading in headings if heading.level <= DEEPEST)
    title, *inner = (f'<a class="l{entry.level}" href="#{entry.key}">{entry.html}</a>' for entry in entries)
    return f"<li><details><summary>{title}</summary>{''.join(inner)}</details></li>" if inner else f"<li>{title}</li>"


def keys_of(part: Part) -> Iterator[str]:
    """A heading for each kind of file, table and key, and what the key means."""
    tables: dict[tuple[str, str], list[Key]] = {}
    for key in keys(part.kinds):
        tables.setdefault((key.file, key.key.rpartition(".")[0]), []).append(key)
    kind = ""
    for (file, table), members in tables.items():
        if file != kind:
            kind = file
            yield f"## {file.capitalize()}"
        yield f"### {file}, " + (f"table `{table}`" if table else "outside all tables")
        for key in members:
            head = lines(key)[0].removeprefix(f"{key.key}: ")
            # Its description, and the fields of a key after it.
            texts = (plain(str(field)) for field in (head, *key[Key._fields.index("description") :]))
            yield "\n\n".join((f"#### `{key.key}`", *texts))


def commands_of(part: Part) -> Iterator[str]:
    """A heading for each command: its usage, purpose and options."""
    for name, command in part.commands.commands.items():
        title = f"{part.package} {name}"
        context = typer.Context(command, info_name=title)
        usage = " ".join(command.get_usage(context).removeprefix("Usage: ").split())
        records = filter(None, (parameter.get_help_record(context) for parameter in command.params))
        options = "\n".join(f"- `{option}`: {plain(text)}" for option, text in records)
        yield f"## `{title}`\n\n```sh\n{usage}\n```\n\n{plain(command.help)}\n\n{options}"


def plain(text: str) -> str:
    """Text without emphasis in Markdown."""
    return text.replace("*", r"\*")


ROLLERS, BALLS = "NU210", "7210B"


def roller_bearing() -> "Scene":
    """The roller bearing that the manual takes from its name to clearances."""
    from rbdyn.scene import Scene

    return Scene.from_dict(scene_of(ROLLERS), ROLLERS)


def drawings(scene: "Scene") -> Mapping[str, Sketch]:
    """The drawings by the names that chapters use; those of rollers are of the scene."""
    from rbdyn.scene.ball import SingleRowScene

    balls = SingleRowScene.from_dict(scene_of(BALLS), BALLS)
    return {"clearances": clearances(scene), "roller_axes": roller_axes(scene), "ball_axes": ball_axes(balls)}


def scene_of(designation: str, options: Mapping[str, str] | None = None) -> dict[str, Any]:
    """The scene that ``rbdyn new`` writes of a designation and options."""
    texts: dict[str, str | None] = {"--oil": OIL, "--temperature": f"{TEMPERATURE_C:g}", **(options or {})}
    return tomllib.loads(scene_text(designation, Options(texts)))
