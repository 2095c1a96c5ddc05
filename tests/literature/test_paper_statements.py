"""What the texts of two papers on ball bearings state, and the only measurement of the source papers: ours next to it."""

import importlib
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rbdyn.quasistatic.double_decker import double_decker_of
from rbdyn.quasistatic.finite_search import CONVERGED
from rbdyn.quasistatic.full_system import evaluate, system_of
from rbdyn.quasistatic.row.model import load_of

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def script(monkeypatch):
    """``script(name)``: one of the examples, imported as it is run."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module


@pytest.fixture
def hu(script, monkeypatch):
    """The script on Hu et al. 2021, with every solve timed once and only the slowest and the fastest shaft of Table 4 at 200 N."""
    module = script("paper_000_finite_search")
    monkeypatch.setattr(module, "REPEATS", 1)
    monkeypatch.setattr(module, "TABLE_4", (module.TABLE_4[0], module.TABLE_4[3]))
    module.table_4.cache_clear()
    yield module
    module.table_4.cache_clear()


def by_words(findings):
    """Findings by their first words, up to the bracket that names the figure."""
    return {one.words.rpartition(" (")[0]: one for one in findings}


def test_literature_double_decker_search(hu, script):
    """Literature: Hu et al. 2021, Table 4 and Figs 10, 11: solved in 2 searches (theirs 6 to 8), angles within their 1.1 %."""
    frame = hu.table_4_frame(hu.table_4())
    assert list(frame["status"]) == ["ok"] * 2
    assert list(frame["searches"]) == [2] * 2 and list(frame["their_searches"]) == [6, 8]
    assert frame["gap_percent"].max() < 1e-6
    assert frame["search_s"].max() < 0.1 * frame["their_seconds"].min()
    # Fig 10: of the inner layer the largest inner angle rises from 10000 to 40000 rpm, the outer layer hardly moves.
    assert np.ptp(frame["inner_layer_inner_deg"]) == pytest.approx(2.38, abs=0.01)
    assert np.ptp(frame["outer_layer_inner_deg"]) == pytest.approx(0.03, abs=0.01)
    found = by_words(script("published.ball_papers").search_findings(frame))
    verdicts = {words: one.verdict for words, one in found.items()}
    assert verdicts == {
        "the search solves every condition in a few attempts": "agrees",
        "6 to 8 searches a condition": "differs",
        "a condition takes 90 to 132 s": "untested",
        "searches rise with speed and axial load": "differs",
        "with speed inner angles rise and outer angles fall in both layers": "agrees",
        "the outer layer's angles hardly change with speed": "agrees",
        "two methods differ by at most 1.1 % in a contact angle": "agrees",
        "the offset from the solution falls from search to search": "differs",
    }
    assert "so 4 to 6 fewer" in found["6 to 8 searches a condition"].ours


def test_oracle_equations_of_the_double_decker(hu, script):
    """Oracle: the derivative of all 80 equations is that of differences; Newton's zero has no resultant on either ring."""
    scene = hu.double_decker_scene(200.0, 40000.0)
    stack, load = double_decker_of(scene).stack, load_of(scene)
    double_decker_search = script("published.double_decker_search")
    at = double_decker_search.equations(stack, load)
    found = double_decker_search.solve(stack, load)
    u = np.concatenate([
        np.concatenate((row.balls[:, :2].ravel(), row.displacement[[0, 2]])) for row in (found.inner, found.outer)
    ])  # fmt: skip
    assert u.size == 4 * (17 + 21) // 2 + 4
    residual, jacobian, largest = at(u)
    assert np.abs(residual).max() < 1e-6 * largest
    rng = np.random.default_rng(0)
    for _ in range(3):
        way = 1e-9 * rng.normal(size=u.size)
        change = (at(u + way)[0] - at(u - way)[0]) / 2.0
        assert jacobian @ way == pytest.approx(change, abs=1e-5 * np.abs(change).max())
    # The middle ring hands on what the inner ring bears, but for the centrifugal forces, which balance by symmetry axially.
    assert found.outer.reaction[2] == pytest.approx(200.0, rel=1e-9)


def test_oracle_minimise_is_the_compiled_one(hu, script):
    """Oracle: on one row the method for any equations takes the steps of the compiled one."""
    from rbdyn.quasistatic import finite_search

    minimise = script("published.double_decker_search").minimise
    problem = hu.problem_of(hu.scene(hu.TABLE_3[3]))
    compiled = finite_search.solve(*problem)
    system = system_of(problem.row, problem.load, problem.fixed)

    def at(u):
        residual, jacobian = np.zeros(u.size), np.zeros((u.size, u.size))
        _, largest = evaluate(problem.control, system, u, residual, jacobian)
        return residual, jacobian, largest

    steps, searches = 0, 0
    for start in finite_search.search_points(problem.row):
        searches += 1
        u = np.concatenate((start.ravel(), np.zeros(system.free.size)))
        outcome, taken, _, u = minimise(at, u)
        steps += taken
        if outcome == CONVERGED:
            break
    assert (searches, steps) == (compiled.searches, compiled.steps)
    assert u[: 2 * len(start)].reshape(-1, 2) == pytest.approx(compiled.balls[:, :2], rel=1e-9)


