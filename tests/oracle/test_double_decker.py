"""Double-decker ball bearing: all coupled equations, limits, published conditions, prescribed displacements, input."""

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from double_decker_twin import drawings, residuals
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn import BallScene, equilibrium
from rbdyn.base.faults import RPM, InputError
from rbdyn.properties.materials import MATERIALS
from rbdyn.quasistatic import double_decker
from rbdyn.quasistatic.double_decker import (
    Layer,
    double_decker_of,
    load_on_middle_ring,
    solve_double_decker,
    static_capacity,
)
from rbdyn.quasistatic.row.ball import ball_forces
from rbdyn.quasistatic.row.equilibrium import solve
from rbdyn.quasistatic.row.model import constraint_of, contacts, load_of
from rbdyn.scene.ball import BallRow

FILE = Path(__file__).parents[2] / "examples" / "double_decker.toml"
FREE = np.full(5, np.nan)
SQUARE = np.array([np.nan, np.nan, np.nan, 0.0, 0.0])


def scene_of(*overrides):
    """The example with changes."""
    return BallScene.load(FILE, overrides)


def solved(scene):
    """Model and solution of a scene."""
    model = double_decker_of(scene)
    return model, solve_double_decker(model.stack, load_of(scene), constraint_of(scene), model.middle_constraint)


@pytest.mark.parametrize("control", ["outer", "inner", "half", "common_cage"])
@pytest.mark.parametrize(
    "overrides",
    [
        ("operation.inner_speed_rpm=40000.0",),
        ("operation.tilt='free'", "operation.inner_speed_rpm=30000.0", "bearing.middle.axial_offset_mm=2.5"),
        (
            "operation.tilt='free'", "operation.inner_speed_rpm=40000.0", "materials.rings='silicon_nitride'",
            "operation.moment_Nm=[0.1,-0.05]", "materials.ball='silicon_nitride'",
        ),
    ],
    ids=["square", "offset", "tilted ceramic"],
)  # fmt: skip
def test_oracle_all_coupled_equations_vanish(control, overrides):
    """Oracle: at the result, every equation of balls, inner ring and middle ring written out from the drawing is met."""
    scene = scene_of(*overrides, f"model.raceway_control='{control}'")
    _, found = solved(scene)
    assert found.is_equilibrium
    offset = 1e-3 * scene.bearing.middle.axial_offset_mm
    of_inner, of_outer, inner_ring, middle_ring = residuals(
        *drawings(scene), offset, found.displacement, found.middle_displacement, found.inner.balls,
        found.outer.balls, load_of(scene),
    )  # fmt: skip
    assert np.abs(of_inner).max() < 1e-8 and np.abs(of_outer).max() < 1e-8
    free = 3 if scene.operation.tilt == "fixed" else 5
    assert np.abs(inner_ring[:free]).max() < 1e-8 and np.abs(middle_ring[:free]).max() < 1e-8
    # The equations feel a nanometre.
    away = found.middle_displacement + np.array([1e-9, 0, 0, 0, 0])
    moved = residuals(
        *drawings(scene), offset, found.displacement, away, found.inner.balls, found.outer.balls,
        load_of(scene),
    )  # fmt: skip
    assert np.abs(moved[0]).max() > 1e-3 and np.abs(moved[3]).max() > 1e-2


@pytest.mark.parametrize("axial", [200.0, 400.0, 600.0])
@pytest.mark.parametrize("speed", [10000.0, 20000.0, 30000.0, 40000.0])
def test_literature_all_conditions_of_table_4_solve(axial, speed):
    """Literature: the twelve conditions of Hu et al., Table 4, square and tilting; angles at the inner races rise."""
    change = (f"operation.axial_load_N={axial}", f"operation.inner_speed_rpm={speed}")
    for tilt in ("fixed", "free"):
        scene = scene_of(*change, f"operation.tilt='{tilt}'")
        _, found = solved(scene)
        assert found.is_equilibrium and found.steps == 0
        places = found.displacement, found.middle_displacement, found.inner.balls, found.outer.balls
        balls, more_balls, inner_ring, middle_ring = residuals(*drawings(scene), 0.0, *places, load_of(scene))
        free = 3 if tilt == "fixed" else 5
        for left in (balls, more_balls, inner_ring[:free], middle_ring[:free]):
            assert np.abs(left).max() < 1e-8
        for row in (found.inner, found.outer):
            assert (row.inner_angle > row.outer_angle).all()
    # "The influence of the centrifugal force of the external layer is less": by the ninth power of the pitch ratio and more.
    spread = [np.ptp([row.inner_angle.mean(), row.outer_angle.mean()]) for row in (found.inner, found.outer)]
    assert spread[1] < 0.1 * spread[0]


