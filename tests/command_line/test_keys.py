"""``rbdyn keys`` and ``doe keys``: every key described, and a schema that accepts what the commands accept."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from typer.testing import CliRunner

import rbdyn
from doe.cli import app as doe_app
from doe.commands.functions import files as study_kinds
from doe.dimension_chain.reading import Chains
from doe.study_file import StudyFile
from doe.workflow import rig
from doe.workflow.rig import RigTable
from rbdyn.base.words import label, quantity
from rbdyn.cli.app import app as rbdyn_app
from rbdyn.plots.ball import label as axis_label
from rbdyn.scene import Scene
from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene
from rbdyn.scene.keys import _models, descriptions, keys, schema

EXAMPLES = next(parent for parent in Path(__file__).parents if (parent / "pyproject.toml").exists()) / "examples"
SCENES = {"roller bearing": Scene, "ball bearing": SingleRowScene, "double-decker": DoubleDeckerScene}


def printed(app, *arguments, code=0):
    """Standard output of ``keys``."""
    shown = CliRunner().invoke(app, ["keys", *arguments])
    assert shown.exit_code == code, shown.output
    return shown.stdout


def is_scene(path):
    """Whether a TOML file is a scene, a study or chains."""
    return "kind" in tomllib.loads(path.read_text(encoding="utf-8")).get("bearing", {})


@pytest.mark.parametrize("model", _models([*SCENES.values(), StudyFile, Chains]), ids=lambda model: model.__name__)
def test_every_key_says_what_it_means(model):
    """Command line: each key says in a short first sentence what it is; then its default, then its effect."""
    for name, text in descriptions(model).items():
        assert text.endswith((".", ".)")) and len(text.split()) > 1 and text.rstrip(".") != name, name
        first = re.split(r"(?<=[.?])\s", text)[0]
        assert len(re.findall(r"\S*[A-Za-z]\S*", first)) <= 20 and not first.startswith(("The ", "Its ", "Makes ")), (
            f"{name}: {first}"
        )
        stated = re.findall(r"\b(Default|Effect)\b[^:.]*:", text)
        assert stated in ([], ["Default"], ["Effect"], ["Default", "Effect"]), f"{name}: {text}"


# Lists of measured and of quoted figures are inputs of scripts alone.
INPUTS = sorted(path for path in EXAMPLES.rglob("*.toml") if path.name not in ("measured.toml", "manual_figures.toml"))


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: path.name)
def test_schema_accepts_every_example_and_refuses_a_slip(path):
    """Command line: an editor that knows the schema marks no example, and marks a key that is none."""
    app = rbdyn_app if is_scene(path) else doe_app
    found = json.loads(printed(app, "--schema"))
    Draft202012Validator.check_schema(found)
    validator = Draft202012Validator(found)
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    assert list(validator.iter_errors(data)) == []
    assert list(validator.iter_errors({**data, "bearings": {}}))


def test_schema_tells_ranges_defaults_and_descriptions():
    """Command line: numbers of the schema are those of the validation."""
    pocket = json.loads(printed(rbdyn_app, "--schema"))["$defs"]["Cage"]["properties"]["pocket_clearance_mm"]
    assert pocket == {
        "exclusiveMinimum": 0.0,
        "maximum": 10.0,
        "type": "number",
        "description": "Pocket width less roller diameter.",
    }


def test_keys_are_those_of_a_scene_that_gives_all():
    """Command line: the keys listed of a roller bearing are exactly those of its model, at any depth."""

    def names(data, prefix=""):
        for key, value in data.items():
            yield f"{prefix}{key}"
            tables = value if isinstance(value, list) else [value]
            for each in tables:
                if isinstance(each, dict):
                    yield from names(each, f"{prefix}{key}{'[]' if isinstance(value, list) else ''}.")

    listed = {key.key for key in keys({"roller bearing": Scene})}
    scene = Scene.load(EXAMPLES / "all_options.toml").model_dump(mode="json")
    assert set(names(scene)) <= listed
    tables = {name for name, value in scene.items() if isinstance(value, dict)}
    for table in tables:
        of_table = {name.split(".")[1].removesuffix("[]") for name in listed if name.startswith(f"{table}.")}
        # A scene saves what tells its oil, how that comes in, and whether it has a stiffness, only where it is given.
        oil = {"base_oil", "viscosity_index", "viscosities_C_mm2_s", "density_kg_m3", "supply", "film_temperature",
               "oil_flow_l_min", "oil_inlet_temperature_C", "oil_fraction_factor"}  # fmt: skip
        outside_json = {"lubricant": oil, "mounting": {"width_mm"}, "numerics": {"stiffness"}}.get(table, set())
        assert of_table - outside_json == set(scene[table]) - outside_json


def test_a_word_is_looked_up_in_names_and_descriptions():
    """Command line: one word narrows the list; the unit, the range and the default stand with the name."""
    shown = printed(rbdyn_app, "clearance")
    assert (
        "cage.pocket_clearance_mm: number above 0 to 10, mm, required\n    Pocket width less roller diameter." in shown
    )
    assert "cage.mass_g" not in shown and "model.land_film_floor_um" not in shown
    assert printed(rbdyn_app, "CAGE.MASS_G").splitlines()[2] == "cage.mass_g: number from 0.01 to 1e+06, g, required"
    assert "numerics.rtol: number from 1e-13 to 0.1, default 0.01" in printed(rbdyn_app, "rtol")
    assert "factor[].name: string, required" in printed(doe_app, "factor")
    assert "link[].capability: number above 0, default 1" in printed(doe_app, "capability")


def test_keys_as_json_and_a_word_that_no_key_has():
    """Command line: one JSON object; a word that stands nowhere is bad input."""
    found = json.loads(printed(rbdyn_app, "speed_rpm", "--json"))["keys"]
    speed = next(key for key in found if key["key"] == "operation.inner_speed_rpm")
    assert (speed["unit"], speed["required"], speed["default"]) == ("rpm", True, None)
    assert json.loads(printed(rbdyn_app, "wheel", "--json", code=2))["status"] == "refused"
    assert printed(doe_app, "wheel", code=2) == ""


# Each key that has a unit, by the last part of its name; every other has none.
UNITS = {
    "mm": """axial_offset ball_diameter bar_length bar_thickness bar_width bore crown_radius effective_length guide_clearance half_width housing_diameter
        inner_shoulder_height interference_change land_diameter land_width lower mean narrowest nominal outer_shoulder_height outside_diameter outside pitch_diameter
        pocket_clearance pocket_contact_length pocket_radial_clearance raceway radial_clearance resolution roller_diameter roller_length
        shaft_bore side_ring_width upper width x y z""",
    "um": """amplitude ball_diameter_errors ball_diameter_spread clearance_change height imbalance inner_interference
        land_film_floor least_clearance outer_interference pocket_film_floor preload race_damping_engagement race_roughness
        roller_diameter_errors roller_diameter_spread roller_roughness""",
    "N": "axial_load dynamic_capacity load lundberg_load preload radial_load rotating_load static_capacity",
    "C": "ambient cage_ceiling from from_parts oil_ceiling oil_inlet_temperature housing_temperature inner_ring_temperature outer_ring_temperature reference_temperature roller_temperature cage_temperature shaft_temperature temperature temperatures",
    "K": "cage_offset lower temperature_rise upper",
    "deg": "contact_angle gravity_direction phase tilt_direction",
    "mrad": "tilt tilt_x tilt_y",
    "rpm": "inner_speed outer_speed speed",
    "m_s": "blend_speed impact_speed land_restitution_speed pocket_restitution_speed u_m",
    "s_m": "land_damping_alpha pocket_damping_alpha race_damping_alpha",
    "GPa": "bore_modulus elastic_modulus shaft_modulus",
    "l_min": "oil_flow", "hz": "whirl_cutoff whirl_notches",
    "N_m": "pocket_bar_stiffness stiffness",
    "kg": "inner_ring_mass outer_ring_mass",
    "turns": "discard impact_window",
    "per_turn": "samples step_budget",
    "s": "time", "Nm": "moment", "N_s_m": "damping", "m_s2": "gravity", "g": "mass", "g_mm": "unbalance", "kg_mm2": "inertia",
    "kg_m3": "density", "MPa": "eyring_stress", "1_GPa": "pressure_coefficient", "mPas": "viscosity", "C_mm2_s": "viscosities",
    "mm_um": "profile_table", "per_K": "expansion", "1e_6_K": "thermal_expansion", "percent": "smallest_difference",
    "W_mK": "conductivity", "J_kgK": "heat_capacity",
}  # fmt: skip
SHOWN = {
    "percent": "%", "l_min": "L/min",
    "um": "µm", "C": "°C", "m_s": "m/s", "s_m": "s/m", "hz": "Hz", "N_m": "N/m", "turns": "shaft turns", "per_turn": "per shaft turn",
    "Nm": "N m", "N_s_m": "N s/m", "m_s2": "m/s²", "g_mm": "g mm", "kg_mm2": "kg mm²", "kg_m3": "kg/m³", "1_GPa": "1/GPa", "mPas": "mPa s",
    "C_mm2_s": "°C, mm²/s", "mm_um": "mm, µm", "per_K": "1/K", "1e_6_K": "1e-6/K",
    "W_mK": "W/(m K)", "J_kgK": "J/(kg K)",
}  # fmt: skip


def test_every_key_has_the_unit_of_its_name():
    """Command line: units of all keys of scenes, studies and chains are those of an explicit table, and others have none."""
    units = {f"{name}_{end}": SHOWN.get(end, end) for end, names in UNITS.items() for name in names.split()}
    units["turns"] = "shaft turns"
    listed = {key.key.rpartition(".")[2]: key.unit for key in [*keys(SCENES), *keys(study_kinds())]}
    assert {name: unit for name, unit in listed.items() if unit} == units
    assert not listed["mu_m"] and not listed["oil_fraction"]


def test_labels_and_keys_agree_on_units():
    """Command line: what a report, a notebook or a picture writes of a key has the unit that its description has."""
    for key in (*keys(SCENES), *keys(study_kinds())):
        if "turn" not in key.unit:
            words, unit = quantity(key.key)
            assert unit == key.unit and (not unit or label(key.key) == f"{words} [{unit}]")
            assert axis_label(key.key).endswith(f"[{unit}]" if unit else words.rpartition(".")[2])


def test_a_key_that_kinds_share_is_listed_once():
    """Command line: what means the same for rollers and balls stands once, what differs stands with each."""
    found = [key.key for key in keys(SCENES)]
    assert found.count("lubricant.temperature_C") == 1
    assert found.count("operation.radial_load_N") == 2
    assert all(
        "description" in table for each in schema(SCENES)["$defs"].values() for table in each["properties"].values()
    )


@pytest.mark.parametrize("app", [rbdyn_app, doe_app], ids=["rbdyn", "doe"])
def test_version_and_completion(app):
    """Command line: the version alone, and what completes commands in a shell."""
    shown = CliRunner().invoke(app, ["--version"])
    assert (shown.exit_code, shown.stdout) == (0, f"rbdyn {rbdyn.__version__}\n")
    assert "--install-completion" in CliRunner().invoke(app, ["--help"]).stdout


def test_help_shows_no_type_of_a_flag():
    """Command line: a flag takes no value, and help speaks of none."""
    shown = CliRunner().invoke(doe_app, ["fit", "--help"]).stdout
    lines = [line for line in shown.splitlines() if "--json" in line or "--retry" in line]
    assert len(lines) == 2 and not any("bool" in line.lower() for line in lines)


def test_lists_of_lists_are_told_in_plain_words():
    """Command line: values of nested lists, of integers and of plain ones."""
    values = {key.key: key.values for key in keys(SCENES)}
    assert values["bearing.profile_table_mm_um"] == "list of lists of numbers"
    assert values["errors.ball_sphericity[].balls"] == "list of integers from 1"


def test_keys_of_calibration():
    """Command line: ``doe keys`` finds the settings of a calibration and every column that the rig's table may have."""
    assert "\ncalibrate.waves: integer from 1 to 8, default 4\n" in printed(doe_app, "calibrate")
    outputs = {name + end for name in rig.OUTPUTS for end in ("", rig.SD, rig.ACCURACY)}
    assert set(RigTable.model_fields) == {rig.TURNS, rig.HOLD} | outputs
    assert "calibrate" not in json.loads(printed(doe_app, "--schema"))["$defs"]["StudyFile"]["properties"]


def test_keys_of_a_table_begin_with_what_it_needs():
    """Command line: the table that a word names comes before the keys that only mention it."""
    lines = printed(rbdyn_app, "thermal").splitlines()
    assert lines[:3] == ["roller bearing", "==============", "thermal: table, optional"]
    assert "Needs [mounting] with bore" in " ".join(lines[3:8]) and lines[8].startswith("thermal.ambient_C: ")


@pytest.mark.parametrize("name", ["PEEK", "peek", " Peek", "Silicon nitride", "aisi-4340"])
def test_materials_in_any_case(name):
    """Unit: a scene takes the name of a material in any case, and has it as it is listed."""
    data = tomllib.loads((EXAMPLES / "cylindrical_roller.toml").read_text(encoding="utf-8"))
    scene = Scene.from_dict({**data, "materials": {"cage": name}})
    assert scene.materials.cage == name.strip().lower().replace(" ", "_").replace("-", "_")
