"""Start of a cold ball bearing: known answers, an integration of its own, preload, runaway, bad input, nothing when off."""

import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT
from warming_oracle import integrated, stated

import rbdyn
from rbdyn.base.faults import InputError
from rbdyn.base.words import shown
from rbdyn.cli.ball_studies import equilibrium_blocks, write_equilibrium
from rbdyn.cli.simulation_output import start_blocks
from rbdyn.quasistatic.result import BallResult
from rbdyn.quasistatic.start import ROUGH, _machine, at_point, capacities, radial_clearance
from rbdyn.quasistatic.sweep import sweep
from rbdyn.quasistatic.temperatures import at_temperatures, heat_at, steady_temperatures
from rbdyn.result import start_sheet
from rbdyn.scene import Scene
from rbdyn.scene.thermal import Temperatures, part_temperatures
from rbdyn.thermal.start import WARMING_NODES

EXAMPLE = ROOT / "examples" / "hot_ball.toml"
# A housing that hardly expands.
RIGID = {"elastic_modulus_GPa": 141.0, "poisson_ratio": 0.3, "density_kg_m3": 8100.0, "thermal_expansion_1e_6_K": 1.3}
SPINDLE = {
    "bearing": {
        "kind": "angular_contact_ball", "balls": 20, "ball_diameter_mm": 7.938, "pitch_diameter_mm": 54.0, "contact_angle_deg": 15.0,
        "inner_groove_factor": 0.53, "outer_groove_factor": 0.53,
    },
    "lubricant": {"oil": "ISO VG 32", "supply": "oil_air"},
    "mounting": {"bore_mm": 40.0, "outside_diameter_mm": 68.0, "width_mm": 15.0, "housing_diameter_mm": 100.0},
    "thermal": {},
    "operation": {"inner_speed_rpm": 8000.0, "preload_um": 5.0},
}  # fmt: skip


def _spindle(start=None, **changes):
    tables = {name: {**SPINDLE.get(name, {}), **changes.get(name, {})} for name in {**SPINDLE, **changes}}
    return Scene.from_dict({**tables, "thermal": {**tables["thermal"], **({} if start is None else {"start": start})}})


def _example(**changes):
    return Scene.load(EXAMPLE).changed({key.replace("__", "."): value for key, value in changes.items()})


@pytest.fixture(scope="module")
def cold() -> BallResult:
    return rbdyn.equilibrium(_example(thermal__start={}))


def test_stiff_a_course_that_cannot_be_integrated_leaves_the_equilibrium(monkeypatch, cold):
    """Stiff: where LSODA gives up, the steady bearing is answered all the same, and a note says at what time it ended."""
    from scipy import integrate

    whole = integrate.solve_ivp

    def given_up(*arguments, **options):
        solution = whole(*arguments, **options)
        solution.success, solution.message = False, "Repeated convergence failures."
        return solution

    monkeypatch.setattr(integrate, "solve_ivp", given_up)
    result = rbdyn.equilibrium(_example(thermal__start={}))
    assert result.start is None and result.status == "ok" and result.thermal == cold.thermal
    (note,) = [note for note in result.notes if note.code == "failed"]
    assert "start: it cannot be computed: temperatures over time: the integration ends at" in str(note)


def test_unit_end_of_the_course_is_the_steady_balance(cold):
    """Unit: the course begins cold and ends at the steady temperatures, clearance and axial load of the balance."""
    start, steady = cold.start, cold.thermal
    assert cold.status == "ok" and start.status == "steady" and start.reason is None
    for node, column in list(start.path.temperatures_C.items())[:4]:
        assert column[0] == 20.0 and column[-1] == pytest.approx(cold.temperatures_C[node], abs=0.1)
    figures = start.path.figures
    assert figures["radial_um"][-1] == pytest.approx(steady.clearance_um["operating"], abs=0.1)
    assert figures["axial_load_N"][-1] == pytest.approx(steady.friction_loads_N["axial"], rel=5e-3)
    assert figures["contact_pressure_MPa"][-1] == pytest.approx(max(cold.max_stress_MPa.values()), rel=5e-3)
    assert 500.0 < start.time_to_steady_s < 600.0 and start.guide_um is start.pocket_um is None
    assert BallResult.from_dict(json.loads(json.dumps(cold.as_dict()))).start == start


