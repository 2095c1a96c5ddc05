"""Declaration of unknown inputs: every assumption has a range, every range gives scenes, bad declarations are one sentence."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats
from typer.testing import CliRunner

from doe.unknown.inputs import nested, quantiles_of, screening_design, table_of, values_of
from rbdyn.base.faults import InputError, read_toml, validated
from rbdyn.cli.app import app
from rbdyn.dynamics.parameters.state import light_contact
from rbdyn.properties.materials import MATERIALS
from rbdyn.scene import Scene
from rbdyn.scene.ball import SingleRowScene
from rbdyn.scene.bearing import Materials
from rbdyn.scene.keys import keys
from rbdyn.scene.uncertain import RUNS, Law, Uncertain, documented, exact
from rbdyn.scene.unknown import documented_of, inputs_of, plain_values, value_of, with_values

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE = EXAMPLES / "cylindrical_roller.toml"
# Tables whose numbers belong to the run, to the drawing of the surroundings, or to this very declaration.
APART = (
    "numerics.", "mounting.", "uncertain.", "calibrate.", "materials.", "support.", "errors.", "operation.schedule.",
)  # fmt: skip
# Of five inputs and seed 7: another stream would spoil every stored plan.
FIRST = [0.6504268515855074, 0.9173101615160704, 0.10045647248625755, 0.9323312602937222, 0.7118372824043036]


def _uncertain(**laws: Any) -> Uncertain:
    return validated(Uncertain, laws, "scene.toml")


def test_every_defaulted_number_of_the_physics_has_a_range_or_is_exact() -> None:
    ranged = {each.key for each in documented()} | set(exact())
    for kind in (Scene, SingleRowScene):
        numbers = [
            key.key
            for key in keys({"scene": kind})
            if "number" in key.values and isinstance(key.default, int | float) and not key.key.startswith(APART)
        ]
        assert len(numbers) > 3
        assert [key for key in numbers if key not in ranged and "clearance_change" not in key and "[]" not in key] == []


def test_every_range_is_of_a_key_that_exists_and_says_why() -> None:
    names = {key.key for key in keys({"roller": Scene, "ball": SingleRowScene})}
    for each in documented():
        assert each.key in names
        assert {*each.when, *each.unless, *each.at_least, *each.below} <= names
        assert len(each.reason) > 15


@pytest.mark.parametrize("name", ["cylindrical_roller.toml", "all_options.toml", "published/nu215.toml"])
def test_documented_ranges_give_scenes(name: str) -> None:
    data = read_toml(EXAMPLES / name)
    inputs = inputs_of(Scene.from_dict(data), data, Uncertain())
    laws = {each.key: each.law for each in inputs}
    assert len(inputs) > 15
    for values in table_of(laws, nested(len(laws), 64, 3)):
        Scene.from_dict(with_values(data, name, laws, values))


@pytest.mark.parametrize(
    ("oil", "model"),
    [("ISO VG 68", "limiting_shear"), ("ISO VG 320 PAO", "limiting_shear"), ("23699", "four_constant"), ("Jet Oil II", "thermal_newtonian")],
)  # fmt: skip
def test_unit_new_scenes_draw_the_traction_law(oil: str, model: str) -> None:
    """Unit: what ``rbdyn new`` writes draws the law its oil has by default and two others, each of which makes a scene."""
    written = CliRunner().invoke(app, ["new", "NU210", "--oil", oil])
    data = tomllib.loads(written.stdout)
    scene = Scene.from_dict(data)
    laws = {each.key: each.law for each in inputs_of(scene, data, scene.uncertain)}
    values = laws["traction.model"].values
    assert scene.traction.model == model and model in values and {"four_constant", "eyring"} < set(values)
    rows = {row["traction.model"]: row for row in table_of(laws, nested(len(laws), 32, 1))}
    assert rows.keys() == set(values)
    for drawn_model, row in rows.items():
        drawn = Scene.from_dict(with_values(data, "scene", laws, row))
        assert drawn.traction.model == drawn_model and drawn.traction.elasticity


PARTS = [(part, name) for part in Materials.model_fields for name in MATERIALS]
SOFT = {"elastic_modulus_GPa": 5.0, "poisson_ratio": 0.35, "density_kg_m3": 1300.0}
SWITCHED = (
    "model.pocket_film=true", "traction.friction=mixed", "traction.model=eyring", "traction.model=limiting_shear", "traction.model=coulomb",
    "traction.model=thermal_newtonian", "model.race_damping=hunt_crossley", "cage.guidance=roller", "bearing.tilt_mrad=0.1",
    "lubricant.supply=bath", "lubricant.supply=drop", "lubricant.supply=jet", "lubricant.oil=ISO VG 32", 'lubricant={oil="ISO VG 68", base_oil="PAG", temperature_C=70.0}',
)  # fmt: skip


def defaults_outside(scene: Scene) -> dict[str, Any]:
    """Values of a scene that lie outside the documented range that counts for it."""
    outside = {}
    for each in documented_of(scene):
        value, base = value_of(scene, each.key), 1.0 if each.times is None else value_of(scene, each.times)
        chosen = each.law == "choices" and (each.on_request or value in (each.values or ()))
        perfect = value == 0.0 and each.law == "log_uniform"  # a part without the error that the range is of
        if value is None or chosen or perfect:
            continue
        if isinstance(value, str) or not each.low <= value / base <= each.high:
            outside[each.key] = value
    return outside


@pytest.mark.parametrize(
    ("part", "material"), [*PARTS, ("cage", SOFT), ("cage", {**SOFT, "elastic_modulus_GPa": 45.0})]
)
def test_invariant_defaults_of_every_material_lie_in_their_documented_ranges(part: str, material: Any) -> None:
    """Invariant: whatever a part is made of, each default lies in the range that counts for it, and one range counts a key."""
    data = read_toml(SCENE)
    scene = Scene.from_dict({**data, "materials": {part: material}})
    assert defaults_outside(scene) == {}
    ranges = [each.key for each in documented_of(scene)]
    assert len(ranges) == len(set(ranges)) and "model.pocket_bar_stiffness_N_m" in ranges
    assert Scene(**{**data, "materials": Materials.model_validate({part: material})}).model == scene.model


@pytest.mark.parametrize("celsius", [-10.0, 0.0, 70.0])
def test_unit_an_estimated_oil_temperature_is_ten_kelvins_wide_at_any_temperature(celsius: float) -> None:
    """Unit: contacts differ from the supply by up to 10 K (reason of the range), in cold oil too, and at 0 C."""
    scene = Scene.load(SCENE, [f"lubricant.temperature_C={celsius}"])
    uncertain = _uncertain(defaults="none", estimated=["lubricant.temperature_C"])
    (entry,) = inputs_of(scene, read_toml(SCENE), uncertain)
    assert values_of(entry.law, np.array([0.0, 0.5, 1.0])) == pytest.approx(
        [celsius - 10.0, celsius, celsius + 10.0], abs=1e-9
    )


@pytest.mark.parametrize("switch", SWITCHED)
def test_invariant_defaults_of_every_law_lie_in_their_documented_ranges(switch: str) -> None:
    """Invariant: the same of what each law and oil switches on, in the plain example."""
    assert defaults_outside(Scene.load(SCENE, [switch])) == {}


@pytest.mark.parametrize(
    ("supply", "inlet", "oil", "factor"),
    [
        ("bath", (2.0, 10.0), (0.005, 0.1), (0.9, 1.2)), ("drop", (2.0, 10.0), (0.001, 0.02), (0.9, 1.2)),
        ("oil_air", (2.0, 10.0), (0.001, 0.02), (0.9, 1.2)), ("grease", (2.0, 10.0), (0.001, 0.02), (0.9, 1.2)),
        ("jet", (5.0, 100.0), (0.005, 0.1), (0.9, 1.2)), (None, None, (0.005, 0.1), (0.5, 1.3)),
    ],
)  # fmt: skip
def test_unit_ranges_follow_the_supply(supply: Any, inlet: Any, oil: Any, factor: Any) -> None:
    """Unit: the oil's inlet, its share and rolling resistance vary by supply; without one the inlet varies only if named."""
    data = read_toml(SCENE)
    data["lubricant"] |= {} if supply is None else {"supply": supply}
    data["lubricant"].pop("oil_fraction", None)
    laws = {each.key: each.law for each in inputs_of(Scene.from_dict(data), data, Uncertain())}
    keys = "lubricant.inlet_distance", "lubricant.oil_fraction", "model.rolling_resistance_factor"
    found = [(laws[key].low, laws[key].high) if key in laws else None for key in keys]
    assert found == [inlet, oil, factor]


