"""Clearances of a roller bearing, each once: key of the drawing, words, and the step by which a study varies it."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from rbdyn.base.words import range_ends


class Clearance(NamedTuple):
    """A clearance: its name, the key of a scene with its value on the drawing, and what it lies between.

    ``step``: of a study, as a share of its value: axial runs lie 1.2 to 1.4 steps out, and none may touch zero.
    ``words``: those of its changes in operation; empty for one whose changes no result reports.
    """

    name: str
    key: str
    meaning: str
    step: float
    words: str = ""


CLEARANCES = (
    Clearance("radial", "bearing.radial_clearance_mm", "diametral in the bearing", 0.32, "clearance"),
    Clearance("guide", "cage.guide_clearance_mm", "diametral between cage and guide", 0.38, "guide clearance"),
    Clearance(
        "pocket", "cage.pocket_clearance_mm", "width of the pocket less the roller diameter", 0.25, "pocket clearance"
    ),
    Clearance("lip", "cage.pocket_radial_clearance_mm", "radial at the lips of the pocket", 0.32),
)
# Those whose changes in operation a result reports.
REPORTED = tuple(clearance for clearance in CLEARANCES if clearance.words)
DIFFERENCE = "inner_minus_outer_K"
# Ranges of a heat balance beside those of its temperatures, in words and with their unit.
OTHER_RANGES = {DIFFERENCE: ("inner ring over outer ring", "K")} | {
    f"{clearance.name}_um": (clearance.words, "µm") for clearance in REPORTED
}


def other_ranges(ranges: Mapping[str, Sequence[float]]) -> str:
    """What the inputs of a heat balance leave open of the difference of the rings and of the clearances in operation."""
    parts = [
        f"{words} {range_ends(ranges[name])} {unit}" for name, (words, unit) in OTHER_RANGES.items() if name in ranges
    ]
    return f"over these inputs (90 %): {', '.join(parts)}"
