"""Equilibrium of one row of balls, called from Python: ``solve`` and its ``Solution``."""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import entry, routine
from rbdyn.quasistatic.row import newton, ring
from rbdyn.quasistatic.row.ball import Control, ball_forces, spring

# Figures of a ball.
INNER_LOAD, OUTER_LOAD, INNER_ANGLE, OUTER_ANGLE, PULL, MOMENT, FIGURES = range(7)
OK = "ok"
# A figure below this share of the largest of its kind is rounding and set to zero, as symmetry often demands.
RESOLUTION = 1e-12
# Ball load [N] below which a ball counts as unloaded, and the least displacement [m] with which others are compared.
NO_LOAD, MOTION = 1e-9, 1e-6
SENTENCES = {newton.NOT_CONVEX_MINIMUM: "no equilibrium was found even with one common cage speed"}
LOST = (
    "no equilibrium was found with this raceway control, only with one common cage speed: the control or friction leaves the "
    "balls none, or several; raise model.light_load_share or set model.raceway_control = 'common_cage'"
)


class Solution(NamedTuple):
    """Equilibrium of one row of Z balls. Arrays (Z,) unless said otherwise; angles in rad, forces in N, lengths in m.

    ``displacement``: (x, y, z, theta_x, theta_y) of the inner ring [m, rad]. ``balls`` (Z, 2): position (axial, radial) of
    each centre from its outer groove centre. ``depths`` (Z, 2): depth of its contacts (inner, outer). ``reaction`` (5,):
    load that the ring takes [N, N m]. ``stiffness`` (5, 5): derivative of the reaction by the displacement. ``residual``:
    largest unbalanced force [N]. ``status``: "ok", or the cause of the failure. ``steps, strides``: Newton steps, and
    continuation steps of the race control. ``searches``: starting values that the finite search tried, None for other solvers.
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
    def is_equilibrium(self) -> bool:
        """Whether this is an equilibrium."""
        return self.status == OK

    @property
    def figures(self) -> Array:
        """(Z, FIGURES): figures of the balls, as ``solve_row`` gives them."""
        return np.stack(self[3:9], axis=1)


def without_noise(values: Any, largest: Any) -> Any:
    """``values`` with 0 for those below the resolution of the ``largest`` of their kind, which broadcasts."""
    return np.where(np.abs(values) <= RESOLUTION * largest, 0.0, values)


def without_rounding(q: Any, reaction: Any, matrix: Any, figures: Any, lever: Any) -> Any:
    """Results of ``solve_row``, (..., 5), (..., 5), (..., 5, 5) and (..., Z, FIGURES), with rounding set to 0.

    Displacement (at least ``MOTION``) and stiffness are compared with their largest entry, the reaction with the largest contact
    load, and angles with 1 rad. Gyroscopic moments are compared with the centrifugal force times ``lever`` (...) [m].
    """
    most = figures[..., [INNER_LOAD, OUTER_LOAD]].max(axis=(-2, -1))
    pull = np.abs(figures[..., PULL]).max(axis=-1) * lever
    largest = np.zeros(figures.shape)
    largest[..., [INNER_ANGLE, OUTER_ANGLE]], largest[..., MOMENT] = 1.0, pull[..., np.newaxis]
    largest[..., [INNER_LOAD, OUTER_LOAD]] = NO_LOAD / RESOLUTION
    return (
        without_noise(q, np.abs(q).max(axis=-1, keepdims=True, initial=MOTION)),
        without_noise(reaction, most[..., np.newaxis]),
        without_noise(matrix, np.abs(matrix).max(axis=(-2, -1), keepdims=True)),
        without_noise(figures, largest),
    )


@routine
def fill_figures(task: Any, state: Any, figures: Any) -> None:
    """Fill ``figures`` (Z, FIGURES) with loads, angles, centrifugal forces and gyroscopic moments, after ``assemble``."""
    row, balls = task.row, state.balls
    for j in range(row.cosine.size):
        a_axial, a_radial = ring.groove_centre(row, state.q, j)
        x, y = balls[j, 0], balls[j, 1]
        figures[j, INNER_ANGLE] = math.atan2(a_axial - x, a_radial - y)
        figures[j, OUTER_ANGLE] = math.atan2(x, y)
        figures[j, INNER_LOAD], _ = spring(balls[j, ring.INNER_DEPTH], row.inner_stiffness)
        figures[j, OUTER_LOAD], _ = spring(balls[j, ring.OUTER_DEPTH], row.outer_stiffness)
        figures[j, PULL], figures[j, MOMENT] = row.centrifugal_force, 0.0
        if state.work[j, ring.LOADED] > 0.0:
            _, _, _, _, _, _, figures[j, PULL], figures[j, MOMENT] = ball_forces(
                task.control, 1.0, row, a_axial, a_radial, x, y, balls[j, ring.INNER_DEPTH], balls[j, ring.OUTER_DEPTH]
            )
        else:
            # A lifted ball touches the outer race alone and has no inner angle of its own.
            figures[j, INNER_LOAD], figures[j, INNER_ANGLE] = 0.0, figures[j, OUTER_ANGLE]
            figures[j, OUTER_LOAD] = row.centrifugal_force


@entry
def solve_row(task: Any, warm: bool, state: Any, figures: Any) -> tuple[int, float]:
    """``newton.find`` the equilibrium and fill ``figures`` (Z, FIGURES). Returns the outcome and the residual [N]."""
    state.counts[:] = 0
    outcome = newton.find(task, warm, state)
    _, worst = ring.unbalance(task, state)
    fill_figures(task, state, figures)
    return outcome, worst


def solve(
    row: ring.Row, control: Control, load: Array, constraint: Array | None = None, start: Solution | None = None
) -> Solution:
    """Equilibrium of a row under ``load`` (Fx, Fy, Fz [N], Mx, My [N m]) on the inner ring.

    ``constraint`` (5,): prescribed displacements [m, rad], NaN where the load rules; the load of a prescribed component is
    ignored. ``start``: a solution nearby. Nothing is raised where there is no equilibrium: see ``status``.
    """
    size = row.cosine.size
    force, free, displacement = newton.boundary_conditions(row, load, constraint)
    state, figures = newton.space(size), np.zeros((size, FIGURES))
    state.q[:] = displacement
    if start is not None:
        state.q[:] = np.where(free > 0.0, start.displacement * ring.component_lengths(row.lever), displacement)
        state.balls[:] = np.hstack((start.balls, start.depths))
    outcome, worst = solve_row(newton.Task(control, row, force, free), start is not None, state, figures)
    return solution_of(row, state, figures, OK if outcome == newton.CONVERGED else SENTENCES.get(outcome, LOST), worst)


def solution_of(
    row: ring.Row, state: newton.Space, figures: Array, status: str, residual: float, searches: int | None = None
) -> Solution:
    """Solution in its own units and names, from the state at the end of a solve."""
    unit = ring.component_lengths(row.lever)
    q, reaction, matrix, figures = without_rounding(
        state.q, state.sums[ring.REACTION : ring.REACTION + ring.RING], state.matrix, figures, row.lever
    )
    return Solution(
        displacement=q / unit,
        balls=state.balls[:, : ring.INNER_DEPTH],
        depths=state.balls[:, ring.INNER_DEPTH :],
        inner_load=figures[:, INNER_LOAD],
        outer_load=figures[:, OUTER_LOAD],
        inner_angle=figures[:, INNER_ANGLE],
        outer_angle=figures[:, OUTER_ANGLE],
        centrifugal_force=figures[:, PULL],
        gyroscopic_moment=figures[:, MOMENT],
        reaction=reaction * unit,
        stiffness=matrix * np.outer(unit, unit),
        status=status,
        residual=residual,
        steps=int(state.counts[newton.STEPS]),
        strides=int(state.counts[newton.STRIDES]),
        searches=searches,
    )
