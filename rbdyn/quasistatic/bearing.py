"""Equilibrium of the bearing of a scene, as ``rbdyn.equilibrium`` and ``rbdyn ball`` call it, with the solver of the scene.

Under inner or half raceway control several equilibria may share a load; ``other_roots`` searches for the others.
"""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line
from rbdyn.base.files import versions
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import counted
from rbdyn.life.balls import FASTEST
from rbdyn.mounting.cage import OperatingClearance
from rbdyn.quasistatic import finite_search
from rbdyn.quasistatic.double_decker import double_decker_of, middle_ring, solve_double_decker
from rbdyn.quasistatic.result import (
    BallResult,
    DoubleDeckerReport,
    Rating,
    RingLoad,
    RowReport,
    RowState,
    Stiffness,
    balls_of,
    displacement_record,
    films_of,
    overload,
    reference_capacities,
    remarks,
    row_report,
    tipping,
)
from rbdyn.quasistatic.row.ball import Control, FixedShare, FrictionShare
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.model import RowModel, clearance_of, constraint_of, load_of, row_of
from rbdyn.quasistatic.row.ring import Row
from rbdyn.scene import BallScene, Scene, balls_only
from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene
from rbdyn.scene.fits import growth_record, row_change
from rbdyn.scene.notes import clearance_notes, speed_notes
from rbdyn.scene.operation import Mounting
from rbdyn.scene.thermal import PART_TEMPERATURES

# Solvers by the names in a scene: ``solver(row, control, load, constraint, start) -> Solution``.
SOLVERS: dict[str, Callable[..., Solution]] = {"convex": solve, "finite_search": finite_search.solve}
# Raceway controls that may have several equilibria.
SEVERAL_ROOTS = ("inner", "half")
# Shares of the inner race, and factors on the speeds, whose equilibria are the starts of the search.
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
SPEEDS = (0.7, 1.4)
# Largest difference of contact angles within one equilibrium [rad].
SAME = 1e-4


def equilibrium(
    scene: BallScene | Scene | Path | str,
    start: BallResult | tuple[Solution, ...] | None = None,
    overrides: Iterable[str] = (),
    ranges: bool = True,
) -> BallResult:
    """Equilibrium of a ball bearing under its load: angles, loads, stiffness, stress and life.

    ``scene``: a scene of balls or the path of its file; ``overrides`` of its keys, such as ``["operation.axial_load_N=500"]``.
    ``start``: a result nearby, or the solutions of its rows, to save time. Without an equilibrium the ``status`` of the result states the cause. Raises InputError for another kind of scene
    or a start that does not fit. A scene with [thermal] has its equilibrium at its steady temperatures, and their
    ``ranges`` over the inputs of its balance unless left out, which saves half a second.
    """
    scene = balls_only(scene, overrides)
    starts = _solutions(start, 2 if isinstance(scene, DoubleDeckerScene) else 1)
    if isinstance(scene, DoubleDeckerScene):
        return _double_decker(scene, starts)
    assert isinstance(scene, SingleRowScene)
    single = partial(_single_row, warm=starts[0] if starts else None)
    if scene.thermal is not None:
        from rbdyn.quasistatic.temperatures import with_temperatures

        result, search = with_temperatures(scene, single, ranges)
        if search is None or scene.thermal.start is None:
            return result
        from rbdyn.quasistatic.start import with_start

        return with_start(scene, search, result, ranges)
    return single(scene)


