"""NSGA-II on arrays, with the operators of pymoo and their random numbers: the generations of its algorithm, to the bit.

The objects with which pymoo holds each point take some ten times the processor time of the operators.

Source: Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II (2002).
"""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from rbdyn.base.arrays import Array, Mask, Rows

# Of crossover and mutation: probability of a pair, a factor or a point, and index of the distribution.
CROSSOVER, CROSSED_FACTOR, CROSSOVER_INDEX = 0.9, 0.5, 15.0
MUTATION, MUTATION_INDEX = 0.9, 20.0
SAME = 1e-16  # distance of points that are the same
ATTEMPTS = 100  # most matings of a generation that finds too few new points

# Costs (n, q) and sums of the excesses over all limits (n,) of points (n, k).
Evaluation = Callable[[Array], tuple[Array, Array]]


class Population(NamedTuple):
    """Points (n, k) with their costs (n, q), excess over limits (n,) and, of survivors, crowding distance (n,)."""

    points: Array
    costs: Array
    excess: Array
    crowding: Array

    def rows(self, rows: Rows) -> "Population":
        """Those of the rows."""
        return Population(*(part[rows] for part in self))


def evolve(evaluate: Evaluation, low: Array, high: Array, size: int, generations: int, seed: int) -> None:
    """Evaluate the points of so many generations of ``size`` points in a box; fewer where mating finds no new point."""
    random = np.random.default_rng(seed)
    points = low + (high - low) * random.random((size, low.size))
    population = _survivors(_evaluated(evaluate, _unlike(points)), size, random)
    for _ in range(generations - 1):
        points = _offspring(population, low, high, size, random)
        if not len(points):
            break
        both = zip(population, _evaluated(evaluate, points), strict=True)
        population = _survivors(Population(*map(np.concatenate, both)), size, random)


def _evaluated(evaluate: Evaluation, points: Array) -> Population:
    return Population(points, *evaluate(points), np.full(len(points), np.nan))


def _unlike(points: Array, *others: Array) -> Array:
    """Points of which none is the same as an earlier one or one of ``others``."""
    distance = cdist(points, points)
    distance[np.triu_indices(len(points))] = np.inf
    points = points[(distance > SAME).all(axis=1)]
    for other in others:
        points = points[(cdist(points, other) > SAME).all(axis=1)]
    return points


def _offspring(population: Population, low: Array, high: Array, size: int, random: np.random.Generator) -> Array:
    """New points (n, k), at most ``size``."""
    points = population.points[:0]
    for _ in range(ATTEMPTS):
        if len(points) == size:
            break
        children = _mutated(_crossed(population, size - len(points), low, high, random), low, high, random)
        points = np.vstack([points, _unlike(children, population.points, points)[: size - len(points)]])
    return points


def _crossed(population: Population, count: int, low: Array, high: Array, random: np.random.Generator) -> Array:
    """At least ``count`` children of pairs that have won tournaments."""
    from pymoo.operators.crossover.sbx import cross_sbx

    pairs = math.ceil(count / 2)
    shuffles = math.ceil(4 * pairs / len(population.points))
    order = np.concatenate([random.permutation(len(population.points)) for _ in range(shuffles)])
    parents = _winners(population, order[: 4 * pairs].reshape(-1, 2), random).reshape(pairs, 2)
    points = np.swapaxes(population.points[parents], 0, 1)
    mated = random.random(pairs) < CROSSOVER
    if mated.any():
        # The random numbers of an exchange of the pair, which always takes place.
        random.random((pairs, 1))
        column = partial(np.full, (pairs, 1))
        crossed = cross_sbx(
            points, low, high, column(CROSSOVER_INDEX), CROSSED_FACTOR, column(0.5), random_state=random
        )
        points = np.where(mated[:, None], crossed, points)
    return points.reshape(-1, low.size)


def _winners(population: Population, pairs: Rows, random: np.random.Generator) -> Rows:
    """Rows of the better ones of pairs (n, 2): less excess, else dominance, else more room around it, else either."""
    first, second = pairs.T
    excess, costs = population.excess, population.costs
    kept = (excess[first] <= 0.0) & (excess[second] <= 0.0)
    less, more = (costs[first] < costs[second]).any(axis=1), (costs[first] > costs[second]).any(axis=1)
    better = np.sign(less.astype(int) - more)
    room = population.crowding
    better = np.where(better == 0, _sign(room[first], room[second]), better)
    better = np.where(kept, better, _sign(excess[second], excess[first]))
    drawn = np.flatnonzero(better == 0)
    better[drawn] = 1 - 2 * random.integers(0, 2, size=len(drawn))
    return np.where(better > 0, first, second)


def _sign(high: Array, low: Array) -> Array:
    """1 where ``high`` exceeds ``low``, -1 where it is less, else 0; both may be infinite."""
    return (high > low).astype(int) - (high < low)


def _mutated(points: Array, low: Array, high: Array, random: np.random.Generator) -> Array:
    from pymoo.operators.mutation.pm import mut_pm

    count = len(points)
    index, factor = np.full(count, MUTATION_INDEX), np.full(count, min(0.5, 1.0 / low.size))
    changed = mut_pm(points, low, high, index, factor, at_least_once=False, random_state=random)
    return np.where((random.random(count) <= MUTATION)[:, None], changed, points)


def _survivors(population: Population, size: int, random: np.random.Generator) -> Population:
    """At most ``size`` points: those that keep all limits by rank and crowding, then the others by their excess."""
    keep: Mask = population.excess <= 0.0
    size = min(size, len(keep))
    good, bad = np.flatnonzero(keep), np.flatnonzero(~keep)
    best = _ranked(population.rows(good), min(size, len(good)), random) if len(good) else population.rows(good)
    others = population.rows(bad[np.argsort(population.excess[bad])][: size - len(best.points)])
    return Population(*map(np.concatenate, zip(best, others, strict=True)))


def _ranked(population: Population, size: int, random: np.random.Generator) -> Population:
    """The ``size`` best by rank, of the last rank those with the most room, with their crowding distances."""
    from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
    from pymoo.util.randomized_argsort import randomized_argsort

    rows = np.empty(0, np.intp)
    for front in NonDominatedSorting().do(population.costs, n_stop_if_ranked=size):
        room = np.full(len(front), np.inf)
        if len(front) > 2:
            room = calc_crowding_distance(population.costs[front])
        population.crowding[front] = room
        left = size - len(rows)
        if len(front) > left:
            front = front[randomized_argsort(room, order="descending", random_state=random)[:left]]
        rows = np.concatenate([rows, front])
    return population.rows(rows)
