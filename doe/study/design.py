"""The design of a study: its points and what they can tell about the models asked for."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from doe.designs import Design, box_behnken, central_composite, full_factorial, latin_hypercube, sobol
from doe.designs.model import model_terms
from doe.study_file import Study
from doe.study_file.design_section import KEYS_OF
from doe.study_file.design_section import Design as DesignSettings
from rbdyn.faults import InputError, refuse

ALL = (central_composite, box_behnken, full_factorial, latin_hypercube, sobol)
MAKERS: dict[str, Callable[..., Design]] = {make.__name__: make for make in ALL}


def design_of(study: Study) -> Design:
    """The design in the order of its runs. Raises InputError when its settings are impossible."""
    try:
        design = _design(study.file.design.model_dump_json(exclude_unset=True), len(study.factors))
    except ValueError as error:
        raise InputError([f"{study.path}: design.{error}"]) from None
    whole = np.array([factor.whole for factor in study.file.factor])
    return replace(design, coded=np.where(whole, study.coded(np.rint(study.actual(design.coded))), design.coded))


@cache
def _design(text: str, factors: int) -> Design:
    """The design of settings in JSON; several steps of a study ask for it, and some designs take a while."""
    settings = DesignSettings.model_validate_json(text)
    make, seed = MAKERS[settings.kind], {"seed"} if settings.kind in ("latin_hypercube", "sobol") else set()
    keys = settings.model_dump(include=KEYS_OF[settings.kind] | seed)
    design = make(factors, centre_replicates=settings.centres, **keys)
    return design.by_blocks(settings.seed if settings.order == "random" else None)


def check_runs(study: Study, design: Design) -> None:
    """Raises InputError with every response whose model the runs do not suffice for."""
    from doe.designs.evaluation import lost_terms

    runs, factors = design.coded.shape
    faults = []
    for number, response in enumerate(study.file.response, 1):
        terms = model_terms(factors, response.model)
        where = f"{study.path}: response[{number}].model = {response.model!r}"
        needed = len(terms) + design.blocks
        what = f"{len(terms)} terms" + (f", {design.blocks - 1} block effects" if design.blocks > 1 else "")
        if runs < needed:
            few = f"the {runs} runs of the design are too few; it needs {needed} ({what} and one to judge the fit)"
            faults.append(f"{where}: {few}: enlarge the design or choose a simpler model")
        elif lost := lost_terms(design.coded, terms, design.block):
            mend = "add levels or centre points, or choose a simpler model"
            faults.append(f"{where}: the runs of the design cannot tell {', '.join(lost)} from the other terms; {mend}")
    refuse(faults)


def evaluation(study: Study, design: Design) -> dict[str, Any]:
    """What the design can tell about the largest model that a response asks for, with its name as ``model``.

    See `doe.designs.evaluation.evaluate`. Raises InputError when the runs do not suffice.
    """
    from doe.designs.evaluation import evaluate

    check_runs(study, design)
    factors = len(study.factors)
    model = max((response.model for response in study.file.response), key=lambda each: len(model_terms(factors, each)))
    terms = model_terms(factors, model)
    judged = evaluate(design.coded, terms, design.block, region=design.region, reach=design.extent)
    return {"model": model, **judged}
