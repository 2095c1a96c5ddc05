"""Noisy problems with known fronts for searches in few runs, and a search on them.

Sources: Zitzler, Deb and Thiele, Comparison of multiobjective evolutionary algorithms (2000), ZDT1; Deb, Thiele, Laumanns and
Zitzler, Scalable test problems for evolutionary multiobjective optimization (2005), DTLZ2.
"""

from functools import cache
from pathlib import Path

import numpy as np
from direct_search import direct_front
from scipy import ndimage
from scipy.stats import qmc

from doe.adaptive import AdaptiveSearch, Plan, Runs
from doe.adaptive.emulators import Region
from doe.pareto.search import Goals, best_for_hypervolume, hypervolume, non_dominated, spread

THREE = Goals.of(["min"] * 3)
FACTORS, NOISE = 4, 0.02  # of the ranges of the fronts, which are 0 to 1


def zdt1(points):
    """Two costs of coded points; the front is 1 - sqrt(x), where all factors but the first are lowest."""
    x = (points + 1.0) / 2.0
    rest = 1.0 + 9.0 * x[:, 1:].mean(axis=1)
    return np.column_stack([x[:, 0], rest * (1.0 - np.sqrt(x[:, 0] / rest))])


def dtlz2(points):
    """Three costs of coded points; the front is an eighth of the unit sphere, where the last two factors are 0.5."""
    x = (points + 1.0) / 2.0
    radius = 1.0 + ((x[:, 2:] - 0.5) ** 2).sum(axis=1)
    a, b = 0.5 * np.pi * x[:, 0], 0.5 * np.pi * x[:, 1]
    return radius[:, None] * np.column_stack([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)])


def true_front(problem, count):
    """So many points spread over the front."""
    if problem is zdt1:
        x = np.linspace(0.0, 1.0, 2001)
        front = np.column_stack([x, 1.0 - np.sqrt(x)])
    else:
        even = qmc.Sobol(2, seed=1).random_base2(12) * 2.0 - 1.0
        front = np.vstack([dtlz2(np.column_stack([even, np.zeros_like(even)])), np.eye(3)])
    return front[spread(front, count)]


def noisy(function, seed, noise=NOISE):
    """Runs of a function with normal noise, every row a run of its own, and their true standard error."""
    random = np.random.default_rng(seed)

    def evaluate(points, replicates):
        values = function(points)
        values = values + noise * random.standard_normal(values.shape)
        return values, np.full(values.shape, noise), np.full(values.shape, 50)

    return evaluate


def box(factors):
    """The region from -1 to 1 without a drawing."""
    return Region(
        -np.ones(factors), np.ones(factors), np.zeros(factors), np.full(factors, np.nan), np.full(factors, 0.01)
    )


def first_runs(evaluate, factors, count, seed):
    """Runs at the first points of a Sobol sequence."""
    points, ones = qmc.Sobol(factors, seed=seed).random_base2(7)[:count] * 2.0 - 1.0, np.ones(count, dtype=np.int64)
    return Runs(points, *evaluate(points, ones), ones)


def search(function, seed, budget=80, first=16, goals=None, factors=FACTORS, noise=NOISE, **plan):
    """An adaptive search from so many ``first`` runs."""
    evaluate = noisy(function, seed, noise)
    design, zero, one = first_runs(evaluate, factors, first, seed), np.zeros(factors), np.ones(factors)
    goals = goals or Goals.of(["min"] * design.values.shape[1])
    settings = Plan(budget, **{"seed": seed, "least": 1, "most": 1, "usual": 1, **plan})
    return AdaptiveSearch(evaluate, zero, one, box(factors), design, goals, settings, zero).front()


def share(problem, points):
    """Hypervolume of the true costs of points over that of as many points of the true front."""
    front = true_front(problem, len(points))
    ends = np.zeros(front.shape[1]), np.ones(front.shape[1])
    return hypervolume(problem(points), *ends) / hypervolume(front, *ends)


@cache
def _filtered():
    """Splines through 11 levels from -1 to 1 of each of three clearances: 1962 runs of the example bearing, smoothed."""
    table = np.loadtxt(Path(__file__).parent / "bearing_table.csv", delimiter=",", skiprows=1)
    return [ndimage.spline_filter(column.reshape(11, 11, 11), mode="mirror") for column in (table * [1.0, 1e-3, 1.0]).T]


def bearing(points):
    """Impact, whirl and power loss of the example bearing between clearances (n, 3) of -1 to 1."""
    at = 5.0 * (points.clip(-1.0, 1.0).T + 1.0)
    return np.column_stack([ndimage.map_coordinates(each, at, mode="mirror", prefilter=False) for each in _filtered()])


# Of a replicate, as shares of the responses: as the simulation scatters about the baseline.
SCATTER = np.array([0.012, 0.03, 0.0003])


def bearing_runs(seed):
    """Runs of it with normal scatter, and standard errors by the replicates."""
    random = np.random.default_rng(seed)

    def evaluate(points, replicates):
        true = bearing(points)
        deviation = SCATTER * true / np.sqrt(replicates)[:, None]
        freedom = np.maximum(2 * replicates - 1, 1)[:, None] * np.ones(true.shape, dtype=np.int64)
        estimate = deviation * np.sqrt(random.chisquare(freedom) / freedom)
        return true + deviation * random.standard_normal(true.shape), estimate, freedom

    return evaluate


@cache
def bearing_front():
    """Costs of the front of it, dense."""
    random = np.random.default_rng(1)
    points = qmc.Sobol(3, seed=1).random_base2(13) * 2.0 - 1.0
    for reach in (0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.01, 0.005):
        costs = bearing(points)
        rows = non_dominated(costs)
        rows = rows[spread(costs[rows], 1000)]
        children = points[random.choice(rows, 3000)] + reach * random.standard_normal((3000, 3))
        points = np.vstack([points[rows], children.clip(-1.0, 1.0)])
    costs = bearing(points)
    return costs[non_dominated(costs)]


def share_of_best(costs, front, ends):
    """Hypervolume of costs over that of the best as many of a front."""
    best = front[best_for_hypervolume(front, len(costs))]
    return hypervolume(costs, *ends) / hypervolume(best, *ends)


def bearing_share(points):
    """Hypervolume of the true costs of points over that of the best as many of the front."""
    front = bearing_front()
    return share_of_best(bearing(points), front, (front.min(axis=0), front.max(axis=0)))


@cache
def bearing_direct(seed):
    """True costs of the front that 2000 runs of three replicates find by the direct search."""
    evaluate = bearing_runs(1000 + seed)
    found = direct_front(
        lambda points: evaluate(points, np.full(len(points), 3))[:2], -np.ones(3), np.ones(3), goals=THREE, seed=seed
    )
    return bearing(found.points)
