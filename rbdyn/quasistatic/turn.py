"""Equilibrium step by step while the ring turns over its form errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.quasistatic.equilibrium import solve
from rbdyn.quasistatic.race_errors import BallPath
from rbdyn.quasistatic.runout import Runout, runout

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Followed:
    """Path of the inner ring. ``path``: displacements x, y, z [m], theta_x, theta_y [rad], (steps, 5).

    ``ring_angle`` [rad]; ``largest_load``: of any ball at each step [N]; ``iterations``: of the solver in all steps;
    ``residual``: the largest of all steps [N].
    """

    ring_angle: Array
    path: Array
    largest_load: Array
    iterations: int
    residual: float
    turns: int

    def runout(self, face_radius: float) -> Runout:
        """Runout of the path; ``face_radius``: where an axial indicator touches [m]."""
        return runout(self.path, self.turns, face_radius)

    def table(self) -> pd.DataFrame:
        """One line a step, in micrometres and microradians."""
        import pandas as pd

        columns = ("x_um", "y_um", "z_um", "theta_x_urad", "theta_y_urad")
        frame = pd.DataFrame(1e6 * self.path, columns=list(columns))
        frame.insert(0, "ring_angle_deg", np.degrees(self.ring_angle))
        frame["largest_load_N"] = self.largest_load
        return frame


def follow(
    row: Any, control: Any, load: Array, balls: BallPath, turns: int, given: Array | None = None
) -> Followed:
    """Solve the equilibrium at every step of ``balls``, each from the one before.

    ``row`` is the nominal row; its own places and reaches count, the changes of ``balls`` are added. Other arguments as
    of ``equilibrium.solve``. Raises RuntimeError naming the step where no equilibrium is found.
    """
    steps = len(balls.ring_angle)
    path, largest = np.empty((steps, 5)), np.empty(steps)
    iterations, residual = 0, 0.0
    cosine, sine = np.cos(balls.azimuth), np.sin(balls.azimuth)
    solution = None
    for step in range(steps):
        here = row._replace(
            cosine=cosine[step],
            sine=sine[step],
            axial=row.axial + balls.axial[step],
            radial=row.radial + balls.radial[step],
            inner_reach=row.inner_reach + balls.inner_reach[step],
            outer_reach=row.outer_reach + balls.outer_reach[step],
        )
        solution = solve(here, control, load, given, solution)
        if solution.status != "converged":
            raise RuntimeError(f"step {step} of {steps}: {solution.status}")
        path[step] = solution.displacement
        largest[step] = max(solution.inner_load.max(), solution.outer_load.max())
        iterations += int(solution.iterations)
        residual = max(residual, float(solution.residual))
    return Followed(balls.ring_angle, path, largest, iterations, residual, turns)
