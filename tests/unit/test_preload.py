"""Preload, clearance and wear: optima against a dense scan, closed forms, limits, notes."""

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn import BallScene
from rbdyn.base.faults import InputError
from rbdyn.cli.ball_studies import optimum_study
from rbdyn.life import balls as life
from rbdyn.life import turning_rings
from rbdyn.quasistatic import preload, result
from rbdyn.quasistatic.bearing import equilibrium
from rbdyn.quasistatic.sweep import sweep
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"


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
        np.full(10, load), np.full(10, load), result.reference_capacities(scene().bearing)
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
    fresh, used = scene().bearing, preload.wear_scene(scene(), wear).bearing
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
    rated = drawing.model_copy(update={"dynamic_capacity_N": 2.0 * result.capacity_of(drawing)})
    twice = np.array(result.reference_capacities(rated)) / result.reference_capacities(drawing)
    assert twice == pytest.approx((2.0, 2.0))
    close = drawing.model_copy(update={"inner_groove_factor": 0.51})
    assert result.capacity_of(close) == pytest.approx(result.capacity_of(drawing))
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
        preload.wear_scene(scene(), -1e-6)
    with pytest.raises(ValueError, match="wear"):
        preload.wear_scene(scene(), 5e-3)


SINGLE = EXAMPLES / "angular_contact_ball.toml", ("bearing.bore_mm=40.0", "bearing.outside_diameter_mm=52.0")
DOUBLE = EXAMPLES / "double_decker.toml", ()
DEEP = EXAMPLES / "deep_groove_ball.toml", ()
SWEPT = [
    (SINGLE, "operation.preload_N", (0.0, 150.0, 900.0)),
    (SINGLE, "operation.axial_load_N", (0.0, 900.0)),
    (SINGLE, "operation.inner_speed_rpm", (0.0, 9000.0)),
    (SINGLE, "operation.prescribed.y_mm", (0.001, 0.002)),
    (SINGLE, "bearing.contact_angle_deg", (20.0, 30.0)),
    (SINGLE, "bearing.clearance_change_um", (-2.0, 2.0)),
    (SINGLE, "bearing.inner_groove_factor", (0.515, 0.53)),
    (SINGLE, "bearing.balls", (20.0, 22.0)),
    (SINGLE, "model.light_load_share", (0.3, 1.0)),
    (DEEP, "operation.preload_um", (5.0, 10.0)),
    (DEEP, "bearing.radial_clearance_mm", (-0.002, 0.0, 0.02)),
    (DEEP, "bearing.dynamic_capacity_N", (2e4, 4e4)),
    (DOUBLE, "operation.preload_N", (0.0, 400.0)),
    (DOUBLE, "bearing.inner.contact_angle_deg", (15.0, 25.0)),
    (DOUBLE, "bearing.middle.speed_rpm", (3000.0, 5000.0)),
]


def sweep_figures(table, place):
    """Figures of a row of a sweep's table that one equilibrium has too."""
    names = ["x_mm", "z_mm", "force_x_N", "force_z_N"]
    names += [name for name in ("inner_pressure_MPa", "outer_pressure_MPa", "L10_Mrev") if name in table.columns]
    return {name: float(table.columns[name][place]) for name in names}


def equilibrium_figures(scene):
    """The same of the equilibrium of a scene."""
    record = equilibrium(scene).as_dict()
    figures = {f"{axis}_mm": record["displacement_mm"][axis] for axis in "xz"}
    figures |= {f"force_{axis}_N": record["reaction"]["load_N"][axis] for axis in "xz"}
    if "balls" in record:
        figures |= {f"{race}_pressure_MPa": record["max_stress_MPa"][race] for race in ("inner", "outer")}
        figures["L10_Mrev"] = record["life"]["L10_Mrev"]
    return figures


@pytest.mark.parametrize(("source", "key", "values"), SWEPT, ids=lambda part: part if isinstance(part, str) else "")
def test_invariant_a_row_of_a_sweep_is_the_equilibrium_at_its_value(source, key, values):
    """Invariant: of a scene with values of its own, each row is the equilibrium of the scene with the swept key replaced."""
    path, changes = source
    own = () if key in ("operation.preload_um",) else ("operation.preload_N=300.0",)
    own = (*own, f"{key}={values[0]!r}") if "balls" not in key else own
    whole = Scene.load(path, (*changes, *own))
    table = sweep(whole, {key: values})
    for place, value in enumerate(values):
        alone = whole.changed({key: int(value) if key == "bearing.balls" else value})
        assert sweep_figures(table, place) == pytest.approx(equilibrium_figures(alone), rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(("study", "file", "values"), [
    ("preload", SINGLE[0], (0.0, 150.0, 900.0)), ("clearance", DEEP[0], (-2.0, 0.0, 20.0)), ("wear", SINGLE[0], (0.0, 1.0, 2.0)),
])  # fmt: skip
def test_invariant_a_row_of_a_study_is_the_equilibrium_at_its_value(study, file, values):
    """Invariant: rows of --preload, --clearance and --wear are equilibria of the scene with that value and no other's."""
    whole = Scene.load(file, ["operation.preload_N=300.0"])
    table = optimum_study(whole, study, values).table
    for place, value in enumerate(values):
        alone = {
            "preload": lambda force: whole.changed({"operation.preload_N": force}),
            "clearance": lambda gap: whole.changed({"bearing.radial_clearance_mm": 1e-3 * gap}),
            "wear": lambda loss: preload.wear_scene(whole, 1e-6 * loss),
        }[study](value)
        assert sweep_figures(table, place) == pytest.approx(equilibrium_figures(alone), rel=1e-7, abs=1e-9)


def test_unit_a_sweep_of_preload_replaces_that_of_the_scene():
    """Unit: a preload of the scene's own of 30 N changes no row of a sweep of preload and neither of its optima."""
    values = [0.0, 20.0, 60.0, 130.0]
    plain, preloaded = (preload.over_preload(scene(preload_N=force), values) for force in (0.0, 30.0))
    assert list(of(plain, "peak_pressure")) == list(of(preloaded, "peak_pressure"))
    assert plain.least_stress.value == preloaded.least_stress.value
    assert plain.longest_life.value == preloaded.longest_life.value and plain.notes == preloaded.notes


def test_unit_a_study_refuses_what_a_scene_refuses():
    """Unit: a preload beyond its range is a sentence; a load that no contact carries is a row without figures."""
    with pytest.raises(InputError, match=r"operation\.preload_N = 1e\+300: must be at most"):
        preload.over_preload(scene(), [0.0, 1.0, 1e300])
    points = preload.over_preload(scene(), [0.0, 10.0, 20.0, 1e7]).points
    assert points[-1].solution.status == equilibrium(scene(preload_N=1e7)).status and math.isnan(
        points[-1].peak_pressure
    )
    assert points[-1].solution.status.startswith("overloaded")
