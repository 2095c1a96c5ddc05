"""Stiff and extreme scenes: each case closes its power balance or tells what to change."""

import json

import pandas as pd
import pytest

from rbdyn.accuracy import variants, write
from rbdyn.accuracy.variants import (
    CLOSED,
    OPEN,
    REFUSED,
    STOPPED,
    TIGHTENED,
    Ending,
    battery,
    cases,
    ending,
    with_options,
)
from rbdyn.base.faults import InputError
from rbdyn.scene import Scene

EXAMPLE = "examples/cylindrical_roller.toml"


@pytest.fixture(scope="module")
def rows(outer):
    """Cases that need no law of their own, and one of each way to end."""
    every = cases(outer)
    chosen = ("as given", "20 times the load", "no load", "preload of 20 um", "traction slope of 10 s/m")
    ends = {
        "too short a budget": ("numerics.step_budget_per_turn=300", "numerics.rtol=1e-6"),
        "too tight a land": ("cage.guide_clearance_mm=0.001",),
        "too loose": ("numerics.rtol=0.1", "numerics.method=rk45"),
    }
    return {row.case: row for row in battery(outer, {**{name: every[name] for name in chosen}, **ends})}


def test_unit_every_case_is_a_scene():
    """Unit: every case, alone, is lawful for the bearing of the paper; all but the first change it."""
    scene = Scene.load(EXAMPLE)
    for name, assignments in cases(scene).items():
        assert (with_options(scene, assignments) != scene) == (name != "as given"), name


@pytest.mark.parametrize(
    "case", ["as given", "20 times the load", "no load", "preload of 20 um", "traction slope of 10 s/m"]
)
def test_invariant_power_balance(rows, case):
    """Invariant: the balance closes within a per cent without help, under twenty times the load too."""
    row = rows[case]
    assert row.status == CLOSED and row.reason == "" and row.power_gap < 0.01
    assert row.power_loss_W > 0.0 and row.impact_force_N > 0.0 and row.steps_per_turn > 0.0


def test_unit_method_and_stiffness(rows):
    """Unit: the plain bearing is hardly stiff; steep traction is, and stability holds its steps."""
    assert rows["as given"].method == "verlet" and rows["as given"].stiffness_ratio < 2000.0
    steep = rows["traction slope of 10 s/m"]
    assert steep.stiffness_ratio > 1e4 and steep.held > 0.9
    assert rows["20 times the load"].stiffness_ratio > 1e3


def test_unit_ways_to_end(rows):
    """Unit: what cannot run says why and what to change; what is too loose is tightened."""
    stopped, refused, loose = (rows[name] for name in ("too short a budget", "too tight a land", "too loose"))
    assert stopped.status == STOPPED
    assert "step budget" in stopped.reason and "numerics.step_budget_per_turn" in stopped.reason
    assert refused.status == REFUSED and "lower it, widen cage.guide_clearance_mm" in refused.reason
    assert loose.status == TIGHTENED and loose.rtol == pytest.approx(0.01) and "rtol = 0.01" in loose.reason
    assert not any(row.unexplained for row in rows.values())


def test_unit_open_balance_is_unexplained(outer, monkeypatch):
    """Unit: a balance that stays open though the tolerance was tightened makes the battery fail."""
    monkeypatch.setattr(variants, "LARGEST_GAP", 1e-12)
    row = ending(outer, "as given", ())
    assert row.status == OPEN and row.unexplained and "even at rtol 0.001" in row.reason
    assert variants.report([row]).record["status"] == "1 of 1 cases failed without a diagnosis"


def test_unit_record_and_files(rows, tmp_path):
    """Unit: JSON without NaN, a line a case in the table, as many cells as headings."""
    listed = list(rows.values())
    report = variants.report(listed)
    assert write(report, tmp_path) == ["stability.json", "stability.csv"]
    saved = json.loads((tmp_path / "stability.json").read_text())
    assert saved["format"] == "rbdyn.stability/1" and saved["status"] == "ok"
    assert [case["case"] for case in saved["cases"]] == list(rows)
    assert len(pd.read_csv(tmp_path / "stability.csv")) == len(rows)
    (table,) = report.tables
    assert [line[0] for line in table.rows] == list(rows) and {len(line) for line in table.rows} == {len(table.header)}


@pytest.mark.parametrize(
    ("assignments", "key"),
    [
        (("model.land_film_floor_um=0.0",), "model.land_film_floor_um"),
        (("model.pocket_film=true", "model.pocket_film_floor_um=0.0"), "model.pocket_film_floor_um"),
        (("traction.model=coulomb", "traction.blend_speed_m_s=0.0"), "traction.blend_speed_m_s"),
        (("cage.pocket_clearance_mm=0.0",), "cage.pocket_clearance_mm"),
        (("cage.mass_g=0.0",), "cage.mass_g"),
        (("bearing.rollers=100",), "bearing.rollers"),
        (("operation.inner_speed_rpm=0.0",), "operation.inner_speed_rpm"),
    ],
)
def test_unit_singular_laws_are_refused(assignments, key):
    """Unit: what no step size could carry is refused before it runs, by its key, with the mend."""
    with pytest.raises(InputError) as caught:
        Scene.load(EXAMPLE, assignments)
    (fault,) = caught.value.faults
    assert key in fault and any(mend in fault for mend in ("must be", "give at least", "take fewer"))


def test_command_line_exit_codes(monkeypatch):
    """Command line: one JSON object; 0 where all is explained, 1 where a balance stays open."""
    from typer.testing import CliRunner

    from rbdyn.cli.app import app

    for status, code in ((CLOSED, 0), (REFUSED, 0), (OPEN, 1)):
        monkeypatch.setattr(
            variants, "battery", lambda scene, progress, status=status: [Ending("a case", (), status, "why")]
        )
        done = CliRunner().invoke(app, ["accuracy", EXAMPLE, "stability", "--json"])
        assert done.exit_code == code and json.loads(done.stdout)["cases"][0]["status"] == status
        shown = CliRunner().invoke(app, ["accuracy", EXAMPLE, "stability", "-q"])
        assert shown.exit_code == code and "a case: why" in shown.stdout


@pytest.mark.slow
def test_invariant_battery():
    """Invariant: no case of the bearing of the paper ends with an open balance, and none is beyond both methods."""
    rows = {row.case: row for row in battery(Scene.load(EXAMPLE))}
    assert [row.case for row in rows.values() if row.unexplained] == []
    assert [row.case for row in rows.values() if row.status in (STOPPED, REFUSED)] == []
    assert rows["10 rpm"].method == "rosenbrock" and rows["guide clearance of 1 um"].method == "verlet"
    for row in rows.values():
        assert row.power_gap < 0.01, row.case
