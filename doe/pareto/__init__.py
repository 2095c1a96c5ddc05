"""Pareto fronts: search, picks, errors.

- ``goals``: costs of responses, and which point of a front to pick
- ``search``: what dominates what, how good a front is, and the search among cheap responses; ``front``: the front found, and what
  the surfaces' errors make of it and of a gain
- ``manufacture``: what tolerances leave of a point, and the front of that
- ``tolerance``: backwards from a pick to the widest tolerances that keep its gains
- ``simulated``, ``simulated_tolerance``: a front run on the simulator, and what manufacture leaves of its points
"""

from doe.pareto.front import ParetoFront, front
from doe.pareto.goals import Goals, knee_depth
from doe.pareto.search import InfeasibleError, hypervolume, non_dominated
