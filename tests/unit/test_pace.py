"""Time of the runs of a scene: stated early, once, with what shortens it; no figure depends on it."""

import logging
import re

import pytest

import rbdyn
from rbdyn.base import forecast
from rbdyn.dynamics import ensemble
from rbdyn.dynamics.ensemble import Pace
from rbdyn.dynamics.simulate import simulate

QUICK = ("numerics.turns=4", "numerics.discard_turns=1", "numerics.replicates=2")


def watched(scene, looks, runs=10, turns=120.0, threads=2, growth=1.0, **more):
    """A pace and what it states at looks (run, seconds, shaft turns, steps, budget of steps)."""
    stated = []
    one = Pace(scene, stated.append, runs, turns, threads, growth, **more)
    for look in looks:
        one.look(*look)
    return one, stated


def test_unit_what_is_left_is_stated_with_runs_turns_and_time(make_scene):
    """Unit: ten runs of 120 turns at 2.4 s a turn, two at once, take 24 min; 12 s of each are over."""
    looks = [(0, 12.0, 5.0, 10_000, 10**7), (1, 12.0, 5.0, 10_000, 10**7)]
    scene = make_scene("bearing.roller_profile=logarithmic")
    one, (first,) = watched(scene, looks, growth=8.0)
    assert re.fullmatch(
        r"10 runs of 1200 shaft turns in all remain, 2 at once: \d+ to \d+ min, up to [\d.]+ h if figures drift; "
        r"reduce model.slices, numerics.turns or numerics.replicates to shorten it",
        first,
    )
    low, high = one.prediction
    assert low < 24 * 60 < high / 8.0 < 1.5 * 24 * 60


def test_unit_companions_and_rounds_of_runs_count(make_scene):
    """Unit: three runs on two threads are two rounds; a companion is one more, of 0.6 to 1.5 times a run."""
    looks = [(0, 10.0, 10.0, 10_000, 10**7)]
    (plain, _), (more, _) = (watched(make_scene(), looks, 3, 100.0, companions=count) for count in (0, 1))
    assert plain.prediction[0] < 200.0 < plain.prediction[1]
    assert more.prediction[0] / plain.prediction[0] == pytest.approx(1.3, rel=0.02)
    assert more.prediction[1] / plain.prediction[1] == pytest.approx(1.75, rel=0.03)


def test_unit_runs_that_have_ended_are_not_left(make_scene):
    """Unit: of ten runs, of which four have made all their turns, six are left."""
    looks = [(run, 20.0, 120.0, 10_000, 10**7) for run in range(4)]
    one = Pace(make_scene(), (stated := []).append, 10, 120.0, 2)
    one._look_s = 40.0
    for look in looks:
        one.look(*look)
    assert stated[0].startswith("6 runs of 720 shaft turns in all remain")


def test_unit_a_run_that_was_lengthened_leaves_the_others_their_turns(make_scene):
    """Unit: of two runs of 10 turns one was lengthened to 40 at a second a turn; one companion of 10 turns is left after the other."""
    looks = [(0, 40.0, 40.0, 10_000, 10**7)]
    one, stated = watched(make_scene(), looks, 2, 10.0, threads=1, growth=8.0, companions=1)
    assert stated[0].startswith("2 runs of 20 shaft turns in all remain, 1 at once: ")
    # Ten turns of a run, and ten of a companion of 0.6 to 1.5 times the time, after the 40 s.
    assert one.prediction[0] < 40.0 + 16.0 < 40.0 + 25.0 < one.prediction[1]


def test_unit_a_budget_states_the_time_that_it_stands_for(make_scene):
    """Unit: where steps run out before the turns do, a sentence says when, with the key."""
    _, stated = watched(make_scene(), [(0, 12.0, 0.001, 10_000, 1_000_000)])
    assert (
        "runs will use up their budget of steps after about 20 min (numerics.step_budget_per_turn = 100000)"
        in stated[-1]
    )


def test_unit_short_runs_say_nothing(make_scene):
    """Unit: nothing in the first moments, nothing where all take less than some seconds, nothing where nobody asks."""
    scene = make_scene()
    assert watched(scene, [(0, 0.9, 0.1, 10_000, 10**9)])[1] == []
    assert watched(scene, [(0, 1.2, 500.0, 10_000, 10**9)])[1] == []
    assert watched(scene, [(0, 12.0, 0.0, 10_000, 10**9)])[1] == []
    silent = Pace(scene, None, 10, 120.0, 2)
    silent.look(0, 12.0, 0.001, 10_000, 10**9)
    assert silent.prediction is None


def test_unit_the_time_is_stated_again_where_it_exceeds_the_most(make_scene):
    """Unit: a steady pace is stated once, one that becomes four times as slow twice; the first prediction stays."""
    steady = [(0, 10.0 * 2.0**n, 2.0**n, 10_000 * 2**n, 10**9) for n in range(6)]
    assert len(watched(make_scene(), steady)[1]) == 1
    slower = [(0, 10.0, 10.0, 10_000, 10**9), (0, 40.0, 12.0, 20_000, 10**9), (0, 90.0, 20.0, 30_000, 10**9)]
    one, stated = watched(make_scene(), slower)
    assert len(stated) == 2 and one.prediction == watched(make_scene(), slower[:1])[0].prediction


def test_invariant_a_statement_changes_no_figure(make_scene, monkeypatch, caplog):
    """Invariant: stated or not, by default as a warning of the logger "rbdyn", a simulation has the same bits; its cost has what
    was predicted."""
    scene, stated = make_scene(*QUICK), []
    monkeypatch.setattr(forecast, "NOTABLE_S", 1e9)
    plain = simulate(scene, notice=stated.append)
    assert stated == [] and "predicted_most_s" not in plain.cost
    monkeypatch.setattr(ensemble, "FIRST_LOOK_S", 0.0)
    monkeypatch.setattr(forecast, "NOTABLE_S", 0.0)
    with caplog.at_level(logging.WARNING, "rbdyn"):
        again = simulate(scene)
    assert "shaft turns in all remain" in caplog.messages[0] and {each.name for each in caplog.records} == {"rbdyn"}
    assert (again.impact_force_N, again.power_loss_W) == (plain.impact_force_N, plain.power_loss_W)
    assert 0.0 < again.cost["predicted_least_s"] <= again.cost["predicted_most_s"]


def test_unit_a_spent_budget_states_the_seconds(make_scene):
    """Unit: the sentence of a run that gives up says after how long."""
    with pytest.raises(rbdyn.RunError) as gave_up:
        simulate(make_scene("numerics.step_budget_per_turn=100"), workers=1)
    assert re.search(r"step budget of \d+ used up after [\d.e-]+ s of running", str(gave_up.value))
