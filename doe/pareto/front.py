"""Pareto fronts of cheap responses, with their picks and the effect of surface errors, and fronts of simulated points.

``front`` finds a ``ParetoFront``. Responses keep their units; the search minimises the costs of their goals. The coefficients
of a least-squares surface follow a multivariate t distribution about their estimates. One draw of them is a surface that
the runs support as well. All points of a drawn surface share its error, and so does the difference of two points.

The figures of a ``SimulatedFront`` are those of fresh runs, which had no part in the selection of its points.

Source: Box and Tiao, Bayesian Inference in Statistical Analysis, section 2.7.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from doe.pareto import search
from doe.pareto.manufacture import ToleranceAware
from rbdyn.base.arrays import Array, Mask
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record

SELECTIONS = 300  # draws on which the rule picks anew, so many that their error is below that of the gain


class Dominance(Record):
    """Probability that the pick dominates the baseline, with the Monte Carlo error of its draws."""

    probability: float
    standard_error: float
    draws: int


class FrontUncertainty(Record, eq=False):
    """Uncertainty of a front.

    ``non_dominated`` (f,): probability that no other front point dominates a point. ``pick_dominates`` the
    baseline with a probability. ``optimism`` (q,): excess of the predicted gain of each
    cost, because the rule prefers points with favourable errors.
    """

    non_dominated: Array
    pick_dominates: Dominance
    optimism: Array


def draw_coefficients(
    coefficients: Array, covariance: Array, dof: int, draws: int, random: np.random.Generator
) -> Array:
    """Draws (draws, p) of coefficients (p,) from the multivariate t of ``dof`` degrees of freedom.

    ``covariance`` (p, p) is the estimated covariance of the coefficients, the scale matrix of the distribution.
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(values.clip(0.0))
    normal = random.standard_normal((draws, coefficients.size)) @ root.T
    return coefficients + normal / np.sqrt(random.chisquare(dof, (draws, 1)) / dof)


def share(hits: Mask) -> tuple[Array, Array]:
    """Share of hits among the draws (d, ...) and its Monte Carlo standard error.

    The error counts one additional hit and miss, so that hits in all draws do not count as certain.
    """
    count = len(hits)
    mean = hits.mean(axis=0)
    careful = (hits.sum(axis=0) + 1.0) / (count + 2.0)
    return mean, np.sqrt(careful * (1.0 - careful) / count)


def non_dominated_share(costs: Array) -> Array:
    """Probability (f,) that no other point dominates a point, from costs (d, f, q) of many draws."""
    from pymoo.util.nds.non_dominated_sorting import find_non_dominated

    undominated = np.zeros(costs.shape[:2], dtype=bool)
    for row, draw in zip(undominated, costs, strict=True):
        row[find_non_dominated(draw)] = True
    return undominated.mean(axis=0)


def front_uncertainty(
    responses: Array, goals: search.Goals, values: Array, pick: int, rule: search.Rule, baseline: Array, original: Array
) -> FrontUncertainty:
    """Uncertainty of a front, from responses on drawn surfaces.

    responses : (d, f, m) of the front's points on each drawn set of surfaces.
    goals : of the responses.
    values : responses (f, m) on the fitted surfaces.
    pick, rule : row of the pick and its rule.
    baseline, original : responses (d, m) of the baseline on the drawn surfaces and (m,) on the fitted ones.
    """
    costs, base = goals.costs(responses), goals.costs(baseline)
    wins, error = share(search.dominates(costs[:, pick], base))
    real = goals.costs(original) - goals.costs(values)
    optimism = selection_optimism(costs[:SELECTIONS], base[:SELECTIONS], real, goals, rule)
    dominance = Dominance(float(wins), float(error), len(responses))
    return FrontUncertainty(non_dominated_share(costs), dominance, optimism)


def selection_optimism(costs: Array, baseline: Array, real: Array, goals: search.Goals, rule: search.Rule) -> Array:
    """Mean excess (q,) of the predicted gain at a rule's pick over the real gain, by parametric bootstrap.

    The fitted surfaces represent the truth and drawn ones the fit: ``costs`` (d, f, q) and ``baseline`` (d, q) are of draws,
    ``real`` (f, q) are the gains on the fitted surfaces.
    """
    excess = []
    for draw, base in zip(costs, baseline, strict=True):
        row = search.pick_all(draw, goals, base)[0][rule]
        excess.append(base - draw[row] - real[row])
    return np.mean(excess, axis=0)


def contrast_error(jacobian: Array, covariance: Array) -> float:
    """Standard error of a difference of predictions, in which their common error cancels.

    ``jacobian`` (p,): difference of their derivatives by the coefficients. ``covariance`` (p, p): of the coefficients.
    """
    return math.sqrt(max(float(jacobian @ covariance @ jacobian), 0.0))


