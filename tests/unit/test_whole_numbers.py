"""Factors that are whole numbers, which have no tolerance."""

import numpy as np
import pytest
from test_study_adaptive import ROLLERS, with_rollers

from doe.study_file.sections import Tolerances
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs
from doe.workflow.surfaces import fit_surfaces
from doe.workflow.tolerances import PickParts


@pytest.mark.parametrize(
    ("centre", "step", "numbers"),
    [
        (10, 1, [9.0, 10.0, 11.0]),  # the star points at 8.3 and 11.7 would be rounded out of the region
        (10, 1.5, [8.0, 10.0, 12.0]),  # 8.5 and 11.5 go outward, 7.5 and 12.5 inward
        (9, 1.5, [7.0, 9.0, 11.0]),  # outward, not to the next even number
        (10, 1.4, [8.0, 9.0, 10.0, 11.0, 12.0]),
        (12, 2, [9.0, 10.0, 12.0, 14.0, 15.0]),
    ],
)
def test_whole_numbers_are_the_nearest_within_the_region(tmp_path, centre, step, numbers):
    given = (ROLLERS, ROLLERS.replace("centre = 10", f"centre = {centre}").replace("step = 1\n", f"step = {step}\n"))
    study = Problem.load(with_rollers(tmp_path, given))
    design = study.design
    assert np.unique(np.round(study.actual(design.coded)[:, 0], 9)).tolist() == numbers
    assert np.abs(design.coded).max() <= design.reach * (1.0 + 1e-12)


def test_closed_form_tolerance_beside_a_whole_number(tmp_path):
    """Closed form: responses that are planes g of the guide clearance, at g = -0.5, keep half their gain up to g = -0.25; of parts
    spread evenly over 2h that are 95 % where 0.25 + h = 0.95 (2h)."""
    study = Problem.load(with_rollers(tmp_path))
    coded = study.design.coded
    noise = 1e-9 * np.random.default_rng(1).standard_normal((len(coded), 3))
    values = np.outer(coded[:, 1], [3.0, -0.2, 10.0]) + np.array([10.0, 1.0, 50.0]) + noise
    surfaces = fit_surfaces(study, Runs(coded, study.actual(coded), values, np.full_like(values, np.nan)))
    settings = Tolerances(distribution="uniform", samples=100_000)
    found = PickParts(study.with_surfaces(surfaces), study.actual(np.array([0.0, -0.5, 0.0])), settings).widest()
    assert np.isnan(found.half_widths[0])
    assert found.half_widths[1] == pytest.approx(0.25 / 0.9 * 0.05, rel=0.01)
    assert found.half_widths[2] == pytest.approx(found.half_widths[1] * 0.005 / 0.02)


def test_a_whole_number_has_no_tolerance(tmp_path):
    assert Problem.load(with_rollers(tmp_path)).coded_tolerances[0] == 0.0
