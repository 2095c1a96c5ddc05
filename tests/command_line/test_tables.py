"""Tables on terminals of several widths: no word of a heading is broken."""

import io
import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import EXAMPLE, ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from instant_runs import instant_result, instantly
from short_studies import short_study

from doe.cli import app as doe_app
from rbdyn.base import terminal
from rbdyn.base.blocks import Table
from rbdyn.base.terminal import FRAME, PADDING, fitting_parts
from rbdyn.cli.app import app as rbdyn_app

EXAMPLES = ROOT / "examples"
BALL = str(EXAMPLES / "angular_contact_ball.toml")
TABLE = str(EXAMPLES / "ccd_table4.csv")
STUDY = str(EXAMPLES / "clearance_study.toml")
AXIAL = ("--set", "bearing.bore_mm=40.0", "--set", "operation.radial_load_N=0.0")
COMMANDS = {
    "ball": (rbdyn_app, ("ball", BALL, "--verbose")),
    "sweep": (rbdyn_app, ("ball", BALL, "--sweep", "operation.inner_speed_rpm=1000:9000:3")),
    "preload": (rbdyn_app, ("ball", BALL, *AXIAL, "--preload", "50,100,150")),
    "two rows": (rbdyn_app, ("ball", str(EXAMPLES / "double_decker.toml"))),
    "simulate": (rbdyn_app, ("simulate", str(EXAMPLE), "--verbose")),
    "design": (doe_app, ("design", STUDY, "--verbose")),
    "fit": (doe_app, ("fit", STUDY, "--data", TABLE, "--verbose")),
    "front": (doe_app, ("front", STUDY, "--data", TABLE, "--point", "0.017,0.187,0.285")),
    "chain": (doe_app, ("chain", str(EXAMPLES / "bearing_chains.toml"), "--verbose")),
}


def whole(result):
    """With its cost."""
    return replace(result, cost={"wall_s": 1.0, "compile_s": 0.0})


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self) -> bool:
        return True


def printed(monkeypatch, width: int, table: tuple) -> list[str]:
    """Lines of a table on a terminal."""
    with monkeypatch.context() as patch:
        screen = Screen()
        patch.setattr(sys, "stdout", screen)
        patch.setenv("COLUMNS", str(width))
        patch.setenv("TERM", "dumb")
        terminal.show([Table(*table)])
    return screen.getvalue().splitlines()


def tables_of(monkeypatch, run) -> list[tuple]:
    """Headings and rows of the tables that are printed meanwhile, without titles."""
    tables = []

    def keep(texts, room):
        header, *rows = zip(*texts, strict=True)
        tables.append(("", header, rows))
        return fitting_parts(texts, room)

    with monkeypatch.context() as patch:
        patch.setattr(terminal, "fitting_parts", keep)
        run()
    return tables


def assert_unbroken(monkeypatch, tables) -> None:
    """Every word of every heading stands whole in the lines, and these fit."""
    assert tables
    for width in (80, 100, 120):
        for table in tables:
            lines = printed(monkeypatch, width, table)
            words = {word for line in lines for word in line.split()}
            assert {word for name in table[1] for word in name.split()} <= words, (width, table[1])
            assert max(map(len, lines)) <= width


@pytest.mark.parametrize("name", COMMANDS)
def test_no_word_of_a_heading_is_broken(monkeypatch, tmp_path, name):
    study = short_study(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rbdyn.dynamics.simulate.simulate", lambda scene, *rest, **more: whole(instant_result(scene)))
    app, arguments = COMMANDS[name]
    here = [str(study) if each is STUDY else each for each in arguments]
    assert_unbroken(monkeypatch, tables_of(monkeypatch, lambda: app(here, standalone_mode=False)))


def test_no_word_of_a_heading_of_a_study_is_broken(monkeypatch, tmp_path):
    from doe.commands.functions import study
    from doe.report.files import summary

    def write(outcome, folder: Path) -> dict:
        record = summary(outcome).as_dict() | {"files": []}
        (folder / "summary.json").write_text(json.dumps(record), encoding="utf-8")
        return record

    path = short_study(tmp_path)
    instantly(monkeypatch.setattr)
    monkeypatch.setattr("doe.report.files.write", write)
    assert_unbroken(monkeypatch, tables_of(monkeypatch, lambda: study(path, tmp_path / "out", workers=2, verbose=True)))


@pytest.mark.parametrize("room", [80, 100, 120, 160])
def test_columns_fill_the_room_and_only_what_has_none_is_broken(room):
    header = ["run", *(f"a_long_name_of_factor_{number}" for number in range(9)), "a verdict in words", "87.09 ± 0.35"]
    rows = [["1", *["0.125"] * 9, "far more than its error, and in all of the replicates", "1.2 ± 0.4"]]
    broken = fitting_parts([*zip(header, *rows, strict=True)], room)
    assert sorted({place for part in broken for place, _ in part}) == list(range(len(header)))
    for part in broken:
        assert part[0][0] == 0 and FRAME + sum(width + PADDING for _, width in part) <= room
        assert all(width >= max(map(len, header[place].split())) for place, width in part)
    assert fitting_parts([("x" * 300, "1"), ("y" * 300, "2")], room)[0][1][1] < room
    assert fitting_parts([("only",)], room) == [[(0, 4)]]


@st.composite
def tables(draw) -> tuple[int, Table]:
    """A width and a table whose headings have words of less than half of it."""
    width = draw(st.sampled_from((40, 60, 80, 100)))
    words = st.text("abcdefgh", min_size=1, max_size=width // 2 - 4)
    columns = draw(st.integers(1, 7))
    heads = st.lists(words, min_size=1, max_size=3).map(" ".join)
    cells = st.one_of(st.just(""), st.just("11.62 ± 0.71 % less"), st.lists(words, max_size=6).map(" ".join))
    rows = st.lists(cells, min_size=columns, max_size=columns)
    return width, Table(
        "", draw(st.lists(heads, min_size=columns, max_size=columns)), draw(st.lists(rows, min_size=1, max_size=3))
    )


@settings(max_examples=150, deadline=None)
@given(tables())
def test_random_tables_never_break_a_word_of_a_heading(case):
    """Property: at 40 to 100 columns every word of every heading stands whole, and no line is wider than the page."""
    width, table = case
    lines = terminal.text([table], width=width).splitlines()
    assert {word for name in table.header for word in name.split()} <= {word for line in lines for word in line.split()}
    assert max(map(len, lines)) <= width


def test_a_value_with_its_error_is_one_line_at_80_columns():
    """Unit: names of rows give way first, so that a change is not folded and the table is not continued below."""
    change = "231.4685 ± 0.0079 % less"
    rows = [("whirl deviation ratio", "231.4685 ± 0.0079", "231.4685 ± 0.0079", change)]
    text = terminal.text([Table("", ("response", "baseline", "pick", "change"), rows)], width=80)
    assert change in text and text.count("response") == 1 and "whirl deviation ratio" not in text
