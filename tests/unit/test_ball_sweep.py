"""Sweeps of ball bearings: the same equilibria as one by one, failures, messages, files, pictures and the command."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import ROOT, lacking
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from rbdyn import equilibrium
from rbdyn.base.faults import InputError
from rbdyn.cli.app import app
from rbdyn.life import turning_rings
from rbdyn.plots import ball as ball_pictures
from rbdyn.quasistatic import sweep as sweeps
from rbdyn.quasistatic.result import reference_capacities, solution_life
from rbdyn.quasistatic.row.equilibrium import LOST
from rbdyn.quasistatic.sweep import Axis, SweepResult, snake, sweep
from rbdyn.scene import BallScene

EXAMPLE = ROOT / "examples" / "angular_contact_ball.toml"
DOUBLE = ROOT / "examples" / "double_decker.toml"
SPEED, LOAD = "operation.inner_speed_rpm", "operation.axial_load_N"


def scene_with(*assignments, file=EXAMPLE):
    return BallScene.load(file, assignments)


@pytest.fixture(scope="module")
def grid():
    """Three axial loads by four speeds."""
    return sweep(scene_with(), {LOAD: [150.0, 250.0, 400.0], SPEED: [5e3, 15e3, 25e3, 35e3]})


def assert_as_alone(found, place, scene):
    """All figures of a point are those of ``rbdyn.equilibrium``."""
    alone = equilibrium(scene)
    record, row = alone.as_dict(), alone.rows[0]
    shown = {name: float(column[place]) for name, column in found.columns.items()}
    near = dict(rel=1e-8, abs=1e-12)
    scale = np.abs(alone.displacement[:3]).max()
    assert [shown[f"{axis}_mm"] for axis in "xyz"] == pytest.approx(
        [record["displacement_mm"][axis] for axis in "xyz"], rel=1e-10, abs=1e-10 * 1e3 * scale
    )
    tilts = [record["tilt_mrad"][axis] for axis in "xy"]
    assert [shown[f"tilt_{axis}_mrad"] for axis in "xy"] == pytest.approx(tilts, rel=1e-8, abs=1e-10)
    for race in ("inner", "outer"):
        loads = np.array([ball[f"{race}_load_N"] for ball in record["balls"]])
        angles = np.array([ball[f"{race}_angle_deg"] for ball in record["balls"]])
        if race == "inner":
            angles = angles[loads > 0.0]
            assert shown["loaded_balls"] == angles.size
        assert shown[f"{race}_load_max_N"] == pytest.approx(loads.max(), rel=1e-10)
        assert shown[f"{race}_angle_min_deg"] == pytest.approx(angles.min(), **near)
        assert shown[f"{race}_angle_max_deg"] == pytest.approx(angles.max(), **near)
        assert shown[f"{race}_pressure_MPa"] == pytest.approx(record["max_stress_MPa"][race], rel=1e-10)
    for axis in "xyz":
        assert shown[f"stiffness_{axis}_N_per_um"] == pytest.approx(record["stiffness"][f"{axis}_N_per_um"], rel=1e-8)
    forces = [shown[f"force_{axis}_N"] for axis in "xyz"]
    assert forces == pytest.approx(row.reaction[:3], rel=1e-9, abs=1e-9 * np.abs(row.reaction).max())
    speeds = scene.operation.inner_speed_rpm, scene.operation.outer_speed_rpm
    life = solution_life(row, reference_capacities(scene.bearing), turning_rings(*speeds))
    assert shown["L10_Mrev"] == pytest.approx(life.million_turns, rel=1e-9)
    hours = life.hours(*(np.pi / 30.0 * speed for speed in speeds))
    assert shown["L10_h"] == pytest.approx(hours, rel=1e-9)


def test_unit_a_grid_is_what_single_equilibria_give(grid):
    """Unit: every figure at every point of a grid is that of the scene alone, started from nothing."""
    assert grid.status == "ok" and grid.shape == (3, 4) and grid.cold == 1
    for place in range(12):
        values = [f"{key}={value}" for key, value in grid.key_values(place).items()]
        assert_as_alone(grid, place, scene_with(*values))


@pytest.mark.parametrize(
    ("key", "values", "others"),
    [
        ("bearing.clearance_change_um", [-20.0, 0.0, 15.0], ()),
        ("bearing.inner_groove_factor", [0.512, 0.53], ()),
        ("bearing.ball_diameter_mm", [2.8, 3.2], ("operation.tilt='free'",)),
        ("operation.prescribed.tilt_y_mrad", [-0.5, 0.0, 0.5], ()),
        ("operation.preload_um", [4.0, 8.0], ("operation.axial_load_N=0.0",)),
        ("operation.outer_speed_rpm", [-2e4, 0.0, 2e4], ()),
        ("model.friction_limit", [0.05, 0.3], ()),
        ("bearing.balls", [16, 20, 29], ()),
        (
            "materials.ball.density_kg_m3",
            [3200.0, 7800.0],
            ("materials.ball={elastic_modulus_GPa=310.0, poisson_ratio=0.26, density_kg_m3=3200.0}",),
        ),
    ],
)
def test_unit_any_number_of_a_scene_can_be_swept(key, values, others):
    """Unit: geometry, materials, model and what is prescribed, each as the scene alone gives it."""
    found = sweep(scene_with(*others), {key: values})
    assert found.status == "ok"
    for place, value in enumerate(values):
        assert_as_alone(found, place, scene_with(*others, f"{key}={value}"))


def test_unit_items_of_lists_count_from_one():
    """Unit: load_N[3] is the axial load."""
    others = ("operation={load_N=[200.0, 0.0, 100.0], inner_speed_rpm=20000.0, tilt='fixed'}",)
    found = sweep(scene_with(*others), {"operation.load_N[3]": [100.0, 300.0]})
    assert found.columns["force_z_N"] == pytest.approx([100.0, 300.0], rel=1e-9)
    assert found.columns["force_x_N"] == pytest.approx([200.0, 200.0], rel=1e-9)


def test_invariant_the_order_of_points_does_not_matter(grid):
    """Invariant: backwards, and with the keys exchanged, the same figures; once more, the same bits."""
    loads, speeds = grid.keys[LOAD], grid.keys[SPEED]
    again = sweep(scene_with(), {LOAD: loads, SPEED: speeds})
    turned = sweep(scene_with(), {SPEED: speeds[::-1], LOAD: loads[::-1]})
    for name, column in grid.columns.items():
        assert np.array_equal(again.columns[name], column)
        if name not in ("residual_N", "iterations"):
            other = turned.grid(name)[::-1, ::-1].T.ravel()
            assert other == pytest.approx(column, rel=1e-8, abs=1e-10 * np.abs(column).max() + 1e-12)


def test_unit_three_keys_stand_in_the_order_of_the_table():
    """Unit: whatever way the snake went, a row of the table has the figures of its own keys."""
    radial = "operation.radial_load_N"
    table = sweep(scene_with(), {LOAD: [150.0, 250.0], radial: [100.0, 200.0], SPEED: [5e3, 1e4, 2e4]}).table()
    assert table[SPEED].tolist() == [5e3, 1e4, 2e4] * 4 and table[LOAD].tolist() == [150.0] * 6 + [250.0] * 6
    assert table["force_z_N"].to_numpy() == pytest.approx(table[LOAD].to_numpy(), rel=1e-8)
    assert table["force_x_N"].to_numpy() == pytest.approx(table[radial].to_numpy(), rel=1e-8)
    assert (table["L10_h"] * table[SPEED] * 60.0 / 1e6).to_numpy() == pytest.approx(table["L10_Mrev"].to_numpy())


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4))
@settings(max_examples=40, deadline=None)
def test_invariant_a_snake_visits_all_and_steps_by_one(sizes):
    """Invariant: every point once, and from each to the next one index changes by one."""
    axes = [Axis(str(i), (), tuple(float(value) for value in range(size))) for i, size in enumerate(sizes)]
    order = snake(axes)
    assert len(set(order)) == len(order) == np.prod(sizes)
    if len(order) > 1:
        assert (np.abs(np.diff(order, axis=0)).sum(axis=1) == 1).all()


@pytest.fixture(scope="module")
def broken():
    """A sweep in which two points of five are declared lost."""

    def lose(scene, *before, **options):
        found = solve(scene, *before, **options)
        lost = scene.operation.inner_speed_rpm in (10e3, 15e3)
        return SimpleNamespace(is_equilibrium=False, status=LOST) if lost else found

    solve = sweeps.equilibrium
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweeps, "equilibrium", lose)
        return sweep(scene_with(), {SPEED: [5e3, 10e3, 15e3, 20e3, 25e3]})


def test_unit_failed_points_are_records_grouped_by_cause(broken, tmp_path):
    """Unit: points without an equilibrium tell why, the others go on; pictures leave a gap."""
    assert broken.status == "2 of 5 points failed"
    ((short, places),) = broken.failures.items()
    cause = broken.statuses[1]
    assert places == [1, 2] and "no equilibrium" in short and cause.startswith(f"{short}:")
    table = broken.table()
    assert table["x_mm"].isna().tolist() == [False, True, True, False, False]
    assert table["status"].tolist() == ["ok", cause, cause, "ok", "ok"]
    record = broken.as_dict()
    assert record["points"][1] == {SPEED: 10e3, "status": cause}
    assert record["failures"] == [{"cause": short, "points": 2, "first": {SPEED: 10e3}, "status": cause}]
    assert set(broken.balls()[SPEED]) == {5e3, 20e3, 25e3}
    assert len(ball_pictures.sweep_pictures(broken, tmp_path)) == 4


def test_unit_overloaded_points_are_those_of_single_equilibria():
    """Unit: a load that no contact can carry has the status of the scene alone; two such are one cause."""
    found = sweep(scene_with(), {LOAD: [200.0, 1e6, 1e7]})
    alone = [equilibrium(scene_with(f"{LOAD}={load}")).status for load in (200.0, 1e6, 1e7)]
    assert list(found.statuses) == alone and found.failures == {"overloaded": [1, 2]}


def test_unit_a_lost_point_is_followed_by_a_fresh_start(broken):
    """Unit: the loop goes on after points without an equilibrium, and starts the next from nothing."""
    assert [status == "ok" for status in broken.statuses] == [True, False, False, True, True]
    assert broken.cold == 4  # all but the last
    assert_as_alone(broken, 3, scene_with(f"{SPEED}=20e3"))


def test_unit_a_double_decker_goes_point_by_point(tmp_path):
    """Unit: both rows and the middle ring as ``rbdyn.equilibrium`` has them; pictures show both."""
    found = sweep(scene_with(file=DOUBLE), {SPEED: [5e3, 15e3]})
    alone = equilibrium(scene_with(f"{SPEED}=15e3", file=DOUBLE)).as_dict()
    shown = {name: column[1] for name, column in found.columns.items()}
    assert found.status == "ok" and found.cold == 1
    assert shown["x_mm"] == pytest.approx(alone["displacement_mm"]["x"], rel=1e-9)
    assert shown["middle_ring_speed_rpm"] == pytest.approx(alone["middle_ring"]["speed_rpm"])
    for row in ("inner", "outer"):
        assert shown[f"{row}_row_outer_pressure_MPa"] == pytest.approx(alone[row]["max_stress_MPa"]["outer"], rel=1e-9)
        most = max(ball["inner_angle_deg"] for ball in alone[row]["balls"])
        assert shown[f"{row}_row_inner_angle_max_deg"] == pytest.approx(most, rel=1e-8)
    assert set(found.balls()["row"]) == {"inner", "outer"}
    assert len(ball_pictures.sweep_pictures(found, tmp_path)) == 4


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({}, "no key to sweep"),
        ({"operation.inner_sped_rpm": [1.0]}, "did you mean inner_speed_rpm?"),
        ({"operation.tilt": [1.0]}, "operation.tilt = 'fixed': is not a number"),
        ({"operation": [1.0]}, "is a table, not a number"),
        ({"model.gyroscopic": [0.0, 1.0]}, "is not a number"),
        ({"operation.load_N[3]": [1.0]}, "the scene has no list operation.load_N"),
        ({"operation.load_N(3)": [1.0]}, "not a key"),
        ({"materials.ball.density_kg_m3": [3200.0]}, "materials.ball = 'bearing_steel' is not a table"),
        ({"bearing.balls": [20.5]}, "bearing.balls = 20.5: must be a whole number"),
        ({SPEED: [1.0, 3.0, 2.0]}, "must rise or fall"),
        ({SPEED: [1.0, np.nan]}, "not all finite"),
        ({SPEED: ["fast"]}, "are not numbers"),
        ({SPEED: np.linspace(0.0, 1.0, 600), LOAD: np.linspace(0.0, 1.0, 600)}, "360000 points"),
        ({"bearing.inner_groove_factor": [0.4, 0.52]}, "(bearing.inner_groove_factor = 0.4)"),
        ({LOAD: [1.0, 2.0], "bearing.ball_diameter_mm": [3.0, 6.0]}, "ball_diameter_mm = 6): bearing.balls = 29"),
    ],
)
def test_unit_bad_sweeps_are_refused_in_a_sentence(keys, sentence):
    """Unit: what cannot be swept, and the point that the scene refuses, is named."""
    with pytest.raises(InputError) as refused:
        sweep(scene_with(), keys)
    assert len(refused.value.faults) == 1 and sentence in refused.value.faults[0]


def test_unit_saved_and_loaded(grid, tmp_path):
    """Unit: JSON brings all figures back; CSV is the table; balls have a row each."""
    grid.save(tmp_path / "sweep.json")
    grid.save(tmp_path / "sweep.csv")
    again = SweepResult.load(tmp_path / "sweep.json")
    assert again.keys == grid.keys and again.statuses == grid.statuses
    for name, column in grid.columns.items():
        assert np.array_equal(again.columns[name], column)
    lines = (tmp_path / "sweep.csv").read_text().splitlines()
    assert len(lines) == 13 and lines[0].startswith(f"{LOAD},{SPEED},x_mm")
    balls = grid.balls()
    assert len(balls) == 12 * 29
    at = balls[(balls[LOAD] == 250.0) & (balls[SPEED] == 35e3)]
    assert at["inner_load_N"].max() == grid.grid("inner_load_max_N")[1, 3]
    with pytest.raises(RuntimeError, match="run the sweep again"):
        again.balls()
    for text in ("{}", "[", '{"format": "other"}'):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(InputError):
            SweepResult.load(tmp_path / "bad.json")


def test_trend_speed_drives_the_contact_angles_apart(grid):
    """Trend (Hu et al. 2021, figure 7): centrifugal force raises inner and lowers outer angles, the less the more axial load."""
    apart = grid.grid("inner_angle_max_deg") - grid.grid("outer_angle_min_deg")
    assert (np.diff(apart, axis=1) > 0.0).all() and (np.diff(apart[:, 1:], axis=0) < 0.0).all()


def test_unit_pictures(grid, tmp_path, drawn):
    """Unit: few lines are lines, many a map; an equilibrium gives three pictures; each shows its figures."""
    names = ball_pictures.sweep_pictures(grid, tmp_path)
    assert not lacking(drawn["angles.png"], grid.grid("inner_angle_max_deg"))
    assert not lacking(drawn["pressure_and_life.png"], grid.grid("L10_Mrev"))
    assert not lacking(drawn["stiffness.png"], grid.grid("stiffness_x_N_per_um"))
    names += ball_pictures.sweep_pictures(
        sweep(scene_with(), {LOAD: np.linspace(100.0, 400.0, 8), SPEED: [1e4, 2e4]}), tmp_path
    )
    assert names == ["angles.png", "pressure_and_life.png", "stiffness.png", "map.png"]
    one = equilibrium(scene_with())
    ball_pictures.pictures(one, tmp_path)
    assert drawn.keys() == {*names, "loads.png", "angles.png", "section.png"}
    for picture, figure in (("loads.png", "inner_load_N"), ("angles.png", "inner_angle_deg")):
        assert not lacking(drawn[picture], [ball[figure] for ball in one.as_dict()["balls"]])


def test_unit_labels_carry_units():
    """Unit: an axis says what the key says, its unit in brackets."""
    labels = [ball_pictures.label(key) for key in (SPEED, "operation.load_N[3]", "bearing.inner_groove_factor")]
    assert labels == ["inner speed [rpm]", "load 3 [N]", "inner groove factor"]


def test_command_line_sweeps(command, tmp_path):
    """Command line: one JSON object and files; a refused point is one sentence and exit 2."""
    out = tmp_path / "out"
    shown = command("ball", EXAMPLE, "--sweep", f"{SPEED}=10000:30000:20", "--out", out, "--json")
    record = json.loads(shown.stdout)
    assert shown.returncode == 0 and record["status"] == "ok" and len(record["points"]) == 20
    assert {"sweep.json", "sweep.csv", "angles.png", "azimuth.png"} <= {file.name for file in out.iterdir()}
    refused = command("ball", EXAMPLE, "--sweep", "bearing.inner_groove_factor=0.4,0.52")
    assert refused.returncode == 2 and len(refused.stderr.splitlines()) == 1


def test_command_line_table_and_exit_codes(broken, grid, monkeypatch, capsys):
    """Command line: a long table is cut; failures are grouped on standard error and the exit code is 1."""
    from rbdyn.cli import ball_studies

    def swept(result):
        monkeypatch.setattr(ball_studies, "sweep", lambda *rest: result)
        ran = CliRunner().invoke(app, ["ball", str(EXAMPLE), "--sweep", f"{SPEED}=1,2"])
        return ran.exit_code, ran.stdout, ran.stderr

    code, out, error = swept(broken)
    assert code == 1 and "failed" in out
    assert error.startswith(f"2 points, the first at {SPEED} = 10000: no equilibrium")
    code, out, _ = swept(grid)
    assert code == 0 and "12 points" in out


@pytest.mark.parametrize(
    ("file", "changes", "keys"),
    [
        (EXAMPLE, ("operation.tilt=free",), {LOAD: [-300.0, 100.0, 20e3, 40e3], SPEED: [0.0, 60e3]}),
        (EXAMPLE, ("model.raceway_control=hybrid",), {SPEED: [10e3, 60e3, 120e3], LOAD: [-50.0, 20.0]}),
        (EXAMPLE, ("model.solver=finite_search", "operation.inner_speed_rpm=0.0"), {LOAD: [-100.0, 20e3, 1e7]}),
        (DOUBLE, ("operation.tilt=free",), {LOAD: [-200.0, 50.0, 20e3]}),
    ],
)
def test_oracle_a_sweep_has_the_notes_of_its_points(file, changes, keys, tmp_path):
    """Oracle: the notes of each point are those of its equilibrium alone, in the table by what they are about; saved and read."""
    scene = scene_with(*changes, file=file)
    found = sweep(scene, keys)
    table, told = found.table()["notes"], 0
    for place, status in enumerate(found.statuses):
        point = [f"{key}={value}" for key, value in found.key_values(place).items()]
        alone = equilibrium(scene_with(*changes, *point, file=file)).as_dict().get("notes", ())
        assert status != "ok" or len(alone) == len([word for word in table[place].split("; ") if word])
        for note in found.notes:
            assert note["about"] not in table[place] if place not in note["points"] else note["about"] in table[place]
            if place == note["points"][0]:
                assert {key: note[key] for key in ("level", "code", "text")} in alone
                told += 1
    assert told == len(found.notes) >= 1
    found.save(tmp_path / "sweep.json")
    assert SweepResult.load(tmp_path / "sweep.json").notes == found.notes
