"""Records: frozen dataclasses whose fields, listed once, are the keys of their JSON form, in this order.

The key of a field is its name, unless it is ``keyed`` otherwise, ``spread`` or ``outside_json``. ``derived`` fields follow from
the others. A field whose default is None is left out where it is None, unless it is ``nullable``.

Cells of CSV files are written so that no program takes them for formulas and numbers keep their digits.
"""

import csv
import functools
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import MISSING, Field, dataclass, field, fields
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, Literal, Self, Union, dataclass_transform, get_args, get_origin, get_type_hints

from rbdyn.base.notes import Note
from rbdyn.base.words import Brief, counted

if TYPE_CHECKING:
    import pandas as pd


# Declared types of the fields of a class.
_kinds: Callable[[Any], dict[str, Any]] = functools.cache(get_type_hints)


# Options of a column at its field.
COLUMN_OPTIONS = {"unit", "meaning", "error", "cell", "missing", "text", "screen", "files"}


def keyed(*path: str, **options: Any) -> Any:
    """A field under another key than its name, or under keys one within the other; ``options`` as of ``dataclasses.field``."""
    return field(metadata={"path": path}, **options)


def spread(**options: Any) -> Any:
    """A table or record whose keys are merged into those of its owner; read back, it takes all keys of no other field."""
    return keyed(**options)


def derived(by: Callable[[Any], Any], *path: str, spread: bool = False, init: Literal[False] = False) -> Any:
    """A field that follows from the others, once they are set."""
    return field(init=init, repr=False, metadata={"by": by} | ({"path": path} if path or spread else {}))


def shown(heading: str, form: Any = 4, **options: Any) -> Any:
    """A field with its column in tables; ``options`` as of ``rbdyn.base.blocks.Column`` and ``dataclasses.field``."""
    column = {key: options.pop(key) for key in COLUMN_OPTIONS & options.keys()}
    return field(metadata={"column": {"words": heading, "form": form, **column}}, **options)


def written(meaning: str, **options: Any) -> Any:
    """A field with a column in files alone, and its meaning in the manual."""
    return shown("", screen=False, meaning=meaning, **options)


def nullable(**options: Any) -> Any:
    """A field of default None that JSON states as null."""
    return field(metadata={"null": True}, **options)


def outside_json(**options: Any) -> Any:
    """A field that JSON leaves out."""
    return field(metadata={"path": None}, **options)


@dataclass_transform(
    frozen_default=True, field_specifiers=(field, keyed, spread, derived, shown, written, nullable, outside_json)
)
@dataclass(frozen=True, eq=False)
class Record:
    """Base of all records, which makes them frozen dataclasses; ``kw_only``: with named arguments only. Without ``eq`` a record, as of
    arrays, equals itself alone.

    A record whose first base is ``Brief`` keeps the ``repr`` of that.
    """

    def __init_subclass__(cls, kw_only: bool = False, eq: bool = True) -> None:
        dataclass(frozen=True, kw_only=kw_only, eq=eq, repr=not issubclass(cls, Brief))(cls)

    def __post_init__(self) -> None:
        for item in fields(self):
            if "by" in item.metadata:
                object.__setattr__(self, item.name, item.metadata["by"](self))

    def as_dict(self) -> dict[str, Any]:
        """JSON form, which shares nothing with the record: plain numbers, lists and tables, units in the names."""
        record: dict[str, Any] = {}
        for item, path in json_fields(self):
            value = plain(getattr(self, item.name))
            if value is None and item.default is None and not item.metadata.get("null"):
                continue
            table = record
            for key in path[:-1]:
                table = table.setdefault(key, {})
            table.update({path[-1]: value} if path else value or {})
        return record

    @classmethod
    def from_attributes(cls, source: Any, **values: Any) -> Self:
        """A record of ``values``, the others from the attributes of ``source`` that are named as its fields."""
        others = {item.name for item in fields(cls) if item.init} - values.keys()
        return cls(**values, **{name: getattr(source, name) for name in others if hasattr(source, name)})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``as_dict``. Raises KeyError or TypeError for anything else."""
        own_keys = {key for _, path in json_fields(cls) for key in path[:1]}
        values: dict[str, Any] = {}
        for item, path in json_fields(cls):
            if not item.init or (path and item.default is None and path[0] not in data):
                continue
            value: Any = data if path else {key: value for key, value in data.items() if key not in own_keys}
            for key in path:
                value = value[key]
            if path or value or item.default is MISSING:
                values[item.name] = restore(_kinds(cls)[item.name], value)
        return cls(**values)


class OverPoints:
    """What results over ``points`` have in common: a ``sheet`` with a row a point; one that failed has another ``status`` than "ok"."""

    points: Any
    sheet: Any

    def table(self) -> "pd.DataFrame":
        """The sheet for pandas."""
        frame: pd.DataFrame = self.sheet.frame
        return frame

    @property
    def failed(self) -> list[Any]:
        """Points without figures that hold."""
        return [point for point in self.points if point.status != "ok"]

    def count_failed(self) -> str:
        """ "ok", or how many points failed."""
        return f"{len(self.failed)} of {counted(len(self.points), 'point')} failed" if self.failed else "ok"


def json_fields(record: Record | type[Record]) -> list[tuple[Field[Any], tuple[str, ...]]]:
    """Fields in JSON, each with its keys from the outermost in; a ``spread`` field has no key of its own."""
    paths = ((item, item.metadata.get("path", (item.name,))) for item in fields(record))
    return [(item, path) for item, path in paths if path is not None]


def plain(value: Any) -> Any:
    """JSON form of a value, which shares nothing with it; arrays become lists."""
    if isinstance(value, Record | Note):
        return value.as_dict()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value.tolist() if hasattr(value, "tolist") else value


def leaves(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys of nested tables with their values."""
    for key, value in tables.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def finite(value: float) -> float | None:
    """A figure; None where it is infinite or NaN, which JSON cannot hold."""
    return value if math.isfinite(value) else None


