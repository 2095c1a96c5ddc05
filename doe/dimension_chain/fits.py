"""Links that are no sums: raceways that a press fit widens or narrows, parts that temperature widens.

Rings, shafts and housings are thick cylinders of one length in plane stress (Lamé), as in `rbdyn.mounting.rings`.
"""

from doe.dimension_chain.links import PressFit
from rbdyn.mounting.rings import Ring, interface_pressure
from rbdyn.properties.materials import Material

MM = 1e-3


def press_fit_factor(fit: PressFit, bore_nominal: float) -> float:
    """Change of the raceway's diameter per interference of a tight fit; positive on the outer part, else negative.

    A solid shaft in a ring of its own material widens the ring's outside by fit/outside. ``bore_nominal`` [mm] is the
    diameter of the fit unless it has its own. Raises ValueError unless shaft_bore < fit < outside and the raceway lies
    on one of the two parts.
    """
    fit_mm, raceway_mm = fit.fit_mm or bore_nominal, fit.raceway_mm
    outer = raceway_mm > fit_mm
    # The raceway bounds the part that it stands on, unless told otherwise.
    shaft_bore_mm = (0.0 if outer else raceway_mm) if fit.shaft_bore_mm is None else fit.shaft_bore_mm
    outside_mm = raceway_mm if fit.outside_mm is None else fit.outside_mm
    if fit.outside_mm is None and not outer:
        raise ValueError("outside_mm is missing: give the outside diameter of what holds the ring")
    if not shaft_bore_mm <= raceway_mm <= outside_mm or raceway_mm == fit_mm:
        raise ValueError(f"a raceway of {raceway_mm:g} mm lies on neither part; mend its diameter")
    # Free of loads but the pressure, a part needs neither mass nor heat.
    shaft_steel = Material(1e9 * fit.shaft_modulus_GPa, fit.shaft_poisson, 0.0)
    bore_steel = Material(1e9 * fit.bore_modulus_GPa, fit.bore_poisson, 0.0)
    shaft = Ring(MM * shaft_bore_mm / 2, MM * fit_mm / 2, shaft_steel)
    bore = Ring(MM * fit_mm / 2, MM * outside_mm / 2, bore_steel)
    pressure = interface_pressure(shaft, bore, MM)
    radius = MM * raceway_mm / 2
    if outer:
        return 2 * bore.pressure_growth(radius, inside=pressure) / MM
    return 2 * shaft.pressure_growth(radius, outside=pressure) / MM
