"""What a study survives: failed points, Ctrl-C, kill -9, a full disk, a second process on the same study, edits.

The simulations take no time here; the same with real ones stands in ``test_study``.
"""

import json
import os
import re
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from instant_runs import instantly
from short_studies import SHORT, run_design, short_study, silent, stored

from doe import clearance
from doe.clearance import Simulations
from doe.running.store import STORE, Store
from doe.workflow.confirmation import Choice, Confirmed, confirm, simulate_original
from doe.workflow.problem import Problem
from doe.workflow.status import study_status
from doe.workflow.surfaces import reference_runs
from rbdyn.base.faults import RunError
from rbdyn.base.files import digest_of

CENTRES = range(15, 21)


def seeds_run(store: Path) -> list[int]:
    """Seeds of the finished runs."""
    with Store(store, read_only=True) as opened:
        keys = [run.key for run in opened.ended() if run.status == "done"]
        return sorted(opened.get(key)["seed"] for key in keys)


def start(study: Path, out: Path, seconds: float, workers: int, *options: str, **how) -> subprocess.Popen:
    """The design in a process of its own, on simulations that take so long."""
    program = Path(__file__).parents[1] / "helpers" / "instant_runs.py"
    command = [sys.executable, str(program), str(seconds), str(study), str(out), str(workers), *options]
    # Where the tests run in the background of a shell, Ctrl-C is switched off and that is inherited.
    how = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.default_int_handler), **how}
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how)


def wait_for(condition, seconds: float = 60.0) -> None:
    """Until something is so."""
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert condition()


def test_failed_points_are_left_out_told_and_not_tried_again_unless_asked(tmp_path, monkeypatch):
    study = Problem.load(short_study(tmp_path))
    ran = instantly(monkeypatch.setattr, faulty=(3, 18, 19))
    runs = run_design(study, tmp_path, 2, silent)
    assert sorted(ran) == list(range(1, 21))
    assert len(runs.coded) == len(runs.actual) == len(runs.values) == len(runs.errors) == 17
    assert runs.replicates is not None and runs.replicates.shape == (17, 3)
    assert [failure.run for failure in runs.failures] == [3, 18, 19]
    assert runs.failures[0].factors == pytest.approx(
        {"radial_clearance_mm": 0.015, "guide_clearance_mm": 0.2, "pocket_clearance_mm": 0.25}
    )
    assert runs.places == [place for place in range(20) if place + 1 not in (3, 18, 19)]
    (note,) = runs.notes
    assert note.startswith("3 design runs failed and are left out: design run 3, design run 18, design run 19: ")
    assert note.count("the oil froze") == 1
    ran.clear()
    again = run_design(study, tmp_path, 2, silent)
    assert ran == [] and again.failures == runs.failures and np.array_equal(again.values, runs.values)
    thawed = instantly(monkeypatch.setattr)
    mended = run_design(study, tmp_path, 2, silent, retry=True)
    assert sorted(thawed) == [3, 18, 19] and not mended.failures and len(mended.coded) == 20


def test_a_study_of_the_life_says_what_plain_rollers_leave_out(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr)
    life = ("[confirmation]", '[[response]]\nname = "life_h"\ngoal = "max"\n\n[confirmation]')
    path = short_study(tmp_path, replace=life)
    texts = [note for note in run_design(Problem.load(path), tmp_path, 2, silent).notes if note.startswith("life_h: ")]
    assert len(texts) == 1 and texts[0].code == "omission" and "half to a fifth" in texts[0]
    path.write_text(path.read_text("utf-8").replace(*life[::-1]), "utf-8")
    assert not any("life_h" in note for note in run_design(Problem.load(path), tmp_path, 2, silent).notes)
    scene = tmp_path / "cylindrical_roller.toml"
    profiled = scene.read_text("utf-8").replace("[bearing]\n", '[bearing]\nroller_profile = "logarithmic"\n')
    scene.write_text(profiled, "utf-8")
    path.write_text(path.read_text("utf-8").replace(*life), "utf-8")
    assert not any("life_h" in note for note in run_design(Problem.load(path), tmp_path, 2, silent).notes)


def test_published_table_loses_the_rows_of_failed_runs(tmp_path, monkeypatch):
    study = Problem.load(short_study(tmp_path))
    instantly(monkeypatch.setattr, faulty=(2, 5))
    runs, table = run_design(study, tmp_path, 2, silent), reference_runs(study)
    assert table is not None
    assert np.allclose(table.only(runs.places).actual, runs.actual, atol=2e-3)
    assert np.array_equal(table.only(runs.places).values[:3], table.values[[0, 2, 3]])


