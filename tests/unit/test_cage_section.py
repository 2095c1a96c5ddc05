"""The section of a cage in a scene: what follows from it, what overrules it, what is refused, how it is unknown."""

import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from doe.workflow.input_sets import case_of
from rbdyn.base.faults import InputError, read_toml
from rbdyn.cli.app import app
from rbdyn.contact.cage_bar import CageSection, Elastic, bar_stiffness
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.scene import Scene
from rbdyn.scene.bearing import STIFFNESS_ERROR
from rbdyn.scene.unknown import documented_of

SCENE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
STIFFNESS = "model.pocket_bar_stiffness_N_m"
SECTION = {"bar_width_mm": 4.2, "bar_thickness_mm": 4.0, "bar_length_mm": 5.2, "side_ring_width_mm": 2.5}


def scene_with(cage=None, **tables):
    """The example with a section, other keys of its cage, and other tables."""
    data = read_toml(SCENE)
    return Scene.from_dict({**data, "cage": {**data["cage"], **SECTION, **(cage or {})}, **tables})


def test_unit_stiffness_follows_from_the_section():
    """Unit: bars of bronze by the law, in the pockets of the model too; contact over the roller's effective length or the wall's."""
    section = CageSection(4.2e-3, 4.0e-3, 5.2e-3, 2.5e-3, 43.5e-3, 10)
    known = bar_stiffness(section, Elastic(110e9, 0.33), 3.5e-3)
    scene = scene_with()
    assert scene.model.pocket_bar_stiffness_N_m == pytest.approx(known, rel=1e-12)
    assert roller_bearing(scene).pocket.contact.bar_stiffness == scene.model.pocket_bar_stiffness_N_m
    short = scene_with({"pocket_contact_length_mm": 2.0}).model.pocket_bar_stiffness_N_m
    assert short == pytest.approx(bar_stiffness(section, Elastic(110e9, 0.33), 2.0e-3), rel=1e-12) and short < known
    (note,) = scene.section_notes
    assert f"{known:.3g} N/m (model.pocket_bar_stiffness_N_m), -45 to +25 %" in note


def test_unit_material_and_stated_stiffness():
    """Unit: another material scales it, a stated stiffness wins, and without a section the material's default stays."""
    scene, plain = scene_with(), Scene.load(SCENE)
    soft = scene.changed(
        {"materials.cage": {"elastic_modulus_GPa": 11.0, "poisson_ratio": 0.33, "density_kg_m3": 1300.0}}
    )
    ratio = soft.model.pocket_bar_stiffness_N_m / scene.model.pocket_bar_stiffness_N_m
    assert ratio == pytest.approx(0.1, rel=1e-9)
    for stated in (3e7, "rigid"):
        given = scene.changed({STIFFNESS: stated})
        assert given.model.pocket_bar_stiffness_N_m == stated and given.section_notes == ()
    assert plain.model.pocket_bar_stiffness_N_m == 5e7 and plain.section_notes == ()
    assert plain.changed({"materials.cage": "peek"}).model.pocket_bar_stiffness_N_m == 2.5e6
    wide = scene.changed({"cage.side_ring_width_mm": 5.0})
    assert wide.model.pocket_bar_stiffness_N_m > scene.model.pocket_bar_stiffness_N_m


@pytest.mark.parametrize(
    ("cage", "sentence"),
    [
        ({"bar_width_mm": 8.0}, "cage.bar_width_mm = 8: 10 such bars leave pockets of 5.666 mm, too narrow for rollers of 9 mm"),
        ({"bar_thickness_mm": 9.0}, "cage.bar_thickness_mm = 9: must be less than the roller diameter of 9 mm"),
        ({"bar_length_mm": 4.9}, "cage.bar_length_mm = 4.9: the pocket is shorter than its roller of 5 mm; lengthen it"),
        ({"bar_length_mm": 0.0052}, "if 0.0052 m are meant, write 5.2"),
        ({"bar_width_mm": -1.0}, "cage.bar_width_mm = -1.0: must be greater than 0"),
        ({"side_ring_width_mm": None}, "cage.side_ring_width_mm: missing; the stiffness of a bar needs its whole section"),
    ],
)  # fmt: skip
def test_unit_sections_without_room(cage, sentence):
    """Unit: what has no room in the bearing, and part of a section, is one sentence with key, value and fix."""
    data = read_toml(SCENE)
    table = {key: value for key, value in {**data["cage"], **SECTION, **cage}.items() if value is not None}
    with pytest.raises(InputError) as refused:
        Scene.from_dict({**data, "cage": table})
    (fault,) = refused.value.faults
    assert sentence in fault


