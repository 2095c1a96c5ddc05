"""Equilibrium of the bearing of a scene: what ``rbdyn.equilibrium`` and ``rbdyn ball`` call."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from rbdyn.mounting.ball_rings import growth_record, row_change
from rbdyn.quasistatic.double_decker.equilibrium import solve_double_decker
from rbdyn.quasistatic.double_decker.model import double_decker_of, load_record, middle_record
from rbdyn.quasistatic.fatigue import reference_capacities
from rbdyn.quasistatic.remarks import Rating, overloads, remarks, sentences, tipping
from rbdyn.quasistatic.result import FORMAT, BallResult, ball_records, displacement_record, stiffness_record
from rbdyn.quasistatic.roots import other_roots
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.quasistatic.row.model import RowModel, given_of, load_of, row_of
from rbdyn.quasistatic.row_report import film_record, row_record
from rbdyn.quasistatic.solvers import SOLVERS
from rbdyn.result import versions
from rbdyn.scene import BallScene, Scene, balls_only
from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene

# Raceway controls under which there may be more than one equilibrium.
SEVERAL_ROOTS = ("inner", "half")


def equilibrium(scene: BallScene | Scene, start: BallResult | None = None) -> BallResult:
    """Equilibrium of a ball bearing under its load: angles, loads, stiffness, stress and life.

    ``start``: a result nearby, which saves time. The result's ``status`` tells where there is none; nothing is raised for it.
    Raises InputError for a scene of rollers.
    """
    scene = balls_only(scene)
    if isinstance(scene, DoubleDeckerScene):
        return _double_decker(scene, start)
    assert isinstance(scene, SingleRowScene)
    model = row_of(scene)
    warm = start.rows[0] if start is not None and start.rows else None
    began = time.perf_counter()
    solution = SOLVERS[scene.model.solver](model.row, model.control, load_of(scene), given_of(scene), warm)
    took = time.perf_counter() - began
    head, tail = _frame(scene, solution.status, took)
    if not solution.found:
        return BallResult({**head, **tail})
    rating, table = row_rating(scene, model), solution.told[np.newaxis]
    if why := overloads(table, [rating]):
        return BallResult({**head, "status": why[0], **tail})
    record = row_record(rating, solution, film_record(scene, rating, solution, ("inner_ring", "outer_ring")))
    record["reaction"] = load_record(solution.reaction)
    grown = growth_record(scene, {"inner_less_outer_race": row_change(scene)})
    notes = sentences([*remarks(table, [rating]), tipping(solution.displacement[np.newaxis, 3:], scene)])
    others = _other_roots(scene, model, solution)
    if others:
        notes.append(
            f"{len(others)} more equilibri{'um' if len(others) == 1 else 'a'} of the same load under this raceway control, see "
            "other_roots; this one is reached from one common cage speed"
        )
    roots = {"other_roots": others} if others is not None else {}
    return BallResult({**head, **record, **grown, **roots, "notes": notes, **tail}, (solution,), (rating,))


def row_rating(scene: SingleRowScene, model: RowModel) -> Rating:
    """What pressure, life and remarks need of a single row."""
    return Rating(scene.bearing, model, reference_capacities(scene.bearing), scene.operation.speeds)


def _other_roots(scene: SingleRowScene, model: RowModel, solution: Solution) -> list[dict[str, Any]] | None:
    """Other equilibria, where the raceway control may have several; None where they are not looked for."""
    if scene.model.raceway_control not in SEVERAL_ROOTS or scene.model.solver != "convex":
        return None
    found = other_roots(model.row, model.control, load_of(scene), given_of(scene), solution)
    return [{**displacement_record(root.displacement), "balls": ball_records(root.told)} for root in found]


def _double_decker(scene: DoubleDeckerScene, start: BallResult | None) -> BallResult:
    model = double_decker_of(scene)
    warm = (start.rows[0], start.rows[1]) if start is not None and len(start.rows) == 2 else None
    began = time.perf_counter()
    solution = solve_double_decker(model.stack, load_of(scene), given_of(scene), model.middle_given, warm)
    took = time.perf_counter() - began
    head, tail = _frame(scene, solution.status, took)
    if not solution.found:
        return BallResult({**head, **tail})
    rows = solution.inner, solution.outer
    rings = {"inner": ("inner_ring", "middle_ring"), "outer": ("middle_ring", "outer_ring")}
    operation, below, above, middle = scene.operation, scene.bearing.inner, scene.bearing.outer, model.split.speed
    ratings = (
        Rating(below, model.inner, reference_capacities(below), (operation.inner_speed, middle)),
        Rating(above, model.outer, reference_capacities(above), (middle, operation.outer_speed)),
    )
    layers: dict[str, Any] = {}
    notes: list[str] = []
    for name, rating, row in zip(rings, ratings, rows, strict=True):
        if why := overloads(row.told[np.newaxis], [rating]):
            return BallResult({**head, "status": f"{name} row {why[0]}", **tail})
        layers[name] = row_record(rating, row, film_record(scene, rating, row, rings[name]))
        notes += sentences(remarks(row.told[np.newaxis], [rating], name))
    notes += sentences([tipping(solution.displacement[np.newaxis, 3:], scene)])
    grown = growth_record(
        scene, dict(zip(("inner_less_middle_bore", "middle_less_outer_race"), model.changes, strict=True))
    )
    whole = {
        **displacement_record(solution.displacement),
        "stiffness": stiffness_record(solution.stiffness),
        "reaction": load_record(solution.reaction),
        "middle_ring": middle_record(model, solution),
        "residual_N": solution.residual,
        "iterations": solution.steps + sum(row.steps for row in rows),
    }
    return BallResult({**head, **whole, **layers, **grown, "notes": notes, **tail}, rows, ratings)


def _frame(scene: BallScene, status: str, took: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """How every record begins and ends."""
    head = {
        "format": FORMAT,
        "status": status,
        "raceway_control": scene.model.raceway_control,
        "solver": scene.model.solver,
    }
    tail = {"cost": {"solve_us": 1e6 * took}, "versions": versions(), "scene": scene.model_dump(mode="json")}
    return head, tail
