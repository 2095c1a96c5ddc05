"""Equilibrium at every step of a path of balls, each from the one before: the compiled loop."""

from typing import Any

from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.row.ball import spring
from rbdyn.quasistatic.row.newton import CONVERGED, STEPS, find
from rbdyn.quasistatic.row.ring import INNER_DEPTH, LOADED, OUTER_DEPTH, RING, unbalance

# Figures of a step.
LARGEST_LOAD, RESIDUAL, FIGURES = range(3)


@entry
def walk(task: Any, changes: Any, at: Any, path: Any, figures: Any) -> tuple[int, int]:
    """Fill ``path`` (steps, 5) and ``figures`` (steps, FIGURES); returns how many of the steps found their
    equilibrium, and the Newton steps of all.

    ``task.row`` is written over: ``changes`` holds its six arrays at each step, (6, steps, Z) in the order of ``Row``; ``at``
    is as of ``newton.find``.
    """
    row, newton_steps = task.row, 0
    steps, size = path.shape[0], row.cosine.size
    for step in range(steps):
        for j in range(size):
            row.cosine[j], row.sine[j] = changes[0, step, j], changes[1, step, j]
            row.axial[j], row.radial[j] = changes[2, step, j], changes[3, step, j]
            row.inner_reach[j], row.outer_reach[j] = changes[4, step, j], changes[5, step, j]
        at.counts[:] = 0
        outcome = find(task, step > 0, at)
        newton_steps += at.counts[STEPS]
        if outcome != CONVERGED:
            return step, newton_steps
        for i in range(RING):
            path[step, i] = at.q[i]
        largest = row.centrifugal_force
        for j in range(size):
            inner, _ = spring(at.balls[j, INNER_DEPTH], row.inner_stiffness)
            outer, _ = spring(at.balls[j, OUTER_DEPTH], row.outer_stiffness)
            if at.work[j, LOADED] > 0.0:
                largest = max(largest, inner, outer)
        figures[step, LARGEST_LOAD] = largest
        _, figures[step, RESIDUAL] = unbalance(task, at)
    return steps, newton_steps
