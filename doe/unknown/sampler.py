"""Samples of a posterior by sequential Monte Carlo: the likelihood is switched on in powers from 0 to 1.

Particles are in normal scores, whose prior is standard normal. Each power is the one at which half of the particles still
count; these are drawn again and moved by differences of others, which point along ridges and from mode to mode. Halves move
in turn, each by differences within the other, so that every move keeps the posterior.

Sources: Del Moral, Doucet and Jasra, Sequential Monte Carlo samplers (2006); Jasra et al., Inference for Levy-driven
stochastic volatility models via adaptive SMC (2011) for the powers; ter Braak, Differential evolution Markov chain (2006).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from doe.arrays import Array
from doe.threads import one_thread
from rbdyn.faults import RunError

PARTICLES = 4000
# Share of particles that still count at the next power; accepted moves of each particle there, and at the last; sweeps at most.
COUNTING, ACCEPTED, ACCEPTED_LAST, MOST_SWEEPS = 0.5, 2.0, 4.0, 24
# Accepted share that the length of moves aims at; share of moves of full length, from mode to mode; scatter beside a line.
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
    """How many equally weighted particles would tell as much."""
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