@pytest.mark.parametrize("control", ["outer", "common_cage"])
@pytest.mark.parametrize("tilt", ["fixed", "free"])
def test_oracle_stiffness_is_that_of_both_rows_in_series(control, tilt):
    """Oracle: the stiffness inverts how the displacement follows the load, by central differences."""
    scene = scene_of(
        f"model.raceway_control='{control}'", f"operation.tilt='{tilt}'", "operation.inner_speed_rpm=30000.0"
    )
    model, found = solved(scene)
    free = 3 if tilt == "fixed" else 5
    matrix = np.zeros((free, free))
    for k in range(free):
        step = np.zeros(5)
        step[k] = 0.05 if k < 3 else 5e-5
        ends = [
            solve_double_decker(
                model.stack, load_of(scene) + side * step, constraint_of(scene), model.middle_constraint, found
            )
            for side in (1.0, -1.0)
        ]
        matrix[:, k] = (ends[0].displacement - ends[1].displacement)[:free] / (2.0 * step[k])
    product = found.stiffness[:free, :free] @ matrix
    scale = np.sqrt(np.diag(found.stiffness)[:free])
    assert product * scale[None, :] / scale[:, None] == pytest.approx(np.eye(free), abs=2e-5)


def test_limit_compliances_add():
    """Limit: under thrust alone each row yields along z as if alone, and the whole by their sum."""
    _, found = solved(scene_of("operation.radial_load_N=0.0"))
    alone = 1.0 / found.inner.stiffness[2, 2] + 1.0 / found.outer.stiffness[2, 2]
    # The only difference: centrifugal and gyroscopic forces that the ring between feels.
    assert 1.0 / found.stiffness[2, 2] == pytest.approx(alone, rel=1e-6)


def test_limit_of_a_rigid_outer_row():
    """Limit: with outer contacts 1e5 times as stiff, 1/2154 as deep, the bearing is its inner row alone.

    Held square: rigid balls would still let the middle ring turn about the apex of its cone of contact.
    """
    scene = scene_of()
    model = double_decker_of(scene)
    row, control = model.stack.outer
    stiff = row._replace(
        inner_stiffness=1e5 * row.inner_stiffness,
        outer_stiffness=1e5 * row.outer_stiffness,
        rest_deflection=row.rest_deflection / 1e5 ** (2.0 / 3.0),
    )
    found = solve_double_decker(model.stack._replace(outer=Layer(stiff, control)), load_of(scene), SQUARE, SQUARE)
    alone = solve(*model.stack.inner, load_of(scene), SQUARE)
    assert found.is_equilibrium
    assert found.displacement[:3] == pytest.approx(alone.displacement[:3], rel=2e-3, abs=1e-12)
    assert found.stiffness[2, 2] == pytest.approx(alone.stiffness[2, 2], rel=2e-3)


@pytest.mark.parametrize("control", ["outer", "common_cage"])
def test_invariant_middle_ring_hands_the_load_on(control):
    """Invariant: what reaches the middle ring is the load, but for centrifugal forces that do not cancel."""
    scene = scene_of(
        "operation.tilt='free'", "operation.inner_speed_rpm=40000.0", f"model.raceway_control='{control}'",
        "operation.moment_Nm=[0.05,0.1]",
    )  # fmt: skip
    model, found = solved(scene)
    row, pull = model.stack.inner.row, found.inner.centrifugal_force
    left = np.array([pull @ row.cosine, pull @ row.sine, 0.0])
    assert found.middle_load[:3] == pytest.approx(load_of(scene)[:3] + left, abs=1e-7)
    if control == "common_cage":
        assert np.abs(left).max() < 1e-10
    # Moments carried from plane to plane differ only by the turn of the lines of contact, B over the pitch radius.
    carried = load_of(scene)[3:] + model.stack.arm_0 * np.array([-load_of(scene)[1], load_of(scene)[0]])
    assert found.middle_load[3:] == pytest.approx(carried, abs=2e-2 * 200.0 * 9e-3)
    assert found.outer.reaction == pytest.approx(found.middle_load, abs=1e-7)


