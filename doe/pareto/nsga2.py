"""Pareto fronts of cheap objectives: NSGA-II with an archive of every evaluation, a knee and a pick.

All objectives are minimised. Normalised objectives are 0 at the ideal point and 1 at the nadir point of the
archive's front. The hypervolume is that of normalised objectives up to `REFERENCE` in each of them.

Source: Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II (2002).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Objectives = Callable[[Array], Array]

REFERENCE = 1.1  # reference point of the hypervolume: the nadir and a tenth of each range beyond it


@dataclass(frozen=True, eq=False)
class ParetoFront:
    """Non-dominated points of every point evaluated, in ascending order of the first objective.

    ``points`` (f, k) in the factors' units and ``values`` (f, m) in the objectives' units; ``ideal`` and
    ``nadir`` (m,) are the best and worst of each objective on the front; ``knee`` and ``pick`` are row
    numbers. ``archive_size`` counts the front before thinning and ``hypervolume`` is of that front;
    ``hypervolume_history`` (generations,) is on the same scale. ``baseline_values`` (m,) is None without a
    baseline.
    """

    points: Array
    values: Array
    hypervolume: float
    hypervolume_history: Array
    ideal: Array
    nadir: Array
    knee: int
    pick: int
    pick_reason: str
    baseline_values: Array | None
    archive_size: int
    evaluations: int
    generations: int
    seed: int


def front(
    objectives: Objectives,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    population: int = 100,
    generations: int = 200,
    seed: int = 1,
    baseline: ArrayLike | None = None,
    keep: int = 200,
) -> ParetoFront:
    """Find the Pareto front of objectives over a box; the same seed gives the same bits.

    Parameters
    ----------
    objectives : maps points (n, k) to values (n, m), m >= 2, all to be minimised.
    lower, upper : bounds of the factors, shape (k,).
    population, generations, seed : of NSGA-II.
    baseline : a point (k,) to improve on. The pick is then the knee of those front points that dominate it.
    keep : about how many points to return. A larger front is thinned to evenly spread points, among them
        the best and worst of each objective, the knee and the pick.

    Raises
    ------
    ValueError when the bounds are not a box, a setting is out of range, or an objective is not finite.
    """
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    _check(low, high, population, generations, keep)
    if baseline is not None and np.shape(baseline) != low.shape:
        raise ValueError(f"baseline has shape {np.shape(baseline)}; give one value a factor ({low.size})")
    history = _evolve(objectives, low, high, population, generations, seed)
    archives = _archives(history)
    points, values = archives[-1]
    ideal, nadir = values.min(axis=0), values.max(axis=0)
    baseline_values = None if baseline is None else _evaluate(objectives, np.atleast_2d(baseline))[0]
    depth = knee_depth(values)
    best = int(depth.argmax())
    pick, reason = _pick(values, depth, baseline_values)
    kept = _spread(_normalised(values, ideal, nadir), keep, [best, pick])
    return ParetoFront(
        points=points[kept],
        values=values[kept],
        hypervolume=hypervolume(values, ideal, nadir),
        hypervolume_history=np.array([hypervolume(each, ideal, nadir) for _, each in archives]),
        ideal=ideal,
        nadir=nadir,
        knee=int(np.searchsorted(kept, best)),
        pick=int(np.searchsorted(kept, pick)),
        pick_reason=reason,
        baseline_values=baseline_values,
        archive_size=len(values),
        evaluations=sum(len(values) for _, values in history),
        generations=generations,
        seed=seed,
    )


def non_dominated(values: Array) -> NDArray[np.intp]:
    """Row numbers of the non-dominated of ``values`` (n, m), by ascending first objective, no repeats."""
    from pymoo.util.nds.non_dominated_sorting import find_non_dominated

    unique, rows = np.unique(values, axis=0, return_index=True)
    chosen: NDArray[np.intp] = rows[find_non_dominated(unique)]
    return chosen


def hypervolume(values: Array, ideal: Array, nadir: Array) -> float:
    """Volume that ``values`` (n, m) dominate, in objectives normalised to ``ideal`` 0 and ``nadir`` 1.

    The reference point is `REFERENCE` in each objective, so the largest volume possible is REFERENCE^m.
    Fronts compare only under the same ``ideal`` and ``nadir``.
    """
    from pymoo.indicators.hv import HV

    inside = _normalised(values, ideal, nadir)
    inside = inside[(inside < REFERENCE).all(axis=1)]
    return float(HV(ref_point=np.full(values.shape[1], REFERENCE))(inside)) if len(inside) else 0.0


def knee_depth(values: Array) -> Array:
    """Depth (n,) of front points (n, m) below the hyperplane through the best point of each objective.

    The knee is the deepest point. Distances are in normalised objectives. Where the best points do not span
    a plane that falls in every objective, the plane on which normalised objectives sum to 1 takes its place.

    Source: Das, On characterizing the "knee" of the Pareto curve (1999).
    """
    scaled = _normalised(values, values.min(axis=0), values.max(axis=0))
    extremes = scaled[scaled.argmin(axis=0)]
    normal = np.ones(scaled.shape[1])
    if np.linalg.cond(extremes) < 1e8:
        solved = np.linalg.solve(extremes, normal)
        normal = solved if (solved > 0).all() else normal
    depth: Array = (1 - scaled @ normal) / np.linalg.norm(normal)
    return depth


def _check(low: Array, high: Array, population: int, generations: int, keep: int) -> None:
    if low.ndim != 1 or low.shape != high.shape or not (np.isfinite(low) & np.isfinite(high)).all():
        raise ValueError("lower and upper bounds must be equally long lists of finite numbers")
    wrong = np.flatnonzero(low >= high)
    if wrong.size:
        at = wrong[0]
        raise ValueError(f"factor {at + 1}: lower bound {low[at]:g} must be below upper bound {high[at]:g}")
    for name, value, least in (
        ("population", population, 4),
        ("generations", generations, 1),
        ("keep", keep, 2),
    ):
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


def _evolve(
    objectives: Objectives, low: Array, high: Array, population: int, generations: int, seed: int
) -> list[tuple[Array, Array]]:
    """Points and values of each generation."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    history: list[tuple[Array, Array]] = []
    count = _evaluate(objectives, (low + high)[None, :] / 2).shape[1]

    class Recorded(Problem):
        def _evaluate(self, x: Array, out: dict[str, Array]) -> None:
            out["F"] = _evaluate(objectives, x)
            history.append((x.copy(), out["F"].copy()))

    problem = Recorded(n_var=low.size, n_obj=count, xl=low, xu=high)
    minimize(problem, NSGA2(pop_size=population), ("n_gen", generations), seed=seed)
    return history


