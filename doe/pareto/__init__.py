"""Pareto fronts: search, picks, errors."""

from doe.pareto.nsga2 import ParetoFront, front, hypervolume, knee_depth, non_dominated

__all__ = ["ParetoFront", "front", "hypervolume", "knee_depth", "non_dominated"]
