"""The front of the simulator itself, and what the response surfaces lose against it."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from doe import clearance
from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.pareto import ParetoFront
from doe.pareto.direct import DirectFront, direct_front, repeated
from doe.pareto.search import spread
from doe.pareto.surrogate_loss import SurrogateLoss, compare_with_surrogate
from doe.running.failure import Failure, grouped
from doe.running.runner import Progress
from doe.study.goals import goals_of, region_of
from doe.study.surfaces import standard_errors
from doe.study_file import Study
from rbdyn.faults import InputError, MethodError, RunError
from rbdyn.scene import Scene


@dataclass(frozen=True, eq=False)
class Direct:
    """Front of the simulator and the surfaces' front run on it.

    ``surrogate_points`` (s, k) of the surfaces' front, in factor units, with the means (s, m) of their runs and the
    standard errors (s, m) of these. ``failures``: every evaluation that failed. ``seconds``: wall time of the
    search and of the comparison.
    """

    name: ClassVar[str] = "direct"
    front: DirectFront
    surrogate_points: Array
    surrogate_values: Array
    surrogate_errors: Array
    loss: SurrogateLoss
    failures: tuple[Failure, ...]
    seconds: Mapping[str, float]


class Evaluator:
    """Runs generations of points on the simulator, every row with a seed of its own: a running number.

    So a search that is begun again asks for the same runs in the same order, and the store answers at once.
    """

    def __init__(self, study: Study, simulations: Simulations, progress: Progress, total: int) -> None:
        self._study, self._simulations = study, simulations
        self._progress, self._total = progress, total
        self.done = 0
        self.failures: list[Failure] = []

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Responses (n, m) and their standard errors (n, m) at points (n, k) in factor units; NaN where a run failed."""
        values, errors, samples = self.run(clearance.direct_scenes(self._study, points, self.done), "direct run")
        return values, standard_errors(errors, samples)

    def run(self, scenes: list[Scene], label: str) -> tuple[Array, Array, Whole]:
        """Responses (n, m) of scenes, 95 % half-widths (n, m) and how many values are behind these (n, m)."""
        labels = [f"{label} {self.done + row}" for row in range(1, len(scenes) + 1)]
        results = self._simulations.run(scenes, labels, self._watch)
        self.done += len(scenes)
        values = np.full((len(scenes), len(self._study.responses)), np.nan)
        errors, samples = values.copy(), np.zeros(values.shape, dtype=np.int64)
        for row, result in enumerate(results):
            if isinstance(result, Failure):
                self.failures.append(result)
            else:
                (values[row],), (errors[row],), (samples[row],) = clearance.figures(self._study.responses, [result])
        return values, errors, samples

    def _watch(self, done: int, total: int) -> None:
        self._progress(self.done + done, max(self._total, self.done + total))


def find_direct(study: Study, on_surfaces: ParetoFront, simulations: Simulations) -> Direct:
    """Search the front on the simulator, then run as many points of the surfaces' front on it, and compare.

    Raises RunError where every run of a stage fails, InputError for impossible settings, KeyboardInterrupt.
    """
    settings, reach = study.file.direct, region_of(study)
    evaluate = Evaluator(study, simulations, simulations.progress("direct front"), settings.evaluations)
    started = time.perf_counter()
    try:
        front = direct_front(
            evaluate,
            study.actual(-reach),
            study.actual(reach),
            goals=goals_of(study),
            baseline=study.baseline,
            pick=study.file.front.pick,
            **settings.model_dump(include={"evaluations", "population", "seed", "confidence", "resample"}),
        )
        searched = time.perf_counter()
        rows = spread(on_surfaces.costs, len(front.points), [on_surfaces.pick])[: len(front.points)]
        # As many runs a point as a finalist of the direct front has.
        surrogate = repeated(evaluate, on_surfaces.points[rows], front.repeats)
        loss = compare_with_surrogate(front, surrogate.values, surrogate.errors, seed=settings.seed)
    except MethodError as error:
        if evaluate.failures:
            causes = "; ".join(group["cause"] for group in grouped(evaluate.failures))
            raise RunError(f"direct front: {error} ({causes})") from None
        raise InputError([f"{study.path}: direct: {error}"]) from None
    seconds = {"search": searched - started, "comparison": time.perf_counter() - searched}
    return Direct(front, *surrogate, loss, tuple(evaluate.failures), seconds)
