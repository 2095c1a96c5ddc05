"""Scenes of ball bearings: every fault in a sentence, defaults, what the command prints and how it exits."""

import copy
import json
import math
from pathlib import Path

import pytest
from ball_scenes import DEEP, SMALL, changed, scene
from typer.testing import CliRunner

from rbdyn import BallScene, Scene, equilibrium
from rbdyn.base.faults import InputError
from rbdyn.cli.app import app
from rbdyn.quasistatic.row.ball import CommonCage, FixedShare, FrictionShare
from rbdyn.quasistatic.row.equilibrium import solve
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of
from rbdyn.scene import balls_only, rollers_only
from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene

EXAMPLES = Path(__file__).parents[2] / "examples"
BALLS, ROLLERS, DOUBLE = (
    EXAMPLES / f"{name}.toml" for name in ("angular_contact_ball", "cylindrical_roller", "double_decker")
)


def faults_of(table, **groups):
    """Faults of a table with changes."""
    with pytest.raises(InputError) as caught:
        BallScene.from_dict(changed(table, **groups), "b.toml")
    return caught.value.faults


BEARING_FAULTS = {
    "angle against clearance": (
        SMALL,
        {"radial_clearance_mm": 0.05},
        ("contact_angle_deg = 25", "radial_clearance_mm = 0.05", "contradict", "leave one out", "clearance_change_um"),
    ),
    "neither angle nor clearance": (SMALL, {"contact_angle_deg": None}, ("contact_angle_deg: missing", "give it or radial_clearance_mm")),
    "more clearance than the grooves hold": (
        DEEP, {"radial_clearance_mm": 1.1}, ("radial_clearance_mm = 1.1", "too large for grooves", "make it less than 1.016"),
    ),
    "balls do not fit": (SMALL, {"balls": 60}, ("balls = 60", "do not fit", "take fewer or smaller ones")),
    "a clearance as wide as the ball": (
        SMALL, {"contact_angle_deg": None, "radial_clearance_mm": 4.0}, ("radial_clearance_mm = 4", "make it less than 0.254"),
    ),
    "no inner ring": (SMALL, {"bore_mm": 44.0}, ("bore_mm = 44", "no inner ring", "43.12 mm", "make it smaller")),
    "no outer ring": (SMALL, {"outside_diameter_mm": 48.0}, ("outside_diameter_mm = 48", "no outer ring", "48.88 mm", "make it larger")),
    "a groove tighter than the ball": (SMALL, {"inner_groove_factor": 0.5}, ("inner_groove_factor = 0.5", "greater than 0.5")),
    "a groove wider than wide": (SMALL, {"outer_groove_factor": 1.5}, ("outer_groove_factor = 1.5", "at most 1")),
    "too few balls": (SMALL, {"balls": 2}, ("balls = 2", "at least 3")),
    "half a ball": (SMALL, {"balls": 29.5}, ("balls = 29.5", "whole number")),
    "contact angle of a thrust bearing": (SMALL, {"contact_angle_deg": 90.0}, ("contact_angle_deg = 90", "less than 90")),
    "more clearance than anyone makes": (DEEP, {"radial_clearance_mm": 9.0}, ("radial_clearance_mm = 9", "at most 5")),
    "no number": (SMALL, {"contact_angle_deg": math.nan}, ("contact_angle_deg = nan", "not a finite number")),
    "no capacity": (SMALL, {"dynamic_capacity_N": -1.0}, ("dynamic_capacity_N = -1", "greater than 0")),
    "a slip of the pen": (SMALL, {"ball_diametre_mm": 3.0}, ("bearing.ball_diametre_mm: unknown key", "ball_diameter_mm")),
}  # fmt: skip


@pytest.mark.parametrize("name", BEARING_FAULTS)
def test_unit_faults_of_a_bearing(name):
    """Unit: one fault, one sentence, with file, key, value and mend."""
    table, changes, words = BEARING_FAULTS[name]
    (fault,) = faults_of(table, bearing=changes)
    assert fault.startswith("b.toml: bearing.")
    for word in words:
        assert word in fault


