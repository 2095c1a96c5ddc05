"""Where a part falls within its tolerance: samples of offsets in half widths of the tolerance."""

import math
from typing import Literal

import numpy as np
from scipy.stats import norm, qmc

from doe.arrays import Array

Distribution = Literal["normal", "uniform"]

SIGMAS = 3.0  # standard deviations in a half width: the tolerance is six of them


def offsets(shares: Array, distribution: Distribution) -> Array:
    """Offsets in [-1, 1] of cumulative shares in (0, 1), any shape.

    "normal": mean at mid tolerance, tolerance of 6 standard deviations, parts outside it sorted out; "uniform".
    """
    if distribution == "uniform":
        return 2.0 * shares - 1.0
    outside = norm.cdf(-SIGMAS)
    return norm.ppf(outside + shares * (1.0 - 2.0 * outside)) / SIGMAS


def even_offsets(count: int, factors: int, distribution: Distribution) -> Array:
    """Offsets (count, factors) that fill the tolerance box evenly (Sobol points, always the same)."""
    points = qmc.Sobol(factors, scramble=False).random(count)
    # Half a cell in, lest a point lie on the rim.
    return offsets((points + 0.5 / count) % 1.0, distribution)


def random_offsets(count: int, factors: int, distribution: Distribution, seed: int) -> Array:
    """Independent offsets (count, factors) of parts."""
    return offsets(np.random.default_rng(seed).uniform(size=(count, factors)), distribution)


def error_of_share(share: float, count: int) -> float:
    """Monte Carlo standard error of the share of ``count`` parts that keep something; never nil."""
    return math.sqrt(max(share * (1.0 - share), 1.0 / count) / count)
