"""The integrator: order, dense output, agreement with scipy, refusals, conserved energy and closed power balance."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from smooth_runs import fixed_step, run_of, vibrating

from rbdyn.base.faults import RunError
from rbdyn.dynamics.ensemble import CancelledError
from rbdyn.dynamics.integrators import advance as at
from rbdyn.dynamics.integrators import runge_kutta as dp
from rbdyn.dynamics.integrators.advance import advance, interpolate, refine_peak
from rbdyn.dynamics.parameters.state import scales
from rbdyn.losses import POCKET_FORCE, POWERS, SHAFT

PAIR = dp.DormandPrince()


def slope_of(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def test_rate_order_five(conservative):
    """Rate: the error over a smooth stretch falls at least with the fifth power of the step.

    A fit between 4.6 and 6.2: in the frame of the rollers the fifth-order term is small beside the sixth.
    """
    for order in orders_of(conservative, "rk45"):
        assert 4.6 < order < 6.2


def orders_of(scene, method):
    """Orders in which the errors of positions and of velocities fall with the step over a smooth stretch."""
    duration, steps = 3.2e-5, np.array([3.2e-5 / n for n in (32, 48, 64, 96)])
    reference = fixed_step(scene, duration / 1024, duration, method)
    errors = np.array([np.abs(fixed_step(scene, h, duration, method) - reference) for h in steps])
    return [slope_of(steps, errors[:, kind].max(axis=1)) for kind in (slice(0, 20), slice(20, 40))]


def one_step(bearing, y, h, evaluate, table=dp.WEIGHTS):
    """One step in Python from a module's table, in fixed axes: stages and end state."""
    k = np.empty((len(table), y.size))
    k[0] = evaluate(bearing, y).dy
    for s in range(1, len(table)):
        end = y + h * table[s, :s] @ k[:s]
        k[s] = evaluate(bearing, end).dy
    return k, end


def test_rate_dense_output(conservative, evaluate):
    """Rate: inside a step the continuous extension has local order five, that is fourth-order accuracy."""
    run = vibrating(conservative, "rk45")
    bearing, y = run.bearing, run.carry.y.copy()
    steps = np.array([4e-6, 2.8e-6, 2e-6, 1.4e-6])
    for theta in (0.25, 0.6, 0.9):
        errors = []
        for h in steps:
            k, _ = one_step(bearing, y, h, evaluate)
            step = SimpleNamespace(k=k, y=y)
            inside = np.array([interpolate(PAIR, step.y, None, step.k, h, theta, i) for i in range(y.size)])
            exact = y
            for _ in range(16):
                exact = one_step(bearing, exact, theta * h / 16.0, evaluate)[1]
            errors.append(np.abs(inside - exact)[20:40].max())
        assert slope_of(steps, errors) > 4.6


def test_unit_dense_output_meets_the_ends():
    """Unit: values and slopes at both ends of a step are those of the step (round-off)."""
    draw = np.random.default_rng(0)
    step, h = SimpleNamespace(k=draw.normal(size=(7, 3)), y=draw.normal(size=3)), 0.3
    end = step.y + h * dp.WEIGHTS[6] @ step.k[:6]
    # Slopes at the ends are k_1 and k_7 whatever the stages between.
    for i in range(3):
        at = [interpolate(PAIR, step.y, None, step.k, h, theta, i) for theta in (0.0, 1.0, 1e-6, 1.0 - 1e-6)]
        assert at[:2] == pytest.approx([step.y[i], end[i]], abs=1e-14)
        slopes = [(at[2] - at[0]) / (1e-6 * h), (at[1] - at[3]) / (1e-6 * h)]
        assert slopes == pytest.approx([step.k[0, i], step.k[6, i]], abs=1e-3)


