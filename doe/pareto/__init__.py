"""Pareto fronts: search, picks, errors.

- ``goals``, ``archive``, ``picks``: costs of responses, what dominates what, how good a front is, which one
- ``nsga2``, ``front``: search among cheap responses, and the front found
- ``uncertainty``: what the surfaces' errors make of a front and of a gain
- ``quadratic``, ``tolerance_aware``: the front of what manufacture leaves of a point
- ``tolerance``: backwards from a pick to the widest tolerances that keep its gains
- ``simulated``, ``simulated_tolerance``: a front run on the simulator, and what manufacture leaves of its points
"""

from doe.pareto.archive import hypervolume, non_dominated
from doe.pareto.front import ParetoFront, front
from doe.pareto.goals import Goals
from doe.pareto.nsga2 import InfeasibleError
from doe.pareto.picks import knee_depth
