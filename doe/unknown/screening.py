"""Which of many inputs matter, by their main effects in a two-level design.

Source: Box, Hunter and Hunter, Statistics for Experimenters, second edition, sections 5 and 6.
"""

import numpy as np

from doe.arrays import Array


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
