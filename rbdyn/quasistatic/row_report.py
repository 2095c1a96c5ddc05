"""What is told of one row in equilibrium: angles, loads, stress, contacts, film, life, and what to beware of."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact import point_film
from rbdyn.contact.film_thickness import lambda_ratio
from rbdyn.contact.hertz_point import PointContact, peak_pressure
from rbdyn.materials import Material, equivalent_modulus
from rbdyn.quasistatic.control import Control, FixedShare, FrictionShare
from rbdyn.quasistatic.equilibrium import Solution
from rbdyn.quasistatic.fatigue import reference_capacities, solution_life, turning_rings
from rbdyn.quasistatic.model import RowModel
from rbdyn.quasistatic.result import ball_records, displacement_record, stiffness_record
from rbdyn.scene.ball import BallRow
from rbdyn.scene.lubricant import Lubricant

# ISO 76: pressure that leaves a permanent dent of 1e-4 of a ball's diameter.
STATIC_LIMIT_PA = 4200e6
# A contact at a steeper angle lies beyond any shoulder [rad].
STEEPEST = math.radians(80.0)
# Beyond, oiled contacts slip about the axis of the gyroscopic moment.
OILED_FRICTION = 0.07


def row_record(
    drawing: BallRow,
    model: RowModel,
    solution: Solution,
    speeds: tuple[float, float],
    film: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """One row in JSON form; ``speeds``: of its inner and outer ring [rad/s]; ``film``: as ``film_record`` gives it."""
    contacts = {"inner": model.inner_contact, "outer": model.outer_contact}
    loads = {"inner": solution.inner_load, "outer": solution.outer_load}
    searches = {} if solution.searches is None else {"searches": solution.searches}
    return {
        **displacement_record(solution.displacement),
        "balls": ball_records(solution),
        "max_stress_MPa": {race: 1e-6 * float(np.max(peak_pressure(contacts[race], loads[race]))) for race in contacts},
        "contacts": {
            race: {**contact_record(contacts[race], float(loads[race].max())), **(film or {}).get(race, {})}
            for race in contacts
        },
        "stiffness": stiffness_record(solution.stiffness),
        "life": life_record(drawing, solution, speeds),
        "needed_friction": needed_friction(model.control, solution),
        "residual_N": solution.residual,
        "iterations": solution.steps,
        **searches,
    }


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


def film_record(
    drawing: BallRow,
    model: RowModel,
    solution: Solution,
    speeds: tuple[float, float],
    materials: tuple[Material, Material, Material],
    lubricant: Lubricant,
) -> dict[str, dict[str, float]]:
    """Film of each race at its largest load, the thermal factor included; empty where nothing turns or bears.

    ``materials``: of balls, inner and outer ring.
    """
    ball, inner, outer = materials
    gamma = drawing.ball_diameter_mm * math.cos(drawing.contact_angle) / drawing.pitch_diameter_mm
    entrainment = point_film.entrainment_speed(1e-3 * drawing.pitch_diameter_mm, gamma, *speeds)
    oil, found = lubricant.in_service, {}
    for race, contact, ring, side, loads in (
        ("inner", model.inner_contact, inner, gamma, solution.inner_load),
        ("outer", model.outer_contact, outer, -gamma, solution.outer_load),
    ):
        load = float(loads.max())
        if entrainment == 0.0 or load == 0.0:
            continue
        rolling = point_film.RollingBall(
            contact,
            point_film.rolling_radius(1e-3 * drawing.ball_diameter_mm, side),
            equivalent_modulus(ball, ring),
            entrainment,
        )
        heat = float(point_film.thermal_factor(rolling, oil, load))
        central = float(point_film.central_film(rolling, oil, load)) * heat
        roughness = 1e-6 * lubricant.roller_roughness_um, 1e-6 * lubricant.race_roughness_um
        found[race] = {
            "central_film_um": 1e6 * central,
            "minimum_film_um": 1e6 * float(point_film.minimum_film(rolling, oil, load)) * heat,
            "lambda_ratio": float(lambda_ratio(central, *roughness)),
            "film_stiffness_N_per_um": 1e-6 * float(point_film.film_stiffness(rolling, oil, load)),
        }
    return found


def life_record(drawing: BallRow, solution: Solution, speeds: tuple[float, float]) -> dict[str, Any]:
    """Reference life by ISO/TS 16281; None where nothing is loaded, in hours also where nothing turns."""
    life = solution_life(solution, reference_capacities(drawing), turning_rings(*speeds))
    hours = life.hours(*speeds)
    return {
        "L10_Mrev": life.million_turns if math.isfinite(life.million_turns) else None,
        "L10_h": hours if math.isfinite(hours) else None,
        "method": "ISO/TS 16281",
    }


def needed_friction(control: Control, solution: Solution) -> float:
    """Largest friction coefficient that a contact needs to hold its part of the gyroscopic moment, 2 s M_g/(D Q)."""
    if not isinstance(control, FixedShare | FrictionShare):
        return 0.0
    touching = (solution.inner_load > 0.0) & (solution.outer_load > 0.0)
    if not touching.any():
        return 0.0
    inner, outer = solution.inner_load[touching], solution.outer_load[touching]
    if isinstance(control, FixedShare):
        share = np.full(inner.size, control.inner)
    else:
        depths = solution.depths[touching]
        weight = control.inner_weight * (depths[:, 0] / depths[:, 1]) ** 2
        share = weight / (1.0 + weight)
    pull = 2.0 * np.abs(solution.gyroscopic_moment[touching]) / control.spinning.ball_diameter
    return float(np.max(np.maximum(share * pull / inner, (1.0 - share) * pull / outer)))


def notes(drawing: BallRow, model: RowModel, solution: Solution, name: str = "") -> list[str]:
    """Sentences on what is unusual; ``name`` of the row, where there are two."""
    row = f"{name} row: " if name else ""
    told = []
    clear = int(np.sum(solution.inner_load == 0.0))
    if clear == drawing.balls:
        told.append(
            f"{row}no ball touches the inner race, so nothing tells where the ring is; load it or take away clearance"
        )
    elif clear:
        told.append(f"{row}{clear} of {drawing.balls} balls are clear of the inner race")
    for race, contact, loads in (
        ("inner", model.inner_contact, solution.inner_load),
        ("outer", model.outer_contact, solution.outer_load),
    ):
        pressure = float(np.max(peak_pressure(contact, loads)))
        if pressure > STATIC_LIMIT_PA:
            told.append(
                f"{row}{1e-6 * pressure:.0f} MPa on the {race} race are more than the {1e-6 * STATIC_LIMIT_PA:.0f} MPa of ISO 76: the "
                "race dents; lessen the load or take more or larger balls"
            )
    touching = solution.inner_load > 0.0
    angles = solution.inner_angle[touching]
    if angles.size and float(np.abs(angles).max()) > STEEPEST:
        told.append(
            f"{row}inner angles reach {math.degrees(float(np.abs(angles).max())):.0f} deg, beyond any shoulder: rotation throws the inner "
            "ring off its balls; preload it axially or slow down"
        )
    elif drawing.contact_angle > 0.0 and angles.size and float(angles.min()) < 0.0:
        told.append(
            f"{row}{int(np.sum(angles < 0.0))} balls bear at negative angles, where an angular contact bearing has no shoulder; turn "
            "the thrust round, or pair the bearing"
        )
    needed = needed_friction(model.control, solution)
    if needed > OILED_FRICTION:
        told.append(
            f"{row}the gyroscopic moment needs a friction coefficient of {needed:.2f}, more than oil gives: the balls slip about "
            "that axis; raise the load or lower the speed"
        )
    return told


def beyond_hertz(drawing: BallRow, model: RowModel, solution: Solution) -> str | None:
    """Why the loads are none that contacts could carry, or None."""
    return overload(drawing, model.inner_contact, model.outer_contact, solution.inner_load, solution.outer_load)


def overload(
    drawing: BallRow,
    inner_contact: PointContact,
    outer_contact: PointContact,
    inner_load: NDArray[np.float64],
    outer_load: NDArray[np.float64],
) -> str | None:
    """Why loads (Z,) [N] are none that contacts could carry, or None: an ellipse as long as its groove is deep."""
    for race, contact, loads, factor in (
        ("inner", inner_contact, inner_load, drawing.inner_groove_factor),
        ("outer", outer_contact, outer_load, drawing.outer_groove_factor),
    ):
        worst = int(np.argmax(loads))
        semi_major = 1e3 * contact.semi_major * float(loads[worst]) ** (1.0 / 3.0)
        groove = factor * drawing.ball_diameter_mm
        if semi_major > groove:
            return (
                f"overloaded: the ball at {360.0 * worst / drawing.balls:.0f} deg would bear {loads[worst]:.4g} N on the {race} race, over "
                f"{2.0 * semi_major:.3g} mm across a groove of {groove:.3g} mm radius, which no contact can; lessen the load"
            )
    return None
