"""Factors that mean nothing at a value of a category, and whole numbers, which have no tolerance."""

from __future__ import annotations

from dataclasses import replace

import instant_runs
import numpy as np
import pytest
from coarse_search import coarsely
from instant_runs import instantly, unillustrated
from short_studies import silent
from test_study_adaptive import ROLLERS, with_kinds, written

from doe.adaptive.emulators import coordinates, without_inactive
from doe.report.files import write
from doe.study_file.sections import Tolerances
from doe.workflow.adaptive import check_adaptive, region_in_units
from doe.workflow.design import check_runs
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs
from doe.workflow.surfaces import fit_surfaces
from doe.workflow.tolerances import widest_tolerances_of
from doe.workflow.whole import run_study
from rbdyn.base.faults import InputError

GUIDANCE = """[design]
[[factor]]
name = "guidance"
key = "cage.guidance"
categories = ["outer", "roller"]
inactive = {roller = ["guide_clearance_mm"]}

[design]
"""


def guided_study(folder, *more, budget=60):
    return written(folder, ("[design]\n", GUIDANCE[GUIDANCE.index("\n") + 1 :]), *more, budget=budget)


def test_an_inactive_factor_is_one_point_for_all_its_values(tmp_path):
    """Points at the rollers' level differ by nothing in the guide clearance; at the other level they do."""
    study = Problem.load(guided_study(tmp_path))
    region = region_in_units(study)
    assert region.inactive == ((0, 1, (1,)),)
    points = np.array([[0.3, side, -0.2, level] for level in (-1.0, 1.0) for side in (-1.0, 0.5)])
    outer, roller = np.split(coordinates(without_inactive(points, region.levels, region.inactive), region.levels), 2)
    assert np.array_equal(roller[0], roller[1])
    assert not np.array_equal(outer[0], outer[1])
    drawn = region.snap(points)
    assert drawn[2:, 1].tolist() == [0.0, 0.0]
    assert (drawn[:2, 1] != 0.0).all()
    assert points[3, 1] == 0.5, "the points asked about stay as they are"


def test_the_design_leaves_out_what_only_an_inactive_factor_told_apart(tmp_path):
    """Of 8 corners, 6 star and 6 centre points 4, 4 and 6 are left; their scenes keep the key as the scene has it."""
    study = Problem.load(guided_study(tmp_path))
    assert [len(study.with_levels(at).design.coded) for at in study.every_level] == [20, 14]
    there = study.with_levels((1,))
    design = there.design
    assert design.kind == ("cube",) * 4 + ("axial",) * 4 + ("centre",) * 6
    assert not design.coded[:, 1].any()
    check_runs(there, design)
    assert there.assignments(np.array([0.02, 0.2, 0.3])) == [
        "bearing.radial_clearance_mm=0.02", "cage.pocket_clearance_mm=0.3", "cage.guidance=roller",
    ]  # fmt: skip
    scenes = there.design_scenes(there.actual(design.coded), design.order.tolist())
    assert {scene.cage.guide_clearance_mm for scene in scenes} == {0.15}


def test_an_optimal_design_spends_no_run_on_an_inactive_factor(tmp_path):
    kind = (
        'kind = "central_composite"      # 8 cube, 6 axial and 6 centre runs; centre runs differ by their seed only\n'
    )
    rest = 'alpha = "rotatable"\ncentre_replicates = 6\n'
    study = Problem.load(guided_study(tmp_path, (kind + rest, 'kind = "d_optimal"\nruns = 11\n')))
    design = study.with_levels((1,)).design
    assert len(design.coded) == 11 and not design.coded[:, 1].any()
    assert len(np.unique(design.coded, axis=0)) == 9, "the best for a quadratic in two factors are their 3^2"


