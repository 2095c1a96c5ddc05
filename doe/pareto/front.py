"""The front of cheap responses, its picks, its hypervolume, and what the errors of fitted surfaces make of them.

Responses stay in their own units; the search minimises the costs that their goals make of them.

Coefficients of a least-squares surface follow a multivariate t distribution about their estimates. One draw of them
is one surface that the runs might as well have come from; all points on it share its error, and so does a difference
of two points.

Source: Box and Tiao, Bayesian Inference in Statistical Analysis, section 2.7.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from doe.pareto.goals import NAMES, Goals, Rule, knee_depth, pick_all, thinned
from doe.pareto.manufacture import ToleranceAware
from doe.pareto.search import Doubt, Judged, Objectives, check_search, dominates, hypervolume, search
from rbdyn.base.arrays import Array, Mask
from rbdyn.base.faults import MethodError

SELECTIONS = 300  # draws on which the rule picks anew; its own error then hides in that of the gain


@dataclass(frozen=True, eq=False)
class FrontUncertainty:
    """How sure a front is.

    ``non_dominated`` (f,): probability that a front point is dominated by none of the others. ``pick_dominates``: probability that the
    pick dominates the baseline. Probabilities carry their Monte Carlo standard errors. ``optimism`` (q,): by how much
    the rule promises too large a gain of each cost, because it picks what the errors flatter.
    """

    non_dominated: Array
    pick_dominates: float
    pick_dominates_error: float
    optimism: Array
    draws: int


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
    """Share of the draws (d, ...) that hit and its Monte Carlo standard error.

    The error is that of the share with one hit and one miss more, lest a few hundred hits of as many pass for sure.
    """
    count = len(hits)
    mean = hits.mean(axis=0)
    careful = (hits.sum(axis=0) + 1.0) / (count + 2.0)
    return mean, np.sqrt(careful * (1.0 - careful) / count)


def non_dominated_share(costs: Array) -> Array:
    """Probability (f,) that a point is dominated by no other, from drawn costs (d, f, q)."""
    from pymoo.util.nds.non_dominated_sorting import find_non_dominated

    undominated = np.zeros(costs.shape[:2], dtype=bool)
    for row, drawn in zip(undominated, costs, strict=True):
        row[find_non_dominated(drawn)] = True
    return undominated.mean(axis=0)


def front_uncertainty(
    drawn: Array, goals: Goals, values: Array, pick: int, rule: Rule, baseline: Array, original: Array
) -> FrontUncertainty:
    """How sure a front is, from drawn responses.

    drawn : responses (d, f, m) of the front's points on each drawn set of surfaces.
    goals : what is wanted of the responses.
    values : responses (f, m) on the fitted surfaces.
    pick, rule : row of the pick and the rule that made it.
    baseline, original : responses (d, m) of the baseline on the drawn surfaces and (m,) on the fitted ones.
    """
    costs, base = goals.costs(drawn), goals.costs(baseline)
    wins, error = share(dominates(costs[:, pick], base))
    real = goals.costs(original) - goals.costs(values)
    optimism = selection_optimism(costs[:SELECTIONS], base[:SELECTIONS], real, goals, rule)
    sure = float(wins), float(error)
    return FrontUncertainty(non_dominated_share(costs), *sure, optimism, len(drawn))


def selection_optimism(costs: Array, baseline: Array, real: Array, goals: Goals, rule: Rule) -> Array:
    """Mean excess (q,) of the gain that a rule promises at its pick over the gain that is there.

    With the fitted surfaces in the place of the truth and drawn ones in that of the fit (parametric bootstrap):
    ``costs`` (d, f, q) and ``baseline`` (d, q) are drawn, ``real`` (f, q) are the gains on the fitted surfaces.
    """
    excess = []
    for drawn, base in zip(costs, baseline, strict=True):
        row = pick_all(drawn, goals, base)[0][rule]
        excess.append(base - drawn[row] - real[row])
    return np.mean(excess, axis=0)


def contrast_error(jacobian: Array, covariance: Array) -> float:
    """Standard error of a difference of predictions: ``jacobian`` (p,) is the difference of their derivatives
    by the coefficients, ``covariance`` (p, p) that of the coefficients. The error that both share cancels.
    """
    return math.sqrt(max(float(jacobian @ covariance @ jacobian), 0.0))


@dataclass(frozen=True, eq=False)
class ParetoFront:
    """Non-dominated points of every point evaluated, in ascending order of the first cost.

    ``points`` (f, k) in the factors' units; ``values`` (f, m) in the responses' units, watched ones too, and
    ``costs`` (f, q) what their goals make of them. ``ideal`` and ``nadir`` (q,) are the best and worst of each cost on
    the front; ``knee``, ``pick`` and ``picks`` (the pick of every rule) are row numbers. ``archive_size`` counts the
    front before thinning and ``hypervolume`` is of that front; ``hypervolume_history`` (generations,) is on the same
    scale. ``baseline_values`` (m,) are None without a baseline. ``feasible`` is the share
    of the evaluated points that keep all limits. ``uncertainty`` and ``tolerance_aware``
    are None where they were not asked for.
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
    picks: dict[Rule, int]
    pick_reason: str
    baseline_values: Array | None
    archive_size: int
    evaluations: int
    feasible: float
    generations: int
    seed: int
    goals: Goals
    uncertainty: FrontUncertainty | None = None
    tolerance_aware: ToleranceAware | None = None


