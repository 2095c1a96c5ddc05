"""Sweeps: equilibria over one or several keys of a scene, each started from its neighbour.

The points form a grid of ``Axis`` values, one axis a key. The walk goes along the last key there and back like a snake, so
that each point has a solved neighbour. Every point is validated like a scene from a file. Where a row has several
equilibria (see ``light_load_share``), a start from the neighbour may end in another one than a cold start.
``sweep`` returns a ``SweepResult``, which is a table, saved and loaded.
"""

import itertools
import math
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from pydantic import ValidationError

from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Column, Sheet
from rbdyn.base.faults import InputError, given, number_list, refuse, validated
from rbdyn.base.files import Checkpoint, code_version, run_key, versions
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, finite, keyed, outside_json, save_table
from rbdyn.base.words import counted
from rbdyn.quasistatic.bearing import equilibrium
from rbdyn.quasistatic.result import (
    Ball,
    DoubleDeckerReport,
    Remark,
    ball_columns,
    balls_of,
    remarks,
    ring_figures,
    row_figures,
    tipping,
)
from rbdyn.quasistatic.row.equilibrium import FIGURES, OK, Solution
from rbdyn.result import BallHeatBalance, SavedRecord
from rbdyn.scene import BallScene, Scene, balls_only
from rbdyn.scene.ball import SingleRowScene
from rbdyn.scene.thermal import first_guess_faults

if TYPE_CHECKING:
    import pandas as pd


# What the columns of a sweep mean.
MEANINGS = {
    "{key}": "value of each key that is swept",
    "preload_N clearance_um wear_um": "axial preload, diametral clearance, or loss of each ball's diameter, of these studies",
    "x_mm y_mm z_mm tilt_x_mrad tilt_y_mrad": "displacement of the inner ring",
    "force_x_N force_y_N force_z_N": "reaction of the bearing",
    "moment_x_Nm moment_y_Nm": "its moments",
    "stiffness_x_N_per_um stiffness_y_N_per_um stiffness_z_N_per_um": "diagonal of the stiffness",
    "stiffness_tilt_x_Nm_per_mrad stiffness_tilt_y_Nm_per_mrad": "the same of tilts",
    "inner_angle_min_deg inner_angle_max_deg outer_angle_min_deg outer_angle_max_deg": "extremes of the contact angles",
    "inner_angle_ball_1_deg outer_angle_ball_1_deg": "contact angles of the first ball",
    "loaded_balls": "balls that touch the inner raceway",
    "inner_load_max_N outer_load_max_N": "largest contact loads",
    "inner_pressure_MPa outer_pressure_MPa": "largest Hertz pressures",
    "L10_Mrev L10_h": "life",
    "oil_temperature_C outer_temperature_C inner_temperature_C rollers_temperature_C": "with `[thermal]`: of oil, rings and balls",
    "thermal_gain friction_W": "with `[thermal]`: gain of its loop, and the friction that heats the bearing",
    "start_radial_clearance_um start_inner_minus_outer_K": "with `[thermal.start]`: least clearance, largest lead of the inner ring",
    "start_axial_load_N start_contact_pressure_MPa": "with `[thermal.start]`: largest axial load and contact pressure",
    "middle_ring_speed_rpm": "of a double-decker: speed of the middle ring",
    "residual_N": "residual of the equations",
    "iterations": "steps of the solver",
    "status": "ok, or why there is no equilibrium or no steady temperature",
    "notes": "topics of the notes on this point",
}
SWEEPS: Sheet[Any] = Sheet(
    "",
    [Column(key, meaning=meaning) for keys, meaning in MEANINGS.items() for key in keys.split()],
    file="sweep.csv, preload.csv, clearance.csv, wear.csv",
    content="One row per point of `rbdyn ball --sweep` and of the studies over preload, clearance and wear; columns of a double-decker's "
    "rows begin with `inner_row_` and `outer_row_`.",
)
# Points of a stored line: writing a line takes as long as solving a few points.
ROW = 100
MOST_POINTS = 100_000
FIX = "write key=start:stop:count with a count of at least 2, or key=a,b,c"
Progress = Callable[[int, int], None]
Reporter = Progress | None
KeyPath = tuple[str | int, ...]


