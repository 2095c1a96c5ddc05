"""Arrow matrices: each roller couples to itself, and all rollers to the bodies (cage, rings, clock), not to each other.

    | own_1            right_1 |      own_j:   5 x 5, a roller's coordinates among themselves
    |        own_2     right_2 |      right_j: 5 x m, effect of the bodies on roller j
    | left_1 left_2 .. bodies  |      left_j:  m x 5, effect of roller j on the bodies

Elimination takes the rollers first and leaves an m x m system for the bodies (Golub and Van Loan, Matrix Computations,
4.5): work and storage grow with the number of rollers, not with its cube.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import routine
from rbdyn.dynamics.forces.state import PARTS, Layout


class ArrowMatrix(NamedTuple):
    """Blocks of the matrix; after ``factor`` those of its factors. Arrays, changed in place."""

    own: NDArray[np.float64]  # (5, 5, z)
    right: NDArray[np.float64]  # (5, z, m)
    left: NDArray[np.float64]  # (rows that rollers push, 5, z)
    bodies: NDArray[np.float64]  # (m, m)
    pushed: NDArray[np.int64]  # which rows of the bodies those of ``left`` are
    pivots: NDArray[np.int64]  # (m,) row exchanges of the factors


def arrow_matrix(layout: Layout) -> ArrowMatrix:
    """An empty matrix for a state of this layout: rollers push the velocities of cage and rings, nothing else."""
    z, m = layout.rollers, len(layout.bodies)
    pushed = [place for place, part in enumerate(layout.bodies) if part.pushed]
    return ArrowMatrix(
        own=np.zeros((PARTS, PARTS, z)),
        right=np.zeros((PARTS, z, m)),
        left=np.zeros((len(pushed), PARTS, z)),
        bodies=np.zeros((m, m)),
        pushed=np.array(pushed),
        pivots=np.zeros(m, dtype=np.int64),
    )


@routine
def shifted(matrix, shift, result):
    """``shift`` I - ``matrix`` into ``result``."""
    z, m = matrix.own.shape[2], matrix.bodies.shape[0]
    for r in range(PARTS):
        for c in range(PARTS):
            diagonal = shift if r == c else 0.0
            for j in range(z):
                result.own[r, c, j] = diagonal - matrix.own[r, c, j]
        for j in range(z):
            for b in range(m):
                result.right[r, j, b] = -matrix.right[r, j, b]
    for a in range(matrix.pushed.size):
        for c in range(PARTS):
            for j in range(z):
                result.left[a, c, j] = -matrix.left[a, c, j]
    for a in range(m):
        for b in range(m):
            result.bodies[a, b] = (shift if a == b else 0.0) - matrix.bodies[a, b]


@routine
def factor(matrix):
    """Replace the matrix by its factors.

    Rollers without exchange of rows: positions come first, and eliminating them leaves inertia, damping and stiffness of
    the velocities, whose pivots are sound where a step is. A zero pivot shows as values that are not finite.
    """
    own, right = matrix.own, matrix.right
    z, m = own.shape[2], matrix.bodies.shape[0]
    for p in range(PARTS):
        for j in range(z):
            own[p, p, j] = 1.0 / own[p, p, j]
        for r in range(p + 1, PARTS):
            for j in range(z):
                own[r, p, j] *= own[p, p, j]
            for c in range(p + 1, PARTS):
                for j in range(z):
                    own[r, c, j] -= own[r, p, j] * own[p, c, j]
            for j in range(z):
                multiplier = own[r, p, j]
                for b in range(m):
                    right[r, j, b] -= multiplier * right[p, j, b]
    for r in range(PARTS - 1, -1, -1):
        for j in range(z):
            for c in range(r + 1, PARTS):
                multiplier = own[r, c, j]
                for b in range(m):
                    right[r, j, b] -= multiplier * right[c, j, b]
            for b in range(m):
                right[r, j, b] *= own[r, r, j]
    for a in range(matrix.pushed.size):
        row = matrix.pushed[a]
        for c in range(PARTS):
            for j in range(z):
                multiplier = matrix.left[a, c, j]
                for b in range(m):
                    matrix.bodies[row, b] -= multiplier * right[c, j, b]
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
    own, right, pivots = factors.own, factors.right, factors.pivots
    z, m = own.shape[2], factors.bodies.shape[0]
    body = PARTS * z
    for r in range(PARTS):
        for c in range(r):
            for j in range(z):
                x[r * z + j] -= own[r, c, j] * x[c * z + j]
    for r in range(PARTS - 1, -1, -1):
        for c in range(r + 1, PARTS):
            for j in range(z):
                x[r * z + j] -= own[r, c, j] * x[c * z + j]
        for j in range(z):
            x[r * z + j] *= own[r, r, j]
    for a in range(factors.pushed.size):
        total = 0.0
        for c in range(PARTS):
            for j in range(z):
                total += factors.left[a, c, j] * x[c * z + j]
        x[body + factors.pushed[a]] -= total
    lower = factors.bodies
    # Rows of L were exchanged together with those of the matrix, so all exchanges come first.
    for p in range(m):
        x[body + p], x[body + pivots[p]] = x[body + pivots[p]], x[body + p]
    for p in range(m):
        for r in range(p + 1, m):
            x[body + r] -= lower[r, p] * x[body + p]
    for r in range(m - 1, -1, -1):
        for c in range(r + 1, m):
            x[body + r] -= lower[r, c] * x[body + c]
        x[body + r] *= lower[r, r]
    for r in range(PARTS):
        for j in range(z):
            total = 0.0
            for b in range(m):
                total += right[r, j, b] * x[body + b]
            x[r * z + j] -= total
