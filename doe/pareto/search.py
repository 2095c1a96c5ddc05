"""Search of Pareto fronts of cheap responses by NSGA-II: goals, dominance, the archive of all evaluated
points, hypervolumes, and the rules that pick one point of a front.

Responses keep their units; the search minimises the costs of their goals. Points that keep all limits dominate the others
(constrained domination), and only they enter the archive. Costs are normalised to 0 at the ideal point and 1 at the nadir
point, and a hypervolume counts up to `REFERENCE`. A mean with an error dominates another only if the difference exceeds the
noise.

A *cost* is what the search minimises: the response itself ("min"), its negative ("max") or its distance from the
target ("target"). A response of goal "none" has no cost; it may still have limits.

Sources: Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II (2002); Hughes, Evolutionary multi-objective
ranking with uncertainty and noise (2001); Teich, Pareto-front exploration with uncertain objectives (2001);
Das, On characterizing the "knee" of the Pareto curve (1999); Derringer and Suich, Simultaneous optimization
of several response variables (1980); Steuer and Choo, An interactive weighted Tchebycheff procedure (1983).
"""

from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Any, Literal, NamedTuple, Self, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from rbdyn.base.arrays import Array, Mask, Rows
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record

REFERENCE = 1.1  # reference point of the hypervolume: the nadir and a tenth of each range beyond it
LEVELS = 13  # 2^13 levels of the costs by which sets of points are compared
EXACT = 3  # most objectives for which the volume of every archive of a search is exact
BLOCK = 64  # points that are compared with all levels at once


def normalised(values: Array, ideal: Array, nadir: Array) -> Array:
    """Costs (..., q) on the scale from ideal 0 to nadir 1; a cost without range stays at 0."""
    span = nadir - ideal
    return (values - ideal) / np.where(span > 0, span, 1.0)


def hypervolume(values: Array, ideal: Array, nadir: Array) -> float:
    """Volume that ``values`` (n, m) dominate, in objectives normalised to ``ideal`` 0 and ``nadir`` 1.

    The reference point is `REFERENCE` in each objective, so the largest volume possible is REFERENCE^m.
    Fronts compare only under the same ``ideal`` and ``nadir``. Exact for up to `EXACT` objectives, else as of `growth`.
    """
    if ideal.size > EXACT:
        return float(growth([values], ideal, nadir)[0])
    from pymoo.indicators.hv import HV

    inside = normalised(values, ideal, nadir)
    inside = inside[(inside < REFERENCE).all(axis=1)]
    return float(HV(ref_point=np.full(values.shape[1], REFERENCE))(inside)) if len(inside) else 0.0


def growth(generations: Sequence[Array], ideal: Array, nadir: Array) -> Array:
    """Hypervolume of each of ``generations``, costs (n, m) found in turn in a search, with all before it.

    Exact for up to `EXACT` objectives. The exact volume of thousands of points in six would take hours; those of more are the
    share of quasi-random levels that the points dominate, within about 1 %.
    """
    if ideal.size <= EXACT:
        archives = accumulate(generations, _merged_costs, initial=generations[0][:0])
        return np.array([hypervolume(costs, ideal, nadir) for costs in archives][1:])
    values = REFERENCE * qmc.Sobol(ideal.size, seed=1).random_base2(LEVELS).T
    ordered = np.sort(values, axis=1)

    def ranks(columns: Array) -> NDArray[np.int16]:
        """Numbers of levels below each value of each column: short whole numbers compare four times as fast."""
        return np.array([np.searchsorted(*pair) for pair in zip(ordered, columns, strict=True)], dtype=np.int16)

    levels, counts = ranks(values), list[int]()
    for costs in generations:
        new = ranks(normalised(costs, ideal, nadir).T)
        for first in range(0, len(costs), BLOCK):
            below = np.logical_and.reduce(
                [a[:, None] <= b for a, b in zip(new[:, first : first + BLOCK], levels, strict=True)]
            )
            levels = levels[:, ~below.any(axis=0)]
        counts.append(values.shape[1] - levels.shape[1])
    return float(REFERENCE**ideal.size) * np.array(counts) / values.shape[1]


def columns_of(parts: Sequence[Array]) -> Array:
    """Equal arrays (...) as columns (..., q), each of which stays in one piece of memory: a search reads column by column."""
    return np.moveaxis(np.array(parts), 0, -1)


def _merged_costs(archive: Array, new: Array) -> Array:
    costs = np.vstack([archive, new])
    return costs[non_dominated(costs)]


class Archive(NamedTuple):
    """Points (f, k) and their costs (f, q), none of which dominates another."""

    points: Array
    costs: Array


def non_dominated(values: Array) -> Rows:
    """Row numbers of the distinct non-dominated ``values`` (n, m), by ascending first objective."""
    from pymoo.util.nds.non_dominated_sorting import find_non_dominated

    unique, rows = np.unique(values, axis=0, return_index=True)
    if not len(unique):
        return rows
    return rows[find_non_dominated(unique)]


