"""Growth of the raceways of ball bearings, and what it does to the grooves of a row of balls.

A ring is a thick cylinder between its bore and the circle on which balls touch its race at the nominal angle; a middle
ring lies between two such circles. Groove and shoulders are left out. Growths are radial [m].

Hu et al. (paper on the contact angle of a double-decker bearing, eq 4) take a free annulus at its outer radius, with the
*pitch* diameter in place of the race's; the factor 1/(32 E) is missing in print. ``printed_growth`` keeps that form for
comparison. It overstates the growth, as pitch circles lie outside inner races, and it knows no growth of a bore: their
eq 18 lacks that of the middle ring's inner race.
"""

import math
from typing import NamedTuple

from rbdyn.mounting.rings import Ring
from rbdyn.properties.materials import Material


class GrooveChange(NamedTuple):
    """What growth does to a row [m].

    ``radial``: the inner groove centre moves outward against the outer one. ``inner_reach, outer_reach``: change of
    groove radius less ball radius.
    """

    radial: float
    inner_reach: float
    outer_reach: float


UNCHANGED = GrooveChange(0.0, 0.0, 0.0)


def printed_growth(pitch_diameter: float, bore_diameter: float, material: Material, speed: float) -> float:
    """Growth of a race as Hu et al. print it (eq 4) with the missing 1/(32 E) [m].

    psi = rho w^2 dm/(32 E) [Di^2 (3 + nu) + dm^2 (1 - nu)], dm the pitch and Di the bore diameter of the ring [m].
    """
    shape = bore_diameter**2 * (3.0 + material.poisson_ratio)
    shape += pitch_diameter**2 * (1.0 - material.poisson_ratio)
    load = material.density * speed**2
    return load * pitch_diameter / (32.0 * material.elastic_modulus) * shape


def groove_change(
    inner: Ring | None,
    outer: Ring | None,
    ball_diameter: float,
    groove_factors: tuple[float, float],
    contact_angle: float,
    *,
    ball_material: Material,
    ball_temperature_rise: float = 0.0,
    inner_pressure: float = 0.0,
    outer_pressure: float = 0.0,
) -> GrooveChange:
    """What rotation, heat and fits of both rings do to a row of balls between them.

    ``inner`` ends at its race outside, ``outer`` at its race inside; None for a ring that stays as it is. ``inner_pressure`` on the bore of the inner ring,
    ``outer_pressure`` on the outside of the outer one [Pa]. ``groove_factors``: groove radius over ball diameter, inner
    and outer. The groove centre moves as the circle of contact does, at the unloaded ``contact_angle`` [rad], and by the heat
    of its groove radius.
    """
    inner_radius, outer_radius = (factor * ball_diameter for factor in groove_factors)
    ball = 0.5 * ball_diameter * ball_material.thermal_expansion * ball_temperature_rise
    inner_centre = inner_heat = outer_centre = outer_heat = 0.0
    radially = math.cos(contact_angle)
    # Seen from the axis an inner groove's centre lies outside its race, an outer groove's inside.
    if inner is not None:
        inner_heat = inner.thermal_growth(inner_radius)
        inner_centre = inner.growth(inner.outer_radius, inside=inner_pressure) + inner_heat * radially
    if outer is not None:
        outer_heat = outer.thermal_growth(outer_radius)
        outer_centre = outer.growth(outer.inner_radius, outside=outer_pressure) - outer_heat * radially
    return GrooveChange(inner_centre - outer_centre, inner_heat - ball, outer_heat - ball)
