"""Cage slip, loss, whirl and impact over speed and load: where a bearing skids.

Every point is the same scene at another inner speed and radial load. A point that cannot go on is kept as a record of
its cause, and the others go on. Finished points may be kept in a file, so that an interrupted map goes on there.
"""

import time
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.cli.ranges import MOST_VALUES
from rbdyn.dynamics.ensemble import Ended, Reporter, Stop, run_all
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_replicate
from rbdyn.dynamics.run import prepare
from rbdyn.dynamics.statistics.bias import companion_tolerance
from rbdyn.dynamics.statistics.error_bars import after_transient, quantities
from rbdyn.dynamics.statistics.metrics import Replicate
from rbdyn.faults import InputError
from rbdyn.records.kept import Kept, code_version, run_key
from rbdyn.records.record import Record, derived, keyed, spread
from rbdyn.records.words import counted
from rbdyn.result import Quantity, versions
from rbdyn.scene import Scene

if TYPE_CHECKING:
    import pandas as pd

FORMAT = "rbdyn.map/1"
FIGURES = ("cage_slip", "power_loss_W", "impact_force_N", "whirl_deviation_ratio")
# Name of the finished points in the folder of a map.
POINTS = "map_points.jsonl"


class Point(Record):
    """One speed and load; ``figures`` is empty where ``status`` tells why the run could not go on."""

    inner_speed_rpm: float
    radial_load_N: float  # noqa: N815
    status: str
    figures: dict[str, Quantity] = spread()
    power_gap: float | None = keyed("power_balance", "relative_gap")


class SlipMap(Record):
    """Points in rows of rising load, speeds rising within; ``wall_s`` is what they took."""

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

    @property
    def failed(self) -> list[Point]:
        """Points without figures."""
        return [point for point in self.points if not point.figures]

    def table(self) -> "pd.DataFrame":
        """A row a point; figures with their 95 % errors."""
        import pandas as pd

        rows = []
        for point in self.points:
            row: dict[str, Any] = {"inner_speed_rpm": point.inner_speed_rpm, "radial_load_N": point.radial_load_N}
            for name, figure in point.figures.items():
                row |= {
                    name: figure.value,
                    f"{name}_statistical_error": figure.statistical_error,
                    f"{name}_numerical_error": figure.numerical_error,
                }
            rows.append(row | {"power_gap": point.power_gap, "status": point.status})
        return pd.DataFrame(rows)

    def grid(self, figure: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Values of a figure, shape (loads, speeds); NaN where a point failed."""
        values = [point.figures[figure].value if point.figures else np.nan for point in self.points]
        return np.array(values).reshape(len(self.loads_N), len(self.speeds_rpm))


def slip_map(
    scene: Scene,
    speeds_rpm: Sequence[float],
    loads_N: Sequence[float],  # noqa: N803
    workers: int | None = None,
    progress: Reporter = None,
    kept_in: Path | None = None,
) -> SlipMap:
    """Run the scene at every pair of inner speed and radial load; what lies in the file ``kept_in`` is not run again.

    Raises InputError where a speed or load is impossible or the scene has a schedule, KeyboardInterrupt on Ctrl-C.
    """
    if scene.operation.schedule is not None:
        raise InputError(["operation.schedule: a map sets speed and load itself; take the schedule away"])
    if (count := len(speeds_rpm) * len(loads_N)) > MOST_VALUES:
        raise InputError([f"--speed, --load: {count} points are more than the {MOST_VALUES} kept at once; take fewer"])
    scenes = [_at(scene, speed, load) for load in loads_N for speed in speeds_rpm]
    kept, version = Kept(kept_in), code_version("rbdyn.dynamics.simulate", __name__)
    keys = [run_key(point.model_dump(mode="json"), version) for point in scenes]
    points = {place: Point.from_dict(record) for place, key in enumerate(keys) if (record := kept.get(key))}
    bearings = {place: roller_bearing(point) for place, point in enumerate(scenes) if place not in points}
    for place in list(bearings)[:1]:
        prepare(scenes[place], bearings[place])
    numerics = scene.numerics
    series = ((numerics.rtol, numerics.replicates), (companion_tolerance(numerics.rtol), numerics.companions))
    stop = Stop()
    tasks = [(place, rtol, replicate) for place in bearings for rtol, count in series for replicate in range(count)]
    waiting = Counter(place for place, _, _ in tasks)
    runs: dict[tuple[int, float, int], Replicate] = {}
    causes: dict[int, str] = {}
    done = 0

    def ended(one: Ended[Replicate]) -> None:
        nonlocal done
        done += 1
        place = tasks[one.place][0]
        if one.fault is None:
            runs[tasks[one.place]] = one.result()
        else:
            causes[place] = min(str(one.fault), causes.get(place, str(one.fault)))
        waiting[place] -= 1
        if not waiting[place]:
            cause = causes.get(place)
            whole = series if cause is None else [(rtol, 0) for rtol, _ in series]
            ours, theirs = ([runs.pop((place, rtol, i)) for i in range(count)] for rtol, count in whole)
            points[place] = _point(scenes[place], ours, theirs, cause)
            kept.put(keys[place], points[place].as_dict())
        if progress is not None:
            progress(done, len(tasks))

    started = time.perf_counter()
    work = [partial(run_replicate, scenes[place], bearings[place], i, rtol, stop) for place, rtol, i in tasks]
    run_all(work, workers, stop, ended)
    wall_s = time.perf_counter() - started
    ordered = tuple(points[place] for place in range(len(scenes)))
    return SlipMap(tuple(speeds_rpm), tuple(loads_N), ordered, wall_s, scene.numerics.seed)


def _at(scene: Scene, speed: float, load: float) -> Scene:
    data = scene.model_dump(mode="json", exclude_none=True)
    data["operation"] |= {"inner_speed_rpm": speed, "radial_load_N": load}
    return Scene.from_dict(data, f"--speed {speed:g} --load {load:g}")


def _point(scene: Scene, runs: list[Replicate], companions: list[Replicate], cause: str | None) -> Point:
    speed, load = scene.operation.inner_speed_rpm, scene.operation.radial_load_N
    if cause is not None:
        return Point(speed, load, f"failed: {cause}", {}, None)
    runs, companions, _ = after_transient(scene, runs, companions)
    found = quantities(scene, runs, companions)
    return Point(speed, load, "ok", {name: found[name] for name in FIGURES}, max(run.power_gap for run in runs))
