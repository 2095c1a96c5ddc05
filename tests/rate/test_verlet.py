"""Velocity Verlet for bearings: order, dense output, stability, the trapezoidal rule in a contact, power balance, equal figures."""

import json
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import verlet_steps
from hypothesis import given, settings
from hypothesis import strategies as st
from smooth_runs import fixed_step, run_of, vibrating
from test_runge_kutta import orders_of, slope_of

from rbdyn.accuracy.fixed_step import velocity_of
from rbdyn.base.faults import RunError
from rbdyn.contact.tangential import ElasticContact, SteadyTraction, response, staggered
from rbdyn.dynamics.forces.equations import mechanical_energy
from rbdyn.dynamics.integrators import advance as at
from rbdyn.dynamics.integrators import verlet
from rbdyn.dynamics.parameters.state import layout_of
from rbdyn.dynamics.simulate import simulate
from rbdyn.losses import SHAFT

HELPERS = Path(verlet_steps.__file__).parent
VERLET, ELASTIC = "numerics.method=verlet", "traction.elasticity=true"
LONGER = ("numerics.turns=60", "numerics.discard_turns=20", "numerics.replicates=4")


def one_step(run, h):
    """Memory of a run after exactly one step of ``h`` [s]."""
    control = run.control._replace(inverse_tolerance=np.zeros_like(run.control.inverse_tolerance), largest_step=h)
    run.carry.clock[at.STEP] = h
    end = run.carry.clock[at.NOW] + h
    assert at.advance(run.bearing, control, run.carry, run.tally, end, 1.0) == at.FINISHED
    return run.carry


def test_oracle_one_step(outer, evaluate, random_state):
    """Oracle: a first step in numpy, from the formulas of the module."""
    run, h = run_of(outer, 1e-2, "verlet"), 1e-7
    y = random_state(outer, 4)
    run.carry.y[:] = y
    found = one_step(run, h).y
    z, owner = run.bearing.rollers, velocity_of(layout_of(outer))
    place, speed = np.flatnonzero(owner >= 0), owner[owner >= 0]
    square = (h * y[5 * z + 5]) ** 2
    first, middle = evaluate(run.bearing, y).dy, y.copy()
    middle += h * first
    duration = np.where(place < 2 * z, h * (1.0 - square / 6.0), h)
    middle[place] = y[place] + duration * y[speed] + 0.5 * h * h * first[speed]
    expected = y + 0.5 * h * (first + evaluate(run.bearing, middle).dy)
    expected[place] = middle[place]
    assert found == pytest.approx(expected, rel=1e-13, abs=1e-15)


def test_oracle_interpreted():
    """Oracle: the interpreted method takes the same steps, traction coefficients among the states (round-off)."""
    environment = {
        **os.environ,
        "NUMBA_DISABLE_JIT": "1",
        "PYTHONPATH": os.pathsep.join(map(str, (HELPERS.parent, HELPERS))),
    }
    found = subprocess.run(
        [sys.executable, verlet_steps.__file__], env=environment, capture_output=True, text=True, check=True
    )
    assert json.loads(found.stdout) == pytest.approx(verlet_steps.state_after_steps(), rel=1e-10, abs=1e-12)


def test_rate_order_two(conservative):
    """Rate: the error over a smooth stretch falls with the square of the step."""
    for order in orders_of(conservative, "verlet"):
        assert 1.8 < order < 2.4


def test_rate_order_two_of_coefficients(make_scene):
    """Rate: so do the errors of speeds and of traction coefficients that are states, where contacts are damped."""
    scene, duration, steps = make_scene(ELASTIC), 3.2e-5, np.array([3.2e-5 / n for n in (64, 96, 128)])
    reference = fixed_step(scene, duration / 2048, duration, "verlet")
    errors = np.abs([fixed_step(scene, h, duration, "verlet") - reference for h in steps])
    first = layout_of(scene).coefficients
    for kind in (slice(20, 40), slice(first, first + 10)):
        assert slope_of(steps, errors[:, kind].max(axis=1)) > 1.7


def test_rate_dense_output(conservative):
    """Rate: inside a step the cubic keeps the local order three; values at its ends are those of the step."""
    steps, errors = np.array([2e-6, 1.4e-6, 1e-6, 0.7e-6]), []
    method = verlet.Verlet(20)
    for h in steps:
        start = vibrating(conservative, "verlet").carry.y.copy()
        carry = one_step(vibrating(conservative, "verlet"), h)
        k = np.vstack((carry.k[verlet.PAST], carry.k[verlet.END]))
        inside = [
            np.array([at.interpolate(method, start, carry.y, k, h, theta, i) for i in range(start.size)])
            for theta in (0.0, 0.4, 1.0)
        ]
        assert inside[0] == pytest.approx(start, abs=1e-14) and inside[2] == pytest.approx(carry.y, rel=1e-13)
        exact = fixed_step(conservative, 0.4 * h / 64, 0.4 * h, "verlet")
        errors.append(np.abs(inside[1] - exact)[20:40].max())
    assert slope_of(steps, errors) > 2.6


