"""Unknown inputs: their distributions and dependence, nested sets of them, and screening of those that matter.

Inputs of a posterior sample depend on each other, being drawn as its rows. The last
input of a set does nothing: it shows the effect of chance.

Screening is by main effects, in a two-level design of its own or in the very runs of an answer. Sources: Box, Hunter and Hunter,
Statistics for Experimenters, second edition, sections 5 and 6; Efroymson, Multiple regression analysis, in Mathematical Methods
for Digital Computers (1960) (forward selection).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import stats
from scipy.linalg import hadamard
from scipy.spatial import KDTree
from scipy.stats import qmc

from rbdyn.base.arrays import Array
from rbdyn.base.records import Record
from rbdyn.scene.uncertain import Law, Sampled

# Quantiles are kept this far from 0 and 1.
EDGE = 1e-12


def values_of(law: Law | Sampled, quantiles: Array) -> list[Any]:
    """Values (n,) of a law at quantiles (n,) between 0 and 1: numbers, or choices."""
    if isinstance(law, Sampled):
        count = len(law.values)
        return [law.values[min(int(quantile * count), count - 1)] for quantile in quantiles]
    if law.law == "choices":
        choices = law.values or []
        bounds = np.cumsum(_shares(law))[:-1]
        return [choices[int(place)] for place in np.searchsorted(bounds, quantiles, side="right")]
    values = _distribution(law).ppf(np.clip(quantiles, EDGE, 1.0 - EDGE))
    # Rounding may leave the range.
    low, high = -np.inf if law.low is None else law.low, np.inf if law.high is None else law.high
    return np.clip(values, low, high).tolist()


def quantiles_of(law: Law, values: Sequence[Any]) -> Array:
    """Quantiles (n,) of values (n,): of a choice, the middle of its share."""
    if law.law == "choices":
        ends = np.cumsum(_shares(law))
        middles = ends - 0.5 * _shares(law)
        return np.array([middles[(law.values or []).index(value)] for value in values])
    return np.asarray(_distribution(law).cdf(np.asarray(values, float)))


def _shares(law: Law) -> Array:
    weights = np.asarray(law.weights or [1.0] * len(law.values or ()))
    return weights / weights.sum()


def _distribution(law: Law) -> Any:
    low, high = law.low, law.high
    if law.law == "normal":
        mean, sd = float(law.mean or 0.0), float(law.sd or 1.0)
        ends = [(edge - mean) / sd for edge in (-np.inf if low is None else low, np.inf if high is None else high)]
        return stats.truncnorm(*ends, mean, sd)
    assert low is not None and high is not None
    if law.law == "log_uniform":
        return stats.loguniform(low, high)
    return stats.uniform(low, high - low)


def ranks(column: Sequence[Any] | Array) -> Array:
    """Quantiles (n,) of the values of a sample within it; equal values follow each other."""
    return (np.argsort(np.argsort(np.array(column), kind="stable")) + 0.5) / len(column)


def table_of(laws: Mapping[str, Law | Sampled], quantiles: Array) -> list[dict[str, Any]]:
    """Input sets by key, a dictionary a row of quantiles (n, d)."""
    columns = [values_of(law, quantiles[:, place]) for place, law in enumerate(laws.values())]
    return [dict(zip(laws, row, strict=True)) for row in zip(*columns, strict=True)]


# Nearest rows of a sample that may replace one.
NEAR = 8


def nested(inputs: int, points: int, seed: int) -> Array:
    """Quantiles (points, inputs) of scrambled Sobol' points; ``points`` is a power of two, and its half gives the first half."""
    return qmc.Sobol(inputs, rng=np.random.default_rng(seed)).random_base2(int(points).bit_length() - 1)


class Joint(Record, eq=False):
    """Dependence of the inputs, of which there are ``inputs``.

    rows, columns : (r, s), quantiles of a sample, and the places (s,) of its inputs
    """

    inputs: int
    rows: Array | None = None
    columns: tuple[int, ...] = ()

    @property
    def independent(self) -> bool:
        """Whether no input depends on another."""
        return self.rows is None

    def sets(self, points: int, seed: int) -> Array:
        """Quantiles (points, d + 1) of input sets; of a power of two the first half are those of half as many."""
        return self.placed(nested(self.inputs + 1, points, seed))

    def placed(self, even: Array) -> Array:
        """Quantiles (n, d + 1) of input sets, from evenly spread ones."""
        sets = even.copy()
        if self.rows is not None:
            sets[:, self.columns] = self.rows[(even[:, self.columns[0]] * len(self.rows)).astype(np.int64)]
        return sets

    def redrawn(self, sets: Array, shared: Array, fresh: Array) -> Array:
        """Input sets (n, d + 1) that share the inputs where ``shared`` (d + 1,) with ``sets``, the others being drawn anew.

        They come from ``fresh`` evenly spread quantiles (n, d + 1), those of a sample from a row near the shared ones.
        """
        new_sets = np.where(shared, sets, fresh)
        if self.rows is not None:
            columns = np.array(self.columns)
            common = shared[columns]
            if common.any():
                # The nearest is the row itself; one of the next few is drawn.
                tree, count = KDTree(self.rows[:, common]), min(NEAR + 1, len(self.rows))
                several = tree.query(sets[:, columns[common]], k=count)[1]
                choice = 1 + (fresh[:, columns[0]] * (several.shape[1] - 1)).astype(np.int64)
                near = several[np.arange(len(sets)), choice]
            else:
                near = (fresh[:, columns[0]] * len(self.rows)).astype(np.int64)
            new_sets[:, columns[~common]] = self.rows[near][:, ~common]
        return new_sets


