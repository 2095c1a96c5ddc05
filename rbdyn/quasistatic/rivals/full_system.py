"""All equations of equilibrium at once, dense: two a ball and one for every free component of the ring.

The unknowns are (axial, radial) of every ball, then the free ones of the ring's displacement (x, y, z, R theta_x, R theta_y),
all in m; the residuals are in N: what each ball lacks, then the load less what the ring takes. This is what a solver sees
that knows nothing of their structure.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry, routine
from rbdyn.quasistatic.row.ball import Control, ball_forces, deflection
from rbdyn.quasistatic.row.equilibrium import FIGURES, Solution, fill_figures, solution_of
from rbdyn.quasistatic.row.newton import STEPS, Task, posed, space
from rbdyn.quasistatic.row.ring import LOADED, Row, assemble, groove_centre


class System(NamedTuple):
    """A row and what holds its ring. Moments over the lever, tilts times the lever.

    ``load`` (5,) [N]; ``held`` (5,): the prescribed displacements, 0 where the load rules [m]; ``free``: places of the
    components that the load rules.
    """

    row: Row
    load: Array
    held: Array
    free: NDArray[np.int64]

    @property
    def size(self) -> int:
        """Number of equations."""
        return 2 * self.row.cosine.size + self.free.size


def system_of(row: Row, load: Array, given: Array | None = None) -> System:
    """The system of ``equilibrium.solve(row, ..., load, given)``."""
    force, free, held = posed(row, load, given)
    return System(row, force, held, np.flatnonzero(free))


def unknowns(system: System, q: Array, balls: Array) -> Array:
    """Vector of the unknowns with the ring at ``q`` (5,) [m] and the balls at ``balls`` (Z, 2 or more)."""
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
    q = system.held.copy()
    jacobian[:, :] = 0.0
    worst, largest = 0.0, 0.0
    for k in range(count):
        q[free[k]] = u[ring + k]
        residual[ring + k] = load[free[k]]
        largest = max(largest, abs(load[free[k]]))
    one = 1.0 / row.lever
    for j in range(row.cosine.size):
        c, s = row.cosine[j], row.sine[j]
        # What a ball's axial force, radial force and couple are worth along each component.
        axial, radial, couple = ((0.0, 0.0, 1.0, s, -c), (c, s, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, s * one, -c * one))
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
        # A comparison that NaN cannot pass.
        if not abs(residual[i]) <= worst:
            worst = abs(residual[i])
    return worst, largest


@entry
def evaluate(control: Any, system: Any, u: Any, residual: Any, jacobian: Any) -> tuple[float, float]:
    """``forces``, called from Python."""
    return forces(control, system, u, residual, jacobian)


@entry
def _finish(task: Any, at: Any, figures: Any) -> None:
    """Stiffness and loads at a solution, lifted balls put to rest."""
    at.work[:, LOADED] = 1.0
    assemble(task, 1.0, False, at)
    fill_figures(task, at, figures)


class Stop(NamedTuple):
    """Where a solver of the full system stopped: at the unknowns ``u``, "ok" or why there, with the ``residual`` [N] there."""

    u: Array
    status: str
    steps: int
    residual: float
    searches: int | None = None


def rival(search: Callable[..., Stop]) -> Callable[..., Solution]:
    """A solver that is called as ``equilibrium.solve``, with the options of ``search(control, system, start, ...)``."""

    @functools.wraps(search)
    def solve(
        row: Row, control: Control, load: Array, given: Array | None = None, start: Any = None, **options: Any
    ) -> Solution:
        system = system_of(row, load, given)
        return solution_at(control, system, search(control, system, start, **options))

    return solve


def solution_at(control: Control, system: System, stop: Stop) -> Solution:
    row, z, u = system.row, system.row.cosine.size, stop.u
    at, figures = space(z), np.zeros((z, FIGURES))
    at.counts[STEPS] = stop.steps
    at.q[:], at.balls[:, :2] = system.held, u[: 2 * z].reshape(z, 2)
    at.q[system.free] = u[2 * z :]
    # Nothing is solved any more: which components are free does not matter.
    _finish(Task(control, row, system.load, np.ones_like(system.load)), at, figures)
    return solution_of(row, at, figures, stop.status, stop.residual, stop.searches)
