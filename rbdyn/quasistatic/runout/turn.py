"""The path of a ring that turns over form errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rbdyn.faults import RunError
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.newton import COUNTERS, space
from rbdyn.quasistatic.row.ring import BALL, RING
from rbdyn.quasistatic.row.row import Row, component_lengths
from rbdyn.quasistatic.runout.measures import Runout, runout
from rbdyn.quasistatic.runout.race_errors import BallPath
from rbdyn.quasistatic.runout.walk import LARGEST_LOAD, RESIDUAL, TOLD, WALKED, walk

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Followed:
    """Path of the inner ring. ``path``: displacements x, y, z [m], theta_x, theta_y [rad], (steps, 5).

    ``ring_angle`` [rad]; ``largest_load``: of any ball on any race at each step [N]; ``residual``: the largest force left
    over in any step [N]; ``newton_steps, assemblies``: of all steps together.
    """

    ring_angle: Array
    path: Array
    largest_load: Array
    residual: float
    newton_steps: int
    assemblies: int
    turns: int

    def runout(self, face_radius: float) -> Runout:
        """Runout of the path; ``face_radius``: where an axial indicator touches [m]."""
        return runout(self.path, self.turns, face_radius)

    def table(self) -> pd.DataFrame:
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
    unit = component_lengths(row.lever)
    free = np.ones(RING) if given is None else np.where(np.isnan(given), 1.0, 0.0)
    q = np.zeros(RING) if given is None else np.where(free > 0.0, 0.0, given) * unit
    changes = np.stack(
        (
            np.cos(balls.azimuth),
            np.sin(balls.azimuth),
            row.axial + balls.axial,
            row.radial + balls.radial,
            row.inner_reach + balls.inner_reach,
            row.outer_reach + balls.outer_reach,
        )
    )
    # The walk writes over its row.
    cosine, sine, axial, radial, inner_reach, outer_reach = np.zeros((6, size))
    own = row._replace(
        cosine=cosine, sine=sine, axial=axial, radial=radial, inner_reach=inner_reach, outer_reach=outer_reach
    )
    path, told, walked = np.zeros((steps, RING)), np.zeros((steps, TOLD)), np.zeros(WALKED, np.int64)
    reached = walk(
        control,
        own,
        np.asarray(load, float) / unit,
        free,
        changes,
        q,
        np.zeros((size, BALL)),
        space(size),
        np.zeros(COUNTERS, np.int64),
        path,
        told,
        walked,
    )
    if reached < steps:
        raise RunError(
            f"runout: no equilibrium at step {reached + 1} of {steps}; lessen the form errors or raise the load"
        )
    return Followed(
        ring_angle=balls.ring_angle,
        path=path / unit,
        largest_load=told[:, LARGEST_LOAD],
        residual=float(told[:, RESIDUAL].max()),
        newton_steps=int(walked[0]),
        assemblies=int(walked[1]),
        turns=turns,
    )
