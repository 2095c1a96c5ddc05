"""Keys that two places decide: laws, ``set``, factors, samples and --set never overrule each other in silence."""

import re
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from doe.unknown.inputs import values_of
from doe.workflow.input_sets import Case, case_of, check_overrides, read_case
from doe.workflow.problem import Problem
from doe.workflow.robust import case_of_study
from rbdyn.base.faults import InputError, read_toml, validated
from rbdyn.scene import Scene
from rbdyn.scene.uncertain import Law, Uncertain
from rbdyn.scene.unknown import value_keys, value_of

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE = EXAMPLES / "cylindrical_roller.toml"
MASS = {"cage.mass_g": {"law": "uniform", "low": 40.0, "high": 50.0}}
IMBALANCE = {"cage.imbalance_um": {"law": "uniform", "low": 1.0, "high": 50.0}}
STIFFNESS = "model.pocket_bar_stiffness_N_m"


def _case_with(uncertain: dict[str, Any], changes: dict[str, Any] | None = None) -> Case:
    data = read_toml(SCENE)
    for table, keys in (changes or {}).items():
        data[table] = {**data.get(table, {}), **keys}
    return case_of("scene.toml", {**data, "uncertain": uncertain}, ("impact_force_N",))


def _relative(key: str, times: str) -> dict[str, Any]:
    return {key: {"law": "uniform", "low": 0.9, "high": 1.1, "times": times}}


@pytest.mark.parametrize(
    ("uncertain", "sentence"),
    [
        ({**MASS, "set": ["cage.mass_g=45.0"]}, "set = 'cage.mass_g=45.0': is an unknown input, which has a law here"),
        ({**MASS, "set": ["cage={mass_g=45.0}"]}, "is an unknown input"),
        ({**MASS, "set": ['"cage".mass_g=45.0']}, "is an unknown input"),
        ({"estimated": ["cage.mass_g"], "set": ["cage.mass_g=45.0"]}, "is an unknown input, named in estimated"),
        ({"set": ["cage.lands=1", "cage.lands=2"]}, "replaces an earlier assignment of this list"),
        ({"set": ["cage.lands=1", "cage={lands=2}"]}, "replaces an earlier assignment of this list"),
        ({"set": ["uncertain.points=16"]}, "no run depends on it"),
        ({"set": ["calibrate.waves=2"]}, "no run depends on it"),
        ({"set": ["numerics.seed=3"]}, "every run has a seed of its own"),
        ({"set": ["cage.mass_g"]}, "write it as key.path=value"),
        ({"numerics.seed": {"law": "choices", "values": [1, 2]}}, "numerics holds no property of the bearing"),
        ({"numerics.replicates": {"law": "choices", "values": [2, 3]}}, "numerics holds no property of the bearing"),
        ({"uncertain.points": {"law": "choices", "values": [16, 32]}}, "uncertain holds no property of the bearing"),
        ({"calibrate.waves": {"law": "choices", "values": [1, 2]}}, "calibrate holds no property of the bearing"),
        ({"cage": {"mass_g": MASS["cage.mass_g"]}}, 'write the key in quotes, "cage.mass_g" = {law = ...}'),
        (
            {
                "materials.cage": {"law": "choices", "values": ["brass", "peek"]},
                "materials.cage.density_kg_m3": {"law": "uniform", "low": 8000.0, "high": 9000.0},
            },
            "materials.cage has a law too, which replaces it",
        ),
    ],
)
def test_unit_a_key_of_uncertain_has_one_say(uncertain: dict[str, Any], sentence: str) -> None:
    """Unit: whatever [uncertain] says twice, or of a run instead of the bearing, is refused in one sentence."""
    with pytest.raises(InputError) as refused:
        validated(Uncertain, uncertain, "scene.toml")
    (fault,) = refused.value.faults
    assert sentence in fault