def test_confirmation_that_fails_ends_the_study_in_a_sentence(tmp_path, monkeypatch):
    study = Problem.load(short_study(tmp_path))
    instantly(monkeypatch.setattr, faulty=(1 + clearance.CONFIRMATION_SEEDS,))
    with Store(tmp_path / STORE) as store:
        simulations = Simulations(store, 2, None, False, lambda title: silent)
        with pytest.raises(RunError, match=r"^the baseline design cannot be simulated: baseline: .*the oil froze$"):
            simulate_original(study, simulations)
        original = Confirmed(study.baseline, *np.ones((3, 3)))
        with pytest.raises(RunError, match=r"^confirmation of the selected design: .*the oil froze$"):
            confirm(study, original, {"pick": Choice(study.baseline * 1.1, "why not")}, simulations)
    with Store(tmp_path / STORE, read_only=True) as store:
        assert [run.status for run in store.ended()] == ["failed", "failed"]


def test_unexpected_fault_of_a_run_is_a_failure_too(tmp_path, monkeypatch):
    study = Problem.load(short_study(tmp_path))
    instantly(monkeypatch.setattr)
    from rbdyn.dynamics import simulate as module

    instant = module.simulate

    def sometimes(scene, *rest, **more):
        if scene.numerics.seed == 4:
            raise ZeroDivisionError("division by zero")
        return instant(scene, *rest, **more)

    monkeypatch.setattr(module, "simulate", sometimes)
    runs = run_design(study, tmp_path, 1, silent)
    assert [failure.cause for failure in runs.failures] == ["unexpected ZeroDivisionError: division by zero"]


@pytest.mark.parametrize(
    ("replace", "again"),
    [
        (("centre_replicates = 6", "centre_replicates = 9"), [21, 22, 23]),
        (('model = "linear"', 'model = "quadratic"'), []),
        (("population = 100", "population = 60"), []),
        (("resolution = 0.001", "resolution = 0.002"), []),
        # Cube and axial points move, the axial ones of the other factors and the centre do not.
        (("centre = 0.15\nstep = 0.05", "centre = 0.15\nstep = 0.04"), [*range(1, 9), 11, 12]),
        (("centre = 0.30\nstep = 0.05", "centre = 0.31\nstep = 0.05"), list(range(1, 21))),
        (("numerics.turns=3", "numerics.turns=4"), list(range(1, 21))),
    ],
)
def test_edited_study_runs_only_what_changed(tmp_path, monkeypatch, replace, again):
    path = short_study(tmp_path)
    ran = instantly(monkeypatch.setattr)
    run_design(Problem.load(path), tmp_path, 2, silent)
    ran.clear()
    text = path.read_text(encoding="utf-8")
    assert replace[0] in text
    path.write_text(text.replace(*replace), encoding="utf-8")
    run_design(Problem.load(path), tmp_path, 2, silent)
    assert sorted(ran) == again


def test_other_code_runs_everything_again_also_what_failed(tmp_path, monkeypatch):
    study = Problem.load(short_study(tmp_path))
    instantly(monkeypatch.setattr, faulty=(6,))
    assert run_design(study, tmp_path, 2, silent).failures
    monkeypatch.setattr("rbdyn.base.files.source_digest", lambda *roots: "edited")
    ran = instantly(monkeypatch.setattr)
    assert not run_design(study, tmp_path, 2, silent).failures
    assert sorted(ran) == list(range(1, 21))


def test_second_process_on_a_folder_is_refused_and_the_first_goes_on(tmp_path):
    """One sentence that names the process, exit code 2; the first ends as if nobody had asked."""
    study, out = short_study(tmp_path), tmp_path / "out"
    first = start(study, out, 0.05, 1, "--whole")
    wait_for(lambda: (out / STORE).exists() and len(seeds_run(out / STORE)) > 0)
    first.send_signal(signal.SIGSTOP)  # however long the second takes to start, the first is at work
    second = start(study, out, 0.05, 1, "--whole")
    shown, said = second.communicate(timeout=100)
    first.send_signal(signal.SIGCONT)
    assert (
        second.returncode == 2 and f"process {first.pid} on " in said and "works in it; wait until it has ended" in said
    )
    (fault,) = json.loads(shown)["faults"]
    assert fault in said
    shown, said = first.communicate(timeout=100)
    assert first.returncode == 0, said
    assert len(json.loads(said.splitlines()[-1])) == len(seeds_run(out / STORE)) > 20
    assert not list(out.glob("*.partial"))


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_study_killed_in_its_confirmation_is_unfinished_and_nothing_runs(tmp_path, workers):
    path, out = short_study(tmp_path), tmp_path / "out"
    process, study = start(path, out, 0.5, workers, "--whole"), Problem.load(path)

    def status() -> dict:
        return study_status(study, out)

    wait_for(lambda: (out / STORE).exists() and status()["stage"] == "confirmation" and status()["running"] != [])
    before = status()
    process.send_signal(signal.SIGKILL)
    process.communicate()
    after = status()
    assert before["status"] == "running" and len(before["running"]) <= workers
    assert after["status"] == "unfinished" and after["stage"] == "confirmation"
    assert after["running"] == [] and after["points"]["done"] == 20 and not (out / "summary.json").exists()


def spoil(store: Path, key: str, **values) -> None:
    """Write something else into the row of a run."""
    with sqlite3.connect(store) as connection:
        connection.execute(
            f"UPDATE runs SET {', '.join(f'{name} = :{name}' for name in values)} WHERE key = :key",
            {**values, "key": key},
        )