@given(
    load=st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0), st.floats(150.0, 900.0)),
    mask=st.lists(st.booleans(), min_size=5, max_size=5).filter(any),
    tilts=st.sampled_from(["free", "fixed"]),
    control=st.sampled_from(["outer", "common_cage"]),
    speed=st.floats(0.0, 40000.0),
)
@settings(max_examples=40, deadline=None)
def test_invariant_prescribed_displacements_give_the_load_back(load, mask, tilts, control, speed):
    """Invariant: prescribing any part of an equilibrium's displacement finds the same equilibrium, from afar."""
    scene = scene_of(f"model.raceway_control='{control}'", f"operation.inner_speed_rpm={speed}")
    model = double_decker_of(scene)
    force = np.array([*load, 0.0, 0.0])
    middle = FREE if tilts == "free" else SQUARE
    first = solve_double_decker(model.stack, force, middle, middle)
    assert first.is_equilibrium
    told = np.where(np.array(mask) | ~np.isnan(middle), first.displacement, np.nan)
    again = solve_double_decker(model.stack, np.where(np.isnan(told), force, 0.0), told, middle)
    assert again.is_equilibrium
    assert again.reaction[:3] == pytest.approx(force[:3], abs=1e-5)
    assert again.displacement == pytest.approx(first.displacement, abs=1e-11)


def test_unit_square_inner_ring_over_a_tilting_middle_ring():
    """Unit: the inner ring held square, the middle ring tilts until no moment is left on it."""
    scene = scene_of("bearing.middle.tilt='free'", "operation.inner_speed_rpm=20000.0")
    _, found = solved(scene)
    assert found.is_equilibrium and found.steps > 0
    assert np.abs(found.displacement[3:]).max() < 1e-15 < np.abs(found.middle_displacement[3:]).max()
    assert found.outer.reaction == pytest.approx(found.middle_load, abs=1e-7)
    stiffer = solved(scene_of("operation.inner_speed_rpm=20000.0"))[1]
    assert found.stiffness[0, 0] < stiffer.stiffness[0, 0]


def test_unit_no_equilibrium_is_told(monkeypatch):
    """Unit: where Newton on the middle ring may not go on, the status says so and nothing is raised."""
    monkeypatch.setattr(double_decker, "STEPS", 0)
    result = equilibrium(scene_of("operation.axial_load_N=0.0", "operation.prescribed.z_mm=0.02"))
    assert not result.is_equilibrium and result.status == double_decker.LOST
    assert "inner" not in result.as_dict()


@pytest.mark.parametrize(
    "overrides",
    [
        ("operation.axial_load_N=-500.0",),
        ("operation.axial_load_N=0.0", "operation.radial_load_N=0.0"),
        ("operation.axial_load_N=0.0", "operation.radial_load_N=0.0", "operation.inner_speed_rpm=0.0"),
        ("operation.axial_load_N=0.0", "operation.prescribed.z_mm=0.0", "operation.tilt='free'"),
        ("operation.axial_load_N=0.0", "operation.prescribed.z_mm=-0.02"),
        ("operation.axial_load_N=5.0", "operation.inner_speed_rpm=200000.0", "model.raceway_control='inner'"),
        ("operation.tilt='free'", "operation.axial_load_N=20.0", "operation.moment_Nm=[5.0,0.0]"),
    ],
)
def test_extreme_scenes_solve(overrides):
    """Extreme: reversed, absent and overturning loads, a middle ring that hangs loose, ten times the speed."""
    scene = scene_of(*overrides)
    _, found = solved(scene)
    assert found.is_equilibrium
    assert found.middle_load[:3] == pytest.approx(found.outer.reaction[:3], abs=1e-6)
    free = np.isnan(constraint_of(scene))
    assert found.reaction[free] == pytest.approx(load_of(scene)[free], abs=1e-6)


