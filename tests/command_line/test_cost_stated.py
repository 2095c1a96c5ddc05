"""What a command costs: its runs before they start, their time after the first; on standard error, not with -q; status counts."""

import io
import json
import re
from contextlib import suppress
from pathlib import Path

import pytest
from in_process import in_process
from instant_runs import instantly
from short_studies import run_design, short_study, silent
from test_study_status import Killed, killed_in, study_command

from doe import clearance
from doe.commands.functions import status_blocks
from doe.running import runner
from doe.running.runner import Ledger, RunOutcome, Stage, agenda_in
from doe.running.store import STORE, Point
from doe.workflow.problem import Problem
from doe.workflow.status import inputs_digest, study_stages, study_status
from rbdyn.base.blocks import Detail
from rbdyn.base.command import notice
from rbdyn.base.terminal import show
from rbdyn.dynamics import ensemble
from rbdyn.dynamics import simulate as module

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = [
    f"--set=numerics.{each}"
    for each in ("turns=3", "discard_turns=1", "replicates=2", "impact_window_turns=1", "extend=false")
]
MAPPED = ("--speed", "9000,12000", "--load", "1000")
UNKNOWN = """
[uncertain]
defaults = "none"
points = 16
"cage.mass_g" = { law = "normal", mean = 45.0, sd = 3.0 }
"""
LEFT = re.compile(r"^note: (?:(\d+) to )?(\d+) runs?\b.*, \d+ at once$", re.MULTILINE)
REST = re.compile(r"^note: (?:.*: )?the rest takes about [\d.]+ (?:s|min|h|days)", re.MULTILINE)
OPTIONS = {"adaptive": False, "robust": False}


def left(said: str) -> list[tuple[int, int]]:
    """Runs to come, at least and at most, in each sentence of a plan."""
    return [(int(low or high), int(high)) for low, high in LEFT.findall(said)]


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the time of the shortest runs be stated."""
    monkeypatch.setattr(runner, "NOTABLE_S", 0.0)
    monkeypatch.setattr(ensemble, "NOTABLE_S", 0.0)
    monkeypatch.setattr(ensemble, "LOOK_S", 0.0)


@pytest.mark.parametrize(("command", "more", "runs"), [("simulate", (), 3), ("map", MAPPED, 6)])
def test_rbdyn_states_what_is_left_on_standard_error(command, more, runs, eager):
    """With --json standard output is one object; -q is silent."""
    arguments = (command, EXAMPLES / "cylindrical_roller.toml", *more, *SHORT, "--workers", "1")
    shown = in_process("rbdyn", *arguments, "--json")
    assert shown.returncode == 0 and json.loads(shown.stdout) and left(shown.stderr) == [(runs, runs)]
    assert left(shown.stdout) == [] and len(REST.findall(shown.stderr)) == 1
    assert in_process("rbdyn", *arguments, "-q").stderr == ""


def test_a_sentence_is_written_at_once(monkeypatch):
    """Standard error that is no terminal is buffered: what a run still takes is of no use once it has ended."""
    written = io.BytesIO()
    monkeypatch.setattr("sys.stderr", io.TextIOWrapper(io.BufferedWriter(written), "utf-8"))
    say = notice(quiet=False)
    assert say is not None and notice(quiet=True) is None
    say("2 runs are left")
    assert written.getvalue() == b"note: 2 runs are left\n"


def scene_in(folder: Path) -> Path:
    """A scene with an unknown input, and a rig's table beside it."""
    path = folder / "scene.toml"
    path.write_text((EXAMPLES / "cylindrical_roller.toml").read_text("utf-8") + UNKNOWN, "utf-8")
    speeds = 9000, 12000, 24000
    rows = ["operation.inner_speed_rpm,power_loss_W,power_loss_W_sd", *(f"{speed},57,5" for speed in speeds)]
    (folder / "rig.csv").write_text("\n".join(rows), "utf-8")
    return path


def interrupted_after(monkeypatch: pytest.MonkeyPatch, runs: int) -> list[int]:
    """Let Ctrl-C come after so many runs; returns the seeds that ran."""
    ran = instantly(monkeypatch.setattr, 0.01)
    instant = module.simulate

    def simulate(*scene, **more):
        if len(ran) >= runs:
            raise KeyboardInterrupt
        return instant(*scene, **more)

    monkeypatch.setattr(module, "simulate", simulate)
    return ran


@pytest.mark.parametrize(
    ("command", "before", "fewest", "most"),
    [
        # Baseline and pick, or five points, after twenty design runs.
        ("study", 0, 20 + 2, 20 + 5),
        # The scene itself and sixteen input sets, or 512 with four times the replicates.
        ("uncertainty", 1, 1 + 16, 1 + 4 * 512),
        # At three conditions the scene itself, a wave of 64 or four, then 50 sets or twice as many.
        ("calibrate", 0, 3 * (1 + 64 + 50), 3 * (1 + 4 * 64 + 100)),
    ],
)
def test_doe_states_what_is_left_on_standard_error(
    command, before, fewest, most, tmp_path, monkeypatch, eager
):  # fmt: skip
    """The plan before any run and one time after the first, with --json too, where standard output is one object; -q is silent."""
    path = short_study(tmp_path) if command == "study" else scene_in(tmp_path)
    rig = ("--data", tmp_path / "rig.csv") if command == "calibrate" else ()
    for quiet in (False, True):
        interrupted_after(monkeypatch, before + 4)
        arguments = (command, path, *rig, "--out", tmp_path / str(quiet), "--workers", "1")
        shown = in_process("doe", *arguments, "-q" if quiet else "--json")
        assert shown.returncode == 130 and left(shown.stdout) == []
        if quiet:
            assert "note:" not in shown.stderr
        else:
            assert json.loads(shown.stdout)["status"] == "interrupted"
            assert left(shown.stderr) == [(fewest, most)] and len(REST.findall(shown.stderr)) == 1


