"""Newton's method on all equations, undamped, from the unloaded geometry: the textbook way, for comparison.

It converges from near enough and not otherwise. Harris (Rolling Bearing Analysis) and Jones 1960 leave the first guess to
experience.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.rivals.elimination import eliminate
from rbdyn.quasistatic.rivals.full_system import System, forces, solution_at, system_of, unknowns
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.equilibrium import OK, Solution
from rbdyn.quasistatic.row.newton import ACCEPTED
from rbdyn.quasistatic.row.ring import BALL, BALL_WORK
from rbdyn.quasistatic.row.row import Row, component_lengths
from rbdyn.quasistatic.row.start import settle_all

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
def iterate(control: Any, system: Any, limit: int, u: Any) -> tuple[int, int, int, float]:
    """Newton's method from ``u``, which it leaves where the residual was least.

    Returns the outcome, the steps, the evaluations and the largest residual [N] there.
    """
    size = u.size
    residual, jacobian, best = np.zeros(size), np.zeros((size, size)), u.copy()
    worst, largest = forces(control, system, u, residual, jacobian)
    least = worst
    for step in range(limit):
        if worst <= ACCEPTED * largest:
            return CONVERGED, step, step + 1, worst
        if not eliminate(jacobian, residual):
            u[:] = best
            return SINGULAR, step, step + 1, least
        for i in range(size):
            u[i] -= residual[i]
        worst, largest = forces(control, system, u, residual, jacobian)
        if not math.isfinite(worst) or not math.isfinite(largest):
            u[:] = best
            return NOT_FINITE, step + 1, step + 2, least
        if worst < least:
            least = worst
            best[:] = u
    outcome = CONVERGED if worst <= ACCEPTED * largest else EXHAUSTED
    if outcome == EXHAUSTED:
        u[:] = best
        worst = least
    return outcome, limit, limit + 1, worst


def unloaded(system: System) -> NDArray[np.float64]:
    """Unknowns of the unloaded geometry: the ring where it just touches, seated by a hair along its load, and every ball
    where it rests for this ring, orbiting with the cage."""
    row, q = system.row, system.held.copy()
    pull = system.load[system.free]
    length = float(np.linalg.norm(pull))
    if length > 0.0:
        q[system.free] += SEAT * float(row.inner_reach[0] + row.outer_reach[0]) * pull / length
    balls = np.zeros((row.cosine.size, BALL))
    rest_balls(row, q, balls, np.zeros((row.cosine.size, BALL_WORK)))
    return unknowns(system, q, balls)


@entry
def rest_balls(row: Any, q: Any, balls: Any, work: Any) -> None:
    """Settle the balls for the ring at ``q``."""
    settle_all(row, q, balls, work)


def solve(
    row: Row,
    control: Control,
    load: NDArray[np.float64],
    given: NDArray[np.float64] | None = None,
    start: Solution | None = None,
    limit: int = STEPS,
) -> Solution:
    """As ``equilibrium.solve``, by plain Newton in at most ``limit`` steps. Never raises: see ``status``."""
    system = system_of(row, load, given)
    u = unloaded(system) if start is None else _from(system, start)
    outcome, steps, evaluations, residual = iterate(control, system, limit, u)
    status = OK if outcome == CONVERGED else SENTENCES[outcome].format(limit=limit)
    return solution_at(control, system, u, status, steps, evaluations, residual)


def _from(system: System, start: Solution) -> NDArray[np.float64]:
    lever = system.row.lever
    return unknowns(system, start.displacement * component_lengths(lever), start.balls)
