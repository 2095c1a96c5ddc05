"""What an integration is given, carries along and keeps; one set of records for all methods."""

from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.dynamics.forces.equations import LOADS, POWERS
from rbdyn.dynamics.forces.race_lanes import Scratch, scratch

# Places in ``Carry.clock``: time, next step, next sample time [s], error of the last step over the tolerance, rate of the
# frame [rad/s].
NOW, STEP, ERROR, SAMPLE, FRAME, CLOCK = range(6)
# In ``Carry.counts``: steps, right-hand sides, and the component that made the last step impossible.
ACCEPTED, REJECTED, DERIVATIVES, WORST, COUNTS = range(5)
# In ``Carry.stiffness``: steps looked at, those held by stability, sum of their |eigenvalue| [1/s].
LOOKED_AT, HELD, EIGENVALUES, STIFFNESS = range(4)
# In ``Tally.whirl``: samples, sum and sum of squares of the speed of the cage's centre, sums of its places x and y and of
# x^2 + y^2.
SAMPLES, SPEEDS, SQUARES, PLACES_X, PLACES_Y, PLACE_SQUARES, WHIRL = range(7)
# Rows of stages: of the longest method, its end of the step and a free one included.
ROWS = 8
PI_START_ERROR = 1e-4


class Status(Enum):
    """Why ``advance`` came back, in the order of the numbers that it returns: a message to fill in, and the remedy."""

    FINISHED = "", ""
    STEP_UNDERFLOW = (
        "the step fell below {smallest_step:.2g} s because of {component}",
        "loosen numerics.rtol or soften the law that acts on it (damping, friction blend, film floor)",
    )
    NOT_FINITE = "{component} is not finite at any step size", "check the laws that act on it"
    STEP_BUDGET = (
        "step budget of {step_budget} used up after {spent_s:.3g} s of running (last step {step:.2g} s)",
        "raise numerics.step_budget_per_turn, loosen numerics.rtol, or soften the stiffest law",
    )


FINISHED, STEP_UNDERFLOW, NOT_FINITE, STEP_BUDGET = range(len(Status))


class Control(NamedTuple):
    """Step control: inverse absolute tolerance of each component, step limits [s], step budget."""

    inverse_tolerance: NDArray[np.float64]
    smallest_step: float
    largest_step: float
    step_budget: int


class Carry(NamedTuple):
    """What one call hands to the next. Arrays, changed in place."""

    y: NDArray[np.float64]  # state
    k: NDArray[np.float64]  # (ROWS, n) stage derivatives; row 0 belongs to y
    stage: NDArray[np.float64]  # (n,) state of the stage in hand, in the end that at the end of the step
    power: NDArray[np.float64]  # (ROWS, POWERS)
    loads: NDArray[np.float64]  # (ROWS, LOADS)
    scratch: Scratch
    clock: NDArray[np.float64]
    counts: NDArray[np.int64]
    stiffness: NDArray[np.float64]
    method: Any  # which method; the implicit one with its work space


class Tally(NamedTuple):
    """What is kept over a window. Arrays, changed in place."""

    work: NDArray[np.float64]  # (POWERS,) integrals of the powers [J]
    largest: NDArray[np.float64]  # (LOADS,) largest loads [N]
    largest_time: NDArray[np.float64]  # (LOADS,) and when [s]
    whirl: NDArray[np.float64]


def carry_from(y: NDArray[np.float64], rollers: int, first_step: float, method: Any) -> Carry:
    """Memory of an integration from the state ``y`` on, which tries ``first_step`` [s] first."""
    clock = np.zeros(CLOCK)
    clock[STEP], clock[ERROR] = first_step, PI_START_ERROR
    k, power, loads = (np.zeros((ROWS, columns)) for columns in (y.size, POWERS, LOADS))
    counts = np.zeros(COUNTS, dtype=np.int64)
    return Carry(y, k, np.zeros(y.size), power, loads, scratch(rollers), clock, counts, np.zeros(STIFFNESS), method)


def empty_tally() -> Tally:
    """Nothing kept yet."""
    return Tally(np.zeros(POWERS), np.zeros(LOADS), np.zeros(LOADS), np.zeros(WHIRL))
