"""Estimate of a window cage that no catalogue draws: one geometry for its mass, its guide lands and the stiffness of its bars.

It is a ring about the pitch circle, as wide as 0.95 of the bearing, with a pocket a roller. How thick it is comes from the masses
of 77 NU bearings with brass cages in a maker's catalogue, less rings and rollers; these are scaled by the 90 of the same series
with polyamide cages, of which they then give the listed mass (they are 1.3 to 4.6 % too heavy otherwise, for chamfers and
undercuts). The median thickness is 0.42 roller diameters in series 10 (26 bearings; four in five lie within -13 and +21 % of it),
0.50 in 22 (16; -30 to +33 %), 0.58 in 2, 3 and 23 (35; -19 to +26 %). Cages of polyamide and of pressed steel take the same
shape, unchecked: their masses are lost in the rounding of the catalogue's.
"""

import math
from typing import NamedTuple

# Share of the bearing's width; pocket clearance and end play of a roller in its pocket in roller diameters.
CAGE_WIDTH, POCKET_CLEARANCE, END_PLAY = 0.95, 0.03, 0.02
SMALLEST_CLEARANCE_MM, SMALLEST_PLAY_MM, NARROWEST_RING_MM = 0.05, 0.1, 0.5
# Radial thickness in roller diameters, by series, and its error by the catalogue [%].
THICKNESS, USUAL_THICKNESS = {"10": (0.42, 20), "22": (0.50, 35)}, (0.58, 25)


class CageEstimate(NamedTuple):
    """Dimensions of a cage [mm] and its volume [mm^3]; thickness in roller diameters, error of thickness and volume [%]."""

    pocket_clearance: float
    bar_width: float
    bar_thickness: float
    bar_length: float
    side_ring_width: float
    volume: float
    thickness_share: float
    cage_error: int


def cage_estimate(
    series: str, width: float, rollers: int, roller_diameter: float, roller_length: float, pitch_diameter: float
) -> CageEstimate:
    """Cage of a bearing of these dimensions [mm]; ``series``: "10", "2", "22", "3" or "23"."""
    clearance = max(round(POCKET_CLEARANCE * roller_diameter, 2), SMALLEST_CLEARANCE_MM)
    share, error = THICKNESS.get(series, USUAL_THICKNESS)
    thickness = round(share * roller_diameter, 3)
    circumference = math.pi * pitch_diameter
    bar = round(circumference / rollers - roller_diameter - clearance, 3)
    length = round(roller_length + max(END_PLAY * roller_diameter, SMALLEST_PLAY_MM), 3)
    ring = max(round(0.5 * (CAGE_WIDTH * width - length), 3), NARROWEST_RING_MM)
    volume = thickness * (2.0 * ring * circumference + rollers * bar * length)
    return CageEstimate(clearance, bar, thickness, length, ring, volume, share, error)
