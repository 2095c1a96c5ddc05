"""Cage slip, loss, whirl, impact and class of the cage over speed and load, or any two keys: where a bearing skids, where its cage is held.

Every point is the same scene with other values of two keys, with [thermal] at its own steady temperatures. A point that cannot go on becomes a record of the
cause, and the others go on. A file may keep finished points, so that an interrupted map goes on there.
"""

import itertools
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from rbdyn.base.blocks import Column, Sheet
from rbdyn.base.faults import MOST_VALUES, InputError, RunError, refuse
from rbdyn.base.files import Checkpoint, code_version, run_key, versions
from rbdyn.base.notes import Notes
from rbdyn.base.records import OverPoints, Record, derived, keyed, nullable, spread
from rbdyn.base.words import Notice, all_of, quantity
from rbdyn.contact.hertz_line import ROLLERS, pressure_notes
from rbdyn.dynamics.cage_verdict import verdict_of
from rbdyn.dynamics.ensemble import Outcome, Pace, Reporter, Stop, in_turn, keys_of, log, plan_of, run_all, threads_of
from rbdyn.dynamics.figures import DAMAGE, PANELS
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.validity import heat_notes, limit_notes, status
from rbdyn.dynamics.part_figures import part_figures
from rbdyn.dynamics.recording import recording_of
from rbdyn.dynamics.run import prepare
from rbdyn.dynamics.simulate import steady_scene
from rbdyn.dynamics.statistics.error_bars import after_transient, quantities
from rbdyn.dynamics.statistics.metrics import Companions, companions_of
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.result import Quantity, cage_column, figure_columns
from rbdyn.scene import Scene
from rbdyn.scene.duty import AXES
from rbdyn.scene.thermal import first_guess_faults
from rbdyn.verdict.orbits import CageVerdict

FORMAT = "rbdyn.map/1"
RACES = ("inner", "outer")
# Keys of a point besides speed and load, with their values; None without any.
At = dict[str, float] | None


class Point(Record):
    """One speed and load; ``figures`` is empty where ``status`` shows why the run could not go on. ``notes``: on its limits.
    ``verdict``: class of the cage by its orbit, None without one; ``at``: other keys that the map varies, with their values."""

    inner_speed_rpm: float
    radial_load_N: float  # noqa: N815
    status: str
    figures: dict[str, Quantity] = spread()
    power_gap: float | None = keyed("power_balance", "relative_gap")
    notes: Notes | None = None
    verdict: CageVerdict | None = nullable(default=None)
    at: dict[str, float] | None = None

    def place(self, keys: Iterable[str]) -> str:
        """Values of keys of the map, such as "24000 rpm and 1300 N"."""
        places = dict(zip(AXES, (self.inner_speed_rpm, self.radial_load_N), strict=True)) | (self.at or {})
        return all_of(axis_value(key, places[key]) for key in keys)


def axis_value(key: str, value: float) -> str:
    """ "24000 rpm", or "pocket friction 0.1" where a key has no unit."""
    words, unit = quantity(key.rpartition(".")[2])
    return f"{value:g} {unit}" if unit else f"{words} {value:g}"


def map_sheet(points: Sequence[Point], figures: Iterable[str] = ()) -> Sheet[Point]:
    """A row a point, with its ``figures`` and their errors."""
    columns: tuple[Column[Point], ...] = (
        Column("inner_speed_rpm", meaning="operating point"),
        Column("radial_load_N"),
        *(Column[Point](key, at=("at", key)) for key in (points[0].at if points else None) or ()),
        *figure_columns(figures or dict.fromkeys(name for point in points for name in point.figures)),
        cage_column(),
        Column(
            "cage_share",
            at=lambda point: point.verdict and point.verdict.largest_share,
            meaning="share of bearings alike that have the commonest class of the replicates",
        ),
        Column("power_gap", meaning="share of the power that the balance does not account for"),
        Column("status", meaning="ok, or why the point failed"),
    )
    return Sheet(
        "",
        columns,
        points,
        file="map.csv",
        content="One row per point of `rbdyn map`; other keys that it varies have columns of their own.",
    )


