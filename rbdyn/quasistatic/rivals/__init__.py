"""Rivals of the convex solver, for comparison.

``full_system`` (all equations, dense), ``plain_newton``, ``levenberg_marquardt`` and ``finite_search`` (Hu et al. 2021),
``limited`` (ours, stopped early).
"""
