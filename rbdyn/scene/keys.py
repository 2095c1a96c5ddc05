"""Every key of an input file with its meaning, unit, range and default, and all of them as a JSON Schema; what a package adds to the manual.

A key is described by the docstring under its field, which changes neither figures nor compiled code. Descriptions are read
from the source only here: reading them whenever a scene is loaded would take a tenth of a second.
"""

import ast
import functools
import inspect
import re
import sys
import textwrap
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from pydantic import BaseModel

from rbdyn.base.faults import InputError
from rbdyn.base.options import flag
from rbdyn.base.terminal import print_json
from rbdyn.base.words import quantity

DIALECT = "https://json-schema.org/draft/2020-12/schema"
WIDTH = 100
# Bounds that only keep products from overflowing are not given.
BOUNDLESS = 1e12
Word = Annotated[str | None, typer.Argument(metavar="WORD", help="Only keys that have it in name or description.")]
AsSchema = Annotated[bool, flag("--schema", says="Print a JSON Schema, by which an editor completes TOML.")]
# What a whole number or a length in turns is counted by, by the end of a key.
TURNS = {"_per_turn": "per shaft turn", "turns": "shaft turns"}


class Part(NamedTuple):
    """What a package adds to the manual: its chapters, its command and the kinds of its input files."""

    package: str
    prose: Path  # folder of chapters, NN_name.md
    commands: Any  # group of commands, as typer makes it
    kinds: Mapping[str, type[BaseModel]]


class Key(NamedTuple):
    """One key: its dotted name, with [] behind a list of tables, and what may stand there."""

    key: str
    file: str
    unit: str
    values: str
    default: Any
    required: bool
    description: str
    unknown: str


def run(kinds: Mapping[str, type[BaseModel]], word: str | None, as_schema: bool, as_json: bool) -> None:
    """Print the keys of files by their kind. Raises InputError where no key has the word."""
    if as_schema:
        print_json(schema(kinds))
        return
    found = matching(keys(kinds), word)
    if not found:
        raise InputError([f"WORD = {word!r}: no key contains it; try a shorter word, or none for all keys"])
    if as_json:
        print_json({"keys": [key._asdict() for key in found]})
        return
    file = ""
    for key in found:
        if key.file != file:
            file = key.file
            print(f"{file}\n{'=' * len(file)}")
        print("\n".join(lines(key)))


def matching(found: list[Key], word: str | None) -> list[Key]:
    """Keys with the word in name or description, capitals or not."""
    sought = (word or "").lower()
    return [key for key in found if sought in key.key.lower() or sought in key.description.lower()]


def lines(key: Key) -> list[str]:
    """How a key is printed: name, unit, values and default; below, what it means."""
    default = (
        "required" if key.required else "may be left out" if key.default is None else f"default {_toml(key.default)}"
    )
    head = ", ".join(part for part in (key.values, key.unit, default) if part)
    return [
        f"{key.key}: {head}",
        *textwrap.wrap(key.description, WIDTH, initial_indent="    ", subsequent_indent="    "),
        *textwrap.wrap(key.unknown, WIDTH, initial_indent="    ", subsequent_indent="    "),
    ]


def schema(kinds: Mapping[str, type[BaseModel]]) -> dict[str, Any]:
    """JSON Schema of files that are one of the ``kinds``, every property described."""
    from pydantic.json_schema import models_json_schema

    refs, whole = models_json_schema([(model, "validation") for model in kinds.values()])
    described: dict[str, dict[str, str]] = {}
    for model in _models(kinds.values()):
        # A name that two modules use stands in the schema with the module before it.
        name = next(n for n in (model.__name__, _long_name(model)) if n in whole["$defs"])
        described[name] = descriptions(model)
    for name, table in whole["$defs"].items():
        for key, each in table.get("properties", {}).items():
            each["description"] = described[name][key]
            each.pop("title", None)
            each.pop("pattern", None)  # in a dialect that editors do not know
    options = [{"title": kind, **refs[(model, "validation")]} for kind, model in kinds.items()]
    return {"$schema": DIALECT, "oneOf": options, "$defs": whole["$defs"]}


def keys(kinds: Mapping[str, type[BaseModel]]) -> list[Key]:
    """Keys of each kind of file; one that a former kind has too, with the same meaning, is listed once."""
    whole = schema(kinds)
    found: dict[tuple[str, str], Key] = {}
    for option in whole["oneOf"]:
        for key in _keys_of(whole["$defs"], _target(option), "", option["title"]):
            found.setdefault((key.key, key.description), key)
    return list(found.values())


