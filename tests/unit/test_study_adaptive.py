"""The study that follows the front found in few runs: files, the same bits however it runs, faults, advice."""

import csv
import sqlite3
from dataclasses import replace

import numpy as np
import pytest
from coarse_search import coarsely
from doe_command import doe
from instant_runs import instantly, unillustrated
from short_studies import SHORT, paper_study, run_design, run_study, short_study, silent

from doe import clearance
from doe.clearance import Simulations
from doe.report.files import write
from doe.report.sections.front import spent_sentence
from doe.response_surface.statistics import describe
from doe.running.store import STORE, Store
from doe.workflow.adaptive import advice, border_of, check_adaptive, compare_fronts, find_adaptive, region_in_units
from doe.workflow.front_record import SearchResult
from doe.workflow.pick import _share_words as share_words
from doe.workflow.problem import Problem
from doe.workflow.surfaces import fit_surfaces
from rbdyn.base.faults import InputError

GOAL = 'name = "whirl_deviation_ratio"\nmodel = "quadratic"\ngoal = '


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """What these searches find is not the subject."""
    coarsely(monkeypatch.setattr)


def written(folder, *replacements, budget=36):
    """The example, short, with a trade-off between whirl and the rest; one run of the design fails where asked."""
    folder.mkdir(exist_ok=True)
    path = short_study(folder, SHORT, (f'{GOAL}"min"', f'{GOAL}"max"'))
    text = path.read_text(encoding="utf-8").replace("population = 100", "population = 24")
    text += f"\n[adaptive]\nbudget = {budget}\nbatch = 6\n"
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


def search(path, folder, workers):
    folder.mkdir(exist_ok=True)
    study = Problem.load(path)
    runs = run_design(study, folder, workers, silent)
    with Store(folder / STORE) as store:
        return find_adaptive(study, runs, Simulations(store, workers, None, False, lambda title: silent))


def limits(path, *replicates):
    study = Problem.load(path)
    scenes = study.adaptive_scenes(np.tile(study.baseline, (len(replicates), 1)), replicates, 0)
    assert [scene.numerics.replicates for scene in scenes] == list(replicates)
    return {scene.numerics.extend_limit for scene in scenes}


def test_runs_that_drift_are_lengthened_to_twice_at_most_unless_the_study_says_so(tmp_path):
    assert limits(written(tmp_path), 2, 5) == {2.0}
    own = ("batch = 6\n", 'batch = 6\nset = ["numerics.extend_limit=5"]\n')
    assert limits(written(tmp_path / "own", own), 4) == {5.0}
    short = ('toml"\nset = ["', 'toml"\nset = ["numerics.extend_limit=1.5", "')
    assert limits(written(tmp_path / "short", short), 4) == {1.5}


def test_replicates_of_the_last_points_run_side_by_side(tmp_path, monkeypatch):
    """Of seven points, two threads and the last three, that threads may otherwise wait for."""
    instantly(monkeypatch.setattr)
    study, asked, run = Problem.load(written(tmp_path)), [], clearance.attempt
    monkeypatch.setattr(
        clearance, "attempt", lambda scene, stop, inside: asked.append((scene.numerics.seed, inside)) or run(scene)
    )
    scenes = study.adaptive_scenes(np.tile(study.baseline, (7, 1)), [2] * 7, 0)
    with Store(tmp_path / STORE) as store:
        Simulations(store, 2, None, False, lambda title: silent).run(scenes, ["run"] * 7, silent)
    assert [inside for _, inside in sorted(asked)] == [1, 1, 1, 1, 2, 2, 2]


