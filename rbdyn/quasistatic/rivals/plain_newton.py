"""Newton's method on all equations, undamped, from the unloaded geometry: the textbook way, for comparison.

It converges from near enough and not otherwise. Harris (Rolling Bearing Analysis) and Jones 1960 leave the first guess to
experience.
"""

import math
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.rivals.full_system import Stop, System, forces, move, rival, unknowns
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import OK, Solution
from rbdyn.quasistatic.row.newton import ACCEPTED, eliminate, settle_all, space
from rbdyn.quasistatic.row.ring import component_lengths

STEPS = 100
# Unloaded contacts have no stiffness, so that Newton's method cannot begin where nothing is pressed: the ring is pushed
# by this share of the distance of the groove centres, along its load.
SEAT = 1e-3
CONVERGED, SINGULAR, NOT_FINITE, EXHAUSTED = range(4)
SENTENCES = {
    SINGULAR: "plain Newton stopped: its matrix became singular, for some ball or the ring was held by nothing",
    NOT_FINITE: "plain Newton ran away: its steps grew until forces were no longer finite",
    EXHAUSTED: "plain Newton did not converge in {limit} steps",
}


@entry
def iterate(control: Any, system: Any, limit: int, u: Any) -> tuple[int, int, float]:
    """Newton's method from ``u``, which it leaves where the residual was least.

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
    """Unknowns of the unloaded geometry: the ring where it just touches, seated by a hair along its load, and every ball
    where it rests for this ring, orbiting with the cage."""
    row, at = system.row, space(system.row.cosine.size)
    at.q[:] = system.held
    pull = system.load[system.free]
    length = float(np.linalg.norm(pull))
    if length > 0.0:
        at.q[system.free] += SEAT * float(row.inner_reach[0] + row.outer_reach[0]) * pull / length
    _rest_balls(row, at)
    return unknowns(system, at.q, at.balls)


@entry
def _rest_balls(row: Any, at: Any) -> None:
    """``settle_all``, called from Python."""
    settle_all(row, at)


@rival
def solve(control: Control, system: System, start: Solution | None, limit: int = STEPS) -> Stop:
    """Plain Newton in at most ``limit`` steps, from a ``start`` or the unloaded geometry."""
    if start is None:
        u = unloaded(system)
    else:
        u = unknowns(system, start.displacement * component_lengths(system.row.lever), start.balls)
    outcome, steps, residual = iterate(control, system, limit, u)
    status = OK if outcome == CONVERGED else SENTENCES[outcome].format(limit=limit)
    return Stop(u, status, steps, residual)
