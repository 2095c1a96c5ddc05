"""``doe status``: counts, causes, who runs what, time left; it changes nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path

from doe_command import doe, invoke, loaded_by
from instant_runs import instantly
from short_studies import short_study, silent

from doe.commands.status import print_status
from doe.running.owner import at_work
from doe.running.store import Point, Store
from doe.study.runs import STORE, run_design
from doe.study.status import study_status
from doe.study_file import Study


def files(folder: Path) -> dict[str, tuple[int, float]]:
    """Sizes and times of the files of a folder, but for the locks of those who read the store."""
    return {
        file.name: (file.stat().st_size, file.stat().st_mtime)
        for file in folder.iterdir()
        if not file.name.endswith("-shm")
    }


def test_study_that_never_ran_is_all_missing(tmp_path):
    study = Study.load(short_study(tmp_path))
    record = study_status(study, tmp_path / "nowhere")
    assert record["points"] == {"total": 20, "done": 0, "failed": 0, "running": 0, "missing": 20}
    assert record["status"] == "unfinished" and record["left_s"] is None
    assert not (tmp_path / "nowhere").exists()


def test_running_study_tells_who_runs_what_and_how_long_it_will_take(tmp_path, monkeypatch, capsys):
    study = Study.load(short_study(tmp_path))
    instantly(monkeypatch.setattr, seconds=0.02, faulty=(2, 4))
    records, passed, begun = {}, {}, time.perf_counter()

    def look(done: int, total: int) -> None:
        if done in (0, 8, 20):
            passed.setdefault(done, time.perf_counter() - begun)
            records.setdefault(done, study_status(study, tmp_path))

    run_design(study, tmp_path, 2, look)
    first, middle, last = records.values()
    assert first["points"]["missing"] == 20 and first["status"] == "unfinished" and first["left_s"] is None
    points = middle["points"]
    assert middle["status"] == "running" and points["done"] == 6 and points["failed"] == 2
    assert 1 <= points["running"] <= 2 and sum(points.values()) == 2 * points["total"]
    for claim in middle["running"]:
        assert claim["pid"] == os.getpid() and claim["label"] == f"design run {claim['run']}"
        assert abs(datetime.fromisoformat(claim["since"]).timestamp() - time.time()) < 60.0
    # Two threads, runs of 0.02 s and more: 8 have ended, 12 are left.
    assert 8 * 0.02 <= middle["spent_s"] <= 2.0 * passed[8]
    assert 12 * 0.01 <= middle["left_s"] <= 12 / 8 * passed[8]
    (group,) = middle["failures"]
    assert group["runs"] == [2, 4] and "the oil froze" in group["cause"]
    assert last["status"] == "finished" and last["left_s"] == 0.0
    assert last["points"] == {"total": 20, "done": 18, "failed": 2, "running": 0, "missing": 0}
    print_status(middle, quiet=False)
    shown = capsys.readouterr().out
    assert "6 done, 2 failed" in shown and "failed: design run 2, design run 4: " in shown and "time left" in shown


def test_command_reads_only_and_loads_no_compiler(tmp_path, monkeypatch):
    path = short_study(tmp_path)
    out = tmp_path / "study_results"
    out.mkdir()
    instantly(monkeypatch.setattr)
    run_design(Study.load(path), out, 2, silent)
    with Store(out / STORE) as store:
        store.put("a confirmation", {})
        store.claim([Point("another", "pick")])
        before = files(out)
        monkeypatch.chdir(tmp_path)
        shown = doe("status", "study.toml", "--json")
        assert files(out) == before
    record = json.loads(shown.stdout)
    assert shown.returncode == 0 and shown.stderr == ""
    assert set(record) == {
        "format", "status", "study", "store", "points", "failures", "running", "other", "spent_s", "left_s",
    }  # fmt: skip
    assert record["points"]["done"] == 20 and record["status"] == "finished"
    assert record["other"] == {"done": 1, "failed": 0, "running": 1}
    words = doe("status", "study.toml").stdout
    assert "20 done, 0 failed, 0 running, 0 missing" in words and "other runs: 1 done" in words
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

    assert "nothing has run yet in study_results" in asked()
    with at_work(path, far):
        assert str(far / STORE) in asked()
        with at_work(path.parent / "cylindrical_roller.toml", other):
            assert str(far / STORE) in asked()
        with at_work(path, other):
            assert f"runs in {far} and in {other}; name one of them by --out" in asked()
    killed = f"from doe.running.owner import *; import os\nwith at_work(Path({str(path)!r}), Path('x')): os._exit(0)"
    subprocess.run([sys.executable, "-c", killed], check=True)
    notes = tmp_path / "cache" / "rbdyn" / "at_work"
    assert len(list(notes.iterdir())) == 1 and "study_results" in asked()
    with at_work(path, far):
        assert len(list(notes.iterdir())) == 1
    assert not list(notes.iterdir())
