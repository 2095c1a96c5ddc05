"""Oils by grade or data sheet: viscosity through two points, and estimates by base oil for all other properties.

Viscosity: ASTM D341 (Walther) through two points; for a grade the second point follows from the viscosity index by ASTM D2270.
Pressure coefficient: Gold et al. 2001, alpha = s nu^t. ``BaseOil`` states the error of each estimate.
"""

import functools
import math
import re
from typing import NamedTuple, Self

from rbdyn.base.faults import MethodError
from rbdyn.properties import table
from rbdyn.properties.materials import ABSOLUTE_ZERO_C, Oil

# ISO 3448: kinematic viscosity at 40 C [mm^2/s], within 10 %.
GRADES = (10, 15, 22, 32, 46, 68, 100, 150, 220, 320, 460)
# Relative error of the pressure coefficients of ``BaseOil`` compared with measurements at 40 to 100 C [-].
GOLD_SPREAD = 0.25
DENSITY_C = 15.0  # temperature of densities in data sheets


class BaseOil(NamedTuple):
    """Estimates of the properties of an oil by its base oil, where its grade or data sheet states none.

    ``gold``: s [1e-8/Pa] and t of alpha = s nu^t, nu [mm^2/s] at temperature, within 25 % (31 % for naphthenic oils).
    ``density`` at 15 C [kg/m^3], within 3 %. ``expansion``: its relative decrease a kelvin, within 20 %. ``conductivity``
    [W/(m K)], within 10 %; None for the 0.12 (1 - 1.67e-4 C) over the specific gravity of mineral oils. ``heat_capacity``
    [J/(kg K)], within 10 %; None for the (1630 + 3.4 C) over the root of the specific gravity. ``shear_ratio``: limiting shear
    stress over pressure.
    """

    viscosity_index: float
    gold: tuple[float, float]
    density: float
    expansion: float
    shear_ratio: float
    conductivity: float | None = None
    heat_capacity: float | None = None


# Gold's constants and expansions as quoted by gear programs. Limits of shear from measured traction (naphthenic 0.053,
# paraffinic 0.047, PAO 0.035; ester and PAG as PAO, since their films have similar friction in gears). Indices, densities, the
# expansion of PAG and the last two columns are usual values of data sheets.
BASE_OILS = {
    "mineral": BaseOil(95.0, (0.9904, 0.1390), 875.0, 5.7e-4, 0.047),
    "naphthenic": BaseOil(50.0, (0.9904, 0.1390), 900.0, 5.7e-4, 0.053),
    "PAO": BaseOil(140.0, (0.7382, 0.1335), 833.0, 6.3e-4, 0.035),
    "ester": BaseOil(140.0, (0.6605, 0.1360), 960.0, 7.4e-4, 0.035, 0.15, 2000.0),
    "PAG": BaseOil(200.0, (0.5489, 0.1485), 1020.0, 7.0e-4, 0.035, 0.16, 2000.0),
}

THINNEST, THICKEST = 2.0, 1000.0  # at 100 C [mm^2/s]; the viscosity index is undefined below the first
BISECTIONS = 60


class Walther(NamedTuple):
    """Kinematic viscosity over temperature: lg lg(nu + 0.7) = a - b lg T, nu in mm^2/s above 2, T in K (ASTM D341).

    Extrapolated from 40 and 100 C to -40 C it is 1.7 to 2.2 times too high for synthetic oils: use a point nearby.
    """

    a: float
    b: float

    @classmethod
    def through(cls, first: tuple[float, float], second: tuple[float, float]) -> Self:
        """Through two points (temperature [C], kinematic viscosity [mm^2/s]) of different temperatures."""
        (x0, y0), (x1, y1) = (
            (math.log10(celsius - ABSOLUTE_ZERO_C), math.log10(math.log10(viscosity + 0.7)))
            for celsius, viscosity in (first, second)
        )
        slope = (y0 - y1) / (x1 - x0)
        return cls(y0 + slope * x0, slope)

    def viscosity(self, celsius: float) -> float:
        """Kinematic viscosity [mm^2/s] at a temperature [C]."""
        return float(10.0 ** (10.0 ** (self.a - self.b * math.log10(celsius - ABSOLUTE_ZERO_C))) - 0.7)

    def slope(self, celsius: float) -> float:
        """Its derivative by temperature [mm^2/(s K)], negative."""
        kelvin = celsius - ABSOLUTE_ZERO_C
        twice = 10.0 ** (self.a - self.b * math.log10(kelvin))
        return -(self.viscosity(celsius) + 0.7) * math.log(10.0) * twice * self.b / kelvin


