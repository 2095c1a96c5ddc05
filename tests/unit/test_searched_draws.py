"""What a search leaves open about its pick: draws of its emulators at the level of its own runs."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import qmc
from short_studies import short_study

from doe.adaptive.emulators import Runs, fit_emulators
from doe.pareto.tolerance import Neighbourhood
from doe.workflow.adaptive import Adaptive
from doe.workflow.confirmation import Confirmed
from doe.workflow.front import SURFACE_DRAWS
from doe.workflow.pick import draws_about
from doe.workflow.problem import Problem


def bent(coded):
    """Three responses of coded points in the region of the design."""
    x = coded / 1.6818
    return np.column_stack([80.0 + 5.0 * np.sin(2.0 * x[:, 0]), 0.4 + 0.1 * x[:, 1] ** 2, 240.0 + x.sum(axis=1)])


@pytest.mark.parametrize("error", [0.0, 0.5])
def test_limit_case_draws_about_a_pick(tmp_path, error):
    """Limit case: of a search that knows its function, parts differ from the selected design as the function does, and all of them by
    the errors of the selected design's own runs, the baseline by those of its own."""
    study = Problem.load(short_study(tmp_path))
    points = 2.0 * qmc.Sobol(3, seed=1).random_base2(6) - 1.0
    values = bent(points * study.reach)
    runs = Runs(points, values, np.full((64, 3), 1e-4), np.full((64, 3), 7), np.full(64, 8))
    emulators = fit_emulators(study.goals, runs)
    search = Adaptive(SimpleNamespace(emulators=emulators), None, np.zeros((3, 2)), (), 0.0)
    coded = np.array([[0.3, -0.2, 0.5], [0.4, -0.2, 0.5], [0.3, 0.1, 0.6]])
    half = 2.0 * error * np.array([1.0, 0.01, 1.0])
    found = bent(coded[:1])[0]
    pick = Confirmed(study.actual(coded[0]), found, half, np.zeros(3), freedom=np.full(3, 15.0))
    base = Confirmed(study.baseline, np.array([90.0, 0.5, 250.0]), half, np.zeros(3), freedom=np.full(3, 15.0))
    here = Neighbourhood((), coded[:1], found[None], np.zeros((1, 3, 3)))
    drawn = draws_about(
        study,
        search,
        SimpleNamespace(parts=lambda at: np.zeros((1, len(at), 3)), points=here.points, values=here.values),
        pick,
        base,
    )
    values = np.concatenate(list(drawn(np.vstack([coded, study.coded(study.baseline)]))))
    assert values.shape == (SURFACE_DRAWS, 4, 3)
    change = values[:, :3] - values[:, :1]
    truth = bent(coded) - found
    assert np.abs(change - truth).max(axis=(0, 1)) == pytest.approx(np.zeros(3), abs=0.02)
    errors = pick.standard_error * np.sqrt(15.0 / 13.0)
    for place, level in ((0, found), (3, base.values)):
        assert values[:, place].mean(axis=0) == pytest.approx(
            level, abs=4.0 * errors.max() / np.sqrt(SURFACE_DRAWS) + 1e-9
        )
        assert values[:, place].std(axis=0) == pytest.approx(errors, rel=0.12, abs=1e-9)
