"""A duty on a map: its points with their lives, the marks on the picture, files and JSON, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest

from rbdyn.base.faults import InputError
from rbdyn.base.folder import files_in
from rbdyn.base.terminal import text as terminal_text
from rbdyn.cli.app import MAP_FILES, map_blocks
from rbdyn.cli.app import _write_map as write
from rbdyn.cli.simulation_output import map_duty
from rbdyn.dynamics.part_figures import static_life
from rbdyn.dynamics.slip_map import PANELS, Point, SlipMap
from rbdyn.life import life_notes
from rbdyn.result import Quantity
from rbdyn.scene.duty import AXES, duty_scenes, read_duty

SPEEDS, LOADS = (6000.0, 12000.0, 24000.0), (150.0, 1300.0)
DUTY = """
scene = "of a study, not read here"
[[duty]]
name = "idle"
share = 0.25
set = ["operation.inner_speed_rpm=6000", "operation.radial_load_N=150"]
[[duty]]
name = "cruise"
share = 0.7
set = ["operation.inner_speed_rpm=18000", "operation.radial_load_N=725", "lubricant.temperature_C=110"]
[[duty]]
name = "take-off"
share = 0.05
set = ["operation.inner_speed_rpm=30000"]
"""


@pytest.fixture
def path(tmp_path) -> Path:
    """A file with a duty of three points."""
    (tmp_path / "duty.toml").write_text(DUTY)
    return tmp_path / "duty.toml"


@pytest.fixture(scope="module")
def mapped() -> SlipMap:
    """A map of made-up figures."""
    figures = {name: Quantity(0.5, 0.1, 0.0, 10.0) for name in (panel.key for panel in PANELS)}
    points = tuple(Point(speed, load, "ok", figures, 0.0) for load in LOADS for speed in SPEEDS)
    return SlipMap(dict(zip(AXES, (SPEEDS, LOADS), strict=True)), points, 1.0, 1)


def test_unit_points_have_their_lives_and_notes(outer, path):
    """Unit: speed, load and life of each point from its scene; off the map and other keys are noted."""
    duty = map_duty(outer, path, SPEEDS, LOADS)
    assert [point.name for point in duty.points] == ["idle", "cruise", "take-off"]
    assert duty.marks == {"idle": (6000.0, 150.0), "cruise": (18000.0, 725.0), "take-off": (30000.0, 1300.0)}
    for point, scene in zip(duty.points, duty_scenes(outer, read_duty(path), "duty"), strict=True):
        assert point.L10_h == static_life(scene).hours(*scene.operation.speeds)
    assert sum(point.damage_share for point in duty.points) == pytest.approx(1.0)
    assert duty.notes == (
        "duty 'cruise': sets lubricant.temperature_C too, which the map keeps at the scene's values",
        "duty 'take-off': 30000 rpm and 1300 N are off the map, so its mark is at the edge; widen --speed or --load",
    )
    assert (
        life_notes(900.0, 1000.0)[0].code == "short-life" and life_notes(900.0, 1.0) == life_notes(1001.0, 1000.0) == ()
    )


def test_unit_map_files_with_a_duty(outer, path, mapped, tmp_path, drawn):
    """Unit: map.json and duty.csv have the points, the picture a diamond at each; without a duty nothing changes."""
    duty = map_duty(outer, path, SPEEDS, LOADS)
    write(mapped, duty, tmp_path)
    assert files_in(tmp_path, MAP_FILES) == ["map.json", "map.csv", "duty.csv", "map.png"]
    with_duty = json.loads((tmp_path / "map.json").read_text())
    # Columns 0, 1.5 and 2 of the cells, the last at the edge; rows 0, 0.5 and 1.
    assert {0.0, 1.5, 2.0, 0.5, 1.0} <= set(np.round(drawn["map.png"], 9).tolist())
    assert (tmp_path / "duty.csv").read_text().splitlines()[0] == ",".join(duty.points[0].as_dict())
    (tmp_path / "duty.csv").unlink()
    write(mapped, None, tmp_path)
    assert files_in(tmp_path, MAP_FILES) == ["map.json", "map.csv", "map.png"]
    without = json.loads((tmp_path / "map.json").read_text())
    assert with_duty.pop("duty") == json.loads(json.dumps(duty.as_dict())) and with_duty == without


def test_unit_blocks_state_the_life_over_the_duty(outer, path, mapped):
    """Unit: a row a point, then the life over the duty with the equivalent load."""
    duty = map_duty(outer, path, SPEEDS, LOADS)
    text = terminal_text(map_blocks(mapped, duty), width=200)
    assert "take-off" in text and "share of damage" in text
    assert f"{duty.life.equivalent_load_N:.1f} N" in text and "Life over the duty, L10r" in text


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", ["duty: missing; add a [[duty]] table for each point of operation"]),
        (DUTY.replace("0.25", "0.2"), ["duty.share: sums to 0.95 over all points, not to 1; change a share or"]),
        (DUTY.replace("cruise", "idle"), ["duty.name = 'idle': used more than once; name each once"]),
        (DUTY.replace("share = 0.7", "share = -1"), ["duty[2].share = -1: must be at least 0"]),
        (DUTY.replace("share = 0.7", 'hours = "7"'), ["duty[2].hours: unknown key", "duty[2].share: missing"]),
        (DUTY.replace('"operation.radial_load_N=150"', '"radial"'), ["duty.set of idle = 'radial': write it as"]),
        (
            DUTY + '\n[[duty]]\nname = "x"\nshare = 0.0\n' * 13,
            ["duty: has 16 points, more than 12; join or leave out some"],
        ),
        (DUTY.replace("=18000", "=2e9"), ["duty 'cruise': operation.inner_speed_rpm = 2000000000.0: must be at most"]),
    ],
)
def test_unit_bad_duties_are_refused(outer, tmp_path, text, faults):
    """Unit: each fault is a sentence that names the file and the point."""
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(InputError) as refused:
        map_duty(outer, tmp_path / "bad.toml", SPEEDS, LOADS)
    for fault in faults:
        assert any(fault in sentence and "bad.toml" in sentence for sentence in refused.value.faults), (
            refused.value.faults
        )


def test_unit_shares_are_normalised_on_request(outer, tmp_path):
    """Unit: with normalise_shares hours stand for shares, and the life is that of the shares."""
    (tmp_path / "shares.toml").write_text(DUTY)
    hours = DUTY
    for share in ("0.25", "0.7", "0.05"):
        hours = hours.replace(f"share = {share}\n", f"share = {float(share) * 2000.0}\n")
    (tmp_path / "hours.toml").write_text(f"normalise_shares = true\n{hours}")
    of_hours, of_shares = (map_duty(outer, tmp_path / f"{name}.toml", SPEEDS, LOADS) for name in ("hours", "shares"))
    assert of_hours.life.L10_h == pytest.approx(of_shares.life.L10_h)
    assert [point.share for point in read_duty(tmp_path / "hours.toml")] == [500.0, 1400.0, 100.0]
    assert [point.share for point in of_hours.points] == pytest.approx([0.25, 0.7, 0.05])


def test_command_map_refuses_a_bad_duty(command, tmp_path):
    """Command line: a duty that cannot be read ends the command with 2 and one sentence, before any run."""
    arguments = ("map", "examples/cylindrical_roller.toml", "--speed", "24000", "--load", "300")
    refused = command(*arguments, "--duty", str(tmp_path / "none.toml"))
    assert refused.returncode == 2 and refused.stderr.count("\n") == 1 and "no such file" in refused.stderr
