"""Columns of tables that are keys of a scene: conditions of a rig, inputs of a posterior sample."""

import difflib
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from doe.study_file.table import LONGEST_NUMBER, WHOLE, Column, is_number
from rbdyn.faults import LONGEST_NAME, MOST_FAULTS, one_line
from rbdyn.scene import Scene

# Of a whole number, as in TOML.
LARGEST_BITS = 63


def key_values(column: Column, choices: Sequence[Any] = ()) -> tuple[list[Any], list[str]]:
    """Values (n,) of the scene's key that a column is named by, and a sentence for each cell that has none.

    One of the ``choices`` that the key's law states stays as it is stated; else the key's type in a scene decides what is
    number, boolean or text.
    """
    adapter, known = _adapter(column.name), dict[str, Any]()
    faults = []
    for row, text in enumerate(column.texts):
        if text not in known:
            known[text] = next(_accepted(text, adapter, choices), None)
        if known[text] is None:
            faults.append(column.fault(row, _words(column.name, text)))
    return [known[text] for text in column.texts], faults


def unknown_keys(keys: Iterable[str]) -> list[str]:
    """A sentence for each column whose name is no key of a scene; the first ones name the nearest key."""
    sentences = list[str]()
    for key in keys:
        table, _, name = key.rpartition(".")
        known = _fields(key)
        if name not in known:
            # To look for the nearest name takes longer than all else; nobody reads beyond the first sentences.
            near = difflib.get_close_matches(name[:LONGEST_NAME], known, n=1) if len(sentences) < MOST_FAULTS else []
            fix = f"did you mean {table}.{near[0]}?" if near else "rename or remove it"
            sentences.append(f"column {one_line(key, LONGEST_NAME)}: unknown key; {fix}")
    return sentences


def _readings(text: str) -> list[Any]:
    """What a text may mean, the narrowest type first."""
    readings: list[Any] = [text.lower() == "true"] if text.lower() in ("true", "false") else []
    if is_number(text) and math.isfinite(float(text)):
        whole = WHOLE.fullmatch(text) and int(text).bit_length() <= LARGEST_BITS
        readings += [int(text), float(text)] if whole else [float(text)]
    return [*readings, text]


def _accepted(text: str, adapter: TypeAdapter[Any], choices: Sequence[Any]) -> Iterator[Any]:
    """Values that a text may stand for, the likeliest first."""
    readings = _readings(text)
    stated = [choice for choice in choices if any(_alike(choice, reading) for reading in readings)]
    if len(stated) == 1:
        yield stated[0]
    for reading in stated or readings:
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


def _words(key: str, text: str) -> str:
    if not text:
        return "is empty; fill it in or remove the row"
    if len(text) > LONGEST_NUMBER:
        return f"is longer than {LONGEST_NUMBER} characters; write a shorter value"
    return f"is no value of that key; rbdyn keys {key} tells which are"


def _adapter(key: str) -> TypeAdapter[Any]:
    """What accepts the values of a dotted key of a scene."""
    field = _fields(key)[key.rpartition(".")[2]]
    limited: Any = Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
    return TypeAdapter(limited)


def _fields(key: str) -> dict[str, FieldInfo]:
    """Fields of the table that a dotted key is in; none where no scene has that table."""
    models: list[type[BaseModel]] = [Scene]
    for part in key.split(".")[:-1]:
        fields = [model.model_fields[part] for model in models if part in model.model_fields]
        models = [inner for field in fields for inner in _models(field.annotation)]
    return {name: field for model in models for name, field in model.model_fields.items()}


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Tables that an annotation allows."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for each in get_args(annotation) for model in _models(each)]
