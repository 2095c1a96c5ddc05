"""Runs on a dask cluster: a real scheduler and workers on this machine, one of which is killed."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from doe_command import doe
from short_studies import SHORT, run_design, short_study, silent

from doe.running import runner
from doe.running.runner import RunOutcome
from doe.running.store import STORE, Store
from doe.workflow.problem import Problem
from rbdyn.base.faults import InputError, RunError

HERE = Path(__file__).parent


class Cluster(NamedTuple):
    """A cluster of this machine."""

    address: str
    scheduler: subprocess.Popen
    workers: list[subprocess.Popen]


def written_address(told: Path) -> str:
    """The address in a scheduler's file, which stands there empty before it is written."""
    deadline = time.monotonic() + 60.0
    while True:
        try:
            return json.loads(told.read_text(encoding="utf-8"))["address"]
        except (FileNotFoundError, json.JSONDecodeError):
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


@contextmanager
def started(folder: Path, workers: int, **environment: str) -> Iterator[Cluster]:
    """A scheduler and workers of one thread each, in processes of their own."""
    path = os.pathsep.join(
        [*map(str, (HERE, HERE.parent / "helpers", HERE.parents[1])), os.environ.get("PYTHONPATH", "")]
    )
    setting = {**os.environ, "PYTHONPATH": path, **environment}

    def start(module: str, *options: str) -> subprocess.Popen:
        command = [sys.executable, "-m", f"distributed.cli.{module}", "--no-dashboard", *options]
        process = subprocess.Popen(
            command, env=setting, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        processes.callback(process.wait)
        processes.callback(process.kill)
        return process

    with ExitStack() as processes:
        told = folder / "scheduler.json"
        scheduler = start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(told))
        address = written_address(told)
        own = ("--nthreads", "1", "--no-nanny", "--local-directory", str(folder))
        yield Cluster(address, scheduler, [start("dask_worker", address, *own) for _ in range(workers)])


def slow_echo(text: str) -> RunOutcome:
    """Work for a worker: gives back its text, unless that tells it to die."""
    if text == "die":
        assert "dask" in " ".join(sys.orig_argv)
        # What this worker did before is reported in batches.
        time.sleep(1.0)
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(float(text))
    return RunOutcome({"text": text, "end": time.time()}, None, 0.0, pid=os.getpid())


def collected(
    address: str, texts: list[str], ended: Callable[[int, RunOutcome], None] | None = None
) -> dict[int, RunOutcome]:
    """What a cluster makes of texts."""
    found: dict[int, RunOutcome] = {}

    def take(place: int, ran: RunOutcome) -> None:
        found[place] = ran
        if ended is not None:
            ended(place, ran)

    runner.run_on_cluster(address, slow_echo, texts, take)
    return found


@pytest.mark.slow
def test_study_on_a_cluster_that_loses_a_worker_has_the_bits_of_a_local_one(tmp_path):
    path = short_study(tmp_path, SHORT.replace("turns=3,", "turns=40,") + ",step_budget_per_turn=4000")
    path.write_text(path.read_text(encoding="utf-8").replace("centre = 0.15", "centre = 0.12"), encoding="utf-8")
    study = Problem.load(path)
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    local = run_design(study, tmp_path / "here", None, silent)
    with started(tmp_path, 2) as there:
        done: list[int] = []

        def progress(ended: int, total: int) -> None:
            done.append(ended)
            if ended == 4 and there.workers[0].poll() is None:
                there.workers[0].kill()

        remote = run_design(study, tmp_path / "there", None, progress, there.address)
        assert there.workers[0].wait(10) == -signal.SIGKILL
        assert 4 in done and done[-1] == 20
    assert np.array_equal(remote.values, local.values) and np.array_equal(remote.errors, local.errors)
    assert remote.failures == local.failures
    with Store(tmp_path / "there" / STORE, read_only=True) as store:
        assert len(store.ended()) == 20
        pids = {row[0] for row in store._connection.execute("SELECT pid FROM runs")}
    # Both had a share, and the process that asked none.
    assert pids <= {worker.pid for worker in there.workers} and there.workers[1].pid in pids
    # The rest of the study finds all of it in the store: no cluster is needed any more.
    again = run_design(study, tmp_path / "there", None, silent, "127.0.0.1:1")
    assert np.array_equal(again.values, local.values)


