"""Time of long runs: stated early, once, with what shortens them; short runs say nothing, and no figure depends on it."""

import logging
import re

import pytest

import rbdyn
from rbdyn.dynamics import pace
from rbdyn.dynamics.pace import Pace, duration
from rbdyn.dynamics.simulate import simulate

QUICK = ("numerics.turns=4", "numerics.discard_turns=1", "numerics.replicates=2")


def sentences(scene, looks, runs=10, turns=120.0, threads=2, growth=1.0):
    """What is stated at looks (seconds, shaft turns, steps, budget of steps)."""
    stated = []
    watched = Pace(scene, stated.append, runs, turns, threads, growth)
    for look in looks:
        watched.look(*look)
    return stated


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.0123, "0.012 s"),
        (2.34, "2.3 s"),
        (119.0, "120 s"),
        (150.0, "2.5 min"),
        (1440.0, "24 min"),
        (9000.0, "2.5 h"),
        (1e6, "12 days"),
    ],
)
def test_unit_a_duration_has_two_digits_and_the_unit_that_suits_it(seconds, words):
    """Unit: seconds, minutes, hours and days."""
    assert duration(seconds) == words


def test_unit_long_runs_state_their_time_and_what_shortens_it(make_scene):
    """Unit: ten runs of 120 turns at 2.4 s a turn, two at once, are 24 min."""
    scene = make_scene("bearing.roller_profile=logarithmic")
    (sentence,) = sentences(scene, [(12.0, 5.0, 10_000, 10**7)], growth=8.0)
    assert sentence == (
        "all runs take about 24 min at this pace: 10 runs of 120 shaft turns at 2.4 s each, 2 at once, up to 8 times that where "
        "figures drift; reduce model.slices, numerics.turns or numerics.replicates to shorten it"
    )


def test_unit_a_budget_states_the_time_that_it_stands_for(make_scene):
    """Unit: where steps run out before the turns do, the sentence says when, with the key."""
    (sentence,) = sentences(make_scene(), [(12.0, 0.001, 10_000, 1_000_000)])
    assert (
        "runs will use up their budget of steps after about 20 min (numerics.step_budget_per_turn = 100000)" in sentence
    )


def test_unit_short_runs_say_nothing(make_scene):
    """Unit: nothing in the first seconds, nothing where all take less than some minutes, nothing where nobody asks."""
    scene = make_scene()
    assert sentences(scene, [(9.0, 0.1, 10_000, 10**9)]) == []
    assert sentences(scene, [(12.0, 30.0, 10_000, 10**9)]) == []
    assert sentences(scene, [(12.0, 0.0, 10_000, 10**9)]) == []
    Pace(scene, None, 10, 120.0, 2).look(12.0, 0.001, 10_000, 10**9)


def test_unit_the_time_is_stated_again_where_it_doubles(make_scene):
    """Unit: a look at every doubling of the time; a second sentence where the estimate has doubled, none where it has not."""
    steady = [(10.0 * 2.0**n, 2.0**n, 10_000 * 2**n, 10**9) for n in range(6)]
    assert len(sentences(make_scene(), steady)) == 1
    slower = [
        (10.0, 2.0, 10_000, 10**9),
        (15.0, 2.1, 15_000, 10**9),
        (20.0, 2.2, 20_000, 10**9),
        (40.0, 2.3, 40_000, 10**9),
    ]
    assert len(sentences(make_scene(), slower)) == 2


def test_invariant_a_statement_changes_no_figure(make_scene, monkeypatch, caplog):
    """Invariant: stated or not, by default as a warning of the logger "rbdyn", a simulation has the same bits."""
    scene, stated = make_scene(*QUICK), []
    plain = simulate(scene, notice=stated.append)
    assert stated == []
    monkeypatch.setattr(pace, "FIRST_LOOK_S", 0.0)
    monkeypatch.setattr(pace, "LONG_S", 0.0)
    with caplog.at_level(logging.WARNING, "rbdyn"):
        again = simulate(scene)
    assert "all runs take about" in caplog.messages[0] and {each.name for each in caplog.records} == {"rbdyn"}
    assert (again.impact_force, again.power_loss) == (plain.impact_force, plain.power_loss)


def test_unit_a_spent_budget_states_the_seconds(make_scene):
    """Unit: the sentence of a run that gives up says after how long."""
    with pytest.raises(rbdyn.RunError) as gave_up:
        simulate(make_scene("numerics.step_budget_per_turn=100"), workers=1)
    assert re.search(r"step budget of \d+ used up after [\d.e-]+ s of running", str(gave_up.value))
