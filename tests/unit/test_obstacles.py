"""A study shows the original first, and ends in a report where a limit cannot be met: the best point and all obstacles at once."""

import json
from pathlib import Path

import numpy as np
import pytest
from instant_runs import instant_result, instantly, unillustrated
from short_studies import run_study, short_study, silent
from test_duty import IDLE_AND_CRUISE
from test_study_limits import IMPACT, biased, limited_study
from typer.testing import CliRunner

import doe
from doe import clearance
from doe.cli import app
from doe.workflow.confirmation import Limit
from doe.workflow.front import OutOfReachError
from doe.workflow.obstacles import MissedLimit, Obstacles
from doe.workflow.problem import Problem
from doe.workflow.status import study_stages
from doe.workflow.surfaces import reference_runs
from rbdyn.base.notes import Level, Note, of_level, ranked
from rbdyn.dynamics import simulate as module

QUICK = ("generations = 5", "generations = 15")


def instant(patch) -> list[int]:
    """Studies whose simulations and pictures take no time; returns the seeds that ran."""
    ran = instantly(patch)
    unillustrated(patch)
    return ran


def least_impact(study: Problem) -> float:
    """The smallest impact of the instant results in the region, but for their scatter."""
    low = study.by_factor(study.centre - study.reach * study.step)
    return 100.0 * low["pocket_clearance_mm"] + 30.0 * low["guide_clearance_mm"]


def commanded(path: Path, *options: str):
    """``doe study`` as a command."""
    return CliRunner().invoke(app, ["study", str(path), "--out", str(path.parent / "out"), *options])


def test_a_limit_that_no_point_keeps_ends_in_a_report_with_the_best_point(tmp_path, monkeypatch):
    ran = instant(monkeypatch.setattr)
    path = limited_study(tmp_path, "upper = 5.0", [QUICK])
    shown = commanded(path, "--json", "-q")
    assert shown.exit_code == 1
    record, out = json.loads(shown.stdout), tmp_path / "out"
    assert {"report.html", "answer.txt", "summary.json", "tables.xlsx", "confirmation.csv"} <= set(record["files"])
    assert record["status"] == "broken" and not record["obstacles"]["reachable"]
    # The original first, then the design and the best point alone: another one promises no smaller miss.
    first, *others = ran
    assert first > clearance.CONFIRMATION_SEEDS and len(ran) == 1 + 20 + 1
    assert all(seed < clearance.CONFIRMATION_SEEDS for seed in others[:20])
    (missed,) = record["obstacles"]["limits"]
    simulated = record["confirmation"]["pick"]["responses"]["impact_force_N"]["value"]
    assert missed["response"] == "impact_force_N" and missed["point"] is None and missed["bound"] == 5.0
    assert missed["excess"] == pytest.approx(simulated - 5.0) and missed["relaxed"] > simulated
    assert simulated == pytest.approx(least_impact(Problem.load(path)), abs=1.5)
    sentences = record["obstacles"]["sentences"]
    assert sentences[0].startswith("No point of the region meets all limits") and "relax the limits" in sentences[2]
    # The lower impact costs whirl, which this study wants large.
    worse, *obstacles = shown.stderr.splitlines()
    assert worse.startswith("danger: the selected design is worse than the baseline: whirl deviation ratio 31.")
    assert obstacles == sentences
    assert "No point of the region meets all limits" in (out / "report.html").read_text("utf-8")
    answer = (out / "answer.txt").read_text("utf-8")
    assert answer.index("No point of the region") < answer.index("Selected clearances") < answer.index("✗ violated")
    again = commanded(path, "-q")
    assert again.exit_code == 1 and "Finished before" in again.stdout and sentences[1] in again.stderr


