"""The front of the simulator itself, searched by thousands of runs, and what surfaces and a search in few runs lose against it.

``python examples/benchmarks/direct_front.py STUDY.toml --out DIR`` makes the study's design runs, searches by
``direct_search`` (NSGA-II with error-aware dominance), runs as many points of the surfaces' front, and compares. Where DIR
holds the answer of ``doe study --adaptive`` of the same study, its front is compared too. All runs are kept in DIR, so an
interrupted search goes on to the same bits; ``direct_front.json`` holds points and figures. Every evaluation is as long as a
design run unless --turns and --discard-turns say otherwise, and must count a whole window of the impact.
"""

import argparse
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from direct_search import (
    DirectFront,
    SurrogateLoss,
    compare_with_surrogate,
    direct_front,
    relative_hypervolumes,
    repeated,
)

from doe.clearance import Simulations
from doe.pareto import ParetoFront
from doe.pareto.front import SimulatedFront
from doe.pareto.search import spread
from doe.running.store import STORE, Failure, Store, grouped
from doe.workflow.adaptive import Evaluator
from doe.workflow.effort import Effort
from doe.workflow.front import find_front
from doe.workflow.front_record import EstimatedPoint
from doe.workflow.problem import Problem
from doe.workflow.runs import run_design, standard_errors
from doe.workflow.surfaces import fit_surfaces
from rbdyn.base.arrays import Array
from rbdyn.base.command import progress_bar
from rbdyn.base.faults import InputError, MethodError, RunError
from rbdyn.base.files import read_json, write_json
from rbdyn.base.words import counted, with_error
from rbdyn.scene import Scene

# Seeds of the evaluations begin here, apart from those of design and confirmation.
SEEDS = 2_000_000
# Settings of the search alone.
SEARCH = ("evaluations", "population", "seed", "confidence", "resample")


@dataclass(frozen=True)
class Settings:
    """Runs of the search, points of a generation; replicates, turns (the discarded ones included) and discarded turns of a run;
    seed; confidence at which differences count; share of fresh runs at the end; keys replaced as "key=value"."""

    evaluations: int = 2000
    population: int = 50
    replicates: int = 3
    turns: float | None = None
    discard_turns: float | None = None
    seed: int = 1
    confidence: float = 0.95
    resample: float = 0.3
    set: list[str] = field(default_factory=lambda: ["numerics.extend_limit=4"])


@dataclass(frozen=True, eq=False)
class Direct:
    """Front of the simulator and the surfaces' front run on it.

    ``surrogate_points`` (s, k) of the surfaces' front, in factor units, with the means (s, m) of their runs and the
    standard errors (s, m) of these. ``failures``: every evaluation that failed. ``seconds``: wall time of the
    search and of the comparison.
    """

    front: DirectFront
    surrogate_points: Array
    surrogate_values: Array
    surrogate_errors: Array
    loss: SurrogateLoss
    failures: tuple[Failure, ...]
    seconds: Mapping[str, float]


def scenes(study: Problem, settings: Settings, points: Array, first: int) -> list[Scene]:
    """A scene an evaluation (n, k), numbered from ``first``: few replicates, a seed of its own."""
    overrides = [f"numerics.replicates={settings.replicates}", "numerics.companion=false"]
    if settings.discard_turns is not None:
        overrides.append(f"numerics.discard_turns={settings.discard_turns!r}")
    if settings.turns is not None:
        usual = study.scene_at(study.baseline, settings.seed, overrides).numerics.warm_up_turns
        # What is left after the transient; ``check`` names a run that leaves nothing.
        overrides.append(f"numerics.turns={max(settings.turns - usual, 1e-3)!r}")
    seeded = enumerate(points, settings.seed + SEEDS + first)
    return [study.scene_at(point, seed, [*overrides, *settings.set]) for seed, point in seeded]


