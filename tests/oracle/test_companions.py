"""How companions are chosen: by the steps that the runs took, and what these do to rollers that lie lightly."""

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import UNSAMPLED

from rbdyn.contact.damping import damped_load
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.integrators import rosenbrock, runge_kutta
from rbdyn.dynamics.integrators.advance import ACCEPTED, NOW
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import light_contact
from rbdyn.dynamics.recording import recording_of
from rbdyn.dynamics.simulate import simulate
from rbdyn.dynamics.statistics.metrics import (
    DAMPING_SCALE,
    LEAST_DAMPING,
    MOST_DAMPING,
    NOTABLE_DAMPING,
    Companions,
    companions_of,
    longest_step,
    numerical_damping,
    resolved_damping,
    usual_companions,
)
from rbdyn.dynamics.statistics.replicate import Replicate

SLOW = ("operation.inner_speed_rpm=2000", "operation.radial_load_N=4000")


def amplification(weights, x):
    """|R(i x)| of the pair whose rows of weights these are: its last row makes the new state."""
    stages = len(weights)
    matrix = np.zeros((stages, stages))
    matrix[:, : weights.shape[1]] = weights[:, :stages]
    slopes = np.linalg.solve(np.eye(stages) - 1j * x * matrix, np.ones(stages))
    return abs(1.0 + 1j * x * (matrix[-1] @ slopes))


def test_oracle_damping_of_the_explicit_pair():
    """Oracle: its stability function on the imaginary axis is 1 - x^6/C to leading order."""
    for x in (0.3, 0.2):
        damped = 1.0 - amplification(runge_kutta.WEIGHTS, x)
        assert damped == pytest.approx(x**6 / DAMPING_SCALE["rk45"], rel=1.5 * x**2)


def implicit_amplification(x):
    """|R(i x)| of RODAS4: its six stages on y' = i x y from 1 over a step of 1, the last of which joins the new state."""
    a, c = (np.pad(rows, ((0, 0), (0, 1))) for rows in (rosenbrock.A, rosenbrock.C))
    stages = np.linalg.solve((1.0 / rosenbrock.GAMMA - 1j * x) * np.eye(6) - 1j * x * a - c, np.full(6, 1j * x))
    return abs(1.0 + a[-1] @ stages + stages[-1])


def test_oracle_damping_of_the_implicit_method():
    """Oracle: the same of RODAS4 from its stages; beyond the leading order it damps less, so the law is a bound."""
    for x in (0.3, 0.2):
        assert 1.0 - implicit_amplification(x) == pytest.approx(x**6 / DAMPING_SCALE["rosenbrock"], rel=1.5 * x**2)
    for x in (1.0, 2.0, 5.0):
        assert 0.0 < -math.log(implicit_amplification(x)) < x**6 / DAMPING_SCALE["rosenbrock"]


@pytest.mark.parametrize(
    "law",
    [
        ("model.race_damping_engagement_um=0.01",),
        ("model.race_damping_ratio=0.2",),
        ("model.race_damping=hunt_crossley",),
        ("model.race_damping=off",),
    ],
)
def test_oracle_damping_of_a_light_contact(law, make_scene):
    """Oracle: the damping ratio is c/(2 sqrt(k m)), by differences of the load that the race's own law gives about the approach
    at which it bears the centrifugal force."""
    scene = make_scene(*SLOW, *law, UNSAMPLED)
    light, mass, force = light_contact(scene), scene.geometry.roller_mass, scene.geometry.centrifugal_force
    stiffness = light.frequency**2 * mass
    approach = 10.0 / 9.0 * force / stiffness
    damping = roller_bearing(scene).outer.damping
    rate = 1e-7
    load = [damped_load(damping, force, math.sqrt(stiffness), approach, sign * rate) for sign in (-1.0, 1.0)]
    viscosity = (load[1] - load[0]) / (2.0 * rate)
    assert light.damping == pytest.approx(viscosity / (2.0 * math.sqrt(stiffness * mass)), rel=1e-6, abs=1e-15)
    assert (light.damping > 0.0) == ("off" not in law[0])


def runs_with(scene, step, method="rk45"):
    """Two replicates of a second each that took steps of this length [s]."""
    empty = np.zeros((1, 1))
    blank = Replicate(
        0, 1, np.ones(1), empty, empty, empty, *(np.zeros(1),) * 3, 0.0, round(1.0 / step), 0, 0, 0.0, method
    )
    return [blank, replace(blank)]


def test_unit_companions_follow_the_steps(make_scene, outer):
    """Unit: steps of a slow bearing that damp its light contacts more than the race does ask for companions that do not."""
    slow = make_scene(*SLOW)
    light = light_contact(slow)
    assert light.frequency == pytest.approx(1.69e5, rel=0.01) and light_contact(outer) is None
    for method in DAMPING_SCALE.keys() - {"verlet"}:
        limit = longest_step(light, NOTABLE_DAMPING * light.damping, method)
        assert numerical_damping(light, limit, method) == pytest.approx(NOTABLE_DAMPING * light.damping)
        found = companions_of(slow, runs_with(slow, 1.05 * limit, method))
        assert found.rtol == pytest.approx(1e-3) and found.method == method and found.share == pytest.approx(10.0 / 9.0)
        left = numerical_damping(light, found.longest_step, method)
        assert left == pytest.approx(
            resolved_damping(1.05**5 * NOTABLE_DAMPING * light.damping, light.damping), rel=1e-4
        )
        assert companions_of(slow, runs_with(slow, 0.95 * limit, method)) == usual_companions(slow)
    resolved = Companions(0.01, "verlet", pytest.approx(0.5e-5), 1.0)
    assert companions_of(slow, runs_with(slow, 1e-5, "verlet")) == resolved
    elastic = make_scene(*SLOW, "traction.elasticity=true")
    assert companions_of(elastic, runs_with(elastic, 1e-5, "verlet")) == usual_companions(elastic)
    assert companions_of(outer, runs_with(outer, 1.0)) == usual_companions(outer)
    assert usual_companions(slow).longest_step == math.inf