OPERATION_FAULTS = {
    "load twice": ({"load_N": [1.0, 0.0, 0.0]}, ("operation.load_N and operation.radial_load_N", "give the first or the others")),
    "moment on a ring held straight": ({"moment_Nm": [0.0, 2.0]}, ("operation.moment_Nm = [0.0, 2.0]", "no effect", "operation.tilt = 'free'")),
    "preload twice": (
        {"axial_load_N": None, "preload_N": 50.0, "preload_um": 3.0},
        ("operation.preload_um = 3", "operation.preload_N = 50", "by displacement or by force"),
    ),
    "axial displacement twice": (
        {"axial_load_N": None, "preload_um": 3.0, "prescribed": {"z_mm": 0.01}},
        ("operation.preload_um = 3", "operation.prescribed.z_mm = 0.01", "leave one out"),
    ),
    "prescribed and loaded": (
        {"prescribed": {"x_mm": 0.01}}, ("operation.prescribed: the x displacement", "load of 200", "leave one out"),
    ),
    "prescribed and loaded by a moment": (
        {"tilt": "free", "moment_Nm": [3.0, 0.0], "prescribed": {"tilt_x_mrad": 0.5}},
        ("operation.prescribed: the tilt_x displacement", "load of 3", "leave one out"),
    ),
    "half a load": ({"radial_load_N": None, "axial_load_N": None, "load_N": [1.0, 2.0]}, ("operation.load_N", "3")),
    "no choice of tilt": ({"tilt": "loose"}, ("operation.tilt = 'loose'", "'free' or 'fixed'")),
    "prescribed out of all bounds": ({"radial_load_N": None, "prescribed": {"x_mm": 20.0}}, ("operation.prescribed.x_mm = 20", "at most 10")),
}  # fmt: skip


@pytest.mark.parametrize("name", OPERATION_FAULTS)
def test_unit_faults_of_the_operation(name):
    """Unit: what contradicts itself in load, preload, tilt and prescribed displacement is told in a sentence with its mend."""
    changes, words = OPERATION_FAULTS[name]
    (fault,) = faults_of(SMALL, operation=changes)
    assert fault.startswith("b.toml: operation.")
    for word in words:
        assert word in fault


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ({"model": {"raceway_control": "middle"}}, ("model.raceway_control = 'middle'", "'outer', 'inner', 'half', 'hybrid'")),
        ({"model": {"gyroscopic": "yes"}}, ("model.gyroscopic = 'yes'", "must be true or false, or choose one of 'unsigned'")),
        ({"model": {"light_load_share": 0.0}}, ("model.light_load_share = 0", "at least 0.001")),
        ({"model": {"friction_limit": 20.0}}, ("model.friction_limit = 20", "at most 10")),
        ({"model": {"solver": "guess"}}, ("model.solver = 'guess'", "'convex'")),
        ({"materials": {"ball": "chees"}}, ("materials.ball = 'chees'", "choose one of")),
        ({"model": {"ring_expansion": True}}, ("bearing.bore_mm: missing", "the rotating inner ring needs it", "model.ring_expansion = false")),
        ({"cage": {"mass_g": 3.0}}, ("cage: unknown key",)),
        ({"errors": {"ball_diameter_errors_um": [1.0]}}, ("errors.ball_diameter_errors_um", "1 value for 29 balls")),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)  # fmt: skip
def test_unit_faults_of_model_and_materials(groups, words):
    """Unit: names that are unknown, shares out of bounds and tables of other bearings are told."""
    (fault,) = faults_of(SMALL, **groups)
    assert fault.startswith("b.toml: ")
    for word in words:
        assert word in fault


def test_unit_all_faults_at_once():
    """Unit: faults of geometry, load and model come together, each once."""
    told = faults_of(
        SMALL,
        bearing={"balls": 60, "bore_mm": 44.0},
        operation={"load_N": [1.0, 0.0, 0.0], "preload_um": 1.0, "preload_N": 1.0},
        model={"solver": "guess"},
    )
    assert len(told) == len(set(told))
    for word in ("balls = 60", "bore_mm", "operation.load_N", "operation.preload_N", "model.solver"):
        assert sum(word in fault for fault in told) == 1


