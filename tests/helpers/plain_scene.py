"""A plain scene of a roller bearing as tables, and the sentences with which changes of it are refused."""

import copy

import pytest

from rbdyn.base.faults import InputError
from rbdyn.scene import Scene

TABLE = {
    "bearing": {
        "kind": "cylindrical_roller", "rollers": 10, "roller_diameter_mm": 9.0, "roller_length_mm": 5.0,
        "effective_length_mm": 3.5, "pitch_diameter_mm": 43.5, "radial_clearance_mm": 0.020,
    },
    "cage": {"guidance": "outer", "guide_clearance_mm": 0.15, "pocket_clearance_mm": 0.30, "mass_g": 45.0},
    "lubricant": {"oil": "MIL-L-7808", "temperature_C": 100.0},
    "operation": {"inner_speed_rpm": 24000.0, "radial_load_N": 1300.0},
}  # fmt: skip


def faults_of(*assignments, changes=None):
    """Sentences with which the scene is refused; ``changes``: {dotted key: any Python value}."""
    table = copy.deepcopy(TABLE)
    for path, value in (changes or {}).items():
        section, key = path.split(".")
        table.setdefault(section, {})[key] = value
    with pytest.raises(InputError) as caught:
        Scene.from_dict(table, "bearing.toml", assignments)
    return caught.value.faults
