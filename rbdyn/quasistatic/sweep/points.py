"""The points of a sweep: which keys of a scene take which values, in which order, and the scene at each.

Every point is validated as a scene read from a file is; the row then comes from the same ``row_of``.
"""

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rbdyn.base.faults import InputError, refuse, validated
from rbdyn.base.ranges import listed
from rbdyn.scene.ball import BallScene

MOST_POINTS = 100_000
FIX = "write key=start:stop:count with a count of at least 2, or key=a,b,c"
Path = tuple[str | int, ...]


class Axis(NamedTuple):
    """One key that is swept: its dotted name, its path in a nested scene and its values."""

    key: str
    path: Path
    values: tuple[float, ...]


Axes = Sequence[Axis]
Order = Sequence[tuple[int, ...]]  # of indices of the values at each point


def parsed(texts: Sequence[str]) -> dict[str, list[float]]:
    """``key=start:stop:count`` (evenly spaced) or ``key=a,b,c`` as the command line has them. Raises InputError."""
    keys: dict[str, list[float]] = {}
    for text in texts:
        key, sign, values = text.partition("=")
        key = key.strip()
        if not sign or not key:
            raise InputError([f"--sweep {text}: write it as key=start:stop:count or key=a,b,c"])
        if key in keys:
            raise InputError([f"--sweep {text}: {key} is swept twice; give all its values at once"])
        keys[key] = listed(values, f"--sweep {text}", FIX, 2, MOST_POINTS)
    return keys


def axes_of(scene: BallScene, keys: Mapping[str, Sequence[float]]) -> tuple[Axis, ...]:
    """The axes of a sweep, the first key outermost. Raises InputError for keys and values that cannot be swept."""
    if not keys:
        raise InputError(["sweep: no key to sweep; name one, such as operation.inner_speed_rpm"])
    data = tables(scene)
    faults: list[str] = []
    axes = []
    for key, given in keys.items():
        try:
            axes.append(_axis(data, key, [float(value) for value in given]))
        except InputError as error:
            faults += error.faults
        except (TypeError, ValueError):
            faults.append(f"{key}: the values {_shown(given)} are not numbers; give a list of numbers")
    refuse(faults)
    count = math.prod(len(axis.values) for axis in axes)
    if count > MOST_POINTS:
        raise InputError([f"sweep: {count} points are more than {MOST_POINTS}; take fewer values"])
    return tuple(axes)


def _axis(data: dict[str, Any], key: str, values: Sequence[float]) -> Axis:
    steps = np.diff(values)
    if len(values) == 0 or not np.all(np.isfinite(values)):
        raise InputError([f"{key}: the values {_shown(values)} are not all finite; write plain numbers"])
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise InputError([f"{key}: the values {_shown(values)} must rise or fall from each to the next; sort them"])
    path = _path(key)
    now = _now(data, path, key)
    if isinstance(now, int):
        uneven = [value for value in values if not value.is_integer()]
        if uneven:
            raise InputError([f"{key} = {uneven[0]:g}: must be a whole number; give whole values"])
        values = [int(value) for value in values]
    return Axis(key, path, tuple(values))


def _path(key: str) -> Path:
    path: list[str | int] = []
    for part in key.split("."):
        match = re.fullmatch(r"(\w+)((?:\[[1-9]\d*\])*)", part)
        if match is None:
            raise InputError([f"{key}: not a key; write it as operation.inner_speed_rpm or operation.load_N[3]"])
        path.append(match[1])
        path += [int(index) - 1 for index in re.findall(r"\d+", match[2])]
    return tuple(path)


def _now(data: Any, path: Path, key: str) -> Any:
    """What stands at a key now, None where nothing does. Raises InputError where no number can stand."""
    place = ""
    for step in path:
        if isinstance(step, int):
            if not isinstance(data, list):
                raise InputError([f"{key}: the scene has no list {place}; write it into the scene first"])
            if step >= len(data):
                raise InputError([f"{key}: {place} has {len(data)} items; take one of them"])
            place += f"[{step + 1}]"
        elif isinstance(data, dict) or data is None:
            place += f".{step}" if place else step
        else:
            fix = "write it out as a table of numbers first" if isinstance(data, str) else "check the key"
            raise InputError([f"{key}: {place} = {data!r} is not a table; {fix}"])
        data = data[step] if isinstance(step, int) else (data or {}).get(step)
    if isinstance(data, dict):
        raise InputError([f"{key}: is a table, not a number; name one of its keys: {', '.join(sorted(data))}"])
    if isinstance(data, list):
        raise InputError([f"{key}: is a list, not a number; name one item, such as {key}[1]"])
    if isinstance(data, str | bool):
        raise InputError([f"{key} = {data!r}: is not a number and cannot be swept; compare scenes with --set"])
    return data


def tables(scene: BallScene) -> dict[str, Any]:
    """The scene as nested tables, what is left out left out."""
    return scene.model_dump(mode="json", exclude_none=True)


def snake(axes: Axes) -> list[tuple[int, ...]]:
    """Indices of the values at each point, in an order in which only one changes at a time, and by one."""
    order: list[tuple[int, ...]] = [()]
    for axis in axes:
        ahead = range(len(axis.values))
        order = [
            (*head, index)
            for place, head in enumerate(order)
            for index in (ahead if place % 2 == 0 else reversed(ahead))
        ]
    return order


def scenes(scene: BallScene, axes: Axes, order: Order) -> Iterator[tuple[tuple[float, ...], BallScene]]:
    """Values and validated scene of each point. Raises InputError naming a point that the scene refuses."""
    whole, kind = tables(scene), type(scene)
    # Tables that no key touches are valid as they are; the others stay in ``whole``, which can so be read again as one.
    touched = {name: whole.setdefault(name, {}) for name in (str(axis.path[0]) for axis in axes)}
    data = {name: getattr(scene, name) for name in kind.model_fields} | touched
    holders = [_holder(data, axis.path) for axis in axes]
    for indices in order:
        values = tuple(axis.values[index] for axis, index in zip(axes, indices, strict=True))
        for (table, name), value in zip(holders, values, strict=True):
            table[name] = value
        try:
            made = kind.model_validate(data)
        except ValidationError:
            named = ", ".join(f"{axis.key} = {value:g}" for axis, value in zip(axes, values, strict=True))
            made = validated(kind, whole, f"sweep point ({named})")
        yield values, made


def _holder(data: Any, path: Path) -> tuple[Any, str | int]:
    """The table or list that holds the end of a path, made where it is not there."""
    for step, ahead in itertools.pairwise(path):
        data = data.setdefault(step, {}) if isinstance(step, str) and isinstance(ahead, str) else data[step]
    return data, path[-1]


def _shown(values: Any) -> str:
    text = ", ".join(f"{value:g}" if isinstance(value, float) else repr(value) for value in values)
    return text if len(text) <= 60 else text[:57] + "..."
