"""Form errors of grooves and balls: signs, who carries them, what a seed draws, what a scene may hold."""

import math
from dataclasses import replace

import numpy as np
import pytest
from ball_scenes import DEEP, changed, scene
from hypothesis import given
from hypothesis import strategies as st

from rbdyn.base.faults import InputError, validated
from rbdyn.quasistatic.runout.lots import errors_of
from rbdyn.quasistatic.runout.turn import ball_path, perfect, random_waviness, rolling, waviness
from rbdyn.scene.form_errors import FormErrors, misfits

Z = 7
TURNING = rolling(12.7e-3, 70e-3, math.radians(40.0))


def test_literature_kinematics():
    """Literature: D 12.7 mm on 70 mm at 40 degrees and 10000 rpm: the cage turns at 4305.1 rpm (section 14)."""
    assert 10000.0 * TURNING.cage == pytest.approx(4305.1, abs=0.05)


@given(gamma=st.floats(0.02, 0.6), outer=st.floats(-3.0, 3.0))
def test_invariant_rolling_without_slip(gamma, outer):
    """Invariant: at both contacts, seen from the cage, ring and ball have one surface speed."""
    pitch = 0.1
    turning = rolling(gamma * pitch, pitch, 0.0, outer)
    inner_speed = (turning.inner - turning.cage) * 0.5 * pitch * (1.0 - gamma)
    outer_speed = (turning.outer - turning.cage) * 0.5 * pitch * (1.0 + gamma)
    ball_speed = turning.spin * 0.5 * gamma * pitch
    assert inner_speed == pytest.approx(ball_speed, rel=1e-12)
    assert outer_speed == pytest.approx(-ball_speed, rel=1e-12)


def test_unit_ball_without_pitch_circle_is_refused():
    """Unit: a ball as large as its pitch circle is refused by name when the scene is read."""
    with pytest.raises(InputError, match=r"ball_diameter_mm = 65: .*make the ball smaller"):
        scene(changed(DEEP, bearing={"ball_diameter_mm": DEEP["bearing"]["pitch_diameter_mm"]}))


def test_unit_signs_of_each_error():
    """Unit: what closes a contact takes from its reach or moves the inner groove outwards, and what opens it does not."""
    bump = waviness((1, 1e-6, 0.0))
    first = {
        name: ball_path(replace(perfect(Z), **{name: bump}), TURNING, 8)
        for name in ("inner_roundness", "outer_roundness", "inner_sway", "outer_sway", "outer_groove_radius")
    }
    # At the first step the first ball stands on the lobes of both rings.
    assert first["inner_roundness"].radial[0, 0] == pytest.approx(1e-6)
    assert first["outer_roundness"].radial[0, 0] == pytest.approx(-1e-6)
    assert first["inner_sway"].axial[0, 0] == pytest.approx(1e-6)
    assert first["outer_sway"].axial[0, 0] == pytest.approx(-1e-6)
    assert not first["inner_sway"].radial.any() and not first["inner_roundness"].axial.any()
    groove = first["outer_groove_radius"]
    assert groove.outer_reach[0, 0] == groove.radial[0, 0] == pytest.approx(1e-6)
    assert not groove.inner_reach.any()
    larger = ball_path(replace(perfect(Z), ball_diameter=np.full(Z, 1e-6)), TURNING, 8)
    assert np.all(larger.inner_reach == -0.5e-6) and np.all(larger.outer_reach == -0.5e-6)


def test_unit_errors_stay_with_their_rings():
    """Unit: a ball meets an outer lobe at its own azimuth, an inner lobe as the inner ring comes by."""
    lobes = waviness((3, 1e-6, 0.4))
    path = ball_path(replace(perfect(Z), outer_roundness=lobes), TURNING, 40, turns=2)
    assert path.radial == pytest.approx(-1e-6 * np.cos(3.0 * (path.azimuth - 0.4)))
    path = ball_path(replace(perfect(Z), inner_roundness=lobes), TURNING, 40, turns=2)
    seen = path.azimuth - path.ring_angle[:, np.newaxis] - 0.4
    assert path.radial == pytest.approx(1e-6 * np.cos(3.0 * seen))
    assert path.azimuth[40, 0] == pytest.approx(2.0 * math.pi * TURNING.cage)


