"""The store of runs: what it refuses, what survives a cut log and a full disk, who may work on it."""

import os
import shutil
import socket
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from doe.running.store import Failure, Point, Store, grouped
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.files import digest_of
from rbdyn.base.folder import is_locked

POINTS = [Point(f"key {number}", f"design run {number}", number, {"x": 0.5}) for number in range(1, 9)]


def result(number: int) -> dict:
    """A result of some size."""
    return {"number": number, "text": f"{number} " * 400}


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "study.sqlite"


def test_results_and_failures_are_kept_with_their_facts(path):
    with Store(path, "clearance") as store:
        assert store.get("key 1") is None
        store.begin(POINTS[0])
        store.begin(POINTS[1])
        store.put("key 1", {"x": 1.5}, seconds=2.0)
        store.put("key 1", {"x": 2.5})
        store.fail("key 2", "it broke", seconds=1.0)
        store.put("key 2", {"x": 3.5})
    with Store(path) as store:
        assert store.get("key 1") == {"x": 1.5}
        assert store.outcomes(POINTS) == {
            "key 1": {"x": 1.5},
            "key 2": Failure("design run 2", "it broke", 2, {"x": 0.5}),
        }
        assert [(run.key, run.status, run.seconds) for run in store.ended()] == [
            ("key 1", "done", 2.0),
            ("key 2", "failed", 1.0),
        ]
    with sqlite3.connect(path) as connection:
        facts = connection.execute("SELECT study, label, run, factors, pid FROM runs WHERE key = 'key 1'").fetchone()
    assert facts == ("clearance", "design run 1", 1, '{"x": 0.5}', os.getpid())


def foreign(path: Path, *statements: str) -> None:
    """A database that something else made."""
    connection = sqlite3.connect(path)
    for statement in statements:
        connection.execute(statement)
    connection.commit()
    connection.close()


@pytest.mark.parametrize(
    ("statements", "words"),
    [
        ((), "it is not a database; move it away or name another folder"),
        (("CREATE TABLE birds (name TEXT)",), "not a store of runs"),
        (("CREATE TABLE runs (key TEXT PRIMARY KEY, result TEXT)",), "a store of version 1, not 2; move it away"),
        (
            (
                "CREATE TABLE meta (name TEXT, value TEXT)",
                "INSERT INTO meta VALUES ('format', 'doe.store'), ('version', '3')",
            ),
            "a store of version 3, not 2; install the newer doe that made it or name",
        ),
    ],
)
def test_what_is_no_store_of_this_version_is_refused_and_left_alone(path, statements, words):
    if statements:
        foreign(path, *statements)
    else:
        path.write_text("not a database, and long enough to be told from one " * 30)
    before = path.read_bytes()
    with pytest.raises(InputError, match=words) as refused:
        Store(path)
    assert len(refused.value.faults) == 1 and str(path) in refused.value.faults[0]
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def test_folder_in_place_of_the_file_or_no_folder_is_told_as_such(path):
    with pytest.raises(InputError, match=r"study\.sqlite: .*make sure that its folder exists"):
        Store(path / "nowhere" / path.name)
    path.mkdir()
    with pytest.raises(InputError, match=r"study\.sqlite: is a folder where a file of runs belongs; move it away"):
        Store(path)


def test_folder_that_cannot_be_written_is_told_as_such():
    folder = Path(tempfile.mkdtemp())
    user, path = os.geteuid(), folder / "study.sqlite"
    try:
        for made in (False, True):
            if made:
                Store(path).close()
            folder.chmod(0o555)
            if user == 0:
                os.seteuid(65534)
            try:
                with pytest.raises(InputError, match=r"study\.sqlite: .*that both can be written, or name") as refused:
                    Store(path)
            finally:
                os.seteuid(user)
                folder.chmod(0o755)
            assert len(refused.value.faults) == 1 and "\n" not in str(refused.value)
    finally:
        shutil.rmtree(folder)


def test_file_that_another_process_holds_is_told_as_such(path, monkeypatch):
    monkeypatch.setattr("doe.running.store.PATIENCE_S", 0.1)
    with Store(path) as holder, Store(path) as other:
        holder._connection.execute("BEGIN EXCLUSIVE")
        with pytest.raises(InputError, match=r"another process holds it; start again when that has ended$"):
            other.put("key 1", result(1))
        holder._connection.execute("ROLLBACK")


def test_cut_file_is_refused(path):
    with Store(path) as store:
        for number in range(40):
            store.put(f"key {number}", result(number))
    path.write_bytes(path.read_bytes()[:-9000])
    with pytest.raises(InputError, match=r"study\.sqlite"):
        Store(path)


