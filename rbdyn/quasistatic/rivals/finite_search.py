"""The finite search for starting values of Hu et al. 2021, each tried by Levenberg-Marquardt.

In the plane of a ball the deflections are what its centre lies outside of two circles: O1 about the centre of curvature of
the outer groove, of radius (f_o - 1/2) D, and O2 about that of the inner groove, of radius (f_i - 1/2) D. Unloaded and
without clearance O2 becomes O3, which touches O1. The search begins where they touch, goes along their tangent towards
smaller outer contact angles, where it stays outside both (rule b) and on the right side of the line of centres (rule c),
and then outward along the tangent's perpendicular. The ring always starts undisplaced.

How far a search goes at a time is not in the paper. Here a step is a share of the radius of O1, 0.1: one step along the
tangent turns the outer contact angle by 0.1 rad, and ten sweep all that speed can do to one of up to 45 deg.

Where the circles touch neither contact is loaded: unless interference or a prescribed displacement presses the rings
together, the Jacobian is zero there and the first search leads nowhere.

Rule a asks that all deflections end above 0. As printed it refuses equilibria in which some balls are unloaded, which
are lawful: a ball that only its centrifugal force holds, or none. They are accepted unless ``strict``.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.rivals.full_system import Stop, System, move, rival
from rbdyn.quasistatic.rivals.levenberg_marquardt import CONVERGED, EXHAUSTED, SENTENCES, Damping, levenberg_marquardt
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import OK, Solution
from rbdyn.quasistatic.row.ring import Row, groove_centre

UNLOADED_BALLS = 5  # besides the outcomes of Levenberg-Marquardt
ENDS = {**SENTENCES, UNLOADED_BALLS: "found unloaded balls, which rule a refuses"}


class Search(NamedTuple):
    """``step``: of the search, over the radius of O1; ``along, outward``: steps along the tangent and its perpendicular."""

    step: float = 0.1
    along: int = 10
    outward: int = 10


SEARCH, DAMPING = Search(), Damping()


def search_points(row: Row, search: Search = SEARCH) -> Array:
    """Starting places (searches, Z, 2) of the balls [m], in the order in which they are tried."""
    size = np.hypot(row.axial, row.radial)
    out = np.stack((row.axial, row.radial), axis=1) / size[:, np.newaxis]
    # A quarter turn from out: axial falls and radial rises.
    tangent = np.stack((-out[:, 1], out[:, 0]), axis=1)
    radius = row.outer_reach[:, np.newaxis]
    steps = [(float(k), 0.0) for k in range(search.along + 1)]
    steps += [(float(search.along), float(k)) for k in range(1, search.outward + 1)]
    return np.array([radius * (out + search.step * (k * tangent + m * out)) for k, m in steps])


def offset_distances(points: Array, balls: Array) -> Array:
    """Distance [m] of the mean of each set of starting places from the mean place of the ``balls`` found (eq 19)."""
    return np.asarray(np.linalg.norm(points.mean(axis=1) - balls[:, :2].mean(axis=0), axis=1))


@entry
def _search(
    control: Any, system: Any, damping: Any, points: Any, limit: int, strict: bool, u: Any
) -> tuple[int, int, int, float]:
    """Try ``points`` one after the other, ``limit`` iterations in all; ``u`` is left at the solution or the best point.

    Returns the last outcome, the searches, the iterations and the largest residual [N] there.
    """
    row = system.row
    z = row.cosine.size
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
        outcome, taken, worst = levenberg_marquardt(control, system, damping, allowed, u)
        iterations += taken
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
    q = system.held.copy()
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
    """The search, at most ``limit`` iterations in all; the balls of a ``start`` are tried first."""
    points = search_points(system.row, search)
    if start is not None:
        points = np.concatenate((start.balls[np.newaxis, :, :2], points))
    u = np.zeros(system.size)
    most = damping.iterations * len(points) if limit is None else limit
    outcome, searches, iterations, residual = _search(control, system, damping, points, most, strict, u)
    status = OK if outcome == CONVERGED else f"none of {searches} searches converged; the last {ENDS[outcome]}"
    return Stop(u, status, iterations, residual, searches)