class Fluid(NamedTuple):
    """An oil at any temperature: its viscosity, its base, and its density at 15 C [kg/m^3]."""

    viscosity: Walther
    base: BaseOil
    density: float

    def at_temperature(self, celsius: float) -> Oil:
        """The oil at a temperature [C]."""
        base, gravity = self.base, self.density * 1e-3
        density = self.density * (1.0 - base.expansion * (celsius - DENSITY_C))
        kinematic = self.viscosity.viscosity(celsius)
        conductivity = base.conductivity or 0.12 * (1.0 - 1.67e-4 * celsius) / gravity
        heat_capacity = base.heat_capacity or (1630.0 + 3.4 * celsius) / math.sqrt(gravity)
        factor, exponent = base.gold
        return Oil(
            viscosity=1e-6 * kinematic * density,
            viscosity_slope=1e-6
            * (kinematic * self.density * base.expansion - self.viscosity.slope(celsius) * density),
            density=density,
            conductivity=conductivity,
            pressure_coefficient=1e-8 * factor * kinematic**exponent,
            heat_capacity=heat_capacity,
        )


def viscosity_index(at_40: float, at_100: float) -> float:
    """Viscosity index of an oil with these kinematic viscosities [mm^2/s] (ASTM D2270, ``d2270.csv``).

    100 (L - U)/(L - H) up to 100, beyond 100 + (10^N - 1)/0.00715 with N = lg(H/U)/lg Y. Raises MethodError where the
    viscosity at 100 C is below 2 mm^2/s, for which none is defined.
    """
    if at_100 < THINNEST:
        raise MethodError(f"{at_100:g} mm2/s at 100 C: no viscosity index is defined below {THINNEST:g}")
    rows = ([float(value) for value in row.values()] for row in table("d2270"))
    _, a, b, c, d, e, f = [row for row in rows if row[0] <= at_100][-1]
    low, high = (a * at_100 + b) * at_100 + c, (d * at_100 + e) * at_100 + f
    if at_40 >= high:
        return 100.0 * (low - at_40) / (low - high)
    return float(100.0 + (10.0 ** (math.log10(high / at_40) / math.log10(at_100)) - 1.0) / 0.00715)


def viscosity_at_100(at_40: float, index: float) -> float:
    """Kinematic viscosity at 100 C [mm^2/s] that gives an oil of ``at_40`` this viscosity index.

    Raises MethodError where that is below 2 mm^2/s or not below ``at_40``.
    """
    low, high = THINNEST, min(at_40, THICKEST)
    if not low < high or not viscosity_index(at_40, low) <= index <= viscosity_index(at_40, high):
        raise MethodError(f"viscosity index {index:g}: no oil of {at_40:g} mm2/s at 40 C has it")
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if viscosity_index(at_40, middle) < index else (low, middle)
    return high


@functools.cache
def grade_oil(grade: float, base: BaseOil, index: float | None = None) -> Fluid:
    """An oil of an ISO viscosity grade; its index defaults to that of the base oil. Raises MethodError."""
    at_100 = viscosity_at_100(grade, base.viscosity_index if index is None else index)
    return Fluid(Walther.through((40.0, grade), (100.0, at_100)), base, base.density)


class NamedOil(NamedTuple):
    """A requested oil: its name in a scene, its base oil if stated, and whether it is the oil of a grease."""

    oil: str
    base_oil: str | None = None
    grease: bool = False


VISCOSITY_GRADE = re.compile(r"(grease\s+)?(?:iso\s*)?vg\s*-?(\d{1,4})\s*([a-z]*)", re.IGNORECASE | re.ASCII)
NUMBERS = {"7808": "MIL-L-7808", "23699": "MIL-L-23699", "85734": "MIL-L-85734"}


def oil_named(text: str) -> NamedOil:
    """The oil of a text such as "ISO VG 32", "VG 15 PAO", "grease VG 100 mineral", "23699" or "Jet Oil II". Raises MethodError."""
    plain = " ".join(text.split())
    if graded := VISCOSITY_GRADE.fullmatch(plain):
        grease, grade, base = graded.groups()
        bases = {name.lower(): name for name in BASE_OILS}
        if int(grade) in GRADES and (not base or base.lower() in bases):
            return NamedOil(f"ISO VG {int(grade)}", bases.get(base.lower()), bool(grease))
    for number, name in NUMBERS.items():
        if re.fullmatch(rf"(?:mil-?(?:l|prf)-?)?{number}[a-z]?", plain, re.IGNORECASE):
            return NamedOil(name)
    if re.fullmatch(r"(?:mobil )?jet (?:oil )?(?:ii|2)", plain, re.IGNORECASE):
        return NamedOil(next(iter(TURBINE_OILS)))
    raise MethodError(
        f"is not a known oil; write ISO VG {', '.join(map(str, GRADES[:-1]))} or {GRADES[-1]} (with grease before it, "
        f"{', '.join(BASE_OILS)} behind it), 7808, 23699, 85734 or Jet Oil II. Own data: oil = 'data_sheet' in [lubricant]"
    )


# The maker's data sheet: 27.6 and 5.1 mm^2/s at 40 and 100 C, 1003.5 kg/m^3 at 15 C.
JET_OIL_II = Fluid(Walther.through((40.0, 27.6), (100.0, 5.1)), BASE_OILS["ester"], 1003.5)
# Oils of gas turbines that have no formulas of their own.
TURBINE_OILS = {"Mobil Jet Oil II": JET_OIL_II}
