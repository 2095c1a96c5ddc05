"""Runout of the path that a ring takes.

Three ways to put the radial motion into a number, none of which tells another:
- ``indicator``: what a fixed indicator reads (its largest range over all directions). Class limits K_ia mean this. An
  eccentric groove shows wholly, as twice its eccentricity.
- ``minimum_zone``, ``least_squares``: distance between the circles that hold the orbit of the ring's centre between
  them ("distance between the maximum and minimum envelope circles", Zhou et al. 2024). An eccentric groove moves the
  centre on a circle and does not show at all.
- ``error_motion``: range of a fixed indicator's reading less its best-fitting once-per-turn part, as of a spindle.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from rbdyn.arrays import Array
from rbdyn.quasistatic.runout.roundness import diameter, least_squares_circle, minimum_zone

# Places round the face where the axial indicator may stand.
PLACES = 72


@dataclass(frozen=True)
class Runout:
    """Runout [m] of a path of whole turns.

    ``axial``: range of the axial displacement. ``face``: range of an axial indicator that stands at the worst place on
    the ring's face, where tilt counts too. Synchronous: of the mean over turns at equal ring angle, by indicators;
    asynchronous: the largest spread between turns at equal ring angle, zero for one turn.
    """

    indicator: float
    minimum_zone: float
    least_squares: float
    error_motion: float
    axial: float
    face: float
    synchronous_radial: float
    asynchronous_radial: float
    synchronous_axial: float
    asynchronous_axial: float
    turns: int


def runout(path: Array, turns: int, face_radius: float) -> Runout:
    """Runout of a path (turns * steps, 5) of displacements x, y, z [m], theta_x, theta_y [rad].

    ``face_radius``: where an axial indicator touches the ring [m]. Raises ValueError unless the steps fill whole turns.
    """
    steps, left = divmod(len(path), turns)
    if left or steps < 3:
        raise ValueError(
            f"{len(path)} steps in {turns} turns: not whole turns of at least three steps; mend the number of turns"
        )
    orbit, axial = path[:, :2], path[:, 2]
    # Far from the origin, digits of the small motion would be lost.
    orbit = orbit - orbit.mean(axis=0)
    by_turn, axial_by_turn = orbit.reshape(turns, steps, 2), axial.reshape(turns, steps)
    angle = 2.0 * math.pi * np.arange(len(path)) / steps
    return Runout(
        indicator=diameter(orbit),
        minimum_zone=minimum_zone(orbit).width,
        least_squares=least_squares_circle(orbit).width,
        error_motion=max(error_motion(angle, reading) for reading in orbit.T),
        axial=float(np.ptp(axial)),
        face=face_runout(path, face_radius),
        synchronous_radial=diameter(by_turn.mean(axis=0)),
        asynchronous_radial=max(diameter(by_turn[:, step]) for step in range(steps)),
        synchronous_axial=float(np.ptp(axial_by_turn.mean(axis=0))),
        asynchronous_axial=float(np.ptp(axial_by_turn, axis=0).max()),
        turns=turns,
    )


def face_runout(path: Array, radius: float, places: int = PLACES) -> float:
    """Largest range [m] of an axial indicator at ``radius`` [m] over ``places`` fixed places round the face."""
    place = 2.0 * math.pi * np.arange(places) / places
    lift = path[:, 3:4] * np.sin(place) - path[:, 4:5] * np.cos(place)
    return float(np.ptp(path[:, 2:3] + radius * lift, axis=0).max())


def error_motion(angle: Array, reading: Array) -> float:
    """Range [m] of readings less the once-per-turn part c cos(angle) + s sin(angle) that makes it least.

    A linear programme: the minimum zone of the polar plot of the readings (ANSI B89.3.4) in the limit of a base circle
    that is large against them.
    """
    scale = float(np.ptp(reading))
    if scale == 0.0:
        return 0.0
    wave = np.column_stack((np.cos(angle), np.sin(angle)))
    ones, none = np.ones((len(angle), 1)), np.zeros((len(angle), 1))
    level = (reading - reading.mean()) / scale
    optimum = linprog(
        [0.0, 0.0, 1.0, -1.0],
        A_ub=np.vstack((np.hstack((-wave, -ones, none)), np.hstack((wave, none, ones)))),
        b_ub=np.concatenate((-level, level)),
        bounds=[(None, None)] * 4,
        method="highs",
    )
    return scale * float(np.ptp(level - wave @ optimum.x[:2]))
