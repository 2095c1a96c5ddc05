"""``doe new`` with limits, tolerances and dimension chains of a scene's parts."""

import json
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import pytest
from doe_command import doe
from short_studies import EXAMPLES

from doe.clearance import responses_of
from doe.dimension_chain import chain_from, solve
from doe.running.store import STORE, Failure, Store
from doe.study_file.sections import StudyChain
from doe.workflow.effort import Effort
from doe.workflow.parts import clearance_parts, manufacture_of
from doe.workflow.problem import Problem
from doe.workflow.region import baseline_cages, slow_points
from rbdyn.base.faults import InputError
from rbdyn.base.tables.sheet import listed
from rbdyn.properties.tolerances import grade_tolerances
from rbdyn.result import Quantity
from rbdyn.scene import Scene

BASELINE_CAGES = baseline_cages
SMALL = ("--rollers", "12", "--roller", "5x5", "--pitch", "30")
INNER = ("--rollers", "18", "--roller", "13x22", "--pitch", "95", "--guidance", "inner", "--bore", "70")
LARGE = ("--rollers", "5", "--roller", "30x30", "--pitch", "120", "--guidance", "roller")
BEARINGS = {"outer": SMALL, "inner": INNER, "roller": LARGE}
# Short runs, so that the study takes seconds.
QUICK = ("numerics.turns=3", "numerics.discard_turns=2", "numerics.replicates=2", "numerics.impact_window_turns=1",
         "numerics.companion=false", "numerics.extend=false")  # fmt: skip


@pytest.fixture
def scene(command, tmp_path, request):
    """Path of a scene of one's own bearing."""
    path = tmp_path / "own.toml"
    path.write_text(command("new", "own", *BEARINGS[getattr(request, "param", "outer")]).stdout, encoding="utf-8")
    return path


def written(path, *arguments):
    """The study that ``doe new`` writes, as text and as tables."""
    ran = doe("new", path, *arguments)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout, tomllib.loads(ran.stdout)


def test_command_line_limits(scene):
    """Command line: each limit is a line of its response, = means <=, both ends may stand; others are watched."""
    _, plain = written(scene)
    assert not any({"upper", "lower"} & response.keys() for response in plain["response"])
    limits = ("power_loss_W<=250", " impact_force_N = 140 ", "impact_force_N>=1e0", "cage_slip<=0.1")
    text, study = written(scene, *(word for limit in limits for word in ("--limit", limit)))
    responses = {response["name"]: response for response in study["response"]}
    assert (responses["impact_force_N"]["lower"], responses["impact_force_N"]["upper"]) == (1.0, 140.0)
    assert responses["power_loss_W"]["upper"] == 250.0 and "upper" not in responses["whirl_deviation_ratio"]
    assert responses["cage_slip"] == {"name": "cage_slip", "upper": 0.1, "model": "quadratic", "goal": "none"}
    assert "tolerance = 0.005, the half width" in text and "chain" not in study and "tolerances" not in study
    without = {key: value for key, value in study.items() if key != "response"}
    assert without == {key: value for key, value in plain.items() if key != "response"}


def test_command_line_design_runs_have_a_looser_tolerance(scene, tmp_path):
    """Command line: than the confirmations, which keep the default; a stated tolerance, and rigid contacts, keep theirs everywhere."""
    text, study = written(scene)
    assert study["scene"]["set"][-1] == "numerics.rtol=0.04" and study["confirmation"]["set"] == ["numerics.rtol=0.01"]
    path = tmp_path / "study.toml"
    path.write_text(text, encoding="utf-8")
    loaded = Problem.load(path)
    design, confirmed = loaded.usual_run, loaded.confirmation_run(loaded.baseline)
    assert (design.numerics.rtol, confirmed.numerics.rtol) == (0.04, 0.01)
    own = scene.read_text(encoding="utf-8")
    for old, new in (
        ("[operation]", "[numerics]\nrtol = 0.002\n\n[operation]"),
        ("elasticity = true", "elasticity = false"),
    ):
        assert own.count(old) == 1
        scene.write_text(own.replace(old, new), encoding="utf-8")
        _, study = written(scene)
        assert study["scene"]["set"][-1] == "numerics.companion=false" and "set" not in study["confirmation"]


