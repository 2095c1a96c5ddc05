"""What is wrong with a study can be told before anything runs, by one judgement for all commands."""

from __future__ import annotations

from doe.study.chains import check_chains
from doe.study.design import check_runs
from doe.study.reference import reference_runs
from doe.study.runs import Runs, ordered_runs
from doe.study_file import Study
from rbdyn.faults import InputError


def check_study(study: Study) -> Runs | None:
    """The published runs, if any, of a study whose keys, responses, scenes, design and chains can be used.

    Raises InputError with the faults of all of these at once.
    """
    from doe import clearance

    faults: list[str] = []
    for check in (
        lambda: check_runs(study, ordered_runs(study).design),
        lambda: clearance.confirmation_scene(study, study.baseline),
        lambda: clearance.check_direct(study),
        lambda: check_chains(study),
    ):
        try:
            check()
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(dict.fromkeys(faults))
    return reference_runs(study)
