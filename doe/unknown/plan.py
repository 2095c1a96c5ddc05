"""Input sets: scrambled Sobol' points, of which every power of two holds all the smaller ones."""

import numpy as np
from scipy.linalg import hadamard
from scipy.stats import qmc

from doe.arrays import Array

# Quantiles at which a screening sets an input low and high.
LOW, HIGH = 0.1, 0.9


def nested(inputs: int, points: int, seed: int) -> Array:
    """Quantiles (points, inputs), evenly spread; ``points`` is a power of two, and half as many are the first half."""
    found: Array = qmc.Sobol(inputs, rng=np.random.default_rng(seed)).random_base2(int(points).bit_length() - 1)
    return found


def two_levels(inputs: int) -> Array:
    """Quantiles (n, inputs) of a folded-over two-level design: main effects free of each other and of all pairs.

    Hadamard's matrix and its mirror image (Plackett and Burman 1946; Box and Wilson 1951 for the fold).
    """
    size = 1 << int(inputs).bit_length()
    signs = hadamard(size)[:, 1 : inputs + 1]
    return np.where(np.vstack([signs, -signs]) > 0, HIGH, LOW)
