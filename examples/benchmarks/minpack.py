"""MINPACK's solvers on all equations, by scipy, with our Jacobian: Powell's hybrid and More's Levenberg-Marquardt.

They begin where plain Newton begins and are judged by the same residual. Their time includes the way from Python to the
compiled forces and back.
"""

import functools
import math

import numpy as np
from plain_newton import unloaded

from rbdyn.base.arrays import Array
from rbdyn.quasistatic.full_system import Stop, System, evaluate, rival
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import OK
from rbdyn.quasistatic.row.newton import ACCEPTED

EVALUATIONS = 1000
# As tight as MINPACK takes without a warning; the residual decides.
TIGHTEST = {"hybr": {"xtol": 1e-15}, "lm": {"xtol": 1e-15, "ftol": 1e-15, "gtol": 0.0}}
LIMIT = {"hybr": "maxfev", "lm": "maxiter"}


@rival
def solve(control: Control, system: System, start: None, limit: int = EVALUATIONS, method: str = "hybr") -> Stop:
    """MINPACK's hybrj or lmder ("lm") in at most ``limit`` evaluations; a ``start`` is not used."""
    from scipy.optimize import root

    residual, jacobian = np.zeros(system.size), np.zeros((system.size, system.size))
    calls = 0

    def function(u: Array) -> Array:
        nonlocal calls
        calls += 1
        evaluate(control, system, u, residual, jacobian)
        return residual.copy()

    def derivative(u: Array) -> Array:
        evaluate(control, system, u, residual, jacobian)
        return jacobian.copy()

    first, options = unloaded(system), {**TIGHTEST[method], LIMIT[method]: limit}
    try:
        with np.errstate(all="ignore"):
            u = np.asarray(root(function, first, jac=derivative, method=method, options=options).x)
        why = f"MINPACK {method} stopped short of an equilibrium"
    except np.linalg.LinAlgError:
        # scipy inverts lmder's last matrix for a covariance that nobody asked for.
        u, why = first, f"MINPACK {method} ended at a singular matrix"
    worst, largest = evaluate(control, system, u, residual, jacobian)
    if not math.isfinite(worst):
        u = first
        worst, largest = evaluate(control, system, u, residual, jacobian)
    status = OK if worst <= ACCEPTED * largest else why
    return Stop(u, status, calls, worst)


SOLVERS = {
    "MINPACK hybrid": functools.partial(solve, method="hybr"),
    "MINPACK LM": functools.partial(solve, method="lm"),
}
