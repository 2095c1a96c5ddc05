"""Equilibrium from any start: the convex problem first, then the full equations.

With one common cage speed and no gyroscopic moment the equilibrium is the minimiser of a jointly convex energy in the ring's
displacement and the places of the balls: unique, and a guarded Newton reaches it from anywhere. From there Newton on the
full equations; where it fails the race control is brought in by and by. All work on a ``Task`` and leave ``at``, a ``Space``,
where they end.

The first guess is how far the ring goes along its load, and where the balls then rest. ``Task`` is what a solve is given.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.compiled.kernel import kernel, routine
from rbdyn.quasistatic.row.ball import Control, rules
from rbdyn.quasistatic.row.ring import (
    BALL,
    BALL_WORK,
    ENERGY,
    LARGEST,
    LOADED,
    RING,
    SUMS,
    Row,
    assemble,
    ball_step,
    component_lengths,
    follow,
    groove_centre,
    measure,
    moved_centre,
    settle,
    unbalance,
)

# Counters: Newton steps, continuations, starts from nothing.
STEPS, STRIDES, COLD_STARTS, COUNTERS = range(4)


class Task(NamedTuple):
    """A row, its raceway control, and what holds its ring: all forces [N], as moments count over the lever R.

    ``load`` (5,) on the ring; ``free`` (5,): 1 where the load rules, 0 where the displacement is prescribed.
    """

    control: Control
    row: Row
    load: Array
    free: Array


class Space(NamedTuple):
    """Where a solve of Z balls stands, and its work space; kept from one solve to the next.

    ``q`` (5,): displacement of the ring [m], tilts times R; ``balls`` (Z, BALL); ``old_q, old_balls, old_work``: before the last step.
    ``matrix`` (5, 5): stiffness of the ring [N/m]; ``vector`` (5,): what a Newton step is to take away [N]; ``step`` (5,) [m];
    ``sums``, ``work`` (Z, BALL_WORK): columns of ``ring``; ``counts``: above. ``table``, ``base``: of an elimination and of the first guess.
    """

    counts: Whole
    q: Array
    balls: Array
    matrix: Array
    vector: Array
    table: Array
    step: Array
    sums: Array
    work: Array
    old_q: Array
    old_balls: Array
    old_work: Array
    base: Array


def space(balls: int) -> Space:
    """Work space for a row of so many balls."""
    ball, work, square = (balls, BALL), (balls, BALL_WORK), (RING, RING)
    shapes = (RING, ball, square, RING, square, RING, SUMS, work, RING, ball, work, RING)
    return Space(np.zeros(COUNTERS, np.int64), *(np.zeros(shape) for shape in shapes))


def posed(row: Row, load: Array, given: Array | None) -> tuple[Array, Array, Array]:
    """``load`` and ``free`` of a ``Task`` from load and prescribed displacements of ``equilibrium.solve``, and those displacements.

    The last (5,) in m, 0 where the load rules.
    """
    unit = component_lengths(row.lever)
    held = np.full(RING, np.nan) if given is None else np.asarray(given, float)
    free = np.isnan(held)
    return np.asarray(load, float) / unit, free.astype(float), np.where(free, 0.0, held) * unit


@routine
def eliminate(matrix: Any, vector: Any, size: int, least: float) -> bool:
    """Solve ``matrix`` x = ``vector`` in place with row pivots; x is left in ``vector``, the matrix is spent.

    Only the first ``size`` rows and columns count. Returns whether every pivot was found: False for a matrix that is not
    finite or has a pivot no larger than ``least``, 0 where only a singular one is to fail.
    """
    for i in range(size):
        pivot = i
        for k in range(i + 1, size):
            if abs(matrix[k, i]) > abs(matrix[pivot, i]):
                pivot = k
        if not least < abs(matrix[pivot, i]) < 1e300:
            return False
        if pivot != i:
            for k in range(i, size):
                matrix[i, k], matrix[pivot, k] = matrix[pivot, k], matrix[i, k]
            vector[i], vector[pivot] = vector[pivot], vector[i]
        one = 1.0 / matrix[i, i]
        for k in range(i + 1, size):
            factor = matrix[k, i] * one
            # Most of a matrix of all balls is zero, and stays so where no ball meets another.
            if factor != 0.0:
                for m in range(i + 1, size):
                    matrix[k, m] -= factor * matrix[i, m]
                vector[k] -= factor * vector[i]
    for i in range(size - 1, -1, -1):
        rest = vector[i]
        for k in range(i + 1, size):
            rest -= matrix[i, k] * vector[k]
        vector[i] = rest / matrix[i, i]
    return True


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
# Share of the largest diagonal entry below which a pivot of the ring's matrix shows nothing.
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
    step fixes them. A search along the step for smaller forces would creep. ``enough``: residual at which to
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