def test_unit_a_bar_is_as_stiff_as_its_cage_unless_given() -> None:
    """Unit: metal cages keep 5e7 N/m, polymers have 2.5e6; what is given stays, and a changed material works it out anew."""
    scene = Scene.load(SCENE)
    peek = scene.changed({"materials.cage": "peek"})
    assert scene.model.pocket_bar_stiffness_N_m == 5e7 and peek.model.pocket_bar_stiffness_N_m == 2.5e6
    assert peek.changed({"materials.cage": "brass"}).model.pocket_bar_stiffness_N_m == 5e7
    assert peek.changed({"model.pocket_bar_stiffness_N_m": 5e7}).model.pocket_bar_stiffness_N_m == 5e7
    assert scene.changed({"materials.cage": SOFT}).model.pocket_bar_stiffness_N_m == 2.5e6
    with pytest.raises(InputError, match=r"materials\.cage = 'wood': choose one of"):
        scene.changed({"materials.cage": "wood"})


@pytest.mark.parametrize(
    "keys", [("operation.inner_speed_rpm=2000", "operation.radial_load_N=4000"), ("operation.inner_speed_rpm=300",)]
)
def test_unit_the_damping_of_light_contacts_is_unknown_in_slow_bearings(keys: tuple[str, ...]) -> None:
    """Unit: where rollers jump on the outer race, what damps them varies; where no law damps them, it does not."""
    slow = Scene.load(SCENE, list(keys))
    assert light_contact(slow) is not None
    damping = {"model.race_damping_ratio": (0.02, 0.2), "model.race_damping_engagement_um": (0.03, 0.3)}
    laws = {each.key: (each.law.low, each.law.high) for each in inputs_of(slow, read_toml(SCENE), Uncertain())
            if each.key.startswith("model.race_damping") and isinstance(each.law, Law)}  # fmt: skip
    assert laws == damping
    undamped = slow.changed({"model.race_damping": "off"})
    assert not [each for each in inputs_of(undamped, read_toml(SCENE), Uncertain()) if "race_damping" in each.key]