def test_the_relaxed_limit_is_kept_and_a_farther_bound_is_named(tmp_path, monkeypatch):
    """Two newtons below the region's least: a wider pocket or guide meets it, by the surfaces, which are planes here."""
    instant(monkeypatch.setattr)
    bound = least_impact(Problem.load(limited_study(tmp_path))) - 2.0
    study = Problem.load(limited_study(tmp_path, f"upper = {bound!r}", [QUICK]))
    outcome = run_study(study, tmp_path, 1, lambda title: silent)
    (missed,), ways = outcome.obstacles.limits, outcome.obstacles.beyond
    assert {name for way in ways for name in way.values} <= {"pocket_clearance_mm", "guide_clearance_mm"} and ways
    for way in ways:
        point = study.by_factor(outcome.pick.point) | way.values
        impact = 100.0 * point["pocket_clearance_mm"] + 30.0 * point["guide_clearance_mm"]
        assert impact < bound + 1.0
        assert all(way.values[name] < way.bounds[name] for name in way.values)
    assert any("may be met beyond the region" in one and "(bound 0." in one for one in outcome.obstacles.sentences)
    (tmp_path / "relaxed").mkdir()
    relaxed = Problem.load(limited_study(tmp_path / "relaxed", f"upper = {missed.relaxed + 0.5!r}", [QUICK]))
    assert run_study(relaxed, tmp_path / "relaxed", 1, lambda title: silent).verdict == "kept"


def test_a_limit_that_only_the_surfaces_miss_is_kept_by_simulation(tmp_path, monkeypatch):
    biased(monkeypatch.setattr, -5.0)
    bound = least_impact(Problem.load(limited_study(tmp_path))) - 2.0
    path = limited_study(tmp_path, f"upper = {bound!r}", [QUICK])
    shown = commanded(path, "--json", "-q")
    record = json.loads(shown.stdout)
    assert (shown.exit_code, record["status"]) == (0, "ok")
    (worse,) = shown.stderr.splitlines()
    assert worse.startswith("danger: the selected design is worse than the baseline: whirl deviation ratio ")
    assert record["obstacles"]["sentences"] == [] and record["limits"]["impact_force_N"]["verdict"] == "kept"
    # The closest point keeps the limit, and so the surfaces, corrected by it, have a front of such points.
    assert record["tried"] == 2 and "try_1" in record["confirmation"]
    assert record["front"]["pick"]["reason"].endswith("corrected by the simulated points")
    assert len(record["front"]["front"]) > 1


def test_all_obstacles_are_named_at_once(tmp_path, monkeypatch):
    instant(monkeypatch.setattr)
    power = ('name = "power_loss_W"\n', 'name = "power_loss_W"\nupper = 1.0\n')
    path = limited_study(tmp_path, "upper = 5.0", [QUICK, power, ("half_width_mm = 0.005", "half_width_mm = 0.0001")])
    shown = commanded(path, "-q")
    assert shown.exit_code == 1
    record = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    obstacles = record["obstacles"]
    assert [limit["response"] for limit in obstacles["limits"]] == ["impact_force_N", "power_loss_W"]
    assert "pocket" in obstacles["chains"] and obstacles["chains"] == record["missed_chains"]
    for words in ("Limit impact force <= 5 N", "Limit power loss <= 1 W", "Chain pocket: "):
        assert words in shown.stderr
    # Without the broken limits the gains and the kept limits still have tolerances.
    assert record["tolerances"] and "keeps impact_force_N <= 5" not in record["tolerances_sentence"]
    assert "meet all limits" not in record["tolerances_sentence"]


def test_a_limit_that_the_tolerances_break_is_an_obstacle_too(tmp_path, monkeypatch):
    """The plain pick keeps it by simulation; parts at the ends of the stated tolerances would not, wherever they are."""
    instant(monkeypatch.setattr)
    aware = ('tolerance_aware = "none"', 'tolerance_aware = "worst_case"')
    path = limited_study(tmp_path, "upper = 24.8", [QUICK, aware])
    answer = doe.study(path, tmp_path / "out")
    assert answer["limits"]["impact_force_N"]["verdict"] == "kept" and answer["status"] == "missed"
    (sentence,) = answer["obstacles"]["sentences"]
    assert sentence.startswith(
        "No point meets all limits at the ends of the factors' own tolerances: the closest violates impact"
    )
    assert commanded(path, "-q").exit_code == 1


def test_no_obstacle_where_the_parts_about_the_simulated_design_keep_the_limit(tmp_path, monkeypatch):
    """By the surfaces no point has 95 % of its parts within the limit; by simulation, which is lower, the selected design has."""
    biased(monkeypatch.setattr, -1.0)
    aware = ('tolerance_aware = "none"', 'tolerance_aware = "quantile"')
    answer = doe.study(limited_study(tmp_path, "upper = 24.0", [QUICK, aware]), tmp_path / "quantile")
    assert "tolerance_aware" not in answer["front"]
    assert answer["status"] == "ok" and not answer["obstacles"]["sentences"]
    own = Problem.load(tmp_path / "study.toml").known_tolerances
    assert all(answer["tolerances"][name]["half_width"] >= width * (1.0 - 1e-9) for name, width in own.items())