def test_unit_balls_larger_than_their_circle():
    """Unit: they neither fit side by side nor leave an inner raceway, and both is told."""
    told = faults_of(SMALL, bearing={"balls": 3, "ball_diameter_mm": 46.0})
    assert len(told) == 2 and "do not fit" in told[0]
    assert "ball_diameter_mm = 46" in told[1] and "leaves no inner raceway" in told[1]


def test_unit_faults_of_a_double_decker():
    """Unit: a fault in a row names its table; rows that do not nest, and form errors, are refused."""
    import tomllib

    table = tomllib.loads(DOUBLE.read_text(encoding="utf-8"))

    def told(change):
        data = copy.deepcopy(table)
        change(data)
        with pytest.raises(InputError) as caught:
            BallScene.from_dict(data, "d.toml")
        (fault,) = caught.value.faults
        return fault

    fault = told(lambda data: data["bearing"]["inner"].update(rollers=3))
    assert fault.startswith("d.toml: bearing.inner.rollers: unknown key; ") and "balls" in fault
    fault = told(lambda data: data["bearing"]["outer"].update(balls=400))
    assert "bearing.outer.balls = 400" in fault and "do not fit" in fault
    fault = told(lambda data: data["bearing"]["outer"].pop("pitch_diameter_mm"))
    assert fault == "d.toml: bearing.outer.pitch_diameter_mm: missing; add it"
    larger = 1.7 * table["bearing"]["inner"]["pitch_diameter_mm"]
    fault = told(lambda data: data["bearing"]["inner"].update(pitch_diameter_mm=larger))
    assert "bearing.outer.pitch_diameter_mm" in fault and "leaves no middle ring" in fault
    fault = told(lambda data: data.update(errors={}))
    assert fault == "d.toml: errors: runout is computed for a single row of balls only; remove the table"


def test_unit_defaults():
    """Unit: what a scene leaves out: outer raceway control with the sign of the gyroscopic moment, held tilt, rings at rest."""
    table = {"bearing": copy.deepcopy(SMALL["bearing"]), "operation": {"radial_load_N": 5.0}}
    plain = BallScene.from_dict(table)
    assert isinstance(plain, SingleRowScene)
    model, operation = plain.model, plain.operation
    assert (model.raceway_control, model.gyroscopic, model.ring_expansion) == ("outer", True, False)
    assert (model.light_load_share, model.friction_limit, model.solver) == (0.3, 0.3, "convex")
    assert (operation.inner_speed_rpm, operation.outer_speed_rpm) == (0.0, 0.0)
    assert operation.load == (5.0, 0.0, 0.0) and operation.moment == (0.0, 0.0)
    assert operation.displacements == (None, None, None, 0.0, 0.0)
    assert plain.material("ball") == plain.material("inner_ring") == plain.material("outer_ring")
    assert scene(SMALL, operation={"tilt": "free"}).operation.displacements == (None,) * 5
    assert scene(SMALL, operation={"axial_load_N": None, "preload_um": 4.0}).operation.displacements[
        2
    ] == pytest.approx(4e-6)
    assert scene(SMALL, operation={"preload_N": 30.0}).operation.load == (200.0, 0.0, 230.0)


def test_unit_contact_angle_and_clearance_follow_from_each_other():
    """Unit: cos a0 = 1 - P_d/(2 B); both may be given where they agree; interference stands at zero degrees."""
    row = scene(DEEP).bearing
    gap = 0.04 * 12.7
    assert row.groove_centre_distance_mm == pytest.approx(gap, rel=1e-14)
    assert row.contact_angle == pytest.approx(math.acos(1.0 - 0.015 / (2.0 * gap)), rel=1e-14)
    agreeing = scene(DEEP, bearing={"contact_angle_deg": round(math.degrees(row.contact_angle), 1)}).bearing
    assert agreeing.contact_angle == row.contact_angle
    tight = scene(DEEP, bearing={"radial_clearance_mm": -0.02, "clearance_change_um": 6.0}).bearing
    assert tight.contact_angle == 0.0 and tight.interference_m == pytest.approx(7e-6, rel=1e-14)
    # Drawn by its angle or by its clearance, a bearing is the same row.
    one = row_of(scene(DEEP)).row
    other = row_of(
        scene(DEEP, bearing={"radial_clearance_mm": None, "contact_angle_deg": math.degrees(row.contact_angle)})
    ).row
    for a, b in zip(one, other, strict=True):
        assert a == pytest.approx(b, rel=1e-12)