def test_what_is_given_is_known_unless_estimated() -> None:
    data = read_toml(SCENE)
    scene = Scene.from_dict(data)
    plain = {each.key for each in inputs_of(scene, data, Uncertain())}
    assert "cage.mass_g" not in plain and "cage.imbalance_um" in plain
    assert "traction.eyring_stress_MPa" not in plain  # the law is not switched on
    assert "cage.mass_g" in {each.key for each in inputs_of(scene, data, Uncertain(estimated=["cage.mass_g"]))}
    only = Uncertain.model_validate({"defaults": "none", "cage.mass_g": {"law": "uniform", "low": 40.0, "high": 50.0}})
    assert [each.key for each in inputs_of(scene, data, only)] == ["cage.mass_g"]


def test_set_replaces_single_keys_of_its_default() -> None:
    """What a list leaves alone stays as it is by default; the order is the default's rest, then the list."""
    asked = ["numerics.turns=60", "model.drag=off"]
    found = _uncertain(set=asked).assignments
    assert found == [*(each for each in RUNS if not each.startswith("numerics.turns=")), *asked]
    assert "numerics.extend=false" in found and "numerics.turns=20" not in found
    assert _uncertain(set=[]).assignments == _uncertain().assignments == list(RUNS)
    assert _uncertain(set=found).assignments[: len(RUNS) - 1] == found[: len(RUNS) - 1]
    assert _uncertain(set=['"numerics".turns = 60']).assignments == [*found[:-2], '"numerics".turns = 60']
    with pytest.raises(InputError, match="replaces an earlier assignment of this list"):
        _uncertain(set=["numerics.turns=60", "numerics.turns=70"])


