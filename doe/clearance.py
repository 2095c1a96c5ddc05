"""Simulations of scenes, and the responses of these.

It is the only module of this package that runs bearing simulations.
"""

import json
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from doe.duty import Run, Simulated, labelled_scenes, result_of
from doe.running.runner import AgendaKeeper, Engine, Ledger, Progress, RunOutcome, RunResult, run_points
from doe.running.store import STORE, Failure, Point, Store
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.files import code_version, run_key
from rbdyn.base.notes import LOST_CLEARANCE, verdict
from rbdyn.base.records import Record
from rbdyn.dynamics.figures import FIGURES
from rbdyn.result import SimulationResult, arrays_of
from rbdyn.scene import Scene
from rbdyn.scene.thermal import Temperatures, at_temperatures

if TYPE_CHECKING:
    from rbdyn.dynamics.ensemble import Stop
    from rbdyn.dynamics.motion import History

# Module of the simulation: its code decides whether a stored run is still valid.
SIMULATION = "rbdyn.dynamics.simulate"
# Offsets of seeds that no first design run has; the input sets are those of an uncertainty.
CONFIRMATION_SEEDS = 1_000_000
FURTHER_SEEDS = 2_000_000
INPUT_SEEDS = 3_000_000
ADAPTIVE_SEEDS = 4_000_000
CALIBRATION_SEEDS = 5_000_000
# Most turns of a drifting run of an adaptive search over those asked for; 8 cost twice as much without a better front.
ADAPTIVE_EXTENDED = 2.0
# Points of the orbit, frames and shaft turns of a motion in a report.
ORBIT_POINTS, FRAMES, PLAYED_TURNS = 2000, 300, 2.0


def responses_of(heats: bool) -> tuple[str, ...]:
    """Names of all figures that may be responses; ``heats``: whether a heat balance gives temperatures."""
    return tuple(figure.key for figure in FIGURES if figure.response and (heats or figure.kind != "temperature"))


