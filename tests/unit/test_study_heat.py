"""Studies of scenes with a heat balance: temperatures as responses and measurements, failed balances, hot scenes, the example."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from instant_runs import instant_result
from short_studies import EXAMPLES, run_study, silent
from typer.testing import CliRunner

from doe import clearance
from doe.clearance import Simulations
from doe.cli import app
from doe.duty import OPERATION
from doe.report.files import summary
from doe.running.store import Failure, Store
from doe.workflow.calibration import find_calibration, read_question
from doe.workflow.confirmation import Choice, confirmed_from
from doe.workflow.duty import operating_clearances
from doe.workflow.input_sets import read_case
from doe.workflow.problem import Problem
from doe.workflow.uncertainty import find_uncertainty, uncertainty_stages
from doe.workflow.whole import check_study
from rbdyn.base.faults import InputError
from rbdyn.dynamics import simulate as simulation
from rbdyn.result import TEMPERATURES, HeatBalance, Quantity, Ranges
from rbdyn.scene import Scene

HOT = EXAMPLES / "hot_roller.toml"
WARM = {"oil": 92.7, "outer": 97.2, "inner": 93.0, "rollers": 100.8}
# Runs long enough for a temperature to 0.1 K.
SHORT = ["turns=5", "discard_turns=5", "replicates=2", "companion=false", "extend=false", "impact_window_turns=1"]


def hot_study(folder: Path, change: tuple[str, str] = ("", "")) -> Path:
    """The example study of hot clearances with short runs and a short search."""
    shutil.copy(HOT, folder)
    text = (EXAMPLES / "hot_clearance.toml").read_text(encoding="utf-8")
    first = next(line for line in text.splitlines() if line.startswith("set = "))
    keys = ", ".join(f'"numerics.{key}"' for key in SHORT)
    for old, new in ((first, f"set = [{keys}]"), ("generations = 200", "generations = 20\ndraws = 100"), change):
        assert old in text
        text = text.replace(old, new) if old else text
    path = folder / "hot.toml"
    path.write_text(text.replace("replicates = 16", "replicates = 2"), encoding="utf-8")
    return path


def hot_result(scene: Scene, status: str = "steady", reason: str = ""):
    """A result in no time, with a heat balance."""
    figures = {node: Quantity(value, 0.1, 0.05, 10.0, 9) for node, value in WARM.items()}
    ranges = Ranges({node: (value - 5.0, value, value + 15.0) for node, value in WARM.items()})
    nothing = {key: {} for key in ("heat_W", "carried_off_W", "conductances_W_K")}
    balance = HeatBalance(
        status=status,
        reason=reason or None,
        gain=0.1,
        windage_W=0.0,
        ranges=ranges,
        oil_fraction=None,
        path_C=[WARM],
        **nothing,
    )
    own = "ok" if status == "steady" else status
    return replace(instant_result(scene), status=own, temperatures_C=figures, thermal=balance)


def test_unit_the_example_study_is_sound():
    """Unit: scene and study of the example read and pass all checks; every response is one of the simulation."""
    study = Problem.load(EXAMPLES / "hot_clearance.toml")
    check_study(study)
    assert "inner_temperature_C" in study.responses
    scene = Scene.load(HOT)
    assert scene.thermal is not None and scene.lubricant.temperature_C == 100.0
    assert set(TEMPERATURES.values()) == set(WARM)


def test_unit_a_temperature_needs_a_heat_balance(tmp_path):
    """Unit: one sentence with the fix; scene.set may add the balance; an unknown name lists temperatures only with one."""
    path = hot_study(tmp_path)
    scene = tmp_path / "hot_roller.toml"
    scene.write_text(scene.read_text(encoding="utf-8").partition("[thermal]")[0] + "\n", encoding="utf-8")
    # Without the balance the temperature of the oil is no first guess.
    plain = path.read_text(encoding="utf-8").replace('set = ["', 'set = ["lubricant.temperature_C=100.0", "')
    path.write_text(plain, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        Problem.load(path).check_responses()
    assert len(caught.value.faults) == 1
    assert str(caught.value.faults[0]).endswith(
        "response.name = 'inner_temperature_C': hot_roller.toml has no [thermal], which computes temperatures; add that table "
        "there, or name another response"
    )
    path.write_text(plain.replace('set = ["', 'set = ["thermal.ambient_C=20.0", "'), encoding="utf-8")
    Problem.load(path).check_responses()
    path.write_text(path.read_text(encoding="utf-8").replace("power_loss_W", "power_los_W"), encoding="utf-8")
    with pytest.raises(InputError, match=r"power_los_W': the simulation does not give it; did you mean power_loss_W"):
        Problem.load(path).check_responses()


def test_unit_temperatures_are_figures(tmp_path):
    """Unit: values, errors and samples of temperatures are those of the result; NaN where a result has none."""
    scene = Scene.load(HOT)
    names = ["inner_temperature_C", "power_loss_W", "oil_temperature_C"]
    values, errors, samples = clearance.figures(names, [hot_result(scene), instant_result(scene)])
    assert values[0, [0, 2]] == pytest.approx([93.0, 92.7]) and np.isnan(values[1, [0, 2]]).all()
    assert errors[0, 0] == 0.1 and samples.tolist() == [[10, 10, 10], [0, 10, 0]]


@pytest.mark.parametrize("status", ["undecided", "no steady state", "seizure", "too hot"])
def test_unit_a_failed_balance_is_a_failed_run(status, monkeypatch, tmp_path):
    """Unit: its cause is status and reason; the store keeps it and it does not run again."""
    scene, calls = Scene.load(HOT), []

    def simulate(scene, *rest, **more):
        calls.append(scene)
        return hot_result(scene, status, "the thermal loop gain is 1.3")

    monkeypatch.setattr(simulation, "simulate", simulate)
    outcome = clearance.attempt(scene)
    assert outcome.result is None and outcome.cause == f"{status}: the thermal loop gain is 1.3"
    with Store(tmp_path / "runs.sqlite", "study") as store:
        simulations = Simulations(store, 1, None, False, lambda title: silent)
        for _ in range(2):
            (failure,) = simulations.run([scene], ["design run 1"], silent)
            assert isinstance(failure, Failure) and failure.cause == outcome.cause
    assert len(calls) == 2


def test_unit_a_confirmed_point_is_hot(tmp_path):
    """Unit: its clearances in operation and its motion are those at the temperatures of its run."""
    study = Problem.load(hot_study(tmp_path))
    scene = study.confirmation_scene(study.baseline)
    confirmed = confirmed_from(study, Choice(study.baseline, ""), hot_result(scene))
    assert confirmed.values[-1] == 93.0 and confirmed.result.thermal.ranges.figures["inner"] == (88.0, 93.0, 108.0)
    hot = confirmed.hot[OPERATION]
    assert hot.thermal is None and hot.mounting.inner_ring_temperature_C == 93.0 and hot.lubricant.temperature_C == 92.7
    found = operating_clearances(study, {"baseline": hot, "pick": hot}).operating
    assert found["guide_clearance_mm"]["pick"] == pytest.approx(0.1204, abs=2e-4)
    assert found["pocket_clearance_mm"]["pick"] > 0.3


def test_unit_a_first_guess_cannot_vary(tmp_path):
    """Unit: the oil's temperature, which the balance computes, is neither a factor, nor an unknown input, nor set by a duty's point."""
    fault = "lubricant.temperature_C: is a first guess alone, since the heat balance of .thermal. computes it"
    path = hot_study(tmp_path)
    text = path.read_text(encoding="utf-8")
    (key,) = [line for line in text.splitlines() if line.startswith('key = "bearing.radial_clearance_mm"')]
    path.write_text(text.replace(key, 'key = "lubricant.temperature_C"'), encoding="utf-8")
    study = Problem.load(path)
    with pytest.raises(InputError, match=f"factor.key = {fault}"):
        study.confirmation_scene(study.baseline)
    with pytest.raises(InputError) as refused:
        study.design_scenes(study.baseline[None])
    assert [str(one).count("lubricant.temperature_C") for one in refused.value.faults] == [1], (
        "one sentence, and no region"
    )
    assert "region" not in str(refused.value)
    scene = tmp_path / "unknown.toml"
    law = '\n[uncertain]\n"lubricant.temperature_C" = {law = "uniform", low = 80.0, high = 90.0}\n'
    scene.write_text(HOT.read_text("utf-8") + law, encoding="utf-8")
    with pytest.raises(InputError, match=f"uncertain: {fault}"):
        read_case(scene, ["power_loss_W"], [])
    (tmp_path / "rig.csv").write_text(
        "lubricant.temperature_C,outer_temperature_C,outer_temperature_C_sd\n80,78,0.3\n90,89,0.3\n95,101,0.3\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match=f"column {fault}"):
        read_question(HOT, tmp_path / "rig.csv", (), ())


def test_unit_unknown_inputs_of_a_heat_balance():
    """Unit: its weak conductances vary; temperatures that it computes do not; a viscosity that varies has its temperature."""
    case = read_case(HOT, ["power_loss_W"], [])
    keys = {one.key for one in case.every}
    factors = {
        "surface_factor",
        "housing_factor",
        "shaft_factor",
        "film_share_to_oil",
        "contact_factor",
        "oil_share",
        "shaft_lag",
        "cage_offset_K",
    }
    assert {f"thermal.{key}" for key in factors} | {"lubricant.oil_fraction_factor", "lubricant.viscosity_mPas"} <= keys
    assert not any("temperature_C" in key for key in keys) and "lubricant.oil_fraction" not in keys
    assert [len(stage.titles) for stage in uncertainty_stages(HOT, [], 16)][:2] == [1, 1]


def test_unit_work_counts_the_short_states():
    """Unit: a run with a balance takes its own turns and those of four short states of two replicates at least."""
    hot = Scene.load(
        HOT, ["numerics.replicates=8", "numerics.turns=40", "numerics.discard_turns=20", "numerics.companion=false"]
    )
    assert clearance.work_of(hot) == 8 * 60.0 + 4 * 2 * (20.0 + 8.0)


RIG = "operation.inner_speed_rpm,outer_temperature_C,{}\n12000,78,0.3\n18000,89,0.3\n24000,101,0.3\n"


@pytest.mark.parametrize(
    ("scene", "column", "sentence"),
    [
        ("hot_roller.toml", "turns", "outer_temperature_C_sd in row 1: is missing; give the standard deviation of the thermometer"),
        ("cylindrical_roller.toml", "outer_temperature_C_sd", "column outer_temperature_C: .* has no .thermal., which computes"),
    ],
)  # fmt: skip
def test_unit_measured_temperatures_need_an_error_and_a_balance(scene, column, sentence, tmp_path):
    """Unit: shaft turns are no scatter of a temperature; a scene without a balance has none to compare."""
    (tmp_path / "rig.csv").write_text(RIG.format(column), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_question(EXAMPLES / scene, tmp_path / "rig.csv", (), ())


def test_unit_a_new_study_may_limit_a_temperature():
    """Unit: of a scene with a heat balance; of any other one sentence says what is missing."""
    limits = ["new", str(HOT), "--limit", "inner_temperature_C<=110", "--json"]
    shown = CliRunner().invoke(app, limits)
    responses = {one["name"]: one for one in json.loads(shown.stdout)["response"]}
    assert responses["inner_temperature_C"]["upper"] == 110.0 and responses["inner_temperature_C"]["goal"] == "none"
    limits[1] = str(EXAMPLES / "cylindrical_roller.toml")
    refused = CliRunner().invoke(app, limits)
    assert refused.exit_code == 2 and "has no [thermal], which computes temperatures; add that table" in refused.stdout


@pytest.mark.slow
def test_a_study_of_hot_clearances(tmp_path):
    """Each design at its own temperatures: the limit of the inner ring is kept, heat takes 30 um of the guide, and the oil
    carries the loss off with a rise of 13 K."""
    outcome = run_study(Problem.load(hot_study(tmp_path)), tmp_path, 1, lambda title: silent)
    record = summary(outcome).as_dict()
    baseline = record["confirmation"]["baseline"]["temperatures_C"]
    assert baseline["oil_temperature_C"]["value"] == pytest.approx(92.7, abs=0.5)
    assert record["limits"]["inner_temperature_C"]["verdict"] == "kept"
    assert record["operating_clearances_mm"]["guide_clearance_mm"]["baseline"] == pytest.approx(0.1204, abs=1e-3)
    assert outcome.scenes["pick"].thermal is None and not outcome.failures


@pytest.mark.slow
def test_a_study_goes_on_without_bearings_that_are_too_hot(tmp_path):
    """A ceiling between the coolest and the hottest design: some runs fail, with their reason, and the answer says so."""
    path = hot_study(tmp_path)
    scene = tmp_path / "hot_roller.toml"
    scene.write_text(scene.read_text(encoding="utf-8") + "oil_ceiling_C = 93.5\n", encoding="utf-8")
    outcome = run_study(Problem.load(path), tmp_path, 1, lambda title: silent)
    assert 0 < len(outcome.failures) < 6
    assert all("too hot: the oil reaches" in failure.cause for failure in outcome.failures)
    assert any("failed and" in note for note in outcome.notes)


@pytest.mark.slow
def test_ranges_of_temperatures_over_unknown_inputs(tmp_path):
    """Sixteen input sets: each temperature has a range about its nominal value that is far wider than its error."""
    scene = tmp_path / "hot.toml"
    keys = ", ".join(f'"numerics.{key}"' for key in SHORT)
    scene.write_text(f"{HOT.read_text('utf-8')}\n[uncertain]\nset = [{keys}]\n", encoding="utf-8")
    with Store(tmp_path / "runs.sqlite", "hot") as store:
        simulations = Simulations(store, 1, None, False, lambda title: silent)
        found = find_uncertainty(scene, [], simulations, 16, 10.0)
    for name in TEMPERATURES:
        low, high = found.responses[name].input.low, found.responses[name].input.high
        assert low - 5.0 < found.responses[name].nominal.value < high + 5.0 and high - low > 5.0


@pytest.mark.slow
def test_a_measured_ring_identifies_the_surface_factor(tmp_path):
    """A rig with a surface factor of 0.5: temperatures of the outer ring to 0.2 K, two at each of two conditions, give it back."""
    keys = [f"numerics.{key}" for key in SHORT]
    rows = ["operation.inner_speed_rpm,lubricant.oil_flow_l_min,outer_temperature_C,outer_temperature_C_sd"]
    generator = np.random.default_rng(5)
    for speed, flow in ((18000, 0.5), (24000, 1.0)):
        own = [f"operation.inner_speed_rpm={speed}", f"lubricant.oil_flow_l_min={flow}", "thermal.surface_factor=0.5"]
        result = simulation.simulate(Scene.load(HOT, [*keys, *own, "numerics.seed=77"]), 1, notice=None)
        measured = result.temperatures_C["outer"].value + 0.2 * generator.standard_normal(2)
        rows += [f"{speed},{flow},{temperature:.3f},0.2" for temperature in measured]
    (tmp_path / "rig.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    declared = (
        '\n[uncertain]\ndefaults = "none"\nestimated = ["thermal.surface_factor"]\nset = [{}]\n[calibrate]\nwaves = 1\n'
    )
    text = HOT.read_text("utf-8") + declared.format(", ".join(f'"{key}"' for key in keys))
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    question = read_question(tmp_path / "scene.toml", tmp_path / "rig.csv", (), ())
    with Store(tmp_path / "runs.sqlite", "rig") as store:
        found = find_calibration(question, Simulations(store, 1, None, False, lambda title: silent))
    values = [row["thermal.surface_factor"] for row in found.evidence.sample]
    low, middle, high = np.quantile(values, (0.005, 0.5, 0.995))
    assert low < 0.5 < high and middle == pytest.approx(0.5, rel=0.2) and high / low < 2.0
