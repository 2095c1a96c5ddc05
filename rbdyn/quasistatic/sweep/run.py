"""Equilibria over one or several keys of a scene, each started from its neighbour.

Grids are walked as a snake ploughs: along the last key there and back again, so that each point has a solved neighbour.
Where a row has several equilibria (see ``light_load_share``) a start from the neighbour may stay on another than a fresh start.
"""

import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.storage import Kept, code_version, run_key
from rbdyn.quasistatic.bearing import equilibrium
from rbdyn.quasistatic.result import BallResult, DoubleDeckerReport, Remark, remarks, tipping
from rbdyn.quasistatic.row.equilibrium import FIGURES, OK, Solution
from rbdyn.quasistatic.sweep.figures import ring_columns, row_columns
from rbdyn.quasistatic.sweep.points import axes_of, scenes, snake
from rbdyn.quasistatic.sweep.result import SweepResult
from rbdyn.scene import BallScene, Scene, balls_only
from rbdyn.scene.ball import SingleRowScene

# Points of a line of what is kept: to write one takes as long as to solve a few points.
ROW = 100
Progress = Callable[[int, int], None]
Reporter = Progress | None
Group = tuple[Whole, Array]


class Solved(NamedTuple):
    """One point: status, figures, those of each ball by row of balls, remarks, solutions of the rows, and whether the start
    was not the point before."""

    status: str
    figures: dict[str, float]
    balls: dict[str, Array]
    remarks: list[Remark]
    rows: tuple[Solution, ...]
    cold: bool

    def as_text(self) -> str:
        """JSON, every number with all its digits."""
        sentences = [(one.word, one.sentence(0)) for one in self.remarks]
        return json.dumps(self._replace(remarks=sentences), default=np.ndarray.tolist)  # type: ignore[arg-type]

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Inverse of ``as_text``."""
        status, figures, balls, remarks, rows, cold = json.loads(text)
        return cls(
            status,
            figures,
            {name: np.array(values) for name, values in balls.items()},
            [Remark(word, np.array([True]), partial(lambda sentence, _: sentence, said)) for word, said in remarks],
            tuple(Solution._make(np.array(x) if isinstance(x, list) else x for x in row) for row in rows),
            cold,
        )


def sweep(
    scene: BallScene | Scene | Path | str,
    keys: Mapping[str, Sequence[float]],
    progress: Reporter = None,
    kept_in: Path | None = None,
) -> SweepResult:
    """Equilibrium at every point of the grid of ``keys``: dotted names of numbers in the scene, and their values.

    List items count from 1, ``operation.load_N[3]``. Values rise or fall. Points without an equilibrium are records of their cause.
    What is done is kept in the file ``kept_in``, a line every ``ROW`` points: interrupted, a sweep goes on from there.
    Raises InputError for keys that cannot be swept and naming a point that the scene refuses.
    """
    scene = balls_only(scene)
    axes = axes_of(scene, keys)
    order = snake(axes)
    began = time.perf_counter()
    given = {"scene": scene.model_dump(mode="json"), "keys": {axis.key: axis.values for axis in axes}}
    key = run_key(given, code_version(__name__)) if kept_in else ""
    solved = _walk(scenes(scene, axes, order), len(order), progress or (lambda done, total: None), Kept(kept_in), key)
    if kept_in is not None:
        # One that cannot be removed does no harm: the key shows what it is of.
        with suppress(OSError):
            kept_in.unlink(missing_ok=True)
    shape = tuple(len(axis.values) for axis in axes)
    # From the order of the snake to that of the table.
    visited = np.ravel_multi_index(np.array(order).T, shape)
    back = np.argsort(visited)
    table = [solved[place] for place in back]
    names = dict.fromkeys(name for point in table for name in point.figures)
    return SweepResult(
        {axis.key: axis.values for axis in axes},
        {name: np.array([point.figures.get(name, np.nan) for point in table]) for name in names},
        tuple(point.status for point in table),
        sum(point.cold for point in table),
        time.perf_counter() - began,
        given["scene"],
        {name: _by_size([point.balls[name] for point in table]) for name in table[0].balls},
        grouped(
            [(place, remark) for place, point in enumerate(table) for remark in point.remarks],
            np.arange(len(table)),
            [point.status for point in table],
        ),
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


def _by_size(balls: Sequence[Array]) -> list[Group]:
    """Arrays (Z, 6), those of equal Z together, with their places."""
    sizes: dict[int, list[int]] = {}
    for place, one in enumerate(balls):
        sizes.setdefault(len(one), []).append(place)
    return [(np.array(places), np.array([balls[place] for place in places])) for places in sizes.values()]


def _walk(
    points: Iterable[tuple[tuple[float, ...], BallScene]], total: int, progress: Progress, kept: Kept, key: str
) -> list[Solved]:
    """Every point, each from the one before; rows that were ``kept`` under the ``key`` are not solved again."""
    # Every point is checked before the first is solved.
    bearings = [scene for _, scene in points]
    solved: list[Solved] = []
    while row := kept.get(f"{key} {len(solved)}"):
        solved += map(Solved.from_text, row)
    for place in range(len(solved), total):
        solved.append(_solve(bearings[place], solved[-1].rows if solved else ()))
        progress(place + 1, total)
        if kept.path is not None and (place + 1) % ROW == 0:
            kept.put(f"{key} {place + 1 - ROW}", [point.as_text() for point in solved[-ROW:]])
    return solved


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
