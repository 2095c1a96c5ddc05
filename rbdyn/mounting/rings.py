"""Growth of rings by fits, rotation and temperature, and its effect on clearances and on the grooves of balls.

Radii are those of the drawing; growths are radial, clearances and interferences diametral [m].

Rings, shaft and housing are thick cylinders of one length in plane stress; flanges, grooves and shoulders are left out. The
ring of a ball bearing lies between its bore and the circle of contact on its race at the nominal angle. A middle ring lies
between two such circles.

Hu et al. (paper on the contact angle of a double-decker bearing, eq 4) use a free annulus at its outer radius. They put the
*pitch* diameter for that of the race, and the factor 1/(32 E) is missing in print. ``printed_growth`` keeps that form for
comparison. It overestimates the growth, since pitch circles lie outside inner races. It has no growth of a bore either: their
eq 18 lacks that of the middle ring's inner race.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.records import Record
from rbdyn.properties.materials import Material


class Ring(Record):
    """A ring, a solid (inner radius 0) or hollow shaft, or a housing.

    Radii [m]; ``temperature_rise`` above the temperature of the drawing [K], uniform; ``speed`` [rad/s].
    """

    inner_radius: float
    outer_radius: float
    material: Material
    temperature_rise: float = 0.0
    speed: float = 0.0

    def heat_capacity(self, width: float) -> float:
        """Heat capacity of the ring over a width [m], [J/K]."""
        area = math.pi * (self.outer_radius**2 - self.inner_radius**2)
        return area * width * self.material.density * self.material.heat_capacity

    def pressure_growth(self, radius: float, inside: float = 0.0, outside: float = 0.0) -> float:
        """Growth at ``radius`` [m] under pressures on bore and outside [Pa] (Lamé)."""
        a, b, nu = self.inner_radius, self.outer_radius, self.material.poisson_ratio
        uniform = (1.0 - nu) * (inside * a**2 - outside * b**2)
        sheared = (1.0 + nu) * (inside - outside) * self._bore_term(radius)
        return radius * (uniform + sheared) / (self.material.elastic_modulus * (b**2 - a**2))

    def rotation_growth(self, radius: float) -> float:
        """Growth at ``radius`` [m] of the free rotating ring (Timoshenko and Goodier, rotating disk).

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


def overlap(inner: Ring, outer: Ring, interference: float) -> Any:
    """Radial overlap of two rings before they press on each other, at their temperature and speed; negative is a gap [m].

    ``interference``: diametral, at rest and at the temperature of the drawing [m], positive for a tight fit. Both have
    the nominal radius of the fit.
    """
    radius = outer.inner_radius
    return 0.5 * interference + inner.growth(radius) - outer.growth(radius)


def interface_pressure(inner: Ring, outer: Ring, interference: float) -> Any:
    """Pressure [Pa] between two fitted rings at their temperature and speed; 0 for a loose fit.

    Compatibility: the growth of the outer bore less that of the inner outside diameter is half the ``interference``, as of
    ``overlap``, which also says what is raised. Temperatures of rings may be arrays.
    """
    radius, closing = outer.inner_radius, overlap(inner, outer, interference)
    compliance = outer.pressure_growth(radius, inside=1.0) - inner.pressure_growth(radius, outside=1.0)
    pressure = closing / compliance
    return max(pressure, 0.0) if isinstance(pressure, float) else np.maximum(pressure, 0.0)


def loosening_speed(inner: Ring, outer: Ring, interference: float) -> float:
    """Common speed [rad/s] of both rings at which their fit becomes loose, whatever their own speeds.

    The outer ring grows more: overlap at rest = (difference of the growths at 1 rad/s) times speed^2. 0 for a fit that is loose
    at rest; infinite where the inner ring grows as much. Raises MethodError as ``interface_pressure``.
    """
    if interface_pressure(replace(inner, speed=0.0), replace(outer, speed=0.0), interference) == 0.0:
        return 0.0
    radius = outer.inner_radius
    at_rest = 0.5 * interference + inner.thermal_growth(radius) - outer.thermal_growth(radius)
    opening = replace(outer, speed=1.0).rotation_growth(radius) - replace(inner, speed=1.0).rotation_growth(radius)
    return math.sqrt(at_rest / opening) if opening > 0.0 else math.inf


class MountedRings(Record):
    """Shaft, both rings and housing at their temperatures and speeds; interferences are diametral [m], positive for a tight fit.

    The outer radius of ``inner_ring`` and the inner radius of ``outer_ring`` are those of the raceways. Each ring has its own
    speed. ``element_temperature_rise``: of balls or rollers above the drawing [K].
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
        """Pressure between shaft and inner ring [Pa]; 0 where rotation or temperature loosens the fit."""
        return interface_pressure(self.shaft, self.inner_ring, self.inner_interference)

    @property
    def outer_pressure(self) -> float:
        """Pressure between outer ring and housing [Pa]."""
        return interface_pressure(self.outer_ring, self.housing, self.outer_interference)

    @property
    def seat_gaps(self) -> tuple[float, float]:
        """Radial gaps between outer ring and housing, and between inner ring and shaft [m]; 0 for a tight fit."""
        outer = overlap(self.outer_ring, self.housing, self.outer_interference)
        inner = overlap(self.shaft, self.inner_ring, self.inner_interference)
        return max(-outer, 0.0), max(-inner, 0.0)

    @property
    def loosening_speed(self) -> float:
        """Speed [rad/s] at which rotation loosens the inner ring from its shaft; 0 if loose at rest, or infinite."""
        return loosening_speed(self.shaft, self.inner_ring, self.inner_interference)


class MountedClearance(Record):
    """Diametral clearance and its changes [m], negative for a reduction.

    ``operating`` is the sum of ``initial`` and the four changes. Fits have the pressures [Pa] after temperature and rotation.
    The changes by temperature and rotation are those of free rings.
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
    """Operating diametral clearance of a mounted roller bearing, from the ``initial`` one before mounting [m].

    Raises MethodError as ``interface_pressure``.
    """
    inner_pressure, outer_pressure = rings.inner_pressure, rings.outer_pressure
    inner, outer = rings.inner_ring, rings.outer_ring
    inner_race, outer_race = inner.outer_radius, outer.inner_radius
    # A radial growth counts twice in a diameter, and two rollers lie across the bearing.
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
    """Changes of a row by growth [m].

    ``radial``: outward shift of the inner groove centre relative to the outer one. ``inner_reach, outer_reach``: change of
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
    """Changes of a row of balls by rotation, temperature and fits of both rings.

    The outer radius of ``inner`` and the inner radius of ``outer`` are those of the races; None for a ring without changes.
    ``inner_pressure`` acts on the bore of the inner ring, ``outer_pressure`` on the outside of the outer ring [Pa].
    ``groove_factors``: groove radius over ball diameter, inner and outer. The groove centre moves with the circle of contact at
    the unloaded ``contact_angle`` [rad], and by the thermal growth of its groove radius.
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
