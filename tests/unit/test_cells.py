"""Tables that a spreadsheet may open: text that looks like a formula is quoted, and read as it was."""

import csv
import json
import random

import numpy as np
import pandas as pd
import pytest
from instant_runs import instantly
from short_studies import run_design, short_study, silent

from doe.workflow.problem import Problem
from doe.workflow.runs import read_runs
from rbdyn.base.records import NUMBER, plain_cell, quoted_cell, save_table
from rbdyn.base.tables.sheet import read_sheet

DANGEROUS = tuple("=+-@\t\r\n")


@pytest.mark.parametrize(
    "text", ["=cmd|' /C calc'!A0", "@SUM(1)", "+A1", "-A1", "\t=1", "\r=1", "'=1", "''@x", "-", "=1+1"]
)
def test_unit_text_like_a_formula_is_quoted_and_read_back(text):
    """Unit: nothing that is written begins as a formula does."""
    assert quoted_cell(text)[0] == "'" and plain_cell(quoted_cell(text)) == text


@pytest.mark.parametrize("value", ["", "pick", "'tis", "it's", "-1.5", "+2e-3", ".5", -1.5, 3, None, True, "≤ 150"])
def test_unit_other_cells_stay_as_they_are(value):
    """Unit: numbers, also as text with a sign, and words."""
    assert quoted_cell(value) == value and (not isinstance(value, str) or plain_cell(value) == value)


def test_unit_any_table_is_read_as_it_was_written(tmp_path):
    """Unit: 300 random tables; no cell on the disk begins as a formula does, and none is changed by the way."""
    draw = random.Random(1)
    alphabet = "=+-@'|!A1. \t,;\"é"
    for number in range(300):
        texts = ["".join(draw.choices(alphabet, k=draw.randint(1, 5))).strip() or "x" for _ in range(9)]
        names = list(dict.fromkeys(texts[:3]))
        rows = [dict(zip(names, texts[3 * row :], strict=False)) for row in (1, 2)]
        path = tmp_path / f"{number}.csv"
        save_table(rows, path)
        with path.open(encoding="utf-8", newline="") as file:
            cells = [cell for row in csv.reader(file) for cell in row]
        assert not any(cell.startswith(DANGEROUS) and not NUMBER.fullmatch(cell) for cell in cells)
        if len(names) > 1:
            sheet = read_sheet(path)
            assert list(sheet.places) == names
            assert [sheet.column(name).texts for name in names] == [[row[name] for row in rows] for name in names]


def test_unit_numbers_of_a_table_keep_their_bits(tmp_path):
    """Unit: a table of numbers is written as pandas writes it."""
    frame = pd.DataFrame({"x": [-1.0, np.nan, 1e-9], "n": [-1, 2, 3]})
    save_table(frame, tmp_path / "ours.csv")
    assert (tmp_path / "ours.csv").read_text() == frame.to_csv(index=False)


def named_study(folder):
    """The example study with names like formulas."""
    path = short_study(folder)
    text = (
        path.read_text(encoding="utf-8")
        .replace("radial_clearance_mm", "=cmd_mm")
        .replace("guide_clearance_mm", "@guide_mm")
    )
    # Keys of the scene keep their names.
    text = text.replace("bearing.=cmd_mm", "bearing.radial_clearance_mm").replace(
        "cage.@guide_mm", "cage.guide_clearance_mm"
    )
    lines = text.splitlines()
    start = next((place for place, line in enumerate(lines) if line.startswith("[reference]")), len(lines))
    text = "\n".join(
        line.replace("=cmd_mm =", '"=cmd_mm" =').replace("@guide_mm =", '"@guide_mm" =') for line in lines[:start]
    )
    path.write_text(text + "\n", encoding="utf-8")
    return path


def test_unit_study_with_names_like_formulas_goes_round_through_fit_and_front(tmp_path, monkeypatch):
    """Unit: its tables are quoted, and fit and front read them under the study's own names."""
    path = named_study(tmp_path)
    study = Problem.load(path)
    assert study.factors[:2] == ["=cmd_mm", "@guide_mm"]
    instantly(monkeypatch.setattr)
    runs = run_design(study, tmp_path, 2, silent)
    rows = [
        {**study.by_factor(at), **dict(zip(study.responses, values, strict=True))}
        for at, values in zip(runs.actual, runs.values.tolist(), strict=True)
    ]
    table = tmp_path / "runs.csv"
    save_table(rows, table)
    assert table.read_text(encoding="utf-8").startswith("'=cmd_mm,'@guide_mm,")
    again = read_runs(study, table)
    assert np.allclose(again.values, runs.values) and np.allclose(again.actual, runs.actual)
    from typer.testing import CliRunner

    from doe.cli import app

    for command in ("fit", "front"):
        out = tmp_path / command
        shown = CliRunner().invoke(app, [command, str(path), "--data", str(table), "--out", str(out), "--json"])
        assert shown.exit_code == 0, shown.output
        assert "'=cmd_mm" not in shown.output and ("=cmd_mm" in shown.output or command == "fit")
        for file in out.glob("*.csv"):
            assert not any(
                cell.startswith(DANGEROUS) and not NUMBER.fullmatch(cell)
                for row in csv.reader(file.open())
                for cell in row
            )
    alone = CliRunner().invoke(
        app, ["fit", "--data", str(table), "--factor", "=cmd_mm", "--factor", "@guide_mm", "--json"]
    )
    assert alone.exit_code == 0, alone.output
    assert json.loads(alone.stdout)
    printed = CliRunner().invoke(app, ["design", str(path), "--csv"])
    assert printed.stdout.startswith("run,'=cmd_mm,'@guide_mm,"), printed.output
