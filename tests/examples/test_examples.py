"""The example scripts: each imports, and each published check gives its number in a quick variant."""

import importlib.util
import json
import math
import shutil
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from instant_runs import instantly, unillustrated
from short_studies import short_study

from rbdyn.dynamics.forces.cage import NoGuide

EXAMPLES = Path(__file__).parents[2] / "examples"
SCRIPTS = sorted(
    path.relative_to(EXAMPLES).with_suffix("").as_posix()
    for path in (*EXAMPLES.glob("*.py"), *EXAMPLES.glob("benchmarks/*.py"))
)


@pytest.fixture(autouse=True)
def examples_on_path(monkeypatch):
    """Scripts find what lies beside them, as when they are run."""
    monkeypatch.syspath_prepend(str(EXAMPLES))


def script(name):
    """Import a script without running it."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def effort():
    """Two short replicates: enough for the size of a figure."""
    from published.common import Effort

    return Effort(replicates=2, turns=20, discard_turns=4)


@pytest.mark.parametrize("name", SCRIPTS)
def test_unit_script_imports(name):
    """Unit: importing a script runs nothing and finds all it needs."""
    assert script(name).__doc__


def cells_of(name, settings):
    """What the code cells of a notebook leave, run in turn; ``settings`` replace those of its cell of parameters."""
    notebook = json.loads((EXAMPLES / f"{name}.ipynb").read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    left = {}
    for cell in code:
        exec(compile("".join(cell["source"]), f"{name}.ipynb, {cell['id']}", "exec"), left)
        if "parameters" in cell["metadata"].get("tags", ()):
            assert settings.keys() <= left.keys()
            left |= settings
    return left


def test_invariant_the_notebook_runs_and_its_rollers_bear_the_shaft(tmp_path, monkeypatch, capsys):
    """Invariant: all its cells run, on simulations that take no time; over ten turns of a real history the rollers carry the
    1300 N of the shaft, but for its own inertia; the chosen scene has the picked clearances.
    """
    settings = {"SCENE": EXAMPLES / "cylindrical_roller.toml", "STUDY": short_study(tmp_path), "OUT": tmp_path / "out"}
    instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    left = cells_of("clearance_study", settings)
    assert left["carried"] == pytest.approx(1300.0, rel=0.01)
    assert left["heavier"].cage.mass_g == 50.0 and left["drawn"].cage.mass_g == 45.0
    assert left["figure"].axes[0].get_ylabel() == "power loss [W]"
    assert left["chosen"].cage.pocket_clearance_mm == left["study"]["pick"]["pocket_clearance_mm"]
    assert capsys.readouterr().out.endswith(" rpm\n") and (tmp_path / "out" / "report.html").exists()
    plt.close("all")


def test_literature_the_flight_has_its_points_and_its_life():
    """Literature: idle, cruise and take-off, whose life by ISO/TS 16281, Palmgren and Miner is 92 000 h, 7 tenths of the damage
    at cruise; a map reads the same points."""
    from doe.workflow.duty import lives
    from doe.workflow.problem import Problem
    from rbdyn.scene.duty import read_duty

    study = Problem.load(EXAMPLES / "duty_study.toml")
    assert study.shares == {"cruise": 0.8, "idle": 0.15, "take-off": 0.05}
    assert read_duty(study.path) == study.file.duty
    assert study.responses[-1] == "idle: cage_slip"
    life = lives(study, {"baseline": study.confirmation_run(study.baseline).scenes})["baseline"]
    assert life.hours == pytest.approx(92_024.0, rel=1e-4)
    assert life.damage == pytest.approx((0.001, 0.703, 0.296), abs=0.001)


def flight(folder):
    """The study of a flight in a folder of its own, with a short search."""
    for name in ("cylindrical_roller.toml", "duty_study.toml"):
        shutil.copy(EXAMPLES / name, folder)
    with (folder / "duty_study.toml").open("a", encoding="utf-8") as file:
        file.write("\n[front]\ngenerations = 10\ndraws = 100\n")
    return folder / "duty_study.toml"


def test_invariant_the_flight_runs_on_simulations_that_take_no_time(tmp_path, monkeypatch):
    """Invariant: each run and each confirmed point is simulated at idle, cruise and take-off; all are answered."""
    import doe

    ran = instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    answer = doe.study(flight(tmp_path), tmp_path / "out")
    points = answer["duty"]["points"]
    assert [point["name"] for point in points] == ["idle", "cruise", "take-off"]
    assert answer["duty"]["aggregate"]["impact_force_N"] == "worst_relative"
    assert answer["confirmation"]["baseline"]["responses"]["impact_force_N"]["value"] == 1.0
    assert len(answer["design"]["points"]) == 18 and len(ran) >= 3 * 18 + 3 * 2
    table = answer.table("duty")
    assert len(table) == 9 and set(table["limit_verdict"]) == {"", "kept"}
    text = (tmp_path / "out" / "answer.txt").read_text(encoding="utf-8")
    assert (
        "duty of idle 15 %, cruise 80 %, take-off 5 %" in text
        and "Life over the duty, L10r: 92000 h at the baseline" in text
    )
    assert (tmp_path / "out" / "duty_points.csv").read_text(encoding="utf-8").count("\n") == 10


@pytest.mark.slow
def test_trend_the_flight_is_better_at_every_point(tmp_path):
    """Trend: the selected design hits the cage less and loses less at idle, cruise and take-off alike; cruise is the worst point for the cage."""
    import doe

    answer = doe.study(EXAMPLES / "duty_study.toml", tmp_path)
    assert answer["status"] == "ok"
    for point in answer["duty"]["points"]:
        assert {gain["verdict"] for gain in point["gains"].values()} == {"better"}, point["name"]
    worst = answer["duty"]["worst"]["pick"]
    assert worst["impact_force_N"]["point"] == "cruise" and worst["impact_force_N"]["probability"] > 0.9
    assert worst["cage_slip"]["point"] == "idle"
    assert answer["gains"]["impact_force_N"]["percent"] == pytest.approx(11.6, abs=3.0)


def test_literature_table4(effort, monkeypatch):
    """Literature: our loss is 0.57 of Chen et al.'s, ranks as theirs and falls with guide clearance as theirs does."""
    from published import chen_2022

    # What each part of their contacts does, between none and all, takes two kernels more.
    ends = ("our defaults", "all together")
    monkeypatch.setattr(chen_2022, "CLOSURES", {name: chen_2022.CLOSURES[name] for name in ends})
    every = chen_2022.table4(effort, ("four_constant",)).frame
    frame = every[every["law"] == "four_constant"].set_index("response")
    assert frame["level_ratio"]["power_loss_W"] == pytest.approx(0.57, abs=0.05)
    assert frame["sign_guide_clearance_mm"]["power_loss_W"] == "same"
    assert frame["spearman"]["impact_force_N"] > 0.5
    # With the contacts of the paper its levels follow, and the ranks of the impact do no better.
    theirs = every[every["law"] == "their contacts"].set_index("response")
    assert theirs["level_ratio"]["impact_force_N"] == pytest.approx(1.24, abs=0.1)
    assert theirs["level_ratio"]["power_loss_W"] == pytest.approx(0.85, abs=0.05)
    assert theirs["spearman"]["whirl_deviation_ratio"] < 0.0


