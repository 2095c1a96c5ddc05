"""Equilibrium of one row at point after point of a sweep, each from the one before: the compiled loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry, kernel, law
from rbdyn.quasistatic.row.control import CommonCage, Control, FixedShare, FrictionShare, Spinning
from rbdyn.quasistatic.row.equilibrium import TOLD, solve_row
from rbdyn.quasistatic.row.newton import COLD_STARTS, CONVERGED, STEPS
from rbdyn.quasistatic.row.ring import RING, TAKEN
from rbdyn.quasistatic.row.row import Row

# Fields of ``Row`` that change from point to point: arrays over the balls, then numbers.
PLACES, NUMBERS = Row._fields[2:6], Row._fields[6:]
LEVER = NUMBERS.index("lever")


class Points(NamedTuple):
    """What changes from point to point, n points of Z balls.

    ``places`` (4, n, Z) and ``numbers`` (n, 7): fields of ``Row``. ``race_control`` (n, fields): numbers of the control.
    ``load, given`` (n, 5): tilts and moments count over the lever; ``free`` (n, 5) is 1 where the load rules.
    """

    places: NDArray[np.float64]
    numbers: NDArray[np.float64]
    race_control: NDArray[np.float64]
    load: NDArray[np.float64]
    given: NDArray[np.float64]
    free: NDArray[np.float64]


class Found(NamedTuple):
    """What is found at n points: ``displacement, taken`` (n, 5), ``matrix`` (n, 5, 5) with tilts over the lever, ``told`` (n, Z, TOLD)
    as of ``solve_row``, ``residual`` [N], ``outcome``, ``steps`` and ``cold`` (n,): whether the start was not the point before."""

    displacement: NDArray[np.float64]
    taken: NDArray[np.float64]
    matrix: NDArray[np.float64]
    told: NDArray[np.float64]
    residual: NDArray[np.float64]
    outcome: NDArray[np.int64]
    steps: NDArray[np.int64]
    cold: NDArray[np.int64]


def empty(points: int, balls: int) -> Found:
    """Room for what is found."""
    return Found(
        np.zeros((points, RING)),
        np.zeros((points, RING)),
        np.zeros((points, RING, RING)),
        np.zeros((points, balls, TOLD)),
        np.zeros(points),
        np.zeros(points, np.int64),
        np.zeros(points, np.int64),
        np.zeros(points, np.int64),
    )


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
    control: Any, cosine: Any, sine: Any, points: Any, first: int, last: int, warm: bool, q: Any, balls: Any, at: Any,
    counts: Any, found: Any,
) -> bool:  # fmt: skip
    """Fill ``found`` for the points from ``first`` to before ``last``; returns whether the last of them has its equilibrium.

    ``warm``: whether ``q`` and ``balls`` hold that of the point before. After a point without one, the next starts afresh.
    ``control`` tells the kind only; ``at, counts`` are as of ``newton.find``.
    """
    for k in range(first, last):
        n, places = points.numbers[k], points.places
        row = Row(
            cosine, sine, places[0, k], places[1, k], places[2, k], places[3, k],
            n[0], n[1], n[2], n[3], n[4], n[5], n[6],
        )  # fmt: skip
        free = points.free[k]
        for i in range(RING):
            if not warm or free[i] == 0.0:
                q[i] = points.given[k, i]
        ours = with_numbers(control, points.race_control[k])
        outcome, worst = solve_row(ours, row, points.load[k], free, warm, q, balls, at, counts, found.told[k])
        found.displacement[k] = q
        for i in range(RING):
            found.taken[k, i] = at.sums[TAKEN + i]
        found.matrix[k] = at.matrix
        found.residual[k], found.outcome[k] = worst, outcome
        found.steps[k], found.cold[k] = counts[STEPS], counts[COLD_STARTS]
        warm = outcome == CONVERGED
    return warm
