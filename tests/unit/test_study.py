"""The whole study on a short simulation: results, resumption, determinism, failures."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread
from short_studies import SHORT, rows, run_design, run_study, short_study, silent, stored

from doe.report.files import write
from doe.workflow.confirmation import Confirmed, gains
from doe.workflow.front import find_front
from doe.workflow.front_record import SurfaceFront
from doe.workflow.problem import Problem
from doe.workflow.runs import read_runs
from doe.workflow.status import finished_record as is_finished
from doe.workflow.status import inputs_digest
from doe.workflow.surfaces import fit_surfaces, reference_runs
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.files import run_key

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished study: outcome, folder, names of its files."""
    folder = tmp_path_factory.mktemp("study")
    study = Problem.load(short_study(folder))
    outcome = run_study(study, folder, None, lambda title: silent)
    return outcome, folder, write(outcome, folder)["files"]


def test_every_file_is_written(finished):
    outcome, folder, files = finished
    assert outcome.cage_classes == dict.fromkeys(("baseline", "pick"), "not judged")
    assert {"summary.json", "design_runs.csv", "anova.csv", "front.csv", "part_dimensions.csv"} <= set(files)
    assert {"report.html"} <= set(files)
    assert {"pareto_front.png", "cage_orbit.png", "pocket_forces.png"} <= set(files)
    assert sum(name.startswith("surface_") for name in files) == 3
    sheets = pd.read_excel(folder / "tables.xlsx", sheet_name=None)
    assert list(sheets) == ["identity", *(name.removesuffix(".csv") for name in files if name.endswith(".csv"))]
    runs = pd.read_csv(folder / "design_runs.csv")
    pd.testing.assert_frame_equal(sheets["design_runs"], runs, check_dtype=False, rtol=1e-12)
    for name in (name for name in files if not name.endswith(".xlsx")):
        if name.endswith(".png"):
            colours = (255.0 * imread(folder / name)[..., :3]).astype(int) @ [1 << 16, 1 << 8, 1]
            assert np.unique(colours).size > 50, f"{name} is nearly empty"
        else:
            assert (folder / name).read_text(encoding="utf-8").count("\n") > 1, name


def test_a_finished_study_is_not_done_again(finished):
    outcome, folder, _ = finished
    command = [sys.executable, "-m", "doe", "study", str(outcome.study.path), "--out", str(folder)]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "Finished before, nothing has changed since" in shown
    assert f"Why this point: {outcome.pick.reason}." in shown
    asked = inputs_digest(outcome.study)
    assert is_finished(folder, asked)["pick"] == dict(
        zip(outcome.study.factors, outcome.pick.point.tolist(), strict=True)
    )
    assert is_finished(folder, inputs_digest(outcome.study, adaptive=True)) is None
    (folder / "front.csv").rename(folder / "aside.csv")
    assert is_finished(folder, asked) is None
    (folder / "aside.csv").rename(folder / "front.csv")
    for name in ("summary.json", "answer.txt"):
        whole = (folder / name).read_bytes()
        digit = re.search(rb"\d\.\d+", whole).start()
        for spoilt in (
            whole[:digit] + bytes([whole[digit] ^ 1]) + whole[digit + 1 :],
            whole[:digit],
            b"[" * 100_000,
            b"",
        ):
            (folder / name).write_bytes(spoilt)
            assert is_finished(folder, asked) is None, "a record that was changed is not shown as the answer"
        (folder / name).write_bytes(whole)
    assert is_finished(folder, asked) is not None


def test_summary_answers_the_question(finished):
    outcome, folder, _ = finished
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["status"] == "ok"
    assert summary["design"]["runs"] == 20
    assert set(summary["pick"]) == set(outcome.study.factors)
    for gain in summary["gains"].values():
        assert gain["verdict"] in ("better", "worse", "within error")
    parts = summary["chains"]["pocket"]["allocation"]
    width, roller = parts["pocket_width"], parts["roller_diameter"]
    pocket = summary["pick"]["pocket_clearance_mm"]
    assert width["nominal_mm"] + width["upper_mm"] - roller["nominal_mm"] - roller["lower_mm"] == pytest.approx(
        pocket + 0.005, abs=1e-9
    )
    assert width["nominal_mm"] + width["lower_mm"] - roller["nominal_mm"] - roller["upper_mm"] == pytest.approx(
        pocket - 0.005, abs=1e-9
    )


def test_pick_stands_on_the_resolution_of_the_drawing(finished):
    outcome, _, _ = finished
    assert np.allclose(outcome.pick.point * 1000.0, np.round(outcome.pick.point * 1000.0), atol=1e-9)


def test_centre_runs_differ_by_seed_only(finished):
    outcome, _, _ = finished
    centre = np.abs(outcome.runs.coded).max(axis=1) == 0.0
    assert centre.sum() == 6
    assert len(np.unique(outcome.runs.values[centre, 0])) == 6


def test_stands_beside_the_published_table(finished):
    outcome, _, _ = finished
    theirs = reference_runs(outcome.study)
    assert [*outcome.published_comparisons] == outcome.study.responses
    for name, row in outcome.published_comparisons.items():
        column = outcome.study.responses.index(name)
        ranks = [np.argsort(np.argsort(runs.values[:, column])) for runs in (outcome.runs, theirs)]
        assert row.rank_correlation == pytest.approx(np.corrcoef(ranks)[0, 1], abs=2e-2)  # some of theirs are equal
        assert row.verdict.startswith(name)
        assert row.why
    # Table 4 itself: its own mean impact force, and the signs of its own linear effects.
    impact = outcome.published_comparisons["impact_force_N"]
    assert impact.theirs_min_mean_max == pytest.approx((145.6, 203.7, 278.2))
    assert all(effect.theirs > 0.0 and effect.theirs_significant for effect in impact.linear_effects.values())


