"""The bearing behind the factors: builds scenes, runs them, and gives back responses.

The only module of this package that runs bearing simulations.
"""

import json
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from doe.running.keeper import AgendaKeeper
from doe.running.runner import Engine, Ledger, Progress, Ran, RunResult, run_points
from doe.running.store import Failure, Point, Store
from doe.study_file import Study
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, RunError, read_toml, refuse
from rbdyn.base.storage import code_version, run_key
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene
from rbdyn.scene.unknown import plain_values

if TYPE_CHECKING:
    from rbdyn.dynamics.ensemble import Stop
    from rbdyn.dynamics.motion.history import History


# What gets the key of a run under way, its share that is done, and the time that this took [s]; None where nobody asks.
Hear = Callable[[str, float, float], None] | None
# What simulates a run: its code decides whether a stored one is still good.
SIMULATION = "rbdyn.dynamics.simulate"
RESPONSES = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm", "cage_slip")
# Seeds that no design run has; the input sets are those of an uncertainty.
CONFIRMATION_SEEDS = 1_000_000
INPUT_SEEDS = 3_000_000
ADAPTIVE_SEEDS = 4_000_000
CALIBRATION_SEEDS = 5_000_000
# Times as long as asked for that a run of an adaptive search gets at most where it drifts: 8 cost twice, for no better a front.
ADAPTIVE_EXTENDED = 2.0
# Of a motion that goes into a report.
ORBIT_POINTS, FRAMES, PLAYED_TURNS = 2000, 300, 2.0


def check_responses(study: Study) -> None:
    """Raises InputError for a response that the simulation does not give."""
    refuse(
        f"{study.path}: response.name = {name!r}: the simulation does not give it; choose one of {', '.join(RESPONSES)}"
        for name in study.responses
        if name not in RESPONSES
    )


def read_scene(study: Study) -> dict[str, Any]:
    """Tables of the study's scene file. Raises InputError when the file is not there or a factor's key is none of a scene."""
    path = study.beside(study.scene.file)
    data = read_toml(path)
    named = (*(factor.key for factor in study.file.factor), *(each.key for each in study.file.category))
    left_out = [
        whole
        for whole in named
        for table, _, key in (whole.rpartition("."),)
        if not isinstance(data.get(table), dict) or key not in data[table]
    ]
    known: Mapping[str, Any] = {}
    with suppress(InputError):
        known = plain_values(Scene.from_dict(data, str(path), study.scene.set)) if left_out else {}
    refuse(
        f"{study.path}: factor.key = {key!r}: no such key in {path}; write table.key as in that file"
        for key in left_out
        if key not in known
    )
    return data


def declares_unknowns(study: Study) -> bool:
    """Whether the study or its scene declares unknown inputs; to name values as estimates alone is not to ask for it."""
    if study.file.uncertain is not None:
        return True
    return bool(set(read_scene(study).get("uncertain", {})) - {"estimated"})


def scene_at(study: Study, data: dict[str, Any], factors: Array, seed: int, overrides: Sequence[str]) -> Scene:
    """The study's scene at factor values, with a seed. Raises InputError when a value is impossible."""
    path = study.beside(study.scene.file)
    return Scene.from_dict(data, str(path), [*overrides, f"numerics.seed={seed}", *assignments(study, factors)])


def assignments(study: Study, factors: Array) -> list[str]:
    """Keys of the scene at factor values (k,) and at the study's categories, as "key=value"; of factors that mean something."""
    numbers = zip(study.file.factor, map(float, factors), strict=True)
    values, idle = study.categories, [study.factors[place] for place in study.inactive]
    return [
        *(f"{factor.key}={round(x) if factor.whole else x!r}" for factor, x in numbers if factor.name not in idle),
        *(f"{each.key}={values[each.name]}" for each in study.file.category),
    ]


def design_scenes(study: Study, points: Array, order: Sequence[int] | None = None) -> list[Scene]:
    """A scene a design run (n, k); runs at one point differ by their seed only. Raises InputError, which names the point where a
    factor has a value that is impossible there.

    ``order``: place of each run in the standard order, which sets its seed; as given by default.
    """
    data, first, overrides = read_scene(study), study.file.design.seed, study.scene.set
    places = range(len(points)) if order is None else order
    numbered = zip(places, points, strict=True)
    return [_scene_in_region(study, data, point, first + place, overrides) for place, point in numbered]


