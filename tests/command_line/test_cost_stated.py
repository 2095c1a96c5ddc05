"""What a command still costs: stated once on standard error, not with -q, with what is left alone; status counts all steps."""

from __future__ import annotations

import io
import json
import re
from contextlib import suppress
from pathlib import Path

import pytest
from in_process import in_process
from instant_runs import instantly
from short_studies import short_study, silent
from test_study_status import Killed, killed_in, study_command

from doe import clearance
from doe.commands.study import status_blocks
from doe.running.runner import Ledger, Stage, agenda_in
from doe.running.store import Point
from doe.study_file import Study
from doe.workflow.runs import STORE, run_design
from doe.workflow.status import inputs_digest, study_stages, study_status
from rbdyn.base import forecast
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
LEFT = re.compile(r"^note: (?:(\d+) to )?(\d+) runs? of [\d. to]+ shaft turns in all remains?, \d+ at once: ", re.MULTILINE)  # fmt: skip
OPTIONS = {"adaptive": False, "robust": False}


def left(said: str) -> list[tuple[int, int]]:
    """Runs that are left, at least and at most, in each sentence on what is left."""
    return [(int(low or high), int(high)) for low, high in LEFT.findall(said)]


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let what is left be stated of the shortest runs."""
    monkeypatch.setattr(forecast, "NOTABLE_S", 0.0)
    monkeypatch.setattr(ensemble, "FIRST_LOOK_S", 0.0)


@pytest.mark.parametrize(("command", "more", "runs"), [("simulate", (), 3), ("map", MAPPED, 6)])
def test_rbdyn_states_what_is_left_on_standard_error(command, more, runs, eager):
    """With --json standard output is one object; -q is silent."""
    arguments = (command, EXAMPLES / "cylindrical_roller.toml", *more, *SHORT, "--workers", "1")
    shown = in_process("rbdyn", *arguments, "--json")
    assert shown.returncode == 0 and json.loads(shown.stdout) and left(shown.stderr)[0] == (runs, runs)
    assert left(shown.stdout) == []
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
        # Baseline and pick, or five points, after what is left of twenty design runs.
        ("study", 0, 18 + 2, 18 + 5),
        # Sixteen input sets, or 512 with four times the replicates, and the scene itself.
        ("uncertainty", 1, 16 - 1, 4 * 512 - 1),
        # At three conditions the scene itself, a wave of 64 or four, then 50 sets or twice as many.
        # Stated before anything runs.
        ("calibrate", 0, 3 * (1 + 64 + 50), 3 * (1 + 4 * 64 + 100)),
    ],
)
def test_doe_states_what_is_left_on_standard_error(
    command, before, fewest, most, tmp_path, monkeypatch, eager
):  # fmt: skip
    """After two runs, of a calibration before any, with --json too, where standard output is one object; -q is silent."""
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
            assert left(shown.stderr) == [(fewest, most)]


def stated(study: Study, out: Path, runs: int, monkeypatch: pytest.MonkeyPatch) -> list[str]:
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
    """The first process counts from its second run on, the next at once, from the store. A confirmation, which needs one run beside
    the baseline at least and four at most, found three to run and was stopped after one: two or three are left, or none for a new
    process."""
    study, out = Study.load(short_study(tmp_path)), tmp_path / "out"
    first = stated(study, out, 8, monkeypatch)
    assert left(f"note: {first[0]}") == [(18 + 1, 18 + 4)] and len(first) == 1
    again = stated(study, out, 3, monkeypatch)
    assert left(f"note: {again[0]}") == [(12 + 1, 12 + 4)] and len(again) == 1
    killed_in(monkeypatch, clearance.CONFIRMATION_SEEDS, after=2)
    with pytest.raises(Killed):
        study_command(study.path, out)
    assert study_status(study, out)["runs_left"] == [2, 3]
    assert left(f"note: {stated(study, out, 0, monkeypatch)[0]}") == [(0, 3)]


def test_status_counts_every_step_to_the_end(tmp_path, monkeypatch, capsys):
    """Before anything runs and half-way: each step with its runs, those that are left, and a range of time that holds the time."""
    study, out = Study.load(short_study(tmp_path)), tmp_path / "out"
    names = ["baseline", "design runs", "front", "confirmation", "tolerances", "answer"]
    fresh = study_status(study, out)
    assert [each["name"] for each in fresh["stages"]] == names and fresh["runs_left"] == [22, 25]
    assert {each["state"] for each in fresh["stages"]} == {"to come"} and fresh["left_range_s"] is None
    stated(study, out, 8, monkeypatch)
    record = study_status(study, out)
    assert [each["state"] for each in record["stages"]] == ["done", "running", *["to come"] * 4]
    assert record["runs_left"] == [13, 16]
    low, high = record["left_range_s"]
    assert 0.0 < low <= record["left_s"] <= high
    assert record["predicted_s"][0] < record["predicted_s"][1] and record["took_s"] is None
    show(status_blocks(record), Detail.LEAST)
    shown = capsys.readouterr().out
    assert "6 steps: baseline 0, design runs 8 of 20, front, confirmation 0 of 4, tolerances, answer" in shown
    assert "runs left 13 to 16; time left " in shown and "Predicted for the last command from its start: " in shown
    robust = {each.name: each for each in study_stages(study, robust=True)}
    settings = study.file.robust
    assert robust["robust"].runs_left == (3 * settings.points, robust["robust"].runs)
    assert list(robust)[-3:] == ["robust", "tolerances", "answer"]


def test_a_run_under_way_states_what_is_left_before_it_ends(tmp_path, monkeypatch):
    """Of a slow run the share that is done tells, with how much longer drift may make it."""
    sentences: list[str] = []
    monkeypatch.setattr("doe.running.runner.LOOK_S", 0.0)
    with agenda_in(tmp_path / STORE, "doe study", 2, OPTIONS, "", sentences.append) as keeper:
        keeper.plan([Stage.of("design runs", 20, 80.0)])

        def engine(points, ledger):
            keeper.hear("a", 0.25, 20.0)

        works, nowhere = {"a": 80.0, "b": 80.0}, Ledger(print, print, print)
        keeper.timed(engine, works, growth=8.0)([Point("a", "a"), Point("b", "b")], nowhere)
    (sentence,) = sentences
    # A second a shaft turn: 20 runs of 80 turns on two threads are 800 s, in the range.
    assert sentence.startswith("20 runs of 1600 shaft turns in all remain, 2 at once: ")
    assert sentence.endswith("if figures drift")
    low, high = (each for each in keeper.agenda.prediction_s)
    assert low < 800.0 < high
