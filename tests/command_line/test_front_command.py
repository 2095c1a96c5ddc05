"""``doe front`` and the front of a study: what is asked in STUDY.toml, what is printed and what is refused."""

import json
import shutil

import numpy as np
import pytest
from pareto_cases import EXAMPLES, TABLE, TOLERANCES, edited_study, table_surfaces
from typer.testing import CliRunner

from doe.cli import app
from doe.study_file.sections import Tolerances
from doe.workflow.front import find_front, part_ends
from doe.workflow.front_record import SurfaceFront
from doe.workflow.tolerances import PickParts
from rbdyn.base.faults import InputError
from rbdyn.base.words import with_error

IMPACT = 'name = "impact_force_N"\nmodel = "linear"\ngoal = "min"'
POWER = 'name = "power_loss_W"\nmodel = "quadratic"\ngoal = "min"'


def front_of(folder, *replacements):
    """The record of the edited example on the published table."""
    study = edited_study(folder, *replacements)
    surfaces = table_surfaces(study)
    return (
        study,
        surfaces,
        SurfaceFront.of(study.with_surfaces(surfaces), find_front(study.with_surfaces(surfaces))).as_dict(),
    )


def command(study, *arguments):
    """The command on the published table, in this process."""
    return CliRunner().invoke(app, ["front", str(study.path), "--data", str(TABLE), *arguments])


def test_point_is_judged_beside_the_front(tmp_path):
    study = edited_study(tmp_path)
    shown = command(study, "--point", "0.017,0.187,0.285")
    assert shown.exit_code == 0, shown.output
    assert "the stated point" in shown.output and "which is within its error" in shown.output
    assert "dominates the baseline with probability" in " ".join(shown.output.split())
    by_name = "pocket_clearance_mm=0.285, radial_clearance_mm=0.017,guide_clearance_mm=0.187"
    record = json.loads(command(study, "--point", by_name, "--json").output)
    assert record["point"]["predicted_gains"]["impact_force_N"]["percent"] == pytest.approx(5.27, abs=0.01)
    assert not record["point"]["beyond_runs"] and record["point"]["dominated_by"] >= 0
    far = json.loads(command(study, "--point", "radial_clearance_mm=0.1", "--json").output)
    assert far["point"]["beyond_runs"] and "extrapolate there" in far["point"]["statement"]


def test_unit_a_cell_of_the_table_that_is_no_number_is_refused(tmp_path):
    """Unit: the front is never found on fewer factors or runs than the table has."""
    table = tmp_path / "runs.csv"
    table.write_text(TABLE.read_text("utf-8").replace("0.15,", "O.15,", 1), "utf-8")
    shown = CliRunner().invoke(app, ["front", str(edited_study(tmp_path).path), "--data", str(table)])
    assert shown.exit_code == 2 and " in row " in shown.stderr and "= 'O.15': is not a finite number" in shown.stderr


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0.017,0.187", "give a value for each factor"),
        ("radial=0.1", "no such factor; name one of"),
        ("0.017,wide,0.3", "guide_clearance_mm = wide: is not a finite number"),
        ("0.017,1e60,0.3", "is beyond 1e+50; check the unit"),
        ("guide_clearance_mm=0.1,guide_clearance_mm=0.2", "--point guide_clearance_mm: given 2 times; give it once"),
    ],
)
def test_bad_point_is_one_sentence(tmp_path, text, words):
    shown = command(edited_study(tmp_path), "--point", text)
    assert shown.exit_code == 2
    assert words in shown.stderr and len(shown.stderr.strip().splitlines()) == 1


def test_record_carries_errors_convergence_and_gains(tmp_path):
    study, _, record = front_of(tmp_path)
    assert len(record["hypervolume_history"]) == 30
    assert record["hypervolume_history"][-1] == pytest.approx(record["hypervolume"])
    assert set(record["picks"]) == {"knee", "desirability", "weights"}
    assert record["picks"]["knee"]["factors"] == record["pick"]["factors"]
    for point in record["front"]:
        assert all(error > 0.0 for error in point["errors"].values())
        assert 0.0 < point["non_dominated_probability"] <= 1.0
    assert set(record["predicted_gains"]) == set(study.responses)
    for gain in record["predicted_gains"].values():
        assert gain["verdict"] in ("better", "worse", "within error")
        assert gain["error_percent"] > 0.0


