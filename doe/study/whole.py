"""The whole study: design, runs, surfaces, front, confirmation, tolerances, dimension chains, a published table beside."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from doe.study.chains import check_chains, solve_chains
from doe.study.confirmation import Confirmed, Gain, confirm, gains
from doe.study.design import check_runs, design_of
from doe.study.direct import Direct, find_direct
from doe.study.failure import Failure
from doe.study.finished import inputs_digest
from doe.study.front import find_front
from doe.study.picks import choices
from doe.study.reference import Beside, beside, reference_runs
from doe.study.runs import STORE, Progress, Runs, ordered_runs, run_design
from doe.study.simulations import Simulations
from doe.study.surfaces import fit_surfaces, with_rivals
from doe.study_file import Study

if TYPE_CHECKING:
    from doe.designs import Design
    from doe.dimension_chain import ChainResult
    from doe.pareto import ParetoFront
    from doe.pareto.tolerance import WidestTolerances
    from doe.response_surface import Surface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """Everything a report needs.

    ``inputs`` is the hash of all it follows from. ``confirmed`` and ``gains`` by name of the point, "baseline" (without gains) and "pick" first. ``tolerances`` is
    None where the study asks for none, ``direct`` unless it was run.
    """

    study: Study
    inputs: str
    design: Design
    runs: Runs
    surfaces: list[Surface]
    front: ParetoFront
    direct: Direct | None
    confirmed: Mapping[str, Confirmed]
    gains: Mapping[str, list[Gain]]
    tolerances: WidestTolerances | None
    chains: Mapping[str, ChainResult]
    beside: list[Beside]
    reference_values: Array | None
    failures: tuple[Failure, ...]
    notes: tuple[str, ...]
    cost: Mapping[str, float]

    @property
    def baseline(self) -> Confirmed:
        """The original design, simulated."""
        return self.confirmed["baseline"]

    @property
    def pick(self) -> Confirmed:
        """The chosen design, simulated."""
        return self.confirmed["pick"]


def run_study(
    study: Study,
    folder: Path,
    workers: int | None,
    progress: Callable[[str], Progress],
    scheduler: str | None = None,
    retry: bool = False,
    direct: bool = False,
) -> Outcome:
    """All of it; ``progress(title)`` gives the progress of a stage, ``scheduler`` is the address of a cluster to run on.

    ``retry``: run those again that failed before. ``direct``: also search the front on the simulator itself. Raises
    InputError, RunError, KeyboardInterrupt.
    """
    from doe.study.store import Store

    clock = _Clock()
    inputs = inputs_digest(study, direct)
    reference = _checked(study)
    runs = run_design(study, folder, workers, progress("design runs"), scheduler, retry)
    clock.lap("design_s")
    surfaces = with_rivals(fit_surfaces(study, runs))
    clock.lap("fit_s")
    found = find_front(study, surfaces)
    clock.lap("front_s")
    with Store(folder / STORE, study.path.stem) as store:
        simulations = Simulations(store, workers, scheduler, retry, progress)
        searched = find_direct(study, found, simulations) if direct else None
        clock.lap("direct_s")
        confirmed, failures = confirm(study, choices(study, found, searched), simulations)
        clock.lap("confirmation_s")
    pick = confirmed["pick"].point
    tolerances = _tolerances(study, surfaces, pick)
    chains, notes = solve_chains(study, pick, tolerances)
    if reference is not None:
        reference = reference.only(runs.places)
    lost = () if searched is None else searched.failures
    return Outcome(
        study=study,
        inputs=inputs,
        design=design_of(study),
        runs=runs,
        surfaces=surfaces,
        front=found,
        direct=searched,
        confirmed=confirmed,
        gains={
            name: gains(study, confirmed["baseline"], each)
            for name, each in confirmed.items()
            if name != "baseline"
        },
        tolerances=tolerances,
        chains=chains,
        beside=[] if reference is None else beside(study, runs, reference),
        reference_values=None if reference is None else reference.values,
        failures=(*runs.failures, *lost, *failures),
        notes=(*runs.notes, *notes),
        cost=clock.total(),
    )


def _checked(study: Study) -> Runs | None:
    """The published runs, if any. Whatever can be refused is refused here, before anything runs. Raises InputError."""
    from doe import clearance

    check_runs(study, ordered_runs(study).design)
    clearance.confirmation_scene(study, study.baseline)
    clearance.direct_scenes(study, study.baseline[None], 0)
    check_chains(study)
    return reference_runs(study)


def _tolerances(study: Study, surfaces: list[Surface], point: Array) -> WidestTolerances | None:
    from doe.study.widest import widest_of

    settings = study.file.tolerances
    return None if settings is None else widest_of(study, surfaces, point, settings)


class _Clock:
    """Wall time of each stage [s]."""

    def __init__(self) -> None:
        self._started = self._last = time.perf_counter()
        self._laps: dict[str, float] = {}

    def lap(self, name: str) -> None:
        """The stage ``name`` ends here."""
        now = time.perf_counter()
        self._laps[name], self._last = now - self._last, now

    def total(self) -> dict[str, float]:
        """All stages and the whole."""
        return {**self._laps, "total_s": time.perf_counter() - self._started}
