"""Contradictions between keys of a scene, of a schedule, a profile and errors of rollers among others: each a sentence."""

import copy

import pytest
from plain_scene import TABLE, faults_of

from rbdyn.scene import Scene

SCHEDULE = {"time_s": [0.0, 1.0], "radial_load_N": [1.0, 2.0]}
PROFILED = {"bearing.roller_profile": "table"}
# Faults of what a scene may add to the plain bearing: changes, and the words that its one sentence must have.
ADDED_FAULTS = {
    "profile beyond the roller": (
        {**PROFILED, "bearing.profile_table_mm_um": [[0.0, 0.0], [2.6, 3.0]]},
        ("bearing.profile_table_mm_um", "(2.6 mm, 3 um)", "beyond the roller's end at 2.5 mm", "shorten"),
    ),
    "positions that do not rise": (
        {**PROFILED, "bearing.profile_table_mm_um": [[0.0, 0.0], [1.0, 1.0], [1.0, 2.0], [2.0, 3.0]]},
        ("bearing.profile_table_mm_um", "must rise", "sort them"),
    ),
    "profile short of the contact": (
        {**PROFILED, "bearing.profile_table_mm_um": [[0.0, 0.0], [1.0, 1.0]]},
        ("bearing.profile_table_mm_um: ends at 1 mm", "the contact of 1.75 mm", "extend the table"),
    ),
    "whole profile short of one end of the contact": (
        {**PROFILED, "bearing.profile_table_mm_um": [[-2.5, 5.0], [-1.0, 0.0]]},
        ("bearing.profile_table_mm_um: ends at -1 mm", "the contact of 1.75 mm", "extend the table"),
    ),
    "profile that rises outward": (
        {**PROFILED, "bearing.profile_table_mm_um": [[0.0, 0.0], [2.5, -5.0]]},
        ("bearing.profile_table_mm_um: point (2.5 mm, -5 um)", "drop below 0", "measure from the highest point"),
    ),
    "points that are not pairs": (
        {**PROFILED, "bearing.profile_table_mm_um": [[0.0, 0.0], [1.0, 1.0, 2.0]]},
        ("bearing.profile_table_mm_um", "each point is [position in mm, drop in um]"),
    ),
    "table without its points": (PROFILED, ("bearing.profile_table_mm_um: missing", "'table' needs it")),
    "crown without its radius": ({"bearing.roller_profile": "crowned"}, ("bearing.crown_radius_mm: missing", "'crowned' needs it")),
    "crown smaller than the roller": (
        {"bearing.roller_profile": "crowned", "bearing.crown_radius_mm": 2.0},
        ("bearing.crown_radius_mm = 2", "above 2.5 mm", "enlarge it"),
    ),
    "radius of another profile": (
        {"bearing.roller_profile": "logarithmic", "bearing.crown_radius_mm": 500.0},
        ("bearing.crown_radius_mm and bearing.roller_profile = 'logarithmic' contradict", "'crowned'"),
    ),
    "load of another profile": (
        {"bearing.lundberg_load_N": 500.0},
        ("bearing.lundberg_load_N and bearing.roller_profile = 'cylinder' contradict", "'lundberg'"),
    ),
    "one slice with a profile": (
        {"bearing.roller_profile": "logarithmic", "model.slices": 1},
        ("model.slices = 1 contradicts bearing.roller_profile = 'logarithmic'", "leave model.slices out"),
    ),
    "one slice with a tilt": (
        {"bearing.tilt_mrad": 1.0, "model.slices": 1},
        ("model.slices = 1 contradicts", "bearing.tilt_mrad = 1", "neither profile nor tilt"),
    ),
    "tilt that leaves no contact": (
        {"bearing.tilt_mrad": 20.0, "operation.radial_load_N": 0.1},
        ("bearing.tilt_mrad = 20", "even under 0.1 N", "of 3.5 mm", "reduce the tilt"),
    ),
    "errors of too few rollers": (
        {"bearing.roller_diameter_errors_um": [1.0, 2.0]},
        ("bearing.roller_diameter_errors_um: 2 values for 10 rollers", "one value for each roller"),
    ),
    "errors and their spread": (
        {"bearing.roller_diameter_errors_um": [0.0] * 10, "bearing.roller_diameter_spread_um": 1.0},
        ("roller_diameter_errors_um and bearing.roller_diameter_spread_um contradict", "not both"),
    ),
    "errors of another unit": (
        {"bearing.roller_diameter_errors_um": [200.0] + [0.0] * 9},
        ("bearing.roller_diameter_errors_um", "beyond 90 um", "micrometres"),
    ),
    "lips without roller guidance": (
        {"cage.pocket_radial_clearance_mm": 0.1},
        ("cage.pocket_radial_clearance_mm and cage.guidance = 'outer' contradict", "'roller'"),
    ),
    "restitution and alpha": (
        {"model.pocket_restitution": 0.6, "model.pocket_damping_alpha_s_m": 0.5},
        ("model.pocket_restitution and model.pocket_damping_alpha_s_m contradict", "give one of them"),
    ),
    "restitution of nothing": ({"model.pocket_restitution": 0.0}, ("pocket_restitution = 0.0", "greater than 0")),
    "restitution above one": ({"model.land_restitution": 1.2}, ("land_restitution = 1.2", "at most 1")),
    "film in a pocket that is off": (
        {"model.pocket": "off", "model.pocket_film": True},
        ("model.pocket = 'off' and model.pocket_film = true contradict", "leave out one of them"),
    ),
    "film floor above the pocket's clearance": (
        {"model.pocket_film": True, "model.pocket_film_floor_um": 150.0},
        ("model.pocket_film_floor_um = 150", "half the pocket clearance of 150 um", "cage.pocket_clearance_mm"),
    ),
    "pocket contact longer than the roller": (
        {"cage.pocket_contact_length_mm": 5.5},
        ("cage.pocket_contact_length_mm = 5.5", "longer than the roller of 5 mm", "shorten it"),
    ),
    "pocket contact of no length": ({"cage.pocket_contact_length_mm": 0.0}, ("cage.pocket_contact_length_mm = 0.0", "greater than 0")),
    "times that do not rise": (
        {"operation.schedule": {**SCHEDULE, "time_s": [1.0, 0.5]}},
        ("operation.schedule.time_s", "0.5 s (point 2) follows 1 s", "sort them"),
    ),
    "values that miss times": (
        {"operation.schedule": {**SCHEDULE, "inner_speed_rpm": [1.0, 2.0, 3.0]}},
        ("operation.schedule.inner_speed_rpm: 3 values for 2 times", "one value for each time"),
    ),
    "schedule of nothing": (
        {"operation.schedule": {"time_s": [0.0, 1.0]}},
        ("operation.schedule: has neither speed nor load", "inner_speed_rpm or radial_load_N"),
    ),
    "schedule that is no table": ({"operation.schedule": ""}, ("operation.schedule = ''", "table of keys")),
    "wave of no order": (
        {"bearing.outer_waviness": [{"order": 0, "amplitude_um": 1.0}]},
        ("bearing.outer_waviness[1].order = 0", "at least 1"),
    ),
    "neither ring turns": (
        {"operation.inner_speed_rpm": 0.0, "operation.outer_speed_rpm": 0.05},
        ("operation.inner_speed_rpm = 0", "or set operation.outer_speed_rpm"),
    ),
    "support of no stiffness": (
        {"support.stiffness_N_m": 0.0, "support.damping_N_s_m": 0.0},
        ("support.stiffness_N_m = 0.0", "greater than 0"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ADDED_FAULTS)
def test_unit_faults_of_what_is_added(name):
    """Unit: each key beyond the plain bearing is refused in one sentence, with key, value and mend."""
    changes, words = ADDED_FAULTS[name]
    (fault,) = faults_of(changes=changes)
    assert fault.startswith("bearing.toml: ")
    for word in words:
        assert word in fault


def test_unit_contradictions_come_together():
    """Unit: contradictions within a table are told at once, and a second bad schedule value beside the first."""
    faults = faults_of(
        changes={
            "bearing.crown_radius_mm": 500.0,
            "bearing.lundberg_load_N": 900.0,
            "bearing.roller_diameter_errors_um": [0.0] * 9,
            "bearing.roller_diameter_spread_um": 1.0,
            "operation.schedule": {"time_s": [0.0, 2.0, 1.0, 1.0], "radial_load_N": [1.0]},
            "model.pocket_restitution": 0.5,
            "model.pocket_damping_alpha_s_m": 0.5,
            "model.land_restitution": 0.5,
            "model.land_damping_alpha_s_m": 0.5,
        }
    )
    tables = [fault.removeprefix("bearing.toml: ").partition(".")[0] for fault in faults]
    assert sorted(tables) == ["bearing"] * 4 + ["model"] * 2 + ["operation"] * 3


def test_unit_what_may_stand_together():
    """Unit: what is added in earnest is taken: an outer ring that turns alone, a small tilt, lips under roller guidance."""
    scene = Scene.from_dict(
        copy.deepcopy(TABLE),
        overrides=("operation.inner_speed_rpm=0.0", "operation.outer_speed_rpm=-6000.0", "bearing.tilt_mrad=0.5",
                   "cage.guidance=roller", "cage.pocket_radial_clearance_mm=0.1", "model.pocket_restitution=1.0"),
    )  # fmt: skip
    assert scene.turn_s == pytest.approx(0.01) and scene.slices == 31
    assert scene.model.alpha("pocket") == 0.0 and scene.model.alpha("land") == 0.75
    assert scene.guide_clearance_m is None
