"""A response surface for each response of a study, and its rival."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import special

from doe.arrays import Array, Whole
from doe.response_surface import Surface, fit, model_matrix
from doe.study.runs import Runs
from doe.study_file import Study
from doe.study_file.study import Fitted
from doe.threads import one_thread
from rbdyn.faults import MethodError, refuse

# Runs of which a Gaussian process takes some 10 s; of 1000 it took 3 s, of 3000 45 s and 0.9 GB.
MOST_RIVALLED = 1500


@one_thread
def fit_surfaces(study: Study, runs: Runs) -> list[Surface]:
    """A surface a response. Raises InputError when the runs do not suffice."""
    surfaces, faults = [], []
    number = independent_values(runs)
    errors = standard_errors(runs.errors, number)
    units: dict[str, Any] = {"centre": study.centre, "step": study.step, "block": runs.block}
    units["without"] = study.inactive
    columns = zip(study.file.response, runs.values.T, errors.T, number.T, strict=True)
    for response, values, error, behind in columns:
        asked = response.model_dump(include={"name", *Fitted.model_fields}) | units
        try:
            surfaces.append(fit(runs.coded, values, standard_errors=error, replicates=behind, **asked))
        except MethodError as error_of_fit:
            faults.append(f"{study.path}: {error_of_fit}")
    refuse(faults)
    return surfaces


@one_thread
def with_rivals(surfaces: Sequence[Surface]) -> list[Surface]:
    """The surfaces, each compared with a Gaussian process by leaving out every point in turn.

    It takes of the order of a second a response. ``rival`` stays None where too few points can be left out, or there are
    too many runs (`unrivalled` says so).
    """
    from doe.response_surface.comparison import compare

    found = list(surfaces)
    for place, surface in enumerate(surfaces):
        if len(surface.data.values) > MOST_RIVALLED:
            continue
        data, matrix = surface.data, model_matrix(surface.data.points, surface.terms)
        errors = data.standard_errors if surface.weighting == "replicates" else None
        with suppress(MethodError):
            runs = data.points, data.values, surface.refit
            rival = compare(*runs, name=surface.name, matrix=matrix, standard_errors=errors)
            found[place] = replace(surface, rival=rival)
    return found


def unrivalled(surfaces: Sequence[Surface]) -> list[str]:
    """A note where surfaces have too many runs to be compared with a Gaussian process; else none."""
    runs = max(len(surface.data.values) for surface in surfaces)
    why = f"a Gaussian process of more than {MOST_RIVALLED} takes too long"
    return [f"{runs} runs are not compared with a rival: {why}"] if runs > MOST_RIVALLED else []


def independent_values(runs: Runs) -> Whole:
    """How many are behind each half width, shape (n, m), from ``runs.replicates``: (n,), (n, m) or None; 0: unknown."""
    given = np.zeros(len(runs.values)) if runs.replicates is None else np.asarray(runs.replicates)
    per_response = given if given.ndim == 2 else given[:, None]
    return np.array(np.broadcast_to(per_response, runs.values.shape), np.int64)


def standard_errors(half_widths: Array, number: Whole) -> Array:
    """Standard errors of means from the half widths (n, m) of their 95 % intervals.

    The quantile is Student's with ``number`` - 1 degrees of freedom, where ``number`` (n, m) counts the independent
    values behind each mean; of unknown numbers (0) it is the normal one.
    """
    student = special.stdtrit(np.maximum(number - 1, 1), 0.975)
    return half_widths / np.where(number > 1, student, special.ndtri(0.975))
