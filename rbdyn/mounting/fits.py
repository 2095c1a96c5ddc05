"""From the mounting table of a scene to rings, fits and the clearance in operation."""

from rbdyn.mounting.rings import MountedClearance, MountedRings, Ring, mounted_clearance
from rbdyn.properties.materials import Material
from rbdyn.scene.bearing import Bearing, Materials
from rbdyn.scene.mounting import Mounting, Raceways, material_of, raceway_radii


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


def _rise(temperature: float | None, reference: float, otherwise: float) -> float:
    return otherwise if temperature is None else temperature - reference
