"""Temperatures that their own heat keeps up: fixed points of known systems, gains, and verdicts where there is no steady state."""

import math

import numpy as np
import pytest

from rbdyn.base.faults import InputError
from rbdyn.thermal.fixed_point import MOST_STATES, State, gain, learned, newton_step, steady_state
from rbdyn.thermal.network import Boundaries, Conductances, carried_off, matrix, source, temperatures

USUAL = Conductances(30.0, 8.0, 5.0, 12.0, 18.0, 11.0, 7.0, 4.0)
BOUNDARIES = Boundaries(inlet=60.0, ambient=20.0)
COLD = np.full(4, 60.0)
HEAT = np.array([900.0, 360.0, 240.0, 480.0])


def _balance(heat_of, noise=0.0, network=USUAL):
    """Map of a network whose heat [W] follows the temperatures, with its calls."""
    calls = []

    def balance(state):
        calls.append(state)
        image = temperatures(network, BOUNDARIES, heat_of(state))
        return State(state, image, np.full(4, noise))

    return balance, calls


def _flat(state):
    return np.zeros((4, 4))


@pytest.mark.parametrize("slope", [-3.0, 0.5, 2.0])
def test_unit_gain_of_one_mode(slope):
    """Unit: heat of one node that follows its own temperature: the gain is the slope times that node's response to heat."""
    slopes = np.zeros((4, 4))
    slopes[2, 2] = slope
    known = slope * np.linalg.inv(matrix(USUAL))[2, 2]
    assert gain(np.linalg.solve(matrix(USUAL), slopes)) == pytest.approx(max(known, 0.0), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("factor", "steady"), [(-5.0, True), (0.99, True), (1.0 + 1e-6, False), (3.0, False)])
def test_unit_gain_decides_whether_transients_grow(factor, steady):
    """Unit: heat slopes of ``factor`` times G have that gain; beyond 1 the nodes run away whatever their heat capacities."""
    whole = matrix(USUAL)
    assert gain(np.linalg.solve(whole, factor * whole)) == pytest.approx(factor, rel=1e-10)
    for capacities in ([1.0, 1.0, 1.0, 1.0], [5.0, 2000.0, 15.0, 40.0]):
        rates = np.linalg.eigvals((factor - 1.0) * whole / np.array(capacities)[:, None])
        assert bool(rates.real.max() < 0.0) is steady


def test_unit_slopes_learn_what_was_measured_and_change_least():
    """Unit: learned slopes give the measured changes, change nothing along other directions, and are exact from four."""
    generator = np.random.default_rng(3)
    truth, estimate = generator.normal(size=(4, 4)), generator.normal(size=(4, 4))
    steps = generator.normal(size=(2, 4))
    slopes = learned(estimate, steps, steps @ truth.T)
    assert slopes @ steps.T == pytest.approx(truth @ steps.T)
    across = np.linalg.svd(steps)[2][2:]
    assert slopes @ across.T == pytest.approx(estimate @ across.T)
    whole = generator.normal(size=(4, 4))
    assert learned(estimate, whole, whole @ truth.T) == pytest.approx(truth)


def test_unit_linear_heat_needs_one_step_with_its_slopes():
    """Unit: heat that is linear in the temperatures, with the right slopes: two states, and energy in is energy out."""
    generator = np.random.default_rng(5)
    heat_slopes = generator.normal(scale=2.0, size=(4, 4))
    balance, calls = _balance(lambda state: HEAT + heat_slopes @ (state - COLD))
    slopes = np.linalg.solve(matrix(USUAL), heat_slopes)
    search = steady_state(balance, COLD + 25.0, lambda _: slopes, COLD, tolerance=1e-9)
    assert search.status == "steady" and len(calls) == 2
    exact = np.linalg.solve(matrix(USUAL) - heat_slopes, HEAT - heat_slopes @ COLD + source(USUAL, BOUNDARIES))
    assert search.last.temperatures == pytest.approx(exact, abs=1e-9)
    heat = HEAT + heat_slopes @ (search.last.temperatures - COLD)
    assert sum(carried_off(USUAL, BOUNDARIES, search.last.image).values()) == pytest.approx(heat.sum(), rel=1e-12)


