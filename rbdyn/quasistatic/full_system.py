"""The full system of equations of one row, dense, for solvers that are compared with the convex one.

The equations are two a ball and one for every free component of the ring. The unknowns [m] are (axial, radial) of every
ball, then the free components of the ring's displacement (x, y, z, R theta_x, R theta_y). The residuals [N] are the
unbalanced forces of the balls, then the load less that of the ring. A general solver sees the equations in this form.

- ``convex_with_limit``: the convex solver stopped after a number of Newton steps, to show the fall of its residual
- ``rival``: gives such a solver the call of ``equilibrium.solve``
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry, routine
from rbdyn.quasistatic.row import newton
from rbdyn.quasistatic.row.ball import Control, ball_forces, deflection, has_race_control
from rbdyn.quasistatic.row.equilibrium import FIGURES, OK, Solution, fill_figures, solution_of
from rbdyn.quasistatic.row.ring import LOADED, RING, Row, assemble, groove_centre


class System(NamedTuple):
    """A row with the load and constraints of its ring. Moments are divided by the lever, tilts multiplied by it.

    ``load`` (5,) [N]. ``displacement`` (5,): prescribed displacements [m], 0 where the load rules. ``free``: indices of
    the components that the load rules.
    """

    row: Row
    load: Array
    displacement: Array
    free: NDArray[np.int64]

    @property
    def size(self) -> int:
        """Number of equations."""
        return 2 * self.row.cosine.size + self.free.size


def system_of(row: Row, load: Array, constraint: Array | None = None) -> System:
    """The system of ``equilibrium.solve(row, ..., load, constraint)``."""
    force, free, displacement = newton.boundary_conditions(row, load, constraint)
    return System(row, force, displacement, np.flatnonzero(free))


def unknowns(system: System, q: Array, balls: Array) -> Array:
    """Vector of unknowns for the ring at ``q`` (5,) [m] and the balls at ``balls`` (Z, 2 or more)."""
    return np.concatenate((balls[:, :2].ravel(), q[system.free]))


@routine
def move(u: Any, to: Any) -> None:
    """Copy a vector of unknowns, as ``newton.copy`` does a table."""
    for i in range(u.size):
        to[i] = u[i]


@routine
def forces(control: Any, system: Any, u: Any, residual: Any, jacobian: Any) -> tuple[float, float]:
    """Fill ``residual`` (n,) [N] and its derivative ``jacobian`` (n, n) [N/m] at ``u``.

    Returns the largest residual and the largest force [N].
    """
    row, load, free = system.row, system.load, system.free
    ring, count = 2 * row.cosine.size, free.size
    q = system.displacement.copy()
    jacobian[:, :] = 0.0
    worst, largest = 0.0, 0.0
    for k in range(count):
        q[free[k]] = u[ring + k]
        residual[ring + k] = load[free[k]]
        largest = max(largest, abs(load[free[k]]))
    inv = 1.0 / row.lever
    for j in range(row.cosine.size):
        c, s = row.cosine[j], row.sine[j]
        # Factors of a ball's axial force, radial force and couple in each component.
        axial, radial, couple = ((0.0, 0.0, 1.0, s, -c), (c, s, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, s * inv, -c * inv))
        a_axial, a_radial = groove_centre(row, q, j)
        x, y = u[2 * j], u[2 * j + 1]
        inner = deflection(a_axial - x, a_radial - y, row.inner_reach[j])
        outer = deflection(x, y, row.outer_reach[j])
        (ra, rr), (fa, fr, fm), by_a, by_x, ring_a, ring_x, pull, _ = ball_forces(
            control, 1.0, row, a_axial, a_radial, x, y, inner, outer
        )
        residual[2 * j], residual[2 * j + 1] = ra, rr
        largest = max(largest, abs(fa), abs(fr), abs(pull))
        jacobian[2 * j, 2 * j], jacobian[2 * j, 2 * j + 1] = by_x[0], by_x[1]
        jacobian[2 * j + 1, 2 * j], jacobian[2 * j + 1, 2 * j + 1] = by_x[2], by_x[3]
        for k in range(count):
            i = free[k]
            ai, ri, ti = axial[i], radial[i], couple[i]
            residual[ring + k] -= ai * fa + ri * fr + ti * fm
            jacobian[2 * j, ring + k] = by_a[0] * ai + by_a[1] * ri
            jacobian[2 * j + 1, ring + k] = by_a[2] * ai + by_a[3] * ri
            jacobian[ring + k, 2 * j] = -(ai * ring_x[0] + ri * ring_x[2] + ti * ring_x[4])
            jacobian[ring + k, 2 * j + 1] = -(ai * ring_x[1] + ri * ring_x[3] + ti * ring_x[5])
            by_axial = ai * ring_a[0] + ri * ring_a[2] + ti * ring_a[4]
            by_radial = ai * ring_a[1] + ri * ring_a[3] + ti * ring_a[5]
            for m in range(count):
                jacobian[ring + k, ring + m] -= by_axial * axial[free[m]] + by_radial * radial[free[m]]
    for i in range(residual.size):
        # Written so that NaN becomes the largest residual.
        if not abs(residual[i]) <= worst:
            worst = abs(residual[i])
    return worst, largest


@entry
def evaluate(control: Any, system: Any, u: Any, residual: Any, jacobian: Any) -> tuple[float, float]:
    """``forces``, called from Python."""
    return forces(control, system, u, residual, jacobian)


@entry
def _finish(task: Any, state: Any, figures: Any) -> None:
    """Stiffness and figures at a solution, with lifted balls at rest."""
    state.work[:, LOADED] = 1.0
    assemble(task, 1.0, False, state)
    fill_figures(task, state, figures)


class Stop(NamedTuple):
    """End of a solve: unknowns ``u``, status "ok" or the cause of the stop, largest ``residual`` [N] there."""

    u: Array
    status: str
    steps: int
    residual: float
    searches: int | None = None


def rival(search: Callable[..., Stop]) -> Callable[..., Solution]:
    """Solver with the call of ``equilibrium.solve`` and the options of ``search(control, system, start, ...)``."""

    @functools.wraps(search)
    def solve(
        row: Row, control: Control, load: Array, constraint: Array | None = None, start: Any = None, **options: Any
    ) -> Solution:
        system = system_of(row, load, constraint)
        return solution_at(control, system, search(control, system, start, **options))

    return solve


def solution_at(control: Control, system: System, stop: Stop) -> Solution:
    """Solution at the end of a solve."""
    row, z, u = system.row, system.row.cosine.size, stop.u
    state, figures = newton.space(z), np.zeros((z, FIGURES))
    state.counts[newton.STEPS] = stop.steps
    state.q[:], state.balls[:, :2] = system.displacement, u[: 2 * z].reshape(z, 2)
    state.q[system.free] = u[2 * z :]
    # Without a further solve, the choice of free components does not matter.
    _finish(newton.Task(control, row, system.load, np.ones_like(system.load)), state, figures)
    return solution_of(row, state, figures, stop.status, stop.residual, stop.searches)


@entry
def _within(task: Any, limit: int, state: Any) -> bool:
    """``newton.find`` in at most ``limit`` steps; returns whether they were enough."""
    newton.start_afresh(task, state)
    q, balls = state.q.copy(), state.balls.copy()
    enough = newton.rough_residual(task) if has_race_control(task.control) else 0.0
    arrived = newton.march(task, 0.0, enough, min(limit, newton.CONVEX_MARCH), state)
    if not arrived and limit > state.counts[newton.STEPS]:
        newton.go_to(q, balls, state.q, state.balls)
        arrived = newton.descend(task, 0.0, True, limit - state.counts[newton.STEPS], state)
    if not arrived or not has_race_control(task.control):
        return arrived
    return newton.march(task, 1.0, 0.0, limit - state.counts[newton.STEPS], state)


@rival
def convex_with_limit(control: Control, system: System, start: None, limit: int = 1000) -> Stop:
    """The convex solver in at most ``limit`` steps, without continuation; it ignores a ``start``."""
    state, free = newton.space(system.row.cosine.size), np.zeros(RING)
    state.q[:], free[system.free] = system.displacement, 1.0
    arrived = _within(newton.Task(control, system.row, system.load, free), limit, state)
    u = unknowns(system, state.q, state.balls)
    worst, _ = evaluate(control, system, u, np.zeros(system.size), np.zeros((system.size, system.size)))
    status = OK if arrived else f"not converged in {limit} steps"
    return Stop(u, status, int(state.counts[newton.STEPS]), worst)
