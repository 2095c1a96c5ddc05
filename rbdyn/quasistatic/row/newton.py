"""Newton's method for the equilibrium of one row, from any start: the convex problem first, then the full equations.

With one common cage speed and no gyroscopic moment, the equilibrium minimises an energy. This is jointly convex in the
ring's displacement and the positions of the balls. The equilibrium is unique, and a guarded Newton method reaches it from anywhere.
Newton on the full equations starts there. Where it fails, continuation raises the strength of the race control from 0 to 1.

The first guess moves the ring along its load until balls without centrifugal force carry it, and lets the balls settle.
All functions solve a ``Task`` and work on a ``Space``, their ``state``, which they leave at the last point.

- ``find``: equilibrium of a task; ``walk``: equilibrium at every step of a path of balls, each from the step before
- ``march``: whole Newton steps; ``descend``: Newton steps that must improve; ``bring_in``: continuation of the race control
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.quasistatic.row import ring
from rbdyn.quasistatic.row.ball import Control, has_race_control, spring

# Counters: Newton steps, continuations, cold starts.
STEPS, STRIDES, COLD_STARTS, COUNTERS = range(4)


class Task(NamedTuple):
    """Equations of a solve: a row, its raceway control, and the load and constraints of its ring.

    ``load`` (5,) on the ring [N], moments divided by the lever R. ``free`` (5,): 1 where the load rules, 0 where the
    displacement is prescribed.
    """

    control: Control
    row: ring.Row
    load: Array
    free: Array


class Space(NamedTuple):
    """State of a solve of Z balls and its work space, reused from one solve to the next.

    ``q`` (5,): displacement of the ring [m], tilts times R. ``balls`` (Z, BALL) and ``work`` (Z, BALL_WORK): columns as in ``ring``.
    ``old_q, old_balls, old_work``: values before the last step. ``matrix`` (5, 5): stiffness of the ring [N/m]. ``vector``
    (5,): residual of the ring [N]. ``step`` (5,): Newton step [m]. ``sums``: as in ``ring``. ``counts``: the counters above.
    ``table``: of an elimination. ``base``: start of the first guess.
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
    """Work space for a row of ``balls`` balls."""
    ball, work, square = (balls, ring.BALL), (balls, ring.BALL_WORK), (ring.RING, ring.RING)
    shapes = (ring.RING, ball, square, ring.RING, square, ring.RING, ring.SUMS, work, ring.RING, ball, work, ring.RING)
    return Space(np.zeros(COUNTERS, np.int64), *(np.zeros(shape) for shape in shapes))


def boundary_conditions(row: ring.Row, load: Array, constraint: Array | None) -> tuple[Array, Array, Array]:
    """``load`` and ``free`` of a ``Task``, and the prescribed displacements (5,) in m, 0 where the load rules.

    ``load`` and ``constraint`` are those of ``equilibrium.solve``.
    """
    unit = ring.component_lengths(row.lever)
    displacement = np.full(ring.RING, np.nan) if constraint is None else np.asarray(constraint, float)
    free = np.isnan(displacement)
    return np.asarray(load, float) / unit, free.astype(float), np.where(free, 0.0, displacement) * unit


