"""What a designer asks of each race: pressure, half-width and film at its largest load."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rbdyn.contact.film_thickness import RollingContact, half_width, hertz_pressure
from rbdyn.dynamics.equations import RollerBearing
from rbdyn.dynamics.geometry import kinematics, reduced_radii
from rbdyn.dynamics.model import lubricant
from rbdyn.dynamics.race_traction import film_report
from rbdyn.dynamics.slice_loads import slice_loads
from rbdyn.materials import equivalent_modulus
from rbdyn.scene import Scene

SMALLEST_LOAD = 1e-3  # [N]: below this a race counts as unloaded


def race_report(
    scene: Scene, bearing: RollerBearing, inner_load: float, outer_load: float
) -> dict[str, dict[str, float]]:
    """For "inner" and "outer", at the largest loads [N]: max_pressure_MPa, half_width_um, central_film_um,
    minimum_film_um, lambda_ratio. A race that was never loaded is left out, so are films where nothing rolls.

    With a profile or a tilt the pressure is that of the most loaded slice, with the roller where the tilt is largest.
    """
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    length, speed = scene.bearing.effective_length_mm * 1e-3, abs(kinematics(scene).entrainment)
    films = film_report(
        scene, lubricant(scene), max(inner_load, SMALLEST_LOAD), max(outer_load, SMALLEST_LOAD)
    )
    direction = math.radians(scene.bearing.tilt_direction_deg)
    nx, ny = np.array([math.cos(direction)]), np.array([math.sin(direction)])
    outer_radius, inner_radius = reduced_radii(scene)
    races: tuple[tuple[str, Any, float, float], ...] = (
        ("inner", bearing.inner, inner_radius, inner_load),
        ("outer", bearing.outer, outer_radius, outer_load),
    )
    report = {}
    for name, race, radius, load in races:
        if load < SMALLEST_LOAD:
            continue
        count = scene.slices
        roller = 0.5e-3 * scene.bearing.roller_diameter_mm
        most = float(slice_loads(race.contact, count, roller, np.array([load]), nx, ny).max())
        contact = RollingContact(radius, length / count, modulus, speed)
        report[name] = {
            "max_pressure_MPa": float(hertz_pressure(contact, most)) * 1e-6,
            "half_width_um": float(half_width(contact, most)) * 1e6,
        }
        if name in films:
            report[name] |= {
                "central_film_um": films[name]["central_film_m"] * 1e6,
                "minimum_film_um": films[name]["minimum_film_m"] * 1e6,
                "lambda_ratio": films[name]["lambda_ratio"],
            }
    return report
