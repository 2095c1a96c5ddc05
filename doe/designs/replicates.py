"""Which runs are replicates of each other."""

import numpy as np

from doe.arrays import Array, Whole

SAME_POINT = 1e-9  # coded units within which two runs are replicates


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
