"""Pareto fronts of cheap responses: NSGA-II with an archive of every evaluation, picks and a hypervolume.

Responses stay in their own units; the search minimises the costs that their goals make of them. What breaks a limit
gives way to what keeps it (constrained domination), and only the latter enters the archive.

Source: Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II (2002).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.pareto.archive import Archive, archives, spread
from doe.pareto.goals import Goals
from doe.pareto.indicators import hypervolume, normalised
from doe.pareto.picks import NAMES, Rule, knee_depth, pick_all

if TYPE_CHECKING:
    from doe.pareto.tolerance_aware import ToleranceAware
    from doe.pareto.uncertainty import FrontUncertainty

Array = NDArray[np.float64]
Objectives = Callable[[Array], Array]
# How far below and above (n, m) what is foretold of points (n, k) their responses may be when limits are judged.
Doubt = Callable[[Array], tuple[Array, Array]]


class Judged(NamedTuple):
    """Costs (n, q) of points and by how much they break each limit (n, c)."""

    costs: Array
    violations: Array


class InfeasibleError(ValueError):
    """No point keeps all limits. ``point`` comes closest and breaks limit c by ``violations`` (c,)."""

    def __init__(self, point: Array, violations: Array) -> None:
        self.point, self.violations = point, violations
        super().__init__("no point keeps all limits; loosen one")


@dataclass(frozen=True, eq=False)
class ParetoFront:
    """Non-dominated points of every point evaluated, in ascending order of the first cost.

    ``points`` (f, k) in the factors' units; ``values`` (f, m) in the responses' units, watched ones too, and
    ``costs`` (f, q) what their goals make of them. ``ideal`` and ``nadir`` (q,) are the best and worst of each cost on
    the front; ``knee``, ``pick`` and ``picks`` (the pick of every rule) are row numbers. ``archive_size`` counts the
    front before thinning and ``hypervolume`` is of that front; ``hypervolume_history`` (generations,) is on the same
    scale. ``baseline_values`` (m,) and ``baseline_costs`` (q,) are None without a baseline. ``feasible`` is the share
    of the evaluated points that keep all limits. ``standard_errors`` (f, m), ``uncertainty`` and ``tolerance_aware``
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
    baseline_costs: Array | None
    archive_size: int
    evaluations: int
    feasible: float
    generations: int
    seed: int
    goals: Goals
    standard_errors: Array | None = None
    uncertainty: FrontUncertainty | None = None
    tolerance_aware: ToleranceAware | None = None


class Search(NamedTuple):
    """Archive after every generation, number of evaluations and the share of them that keep all limits."""

    archives: list[Archive]
    evaluations: int
    feasible: float


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
    standard_errors: Objectives | None = None,
    doubt: Doubt | None = None,
) -> ParetoFront:
    """Find the Pareto front of responses over a box; the same seed gives the same bits.

    Parameters
    ----------
    objectives : maps points (n, k) to responses (n, m), at least two of them with a goal.
    lower, upper : bounds of the factors, shape (k,).
    goals : what is wanted of the responses; all to be minimised without it.
    population, generations, seed : of NSGA-II.
    baseline : a point (k,) to improve on. Picks are then among those front points that dominate it.
    keep : about how many points to return. A larger front is thinned to evenly spread points, among them
        the best and worst of each cost, the knee and the picks.
    pick : rule that makes the pick.
    standard_errors : maps points (n, k) to the standard errors (n, m) of their responses.
    doubt : maps points (n, k) to how far below and above (n, m) their responses may be; limits hold all over it.

    Raises
    ------
    ValueError when the bounds are not a box, a setting is out of range, or an objective is not finite;
    InfeasibleError when no point evaluated keeps all limits.
    """
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    check_search(low, high, population, generations, keep)
    if baseline is not None and np.shape(baseline) != low.shape:
        raise ValueError(f"baseline has shape {np.shape(baseline)}; give one value a factor ({low.size})")
    if goals is None:
        goals = Goals.of(["min"] * _evaluate(objectives, (low + high)[None, :] / 2).shape[1])
    wanted = goals

    def judge(points: Array) -> Judged:
        values = _evaluate(objectives, points)
        below, above = (0.0, 0.0) if doubt is None else doubt(points)
        return Judged(wanted.costs(values), wanted.violations(values - below, values + above))

    found = search(judge, low, high, population, generations, seed)
    points, costs = found.archives[-1]
    ideal, nadir = costs.min(axis=0), costs.max(axis=0)
    baseline_values = None if baseline is None else _evaluate(objectives, np.atleast_2d(baseline))[0]
    baseline_costs = None if baseline_values is None else goals.costs(baseline_values)
    best = int(knee_depth(costs).argmax())
    picks, among = pick_all(costs, goals, baseline_costs)
    kept = spread(normalised(costs, ideal, nadir), keep, [best, *picks.values()])
    places = {rule: int(np.searchsorted(kept, row)) for rule, row in picks.items()}
    return ParetoFront(
        points=points[kept],
        values=_evaluate(objectives, points[kept]),
        costs=costs[kept],
        hypervolume=hypervolume(costs, ideal, nadir),
        hypervolume_history=np.array([hypervolume(each.costs, ideal, nadir) for each in found.archives]),
        ideal=ideal,
        nadir=nadir,
        knee=int(np.searchsorted(kept, best)),
        pick=places[pick],
        picks=places,
        pick_reason=f"{NAMES[pick]} {among}",
        baseline_values=baseline_values,
        baseline_costs=baseline_costs,
        archive_size=len(costs),
        evaluations=found.evaluations,
        feasible=found.feasible,
        generations=generations,
        seed=seed,
        goals=goals,
        standard_errors=None if standard_errors is None else standard_errors(points[kept]),
    )


