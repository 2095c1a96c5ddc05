"""Folders of results: one belongs to one command and one file, and nobody writes over what another made."""

import errno
import json
import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from doe_command import doe

from rbdyn.base.command import checkpoint_message
from rbdyn.base.faults import InputError, read_bytes
from rbdyn.base.folder import MARK, OWN, output_folder

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = ("result.json", "runs.csv", "surface_*.png")


@pytest.fixture
def scenes(tmp_path) -> tuple[Path, Path]:
    """Two scene files of other content."""
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(f"title = '{name}'\n")
    return tmp_path / "one.toml", tmp_path / "two.toml"


def used(
    folder: Path, command: str, source: Path, force: bool = False, text: str = "{}", others: tuple[Path, ...] = ()
):
    """The command's whole way: claim, and write one result."""
    with output_folder(folder, command, FILES, force=force) as output:
        output.claim(source, *others)
        output.write(lambda stage: (stage / "result.json").write_text(text))
    return folder


def refusal(*arguments, **options) -> str:
    """The one sentence that refuses a command."""
    with pytest.raises(InputError) as refused:
        used(*arguments, **options)
    (sentence,) = refused.value.faults
    return sentence


def content(folder: Path) -> dict[str, bytes]:
    """All files of a folder but the lock, which holds nothing."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file() and path.stat().st_size}


def test_same_command_on_the_same_file_writes_over(tmp_path, scenes):
    one, _ = scenes
    folder = used(tmp_path / "out", "rbdyn simulate", one)
    one.write_text("title = 'edited'\n")
    assert used(folder, "rbdyn simulate", one) == folder
    assert {path.name for path in folder.iterdir()} - OWN == {"result.json"}
    # The file and the folder moved together, then the file alone.
    (tmp_path / "elsewhere").mkdir()
    moved = [Path(shutil.move(path, tmp_path / "elsewhere")) for path in (folder, one)]
    used(moved[0], "rbdyn simulate", moved[1])
    used(moved[0], "rbdyn simulate", Path(shutil.copy(moved[1], tmp_path / "copy.toml")))
    # A folder with files under other names only, or with nothing yet.
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("")
    used(tmp_path / "mine", "rbdyn simulate", moved[1])
    for command, source in (("rbdyn map", moved[1]), ("rbdyn ball", scenes[1])):
        with output_folder(tmp_path / "empty", command, FILES) as output:
            output.claim(source)


@pytest.mark.parametrize(("command", "which"), [("rbdyn map", 0), ("rbdyn simulate", 1), ("doe", 0)])
def test_another_command_or_file_is_refused_and_nothing_is_written(tmp_path, scenes, command, which):
    folder = used(tmp_path / "out", "rbdyn simulate", scenes[0])
    before = content(folder)
    assert refusal(folder, command, scenes[which]) == (
        f"--out {folder}: holds results of rbdyn simulate from {scenes[0]}; name another folder or remove this one"
    )
    assert content(folder) == before
    used(folder, command, scenes[which], force=True)


@pytest.mark.parametrize("text", ["{", "[]", "{}", "null", '{"command": "rbdyn map"}', '{"command": 1, "file": 2}'])
def test_note_that_cannot_be_read_is_refused(tmp_path, scenes, text):
    folder = used(tmp_path / "out", "rbdyn map", scenes[0])
    (folder / MARK).write_text(text)
    assert refusal(folder, "rbdyn map", scenes[1]) == (
        f"--out {folder}: its made_by.json cannot be read; name another folder, remove this one or add --force"
    )
    used(folder, "rbdyn map", scenes[1], force=True)


@pytest.mark.parametrize("name", ["result.json", "Result.JSON", "surface_a.png", "RUNS.csv"])
def test_a_file_of_somebody_else_stays(tmp_path, scenes, name):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / name).write_text("mine")
    assert refusal(folder, "rbdyn map", scenes[0]) == (
        f"--out {folder}: {name} would be written over, but rbdyn map did not make it or it was changed since; "
        "name another folder, move it away or add --force"
    )
    assert content(folder) == {name: b"mine"} and {path.name for path in folder.iterdir()} == {name}
    used(folder, "rbdyn map", scenes[0], force=True)
    assert (folder / "result.json").read_text() == "{}"


def test_a_file_that_was_changed_since_or_is_a_link_stays(tmp_path, scenes):
    folder = used(tmp_path / "out", "rbdyn map", scenes[0])
    digests = json.loads((folder / MARK).read_text())["files"]
    assert digests == {"result.json": "44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a"}
    (folder / "result.json").write_text("edited")
    assert "it was changed since" in refusal(folder, "rbdyn map", scenes[0])
    (tmp_path / "precious").write_text("{}")
    for link in (os.symlink, os.link):
        (folder / "result.json").unlink()
        link(tmp_path / "precious", folder / "result.json")
        if link is os.symlink:
            assert "did not make it" in refusal(folder, "rbdyn map", scenes[0])
        used(folder, "rbdyn map", scenes[0], force=True, text="new")
        assert (tmp_path / "precious").read_text() == "{}" and (folder / "result.json").read_text() == "new"


@pytest.mark.parametrize("link", [None, os.symlink, os.link])
@pytest.mark.parametrize("force", [False, True])
def test_a_command_never_writes_over_a_file_that_it_reads(tmp_path, scenes, link, force):
    folder = used(tmp_path / "out", "rbdyn map", scenes[0])
    read = folder / "result.json"
    if link:
        link(read, tmp_path / "input.json")
        read = tmp_path / "input.json"
    sentence = f"--out {folder}: result.json would be written over, but this command reads it; name another folder"
    assert refusal(folder, "rbdyn map", read, force=True) == sentence
    assert refusal(folder, "rbdyn map", scenes[0], force=force, others=(read,)) == sentence
    # A file that is read only as the command runs is found before anything is moved.
    with (
        pytest.raises(InputError, match="this command reads it"),
        output_folder(folder, "rbdyn map", FILES, force=force) as output,
    ):
        output.claim(scenes[0])
        read_bytes(read)
        output.write(lambda stage: (stage / "result.json").write_text("new"))
    assert (folder / "result.json").read_text() == "{}" and {path.name for path in folder.iterdir()} <= OWN | {
        "result.json"
    }
    used(folder, "rbdyn map", scenes[0])


def test_a_folder_in_the_place_of_a_file_is_refused(tmp_path, scenes):
    (tmp_path / "out" / "result.json").mkdir(parents=True)
    assert refusal(tmp_path / "out", "rbdyn map", scenes[0], force=True) == (
        f"--out {tmp_path / 'out'}: result.json is a folder where a file belongs; move it away or name another folder"
    )


def test_one_command_at_a_time_works_in_a_folder(tmp_path, scenes):
    code = (
        "import sys; from pathlib import Path; from rbdyn.base.folder import output_folder\n"
        "with output_folder(Path(sys.argv[1]), 'rbdyn map', ()) as output:\n"
        "    output.claim(Path(sys.argv[2])); print(flush=True); sys.stdin.read()"
    )
    folder = tmp_path / "out"
    line = [sys.executable, "-c", code, str(folder), str(scenes[0])]
    process = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    process.stdout.readline()
    holder = f"process {process.pid} on {socket.gethostname()}"
    sentence = f"--out {folder}: {holder} works in it; wait until it has ended, or name another folder"
    assert refusal(folder, "rbdyn map", scenes[0]) == sentence
    process.kill()
    process.communicate()
    used(folder, "rbdyn map", scenes[0])
    with output_folder(folder, "rbdyn map", FILES) as output:
        output.claim(scenes[0])
        assert "works in it; wait" in refusal(folder, "rbdyn map", scenes[0])


@pytest.mark.parametrize("moved", [0, 1])
def test_files_of_an_interrupted_command_are_its_own(tmp_path, scenes, monkeypatch, moved):
    folder = used(tmp_path / "out", "rbdyn map", scenes[0])
    replace, names = os.replace, list[str]()

    def stop(source, target):
        names.append(Path(target).name)
        if names.count("result.json") > moved or "runs.csv" in names:
            raise KeyboardInterrupt
        replace(source, target)

    def write(stage):
        for name in ("result.json", "runs.csv"):
            (stage / name).write_text("new")

    with (
        monkeypatch.context() as patch,
        pytest.raises(KeyboardInterrupt),
        output_folder(folder, "rbdyn map", FILES) as output,
    ):
        output.claim(scenes[0])
        patch.setattr("rbdyn.base.folder.os.replace", stop)
        patch.setattr("rbdyn.base.folder.write_json", lambda path, mark: path.write_text(json.dumps(mark)))
        output.write(write)
    assert (folder / "result.json").read_text() == ("new" if moved else "{}") and not (folder / "runs.csv").exists()
    used(folder, "rbdyn map", scenes[0])
    (folder / "runs.csv").write_text("mine")
    assert "runs.csv would be written over" in refusal(folder, "rbdyn map", scenes[0])


def test_a_loop_of_links_is_refused(tmp_path, scenes):
    (tmp_path / "loop").symlink_to("loop")
    assert refusal(tmp_path / "loop", "doe", scenes[0]).endswith(
        "cannot be written to (Too many levels of symbolic links); name another folder"
    )
    study = EXAMPLES / "clearance_study.toml"
    for line in (["study", study], ["uncertainty", EXAMPLES / "cylindrical_roller.toml"], ["design", study],
                 ["fit", study, "--data", EXAMPLES / "ccd_table4.csv"], ["front", study, "--data", EXAMPLES / "ccd_table4.csv"]):  # fmt: skip
        shown = doe(*map(str, line), "--out", str(tmp_path / "loop"))
        assert (shown.returncode, shown.stderr.count("\n")) == (2, 1) and "symbolic links" in shown.stderr


def test_a_full_disk_is_told_with_the_file(tmp_path, scenes):
    def full(stage):
        (stage / "result.json").write_text("{}")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError) as refused, output_folder(tmp_path / "out", "rbdyn map", FILES) as output:
        output.claim(scenes[0])
        output.write(full)
    assert refused.value.filename == str(tmp_path / "out" / "result.json")
    assert not (tmp_path / "out").exists()


def test_a_pipe_is_read_once_and_blames_nothing(tmp_path, command):
    """Command line: rbdyn ball <(cat scene.toml) --out DIR."""
    scene = (EXAMPLES / "angular_contact_ball.toml").read_text(encoding="utf-8")
    for edited, code in ((scene, 0), (scene, 0), (scene + "\n", 2)):
        reader, writer = os.pipe()
        os.write(writer, edited.encode())
        os.close(writer)
        shown = command("ball", f"/dev/fd/{reader}", "--out", tmp_path / "out")
        os.close(reader)
        assert shown.returncode == code, shown.stderr
    assert "holds results of rbdyn ball from another input" in shown.stderr
    missing = command("ball", tmp_path / "none.toml", "--out", tmp_path / "out")
    assert missing.stderr == f"{tmp_path / 'none.toml'}: no such file; check the path\n"


def test_a_table_that_a_fit_reads_stays(tmp_path):
    """Command line: doe fit --data runs.csv --out ."""
    shutil.copy(EXAMPLES / "ccd_table4.csv", tmp_path / "runs.csv")
    before = content(tmp_path)
    line = ["fit", "--data", str(tmp_path / "runs.csv"), "--out", str(tmp_path), "--response", "power_loss_W"]
    for force in ([], ["--force"]):
        shown = doe(*line, *force)
        assert (shown.returncode, shown.stderr) == (
            2, f"--out {tmp_path}: runs.csv would be written over, but this command reads it; name another folder\n",
        )  # fmt: skip
        assert content(tmp_path) == before


def test_a_study_does_not_write_over_a_table_that_it_names(tmp_path):
    """Command line: a published table in the folder of the results."""
    for name in ("cylindrical_roller.toml", "bearing_chains.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    (tmp_path / "out").mkdir()
    shutil.copy(EXAMPLES / "ccd_table4.csv", tmp_path / "out" / "front.csv")
    study = (EXAMPLES / "clearance_study.toml").read_text(encoding="utf-8").replace("ccd_table4.csv", "out/front.csv")
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    shown = doe("study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out"), "--force")
    assert shown.returncode == 2 and "front.csv would be written over, but this command reads it" in shown.stderr


def test_commands_keep_to_the_rule(tmp_path, command):
    """Those of ``doe`` on one study share a folder; other studies, chains and scenes are refused before they run."""
    for name in ("cylindrical_roller.toml", "clearance_study.toml", "ccd_table4.csv", "bearing_chains.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    study, other, out = tmp_path / "clearance_study.toml", tmp_path / "other.toml", str(tmp_path / "out")
    other.write_text(study.read_text(encoding="utf-8").replace("seed = 1", "seed = 2"), encoding="utf-8")
    assert doe("design", str(study), "--out", out, "-q").returncode == 0
    assert doe("fit", str(study), "--data", str(tmp_path / "ccd_table4.csv"), "--out", out, "-q").returncode == 0
    kept = content(Path(out))
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
    assert content(Path(out)) == kept


def test_two_processes_that_write_one_file_leave_a_whole_one(tmp_path):
    code = "import sys; from rbdyn.base.files import write_json\nfor k in range(300): write_json(sys.argv[1], {'k': [k] * 999})"
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