def test_unit_fixed_preload_grows_while_the_inner_ring_leads(cold):
    """Unit: preload by a spacer follows the lead of the inner ring and outgrows its steady value; preload by a spring does not change."""
    figures, start = cold.start.path.figures, cold.start
    lead, axial = (np.array(figures[name]) for name in ("inner_minus_outer_K", "axial_load_N"))
    assert lead[0] == 0.0 and lead.max() > lead[-1] + 5.0
    assert axial.max() > 1.2 * axial[-1] > 1.2 * axial[0] and np.corrcoef(lead, axial)[0, 1] > 0.8
    rising = axial[: int((lead > 0.95 * lead.max()).argmax())]
    assert (np.diff(rising) > 0.0).all() and np.corrcoef(figures["radial_um"], axial)[0, 1] < -0.98
    assert start.axial_load_N.time_s == pytest.approx(start.radial_um.time_s, rel=0.1)
    low, median, high = start.ranges["axial_load_N"]
    assert low < start.axial_load_N.greatest.value < high and low < median < high
    spring = rbdyn.equilibrium(_spindle({}, operation={"preload_um": None, "preload_N": 300.0}), ranges=False).start
    assert set(spring.path.figures["axial_load_N"]) == {300.0} and spring.axial_load_N.time_s is None
    assert spring.path.figures["radial_um"][0] > spring.radial_um.least.value + 5.0


def test_oracle_course_of_balls_by_an_integration_of_its_own(cold):
    """Oracle: Radau on the heats, conductances and capacities of the JSON, put together anew, gives its temperatures within 1 %."""
    rows = stated(cold.start)
    assert np.abs(integrated(cold.start) - rows).max() < 0.01 * (rows.max() - 20.0)


def test_oracle_rows_are_equilibria_at_stated_temperatures(cold):
    """Oracle: each row has the clearance, axial load and pressure of the same bearing at its temperatures, stated in [mounting]."""
    scene, path = _example(thermal__start={}), cold.start.path
    for row in (0, 30, 60, -1):
        nodes = np.array([path.temperatures_C[node][row] for node in WARMING_NODES])
        hot = at_temperatures(scene, Temperatures(*nodes[:4].tolist()), tuple(nodes[4:].tolist()))
        assert hot.mounting.housing_temperature_C == nodes[4]
        stated = rbdyn.equilibrium(hot)
        at_row = {name: column[row] for name, column in path.figures.items()}
        assert abs(stated.reaction.load_N["z"]) == pytest.approx(at_row["axial_load_N"], rel=1e-4)
        assert max(stated.max_stress_MPa.values()) == pytest.approx(at_row["contact_pressure_MPa"], rel=1e-4)
        assert float(radial_clearance(hot, scene.thermal, nodes)) == pytest.approx(at_row["radial_um"], abs=1e-3)


def test_oracle_machine_as_cold_as_its_start_has_no_gradients():
    """Oracle: a fit at -20 C in a room of 20 C takes what it takes at 20 C by Lame's formula; the shaft was 5 K warmer than stated."""
    cold, interference = {"time_s": [0.0, 9.0], "speed_rpm": [0.0, 8000.0], "load_N": [100.0, 500.0]}, 12.0
    scene = _spindle(
        {"from_C": -20.0, "schedule": cold},
        mounting={"inner_interference_um": interference, "rotation": False},
        operation={"radial_load_N": 500.0},
    )
    clearances = [
        rbdyn.equilibrium(each).start.path.figures["radial_um"][0]
        for each in (scene, scene.changed({"mounting.inner_interference_um": -50.0}))
    ]
    raceway = 54.0 - 7.938 * (1.0 + 2.0 * 0.03 * (1.0 - math.cos(math.radians(15.0))))
    assert clearances[1] - clearances[0] == pytest.approx(interference * 40.0 / raceway, rel=0.03)


def test_shaft_lags_only_where_it_loses_heat_or_cools_the_ring():
    """Limit: no lag below ambient while the ring warms the shaft; above ambient, or colder than the air with a cooled ring, its share."""
    thermal = _spindle().thermal

    def lag(inner, shaft):
        return (
            shaft
            - part_temperatures(thermal, Temperatures(0.0, 0.0, inner, 0.0), seats=(0.0, shaft))["shaft_temperature_C"]
        )

    assert lag(-20.0, -20.0) == lag(5.0, -10.0) == lag(30.0, 20.0) == 0.0
    assert lag(60.0, 60.0) == pytest.approx(0.125 * 40.0) and lag(-30.0, -20.0) == pytest.approx(-0.125 * 40.0)
    nodes = np.array([-20.0, 60.0])
    assert np.allclose(lag(nodes, nodes), [0.0, 5.0])


