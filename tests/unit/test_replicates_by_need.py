"""Design runs have few replicates at first, and all of them where noise would be much of what the surfaces predict."""

from collections import Counter
from dataclasses import replace

import instant_runs
import numpy as np
import pytest
from instant_runs import instant_result, instantly
from scipy import stats
from short_studies import paper_study, short_study

from doe.clearance import FURTHER_SEEDS
from doe.study_file.sections import OtherLimits
from doe.workflow import runs as study_runs
from doe.workflow import whole
from doe.workflow.confirmation import Choice, confirm, confirmed_from
from doe.workflow.effort import Effort
from doe.workflow.problem import Problem, Settings
from doe.workflow.runs import NOISY, Runs, noisy
from doe.workflow.status import study_stages, study_status

EIGHT = "turns=3,discard_turns=1,replicates=8,companion=false,impact_window_turns=1"
TERMS, RUNS = 10, 20  # of a quadratic model and of the design of the example, whose impact has a linear model


def with_replicates(usual: int) -> Problem:
    """The example study with the goals of its paper and another number of replicates."""
    study = paper_study()
    return study.with_file(scene=study.scene.model_copy(update={"set": [f"numerics.replicates={usual}"]}))


@pytest.mark.parametrize(("usual", "first"), [(8, 4), (16, 4), (7, 7), (4, 4), (2, 2)])
def test_unit_few_replicates_are_at_most_half(usual, first):
    """Plan: runs have the fewest replicates at first where these are at most half of the scene's; further runs have the others."""
    study = with_replicates(usual)
    assert study.first_replicates == first
    firsts = study.plan.scenes
    assert {scene.numerics.replicates for scene in firsts} == {first}
    (stage,) = [stage for stage in study_stages(study) if stage.name == "design runs"]
    assert (stage.runs, stage.most) == (RUNS, None if first == usual else 2 * RUNS)
    assert Settings.of_runs(study, first).replicates == usual
    if first < usual:
        further = study.design_scenes(study.plan.actual, study.design.order.tolist(), further=True)
        assert {scene.numerics.replicates for scene in further} == {usual - first}
        seeds = [[scene.numerics.seed for scene in scenes] for scenes in (firsts, further)]
        assert np.ptp(np.subtract(*seeds)) == 0 and seeds[1][0] - seeds[0][0] == FURTHER_SEEDS
        excluded = {"numerics": {"replicates", "seed"}}
        assert [s.model_dump(exclude=excluded) for s in firsts] == [s.model_dump(exclude=excluded) for s in further]


def held_alone(study: Problem) -> Problem:
    """The study with a limit on the class of the cage."""
    return study.with_file(limits=OtherLimits.model_validate({"cage": {"verdict": "held"}}))


def test_unit_limits_leave_few_replicates_at_first():
    """Plan: limits on a response and on the class of the cage leave few replicates at first; points in brief have as many as name one."""
    study = with_replicates(8)
    held = held_alone(study)
    assert [each.first_replicates for each in (study, held, with_limits(study, upper=100.0))] == [4, 4, 4]
    brief = [each.confirmation_run(each.centre, in_brief=True).numerics.replicates for each in (study, held)]
    assert brief == [4, held.usual_run.verdict.limits.fewest_replicates] == [4, 6]


