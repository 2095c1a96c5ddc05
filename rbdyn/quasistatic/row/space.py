"""What a solve of one row is given, and the arrays that it works in."""

from typing import NamedTuple

import numpy as np

from rbdyn.arrays import Array, Whole
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.ring import BALL, BALL_WORK, RING, SUMS
from rbdyn.quasistatic.row.row import Row, component_lengths

# Counters: Newton steps, continuations, starts from nothing.
STEPS, STRIDES, COLD_STARTS, COUNTERS = range(4)


class Task(NamedTuple):
    """A row, its raceway control, and what holds its ring: all forces [N], as moments count over the lever R.

    ``load`` (5,) on the ring; ``free`` (5,): 1 where the load rules, 0 where the displacement is prescribed.
    """

    control: Control
    row: Row
    load: Array
    free: Array


class Space(NamedTuple):
    """Where a solve of Z balls stands, and its work space; kept from one solve to the next.

    ``q`` (5,): displacement of the ring [m], tilts times R; ``balls`` (Z, BALL); ``old_q, old_balls, old_work``: before the last step.
    ``matrix`` (5, 5): stiffness of the ring [N/m]; ``vector`` (5,): what a Newton step is to take away [N]; ``step`` (5,) [m];
    ``sums``, ``work`` (Z, BALL_WORK): columns of ``ring``; ``counts``: above. ``table``, ``base``: of an elimination and of the first guess.
    """

    counts: Whole
    q: Array
    balls: Array
    matrix: Array
    vector: Array
    table: Array
    step: Array
    sums: Array
    work: Array
    old_q: Array
    old_balls: Array
    old_work: Array
    base: Array


def space(balls: int) -> Space:
    """Work space for a row of so many balls."""
    ball, work, square = (balls, BALL), (balls, BALL_WORK), (RING, RING)
    shapes = (RING, ball, square, RING, square, RING, SUMS, work, RING, ball, work, RING)
    return Space(np.zeros(COUNTERS, np.int64), *(np.zeros(shape) for shape in shapes))


def posed(row: Row, load: Array, given: Array | None) -> tuple[Array, Array, Array]:
    """``load`` and ``free`` of a ``Task`` from load and prescribed displacements of ``equilibrium.solve``, and those displacements.

    The last (5,) in m, 0 where the load rules.
    """
    unit = component_lengths(row.lever)
    held = np.full(RING, np.nan) if given is None else np.asarray(given, float)
    free = np.isnan(held)
    return np.asarray(load, float) / unit, free.astype(float), np.where(free, 0.0, held) * unit