@pytest.mark.parametrize(
    ("uncertain", "sentence"),
    [
        ({"cag.mass_g": MASS["cage.mass_g"]}, "cag.mass_g: unknown key; did you mean cage.mass_g?"),
        ({"operation.schedule": MASS["cage.mass_g"]}, "operation.schedule: holds more than one value"),
        ({"bearing.outer_waviness": MASS["cage.mass_g"]}, "bearing.outer_waviness: holds more than one value"),
        ({"set": ["cage.mass_g.x=3"]}, "scene.toml: uncertain.set cage.mass_g.x=3: mass_g is a value, not a table"),
        ({"set": ["cage.mass_g=-3"]}, "scene.toml: uncertain.set: cage.mass_g = -3: must be at least 0.01"),
        (_relative("cage.mass_g", "cage.imbalance_um"), "the scene has 0 there"),
        (_relative("cage.mass_g", "model.pocket_film"), "the scene has no number there"),
        (_relative("cage.mass_g", "bearing.outer_waviness"), "the scene has no number there"),
        (_relative("cage.mass_g", "lubricant.inlet_distance"), "the scene has no number there"),
        (_relative("cage.mass_g", "cage.mass_g.real"), "the scene has no number there"),
        (
            {**_relative("cage.mass_g", STIFFNESS), STIFFNESS: {"law": "choices", "values": ["rigid", 5e7]}},
            "the values of that key are not numbers",
        ),
        (
            {
                **_relative("cage.mass_g", "cage.inertia_kg_mm2"),
                **_relative("cage.inertia_kg_mm2", "cage.land_width_mm"),
                **_relative("cage.land_width_mm", "cage.mass_g"),
            },
            'leads back to "cage.mass_g"',
        ),
        (
            _relative("traction.mu_m", "traction.mu_inf"),
            'leads back to "traction.mu_m"',
        ),  # which is documented the other way
        (
            {"cage.guidance": {"law": "choices", "values": ["outer", "top", "inner"]}},
            "uncertain.\"cage.guidance\" at top: cage.guidance = 'top'",
        ),
        (
            {
                f"model.pocket_{key}": {"law": "uniform", "low": 0.4, "high": 0.8}
                for key in ("restitution", "damping_alpha_s_m")
            },
            "inputs are impossible together: model.pocket_restitution and model.pocket_damping_alpha_s_m contradict",
        ),
    ],
)
def test_unit_inputs_that_no_scene_can_have(uncertain: dict[str, Any], sentence: str) -> None:
    """Unit: keys that take no law, times of no number, choices in the middle and laws that exclude each other: one sentence."""
    with pytest.raises(InputError) as refused:
        _case_with(uncertain)
    (fault,) = refused.value.faults
    assert fault.startswith("scene.toml: ") and sentence in fault


def test_unit_set_makes_a_documented_input_known() -> None:
    """Unit: a key that ``set`` gives is in every scene, in no list of inputs, and a note says so; its circumstances count."""
    case = _case_with({"set": ["cage.imbalance_um=7.0", "traction.model=eyring"]})
    keys = [each.key for each in case.every]
    assert "cage.imbalance_um" not in keys and "traction.mu_m" not in keys and "traction.eyring_stress_MPa" in keys
    (note,) = case.notes
    assert note.startswith(
        f"{len(keys)} of {len(keys) + 4} inputs vary, the others count as exact (known by uncertain.set: cage.imb"
    )
    assert "uncertain.defaults: bearing.effective_length_mm, cage.mass_g, lubricant.temperature_C)" in note
    (scene,) = case.scenes(case.every[:1], [{case.every[0].key: 1.0}], 0)
    assert isinstance(scene, Scene) and scene.cage.imbalance_um == 7.0 and scene.traction.model == "eyring"


def test_unit_estimated_keys_vary_whatever_the_defaults() -> None:
    """Unit: a named estimate varies under defaults = "none", and where its law switches another on; else a note."""
    assert [each.key for each in _case_with({"defaults": "none", "estimated": ["cage.mass_g"]}).every] == [
        "cage.mass_g"
    ]
    case = _case_with({"defaults": "none", "estimated": ["traction.model", "lubricant.roller_roughness_um"]})
    assert [each.key for each in case.every] == ["traction.model"]
    assert case.notes[0].startswith("1 of 27 inputs vary") and case.notes[1:] == (
        "estimated, but without effect in this scene, so they do not vary: lubricant.roller_roughness_um",
    )


