"""RODAS4: linearly implicit, for scenes in which stability, not accuracy, limits the explicit steps.

Six stages, order four with an embedded third-order result, stiffly accurate and L-stable, dense output of order three:
Hairer and Wanner, Solving ODEs II, IV.7. Method and coefficients are those of their code RODAS, in the form u_i that
needs no products with the Jacobian. Each stage solves

    (I/(gamma h) - J) u_i = f(y + sum a_ij u_j) + sum c_ij u_j/h

The method works in fixed axes. The Jacobian of a state is kept while steps from it are refused. Works are further
equations of the same method, w' = P(y): traction from a stiff slip would leave a gap in the power balance of any
quadrature over interpolated states.

The Jacobian comes from differences, for any laws. Rollers feel each other only through the bodies (cage, rings, clock).
So the columns of one roller are those of a bearing with this roller alone: terms without the roller drop out of the
difference. One Jacobian costs 5 z right-hand sides of one roller and one full right-hand side per body coordinate.

It is an arrow matrix: each roller couples to itself and to the bodies, not to the other rollers.

    | block_1           upper_1 |      block_j: 5 x 5, a roller's coordinates among themselves
    |         block_2   upper_2 |      upper_j: 5 x m, effect of the bodies on roller j
    | lower_1 lower_2 .. bodies |      lower_j: m x 5, effect of roller j on the bodies

Elimination takes the rollers first and leaves an m x m system for the bodies (Golub and Van Loan, Matrix Computations,
4.5). Work and storage grow with the number of rollers, not with its cube.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import VECTOR, kernel, law, routine
from rbdyn.dynamics.forces.equations import RollerBearing, derivative, derivative_once
from rbdyn.dynamics.forces.race_lanes import Scratch, scratch
from rbdyn.dynamics.forces.races import EqualRollers, UnequalRollers
from rbdyn.dynamics.forces.state import LOADS, ROLLER_STATES, Layout
from rbdyn.dynamics.integrators import advance as laws
from rbdyn.dynamics.integrators.advance import DERIVATIVES
from rbdyn.losses import POWERS


class ArrowMatrix(NamedTuple):
    """Blocks of the matrix; after ``factor`` those of its factors. Arrays, changed in place."""

    blocks: NDArray[np.float64]  # (5, 5, z)
    upper: NDArray[np.float64]  # (5, z, m)
    lower: NDArray[np.float64]  # (rows that rollers push, 5, z)
    bodies: NDArray[np.float64]  # (m, m)
    pushed: NDArray[np.int64]  # which rows of the bodies those of ``lower`` are
    pivots: NDArray[np.int64]  # (m,) row exchanges of the factors


def arrow_matrix(layout: Layout) -> ArrowMatrix:
    """An empty matrix for a state of this layout: rollers push the velocities of cage and rings, nothing else."""
    z, m = layout.rollers, len(layout.bodies)
    pushed = [place for place, part in enumerate(layout.bodies) if part.pushed]
    return ArrowMatrix(
        blocks=np.zeros((ROLLER_STATES, ROLLER_STATES, z)),
        upper=np.zeros((ROLLER_STATES, z, m)),
        lower=np.zeros((len(pushed), ROLLER_STATES, z)),
        bodies=np.zeros((m, m)),
        pushed=np.array(pushed),
        pivots=np.zeros(m, dtype=np.int64),
    )


@routine
def shifted(matrix, shift, result):
    """``shift`` I - ``matrix`` into ``result``."""
    z, m = matrix.blocks.shape[2], matrix.bodies.shape[0]
    for r in range(ROLLER_STATES):
        for c in range(ROLLER_STATES):
            diagonal = shift if r == c else 0.0
            for j in range(z):
                result.blocks[r, c, j] = diagonal - matrix.blocks[r, c, j]
        for j in range(z):
            for b in range(m):
                result.upper[r, j, b] = -matrix.upper[r, j, b]
    for a in range(matrix.pushed.size):
        for c in range(ROLLER_STATES):
            for j in range(z):
                result.lower[a, c, j] = -matrix.lower[a, c, j]
    for a in range(m):
        for b in range(m):
            result.bodies[a, b] = (shift if a == b else 0.0) - matrix.bodies[a, b]


@routine
def factor(matrix):
    """Replace the matrix by its factors.

    Rollers without exchange of rows: positions come first, and eliminating them leaves inertia, damping and stiffness of
    the velocities, whose pivots are sound where a step is. A zero pivot shows as values that are not finite.
    """
    blocks, upper = matrix.blocks, matrix.upper
    z, m = blocks.shape[2], matrix.bodies.shape[0]
    for p in range(ROLLER_STATES):
        for j in range(z):
            blocks[p, p, j] = 1.0 / blocks[p, p, j]
        for r in range(p + 1, ROLLER_STATES):
            for j in range(z):
                blocks[r, p, j] *= blocks[p, p, j]
            for c in range(p + 1, ROLLER_STATES):
                for j in range(z):
                    blocks[r, c, j] -= blocks[r, p, j] * blocks[p, c, j]
            for j in range(z):
                multiplier = blocks[r, p, j]
                for b in range(m):
                    upper[r, j, b] -= multiplier * upper[p, j, b]
    for r in range(ROLLER_STATES - 1, -1, -1):
        for j in range(z):
            for c in range(r + 1, ROLLER_STATES):
                multiplier = blocks[r, c, j]
                for b in range(m):
                    upper[r, j, b] -= multiplier * upper[c, j, b]
            for b in range(m):
                upper[r, j, b] *= blocks[r, r, j]
    for a in range(matrix.pushed.size):
        row = matrix.pushed[a]
        for c in range(ROLLER_STATES):
            for j in range(z):
                multiplier = matrix.lower[a, c, j]
                for b in range(m):
                    matrix.bodies[row, b] -= multiplier * upper[c, j, b]
    factor_dense(matrix.bodies, matrix.pivots)


@routine
def factor_dense(a, pivots):
    """LU factors of a small square matrix in place, with partial pivoting; the diagonal of U is stored inverted."""
    m = a.shape[0]
    for p in range(m):
        best = p
        for r in range(p + 1, m):
            if abs(a[r, p]) > abs(a[best, p]):
                best = r
        pivots[p] = best
        if best != p:
            for c in range(m):
                a[p, c], a[best, c] = a[best, c], a[p, c]
        a[p, p] = 1.0 / a[p, p]
        for r in range(p + 1, m):
            a[r, p] *= a[p, p]
            for c in range(p + 1, m):
                a[r, c] -= a[r, p] * a[p, c]


@routine
def solve(factors, x):
    """Replace the right side ``x``, in the order of the state vector, by the solution."""
    blocks, upper, pivots = factors.blocks, factors.upper, factors.pivots
    z, m = blocks.shape[2], factors.bodies.shape[0]
    body = ROLLER_STATES * z
    for r in range(ROLLER_STATES):
        for c in range(r):
            for j in range(z):
                x[r * z + j] -= blocks[r, c, j] * x[c * z + j]
    for r in range(ROLLER_STATES - 1, -1, -1):
        for c in range(r + 1, ROLLER_STATES):
            for j in range(z):
                x[r * z + j] -= blocks[r, c, j] * x[c * z + j]
        for j in range(z):
            x[r * z + j] *= blocks[r, r, j]
    for a in range(factors.pushed.size):
        total = 0.0
        for c in range(ROLLER_STATES):
            for j in range(z):
                total += factors.lower[a, c, j] * x[c * z + j]
        x[body + factors.pushed[a]] -= total
    dense = factors.bodies
    # Rows of L were exchanged together with those of the matrix, so all exchanges come first.
    for p in range(m):
        x[body + p], x[body + pivots[p]] = x[body + pivots[p]], x[body + p]
    for p in range(m):
        for r in range(p + 1, m):
            x[body + r] -= dense[r, p] * x[body + p]
    for r in range(m - 1, -1, -1):
        for c in range(r + 1, m):
            x[body + r] -= dense[r, c] * x[body + c]
        x[body + r] *= dense[r, r]
    for r in range(ROLLER_STATES):
        for j in range(z):
            total = 0.0
            for b in range(m):
                total += upper[r, j, b] * x[body + b]
            x[r * z + j] -= total


class OneRoller(NamedTuple):
    """A bearing that holds one roller, which is changed in place, and what its right-hand side needs."""

    bearing: RollerBearing
    y: NDArray[np.float64]
    dy: NDArray[np.float64]  # (2, size): after a change and before it
    power: NDArray[np.float64]
    loads: NDArray[np.float64]
    scratch: Scratch


class Differences(NamedTuple):
    """Jacobian, gradients of the powers, increments of the differences, and the bearing that holds one roller."""

    matrix: ArrowMatrix
    power: NDArray[np.float64]  # (POWERS, n)
    increments: NDArray[np.float64]
    roller: OneRoller


@law
def take_size(sizes, roller, j):
    """Give the bearing ``roller`` the size of roller ``j``."""


@take_size.body(EqualRollers)
def _(sizes, roller, j):
    pass


@take_size.body(UnequalRollers)
def _(sizes, roller, j):
    roller.sizes.radii[:] = sizes.radii[j]


@routine
def jacobian(bearing, y, stage, k, row, power, loads, scratch, differences):
    """Fill ``differences`` for the state ``y``, whose right-hand side is in row 0; row ``row`` is work space."""
    z, m = bearing.rollers, differences.matrix.bodies.shape[0]
    body = ROLLER_STATES * z
    for i in range(y.size):
        stage[i] = y[i]
    for b in range(m):
        stage[body + b] = y[body + b] + differences.increments[body + b]
        per = 1.0 / (stage[body + b] - y[body + b])
        derivative(bearing, stage, row, k, power, loads, scratch)
        stage[body + b] = y[body + b]
        for r in range(ROLLER_STATES):
            for j in range(z):
                differences.matrix.upper[r, j, b] = (k[row, r * z + j] - k[0, r * z + j]) * per
        for a in range(m):
            differences.matrix.bodies[a, b] = (k[row, body + a] - k[0, body + a]) * per
        for p in range(POWERS):
            differences.power[p, body + b] = (power[row, p] - power[0, p]) * per
    roller = differences.roller
    single = roller.bearing
    for b in range(m):
        roller.y[ROLLER_STATES + b] = y[body + b]
    for j in range(z):
        single.pocket_cos[0], single.pocket_sin[0] = bearing.pocket_cos[j], bearing.pocket_sin[j]
        take_size(bearing.sizes, single, j)
        for c in range(ROLLER_STATES):
            roller.y[c] = y[c * z + j]
        # Column ROLLER_STATES stands for the roller unchanged, from which the others differ: one call, compiled once.
        for c in range(ROLLER_STATES, -1, -1):
            place = c * z + j
            if c < ROLLER_STATES:
                roller.y[c] = y[place] + differences.increments[place]
            derivative(single, roller.y, c // ROLLER_STATES, roller.dy, roller.power, roller.loads, roller.scratch)
            if c < ROLLER_STATES:
                per = 1.0 / (roller.y[c] - y[place])
                roller.y[c] = y[place]
                roller_column(differences, c, j, z, per)


@kernel
def roller_column(differences, c, j, z, per):
    """Column ``c`` of roller ``j`` from the right-hand sides of its bearing: row 1 unchanged, row 0 changed."""
    matrix, dy, power = differences.matrix, differences.roller.dy, differences.roller.power
    for r in range(ROLLER_STATES):
        matrix.blocks[r, c, j] = (dy[0, r] - dy[1, r]) * per
    for a in range(matrix.pushed.size):
        row = ROLLER_STATES + matrix.pushed[a]
        matrix.lower[a, c, j] = (dy[0, row] - dy[1, row]) * per
    for p in range(POWERS):
        differences.power[p, c * z + j] = (power[0, p] - power[1, p]) * per


STAGES = 6
# Rows of a right-hand side, as integers of numpy: each plain one would be compiled anew.
START_ROW, NEXT_ROW, END_ROW = np.int64(0), np.int64(1), np.int64(STAGES)
GAMMA = 0.25
# Row s: weights of the stages before it in the state at which stage s is evaluated, and divided by h in its right side.
A = np.array(
    [
        [0, 0, 0, 0, 0],
        [1.544, 0, 0, 0, 0],
        [0.9466785280815826, 0.2557011698983284, 0, 0, 0],
        [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0, 0],
        [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 0],
        [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1],
    ]
)
C = np.array(
    [
        [0, 0, 0, 0, 0],
        [-5.6688, 0, 0, 0, 0],
        [-2.430093356833875, -0.2063599157091915, 0, 0, 0],
        [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0, 0],
        [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0],
        [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
    ]
)
# Weights of stages 1 to 5 in the quadratic and the cubic part of the dense output.
D_2 = np.array([10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662])
D_3 = np.array([-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872])


class Rodas(NamedTuple):
    """The method and what one run of it works on. Arrays, changed in place; numbers as in ``advance``."""

    u: NDArray[np.float64]  # (6, n) stages
    work: NDArray[np.float64]  # (6, POWERS) stages of the works
    dense: NDArray[np.float64]  # (2, n) quadratic and cubic part of the dense output
    differences: Differences
    factors: ArrowMatrix
    last: int = STAGES
    free: int = 1
    exponent: float = 0.25
    beta: float = 0.0
    rejected: float = 0.25


@laws.begin.body(Rodas)
def _(method, bearing, y, k, power, loads, scratch, clock, counts):
    derivative_once(bearing, y, START_ROW, k, power, loads, scratch)
    counts[DERIVATIVES] += 1
    return -1


@laws.trial_step.body(Rodas)
def _(method, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h):
    if not refused:
        # Right-hand sides of one roller count as their share.
        jacobian(bearing, y, stage, k, NEXT_ROW, power, loads, scratch, method.differences)
        counts[DERIVATIVES] += ROLLER_STATES + 1 + method.factors.bodies.shape[0]
    n, u, per_step = y.size, method.u, 1.0 / h
    shifted(method.differences.matrix, per_step / GAMMA, method.factors)
    factor(method.factors)
    for s in range(u.shape[0]):
        if s > 0:
            for i in range(n):
                stage[i] = y[i]
            for p in range(s):
                for i in range(n):
                    stage[i] += A[s, p] * u[p, i]
            derivative_once(bearing, stage, s, k, power, loads, scratch)
        for i in range(n):
            u[s, i] = k[s, i]
        for p in range(s):
            weight = C[s, p] * per_step
            for i in range(n):
                u[s, i] += weight * u[p, i]
        solve(method.factors, u[s])
        stage_work(method, power, s, h)
    counts[DERIVATIVES] += STAGES - 1
    for i in range(n):
        stage[i] += u[STAGES - 1, i]


@routine
def stage_work(method, power, s, h):
    """Stage ``s`` of the works: they act on nothing, so that each follows from the stage of the state."""
    gradients, u = method.differences.power, method.u
    for p in range(POWERS):
        rate = power[s, p]
        for i in range(u.shape[1]):
            rate += gradients[p, i] * u[s, i]
        for earlier in range(s):
            rate += C[s, earlier] / h * method.work[earlier, p]
        method.work[s, p] = GAMMA * h * rate


@laws.error_norm.body(Rodas)
def _(method, k, h, inverse_tolerance):
    total = 0.0
    for i in range(inverse_tolerance.size):
        scaled = method.u[STAGES - 1, i] * inverse_tolerance[i]
        total += scaled * scaled
    return math.sqrt(total)


@laws.step_error.body(Rodas)
def _(method, k, h, i):
    return method.u[STAGES - 1, i]


@laws.test_stiffness.body(Rodas)
def _(method, k, stiffness, h, inverse_tolerance):
    pass


@laws.end_step.body(Rodas)
def _(method, bearing, stage, k, power, loads, scratch, counts):
    derivative_once(bearing, stage, END_ROW, k, power, loads, scratch)
    counts[DERIVATIVES] += 1
    u, dense = method.u, method.dense
    for i in range(u.shape[1]):
        quadratic = cubic = 0.0
        for s in range(STAGES - 1):
            quadratic += D_2[s] * u[s, i]
            cubic += D_3[s] * u[s, i]
        dense[0, i], dense[1, i] = quadratic, cubic


@laws.interpolate.body(Rodas)
def _(method, y, end, k, h, theta, i):
    left = 1.0 - theta
    return y[i] * left + theta * (end[i] + left * (method.dense[0, i] + theta * method.dense[1, i]))


@laws.work_done.body(Rodas)
def _(method, power, h, p):
    total = method.work[STAGES - 1, p]
    for s in range(STAGES - 1):
        total += A[STAGES - 1, s] * method.work[s, p]
    return total


@laws.to_fixed_axes_at.body(Rodas)
def _(method, clock, time, z, y):
    pass


@laws.next_frame.body(Rodas)
def _(method, clock, h, z, y, k):
    pass


def rodas(layout: Layout, bearing: RollerBearing, increments: NDArray[np.float64]) -> Rodas:
    """The method with work space for a bearing; ``increments`` (n,): of the difference quotients of its Jacobian."""
    n = layout.size
    return Rodas(
        np.zeros((STAGES, n)),
        np.zeros((STAGES, POWERS)),
        np.zeros((2, n)),
        differences_of(layout, bearing, increments),
        arrow_matrix(layout),
    )


def differences_of(layout: Layout, bearing: RollerBearing, increments: NDArray[np.float64]) -> Differences:
    """Storage for the Jacobian of a bearing."""
    gradients = np.zeros((POWERS, layout.size))
    return Differences(arrow_matrix(layout), gradients, increments, one_roller(bearing, layout.size))


def one_roller(bearing: RollerBearing, size: int) -> OneRoller:
    """The same bearing, of the same types of laws, with room for one roller."""
    moved = ROLLER_STATES * (bearing.rollers - 1)
    single = bearing._replace(
        rollers=1,
        sizes=bearing.sizes if isinstance(bearing.sizes, EqualRollers) else UnequalRollers(np.zeros(VECTOR)),
        pocket_cos=np.ones(1),
        pocket_sin=np.zeros(1),
        drive=_moved(bearing.drive, moved),
        outer_ring=_moved(bearing.outer_ring, moved),
    )
    rows = size - moved
    return OneRoller(
        single, np.zeros(rows), np.zeros((2, rows)), np.zeros((2, POWERS)), np.zeros((2, LOADS)), scratch(1)
    )


def _moved(part: Any, by: int) -> Any:
    """A part whose coordinates stand further forward by ``by``, where it has any."""
    return part._replace(start=part.start - by) if hasattr(part, "start") else part
