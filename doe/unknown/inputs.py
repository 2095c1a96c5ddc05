"""Unknown inputs: their distributions, how they depend on each other, nested and shared sets of them, and which of many matter.

Declared inputs depend on each other through a Gaussian copula, those of a posterior sample by coming in its rows. The last
input of a set does nothing: it shows what chance does.

Screening is by main effects, in a two-level design of its own or in the very runs of an answer. Sources: Box, Hunter and Hunter,
Statistics for Experimenters, second edition, sections 5 and 6; Efroymson, Multiple regression analysis, in Mathematical Methods for
Digital Computers (1960) (forward selection).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special, stats
from scipy.linalg import hadamard
from scipy.spatial import KDTree
from scipy.stats import qmc

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError
from rbdyn.scene.uncertain import Correlation, Law, Sampled

# Numbers nearer to 0 and 1 than this are as good as at the ends.
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
    if law.law == "triangular":
        return stats.triang((float(law.mode or 0.0) - low) / (high - low), low, high - low)
    return stats.uniform(low, high - low)


def copula(names: Sequence[str], pairs: Sequence[Correlation], source: str = "scene") -> Array | None:
    """Cholesky factor (d, d) of the normal correlations whose rank correlations are given; None where there are none.

    A rank correlation rho is one of 2 sin(pi rho/6) of the normal scores (Pearson 1907). Raises InputError, which names the
    ``source``, where the correlations contradict each other.
    """
    if not pairs:
        return None
    matrix, places = np.eye(len(names)), {name: place for place, name in enumerate(names)}
    for pair in pairs:
        i, j = (places[key] for key in pair.keys)
        matrix[i, j] = matrix[j, i] = 2.0 * np.sin(np.pi * pair.rank / 6.0)
    try:
        return np.asarray(np.linalg.cholesky(matrix), float)
    except np.linalg.LinAlgError:
        ranks_of = ", ".join(f"{' and '.join(pair.keys)} {pair.rank:g}" for pair in pairs)
        why = "contradict each other; no inputs can go together so, bring them nearer to 0"
        raise InputError([f"{source}: uncertain.correlation: {ranks_of}: {why}"]) from None


def dependent(quantiles: Array, factor: Array | None) -> Array:
    """Quantiles (n, d) that go together as the copula says, of independent ones."""
    return quantiles if factor is None else special.ndtr(special.ndtri(quantiles.clip(EDGE, 1.0 - EDGE)) @ factor.T)


def ranks(column: Sequence[Any] | Array) -> Array:
    """Quantiles (n,) of the values of a sample within it; equal values follow each other."""
    return (np.argsort(np.argsort(np.array(column), kind="stable")) + 0.5) / len(column)


def table_of(laws: Mapping[str, Law | Sampled], quantiles: Array) -> list[dict[str, Any]]:
    """Input sets by key, a dictionary a row of quantiles (n, d)."""
    columns = [values_of(law, quantiles[:, place]) for place, law in enumerate(laws.values())]
    return [dict(zip(laws, row, strict=True)) for row in zip(*columns, strict=True)]


# Rows next to one of a sample that are as good as on it.
NEAR = 8


def nested(inputs: int, points: int, seed: int) -> Array:
    """Quantiles (points, inputs) of scrambled Sobol' points; ``points`` is a power of two, and half as many are the first half."""
    return qmc.Sobol(inputs, rng=np.random.default_rng(seed)).random_base2(int(points).bit_length() - 1)


@dataclass(frozen=True, eq=False)
class Joint:
    """How ``inputs`` many inputs depend on each other.

    ``factor`` (d, d): Cholesky factor of the correlations of their normal scores, None without any; ``rows`` (r, s):
    quantiles of a sample, whose columns are the inputs at ``columns`` (s,).
    """

    inputs: int
    factor: Array | None = None
    rows: Array | None = None
    columns: tuple[int, ...] = ()

    @property
    def independent(self) -> bool:
        """Whether no input shows anything of another."""
        return self.factor is None and self.rows is None

    def sets(self, points: int, seed: int) -> Array:
        """Quantiles (points, d + 1) of input sets; of a power of two the first half are those of half as many."""
        return self.placed(nested(self.inputs + 1, points, seed))

    def placed(self, even: Array) -> Array:
        """Quantiles (n, d + 1) of input sets, of evenly spread ones."""
        found = np.column_stack([dependent(even[:, :-1], self.factor), even[:, -1]])
        if self.rows is not None:
            found[:, self.columns] = self.rows[(even[:, self.columns[0]] * len(self.rows)).astype(np.int64)]
        return found

    def redrawn(self, sets: Array, shared: Array, fresh: Array) -> Array:
        """Other input sets (n, d + 1) that have the inputs where ``shared`` (d + 1,) in common with ``sets``, and of the rest
        what is likely next to these, by ``fresh`` evenly spread ones: drawn from the copula, or of a near row of the
        sample."""
        keep, redraw = (np.flatnonzero(shared[:-1] == which) for which in (True, False))
        found = np.where(shared, sets, fresh)
        if self.factor is not None:
            scores, even = (special.ndtri(each[:, :-1].clip(EDGE, 1.0 - EDGE)) for each in (sets, fresh))
            whole = self.factor @ self.factor.T
            slopes = np.linalg.solve(whole[np.ix_(keep, keep)], whole[np.ix_(keep, redraw)])
            root = np.linalg.cholesky(whole[np.ix_(redraw, redraw)] - whole[np.ix_(redraw, keep)] @ slopes)
            found[:, redraw] = special.ndtr(scores[:, keep] @ slopes + even[:, redraw] @ root.T)
        if self.rows is not None:
            columns = np.array(self.columns)
            known = shared[columns]
            if known.any():
                # The nearest is the row itself; one of the next few is drawn.
                several = KDTree(self.rows[:, known]).query(sets[:, columns[known]], k=min(NEAR + 1, len(self.rows)))[1]
                drawn = 1 + (fresh[:, columns[0]] * (several.shape[1] - 1)).astype(np.int64)
                near = several[np.arange(len(sets)), drawn]
            else:
                near = (fresh[:, columns[0]] * len(self.rows)).astype(np.int64)
            found[:, columns[~known]] = self.rows[near][:, ~known]
        return found


# Quantiles at which a screening sets an input low and high.
LOW, HIGH = 0.1, 0.9
# Terms of a main effect in runs that are spread evenly, and what of a column counts as nothing.
TERMS, NOTHING = 2, 1e-9


def screening_design(inputs: int) -> Array:
    """Quantiles (n, inputs) of a folded-over two-level design: main effects free of each other and of all pairs.

    Hadamard's matrix and its mirror image (Plackett and Burman 1946; Box and Wilson 1951 for the fold).
    """
    size = 1 << int(inputs).bit_length()
    signs = hadamard(size)[:, 1 : inputs + 1]
    return np.where(np.vstack([signs, -signs]) > 0, HIGH, LOW)


def effect_shares(quantiles: Array, values: Array) -> Array:
    """Share (d, m) that each input has in the variance of each output (n, m) which main effects make, by least squares on
    the quantiles (n, d)."""
    coded = quantiles - quantiles.mean(axis=0)
    effects = np.linalg.lstsq(coded, values - values.mean(axis=0), rcond=None)[0]
    made = (effects * coded.std(axis=0)[:, None]) ** 2
    whole = made.sum(axis=0)
    return np.divide(made, whole, out=np.zeros_like(made), where=whole > 0.0)


def retained(shares_: Array, always: list[int], most: int) -> list[int]:
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