def test_unit_raceway_control_of_a_scene():
    """Unit: each name gives its law, without gyroscopic moment no inertia, and 'unsigned' turns the sign."""
    assert isinstance(row_of(scene(SMALL, model={"raceway_control": "common_cage"})).control, CommonCage)
    shares = {
        name: row_of(scene(SMALL, model={"raceway_control": name})).control for name in ("outer", "inner", "half")
    }
    assert {name: law.inner for name, law in shares.items()} == {"outer": 0.0, "inner": 1.0, "half": 0.5}
    assert all(isinstance(law, FixedShare) for law in shares.values())
    hybrid = row_of(scene(SMALL, model={"raceway_control": "hybrid"})).control
    assert isinstance(hybrid, FrictionShare) and 0.5 < hybrid.inner_weight < 2.0
    assert shares["outer"].spinning.turning == -1.0 and shares["outer"].spinning.inertia > 0.0
    assert row_of(scene(SMALL, model={"gyroscopic": "unsigned"})).control.spinning.turning == 1.0
    assert row_of(scene(SMALL, model={"gyroscopic": False})).control.spinning.inertia == 0.0


def test_unit_a_file_tells_what_bearing_it_is():
    """Unit: ``Scene.load`` gives each kind its class; who needs the other kind says so with the command that has it."""
    balls, double, rollers = Scene.load(BALLS), Scene.load(DOUBLE), Scene.load(ROLLERS)
    assert isinstance(balls, SingleRowScene) and isinstance(double, DoubleDeckerScene)
    assert type(rollers) is Scene
    assert balls_only(balls) is balls and rollers_only(rollers) is rollers
    with pytest.raises(InputError, match="use rbdyn ball"):
        rollers_only(balls)
    with pytest.raises(InputError, match="use rbdyn simulate"):
        balls_only(rollers)
    with pytest.raises(InputError, match="use rbdyn simulate"):
        equilibrium(rollers)


def test_command_line_the_wrong_kind_of_bearing():
    """Command line: ``simulate`` of balls and ``ball`` of rollers exit with 2 and name the other command, with --json in one object too."""
    for command, file, word in (("simulate", BALLS, "use rbdyn ball"), ("ball", ROLLERS, "use rbdyn simulate")):
        told = CliRunner().invoke(app, [command, str(file), "--json"])
        assert told.exit_code == 2 and word in told.stderr and "Traceback" not in told.output
        assert any(word in fault for fault in json.loads(told.stdout)["faults"])
    told = CliRunner().invoke(app, ["ball", str(BALLS), "--set", "bearing.balls=60", "--set", "model.solver=guess"])
    assert told.exit_code == 2 and "balls = 60" in told.output and "model.solver" in told.output


def test_command_line_json_keys_of_a_ball_bearing():
    """Command line: the JSON of ``rbdyn ball`` has the documented keys, one record a ball, in the documented units."""
    told = CliRunner().invoke(app, ["ball", str(BALLS), "--json"])
    assert told.exit_code == 0
    record = json.loads(told.stdout)
    assert record["status"] == "ok" and record["format"].startswith("rbdyn.ball/")
    assert set(record["displacement_mm"]) == {"x", "y", "z"} and set(record["tilt_mrad"]) == {"x", "y"}
    assert set(record["max_stress_MPa"]) == {"inner", "outer"}
    assert {"x_N_per_um", "y_N_per_um", "z_N_per_um"} <= set(record["stiffness"])
    assert {"L10_Mrev", "L10_h", "method"} <= set(record["life"])
    assert record["cost"]["solve_us"] > 0.0 and record["iterations"] > 0
    assert record["residual_N"] < 1e-9 * 200.0
    case = BallScene.load(BALLS)
    parts = row_of(case)
    found = solve(parts.row, parts.control, load_of(case), constraint_of(case))
    assert len(record["balls"]) == case.bearing.balls
    for j, ball in enumerate(record["balls"]):
        assert ball["azimuth_deg"] == pytest.approx(360.0 * j / 29)
        assert ball["inner_angle_deg"] == pytest.approx(math.degrees(found.inner_angle[j]))
        assert ball["outer_angle_deg"] == pytest.approx(math.degrees(found.outer_angle[j]))
        assert ball["inner_load_N"] == pytest.approx(found.inner_load[j])
        assert ball["outer_load_N"] == pytest.approx(found.outer_load[j])
        assert ball["centrifugal_force_N"] == pytest.approx(found.centrifugal_force[j])
        assert ball["gyroscopic_moment_Nmm"] == pytest.approx(1e3 * found.gyroscopic_moment[j])
    assert record["displacement_mm"]["z"] == pytest.approx(1e3 * found.displacement[2])
    assert record["stiffness"]["x_N_per_um"] == pytest.approx(1e-6 * found.stiffness[0, 0])


