"""Equilibria over one or several keys of a scene, each started from its neighbour.

Grids are walked as a snake ploughs: along the last key there and back again, so that each point has a solved neighbour.
A single row goes through one compiled loop; a double-decker, another solver, or a changing number of balls point by point.
Where a row has several equilibria (see ``light_load_share``) a start from the neighbour may stay on another than a fresh start.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rbdyn.arrays import Array, Whole
from rbdyn.quasistatic.bearing import equilibrium
from rbdyn.quasistatic.result import (
    BallResult,
    DoubleDeckerReport,
    Rating,
    Remark,
    overloads,
    reference_capacities,
    remarks,
    tipping,
)
from rbdyn.quasistatic.row.equilibrium import FIGURES, LOST, OK, SENTENCES, Solution, resolved
from rbdyn.quasistatic.row.model import RowModel, given_of, load_of, row_of
from rbdyn.quasistatic.row.newton import CONVERGED, space
from rbdyn.quasistatic.row.ring import RING
from rbdyn.quasistatic.sweep.figures import Columns, ring_columns, row_columns
from rbdyn.quasistatic.sweep.march import LEVER, Points, empty, leaves, march_through
from rbdyn.quasistatic.sweep.partial import Partial, Solved, as_text, from_text
from rbdyn.quasistatic.sweep.points import Axes, Order, axes_of, scenes, snake
from rbdyn.quasistatic.sweep.result import SweepResult
from rbdyn.records.kept import code_version, run_key
from rbdyn.scene import BallScene, Scene, balls_only
from rbdyn.scene.ball import SingleRowScene

# Keys that change only what loads the ring: the row stays as it is.
LOAD_KEYS = (
    "operation.radial_load_N",
    "operation.axial_load_N",
    "operation.load_N",
    "operation.moment_Nm",
    "operation.preload_",
    "operation.prescribed.",
)
# Points between two reports of progress, and two looks for Ctrl-C.
CHUNK = 2000
Progress = Callable[[int, int], None]
Reporter = Progress | None
Group = tuple[Whole, Array]


class Walked(NamedTuple):
    """What a sweep found, in the order in which it went; ``balls`` as ``SweepResult.figures``, remarks with their first point."""

    columns: Columns
    statuses: list[str]
    balls: Mapping[str, Sequence[Array] | Array]
    cold: int
    remarks: list[tuple[int, Remark]]


def sweep(
    scene: BallScene | Scene | Path | str,
    keys: Mapping[str, Sequence[float]],
    progress: Reporter = None,
    kept_in: Path | None = None,
) -> SweepResult:
    """Equilibrium at every point of the grid of ``keys``: dotted names of numbers in the scene, and their values.

    List items count from 1, ``operation.load_N[3]``. Values rise or fall. Points without an equilibrium are records of their cause.
    Interrupted, it leaves what is done in the file ``kept_in``, and goes on from there when it is called again.
    Raises InputError for keys that cannot be swept and naming a point that the scene refuses.
    """
    scene = balls_only(scene)
    axes = axes_of(scene, keys)
    order = snake(axes)
    began = time.perf_counter()
    compiled = isinstance(scene, SingleRowScene) and scene.model.solver == "convex" and "bearing.balls" not in keys
    given = {"scene": scene.model_dump(mode="json"), "keys": {axis.key: axis.values for axis in axes}}
    partial = Partial(kept_in, run_key(given, code_version(__name__)) if kept_in else "")
    walked = (_march if compiled else _one_by_one)(scene, axes, order, progress or (lambda done, total: None), partial)
    partial.remove()
    shape = tuple(len(axis.values) for axis in axes)
    # From the order of the snake to that of the table.
    visited = np.ravel_multi_index(np.array(order).T, shape)
    back = np.argsort(visited)
    failed = np.array([walked.statuses[place] != OK for place in back])
    columns = {}
    for name, column in walked.columns.items():
        columns[name] = column[back]
        columns[name][failed] = np.nan
    return SweepResult(
        {axis.key: axis.values for axis in axes},
        columns,
        tuple(walked.statuses[place] for place in back),
        walked.cold,
        time.perf_counter() - began,
        given["scene"],
        {name: _sorted(balls, back) for name, balls in walked.balls.items()},
        grouped(walked.remarks, visited, walked.statuses),
    )


def grouped(told: Sequence[tuple[int, Remark]], visited: Whole, statuses: Sequence[str]) -> list[dict[str, Any]]:
    """Notes by what they are about: the sentence of the first point in the table, and the points, counted from 0.

    ``told``: remarks, each with the place of its first point on the walk; ``visited``: the table's place of each point walked.
    """
    groups: dict[str, list[tuple[int, int, Remark]]] = {}
    for first, remark in told:
        for k in np.flatnonzero(remark.where).tolist():
            if statuses[first + k] == OK:
                groups.setdefault(remark.word, []).append((int(visited[first + k]), k, remark))
    notes = []
    for word, group in groups.items():
        _, k, remark = min(group, key=lambda one: one[0])
        notes.append({"about": word, "note": remark.sentence(k), "points": sorted(place for place, _, _ in group)})
    return notes


def _sorted(balls: Sequence[Array] | Array, back: Whole) -> list[Group]:
    """Arrays (Z, 6) in the order of the table, those of equal Z together."""
    if isinstance(balls, np.ndarray):
        return [(np.arange(len(balls)), balls[back])]
    sizes: dict[int, list[int]] = {}
    for place, index in enumerate(back):
        sizes.setdefault(len(balls[index]), []).append(place)
    return [(np.array(places), np.array([balls[back[place]] for place in places])) for places in sizes.values()]


def _march(scene: BallScene, axes: Axes, order: Order, progress: Progress, partial: Partial) -> Walked:
    """A single row through the compiled loop."""
    assert isinstance(scene, SingleRowScene)
    model, points, ratings = _packed(scene, axes, order)
    row, size, count = model.row, model.row.cosine.size, len(order)
    found, at, warm, done = empty(count, size), space(size), False, 0
    if left := partial.read():
        for name, array in found._asdict().items():
            array[: len(left[name])] = left[name]
        for name, array in at._asdict().items():
            array[:] = left[f"start_{name}"]
        warm, done = bool(left["warm"]), int(left["done"])
    whole: dict[str, Any] = {"done": 0}
    try:
        for first in range(done, count, CHUNK):
            last = min(first + CHUNK, count)
            # An interrupt may fall between the call and what follows it.
            start = {f"start_{name}": array.copy() for name, array in at._asdict().items()}
            whole = start | {"warm": warm, "done": first}
            warm = march_through(model.control, row.cosine, row.sine, points, first, last, warm, at, found)
            progress(last, count)
    except KeyboardInterrupt:
        if whole["done"]:
            partial.write(whole | {name: array[: whole["done"]] for name, array in found._asdict().items()})
        raise
    solved = resolved(found.displacement, found.taken, found.matrix, found.figures, points.numbers[:, LEVER])
    (displacement, taken, matrix, balls), units = solved, _units(points.numbers)
    displacement = displacement / units
    stiffness = matrix * units[:, :, np.newaxis] * units[:, np.newaxis, :]
    columns = ring_columns(displacement, taken * units, stiffness) | row_columns(balls, ratings)
    columns |= {"residual_N": found.residual, "iterations": found.steps.astype(float)}
    statuses = [OK if outcome == CONVERGED else SENTENCES.get(outcome, LOST) for outcome in found.outcome.tolist()]
    for k, why in overloads(balls, ratings).items():
        if statuses[k] == OK:
            statuses[k] = why
    notes = [(0, remark) for remark in (*remarks(balls, ratings), tipping(displacement[:, 3:], scene))]
    return Walked(columns, statuses, {"row": balls}, int(found.cold.sum()), notes)


def _packed(scene: SingleRowScene, axes: Axes, order: Order) -> tuple[RowModel, Points, list[Rating]]:
    """The last row, and what changes from point to point; each part is made again only where a key that it depends on changes."""
    loading = [place for place, axis in enumerate(axes) if axis.key.startswith(LOAD_KEYS)]
    shaping = [place for place in range(len(axes)) if place not in loading]
    drawing = [place for place in shaping if axes[place].key.startswith("bearing.")]
    packed: list[tuple[Any, ...]] = []
    made: RowModel | None = None
    loaded = shaped = drawn = [math.nan]
    for values, point in scenes(scene, axes, order):
        assert isinstance(point, SingleRowScene)
        now = [values[place] for place in shaping]
        if made is None or now != shaped:
            made, shaped = row_of(point), now
            at_place, number, control = made.row[2:6], made.row[6:], leaves(made.control)
            now = [values[place] for place in drawing]
            if now != drawn:
                capacities, drawn = reference_capacities(point.bearing), now
            rating = Rating(point.bearing, made, capacities, point.operation.speeds)
        now = [values[place] for place in loading]
        if now != loaded:
            load, given, loaded = load_of(point), given_of(point), now
        packed.append((at_place, number, control, rating, load, given))
    assert made is not None
    places, numbers, controls, ratings, loads, givens = zip(*packed, strict=True)
    number_table, given_table = np.array(numbers), np.array(givens)
    units = _units(number_table)
    free = np.isnan(given_table)
    points = Points(
        np.ascontiguousarray(np.array(places).transpose(1, 0, 2)),
        number_table,
        np.array(controls),
        np.array(loads) / units,
        np.where(free, 0.0, given_table) * units,
        free.astype(float),
    )
    return made, points, list(ratings)


def _units(numbers: Array) -> Array:
    """(n, 5): what tilts count over."""
    units = np.ones((len(numbers), RING))
    units[:, 3:] = numbers[:, [LEVER]]
    return units


def _one_by_one(scene: BallScene, axes: Axes, order: Order, progress: Progress, partial: Partial) -> Walked:
    """Any bearing, through ``rbdyn.equilibrium``."""
    left = partial.read()
    solved = from_text(str(left["points"])) if left else []
    points = list(scenes(scene, axes, order))
    try:
        for place in range(len(solved), len(points)):
            solved.append(_solve(points[place][1], solved[-1].rows if solved else ()))
            progress(place + 1, len(order))
    except KeyboardInterrupt:
        if solved:
            partial.write({"points": as_text(solved)})
        raise
    names = dict.fromkeys(name for point in solved for name in point.figures)
    columns = {name: np.array([point.figures.get(name, np.nan) for point in solved]) for name in names}
    return Walked(
        columns,
        [point.status for point in solved],
        {name: [point.balls[name] for point in solved] for name in solved[0].balls},
        sum(point.cold for point in solved),
        [(place, remark) for place, point in enumerate(solved) for remark in point.remarks],
    )


def _solve(scene: BallScene, before: tuple[Solution, ...]) -> Solved:
    """One point, started from the rows before it where these have as many balls and lead there."""
    names = ("row",) if isinstance(scene, SingleRowScene) else ("inner", "outer")
    rows = dict(zip(names, scene.outermost_rows, strict=False))  # a single row is both of the outermost ones
    sizes = [row.balls for row in rows.values()]
    started = [len(row.balls) for row in before] == sizes
    result = equilibrium(scene, before if started else ())
    if started and not result.found:
        result, started = equilibrium(scene), False
    if not result.found:
        nothing = {name: np.full((size, FIGURES), np.nan) for name, size in zip(rows, sizes, strict=True)}
        return Solved(result.status, {}, nothing, [], (), not started)
    figures, balls, remarks = _figures(scene, result)
    # Of a remark that is not about this point there is nothing to say.
    return Solved(result.status, figures, balls, [one for one in remarks if one.where[0]], result.rows, not started)


def _figures(scene: BallScene, result: BallResult) -> tuple[dict[str, float], dict[str, Array], list[Remark]]:
    """Figures of one point, what is known of each ball by row, and remarks."""
    report = result.reached
    assert report.reaction is not None
    reaction = np.array([*report.reaction["load_N"].values(), *report.reaction["moment_Nm"].values()])
    stiffness = np.array(report.stiffness["matrix_SI"])
    columns = ring_columns(result.displacement[np.newaxis], reaction[np.newaxis], stiffness[np.newaxis])
    balls, notes = {}, [tipping(result.displacement[np.newaxis, 3:], scene)]
    names = ("row",) if len(result.rows) == 1 else ("inner", "outer")
    for name, rating, solution in zip(names, result.ratings, result.rows, strict=True):
        balls[name] = solution.figures
        notes += remarks(solution.figures[np.newaxis], [rating], name.removeprefix("row"))
        prefix = "" if name == "row" else f"{name}_row_"
        columns |= {f"{prefix}{key}": value for key, value in row_columns(balls[name][np.newaxis], [rating]).items()}
    figures = {name: float(value[0]) for name, value in columns.items()}
    if isinstance(report, DoubleDeckerReport):
        figures["middle_ring_speed_rpm"] = report.middle_ring["speed_rpm"]
    return {**figures, "residual_N": report.residual_N, "iterations": float(report.iterations)}, balls, notes
