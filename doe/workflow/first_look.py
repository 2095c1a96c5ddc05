"""What is known of the limits before the design ends: the original design, simulated first, then the corners of the region.

The runs are those of the confirmation and of the design, which find them in the store. That the original misses a limit says
nothing of the region; that all corners miss it too, also extrapolated to the bounds of the search, makes it likely that no
point keeps it.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from doe import clearance
from doe.duty import DutyResult
from doe.running.runner import Progress
from doe.running.store import Failure
from doe.workflow.confirmation import Confirmed, Limit, every_limit
from doe.workflow.problem import Problem
from doe.workflow.surfaces import standard_errors
from rbdyn.base.arrays import Array
from rbdyn.base.words import Notice, counted, quantity, shown, with_error
from rbdyn.result import SimulationResult

Outcome = SimulationResult | DutyResult | Failure


def original_sentences(study: Problem, baseline: Confirmed) -> list[str]:
    """Figures of the original at each point of the duty, and the limits that it misses."""
    responses = zip(study.responses, baseline.values.tolist(), baseline.error.tolist(), strict=True)
    figures: Mapping[str, Mapping[str, tuple[float, float | None]]] = {
        f" at {point}": {name: (figure.value, figure.stated_error) for name, figure in at_point.items()}
        for point, at_point in baseline.at_points.items()
    } or {"": {name: (value, error) for name, value, error in responses}}
    sentences = [
        f"original design{point}: {', '.join(_figure(name, *figure) for name, figure in row.items())}"
        for point, row in figures.items()
    ]
    missed = [limit for limit in every_limit(study, baseline) if limit.verdict != "kept"]
    words = ", ".join(f"{limit.bound_words} by {limit.excess_words}" for limit in missed if limit.room < 0.0)
    open_words = ", ".join(limit.bound_words for limit in missed if limit.room >= 0.0)
    return [
        *sentences,
        *([f"the original misses {words}: the study looks for points that do not"] if words else []),
        *([f"the original keeps {open_words} by less than its error"] if open_words else []),
    ]


def _figure(name: str, value: float, error: float | None) -> str:
    words, unit = quantity(name)
    return f"{words} {with_error(value, error)} {unit}".rstrip()


def first_look(study: Problem, folder: Path, original: Confirmed, progress: Progress, notice: Notice) -> Progress:
    """Show the original at once. Returns the same progress of the design runs, which shows what its corners say of the limits."""
    if notice is None:
        return progress
    for sentence in original_sentences(study, original):
        notice(sentence)
    missed = [limit for limit in every_limit(study, original) if limit.verdict == "broken"]
    if not missed:
        return progress
    ordered = study.plan
    rows = [row for row, kind in enumerate(ordered.design.kind) if kind == "cube"]
    runs, labels = [ordered.scenes[row] for row in rows], [ordered.labels[row] for row in rows]
    waiting = bool(rows)

    def watch(done: int, total: int) -> None:
        nonlocal waiting
        progress(done, total)
        if waiting and len(rows) <= done < total and (results := clearance.stored(folder, runs, labels)) is not None:
            waiting = False
            for sentence in unlikely(study, missed, ordered.design.coded[rows], results):
                notice(sentence)

    return watch


def unlikely(study: Problem, missed: Sequence[Limit], coded: Array, results: Sequence[Outcome]) -> list[str]:
    """Sentences on the limits that the original and all corners miss, and a plane through these too.

    ``results`` (n) at ``coded`` corners (n, k); failed ones are left out. The plane is followed to the bounds of the search; it
    counts where it is beyond the limit by twice the standard error of a run.
    """
    sound = [(place, result) for place, result in zip(coded, results, strict=True) if not isinstance(result, Failure)]
    values, halves, number = clearance.figures(study.responses, [result for _, result in sound])
    errors = np.nan_to_num(standard_errors(halves, number))
    terms = np.array([[1.0, *place] for place, _ in sound])
    if len(sound) <= coded.shape[1] or np.linalg.matrix_rank(terms) < terms.shape[1]:
        return []
    sentences = []
    for limit in missed:
        column, sign = study.responses.index(limit.response), 1.0 if limit.sense == "<=" else -1.0
        excess = sign * (values[:, column] - limit.bound)
        plane = np.linalg.lstsq(terms, excess, rcond=None)[0]
        least = float(plane[0] - np.abs(plane[1:]) @ study.reach)
        if min(excess.min(), least) > 2.0 * errors[:, column].max():
            nearest, end = (shown(limit.bound + sign * value, 3) for value in (float(excess.min()), least))
            sentences.append(
                f"likely no point keeps {limit.bound_words}: the nearest of {counted(len(sound), 'corner')} has {nearest}, and a plane "
                f"through them {end} at the bounds of the region; to change the limit, stop by Ctrl-C (finished runs are kept)"
            )
    return sentences
