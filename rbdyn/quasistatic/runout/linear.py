"""Small form errors answered in proportion: what one ball's error does to an axially loaded ring, and sums of it.

Under a purely axial load all balls are alike, so one ball tells all: an error e of the ball at the azimuth psi moves
the ring by e g_x along psi, by e g_z axially, and tilts it by e g_tilt about the axis 90 degrees ahead of psi. Around
Z equal balls all orders of a groove cancel but n = kZ +- 1, which shift and tilt, and n = kZ, which moves axially.
"""

from typing import NamedTuple

import numpy as np

from rbdyn.arrays import Array
from rbdyn.faults import RunError
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.row import Row

# Error of one ball in the differences [m]: far below any deflection, far above the solver's round-off.
SMALL_ERROR = 1e-8
CHANGES = ("axial", "radial", "inner_reach", "outer_reach")


class LinearResponse(NamedTuple):
    """Displacement by unit change [m] of one ball, (4,) for axial, radial, inner_reach and outer_reach.

    ``radial`` towards the ball [-], ``axial`` [-], ``tilt`` about the axis 90 degrees ahead of the ball [rad/m].
    """

    radial: Array
    axial: Array
    tilt: Array


def linear_response(row: Row, control: Control, load: Array, given: Array | None = None) -> LinearResponse:
    """Response of a row of equal, evenly spaced balls under an axial load, by central differences.

    Arguments as of ``equilibrium.solve``. Raises ValueError where load or row single out a direction, and RunError
    with the reason where there is no equilibrium.
    """
    if np.any(np.delete(load, 2)):
        raise ValueError("load: runout answers in proportion only under a purely axial load; set the rest to 0")
    if any(np.ptp(getattr(row, name)) > 0.0 for name in CHANGES):
        raise ValueError("row: balls differ already; give the nominal row")
    middle = _settled(solve(row, control, load, given))
    slopes = []
    for name in CHANGES:
        ends = []
        for change in (-SMALL_ERROR, SMALL_ERROR):
            changed = getattr(row, name).copy()
            changed[0] += change
            ends.append(_settled(solve(row._replace(**{name: changed}), control, load, given, middle)))
        slopes.append((ends[1].displacement - ends[0].displacement) / (2.0 * SMALL_ERROR))
    x, y, z, theta_x, theta_y = np.array(slopes).T
    cosine, sine = row.cosine[0], row.sine[0]
    return LinearResponse(x * cosine + y * sine, z, theta_y * cosine - theta_x * sine)


def _settled(solution: Solution) -> Solution:
    if not solution.found:
        raise RunError(f"runout of the nominal bearing: {solution.status}")
    return solution
