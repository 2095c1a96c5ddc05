"""A response surface for each response of a study, and its rival."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from doe.study.runs import Runs
from doe.study_file import Study
from rbdyn.faults import InputError

if TYPE_CHECKING:
    from doe.response_surface import Surface

Array = NDArray[np.float64]


def fit_surfaces(study: Study, runs: Runs) -> list[Surface]:
    """A surface a response. Raises InputError when the runs do not suffice."""
    from doe.response_surface import fit

    surfaces, faults = [], []
    errors = standard_errors(runs.errors, runs.replicates)
    for response, values, error in zip(study.file.response, runs.values.T, errors.T, strict=True):
        try:
            surfaces.append(
                fit(
                    runs.coded,
                    values,
                    name=response.name,
                    model=response.model,
                    centre=study.centre,
                    step=study.step,
                    standard_errors=error,
                    replicates=runs.replicates,
                    weighting=response.weighting,
                    block=runs.block,
                    transform=response.transform,
                )
            )
        except ValueError as error_of_fit:
            faults.append(f"{study.path}: {error_of_fit}")
    if faults:
        raise InputError(faults)
    return surfaces


def with_rivals(surfaces: Sequence[Surface], seed: int = 1) -> list[Surface]:
    """The surfaces, each compared with a Gaussian process by leaving out every point in turn.

    It takes of the order of a second a response. ``rival`` stays None where too few points can be left out.
    """
    from doe.response_surface import model_matrix
    from doe.response_surface.comparison import compare

    compared = []
    for surface in surfaces:
        data = surface.data
        try:
            rival = compare(
                data.points,
                data.values,
                surface.refit,
                name=surface.name,
                matrix=model_matrix(data.points, surface.terms),
                standard_errors=data.standard_errors if surface.weighting == "replicates" else None,
                seed=seed,
            )
        except ValueError:
            compared.append(surface)
        else:
            compared.append(replace(surface, rival=rival))
    return compared


def standard_errors(half_widths: Array, replicates: NDArray[np.int64] | None) -> Array:
    """Standard errors of means from the half widths (n, m) of their 95 % intervals.

    The quantile is Student's with ``replicates`` - 1 degrees of freedom; of unknown numbers (0) the normal one.
    """
    from scipy import special

    number = np.zeros(len(half_widths)) if replicates is None else np.asarray(replicates, float)
    quantile = np.where(number > 1, special.stdtrit(np.maximum(number - 1, 1), 0.975), special.ndtri(0.975))
    errors: Array = half_widths / quantile[:, None]
    return errors
