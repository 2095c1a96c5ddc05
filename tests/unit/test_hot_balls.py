"""Heat balance of a row of balls: the fixed point and its gain, runaway, verdicts, and what a scene with it refuses."""

import json
import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from conftest import ROOT
from in_process import in_process

import rbdyn
from rbdyn.base.faults import InputError
from rbdyn.base.notes import Level
from rbdyn.quasistatic.row.model import row_of
from rbdyn.quasistatic.sweep import sweep
from rbdyn.quasistatic.temperatures import at_temperatures, balance, heat_at, slopes_at, steady_temperatures
from rbdyn.scene import Scene
from rbdyn.scene.input_ranges import QUANTILES, SETS, input_sets
from rbdyn.scene.operation import raceway_radii
from rbdyn.scene.thermal import Temperatures
from rbdyn.thermal.losses import gain
from rbdyn.thermal.network import NODES

EXAMPLE = ROOT / "examples" / "hot_ball.toml"
PLAIN = ROOT / "examples" / "deep_groove_ball.toml"
# A housing that hardly expands takes the clearance of a bearing that warms.
RIGID = {"elastic_modulus_GPa": 141.0, "poisson_ratio": 0.3, "density_kg_m3": 8100.0, "thermal_expansion_1e_6_K": 1.3}
DEEP = {
    "bearing": {
        "kind": "deep_groove_ball", "balls": 9, "ball_diameter_mm": 11.906, "pitch_diameter_mm": 60.0, "radial_clearance_mm": 0.012,
        "inner_groove_factor": 0.52, "outer_groove_factor": 0.53,
    },
    "lubricant": {"oil": "ISO VG 32", "supply": "bath"},
    "mounting": {
        "bore_mm": 40.0, "outside_diameter_mm": 80.0, "width_mm": 18.0, "housing_diameter_mm": 120.0, "inner_interference_um": 15.0,
    },
    "thermal": {"ambient_C": 20.0},
    "operation": {"inner_speed_rpm": 6000.0, "radial_load_N": 1000.0},
}  # fmt: skip
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


def scene_of(tables, **changes):
    """A scene of these tables with other values under dotted keys, "__" for the dot."""
    scene = Scene.from_dict(tables)
    return scene.changed({key.replace("__", "."): value for key, value in changes.items()}) if changes else scene


def stated(scene, nodes):
    """The scene with the temperatures of its nodes as a user would state them."""
    tables = scene.model_dump(mode="json", exclude_none=True)
    shaft = nodes["inner"] - 0.125 * (nodes["inner"] - scene.thermal.ambient_C)
    parts = {"inner_ring": nodes["inner"], "outer_ring": nodes["outer"], "roller": nodes["rollers"], "shaft": shaft,
             "housing": nodes["outer"]}  # fmt: skip
    tables["mounting"] |= {f"{part}_temperature_C": value for part, value in parts.items()}
    tables["lubricant"] |= {"temperature_C": nodes["oil"], "film_temperature": "parts"}
    del tables["thermal"]
    return Scene.from_dict(tables)


@pytest.mark.parametrize(
    "tables", [DEEP, SPINDLE, tomllib.loads(EXAMPLE.read_text())], ids=["deep", "spindle", "example"]
)
def test_invariant_steady_temperatures(tables):
    """Invariant: heat in equals friction and heat out, from any first guess to 1e-8 K; the equilibrium is that of stated temperatures."""
    scene = scene_of(tables)
    result = rbdyn.equilibrium(scene)
    record = result.thermal
    assert result.status == "ok" and record.status == "steady" and record.gain < 1.0
    heat, friction = sum(record.heat_W.values()), sum(record.friction_W.values())
    assert heat == pytest.approx(friction, rel=1e-12)
    assert sum(record.carried_off_W.values()) == pytest.approx(heat, rel=1e-12)
    assert record.path_heat_W[-1] == pytest.approx(heat, rel=1e-9)
    nodes = np.array(list(result.temperatures_C.values()))
    assert np.abs(balance(scene, nodes).deviation).max() <= 1e-9
    for guess in (-10.0, 140.0):
        other = steady_temperatures(scene.changed({"lubricant.temperature_C": guess}))
        assert other.last.temperatures == pytest.approx(nodes, abs=1e-8)
    same = rbdyn.equilibrium(stated(scene, result.temperatures_C))
    assert same.report.balls == result.report.balls and same.report.contacts == result.report.contacts
    assert same.thermal is None and "thermal" not in same.as_dict() and "temperatures_C" not in same.as_dict()
    ranges = record.ranges.figures
    assert list(ranges) == [*NODES, "inner_minus_outer_K", "radial_um"]
    for node in NODES:
        assert ranges[node][0] < result.temperatures_C[node] < ranges[node][-1]
    assert ranges["radial_um"][0] < record.clearance_um["operating"] < ranges["radial_um"][-1]


