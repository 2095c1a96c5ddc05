"""The linearly implicit method: its table, linear algebra and Jacobian, order, stability, and agreement with the other."""

from itertools import pairwise

import numpy as np
import pytest
from smooth_runs import fixed_step, run_of, vibrating

from rbdyn.compiled.kernel import entry
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.figures import CAGE_SLIP, IMPACT_FORCE, POWER_LOSS, WHIRL_DEVIATION_RATIO
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.forces.state import LOADS, ROLLER_STATES, layout
from rbdyn.dynamics.integrators import advance as at
from rbdyn.dynamics.integrators import rosenbrock as ros
from rbdyn.dynamics.integrators.advance import advance
from rbdyn.dynamics.integrators.rosenbrock import arrow_matrix, differences_of, factor, jacobian, rodas, shifted, solve
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import absolute_tolerance, increments, layout_of, scales, slip_scale
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import held_by_stability, largest_eigenvalue
from rbdyn.dynamics.simulate import simulate
from rbdyn.dynamics.statistics.batch_means import student_half_width
from rbdyn.losses import POWERS, SHAFT

STEEP = ("traction.constants=[-0.05,5.0,100.0,0.05]",)
# A slope of 80 s/m, where the implicit method is the cheaper one.
STEEPER = ("traction.constants=[-0.05,40.0,800.0,0.05]",)


def dense(matrix):
    """An arrow matrix as a plain one, in the order of the state vector."""
    z, m = matrix.blocks.shape[2], matrix.bodies.shape[0]
    body = ROLLER_STATES * z
    full = np.zeros((body + m, body + m))
    for j in range(z):
        place = j + z * np.arange(ROLLER_STATES)
        full[np.ix_(place, place)] = matrix.blocks[:, :, j]
        full[place, body:] = matrix.upper[:, j, :]
        full[np.ix_(body + matrix.pushed, place)] = matrix.lower[:, :, j]
    full[body:, body:] = matrix.bodies
    return full


@pytest.mark.parametrize("interpreted", [False, True])
@pytest.mark.parametrize("supported", [False, True])
def test_unit_arrow_matrix(supported, interpreted):
    """Unit: factors and solution of a random arrow matrix are those of plain linear algebra, to round-off."""
    draw = np.random.default_rng(3)
    state = layout(7, supported, True)
    matrix, factors = arrow_matrix(state), arrow_matrix(state)
    for block in (matrix.blocks, matrix.upper, matrix.lower, matrix.bodies):
        block[:] = draw.normal(size=block.shape)
    right_side = draw.normal(size=state.size)
    steps = (shifted, factor, solve)
    shift, factorise, back = (step.py_func for step in steps) if interpreted else steps
    shift(matrix, 9.0, factors)
    plain = 9.0 * np.eye(state.size) - dense(matrix)
    assert dense(factors) == pytest.approx(plain, abs=1e-15)
    factorise(factors)
    found = right_side.copy()
    back(factors, found)
    assert found == pytest.approx(np.linalg.solve(plain, right_side), rel=1e-9, abs=1e-11)


@entry
def compiled_jacobian(bearing, y, stage, k, power, loads, work, found):
    """The Jacobian, its machine code kept on disk."""
    jacobian(bearing, y, stage, k, ros.NEXT_ROW, power, loads, work, found)


@pytest.mark.parametrize("fixture", ["outer", "everything"])
def test_oracle_jacobian(fixture, request, evaluate, random_state):
    """Oracle: central differences of the whole right-hand side, a component at a time; the powers' gradients too.

    Each row within 1e-3 of its largest entry, in steps of the components' scales: the law of approach has no second
    derivative where contacts open, which central and one-sided differences see differently.
    """
    scene = request.getfixturevalue(fixture)
    bearing = roller_bearing(scene)
    for seed in range(3):
        y = random_state(scene, seed)
        n = y.size
        found = differences_of(layout_of(scene), bearing, increments(scene, bearing))
        k, power, loads = np.zeros((2, n)), np.zeros((2, POWERS)), np.zeros((2, LOADS))
        start = evaluate(bearing, y)
        k[0], power[0], loads[0] = start
        compiled_jacobian(bearing, y, np.zeros(n), k, power, loads, scratch(10), found)
        plain, gradients = np.empty((n, n)), np.empty((POWERS, n))
        for i, step in enumerate(4.0 * found.increments):
            ahead, behind = y.copy(), y.copy()
            ahead[i], behind[i] = y[i] + step, y[i] - step
            after, before = evaluate(bearing, ahead), evaluate(bearing, behind)
            plain[:, i] = (after.dy - before.dy) / (ahead[i] - behind[i])
            gradients[:, i] = (after.power - before.power) / (ahead[i] - behind[i])
        for ours, theirs in ((dense(found.matrix), plain), (found.power, gradients)):
            scaled, error = np.abs(theirs) * found.increments, np.abs(ours - theirs) * found.increments
            assert np.all(error.max(axis=1) <= 1e-3 * scaled.max(axis=1) + 1e-12), seed


