"""Designed experiments: design, response surface, Pareto front, dimension chain, and the study that joins them.

From Python: ``study``, ``run``, ``uncertainty``, ``calibrate``, ``design``, ``fit``, ``front`` and ``chain`` do what the commands of these
names do. Each returns an answer that shows, tabulates and saves itself, and prints nothing.

- ``designs``, ``response_surface``, ``pareto``, ``emulator``, ``adaptive``, ``unknown``, ``dimension_chain``: methods that know
  no bearing
- ``study_file``: STUDY.toml, checked; ``running``: runs and their store
- ``clearance``: the bearing of a study; the only module that runs bearing simulations
- ``workflow``: the steps of a study and the whole of it; ``report``: what a person sees; ``library``: the functions above;
  ``commands``: the command ``doe``

Names are fetched when first used: importing the package loads nothing else but itself.
"""

TYPE_CHECKING = False  # as type checkers take it, without ``typing``
if TYPE_CHECKING:
    from doe.library.answer import Answer
    from doe.library.scene_runs import RunsAnswer, run, run_answer
    from doe.library.steps import ChainAnswer, DesignAnswer, FitAnswer, FrontAnswer, chain, design, fit, front
    from doe.library.studies import CalibrationAnswer, StudyAnswer, UncertaintyAnswer, calibrate, study, uncertainty
    from rbdyn.base.faults import InputError, RunError

_HOMES = {
    "rbdyn.base.faults": ("InputError", "RunError"),
    "doe.library.answer": ("Answer",),
    "doe.library.scene_runs": ("RunsAnswer", "run", "run_answer"),
    "doe.library.steps": ("ChainAnswer", "DesignAnswer", "FitAnswer", "FrontAnswer", "chain", "design", "fit", "front"),
    "doe.library.studies": (
        "CalibrationAnswer",
        "StudyAnswer",
        "UncertaintyAnswer",
        "calibrate",
        "study",
        "uncertainty",
    ),
}

__all__ = [
    "Answer", "CalibrationAnswer", "ChainAnswer", "DesignAnswer", "FitAnswer", "FrontAnswer", "InputError", "RunError",
    "RunsAnswer", "StudyAnswer", "UncertaintyAnswer", "calibrate", "chain", "design", "fit", "front", "run", "run_answer", "study", "uncertainty",
]  # fmt: skip


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name == "__version__":
        return import_module("importlib.metadata").version("rbdyn")
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(home), name)
    raise AttributeError(f"module 'doe' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
