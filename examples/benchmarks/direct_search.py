"""The front of a noisy simulator without surfaces: NSGA-II with error-aware dominance and an honest end.

A search keeps whatever was lucky, so what it believes of its survivors is too good (the winner's curse). Three shares
of the budget mend that: the search; fresh runs at its candidates, which choose the finalists; and again fresh runs
at the finalists, which alone are reported. Runs that chose a point say nothing of it in the end.

Sources: Deb et al. (2002) for NSGA-II; Hughes (2001) and Teich (2001) for dominance under noise.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from doe.pareto.front import NOISE_DRAWS, Samples, SimulatedFront, noisy_hypervolume
from doe.pareto.search import NAMES, Goals, Rule, check_search, dominates, non_dominated, pick_all, spread
from rbdyn.base.arrays import Array, Mask, Rows
from rbdyn.base.faults import MethodError
from rbdyn.base.words import signed_with_error

Evaluate = Callable[[Array], tuple[Array, Array]]

FAILED = 1e30  # cost of a point whose run failed: behind every other
SELECTING = 4  # fresh runs a candidate
REPORTING = 4  # fresh runs a finalist at least


class DirectFront(SimulatedFront, eq=False, kw_only=True):
    """A front with ``repeats`` fresh runs a point, the points of failed runs (x, k), and the effort of its search."""

    repeats: int
    failures: Array
    evaluations: int
    generations: int


def direct_front(
    evaluate: Evaluate,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    goals: Goals,
    evaluations: int = 2000,
    population: int = 50,
    seed: int = 1,
    baseline: ArrayLike | None = None,
    confidence: float = 0.95,
    resample: float = 0.3,
    pick: Rule = "knee",
) -> DirectFront:
    """Find the front of a noisy simulator; the same seed and the same runs give the same bits.

    evaluate : runs points (n, k), a generation at once, and gives responses (n, m) and their standard errors (n, m),
        NaN where a run failed. Every row of every call must be a run of its own (a fresh seed, such as a running
        number), even at a point that was run before.
    lower, upper : bounds of the factors, shape (k,). goals : what is wanted of the m responses.
    evaluations : budget of rows, never exceeded. population, seed : of NSGA-II.
    baseline : a point (k,) to improve on, run like a finalist.
    confidence : at which a difference counts while the search sorts.
    resample : share of the budget for fresh runs at the end. pick : rule that makes the pick.

    Raises MethodError when the bounds are not a box, a setting is out of range, the budget is below five populations, or
    every run at the points of a stage failed or breaks a limit.
    """
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    _check(low, high, evaluations, population, resample, confidence)
    generations = int(evaluations * (1.0 - resample)) // population
    archive = _search(evaluate, (low, high), goals, population, generations, seed, confidence)
    left = evaluations - len(archive.points)
    candidates = archive.rows(_candidates(archive, goals, confidence, max(left // (2 * SELECTING), 1)))
    fresh = repeated(evaluate, candidates.points, SELECTING)
    left -= SELECTING * len(candidates.points)
    chosen = _finalists(fresh, goals, max(left // REPORTING - 1, 1))
    original = np.empty((0, low.size)) if baseline is None else np.asarray(baseline, float)[None]
    repeats = max(left // (len(chosen) + len(original)), 1)
    final = repeated(evaluate, np.vstack([candidates.points[chosen], original]), repeats)
    ours, base = final.rows(slice(len(chosen))), final.rows(slice(len(chosen), None)).values
    sound = np.flatnonzero(~ours.failed)
    if not sound.size:
        raise MethodError("every run at the finalists failed; see the failures of the runs")
    ours, believed = ours.rows(sound), goals.costs(candidates.values[chosen][sound])
    base_costs = goals.costs(base[0]) if len(base) and not np.isnan(base).any() else None
    picks, among = pick_all(goals.costs(fresh.values[chosen][sound]), goals, base_costs)
    costs = goals.costs(ours.values)
    span = np.ptp(costs, axis=0)
    return DirectFront(
        *ours,
        costs=costs,
        cost_errors=ours.errors[:, goals.objectives],
        optimism=(costs - believed).mean(axis=0) / np.where(span > 0.0, span, 1.0),
        pick=picks[pick],
        pick_reason=f"{NAMES[pick]} {among}",
        baseline_values=base[0] if len(base) else None,
        repeats=repeats,
        failures=np.unique(np.vstack([batch.points[batch.failed] for batch in (archive, fresh, final)]), axis=0),
        evaluations=len(archive.points) + SELECTING * len(candidates.points) + repeats * len(final.points),
        generations=generations,
        seed=seed,
        goals=goals,
        searched=archive,
    )


def _check(low: Array, high: Array, evaluations: int, population: int, resample: float, confidence: float) -> None:
    check_search(low, high, population, 1, 2)
    if not 0.1 <= resample <= 0.9 or not 0.5 < confidence < 1.0:
        raise MethodError(f"resample = {resample}, confidence = {confidence}: must be in [0.1, 0.9] and (0.5, 1)")
    if evaluations < 5 * population:
        mend = "give more runs or a smaller population"
        raise MethodError(f"evaluations = {evaluations}: must be at least five populations ({5 * population}); {mend}")


def _search(
    evaluate: Evaluate, box: tuple[Array, Array], goals: Goals, size: int, rounds: int, seed: int, confidence: float
) -> Samples:
    """Every evaluation of NSGA-II whose survivors are told apart beyond their errors only."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.core.survival import Survival
    from pymoo.operators.sampling.lhs import LHS
    from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance
    from pymoo.problems.static import StaticProblem

    class Surviving(Survival):
        def _do(self, problem: Any, pop: Any, *arguments: Any, n_survive: int | None = None, **rest: Any) -> Any:
            costs, errors = pop.get("F"), pop.get("errors")
            place = _behind(order(costs, errors, confidence), pop.get("broken"))
            crowding = np.zeros(len(pop))
            for level in np.unique(place):
                crowding[place == level] = calc_crowding_distance(costs[place == level])
            pop.set("rank", place)
            pop.set("crowding", crowding)
            return pop[np.lexsort((-crowding, place))[:n_survive]]

    problem = Problem(n_var=box[0].size, n_obj=len(goals.objectives), xl=box[0], xu=box[1])
    algorithm = NSGA2(pop_size=size, sampling=LHS(), survival=Surviving(filter_infeasible=False))
    algorithm.tournament_type = "comp_by_rank_and_crowding"
    algorithm.setup(problem, termination=("n_gen", rounds), seed=seed)
    batches: list[Samples] = []
    for _ in range(rounds):
        infill = algorithm.ask()
        batch = _run(evaluate, infill.get("X"))
        bad = batch.failed
        costs = np.where(bad[:, None], FAILED, goals.costs(batch.values))
        infill.set("errors", np.where(bad[:, None], 0.0, batch.errors[:, goals.objectives]))
        infill.set("broken", np.where(bad, np.inf, _broken(batch, goals)))
        Evaluator().eval(StaticProblem(problem, F=costs), infill)
        algorithm.tell(infills=infill)
        batches.append(batch)
    return Samples(*(np.vstack(part) for part in zip(*batches, strict=True)))