class ParetoFront(Record, eq=False):
    """Non-dominated points of all evaluated points, in ascending order of the first cost.

    ``points`` (f, k) in the factors' units; ``values`` (f, m) of all responses in their units, ``costs`` (f, q) by their goals.
    ``ideal``, ``nadir`` (q,): best and worst of each cost on the front. ``knee``, ``pick`` and ``picks`` (by rule) are row
    numbers. ``archive_size``: number of points before thinning, with their ``hypervolume``; ``hypervolume_history``
    (generations,) has the same scale. ``baseline_values`` (m,): None without a baseline. ``feasible``: share of the evaluated
    points that keep all limits. ``uncertainty`` and ``tolerance_aware``: None unless computed.

    ``violations`` (c,): where no point keeps all limits, the front is the closest point alone, with this excess over each limit;
    else None. ``tolerance_violations`` (c,): the same of the closest point of a tolerance-aware front, which is then None.
    """

    points: Array
    values: Array
    costs: Array
    hypervolume: float
    hypervolume_history: Array
    ideal: Array
    nadir: Array
    knee: int
    pick: int
    picks: dict[search.Rule, int]
    pick_reason: str
    baseline_values: Array | None
    archive_size: int
    evaluations: int
    feasible: float
    generations: int
    seed: int
    goals: search.Goals
    uncertainty: FrontUncertainty | None = None
    tolerance_aware: ToleranceAware | None = None
    violations: Array | None = None
    tolerance_violations: Array | None = None


def front(
    objectives: search.Objectives,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    goals: search.Goals | None = None,
    population: int = 100,
    generations: int = 200,
    seed: int = 1,
    baseline: ArrayLike | None = None,
    keep: int = 200,
    pick: search.Rule = "knee",
    doubt: search.Doubt | None = None,
    closest: bool = False,
    barred: search.Barred | None = None,
) -> ParetoFront:
    """Find the Pareto front of responses over a box; the same seed gives the same bits.

    objectives : maps points (n, k) to responses (n, m), at least two of them with a goal.
    lower, upper : bounds of the factors, shape (k,).
    goals : of the responses; by default all are minimised.
    population, generations, seed : of NSGA-II.
    baseline : a point (k,) to improve on. Picks are then among the front points that dominate it.
    keep : approximate number of points to return. A larger front is thinned to evenly spread points, with the best and
        worst of each cost, the knee and the picks.
    pick : rule of the pick.
    doubt : maps points (n, k) to the errors of their responses downwards and upwards (n, m), within which limits must hold.
    closest : where no evaluated point keeps all limits, return the closest one as the front.
    barred : maps points (n, k) to how far they lie beyond where the search may go (n,), at most 0 within.

    Raises MethodError when the bounds are no box, a setting is out of range, or an objective is not finite; InfeasibleError
    when no evaluated point keeps all limits, unless the ``closest`` is asked for.
    """
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    search.check_search(low, high, population, generations, keep)
    if baseline is not None and np.shape(baseline) != low.shape:
        raise MethodError(f"baseline has shape {np.shape(baseline)}; give one value a factor ({low.size})")
    if goals is None:
        goals = search.Goals.of(["min"] * _values(objectives, (low + high)[None, :] / 2).shape[1])
    judge = search.barring(partial(_judged, objectives, goals, doubt), barred)
    searched, violations = _searched(judge, low, high, population, generations, seed, closest)
    points, costs = searched.archive
    ideal, nadir = costs.min(axis=0), costs.max(axis=0)
    history = search.growth([found.costs for found in searched.generations], ideal, nadir)
    baseline_values = None if baseline is None else _values(objectives, np.atleast_2d(baseline))[0]
    baseline_costs = None if baseline_values is None else goals.costs(baseline_values)
    best = int(search.knee_depth(costs).argmax())
    rows, picks, among = search.thinning(costs, goals, baseline_costs, keep, [best])
    return ParetoFront(
        points=points[rows],
        values=_values(objectives, points[rows]),
        costs=costs[rows],
        hypervolume=float(history[-1]),
        hypervolume_history=history,
        ideal=ideal,
        nadir=nadir,
        knee=int(np.searchsorted(rows, best)),
        pick=picks[pick],
        picks=picks,
        pick_reason=f"{search.NAMES[pick]} {among}",
        baseline_values=baseline_values,
        archive_size=len(costs),
        evaluations=searched.evaluations,
        feasible=searched.feasible,
        generations=generations,
        seed=seed,
        goals=goals,
        violations=None if violations is None else violations[: len(goals.limited)],
    )


def _searched(
    judge: search.Judge, low: Array, high: Array, population: int, generations: int, seed: int, closest: bool
) -> tuple[search.Search, Array | None]:
    """The search; where no point keeps all limits and the ``closest`` is asked for, that point with its excess (c,) over each."""
    try:
        return search.search(judge, low, high, population, generations, seed), None
    except search.InfeasibleError as error:
        if not closest:
            raise
        archive = search.Archive(error.point[None], judge(error.point[None]).costs)
        return search.Search([archive], population * generations, 0.0), error.violations


