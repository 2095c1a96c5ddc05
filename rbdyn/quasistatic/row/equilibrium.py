"""Equilibrium of one row of balls: what Python calls."""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry, routine
from rbdyn.quasistatic.row.ball import Control, ball_forces, spring
from rbdyn.quasistatic.row.newton import CONVERGED, NOT_CONVEX_MINIMUM, STEPS, STRIDES, Space, Task, find, posed, space
from rbdyn.quasistatic.row.ring import (
    INNER_DEPTH,
    LOADED,
    OUTER_DEPTH,
    RING,
    TAKEN,
    Row,
    component_lengths,
    groove_centre,
    unbalance,
)

# Figures of a ball.
INNER_LOAD, OUTER_LOAD, INNER_ANGLE, OUTER_ANGLE, PULL, MOMENT, FIGURES = range(7)
OK = "ok"
# A figure below this share of the largest of its kind is rounding: where symmetry makes it zero, it is set to zero.
RESOLUTION = 1e-12
SENTENCES = {NOT_CONVEX_MINIMUM: "no equilibrium was found even with one common cage speed"}
LOST = (
    "no equilibrium was found with this raceway control, only with one common cage speed: the control or friction leaves the "
    "balls none, or several; raise model.light_load_share or set model.raceway_control = 'common_cage'"
)


class Solution(NamedTuple):
    """Equilibrium of one row of Z balls. Arrays (Z,) unless said otherwise; angles in rad, forces in N, lengths in m.

    ``displacement``: (x, y, z, theta_x, theta_y) of the inner ring [m, rad]. ``balls`` (Z, 2): place of each centre, (axial,
    radial) from its outer groove centre; ``depths`` (Z, 2): how deep its contacts are, (inner, outer). ``reaction`` (5,): the load that the ring takes [N, N m]. ``stiffness`` (5, 5): its
    derivative by the displacement. ``residual``: the largest force left over [N]. ``status``: "ok" or why there is none.
    ``steps, strides``: Newton steps, and continuations of the race control.
    ``searches``: starting values that the finite search tried; None for a solver that searches for none.
    """

    displacement: Array
    balls: Array
    depths: Array
    inner_load: Array
    outer_load: Array
    inner_angle: Array
    outer_angle: Array
    centrifugal_force: Array
    gyroscopic_moment: Array
    reaction: Array
    stiffness: Array
    status: str
    residual: float
    steps: int
    strides: int
    searches: int | None = None

    @property
    def found(self) -> bool:
        """Whether this is an equilibrium."""
        return self.status == OK

    @property
    def figures(self) -> Array:
        """(Z, FIGURES): figures of the balls, as ``solve_row`` gives them."""
        return np.stack(self[3:9], axis=1)


def without_noise(values: Any, largest: Any) -> Any:
    """``values`` with 0 for those below the resolution of the ``largest`` of their kind, which broadcasts."""
    return np.where(np.abs(values) <= RESOLUTION * largest, 0.0, values)


def resolved(q: Any, taken: Any, matrix: Any, figures: Any, lever: Any) -> Any:
    """What ``solve_row`` left (..., 5), (..., 5), (..., 5, 5) and (..., Z, FIGURES), with 0 for what is below its resolution.

    Displacement and stiffness against their largest entry, the load that the ring takes against the largest contact load, angles
    against 1 rad, gyroscopic moments against centrifugal force times ``lever`` (...) [m].
    """
    most = figures[..., [INNER_LOAD, OUTER_LOAD]].max(axis=(-2, -1))
    pull = np.abs(figures[..., PULL]).max(axis=-1) * lever
    largest = np.zeros(figures.shape)
    largest[..., [INNER_ANGLE, OUTER_ANGLE]], largest[..., MOMENT] = 1.0, pull[..., np.newaxis]
    return (
        without_noise(q, np.abs(q).max(axis=-1, keepdims=True)),
        without_noise(taken, most[..., np.newaxis]),
        without_noise(matrix, np.abs(matrix).max(axis=(-2, -1), keepdims=True)),
        without_noise(figures, largest),
    )


