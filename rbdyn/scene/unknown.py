"""Unknown inputs of a scene, and the scene at values of these inputs."""

import difflib
import functools
import math
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from types import MappingProxyType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel

from rbdyn.base.faults import LONGEST_NAME, MOST_FAULTS, Claims, InputError, Sparse, one_line, put_key, refuse
from rbdyn.base.records import Record
from rbdyn.base.words import shown, with_error
from rbdyn.scene import Scene
from rbdyn.scene.lubricant import COLDEST_C, HOTTEST_C
from rbdyn.scene.thermal import first_guess_faults
from rbdyn.scene.uncertain import LEFT_OUT, MARKING, NO_INPUTS, Documented, Law, Sampled, Uncertain, documented

# Value of a key without an entry that follows from other keys, in its own unit.
DERIVED: Mapping[str, Callable[[Scene], float | None]] = {
    "cage.land_diameter_mm": lambda scene: scene.land_diameter_mm,
    "cage.inertia_kg_mm2": lambda scene: 1e6 * scene.geometry.cage_inertia,
    "cage.pocket_contact_length_mm": lambda scene: scene.bearing.effective_length_mm,
    "mounting.cage_temperature_C": lambda scene: scene.cage_temperature_C,
    "cage.pocket_radial_clearance_mm": lambda scene: scene.cage.lip_clearance_mm,
    "lubricant.viscosity_mPas": lambda scene: 1e3 * scene.lubricant.in_service.viscosity,
    "lubricant.pressure_coefficient_1_GPa": lambda scene: 1e9 * scene.lubricant.in_service.pressure_coefficient,
}
# Limits of keys that vary about their own value; others are far from theirs.
LIMITS, NO_LIMITS = {"lubricant.temperature_C": (COLDEST_C, HOTTEST_C)}, (-math.inf, math.inf)
# Keys that follow from other inputs where a scene has no entry.
FOLLOWING = frozenset({*DERIVED, "model.pocket_bar_stiffness_N_m"})


class Input(NamedTuple):
    """An unknown input: its key, its law, the reason for the law, and whether this is about the value of the key in the scene."""

    key: str
    law: Law | Sampled
    reason: str
    about_value: bool = False


# Words of the laws of inputs.
LAWS = {
    "uniform": "evenly",
    "log_uniform": "evenly by ratio",
    "normal": "normal",
    "choices": "one of these",
    "sample": "by a sample of measurements",
}


class InputLaw(Record):
    """The law of an input as a record states it: numbers as in [uncertain], or ``rows`` of a sample and its ends."""

    law: str
    rows: int | None = None
    low: Any = None
    high: Any = None
    mean: float | None = None
    sd: float | None = None
    values: list[Any] | None = None
    weights: list[float] | None = None
    times: str | None = None
    kind: str | None = None

    @property
    def words(self) -> str:
        """'0.3 to 3 (evenly by ratio)'."""
        times = f" times {self.times}" if self.times else ""
        if self.mean is not None:
            return f"{with_error(self.mean, self.sd)} (1 sd){times} ({LAWS[self.law]})"
        if self.low is not None and self.high is not None:
            return f"{shown(self.low)} to {shown(self.high)}{times} ({LAWS[self.law]})"
        return f"{', '.join(map(str, self.values or ()))} ({LAWS[self.law]})"


class UnknownInput(Record):
    """An unknown input with its law and the reason for that."""

    key: str
    law: InputLaw
    reason: str

    @classmethod
    def of(cls, entry: Input) -> "UnknownInput":
        """The record of an input of a scene."""
        return cls(entry.key, InputLaw(**entry.law.model_dump(exclude_none=True)), entry.reason)


