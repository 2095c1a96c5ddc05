"""A study over a duty: runs at every point, figures of all points with their errors, and what the selected design costs at each."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from instant_runs import instant_result, instantly, unillustrated, with_figures
from scipy import stats
from short_studies import EXAMPLES, rows, run_design, run_study, short_study, silent

from doe.clearance import Simulations
from doe.duty import Duty, DutyResult, Rule, quotient
from doe.emulator import NoisyValues
from doe.report.files import summary
from doe.running.store import Failure, Store
from doe.workflow.confirmation import Choice, confirm, every_limit, simulate_original
from doe.workflow.duty import study_at
from doe.workflow.problem import Problem
from doe.workflow.robust import case_of_study
from rbdyn.base.estimate import Estimate, quantile
from rbdyn.base.faults import InputError, RunError
from rbdyn.dynamics import simulate as simulate_module
from rbdyn.result import Quantity
from rbdyn.scene import Scene

SLOW = 'set = ["operation.inner_speed_rpm=6000"]'
IDLE_AND_CRUISE = f"""
[[duty]]
name = "idle"
share = 0.25
{SLOW}

[[duty]]
name = "cruise"
share = 0.75
"""
POWER = 'name = "power_loss_W"\n'
IMPACT = 'name = "impact_force_N"\n'


def duty_study(folder, duty, *more):
    """The short example over a duty; ``more``: texts to replace in it."""
    folder.mkdir(exist_ok=True)
    path = short_study(folder)
    text = path.read_text(encoding="utf-8").replace("[front]", f"{duty}\n[front]", 1)
    for old, new in more:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    return Problem.load(path)


def designed(study, folder):
    return run_design(study, folder, 1, silent)


def confirmed_at(study, point):
    with Store(study.path.parent / "study.sqlite", "study") as store:
        simulations = Simulations(store, 1, None, False, lambda title: silent)
        return confirm(study, simulate_original(study, simulations), {"pick": Choice(point, "")}, simulations)[0]


def figures_of(patch, figures):
    """Let simulations end at once with ``figures(scene)`` by name: value, half-width of 95 %, degrees of freedom."""
    ran = instantly(patch)

    def simulate(scene, *rest, **more):
        ran.append(scene.numerics.seed)
        found = {name: Quantity(value, half, 0.0, 10.0, dof) for name, (value, half, dof) in figures(scene).items()}
        return with_figures(instant_result(scene), **found)

    patch(simulate_module, "simulate", simulate)
    return ran


ALONE = '[[duty]]\nname = "only"\nshare = 1.0\n'
TWICE = '[[duty]]\nname = "b"\nshare = 0.5\n[[duty]]\nname = "a"\nshare = 0.5\n'


def test_one_point_alone_gives_the_bits_of_the_plain_study(tmp_path, monkeypatch):
    """The same runs by their keys, and the same figures, errors and freedom of design and confirmation."""
    instantly(monkeypatch.setattr)
    found = []
    for name, duty in (("plain", ""), ("over", ALONE)):
        study = duty_study(tmp_path / name, duty, (POWER, f"{POWER}upper = 200.0\n"))
        runs = designed(study, study.path.parent)
        confirmed = confirmed_at(study, study.baseline + 0.5 * study.step)
        arrays = [getattr(runs, key).tolist() for key in ("coded", "actual", "values", "errors", "replicates")]
        parts = [array.tolist() for point in confirmed.values() for array in map(np.asarray, point.estimate.joint)]
        limits = [limit.verdict for limit in every_limit(study, confirmed["pick"])]
        found.append((set(rows(study.path.parent / "study.sqlite")), arrays, runs.notes, parts, limits))
    assert found[0] == found[1]


def test_two_equal_points_with_half_of_the_time_give_the_record_of_the_plain_study(tmp_path, monkeypatch):
    """No further runs, and the same record to the last bit, whatever the aggregate."""
    ran = instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    limit = (POWER, f"{POWER}upper = 200.0\n")
    plain = duty_study(tmp_path / "plain", "", limit)
    over = duty_study(tmp_path / "over", TWICE, limit, (IMPACT, f'{IMPACT}aggregate = "worst"\n'))
    records, counts = [], []
    for study in (plain, over):
        records.append(summary(run_study(study, study.path.parent, 1, lambda title: silent)).as_dict())
        counts.append(len(ran))
        ran.clear()
    assert counts[0] == counts[1]
    own = records[1].pop("duty")
    assert [point["name"] for point in own["points"]] == ["b", "a"]
    assert own["points"][0]["pick"] == records[0]["confirmation"]["pick"]["responses"]
    alone = records[0]["front"]["pick"]["factors"]
    assert own["points"][0]["own"]["factors"] == pytest.approx(alone, abs=5.01e-4)
    for response in records[1]["asked"]["responses"]:
        del response["aggregate"], response["points"]
    for record in records:
        for key in ("cost", "inputs", "identity"):
            del record[key]
    assert json.dumps(records[0], default=str) == json.dumps(records[1], default=str)


def test_the_order_of_the_points_changes_nothing(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr)
    limit = (POWER, f'{POWER}upper = 400.0\naggregate = "worst"\n')
    points = IDLE_AND_CRUISE.strip().split("\n\n")
    studies = [duty_study(tmp_path / str(n), "\n".join(order), limit) for n, order in enumerate((points, points[::-1]))]
    first, second = (designed(study, study.path.parent) for study in studies)
    assert studies[0].responses == studies[1].responses
    for name in ("values", "errors", "replicates"):
        assert np.array_equal(getattr(first, name), getattr(second, name))
        assert list(first.at_points) == list(second.at_points) == ["cruise", "idle"]


def test_points_cost_a_run_each_unless_their_scenes_are_one(tmp_path, monkeypatch):
    """Two points take twice the 20 runs; a third one with the scene of the first, and the baseline of ratios once more, nothing."""
    ran = instantly(monkeypatch.setattr)
    same = '[[duty]]\nname = "taxi"\nshare = 0.0\nset = ["operation.inner_speed_rpm=6000.0"]\n'
    study = duty_study(tmp_path, IDLE_AND_CRUISE + same, (POWER, f'{POWER}aggregate = "worst_relative"\n'))
    designed(study, tmp_path)
    assert len(ran) == 2 * 20 + 2
    ran.clear()
    assert len(designed(study, tmp_path).values) == 20
    confirmed = confirmed_at(study, study.baseline + 0.5 * study.step)
    # The baseline's confirmation ran before, as the divisor of the ratios.
    assert len(ran) == 2
    place = study.responses.index("power_loss_W")
    assert confirmed["baseline"].values[place] == 1.0
    assert confirmed["baseline"].error[place] == 0.0


def test_every_point_of_a_run_has_its_seed(tmp_path):
    study = duty_study(tmp_path, IDLE_AND_CRUISE)
    runs = study.design_scenes(study.baseline[None].repeat(2, axis=0))
    seeds = [[scene.numerics.seed for scene in run.scenes.values()] for run in runs]
    assert seeds == [[1, 1], [2, 2]]
    assert [scene.operation.inner_speed_rpm for scene in runs[0].scenes.values()] == [24000.0, 6000.0]
    (search,) = study.adaptive_scenes(study.baseline[None], [3], 7)
    assert {scene.numerics.replicates for scene in search.scenes.values()} == {3}


@pytest.mark.parametrize(
    ("idle", "aggregate", "replicates", "confirmed_with"),
    [
        (0.2, "mean", [2, 4], 6),
        (0.3, "mean", [2, 4], 8),
        (0.2, "worst_relative", [4, 4], 16),
        (0.4, "mean", [4, 4], 16),
    ],
)
def test_minor_points_have_a_part_of_the_replicates(tmp_path, idle, aggregate, replicates, confirmed_with):
    """Unit: a half or a quarter, as their share over the main one, where all goals are means; confirmed ones still name a class."""
    duty = IDLE_AND_CRUISE.replace("0.25", str(idle)).replace("0.75", str(1.0 - idle))
    study = duty_study(
        tmp_path, duty, (IMPACT, f'{IMPACT}aggregate = "{aggregate}"\n'), ("replicates=2", "replicates=8")
    )
    assert (study.first_replicates, study.further_replicates) == (4, 4)
    for further in (False, True):
        for run in study.design_scenes(study.plan.actual, study.design.order.tolist(), further=further):
            assert [run.scenes[name].numerics.replicates for name in ("idle", "cruise")] == replicates
    for count, is_brief, every, half in (
        (16, False, 16, confirmed_with),
        (8, False, 8, 6),
        (2, False, 2, 2),
        (16, True, 4, 2),
    ):
        asked = study.with_file(confirmation=study.file.confirmation.model_copy(update={"replicates": count}))
        confirmed = asked.confirmation_run(asked.baseline, in_brief=is_brief).scenes
        expected = [half if replicates[0] < replicates[1] else every, every]
        assert [confirmed[name].numerics.replicates for name in ("idle", "cruise")] == expected


def test_equal_points_are_minor_by_their_share_together():
    """Unit: two points of one scene count as one."""
    rule = Rule("mean", "min", None)
    shares = {"cruise": 0.6, "idle": 0.15, "wait": 0.15, "take-off": 0.1}
    overrides = {"cruise": [], "idle": ["a=1"], "wait": ["a=1"], "take-off": ["a=2"]}
    assert Duty(shares, overrides, {"power_loss_W": rule}).minor == {("a=1",): 2, ("a=2",): 4}


def test_the_optimum_of_the_mean_lies_between_those_of_the_points(tmp_path, monkeypatch):
    """Impact is least at pocket clearance 0.26 mm when fast and at 0.34 mm when slow: by half of the time each, at 0.30 mm."""

    def figures(scene):
        best = 0.26 if scene.operation.inner_speed_rpm > 1e4 else 0.34
        bowl = 100.0 + 1e4 * (scene.cage.pocket_clearance_mm - best) ** 2
        guide = 1e3 * (scene.cage.guide_clearance_mm - 0.15) ** 2
        return {"impact_force_N": (bowl + guide, 0.02, 9), "power_loss_W": (2.0 * bowl + guide, 0.02, 9)}

    figures_of(monkeypatch.setattr, figures)
    unillustrated(monkeypatch.setattr)
    duty = IDLE_AND_CRUISE.replace("0.25", "0.5").replace("0.75", "0.5")
    quadratic = ('model = "linear"', 'model = "quadratic"')
    text = ('model = "quadratic"\ngoal = "min"', 'model = "linear"\ngoal = "none"')
    front = ("generations = 5", "generations = 40")
    start = ("pocket_clearance_mm = 0.30", "pocket_clearance_mm = 0.36")
    mounted = ("bore_mm=27.0", "outside_diameter_mm=60.0", "housing_diameter_mm=80.0", "outer_ring_temperature_C=100.0")
    keys = ", ".join(f'"mounting.{key}"' for key in (*mounted, "inner_ring_temperature_C=100.0"))
    scene = ("set = [", f"set = [{keys}, ")
    hot = duty.replace(SLOW, SLOW.replace("]", ', "mounting.inner_ring_temperature_C=120.0"]'))
    study = duty_study(tmp_path, hot, scene, text, quadratic, front, start, ('tolerance_aware = "quantile"', ""))
    outcome = run_study(study, tmp_path, 1, lambda title: silent)
    place = study.factors.index("pocket_clearance_mm")
    assert outcome.pick.point[place] == pytest.approx(0.30, abs=0.006)
    alone = {point.name: point.own.factors[study.factors[place]] for point in outcome.duty.points}
    assert alone == pytest.approx({"idle": 0.34, "cruise": 0.26}, abs=0.006)
    # A hot inner ring takes of the radial clearance.
    play = {point.name: point.operating_clearances_mm["radial_clearance_mm"] for point in outcome.duty.points}
    assert play["idle"]["pick"] < play["cruise"]["pick"] - 0.005
    # The compromise costs 1e4 (0.04 mm)^2 = 16 N of 116 N at either point.
    for point in outcome.duty.points:
        cost = point.own.gains_over_pick["impact_force_N"]
        assert cost.percent == pytest.approx(100.0 * 16.0 / 116.0, abs=2.5)
        assert cost.verdict == "better"


def test_a_failed_point_fails_the_run_by_name(tmp_path, monkeypatch):
    def simulate(scene, *rest, **more):
        if scene.operation.inner_speed_rpm == 6000.0 and scene.numerics.seed == 3:
            raise RunError("the oil froze")
        return instant_result(scene)

    instantly(monkeypatch.setattr)
    monkeypatch.setattr(simulate_module, "simulate", simulate)
    runs = designed(duty_study(tmp_path, IDLE_AND_CRUISE), tmp_path)
    assert len(runs.values) == 19
    assert runs.failures == (Failure("design run 3", "at idle: the oil froze", 3, runs.failures[0].factors),)


def test_limits_hold_at_the_points_that_the_response_names(tmp_path, monkeypatch):
    """Power is 100 W at idle and 400 W at cruise; 300 W is broken at cruise alone, and the mean of 325 W is no matter."""

    def figures(scene):
        return {"power_loss_W": (100.0 if scene.operation.inner_speed_rpm < 1e4 else 400.0, 1.0, 9)}

    figures_of(monkeypatch.setattr, figures)
    verdicts = {}
    for points in ('["idle"]', '["cruise", "idle"]'):
        study = duty_study(
            tmp_path / points[2:6], IDLE_AND_CRUISE, (POWER, f"{POWER}upper = 300.0\npoints = {points}\n")
        )
        confirmed = confirmed_at(study, study.baseline)
        assert confirmed["pick"].values[study.responses.index("power_loss_W")] == 325.0
        verdicts[points] = {limit.response: limit.verdict for limit in every_limit(study, confirmed["pick"])}
    assert verdicts == {
        '["idle"]': {"idle: power_loss_W": "kept"},
        '["cruise", "idle"]': {"cruise: power_loss_W": "broken", "idle: power_loss_W": "kept"},
    }
    alone = study_at(study, "cruise")
    assert [(response.name, response.upper) for response in alone.file.response][-1] == ("power_loss_W", 300.0)


FAULTS = {
    "factor": (
        IDLE_AND_CRUISE.replace(SLOW, 'set = ["cage.pocket_clearance_mm=0.2"]'),
        "duty.set of idle = 'cage.pocket_clearance_mm=0.2': is a factor",
    ),
    "seed": (
        IDLE_AND_CRUISE.replace(SLOW, 'set = ["numerics.seed=4"]'),
        "duty.set of idle = 'numerics.seed=4': every run has a seed of its own",
    ),
    "nothing": (IDLE_AND_CRUISE.replace("0.25", "0.0").replace("0.75", "0.0"), "duty.share: is 0 at every point"),
}


@pytest.mark.parametrize(("duty", "sentence"), FAULTS.values(), ids=FAULTS.keys())
def test_a_faulty_duty_is_one_sentence(tmp_path, duty, sentence):
    with pytest.raises(InputError) as caught:
        duty_study(tmp_path, duty)
    (fault,) = caught.value.faults
    assert sentence in fault


@pytest.mark.parametrize(
    ("duty", "keys", "sentence"),
    [
        (IDLE_AND_CRUISE, 'upper = 300.0\npoints = ["landing"]', "'landing': no such point of the duty; name one of"),
        (IDLE_AND_CRUISE, 'points = ["idle"]', "has no limit to hold there"),
        (IDLE_AND_CRUISE, "upper = 300.0\npoints = []", "points = []: must have at least 1 item(s)"),
        ("", 'aggregate = "worst"', "response.aggregate of power_loss_W: needs points of a duty"),
        ("", 'upper = 300.0\npoints = ["idle"]', "response.points of power_loss_W: needs points of a duty"),
    ],
)
def test_a_faulty_key_of_a_response_is_one_sentence(tmp_path, duty, keys, sentence):
    with pytest.raises(InputError) as caught:
        duty_study(tmp_path, duty, (POWER, f"{POWER}{keys}\n"))
    (fault,) = caught.value.faults
    assert sentence in fault


def test_an_impossible_scene_names_its_point(tmp_path):
    study = duty_study(tmp_path, IDLE_AND_CRUISE.replace("rpm=6000", "rpm=1e9"))
    with pytest.raises(InputError) as caught:
        study.design_scenes(study.baseline[None])
    (fault,) = caught.value.faults
    assert "duty.set of idle: " in fault
    assert "operation.inner_speed_rpm" in fault


def test_temperatures_have_no_ratio(tmp_path):
    heat = '[[response]]\nname = "oil_temperature_C"\naggregate = "worst_relative"\n[front]'
    study = duty_study(tmp_path, IDLE_AND_CRUISE, ("[front]", heat), ("set = [", 'set = ["thermal.ambient_C=40.0", '))
    with pytest.raises(InputError, match="temperatures in °C have no ratio"):
        study.check_responses()


def test_shares_are_normalised_on_request(tmp_path):
    hours = IDLE_AND_CRUISE.replace("0.25", "300").replace("0.75", "700").replace("share = 300", "share = 300.0")
    study = duty_study(tmp_path, hours.replace("700", "700.0"), ("[scene]", "normalise_shares = true\n[scene]"))
    assert study.shares == {"cruise": 0.7, "idle": 0.3}


ANY = instant_result(Scene.load(EXAMPLES / "cylindrical_roller.toml"))


def result_of(rule, parts, shares, baseline=None, errors=True):
    """Result of one figure, impact force, over a duty of quantities by name of the point."""
    duty = Duty(shares, {name: [] for name in shares}, {"impact_force_N": rule})
    sides = [
        {
            name: replace(with_figures(ANY, impact_force_N=part), scene={"of": kind, "at": name})
            for name, part in quantities.items()
        }
        for kind, quantities in (("run", parts), ("baseline", baseline or {}))
    ]
    return DutyResult(duty, sides[0], tuple((name,) for name in parts), sides[1], errors)


def test_a_mean_has_the_errors_of_its_parts_by_their_weights():
    """Statistical errors add in root mean square with the freedom of Welch and Satterthwaite, numerical ones linearly."""
    parts = {"a": Quantity(10.0, 1.0, 0.2, 30.0, 8), "b": Quantity(30.0, 4.0, 0.4, 20.0, 5)}
    mean = result_of(Rule("mean", "min", None), parts, {"a": 0.25, "b": 0.75}).responses["impact_force_N"]
    variances = [(0.25 * 1.0 / stats.t.ppf(0.975, 8)) ** 2, (0.75 * 4.0 / stats.t.ppf(0.975, 5)) ** 2]
    freedom = math.floor(sum(variances) ** 2 / (variances[0] ** 2 / 8 + variances[1] ** 2 / 5))
    assert mean.value == 25.0
    assert mean.degrees_of_freedom == freedom == 5
    assert mean.statistical_error == pytest.approx(stats.t.ppf(0.975, freedom) * math.sqrt(sum(variances)))
    assert mean.numerical_error == pytest.approx(0.25 * 0.2 + 0.75 * 0.4)
    unknown = result_of(
        Rule("mean", "min", None), parts | {"b": Quantity(30.0, None, None, 1.0)}, {"a": 0.5, "b": 0.5}
    ).responses
    assert unknown["impact_force_N"].statistical_error is None
    assert unknown["impact_force_N"].numerical_error is None


@pytest.mark.parametrize(
    ("goal", "target", "worst", "point"),
    [("min", None, 30.0, "b"), ("max", None, 10.0, "a"), ("target", 24.0, 10.0, "a")],
)
def test_the_worst_point_is_that_of_the_goal(goal, target, worst, point):
    parts = {"a": Quantity(10.0, 0.1, 0.2, 30.0, 8), "b": Quantity(30.0, 0.4, 0.4, 20.0, 5)}
    result = result_of(Rule("worst", goal, target), parts, {"a": 0.25, "b": 0.75})
    # Far from each other, it is that point with its own errors.
    assert result.responses["impact_force_N"] == replace(parts[point], value=worst)
    assert result.worst == {"impact_force_N": (point, 1.0)}


def test_the_cage_jitters_at_the_points_that_say_so():
    """At a the orbit takes 0.05 of the play, at b 0.4: the whirl of the duty is in part that of a jitter."""
    parts = dict.fromkeys("ab", Quantity(1.0, 0.1, 0.1, 10.0, 9))
    result = result_of(Rule("mean", "min", None), parts, {"a": 0.5, "b": 0.5})
    shares = {"a": 0.05, "b": 0.4}
    orbits = {name: Quantity(share, 0.01, 0.0, 10.0, 9) for name, share in shares.items()}
    points = {name: with_figures(part, cage_orbit_radius_share=orbits[name]) for name, part in result.points.items()}
    moved = replace(result, points=points)
    assert moved.jitters
    assert moved.jitter_points == ("a",)
    assert moved.cage_orbit_radius_share == orbits["a"]


def test_a_worst_ratio_has_the_errors_of_the_baseline_too():
    """1.1 and 0.5 of the baseline: the larger ratio, whose relative variances add."""
    parts = {"a": Quantity(110.0, 2.0, 0.5, 30.0, 8), "b": Quantity(10.0, 0.1, 0.0, 20.0, 5)}
    base = {"a": Quantity(100.0, 3.0, 0.5, 30.0, 8), "b": Quantity(20.0, 0.1, 0.0, 20.0, 5)}
    result = result_of(Rule("worst_relative", "min", None), parts, {"a": 0.5, "b": 0.5}, base)
    ratio = result.responses["impact_force_N"]
    variances = (np.array([2.0, 1.1 * 3.0]) / 100.0 / stats.t.ppf(0.975, 8)) ** 2
    freedom = math.floor(variances.sum() ** 2 / (variances**2 / 8).sum())
    assert ratio.value == pytest.approx(1.1)
    assert ratio.degrees_of_freedom == freedom
    assert ratio.statistical_error == pytest.approx(stats.t.ppf(0.975, freedom) * math.sqrt(variances.sum()))
    assert ratio.numerical_error == pytest.approx((0.5 + 1.1 * 0.5) / 100.0)
    assert quotient(parts["a"], base["a"], False).statistical_error == pytest.approx(0.02)
    zero = base | {"b": Quantity(0.05, 0.1, 0.0, 20.0, 5)}
    with pytest.raises(RunError, match=r"at b is .*, not above 0 by more than its error"):
        assert result_of(Rule("worst_relative", "min", None), parts, {"a": 0.5, "b": 0.5}, zero).responses is None


@pytest.mark.parametrize("truth", [(100.0, 40.0, 30.0), (100.0, 99.0, 97.0), (100.0, 100.0, 100.0)], ids=str)
def test_the_interval_of_the_worst_holds_the_truth(truth):
    """Coverage over 400 seeds of a duty with known figures, scattering by 2 with 9 degrees of freedom; it is nominally 0.95."""
    random, rule, caught = np.random.default_rng(5), Rule("worst", "min", None), 0
    for _ in range(400):
        errors = 2.0 * np.sqrt(random.chisquare(9, 3) / 9)
        halves = (errors * stats.t.ppf(0.975, 9)).tolist()
        values = (np.array(truth) + 2.0 * random.standard_normal(3)).tolist()
        parts = {name: Quantity(x, h, 0.0, 10.0, 9) for name, x, h in zip("abc", values, halves, strict=True)}
        worst = result_of(rule, parts, dict.fromkeys("abc", 1.0 / 3.0)).responses["impact_force_N"]
        caught += abs(worst.value - max(truth)) <= worst.statistical_error
    assert 0.92 <= caught / 400 <= 0.98


def test_the_largest_of_level_figures_is_less_biased_than_the_largest_estimate():
    values = np.random.default_rng(2).standard_normal((100, 6))
    errors, freedom = np.ones_like(values), np.full_like(values, np.inf)
    naive, corrected = values.max(axis=1).mean(), Estimate(values, errors, freedom).largest()[0].value.mean()
    assert naive > 1.1
    assert abs(corrected) < 0.6


def test_figures_without_errors_are_simply_compared():
    values = np.array([[3.0, 5.0]])
    exact = Estimate(values, np.full_like(values, np.nan), np.full_like(values, np.inf))
    assert exact.largest()[0].value.tolist() == [5.0]
    assert math.isnan(exact.largest()[0].error[0])
    assert exact.mean(np.array([0.5, 0.5])).value.tolist() == [4.0]
    assert quantile(np.array(np.inf)) == pytest.approx(1.959964)


def test_the_worst_point_is_that_of_each_input_set(tmp_path):
    """Of two designs at two input sets the worst points differ by set; ratios are those to the first design at the same set."""
    study = duty_study(
        tmp_path,
        IDLE_AND_CRUISE,
        (IMPACT, f'{IMPACT}aggregate = "worst"\nupper = 400.0\npoints = ["idle"]\n'),
        (POWER, f'{POWER}aggregate = "worst_relative"\n'),
    )
    duty = case_of_study(study).duty
    assert duty.columns[:3] == [f"cruise: {name}" for name in study.figures]
    assert duty.groups == (("cruise",), ("idle",))
    # Impact, whirl and power at cruise, then at idle.
    outputs = np.array(
        [
            [[100.0, 0.5, 200.0, 50.0, 0.1, 40.0], [80.0, 0.5, 200.0, 90.0, 0.1, 40.0]],
            [[90.0, 0.4, 150.0, 70.0, 0.2, 50.0], [60.0, 0.4, 180.0, 95.0, 0.2, 20.0]],
        ]
    )
    variances, freedom = 1e-12 * outputs**2, np.full(outputs.shape, 1)
    values, errors, degrees = duty.responses(NoisyValues(outputs, variances, freedom), variances)
    assert study.responses == ["impact_force_N", "whirl_deviation_ratio", "power_loss_W", "idle: impact_force_N"]
    assert values[0] == pytest.approx(np.array([[100.0, 0.4, 1.0, 50.0], [90.0, 0.4, 1.0, 90.0]]))
    assert values[1] == pytest.approx(np.array([[90.0, 0.35, 1.25, 70.0], [95.0, 0.35, 0.9, 95.0]]))
    assert errors[0][:, 2].tolist() == [0.0, 0.0]
    assert errors[1][:, 2] == pytest.approx(2e-12 * values[1][:, 2] ** 2)
    assert degrees.min() >= 1


def test_an_unknown_input_is_no_key_of_the_duty(tmp_path):
    law = '[uncertain]\n"operation.inner_speed_rpm" = {law = "uniform", low = 5000.0, high = 7000.0}\n[front]'
    study = duty_study(tmp_path, IDLE_AND_CRUISE, ("[front]", law))
    with pytest.raises(InputError, match="is a key of the duty too; remove it from one of them"):
        case_of_study(study)


@pytest.mark.slow
@pytest.mark.parametrize("points", [2, 3, 6, 12])
@pytest.mark.parametrize("apart", [0.0, 0.5, 1.5])
def test_the_interval_of_the_worst_holds_the_truth_of_many_points(points, apart):
    """Figures that lie ``apart`` by so many standard errors, one after the other; 2000 seeds."""
    random, truth = np.random.default_rng(8), -apart * np.arange(points)
    errors = np.sqrt(random.chisquare(9, (2000, points)) / 9)
    worst = Estimate(truth + random.standard_normal(errors.shape), errors, np.full(errors.shape, 9.0)).largest()[0]
    caught = np.abs(worst.value - truth.max()) <= worst.half_width
    assert 0.92 <= caught.mean() <= 0.98


@pytest.mark.slow
def test_the_interval_of_the_worst_ratio_holds_the_truth():
    """Ratios of 0.9 at either point, whose baseline scatters too; 1000 seeds."""
    random, rule, caught = np.random.default_rng(3), Rule("worst_relative", "min", None), 0

    def simulated(truth, share, freedom):
        error = share * truth * math.sqrt(random.chisquare(freedom) / freedom)
        value = truth * (1.0 + share * random.standard_normal())
        return Quantity(value, error * float(stats.t.ppf(0.975, freedom)), 0.0, 10.0, freedom)

    for _ in range(1000):
        parts = {"a": simulated(90.0, 0.03, 7), "b": simulated(45.0, 0.03, 7)}
        base = {"a": simulated(100.0, 0.02, 15), "b": simulated(50.0, 0.02, 15)}
        ratio = result_of(rule, parts, {"a": 0.5, "b": 0.5}, base).responses["impact_force_N"]
        caught += abs(ratio.value - 0.9) <= ratio.statistical_error
    assert 0.92 <= caught / 1000 <= 0.98


@pytest.mark.slow
def test_a_search_and_a_robust_judgement_over_a_duty_are_the_same_with_any_workers(tmp_path):
    """Short simulations of the example: worst and relative figures, a limit at a point, all steps of a study.

    One batch of the search. By a stated method, for the choice would compile a second one.
    """
    inputs = (
        '[robust]\npoints = 32\n[uncertain]\nset = ["numerics.turns=2", "numerics.discard_turns=1", "numerics.replicates=2", '
        '"numerics.extend=false", "numerics.companion=false", "numerics.impact_window_turns=1"]\n'
        '[adaptive]\nbudget = 36\nset = ["numerics.extend_limit=1"]\n[front]'
    )
    relative = (POWER, f'{POWER}upper = 245.0\naggregate = "worst_relative"\npoints = ["cruise"]\n')
    keys = relative, (IMPACT, f'{IMPACT}aggregate = "worst"\n'), ("[front]", inputs)
    found = []
    for workers in (1, 2):
        study = duty_study(tmp_path / str(workers), IDLE_AND_CRUISE, *keys)
        options = {"adaptive": True, "robust": True}
        outcome = run_study(study, study.path.parent, workers, lambda title: silent, **options)
        record = summary(outcome).as_dict()
        stored_keys = set(rows(study.path.parent / "study.sqlite"))
        found.append((stored_keys, *(json.dumps(record[key]) for key in ("gains", "limits", "duty", "robust"))))
        assert record["robust"]["runs"] % 2 == 0
        assert list(record["limits"]) == ["cruise: power_loss_W"]
    assert found[0] == found[1]