def test_unit_numbers_multiply_what_the_scene_has_by_then() -> None:
    """Unit: times by way of a relative key, of a factor's value, of a key that follows from a relative one."""
    uncertain = {
        **_relative("cage.mass_g", "cage.mass_g"),
        **_relative("cage.imbalance_um", "cage.mass_g"),
        **_relative("cage.land_width_mm", "cage.pocket_clearance_mm"),
        **_relative("lubricant.temperature_C", "lubricant.temperature_C"),
        **_relative("lubricant.viscosity_mPas", "lubricant.viscosity_mPas"),
    }
    case = _case_with({"defaults": "none", **uncertain})
    row = dict.fromkeys(uncertain, 0.9)
    (scene,) = case.scenes(case.every, [row], 0, ["cage.pocket_clearance_mm=0.2"])
    assert isinstance(scene, Scene)
    assert scene.cage.mass_g == pytest.approx(0.9 * 45.0) and scene.cage.imbalance_um == pytest.approx(0.81 * 45.0)
    assert scene.cage.land_width_mm == pytest.approx(0.9 * 0.2)
    cool = Scene.load(SCENE, ["lubricant.temperature_C=90.0"])
    assert scene.lubricant.viscosity_mPas == pytest.approx(0.9e3 * cool.lubricant.in_service.viscosity)


def test_unit_what_multiplies_nothing_in_the_scene_stays_left_out() -> None:
    """Unit: lips that a scene leaves out go with the pocket clearance, of which they are a multiple."""
    changes = {"cage": {"guidance": "roller"}, "model": {"guide_land": "off"}}
    law = {"law": "uniform", "low": 0.2, "high": 0.4}
    case = _case_with({"cage.pocket_clearance_mm": law}, changes)
    pocket = [each for each in case.every if each.key == "cage.pocket_clearance_mm"]
    (scene,) = case.scenes(pocket, [{"cage.pocket_clearance_mm": 0.25}], 0)
    assert isinstance(scene, Scene) and value_of(scene, "cage.pocket_radial_clearance_mm") == pytest.approx(0.25)


def test_unit_what_multiplies_nothing_in_some_scenes_says_so() -> None:
    """Unit: where a choice leaves a scene without lips, their multiple is a sentence for those sets, and no exception."""
    lips = _relative("cage.pocket_radial_clearance_mm", "cage.pocket_radial_clearance_mm")
    guidance = {"cage.guidance": {"law": "choices", "values": ["roller", "outer"], "weights": [9.0, 1.0]}}
    uncertain = {"defaults": "none", **lips, **guidance}
    case = _case_with(uncertain, {"cage": {"guidance": "roller"}, "model": {"guide_land": "off"}})
    rows = [{"cage.guidance": which, "cage.pocket_radial_clearance_mm": 1.05} for which in ("roller", "outer")]
    scene, fault = case.scenes(case.every, rows, 0)
    assert isinstance(scene, Scene) and scene.cage.pocket_radial_clearance_mm == pytest.approx(1.05 * 0.3)
    assert isinstance(fault, str) and "the scene has no number there" in fault


@pytest.mark.parametrize(
    ("laws", "sentence"),
    [
        ({"law": "normal", "mean": 45.0, "sd": 1e308}, "sd = 1e+308: must be at most"),
        ({"law": "uniform", "low": -1e308, "high": 1e308}, "low = -1e+308: must be at least"),
        ({"law": "log_uniform", "low": 1e-300, "high": 1.0}, "needs a positive one"),
        ({"law": "uniform", "low": 45.0, "high": 45.00000000000001}, "too near to it"),
        ({"law": "normal", "mean": 45.0, "sd": 3.0, "low": 80.0}, "low = 80: is more than 6 sd beyond mean = 45"),
        ({"law": "normal", "mean": 45.0, "sd": 1e-12}, "is lost in rounding"),
        ({"law": "normal", "mean": 0.0, "sd": 1e12, "low": 0.0, "high": 1e-6}, "write law = 'uniform'"),
        ({"law": "choices", "values": ["off", "cylinder"], "weights": [1e308, 1e308]}, "weights[1] = 1e+308: must be"),
        ({"law": "choices", "values": ["off", "cylinder", "off"]}, "name each value once"),
    ],
)
def test_unit_numbers_of_laws_are_bounded(laws: dict[str, Any], sentence: str) -> None:
    """Unit: no law has numbers that overflow, vanish beside each other, or leave nothing of it."""
    with pytest.raises(InputError) as refused:
        validated(Uncertain, {"cage.mass_g": laws}, "scene.toml")
    assert sentence in refused.value.faults[0]


