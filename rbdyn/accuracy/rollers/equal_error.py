"""How many times faster one method is than another at equal error, from their work-precision curves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Points over the common range of errors, evenly spaced in the logarithm.
POINTS = 41

Curve = Sequence[tuple[float, float]]  # (error, time) pairs, all positive


@dataclass(frozen=True)
class Speedup:
    """Ratio of times: geometric mean, least and greatest over the errors from ``low`` to ``high``."""

    low: float
    high: float
    mean: float
    least: float
    greatest: float


def front(curve: Curve) -> list[tuple[float, float]]:
    """The points that no other beats in both error and time, smallest error first."""
    unbeaten: list[tuple[float, float]] = []
    for error, time in sorted(curve):
        if not unbeaten or time < unbeaten[-1][1]:
            unbeaten.append((error, time))
    return unbeaten


def times_faster(ours: Curve, theirs: Curve) -> Speedup | None:
    """Their time over ours, with log time interpolated over log error between the points of each front.

    Nothing is extrapolated: None where the two have no range of errors in common.
    """
    fronts = front(ours), front(theirs)
    if not all(fronts):
        return None
    low, high = max(points[0][0] for points in fronts), min(points[-1][0] for points in fronts)
    if not low < high:
        return None
    at = np.linspace(np.log(low), np.log(high), POINTS)
    our_time, their_time = (np.interp(at, *np.log(np.array(points)).T) for points in fronts)
    ratio = np.exp(their_time - our_time)
    return Speedup(low, high, float(np.exp((their_time - our_time).mean())), ratio.min().item(), ratio.max().item())