def test_unit_tableau():
    """Unit: row sums, quadrature and tree conditions to order five, embedded weights, first same as last."""
    a = np.zeros((7, 7))
    a[:, :6] = dp.WEIGHTS
    b = np.array([dp.B1, 0.0, dp.B3, dp.B4, dp.B5, dp.B6, 0.0])
    c = a.sum(axis=1)
    assert c == pytest.approx(dp.NODES, abs=1e-15)
    assert a[6] == pytest.approx(b, abs=0.0)
    for power in range(5):
        assert b @ c**power == pytest.approx(1.0 / (power + 1), abs=1e-15)
    trees = {
        "b A c": (b @ a @ c, 1 / 6),
        "b c A c": ((b * c) @ a @ c, 1 / 8),
        "b A c2": (b @ a @ c**2, 1 / 12),
        "b A A c": (b @ a @ a @ c, 1 / 24),
        "b A c3": (b @ a @ c**3, 1 / 20),
        "b A A A c": (b @ a @ a @ a @ c, 1 / 120),
        "b c2 A c": ((b * c**2) @ a @ c, 1 / 10),
        "b c A c2": ((b * c) @ a @ c**2, 1 / 15),
        "b (A c)2": (b @ (a @ c) ** 2, 1 / 20),
        "b c A A c": ((b * c) @ a @ a @ c, 1 / 30),
        "b A (c A c)": (b @ a @ (c * (a @ c)), 1 / 40),
        "b A A c2": (b @ a @ a @ c**2, 1 / 60),
    }
    for name, (value, exact) in trees.items():
        assert value == pytest.approx(exact, abs=2e-15), name
    e = np.array([dp.E1, 0.0, dp.E3, dp.E4, dp.E5, dp.E6, dp.E7])
    for power in range(4):  # the companion is of fourth order
        assert e @ c**power == pytest.approx(0.0, abs=1e-16)
    assert abs(e @ c**4) > 1e-5
    d = (dp.D1, dp.D3, dp.D4, dp.D5, dp.D6, dp.D7)
    assert sum(d) == pytest.approx(0.0, abs=1e-14)


def test_oracle_quarter_turn(outer, evaluate):
    """Oracle: a quarter turn and the work of every power, against DOP853 at 1e-11 on the same right-hand side.

    Longer trajectories part by chaos; here errors grow by about e^1.
    """
    run = run_of(outer, 1e-9, "rk45")
    bearing, start = run.bearing, run.carry.y.copy()
    duration, n = 0.25 * outer.turn_s, start.size
    tolerance = 1e-11 / (run.control.inverse_tolerance * 1e-9)
    scale = scales(outer)

    def augmented(_, y):
        found = evaluate(bearing, y[:n])
        return np.concatenate((found.dy, found.power))

    atol = np.concatenate((1e-2 / run.control.inverse_tolerance, np.full(POWERS, 1e-12)))
    found = solve_ivp(
        augmented, (0.0, duration), np.concatenate((start, np.zeros(POWERS))), "DOP853", rtol=1e-13, atol=atol
    )
    assert tolerance.min() > 0.0
    run.to(0.25)
    reference = found.y[:, -1]
    # rtol 1e-9 of an approach (5 um) and of a contact speed (1.2 m/s) a step, some thousand steps.
    assert np.abs(run.carry.y - reference[:n])[:20].max() < 1e-6 * scale.length
    assert np.abs(run.carry.y - reference[:n])[20:40].max() < 1e-6 * scale.speed
    assert run.tally.work == pytest.approx(reference[n:], rel=1e-6, abs=1e-6 * scale.load * scale.length)


@pytest.mark.parametrize("replicate", [0, 1])
def test_invariant_energy_without_friction(conservative, replicate):
    """Invariant: ten turns without friction keep their energy, the better the tighter the tolerance.

    The scale is the elastic energy that the static contacts store (6.0 mJ): the total of 20 J is nearly all orbit
    and spin, which no contact ever touches.
    """
    drift = {}
    for rtol in (1e-5, 1e-6, 1e-7):
        run = run_of(conservative, rtol, "rk45", replicate)
        kinetic, elastic, potential = run.energies()
        start, worst = kinetic + elastic + potential, 0.0
        for turn in range(10):
            run.to(turn + 1.0)
            worst = max(worst, abs(sum(run.energies()) - start))
        # The sum of the pockets' forces is an impulse, not a work.
        assert (np.delete(run.tally.work, POCKET_FORCE) == 0.0).all()
        assert worst < 1e-6 * (kinetic + elastic)
        drift[rtol] = worst / elastic
    assert drift[1e-6] < 5e-5
    assert drift[1e-7] < drift[1e-6] < drift[1e-5] < 2e-4


