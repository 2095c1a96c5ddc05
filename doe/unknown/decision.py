"""Whether one design beats another while inputs are not known, which input decides it, and what knowing that would be worth.

Rows are pairs: both designs at the same input set, their relative gains D (n, m) with variances s^2 (n, m) of the simulation.
Taken one by one they scatter more than the truth, so each is shrunk towards the mean of all by what scatter is noise: the
true gains of row i are normal about m + V (V + S_i)^-1 (D_i - m), V = cov D - mean S. A probability is the mean over rows
that all true gains are positive; its interval is by resampling rows. Responses are never multiplied: gains go together.

What an input decides: gains are emulated over all inputs, with what the emulators miss as joint normal residuals; p(t) is the
probability given the input, its flip where it crosses a half, and its worth E max(p, 1 - p) - max(p, 1 - p): by how much
knowing it raises the chance to choose rightly, less what an input that does nothing seems to be worth. An input that is measured
with an error is known by its reading instead: p is taken given that. The probability with all ranges half as wide about their
medians tells how much hangs on the ranges themselves, which are opinions.

Sources: Efron and Morris, Journal of the American Statistical Association 68 (1973) 117; Strong, Oakley and Brennan, Medical
Decision Making 34 (2014) 311 (expected value of partial perfect information by regression).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy import special, stats

from doe.arrays import Array, Whole
from doe.emulator import fit_emulator
from doe.threads import one_thread
from doe.unknown.spread import Share

# Draws of a row's true gains, resamplings of rows, and the share of cases an interval should hold.
DRAWS, RESAMPLES, CONFIDENCE = 64, 200, 0.95
# Slices of an input's range in which the probability is taken; of a pair of inputs, along each. Residual draws.
BINS, PAIR_BINS, RESIDUALS = 32, 8, 48


@dataclass(frozen=True)
class Better:
    """Probability that each gain is positive, and that all are, with 95 % intervals."""

    each: list[Share]
    all: Share


class Deciding(NamedTuple):
    """What knowing an input is worth, the quantile of it where the better design changes, None where it does not, and whether
    the new design is better above that."""

    place: int
    flip: float | None
    worth: float
    above: bool


@dataclass(frozen=True)
class Decides:
    """Inputs by their worth, the best first; the pair worth most and its worth; share of each gain's variance that the
    inputs foretell, of what noise leaves; by how much the probability that all gains are positive changes with ranges half as
    wide."""

    inputs: list[Deciding]
    pair: tuple[int, int, float] | None
    foretold: list[float]
    halved: float


@one_thread
def better(gains: Array, variances: Array, seed: int) -> Better:
    """How likely the true gains (n, m) are positive, given what was simulated and its variances (n, m)."""
    random = np.random.default_rng(seed)
    whole, count = _shares(gains, variances, random), len(gains)
    # Every resampling shrinks anew: how much is noise is known no better than the rows tell it.
    again = [_shares(gains[rows], variances[rows], random) for rows in random.integers(0, count, (RESAMPLES, count))]
    ends = np.quantile(again, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE], axis=0)
    found = []
    for value, low, high in zip(whole.tolist(), *ends.tolist(), strict=True):
        # Resampled rows that all agree show no scatter; Wilson's interval still has one.
        least, most = wilson(value, count)
        found.append(Share(value, min(low, least), max(high, most)))
    return Better(found[:-1], found[-1])


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
def decides(
    quantiles: Array,
    gains: Array,
    variances: Array,
    fresh: Array,
    seed: int,
    read: Array | None = None,
    knowable: Sequence[int] | None = None,
) -> Decides:
    """Which inputs decide, from rows at quantiles (n, d) of them, the last an input that does nothing.

    ``variances`` (n, m) are smooth over the inputs; ``fresh`` (k, d): quantiles of many input sets, ``read``
    (k, d) those of what is read of them, with the errors of measurements; ``knowable``: places of the inputs that have one
    true value, all unless told.
    """
    random = np.random.default_rng(seed)
    emulators, residuals, q2 = [], [], []
    for gain, smooth in zip(gains.T, variances.T, strict=True):
        emulator = fit_emulator(quantiles, gain, smooth, trend="linear")
        others = emulator.leave_one_out()[0]
        # What the other rows foretell counts by as much as a row's gain follows it: nothing where it follows by chance only.
        follows = float(np.cov(gain, others)[0, 1] / max(others.var(ddof=1), 1e-300))
        follow = min(max(follows, 0.0), 1.0), float(others.mean()), float(gain.mean())
        missed = gain - _followed(others, *follow)
        whole = max(float(gain.var(ddof=1) - smooth.mean()), 1e-300)
        left = max(float((missed**2).mean() - smooth.mean()), 0.0)
        # What noise makes of the misses is not the truth's.
        residuals.append(missed * np.sqrt(left / max(float((missed**2).mean()), 1e-300)))
        emulators.append((emulator, follow))
        q2.append(max(1.0 - left / whole, 0.0))
    spread = _root(np.cov(np.array(residuals), ddof=0).reshape(len(q2), -1))
    missing = random.standard_normal((RESIDUALS, len(q2))) @ spread.T
    # Symmetric draws: no residual moves the mean.
    missing = np.vstack([missing, -missing])

    def all_better(at: Array) -> Array:
        foretold = np.array([_followed(emulator.mean(at), *follow) for emulator, follow in emulators]).T
        return (foretold[None] + missing[:, None] > 0.0).all(axis=2).mean(axis=0)

    better_at = all_better(fresh)
    whole_p = float(better_at.mean())

    def worth(of: Sequence[int], bins: int) -> float:
        curve = _binned(better_at, [told[:, place] for place in of], bins)
        return float(np.maximum(curve, 1.0 - curve).mean()) - max(whole_p, 1.0 - whole_p)

    told = fresh if read is None else read
    nothing = quantiles.shape[1] - 1
    places = range(nothing) if knowable is None else knowable
    alone = {place: worth([place], BINS) for place in (*places, nothing)}
    floor = max(alone[nothing], 0.0)
    found = []
    for place in places:
        flip, above = _flip(_binned(better_at, [fresh[:, place]], BINS))
        found.append(Deciding(place, flip, max(alone[place] - floor, 0.0), above))
    # Of a pair what the first seems to be worth beside nothing, more than alone, is chance.
    chance = {place: max(worth([place, nothing], PAIR_BINS) - alone[place], 0.0) for place in places}
    pairs = [(worth(both, PAIR_BINS) - chance[both[0]], *both) for both in combinations(places, 2)]
    best = max(pairs, default=None)
    return Decides(
        sorted(found, key=lambda each: (-each.worth, each.place)),
        None if best is None else (best[1], best[2], max(best[0], 0.0)),
        q2,
        float(all_better(0.25 + 0.5 * fresh).mean()) - whole_p,
    )


def _followed(foretold: Array, slope: float, middle: float, mean: float) -> Array:
    return mean + slope * (foretold - middle)


def _binned(values: Array, along: Sequence[Array], bins: int) -> Array:
    """Mean of values (k,) in equal slices of each coordinate (k,); a slice without values has the mean of all."""
    places = np.zeros(len(values), dtype=np.int64)
    for coordinate in along:
        places = places * bins + np.minimum((coordinate * bins).astype(np.int64), bins - 1)
    size = bins ** len(along)
    count = np.bincount(places, minlength=size)
    total = np.bincount(places, values, size)
    return np.where(count > 0, total / np.maximum(count, 1), values.mean())


def _flip(curve: Array) -> tuple[float | None, bool]:
    """Quantile at which the probability crosses a half for good, by a logistic line through the slices, and whether it is
    larger above."""
    at = (np.arange(len(curve)) + 0.5) / len(curve)
    sides = np.sign(curve - 0.5)
    if (sides >= 0.0).all() or (sides <= 0.0).all():
        return None, bool(curve.mean() > 0.5)
    # The crossing that leaves most slices on the side that their neighbours are on.
    crossings = np.flatnonzero(sides[:-1] * sides[1:] <= 0.0)
    fits = [abs(sides[: place + 1].sum()) + abs(sides[place + 1 :].sum()) for place in crossings]
    place = int(crossings[int(np.argmax(fits))])
    low, high = (special.logit(np.clip(curve[each], 1e-3, 1.0 - 1e-3)) for each in (place, place + 1))
    share = 0.5 if high == low else low / (low - high)
    return float(at[place] + np.clip(share, 0.0, 1.0) * (at[1] - at[0])), bool(sides[place + 1 :].sum() > 0.0)
