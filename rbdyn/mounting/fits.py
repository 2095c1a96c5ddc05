"""From the mounting table of a scene to rings, fits and the clearances in operation."""

from typing import NamedTuple

from rbdyn.mounting.cage import CageBody, CageClearances, guide_clearance, pocket_circle_shift, pocket_clearance
from rbdyn.mounting.rings import MountedClearance, MountedRings, Ring, mounted_clearance
from rbdyn.properties.materials import Material
from rbdyn.scene.bearing import Bearing, Cage, Materials
from rbdyn.scene.mounting import Mounting, Raceways, material_of, raceway_radii


class RunningSpeeds(NamedTuple):
    """Speeds of inner ring, outer ring and cage [rad/s]."""

    inner: float
    outer: float
    cage: float


def mounted_rings(
    mounting: Mounting,
    bearing: Raceways,
    inner_material: Material,
    outer_material: Material,
    inner_speed: float,
    outer_speed: float = 0.0,
) -> MountedRings:
    """Rings of a scene's bearing, of rollers or balls, as mounted, at speeds [rad/s] of shaft and housing.

    Raises ValueError where ``rbdyn.scene.mounting.faults`` finds any.
    """
    reference = mounting.reference_temperature_C
    inner_rise = _rise(mounting.inner_ring_temperature_C, reference, 0.0)
    outer_rise = _rise(mounting.outer_ring_temperature_C, reference, 0.0)
    shaft_rise = _rise(mounting.shaft_temperature_C, reference, inner_rise)
    housing_rise = _rise(mounting.housing_temperature_C, reference, outer_rise)
    element_rise = _rise(mounting.roller_temperature_C, reference, 0.5 * (inner_rise + outer_rise))
    inner_speed, outer_speed = (inner_speed, outer_speed) if mounting.rotation else (0.0, 0.0)

    shaft_bore, bore = 0.5 * mounting.shaft_bore, 0.5 * mounting.bore
    outside, housing_outside = 0.5 * mounting.outside_diameter, 0.5 * mounting.housing_diameter
    inner_race, outer_race = raceway_radii(bearing)
    return MountedRings(
        shaft=Ring(shaft_bore, bore, material_of(mounting.shaft_material), shaft_rise, inner_speed),
        inner_ring=Ring(bore, inner_race, inner_material, inner_rise, inner_speed),
        outer_ring=Ring(outer_race, outside, outer_material, outer_rise, outer_speed),
        housing=Ring(outside, housing_outside, material_of(mounting.housing_material), housing_rise, outer_speed),
        inner_interference=mounting.inner_interference,
        outer_interference=mounting.outer_interference,
        element_temperature_rise=element_rise,
    )


def operating_clearance(
    mounting: Mounting, bearing: Bearing, materials: Materials, inner_speed: float, outer_speed: float = 0.0
) -> MountedClearance:
    """Diametral clearance of a scene's roller bearing as mounted, at speeds [rad/s] of shaft and housing.

    ``bearing.radial_clearance_mm`` is the clearance before mounting. Raises ValueError as ``mounted_rings``.
    """
    material = material_of(materials.rings)
    rings = mounted_rings(mounting, bearing, material, material, inner_speed, outer_speed)
    return mounted_clearance(bearing.radial_clearance, rings, bearing.roller_diameter, material_of(materials.roller))


def cage_temperature_rise(mounting: Mounting, guidance: str, rings: MountedRings) -> float:
    """Rise of a cage above the drawing [K]: as given, else the mean of the rollers and of the ring that guides it."""
    rollers = rings.element_temperature_rise
    by = {"outer": rings.outer_ring.temperature_rise, "inner": rings.inner_ring.temperature_rise, "roller": rollers}
    return _rise(mounting.cage_temperature_C, mounting.reference_temperature_C, 0.5 * (rollers + by[guidance]))


def cage_clearances(
    mounting: Mounting, bearing: Bearing, cage: Cage, materials: Materials, land_diameter: float, speeds: RunningSpeeds
) -> CageClearances:
    """Clearances of a scene's cage as mounted, with its land on a ring at ``land_diameter`` [m].

    The keys of ``cage`` are clearances of the drawing. Raises ValueError as ``mounted_rings``.
    """
    material, roller = material_of(materials.rings), material_of(materials.roller)
    rings = mounted_rings(mounting, bearing, material, material, speeds.inner, speeds.outer)
    rise = cage_temperature_rise(mounting, cage.guidance, rings)
    turning = speeds.cage if mounting.rotation else 0.0
    body = CageBody(material_of(materials.cage), cage.hoop_modulus_share, rise, turning)
    hot_roller = bearing.roller_diameter, roller, rings.element_temperature_rise
    play, lip = cage.guide_clearance, cage.lip_clearance
    return CageClearances(
        None
        if cage.guidance == "roller" or play is None
        else guide_clearance(play, 0.5 * land_diameter, cage.guidance, rings, body),
        pocket_clearance(cage.pocket_clearance, *hot_roller, body),
        None if lip is None else pocket_clearance(lip, *hot_roller, body),
        pocket_circle_shift(0.5 * bearing.pitch_diameter, rings, body),
    )


def _rise(temperature: float | None, reference: float, otherwise: float) -> float:
    return otherwise if temperature is None else temperature - reference
