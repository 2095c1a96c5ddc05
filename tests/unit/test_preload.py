"""Preload, clearance and wear: optima against a dense scan, closed forms, limits, notes."""

from __future__ import annotations

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn import BallScene
from rbdyn.life import balls as life
from rbdyn.life.turns import turning_rings
from rbdyn.quasistatic import fatigue, preload


def scene(radial=150.0, axial=40.0, clearance=None, **operation):
    """A small angular contact bearing at rest, rings held parallel; with a ``clearance`` [m] in place of its contact angle."""
    angle = {"contact_angle_deg": 15.0} if clearance is None else {"radial_clearance_mm": 1e3 * clearance}
    return BallScene.from_dict(
        {
            "bearing": {
                "kind": "angular_contact_ball",
                "balls": 10,
                "ball_diameter_mm": 4.85,
                "pitch_diameter_mm": 18.0,
                **angle,
                "inner_groove_factor": 0.52,
                "outer_groove_factor": 0.5235,
            },
            "operation": {"radial_load_N": radial, "axial_load_N": axial, "tilt": "fixed", **operation},
        }
    )


def of(swept, name):
    """One figure of all points of a sweep."""
    return np.array([getattr(point, name) for point in swept.points])


def test_optima_are_those_of_a_dense_scan():
    """Oracle: a scan of 400 cold starts has no less stress and no longer life than the two optima."""
    found = preload.over_preload(scene(), np.linspace(0.0, 130.0, 14))
    dense = preload.over_preload(scene(), np.linspace(0.0, 130.0, 400))
    assert found.least_stress.peak_pressure <= of(dense, "peak_pressure").min() * (1.0 + 1e-9)
    assert found.longest_life.million_turns >= of(dense, "million_turns").max() * (1.0 - 1e-9)
    assert found.least_stress.value == pytest.approx(of(dense, "value")[of(dense, "peak_pressure").argmin()], abs=0.35)
    assert found.longest_life.value == pytest.approx(of(dense, "value")[of(dense, "million_turns").argmax()], abs=0.35)
    assert found.least_stress.value - found.longest_life.value > 5.0
    assert len(found.notes) == 1 and "differ" in found.notes[0]
    for point in dense.points[::57]:
        cold = preload.over_preload(scene(axial=40.0 + point.value), [-1e-3, 0.0, 1e-3]).points[1]
        assert cold.peak_pressure == pytest.approx(point.peak_pressure, rel=1e-7)


def test_axial_load_alone_has_no_optimum_and_says_so():
    """Limit: without a radial load more preload is more stress and less life: both ends are named, no difference is."""
    found = preload.over_preload(scene(radial=0.0, axial=20.0), [0.0, 20.0, 60.0, 100.0])
    assert found.least_stress.value == found.longest_life.value == 0.0
    assert np.all(np.diff(of(found, "peak_pressure")) > 0.0) and np.all(np.diff(of(found, "million_turns")) < 0.0)
    assert len(found.notes) == 2 and all("lower end" in note for note in found.notes)
    # Every ball bears F_a/(Z sin alpha).
    point = found.points[2]
    load = 80.0 / (10.0 * math.sin(point.solution.inner_angle[0]))
    assert point.solution.inner_load == pytest.approx(np.full(10, load), rel=1e-8)
    expected = life.row_life(
        np.full(10, load), np.full(10, load), fatigue.reference_capacities(scene().bearing)
    ).million_turns
    assert point.million_turns == pytest.approx(expected, rel=1e-7)


