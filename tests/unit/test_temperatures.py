"""Roller bearings at the temperatures of their own friction: heat and energy, feedback, verdicts, bad input, nothing when off."""

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbdyn import Scene, history, simulate
from rbdyn.base.faults import InputError, RunError, read_toml
from rbdyn.dynamics.parameters.heat import heat_model, network_of
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.temperatures import Balance, heat_to_steady
from rbdyn.result import SimulationResult
from rbdyn.scene.notes import heat_notes
from rbdyn.scene.thermal import Temperatures, at_temperatures, near_of, simulated_scene
from rbdyn.scene.unknown import documented_of
from rbdyn.thermal.fixed_point import State

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = {
    "turns": 6.0, "discard_turns": 3.0, "replicates": 2, "extend": False, "companion": True,
    "impact_window_turns": 3.0,
}  # fmt: skip
SHORTER = {**SHORT, "turns": 4.0, "discard_turns": 2.0, "impact_window_turns": 2.0, "companion": False}
MOUNTING = {
    "bore_mm": 27.0, "outside_diameter_mm": 60.0, "width_mm": 16.0, "housing_diameter_mm": 90.0,
    "inner_interference_um": 10.0,
}  # fmt: skip
FLOW = {"oil": "MIL-L-7808", "oil_flow_l_min": 1.0, "oil_inlet_temperature_C": 80.0}


def _tables(**changes: dict[str, Any]) -> dict[str, Any]:
    tables = read_toml(EXAMPLES / "cylindrical_roller.toml") | {
        "lubricant": FLOW,
        "mounting": MOUNTING,
        "thermal": {},
        "numerics": SHORT,
    }
    return {name: {**tables.get(name, {}), **changes.get(name, {})} for name in {**tables, **changes}}


def _scene(**changes: dict[str, Any]) -> Scene:
    return Scene.from_dict(_tables(**changes))


@pytest.fixture(scope="module")
def hot() -> SimulationResult:
    return simulate(_scene(), workers=1, notice=None)


@pytest.fixture(scope="module")
def similar() -> SimulationResult:
    """As ``hot``, but of runs long enough to begin the search of another bearing."""
    numerics = {**SHORT, "turns": 10.0, "discard_turns": 5.0, "impact_window_turns": 5.0}
    return simulate(_scene(numerics=numerics), workers=1, notice=None)


def test_unit_heat_in_is_heat_out(hot):
    """Unit: losses and windage heat the nodes, all of it leaves, and the temperatures are those of a plain iteration."""
    balance = hot.thermal
    assert hot.status == "ok" and balance.status == "steady"
    heat = sum(balance.heat_W.values())
    assert heat == pytest.approx(sum(hot.power_terms_W.values()) + balance.windage_W, rel=1e-12)
    assert sum(balance.carried_off_W.values()) == pytest.approx(heat, rel=1e-12)
    state = balance.path_C[-1]
    assert {node: figure.value for node, figure in hot.temperatures_C.items()} == pytest.approx(state, abs=0.4)
    again = simulate(_scene(lubricant={**FLOW, "temperature_C": 130.0}), workers=1, notice=None)
    for node, figure in hot.temperatures_C.items():
        assert again.temperatures_C[node].value == pytest.approx(figure.value, abs=0.5)


def test_unit_equal_scenes_give_equal_bits(hot):
    """Unit: the number of threads does not change a bit of the figures, and the result comes back from its file."""
    again = simulate(_scene(), workers=2, notice=None)
    record, other = hot.as_dict(), again.as_dict()
    for part in (record, other):
        del part["cost"]
    assert record == other
    assert SimulationResult.from_dict(hot.as_dict()) == hot