@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_invariant_even_orders_change_the_diameter_and_odd_ones_do_not(order):
    """Invariant: contacts lie opposite, so odd orders cancel in the ball's diameter and even ones double."""
    ball = waviness((order, 0.1e-6, 0.3))
    path = ball_path(replace(perfect(Z), sphericity=(ball,) * Z), TURNING, 90)
    both = path.inner_reach + path.outer_reach
    if order % 2:
        assert np.abs(both).max() < 1e-20
    else:
        assert both == pytest.approx(2.0 * path.inner_reach)
    spun = TURNING.spin * path.ring_angle
    assert path.inner_reach[:, 2] == pytest.approx(-0.1e-6 * np.cos(order * (spun - 0.3)))


def test_unit_random_waviness_is_as_high_as_asked():
    """Unit: the drawn form has the height asked for, the orders asked for, and repeats with its seed."""
    form = random_waviness(2, 40, 1.5e-6, 1.0, np.random.default_rng(3))
    trace = form.deviation(np.linspace(0.0, 2.0 * math.pi, 20_000))
    assert np.ptp(trace) == pytest.approx(1.5e-6, rel=2e-3)
    assert list(form.order[[0, -1]]) == [2, 40]
    again = random_waviness(2, 40, 1.5e-6, 1.0, np.random.default_rng(3))
    assert np.array_equal(form.amplitude, again.amplitude) and np.array_equal(form.phase, again.phase)


TABLE = {
    "inner_roundness": [{"order": 2, "amplitude_um": 0.5, "phase_deg": 90.0}],
    "outer_roundness_random": {"lowest_order": 2, "highest_order": 20, "height_um": 1.6},
    "inner_side_sway": [{"order": 1, "amplitude_um": 0.8}],
    "ball_sphericity": [{"order": 2, "amplitude_um": 0.1, "balls": [1, 3]}, {"order": 4, "amplitude_um": 0.05}],
    "ball_diameter_spread_um": 0.1,
    "seed": 5,
}


def test_unit_errors_of_a_scene():
    """Unit: a scene's table becomes SI errors; adding one error leaves what the others drew."""
    scene = validated(FormErrors, TABLE, "scene")
    errors = errors_of(scene, Z)
    assert errors.inner_roundness.deviation(np.array([math.pi / 2]))[0] == pytest.approx(0.5e-6)
    assert errors.outer_roundness.height == pytest.approx(1.6e-6)
    assert [ball.order.tolist() for ball in errors.sphericity[:3]] == [[2, 4], [4], [2, 4]]
    assert 0.0 < errors.ball_diameter.std() < 0.3e-6
    more = errors_of(scene.model_copy(update={"inner_roundness_random": scene.outer_roundness_random}), Z)
    assert np.array_equal(more.outer_roundness.phase, errors.outer_roundness.phase)
    assert np.array_equal(more.ball_diameter, errors.ball_diameter)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"steps": 30}, "take at least 41"),
        ({"ball_diameter_errors_um": [0.0] * Z}, "contradict each other"),
        ({"outer_roundness_random": {"lowest_order": 9, "highest_order": 3, "height_um": 1.0}}, "swap them"),
        ({"ball_sphericity": [{"order": 1, "amplitude_um": 0.1}]}, "must be at least 2"),
        ({"inner_roundnes": []}, "did you mean inner_roundness"),
    ],
)
def test_unit_bad_tables_are_refused_in_a_sentence(change, sentence):
    """Unit: each contradiction is named with its mend."""
    with pytest.raises(InputError, match=sentence):
        validated(FormErrors, {**TABLE, **change}, "scene")


def test_unit_errors_that_do_not_go_with_the_balls():
    """Unit: one error a ball, balls that exist, errors that are no diameters."""
    table = {
        "ball_diameter_errors_um": [0.0, 500.0],
        "ball_sphericity": [{"order": 2, "amplitude_um": 0.1, "balls": [9]}],
    }
    found = list(misfits(validated(FormErrors, table, "scene"), Z, 12.7, 70.0))
    assert [
        any(word in sentence for sentence in found) for word in ("one value for each ball", "ball 9 of 7", "hundredth")
    ] == [True] * 3
    assert not list(misfits(validated(FormErrors, TABLE, "scene"), Z, 12.7, 70.0))
    coarse = validated(FormErrors, {"ball_sphericity": [{"order": 20, "amplitude_um": 0.1}], "steps": 100}, "scene")
    assert "take at least 111" in next(misfits(coarse, Z, 12.7, 70.0))
