"""Docstrings as Markdown. They are read from the source: nothing is imported, so nothing heavy is loaded."""

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

Named = ast.ClassDef | ast.FunctionDef
# An equation, its number, or the year of what it is from.
EQUATION = re.compile(r"\S = \S|\beqs? \d|\bSources?: |\b(18|19|20)\d\d\b")
# How a docstring begins what it says of a parameter.
PARAMETER = re.compile(r"^(\w+(?:, \w+)*) : ", re.MULTILINE)


class Source(NamedTuple):
    """A module: what it says, and its lines, for comments stand beside the fields of a class."""

    tree: ast.Module
    lines: list[str]


Trees = Mapping[str, Source]


def trees_of(packages: Iterable[str]) -> dict[str, Source]:
    """Every module of the packages by its dotted name, in order of the names."""
    found = {}
    for package in packages:
        root = Path(str(getattr(find_spec(package), "origin", None))).parent
        for path in (each for each in root.rglob("*.py") if each.name != "__main__.py"):
            parts = (package, *path.relative_to(root).with_suffix("").parts)
            name = ".".join(part for part in parts if part != "__init__")
            text = path.read_text(encoding="utf-8")
            found[name] = Source(_unquoted(ast.parse(text)), text.splitlines())
    return dict(sorted(found.items()))


def _unquoted(tree: ast.Module) -> ast.Module:
    """The tree with types as such where they stand in quotes."""
    for node in ast.walk(tree):
        for key in ("annotation", "returns"):
            quoted = getattr(node, key, None)
            if isinstance(quoted, ast.Constant) and isinstance(quoted.value, str):
                setattr(node, key, ast.parse(quoted.value, mode="eval").body)
    return tree


def equations(trees: Trees, package: str) -> Iterator[str]:
    """Every module that has an equation or names a source: its docstring, and those in it that have or name one."""
    yield f"## `{package}`"
    for name, tree in _within(trees, package):
        named = (each for each in ast.walk(tree) if isinstance(each, Named))
        told = [each for each in named if EQUATION.search(ast.get_docstring(each) or "")]
        whole = ast.get_docstring(tree) or ""
        if told or EQUATION.search(whole):
            yield f"### `{name}`\n\n{markdown(whole)}"
            for each in sorted(told, key=lambda each: each.lineno):
                yield f"#### `{each.name}`\n\n{_signature(each, trees[name].lines)}{_text(each)}"


def library(trees: Trees, package: str) -> Iterator[str]:
    """The names that a package and the packages in it hand on, with signatures and docstrings, each where it comes first."""
    yield f"## `{package}`"
    seen = set()
    for name, tree in _within(trees, package):
        homes = [_home(trees, name, each) for each in _handed_on(tree, package)]
        fresh = [each for each in homes if each is not None and (each[0], each[1].name) not in seen]
        seen |= {(module, node.name) for module, node in fresh}
        if fresh:
            yield f"### `{name}`\n\n{markdown(ast.get_docstring(tree) or '')}"
            for module, node in fresh:
                yield f"#### `{name}.{node.name}`\n\n{_signature(node, trees[module].lines)}{_text(node)}"
                yield "\n".join(_members(trees, module, node))


def markdown(docstring: str) -> str:
    """A docstring as Markdown: lists of parameters and blocks of code in its way of writing them."""
    return PARAMETER.sub(r"- ``\1``: ", re.sub("::$", ":", docstring, flags=re.MULTILINE))


def _within(trees: Trees, package: str) -> Iterator[tuple[str, ast.Module]]:
    return ((name, source.tree) for name, source in trees.items() if f"{name}.".startswith(f"{package}."))


def _public(node: ast.Module | ast.ClassDef) -> list[Named]:
    named = (each for each in node.body if isinstance(each, Named))
    return [each for each in named if not each.name.startswith("_") and ast.get_docstring(each)]


def _handed_on(tree: ast.Module, package: str) -> list[str]:
    """Names in ``__all__``; without one, what a package that holds only imports imports from itself."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return list(ast.literal_eval(node.value))
    if not all(isinstance(node, ast.ImportFrom | ast.Expr) for node in tree.body):
        return []
    own = (node for node in tree.body if isinstance(node, ast.ImportFrom) and str(node.module).startswith(package))
    return [alias.name for node in own for alias in node.names]


def _home(trees: Trees, module: str, name: str) -> tuple[str, Named] | None:
    """Where a name is defined that a module defines or imports; None outside the house, and for a plain value."""
    for node in ast.walk(trees[module].tree) if module in trees else ():
        if isinstance(node, Named) and node.name == name:
            return module, node
        if isinstance(node, ast.ImportFrom) and name in (alias.name for alias in node.names):
            return _home(trees, str(node.module), name)
    return None


def _signature(node: Named, lines: list[str]) -> str:
    """What is called, as code; of a class its fields, with what stands beside them."""
    if isinstance(node, ast.FunctionDef):
        return f"```python\n{node.name}({ast.unparse(node.args)}){_gives(node)}\n```\n\n"
    fields = (each for each in node.body if isinstance(each, ast.AnnAssign))
    held = (line for each in fields for line in lines[each.lineno - 1 : each.end_lineno])
    return "```python\n{}\n```\n\n".format("\n".join((f"class {node.name}", *held)))


def _gives(node: ast.FunctionDef) -> str:
    return f" -> {ast.unparse(node.returns)}" if node.returns else ""


def _text(node: Named) -> str:
    return markdown(ast.get_docstring(node) or "")


def _members(trees: Trees, module: str, node: Named) -> Iterator[str]:
    """Public methods and properties of a class and of those that it extends, an item each."""
    seen = set()
    waiting = [(module, node)]
    for place, each in waiting:
        if isinstance(each, ast.ClassDef):
            waiting += filter(None, (_home(trees, place, ast.unparse(base)) for base in each.bases))
            for member in _public(each):
                if member.name not in seen and isinstance(member, ast.FunctionDef):
                    seen.add(member.name)
                    read = any("property" in ast.unparse(decorator) for decorator in member.decorator_list)
                    call = member.name + ("" if read else f"({ast.unparse(member.args)})") + _gives(member)
                    says = _text(member).replace("\n", "\n  ")
                    yield f"- `{call}`: {says}"