def python_step(f, jacobian_at, y, h):
    """One step in Python from the module's tables: stages and end state."""
    system = np.eye(y.size) / (h * ros.GAMMA) - jacobian_at(y)
    u = np.zeros((ros.STAGES, y.size))
    for s in range(ros.STAGES):
        state = y + ros.A[s, :s] @ u[:s]
        u[s] = np.linalg.solve(system, f(state) + ros.C[s, :s] @ u[:s] / h)
    return u, state + u[-1]


def amplification(z):
    """R(z): what a step makes of y' = lambda y, z = h lambda, and of its embedded error."""
    u, end = python_step(lambda y: z * y, lambda y: np.array([[z]]), np.ones(1, dtype=complex), 1.0)
    return end[0], u[-1][0]


def test_unit_linear_stability(monkeypatch):
    """Unit: A-stable on the imaginary axis, L-stable, of order four, with an embedded error of order three."""
    monkeypatch.setattr(np, "zeros", lambda shape, dtype=complex, zeros=np.zeros: zeros(shape, dtype))
    for y in np.logspace(-2, 6, 60):
        assert abs(amplification(1j * y)[0]) <= 1.0 + 1e-9
        assert abs(amplification(-y)[0]) <= 1.0
        assert abs(amplification(y * (-0.3 + 0.95j))[0]) <= 1.0
    assert abs(amplification(-1e8)[0]) < 1e-6
    z = np.array([0.2, 0.1])
    end, embedded = np.array([amplification(-x) for x in z]).T
    local = np.abs(end - np.exp(-z))
    assert np.log2(local[0] / local[1]) == pytest.approx(5.0, abs=0.3)
    assert np.log2(abs(embedded[0] / embedded[1])) == pytest.approx(4.0, abs=0.4)


def test_rate_dense_output_and_step():
    """Rate: on a pendulum with friction a step has local order five, the dense output within it local order four."""

    def f(y):
        return np.array([y[1], -np.sin(y[0]) - 0.3 * y[1] * abs(y[1])])

    def slope(y):
        return np.array([[0.0, 1.0], [-np.cos(y[0]), -0.6 * abs(y[1])]])

    start = np.array([1.0, 0.4])
    steps, inside, at_end = np.array([0.2, 0.1, 0.05]), [], []
    for h in steps:
        u, end = python_step(f, slope, start, h)
        exact = [start]
        for _ in range(64):
            exact.append(python_step(f, slope, exact[-1], h / 64)[1])
        theta = 0.25
        curve = (ros.D_2 + theta * ros.D_3) @ u[:5]
        found = start * (1.0 - theta) + theta * (end + (1.0 - theta) * curve)
        inside.append(np.abs(found - exact[16]).max())
        at_end.append(np.abs(end - exact[64]).max())
    assert np.polyfit(np.log(steps), np.log(at_end), 1)[0] > 4.6
    assert np.polyfit(np.log(steps), np.log(inside), 1)[0] > 3.6


def test_rate_order_four(outer):
    """Rate: the error over a smooth stretch falls with the fourth power of the step (3.6 leaves room for the fit)."""
    duration = 3.2e-5
    steps = duration / np.array([16, 24, 32, 48])
    reference = fixed_step(outer, duration / 512, duration, "rosenbrock")
    errors = np.array([np.abs(fixed_step(outer, h, duration, "rosenbrock") - reference)[20:40].max() for h in steps])
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 3.6


def test_invariant_stable_where_explicit_steps_are_not(outer):
    """Invariant: at three times the largest stable explicit step a vibration dies away; explicit steps blow it up."""
    step = 2.4e-5
    still = run_of(outer, 1e-6, "rosenbrock")
    still.to(0.05)
    implicit = fixed_step(outer, step, 0.05 * outer.turn_s, "rosenbrock")
    assert np.abs(implicit - still.carry.y)[20:40].max() < 0.1
    run = vibrating(outer, "rk45")
    control = run.control._replace(inverse_tolerance=np.zeros_like(run.control.inverse_tolerance), largest_step=step)
    run.carry.clock[at.STEP] = step
    advance(run.bearing, control, run.carry, run.tally, 0.05 * outer.turn_s, 1.0)
    explicit = np.abs(run.carry.y - still.carry.y)[20:40].max()
    assert not explicit < 10.0


