"""Equilibrium from any start: the convex problem first, then the full equations.

With one common cage speed and no gyroscopic moment the equilibrium is the minimiser of a jointly convex energy in the ring's
displacement and the places of the balls: unique, and a guarded Newton reaches it from anywhere. From there Newton on the
full equations; where it fails the race control is brought in by and by. All work on a ``Task`` and leave ``at``, a ``Space``,
where they end.
"""

import math
from typing import Any

from rbdyn.compiled.kernel import kernel, routine
from rbdyn.quasistatic.row.ball import rules
from rbdyn.quasistatic.row.elimination import eliminate
from rbdyn.quasistatic.row.ring import ENERGY, LARGEST, LOADED, RING, assemble, ball_step, follow, unbalance
from rbdyn.quasistatic.row.space import COLD_STARTS, STEPS, STRIDES
from rbdyn.quasistatic.row.start import along_the_load, settle_all

# Outcomes of ``find``.
CONVERGED, NOT_CONVEX_MINIMUM, RACE_CONTROL_LOST = range(3)
# Largest residual over largest force: aimed at, and accepted where rounding allows no better.
AIM, ACCEPTED = 1e-12, 1e-9
# Residual over the load that is good enough for the convex problem where the full equations follow.
ROUGHLY = 1e-3
CONVEX_MARCH, CONVEX_STEPS, FULL_STEPS, CONTINUED_STEPS, CONTINUATIONS = 12, 200, 40, 30, 100
SMALLEST_STRIDE = 1e-5
SHORTEST_CONVEX, SHORTEST_FULL = 1e-10, 1e-3
# Largest turn of a contact line in one whole step [rad], and steps without progress that are waited for.
FURTHEST, PATIENCE = 0.5, 8
# Share of the largest diagonal entry below which a pivot of the ring's matrix tells nothing.
LEAST_PIVOT = 1e-13


@routine
def ring_step(free: Any, damping: float, at: Any) -> bool:
    """Newton step (matrix + damping) step = vector of the free components of the ring; 0 for the others.

    Returns whether a pivot of a reasonable size was found every time; only then ``at.step`` is a step.
    """
    count, largest, matrix, vector, table, step = 0, 0.0, at.matrix, at.vector, at.table, at.step
    for i in range(RING):
        if free[i] > 0.0:
            column = 0
            for k in range(RING):
                if free[k] > 0.0:
                    table[count, column] = matrix[i, k]
                    column += 1
            table[count, count] += damping
            step[count] = vector[i]
            largest = max(largest, abs(table[count, count]))
            count += 1
    if not eliminate(table, step, count, LEAST_PIVOT * largest):
        return False
    for i in range(RING - 1, -1, -1):
        if free[i] > 0.0:
            count -= 1
            step[i] = step[count]
        else:
            step[i] = 0.0
    return True


@kernel
def weighed(task: Any, strength: float, mixed: bool, at: Any) -> tuple[float, float]:
    """``unbalance`` of a new assembly."""
    assemble(task, strength, mixed, at)
    return unbalance(task, at)


@kernel
def stiffness_scale(row: Any, force: float) -> float:
    """A contact stiffness to measure damping by [N/m]: that of a ball under ``force``."""
    return 1.5 * row.outer_stiffness ** (2.0 / 3.0) * force ** (1.0 / 3.0)


@routine
def descend(task: Any, strength: float, convex: bool, limit: int, at: Any) -> bool:
    """Newton's method from where ``at`` stands, which it leaves at the best point found; whether that is an equilibrium.

    Guarded by the energy where ``convex``, else by the squared length of the residuals.
    """
    sums = at.sums
    total, worst = weighed(task, strength, False, at)
    unit = stiffness_scale(task.row, sums[LARGEST])
    damping = 0.0
    for _ in range(limit):
        if not math.isfinite(total):
            return False
        if worst <= AIM * sums[LARGEST]:
            return True
        if not ring_step(task.free, damping, at):
            damping = max(1e3 * damping, 1e-9 * unit)
            if damping > 1e9 * unit:
                return worst <= ACCEPTED * sums[LARGEST]
            continue
        at.counts[STEPS] += 1
        go_to(at.q, at.balls, at.old_q, at.old_balls)
        copy(at.work, at.old_work)
        before, energy, scale = total, sums[ENERGY], 1.0
        shortest = SHORTEST_CONVEX if convex else SHORTEST_FULL
        better = False
        while scale >= shortest:
            follow(task.row, scale, at.old_work, at)
            total, worst = weighed(task, strength, False, at)
            better = total <= (1.0 - 1e-4 * scale) * before
            if convex and not better:
                better = sums[ENERGY] < energy - 1e-14 * abs(energy)
            if better:
                break
            scale *= 0.5 if scale > 0.1 else 0.25
        if better:
            if scale == 1.0:
                damping = 0.1 * damping if damping > 1e-9 * unit else 0.0
            continue
        # No step helps: rounding has been reached, or the matrix misleads.
        go_to(at.old_q, at.old_balls, at.q, at.balls)
        total, worst = weighed(task, strength, False, at)
        if worst <= ACCEPTED * sums[LARGEST]:
            return True
        if not convex or damping > 1e3 * unit:
            return False
        damping = max(1e2 * damping, 1e-6 * unit)
    return worst <= ACCEPTED * sums[LARGEST]


