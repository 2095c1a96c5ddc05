"""What a report tells of a search in few runs: fronts on one scale, where runs were spent, what holds the selected design."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from coarse_search import coarsely
from instant_runs import instantly
from scipy.stats import qmc
from short_studies import SHORT, paper_study, run_study, short_study, silent

from doe import clearance
from doe.adaptive.emulators import Region
from doe.adaptive.search import Face
from doe.pareto.search import REFERENCE
from doe.report.files import write
from doe.report.sections.front import SUFFICIENT_MISS, in_few_runs, limiting_sentence
from doe.report.summary import Summary
from doe.workflow.adaptive import pulls
from doe.workflow.confirmation import Limit
from doe.workflow.problem import Problem
from rbdyn.base.blocks import Figures

GOAL = 'name = "whirl_deviation_ratio"\nmodel = "quadratic"\ngoal = '


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    """A search of a short study, what it found, its record and its folder."""
    patch = pytest.MonkeyPatch()
    instantly(patch.setattr)
    coarsely(patch.setattr)
    patch.setattr(clearance, "histories", lambda *rest: {})
    patch.setattr(clearance, "draw_motion", lambda *rest: [])
    source = tmp_path_factory.mktemp("study")
    path = short_study(source, SHORT, (f'{GOAL}"min"', f'{GOAL}"max"'))
    text = path.read_text(encoding="utf-8").replace("population = 100", "population = 24")
    path.write_text(f"{text}\n[adaptive]\nbudget = 36\nbatch = 6\n", encoding="utf-8")
    study, folder = Problem.load(path), tmp_path_factory.mktemp("out")
    outcome = run_study(study, folder, 1, lambda title: silent, adaptive=True)
    record = write(outcome, folder)
    patch.undo()
    return study, outcome, record, folder


def dominated(costs: np.ndarray, ideal: np.ndarray, nadir: np.ndarray) -> float:
    """Hypervolume by counting levels below which a point lies."""
    scaled = (costs - ideal) / (nadir - ideal)
    levels = REFERENCE * qmc.Sobol(scaled.shape[1], seed=1).random_base2(14)
    below = (scaled[None] <= levels[:, None]).all(axis=2).any(axis=1)
    return float(below.mean()) * REFERENCE ** scaled.shape[1]


def test_oracle_hypervolumes_of_all_fronts_are_on_one_scale(studied):
    """Oracle: levels counted; of the front foretold, of the surfaces' front as it is drawn, of the search's fresh runs."""
    study, outcome, record, _ = studied
    goals, emulators = study.goals, outcome.adaptive.search.emulators
    told = record["adaptive"]["compared"]
    costs = goals.costs(outcome.adaptive.search.predictions)
    front = [row for row in costs if not ((costs <= row).all(axis=1) & (costs < row).any(axis=1)).any()]
    scale = np.min(front, axis=0), np.max(front, axis=0)
    assert list(told["ideal"].values()) == pytest.approx(scale[0])
    assert list(told["nadir"].values()) == pytest.approx(scale[1])
    drawn = np.array([study.rounded(point) for point in outcome.front.points])
    on_surfaces, _ = emulators.predict((drawn - study.centre) / record["adaptive"]["emulators"]["half_range"])
    for mine, costs in (
        (told["search"][-1], goals.costs(outcome.adaptive.search.predictions)),
        (told["surfaces"], goals.costs(on_surfaces)),
        (told["fresh"]["hypervolume"], outcome.adaptive.search.front.costs),
    ):
        assert mine == pytest.approx(dominated(costs, *scale), rel=0.03)
    assert len(told["search"]) == len(record["adaptive"]["history"])


def test_the_page_draws_the_fronts_and_the_scale_is_that_of_the_history(studied):
    _, _, record, folder = studied
    page = (folder / "report.html").read_text(encoding="utf-8")
    (picture,) = re.findall(r'<svg[^>]*aria-label="Hypervolume of the search.*?</svg>', page, re.DOTALL)
    assert picture.count('<g class="surrogate">') == 1 and "front of the search in few runs, simulated" in page
    history = [each["hypervolume"] for each in record["adaptive"]["history"]]
    assert record["adaptive"]["compared"]["search"] == pytest.approx(history, rel=1e-12)


def test_the_picture_has_every_run_by_its_reason(studied):
    _, _, record, _ = studied
    progress, places = (
        [picture() for picture in block.pictures]
        for block in in_few_runs(Summary.from_dict(record))
        if isinstance(block, Figures)
    )
    adaptive = record["adaptive"]
    reasons = [each["why"] for each in adaptive["points"]]
    assert len(places) == len(record["pick"]) - 1
    for picture in places:
        for why in {*reasons, "fresh"}:
            count = len(adaptive["front"]) if why == "fresh" else reasons.count(why)
            (marks,) = re.findall(f'<g class="{why}"[^>]*>(.*?)</g>', picture)
            assert len(re.findall("<(?:use|path) [^>]*><title>", marks)) == count, why
        assert picture.count('<g class="pick">') == 1
    dots = re.findall(r"<title>(\d+) runs: ([\d.]+)</title>", progress[0].partition('<g class="fresh"')[0])
    assert [int(runs) for runs, _ in dots] == [each["runs"] for each in adaptive["history"]]
    assert [float(y) for _, y in dots] == pytest.approx(adaptive["compared"]["search"], abs=6e-4)


def test_sentences_say_pick_end_hold_trust_and_hypervolumes(studied):
    _, outcome, record, folder = studied
    answer, spent, held, trust, beside = record["adaptive"]["sentences"]
    for name, value in record["pick"].items():
        assert f"{name[:-3].replace('_', ' ')} {value:.4g} mm" in answer
    for name, gain in record["gains"].items():
        assert f"{name} {abs(gain['percent']):.2f} %" in answer
    assert f"because {record['adaptive']['stopped']}. It took {record['adaptive']['runs']} runs" in spent
    assert held == record["adaptive"]["held"] and held.startswith("What limits the selected design: ")
    fresh = outcome.adaptive.search
    claimed = np.hypot(fresh.bias, fresh.spread)
    assert all(f"{times:.1f}" in trust for times in claimed)
    assert ("as their stated uncertainty allows" in trust) == bool((claimed <= SUFFICIENT_MISS).all())
    compared = record["adaptive"]["compared"]
    assert f"({100.0 * compared['surfaces'] / compared['search'][-1]:.0f} % of the first)" in beside
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.index('class="tiles"') < page.index("The selected design has") < page.index("The search ended because")


def foretelling(predict, faces=()):
    """The example with a search that foretells responses so over coded factors, its pick foretold at faces of the region."""
    study = paper_study()
    one = np.ones(3)
    goals = study.goals
    corners = np.random.default_rng(1).uniform(-1.0, 1.0, (64, 3))
    emulators = SimpleNamespace(predict=lambda at: (predict(at), None), runs=SimpleNamespace(values=predict(corners)))
    found = SimpleNamespace(
        emulators=emulators, region=Region(-one, one, 0.0 * one, np.nan * one, 0.01 * one), faces=faces,
        predictions=predict(corners), front=SimpleNamespace(goals=goals),
    )  # fmt: skip
    half = 1.681792830507429 * study.step
    edges = np.column_stack([study.centre - half, study.centre + half])
    return study, SimpleNamespace(search=found, study=study, front=found.front, edges=edges), study.centre, half


def test_what_pulls_at_a_factor_and_what_turns_there():
    """A parabola turns where it is least; planes pull to their lower side; what is flat does neither."""

    def predict(at):
        a, b, _ = at.T
        return np.column_stack([(a - 0.2) ** 2 + b, -b + 3.0, 5.0 + 0.0 * a])

    face = Face(2, 1, 1.0, 0.97, "scene")
    study, adaptive, centre, half = foretelling(predict, (face,))
    first, second, third = pulls(study, adaptive, centre + half * np.array([0.2, 0.0, 0.98]))
    assert (first.more, first.less, first.turn, first.face) == ([], [], ["impact_force_N"], None)
    assert (second.more, second.less, second.turn) == (["whirl_deviation_ratio"], ["impact_force_N"], [])
    assert third.face == face and third.more == third.less == third.turn == []
    outcome = SimpleNamespace(
        study=study, adaptive=adaptive, pick=SimpleNamespace(point=centre + half * np.array([0.2, 0.0, 0.98])),
        limits=[Limit.judged("power_loss_W", "<=", 6.0, 5.0, 0.1, 0.8), Limit.judged("impact_force_N", "<=", 0.02, 0.0, 0.01, 0.8)],
        chains={"guide": SimpleNamespace(refused=False), "pocket": SimpleNamespace(refused=True)},
    )  # fmt: skip
    told = limiting_sentence(outcome)
    assert "where impact_force_N turns" in told
    assert (
        "whirl_deviation_ratio would improve with a larger value and impact_force_N would improve with a smaller value"
        in told
    )
    assert "(the front continues beyond with a probability of 0.97), beyond it the bearing would lose" in told
    assert "limit impact_force_N <= 0.02" in told and "power_loss_W <=" not in told
    assert "dimension chain pocket cannot" in told and "guide cannot" not in told
    outcome.pick.point = centre - half
    assert "at the edge of the design region; set allowed" in limiting_sentence(outcome), "its own pick lay elsewhere"
    factors = [each.model_copy(update={"allowed": (0.01, 0.5)}) for each in study.file.factor]
    outcome.study = replace(study, file=study.file.model_copy(update={"factor": factors}))
    assert "at the edge of the searched region" in limiting_sentence(outcome), "it might have grown"