def stated(study: Problem, out: Path, runs: int, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a process states that makes so many design runs and is gone then."""
    sentences: list[str] = []
    out.mkdir(exist_ok=True)
    killed_in(monkeypatch, 0, after=runs)
    with agenda_in(out / STORE, "doe study", 1, OPTIONS, inputs_digest(study, **OPTIONS), sentences.append) as keeper:
        keeper.plan(study_stages(study))
        with suppress(Killed):
            run_design(study, out, 1, keeper.announced(lambda title: silent)("design runs"), agenda=keeper)
    return sentences


def test_a_resumed_study_counts_only_what_is_left(tmp_path, monkeypatch):
    """The next process knows the runs of the first. A confirmation, which needs one run beside the baseline at least and four at
    most, found three to run and was stopped after one: two or three are left, or none for a new process."""
    study, out = Problem.load(short_study(tmp_path)), tmp_path / "out"
    assert stated(study, out, 8, monkeypatch)[0].startswith(
        "22 to 25 runs (baseline 1, design runs 20, confirmation 1 to 4), 1 at once"
    )
    assert left(f"note: {stated(study, out, 3, monkeypatch)[0]}") == [(12 + 2, 12 + 5)]
    killed_in(monkeypatch, clearance.CONFIRMATION_SEEDS, after=2)
    with pytest.raises(Killed):
        study_command(study.path, out)
    assert study_status(study, out)["runs_left"] == [2, 3]
    assert left(f"note: {stated(study, out, 0, monkeypatch)[0]}") == [(0, 3)]


def test_status_counts_every_step_to_the_end(tmp_path, monkeypatch, capsys):
    """Before anything runs and half-way: each step with its runs, and those to come."""
    study, out = Problem.load(short_study(tmp_path)), tmp_path / "out"
    names = ["baseline", "design runs", "front", "confirmation", "tolerances", "answer"]
    fresh = study_status(study, out)
    assert [each["name"] for each in fresh["stages"]] == names and fresh["runs_left"] == [22, 25]
    assert {each["state"] for each in fresh["stages"]} == {"to come"}
    stated(study, out, 8, monkeypatch)
    record = study_status(study, out)
    assert [each["state"] for each in record["stages"]] == ["done", "running", *["to come"] * 4]
    assert record["runs_left"] == [13, 16]
    show(status_blocks(record), Detail.LEAST)
    shown = capsys.readouterr().out
    assert "of 20 design points 8 done, 0 failed, 0 running, 12 to come" in shown
    assert "6 steps: baseline 0, design runs 8 of 20, front, confirmation 0 of 4, tolerances, answer" in shown
    assert "; runs to come 13 to 16" in shown and "time left" not in shown
    robust = {each.name: each for each in study_stages(study, robust=True)}
    settings = study.file.robust
    assert robust["robust"].runs_left == (3 * settings.points, robust["robust"].runs)
    assert list(robust)[-3:] == ["robust", "tolerances", "answer"]


@pytest.mark.parametrize("compile_s", [0.0, 10.0])
def test_the_first_run_tells_the_time_of_all_without_what_was_compiled(tmp_path, compile_s):
    """Of twenty runs on two threads the first takes 40 s as one of two, so nineteen take 19 / 2 as long, besides steps of 20 s."""
    said: list[str] = []
    with agenda_in(tmp_path / STORE, "doe study", 2, OPTIONS, "", said.append) as keeper:
        keeper.plan([Stage.of("design runs", 20, 80.0)], ("numerics.turns",), 20.0)
        points = [Point(name, name) for name in "abcdefghijklmnopqrst"]
        works = {point.key: 80.0 for point in points}
        count = keeper.counting(works, silent)
        ledger = Ledger(silent_ledger, silent_ledger, lambda point, outcome: count(points.index(point) + 1, 20))

        def engine(points, ledger):
            for point in points[:3]:
                result = {"cost": {"compile_s": compile_s}}
                ledger.give(point, RunOutcome(result, None, {"a": 40.0}.get(point.key, 9.0) + compile_s))

        keeper.timed(engine, works)(points, ledger)
    assert said == ["20 runs, 2 at once", "the rest takes about 6.7 min; reduce numerics.turns to shorten it"]


def test_runs_beyond_the_plan_are_estimated_anew(tmp_path):
    """Input sets that are doubled: the number of runs and their time are stated once more."""
    said: list[str] = []
    with agenda_in(tmp_path / STORE, "doe uncertainty", 1, {}, "", said.append) as keeper:
        keeper.plan([Stage.of("input sets", 2, 10.0, most=8)])
        for names in ("ab", "abcdef"):
            works = dict.fromkeys(names, 10.0)
            count = keeper.counting(works, silent)
            before = 0 if names == "ab" else 2
            count(before, len(works))

            def engine(points, ledger, count=count, before=before, works=works):
                for number, point in enumerate(points, before + 1):
                    count(number, len(works))
                    ledger.give(point, RunOutcome({"cost": {}}, None, 30.0))

            points = [Point(name, name) for name in names[before:]]
            keeper.timed(engine, works)(points, Ledger(silent_ledger, silent_ledger, silent_ledger))
    assert said == [
        "2 to 8 runs, 1 at once", "the rest takes about 30 s, and up to 3.5 min if more runs are needed",
        "input sets: 6 runs in all; the rest takes about 90 s, and up to 2.5 min if more runs are needed",
    ]  # fmt: skip


def silent_ledger(*_: object) -> None:
    """Keeps nothing."""
