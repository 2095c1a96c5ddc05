"""The convex solver stopped after so many Newton steps: how its residual falls, for comparison with its rivals."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.kernel import alike, entry
from rbdyn.quasistatic.control import CommonCage, Control
from rbdyn.quasistatic.equilibrium import OK, Solution
from rbdyn.quasistatic.full_system import evaluate, solution_at, system_of, unknowns
from rbdyn.quasistatic.newton import ASSEMBLIES, CONVEX_MARCH, COUNTERS, STEPS, descend, march, space
from rbdyn.quasistatic.ring import BALL, RING
from rbdyn.quasistatic.row import Row
from rbdyn.quasistatic.start import along_the_load, settle_all


@entry
def _within(
    cage: Any,
    control: Any,
    row: Any,
    load: Any,
    free: Any,
    limit: int,
    q: Any,
    balls: Any,
    at: Any,
    counts: Any,
) -> bool:
    """The way of ``newton.find`` in ``limit`` steps; whether they were enough."""
    along_the_load(row, load, free, q, at.step, at.base)
    settle_all(row, q, balls, at.work)
    start = q.copy()
    found = march(cage, 0.0, min(limit, CONVEX_MARCH), row, load, free, q, balls, at, counts)
    left = limit - counts[STEPS]
    if not found and left > 0:
        q[:] = start
        settle_all(row, q, balls, at.work)
        found = descend(cage, 0.0, True, left, row, load, free, q, balls, at, counts)
        left = limit - counts[STEPS]
    if alike(cage, control) or not found:
        return found
    return march(control, 1.0, left, row, load, free, q, balls, at, counts)


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
    found = _within(CommonCage(0.0), control, row, system.load, free, limit, q, balls, at, counts)
    u = unknowns(system, q, balls)
    worst, _ = evaluate(control, system, u, np.zeros(system.size), np.zeros((system.size, system.size)))
    status = OK if found else f"not converged in {limit} steps"
    return solution_at(control, system, u, status, int(counts[STEPS]), int(counts[ASSEMBLIES]), worst)
