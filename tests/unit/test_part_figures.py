"""Power terms, operating clearances, contact pressures and films as figures: of a result, a study, a limit and a map."""

import json
import math
from functools import cache

import numpy as np
import pytest
from conftest import ROOT
from doe_command import doe
from short_studies import short_study

import rbdyn
from doe import clearance
from doe.commands.new import limits_of
from doe.duty import Rule
from doe.workflow.problem import Problem
from rbdyn.base.estimate import Estimate
from rbdyn.base.faults import InputError
from rbdyn.dynamics.figures import PARTS, of_kind, why_missing
from rbdyn.dynamics.part_figures import row_stiffness, static_life
from rbdyn.dynamics.slip_map import slip_map
from rbdyn.dynamics.statistics.batch_means import student_factor
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene

SHORT = ["numerics.turns=2", "numerics.replicates=3"]
ONE_OF_EACH = (
    "land_film_power_W", "guide_operating_clearance_um", "outer_max_pressure_MPa", "inner_minimum_film_um", "life_h",
    "stiffness_yy_N_um", "variable_compliance_um",
)  # fmt: skip


@cache
def result(name: str) -> SimulationResult:
    """A short run of an example."""
    return rbdyn.simulate(ROOT / "examples" / name, overrides=SHORT, notice=None)


def test_the_figures_of_parts_are_those_of_the_report_with_errors():
    """Powers add up to the loss, clearances and contacts are those reported; all scatter but the clearances of the drawing."""
    run = result("cylindrical_roller.toml")
    figures = run.part_figures
    assert list(figures) == [part.key for part in PARTS] and not set(figures) & set(run.quantities)
    powers = {power.key: figures[power.key] for power in of_kind("power")}
    assert [power.value for power in powers.values()] == pytest.approx(list(run.power_terms_W.values()))
    assert math.fsum(power.value for power in powers.values()) == pytest.approx(run.power_loss_W.value)
    # Terms that oppose each other scatter more than their sum, and none scatters by itself as much as their sum of errors.
    loss, *terms = (
        figure.statistical_error / student_factor(figure.degrees_of_freedom)
        for figure in (run.power_loss_W, *powers.values())
        if figure.statistical_error
    )
    assert loss < math.fsum(terms)
    for gap in of_kind("clearance"):
        operating = run.clearance_um[gap.source[0]]["operating"]
        assert figures[gap.key].value == pytest.approx(operating) and figures[gap.key].error == 0.0
    race_records = run.as_dict()["races"]
    for contact in of_kind("contact"):
        race, key = contact.source
        assert figures[contact.key].value == race_records[race][key] and figures[contact.key].statistical_error > 0.0
    scene = Scene.load(ROOT / "examples" / "cylindrical_roller.toml")
    assert (
        figures["life_h"].value == static_life(scene).hours(*scene.operation.speeds) and figures["life_h"].error == 0.0
    )
    stiffness = row_stiffness(scene)
    assert run.stiffness_N_um == {"xx": 1e-6 * stiffness.along, "yy": 1e-6 * stiffness.across}
    assert run.as_dict()["stiffness_N_um"]["yy"] == figures["stiffness_yy_N_um"].value
    assert SimulationResult.from_dict(json.loads(json.dumps(run.as_dict()))).part_figures == figures


def test_without_load_and_preload_there_is_no_stiffness(tmp_path):
    """JSON has null, and a study that names a stiffness is refused before anything runs; a preload alone has one."""
    free = Scene.load(ROOT / "examples" / "cylindrical_roller.toml", ["operation.radial_load_N=0", *SHORT])
    run = rbdyn.simulate(free, notice=None)
    assert run.stiffness_N_um is None and "stiffness_xx_N_um" not in run.responses
    assert "raise operation.radial_load_N" in why_missing(free, "variable_compliance_um")
    preloaded = free.overridden(["bearing.radial_clearance_mm=-0.004"])
    assert why_missing(preloaded, "stiffness_xx_N_um") is None
    assert row_stiffness(preloaded).across == pytest.approx(row_stiffness(preloaded).along, rel=1e-6)


def test_a_life_over_a_duty_is_that_of_palmgren_and_miner():
    """The mean over points of time is the life of the damage that they do."""
    lives, shares = np.array([[2e4, 300.0, 9e5]]), np.array([0.7, 0.05, 0.25])
    errors, freedom = 0.01 * lives, np.full((1, 3), np.inf)
    mean, _ = Rule("mean", "max", None, harmonic=True).over(Estimate(lives, errors, freedom), shares)
    assert mean.value[0] == pytest.approx(1.0 / (shares / lives[0]).sum())
    assert mean.error[0] == pytest.approx(0.01 * mean.value[0] ** 2 * np.sqrt(((shares / lives[0]) ** 2).sum()))


