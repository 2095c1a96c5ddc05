"""``doe status``: counts, causes, who runs what, time left; it changes nothing."""

import json
import os
import subprocess
import sys
import threading
import time
from datetime import datetime
from pathlib import Path

import pytest
import typer
from doe_command import doe, doe_process, invoke, loaded_by
from instant_runs import instantly
from short_studies import run_design, short_study, silent
from synthetic_study import summary as made_up
from typer.testing import CliRunner

from doe import clearance
from doe import run as run_table
from doe.cli import app
from doe.commands.functions import status_blocks
from doe.running.runner import Stage, agenda_in
from doe.running.store import STALE_S, STORE, Point, Store, at_work
from doe.workflow.problem import Problem
from doe.workflow.status import content_digest, inputs_digest, scene_status, status_of, study_stages, study_status
from rbdyn.base.blocks import Detail
from rbdyn.base.faults import InputError, read_toml
from rbdyn.base.files import digest_of, sign
from rbdyn.base.terminal import show
from rbdyn.dynamics import simulate as module


def files(folder: Path) -> dict[str, tuple[int, float]]:
    """Sizes and times of the files of a folder, but for the locks of those who read the store."""
    return {
        file.name: (file.stat().st_size, file.stat().st_mtime)
        for file in folder.iterdir()
        if not file.name.endswith("-shm")
    }


def test_study_that_never_ran_is_all_missing(tmp_path):
    study = Problem.load(short_study(tmp_path))
    record = study_status(study, tmp_path / "nowhere")
    assert record["points"] == {"total": 20, "done": 0, "failed": 0, "running": 0, "missing": 20}
    assert record["status"] == "unfinished" and record["runs_left"] == [22, 25]
    assert not (tmp_path / "nowhere").exists()


def test_running_study_tells_who_runs_what_and_what_is_to_come(tmp_path, monkeypatch, capsys):
    study = Problem.load(short_study(tmp_path))
    instantly(monkeypatch.setattr, seconds=0.02, faulty=(2, 4))
    records, passed, begun = {}, {}, time.perf_counter()

    def look(done: int, total: int) -> None:
        if done in (0, 8, 20):
            passed.setdefault(done, time.perf_counter() - begun)
            records.setdefault(done, study_status(study, tmp_path))

    options = {"adaptive": False, "robust": False}
    with agenda_in(tmp_path / STORE, "doe study", 2, options, inputs_digest(study, **options)) as keeper:
        keeper.plan(study_stages(study))
        run_design(study, tmp_path, 2, keeper.announced(lambda title: look)("design runs"), agenda=keeper)
    first, middle, last = records.values()
    assert first["points"]["missing"] == 20 and first["status"] == "running"
    points = middle["points"]
    assert middle["status"] == "running" and 6 <= points["done"] <= 8 and points["failed"] == 2
    # A thread may just be between two runs.
    assert 0 <= points["running"] <= 2 and sum(points.values()) == 2 * points["total"]
    for claim in middle["running"]:
        assert claim["pid"] == os.getpid() and claim["label"] == f"design run {claim['run']}"
        assert abs(datetime.fromisoformat(claim["since"]).timestamp() - time.time()) < 60.0
    # Two threads, runs of 0.02 s and more: 8 or a few more have ended, the others and the confirmation are left.
    assert 8 * 0.02 <= middle["spent_s"] <= 2.5 * passed[8]
    assert 1 <= middle["runs_left"][0] <= 12 + 1 and middle["runs_left"][1] - middle["runs_left"][0] == 3
    (group,) = middle["failures"]
    assert group["runs"] == [2, 4] and "the oil froze" in group["cause"]
    # The answer is not written, and the confirmation has not begun.
    assert last["status"] == "running" and last["runs_left"] == [1, 4]
    assert last["points"] == {"total": 20, "done": 18, "failed": 2, "running": 0, "missing": 0}
    show(status_blocks(middle))
    shown = capsys.readouterr().out
    assert (
        f"{points['done']} done, 2 failed" in shown
        and "6 steps: baseline 0, design runs" in shown
        and "confirmation 0 of 4, tolerances, answer" in shown
        and "Failed: design run 2, design run 4: " in shown
        and "; runs to come " in shown
    )