def _archives(history: list[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """Non-dominated points and values of all evaluations up to each generation."""
    archives = []
    points, values = (part[:0] for part in history[0])
    for new_points, new_values in history:
        points, values = np.vstack([points, new_points]), np.vstack([values, new_values])
        rows = non_dominated(values)
        points, values = points[rows], values[rows]
        archives.append((points, values))
    return archives


def _normalised(values: Array, ideal: Array, nadir: Array) -> Array:
    span = nadir - ideal
    scaled: Array = (values - ideal) / np.where(span > 0, span, 1.0)
    return scaled


def _pick(values: Array, depth: Array, baseline: Array | None) -> tuple[int, str]:
    best = int(depth.argmax())
    if baseline is None:
        return best, "the knee of the front, for no baseline is given"
    better = np.flatnonzero((values <= baseline).all(axis=1) & (values < baseline).any(axis=1))
    if better.size == 0:
        return best, "the knee of the front, for no point of the front dominates the baseline"
    pick = int(better[depth[better].argmax()])
    return pick, f"the knee among the {better.size} of {len(values)} front points that dominate the baseline"


def _spread(scaled: Array, keep: int, wanted: list[int]) -> NDArray[np.intp]:
    """Rows to keep, ascending: the extremes and the wanted first, then always the row farthest from all."""
    if len(scaled) <= keep:
        return np.arange(len(scaled))
    chosen = sorted({*scaled.argmin(axis=0).tolist(), *scaled.argmax(axis=0).tolist(), *wanted})
    gap = np.min([np.linalg.norm(scaled - scaled[row], axis=1) for row in chosen], axis=0)
    while len(chosen) < keep:
        chosen.append(int(gap.argmax()))
        gap = np.minimum(gap, np.linalg.norm(scaled - scaled[chosen[-1]], axis=1))
    return np.sort(chosen)
