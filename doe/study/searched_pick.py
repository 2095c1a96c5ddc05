"""The pick of the simulator's own front: what its tolerances leave of it, and its limits."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from doe.arrays import Array
from doe.pareto.simulated_tolerance import Neighbourhood, SimulatedAware, pick_among, simulated_aware
from doe.response_surface import Surface
from doe.study.adaptive import Adaptive
from doe.study.back_off import Conditioned, Missed, standard_errors_of
from doe.study.confirmation import Confirmed
from doe.study.drawn import quadratics
from doe.study.goals import goals_of, rounded_within, tolerance_box
from doe.study_file import Study


@dataclass(frozen=True, eq=False)
class SearchedPick:
    """A row of the searched front and why it was picked; ``aware`` is None where the study asks for no tolerances."""

    row: int
    reason: str
    aware: SimulatedAware | None


def searched_pick(
    study: Study, surfaces: Sequence[Surface], searched: Adaptive, simulated: Sequence[Confirmed] = (), failed: int = 0
) -> SearchedPick:
    """The point of the searched front by the study's rule, of what tolerances leave where the study asks for that.

    It keeps every limit with the probability that the study asks for, by the standard errors of its fresh runs and by
    what these missed at points ``simulated``, which are not picked again; each of the ``failed`` among them, picked and not
    kept, lets the back-off grow by its own size.
    """
    front, goals = searched.front, goals_of(study)
    coded = study.coded(front.points)
    shift, margin = _doubt(study, searched, coded, simulated)
    margin *= front.quantile(study.file.confirmation.limit_probability) * (1.0 + failed)
    below, above = margin - shift, margin + shift
    ran = front.baseline_values
    ran = None if ran is None or not np.isfinite(ran).all() else ran
    baselines = [] if ran is None else [goals.costs(ran)]
    costs, violations = front.costs, goals.violations(front.values - below, front.values + above)
    aware, after = None, ""
    if (box := tolerance_box(study)) is not None:
        here, base = neighbourhood(study, surfaces, searched, coded, front.values), None
        if ran is not None:
            at = study.coded(study.baseline)[None]
            base = neighbourhood(study, surfaces, searched, at, ran[None])
        aware = simulated_aware(box, here, goals, base, below, above)
        costs, violations = aware.costs, aware.violations
        if not (violations <= 0.0).all(axis=1).any():
            violations = goals.violations(front.values - below, front.values + above)
        baselines += [] if aware.robust_baseline is None else [aware.robust_baseline]
        after = ", by what its tolerances leave of it"
    rounded = [rounded_within(study, point) for point in front.points]
    fresh = np.array([not any(np.array_equal(point, each.point) for each in simulated) for point in rounded])
    rows = np.flatnonzero(fresh) if fresh.any() else np.arange(len(front.points))
    row, reason = pick_among(costs[rows], violations[rows], goals, baselines, study.file.front.pick)
    words = f"{reason.replace('front points', f'points of the {searched.name} front')}{after}"
    return SearchedPick(int(rows[row]), words, aware)


def neighbourhood(
    study: Study, surfaces: Sequence[Surface], searched: Adaptive, coded: Array, values: Array
) -> Neighbourhood:
    """About coded points (n, k) of known responses (n, m), in the shape of the surfaces as the search's runs correct it."""
    forms, runs = quadratics(surfaces, len(study.factors)), searched.front.searched
    return Neighbourhood.of(forms, coded, values, study.coded(runs.points), runs.values)


def _doubt(study: Study, searched: Adaptive, coded: Array, simulated: Sequence[Confirmed]) -> tuple[Array, Array]:
    """Mean and standard deviation (f, m) of what the front's fresh runs err by, given what they missed at the points
    simulated, each beside its nearest row."""
    front = searched.front
    shift, deviation = np.zeros_like(front.values), front.standard_errors.copy()
    if not simulated:
        return shift, deviation
    at = study.coded(np.array([each.point for each in simulated]))
    rows = ((at[:, None] - coded[None]) ** 2).sum(axis=-1).argmin(axis=1)
    values, errors = np.array([each.values for each in simulated]), standard_errors_of(simulated)
    for index in range(values.shape[1]):
        misses = values[:, index] - front.values[rows, index]
        field = Conditioned(Missed(coded[rows], misses, errors[:, index], deviation[rows, index]))
        shift[:, index], left = field(coded, front.standard_errors[:, index])
        # The error of one more simulation counts too.
        deviation[:, index] = np.hypot(left, errors[:, index].max())
    return shift, deviation
