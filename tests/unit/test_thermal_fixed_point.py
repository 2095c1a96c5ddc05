"""Temperatures that their own heat keeps up: fixed points of known systems, gains, and verdicts where there is no steady state."""

import math

import numpy as np
import pytest

from rbdyn.base.faults import InputError
from rbdyn.properties.materials import oil_at
from rbdyn.thermal.fixed_point import MOST_STATES, State, learned, model_of, next_step, steady_state
from rbdyn.thermal.losses import HeatModel, Losses, film_powers, gain, log_viscosity, no_residue
from rbdyn.thermal.network import Boundaries, Conductances, carried_off, matrix, source, temperatures

USUAL = Conductances(30.0, 8.0, 5.0, 12.0, 18.0, 11.0, 7.0, 4.0)
BOUNDARIES = Boundaries(inlet=60.0, ambient=20.0)
COLD = np.full(4, 60.0)
HEAT = np.array([900.0, 360.0, 240.0, 480.0])


VISCOSITY = log_viscosity(lambda degrees: oil_at("MIL-L-7808", degrees))


def _model(state, powers, exponent=0.0, network=USUAL, boundaries=BOUNDARIES):
    """Model of a balance whose nodes each have one loss, with the viscosity at their own temperature."""
    losses = Losses(np.asarray(state), np.asarray(powers), np.full(4, exponent), np.eye(4), VISCOSITY)
    return HeatModel(losses, np.eye(4), network, boundaries, no_residue())


def _state(state, heat, noise=0.0, network=USUAL, boundaries=BOUNDARIES):
    image = temperatures(network, boundaries, heat)
    return State(state, image, np.full(4, noise), _model(state, heat, 0.0, network, boundaries))


def _balance(heat_of, noise=0.0, network=USUAL):
    """Map of a network whose heat [W] follows the temperatures, with its calls."""
    calls = []

    def balance(state):
        calls.append(state)
        return _state(state, heat_of(state), noise, network)

    return balance, calls


def _as_estimated(state, model):
    return model.image_slopes(state.temperatures), 0.0


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

    def model(states):
        return states[-1].model._replace(residue=heat_slopes)

    search = steady_state(balance, COLD + 25.0, COLD, _as_estimated, model, tolerance=1e-9)
    assert search.status == "steady" and len(calls) == 2
    exact = np.linalg.solve(matrix(USUAL) - heat_slopes, HEAT - heat_slopes @ COLD + source(USUAL, BOUNDARIES))
    assert search.last.temperatures == pytest.approx(exact, abs=1e-9)
    heat = HEAT + heat_slopes @ (search.last.temperatures - COLD)
    assert sum(carried_off(USUAL, BOUNDARIES, search.last.image).values()) == pytest.approx(heat.sum(), rel=1e-12)


@pytest.mark.parametrize("start", [20.0, 60.0, 150.0, 300.0])
def test_unit_viscous_heat_converges_from_anywhere(start):
    """Unit: heat that halves with every 15 K of the oil, steep enough that plain iteration diverges: one state, from any start."""
    balance, calls = _balance(lambda state: 2.0 * HEAT * 2.0 ** (-(state[0] - 60.0) / 15.0))
    search = steady_state(balance, np.full(4, start), COLD, _as_estimated, tolerance=0.01)
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
        exact = _state(state, HEAT, 2.0)
        return exact._replace(image=exact.image + generator.normal(scale=0.5, size=4))

    search = steady_state(balance, COLD, COLD, _as_estimated)
    assert search.status == "steady" and len(search.states) <= 3
    assert search.last.temperatures == pytest.approx(temperatures(USUAL, BOUNDARIES, HEAT), abs=3.0)