def inputs_of(
    scene: Scene,
    data: Mapping[str, Any],
    uncertain: Uncertain,
    fixed: Mapping[str, str] = MappingProxyType({}),
    sample: Mapping[str, Sampled] = MappingProxyType({}),
    source: str = "scene",
) -> list[Input]:
    """Unknown inputs of a scene, sorted by key: the declared ones, and the documented ones of all other keys.

    ``data``: the tables of the scene, whose entries are exact unless named as estimated. ``fixed``: keys that vary otherwise,
    each with its role. ``sample``: keys of a posterior sample. ``source``: the file of the declarations. Raises InputError for
    keys that cannot vary.
    """
    keys = {**uncertain.laws, **sample}
    documented_keys = {entry.key for entry in documented()}
    about_values = {entry.key for entry in documented() if entry.plus == entry.key}
    faults = _key_faults(keys)
    others = Claims({tuple(key.split(".")): role for key, role in fixed.items()})
    faults += [
        f'uncertain."{key}": is {role} too; remove it from one of them'
        for key in keys
        if (role := others.reason_for(tuple(key.split("."))))
    ]
    faults += [
        f'uncertain.estimated: "{key}" has no documented range; write "{key}" = {{law = ...}}'
        for key in uncertain.estimated
        if key not in documented_keys and key not in MARKING
    ]
    faults += [f"uncertain: {fault}" for fault in first_guess_faults(scene.thermal, scene.lubricant, keys)]
    refuse(f"{source}: {fault}" for fault in faults)
    inputs = [Input(key, law, "declared") for key, law in uncertain.laws.items() if key not in sample]
    inputs += [Input(key, values, "posterior sample") for key, values in sample.items()]
    inputs += [
        Input(entry.key, entry.as_law, entry.reason, entry.key in about_values)
        for entry in documented_of(scene)
        if entry.key not in keys
        and others.reason_for(tuple(entry.key.split("."))) is None
        and (
            entry.key in uncertain.estimated
            or (uncertain.defaults == "documented" and not entry.on_request and not _has_entry(data, entry.key))
        )
    ]
    refuse(f"{source}: {fault}" for fault in _times_faults(scene, inputs))
    return sorted(inputs)


@functools.cache
def value_keys() -> Mapping[str, bool]:
    """Keys of a scene with properties of the bearing, by dotted name: whether they hold a single value."""
    return {key: single for key, single in _keys_of(Scene, "") if key.partition(".")[0] not in NO_INPUTS}


def _keys_of(table: type[BaseModel], prefix: str) -> Iterator[tuple[str, bool]]:
    for name, field in table.model_fields.items():
        kinds = list(_kinds(field.annotation))
        yield prefix + name, any(kind in (float, int, bool, str, Literal) for kind in kinds)
        for kind in kinds:
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                yield from _keys_of(kind, f"{prefix}{name}.")


def _kinds(annotation: Any) -> Iterator[Any]:
    """Types of a field one by one; Literal for any choice of texts."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        yield from _kinds(parts[0])
    elif origin in (Union, types.UnionType):
        yield from (kind for part in parts for kind in _kinds(part))
    else:
        yield Literal if origin is Literal else annotation


def _key_faults(keys: Iterable[str]) -> list[str]:
    """A sentence for each key that cannot have a law."""
    faults, valid = list[str](), value_keys()
    for key in (key for key in keys if not valid.get(key)):
        name, table = one_line(key, LONGEST_NAME), key.partition(".")[0]
        if table in NO_INPUTS:
            faults.append(f"uncertain: {name}: {table} holds no property of the bearing; remove it")
        elif key in valid:
            faults.append(f"uncertain: {name}: holds more than one value; name a key of a single value")
        else:
            # A search for the nearest key takes a millisecond: only for reported faults.
            similar = [other for other in valid if other.startswith(f"{table}.")] or valid
            near = difflib.get_close_matches(name, similar, n=1) if len(faults) < MOST_FAULTS else []
            faults.append(f"uncertain: {name}: unknown key; {f'did you mean {near[0]}?' if near else 'remove it'}")
    return faults


def _times_faults(scene: Scene, inputs: Iterable[Input]) -> Iterator[str]:
    """A sentence for each law whose factor is no number, is 0, or depends on its own key."""
    laws = {entry.key: entry.law for entry in inputs}
    visited = set[str]()
    for key, law in laws.items():
        if law.times is None:
            continue
        where = f'uncertain."{key}".times = "{one_line(law.times, LONGEST_NAME)}"'
        base, other = value_of(scene, law.times) if value_keys().get(law.times) else None, laws.get(law.times)
        if not is_number(base):
            yield f"{where}: the scene has no number there; name another key"
        elif base == 0.0:
            yield f"{where}: the scene has 0 there, so all multiples are 0; give a law without times"
        elif other is not None and not all(map(is_number, getattr(other, "values", None) or ())):
            yield f"{where}: the values of that key are not numbers; name another key"
        path, step = set[str](), key
        while step in laws and step not in visited and (base_key := laws[step].times) not in (None, step):
            path.add(step)
            visited.add(step)
            step = str(base_key)
        if step in path:
            yield f'{where}: leads back to "{step}"; remove times from one of these keys'


def is_number(value: Any) -> bool:
    """Whether a value of a scene is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def with_values(
    data: Mapping[str, Any], source: str, laws: Mapping[str, Law | Sampled], values: Mapping[str, Any]
) -> dict[str, Any]:
    """Tables of the scene at ``values`` of its inputs; relative values are multiplied by the value of their base key.

    Raises InputError where these values give no valid scene.
    """
    tables, times = deepcopy(dict(data)), {key: laws[key].times for key in values}
    numbers = {key: value for key, value in values.items() if times[key] is None}
    relative = {key: base for key, base in times.items() if base is not None}
    _multiply(tables, numbers, relative, values)
    # Stated values come first: derived ones may follow from them, though not from each other.
    for late in (False, True):
        roots = {
            key: base
            for key, base in relative.items()
            if (base == key or base not in values) and late == (base in FOLLOWING and not _has_entry(tables, base))
        }
        scene = Scene.from_dict(tables, source) if roots else None
        numbers = {key: _number(scene, base, key, source) * values[key] for key, base in roots.items()}
        relative = {key: base for key, base in relative.items() if key not in roots}
        _multiply(tables, numbers, relative, values)
    return tables