def test_nothing_runs_twice(finished, monkeypatch):
    outcome, folder, _ = finished

    def refuse(*arguments):
        raise AssertionError("a stored run was simulated again")

    monkeypatch.setattr("rbdyn.dynamics.simulate.simulate", refuse)
    again = run_study(outcome.study, folder, None, lambda title: silent)
    assert np.array_equal(again.runs.values, outcome.runs.values)
    assert np.array_equal(again.pick.values, outcome.pick.values)


def test_same_bits_for_any_number_of_workers(finished, tmp_path):
    outcome, _, _ = finished
    alone = run_design(outcome.study, tmp_path, 1, silent)
    assert np.array_equal(alone.values, outcome.runs.values)


@pytest.mark.slow
def test_killed_study_loses_no_finished_run(finished, tmp_path):
    # Long enough that the kill comes in the middle of it.
    path = short_study(tmp_path, SHORT.replace("turns=3,", "turns=15,"))
    store = tmp_path / "out" / "study.sqlite"
    process = subprocess.Popen(
        [sys.executable, "-m", "doe", "study", str(path), "--out", str(tmp_path / "out"), "--workers", "1"],
        stdout=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 120.0
    while stored(store) < 3 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    survived = rows(store)
    assert 3 <= len(survived) < 1 + 20
    run_design(Problem.load(path), tmp_path / "out", None, silent)
    finished_rows = rows(store)
    # The original, which ran first, and the design.
    assert len(finished_rows) == 1 + 20
    assert survived.items() <= finished_rows.items()


def test_failed_runs_are_grouped_by_cause_and_too_few_left_end_the_study(tmp_path):
    study = Problem.load(short_study(tmp_path, SHORT + ",step_budget_per_turn=100"))
    with pytest.raises(RunError) as refused:
        run_design(study, tmp_path, None, silent)
    sentence = str(refused.value)
    assert sentence.startswith("only 0 of 20 design runs succeeded, but the response models need 11: ")
    # One cause, told once with all its runs.
    assert sentence.count("raise numerics.step_budget_per_turn") == 1
    assert "design run 1, design run 2, " in sentence
    assert stored(tmp_path / "study.sqlite") == 0


@pytest.mark.parametrize(
    ("replace", "words"),
    [
        (('key = "cage.guide_clearance_mm"', 'key = "cage.guide_clearence_mm"'), ("factor.key", "no such key")),
        (('name = "power_loss_W"', 'name = "power_W"'), ("response.name", "did you mean power_loss_W")),
        (('factor = "pocket_clearance_mm"', 'factor = "pocket"'), ("chain.factor", "no such factor")),
        (("half_width_mm = 0.005", "half_width_mm = -0.005"), ("half_width_mm", "greater than 0")),
        (("coefficient = -1.0", "coefficient = 0.0"), ("coefficient", "must not be zero")),
        (("centre = 0.30", "centre = -0.30"), ("cage.pocket_clearance_mm", "greater than 0")),
        (('file = "ccd_table4.csv"', 'file = "nowhere.csv"'), ("nowhere.csv", "no such file")),
        (("[baseline]\n", "[baseline]\nradial = 1.0\n"), ("baseline.radial", "no such factor")),
    ],
)
def test_bad_study_is_refused_before_anything_runs(tmp_path, replace, words):
    with pytest.raises(InputError) as refused:
        run_study(Problem.load(short_study(tmp_path, SHORT, replace)), tmp_path, None, lambda title: silent)
    assert all(word in str(refused.value) for word in words), str(refused.value)
    assert stored(tmp_path / "study.sqlite") == 0


def test_reference_of_another_design_is_refused(tmp_path):
    study = Problem.load(short_study(tmp_path, SHORT, ("centre_replicates = 6", "centre_replicates = 9")))
    with pytest.raises(InputError, match="no run left for the design point"):
        run_study(study, tmp_path, None, lambda title: silent)


def test_front_on_the_published_table_improves_on_its_baseline(tmp_path):
    study = Problem.load(short_study(tmp_path))
    surfaces = fit_surfaces(study, read_runs(study, EXAMPLES / "ccd_table4.csv"))
    record = SurfaceFront.of(study.with_surfaces(surfaces), find_front(study.with_surfaces(surfaces))).as_dict()
    pick, baseline = record["pick"]["responses"], record["baseline"]["responses"]
    assert all(pick[name] <= baseline[name] for name in study.responses)
    assert all(
        record["ideal"][name] <= min(point["responses"][name] for point in record["front"]) + 1e-9
        for name in study.responses
    )


def test_gain_counts_only_beyond_its_error(tmp_path):
    study = Problem.load(short_study(tmp_path))
    none = np.zeros(3)
    baseline = Confirmed(study.baseline, np.array([100.0, 1.0, 50.0]), np.array([3.0, 0.0, 0.0]), none)
    pick = Confirmed(study.baseline, np.array([96.0, 0.9, 51.0]), np.array([4.0, 0.0, 0.0]), none)
    found = gains(study, baseline, pick)
    assert [gain.verdict for gain in found.values()] == ["within error", "better", "worse"]
    gain = found["impact_force_N"]
    assert (gain.percent, gain.error_percent) == (pytest.approx(4.0), pytest.approx(5.0))


def test_key_follows_scene_and_version(tmp_path):
    study = Problem.load(short_study(tmp_path))
    one, two = study.design_scenes(np.array([study.centre, study.centre]))
    keys = {run_key(scene.model_dump(mode="json"), version) for scene in (one, two) for version in "ab"}
    assert len(keys) == 4
    assert run_key(one.model_dump(mode="json"), "a") in keys
