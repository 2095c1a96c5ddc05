"""Limits of running accuracy by tolerance class of radial ball bearings (ISO 492), in micrometres.

The text of ISO 492 was not at hand. The figures are those that bearing makers and dealers publish as its classes:
- P2: "Class P2 (ABEC 9) tolerances" of www.loyal.sg (an SKF table); for bores of 30 to 80 mm as Zhou et al. 2024, Table 3
- P4, bores to 80 mm, outside diameters to 150 mm: the class 4 table of manv.in
- P5, inner ring: "P5 class tolerances for radial bearings" of nodeshk.com (an SKF table), to 800 mm here
- P6 and normal, K_ia: NTN, Ball and Roller Bearings, inner ring radial runout; normal also gbbco.cn (P0)
- P6 and normal, K_ea: www.consbrgs.com (ABEC 3 and 1), printed in inches to the nearest 0.00005 and turned back into
  the whole micrometres that they stand for

Where none of these gives a value it is left out: P5 has no K_ea here, and P6 and normal set no face runouts.
Zhou et al.'s Table 4 (SKF) has 1.3 um for S_d where Table 3 has 1.5 um, and the same 2.5 um for K_ia and S_ia.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ToleranceClass = Literal["P2", "P4", "P5", "P6", "normal"]


@dataclass(frozen=True)
class RunningAccuracy:
    """Largest permitted runouts [m]; None where no source was found or the class sets none.

    ``radial``: K_ia, of the assembled bearing's inner ring; ``face``: S_d, of its side face with the bore; ``axial``:
    S_ia, of the assembled bearing's inner ring; ``outer_radial``: K_ea, of the assembled bearing's outer ring.
    """

    radial: float
    face: float | None
    axial: float | None
    outer_radial: float | None


# Bore up to and including [mm]: K_ia, S_d, S_ia [um]. The first range begins above 2.5 mm.
_INNER: dict[str, dict[float, tuple[float, float | None, float | None]]] = {
    "P2": {
        10: (1.5, 1.5, 1.5), 18: (1.5, 1.5, 1.5), 30: (2.5, 1.5, 2.5), 50: (2.5, 1.5, 2.5), 80: (2.5, 1.5, 2.5),
        120: (2.5, 2.5, 2.5), 150: (2.5, 2.5, 2.5), 180: (5.0, 4.0, 5.0),
    },
    "P4": {10: (2.5, 3, 3), 18: (2.5, 3, 3), 30: (3, 4, 4), 50: (4, 4, 4), 80: (4, 5, 5)},
    "P5": {
        10: (4, 7, 7), 18: (4, 7, 7), 30: (4, 8, 8), 50: (5, 8, 8), 80: (5, 8, 8), 120: (6, 9, 9), 180: (8, 10, 10),
        250: (10, 11, 13), 315: (13, 13, 15), 400: (15, 15, 20), 500: (17, 18, 23), 630: (19, 20, 25), 800: (22, 26, 30),
    },
    "P6": {
        10: (6, None, None), 18: (7, None, None), 30: (8, None, None), 50: (10, None, None), 80: (10, None, None),
        120: (13, None, None), 180: (18, None, None), 250: (20, None, None), 315: (25, None, None),
        400: (30, None, None), 500: (35, None, None), 630: (40, None, None),
    },
    "normal": {
        10: (10, None, None), 18: (10, None, None), 30: (13, None, None), 50: (15, None, None), 80: (20, None, None),
        120: (25, None, None), 180: (30, None, None), 250: (40, None, None), 315: (50, None, None),
        400: (60, None, None), 500: (65, None, None), 630: (70, None, None), 800: (80, None, None),
    },
}  # fmt: skip
# Outside diameter up to and including [mm]: K_ea [um], each table from the lower end of its first range [mm].
_OUTER: dict[str, tuple[float, dict[float, float]]] = {
    "P2": (18, {30: 2.5, 50: 2.5, 80: 4, 120: 5, 150: 5, 180: 5, 250: 7}),
    "P4": (2.5, {18: 3, 30: 4, 50: 5, 80: 5, 120: 6, 150: 7}),
    "P6": (6, {
        18: 8, 30: 9, 50: 10, 80: 13, 120: 18, 150: 20, 180: 23, 250: 25, 315: 30, 400: 35, 500: 40, 630: 50, 800: 60,
    }),
    "normal": (6, {
        18: 15, 30: 15, 50: 20, 80: 25, 120: 35, 150: 40, 180: 45, 250: 50, 315: 60, 400: 70, 500: 80, 630: 100, 800: 120,
    }),
}  # fmt: skip
SMALLEST_BORE_MM = 2.5


def running_accuracy(
    tolerance_class: ToleranceClass, bore: float, outside_diameter: float | None = None
) -> RunningAccuracy:
    """Limits of a class for a bore and, where K_ea is wanted, an outside diameter [m].

    Raises ValueError for a class or a bore that the tables do not hold.
    """
    if tolerance_class not in _INNER:
        raise ValueError(f"tolerance class {tolerance_class!r} is not known; choose one of {', '.join(_INNER)}")
    table, bore_mm = _INNER[tolerance_class], 1e3 * bore
    row = next((limits for upper, limits in table.items() if bore_mm <= upper * (1.0 + 1e-12)), None)
    if row is None or bore_mm <= SMALLEST_BORE_MM:
        raise ValueError(
            f"a bore of {bore_mm:g} mm: class {tolerance_class} is held here above {SMALLEST_BORE_MM:g} mm and up to "
            f"{max(table):g} mm"
        )
    outer = None
    lowest, outer_table = _OUTER.get(tolerance_class, (0.0, {}))
    if outside_diameter is not None and 1e3 * outside_diameter > lowest:
        reached = (limit for upper, limit in outer_table.items() if 1e3 * outside_diameter <= upper * (1.0 + 1e-12))
        outer = next(reached, None)
    return RunningAccuracy(*(None if limit is None else 1e-6 * limit for limit in (*row, outer)))  # type: ignore[arg-type]