def test_command_line_a_run_without_equilibrium_exits_with_1(tmp_path):
    """Command line: where balls have several orbits at one load none may be found: exit 1, and the result tells why."""
    file = tmp_path / "lost.toml"
    file.write_text(BALLS.read_text(encoding="utf-8"), encoding="utf-8")
    settings = (
        "bearing.balls=16", "bearing.ball_diameter_mm=22.225", "bearing.pitch_diameter_mm=125.26",
        "bearing.contact_angle_deg=40.0", "bearing.inner_groove_factor=0.5232", "bearing.outer_groove_factor=0.5232",
        "operation.radial_load_N=0.0", "operation.axial_load_N=100.0", "operation.tilt=free",
        "model.raceway_control=inner", "model.light_load_share=0.001",
    )  # fmt: skip
    options = [part for setting in settings for part in ("--set", setting)]
    told = CliRunner().invoke(app, ["ball", str(file), "--json", *options])
    assert told.exit_code == 1
    status = json.loads(told.stdout)["status"]
    assert "no equilibrium was found" in status and "model.light_load_share" in status
    mended = CliRunner().invoke(app, ["ball", str(file), "--json", *options[:-2]])
    assert mended.exit_code == 0 and json.loads(mended.stdout)["status"] == "ok"


UNLOADED = ("operation.radial_load_N=0.0", "operation.axial_load_N=0.0")


def test_unit_balls_without_a_load_touch_nothing():
    """Unit: loads left over from rounding are no contact; the result says that nothing tells where the ring is."""
    idle = BallScene.load(EXAMPLES / "angular_contact_ball.toml", UNLOADED)
    assert any("no ball touches the inner raceway" in note for note in equilibrium(idle).notes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"bearing.contact_angle_deg": 0.698}, "bearing.contact_angle_deg = 0.698: is outside the usual 2 to 75; if 0.698 rad are meant, write 39.99"),
        ({"lubricant.temperature_C": 343.15}, "lubricant.temperature_C = 343.15: is outside the usual -60 to 220; if 343.15 K are meant, write 70"),
        ({"bearing.contact_angle_deg": None, "bearing.radial_clearance_mm": 0.9}, "bearing.radial_clearance_mm = 0.9: is outside the usual"),
    ],
)  # fmt: skip
def test_unit_a_probable_slip_of_the_unit_is_a_note(changes, words):
    """Unit: values of a ball bearing that look like another unit, with the probable one; usual values have no note."""
    row = {"kind": "angular_contact_ball", "balls": 13, "ball_diameter_mm": 12.7, "pitch_diameter_mm": 60.0}
    grooves = {"inner_groove_factor": 0.52, "outer_groove_factor": 0.53, "contact_angle_deg": 40.0}
    oil = {"oil": "ISO VG 68", "temperature_C": 70.0}
    usual = BallScene.from_dict(
        {"bearing": {**row, **grooves}, "operation": {"axial_load_N": 3000.0}, "lubricant": oil}
    )
    assert usual.unit_notes == ()
    notes = equilibrium(usual.changed(changes)).notes
    assert any(note.code == "unit" and note.startswith(words) for note in notes)
