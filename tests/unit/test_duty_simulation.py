"""Simulation at each point of a duty: figures, the worst point, lives, and points that fail."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest

import rbdyn
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.terminal import text
from rbdyn.cli.simulation_output import simulated_blocks
from rbdyn.dynamics import duty_simulation
from rbdyn.dynamics.duty_simulation import DutySimulation, simulate_duty, worst_of
from rbdyn.dynamics.part_figures import roller_duty_life
from rbdyn.result import Quantity
from rbdyn.scene import Scene
from rbdyn.scene.duty import duty_scenes, read_duty

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
SHORT = ["numerics.turns=3", "numerics.replicates=2", "numerics.extend=false", "numerics.companion=false"]
KEYS = "operation.inner_speed_rpm,operation.radial_load_N"
TABLE = f"name,hours,{KEYS}\nidle,300,8000,200\ncruise,1600,20000,\ntake-off,100,24000,1300\n"


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The example with short runs."""
    return Scene.load(EXAMPLE, SHORT)


@pytest.fixture(scope="module")
def duty(tmp_path_factory) -> Path:
    """Three points with hours."""
    path = tmp_path_factory.mktemp("duty") / "duty.csv"
    path.write_text(TABLE, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def found(scene, duty) -> DutySimulation:
    """The scene at these points."""
    return simulate_duty(scene, duty, notice=None)


def test_unit_each_point_is_its_own_simulation(scene, duty, found):
    """Unit: the figures of a point are those of its scene simulated alone, and the life is that over the duty."""
    assert found.status == "ok" and [point.share for point in found.points] == pytest.approx([0.15, 0.8, 0.05])
    at_points = duty_scenes(scene, read_duty(duty), "duty")
    alone = rbdyn.simulate(at_points[0], notice=None)
    assert found.points[0].figures == alone.responses
    life = roller_duty_life(at_points, [0.15, 0.8, 0.05])
    assert found.life == life.figures
    assert [point.L10_h for point in found.points] == pytest.approx(life.point_hours)
    assert [point.damage_share for point in found.points] == pytest.approx(life.damage)


def test_unit_a_duty_survives_saving(found, tmp_path):
    """Unit: the record reads back as itself, with the speed that a point leaves to the scene; the table has a row a point."""
    found.save(tmp_path / "duty.json")
    assert DutySimulation.load(tmp_path / "duty.json") == found
    assert json.loads((tmp_path / "duty.json").read_text())["points"][1]["radial_load_N"] == 1300.0
    table = found.table()
    assert table["name"].to_list() == ["idle", "cruise", "take-off"]
    assert {"impact_force_N_statistical_error", "radial_operating_clearance_um", "L10_h"} <= set(table)


def test_unit_a_life_below_the_hours_of_the_duty_is_a_danger(scene, duty, found, monkeypatch):
    """Unit: hours beyond the life bring a danger, shares or fewer hours none; an unknown life names the points without one."""

    def unrun(*_, **__):
        raise RunError("not run")

    monkeypatch.setattr(duty_simulation, "simulate", unrun)
    points = read_duty(duty)
    total = sum(point.share for point in points)
    for hours, short in ((1.0, False), (0.99 * found.life.L10_h, False), (1.01 * found.life.L10_h, True)):
        scaled = [point.model_copy(update={"share": point.share * hours / total}) for point in points]
        unsimulated = simulate_duty(scene, scaled, notice=None)
        assert ("short-life" in [note.code for note in unsimulated.notes]) == short
    first, second, third = unsimulated.points
    lost = replace(unsimulated, life=None, points=(first, replace(second, L10_h=None), third))
    assert "Life over the duty: unknown, because cruise has none." in text(simulated_blocks(lost))


def test_closed_form_of_the_worst_point():
    """Closed form: the largest force and the least clearance, told apart from others by the error of the difference."""
    points = {
        name: {
            "impact_force_N": Quantity(force, 3.0, 0.0, 50.0, 7),
            "guide_operating_clearance_um": Quantity(play, 0.0, 0.0, 1.0),
            "cage_speed_rpm": Quantity(force, 0.0, 0.0, 1.0),
            "pocket_operating_clearance_um": Quantity(300.0, 0.0, 0.0, 1.0),
            "cage_slip": Quantity(slip, 0.0, 0.0, 1.0),
        }
        for name, force, play, slip in (
            ("idle", 50.0, 40.0, -0.3),
            ("cruise", 98.0, 90.0, 0.1),
            ("take-off", 100.0, 60.0, 0.2),
        )
    }
    worst = worst_of(points)
    assert set(worst) == {"impact_force_N", "guide_operating_clearance_um", "cage_slip"}
    assert (worst["impact_force_N"].point, worst["impact_force_N"].not_told_apart) == ("take-off", ("cruise",))
    assert (worst["guide_operating_clearance_um"].point, worst["guide_operating_clearance_um"].value) == ("idle", 40.0)
    assert worst["cage_slip"].point == "idle"


def test_unit_a_point_that_fails_leaves_the_others(scene, duty, found, monkeypatch):
    """Unit: a run that cannot go on is a point with its reason; the others have the same figures, and the answer names it."""
    run = duty_simulation.simulate

    def failing(at_point, *arguments, **options):
        if at_point.operation.inner_speed_rpm == 20000.0:
            raise RunError("the cage left its pockets at 0.3 ms")
        return run(at_point, *arguments, **options)

    monkeypatch.setattr(duty_simulation, "simulate", failing)
    failed = simulate_duty(scene, duty, notice=None)
    assert failed.status == "1 of 3 points failed" and failed.points[0].figures == found.points[0].figures
    assert failed.points[1].status == "failed: the cage left its pockets at 0.3 ms" and not failed.points[1].figures
    # Without a heat balance the life follows from the scene alone.
    assert failed.life == found.life and failed.notes[0] == "cruise failed: the cage left its pockets at 0.3 ms"
    assert "Danger: cruise failed: the cage left its pockets at 0.3 ms" in text(simulated_blocks(failed))
    assert failed.worst["impact_force_N"].point in ("idle", "take-off")


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("d.csv", "name,share,operation.iner_speed_rpm\na,1,9000\n", "operation.iner_speed_rpm: unknown key; did you mean operation.inner_speed_rpm?"),
        ("d.csv", "name,share\na,-0.5\n", "share in row 1 = -0.5: is below 0; check the sign"),
        ("d.toml", '[[duty]]\nname = "a"\nshare = 1.0\nset = ["operation.iner_speed_rpm=9000"]\n', "operation.iner_speed_rpm: unknown key; did you mean inner_speed_rpm?"),
    ],
)  # fmt: skip
def test_unit_bad_duties_are_refused(scene, tmp_path, name, content, fault):
    """Unit: one sentence with the file, before anything runs."""
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError) as refused:
        simulate_duty(scene, tmp_path / name)
    assert len(refused.value.faults) == 1 and fault in refused.value.faults[0] and name in refused.value.faults[0]