def test_unit_figures_are_those_of_the_scene_at_its_temperatures(hot):
    """Unit: the scene with stated temperatures gives the same bits; clearances and films follow the parts."""
    plain = simulated_scene(hot)
    assert plain.thermal is None
    alone = simulate(plain, workers=1, notice=None)
    assert alone.impact_force_N == hot.impact_force_N and alone.power_loss_W == hot.power_loss_W
    assert alone.clearance_um == hot.clearance_um and alone.thermal is None
    state = hot.thermal.path_C[-1]
    films = plain.film_temperatures_C
    assert films.outer == pytest.approx(0.5 * (state["outer"] + state["rollers"]))
    assert films.inner == pytest.approx(0.5 * (state["inner"] + state["rollers"]))
    assert films.land == pytest.approx(0.5 * (state["outer"] + state["rollers"]))
    assert (films.cavity, films.pocket) == pytest.approx((state["oil"], state["rollers"]))
    motion = history(_scene(), 1.0, samples_per_turn=32, notice=None)
    assert motion.scene.thermal is None and motion.scene.lubricant.temperature_C == pytest.approx(state["oil"], abs=0.3)


def test_unit_all_films_at_one_temperature_are_those_of_the_oil():
    """Unit: parts at the temperature of the oil give the parameters of a scene without film temperatures, bit for bit."""
    parts = {f"{part}_temperature_C": 95.0 for part in ("inner_ring", "outer_ring", "roller", "cage")}
    tables = _tables(mounting={**MOUNTING, **parts}, lubricant={"oil": "MIL-L-7808", "temperature_C": 95.0})
    del tables["thermal"], tables["lubricant"]["oil_flow_l_min"], tables["lubricant"]["oil_inlet_temperature_C"]
    plain = Scene.from_dict(tables)
    tables["lubricant"] = tables["lubricant"] | {"film_temperature": "parts"}
    follows = Scene.from_dict(tables)
    for one, other in zip(roller_bearing(plain), roller_bearing(follows), strict=True):
        assert str(one) == str(other)


@pytest.mark.parametrize(("place", "power"), [("outer", "outer"), ("inner", "inner")])
def test_unit_each_film_has_its_own_temperature(place, power):
    """Unit: a warmer ring thins the film of its own race and leaves the other as it is."""
    cold = at_temperatures(_scene(), Temperatures(90.0, 90.0, 90.0, 90.0))
    warm = at_temperatures(_scene(), Temperatures(90.0, 90.0, 90.0, 90.0)._replace(**{place: 100.0}))
    other = {"outer": "inner", "inner": "outer"}[place]
    assert warm.oil(place).viscosity < 0.95 * cold.oil(place).viscosity
    assert warm.oil(other) == cold.oil(other) and warm.oil() == cold.oil() and warm.oil("pocket") == cold.oil("pocket")


def test_unit_more_flow_and_more_cooling_are_cooler(hot):
    """Unit: twice the oil, a better housing and colder oil each cool all nodes; a stated share of the flow acts like less flow."""
    usual = {node: figure.value for node, figure in hot.temperatures_C.items()}

    def nodes(**changes: dict[str, Any]) -> dict[str, float]:
        result = simulate(_scene(**changes), workers=1, notice=None)
        return {node: figure.value for node, figure in result.temperatures_C.items()}

    fraction = {"oil_fraction_factor": 2.0**-0.37}  # of twice the flow, so that drag stays as it is
    for cooler in (
        nodes(lubricant={**FLOW, "oil_flow_l_min": 2.0, **fraction}),
        nodes(thermal={"housing_factor": 5.0, "shaft_factor": 2.5}),
        nodes(lubricant={**FLOW, "oil_inlet_temperature_C": 70.0}),
    ):
        assert all(cooler[node] < usual[node] - 0.5 for node in usual)
    hotter = nodes(thermal={"oil_share": 0.5})
    assert all(hotter[node] > usual[node] + 2.0 for node in usual)


def test_unit_a_polymer_cage_that_grows_into_its_land_is_a_verdict():
    """Unit: a PEEK cage with room when cold, whose own heat closes its guide: seizure, with the last state, exit as a failure."""
    scene = _scene(
        materials={"cage": "peek"},
        cage={"guide_clearance_mm": 0.17, "mass_g": 7.0},
        lubricant={**FLOW, "oil_inlet_temperature_C": 75.0},
    )
    result = simulate(scene, workers=1, notice=None)
    assert result.status == "seizure" == result.thermal.status
    assert (
        "the cage seizes" in result.thermal.reason
        and result.notes[0].startswith("seizure: ")
        and result.notes[0].code == "seizure"
    )
    assert result.temperatures_C["oil"].error is None
    assert result.clearance_um["guide"]["operating"] > 6.0
    # A run that only a steady state is asked of ends with the same words before its first run of full length.
    long = list[tuple[int, int]]()
    with pytest.raises(RunError) as caught:
        simulate(scene, 1, lambda done, total: long.append((done, total)), notice=None, only_steady=True)
    assert str(caught.value) == f"{result.status}: {result.thermal.reason}" and not long


