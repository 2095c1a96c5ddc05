"""The undamped Newton method of textbooks on all equations of a row, from the unloaded geometry.

It converges only from a start near the solution; Harris (Rolling Bearing Analysis) and Jones (1960) leave the first guess to
experience.
"""

import math
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.full_system import Stop, System, forces, move, rival, unknowns
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import OK, Solution
from rbdyn.quasistatic.row.newton import ACCEPTED, eliminate, settle_all, space
from rbdyn.quasistatic.row.ring import component_lengths

MOST_STEPS = 100
# Unloaded contacts have no stiffness, so the start pushes the ring along its load by this share of the distance of the
# groove centres.
SEAT = 1e-3
CONVERGED, SINGULAR, NOT_FINITE, EXHAUSTED = range(4)
SENTENCES = {
    SINGULAR: "plain Newton stopped: its matrix became singular, because no contact supports a ball or the ring",
    NOT_FINITE: "plain Newton diverged: its steps grew until the forces were not finite",
    EXHAUSTED: "plain Newton did not converge in {limit} steps",
}


@entry
def iterate(control: Any, system: Any, limit: int, u: Any) -> tuple[int, int, float]:
    """Newton's method from ``u``, which ends at the point of the least residual.

    Returns the outcome, the steps and the largest residual [N] there.
    """
    size = u.size
    residual, jacobian, best = np.zeros(size), np.zeros((size, size)), u.copy()
    worst, largest = forces(control, system, u, residual, jacobian)
    least = worst
    for step in range(limit):
        if worst <= ACCEPTED * largest:
            return CONVERGED, step, worst
        if not eliminate(jacobian, residual, size, 0.0):
            move(best, u)
            return SINGULAR, step, least
        for i in range(size):
            u[i] -= residual[i]
        worst, largest = forces(control, system, u, residual, jacobian)
        if not math.isfinite(worst) or not math.isfinite(largest):
            move(best, u)
            return NOT_FINITE, step + 1, least
        if worst < least:
            least = worst
            move(u, best)
    outcome = CONVERGED if worst <= ACCEPTED * largest else EXHAUSTED
    if outcome == EXHAUSTED:
        move(best, u)
        worst = least
    return outcome, limit, worst


def unloaded(system: System) -> Array:
    """Unknowns of the unloaded geometry: the ring pushed by the share ``SEAT`` along its load, every ball at rest there.

    The balls orbit with the cage.
    """
    row, state = system.row, space(system.row.cosine.size)
    state.q[:] = system.displacement
    pull = system.load[system.free]
    length = float(np.linalg.norm(pull))
    if length > 0.0:
        state.q[system.free] += SEAT * float(row.inner_reach[0] + row.outer_reach[0]) * pull / length
    _rest_balls(row, state)
    return unknowns(system, state.q, state.balls)


@entry
def _rest_balls(row: Any, state: Any) -> None:
    """``settle_all``, called from Python."""
    settle_all(row, state)


@rival
def plain_newton(control: Control, system: System, start: Solution | None, limit: int = MOST_STEPS) -> Stop:
    """Plain Newton in at most ``limit`` steps, from a ``start`` or the unloaded geometry."""
    if start is None:
        u = unloaded(system)
    else:
        u = unknowns(system, start.displacement * component_lengths(system.row.lever), start.balls)
    outcome, steps, residual = iterate(control, system, limit, u)
    status = OK if outcome == CONVERGED else SENTENCES[outcome].format(limit=limit)
    return Stop(u, status, steps, residual)
