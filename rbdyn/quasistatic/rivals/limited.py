"""The convex solver stopped after so many Newton steps: how its residual falls, for comparison with its rivals."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.rivals.full_system import evaluate, solution_at, system_of, unknowns
from rbdyn.quasistatic.row.ball import rules
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.equilibrium import OK, Solution
from rbdyn.quasistatic.row.newton import (
    ASSEMBLIES,
    CONVEX_MARCH,
    COUNTERS,
    STEPS,
    descend,
    go_back,
    march,
    roughly,
    space,
)
from rbdyn.quasistatic.row.ring import BALL, RING
from rbdyn.quasistatic.row.row import Row
from rbdyn.quasistatic.row.start import along_the_load, settle_all


@entry
def _within(control: Any, row: Any, load: Any, free: Any, limit: int, q: Any, balls: Any, at: Any, counts: Any) -> bool:
    """The usual way of ``newton.find`` in ``limit`` steps; whether they were enough."""
    along_the_load(row, load, free, q, at.step, at.base)
    settle_all(row, q, balls, at.work)
    start_q, start = q.copy(), balls.copy()
    enough = roughly(load, free) if rules(control) else 0.0
    found = march(control, 0.0, enough, min(limit, CONVEX_MARCH), row, load, free, q, balls, at, counts)
    if not found and limit > counts[STEPS]:
        go_back(q, balls, start_q, start)
        found = descend(control, 0.0, True, limit - counts[STEPS], row, load, free, q, balls, at, counts)
    if not found or not rules(control):
        return found
    return march(control, 1.0, 0.0, limit - counts[STEPS], row, load, free, q, balls, at, counts)


def solve(
    row: Row,
    control: Control,
    load: NDArray[np.float64],
    given: NDArray[np.float64] | None = None,
    start: Solution | None = None,
    limit: int = 1000,
) -> Solution:
    """As ``equilibrium.solve`` in at most ``limit`` steps, without continuation. ``start`` is not used."""
    system = system_of(row, load, given)
    at, counts = space(row.cosine.size), np.zeros(COUNTERS, np.int64)
    q, balls, free = system.held.copy(), np.zeros((row.cosine.size, BALL)), np.zeros(RING)
    free[system.free] = 1.0
    found = _within(control, row, system.load, free, limit, q, balls, at, counts)
    u = unknowns(system, q, balls)
    worst, _ = evaluate(control, system, u, np.zeros(system.size), np.zeros((system.size, system.size)))
    status = OK if found else f"not converged in {limit} steps"
    return solution_at(control, system, u, status, int(counts[STEPS]), int(counts[ASSEMBLIES]), worst)
