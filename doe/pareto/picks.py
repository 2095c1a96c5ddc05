"""Rules that pick one point of a front: knee, desirability, weights.

Sources: Das, On characterizing the "knee" of the Pareto curve (1999); Derringer and Suich, Simultaneous optimization
of several response variables (1980); Steuer and Choo, An interactive weighted Tchebycheff procedure (1983).
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np

from doe.arrays import Array, Rows
from doe.pareto.archive import dominates, normalised, spread
from doe.pareto.goals import Goals

Rule = Literal["knee", "desirability", "weights"]

RULES: tuple[Rule, ...] = get_args(Rule)
AUGMENTATION = 1e-3  # share of the sum in the Tchebycheff distance: tells apart points of equal maximum
NAMES = {"knee": "the knee", "desirability": "the most desirable", "weights": "the best by the weights"}


def knee_depth(values: Array) -> Array:
    """Depth (n,) of front points (n, m) below the hyperplane through the best point of each objective.

    The knee is the deepest point. Distances are in normalised objectives. Where the best points do not span
    a plane that falls in every objective, the plane on which normalised objectives sum to 1 takes its place.

    Source: Das (1999).
    """
    scaled = normalised(values, values.min(axis=0), values.max(axis=0))
    extremes = scaled[scaled.argmin(axis=0)]
    normal = np.ones(scaled.shape[1])
    if np.linalg.cond(extremes) < 1e8:
        solved = np.linalg.solve(extremes, normal)
        normal = solved if (solved > 0).all() else normal
    return (1 - scaled @ normal) / np.linalg.norm(normal)


def desirability(costs: Array, goals: Goals) -> Array:
    """Overall desirability (n,) of front points with costs (n, q), from 0 to 1.

    Each response's desirability falls on a straight line from 1 at the better end of its ``desired`` to 0 at the
    worse end; for a target it is 1 there and 0 at either end of ``desired``, which then counts by its nearer end.
    Where ``desired`` is not given, the front's own ideal and nadir are the ends. The whole is the geometric mean
    by the weights. Source: Derringer and Suich (1980).
    """
    best, worst = costs.min(axis=0), costs.max(axis=0)
    for column, index in enumerate(goals.objectives):
        low, high = goals.desired[index]
        if np.isfinite(low):
            ends = {"min": (low, high), "max": (-high, -low)}
            reach = min(high - goals.target[index], goals.target[index] - low)
            best[column], worst[column] = ends.get(goals.kinds[index], (0.0, reach))
    each = (1.0 - normalised(costs, best, worst)).clip(0.0, 1.0)
    return np.prod(each**goals.cost_weight, axis=1)


def tchebycheff(costs: Array, weight: Array) -> Array:
    """Augmented weighted Tchebycheff distance (n,) of front points (n, q) from their ideal point.

    The largest of the weighted normalised costs, and `AUGMENTATION` of their sum. Source: Steuer and Choo (1983).
    """
    scaled = weight * normalised(costs, costs.min(axis=0), costs.max(axis=0))
    return scaled.max(axis=1) + AUGMENTATION * scaled.sum(axis=1)


def score(rule: Rule, costs: Array, goals: Goals) -> Array:
    """Score (n,) of front points by a rule; the largest is its pick."""
    if rule == "knee":
        return knee_depth(costs)
    if rule == "desirability":
        # Where all are undesirable, the distance from the ideal point decides.
        return desirability(costs, goals) - 1e-9 * tchebycheff(costs, goals.cost_weight)
    return -tchebycheff(costs, goals.cost_weight)


class Thinned(NamedTuple):
    """A front thinned to ``rows`` (f,), the places among them of the pick of every rule, and what they were picked of."""

    rows: Rows
    picks: dict[Rule, int]
    among: str


def thinned(costs: Array, goals: Goals, baseline: Array | None, keep: int, wanted: Sequence[int] = ()) -> Thinned:
    """About ``keep`` evenly spread rows of costs (n, q), with the best and worst of each, the picks and the wanted."""
    picks, among = pick_all(costs, goals, baseline)
    rows = spread(costs, keep, [*wanted, *picks.values()])
    return Thinned(rows, {rule: int(np.searchsorted(rows, row)) for rule, row in picks.items()}, among)


def pick_all(costs: Array, goals: Goals, baseline: Array | None) -> tuple[dict[Rule, int], str]:
    """The pick of every rule among the points that dominate the baseline, and among how many it was.

    Without a baseline, or where no point dominates it, all points stand for election.
    """
    rows = np.arange(len(costs))
    if baseline is None:
        among = "of the front, for no baseline is given"
    else:
        rows = np.flatnonzero(dominates(costs, baseline))
        among = f"among the {rows.size} of {len(costs)} front points that dominate the baseline"
        if rows.size == 0:
            rows = np.arange(len(costs))
            among = "of the front, for no point of the front dominates the baseline"
    return {rule: int(rows[score(rule, costs, goals)[rows].argmax()]) for rule in RULES}, among
