"""The range of an output over its unknown inputs, the part of it that is simulation noise, and the inputs that cause it.

Runs at n input sets scatter for three causes: their inputs, their own statistical error, and the integration. The variance
due to the inputs is the remainder of the whole, V_in = s^2(y) - mean s_i^2 - numerical variance. An emulator covers some of the
inputs. The others vary in every run all the same and count as scatter, whose size is in the emulator's nugget.

The range over all inputs uses the emulator's mean as a control variate: its distribution over many fresh input sets, with a
residual added to each. That distribution is corrected by the difference, at the runs, between their own distribution and the
emulator's, each run predicted by the others. If an emulator predicts nothing, the order statistics of the runs remain.
Residuals are shrunk by the share of them that is noise.

Sobol' indices of independent inputs: the first-order index is the share of the output's variance that would vanish if the input
were known. The total index is the share that would remain if all others were known. Both are by scipy's Saltelli scheme on the emulator's
mean, as shares of the variance over all inputs; inputs outside the emulator and its own error are part of the whole. An input
that does nothing shows the effect of chance. Intervals are by parametric bootstrap: functions drawn from the emulator replace
the truth, are sampled with fresh noise, and are emulated anew from the last hyperparameters on. The mean of the errors of their
indices is subtracted as bias, their scatter is the error.

Shapley's effects share the variance among inputs that depend on each other, for which Sobol' indices mean nothing. An effect is
the increase in the explained variance, Var E[y | known inputs], on average over all orders in which the inputs become known.

Sources: Hsu and Nelson, Control variates for quantile estimation, Management Science 36 (1990) 835; Saltelli et al., Computer
Physics Communications 181 (2010) 259; Marrel et al., Reliability Engineering and System Safety 94 (2009) 742; Song, Nelson and
Staum, SIAM/ASA J. Uncertainty Quantification 4 (2016) 1060; Broto, Bachoc and Depecker, SIAM/ASA J. Uncertainty Quantification
8 (2020) 693 (nearest neighbours in place of conditional draws).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from doe.emulator import Emulator, fit_emulator, pooled_variances
from doe.unknown.inputs import Joint, nested, strongest
from rbdyn.base.arrays import Array, Whole, one_thread
from rbdyn.base.records import Record

# An emulator is trusted that predicts this share of what noise leaves to predict.
TRUSTED = 0.8
# Ends of a range and its middle, in the order of two forms, and how many resamplings give the errors of the ends.
ENDS, MEDIAN_FIRST, REWEIGHTINGS = (0.05, 0.5, 0.95), (0.5, 0.05, 0.95), 64


class Share(NamedTuple):
    """A share of cases or of a variance, and the ends of its interval."""

    value: float
    low: float
    high: float

    @property
    def of_hundred(self) -> str:
        """'87 (80 to 92)': in how many of 100 cases, with the ends of the interval."""
        value, low, high = (100.0 * number for number in self)
        return f"{value:.0f} ({low:.0f} to {high:.0f})"


class Runs(Record, eq=False):
    """Runs at quantiles (n, d) of their inputs.

    values, variances, freedom : (n,), outputs, their variances by replicates, and the degrees of freedom of these
    numerical : variance due to the integration
    """

    quantiles: Array
    values: Array
    variances: Array
    freedom: Whole
    numerical: float = 0.0


class Emulated(Record, eq=False):
    """Emulator of an output over the quantiles of its inputs at ``columns``.

    logarithmic : whether it emulates logarithms, as it does if all outputs are positive
    noise : mean variance of a run's output by its replicates, smoothed over the inputs
    q2, ceiling : share of the variance that it predicts of left-out runs, and the most that their noise allows
    """

    emulator: Emulator
    columns: Whole
    logarithmic: bool
    noise: float
    q2: float
    ceiling: float

    @property
    def trusted(self) -> bool:
        """Whether it predicts runs about as well as their noise allows."""
        return self.ceiling > 0.0 and self.q2 >= TRUSTED * self.ceiling

    def __call__(self, quantiles: Array) -> Array:
        """The output (n,) at quantiles (n, d) of all inputs."""
        return self.at_columns(quantiles[:, self.columns])

    def at_columns(self, quantiles: Array) -> Array:
        """The output (n,) at quantiles (n, c) of the inputs that the emulator covers."""
        return self.back(self.emulator.mean(quantiles))

    def back(self, values: Array) -> Array:
        """Outputs from values of the emulator."""
        return np.exp(values) if self.logarithmic else values

    @cached_property
    def residuals(self) -> Array:
        """Residuals (n,) of each run predicted by the others, in values of the emulator, shrunk by their share of noise."""
        missed = self.emulator.values - self.emulator.leave_one_out()[0]
        total = float((missed**2).mean())
        return missed * np.sqrt(residual_variance(self.emulator) / total) if total > 0.0 else missed


def residual_variance(emulator: Emulator) -> float:
    """Variance of these residuals without noise: due to inputs outside the emulator, and to its own error."""
    missed = emulator.values - emulator.leave_one_out()[0]
    return max(float((missed**2).mean() - emulator.variances.mean()), 0.0)


class Range(Record):
    """5 %, 50 % and 95 % quantiles of an output over its inputs, and the standard errors of these."""

    low: float
    median: float
    high: float
    errors: tuple[float, ...]

    @property
    def relative_error(self) -> float:
        """Standard error of the less accurate end over the width of the range; infinite without a range."""
        width = self.high - self.low
        return max(self.errors[0], self.errors[2]) / width if width > 0.0 else np.inf


@one_thread
def emulated(runs: Runs, most: int | None = None, always: Sequence[int] = (), logarithms: bool = True) -> Emulated:
    """Emulator of the runs, with their variances smoothed over the inputs.

    most, always : inputs that it covers at most, all unless stated: those ``always``, then the ones that matter most here
    logarithms : whether outputs that are all positive are emulated by their logarithms

    Raises ValueError for fewer than two runs.
    """
    logarithmic = logarithms and bool((runs.values > 0.0).all())
    values = np.log(runs.values) if logarithmic else runs.values
    unit = runs.values**2 if logarithmic else np.ones(len(values))
    smooth = pooled_variances(runs.quantiles, runs.variances / unit, runs.freedom)
    columns = np.arange(runs.quantiles.shape[1])
    if most is not None:
        # The last input does nothing and stays for comparison.
        columns = np.array([*strongest(runs.quantiles[:, :-1], values[:, None], most, always), columns[-1]])
    emulator = fit_emulator(runs.quantiles[:, columns], values, smooth, trend="linear")
    total = float(values.var(ddof=1))
    ceiling = 1.0 - float(smooth.mean()) / total if total > 0.0 else 0.0
    return Emulated(emulator, columns, logarithmic, float((smooth * unit).mean()), emulator.q2(), ceiling)


class VarianceShares(Record):
    """Shares of the variance of single runs by cause; 0 of the inputs where noise exceeds it."""

    simulation: float
    numerical: float
    inputs: float


def variance_by_cause(runs: Runs, fitted: Emulated) -> VarianceShares:
    """What causes the variance of single runs."""
    variances = fitted.noise, runs.numerical, max(float(runs.values.var(ddof=1)) - fitted.noise - runs.numerical, 0.0)
    total = sum(variances) or 1.0
    return VarianceShares(*(variance / total for variance in variances))


@one_thread
def range_of(fitted: Emulated, fresh: Array, seed: int) -> Range:
    """Range of an output; ``fresh``: quantiles (m, d) of many input sets of the same distribution as those of the runs."""
    ends, errors = _quantiles(fitted, fresh, np.random.default_rng(seed))
    low, median, high = ends.tolist()
    return Range(low, median, high, tuple(errors.tolist()))


def _quantiles(fitted: Emulated, fresh: Array, random: np.random.Generator) -> tuple[Array, Array]:
    """The output at the ends and the middle of its range, and standard errors of these by resampling runs."""
    residuals, others = fitted.residuals, fitted.emulator.leave_one_out()[0]
    count = len(residuals)
    values = np.sort(fitted.emulator.mean(fresh[:, fitted.columns]) + random.choice(residuals, len(fresh)))
    emulator = (np.arange(len(values)) + 0.5) / len(values)
    runs = (others + residuals)[:, None] <= values
    control = np.searchsorted(np.sort(residuals), values - others[:, None], side="right") / count
    off = runs - control
    # Between these ends of so few runs are 90 % of further input sets on average (Wilks 1941).
    levels = (np.array(ENDS) * (count + 1) - 0.5) / count
    # A distribution that the correction makes non-monotonic is sorted (Chernozhukov, Fernandez-Val and Galichon 2010).
    ends = [
        np.interp(levels, np.sort(emulator + weights @ off / count), values)
        for weights in (np.ones(count), *random.multinomial(count, np.full(count, 1.0 / count), REWEIGHTINGS))
    ]
    ends, *again = fitted.back(np.array(ends))
    return ends, np.std(again, axis=0, ddof=1)


# Points of an index (a power of two), refits of its interval, and the share of cases that the interval should hold.
POINTS, POINTS_OF_REFITS, REFITS, SHARE_LEVEL = 1024, 256, 16, 0.9
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
    ends = _with_intervals(fitted, lambda *setting: np.array(_indices(inputs, *setting)), even, seed)
    first, total = ([Share(*map(float, ends[:, kind, column])) for column in range(inputs)] for kind in (0, 1))
    return Indices(first, total)


@one_thread
def shapley(fitted: Emulated, joint: Joint, seed: int) -> list[Share]:
    """Shapley's effects of the dependent inputs of an emulator and, as the last, of an input that does nothing.

    Their sum is the share of the variance that the emulator explains.
    """
    # Rows of a sample are not evenly spread, so more points are needed.
    ends = _with_intervals(fitted, lambda *setting: _effects(joint, *setting), joint.sets, seed, 4 * POINTS)
    return [Share(*map(float, column)) for column in ends.T]


def explained(fitted: Emulated, values: Array, residual: float) -> float:
    """Share of an output's variance over all inputs that the emulator explains.

    values : (n,), of the emulator at input sets of their distribution
    rest : variance that residuals add in values of the emulator
    """
    mean, square = float(values.mean()), float((values**2).mean())
    # Of y = g exp(e) with normal e: E[y | g] = g exp(rest/2), E[y^2] = E[g^2] exp(2 rest).
    total = np.exp(residual) * square - mean**2 if fitted.logarithmic else square - mean**2 + residual
    return (square - mean**2) / total if total > 0.0 else 0.0


def _with_intervals(fitted: Emulated, measure: Measure, sample: Sample, seed: int, points: int = POINTS) -> Array:
    """Shares (3, ...) of the variance over all inputs, with the ends of their intervals."""
    random, emulator = np.random.default_rng(seed), fitted.emulator

    def shares(function: Function, residual: float, count: int, seed: int) -> Array:
        return measure(function, count, seed) * explained(fitted, function(sample(count, seed)), residual)

    usual = shares(fitted.at_columns, residual_variance(emulator), points, seed)
    noise = np.sqrt(emulator.variances + emulator.hyperparameters.nugget)
    like: dict[str, Any] = {"trend": "linear", "start": emulator.hyperparameters}
    misses = []
    for again in range(REFITS):
        truth = emulator.draw(1, random)
        values = truth(emulator.points)[0] + noise * random.standard_normal(noise.size)
        refit = replace(fitted, emulator=fit_emulator(emulator.points, values, emulator.variances, **like))
        simulated: Function = lambda quantiles, truth=truth: fitted.back(truth(quantiles)[0])  # type: ignore[misc]  # noqa: E731
        # Both by the same points, whose own error then almost cancels in the difference.
        by = POINTS_OF_REFITS, seed + 1 + again
        ours = shares(refit.at_columns, residual_variance(refit.emulator), *by)
        misses.append(ours - shares(simulated, emulator.hyperparameters.nugget, *by))
    middle = usual - np.mean(misses, axis=0)
    student = stats.t.ppf(0.5 + 0.5 * SHARE_LEVEL, REFITS - 1)
    half = student * np.std(misses, axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / REFITS)
    return np.stack([middle, middle - half, middle + half]).clip(0.0, 1.0)


def _indices(inputs: int, function: Function, points: int, seed: int) -> tuple[Array, Array]:
    """First and total indices (d,) of a function of quantiles (n, d)."""
    indices = stats.sobol_indices(
        func=lambda columns: function(columns.T)[None],
        n=points,
        dists=[stats.uniform()] * inputs,
        rng=np.random.default_rng(seed),
    )
    return np.asarray(indices.first_order).reshape(inputs), np.asarray(indices.total_order).reshape(inputs)


def _effects(joint: Joint, function: Function, points: int, seed: int) -> Array:
    """Shapley's effects (d + 1,) of a function, as shares of its variance."""
    random = np.random.default_rng(seed)
    count = joint.inputs + 1
    # Points of one sequence, as those of two are correlated, however they are scrambled.
    even = nested(2 * count, points, seed)
    sets, fresh = joint.placed(even[:, :count]), even[:, count:]
    values = function(sets)
    total = float(values.var())
    # Variance explained by no input and by all of them.
    explained = {bytes(count): 0.0, bytes([1] * count): total}
    effects = np.zeros(count)
    for order in (
        order for _ in range(ORDERS) for drawn in (random.permutation(count),) for order in (drawn, drawn[::-1])
    ):
        subset, before = np.zeros(count, dtype=bool), 0.0
        for place in order:
            subset[place] = True
            if (key := subset.tobytes()) not in explained:
                again = function(joint.redrawn(sets, subset, fresh))
                # Half of the mean square difference of two sets with these inputs in common is due to the others (Jansen 1999).
                explained[key] = total - 0.5 * float(((values - again) ** 2).mean())
            effects[place] += explained[key] - before
            before = explained[key]
    return effects / (2 * ORDERS * total)
