"""Columns of tables that are named by keys of a scene: the values of these keys in their cells."""

import difflib
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from rbdyn.base.faults import LONGEST_NAME, MOST_FAULTS, one_line
from rbdyn.base.records import plain
from rbdyn.base.tables.sheet import LONGEST_NUMBER, WHOLE, Column
from rbdyn.base.tables.sheet import is_number as is_numeral
from rbdyn.scene import Scene

# Bits of the largest whole number, as in TOML.
LARGEST_BITS = 63


def key_values(column: Column, choices: Sequence[Any] = ()) -> tuple[list[Any], list[str]]:
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
    return f"is no value of that key; rbdyn keys {key} lists which are"


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
        models = [inner for field in fields for inner in _models(field.annotation)]
    return {name: field for model in models for name, field in model.model_fields.items()}


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Tables that an annotation allows."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for argument in get_args(annotation) for model in _models(argument)]