def test_runaway_of_balls_ends_soon():
    """Unit: a machine that no oil bears ends in few evaluations; the step of its net heat at 350 C held the integration for 300 s."""
    scene = Scene.from_dict(
        {
            "bearing": {
                "kind": "angular_contact_ball", "balls": 19, "ball_diameter_mm": 11.9062, "pitch_diameter_mm": 90.0,
                "contact_angle_deg": 40.0, "inner_groove_factor": 0.52, "outer_groove_factor": 0.53,
            },
            "lubricant": {"oil": "ISO VG 100", "supply": "grease", "roller_roughness_um": 0.02, "race_roughness_um": 0.1},
            "mounting": {
                "bore_mm": 70.0, "outside_diameter_mm": 110.0, "width_mm": 20.0, "housing_diameter_mm": 165.0,
                "inner_interference_um": 14.25, "outer_interference_um": -12.0,
            },
            "thermal": {"ambient_C": 20.0, "start": {"from_C": -20.0}},
            "operation": {"inner_speed_rpm": 8000.0, "radial_load_N": 2000.0, "preload_N": 4000.0},
        }
    )  # fmt: skip
    machine = _machine(scene, steady_temperatures(scene))
    calls = 0

    def counted(*arguments):
        nonlocal calls
        calls += 1
        return heat_at(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rbdyn.quasistatic.start.heat_at", counted)
        rows = machine.warmed(ROUGH)
    assert rows.is_hot and rows.times[-1] < machine.end and calls < 3000


def test_oracle_spacing_and_first_guess_of_balls_do_not_matter(cold, monkeypatch):
    """Oracle: rows half as far apart, a tighter integration or another first guess give the same extremes within their errors."""
    start = cold.start
    monkeypatch.setattr("rbdyn.thermal.start.ROWS", 32.0)
    monkeypatch.setattr("rbdyn.thermal.start.TOLERANCE", 1e-8)
    other = rbdyn.equilibrium(_example(thermal__start={}, lubricant__temperature_C=45.0), ranges=False).start
    assert len(other.path.time_s) > 1.8 * len(start.path.time_s)
    for one, two in (
        (start.radial_um.least, other.radial_um.least),
        (start.temperature_difference_K, other.temperature_difference_K),
        (start.axial_load_N.greatest, other.axial_load_N.greatest),
    ):
        assert 0.0 < one.error < 0.01 * abs(one.value) and abs(one.value - two.value) < np.hypot(one.error, two.error)


def test_unit_preload_that_runs_away_is_a_seizure_with_moment_and_cause():
    """Unit: in a housing that cannot expand a fixed preload runs away; the status says from when, why, and what ends it."""
    seized = rbdyn.equilibrium(_spindle({}, mounting={"housing_material": RIGID}), ranges=False)
    start = seized.start
    assert seized.status.startswith("no steady state") and seized.thermal.gain >= 1.0 and seized.report is None
    assert start.status == "seizure" and start.time_to_steady_s is None
    said = re.match(r"the preload runs away: from (\S+) s on the thermal loop gain is above 1", start.reason)
    assert said is not None and 0.0 < float(said[1]) < (end := start.path.time_s[-1])
    assert f"after {end:.3g} s a temperature passes what any oil bears" in start.reason
    axial = np.array(start.path.figures["axial_load_N"])
    assert (np.diff(axial)[5:] > 0.0).all() and start.path.temperatures_C["inner"][-1] >= 350.0


def test_unit_schedule_of_balls():
    """Unit: a machine at rest has no heat; load over time is along its direction; a load that comes late comes late."""
    schedule = {"time_s": [0.0, 60.0, 120.0, 180.0], "speed_rpm": [0.0, 0.0, 4000.0, 8000.0]}
    start = rbdyn.equilibrium(_spindle({"from_C": 30.0, "schedule": schedule}), ranges=False).start
    times, inner = np.array(start.path.time_s), np.array(start.path.temperatures_C["inner"])
    assert (np.diff(inner[times <= 60.0]) <= 0.0).all() and inner[times > 120.0].max() > 40.0
    assert not np.array(start.path.heat_W["inner"])[times <= 60.0].any() and start.status == "steady"
    scene = _spindle({}, operation={"load_N": [300.0, 400.0, 50.0], "preload_um": None})
    moved = at_point(scene, 0.5 * scene.operation.inner_speed, 1000.0)
    assert moved.operation.load == (600.0, 800.0, 50.0) and moved.operation.inner_speed_rpm == 4000.0
    assert at_point(scene, scene.operation.inner_speed, 500.0).operation == scene.operation
    assert at_point(_spindle({}), 100.0, 70.0).operation.load[:2] == (70.0, 0.0)


def test_limit_slow_course_is_a_sequence_of_steady_states():
    """Limit: over a week of slowly rising speed each moment is steady; trial steps of such a course leave the range of any oil."""
    schedule = {"time_s": [0.0, 600000.0], "speed_rpm": [1000.0, 8000.0]}
    path = rbdyn.equilibrium(_example(thermal__start={"schedule": schedule}), ranges=False).start.path
    for row in (120, 150, 180, 200):
        steady = rbdyn.equilibrium(
            _example(operation__inner_speed_rpm=path.speed_rpm[row]), ranges=False
        ).temperatures_C
        assert path.time_s[row] > 3000.0
        assert max(abs(path.temperatures_C[node][row] - value) for node, value in steady.items()) < 0.06


@pytest.mark.slow
def test_unit_overload_on_the_way_has_no_range():
    """Unit: where no input set bears the load, the largest axial load has no range, and a row of the table has none either."""
    schedule = {"time_s": [0.0, 10.0, 20.0], "load_N": [0.0, 0.0, 1e6]}
    start = rbdyn.equilibrium(_example(thermal__start={"schedule": schedule})).start
    assert "overloaded" in start.reason and "axial_load_N" not in start.ranges
    table, *_ = start_blocks(start)
    assert [row[2] for row in table.rows if row[0].startswith("largest axial load")] == [""]


@pytest.mark.slow
def test_unit_heavier_housing_of_balls_leads_to_more_preload():
    """Trend: the more of the housing warms with the bearing, the larger the lead of the inner ring and the preload on the way."""
    starts = [
        rbdyn.equilibrium(_example(thermal__start={"housing_widths": width}), ranges=False).start
        for width in (1.0, 3.0)
    ]
    assert starts[0].temperature_difference_K.value + 1.0 < starts[1].temperature_difference_K.value
    assert starts[0].axial_load_N.greatest.value < starts[1].axial_load_N.greatest.value


def test_unit_capacities_of_balls():
    """Unit: capacities are m c_p of plain rings and of balls; the oil of a bath fills the cavity."""
    scene = _spindle({"housing_widths": 2.0, "shaft_widths": 3.0}, lubricant={"oil": "ISO VG 32", "supply": "bath"})
    hot = at_temperatures(scene, Temperatures(20.0, 20.0, 20.0, 20.0))
    found = dict(zip(WARMING_NODES, capacities(hot, scene.thermal.start.widths), strict=True))
    steel, oil = scene.material("ball"), hot.lubricant.in_service
    per_volume = steel.density * steel.heat_capacity
    assert found["rollers"] == pytest.approx(20 * np.pi / 6.0 * 7.938e-3**3 * per_volume, rel=1e-12)
    assert found["housing"] == pytest.approx(2.0 * per_volume * np.pi / 4.0 * (0.1**2 - 0.068**2) * 0.015, rel=1e-12)
    assert found["shaft"] == pytest.approx(3.0 * per_volume * np.pi / 4.0 * 0.04**2 * 0.015, rel=1e-12)
    inner, outer = (1e-3 * diameter for diameter in scene.bearing.raceway_diameters_mm)
    cavity = np.pi / 4.0 * (outer**2 - inner**2) * 0.015 - 20 * np.pi / 6.0 * 7.938e-3**3
    assert found["oil"] == pytest.approx(cavity * oil.density * oil.heat_capacity, rel=1e-12)


def test_unit_table_picture_and_screen_of_a_start_of_balls(cold, tmp_path):
    """Unit: start.csv has a row a moment, the picture is written, and the answer has the extremes with ranges and times."""
    write_equilibrium(cold, None, tmp_path)
    assert (tmp_path / "start.csv").exists() and (tmp_path / "start.png").stat().st_size > 20_000
    frame = start_sheet(cold.start).frame
    assert frame["axial_load_N"].max() == pytest.approx(cold.start.axial_load_N.greatest.value, rel=1e-3)
    assert (frame["low_radial_clearance_um"] <= frame["high_radial_clearance_um"]).all()
    said = " ".join(map(str, equilibrium_blocks(cold)))
    # The times of largest loads have no range over the inputs: the time stands alone.
    assert f"'{shown(cold.start.axial_load_N.time_s, 3)}')" in said and "not always a minimum" not in said
    assert (
        "largest axial load [N]" in said and "largest contact pressure [MPa]" in said and "SKF's friction model" in said
    )


def test_unit_sweep_and_comparison_have_figures_of_a_start(cold):
    """Unit: a sweep has columns of the start, and ``figures`` of a result too."""
    table = sweep(_spindle({}), {"operation.inner_speed_rpm": [4000.0, 8000.0]}).table()
    names = [
        "start_radial_clearance_um",
        "start_inner_minus_outer_K",
        "start_axial_load_N",
        "start_contact_pressure_MPa",
    ]
    assert (table["start_axial_load_N"] > 0.0).all() and table["start_axial_load_N"].is_monotonic_increasing
    assert [cold.figures[name] for name in names] == [cold.start.figures[name].value for name in names]
    assert set(names) <= set(table.columns)


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ({"schedule": {"time_s": [0.0, 60.0, 30.0], "speed_rpm": [0.0, 1e3, 2e3]}}, r"time_s: times must rise, but 30 s \(point 3\) follows 60 s"),
        ({"from_C": -60.0}, r"from_C = -60: the oil has .* mm2/s there, above the 1e\+07 of its law; start warmer"),
        ({"from_C": 130.0}, r"from_C = 130: not below the ceiling of the oil, 120 C"),
        ({"schedule": {"time_s": [0.0, 60.0], "speed_rpm": [0.0, 6e4]}}, r"speed_rpm: reaches 60000, above twice the reference speed of 11700 rpm"),
        ({"schedule": {"time_s": [0.0, 60.0], "load_N": [0.0, 6e2]}}, r"load_N: has no effect, since operation.prescribed.x_mm holds the ring"),
    ],
)  # fmt: skip
def test_unit_bad_starts_of_balls_are_refused(start, message):
    """Unit: one sentence with key, value and fix."""
    changes = {"operation__radial_load_N": None, "operation__prescribed": {"x_mm": 0.0}} if "load_N" in message else {}
    oil = {"lubricant__oil": "ISO VG 320"} if "-60" in message else {}
    with pytest.raises(InputError, match=message) as refusal:
        _example(thermal__start=start, **changes, **oil)
    assert len(refusal.value.faults) == 1


def test_unit_nothing_without_a_start_of_balls(cold):
    """Unit: without the table the figures have the same bits, and the modules of a start are not loaded."""
    plain = rbdyn.equilibrium(EXAMPLE)
    assert plain.start is None and "start" not in plain.as_dict() and "start" not in plain.scene["thermal"]
    assert plain.temperatures_C == cold.temperatures_C and plain.thermal == cold.thermal
    assert plain.displacement_mm == cold.displacement_mm and plain.life == cold.life
    code = f"""
import sys, rbdyn
rbdyn.equilibrium({str(EXAMPLE)!r}, ranges=False)
print([name for name in sys.modules if name in ("rbdyn.thermal.start", "rbdyn.quasistatic.start")], "scipy.integrate" in sys.modules)
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.startswith("[] ")


def test_unit_search_of_a_start_is_that_of_the_balance(cold):
    """Unit: with seats as warm as their rings the heat has the bits of the steady balance."""
    scene = Scene.load(EXAMPLE)
    nodes = steady_temperatures(scene).last.temperatures
    alone, seated = heat_at(scene, nodes), heat_at(scene, nodes, (float(nodes[1]), float(nodes[2])))
    assert np.array_equal(alone.heat, seated.heat) and alone.conductances == seated.conductances
