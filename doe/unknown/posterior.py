"""What measurements taught of inputs: each of them, combinations of them, and what was not seen.

Contraction is 1 - sd after / sd before in quantiles of the prior, so it does not depend on units or laws. Along a ridge no
input contracts and yet a combination is known: one of logarithms whose variance is a small share of the prior's.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import linalg

from doe.arrays import Array

# Contractions from which an input is learned, or partly; shares of the prior's variance below which a combination is known.
LEARNED, PARTLY, KNOWN = 0.5, 0.2, 0.1
INSIDE = 0.9  # of an interval
# A range is too narrow where this share of the posterior lies within so much of one of its ends.
CROWD, END = 0.2, 0.05
# Powers below this share of the largest, in standard deviations of their inputs, are none.
SMALL = 0.25
PRIOR_SD = 12.0**-0.5  # of a quantile


class Combination(NamedTuple):
    """A product of powers of inputs, by their places, and the standard deviation of its logarithm after and before."""

    powers: dict[int, float]
    after: float
    before: float


@dataclass(frozen=True)
class Learnt:
    """Contraction (d,) of each input, known combinations, share (d,) that is left unseen, places of inputs at an end."""

    contraction: Array
    combinations: list[Combination]
    narrow: list[int]

    @property
    def anything(self) -> bool:
        """Whether an input or a combination was learned."""
        return bool((self.contraction >= LEARNED).any() or self.combinations)


def learnt(quantiles: Array, logarithms: Array, before: Array) -> Learnt:
    """What was learned, from quantiles (n, d) of inputs after, and their logarithms (n, d) after and before; the logarithm of
    an input that has none is NaN."""
    crowded = np.maximum((quantiles < END).mean(axis=0), (quantiles > 1.0 - END).mean(axis=0))
    return Learnt(contraction(quantiles), _combinations(logarithms, before), np.flatnonzero(crowded > CROWD).tolist())


def contraction(quantiles: Array) -> Array:
    """1 - sd after / sd before (d,) of inputs by their quantiles (n, d), 0 where they spread more than before."""
    return (1.0 - quantiles.std(axis=0) / PRIOR_SD).clip(0.0)


def densest_intervals(quantiles: Array) -> Array:
    """Ends (2, d) of the shortest intervals that hold the share INSIDE of quantiles (n, d): of highest density where there is
    one mode. One that begins at the outermost particle reaches to the end of the range, which equal tails never do."""
    ordered, count = np.sort(quantiles, axis=0), len(quantiles)
    span = int(np.ceil(INSIDE * count)) - 1
    first = np.argmin(ordered[span:] - ordered[: count - span], axis=0)
    columns = np.arange(quantiles.shape[1])
    low = np.where(first == 0, 0.0, ordered[first, columns])
    return np.array([low, np.where(first == count - span - 1, 1.0, ordered[first + span, columns])])


def seen(share: float) -> str:
    """What a contraction means."""
    return "learned" if share >= LEARNED else "partly" if share >= PARTLY else "not seen"


def _combinations(after: Array, before: Array) -> list[Combination]:
    """Combinations of two inputs or more that are known, the best first: eigenvectors of one covariance by the other."""
    numbers = np.isfinite(after).all(axis=0) & np.isfinite(before).all(axis=0)
    places = np.flatnonzero(numbers & (before.std(axis=0) > 0.0))
    if places.size < 2:
        return []
    spread = before[:, places].std(axis=0)
    covariances = [np.cov(logs[:, places].T / spread[:, None]) for logs in (after, before)]
    shares, vectors = linalg.eigh(*covariances)
    found = []
    for share, vector in zip(shares, vectors.T, strict=True):
        part = np.where(np.abs(vector) >= SMALL * np.abs(vector).max(), vector, 0.0)
        if share >= KNOWN or (part != 0.0).sum() < 2:
            continue
        powers = part / spread
        powers = powers / powers[np.argmax(np.abs(powers))]
        sds = [float((logs[:, places] @ powers).std()) for logs in (after, before)]
        if sds[0] ** 2 < KNOWN * sds[1] ** 2:
            listed = {int(place): float(power) for place, power in zip(places, powers, strict=True) if power != 0.0}
            found.append(Combination(listed, *sds))
    return found
