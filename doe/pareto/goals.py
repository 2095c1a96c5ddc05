"""Goals of responses: what is small when a response is as wanted, and which limits it must keep.

A *cost* is what the search minimises: the response itself ("min"), its negative ("max") or its distance from the
target ("target"). A response of goal "none" has no cost; it may still have limits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from doe.arrays import Array, Rows

Kind = Literal["min", "max", "target", "none"]


@dataclass(frozen=True, eq=False)
class Goals:
    """Goals of m responses.

    ``kinds`` (m,); ``target`` (m,), NaN where there is none; ``lower`` and ``upper`` (m,), infinite where there
    is no limit; ``weight`` (m,); ``desired`` (m, 2), where desirability starts to rise from 0 or reaches 1, NaN
    where the front's own ideal and nadir shall stand for it.
    """

    kinds: tuple[Kind, ...]
    target: Array
    lower: Array
    upper: Array
    weight: Array
    desired: Array

    @classmethod
    def of(
        cls,
        kinds: Sequence[Kind],
        *,
        target: Sequence[float | None] | None = None,
        lower: Sequence[float | None] | None = None,
        upper: Sequence[float | None] | None = None,
        weight: Sequence[float] | None = None,
        desired: Sequence[Sequence[float] | None] | None = None,
    ) -> Self:
        """Goals with None for what is not given.

        Raises ValueError for a target without its number or a lower limit that is not below the upper one.
        """
        count = len(kinds)
        goals = cls(
            tuple(kinds),
            _filled(target, count, np.nan),
            _filled(lower, count, -np.inf),
            _filled(upper, count, np.inf),
            np.ones(count) if weight is None else np.array(weight, float),
            np.array([(np.nan, np.nan) if pair is None else pair for pair in desired or [None] * count], float),
        )
        for index, kind in enumerate(kinds):
            if kind == "target" and not np.isfinite(goals.target[index]):
                raise ValueError(f'response {index + 1}: goal = "target" needs its target; give the number')
            if goals.lower[index] >= goals.upper[index]:
                raise ValueError(f"response {index + 1}: lower limit must be below the upper limit")
        return goals

    @property
    def objectives(self) -> Rows:
        """Column numbers of the responses that have a cost."""
        return np.array([index for index, kind in enumerate(self.kinds) if kind != "none"], dtype=np.intp)

    @property
    def cost_weight(self) -> Array:
        """Weights of the costs, (q,), summing to 1."""
        chosen: Array = self.weight[self.objectives]
        return chosen / chosen.sum()

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
        columns = [
            {
                "min": high[..., i],
                "max": -low[..., i],
                "target": np.maximum(np.abs(low[..., i] - self.target[i]), np.abs(high[..., i] - self.target[i])),
            }[self.kinds[i]]
            for i in self.objectives
        ]
        return np.stack(columns, axis=-1)

    def slopes(self, values: Array) -> Array:
        """Change of each cost with its response, (..., q): +1 or -1."""
        index = self.objectives
        sign = np.array([{"min": 1.0, "max": -1.0}.get(self.kinds[i], np.nan) for i in index])
        toward: Array = np.where(values[..., index] >= self.target[index], 1.0, -1.0)
        return np.where(np.isnan(sign), toward, sign)

    def violations(self, low: Array, high: Array) -> Array:
        """By how much responses from ``low`` to ``high`` (..., m) break each limit, (..., c); 0 if they do not."""
        below = [limit - low[..., i] for i, sense, limit in self.limited if sense == ">="]
        above = [high[..., i] - limit for i, sense, limit in self.limited if sense == "<="]
        if not below + above:
            return np.zeros((*low.shape[:-1], 0))
        return np.stack(below + above, axis=-1).clip(0.0)


def _filled(given: Sequence[float | None] | None, count: int, blank: float) -> Array:
    return np.array([blank if each is None else each for each in given or [None] * count], float)