def test_clearances_of_a_heat_balance_have_the_errors_of_its_temperatures():
    """A node that is off by its error moves a clearance by less than the clearance's error, and all together by just that."""
    run = result("hot_roller.toml")
    error = run.part_figures["guide_operating_clearance_um"].statistical_error
    # 0.12 mm of a guide of 50 mm at 1.2e-5 1/K: about 0.6 um a kelvin between cage and ring, more or less.
    largest = max(node.statistical_error for node in run.temperatures_C.values())
    assert 0.05 * largest < error < 4.0 * largest


@pytest.mark.parametrize("name", ONE_OF_EACH)
def test_a_study_may_name_each_kind(tmp_path, name):
    """A response of a study has the value and the error of the run; over a duty it is one of its figures too."""
    text = short_study(tmp_path).read_text(encoding="utf-8").replace("power_loss_W", name)
    path = tmp_path / "part.toml"
    path.write_text(text, encoding="utf-8")
    Problem.load(path).check_responses()
    run = result("cylindrical_roller.toml")
    values, errors, _ = clearance.figures([name], [run])
    assert (values[0, 0], errors[0, 0]) == (run.part_figures[name].value, run.part_figures[name].statistical_error)


def test_a_limit_may_name_each_kind_and_a_wrong_name_lists_all():
    """Limits of ``doe new``, with the temperatures that they take."""
    assert limits_of([f"{name}<=9" for name in ONE_OF_EACH]) == {name: {"upper": 9.0} for name in ONE_OF_EACH}
    with pytest.raises(InputError) as refused:
        limits_of(["power<=9", "land_film_power_W<=0,9 kW", "inner_minimum_film_um>=0,1"])
    assert "choose one of impact_force_N," in refused.value.faults[0]
    assert all(name in clearance.responses_of(True) for name in [*(part.key for part in PARTS), "oil_temperature_C"])
    assert refused.value.faults[2].endswith("has a decimal comma; write 0.1")


def test_a_map_has_all_of_them_at_every_point():
    """Its table has a column for each, as its JSON has."""
    scene = Scene.load(ROOT / "examples" / "cylindrical_roller.toml", ["numerics.turns=1", "numerics.replicates=2"])
    mapped = slip_map(scene, [9000.0], [900.0, 1100.0], notice=None)
    table = mapped.table()
    for name in ONE_OF_EACH:
        assert np.isfinite(mapped.grid(name)).all() and table[name].tolist() == mapped.grid(name)[:, 0].tolist()
    assert mapped.grid("outer_max_pressure_MPa")[1, 0] > mapped.grid("outer_max_pressure_MPa")[0, 0]


@pytest.mark.slow
def test_a_whole_study_improves_and_limits_parts(tmp_path):
    """A study with a response and a limit of each kind ends, and its answer has them."""
    text = short_study(tmp_path).read_text(encoding="utf-8")
    further = "".join(f'\n[[response]]\nname = "{name}"\ngoal = "none"\nupper = 1e5\n' for name in ONE_OF_EACH)
    path = tmp_path / "parts.toml"
    # The published table has no such columns.
    path.write_text(text.partition("[reference]")[0] + further, encoding="utf-8")
    shown = doe("study", path, "--out", tmp_path / "out", "--json")
    assert shown.returncode == 0, shown.stderr
    answer = json.loads(shown.stdout)
    assert set(ONE_OF_EACH) <= set(answer["limits"])


@pytest.mark.slow
def test_uncertainties_of_parts(tmp_path):
    """Ranges of further outputs; one that no input changes has a note instead."""
    figures = [word for name in (*ONE_OF_EACH, "pocket_film_power_W") for word in ("--figure", name)]
    sets = [word for key in SHORT for word in ("--set", key)]
    scene = ROOT / "examples" / "cylindrical_roller.toml"
    shown = doe(
        "uncertainty", scene, "--points", "16", "--target", "50%", *sets, *figures, "--out", tmp_path / "out", "--json"
    )
    assert shown.returncode == 0, shown.stderr
    answer = json.loads(shown.stdout)
    assert {"land_film_power_W", "outer_max_pressure_MPa", "inner_minimum_film_um"} <= set(answer["responses"])
    assert any("pocket_film_power_W: it is 0 in every input set" in note["text"] for note in answer["notes"])
    refused = doe("uncertainty", scene, "--figure", "no_W", "--out", tmp_path / "other")
    assert refused.returncode == 2 and "--figure no_W: not a result of this scene; choose one of" in refused.stderr
