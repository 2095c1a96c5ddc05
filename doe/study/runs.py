"""Runs of a design: simulated, or read from a table."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from doe import clearance
from doe.arrays import Array, Whole
from doe.designs import Design
from doe.running.keeper import AgendaKeeper
from doe.running.runner import Progress
from doe.running.store import Failure, Store, alike, sentence
from doe.study.design import actual_of, check_runs, design_of, terms_of
from doe.study_file import Study
from doe.study_file.table import read_table
from rbdyn.base.words import are, counted
from rbdyn.faults import RunError
from rbdyn.scene import Scene

# Name of the store in the folder of a study.
STORE = "study.sqlite"


@dataclass(frozen=True)
class Runs:
    """Design runs: coded and actual factors (n, k), responses (n, m) and their 95 % half-widths.

    ``notes``: what the simulations warn of, once each; none for a table that was read. ``replicates``, (n,) or (n, m),
    count the independent values behind the half-widths (0: unknown), ``block`` (n,) labels each run; None: all unknown,
    one block. ``failures``: design runs that failed; they are not in the arrays. ``turns``: shaft turns that all runs took.
    """

    coded: Array
    actual: Array
    values: Array
    errors: Array
    notes: tuple[str, ...] = ()
    replicates: Whole | None = None
    block: Whole | None = None
    failures: tuple[Failure, ...] = ()
    turns: float = 0.0

    @property
    def places(self) -> list[int]:
        """Place in the design, from 0, of every row."""
        failed = {failure.run for failure in self.failures}
        return [row for row in range(len(self.coded) + len(failed)) if row + 1 not in failed]

    def only(self, places: list[int]) -> Self:
        """The rows at these places."""
        coded, actual, values, errors = (array[places] for array in (self.coded, self.actual, self.values, self.errors))
        replicates, block = (None if array is None else array[places] for array in (self.replicates, self.block))
        return type(self)(coded, actual, values, errors, self.notes, replicates, block)


@dataclass(frozen=True)
class Ordered:
    """The design runs as they are to be simulated: coded and actual factors (n, k), and of each run its scene, its label
    and its factors by name."""

    design: Design
    actual: Array
    scenes: list[Scene]
    labels: list[str]
    factors: list[dict[str, float]]


def ordered_runs(study: Study) -> Ordered:
    """Every run of the study's design. Raises InputError when the design, a scene or a response is impossible."""
    clearance.check_responses(study)
    design = design_of(study)
    actual = actual_of(study, design)
    scenes = clearance.design_scenes(study, actual, design.order.tolist())
    labels = [f"design run {run}" for run in range(1, len(actual) + 1)]
    return Ordered(design, actual, scenes, labels, [study.by_factor(point) for point in actual])


def run_design(
    study: Study,
    folder: Path,
    workers: int | None,
    progress: Progress,
    scheduler: str | None = None,
    retry: bool = False,
    agenda: AgendaKeeper | None = None,
) -> Runs:
    """Design runs, from the store in ``folder`` or simulated in threads or on a cluster.

    Runs that fail are left out. Raises InputError, KeyboardInterrupt, and RunError when too few are left.
    """
    ordered = ordered_runs(study)
    check_runs(study, ordered.design)
    with Store(folder / STORE, study.path.stem) as store:
        simulations = clearance.Simulations(store, workers, scheduler, retry, lambda title: progress, agenda)
        return runs_of(study, ordered, simulations, progress)


def runs_of(study: Study, ordered: Ordered, simulations: clearance.Simulations, progress: Progress) -> Runs:
    """The same of runs that were checked."""
    design, coded, actual = ordered.design, ordered.design.coded, ordered.actual
    results = simulations.run(ordered.scenes, ordered.labels, progress, ordered.factors)
    failures = tuple(result for result in results if isinstance(result, Failure))
    left = [row for row, result in enumerate(results) if not isinstance(result, Failure)]
    # One a term, one a block beyond the first, one to judge the fit.
    needed = design.blocks + max(len(terms_of(study, response.model)) for response in study.file.response)
    if failures and len(left) < needed:
        few = f"only {len(left)} of {len(results)} design runs went well, of which the response models need {needed}"
        raise RunError(f"{few}: {sentence(failures)}")
    sound = [result for result in results if not isinstance(result, Failure)]
    notes = _each_once(note for result in sound for note in result.notes)
    if failures:
        notes.append(
            f"{counted(len(failures), 'design run')} failed and {are(len(failures))} left out: {sentence(failures)}"
        )
    values, errors, independent = clearance.figures(study.responses, sound)
    block = np.array(design.block_numbers)[left] if design.blocks > 1 else None
    return Runs(
        coded[left], actual[left], values, errors, tuple(notes), independent, block, failures, turns=simulations.turns
    )


def _each_once(notes: Iterable[str]) -> list[str]:
    """Notes of all runs; of those that differ in their numbers only the first, and how many there are."""
    told = ((group, len(set(group)) == 1) for group in alike(notes, str))
    return [group[0] if same else f"{group[0]} (so or similarly {len(group)} runs)" for group, same in told]


def read_runs(study: Study, path: Path) -> Runs:
    """Runs of a CSV table instead of simulated ones. Raises InputError."""
    table = read_table(path, study.factors, study.responses, study.path)
    coded = study.coded(table.actual)
    return Runs(coded, table.actual, table.values, table.errors, replicates=table.replicates, block=table.block)