class SweepResult(SavedRecord, kw_only=True):
    """Equilibria over a grid of scene keys, in the order of ``keys``, the last one running fastest.

    ``keys``: values of each key. ``records``: points of the table, each with its keys, its status and, in an equilibrium, its figures
    with units in the names, None for those that are infinite or missing. ``figures``: those of the balls in SI by row of balls,
    (Z, 6) of each point; empty in a loaded sweep. ``notes``: the JSON form of the note of its first point, its topic
    ("about"), and all its "points", counted from 0 in the order of the table. ``cold``: number of points not started from their neighbour.
    ``wall_s``: wall time.
    """

    FORMAT = "rbdyn.sweep/3"
    WHAT = "sweep"
    status: str = derived(lambda self: self._status())
    keys: dict[str, tuple[float, ...]]
    records: list[dict[str, Any]] = keyed("points")
    failed: list[dict[str, Any]] = derived(lambda self: self._failed(), "failures")
    notes: list[dict[str, Any]]
    wall_s: float = keyed("cost", "wall_s")
    cold: int = keyed("cost", "cold_starts")
    versions: dict[str, str] = derived(lambda self: versions())
    scene: dict[str, Any]
    figures: dict[str, list[Array]] = outside_json(default_factory=dict, repr=False)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each key."""
        return tuple(len(values) for values in self.keys.values())

    @cached_property
    def statuses(self) -> tuple[str, ...]:
        """Status of each point: "ok", or the cause of the failure."""
        return tuple(record["status"] for record in self.records)

    @cached_property
    def columns(self) -> dict[str, Array]:
        """Figures of the points, NaN without an equilibrium."""
        names = dict.fromkeys(name for record in self.records for name in record if name not in (*self.keys, "status"))
        return {name: np.array([_number(record, name) for record in self.records]) for name in names}

    def _status(self) -> str:
        """ "ok", or how many points failed."""
        count = sum(status != OK for status in self.statuses)
        return OK if count == 0 else f"{count} of {counted(len(self.statuses), 'point')} failed"

    @property
    def failures(self) -> dict[str, list[int]]:
        """Points without an equilibrium by cause, counted from 0 in the order of the table.

        A cause is the part of a status before its colon.
        """
        causes: dict[str, list[int]] = {}
        for place, status in enumerate(self.statuses):
            if status != OK:
                causes.setdefault(status.partition(":")[0], []).append(place)
        return causes

    def _failed(self) -> list[dict[str, Any]]:
        """Causes with the number of their points, and the first of these."""
        return [
            {
                "cause": cause,
                "points": len(places),
                "first": self.key_values(places[0]),
                "status": self.statuses[places[0]],
            }
            for cause, places in self.failures.items()
        ]

    def key_values(self, place: int) -> dict[str, float]:
        """Values of the keys at a point."""
        return {key: self.records[place][key] for key in self.keys}

    def where(self, places: Sequence[int]) -> str:
        """Number of points, and the values of the keys at the first of them."""
        first = ", ".join(f"{key} = {value:g}" for key, value in self.key_values(places[0]).items())
        return f"{counted(len(places), 'point')}{', the first' if len(places) > 1 else ''} at {first}"

    def grid(self, column: str) -> Array:
        """A column over the grid, one axis a key. Raises KeyError for an unknown one."""
        return self.columns[column].reshape(self.shape)

    @property
    def placed_notes(self) -> Notes:
        """Each note with its number of points and the first of them."""
        return tuple(Note.of(note).about(self.where(note["points"])) for note in self.notes)

    def table(self) -> "pd.DataFrame":
        """A row a point: keys, figures, status, and the topics of its notes."""
        import pandas as pd

        words: list[list[str]] = [[] for _ in self.statuses]
        for note in self.notes:
            for place in note["points"]:
                words[place].append(note["about"])
        keys = {key: [record[key] for record in self.records] for key in self.keys}
        about = ["; ".join(topics) for topics in words]
        return pd.DataFrame({**keys, **self.columns, "status": self.statuses, "notes": about})

    def balls(self) -> "pd.DataFrame":
        """A row a ball and point: keys, row of balls, ball from 1, then as ``BallResult.table``.

        Failed points have none. Raises RuntimeError for a loaded sweep, which has no balls.
        """
        import pandas as pd

        parts = []
        for name, points in self._balls().items():
            for place, balls in enumerate(points):
                solved = balls if self.statuses[place] == OK else balls[:0]
                common = {**self.key_values(place), "row": name}
                columns = {key: np.full(len(solved), value) for key, value in common.items()}
                parts.append(columns | {"ball": np.arange(1, len(solved) + 1)} | ball_columns(solved))
        return pd.DataFrame({key: np.concatenate([part[key] for part in parts]) for key in parts[0]})

    def balls_at(self, place: int) -> dict[str, list[Ball]]:
        """The balls of a point by row, as in ``BallResult``. Raises RuntimeError as ``balls``."""
        return {name: balls_of(points[place]) for name, points in self._balls().items()}

    def _balls(self) -> dict[str, list[Array]]:
        if not self.figures:
            raise RuntimeError("a loaded sweep has no balls; run the sweep again")
        return self.figures

    def points(self) -> list[dict[str, Any]]:
        """A record a point, with None for infinite and missing figures."""
        return [dict(record) for record in self.records]

    def save(self, path: Path | str) -> None:
        """Write the table as CSV to a path that ends in ".csv", else all as JSON."""
        if str(path).endswith(".csv"):
            save_table(self.table(), path, "%.9g")
        else:
            super().save(path)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``as_dict``. Raises KeyError or TypeError for anything else."""
        found = super().from_dict(data)
        # What is no table of points fails here.
        _ = found.columns, [found.key_values(place) for place in range(len(found.statuses))]
        return found


