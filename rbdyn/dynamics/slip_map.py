"""Cage slip, loss, whirl and impact over speed and load: where a bearing skids.

Every point is the same scene at another inner speed and radial load, with [thermal] at its own steady temperatures. A point that cannot go on becomes a record of the
cause, and the others go on. A file may keep finished points, so that an interrupted map goes on there.
"""

import time
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from rbdyn.base.blocks import Column, Sheet
from rbdyn.base.faults import MOST_VALUES, InputError, RunError
from rbdyn.base.files import Checkpoint, code_version, run_key, versions
from rbdyn.base.notes import Notes, status_of
from rbdyn.base.records import Record, derived, keyed, nullable, spread
from rbdyn.base.words import Notice, counted
from rbdyn.contact.hertz_line import ROLLERS, pressure_notes
from rbdyn.dynamics.cage_verdict import verdict_of
from rbdyn.dynamics.ensemble import Outcome, Pace, Reporter, Stop, in_turn, keys_of, log, plan_of, run_all, threads_of
from rbdyn.dynamics.figures import DAMAGE, PANELS
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.validity import heat_notes, limit_notes
from rbdyn.dynamics.part_figures import part_figures
from rbdyn.dynamics.recording import run_one
from rbdyn.dynamics.run import prepare
from rbdyn.dynamics.simulate import steady_scene
from rbdyn.dynamics.statistics.error_bars import after_transient, quantities
from rbdyn.dynamics.statistics.metrics import Companions, companions_of
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.result import Quantity, cage_column, figure_columns
from rbdyn.scene import Scene
from rbdyn.verdict.replicates import CageVerdict

if TYPE_CHECKING:
    import pandas as pd

FORMAT = "rbdyn.map/1"
RACES = ("inner", "outer")


class Point(Record):
    """One speed and load; ``figures`` is empty where ``status`` shows why the run could not go on. ``notes``: on its limits.
    ``verdict``: class of the cage by its orbit, None without one."""

    inner_speed_rpm: float
    radial_load_N: float  # noqa: N815
    status: str
    figures: dict[str, Quantity] = spread()
    power_gap: float | None = keyed("power_balance", "relative_gap")
    notes: Notes | None = None
    verdict: CageVerdict | None = nullable(default=None)


def map_sheet(points: Sequence[Point], figures: Iterable[str] = ()) -> Sheet[Point]:
    """A row a point, with its ``figures`` and their errors."""
    columns: tuple[Column[Point], ...] = (
        Column("inner_speed_rpm", meaning="operating point"),
        Column("radial_load_N"),
        *figure_columns(figures or dict.fromkeys(name for point in points for name in point.figures)),
        cage_column(),
        Column("power_gap", meaning="share of the power that the balance does not account for"),
        Column("status", meaning="ok, or why the point failed"),
    )
    return Sheet("", columns, points, file="map.csv", content="One row per speed and load of `rbdyn map`.")