def test_literature_rolling_torque():
    """Literature: 32216 at 6 kN and 50 C, flooded, has the torques of an independent evaluation of the same law within 1 %."""
    from published.rolling_torque import check

    frame = check().frame
    assert frame["flooded"].tolist() == pytest.approx([2748.0, 4443.0, 6684.0, 8440.0], rel=0.01)
    assert (frame["2 half-widths"] < frame["5 half-widths"]).all() and (frame["5 half-widths"] < frame["flooded"]).all()


def test_literature_friction_formulas(effort):
    """Literature: SKF 151 W of rolling, Palmgren 117, 154 and 265 W at 24000 rpm and 1300 N; ours in the races is 0.89 of SKF's."""
    from published.operating import friction

    row = friction(effort, (12000, 24000), (1300, 2600)).frame.set_index(["speed_rpm", "load_N"]).loc[(24000, 1300)]
    assert row["skf_rolling_W"] == pytest.approx(151.0, abs=1.0)
    assert row["palmgren_2_W"] == pytest.approx(117.0, abs=1.0)
    assert row["palmgren_3_W"] == pytest.approx(154.0, abs=1.0)
    assert row["palmgren_6_W"] == pytest.approx(265.0, abs=1.0)
    assert row["races_W"] / (row["skf_rolling_W"] + row["skf_sliding_W"]) == pytest.approx(0.892, abs=0.02)


