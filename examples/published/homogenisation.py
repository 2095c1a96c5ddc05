"""How much of the errors of both races comes through to the ring, after Zhou et al. 2024."""

from __future__ import annotations


def homogenisation(runout: float, inner_error: float, outer_error: float) -> float:
    """Runout over the sum of the errors of both races, all in m (Zhou et al. 2024, eqs 23-26).

    Radial runout over roundness errors, or axial runout over side-sways or groove-shape errors; below one the bearing
    runs truer than its races are made. Raises ValueError unless the sum is positive.
    """
    both = abs(inner_error) + abs(outer_error)
    if not both > 0.0:
        raise ValueError("races without errors have no homogenisation coefficient; give one of them an error")
    return abs(runout) / both