def test_unit_faults_elsewhere_come_alone():
    """Unit: a scene with a section whose material or pitch circle is wrong says that, and nothing of the section."""
    for tables in (
        {"materials": {"cage": "wood"}},
        {"bearing": {**read_toml(SCENE)["bearing"], "pitch_diameter_mm": 20.0}},
    ):
        with pytest.raises(InputError) as refused:
            scene_with(**tables)
        assert not any("bar_" in fault for fault in refused.value.faults)


@pytest.mark.parametrize(
    ("key", "value", "meant"), [("bar_width_mm", 0.0042, "4.2"), ("side_ring_width_mm", 0.0025, "2.5"), ("bar_thickness_mm", 0.004, "4")]
)  # fmt: skip
def test_unit_a_section_in_metres_says_so(key, value, meant):
    """Unit: sizes that were given in metres are noted with the millimetres that were meant."""
    (note,) = (note for note in scene_with({key: value}).unit_notes if note.startswith(f"cage.{key}"))
    assert note.endswith(f"if {value:g} m are meant, write {meant}")


def test_unit_the_range_follows_the_section():
    """Unit: with a section the law's own error is the range, about what the section gives at each of its values."""
    scene = scene_with()
    (law,) = (each for each in documented_of(scene) if each.key == STIFFNESS)
    assert (law.low, law.high) == STIFFNESS_ERROR and law.times == STIFFNESS
    (plain,) = (each for each in documented_of(Scene.load(SCENE)) if each.key == STIFFNESS)
    assert (plain.low, plain.high, plain.times) == (1e7, 2e8, None)
    assert not [
        each for each in documented_of(scene_with(model={"pocket_bar_stiffness_N_m": "rigid"})) if each.key == STIFFNESS
    ]
    data = read_toml(SCENE)
    estimated = {"defaults": "none", "estimated": ["cage.bar_width_mm", STIFFNESS]}
    case = case_of(
        "scene.toml", {**data, "cage": {**data["cage"], **SECTION}, "uncertain": estimated}, ("impact_force_N",)
    )
    (drawn,) = case.scenes(case.every, [{"cage.bar_width_mm": 0.8, STIFFNESS: 1.2}], 0)
    narrow = scene.changed({"cage.bar_width_mm": 0.8 * 4.2}).model.pocket_bar_stiffness_N_m
    assert drawn.cage.bar_width_mm == pytest.approx(0.8 * 4.2)
    assert drawn.model.pocket_bar_stiffness_N_m == pytest.approx(1.2 * narrow, rel=1e-12)


@pytest.mark.parametrize("name", ["NU204", "NU210 M", "NU 2220", "NU1020", "NU315 TVP2", "NU210 J"])
def test_unit_new_scenes_have_a_section(name):
    """Unit: a catalogue scene has a section, bars as stiff as is stated of its material, and room for each unknown width."""
    scene = Scene.from_dict(data := tomllib.loads(CliRunner().invoke(app, ["new", *name.split()]).stdout))
    metal = scene.material("cage").elastic_modulus > 2e10
    low, high = (1e7, 3e8) if metal else (5e5, 1e7)
    stiffness = scene.model.pocket_bar_stiffness_N_m
    assert isinstance(stiffness, float) and low < stiffness < high and len(scene.section_notes) == 1
    case = case_of(name, data, ("impact_force_N",))
    keys = [each for each in case.every if each.key.startswith(("cage.bar_", "cage.side_", STIFFNESS))]
    assert len(keys) == 4
    for end in ("low", "high"):
        (edge,) = case.scenes(keys, [{each.key: getattr(each.law, end) for each in keys}], 0)
        assert isinstance(edge, Scene), edge
