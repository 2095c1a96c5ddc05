"""What is reported of one row in equilibrium: angles, loads, stress, contacts, film, life."""

import math
from typing import Any

import numpy as np

from rbdyn.contact import point_film
from rbdyn.contact.film_thickness import lambda_ratio
from rbdyn.contact.hertz_point import PointContact, peak_pressure
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.quasistatic.fatigue import solution_life, turning_rings
from rbdyn.quasistatic.remarks import Rating, needed_friction
from rbdyn.quasistatic.result import RowReport, ball_records, displacement_record, stiffness_record
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.scene.ball import BallScene


def row_report(rating: Rating, solution: Solution, film: dict[str, Any], reaction: dict[str, Any] | None) -> RowReport:
    """Report of one row; ``film``: as ``film_record`` gives it."""
    contacts = {"inner": rating.model.inner_contact, "outer": rating.model.outer_contact}
    loads = {"inner": solution.inner_load, "outer": solution.outer_load}
    return RowReport(
        **displacement_record(solution.displacement),
        balls=ball_records(solution.figures),
        max_stress_MPa={race: 1e-6 * float(np.max(peak_pressure(contacts[race], loads[race]))) for race in contacts},
        contacts={
            race: {**contact_record(contacts[race], float(loads[race].max())), **film.get(race, {})}
            for race in contacts
        },
        stiffness=stiffness_record(solution.stiffness),
        life=life_record(rating, solution),
        needed_friction=float(needed_friction(solution.figures[np.newaxis], [rating])[0]),
        residual_N=solution.residual,
        iterations=solution.steps,
        searches=solution.searches,
        reaction=reaction,
    )


def contact_record(contact: PointContact, load: float) -> dict[str, float]:
    """Ellipse of a contact under a load [N]."""
    grown = load ** (1.0 / 3.0)
    semi_major, semi_minor = 1e3 * contact.semi_major * grown, 1e3 * contact.semi_minor * grown
    return {
        "load_N": load,
        "semi_major_mm": semi_major,
        "semi_minor_mm": semi_minor,
        "area_mm2": math.pi * semi_major * semi_minor,
    }


def film_record(scene: BallScene, rating: Rating, solution: Solution, rings: tuple[str, str]) -> dict[str, Any]:
    """Film of each race at its largest load, the thermal factor included, between ``rings``, the names of the inner and outer one.

    Empty where the scene tells no oil, and where nothing turns or bears.
    """
    if scene.lubricant is None:
        return {}
    lubricant, drawing, model = scene.lubricant, rating.drawing, rating.model
    ball, inner, outer = (scene.material(part) for part in ("ball", *rings))
    gamma = drawing.gamma
    entrainment = point_film.entrainment_speed(drawing.pitch_diameter, gamma, *rating.speeds)
    oil, found = lubricant.in_service, {}
    for race, contact, ring, side, loads in (
        ("inner", model.inner_contact, inner, gamma, solution.inner_load),
        ("outer", model.outer_contact, outer, -gamma, solution.outer_load),
    ):
        load = float(loads.max())
        if entrainment == 0.0 or load == 0.0:
            continue
        rolling = point_film.RollingBall(
            contact, point_film.rolling_radius(drawing.ball_diameter, side), equivalent_modulus(ball, ring), entrainment
        )
        heat = float(point_film.thermal_factor(rolling, oil, load))
        central = float(point_film.central_film(rolling, oil, load)) * heat
        roughness = lubricant.roller_roughness, lubricant.race_roughness
        found[race] = {
            "central_film_um": 1e6 * central,
            "minimum_film_um": 1e6 * float(point_film.minimum_film(rolling, oil, load)) * heat,
            "lambda_ratio": float(lambda_ratio(central, *roughness)),
            "film_stiffness_N_per_um": 1e-6 * float(point_film.film_stiffness(rolling, oil, load)),
        }
    return found


def life_record(rating: Rating, solution: Solution) -> dict[str, Any]:
    """Reference life by ISO/TS 16281; None where nothing is loaded, in hours also where nothing turns."""
    life = solution_life(solution, rating.capacities, turning_rings(*rating.speeds))
    return {**life.as_record(*rating.speeds), "method": "ISO/TS 16281"}
