"""Keys of input files with meaning, unit, range and default, as text and as a JSON Schema; columns of tables that they name.

The docstring under a field describes its key; editing it changes neither figures nor compiled code. Descriptions are read from
the source only here, because this takes a tenth of a second.
"""

import ast
import difflib
import functools
import inspect
import math
import re
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args

import typer
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from rbdyn.base.blocks import Sheet
from rbdyn.base.command import flag, print_json
from rbdyn.base.faults import LONGEST_NAME, MOST_FAULTS, InputError, one_line
from rbdyn.base.records import plain
from rbdyn.base.tables.sheet import LONGEST_NUMBER, WHOLE, InputColumn
from rbdyn.base.tables.sheet import is_number as is_numeral
from rbdyn.base.words import quantity
from rbdyn.scene import Scene

DIALECT = "https://json-schema.org/draft/2020-12/schema"
WIDTH = 100
# Larger bounds only prevent overflow and are not listed.
BOUNDLESS = 1e12
Word = Annotated[
    str | None, typer.Argument(metavar="WORD", help="List only the keys with this word in their name or description.")
]
AsSchema = Annotated[bool, flag("--schema", help="Print a JSON Schema, which lets an editor complete TOML.")]
# Unit of numbers and lengths in shaft turns, by the end of a key.
TURNS = {"_per_turn": "per shaft turn", "turns": "shaft turns"}


class Part(NamedTuple):
    """Contribution of a package to the manual: its chapters, its command, the kinds of its input files, its drawings, its tables."""

    package: str
    prose: Path  # folder of chapters, NN_name.md
    commands: Any  # group of commands, as typer makes it
    kinds: Mapping[str, type[BaseModel]]
    drawings: Callable[[Any], Mapping[str, Any]]  # sketches by name, of the scene that the manual draws
    tables: Callable[[], Mapping[str, Sequence[Sheet[Any]]]]  # files of tables by heading


class Key(NamedTuple):
    """One key: its dotted name, with [] behind a list of tables, and its description."""

    key: str
    file: str
    unit: str
    values: str
    default: Any
    required: bool
    description: str
    unknown: str


def run(kinds: Mapping[str, type[BaseModel]], word: str | None, as_schema: bool, as_json: bool) -> None:
    """Print the keys of files by their kind. Raises InputError where no key contains the word."""
    if as_schema:
        print_json(schema(kinds))
        return
    matches = matching(keys(kinds), word)
    if not matches:
        raise InputError(f"WORD = {word!r}: no key contains it; try a shorter word, or none for all keys")
    if as_json:
        print_json({"keys": [key._asdict() for key in matches]})
        return
    file = ""
    for key in matches:
        if key.file != file:
            file = key.file
            print(f"{file}\n{'=' * len(file)}")
        print("\n".join(lines(key)))


def matching(all_keys: list[Key], word: str | None) -> list[Key]:
    """Keys with the word in name or description, in any case; of each file the table of that name comes first."""
    pattern = (word or "").lower()
    found = [key for key in all_keys if pattern in key.key.lower() or pattern in key.description.lower()]
    files = list(dict.fromkeys(key.file for key in found))
    return sorted(found, key=lambda key: (files.index(key.file), not f"{key.key}.".startswith(f"{pattern}.")))


def lines(key: Key) -> list[str]:
    """A key as printed: name, values, unit and default; below, its meaning."""
    default = "required" if key.required else "optional" if key.default is None else f"default {_toml(key.default)}"
    head = ", ".join(part for part in (key.values, key.unit, default) if part)
    return [
        f"{key.key}: {head}",
        *textwrap.wrap(key.description, WIDTH, initial_indent="    ", subsequent_indent="    "),
        *textwrap.wrap(key.unknown, WIDTH, initial_indent="    ", subsequent_indent="    "),
    ]


def schema(kinds: Mapping[str, type[BaseModel]]) -> dict[str, Any]:
    """JSON Schema of files that are one of the ``kinds``, every property described."""
    from pydantic.json_schema import models_json_schema

    refs, schemas = models_json_schema([(model, "validation") for model in kinds.values()])
    described: dict[str, dict[str, str]] = {}
    for model in _models(kinds.values()):
        # The schema prefixes a name that two modules use with the module.
        long_name = f"{model.__module__}__{model.__qualname__}".replace(".", "__")
        name = model.__name__ if model.__name__ in schemas["$defs"] else long_name
        described[name] = descriptions(model)
    for name, table in schemas["$defs"].items():
        for key, node in table.get("properties", {}).items():
            node["description"] = described[name][key]
            node.pop("title", None)
            node.pop("pattern", None)  # in a dialect that editors cannot read
    options = [{"title": kind, **refs[(model, "validation")]} for kind, model in kinds.items()]
    return {"$schema": DIALECT, "oneOf": options, "$defs": schemas["$defs"]}


