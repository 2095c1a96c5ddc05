"""Limits of a study on the class of its cage: judged at the simulated pick by the classes of its replicates."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from instant_runs import instant_result, instantly, unillustrated
from short_studies import paper_study, short_study
from typer.testing import CliRunner

from doe.cli import app
from doe.study_file.sections import CageLimit
from doe.workflow.adaptive import near_limits
from doe.workflow.confirmation import Confirmed, Limit, class_limits, limits_of
from doe.workflow.problem import Problem
from doe.workflow.robust import case_of_study
from rbdyn.base.faults import InputError
from rbdyn.verdict.orbits import CageVerdict, Forcing, Orbit, Thresholds, Trial, cage_verdict

ORBITS = {
    "held": Orbit(0.9, 0.02, 0.4, 3.0),
    "circling": Orbit(0.0, 0.9, 0.9, 0.5),
    "fast whirl": Orbit(0.0, 0.9, 0.9, 3.0),
    "not judged": Orbit(0.1, 0.7, 0.2, 0.4),
}


def found(reason: str | None = None, **counts: int) -> CageVerdict:
    """A verdict by the number of replicates of each class."""
    names = [name.replace("_", " ") for name, count in counts.items() for _ in range(count)]
    return cage_verdict([Trial(ORBITS[name], Forcing()) for name in names], Thresholds(), reason)


@pytest.mark.parametrize(
    ("verdict", "classes", "kept"),
    [
        (found(held=8), {"held"}, True),
        (found(held=8), {"circling", "held"}, True),
        (found(held=4, circling=4), {"circling", "held"}, True),
        (found(held=4, circling=4), {"held"}, None),
        (found(fast_whirl=8), {"held", "circling"}, False),
        (found(held=5), {"held"}, None),
        (found(not_judged=8), {"held"}, False),
        (found(not_judged=8), {"held", "wandering"}, None),
        (found(held=15, not_judged=1), {"held", "wandering"}, True),
        (found(held=8, reason="films alone drive the rollers"), {"held"}, None),
        (CageVerdict("not judged", {}, {}, "not judged", {}, {}, 0.85, "runs are short"), {"held"}, None),
    ],
)
def test_a_class_is_one_of_several_where_enough_replicates_say_so(verdict, classes, kept):
    """Classes that are allowed count together; a class that nobody can name is neither allowed nor excluded."""
    assert verdict.is_one_of(classes) is kept


def limited(folder, classes: str, replicates: int = 8):
    path = short_study(folder)
    text = path.read_text(encoding="utf-8").replace(
        "[confirmation]\nreplicates = 2", f"[confirmation]\nreplicates = {replicates}"
    )
    assert f"replicates = {replicates}" in text
    path.write_text(f'{text}\n[limits]\ncage.verdict = "{classes}"\n', encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("classes", "words"),
    [
        ("held|spinning", "must name some of held, circling, fast whirl"),
        ("", "must name some of"),
        ("not judged", "must name some of"),
    ],
)
def test_classes_that_no_cage_has_are_refused(tmp_path, classes, words):
    with pytest.raises(InputError, match=words):
        Problem.load(limited(tmp_path, classes))


def test_fewer_replicates_than_can_name_a_class_are_refused(tmp_path):
    """One sentence says how many there are and how many it takes."""
    study = Problem.load(limited(tmp_path, "held", 5))
    with pytest.raises(
        InputError, match=r"confirmation\.replicates = 5: limits\.cage\.verdict needs 6 replicates alike"
    ):
        study.confirmation_run(study.baseline)
    Problem.load(limited(tmp_path, "held", 6)).confirmation_run(study.baseline)


def test_a_scene_without_the_verdict_is_refused(tmp_path):
    path = limited(tmp_path, "held")
    path.write_text(
        path.read_text(encoding="utf-8").replace('set = ["', 'set = ["verdict.trace=false", "', 1), encoding="utf-8"
    )
    study = Problem.load(path)
    with pytest.raises(InputError, match="the scene leaves the verdict out"):
        study.confirmation_run(study.baseline)


def test_the_probability_of_a_limit_is_the_share_of_its_classes(tmp_path):
    """Eight of eight replicates bear 8.5/9.5; other limits come first."""
    study = Problem.load(limited(tmp_path, "held|circling"))
    result = replace(instant_result(study.scene_at(study.baseline, 1)), verdict=found(held=5, circling=3))
    point = Confirmed(study.baseline, np.ones(3), np.full(3, 0.1), np.full(3, np.nan), result=result)
    (limit,) = class_limits(study, point)
    assert limit == limits_of(study, point)[-1]
    assert (limit.response, limit.verdict, limit.bound) == ("cage_held_or_circling_share", "kept", 0.85)
    assert limit.probability == limit.value == pytest.approx(8.5 / 9.5, abs=5e-4)


@pytest.mark.parametrize(
    ("at_pick", "code", "words"),
    [
        ({"held": 8}, 0, "0.895 (held 8/8) ✓ met 0.895 ✓ 0.895 (held 8/8)"),
        (
            {"fast_whirl": 8},
            1,
            "Danger: Limit cage.verdict = held: the class of the selected design's cage is fast whirl (8 of 8 replicates)",
        ),
        (
            {"held": 5, "circling": 3},
            1,
            "the class of the selected design's cage is undecided (held in 5, circling in 3 of 8 replicates; two regimes last",
        ),
    ],
)
def test_a_study_compares_the_class_of_pick_and_baseline(tmp_path, monkeypatch, at_pick, code, words):
    """A class that is not kept fails the study with a sentence on it, whatever the gains are."""
    instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    from rbdyn.dynamics import simulate as module

    usual, path = module.simulate, limited(tmp_path, "held")
    baseline = Problem.load(path).baseline.tolist()

    def simulate(scene, *rest, **more):
        place = [scene.bearing.radial_clearance_mm, scene.cage.guide_clearance_mm, scene.cage.pocket_clearance_mm]
        counts = {"held": 8} if place == pytest.approx(baseline) else at_pick
        return replace(usual(scene, *rest, **more), verdict=found(**counts))

    monkeypatch.setattr(module, "simulate", simulate)
    arguments = ["study", str(path), "--out", str(tmp_path / "out")]
    shown = CliRunner().invoke(app, arguments)
    assert shown.exit_code == code, shown.output
    assert words in " ".join(shown.stdout.split())
    record = json.loads(CliRunner().invoke(app, [*arguments, "--json"]).stdout)
    limit = record["limits"]["cage_held_share"]
    assert limit["verdict"] == {0: "kept"}.get(code, "broken" if len(at_pick) == 1 else "undecided")
    assert record["status"] == ("ok" if code == 0 else limit["verdict"])
    assert record["confirmation"]["pick"]["cage"]["operation"]["class"] == found(**at_pick).name


UNKNOWN = """
[robust]
points = 64
settle = 0.0
front = "none"
[uncertain]
defaults = "none"
set = ["numerics.turns={turns}", "numerics.replicates=2"]
"model.pocket_friction" = {{ law = "uniform", low = 0.0, high = 0.1 }}
"""


def test_unknown_inputs_give_the_class_its_probability(tmp_path, monkeypatch):
    """A cage held below a friction of 0.03, of 0 to 0.1, keeps its limit with a probability of 0.3 to 0.02, over the input sets."""
    instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    from rbdyn.dynamics import simulate as module

    usual, path = module.simulate, limited(tmp_path, "held")
    path.write_text(path.read_text(encoding="utf-8") + UNKNOWN.format(turns=40), encoding="utf-8")

    def simulate(scene, *rest, **more):
        alone = scene.numerics.replicates > 2 or scene.model.pocket_friction < 0.03
        verdict = found(held=scene.numerics.replicates) if alone else found(circling=1, fast_whirl=1)
        return replace(usual(scene, *rest, **more), verdict=verdict)

    monkeypatch.setattr(module, "simulate", simulate)
    done = CliRunner().invoke(app, ["study", str(path), "--robust", "--json", "--out", str(tmp_path / "out")])
    record = json.loads(done.stdout)
    limit = record["limits"]["cage_held_share"]
    assert limit["verdict"] == "kept"
    value, low, high = limit["odds"]
    assert value == pytest.approx(0.3, abs=0.02) and low < 0.22 and 0.4 < high < 0.45


def test_input_sets_too_short_for_a_class_are_refused(tmp_path):
    path = limited(tmp_path, "held")
    path.write_text(path.read_text(encoding="utf-8") + UNKNOWN.format(turns=20), encoding="utf-8")
    with pytest.raises(InputError, match=r"uncertain\.set: input sets of 7\.\d+ cage turns are shorter than the 10"):
        case_of_study(Problem.load(path))


def test_input_sets_are_as_long_as_a_class_needs(tmp_path):
    """The study's own default of 20 shaft turns gives way to a limit on the class; it stays without one."""
    study = Problem.load(limited(tmp_path, "held"))
    assert 10.0 <= case_of_study(study).scene_of_sets.cage_turns < 10.5
    free = Problem(
        study.path, study.file.model_copy(update={"limits": study.file.limits.model_copy(update={"cage": CageLimit()})})
    )
    assert case_of_study(free).scene_of_sets.numerics.turns == 20


