"""Integrators beside each other: orders of the fixed steps, agreement, errors, failures, times at equal error."""

import importlib.util
import itertools
import sys
from dataclasses import replace

import method_bias
import numpy as np
import pytest

from rbdyn import accuracy
from rbdyn.accuracy import methods
from rbdyn.accuracy import methods as comparison
from rbdyn.accuracy.fixed_step import BudgetSpent, RightHandSide, runge_kutta_4, steps_of, velocity_of
from rbdyn.accuracy.methods import (
    METHODS,
    OURS,
    RUNGE_KUTTA_4,
    SCIPY_RK45,
    VELOCITY_VERLET,
    Error,
    Method,
    Reference,
    attempt,
    attempts_of,
    curve,
    difference,
    end_of,
    fixed_step,
    front,
    reference,
    starts_after_transient,
    times_faster,
)
from rbdyn.base.faults import InputError, RunError
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.integrators.advance import empty_tally
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.run import Run

CVODE = [method for method in METHODS if method.name.startswith("CVODE")]


@pytest.fixture(scope="module")
def stretches(outer):
    """Two settled quarters of a turn."""
    return starts_after_transient(outer, 0.25, 2)


@pytest.fixture(scope="module")
def known(stretches):
    """Their ends."""
    return reference(stretches)


@pytest.fixture(scope="module")
def smooth(outer, stretches):
    """A fiftieth of a turn from the seated start: no contact opens or closes, so that methods show their order."""
    start = Run(outer, stretches[0].bearing, 0, 1e-2, Stop()).carry.y.copy()
    return replace(stretches[0], start=start, turns=0.02)


@pytest.fixture(scope="module")
def smooth_end(smooth):
    """Where it ends."""
    return Reference([end_of(OURS, smooth, 1e-13)], {1.0: Error(1e-16, 1e-10)})


@pytest.mark.parametrize(("method", "order"), [(RUNGE_KUTTA_4, 4.0), (VELOCITY_VERLET, 2.0)])
def test_rate_fixed_steps(smooth, smooth_end, method, order):
    """Rate: halving the step divides the error by 2 to the order."""
    contact_time = fixed_step(smooth.scene, 1.0)
    errors = [
        difference(smooth, end_of(method, smooth, smooth.duration / steps / contact_time), smooth_end.ends[0])
        for steps in (64, 128, 256)
    ]
    for coarse, fine in itertools.pairwise(errors):
        assert np.log2(coarse.scaled / fine.scaled) == pytest.approx(order, abs=0.12)
        assert np.log2(coarse.position_m / fine.position_m) == pytest.approx(order, abs=0.3)


def test_unit_velocities_belong_to_their_positions(everything, evaluate, random_state):
    """Unit: the derivative of each position is the state component named as its velocity; nothing else has one."""
    y = random_state(everything, 3)
    dy, pairs = evaluate(roller_bearing(everything), y).dy, velocity_of(layout_of(everything))
    has = pairs >= 0
    assert np.array_equal(dy[has], y[pairs[has]])
    assert has.sum() == 2 * everything.bearing.rollers + 3 + 2 + 2


def test_unit_right_hand_side(outer, evaluate, random_state):
    """Unit: callable from Python, bit for bit the tested one, also on a column of a matrix; heeds its budget."""
    bearing, y = roller_bearing(outer), random_state(outer, 1)
    function = RightHandSide(bearing, y.size, 2)
    expected = evaluate(bearing, y).dy
    assert np.array_equal(function(0.0, y), expected)
    assert np.array_equal(function(0.0, np.column_stack((y, -y, y))[:, 0]), expected)
    with pytest.raises(BudgetSpent):
        function(0.0, y)
    with pytest.raises(ValueError, match="59 components, not 60"):
        function(0.0, y[:-1])


def test_oracle_two_methods_agree(known):
    """Oracle: our method and DOP853 end within 10 pm after a quarter turn and 1 nm after a whole one."""
    assert known.agreement[0.25].position_m < 1e-11
    assert known.agreement[1.0].position_m < 1e-9
    assert known.floor(0.25) == 10.0 * known.agreement[0.25].position_m
    assert known.floor(0.3) == 10.0 * known.agreement[0.5].position_m


def test_rate_trajectory_error_falls_with_rtol(stretches, known):
    """Rate: three decades of tolerance are worth at least one of error and cost right-hand sides."""
    found = [attempt(OURS, rtol, stretches, known) for rtol in (1e-2, 1e-5, 1e-8)]
    assert [a.status for a in found] == ["ok"] * 3 and found[0].setting == "rtol 0.01"
    for loose, tight in itertools.pairwise(found):
        assert tight.position_error_m < 0.1 * loose.position_error_m
        assert tight.scaled_error < 0.1 * loose.scaled_error
        assert tight.rhs_per_turn > loose.rhs_per_turn


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_oracle_every_method_reaches_the_same_end(smooth, smooth_end, method):
    """Oracle: all integrators, tight enough, end where ours does."""
    found = attempt(method, 1e-6 if method.adaptive else 0.01, [smooth], smooth_end)
    assert found.status == "ok" and found.scaled_error < 1e-3
    assert found.rhs_per_turn > 0.0 and found.turn_ms > 0.0


