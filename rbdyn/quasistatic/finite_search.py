"""The finite search for starting values of Hu et al. 2021, with Levenberg-Marquardt from each starting value.

In the plane of a ball two circles show the deflections: a contact is deflected by as much as the ball's centre is outside of
its circle. O1 has its centre at the centre of curvature of the outer groove and the radius (f_o - 1/2) D. O2 has its centre
at that of the inner groove and the radius (f_i - 1/2) D. Unloaded and without clearance O2 becomes O3, which touches O1.

The search starts at the point of contact with an undisplaced ring. It goes along the common tangent towards smaller
outer contact angles. There it is outside both circles (rule b) and on the right side of the line of centres (rule c). Then
it goes outward along the perpendicular of the tangent.

The paper does not state the step. Here it is 0.1 of the radius of O1: one step along the tangent turns the outer contact
angle by 0.1 rad. Ten steps cover all effects of speed on an angle of up to 45 deg. At the point of contact neither contact
is loaded. The Jacobian is zero there unless interference or a prescribed displacement presses the rings together, so the
first search fails.

Rule a demands deflections above 0. As printed it refuses valid equilibria in which some balls are unloaded, with or without
a centrifugal force. They are accepted unless ``strict``.

Levenberg-Marquardt solves all equations, with Armijo's rule as in section 3.2.2 of the paper:

    d = -(J'J + mu E)^-1 J'F,  mu = ||F||,  x <- x + b^m d,
    b^m the first for which f(x + b^m d) <= f(x) + w b^m (J'F)'d,
    f = ||F||^2/2.

mu compares N with (N/mm)^2, so the method depends on the unit of length. The paper uses mm, here ``length_unit``. b, w and
the limits are not in the paper: they are those of the routine in its reference 33 (Ma 2010), whose steps it prints.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry, routine
from rbdyn.quasistatic.full_system import Stop, System, forces, move, rival
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import OK, Solution
from rbdyn.quasistatic.row.newton import ACCEPTED, copy, eliminate
from rbdyn.quasistatic.row.ring import Row, groove_centre

CONVERGED, STATIONARY, NO_DESCENT, NOT_FINITE, EXHAUSTED = range(5)
SENTENCES = {
    STATIONARY: "ended at a minimum of the residuals that is no equilibrium",
    NO_DESCENT: "found no step that reduces the residuals",
    NOT_FINITE: "met forces that are not finite",
    EXHAUSTED: "used up its iterations",
}


class Damping(NamedTuple):
    """Settings of Levenberg-Marquardt: ``backtrack`` b, ``decrease`` w, ``backtracks`` the largest m.

    ``iterations``: from one start; ``length_unit`` [m]; ``stationary``: ||J'F|| over ||J|| ||F|| below which ||F|| is at a
    minimum other than zero.
    """

    backtrack: float = 0.55
    decrease: float = 0.4
    backtracks: int = 20
    iterations: int = 100
    length_unit: float = 1e-3
    stationary: float = 1e-12


@routine
def levenberg_marquardt(control: Any, system: Any, damping: Any, limit: int, u: Any) -> tuple[int, int, float]:
    """Minimise ||F|| from ``u``, which ends at the best point, in at most ``limit`` iterations.

    Returns the outcome, the iterations and the largest residual [N].
    """
    size = u.size
    residual, jacobian = np.zeros(size), np.zeros((size, size))
    trial, ahead, ahead_jacobian = np.zeros(size), np.zeros(size), np.zeros((size, size))
    worst, largest = forces(control, system, u, residual, jacobian)
    for iteration in range(limit):
        if not math.isfinite(worst):
            return NOT_FINITE, iteration, worst
        if worst <= ACCEPTED * largest:
            return CONVERGED, iteration, worst
        length = math.sqrt(np.sum(residual * residual))
        gradient = np.dot(jacobian.T, residual)
        slope = math.sqrt(np.sum(gradient * gradient))
        if slope <= damping.stationary * math.sqrt(np.sum(jacobian * jacobian)) * length:
            return STATIONARY, iteration, worst
        normal = np.dot(jacobian.T, jacobian)
        for i in range(size):
            normal[i, i] += length / (damping.length_unit * damping.length_unit)
        step = -gradient
        if not eliminate(normal, step, size, 0.0):
            return NO_DESCENT, iteration, worst
        along = np.sum(gradient * step)
        scale, better = 1.0, False
        for _ in range(damping.backtracks):
            for i in range(size):
                trial[i] = u[i] + scale * step[i]
            ahead_worst, ahead_largest = forces(control, system, trial, ahead, ahead_jacobian)
            if 0.5 * np.sum(ahead * ahead) <= 0.5 * length * length + damping.decrease * scale * along:
                better = True
                break
            scale *= damping.backtrack
        if not better:
            return NO_DESCENT, iteration, worst
        move(trial, u)
        move(ahead, residual)
        copy(ahead_jacobian, jacobian)
        worst, largest = ahead_worst, ahead_largest
    return (CONVERGED if worst <= ACCEPTED * largest else EXHAUSTED), limit, worst


UNLOADED_BALLS = 5  # an outcome of the search, next to those of Levenberg-Marquardt
ENDS = {**SENTENCES, UNLOADED_BALLS: "found unloaded balls, which rule a refuses"}


class Search(NamedTuple):
    """Settings of the search: ``step`` over the radius of O1, number of steps ``along`` the tangent and ``outward``."""

    step: float = 0.1
    along: int = 10
    outward: int = 10


SEARCH, DAMPING = Search(), Damping()


def search_points(row: Row, search: Search = SEARCH) -> Array:
    """Starting positions (searches, Z, 2) of the balls [m], in the order of the searches."""
    size = np.hypot(row.axial, row.radial)
    out = np.stack((row.axial, row.radial), axis=1) / size[:, np.newaxis]
    # A quarter turn from ``out``: the axial component falls, the radial one rises.
    tangent = np.stack((-out[:, 1], out[:, 0]), axis=1)
    radius = row.outer_reach[:, np.newaxis]
    steps = [(float(k), 0.0) for k in range(search.along + 1)]
    steps += [(float(search.along), float(k)) for k in range(1, search.outward + 1)]
    return np.array([radius * (out + search.step * (k * tangent + m * out)) for k, m in steps])


@entry
def _search(
    control: Any, system: Any, damping: Any, points: Any, limit: int, strict: bool, u: Any
) -> tuple[int, int, int, float]:
    """Search from the ``points`` in turn, with ``limit`` iterations in all; ``u`` ends at the solution or the best point.

    Returns the last outcome, the searches, the iterations and the largest residual [N] there.
    """
    z = system.row.cosine.size
    best, least = u.copy(), math.inf
    outcome, searches, iterations = EXHAUSTED, 0, 0
    for n in range(points.shape[0]):
        if iterations >= limit:
            break
        searches += 1
        for j in range(z):
            u[2 * j], u[2 * j + 1] = points[n, j, 0], points[n, j, 1]
        u[2 * z :] = 0.0
        allowed = min(damping.iterations, limit - iterations)
        outcome, steps, worst = levenberg_marquardt(control, system, damping, allowed, u)
        iterations += steps
        if outcome == CONVERGED:
            if not strict or loaded(system, u):
                return CONVERGED, searches, iterations, worst
            outcome = UNLOADED_BALLS
        if worst < least:
            least = worst
            move(u, best)
    move(best, u)
    return outcome, searches, iterations, least


@entry
def loaded(system: Any, u: Any) -> bool:
    """Rule a: whether all deflections are above 0."""
    row = system.row
    z = row.cosine.size
    q = system.displacement.copy()
    for k in range(system.free.size):
        q[system.free[k]] = u[2 * z + k]
    for j in range(z):
        a_axial, a_radial = groove_centre(row, q, j)
        x, y = u[2 * j], u[2 * j + 1]
        inner = math.hypot(a_axial - x, a_radial - y) - row.inner_reach[j]
        outer = math.hypot(x, y) - row.outer_reach[j]
        if not (inner > 0.0 and outer > 0.0):
            return False
    return True


@rival
def solve(
    control: Control,
    system: System,
    start: Solution | None,
    search: Search = SEARCH,
    damping: Damping = DAMPING,
    strict: bool = False,
    limit: int | None = None,
) -> Stop:
    """The finite search with at most ``limit`` iterations in all, first from the balls of a ``start``."""
    points = search_points(system.row, search)
    if start is not None:
        points = np.concatenate((start.balls[np.newaxis, :, :2], points))
    u = np.zeros(system.size)
    most = damping.iterations * len(points) if limit is None else limit
    outcome, searches, iterations, residual = _search(control, system, damping, points, most, strict, u)
    status = OK if outcome == CONVERGED else f"none of {searches} searches converged; the last {ENDS[outcome]}"
    return Stop(u, status, iterations, residual, searches)
