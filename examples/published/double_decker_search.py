"""The finite search of Hu et al. 2021 on a double-decker bearing: the 4Z + 4 equations of both rows at once.

Unknowns and residuals are those of ``full_system``, first of the inner row, then of the outer row. The inner ring's position is
relative to the middle ring, and the inner balls load the middle ring (eqs 11 and 12). Each start takes the next search point of both
rows, and Levenberg-Marquardt with Armijo's rule solves all equations from there. As in the paper, rings neither tilt nor move
sideways.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.double_decker import Stack
from rbdyn.quasistatic.finite_search import (
    CONVERGED,
    DAMPING,
    EXHAUSTED,
    NO_DESCENT,
    NOT_FINITE,
    SEARCH,
    SENTENCES,
    STATIONARY,
    Damping,
    Search,
    search_points,
)
from rbdyn.quasistatic.full_system import Stop, System, evaluate, solution_at, system_of
from rbdyn.quasistatic.row.ball import ball_forces, deflection
from rbdyn.quasistatic.row.equilibrium import OK, Solution
from rbdyn.quasistatic.row.newton import ACCEPTED
from rbdyn.quasistatic.row.ring import groove_centre

# Only x and z of the rings are free.
SQUARE = np.array([math.nan, 0.0, math.nan, 0.0, 0.0])
# Step of the central differences of the load on the middle ring, over the distance of a ball from its outer groove centre.
DIFFERENCE = 1e-6
# Residual [N], its derivative [N/m], and the largest force [N].
Evaluation = tuple[Array, Array, float]


class SearchEnd(NamedTuple):
    """End of the search: both rows, status "ok" or the cause of the failure, number of searches and ``steps`` of all.

    ``residual``: largest one [N]. ``offsets`` (search points,): distance of each start from the end [m] (eq 19).
    """

    inner: Solution
    outer: Solution
    status: str
    searches: int
    steps: int
    residual: float
    offsets: Array


@entry
def groove_forces(control: Any, row: Any, q: Any, balls: Any, out: Any) -> None:
    """Fill ``out`` (Z, 2) by the force (axial, radial) [N] of each ball of ``balls`` (2 Z,) on its outer groove.

    It is the force of the inner ring plus the centrifugal force less the residual of the ball.
    """
    for j in range(row.cosine.size):
        a_axial, a_radial = groove_centre(row, q, j)
        x, y = balls[2 * j], balls[2 * j + 1]
        inner = deflection(a_axial - x, a_radial - y, row.inner_reach[j])
        outer = deflection(x, y, row.outer_reach[j])
        (ra, rr), (fa, fr, _), _, _, _, _, pull, _ = ball_forces(
            control, 1.0, row, a_axial, a_radial, x, y, inner, outer
        )
        out[j, 0], out[j, 1] = fa - ra, fr + pull - rr


def _on_middle_ring(control: Any, system: System, u: Array) -> Array:
    """Load (x, z) [N] of each ball of the inner row on the middle ring, (Z, 2)."""
    row, z = system.row, system.row.cosine.size
    q = system.displacement.copy()
    q[system.free] = u[2 * z :]
    forces = np.empty((z, 2))
    groove_forces(control, row, q, np.ascontiguousarray(u[: 2 * z]), forces)
    return np.stack((forces[:, 1] * row.cosine, forces[:, 0]), axis=1)


def _middle_slopes(control: Any, system: System, u: Array) -> Array:
    """Derivative (2, n) [N/m] of the load on the middle ring, by central differences.

    A ball's force depends only on its own position and the ring's, so all balls move at once.
    """
    z = system.row.cosine.size
    step = DIFFERENCE * float(system.row.outer_reach[0])
    slopes = np.zeros((2, u.size))
    for axis in range(2):
        moved = np.zeros_like(u)
        moved[axis : 2 * z : 2] = step
        ends = [_on_middle_ring(control, system, u + side * moved) for side in (1.0, -1.0)]
        slopes[:, axis : 2 * z : 2] = (ends[0] - ends[1]).T / (2.0 * step)
    for place in range(2 * z, u.size):
        moved = np.zeros_like(u)
        moved[place] = step
        ends = [_on_middle_ring(control, system, u + side * moved).sum(axis=0) for side in (1.0, -1.0)]
        slopes[:, place] = (ends[0] - ends[1]) / (2.0 * step)
    return slopes


def _rows(stack: Stack, load: Array) -> tuple[System, System]:
    """Systems of both rows, the outer one without its load."""
    return system_of(stack.inner.row, load, SQUARE), system_of(stack.outer.row, np.zeros(5), SQUARE)


def equations(stack: Stack, load: Array) -> Callable[[Array], Evaluation]:
    """All equations of a stack under a ``load`` (5,) on its inner ring, as a function of all unknowns [m]."""
    inner, outer = _rows(stack, load)
    first = inner.size

    def evaluation(u: Array) -> Evaluation:
        residual, jacobian = np.zeros(u.size), np.zeros((u.size, u.size))
        largest = 0.0
        for layer, system, place in ((stack.inner, inner, 0), (stack.outer, outer, first)):
            part, slopes = np.zeros(system.size), np.zeros((system.size, system.size))
            mine = slice(place, place + system.size)
            _, force = evaluate(layer.control, system, np.ascontiguousarray(u[mine]), part, slopes)
            residual[mine], jacobian[mine, mine] = part, slopes
            largest = max(largest, force)
        onto = np.ascontiguousarray(u[:first])
        residual[-2:] += _on_middle_ring(stack.inner.control, inner, onto).sum(axis=0)
        jacobian[-2:, :first] = _middle_slopes(stack.inner.control, inner, onto)
        return residual, jacobian, largest

    return evaluation


def minimise(
    evaluation: Callable[[Array], Evaluation], u: Array, damping: Damping = DAMPING, limit: int | None = None
) -> tuple[int, int, float, Array]:
    """``levenberg_marquardt`` on any equations: outcome, iterations, largest residual [N] and the unknowns at the end."""
    residual, jacobian, largest = evaluation(u)
    count = damping.iterations if limit is None else limit
    for iteration in range(count):
        worst = float(np.abs(residual).max())
        if not math.isfinite(worst):
            return NOT_FINITE, iteration, worst, u
        if worst <= ACCEPTED * largest:
            return CONVERGED, iteration, worst, u
        length = float(np.linalg.norm(residual))
        gradient = jacobian.T @ residual
        if np.linalg.norm(gradient) <= damping.stationary * np.linalg.norm(jacobian) * length:
            return STATIONARY, iteration, worst, u
        normal = jacobian.T @ jacobian + np.eye(u.size) * length / damping.length_unit**2
        step = -np.linalg.solve(normal, gradient)
        along, scale = float(gradient @ step), 1.0
        for _ in range(damping.backtracks):
            ahead = evaluation(u + scale * step)
            if 0.5 * float(ahead[0] @ ahead[0]) <= 0.5 * length * length + damping.decrease * scale * along:
                break
            scale *= damping.backtrack
        else:
            return NO_DESCENT, iteration, worst, u
        u, (residual, jacobian, largest) = u + scale * step, ahead
    worst = float(np.abs(residual).max())
    return (CONVERGED if worst <= ACCEPTED * largest else EXHAUSTED), count, worst, u


def solve(stack: Stack, load: Array, search: Search = SEARCH, damping: Damping = DAMPING) -> SearchEnd:
    """The search on a stack under a ``load`` (5,) [N, N m] on its inner ring; unloaded balls are accepted."""
    inner, outer = _rows(stack, np.asarray(load, float))
    evaluation = equations(stack, np.asarray(load, float))
    points = [search_points(layer.row, search) for layer in (stack.inner, stack.outer)]
    best, least = np.zeros(inner.size + outer.size), math.inf
    outcome, searches, steps = EXHAUSTED, 0, 0
    for starts in zip(*points, strict=True):
        searches += 1
        parts = [np.concatenate((start.ravel(), np.zeros(2))) for start in starts]
        outcome, iterations, worst, u = minimise(evaluation, np.concatenate(parts), damping)
        steps += iterations
        if worst < least:
            best, least = u, worst
        if outcome == CONVERGED:
            best, least = u, worst
            break
    status = OK if outcome == CONVERGED else f"none of {searches} searches converged; the last {SENTENCES[outcome]}"
    below, above = best[: inner.size], best[inner.size :]
    push = _on_middle_ring(stack.inner.control, inner, np.ascontiguousarray(below)).sum(axis=0)
    carrying = system_of(stack.outer.row, np.array([push[0], 0.0, push[1], 0.0, 0.0]), SQUARE)
    end = Stop(below, status, steps, least)
    ends = (
        solution_at(stack.inner.control, inner, end),
        solution_at(stack.outer.control, carrying, end._replace(u=above)),
    )
    starts_of_all = np.concatenate(points, axis=1).mean(axis=1)
    places = np.concatenate([part[:-2].reshape(-1, 2) for part in (below, above)]).mean(axis=0)
    offsets = np.linalg.norm(starts_of_all - places, axis=1)
    return SearchEnd(*ends, status, searches, steps, least, offsets)