def _scene_in_region(study: Study, data: dict[str, Any], point: Array, seed: int, overrides: Sequence[str]) -> Scene:
    try:
        return scene_at(study, data, point, seed, overrides)
    except InputError as error:
        keys = [factor.key for factor in study.file.factor]
        place = ", ".join(f"{name} = {value:.4g}" for name, value in study.by_factor(point).items())
        where = f"{study.path}: the region of the design reaches {place}, where "
        faults = [str(fault) for fault in error.faults]
        raise InputError(
            [
                f"{where}{fault}, or narrow the region" if any(key in fault for key in keys) else fault
                for fault in faults
            ]
        ) from None


def confirmation_scene(study: Study, point: Array) -> Scene:
    """Scene of a confirmation run: more replicates, fresh seeds."""
    settings, seed = study.file.confirmation, study.file.design.seed + CONFIRMATION_SEEDS
    effort = [f"numerics.replicates={settings.replicates}", "numerics.companion=true"]
    return scene_at(study, read_scene(study), point, seed, [*study.scene.set, *effort, *settings.set])


def adaptive_scenes(study: Study, points: Array, replicates: Sequence[int], first: int) -> list[Scene]:
    """A scene a run of an adaptive search (n, k), numbered from ``first``: a design run with replicates and a seed of its own."""
    data, adaptive = read_scene(study), study.file.adaptive
    usual = scene_at(study, data, study.baseline, adaptive.seed, study.scene.set).numerics.extend_limit
    shared = ["numerics.companion=false", f"numerics.extend_limit={min(usual, ADAPTIVE_EXTENDED)!r}", *adaptive.set]
    overrides = [[*study.scene.set, f"numerics.replicates={count}", *shared] for count in replicates]
    runs = enumerate(zip(points, overrides, strict=True), adaptive.seed + ADAPTIVE_SEEDS + first)
    return [scene_at(study, data, point, seed, keys) for seed, (point, keys) in runs]


@dataclass(frozen=True)
class Simulations:
    """Runs scenes once each and keeps them in ``store``.

    ``workers``: threads, all processors by default; ``scheduler``: address of a cluster to run on instead.
    ``retry``: run those again that failed before. ``progress(title)`` gives the progress of a stage. ``agenda``: where the
    runs of the command are counted. ``turns_of``: shaft turns of each run asked for, by its key.
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
        """Shaft turns of all runs asked for, whether made now or found in the store."""
        return sum(self.turns_of.values())

    def run(
        self,
        scenes: Sequence[Scene],
        labels: Sequence[str],
        progress: Progress,
        factors: Sequence[Mapping[str, float]] | None = None,
    ) -> list[SimulationResult | Failure]:
        """Results or failures of scenes, in their order, from the store or simulated.

        ``factors``: of design runs, which are numbered then. Raises RunError when the store cannot be written, InputError
        when the cluster is not there, KeyboardInterrupt on Ctrl-C, always with all finished runs stored.
        """
        points = points_of(scenes, labels, factors)
        if self.scheduler is None:
            by_key = dict(zip((point.key for point in points), scenes, strict=True))
            engine: Engine = partial(
                _in_threads, by_key, self.workers, None if self.agenda is None else self.agenda.hear
            )
        else:
            texts = {point.key: scene.model_dump_json() for point, scene in zip(points, scenes, strict=True)}
            engine = partial(_on_cluster, texts, self.scheduler)
        if self.agenda is not None:
            works = {point.key: work_of(scene) for point, scene in zip(points, scenes, strict=True)}
            growth = max((scene.numerics.extend_limit for scene in scenes if scene.extends), default=1.0)
            engine = self.agenda.timed(engine, works, growth, self.scheduler is not None)
            progress = self.agenda.counting(works, progress)
        outcomes = run_points(points, self.store, engine, progress, sound, self.retry)
        results = [_result(point, outcomes[point.key]) for point in points]
        for point, result in zip(points, results, strict=True):
            if isinstance(result, SimulationResult):
                self.turns_of[point.key] = float(result.cost.get("turns", 0.0))
        return results


def work_of(scene: Scene) -> float:
    """Shaft turns that a run of a scene takes at least, its companions' included."""
    numerics = scene.numerics
    return (numerics.replicates + numerics.companions) * (numerics.warm_up_turns + numerics.turns)


