"""Dangers: each judgement at its limit, what a status follows from, that every code is used, and how results keep their notes."""

import ast
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from conftest import EXAMPLE, ROOT
from instant_runs import instant_result
from typer.testing import CliRunner

import rbdyn
from doe.response_surface import fit
from doe.workflow.confirmation import Gain, worse_notes
from doe.workflow.obstacles import MissedLimit, Obstacles
from doe.workflow.surfaces import extrapolation_notes
from rbdyn.base.faults import RPM
from rbdyn.base.notes import CODES, Level, Note, condensed, ranked, status_notes, status_of, verdict
from rbdyn.cli.app import app
from rbdyn.contact.hertz_line import BALLS, ROLLERS, SHAKEDOWN, pressure_notes
from rbdyn.dynamics.parameters import validity
from rbdyn.mounting.cage import OperatingClearance
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene
from rbdyn.scene.notes import clearance_notes, speed_notes

MODULES = [path for package in ("rbdyn", "doe") for path in (ROOT / package).rglob("*.py")]
SOURCES = [path for path in MODULES if re.search(r"\b(Note|Remark)\(", path.read_text(encoding="utf-8"))]
# A run of a tenth of a second, whose figures mean nothing.
SHORT = (
    "numerics.turns=0.2", "numerics.discard_turns=0.0", "numerics.replicates=1", "numerics.companion=false",
    "numerics.extend=false", "numerics.impact_window_turns=0.2",
)  # fmt: skip


