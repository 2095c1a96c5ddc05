"""Which input makes an output vary: Sobol' indices of an emulator, with intervals, beside an input that does nothing.

First-order index of an input: the share of the output's variance that would vanish if the input were known; total index:
the share that would be left if all others were. Both by scipy's Saltelli scheme on the emulator's mean. Intervals by
parametric bootstrap: functions drawn from the emulator take the truth's place, are run with fresh noise and emulated anew;
by how much their indices are missed is the error of ours, its mean the bias that is taken off. Of inputs
that depend on each other these indices mean nothing; there the first-order index is the variance of the mean given the
input, and effects of Shapley share the rest.

Sources: Saltelli et al., Computer Physics Communications 181 (2010) 259; Marrel et al., Reliability Engineering and System
Safety 94 (2009) 742; Song, Nelson and Staum, SIAM/ASA J. Uncertainty Quantification 4 (2016) 1060.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import stats

from doe.arrays import Array
from doe.emulator import Emulator, fit_emulator
from doe.unknown.spread import Emulated

# Points of an index (a power of two), refits of its interval, and the share of cases that the interval should hold.
POINTS, POINTS_OF_REFITS, REFITS, CONFIDENCE = 1024, 256, 16, 0.9


class Index(NamedTuple):
    """A share of the variance, and its 90 % interval."""

    value: float
    low: float
    high: float


class Indices(NamedTuple):
    """First and total indices of every input, in their order."""

    first: list[Index]
    total: list[Index]


def sobol(fitted: Emulated, inputs: int, seed: int) -> Indices:
    """Sobol' indices of independent inputs, uniform in their quantiles."""
    random = np.random.default_rng(seed)
    emulator, whole = fitted.emulator, np.array(_indices(fitted, inputs, POINTS, seed))
    noise = np.sqrt(emulator.variances + emulator.hyperparameters.nugget)
    misses = []
    for again in range(REFITS):
        truth = emulator.draw(1, random)
        values = truth(emulator.points)[0] + noise * random.standard_normal(noise.size)
        refit = replace(fitted, emulator=_refitted(emulator, values))
        # Both by the same points, whose own error then hardly shows in the difference.
        ours, true = (
            np.array(_indices(function, inputs, POINTS_OF_REFITS, seed + 1 + again))
            for function in (refit, lambda at, truth=truth: fitted.back(truth(at)[0]))
        )
        misses.append(ours - true)
    middle = whole - np.mean(misses, axis=0)
    half = (
        stats.t.ppf(0.5 + 0.5 * CONFIDENCE, REFITS - 1) * np.std(misses, axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / REFITS)
    )
    ends = np.stack([middle, middle - half, middle + half]).clip(0.0, 1.0)
    first, total = ([Index(*map(float, ends[:, kind, each])) for each in range(inputs)] for kind in (0, 1))
    return Indices(first, total)


def _refitted(emulator: Emulator, values: Array) -> Emulator:
    return fit_emulator(emulator.points, values, emulator.variances, trend="linear", start=emulator.hyperparameters)


def _indices(function: Callable[[Array], Array], inputs: int, points: int, seed: int) -> tuple[Array, Array]:
    """First and total indices (d,) of a function of quantiles (n, d)."""
    found = stats.sobol_indices(
        func=lambda columns: function(columns.T)[None],
        n=points,
        dists=[stats.uniform()] * inputs,
        rng=np.random.default_rng(seed),
    )
    return np.asarray(found.first_order).reshape(inputs), np.asarray(found.total_order).reshape(inputs)