@functools.cache
def descriptions(model: type[BaseModel]) -> dict[str, str]:
    """Docstrings under the fields of a model and of those that it extends, each as one line."""
    found: dict[str, str] = {}
    for each in reversed(model.__mro__):
        if each.__module__.partition(".")[0] == "pydantic" or not hasattr(each, "model_fields"):
            continue
        body = _classes(each.__module__)[each.__name__].body
        for field, text in pairwise(body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                value = getattr(text, "value", None)
                if isinstance(text, ast.Expr) and isinstance(value, ast.Constant):
                    found[field.target.id] = " ".join(str(value.value).split())
    return {name: found[name] for name in model.model_fields}


@functools.cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {each.name: each for each in tree.body if isinstance(each, ast.ClassDef)}


def _long_name(model: type[BaseModel]) -> str:
    return f"{model.__module__}__{model.__qualname__}".replace(".", "__")


def _models(roots: Any) -> list[type[BaseModel]]:
    """The models and all that their fields hold."""
    from pydantic import BaseModel

    found: dict[type[BaseModel], None] = {}
    waiting: list[Any] = list(roots)
    while waiting:
        each = waiting.pop()
        if isinstance(each, type) and issubclass(each, BaseModel):
            if each not in found:
                found[each] = None
                waiting += [field.annotation for field in each.model_fields.values()]
                waiting.append(each.__annotations__.get("__pydantic_extra__"))
        else:
            waiting += getattr(each, "__args__", ())
    return list(found)


def _target(node: Mapping[str, Any]) -> str:
    return str(node["$ref"]).rpartition("/")[2]


def _keys_of(tables: Mapping[str, Any], name: str, prefix: str, file: str) -> Iterator[Key]:
    """Keys of a table and of the tables in it."""
    table = tables[name]
    if isinstance(free := table.get("additionalProperties"), dict):
        yield from _keys_of(tables, _target(free), f'{prefix}"TABLE.KEY".', file)
    for key, node in table["properties"].items():
        inner = [each for each in node.get("anyOf", [node]) if each.get("type") != "null"]
        whole = f"{prefix}{key}"
        required = key in table.get("required", ())
        nested = [(each, "") for each in inner if "$ref" in each]
        nested += [(each["items"], "[]") for each in inner if "$ref" in each.get("items", {})]
        plain = [each for each in inner if "$ref" not in each and "$ref" not in each.get("items", {})]
        values = " or ".join(
            filter(None, [*map(_values, plain), *("a list of tables" if m else "a table" for _, m in nested)])
        )
        default = None if nested and not plain else node.get("default")
        yield Key(whole, file, _unit(key), values, default, required, node["description"], _unknown(whole))
        for each, mark in nested:
            yield from _keys_of(tables, _target(each), f"{whole}{mark}.", file)


def _unknown(key: str) -> str:
    """Over which range a key may lie that nobody knows, and why."""
    from rbdyn.scene.uncertain import documented

    ranges = [f"{each.words}: {each.reason}" for each in documented() if each.key == key]
    return f"Where not known: {'; or '.join(ranges)}." if ranges else ""


def _unit(key: str) -> str:
    return next((unit for end, unit in TURNS.items() if key.endswith(end)), quantity(key)[1])


def _values(node: Mapping[str, Any]) -> str:
    """What may stand there, in words."""
    if "enum" in node or "const" in node:
        return " | ".join(_toml(each) for each in node.get("enum", [node.get("const")]))
    kind = node.get("type")
    if kind == "array":
        items = node.get("items")
        return f"a list of {_plural(_values(items))}" if items else f"a list of {len(node['prefixItems'])} numbers"
    if kind == "object":
        return "a table"
    names = {"number": "number", "integer": "whole number", "boolean": "true or false", "string": "text"}
    return " ".join(filter(None, [names.get(str(kind), "anything"), _range(node)]))


def _plural(values: str) -> str:
    if values.startswith("a list"):
        return values.replace("a list", "lists", 1)
    return re.sub("^(whole )?(number|text)", r"\1\2s", values)


def _range(node: Mapping[str, Any]) -> str:
    low, high = node.get("minimum"), node.get("maximum")
    low, high = (None if end is not None and abs(end) >= BOUNDLESS else end for end in (low, high))
    above, below = node.get("exclusiveMinimum"), node.get("exclusiveMaximum")
    parts = [f"from {low:g}" if low is not None else f"above {above:g}" if above is not None else ""]
    parts.append(f"to {high:g}" if high is not None else f"below {below:g}" if below is not None else "")
    return " ".join(filter(None, parts))


def _toml(value: Any) -> str:
    """A default as it would be written."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)
