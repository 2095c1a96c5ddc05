"""Commands on a scene with a heat balance, as a user meets them: what they print and write, JSON keys, exit codes."""

import json

import pytest
from conftest import EXAMPLE

from rbdyn.cli.show import request_of

SHORT = """
[numerics]
turns = 6
discard_turns = 3
replicates = 2
extend = false
impact_window_turns = 3
"""
HOT = (
    EXAMPLE.read_text(encoding="utf-8").replace(
        "temperature_C = 100.0", "oil_flow_l_min = 1.0\noil_inlet_temperature_C = 80.0"
    )
    + """
[mounting]
bore_mm = 27.0
outside_diameter_mm = 60.0
width_mm = 16.0
housing_diameter_mm = 90.0

[thermal]
"""
    + SHORT
)


@pytest.fixture
def scene(tmp_path):
    """A file with the bearing of the example under a flow of oil."""
    path = tmp_path / "hot.toml"
    path.write_text(HOT, encoding="utf-8")
    return path


def test_simulate_states_temperatures_and_their_origin(command, scene, tmp_path):
    """Command line: a table of temperatures with the range of the inputs first, the way of the heat, and figures in the files."""
    done = command("simulate", scene, "--out", tmp_path / "out", "-q")
    assert done.returncode == 0
    for words in (
        "temperature [°C]",
        "inputs (90 %)",
        "inner ring and shaft",
        "steady state; thermal loop gain",
        "removed: oil flow",
    ):
        assert words in done.stdout
    assert "heat balance with 1 L/min at 80 °C" in done.stdout
    figures = (tmp_path / "out" / "figures.csv").read_text(encoding="utf-8")
    assert "inner_temperature_C" in figures
    assert "inner ring and shaft" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert request_of(tmp_path / "out", 2.0, 1).scene.mounting.roller_temperature_C > 80.0


def test_simulate_json_has_the_stated_keys(command, scene):
    """Command line: one object with temperatures_C and thermal, next to the keys of any other result."""
    done = command("simulate", scene, "--json")
    record = json.loads(done.stdout)
    assert done.returncode == 0 and record["status"] == "ok"
    assert list(record["temperatures_C"]) == ["oil", "outer", "inner", "rollers"]
    assert set(record["temperatures_C"]["oil"]) == set(record["power_loss_W"])
    balance = record["thermal"]
    assert balance["status"] == "steady" and isinstance(balance["gain"], float)
    assert list(balance["heat_W"]) == ["oil", "outer", "inner", "rollers"]
    assert record["clearance_um"]["guide"]["temperature"] < 0.0


def test_simulate_without_a_steady_state_exits_as_a_failure(command, scene):
    """Command line: a verdict is printed with its reason and its last state, as text and as JSON, with exit code 1."""
    done = command("simulate", scene, "--set", "thermal.oil_ceiling_C=85")
    assert done.returncode == 1 and "too hot" in done.stdout and "thermal.oil_ceiling_C" in done.stdout
    done = command("simulate", scene, "--set", "thermal.oil_ceiling_C=85", "--json")
    record = json.loads(done.stdout)
    assert done.returncode == 1 and record["status"] == "too hot" and "85" in record["thermal"]["reason"]


def test_simulate_refuses_a_cage_that_seizes_when_cold(command, scene):
    """Command line: a bearing that is impossible at the temperature of its oil inlet is bad input in a sentence."""
    seized = ["--set", "materials.cage=peek", "--set", "cage.guide_clearance_mm=0.1", "--set", "cage.mass_g=7"]
    done = command("simulate", scene, *seized)
    assert done.returncode == 2 and "the cage seizes" in done.stderr and "Traceback" not in done.stderr


def test_a_first_guess_is_no_point_of_a_duty(command, scene, tmp_path):
    """Command line: a duty that sets nothing but the first guess of the oil's temperature is bad input, for it has one point."""
    (tmp_path / "duty.toml").write_text(
        '[[duty]]\nname = "cold"\nshare = 1.0\nset = ["lubricant.temperature_C=20.0"]\n', encoding="utf-8"
    )
    done = command("map", scene, "--speed", "24000", "--load", "1300", "--duty", tmp_path / "duty.toml")
    assert done.returncode == 2 and "duty 'cold': lubricant.temperature_C: is a first guess alone" in done.stderr


def test_map_fails_where_the_oil_is_too_hot(command, scene):
    """Command line: a cell above the oil's ceiling has no figures but its cause, and the command ends with code 1."""
    low = ["--set", "thermal.oil_ceiling_C=87", "--set", "numerics.companion=false"]
    done = command("map", scene, "--speed", "3000,24000", "--load", "1300", "--json", *low)
    cool, hot = json.loads(done.stdout)["points"]
    assert done.returncode == 1 and cool["status"] == "ok"
    assert "too hot: the oil reaches" in hot["status"] and "power_loss_W" not in hot


def test_map_marks_a_point_that_adds_heat_at_its_temperatures(scene):
    """Command line: a point of a duty that adds the balance to a scene without it is computed with it."""
    from pathlib import Path

    from rbdyn.cli.simulation_output import map_duty
    from rbdyn.dynamics.part_figures import static_life
    from rbdyn.dynamics.simulate import steady_scene
    from rbdyn.scene import Scene
    from rbdyn.scene.duty import duty_scenes, read_duty

    hot = scene.read_text(encoding="utf-8")
    plain = hot.replace(
        "oil_flow_l_min = 1.0\noil_inlet_temperature_C = 80.0", 'temperature_C = 100.0\nsupply = "bath"'
    )
    scene.write_text(plain.replace("[thermal]", ""), encoding="utf-8")
    duty = Path(scene).with_name("duty.toml")
    points = [
        f'[[duty]]\nname = "{name}"\nshare = 0.5\nset = {keys}\n'
        for name, keys in (("off", "[]"), ("on", '["thermal.ambient_C=20.0"]'))
    ]
    duty.write_text("\n".join(points), encoding="utf-8")
    loaded = Scene.load(scene)
    off, on = map(steady_scene, duty_scenes(loaded, read_duty(duty), str(duty)))
    assert off.mounting.inner_ring_temperature_C is None and on.mounting.inner_ring_temperature_C > 60.0
    lives = [static_life(point).hours(*point.operation.speeds) for point in (off, on)]
    assert [point.L10_h for point in map_duty(loaded, duty, (24000.0,), (1300.0,)).points] == pytest.approx(lives)


def test_map_has_points_at_their_own_temperatures(command, scene):
    """Command line: a map of a heat balance runs each point at its steady temperatures, and a hot one fails with its reason."""
    grid = ["--speed", "12000,24000", "--load", "1300"]
    done = command("map", scene, *grid, "--set", "numerics.companion=false", "--json")
    assert done.returncode == 0
    slow, fast = json.loads(done.stdout)["points"]
    assert 0.0 < slow["power_loss_W"]["value"] < fast["power_loss_W"]["value"]