@pytest.mark.parametrize(("fixture", "method"), [("outer", "rk45"), ("inner", "rk45")])
def test_invariant_power_balance(fixture, method, request):
    """Invariant: shaft work = losses + change of energy; below 0.5 % at the default tolerance, shrinking with it."""
    scene = request.getfixturevalue(fixture)
    gaps: list[float] = []
    for rtol in scene.numerics.rtol * np.array([10.0, 1.0, 0.1, 0.01]):
        run = run_of(scene, rtol, method)
        start = sum(run.energies())
        run.to(4.0)
        change = sum(run.energies()) - start
        gaps.append(abs(run.tally.work[SHAFT] - run.tally.work[:SHAFT].sum() - change) / run.tally.work[SHAFT])
    assert gaps[1] < 0.005
    assert (run.tally.work >= 0.0).all()
    assert all(tight < 0.5 * loose for loose, tight in pairwise(gaps))


def test_unit_chunks_change_nothing(outer):
    """Unit: stopping at chunk ends gives the same samples, and the same figures to the tolerance of the steps."""
    whole, parts = run_of(outer, 1e-8, "rk45"), run_of(outer, 1e-8, "rk45")
    whole.to(0.5)
    for end in np.linspace(0.05, 0.5, 10):
        parts.to(float(end))
    assert parts.carry.clock[at.NOW] == whole.carry.clock[at.NOW] == 0.5 * outer.turn_s
    assert parts.tally.whirl[at.SAMPLES] == whole.tally.whirl[at.SAMPLES] == 257  # 512 a turn, both ends counted
    scale = scales(outer)
    # Ten extra step ends at rtol 1e-8, over half a turn in which differences grow about tenfold.
    assert parts.tally.work == pytest.approx(whole.tally.work, rel=1e-5, abs=1e-5 * scale.load * scale.length)
    assert parts.tally.whirl[1:] == pytest.approx(whole.tally.whirl[1:], rel=1e-5)
    assert parts.tally.largest == pytest.approx(whole.tally.largest, rel=1e-4)


def test_unit_peak_is_never_below_a_step_end(outer):
    """Unit: the kept largest force is at least that of every step end, and its time lies inside the run."""
    run = run_of(outer, 1e-4, "rk45")
    seen = 0.0
    for end in np.linspace(0.001, 1.0, 1000):
        run.to(float(end))
        seen = max(seen, run.carry.loads[0, 0])
        assert run.tally.largest[0] >= seen
        assert (run.tally.largest >= run.carry.loads[0]).all()
    assert seen > 0.0
    assert 0.0 < run.tally.largest_time[0] <= run.carry.clock[at.NOW]


def test_oracle_peak_is_the_true_peak(outer):
    """Oracle: up to the first impacts, the peak of long steps is that of steps a hundred times shorter, to 0.5 %."""
    coarse, fine = run_of(outer, 1e-4, "rk45"), run_of(outer, 1e-10, "rk45")
    for run in (coarse, fine):
        run.to(0.5)
    assert fine.tally.largest[0] > 1.0
    # A parabola through points a ninth of a step apart; trajectories have hardly parted by then.
    assert coarse.tally.largest[0] == pytest.approx(fine.tally.largest[0], rel=5e-3)
    assert coarse.tally.largest_time[0] == pytest.approx(fine.tally.largest_time[0], abs=1e-7)


def test_oracle_peak_inside_one_step(conservative, evaluate):
    """Oracle: a roller that touches its wall and leaves it within one step; the force is sought on a fine grid.

    Points stand a ninth of a step apart, so the best of them may miss 1 % of the peak; the parabola errs by 0.03 %.
    """
    run = run_of(conservative, 1e-4, "rk45")
    carry, h, speed = run.carry, 2e-5, 1.0
    y = carry.y
    # The whole bearing turned back until the first pocket stands at angle 0.
    back = np.exp(-1j * y[52]) * (y[:10] + 1j * y[10:20])
    y[:10], y[10:20], y[52] = back.real, back.imag, 0.0
    y[10], y[50:52] = run.bearing.pocket.half_clearance - 1e-6, 0.0
    for fall in (0.7, 1.0, 1.6):
        carry.k[:] = 0.0
        carry.k[0, 10], carry.k[6, 10] = speed, -fall * speed
        # Back where it came from at the end of the step, and a cubic between.
        weights = np.array([[dp.B3, dp.B4], [dp.D3, dp.D4]])
        carry.k[2:4, 10] = np.linalg.solve(weights, [-dp.B1 * speed, -(dp.D1 - dp.D7 * fall) * speed])
        thetas = np.linspace(0.0, 1.0, 2001)
        forces = []
        for theta in thetas:
            inside = y.copy()
            inside[10] = interpolate(PAIR, carry.y, None, carry.k, h, theta, 10)
            forces.append(evaluate(run.bearing, inside).loads[0])
        carry.loads[:] = run.tally.largest[:] = 0.0
        refine_peak(run.bearing, carry, h, run.tally)
        assert run.tally.largest[0] == pytest.approx(max(forces), rel=1e-3)
        assert run.tally.largest_time[0] == pytest.approx(thetas[np.argmax(forces)] * h, abs=0.01 * h)