def _single_row(scene: SingleRowScene, warm: Solution | None) -> BallResult:
    model = row_of(scene)
    began = time.perf_counter()
    solution = SOLVERS[scene.model.solver](model.row, model.control, load_of(scene), constraint_of(scene), warm)
    base = _base_result(scene, solution.status, time.perf_counter() - began)
    if not solution.is_equilibrium:
        return base
    rating = Rating(scene.bearing, model, reference_capacities(scene.bearing), scene.operation.speeds)
    if why := overload(solution, rating):
        return replace(base, status=why)
    films = films_of(scene, rating, solution, ("inner_ring", "outer_ring"))
    report = row_report(rating, solution, films, RingLoad.of(solution.reaction))
    grown = growth_record(scene, {"inner_less_outer_race": row_change(scene)})
    notes = [
        *scene.unit_notes,
        *_limit_notes(scene, model),
        *(() if scene.lubricant is None else scene.lubricant.estimates),
    ]
    notes += [remark.note for remark in (*remarks(solution, rating), *tipping(solution.displacement, scene))]
    others = _other_roots(scene, model, solution)
    if others:
        sentence = (
            f"raceway control: has {counted(len(others), 'other root')} under the same load, see other_roots; this one is reached "
            "from one common cage speed"
        )
        notes.append(Note("other-roots", sentence))
    figures = {"report": report, **grown, "other_roots": others, "notes": tuple(notes)}
    return replace(base, **figures, rows=(solution,), ratings=(rating,))


def _limit_notes(scene: SingleRowScene, model: RowModel) -> Notes:
    """Notes on the radial clearance of a deep groove bearing in operation, and on a speed far above the usual ones."""
    bearing, (inner, outer) = scene.bearing, scene.operation.speeds
    plays = {}
    if bearing.kind == "deep_groove_ball" and scene.mounting is not None:
        plays["radial"] = _radial_clearance(scene, scene.mounting, model)
    # Balls bear a slight preload, so that a clearance which is lost need not seize them.
    clearances = clearance_notes(plays, {"radial": -math.inf})
    return (*clearances, *speed_notes(inner - outer, bearing.pitch_diameter, None, FASTEST[bearing.kind]))


def _radial_clearance(scene: SingleRowScene, mounting: Mounting, model: RowModel) -> OperatingClearance:
    """Radial clearance of a mounted row: on the drawing, then with its fits, its temperatures and its rotation."""
    still = mounting.model_copy(update={"rotation": False})
    cold = still.model_copy(update=dict.fromkeys(PART_TEMPERATURES))
    before = [
        clearance_of(row_of(scene.model_copy(update={"mounting": state, "thermal": None})).row)[0]
        for state in (None, cold, still)
    ]
    return OperatingClearance(before[0], *np.diff([*before, clearance_of(model.row)[0]]).tolist())


def _other_roots(scene: SingleRowScene, model: RowModel, solution: Solution) -> list[RowState] | None:
    """Other equilibria where the raceway control may have several; None without a search."""
    if scene.model.raceway_control not in SEVERAL_ROOTS or scene.model.solver != "convex":
        return None
    roots = other_roots(model.row, model.control, load_of(scene), constraint_of(scene), solution)
    return [RowState(**displacement_record(root.displacement), balls=balls_of(root.figures)) for root in roots]


def _solutions(start: Any, rows: int) -> tuple[Solution, ...]:
    """Solutions of the rows of a start, empty without one. Raises InputError."""
    starts = start.rows if isinstance(start, BallResult) else () if start is None else start
    are_solutions = isinstance(starts, tuple) and all(isinstance(row, Solution) for row in starts)
    if not are_solutions or len(starts) not in (0, rows):
        raise InputError(
            f"start = {one_line(repr(start), LONGEST_NAME)}: must be a result of equilibrium of such a bearing, or the "
            f"solution of each of its {counted(rows, 'row')}"
        )
    return starts