@pytest.mark.parametrize(
    "law",
    [
        Law(law="normal", mean=-1e12, sd=1e12),
        Law(law="normal", mean=0.0, sd=1.0, low=6.0),
        Law(law="normal", mean=0.0, sd=1.0, low=5.0, high=5.000002),
        Law(law="log_uniform", low=1e-12, high=1e12),
        Law(law="uniform", low=1.0, high=1.000000002),
    ],
)
def test_unit_values_of_extreme_laws_lie_inside(law: Law) -> None:
    """Unit: at the bounds values rise, stay within the ends, and nothing warns."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        values = np.array(values_of(law, np.linspace(0.0, 1.0, 101)))
    assert np.isfinite(values).all() and (np.diff(values) >= 0.0).all() and np.unique(values).size > 50
    assert values[0] >= (-np.inf if law.low is None else law.low)
    assert values[-1] <= (np.inf if law.high is None else law.high)


def _study(folder: Path, change: tuple[str, str] = ("", ""), more: str = "") -> Problem:
    text = (EXAMPLES / "clearance_study.toml").read_text("utf-8")
    assert change[0] in text
    for each in (SCENE, EXAMPLES / "ccd_table4.csv"):
        (folder / each.name).write_bytes(each.read_bytes())
    (folder / "study.toml").write_text(text.replace(*change, 1) + more, "utf-8")
    return Problem.load(folder / "study.toml")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (('set = ["', 'set = ["cage.guide_clearance_mm=0.2", "'), "set = 'cage.guide_clearance_mm=0.2': is a factor"),
        (('set = ["', 'set = ["numerics.seed=3", "'), "scene.set = 'numerics.seed=3': every run has a seed of its own"),
        (('set = ["', 'set = ["uncertain.points=16", "'), "scene.set = 'uncertain.points=16': no run depends on it"),
        (('set = ["', 'set = ["numerics.turns=30", "'), "replaces an earlier assignment of this list"),
        (("replicates = 16", 'replicates = 16\nset = ["numerics.replicates=4"]'), "confirmation.replicates says it"),
        (("replicates = 16", 'replicates = 16\nset = ["cage.pocket_clearance_mm=0.2"]'), "confirmation.set = 'cage.p"),
        (('"cage.guide_clearance_mm"', '"uncertain.points"'), "factor.key = 'uncertain.points': no run depends on it"),
        (('"cage.guide_clearance_mm"', '"numerics.replicates"'), "each kind of run has its own number of them"),
        (('"cage.guide_clearance_mm"', '"cage"'), "factor.key = 'cage': replaces the table of another factor's key"),
        (("tolerance = 0.003 ", "allowed = [-1e300, 1e300] "), "factor[1].allowed[1] = -1e+300: must be at least"),
        (("guide_clearance_mm = 0.15\n", "guide_clearance_mm = 1e300\n"), "guide_clearance_mm = 1e+300: must be"),
        (('goal = "min"', 'goal = "min"\nweight = 1e308'), "weight = 1e+308: must be at most"),
        (('goal = "min"', 'goal = "min"\nupper = 1e308'), "upper = 1e+308: must be at most"),
    ],
)
def test_unit_a_factor_or_a_seed_is_no_key_of_set(tmp_path: Path, change: tuple[str, str], sentence: str) -> None:
    """Unit: what a study assigns and no run would have is refused in one sentence, as are numbers that overflow."""
    with pytest.raises(InputError, match=r"^.*study\.toml: ") as refused:
        _study(tmp_path, change)
    assert re.sub(r"\s+", " ", sentence) in refused.value.faults[0]


@pytest.mark.parametrize(
    ("uncertain", "sentence"),
    [
        ('set = ["cage.pocket_clearance_mm=0.25"]', "is a factor of the study, whose value each run has"),
        ('"cage.pocket_clearance_mm" = {law = "uniform", low = 0.2, high = 0.4}', "is a factor of the study too"),
        ('sample = "sample.csv"', "is a factor of the study too"),
    ],
)
def test_unit_a_factor_is_no_unknown_input(tmp_path: Path, uncertain: str, sentence: str) -> None:
    """Unit: laws, columns of a sample and ``set`` of a study leave its factors alone."""
    (tmp_path / "sample.csv").write_text("cage.pocket_clearance_mm\n0.2\n0.3\n", "utf-8")
    study = _study(tmp_path, ("[design]", "[design]"), f"\n[uncertain]\n{uncertain}\n")
    with pytest.raises(InputError) as refused:
        case_of_study(study)
    (fault,) = refused.value.faults
    assert fault.startswith(f"{study.path}: ") and sentence in fault


@pytest.mark.parametrize(
    ("header", "uncertain", "sentence"),
    [
        ("cage.mass_g", 'set = ["cage.mass_g=45.0"]', "'cage.mass_g=45.0': is a column of the sample"),
        ("numerics.seed", "", "numerics.seed: numerics holds no property of the bearing"),
        ("cage.masss_g", "", "cage.masss_g: unknown key; did you mean cage.mass_g?"),
    ],
)
def test_unit_columns_of_a_sample_are_unknown_inputs(
    tmp_path: Path, header: str, uncertain: str, sentence: str
) -> None:
    """Unit: a column of a sample is a key that nothing else gives."""
    (tmp_path / "sample.csv").write_text(f"{header}\n44\n46\n", "utf-8")
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.read_text("utf-8") + f'[uncertain]\nsample = "sample.csv"\n{uncertain}\n', "utf-8")
    with pytest.raises(InputError) as refused:
        read_case(scene, ("impact_force_N",), ())
    (fault,) = refused.value.faults
    assert fault.startswith((f"{scene}: uncertain", f"{tmp_path / 'sample.csv'}: column")) and sentence in fault


def test_unit_set_on_the_command_line_of_an_unknown_input() -> None:
    """Unit: a value that no input set would have is refused; one that a law multiplies, or that makes a key known, counts."""
    with pytest.raises(InputError, match=r"--set cage\.mass_g=46: the uniform law of this unknown input replaces it"):
        check_overrides(["cage.mass_g=46"], _case_with(MASS).every)
    check_overrides(["cage.mass_g=46"], _case_with(_relative("cage.mass_g", "cage.mass_g")).every)
    check_overrides(["lubricant.temperature_C=80"], _case_with({"estimated": ["lubricant.temperature_C"]}).every)
    with pytest.raises(InputError, match=r"is a column of rig\.csv, whose value each run has"):
        check_overrides(["operation.inner_speed_rpm=1"], [], {"operation.inner_speed_rpm": "a column of rig.csv"})
    case = read_case(SCENE, ("impact_force_N",), ["cage.imbalance_um=7.0"])
    assert "cage.imbalance_um" not in {each.key for each in case.every}


@pytest.mark.parametrize(
    "declared",
    [
        lambda n: {f"cage.mass_{i}": {"law": "uniform", "low": 1.0, "high": 2.0} for i in range(n)},
        lambda n: {f"cage.mass_{i}": {"law": "uniform", "low": 1.0} for i in range(n)},
        lambda n: {"set": [f"cage.mass_{i}=1" for i in range(n)]},
        lambda n: {"set": ["cage.lands=1"] * n},
        lambda n: {"estimated": [f"cage.mass_{i}" for i in range(n)]},
        lambda n: {f"cage.mass_{i}": {"law": "uniform", "low": 1.0, "high": 2.0, "times": f"cage.mass_{i + 1}"} for i in range(n)},
    ],
    ids=["unknown keys", "bad laws", "set", "set twice", "estimated", "a chain of times"],
)  # fmt: skip
def test_unit_many_keys_are_refused_at_once(declared: Any) -> None:
    """Unit: 4000 entries are refused within a second, of which the square of their number took minutes."""
    start = time.process_time()
    with pytest.raises(InputError):
        _case_with(declared(4000))
    assert time.process_time() - start < 3.0


def test_unit_every_number_of_the_example_may_be_unknown_at_once() -> None:
    """Unit: a law for each number that the example gives or assumes makes one case, within seconds."""
    scene, data = Scene.load(SCENE), read_toml(SCENE)
    laws = {}
    for key in value_keys():
        value = value_of(scene, key)
        if isinstance(value, float) and value > 0.0 and not key.startswith(("bearing.", "traction.constants")):
            laws[key] = {"law": "uniform", "low": 0.998, "high": 0.999, "times": key}
    laws = {key: law for key, law in laws.items() if key not in ("model.pocket_restitution", "model.land_restitution")}
    start = time.process_time()
    case = case_of("scene.toml", {**data, "uncertain": {"defaults": "none", **laws}}, ("impact_force_N",))
    assert len(case.every) == len(laws) > 30
    assert time.process_time() - start < 5.0