@pytest.mark.parametrize(
    ("first", "further", "open_class", "missed"),
    [(0.0, 0.0, False, False), (1.0, 1.0, False, True), (0.75, 0.0, True, False), (0.25, 1.0, True, True)],
)
def test_unit_replicates_that_differ_about_a_class_get_the_others(monkeypatch, first, further, open_class, missed):
    """Study: a run whose first replicates differ about the class has all judge it; the note and the region follow from these."""
    study, parts, ran = held_alone(with_replicates(8)), np.zeros((RUNS, 1)), list[int]()
    parts[3] = first
    runs = Runs(
        study.design.coded, study.plan.actual, np.ones((RUNS, 3)), np.zeros((RUNS, 3)), design=study.design
    ).with_cages(parts)
    monkeypatch.setattr(study_runs, "run_design", lambda *asked: runs)
    monkeypatch.setattr(study_runs, "noisy", lambda *asked: [])
    others = np.zeros((RUNS, 1))
    others[3] = further
    monkeypatch.setattr(study_runs, "other_cages", lambda *asked: others)

    class Further:
        def progress(self, title):
            return None

        def run(self, scenes, labels, progress):
            ran.append(len(scenes))
            return [instant_result(scene) for scene in scenes]

    heard = list[str]()
    judged = study_runs.run_by_need(study, Further(), None, heard.append)
    assert ran == [RUNS] * open_class
    assert heard == ["4 replicates are too few for limits.cage.verdict: all runs continue to 8"] * open_class
    assert (judged.cages_missed is not None and bool(judged.cages_missed[3])) == missed
    assert [note.code for note in judged.notes].count("cage-class") == missed


def with_limits(study: Problem, **limits: float) -> Problem:
    """The study with limits of its first response."""
    limited = study.file.response[0].model_copy(update=limits)
    return study.with_file(response=[limited, *study.file.response[1:]])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_unit_a_limit_near_a_run_needs_all_replicates(side):
    """Noise: a limit farther from every run than two of its half-widths leaves few replicates; a nearer or violated one does not."""
    study, values = with_replicates(8), np.tile(np.linspace(90.0, 110.0, RUNS)[:, None], (1, 3))
    errors = np.full(values.shape, 0.1)
    runs = Runs(study.design.coded, study.design.coded, values, errors, replicates=np.full(values.shape, 1_000_000))
    outermost = 100.0 + 10.0 * side
    for room, near in ((0.21, False), (0.19, True), (-5.0, True)):
        limited = with_limits(study, **{"upper" if side > 0.0 else "lower": outermost + side * room})
        assert noisy(limited, runs) == [study.responses[0]] * near
    # More replicates cannot make a figure without a statistical error, such as a life, more exact.
    exact = [limited.file.response[0].model_copy(update={"goal": "none"}), *limited.file.response[1:]]
    exact_runs = replace(runs, errors=np.where([True, False, False], np.nan, errors))
    assert not noisy(limited.with_file(response=exact), exact_runs)


def test_unit_noise_of_predictions():
    """Noise: predictions at the runs have p/n of the variance of a run's noise; responses without a goal do not count."""
    study, random = with_replicates(8), np.random.default_rng(1)
    coded = study.design.coded
    spread = random.normal(100.0, 1.0, (RUNS, 3))
    replicates = np.full(spread.shape, 1_000_000)
    for column, terms in ((0, 4), (1, TERMS)):
        for share in (0.95 * NOISY, 1.05 * NOISY):
            errors = np.zeros(spread.shape)
            errors[:, column] = 1.96 * np.sqrt(share * RUNS / terms * spread[:, column].var(ddof=1))
            runs = Runs(coded, coded, spread, errors, replicates=replicates)
            assert noisy(study, runs) == [study.responses[column]] * (share > NOISY)
    goalless = [each.model_copy(update={"goal": "none"}) for each in study.file.response]
    assert not noisy(study.with_file(response=goalless), runs)
    assert noisy(study, replace(runs, errors=np.full(spread.shape, np.nan))) == study.responses
    # The share itself, by drawing: the fitted values of pure noise.
    matrix = np.column_stack(
        [np.ones(RUNS), coded, coded**2, *(coded[:, i] * coded[:, j] for i, j in ((0, 1), (0, 2), (1, 2)))]
    )
    hat = matrix @ np.linalg.pinv(matrix)
    fitted = random.normal(size=(20_000, RUNS)) @ hat.T
    assert (fitted**2).mean() == pytest.approx(TERMS / RUNS, rel=0.02)