def test_extreme_speed_of_a_row_is_a_danger():
    """Extreme: each row has its own speed between its rings. 3 million mm/min is that of the fastest tests of special bearings."""
    share = 1.0 - 1.0 / (1.0 + (33.5 / 18.0) ** 4.5)
    for million, dangers in ((2.9, 0), (3.1, 1)):
        rpm = 1e6 * million / 18.0 / share
        codes = [(note.code, str(note)[:9]) for note in equilibrium(scene_of(f"operation.inner_speed_rpm={rpm}")).notes]
        assert codes.count(("overspeed", "inner row")) == dangers and ("overspeed", "outer row") not in codes


def test_unit_a_start_nearby_saves_steps():
    """Unit: a result nearby as a start leads to the same place with fewer steps."""
    cold = equilibrium(scene_of("operation.inner_speed_rpm=20100.0"))
    warm = equilibrium(
        scene_of("operation.inner_speed_rpm=20100.0"), equilibrium(scene_of("operation.inner_speed_rpm=20000.0"))
    )
    assert warm.displacement == pytest.approx(cold.displacement, abs=1e-13)
    assert warm.as_dict()["iterations"] < cold.as_dict()["iterations"]


def test_unit_record_has_both_layers_and_the_middle_ring():
    """Unit: keys and units of the record; the speed of the middle ring by eq 13; whole JSON."""
    record = json.loads(json.dumps(equilibrium(scene_of()).as_dict()))
    for name, balls in (("inner", 17), ("outer", 21)):
        assert len(record[name]["balls"]) == balls
        assert record[name]["max_stress_MPa"]["inner"] > 500.0
    middle = record["middle_ring"]
    assert middle["speed_rpm"] == pytest.approx(10000.0 * 18.0**4.5 / (18.0**4.5 + 33.5**4.5))
    place = record["displacement_mm"]["z"]
    assert place == pytest.approx(record["inner"]["displacement_mm"]["z"] + middle["displacement_mm"]["z"])
    assert record["reaction"]["load_N"]["z"] == pytest.approx(200.0)
    assert record["ring_growth_um"]["inner_less_middle_bore"] == pytest.approx(0.0122, abs=1e-4)


def test_unit_speed_of_the_middle_ring():
    """Unit: given, or by torques of oil and load, with the capacity of ISO 76 where the catalogue gives none."""
    assert double_decker_of(scene_of("bearing.middle.speed_rpm=-300.0")).split.speed == -300.0 * RPM
    oil = ("lubricant.oil='MIL-L-23699'", "lubricant.temperature_C=60.0")
    scene = scene_of("bearing.middle.speed_split='torque_balance'", *oil)
    split = double_decker_of(scene).split
    record = equilibrium(scene).as_dict()["middle_ring"]
    assert record["speed_status"] == split.status == "shared"
    assert record["speed_share"] < 0.0576 and record["friction_torque_Nmm"] > 0.0
    heavier = scene_of("bearing.middle.speed_split='torque_balance'", "operation.axial_load_N=600.0", *oil)
    assert double_decker_of(heavier).split.status == "outer layer stands"


@pytest.mark.parametrize(("gamma", "factor"), [(0.01, 14.9), (0.05, 15.7), (0.09, 16.5), (0.12, 15.9), (0.2, 14.0)])
def test_literature_static_capacity(gamma, factor):
    """Literature: C0 = f0 Z D^2 cos a_0 with f0 of ISO 76 as commonly tabulated, to 1.5 %: both races in their turn."""
    table = {"balls": 10, "ball_diameter_mm": 8.0, "inner_groove_factor": 0.52, "outer_groove_factor": 0.53}
    angle = math.radians(15.0)
    row = BallRow(**table, pitch_diameter_mm=8.0 * math.cos(angle) / gamma, contact_angle_deg=15.0)
    steel = MATERIALS["bearing_steel"]
    races = contacts(row, steel, steel, steel)
    assert static_capacity(row, races) == pytest.approx(factor * 10 * 8.0**2 * math.cos(angle), rel=0.015)
    assert static_capacity(row.model_copy(update={"static_capacity_N": 5000.0}), races) == 5000.0