def test_command_line_limits_that_are_refused(scene):
    """Command line: a name, a number, a sign or a pair that cannot be is one sentence each, all at once; exit 2."""
    limits = {
        "loss<=3": f"no response has that name; choose one of {listed(responses_of(heats=True))}",
        "impact_force_N<=abc": "abc is not a number; write a plain number in N",
        "impact_force_N<=0,5": "0,5 has a decimal comma; write 0.5",
        "impact_force_N<=inf": "inf is not a finite number; write a plain number",
        "impact_force_N": 'is not a limit; write "NAME<=VALUE" or "NAME>=VALUE" in quotes',
        "impact_force_N<3": 'is not a limit; write "NAME<=VALUE" or "NAME>=VALUE" in quotes',
    }
    typed = [*limits, "cage_slip>=0.1", "cage_slip<=0.05", "power_loss_W<=3", "power_loss_W=2"]
    refused = doe("new", scene, *(word for limit in typed for word in ("--limit", limit)))
    assert refused.returncode == 2 and refused.stdout == ""
    assert refused.stderr.splitlines() == [
        *(f"--limit {limit}: {sentence}" for limit, sentence in limits.items()),
        "--limit power_loss_W=2: power_loss_W has the upper limit 3 already; keep one of them",
        "--limit cage_slip: the lower limit 0.1 is not below the upper limit 0.05; swap or widen them",
    ]
    assert json.loads(doe("new", scene, "--limit", "x=1", "--json").stdout)["status"] == "refused"


def test_command_line_places_without_a_file_are_refused_first(scene, tmp_path):
    """Command line: a missing folder, a folder and a file that exists are named as such; exit 2."""
    gone, there = tmp_path / "gone" / "x.toml", tmp_path / "there.toml"
    there.write_text("kept", encoding="utf-8")
    for place, words in {
        gone: f"{gone}: missing folder {gone.parent}; make it first",
        tmp_path: f"{tmp_path}: is a folder; name a file in it",
        there: f"--out {there}: exists; add --force to write over it, or name another file",
    }.items():
        refused = doe("new", scene, "--out", place)
        assert (refused.returncode, refused.stdout, refused.stderr) == (2, "", f"{words}\n")
    assert there.read_text("utf-8") == "kept"


@pytest.mark.parametrize(
    ("scene", "names"),
    [("outer", ["radial", "guide", "pocket"]), ("inner", ["radial", "guide", "pocket"]), ("roller", ["radial", "pocket"])],
    indirect=["scene"],
)  # fmt: skip
def test_command_line_chains_resolve_to_the_clearances(scene, names, tmp_path):
    """Command line: the links of each chain close to the scene's clearance, and at it have parts of the grade that is written."""
    text, study = written(scene, "--chains")
    assert [chain["name"] for chain in study["chain"]] == names and "tolerances" not in study
    drawn = Scene.load(scene)
    loaded = Problem.load(EXAMPLES / "clearance_study.toml")
    clearances = {
        "radial_clearance_mm": drawn.bearing.radial_clearance_mm,
        "guide_clearance_mm": drawn.cage.guide_clearance_mm,
        "pocket_clearance_mm": drawn.cage.pocket_clearance_mm,
    }
    for chain in study["chain"]:
        closed = sum(link["coefficient"] * link["nominal_mm"] for link in chain["link"])
        assert closed == pytest.approx(clearances[chain["factor"]], abs=1e-9)
        table = loaded.chain_table(StudyChain(**chain), clearances[chain["factor"]])
        solved = solve(chain_from(table, "study"), samples=2000)
        grades = {part.grade for part in solved.allocation if part.grade}
        assert len(grades) == 1 and f"# {grades.pop()} (ISO 286-1): " in text
        assert solved.status.startswith("ok") and solved.worst_case_mm[0] >= table["closing_link"]["lower_mm"] - 1e-9
        # A nominal is moved only where half a micrometre of it is on no step of the drawing.
        stated = {link["name"]: link["nominal_mm"] for link in chain["link"]}
        halves = any(abs(nominal * 1e3 - round(nominal * 1e3)) > 1e-6 for nominal in stated.values())
        assert all(abs(part.moved_mm) <= (0.001 if halves else 0.0) + 1e-9 for part in solved.allocation)
    if "guide" in names:
        land = next(link for chain in study["chain"] for link in chain["link"] if link["name"] == "guide_land")
        assert land["nominal_mm"] == pytest.approx(drawn.land_diameter_mm, abs=5e-4)