def test_command_reads_only_and_loads_no_compiler(tmp_path, monkeypatch):
    path = short_study(tmp_path)
    out = tmp_path / "study_results"
    out.mkdir()
    instantly(monkeypatch.setattr)
    run_design(Problem.load(path), out, 2, silent)
    with Store(out / STORE) as store:
        store.put("a confirmation", {})
        store.begin(Point("another", "pick"))
        before = files(out)
        monkeypatch.chdir(tmp_path)
        shown = doe_process("status", "study.toml", "--json")
        assert files(out) == before
    record = json.loads(shown.stdout)
    assert shown.returncode == 0 and shown.stderr == ""
    assert set(record) == {
        "format", "status", "study", "store", "points", "failures", "running", "other", "spent_s", "command", "stage",
        "stages", "stopped_by", "runs_left",
    }  # fmt: skip
    # A run of a live process is seen, whatever it is for.
    assert record["points"]["done"] == 20 and record["status"] == "running"
    assert record["other"] == {"done": 1, "failed": 0, "running": 1}
    words = doe_process("status", "study.toml").stdout
    assert "20 done, 0 failed, 0 running, 0 to come" in words and "Other runs: 1 done" in words
    assert loaded_by(invoke("status", "study.toml")) == set()


def test_what_is_no_store_is_refused(tmp_path):
    path = short_study(tmp_path)
    (tmp_path / STORE).write_text("nothing that anybody could read as a database " * 50)
    shown = doe("status", str(path), "--out", str(tmp_path), "--json")
    assert shown.returncode == 2
    assert json.loads(shown.stdout)["faults"] == shown.stderr.strip().splitlines()
    assert "cannot be used as a store of runs" in shown.stderr


