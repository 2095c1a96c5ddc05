"""Start of a cold roller bearing: figures, an integration of its own, spacing of the moments, bad input, nothing when off."""

import json
import subprocess
import sys
import tomllib
from functools import cache
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner
from warming_oracle import integrated, stated

from doe.clearance import responses_of
from doe.study_file.study import Response
from rbdyn import Scene, plots, simulate
from rbdyn.base.faults import InputError
from rbdyn.cli.app import app
from rbdyn.dynamics import start as start_module
from rbdyn.dynamics.figures import FIGURES, why_missing
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.start import capacities, clearances_at, seats_of
from rbdyn.dynamics.parameters.state import load_distribution
from rbdyn.dynamics.parameters.validity import race_report
from rbdyn.mounting.rings import Ring, interface_pressure
from rbdyn.properties.materials import Material
from rbdyn.result import START_FIGURES, SimulationResult, StartResult, start_sheet
from rbdyn.scene.thermal import Temperatures, at_temperatures, part_temperatures
from rbdyn.scene.uncertain import Uncertain
from rbdyn.scene.unknown import inputs_of
from rbdyn.thermal.start import ROUGHNESS, WARMING_NODES

# Simulations of the heat alone: runs five times as long tell the same of a start.
QUICK = {
    "turns": 4.0, "discard_turns": 2.0, "impact_window_turns": 2.0, "replicates": 2, "extend": False,
    "companion": False,
}  # fmt: skip


@cache
def _written(*arguments: str) -> str:
    return CliRunner().invoke(app, ["new", *arguments]).stdout


def _tables(*arguments: str, start: dict[str, Any] | None = None, **changes: dict[str, Any]) -> dict[str, Any]:
    tables = tomllib.loads(
        _written(
            *(arguments or ("NU308", "--speed", "4000", "--load", "4000", "--oil", "ISO VG 68", "--ambient", "20"))
        )
    )
    tables["numerics"] = QUICK
    if start is not None:
        tables["thermal"] = {**tables["thermal"], "start": start}
    return {name: {**tables.get(name, {}), **changes.get(name, {})} for name in {**tables, **changes}}


def _scene(*arguments: str, start: dict[str, Any] | None = None, **changes: dict[str, Any]) -> Scene:
    return Scene.from_dict(_tables(*arguments, start=start, **changes))


@pytest.fixture(scope="module")
def cold() -> SimulationResult:
    return simulate(_scene(start={}), workers=2, notice=None)


def test_unit_least_clearance_of_nu_308(cold):
    """Unit: NU 308 at 4000 rpm from 20 C: least radial clearance of 10 to 21 um after 75 to 280 s, then more, and steady."""
    start = cold.start
    assert start.status == "steady" and cold.status == "ok" and start.reason is None
    least = start.radial_um.least.value
    assert 10.0 < least < 21.0 and 75.0 < start.radial_um.time_s < 280.0
    steady = cold.clearance_um["radial"]["operating"]
    assert least + 3.0 < steady
    # The end of the course is the steady state of the balance, which the short runs of the course do not know.
    assert start.path.figures["radial_um"][-1] == pytest.approx(steady, abs=0.2)
    for node, column in list(start.path.temperatures_C.items())[:4]:
        assert column[0] == 20.0 and column[-1] == pytest.approx(cold.temperatures_C[node].value, abs=0.1)
    assert start.pocket_um.time_s is None  # the brass cage grows more than the rollers
    lead = start.temperature_difference_K.value
    assert lead > cold.temperatures_C["inner"].value - cold.temperatures_C["outer"].value + 2.0
    assert len(start.moments) <= 11 and start.moments[1].temperatures_C == dict.fromkeys(WARMING_NODES, 20.0)
    assert {len(row) for rows in start.path.ranges.values() for row in rows} == {len(start.path.time_s)}
    low, median, high = start.ranges["radial_um"]
    assert low < least < high and low < median < high
    assert start.time_to_steady_s == pytest.approx(1150.0, rel=0.15)
    assert {"thermal.start.housing_widths", "thermal.start.shaft_widths"} <= set(start.inputs)
    assert SimulationResult.from_dict(json.loads(json.dumps(cold.as_dict()))) == cold