def dominates(better: Array, worse: Array) -> Mask:
    """Whether costs (..., q) are nowhere larger than others and somewhere smaller."""
    # Column by column: a reduction along so short an axis takes four times as long.
    columns = [(better[..., i], worse[..., i]) for i in range(better.shape[-1])]
    never_larger = np.logical_and.reduce([ours <= theirs for ours, theirs in columns])
    return np.asarray(never_larger & np.logical_or.reduce([ours < theirs for ours, theirs in columns]))


def non_dominated_points(archive: Archive) -> Archive:
    """Those points that no other one dominates."""
    rows = non_dominated(archive.costs)
    return Archive(archive.points[rows], archive.costs[rows])


def spread(costs: Array, keep: int, required: Sequence[int] = ()) -> Rows:
    """``keep`` rows of costs (n, q), ascending: extremes and ``required`` rows, then always the row farthest from these."""
    if len(costs) <= keep:
        return np.arange(len(costs))
    scaled = normalised(costs, costs.min(axis=0), costs.max(axis=0))
    rows = sorted({*scaled.argmin(axis=0).tolist(), *scaled.argmax(axis=0).tolist(), *required})
    gap = np.min([np.linalg.norm(scaled - scaled[row], axis=1) for row in rows], axis=0)
    while len(rows) < keep:
        rows.append(int(gap.argmax()))
        gap = np.minimum(gap, np.linalg.norm(scaled - scaled[rows[-1]], axis=1))
    return np.sort(rows)


def best_for_hypervolume(costs: Array, keep: int, seed: int = 1) -> Rows:
    """``keep`` rows of costs (n, q), ascending, that together have nearly the largest hypervolume.

    The greedy selection adds the row that dominates most of the remaining levels, until none dominates any; further rows
    are evenly spread. It reaches at least 1 - 1/e of the largest gain, in practice nearly all of it.

    Source: Guerreiro, Fonseca and Paquete, Greedy hypervolume subset selection in low dimensions (2016).
    """
    if len(costs) <= keep:
        return np.arange(len(costs))
    scaled = normalised(costs, costs.min(axis=0), costs.max(axis=0))
    levels = REFERENCE * qmc.Sobol(costs.shape[1], seed=seed).random_base2(LEVELS)
    below = np.ones((len(costs), len(levels)), dtype=bool)
    for column, level in zip(scaled.T, levels.T, strict=True):
        below &= column[:, None] <= level[None]
    rows: list[int] = []
    gains, open_levels = below.sum(axis=1), np.ones(len(levels), dtype=bool)
    while len(rows) < keep and gains.max() > 0:
        # Gains only shrink as rows are added: the first gain is recounted until it remains the first.
        row = int(gains.argmax())
        now = int((below[row] & open_levels).sum())
        if now == gains[row]:
            rows.append(row)
            open_levels &= ~below[row]
            now = 0
        gains[row] = now
    return spread(costs, keep, rows)


Objectives = Callable[[Array], Array]
# Errors downwards and upwards (n, m) of predicted responses at points (n, k), within which limits must hold.
Doubt = Callable[[Array], tuple[Array, Array]]


class Judged(NamedTuple):
    """Costs (n, q) of points and their excess over each limit (n, c)."""

    costs: Array
    violations: Array


# How far points (n, k) lie beyond where anything may be sought (n,); at most 0 within.
Barred = Callable[[Array], Array]


def barring(judge: "Judge", barred: Barred | None) -> "Judge":
    """The judge for which what is ``barred`` is one more limit, the last."""
    if barred is None:
        return judge

    def judged(points: Array) -> Judged:
        costs, violations = judge(points)
        return Judged(costs, np.column_stack([violations, barred(points).clip(0.0)]))

    return judged


Judge = Callable[[Array], Judged]
History = list[tuple[Array, Judged]]  # points of each generation, with their costs and violations


class InfeasibleError(MethodError):
    """No point keeps all limits; the closest ``point`` exceeds them by ``violations`` (c,)."""

    def __init__(self, point: Array, violations: Array) -> None:
        self.point, self.violations = point, violations
        super().__init__("no point meets all limits; loosen one")


class Search(NamedTuple):
    """Points that keep all limits, by generation; number of evaluations, and share of these that keep the limits."""

    generations: list[Archive]
    evaluations: int
    feasible: float

    @property
    def archive(self) -> Archive:
        """Non-dominated points of all generations."""
        return non_dominated_points(Archive(*map(np.vstack, zip(*self.generations, strict=True))))


