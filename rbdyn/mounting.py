"""From the mounting table of a scene to the clearance in operation."""

from __future__ import annotations

from rbdyn.ring_expansion import MountedClearance, Ring, mounted_clearance
from rbdyn.scene.bearing import Bearing, Materials
from rbdyn.scene.mounting import Mounting, material_of


def operating_clearance(
    mounting: Mounting,
    bearing: Bearing,
    materials: Materials,
    inner_speed: float,
    outer_speed: float = 0.0,
) -> MountedClearance:
    """Diametral clearance of a scene's bearing as mounted, at speeds [rad/s] of shaft and housing.

    ``bearing.radial_clearance_mm`` is the clearance before mounting. The raceways are taken at the pitch diameter
    less and plus one roller: their share of the clearance would change a growth by some 1e-3 of itself.
    Raises ValueError where ``rbdyn.scene.mounting.faults`` finds any.
    """
    rings = material_of(materials.rings)
    reference = mounting.reference_temperature_C
    inner_rise = _rise(mounting.inner_ring_temperature_C, reference, 0.0)
    outer_rise = _rise(mounting.outer_ring_temperature_C, reference, 0.0)
    shaft_rise = _rise(mounting.shaft_temperature_C, reference, inner_rise)
    housing_rise = _rise(mounting.housing_temperature_C, reference, outer_rise)
    roller_rise = _rise(mounting.roller_temperature_C, reference, 0.5 * (inner_rise + outer_rise))
    inner_speed, outer_speed = (inner_speed, outer_speed) if mounting.rotation else (0.0, 0.0)

    shaft_bore, bore, outside, housing_outside = (
        0.5e-3 * diameter
        for diameter in (
            mounting.shaft_bore_mm,
            mounting.bore_mm,
            mounting.outside_diameter_mm,
            mounting.housing_diameter_mm,
        )
    )
    inner_race = 0.5e-3 * (bearing.pitch_diameter_mm - bearing.roller_diameter_mm)
    outer_race = 0.5e-3 * (bearing.pitch_diameter_mm + bearing.roller_diameter_mm)
    return mounted_clearance(
        bearing.radial_clearance_mm * 1e-3,
        shaft=Ring(shaft_bore, bore, material_of(mounting.shaft_material), shaft_rise, inner_speed),
        inner_ring=Ring(bore, inner_race, rings, inner_rise, inner_speed),
        outer_ring=Ring(outer_race, outside, rings, outer_rise, outer_speed),
        housing=Ring(
            outside, housing_outside, material_of(mounting.housing_material), housing_rise, outer_speed
        ),
        inner_interference=mounting.inner_interference_um * 1e-6,
        outer_interference=mounting.outer_interference_um * 1e-6,
        roller_diameter=bearing.roller_diameter_mm * 1e-3,
        roller_material=material_of(materials.roller),
        roller_temperature_rise=roller_rise,
    )


def _rise(temperature: float | None, reference: float, otherwise: float) -> float:
    return otherwise if temperature is None else temperature - reference