def test_literature_friction_totals():
    """Literature: ISO VG 32 has 11.0 cSt at 70 C; an NU 215 has 18 rollers of 15 mm; SKF gives 132 W for an NU 210. Ours is
    within a factor of 3 of SKF's rolling part, and a meniscus at 10 half-widths takes up to a fifth."""
    from published import friction_totals as totals

    from rbdyn import Scene

    assert totals.viscosity_cst(32) == pytest.approx(11.0, abs=0.05)
    drawing = Scene.load(totals.CHEN, totals.overrides_of("NU 215 ECP", 5000.0, 1000.0, 32)).bearing
    assert (drawing.rollers, drawing.roller_diameter_mm) == (18, 15.0)
    assert drawing.effective_length_mm == pytest.approx(15.4, abs=0.1)
    row = totals.point("NU 210 ECP", 6000.0, 2000.0, 32)
    assert row["skf_total_W"] == pytest.approx(132.3, abs=0.3)
    assert row["flooded_over_skf"] > row["starved_over_skf"] > 1.0
    frame = totals.friction_totals(names=("NU 206 ECP", "NU 314 ECP")).frame
    assert frame["flooded_over_skf"].between(0.4, 3.0).all()
    assert (1.0 - frame["starved_W"] / frame["flooded_W"]).between(0.02, 0.2).all()


@pytest.mark.slow
def test_literature_minimum_load():
    """Literature: at SKF's minimum load an NU 308 slips by less than 12 %, at half of it by more."""
    from published.common import Effort
    from published.minimum_load import least_load, minimum_load

    assert least_load("NU 308", 5600.0) == pytest.approx(150.0 * (6.0 + 4.0 * 0.7) * 0.65**2)
    frame = minimum_load(Effort(2, 5, 5), ("NU 308",)).frame.set_index("share")
    assert 0.02 < frame["slip"][1.0] < 0.12 and frame["slip"][0.5] > 1.3 * frame["slip"][1.0]


@pytest.mark.slow
def test_literature_friction_at_the_makers_level():
    """Literature: what ``rbdyn new`` writes of an NU 204 at its reference speed loses 1 to 1.8 times SKF's M_rr + M_sl."""
    from rbdyn import simulate

    benchmark = script("benchmarks/maker_friction")
    result = simulate(benchmark.scene_of("204", "", 4.0, 2))
    header, row = benchmark.rows_of({"NU 204": result})
    cells = dict(zip(header, row, strict=True))
    assert (cells["rpm"], cells["N"], cells["SKF W"], cells["ISO 15312 W"]) == ("16000", "1100", "83", "47")
    powers = [float(cell) for cell in row[3 : header.index("power loss W")]]
    assert sum(powers) == pytest.approx(result.power_loss_W.value, abs=0.5)
    assert result.friction_check is not None and 1.0 < result.friction_check.ratio < 1.8


def test_unit_static_loads_bear_the_shaft():
    """Unit: the inner loads of the steady calculation add up to the shaft's load, the outer ones exceed them by one pull."""
    from published import friction_totals as totals

    from rbdyn import Scene

    scene = Scene.load(totals.CHEN, totals.overrides_of("NU 308 ECP", 4000.0, 9000.0, 32))
    outer, inner = totals.contact_loads(scene)
    angle = 2.0 * np.pi * np.arange(len(inner)) / len(inner)
    assert inner @ np.cos(angle) == pytest.approx(9000.0, rel=1e-6)
    assert np.ptp(outer - inner) < 1e-9 * outer.max()


def test_literature_figure14(effort):
    """Literature: loss and impact rise with speed, as Chen et al. say of their Fig. 14."""
    from published.operating import figure14

    frame = figure14(effort, ("four_constant",), (24000, 30000), (1300,)).frame
    part = frame[(frame["design"] == "design") & (frame["sweep"] == "speed")].set_index("speed_rpm")
    assert part["power_loss_W"][30000] / part["power_loss_W"][24000] == pytest.approx(1.58, abs=0.1)
    assert part["impact_force_N"][30000] > part["impact_force_N"][24000]


