"""Archives of evaluated points: the non-dominated of all, generation by generation, and evenly spread picks of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from doe.arrays import Array, Mask, Rows
from doe.pareto.indicators import normalised


class Archive(NamedTuple):
    """Points (f, k) and their costs (f, q), none of which dominates another."""

    points: Array
    costs: Array


def non_dominated(values: Array) -> Rows:
    """Row numbers of the non-dominated of ``values`` (n, m), by ascending first objective, no repeats."""
    from pymoo.util.nds.non_dominated_sorting import find_non_dominated

    unique, rows = np.unique(values, axis=0, return_index=True)
    if not len(unique):
        return rows
    return rows[find_non_dominated(unique)]


def dominates(better: Array, worse: Array) -> Mask:
    """Whether costs (..., q) are nowhere larger than others and somewhere smaller."""
    return np.all(better <= worse, axis=-1) & np.any(better < worse, axis=-1)


def archives(history: Sequence[Archive]) -> list[Archive]:
    """Non-dominated points of all generations up to each of ``history``."""
    kept = []
    points, costs = (part[:0] for part in history[0])
    for new in history:
        points, costs = np.vstack([points, new.points]), np.vstack([costs, new.costs])
        rows = non_dominated(costs)
        points, costs = points[rows], costs[rows]
        kept.append(Archive(points, costs))
    return kept


def spread(costs: Array, keep: int, wanted: Sequence[int] = ()) -> Rows:
    """Rows of normalised costs (n, q) to keep, ascending: extremes and wanted first, then the row farthest from all."""
    if len(costs) <= keep:
        return np.arange(len(costs))
    scaled = normalised(costs, costs.min(axis=0), costs.max(axis=0))
    chosen = sorted({*scaled.argmin(axis=0).tolist(), *scaled.argmax(axis=0).tolist(), *wanted})
    gap = np.min([np.linalg.norm(scaled - scaled[row], axis=1) for row in chosen], axis=0)
    while len(chosen) < keep:
        chosen.append(int(gap.argmax()))
        gap = np.minimum(gap, np.linalg.norm(scaled - scaled[chosen[-1]], axis=1))
    return np.sort(chosen)