@pytest.mark.parametrize("by", ["design", "pick"])
def test_front_and_pick_stay_where_cages_keep_the_limit(tmp_path, monkeypatch, by):
    """The figures are best at small pockets, whose cages are in fast whirl in the design's runs, or in the first pick alone."""
    instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    from rbdyn.dynamics import simulate as module

    usual, path = module.simulate, limited(tmp_path, "held")
    baseline, picks = Problem.load(path).baseline[-1], []

    def simulate(scene, *rest, **more):
        count, pocket = scene.numerics.replicates, scene.cage.pocket_clearance_mm
        if count == 8 and pocket != baseline:
            picks.append(pocket)
        whirls = pocket < 0.27 if by == "design" else pocket in picks[:1]
        verdict = found(fast_whirl=count) if whirls else found(held=count)
        return replace(usual(scene, *rest, **more), verdict=verdict)

    monkeypatch.setattr(module, "simulate", simulate)
    done = CliRunner().invoke(app, ["study", str(path), "--json", "--out", str(tmp_path / "out")])
    record = json.loads(done.stdout)
    assert done.exit_code == 0 and record["limits"]["cage_held_share"]["verdict"] == "kept"
    words = [note["text"] for note in record["notes"] if note["code"] == "cage-class"]
    if by == "design":
        assert record["pick"]["pocket_clearance_mm"] > 0.27
        assert re.fullmatch(
            r"\d design runs of 20 are outside limits\.cage\.verdict\. Front and selected design stay .*\.", *words
        )
    else:
        assert record["tried"] == 2 and record["pick"]["pocket_clearance_mm"] != picks[0] and not words


def test_unit_a_class_is_no_response_of_the_search():
    """Search: limits nearby are those of responses, within a share of their range over all runs; a class of the cage has no range."""
    study = paper_study()
    values = np.array([[80.0, 0.3, 230.0], [100.0, 0.4, 240.0]])
    adaptive = SimpleNamespace(search=SimpleNamespace(emulators=SimpleNamespace(runs=SimpleNamespace(values=values))))
    shared = {"bound": 90.0, "sense": "<=", "verdict": "kept", "error": None, "probability": 1.0}
    near, far = (Limit(response="impact_force_N", value=value, **shared) for value in (89.9, 85.0))
    cage = Limit(response="cage_held_share", value=0.943, **(shared | {"bound": 0.85, "sense": ">="}))
    assert near_limits(adaptive, study, [near, far, cage]) == [near]
