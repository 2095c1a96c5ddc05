"""Equilibrium of the bearing of a scene: what ``rbdyn.equilibrium`` and ``rbdyn ball`` call.

A raceway control other than outer may have several under the same load: others are searched for.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line
from rbdyn.base.words import counted
from rbdyn.mounting.fits import growth_record, row_change
from rbdyn.quasistatic.double_decker.equilibrium import solve_double_decker
from rbdyn.quasistatic.double_decker.model import double_decker_of, load_record, middle_record
from rbdyn.quasistatic.result import (
    BallResult,
    DoubleDeckerReport,
    Rating,
    RowReport,
    ball_records,
    displacement_record,
    film_record,
    overloads,
    reference_capacities,
    remarks,
    row_report,
    sentences,
    stiffness_record,
    tipping,
)
from rbdyn.quasistatic.rivals import finite_search, plain_newton
from rbdyn.quasistatic.row.ball import Control, FixedShare, FrictionShare
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.model import RowModel, given_of, load_of, row_of
from rbdyn.quasistatic.row.ring import Row
from rbdyn.result import versions
from rbdyn.scene import BallScene, Scene, balls_only
from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene

# Those that a scene may choose: ``solver(row, control, load, given, start) -> Solution``.
SOLVERS: dict[str, Callable[..., Solution]] = {
    "convex": solve,
    "finite_search": finite_search.solve,
    "newton": plain_newton.solve,
}
# Raceway controls under which there may be more than one equilibrium.
SEVERAL_ROOTS = ("inner", "half")
# Shares of the inner race and of the speeds whose equilibria are the starts of the search.
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
SPEEDS = (0.7, 1.4)
# Contact angles that differ by less belong to one equilibrium [rad].
SAME = 1e-4


def equilibrium(
    scene: BallScene | Scene | Path | str, start: BallResult | tuple[Solution, ...] | None = None
) -> BallResult:
    """Equilibrium of a ball bearing under its load: angles, loads, stiffness, stress and life.

    ``scene``: also the path of its file. ``start``: a result nearby, or the solutions of its rows, which saves time. The
    result's ``status`` shows where there is none; nothing is raised for it. Raises InputError for what is no scene of balls
    and no start of such a bearing.
    """
    scene = balls_only(scene)
    before = _solutions(start, 2 if isinstance(scene, DoubleDeckerScene) else 1)
    if isinstance(scene, DoubleDeckerScene):
        return _double_decker(scene, before)
    assert isinstance(scene, SingleRowScene)
    model = row_of(scene)
    warm = before[0] if before else None
    began = time.perf_counter()
    solution = SOLVERS[scene.model.solver](model.row, model.control, load_of(scene), given_of(scene), warm)
    took = time.perf_counter() - began
    nothing = _nothing(scene, solution.status, took)
    if not solution.found:
        return nothing
    rating = Rating(scene.bearing, model, reference_capacities(scene.bearing), scene.operation.speeds)
    table = solution.figures[np.newaxis]
    if why := overloads(table, [rating]):
        return replace(nothing, status=why[0])
    film = film_record(scene, rating, solution, ("inner_ring", "outer_ring"))
    report = row_report(rating, solution, film, load_record(solution.reaction))
    grown = growth_record(scene, {"inner_less_outer_race": row_change(scene)})
    notes = [] if scene.lubricant is None else list(scene.lubricant.estimates)
    notes += sentences([*remarks(table, [rating]), tipping(solution.displacement[np.newaxis, 3:], scene)])
    others = _other_roots(scene, model, solution)
    if others:
        more = f"{len(others)} more equilibri{'um' if len(others) == 1 else 'a'} of the same load"
        known = "see other_roots; this one is reached from one common cage speed"
        notes.append(f"{more} under this raceway control, {known}")
    figures = {"report": report, **grown, "other_roots": others, "notes": notes}
    return replace(nothing, **figures, rows=(solution,), ratings=(rating,))


def _other_roots(scene: SingleRowScene, model: RowModel, solution: Solution) -> list[dict[str, Any]] | None:
    """Other equilibria, where the raceway control may have several; None where they are not looked for."""
    if scene.model.raceway_control not in SEVERAL_ROOTS or scene.model.solver != "convex":
        return None
    roots = other_roots(model.row, model.control, load_of(scene), given_of(scene), solution)
    return [{**displacement_record(root.displacement), "balls": ball_records(root.figures)} for root in roots]


def _solutions(start: Any, rows: int) -> tuple[Solution, ...]:
    """Solutions of the rows to start from, none where there are none. Raises InputError."""
    before = start.rows if isinstance(start, BallResult) else () if start is None else start
    whole = isinstance(before, tuple) and all(isinstance(row, Solution) for row in before)
    if not whole or len(before) not in (0, rows):
        what = f"start = {one_line(repr(start), LONGEST_NAME)}: must be a result of equilibrium of such a bearing"
        raise InputError([f"{what}, or the solution of each of its {counted(rows, 'row')}"])
    return before


def _double_decker(scene: DoubleDeckerScene, before: tuple[Solution, ...]) -> BallResult:
    model = double_decker_of(scene)
    warm = (before[0], before[1]) if len(before) == 2 else None
    began = time.perf_counter()
    solution = solve_double_decker(model.stack, load_of(scene), given_of(scene), model.middle_given, warm)
    took = time.perf_counter() - began
    nothing = _nothing(scene, solution.status, took)
    if not solution.found:
        return nothing
    rows = solution.inner, solution.outer
    rings = {"inner": ("inner_ring", "middle_ring"), "outer": ("middle_ring", "outer_ring")}
    operation, below, above, middle = scene.operation, scene.bearing.inner, scene.bearing.outer, model.split.speed
    ratings = (
        Rating(below, model.inner, reference_capacities(below), (operation.inner_speed, middle)),
        Rating(above, model.outer, reference_capacities(above), (middle, operation.outer_speed)),
    )
    layers: dict[str, RowReport] = {}
    notes = [] if scene.lubricant is None else list(scene.lubricant.estimates)
    for name, rating, row in zip(rings, ratings, rows, strict=True):
        if why := overloads(row.figures[np.newaxis], [rating]):
            return replace(nothing, status=f"{name} row {why[0]}")
        layers[name] = row_report(rating, row, film_record(scene, rating, row, rings[name]), None)
        notes += sentences(remarks(row.figures[np.newaxis], [rating], name))
    notes += sentences([tipping(solution.displacement[np.newaxis, 3:], scene)])
    races = zip(("inner_less_middle_bore", "middle_less_outer_race"), model.changes, strict=True)
    grown = growth_record(scene, dict(races))
    report = DoubleDeckerReport(
        **displacement_record(solution.displacement),
        stiffness=stiffness_record(solution.stiffness),
        reaction=load_record(solution.reaction),
        middle_ring=middle_record(model, solution),
        residual_N=solution.residual,
        iterations=solution.steps + sum(row.steps for row in rows),
        inner=layers["inner"],
        outer=layers["outer"],
    )
    return replace(nothing, report=report, **grown, notes=notes, rows=rows, ratings=ratings)


def _nothing(scene: BallScene, status: str, took: float) -> BallResult:
    """A result that has found nothing yet."""
    return BallResult(
        status=status,
        raceway_control=scene.model.raceway_control,
        solver=scene.model.solver,
        cost={"solve_us": 1e6 * took},
        versions=versions(),
        scene=scene.model_dump(mode="json"),
    )


def other_roots(row: Row, control: Control, load: Array, given: Array, known: Solution) -> tuple[Solution, ...]:
    """Equilibria besides ``known``, found from those of other raceway controls and of slower and faster rings.

    A search, not a proof: an empty answer says that none of these starts leads elsewhere. None under one common cage speed,
    where the equilibrium is unique.
    """
    if not isinstance(control, FixedShare | FrictionShare):
        return ()
    roots = [known]
    for start in _starts(row, control, load, given):
        root = solve(row, control, load, given, start)
        if root.found and all(_differ(root, other) for other in roots):
            roots.append(root)
    return tuple(roots[1:])


def _starts(row: Row, control: FixedShare | FrictionShare, load: Array, given: Array) -> Sequence[Solution]:
    usual = control.spinning
    neighbours: list[Control] = [FixedShare(share, usual) for share in SHARES]
    turning = [usual._replace(inner_speed=k * usual.inner_speed, outer_speed=k * usual.outer_speed) for k in SPEEDS]
    # The sign of the moment that many texts have leads to the other side.
    turning.append(usual._replace(turning=-usual.turning))
    neighbours += [control._replace(spinning=each) for each in turning]
    return [start for start in (solve(row, each, load, given) for each in neighbours) if start.found]


def _differ(one: Solution, other: Solution) -> bool:
    touching = (one.inner_load > 0.0) & (other.inner_load > 0.0)
    apart = np.abs(one.inner_angle - other.inner_angle)[touching]
    return bool(np.any((one.inner_load > 0.0) != (other.inner_load > 0.0)) or np.any(apart > SAME))