def points_of(
    scenes: Sequence[Scene], labels: Sequence[str], factors: Sequence[Mapping[str, float]] | None = None
) -> list[Point]:
    """Scenes as points of the store; those with factors are design runs, numbered from 1."""
    version = code_version(SIMULATION)
    keys = [run_key(scene.model_dump(mode="json"), version) for scene in scenes]
    if factors is None:
        return [Point(key, label) for key, label in zip(keys, labels, strict=True)]
    numbers = range(1, len(keys) + 1)
    return [Point(*each) for each in zip(keys, labels, numbers, factors, strict=True)]


def sound(result: dict[str, Any]) -> bool:
    """Whether a stored result is one of a simulation."""
    with suppress(KeyError, TypeError, ValueError):
        return bool(SimulationResult.from_dict(result))
    return False


def _result(point: Point, outcome: RunResult) -> SimulationResult | Failure:
    if isinstance(outcome, Failure):
        return replace(outcome, label=point.label, run=point.run, factors=dict(point.factors))
    return SimulationResult.from_dict(outcome)


def _in_threads(
    scenes: Mapping[str, Scene], workers: int | None, hear: Hear, points: Sequence[Point], ledger: Ledger
) -> None:
    """Engine of this process. The thread that runs a point notes that it begins, and stores it after. ``hear`` gets how far each
    point under way is."""
    from rbdyn.dynamics.ensemble import Ended, Stop, run_all
    from rbdyn.dynamics.parameters.model import roller_bearing
    from rbdyn.dynamics.run import prepare

    stop, threads = Stop(), workers or os.cpu_count() or 1

    def run(point: Point, inside: int) -> Ran:
        ledger.begin(point)
        ran = attempt(scenes[point.key], stop, inside, None if hear is None else partial(_heard, hear, point.key))
        ledger.keep(point, ran)
        return ran

    def runs() -> Iterator[Callable[[], Ran]]:
        # Compiled once here, lest every thread wait for the same compilation; the run itself reports faults.
        with suppress(Exception):
            prepare(scenes[points[0].key], roller_bearing(scenes[points[0].key]))
        for left, point in zip(range(len(points), 0, -1), points, strict=True):
            # Of the last points the replicates go side by side too, lest threads wait for the longest point.
            yield partial(run, point, threads if left < 2 * threads else 1)

    def end(one: Ended[Ran]) -> None:
        if one.fault is not None:
            raise one.fault
        if one.found is not None:
            ledger.give(points[one.place], one.found)

    run_all(runs(), workers, stop, end)


def _on_cluster(texts: Mapping[str, str], scheduler: str, points: Sequence[Point], ledger: Ledger) -> None:
    """Engine of a cluster, whose scheduler knows best what runs where: it gets all points at once."""
    from doe.running.cluster import run_on_cluster

    work = partial(attempt_text, version=code_version(SIMULATION))

    def end(place: int, ran: Ran) -> None:
        ledger.keep(points[place], ran)
        ledger.give(points[place], ran)

    run_on_cluster(
        scheduler, work, [texts[point.key] for point in points], end, lambda place: ledger.begin(points[place])
    )


def _heard(hear: Callable[[str, float, float], None], key: str, seconds: float, done: int, total: int) -> None:
    hear(key, done / total, seconds)