@routine
def eliminate(matrix: Any, vector: Any, size: int, least: float) -> bool:
    """Solve ``matrix`` x = ``vector`` in place with row pivots: ``vector`` becomes x, the matrix is overwritten.

    Only the first ``size`` rows and columns count. Returns False for a matrix that is not finite or has a pivot no larger
    than ``least``; with ``least`` = 0 only a singular matrix fails.
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
        inverse = 1.0 / matrix[i, i]
        for k in range(i + 1, size):
            factor = matrix[k, i] * inverse
            # Most of a matrix of all balls is zero and stays zero, for no ball touches another.
            if factor != 0.0:
                for m in range(i + 1, size):
                    matrix[k, m] -= factor * matrix[i, m]
                vector[k] -= factor * vector[i]
    for i in range(size - 1, -1, -1):
        value = vector[i]
        for k in range(i + 1, size):
            value -= matrix[i, k] * vector[k]
        vector[i] = value / matrix[i, i]
    return True


FIRST_STEP = 1e-6  # [m]
LONGEST_STEP = 1.0  # [m]
# Residual over the contact loads of a ball that is good enough for a start.
START_BALANCE = 1e-2
# Relative error of the first guess, which only needs the right size.
START_ERROR = 0.1


@kernel
def force_along(row: Any, both: float, q: Any, direction: Any) -> float:
    """Force along ``direction`` of balls without centrifugal force: two Hertz springs in series, K = ``both``."""
    total = 0.0
    for j in range(row.cosine.size):
        a_axial, a_radial = ring.groove_centre(row, q, j)
        length = math.sqrt(a_axial * a_axial + a_radial * a_radial)
        deflection = max(length - row.inner_reach[j] - row.outer_reach[j], 0.0)
        load = both * deflection * math.sqrt(deflection) / length
        axial, radial = ring.centre_shift(row, j, direction)
        total += load * (a_axial * axial + a_radial * radial)
    return total


@kernel
def force_at(row: Any, both: float, far: float, state: Any) -> float:
    """Move the ring to ``state.base`` + ``far`` times ``state.step``, and return ``force_along`` that step there."""
    q, base, step = state.q, state.base, state.step
    for i in range(ring.RING):
        q[i] = base[i] + far * step[i]
    return force_along(row, both, q, step)


@routine
def move_along_load(task: Any, state: Any) -> None:
    """Move ``state.q`` along the free part of the load until the balls roughly carry it."""
    row, direction = task.row, state.step
    length = 0.0
    for i in range(ring.RING):
        direction[i] = task.load[i] * task.free[i]
        state.base[i] = state.q[i]
        length += direction[i] * direction[i]
    if length == 0.0:
        return
    force = math.sqrt(length)
    for i in range(ring.RING):
        direction[i] /= force
    both = (row.inner_stiffness ** (-2.0 / 3.0) + row.outer_stiffness ** (-2.0 / 3.0)) ** -1.5
    below, above = 0.0, FIRST_STEP
    while above < LONGEST_STEP and not force_at(row, both, above, state) >= force:
        below, above = above, 3.0 * above
    while above - below > START_ERROR * (above - below + 0.1 * below):
        middle = 0.5 * (below + above)
        if force_at(row, both, middle, state) >= force:
            above = middle
        else:
            below = middle
        if above - below < 0.02 * above:
            break
    for i in range(ring.RING):
        state.q[i] = state.base[i] + above * direction[i]


@routine
def settle_all(row: Any, state: Any) -> None:
    """Settle every ball for the ring at ``state.q``, and mark all as loaded."""
    q, balls = state.q, state.balls
    state.work[:, ring.LOADED] = 1.0
    for j in range(row.cosine.size):
        a_axial, a_radial = ring.groove_centre(row, q, j)
        ring.settle(row, j, a_axial, a_radial, START_BALANCE, balls)
        ring.measure(row, j, a_axial, a_radial, balls)


# Outcomes of ``find``.
CONVERGED, NOT_CONVEX_MINIMUM, RACE_CONTROL_LOST = range(3)
# Largest residual over largest force: aimed at, and accepted where rounding allows no better.
AIM, ACCEPTED = 1e-12, 1e-9
# Residual over the load at which the convex problem may stop when the full equations follow.
ROUGHLY = 1e-3
CONVEX_MARCH, CONVEX_STEPS, FULL_STEPS, CONTINUED_STEPS, CONTINUATIONS = 12, 200, 40, 30, 100
SMALLEST_STRIDE = 1e-5
SHORTEST_CONVEX, SHORTEST_FULL = 1e-10, 1e-3
# Largest turn of a contact line in one whole step [rad], and patience in steps without progress.
FURTHEST, PATIENCE = 0.5, 8
# Share of the largest diagonal entry below which a pivot of the ring's matrix counts as zero.
LEAST_PIVOT = 1e-13


@routine
def ring_step(free: Any, damping: float, state: Any) -> bool:
    """Solve (matrix + damping) step = vector for the free components of the ring; the other components are 0.

    Returns whether every pivot was large enough; only then ``state.step`` is valid.
    """
    count, largest, matrix, vector, table, step = 0, 0.0, state.matrix, state.vector, state.table, state.step
    for i in range(ring.RING):
        if free[i] > 0.0:
            column = 0
            for k in range(ring.RING):
                if free[k] > 0.0:
                    table[count, column] = matrix[i, k]
                    column += 1
            table[count, count] += damping
            step[count] = vector[i]
            largest = max(largest, abs(table[count, count]))
            count += 1
    if not eliminate(table, step, count, LEAST_PIVOT * largest):
        return False
    for i in range(ring.RING - 1, -1, -1):
        if free[i] > 0.0:
            count -= 1
            step[i] = step[count]
        else:
            step[i] = 0.0
    return True


@kernel
def assembly_unbalance(task: Any, strength: float, mixed: bool, state: Any) -> tuple[float, float]:
    """``unbalance`` of a new assembly."""
    ring.assemble(task, strength, mixed, state)
    return ring.unbalance(task, state)


@kernel
def stiffness_scale(row: Any, force: float) -> float:
    """Unit of the damping [N/m]: the contact stiffness of a ball under ``force``."""
    return 1.5 * row.outer_stiffness ** (2.0 / 3.0) * force ** (1.0 / 3.0)


@routine
def descend(task: Any, strength: float, convex: bool, limit: int, state: Any) -> bool:
    """Damped Newton's method from ``state``, which ends at the best point; returns whether that is an equilibrium.

    Every step must lower the squared length of the residuals or, where ``convex``, the energy.
    """
    sums = state.sums
    total, worst = assembly_unbalance(task, strength, False, state)
    unit = stiffness_scale(task.row, sums[ring.LARGEST])
    damping = 0.0
    for _ in range(limit):
        if not math.isfinite(total):
            return False
        if worst <= AIM * sums[ring.LARGEST]:
            return True
        if not ring_step(task.free, damping, state):
            damping = max(1e3 * damping, 1e-9 * unit)
            if damping > 1e9 * unit:
                return worst <= ACCEPTED * sums[ring.LARGEST]
            continue
        state.counts[STEPS] += 1
        go_to(state.q, state.balls, state.old_q, state.old_balls)
        copy(state.work, state.old_work)
        before, energy, scale = total, sums[ring.ENERGY], 1.0
        shortest = SHORTEST_CONVEX if convex else SHORTEST_FULL
        better = False
        while scale >= shortest:
            ring.follow(task.row, scale, state.old_work, state)
            total, worst = assembly_unbalance(task, strength, False, state)
            better = total <= (1.0 - 1e-4 * scale) * before
            if convex and not better:
                better = sums[ring.ENERGY] < energy - 1e-14 * abs(energy)
            if better:
                break
            scale *= 0.5 if scale > 0.1 else 0.25
        if better:
            if scale == 1.0:
                damping = 0.1 * damping if damping > 1e-9 * unit else 0.0
            continue
        # No step improves: the residual is at rounding level, or the matrix is misleading.
        go_to(state.old_q, state.old_balls, state.q, state.balls)
        total, worst = assembly_unbalance(task, strength, False, state)
        if worst <= ACCEPTED * sums[ring.LARGEST]:
            return True
        if not convex or damping > 1e3 * unit:
            return False
        damping = max(1e2 * damping, 1e-6 * unit)
    return worst <= ACCEPTED * sums[ring.LARGEST]


@routine
def bound(row: Any, state: Any, furthest: float) -> float:
    """Share of a Newton step that turns no contact line by more than ``furthest`` [rad]."""
    scale, step, work = 1.0, state.step, state.work
    for j in range(row.cosine.size):
        if work[j, ring.LOADED] > 0.0:
            axial, radial, x, y = ring.ball_step(row, j, step, work)
            u, v = axial - x, radial - y
            moved = max(
                (x * x + y * y) / (row.outer_reach[j] * row.outer_reach[j]),
                (u * u + v * v) / (row.inner_reach[j] * row.inner_reach[j]),
            )
            if moved * scale * scale > furthest * furthest:
                scale = furthest / math.sqrt(moved)
    return scale


@kernel
def rough_residual(task: Any) -> float:
    """Residual [N] at which the convex problem may stop when the full equations follow."""
    enough = 0.0
    for i in range(ring.RING):
        enough = max(enough, ROUGHLY * abs(task.load[i]) * task.free[i])
    return enough


@routine
def march(task: Any, strength: float, enough: float, limit: int, state: Any) -> bool:
    """Newton's method with whole steps, bounded in angle; returns whether it ends in an equilibrium.

    Steps need not improve at once. A ball that slides along its groove leaves the stiff normal direction by the square of
    its step: forces rise, and the next step lowers them. A line search for smaller forces would creep.
    ``enough``: residual [N] at which it may stop early.
    """
    row, free, sums = task.row, task.free, state.sums
    total, worst = assembly_unbalance(task, strength, True, state)
    best, idle = total, 0
    for _ in range(limit):
        if not math.isfinite(total):
            return False
        if worst <= max(AIM * sums[ring.LARGEST], enough):
            return True
        if not ring_step(free, 0.0, state) and not ring_step(
            free, 1e-9 * stiffness_scale(row, sums[ring.LARGEST]), state
        ):
            return False
        state.counts[STEPS] += 1
        floor = worst <= ACCEPTED * sums[ring.LARGEST]
        go_to(state.q, state.balls, state.old_q, state.old_balls)
        ring.follow(row, bound(row, state, FURTHEST), state.work, state)
        total, worst = assembly_unbalance(task, strength, True, state)
        if total < 0.25 * best:
            best, idle = total, 0
        else:
            idle += 1
            if floor and worst <= ACCEPTED * sums[ring.LARGEST]:
                return True
            if idle > PATIENCE:
                return False
    return worst <= ACCEPTED * sums[ring.LARGEST]


@routine
def copy(table: Any, into: Any) -> None:
    """Copy a table entry by entry: assignment to a slice would compile numba's strings, which takes seconds."""
    for j in range(table.shape[0]):
        for i in range(table.shape[1]):
            into[j, i] = table[j, i]