class SlipMap(Record):
    """Points in rows of rising load, speeds rising in each row; ``wall_s``: their wall time."""

    format: str = derived(lambda self: FORMAT)
    status: str = derived(
        lambda self: f"{len(self.failed)} of {counted(len(self.points), 'point')} failed" if self.failed else "ok"
    )
    speeds_rpm: tuple[float, ...]
    loads_N: tuple[float, ...]  # noqa: N815
    points: tuple[Point, ...]
    wall_s: float = keyed("cost", "wall_s")
    seed: int
    versions: dict[str, str] = derived(lambda self: versions())
    notes: Notes = derived(lambda self: self._notes())

    @property
    def failed(self) -> list[Point]:
        """Points without figures, or with those of no bearing."""
        return [point for point in self.points if point.status != "ok"]

    def _notes(self) -> Notes:
        """Notes of the points, each code once, with the number of its points and the last of them."""
        last = {note.code: (note, point) for point in self.points for note in point.notes or ()}
        count = Counter(code for point in self.points for code in {note.code for note in point.notes or ()})
        return tuple(
            note.about(
                f"at {point.inner_speed_rpm:g} rpm and {point.radial_load_N:g} N; at {count[code]} of {len(self.points)} points"
            )
            for code, (note, point) in last.items()
        )

    def table(self) -> "pd.DataFrame":
        """A row a point; figures with their 95 % errors."""
        return map_sheet(self.points).frame

    @property
    def cages(self) -> list[list[str]]:
        """Class of the cage in rows of rising load with its replicates, "failed" without one; empty where the scene leaves it out."""
        cells = ["failed" if point.verdict is None else point.verdict.cell for point in self.points]
        columns = len(self.speeds_rpm)
        judged = any(point.verdict for point in self.points)
        return [cells[start : start + columns] for start in range(0, len(cells), columns)] if judged else []

    def grid(self, figure: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Values of a figure, shape (loads, speeds); NaN where a point failed."""
        values = [point.figures[figure].value if point.figures else np.nan for point in self.points]
        return np.array(values).reshape(len(self.loads_N), len(self.speeds_rpm))


@dataclass(frozen=True)
class Job:
    """A run to make: a replicate of a point, or a companion of it."""

    series: "Series"
    replicate: int
    companions: Companions | None

    def __call__(self) -> Replicate:
        """Make it. Raises RunError or CancelledError."""
        point = self.series
        return run_one(point.scene, point.bearing, self.replicate, self.companions, point.stop, point.pace)


class Series:
    """Runs of the point at ``place``: its replicates, then companions by their steps; no companions where a replicate failed.

    ``waiting``: runs begun that have not ended; ``remaining``: companions that have not begun.
    """

    def __init__(self, place: int, scene: Scene, bearing: RollerBearing, stop: Stop, pace: Pace) -> None:
        self.place, self.scene, self.bearing, self.stop, self.pace = place, scene, bearing, stop, pace
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
        self.plan = companions_of(self.scene, self._ended(None))
        self.waiting, self.remaining = self.remaining, 0
        return [Job(self, replicate, self.plan) for replicate in range(self.waiting)]

    def point(self) -> Point:
        """Figures from the runs, or why there are none."""
        speed, load = self.scene.operation.inner_speed_rpm, self.scene.operation.radial_load_N
        if self.faults:
            return Point(speed, load, f"failed: {min(self.faults)}", {}, None)
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
        return Point(speed, load, status_of(notes), shown, power_gap, notes or None, verdict_of(self.scene, runs))

    def _ended(self, plan: Companions | None) -> list[Replicate]:
        return [run for (of, _), run in sorted(self.runs.items(), key=lambda item: item[0][1]) if of == plan]


def slip_map(
    scene: Scene,
    speeds_rpm: Sequence[float],
    loads_N: Sequence[float],  # noqa: N803
    workers: int | None = None,
    progress: Reporter = None,
    kept_in: Path | None = None,
    notice: Notice = log,
) -> SlipMap:
    """Run the scene at every pair of inner speed and radial load, except for points in the file ``kept_in``.

    ``notice``: called with a sentence on long runs, as in ``simulate``.
    Raises InputError where a speed or load is impossible or the scene has a schedule, KeyboardInterrupt on Ctrl-C.
    """
    if scene.operation.schedule is not None:
        raise InputError(["operation.schedule: a map sets speed and load itself; take the schedule away"])
    if (count := len(speeds_rpm) * len(loads_N)) > MOST_VALUES:
        raise InputError([f"--speed, --load: {count} points are more than the {MOST_VALUES} kept at once; take fewer"])
    scenes = [_scene_at(scene, speed, load) for load in loads_N for speed in speeds_rpm]
    store, version = Checkpoint(kept_in), code_version("rbdyn.dynamics.simulate", __name__)
    keys = [run_key(point.model_dump(mode="json"), version) for point in scenes]
    points = {place: Point.from_dict(record) for place, key in enumerate(keys) if (record := store.get(key))}
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
    pace = Pace(notice, turns, first, threads, ["the values of --speed and --load", *keys_of(scene)])
    for place, point in enumerate(scenes if scene.thermal is not None else ()):
        hot = _at_temperatures(point, workers, stop, pace) if place not in points else point
        if isinstance(hot, str):
            points[place] = Point(
                point.operation.inner_speed_rpm, point.operation.radial_load_N, f"failed: {hot}", {}, None
            )
            store.put(keys[place], points[place].as_dict())
        else:
            scenes[place] = hot
    bearings = {place: roller_bearing(point) for place, point in enumerate(scenes) if place not in points}
    for place in list(bearings)[:1]:
        prepare(scenes[place], bearings[place])
    total, ended = len(bearings) * (numerics.replicates + numerics.companions), 0
    series = [Series(place, scenes[place], bearings[place], stop, pace) for place in bearings]

    def collect(outcome: Outcome[Replicate]) -> list[Job]:
        nonlocal ended
        point = cast(Job, outcome.run).series
        more = point.take(outcome)
        ended += 1
        if not point.waiting:
            ended += point.remaining
            points[point.place] = point.point()
            store.put(keys[point.place], points[point.place].as_dict())
        if progress is not None:
            progress(ended, total)
        return more

    started = time.perf_counter()
    run_all((job for one in series for job in one.replicates()), workers, stop, collect)
    wall_s = time.perf_counter() - started
    ordered = tuple(points[place] for place in range(len(scenes)))
    return SlipMap(tuple(speeds_rpm), tuple(loads_N), ordered, wall_s, scene.numerics.seed)


def _at_temperatures(scene: Scene, workers: int | None, stop: Stop, pace: Pace) -> Scene | str:
    """The scene at its steady temperatures, or why it has none."""
    try:
        return steady_scene(scene, workers, stop, pace)
    except (InputError, RunError) as error:
        return str(error)


def _scene_at(scene: Scene, speed: float, load: float) -> Scene:
    data = scene.model_dump(mode="json", exclude_none=True)
    data["operation"] |= {"inner_speed_rpm": speed, "radial_load_N": load}
    return Scene.from_dict(data, f"--speed {speed:g} --load {load:g}")