def test_example_preload_grows_with_the_heat():
    """Example: the fixed preload of the 7208 B is 1.87 kN with parts at 20 C and 3.07 kN at its steady temperatures."""
    hot, tables = Scene.load(EXAMPLE), tomllib.loads(EXAMPLE.read_text())
    del tables["thermal"]
    warm = rbdyn.equilibrium(hot)
    assert warm.reaction.load_N["z"] == pytest.approx(3069.0, rel=2e-3)
    assert warm.thermal.gain == pytest.approx(0.0112, abs=5e-4)
    assert [warm.temperatures_C[node] for node in NODES] == pytest.approx([52.4, 61.3, 75.6, 76.6], abs=0.1)
    cold = rbdyn.equilibrium(Scene.from_dict(tables))
    assert cold.reaction.load_N["z"] == pytest.approx(1872.0, rel=2e-3)
    assert [cold.life.L10_h, warm.life.L10_h] == pytest.approx([64.6e3, 16.5e3], rel=0.01)


def test_unit_gain_is_that_of_the_iteration():
    """Unit: plain iteration of the map shrinks a disturbance by the largest eigenvalue of the slopes, whose real part is the gain."""
    scene = scene_of(DEEP, mounting__housing_material=RIGID, operation__inner_speed_rpm=7000.0)
    search = steady_temperatures(scene)
    slopes = search.slopes
    assert search.status == "steady" and 0.1 < gain(slopes) < 1.0
    eigenvalues = np.linalg.eigvals(slopes)
    largest = eigenvalues[np.abs(eigenvalues).argmax()]
    fixed, disturbance = search.last.temperatures, np.full(4, 1e-2)
    for _ in range(12):
        ratio = balance(scene, fixed + disturbance).image - fixed
        growth, disturbance = (
            float(ratio @ disturbance / (disturbance @ disturbance)),
            ratio * 1e-2 / np.abs(ratio).max(),
        )
    assert growth == pytest.approx(largest.real, rel=0.02)


@pytest.mark.parametrize(
    ("tables", "fast"), [(DEEP, 8000.0), (SPINDLE, 8000.0)], ids=["lost clearance", "fixed preload"]
)
def test_unit_runaway_without_a_way_to_expand(tables, fast):
    """Unit: in a housing that cannot expand, lost clearance or fixed preload ends as no steady state with its path; in steel it is steady."""
    rigid = scene_of(tables, mounting__housing_material=RIGID, operation__inner_speed_rpm=fast)
    result = rbdyn.equilibrium(rigid)
    record = result.thermal
    assert result.status.startswith("no steady state: ") and record.status == "no steady state" and record.gain >= 1.0
    assert result.report is None and not result.is_equilibrium and "thermal loop gain" in record.reason
    inner, clearance = [state["inner"] for state in record.path_C], record.path_clearance_um
    assert inner == sorted(inner) and clearance == sorted(clearance, reverse=True)
    assert record.path_heat_W[-1] > 2.0 * record.path_heat_W[-4] > 0.0
    assert rbdyn.equilibrium(scene_of(tables, operation__inner_speed_rpm=fast)).status == "ok"


def test_unit_gain_reaches_one_at_the_last_steady_speed():
    """Unit: the speeds with a steady state end where the gain is 1, as at a fold."""
    low, high = 6000.0, 8000.0
    while high - low > 1.0:
        middle = 0.5 * (low + high)
        search = steady_temperatures(
            scene_of(DEEP, mounting__housing_material=RIGID, operation__inner_speed_rpm=middle)
        )
        if search.status == "steady":
            low, last = middle, gain(search.slopes)
        else:
            high = middle
    assert 0.85 < last < 1.0


