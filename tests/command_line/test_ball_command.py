"""The command ``rbdyn ball``: what it prints, writes and refuses beside the equilibrium itself."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from rbdyn.base.blocks import Paragraph
from rbdyn.base.faults import InputError
from rbdyn.cli.app import app
from rbdyn.cli.ball_studies import equilibrium_blocks, optimum_study, race_limits, with_runout
from rbdyn.quasistatic.bearing import equilibrium
from rbdyn.quasistatic.runout.lots import follow_ring
from rbdyn.quasistatic.sweep import keys_of_texts, sweep
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
SINGLE = EXAMPLES / "angular_contact_ball.toml"
QUIET = EXAMPLES / "angular_contact_7014.toml"


def test_unit_preload_study_finds_both_optima():
    """Unit: the least stress and the longest life are no worse than any point of the scan."""
    study = optimum_study(Scene.load(SINGLE), "preload", [0.0, 50.0, 100.0, 200.0])
    stresses = [max(point["inner_stress_MPa"], point["outer_stress_MPa"]) for point in study.points]
    assert study.least_stress.max_stress_MPa <= min(stresses)
    assert study.longest_life.L10_Mrev >= max(point["L10_Mrev"] for point in study.points)
    assert 10.0 < study.least_stress.value < 100.0


def test_unit_runout_of_a_scene_follows_its_errors():
    """Unit: waviness of order Z + 1 on the turning race reaches the ring whole; an indicator reads twice its amplitude."""
    wavy = Scene.load(QUIET, ["errors.inner_roundness=[{order=19, amplitude_um=0.2}]"])
    result, path = with_runout(wavy, equilibrium(wavy))
    assert result.runout.indicator_um == pytest.approx(0.4, rel=1e-3)
    assert result.runout.axial_um < 1e-6
    rounding = replace(result, runout=replace(result.runout, axial_um=1.1e-13, face_um=1.1e-13))
    words = [str(block.text) for block in equilibrium_blocks(rounding) if isinstance(block, Paragraph)]
    assert any("axial 0 µm, face 0 µm" in text for text in words)
    assert len(path) == wavy.errors.steps * wavy.errors.turns


@pytest.mark.parametrize(
    ("study", "assignments", "words"),
    [
        (lambda scene: race_limits(scene, "P3", 0.95), [], "--race-limits P3: is not a tolerance class; choose one of P2"),
        (lambda scene: race_limits(scene, "P2", 0.95), [], "bearing.bore_mm: missing"),
        (lambda scene: race_limits(scene, "P6", 0.95), ["bearing.bore_mm=35.0"], "sets no limit on axial runout"),
        (follow_ring, [], "errors: missing"),
        (
            lambda scene: optimum_study(scene, "preload", [0.0, 1.0, 2.0]),
            ["operation.axial_load_N=0.0", "operation.preload_um=3.0"],
            "--preload: operation.prescribed.z_mm or preload_um",
        ),
    ],
)  # fmt: skip
def test_unit_studies_refuse_what_they_cannot_do(study, assignments, words):
    """Unit: one sentence names the key or the option and the mend."""
    with pytest.raises(InputError, match="^" + words.replace(".", r"\.") if words[0] != "s" else words):
        study(Scene.load(SINGLE, assignments))


def test_command_line_writes_results_and_pictures(command, tmp_path):
    """Command line: --out writes the record, the balls, three pictures and the path of a wavy ring."""
    done = command("ball", QUIET, "--set", "errors.inner_roundness=[{order=2, amplitude_um=0.5}]", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {
        "result.json",
        "balls.csv",
        "report.html",
        "tables.xlsx",
        "loads.png",
        "angles.png",
        "section.png",
        "runout.csv",
        "made_by.json",
    }
    assert "runout over" in done.stdout
    record = json.loads((tmp_path / "result.json").read_text())
    assert record["status"] == "ok" and record["runout"]["turns"] >= 1


def test_command_line_answers_overload_with_a_status(command):
    """Command line: a load that no contact can carry ends with exit 1 and names the ball and the race."""
    done = command("ball", SINGLE, "--set", "operation.axial_load_N=2e6", "--json")
    assert done.returncode == 1
    record = json.loads(done.stdout)
    assert record["status"].startswith("overloaded: the ball at 0 deg") and "balls" not in record


def test_command_line_wants_one_study(command):
    """Command line: two studies at once are refused."""
    done = command("ball", SINGLE, "--preload", "0:100:3", "--wear", "0:2:3")
    assert done.returncode == 2
    assert done.stderr.strip() == "--preload and --wear: are studies of their own; choose one"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--sweep", "operation.axial_load_N=1,2", "--preload", "0:100:3"), "--sweep and --preload: are studies of their own"),
        (("--sweep", "operation.axial_load_N=1,2", "--race-limits", "P2"), "--sweep and --race-limits: are studies of their own"),
        (("--clearance", "0:100:3", "--race-limits", "P2"), "--clearance and --race-limits: are studies of their own"),
        (("--yield", "0.5"), "--yield 0.5: is a share of --race-limits; add that or leave it out"),
        (("--clearance", "0:100:3"), "--clearance: bearing.contact_angle_deg = 25 rules the clearance, 23.8 um: give bearing."),
    ],
)  # fmt: skip
def test_command_line_refuses_pairs_and_contradictions(arguments, sentence):
    """Command line: studies that exclude each other, a yield of nothing, a clearance against the contact angle: exit 2."""
    done = CliRunner().invoke(app, ["ball", str(SINGLE), *arguments])
    assert done.exit_code == 2
    assert done.stderr.startswith(sentence) and done.stdout == ""


def test_command_line_studies_write_tables_and_pictures(tmp_path):
    """Command line: a preload study leaves its record, a table with the same figures and notes, and four pictures."""
    axial = "operation.axial_load_N=50000.0"
    done = CliRunner().invoke(
        app, ["ball", str(SINGLE), "--preload", "0:200:3", "--set", axial, "--out", str(tmp_path)]
    )
    assert done.exit_code == 0, done.stderr
    pictures = {"angles.png", "pressure_and_life.png", "stiffness.png", "azimuth.png"}
    tables = {"preload.json", "preload.csv", "report.html", "tables.xlsx", "made_by.json"}
    assert {path.name for path in tmp_path.iterdir()} == tables | pictures
    record, table = json.loads((tmp_path / "preload.json").read_text()), pd.read_csv(tmp_path / "preload.csv")
    assert [point["value"] for point in record["points"]] == table["preload_N"].tolist() == [0.0, 100.0, 200.0]
    assert [point["outer_stress_MPa"] for point in record["points"]] == pytest.approx(
        table["outer_pressure_MPa"], rel=1e-8
    )
    dents = [note["text"] for note in record["notes"] if note["code"] == "dent"]
    assert all(text.endswith(" (3 points, the first at preload_N = 0)") for text in dents) and len(dents) == 2
    assert table["notes"].str.contains("inner dent").all()


def test_invariant_a_held_ring_tells_the_moment_that_holds_it():
    """Invariant: a ring is held by default; free under the moment told it stands as before, and without it tips and says so."""
    lone = ("operation.radial_load_N=1000.0", "operation.axial_load_N=1500.0", "operation.inner_speed_rpm=3000.0")
    table = {
        "bearing": {
            "kind": "angular_contact_ball", "balls": 14, "ball_diameter_mm": 12.7, "pitch_diameter_mm": 60.0,
            "contact_angle_deg": 25.0, "inner_groove_factor": 0.52, "outer_groove_factor": 0.53,
        },
        "operation": {},
    }  # fmt: skip

    def found(*changes):
        return equilibrium(Scene.from_dict(table, "7208.toml", [*lone, *changes]))

    held = found()
    moment = held.as_dict()["reaction"]["moment_Nm"]
    assert moment["x"] == 0.0 and abs(moment["y"]) > 10.0 and held.as_dict()["notes"] == []
    same = found("operation.tilt='free'", f"operation.moment_Nm=[0.0, {moment['y']!r}]")
    assert same.displacement == pytest.approx(held.displacement, rel=1e-8, abs=1e-13)
    free = found("operation.tilt='free'")
    (note,) = free.notes
    assert (
        note.code == "tipped-ring"
        and note.startswith("the free ring tips by 3.1 mrad (11 arc minutes)")
        and "operation.tilt = 'fixed'" in note
    )
    assert free.as_dict()["life"]["L10_Mrev"] < 0.5 * held.as_dict()["life"]["L10_Mrev"]
    assert found("operation.tilt='free'", "operation.prescribed.tilt_y_mrad=2.0").as_dict()["notes"] == []


@pytest.mark.parametrize(
    ("file", "changes", "zeros"),
    [
        ("deep_groove_ball.toml", ("bearing.radial_clearance_mm=-0.004",), ("y_mm", "z_mm", "force_y_N")),
        ("deep_groove_ball.toml", (), ("y_mm", "tilt_x_mrad", "tilt_y_mrad", "force_y_N", "moment_x_Nm")),
        ("angular_contact_ball.toml", ("operation.tilt=free",), ("y_mm", "tilt_x_mrad", "force_y_N", "moment_x_Nm")),
        ("angular_contact_7014.toml", (), ("x_mm", "y_mm", "force_x_N", "force_y_N", "moment_x_Nm", "moment_y_Nm")),
        ("double_decker.toml", (), ("y_mm", "tilt_x_mrad", "force_y_N", "moment_x_Nm")),
    ],
)
def test_invariant_what_symmetry_makes_zero_is_told_as_zero(file, changes, zeros):
    """Invariant: one equilibrium and a sweep have 0, not rounding and not -0, where symmetry allows nothing else."""
    scene = Scene.load(EXAMPLES / file, changes)
    load = "operation.load_N[3]" if scene.operation.load_N else "operation.radial_load_N"
    column = sweep(scene, {load: [100.0, 200.0, 300.0]}).columns
    assert all((column[name] == 0.0).all() and not np.signbit(column[name]).any() for name in zeros)
    record = equilibrium(scene).as_dict()
    ring = {f"{axis}_mm": value for axis, value in record["displacement_mm"].items()}
    ring |= {f"tilt_{axis}_mrad": value for axis, value in record["tilt_mrad"].items()}
    ring |= {f"force_{axis}_N": value for axis, value in record["reaction"]["load_N"].items()}
    ring |= {f"moment_{axis}_Nm": value for axis, value in record["reaction"]["moment_Nm"].items()}
    assert all(ring[name] == 0.0 and math.copysign(1.0, ring[name]) == 1.0 for name in zeros)
    matrix = np.abs(np.array(record["stiffness"]["matrix_SI"]))
    assert not matrix[1, [0, 2, 4]].any() and not np.signbit(record["stiffness"]["matrix_SI"][0][1])
    balls = record["balls"] if "balls" in record else record["inner"]["balls"] + record["outer"]["balls"]
    angles = np.array([[ball["inner_angle_deg"], ball["outer_angle_deg"]] for ball in balls])
    assert ((angles == 0.0) | (np.abs(angles) > 1e-9)).all() and (file[:4] != "deep" or (angles == 0.0).all())


def test_limit_a_ring_that_just_touches_carries_nothing():
    """Limit: without a load the contact loads of the inner raceway are 0, not rounding with a film of its own."""
    loose = equilibrium(Scene.load(EXAMPLES / "deep_groove_ball.toml", ["operation.radial_load_N=0"]))
    inner = loose.row_reports[""].contacts["inner"]
    assert inner.load_N == 0.0 and inner.film is None
    assert "no ball touches the inner raceway" in str(loose.notes[0])


def test_unit_values_of_the_command_line():
    """Unit: evenly spaced or listed values; anything else is refused in a sentence."""
    assert keys_of_texts(["a.b=1:2:3", "c=4,-5"]) == {"a.b": [1.0, 1.5, 2.0], "c": [4.0, -5.0]}
    for text in ("a", "=1,2", "a=1:2", "a=1:2:1", "a=1:2:x", "a=one"):
        with pytest.raises(InputError, match="--sweep"):
            keys_of_texts([text])
    with pytest.raises(InputError, match="swept twice"):
        keys_of_texts(["a=1", "a=2"])


def test_command_line_prints_notes_of_points_unless_quiet():
    """Command line: each note stands once, with how many points it is about and where the first is; dangers alone with --quiet."""
    arguments = ["ball", str(SINGLE), "--sweep", "operation.axial_load_N=100,20000,40000"]
    loud, quiet = (CliRunner().invoke(app, [*arguments, *more]).stdout for more in ((), ("--quiet",)))
    assert loud.startswith("Danger: outer raceway: dented by 4370 MPa") and quiet.startswith(
        "Danger: outer raceway: dented by"
    )
    assert " (2 points, the first at operation.axial_load_N = 20000)" in loud
    assert "\nWarnings\n" in loud and "arning" not in quiet and "note" not in quiet
