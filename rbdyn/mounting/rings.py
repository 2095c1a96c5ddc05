"""Growth of bearing rings by fits, rotation and temperature, and what it leaves of a clearance or makes of the grooves of balls.

Rings are thick cylinders of one length in plane stress, shaft and housing too: flanges, grooves and shoulders are left out.
Radii are of the drawing; growths are radial, clearances and interferences diametral [m]. The ring of a ball bearing lies between
its bore and the circle on which balls touch its race at the nominal angle; a middle ring lies between two such circles.

Hu et al. (paper on the contact angle of a double-decker bearing, eq 4) take a free annulus at its outer radius, with the
*pitch* diameter in place of the race's; the factor 1/(32 E) is missing in print. ``printed_growth`` keeps that form for
comparison. It overstates the growth, as pitch circles lie outside inner races, and it knows no growth of a bore: their
eq 18 lacks that of the middle ring's inner race.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from rbdyn.base.faults import MethodError
from rbdyn.properties.materials import Material


@dataclass(frozen=True)
class Ring:
    """A ring, a solid (inner radius 0) or hollow shaft, or a housing.

    Radii [m]; ``temperature_rise`` above the temperature of the drawing [K], uniform; ``speed`` [rad/s].
    Raises MethodError unless 0 <= inner radius < outer radius.
    """

    inner_radius: float
    outer_radius: float
    material: Material
    temperature_rise: float = 0.0
    speed: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.inner_radius < self.outer_radius:
            raise MethodError(
                f"a ring from {self.inner_radius:g} to {self.outer_radius:g} m has no wall; fix its diameters"
            )

    def pressure_growth(self, radius: float, inside: float = 0.0, outside: float = 0.0) -> float:
        """Growth at ``radius`` [m] under pressures on bore and outside [Pa] (Lamé)."""
        a, b, nu = self.inner_radius, self.outer_radius, self.material.poisson_ratio
        uniform = (1.0 - nu) * (inside * a**2 - outside * b**2)
        sheared = (1.0 + nu) * (inside - outside) * self._bore_term(radius)
        return radius * (uniform + sheared) / (self.material.elastic_modulus * (b**2 - a**2))

    def rotation_growth(self, radius: float) -> float:
        """Growth at ``radius`` [m] of the ring turning free (Timoshenko and Goodier, rotating disk).

        u = rho w^2 r/(8E) [(3+nu)(1-nu)(a^2+b^2) + (1+nu)(3+nu) a^2 b^2/r^2 - (1-nu^2) r^2].
        """
        a, b, nu = self.inner_radius, self.outer_radius, self.material.poisson_ratio
        shape = (
            (3.0 + nu) * (1.0 - nu) * (a**2 + b**2)
            + (1.0 + nu) * (3.0 + nu) * self._bore_term(radius)
            - (1.0 - nu**2) * radius**2
        )
        load = self.material.density * self.speed**2
        return load * radius / (8.0 * self.material.elastic_modulus) * shape

    def thermal_growth(self, radius: float) -> float:
        """Growth at ``radius`` [m] by free expansion."""
        return self.material.thermal_expansion * self.temperature_rise * radius

    def growth(self, radius: float, inside: float = 0.0, outside: float = 0.0) -> float:
        """Whole growth at ``radius`` [m]: temperature, rotation and pressures [Pa]."""
        free = self.thermal_growth(radius) + self.rotation_growth(radius)
        return free + self.pressure_growth(radius, inside, outside)

    def _bore_term(self, radius: float) -> float:
        # a^2 b^2/r^2, which a solid disk lacks even at its centre.
        return (self.inner_radius * self.outer_radius / radius) ** 2 if self.inner_radius > 0.0 else 0.0


def interface_pressure(inner: Ring, outer: Ring, interference: float) -> float:
    """Pressure [Pa] between two fitted rings at their temperature and speed; 0 where the fit has come loose.

    ``interference``: diametral, at the temperature of the drawing and at rest [m], positive tight. From
    compatibility: growth of the outer bore less growth of the inner outside is half the interference.
    Raises MethodError when the rings do not share the nominal radius.
    """
    if not math.isclose(inner.outer_radius, outer.inner_radius, rel_tol=1e-9):
        raise MethodError(
            f"radii of {inner.outer_radius:g} and {outer.inner_radius:g} m are not those of one fit; give the "
            "nominal radius to both and the rest as interference"
        )
    radius = outer.inner_radius
    overlap = 0.5 * interference + inner.growth(radius) - outer.growth(radius)
    compliance = outer.pressure_growth(radius, inside=1.0) - inner.pressure_growth(radius, outside=1.0)
    return max(overlap / compliance, 0.0)


def loosening_speed(inner: Ring, outer: Ring, interference: float) -> float:
    """Speed [rad/s] of both rings together at which their fit comes loose, whatever speeds they have themselves.

    Rotation widens the outer more: overlap at rest = (difference of the growths at 1 rad/s) times speed^2. 0 where the
    fit is loose at rest, infinite where the inner ring grows as much as the outer. Raises MethodError as
    ``interface_pressure``.
    """
    if interface_pressure(replace(inner, speed=0.0), replace(outer, speed=0.0), interference) == 0.0:
        return 0.0
    radius = outer.inner_radius
    overlap = 0.5 * interference + inner.thermal_growth(radius) - outer.thermal_growth(radius)
    opening = replace(outer, speed=1.0).rotation_growth(radius) - replace(inner, speed=1.0).rotation_growth(radius)
    return math.sqrt(overlap / opening) if opening > 0.0 else math.inf


@dataclass(frozen=True)
class MountedRings:
    """Shaft, both rings and housing at their temperatures and speeds; interferences are diametral [m], positive tight.

    ``inner_ring`` ends at its raceway outside, ``outer_ring`` at its raceway inside; each turns at its own speed. ``element_temperature_rise``: of balls or rollers above the drawing [K].
    """

    shaft: Ring
    inner_ring: Ring
    outer_ring: Ring
    housing: Ring
    inner_interference: float
    outer_interference: float
    element_temperature_rise: float = 0.0

    @property
    def inner_pressure(self) -> float:
        """Pressure between shaft and inner ring [Pa]; 0 where rotation or heat has loosened the fit."""
        return interface_pressure(self.shaft, self.inner_ring, self.inner_interference)

    @property
    def outer_pressure(self) -> float:
        """Pressure between outer ring and housing [Pa]."""
        return interface_pressure(self.outer_ring, self.housing, self.outer_interference)

    @property
    def loosening_speed(self) -> float:
        """Speed [rad/s] at which rotation loosens the inner ring from its shaft; 0 if loose at rest, or infinite."""
        return loosening_speed(self.shaft, self.inner_ring, self.inner_interference)


@dataclass(frozen=True)
class MountedClearance:
    """Where the clearance goes. Changes of the diametral clearance [m], negative where they take some.

    ``operating`` is the sum of ``initial`` and the four changes. The fits count with the pressures [Pa] that
    temperature and rotation leave them; temperature and rotation count as if the rings were free.
    """

    initial: float
    inner_fit: float
    outer_fit: float
    temperature: float
    rotation: float
    operating: float
    inner_pressure: float
    outer_pressure: float


def mounted_clearance(
    initial: float, rings: MountedRings, roller_diameter: float, roller_material: Material
) -> MountedClearance:
    """Diametral clearance of a mounted roller bearing as it runs, from ``initial`` of the loose parts [m].

    Raises MethodError as ``interface_pressure``.
    """
    inner_pressure, outer_pressure = rings.inner_pressure, rings.outer_pressure
    inner, outer = rings.inner_ring, rings.outer_ring
    inner_race, outer_race = inner.outer_radius, outer.inner_radius
    # A growth takes its double from a diameter; each roller stands in the gap twice across the bearing.
    inner_fit = -2.0 * inner.pressure_growth(inner_race, inside=inner_pressure)
    outer_fit = 2.0 * outer.pressure_growth(outer_race, outside=outer_pressure)
    rollers = 2.0 * roller_material.thermal_expansion * rings.element_temperature_rise * roller_diameter
    races = 2.0 * (outer.thermal_growth(outer_race) - inner.thermal_growth(inner_race))
    temperature = races - rollers
    rotation = 2.0 * (outer.rotation_growth(outer_race) - inner.rotation_growth(inner_race))
    operating = initial + inner_fit + outer_fit + temperature + rotation
    return MountedClearance(
        initial, inner_fit, outer_fit, temperature, rotation, operating, inner_pressure, outer_pressure
    )


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