def _run(evaluate: Evaluate, points: Array) -> Samples:
    values, errors = (np.array(part, float) for part in evaluate(points.copy()))
    failed = ~np.isfinite(values).all(axis=1)
    values[failed] = np.nan
    return Samples(points, values, np.where(np.isfinite(errors), errors, 0.0))


def repeated(evaluate: Evaluate, points: Array, times: int) -> Samples:
    """Means of ``times`` fresh runs at each of points (n, k), all in one batch; NaN where one of them failed."""
    batch = _run(evaluate, np.tile(points, (times, 1)))
    values = batch.values.reshape(times, len(points), -1)
    stated = np.sqrt((batch.errors.reshape(values.shape) ** 2).sum(axis=0)) / times
    if times == 1:
        return Samples(points, values[0], stated)
    # What the runs themselves scatter by counts where it is more than they state.
    scatter = values.std(axis=0, ddof=1) / np.sqrt(times)
    typical = np.sqrt(np.nanmean(scatter**2, axis=0)) if np.isfinite(scatter).any() else 0.0
    return Samples(points, values.mean(axis=0), np.where(stated > 0.0, stated, typical))


def _broken(batch: Samples, goals: Goals) -> Array:
    """Sum of the broken limits (n,), each in shares of the limit."""
    scale = np.array([abs(limit) or 1.0 for _, _, limit in goals.limited])
    return (goals.violations(batch.values, batch.values) / scale).sum(axis=1)