class SlipMap(OverPoints, Record):
    """Points in rows of rising values of the second of the ``axes``, values of the first rising in each row; ``wall_s``: their wall time.

    ``axes``: values by key, speed as the first and load as the second where they are varied; ``speeds_rpm`` and ``loads_N`` state them again.
    """

    format: str = derived(lambda self: FORMAT)
    status: str = derived(lambda self: self.count_failed())
    axes: dict[str, tuple[float, ...]]
    speeds_rpm: tuple[float, ...] | None = derived(lambda self: self.axes.get(AXES[0]))
    loads_N: tuple[float, ...] | None = derived(lambda self: self.axes.get(AXES[1]))  # noqa: N815
    points: tuple[Point, ...]
    wall_s: float = keyed("cost", "wall_s")
    seed: int
    versions: dict[str, str] = derived(lambda self: versions())
    notes: Notes = derived(lambda self: self._notes())

    def _notes(self) -> Notes:
        """Notes of the points, each code once, with the number of its points and the last of them."""
        last = {note.code: (note, point) for point in self.points for note in point.notes or ()}
        count = Counter(code for point in self.points for code in {note.code for note in point.notes or ()})
        return tuple(
            note.about(f"at {point.place(self.axes)}; at {count[code]} of {len(self.points)} points")
            for code, (note, point) in last.items()
        )

    @property
    def sheet(self) -> Sheet[Point]:
        """A row a point; figures with their 95 % errors."""
        return map_sheet(self.points)

    @property
    def columns(self) -> tuple[float, ...]:
        """Values of the first axis."""
        return next(iter(self.axes.values()))

    @property
    def rows(self) -> tuple[float, ...]:
        """Values of the second axis."""
        return [*self.axes.values()][1]

    @property
    def cages(self) -> list[list[str]]:
        """Class of the cage in rows of the second axis with its replicates, "failed" without one; empty where the scene leaves it out."""
        cells = ["failed" if point.verdict is None else point.verdict.cell for point in self.points]
        columns = len(self.columns)
        judged = any(point.verdict for point in self.points)
        return [cells[start : start + columns] for start in range(0, len(cells), columns)] if judged else []

    def grid(self, figure: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Values of a figure, shape (rows, columns); NaN where a point failed."""
        values = [point.figures[figure].value if point.figures else np.nan for point in self.points]
        return np.array(values).reshape(len(self.rows), len(self.columns))


class Job(Record):
    """A run to make: a replicate of a point, or a companion of it."""

    series: "Series"
    replicate: int
    companions: Companions | None

    def __call__(self) -> Replicate:
        """Make it. Raises RunError or CancelledError."""
        point = self.series
        recording = recording_of(point.scene, point.bearing, point.pace, self.replicate, self.companions, point.stop)
        return recording.to(point.scene.numerics.turns)


class Series:
    """Runs of the point at ``place``: its replicates, then companions by their steps; no companions where a replicate failed.

    ``at``: keys of the point besides speed and load; ``waiting``: runs begun that have not ended; ``remaining``: companions that have not begun.
    """

    def __init__(self, place: int, at: At, scene: Scene, stop: Stop, pace: Pace) -> None:
        self.place, self.at, self.scene, self.stop, self.pace = place, at, scene, stop, pace
        self.bearing = roller_bearing(scene)
        self.waiting, self.remaining = scene.numerics.replicates, scene.numerics.companions
        self.plan: Companions | None = None
        self.runs: dict[tuple[Companions | None, int], Replicate] = {}
        self.faults: list[str] = []

    def replicates(self) -> list[Job]:
        """The runs to begin with."""
        return [Job(self, replicate, None) for replicate in range(self.scene.numerics.replicates)]

    def take(self, outcome: Outcome[Replicate]) -> list[Job]:
        """Take the outcome of a run; returns the runs to make next."""
        job = cast(Job, outcome.run)
        if outcome.fault is None:
            self.runs[job.companions, job.replicate] = outcome.result()
        else:
            self.faults.append(str(outcome.fault))
        self.waiting -= 1
        if self.waiting or self.faults or not self.remaining:
            return []
        ended = self._ended(None)
        self.plan = companions_of(self.scene, ended)
        self.waiting, self.remaining = self.remaining, 0
        return [Job(self, replicate, self.plan) for replicate in range(self.waiting)]

    def point(self) -> Point:
        """Figures from the runs, or why there are none."""
        if self.faults:
            return failed_point(self.scene, self.at, min(self.faults))
        share = 0.0 if self.plan is None else self.plan.share
        runs, companions, _ = after_transient(
            self.scene, self._ended(None), self._ended(self.plan) if self.plan else []
        )
        figures = quantities(self.scene, runs, companions, share)
        power_gap = max(run.power_gap for run in runs)
        parts = part_figures(self.scene, runs, figures)
        peaks = {race: figure.value for race in RACES if (figure := parts.get(f"{race}_max_pressure_MPa"))}
        notes = (
            *limit_notes(self.scene),
            *(note for race, peak in peaks.items() for note in pressure_notes(1e6 * peak, ROLLERS, race)),
            *heat_notes(self.scene, figures["power_loss_W"].value),
        )
        damage = {figure.key: figures[figure.key] for figure in DAMAGE if figure.key in figures}
        shown = {panel.key: figures[panel.key] for panel in PANELS} | damage | parts
        speed, load, found = *_place(self.scene), verdict_of(self.scene, runs)
        return Point(speed, load, status(self.scene, notes), shown, power_gap, notes or None, found, self.at)

    def _ended(self, plan: Companions | None) -> list[Replicate]:
        return [run for (owner, _), run in sorted(self.runs.items(), key=lambda item: item[0][1]) if owner == plan]


def slip_map(
    scene: Scene,
    columns: Sequence[float],
    rows: Sequence[float],
    workers: int | None = None,
    progress: Reporter = None,
    kept_in: Path | None = None,
    notice: Notice = log,
    keys: tuple[str, str] = AXES,
) -> SlipMap:
    """Run the scene at every pair of values of two ``keys``, inner speed and radial load by default, except for points in the file ``kept_in``.

    ``notice``: called with a sentence on long runs, as in ``simulate``.
    Raises InputError where a key or a value is impossible or the scene has a schedule, KeyboardInterrupt on Ctrl-C.
    """
    scenes, at = _scenes(scene, columns, rows, keys)
    store, version = Checkpoint(kept_in), code_version("rbdyn.dynamics.simulate", __name__)
    digests = [run_key(point.model_dump(mode="json"), version) for point in scenes]
    points = {place: Point.from_dict(record) for place, key in enumerate(digests) if (record := store.get(key))}
    numerics, stop, threads = scene.numerics, Stop(), threads_of(workers)
    missing = len(scenes) - len(points)
    # Threads that become free take runs of the next point.
    turns, first = missing * in_turn(scene) / threads, numerics.warm_up_turns + numerics.turns
    if scene.thermal is not None:
        from rbdyn.dynamics.temperatures import short_turns

        heat, first = short_turns(scene, threads)
        turns += missing * heat
    if notice is not None:
        notice(plan_of(scene, threads, missing))
    pace = Pace(notice, turns, first, threads, ["the values of the map's axes", *keys_of(scene)])
    for place, point in enumerate(scenes if scene.thermal is not None else ()):
        hot = _at_temperatures(point, workers, stop, pace) if place not in points else point
        if isinstance(hot, str):
            points[place] = failed_point(point, at[place], hot)
            store.put(digests[place], points[place].as_dict())
        else:
            scenes[place] = hot
    series = [Series(place, at[place], point, stop, pace) for place, point in enumerate(scenes) if place not in points]
    for plan in series[:1]:
        prepare(plan.scene, plan.bearing)
    total, ended = len(series) * (numerics.replicates + numerics.companions), 0

    def collect(outcome: Outcome[Replicate]) -> list[Job]:
        nonlocal ended
        point = cast(Job, outcome.run).series
        more = point.take(outcome)
        ended += 1
        if not point.waiting:
            ended += point.remaining
            points[point.place] = point.point()
            store.put(digests[point.place], points[point.place].as_dict())
        if progress is not None:
            progress(ended, total)
        return more

    started = time.perf_counter()
    run_all((job for member in series for job in member.replicates()), workers, stop, collect)
    wall_s = time.perf_counter() - started
    ordered = tuple(points[place] for place in range(len(scenes)))
    axes = dict(zip(keys, (tuple(columns), tuple(rows)), strict=True))
    return SlipMap(axes, ordered, wall_s, scene.numerics.seed)


def _scenes(
    scene: Scene, columns: Sequence[float], rows: Sequence[float], keys: tuple[str, str]
) -> tuple[list[Scene], list[At]]:
    """The scene of each point, and its keys besides speed and load, columns rising in each row. Raises InputError."""
    if scene.operation.schedule is not None:
        raise InputError("operation.schedule: a map sets speed and load itself; take the schedule away")
    refuse(first_guess_faults(scene.thermal, scene.lubricant, keys))
    if (count := len(columns) * len(rows)) > MOST_VALUES:
        raise InputError(f"{', '.join(keys)}: {count} points are more than the {MOST_VALUES} kept at once; take fewer")
    places = [dict(zip(keys, place, strict=True)) for place in itertools.product(columns, rows)]
    places.sort(key=lambda place: place[keys[1]])
    scenes = [scene.overridden([f"{key}={value:.17g}" for key, value in place.items()]) for place in places]
    at: list[At] = [{key: value for key, value in place.items() if key not in AXES} or None for place in places]
    return scenes, at


def _at_temperatures(scene: Scene, workers: int | None, stop: Stop, pace: Pace) -> Scene | str:
    """The scene at its steady temperatures, or why it has none."""
    try:
        return steady_scene(scene, workers, stop, pace)
    except (InputError, RunError) as error:
        return str(error)


def failed_point(scene: Scene, at: At, fault: str) -> Point:
    """A point that cannot go on."""
    return Point(*_place(scene), f"failed: {fault}", {}, None, at=at)


def _place(scene: Scene) -> tuple[float, float]:
    return scene.operation.inner_speed_rpm, scene.operation.radial_load_N