def test_unit_limits_of_the_network():
    """Unit: a great flow keeps all parts at its inlet; without friction all are at the ambient."""
    flood = scene_of(
        DEEP, lubricant__oil_flow_l_min=1e4, lubricant__oil_inlet_temperature_C=50.0, thermal__surface_factor=1e4
    )
    assert list(rbdyn.equilibrium(flood).temperatures_C.values()) == pytest.approx([50.0] * 4, abs=0.05)
    idle = scene_of(DEEP, operation__radial_load_N=0.0, bearing__radial_clearance_mm=0.08)
    result = rbdyn.equilibrium(idle)
    assert list(result.temperatures_C.values()) == pytest.approx([20.0] * 4, abs=1e-4)
    assert 0.0 <= sum(result.thermal.friction_W.values()) < 1e-4


def test_unit_heat_by_effusivity():
    """Unit: steel balls take half of the sliding heat; a ring of silicon nitride takes less than its steel ball."""
    steel, nodes = scene_of(DEEP, thermal__film_share_to_oil=0.5), np.full(4, 50.0)
    mixed = scene_of(DEEP, thermal__film_share_to_oil=0.5, materials__outer_ring="silicon_nitride")
    for scene, share in ((steel, 0.5), (mixed, 6595.0 / (6595.0 + 13008.0))):
        found = heat_at(scene, nodes)
        speed = 6000.0 * np.pi / 30.0
        rolling, sliding = (0.5 * speed * moment for moment in found.moments)
        assert found.heat[NODES.index("outer")] == pytest.approx(0.25 * rolling + share * sliding, rel=1e-3)
        assert found.heat.sum() == pytest.approx(2.0 * (rolling + sliding))


def test_unit_a_first_guess_is_no_axis_of_a_sweep():
    """Unit: the oil's temperature is computed, so a sweep over it is refused; a stated viscosity holds at it, so it counts there."""
    with pytest.raises(InputError, match=r"lubricant\.temperature_C: is a first guess alone"):
        sweep(scene_of(DEEP), {"lubricant.temperature_C": [40.0, 80.0]})
    stated_viscosity = scene_of(DEEP, lubricant__temperature_C=40.0, lubricant__viscosity_mPas=30.0)
    assert len(sweep(stated_viscosity, {"lubricant.temperature_C": [40.0, 60.0]}).statuses) == 2


def test_unit_a_lost_clearance_is_a_preload_with_its_causes():
    """Literature: a slight preload may even serve balls (SKF, bearing clearance), so it is a warning; free rings grow by heat alone."""
    parts = {"outer": 50.0, "inner": 60.0, "rollers": 65.0, "oil": 50.0}
    tight, free = (
        stated(
            scene_of(
                DEEP, bearing__radial_clearance_mm=drawn, mounting__inner_interference_um=fit, mounting__rotation=turns
            ),
            parts,
        )
        for drawn, fit, turns in ((0.012, 15.0, True), (0.005, -50.0, False))
    )
    (note,) = rbdyn.equilibrium(tight, ranges=False).notes[:1]
    assert (note.level, note.code) == (Level.WARNING, "clearance") and "results include this preload" in note
    found, drawn, *causes = (float(number) for number in re.findall(r"(-?\+?\d+\.\d) ?(?:um|,)", note))
    assert found == pytest.approx(drawn + sum(causes), abs=0.21) and drawn == 12.0 and -15.0 < causes[0] < -10.0
    (free_note,) = rbdyn.equilibrium(free, ranges=False).notes[:1]
    inner, outer = (1e3 * 2.0 * radius for radius in raceway_radii(free.bearing))
    grown = 1e3 * free.material("ball").thermal_expansion * (outer * 30.0 - inner * 40.0 - 2.0 * 11.906 * 45.0)
    assert f"fits +0.0, temperature {grown:+.1f}, rotation +0.0 um" in free_note


