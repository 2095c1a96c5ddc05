"""Shares of the parts made about a point that keep something, with what the surfaces leave open."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from doe.arrays import Array, Rows
from doe.pareto.manufacture import SURVIVAL_PARTS, Interval, ToleranceBox, even_offsets, interval_of_share
from doe.pareto.search import dominates
from doe.pareto.tolerance import Kept
from doe.response_surface import Surface
from doe.study.confirmation import Confirmed
from doe.study.goals import goals_of
from doe.study.surface_draws import Simulated, drawn_responses
from doe.study_file import Study

DRAWS = 500  # surfaces, all responses of one draw together
# Coded points (n, k) to their responses (d, n, m) on drawn surfaces, some draws at a time.
Drawn = Callable[[Array], Iterator[Array]]


def draws_of(
    study: Study, surfaces: Sequence[Surface], confirmed: Mapping[str, Confirmed] | None = None, draws: int = DRAWS
) -> Drawn:
    """Draws of the surfaces; those of points that were simulated pass what was found there."""
    points = list((confirmed or {}).values())
    known = None
    if points:
        at, values, errors = (
            np.array([getattr(each, name) for each in points]) for name in ("point", "values", "standard_error")
        )
        known = Simulated(study.coded(at), values, errors)
    return partial(drawn_responses, surfaces, draws=draws, seed=study.file.front.seed, simulated=known)


def keeping(study: Study, drawn: Drawn, point: Array, free: Rows, least: Array) -> Kept:
    """Counts the parts that gain at least so much (q,) over the baseline in every cost and keep all limits.

    Parts (n, f) are values of the ``free`` factors (f,) about a ``point`` (k,).
    """
    goals = goals_of(study)

    def kept(parts: Array) -> Array:
        points = np.tile(point, (len(parts) + 1, 1))
        points[:-1, free] = parts
        points[-1] = study.baseline
        counts = []
        for values in drawn(study.coded(points)):
            costs, made = goals.costs(values), values[:, :-1]
            good = (costs[:, :-1] <= costs[:, -1:] - least).all(axis=2)
            counts.append((good & (goals.violations(made, made) <= 0.0).all(axis=2)).sum(axis=1))
        return np.concatenate(counts)

    return kept


def surviving(study: Study, drawn: Drawn, coded: Array, box: ToleranceBox) -> Interval:
    """Interval of the share of the parts made at a ``coded`` point (k,) that dominate the nominal baseline."""
    goals = goals_of(study)
    made = coded + box.half * even_offsets(SURVIVAL_PARTS, box.half.size, box.distribution)
    counts = []
    for values in drawn(np.vstack([made, study.coded(study.baseline)])):
        costs = goals.costs(values)
        counts.append(dominates(costs[:, :-1], costs[:, -1:]).sum(axis=1))
    return interval_of_share(np.concatenate(counts), len(made))


def open_errors(surfaces: Sequence[Surface], searched: bool = False) -> str:
    """What the interval of a share of parts holds, and what it takes as exact, in sentences."""
    form = "" if searched or all(surface.model_error for surface in surfaces) else "the form of the surfaces, "
    source = "what the search leaves open" if searched else "the errors of the surfaces"
    return (
        f"The interval holds {source} and the count of the parts; {form}numerical errors and the scene's inputs count as "
        "exact."
    )
