"""Stiffness over speed and load for programs of rotors: table, axes, damping, ball bearings, faults."""

import json

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from in_process import in_process

from rbdyn.base.faults import InputError
from rbdyn.cli.stiffness import stiffness_map
from rbdyn.dynamics.part_figures import row_stiffness, static_overload
from rbdyn.quasistatic.bearing import equilibrium
from rbdyn.scene import BallScene, Scene

ROLLERS, BALLS = ROOT / "examples" / "cylindrical_roller.toml", ROOT / "examples" / "deep_groove_ball.toml"
SPEEDS = [4000.0, 8000.0, 12000.0, 16000.0, 20000.0]


def test_a_point_is_the_stiffness_of_its_scene():
    """Each row is that of the scene at its speed and load; the trace stays under any angle of the load, and damping is 0."""
    found = stiffness_map(ROLLERS, SPEEDS, [500.0, 1300.0], load_angle_deg=30.0)
    table = found.sheet.frame
    scene = Scene.load(ROLLERS, ["operation.inner_speed_rpm=16000", "operation.radial_load_N=1300"])
    (row,) = table[(table["radial_load_N"] == 1300.0) & np.isclose(table["speed"], 16000.0 * np.pi / 30.0)].to_dict(
        "records"
    )
    alone = row_stiffness(scene)
    assert row["kxx"] + row["kyy"] == pytest.approx(alone.along + alone.across)
    # The load points at 30 degrees: k_xy = (k_along - k_across) sin(30) cos(30).
    assert row["kxy"] == pytest.approx((alone.along - alone.across) * 0.25 * np.sqrt(3.0)) == row["kyx"]
    assert (table[["cxx", "cxy", "cyx", "cyy"]] == 0.0).all(axis=None) and "is 0" in found.notes[0]


def test_a_loss_factor_damps_at_the_speed():
    """c = eta k/omega of every entry, with the loss factor in the note."""
    table = stiffness_map(ROLLERS, SPEEDS, [500.0], loss_factor=0.02).sheet.frame
    assert (table["cyy"] * table["speed"] / table["kyy"]).tolist() == pytest.approx([0.02] * 5)


def test_balls_have_the_stiffness_of_their_equilibrium():
    table = stiffness_map(BALLS, SPEEDS, [600.0]).sheet.frame
    scene = BallScene.load(BALLS, ["operation.inner_speed_rpm=8000", "operation.radial_load_N=600"])
    stiffness = equilibrium(scene).report.stiffness
    assert table["kxx"][1] == pytest.approx(1e6 * stiffness.x_N_per_um, rel=1e-6)
    assert table["kyy"][1] == pytest.approx(1e6 * stiffness.y_N_per_um, rel=1e-6)


def test_points_without_a_stiffness_say_why():
    """Limits: a load beyond the shakedown of a raceway, and a ring that no ball touches, have no stiffness.

    Of four rollers one bears the load. A line contact shakes down to four times the shear yield k = 6900 MPa/3/sqrt(3),
    p = sqrt(Q E*/(pi l R)) by Hertz.
    """
    drawing = Scene.load(ROLLERS, ["bearing.rollers=4", "operation.inner_speed_rpm=100"])
    roller, race = drawing.geometry.roller_radius, drawing.geometry.raceways[1]
    limit, modulus = 4.0 * 6900e6 / 3.0 / np.sqrt(3.0), 0.5 * 206e9 / (1.0 - 0.3**2)
    load = limit**2 * np.pi * 3.5e-3 / (1.0 / roller + 1.0 / race) / modulus
    sides = [static_overload(drawing.overridden([f"operation.radial_load_N={share * load}"])) for share in (0.99, 1.01)]
    assert sides[0] == "" and sides[1].startswith("inner raceway: overloaded")
    found = stiffness_map(ROLLERS, SPEEDS, [500.0, 1e6])
    assert [point.status == "ok" for point in found.points] == [True] * 5 + [False] * 5
    assert all(point.status.startswith("failed: inner raceway: overloaded") for point in found.failed)
    loose = stiffness_map(BALLS, [25000.0, 40000.0, 50000.0, 75000.0, 100000.0], [0.0])
    assert loose.failed and all("no ball touches the inner raceway" in point.status for point in loose.failed)


def test_heat_sets_the_clearance():
    """With [thermal] each point has the clearance of its steady temperatures, not the drawn one."""
    short = ["numerics.turns=2", "numerics.replicates=2"]
    found = stiffness_map(
        ROOT / "examples" / "hot_roller.toml", [*SPEEDS[2:], 22000.0, 24000.0], [1300.0], overrides=short
    )
    drawn = 1e3 * Scene.load(ROOT / "examples" / "hot_roller.toml").bearing.radial_clearance_mm
    clearances = [point.clearance_um for point in found.points]
    assert found.status == "ok" and all(abs(one - drawn) > 0.2 for one in clearances) and len(set(clearances)) == 5


def test_the_command_writes_the_table(tmp_path):
    """JSON, CSV, picture and report; points without load fail, are grouped by cause, and the command ends with 1."""
    out = tmp_path / "map"
    words = (
        "map",
        ROLLERS,
        "--stiffness",
        "--speed",
        "4000:20000:5",
        "--load",
        "0,500",
        "--load-angle=-90",
        "--out",
        out,
    )
    shown = in_process("rbdyn", *words)
    assert "No danger found" not in shown.stdout  # static stiffness judges nothing
    assert shown.returncode == 1 and "5 points failed: no roller carries load" in shown.stdout
    record, table = json.loads((out / "stiffness.json").read_text("utf-8")), pd.read_csv(out / "stiffness.csv")
    assert record["status"] == "5 of 10 points failed" and record["points"][0]["stiffness_N_um"] is None
    assert (table["kyy"] > table["kxx"])[5:].all() and table["kxy"][5:].tolist() == [0.0] * 5
    assert {"stiffness.png", "report.html"} <= {path.name for path in out.iterdir()}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"speeds_rpm": SPEEDS[:3]}, "has 3 values; a table for a rotor needs 5"),
        ({"loss_factor": 1.5}, "must be at least 0 and below 1"),
        ({"speeds_rpm": [0.0, *SPEEDS], "loss_factor": 0.1}, "gives no damping at rest"),
        ({"overrides": ["operation.schedule.time_s=[0,1]", "operation.schedule.radial_load_N=[1,2]"]}, "operation.schedule"),
    ],
)  # fmt: skip
def test_faults_are_sentences(arguments, says):
    with pytest.raises(InputError, match=says):
        stiffness_map(**{"scene": ROLLERS, "speeds_rpm": SPEEDS, "loads_N": [500.0], **arguments})


def test_options_of_the_stiffness_need_it(tmp_path):
    words = ("map", ROLLERS, "--speed", "4000:20000:5", "--load", "500")
    for more in (("--loss-factor", "0.1"), ("--stiffness", "--duty", tmp_path / "duty.csv")):
        refused = in_process("rbdyn", *words, *more)
        assert refused.returncode == 2 and "--stiffness" in refused.stderr
