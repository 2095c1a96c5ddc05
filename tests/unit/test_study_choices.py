"""From the front to a confirmed choice: which points are simulated, whether gains are real, the simulator's own front."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from short_studies import SHORT, short_study, silent

from doe import clearance
from doe.clearance import Simulations
from doe.pareto.surrogate_loss import SurrogateLoss
from doe.report.steps.confirmation import direct_record
from doe.running.store import Store
from doe.study.chains import check_chains, solve_chains
from doe.study.chosen import choices
from doe.study.confirmation import Confirmed, Gain, gains, statement
from doe.study.direct import Evaluator, find_direct
from doe.study.front import find_front
from doe.study.runs import STORE, read_runs
from doe.study.surfaces import fit_surfaces
from doe.study_file import Study
from rbdyn.faults import InputError

BRIEF = """[direct]
evaluations = 60
population = 8
replicates = 2
turns = 3
discard_turns = 1
set = ["numerics.impact_window_turns=1"]

[tolerances]"""


def fitted(folder, replace=("[tolerances]", BRIEF)):
    """A short study on the published table, and its surfaces."""
    text = short_study(folder).read_text(encoding="utf-8")
    direct = text[text.index("[direct]") : text.index("[tolerances]")]
    (folder / "study.toml").write_text(text.replace(direct, "").replace(*replace), encoding="utf-8")
    study = Study.load(folder / "study.toml")
    return study, fit_surfaces(study, read_runs(study, folder / "ccd_table4.csv"))


def simulations(store: Store, retry: bool = False) -> Simulations:
    """Where points run, with nobody watching."""
    return Simulations(store, None, None, retry, lambda title: silent)


def test_gains_are_real_only_beyond_their_joint_error():
    """Closed form: for two responses the joint intervals are 2.2414 / 1.9600 times as wide."""
    text = statement([Gain("force", 9.0, 8.0), Gain("loss", 3.0, 1.0)])
    assert "force 9.0 ± 9.1 % less: inside its own noise: no gain is shown" in text
    assert "loss 3.0 ± 1.1 % less: real, more than its error" in text
    assert "a real loss" in statement([Gain("force", -9.0, 2.0)])


def test_a_target_is_gained_by_coming_nearer(tmp_path):
    loss = 'name = "power_loss_W"\nmodel = "quadratic"\ngoal = '
    study, _ = fitted(tmp_path, (f'{loss}"min"', f'{loss}"target"\ntarget = 40.0'))
    none = np.zeros(3)
    base, pick = (Confirmed(study.baseline, np.array([1.0, 1.0, loss]), none, none) for loss in (50.0, 35.0))
    assert gains(study, base, pick)[2].percent == pytest.approx(10.0)


def test_points_that_a_drawing_cannot_tell_apart_are_confirmed_once(tmp_path):
    study, surfaces = fitted(tmp_path)
    front = find_front(study, surfaces)
    chosen = choices(study, front, None)
    assert next(iter(chosen)) == "pick"
    assert "after manufacture" in chosen["pick"].reason
    assert {"without_tolerances", "desirability", "weights"} <= set(chosen) and "knee" not in chosen
    points = [tuple(choice.point) for choice in chosen.values()]
    assert len(set(points)) == len(points)
    twin = SimpleNamespace(front=SimpleNamespace(points=front.points, pick=front.picks["weights"]))
    assert "direct front" in choices(study, front, twin)["weights"].reason


def test_direct_front_asks_for_the_same_runs_again_and_survives_failures(tmp_path, monkeypatch):
    study, surfaces = fitted(tmp_path)
    front = find_front(study, surfaces)
    with Store(tmp_path / STORE) as store:
        first = find_direct(study, front, simulations(store))
        stored = len(store.ended())
        again = find_direct(study, front, simulations(store))
        assert (
            len(store.ended())
            == stored
            == first.front.evaluations + len(first.surrogate_points) * (first.front.repeats)
        )
    assert 40 <= first.front.evaluations <= 60
    assert np.array_equal(first.front.values, again.front.values)
    assert np.array_equal(first.front.points, again.front.points)
    assert isinstance(first.loss, SurrogateLoss) and not first.failures
    record = direct_record(study, first)
    assert len(record["front"]) == len(first.front.points) == len(record["surrogate_front"])
    assert list(record["pick"]["factors"]) == study.factors
    assert list(record["front"][0]["errors"]) == study.responses

    usual = clearance.direct_scenes

    def some_break(study, points, first):
        scenes = usual(study, points, first)
        for row in range(0, len(scenes), 5):
            scene = scenes[row]
            scenes[row] = scene.model_copy(
                update={"numerics": scene.numerics.model_copy(update={"step_budget_per_turn": 2})}
            )
        return scenes

    monkeypatch.setattr(clearance, "direct_scenes", some_break)
    with Store(tmp_path / "other.sqlite") as store:
        evaluate = Evaluator(study, simulations(store), silent, 10)
        values, errors = evaluate(np.tile(study.baseline, (10, 1)))
    assert np.isnan(values[[0, 5]]).all() and np.isfinite(np.delete(values, [0, 5], axis=0)).all()
    assert np.isfinite(np.delete(errors, [0, 5], axis=0)).all()
    assert ["step budget" in failure.cause for failure in evaluate.failures] == [True, True]


def test_chains_come_from_a_file_and_take_the_tolerance_found(tmp_path):
    study, _ = fitted(tmp_path)
    check_chains(study)
    found = SimpleNamespace(half_widths=np.array([0.002, 0.010, 0.003]))
    chains, notes = solve_chains(study, study.baseline, found)
    low, high = chains["guide"].worst_case_mm
    assert 0.140 - 1e-9 <= low < high <= 0.160 + 1e-9
    assert chains["pocket"].worst_case_mm == pytest.approx((0.295, 0.305))
    assert len(notes) == 1 and "half_width_mm = 0.005: wider than the 0.003" in notes[0]
    nothing = SimpleNamespace(half_widths=np.zeros(3))
    chains, notes = solve_chains(study, study.baseline, nothing)
    assert set(chains) == {"pocket"} and any("chain guide: half_width_mm" in note for note in notes)


@pytest.mark.parametrize(
    ("replace", "words"),
    [
        (('name = "guide"', 'name = "giude"'), "no chain is named giude"),
        (('file = "bearing_chains.toml"', ""), "give the links, or the file that has them"),
        (('file = "bearing_chains.toml"', 'file = "bearing_chains.toml"\nallocate = { grades = true }'), "one or the other"),
        (("population = 8", "population = 8\nturns = 3\ndiscard_turns = 3"), "must be below turns"),
    ],
)  # fmt: skip
def test_bad_chains_and_direct_settings_are_refused(tmp_path, replace, words):
    text = short_study(tmp_path, SHORT).read_text(encoding="utf-8")
    text = text.replace("turns = 40\n", "").replace("population = 50", "population = 8").replace(*replace)
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        check_chains(Study.load(tmp_path / "study.toml"))
