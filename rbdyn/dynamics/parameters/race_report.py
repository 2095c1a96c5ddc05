"""What a designer asks of each race: pressure, half-width and film at its largest load, and whether they are sound."""

import math
from collections.abc import Mapping

import numpy as np

from rbdyn.contact.film_thickness import half_width, hertz_pressure
from rbdyn.contact.static_limit import ROLLERS, dent_sentence
from rbdyn.dynamics.parameters.model import race_contact_law
from rbdyn.dynamics.parameters.race_traction import film_report, rolling_contacts
from rbdyn.scene import Scene

# Film over roughness below which asperities bear part of the load.
FULL_FILM = 1.0
SMALLEST_LOAD = 1e-3  # [N]: below this a race counts as unloaded


def race_report(scene: Scene, inner_load: float, outer_load: float) -> dict[str, dict[str, float]]:
    """For "inner" and "outer", at the largest loads [N]: max_pressure_MPa, half_width_um, central_film_um,
    minimum_film_um, lambda_ratio. A race that was never loaded is left out, so are films where nothing rolls.

    With a profile or a tilt the pressure is that of the most loaded slice, with the roller where the tilt is largest.
    """
    loads = max(inner_load, SMALLEST_LOAD), max(outer_load, SMALLEST_LOAD)
    films = film_report(scene, scene.lubricant.in_service, *loads)
    count = scene.slices
    contacts = rolling_contacts(scene)
    report = {}
    for name, load in (("inner", inner_load), ("outer", outer_load)):
        if load < SMALLEST_LOAD:
            continue
        whole = contacts[name]
        most = load if count == 1 else _most_loaded_slice(scene, name, load)
        contact = whole._replace(length=whole.length / count)
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


def race_notes(scene: Scene, races: Mapping[str, Mapping[str, float]]) -> tuple[str, ...]:
    """Where ``races`` of a report lie beyond their laws: dents, and films too thin for the friction of a full one."""
    pressures = {name: 1e6 * race["max_pressure_MPa"] for name, race in races.items()}
    notes = [dent_sentence(most, ROLLERS, name) for name, most in pressures.items() if most > ROLLERS]
    law, films = scene.traction, {name: race["lambda_ratio"] for name, race in races.items() if "lambda_ratio" in race}
    thinnest = min(films, key=films.__getitem__, default=None)
    if thinnest and films[thinnest] < FULL_FILM and law.friction == "film" and law.model not in ("coulomb", "off"):
        what = f"film: lambda is {films[thinnest]:.2g} on the {thinnest} race, below {FULL_FILM:g}"
        why = "so asperities touch while the friction is that of a full film; set traction.friction = 'mixed'"
        notes.append(f"{what}, {why}, or check lubricant.temperature_C and the roughnesses")
    return tuple(notes)


def _most_loaded_slice(scene: Scene, race: str, load: float) -> float:
    """Load [N] of the slice that bears most of ``load`` [N] on a race, where the tilt is largest."""
    from rbdyn.dynamics.forces.observe import slice_loads

    direction = scene.bearing.tilt_direction
    nx, ny = np.array([math.cos(direction)]), np.array([math.sin(direction)])
    law = race_contact_law(scene, race)
    return float(slice_loads(law, scene.slices, scene.geometry.roller_radius, np.array([load]), nx, ny).max())
