"""Ball bearings that several tests share: tables of scenes, and solutions that are checked."""

import copy

import numpy as np

from rbdyn import BallScene
from rbdyn.quasistatic.row.equilibrium import solve
from rbdyn.quasistatic.row.model import row_of

FREE = np.full(5, np.nan)
AT_REST = {"inner_speed_rpm": 0.0, "outer_speed_rpm": 0.0}
CAGE = {"raceway_control": "common_cage"}
HARD = {"raceway_control": "outer"}

# 71808 of Hu et al. 2021, Table 1, at the third condition of their Table 3.
SMALL = {
    "bearing": {
        "kind": "angular_contact_ball", "balls": 29, "ball_diameter_mm": 3.175, "pitch_diameter_mm": 46.0,
        "contact_angle_deg": 25.0, "inner_groove_factor": 0.515, "outer_groove_factor": 0.525,
    },
    "operation": {
        "inner_speed_rpm": 30000.0, "radial_load_N": 200.0, "axial_load_N": 200.0, "tilt": "fixed",
    },
    "model": {"raceway_control": "outer"},
}  # fmt: skip
# 218, the example of Harris, Rolling Bearing Analysis.
LARGE = {
    "bearing": {
        "kind": "angular_contact_ball", "balls": 16, "ball_diameter_mm": 22.225, "pitch_diameter_mm": 125.26,
        "contact_angle_deg": 40.0, "inner_groove_factor": 0.5232, "outer_groove_factor": 0.5232,
    },
    "operation": {"inner_speed_rpm": 10000.0, "load_N": [6000.0, -1500.0, 15000.0], "moment_Nm": [90.0, -140.0], "tilt": "free"},
    "model": {"raceway_control": "hybrid"},
}  # fmt: skip
# 209 with clearance, both rings turning, under a load that leaves balls unloaded.
DEEP = {
    "bearing": {
        "kind": "deep_groove_ball", "balls": 9, "ball_diameter_mm": 12.7, "pitch_diameter_mm": 65.0,
        "radial_clearance_mm": 0.015, "inner_groove_factor": 0.52, "outer_groove_factor": 0.52,
    },
    "operation": {
        "inner_speed_rpm": 9000.0, "outer_speed_rpm": -4000.0, "load_N": [2500.0, 400.0, 100.0], "tilt": "fixed",
    },
    "model": {"raceway_control": "outer"},
}  # fmt: skip


def changed(table, **groups):
    """A table with keys of its groups changed; ``None`` takes a key away."""
    table = copy.deepcopy(table)
    for group, values in groups.items():
        part = table.setdefault(group, {})
        for key, value in values.items():
            part.pop(key, None)
            if value is not None:
                part[key] = value
    return table


def scene(table, **groups):
    """A scene of a table with changes."""
    return BallScene.from_dict(changed(table, **groups))


def model_of(table, **groups):
    """Row and control of a table with changes."""
    model = row_of(scene(table, **groups))
    return model.row, model.control


def balanced(row, control, load, given=None, start=None):
    """A solution, which must be one: its residual and that of the ring below 1e-9 of the largest force."""
    found = solve(row, control, np.asarray(load, float), given, start)
    assert found.is_equilibrium, found.status
    largest = max(np.abs(found.inner_load).max(), np.abs(found.outer_load).max(), np.abs(load[:3]).max(), 1e-9)
    assert found.residual <= 1e-9 * largest
    assert all(np.isfinite(part).all() for part in found if isinstance(part, np.ndarray))
    lacking = np.where(np.isnan(FREE if given is None else given), load - found.reaction, 0.0)
    assert np.abs(lacking / np.array([1.0, 1.0, 1.0, row.lever, row.lever])).max() <= 1e-9 * largest
    return found
