"""Distributions of inputs: from evenly spread numbers to values, and back; dependence by a Gaussian copula."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import special, stats

from doe.arrays import Array
from rbdyn.faults import InputError
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
