"""A roller bearing simulated at every point of a duty: figures there, the worst of them, and the life over the duty.

A point that cannot go on is a record with the reason, and the others go on.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rbdyn.base.blocks import Column, Sheet
from rbdyn.base.estimate import errors_of_differences
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.files import versions
from rbdyn.base.notes import Note, Notes, merged
from rbdyn.base.records import OverPoints, Record, derived, finite, keyed, nullable
from rbdyn.base.words import Notice, named, part_of
from rbdyn.dynamics.ensemble import Reporter, log, plan_of, threads_of
from rbdyn.dynamics.figures import FIGURES
from rbdyn.dynamics.part_figures import load_case
from rbdyn.dynamics.simulate import simulate
from rbdyn.life import ROLLER_EXPONENT, DutyLifeFigures, duty_life, life_notes, life_sheet
from rbdyn.result import (
    LeastClearance,
    Quantity,
    SavedRecord,
    SimulationResult,
    arrays_of,
    cage_column,
    figure_columns,
    full_status,
)
from rbdyn.scene import Scene, rollers_only
from rbdyn.scene.duty import AMBIENT, DutyPoint, duty_scenes, read_duty, shares_of_time, starting
from rbdyn.scene.thermal import simulated_scene
from rbdyn.thermal.network import NODES
from rbdyn.verdict.orbits import CageVerdict

# By figure, how much worse a larger value is; none of figures of which neither end is bad.
BADNESS: dict[str, Callable[[float], float]] = {"largest": float, "least": lambda value: -value, "farthest from 0": abs}
WORST = {figure.key: BADNESS[figure.worst] for figure in FIGURES if figure.worst in BADNESS}


class PointStart(Record):
    """How the machine comes to a point from an ``origin``, "ambient" or another point; other fields as of ``StartResult``."""

    origin: str = keyed("from")
    status: str
    radial_um: LeastClearance
    guide_um: LeastClearance | None
    pocket_um: LeastClearance | None
    temperature_difference_K: Quantity  # noqa: N815
    time_to_steady_s: float | None


class SimulatedPoint(Record):
    """A point of the duty: its share of the time, speed and load, and what came of it.

    ``figures``: by name, those of the parts included; empty where ``status`` says why there are none. ``L10_h``: life of ISO/TS 16281
    if the machine ran at this point alone, None where it has no end or is unknown. ``damage_share``: share of the damage over the
    duty. ``start``: how the machine comes to the point, where the duty states from which state.
    ``verdict``: class of the cage by its orbit, None where the scene leaves it out.
    """

    name: str
    share: float
    inner_speed_rpm: float
    radial_load_N: float  # noqa: N815
    status: str
    figures: dict[str, Quantity]
    L10_h: float | None
    damage_share: float | None
    start: PointStart | None = None
    verdict: CageVerdict | None = nullable(default=None)


class Worst(Record):
    """The worst value of a figure over the duty, its point, and the other points that it is not told apart from by its error."""

    point: str
    value: float
    not_told_apart: tuple[str, ...]


class DutySimulation(OverPoints, SavedRecord, kw_only=True):
    """A bearing at each point of a duty; ``life``: over the duty, None where a point failed; ``worst``: by name of the figure."""

    FORMAT = "rbdyn.duty/1"
    WHAT = "simulation over a duty"
    status: str = derived(lambda self: self.count_failed())
    points: tuple[SimulatedPoint, ...]
    worst: dict[str, Worst]
    life: DutyLifeFigures | None
    notes: Notes
    wall_s: float = keyed("cost", "wall_s")
    seed: int
    versions: dict[str, str]
    scene: dict[str, Any]

    @property
    def sheet(self) -> Sheet[SimulatedPoint]:
        """A row a point; figures with their 95 % errors, units in the names."""
        return points_sheet(self.points, dict.fromkeys(name for point in self.points for name in point.figures))


# Columns of points that a machine comes to from a stated state.
START_COLUMNS: tuple[Column[Any], ...] = (
    Column(
        "start_from",
        at=("start", "origin"),
        meaning="state from which the machine comes to the point, and how that ends",
    ),
    Column("start_status", at=("start", "status")),
)


def points_sheet(points: Sequence[SimulatedPoint], figures: Iterable[str]) -> Sheet[SimulatedPoint]:
    """A row a point, with its ``figures``."""
    status: Column[Any] = Column("status", meaning="ok, or why the point failed")
    place, life = (life_sheet(points).columns[part] for part in (slice(4), slice(4, None)))
    starts = START_COLUMNS if not points or any(point.start for point in points) else ()
    columns = (*place, status, *life, *starts, cage_column(), *figure_columns(figures))
    return Sheet(
        "", columns, points, file="points.csv", content="One row per point of the duty, of `rbdyn simulate --duty`."
    )


def simulate_duty(
    scene: Scene | Path | str,
    duty: Sequence[DutyPoint] | Path | str,
    workers: int | None = None,
    progress: Reporter = None,
    target: float | None = None,
    notice: Notice = log,
) -> DutySimulation:
    """Simulate a scene at each point of a duty, in its order; a path is a file that ``rbdyn.scene.duty.read_duty`` reads.

    ``workers``, ``progress``, ``target``, ``notice``: as of ``rbdyn.simulate``, for each point. Raises InputError with the faults of
    all points before any runs, KeyboardInterrupt.
    """
    scene, source = rollers_only(scene), "duty"
    if isinstance(duty, str | Path):
        source, duty = str(duty), read_duty(Path(duty))
    scenes, started = duty_scenes(scene, duty, source), time.perf_counter()
    if notice is not None and target is None:
        notice(plan_of(scenes[0], threads_of(workers), len(scenes)))
    results = _results(duty, scenes, partial(simulate, workers=workers, target=target), progress, notice)
    shares = shares_of_time(duty)
    hot = [_hot(at_point, result) for at_point, result in zip(scenes, results.values(), strict=True)]
    cases = [None if heat is None else load_case(heat, share) for heat, share in zip(hot, shares, strict=True)]
    known = [case for case in cases if case is not None]
    life = duty_life(known, ROLLER_EXPONENT) if len(known) == len(cases) else None
    short = () if life is None else life_notes(life.hours, sum(point.share for point in duty))
    points = tuple(
        SimulatedPoint(
            point.name,
            share,
            at_point.operation.inner_speed_rpm,
            at_point.operation.radial_load_N,
            result if isinstance(result, str) else full_status(result),
            {} if isinstance(result, str) else result.responses,
            None if case is None else finite(case.hours),
            None if life is None else life.damage[place],
            None if point.origin is None or isinstance(result, str) else _point_start(point.origin, result),
            None if isinstance(result, str) else result.verdict,
        )
        for place, (point, share, at_point, result, case) in enumerate(
            zip(duty, shares, scenes, results.values(), cases, strict=True)
        )
    )
    return DutySimulation(
        points=points,
        worst=worst_of({point.name: point.figures for point in points if point.status == "ok"}),
        life=None if life is None else life.figures,
        notes=(*short, *_notes(results)),
        wall_s=time.perf_counter() - started,
        seed=scene.numerics.seed,
        versions=versions(),
        scene=scene.model_dump(mode="json"),
    )


def _results(
    duty: Sequence[DutyPoint],
    scenes: Sequence[Scene],
    run: Callable[..., SimulationResult],
    progress: Reporter,
    notice: Notice,
) -> dict[str, SimulationResult | str]:
    """Result or fault of each point, by name in the order of the duty. Those that start from another point run after the others."""
    at = {point.name: scene for point, scene in zip(duty, scenes, strict=True)}
    found: dict[str, SimulationResult | str] = {}
    ordered = sorted(duty, key=lambda point: point.origin not in (None, AMBIENT))
    for place, point in enumerate(ordered):
        # The time of the first point tells that of the others.
        words = named(notice, f"{point.name}, 1 of {len(duty)} points") if place == 0 else None
        try:
            scene = at[point.name]
            if point.origin is not None:
                parts = None if point.origin == AMBIENT else _parts(point.origin, at, found, run)
                scene = starting(scene, parts)
            found[point.name] = run(scene, progress=part_of(progress, place, len(duty)), notice=words)
        except (InputError, RunError) as error:
            found[point.name] = f"failed: {error}"
    return {point.name: found[point.name] for point in duty}


def _parts(
    origin: str,
    at: Mapping[str, Scene],
    found: Mapping[str, SimulationResult | str],
    run: Callable[..., SimulationResult],
) -> list[float]:
    """Steady temperatures of oil, rings, rollers, housing and shaft at another point [C]. Raises RunError where it has none."""
    from rbdyn.dynamics.temperatures import short

    # Points that start from each other: the first one takes the other from short runs.
    result = found[origin] if origin in found else run(short(at[origin].changed({"thermal.start": None})), notice=None)
    if (
        isinstance(result, str)
        or result.thermal is None
        or result.thermal.status != "steady"
        or not result.temperatures_C
    ):
        raise RunError(f"the point starts from {origin!r}, which has no steady temperatures")
    nodes = {node: figure.value for node, figure in result.temperatures_C.items()}
    return [*(nodes[node] for node in NODES), nodes["outer"], nodes["inner"]]


def _point_start(origin: str, result: SimulationResult) -> PointStart | None:
    """How the machine comes to a point; None where its steady state failed."""
    start = result.start
    if start is None:
        return None
    status = f"{start.status}: {start.reason}" if start.reason else start.status
    plays = start.radial_um, start.guide_um, start.pocket_um
    return PointStart(origin, status, *plays, start.temperature_difference_K, start.time_to_steady_s)


def worst_of(points: Mapping[str, Mapping[str, Quantity]]) -> dict[str, Worst]:
    """The worst point of each figure that all points have; none of those that are equal everywhere, and none of one point."""
    found = {}
    for name in next(iter(points.values()), {}):
        figures = {point: listed[name] for point, listed in points.items() if name in listed}
        values = {figure.value for figure in figures.values()}
        if name not in WORST or len(figures) < len(points) or len(values) < 2:
            continue
        badness = {point: WORST[name](figure.value) for point, figure in figures.items()}
        worst = max(badness, key=lambda point: badness[point])
        others = [point for point in figures if point != worst]
        pair = [figures[worst]] * len(others), [figures[point] for point in others]
        error, _ = errors_of_differences(*(arrays_of(each) for each in pair))
        apart = [
            abs(figures[worst].value - figures[point].value) > half for point, half in zip(others, error, strict=True)
        ]
        alike = tuple(point for point, is_apart in zip(others, apart, strict=True) if not is_apart)
        found[name] = Worst(worst, figures[worst].value, alike)
    return found


def _hot(scene: Scene, result: SimulationResult | str) -> Scene | None:
    """The scene at the temperatures of its run; None where it has a heat balance and no steady state."""
    if isinstance(result, str):
        return scene if scene.thermal is None else None
    return simulated_scene(result) if result.status == "ok" else None


def _notes(results: Mapping[str, SimulationResult | str]) -> Notes:
    """Points without a result, with the reason; then the notes of the others, those of all points once."""
    ran = {name: result for name, result in results.items() if isinstance(result, SimulationResult)}
    reasons = {name: result for name, result in results.items() if isinstance(result, str)}
    return (
        *(Note("point", f"{name} failed: {reason.removeprefix('failed: ')}") for name, reason in reasons.items()),
        *merged({name: result.notes for name, result in ran.items()}, "at {}"),
    )