def test_rows_that_are_no_results_run_again_with_one_sentence(tmp_path, monkeypatch, capsys):
    study = Problem.load(short_study(tmp_path))
    ran = instantly(monkeypatch.setattr)
    run_design(study, tmp_path, 1, silent)
    with Store(tmp_path / STORE, read_only=True) as store:
        by_seed = {store.get(run.key)["seed"]: run.key for run in store.ended()}
        whole = store.get(by_seed[5])
    without = {name: part for name, part in whole.items() if name != "power_loss_W"}
    typed = {**whole, "power_loss_W": {**whole["power_loss_W"], "value": "much"}}
    faulty: list[object] = [{}, [], None, without, typed, {**whole, "cage_slip": None}, {**whole, "loads": 3}]
    for seed, record in enumerate(faulty, 1):
        text = json.dumps(record)
        spoil(tmp_path / STORE, by_seed[seed], result=text, digest=digest_of(text))
    spoil(tmp_path / STORE, by_seed[8], result=None)
    spoil(tmp_path / STORE, by_seed[9], result="{", digest=digest_of("{"))
    spoil(tmp_path / STORE, by_seed[10], result=b"\xff\x00")
    ran.clear()
    capsys.readouterr()
    assert study_status(study, tmp_path)["points"]["missing"] == 10
    labels = ", ".join(f"design run {run}" for run in range(1, 11))
    sentence = f"{tmp_path / STORE}: kept results that cannot be read count as not done: {labels}\n"
    assert capsys.readouterr().err == sentence
    runs = run_design(study, tmp_path, 1, silent)
    assert sorted(ran) == list(range(1, 11)) and not runs.failures
    assert capsys.readouterr().err == sentence


def test_what_a_killed_process_had_under_way_is_run_by_the_next(tmp_path, monkeypatch):
    study, out = short_study(tmp_path), tmp_path / "out"
    slow = start(study, out, 300.0, 20)
    wait_for(lambda: (out / STORE).exists() and study_status(Problem.load(study), out)["points"]["running"] == 20)
    os.kill(slow.pid, signal.SIGKILL)
    slow.communicate()
    status = study_status(Problem.load(study), out)
    assert status["points"]["running"] == 0 and status["points"]["missing"] == 20
    ran = instantly(monkeypatch.setattr)
    runs = run_design(Problem.load(study), out, 2, silent)
    assert sorted(ran) == list(range(1, 21)) and len(runs.coded) == 20


def test_ctrl_c_keeps_what_was_finished_and_gives_back_the_rest(tmp_path):
    study, out = short_study(tmp_path), tmp_path / "out"
    process = start(study, out, 0.4, 2)
    wait_for(lambda: stored(out / STORE) >= 3)
    process.send_signal(signal.SIGINT)
    shown, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert json.loads(shown) == {"status": "interrupted"}
    assert said.strip() == f"interrupted; finished parts are saved in {out / STORE}; start the command again to resume"
    status = study_status(Problem.load(study), out)
    assert status["points"]["running"] == 0 and status["status"] == "unfinished"
    assert 3 <= status["points"]["done"] == len(seeds_run(out / STORE)) < 20


def test_full_disk_is_one_sentence_and_the_study_goes_on_later(tmp_path):
    study, out = short_study(tmp_path), tmp_path / "out"
    limit = 250_000
    full = start(study, out, 0.0, 2, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    shown, said = full.communicate(timeout=60)
    assert full.returncode == 1, said
    assert re.fullmatch(
        r"\S+study\.sqlite: cannot be written \(.*\); finished runs are kept: free space .*", said.strip()
    )
    assert json.loads(shown)["status"].startswith("failed: ")
    kept = seeds_run(out / STORE)
    assert 3 <= len(kept) < 20
    resumed = start(study, out, 0.0, 2)
    shown, said = resumed.communicate(timeout=120)
    assert resumed.returncode == 0, said
    assert len(seeds_run(out / STORE)) == 20
    with Store(out / STORE, read_only=True) as store:
        # The finished ones were not run again: they ended first.
        assert sorted(store.get(run.key)["seed"] for run in store.ended()[: len(kept)]) == kept


def test_scenes_of_the_same_laws_are_prepared_once(tmp_path, monkeypatch):
    from rbdyn.dynamics import simulate as module

    study = Problem.load(short_study(tmp_path, SHORT))
    prepared = []

    def prepare(scene, bearing):
        prepared.append(scene)
        return 1.0

    monkeypatch.setattr(module, "prepare", prepare)
    monkeypatch.setattr(module, "_prepared", set())
    scenes = study.design_scenes(np.array([study.centre, 1.1 * study.centre]))
    one, two = (module.simulate(scene, 1) for scene in scenes)
    assert prepared == scenes[:1]
    # What the values of the first run compile comes on top.
    assert one.cost["compile_s"] >= 1.0 and two.cost["compile_s"] == 0.0