def test_unit_runaway_has_no_steady_state():
    """Unit: heat that doubles with every 10 K of the inner ring outruns the network; the verdict has its path. Slopes whose gain
    is one only within their error do not show that."""
    balance, _ = _balance(lambda state: HEAT * 2.0 ** ((state[2] - 60.0) / 10.0))
    search = steady_state(balance, COLD, COLD, _as_estimated)
    assert search.status == "no steady state" and "thermal loop gain" in search.reason
    unsure = steady_state(balance, COLD, COLD, lambda *near: (_as_estimated(*near)[0], math.inf))
    assert unsure.status == "too hot" and "beyond 350 C" in unsure.reason
    inner = [state.temperatures[2] for state in search.states]
    assert len(inner) > 2 and inner == sorted(inner)
    assert gain(search.slopes) > 1.0


def test_unit_weak_lost_clearance_is_steady():
    """Unit: the same growth over 200 K stays below a gain of one and converges."""
    balance, _ = _balance(lambda state: HEAT * 2.0 ** ((state[2] - 60.0) / 200.0))
    search = steady_state(balance, COLD, COLD, _as_estimated, tolerance=1e-6)
    assert search.status == "steady" and 0.0 < gain(search.slopes) < 1.0


def _seizing(limit, heat):
    def balance(state):
        if state[3] > limit:
            raise InputError([f"cage.guide_clearance_mm: the cage seizes above {limit:g} C"])
        return _state(state, heat)

    return balance


def test_unit_seizure_on_the_way_is_a_verdict():
    """Unit: a cage that seizes below the temperature of balance: seizure with its sentence, and the last possible state."""
    search = steady_state(_seizing(72.0, HEAT), COLD, COLD, _as_estimated)
    assert search.status == "seizure" and "the cage seizes" in search.reason
    assert 70.0 < search.last.temperatures[3] <= 72.0


def test_unit_a_start_that_seizes_moves_towards_the_cold_state():
    """Unit: a first guess that is too hot for the cage is no seizure if the balance is cooler."""
    balance_c = temperatures(USUAL, BOUNDARIES, HEAT)[3]
    search = steady_state(_seizing(balance_c + 1.0, HEAT), np.full(4, 200.0), COLD, _as_estimated)
    assert search.status == "steady"


def test_unit_a_bearing_that_is_impossible_when_cold_is_bad_input():
    """Unit: seizure at the temperature of the surroundings is a fault of the drawing."""
    with pytest.raises(InputError, match="the cage seizes"):
        steady_state(_seizing(50.0, HEAT), COLD, COLD, _as_estimated)


def test_unit_steps_are_bounded_and_turn_back_by_half():
    """Unit: no node moves by more than 40 K, a step that turns back is at most half as long, and unstable slopes turn no step round."""
    state = _state(COLD, 4.0 * HEAT)
    onward = next_step(state.model, state, None)
    assert np.abs(onward).max() == pytest.approx(40.0) and onward.min() > 0.0
    back = next_step(state.model, state, np.full(4, -10.0))
    assert np.abs(back).max() == pytest.approx(5.0) and back == pytest.approx(onward / 8.0)
    unstable = state.model._replace(residue=3.0 * matrix(USUAL))
    assert next_step(unstable, state, None) == pytest.approx(onward)


def test_unit_a_swinging_search_is_undecided():
    """Unit: heat without a balance, that jumps where the search comes near, ends undecided: a search at its limit shows no gain."""
    balance, calls = _balance(lambda state: HEAT * (3.0 if state[0] < 90.0 else 0.2))
    search = steady_state(balance, COLD, COLD, _as_estimated)
    assert search.status == "undecided" and "did not settle" in search.reason and len(calls) == MOST_STATES
    vague = steady_state(_balance(lambda state: HEAT, noise=300.0)[0], COLD, COLD, _as_estimated)
    assert vague.status == "undecided" and "open by 3e+02 K" in vague.reason


