"""A bad scene is refused with every fault at once, each naming file, key, value and mend."""

import copy
import math
import pydoc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_scene import TABLE, faults_of

from rbdyn.base.faults import InputError, read_toml
from rbdyn.scene import BallScene, Scene

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_unit_the_plain_scene_is_good():
    """Unit: the table of these tests is a scene, and its defaults are those of the documentation."""
    scene = Scene.from_dict(copy.deepcopy(TABLE))
    assert scene.numerics.method == "auto"
    assert (scene.numerics.turns, scene.numerics.discard_turns, scene.numerics.replicates) == (100, 20, 8)
    assert (scene.model.race_damping_ratio, scene.materials.cage) == (0.05, "bronze")
    assert scene.turn_s == pytest.approx(2.5e-3)
    assert scene.land_diameter_mm == pytest.approx(49.5)


def test_unit_all_faults_at_once():
    """Unit: seven faults in four tables are seven sentences, each with file, key, value and mend."""
    faults = faults_of(
        changes={
            "bearing.rollers": 1,
            "bearing.roller_diameter_mm": -9.0,
            "cage.guidance": "middle",
            "cage.mass_g": math.nan,
            "lubricant.temperature_c": 100.0,
            "operation.radial_load_N": "1300",
            "numerics.rtol": 1.0,
        }
    )
    expected = [
        ("bearing.rollers = 1", "at least 2"),
        ("bearing.roller_diameter_mm = -9.0", "at least 0.5"),
        ("cage.guidance = 'middle'", "'outer', 'inner' or 'roller'"),
        ("cage.mass_g = nan", "finite"),
        ("lubricant.temperature_c: unknown key", "temperature_C?"),
        ("operation.radial_load_N = '1300'", "number without quotes"),
        ("numerics.rtol = 1.0", "at most 0.1"),
    ]
    assert len(faults) == len(expected)
    for key, mend in expected:
        matching = [fault for fault in faults if key in fault]
        assert len(matching) == 1, key
        assert matching[0].startswith("bearing.toml: ") and mend in matching[0]


def test_unit_missing_keys_and_tables():
    """Unit: what is missing is named, a whole table too."""
    table = copy.deepcopy(TABLE)
    del table["bearing"]["rollers"], table["cage"]["mass_g"], table["operation"]
    with pytest.raises(InputError) as caught:
        Scene.from_dict(table, "s.toml")
    assert sorted(caught.value.faults) == [
        "s.toml: bearing.rollers: missing; add it",
        "s.toml: cage.mass_g: missing; add it",
        "s.toml: operation: missing; add it",
    ]


@pytest.mark.parametrize(
    ("key", "value", "suggestion"),
    [
        ("bearing.roler_diameter_mm", 9.0, "did you mean roller_diameter_mm?"),
        ("cage.pocket_clearence_mm", 0.3, "did you mean pocket_clearance_mm?"),
        ("model.rolling_resistence", "off", "did you mean rolling_resistance?"),
        ("numerics.qqq", 1, "known keys here: "),
        ("tractoin.mu_m", 0.1, "did you mean traction?"),
    ],
)
def test_unit_unknown_keys_are_suggested(key, value, suggestion):
    """Unit: an unknown key is met with the nearest known one, else with all of them."""
    (fault,) = faults_of(changes={key: value})
    assert "unknown key" in fault and suggestion in fault


@pytest.mark.parametrize(
    ("table", "missing", "key", "suggestion"),
    [
        ("operation", "inner_speed_rpm", "speed_rpm", "inner_speed_rpm"),
        ("operation", "inner_speed_rpm", "speed", "inner_speed_rpm"),
        ("operation", "inner_speed_rpm", "outer_sped_rpm", "outer_speed_rpm"),
        ("operation", "radial_load_N", "load", "radial_load_N"),
        ("operation", "radial_load_N", "load_N", "radial_load_N"),
        ("bearing", "radial_clearance_mm", "clearance_mm", "radial_clearance_mm"),
        ("bearing", "roller_length_mm", "length_mm", "roller_length_mm"),
        ("bearing", "effective_length_mm", "length_mm", "effective_length_mm"),
        ("cage", "guide_clearance_mm", "clearance_mm", "guide_clearance_mm"),
        ("cage", "pocket_clearance_mm", "clearance_mm", "pocket_clearance_mm"),
        ("cage", "mass_g", "mass", "mass_g"),
    ],
)
def test_unit_a_missing_key_is_suggested_before_others(table, missing, key, suggestion):
    """Unit: an unknown key in a table that lacks a required one means that, unless another is clearly more alike."""
    tables = copy.deepcopy(TABLE)
    tables[table][key] = tables[table].pop(missing, 0.1)
    with pytest.raises(InputError) as caught:
        Scene.from_dict(tables, "s.toml")
    assert f"s.toml: {table}.{key}: unknown key; did you mean {suggestion}?" in caught.value.faults
    assert f"s.toml: {table}.{missing}: missing; add it" in caught.value.faults


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("key", ["cage.mass_g", "operation.inner_speed_rpm", "bearing.radial_clearance_mm"])
def test_unit_numbers_must_be_finite(key, value):
    """Unit: NaN and infinity are refused everywhere, in the words of the writer."""
    (fault,) = faults_of(changes={key: value})
    assert f"{key} = {value}" in fault and "finite" in fault