def test_goals_limits_and_rule_of_the_file_are_kept(tmp_path):
    impact = IMPACT.replace('"min"', '"target"\ntarget = 190.0')
    power = POWER.replace('"min"', '"none"\nupper = 400.0\nlower = 380.0')
    study, _, record = front_of(tmp_path, (IMPACT, impact), (POWER, power), ("[front]", '[front]\npick = "weights"'))
    assert set(record["ideal"]) == {"impact_force_N", "whirl_deviation_ratio"}
    # The back-off from the limits of the loss, whose surface misses much, keeps the impact off its target.
    assert 189.5 < record["ideal"]["impact_force_N"] < 210.0
    assert "required probability of 0.95" in record["pick"]["reason"]
    assert all(380.0 <= point["responses"]["power_loss_W"] <= 400.0 for point in record["front"])
    assert [limit["sense"] for limit in record["constraints"]] == [">=", "<="]
    assert all(limit["kept"] for limit in record["constraints"])
    assert record["pick"]["factors"] == record["picks"]["weights"]["factors"]
    assert set(record["predicted_gains"]) == {"impact_force_N", "whirl_deviation_ratio"}
    shown = command(study)
    for limit in record["constraints"]:
        assert limit["demanded_probability"] == 0.95 and limit["error"] > 0.0
        # The odds follow from value and error, whatever was demanded.
        room = 400.0 - limit["value"] if limit["sense"] == "<=" else limit["value"] - 380.0
        assert (limit["probability"] > 0.5) == (room > 0.0)
        sense = {"<=": "≤", ">=": "≥"}[limit["sense"]]
        row = (line for line in shown.output.splitlines() if f"power loss [W] {sense}" in line)
        cells = next(row).partition(sense)[2].split("  ")
        assert with_error(limit["value"], limit["error"]) in [cell.strip() for cell in cells]
    assert "power loss [W] ≤ 400" in shown.output and "required" in shown.output
    assert "feasible share 0." in shown.output


def test_larger_is_better_where_the_goal_says_so(tmp_path):
    _, _, record = front_of(tmp_path, (POWER, POWER.replace('"min"', '"max"')))
    assert record["ideal"]["power_loss_W"] > record["nadir"]["power_loss_W"]
    assert record["ideal"]["power_loss_W"] == max(p["responses"]["power_loss_W"] for p in record["front"])


def test_impossible_limit_is_one_sentence_with_the_least_violation(tmp_path):
    study = edited_study(tmp_path, (POWER, POWER + "\nupper = 300.0"))
    shown = command(study)
    assert shown.exit_code == 2 and "Traceback" not in shown.output
    assert "no point of the region meets all limits" in shown.stderr
    # The least power loss of the region is 364.95 W.
    assert "violates power_loss_W <= 300 by 64.9" in shown.stderr
    assert len(shown.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("replace", "words"),
    [
        ((IMPACT, IMPACT.replace('"min"', '"target"')), "response[1].target: missing"),
        ((IMPACT, IMPACT + "\ntarget = 3.0"), 'target = 3.0: goal = "min" has none'),
        ((IMPACT, IMPACT + "\nlower = 3.0\nupper = 2.0"), "lower = 3.0: must be below upper = 2.0"),
    ],
)
def test_goals_that_make_no_sense_are_refused_with_their_key(tmp_path, replace, words):
    with pytest.raises(InputError) as refused:
        edited_study(tmp_path, replace)
    assert any(words in fault and "response[1]." in fault for fault in refused.value.faults), refused.value.faults


def test_one_goal_has_no_front(tmp_path):
    with pytest.raises(InputError, match="a front needs two responses with a goal"):
        front_of(tmp_path, ('goal = "min"', 'goal = "none"'))


