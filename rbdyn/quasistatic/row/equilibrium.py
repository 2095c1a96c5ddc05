"""Equilibrium of one row of balls: what Python calls."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry, routine
from rbdyn.quasistatic.row.ball import ball_forces, spring
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.newton import CONVERGED, COUNTERS, NOT_CONVEX_MINIMUM, Space, find, space, unbalance
from rbdyn.quasistatic.row.place import groove_centre
from rbdyn.quasistatic.row.ring import BALL, INNER_DEPTH, LOADED, OUTER_DEPTH, RING, TAKEN
from rbdyn.quasistatic.row.row import Row, component_lengths

# What ``tell`` leaves of a ball.
INNER_LOAD, OUTER_LOAD, INNER_ANGLE, OUTER_ANGLE, PULL, MOMENT, TOLD = range(7)
OK = "ok"
# A figure below this share of the largest of its kind is rounding: where symmetry makes it zero, it is told as zero.
RESOLUTION = 1e-12
SENTENCES = {NOT_CONVEX_MINIMUM: "no equilibrium was found even with one common cage speed"}
LOST = (
    "no equilibrium was found with this raceway control, only with one common cage speed: the control or friction leaves the "
    "balls none, or several; raise model.light_load_share or set model.raceway_control = 'common_cage'"
)


class Solution(NamedTuple):
    """Equilibrium of one row of Z balls. Arrays (Z,) unless told; angles in rad, forces in N, lengths in m.

    ``displacement``: (x, y, z, theta_x, theta_y) of the inner ring [m, rad]. ``balls`` (Z, 2): place of each centre, (axial,
    radial) from its outer groove centre; ``depths`` (Z, 2): how deep its contacts are, (inner, outer). ``reaction`` (5,): the load that the ring takes [N, N m]. ``stiffness`` (5, 5): its
    derivative by the displacement. ``residual``: the largest force left over [N]. ``status``: "ok" or why there is none.
    ``steps, assemblies, strides``: Newton steps, evaluations of all balls, and continuations of the race control.
    ``searches``: starting values that the finite search tried; None for a solver that searches for none.
    """

    displacement: NDArray[np.float64]
    balls: NDArray[np.float64]
    depths: NDArray[np.float64]
    inner_load: NDArray[np.float64]
    outer_load: NDArray[np.float64]
    inner_angle: NDArray[np.float64]
    outer_angle: NDArray[np.float64]
    centrifugal_force: NDArray[np.float64]
    gyroscopic_moment: NDArray[np.float64]
    reaction: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    status: str
    residual: float
    steps: int
    assemblies: int
    strides: int
    searches: int | None = None

    @property
    def found(self) -> bool:
        """Whether this is an equilibrium."""
        return self.status == OK

    @property
    def told(self) -> NDArray[np.float64]:
        """(Z, TOLD): what ``solve_row`` told of the balls."""
        return np.stack(self[3:9], axis=1)


def without_noise(values: Any, largest: Any) -> Any:
    """``values`` with 0 for those below the resolution of the ``largest`` of their kind, which broadcasts."""
    return np.where(np.abs(values) <= RESOLUTION * largest, 0.0, values)


def resolved(q: Any, taken: Any, matrix: Any, told: Any, lever: Any) -> Any:
    """What ``solve_row`` left (..., 5), (..., 5), (..., 5, 5) and (..., Z, TOLD), with 0 for what is below its resolution.

    Displacement and stiffness against their largest entry, the load that the ring takes against the largest contact load, angles
    against 1 rad, gyroscopic moments against centrifugal force times ``lever`` (...) [m].
    """
    most = told[..., [INNER_LOAD, OUTER_LOAD]].max(axis=(-2, -1))
    pull = np.abs(told[..., PULL]).max(axis=-1) * lever
    largest = np.zeros(told.shape)
    largest[..., [INNER_ANGLE, OUTER_ANGLE]], largest[..., MOMENT] = 1.0, pull[..., np.newaxis]
    return (
        without_noise(q, np.abs(q).max(axis=-1, keepdims=True)),
        without_noise(taken, most[..., np.newaxis]),
        without_noise(matrix, np.abs(matrix).max(axis=(-2, -1), keepdims=True)),
        without_noise(told, largest),
    )


@routine
def tell(control: Any, row: Any, q: Any, balls: Any, work: Any, told: Any) -> None:
    """Fill ``told`` (Z, TOLD) with angles, loads and what the balls' motion does to them; ``work`` as ``assemble`` left it."""
    for j in range(row.cosine.size):
        a_axial, a_radial = groove_centre(row, q, j)
        x, y = balls[j, 0], balls[j, 1]
        told[j, INNER_ANGLE] = math.atan2(a_axial - x, a_radial - y)
        told[j, OUTER_ANGLE] = math.atan2(x, y)
        told[j, INNER_LOAD], _ = spring(balls[j, INNER_DEPTH], row.inner_stiffness)
        told[j, OUTER_LOAD], _ = spring(balls[j, OUTER_DEPTH], row.outer_stiffness)
        told[j, PULL], told[j, MOMENT] = row.centrifugal_force, 0.0
        if work[j, LOADED] > 0.0:
            _, _, _, _, _, _, told[j, PULL], told[j, MOMENT] = ball_forces(
                control, 1.0, row, a_axial, a_radial, x, y, balls[j, INNER_DEPTH], balls[j, OUTER_DEPTH]
            )
        else:
            # A lifted ball lies on the outer race alone and has no inner angle of its own.
            told[j, INNER_LOAD], told[j, INNER_ANGLE] = 0.0, told[j, OUTER_ANGLE]
            told[j, OUTER_LOAD] = row.centrifugal_force


