"""Which input makes an output vary: Sobol' indices of an emulator, with intervals, beside an input that does nothing.

First-order index of an input: the share of the output's variance that would vanish if the input were known; total index:
the share that would be left if all others were. Both by scipy's Saltelli scheme on the emulator's mean, and shares of the
variance over all inputs: what inputs outside the emulator make, and what it misses, is in the whole. Intervals by
parametric bootstrap: functions drawn from the emulator take the truth's place, are run with fresh noise and emulated anew
from the last hyperparameters on; by how much their indices are missed is the error of ours, its mean the bias that is taken off. Of inputs that depend on each
other these indices mean nothing. There Shapley's effects share the variance: what an input adds to the variance explained,
Var E[y | those known], on average over all orders in which the inputs become known.

Sources: Saltelli et al., Computer Physics Communications 181 (2010) 259; Marrel et al., Reliability Engineering and System
Safety 94 (2009) 742; Song, Nelson and Staum, SIAM/ASA J. Uncertainty Quantification 4 (2016) 1060; Broto, Bachoc and Depecker,
SIAM/ASA J. Uncertainty Quantification 8 (2020) 693 (nearest neighbours in place of conditional draws).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from doe.arrays import Array
from doe.emulator import fit_emulator
from doe.threads import one_thread
from doe.unknown.joint import Joint, nested
from doe.unknown.spread import Emulated, Share, residual_variance

# Points of an index (a power of two), refits of its interval, and the share of cases that the interval should hold.
POINTS, POINTS_OF_REFITS, REFITS, CONFIDENCE = 1024, 256, 16, 0.9
# Orders of the inputs over which Shapley's effects are averaged, each with its reverse.
ORDERS = 8

Function = Callable[[Array], Array]  # of quantiles (n, d)
Measure = Callable[[Function, int, int], Array]  # of a function, by so many points and a seed
Sample = Callable[[int, int], Array]  # quantiles (n, d) of so many input sets, of a seed


class Indices(NamedTuple):
    """First and total indices of every input, in their order, with 90 % intervals."""

    first: list[Share]
    total: list[Share]


@one_thread
def sobol(fitted: Emulated, inputs: int, seed: int) -> Indices:
    """Sobol' indices of the independent inputs of an emulator, uniform in their quantiles."""
    even: Sample = lambda points, seed: nested(inputs, points, seed)  # noqa: E731
    ends = _with_intervals(fitted, lambda *of: np.array(_indices(inputs, *of)), even, seed)
    first, total = ([Share(*map(float, ends[:, kind, each])) for each in range(inputs)] for kind in (0, 1))
    return Indices(first, total)


@one_thread
def shapley(fitted: Emulated, joint: Joint, seed: int) -> list[Share]:
    """Shapley's effects of the inputs of an emulator, which depend on each other, and of one that does nothing, the last; their
    sum is the share of the variance that the emulator explains."""
    # Rows of a sample are no even plan: they need more of them.
    ends = _with_intervals(fitted, lambda *of: _effects(joint, *of), joint.sets, seed, 4 * POINTS)
    return [Share(*map(float, each)) for each in ends.T]


def explained(fitted: Emulated, values: Array, rest: float) -> float:
    """Share of an output's variance over all inputs that a function makes whose outputs are ``values`` (n,) at likely input
    sets; ``rest``: variance of what comes on top in the emulator's values."""
    mean, square = float(values.mean()), float((values**2).mean())
    # Of y = g exp(e) with normal e: E[y | g] = g exp(rest/2), E[y^2] = E[g^2] exp(2 rest).
    whole = np.exp(rest) * square - mean**2 if fitted.logarithmic else square - mean**2 + rest
    return (square - mean**2) / whole if whole > 0.0 else 0.0


def _with_intervals(fitted: Emulated, measure: Measure, sample: Sample, seed: int, points: int = POINTS) -> Array:
    """Shares (3, ...) of the variance over all inputs, with the ends of their intervals."""
    random, emulator = np.random.default_rng(seed), fitted.emulator

    def shares(function: Function, rest: float, count: int, seed: int) -> Array:
        return measure(function, count, seed) * explained(fitted, function(sample(count, seed)), rest)

    whole = shares(fitted.at_columns, residual_variance(emulator), points, seed)
    noise = np.sqrt(emulator.variances + emulator.hyperparameters.nugget)
    like: dict[str, Any] = {"trend": "linear", "start": emulator.hyperparameters}
    misses = []
    for again in range(REFITS):
        truth = emulator.draw(1, random)
        values = truth(emulator.points)[0] + noise * random.standard_normal(noise.size)
        refit = replace(fitted, emulator=fit_emulator(emulator.points, values, emulator.variances, **like))
        drawn: Function = lambda at, truth=truth: fitted.back(truth(at)[0])  # type: ignore[misc]  # noqa: E731
        # Both by the same points, whose own error then hardly shows in the difference.
        by = POINTS_OF_REFITS, seed + 1 + again
        ours = shares(refit.at_columns, residual_variance(refit.emulator), *by)
        misses.append(ours - shares(drawn, emulator.hyperparameters.nugget, *by))
    middle = whole - np.mean(misses, axis=0)
    student = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, REFITS - 1)
    half = student * np.std(misses, axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / REFITS)
    return np.stack([middle, middle - half, middle + half]).clip(0.0, 1.0)


def _indices(inputs: int, function: Function, points: int, seed: int) -> tuple[Array, Array]:
    """First and total indices (d,) of a function of quantiles (n, d)."""
    found = stats.sobol_indices(
        func=lambda columns: function(columns.T)[None],
        n=points,
        dists=[stats.uniform()] * inputs,
        rng=np.random.default_rng(seed),
    )
    return np.asarray(found.first_order).reshape(inputs), np.asarray(found.total_order).reshape(inputs)


def _effects(joint: Joint, function: Function, points: int, seed: int) -> Array:
    """Shapley's effects (d + 1,) of a function, as shares of its variance."""
    random = np.random.default_rng(seed)
    count = joint.inputs + 1
    # Points of one sequence: of two, whatever their scrambling, those at one place go together.
    even = nested(2 * count, points, seed)
    sets, fresh = joint.placed(even[:, :count]), even[:, count:]
    values = function(sets)
    whole = float(values.var())
    # Known of nothing and of everything.
    explained = {bytes(count): 0.0, bytes([1] * count): whole}
    found = np.zeros(count)
    for order in (order for _ in range(ORDERS) for one in (random.permutation(count),) for order in (one, one[::-1])):
        known, before = np.zeros(count, dtype=bool), 0.0
        for place in order:
            known[place] = True
            if (key := known.tobytes()) not in explained:
                again = function(joint.redrawn(sets, known, fresh))
                # Half of what two sets with these inputs in common differ by is what the others make (Jansen 1999).
                explained[key] = whole - 0.5 * float(((values - again) ** 2).mean())
            found[place] += explained[key] - before
            before = explained[key]
    return found / (2 * ORDERS * whole)
