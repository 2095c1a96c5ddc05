"""Oils by name: viscosity, density and conductivity at a temperature.

Formulas as published with ADORE-style oil data. MIL-L-7808 stands for ester jet oils of the 3 cSt class (the
4010 of Chen et al. 2022 is taken as one), MIL-L-23699 for the 5 cSt class.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

ABSOLUTE_ZERO_C = -273.15
# The pressure coefficient of MIL-L-7808 has a pole at 215.56 K: it is held at its value at -40 C below that.
COLDEST_PRESSURE = 233.15


@dataclass(frozen=True)
class Oil:
    """An oil at one temperature.

    ``viscosity`` [Pa s], ``viscosity_slope`` = -d(viscosity)/dT [Pa s/K], ``density`` [kg/m^3],
    ``conductivity`` [W/(m K)], ``pressure_coefficient`` alpha of viscosity exp(alpha p) [1/Pa], ``heat_capacity`` [J/(kg K)].
    """

    viscosity: float
    viscosity_slope: float
    density: float
    conductivity: float
    pressure_coefficient: float
    heat_capacity: float


def mil_l_7808(kelvin: float) -> Oil:
    """Ester jet oil of the 3 cSt class: 11.6 mPa s at 40 C, 2.87 mPa s at 100 C."""
    a = math.exp(22.216 - 3.7048 * math.log(kelvin))
    b = math.exp(a)
    viscosity = 9.997e-4 * (b - 0.87)
    slope = viscosity * 3.7048 * a * b / ((b - 0.87) * kelvin)
    density = _between(kelvin, (311.0, 367.0, 422.0, 478.0), (954.0, 914.0, 870.0, 826.0))
    conductivity = _between(kelvin, (311.0, 367.0, 422.0, 478.0), (0.1449, 0.1340, 0.1327, 0.1314))
    pressure_coefficient = 7.5808e-10 + 1.0742e-6 / (max(kelvin, COLDEST_PRESSURE) - 215.56)
    heat_capacity = _between(kelvin, (311.0, 367.0, 422.0, 478.0), (1800.0, 1968.0, 2177.0, 2344.0))
    return Oil(viscosity, slope, density, conductivity, pressure_coefficient, heat_capacity)


def mil_l_23699(kelvin: float) -> Oil:
    """Ester jet oil of the 5 cSt class: 5.0 mPa s at 100 C."""
    inverse = (311.11 - kelvin) / (311.11 * kelvin)
    viscosity = 0.0276 * math.exp(3609.6 * inverse + 7.7657e5 * inverse**2)
    slope = viscosity * (3609.6 + 2.0 * 7.7657e5 * inverse) / kelvin**2
    density = _between(kelvin, (233.0, 300.0, 367.0, 422.0), (1016.0, 966.0, 922.0, 884.0))
    pressure_coefficient = math.exp(1.15607 * math.log(viscosity) - 17.496) / viscosity
    conductivity = 0.14868 - 2.2275e-4 * (kelvin - 366.67)
    return Oil(viscosity, slope, density, conductivity, pressure_coefficient, 2000.0)


# MIL-L-85734 is a 5 cSt oil with additives that bear load in gears.
OILS: dict[str, Callable[[float], Oil]] = {
    "MIL-L-7808": mil_l_7808,
    "MIL-L-23699": mil_l_23699,
    "MIL-L-85734": mil_l_23699,
}


def oil_at(name: str, temperature_c: float) -> Oil:
    """The named oil at a temperature [C]. Raises KeyError for an unknown name."""
    return OILS[name](temperature_c - ABSOLUTE_ZERO_C)


def _between(x: float, xs: tuple[float, ...], ys: tuple[float, ...]) -> float:
    """Piecewise-linear interpolation, extended along the outer segments."""
    right = next((i for i in range(1, len(xs) - 1) if x <= xs[i]), len(xs) - 1)
    x0, x1, y0, y1 = xs[right - 1], xs[right], ys[right - 1], ys[right]
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
