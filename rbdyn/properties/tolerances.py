"""Limits and fits: ISO 286 for shafts and housings up to 500 mm, ISO 492 for rings, and the interference between them.

ISO 286-1:2010, Tables 1 to 5 (the same values are in BS 4500:1969), with the rule of a delta of one grade for the holes K to S.
The tables in ``iso286.toml`` are rounded values of the standard's formulas at the geometric mean of a range of sizes. The
deviations of mean bores and outside diameters of purchased rings are in ``iso492.toml``.

The mean bore or outside diameter of a ring lies below its nominal by up to the tolerance of ISO 492. The seat has the limits of
its class in ISO 286. Both are taken as normal, centred and six standard deviations wide. So the mean interference is that of
the middles, and the variances add.

Mounting smooths the surfaces. NTN (Ball and Roller Bearings) subtracts 1 to 2.5 um from the interference of a ground shaft, and
5 to 7 um from that of a machined shaft. The bore of a housing is machined too. A loose fit is not smoothed.
"""

import math
import re
import tomllib
from bisect import bisect_left
from math import cbrt
from typing import NamedTuple

from rbdyn.base.faults import MethodError
from rbdyn.properties import FOLDER

TABLES = tomllib.loads((FOLDER / "iso286.toml").read_text(encoding="utf-8"))
RANGES: list[int] = TABLES["ranges_mm"]
LARGEST = RANGES[-1]
STANDARD_TOLERANCES: dict[str, list[float]] = TABLES["standard_tolerances"]
M6_EXCEPTION = (10, -9.0)  # range 250 to 315 mm: -9 by the standard, where the rule gives -11
CODE = re.compile(r"(js|JS|[defghjkmnprsDEFGHJKMNPRS])(01|\d{1,2})")


def tolerance_unit(nominal_mm: float) -> float:
    """Standard tolerance unit i of ISO 286-1 in mm: 0.45 D^(1/3) + 0.001 D in um, D > 0 in mm."""
    return 1e-3 * (0.45 * cbrt(nominal_mm) + 0.001 * nominal_mm)


def grade_tolerances(nominal_mm: float) -> dict[str, float]:
    """Tolerance in mm of each grade IT01 to IT18 as the standard lists it, from the narrowest.

    Raises MethodError outside 0 to 500 mm.
    """
    column = _column(nominal_mm)
    return {grade: 1e-3 * row[column] for grade, row in STANDARD_TOLERANCES.items()}


def fit_limits(nominal_mm: float, code: str) -> tuple[float, float]:
    """Lower and upper deviation in mm of a tolerance class such as "k5" (shaft) or "H7" (hole).

    Raises MethodError for a class or size that is not listed here.
    """
    match = CODE.fullmatch(code)
    if match is None or f"IT{match[2]}" not in STANDARD_TOLERANCES:
        raise MethodError(
            'is not a tolerance class such as "h6", "k5" or "H7"; letters known: d to h, j, js, k, m, n, p, r, s'
        )
    letter, width = match[1], grade_tolerances(nominal_mm)[f"IT{match[2]}"]
    if letter in ("js", "JS"):
        return -width / 2, width / 2
    grade = 0 if match[2] == "01" else int(match[2])
    near = _hole(nominal_mm, letter, grade) if letter.isupper() else _shaft(nominal_mm, letter, grade)
    # d to h lie below a shaft's nominal and above a hole's, the rest on the other side.
    grows = letter in "jkmnprsDEFGH"
    return (1e-3 * near, 1e-3 * near + width) if grows else (1e-3 * near - width, 1e-3 * near)


def position_limits(nominal_mm: float, letter: str, width_mm: float) -> tuple[float, float]:
    """Lower and upper deviation in mm of a tolerance of any width at the position of a letter.

    Only for letters whose fundamental deviation does not depend on the grade. Raises MethodError as ``fit_limits``.
    """
    if letter in ("js", "JS"):
        return -width_mm / 2, width_mm / 2
    lower, upper = fit_limits(nominal_mm, f"{letter}6")
    return (lower, lower + width_mm) if letter in "mnprsDEFGH" else (upper - width_mm, upper)


def _column(nominal_mm: float) -> int:
    if not 0 < nominal_mm <= LARGEST:
        raise MethodError(f"lies outside the tables of ISO 286, which reach from 0 to {LARGEST} mm here")
    return bisect_left(RANGES, nominal_mm)


def _deviation(nominal_mm: float, letter: str) -> float:
    fine: dict[str, list[float]] = TABLES["fine_deviations"]
    rows: dict[str, list[float]] = TABLES["deviations"]
    if letter in fine:
        return fine[letter][bisect_left(TABLES["fine_ranges_mm"], nominal_mm)]
    return rows[letter][_column(nominal_mm)]


def _shaft(nominal_mm: float, letter: str, grade: int) -> float:
    if letter == "j":
        return _listed("shaft_j", grade)[_column(nominal_mm)]
    if letter == "k" and not 4 <= grade <= 7:
        return 0.0
    return _deviation(nominal_mm, letter) * (-1 if letter in "defgh" else 1)