def test_unit_too_hot_and_seizure():
    """Unit: oil above its ceiling is too hot, with its temperatures; a bearing overloaded when cold has seized; neither raises."""
    hot = rbdyn.equilibrium(scene_of(DEEP, thermal__oil_ceiling_C=30.0))
    assert (
        hot.status.startswith("too hot: the oil reaches ") and hot.temperatures_C["oil"] > 30.0 and hot.report is None
    )
    seized = rbdyn.equilibrium(scene_of(SPINDLE, operation__preload_um=1500.0))
    assert seized.status.startswith("seizure: ") and seized.thermal.gain is None and not seized.is_equilibrium


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lubricant.supply": None}, "[thermal]: needs lubricant.oil_flow_l_min without lubricant.supply; give it, or a supply of bath"),
        ({"lubricant.supply": "jet"}, "[thermal]: needs lubricant.oil_flow_l_min with lubricant.supply = 'jet'"),
        ({"lubricant.oil_flow_l_min": 0.5}, "lubricant.oil_inlet_temperature_C: missing"),
        ({"mounting.inner_ring_temperature_C": 60.0}, "mounting.inner_ring_temperature_C = 60: the heat balance"),
        ({"mounting": None}, "[thermal]: needs [mounting]"),
        ({"mounting.width_mm": None}, "mounting.width_mm: missing"),
        ({"thermal.oil_ceiling_C": 15.0}, "thermal.oil_ceiling_C = 15: not above thermal.ambient_C = 20"),
        ({"thermal.housing_factor": 0.0, "thermal.shaft_factor": 0.0, "thermal.sump_factor": 0.0}, "thermal.housing_factor = 0 and thermal.shaft_factor = 0: leave"),
        ({"thermal.cage_offset_K": 5.0}, "thermal.cage_offset_K = 5: the model of ball bearings has no cage"),
        ({"thermal.near": {"temperatures_C": [70.0] * 4, "slopes": [[0.0] * 4] * 4}}, "[thermal.near]: shortens simulations of rollers"),
        ({"thermal.cage_ceiling_C": 90.0}, "thermal.cage_ceiling_C = 90: the model of ball bearings has no cage"),
        ({"lubricant": None}, "lubricant: missing, but [thermal] needs its viscosity"),
        ({"operation.inner_speed_rpm": 0.0}, "operation.inner_speed_rpm = 0: [thermal] needs rings that turn"),
        ({"mounting.width_mm": 1.8}, "mounting.width_mm = 1.8: less than 11.906 mm of its rolling elements"),
        ({"thermal.ambient_C": 293.15}, "thermal.ambient_C = 293.15: not below 120, the usual ceiling of ISO VG 32; if 293.15 K"),
        ({"errors": {}}, "[thermal] and [errors]: runout is computed at stated temperatures"),
    ],
)  # fmt: skip
def test_unit_contradictions_are_one_sentence_each(changes, words):
    """Unit: one sentence with the key and what to do."""
    tables = json.loads(json.dumps(DEEP))
    for key, value in changes.items():
        table, _, name = key.partition(".")
        holder, entry = (tables.setdefault(table, {}), name) if name else (tables, table)
        holder.pop(entry, None) if value is None else holder.update({entry: value})
    with pytest.raises(InputError) as refused:
        Scene.from_dict(tables)
    (fault,) = refused.value.faults
    assert fault.removeprefix("scene: ").startswith(words)


def test_unit_oil_too_thick_for_the_friction_model_is_a_note():
    """Unit: where SKF's starvation factor removes the rolling friction of cold oil, a note says so; warm oil has none."""
    cold = rbdyn.equilibrium(
        scene_of(DEEP, lubricant__oil="ISO VG 460", lubricant__supply="oil_air", thermal__ambient_C=-40.0)
    )
    assert cold.thermal.friction_W["rolling"] < 1.0
    assert any("starvation factor" in note for note in cold.notes)
    assert not any("starvation factor" in note for note in rbdyn.equilibrium(scene_of(DEEP)).notes)


def test_unit_two_rows_and_other_studies_refuse():
    """Unit: two rows and studies at stated temperatures are one sentence."""
    tables = tomllib.loads((ROOT / "examples" / "double_decker.toml").read_text())
    with pytest.raises(InputError, match=r"\[thermal\]: balances the heat of a single row of balls"):
        Scene.from_dict({**tables, "thermal": {}})
    with pytest.raises(InputError, match=r"\[thermal\]: is for the equilibrium and for --sweep alone"):
        row_of(scene_of(DEEP))
    done = in_process("rbdyn", "ball", EXAMPLE, "--clearance", "1:20:5")
    assert done.returncode == 2 and done.stderr.startswith("--clearance: is a study at stated temperatures")


