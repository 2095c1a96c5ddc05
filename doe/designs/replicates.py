"""Which runs are replicates of each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME_POINT = 1e-9  # coded units within which two runs are replicates


def replicate_groups(points: Array, block: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
    """For each run (n, k) the first run at the same point, and in the same block where blocks are given, shape (n,)."""
    same = np.abs(points[:, None, :] - points[None, :, :]).max(axis=2) <= SAME_POINT
    if block is not None:
        same &= block[:, None] == block[None, :]
    first: NDArray[np.int64] = same.argmax(axis=1)
    return first
