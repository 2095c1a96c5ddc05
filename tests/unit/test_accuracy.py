"""Accuracy studies: bias over tolerances, slices, replicates, the files they write, and the command."""

import json

import pytest
import slicing
from conftest import lacking

from rbdyn import accuracy
from rbdyn.accuracy import methods, tolerances
from rbdyn.base.faults import RunError
from rbdyn.plots.style import SMALLEST_BIAS

EXAMPLE = "examples/cylindrical_roller.toml"


@pytest.fixture(scope="module")
def found(outer):
    """Three tolerances on the shared scene."""
    return accuracy.statistics_bias(outer, (1e-4, 5e-2, 1e-2))


def test_unit_tighter_tolerance_takes_more_steps_and_closes_better(found):
    """Unit: rows go from the loosest tolerance to the tightest."""
    rows = found.rows
    assert [row.rtol for row in rows] == [5e-2, 1e-2, 1e-4] and found.failures == {}
    assert rows[0].steps_per_turn < rows[1].steps_per_turn < rows[2].steps_per_turn
    assert rows[0].power_gap > rows[1].power_gap > rows[2].power_gap


def test_unit_reference_row_has_no_bias(found):
    """Unit: the tightest is the reference of the others."""
    rows = found.rows
    assert set(rows[-1].bias) == {"impact_force_N", "whirl_deviation_ratio", "power_loss_W"}
    assert set(rows[-1].bias.values()) == {0.0}
    for row in rows[:-1]:
        for name, bias in row.bias.items():
            assert row.value[name] == pytest.approx(rows[-1].value[name] * (1.0 + bias))


def test_unit_failed_tolerances_stay_in_the_table(make_scene):
    """Unit: a tolerance that a run does not survive is told at the end; without a reference there is no study."""
    # Tighter tolerances take more steps: here the reference is the one that goes over the budget.
    with pytest.raises(RunError, match="step budget"):
        accuracy.statistics_bias(make_scene("numerics.step_budget_per_turn=400"), (1e-4, 1e-2))
    rows = accuracy.statistics_bias(make_scene(), (1e-2,)).rows
    table = tolerances.table(tolerances.StatisticsBias(rows, {0.1: "step budget used up"}))
    assert [len(cells) for cells in table.rows] == [len(table.header)] * 2
    assert table.rows[1][:2] == ("0.1", "failed")


def test_unit_default_study_has_statistics_and_trajectories(outer, tmp_path, drawn):
    """Unit: record, sheets and pictures of both; keys that others read."""
    report = tolerances.study(outer, turns=0.02, rtols=(1e-2, 1e-3))
    files = accuracy.write(report, tmp_path)
    assert files == ["accuracy.json", "accuracy.csv", "trajectory.csv", "accuracy.png", "trajectory.png"]
    saved = json.loads((tmp_path / "accuracy.json").read_text())
    assert len((tmp_path / "accuracy.csv").read_text().splitlines()) == 1 + len(saved["rows"])
    trajectories = saved["trajectory"]["rows"]
    assert len((tmp_path / "trajectory.csv").read_text().splitlines()) == 1 + len(trajectories)
    assert not lacking(
        drawn["accuracy.png"], [[row["turn_ms"], max(row["power_gap"], SMALLEST_BIAS)] for row in saved["rows"]]
    )
    assert drawn["trajectory.png"].size >= 2 * len(trajectories)  # a point a row
    assert {"format", "status", "rows", "conclusion", "turns", "replicates", "machine", "versions"} <= set(saved)
    assert saved["format"] == "rbdyn.accuracy/1" and len(saved["rows"]) == 2
    methods = {row["method"] for row in saved["trajectory"]["rows"]}
    assert methods == {"rbdyn RK45", "rbdyn Verlet", "RK4, fixed step", "Verlet, fixed step"}


def test_unit_statistics_do_not_need_the_reference_of_the_trajectories(outer, tmp_path, monkeypatch):
    """Unit: DOP853 at 1e-12 goes over its budget in slow bearings with thick oil; the biases are those of any study."""
    monkeypatch.setattr(methods, "BUDGET_PER_TURN", 1000)
    report = tolerances.study(outer, turns=0.02, rtols=(1e-2, 1e-3))
    why = "Trajectories are not compared, because their reference failed: replicate 1 "
    assert report.sentences[0].startswith(why) and "step budget of 1000" in report.sentences[0]
    assert report.record["trajectory"] is None
    assert len(report.record["rows"]) == 2 and report.record["status"] == "ok"
    assert accuracy.write(report, tmp_path) == ["accuracy.json", "accuracy.csv", "accuracy.png"]


def test_rate_load_of_slices_converges(make_scene):
    """Rate: more slices, less error of the load; 31 keep it within 1 % for a crowned roller."""
    scene = make_scene("bearing.roller_profile=crowned", "bearing.crown_radius_mm=800.0")
    errors = slicing.load_errors(scene, (5, 15, 31, 121))
    assert errors[5] > errors[15] > errors[31] > errors[121]
    assert errors[31] < 0.01 and errors[121] < 0.002


def test_command_accuracy(command, tmp_path, monkeypatch):
    """Command line: the study of tolerances unless another is named; JSON alone on standard output, files beside it."""
    settings = ("numerics.turns=2", "numerics.discard_turns=1", "numerics.replicates=2")
    sets = [word for setting in settings for word in ("--set", setting)]
    monkeypatch.setattr(methods, "SPANS", (0.25,))
    good = command("accuracy", EXAMPLE, *sets, "--json", "--out", tmp_path)
    assert good.returncode == 0, good.stderr
    record = json.loads(good.stdout)
    assert record["trajectory"]["turns"] == 0.25 and len(record["rows"]) == len(tolerances.TOLERANCES)
    assert (tmp_path / "trajectory.png").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("slices",), "is not a study of a bearing of kind 'cylindrical_roller'; choose tolerances or methods"),
        (("tolerances", "--set", "numerics.replicates=1"), "give at least 2, better 8"),
    ],
)
def test_command_accuracy_refuses(command, words, says):
    """Command line: one sentence and exit code 2 for studies that cannot be."""
    bad = command("accuracy", EXAMPLE, *words, "--json")
    assert bad.returncode == 2 and "Traceback" not in bad.stderr
    (fault,) = json.loads(bad.stdout)["faults"]
    assert says in fault and fault in bad.stderr


def test_unit_package_is_cheap_to_import():
    """Unit: neither numba nor scipy comes with the names of the package."""
    import subprocess
    import sys

    program = "import sys; from rbdyn import accuracy; accuracy.STUDIES; sys.exit('numba' in sys.modules or 'scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
