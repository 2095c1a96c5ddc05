"""Equilibrium from any start: the convex problem first, then the full equations.

With one common cage speed and no gyroscopic moment the equilibrium is the minimiser of a jointly convex energy in the ring's
displacement and the places of the balls: unique, and a guarded Newton reaches it from anywhere. From there Newton on the
full equations; where it fails the race control is brought in by and by.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.quasistatic.row.ball import rules
from rbdyn.quasistatic.row.ring import (
    BALL,
    BALL_WORK,
    ENERGY,
    LARGEST,
    LOADED,
    RING,
    SUMS,
    TAKEN,
    UNBALANCE,
    WORST,
    assemble,
    follow,
)
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
# Counters: Newton steps, assemblies, continuations, starts from nothing.
STEPS, ASSEMBLIES, STRIDES, COLD_STARTS, COUNTERS = range(5)


class Space(NamedTuple):
    """Work space of a solve, kept from one to the next. ``matrix``: the ring's stiffness where the last solve ended [N/m]."""

    matrix: NDArray[np.float64]
    vector: NDArray[np.float64]
    table: NDArray[np.float64]
    step: NDArray[np.float64]
    sums: NDArray[np.float64]
    work: NDArray[np.float64]
    old_work: NDArray[np.float64]
    old_balls: NDArray[np.float64]
    old_ring: NDArray[np.float64]
    base: NDArray[np.float64]


def space(balls: int) -> Space:
    """Work space for a row of so many balls."""
    return Space(
        np.zeros((RING, RING)),
        np.zeros(RING),
        np.zeros((RING, RING + 1)),
        np.zeros(RING),
        np.zeros(SUMS),
        np.zeros((balls, BALL_WORK)),
        np.zeros((balls, BALL_WORK)),
        np.zeros((balls, BALL)),
        np.zeros(RING),
        np.zeros(RING),
    )


@routine
def ring_step(matrix: Any, vector: Any, free: Any, damping: float, table: Any, step: Any) -> bool:
    """Solve (matrix + damping) step = vector for the free components, by elimination with pivots; 0 for the others.

    ``table``: work space (5, 6). Returns whether a pivot of a reasonable size was found every time.
    """
    count = 0
    largest = 0.0
    for i in range(RING):
        step[i] = 0.0
        if free[i] > 0.0:
            column = 0
            for k in range(RING):
                if free[k] > 0.0:
                    table[count, column] = matrix[i, k]
                    column += 1
            table[count, count] += damping
            table[count, RING] = vector[i]
            largest = max(largest, abs(table[count, count]))
            count += 1
    for i in range(count):
        pivot = i
        for k in range(i + 1, count):
            if abs(table[k, i]) > abs(table[pivot, i]):
                pivot = k
        if not abs(table[pivot, i]) > 1e-13 * largest:
            return False
        if pivot != i:
            for k in range(i, count):
                table[i, k], table[pivot, k] = table[pivot, k], table[i, k]
            table[i, RING], table[pivot, RING] = table[pivot, RING], table[i, RING]
        one = 1.0 / table[i, i]
        for k in range(i + 1, count):
            factor = table[k, i] * one
            for m in range(i + 1, count):
                table[k, m] -= factor * table[i, m]
            table[k, RING] -= factor * table[i, RING]
    for i in range(count - 1, -1, -1):
        rest = table[i, RING]
        for k in range(i + 1, count):
            rest -= table[i, k] * table[k, RING]
        table[i, RING] = rest / table[i, i]
    place = 0
    for i in range(RING):
        if free[i] > 0.0:
            step[i] = table[place, RING]
            place += 1
    return True


@kernel
def unbalance(load: Any, free: Any, sums: Any) -> tuple[float, float]:
    """Squared length of all residuals [N^2] and the largest of them [N], the ring's free components included."""
    total, worst = sums[UNBALANCE], sums[WORST]
    for i in range(RING):
        left = (load[i] - sums[TAKEN + i]) * free[i]
        total += left * left
        worst = max(worst, abs(left))
    return total, worst


@kernel
def stiffness_scale(row: Any, force: float) -> float:
    """A contact stiffness to measure damping by [N/m]: that of a ball under ``force``."""
    return 1.5 * row.outer_stiffness ** (2.0 / 3.0) * force ** (1.0 / 3.0)


