"""What can be told to be wrong with a study before anything runs: one judgement for all commands."""

from doe import clearance
from doe.study.adaptive import check_adaptive
from doe.study.chains import check_chains
from doe.study.design import check_runs
from doe.study.reference import reference_runs
from doe.study.runs import Runs, ordered_runs
from doe.study_file import Study
from rbdyn.faults import check_all


def check_study(study: Study, adaptive: bool = False) -> Runs | None:
    """The published runs, if any; ``adaptive``: also of that search. Raises InputError with all faults of keys, responses, scenes, design and chains."""
    check_all(
        (
            lambda: check_runs(study, ordered_runs(study).design),
            lambda: clearance.confirmation_scene(study, study.baseline),
            lambda: check_chains(study),
            lambda: check_adaptive(study, adaptive),
        )
    )
    return reference_runs(study)