@pytest.mark.parametrize(
    ("key", "value", "mend"),
    [
        ("bearing.rollers", 10.0, "whole number"),
        ("bearing.rollers", 10.5, "whole number"),
        ("bearing.rollers", "10", "whole number without quotes"),
        ("bearing.rollers", True, "whole number"),
        ("bearing.pitch_diameter_mm", "43.5", "number without quotes"),
        ("cage.guidance", 3, "choose one of"),
        ("numerics.companion", "yes", "true or false"),
        ("numerics.companion_share", 0.0, "greater than 0"),
        ("numerics.discard_turns", "some", "choose one of 'auto'"),
        ("numerics.discard_turns", -1.0, "at least 0"),
        ("materials.cage", {"elastic_modulus_GPa": 100.0}, "missing"),
    ],
)
def test_unit_wrong_types(key, value, mend):
    """Unit: nothing is converted in silence."""
    faults = faults_of(changes={key: value})
    assert any(key in fault and mend in fault for fault in faults), faults


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"bearing.rollers": 16}, ("bearing.rollers = 16", "do not fit", "take fewer or smaller")),
        ({"bearing.effective_length_mm": 5.5}, ("effective_length_mm = 5.5", "longer than the roller", "5 mm")),
        ({"cage.pocket_clearance_mm": 4.5}, ("pocket_clearance_mm = 4.5", "no cross-bar", "smaller")),
        ({"model.land_film_floor_um": 75.0}, ("land_film_floor_um = 75", "75 um", "lower it")),
        ({"cage.land_diameter_mm": 60.0}, ("land_diameter_mm = 60", "raceways of 34.5 and 52.5")),
        ({"traction.mu_m": 0.03}, ("traction.mu_m = 0.03", "peak must lie above", "raise it")),
        ({"operation.inner_speed_rpm": 0.0}, ("inner_speed_rpm = 0", "at least 0.1")),
        ({"bearing.radial_clearance_mm": 1.0}, ("radial_clearance_mm = 1", "tenth of the roller")),
        ({"numerics.turns": 1e-3}, ("numerics.turns = 0.001", "lengthen")),
    ],
)
def test_unit_what_cannot_be_built(changes, words):
    """Unit: lawful numbers that make no bearing are refused with the geometry that forbids them."""
    (fault,) = faults_of(changes=changes)
    assert fault.startswith("bearing.toml: ")
    for word in words:
        assert word in fault


def test_unit_geometry_faults_come_together():
    """Unit: two impossible things in one table are two sentences."""
    faults = faults_of(changes={"bearing.rollers": 20, "bearing.effective_length_mm": 7.0})
    assert len(faults) == 2


def test_unit_largest_load_counts_everything():
    """Unit: the largest scheduled load, the rotating load and the unbalance at the highest speed, all in line."""
    schedule = {"time_s": [0.0, 1.0], "radial_load_N": [100.0, 700.0], "inner_speed_rpm": [3000.0, -6000.0]}
    table = copy.deepcopy(TABLE)
    table["operation"] |= {"schedule": schedule, "rotating_load_N": 50.0, "unbalance_g_mm": 2.0}
    expected = 750.0 + 2e-6 * (6000.0 * math.pi / 30.0) ** 2
    assert Scene.from_dict(table).operation.largest_load_N == pytest.approx(expected, rel=1e-12)


def test_unit_overrides():
    """Unit: assignments take TOML values or bare words, make tables, and are checked like the file."""
    scene = Scene.from_dict(
        copy.deepcopy(TABLE),
        overrides=("cage.guidance=inner", "numerics.turns = 7", "materials.cage.elastic_modulus_GPa=60.0",
                   "materials.cage.poisson_ratio=0.3", "materials.cage.density_kg_m3=2700.0", "model.slices=3"),
    )  # fmt: skip
    assert (scene.cage.guidance, scene.numerics.turns, scene.model.slices) == ("inner", 7, 3)
    assert scene.material("cage").density == 2700.0
    assert "write it as key.path=value" in faults_of("numerics.turns")[0]
    assert "write it as key.path=value" in faults_of("numerics..turns=3")[0]
    assert "is a value, not a table" in faults_of("bearing.rollers.count=3")[0]
    assert "did you mean turns?" in faults_of("numerics.turn=3")[0]


def test_unit_files(tmp_path):
    """Unit: a missing file, a folder, bad TOML and text that is not UTF-8 are sentences, not tracebacks."""
    with pytest.raises(InputError, match=r"none\.toml: no such file; check the path"):
        Scene.load(tmp_path / "none.toml")
    with pytest.raises(InputError, match="cannot be read"):
        Scene.load(tmp_path)
    path = tmp_path / "bad.toml"
    path.write_text("[bearing\nrollers = 10\n")
    with pytest.raises(InputError, match=r"bad\.toml: not valid TOML .*line 1.*fix that line"):
        Scene.load(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="cannot be read"):
        Scene.load(path)