def _double_decker(scene: DoubleDeckerScene, starts: tuple[Solution, ...]) -> BallResult:
    model = double_decker_of(scene)
    warm = (starts[0], starts[1]) if len(starts) == 2 else None
    began = time.perf_counter()
    solution = solve_double_decker(model.stack, load_of(scene), constraint_of(scene), model.middle_constraint, warm)
    base = _base_result(scene, solution.status, time.perf_counter() - began)
    if not solution.is_equilibrium:
        return base
    rows = solution.inner, solution.outer
    rings = {"inner": ("inner_ring", "middle_ring"), "outer": ("middle_ring", "outer_ring")}
    operation, below, above, middle = scene.operation, scene.bearing.inner, scene.bearing.outer, model.split.speed
    ratings = (
        Rating(below, model.inner, reference_capacities(below), (operation.inner_speed, middle)),
        Rating(above, model.outer, reference_capacities(above), (middle, operation.outer_speed)),
    )
    layers: dict[str, RowReport] = {}
    notes = [*scene.unit_notes, *(() if scene.lubricant is None else scene.lubricant.estimates)]
    for name, rating, row in zip(rings, ratings, rows, strict=True):
        if why := overload(row, rating):
            return replace(base, status=f"{name} row {why}")
        layers[name] = row_report(rating, row, films_of(scene, rating, row, rings[name]), None)
        notes += [remark.note for remark in remarks(row, rating, name)]
        fast = speed_notes(
            rating.speeds[0] - rating.speeds[1], rating.drawing.pitch_diameter, None, FASTEST["angular_contact_ball"]
        )
        # A fast row is usual here, and two rows have no heat balance.
        notes += [Note(note.code, f"{name} row: {note}") for note in fast if note.code == "overspeed"]
    notes += [remark.note for remark in tipping(solution.displacement, scene)]
    races = zip(("inner_less_middle_bore", "middle_less_outer_race"), model.changes, strict=True)
    grown = growth_record(scene, dict(races))
    report = DoubleDeckerReport(
        **displacement_record(solution.displacement),
        stiffness=Stiffness(solution.stiffness.tolist()),
        reaction=RingLoad.of(solution.reaction),
        middle_ring=middle_ring(model, solution),
        residual_N=solution.residual,
        iterations=solution.steps + sum(row.steps for row in rows),
        inner=layers["inner"],
        outer=layers["outer"],
    )
    return replace(base, report=report, **grown, notes=tuple(notes), rows=rows, ratings=ratings)


def _base_result(scene: BallScene, status: str, seconds: float) -> BallResult:
    """Result with its input, status and cost, before any figures."""
    return BallResult(
        status=status,
        raceway_control=scene.model.raceway_control,
        solver=scene.model.solver,
        cost={"solve_us": 1e6 * seconds},
        versions=versions(),
        scene=scene.model_dump(mode="json"),
    )


def other_roots(row: Row, control: Control, load: Array, constraint: Array, solution: Solution) -> tuple[Solution, ...]:
    """Equilibria other than ``solution``, from the equilibria of other raceway controls and of slower and faster rings.

    The search proves nothing: further equilibria may exist. Under one common cage speed the equilibrium is unique and the
    answer empty.
    """
    if not isinstance(control, FixedShare | FrictionShare):
        return ()
    roots = [solution]
    for start in _starts(row, control, load, constraint):
        root = solve(row, control, load, constraint, start)
        if root.is_equilibrium and all(_differ(root, other) for other in roots):
            roots.append(root)
    return tuple(roots[1:])


def _starts(row: Row, control: FixedShare | FrictionShare, load: Array, constraint: Array) -> Sequence[Solution]:
    usual = control.spinning
    neighbours: list[Control] = [FixedShare(share, usual) for share in SHARES]
    turning = [usual._replace(inner_speed=k * usual.inner_speed, outer_speed=k * usual.outer_speed) for k in SPEEDS]
    # The moment of the opposite sign, as in many texts, leads to the other side.
    turning.append(usual._replace(turning=-usual.turning))
    neighbours += [control._replace(spinning=neighbour) for neighbour in turning]
    return [
        start for start in (solve(row, neighbour, load, constraint) for neighbour in neighbours) if start.is_equilibrium
    ]


def _differ(first: Solution, second: Solution) -> bool:
    touching = (first.inner_load > 0.0) & (second.inner_load > 0.0)
    apart = np.abs(first.inner_angle - second.inner_angle)[touching]
    return bool(np.any((first.inner_load > 0.0) != (second.inner_load > 0.0)) or np.any(apart > SAME))
