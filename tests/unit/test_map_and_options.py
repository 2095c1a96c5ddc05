"""The slip map and the cost of options: points, failures, tables, files, and the command."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import lacking
from in_process import in_process

from rbdyn import accuracy
from rbdyn.accuracy.variants import OPTIONS, option_costs, study_options, with_options
from rbdyn.base.faults import InputError, axis_values
from rbdyn.base.folder import files_in
from rbdyn.base.terminal import text as terminal_text
from rbdyn.cli.app import MAP_FILES, MAP_POINTS, map_blocks
from rbdyn.cli.app import _write_map as write
from rbdyn.dynamics.slip_map import PANELS, slip_map
from rbdyn.scene import Scene

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
SPEEDS, LOADS = (12000.0, 24000.0), (60.0, 1300.0)


@pytest.fixture(scope="module")
def found(outer):
    """A map of four points."""
    return slip_map(outer, SPEEDS, LOADS, workers=2)


def test_unit_map_is_what_single_runs_give(found, outer):
    """Unit: a point equals the simulation of that scene, bit for bit; rows are loads, columns speeds."""
    from rbdyn.dynamics.simulate import simulate

    alone = simulate(with_options(outer, ("operation.inner_speed_rpm=12000.0",)), workers=1)
    point = next(p for p in found.points if (p.inner_speed_rpm, p.radial_load_N) == (12000.0, 1300.0))
    assert point.figures["cage_slip"] == alone.cage_slip
    assert point.figures["impact_force_N"] == alone.impact_force_N
    assert found.grid("cage_slip")[1, 0] == alone.cage_slip.value
    assert found.failed == []


def test_unit_a_point_has_the_companions_of_a_single_run(make_scene):
    """Unit: at a slow speed, where companions follow the steps of the runs, a map states the errors of a simulation."""
    from rbdyn.dynamics.simulate import simulate

    slow = make_scene("numerics.companion=true", "operation.inner_speed_rpm=3000.0", "operation.radial_load_N=4000.0")
    alone = simulate(slow)
    (point,) = slip_map(slow, (3000.0,), (4000.0,), workers=2).points
    assert point.figures["power_loss_W"] == alone.power_loss_W
    assert alone.power_loss_W.numerical_error > 0.0


def test_physics_light_load_slips_more(outer):
    """Trend: at both speeds the cage slips more under 60 N than under 1300 N, beyond the errors of both."""
    scene = with_options(outer, ("numerics.replicates=6", "numerics.turns=24", "numerics.discard_turns=20"))
    speeds = (8000.0, 12000.0)  # at 24000 rpm light rollers take 200 turns to settle, and before that no error is known
    found = slip_map(scene, speeds, LOADS, workers=2)
    slips = {(p.inner_speed_rpm, p.radial_load_N): p.figures["cage_slip"] for p in found.points}
    for speed in speeds:
        light, heavy = slips[speed, 60.0], slips[speed, 1300.0]
        assert light.value - light.statistical_error > heavy.value + heavy.statistical_error


def test_unit_map_saves_table_picture_and_json(found, tmp_path, drawn):
    """Unit: files are whole; the table has a row a point and a column an error."""
    write(found, None, tmp_path)
    saved = json.loads((tmp_path / "map.json").read_text())
    assert files_in(tmp_path, MAP_FILES) == ["map.json", "map.csv", "map.png"]
    assert not lacking(drawn["map.png"], [100.0 * found.grid("cage_slip"), found.grid("power_loss_W")])
    assert saved["format"] == "rbdyn.map/1" and saved["status"] == "ok" and len(saved["points"]) == 4
    table = found.table()
    assert len(table) == 4 and {f"{panel.key}_statistical_error" for panel in PANELS} <= set(table.columns)


def test_unit_failed_points_are_records(make_scene):
    """Unit: a point that cannot go on tells why, the others go on, and the grid has a gap there."""
    # A steady scene takes about 400 steps a turn; under a heavy load stability holds explicit steps to many more.
    budget = ("numerics.step_budget_per_turn=700", "numerics.method=rk45")
    scene = make_scene(*budget, "numerics.replicates=1")
    found = slip_map(scene, (24000.0,), (1300.0, 400000.0), workers=1)
    assert [point.status == "ok" for point in found.points] == [True, False]
    assert "step budget" in found.failed[0].status
    assert np.isnan(found.grid("cage_slip")[1, 0]) and np.isfinite(found.grid("cage_slip")[0, 0])
    assert found.as_dict()["status"] == "1 of 2 points failed"


def counted(monkeypatch) -> list[float]:
    """Loads of the runs that a map begins from here on."""
    from rbdyn.dynamics import slip_map as module

    ran, usual = [], module.recording_of

    def run(scene, *rest):
        ran.append(scene.operation.radial_load_N)
        return usual(scene, *rest)

    monkeypatch.setattr(module, "recording_of", run)
    return ran


def interrupt(done: int, total: int) -> None:
    """Progress that is stopped by Ctrl-C in the middle."""
    if done == total // 2:
        raise KeyboardInterrupt


def test_unit_a_point_whose_fits_close_the_clearance_fails(make_scene):
    """Unit: a map says of a point what a simulation says of it; its results stay."""
    sizes = {"bore_mm": 27, "outside_diameter_mm": 60, "width_mm": 11, "housing_diameter_mm": 90, "rotation": "false"}
    parts = {f"{part}_temperature_C": 20 for part in ("outer_ring", "inner_ring", "roller", "cage")}
    fits = {"inner_interference_um": 90, "outer_interference_um": 0}
    sets = [f"mounting.{key}={value}" for key, value in (sizes | parts | fits).items()]
    scene = make_scene("bearing.radial_clearance_mm=0.05", *sets)
    (point,) = slip_map(scene, (24000.0,), (1300.0,), workers=1).failed
    assert point.status == "lost clearance" and "cage_slip" in point.figures


def test_unit_interrupted_map_goes_on_with_the_same_bits(outer, found, tmp_path, monkeypatch):
    """Unit: what was finished is not run again; figures equal those of an uninterrupted map to the last bit."""
    path = tmp_path / MAP_POINTS
    ran = counted(monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        slip_map(outer, SPEEDS, LOADS, 1, interrupt, path)
    kept = path.read_bytes()
    assert len(kept.split()) > 2 and lines(path) == 2 and LOADS[1] not in ran[:4]
    ran.clear()
    assert slip_map(outer, SPEEDS, LOADS, 1, None, path).points == found.points
    assert ran == 4 * [LOADS[1]]
    ran.clear()
    # A finer map takes over what it shares; of a line cut short nothing is read.
    path.write_bytes(path.read_bytes()[:-9])
    finer = slip_map(outer, SPEEDS, (60.0, 600.0, 1300.0), 2, None, path)
    assert sorted(ran) == 4 * [600.0] + 2 * [1300.0]
    assert (*finer.points[:2], *finer.points[4:]) == found.points


def test_unit_map_of_another_scene_or_code_runs_again(make_scene, tmp_path, monkeypatch):
    """Unit: a kept point is of its scene and of the code that ran it; a failed one is kept with its cause."""
    budget = ("numerics.step_budget_per_turn=100", "numerics.method=rk45")
    place = ((24000.0,), (1300.0,), 1, None, tmp_path / MAP_POINTS)
    ran = counted(monkeypatch)
    first = slip_map(make_scene(*budget), *place)
    assert slip_map(make_scene(*budget), *place).points == first.points and len(ran) == 2
    assert "step budget" in first.failed[0].status
    slip_map(make_scene(*budget, "numerics.seed=2"), *place)
    assert len(ran) == 4
    monkeypatch.setattr("rbdyn.base.files.source_digest", lambda *roots: "edited")
    slip_map(make_scene(*budget), *place)
    assert len(ran) == 6


@pytest.mark.slow
def test_command_line_killed_map_resumes(command, tmp_path):
    """Command line: after SIGKILL and after Ctrl-C, which tells what is kept, the map is that of an undisturbed run."""
    where = ("--speed", "12000,24000", "--load", "200:1300:3", "--workers", "1", "--turns", "60", "--replicates", "2")
    arguments = ("map", str(EXAMPLE), *where, "--set", "numerics.companion=false")
    assert command(*arguments, "--out", tmp_path / "whole").returncode == 0
    out = tmp_path / "out"
    for count, number in ((1, signal.SIGKILL), (3, signal.SIGINT)):
        process = subprocess.Popen(
            [sys.executable, "-m", "rbdyn", *arguments, "--out", str(out)],
            stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip
        deadline = time.monotonic() + 120.0
        while time.monotonic() < deadline and not ((out / MAP_POINTS).exists() and lines(out / MAP_POINTS) >= count):
            time.sleep(0.01)
        process.send_signal(number)
        _, said = process.communicate()
        assert process.returncode == (-signal.SIGKILL if number == signal.SIGKILL else 130), said
    assert (
        said.splitlines()[-1]
        == f"interrupted; finished parts are saved in {out / MAP_POINTS}; start the command again to resume"
    )
    assert 3 <= lines(out / MAP_POINTS) < 6
    assert command(*arguments, "--out", out).returncode == 0
    one, two = (json.loads((folder / "map.json").read_text()) for folder in (tmp_path / "whole", out))
    assert one["points"] == two["points"] and lines(out / MAP_POINTS) == 6
    # Long enough to be under way when the signal comes, however fast the machine.
    long = [{"60": "20000"}.get(each, each) for each in arguments]
    stopped = subprocess.Popen(
        [sys.executable, "-m", "rbdyn", *long, "--json"], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    time.sleep(5.0)
    stopped.send_signal(signal.SIGINT)
    shown, said = stopped.communicate()
    assert (stopped.returncode, json.loads(shown)["status"]) == (130, "interrupted")
    assert said.strip().splitlines()[-1] == "interrupted; nothing was saved"


def lines(path: Path) -> int:
    """Points that a file of them holds."""
    return sum(bool(line.strip()) for line in path.read_text().splitlines())


def test_unit_axis_values():
    """Unit: both ways to write an axis, and what is refused."""
    assert axis_values("1000:3000:3", "--speed") == [1000.0, 2000.0, 3000.0]
    assert axis_values("5,7.5", "--load") == [5.0, 7.5]
    for wrong in ("1:2", "a,b", "3,2", "1:nan:2", "1,1", ""):
        with pytest.raises(InputError, match="--load"):
            axis_values(wrong, "--load")


def test_unit_map_refuses_a_schedule(make_scene):
    """Unit: a scene that schedules its own load cannot be mapped."""
    scene = make_scene("operation.schedule={time_s=[0.0],radial_load_N=[100.0]}")
    with pytest.raises(InputError, match=r"operation\.schedule"):
        slip_map(scene, SPEEDS, LOADS)


def test_unit_a_map_over_other_keys_is_what_single_runs_give(outer, tmp_path, drawn):
    """Unit: figures and class of a point are those of its scene; tables, picture and screen name both keys."""
    from rbdyn.dynamics.simulate import simulate

    scene = with_options(outer, ("numerics.replicates=2", "numerics.turns=30"))
    keys = ("model.pocket_friction", "cage.pocket_clearance_mm")
    found = slip_map(scene, (0.05, 0.1), (0.2, 0.3), notice=None, keys=keys)
    point = found.points[1]
    assert point.at == {"model.pocket_friction": 0.1, "cage.pocket_clearance_mm": 0.2}
    alone = simulate(with_options(scene, [f"{key}={value}" for key, value in point.at.items()]), notice=None)
    assert point.figures["power_loss_W"] == alone.power_loss_W and point.verdict == alone.verdict
    write(found, None, tmp_path)
    assert found.as_dict()["axes"] == dict(zip(keys, ([0.05, 0.1], [0.2, 0.3]), strict=True))
    assert found.as_dict()["speeds_rpm"] is None
    assert list(found.table()[keys[0]]) == [0.05, 0.1, 0.05, 0.1] and list(found.table()["cage_share"]) == [
        pytest.approx(max(share.mean for share in one.verdict.shares.values())) for one in found.points
    ]
    screen = terminal_text(map_blocks(found), width=200)
    assert "pocket clearance [mm]" in screen and "pocket friction 0.1" in screen and point.verdict.cell in screen
    assert not lacking(drawn["map.png"], found.grid("power_loss_W"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--speed", "1000"), "a map has two axes, and 1 are stated"),
        (("--load", "1", "--sweep", "operation.radial_load_N=1"), "state two different ones"),
        (("--speed", "1", "--sweep", "numerics.turns=1,2"), "'numerics.turns=1,2': belongs to all points"),
        (("--speed", "1", "--sweep", "mass"), "--sweep = 'mass': write it as key.path=value"),
        (("--speed", "1", "--sweep", "cage.mass_g=2,1"), "--sweep cage.mass_g 2,1: the values must rise"),
        (("--speed", "9000", "--sweep", "cage.mass=2"), "cage.mass: unknown key"),
        (("--speed", "9000", "--sweep", "cage.guidance=1"), "choose one of 'outer', 'inner' or 'roller'"),
        (("--speed", "1", "--sweep", "cage.mass_g=2", "--stiffness"), "--stiffness and --duty need a map over --speed"),
    ],
)
def test_command_map_names_what_is_wrong_with_its_axes(options, words):
    """Command line: one sentence, before anything runs."""
    done = in_process("rbdyn", "map", EXAMPLE, *options)
    assert (done.returncode, words in done.stderr) == (2, True), done.stderr


def test_command_map(command, tmp_path):
    """Command line: JSON alone on standard output; an impossible load is refused by name."""
    arguments = ("map", "examples/cylindrical_roller.toml", "--speed", "24000", "--turns", "2", "--replicates", "1")
    short = ("--set", "numerics.discard_turns=1", "--set", "numerics.companion=false")
    good = command(*arguments, *short, "--load", "300,1300", "--json")
    assert good.returncode == 0, good.stderr
    assert [point["radial_load_N"] for point in json.loads(good.stdout)["points"]] == [300.0, 1300.0]
    bad = command(*arguments, *short, "--load", "-5,300")
    assert bad.returncode == 2 and "radial_load_N" in bad.stderr and "Traceback" not in bad.stderr


def test_unit_every_option_is_a_scene():
    """Unit: every option, alone, is lawful for the bearing of the paper and changes the scene."""
    scene = Scene.load("examples/cylindrical_roller.toml")
    for name, assignments in OPTIONS.items():
        assert with_options(scene, assignments) != scene, name


def test_unit_option_costs(outer, tmp_path):
    """Unit: an option is timed beside the scene; one that contradicts the scene is left out."""
    options = {
        "contact law of ISO/TS 16281": OPTIONS["contact law of ISO/TS 16281"],
        "impossible": ("model.pocket_film_floor_um=1e6", "model.pocket_film=true"),
    }
    rows = option_costs(outer, options)
    assert [row.option for row in rows] == ["contact law of ISO/TS 16281"]
    row = rows[0]
    assert row.with_ns > 0.0 and row.without_ns > 0.0 and 0.0 < row.power_gap < 0.01
    # The same types of laws: the compiled code is shared, so both cost the same but for noise.
    assert row.difference_ns == row.with_ns - row.without_ns
    found = study_options(outer, options=options)
    assert accuracy.write(found, tmp_path) == ["options.json", "options.csv"]
    assert found.record["format"] == "rbdyn.options/1"
    saved = found.record["options"][0]
    assert saved["option"] == row.option and saved["with_ns"] > 0.0