def search(
    judge: Callable[[Array], Judged], low: Array, high: Array, population: int, generations: int, seed: int
) -> Search:
    """NSGA-II over a box, with the archive of all evaluations after every generation.

    Raises InfeasibleError when no point evaluated keeps all limits.
    """
    history = _evolve(judge, low, high, population, generations, seed)
    allowed = [(judged.violations <= 0.0).all(axis=1) for _, judged in history]
    count = sum(len(points) for points, _ in history)
    if not any(rows.any() for rows in allowed):
        points = np.vstack([points for points, _ in history])
        violations = np.vstack([judged.violations for _, judged in history])
        closest = _scaled(violations).sum(axis=1).argmin()
        raise InfeasibleError(points[closest], violations[closest])
    kept = [Archive(points[rows], judged.costs[rows]) for (points, judged), rows in zip(history, allowed, strict=True)]
    return Search(archives(kept), count, sum(int(rows.sum()) for rows in allowed) / count)


def check_search(low: Array, high: Array, population: int, generations: int, keep: int) -> None:
    """Raises ValueError when the bounds are not a box or a setting is out of range."""
    if low.ndim != 1 or low.shape != high.shape or not (np.isfinite(low) & np.isfinite(high)).all():
        raise ValueError("lower and upper bounds must be equally long lists of finite numbers")
    wrong = np.flatnonzero(low >= high)
    if wrong.size:
        at = wrong[0]
        raise ValueError(f"factor {at + 1}: lower bound {low[at]:g} must be below upper bound {high[at]:g}")
    for name, value, least in (("population", population, 4), ("generations", generations, 1), ("keep", keep, 2)):
        if value < least:
            raise ValueError(f"{name} = {value}: must be at least {least}")


def _evaluate(objectives: Objectives, points: Array) -> Array:
    values = np.asarray(objectives(points), float)
    if values.ndim != 2 or len(values) != len(points) or values.shape[1] < 2:
        raise ValueError(
            f"objectives gave shape {values.shape} for {len(points)} points; give one row a point and at "
            "least two objectives"
        )
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0]
        raise ValueError(
            f"objective {column + 1} is {values[row, column]} at {points[row].tolist()}; narrow the bounds "
            "or mend the objective"
        )
    return values


def _scaled(violations: Array) -> Array:
    """Violations (n, c) in shares of their largest, so that no unit outweighs another."""
    largest = violations.max(axis=0, initial=0.0)
    shares: Array = violations / np.where(largest > 0.0, largest, 1.0)
    return shares


def _evolve(
    judge: Callable[[Array], Judged], low: Array, high: Array, population: int, generations: int, seed: int
) -> list[tuple[Array, Judged]]:
    """Points of each generation and what was found of them."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    history: list[tuple[Array, Judged]] = []
    # The scale of the violations is that of points all over the box.
    sample = judge(np.random.default_rng(seed).uniform(low, high, (population, low.size)))
    largest = sample.violations.max(axis=0, initial=0.0)
    scale = np.where(largest > 0.0, largest, 1.0)

    class Recorded(Problem):
        def _evaluate(self, x: Array, out: dict[str, Array]) -> None:
            found = judge(x)
            out["F"] = found.costs
            if scale.size:
                out["G"] = found.violations / scale
            history.append((x.copy(), Judged(found.costs.copy(), found.violations.copy())))

    count = sample.costs.shape[1]
    problem = Recorded(n_var=low.size, n_obj=count, n_ieq_constr=scale.size, xl=low, xu=high)
    minimize(problem, NSGA2(pop_size=population), ("n_gen", generations), seed=seed)
    return history
