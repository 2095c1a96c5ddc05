"""Equilibrium at every step of a path of balls, each from the one before: the compiled loop."""

from __future__ import annotations

from typing import Any

from rbdyn.compiled.kernel import entry
from rbdyn.quasistatic.row.ball import spring
from rbdyn.quasistatic.row.newton import ASSEMBLIES, CONVERGED, STEPS, find, unbalance
from rbdyn.quasistatic.row.ring import INNER_DEPTH, LOADED, OUTER_DEPTH, RING

# What a walk counts: Newton steps and evaluations of all balls.
WALKED = 2
# Columns of what it tells of a step.
LARGEST_LOAD, RESIDUAL, TOLD = range(3)


@entry
def walk(
    control: Any,
    row: Any,
    load: Any,
    free: Any,
    changes: Any,
    q: Any,
    balls: Any,
    at: Any,
    counts: Any,
    path: Any,
    told: Any,
    walked: Any,
) -> int:
    """Fill ``path`` (steps, 5) and ``told`` (steps, TOLD); returns how many steps found their equilibrium.

    ``row`` is written over: ``changes`` holds its six arrays at each step, (6, steps, Z) in the order of ``Row``. ``load``
    and ``q`` count tilts over the lever, ``free, balls, at, counts`` are as of ``newton.find``.
    """
    steps, size = path.shape[0], row.cosine.size
    for step in range(steps):
        for j in range(size):
            row.cosine[j], row.sine[j] = changes[0, step, j], changes[1, step, j]
            row.axial[j], row.radial[j] = changes[2, step, j], changes[3, step, j]
            row.inner_reach[j], row.outer_reach[j] = changes[4, step, j], changes[5, step, j]
        counts[:] = 0
        outcome = find(control, row, load, free, step > 0, q, balls, at, counts)
        walked[0] += counts[STEPS]
        walked[1] += counts[ASSEMBLIES]
        if outcome != CONVERGED:
            return step
        for i in range(RING):
            path[step, i] = q[i]
        largest = row.centrifugal_force
        for j in range(size):
            inner, _ = spring(balls[j, INNER_DEPTH], row.inner_stiffness)
            outer, _ = spring(balls[j, OUTER_DEPTH], row.outer_stiffness)
            if at.work[j, LOADED] > 0.0:
                largest = max(largest, inner, outer)
        told[step, LARGEST_LOAD] = largest
        _, told[step, RESIDUAL] = unbalance(load, free, at.sums)
    return steps
