"""Contact ellipses that climb over the shoulder of a groove, by the closed form of a ball row at rest under thrust."""

import math

import numpy as np
import pytest

from rbdyn.base.faults import InputError
from rbdyn.base.terminal import text
from rbdyn.cli.ball_studies import equilibrium_blocks
from rbdyn.quasistatic.bearing import equilibrium, row_of
from rbdyn.quasistatic.sweep import sweep
from rbdyn.scene import BallScene, Scene

BEARING = {
    "kind": "angular_contact_ball", "balls": 14, "ball_diameter_mm": 12.0, "pitch_diameter_mm": 60.0,
    "contact_angle_deg": 40.0, "inner_groove_factor": 0.52, "outer_groove_factor": 0.53,
}  # fmt: skip


def thrust(load: float, **bearing: float | str) -> BallScene:
    """A row at rest under a thrust [N]."""
    tables = {"bearing": {**BEARING, **bearing}, "operation": {"inner_speed_rpm": 0.0, "axial_load_N": load}}
    scene = Scene.from_dict(tables, "thrust")
    assert isinstance(scene, BallScene)
    return scene


def edges(load: float) -> dict[str, float]:
    """Angle at the edge of each ellipse [deg]: alpha + asin(a Q^(1/3)/(f D)), Q = F/(Z sin alpha)."""
    scene = thrust(load)
    result = equilibrium(scene)
    angle = math.radians(result.row_reports[""].balls[0].inner_angle_deg)
    model, force = row_of(scene), load / (14 * math.sin(angle))  # type: ignore[arg-type]
    contacts = {"inner": (model.inner_contact, 0.52), "outer": (model.outer_contact, 0.53)}
    return {
        race: math.degrees(angle + math.asin(contact.semi_major * np.cbrt(force) / (factor * 12e-3)))
        for race, (contact, factor) in contacts.items()
    }


@pytest.mark.parametrize("race", ["inner", "outer"])
def test_the_note_says_by_how_much_an_ellipse_is_beyond_the_shoulder(race: str) -> None:
    load, factor = 30_000.0, {"inner": 0.52, "outer": 0.53}[race]
    edge = edges(load)[race]
    for beyond, count in ((1.0, 1), (-0.01, 0)):
        height = factor * 12.0 * (1.0 - math.cos(math.radians(edge - beyond)))
        result = equilibrium(thrust(load, **{f"{race}_shoulder_height_mm": height}))
        contact = result.row_reports[""].contacts[race]
        assert contact.edge_angle_deg == pytest.approx(edge, abs=1e-6)
        assert contact.shoulder_angle_deg == pytest.approx(edge - beyond, abs=1e-6)
        notes = [note for note in result.notes or () if f"over the stated {race} shoulder" in note]
        assert len(notes) == count
        if notes:
            assert (
                f"climbs 1 deg over the stated {race} shoulder of {height:.3g} mm; make it higher, or reduce"
                in notes[0]
            )
    assert f"its edge at {edge:.3g} deg (shoulder at" in text(equilibrium_blocks(result))


def test_the_default_shoulder_is_a_fifth_of_the_ball_or_beyond_a_steep_angle() -> None:
    assert thrust(1.0, contact_angle_deg=15.0).bearing.shoulder_angle("inner") == pytest.approx(
        math.acos(1 - 0.2 / 0.52)
    )  # type: ignore[union-attr]
    assert thrust(1.0).bearing.shoulder_angle("outer") == pytest.approx(math.radians(60.0))  # type: ignore[union-attr]
    assert not any("shoulder" in note for note in equilibrium(thrust(1000.0)).notes or ())
    deep = thrust(60_000.0, contact_angle_deg=25.0)
    assert any(
        "over the estimated inner shoulder of 2.4 mm; state inner_shoulder_height_mm" in note
        for note in equilibrium(deep).notes or ()
    )


def test_a_shoulder_is_lower_than_its_groove_radius() -> None:
    with pytest.raises(InputError) as error:
        thrust(1.0, inner_shoulder_height_mm=6.24, outer_shoulder_height_mm=7.0)
    assert (
        "inner_shoulder_height_mm = 6.24: not below the groove radius of 6.24 mm; make it lower"
        in error.value.faults[0]
    )
    assert len(error.value.faults) == 2


def test_semi_axes_have_three_digits_and_no_exponent() -> None:
    shown = text(equilibrium_blocks(equilibrium(thrust(30_000.0))))
    contact = equilibrium(thrust(30_000.0)).row_reports[""].contacts["inner"]
    assert 1.0 < contact.semi_major_mm < 10.0 and "e+" not in shown
    major, minor = (float(f"{1e3 * axis:.3g}") for axis in (contact.semi_major_mm, contact.semi_minor_mm))
    assert f"semi-axes {major:.0f} x {minor:.0f} µm" in shown


def test_a_sweep_names_the_points_that_climb() -> None:
    height = 0.52 * 12.0 * (1.0 - math.cos(math.radians(edges(20_000.0)["inner"])))
    found = sweep(thrust(1.0, inner_shoulder_height_mm=height), {"operation.axial_load_N": [1e3, 1e4, 2.1e4, 3e4]})
    notes = {note["about"]: note["points"] for note in found.notes}
    assert notes["inner shoulder"] == [2, 3]


def test_a_deep_groove_has_a_shoulder_on_either_side():
    """Invariant: thrusts from both sides load the grooves alike; a bearing with one shoulder has none for the second."""
    deep = {"kind": "deep_groove_ball", "contact_angle_deg": None, "radial_clearance_mm": 0.02}
    for force in (2000.0, 60_000.0):
        push, pull = (equilibrium(thrust(side * force, **deep)) for side in (1.0, -1.0))
        assert [note.code for note in pull.notes] == [note.code for note in push.notes]
        for race, contact in push.contacts.items():
            assert pull.contacts[race].edge_angle_deg == pytest.approx(contact.edge_angle_deg, abs=1e-6)
    assert {note.code for note in push.notes} == {"shoulder"}
    one_sided = equilibrium(thrust(-2000.0)).notes
    assert any("14 of 14 balls carry load at negative angles" in note for note in one_sided)


def test_idle_balls_neither_climb_nor_slip():
    """Unit: at 10 rpm the balls without load carry 1e-7 of the largest, by their centrifugal force: a note counts them, and none warns."""
    scene = Scene.from_dict(
        {
            "bearing": {
                "kind": "angular_contact_ball", "balls": 15, "ball_diameter_mm": 15.875, "pitch_diameter_mm": 85.0,
                "contact_angle_deg": 40.0, "inner_groove_factor": 0.52, "outer_groove_factor": 0.53,
            },
            "operation": {"inner_speed_rpm": 10.0, "radial_load_N": 3000.0, "preload_N": 2000.0, "tilt": "fixed"},
        }
    )  # fmt: skip
    slow, fast = (equilibrium(each) for each in (scene, scene.changed({"operation.inner_speed_rpm": 6000.0})))
    loads = [ball.inner_load_N for ball in slow.row_reports[""].balls]
    assert 0.0 < min(loads) < 1e-6 * max(loads)
    assert [note.code for note in slow.notes] == ["clear-balls"]
    assert slow.notes[0].startswith("10 of 15 balls carry less than 0.1 % of the largest ball load")
    assert {"no-shoulder", "gyroscopic-slip"} <= {note.code for note in fast.notes}