def _number(point: dict[str, Any], name: str) -> float:
    """Value of a saved figure; at an equilibrium, null is an infinite life without load, or NaN."""
    if point["status"] != OK:
        return math.nan
    value = point[name]
    if value is None:
        return math.inf if name.startswith("L10") or "_L10" in name else math.nan
    return float(value)


class PointRecord(Record, eq=False):
    """One point: status, its figures, those of the balls by row, remarks and solutions of the rows.

    ``cold``: whether its start was not the point before.
    """

    status: str
    figures: dict[str, float]
    balls: dict[str, Array]
    remarks: list[Remark]
    rows: tuple[Solution, ...]
    cold: bool


def sweep(
    scene: BallScene | Scene | Path | str,
    keys: Mapping[str, Sequence[float]],
    progress: Reporter = None,
    kept_in: Path | None = None,
) -> SweepResult:
    """Equilibrium at every point of the grid of ``keys``: dotted names of numbers in the scene, and their values.

    List items count from 1, as in ``operation.load_N[3]``. Values must rise or fall. A point without an equilibrium has its
    cause as status. The file ``kept_in`` stores a line every ``ROW`` points, from which an interrupted sweep continues.
    Raises InputError for keys that cannot be swept, and for an invalid point, with its name.
    """
    scene = balls_only(scene)
    axes = axes_of(scene, keys)
    order = snake(axes)
    began = time.perf_counter()
    task = {"scene": scene.model_dump(mode="json"), "keys": {axis.key: axis.values for axis in axes}}
    key = run_key(task, code_version(__name__)) if kept_in else ""
    solved = _walk(scenes(scene, axes, order), len(order), progress or (lambda *_: None), Checkpoint(kept_in), key)
    if kept_in is not None:
        # A file that cannot be removed does no harm: its key names the sweep.
        with suppress(OSError):
            kept_in.unlink(missing_ok=True)
    shape = tuple(len(axis.values) for axis in axes)
    # From the order of the snake to that of the table.
    table = [solved[place] for place in np.argsort(np.ravel_multi_index(np.array(order).T, shape))]
    return result_of({axis.key: axis.values for axis in axes}, table, time.perf_counter() - began, task["scene"])


def result_of(
    keys: dict[str, tuple[float, ...]], points: Sequence[PointRecord], wall_s: float, scene: dict[str, Any]
) -> SweepResult:
    """A sweep of its points, in the order of the table."""
    records, topics = [], dict[str, dict[str, Any]]()
    for place, (values, point) in enumerate(zip(itertools.product(*keys.values()), points, strict=True)):
        figures = {name: finite(value) for name, value in point.figures.items()}
        records.append({**dict(zip(keys, values, strict=True)), "status": point.status, **figures})
        for word, note in point.remarks:
            topics.setdefault(word, {**note.as_dict(), "about": word, "points": []})["points"].append(place)
    balls = {name: [point.balls[name] for point in points] for name in points[0].balls}
    cold = sum(point.cold for point in points)
    notes = list(topics.values())
    return SweepResult(keys=keys, records=records, notes=notes, wall_s=wall_s, cold=cold, scene=scene, figures=balls)


def _walk(
    points: Iterable[tuple[tuple[float, ...], BallScene]], total: int, progress: Progress, store: Checkpoint, key: str
) -> list[PointRecord]:
    """Every point, each started from the one before; points that ``store`` has under the ``key`` are not solved again."""
    # All points are validated before the first solve.
    bearings = [scene for _, scene in points]
    solved: list[PointRecord] = []
    while row := store.get(f"{key} {len(solved)}"):
        solved += map(PointRecord.from_dict, row)
    for place in range(len(solved), total):
        solved.append(_solve(bearings[place], solved[-1].rows if solved else ()))
        progress(place + 1, total)
        if store.path is not None and (place + 1) % ROW == 0:
            store.put(f"{key} {place + 1 - ROW}", [point.as_dict() for point in solved[-ROW:]])
    return solved


