"""The front of cheap responses, its picks and its hypervolume.

Responses stay in their own units; the search minimises the costs that their goals make of them.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from doe.arrays import Array
from doe.pareto.archive import hypervolume
from doe.pareto.goals import Goals
from doe.pareto.nsga2 import Doubt, Judged, Objectives, check_search, search
from doe.pareto.picks import NAMES, Rule, knee_depth, thinned
from doe.pareto.tolerance_aware import ToleranceAware
from doe.pareto.uncertainty import FrontUncertainty
from rbdyn.faults import MethodError


@dataclass(frozen=True, eq=False)
class ParetoFront:
    """Non-dominated points of every point evaluated, in ascending order of the first cost.

    ``points`` (f, k) in the factors' units; ``values`` (f, m) in the responses' units, watched ones too, and
    ``costs`` (f, q) what their goals make of them. ``ideal`` and ``nadir`` (q,) are the best and worst of each cost on
    the front; ``knee``, ``pick`` and ``picks`` (the pick of every rule) are row numbers. ``archive_size`` counts the
    front before thinning and ``hypervolume`` is of that front; ``hypervolume_history`` (generations,) is on the same
    scale. ``baseline_values`` (m,) are None without a baseline. ``feasible`` is the share
    of the evaluated points that keep all limits. ``uncertainty`` and ``tolerance_aware``
    are None where they were not asked for.
    """

    points: Array
    values: Array
    costs: Array
    hypervolume: float
    hypervolume_history: Array
    ideal: Array
    nadir: Array
    knee: int
    pick: int
    picks: dict[Rule, int]
    pick_reason: str
    baseline_values: Array | None
    archive_size: int
    evaluations: int
    feasible: float
    generations: int
    seed: int
    goals: Goals
    uncertainty: FrontUncertainty | None = None
    tolerance_aware: ToleranceAware | None = None


def front(
    objectives: Objectives,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    goals: Goals | None = None,
    population: int = 100,
    generations: int = 200,
    seed: int = 1,
    baseline: ArrayLike | None = None,
    keep: int = 200,
    pick: Rule = "knee",
    doubt: Doubt | None = None,
) -> ParetoFront:
    """Find the Pareto front of responses over a box; the same seed gives the same bits.

    objectives : maps points (n, k) to responses (n, m), at least two of them with a goal.
    lower, upper : bounds of the factors, shape (k,).
    goals : what is wanted of the responses; all to be minimised without it.
    population, generations, seed : of NSGA-II.
    baseline : a point (k,) to improve on. Picks are then among those front points that dominate it.
    keep : about how many points to return. A larger front is thinned to evenly spread points, among them
        the best and worst of each cost, the knee and the picks.
    pick : rule that makes the pick.
    doubt : maps points (n, k) to how far below and above (n, m) their responses may be; limits hold all over it.

    Raises MethodError when the bounds are not a box, a setting is out of range, or an objective is not finite;
    InfeasibleError when no point evaluated keeps all limits.
    """
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    check_search(low, high, population, generations, keep)
    if baseline is not None and np.shape(baseline) != low.shape:
        raise MethodError(f"baseline has shape {np.shape(baseline)}; give one value a factor ({low.size})")
    if goals is None:
        goals = Goals.of(["min"] * _values(objectives, (low + high)[None, :] / 2).shape[1])
    searched = search(partial(_judged, objectives, goals, doubt), low, high, population, generations, seed)
    points, costs = searched.archives[-1]
    ideal, nadir = costs.min(axis=0), costs.max(axis=0)
    baseline_values = None if baseline is None else _values(objectives, np.atleast_2d(baseline))[0]
    baseline_costs = None if baseline_values is None else goals.costs(baseline_values)
    best = int(knee_depth(costs).argmax())
    rows, picks, among = thinned(costs, goals, baseline_costs, keep, [best])
    return ParetoFront(
        points=points[rows],
        values=_values(objectives, points[rows]),
        costs=costs[rows],
        hypervolume=hypervolume(costs, ideal, nadir),
        hypervolume_history=np.array([hypervolume(each.costs, ideal, nadir) for each in searched.archives]),
        ideal=ideal,
        nadir=nadir,
        knee=int(np.searchsorted(rows, best)),
        pick=picks[pick],
        picks=picks,
        pick_reason=f"{NAMES[pick]} {among}",
        baseline_values=baseline_values,
        archive_size=len(costs),
        evaluations=searched.evaluations,
        feasible=searched.feasible,
        generations=generations,
        seed=seed,
        goals=goals,
    )


def _judged(objectives: Objectives, goals: Goals, doubt: Doubt | None, points: Array) -> Judged:
    values = _values(objectives, points)
    below, above = (0.0, 0.0) if doubt is None else doubt(points)
    return Judged(goals.costs(values), goals.violations(values - below, values + above))


def _values(objectives: Objectives, points: Array) -> Array:
    """Responses (n, m) of points. Raises MethodError unless they are finite, a row a point, two or more in a row."""
    values = np.asarray(objectives(points), float)
    if values.ndim != 2 or len(values) != len(points) or values.shape[1] < 2:
        given = f"objectives gave shape {values.shape} for {len(points)} points"
        raise MethodError(f"{given}; give one row a point and at least two objectives")
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0]
        given = f"objective {column + 1} is {values[row, column]} at {points[row].tolist()}"
        raise MethodError(f"{given}; narrow the bounds or mend the objective")
    return values