@pytest.mark.parametrize("control", ["outer", "hybrid"])
def test_oracle_load_on_middle_ring_by_the_balance_of_each_ball(control):
    """Oracle: wherever the balls stand, the middle ring feels what the inner ring gives, less what is left on each ball."""
    model = double_decker_of(scene_of(f"model.raceway_control='{control}'", "operation.inner_speed_rpm=40000.0"))
    _, found = solved(scene_of("operation.inner_speed_rpm=40000.0", "model.raceway_control='common_cage'"))
    row, rule = model.stack.inner
    forces, moments, expected = [], [], np.zeros(3)
    for j, ((x, y), depths) in enumerate(zip(found.inner.balls, found.inner.depths, strict=True)):
        c, s = row.cosine[j], row.sine[j]
        place = (
            row.axial[j] + found.inner.displacement[2],
            row.radial[j] + found.inner.displacement[0] * c + found.inner.displacement[1] * s,
        )
        residual, ring, *_, pull, moment = ball_forces.bodies[type(rule)](rule, 1.0, row, *place, x, y, *depths)
        radial = ring[1] + pull - residual[1]
        expected += [radial * c, radial * s, ring[0] - residual[0]]
        forces.append(pull)
        moments.append(moment)
    there = found.inner._replace(centrifugal_force=np.array(forces), gyroscopic_moment=np.array(moments))
    assert load_on_middle_ring(model.stack, there)[:3] == pytest.approx(expected, abs=1e-9)
    still = there._replace(gyroscopic_moment=np.zeros_like(moments))
    assert abs(load_on_middle_ring(model.stack, still)[2] - expected[2]) > 0.1


def test_unit_bad_double_deckers_are_refused():
    """Unit: one sentence with key, value and mend for each fault."""

    def faults(*overrides):
        with pytest.raises(InputError) as caught:
            scene_of(*overrides)
        return caught.value.faults

    (nested,) = faults("bearing.outer.pitch_diameter_mm=25.0", "bearing.outer.balls=12", "bearing.outer.bore_mm=9.0")
    assert "bearing.outer.pitch_diameter_mm = 25" in nested and "larger" in nested
    (dry,) = faults("bearing.middle.speed_split='torque_balance'")
    assert "lubricant: missing" in dry
    (word,) = faults("bearing.middle.speed_split='even'")
    assert "bearing.middle.speed_split" in word
    text = FILE.read_text().replace("bore_mm = 12.0\n", "").replace("outside_diameter_mm = 42.0\n", "")
    data = tomllib.loads(text)
    data["operation"]["outer_speed_rpm"] = 100.0
    with pytest.raises(InputError) as caught:
        BallScene.from_dict(data)
    bore, outside = caught.value.faults
    assert "bearing.inner.bore_mm: missing" in bore and "bearing.outer.outside_diameter_mm: missing" in outside


def test_limit_still_bearing_has_no_growth_and_no_middle_speed():
    """Limit: at rest nothing grows and nothing turns; both rings at one speed carry the middle ring along."""
    model = double_decker_of(scene_of("operation.inner_speed_rpm=0.0"))
    assert model.changes == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) and model.split.speed == 0.0
    together = double_decker_of(scene_of("operation.outer_speed_rpm=10000.0"))
    assert together.split.speed == pytest.approx(10000.0 * math.pi / 30.0)


def test_unit_command_prints_both_rows(tmp_path):
    """Unit: rbdyn ball prints rows and middle ring, writes a table of all balls, and gives one JSON object."""
    from typer.testing import CliRunner

    from rbdyn.cli.app import app

    printed = CliRunner().invoke(app, ["ball", str(FILE), "--out", str(tmp_path)])
    assert printed.exit_code == 0
    for words in ("inner row", "outer row", "middle ring: 575.8 rpm", "both rows: x 2.997 µm"):
        assert words in printed.stdout
    assert len((tmp_path / "balls.csv").read_text().splitlines()) == 1 + 17 + 21
    as_json = CliRunner().invoke(app, ["ball", str(FILE), "--json", "--set", "operation.tilt=free"])
    assert {"inner", "outer", "middle_ring", "stiffness"} <= set(json.loads(as_json.stdout))