def test_unit_example_loads_and_is_frozen(outer):
    """Unit: the example is a scene; equal scenes are equal; nothing in it can be changed."""
    from conftest import EXAMPLE

    assert Scene.load(EXAMPLE) == Scene.from_dict(read_toml(EXAMPLE))
    with pytest.raises(ValueError, match="frozen"):
        outer.bearing.rollers = 11


SECTIONS = ("bearing", "cage", "lubricant", "operation", "traction", "model", "numerics")
values = st.one_of(
    st.none(), st.booleans(), st.integers(-5, 100), st.floats(), st.text(max_size=5), st.lists(st.integers(), max_size=2)
)  # fmt: skip


@given(section=st.sampled_from([*SECTIONS]), draw=st.data())
@settings(max_examples=300, deadline=None)
def test_invariant_anything_is_taken_or_refused_in_sentences(section, draw):
    """Invariant: any value of any key gives a scene or an InputError that names a key, never another exception."""
    model = Scene.model_fields[section].annotation
    key = draw.draw(st.sampled_from(sorted(model.model_fields)))
    table = copy.deepcopy(TABLE)
    table.setdefault(section, {})[key] = draw.draw(values)
    try:
        Scene.from_dict(table, "s.toml")
    except InputError as error:
        assert error.faults
        assert all(fault.startswith("s.toml: ") and "\n" not in fault for fault in error.faults)
        assert all(section in fault or "." in fault for fault in error.faults)


def test_unit_a_changed_scene_is_that_of_a_changed_file():
    """Unit: what follows from a key that was changed follows anew, and the first scene stays."""
    first = Scene.from_dict(copy.deepcopy(TABLE))
    changes = {"cage.mass_g": 50, "lubricant.oil": "ISO VG 68", "numerics.rtol": np.float64(1e-3)}
    found = first.changed(changes)
    wanted = [f"{key}={value!r}" if isinstance(value, str) else f"{key}={value}" for key, value in changes.items()]
    assert found == Scene.from_dict(copy.deepcopy(TABLE), "scene", wanted) and found != first
    assert first.changed({}) == first and first.cage.mass_g == 45.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cage.mass_gg": 50.0}, "changed scene: cage.mass_gg: unknown key; did you mean mass_g?"),
        ({"cage.mass_g": -1.0}, "changed scene: cage.mass_g = -1.0: must be at least 0.01; check its unit, g"),
        ({"cage.mass_g.x": 1.0}, "changed 'cage.mass_g.x': mass_g is a value, not a table; check the key path"),
        ({"cage..x": 1.0}, "changed 'cage..x': write it as key.path=value"),
    ],
)
def test_unit_a_bad_change_is_refused_as_in_a_file(changes, words):
    """Unit: the same sentences."""
    with pytest.raises(InputError) as caught:
        Scene.from_dict(copy.deepcopy(TABLE)).changed(changes)
    assert caught.value.faults == [words]


def test_unit_tables_by_keyword_are_those_of_a_file():
    """Unit: equal scenes, equal faults, and a ball bearing's tables give a scene of balls."""
    assert Scene(**copy.deepcopy(TABLE)) == Scene.from_dict(copy.deepcopy(TABLE))
    table = copy.deepcopy(TABLE)
    table["cage"]["mas_g"] = table["cage"].pop("mass_g")
    with pytest.raises(InputError) as caught:
        Scene(**table)
    assert set(caught.value.faults) == {
        "Scene: cage.mass_g: missing; add it",
        "Scene: cage.mas_g: unknown key; did you mean mass_g?",
    }
    balls = read_toml(EXAMPLES / "deep_groove_ball.toml")
    assert isinstance(Scene(**balls), BallScene)


@pytest.mark.parametrize("name", ["cylindrical_roller", "all_options", "deep_groove_ball", "double_decker"])
def test_unit_a_notebook_shows_what_was_given(name):
    """Unit: a line, and a table with every table of the file; no default among them."""
    scene = Scene.load(EXAMPLES / f"{name}.toml")
    assert len(repr(scene)) < 200 and repr(scene) == str(scene) and "mm" in repr(scene)
    table = scene._repr_html_()
    assert all(f">{key}</th>" in table for key in read_toml(EXAMPLES / f"{name}.toml"))
    assert "step_budget_per_turn" not in table and len(table) < 3000


def test_unit_help_tells_how_a_scene_is_made():
    """Unit: what is typed first, and a signature without hundreds of defaults."""
    shown = pydoc.plain(pydoc.render_doc(Scene))
    assert all(
        each in shown for each in ('Scene.load("SCENE.toml")', "scene.changed({", "rbdyn keys", "rbdyn.simulate(scene)")
    )
    assert len(shown.splitlines()[3]) < 900
