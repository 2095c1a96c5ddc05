"""Levenberg-Marquardt with Armijo's rule on all equations, as Hu et al. 2021 (section 3.2.2) use it.

    d = -(J'J + mu E)^-1 J'F,  mu = ||F||,  x <- x + b^m d,
    b^m the first for which f(x + b^m d) <= f(x) + w b^m (J'F)'d,  f = ||F||^2/2.

mu weighs N against (N/mm)^2: the paper reckons in mm, and the method depends on it. ``length_unit`` keeps that apart from
our metres. b, w and the limits are not in the paper: they are those of the routine in its reference 33 (Ma 2010), whose
steps it prints.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.compiled.kernel import routine
from rbdyn.quasistatic.rivals.full_system import forces, move
from rbdyn.quasistatic.row.newton import ACCEPTED, copy, eliminate

CONVERGED, STATIONARY, NO_DESCENT, NOT_FINITE, EXHAUSTED = range(5)
SENTENCES = {
    STATIONARY: "stood at a least sum of squares that is no equilibrium",
    NO_DESCENT: "found no step that lessens the residuals",
    NOT_FINITE: "met forces that are not finite",
    EXHAUSTED: "did not converge in its iterations",
}


class Damping(NamedTuple):
    """``backtrack``: b; ``decrease``: w; ``backtracks``: largest m; ``iterations`` from one start; ``length_unit`` [m].

    ``stationary``: ||J'F|| over ||J|| ||F|| below which F is at a minimum other than zero.
    """

    backtrack: float = 0.55
    decrease: float = 0.4
    backtracks: int = 20
    iterations: int = 100
    length_unit: float = 1e-3
    stationary: float = 1e-12


@routine
def levenberg_marquardt(control: Any, system: Any, damping: Any, limit: int, u: Any) -> tuple[int, int, float]:
    """Minimise ||F|| from ``u``, which is left at the best point, in at most ``limit`` iterations.

    Returns the outcome, the iterations and the largest residual [N].
    """
    size = u.size
    residual, jacobian = np.zeros(size), np.zeros((size, size))
    trial, ahead, ahead_jacobian = np.zeros(size), np.zeros(size), np.zeros((size, size))
    worst, largest = forces(control, system, u, residual, jacobian)
    for iteration in range(limit):
        if not math.isfinite(worst):
            return NOT_FINITE, iteration, worst
        if worst <= ACCEPTED * largest:
            return CONVERGED, iteration, worst
        length = math.sqrt(np.sum(residual * residual))
        gradient = np.dot(jacobian.T, residual)
        slope = math.sqrt(np.sum(gradient * gradient))
        if slope <= damping.stationary * math.sqrt(np.sum(jacobian * jacobian)) * length:
            return STATIONARY, iteration, worst
        normal = np.dot(jacobian.T, jacobian)
        for i in range(size):
            normal[i, i] += length / (damping.length_unit * damping.length_unit)
        step = -gradient
        if not eliminate(normal, step, size, 0.0):
            return NO_DESCENT, iteration, worst
        along = np.sum(gradient * step)
        scale, better = 1.0, False
        for _ in range(damping.backtracks):
            for i in range(size):
                trial[i] = u[i] + scale * step[i]
            ahead_worst, ahead_largest = forces(control, system, trial, ahead, ahead_jacobian)
            if 0.5 * np.sum(ahead * ahead) <= 0.5 * length * length + damping.decrease * scale * along:
                better = True
                break
            scale *= damping.backtrack
        if not better:
            return NO_DESCENT, iteration, worst
        move(trial, u)
        move(ahead, residual)
        copy(ahead_jacobian, jacobian)
        worst, largest = ahead_worst, ahead_largest
    return (CONVERGED if worst <= ACCEPTED * largest else EXHAUSTED), limit, worst
