"""Jacobian of the equations of motion by differences, as an arrow matrix, for any laws.

Rollers feel each other only through the bodies. So the columns of one roller are those of a bearing that holds just
this roller: its land and other terms without the roller drop out of the difference. One Jacobian costs 5 z right-hand
sides of one roller and one full right-hand side a body coordinate.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import kernel, law, routine
from rbdyn.dynamics.forces.equations import POWERS, RollerBearing, derivative
from rbdyn.dynamics.forces.race_lanes import Scratch
from rbdyn.dynamics.forces.races import EqualRollers, UnequalRollers
from rbdyn.dynamics.forces.state import PARTS
from rbdyn.dynamics.integrators.arrow_matrix import ArrowMatrix


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
    one: OneRoller


@law
def take_size(sizes, one, j):
    """Give the bearing ``one`` the size of roller ``j``."""


@take_size.body(EqualRollers)
def _(sizes, one, j):
    pass


@take_size.body(UnequalRollers)
def _(sizes, one, j):
    one.sizes.radii[:] = sizes.radii[j]


@routine
def jacobian(bearing, y, stage, k, row, power, loads, scratch, found):
    """Fill the derivatives of ``found`` for the state ``y``, whose right-hand side stands in row 0; uses row ``row``."""
    z, m = bearing.rollers, found.matrix.bodies.shape[0]
    body = PARTS * z
    for i in range(y.size):
        stage[i] = y[i]
    for b in range(m):
        stage[body + b] = y[body + b] + found.increments[body + b]
        per = 1.0 / (stage[body + b] - y[body + b])
        derivative(bearing, stage, row, k, power, loads, scratch)
        stage[body + b] = y[body + b]
        for r in range(PARTS):
            for j in range(z):
                found.matrix.right[r, j, b] = (k[row, r * z + j] - k[0, r * z + j]) * per
        for a in range(m):
            found.matrix.bodies[a, b] = (k[row, body + a] - k[0, body + a]) * per
        for p in range(POWERS):
            found.power[p, body + b] = (power[row, p] - power[0, p]) * per
    one = found.one
    single = one.bearing
    for b in range(m):
        one.y[PARTS + b] = y[body + b]
    for j in range(z):
        single.pocket_cos[0], single.pocket_sin[0] = bearing.pocket_cos[j], bearing.pocket_sin[j]
        take_size(bearing.sizes, single, j)
        for c in range(PARTS):
            one.y[c] = y[c * z + j]
        # Column PARTS stands for the roller unchanged, from which the others differ: one call, compiled once.
        for c in range(PARTS, -1, -1):
            place = c * z + j
            if c < PARTS:
                one.y[c] = y[place] + found.increments[place]
            derivative(single, one.y, c // PARTS, one.dy, one.power, one.loads, one.scratch)
            if c < PARTS:
                per = 1.0 / (one.y[c] - y[place])
                one.y[c] = y[place]
                roller_column(found, c, j, z, per)


@kernel
def roller_column(found, c, j, z, per):
    """Column ``c`` of roller ``j`` from the right-hand sides of its bearing: row 1 unchanged, row 0 changed."""
    matrix, dy, power = found.matrix, found.one.dy, found.one.power
    for r in range(PARTS):
        matrix.own[r, c, j] = (dy[0, r] - dy[1, r]) * per
    for a in range(matrix.pushed.size):
        row = PARTS + matrix.pushed[a]
        matrix.left[a, c, j] = (dy[0, row] - dy[1, row]) * per
    for p in range(POWERS):
        found.power[p, c * z + j] = (power[0, p] - power[1, p]) * per
