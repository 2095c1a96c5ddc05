"""Links that are no sums: raceways that a press fit widens or narrows, parts that temperature widens.

Rings, shafts and housings are thick cylinders of one length in plane stress (Lamé), as in `rbdyn.mounting.rings`.
"""

from rbdyn.mounting.rings import Ring, interface_pressure
from rbdyn.properties.materials import Material

MM = 1e-3


def press_fit_factor(
    *,
    fit_mm: float,
    raceway_mm: float,
    shaft_bore_mm: float,
    outside_mm: float,
    shaft_modulus_GPa: float = 206.0,  # noqa: N803
    bore_modulus_GPa: float = 206.0,  # noqa: N803
    shaft_poisson: float = 0.3,
    bore_poisson: float = 0.3,
) -> float:
    """Change of the raceway's diameter per interference of a tight fit; positive on the outer part, else negative.

    All diameters. A solid shaft in a ring of its own material widens the ring's outside by fit/outside.
    Raises ValueError unless shaft_bore < fit < outside and the raceway lies on one of the two parts.
    """
    if not shaft_bore_mm <= raceway_mm <= outside_mm or raceway_mm == fit_mm:
        raise ValueError(f"a raceway of {raceway_mm:g} mm lies on neither part; mend its diameter")
    # Free of loads but the pressure, a part needs neither mass nor heat.
    shaft_steel = Material(1e9 * shaft_modulus_GPa, shaft_poisson, 0.0)
    bore_steel = Material(1e9 * bore_modulus_GPa, bore_poisson, 0.0)
    shaft = Ring(MM * shaft_bore_mm / 2, MM * fit_mm / 2, shaft_steel)
    bore = Ring(MM * fit_mm / 2, MM * outside_mm / 2, bore_steel)
    pressure = interface_pressure(shaft, bore, MM)
    radius = MM * raceway_mm / 2
    if raceway_mm > fit_mm:
        return 2 * bore.pressure_growth(radius, inside=pressure) / MM
    return 2 * shaft.pressure_growth(radius, outside=pressure) / MM
