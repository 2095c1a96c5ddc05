"""What a notebook shows of a result: a line and a small table of figures with units and errors, not all that it holds."""

import re
from html import unescape
from pathlib import Path

import pytest

import rbdyn
from rbdyn.dynamics.motion import history

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def results(outer, outer_result):
    """Each kind of result, and what its table must tell: words, value with its error, unit."""
    ball = rbdyn.equilibrium(rbdyn.Scene.load(EXAMPLES / "deep_groove_ball.toml"))
    motion = history(outer, 1.0)
    loss, stress = outer_result.power_loss_W, ball.report.max_stress_MPa["inner"]
    return {
        "simulation": (outer_result, f"power loss {loss.value:.1f}"[:12], "W"),
        "ball": (ball, f"pressure, inner raceway {stress:.4f}"[:27], "MPa"),
        "history": (motion, "largest pocket force", "N"),
    }


@pytest.mark.parametrize("kind", ["simulation", "ball", "history"])
def test_unit_a_result_shows_figures_and_no_more(results, kind):
    """Unit: the line is short; every row of the table has a name, a finite figure and, where it is no ratio, a unit."""
    result, told, unit = results[kind]
    assert len(repr(result)) < 320 and told in repr(result)
    table = result._repr_html_()
    rows = re.findall(
        r'<tr><th style="text-align:left">([^<]*)</th><td>([^<]*)</td><td>([^<]*)</td></tr>', unescape(table)
    )
    assert 3 < len(rows) < 30 and len(table) < 4500
    assert all(name and re.match(r"-?\d", value) for name, value, _ in rows)
    assert [mark for _, _, mark in rows if mark == unit]


def test_unit_errors_stand_beside_the_figures(outer_result):
    """Unit: value and stated error to the error's two digits."""
    rows = dict(re.findall(r'left">([^<]*)</th><td>([^<]*)</td>', outer_result._repr_html_()))
    value, error = (float(part) for part in rows["power loss"].split(" ± "))
    assert error == pytest.approx(outer_result.power_loss_W.error, rel=0.06)
    assert value == pytest.approx(outer_result.power_loss_W.value, abs=0.06 * error)
    assert set(rows) >= {"impact force", "whirl deviation ratio", "cage speed", "cage slip"}


def test_unit_what_was_not_found_says_why():
    """Unit: no equilibrium has no figures, only its status."""
    from dataclasses import replace

    found = rbdyn.equilibrium(rbdyn.Scene.load(EXAMPLES / "deep_groove_ball.toml"))
    lost = replace(found, status="lost: no ball bears", report=None)
    assert repr(lost).startswith("<BallResult: lost: no ball bears") and "<td>" not in lost._repr_html_()
