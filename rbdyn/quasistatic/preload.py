"""Preload or clearance for least stress and for longest life, and the clearance of a bearing with worn balls.

Stress and life have different optima: the peak Hertz pressure depends on one ball, the life on all balls and on how often
they pass. A coarse scan starts each equilibrium from its neighbour and finds the best point of each. A search between the
neighbours of this point refines it. There may be several optima, or none inside the range: the result is the refined best
point of the scan, and a note states an optimum at an end of the range.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError, validated
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record
from rbdyn.life import turning_rings
from rbdyn.quasistatic.result import Rating, overload, pressures, reference_capacities, solution_life
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of
from rbdyn.scene.ball import BallRow, SingleRowScene

# Optima closer than this share of the range count as one, and so do optima that differ less than this in stress and life.
SAME_PLACE = 0.02
SAME_VALUE = 0.005

Capacities = Callable[[BallRow], tuple[float, float]]


class Case(NamedTuple):
    """Input of one solve: the bearing with its rating, load and constraint."""

    rating: Rating
    load: Array
    constraint: Array


class Point(Record):
    """One equilibrium of a scan, at one ``value`` of the variable: largest Hertz pressure [Pa] and L10 [1e6 turns].

    Both are NaN without an equilibrium.
    """

    value: float
    solution: Solution
    rating: Rating
    peak_pressure: float = math.nan
    million_turns: float = math.nan


class Scan(Record):
    """A scan over preload or clearance and its two optima; ``notes`` state where they differ or are at an end."""

    points: tuple[Point, ...]
    least_stress: Point
    longest_life: Point
    notes: Notes


def point_of(value: float, case: Case, start: Solution | None = None) -> Point:
    """Equilibrium, stress and life of a case; ``start``: a solution nearby."""
    solution = solve(case.rating.model.row, case.rating.model.control, case.load, case.constraint, start)
    if not solution.is_equilibrium and start is not None:
        solution = solve(case.rating.model.row, case.rating.model.control, case.load, case.constraint)
    if solution.is_equilibrium and (why := overload(solution, case.rating)):
        solution = solution._replace(status=why)
    if not solution.is_equilibrium:
        return Point(value, solution, case.rating)
    peak = max(pressures(solution, case.rating).values())
    life = solution_life(solution, case.rating.capacities, turning_rings(*case.rating.speeds))
    return Point(value, solution, case.rating, peak, life.million_turns)


def scan(case_at: Callable[[float], Case], values: Sequence[float], name: str, unit: str, scale: float = 1.0) -> Scan:
    """Scan ``values``, at least three and rising, and refine both optima.

    ``case_at`` makes the case of a value; ``name``, ``unit`` and ``scale`` (units to one of SI) are for the notes.
    Raises MethodError for other values, or when fewer than three of them have an equilibrium.
    """
    if len(values) < 3 or not np.all(np.diff(values) > 0.0):
        listing = ", ".join(f"{scale * value:.6g}" for value in values[:6]) + (", ..." if len(values) > 6 else "")
        raise MethodError(
            f"{name} {listing} {unit}: a scan needs at least three rising values; add values or sort them"
        )
    points: list[Point] = []
    start: Solution | None = None
    for value in values:
        points.append(point_of(value, case_at(value), start))
        start = points[-1].solution if points[-1].solution.is_equilibrium else None
    balanced = [point for point in points if point.solution.is_equilibrium]
    if len(balanced) < 3:
        raise MethodError(
            f"{name}: only {len(balanced)} of {len(points)} scanned values have an equilibrium; scan a range with more"
        )

    def refined(worth: Callable[[Point], float]) -> Point:
        best = min(range(len(balanced)), key=lambda i: worth(balanced[i]))
        low, high = balanced[max(best - 1, 0)].value, balanced[min(best + 1, len(balanced) - 1)].value

        def point_at(value: float) -> Point:
            return point_of(value, case_at(value), balanced[best].solution)

        def cost(value: float) -> float:
            point = point_at(value)
            return worth(point) if point.solution.is_equilibrium else math.inf

        # Brent's search in an interval, which needs no derivative.
        place = minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": 1e-4 * (high - low)}).x
        trial = point_at(float(place))
        return trial if trial.solution.is_equilibrium and worth(trial) < worth(balanced[best]) else balanced[best]

    least = refined(lambda point: point.peak_pressure)
    longest = refined(lambda point: -point.million_turns)
    return Scan(tuple(points), least, longest, tuple(_notes(balanced, least, longest, name, unit, scale)))


def _notes(points: Sequence[Point], least: Point, longest: Point, name: str, unit: str, scale: float) -> Iterator[Note]:
    span = points[-1].value - points[0].value
    for goal, point in (("least peak stress", least), ("longest life", longest)):
        for end, word in ((points[0].value, "lower"), (points[-1].value, "upper")):
            if abs(point.value - end) <= 1e-3 * span:
                sentence = (
                    f"{goal}: it is at the {word} end of the range, {name} {scale * end:.4g} {unit}, without an optimum "
                    "inside; widen the range or accept the end"
                )
                yield Note("optimum", sentence)
    loss = 1.0 - least.million_turns / longest.million_turns
    rise = longest.peak_pressure / least.peak_pressure - 1.0
    apart = abs(least.value - longest.value) > SAME_PLACE * span
    if apart and (loss > SAME_VALUE or rise > SAME_VALUE):
        sentence = (
            f"the optima differ: {name} {scale * least.value:.4g} {unit} for least stress costs {100.0 * loss:.3g} % of the "
            f"life, {scale * longest.value:.4g} {unit} for longest life {100.0 * rise:.3g} % more stress"
        )
        yield Note("optimum", sentence)


def over_preload(
    scene: SingleRowScene, preloads: Sequence[float], capacities: Capacities = reference_capacities
) -> Scan:
    """Scan of ``operation.preload_N`` [N] in place of the scene's preload, under the rest of its load.

    ``capacities``: rating of the races, such as ``result.reference_capacities``. Raises MethodError as ``scan``, and where the
    scene prescribes the axial displacement, which no force can change; InputError for an invalid preload.
    """
    case = _case(scene, capacities)
    if not math.isnan(case.constraint[2]):
        raise MethodError(
            "operation.prescribed.z_mm or preload_um: the axial displacement is prescribed, so a preload by force has no "
            "effect; remove it"
        )

    def case_at(preload: float) -> Case:
        return case._replace(load=load_of(scene.changed({"operation.preload_N": preload})))

    return scan(case_at, preloads, "a preload of", "N")


def over_clearance(
    scene: SingleRowScene, clearances: Sequence[float], capacities: Capacities = reference_capacities
) -> Scan:
    """Scan of the diametral clearance [m] with all else as in the scene.

    Raises MethodError as ``scan``, and where the scene states the contact angle, which sets the clearance.
    """
    angle = scene.bearing.contact_angle_deg
    if angle is not None:
        raise MethodError(
            f"bearing.contact_angle_deg = {angle:g} rules the clearance, {1e6 * clearance_of(scene.bearing):.4g} um: give "
            "bearing.radial_clearance_mm in its place, or --sweep bearing.clearance_change_um"
        )

    def case_at(clearance: float) -> Case:
        return _case(_scene_with(scene, radial_clearance_mm=1e3 * clearance), capacities)

    return scan(case_at, clearances, "a clearance of", "um", 1e6)


def over_wear(scene: SingleRowScene, wears: Sequence[float], capacities: Capacities = reference_capacities) -> Scan:
    """Scan of the wear of every ball, the loss of its diameter [m]; raises MethodError as ``scan`` and ``wear_scene``."""
    return scan(lambda wear: _case(wear_scene(scene, wear), capacities), wears, "a wear of", "um", 1e6)


def _case(scene: SingleRowScene, capacities: Capacities) -> Case:
    rating = Rating(scene.bearing, row_of(scene), capacities(scene.bearing), scene.operation.speeds)
    return Case(rating, load_of(scene), constraint_of(scene))


def clearance_of(drawing: BallRow) -> float:
    """Diametral clearance of a row [m], stated or from its contact angle, 2 B (1 - cos alpha_0)."""
    if drawing.radial_clearance is not None:
        return drawing.radial_clearance
    return 2.0 * drawing.groove_centre_distance * (1.0 - math.cos(drawing.contact_angle))


def wear_scene(scene: SingleRowScene, wear: float) -> SingleRowScene:
    """The scene with balls that lost ``wear`` of their diameter [m] evenly; the grooves keep their radii.

    The diametral clearance grows by twice the wear and the groove factors as 1/D; both raise the contact angle.
    Raises MethodError for a negative wear, or one as large as the ball.
    """
    drawing = scene.bearing
    diameter = drawing.ball_diameter_mm - 1e3 * wear
    if not wear >= 0.0 or not diameter > 0.0:
        raise MethodError(f"wear {wear:g} m must lie between 0 and the ball's diameter")
    grown = drawing.ball_diameter_mm / diameter
    return _scene_with(
        scene,
        ball_diameter_mm=diameter,
        inner_groove_factor=drawing.inner_groove_factor * grown,
        outer_groove_factor=drawing.outer_groove_factor * grown,
        radial_clearance_mm=1e3 * (clearance_of(drawing) + 2.0 * wear),
    )


def _scene_with(scene: SingleRowScene, **changes: float) -> SingleRowScene:
    bearing = {**scene.bearing.model_dump(), "contact_angle_deg": None, **changes}
    return validated(type(scene), {**scene.model_dump(), "bearing": bearing}, "scene")
