"""How well a surface fits, in single figures: R2 and its kin."""

import math
from typing import Any

import numpy as np

from doe.arrays import Array, Whole
from doe.response_surface.anova import complement, ratio, sum_within
from doe.response_surface.diagnostics import press
from doe.response_surface.least_squares import LeastSquares


def observation_variance(solution: LeastSquares) -> float:
    """Variance of a new run about the surface; of the mean run, where they differ."""
    return solution.mean_square * float((1.0 / solution.weights).mean())


def goodness(solution: LeastSquares, response: Array, predicted: Array, block: Whole) -> dict[str, Any]:
    """R2 and its kin on the scatter within blocks; the others by the definitions of Myers et al."""
    within = sum_within(response, solution.weights, block)
    free = len(response) - len(np.unique(block))
    missed, variance = press(solution), observation_variance(solution)
    size = len(solution.coefficients)
    mean = float(solution.weights @ response / solution.weights.sum())
    return {
        "r2": complement(solution.residual_sum, within),
        "adjusted_r2": complement(solution.mean_square, within / free),
        "predicted_r2": None if missed is None else complement(missed, within),
        "press": missed,
        "cv_percent": ratio(100 * math.sqrt(variance), abs(mean)),
        "adequate_precision": ratio(float(np.ptp(predicted)), math.sqrt(size * variance / len(response))),
    }