def test_clearance_sweep_meets_the_scene_drawn_with_that_clearance():
    """Unit: a clearance equal to that of the contact angle gives the same equilibrium; more of it shortens life here."""
    own = preload.clearance_of(scene().bearing)
    assert own == pytest.approx(2.0 * 0.0435 * 4.85e-3 * (1.0 - math.cos(math.radians(15.0))), rel=1e-12)
    with pytest.raises(
        ValueError, match=r"bearing.contact_angle_deg = 15 rules the clearance, 14\.\d+ um: give bearing.radial_cl"
    ):
        preload.over_clearance(scene(), [0.5 * own, own, 2.0 * own])
    swept = preload.over_clearance(scene(clearance=own), [0.5 * own, own, 2.0 * own])
    plain = preload.over_preload(scene(), [-1.0, 0.0, 1.0]).points[1]
    assert swept.points[1].peak_pressure == pytest.approx(plain.peak_pressure, rel=1e-8)
    assert swept.points[1].million_turns == pytest.approx(plain.million_turns, rel=1e-8)
    assert np.all(np.diff(of(swept, "million_turns")) < 0.0)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 30e-6))
def test_invariant_wear_leaves_the_grooves_where_they_are(wear):
    """Invariant: groove radii and the radial distance of their centres stay; the clearance grows by twice the wear."""
    fresh, used = scene().bearing, preload.worn(scene(), wear).bearing
    for groove in ("inner_groove_factor", "outer_groove_factor"):
        radius = getattr(fresh, groove) * fresh.ball_diameter_mm
        assert getattr(used, groove) * used.ball_diameter_mm == pytest.approx(radius, rel=1e-12)
    apart = [row.groove_centre_distance_mm * math.cos(row.contact_angle) for row in (fresh, used)]
    assert apart[1] == pytest.approx(apart[0], abs=1e-12)
    gained = preload.clearance_of(used) - preload.clearance_of(fresh)
    assert gained == pytest.approx(2.0 * wear, abs=1e-15)
    assert used.contact_angle >= fresh.contact_angle - 1e-12


def test_wear_raises_stress_and_shortens_life():
    """Trend: balls worn by 0 to 4 um, under the same load."""
    swept = preload.over_wear(scene(), [0.0, 2e-6, 4e-6])
    fresh = preload.over_preload(scene(), [-1.0, 0.0, 1.0]).points[1]
    assert swept.points[0].peak_pressure == pytest.approx(fresh.peak_pressure, rel=1e-8)
    assert np.all(np.diff(of(swept, "peak_pressure")) > 0.0) and np.all(np.diff(of(swept, "million_turns")) < 0.0)


def test_ratings_of_a_drawing(monkeypatch):
    """Unit: a catalogue's capacity is taken as it is; grooves closer than 0.52 rate no higher than 0.52."""
    drawing = scene().bearing
    rated = drawing.model_copy(update={"dynamic_capacity_N": 2.0 * fatigue.capacity_of(drawing)})
    twice = np.array(fatigue.reference_capacities(rated)) / fatigue.reference_capacities(drawing)
    assert twice == pytest.approx((2.0, 2.0))
    close = drawing.model_copy(update={"inner_groove_factor": 0.51})
    assert fatigue.capacity_of(close) == pytest.approx(fatigue.capacity_of(drawing))
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    plain_capacities = importlib.import_module("published.lundberg_palmgren").plain_capacities
    assert plain_capacities(close)[0] > plain_capacities(drawing)[0]
    assert [turning_rings(*speeds) for speeds in ((0, 0), (1, 0), (0, 1), (1, -1))] == [
        "inner", "inner", "outer", "both",
    ]  # fmt: skip


def test_unit_bad_sweeps_are_named():
    """Unit: too few or falling values, a prescribed axial displacement, wear of more than the ball."""
    for values in ([0.0, 1.0], [0.0, 2.0, 1.0]):
        with pytest.raises(ValueError, match="rising"):
            preload.over_preload(scene(), values)
    with pytest.raises(ValueError, match="prescribed"):
        preload.over_preload(scene(axial=0.0, preload_um=5.0), [0.0, 1.0, 2.0])
    with pytest.raises(ValueError, match="wear"):
        preload.worn(scene(), -1e-6)
    with pytest.raises(ValueError, match="wear"):
        preload.worn(scene(), 5e-3)