def front(
    objectives: Objectives,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    goals: Goals | None = None,
    population: int = 100,
    generations: int = 200,
    seed: int = 1,
    baseline: ArrayLike | None = None,
    keep: int = 200,
    pick: Rule = "knee",
    doubt: Doubt | None = None,
) -> ParetoFront:
    """Find the Pareto front of responses over a box; the same seed gives the same bits.

    objectives : maps points (n, k) to responses (n, m), at least two of them with a goal.
    lower, upper : bounds of the factors, shape (k,).
    goals : what is wanted of the responses; all to be minimised without it.
    population, generations, seed : of NSGA-II.
    baseline : a point (k,) to improve on. Picks are then among those front points that dominate it.
    keep : about how many points to return. A larger front is thinned to evenly spread points, among them
        the best and worst of each cost, the knee and the picks.
    pick : rule that makes the pick.
    doubt : maps points (n, k) to how far below and above (n, m) their responses may be; limits hold all over it.

    Raises MethodError when the bounds are not a box, a setting is out of range, or an objective is not finite;
    InfeasibleError when no point evaluated keeps all limits.
    """
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    check_search(low, high, population, generations, keep)
    if baseline is not None and np.shape(baseline) != low.shape:
        raise MethodError(f"baseline has shape {np.shape(baseline)}; give one value a factor ({low.size})")
    if goals is None:
        goals = Goals.of(["min"] * _values(objectives, (low + high)[None, :] / 2).shape[1])
    searched = search(partial(_judged, objectives, goals, doubt), low, high, population, generations, seed)
    points, costs = searched.archives[-1]
    ideal, nadir = costs.min(axis=0), costs.max(axis=0)
    baseline_values = None if baseline is None else _values(objectives, np.atleast_2d(baseline))[0]
    baseline_costs = None if baseline_values is None else goals.costs(baseline_values)
    best = int(knee_depth(costs).argmax())
    rows, picks, among = thinned(costs, goals, baseline_costs, keep, [best])
    return ParetoFront(
        points=points[rows],
        values=_values(objectives, points[rows]),
        costs=costs[rows],
        hypervolume=hypervolume(costs, ideal, nadir),
        hypervolume_history=np.array([hypervolume(each.costs, ideal, nadir) for each in searched.archives]),
        ideal=ideal,
        nadir=nadir,
        knee=int(np.searchsorted(rows, best)),
        pick=picks[pick],
        picks=picks,
        pick_reason=f"{NAMES[pick]} {among}",
        baseline_values=baseline_values,
        archive_size=len(costs),
        evaluations=searched.evaluations,
        feasible=searched.feasible,
        generations=generations,
        seed=seed,
        goals=goals,
    )


def _judged(objectives: Objectives, goals: Goals, doubt: Doubt | None, points: Array) -> Judged:
    values = _values(objectives, points)
    below, above = (0.0, 0.0) if doubt is None else doubt(points)
    return Judged(goals.costs(values), goals.violations(values - below, values + above))


def _values(objectives: Objectives, points: Array) -> Array:
    """Responses (n, m) of points. Raises MethodError unless they are finite, a row a point, two or more in a row."""
    values = np.asarray(objectives(points), float)
    if values.ndim != 2 or len(values) != len(points) or values.shape[1] < 2:
        given = f"objectives gave shape {values.shape} for {len(points)} points"
        raise MethodError(f"{given}; give one row a point and at least two objectives")
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0]
        given = f"objective {column + 1} is {values[row, column]} at {points[row].tolist()}"
        raise MethodError(f"{given}; narrow the bounds or fix the objective")
    return values