def test_oracle_course_by_an_integration_of_its_own(cold):
    """Oracle: Radau on the heats, conductances and capacities of the JSON, put together anew, gives its temperatures within 1 %."""
    start: StartResult = cold.start
    path, rows = start.path, stated(start)
    assert np.abs(integrated(start) - rows).max() < 0.01 * (rows.max() - 20.0)
    # Clearances of rows, by the scene at these temperatures.
    scene = _scene(start={})
    for row in (0, 40, 80, -1):
        nodes = rows[:, row]
        hot = at_temperatures(scene, Temperatures(*nodes[:4].tolist()), tuple(nodes[4:].tolist()))
        for name, play in hot.clearances.items():
            assert path.figures[f"{name}_um"][row] == pytest.approx(1e6 * play.operating, abs=1e-3)


def test_unit_figures_of_a_start_are_responses(cold):
    """Unit: a study may name least clearances and the lead of the inner ring; a scene without the table says what is missing."""
    start, responses = cold.start, cold.responses
    assert responses["start_radial_clearance_um"] == start.radial_um.least
    assert responses["start_inner_minus_outer_K"] == start.temperature_difference_K
    assert responses["start_radial_time_s"].value == start.radial_um.time_s
    assert responses["start_time_to_steady_s"].value == start.time_to_steady_s
    # Without a minimum the least is at the start, when the cage is cold.
    assert start.pocket_um.time_s is None and responses["start_pocket_time_s"].value == 0.0
    assert start.share_with_minimum["pocket_um"] == 0.0 < start.share_with_minimum["radial_um"] < 1.0
    assert (
        responses["start_share_of_seizure"].value
        == start.share_of_seizure
        == 0.0
        < responses["start_share_of_seizure"].error
    )
    listed = {figure.key for figure in FIGURES if figure.kind == "start"}
    assert listed == set(START_FIGURES) <= set(responses_of(heats=False))
    assert all(why_missing(_scene(start={}), key) is None for key in listed)
    assert why_missing(_scene(), "start_radial_clearance_um") == (
        "the scene has no [thermal.start]; add that table to its file or choose another result"
    )
    by_rollers = {"guidance": "roller", "guide_clearance_mm": None, "pocket_radial_clearance_mm": 0.3}
    tables = _tables(start={}, cage=by_rollers)
    tables["cage"] = {key: value for key, value in tables["cage"].items() if value is not None and "land" not in key}
    scene = Scene.from_dict(tables)
    assert why_missing(scene, "start_guide_clearance_um") == "no ring guides the cage; choose another result"


def test_unit_study_names_a_start_as_the_json_does():
    """Unit: a limit of a study may name start.radial_um.least, the place in the JSON, and has the figure of the list."""
    limit = Response.model_validate({"name": "start.radial_um.least", "goal": "none", "lower": 5.0})
    assert limit.name == "start_radial_clearance_um" and limit.lower == 5.0
    lead = Response.model_validate({"name": "start.temperature_difference_K", "goal": "min"})
    assert lead.name == "start_inner_minus_outer_K"
    for place, key in (("radial_um.time_s", "radial_time_s"), ("time_to_steady_s",) * 2, ("race_pressure_MPa",) * 2):
        assert Response.model_validate({"name": f"start.{place}", "goal": "min"}).name == f"start_{key}"


def test_oracle_race_pressure_where_clearance_is_least(cold):
    """Oracle: the pressure is that of the bearing built anew at the temperatures of the moment, within the rows about it."""
    start, path = cold.start, cold.start.path
    row = int(np.argmin(path.figures["radial_um"]))
    nodes = [path.temperatures_C[node][row] for node in WARMING_NODES]
    hot = at_temperatures(_scene(start={}), Temperatures(*nodes[:4]), tuple(nodes[4:]))
    loads = load_distribution(hot, roller_bearing(hot), 4000.0)
    races = race_report(hot, float(loads.inner.max()), float(loads.outer.max()))
    pressure = max(race.max_pressure_MPa for race in races.values())
    assert start.race_pressure_MPa == pytest.approx(pressure, rel=1e-4)
    steady = max(cold.races[race].max_pressure_MPa for race in ("inner", "outer"))
    assert start.race_pressure_MPa < steady  # a smaller clearance spreads the load
    assert 0.0 < cold.responses["start_race_pressure_MPa"].error < 0.02 * pressure


