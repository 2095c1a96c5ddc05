"""Replicates by need: design runs have few at first, and get the others where noise would be much of what a surface predicts.

They also get them where the first ones differ about a limit on the class of the cage: then all judge it together.

A surface of p terms fitted to n runs averages their noise: its predictions at the runs have p/n of the variance of that.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import special

from doe import clearance
from doe.running.runner import Progress
from doe.running.store import Failure
from doe.study_file.sections import at_point
from doe.workflow.design import terms_of
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs, other_cages, run_design
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.estimate import Estimate
from rbdyn.base.tables.sheet import listed
from rbdyn.base.words import Notice

# Largest share of noise in the variance of a predicted response.
NOISY = 0.1
# Least room between a run and a limit, in half-widths of the run: a limit farther away does not decide the pick.
CLEAR = 2.0


def independent_values(runs: Runs) -> Whole:
    """Number of independent values (n, m) of each half width, from ``runs.replicates``; 0: unknown."""
    samples = np.zeros(len(runs.values)) if runs.replicates is None else np.asarray(runs.replicates)
    per_response = samples if samples.ndim == 2 else samples[:, None]
    return np.array(np.broadcast_to(per_response, runs.values.shape), np.int64)


def standard_errors(half_widths: Array, number: Whole) -> Array:
    """Standard errors of means from the half widths (n, m) of their 95 % intervals.

    The quantile is Student's with ``number`` - 1 degrees of freedom, where ``number`` (n, m) counts the independent
    values of each mean; for unknown numbers (0) it is the normal one.
    """
    student = special.stdtrit(np.maximum(number - 1, 1), 0.975)
    return half_widths / np.where(number > 1, student, special.ndtri(0.975))


def run_by_need(study: Problem, simulations: clearance.Simulations, progress: Progress, notice: Notice) -> Runs:
    """The design runs, with all their replicates where the first ones are too few; ``notice`` hears why. Raises as `run_design`."""
    runs = run_design(study, simulations, progress)
    if not study.further_replicates:
        return runs
    if not (names := [*noisy(study, runs), *["limits.cage.verdict"] * runs.has_open_cages]):
        return runs
    if notice is not None:
        notice(
            f"{study.first_replicates} replicates are too few for {listed(names)}: all runs continue to {study.usual_replicates}"
        )
    return _continued(study, runs, simulations)


def noisy(study: Problem, runs: Runs) -> list[str]:
    """Responses with a goal whose predictions have too much noise, or an unknown amount, and those with a limit near a run.

    Noise widens the margin to a limit.
    """
    errors = standard_errors(runs.errors, independent_values(runs))
    noise = np.ma.masked_invalid(errors**2).mean(axis=0).filled(np.inf)
    spread = np.ma.masked_invalid(runs.values).var(axis=0, ddof=1).filled(0.0)
    terms = np.array([len(terms_of(study, response.model)) for response in study.file.response])
    hidden = noise * terms / len(runs.coded) > NOISY * spread
    places = {place for place in study.goals.objectives if hidden[place]}
    for place, sense, limit in study.goals.limited:
        room = (limit - runs.values[:, place]) * (1.0 if sense == "<=" else -1.0)
        if (room <= CLEAR * runs.errors[:, place]).any():
            places.add(place)
    return [study.responses[place] for place in sorted(places)]


def _continued(study: Problem, runs: Runs, simulations: clearance.Simulations) -> Runs:
    """The runs with the replicates that they left out; a run whose others fail keeps its own."""
    assert runs.design is not None
    places = runs.places
    scenes = study.design_scenes(runs.actual, runs.design.order[places].tolist(), further=True)
    labels = [f"design run {place + 1}" for place in places]
    found = simulations.run(scenes, labels, simulations.progress("design runs"))
    rows = [row for row, result in enumerate(found) if not isinstance(result, Failure)]
    sound = [result for result in found if not isinstance(result, Failure)]
    usual = study.usual_replicates

    def joined(before: Runs, names: Sequence[str]) -> Runs:
        first_runs, (value, half_width, samples) = before.only(rows), clearance.figures(names, sound)
        further_runs = replace(first_runs, values=value, errors=half_width, replicates=samples)
        mean = _mean(first_runs, further_runs, np.array([study.first_replicates, study.further_replicates]) / usual)
        values, errors, number = before.values.copy(), before.errors.copy(), independent_values(before)
        values[rows], errors[rows] = mean.value, mean.half_width
        number[rows] = np.where(np.isfinite(mean.freedom), np.round(mean.freedom) + 1.0, 0.0).astype(np.int64)
        return replace(before, values=values, errors=errors, replicates=number, replicates_a_point=usual)

    at_points = {
        name: joined(at, [at_point(name, figure) for figure in study.figures]) for name, at in runs.at_points.items()
    }
    cages = None if runs.other_cages is None else runs.other_cages.copy()
    if cages is not None and (further := other_cages(study, sound)) is not None:
        cages[rows] += (further - cages[rows]) * study.further_replicates / usual
    return replace(joined(runs, study.responses), at_points=at_points).with_cages(cages)


def _mean(first: Runs, further: Runs, shares: Array) -> Estimate:
    """Means (n, m) of two runs at each point, of which each has its share of the replicates."""
    pairs = []
    for runs in (first, further):
        number = independent_values(runs)
        freedom = np.where(number > 1, number - 1.0, np.inf)
        pairs.append([array.ravel() for array in (runs.values, standard_errors(runs.errors, number), freedom)])
    mean = Estimate(*(np.column_stack(pair) for pair in zip(*pairs, strict=True))).mean(shares)
    return Estimate(*(array.reshape(first.values.shape) for array in mean[:3]))
