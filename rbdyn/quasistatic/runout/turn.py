"""The path of a ring that turns over form errors, step by step."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RunError
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.newton import Task, posed, space
from rbdyn.quasistatic.row.ring import RING, Row, component_lengths
from rbdyn.quasistatic.runout.measures import Runout, runout
from rbdyn.quasistatic.runout.race_errors import BallPath
from rbdyn.quasistatic.runout.walk import FIGURES, LARGEST_LOAD, RESIDUAL, walk

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Followed:
    """Path of the inner ring. ``path``: displacements x, y, z [m], theta_x, theta_y [rad], (steps, 5).

    ``ring_angle`` [rad]; ``largest_load``: of any ball on any race at each step [N]; ``residual``: the largest force left
    over in any step [N]; ``newton_steps``: of all steps together.
    """

    ring_angle: Array
    path: Array
    largest_load: Array
    residual: float
    newton_steps: int
    turns: int

    def runout(self, face_radius: float) -> Runout:
        """Runout of the path; ``face_radius``: where an axial indicator touches [m]."""
        return runout(self.path, self.turns, face_radius)

    def table(self) -> "pd.DataFrame":
        """One line a step; units in the names."""
        import pandas as pd

        columns = ("x_um", "y_um", "z_um", "tilt_x_urad", "tilt_y_urad")
        frame = pd.DataFrame(1e6 * self.path, columns=list(columns))
        frame.insert(0, "ring_angle_deg", np.degrees(self.ring_angle))
        frame["largest_load_N"] = self.largest_load
        return frame


def follow(
    row: Row, control: Control, load: Array, balls: BallPath, turns: int, given: Array | None = None
) -> Followed:
    """Solve the equilibrium at every step of ``balls``, each from the one before.

    ``row`` is the nominal row; its own places and reaches count, the changes of ``balls`` are added. Other arguments as
    of ``equilibrium.solve``. Raises RunError naming the step where no equilibrium is found.
    """
    steps, size = balls.azimuth.shape
    force, free, held = posed(row, load, given)
    # Places and reaches, in the one order of ``Row`` and ``BallPath``.
    places = (own + change for own, change in zip(row[2:6], balls[2:6], strict=True))
    changes = np.stack((np.cos(balls.azimuth), np.sin(balls.azimuth), *places))
    # The walk writes over its row.
    own = Row._make((*np.zeros((6, size)), *row[6:]))
    at = space(size)
    at.q[:] = held
    path, figures = np.zeros((steps, RING)), np.zeros((steps, FIGURES))
    reached, newton_steps = walk(Task(control, own, force, free), changes, at, path, figures)
    if reached < steps:
        what = f"runout: no equilibrium at step {reached + 1} of {steps}"
        raise RunError(f"{what}; lessen the form errors or raise the load")
    return Followed(
        ring_angle=balls.ring_angle,
        path=path / component_lengths(row.lever),
        largest_load=figures[:, LARGEST_LOAD],
        residual=float(figures[:, RESIDUAL].max()),
        newton_steps=newton_steps,
        turns=turns,
    )