@routine
def fill_figures(task: Any, at: Any, figures: Any) -> None:
    """Fill ``figures`` (Z, FIGURES) with angles, loads and what the balls' motion does to them, ``at`` as ``assemble`` left it."""
    row, balls = task.row, at.balls
    for j in range(row.cosine.size):
        a_axial, a_radial = groove_centre(row, at.q, j)
        x, y = balls[j, 0], balls[j, 1]
        figures[j, INNER_ANGLE] = math.atan2(a_axial - x, a_radial - y)
        figures[j, OUTER_ANGLE] = math.atan2(x, y)
        figures[j, INNER_LOAD], _ = spring(balls[j, INNER_DEPTH], row.inner_stiffness)
        figures[j, OUTER_LOAD], _ = spring(balls[j, OUTER_DEPTH], row.outer_stiffness)
        figures[j, PULL], figures[j, MOMENT] = row.centrifugal_force, 0.0
        if at.work[j, LOADED] > 0.0:
            _, _, _, _, _, _, figures[j, PULL], figures[j, MOMENT] = ball_forces(
                task.control, 1.0, row, a_axial, a_radial, x, y, balls[j, INNER_DEPTH], balls[j, OUTER_DEPTH]
            )
        else:
            # A lifted ball lies on the outer race alone and has no inner angle of its own.
            figures[j, INNER_LOAD], figures[j, INNER_ANGLE] = 0.0, figures[j, OUTER_ANGLE]
            figures[j, OUTER_LOAD] = row.centrifugal_force


@entry
def solve_row(task: Any, warm: bool, at: Any, figures: Any) -> tuple[int, float]:
    """``newton.find`` the equilibrium and fill ``figures`` (Z, FIGURES). Returns the outcome and the residual [N]."""
    at.counts[:] = 0
    outcome = find(task, warm, at)
    _, worst = unbalance(task, at)
    fill_figures(task, at, figures)
    return outcome, worst


def solve(
    row: Row, control: Control, load: Array, given: Array | None = None, start: Solution | None = None
) -> Solution:
    """Equilibrium of a row under ``load`` (Fx, Fy, Fz [N], Mx, My [N m]) on the inner ring.

    ``given`` (5,): prescribed displacements [m, rad], NaN where the load rules; where one is prescribed the load there is not
    used. ``start``: a solution nearby; without it the start cannot fail. Never raises for want of an equilibrium: see
    ``status``.
    """
    size = row.cosine.size
    force, free, held = posed(row, load, given)
    at, figures = space(size), np.zeros((size, FIGURES))
    at.q[:] = held
    if start is not None:
        at.q[:] = np.where(free > 0.0, start.displacement * component_lengths(row.lever), held)
        at.balls[:] = np.hstack((start.balls, start.depths))
    outcome, worst = solve_row(Task(control, row, force, free), start is not None, at, figures)
    return solution_of(row, at, figures, OK if outcome == CONVERGED else SENTENCES.get(outcome, LOST), worst)


def solution_of(
    row: Row, at: Space, figures: Array, status: str, residual: float, searches: int | None = None
) -> Solution:
    """What a solve left, in the units and names of a Solution."""
    unit = component_lengths(row.lever)
    q, taken, matrix, figures = resolved(at.q, at.sums[TAKEN : TAKEN + RING], at.matrix, figures, row.lever)
    return Solution(
        displacement=q / unit,
        balls=at.balls[:, :INNER_DEPTH],
        depths=at.balls[:, INNER_DEPTH:],
        inner_load=figures[:, INNER_LOAD],
        outer_load=figures[:, OUTER_LOAD],
        inner_angle=figures[:, INNER_ANGLE],
        outer_angle=figures[:, OUTER_ANGLE],
        centrifugal_force=figures[:, PULL],
        gyroscopic_moment=figures[:, MOMENT],
        reaction=taken * unit,
        stiffness=matrix * np.outer(unit, unit),
        status=status,
        residual=residual,
        steps=int(at.counts[STEPS]),
        strides=int(at.counts[STRIDES]),
        searches=searches,
    )