def test_unit_widths_are_unknown_inputs():
    """Unit: doe uncertainty draws the lengths of housing and shaft that warm, unless they are stated; without a start there are none."""

    def drawn(tables: dict[str, Any]) -> list[str]:
        inputs = inputs_of(Scene.from_dict(tables), tables, Uncertain())
        return [entry.key for entry in inputs if entry.key.startswith("thermal.start")]

    both = ["thermal.start.housing_widths", "thermal.start.shaft_widths"]
    assert drawn(_tables(start={})) == both and drawn(_tables()) == []
    assert drawn(_tables(start={"housing_widths": 2.0})) == both[1:]


def test_unit_table_and_picture_of_a_start(cold, tmp_path):
    """Unit: start.csv has a row a moment with ranges about the course; the picture has a panel of temperatures and three of clearances."""
    frame = start_sheet(cold.start).frame
    assert list(frame["time_s"]) == cold.start.path.time_s
    assert frame["radial_clearance_um"].min() == pytest.approx(cold.start.radial_um.least.value, abs=0.05)
    assert (frame["low_radial_clearance_um"] <= frame["radial_clearance_um"] + 1e-6).all()
    assert (frame["low_inner_temperature_C"] <= frame["high_inner_temperature_C"]).all()
    plots.start(cold.start, tmp_path / "start.png")
    assert (tmp_path / "start.png").stat().st_size > 20_000


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments", [(), ("NU1014", "--speed", "3000", "--load", "5000", "--oil", "ISO VG 100", "--ambient", "20")]
)
def test_oracle_first_guess_and_spacing_do_not_matter(arguments, monkeypatch):
    """Oracle: another first guess of the balance, and moments half as far apart, give the same least clearance within stated errors."""
    scenes = (_scene(*arguments, start={}, lubricant=guess) for guess in ({}, {"temperature_C": 45.0}))
    usual, guess = (simulate(scene, workers=2, notice=None).start for scene in scenes)
    monkeypatch.setattr(start_module, "FILM_REACH", 7.5)
    monkeypatch.setattr(start_module, "CLEARANCE_REACH", 0.05)
    monkeypatch.setattr(start_module, "LEAST_REACH", 1.25)
    monkeypatch.setattr(start_module, "MOST_SIMULATIONS", 30)
    dense = simulate(_scene(*arguments, start={}), workers=2, notice=None).start
    assert len(dense.moments) > len(usual.moments)
    least = usual.radial_um.least
    for other in (guess.radial_um.least, dense.radial_um.least):
        assert abs(other.value - least.value) < np.hypot(other.error, least.error)


@pytest.mark.slow
def test_slow_warm_up_keeps_more_clearance(cold):
    """Trend: speed that rises over half an hour leaves more of the radial clearance, and the end is the same."""
    ramp = {"schedule": {"time_s": [0.0, 1800.0], "speed_rpm": [800.0, 4000.0]}}
    slow = simulate(_scene(start=ramp), workers=2, notice=None).start
    assert slow.radial_um.least.value > cold.start.radial_um.least.value + 1.0
    assert slow.temperature_difference_K.value < cold.start.temperature_difference_K.value
    assert slow.path.figures["radial_um"][-1] == pytest.approx(cold.start.path.figures["radial_um"][-1], abs=0.3)
    assert slow.path.speed_rpm[0] == 800.0 and len(slow.moments) <= 11