@entry
def solve_row(
    control: Any, row: Any, load: Any, free: Any, warm: bool, q: Any, balls: Any, at: Any, counts: Any, told: Any
) -> tuple[int, float]:
    """Find the equilibrium and fill ``told`` (Z, TOLD); see ``newton.find``. Returns the outcome and the residual [N]."""
    counts[:] = 0
    outcome = find(control, row, load, free, warm, q, balls, at, counts)
    _, worst = unbalance(load, free, at.sums)
    tell(control, row, q, balls, at.work, told)
    return outcome, worst


def solve(
    row: Row,
    control: Control,
    load: NDArray[np.float64],
    given: NDArray[np.float64] | None = None,
    start: Solution | None = None,
) -> Solution:
    """Equilibrium of a row under ``load`` (Fx, Fy, Fz [N], Mx, My [N m]) on the inner ring.

    ``given`` (5,): prescribed displacements [m, rad], NaN where the load rules; where one is prescribed the load there is not
    used. ``start``: a solution nearby; without it the start cannot fail. Never raises for want of an equilibrium: see
    ``status``.
    """
    size = row.cosine.size
    unit = component_lengths(row.lever)
    free = np.ones(RING) if given is None else np.where(np.isnan(given), 1.0, 0.0)
    q = np.zeros(RING) if given is None else np.where(free > 0.0, 0.0, given) * unit
    balls = np.zeros((size, BALL))
    if start is not None:
        q = np.where(free > 0.0, start.displacement * unit, q)
        balls[:] = np.hstack((start.balls, start.depths))
    at, counts, told = space(size), np.zeros(COUNTERS, np.int64), np.zeros((size, TOLD))
    outcome, worst = solve_row(
        control, row, np.asarray(load, float) / unit, free, start is not None, q, balls, at, counts, told
    )
    return told_solution(row, at, q, balls, counts, told, outcome, worst)


def told_solution(
    row: Row,
    at: Space,
    q: NDArray[np.float64],
    balls: NDArray[np.float64],
    counts: NDArray[np.int64],
    told: NDArray[np.float64],
    outcome: int,
    worst: float,
) -> Solution:
    """What a compiled solve left, in the units and names of a Solution."""
    unit = component_lengths(row.lever)
    q, taken, matrix, told = resolved(q, at.sums[TAKEN : TAKEN + RING], at.matrix, told, row.lever)
    return Solution(
        displacement=q / unit,
        balls=balls[:, :INNER_DEPTH],
        depths=balls[:, INNER_DEPTH:],
        inner_load=told[:, INNER_LOAD],
        outer_load=told[:, OUTER_LOAD],
        inner_angle=told[:, INNER_ANGLE],
        outer_angle=told[:, OUTER_ANGLE],
        centrifugal_force=told[:, PULL],
        gyroscopic_moment=told[:, MOMENT],
        reaction=taken * unit,
        stiffness=matrix * np.outer(unit, unit),
        status=OK if outcome == CONVERGED else SENTENCES.get(outcome, LOST),
        residual=worst,
        steps=int(counts[0]),
        assemblies=int(counts[1]),
        strides=int(counts[2]),
    )
