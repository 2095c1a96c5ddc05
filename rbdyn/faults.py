"""Faults in what a user typed: collected all at once, one sentence each, with file, key, value and mend."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

Model = TypeVar("Model", bound=BaseModel)


class InputError(Exception):
    """Bad input. ``faults`` holds one sentence per fault; a command prints them and exits with 2."""

    def __init__(self, faults: Iterable[str]) -> None:
        self.faults = list(faults)
        super().__init__("\n".join(self.faults))

    def __reduce__(self) -> tuple[type[InputError], tuple[list[str]]]:
        """How it travels between processes: with its faults, not with their text."""
        return type(self), (self.faults,)


class RunError(Exception):
    """A run that could not go on; the message says which, where and why. A command exits with 1."""


class Strict(BaseModel):
    """Base of all input tables: frozen, no unknown keys, no silent conversions, no NaN or infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def read_toml(path: Path | str) -> dict[str, Any]:
    """Read a TOML file into a dict.

    Raises InputError when the file is missing, unreadable or not TOML.
    """
    path = Path(path)
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError([f"{path}: no such file; check the path"]) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError([f"{path}: cannot be read ({error}); check the path"]) from None
    except tomllib.TOMLDecodeError as error:
        raise InputError([f"{path}: not valid TOML ({error}); mend that line"]) from None


def validated(model: type[Model], data: Mapping[str, Any], source: str) -> Model:
    """Build ``model`` from ``data``; ``source`` names the file in the messages.

    Raises InputError with every fault at once.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        faults = _sentences(model, error, source)
        # A table with a bad key is not checked as a whole: without that key it may show more faults.
        bad = [fault["loc"] for fault in error.errors()]
        rest = _without(data, bad)
    try:
        model.model_validate(rest)
    except ValidationError as error:
        more = _sentences(model, error, source, only="value_error")
        # What is bad was not left out, even if it is missed now.
        faults += [
            fault for fault in more if ": missing; " not in fault or not any(_key(place) in fault for place in bad)
        ]
    raise InputError(dict.fromkeys(faults))


def set_key(data: dict[str, Any], assignment: str) -> None:
    """Apply one ``key.path=value`` assignment (the value in TOML syntax, or a bare word) to a nested dict.

    Raises InputError when the assignment has no ``=`` or its path runs through a plain value.
    """
    path, found, text = assignment.partition("=")
    keys = path.strip().split(".")
    if not found or not all(keys):
        raise InputError([f"--set {assignment}: write it as key.path=value"])
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    table = data
    for key in keys[:-1]:
        table = table.setdefault(key, {})
        if not isinstance(table, dict):
            raise InputError([f"--set {assignment}: {key} is a value, not a table; check the key path"])
    table[keys[-1]] = value


def _without(data: Any, locations: list[tuple[int | str, ...]]) -> Any:
    if not isinstance(data, Mapping):
        return data
    inner = {key: [place[1:] for place in locations if place[:1] == (key,)] for key in data}
    return {key: _without(value, inner[key]) for key, value in data.items() if () not in inner[key]}


def _sentences(model: type[BaseModel], error: ValidationError, source: str, only: str | None = None) -> list[str]:
    sentences: list[str] = []
    mends: dict[str, list[str]] = {}
    for fault in error.errors():
        kind, value = fault["type"], fault["input"]
        # Where a key may be of several kinds, each kind complains: keep what fits the value given.
        alien = "model_type" if isinstance(value, str) else "literal_error" if isinstance(value, Mapping) else ""
        if (kind == alien and _names_a_kind(str(fault["loc"][-1]))) or (only and kind != only):
            continue
        place = _place(fault["loc"])
        key = _dotted(place)
        if kind == "extra_forbidden":
            sentences.append(f"{source}: {key}: unknown key; {_nearest(model, place)}")
        elif kind == "missing":
            sentences.append(f"{source}: {key}: missing; add it")
        elif kind == "value_error":
            # A validator of a whole table may find several faults: one a line.
            where = f"{key} = {_shown(value)}: " if key and not isinstance(value, Mapping | BaseModel) else ""
            for line in str(fault["ctx"]["error"]).splitlines():
                # A table that may stand in several places names its keys without the path.
                path = "" if where or not key or line.startswith(key.split(".")[0]) else f"{key}."
                sentences.append(f"{source}: {where}{path}{line}")
        elif isinstance(value, float) and not math.isfinite(value):
            sentences.append(f"{source}: {key} = {value}: is not a finite number; write a plain number")
        else:
            mends.setdefault(f"{source}: {key} = {_shown(value)}", []).append(_mend(kind, fault))
    return sentences + [f"{head}: {', or '.join(dict.fromkeys(mend))}" for head, mend in mends.items()]


def _place(location: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """The keys of a location, without the kinds that a key may be of."""
    return tuple(part for part in location if isinstance(part, int) or not _names_a_kind(part))


def _key(location: tuple[int | str, ...]) -> str:
    """The last key of a location."""
    return str(_place(location)[-1]) if _place(location) else ""


def _names_a_kind(part: str) -> bool:
    """Whether a part of a location names one of the kinds that a key may be of, not a key."""
    return part[:1].isupper() or "[" in part or part in ("bool", "float", "int", "str", "constrained-float")


def _mend(kind: str, fault: Any) -> str:
    limits = fault.get("ctx", {})
    bounds = {
        "greater_than": "must be greater than {gt}",
        "greater_than_equal": "must be at least {ge}",
        "less_than": "must be less than {lt}",
        "less_than_equal": "must be at most {le}",
        "literal_error": "choose one of {expected}",
        "int_type": "must be a whole number without quotes",
        "int_from_float": "must be a whole number",
        "float_type": "must be a number without quotes",
        "bool_type": "must be true or false",
        "string_type": "must be text in quotes",
        "model_type": "must be a table of keys",
        "model_attributes_type": "must be a table of keys",
        "list_type": "must be a list",
    }
    return bounds[kind].format(**limits) if kind in bounds else str(fault["msg"])


def _dotted(location: tuple[int | str, ...]) -> str:
    text = ""
    for part in location:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _nearest(model: type[BaseModel], location: tuple[int | str, ...]) -> str:
    known = _fields_at(model, location[:-1])
    close = difflib.get_close_matches(str(location[-1]), known, n=1)
    if close:
        return f"did you mean {close[0]}?"
    return f"known keys here: {', '.join(sorted(known))}" if known else "remove it"


def _fields_at(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    for part in location:
        if isinstance(part, int) or part not in model.model_fields:
            continue
        field = model.model_fields[str(part)]
        for candidate in (field.annotation, *getattr(field.annotation, "__args__", ())):
            if isinstance(candidate, type) and issubclass(candidate, BaseModel):
                model = candidate
                break
    return [field.alias or name for name, field in model.model_fields.items()]
