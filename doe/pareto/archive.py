"""Dominance, also between means that carry errors; archives of evaluated points, evenly spread picks and hypervolume of them.

Costs are normalised to 0 at the ideal point and 1 at the nadir point, up to `REFERENCE` in a hypervolume.

Source: Hughes, Evolutionary multi-objective ranking with uncertainty and noise (2001); Teich, Pareto-front exploration
with uncertain objectives (2001): one dominates another only where the noise cannot have made the difference.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import norm, qmc

from doe.arrays import Array, Mask, Rows

REFERENCE = 1.1  # reference point of the hypervolume: the nadir and a tenth of each range beyond it
LEVELS = 13  # 2^13 levels of the costs by which sets of points are compared


def normalised(values: Array, ideal: Array, nadir: Array) -> Array:
    """Costs (..., q) on the scale from ideal 0 to nadir 1; a cost without range stays at 0."""
    span = nadir - ideal
    return (values - ideal) / np.where(span > 0, span, 1.0)


def hypervolume(values: Array, ideal: Array, nadir: Array) -> float:
    """Volume that ``values`` (n, m) dominate, in objectives normalised to ``ideal`` 0 and ``nadir`` 1.

    The reference point is `REFERENCE` in each objective, so the largest volume possible is REFERENCE^m.
    Fronts compare only under the same ``ideal`` and ``nadir``.
    """
    from pymoo.indicators.hv import HV

    inside = normalised(values, ideal, nadir)
    inside = inside[(inside < REFERENCE).all(axis=1)]
    return float(HV(ref_point=np.full(values.shape[1], REFERENCE))(inside)) if len(inside) else 0.0


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


def dominance(costs: Array) -> Mask:
    """Whether row i of ``costs`` (n, q) dominates row j, taken at their word: (n, n)."""
    return dominates(costs[:, None], costs[None, :])


def error_aware_dominance(costs: Array, errors: Array, confidence: float) -> Mask:
    """Whether mean i dominates mean j beyond their errors: (n, n).

    Row i of ``costs`` (n, q) must be smaller than row j in every cost, by more than the one-sided normal quantile of
    ``confidence`` times the combined standard error of both (``errors`` (n, q)).
    """
    difference = costs[None, :] - costs[:, None]
    combined = np.sqrt(errors[None, :] ** 2 + errors[:, None] ** 2)
    return (difference > norm.ppf(confidence) * combined).all(axis=-1)


def ranks(dominating: Mask) -> Rows:
    """Front number (n,) of each row: 0 for those that none dominates, 1 for those that only these do, and so on."""
    rank = np.full(len(dominating), -1, dtype=np.intp)
    dominators = dominating.sum(axis=0)
    level = 0
    while (rank < 0).any():
        front = (dominators == 0) & (rank < 0)
        if not front.any():
            # Errors may make dominance run in circles; who is in one shares a front.
            front = rank < 0
        rank[front] = level
        dominators = dominators - dominating[front].sum(axis=0)
        level += 1
    return rank


def order(costs: Array, errors: Array, confidence: float) -> Rows:
    """Place (n,) of each row: by its front beyond errors, and within that by its front at its word."""
    outer = ranks(error_aware_dominance(costs, errors, confidence))
    inner = np.empty_like(outer)
    for level in np.unique(outer):
        rows = np.flatnonzero(outer == level)
        inner[rows] = ranks(dominance(costs[rows]))
    _, places = np.unique(np.column_stack([outer, inner]), axis=0, return_inverse=True)
    return places.reshape(-1)


def merged(archive: Archive, new: Archive) -> Archive:
    """Non-dominated points of both."""
    points, costs = np.vstack([archive.points, new.points]), np.vstack([archive.costs, new.costs])
    rows = non_dominated(costs)
    return Archive(points[rows], costs[rows])


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


def best_for_hypervolume(costs: Array, keep: int, seed: int = 1) -> Rows:
    """Rows of costs (n, q), ascending, that together have nearly the largest hypervolume of all sets of so many.

    One after the other, each that dominates most of the levels that are left: at least 1 - 1/e of the largest gain, and in
    practice next to all of it (Guerreiro, Fonseca and Paquete, Greedy hypervolume subset selection in low dimensions, 2016).
    Where no row dominates a level more, they are spread.
    """
    if len(costs) <= keep:
        return np.arange(len(costs))
    scaled = normalised(costs, costs.min(axis=0), costs.max(axis=0))
    levels = REFERENCE * qmc.Sobol(costs.shape[1], seed=seed).random_base2(LEVELS)
    below = np.ones((len(costs), len(levels)), dtype=bool)
    for column, level in zip(scaled.T, levels.T, strict=True):
        below &= column[:, None] <= level[None]
    chosen: list[int] = []
    gains, left = below.sum(axis=1), np.ones(len(levels), dtype=bool)
    while len(chosen) < keep and gains.max() > 0:
        # A gain only shrinks as others are chosen: that of the first is counted anew until it stays the first.
        row = int(gains.argmax())
        now = int((below[row] & left).sum())
        if now == gains[row]:
            chosen.append(row)
            left &= ~below[row]
            now = 0
        gains[row] = now
    return spread(costs, keep, chosen)
