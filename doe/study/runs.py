"""Runs of a design: simulated, or read from a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from doe.designs import to_actual, to_coded
from doe.study.design import check_runs, design_of
from doe.study_file import Study

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Runs:
    """Design runs: coded and actual factors (n, k), responses (n, m) and their 95 % half-widths.

    ``notes``: what the simulations warn of, once each; none for a table that was read. ``replicates``, (n,)
    or (n, m), count the independent values behind the half-widths (0: unknown), ``block`` (n,) labels each run; None:
    all unknown, one block.
    """

    coded: Array
    actual: Array
    values: Array
    errors: Array
    notes: tuple[str, ...] = ()
    replicates: NDArray[np.int64] | None = None
    block: NDArray[np.int64] | None = None


def design_points(study: Study) -> Array:
    """Coded design points (n, k) in the order of the runs. Raises InputError when the design is impossible."""
    return design_of(study).coded


def run_design(study: Study, folder: Path, workers: int | None, progress: Progress) -> Runs:
    """Design runs, from the store in ``folder`` or simulated. Raises InputError, RunError, KeyboardInterrupt."""
    from doe import clearance
    from doe.study.store import Store

    clearance.check_responses(study)
    design = design_of(study)
    check_runs(study, design)
    coded = design.coded
    actual = to_actual(coded, study.centre, study.step)
    scenes = clearance.design_scenes(study, actual, design.order.tolist())
    labels = [f"design run {run + 1}" for run in range(len(scenes))]
    with Store(folder / "study.sqlite") as store:
        results = clearance.run_scenes(scenes, labels, store, workers, progress)
    notes = dict.fromkeys(note for result in results for note in result.notes)
    return Runs(coded, actual, *clearance.responses(study, results), tuple(notes))


def read_runs(study: Study, path: Path) -> Runs:
    """Runs of a CSV table instead of simulated ones. Raises InputError."""
    table = study.read_table(path)
    coded = to_coded(table.actual, study.centre, study.step)
    return Runs(
        coded, table.actual, table.values, table.errors, replicates=table.replicates, block=table.block
    )