def undeclared(data: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """Tables of a scene without its declared unknown inputs.

    Those of a heat balance state its first guess, because a viscosity that varies needs a temperature at which it holds.
    """
    tables = {table: keys for table, keys in data.items() if table != "uncertain"}
    if scene.thermal is not None:
        tables["lubricant"] = {"temperature_C": scene.lubricant.temperature_C, **tables["lubricant"]}
    return tables


class Simulations(Record):
    """Simulations of scenes, each once, with their results in ``store``.

    ``workers``: threads, by default all processors; ``scheduler``: address of a cluster to run on instead. ``retry``:
    repeat runs that failed before. ``progress(title)`` gives the progress of a stage. ``agenda``: counts the runs of the
    command. ``turns_of``: shaft turns of each requested run, by its key.
    """

    store: Store
    workers: int | None
    scheduler: str | None
    retry: bool
    progress: Callable[[str], Progress]
    agenda: AgendaKeeper | None = None
    turns_of: dict[str, float] = field(default_factory=dict)

    @property
    def turns(self) -> float:
        """Shaft turns of all requested runs, whether simulated now or stored before."""
        return sum(self.turns_of.values())

    def run(
        self,
        runs: Sequence[Run],
        labels: Sequence[str],
        progress: Progress,
        factors: Sequence[Mapping[str, float]] | None = None,
    ) -> list[Simulated | Failure]:
        """Results or failures of runs, in their order, from the store or simulated. A run fails where any of its points fails.

        ``factors``: those of design runs, which are then numbered. Raises RunError if the store cannot be written, InputError
        without the cluster, KeyboardInterrupt on Ctrl-C, always with all finished runs stored.
        """
        points, scenes = points_of(runs, labels, factors), every_scene(runs)
        if self.scheduler is None:
            by_key = dict(zip((point.key for point in points), scenes, strict=True))
            engine: Engine = partial(_in_threads, by_key, self.workers)
        else:
            texts = {point.key: scene.model_dump_json() for point, scene in zip(points, scenes, strict=True)}
            engine = partial(_on_cluster, texts, self.scheduler)
        if self.agenda is not None:
            works = {point.key: work_of(scene) for point, scene in zip(points, scenes, strict=True)}
            engine = self.agenda.timed(engine, works, self.scheduler is not None)
            progress = self.agenda.counting(works, progress)
        outcomes = run_points(points, self.store, engine, progress, sound, self.retry)
        results = [_result(point, outcomes[point.key]) for point in points]
        for point, result in zip(points, results, strict=True):
            if isinstance(result, SimulationResult):
                self.turns_of[point.key] = float(result.cost.get("turns", 0.0))
        return _by_run(runs, labels, points, results)


def stored(folder: Path, runs: Sequence[Run], labels: Sequence[str]) -> list[Simulated | Failure] | None:
    """Results or failures of runs in the store of a folder; None unless all of them have ended. Nothing is simulated."""
    if not (folder / STORE).exists():
        return None
    points = points_of(runs, labels)
    with Store(folder / STORE, read_only=True) as store:
        outcomes = store.outcomes(points, sound)
    if any(point.key not in outcomes for point in points):
        return None
    return _by_run(runs, labels, points, [_result(point, outcomes[point.key]) for point in points])


def _by_run(
    runs: Sequence[Run], labels: Sequence[str], points: Sequence[Point], results: Sequence[SimulationResult | Failure]
) -> list[Simulated | Failure]:
    """Results of runs from those of all their points."""
    pairs = zip(points, results, strict=True)
    return [
        result_of(run, label, list(islice(pairs, len(labelled_scenes(run)))))
        for run, label in zip(runs, labels, strict=True)
    ]


def every_scene(runs: Sequence[Run]) -> list[Scene]:
    """Scenes of runs, those over a duty point by point, in the order of `points_of`."""
    return [scene for run in runs for _, scene in labelled_scenes(run)]


def work_of(scene: Scene) -> float:
    """Least shaft turns of a run of a scene, with those of its companions and of the short states of a heat balance."""
    from rbdyn.dynamics.ensemble import in_turn

    work = in_turn(scene)
    if scene.thermal is None:
        return work
    from rbdyn.dynamics.temperatures import short_turns

    return work + short_turns(scene)[0]


def _first_state(scene: Scene) -> Scene:
    """The scene at the temperatures at which a heat balance begins; itself without one. Raises InputError where it seizes."""
    if scene.thermal is None:
        return scene
    return at_temperatures(scene, Temperatures(*[scene.lubricant.temperature_C] * len(Temperatures._fields)))


def points_of(
    runs: Sequence[Run], labels: Sequence[str], factors: Sequence[Mapping[str, float]] | None = None
) -> list[Point]:
    """Scenes of runs as points of the store; those with factors are design runs, numbered from 1."""
    version, keys = code_version(SIMULATION), dict[int, str]()
    points = []
    for place, (run, label) in enumerate(zip(runs, labels, strict=True)):
        for words, scene in labelled_scenes(run):
            # Runs share the scenes of the baseline.
            if (key := keys.get(id(scene))) is None:
                key = keys[id(scene)] = run_key(scene.model_dump(mode="json"), version)
            place_words = f"{label} {words}".rstrip()
            numbered = () if factors is None else (place + 1, factors[place])
            points.append(Point(key, place_words, *numbered))
    return points


def sound(result: dict[str, Any]) -> bool:
    """Whether a stored result is that of a simulation."""
    with suppress(KeyError, TypeError, ValueError):
        return bool(SimulationResult.from_dict(result))
    return False


def _result(point: Point, outcome: RunResult) -> SimulationResult | Failure:
    if isinstance(outcome, Failure):
        return replace(outcome, label=point.label, run=point.run, factors=dict(point.factors))
    return SimulationResult.from_dict(outcome)


def _in_threads(scenes: Mapping[str, Scene], workers: int | None, points: Sequence[Point], ledger: Ledger) -> None:
    """Engine of this process: the thread of a point notes its begin and stores its outcome."""
    from rbdyn.dynamics.ensemble import Outcome, Stop, run_all
    from rbdyn.dynamics.parameters.model import roller_bearing
    from rbdyn.dynamics.run import prepare

    stop, threads = Stop(), workers or os.cpu_count() or 1

    def run(point: Point, inside: int) -> RunOutcome:
        ledger.begin(point)
        outcome = attempt(scenes[point.key], stop, inside)
        ledger.keep(point, outcome)
        return outcome

    def runs() -> Iterator[Callable[[], RunOutcome]]:
        # One compilation here spares every thread the wait for it; the run itself reports faults.
        with suppress(Exception):
            first = _first_state(scenes[points[0].key])
            prepare(first, roller_bearing(first))
        for remaining, point in zip(range(len(points), 0, -1), points, strict=True):
            # Replicates of the last points run in parallel too, so that no thread waits for the longest point.
            yield partial(run, point, threads if remaining < 2 * threads else 1)

    def end(outcome: Outcome[RunOutcome]) -> None:
        if outcome.fault is not None:
            raise outcome.fault
        if outcome.value is not None:
            ledger.give(points[outcome.place], outcome.value)

    run_all(runs(), workers, stop, end)


def _on_cluster(texts: Mapping[str, str], scheduler: str, points: Sequence[Point], ledger: Ledger) -> None:
    """Engine of a cluster: its scheduler gets all points at once and distributes them."""
    from doe.running.runner import run_on_cluster

    work = partial(attempt_text, version=code_version(SIMULATION))

    def end(place: int, outcome: RunOutcome) -> None:
        ledger.keep(points[place], outcome)
        ledger.give(points[place], outcome)

    run_on_cluster(
        scheduler, work, [texts[point.key] for point in points], end, lambda place: ledger.begin(points[place])
    )


def attempt(scene: Scene, stop: "Stop | None" = None, workers: int = 1) -> RunOutcome:
    """Simulate a scene in ``workers`` threads; any fault of it is the cause of a failure, and so is a bearing without steady
    temperatures or too hot.
    """
    from rbdyn.dynamics.ensemble import CancelledError
    from rbdyn.dynamics.simulate import simulate

    start_s = time.perf_counter()
    result, cause = None, None
    try:
        outcome = simulate(scene, workers, None, stop, notice=None, only_steady=True)
        cause = heat_fault(outcome)
        result = None if cause else outcome.as_dict()
    except (CancelledError, MemoryError, OSError):
        raise
    except (RunError, InputError) as error:
        cause = str(error)
    except Exception as error:
        cause = f"unexpected {type(error).__name__}: {error}"
    return RunOutcome(result, cause, time.perf_counter() - start_s)


def heat_fault(result: SimulationResult) -> str | None:
    """Why a result has no steady temperatures, or too high ones; None for a sound one, or one whose clearance is a preload."""
    if result.status in ("ok", LOST_CLEARANCE):
        return None
    return f"{result.status}: {(result.thermal and result.thermal.reason) or verdict(result.notes)}"


def attempt_text(text: str, version: str) -> RunOutcome:
    """The same on a worker of a cluster, for a scene in JSON. Raises InputError if the worker runs other code."""
    host, pid = socket.gethostname(), os.getpid()
    if code_version(SIMULATION) != version:
        raise InputError(
            f"worker {host}, process {pid}: runs another version of rbdyn or of its sources; install the same"
        )
    return replace(attempt(Scene.from_dict(json.loads(text))), host=host, pid=pid)


def figures(names: Sequence[str], results: Sequence[Simulated | Failure]) -> tuple[Array, Array, Whole]:
    """Values, 95 % statistical half-widths (NaN if unknown) and numbers of independent values (0: unknown) of results.

    Each has the shape (runs, responses). The value of a response that a run does not report, or of a failed run, is NaN.
    """
    reports = ({} if isinstance(result, Failure) else result.responses for result in results)
    table = [[responses.get(name) for name in names] for responses in reports]
    values, errors, _, freedom = arrays_of(table)
    # Student's t of a mean of n independent values has n - 1 degrees of freedom.
    return values, errors, np.where(np.isfinite(freedom), freedom + 1.0, 0.0).astype(np.int64)


def histories(scenes: Mapping[str, Scene], turns: float) -> "dict[str, History]":
    """Motion of scenes by name, over at most ``turns`` shaft turns. Raises RunError."""
    from rbdyn.dynamics.motion import history

    return {name: history(scene, min(turns, scene.numerics.turns), notice=None) for name, scene in scenes.items()}


def draw_motion(motions: "Mapping[str, History]", folder: Path, classes: Mapping[str, str]) -> list[str]:
    """Draw cage orbits, in the colour of the ``classes`` of their cages, and pocket forces. Returns the names of the pictures."""
    from rbdyn import plots

    plots.cage_orbit(motions, folder / "cage_orbit.png", classes)
    plots.pocket_forces(motions, folder / "pocket_forces.png")
    return ["cage_orbit.png", "pocket_forces.png"]


class DrawnMotion(NamedTuple):
    """A motion small enough for a mail.

    ``orbit_um``: x and y of the cage in its guide over the whole motion, at most ORBIT_POINTS points; ``guide_radius_um``: None
    without a guide; ``moving``: FRAMES frames of PLAYED_TURNS shaft turns about the largest pocket force, as by
    rbdyn.plots.drawing.motion_record.
    """

    orbit_um: tuple[list[float], list[float]]
    guide_radius_um: float | None
    moving: dict[str, Any]


def drawn_motion(motion: "History") -> DrawnMotion:
    """What a page draws of a motion."""
    from rbdyn.plots.drawing import drawing, motion_record

    thinned = slice(None, None, -(-len(motion.time) // ORBIT_POINTS))
    x, y = (np.round(1e6 * along[thinned], 2).tolist() for along in motion.guide_eccentricity)
    clearance = motion.scene.guide_clearance_m
    picture = drawing(motion, PLAYED_TURNS, round(FRAMES / PLAYED_TURNS), FRAMES)
    radius = None if clearance is None else round(1e6 * clearance, 3)
    return DrawnMotion((x, y), radius, motion_record(motion, picture))