@routine
def descend(
    control: Any, strength: float, convex: bool, limit: int, row: Any, load: Any, free: Any, q: Any, balls: Any, at: Any,
    counts: Any,
) -> bool:  # fmt: skip
    """Newton's method from ``q`` and ``balls``, which it leaves at the best point found; whether that is an equilibrium.

    Guarded by the energy where ``convex``, else by the squared length of the residuals.
    """
    matrix, sums, step = at.matrix, at.sums, at.step
    assemble(control, strength, False, row, load, q, balls, matrix, at.vector, at.work, sums)
    counts[ASSEMBLIES] += 1
    total, worst = unbalance(load, free, sums)
    unit = stiffness_scale(row, sums[LARGEST])
    damping = 0.0
    for _ in range(limit):
        if not math.isfinite(total):
            return False
        if worst <= AIM * sums[LARGEST]:
            return True
        if not ring_step(matrix, at.vector, free, damping, at.table, step):
            damping = max(1e3 * damping, 1e-9 * unit)
            if damping > 1e9 * unit:
                return worst <= ACCEPTED * sums[LARGEST]
            continue
        counts[STEPS] += 1
        at.old_ring[:] = q
        at.old_balls[:] = balls
        at.old_work[:] = at.work
        before, energy, scale = total, sums[ENERGY], 1.0
        shortest = SHORTEST_CONVEX if convex else SHORTEST_FULL
        better = False
        while scale >= shortest:
            for i in range(RING):
                q[i] = at.old_ring[i] + scale * step[i]
            follow(row, step, scale, at.old_work, at.old_balls, balls)
            assemble(control, strength, False, row, load, q, balls, matrix, at.vector, at.work, sums)
            counts[ASSEMBLIES] += 1
            total, worst = unbalance(load, free, sums)
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
        q[:] = at.old_ring
        balls[:] = at.old_balls
        assemble(control, strength, False, row, load, q, balls, matrix, at.vector, at.work, sums)
        counts[ASSEMBLIES] += 1
        total, worst = unbalance(load, free, sums)
        if worst <= ACCEPTED * sums[LARGEST]:
            return True
        if not convex or damping > 1e3 * unit:
            return False
        damping = max(1e2 * damping, 1e-6 * unit)
    return worst <= ACCEPTED * sums[LARGEST]


@routine
def bound(row: Any, step: Any, at: Any, furthest: float) -> float:
    """Share of a Newton step that turns no contact line by more than ``furthest`` [rad]."""
    scale = 1.0
    for j in range(row.cosine.size):
        if at.work[j, LOADED] > 0.0:
            c, s = row.cosine[j], row.sine[j]
            axial = step[2] + step[3] * s - step[4] * c
            radial = step[0] * c + step[1] * s
            x = at.work[j, 0] + at.work[j, 2] * axial + at.work[j, 3] * radial
            y = at.work[j, 1] + at.work[j, 4] * axial + at.work[j, 5] * radial
            u, v = axial - x, radial - y
            moved = max(
                (x * x + y * y) / (row.outer_reach[j] * row.outer_reach[j]),
                (u * u + v * v) / (row.inner_reach[j] * row.inner_reach[j]),
            )
            if moved * scale * scale > furthest * furthest:
                scale = furthest / math.sqrt(moved)
    return scale


@kernel
def roughly(load: Any, free: Any) -> float:
    """Residual [N] that is good enough for the convex problem where the full equations follow."""
    enough = 0.0
    for i in range(RING):
        enough = max(enough, ROUGHLY * abs(load[i]) * free[i])
    return enough


