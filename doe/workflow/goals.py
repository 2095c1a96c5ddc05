"""Goals, tolerances and region of a study as the methods want them."""

from itertools import compress

import numpy as np

from doe.pareto.goals import BLANK, Goals
from doe.pareto.manufacture import ToleranceBox
from doe.study_file import Study
from doe.workflow.runs import design_of
from rbdyn.base.arrays import Array, Mask
from rbdyn.base.faults import InputError, refuse


def goals_of(study: Study) -> Goals:
    """What is wanted of the study's responses."""
    responses = study.file.response
    rest = {key: [getattr(each, key) for each in responses] for key in BLANK}
    return Goals.of([response.goal for response in responses], **rest)


def check_goals(study: Study) -> None:
    """Raises InputError where a study has no front: too few goals, or no tolerances for the tolerance-aware one."""
    if len(goals_of(study).objectives) < 2:
        raise InputError([f"{study.path}: response: one alone has no front; add a second with a goal"])
    if study.file.front.tolerance_aware != "none":
        tolerances_of(study)


def region_of(study: Study) -> Array:
    """Half ranges (k,) in coded units, about the centre 0, of the box in which the design searches."""
    return np.full(len(study.factors), design_of(study).reach)


def rounded_within(study: Study, point: Array) -> Array:
    """A point (k,) in factor units at the resolution of the drawing, which does not round it out of the region."""
    reach, rounded = region_of(study) * study.step, study.rounded(point)
    finest = np.array([factor.finest or 0.0 for factor in study.file.factor])
    out = np.abs(rounded - study.centre) > reach * (1.0 + 1e-9)
    inward = study.rounded(rounded + np.sign(study.centre - rounded) * finest)
    return np.where(out & (np.abs(inward - study.centre) <= reach * (1.0 + 1e-9)), inward, rounded)


def beyond_runs(study: Study, coded: Array) -> bool:
    """Whether a coded point (k,) is farther out than the region that the runs reach: the surfaces extrapolate there."""
    design = design_of(study)
    distance = np.linalg.norm(coded) if design.region == "ball" else np.abs(coded).max()
    return bool(distance > design.extent * (1.0 + 1e-4))


def rigid(study: Study) -> Mask:
    """Which factors (k,) have no tolerance: whole numbers, and those that mean nothing at the study's categories."""
    return np.array([one.whole or place in study.inactive for place, one in enumerate(study.file.factor)])


def known_tolerances(study: Study) -> dict[str, float]:
    """Half widths of the factors that have any, in their units: their own, else the narrowest of the chains that close on
    them."""
    known = {}
    for factor in compress(study.file.factor, ~rigid(study)):
        closing = [chain.half_width_mm for chain in study.file.chain if chain.factor == factor.name]
        widths = [width for width in closing if width is not None]
        if factor.tolerance is not None or widths:
            known[factor.name] = min(widths) if factor.tolerance is None else factor.tolerance
    return known


def tolerance_box(study: Study) -> ToleranceBox | None:
    """What the tolerance-aware front makes of the parts; None where the study asks for none. Raises as `tolerances_of`."""
    front = study.file.front
    if front.tolerance_aware == "none":
        return None
    parts = front.quantile, front.distribution, front.tolerance_samples
    return ToleranceBox(tolerances_of(study), front.tolerance_aware, *parts)


def tolerances_of(study: Study) -> Array:
    """Half widths (k,) of all factors in coded units, 0 of those that have no tolerance. Raises InputError for each other
    one that is missing or too wide."""
    known = dict.fromkeys(compress(study.factors, rigid(study)), 0.0) | known_tolerances(study)
    where = f"{study.path}: factor.tolerance of"
    needs = "the tolerance-aware front needs the half width that manufacture keeps"
    mend = "here or as half_width_mm of a chain that closes on this factor"
    faults = [f"{where} {name}: missing; {needs}, {mend}" for name in study.factors if name not in known]
    for name, limit in zip(study.factors, region_of(study) * study.step, strict=True):
        if known.get(name, 0.0) >= limit:
            why = f"leaves no room in the region, which reaches {limit:g} to either side of the centre"
            faults.append(f"{where} {name} = {known[name]:g}: {why}; narrow it or widen the design")
    refuse(faults)
    return np.array([known[name] for name in study.factors]) / study.step