@pytest.mark.parametrize("kind", ["worst_case", "quantile"])
def test_tolerance_aware_front_stands_beside_the_plain_one(tmp_path, kind):
    asked = ("[front]", f'[front]\ntolerance_aware = "{kind}"')
    study, surfaces, record = front_of(tmp_path, *TOLERANCES, asked)
    found = record["tolerance_aware"]
    # The chain's half width is the tolerance of the factor that has none of its own.
    assert found["half_widths"] == pytest.approx(
        {"radial_clearance_mm": 0.001, "guide_clearance_mm": 0.01, "pocket_clearance_mm": 0.005}
    )
    for point in found["front"]:
        assert all(point["robust"][name] >= point["responses"][name] for name in study.responses)
    assert record["picks"]["tolerance_aware"] == found["pick"]
    assert found["pick"]["robust"].keys() == found["plain_pick_robust"].keys()
    assert 0.0 <= found["nominal_loss_percent"] < 20.0 < 100.0 * found["survival"]["pick"]
    if kind == "worst_case":
        shown = command(study)
        assert "Parts that still beat the baseline" in shown.output
        # Corners of the selected design's own box are no worse than its worst case.
        corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
        offsets = corners * list(found["half_widths"].values())
        centre = np.array(list(found["pick"]["factors"].values()))
        for surface in surfaces:
            values = surface.predict((centre + offsets - study.centre) / study.step)
            assert values.max() <= found["pick"]["robust"][surface.name] + 1e-9


def test_missing_and_too_wide_tolerances_are_named(tmp_path):
    asked = ("[front]", '[front]\ntolerance_aware = "worst_case"')
    with pytest.raises(InputError) as refused:
        front_of(tmp_path, TOLERANCES[0], asked)
    assert [fault.split(":")[1] for fault in refused.value.faults] == [" factor.tolerance of guide_clearance_mm"]
    with pytest.raises(InputError, match="leaves no space in the region"):
        front_of(tmp_path, TOLERANCES[0], (TOLERANCES[1][0], TOLERANCES[1][1].replace("0.01", "0.2")), asked)


def test_no_part_lies_where_no_bearing_is_possible(tmp_path):
    shutil.copy(EXAMPLES / "cylindrical_roller.toml", tmp_path)
    wide = (TOLERANCES[1][0], TOLERANCES[1][1].replace("0.01", "0.08"))
    study = edited_study(tmp_path, TOLERANCES[0], wide, ("[front]", '[front]\ntolerance_aware = "quantile"'))
    (low, high), place = study.ends.T, study.factors.index("guide_clearance_mm")
    width = np.array(list(study.known_tolerances.values()))
    assert low[place] < width[place], "parts at the lower bound would have no clearance in the guide"
    possible = np.where(np.arange(3) == place, low, low - width)
    ends = part_ends(study).T
    assert ends == pytest.approx(np.array([possible, high + width]))
    study = study.with_surfaces(table_surfaces(study))
    aware = find_front(study).tolerance_aware
    assert study.actual(aware.points)[:, place].min() >= low[place] + width[place] - 1e-12
    widest = PickParts(
        study, np.array([0.0136, low[place] + 0.001, 0.301]), Tolerances(gains=["impact_force_N"], keep=0.01)
    ).widest()
    assert widest.half_widths[place] <= 0.001 + 1e-12


def test_widest_tolerances_of_a_study_keep_what_they_say(tmp_path):
    study = edited_study(tmp_path, *TOLERANCES)
    surfaces = table_surfaces(study)
    point = np.array([0.0136, 0.184, 0.301])
    found = PickParts(study.with_surfaces(surfaces), point, Tolerances(gains=study.responses)).widest()
    ratios = list(study.known_tolerances.values())
    assert found.half_widths / ratios == pytest.approx([found.half_widths[0] / ratios[0]] * 3)
    # Counted afresh: parts that keep half of every gain.
    random = np.random.default_rng(7)
    parts = point + found.half_widths * (random.standard_normal((20000, 3)) / 3).clip(-1, 1)
    kept = np.ones(len(parts), dtype=bool)
    for surface in surfaces:
        at = [surface.predict((each - study.centre) / study.step) for each in (study.baseline, point, parts)]
        kept &= at[2] <= at[0] - 0.5 * (at[0] - at[1])
    assert kept.mean() == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize(
    "place", ["doe.workflow.front.front", "doe.workflow.surfaces.fit", "doe.workflow.design._design"]
)
def test_invariant_a_slip_of_the_code_is_not_called_bad_input(tmp_path, monkeypatch, place):
    """Invariant: an error of a library below a command is raised on as what it is, with no file or key named in it."""
    study, _, _ = front_of(tmp_path)

    def slip(*arguments, **options):
        raise ValueError("attempt to get argmax of an empty sequence")

    monkeypatch.setattr(place, slip)
    shown = command(study)
    assert shown.exit_code == 1 and type(shown.exception) is ValueError
    assert "empty sequence" not in shown.output