def _multiply(
    tables: dict[str, Any], numbers: dict[str, Any], relative: dict[str, str], values: Mapping[str, Any]
) -> None:
    """Put ``numbers`` of keys into tables, then the products of ``relative`` keys with these, which are removed from there."""
    while numbers:
        for key, value in numbers.items():
            put_key(tables, key, value, f'uncertain."{key}"')
        products = {key: base for key, base in relative.items() if base != key and base in numbers}
        for key in products:
            del relative[key]
        numbers = {key: values[key] * numbers[base] for key, base in products.items()}


def _number(scene: Scene | None, base: str, key: str, source: str) -> float:
    value = value_of(scene, base)
    if not is_number(value):
        raise InputError(
            f'{source}: uncertain."{key}".times = "{base}": the scene has no number there; name another key'
        )
    return float(value)


def value_of(scene: Scene | None, key: str) -> Any:
    """Value of a dotted key of a scene: stated, by default or derived; None without a value."""
    value: Any = scene
    for part in key.split("."):
        value = getattr(value, part, None)
    return DERIVED[key](scene) if scene and value is None and key in DERIVED else value


def plain_values(scene: BaseModel) -> dict[str, Any]:
    """Value by dotted key of all tables; "left out" for a key without a value.

    Keys that a scene saves only where they differ from None are not among them.
    """
    tables = {table: keys for table, keys in scene.model_dump(mode="json").items() if isinstance(keys, dict)}
    nested = {f"{table}.{key}": value for table, keys in tables.items() for key, value in keys.items()}
    tables |= {table: keys for table, keys in nested.items() if isinstance(keys, dict)}
    values = {
        f"{table}.{key}": LEFT_OUT if value is None else value
        for table, keys in tables.items()
        for key, value in keys.items()
    }
    for name in type(scene).model_fields:
        table = getattr(scene, name)
        if isinstance(table, Sparse):
            values |= {f"{name}.{key}": usual for key, usual in table.UNSAVED.items() if usual is not None} | values
    return values


def documented_of(scene: Scene) -> list[Documented]:
    """The documented ranges that apply to a scene."""
    values = plain_values(scene)
    moduli = {
        f"materials.{part}.elastic_modulus_GPa": 1e-9 * scene.material(part).elastic_modulus
        for part in type(scene.materials).model_fields
    }
    ranges = [entry for entry in documented() if entry.key in values and entry.counts({**values, **moduli})]
    return [
        entry
        if entry.plus is None
        else entry.about(float(value_of(scene, entry.plus)), LIMITS.get(entry.key, NO_LIMITS))
        for entry in ranges
    ]


def _has_entry(data: Mapping[str, Any], key: str) -> bool:
    *path, name = key.split(".")
    table: Any = data
    for part in path:
        table = table.get(part) if isinstance(table, Mapping) else None
    return isinstance(table, Mapping) and name in table
