"""Figures that the manual quotes: each stands in the prose once, and is that of a run of the commands of its page."""

from typing import Any

import manual_figures
import pytest

PAGES = manual_figures.pages()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page["file"])
def test_quoted_figures_stand_in_the_prose(page):
    """Report: every figure that a command checks is on its page, exactly once, with a term for each number."""
    places = list(manual_figures.quoted(page))
    assert len(places) >= 3
    for figure, place in places:
        assert len(place.groups()) == len(figure["values"])
        assert {term.partition(":")[0] for term in figure["values"]} <= set(page["runs"])


def test_a_stale_figure_is_found():
    """Report: a figure counts as stale beyond half of its last digit and the errors of both."""
    run = {
        "power_loss_W": {"value": 239.4, "statistical_error": 0.12, "numerical_error": 0.03},
        "notes": [{"text": "loss of 13 W"}],
    }
    assert manual_figures.valued("a:power_loss_W", {"a": run}) == pytest.approx((239.4, 0.1237), abs=1e-4)
    assert manual_figures.valued("a:power_loss_W - b:power_loss_W", {"a": run, "b": run})[0] == 0.0
    assert manual_figures.valued(r"a:notes~of (\d+) W", {"a": run}) == (13.0, 0.0)
    assert not manual_figures.Compared("page", "words", 239.0, 239.4, 0.65).stale
    assert manual_figures.Compared("page", "words", 8.0, 7.06, 0.68).stale
    assert manual_figures.Compared("page", "words", 8.0, float("nan"), 0.68).stale


def simulations_alone(page: dict[str, Any]) -> dict[str, Any]:
    """The page with its runs of single simulations, and the figures that need no other; whole studies take minutes."""
    runs = {name: lines for name, lines in page["runs"].items() if not any(line.startswith("doe ") for line in lines)}
    needs = [
        {run for run in page["runs"] for term in figure["values"] if f"{run}:" in term} for figure in page["figure"]
    ]
    figures = [figure for figure, need in zip(page["figure"], needs, strict=True) if need <= set(runs)]
    return {**page, "runs": runs, "figure": figures}


@pytest.mark.slow
def test_quoted_figures_of_simulations_are_those_of_a_run(tmp_path):
    """Report: the simulations of the pages give what these quote, within the errors; the script runs the studies too."""
    pages = [simulations_alone(page) for page in PAGES]
    rows = [
        row for page in pages for row in manual_figures.compared(page, manual_figures.records(page, tmp_path, None))
    ]
    assert len(rows) > 5 and [row for row in rows if row.stale] == []