def test_unit_above_a_ceiling():
    """Unit: oil above its ceiling is a status of its own, with figures."""
    result = simulate(_scene(thermal={"oil_ceiling_C": 85.0}), workers=1, notice=None)
    assert result.status == "too hot" and "thermal.oil_ceiling_C" in result.thermal.reason
    assert result.temperatures_C["oil"].value > 85.0


def test_unit_a_cage_too_hot_by_default_of_its_material():
    """Unit: the ceiling of PEEK counts without a key; that of a metal does not exist."""
    changes = {
        "materials": {"cage": "peek"},
        "cage": {"guidance": "roller", "mass_g": 7.0, "pocket_radial_clearance_mm": 0.6},
    }
    result = simulate(_scene(**changes, thermal={"cage_offset_K": 60.0}), workers=1, notice=None)
    assert result.status == "too hot" and "thermal.cage_ceiling_C" in result.thermal.reason


BATH = {"oil": "MIL-L-7808", "supply": "bath"}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"lubricant": {"oil": "MIL-L-7808"}}, r"\[thermal\]: needs lubricant.oil_flow_l_min without lubricant.supply"),
        ({"lubricant": {"oil": "MIL-L-7808", "supply": "jet"}}, r"\[thermal\]: needs lubricant.oil_flow_l_min with"),
        ({"lubricant": {"oil": "MIL-L-7808", "oil_flow_l_min": 1.0}}, "lubricant.oil_inlet_temperature_C: missing"),
        (
            {"lubricant": BATH, "thermal": {"housing_factor": 0.0, "shaft_factor": 0.0, "sump_factor": 0.0}},
            "thermal.housing_factor = 0 and thermal.shaft_factor = 0: leave the heat no way out",
        ),
        ({"thermal": {"oil_ceiling_C": 80.0}}, "oil_ceiling_C = 80: not above lubricant.oil_inlet_temperature_C = 80"),
        ({"thermal": {"cage_ceiling_C": 60.0}}, "thermal.cage_ceiling_C = 60: not above"),
        ({"mounting": {**MOUNTING, "inner_ring_temperature_C": 90.0}}, "inner_ring_temperature_C = 90: the heat"),
        ({"lubricant": {**FLOW, "oil_fraction": 0.05}}, "oil_fraction = 0.05: contradicts lubricant.oil_flow_l_min"),
        ({"lubricant": {**BATH, "oil_inlet_temperature_C": 40.0}}, "has no effect without lubricant.oil_flow_l_min"),
        ({"lubricant": {**FLOW, "viscosity_mPas": 3.0}}, "lubricant.temperature_C: missing"),
        ({"lubricant": {**FLOW, "oil_inlet_temperature_C": 293.15}}, "not below 200, .*; if 293.15 K are meant"),
        ({"lubricant": BATH, "thermal": {"ambient_C": 293}}, "thermal.ambient_C = 293: not below 200"),
        ({"thermal": {"oil_ceiling_C": 423}}, "thermal.oil_ceiling_C = 423: must be at most 350; if 423 K are meant"),
        ({"lubricant": {**FLOW, "supply": "grease"}}, "oil_flow_l_min = 1: contradicts lubricant.supply = 'grease'"),
        ({"mounting": {**MOUNTING, "width_mm": 4.0}}, "mounting.width_mm = 4: less than 5 mm of its rolling elements"),
        ({"thermal": {"surface_factor": -1.0}}, "thermal.surface_factor = -1.0: must be greater than 0"),
        ({"thermal": {"surfaces": 1.0}}, "did you mean surface_factor"),
        ({"operation": {"schedule": {"time_s": [0.0, 1.0], "radial_load_N": [1.0, 2.0]}}}, "operation.schedule: "),
    ],
)
def test_unit_bad_input_is_a_sentence(changes, sentence):
    """Unit: each contradiction of the heat balance names the key and the fix."""
    tables = _tables()
    for table, keys in changes.items():
        tables[table] = keys if table in ("lubricant", "mounting") else {**tables.get(table, {}), **keys}
    with pytest.raises(InputError, match=sentence) as error:
        Scene.from_dict(tables)
    assert all(len(fault) < 300 for fault in error.value.faults)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, "one"])
