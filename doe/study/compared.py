"""Fronts of one study beside each other on one scale: what an adaptive search reached run by run, and what other fronts reach."""

from dataclasses import dataclass

import numpy as np

from doe.arrays import Array
from doe.pareto.search import hypervolume, non_dominated
from doe.pareto.simulated import DRAWS, noisy_hypervolume
from doe.study.adaptive import Adaptive, costs_foretold
from doe.study_file import Study


@dataclass(frozen=True, eq=False)
class Compared:
    """Hypervolumes between ``ideal`` and ``nadir`` (q,), in costs, of the front foretold.

    By the last emulators: ``search`` (b,), of the fronts foretold before every batch and after the last, and ``surfaces``, of
    the polynomials' front as it is drawn. By the simulator, with its standard error: ``fresh``, of the search's points by
    their fresh runs.
    """

    ideal: Array
    nadir: Array
    search: Array
    surfaces: float
    fresh: tuple[float, float]


def compared(study: Study, adaptive: Adaptive, on_surfaces: Array) -> Compared:
    """Fronts of a search and of the surfaces, (n, k) in factor units, on one scale."""
    found, goals = adaptive.found, adaptive.found.front.goals
    costs = goals.costs(found.foretold)
    best = costs[non_dominated(costs)]
    scale = best.min(axis=0), best.max(axis=0)
    return Compared(
        *scale,
        search=np.array([hypervolume(goals.costs(found.emulators.predict(each)[0]), *scale) for each in found.fronts]),
        surfaces=hypervolume(costs_foretold(study, adaptive, on_surfaces), *scale),
        fresh=noisy_hypervolume(found.front.costs, found.front.cost_errors, *scale, DRAWS, found.front.seed),
    )