def attempt(
    scene: Scene, stop: "Stop | None" = None, workers: int = 1, heard: Callable[[float, int, int], None] | None = None
) -> Ran:
    """Simulate a scene in one thread, or so many; whatever is wrong with it is the cause of a failure.

    ``heard(seconds, done, total)`` is called whenever one more of its replicates has ended.
    """
    from rbdyn.dynamics.ensemble import CancelledError
    from rbdyn.dynamics.simulate import simulate

    started = time.perf_counter()
    result, cause = None, None

    def progress(done: int, total: int) -> None:
        if heard is not None:
            heard(time.perf_counter() - started, done, total)

    try:
        result = simulate(scene, workers, progress, stop, notice=None).as_dict()
    except (CancelledError, MemoryError, OSError):
        raise
    except (RunError, InputError) as error:
        cause = str(error)
    except Exception as error:
        cause = f"unexpected {type(error).__name__}: {error}"
    return Ran(result, cause, time.perf_counter() - started)


def attempt_text(text: str, version: str) -> Ran:
    """The same on a worker of a cluster, of a scene in JSON. Raises InputError where the worker runs other code."""
    host, pid = socket.gethostname(), os.getpid()
    if code_version(SIMULATION) != version:
        where = f"worker {host}, process {pid}"
        raise InputError([f"{where}: runs another version of rbdyn or of its sources; install the same"])
    return replace(attempt(Scene.from_dict(json.loads(text))), host=host, pid=pid)


def figures(names: Sequence[str], results: Sequence[SimulationResult]) -> tuple[Array, Array, Whole]:
    """Values, 95 % statistical half-widths (NaN where there is none), and how many independent values are behind each
    (0: unknown), each of shape (runs, responses)."""
    quantities = [[record[name] for name in names] for record in (result.as_dict() for result in results)]
    keys = "value", "statistical_error", "degrees_of_freedom"
    values, errors, freedom = ([[quantity.get(key) for quantity in row] for row in quantities] for key in keys)
    # Student's t of a mean of n independent values has n - 1 degrees of freedom.
    behind = np.nan_to_num(np.array(freedom, dtype=float) + 1.0).astype(np.int64)
    return np.array(values), np.array(errors, dtype=float), behind


def histories(study: Study, points: dict[str, Array], turns: float) -> "dict[str, History]":
    """Motion of the confirmation scene at each point, over at most ``turns`` shaft turns. Raises RunError."""
    from rbdyn.dynamics.motion.history import history

    original = study.at(())
    scenes = {name: confirmation_scene(original if name == "baseline" else study, at) for name, at in points.items()}
    return {name: history(scene, min(turns, scene.numerics.turns), notice=None) for name, scene in scenes.items()}


def draw_motion(motions: "Mapping[str, History]", folder: Path) -> list[str]:
    """Draw cage orbits and pocket forces; returns the names of the pictures."""
    from rbdyn import plots

    plots.cage_orbit(motions, folder / "cage_orbit.png")
    plots.pocket_forces(motions, folder / "pocket_forces.png")
    return ["cage_orbit.png", "pocket_forces.png"]


def motion_record(motions: "Mapping[str, History]") -> dict[str, Any]:
    """Motions small enough to be mailed, by name: the orbit of the cage in its guide, and frames to be played.

    Each holds ``t_s`` and ``cage_orbit_um`` {"x", "y"}: the whole motion, thinned to at most ORBIT_POINTS;
    ``guide_radius_um``, None without a guide; ``moving``: FRAMES frames of PLAYED_TURNS shaft turns about the
    largest pocket force, as rbdyn.plots.drawing.motion_record keeps them.
    """
    from rbdyn.plots.drawing import drawing
    from rbdyn.plots.drawing import motion_record as frames

    record = {}
    for name, motion in motions.items():
        thinned = slice(None, None, -(-len(motion.time) // ORBIT_POINTS))
        x, y = motion.guide_eccentricity
        clearance = motion.scene.guide_clearance_m
        picture = drawing(motion, PLAYED_TURNS, round(FRAMES / PLAYED_TURNS), FRAMES)
        record[name] = {
            "t_s": np.round(motion.time[thinned], 8).tolist(),
            "cage_orbit_um": {"x": np.round(1e6 * x[thinned], 2).tolist(), "y": np.round(1e6 * y[thinned], 2).tolist()},
            "guide_radius_um": None if clearance is None else round(1e6 * clearance, 3),
            "moving": frames(motion, picture),
        }
    return record