def restore(kind: Any, value: Any) -> Any:
    """A value of JSON as the declared ``kind`` of a field. Raises KeyError or TypeError where it is of another kind."""
    origin, kinds = get_origin(kind), get_args(kind)
    if kind is Any:
        return value
    if origin in (UnionType, Union):
        for candidate in kinds:
            with suppress(KeyError, TypeError):
                return restore(candidate, value)
    elif origin is dict and isinstance(value, dict):
        return {key: restore(kinds[1], item) for key, item in value.items()}
    elif origin in (list, tuple) and isinstance(value, list):
        return origin(restore(kinds[0], item) for item in value)
    elif origin is Literal and value in kinds:
        return value
    elif getattr(origin, "__name__", "") == "ndarray":
        import numpy as np

        return np.asarray(value)
    elif kind is Note:
        return Note.of(value)
    elif isinstance(kind, type) and issubclass(kind, tuple) and isinstance(value, list):
        if len(value) == len(_kinds(kind)):
            return kind(*map(restore, _kinds(kind).values(), value))
    elif isinstance(kind, type) and issubclass(kind, Record) and isinstance(value, dict):
        return kind.from_dict(value)
    elif type(value) is kind or (kind is float and type(value) is int):
        return value
    raise TypeError(f"{value!r} is not of {kind}")


# A number as every program writes it: float() also accepts 1_000, nan and digits of other scripts.
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# The start of a formula, also behind quotes, which belong to the text.
FORMULA = re.compile(r"'*[=+\-@\t\r\n]")


def quoted_cell(value: Any) -> Any:
    """A cell as written: text that looks like a formula, but is no number, gets a further quote in front."""
    formula = isinstance(value, str) and FORMULA.match(value) and not NUMBER.fullmatch(value)
    return f"'{value}" if formula else value


def plain_cell(text: str) -> str:
    """Inverse of ``quoted_cell``: the text of a cell as read."""
    return text[1:] if text.startswith("'") and FORMULA.match(text) else text


def save_table(
    table: "pd.DataFrame | Iterable[Mapping[str, Any]]", path: Path | str, float_format: str | None = None
) -> None:
    """Write a table, or its rows by column, as CSV without its index. Raises OSError."""
    import pandas as pd

    frame = table.copy() if isinstance(table, pd.DataFrame) else pd.DataFrame(list(table))
    for name, kind in frame.dtypes.items():
        if not pd.api.types.is_numeric_dtype(kind):
            frame[name] = frame[name].map(quoted_cell)
    frame.rename(columns=quoted_cell).to_csv(path, index=False, float_format=float_format)


def save_rows(rows: Callable[[], Iterable[Mapping[str, Any]]], path: Path | str) -> None:
    """Write rows as CSV that are too many to be held at once; they are made twice, first for their columns. Raises OSError."""
    header = list(dict.fromkeys(name for row in rows() for name in row))
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(map(quoted_cell, header))
        table.writerows([quoted_cell(row.get(name)) for name in header] for row in rows())