def test_a_running_study_is_found_by_its_file(tmp_path, monkeypatch):
    """Wherever its folder is; two are both named; a process that was killed counts no more."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = short_study(tmp_path)
    far, other = tmp_path / "far", tmp_path / "other"

    def asked() -> str:
        shown = doe("status", str(path), "-q")
        return shown.stdout + shown.stderr

    far.mkdir()
    other.mkdir()
    assert "Nothing has run yet in study_results" in asked()
    with at_work(path, far / STORE), Store(far / STORE):
        assert str(far / STORE) in asked()
        with at_work(path.parent / "cylindrical_roller.toml", other / STORE), Store(other / STORE):
            assert str(far / STORE) in asked()
        with at_work(path, other / STORE), Store(other / STORE):
            assert f"runs in {far} and in {other}; name one of them by --out" in asked()
    killed = f"from doe.running.store import *; import os\nwith at_work(Path({str(path)!r}), Path('x')): os._exit(0)"
    subprocess.run([sys.executable, "-c", killed], check=True)
    (left,) = (tmp_path / "cache" / "rbdyn" / "at_work").iterdir()
    assert "study_results" in asked()
    long_ago = time.time() - 2.0 * STALE_S
    os.utime(left, (long_ago, long_ago))
    with at_work(path, far / STORE):
        assert not left.exists()
    assert not list(left.parent.iterdir())


class Killed(BaseException):
    """What no command catches: the process ends with nothing cleaned up but its memory."""


def killed_in(monkeypatch, seeds_from: int, after: int = 0) -> None:
    """Let the process die in a run whose seed is that large, once so many such runs have ended."""
    instantly(monkeypatch.setattr, seconds=0.002)
    instant, ended = module.simulate, []

    def simulate(scene, *rest, **more):
        if scene.numerics.seed >= seeds_from:
            if len(ended) >= after:
                raise Killed
            ended.append(scene)
        return instant(scene, *rest, **more)

    monkeypatch.setattr(module, "simulate", simulate)


def study_command(path: Path, out: Path, **options) -> None:
    """``doe study`` in this process."""
    from doe.commands.functions import study

    study(path, out, workers=1, quiet=True, **options)


@pytest.mark.parametrize(
    ("options", "seeds", "after", "stage"),
    [
        ({}, clearance.CONFIRMATION_SEEDS, 0, "baseline"),
        # The run of the baseline is the first of the confirmation's.
        ({}, 10, 1, "design runs"),
        ({}, clearance.CONFIRMATION_SEEDS, 1, "confirmation"),
        ({"adaptive": True}, clearance.ADAPTIVE_SEEDS, 0, "adaptive front"),
        ({"robust": True}, clearance.INPUT_SEEDS, 0, "robust"),
    ],
)
def test_study_killed_in_any_stage_is_unfinished_there_and_nothing_runs(
    tmp_path, monkeypatch, options, seeds, after, stage
):
    path = short_study(tmp_path)
    killed_in(monkeypatch, seeds, after)
    with pytest.raises(Killed):
        study_command(path, tmp_path / "out", **options)
    record = study_status(Problem.load(path), tmp_path / "out")
    assert record["status"] == "unfinished" and record["stage"] == stage
    assert record["points"]["running"] == 0 and record["running"] == []
    assert record["command"] == " ".join(["doe study", *(f"--{each}" for each in options)])
    done = {each["name"]: (each["done"], each["runs"]) for each in record["stages"]}
    assert done["design runs"][0] == record["points"]["done"] and done[stage][0] < done[stage][1]
    assert list(done)[-1] == "answer"


def test_study_is_finished_once_its_answer_is_written_and_no_longer_when_that_is_gone(tmp_path, monkeypatch, capsys):
    path, out = short_study(tmp_path), tmp_path / "out"
    killed_in(monkeypatch, 10**9)
    monkeypatch.setattr("doe.report.files.write", lambda outcome, folder: looked(outcome, folder))
    seen = []

    def looked(outcome, folder):
        seen.append(study_status(outcome.study, out))
        (folder / "answer.txt").write_text("none", encoding="utf-8")
        record = made_up() | {
            "inputs": outcome.inputs,
            "files": ["summary.json", "answer.txt"],
            "answer_sha256": digest_of(b"none"),
        }
        sign(record)
        (folder / "summary.json").write_text(json.dumps(record), encoding="utf-8")
        return record

    study_command(path, out)
    (before,) = seen
    assert before["status"] == "running" and before["stage"] == "answer"
    record = study_status(Problem.load(path), out)
    assert record["status"] == "finished" and record["runs_left"] == [0, 0] and record["stage"] is None
    capsys.readouterr()
    show(status_blocks(record), Detail.LEAST)
    assert "finished; of 20 design points 20 done" in capsys.readouterr().out
    (out / "answer.txt").unlink()
    assert study_status(Problem.load(path), out)["status"] == "unfinished"


@pytest.mark.parametrize("workers", [1, 2])
def test_as_many_runs_are_under_way_as_are_running(tmp_path, monkeypatch, workers):
    study, counts, active = Problem.load(short_study(tmp_path)), [], [0]
    instantly(monkeypatch.setattr)
    instant, lock = module.simulate, threading.Lock()

    def simulate(scene, *rest, **more):
        with lock:
            active[0] += 1
        time.sleep(0.01)
        with lock:
            counts.append((study_status(study, tmp_path)["points"]["running"], active[0]))
            result = instant(scene, *rest, **more)
            active[0] -= 1
        return result

    monkeypatch.setattr(module, "simulate", simulate)
    run_design(study, tmp_path, workers, silent)
    # A run whose result is being stored still counts as under way.
    assert len(counts) == 20 and all(active <= running <= workers for running, active in counts)


def test_time_left_is_that_of_all_stages_known_to_come(tmp_path):
    path = short_study(tmp_path)
    study = Problem.load(path)
    plain = {each.name: each for each in study_stages(study)}
    assert list(plain) == ["baseline", "design runs", "front", "confirmation", "tolerances", "answer"]
    # 20 runs of 2 replicates and 4 turns; 5 points of 2 replicates with a companion, the baseline first.
    assert plain["design runs"].work == 20 * 2 * 4 and plain["confirmation"].work == 4 * 3 * 4
    assert plain["baseline"].work == 3 * 4
    searched = {each.name: each for each in study_stages(study, adaptive=True, robust=True)}
    assert searched["adaptive front"].runs == study.file.adaptive.budget - 20
    sets = study.file.robust.points
    assert searched["robust"].runs >= 2 * sets * (1 + study.file.robust.settle) + sets


def test_uncertainty_of_a_scene_has_a_status_too(tmp_path, monkeypatch, capsys):
    from doe.commands.functions import uncertainty

    path, out = short_study(tmp_path).with_name("cylindrical_roller.toml"), tmp_path / "scene"
    assert "bearing" in read_toml(path)
    killed_in(monkeypatch, clearance.INPUT_SEEDS, after=5)
    with pytest.raises(Killed):
        uncertainty(path, 16, out=out, workers=1, quiet=True)
    record = scene_status(path, out)
    assert record["status"] == "unfinished" and record["stage"] in ("screening", "input sets")
    assert record["points"]["done"] == 6 and record["points"]["missing"] >= 16 - 5
    assert record["points"]["total"] == sum(record["points"][kind] for kind in ("done", "failed", "running", "missing"))
    show(status_blocks(record), Detail.LEAST)
    assert "unfinished, ended in stage" in capsys.readouterr().out


def test_finished_uncertainty_is_so_until_its_scene_changes(tmp_path, monkeypatch):
    path, out = short_study(tmp_path).with_name("cylindrical_roller.toml"), tmp_path / "scene"
    out.mkdir()
    with agenda_in(out / STORE, "doe uncertainty", 2, inputs=content_digest(path)) as keeper:
        keeper.plan([Stage.of("input sets", 16, 8.0)])
        keeper.announced(lambda title: silent)("input sets")
        count = keeper.counting({str(key): 8.0 for key in range(16)}, silent)
        count(10, 16)
        assert scene_status(path, out)["points"] == {"total": 16, "done": 10, "failed": 0, "running": 0, "missing": 6}
        assert scene_status(path, out)["status"] == "running"
        (out / "uncertainty.json").write_text("{}")
        count(16, 16)
        keeper.finish(["uncertainty.json"])
        assert scene_status(path, out)["status"] == "finished"
    assert scene_status(path, out)["status"] == "finished" and scene_status(path, out)["runs_left"] == [0, 0]
    path.write_text(path.read_text(encoding="utf-8") + "\n# another\n", encoding="utf-8")
    assert scene_status(path, out)["status"] == "unfinished"


def test_command_line_status_of_a_table_of_scenes(tmp_path, monkeypatch):
    """Command line: a table is found in its folder, unfinished while rows are missing; one that is missing is named."""
    scene = short_study(tmp_path).with_name("cylindrical_roller.toml")
    table, out = tmp_path / "table.csv", tmp_path / "table_results"
    table.write_text("seed\n1\n2\n3\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    instantly(monkeypatch.setattr, faulty=[2])
    run_table(table, scene, out=out, workers=1)
    record = status_of(table, None)
    assert record["status"] == "finished" and record["study"] == str(table)
    assert record["points"] == {"total": 3, "done": 2, "failed": 1, "running": 0, "missing": 0}
    (out / "runs.csv").unlink()
    assert status_of(table, out)["status"] == "unfinished"
    with pytest.raises(InputError, match=r"nothing\.csv"):
        status_of(tmp_path / "nothing.csv", None)


def test_fault_that_ended_a_command_is_told(tmp_path, monkeypatch):
    path, out = short_study(tmp_path), tmp_path / "out"
    instantly(monkeypatch.setattr, faulty=range(1, 21))
    with pytest.raises(typer.Exit):
        study_command(path, out)
    record = study_status(Problem.load(path), out)
    assert record["status"] == "unfinished" and "only 0 of 20 design runs succeeded" in record["stopped_by"]


def test_command_without_a_store_says_that_nothing_ran(tmp_path, monkeypatch, capsys):
    path = short_study(tmp_path).with_name("cylindrical_roller.toml")
    monkeypatch.chdir(tmp_path)
    record = status_of(path, None)
    assert record["status"] == "unfinished" and record["points"]["total"] == 0
    show(status_blocks(record))
    assert "Nothing has run yet in cylindrical_roller_uncertainty" in capsys.readouterr().out


def test_unit_a_file_is_no_folder_of_results(tmp_path):
    """Unit: a file named as the folder is refused, not taken for a study that never ran."""
    path = short_study(tmp_path)
    shown = CliRunner().invoke(app, ["status", str(path), "--out", str(path)])
    assert shown.exit_code == 2 and "is a file; name the folder" in shown.output
