"""Goals of responses, and the rules that pick one point of a front.

A *cost* is what the search minimises: the response itself ("min"), its negative ("max") or its distance from the
target ("target"). A response of goal "none" has no cost; it may still have limits.

Sources: Das, On characterizing the "knee" of the Pareto curve (1999); Derringer and Suich, Simultaneous optimization
of several response variables (1980); Steuer and Choo, An interactive weighted Tchebycheff procedure (1983).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Self, get_args

import numpy as np

from doe.pareto.search import dominates, normalised, spread
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.faults import MethodError

Kind = Literal["min", "max", "target", "none"]
# Values of goals that a response does not have.
BLANK = {"target": np.nan, "lower": -np.inf, "upper": np.inf, "weight": 1.0}


@dataclass(frozen=True, eq=False)
class Goals:
    """Goals of m responses.

    ``kinds`` (m,); ``target`` (m,), NaN without one; ``lower`` and ``upper`` limits (m,), infinite without one; ``weight`` (m,).
    """

    kinds: tuple[Kind, ...]
    target: Array
    lower: Array
    upper: Array
    weight: Array

    @classmethod
    def of(cls, kinds: Sequence[Kind], **wishes: Sequence[Any]) -> Self:
        """Goals of the ``kinds``; columns of other ``wishes`` have None for a response without one.

        Raises MethodError for a target without its number or a lower limit that is not below the upper one.
        """
        columns = {key: [blank] * len(kinds) for key, blank in BLANK.items()}
        for key, column in wishes.items():
            columns[key] = [BLANK[key] if value is None else value for value in column]
        goals = cls(tuple(kinds), **{key: np.array(column, float) for key, column in columns.items()})
        for index, kind in enumerate(kinds):
            if kind == "target" and not np.isfinite(goals.target[index]):
                raise MethodError(f'response {index + 1}: goal = "target" needs its target; give the number')
            if goals.lower[index] >= goals.upper[index]:
                raise MethodError(f"response {index + 1}: lower limit must be below the upper limit")
        return goals

    @property
    def objectives(self) -> Rows:
        """Column numbers of the responses that have a cost."""
        return np.array([index for index, kind in enumerate(self.kinds) if kind != "none"], dtype=np.intp)

    @property
    def cost_weight(self) -> Array:
        """Weights of the costs, (q,), summing to 1."""
        weights: Array = self.weight[self.objectives]
        return weights / weights.sum()

    @property
    def limited(self) -> list[tuple[int, str, float]]:
        """The limits: column of the response, "<=" or ">=", limit; in the order of `violations`."""
        lower = [(i, ">=", float(limit)) for i, limit in enumerate(self.lower) if np.isfinite(limit)]
        upper = [(i, "<=", float(limit)) for i, limit in enumerate(self.upper) if np.isfinite(limit)]
        return lower + upper

    def costs(self, values: Array) -> Array:
        """Costs (..., q) of responses (..., m)."""
        return self.worst(values, values)

    def worst(self, low: Array, high: Array) -> Array:
        """Largest costs (..., q) of responses that range from ``low`` to ``high`` (..., m): costs are convex."""
        columns = []
        for i in self.objectives:
            least, most = low[..., i], high[..., i]
            away = np.maximum(np.abs(least - self.target[i]), np.abs(most - self.target[i]))
            columns.append({"min": most, "max": -least, "target": away}[self.kinds[i]])
        return np.stack(columns, axis=-1)

    def slopes(self, values: Array) -> Array:
        """Change of each cost with its response, (..., q): +1 or -1."""
        index = self.objectives
        sign = np.array([{"min": 1.0, "max": -1.0}.get(self.kinds[i], np.nan) for i in index])
        toward: Array = np.where(values[..., index] >= self.target[index], 1.0, -1.0)
        return np.where(np.isnan(sign), toward, sign)

    def violations(self, low: Array, high: Array) -> Array:
        """Excess (..., c) of responses from ``low`` to ``high`` (..., m) over each limit, 0 within it."""
        below = [limit - low[..., i] for i, sense, limit in self.limited if sense == ">="]
        above = [high[..., i] - limit for i, sense, limit in self.limited if sense == "<="]
        if not below + above:
            return np.zeros((*low.shape[:-1], 0))
        return np.stack(below + above, axis=-1).clip(0.0)


Rule = Literal["knee", "desirability", "weights"]

RULES: tuple[Rule, ...] = get_args(Rule)
AUGMENTATION = 1e-3  # share of the sum in the Tchebycheff distance: distinguishes points of equal maximum
NAMES = {"knee": "the knee", "desirability": "the most desirable", "weights": "the best by the weights"}


def knee_depth(values: Array) -> Array:
    """Depth (n,) of front points (n, m) below the hyperplane through the best point of each objective.

    The knee is the deepest point. Distances are in normalised objectives. Where the best points span no plane that falls
    in every objective, the plane of normalised objectives with sum 1 replaces it.

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

    The desirability of a response falls linearly from 1 at the ideal of the front to 0 at its nadir. The whole is the
    geometric mean by the weights. Source: Derringer and Suich (1980).
    """
    scores = 1.0 - normalised(costs, costs.min(axis=0), costs.max(axis=0))
    return np.prod(scores**goals.cost_weight, axis=1)


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
        # Among points of desirability 0 the distance from the ideal point decides.
        return desirability(costs, goals) - 1e-9 * tchebycheff(costs, goals.cost_weight)
    return -tchebycheff(costs, goals.cost_weight)


class Thinning(NamedTuple):
    """A front thinned to ``rows`` (f,), the place of every rule's pick among them, and the set of the picks in words."""

    rows: Rows
    picks: dict[Rule, int]
    among: str


def thinning(costs: Array, goals: Goals, baseline: Array | None, keep: int, required: Sequence[int] = ()) -> Thinning:
    """About ``keep`` evenly spread rows of costs (n, q), with best and worst of each cost, picks and ``required`` rows."""
    picks, among = pick_all(costs, goals, baseline)
    rows = spread(costs, keep, [*required, *picks.values()])
    return Thinning(rows, {rule: int(np.searchsorted(rows, row)) for rule, row in picks.items()}, among)


def pick_all(costs: Array, goals: Goals, baseline: Array | None) -> tuple[dict[Rule, int], str]:
    """The pick of every rule among the points that dominate the baseline, and the set of these points in words.

    Without a baseline, or where no point dominates it, all points are candidates.
    """
    rows = np.arange(len(costs))
    if baseline is None:
        among = "of the front, without a baseline"
    else:
        rows = np.flatnonzero(dominates(costs, baseline))
        among = f"among the {rows.size} (of {len(costs)}) front points that beat the baseline in every response"
        if rows.size == 0:
            rows = np.arange(len(costs))
            among = "of the front; no point of the front beats the baseline in every response"
    return {rule: int(rows[score(rule, costs, goals)[rows].argmax()]) for rule in RULES}, among