def test_log_cut_anywhere_gives_back_whole_results_in_order(path, tmp_path):
    """A power cut: the files as they lie there, the log shortened at will, the index of the log lost."""
    log = path.with_name(path.name + "-wal")
    lengths = []
    with Store(path) as store:
        for number in range(1, 7):
            store.put(f"key {number}", result(number))
            lengths.append(log.stat().st_size)
        whole, main = log.read_bytes(), path.read_bytes()
    for length in [*lengths, *(mark - 1 for mark in lengths), *(mark + 1000 for mark in lengths[:-1])]:
        folder = tmp_path / str(length)
        folder.mkdir()
        (folder / path.name).write_bytes(main)
        (folder / log.name).write_bytes(whole[:length])
        reported = sum(mark <= length for mark in lengths)
        with Store(folder / path.name) as store:
            found = store.outcomes(POINTS)
        assert found == {f"key {number}": result(number) for number in range(1, reported + 1)}, length


def test_results_are_on_the_disk_when_put_returns_and_beginnings_need_not_be(path):
    with Store(path) as store:
        said: list[str] = []
        store._connection.set_trace_callback(said.append)
        store.begin(POINTS[0])
        store.put("key 1", result(1))
        store._connection.set_trace_callback(None)
    settings = [line.rpartition("=")[2] for line in said if line.startswith("PRAGMA synchronous")]
    assert settings == ["NORMAL", "FULL"]


@pytest.mark.parametrize(
    "spoilt",
    [
        "result = replace(result, '1 1', '1 7')",
        "result = NULL",
        "digest = NULL",
        "result = x'ff00'",
        "result = CAST(x'7bff' AS TEXT)",
        "result = 5",
        f"result = '{{', digest = '{digest_of('{')}'",
        f"result = '[]', digest = '{digest_of('[]')}'",
        f"result = 'null', digest = '{digest_of('null')}'",
        "status = 'failed', cause = NULL",
    ],
)
def test_spoilt_result_is_told_and_not_read_but_run_again(path, spoilt, capsys):
    with Store(path) as store:
        store.put("key 1", result(1))
    foreign(path, f"UPDATE runs SET {spoilt}")
    with Store(path) as store:
        assert store.outcomes(POINTS[:1]) == store.outcomes(POINTS[:1]) == {}
        assert capsys.readouterr().err == f"{path}: kept results that cannot be read count as not done: design run 1\n"
        store.begin(POINTS[0])
        store.put("key 1", result(1))
        assert store.get("key 1") == result(1)


def test_run_is_under_way_from_when_it_begins_until_it_ends(path):
    with Store(path) as store, Store(path, read_only=True) as reader:
        before = time.time()
        for point in POINTS[:3]:
            store.begin(point)
        store.put("key 2", result(2))
        one, three = reader.running()
        assert (one.key, one.label, one.run, one.pid) == ("key 1", "design run 1", 1, os.getpid())
        assert three.key == "key 3" and before <= one.since <= three.since <= time.time()
        store.release()
        assert reader.running() == [] and [run.key for run in reader.ended()] == ["key 2"]


def test_spoilt_times_stop_nobody(path):
    with Store(path) as store:
        store.put("key 1", result(1), seconds=2.0)
        store.begin(POINTS[1])
        times = "started = 'then', ended = CASE key WHEN 'key 1' THEN 'now' END, seconds = NULL"
        store._connection.execute(f"UPDATE runs SET {times}")
        assert store.get("key 1") == result(1) and store.ended() == []
        assert [run.since for run in store.running()] == [0.0]


def test_failure_dated_ahead_by_another_clock_is_tried_again(path):
    with Store(path) as store:
        store.begin(POINTS[0])
        store.fail("key 1", "it broke")
    foreign(path, f"UPDATE runs SET ended = {time.time() + 1e5}")
    with Store(path) as store:
        store.forget_failures(POINTS)
        assert store.outcomes(POINTS) == {}


def test_full_disk_is_one_sentence_and_keeps_what_was_finished(path):
    with Store(path) as store:
        store.put("key 1", result(1))
        (pages,) = store._connection.execute("PRAGMA page_count").fetchone()
        store._connection.execute(f"PRAGMA max_page_count = {pages + 1}")
        with pytest.raises(RunError, match=r"study\.sqlite: .*full.*free space") as refused:
            for number in range(2, 9):
                store.put(f"key {number}", result(number))
        assert "\n" not in str(refused.value)
        kept = store.outcomes(POINTS)
        assert kept["key 1"] == result(1)
    with Store(path) as store:
        assert store.outcomes(POINTS) == kept
        store.put("key 8", result(8))
        assert store.get("key 8") == result(8)


