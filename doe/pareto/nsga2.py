"""Pareto fronts of cheap responses: NSGA-II with an archive of every evaluation, picks and a hypervolume.

Responses stay in their own units; the search minimises the costs that their goals make of them. What breaks a limit
gives way to what keeps it (constrained domination), and only the latter enters the archive.

Source: Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II (2002).
"""

from collections.abc import Callable
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from doe.arrays import Array
from doe.pareto.archive import Archive, merged
from rbdyn.faults import MethodError

Objectives = Callable[[Array], Array]
# How far below and above (n, m) what is foretold of points (n, k) their responses may be when limits are judged.
Doubt = Callable[[Array], tuple[Array, Array]]


class Judged(NamedTuple):
    """Costs (n, q) of points and by how much they break each limit (n, c)."""

    costs: Array
    violations: Array


Judge = Callable[[Array], Judged]
History = list[tuple[Array, Judged]]  # points of each generation and what they are judged


class InfeasibleError(MethodError):
    """No point keeps all limits. ``point`` comes closest and breaks limit c by ``violations`` (c,)."""

    def __init__(self, point: Array, violations: Array) -> None:
        self.point, self.violations = point, violations
        super().__init__("no point keeps all limits; loosen one")


class Search(NamedTuple):
    """Archive after every generation, number of evaluations and the share of them that keep all limits."""

    archives: list[Archive]
    evaluations: int
    feasible: float


def search(judge: Judge, low: Array, high: Array, population: int, generations: int, seed: int) -> Search:
    """NSGA-II over a box, with the archive of all evaluations after every generation.

    Raises InfeasibleError when no point evaluated keeps all limits.
    """
    history = _evolve(judge, low, high, population, generations, seed)
    allowed = [(judged.violations <= 0.0).all(axis=1) for _, judged in history]
    count = sum(len(points) for points, _ in history)
    if not any(rows.any() for rows in allowed):
        points = np.vstack([points for points, _ in history])
        violations = np.vstack([judged.violations for _, judged in history])
        closest = (violations / _scale(violations)).sum(axis=1).argmin()
        raise InfeasibleError(points[closest], violations[closest])
    good = [Archive(points[rows], judged.costs[rows]) for (points, judged), rows in zip(history, allowed, strict=True)]
    archives = accumulate(good, merged, initial=Archive(*(part[:0] for part in good[0])))
    return Search(list(archives)[1:], count, sum(int(rows.sum()) for rows in allowed) / count)


def check_search(low: Array, high: Array, population: int, generations: int, keep: int) -> None:
    """Raises MethodError when the bounds are not a box or a setting is out of range."""
    if low.ndim != 1 or low.shape != high.shape or not (np.isfinite(low) & np.isfinite(high)).all():
        raise MethodError("lower and upper bounds must be equally long lists of finite numbers")
    wrong = np.flatnonzero(low >= high)
    if wrong.size:
        at = wrong[0]
        raise MethodError(f"factor {at + 1}: lower bound {low[at]:g} must be below upper bound {high[at]:g}")
    for name, value, least in (("population", population, 4), ("generations", generations, 1), ("keep", keep, 2)):
        if value < least:
            raise MethodError(f"{name} = {value}: must be at least {least}")


def _scale(violations: Array) -> Array:
    """The largest of violations (n, c), shares of which no unit outweighs; 1 where there is none."""
    largest = violations.max(axis=0, initial=0.0)
    return np.where(largest > 0.0, largest, 1.0)


def _evolve(judge: Judge, low: Array, high: Array, population: int, generations: int, seed: int) -> History:
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    history: History = []
    # The scale of the violations is that of points all over the box.
    sample = judge(np.random.default_rng(seed).uniform(low, high, (population, low.size)))
    scale = _scale(sample.violations)

    class Recorded(Problem):
        def _evaluate(self, x: Array, out: dict[str, Array]) -> None:
            judged = judge(x)
            out["F"] = judged.costs
            if scale.size:
                out["G"] = judged.violations / scale
            history.append((x.copy(), Judged(judged.costs.copy(), judged.violations.copy())))

    count = sample.costs.shape[1]
    problem = Recorded(n_var=low.size, n_obj=count, n_ieq_constr=scale.size, xl=low, xu=high)
    minimize(problem, NSGA2(pop_size=population), ("n_gen", generations), seed=seed)
    return history