def spread_out(candidates: Array, count: int) -> Array:
    """``count`` of the candidates (n, d), each the farthest from the first and from those before it."""
    distance = ((candidates - candidates[0]) ** 2).sum(axis=1)
    places: list[int] = []
    for _ in range(min(count, len(candidates))):
        places.append(int(np.argmax(distance)))
        distance = np.minimum(distance, ((candidates - candidates[places[-1]]) ** 2).sum(axis=1))
    return candidates[places]


# Quantiles at which a screening sets an input low and high.
LOW, HIGH = 0.1, 0.9
# Terms of a main effect in evenly spread runs, and the relative size of a column that counts as zero.
TERMS, NOTHING = 2, 1e-9


def screening_design(inputs: int) -> Array:
    """Quantiles (n, inputs) of a folded-over two-level design: main effects are free of each other and of all pairs.

    Hadamard's matrix and its mirror image (Plackett and Burman 1946; Box and Wilson 1951 for the fold).
    """
    signs = hadamard(1 << int(inputs).bit_length())[:, 1 : inputs + 1]
    return np.where(np.vstack([signs, -signs]) > 0, HIGH, LOW)


def effect_shares(quantiles: Array, values: Array) -> Array:
    """Share (d, m) of each input in the variance of each output (n, m) that is due to main effects.

    The effects are by least squares on the quantiles (n, d).
    """
    coded = quantiles - quantiles.mean(axis=0)
    effects = np.linalg.lstsq(coded, values - values.mean(axis=0), rcond=None)[0]
    variances = (effects * coded.std(axis=0)[:, None]) ** 2
    total = variances.sum(axis=0)
    return np.divide(variances, total, out=np.zeros_like(variances), where=total > 0.0)


def retained(shares_: Array, always: list[int], most: int) -> list[int]:
    """Sorted places of ``most`` inputs: those ``always``, then those with the largest share (d, m) in any output."""
    ranked = np.argsort(-shares_.max(axis=1), kind="stable").tolist()
    candidates = [place for place in ranked if place not in always]
    return sorted([*always, *candidates[: max(most - len(always), 0)]])


def main_effects(quantiles: Array, values: Array) -> Array:
    """Share (d, m) of the variance of each output (n, m) due to the main effect of each input, linear and quadratic.

    The share that chance would have in so few runs is subtracted; quantiles (n, d).
    """
    runs, outputs = len(quantiles), _unit(values)
    variances = np.array([((_base(column).T @ outputs) ** 2).sum(axis=0) for column in quantiles.T])
    chance = TERMS / max(runs - 1, TERMS + 1)
    return ((variances - chance) / (1.0 - chance)).clip(0.0)


def strongest(quantiles: Array, values: Array, most: int, always: Sequence[int] = ()) -> list[int]:
    """Sorted places of the ``most`` inputs that matter most in any output (n, m), from quantiles (n, d).

    After those ``always``, each is the one that explains most of the variance that those before it do not.
    """
    picked, residuals, basis = list[int](), _unit(values), np.ones((len(quantiles), 1)) / np.sqrt(len(quantiles))
    pool = [place for place in range(quantiles.shape[1]) if place not in always]
    count = min(max(most, len(always)), quantiles.shape[1])
    while len(picked) < count:
        candidates = list(always[len(picked) : len(picked) + 1]) or pool
        # A column that those before explain has no basis left.
        bases = [_base(quantiles[:, place], basis) for place in candidates]
        gains = [float(((base.T @ residuals) ** 2).sum(axis=0).max()) for base in bases]
        best = int(np.argmax(gains))
        picked.append(candidates[best])
        basis = np.column_stack([basis, bases[best]])
        residuals = residuals - bases[best] @ (bases[best].T @ residuals)
        pool = [place for place in pool if place != picked[-1]]
    return sorted(picked)


def _unit(values: Array) -> Array:
    """Outputs (n, m) less their means, each of length 1; zero for one that does not vary."""
    centred = values - values.mean(axis=0)
    length = np.sqrt((centred**2).sum(axis=0))
    return np.divide(centred, length, out=np.zeros_like(centred), where=length > 0.0)


def _base(quantile: Array, others: Array | None = None) -> Array:
    """Orthonormal columns (n, 0 to 2) of the linear and quadratic effect of an input.

    They are orthogonal to ``others`` (n, p), by default to the mean alone.
    """
    columns = np.column_stack([2.0 * quantile - 1.0, 6.0 * quantile * (quantile - 1.0) + 1.0])
    basis = np.ones((len(quantile), 1)) / np.sqrt(len(quantile)) if others is None else others
    for _ in range(2):  # a second time removes rounding
        columns = columns - basis @ (basis.T @ columns)
    root, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(root[:, sizes > NOTHING * np.sqrt(len(quantile))])
