"""A design of experiments as a record: its points, their blocks and kinds, and the order of the runs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from doe.arrays import Array, Rows

Region = Literal["ball", "box"]


@dataclass(frozen=True, eq=False)
class Design:
    """Runs of a design in the order in which they are made.

    ``coded`` (n, k): points in coded units. ``block`` (n,): number of the block of each run, from 0. ``kind``
    (n,): what each point is ("cube", "axial", "edge", "grid", "sample" or "centre"). ``order`` (n,): place of
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
        """Blocks one after the other, within each the standard order or, with a ``seed``, a random one."""
        ties = np.arange(len(self.coded))
        if seed is not None:
            ties = np.random.default_rng(seed).permutation(len(self.coded))
        rows = np.lexsort((ties, self.block))
        return replace(
            self,
            coded=self.coded[rows],
            block=self.block[rows],
            kind=tuple(self.kind[row] for row in rows),
            order=self.order[rows],
        )


def assembled(parts: Sequence[tuple[str, Array]], blocks: Sequence[int], reach: float, region: Region) -> Design:
    """A design in standard order from (kind, points) parts, with the block of every run."""
    coded = np.vstack([points for _, points in parts]) + 0.0  # no negative zeros
    kinds = tuple(kind for kind, points in parts for _ in points)
    return Design(coded, np.array(blocks, dtype=np.intp), kinds, np.arange(len(coded)), reach, region)