def test_literature_nu215():
    """Literature: the NU215 skids at 5000 rpm and 1000 N and rolls at 5000 N."""
    from published.common import Effort
    from published.skidding import NU215, slip

    from rbdyn import Scene

    assert [2e3 * r for r in Scene.load(NU215).geometry.raceways] == pytest.approx([118.57, 88.5])
    # One traction curve, which is compiled already; the check itself takes the one that follows pressure.
    curve = ("traction.model=four_constant",)
    short = Effort(replicates=2, turns=10, discard_turns=10)
    skidding, rolling = (slip(short, 5000, load, curve)[0] for load in (1000, 5000))
    assert skidding > 2.0 * rolling
    assert abs(rolling) < 0.05


def test_literature_sliding_speed_of_the_other_model():
    """Literature: 23 % slip is 5.3 m/s at the inner race, where Yan et al.'s model has 7: the inner race's speed less twice that of
    the rollers' centres."""
    from published.skidding import sliding_speed

    epicyclic = 2500.0 * (1.0 - 15.0 / 103.535)
    assert sliding_speed(0.23, epicyclic) == pytest.approx(5.33, abs=0.01)
    inner, centres = 523.6 * 0.0885 / 2.0, 0.77 * epicyclic * 0.104720 * 0.103535 / 2.0
    assert sliding_speed(0.23, epicyclic) == pytest.approx(inner - 2.0 * centres, rel=2e-3)


def test_unit_sensitivity(effort):
    """Unit: more oil in the air moves the power nearer; the distance is the mean of |ln ratio|."""
    from published.common import RESPONSES
    from published.sensitivity import sensitivity

    frame = sensitivity(effort, ("oil fraction 5 %",), whole_design=False).frame
    shipped, oily = frame.loc["as shipped"], frame.loc["oil fraction 5 %"]
    assert oily["power_loss_W"] - shipped["power_loss_W"] == pytest.approx(0.16, abs=0.03)
    assert shipped["distance"] == pytest.approx(sum(abs(math.log(shipped[r])) for r in RESPONSES) / 3.0)


def test_literature_whirl(effort):
    """Literature: a flooded land carries the cage; one that is all but dry is struck."""
    from published.whirl import whirl

    frame = whirl(effort, (1.0, 0.002), ("four_constant",), history_turns=3.0).frame
    assert list(frame["regime"]) == ["in the film", "strikes the land"]
    assert frame["contacts_per_turn"].iloc[1] > 1.0
    assert frame["eccentricity"].iloc[0] < 0.96


def test_oracle_numpy_right_hand_side(outer, evaluate, random_state):
    """Oracle: the page of numpy gives the derivative of the compiled code; other laws are refused by name."""
    from rbdyn.base.faults import InputError
    from rbdyn.dynamics.parameters.model import roller_bearing

    module = script("numpy_right_hand_side")
    bearing = roller_bearing(outer)
    z, function = bearing.rollers, module.NumpyRightHandSide(bearing)
    kinds = [0, 2 * z, 4 * z, 5 * z, 5 * z + 3, 5 * z + 5, 5 * z + 6, 5 * z + 8]
    touching = 0.0
    for seed in range(12):
        y = random_state(outer, seed)
        compiled = evaluate(bearing, y)
        touching = max(touching, compiled.loads[0])
        for ours, theirs in zip(np.split(function(0.0, y), kinds), np.split(compiled.dy, kinds), strict=True):
            assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10 * np.abs(theirs).max(initial=0.0))
    assert touching > 10.0 and function.calls == 12
    rigid = bearing._replace(pocket=bearing.pocket._replace(contact=bearing.outer.contact), guide=NoGuide())
    with pytest.raises(InputError, match="NoGuide"):
        module.NumpyRightHandSide(rigid)


def test_literature_preload_stresses_and_life():
    """Literature: Sensors 2023, Table 4: stresses of rings at rest, least near 70 N; life of a catalogue rating."""
    preload = script("paper_003_preload")
    stress = preload.table4()
    kept = stress[stress["axial_N"] != 50]
    for race, text in (("inner", 0.01), ("outer", 0.05)):
        printed = kept[f"{race}_MPa paper"].to_numpy()
        assert kept[f"{race}_MPa at rest"].to_numpy() == pytest.approx(printed, rel=text)
        # An even 0.7 %, to the rounding of the table.
        assert kept[f"{race}_MPa groove 0.53"].to_numpy() / printed == pytest.approx(1.007, abs=1.5e-3)
    assert np.all(stress["outer_MPa 63000 rpm"] > stress["outer_MPa paper"])
    assert stress["life_h ISO 281, read back"].iloc[:-1].to_numpy() == pytest.approx(
        stress["life_h paper"].iloc[:-1].to_numpy(), rel=0.06
    )
    best = preload.optima()
    assert best["at rest"].least_stress.value == pytest.approx(30.0, abs=2.0)
    assert best["at rest"].longest_life.value < 20.0
    assert best["63000 rpm, tilting"].least_stress.value < 10.0
    assert any("differ" in note for note in best["at rest"].notes)