def test_command_line_tolerances(scene):
    """Command line: half widths of the grades of ISO 286-1, a front that counts with them, and the widest; all pass the study's checks."""
    text, study = written(scene, "--tolerances")
    grades = {size: grade_tolerances(size) for size in (33.333, 33.213, 5.15)}
    tolerances = {factor["name"]: factor["tolerance"] for factor in study["factor"]}
    assert tolerances["guide_clearance_mm"] == pytest.approx(0.5 * (grades[33.333]["IT7"] + grades[33.213]["IT7"]))
    assert tolerances["pocket_clearance_mm"] == pytest.approx(0.5 * grades[5.15]["IT7"] + 0.001)
    assert study["front"]["tolerance_aware"] == "quantile" and study["tolerances"]["keep"] == 0.5
    assert (
        "IT4 (ISO 286-1): outer_raceway 7 um and inner_raceway 6 um, rollers within 1 um of nominal; IT5 would be wider than a step"
        in text
    )
    assert "chain" not in study


def test_unit_grades_follow_the_step(scene):
    """Unit: the usual grade where the step holds it, else the next finer one, at last also narrower rollers."""
    parts = clearance_parts(Scene.load(scene))["radial_clearance_mm"]
    wide, narrow, narrowest = (manufacture_of(parts, step) for step in (0.02, 0.005, 0.0001))
    assert (
        wide.rule.startswith("IT5") and "wider" not in wide.rule and wide.half_width == pytest.approx(0.012, abs=2e-3)
    )
    assert narrow.half_width <= 0.005 and "IT5 would be wider than a step" in narrow.rule
    assert narrowest.rollers == 0.0005 and narrowest.rule.startswith("IT01")
    assert parts.clearance == pytest.approx(Scene.load(scene).bearing.radial_clearance_mm)


def test_unit_parts_beyond_iso_286_are_refused(scene):
    """Unit: a raceway beyond 500 mm has no grade here; the sentence says what to leave out."""
    large = clearance_parts(Scene.load(scene))["radial_clearance_mm"]
    beyond = large._replace(parts=tuple(part._replace(nominal=20.0 * part.nominal) for part in large.parts))
    with pytest.raises(
        InputError, match=r"^radial_clearance_mm: outer_raceway of 700\.3\d* mm lies outside .*; leave --tol"
    ):
        manufacture_of(beyond, 0.01)


def test_command_line_lips_of_a_cage_that_rollers_guide(scene, command, tmp_path):
    """Command line: pocket lips that the scene states are a factor, with a chain of their own."""
    path = tmp_path / "lips.toml"
    guided = command("new", "own", *LARGE).stdout
    path.write_text(guided.replace("[cage] ", "[cage]\npocket_radial_clearance_mm = 0.5 #"), encoding="utf-8")
    _, study = written(path, "--chains", "--tolerances")
    chain = next(chain for chain in study["chain"] if chain["name"] == "lips")
    assert chain["factor"] == "pocket_radial_clearance_mm" and chain["link"][0]["nominal_mm"] == 30.5