def test_unit_a_bad_flow_is_one_sentence(value):
    """Unit: a bad value of the flow is not reported as a missing flow as well."""
    with pytest.raises(InputError) as error:
        _scene(lubricant={"oil_flow_l_min": value})
    (fault,) = error.value.faults
    assert "lubricant.oil_flow_l_min = " in fault


def test_unit_a_bad_table_of_heat_is_one_sentence():
    """Unit: a table of heat that is none does not make the oil's temperature missing."""
    with pytest.raises(InputError) as error:
        Scene.from_dict({**_tables(), "thermal": "yes"})
    (fault,) = error.value.faults
    assert "thermal = 'yes': must be a table" in fault


def test_unit_films_of_parts_need_the_temperatures_of_the_rings():
    """Unit: without them the films would silently be as cold as the drawing."""
    tables = _tables(
        mounting={"outer_ring_temperature_C": 90.0}, lubricant={"temperature_C": 95.0, "film_temperature": "parts"}
    )
    del tables["thermal"]
    with pytest.raises(InputError, match=r"'parts': needs mounting.inner_ring_temperature_C, or the films"):
        Scene.from_dict(tables)


def test_unit_notes_on_units_of_a_heat_balance():
    """Unit: surroundings in kelvin, a flow in mL/min and a width far above the diameter are notes; usual values are none."""

    def notes(**changes: dict[str, Any]) -> tuple[str, ...]:
        scene = _scene(**changes)
        assert scene.thermal is not None and scene.mounting is not None and scene.mounting.width is not None
        return heat_notes(scene.thermal, scene.lubricant, scene.mounting, scene.mounting.width)

    assert notes() == ()
    (kelvin,) = notes(thermal={"ambient_C": 293.15})
    assert kelvin.endswith("if 293.15 K are meant, write 20")
    (flow,) = notes(lubricant={"oil_flow_l_min": 1000.0})
    assert flow.endswith("if 1000 mL/min are meant, write 1")
    assert any(note.startswith("mounting.width_mm = 1600: ") for note in notes(mounting={"width_mm": 1600.0}))


def test_unit_a_balance_without_mounting_or_width_is_a_sentence():
    """Unit: [thermal] needs the sizes of the seats."""
    tables = _tables()
    del tables["mounting"]
    with pytest.raises(InputError, match=r"\[thermal\]: needs \[mounting\]"):
        Scene.from_dict(tables)
    tables = _tables()
    del tables["mounting"]["width_mm"]
    with pytest.raises(InputError, match=r"mounting.width_mm: missing"):
        Scene.from_dict(tables)


def test_unit_unknown_inputs_of_a_balance():
    """Unit: the weak conductances are unknown inputs, and what the balance computes is none."""
    keys = {entry.key for entry in documented_of(_scene())}
    weak = {
        f"thermal.{name}"
        for name in (
            "surface_factor",
            "housing_factor",
            "shaft_factor",
            "film_share_to_oil",
            "contact_factor",
            "oil_share",
        )
    }
    assert weak | {"lubricant.oil_fraction_factor"} <= keys
    assert not {key for key in keys if key.startswith("mounting.") and key.endswith("temperature_C")}
    assert not keys & {"lubricant.temperature_C", "lubricant.oil_fraction"}


