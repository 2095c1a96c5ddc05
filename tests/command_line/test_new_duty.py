"""``doe new --duty``: points of operation from a table of a person's own, and what is refused of it."""

import tomllib
from pathlib import Path

import pytest
from doe_command import doe

from doe.commands.new import duty_text
from doe.workflow.problem import Problem
from rbdyn.base.faults import InputError
from rbdyn.scene import Scene
from rbdyn.scene.duty import DutyPoint, duty_scenes, in_hours, read_duty, shares_of_time

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
KEYS = "operation.inner_speed_rpm,operation.radial_load_N,lubricant.temperature_C"
TABLE = f"name,share,{KEYS}\nidle,0.2,6000,150,\ncruise,0.75,20000,800,110.5\ntake-off,0.05,24000,1300,\n"
SETS = {
    "idle": ["operation.inner_speed_rpm=6000", "operation.radial_load_N=150"],
    "cruise": ["operation.inner_speed_rpm=20000", "operation.radial_load_N=800", "lubricant.temperature_C=110.5"],
    "take-off": ["operation.inner_speed_rpm=24000", "operation.radial_load_N=1300"],
}


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The example bearing."""
    return Scene.load(EXAMPLE)


def table(folder: Path, text: str) -> Path:
    """A file with this text."""
    path = folder / "duty.csv"
    path.write_text(text, encoding="utf-8")
    return path


def read_points(path: Path, scene: Scene) -> list[DutyPoint]:
    """Points of a file, checked in a scene."""
    points = read_duty(path)
    duty_scenes(scene, points, str(path))
    return points


def test_command_line_writes_the_duty(tmp_path):
    """Command line: a [[duty]] table a row, in its order; all else is the study without a duty, and the whole loads."""
    path = table(tmp_path, TABLE)
    ran = doe("new", str(EXAMPLE), "--duty", str(path))
    assert ran.returncode == 0, ran.stderr
    study = tomllib.loads(ran.stdout)
    duty = study.pop("duty")
    assert {point["name"]: point["set"] for point in duty} == SETS
    assert [point["share"] for point in duty] == [0.2, 0.75, 0.05]
    plain = doe("new", str(EXAMPLE)).stdout
    assert study == tomllib.loads(plain) and "[[duty]]" not in plain
    (tmp_path / "study.toml").write_text(ran.stdout, encoding="utf-8")
    assert [point.name for point in Problem.load(tmp_path / "study.toml").file.duty] == [*SETS]


def test_unit_a_european_table_means_the_same(scene, tmp_path):
    """Unit: semicolons and decimal commas give the points of commas and points; so do columns in another order."""
    points = read_points(table(tmp_path, TABLE), scene)
    european = TABLE.replace(",", ";").replace(".75", ",75").replace("0.", "0,").replace("110.5", "110,5")
    assert read_points(table(tmp_path, european), scene) == points
    turned = "\n".join(",".join(line.split(",")[::-1]) for line in TABLE.split()) + "\n"
    assert [(point.name, sorted(point.set)) for point in read_points(table(tmp_path, turned), scene)] == [
        (point.name, sorted(point.set)) for point in points
    ]


def test_unit_hours_stand_for_shares(scene, tmp_path):
    """Unit: a column of hours gives a duty in hours with the same shares, as TOML does; both in one table are refused."""
    points = read_points(table(tmp_path, TABLE), scene)
    shares = duty_text(points, False)
    hours = TABLE.replace("share", "hours").replace("0.2,", "400,").replace("0.75,", "1500,").replace("0.05,", "100,")
    timed = read_points(table(tmp_path, hours), scene)
    assert shares_of_time(timed) == shares_of_time(points) and in_hours(timed) and not in_hours(points)
    ran = doe("new", str(EXAMPLE), "--duty", str(tmp_path / "duty.csv"))
    study = tomllib.loads(ran.stdout)
    assert study["normalise_shares"] is True and [point["share"] for point in study["duty"]] == [400.0, 1500.0, 100.0]
    (tmp_path / "duty.toml").write_text(shares)
    assert duty_text(read_points(tmp_path / "duty.toml", scene), False) == shares
    with pytest.raises(InputError, match="columns share and hours: both state the time; keep one of them"):
        read_points(table(tmp_path, "name,share,hours\na,1,5\n"), scene)
    with pytest.raises(InputError, match="hours in row 1 = -5: is below 0; check the sign"):
        read_points(table(tmp_path, "name,hours\na,-5\n"), scene)


def test_unit_names_survive_the_template(scene, tmp_path):
    """Unit: braces, number signs and umlauts of a name come out of the study as they went in."""
    points = read_points(table(tmp_path, "name,share\n{start} # 1,0.5\nLäufer,0.5\n"), scene)
    assert [point["name"] for point in tomllib.loads(duty_text(points, False))["duty"]] == ["{start} # 1", "Läufer"]
    ran = doe("new", str(EXAMPLE), "--duty", str(tmp_path / "duty.csv"))
    assert [point["name"] for point in tomllib.loads(ran.stdout)["duty"]] == ["{start} # 1", "Läufer"]


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("share,x.y\n1,2\n", ["column name is missing; add it", "column x.y: unknown key"]),
        (TABLE.replace("share", "part"), ["column share or hours is missing", "column part: neither name, share, hours, from nor a key of a"]),
        (TABLE.replace("inner_speed", "iner_speed"), ["iner_speed_rpm: unknown key; did you mean operation.inner_speed_rpm?"]),
        (TABLE.replace("0.75", "often"), ["share in row 2 = 'often': is not a finite number"]),
        (TABLE.replace("0.75", "75"), ["share in row 2 = 75: is beyond 1; check the unit"]),
        (TABLE.replace("20000", "fast"), ["operation.inner_speed_rpm in row 2 = 'fast'"]),
        (TABLE.replace("idle", ""), ["row 1: name = ''"]),
        (TABLE.replace("20000", "2e9"), ["operation.inner_speed_rpm in row 2 = 2e9: is not a value of that key"]),
        (TABLE.replace("800", "9e6"), ["duty 'cruise': operation.radial_load_N = 9e+06: a roller of 9 mm would have"]),
        ("name,share\n", ["has a header and no rows"]),
    ],
)  # fmt: skip
def test_unit_bad_tables_are_refused(scene, tmp_path, text, faults):
    """Unit: each bad cell or column is a sentence that names the file, the row and the column."""
    with pytest.raises(InputError) as refused:
        read_points(table(tmp_path, text), scene)
    for fault in faults:
        assert any(fault in sentence and "duty.csv" in sentence for sentence in refused.value.faults), (
            refused.value.faults
        )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (TABLE.replace("0.75", "0.7"), "duty.share: sums to 0.95 over all points, not to 1"),
        ("name,share,cage.pocket_clearance_mm\na,1,0.3\n", "cage.pocket_clearance_mm"),
    ],
)
def test_command_line_a_duty_that_no_study_takes(tmp_path, text, fault):
    """Command line: faults of the duty as a whole end it with 2, as those of the written study would."""
    ran = doe("new", str(EXAMPLE), "--duty", str(table(tmp_path, text)))
    assert ran.returncode == 2 and fault in ran.stderr and ran.stdout == ""


@pytest.mark.slow
def test_command_line_the_written_study_runs(tmp_path):
    """Command line: the study as it is written, with short runs, ends with an answer at each of its points."""
    path = table(tmp_path, TABLE)
    text = doe("new", str(EXAMPLE), "--duty", str(path), "--limit", "cage_slip<=0.5").stdout
    text = text.replace("turns=40", "turns=3").replace("discard_turns=20", "discard_turns=1").replace("=8", "=2")
    text = text.replace('"numerics.companion=false"', '"numerics.companion=false", "numerics.extend=false"')
    text = text.replace("replicates = 16", "replicates = 2")
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    ran = doe("study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "study"))
    assert ran.returncode == 0, ran.stderr
    assert all(f"{name}: cage slip" in ran.stdout for name in SETS)
