"""The whole study: design, runs, surfaces, front, confirmation, dimension chains, a published table beside."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from doe.designs import to_actual
from doe.study.confirmation import Confirmed, Gain, gains, with_errors
from doe.study.failure import successes
from doe.study.front import find_front
from doe.study.reference import Beside, beside, reference_runs
from doe.study.runs import STORE, Progress, Runs, design_points, run_design
from doe.study.surfaces import fit_surfaces
from doe.study_file import Study
from doe.study_file.chain_section import chain_table

if TYPE_CHECKING:
    from doe.dimension_chain import ChainResult
    from doe.pareto import ParetoFront
    from doe.response_surface import Surface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """Everything a report needs."""

    study: Study
    runs: Runs
    surfaces: list[Surface]
    front: ParetoFront
    baseline: Confirmed
    pick: Confirmed
    gains: list[Gain]
    chains: dict[str, ChainResult]
    beside: list[Beside]
    reference_values: Array | None
    cost: dict[str, float]


def run_study(
    study: Study,
    folder: Path,
    workers: int | None,
    progress: Callable[[str], Progress],
    scheduler: str | None = None,
    retry: bool = False,
) -> Outcome:
    """All of it; ``progress(title)`` gives the progress of a stage, ``scheduler`` is the address of a cluster to run on.

    ``retry``: run those again that failed before. Raises InputError, RunError, KeyboardInterrupt.
    """
    from doe import clearance
    from doe.dimension_chain import solve
    from doe.study.store import Store

    started = time.perf_counter()
    # Whatever can be refused is refused before anything runs.
    clearance.check_responses(study)
    clearance.design_scenes(study, to_actual(design_points(study), study.centre, study.step))
    clearance.confirmation_scene(study, study.baseline)
    _chains(study, study.centre)
    reference = reference_runs(study)
    prepared = time.perf_counter()
    runs = run_design(study, folder, workers, progress("design runs"), scheduler, retry)
    if reference is not None:
        reference = reference.only(runs.places)
    simulated = time.perf_counter()
    surfaces = fit_surfaces(study, runs)
    found = find_front(study, surfaces)
    points = (study.baseline, study.rounded(found.points[found.pick]))
    scenes = [clearance.confirmation_scene(study, point) for point in points]
    with Store(folder / STORE, study.path.stem) as store:
        results = clearance.run_scenes(
            scenes, ["baseline", "pick"], store, workers, progress("confirmation"), scheduler, retry=retry
        )
    confirmed = [
        Confirmed(point, *with_errors(study, result.as_dict()))
        for point, result in zip(points, successes(results), strict=True)
    ]
    chains = {name: solve(chain) for name, chain in _chains(study, confirmed[1].point).items()}
    return Outcome(
        study=study,
        runs=runs,
        surfaces=surfaces,
        front=found,
        baseline=confirmed[0],
        pick=confirmed[1],
        gains=gains(study, *confirmed),
        chains=chains,
        beside=[] if reference is None else beside(study, runs, reference),
        reference_values=None if reference is None else reference.values,
        cost={"design_s": simulated - prepared, "total_s": time.perf_counter() - started},
    )


def _chains(study: Study, point: Array) -> dict[str, Any]:
    from doe.dimension_chain import chain_from

    values = dict(zip(study.factors, point.tolist(), strict=True))
    return {
        chain.name: chain_from(chain_table(chain, values[chain.factor]), f"{study.path}: chain {chain.name}")
        for chain in study.file.chain
    }
