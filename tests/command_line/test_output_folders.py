"""Folders of results: one belongs to one command and one file, and nobody writes over what another made."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from doe_command import doe

from rbdyn.base.command import checkpoint_message, output_folder
from rbdyn.base.faults import InputError

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def scenes(tmp_path) -> tuple[Path, Path]:
    """Two scene files of other content."""
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(f"title = '{name}'\n")
    return tmp_path / "one.toml", tmp_path / "two.toml"


def used(folder: Path, command: str, source: Path) -> Path:
    """A folder with a result in it."""
    (output_folder(folder, command, source) / "result.json").write_text("{}")
    return folder


def test_same_command_on_the_same_file_writes_over(tmp_path, scenes):
    one, _ = scenes
    folder = used(tmp_path / "out", "rbdyn simulate", one)
    one.write_text("title = 'edited'\n")
    assert output_folder(folder, "rbdyn simulate", one) == folder
    # The file and the folder moved together, then the file alone.
    (tmp_path / "elsewhere").mkdir()
    moved = [Path(shutil.move(path, tmp_path / "elsewhere")) for path in (folder, one)]
    output_folder(moved[0], "rbdyn simulate", moved[1])
    output_folder(moved[0], "rbdyn simulate", Path(shutil.copy(moved[1], tmp_path / "copy.toml")))
    # A folder that holds nothing of ours, or nothing yet.
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("")
    output_folder(tmp_path / "mine", "rbdyn simulate", one if one.exists() else moved[1])
    output_folder(tmp_path / "empty", "rbdyn map", moved[1])
    output_folder(tmp_path / "empty", "rbdyn ball", scenes[1])


@pytest.mark.parametrize(("command", "which"), [("rbdyn map", 0), ("rbdyn simulate", 1), ("doe", 0)])
def test_another_command_or_file_is_refused_and_nothing_is_written(tmp_path, scenes, command, which):
    folder = used(tmp_path / "out", "rbdyn simulate", scenes[0])
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(InputError) as refused:
        output_folder(folder, command, scenes[which])
    assert refused.value.faults == [
        f"--out {folder}: holds results of rbdyn simulate from {scenes[0]}; name another folder or remove this one"
    ]
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize("text", ["{", "[]", "{}", "null", '{"command": "rbdyn map"}', '{"command": 1, "file": 2}'])
def test_note_that_cannot_be_read_is_refused(tmp_path, scenes, text):
    folder = used(tmp_path / "out", "rbdyn map", scenes[0])
    (folder / "made_by.json").write_text(text)
    with pytest.raises(
        InputError, match=r"--out \S+out: its made_by\.json cannot be read; name another folder or remove"
    ):
        output_folder(folder, "rbdyn map", scenes[1])


def test_commands_keep_to_the_rule(tmp_path, command):
    """Those of ``doe`` on one study share a folder; other studies, chains and scenes are refused before they run."""
    for name in ("cylindrical_roller.toml", "clearance_study.toml", "ccd_table4.csv", "bearing_chains.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    study, other, out = tmp_path / "clearance_study.toml", tmp_path / "other.toml", str(tmp_path / "out")
    other.write_text(study.read_text(encoding="utf-8").replace("seed = 1", "seed = 2"), encoding="utf-8")
    assert doe("design", str(study), "--out", out, "-q").returncode == 0
    assert doe("fit", str(study), "--data", str(tmp_path / "ccd_table4.csv"), "--out", out, "-q").returncode == 0
    kept = {path.name: path.read_bytes() for path in Path(out).iterdir()}
    assert {"design.json", "fit.json", "made_by.json"} <= set(kept)
    scene = tmp_path / "cylindrical_roller.toml"
    refusals = [
        doe("study", str(other), "--out", out),
        doe("design", str(other), "--out", out),
        doe("chain", str(tmp_path / "bearing_chains.toml"), "--out", out),
        command("simulate", scene, "--out", out),
        command("map", scene, "--speed", "1000", "--load", "100", "--out", out),
        command("accuracy", scene, "--out", out),
        command("ball", EXAMPLES / "angular_contact_ball.toml", "--out", out),
        command(
            "ball",
            EXAMPLES / "angular_contact_ball.toml",
            "--sweep",
            "operation.axial_load_N=1,2",
            "--out",
            out,
            "--json",
        ),
    ]
    sentence = f"--out {out}: holds results of doe from {study}; name another folder or remove this one"
    for shown in refusals:
        assert (shown.returncode, shown.stderr.strip()) == (2, sentence)
    assert json.loads(refusals[-1].stdout)["faults"] == [sentence]
    assert {path.name: path.read_bytes() for path in Path(out).iterdir()} == kept


def test_two_processes_that_write_one_file_leave_a_whole_one(tmp_path):
    code = "import sys; from rbdyn.result import write_json\nfor k in range(300): write_json(sys.argv[1], {'k': [k] * 999})"
    path = tmp_path / "result.json"
    both = [subprocess.Popen([sys.executable, "-c", code, str(path)]) for _ in range(2)]
    assert [process.wait(60) for process in both] == [0, 0]
    assert json.loads(path.read_text()) == {"k": [299] * 999} and os.listdir(tmp_path) == ["result.json"]


def test_ctrl_c_says_kept_only_where_something_is(tmp_path):
    for path, words in (
        (None, ""),
        (tmp_path / "none", ""),
        (tmp_path, f"saved in {tmp_path}; start the command again"),
    ):
        with pytest.raises(KeyboardInterrupt) as stopped, checkpoint_message(path):
            raise KeyboardInterrupt
        assert words in str(stopped.value) and bool(str(stopped.value)) == bool(words)