def keys(kinds: Mapping[str, type[BaseModel]]) -> list[Key]:
    """Keys of each kind of file; a key of several kinds with one meaning is listed once."""
    schemas = schema(kinds)
    by_meaning: dict[tuple[str, str], Key] = {}
    for option in schemas["oneOf"]:
        for key in _keys_of(schemas["$defs"], _target(option), "", option["title"]):
            by_meaning.setdefault((key.key, key.description), key)
    return list(by_meaning.values())


@functools.cache
def descriptions(model: type[BaseModel]) -> dict[str, str]:
    """Docstrings under the fields of a model and of its bases, each as one line; of a field made of a list, its description."""
    texts = {name: str(field.description) for name, field in model.model_fields.items() if field.description}
    for base in reversed(model.__mro__):
        if base.__module__.partition(".")[0] == "pydantic" or not hasattr(base, "model_fields"):
            continue
        source = _classes(base.__module__).get(base.__name__)
        body = [] if source is None else source.body
        for field, text in pairwise(body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                value = getattr(text, "value", None)
                if isinstance(text, ast.Expr) and isinstance(value, ast.Constant):
                    texts[field.target.id] = " ".join(str(value.value).split())
    return {field.alias or name: texts[name] for name, field in model.model_fields.items()}


@functools.cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


def _models(roots: Any) -> list[type[BaseModel]]:
    """The models and all models in their fields."""
    models = list[type[BaseModel]](roots)
    for model in models:
        fields = [field.annotation for field in model.model_fields.values()]
        inner = map(_inner_models, [*fields, model.__annotations__.get("__pydantic_extra__")])
        models += dict.fromkeys(found for group in inner for found in group if found not in models)
    return models


def _target(node: Mapping[str, Any]) -> str:
    return str(node["$ref"]).rpartition("/")[2]


def _keys_of(tables: Mapping[str, Any], name: str, prefix: str, file: str) -> Iterator[Key]:
    """Keys of a table and of the tables in it."""
    table = tables[name]
    if isinstance(free := table.get("additionalProperties"), dict):
        yield from _keys_of(tables, _target(free), f'{prefix}"TABLE.KEY".', file)
    for key, node in table["properties"].items():
        kinds = [kind for kind in node.get("anyOf", [node]) if kind.get("type") != "null"]
        path = f"{prefix}{key}"
        required = key in table.get("required", ())
        nested = [(kind, "") for kind in kinds if "$ref" in kind]
        nested += [(kind["items"], "[]") for kind in kinds if "$ref" in kind.get("items", {})]
        plain = [kind for kind in kinds if "$ref" not in kind and "$ref" not in kind.get("items", {})]
        values = " or ".join(
            filter(None, [*map(_values, plain), *("list of tables" if mark else "table" for _, mark in nested)])
        )
        default = None if nested and not plain else node.get("default")
        yield Key(path, file, _unit(key), values, default, required, node["description"], _unknown(path))
        for target, mark in nested:
            yield from _keys_of(tables, _target(target), f"{path}{mark}.", file)


def _unknown(key: str) -> str:
    """The documented range of an unknown key, with its reason."""
    from rbdyn.scene.uncertain import documented

    ranges = [f"{entry.words} ({entry.reason})" for entry in documented() if entry.key == key]
    return f"If unknown: {', or '.join(ranges)}." if ranges else ""


def _unit(key: str) -> str:
    return next((unit for end, unit in TURNS.items() if key.endswith(end)), quantity(key)[1])


def _values(node: Mapping[str, Any]) -> str:
    """Possible values in words."""
    if "enum" in node or "const" in node:
        return " | ".join(_toml(value) for value in node.get("enum", [node.get("const")]))
    kind = node.get("type")
    if kind == "array":
        items = node.get("items")
        items_text = _plural(_values(items)) if items else f"{len(node['prefixItems'])} numbers"
        return f"list of {items_text}" if items_text else "list"
    return " ".join(filter(None, ["table" if kind == "object" else str(kind or ""), _range(node)]))


def _plural(values: str) -> str:
    return re.sub("^(number|integer|string|list|table)", r"\1s", values)


def _range(node: Mapping[str, Any]) -> str:
    low, high = node.get("minimum"), node.get("maximum")
    low, high = (None if end is not None and abs(end) >= BOUNDLESS else end for end in (low, high))
    above, below = node.get("exclusiveMinimum"), node.get("exclusiveMaximum")
    parts = [f"from {low:g}" if low is not None else f"above {above:g}" if above is not None else ""]
    parts.append(f"to {high:g}" if high is not None else f"below {below:g}" if below is not None else "")
    return " ".join(filter(None, parts))


def _toml(value: Any) -> str:
    """A default as written in TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)


# Bits of the largest whole number, as in TOML.
LARGEST_BITS = 63


def key_values(column: InputColumn, choices: Sequence[Any] = ()) -> tuple[list[Any], list[str]]:
    """Values (n,) of the scene's key that names a column, and a sentence for each cell without one.

    A cell that is one of the law's ``choices`` has that value. Otherwise the key's type in a scene decides between number,
    boolean and text.
    """
    adapter, values = _adapter(column.name), dict[str, Any]()
    faults = []
    for row, text in enumerate(column.texts):
        if text not in values:
            values[text] = next(_accepted(text, column.plain[row], adapter, choices), None)
        if values[text] is None:
            faults.append(column.fault(row, column.doubt(row) or _fault(column.name, text)))
    return [values[text] for text in column.texts], faults


def unknown_keys(keys: Iterable[str]) -> list[str]:
    """A sentence for each column whose name is no key of a scene; the first ones name the nearest key."""
    sentences = list[str]()
    for key in keys:
        table, _, name = key.rpartition(".")
        names = _fields(key)
        if name not in names:
            # The search for the nearest name is slow, and only the first sentences are shown.
            near = difflib.get_close_matches(name[:LONGEST_NAME], names, n=1) if len(sentences) < MOST_FAULTS else []
            fix = f"did you mean {table}.{near[0]}?" if near else "rename or remove it"
            sentences.append(f"column {one_line(key, LONGEST_NAME)}: unknown key; {fix}")
    return sentences


def _readings(text: str, plain: str) -> list[Any]:
    """Values that a text may denote, the narrowest type first; ``plain``: the text with a decimal point, if it is a number."""
    readings: list[Any] = [text.lower() == "true"] if text.lower() in ("true", "false") else []
    if is_numeral(plain) and math.isfinite(float(plain)):
        is_whole = WHOLE.fullmatch(plain) and int(plain).bit_length() <= LARGEST_BITS
        readings += [int(plain), float(plain)] if is_whole else [float(plain)]
    return [*readings, text]


def _accepted(text: str, plain: str, adapter: TypeAdapter[Any], choices: Sequence[Any]) -> Iterator[Any]:
    """Values of the key that a text may denote, the likeliest first."""
    readings = _readings(text, plain)
    matches = [choice for choice in choices if any(_alike(choice, reading) for reading in readings)]
    if len(matches) == 1:
        yield matches[0]
    for reading in matches or readings:
        try:
            yield adapter.validate_python(reading, strict=True)
        except ValidationError:
            continue


def _alike(choice: Any, reading: Any) -> bool:
    """Whether a reading is a choice: of one type, or both numbers."""
    if isinstance(choice, str) and isinstance(reading, str):
        return choice.strip() == reading
    kinds = {type(choice), type(reading)}
    return (len(kinds) == 1 or kinds == {int, float}) and bool(choice == reading)


def _fault(key: str, text: str) -> str:
    """The fault of a text that is no value of its key, with the fix."""
    if not text:
        return "is empty; fill it in or remove the row"
    if len(text) > LONGEST_NUMBER:
        return f"is longer than {LONGEST_NUMBER} characters; write a shorter value"
    return f"is not a value of that key; rbdyn keys {key} lists which are"


def _adapter(key: str) -> TypeAdapter[Any]:
    """Validator of the values of a dotted key of a scene."""
    field = _fields(key)[key.rpartition(".")[2]]
    limited: Any = Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
    return TypeAdapter(limited)


def default_of(key: str, scene: type[BaseModel] = Scene) -> Any:
    """Default of a dotted key of a kind of ``scene``, as JSON has it; None for a key without one."""
    field = _fields(key, scene).get(key.rpartition(".")[2])
    return None if field is None or field.is_required() else plain(field.get_default(call_default_factory=True))


def _fields(key: str, scene: type[BaseModel] = Scene) -> dict[str, FieldInfo]:
    """Fields of the table of a dotted key; none if no scene has that table."""
    models: list[type[BaseModel]] = [scene]
    for part in key.split(".")[:-1]:
        fields = [model.model_fields[part] for model in models if part in model.model_fields]
        models = [inner for field in fields for inner in _inner_models(field.annotation)]
    return {name: field for model in models for name, field in model.model_fields.items()}


def _inner_models(annotation: Any) -> list[type[BaseModel]]:
    """Tables that an annotation allows."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for argument in get_args(annotation) for model in _inner_models(argument)]
