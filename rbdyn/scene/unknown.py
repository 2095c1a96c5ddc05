"""Which inputs of a scene are not known, and the scene at values of them."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from types import MappingProxyType
from typing import Any, NamedTuple

from rbdyn.faults import InputError, refuse
from rbdyn.scene import Scene
from rbdyn.scene.uncertain import LEFT_OUT, Documented, Law, Sampled, Uncertain, documented

# What a key is worth that is left out and follows from the rest, in its own unit.
DERIVED: Mapping[str, Callable[[Scene], float]] = {
    "cage.land_diameter_mm": lambda scene: scene.land_diameter_mm,
    "cage.inertia_kg_mm2": lambda scene: 1e6 * scene.geometry.cage_inertia,
    "cage.pocket_contact_length_mm": lambda scene: scene.bearing.effective_length_mm,
    "lubricant.viscosity_mPas": lambda scene: 1e3 * scene.lubricant.in_service.viscosity,
    "lubricant.pressure_coefficient_1_GPa": lambda scene: 1e9 * scene.lubricant.in_service.pressure_coefficient,
}


class Input(NamedTuple):
    """An input that is not known: its key, its law, and why that law."""

    key: str
    law: Law | Sampled
    reason: str


def inputs_of(
    scene: Scene,
    data: Mapping[str, Any],
    uncertain: Uncertain,
    fixed: frozenset[str] = frozenset(),
    sample: Mapping[str, Sampled] = MappingProxyType({}),
) -> list[Input]:
    """Inputs of a scene that are not known, sorted by key: what is declared, and what is documented of the rest.

    ``data``: the tables that the scene was read from: what stands there is known unless it is named as estimated.
    ``fixed``: keys that vary otherwise; ``sample``: those of a posterior sample. Raises InputError for keys that cannot vary.
    """
    ranges, faults = {each.key: each for each in documented_of(scene)}, []
    for key in {**uncertain.laws, **sample}:
        if key in fixed:
            faults.append(f'uncertain."{key}": is a factor of the study too; take it out of one of them')
        elif key in sample:
            pairs = [pair.keys for pair in uncertain.correlation if key in pair.keys]
            faults += [f'uncertain.correlation.keys = {keys}: "{key}" is in the sample; take it out' for keys in pairs]
        elif (times := uncertain.laws[key].times) is not None:
            if times != key and times in uncertain.laws and uncertain.laws[times].times is not None:
                faults.append(f'uncertain."{key}".times = "{times}": is itself relative to another key; name that one')
            elif not isinstance(value_of(scene, times), int | float):
                faults.append(f'uncertain."{key}".times = "{times}": the scene has no number there; name another key')
    known = {each.key for each in documented()}
    faults += [
        f'uncertain.estimated: "{key}" has no documented range; write "{key}" = {{law = ...}}'
        for key in uncertain.estimated
        if key not in known
    ]
    refuse(faults)
    found = [Input(key, law, "declared") for key, law in uncertain.laws.items() if key not in sample]
    found += [Input(key, values, "posterior sample") for key, values in sample.items()]
    if uncertain.defaults == "documented":
        found += [
            Input(key, each.as_law, each.reason)
            for key, each in ranges.items()
            if key not in {*uncertain.laws, *sample, *fixed}
            and not each.asked
            and (key in uncertain.estimated or not _given(data, key))
        ]
    return sorted(found)


def with_values(
    data: Mapping[str, Any], source: str, laws: Mapping[str, Law | Sampled], values: Mapping[str, Any]
) -> dict[str, Any]:
    """Tables of the scene at values of its inputs; numbers that multiply another key's value do so here.

    Raises InputError where no scene has these values.
    """
    tables, later = deepcopy(dict(data)), {}
    for key, value in values.items():
        base = laws[key].times
        if base is None:
            put(tables, key, value)
        elif base != key and base in values:
            put(tables, key, value * values[base])
        else:
            later[key] = base
    # The rest multiplies what the scene has there, which may follow from the others.
    scene = Scene.from_dict(tables, source) if later else None
    for key, base in later.items():
        put(tables, key, value_of(scene, base) * values[key])
    return tables


def put(tables: dict[str, Any], key: str, value: Any) -> None:
    """Set a dotted key of nested tables. Raises InputError where its path runs through a value."""
    *path, name = key.split(".")
    for part in path:
        tables = tables.setdefault(part, {})
        if not isinstance(tables, dict):
            raise InputError([f'uncertain."{key}": {part} is a value, not a table; check the key'])
    tables[name] = value


def value_of(scene: Scene | None, key: str) -> Any:
    """What a scene has at a dotted key, given, by default or worked out; None where there is nothing."""
    found: Any = scene
    for part in key.split("."):
        found = getattr(found, part, None)
    return DERIVED[key](scene) if scene and found is None and key in DERIVED else found


def plain_values(scene: Scene) -> dict[str, Any]:
    """Value by dotted key of all tables; "left out" where there is none."""
    return {
        f"{table}.{key}": LEFT_OUT if value is None else value
        for table, keys in scene.model_dump(mode="json").items()
        if isinstance(keys, dict)
        for key, value in keys.items()
    }


def documented_of(scene: Scene) -> list[Documented]:
    """The documented ranges that count for a scene."""
    values = plain_values(scene)
    moduli = {
        f"materials.{part}.elastic_modulus_GPa": 1e-9 * scene.material(part).elastic_modulus
        for part in type(scene.materials).model_fields
    }
    return [each for each in documented() if each.key in values and each.counts({**values, **moduli})]


def _given(data: Mapping[str, Any], key: str) -> bool:
    table, _, name = key.rpartition(".")
    return isinstance(data.get(table), dict) and name in data[table]
