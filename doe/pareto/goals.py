"""Goals of responses: what is small when a response is as wanted, and which limits it must keep.

A *cost* is what the search minimises: the response itself ("min"), its negative ("max") or its distance from the
target ("target"). A response of goal "none" has no cost; it may still have limits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np

from doe.arrays import Array, Rows
from rbdyn.faults import MethodError

Kind = Literal["min", "max", "target", "none"]
# What stands for a wish that a response does not have.
BLANK: dict[str, Any] = {
    "target": np.nan, "lower": -np.inf, "upper": np.inf, "weight": 1.0, "desired": (np.nan, np.nan)
}  # fmt: skip


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
    def of(cls, kinds: Sequence[Kind], **given: Sequence[Any]) -> Self:
        """Goals of the ``kinds``; what else is ``given`` has None where a response has none.

        Raises MethodError for a target without its number or a lower limit that is not below the upper one.
        """
        columns = {key: [blank] * len(kinds) for key, blank in BLANK.items()}
        for key, column in given.items():
            columns[key] = [BLANK[key] if each is None else each for each in column]
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
        """By how much responses from ``low`` to ``high`` (..., m) break each limit, (..., c); 0 if they do not."""
        below = [limit - low[..., i] for i, sense, limit in self.limited if sense == ">="]
        above = [high[..., i] - limit for i, sense, limit in self.limited if sense == "<="]
        if not below + above:
            return np.zeros((*low.shape[:-1], 0))
        return np.stack(below + above, axis=-1).clip(0.0)
