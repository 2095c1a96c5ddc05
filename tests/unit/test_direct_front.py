"""The script that searches the front of the simulator itself: same runs again, failures, what its runs are, what it compares."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from types import SimpleNamespace

import direct_front
import numpy as np
import pytest
from conftest import ROOT
from direct_search import SurrogateLoss
from doe_command import doe
from instant_runs import instantly
from short_studies import SHORT, rows, short_study, silent, stored

from doe.clearance import Simulations
from doe.pareto import Goals
from doe.running.store import STORE, Store
from doe.workflow.front import find_front
from doe.workflow.problem import Problem
from doe.workflow.runs import read_runs
from doe.workflow.surfaces import fit_surfaces
from rbdyn.base.faults import InputError

BRIEF = direct_front.Settings(60, 8, 2, turns=3.0, discard_turns=1.0, set=["numerics.impact_window_turns=1"])


def simulations(store: Store) -> Simulations:
    """Where points run, with nobody watching."""
    return Simulations(store, None, None, False, lambda title: silent)


@pytest.mark.slow
def test_direct_front_asks_for_the_same_runs_again_and_survives_failures(tmp_path, monkeypatch):
    study = Problem.load(short_study(tmp_path))
    front = find_front(study, fit_surfaces(study, read_runs(study, tmp_path / "ccd_table4.csv")))
    with Store(tmp_path / STORE) as store:
        first = direct_front.find_direct(study, BRIEF, front, simulations(store))
        stored = len(store.ended())
        again = direct_front.find_direct(study, BRIEF, front, simulations(store))
        assert (
            len(store.ended())
            == stored
            == first.front.evaluations + len(first.surrogate_points) * (first.front.repeats)
        )
    assert 40 <= first.front.evaluations <= 60
    assert np.array_equal(first.front.values, again.front.values)
    assert np.array_equal(first.front.points, again.front.points)
    assert isinstance(first.loss, SurrogateLoss) and not first.failures
    record = direct_front.record_of(study, BRIEF, first)
    assert len(record["front"]) == len(first.front.points) == len(record["surrogate_front"])
    assert list(record["pick"]["factors"]) == study.factors
    assert list(record["front"][0]["errors"]) == study.responses

    usual = direct_front.scenes

    def some_break(study, settings, points, first):
        scenes = usual(study, settings, points, first)
        for row in range(0, len(scenes), 5):
            scene = scenes[row]
            scenes[row] = scene.model_copy(
                update={"numerics": scene.numerics.model_copy(update={"step_budget_per_turn": 2})}
            )
        return scenes

    monkeypatch.setattr(direct_front, "scenes", some_break)
    with Store(tmp_path / "other.sqlite") as store:
        evaluate = direct_front.Generations(study, BRIEF, simulations(store), silent)
        values, errors = evaluate(np.tile(study.baseline, (10, 1)))
    assert np.isnan(values[[0, 5]]).all() and np.isfinite(np.delete(values, [0, 5], axis=0)).all()
    assert np.isfinite(np.delete(errors, [0, 5], axis=0)).all()
    assert ["step budget" in failure.cause for failure in evaluate.failures] == [True, True]


def test_runs_are_as_long_as_design_runs_and_stated_in_words(tmp_path):
    study, usual = Problem.load(short_study(tmp_path)), direct_front.Settings()
    (scene,) = direct_front.scenes(study, usual, study.baseline[None], 0)
    assert (scene.numerics.turns, scene.numerics.discard_turns, scene.numerics.replicates) == (3, 1, 3)
    assert "3 replicates of 3 counted shaft turns (3 whole windows" in direct_front.run_in_words(study, usual)


def test_runs_without_a_whole_window_of_the_impact_are_refused(tmp_path):
    study = Problem.load(short_study(tmp_path, SHORT.replace(",impact_window_turns=1", "")))
    direct_front.check(study, direct_front.Settings(turns=100.0))
    with pytest.raises(InputError, match=r"--turns: 9 counted turns hold no impact window of .*; give .* at least"):
        direct_front.check(study, direct_front.Settings(turns=10.0, discard_turns=1.0))
    with pytest.raises(InputError, match=r"--discard-turns 3: must be below --turns 3"):
        direct_front.check(study, direct_front.Settings(turns=3.0, discard_turns=3.0))


def test_script_writes_its_record_and_compares_a_search_in_few_runs(tmp_path, monkeypatch, capsys):
    """The whole script, its runs made up: an adaptive front that is the direct one reaches all of it."""
    instantly(monkeypatch.setattr)
    goal = 'name = "whirl_deviation_ratio"\nmodel = "quadratic"\ngoal = '
    path, out = short_study(tmp_path, SHORT, (f'{goal}"min"', f'{goal}"max"')), tmp_path / "out"
    brief = [str(path), "--out", str(out), "--workers", "1", "--evaluations", "200", "--population", "16"]
    assert direct_front.main(brief) == 0
    alone = json.loads((out / "direct_front.json").read_text())
    assert alone["adaptive"] is None and len(alone["front"]) == len(alone["surrogate_front"]) > 1
    assert 0.9 * 200 < alone["evaluations"] <= 200
    summary = {"adaptive": {"front": alone["front"], "runs": 80, "fresh": 20}}
    (out / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    assert direct_front.main(brief) == 0
    share = json.loads((out / "direct_front.json").read_text())["adaptive"]
    assert share["runs"] == 100 and share["share"] == pytest.approx(1.0, abs=0.1 + share["error"])
    assert "The adaptive search of 100 runs reaches " in capsys.readouterr().out
    assert direct_front.main([*brief, "--evaluations", "50"]) == 2
    assert "direct front: evaluations = 50: must be at least five populations (80)" in capsys.readouterr().err


def test_oracle_share_of_a_front_that_covers_half(tmp_path):
    """Oracle: of the corner (0, 0) on a common scale a point half-way in one cost covers the known share, its errors none."""
    study = SimpleNamespace(responses=["a", "b"])
    goals = Goals.of(["min", "min"])
    front = SimpleNamespace(
        costs=np.array([[0.0, 1.0], [1.0, 0.0]]), cost_errors=np.zeros((2, 2)), goals=goals, seed=1
    )  # fmt: skip
    points = [{"responses": {"a": 0.0, "b": 1.0}, "errors": {"a": 0.0, "b": 0.0}}]
    summary = {"adaptive": {"front": points, "runs": 5, "fresh": 1}}
    found = direct_front.share_of_adaptive(study, front, summary)
    # With the reference at 1.1 the two cover 2 x 0.11 - 0.01 = 0.21, the one 0.11.
    assert found["share"] == pytest.approx(0.11 / 0.21, rel=0.02) and found["error"] == 0.0 and found["runs"] == 6
    assert direct_front.share_of_adaptive(study, front, {}) is None


@pytest.mark.slow
def test_direct_front_killed_in_its_search_resumes_with_the_same_bits(tmp_path):
    short = SHORT.replace("turns=3,", "turns=12,")
    path = short_study(tmp_path, short)
    sizes = {"evaluations": 60, "population": 8, "replicates": 2, "turns": 13, "discard-turns": 1, "workers": 1}

    def begin(out: str) -> subprocess.Popen:
        brief = [word for name, size in sizes.items() for word in (f"--{name}", str(size))]
        command = [sys.executable, direct_front.__file__, str(path), *brief, "--out", str(tmp_path / out)]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL)

    assert begin("whole").wait(600) == 0
    store = tmp_path / "out" / "study.sqlite"
    for count in (30, 55):
        process = begin("out")
        deadline = time.monotonic() + 300.0
        while stored(store) < count and time.monotonic() < deadline:
            time.sleep(0.01)
        process.kill()
        process.wait()
        survived = rows(store)
        # In the midst of the search: after the 20 design runs, before the 60 evaluations are done.
        assert count <= len(survived) < 80
    assert begin("out").wait(600) == 0
    ended = rows(store)
    assert survived.items() <= ended.items() and ended.keys() == rows(tmp_path / "whole" / "study.sqlite").keys()
    one, two = (json.loads((tmp_path / out / "direct_front.json").read_text()) for out in ("whole", "out"))
    assert one.pop("seconds") != two.pop("seconds")
    del one["comparison_seconds"], two["comparison_seconds"]
    assert one == two


@pytest.mark.parametrize("command", ["study", "front"])
def test_former_option_is_refused_by_the_name_of_the_script(command, tmp_path):
    ended = doe(command, str(tmp_path / "study.toml"), "--direct", "--json")
    (fault,) = json.loads(ended.stdout)["faults"]
    assert ended.returncode == 2 and fault == ended.stderr.strip()
    script = fault.partition("run python ")[2].split()[0]
    assert fault.startswith("--direct: this option was removed") and (ROOT / script).samefile(direct_front.__file__)