@routine
def go_to(q: Any, balls: Any, to_q: Any, to_balls: Any) -> None:
    """Copy the ring's displacement ``q`` to ``to_q`` and the ``balls`` to ``to_balls``."""
    for i in range(ring.RING):
        to_q[i] = q[i]
    copy(balls, to_balls)


@routine
def bring_in(task: Any, state: Any) -> bool:
    """Continuation from the convex minimum to the full equations, by strides in the strength of the race control."""
    q, balls = state.q.copy(), state.balls.copy()
    reached, stride = 0.0, 0.25
    for _ in range(CONTINUATIONS):
        state.counts[STRIDES] += 1
        ahead = min(reached + stride, 1.0)
        arrived = march(task, ahead, 0.0, CONTINUED_STEPS, state)
        if not arrived:
            go_to(q, balls, state.q, state.balls)
            arrived = descend(task, ahead, False, CONTINUED_STEPS, state)
        if arrived:
            if ahead == 1.0:
                return True
            reached, stride = ahead, 2.0 * stride
            go_to(state.q, state.balls, q, balls)
        else:
            go_to(q, balls, state.q, state.balls)
            stride *= 0.25
            if stride < SMALLEST_STRIDE:
                return False
    return False


@routine
def start_afresh(task: Any, state: Any) -> None:
    """Put ring and balls at the first guess of a cold start; prescribed displacements stay."""
    state.counts[COLD_STARTS] += 1
    for i in range(ring.RING):
        if task.free[i] > 0.0:
            state.q[i] = 0.0
    move_along_load(task, state)
    settle_all(task.row, state)


