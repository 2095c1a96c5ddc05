"""ISO 492: deviations of the mean bore and outside diameter of purchased bearing rings, as data in ``iso492.toml``."""

import tomllib
from bisect import bisect_left
from pathlib import Path

from rbdyn.faults import MethodError

SURFACES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
CLASSES = [name for name in SURFACES["bore"] if name != "sizes_mm"]


def ring_limits(nominal_mm: float, code: str) -> tuple[float, float]:
    """Lower and upper deviation in mm of "P5 bore", "Normal outside" and their like, of purchased bearing rings.

    ISO 492, mean diameter in a plane, radial bearings but tapered roller bearings; classes Normal, 6, 5 and 4. The upper
    deviation is 0, the lower one is in ``iso492.toml``; sizes that could not be checked against several published catalogue
    tables are left out.

    Raises MethodError for a class, surface or size that is not listed here.
    """
    name, _, surface = code.partition(" ")
    if surface not in SURFACES or name not in CLASSES:
        raise MethodError(
            f'is no ring class such as "P5 bore" or "Normal outside"; classes known: {", ".join(CLASSES)}'
        )
    ranges, lower = SURFACES[surface]["sizes_mm"], SURFACES[surface][name]
    column = bisect_left(ranges, nominal_mm)
    if nominal_mm <= 0 or column >= len(lower):
        raise MethodError(f"is listed here from 0 to {ranges[len(lower) - 1]:g} mm; give the deviations themselves")
    return 1e-3 * lower[column], 0.0
