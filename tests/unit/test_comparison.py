"""Comparison of two bearings: which inputs differ, and which differences are more than their errors."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import rbdyn
from rbdyn.base.estimate import times_wider
from rbdyn.base.faults import InputError
from rbdyn.comparison import comparison, differences, different_inputs
from rbdyn.result import Quantity, SimulationResult
from rbdyn.scene import Scene
from rbdyn.scene.keys import default_of

EXAMPLES = Path(__file__).parents[2] / "examples"
ROLLERS, BALLS = EXAMPLES / "cylindrical_roller.toml", EXAMPLES / "angular_contact_ball.toml"
FIGURES = {
    "impact_force_N": 90.0, "whirl_deviation_ratio": 0.4, "power_loss_W": 240.0, "cage_speed_rpm": 9400.0,
    "cage_slip": 0.01,
}  # fmt: skip
PAIRS = 200


@pytest.fixture(scope="module")
def short() -> SimulationResult:
    """A short run of the example."""
    return rbdyn.simulate(
        ROLLERS, notice=None, overrides=["numerics.turns=3", "numerics.replicates=3", "numerics.extend=false"]
    )


def drawn(random: np.random.Generator, replicates: int, numerical: float, spread: float = 0.02) -> dict[str, Quantity]:
    """Figures as means of so many replicates about one truth, with a numerical error of a normal bias."""
    figures = {}
    for name, truth in FIGURES.items():
        sample = truth * (1.0 + spread * random.standard_normal(replicates))
        half = stats.t.ppf(0.975, replicates - 1) * sample.std(ddof=1) / np.sqrt(replicates)
        bias = truth * numerical * random.standard_normal()
        figures[name] = Quantity(sample.mean() + bias, half, 1.96 * truth * numerical, 50.0, replicates - 1)
    return figures


@pytest.mark.parametrize(("first", "second", "numerical"), [(4, 4, 0.0), (4, 8, 0.005), (3, 16, 0.0)])
def test_invariant_equal_bearings_rarely_differ(short, first, second, numerical):
    """Invariant: of 200 pairs of results of one truth at most 5 % show any significant difference, by intervals that hold together."""
    alarms = 0
    for seed in range(PAIRS):
        random = np.random.default_rng(seed)
        sides = [
            replace(
                short,
                figures={"impact_contact_force_N": short.impact_contact_force_N} | drawn(random, size, numerical),
                damage=None,
            )
            for size in (first, second)
        ]
        found = comparison(*sides)
        assert not found.inputs and len(found.figures) == len(FIGURES) + 1
        alarms += any(found.figures[name].verdict == "significant" for name in FIGURES)
    assert alarms <= 0.05 * PAIRS


def test_closed_form_of_a_difference():
    """Closed form: equal replicates have twice the freedom and root two the error, numerical errors add as squares, and the
    interval that holds together is Bonferroni's."""
    one = Quantity(10.0, 0.3, None, 50.0, 3)
    found = differences(
        {"a": one, "b": one, "exact_mm": Quantity(1.0, 0.0, 0.0, 1.0)},
        {"a": replace(one, value=11.0), "b": one, "exact_mm": Quantity(2.0, 0.0, 0.0, 1.0)},
    )
    half = 0.3 * np.sqrt(2.0) * stats.t.ppf(0.975, 6) / stats.t.ppf(0.975, 3)
    assert found["a"].error == pytest.approx(half)
    assert found["a"].error_together == pytest.approx(half * float(times_wider(6.0, 2)))
    assert [found[name].verdict for name in found] == ["significant", "equal", "significant"]
    assert found["a"].percent == pytest.approx(10.0) and found["a"].difference == 1.0
    numerical = Quantity(5.0, 0.0, 0.3, 1.0), Quantity(5.4, 0.0, 0.4, 1.0)
    known = differences({"a": numerical[0]}, {"a": numerical[1]})["a"]
    assert known.error == pytest.approx(0.5) and known.verdict == "within error"
    uneven = differences({"a": one}, {"a": replace(one, degrees_of_freedom=15)})["a"]
    errors = 0.3 / stats.t.ppf(0.975, 3), 0.3 / stats.t.ppf(0.975, 15)
    freedom = (errors[0] ** 2 + errors[1] ** 2) ** 2 / ((errors[0] ** 4 + errors[1] ** 4) / 3)
    assert uneven.error == pytest.approx(np.hypot(*errors) * stats.t.ppf(0.975, freedom))


def test_limit_cases_of_errors():
    """Limit case: an unknown statistical error leaves the verdict open, and a figure of one side has no difference."""
    found = differences(
        {"a": Quantity(1.0, None, 0.1, 5.0), "b": Quantity(1.0, 0.1, None, 5.0, 3)},
        {"a": Quantity(9.0, 0.1, 0.1, 5.0, 3), "c": Quantity(2.0, 0.1, 0.1, 5.0, 3)},
    )
    assert found["a"].verdict == "error unknown" and found["a"].error is None
    assert (found["b"].verdict, found["c"].verdict) == ("only in A", "only in B")
    assert json.loads(json.dumps(found["c"].as_dict()))["a"] is None