def working(path: Path) -> subprocess.Popen:
    """Another process that works on a store, once it has run 1 under way."""
    code = (
        "import sys, time; from pathlib import Path; from doe.running.store import Point, Store\n"
        "with Store(Path(sys.argv[1])) as store:\n"
        "    store.begin(Point('key 1', 'design run 1', 1))\n"
        "    print('begun', flush=True)\n"
        "    sys.stdin.read()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "begun\n"
    return process


def test_second_process_is_refused_in_one_sentence_while_the_first_lives(path, monkeypatch):
    """Who it is and what to do; a reader sees what it does; once it is killed nothing of it is left."""
    monkeypatch.setattr("rbdyn.base.folder.PATIENCE_S", 0.1)
    process = working(path)
    with pytest.raises(InputError) as refused:
        Store(path)
    host = socket.gethostname()
    assert refused.value.faults == [
        f"{path}: process {process.pid} on {host} works on it; wait until it has ended, or name another folder"
    ]
    with Store(path, read_only=True) as reader:
        assert [(run.key, run.pid) for run in reader.running()] == [("key 1", process.pid)]
        process.kill()
        process.wait()
        assert reader.running() == []
    with Store(path) as store:
        assert store._connection.execute("SELECT count(*) FROM runs").fetchone() == (0,)
        assert store.outcomes(POINTS) == {}


INTERRUPTED = """
import os, random, signal, sys, threading, time
from pathlib import Path
from doe.running.store import Point, Store
signals, draw, done = int(sys.argv[2]), random.Random(1), threading.Event()
caught, armed = 0, False
def stop(number, frame):
    # No interrupt outside the calls of the store, however late a busy machine delivers it.
    global caught, armed
    if armed:
        caught, armed = caught + 1, False
        raise KeyboardInterrupt
signal.signal(signal.SIGINT, stop)
with Store(Path(sys.argv[1])) as store, Store(Path(sys.argv[1])) as other:
    def work():
        while not done.is_set():
            store.begin(Point("worker", "worker"))
    def interrupt():
        for _ in range(signals):
            time.sleep(draw.uniform(0.0, 0.004))
            os.kill(os.getpid(), signal.SIGINT)
        done.set()
    threads = [threading.Thread(target=each) for each in (work, interrupt)]
    for each in threads:
        each.start()
    while not done.is_set():
        try:
            armed = True
            while not done.is_set():
                store.note("agenda ", "text")
                other.release()
            armed = False
        except KeyboardInterrupt:
            pass
    store.put("last", {"x": 1})
    print(caught > 0, store._connection.in_transaction or other._connection.in_transaction)
"""


def test_ctrl_c_at_any_moment_leaves_no_transaction_and_no_lock(path):
    line = [sys.executable, "-c", INTERRUPTED, str(path), "200"]
    shown = subprocess.run(line, capture_output=True, text=True, timeout=120)
    assert (shown.returncode, shown.stdout) == (0, "True False\n"), shown.stderr


def test_stores_of_one_process_share_its_lock_until_the_last_is_closed(path):
    one, two = Store(path), Store(path)
    one.close()
    assert is_locked(path.parent)
    two.put("key 1", result(1))
    two.close()
    assert not is_locked(path.parent) and not is_locked(path.parent / "none")
    process = working(path)
    assert is_locked(path.parent)
    process.communicate()
    assert not is_locked(path.parent)


def test_notes_tell_whether_their_process_lives(path):
    with Store(path) as store:
        store.note("plan ", "first")
        assert store.notes("plan ") == [("first", True)]
    with Store(path) as store:
        assert store.notes("plan ") == [("first", False)]
        store.note("plan ", "second")
        store.sign("plan ")
        assert store.notes("plan ") == [("second", True)]


def test_reading_leaves_the_folder_as_it_was(path, tmp_path):
    with Store(path) as store:
        store.put("key 1", result(1))
        store.begin(POINTS[1])
        # As a killed process leaves it: with its log.
        killed = tmp_path / "killed"
        killed.mkdir()
        for name in (path.name, f"{path.name}-wal", f"{path.name}-shm"):
            shutil.copy(path.with_name(name), killed / name)
    for folder in (path.parent, killed):
        before = {file.name: file.stat().st_size for file in folder.iterdir()}
        with Store(folder / path.name, read_only=True) as store:
            assert store.get("key 1") == result(1)
            with pytest.raises(InputError, match="readonly"):
                store.put("key 2", result(2))
        assert {file.name: file.stat().st_size for file in folder.iterdir()} == before


def test_of_many_openings_at_once_one_makes_the_store_and_the_others_wait_or_are_refused(path):
    code = (
        "import sys; from pathlib import Path; from doe.running.store import Store; from rbdyn.base.faults import InputError\n"
        "try:\n"
        "    with Store(Path(sys.argv[1])) as store:\n"
        "        store.put('k' + sys.argv[2], {})\n"
        "except InputError as error:\n"
        "    sys.exit(2 if 'works on it' in str(error) else 3)"
    )
    processes = [subprocess.Popen([sys.executable, "-c", code, str(path), str(number)]) for number in range(3)]
    codes = [process.wait(60) for process in processes]
    assert set(codes) <= {0, 2} and 0 in codes
    with Store(path) as store:
        assert {run.key for run in store.ended()} == {f"k{number}" for number, code in enumerate(codes) if code == 0}


def test_causes_that_differ_in_numbers_are_one_and_the_most_frequent_comes_first():
    failures = [
        Failure("design run 2", "seed 2 stopped at t = 1.5e-05 s: frozen", 2),
        Failure("pick", "no oil"),
        Failure("design run 7", "seed 7 stopped at t = 3 s: frozen", 7),
    ]
    assert [group.as_dict() for group in grouped(failures)] == [
        {
            "cause": "seed 2 stopped at t = 1.5e-05 s: frozen",
            "runs": [2, 7],
            "labels": ["design run 2", "design run 7"],
        },
        {"cause": "no oil", "runs": [], "labels": ["pick"]},
    ]