def test_the_study_follows_the_adaptive_front(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr)
    monkeypatch.setattr(clearance, "histories", lambda *rest: {})
    monkeypatch.setattr(clearance, "draw_motion", lambda *rest: [])
    told = []
    study = Problem.load(written(tmp_path))
    outcome = run_study(study, tmp_path, 1, lambda title: told.append(title) or silent, adaptive=True)
    chosen, front = outcome.searched_pick, outcome.adaptive.front
    assert outcome.pick.point == pytest.approx(front.points[chosen.row], abs=6e-4)
    assert "adaptive front" in outcome.pick.reason and "also at the ends of their tolerances" in outcome.pick.reason
    assert "pick_of_surfaces" in outcome.confirmed
    assert any("% to gain" in title for title in told)
    record = write(outcome, tmp_path)
    found = record["adaptive"]
    keys = {"front", "runs", "hypervolume", "history", "stopped", "extended"}
    assert keys <= set(found)
    assert {"factors", "responses", "errors"} == set(found["front"][0])
    assert found["runs"] + found["fresh"] <= 36
    assert found["history"][0]["runs"] == 20
    assert {each["why"] for each in found["points"]} <= {"design", "improvement", "check"}
    assert found["chosen"]["row"] == chosen.row
    share = found["chosen"]["share"]
    assert 0.0 < share <= 1.0 and chosen.shares.sum() == pytest.approx(1.0)
    assert (
        f"the same point is selected in {100.0 * share:.0f} of 100 draws of the simulation's errors"
        in outcome.pick.reason
    )
    assert not any("--adaptive" in note["text"] for note in record["notes"])
    with (tmp_path / "front.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == found["predicted_front_points"]
    assert {"radial_clearance_mm", "power_loss_W", "power_loss_W_error"} <= set(rows[0])
    assert "adaptive_search.png" in record["files"] and (tmp_path / "adaptive_search.png").stat().st_size > 10_000
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "in few runs" in page and "The search ended because" in page
    text = (tmp_path / "answer.txt").read_text(encoding="utf-8")
    assert "\nThe selected design has radial clearance " in text and "\nWhat limits the selected design: " in text


def test_invariant_same_bits_for_any_number_of_workers_and_after_an_interruption(tmp_path, monkeypatch):
    """Invariant: one thread, three threads, and three that begin with every second run of the store."""
    ran = instantly(monkeypatch.setattr)
    path = written(tmp_path / "study")
    one, three = (search(path, tmp_path / name, workers) for name, workers in (("one", 1), ("three", 3)))
    before = len(ran)
    again = search(path, tmp_path / "three", 2)
    assert len(ran) == before, "what is stored is not run again"
    connection = sqlite3.connect(tmp_path / "three" / STORE)
    with connection:
        connection.execute("DELETE FROM runs WHERE rowid % 2 = 0")
    connection.close()
    half = search(path, tmp_path / "three", 3)
    assert before < len(ran) < 1.5 * before
    for other in (three, again, half):
        assert np.array_equal(one.front.points, other.front.points)
        assert np.array_equal(one.front.values, other.front.values)
        assert repr(one.search.history) == repr(other.search.history)


def test_a_rival_that_rounds_to_no_draw_is_not_named():
    assert share_words(np.array([0.998, 0.002]), 0).endswith("selected in 100 of 100 draws of the simulation's errors")
    assert share_words(np.array([0.9, 0.08, 0.02]), 0).endswith("errors, another in 8")


def test_runs_that_fail_are_told_and_left_out(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr, faulty=[4_000_001, 4_000_005])
    found = search(written(tmp_path), tmp_path, 1)
    assert len(found.failures) == 2
    assert "adaptive run 1" in str(found.failures[0])
    assert np.isfinite(found.front.values).all()


def test_points_are_on_the_drawing_and_inside():
    study = paper_study()
    region = region_in_units(study)
    points = region.snap(np.random.default_rng(1).uniform(-1.1, 1.1, (200, 3)))
    assert np.abs(points).max() <= 1.0
    actual = study.centre + points * 1.681792830507429 * study.step
    assert actual == pytest.approx(np.round(actual, 3), abs=1e-12)
    assert actual[:, 0].min() == pytest.approx(0.012)
    assert region.apart * 1.681792830507429 * study.step == pytest.approx([0.001] * 3)


def test_the_region_grows_within_what_is_allowed(tmp_path, monkeypatch):
    """Responses that are planes: the selected design goes as far as it may, and the record says what holds it."""
    instantly(monkeypatch.setattr)
    pocket = 'key = "cage.pocket_clearance_mm"\n'
    path = written(tmp_path, (pocket, f"{pocket}allowed = [0.15, 0.40]\n"), budget=60)
    found = search(path, tmp_path, 1)
    study = Problem.load(path)
    record = SearchResult.of(study, found, compare_fronts(study, found, found.front.points))
    assert {move.factor for move in record.extended} == {"pocket_clearance_mm"}
    assert 0.15 <= found.edges[2, 0] < 0.2159 or found.edges[2, 1] > 0.3841
    assert found.front.points[:, 2].min() >= 0.15 and found.front.points[:, 2].max() <= 0.40
    assert "Its region grew: pocket clearance to 0." in spent_sentence(study, found)
    corners = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    assert border_of(study).possible(corners)
    kept = written(
        tmp_path / "kept",
        (pocket, f"{pocket}allowed = [0.15, 0.40]\n"),
        ("batch = 6", "batch = 6\nleast_clearance_um = 12"),
    )
    assert not border_of(Problem.load(kept)).possible(corners), "0.0116 mm at the lower end of the radial clearance"
    assert border_of(Problem.load(kept)).possible(corners[:1])
    narrow = written(tmp_path / "narrow", (pocket, f"{pocket}allowed = [0.25, 0.40]\n"))
    with pytest.raises(
        InputError, match=r"factor.allowed of pocket_clearance_mm = \[0.25, 0.4\]: must reach over the region"
    ):
        check_adaptive(Problem.load(narrow))


RADIAL = """name = "radial_clearance_mm"
key = "bearing.radial_clearance_mm"
centre = 0.020
step = 0.005
resolution = 0.001              # of the drawing
tolerance = 0.003               # half width that can be manufactured
"""
ROLLERS = """name = "rollers"
key = "bearing.rollers"
centre = 10
step = 1
whole = true
"""


def with_rollers(folder, *more):
    """Whole rollers in the place of the radial clearance."""
    path = written(
        folder,
        (RADIAL, ROLLERS),
        ('tolerance_aware = "quantile" ', 'tolerance_aware = "none" '),
        ("radial_clearance_mm = 0.020", "rollers = 10"),
        ('[reference]\nfile = "ccd_table4.csv"\nlabel = "Chen et al. 2022, Table 4"\n', ""),
        *more,
        budget=70,
    )
    before, _, after = path.read_text(encoding="utf-8").partition("[reference.why]")
    path.write_text(before + after[after.index("[adaptive]") :], encoding="utf-8")
    return path


def test_whole_numbers_end_to_end(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    study = Problem.load(with_rollers(tmp_path))
    outcome = run_study(study, tmp_path, 1, lambda title: silent, adaptive=True)
    assert float(outcome.pick.point[0]).is_integer()
    assert all(float(point[0]).is_integer() for point in outcome.runs.actual)
    record = write(outcome, tmp_path)
    assert all(float(each["factors"]["rollers"]).is_integer() for each in record["adaptive"]["points"])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("whole = true", "whole = true\nresolution = 1.0", "resolution = 1: whole = true has none but 1"),
        ("step = 1\n", "step = 0.5\n", "step = 0.5: is less than a whole number; widen it"),
    ],
)
def test_faults_of_whole_numbers(tmp_path, old, new, words):
    with pytest.raises(InputError, match=words) as error:
        Problem.load(with_rollers(tmp_path, (old, new)))
    assert len(error.value.faults) == 1