@routine
def find(task: Any, warm: bool, state: Any) -> int:
    """Equilibrium of one row; returns its outcome.

    ``state`` holds the prescribed displacements and, where ``warm``, the start.
    """
    if warm:
        state.work[:, ring.LOADED] = 1.0
        if march(task, 1.0, 0.0, FULL_STEPS, state):
            return CONVERGED
    start_afresh(task, state)
    q, balls = state.q.copy(), state.balls.copy()
    if has_race_control(task.control):
        # In most cases a rough minimum is a good enough start.
        if march(task, 0.0, rough_residual(task), CONVEX_MARCH, state) and march(task, 1.0, 0.0, FULL_STEPS, state):
            return CONVERGED
        go_to(q, balls, state.q, state.balls)
    if not march(task, 0.0, 0.0, CONVEX_MARCH, state):
        go_to(q, balls, state.q, state.balls)
        if not descend(task, 0.0, True, CONVEX_STEPS, state) and not march(task, 0.0, 0.0, FULL_STEPS, state):
            return NOT_CONVEX_MINIMUM
    if not has_race_control(task.control):
        return CONVERGED
    go_to(state.q, state.balls, q, balls)
    if march(task, 1.0, 0.0, FULL_STEPS, state):
        return CONVERGED
    go_to(q, balls, state.q, state.balls)
    if descend(task, 1.0, False, FULL_STEPS, state):
        return CONVERGED
    go_to(q, balls, state.q, state.balls)
    if bring_in(task, state):
        return CONVERGED
    return RACE_CONTROL_LOST