def _behind(place: Rows, broken: Array) -> Rows:
    """Places with those that break a limit or failed behind all others, by how far."""
    _, far = np.unique(broken, return_inverse=True)
    return np.where(broken > 0.0, place.max() + 1 + far.reshape(-1), place)


def _allowed(batch: Samples, goals: Goals) -> Rows:
    good = ~batch.failed
    good[good] &= _broken(batch.rows(good), goals) <= 0.0
    rows = np.flatnonzero(good)
    if not rows.size:
        raise MethodError("every run failed or breaks a limit; loosen the limits or see the failures")
    return rows


def _candidates(archive: Samples, goals: Goals, confidence: float, count: int) -> Rows:
    """Rows of the archive for fresh runs: the best places first, spread out in the last of them."""
    rows = _allowed(archive, goals)
    costs, errors = goals.costs(archive.values[rows]), archive.errors[rows][:, goals.objectives]
    open_ones = np.flatnonzero(~error_aware_dominance(costs, errors, confidence).any(axis=0))
    level = ranks(dominance(costs[open_ones]))
    chosen: list[int] = []
    for each in np.unique(level):
        room = count - len(chosen)
        if room <= 0:
            break
        alike = open_ones[level == each]
        chosen += alike[spread(costs[alike], room)][:room].tolist()
    return rows[np.array(chosen)]


def _finalists(fresh: Samples, goals: Goals, count: int) -> Rows:
    """Rows of the candidates that their fresh runs leave non-dominated, by ascending first cost."""
    rows = _allowed(fresh, goals)
    costs = goals.costs(fresh.values[rows])
    front = np.flatnonzero(~dominance(costs).any(axis=0))
    front = front[spread(costs[front], count)][:count]
    return rows[front[np.argsort(costs[front, 0], kind="stable")]]


@dataclass(frozen=True)
class SurrogateLoss:
    """Hypervolumes on a common scale with their 95 % half widths; the loss in percent of the direct one with its own.

    The loss is None where the direct front reaches nothing of the common scale.
    """

    hypervolume: float
    hypervolume_error: float
    surrogate_hypervolume: float
    surrogate_hypervolume_error: float
    loss_percent: float | None
    loss_error_percent: float | None

    @property
    def sentence(self) -> str:
        """Whether the surfaces lose anything that can be told from noise."""
        if self.loss_percent is None or self.loss_error_percent is None:
            return "The direct front lies wholly behind that of the surfaces; give the direct search more runs."
        figure = f"{signed_with_error(self.loss_percent, self.loss_error_percent)} % of the direct front's hypervolume"
        if abs(self.loss_percent) <= self.loss_error_percent:
            return f"Loss of the surfaces: {figure}, not significant."
        if self.loss_percent > 0.0:
            return f"Loss of the surfaces: {figure}."
        return f"Loss of the surfaces: {figure}; they find more than the direct search does in its budget."


