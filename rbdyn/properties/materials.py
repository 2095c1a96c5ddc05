"""Materials by name: elastic constants, density, expansion and conduction of solids at 20 C; jet oils at a temperature.

The formulas of oils were published with ADORE-style oil data. MIL-L-7808 represents ester jet oils of the 3 cSt class (also the
4010 of Chen et al. 2022), MIL-L-23699 those of the 5 cSt class.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Elastic modulus [Pa], Poisson's ratio [-], density [kg/m^3], linear thermal expansion [1/K] (default: steel).

    Thermal conductivity [W/(m K)] and heat capacity [J/(kg K)], with defaults of bearing steel, are uncertain by 15 %.
    """

    elastic_modulus: float
    poisson_ratio: float
    density: float
    thermal_expansion: float = 12.0e-6
    conductivity: float = 46.0
    heat_capacity: float = 470.0

    @property
    def effusivity(self) -> float:
        """Thermal effusivity sqrt(k rho c) [W s^0.5/(m^2 K)]: how much heat the surface takes in a short contact."""
        return math.sqrt(self.conductivity * self.density * self.heat_capacity)


# Handbook values at room temperature; 52100 with the customary 206 GPa and 0.3. Expansions are middles of the usual ranges
# (4340: the lower end, at 20 C); that of silicon nitride is sometimes misprinted as 3.4e-5.
# Conductivities: 52100, silicon nitride and the middle of 81 to 121 for brass from NTN's catalogue 2203/E; M50 25.0 (ADORE-style
# inputs print 13.4, which no tool steel has). Aluminium bronze: data sheet of C95400, 58.7 and 419. Titanium: data
# sheets, 6.7 to 7.2 and 526 to 560. The others are usual handbook values, from memory. All are uncertain by 15 %.
MATERIALS = {
    "bearing_steel": Material(206e9, 0.30, 7827.0, 12.0e-6, 46.0, 470.0),
    "m50": Material(203e9, 0.28, 7900.0, 11.5e-6, 25.0, 460.0),
    "silicon_nitride": Material(317e9, 0.25, 3240.0, 3.2e-6, 20.0, 680.0),
    "aisi_4340": Material(205e9, 0.29, 7850.0, 12.7e-6, 44.5, 475.0),
    "bronze": Material(110e9, 0.33, 8800.0, 18.0e-6, 59.0, 376.0),
    "aluminium_bronze": Material(115e9, 0.33, 7550.0, 16.5e-6, 58.7, 419.0),
    "brass": Material(105e9, 0.34, 8500.0, 20.0e-6, 101.0, 380.0),
    "titanium_6al4v": Material(113.8e9, 0.342, 4430.0, 8.8e-6, 6.8, 550.0),
    "peek": Material(3.9e9, 0.40, 1320.0, 47.0e-6, 0.25, 1100.0),
    "phenolic_cotton": Material(8e9, 0.30, 1350.0, 30.0e-6, 0.3, 1500.0),
}
# Elastic modulus [Pa] that separates metals (100 GPa and more for bronze and steel cages) from polymers and laminates.
SOFTEST_METAL = 20e9


def equivalent_modulus(first: Material, second: Material) -> float:
    """Equivalent modulus E' = 2/[(1-nu1^2)/E1 + (1-nu2^2)/E2] [Pa] (E_eq of Chen et al. 2022, eq 6)."""
    compliance = sum((1.0 - part.poisson_ratio**2) / part.elastic_modulus for part in (first, second))
    return 2.0 / compliance


ABSOLUTE_ZERO_C = -273.15
# Coldest temperature [K] of the pressure coefficient of MIL-L-7808, whose formula has a pole at 215.56 K.
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


# MIL-L-85734 is a 5 cSt oil with additives for the load of gears.
OILS: dict[str, Callable[[float], Oil]] = {
    "MIL-L-7808": mil_l_7808,
    "MIL-L-23699": mil_l_23699,
    "MIL-L-85734": mil_l_23699,
}


def oil_at(name: str, temperature_c: float) -> Oil:
    """The named oil at a temperature [C]. Raises KeyError for an unknown name."""
    return OILS[name](temperature_c - ABSOLUTE_ZERO_C)


def _between(x: float, xs: tuple[float, ...], ys: tuple[float, ...]) -> float:
    """Piecewise linear interpolation, extrapolated along the outer segments."""
    right = next((i for i in range(1, len(xs) - 1) if x <= xs[i]), len(xs) - 1)
    x0, x1, y0, y1 = xs[right - 1], xs[right], ys[right - 1], ys[right]
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