def test_an_adaptive_search_that_comes_nowhere_near_leaves_the_pick_to_the_surfaces(tmp_path, monkeypatch):
    instant(monkeypatch.setattr)

    def nothing(*given):
        raise OutOfReachError(["no point of the region keeps all limits"])

    monkeypatch.setattr("doe.workflow.whole.find_adaptive", nothing)
    study = Problem.load(limited_study(tmp_path, "upper = 5.0", [QUICK]))
    outcome = run_study(study, tmp_path, 1, lambda title: silent, adaptive=True)
    assert outcome.adaptive is None and outcome.status == "broken" and not outcome.obstacles.reachable
    assert any("the adaptive search ended without a front" in note for note in outcome.notes)


def test_the_point_of_the_duty_that_misses_is_named(tmp_path, monkeypatch):
    """Impacts follow the speed: at cruise, twice as fast, the limit is out of reach; at idle it is kept."""
    instant(monkeypatch.setattr)
    usual = module.simulate

    def simulate(scene, *rest, **more):
        record = instant_result(scene).as_dict()
        for key in ("value", "statistical_error"):
            record["impact_force_N"][key] *= scene.operation.inner_speed_rpm / 6000.0
        return type(usual(scene, *rest, **more)).from_dict(record)

    monkeypatch.setattr(module, "simulate", simulate)
    idle = '[[duty]]\nname = "idle"\nshare = 0.5\nset = ["operation.inner_speed_rpm=6000.0"]\n'
    cruise = '[[duty]]\nname = "cruise"\nshare = 0.5\nset = ["operation.inner_speed_rpm=12000.0"]\n'
    path = limited_study(tmp_path, "upper = 40.0", [QUICK, ("[front]", f"{idle}{cruise}[front]")])
    said: list[str] = []
    answer = doe.study(path, tmp_path / "out", notice=said.append)
    (missed,) = answer["obstacles"]["limits"]
    assert (missed["response"], missed["point"]) == ("impact_force_N", "cruise")
    assert "Limit impact force <= 40 N at cruise is violated by " in answer["obstacles"]["sentences"][1]
    shown = [sentence for sentence in said if sentence.startswith("baseline design at ")]
    assert [sentence.split(":")[0] for sentence in shown] == ["baseline design at cruise", "baseline design at idle"]
    assert any(sentence.startswith("the baseline violates cruise: impact force <= 40 N by ") for sentence in said)


@pytest.mark.parametrize(("bound", "unlikely"), [(5.0, True), (44.0, False)])
def test_the_corners_say_before_the_design_ends_what_is_likely(bound, unlikely, tmp_path, monkeypatch):
    """The original misses both bounds; only the first is beyond a plane through the corners, followed to the bounds."""
    ran = instant(monkeypatch.setattr)
    path = limited_study(
        tmp_path, f"upper = {bound}", [QUICK, ("\nguide_clearance_mm = 0.15", "\nguide_clearance_mm = 0.6")]
    )
    said: dict[str, int] = {}
    doe.study(path, tmp_path / "out", workers=1, notice=lambda sentence: said.setdefault(sentence, len(ran)))
    # The time of the rest follows the machine.
    plan, original, missed, *others = [sentence for sentence in said if not sentence.startswith("the rest takes ")]
    assert plan.startswith("22 to 27 runs (baseline 1, design runs 20, ") and said[plan] == 0
    assert original.startswith("baseline design: impact force ") and said[original] == 1
    assert missed.startswith(f"the baseline violates impact force <= {bound:g} N by ") and said[missed] == 1
    likely = [sentence for sentence in others if sentence.startswith("likely no point meets impact force <= 5 N: ")]
    assert len(likely) == unlikely and all(8 < said[sentence] < 21 for sentence in likely)