@pytest.mark.slow
@pytest.mark.parametrize("scene", list(BEARINGS), indirect=True)
def test_command_line_from_a_drawing_to_parts(scene, tmp_path):
    """Command line: a study with limits, tolerances and chains runs to its end, and every chain has parts."""
    text, study = written(
        scene, "--tolerances", "--chains", "--limit", "power_loss_W<=5000", "--limit", "cage_slip<=0.9"
    )
    path = tmp_path / "study.toml"
    quick = ", ".join(f'"{assignment}"' for assignment in QUICK)
    lines = [f"set = [{quick}]" if line.startswith('set = ["numerics.turns') else line for line in text.splitlines()]
    path.write_text("\n".join(lines).replace("replicates = 16 ", "replicates = 2 "), encoding="utf-8")
    ran = doe("study", path, "--out", tmp_path / "study", "--json")
    assert ran.returncode == 0, ran.stderr
    record = json.loads(ran.stdout)
    assert record["status"] == "ok" and set(record["limits"]) >= {"power_loss_W", "cage_slip"}
    parts = (tmp_path / "study" / "part_dimensions.csv").read_text(encoding="utf-8").splitlines()
    assert {line.split(",")[0] for line in parts[1:]} == {chain["name"] for chain in study["chain"]}


@pytest.mark.parametrize(
    ("classes", "goal", "words"),
    [
        ({"operation": "held"}, "pocket_impact_power_W", True),
        ({"idle": "held", "cruise": "held"}, "pocket_impact_power_W", True),
        ({"idle": "held", "cruise": "circling"}, "whirl_deviation_ratio", False),
        ({"operation": "undecided"}, "whirl_deviation_ratio", False),
        ({}, "whirl_deviation_ratio", False),
    ],
)
def test_command_line_goals_follow_the_class_of_the_cage(scene, monkeypatch, classes, goal, words):
    """Command line: impact power instead of the whirl ratio where the cage is held at every point, and a comment; a limit still names it."""
    found = {point: SimpleNamespace(name=name) for point, name in classes.items()}
    monkeypatch.setattr("doe.workflow.region.baseline_cages", lambda *study: found)
    monkeypatch.setattr("doe.workflow.region.slow_points", lambda *study: [*found])
    text, study = written(scene)
    goals = [response["name"] for response in study["response"] if response["goal"] == "min"]
    assert goals == ["impact_force_N", goal, "power_loss_W"]
    assert ("Cage: held in a short run" in text) == words == ("You can still name the whirl ratio" in text)
    _, limited = written(scene, "--limit", "whirl_deviation_ratio<=0.7")
    whirl = next(response for response in limited["response"] if response["name"] == "whirl_deviation_ratio")
    assert whirl["upper"] == 0.7 and whirl["goal"] == ("none" if words else "min")


def test_command_line_design_runs_of_a_bearing_that_settles_early_discard_fewer_turns(scene, monkeypatch):
    """Command line: 7 turns instead of 20, but confirmations discard 20; a cage that no short run traces keeps them."""
    monkeypatch.setattr("doe.workflow.region.slow_points", lambda *study: [])
    _, untraced = written(scene)
    monkeypatch.setattr(
        "doe.workflow.region.baseline_cages", lambda *study: {"operation": SimpleNamespace(name="circling")}
    )
    _, early = written(scene)
    for study, turns, kept in ((untraced, 20, []), (early, 7, ["numerics.discard_turns=20"])):
        assert f"numerics.discard_turns={turns}" in study["scene"]["set"]
        assert study["confirmation"]["set"] == ["numerics.rtol=0.01", *kept]


def test_unit_short_runs_of_a_baseline(scene, tmp_path):
    """Unit: one traces the cage with as few replicates as name a class, and is stored for the next; none where nothing traces it."""
    (tmp_path / "study.toml").write_text(written(scene)[0], encoding="utf-8")
    study, heard = Problem.load(tmp_path / "study.toml"), list[str]()
    effort = Effort(notice=lambda note: heard.append(str(note)))
    (cage,) = BASELINE_CAGES(study, tmp_path, effort).values()
    assert cage.name == "held" and cage.replicates == {"held": 6}
    slow_points(study, tmp_path, effort)
    assert heard == [
        "1 short run of 360 shaft turns for the class of the cage",
        "1 short run of 228 shaft turns for the turns to discard",
    ]
    with Store(tmp_path / STORE, "study") as store:
        assert len(store.ended()) == 2
    untraced = replace(study, file=study.file.model_copy(deep=True), built={})
    untraced.scene.set.append("verdict.trace=false")
    assert BASELINE_CAGES(untraced, tmp_path, Effort()) == {}