def test_declarations_over_others_replace_them_key_by_key() -> None:
    """A key keeps what is stated under it unless the upper table states it, by a law, as an estimate or in set."""
    narrow, wide = ({"law": "uniform", "low": low, "high": 50.0} for low in (45.0, 40.0))
    under = {
        "estimated": ["cage.land_width_mm", "cage.imbalance_um"],
        "points": 64,
        "set": ["numerics.turns=60", "numerics.replicates=3", "model.drag_coefficient=0.5"],
        "cage.mass_g": wide,
        "cage.bar_width_mm": wide,
    }
    plain = Uncertain.model_validate(under)

    def over(**upper: Any) -> Uncertain:
        return Uncertain.model_validate(Uncertain.model_validate(upper).over(plain))

    assert over() == plain and over(seed=3) == plain.model_copy(update={"seed": 3})
    turns = over(set=["numerics.turns=20"])
    # A stated default is stated.
    assert {"numerics.turns=20", "numerics.replicates=3"} <= set(turns.assignments)
    assert (
        "numerics.turns=60" not in turns.assignments and turns.estimated == plain.estimated and turns.laws == plain.laws
    )
    assert over(**{"cage.mass_g": narrow}).laws["cage.mass_g"].low == 45.0
    fixed = over(set=["cage.mass_g=45", "cage.imbalance_um=2"])
    assert set(fixed.laws) == {"cage.bar_width_mm"} and fixed.estimated == ["cage.land_width_mm"]
    law = over(**{"model.drag_coefficient": {"law": "uniform", "low": 0.3, "high": 1.0}})
    assert "model.drag_coefficient=0.5" not in law.assignments and len(law.laws) == 3


def test_relative_values_multiply_what_the_scene_has() -> None:
    data = read_toml(SCENE)
    laws = {
        "traction.mu_m": Law(law="uniform", low=0.02, high=0.06),
        "traction.mu_inf": Law(law="uniform", low=0.5, high=0.9, times="traction.mu_m"),
        "cage.mass_g": Law(law="uniform", low=0.5, high=1.5, times="cage.mass_g"),
        "lubricant.temperature_C": Law(law="uniform", low=60.0, high=120.0),
        "lubricant.viscosity_mPas": Law(law="uniform", low=0.9, high=1.1, times="lubricant.viscosity_mPas"),
    }
    values = dict(zip(laws, (0.03, 0.7, 1.2, 80.0, 1.1), strict=True))
    tables = with_values(data, "scene.toml", laws, values)
    assert tables["traction"]["mu_inf"] == pytest.approx(0.021)
    assert tables["cage"]["mass_g"] == pytest.approx(54.0)
    warm = Scene.from_dict({**data, "lubricant": {**data["lubricant"], "temperature_C": 80.0}})
    assert tables["lubricant"]["viscosity_mPas"] == pytest.approx(1.1e3 * warm.lubricant.in_service.viscosity)
    assert data["cage"]["mass_g"] == 45.0


def test_unknown_inputs_are_no_part_of_a_run() -> None:
    data = read_toml(SCENE)
    told = {**data, "uncertain": {"cage.mass_g": {"law": "normal", "mean": 45.0, "sd": 3.0}}}
    assert Scene.from_dict(told).model_dump_json() == Scene.from_dict(data).model_dump_json()
    assert not any(key.startswith("uncertain") for key in plain_values(Scene.from_dict(told)))