def test_unit_a_flow_gives_the_oil_fraction():
    """Unit: 8.8 % for 1 L/min scaled by its factor, and not saved, because another speed has another."""
    scene = _scene()
    assert scene.lubricant.oil_fraction == pytest.approx(0.088, abs=0.0005)
    assert _scene(lubricant={**FLOW, "oil_fraction_factor": 0.6}).lubricant.oil_fraction == pytest.approx(
        0.0528, abs=0.0003
    )
    dump = scene.model_dump(mode="json")
    assert "oil_fraction" not in dump["lubricant"] and Scene.from_dict(dump) == scene
    slower = scene.changed({"operation.inner_speed_rpm": 20000.0})
    assert slower.lubricant.oil_fraction == pytest.approx(1.2 * scene.lubricant.oil_fraction)


def test_unit_ranges_hold_what_inputs_leave_open(hot):
    """Unit: the range of each temperature holds its value, and a stated factor is exact and narrows it."""
    ranges, state = hot.thermal.ranges.figures, {node: figure.value for node, figure in hot.temperatures_C.items()}
    assert list(ranges) == [*state, "inner_minus_outer_K", "radial_um", "guide_um", "pocket_um"]
    for node, value in state.items():
        assert ranges[node][0] <= value <= ranges[node][-1] and ranges[node][-1] - ranges[node][0] > 5.0
    for play in ("guide", "pocket"):
        assert ranges[f"{play}_um"][0] < hot.clearance_um[play]["operating"] < ranges[f"{play}_um"][-1]
    keys = ("surface_factor", "housing_factor", "shaft_factor", "contact_factor", "oil_share")
    exact = {**dict.fromkeys(keys, 1.0), "film_share_to_oil": 0.3, "shaft_lag": 0.125, "cage_offset_K": 0.0}
    levels = {"model": {"rolling_resistance_factor": 1.0}}
    alone = simulate(_scene(thermal=exact, **levels), workers=1, notice=None)
    stated = alone.thermal
    assert stated.ranges.inputs == () and all(low == high for low, _, high in stated.ranges.figures.values())
    for node, figure in alone.temperatures_C.items():
        assert stated.ranges.figures[node][1] == pytest.approx(figure.value, abs=1e-3)
    assert stated.ranges.figures["guide_um"][1] == pytest.approx(alone.clearance_um["guide"]["operating"], abs=0.05)


