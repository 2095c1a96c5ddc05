"""From the front to a confirmed choice: which points are simulated, whether gains are real, chains."""

from types import SimpleNamespace

import numpy as np
import pytest
from short_studies import SHORT, short_study, silent

from doe.clearance import Simulations
from doe.running.store import Store
from doe.workflow.confirmation import Confirmed, Gain, gains, statement
from doe.workflow.front import find_front
from doe.workflow.pick import choices
from doe.workflow.problem import Problem
from doe.workflow.runs import read_runs
from doe.workflow.surfaces import fit_surfaces
from doe.workflow.whole import check_chains, solve_chains
from rbdyn.base.faults import InputError


def fitted(folder, *replace):
    """A short study on the published table, and its surfaces."""
    study = Problem.load(short_study(folder, SHORT, *replace))
    return study, fit_surfaces(study, read_runs(study, folder / "ccd_table4.csv"))


def simulations(store: Store, retry: bool = False) -> Simulations:
    """Where points run, with nobody watching."""
    return Simulations(store, None, None, retry, lambda title: silent)


def test_gains_are_real_only_beyond_their_joint_error():
    """Closed form: for two responses the joint intervals are 2.2414 / 1.9600 times as wide."""
    text = statement({"force": Gain(9.0, 8.0), "loss": Gain(3.0, 1.0)})
    assert "force: not significant" in text
    assert "loss: real, more than its error" in text
    assert "a real loss" in statement({"force": Gain(-9.0, 2.0)})


def test_a_target_is_gained_by_coming_nearer(tmp_path):
    loss = 'name = "power_loss_W"\nmodel = "quadratic"\ngoal = '
    study, _ = fitted(tmp_path, (f'{loss}"min"', f'{loss}"target"\ntarget = 40.0'))
    none = np.zeros(3)
    base, pick = (Confirmed(study.baseline, np.array([1.0, 1.0, loss]), none, none) for loss in (50.0, 35.0))
    assert list(gains(study, base, pick).values())[2].percent == pytest.approx(10.0)


def test_points_that_a_drawing_cannot_tell_apart_are_confirmed_once(tmp_path):
    study, surfaces = fitted(tmp_path)
    front = find_front(study.with_surfaces(surfaces))
    chosen = choices(study, front, None)
    assert next(iter(chosen)) == "pick"
    assert "at the ends of their tolerances" in chosen["pick"].reason
    assert {"without_tolerances", "desirability", "weights"} <= set(chosen) and "knee" not in chosen
    points = [tuple(choice.point) for choice in chosen.values()]
    assert len(set(points)) == len(points)
    twin = SimpleNamespace(name="adaptive", front=SimpleNamespace(points=front.points, pick=front.picks["weights"]))
    assert "adaptive front" in choices(study, front, twin)["weights"].reason


def test_chains_come_from_a_file_and_take_the_tolerance_found(tmp_path):
    study, _ = fitted(tmp_path)
    check_chains(study)
    found = SimpleNamespace(half_widths=np.array([0.002, 0.010, 0.003]))
    chains, notes = solve_chains(study, study.baseline, found)
    low, high = chains["guide"].worst_case_mm
    assert 0.140 - 1e-9 <= low < high <= 0.160 + 1e-9
    assert chains["pocket"].worst_case_mm == pytest.approx((0.295, 0.305))
    assert len(notes) == 1 and "half_width_mm = 0.005: is wider than the 0.003" in notes[0]
    nothing = SimpleNamespace(half_widths=np.zeros(3))
    chains, notes = solve_chains(study, study.baseline, nothing)
    # Without a tolerance that is found, parts are made to the factor's own.
    low, high = chains["guide"].limits_mm
    assert set(chains) == {"guide", "pocket"} and 0.5 * (high - low) == pytest.approx(
        study.known_tolerances["guide_clearance_mm"]
    )


@pytest.mark.parametrize(
    ("replace", "words"),
    [
        (('name = "guide"', 'name = "giude"'), "no chain is named giude"),
        (('file = "bearing_chains.toml"', ""), "give the links, or the file that has them"),
        (('file = "bearing_chains.toml"', 'file = "bearing_chains.toml"\nallocate = { grades = true }'), "leave out the file or these"),
    ],
)  # fmt: skip
def test_bad_chains_are_refused(tmp_path, replace, words):
    text = short_study(tmp_path, SHORT).read_text(encoding="utf-8")
    text = text.replace(*replace)
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        check_chains(Problem.load(tmp_path / "study.toml"))