def _solve(scene: BallScene, before: tuple[Solution, ...]) -> PointRecord:
    """One point, started from the rows ``before`` it where these have as many balls and the solve succeeds."""
    names = ("row",) if isinstance(scene, SingleRowScene) else ("inner", "outer")
    rows = dict(zip(names, scene.outermost_rows, strict=False))  # a single row is both of the outermost ones
    sizes = [row.balls for row in rows.values()]
    started = [len(row.balls) for row in before] == sizes
    result = equilibrium(scene, before if started else (), ranges=False)
    if started and not result.is_equilibrium:
        result, started = equilibrium(scene, ranges=False), False
    if not result.is_equilibrium:
        nothing = {name: np.full((size, FIGURES), np.nan) for name, size in zip(rows, sizes, strict=True)}
        return PointRecord(result.status, {}, nothing, [], (), not started)
    report = result.reached
    figures = ring_figures(result.displacement, given(report.reaction), report.stiffness)
    found = tipping(result.displacement, scene)
    for name, rating, solution in zip(rows, result.ratings, result.rows, strict=True):
        found += remarks(solution, rating, name.removeprefix("row"))
        prefix = "" if name == "row" else f"{name}_row_"
        figures |= {f"{prefix}{key}": value for key, value in row_figures(solution, rating).items()}
    limits = (note for note in result.notes or () if note.code in ("seizure", "fast", "overspeed"))
    found += [Remark(note.code, note) for note in limits]
    if isinstance(report, DoubleDeckerReport):
        figures["middle_ring_speed_rpm"] = report.middle_ring.speed_rpm
    if result.temperatures_C is not None and isinstance(result.thermal, BallHeatBalance):
        figures |= {f"{node}_temperature_C": value for node, value in result.temperatures_C.items()}
        figures |= {"thermal_gain": result.thermal.gain, "friction_W": sum(result.thermal.friction_W.values())}
    figures |= {} if result.start is None else {name: each.value for name, each in result.start.figures.items()}
    figures |= {"residual_N": report.residual_N, "iterations": report.iterations}
    balls = {name: solution.figures for name, solution in zip(rows, result.rows, strict=True)}
    exact = {name: float(value) for name, value in figures.items()}
    return PointRecord(result.status, exact, balls, found, result.rows, not started)


class Axis(NamedTuple):
    """One key that is swept: its dotted name, its path in a nested scene and its values."""

    key: str
    path: KeyPath
    values: tuple[float, ...]


Axes = Sequence[Axis]
Order = Sequence[tuple[int, ...]]  # of indices of the values at each point


def keys_of_texts(texts: Sequence[str]) -> dict[str, list[float]]:
    """Keys and values of ``key=start:stop:count`` (evenly spaced) or ``key=a,b,c`` texts. Raises InputError."""
    keys: dict[str, list[float]] = {}
    for text in texts:
        key, sign, values = text.partition("=")
        key = key.strip()
        if not sign or not key:
            raise InputError(f"--sweep {text}: write it as key=start:stop:count or key=a,b,c")
        if key in keys:
            raise InputError(f"--sweep {text}: {key} is swept twice; give all its values at once")
        keys[key] = number_list(values, f"--sweep {text}", FIX, 2, MOST_POINTS)
    return keys


def axes_of(scene: BallScene, keys: Mapping[str, Sequence[float]]) -> tuple[Axis, ...]:
    """The axes of a sweep, the first key outermost. Raises InputError for keys and values that cannot be swept."""
    if not keys:
        raise InputError("sweep: no key to sweep; name one, such as operation.inner_speed_rpm")
    data = tables(scene)
    faults = first_guess_faults(scene.thermal, scene.lubricant, keys)
    axes = []
    for key, values in keys.items():
        try:
            axes.append(_axis(data, key, [float(value) for value in values]))
        except InputError as error:
            faults += error.faults
        except (TypeError, ValueError):
            faults.append(f"{key}: the values {_listing(values)} are not numbers; give a list of numbers")
    refuse(faults)
    count = math.prod(len(axis.values) for axis in axes)
    if count > MOST_POINTS:
        raise InputError(f"sweep: {count} points are more than {MOST_POINTS}; take fewer values")
    return tuple(axes)


