"""Posterior samples of inputs, and what measurements identify of these: single inputs, combinations, what was not seen.

Samples of a posterior by sequential Monte Carlo: the likelihood is switched on in powers from 0 to 1.

Particles are in normal scores, whose prior is standard normal. Each power is the one at which half of the particles still
count; these are drawn again and moved by differences of others, which point along ridges and from mode to mode. Halves move
in turn, each by differences within the other, so that every move keeps the posterior.

Sources: Del Moral, Doucet and Jasra, Sequential Monte Carlo samplers (2006); Jasra et al., Inference for Levy-driven
stochastic volatility models via adaptive SMC (2011) for the powers; ter Braak, Differential evolution Markov chain (2006).

Contraction is 1 - sd after / sd before in quantiles of the prior, so it does not depend on units or laws. Along a ridge no
input contracts and yet a combination is known: one of logarithms whose variance is a small share of the prior's.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import linalg

from doe.threads import one_thread
from rbdyn.base.arrays import Array
from rbdyn.base.faults import RunError

PARTICLES = 4000
# Share of particles that still count at the next power; accepted moves of each particle there, and at the last; sweeps at most.
COUNTING, ACCEPTED, ACCEPTED_LAST, MOST_SWEEPS = 0.5, 2.0, 4.0, 24
# Accepted share that the length of moves aims at; share of moves of full length, from mode to mode; scatter next to a line.
AIM, LEAPS, BESIDE = 0.25, 0.1, 1e-3

LogDensity = Callable[[Array], Array]


class Level(NamedTuple):
    """Particles (n, d) of the prior times the likelihood to a power, and the logarithms (n,) of the likelihood."""

    power: float
    points: Array
    log_likelihood: Array


@dataclass(frozen=True)
class Sampled:
    """Particles at every power, of which the last is 1, and the logarithm of the evidence: of the likelihood's prior mean."""

    levels: list[Level]
    log_evidence: float

    @property
    def points(self) -> Array:
        """Particles (n, d) of the posterior, in normal scores."""
        return self.levels[-1].points


@one_thread
def sampled(log_likelihood: LogDensity, inputs: int, seed: int, particles: int = PARTICLES) -> Sampled:
    """Sample a posterior over ``inputs`` normal scores; ``particles`` is even. Raises RunError where nothing is likely."""
    random = np.random.default_rng(seed)
    points = random.standard_normal((particles, inputs))
    logs = log_likelihood(points)
    if not np.isfinite(logs).any():
        raise RunError("calibration: no input set has a finite likelihood; check the measured values and their errors")
    levels, evidence, power, length = [Level(0.0, points, logs)], 0.0, 0.0, 1.0
    while power < 1.0:
        step = _step(logs, 1.0 - power)
        weights, mean = _weights(step * logs)
        evidence, power = evidence + mean, 1.0 if step == 1.0 - power else power + step
        rows = np.searchsorted(np.cumsum(weights), (np.arange(particles) + random.random()) / particles)
        rows = random.permutation(rows.clip(max=particles - 1))
        points, logs, length = _moved(points[rows], logs[rows], power, length, log_likelihood, random)
        levels.append(Level(power, points, logs))
    return Sampled(levels, evidence)


def effective(log_weights: Array) -> float:
    """How many equally weighted particles would carry as much."""
    weights = _weights(log_weights)[0]
    return float(1.0 / (weights**2).sum())


def _weights(logs: Array) -> tuple[Array, float]:
    """Weights (n,) that sum to 1, and the logarithm of the mean of what they are of."""
    most = float(logs.max())
    weights = np.exp(logs - most)
    return weights / weights.sum(), most + float(np.log(weights.mean()))


def _step(logs: Array, left: float) -> float:
    """By how much the power may rise until only the share COUNTING of the particles counts."""
    if effective(left * logs) >= COUNTING * logs.size:
        return left
    low, high = 0.0, left
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle * logs) >= COUNTING * logs.size else (low, middle)
    # Never no step at all, be the likelihood as steep as it may.
    return max(low, 1e-12)


def _moved(
    points: Array, logs: Array, power: float, length: float, log_likelihood: LogDensity, random: np.random.Generator
) -> tuple[Array, Array, float]:
    """Particles moved until each has been accepted often enough on average, and the length of moves that this took."""
    points, logs = points.copy(), logs.copy()
    half, inputs = len(points) // 2, points.shape[1]
    usual, accepted = 2.38 / np.sqrt(2.0 * inputs), 0.0
    for _ in range(MOST_SWEEPS):
        share = []
        for mine, other in ((slice(None, half), slice(half, None)), (slice(half, None), slice(None, half))):
            here, there = points[mine], points[other]
            pairs = random.integers(0, len(there), (2, len(here)))
            leap = np.where(random.random(len(here)) < LEAPS, 1.0, length * usual)
            tried = here + leap[:, None] * (there[pairs[0]] - there[pairs[1]])
            tried += BESIDE * random.standard_normal(here.shape)
            found = log_likelihood(tried)
            ratio = power * (found - logs[mine]) - 0.5 * ((tried**2).sum(axis=1) - (here**2).sum(axis=1))
            take = np.log(random.random(len(here))) < ratio
            points[mine] = np.where(take[:, None], tried, here)
            logs[mine] = np.where(take, found, logs[mine])
            share.append(float(take.mean()))
        accepted += float(np.mean(share))
        length = float(np.clip(length * np.exp(np.mean(share) - AIM), 0.1, 2.0))
        if accepted >= (ACCEPTED if power < 1.0 else ACCEPTED_LAST):
            break
    return points, logs, length


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
