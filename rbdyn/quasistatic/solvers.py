"""The solvers that a scene may choose, behind one door: ``solver(row, control, load, given, start) -> Solution``."""

from __future__ import annotations

from collections.abc import Callable

from rbdyn.quasistatic.rivals import finite_search, plain_newton
from rbdyn.quasistatic.row import equilibrium
from rbdyn.quasistatic.row.equilibrium import Solution

SOLVERS: dict[str, Callable[..., Solution]] = {
    "convex": equilibrium.solve,
    "finite_search": finite_search.solve,
    "newton": plain_newton.solve,
}