@routine
def bound(row: Any, at: Any, furthest: float) -> float:
    """Share of a Newton step that turns no contact line by more than ``furthest`` [rad]."""
    scale, step, work = 1.0, at.step, at.work
    for j in range(row.cosine.size):
        if work[j, LOADED] > 0.0:
            axial, radial, x, y = ball_step(row, j, step, work)
            u, v = axial - x, radial - y
            moved = max(
                (x * x + y * y) / (row.outer_reach[j] * row.outer_reach[j]),
                (u * u + v * v) / (row.inner_reach[j] * row.inner_reach[j]),
            )
            if moved * scale * scale > furthest * furthest:
                scale = furthest / math.sqrt(moved)
    return scale


@kernel
def roughly(task: Any) -> float:
    """Residual [N] that is good enough for the convex problem where the full equations follow."""
    enough = 0.0
    for i in range(RING):
        enough = max(enough, ROUGHLY * abs(task.load[i]) * task.free[i])
    return enough


@routine
def march(task: Any, strength: float, enough: float, limit: int, at: Any) -> bool:
    """Newton's method with whole steps, bounded in angle, that need not improve at once; whether it ends in an equilibrium.

    A ball that slides along its groove leaves the stiff normal direction by the square of its step: forces rise, and the next
    step mends them. A search along the step for smaller forces would creep. ``enough``: residual at which to
    stop already [N].
    """
    row, free, sums = task.row, task.free, at.sums
    total, worst = weighed(task, strength, True, at)
    best, idle = total, 0
    for _ in range(limit):
        if not math.isfinite(total):
            return False
        if worst <= max(AIM * sums[LARGEST], enough):
            return True
        if not ring_step(free, 0.0, at) and not ring_step(free, 1e-9 * stiffness_scale(row, sums[LARGEST]), at):
            return False
        at.counts[STEPS] += 1
        floor = worst <= ACCEPTED * sums[LARGEST]
        go_to(at.q, at.balls, at.old_q, at.old_balls)
        follow(row, bound(row, at, FURTHEST), at.work, at)
        total, worst = weighed(task, strength, True, at)
        if total < 0.25 * best:
            best, idle = total, 0
        else:
            idle += 1
            if floor and worst <= ACCEPTED * sums[LARGEST]:
                return True
            if idle > PATIENCE:
                return False
    return worst <= ACCEPTED * sums[LARGEST]


@routine
def copy(table: Any, into: Any) -> None:
    """Copy a table. Row by row: assigned to a slice, it would bring numba's strings with it, seconds of compiling."""
    for j in range(table.shape[0]):
        for i in range(table.shape[1]):
            into[j, i] = table[j, i]


@routine
def go_to(q: Any, balls: Any, to_q: Any, to_balls: Any) -> None:
    """Put ring and balls ``to_q`` and ``to_balls`` where ``q`` and ``balls`` are."""
    for i in range(RING):
        to_q[i] = q[i]
    copy(balls, to_balls)


@routine
def bring_in(task: Any, at: Any) -> bool:
    """From the convex minimum to the full equations by strides in the strength of the race control."""
    q, balls = at.q.copy(), at.balls.copy()
    reached, stride = 0.0, 0.25
    for _ in range(CONTINUATIONS):
        at.counts[STRIDES] += 1
        ahead = min(reached + stride, 1.0)
        arrived = march(task, ahead, 0.0, CONTINUED_STEPS, at)
        if not arrived:
            go_to(q, balls, at.q, at.balls)
            arrived = descend(task, ahead, False, CONTINUED_STEPS, at)
        if arrived:
            if ahead == 1.0:
                return True
            reached, stride = ahead, 2.0 * stride
            go_to(at.q, at.balls, q, balls)
        else:
            go_to(q, balls, at.q, at.balls)
            stride *= 0.25
            if stride < SMALLEST_STRIDE:
                return False
    return False


@routine
def start_afresh(task: Any, at: Any) -> None:
    """Put ring and balls where a solve begins that knows nothing; prescribed displacements stay."""
    at.counts[COLD_STARTS] += 1
    for i in range(RING):
        if task.free[i] > 0.0:
            at.q[i] = 0.0
    along_the_load(task, at)
    settle_all(task.row, at)


@routine
def find(task: Any, warm: bool, at: Any) -> int:
    """Equilibrium of one row. ``at`` holds the start where ``warm``, and the prescribed displacements always.

    Returns an outcome.
    """
    if warm:
        at.work[:, LOADED] = 1.0
        if march(task, 1.0, 0.0, FULL_STEPS, at):
            return CONVERGED
    start_afresh(task, at)
    q, balls = at.q.copy(), at.balls.copy()
    if rules(task.control):
        # Most often a rough minimum is start enough.
        if march(task, 0.0, roughly(task), CONVEX_MARCH, at) and march(task, 1.0, 0.0, FULL_STEPS, at):
            return CONVERGED
        go_to(q, balls, at.q, at.balls)
    if not march(task, 0.0, 0.0, CONVEX_MARCH, at):
        go_to(q, balls, at.q, at.balls)
        if not descend(task, 0.0, True, CONVEX_STEPS, at) and not march(task, 0.0, 0.0, FULL_STEPS, at):
            return NOT_CONVEX_MINIMUM
    if not rules(task.control):
        return CONVERGED
    go_to(at.q, at.balls, q, balls)
    if march(task, 1.0, 0.0, FULL_STEPS, at):
        return CONVERGED
    go_to(q, balls, at.q, at.balls)
    if descend(task, 1.0, False, FULL_STEPS, at):
        return CONVERGED
    go_to(q, balls, at.q, at.balls)
    if bring_in(task, at):
        return CONVERGED
    return RACE_CONTROL_LOST