def codes_in(path) -> set[str]:
    """Strings of a module, outside the list of codes itself."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    lists = [node for node in ast.walk(tree) if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "CODES"]
    listed = {id(key) for node in lists for key in node.value.keys}
    texts = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in listed)
    return {node.value for node in texts if isinstance(node.value, str)}


def ranked_codes():
    """Codes with what they say, the worst first."""
    return sorted(CODES.items(), key=lambda each: list(Level).index(each[1].level))


def test_every_code_is_written_somewhere_and_in_the_manual():
    """Unit: no code is listed in vain; the manual has a row for each, under its level and in the order of the list."""
    written = set().union(*map(codes_in, SOURCES))
    assert not set(CODES) - written
    page = (ROOT / "rbdyn" / "cli" / "manual" / "prose" / "32_warnings.md").read_text(encoding="utf-8")
    for level in Level:
        section = page.split(f"\n## {level.capitalize()}s\n")[1].split("\n## ")[0]
        listed = re.findall(r"^\| `([a-z-]+)` \| [A-Z].*\. \|.*\|.*\|$", section, re.MULTILINE)
        assert listed == [name for name, code in ranked_codes() if code.level == level]
    assert not any(code.general and code.level != Level.NOTE for code in CODES.values())


def test_notes_alike_are_one_and_the_worst_come_first():
    """Unit: of one code those that say the same of several things, figures apart; others stay; the verdict is the first danger."""
    notes = [
        Note("left-out", "left out: windage"),
        Note("numerical-error", "power loss: may be off by 3 %; tighten rtol"),
        Note("numerical-error", "cage speed: may be off by 1.5e-3 %; tighten rtol"),
        Note("numerical-error", "whirl: may be off by 3 %, mostly scatter"),
        Note("dent", "inner raceway: dented by 4100 MPa"),
        Note("dent", "inner raceway: dented by 4200 MPa").about("at climb"),
    ]
    assert [note.level for note in ranked(notes)] == [*["danger"] * 2, *["warning"] * 3, "note"]
    assert condensed(notes) == [
        "inner raceway: dented by 4100 MPa",
        "power loss: may be off by 3 %; tighten rtol; likewise cage speed",
        "whirl: may be off by 3 %, mostly scatter",
        "left out: windage",
    ]
    assert verdict(notes) == "inner raceway: dented by 4100 MPa"
    assert verdict(notes[1:4]) == "No danger found; 2 warnings" and verdict(notes[1:2]) == "No danger found; 1 warning"
    assert verdict(notes[:1]) == verdict([]) == "No danger found"
    # Sets of the inputs without a steady state leave the temperatures themselves decided.
    assert verdict([Note("undecided", "temperatures: 3 % of 512 sets have none")]) == "No danger found; 1 warning"
    found = verdict([*status_notes("undecided: 16 states did not settle"), notes[1]])
    assert found == "No danger found, but the temperatures are undecided: 16 states did not settle; 2 warnings"


@pytest.mark.parametrize(
    ("name", "drawn", "change", "code"),
    [
        ("radial", 40e-6, -35.9e-6, None), ("radial", 40e-6, -36.1e-6, "seizure"), ("radial", -5e-6, 0.0, "seizure"),
        ("radial", 0.0, 0.0, None), ("guide", 200e-6, -99e-6, None), ("guide", 200e-6, -101e-6, "clearance"),
        ("pocket", 200e-6, -181e-6, "seizure"), ("guide", 200e-6, -211e-6, "seizure"),
    ],
)  # fmt: skip
def test_unit_clearances_in_operation(name, drawn, change, code):
    """Unit: nearly lost below a tenth of the drawn clearance, mostly lost, of a cage, below half; of balls a preload is a warning."""
    notes = tuple(clearance_notes({name: OperatingClearance(drawn, 0.0, change, 0.0), "other": None}))
    of_balls = tuple(clearance_notes({"radial": OperatingClearance(drawn, 0.0, change, 0.0)}, {"radial": -math.inf}))
    assert [note.code for note in of_balls] == ["clearance"] * (drawn >= 0.0 > drawn + change)
    assert [note.code for note in notes] == ([] if code is None else [code])
    assert all(f"{name} clearance in operation is {1e6 * (drawn + change):.1f} um" in note for note in notes)


def test_unit_speeds_beyond_limits():
    """Unit: by the listed reference speed, or else by speed times pitch diameter: 0.055 m x 54 545 rpm are 3 million mm/min."""
    listed = [speed_notes(-factor * 9000 * RPM, 0.07, 9000 * RPM) for factor in (0.99, 1.01, 1.99, 2.01)]
    own = [speed_notes(speed * RPM, 0.055, None) for speed in (19_900.0, 20_100.0, 54_500.0, 54_600.0)]
    for notes in (listed, own):
        assert [[note.code for note in one] for one in notes] == [[], ["fast"], ["fast"], ["overspeed"]]
    assert "2 times the reference speed of 9000 rpm" in listed[3][0]


@pytest.mark.parametrize("limit", [BALLS, ROLLERS])
def test_unit_pressures(limit):
    """Unit: dents by ISO 76, beyond them the shakedown limit: 4 k of lines and 4.7 k of points, k = H/(3 sqrt 3)."""
    assert SHAKEDOWN[BALLS] / SHAKEDOWN[ROLLERS] == pytest.approx(4.7 / 4.0)
    assert SHAKEDOWN[ROLLERS] == pytest.approx(4.0 * 6.9e9 / 27.0**0.5)
    top = SHAKEDOWN[limit]
    found = [pressure_notes(pressure, limit, "inner") for pressure in (0.999 * limit, 1.001 * limit, 1.001 * top)]
    assert [[note.code for note in notes] for notes in found] == [[], ["dent"], ["overload"]]
    assert status_of(found[1]) == "ok" and status_of((*found[1], *found[2])) == "overloaded"


def test_unit_statuses_are_notes():
    """Unit: the status of a result without a sound answer is a danger, but for an undecided balance."""
    texts = (
        "ok",
        "steady",
        "overloaded: a",
        "seizure: b",
        "too hot: c",
        "no steady state: d",
        "undecided: e",
        "no root: f",
    )
    codes = [note.code for text in texts for note in status_notes(text)]
    assert codes == ["overload", "seizure", "heat", "heat", "undecided", "failed"]


def obstacles(verdict: str | None, reachable: bool = True, chains: dict[str, str] | None = None) -> Obstacles:
    """Obstacles of a pick with one limit of this verdict, or without any."""
    missed = MissedLimit("power_loss_W", None, "<=", 250.0, 255.0, 1.0, verdict, 5.0, 257.0, 0.9) if verdict else None
    return Obstacles(reachable, (missed,) if missed else (), [], (), chains or {}, "", {})


def test_unit_dangers_of_a_choice():
    """Unit: a response worse beyond its error, a broken or undecided limit, a chain that misses; a kept one is no note."""
    gains = {"power_loss_W": Gain(-3.0, 1.0), "impact_force_N": Gain(-0.5, 1.0), "cage_slip": Gain(4.0, 1.0)}
    (worse,) = worse_notes(gains)
    assert (worse.code, worse) == (
        "worse",
        "the selected design is worse than the baseline: power loss 3.0 ± 1.0 % more",
    )
    del gains["power_loss_W"]
    assert worse_notes(gains) == ()
    found = obstacles("broken", chains={"guide": "misses"}).notes
    assert {note.code for note in found} == {"broken-limit", "missed-chain"}
    assert found[0].startswith("Limit power loss <= 250 W is violated by 5.0 ± 1.0 W") and "guide: misses" in found[-1]
    assert {note.code for note in obstacles("undecided").notes} == {"open-limit"}
    assert obstacles("undecided", reachable=False).notes[0].level == Level.DANGER
    assert obstacles(None).notes == ()


def test_unit_extrapolation_is_found_beyond_the_runs_and_at_corners_without_runs():
    """Unit: of a design without corners (Box and Behnken) they are beyond its runs, though each factor is within its range."""
    edges = [(a, b, 0.0) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    points = np.array([np.roll(edge, shift) for edge in edges for shift in range(3)] + [np.zeros(3)] * 3)
    noise = np.random.default_rng(1).normal(size=len(points))
    surface = fit(points, points[:, 0] + noise, name="power_loss_W", centre=np.zeros(3), step=np.ones(3))
    found = [
        len(extrapolation_notes([surface], np.array(place))) for place in ([0.5, 0, 0], [1, 1, 0], [1, 1, 1], [0, 0, 2])
    ]
    assert found == [0, 0, 1, 1]


def test_unit_a_saved_result_has_its_notes_with_codes(outer, tmp_path):
    """Unit: JSON has level, code and text; read back they are notes again; a bare sentence is refused."""
    result = replace(instant_result(outer), notes=(Note("heat", "too hot"),))
    result.save(tmp_path / "result.json")
    data = json.loads((tmp_path / "result.json").read_text())
    assert data["notes"] == [{"level": "danger", "code": "heat", "text": "too hot"}]
    (note,) = SimulationResult.load(tmp_path / "result.json").notes
    assert (note, note.code, note.level) == ("too hot", "heat", Level.DANGER)
    with pytest.raises(TypeError):
        SimulationResult.from_dict(data | {"notes": ["too hot"]})


@pytest.mark.parametrize(
    ("words", "change", "status", "codes"),
    [
        (("NU210",), "operation.radial_load_N=690000", "overloaded", {"overload"}),
        (("NU210",), "operation.inner_speed_rpm=85000", "ok", {"overspeed"}),
        (("own", "--rollers", "16", "--roller", "7x7", "--pitch", "60"), "operation.radial_load_N=180000", "overloaded", {"overload"}),
    ],
)  # fmt: skip
def test_impossible_answers_fail(words, change, status, codes, tmp_path):
    """Unit: a load of ten times C0 is no answer: exit 1, dangers first and on standard error; ten times the speed is a danger."""
    scene = tmp_path / "scene.toml"
    scene.write_text(CliRunner().invoke(app, ["new", *words]).stdout)
    result = rbdyn.simulate(Scene.load(scene, [change, *SHORT]), workers=1, notice=None)
    assert result.status in (status, "too hot") and codes <= {note.code for note in result.notes}
    sets = [word for key in (change, *SHORT) for word in ("--set", key)]
    shown = CliRunner().invoke(app, ["simulate", str(scene), "-q", *sets])
    assert shown.exit_code == (0 if result.status == "ok" else 1)
    assert shown.stdout.startswith("Danger: ") and "warning:" not in shown.stdout
    told = CliRunner().invoke(app, ["simulate", str(scene), "--json", *sets])
    assert (
        told.stderr.count("danger: ") == shown.stdout.count("Danger: ") and json.loads(told.stdout)["notes"][0]["code"]
    )


def test_a_ball_bearing_beyond_shakedown_has_no_answer(tmp_path):
    """Unit: ten times C0 of a deep groove bearing: exit 1 with the pressure or the groove as the reason, first on the screen."""
    scene = tmp_path / "scene.toml"
    scene.write_text(CliRunner().invoke(app, ["new", "6208"]).stdout)
    for load, reason in ((120_000.0, "shakedown"), (190_000.0, "reduce the load")):
        shown = CliRunner().invoke(app, ["ball", str(scene), "--set", f"operation.radial_load_N={load}"])
        assert shown.exit_code == 1 and shown.stdout.startswith("Danger: overloaded: ") and reason in shown.stderr


@pytest.mark.parametrize(
    ("interference_um", "status"), [(40.0, "ok"), (90.0, "lost clearance"), (90.0, "with a heat balance")]
)
def test_unit_a_clearance_that_fits_take_fails_a_run_without_a_heat_balance(interference_um, status):
    """Unit: 0.7 to 0.8 of an interference fit closes the clearance of 50 um; only a heat balance tells whether a preload lasts."""
    sizes = {"bore_mm": 27, "outside_diameter_mm": 60, "width_mm": 11, "housing_diameter_mm": 90, "rotation": "false"}
    parts = {f"{part}_temperature_C": 20 for part in ("outer_ring", "inner_ring", "roller", "cage")}
    fits = {"inner_interference_um": interference_um, "outer_interference_um": 0}
    sets = [f"mounting.{key}={value}" for key, value in (sizes | parts | fits).items()]
    scene = Scene.load(EXAMPLE, ["bearing.radial_clearance_mm=0.05", *sets])
    if status == "with a heat balance":
        scene, status = scene.model_copy(update={"thermal": object()}), "ok"
    assert validity.status(scene, ()) == status
    assert validity.status(scene, (Note("overload", "overload"),)) == "overloaded"