def test_command_line_simulate_over_a_duty(command, duty, tmp_path):
    """Command line: tables on the screen, files in the folder, one JSON object; a point that finds no steady state gives exit code 1."""
    options = [part for key in SHORT for part in ("--set", key)]
    ran = command("simulate", str(EXAMPLE), *options, "--duty", str(duty), "--out", str(tmp_path / "out"))
    assert ran.returncode == 0 and "Clearances in operation" in ran.stdout and "Life over the duty" in ran.stdout, (
        ran.stderr
    )
    with (tmp_path / "out" / "points.csv").open() as file:
        assert [row["name"] for row in csv.DictReader(file)] == ["idle", "cruise", "take-off"]
    record = json.loads(command("simulate", str(EXAMPLE), *options, "--duty", str(duty), "--json").stdout)
    assert [point["name"] for point in record["points"]] == ["idle", "cruise", "take-off"]
    assert (
        record["points"][0]["figures"]["impact_force_N"]["value"] > 0.0
        and record["worst"]["power_loss_W"]["point"] == "take-off"
    )


@pytest.mark.slow
def test_command_line_a_point_too_hot(command, tmp_path):
    """Command line: a point above a ceiling of its heat balance is named with the reason, the other has its figures; exit code 1."""
    (tmp_path / "hot.csv").write_text(
        "name,share,lubricant.oil_flow_l_min,operation.inner_speed_rpm\ncool,0.5,1,12000\ndry,0.5,0.02,30000\n"
    )
    hot = EXAMPLE.with_name("hot_roller.toml")
    ran = command("simulate", str(hot), "--duty", str(tmp_path / "hot.csv"), "--turns", "10", "--replicates", "2", "-q")
    assert ran.returncode == 1 and "cool" in ran.stdout
    danger = next(line for line in ran.stdout.splitlines() if line.startswith("Danger: too hot: the oil reaches"))
    assert danger.endswith("(at dry)")
