"""Which of many inputs matter most: by their main effects in a two-level design of its own, or in the very runs of an answer.

Sources: Box, Hunter and Hunter, Statistics for Experimenters, second edition, sections 5 and 6; Efroymson, Multiple regression
analysis, in Mathematical Methods for Digital Computers (1960) (forward selection).
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import hadamard

from doe.arrays import Array

# Quantiles at which a screening sets an input low and high.
LOW, HIGH = 0.1, 0.9
# Terms of a main effect in runs that are spread evenly, and what of a column counts as nothing.
TERMS, NOTHING = 2, 1e-9


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


def main_effects(quantiles: Array, values: Array) -> Array:
    """Share (d, m) of the variance of each output (n, m) that the main effect of each input makes, straight and bent, less
    what chance makes of so few runs; quantiles (n, d)."""
    runs, outputs = len(quantiles), _unit(values)
    made = np.array([((_base(one).T @ outputs) ** 2).sum(axis=0) for one in quantiles.T])
    chance = TERMS / max(runs - 1, TERMS + 1)
    return ((made - chance) / (1.0 - chance)).clip(0.0)


def strongest(quantiles: Array, values: Array, most: int, always: Sequence[int] = ()) -> list[int]:
    """Places, sorted, of the inputs that matter most in any output (n, m): those ``always``, then each that explains most of
    what those before it leave, ``most`` in all; quantiles (n, d)."""
    picked, left, basis = list[int](), _unit(values), np.ones((len(quantiles), 1)) / np.sqrt(len(quantiles))
    rest = [place for place in range(quantiles.shape[1]) if place not in always]
    count = min(max(most, len(always)), quantiles.shape[1])
    while len(picked) < count:
        candidates = list(always[len(picked) : len(picked) + 1]) or rest
        # Of columns that those before explain nothing new is left.
        bases = [_base(quantiles[:, place], basis) for place in candidates]
        gains = [float(((base.T @ left) ** 2).sum(axis=0).max()) for base in bases]
        best = int(np.argmax(gains))
        picked.append(candidates[best])
        basis = np.column_stack([basis, bases[best]])
        left = left - bases[best] @ (bases[best].T @ left)
        rest = [place for place in rest if place != picked[-1]]
    return sorted(picked)


def _unit(values: Array) -> Array:
    """Outputs (n, m) about their means, each of length 1; nothing of one that does not vary."""
    centred = values - values.mean(axis=0)
    length = np.sqrt((centred**2).sum(axis=0))
    return np.divide(centred, length, out=np.zeros_like(centred), where=length > 0.0)


def _base(quantile: Array, others: Array | None = None) -> Array:
    """Orthonormal columns (n, 0 to 2) of an input's straight and bent effect, orthogonal to those of ``others`` (n, p), the
    mean alone unless given."""
    columns = np.column_stack([2.0 * quantile - 1.0, 6.0 * quantile * (quantile - 1.0) + 1.0])
    basis = np.ones((len(quantile), 1)) / np.sqrt(len(quantile)) if others is None else others
    for _ in range(2):  # once leaves rounding
        columns = columns - basis @ (basis.T @ columns)
    root, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(root[:, sizes > NOTHING * np.sqrt(len(quantile))])