def test_unit_sweep_over_a_runaway():
    """Unit: a sweep has temperatures, gain and friction by point, the same as single equilibria; runaway is a failed point."""
    rigid = scene_of(DEEP, mounting__housing_material=RIGID)
    swept = sweep(rigid, {"operation.inner_speed_rpm": [2000.0, 6000.0, 8000.0]})
    # At 6000 rpm most of the input sets of its ranges run away too, which takes long to find.
    alone = rbdyn.equilibrium(rigid.changed({"operation.inner_speed_rpm": 2000.0}))
    assert swept.failures == {"no steady state": [2]} and swept.statuses[:2] == ("ok", "ok")
    for node in NODES:
        assert swept.columns[f"{node}_temperature_C"][0] == alone.temperatures_C[node]
    assert swept.columns["thermal_gain"][0] == alone.thermal.gain
    assert swept.columns["friction_W"][0] == sum(alone.thermal.friction_W.values())
    assert np.isnan(swept.columns["oil_temperature_C"][2])


def test_command_line_states_temperatures(tmp_path):
    """Command line: temperatures in words and JSON; a runaway is its path and one sentence at exit code 1."""
    done = in_process("rbdyn", "ball", EXAMPLE)
    assert (
        done.returncode == 0
        and "temperatures [°C], with 5 to 95 %" in done.stdout
        and "ISO VG 32, heat balance" in done.stdout
    )
    record = json.loads(in_process("rbdyn", "ball", EXAMPLE, "--json", "--out", tmp_path).stdout)
    assert record["temperatures_C"].keys() == set(NODES) and {"status", "gain", "heat_W"} <= record["thermal"].keys()
    assert rbdyn.quasistatic.result.BallResult.load(tmp_path / "result.json").temperatures_C == record["temperatures_C"]
    path = tmp_path / "runaway.toml"
    housing = "housing_material = { " + ", ".join(f"{key} = {value}" for key, value in RIGID.items()) + " }"
    lines = [
        line
        for name, table in DEEP.items()
        for line in (f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items()))
    ]
    path.write_text("\n".join(lines).replace("[mounting]", f"[mounting]\n{housing}"))
    lost = in_process("rbdyn", "ball", path, "--set", "operation.inner_speed_rpm=8000.0")
    assert lost.returncode == 1 and "search for steady temperatures" in lost.stdout
    assert lost.stderr.startswith("temperatures: no steady state: ") and lost.stderr.count("\n") == 1


def test_invariant_no_cost_without_a_balance():
    """Invariant: an equilibrium without [thermal] loads none of rbdyn.thermal and saves no key of it."""
    code = (
        "import sys, rbdyn; "
        f"record = rbdyn.equilibrium({str(PLAIN)!r}).as_dict(); "
        "print([name for name in sys.modules if name.startswith('rbdyn.thermal')], 'thermal' in record['scene'])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.split("\n")[0] == "[] False"


def test_unit_temperatures_reach_every_part():
    """Unit: a scene at temperatures has them in its rings, balls and films, and its viscosity follows a stated one."""
    scene = scene_of(DEEP, lubricant__temperature_C=40.0, lubricant__viscosity_mPas=30.0)
    hot = at_temperatures(scene, Temperatures(60.0, 50.0, 70.0, 80.0))
    assert (
        hot.thermal is None and hot.mounting.roller_temperature_C == 80.0 and hot.mounting.housing_temperature_C == 50.0
    )
    assert hot.mounting.shaft_temperature_C == pytest.approx(70.0 - 0.125 * 50.0)
    thinner = scene.lubricant.at(60.0).viscosity
    assert hot.lubricant.in_service.viscosity == pytest.approx(thinner) and thinner < 0.02
    assert slopes_at(scene, np.full(4, 40.0)).shape == (4, 4)


@pytest.mark.slow
@pytest.mark.parametrize("tables", [DEEP, tomllib.loads(EXAMPLE.read_text())], ids=["deep", "example"])
def test_unit_ranges_are_those_of_full_solutions(tables):
    """Unit: ranges are within 0.3 K of those of a search to 1e-9 K for each of the 256 sets, also where the preload grows with the heat."""
    scene = scene_of(tables)
    ranges = rbdyn.equilibrium(scene).thermal.ranges.figures
    sets = input_sets(scene, ())
    rows = []
    for place in range(SETS):
        values = {key.removeprefix("thermal."): float(column[place]) for key, column in sets.items()}
        search = steady_temperatures(scene.model_copy(update={"thermal": scene.thermal.model_copy(update=values)}))
        rows.append(search.last.temperatures)
    for node, ends in zip(NODES, np.quantile(rows, QUANTILES, axis=0).T, strict=True):
        assert ranges[node] == pytest.approx(ends, abs=0.3)