def _judged(
    objectives: search.Objectives, goals: search.Goals, doubt: search.Doubt | None, points: Array
) -> search.Judged:
    values = _values(objectives, points)
    below, above = (0.0, 0.0) if doubt is None else doubt(points)
    return search.Judged(goals.costs(values), goals.violations(values - below, values + above))


def _values(objectives: search.Objectives, points: Array) -> Array:
    """Responses (n, m) of points. Raises MethodError unless they are finite, one row a point, with two or more columns."""
    values = np.asarray(objectives(points), float)
    if values.ndim != 2 or len(values) != len(points) or values.shape[1] < 2:
        raise MethodError(
            f"objectives gave shape {values.shape} for {len(points)} points; give one row a point and at least two objectives"
        )
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0]
        raise MethodError(
            f"objective {column + 1} is {values[row, column]} at {points[row].tolist()}; narrow the bounds or fix the objective"
        )
    return values


NOISE_DRAWS = 200  # of the noise in a hypervolume, and in a pick


class Samples(NamedTuple):
    """Points (n, k) run, their responses (n, m) and standard errors (n, m); rows of NaN where a run failed."""

    points: Array
    values: Array
    errors: Array

    @property
    def failed(self) -> Mask:
        """Whether each point's run failed, (n,)."""
        return np.asarray(np.isnan(self.values).any(axis=1))

    def rows(self, which: Any) -> "Samples":
        """These samples alone."""
        return Samples(*(part[which] for part in self))


class SimulatedFront(Record, eq=False):
    """Front of a noisy simulator, in ascending order of the first cost at selection.

    ``points`` (f, k); ``values`` and ``standard_errors`` (f, m) of their fresh runs, with their ``costs`` and
    ``cost_errors`` (f, q). The fresh runs had no part in the selection. ``optimism`` (q,): mean excess of these costs over
    those of the search, in shares of their range. ``searched``: all runs of the search. ``pick``: a row. ``freedom`` (f, m): degrees of freedom of the standard errors, by default infinite.
    """

    points: Array
    values: Array
    standard_errors: Array
    costs: Array
    cost_errors: Array
    optimism: Array
    pick: int
    pick_reason: str
    baseline_values: Array | None
    seed: int
    goals: search.Goals
    searched: Samples
    freedom: Array | None = None

    def quantile(self, probability: float) -> Array:
        """Student's quantile (f, m) of a probability, at the degrees of freedom of the standard errors."""
        freedom = np.full_like(self.values, np.inf) if self.freedom is None else self.freedom
        return np.asarray(special.stdtrit(freedom, probability))

    @property
    def half_widths(self) -> Array:
        """95 % half-widths (f, m) of the values."""
        return self.standard_errors * self.quantile(0.975)


def pick_shares(
    pick: Callable[[Array, Array], int], costs: Array, errors: Array, freedom: Array, seed: int = 1
) -> Array:
    """Share (n,) of draws of the errors in which each of n simulated points is the pick.

    ``pick(costs, shift)``: row of the pick for drawn costs (n, q), with the baseline shifted by ``shift`` (q,). ``errors`` and
    ``freedom`` (n, q): standard errors of the costs and their degrees of freedom. The baseline has the median errors of the
    points, whose runs are as long. Draws lie about costs that scatter already, so the share of the pick is too large: on
    synthetic fronts it was 0.57, 0.52 and 0.42 at errors of 2, 5 and 10 % of the range, where the pick was the true one in
    0.47, 0.42 and 0.27.
    """
    random = np.random.default_rng(seed)
    typical = np.median(errors, axis=0)
    counts = np.zeros(len(costs))
    for _ in range(NOISE_DRAWS):
        noise = random.standard_t(freedom) * errors
        counts[pick(costs + noise, random.standard_normal(typical.size) * typical)] += 1.0
    return counts / NOISE_DRAWS


def noisy_hypervolume(
    costs: Array, errors: Array, ideal: Array, nadir: Array, draws: int, seed: int = 1
) -> tuple[float, float]:
    """Hypervolume of means (n, q) with standard errors (n, q), and its standard error.

    Noise raises a hypervolume, for favourable errors extend the front. Draws of the noise estimate this bias, which is
    subtracted (parametric bootstrap: Efron and Tibshirani, An Introduction to the Bootstrap, section 10.6).
    """
    random = np.random.default_rng(seed)
    believed = search.hypervolume(costs, ideal, nadir)
    noisy = [
        search.hypervolume(costs + errors * random.standard_normal(costs.shape), ideal, nadir) for _ in range(draws)
    ]
    return 2.0 * believed - float(np.mean(noisy)), float(np.std(noisy, ddof=1))