def fastest(run, evaluate):
    """Angular frequency [rad/s] of the fastest vibration of a state."""
    y, n = run.carry.y, run.carry.y.size
    size = 1e-4 / run.control.inverse_tolerance
    columns = [evaluate(run.bearing, y + e).dy - evaluate(run.bearing, y - e).dy for e in np.diag(size)]
    return np.abs(np.linalg.eigvals(np.array(columns).T / (2.0 * size) if n else y)).max()


def test_unit_stable_to_two(conservative, evaluate):
    """Unit: a vibration between the races stays bounded below h omega = 2 and grows above it."""
    run = vibrating(conservative, "verlet")
    omega, reference = fastest(run, evaluate), fixed_step(conservative, 1e-6, 1e-4, "verlet")
    apart = {
        angle: np.abs(fixed_step(conservative, angle / omega, 1e-4, "verlet") - reference)[20:40].max()
        for angle in (1.8, 2.3)
    }
    assert apart[1.8] < 0.1 and apart[2.3] > 0.4


def amplification(h, relaxation, damping, ahead):
    """Growth a step of mu' = s - relaxation mu, s' = -(mu + damping mu') in steps of ``h``, of frequency 1."""

    def step(mu, s, rate, force, force_before):
        predicted = s + h * ((1.0 + ahead) * force - ahead * force_before)
        half = mu + 0.5 * h * rate
        end = (half + 0.5 * h * predicted) / (1.0 + 0.5 * h * relaxation)
        rate = (end - half) / (0.5 * h)
        new = -(end + damping * rate)
        return end, s + 0.5 * h * (force + new), rate, new, force

    return np.abs(np.linalg.eigvals(np.array([step(*start) for start in np.eye(5)]).T)).max()


@pytest.mark.parametrize("ratio", [0.05, 0.1, 0.167])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_unit_slip_against_spring(ratio, share):
    """Unit: the stated limits for damping ratios of loaded contacts, by relaxation or by damping, and without the look ahead."""
    law = (2.0 * ratio * share, 2.0 * ratio * (1.0 - share))
    reach = np.arange(0.02, 2.5, 0.01)
    ahead, plain = (next(h for h in reach if amplification(h, *law, factor) > 1.0 + 1e-9) for factor in (0.5, 0.0))
    assert 1.1 <= ahead < 1.6 and 0.7 < plain < ahead


@settings(max_examples=200, deadline=None)
@given(st.floats(-0.06, 0.06), st.floats(0.0, 3000.0), st.floats(-0.3, 0.3), st.floats(0.0, 1.0), st.floats(1e-9, 2e-6))
def test_unit_trapezoid_in_the_contact(coefficient, load, slip, steepness, half_step):
    """Unit: the coefficient at the end is that of the start and half a step of the rate there, which is the law's at this end,
    but for the bend of the law; the end never lies outside the start and the steady coefficient.
    """
    law, stiffness = ElasticContact(0, 2e-6, 2e-7, 1e-2), 4e8
    steady = 0.05 * np.tanh(slip / 0.02)
    traction = SteadyTraction(steady, steepness * abs(steady))
    found = response(staggered(law, half_step), traction, coefficient, load, slip, stiffness)
    end = coefficient + half_step * found.rate
    rate = response(law, traction, end, load, slip, stiffness).rate
    start = response(law, traction, coefficient, load, slip, stiffness).rate
    assert found.rate == pytest.approx(rate, abs=0.1 * abs(start) + 1e-6)
    low, high = sorted((coefficient, 0.0 if load == 0.0 else steady))
    assert min(low, 0.0) - 1e-12 <= end <= max(high, 0.0) + 1e-12


def test_unit_open_contacts_die_away():
    """Unit: without load the step is the trapezoidal rule of the relaxation, stable in a step of any length."""
    law = ElasticContact(0, 2e-6, 5e-7, 1e-2)
    for half in (1e-7, 1e-6, 1e-3):
        found = response(staggered(law, half), SteadyTraction(0.0, 0.0), 0.03, 0.0, 0.1, 4e8)
        assert found.rate == pytest.approx(-0.03 / (2.5e-6 + half), rel=1e-9)


def test_invariant_power_balance(make_scene):
    """Invariant: shaft work = losses + change of energy, to 0.1 % at the default tolerance, shrinking with it."""
    for options in ((VERLET,), (VERLET, ELASTIC)):
        scene, gaps = make_scene(*options), []
        for rtol in scene.numerics.rtol * np.array([10.0, 1.0, 0.1]):
            run = run_of(scene, rtol, "verlet")
            start = sum(mechanical_energy(run.bearing, run.carry.y))
            run.to(4.0)
            change = sum(mechanical_energy(run.bearing, run.carry.y)) - start
            work = run.tally.work
            gaps.append(abs(work[SHAFT] - work[:SHAFT].sum() - change) / work[SHAFT])
        assert gaps[1] < 0.001
        assert all(tight < 0.5 * loose for loose, tight in pairwise(gaps))