def test_unit_failures_stay_in_the_table(smooth, smooth_end, stretches, known):
    """Unit: a step past the limit of stability is a row that says so, and no point of the curve."""
    explosive = RUNGE_KUTTA_4._replace(settings=(8.0, 0.5))
    bad, good = attempts_of(explosive, stretches, known)
    assert bad.status.startswith("failed: not finite after") and bad.position_error_m is None
    assert good.status == "ok"
    assert curve([bad, good], bad.method, 0.0) == [(good.position_error_m, good.turn_ms)]
    assert curve([bad, good], bad.method, 1.0) == []
    told = " ".join(comparison.conclusion([bad, good], {}, 1e-12, 0.25))
    assert "Settings that failed: 1 of RK4, fixed step." in told


def test_unit_fixed_step_stops_where_it_ceases_to_be_finite(stretches):
    """Unit: the steps done are returned; a state of NaN does none."""
    y = np.full_like(stretches[0].start, np.nan)
    tally = empty_tally(10)
    assert runge_kutta_4(stretches[0].bearing, y, 1e-6, 5, scratch(10), tally) == 0
    assert steps_of(1.0, 0.3) == 4 and steps_of(1.0, 0.25) == 4 and steps_of(1.0, 5.0) == 1


def test_unit_budget(smooth, smooth_end, monkeypatch):
    """Unit: a method that asks for too many right-hand sides fails in words, in C code as well."""
    monkeypatch.setattr(methods, "BUDGET_PER_TURN", 500)
    tried = [SCIPY_RK45]
    if importlib.util.find_spec("sksundae"):
        tried += CVODE[:1]
    for method in tried:
        found = attempt(method, 1e-8, [smooth], smooth_end)
        assert found.status == "failed: over 500 right-hand sides a turn"
    with pytest.raises(RunError, match="step budget"):
        end_of(OURS, smooth, 1e-12)


def test_unit_missing_cvode_is_a_row(smooth, smooth_end, monkeypatch):
    """Unit: without its package CVODE is one row that tells how to get it."""
    monkeypatch.setitem(sys.modules, "sksundae", None)
    monkeypatch.setitem(sys.modules, "sksundae.cvode", None)
    for method in CVODE:
        (row,) = attempts_of(method, [smooth], smooth_end)
        assert row.status == "not installed: pip install 'rbdyn[bench]'"
        assert row.turn_ms is None


def test_unit_times_faster():
    """Unit: power laws are exact in the logarithm; only errors that both reach count; beaten points do not."""
    ours = [(10.0**-k, 10.0 ** (0.2 * k)) for k in range(2, 9)]
    theirs = [(10.0**-k, 7.0 * 10.0 ** (0.2 * k)) for k in range(4, 12)]
    ratio = times_faster(ours, [*theirs, (1e-5, 1e9)])
    assert (ratio.mean, ratio.least, ratio.greatest) == pytest.approx((7.0, 7.0, 7.0))
    assert (ratio.low, ratio.high) == (1e-8, 1e-4)
    steeper = [(10.0**-k, 10.0 ** (0.5 * k)) for k in range(2, 9)]
    ratio = times_faster(ours, steeper)
    assert ratio.least == pytest.approx(10.0**0.6) and ratio.greatest == pytest.approx(10.0**2.4)
    assert ratio.mean == pytest.approx(10.0**1.5)
    assert front([(1e-3, 1.0), (1e-4, 2.0), (1e-5, 1.5)]) == [(1e-5, 1.5), (1e-3, 1.0)]
    assert times_faster(ours, [(1e-1, 1.0)]) is None and times_faster(ours, []) is None


def test_unit_study_of_methods(outer, tmp_path):
    """Unit: record, sheet and picture with two methods at two settings each."""
    few = [
        Method(method.name, method.adaptive, settings, method.ready)
        for method, settings in ((OURS, (1e-1, 1e-6)), (SCIPY_RK45, (1e-1, 1e-5)))
    ]
    steps = []
    report = comparison.study(outer, lambda done, total: steps.append((done, total)), 0.04, few)
    assert accuracy.write(report, tmp_path) == ["methods.json", "methods.csv", "methods.png"]
    record = report.record
    assert [row["status"] for row in record["rows"]] == ["ok"] * 4 and record["format"] == "rbdyn.methods/1"
    assert set(record["times_faster"]) == {"SciPy RK45"}
    assert steps[-1] == (7, 7)
    with pytest.raises(InputError, match="turns = 2"):
        comparison.study(outer, turns=2.0)


def test_oracle_statistics_of_other_methods(outer):
    """Oracle: with fine steps both fixed-step methods close the power balance and lose our power; coarse ones do not."""
    rows = {
        (row.method, row.setting): row
        for row in method_bias.bias_rows(outer, ((RUNGE_KUTTA_4, (8.0, 0.25)), (VELOCITY_VERLET, (1.0, 0.0625))))
    }
    exploded, fine_rk4, coarse, fine = rows.values()
    assert exploded.status.startswith("failed: not finite") and exploded.found is None
    assert fine_rk4.power_gap < 1e-4
    assert fine.power_gap < 2e-3 and fine.power_gap < 0.1 * coarse.power_gap
    for row in (fine_rk4, fine):
        power = "power_loss_W"
        assert abs(row.found.bias[power]) < row.found.bias_error[power] + 0.005
        assert row.turn_ms > 0.0