@pytest.mark.parametrize(("scatter", "counts"), [(0.01, {4: RUNS}), (0.2, {4: RUNS, 12: RUNS})])
def test_unit_noisy_runs_continue(tmp_path, monkeypatch, scatter, counts):
    """Study: quiet runs keep their few replicates; noisy ones get the others, and values and errors are those of all."""
    ran, heard = Counter[int](), list[str]()

    def result(scene):
        if (
            scene.numerics.seed % 1_000_000 < 100
            and scene.numerics.turns == 3
            and scene.numerics.seed // 1_000_000 != 1
        ):
            ran[scene.numerics.replicates] += 1
        made = instant_result(scene)
        count = scene.numerics.replicates
        # Scattered by the seed, as half-widths of that many values.
        half_width = scatter * stats.t.ppf(0.975, count - 1) / np.sqrt(count)
        figures = {
            name: replace(figure, statistical_error=half_width * figure.value, degrees_of_freedom=count - 1)
            for name, figure in made.figures.items()
        }
        return replace(made, figures=figures, cost={})

    instantly(monkeypatch.setattr)
    monkeypatch.setattr(instant_runs, "instant_result", result)
    study = Problem.load(short_study(tmp_path, EIGHT.replace("8", "16")))
    answer = whole.run_study(study, tmp_path, Effort(2, notice=heard.append))
    continued = 12 in counts
    assert ran == counts
    assert sum("all runs continue to 16" in sentence for sentence in heard) == continued
    assert answer.runs.replicates_a_point == (16 if continued else 4)
    assert study_status(study, tmp_path)["points"]["done"] == RUNS
    assert sum("effective samples" in note for note in answer.runs.notes) == 0
    if not continued:
        return
    scenes = [study.plan.scenes, study.design_scenes(study.plan.actual, study.design.order.tolist(), further=True)]
    firsts, furthers = ([result(scene).figures["power_loss_W"].value for scene in each] for each in scenes)
    column = study.responses.index("power_loss_W")
    means = (4.0 * np.array(firsts) + 12.0 * np.array(furthers)) / 16.0
    np.testing.assert_allclose(answer.runs.values[:, column], means, rtol=1e-12)
    # Nearly the half-width of all replicates together; the freedom of Welch is a little less than 15.
    ratio = answer.runs.errors[:, column] / means / (scatter * stats.t.ppf(0.975, 15) / 4.0)
    assert np.all((ratio > 0.97) & (ratio < 1.05))


def test_unit_other_points_are_confirmed_in_brief():
    """Confirmation: the pick and its tries have all replicates and companions; other points the first ones of a design run, and the numerical
    errors of the baseline in proportion."""
    study = with_replicates(8)
    full, brief = (study.confirmation_run(study.centre, in_brief=brief).numerics for brief in (False, True))
    assert (full.replicates, full.companions) == (study.file.confirmation.replicates, 4)
    assert (
        (brief.replicates, brief.companions, brief.seed) == (study.first_replicates, 0, full.seed) == (4, 0, full.seed)
    )

    class Runs:
        def progress(self, title):
            return None

        def run(self, scenes, labels, progress):
            return [replace(instant_result(scene), replicates=scene.numerics.replicates) for scene in scenes]

    baseline = confirmed_from(study, Choice(study.baseline, ""), instant_result(study.confirmation_run(study.baseline)))
    baseline = replace(baseline, numerical=np.array([1.0, 0.01, 2.0]))
    other = study.centre + study.step
    names = {name: Choice(other, "") for name in ("pick", "desirability", "try_1")}
    points, failures = confirm(study, baseline, names, Runs())
    assert not failures
    assert {name: point.result.replicates for name, point in points.items() if name != "baseline"} == {
        "pick": 16,
        "desirability": 4,
        "try_1": 16,
    }
    assert np.isnan(points["pick"].numerical).all()
    expected = baseline.numerical / baseline.values
    np.testing.assert_allclose(points["desirability"].numerical / points["desirability"].values, expected, rtol=1e-12)
