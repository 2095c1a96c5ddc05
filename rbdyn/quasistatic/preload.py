"""Preload or clearance for least stress and for longest life, and what worn balls do to the clearance.

Stress and life ask for different things: the peak Hertz pressure belongs to one ball, a life to all of them and to how
often they pass. A coarse scan, each equilibrium started from its neighbour, finds where each is best; a search between its
neighbours refines it. Neither needs to have one optimum only, or one inside the range: what is found is the best of the scan,
refined, and a sentence says when it lies at an end.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError, validated
from rbdyn.life import turning_rings
from rbdyn.quasistatic.result import Rating, overloads, pressures, reference_capacities, solution_life
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.model import given_of, load_of, row_of
from rbdyn.scene.ball import BallRow, SingleRowScene

# Optima closer together than this share of the range, or that lose less than this of stress or life, count as one.
SAME_PLACE = 0.02
SAME_VALUE = 0.005

Capacities = Callable[[BallRow], tuple[float, float]]


class Case(NamedTuple):
    """One bearing under one load, ready to be solved."""

    rating: Rating
    load: Array
    given: Array


@dataclass(frozen=True)
class Point:
    """One equilibrium of a sweep, at a ``value`` of what is swept: largest Hertz pressure [Pa] and L10 [1e6 turns].

    Both are NaN where no equilibrium was found.
    """

    value: float
    solution: Solution
    rating: Rating
    peak_pressure: float = math.nan
    million_turns: float = math.nan


@dataclass(frozen=True)
class Sweep:
    """A scan over preload or clearance and its two optima; ``notes`` say where they differ or lie at an end."""

    points: tuple[Point, ...]
    least_stress: Point
    longest_life: Point
    notes: tuple[str, ...]


def solved(value: float, case: Case, start: Solution | None = None) -> Point:
    """Equilibrium, stress and life of a case; ``start``: a solution nearby."""
    solution = solve(case.rating.model.row, case.rating.model.control, case.load, case.given, start)
    if not solution.found and start is not None:
        solution = solve(case.rating.model.row, case.rating.model.control, case.load, case.given)
    table = solution.figures[np.newaxis]
    if solution.found and (why := overloads(table, [case.rating])):
        solution = solution._replace(status=why[0])
    if not solution.found:
        return Point(value, solution, case.rating)
    peak = np.max(list(pressures(table, [case.rating]).values()))
    life = solution_life(solution, case.rating.capacities, turning_rings(*case.rating.speeds))
    return Point(value, solution, case.rating, float(peak), life.million_turns)


def sweep(case_at: Callable[[float], Case], values: Sequence[float], name: str, unit: str, scale: float = 1.0) -> Sweep:
    """Scan ``values``, at least three and rising, and refine both optima.

    ``case_at`` makes the case of a value; ``name``, ``unit`` and ``scale`` (units to one of SI) are for the notes.
    Raises MethodError for other values, or when fewer than three of them have an equilibrium.
    """
    if len(values) < 3 or not np.all(np.diff(values) > 0.0):
        given = ", ".join(f"{scale * value:.6g}" for value in values[:6]) + (", ..." if len(values) > 6 else "")
        raise MethodError(f"give at least three rising values to scan, not {given} {unit}")
    points: list[Point] = []
    start: Solution | None = None
    for value in values:
        points.append(solved(value, case_at(value), start))
        start = points[-1].solution if points[-1].solution.found else None
    balanced = [point for point in points if point.solution.found]
    if len(balanced) < 3:
        what = f"{name}: only {len(balanced)} of {len(points)} scanned values have an equilibrium"
        raise MethodError(f"{what}; scan a range that has one")

    def refined(worth: Callable[[Point], float]) -> Point:
        best = min(range(len(balanced)), key=lambda i: worth(balanced[i]))
        low, high = balanced[max(best - 1, 0)].value, balanced[min(best + 1, len(balanced) - 1)].value

        def point_at(value: float) -> Point:
            return solved(value, case_at(value), balanced[best].solution)

        def cost(value: float) -> float:
            point = point_at(value)
            return worth(point) if point.solution.found else math.inf

        # Brent's search in an interval, which needs no derivative.
        place = minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": 1e-4 * (high - low)}).x
        trial = point_at(float(place))
        return trial if trial.solution.found and worth(trial) < worth(balanced[best]) else balanced[best]

    least = refined(lambda point: point.peak_pressure)
    longest = refined(lambda point: -point.million_turns)
    notes = _notes(balanced, least, longest, name, unit, scale)
    return Sweep(tuple(points), least, longest, notes)


def _notes(
    points: Sequence[Point], least: Point, longest: Point, name: str, unit: str, scale: float
) -> tuple[str, ...]:
    notes = []
    span = points[-1].value - points[0].value
    for goal, point in (("least peak stress", least), ("longest life", longest)):
        for end, word in ((points[0].value, "lower"), (points[-1].value, "upper")):
            if abs(point.value - end) <= 1e-3 * span:
                what = f"the {goal} lies at the {word} end of the range, {name} {scale * end:.4g} {unit}"
                notes.append(f"{what}: it has no optimum inside; widen the range or take what the end gives")
    loss = 1.0 - least.million_turns / longest.million_turns
    rise = longest.peak_pressure / least.peak_pressure - 1.0
    apart = abs(least.value - longest.value) > SAME_PLACE * span
    if apart and (loss > SAME_VALUE or rise > SAME_VALUE):
        what = "least peak stress and longest life differ"
        why = f"{name} {scale * least.value:.4g} {unit} for stress costs {100.0 * loss:.3g} % of the life"
        notes.append(f"{what}: {why}, {scale * longest.value:.4g} {unit} for life {100.0 * rise:.3g} % more stress")
    return tuple(notes)


def over_preload(
    scene: SingleRowScene, preloads: Sequence[float], capacities: Capacities = reference_capacities
) -> Sweep:
    """Sweep of ``operation.preload_N`` [N], which replaces the scene's own; the rest of its load stays.

    ``capacities``: how races are rated, ``fatigue.reference_capacities`` or another. Raises MethodError as ``sweep``, or where the
    scene prescribes the axial displacement, which no force can change; InputError for a preload that no scene may have.
    """
    at = _case(scene, capacities)
    if not math.isnan(at.given[2]):
        what = "operation.prescribed.z_mm or preload_um: the axial displacement is prescribed"
        raise MethodError(f"{what}, so a preload by force has no effect; leave it out")

    def case_at(preload: float) -> Case:
        return at._replace(load=load_of(scene.changed({"operation.preload_N": preload})))

    return sweep(case_at, preloads, "a preload of", "N")


def over_clearance(
    scene: SingleRowScene, clearances: Sequence[float], capacities: Capacities = reference_capacities
) -> Sweep:
    """Sweep of the diametral clearance [m] with everything else as in the scene.

    Raises MethodError as ``sweep``, or where the scene gives the contact angle, which rules the clearance.
    """
    angle = scene.bearing.contact_angle_deg
    if angle is not None:
        what = f"bearing.contact_angle_deg = {angle:g} rules the clearance, {1e6 * clearance_of(scene.bearing):.4g} um"
        why = "give bearing.radial_clearance_mm in its place"
        raise MethodError(f"{what}: {why}, or --sweep bearing.clearance_change_um")

    def case_at(clearance: float) -> Case:
        return _case(_redrawn(scene, radial_clearance_mm=1e3 * clearance), capacities)

    return sweep(case_at, clearances, "a clearance of", "um", 1e6)


def over_wear(scene: SingleRowScene, wears: Sequence[float], capacities: Capacities = reference_capacities) -> Sweep:
    """Sweep of the diameter that every ball has lost [m]; raises MethodError as ``sweep`` and ``worn``."""
    return sweep(lambda wear: _case(worn(scene, wear), capacities), wears, "a wear of", "um", 1e6)


def _case(scene: SingleRowScene, capacities: Capacities) -> Case:
    rating = Rating(scene.bearing, row_of(scene), capacities(scene.bearing), scene.operation.speeds)
    return Case(rating, load_of(scene), given_of(scene))


def clearance_of(drawing: BallRow) -> float:
    """Diametral clearance of a row [m], given or from its contact angle: 2 B (1 - cos alpha_0)."""
    if drawing.radial_clearance is not None:
        return drawing.radial_clearance
    return 2.0 * drawing.groove_centre_distance * (1.0 - math.cos(drawing.contact_angle))


def worn(scene: SingleRowScene, wear: float) -> SingleRowScene:
    """The scene with balls that have lost ``wear`` of their diameter [m], evenly; the grooves keep their radii.

    The diametral clearance grows by twice the wear, the groove factors as 1/D, and with both the contact angle.
    Raises MethodError for a wear that is negative or leaves no ball.
    """
    drawing = scene.bearing
    diameter = drawing.ball_diameter_mm - 1e3 * wear
    if not wear >= 0.0 or not diameter > 0.0:
        raise MethodError(f"wear {wear:g} m must lie between 0 and the ball's diameter")
    grown = drawing.ball_diameter_mm / diameter
    return _redrawn(
        scene,
        ball_diameter_mm=diameter,
        inner_groove_factor=drawing.inner_groove_factor * grown,
        outer_groove_factor=drawing.outer_groove_factor * grown,
        radial_clearance_mm=1e3 * (clearance_of(drawing) + 2.0 * wear),
    )


def _redrawn(scene: SingleRowScene, **changes: float) -> SingleRowScene:
    bearing = {**scene.bearing.model_dump(), "contact_angle_deg": None, **changes}
    return validated(type(scene), {**scene.model_dump(), "bearing": bearing}, "scene")