def check(study: Problem, settings: Settings) -> None:
    """Raises InputError where the runs are impossible or count no whole window of the impact."""
    if settings.turns is not None and (settings.discard_turns or 0.0) >= settings.turns:
        raise InputError([f"--discard-turns {settings.discard_turns:g}: must be below --turns {settings.turns:g}"])
    (scene,) = scenes(study, settings, study.baseline[None], 0)
    turns, window = scene.numerics.turns, scene.numerics.impact_window_turns
    if "impact_force_N" in study.responses and turns < window:
        least = scene.numerics.warm_up_turns + window
        raise InputError(
            [f"--turns: {turns:g} counted turns hold no impact window of {window:g}; give {least:g} at least"]
        )


def run_in_words(study: Problem, settings: Settings) -> str:
    """What one run of the search is."""
    (scene,) = scenes(study, settings, study.baseline[None], 0)
    numerics = scene.numerics
    windows = int(numerics.turns / scene.impact_window_turns + 1e-9)
    return (
        f"{numerics.replicates} replicates of {numerics.turns:g} counted shaft turns ({counted(windows, 'whole window')} of "
        f"the impact, {scene.impact_window_turns:g} turns each) after {numerics.warm_up_turns:g} discarded ones"
    )


class Generations(Evaluator):
    """Runs generations of points, every row with a seed of its own."""

    def __init__(self, study: Problem, settings: Settings, simulations: Simulations) -> None:
        super().__init__(study, simulations, settings.evaluations, "direct front")
        self._settings = settings

    def __call__(self, points: Array) -> tuple[Array, Array]:  # type: ignore[override]
        """Responses (n, m) and their standard errors (n, m) at points (n, k) in factor units; NaN where a run failed."""
        values, errors, samples = self.run(scenes(self._study, self._settings, points, self.done), "direct run")
        return values, standard_errors(errors, samples)


def find_direct(study: Problem, settings: Settings, on_surfaces: ParetoFront, simulations: Simulations) -> Direct:
    """Search the front on the simulator, then run as many points of the surfaces' front on it, and compare.

    Raises RunError where every run of a stage fails, InputError for impossible settings, KeyboardInterrupt.
    """
    check(study, settings)
    reach = study.reach
    evaluate = Generations(study, settings, simulations)
    started = time.perf_counter()
    try:
        front = direct_front(
            evaluate,
            study.actual(-reach),
            study.actual(reach),
            goals=study.goals,
            baseline=study.baseline,
            pick=study.file.front.pick,
            **{name: getattr(settings, name) for name in SEARCH},
        )
        searched = time.perf_counter()
        rows = spread(on_surfaces.costs, len(front.points), [on_surfaces.pick])[: len(front.points)]
        # As many runs a point as a finalist of the direct front has.
        surrogate = repeated(evaluate, on_surfaces.points[rows], front.repeats)
        loss = compare_with_surrogate(front, surrogate.values, surrogate.errors, seed=settings.seed)
    except MethodError as error:
        if evaluate.failures:
            causes = "; ".join(group.cause for group in grouped(evaluate.failures))
            raise RunError(f"direct front: {error} ({causes})") from None
        raise InputError([f"direct front: {error}"]) from None
    seconds = {"search": searched - started, "comparison": time.perf_counter() - searched}
    return Direct(front, *surrogate, loss, tuple(evaluate.failures), seconds)


def record_of(study: Problem, settings: Settings, direct: Direct) -> dict[str, Any]:
    """The direct front, that of the surfaces run on the simulator, and what these lose, as plain numbers."""
    front, loss = direct.front, direct.loss
    rows = zip(front.points, front.values, front.half_widths, strict=True)
    surrogate = zip(direct.surrogate_points, direct.surrogate_values, 1.96 * direct.surrogate_errors, strict=True)
    points = [EstimatedPoint.of(study, *row).as_dict() for row in rows]
    return {
        "front": points,
        "pick": {**points[front.pick], "reason": front.pick_reason},
        "surrogate_front": [EstimatedPoint.of(study, *row).as_dict() for row in surrogate if np.isfinite(row[1]).all()],
        **asdict(loss),
        "sentence": loss.sentence,
        "run": run_in_words(study, settings),
        "optimism_percent": {
            study.responses[index]: 100.0 * float(share)
            for index, share in zip(front.goals.objectives, front.optimism, strict=True)
        },
        **{key: getattr(front, key) for key in ("evaluations", "repeats", "generations", "seed")},
        "failed": len(direct.failures),
        "seconds": direct.seconds["search"],
        "comparison_seconds": direct.seconds["comparison"],
    }


