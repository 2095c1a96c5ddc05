"""A response surface for each response of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from doe.study.runs import Runs
from doe.study_file import Study
from rbdyn.faults import InputError

if TYPE_CHECKING:
    from doe.response_surface import Surface


def fit_surfaces(study: Study, runs: Runs) -> list[Surface]:
    """A surface a response. Raises InputError when the runs do not suffice."""
    from doe.response_surface import fit

    surfaces, faults = [], []
    for response, values in zip(study.file.response, runs.values.T, strict=True):
        try:
            surfaces.append(
                fit(
                    runs.coded,
                    values,
                    name=response.name,
                    model=response.model,
                    centre=study.centre,
                    step=study.step,
                )
            )
        except ValueError as error:
            faults.append(f"{study.path}: {error}")
    if faults:
        raise InputError(faults)
    return surfaces