@pytest.mark.slow
def test_tight_cage_seizes_during_the_start():
    """Verdict: a cage with guide clearance enough when steady, whose land stays cold in winter, seizes at a stated moment."""
    seized = simulate(_scene(start={"from_C": -20.0}, cage={"guide_clearance_mm": 0.073}), workers=2, notice=None)
    start = seized.start
    assert seized.thermal.status == "steady" and seized.clearance_um["guide"]["operating"] > 20.0
    assert seized.status == start.status == "seizure" and "the guide clearance of the cage is lost" in start.reason
    assert "by half of the simulations after" in start.reason
    # A simulation next to the seizure, whose steps shrink with the film, may fail.
    failed = [note for note in seized.notes if "failed" in note]
    assert len(failed) <= 1 and all("so that their neighbours give the heat there" in note for note in failed)
    floor = 2.0 * _scene().model.land_film_floor_um
    guide = start.path.figures["guide_um"]
    assert guide[-1] <= floor + 1e-6 < guide[-2] and start.path.time_s[-1] < 60.0
    assert start.time_to_steady_s is None and start.share_of_seizure > 0.5
    assert seized.notes[0].startswith("seizure: start: after") and seized.notes[0].code == "seizure"


def test_unit_capacities_and_seats_of_a_drawing():
    """Unit: capacities are m c_p of plain rings; a loose seat conducts k A over its gap, a tight one k A over its roughness."""
    scene = _scene(start={"housing_widths": 2.0, "shaft_widths": 3.0})
    hot = at_temperatures(scene, Temperatures(20.0, 20.0, 20.0, 20.0))
    found = dict(zip(WARMING_NODES, capacities(hot, scene.thermal), strict=True))
    steel = (
        7850.0 * 470.0
        if not hasattr(scene.material("rings"), "density")
        else scene.material("rings").density * scene.material("rings").heat_capacity
    )
    assert found["housing"] == pytest.approx(2.0 * steel * np.pi / 4.0 * (0.135**2 - 0.09**2) * 0.023, rel=1e-12)
    assert found["shaft"] == pytest.approx(3.0 * steel * np.pi / 4.0 * 0.04**2 * 0.023, rel=1e-12)
    assert found["inner"] == pytest.approx(steel * np.pi / 4.0 * (0.052**2 - 0.04**2) * 0.023, rel=1e-12)
    oil = hot.oil()
    seats = seats_of(hot)
    assert seats.housing == pytest.approx(oil.conductivity * np.pi * 0.09 * 0.023 / (12.5e-6 + ROUGHNESS), rel=1e-3)
    assert seats.shaft == pytest.approx(oil.conductivity * np.pi * 0.04 * 0.023 / ROUGHNESS, rel=1e-12)


def test_unit_clearances_of_many_rows_are_those_of_each():
    """Unit: clearances of arrays of temperatures have the bits of single ones; rotation counts by the square of the speed."""
    scene = _scene(start={})
    hot = at_temperatures(scene, Temperatures(60.0, 55.0, 62.0, 64.0))
    nodes = np.random.default_rng(1).uniform(-20.0, 120.0, (50, 6))
    many = clearances_at(hot, scene.thermal, nodes)
    for row in range(len(nodes)):
        alone = clearances_at(hot, scene.thermal, nodes[row])
        assert all(many.figures[name][row] == alone.figures[name] for name in many.figures)
        keys = part_temperatures(
            scene.thermal, Temperatures(*nodes[row, :4].tolist()), seats=tuple(nodes[row, 4:].tolist())
        )
        mounted = hot.clearances_of(hot.mounting.model_copy(update=keys))
        plays = {name: float(play) for name, play in alone.figures.items()}
        assert {f"{name}_um": 1e6 * play for name, play in mounted.items()} == pytest.approx(plays, abs=1e-10)
    slow, fast = (clearances_at(hot, scene.thermal, nodes, ratio).figures["radial_um"] for ratio in (0.0, 2.0))
    once = many.figures["radial_um"]
    assert fast - slow == pytest.approx(4.0 * (once - slow), abs=1e-9) and (fast < slow).all()


