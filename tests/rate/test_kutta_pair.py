"""Kutta's pair in place of Dormand and Prince's: order, dense output, stability, power balance, the same figures."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from smooth_runs import run_of, vibrating
from test_runge_kutta import one_step, orders_of, slope_of

from rbdyn.base.faults import RunError
from rbdyn.dynamics.integrators import runge_kutta
from rbdyn.dynamics.integrators.advance import DERIVATIVES, interpolate
from rbdyn.dynamics.simulate import simulate
from rbdyn.losses import SHAFT

KUTTA = runge_kutta.Kutta()
RK43 = "numerics.method=rk43"
LONGER = ("numerics.turns=60", "numerics.discard_turns=20", "numerics.replicates=4")


@pytest.fixture(scope="module")
def results(make_scene):
    """The example by either pair."""
    return {
        method: simulate(make_scene(*LONGER, f"numerics.method={method}"), workers=1) for method in ("rk45", "rk43")
    }


def square(table):
    """A tableau with the column of the last row, which no row reads."""
    return np.column_stack((table, np.zeros(len(table))))


def largest_stable(table, direction):
    """Largest |z| along ``direction`` up to which no step with h eigenvalue = z grows."""
    rows, b = square(table), square(table)[-1]
    reach = np.arange(0.01, 5.0, 0.001)
    z = reach * direction / abs(direction)
    growth, power = np.ones_like(z), np.ones(len(rows))
    for order in range(1, len(rows)):
        growth = growth + z**order * (b @ power)
        power = rows @ power
    return reach[np.argmax(np.abs(growth) > 1.0 + 1e-9)]


def test_unit_tableau():
    """Unit: row sums, tree conditions to order four, an embedded third order, first same as last."""
    a = square(runge_kutta.KUTTA_WEIGHTS)
    b, c = a[-1], a.sum(axis=1)
    e = np.array(
        [runge_kutta.KUTTA_E1, runge_kutta.KUTTA_E2, runge_kutta.KUTTA_E3, runge_kutta.KUTTA_E4, runge_kutta.KUTTA_E5]
    )
    assert c == pytest.approx(runge_kutta.KUTTA_NODES, abs=1e-15)
    assert b[:4] == pytest.approx(
        [runge_kutta.KUTTA_B1, runge_kutta.KUTTA_B2, runge_kutta.KUTTA_B3, runge_kutta.KUTTA_B4], abs=0.0
    )
    lower = {"1": (np.ones(5), 1), "c": (c, 1 / 2), "c2": (c**2, 1 / 3), "A c": (a @ c, 1 / 6)}
    fourth = {
        "c3": (c**3, 1 / 4),
        "c A c": (c * (a @ c), 1 / 8),
        "A c2": (a @ c**2, 1 / 12),
        "A A c": (a @ a @ c, 1 / 24),
    }
    for name, (tree, exact) in {**lower, **fourth}.items():
        assert b @ tree == pytest.approx(exact, abs=1e-15), name
    for name, (tree, _) in lower.items():
        assert e @ tree == pytest.approx(0.0, abs=1e-15), name
    assert e @ a @ a @ c == pytest.approx(1 / 72)


def test_oracle_stability():
    """Oracle: the known limits of both pairs; a right-hand side of this one carries farther for decay and vibration."""
    contact = -0.8 + 2.5j  # 1e5/s: the stiffest loaded contact of the example
    kutta, prince = (
        [largest_stable(table, way) for way in (-1.0, 1j, contact)]
        for table in (runge_kutta.KUTTA_WEIGHTS, runge_kutta.PRINCE_WEIGHTS)
    )
    assert kutta[:2] == pytest.approx([2.785, 2.828], abs=0.002)
    assert prince[0] == pytest.approx(3.307, abs=0.002)
    assert kutta[0] / 4 > 1.25 * prince[0] / 6 and kutta[2] / 4 > 1.25 * prince[2] / 6
    assert min(kutta) > KUTTA.limit and min(prince[0], prince[2]) > runge_kutta.DormandPrince().limit


def test_rate_order_four(make_scene, conservative):
    """Rate: the error over a smooth stretch falls with the fourth power of the step; a fit between 3.6 and 6: in the frame of the
    rollers the fourth-order term may be small beside the fifth.
    """
    for order in orders_of(conservative, "rk43"):
        assert 3.6 < order < 6.0


def test_rate_dense_output(conservative, evaluate):
    """Rate: inside a step the cubic has local order four; values at its ends are those of the step (round-off)."""
    run = vibrating(conservative, "rk43")
    y, steps = run.carry.y.copy(), np.array([4e-6, 2.8e-6, 2e-6, 1.4e-6])

    def inside(h, theta):
        k, end = one_step(run.bearing, y, h, evaluate, runge_kutta.KUTTA_WEIGHTS)
        return np.array([interpolate(KUTTA, y, None, k, h, theta, i) for i in range(y.size)]), end

    assert inside(4e-6, 0.0)[0] == pytest.approx(y, abs=1e-14)
    found, end = inside(4e-6, 1.0)
    assert found == pytest.approx(end, rel=1e-13, abs=1e-13)
    for theta in (0.25, 0.6, 0.9):
        errors = []
        for h in steps:
            exact = y
            for _ in range(16):
                exact = one_step(run.bearing, exact, theta * h / 16.0, evaluate)[1]
            errors.append(np.abs(inside(h, theta)[0] - exact)[20:40].max())
        assert slope_of(steps, errors) > 3.6


def test_invariant_power_balance(make_scene):
    """Invariant: shaft work = losses + change of energy, to 0.1 % at the default tolerance, shrinking with it."""
    scene, gaps = make_scene(RK43), []
    for rtol in scene.numerics.rtol * np.array([10.0, 1.0, 0.1, 0.01]):
        run = run_of(scene, rtol, "rk43")
        start = sum(run.energies())
        run.to(4.0)
        change = sum(run.energies()) - start
        work = run.tally.work
        gaps.append(abs(work[SHAFT] - work[:SHAFT].sum() - change) / work[SHAFT])
    assert gaps[1] < 0.001
    assert all(tight < 0.5 * loose for loose, tight in pairwise(gaps))


def test_oracle_statistics_of_the_other_pair(results):
    """Oracle: figures agree within their errors (1.5 of both together), for fewer right-hand sides."""
    for name in ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_slip"):
        one, other = (getattr(result, name) for result in results.values())
        error = np.hypot(one.statistical_error, other.statistical_error)
        assert abs(one.value - other.value) < 1.5 * error, name
    prince, kutta = (result.cost["rhs_evaluations"] for result in results.values())
    assert kutta < prince


def test_unit_stiffness_is_seen_by_either(results):
    """Unit: both find the same fastest motion, to a tenth."""
    prince, kutta = (result.cost["eigenvalue_1_s"] for result in results.values())
    assert kutta == pytest.approx(prince, rel=0.1)


def test_invariant_workers_change_nothing(make_scene):
    """Invariant: the same bits whatever the number of workers."""
    one, two = (simulate(make_scene(RK43), workers=workers) for workers in (1, 2))
    assert one.impact_force_N == two.impact_force_N and one.power_loss_W == two.power_loss_W


def test_unit_peak_is_never_below_a_step_end(make_scene):
    """Unit: looking inside a step costs no right-hand side and spoils no row; the largest force is at least that of any end."""
    run, plain = run_of(make_scene(RK43), 1e-3, "rk43"), run_of(make_scene(RK43), 1e-3, "rk43")
    plain.tally.largest[:] = np.inf
    seen = 0.0
    for end in np.linspace(0.01, 1.0, 100):
        run.to(float(end))
        plain.to(float(end))
        seen = max(seen, run.carry.loads[0, 0])
        assert run.tally.largest[0] >= seen
    assert run.tally.largest[0] > seen > 0.0
    assert run.carry.counts[DERIVATIVES] == plain.carry.counts[DERIVATIVES]
    assert (run.carry.y == plain.carry.y).all()


def test_unit_step_budget_names_the_other_method(make_scene):
    """Unit: a used-up budget says that another method may do."""
    with pytest.raises(RunError, match=r"take numerics\.method = auto"):
        run_of(make_scene(RK43, "numerics.step_budget_per_turn=100"), 1e-4, "rk43").to(6.0)
