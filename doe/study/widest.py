"""The widest tolerances of a study's factors about a point, within which parts keep its gains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from doe.designs import to_coded
from doe.study.drawn import draw_all, predict_all, predict_paired
from doe.study.goals import goals_of, known_tolerances, region_of
from doe.study_file import Study
from doe.study_file.front_section import Tolerances

if TYPE_CHECKING:
    from doe.pareto.tolerance import WidestTolerances
    from doe.response_surface import Surface

Array = NDArray[np.float64]


def widest_of(
    study: Study, surfaces: Sequence[Surface], point: Array, settings: Tolerances
) -> WidestTolerances:
    """Widest half widths, in factor units, about a point (k,) in factor units.

    A part keeps its promise when every response with a goal has at least the share ``keep`` of the gain that the
    surfaces predict at the point (or, where they predict a loss, loses no more), and when all limits hold.
    """
    from doe.pareto.tolerance import widest_tolerances

    goals = goals_of(study)
    base, nominal = (to_coded(each, study.centre, study.step)[None] for each in (study.baseline, point))
    gain = (goals.costs(predict_all(surfaces, base)) - goals.costs(predict_all(surfaces, nominal)))[0]
    keep = np.where(gain > 0.0, settings.keep * gain, gain)
    drawn = draw_all(surfaces, settings.samples, settings.seed) if settings.surface_uncertainty else None

    def responses(coded: Array) -> Array:
        if drawn is None:
            return predict_all(surfaces, coded)
        return predict_paired(surfaces, drawn, coded)

    def objectives(points: Array) -> Array:
        values = responses(to_coded(points, study.centre, study.step))
        return np.hstack([goals.costs(values), goals.violations(values, values)])

    reference = goals.costs(responses(np.repeat(base, settings.samples, axis=0)))
    held = np.zeros((settings.samples, len(goals.limited)))
    known = known_tolerances(study)
    ratios = [known.get(name, np.nan) for name in study.factors]
    reach = region_of(study) * study.step
    return widest_tolerances(
        objectives,
        point,
        np.hstack([reference - keep, held]) + 1e-9 * np.abs(gain).max(),
        study.step if np.isnan(ratios).any() else ratios,
        lower=study.centre - reach,
        upper=study.centre + reach,
        names=[
            *(f"the gain of {study.responses[index]}" for index in goals.objectives),
            *(f"{study.responses[index]} {sense} {limit:g}" for index, sense, limit in goals.limited),
        ],
        probability=settings.probability,
        distribution=settings.distribution,
        samples=settings.samples,
        seed=settings.seed,
        aim=settings.aim,
    )