def test_unit_inputs_that_differ():
    """Unit: keys with other values, those of a table of one scene alone, and which values are defaults."""
    one = Scene.load(ROLLERS)
    other = one.changed({"numerics.rtol": 0.005, "cage.mass_g": 30.0})
    tables = [scene.model_dump(mode="json") for scene in (one, other)]
    found = {item.key: item for item in different_inputs(*tables)}
    assert set(found) == {"numerics.rtol", "cage.mass_g"}
    assert found["numerics.rtol"].a == default_of("numerics.rtol") and found["numerics.rtol"].a_default
    assert found["numerics.rtol"].b == 0.005 and not found["numerics.rtol"].b_default
    hot = Scene.load(EXAMPLES / "hot_roller.toml").model_dump(mode="json")
    alone = {item.key: item for item in different_inputs(tables[0], hot)}
    assert alone["thermal.ambient_C"].a is None and alone["thermal.ambient_C"].b == 40.0
    assert alone["thermal.surface_factor"].b_default


def test_stiff_a_real_change_is_found(tmp_path):
    """Golden fact: half the radial clearance changes slip and orbit significantly, and the table of inputs is that key."""
    found = rbdyn.compare(
        ROLLERS, overrides=["bearing.radial_clearance_mm=0.01"], both=["numerics.turns=10", "numerics.replicates=4"]
    )
    assert [(one.key, one.a, one.b) for one in found.inputs] == [("bearing.radial_clearance_mm", 0.02, 0.01)]
    assert found.figures["cage_slip"].verdict == "significant" and found.figures["cage_slip"].difference < 0.0
    assert found.parts["radial_operating_clearance_um"].difference == pytest.approx(-10.0)
    found.save(tmp_path / "comparison.json")
    assert type(found).load(tmp_path / "comparison.json") == found
    assert "cage slip" in repr(found) or "impact force" in repr(found)


def test_unit_a_scene_is_no_other_than_itself():
    """Unit: a scene twice is one run, without a difference; with another seed, differences are within their errors."""
    short = ["numerics.turns=5", "numerics.replicates=3", "numerics.extend=false"]
    found = rbdyn.compare(ROLLERS, ROLLERS, both=short)
    assert not found.inputs and {one.verdict for one in found.figures.values()} == {"equal"}
    other = rbdyn.compare(ROLLERS, overrides=["numerics.seed=7"], both=short)
    assert [one.key for one in other.inputs] == ["numerics.seed"]
    # A land that never touches slides nowhere in either, and rollers that roll at their entry lose nothing there.
    equal = [name for name, one in other.figures.items() if one.verdict == "equal"]
    assert equal == ["land_sliding_N_m_s", "entry_energy_J", "entry_energy_95_J"]
    assert {one.verdict for one in other.figures.values()} <= {"within error", "error unknown", "equal"}


def test_unit_ball_bearings_are_exact(tmp_path):
    """Unit: an equilibrium has no scatter; a saved one compares as its scene, and more load costs life."""
    rbdyn.equilibrium(BALLS).save(tmp_path / "result.json")
    found = rbdyn.compare(tmp_path, rbdyn.BallScene.load(BALLS, ["operation.axial_load_N=400"]))
    assert found.kind == "balls" and [one.key for one in found.inputs] == ["operation.axial_load_N"]
    assert found.figures["life_h"].verdict == "significant" and found.figures["life_h"].difference < 0.0
    assert {one.verdict for one in rbdyn.compare(tmp_path, BALLS).figures.values()} == {"equal"}


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        ("none.toml", "none.toml: no such file; check the path"),
        ("none.json", "none.json: cannot be read (no such file); check the path"),
        ("old.json", "format is rbdyn.simulation/3, not rbdyn.simulation/5; run the scene again"),
        ("half.json", "half.json: not a saved simulation result; check the path"),
        (BALLS, "A is a bearing with rollers and B one with balls"),
    ],
)
def test_unit_what_cannot_be_compared(short, tmp_path, source, fault):
    """Unit: each bad source is one sentence."""
    short.save(tmp_path / "old.json")
    text = (tmp_path / "old.json").read_text()
    (tmp_path / "old.json").write_text(text.replace("rbdyn.simulation/5", "rbdyn.simulation/3"))
    (tmp_path / "half.json").write_text(text[: len(text) // 2])
    with pytest.raises(InputError) as refused:
        rbdyn.compare(short, tmp_path / source)
    assert len(refused.value.faults) == 1 and fault in refused.value.faults[0]


def test_unit_a_saved_result_keeps_its_keys(short):
    """Unit: overrides need the file of a scene, and a comparison needs two bearings."""
    with pytest.raises(InputError, match="a saved result, which no key changes; name the file of its scene"):
        rbdyn.compare(short, overrides=["cage.mass_g=20"])
    with pytest.raises(InputError, match="B: missing"):
        rbdyn.compare(short)


def test_command_line_compare(command, tmp_path):
    """Command line: one command for "what if", with its files and one JSON object; rollers against balls end it with 2."""
    arguments = (str(BALLS), "--set", "operation.inner_speed_rpm=12000")
    ran = command("compare", *arguments, "--out", str(tmp_path / "out"))
    assert ran.returncode == 0 and "1 input differs" in ran.stdout and "B against A" in ran.stdout, ran.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {
        "comparison.json",
        "inputs.csv",
        "differences.csv",
        "report.html",
        "tables.xlsx",
    }
    record = json.loads(command("compare", *arguments, "--json").stdout)
    assert record["inputs"] == [
        {"key": "operation.inner_speed_rpm", "a": 30000.0, "b": 12000.0, "a_default": False, "b_default": False}
    ]
    assert record["figures"]["life_h"]["verdict"] == "significant"
    # The first line states the operating points of both.
    assert "against 12000 rpm" in " ".join(ran.stdout.partition("A: ")[0].split())
    refused = command("compare", str(BALLS), str(ROLLERS))
    assert refused.returncode == 2 and refused.stderr.count("\n") == 1