@pytest.mark.slow
def test_only_what_a_worker_of_a_cluster_runs_is_under_way(tmp_path, monkeypatch):
    """Of ten texts for two workers, two are begun at once and not one more; all are begun before they end."""
    begun: list[tuple[int, float]] = []
    begun_before_end: list[bool] = []
    # By the workers' own clock: this process hears of an end later, under load after the next begin.
    ends: list[float] = []

    def on_end(place: int, ran: RunOutcome) -> None:
        begun_before_end.append(place in [other for other, _ in begun])
        ends.append((ran.result or {})["end"])

    with started(tmp_path, 2) as there:
        runner.run_on_cluster(
            there.address, slow_echo, ["0.4"] * 10, on_end, lambda place: begun.append((place, time.time()))
        )
    assert sorted(place for place, _ in begun) == list(range(10)) and begun_before_end == [True] * 10
    for count, (_, moment) in enumerate(begun, 1):
        assert count <= 2 + sum(end <= moment for end in ends)


@pytest.mark.slow
def test_cluster_gives_each_place_its_own_and_tells_what_is_gone(tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "WORKERS_S", 0.5)
    monkeypatch.setattr(runner, "DESERTED_S", 2.0)
    with started(tmp_path, 0) as empty, pytest.raises(InputError, match="has no workers; start some with"):
        collected(empty.address, ["0"])
    (tmp_path / "scheduler.json").unlink()
    monkeypatch.setattr(runner, "WORKERS_S", 60.0)
    with started(tmp_path, 2) as there:
        texts = [f"0.0{number}" for number in range(1, 8)]
        ran = collected(there.address, texts)
        assert {place: (one.result or {})["text"] for place, one in ran.items()} == dict(enumerate(texts))
        with pytest.raises(RunError, match="its workers are gone; finished runs are kept"):
            collected(there.address, ["0.01"] + ["60"] * 3, lambda place, ran: [w.kill() for w in there.workers])
    (tmp_path / "scheduler.json").unlink()
    with started(tmp_path, 1) as there, pytest.raises(RunError, match="the scheduler is gone; finished runs"):
        collected(there.address, ["0.01"] + ["60"] * 3, lambda place, ran: there.scheduler.kill())


@pytest.mark.slow
def test_point_that_kills_its_workers_is_told_as_lost_and_the_others_are_kept(tmp_path):
    with started(tmp_path, 2, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0") as there:
        found = collected(there.address, ["0.01", "0.02", "die"])
    assert found[0].result and found[1].result
    assert found[2].lost and found[2].cause is not None and found[2].cause.startswith("its workers were lost")


@pytest.mark.slow
def test_worker_with_other_sources_is_refused(tmp_path, monkeypatch):
    study = Problem.load(short_study(tmp_path))
    monkeypatch.setattr("rbdyn.base.files.source_digest", lambda *roots: "edited")
    with started(tmp_path, 1) as there, pytest.raises(InputError, match="runs another version of rbdyn"):
        run_design(study, tmp_path, None, silent, there.address)
    with Store(tmp_path / STORE, read_only=True) as store:
        assert store.ended() == [] and store.running() == []


def test_scheduler_that_is_not_there_is_one_sentence(tmp_path):
    path = short_study(tmp_path)
    before = time.monotonic()
    shown = doe("study", str(path), "--out", str(tmp_path), "--scheduler", "127.0.0.1:1", "--json")
    assert time.monotonic() - before < 60.0
    assert shown.returncode == 2
    assert shown.stderr.strip().splitlines()[1:] == json.loads(shown.stdout)["faults"] == [
        "--scheduler 127.0.0.1:1: no dask scheduler answers there within 2 s; check the address"
    ]  # fmt: skip
    with Store(tmp_path / STORE, read_only=True) as store:
        assert store.running() == []


@pytest.mark.parametrize("answer", [None, b"", b"HTTP/1.0 400 Bad Request\r\n\r\n", b"SSH-2.0\r\n", b"\0" * 64])
def test_what_is_no_scheduler_is_one_sentence_in_a_while(answer):
    """None: it never says anything; b"": it hangs up; the others talk and leave the line open."""
    with socket.create_server(("127.0.0.1", 0)) as server, ExitStack() as open_lines:

        def talk() -> None:
            with suppress(OSError):
                while True:
                    line, _ = server.accept()
                    if answer == b"":
                        line.close()
                        continue
                    open_lines.enter_context(line)
                    line.sendall(answer or b"")

        threading.Thread(target=talk, daemon=True).start()
        address = f"127.0.0.1:{server.getsockname()[1]}"
        before = time.monotonic()
        with pytest.raises(
            InputError, match=f"^--scheduler {address}: no dask scheduler answers there within 2 s; check"
        ):
            collected(address, ["0"])
        assert time.monotonic() - before < 30.0


def test_cluster_without_its_package_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError) as refused:
        collected("127.0.0.1:1", ["0"])
    assert refused.value.faults == [
        "--scheduler 127.0.0.1:1: needs the package distributed; pip install 'rbdyn[cluster]'"
    ]
