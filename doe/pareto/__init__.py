"""Pareto fronts: search, picks, errors.

- ``search``: costs of responses, rules that pick a point of a front, dominance, hypervolume, archive, and NSGA-II on cheap responses
- ``front``: fronts of fitted surfaces with the effect of their errors, and fronts of simulated points
- ``manufacture``: responses of parts within tolerances, robust costs, and their front
- ``tolerance``: the widest tolerances that keep the gains of a pick, and the tolerances of a simulated front
"""

from doe.pareto.front import ParetoFront, front
from doe.pareto.search import Goals, InfeasibleError, hypervolume, knee_depth, non_dominated
