"""Equilibrium of one row at point after point of a sweep, each from the one before: the compiled loop."""

from typing import Any, NamedTuple

import numpy as np

from rbdyn.arrays import Array, Whole
from rbdyn.compiled.kernel import entry, kernel, law
from rbdyn.quasistatic.row.ball import CommonCage, Control, FixedShare, FrictionShare, Spinning
from rbdyn.quasistatic.row.equilibrium import FIGURES, solve_row
from rbdyn.quasistatic.row.newton import COLD_STARTS, CONVERGED, STEPS, Task
from rbdyn.quasistatic.row.ring import RING, TAKEN, Row

# Fields of ``Row`` that change from point to point: arrays over the balls, then numbers.
PLACES, NUMBERS = Row._fields[2:6], Row._fields[6:]
LEVER = NUMBERS.index("lever")


class Points(NamedTuple):
    """What changes from point to point, n points of Z balls.

    ``places`` (4, n, Z) and ``numbers`` (n, 7): fields of ``Row``. ``race_control`` (n, fields): numbers of the control.
    ``load, given`` (n, 5): tilts and moments count over the lever; ``free`` (n, 5) is 1 where the load rules.
    """

    places: Array
    numbers: Array
    race_control: Array
    load: Array
    given: Array
    free: Array


class Found(NamedTuple):
    """What is found at n points: ``displacement, taken`` (n, 5), ``matrix`` (n, 5, 5) with tilts over the lever, ``figures``
    (n, Z, FIGURES) of the balls, ``residual`` [N], ``outcome``, ``steps`` and ``cold`` (n,): whether the start was not the point
    before."""

    displacement: Array
    taken: Array
    matrix: Array
    figures: Array
    residual: Array
    outcome: Whole
    steps: Whole
    cold: Whole


def empty(points: int, balls: int) -> Found:
    """Room for what is found."""
    shapes = (points, RING), (points, RING), (points, RING, RING), (points, balls, FIGURES), points
    return Found._make((*(np.zeros(shape) for shape in shapes), *np.zeros((3, points), np.int64)))


def leaves(control: Control) -> list[float]:
    """Numbers of a control, as ``with_numbers`` takes them."""
    return [control[0], *(() if isinstance(control, CommonCage) else control.spinning)]


@law
def with_numbers(control: Any, numbers: Any) -> Any:
    """A control of the same kind with other ``numbers``."""


@with_numbers.body(CommonCage)
def _common_cage(control: Any, numbers: Any) -> Any:
    return CommonCage(numbers[0])


@with_numbers.body(FixedShare)
def _fixed_share(control: Any, numbers: Any) -> Any:
    return FixedShare(numbers[0], spinning(numbers))


@with_numbers.body(FrictionShare)
def _friction_share(control: Any, numbers: Any) -> Any:
    return FrictionShare(numbers[0], spinning(numbers))


@kernel
def spinning(n: Any) -> Any:
    """``Spinning`` from the numbers that follow the first."""
    return Spinning(n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9])


@entry
def march_through(
    control: Any, cosine: Any, sine: Any, points: Any, first: int, last: int, warm: bool, at: Any, found: Any
) -> bool:
    """Fill ``found`` for the points from ``first`` to before ``last``; returns whether the last of them has its equilibrium.

    ``warm``: whether ``at`` stands at that of the point before. After a point without one, the next starts afresh. ``control``
    tells the kind only.
    """
    for k in range(first, last):
        n, places = points.numbers[k], points.places
        row = Row(
            cosine, sine, places[0, k], places[1, k], places[2, k], places[3, k],
            n[0], n[1], n[2], n[3], n[4], n[5], n[6],
        )  # fmt: skip
        task = Task(with_numbers(control, points.race_control[k]), row, points.load[k], points.free[k])
        for i in range(RING):
            if not warm or task.free[i] == 0.0:
                at.q[i] = points.given[k, i]
        found.outcome[k], found.residual[k] = solve_row(task, warm, at, found.figures[k])
        for i in range(RING):
            found.displacement[k, i], found.taken[k, i] = at.q[i], at.sums[TAKEN + i]
            for m in range(RING):
                found.matrix[k, i, m] = at.matrix[i, m]
        found.steps[k], found.cold[k] = at.counts[STEPS], at.counts[COLD_STARTS]
        warm = found.outcome[k] == CONVERGED
    return warm