@pytest.mark.parametrize(
    ("value", "error", "sense", "kept"),
    [(93.14, 2.0, "<=", 94.9), (93.14, 2.0, ">=", 91.4), (50.0, 0.0, "<=", 50.0), (0.02, 0.003, "<=", 0.0226)],
)
def test_unit_a_limit_is_relaxed_to_what_the_value_keeps(value, error, sense, kept):
    """Unit: rounded away from the value, so that the printed bound is kept with the probability demanded."""
    limit = Limit.judged("impact_force_N", sense, 40.0 if sense == "<=" else 120.0, value, error, 1.6449 / 1.96)
    assert limit.keepable == pytest.approx(kept, rel=1e-2)
    assert Limit.judged("impact_force_N", sense, limit.keepable, value, error, 1.6449 / 1.96).verdict == "kept"
    assert abs(limit.keepable - value) < 2.0 * error + 0.02 * value
    assert np.isnan(Limit.judged("cage_slip", sense, 1.0, np.nan, np.nan, 0.8).keepable), "nothing is reported"


@pytest.mark.parametrize(
    ("keys", "goal"),
    [
        ("upper = 90.0", "none"), ("lower = 10.0\nupper = 90.0", "none"), ("", "min"),
        ('upper = 90.0\ngoal = "min"', "min"), ("upper = 90.0\nweight = 2.0", "min"),
    ],
)  # fmt: skip
def test_unit_a_response_with_a_limit_alone_has_no_goal(tmp_path, keys, goal):
    """Unit: only a goal or a weight makes it one."""
    path = short_study(tmp_path)
    text = path.read_text("utf-8")
    assert IMPACT in text
    path.write_text(text.replace(IMPACT, f'name = "impact_force_N"\nmodel = "linear"\n{keys}'), "utf-8")
    assert Problem.load(path).file.response[0].goal == goal


def test_a_published_table_is_compared_by_the_columns_that_it_has(tmp_path, monkeypatch):
    instant(monkeypatch.setattr)
    path = limited_study(tmp_path, more=[QUICK])
    slip = '[[response]]\nname = "cage_slip"\nupper = 1.0\n\n[front]'
    path.write_text(path.read_text("utf-8").replace("[front]", slip, 1), "utf-8")
    study = Problem.load(path)
    table = reference_runs(study)
    assert table is not None and any(
        "has no column of cage_slip, which is not compared" in note for note in table.notes
    )
    assert np.isnan(table.values).all(axis=0).tolist() == [False, False, False, True]
    outcome = run_study(study, tmp_path, 1, lambda title: silent)
    assert [*outcome.published_comparisons] == study.responses[:3]
    assert any("cage_slip" in note for note in outcome.notes)


@pytest.mark.parametrize(("table", "robust"), [("", False), ("[robust]\npoints = 32\n", True)])
def test_unknown_inputs_are_judged_only_where_the_study_asks_for_it(table, robust, tmp_path):
    """A scene and a study that declare unknown inputs cost nothing by that."""
    path = short_study(tmp_path)
    law = '\n[uncertain]\n"cage.mass_g" = { law = "uniform", low = 40.0, high = 50.0 }\n'
    for file, more in ((tmp_path / "cylindrical_roller.toml", law), (path, law + table)):
        file.write_text(file.read_text("utf-8") + more, "utf-8")
    study = Problem.load(path)
    assert ("robust" in [stage.name for stage in study_stages(study)]) is robust
    assert "robust" in [stage.name for stage in study_stages(study, robust=True)]


def test_two_points_of_a_duty_are_shown_one_a_line(tmp_path, monkeypatch):
    """With -q nothing is said, and --json leaves standard output to one object."""
    instant(monkeypatch.setattr)
    path = limited_study(tmp_path, more=[QUICK, ("[front]", f"{IDLE_AND_CRUISE}\n[front]")])
    shown = commanded(path, "--json")
    json.loads(shown.stdout)
    lines = [line for line in shown.stderr.splitlines() if line.startswith("note: baseline design at ")]
    assert len(lines) == 2 and all("power loss " in line and " W" in line for line in lines)


def test_unit_what_to_relax_is_a_danger_ahead_of_a_worse_pick():
    """Unit: where no point keeps the limits, what would be kept stands behind that and ahead of what the selected design loses."""
    missed = MissedLimit("impact_force_N", None, "<=", 5.0, 37.0, 37.0, "undecided", 32.0, 56.0, 0.95)
    notes = Obstacles(False, (missed,), [], (), {}, "", {}).notes
    dangers = of_level(ranked([Note("worse", "the selected design is worse"), *notes]), Level.DANGER)
    assert [str(note) for note in dangers] == [
        *map(str, notes),
        "the selected design is worse",
    ] and "56 N would be met" in dangers[1]
    assert [note.level for note in Obstacles(True, (missed,), [], (), {}, "", {}).notes] == [Level.WARNING] * 2