@pytest.mark.parametrize(
    ("name", "early", "slow"),
    [
        ("power_loss_W", 104.5, []),
        ("power_loss_W", 104.8, ["operation"]),
        ("impact_force_N", 95.2, ["operation"]),
        ("cage_slip", 1e3, []),
    ],
)
def test_unit_a_bearing_is_slow_by_its_goals(scene, tmp_path, monkeypatch, name, early, slow):
    """Unit: where 13 of 40 turns bias a goal by three quarters of its error, a run failed, or a goal without error moves by a thousandth."""
    (tmp_path / "study.toml").write_text(written(scene)[0], encoding="utf-8")
    study = Problem.load(tmp_path / "study.toml")
    usual = dict.fromkeys([*study.responses, "cage_slip"], Quantity(100.0, 2.0, 0.0, 40.0))

    def judged(*responses):
        results = [
            each if isinstance(each, Failure) else SimpleNamespace(responses=each, temperatures_C=None)
            for each in responses
        ]
        monkeypatch.setattr("doe.workflow.region._baseline_result", lambda *study: results.pop(0))
        return slow_points(study, tmp_path, Effort())

    assert judged(usual, usual | {name: Quantity(early, 2.0, 0.0, 40.0)}) == slow
    assert judged(usual, Failure("baseline", "stopped")) == ["operation"]
    unknown = usual | {"power_loss_W": Quantity(100.0, None, 0.0, 40.0)}
    assert judged(unknown, usual | {"power_loss_W": Quantity(100.2, None, 0.0, 40.0)}) == []
    assert judged(unknown, usual | {"power_loss_W": Quantity(100.5, None, 0.0, 40.0)}) == ["operation"]


def test_command_line_points_of_a_duty_discard_turns_alone(tmp_path, monkeypatch):
    """Command line: a slow point of the duty states its 20 turns, the others discard 7; where all are slow, the file states 20 for all."""
    (tmp_path / "duty.csv").write_text(
        "name,share,operation.inner_speed_rpm\nidle,0.2,6000\ncruise,0.8,20000\n", encoding="utf-8"
    )
    cages = {name: SimpleNamespace(name="circling") for name in ("idle", "cruise")}
    monkeypatch.setattr("doe.workflow.region.baseline_cages", lambda *study: cages)
    studies = []
    for slow in ([], ["idle"], ["idle", "cruise"]):
        monkeypatch.setattr("doe.workflow.region.slow_points", lambda *study, slow=slow: slow)
        _, study = written(EXAMPLES / "cylindrical_roller.toml", "--duty", tmp_path / "duty.csv")
        studies.append((study["scene"]["set"][1], *(point["set"][1:] for point in study["duty"])))
    few, many = "numerics.discard_turns=7", "numerics.discard_turns=20"
    assert studies == [(few, [], []), (few, [many], []), (many, [], [])]


def test_unit_the_turns_between_are_at_the_temperatures_of_a_heat_balance(tmp_path, monkeypatch):
    """Unit: a hot baseline is balanced once, at every point of its duty."""
    study, asked = Problem.load(EXAMPLES / "hot_clearance.toml"), []
    nodes = dict.fromkeys(("oil", "outer", "inner", "rollers"), Quantity(80.0, 0.1, 0.0, 40.0))
    usual = SimpleNamespace(
        responses=dict.fromkeys(study.responses, Quantity(100.0, 2.0, 0.0, 40.0)), temperatures_C=nodes
    )
    monkeypatch.setattr("doe.workflow.region._baseline_result", lambda study, run, *other: asked.append(run) or usual)
    assert slow_points(study, tmp_path, Effort()) == []
    hot, at = asked
    assert hot.thermal is not None and at.thermal is None
    assert at.lubricant.temperature_C == 80.0 and at.numerics.discard_turns == 7.0