def test_unit_pressure_of_arrays_has_the_bits_of_floats():
    """Unit: pressures of fits at arrays of temperatures are those of floats bit by bit, tight and loose; floats stay floats."""
    steel = Material(2.1e11, 0.3, 7850.0)
    rises = np.linspace(-100.0, 100.0, 41)
    outer = Ring(0.02, 0.026, steel, 0.0, 400.0)
    together = interface_pressure(Ring(0.0, 0.02, steel, rises, 400.0), outer, 10e-6)
    alone = [interface_pressure(Ring(0.0, 0.02, steel, rise, 400.0), outer, 10e-6) for rise in rises.tolist()]
    assert together.tolist() == alone and alone[0] == 0.0 < alone[-1]
    assert all(type(pressure) is float for pressure in alone)


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ({"schedule": {"time_s": [0.0, 60.0, 30.0], "speed_rpm": [0.0, 1e3, 2e3]}}, r"time_s: times must rise, but 30 s \(point 3\) follows 60 s; sort them"),
        ({"schedule": {"time_s": [5.0, 60.0], "speed_rpm": [0.0, 1e3]}}, r"time_s: begins at 5 s; give the speed and load of the start at 0"),
        ({"schedule": {"time_s": [0.0, 60.0], "speed_rpm": [0.0]}}, r"speed_rpm: 1 value for 2 times; give one value for each time"),
        ({"schedule": {"time_s": [0.0]}}, r"schedule: has neither speed nor load; give speed_rpm or load_N"),
        ({"schedule": {"time_s": [0.0, 1.0], "speed_rpm": [0.0, 0.0]}}, r"speed_rpm: the machine stands still at every time"),
        ({"schedule": {"time_s": [0.0, 1e6], "speed_rpm": [0.0, 1e3]}}, r"time_s: ends after 1e\+06 s, more than a week"),
        ({"schedule": {"time_s": [0.0, 60.0], "speed_rpm": [0.0, 20000.0]}}, r"speed_rpm: reaches 20000, above twice the reference speed of 8000 rpm"),
        ({"from_C": -58.0}, r"thermal.start.from_C = -58: the oil has 1.\de\+07 mm2/s there, above the 1e\+07 of its law; start warmer"),
        ({"from_C": 130.0}, r"thermal.start.from_C = 130: not below the ceiling of the oil, 120 C \(thermal.oil_ceiling_C\); start colder"),
        ({"from_C": 293.0}, r"thermal.start.from_C = 293"),
        ({"from_C": 400.0}, r"if 400 K are meant, write 126.9"),
        ({"housing_widths": 0.0}, r"thermal.start.housing_widths"),
        ({"shaft_widths": 1e9}, r"thermal.start.shaft_widths = 1000000000.0: must be at most 1000"),
        ({"from": 0.0}, r"thermal.start.from"),
    ],
)  # fmt: skip
def test_unit_bad_starts_are_refused(start, message):
    """Unit: one sentence with key, value and fix."""
    with pytest.raises(InputError, match=message) as refusal:
        _scene(start=start)
    assert len(refusal.value.faults) == 1


def test_unit_nothing_without_a_start(cold):
    """Unit: without the table the figures have the same bits and the modules of a start are not loaded."""
    plain = simulate(_scene(), workers=2, notice=None)
    assert plain.start is None and "start" not in plain.as_dict() and "start" not in plain.scene["thermal"]
    assert plain.figures == cold.figures and plain.temperatures_C == cold.temperatures_C
    assert plain.thermal == cold.thermal
    code = """
import sys
from doe.clearance import responses_of
from doe.study_file.study import Response
from rbdyn import Scene, plots, simulate
import tomllib
simulate(Scene.from_dict(tomllib.loads(sys.stdin.read())), workers=1, notice=None)
loaded = [name for name in sys.modules if name in ("rbdyn.thermal.start", "rbdyn.dynamics.start", "rbdyn.dynamics.parameters.start")]
print(loaded, "scipy.integrate" in sys.modules)
"""
    text = _written("NU308", "--speed", "4000", "--load", "4000", "--oil", "ISO VG 68", "--ambient", "20")
    text += "\n[numerics]\nturns = 2.0\ndiscard_turns = 1.0\nreplicates = 1\nextend = false\ncompanion = false\n"
    text += "impact_window_turns = 2.0\n"
    found = subprocess.run([sys.executable, "-c", code], input=text, capture_output=True, text=True, check=True)
    assert found.stdout.startswith("[] ")
