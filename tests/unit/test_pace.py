"""Time of the runs of a scene: stated once after the first, with what shortens it; no figure depends on it."""

import io
import logging
import re
import sys

import pytest

import rbdyn
from rbdyn.base.command import progress_bar
from rbdyn.base.words import duration, estimate
from rbdyn.dynamics import ensemble
from rbdyn.dynamics.ensemble import Pace, in_turn, keys_of, plan_of
from rbdyn.dynamics.simulate import simulate

QUICK = ("numerics.turns=4", "numerics.discard_turns=1", "numerics.replicates=2")


def watched(looks, turns=1200.0, first=120.0, threads=2, keys=("numerics.turns",)):
    """A pace and what it states at looks (run, seconds, shaft turns)."""
    stated = []
    one = Pace(stated.append, turns, first, threads, keys)
    for look in looks:
        one.look(*look)
    return one, stated


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.0123, "0.012 s"), (2.34, "2.3 s"), (119.0, "120 s"), (150.0, "2.5 min"), (9000.0, "2.5 h"), (1e6, "12 days")],
)
def test_unit_a_duration_has_two_digits_and_the_unit_that_suits_it(seconds, words):
    """Unit: seconds, minutes, hours and days."""
    assert duration(seconds) == words


def test_unit_only_a_plan_above_two_minutes_says_how_to_make_it_smaller():
    """Unit: the keys follow from 120 s on."""
    keys = ("adaptive.budget", "numerics.turns", "numerics.replicates")
    assert estimate(119.0, keys) == "the rest takes about 120 s"
    longer = "the rest takes about 2 min; reduce adaptive.budget, numerics.turns or numerics.replicates to shorten it"
    assert estimate(121.0, keys) == longer
    assert estimate(100.0, keys, 600.0).endswith(
        "; reduce adaptive.budget, numerics.turns or numerics.replicates to shorten it"
    )


def test_unit_the_rest_is_estimated_from_the_first_run():
    """Unit: of 1200 turns a thread the first run made 120 in 12 s, so 108 s follow; later looks say nothing."""
    one, stated = watched([(0, 6.0, 60.0), (1, 6.0, 60.0), (0, 12.0, 120.0), (1, 14.0, 120.0)])
    # Both runs made 180 turns in 18 s, 9 s on each thread.
    assert stated == ["the rest takes about 110 s"] and one.estimate_s == pytest.approx(120.0)


def test_unit_a_slow_first_run_is_not_waited_for():
    """Unit: after twenty seconds the turns made so far tell."""
    _, stated = watched([(0, 19.0, 1.0), (0, 21.0, 1.0)])
    assert len(stated) == 1 and stated[0].startswith("the rest takes about 7 h; reduce numerics.turns")


def test_unit_short_runs_say_nothing():
    """Unit: nothing where less than some seconds are left, in the first moments, and where nobody listens."""
    assert watched([(0, 2.5, 120.0)], turns=150.0)[1] == [] and watched([(0, 0.5, 120.0)])[1] == []
    assert watched([(0, 12.0, 0.0)])[1] == []
    silent = Pace(None, 1200.0, 120.0, 2)
    silent.look(0, 12.0, 120.0)
    assert silent.estimate_s is None


def test_unit_runs_that_get_longer_are_estimated_anew():
    """Unit: with 1200 turns more the rest is stated again with the reason; before a first estimate there is none."""
    one, stated = watched([(0, 12.0, 120.0)])
    one.lengthen(1200.0, 240.0)
    one.look(0, 24.0, 240.0)
    shorter = "reduce numerics.turns to shorten it"
    assert (
        stated[1] == f"results drift, so all runs continue to 240 shaft turns: the rest takes about 3.6 min; {shorter}"
    )
    early, first = watched([])
    early.lengthen(1200.0, 240.0)
    early.look(0, 12.0, 120.0)
    assert first == [f"the rest takes about 3.8 min; {shorter}"]


def test_unit_a_plan_counts_replicates_and_companions(make_scene):
    """Unit: rounds of threads, the runs in words, and what shortens them."""
    scene = make_scene(
        "numerics.replicates=3", "numerics.turns=10", "numerics.discard_turns=2", "numerics.companion=true"
    )
    companions = scene.numerics.companions
    assert companions and in_turn(scene) == 12.0 * (3 + companions) and in_turn(scene, 4) == 24.0
    assert plan_of(scene, 4) == f"{3 + companions} runs of 12 shaft turns, 4 at once"
    assert plan_of(scene, 4, 5).startswith(f"{5 * (3 + companions)} runs ")
    assert keys_of(scene) == ["numerics.turns", "numerics.replicates"]
    assert keys_of(make_scene("bearing.roller_profile=logarithmic", "numerics.replicates=1"))[0] == "model.slices"


def test_invariant_a_statement_changes_no_figure(make_scene, monkeypatch, caplog):
    """Invariant: stated or not, by default as a warning of the logger "rbdyn", a simulation has the same bits."""
    scene, stated = make_scene(*QUICK), []
    plain = simulate(scene, notice=stated.append)
    assert stated == []
    monkeypatch.setattr(ensemble, "LOOK_S", 0.0)
    monkeypatch.setattr(ensemble, "NOTABLE_S", 0.0)
    with caplog.at_level(logging.WARNING, "rbdyn"):
        again = simulate(scene)
    assert [each.getMessage().startswith("the rest takes about ") for each in caplog.records] == [True]
    assert (again.impact_force_N, again.power_loss_W) == (plain.impact_force_N, plain.power_loss_W)


def test_unit_a_spent_budget_states_the_seconds(make_scene):
    """Unit: the sentence of a run that gives up says after how long."""
    with pytest.raises(rbdyn.RunError) as gave_up:
        simulate(make_scene("numerics.step_budget_per_turn=100"), workers=1)
    assert re.search(r"step budget of \d+ used up after [\d.e-]+ s of running", str(gave_up.value))


def test_unit_the_bar_shows_the_time_left_of_runs_longer_than_half_a_minute(monkeypatch):
    """Unit: the bar of a terminal, on a clock that goes a minute a run."""

    class Screen(io.StringIO):
        def isatty(self) -> bool:
            return True

    now, screen = [0.0], Screen()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("rich.console.monotonic", lambda: now[0])
    with progress_bar("simulating", quiet=False) as progress:
        for done in range(4):
            now[0] = 60.0 * done
            progress(done, 10)
    assert "3/10" in screen.getvalue() and "0:07:00" in screen.getvalue()
