"""Pareto fronts: search, picks, errors.

- ``search``: dominance, hypervolume, archive, and NSGA-II on cheap responses
- ``goals``: costs of responses, and the rules that pick a point of a front
- ``front``: fronts of fitted surfaces with the effect of their errors, and fronts of simulated points
- ``manufacture``: responses of parts within tolerances, robust costs, and their front
- ``tolerance``: the widest tolerances that keep the gains of a pick, and the tolerances of a simulated front
"""

from doe.pareto.front import ParetoFront, front
from doe.pareto.goals import Goals, knee_depth
from doe.pareto.search import InfeasibleError, hypervolume, non_dominated