def test_literature_25_newtons_at_100_radial_are_impossible(script):
    """Literature: Sensors 2023, Fig 9: ten balls of 25 N hold 81 N at most; held axially Stribeck's 4.37 F/(Z cos a)."""
    papers = script("published.ball_papers")
    assert papers.least_ball_load(100.0, 10) == pytest.approx(100.0 * math.sin(math.pi / 10.0), rel=1e-12)
    assert papers.least_ball_load(100.0, 9) == pytest.approx(200.0 * math.sin(math.pi / 18.0), rel=1e-12)
    held = papers.figures_of(100.0)
    assert held["load_N"] == pytest.approx(4.37 * 100.0 / (10.0 * math.cos(math.radians(15.0))), rel=0.005)
    assert held["load_N"] > papers.least_ball_load(100.0, 10) > papers.LARGEST_LOAD_N


def test_literature_statements_on_the_small_bearing(script):
    """Literature: Sensors 2023: trends of Figs 9, 10, 11, 14 hold; 25 N, 19000 N/mm and Table 2 as printed do not."""
    papers = script("published.ball_papers")
    frame, tilted = papers.conditions(), papers.deflections()
    found = by_words(papers.angular_findings(frame, tilted))
    assert {words: one.verdict for words, one in found.items()} == {
        "largest ball load 25 N at 100 N radial": "differs",
        "ball loads rise with radial load": "agrees",
        "radial stiffness rises with radial load": "agrees",
        "radial stiffness 19000 N/mm at most, at 100 N": "differs",
        "life falls with radial load, ever more slowly": "agrees",
        "life falls little with deflection, 1.3 to 2.8 mrad at 200 N": "agrees",
        "ball loads rise from condition 1 to 6": "differs",
        "radial displacements of a finite-element model within 9 % of its theory": "untested",
    }
    assert frame["stiffness_N_mm held axially"].iloc[-1] == pytest.approx(
        1.48 * papers.LARGEST_STIFFNESS_N_MM, rel=0.01
    )
    # Without an axial force Hertz contacts in a fixed zone: F_r goes with the displacement to the power 3/2.
    held = frame["stiffness_N_mm held axially"]
    assert held.iloc[-1] / held.iloc[0] == pytest.approx(2.0 ** (1.0 / 3.0), rel=0.01)
    # As printed the first three conditions load a ball beyond the 100 N of the sixth.
    assert (frame["load_N as printed"][:3] > 1.8 * frame["load_N as printed"].iloc[-1]).all()
    assert frame["load_N in line"].is_monotonic_increasing
    assert tilted["life_h"].iloc[-1] / tilted["life_h"].iloc[0] == pytest.approx(0.896, abs=0.002)


def test_literature_measured_cage_speed_is_untested(script):
    """Literature: Chen et al. 2022, Fig. 8: no value stands in the text, so no verdict is claimed; the trend is one."""
    module = script("published.cage_speed")
    assert module.SPEEDS_RPM == (20000, 22000, 24000, 26000, 28000, 30000, 32000) and module.LOAD_N == 1200
    frame = pd.DataFrame({"shaft_rpm": [2e4, 3.2e4], "cage_rpm": [7838.9, 12528.7], "slip": [0.0113, 0.0124]})
    measured, trend = module.findings(frame)
    assert (measured.kind, measured.verdict) == ("measured", "untested")
    assert "untested: values are in a picture" in measured.ours and "7839 to 12529 rpm" in measured.ours
    assert (trend.kind, trend.verdict) == ("trend", "agrees")
    falling = frame.assign(cage_rpm=[12528.7, 7838.9])
    assert module.findings(falling)[1].verdict == "differs"


def test_literature_cage_speed_at_the_test_point(script):
    """Literature: at 1200 N and 26000 rpm our cage keeps within 2 % of n_i (1 - D/d_m)/2, as a loaded roller bearing does."""
    module, common = script("published.cage_speed"), script("published.common")
    frame = module.cage_speed(common.Effort(replicates=1, turns=5, discard_turns=5), (26000,)).frame
    (row,) = frame.to_dict("records")
    assert row["kinematic_rpm"] == pytest.approx(0.5 * 26000.0 * (1.0 - 9.0 / 43.5), rel=1e-3)
    assert 0.0 < row["slip"] < 0.02