@pytest.mark.parametrize(
    ("laws", "sentence"),
    [
        ({"cage.mass_g": {"law": "normal", "mean": 45.0, "sd": 3.0, "low": 50.0, "high": 40.0}}, "low = 50: not below"),
        ({"mass": {"law": "uniform", "low": 1.0, "high": 2.0}}, 'mass: no key of a scene; write "table.key"'),
        ({"cage.mass_g": {"law": "uniform", "low": 1.0}}, "cage.mass_g.high: missing; law = 'uniform' needs it"),
        ({"cage.mass_g": {"law": "uniform", "low": 1.0, "high": 2.0, "sd": 1.0}}, "sd: law = 'uniform' has none"),
        ({"cage.mass_g": {"law": "log_uniform", "low": 0.0, "high": 2.0}}, "needs a positive one"),
        ({"model.drag": {"law": "choices", "values": ["off", "cylinder"], "weights": [1.0]}}, "one number for each"),
        (
            {"model.drag": {"law": "choices", "values": ["off", "cylinder"], "times": "cage.mass_g"}},
            "are not numbers and cannot be multiplied",
        ),
        ({"points": 100}, "points = 100: no power of two; take 64"),
        ({"cage.mass_g": 3.0}, "cage.mass_g = 3.0: must be a table of keys"),
    ],
)
def test_bad_declarations(laws: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=r"^scene\.toml: ") as refused:
        _uncertain(**laws)
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("laws", "fixed", "sentence"),
    [
        ({"cage.mass_g": {"law": "uniform", "low": 1.0, "high": 2.0}}, {"cage.mass_g": "a factor"}, "is a factor too"),
        ({"cage.mass_g": {"law": "uniform", "low": 1.0, "high": 2.0, "times": "cage.guidance"}}, {}, "has no number there"),
        ({"estimated": ["cage.guidance"]}, {}, '"cage.guidance" has no documented range'),
    ],
)  # fmt: skip
def test_keys_that_cannot_vary(laws: dict[str, Any], fixed: dict[str, str], sentence: str) -> None:
    data = read_toml(SCENE)
    with pytest.raises(InputError) as refused:
        inputs_of(Scene.from_dict(data), data, _uncertain(**laws), fixed)
    assert sentence in str(refused.value)


def test_laws_are_their_distributions() -> None:
    """Quantiles in, values out and back; moments by scipy's own."""
    levels = np.linspace(0.01, 0.99, 99)
    for law, whole in (
        (Law(law="uniform", low=2.0, high=5.0), stats.uniform(2.0, 3.0)),
        (Law(law="log_uniform", low=0.1, high=10.0), stats.loguniform(0.1, 10.0)),
        (Law(law="normal", mean=3.0, sd=0.5), stats.norm(3.0, 0.5)),
    ):
        values = np.array(values_of(law, levels))
        assert values == pytest.approx(whole.ppf(levels))
        assert quantiles_of(law, values.tolist()) == pytest.approx(levels)
    cut = np.array(values_of(Law(law="normal", mean=3.0, sd=0.5, low=2.8, high=3.1), np.array([0.0, 0.5, 1.0])))
    assert cut[0] == pytest.approx(2.8) and cut[2] == pytest.approx(3.1) and 2.8 < cut[1] < 3.1
    choice = Law(law="choices", values=["a", "b", "c"], weights=[2.0, 1.0, 1.0])
    assert values_of(choice, np.array([0.1, 0.49, 0.51, 0.76, 1.0])) == ["a", "a", "b", "c", "c"]
    assert quantiles_of(choice, ["a", "b", "c"]) == pytest.approx([0.25, 0.625, 0.875])


def test_input_sets_nest_and_repeat() -> None:
    large, small = nested(5, 128, 7), nested(5, 64, 7)
    assert np.array_equal(large[:64], small)
    assert not np.array_equal(nested(5, 64, 8), small)
    assert large[0] == pytest.approx(FIRST, abs=1e-15)
    # Every slab of a sixteenth holds its share.
    assert (np.histogram(small[:, 2], 16, (0.0, 1.0))[0] == 4).all()


@pytest.mark.parametrize("inputs", [3, 7, 12, 25])
def test_screening_frees_main_effects_of_each_other_and_of_pairs(inputs: int) -> None:
    signs = np.sign(screening_design(inputs) - 0.5)
    assert np.allclose(signs.T @ signs, len(signs) * np.eye(inputs))
    pairs = np.column_stack([signs[:, i] * signs[:, j] for i in range(inputs) for j in range(i)])
    assert np.abs(signs.T @ pairs).max() == 0.0


def test_limit_an_estimated_oil_temperature_stays_within_its_key() -> None:
    """Limit: 10 K about -55 C end at -60 C, the least that the key allows; about 70 C nothing is cut."""
    for temperature, ends in ((-55.0, (-60.0, -45.0)), (70.0, (60.0, 80.0))):
        scene = Scene.load(SCENE, ["lubricant.oil=ISO VG 10", f"lubricant.temperature_C={temperature}"])
        (entry,) = (entry for entry in documented_of(scene) if entry.key == "lubricant.temperature_C")
        assert (entry.low, entry.high) == ends