def search(judge: Judge, low: Array, high: Array, population: int, generations: int, seed: int) -> Search:
    """NSGA-II over a box.

    Raises InfeasibleError when no evaluated point keeps all limits.
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
    return Search(good, count, sum(int(rows.sum()) for rows in allowed) / count)


def check_search(low: Array, high: Array, population: int, generations: int, keep: int) -> None:
    """Raises MethodError when the bounds are not a box or a setting is out of range."""
    if low.ndim != 1 or low.shape != high.shape or not (np.isfinite(low) & np.isfinite(high)).all():
        raise MethodError("lower and upper bounds must be equally long lists of finite numbers")
    wrong = np.flatnonzero(low >= high)
    if wrong.size:
        factor = wrong[0]
        raise MethodError(
            f"factor {factor + 1}: lower bound {low[factor]:g} must be below upper bound {high[factor]:g}"
        )
    for name, value, least in (("population", population, 4), ("generations", generations, 1), ("keep", keep, 2)):
        if value < least:
            raise MethodError(f"{name} = {value}: must be at least {least}")


def _scale(violations: Array) -> Array:
    """Scale (c,) of violations (n, c), their largest values, to compare limits of different units; 1 without violations."""
    largest = violations.max(axis=0, initial=0.0)
    return np.where(largest > 0.0, largest, 1.0)


def _evolve(judge: Judge, low: Array, high: Array, population: int, generations: int, seed: int) -> History:
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.duplicate import DefaultDuplicateElimination
    from pymoo.core.problem import Problem
    from pymoo.core.repair import NoRepair
    from pymoo.optimize import minimize

    history: History = []
    # The scale of the violations comes from points all over the box.
    sample = judge(np.random.default_rng(seed).uniform(low, high, (population, low.size)))
    scale = _scale(sample.violations)

    class Recorded(Problem):
        def _evaluate(self, x: Array, out: dict[str, Array]) -> None:
            judged = judge(x)
            out["F"] = judged.costs
            if scale.size:
                out["G"] = judged.violations / scale
            history.append((x.copy(), Judged(judged.costs.copy(), judged.violations.copy())))

    class Lean(NSGA2):
        def _set_optimum(self) -> None:
            """The best of a generation, which nobody reads here."""

    class Unchanged(NoRepair):
        def do(self, _: Problem, offspring: Any, **named: Any) -> Any:
            return offspring

    distinct = DefaultDuplicateElimination(func=lambda offspring: np.array([point.X for point in offspring]))
    count = sample.costs.shape[1]
    problem = Recorded(n_var=low.size, n_obj=count, n_ieq_constr=scale.size, xl=low, xu=high)
    method = Lean(pop_size=population, eliminate_duplicates=distinct, repair=Unchanged())
    minimize(problem, method, ("n_gen", generations), seed=seed)
    return history


Kind = Literal["min", "max", "target", "none"]
# Values of goals that a response does not have.
BLANK = {"target": np.nan, "lower": -np.inf, "upper": np.inf, "weight": 1.0}


class Goals(Record, eq=False):
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
            if self.kinds[i] == "target":
                columns.append(np.maximum(np.abs(low[..., i] - self.target[i]), np.abs(high[..., i] - self.target[i])))
            else:
                columns.append(high[..., i] if self.kinds[i] == "min" else -low[..., i])
        return columns_of(columns)

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
CONCESSION = 0.05  # ranges of a cost that picks may lose beyond what no point avoids, where none dominates the baseline
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


def loss_against(costs: Array, baseline: Array) -> Array:
    """Largest loss (n,) of front points (n, q) against the baseline (q,), in ranges of the costs on the front.

    Where the front does not reach the baseline, a loss counts from the best of the front: what no point avoids decides nothing.
    """
    ideal, nadir = costs.min(axis=0), costs.max(axis=0)
    beyond = normalised(costs, ideal, nadir) - normalised(np.maximum(baseline, ideal), ideal, nadir)
    return beyond.max(axis=1).clip(0.0)


def pick_all(costs: Array, goals: Goals, baseline: Array | None) -> tuple[dict[Rule, int], str]:
    """The pick of every rule among the points that dominate the baseline, and the set of these points in words.

    Where none dominates it, the candidates are the points whose `loss_against` the baseline is at most `CONCESSION` above the
    least. A miss by a hair then moves the picks little: they do not go to the knee of the whole front. Without a baseline all
    points are candidates.
    """
    rows = np.arange(len(costs))
    if baseline is None:
        among = "of the front, without a baseline"
    else:
        rows = np.flatnonzero(dominates(costs, baseline))
        among = f"among the {rows.size} (of {len(costs)}) front points that beat the baseline in every response"
        if rows.size == 0:
            loss = loss_against(costs, baseline)
            rows = np.flatnonzero(loss <= loss.min() + CONCESSION)
            among = (
                f"among the {rows.size} (of {len(costs)}) front points that lose least against the baseline; "
                "no point beats it in every response"
            )
    return {rule: int(rows[score(rule, costs, goals)[rows].argmax()]) for rule in RULES}, among