@routine
def march(
    control: Any,
    strength: float,
    enough: float,
    limit: int,
    row: Any,
    load: Any,
    free: Any,
    q: Any,
    balls: Any,
    at: Any,
    counts: Any,
) -> bool:
    """Newton's method with whole steps, bounded in angle, that need not improve at once; whether it ends in an equilibrium.

    A ball that slides along its groove leaves the stiff normal direction by the square of its step: forces rise, and the next
    step mends them. A search along the step for smaller forces would creep. ``enough``: residual at which to
    stop already [N].
    """
    matrix, sums, step = at.matrix, at.sums, at.step
    assemble(control, strength, True, row, load, q, balls, matrix, at.vector, at.work, sums)
    counts[ASSEMBLIES] += 1
    total, worst = unbalance(load, free, sums)
    best, idle = total, 0
    for _ in range(limit):
        if not math.isfinite(total):
            return False
        if worst <= max(AIM * sums[LARGEST], enough):
            return True
        if not ring_step(matrix, at.vector, free, 0.0, at.table, step) and not ring_step(
            matrix, at.vector, free, 1e-9 * stiffness_scale(row, sums[LARGEST]), at.table, step
        ):
            return False
        counts[STEPS] += 1
        scale = bound(row, step, at, FURTHEST)
        floor = worst <= ACCEPTED * sums[LARGEST]
        at.old_balls[:] = balls
        for i in range(RING):
            q[i] += scale * step[i]
        follow(row, step, scale, at.work, at.old_balls, balls)
        assemble(control, strength, True, row, load, q, balls, matrix, at.vector, at.work, sums)
        counts[ASSEMBLIES] += 1
        total, worst = unbalance(load, free, sums)
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
def go_back(q: Any, balls: Any, to_q: Any, to: Any) -> None:
    """Set ``q`` and ``balls`` to what ``to_q`` and ``to`` hold."""
    q[:] = to_q
    balls[:] = to


@routine
def bring_in(control: Any, row: Any, load: Any, free: Any, q: Any, balls: Any, at: Any, counts: Any) -> bool:
    """From the convex minimum to the full equations by strides in the strength of the race control."""
    keep_q, keep = q.copy(), balls.copy()
    reached, stride = 0.0, 0.25
    for _ in range(CONTINUATIONS):
        counts[STRIDES] += 1
        ahead = min(reached + stride, 1.0)
        arrived = march(control, ahead, 0.0, CONTINUED_STEPS, row, load, free, q, balls, at, counts)
        if not arrived:
            go_back(q, balls, keep_q, keep)
            arrived = descend(control, ahead, False, CONTINUED_STEPS, row, load, free, q, balls, at, counts)
        if arrived:
            if ahead == 1.0:
                return True
            reached, stride = ahead, 2.0 * stride
            go_back(keep_q, keep, q, balls)
        else:
            go_back(q, balls, keep_q, keep)
            stride *= 0.25
            if stride < SMALLEST_STRIDE:
                return False
    return False


@entry
def find(control: Any, row: Any, load: Any, free: Any, warm: bool, q: Any, balls: Any, at: Any, counts: Any) -> int:
    """Equilibrium of one row. ``q`` and ``balls`` hold the start where ``warm``, and the prescribed displacements always.

    Returns an outcome.
    """
    if warm:
        at.work[:, LOADED] = 1.0
        if march(control, 1.0, 0.0, FULL_STEPS, row, load, free, q, balls, at, counts):
            return CONVERGED
    counts[COLD_STARTS] += 1
    for i in range(RING):
        if free[i] > 0.0:
            q[i] = 0.0
    along_the_load(row, load, free, q, at.step, at.base)
    settle_all(row, q, balls, at.work)
    start_q, start = q.copy(), balls.copy()
    if rules(control):
        # Most often a rough minimum is start enough.
        if march(control, 0.0, roughly(load, free), CONVEX_MARCH, row, load, free, q, balls, at, counts) and march(
            control, 1.0, 0.0, FULL_STEPS, row, load, free, q, balls, at, counts
        ):
            return CONVERGED
        go_back(q, balls, start_q, start)
    if not march(control, 0.0, 0.0, CONVEX_MARCH, row, load, free, q, balls, at, counts):
        go_back(q, balls, start_q, start)
        if not descend(control, 0.0, True, CONVEX_STEPS, row, load, free, q, balls, at, counts) and not march(
            control, 0.0, 0.0, FULL_STEPS, row, load, free, q, balls, at, counts
        ):
            return NOT_CONVEX_MINIMUM
    if not rules(control):
        return CONVERGED
    go_back(start_q, start, q, balls)
    if march(control, 1.0, 0.0, FULL_STEPS, row, load, free, q, balls, at, counts):
        return CONVERGED
    go_back(q, balls, start_q, start)
    if descend(control, 1.0, False, FULL_STEPS, row, load, free, q, balls, at, counts):
        return CONVERGED
    go_back(q, balls, start_q, start)
    if bring_in(control, row, load, free, q, balls, at, counts):
        return CONVERGED
    return RACE_CONTROL_LOST
