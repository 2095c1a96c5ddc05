"""Optimal runs added to those of a table: kept to the last bit, found in the store, impossible ones named."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from instant_runs import instantly, unillustrated
from short_studies import SHORT, short_study, silent

from doe.report.files import write
from doe.workflow.design import actual_of, design_of, evaluation
from doe.workflow.problem import Problem
from doe.workflow.runs import run_design
from doe.workflow.whole import run_study
from rbdyn.base.faults import InputError

CCD = 'kind = "central_composite"'
NAMES = ["radial_clearance_mm", "guide_clearance_mm", "pocket_clearance_mm"]
PLACED = """kind = "d_optimal"
runs = 4
augment = "made.csv"
order = "random"
"""


def augmented(folder, table=None, lines=PLACED):
    """The example, short, with optimal runs beside those of a table."""
    folder.mkdir(exist_ok=True)
    path = short_study(folder, SHORT, (CCD, lines))
    text = path.read_text(encoding="utf-8").replace('alpha = "rotatable"\ncentre_replicates = 6\n', "")
    text = text[: text.index("[reference]")]
    path.write_text(text, encoding="utf-8")
    if table is not None:
        (folder / "made.csv").write_text(table, encoding="utf-8")
    return Problem.load(path)


def table_of(points, *more):
    rows = [",".join([*map(repr, point), *(str(each[row]) for _, each in more)]) for row, point in enumerate(points)]
    return "\n".join([",".join([*NAMES, *(name for name, _ in more)]), *rows])


def test_runs_of_a_study_are_kept_and_not_simulated_again(tmp_path, monkeypatch):
    ran = instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    first = Problem.load(short_study(tmp_path))
    text = (tmp_path / "study.toml").read_text(encoding="utf-8")
    (tmp_path / "study.toml").write_text(text[: text.index("[reference]")], encoding="utf-8")
    first, out = Problem.load(tmp_path / "study.toml"), tmp_path / "out"
    out.mkdir()
    write(run_study(first, out, 1, lambda title: silent), out)
    (tmp_path / "made.csv").write_bytes((out / "design_runs.csv").read_bytes())
    study, before = augmented(tmp_path), len(ran)
    ordered = study.plan
    with (tmp_path / "made.csv").open(encoding="utf-8") as file:
        given = [[float(row[name]) for name in NAMES] for row in csv.DictReader(file)]
    assert np.array_equal(ordered.actual[:20], given), "to the last bit"
    runs = run_design(study, out, 1, silent)
    assert len(runs.coded) == 24
    assert len(ran) == before + 4
    assert sorted(ran[before:]) == [21, 22, 23, 24], "seeds by the place in the standard order"
    judged = evaluation(study, ordered.design)
    assert judged["region"]["shape"] == "box" and judged["region"]["reach"] == pytest.approx(8**0.25)
    assert judged["degrees_of_freedom"]["residual"] == 14


def test_given_runs_are_kept_to_the_last_bit_where_coding_changes_it(tmp_path):
    points = np.random.default_rng(2).uniform(0.0, 0.1, (40, 3)).round(3)
    study = augmented(tmp_path, table_of(points.tolist()))
    study.file.factor[:] = [each.model_copy(update={"centre": 0.0, "step": 0.07}) for each in study.file.factor]
    design = study.design
    assert (study.actual(design.coded)[:40] != points).any()
    assert np.array_equal(actual_of(study, design)[:40], points)
    assert design.order[:40].tolist() == list(range(40)), "a random order is one of the new runs"


def test_blocks_of_the_table_stay_and_the_new_runs_make_another(tmp_path):
    points = np.random.default_rng(1).uniform([0.015, 0.1, 0.25], [0.025, 0.2, 0.35], (12, 3)).tolist()
    design = augmented(tmp_path, table_of(points, ("block", [1] * 6 + [2] * 6))).design
    assert design.block_numbers == [1] * 6 + [2] * 6 + [3] * 4
    assert design.kind[:12] == ("given",) * 12


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("guide_clearance_mm", "guide", "column 'guide_clearance_mm' is missing; add it, or rename the factor"),
        ("0.02,", "20.0,", "radial_clearance_mm in row 3 = 20: lies 3996 steps from the centre, outside any region of a design"),
        ("0.15", "wide", "guide_clearance_mm in row 1 = 'wide': is not a finite number; write a plain one"),
    ],
)  # fmt: skip
def test_impossible_tables_are_named(tmp_path, old, new, words):
    table = table_of([[0.015, 0.15, 0.3], [0.025, 0.1, 0.25], [0.02, 0.2, 0.35]]).replace(old, new, 1)
    with pytest.raises(InputError) as refused:
        design_of(augmented(tmp_path, table))
    (fault,) = refused.value.faults
    assert fault.startswith(f"{tmp_path / 'study.toml'}: design.augment = 'made.csv': ") and words in fault


def test_a_row_that_is_no_whole_number_is_named(tmp_path):
    study = augmented(tmp_path, table_of([[0.015, 0.15, 0.3], [0.025, 0.1, 0.25]]))
    whole = study.file.factor[0].model_copy(update={"whole": True, "centre": 0.0, "step": 1.0})
    study.file.factor[0] = whole
    with pytest.raises(InputError, match=r"radial_clearance_mm in row 1 = 0.015: whole = true has no such value; fix"):
        design_of(study)
