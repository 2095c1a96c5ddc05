"""Gains of pairs whose truth is known: which input decides, where, and what it is worth."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from doe.emulator import NoisyValues
from doe.unknown.decision import DecisiveInputs, decisive_inputs
from doe.unknown.inputs import nested
from rbdyn.base.arrays import Array

FRESH = 8192


def noisy(truth: Array, sd: float, seed: int) -> NoisyValues:
    """Gains (n, m) with noise of a known size, their variances from seven degrees of freedom."""
    random = np.random.default_rng(seed)
    variances = sd**2 * random.chisquare(7, truth.shape) / 7.0
    return NoisyValues(truth + sd * random.standard_normal(truth.shape), variances, np.full(truth.shape, 7))


def _rough(quantiles: Array, seed: int) -> Array:
    """Normal scores (n,) that inputs make but no hundred rows could show: a deterministic function without any length."""
    random = np.random.default_rng(seed)
    waves = np.sin(60.0 * quantiles @ random.standard_normal((quantiles.shape[1], 3)) + random.uniform(0.0, 6.0, 3))
    return np.asarray(ndtri((1e3 * waves.sum(axis=1) % 1.0).clip(1e-6, 1.0 - 1e-6)))


def _flip(q: Array) -> Array:
    return np.column_stack([0.4 - q[:, 1], 1.0 + 0.2 * q[:, 0]])


def _two(q: Array) -> Array:
    """Input 0 is worth four times as much as input 1; the rest is noise."""
    z = ndtri(q)
    first = 0.2 + z[:, 0] + 0.45 * z[:, 1] + 0.4 * z[:, 2] * z[:, 3]
    return np.column_stack([first, 1.5 + 0.5 * z[:, 4] + 0.3 * _rough(q, 1)])


def _equal(q: Array) -> Array:
    """Inputs 0 and 1 are worth the same."""
    z = ndtri(q)
    first = 0.1 + 0.7 * z[:, 0] + 0.7 * z[:, 1] + 0.2 * z[:, 2] + 0.3 * _rough(q, 2)
    return np.column_stack([first, 2.0 + 0.5 * z[:, 3]])


def _pair(q: Array) -> Array:
    """The sign of a product decides, and neither of its factors does."""
    return np.column_stack([(q[:, 0] - 0.5) * (q[:, 2] - 0.5), 2.0 + ndtri(q[:, 1])])


def _never(q: Array) -> Array:
    return 0.2 + 0.02 * ndtri(q[:, :2])


def _rig(q: Array) -> Array:
    """As of a bearing: impact mostly gains, by input 0; loss mostly, by input 1; whirl by chance, and by input 0 a little."""
    z = ndtri(q)
    impact = 1.5 + 0.8 * z[:, 0] + 0.4 * z[:, 2] + 0.3 * z[:, 3] * z[:, 0]
    loss = 1.35 + 0.9 * z[:, 1] + 0.3 * z[:, 5] + 0.1 * z[:, 6] ** 2
    whirl = 0.3 + 0.25 * z[:, 0] - 0.2 * z[:, 5] + 0.2 * z[:, 7] + 0.15 * z[:, 8] + 0.9 * _rough(q, 3)
    return np.column_stack([impact, whirl, loss])


@dataclass(frozen=True)
class Known:
    """Gains (n, m) of quantiles (n, d), and the noise with which they are simulated."""

    gains: Callable[[Array], Array]
    inputs: int
    noise: float

    def decide(self, pairs: int, seed: int) -> DecisiveInputs:
        """What so many pairs make of it."""
        quantiles = nested(self.inputs + 1, pairs, 1000 + seed)
        gains = noisy(self.gains(quantiles[:, :-1]), self.noise, seed)
        fresh = nested(self.inputs + 1, FRESH, 5000 + seed)
        return decisive_inputs(quantiles, gains.values, gains.smooth(quantiles), fresh, seed)

    def truth(self, slices: int = 128) -> tuple[Array, Array]:
        """Worths (d,) and flips (d,) of all inputs by half a million sets, without noise or emulator; not a number where the
        probability does not cross a half just once."""
        quantiles = nested(self.inputs, 2**19, 77)
        better = (self.gains(quantiles) > 0.0).all(axis=1)
        p, worths, flips = better.mean(), [], []
        for at in np.minimum((quantiles * slices).astype(np.int64), slices - 1).T:
            curve = np.bincount(at, better, slices) / np.bincount(at, minlength=slices)
            worths.append(np.maximum(curve, 1.0 - curve).mean() - max(p, 1.0 - p))
            crossings = np.flatnonzero((curve[:-1] > 0.5) != (curve[1:] > 0.5))
            share = [(0.5 - curve[place]) / (curve[place + 1] - curve[place]) for place in crossings]
            flips.append((crossings[0] + 0.5 + share[0]) / slices if len(share) == 1 else np.nan)
        return np.array(worths), np.array(flips)


KNOWN = {
    "flip": Known(_flip, 3, 0.05), "two": Known(_two, 6, 0.1), "equal": Known(_equal, 6, 0.1),
    "pair": Known(_pair, 4, 0.02), "never": Known(_never, 4, 0.02), "rig": Known(_rig, 12, 0.1),
}  # fmt: skip