def _hole(nominal_mm: float, letter: str, grade: int) -> float:
    """Lower deviation of D to H, upper deviation of J to S, in micrometres."""
    lower, column = letter.lower(), _column(nominal_mm)
    if lower in "defgh":
        return _deviation(nominal_mm, lower)
    if lower == "j":
        return _listed("hole_j", grade)[column]
    if (letter, grade, column) == ("M", 6, M6_EXCEPTION[0]):
        return M6_EXCEPTION[1]
    last = 8 if lower in "kmn" else 7
    if lower in "kn" and grade > last and column > 0:
        if lower == "k":
            raise MethodError("is not in the standard: K ends at grade 8 above 3 mm")
        return 0.0
    return -_deviation(nominal_mm, lower) + (_delta(column, grade) if grade <= last else 0.0)


def _delta(column: int, grade: int) -> float:
    """Delta of a hole, by which it fits like the shaft of the next finer grade (sizes above 3 mm)."""
    if grade < 3:
        raise MethodError("is not in the standard: holes K to S begin at grade 3")
    width, finer = (STANDARD_TOLERANCES[f"IT{number}"][column] for number in (grade, grade - 1))
    return width - finer if column > 0 else 0.0


def _listed(table: str, grade: int) -> list[float]:
    rows: dict[str, list[float]] = TABLES[table]
    if str(grade) not in rows:
        raise MethodError(f"is not listed here: {'j' if table == 'shaft_j' else 'J'} has the grades {', '.join(rows)}")
    return rows[str(grade)]


SURFACES = tomllib.loads((FOLDER / "iso492.toml").read_text(encoding="utf-8"))
CLASSES = [name for name in SURFACES["bore"] if name != "sizes_mm"]


def ring_limits(nominal_mm: float, code: str) -> tuple[float, float]:
    """Lower and upper deviation in mm of purchased bearing rings, such as "P5 bore" or "Normal outside".

    ISO 492, mean diameter in a plane, radial bearings except tapered roller bearings; classes Normal, 6, 5 and 4. The upper
    deviation is 0, the lower one is in ``iso492.toml``. Sizes without several published catalogue tables for comparison are
    left out.

    Raises MethodError for a class, surface or size that is not listed here.
    """
    name, _, surface = code.partition(" ")
    if surface not in SURFACES or name not in CLASSES:
        raise MethodError(
            f'is not a ring class such as "P5 bore" or "Normal outside"; classes known: {", ".join(CLASSES)}'
        )
    ranges, lower = SURFACES[surface]["sizes_mm"], SURFACES[surface][name]
    column = bisect_left(ranges, nominal_mm)
    if nominal_mm <= 0 or column >= len(lower):
        raise MethodError(f"is listed here from 0 to {ranges[len(lower) - 1]:g} mm; give the deviations themselves")
    return 1e-3 * lower[column], 0.0


SHAFT = re.compile(r"(g|h|js?|k|m|n|p|r)[4-7]")
HOUSING = re.compile(r"(G|H|JS?|K|M|N|P)[5-8]")
# Mean loss of interference by smoothing of ground shafts and machined bores [um].
SHAFT_SMOOTHING, HOUSING_SMOOTHING = 1.75, 6.0
# Width of a tolerance in standard deviations.
WIDTH = 6.0


class Interference(NamedTuple):
    """Diametral interference of a ring on its seat [um], negative for a loose fit: mean, standard deviation and ends.

    ``smoothing``: the loss by smoothing, already subtracted.
    """

    mean: float
    sd: float
    low: float
    high: float
    smoothing: float


def shaft_interference(bore_mm: float, zone: str, ring_class: str = "Normal") -> Interference:
    """Interference of an inner ring of a class of ISO 492 on a shaft of a class such as "k5".

    Raises MethodError for an unlisted class or size.
    """
    if not SHAFT.fullmatch(zone):
        raise MethodError(
            'is not a tolerance class of a shaft such as "k5"; take g, h, j, js, k, m, n, p or r, grade 4 to 7'
        )
    return _interference(fit_limits(bore_mm, zone), _bought_limits(bore_mm, ring_class, "bore"), SHAFT_SMOOTHING)


def housing_interference(outside_mm: float, zone: str, ring_class: str = "Normal") -> Interference:
    """Interference of an outer ring in a housing of a class such as "H7". Raises MethodError as ``shaft_interference``."""
    if not HOUSING.fullmatch(zone):
        raise MethodError(
            'is not a tolerance class of a housing such as "H7"; take G, H, J, JS, K, M, N or P, grade 5 to 8'
        )
    return _interference(
        _bought_limits(outside_mm, ring_class, "outside"), fit_limits(outside_mm, zone), HOUSING_SMOOTHING
    )


def _bought_limits(nominal_mm: float, ring_class: str, surface: str) -> tuple[float, float]:
    if ring_class not in CLASSES:
        raise MethodError(f"rings of class {ring_class} are not listed here; choose one of {', '.join(CLASSES)}")
    try:
        return ring_limits(nominal_mm, f"{ring_class} {surface}")
    except MethodError as error:
        raise MethodError(f"{surface} of rings of class {ring_class} {error}") from None


def _interference(inside: tuple[float, float], around: tuple[float, float], smoothing: float) -> Interference:
    """Interference from lower and upper deviations [mm] of the inner and of the outer part."""
    low, high = 1e3 * (inside[0] - around[1]), 1e3 * (inside[1] - around[0])
    mean = 0.5 * (low + high)
    sd = 1e3 * math.hypot(inside[1] - inside[0], around[1] - around[0]) / WIDTH
    loss = min(smoothing, max(mean, 0.0))
    return Interference(mean - loss, sd, low - loss, high - loss, loss)
