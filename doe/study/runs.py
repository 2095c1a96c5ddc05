"""Runs of a design: simulated, or read from a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from doe.designs import central_composite, to_actual, to_coded
from doe.study.failure import Failure, sentence, successes
from doe.study_file import Study
from rbdyn.faults import RunError

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]
# Name of the store in the folder of a study.
STORE = "study.sqlite"


@dataclass(frozen=True)
class Runs:
    """Design runs: coded and actual factors (n, k), responses (n, m) and their 95 % half-widths.

    ``notes``: what the simulations warn of, once each; none for a table that was read. ``replicates`` (n,): how many
    each run is the mean of, 0 where that is not known. ``failures``: design runs that failed; they are not in the arrays.
    """

    coded: Array
    actual: Array
    values: Array
    errors: Array
    notes: tuple[str, ...] = ()
    replicates: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    failures: tuple[Failure, ...] = ()

    def __post_init__(self) -> None:
        if not self.replicates.size:
            object.__setattr__(self, "replicates", np.zeros(len(self.coded), dtype=np.int64))

    @property
    def places(self) -> list[int]:
        """Place in the design, from 0, of every row."""
        failed = {failure.run for failure in self.failures}
        return [row for row in range(len(self.coded) + len(failed)) if row + 1 not in failed]

    def only(self, places: list[int]) -> Runs:
        """The rows at these places."""
        coded, actual, values, errors = (
            array[places] for array in (self.coded, self.actual, self.values, self.errors)
        )
        return Runs(coded, actual, values, errors, self.notes, self.replicates[places])


def design_points(study: Study) -> Array:
    """Coded design points (n, k)."""
    design = study.file.design
    return central_composite(
        len(study.factors), alpha=design.alpha, centre_replicates=design.centre_replicates
    )


def run_design(
    study: Study,
    folder: Path,
    workers: int | None,
    progress: Progress,
    scheduler: str | None = None,
    retry: bool = False,
) -> Runs:
    """Design runs, from the store in ``folder`` or simulated in threads or on a cluster.

    Runs that fail are left out. Raises InputError, KeyboardInterrupt, and RunError when too few are left.
    """
    from doe import clearance
    from doe.study.store import Store

    clearance.check_responses(study)
    coded = design_points(study)
    actual = to_actual(coded, study.centre, study.step)
    scenes = clearance.design_scenes(study, actual)
    labels = [f"design run {run + 1}" for run in range(len(scenes))]
    factors = [dict(zip(study.factors, point.tolist(), strict=True)) for point in actual]
    with Store(folder / STORE, study.path.stem) as store:
        results = clearance.run_scenes(
            scenes, labels, store, workers, progress, scheduler, retry=retry, factors=factors
        )
    failures = tuple(result for result in results if isinstance(result, Failure))
    left = [row for row, result in enumerate(results) if not isinstance(result, Failure)]
    if failures and len(left) < (needed := fewest_runs(study)):
        raise RunError(
            f"only {len(left)} of {len(results)} design runs went well, of which the response models need {needed}: "
            f"{sentence(failures)}"
        )
    found = successes(results[row] for row in left)
    notes = dict.fromkeys(note for result in found for note in result.notes)
    if failures:
        notes[f"{len(failures)} design runs failed and are left out: {sentence(failures)}"] = None
    values, errors = clearance.responses(study, found)
    replicates = np.array([result.replicates for result in found])
    return Runs(coded[left], actual[left], values, errors, tuple(notes), replicates, failures)


def fewest_runs(study: Study) -> int:
    """Runs that the largest response model needs: one a term, and one to judge the fit."""
    k = len(study.factors)
    terms = {"linear": k + 1, "interaction": k * (k + 1) // 2 + 1}
    return 1 + max(terms.get(response.model, (k + 1) * (k + 2) // 2) for response in study.file.response)


def read_runs(study: Study, path: Path) -> Runs:
    """Runs of a CSV table instead of simulated ones. Raises InputError."""
    actual, values = study.read_table(path)
    return Runs(to_coded(actual, study.centre, study.step), actual, values, np.full_like(values, np.nan))