def test_the_study_follows_a_pick_at_which_a_factor_means_nothing(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr)
    coarsely(monkeypatch.setattr)
    plain = instant_runs.instant_result

    def result(scene):
        found, off = plain(scene), scene.cage.guidance == "roller"
        assert not off or scene.cage.guide_clearance_mm == 0.15
        share = 0.3 if off else 1.0
        return replace(found, impact_force_N=replace(found.impact_force_N, value=share * found.impact_force_N.value))

    monkeypatch.setattr(instant_runs, "instant_result", result)
    unillustrated(monkeypatch.setattr)
    study = Problem.load(guided_study(tmp_path, ('tolerance_aware = "quantile" ', 'tolerance_aware = "none" ')))
    check_adaptive(study, True)
    outcome = run_study(study, tmp_path, 1, lambda title: silent, adaptive=True)
    assert outcome.study.categories == {"guidance": "roller"}
    assert outcome.pick.point[1] == 0.15
    assert (outcome.front.points[:, 1] == 0.15).all()
    assert all("B" not in term for surface in outcome.surfaces for term in surface.terms)
    record = write(outcome, tmp_path)
    words = "guidance = roller (baseline: outer) and no guide_clearance_mm, which has no meaning there"
    assert words in record["adaptive"]["sentence"]
    assert record["adaptive"]["emulators"]["categories"][0]["inactive"] == [[], [1]]
    there = [each for each in record["adaptive"]["points"] if each["factors"]["guidance"] == "roller"]
    assert {each["factors"]["guide_clearance_mm"] for each in there} == {0.15}
    assert "guide_clearance_mm" not in record["tolerances"]
    assert any(
        "chain guide: not solved, since guide_clearance_mm means nothing" in note["text"] for note in record["notes"]
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["guide_clearance_mm"]}', '["guide"]}', "factor.inactive of guidance = 'guide': no such factor; name one of radial_c"),
        ("{roller =", "{rollers =", "inactive.rollers: unknown category; write one of outer, roller"),
    ],
)  # fmt: skip
def test_unknown_names_of_inactive_factors(tmp_path, old, new, words):
    with pytest.raises(InputError, match=words) as refused:
        Problem.load(guided_study(tmp_path, (old, new)))
    assert len(refused.value.faults) == 1


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
    study = Problem.load(with_kinds(tmp_path, given))
    design = study.design
    assert np.unique(np.round(study.actual(design.coded)[:, 0], 9)).tolist() == numbers
    assert np.abs(design.coded).max() <= design.reach * (1.0 + 1e-12)


def test_closed_form_tolerance_beside_a_whole_number(tmp_path):
    """Closed form: responses that are planes g of the guide clearance, at g = -0.5, keep half their gain up to g = -0.25; of parts
    spread evenly over 2h that are 95 % where 0.25 + h = 0.95 (2h)."""
    study = Problem.load(with_kinds(tmp_path))
    coded = study.design.coded
    noise = 1e-9 * np.random.default_rng(1).standard_normal((len(coded), 3))
    values = np.outer(coded[:, 1], [3.0, -0.2, 10.0]) + np.array([10.0, 1.0, 50.0]) + noise
    surfaces = fit_surfaces(study, Runs(coded, study.actual(coded), values, np.full_like(values, np.nan)))
    settings = Tolerances(distribution="uniform", samples=100_000)
    found = widest_tolerances_of(study, surfaces, study.actual(np.array([0.0, -0.5, 0.0])), settings)
    assert np.isnan(found.half_widths[0])
    assert found.half_widths[1] == pytest.approx(0.25 / 0.9 * 0.05, rel=0.01)
    assert found.half_widths[2] == pytest.approx(found.half_widths[1] * 0.005 / 0.02)


def test_a_whole_number_has_no_tolerance(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr)
    coarsely(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    outer = ('["outer", "inner"]', '["outer", "roller"]\ninactive = {roller = ["guide_clearance_mm"]}')
    study = Problem.load(with_kinds(tmp_path, outer))
    assert study.coded_tolerances[0] == 0.0
    assert study.with_levels((1,)).coded_tolerances[:2].tolist() == [0.0, 0.0]
    record = write(run_study(study, tmp_path, 1, lambda title: silent, adaptive=True), tmp_path)
    assert set(record["tolerances"]) <= {"guide_clearance_mm", "pocket_clearance_mm"}
    assert record["tolerances"]["pocket_clearance_mm"]["half_width"] >= 0.0
    with pytest.raises(InputError, match=r"tolerance = 0.5: whole = true has none; leave it out"):
        Problem.load(with_kinds(tmp_path, (ROLLERS, ROLLERS.replace("whole = true", "whole = true\ntolerance = 0.5"))))
