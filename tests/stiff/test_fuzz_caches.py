"""Fuzz: files that the programs keep for themselves, spoilt in any way, change no answer and are good again afterwards."""

import json
import random
import sqlite3
import subprocess
import sys
import warnings
from collections import Counter

import numpy as np
import pytest
from cached_entries import ARGUMENTS, FUNCTIONS, fill, fresh, is_whole, remove, spoil
from conftest import ROOT

from doe.running.store import Point, Store, at_work, folders_of
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.files import Checkpoint
from rbdyn.quasistatic import sweep as sweeps
from rbdyn.quasistatic.sweep import sweep
from rbdyn.scene import BallScene

# One process of several that use a folder of compiled code at once, and spoil files that the others read and write.
SHARED = """
import random, sys
from pathlib import Path
from cached_entries import ARGUMENTS, FUNCTIONS, fresh, spoil
draw, folder, cases = random.Random(int(sys.argv[1])), Path(sys.argv[2]), int(sys.argv[3])
for case in range(cases):
    function = draw.choice(FUNCTIONS)
    compiled = fresh(function, folder)
    answers = [compiled(x) for x in ARGUMENTS]
    assert answers == [function(x) for x in ARGUMENTS], (case, answers)
    files = sorted(folder.glob("*.nbc"))
    if len(files) > 1 and draw.random() < 0.5:
        try:
            spoil(draw, *draw.sample(files, 2))
        except OSError:
            pass  # another process was there first
print("done")
"""