def test_unit_nan_is_refused(outer):
    """Unit: a state that is not finite stops the run and names what it touches."""
    run = run_of(outer, 1e-4, "rk45")
    run.carry.y[4] = np.nan
    with pytest.raises(RunError, match=r"replicate 1 \(seed 1\) stopped at t = 0 s.*roller 5 .* is not finite"):
        run.to(1.0)


def test_unit_overflowing_trial_step_is_rejected(outer):
    """Unit: a trial step into infinity is shrunk, never accepted; the budget then ends the run with a sentence."""
    run = run_of(outer, 1e-4, "rk45")
    run.control = run.control._replace(step_budget=1000)
    run.carry.clock[at.STEP] = 1e200
    status = advance(run.bearing, run.control, run.carry, run.tally, 1e201, 1.0)
    assert status == at.STEP_BUDGET
    assert run.carry.counts[at.REJECTED] > 280  # 1e200 s to 1e-6 s by fifths
    assert np.isfinite(run.carry.y).all()
    assert run.steps == 1000


def test_unit_step_underflow_names_component_and_mend(outer):
    """Unit: a step that may not shrink ends the run; the sentence names place, component and remedy."""
    run = run_of(outer, 1e-4, "rk45")
    run.control = run.control._replace(smallest_step=1e-4)
    run.carry.clock[at.STEP] = 1e-3
    with pytest.raises(RunError, match=r"the step fell below 0.0001 s because of .*(roller|cage|ring).*numerics\.rtol"):
        run.to(1.0)


def test_unit_step_budget_names_time_and_mend(make_scene):
    """Unit: a used-up step budget says when, how small the steps were, and what to change."""
    scene = make_scene("numerics.step_budget_per_turn=100")
    run = run_of(scene, 1e-4, "rk45")
    with pytest.raises(RunError) as caught:
        run.to(6.0)
    sentence = str(caught.value)
    assert "shaft turn " in sentence and "step budget of 600 used up" in sentence
    assert "numerics.step_budget_per_turn" in sentence and "numerics.rtol" in sentence


def test_unit_stop_is_heard(outer):
    """Unit: a wish to stop ends a run at the next chunk."""
    run = run_of(outer, 1e-4, "rk45")
    run.stop.event.set()
    with pytest.raises(CancelledError):
        run.to(1.0)


def largest_stable(table, direction):
    """Largest |z| along ``direction`` up to which no step with h eigenvalue = z grows."""
    rows = np.column_stack((table, np.zeros(len(table))))  # no row reads the last column
    b = rows[-1]
    reach = np.arange(0.01, 5.0, 0.001)
    z = reach * direction / abs(direction)
    growth, power = np.ones_like(z), np.ones(len(rows))
    for order in range(1, len(rows)):
        growth = growth + z**order * (b @ power)
        power = rows @ power
    return reach[np.argmax(np.abs(growth) > 1.0 + 1e-9)]


def test_oracle_stability():
    """Oracle: the known limit for decay; the stated limits lie within those for decay and for a loaded contact."""
    contact = -0.8 + 2.5j  # 1e5/s: the stiffest loaded contact of the example
    decay, vibration = (largest_stable(dp.WEIGHTS, way) for way in (-1.0, contact))
    assert decay == pytest.approx(3.307, abs=0.002)
    assert min(decay, vibration) > PAIR.limit
