"""ISO system of limits and fits up to 500 mm: standard tolerances and fundamental deviations.

Source: ISO 286-1:2010, Tables 1 to 5 (the same values in BS 4500:1969), and the rule of a delta of one grade for
the holes K to S. The tables take the formulas of the standard at the geometric mean of a range of sizes and round them.
"""

import re
from bisect import bisect_left
from collections.abc import Mapping
from math import cbrt

RANGES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)  # mm, up to and including
LARGEST = RANGES[-1]

# Micrometres; a row a grade, a column a range of sizes.
STANDARD_TOLERANCES = {
    "IT01": (0.3, 0.4, 0.4, 0.5, 0.6, 0.6, 0.8, 1, 1.2, 2, 2.5, 3, 4),
    "IT0": (0.5, 0.6, 0.6, 0.8, 1, 1, 1.2, 1.5, 2, 3, 4, 5, 6),
    "IT1": (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8),
    "IT2": (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10),
    "IT3": (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15),
    "IT4": (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    "IT5": (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    "IT6": (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    "IT7": (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    "IT8": (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    "IT9": (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    "IT10": (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    "IT11": (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    "IT12": (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
    "IT13": (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
    "IT14": (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550),
    "IT15": (400, 480, 580, 700, 840, 1000, 1200, 1400, 1600, 1850, 2100, 2300, 2500),
    "IT16": (600, 750, 900, 1100, 1300, 1600, 1900, 2200, 2500, 2900, 3200, 3600, 4000),
    "IT17": (1000, 1200, 1500, 1800, 2100, 2500, 3000, 3500, 4000, 4600, 5200, 5700, 6300),
    "IT18": (1400, 1800, 2200, 2700, 3300, 3900, 4600, 5400, 6300, 7200, 8100, 8900, 9700),
}

# Micrometres from the nominal to the nearer limit of a shaft: below it for d to h, above it for k to s.
DEVIATIONS = {
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),  # grades 4 to 7 of shafts, 3 to 8 of holes; otherwise 0
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
FINE_RANGES = (3, 6, 10, 18, 30, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500)
FINE_DEVIATIONS = {
    "r": (10, 15, 19, 23, 28, 34, 41, 43, 51, 54, 63, 65, 68, 77, 80, 84, 94, 98, 108, 114, 126, 132),
    "s": (14, 19, 23, 28, 35, 43, 53, 59, 71, 79, 92, 100, 108, 122, 130, 140, 158, 170, 190, 208, 232, 252),
}
SHAFT_J = {  # lower deviation
    5: (-2, -2, -2, -3, -4, -5, -7, -9, -11, -13, -16, -18, -20),
    6: (-2, -2, -2, -3, -4, -5, -7, -9, -11, -13, -16, -18, -20),
    7: (-4, -4, -5, -6, -8, -10, -12, -15, -18, -21, -26, -28, -32),
}
HOLE_J = {  # upper deviation
    6: (2, 5, 5, 6, 8, 10, 13, 16, 18, 22, 25, 29, 33),
    7: (4, 6, 8, 10, 12, 14, 18, 22, 26, 30, 36, 39, 43),
    8: (6, 10, 12, 15, 20, 24, 28, 34, 41, 47, 55, 60, 66),
}
M6_EXCEPTION = (10, -9.0)  # range 250 to 315 mm: -9 by the standard, where the rule gives -11
CODE = re.compile(r"(js|JS|[defghjkmnprsDEFGHJKMNPRS])(01|\d{1,2})")


def tolerance_unit(nominal_mm: float) -> float:
    """Standard tolerance unit i of ISO 286-1 in mm: 0.45 D^(1/3) + 0.001 D in um, D > 0 in mm."""
    return 1e-3 * (0.45 * cbrt(nominal_mm) + 0.001 * nominal_mm)


def grade_tolerances(nominal_mm: float) -> dict[str, float]:
    """Tolerance in mm of each grade IT01 to IT18 as the standard lists it, from the narrowest.

    Raises ValueError outside 0 to 500 mm.
    """
    column = _column(nominal_mm)
    return {grade: 1e-3 * row[column] for grade, row in STANDARD_TOLERANCES.items()}


def fit_limits(nominal_mm: float, code: str) -> tuple[float, float]:
    """Lower and upper deviation in mm of a tolerance class such as "k5" (shaft) or "H7" (hole).

    Raises ValueError for a class or size that is not listed here.
    """
    match = CODE.fullmatch(code)
    if match is None or f"IT{match[2]}" not in STANDARD_TOLERANCES:
        raise ValueError(
            'is no tolerance class such as "h6", "k5" or "H7"; letters known: d to h, j, js, k, m, n, p, r, s'
        )
    letter, width = match[1], grade_tolerances(nominal_mm)[f"IT{match[2]}"]
    if letter in ("js", "JS"):
        return -width / 2, width / 2
    grade = 0 if match[2] == "01" else int(match[2])
    near = _hole(nominal_mm, letter, grade) if letter.isupper() else _shaft(nominal_mm, letter, grade)
    # d to h lie below a shaft's nominal and above a hole's, the rest on the other side.
    grows = letter in "jkmnprsDEFGH"
    return (1e-3 * near, 1e-3 * near + width) if grows else (1e-3 * near - width, 1e-3 * near)


def positioned(nominal_mm: float, letter: str, width_mm: float) -> tuple[float, float]:
    """Lower and upper deviation in mm of a tolerance of any width at the position of a letter.

    Only for letters whose fundamental deviation does not depend on the grade. Raises ValueError as ``fit_limits``.
    """
    if letter in ("js", "JS"):
        return -width_mm / 2, width_mm / 2
    lower, upper = fit_limits(nominal_mm, f"{letter}6")
    return (lower, lower + width_mm) if letter in "mnprsDEFGH" else (upper - width_mm, upper)


def _column(nominal_mm: float) -> int:
    if not 0 < nominal_mm <= LARGEST:
        raise ValueError(f"lies outside the tables of ISO 286, which reach from 0 to {LARGEST} mm here")
    return bisect_left(RANGES, nominal_mm)


def _deviation(nominal_mm: float, letter: str) -> float:
    if letter in FINE_DEVIATIONS:
        return FINE_DEVIATIONS[letter][bisect_left(FINE_RANGES, nominal_mm)]
    return DEVIATIONS[letter][_column(nominal_mm)]


def _shaft(nominal_mm: float, letter: str, grade: int) -> float:
    if letter == "j":
        return _listed(SHAFT_J, grade, "j")[_column(nominal_mm)]
    if letter == "k" and not 4 <= grade <= 7:
        return 0.0
    return _deviation(nominal_mm, letter) * (-1 if letter in "defgh" else 1)


def _hole(nominal_mm: float, letter: str, grade: int) -> float:
    """Lower deviation of D to H, upper deviation of J to S, in micrometres."""
    lower, column = letter.lower(), _column(nominal_mm)
    if lower in "defgh":
        return _deviation(nominal_mm, lower)
    if lower == "j":
        return _listed(HOLE_J, grade, "J")[column]
    if (letter, grade, column) == ("M", 6, M6_EXCEPTION[0]):
        return M6_EXCEPTION[1]
    last = 8 if lower in "kmn" else 7
    if lower in "kn" and grade > last and column > 0:
        if lower == "k":
            raise ValueError("is not in the standard: K ends at grade 8 above 3 mm")
        return 0.0
    return -_deviation(nominal_mm, lower) + (_delta(column, grade) if grade <= last else 0.0)


def _delta(column: int, grade: int) -> float:
    """What a hole gives back so that it fits as the shaft of the next finer grade does (sizes above 3 mm)."""
    if grade < 3:
        raise ValueError("is not in the standard: holes K to S begin at grade 3")
    here, finer = (STANDARD_TOLERANCES[f"IT{each}"][column] for each in (grade, grade - 1))
    return here - finer if column > 0 else 0.0


def _listed(rows: Mapping[int, tuple[int, ...]], grade: int, letter: str) -> tuple[int, ...]:
    if grade not in rows:
        raise ValueError(f"is not listed here: {letter} has the grades {', '.join(str(each) for each in rows)}")
    return rows[grade]
