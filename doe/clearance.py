"""The bearing behind the factors: builds scenes, runs them, and gives back responses.

The only module of this package that runs bearing simulations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from doe.study.store import Store, run_key
from doe.study_file import Study
from rbdyn.faults import InputError, RunError, read_toml
from rbdyn.result import SimulationResult, versions
from rbdyn.scene import Scene

if TYPE_CHECKING:
    from rbdyn.dynamics.history import History

Array = NDArray[np.float64]

RESPONSES = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm", "cage_slip")
# Confirmation runs use seeds that no design run has.
CONFIRMATION_SEEDS = 1_000_000
# Of a motion that goes into a report.
ORBIT_POINTS, FRAMES, PLAYED_TURNS = 2000, 300, 2.0


def check_responses(study: Study) -> None:
    """Raises InputError for a response that the simulation does not give."""
    faults = [
        f"{study.path}: response.name = {name!r}: the simulation does not give it; choose one of {', '.join(RESPONSES)}"
        for name in study.responses
        if name not in RESPONSES
    ]
    if faults:
        raise InputError(faults)


def read_scene(study: Study) -> dict[str, Any]:
    """Tables of the study's scene file. Raises InputError when the file or a factor's key is not there."""
    path = study.beside(study.file.scene.file)
    data = read_toml(path)
    faults = []
    for factor in study.file.factor:
        table, _, key = factor.key.rpartition(".")
        if table not in data or key not in data[table]:
            faults.append(
                f"{study.path}: factor.key = {factor.key!r}: no such key in {path}; write table.key as in that file"
            )
    if faults:
        raise InputError(faults)
    return data


def scene_at(
    study: Study, data: dict[str, Any], factors: Array, seed: int, overrides: Sequence[str]
) -> Scene:
    """The study's scene at factor values, with a seed. Raises InputError when a value is impossible."""
    path = study.beside(study.file.scene.file)
    assignments = [f"{factor.key}={float(x)!r}" for factor, x in zip(study.file.factor, factors, strict=True)]
    return Scene.from_dict(data, str(path), [*overrides, f"numerics.seed={seed}", *assignments])


def design_scenes(study: Study, points: Array, order: Sequence[int] | None = None) -> list[Scene]:
    """A scene a design run (n, k); runs at one point differ by their seed only. Raises InputError.

    ``order``: place of each run in the standard order, which sets its seed; as given unless told.
    """
    data, first = read_scene(study), study.file.design.seed
    places = range(len(points)) if order is None else order
    return [
        scene_at(study, data, point, first + place, study.file.scene.set)
        for place, point in zip(places, points, strict=True)
    ]


def confirmation_scene(study: Study, point: Array) -> Scene:
    """Scene of a confirmation run: more replicates, fresh seeds."""
    confirmation = study.file.confirmation
    overrides = [
        *study.file.scene.set,
        f"numerics.replicates={confirmation.replicates}",
        "numerics.companion=true",
        *confirmation.set,
    ]
    seed = study.file.design.seed + CONFIRMATION_SEEDS
    return scene_at(study, read_scene(study), point, seed, overrides)


def run_scenes(
    scenes: Sequence[Scene],
    labels: Sequence[str],
    store: Store,
    workers: int | None,
    progress: Callable[[int, int], None],
) -> list[SimulationResult]:
    """Results of scenes, from the store or simulated, each stored as soon as it ends.

    Raises RunError naming every run that could not go on, after all others have ended; KeyboardInterrupt on
    Ctrl-C, with all finished runs stored.
    """
    version = versions()["rbdyn"]
    keys = [run_key(scene.model_dump(mode="json"), version) for scene in scenes]
    stored = {key: store.get(key) for key in keys}
    missing = {key: scene for key, scene in zip(keys, scenes, strict=True) if stored[key] is None}
    results = {
        key: SimulationResult.from_dict(record) for key, record in stored.items() if record is not None
    }
    progress(len(results), len(stored))
    failures: dict[str, RunError] = {}
    if missing:
        from rbdyn.dynamics.ensemble import Ended, Stop, run_all
        from rbdyn.dynamics.model import roller_bearing
        from rbdyn.dynamics.simulate import prepare, simulate

        # Compiled once here, lest every thread wait for the same compilation.
        first = next(iter(missing.values()))
        prepare(first, roller_bearing(first))
        stop, keys_of_runs = Stop(), list(missing)

        def ended(one: Ended[SimulationResult]) -> None:
            key = keys_of_runs[one.place]
            if one.fault is not None:
                failures[key] = one.fault
                return
            results[key] = one.result()
            store.put(key, results[key].as_dict())
            progress(len(results), len(stored))

        run_all([partial(simulate, scene, 1, None, stop) for scene in missing.values()], workers, stop, ended)
    if failures:
        causes = [
            f"{label}: {failures[key]}" for label, key in zip(labels, keys, strict=True) if key in failures
        ]
        raise RunError("; ".join(causes))
    return [results[key] for key in keys]


def responses(study: Study, results: Sequence[SimulationResult]) -> tuple[Array, Array]:
    """Values and 95 % statistical half-widths (NaN where there is none), each (runs, responses)."""
    records: list[dict[str, Any]] = [result.as_dict() for result in results]
    values = [[record[name]["value"] for name in study.responses] for record in records]
    errors = [[record[name]["statistical_error"] for name in study.responses] for record in records]
    return np.array(values), np.array(errors, dtype=float)


def histories(study: Study, points: dict[str, Array], turns: float) -> dict[str, History]:
    """Motion of the confirmation scene at each point, over at most ``turns`` shaft turns. Raises RunError."""
    from rbdyn.dynamics.history import history

    scenes = {name: confirmation_scene(study, point) for name, point in points.items()}
    return {name: history(scene, min(turns, scene.numerics.turns)) for name, scene in scenes.items()}


def draw_motion(motions: Mapping[str, History], folder: Path) -> list[str]:
    """Draw cage orbits and pocket forces; returns the names of the pictures."""
    from rbdyn import plots

    plots.cage_orbit(motions, folder / "cage_orbit.png")
    plots.pocket_forces(motions, folder / "pocket_forces.png")
    return ["cage_orbit.png", "pocket_forces.png"]


def motion_record(motions: Mapping[str, History]) -> dict[str, Any]:
    """Motions small enough to be mailed, by name: the orbit of the cage in its guide, and frames to be played.

    Each holds ``t_s`` and ``cage_orbit_um`` {"x", "y"}: the whole motion, thinned to at most ORBIT_POINTS;
    ``guide_radius_um``, None without a guide; ``moving``: FRAMES frames of PLAYED_TURNS shaft turns about the
    largest pocket force, as rbdyn.plots.player.motion_record keeps them.
    """
    from rbdyn.plots.drawing import drawing
    from rbdyn.plots.player import motion_record as frames

    record = {}
    for name, motion in motions.items():
        kept = slice(None, None, -(-len(motion.time) // ORBIT_POINTS))
        x, y = motion.guide_eccentricity
        clearance = motion.scene.guide_clearance_m
        picture = drawing(motion, PLAYED_TURNS, round(FRAMES / PLAYED_TURNS), FRAMES)
        record[name] = {
            "t_s": np.round(motion.time[kept], 8).tolist(),
            "cage_orbit_um": {
                "x": np.round(1e6 * x[kept], 2).tolist(),
                "y": np.round(1e6 * y[kept], 2).tolist(),
            },
            "guide_radius_um": None if clearance is None else round(1e6 * clearance, 3),
            "moving": frames(motion, picture),
        }
    return record