def test_unit_companions_follow_the_method_that_damps_most(make_scene):
    """Unit: of runs by two methods, that whose steps damp light contacts most is resolved."""
    slow = make_scene(*SLOW)
    light = light_contact(slow)
    long, short = (
        longest_step(light, share * light.damping, "rk45") for share in (2.0 * NOTABLE_DAMPING, 0.1 * NOTABLE_DAMPING)
    )
    runs = [*runs_with(slow, long, "rk45"), *runs_with(slow, short, "rosenbrock")]
    assert companions_of(slow, runs).method == companions_of(slow, runs[::-1]).method == "rk45"
    assert companions_of(slow, runs[2:]) == usual_companions(slow)


def test_unit_slow_bearings_take_even_steps(make_scene, outer):
    """Unit: Verlet takes even steps in a slow bearing that stability or an oil film on its cage limits, and free steps in a fast one."""
    short = ("numerics.turns=0.1", "numerics.discard_turns=0")
    elastic = "traction.elasticity=true"
    for sets in ((), (elastic,), (elastic, "lubricant.temperature_C=-40")):
        scene = make_scene(*SLOW, *short, *sets)
        run = recording_of(scene, roller_bearing(scene), None, 0, None, Stop()).run
        free = run.control.largest_step
        run.to(0.1)
        mean_step = run.carry.clock[NOW] / run.carry.counts[ACCEPTED]
        assert run.control.largest_step < 0.01 * free
        # At the start the coefficients of elastic contacts come up in shorter steps.
        least = 0.7 if elastic in sets else 0.95
        assert least * run.control.largest_step < mean_step <= run.control.largest_step
    fast = outer.model_copy(update={"numerics": outer.numerics.model_copy(update={"turns": 0.1})})
    run = recording_of(fast, roller_bearing(fast), None, 0, None, Stop()).run
    free = run.control.largest_step
    run.to(0.1)
    assert run.control.largest_step == free


def test_unit_undamped_races_ask_for_finite_steps(make_scene):
    """Unit: where no law damps a light contact, companions still have a step."""
    slow = make_scene(*SLOW, "model.race_damping=off")
    light = light_contact(slow)
    found = companions_of(slow, runs_with(slow, 1e-5))
    left = numerical_damping(light, found.longest_step, "rk45")
    assert left == pytest.approx(resolved_damping(MOST_DAMPING, LEAST_DAMPING), rel=1e-4)


@pytest.mark.parametrize("race", [2e-5, 5e-4, 1.9e-2])
def test_unit_companions_leave_a_tenth_of_a_logarithm(race):
    """Unit: by the logarithm of the damping, companions keep a tenth of the bias; what is beyond the law's range adds none."""
    for damping in (NOTABLE_DAMPING * race, MOST_DAMPING, 1.0):
        bias = math.log10(1.0 + min(damping, max(MOST_DAMPING, NOTABLE_DAMPING * race)) / race)
        assert math.log10(1.0 + resolved_damping(damping, race) / race) == pytest.approx(0.1 * bias)


def test_unit_companions_may_take_the_steps_they_need(make_scene):
    """Unit: a budget of steps that replicates keep is no reason for companions of short steps to give up."""
    scene = make_scene(*SLOW, "numerics.step_budget_per_turn=100", "numerics.turns=0.01", "numerics.discard_turns=0")
    plan = usual_companions(scene)._replace(method="rk45", longest_step=1e-3 * scene.turn_s)
    bearing = roller_bearing(scene)
    short, usual = (recording_of(scene, bearing, None, 0, one, Stop()) for one in (plan, None))
    assert short.run.control.step_budget == 2000 and usual.run.control.step_budget == 6 * 100
    assert short.run.control.largest_step == pytest.approx(1e-3 * scene.turn_s)


@pytest.mark.slow
def test_oracle_numerical_error_of_a_slow_bearing(make_scene):
    """Oracle: at 2000 rpm and 4 kN, where stability limits the steps, the stated errors of the loss hold a run at rtol 1e-6, and are
    no blanket.
    """
    length = (
        "numerics.turns=30",
        "numerics.discard_turns=10",
        "numerics.replicates=16",
        "numerics.impact_window_turns=10",
    )
    stated = simulate(make_scene(*SLOW, *length, "numerics.companion=true"))
    truth = simulate(make_scene(*SLOW, *length, "numerics.rtol=1e-6")).power_loss_W
    loss = stated.power_loss_W
    noise = math.hypot(loss.statistical_error, truth.statistical_error)
    assert abs(loss.value - truth.value) < math.hypot(noise, loss.numerical_error)
    assert 0.0 < loss.numerical_error < 0.01 * truth.value and noise < 0.01 * truth.value