@pytest.mark.parametrize("start", [20.0, 60.0, 150.0, 300.0])
def test_unit_viscous_heat_converges_from_anywhere(start):
    """Unit: heat that halves with every 15 K of the oil, steep enough that plain iteration diverges: one state, from any start."""
    balance, calls = _balance(lambda state: 2.0 * HEAT * 2.0 ** (-(state[0] - 60.0) / 15.0))
    search = steady_state(balance, np.full(4, start), _flat, COLD, tolerance=0.01)
    assert search.status == "steady" and len(calls) <= MOST_STATES
    assert np.abs(search.last.deviation).max() < 0.01
    reference = search.last.temperatures
    oil = 60.0
    for _ in range(200):  # halved steps of the plain iteration, as an oracle
        oil += 0.2 * (balance(np.full(4, oil)).image[0] - oil)
    assert reference[0] == pytest.approx(oil, abs=0.1)


def test_unit_noise_ends_the_search():
    """Unit: with noise of 2 K the search ends within that of the steady state, not at the tolerance."""
    generator = np.random.default_rng(7)

    def balance(state):
        image = temperatures(USUAL, BOUNDARIES, HEAT) + generator.normal(scale=0.5, size=4)
        return State(state, image, np.full(4, 2.0))

    search = steady_state(balance, COLD, _flat, COLD)
    assert search.status == "steady" and len(search.states) <= 3
    assert search.last.temperatures == pytest.approx(temperatures(USUAL, BOUNDARIES, HEAT), abs=3.0)


def test_unit_runaway_has_no_steady_state():
    """Unit: heat that doubles with every 10 K of the inner ring outruns the network; the verdict has its path."""
    balance, _ = _balance(lambda state: HEAT * 2.0 ** ((state[2] - 60.0) / 10.0))
    search = steady_state(balance, COLD, _flat, COLD)
    assert search.status == "no steady state" and search.reason
    inner = [state.temperatures[2] for state in search.states]
    assert len(inner) > 2 and inner == sorted(inner)
    assert gain(search.slopes) > 1.0


def test_unit_weak_lost_clearance_is_steady():
    """Unit: the same growth over 200 K stays below a gain of one and converges."""
    balance, _ = _balance(lambda state: HEAT * 2.0 ** ((state[2] - 60.0) / 200.0))
    search = steady_state(balance, COLD, _flat, COLD, tolerance=1e-6)
    assert search.status == "steady" and 0.0 < gain(search.slopes) < 1.0


def _seizing(limit, heat):
    def balance(state):
        if state[3] > limit:
            raise InputError([f"cage.guide_clearance_mm: the cage seizes above {limit:g} C"])
        return State(state, temperatures(USUAL, BOUNDARIES, heat), np.zeros(4))

    return balance


def test_unit_seizure_on_the_way_is_a_verdict():
    """Unit: a cage that seizes below the temperature of balance: seizure with its sentence, and the last possible state."""
    search = steady_state(_seizing(72.0, HEAT), COLD, _flat, COLD)
    assert search.status == "seizure" and "the cage seizes" in search.reason
    assert 70.0 < search.last.temperatures[3] <= 72.0


def test_unit_a_start_that_seizes_moves_towards_the_cold_state():
    """Unit: a first guess that is too hot for the cage is no seizure if the balance is cooler."""
    balance_c = temperatures(USUAL, BOUNDARIES, HEAT)[3]
    search = steady_state(_seizing(balance_c + 1.0, HEAT), np.full(4, 200.0), _flat, COLD)
    assert search.status == "steady"


def test_unit_a_bearing_that_is_impossible_when_cold_is_bad_input():
    """Unit: seizure at the temperature of the surroundings is a fault of the drawing."""
    with pytest.raises(InputError, match="the cage seizes"):
        steady_state(_seizing(50.0, HEAT), COLD, _flat, COLD)


def test_unit_steps_are_bounded_and_follow_the_deviation_where_slopes_are_unstable():
    """Unit: no node moves by more than 40 K at once, and unstable slopes do not turn the step round."""
    assert newton_step(np.zeros((4, 4)), np.array([400.0, 0.0, 0.0, 0.0])).max() == pytest.approx(40.0)
    step = newton_step(3.0 * np.eye(4), np.ones(4))
    assert step == pytest.approx(np.ones(4)) and math.isfinite(step.sum())
