"""Which of many inputs matter, by their main effects in a two-level design.

Source: Box, Hunter and Hunter, Statistics for Experimenters, second edition, sections 5 and 6.
"""

import numpy as np
from scipy.linalg import hadamard

from doe.arrays import Array

# Quantiles at which a screening sets an input low and high.
LOW, HIGH = 0.1, 0.9


def two_levels(inputs: int) -> Array:
    """Quantiles (n, inputs) of a folded-over two-level design: main effects free of each other and of all pairs.

    Hadamard's matrix and its mirror image (Plackett and Burman 1946; Box and Wilson 1951 for the fold).
    """
    size = 1 << int(inputs).bit_length()
    signs = hadamard(size)[:, 1 : inputs + 1]
    return np.where(np.vstack([signs, -signs]) > 0, HIGH, LOW)


def shares(quantiles: Array, values: Array) -> Array:
    """Share (d, m) that each input has in the variance of each output (n, m) which main effects make, by least squares on
    the quantiles (n, d)."""
    coded = quantiles - quantiles.mean(axis=0)
    effects = np.linalg.lstsq(coded, values - values.mean(axis=0), rcond=None)[0]
    made = (effects * coded.std(axis=0)[:, None]) ** 2
    whole = made.sum(axis=0)
    return np.divide(made, whole, out=np.zeros_like(made), where=whole > 0.0)


def kept(shares_: Array, always: list[int], most: int) -> list[int]:
    """Places of the inputs that stay, sorted: those ``always`` and the ones of the largest share in any output, ``most`` in
    all."""
    ranked = np.argsort(-shares_.max(axis=1), kind="stable").tolist()
    rest = [place for place in ranked if place not in always]
    return sorted([*always, *rest[: max(most - len(always), 0)]])