def test_literature_clearance_lowers_the_life_of_the_ball_loads():
    """Literature: Sensors 2023, Table 3: its angles are eq 17's; its rise in life is not what the loads give."""
    preload = script("paper_003_preload")
    frame = preload.table3()
    assert frame["angle_deg eq 17"].to_numpy() == pytest.approx(frame["angle_deg paper"].to_numpy(), abs=0.06)
    assert np.all(np.diff(frame["life_h paper"]) > 0.0)
    for name in preload.MODELS:
        assert np.all(np.diff(frame[f"life_h {name}"]) < 0.0)
    assert np.all(np.diff(frame["life_h axial load alone"]) > 0.0)


def test_trend_tilt_loads_the_most_loaded_ball_more():
    """Trend: Sensors 2023, Fig. 13: the greatest ball load rises with misalignment."""
    preload = script("paper_003_preload")
    frame = preload.tilted_loads()
    loads = frame.drop(columns="azimuth_deg")
    assert np.all(np.diff(loads.max()) > 0.0)
    assert loads.max().iloc[0] == pytest.approx(105.1, abs=0.1)


def test_literature_finite_search(monkeypatch):
    """Literature: all of Table 3 of Hu et al. by their search and ours, to the same equilibria; searches are few."""
    module = script("paper_000_finite_search")
    monkeypatch.setattr(module, "REPEATS", 1)
    outcomes = module.table_3()
    table = module.frame(outcomes)
    assert list(table["status"]) == ["ok"] * 24
    assert table["searches"].max() <= table["their_searches"].max() == 8
    assert table["gap_deg"].max() < 1e-6
    assert (table["convex_residual_N"] < 1e-9 * table["axial"]).all()
    # The touching point itself leads nowhere: no contact is loaded there.
    assert table["searches"].min() >= 2
    # With speed the nearest starting point moves along the search, as their count of searches does.
    for _, group in table.groupby(["bearing", "radial", "axial"]):
        assert group["nearest_search"].is_monotonic_increasing
    found = module.figure_7()
    assert found["method_gap"] < 1e-6
    assert 1.0 < found["sign_gap"] < 15.0
    spread = [both[0].max() - both[1].min() for both in found["curves"]["search"].values()]
    assert spread == sorted(spread)


def test_literature_the_cage_moves_chaotically(outer):
    """Literature: two runs part exponentially, whatever separation and tolerance show it (Benettin et al. 1980)."""
    lyapunov_exponent = script("lyapunov").lyapunov_exponent
    found = [
        lyapunov_exponent(outer, 12.0, separation=separation, rtol=1e-4 * separation) for separation in (1e-3, 1e-4)
    ]
    for exponent in found:
        assert exponent.per_turn - exponent.half_width > 1.0
    wide, fine = found
    assert abs(wide.per_turn - fine.per_turn) < wide.half_width + fine.half_width


def test_a_rotor_takes_the_table_of_stiffness(tmp_path):
    """The arguments of ROSS's BearingElement are those of one load at every speed; a failed point is refused."""
    from rbdyn.cli.stiffness import stiffness_map

    rotor = script("rotor_in_ross")
    found = stiffness_map(EXAMPLES / "cylindrical_roller.toml", [4e3, 8e3, 12e3, 16e3, 20e3], [0.0, 500.0])
    found.sheet.save(tmp_path)
    arguments = rotor.bearing_arguments(tmp_path / "stiffness.csv", 500.0)
    assert set(arguments) == {"speed", *rotor.COEFFICIENTS} and all(len(values) == 5 for values in arguments.values())
    assert arguments["kxx"] == pytest.approx([1e6 * value for value in found.grid("xx")[1]])
    with pytest.raises(ValueError, match="whole row"):
        rotor.bearing_arguments(tmp_path / "stiffness.csv")
