"""Points of a duty that begin from a cold machine or from another point."""

import tomllib

import pytest
from conftest import ROOT
from in_process import in_process

from doe.duty import Duty, over_points
from rbdyn import Scene, simulate
from rbdyn.base.faults import InputError
from rbdyn.dynamics.duty_simulation import DutySimulation, simulate_duty
from rbdyn.scene.duty import duty_scenes, read_duty, starting
from rbdyn.scene.thermal import point_before

# Simulations of the heat alone: runs five times as long move no clearance by more than 0.03 um.
QUICK = {
    "turns": 2.0, "discard_turns": 1.0, "impact_window_turns": 1.0, "replicates": 2, "extend": False,
    "companion": False,
}  # fmt: skip


@pytest.fixture(scope="module")
def scene():
    words = ("NU308", "--speed", "4000", "--load", "4000", "--oil", "ISO VG 68", "--ambient", "20")
    return Scene.from_dict(tomllib.loads(in_process("rbdyn", "new", *words).stdout) | {"numerics": QUICK})


def duty(folder, text):
    path = folder / "duty.csv"
    path.write_text("name,share,from,operation.inner_speed_rpm\n" + text, "utf-8")
    return path


@pytest.fixture(scope="module")
def found(scene, tmp_path_factory):
    """Points that start from an equal one, not, cold, and from each other."""
    text = "same,0.2,rated,4000\nslow,0.2,,2000\nrated,0.2,ambient,4000\nfast,0.2,idle,4000\nidle,0.2,fast,2000\n"
    return simulate_duty(scene, duty(tmp_path_factory.mktemp("duty"), text), workers=2, notice=None)


def test_starts_of_points(scene, found):
    """From an equal point nothing moves; from ambient as by [thermal.start]; from a slower point less clearance is lost than cold;
    from a faster one, which cools, the rings come nearer, and nothing is lost."""
    points = {point.name: point for point in found.points}
    assert found.status == "ok" and list(points) == ["same", "slow", "rated", "fast", "idle"]
    assert [point.start and point.start.origin for point in found.points] == ["rated", None, "ambient", "idle", "fast"]
    steady = points["rated"].figures["radial_operating_clearance_um"].value
    same, rated, fast, idle = (points[name].start for name in ("same", "rated", "fast", "idle"))
    assert same.radial_um.least.value == pytest.approx(steady, abs=0.5) and same.time_to_steady_s < 100.0
    alone = simulate(starting(scene.overridden(["operation.inner_speed_rpm=4000"])), workers=2, notice=None)
    assert (
        rated.radial_um.least == alone.start.radial_um.least and rated.time_to_steady_s == alone.start.time_to_steady_s
    )
    assert rated.radial_um.least.value + 2.0 < fast.radial_um.least.value < steady - 0.5
    # Short runs gave the temperatures of the fast point.
    assert idle.radial_um.least.value > steady - 1.0
    again = DutySimulation.from_dict(found.as_dict())
    assert again.points == found.points and found.as_dict()["points"][0]["start"]["from"] == "rated"
    assert found.table()["start_from"][2] == "ambient"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a,1,b,4000\n", "duty.from = 'b' of a: no such point; choose 'ambient' or one of a"),
        ("a,1,a,4000\n", "from = 'a': is the point itself"),
    ],
)
def test_faults_of_a_table(tmp_path, text, says):
    with pytest.raises(InputError) as refused:
        read_duty(duty(tmp_path, text))
    assert says in refused.value.faults[0]


def test_a_start_needs_a_heat_balance(tmp_path):
    """A scene without [thermal] is refused before anything runs, as are both kinds of temperatures at once."""
    points = read_duty(duty(tmp_path, "a,1,ambient,4000\n"))
    with pytest.raises(InputError, match=r"duty 'a': duty.from: a start needs a heat balance; add \[thermal\]"):
        duty_scenes(Scene.load(ROOT / "examples" / "cylindrical_roller.toml"), points, "duty")


def test_points_of_a_study_start_as_stated(scene, tmp_path):
    """A study gives each point the start that its duty states: from ambient, or with the keys of the other point, as stated there."""
    points = {"idle": ["operation.inner_speed_rpm=1500"], "full": ["operation.radial_load_N=5000"]}
    duty = Duty(dict.fromkeys(points, 0.5), points, {}, origins={"idle": "ambient", "full": "idle"})
    (run,) = over_points(duty, lambda overrides: [scene.overridden(overrides)])
    idle, full = (run.scenes[name].thermal.start for name in points)
    assert idle.from_point is None and idle.from_C is None
    assert full.from_point == {"operation.inner_speed_rpm": 1500.0, "operation.radial_load_N": 4000.0}
    before = point_before(run.scenes["full"])
    assert before == scene.overridden(points["idle"]) and point_before(run.scenes["idle"]) is None
    faulty = scene.changed({"thermal.start": {"from_point": {"operation.speed": 3.0}}})
    with pytest.raises(InputError, match=r"thermal.start.from_point: .*operation.speed"):
        simulate(faulty, notice=None)


def test_start_from_another_point_has_its_temperatures(scene):
    """The first row of a start from another operating point has the steady temperatures of that point, as a start from its parts."""
    slow = {"operation.inner_speed_rpm": 2000.0}
    found = simulate(scene.changed({"thermal.start": {"from_point": slow}}), workers=2, notice=None)
    first = [column[0] for column in found.start.path.temperatures_C.values()]
    steady = simulate(scene.changed(slow), workers=2, notice=None).temperatures_C
    assert first[:4] == pytest.approx([steady[node].value for node in ("oil", "outer", "inner", "rollers")], abs=0.5)
    parts = simulate(scene.changed({"thermal.start": {"from_parts_C": first}}), workers=2, notice=None).start
    assert parts.radial_um.least.value == pytest.approx(found.start.radial_um.least.value, abs=0.05)


def test_both_temperatures_contradict(scene):
    both = {"thermal.start": {"from_C": 20.0, "from_parts_C": [50.0] * 6}}
    with pytest.raises(InputError, match="both state the temperatures at the start"):
        scene.changed(both)
    with pytest.raises(InputError, match="from_parts_C, oil = 300"):
        scene.changed({"thermal.start.from_parts_C": [300.0, *[50.0] * 5]})