@pytest.mark.parametrize("ambient", [-60.0, 0.0, 90.0])
@pytest.mark.parametrize("cold", [-60.0, 20.0, 300.0])
def test_unit_the_model_of_viscous_heat_has_one_solution(ambient, cold):
    """Unit: from any state the model balances to 1e-6 W at one state that is not colder than the coldest surroundings; a plain
    bisection of one node finds the same."""
    boundaries = Boundaries(ambient, ambient)
    reference = _model(np.full(4, 60.0), HEAT, 0.7, boundaries=boundaries)
    powers = reference.losses.at(np.full(4, cold))
    found = _model(np.full(4, cold), powers, 0.7, boundaries=boundaries).balanced()
    assert found == pytest.approx(reference.balanced(), abs=1e-6) and found.min() > ambient
    assert np.abs(reference.excess(found)).max() < 1e-6
    single = Conductances(30.0, 1e9, 1e9, 1e9, 1e9, 1e9, 7.0, 4.0)
    lumped = _model(np.full(4, 60.0), HEAT, 0.7, single, boundaries)
    low, high = ambient, 350.0
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        heat = lumped.losses.at(np.full(4, middle)).sum()
        low, high = (middle, high) if heat > 41.0 * (middle - ambient) else (low, middle)
    assert lumped.balanced() == pytest.approx(np.full(4, low), abs=1e-3)


def test_unit_many_models_balance_as_each_alone():
    """Unit: models about one state with their own conductances, powers and shares balance at once where each does alone, also those
    that run away, and have its verdict."""
    draw = np.random.default_rng(3)
    model = _model(np.full(4, 60.0), HEAT, 0.7).with_image_slopes(np.diag([0.3, 0.1, 0.2, 0.4]))
    flow, powers = 10.0 ** draw.uniform(-1.0, 0.5, 64), draw.uniform(0.1, 1.0, (64, 4))
    shares = draw.dirichlet(np.full(4, 0.3), (64, 4))
    many = model.varied({"flow": flow, "outer_ambient": flow}, powers, shares)
    nodes = many.balanced()
    stable = many.is_stable(nodes)
    assert 5 < stable.sum() < 60
    for place in range(len(flow)):
        each = model.varied({"flow": flow[place], "outer_ambient": flow[place]}, powers[place], shares[place])
        alone = each.balanced()
        assert nodes[place] == pytest.approx(alone, abs=1e-7) and stable[place] == each.is_stable(alone)
        assert many.coldest[place] == each.coldest


def test_unit_slopes_of_the_model():
    """Unit: slopes of the heat are its differences, and the rest makes those of the image what they are told to be."""
    model = _model(np.full(4, 60.0), HEAT, 0.7)
    nodes = np.array([31.5, 60.5, 95.5, 120.5])
    differences = (
        np.transpose([model.heat(nodes + 0.01 * one) - model.heat(nodes - 0.01 * one) for one in np.eye(4)]) / 0.02
    )
    assert model.heat_slopes(nodes) == pytest.approx(differences, rel=1e-6)
    told = np.random.default_rng(2).normal(scale=0.2, size=(4, 4))
    assert model.with_image_slopes(told).image_slopes(np.full(4, 60.0)) == pytest.approx(told)


def test_unit_states_teach_exponents_and_what_else_moves_heat():
    """Unit: two states whose films follow another power of the viscosity give it back, and a linear rest along their step."""
    warm, cold = (_model(np.full(4, degrees), np.ones(4), 0.7) for degrees in (60.0, 30.0))
    truth = warm.losses._replace(powers=HEAT, exponents=np.full(4, 0.4))
    seen = cold.losses._replace(powers=truth.at(np.full(4, 30.0)))
    assert film_powers(warm.losses._replace(powers=HEAT), seen, 0.2, 0.01) == pytest.approx(np.full(4, 0.4))
    assert film_powers(warm.losses._replace(powers=HEAT), seen, 5.0, 0.01) == pytest.approx(np.full(4, 0.7))
    states = [_state(np.full(4, 60.0), HEAT), _state(np.full(4, 80.0), HEAT + 100.0)]
    assert model_of(states).residue @ np.ones(4) == pytest.approx(np.full(4, 5.0))