def test_unit_a_scene_without_a_balance_loads_nothing_of_it():
    """Unit: neither rbdyn.thermal nor the loop is imported, and no key is saved."""
    code = (
        "import sys\nfrom rbdyn import Scene, simulate\n"
        f"scene = Scene.load({str(EXAMPLES / 'cylindrical_roller.toml')!r}, ['numerics.turns=2', 'numerics.discard_turns=1'])\n"
        "result = simulate(scene.changed({'numerics.replicates': 1, 'numerics.extend': False}), 1, notice=None)\n"
        "assert 'thermal' not in result.scene and 'temperatures_C' not in result.as_dict()\n"
        "print([name for name in sys.modules if name.startswith(('rbdyn.thermal', 'rbdyn.dynamics.temperatures'))])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"


def test_unit_errors_of_temperatures_are_those_of_the_heat(hot):
    """Unit: the error of the oil's temperature is about that of the loss over the conductance of its flow."""
    loss, oil = hot.power_loss_W, hot.temperatures_C["oil"]
    flow = hot.thermal.conductances_W_K["flow"]
    assert oil.statistical_error == pytest.approx(loss.statistical_error / flow, rel=0.5)
    assert oil.numerical_error is not None and math.isfinite(oil.numerical_error)
    assert np.isfinite([figure.error for figure in hot.temperatures_C.values()]).all()


def test_unit_heat_without_a_way_out_is_too_hot():
    """Unit: constant heat that would need more than 350 C has no gain of one, so it is too hot; no note takes 350 C for kelvin."""
    ways = {"housing_factor": 0.0, "shaft_factor": 0.0}
    result = simulate(_scene(lubricant={"oil_flow_l_min": 1e-3}, thermal=ways), workers=1, notice=None)
    assert result.status == "too hot" and "beyond 350 C" in result.thermal.reason and result.thermal.gain < 1.0
    assert not any(" K are meant" in note for note in result.notes)


def test_unit_a_run_that_does_not_close_is_undecided(monkeypatch):
    """Unit: where no run of full length closes the balance, the temperatures are undecided, without errors, and the reason says so."""
    from rbdyn.dynamics import temperatures

    monkeypatch.setattr(temperatures, "MOST_WHOLE_RUNS", 1)
    monkeypatch.setattr(temperatures, "corrected", lambda state, slopes: state.temperatures + 5.0)
    result = simulate(_scene(), workers=1, notice=None)
    assert result.status == "undecided" == result.thermal.status and result.thermal.ranges.figures is None
    assert "move by 5 K" in result.thermal.reason and "numerics.turns" in result.thermal.reason
    assert all(figure.statistical_error is None for figure in result.temperatures_C.values())


@pytest.mark.parametrize(
    ("oil", "inlet"), [("MIL-L-7808", -60.0), ("MIL-L-23699", -30.0), ("ISO VG 32", -20.0), ("ISO VG 460", 0.0)]
)
def test_unit_a_cold_start_is_steady(oil, inlet):
    """Unit: cold oil has one stable state, warmer than its inlet; the search finds it, whatever the first guess, with a gain below one."""
    changes = {"lubricant": {**FLOW, "oil": oil, "oil_inlet_temperature_C": inlet}, "thermal": {"ambient_C": inlet}}
    # Traction and method that other tests compile: those of these oils, and the choice of a method, would be for this one alone.
    changes["traction"] = {"model": "four_constant"}
    found = simulate(_scene(**changes, numerics=SHORTER), workers=1, notice=None)
    assert found.status == "ok" and found.thermal.gain < 0.7
    assert min(figure.value - (figure.error or 0.0) for figure in found.temperatures_C.values()) > inlet
    assert all(min(state.values()) >= inlet - 1e-9 for state in found.thermal.path_C[1:])
    heat = sum(found.thermal.heat_W.values())
    assert sum(found.thermal.carried_off_W.values()) == pytest.approx(heat, rel=1e-9)


def test_unit_ranges_follow_the_exponents_that_the_search_found():
    """Unit: ranges of a cold start, far wider than its steps, rest on what its path showed of viscosity, and none is without end."""
    cold = {
        "lubricant": {**FLOW, "oil": "MIL-L-7808", "oil_inlet_temperature_C": -60.0},
        "thermal": {"ambient_C": -60.0},
    }
    found = simulate(_scene(**cold, numerics=SHORTER), workers=1, notice=None)
    assert found.thermal.ranges.unsteady == 0.0
    assert found.thermal.ranges.figures["inner"][-1] < found.temperatures_C["inner"].value + 75.0


def test_unit_ways_out_of_a_bath():
    """Unit: a sump cools the oil and is one of the ways out; a shaft that carries off less warms the inner ring over the outer one."""

    def nodes(**thermal: float) -> tuple[dict[str, float], dict[str, float]]:
        tables = _tables(thermal=thermal) | {"lubricant": BATH}
        tables["numerics"] |= {"turns": 4.0, "discard_turns": 2.0, "impact_window_turns": 2.0}
        result = simulate(Scene.from_dict(tables), workers=1, notice=None)
        return {node: figure.value for node, figure in result.temperatures_C.items()}, result.thermal.carried_off_W

    with_sump, ways = nodes()
    without, dry = nodes(sump_factor=0.0)
    assert ways["sump"] > 0.0 == dry["sump"] and with_sump["oil"] < without["oil"] - 2.0
    lagged, _ = nodes(shaft_factor=0.2)
    assert lagged["inner"] - lagged["outer"] > with_sump["inner"] - with_sump["outer"] + 1.0


def test_unit_slight_heat_takes_one_short_state(monkeypatch):
    """Unit: heat that warms no node by 1 K needs one short state, and gives the temperatures of the whole search in less work."""
    from rbdyn.dynamics.temperatures import Balance

    slow = _scene(operation={"inner_speed_rpm": 500.0}, numerics=SHORTER)
    found = simulate(slow, workers=1, notice=None)
    assert found.status == "ok" and found.cost["states"] == 3
    monkeypatch.setattr(Balance, "slight", lambda balance, state: None)
    searched = simulate(slow, workers=1, notice=None)
    assert found.cost["rhs_evaluations"] < 0.8 * searched.cost["rhs_evaluations"]
    for node, figure in found.temperatures_C.items():
        assert figure.value == pytest.approx(searched.temperatures_C[node].value, abs=0.2)


def _near(result: SimulationResult, **changes: Any) -> dict[str, Any]:
    """The balance of a result as that of a similar bearing."""
    near = near_of(result)
    assert near is not None
    return near.model_dump() | changes


@pytest.mark.parametrize(("discarded", "needed"), [(7.0, 7.0), (20.0, 23.0)])
def test_unit_a_search_from_a_similar_bearing_needs_no_turn_of_its_own(similar, discarded, needed):
    """Unit: it finds the same temperatures and figures within their errors, in the turns of the transient, by any number of threads; a slow one goes on."""
    numerics = {**SHORT, "turns": 20.0, "discard_turns": discarded, "companion": False, "impact_window_turns": 5.0}
    changes = {"numerics": numerics, "bearing": {"radial_clearance_mm": 0.024}, "cage": {"guide_clearance_mm": 0.18}}
    far = simulate(_scene(**changes), workers=1, notice=None)
    near = simulate(_scene(**changes, thermal={"near": _near(similar)}), workers=1, notice=None)
    assert near.status == "ok" and near.thermal.status == "steady"
    turns = numerics["replicates"] * (needed + numerics["turns"])
    assert near.cost["turns"] == pytest.approx(turns) and near.cost["turns"] < 0.5 * far.cost["turns"]
    for node, figure in far.temperatures_C.items():
        other = near.temperatures_C[node]
        assert abs(other.value - figure.value) <= 1.5 * math.hypot(figure.error, other.error) + 0.02
    assert near.power_loss_W.value == pytest.approx(far.power_loss_W.value, rel=3e-3)
    again = simulate(_scene(**changes, thermal={"near": _near(similar)}), workers=2, notice=None)
    records = [result.as_dict() for result in (near, again)]
    for record in records:
        del record["cost"]
    assert records[0] == records[1]


@pytest.mark.parametrize("changes", [{"temperatures_C": [20.0] * 4}, {"slopes": (0.9 * np.eye(4)).tolist()}])
def test_unit_a_search_from_another_bearing_begins_anew(hot, changes):
    """Unit: far temperatures, or a loop near its stability, give the bits of a search without them, but for the steady loss."""
    far = simulate(_scene(), workers=1, notice=None)
    near = simulate(_scene(thermal={"near": _near(hot, **changes)}), workers=1, notice=None)
    assert near.temperatures_C == far.temperatures_C and near.impact_force_N == far.impact_force_N
    assert near.cost["turns"] > far.cost["turns"] and near.thermal.slopes == far.thermal.slopes
    assert near.power_loss_W.value == pytest.approx(far.power_loss_W.value, rel=2e-3)


def test_unit_the_heat_of_the_steady_state_is_exact_where_it_is_linear(hot):
    """Unit: with heat that is linear in the temperatures, a state next to the steady one gives the heat of the steady one."""
    balance = Balance(_scene(), None)
    bearing = roller_bearing(simulated_scene(hot))
    network = network_of(simulated_scene(hot), balance.thermal, bearing)
    nodes, powers = np.array([90.0, 92.0, 95.0, 99.0]), np.full(network.weights.shape[1], 20.0)
    model = heat_model(simulated_scene(hot), network, nodes, powers, balance.viscosity)
    residue = np.array([[-0.4, 0.1, 0.0, -0.2], [0.2, -0.6, 0.3, 0.0], [0.1, 0.2, -0.5, -0.1], [0.0, -0.3, 0.2, -0.2]])
    linear = model._replace(
        losses=model.losses._replace(exponents=np.zeros_like(model.losses.exponents)), residue=residue
    )
    slopes = linear.image_slopes(nodes)
    state = State(nodes, nodes + np.linalg.solve(linear.matrix, linear.excess(nodes)), np.zeros(4), linear)
    steady = linear.balanced()
    assert np.abs(steady - nodes).max() > 1.0
    more = float((linear.heat(steady) - linear.heat(nodes)).sum())
    assert heat_to_steady(state, slopes) == pytest.approx(more, rel=1e-9)