def share_of_adaptive(study: Problem, front: SimulatedFront, summary: Mapping[str, Any]) -> dict[str, float] | None:
    """Hypervolume of the front of ``doe study --adaptive`` over that of the direct one, by the fresh runs of both, with its
    95 % half-width and the runs of the search; None where the ``summary`` is of a study without that search."""
    if not (adaptive := summary.get("adaptive")):
        return None
    both = ("responses", "errors")
    values, errors = (np.array([list(each[key].values()) for each in adaptive["front"]], float) for key in both)
    goals = front.goals
    fronts = (front.costs, front.cost_errors), (goals.costs(values), errors[:, goals.objectives] / 1.96)
    (whole, whole_error), (part, part_error) = relative_hypervolumes(*fronts, front.seed)
    if whole <= 0.0:
        return None
    ratio = part / whole
    return {
        "share": ratio,
        "error": 1.96 * float(np.hypot(ratio * whole_error, part_error)) / whole,
        "runs": adaptive["runs"] + adaptive["fresh"],
    }


def compare(study: Problem, settings: Settings, folder: Path, workers: int | None) -> dict[str, Any]:
    """All of it: runs, searches, comparisons, the file; returns its record. Raises as ``find_direct``."""
    folder.mkdir(parents=True, exist_ok=True)
    effort = Effort(workers)
    with progress_bar("design runs", False) as progress, effort.simulations(folder, study.path) as simulations:
        surfaces = fit_surfaces(study, run_design(study, simulations, progress))
    on_surfaces = find_front(study.with_surfaces(surfaces))
    with Store(folder / STORE, study.path.stem) as store, progress_bar("direct front", False) as progress:
        simulations = Simulations(store, workers, None, False, lambda title: progress)
        found = find_direct(study, settings, on_surfaces, simulations)
    record = record_of(study, settings, found)
    summary = folder / "summary.json"
    record["adaptive"] = share_of_adaptive(study, found.front, read_json(summary)) if summary.exists() else None
    write_json(folder / "direct_front.json", record)
    return record


def main(arguments: Sequence[str] | None = None) -> int:
    """Run from the command line; returns the exit code."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("study", type=Path, metavar="STUDY.toml")
    options.add_argument("--out", type=Path, metavar="DIR", required=True, help="folder of the runs and the record")
    options.add_argument("--workers", type=int, metavar="N", default=os.cpu_count(), help="threads")
    usual = Settings()
    for name, kind in (*((name, int) for name in ("evaluations", "population", "replicates", "seed")),
                       *((name, float) for name in ("turns", "discard_turns", "confidence", "resample"))):  # fmt: skip
        options.add_argument(f"--{name.replace('_', '-')}", type=kind, metavar="N", default=getattr(usual, name))
    options.add_argument("--set", action="append", metavar="KEY=VALUE", help=f"{usual.set[0]} unless given; repeatable")
    asked = vars(options.parse_args(arguments))
    path, folder, workers = asked.pop("study"), asked.pop("out"), asked.pop("workers")
    settings = Settings(**asked | {"set": asked["set"] or usual.set})
    try:
        record = compare(Problem.load(path), settings, folder, workers)
    except (InputError, RunError) as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    print(f"direct front: {record['evaluations']} simulations in {record['seconds']:.0f} s, {record['run']}")
    print(record["sentence"])
    if told := record["adaptive"]:
        share = with_error(100.0 * told["share"], 100.0 * told["error"])
        print(f"The adaptive search of {told['runs']} runs reaches {share} % of the direct front's hypervolume.")
    print(f"written to {folder}: direct_front.json")
    return 0


if __name__ == "__main__":
    sys.exit(main())
