"""NSGA-II on arrays has the generations of pymoo's own algorithm."""

import numpy as np
import pytest

from doe.pareto.evolution import evolve


def _of_pymoo(evaluate, low, high, size, generations, seed):
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    costs, excess = evaluate(low[None])

    class Cheap(Problem):
        def _evaluate(self, points, out):
            out["F"], out["G"] = evaluate(points)

    shape = {"n_var": low.size, "n_obj": costs.shape[1], "n_ieq_constr": excess.shape[1]}
    minimize(Cheap(**shape, xl=low, xu=high), NSGA2(pop_size=size), ("n_gen", generations), seed=seed)


@pytest.mark.parametrize(
    ("factors", "objectives", "limit", "digits", "size"),
    [(3, 2, None, 9, 40), (3, 4, 0.2, 9, 40), (2, 2, None, 1, 21), (4, 3, -9.0, 9, 20), (1, 2, 0.5, 1, 4)],
)
def test_oracle_generations_are_those_of_pymoo(factors, objectives, limit, digits, size):
    """Oracle: without and with limits, also with ties and where no point keeps any, every generation is equal to the bit."""
    random = np.random.default_rng(factors + objectives)
    bend, slope = random.normal(size=(objectives, factors, factors)), random.normal(size=(objectives, factors))
    found, expected = list[np.ndarray](), list[np.ndarray]()

    def judged(points, history):
        history.append(points.copy())
        costs = (np.einsum("nj,qjk,nk->nq", points, bend, points) + points @ slope.T).round(digits)
        excess = np.zeros((len(points), 0)) if limit is None else (points @ slope[:2].T - limit).clip(0.0)
        return costs, excess

    def summed(points):
        costs, excess = judged(points, found)
        return costs, excess.sum(axis=1)

    ends = np.full(factors, -1.3), np.full(factors, 1.7)
    evolve(summed, *ends, size, 30, seed=3)
    _of_pymoo(lambda points: judged(points, expected), *ends, size, 30, seed=3)
    assert len(found) == 30
    assert all(map(np.array_equal, found, expected[1:]))
