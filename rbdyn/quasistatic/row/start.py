"""First guess: how far the ring goes along its load, and where the balls then rest."""

import math
from typing import Any

from rbdyn.compiled.kernel import kernel, routine
from rbdyn.quasistatic.row.place import groove_centre, moved_centre, settle
from rbdyn.quasistatic.row.ring import LOADED, RING, measure

FIRST_STEP = 1e-6  # [m]
LONGEST_STEP = 1.0  # [m]
# Residual over the contact loads of a ball that is good enough to start from.
START_BALANCE = 1e-2
# The start need only be of the right size.
START_ERROR = 0.1


@kernel
def force_along(row: Any, both: float, q: Any, direction: Any) -> float:
    """Force along ``direction`` of balls without centrifugal force: two Hertz springs in series, K = ``both``."""
    total = 0.0
    for j in range(row.cosine.size):
        a_axial, a_radial = groove_centre(row, q, j)
        length = math.sqrt(a_axial * a_axial + a_radial * a_radial)
        deflection = max(length - row.inner_reach[j] - row.outer_reach[j], 0.0)
        load = both * deflection * math.sqrt(deflection) / length
        axial, radial = moved_centre(row, j, direction)
        total += load * (a_axial * axial + a_radial * radial)
    return total


@kernel
def force_at(row: Any, both: float, far: float, at: Any) -> float:
    """``force_along`` with the ring at ``at.base`` + ``far`` along ``at.step``, where it is left."""
    q, base, step = at.q, at.base, at.step
    for i in range(RING):
        q[i] = base[i] + far * step[i]
    return force_along(row, both, q, step)


@routine
def along_the_load(task: Any, at: Any) -> None:
    """Move ``at.q`` from where it is along the free part of the load until the balls carry it, roughly."""
    row, direction = task.row, at.step
    length = 0.0
    for i in range(RING):
        direction[i] = task.load[i] * task.free[i]
        at.base[i] = at.q[i]
        length += direction[i] * direction[i]
    if length == 0.0:
        return
    wanted = math.sqrt(length)
    for i in range(RING):
        direction[i] /= wanted
    both = (row.inner_stiffness ** (-2.0 / 3.0) + row.outer_stiffness ** (-2.0 / 3.0)) ** -1.5
    below, above = 0.0, FIRST_STEP
    while above < LONGEST_STEP and not force_at(row, both, above, at) >= wanted:
        below, above = above, 3.0 * above
    while above - below > START_ERROR * (above - below + 0.1 * below):
        middle = 0.5 * (below + above)
        if force_at(row, both, middle, at) >= wanted:
            above = middle
        else:
            below = middle
        if above - below < 0.02 * above:
            break
    for i in range(RING):
        at.q[i] = at.base[i] + above * direction[i]


@routine
def settle_all(row: Any, at: Any) -> None:
    """Settle every ball for the ring at ``at.q``, and mark all as loaded."""
    q, balls = at.q, at.balls
    at.work[:, LOADED] = 1.0
    for j in range(row.cosine.size):
        a_axial, a_radial = groove_centre(row, q, j)
        settle(row, j, a_axial, a_radial, START_BALANCE, balls)
        measure(row, j, a_axial, a_radial, balls)
