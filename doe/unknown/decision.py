"""Whether one design beats another, and how likely a design keeps its limits, while inputs are unknown.

Rows are pairs: both designs at the same input set, their relative gains D (n, m) with variances s^2 (n, m) of the simulation.
Taken one by one they scatter more than the truth, so each is shrunk towards the mean of all by what scatter is noise: the
true gains of row i are normal about m + V (V + S_i)^-1 (D_i - m), V = cov D - mean S. A probability is the mean over rows
that all true gains are positive; its interval is by resampling rows. Responses are never multiplied: gains go together.

Sources: Efron and Morris, Journal of the American Statistical Association 68 (1973) 117; Wilson, ibid. 22 (1927) 209.

Limits: rows are input sets at which the design was simulated. They are shrunk as gains are: the true value of row i is normal about
m + V/(V + s_i^2) (y_i - m) with the variance V s_i^2/(V + s_i^2), V = var y - mean s^2. The probability is the mean over rows that it
lies between the limits; its interval is by resampling rows, and no shorter than Wilson's.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import special, stats

from doe.threads import one_thread
from doe.unknown.propagation import Share
from rbdyn.base.arrays import Array, Whole

# Draws of a row's true gains, resamplings of rows, and the share of cases an interval should hold.
DRAWS, RESAMPLES, CONFIDENCE = 64, 200, 0.95


@dataclass(frozen=True)
class Better:
    """Probability that each gain is positive, and that all are, with 95 % intervals."""

    each: list[Share]
    all: Share


@one_thread
def better(gains: Array, variances: Array, seed: int) -> Better:
    """How likely the true gains (n, m) are positive, given what was simulated and its variances (n, m)."""
    random = np.random.default_rng(seed)
    # Every resampling shrinks anew: how much is noise is known no better than the rows show it.
    *each, every = resampled(lambda rows: _shares(gains[rows], variances[rows], random), len(gains), random)
    return Better(each, every)


def resampled(shares: Callable[[Whole], Array], count: int, random: np.random.Generator) -> list[Share]:
    """``shares`` (m,) of all of so many rows, with 95 % intervals by drawing rows anew."""
    whole = shares(np.arange(count))
    again = [shares(rows) for rows in random.integers(0, count, (RESAMPLES, count))]
    ends = np.quantile(again, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE], axis=0)
    found = []
    for value, low, high in zip(whole.tolist(), *ends.tolist(), strict=True):
        # Resampled rows that all agree show no scatter; Wilson's interval still has one.
        least, most = wilson(value, count)
        found.append(Share(value, min(low, least), max(high, most)))
    return found


def wilson(share: float, count: int) -> tuple[float, float]:
    """95 % interval of a share of ``count`` independent rows (Wilson 1927)."""
    z = float(stats.norm.ppf(0.5 + 0.5 * CONFIDENCE))
    middle = (share + z * z / (2.0 * count)) / (1.0 + z * z / count)
    half = z / (1.0 + z * z / count) * np.sqrt(share * (1.0 - share) / count + z * z / (4.0 * count * count))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def shrunk(gains: Array, variances: Array) -> Array:
    """Gains (n, m) drawn towards their mean, so that they scatter as the true ones do."""
    whole = gains.var(axis=0, ddof=1)
    kept = np.divide((whole - variances.mean(axis=0)).clip(0.0), whole, out=np.zeros_like(whole), where=whole > 0.0)
    middle: Array = gains.mean(axis=0)
    return middle + np.sqrt(kept) * (gains - middle)


def in_doubt(gains: Array, variances: Array) -> Whole:
    """Places of the rows of which a gain is within two standard errors of nothing, the most doubtful first."""
    sure = (np.abs(gains) / np.sqrt(np.maximum(variances, 1e-300))).min(axis=1)
    ranked = np.argsort(sure, kind="stable")
    return ranked[sure[ranked] < 2.0]


def _shares(gains: Array, variances: Array, random: np.random.Generator) -> Array:
    """Probability that each true gain is positive, and that all are (m + 1,)."""
    middle = gains.mean(axis=0)
    between = _positive(np.cov(gains.T, ddof=1).reshape(len(middle), -1) - np.diag(variances.mean(axis=0)))
    noise = variances[:, :, None] * np.eye(len(middle))
    weights = between @ np.linalg.pinv(between + noise)
    roots = _root(between - weights @ between)
    shrunk = middle + np.einsum("nij,nj->ni", weights, gains - middle)
    normal = random.standard_normal((DRAWS, *gains.shape))
    positive = shrunk + np.einsum("nij,snj->sni", roots, normal) > 0.0
    return np.array([*positive.mean(axis=(0, 1)), positive.all(axis=2).mean()])


def _positive(matrix: Array) -> Array:
    """The nearest matrix without negative eigenvalues."""
    sizes, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return (axes * sizes.clip(0.0)) @ axes.T


def _root(matrix: Array) -> Array:
    sizes, axes = np.linalg.eigh(0.5 * (matrix + np.swapaxes(matrix, -1, -2)))
    return axes * np.sqrt(sizes.clip(0.0))[..., None, :]


@one_thread
def odds(values: Array, variances: Array, lower: float, upper: float, seed: int) -> Share:
    """Probability that the true value of an input set lies from ``lower`` to ``upper``, from simulated ``values`` (n,) with
    ``variances`` (n,); an end may be infinite."""
    (found,) = resampled(
        lambda rows: np.array([_share(values[rows], variances[rows], lower, upper)]),
        len(values),
        np.random.default_rng(seed),
    )
    return found


def _share(values: Array, variances: Array, lower: float, upper: float) -> float:
    middle = values.mean()
    between = max(float(values.var(ddof=1) - variances.mean()), 0.0)
    weight = np.divide(between, between + variances, out=np.zeros_like(variances), where=between + variances > 0.0)
    true, deviation = middle + weight * (values - middle), np.sqrt(weight * variances)
    sure = deviation <= 1e-12 * np.abs(true)
    below, above = (special.ndtr((end - true) / np.where(sure, 1.0, deviation)) for end in (lower, upper))
    return float(np.where(sure, (lower <= true) & (true <= upper), above - below).mean())
