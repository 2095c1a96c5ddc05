"""The Pareto front of a study on its response surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from doe.designs import to_coded
from doe.study.design import design_of
from doe.study_file import Study
from rbdyn.faults import InputError

if TYPE_CHECKING:
    from doe.pareto import ParetoFront
    from doe.response_surface import Surface

Array = NDArray[np.float64]


def find_front(study: Study, surfaces: Sequence[Surface]) -> ParetoFront:
    """Pareto front on the surfaces, within the reach of the design; all signs turned so that small is good."""
    from doe.pareto import front

    if len(surfaces) < 2:
        raise InputError([f"{study.path}: response: one alone has no front; add a second"])
    reach = design_of(study).reach * study.step

    def objectives(points: Array) -> Array:
        coded = to_coded(points, study.centre, study.step)
        return np.column_stack([surface.predict(coded) for surface in surfaces]) * study.signs

    settings = study.file.front
    return front(
        objectives,
        study.centre - reach,
        study.centre + reach,
        population=settings.population,
        generations=settings.generations,
        seed=settings.seed,
        baseline=study.baseline,
    )