@pytest.fixture(autouse=True)
def no_warnings():
    """A warning of a library that reaches the user is a fault."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.slow
def test_fuzz_spoilt_compiled_code(fuzz_cases, tmp_path):
    """Fuzz: of any spoilt file of compiled code the answer stays, and the next process loads it."""
    draw, ends = random.Random("code"), Counter()
    files = fill(tmp_path)
    whole = {path: path.read_bytes() for path in files}
    for case in range(fuzz_cases):
        path, other = draw.sample(files, 2)
        way = spoil(draw, path, other)
        good = sum(is_whole(file, data) for file, data in whole.items())
        ends["whole" if good == 4 else "spoilt"] += 1
        for loads in (good, 4):
            process = [fresh(function, tmp_path) for function in FUNCTIONS]
            for function, compiled in zip(FUNCTIONS, process, strict=True):
                assert [compiled(x) for x in ARGUMENTS] == [function(x) for x in ARGUMENTS], (case, way)
            assert sum(compiled.stats.cache_hits.total() for compiled in process) == loads, (case, way)
        assert sorted(tmp_path.glob("*.nbc")) == sorted(tmp_path.iterdir()) == files, (case, way)
        for each in (path, other):
            remove(each)
            each.write_bytes(whole[each])
    assert 0 < ends["whole"] < ends["spoilt"], ends


@pytest.mark.slow
def test_fuzz_processes_share_compiled_code(fuzz_cases, tmp_path):
    """Fuzz: three processes use, write and spoil the same files at once, and each gets every answer right."""
    command = [sys.executable, "-c", SHARED]
    environment = {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests' / 'helpers'}", "NUMBA_CACHE_DIR": str(tmp_path / "own")}
    processes = [
        subprocess.Popen(
            [*command, str(seed), str(tmp_path / "shared"), str(fuzz_cases // 3 + 1)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={"PATH": "/usr/bin:/bin", **environment},
        )
        for seed in range(3)
    ]  # fmt: skip
    answers = [process.communicate(timeout=600) for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0], answers
    assert all(shown == "done\n" for shown, _ in answers)


@pytest.mark.slow
def test_fuzz_spoilt_parts_of_a_sweep(fuzz_cases, tmp_path, monkeypatch):
    """Fuzz: whatever became of what an interrupted sweep left, the whole sweep has the same figures."""
    monkeypatch.setattr(sweeps, "ROW", 4)
    scene, keys = BallScene.load(ROOT / "examples" / "angular_contact_ball.toml"), {
        "operation.axial_load_N": np.linspace(200.0, 400.0, 12).tolist()
    }  # fmt: skip
    path, other, ends, draw = tmp_path / "sweep.part", tmp_path / "other", Counter(), random.Random("sweep")
    whole = sweep(scene, keys)

    def interrupt(done: int, total: int) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(scene, keys, interrupt, path)
    data = path.read_bytes()
    with pytest.raises(KeyboardInterrupt):
        sweep(scene, {"operation.axial_load_N": np.linspace(200.0, 500.0, 12).tolist()}, interrupt, other)
    other_data = other.read_bytes()
    for case in range(fuzz_cases):
        for file, content in ((path, data), (other, other_data)):
            remove(file)
            file.write_bytes(content)
        way, solved = spoil(draw, path, other), []
        untouched = is_whole(path, data)
        try:
            resumed = sweep(scene, keys, lambda done, total, solved=solved: solved.append(done), path)
        except OSError:
            assert "folder" in way or "link" in way, (case, way)
            continue
        assert all(np.array_equal(resumed.columns[name], column) for name, column in whole.columns.items()), (case, way)
        if not solved:
            # It led to a file that another case has filled.
            assert way == "a dead link", (case, way)
            continue
        # The first row is kept when the interrupt comes, the second is not yet.
        assert solved[0] == 5 or (solved[0] == 1 and not untouched), (case, way)
        ends["resumed" if solved[0] == 5 else "anew"] += 1
    assert min(ends["resumed"], ends["anew"]) > 0, ends


@pytest.mark.slow
def test_fuzz_spoilt_lines_of_finished_parts(fuzz_cases, tmp_path):
    """Fuzz: a record that is read back from a spoilt file is one that was put there, under its own key."""
    draw, path, other, counts = random.Random("lines"), tmp_path / "parts.jsonl", tmp_path / "other", Counter()
    records = {f"key {n}": {"value": n / 7, "text": "é\u2028" * n} for n in range(5)}
    for file, keys in ((path, list(records)), (other, ["another"])):
        for key in keys:
            Checkpoint(file).put(key, records.get(key, 1))
    data, other_data = path.read_bytes(), other.read_bytes()
    for case in range(fuzz_cases):
        for file, content in ((path, data), (other, other_data)):
            remove(file)
            file.write_bytes(content)
        way = spoil(draw, path, other)
        try:
            parts = Checkpoint(path)
        except OSError:
            assert "folder" in way or "link" in way, (case, way)
            continue
        read = {key: parts.get(key) for key in records if parts.get(key) is not None}
        assert all(records[key] == record for key, record in read.items()), (case, way)
        counts["all" if len(read) == 5 else "some" if read else "none"] += 1
        if path.exists():
            parts.put("key 0", records["key 0"])
            assert Checkpoint(path).get("key 0") == records["key 0"], (case, way)
    assert min(counts[end] for end in ("all", "some", "none")) > 0, counts


@pytest.mark.slow
def test_fuzz_spoilt_stores(fuzz_cases, tmp_path, capsys):
    """Fuzz: a spoilt store of runs gives the results that were put into it, fewer, or one sentence."""
    draw, path, other, ends = random.Random("stores"), tmp_path / "study.sqlite", tmp_path / "other", Counter()
    results = {f"run {n}": {"impact": n / 7, "text": "x" * 900} for n in range(12)}
    for file, keys in ((path, results), (other, ["run 99"])):
        with Store(file) as store:
            for key in keys:
                store.put(key, results.get(key, {"impact": -1.0}))
        with sqlite3.connect(file) as connection:
            connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        connection.close()
    data, other_data = path.read_bytes(), other.read_bytes()
    for case in range(fuzz_cases):
        for file in tmp_path.iterdir():
            remove(file)
        path.write_bytes(data)
        other.write_bytes(other_data)
        way = spoil(draw, path, other)
        try:
            with Store(path) as store:
                read = {key: each for key, each in store.outcomes([Point(key, key) for key in results]).items()}
                store.put("new", {"impact": 0.5})
                assert store.get("new") == {"impact": 0.5}, (case, way)
            assert all(results[key] == record for key, record in read.items()), (case, way)
            ends["whole" if len(read) == len(results) else "fewer"] += 1
        except (InputError, RunError) as error:
            (sentence,) = str(error).splitlines()
            assert sentence.isprintable() and str(path) in sentence, (case, way)
            ends["refused"] += 1
        said = capsys.readouterr().err.splitlines()
        assert len(said) <= 1 and all(len(each) < 1000 for each in said), (case, way)
    assert min(ends[end] for end in ("whole", "fewer", "refused")) > 0, ends


@pytest.mark.slow
def test_fuzz_spoilt_notes_of_studies_at_work(fuzz_cases, tmp_path, monkeypatch):
    """Fuzz: a spoilt note of a running study hides that study at most."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    draw, study, folders = random.Random("notes"), tmp_path / "study.toml", Counter()
    keys = ("study", "store")
    values = (None, 0, -1, 10**30, "x", "\x00", [], {}, "/" * 5000, 1e308)
    stores = [tmp_path / name / "study.sqlite" for name in ("one", "two")]
    for store in stores:
        store.parent.mkdir()
    with at_work(study, stores[0]), at_work(study, stores[1]), Store(stores[0]), Store(stores[1]):
        notes = sorted((tmp_path / "cache").rglob("*.json"))
        texts = [note.read_bytes() for note in notes]
        for case in range(fuzz_cases):
            for note, text in zip(notes, texts, strict=True):
                remove(note)
                note.write_bytes(text)
            if draw.random() < 0.5:
                way = spoil(draw, *draw.sample(notes, 2))
            else:
                way, content = draw.choice(keys), json.loads(texts[0])
                if draw.random() < 0.3:
                    del content[way]
                else:
                    content[way] = draw.choice(values)
                notes[0].write_text(json.dumps(content), encoding="utf-8")
            there = folders_of(study)
            assert set(there) <= {tmp_path / "one", tmp_path / "two"} or way in ("a bit", "store"), (case, way, there)
            folders[len(there)] += 1
            with at_work(tmp_path / "another.toml", tmp_path / "three" / "study.sqlite"):
                pass
    assert folders[1] > 0 and folders[2] > 0, folders