def test_oracle_quarter_turn(outer):
    """Oracle: a quarter turn, its works and loads agree with the explicit method at a tight tolerance."""
    ours, theirs = run_of(outer, 1e-7, "rosenbrock"), run_of(outer, 1e-9, "rk45")
    for run in (ours, theirs):
        run.to(0.25)
    scale = scales(outer)
    difference = np.abs(ours.carry.y - theirs.carry.y)
    assert difference[:20].max() < 1e-4 * scale.length
    assert difference[20:40].max() < 1e-4 * scale.speed
    assert ours.tally.work == pytest.approx(theirs.tally.work, rel=1e-5, abs=1e-5 * scale.load * scale.length)
    assert ours.tally.largest == pytest.approx(theirs.tally.largest, rel=1e-3, abs=1e-3 * scale.load)
    assert ours.tally.whirl == pytest.approx(theirs.tally.whirl, rel=1e-4)


@pytest.mark.parametrize("changes", [(), STEEP])
def test_invariant_power_balance(make_scene, changes):
    """Invariant: shaft work = losses + change of energy, the better the tighter the tolerance; steep traction too."""
    scene = make_scene(*changes)
    gaps = []
    for rtol in (1e-2, 1e-3, 1e-4):
        run = run_of(scene, rtol, "rosenbrock")
        start = sum(run.energies())
        run.to(2.0)
        change = sum(run.energies()) - start
        gaps.append(abs(run.tally.work[SHAFT] - run.tally.work[:SHAFT].sum() - change) / run.tally.work[SHAFT])
    assert gaps[0] < 0.005
    assert all(tight < loose for loose, tight in pairwise(gaps))


def test_unit_budget_and_chunks(outer):
    """Unit: the step budget stops a run; a run in two calls goes where one in one call goes, within its tolerance."""
    run = run_of(outer, 1e-4, "rosenbrock")
    control = run.control._replace(step_budget=7)
    assert advance(run.bearing, control, run.carry, run.tally, outer.turn_s, 1.0) == at.STEP_BUDGET
    assert run.steps == 7
    whole, parts = run_of(outer, 1e-6, "rosenbrock"), run_of(outer, 1e-6, "rosenbrock")
    whole.to(0.1)
    for turns in (0.03, 0.1):
        parts.to(turns)
    assert np.abs(whole.carry.y - parts.carry.y)[20:40].max() < 1e-3 * scales(outer).speed


def test_unit_not_finite_is_a_status(outer):
    """Unit: a state that is not finite ends the run and names the component."""
    run = run_of(outer, 1e-2, "rosenbrock")
    run.carry.y[40] = np.nan
    assert advance(run.bearing, run.control, run.carry, run.tally, outer.turn_s, 1.0) == at.NOT_FINITE


def test_oracle_stiffness(make_scene, outer, evaluate):
    """Oracle: where stability holds the steps, the eigenvalue seen is the largest of the Jacobian, within 15 %; where
    accuracy holds them, none is.
    """
    heavy = make_scene("operation.radial_load_N=26000.0")
    calm, stiff = run_of(outer, 1e-5, "rk45"), run_of(heavy, 1e-2, "rk45")
    for run in (calm, stiff):
        run.to(1.0)
    assert held_by_stability(calm.carry.stiffness) < 0.05
    assert held_by_stability(stiff.carry.stiffness) > 0.9
    found = differences_of(layout_of(heavy), stiff.bearing, increments(heavy, stiff.bearing))
    y, n = stiff.carry.y, stiff.carry.y.size
    k, power, loads = np.zeros((2, n)), np.zeros((2, POWERS)), np.zeros((2, LOADS))
    k[0], power[0], loads[0] = evaluate(stiff.bearing, y)
    compiled_jacobian(stiff.bearing, y, np.zeros(n), k, power, loads, scratch(10), found)
    radius = np.abs(np.linalg.eigvals(dense(found.matrix))).max()
    assert largest_eigenvalue(stiff.carry.stiffness) == pytest.approx(radius, rel=0.15)


