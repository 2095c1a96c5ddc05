"""The convex solver stopped after so many Newton steps: how its residual falls, for comparison with its rivals."""

from typing import Any

import numpy as np

from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.rivals.full_system import Stop, System, evaluate, rival, unknowns
from rbdyn.quasistatic.row.ball import Control, rules
from rbdyn.quasistatic.row.equilibrium import OK
from rbdyn.quasistatic.row.newton import CONVEX_MARCH, STEPS, Task, descend, go_to, march, roughly, space, start_afresh
from rbdyn.quasistatic.row.ring import RING


@entry
def _within(task: Any, limit: int, at: Any) -> bool:
    """The usual way of ``newton.find`` in ``limit`` steps; whether they were enough."""
    start_afresh(task, at)
    q, balls = at.q.copy(), at.balls.copy()
    enough = roughly(task) if rules(task.control) else 0.0
    arrived = march(task, 0.0, enough, min(limit, CONVEX_MARCH), at)
    if not arrived and limit > at.counts[STEPS]:
        go_to(q, balls, at.q, at.balls)
        arrived = descend(task, 0.0, True, limit - at.counts[STEPS], at)
    if not arrived or not rules(task.control):
        return arrived
    return march(task, 1.0, 0.0, limit - at.counts[STEPS], at)


@rival
def solve(control: Control, system: System, start: None, limit: int = 1000) -> Stop:
    """The convex solver in at most ``limit`` steps, without continuation; a ``start`` is not used."""
    at, free = space(system.row.cosine.size), np.zeros(RING)
    at.q[:], free[system.free] = system.held, 1.0
    arrived = _within(Task(control, system.row, system.load, free), limit, at)
    u = unknowns(system, at.q, at.balls)
    worst, _ = evaluate(control, system, u, np.zeros(system.size), np.zeros((system.size, system.size)))
    status = OK if arrived else f"not converged in {limit} steps"
    return Stop(u, status, int(at.counts[STEPS]), worst)
