"""Values that look like another unit: outside what is usual for the bearing, with what may have been meant."""

import math

from rbdyn.scene.bearing import Bearing, Cage
from rbdyn.scene.lubricant import Lubricant
from rbdyn.scene.mounting import Mounting

# By the unit of a key, what a number in another unit is multiplied by; kelvin are shifted.
FACTORS = {"mm": {"m": 1e3, "um": 1e-3}, "um": {"mm": 1e3, "nm": 1e-3}, "g": {"kg": 1e3}, "mPas": {"Pa s": 1e3}}
ZERO_C_K = 273.15
# Ester oils bear some 200 C and stiffen towards -54 C; bearing steels lose their hardness beyond 300 C, tool steels later.
OIL_C, RING_C = (-60.0, 220.0), (-60.0, 300.0)


def unit_notes(
    bearing: Bearing, cage: Cage, oil: Lubricant, mounting: Mounting | None, cage_density: float
) -> tuple[str, ...]:
    """One sentence a suspicious value; ``cage_density`` [kg/m^3] tells a cage that fills half the rollers' height."""
    pitch, roller = bearing.pitch_diameter_mm, bearing.roller_diameter_mm
    width = bearing.roller_length_mm + cage.lands * cage.land_width_mm
    cage_g = 1e-6 * cage_density * math.pi * pitch * 0.5 * roller * width
    guide = None if cage.guidance == "roller" else cage.guide_clearance_mm
    # The least clearances are below any grade of manufacture, the largest some times the loosest class.
    usual = [
        ("bearing.radial_clearance_mm", max(bearing.radial_clearance_mm, 0.0) or None, (5e-4, 5e-3 * pitch)),
        ("cage.guide_clearance_mm", guide, (5e-4, 0.03 * pitch)),
        ("cage.pocket_clearance_mm", cage.pocket_clearance_mm, (5e-4, 0.25 * roller)),
        ("cage.mass_g", cage.mass_g, (cage_g / 20.0, cage_g * 20.0)),
        ("lubricant.roller_roughness_um", oil.roller_roughness_um, (3e-3, 5.0)),
        ("lubricant.race_roughness_um", oil.race_roughness_um, (3e-3, 5.0)),
        ("lubricant.viscosity_mPas", oil.viscosity_mPas, (0.3, 1e5)),
        ("lubricant.temperature_C", oil.temperature_C, OIL_C),
    ]
    warm = {} if mounting is None else mounting.model_dump()
    usual += [(f"mounting.{key}", value, RING_C) for key, value in warm.items() if key.endswith("_C")]
    notes = []
    for key, value, (low, high) in usual:
        if value is None or low <= value <= high:
            continue
        unit = key.rpartition("_")[2]
        meant = {other: factor * value for other, factor in FACTORS.get(unit, {}).items()}
        meant |= {"K": value - ZERO_C_K} if unit == "C" else {}
        likely = [
            f"if {value:g} {other} are meant, write {number:.4g}"
            for other, number in meant.items()
            if low <= number <= high
        ]
        what = f"{key} = {value:g}: outside the usual {low:.3g} to {high:.3g}"
        notes.append(f"{what}; {(likely or ['check its unit'])[0]}")
    return tuple(notes)