@pytest.mark.parametrize("options", [(), (ELASTIC,)])
def test_oracle_quarter_turn(make_scene, options):
    """Oracle: a quarter turn agrees with Dormand and Prince's pair at a tight tolerance, better at a tighter one."""
    scene, apart = make_scene(*options), []
    exact = run_of(scene, 1e-8, "rk45")
    exact.to(0.25)
    for rtol in (1e-2, 1e-4):
        run = run_of(scene, rtol, "verlet")
        run.to(0.25)
        apart.append(np.abs(run.carry.y - exact.carry.y)[:20].max())
    assert apart[0] < 3e-6 and apart[1] < 0.2 * apart[0]


def test_oracle_everything(everything):
    """Oracle: so it does with every law at once, a support and a schedule among them."""
    exact, run = (run_of(everything, rtol, method) for rtol, method in ((1e-7, "rk45"), (1e-4, "verlet")))
    for each in (exact, run):
        each.to(0.1)
    assert np.abs(run.carry.y - exact.carry.y)[:20].max() < 1e-6


@pytest.fixture(scope="module")
def results(make_scene):
    """The example with tangential elasticity by Dormand and Prince's pair and by this method."""
    return {
        method: simulate(make_scene(*LONGER, ELASTIC, f"numerics.method={method}"), workers=1)
        for method in ("rk45", "verlet")
    }


def test_oracle_statistics_of_the_pair(results):
    """Oracle: figures agree within their errors (1.5 of both together), for fewer right-hand sides."""
    for name in ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_slip"):
        ours, theirs = (getattr(result, name) for result in results.values())
        error = np.hypot(ours.statistical_error, theirs.statistical_error)
        assert abs(ours.value - theirs.value) < 1.5 * error, name
    theirs, ours = (result.cost["rhs_evaluations"] for result in results.values())
    assert ours < 0.7 * theirs


def test_unit_stiffness_is_seen(results):
    """Unit: the fastest motion is of the order that Dormand and Prince's pair sees: steps in impacts are shorter and raise its mean."""
    theirs, ours = (result.cost["eigenvalue_1_s"] for result in results.values())
    assert 0.7 * theirs < ours < 3.0 * theirs
    theirs, ours = (result.cost["held_by_stability"] for result in results.values())
    assert 0.0 < ours < 0.5 < theirs


def test_unit_not_finite_is_told(outer):
    """Unit: a start that is not finite names its component."""
    run = run_of(outer, 1e-2, "verlet")
    run.carry.y[3] = np.nan
    with pytest.raises(RunError, match="roller 4 x is not finite"):
        run.to(0.1)


def test_invariant_workers_change_nothing(make_scene):
    """Invariant: the same bits whatever the number of workers."""
    one, two = (simulate(make_scene(VERLET, ELASTIC), workers=workers) for workers in (1, 2))
    assert one.impact_force_N == two.impact_force_N and one.power_loss_W == two.power_loss_W


def test_unit_budget_counts_right_hand_sides(outer):
    """Unit: six steps of one right-hand side have the budget of one of Dormand and Prince's pair, which has six."""
    verlet_run, pair_run = (run_of(outer, 1e-2, method) for method in ("verlet", "rk45"))
    verlet_run.allow(7.0), pair_run.allow(7.0)
    assert verlet_run.control.step_budget == 6 * pair_run.control.step_budget > 0


def test_unit_peak_is_never_below_a_step_end(make_scene):
    """Unit: looking inside a step costs no right-hand side and spoils no row; the largest force is at least that of any end."""
    run, plain = run_of(make_scene(VERLET), 1e-3, "verlet"), run_of(make_scene(VERLET), 1e-3, "verlet")
    plain.tally.largest[:] = np.inf
    seen = 0.0
    for end in np.linspace(0.01, 1.0, 100):
        run.to(float(end))
        plain.to(float(end))
        seen = max(seen, run.carry.loads[0, 0])
        assert run.tally.largest[0] >= seen
    assert run.tally.largest[0] > seen > 0.0
    assert run.carry.counts[at.DERIVATIVES] == plain.carry.counts[at.DERIVATIVES]
    assert (run.carry.y == plain.carry.y).all()


def test_unit_step_budget_names_the_other_method(make_scene):
    """Unit: a used-up budget says that another method may do."""
    with pytest.raises(RunError, match=r"take numerics\.method = auto"):
        run_of(make_scene(VERLET, "numerics.step_budget_per_turn=100"), 1e-6, "verlet").to(6.0)