def relative_hypervolumes(
    one: tuple[Array, Array], other: tuple[Array, Array], seed: int
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Hypervolumes with their standard errors of two fronts of costs (n, q) with standard errors (n, q), on the scale of ideal
    and nadir of the two together."""
    both = np.vstack([one[0], other[0]])
    both = both[non_dominated(both)]
    scale = both.min(axis=0), both.max(axis=0)
    return noisy_hypervolume(*one, *scale, NOISE_DRAWS, seed), noisy_hypervolume(*other, *scale, NOISE_DRAWS, seed + 1)


def compare_with_surrogate(
    direct: SimulatedFront, surrogate_values: Array, surrogate_errors: Array, *, seed: int = 1
) -> SurrogateLoss:
    """Compare a direct front with a surrogate's, whose points were run on the simulator afresh.

    ``surrogate_values`` and ``surrogate_errors`` (s, m) are the means and standard errors of those runs; rows of NaN
    (failed runs) are left out. Both fronts are normalised to the ideal and nadir of the two together. A front of more
    points can cover more: compare equally many.

    Raises MethodError when no surrogate point is left.
    """
    goals = direct.goals
    good = np.isfinite(surrogate_values).all(axis=1)
    if not good.any():
        raise MethodError("every run at the surrogate's points failed; nothing can be compared")
    costs, errors = goals.costs(surrogate_values[good]), surrogate_errors[good][:, goals.objectives]
    fronts = relative_hypervolumes((direct.costs, direct.cost_errors), (costs, errors), seed)
    (ours, our_error), (theirs, their_error) = fronts
    ratio = theirs / ours if ours > 0.0 else None
    error = None if ratio is None else 196.0 * float(np.hypot(ratio * our_error, their_error)) / ours
    return SurrogateLoss(
        hypervolume=ours,
        hypervolume_error=1.96 * our_error,
        surrogate_hypervolume=theirs,
        surrogate_hypervolume_error=1.96 * their_error,
        loss_percent=None if ratio is None else 100.0 * (1.0 - ratio),
        loss_error_percent=error,
    )


def dominance(costs: Array) -> Mask:
    """Whether row i of ``costs`` (n, q) dominates row j, (n, n), without regard to errors."""
    return dominates(costs[:, None], costs[None, :])


def error_aware_dominance(costs: Array, errors: Array, confidence: float) -> Mask:
    """Whether mean i dominates mean j beyond their errors: (n, n).

    Row i of ``costs`` (n, q) must be below row j in every cost. The least difference is the one-sided normal quantile of
    ``confidence`` times the combined standard error of both, ``errors`` (n, q).
    """
    difference = costs[None, :] - costs[:, None]
    combined = np.sqrt(errors[None, :] ** 2 + errors[:, None] ** 2)
    return (difference > norm.ppf(confidence) * combined).all(axis=-1)


def ranks(dominating: Mask) -> Rows:
    """Front number (n,) of each row: 0 for non-dominated rows, 1 for rows that only those dominate, and so on."""
    rank = np.full(len(dominating), -1, dtype=np.intp)
    dominators = dominating.sum(axis=0)
    level = 0
    while (rank < 0).any():
        front = (dominators == 0) & (rank < 0)
        if not front.any():
            # With errors, dominance may be circular; all rows of a circle share a front.
            front = rank < 0
        rank[front] = level
        dominators = dominators - dominating[front].sum(axis=0)
        level += 1
    return rank


def order(costs: Array, errors: Array, confidence: float) -> Rows:
    """Place (n,) of each row by its front beyond errors, and within that by its front without errors."""
    outer = ranks(error_aware_dominance(costs, errors, confidence))
    inner = np.empty_like(outer)
    for level in np.unique(outer):
        rows = np.flatnonzero(outer == level)
        inner[rows] = ranks(dominance(costs[rows]))
    _, places = np.unique(np.column_stack([outer, inner]), axis=0, return_inverse=True)
    return places.reshape(-1)
