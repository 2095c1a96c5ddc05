"""A design of experiments as a record: its points, their blocks and kinds, and the order of the runs; coded and actual
units of points, and which of them are replicates."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from doe.arrays import Array, Rows, Whole
from rbdyn.faults import MethodError

Region = Literal["ball", "box"]
SAME_POINT = 1e-9  # coded units within which two runs are replicates


@dataclass(frozen=True, eq=False)
class Design:
    """Runs of a design in the order in which they are made.

    ``coded`` (n, k): points in coded units. ``block`` (n,): number of the block of each run, from 0. ``kind``
    (n,): what each point is ("cube", "axial", "edge", "grid", "sample", "screening", "optimal", "given" or "centre"). ``order`` (n,): place of
    each run in the standard order, which names a run whatever the order of the runs. ``region``: where the
    design is meant to predict, a ball through its outermost points or the box of ``reach``, the half-range
    of every factor in coded units.
    """

    coded: Array
    block: Rows
    kind: tuple[str, ...]
    order: Rows
    reach: float
    region: Region

    @property
    def extent(self) -> float:
        """Radius of the ball, or half-width of the box, of the region."""
        return float(np.linalg.norm(self.coded, axis=1).max()) if self.region == "ball" else self.reach

    @property
    def block_numbers(self) -> list[int]:
        """Number of the block of each run as everything that is printed or written gives it, from 1."""
        return [int(number) + 1 for number in self.block]

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1

    def by_blocks(self, seed: int | None = None) -> Self:
        """Blocks one after the other, within each the standard order or, with a ``seed``, a random one after runs that are
        given."""
        ties = np.arange(len(self.coded))
        if seed is not None:
            given = self.kind.count("given")
            ties[given:] = given + np.random.default_rng(seed).permutation(len(self.coded) - given)
        return self.rows(np.lexsort((ties, self.block)))

    def rows(self, rows: Rows) -> Self:
        """Some runs, or all in another order."""
        kind = tuple(self.kind[row] for row in rows)
        return replace(self, coded=self.coded[rows], block=self.block[rows], kind=kind, order=self.order[rows])


def assembled(parts: Sequence[tuple[str, Array]], blocks: Sequence[int], reach: float, region: Region) -> Design:
    """A design in standard order from (kind, points) parts, with the block of every run."""
    coded = np.vstack([points for _, points in parts]) + 0.0  # no negative zeros
    kinds = tuple(kind for kind, points in parts for _ in points)
    return Design(coded, np.array(blocks, dtype=np.intp), kinds, np.arange(len(coded)), reach, region)


def replicate_groups(points: Array, block: Whole | None = None) -> Whole:
    """For each run (n, k) the first run at the same point, and in the same block where blocks are given, shape (n,)."""
    first = np.empty(len(points), np.int64)
    for place, point in enumerate(points):
        # Run by run: all distances at once would take gigabytes of ten thousand runs.
        same = np.abs(points[: place + 1] - point).max(axis=1) <= SAME_POINT
        if block is not None:
            same &= block[: place + 1] == block[place]
        first[place] = same.argmax()
    return first


def to_actual(coded: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Actual factor values of coded points (..., k); ``centre`` and ``step`` (k,) are in actual units."""
    return np.asarray(centre, float) + np.asarray(coded, float) * np.asarray(step, float)


def to_coded(actual: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Coded values of actual points (..., k); the inverse of `to_actual`.

    Raises MethodError when a step is zero.
    """
    step = np.asarray(step, float)
    if np.any(step == 0):
        raise MethodError(f"step = {step.tolist()}: every step must differ from zero")
    return (np.asarray(actual, float) - np.asarray(centre, float)) / step
