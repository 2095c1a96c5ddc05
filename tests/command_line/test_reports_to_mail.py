"""What --out writes to be mailed: report.html in one file, tables.xlsx with the numbers of the CSV files."""

import csv
import re
import subprocess
import sys
import time
from html import unescape
from pathlib import Path

import pandas as pd
import pytest
from in_process import in_process

from rbdyn.base.html import inline
from rbdyn.base.identity import Identity
from rbdyn.base.workbook import MOST_CELLS, sheet_name, write_workbook

EXAMPLES = Path(__file__).parents[2] / "examples"
STUDY, RUNS = EXAMPLES / "clearance_study.toml", EXAMPLES / "ccd_table4.csv"
ROLLERS, BALLS, SEVENTY = (
    EXAMPLES / f"{name}.toml" for name in ("cylindrical_roller", "angular_contact_ball", "angular_contact_7014")
)
SHORT = ("--turns", "2", "--replicates", "1", "--set", "numerics.companion=false", "-q")
# Each command with its tables, the bearing and a word of its point.
COMMANDS = {
    "simulate": (("rbdyn", "simulate", ROLLERS, *SHORT), {"figures.csv", "history.csv"}, "1300 N radial"),
    "map": (("rbdyn", "map", ROLLERS, "--speed", "20000,24000", "--load", "900", *SHORT), {"map.csv"}, "inner speed 20000 to 24000 rpm"),
    "ball": (("rbdyn", "ball", BALLS), {"balls.csv"}, "200 N radial, 200 N axial"),
    "sweep": (("rbdyn", "ball", BALLS, "--sweep", "operation.axial_load_N=100:300:3"), {"sweep.csv"}, "axial load 100 to 300 N"),
    "preload": (("rbdyn", "ball", BALLS, "--preload", "50,75,100"), {"preload.csv"}, "preload 50 to 100 N"),
    "race limits": (("rbdyn", "ball", SEVENTY, "--set", "bearing.bore_mm=70", "--race-limits", "P4"), {"race_limits.csv"}, "500 N axial"),
    "design": (("doe", "design", STUDY), {"design.csv"}, "1300 N radial"),
    "fit": (("doe", "fit", STUDY, "--data", RUNS), {"anova.csv", "coefficients.csv", "runs.csv"}, "1300 N radial"),
    "front": (("doe", "front", STUDY, "--data", RUNS), {"front.csv"}, "1300 N radial"),
    "chain": (("doe", "chain", EXAMPLES / "pocket_chain.toml"), {"part_dimensions.csv", "contributions.csv"}, "pocket_chain.toml"),
}  # fmt: skip
# These take seconds.
SLOW = ("race limits", "front")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in COMMANDS]
)
def test_command_line_folder_can_be_mailed(name: str, tmp_path: Path) -> None:
    """Command line: a page that loads nothing, with the identity and the words of the terminal; a sheet for each table."""
    words, tables, point = COMMANDS[name]
    done = in_process(*words, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    listed = re.search(r"^written to .*: (.*)$", done.stdout, re.MULTILINE)
    written = {path.name for path in tmp_path.iterdir()} - {"made_by.json", "map_points.jsonl", "sweep.part"}
    assert listed is not None and set(listed[1].split(", ")) == written
    assert {path.name for path in tmp_path.glob("*.csv")} == tables
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    title = re.search(r"<title>(.*)</title>", page)
    assert title is not None and title[1].endswith(f": {words[0]} {words[1]}" + option(words))
    assert point in unescape(page) and f"SHA-256 of {Path(words[2]).name}" in page
    assert not re.search(r"""(src|href)=["'](?!#|data:)|@import|url\((?!#)""", page)
    assert page.count("<svg") == len(list(tmp_path.glob("*.png"))) or words[0] == "doe"
    assert figures_of(done.stdout.partition("written to")[0]) <= figures_of(unescape(re.sub("<[^>]*>", " ", page)))
    workbook_has_the_numbers(tmp_path, tables)


def option(words: tuple) -> str:
    """The study of ``rbdyn ball`` that an option asks for."""
    return next((f" {word}" for word in words if word in ("--sweep", "--preload", "--race-limits")), "")


def figures_of(text: str) -> set[str]:
    """Numbers with at least three digits after the point."""
    return set(re.findall(r"\d+\.\d{3,}", text))


def workbook_has_the_numbers(folder: Path, tables: set[str]) -> None:
    sheets = pd.read_excel(folder / "tables.xlsx", sheet_name=None)
    assert next(iter(sheets)) == "identity"
    first = dict(sheets["identity"].to_numpy().tolist())
    for name in tables:
        frame = pd.read_csv(folder / name)
        if frame.size > MOST_CELLS - len(frame.columns):
            assert first[name] == f"{len(frame)} rows, in this file only"
            continue
        sheet = sheets[Path(name).stem]
        pd.testing.assert_frame_equal(sheet, frame, check_dtype=False, rtol=1e-12)
        assert sheet.select_dtypes("number").columns.tolist() == frame.select_dtypes("number").columns.tolist()


def test_command_line_step_keeps_the_page_of_a_study(tmp_path: Path) -> None:
    """Command line: in the folder of a finished study a step names its page and workbook after itself."""
    (tmp_path / "summary.json").write_text("{}")
    done = in_process("doe", "chain", EXAMPLES / "pocket_chain.toml", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert {"chain_report.html", "chain_tables.xlsx"} <= {path.name for path in tmp_path.iterdir()}
    assert not (tmp_path / "report.html").exists()


def test_command_line_without_out_loads_no_more() -> None:
    """Command line: without --out neither workbooks nor pictures are loaded."""
    code = (
        "import contextlib, io, sys; from rbdyn.cli import app\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        f"    app.app(['ball', {str(BALLS)!r}])\n"
        "print({'openpyxl', 'pandas', 'matplotlib'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


IDENTITY = Identity("rbdyn ball", "NU 210", "drawing", "1 rpm", "2026-01-31", "0.1", {"scene.toml": "0123456789ab"})


def test_unit_workbook_is_the_same_bytes_and_safe(tmp_path: Path) -> None:
    """Unit: equal tables give equal bytes at another time; no cell is a formula; odd names of sheets are legal and distinct."""
    table = tmp_path / "values.csv"
    with table.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(
            [("=name", "value", "mixed"), ("=1+1", "0.1", "7"), ("a\x07b", "", "x"), ("nan", "nan", "")]
        )
    paths = [tmp_path / "one.xlsx", tmp_path / "two.xlsx"]
    write_workbook(paths[0], [table], IDENTITY)
    time.sleep(2.1)  # files in a zip are dated to two seconds
    write_workbook(paths[1], [table], IDENTITY)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    sheet = pd.read_excel(paths[0], sheet_name="values", keep_default_na=False)
    assert sheet.columns.tolist() == ["'=name", "value", "mixed"]
    assert sheet["'=name"].tolist() == ["'=1+1", "a b", "nan"] and sheet["mixed"].tolist() == ["7", "x", ""]
    names: list[str] = []
    for name in ("a/b", "A?B", "x" * 40, "X" * 50, "'"):
        names.append(sheet_name(name, names))
    assert names == ["a_b", "A_B_2", "x" * 31, "X" * 29 + "_2", "table"]


def test_unit_picture_inside_a_page_keeps_only_names_it_refers_to() -> None:
    """Unit: no declaration, style sheet or free name of an SVG file gets into the page."""
    svg = (
        '<?xml version="1.0"?><!DOCTYPE svg PUBLIC "x" "http://a/b.dtd"><svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 10 5" '
        'width="10pt"><metadata>when</metadata><defs><style>*{}</style><path id="m1"/></defs><g id="figure_1">'
        '<use xlink:href="#m1"/></g></svg>'
    )
    inside = inline(svg, "a & b")
    assert inside.startswith('<svg viewBox="0 0 10 5" class="picture"') and 'aria-label="a &amp; b"' in inside
    assert inside.endswith('<defs><path id="m1"/></defs><g><use href="#m1"/></g></svg>') and "http" not in inside
