"""Bore and outside diameter of purchased bearing rings: ISO 492, mean diameter in a plane, radial bearings.

The upper deviation is 0. Classes Normal, 6, 5 and 4; sizes that could not be checked against several published
catalogue tables are left out. Not for tapered roller bearings.
"""

from bisect import bisect_left

BORE_RANGES = (2.5, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)  # mm, up to and including
OUTSIDE_RANGES = (6, 18, 30, 50, 80, 120, 150, 180, 250, 315, 400, 500)

# Lower deviation, micrometres.
BORE = {
    "Normal": (-8, -8, -8, -10, -12, -15, -20, -25, -30, -35, -40, -45),
    "P6": (-7, -7, -7, -8, -10, -12, -15, -18, -22),
    "P5": (-5, -5, -5, -6, -8, -9, -10, -13, -15, -18, -23, -28),
    "P4": (-4, -4, -4, -5, -6, -7, -8, -10),
}
OUTSIDE = {
    "Normal": (-8, -8, -9, -11, -13, -15, -18, -25, -30, -35, -40, -45),
    "P6": (-7, -7, -8, -9, -11, -13, -15, -18, -20, -25, -28, -33),
    "P5": (-5, -5, -6, -7, -9, -10, -11, -13, -15, -18, -20, -23),
    "P4": (-4, -4, -5, -6, -7, -8, -9),
}
SURFACES = {"bore": (BORE_RANGES, BORE), "outside": (OUTSIDE_RANGES, OUTSIDE)}


def ring_limits(nominal_mm: float, code: str) -> tuple[float, float]:
    """Lower and upper deviation in mm of "P5 bore", "Normal outside" and their like.

    Raises ValueError for a class, surface or size that is not listed here.
    """
    name, _, surface = code.partition(" ")
    if surface not in SURFACES or name not in BORE:
        raise ValueError(f'is no ring class such as "P5 bore" or "Normal outside"; classes known: {", ".join(BORE)}')
    ranges, rows = SURFACES[surface]
    column = bisect_left(ranges, nominal_mm)
    if nominal_mm <= 0 or column >= len(rows[name]):
        raise ValueError(f"is listed here from 0 to {ranges[len(rows[name]) - 1]:g} mm; give the deviations themselves")
    return 1e-3 * rows[name][column], 0.0
