"""The command ``rbdyn ball``: what it prints, writes and refuses beside the equilibrium itself."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbdyn.ball_studies import optimum_study, race_limits, runout_record
from rbdyn.faults import InputError
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parent.parent / "examples"
SINGLE = EXAMPLES / "angular_contact_ball.toml"
QUIET = EXAMPLES / "angular_contact_7014.toml"


def test_unit_preload_study_finds_both_optima():
    """Unit: the least stress and the longest life are no worse than any point of the scan."""
    record = optimum_study(Scene.load(SINGLE), "preload", [0.0, 50.0, 100.0, 200.0])
    stresses = [max(point["inner_stress_MPa"], point["outer_stress_MPa"]) for point in record["points"]]
    assert record["least_stress"]["max_stress_MPa"] <= min(stresses)
    assert record["longest_life"]["L10_Mrev"] >= max(point["L10_Mrev"] for point in record["points"])
    assert 10.0 < record["least_stress"]["value"] < 100.0


def test_unit_runout_of_a_scene_follows_its_errors():
    """Unit: waviness of order Z + 1 on the turning race reaches the ring whole; an indicator reads twice its amplitude."""
    wavy = Scene.load(QUIET, ["errors.inner_roundness=[{order=19, amplitude_um=0.2}]"])
    record, path = runout_record(wavy)
    assert record["indicator_um"] == pytest.approx(0.4, rel=1e-3)
    assert record["axial_um"] < 1e-6
    assert len(path.table()) == wavy.errors.steps * wavy.errors.turns


@pytest.mark.parametrize(
    ("study", "assignments", "words"),
    [
        (lambda scene: race_limits(scene, "P3", 0.95), [], "--race-limits P3: is no tolerance class; choose one of P2"),
        (lambda scene: race_limits(scene, "P2", 0.95), [], "bearing.bore_mm: missing"),
        (lambda scene: race_limits(scene, "P6", 0.95), ["bearing.bore_mm=35.0"], "sets no limit on axial runout"),
        (lambda scene: runout_record(scene), [], "errors: missing"),
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
