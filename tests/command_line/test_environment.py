"""Whatever the environment, the clock, names and paths are: a sentence or a result, and no control character on a terminal."""

import io
import os
import re
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

import doe
from doe.running.runner import agenda_in
from rbdyn.base import terminal
from rbdyn.base.blocks import Heading, Paragraph, Remarks, Table
from rbdyn.base.faults import InputError
from rbdyn.base.files import write_json
from rbdyn.base.identity import identity_of
from rbdyn.base.notes import Note
from rbdyn.base.streams import escaped
from rbdyn.base.workbook import write_workbook
from rbdyn.compiled.kernel import cache_folder

EXAMPLES = Path(__file__).parents[2] / "examples"
BALL = EXAMPLES / "angular_contact_ball.toml"
EVIL = "a\x1b]0;title\x07\x1b[31mred\x9b2J\rb"


@pytest.mark.parametrize(
    ("variable", "value", "most"),
    [
        ("NUMBA_NUM_THREADS", "0", 10_000),
        ("NUMBA_NUM_THREADS", "abc", 10_000),
        ("SOURCE_DATE_EPOCH", "abc", 253_402_300_799),
        ("SOURCE_DATE_EPOCH", "9" * 30, 253_402_300_799),
    ],
)
def test_a_variable_that_ends_a_library_is_a_sentence(command, monkeypatch, variable, value, most):
    monkeypatch.setenv(variable, value)
    shown = command("ball", BALL)
    least = int(variable == "NUMBA_NUM_THREADS")
    assert (shown.returncode, shown.stderr) == (
        2, f"environment variable {variable} = {value}: must be a whole number from {least} to {most}; unset it\n",
    )  # fmt: skip


def test_a_process_without_home_or_picture_window_says_nothing_of_it(tmp_path):
    line = [sys.executable, "-m", "rbdyn", "ball", str(BALL), "--out", str(tmp_path / f"out{EVIL[:5]}"), "-q"]
    bare = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME")}
    # Compiled code alone is taken from where it is: a process without a folder for it compiles for seconds.
    folder = cache_folder()
    assert folder is not None
    bare["NUMBA_CACHE_DIR"] = str(folder.parents[1])
    shown = subprocess.run(
        line, capture_output=True, text=True, env={**bare, "HOME": "/nowhere", "MPLBACKEND": "nonsense"}
    )
    assert (shown.returncode, shown.stderr) == (0, "") and "\x1b" not in shown.stdout and "\\x1b]0;" in shown.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo terminal")
@pytest.mark.parametrize("arguments", [["ball", f"none{EVIL}.toml"], ["ball", f"--no{EVIL}"], ["keys", EVIL]])
def test_a_terminal_gets_no_control_character_of_a_name(arguments):
    import pty

    main, side = pty.openpty()
    process = subprocess.Popen([sys.executable, "-m", "rbdyn", *arguments], stdout=side, stderr=side, stdin=side)
    os.close(side)
    seen = b""
    try:
        while piece := os.read(main, 1024):
            seen += piece
    except OSError:
        pass  # the other end is closed
    process.wait()
    os.close(main)
    assert b"\x1b" not in seen and b"\x07" not in seen and b"\\x1b" in seen


def test_blocks_escape_names_and_keep_their_own_style():
    blocks = [
        Heading(EVIL),
        Paragraph(EVIL),
        Remarks((Note("remark", EVIL),)),
        Table(EVIL, (EVIL, "x"), [(EVIL, EVIL)]),
    ]
    for width, bold in ((None, False), (60, True)):
        text = terminal.text(blocks, width=width, bold=bold)
        assert not re.search(r"[\x07\x9b\r]", text) and set(re.findall("\x1b.{3}", text)) <= {"\x1b[1m", "\x1b[0m"}
        assert ("\x1b" in text) == bold
    assert escaped("ü\tß\r\n") == "ü\tß\r\n" and escaped("a\rb\u202e") == "a\\rb\\u202e"


@pytest.mark.parametrize("year", ["1901", "1970", "2026", "2108", "9999"])
def test_a_workbook_is_written_whatever_the_clock_says(tmp_path, monkeypatch, year):
    import time

    wrong = (int(year), 1, 1, 0, 0, 0, 0, 1, 0)
    monkeypatch.setattr(time, "localtime", lambda *_: time.struct_time(wrong))
    identity = replace(identity_of("doe fit", {}, []), date=f"{year}-01-01")
    (tmp_path / "t.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    write_workbook(tmp_path / "tables.xlsx", [tmp_path / "t.csv"], identity)
    content = (tmp_path / "tables.xlsx").read_bytes()
    write_workbook(tmp_path / "tables.xlsx", [tmp_path / "t.csv"], identity)
    assert (tmp_path / "tables.xlsx").read_bytes() == content
    from openpyxl import load_workbook

    assert load_workbook(io.BytesIO(content))["t"]["B2"].value == 2
    (date,) = {entry.date_time[0] for entry in zipfile.ZipFile(io.BytesIO(content)).infolist()}
    assert date == min(max(int(year), 1980), 2107)


def test_a_clock_that_goes_back_gives_no_negative_time(tmp_path, monkeypatch):
    with agenda_in(tmp_path / "study.sqlite", "doe study", 1) as keeper:
        keeper.plan([])
        monkeypatch.setattr("time.time", lambda: 0.0)
        assert 0.0 <= keeper.elapsed_s < 60.0


def test_save_names_what_no_file_can_be(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = doe.chain(EXAMPLES / "pocket_chain.toml")
    for path, words in ((".", "is a folder; name a file in it"), (tmp_path, "is a folder"), (3, "must be the path of a file"),
                        ("none/a.json", "missing folder none; make it first"), ("", "is a folder")):  # fmt: skip
        with pytest.raises(InputError, match=words):
            answer.save(path)
        with pytest.raises(InputError, match=words):
            write_json(path, {})
    assert not list(tmp_path.iterdir())
    assert hash(answer) == hash(doe.chain(EXAMPLES / "pocket_chain.toml")) and answer in {answer}


def test_values_that_cannot_be_copied_are_named(make_scene):
    scene = make_scene()
    for changes in (((key, 1.0) for key in ("cage.mass_g",)), {"cage.mass_g": (value for value in (1.0,))}):
        with pytest.raises(InputError) as refused:
            scene.changed(changes)
        assert len(refused.value.faults) == 1
    assert refused.value.faults[0] == (
        "changed 'cage.mass_g': holds a value that cannot be copied (cannot pickle 'generator' object); "
        "give numbers, texts, lists and tables"
    )