def test_faults_are_one_sentence_each(tmp_path, monkeypatch):
    instantly(monkeypatch.setattr)
    path = written(tmp_path / "small", budget=30)
    ended = doe("study", str(path), "--adaptive", "--out", str(tmp_path / "small" / "out"))
    words = "adaptive.budget = 30: 20 runs of the design, a batch of 6 and 6 fresh runs at the end do not fit; give at"
    assert ended.returncode == 2 and words in ended.stderr and ended.stderr.count("\n") == 1
    limit = (
        'name = "power_loss_W"\nmodel = "quadratic"\n',
        'name = "power_loss_W"\nmodel = "quadratic"\nupper = -5.0\n',
    )
    with pytest.raises(
        InputError, match=r"no point of the region meets all limits. The closest .* violates power_loss_W <= -5"
    ):
        search(written(tmp_path / "limit", limit), tmp_path / "limit", 1)


def test_advice_where_surfaces_miss_more_than_noise():
    from pareto_cases import EXAMPLES

    study = paper_study()
    from doe.workflow.runs import read_runs

    runs = read_runs(study, EXAMPLES / "ccd_table4.csv")
    bent = runs.values + 1e3 * np.sin(3.0 * runs.coded[:, :1])
    (sentence,) = advice(
        study.with_surfaces(fit_surfaces(study, type(runs)(runs.coded, runs.actual, bent, runs.errors)))
    )
    assert sentence == "The predicted front is biased by lack of fit in every response. Use --adaptive (80 more runs)"
    smooth = 5.0 + runs.coded @ np.ones((3, 3)) + np.random.default_rng(1).normal(0.0, 0.1, runs.values.shape)
    assert (
        advice(study.with_surfaces(fit_surfaces(study, type(runs)(runs.coded, runs.actual, smooth, runs.errors)))) == []
    )
    # One test sees the bend, the other does not: the surface is in doubt, as its own sentence says, and the front is not "biased".
    slightly = smooth + 0.2 * np.sin(3.0 * runs.coded[:, :1])
    doubtful = replace(runs, values=slightly, errors=np.full_like(bent, 0.2), replicates=np.full(bent.shape, 8))
    surfaces = fit_surfaces(study, doubtful)
    assert [any("lack of fit is in doubt" in text for text in describe(surface)) for surface in surfaces] == [
        True,
        False,
        True,
    ]
    assert surfaces[2].lack_of_fit.p < 0.01 and advice(study.with_surfaces(surfaces)) == []