def test_unit_auto(make_scene, outer):
    """Unit: "auto" keeps the explicit method, bit for bit, where few steps do, and leaves it where the
    traction is steep; the result tells.
    """
    plain, auto = run_of(outer, 1e-2, "verlet"), run_of(outer, 1e-2, "auto")
    for run in (plain, auto):
        run.to(0.5)
    assert auto.method == "verlet" and (plain.carry.y == auto.carry.y).all()
    steep = make_scene(*STEEPER)
    result = simulate(steep, workers=2)
    assert result.cost["implicit_runs"] == 2 and result.power_balance.relative_gap < 0.005
    assert any("linearly implicit" in note for note in result.notes)
    explicit = make_scene(*STEEPER, "numerics.method=rk45", "numerics.turns=1", "numerics.discard_turns=0")
    held = simulate(explicit, workers=2)
    assert held.cost["held_by_stability"] > 0.9 and held.cost["implicit_runs"] == 0
    assert any("stability, not accuracy, limits" in note and "'auto'" in note for note in held.notes)
    assert result.cost["eigenvalue_1_s"] == pytest.approx(held.cost["eigenvalue_1_s"], rel=0.1)


def test_unit_tolerance_scales(make_scene, outer):
    """Unit: the spin's tolerance follows the traction curve where that is steeper than contacts are fast; in a slow
    bearing all tolerances follow the races.
    """

    def tolerance(scene, method="rk45"):
        return absolute_tolerance(scene, roller_bearing(scene.changed({"damage.races": False})), 1.0, method)

    z, roller = 10, 4.5e-3
    speed = scales(outer).speed
    assert tolerance(outer)[[0, 2 * z, 4 * z]] == pytest.approx([scales(outer).length, speed, speed / roller])
    # (A + B u) exp(-C u) - A of the plain scene: peak 0.05, slope B - A C at rest.
    assert slip_scale(roller_bearing(outer), 650.0) == pytest.approx(0.05 / 0.157483, rel=1e-3)
    heavy = make_scene("operation.radial_load_N=26000.0")
    assert tolerance(heavy)[4 * z] * roller == pytest.approx(0.05 / 0.157483, rel=1e-3)
    surface = 24000.0 * np.pi / 30.0 * 17.245e-3
    assert tolerance(heavy)[2 * z] == pytest.approx(0.05 * surface, rel=1e-3)
    assert tolerance(heavy)[2 * z] < scales(heavy).speed
    dry = make_scene("traction.model=coulomb")
    assert tolerance(dry)[4 * z] * roller == pytest.approx(0.02, rel=1e-3)
    assert slip_scale(roller_bearing(make_scene("traction.model=off")), 650.0) == np.inf
    slow = make_scene("operation.inner_speed_rpm=10.0")
    assert tolerance(slow)[2 * z] == pytest.approx(0.05 * surface / 2400.0, rel=1e-3)
    assert tolerance(slow, "rosenbrock")[2 * z] == pytest.approx(surface / 2400.0, rel=1e-3)


def test_unit_workspace_fits_every_layout(everything):
    """Unit: the bearing of one roller has the types of the whole one, so that no law is compiled twice."""
    bearing = roller_bearing(everything)
    work = rodas(layout_of(everything), bearing, increments(everything, bearing))
    single = work.differences.roller.bearing
    assert [type(part) for part in single] == [type(part) for part in bearing]
    assert work.differences.roller.y.size == layout_of(everything).size - ROLLER_STATES * (bearing.rollers - 1)


@pytest.mark.slow
def test_oracle_statistics_of_both_methods(make_scene):
    """Oracle: over 16 replicates of 40 turns both methods give the same outputs within the 95 % error of the difference
    (or half a per cent, the numerical error that either may have).
    """
    figures = {}
    for method in ("rk45", "rosenbrock"):
        scene = make_scene(f"numerics.method={method}", "numerics.turns=40", "numerics.discard_turns=10")
        bearing = roller_bearing(scene)
        runs = [run_replicate(scene, bearing, index, 1e-2, Stop()) for index in range(16)]
        figures[method] = np.array(
            [
                [statistic.value(run) for statistic in (IMPACT_FORCE, WHIRL_DEVIATION_RATIO, POWER_LOSS, CAGE_SLIP)]
                for run in runs
            ]
        )
    for explicit, implicit in zip(figures["rk45"].T, figures["rosenbrock"].T, strict=True):
        error = np.hypot(student_half_width(explicit), student_half_width(implicit))
        assert abs(explicit.mean() - implicit.mean()) < max(error, 0.005 * abs(explicit.mean()))