# Figures of a step.
LARGEST_LOAD, RESIDUAL, FIGURES = range(3)


@entry
def walk(task: Any, changes: Any, state: Any, path: Any, figures: Any) -> tuple[int, int]:
    """Fill ``path`` (steps, 5) and ``figures`` (steps, FIGURES) by the equilibrium at each step, from the step before.

    Returns the number of steps up to the first without an equilibrium, and the Newton steps in all. ``changes`` (6, steps, Z)
    holds the six arrays of ``task.row`` at each step, in the order of ``Row``; that row is overwritten. ``state`` is as for ``find``.
    """
    row, newton_steps = task.row, 0
    steps, size = path.shape[0], row.cosine.size
    for step in range(steps):
        for j in range(size):
            row.cosine[j], row.sine[j] = changes[0, step, j], changes[1, step, j]
            row.axial[j], row.radial[j] = changes[2, step, j], changes[3, step, j]
            row.inner_reach[j], row.outer_reach[j] = changes[4, step, j], changes[5, step, j]
        state.counts[:] = 0
        outcome = find(task, step > 0, state)
        newton_steps += state.counts[STEPS]
        if outcome != CONVERGED:
            return step, newton_steps
        for i in range(ring.RING):
            path[step, i] = state.q[i]
        largest = row.centrifugal_force
        for j in range(size):
            inner, _ = spring(state.balls[j, ring.INNER_DEPTH], row.inner_stiffness)
            outer, _ = spring(state.balls[j, ring.OUTER_DEPTH], row.outer_stiffness)
            if state.work[j, ring.LOADED] > 0.0:
                largest = max(largest, inner, outer)
        figures[step, LARGEST_LOAD] = largest
        _, figures[step, RESIDUAL] = ring.unbalance(task, state)
    return steps, newton_steps