def _axis(data: dict[str, Any], key: str, values: Sequence[float]) -> Axis:
    steps = np.diff(values)
    if len(values) == 0 or not np.all(np.isfinite(values)):
        raise InputError(f"{key}: the values {_listing(values)} are not all finite; write plain numbers")
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise InputError(f"{key}: the values {_listing(values)} must rise or fall from each to the next; sort them")
    path = _path(key)
    now = _now(data, path, key)
    if isinstance(now, int):
        uneven = [value for value in values if not value.is_integer()]
        if uneven:
            raise InputError(f"{key} = {uneven[0]:g}: must be a whole number; write whole values")
        values = [int(value) for value in values]
    return Axis(key, path, tuple(values))


def _path(key: str) -> KeyPath:
    path: list[str | int] = []
    for part in key.split("."):
        match = re.fullmatch(r"(\w+)((?:\[[1-9]\d*\])*)", part)
        if match is None:
            raise InputError(f"{key}: not a key; write it as operation.inner_speed_rpm or operation.load_N[3]")
        path.append(match[1])
        path += [int(index) - 1 for index in re.findall(r"\d+", match[2])]
    return tuple(path)


def _now(data: Any, path: KeyPath, key: str) -> Any:
    """Value of a key in the scene, None for a missing one. Raises InputError where the key cannot be a number."""
    place = ""
    for step in path:
        if isinstance(step, int):
            if not isinstance(data, list):
                raise InputError(f"{key}: the scene has no list {place}; write it into the scene first")
            if step >= len(data):
                raise InputError(f"{key}: {place} has {len(data)} items; take one of them")
            place += f"[{step + 1}]"
        elif isinstance(data, dict) or data is None:
            place += f".{step}" if place else step
        else:
            fix = "write it out as a table of numbers first" if isinstance(data, str) else "check the key"
            raise InputError(f"{key}: {place} = {data!r} is not a table; {fix}")
        data = data[step] if isinstance(step, int) else (data or {}).get(step)
    if isinstance(data, dict):
        raise InputError(f"{key}: is a table, not a number; name one of its keys: {', '.join(sorted(data))}")
    if isinstance(data, list):
        raise InputError(f"{key}: is a list, not a number; name one item, such as {key}[1]")
    if isinstance(data, str | bool):
        raise InputError(f"{key} = {data!r}: is not a number and cannot be swept; compare scenes with --set")
    return data


def tables(scene: BallScene) -> dict[str, Any]:
    """The scene as nested tables, without keys of no value."""
    return scene.model_dump(mode="json", exclude_none=True)


def snake(axes: Axes) -> list[tuple[int, ...]]:
    """Indices of the values at each point, ordered so that from point to point only one changes, and by one."""
    order: list[tuple[int, ...]] = [()]
    for axis in axes:
        ahead = range(len(axis.values))
        order = [
            (*head, index)
            for place, head in enumerate(order)
            for index in (ahead if place % 2 == 0 else reversed(ahead))
        ]
    return order


def scenes(scene: BallScene, axes: Axes, order: Order) -> Iterator[tuple[tuple[float, ...], BallScene]]:
    """Values and validated scene of each point. Raises InputError naming an invalid point."""
    stated, kind = tables(scene), type(scene)
    # Tables without a swept key are valid already; the others remain parts of ``stated``, which names them in a fault.
    touched = {name: stated.setdefault(name, {}) for name in (str(axis.path[0]) for axis in axes)}
    data = {name: getattr(scene, name) for name in kind.model_fields} | touched
    holders = [_holder(data, axis.path) for axis in axes]
    for indices in order:
        values = tuple(axis.values[index] for axis, index in zip(axes, indices, strict=True))
        for (table, name), value in zip(holders, values, strict=True):
            table[name] = value
        try:
            point = kind.model_validate(data)
        except ValidationError:
            place = ", ".join(f"{axis.key} = {value:g}" for axis, value in zip(axes, values, strict=True))
            point = validated(kind, stated, f"sweep point ({place})")
        yield values, point


def _holder(data: Any, path: KeyPath) -> tuple[Any, str | int]:
    """The table or list at the end of a path, and the last step; missing tables are added."""
    for step, ahead in itertools.pairwise(path):
        data = data.setdefault(step, {}) if isinstance(step, str) and isinstance(ahead, str) else data[step]
    return data, path[-1]


def _listing(values: Any) -> str:
    text = ", ".join(f"{value:g}" if isinstance(value, float) else repr(value) for value in values)
    return text if len(text) <= 60 else text[:57] + "..."
