"""What an output ranges over while its inputs are not known, and how much of that is noise of the simulation.

Runs at n input sets scatter for three causes: their inputs, their own statistical error, and the integration. The variance
that the inputs make is what is left of the whole, V_in = s^2(y) - mean s_i^2 - numerical variance. An emulator covers some
of the inputs; the others vary in every run all the same and count as scatter, of which the emulator's nugget holds the size.

The range over all inputs has the emulator's mean for a control: its distribution over many fresh input sets, with a residual
added to each, is moved by as much as the runs' own distribution lies off what the emulator makes of these very runs, each
predicted by the others. An emulator that predicts nothing leaves the order statistics of the runs. Residuals are drawn together
by what of them is noise.

Source: Hsu and Nelson, Control variates for quantile estimation, Management Science 36 (1990) 835.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from doe.arrays import Array, Whole
from doe.emulator import Emulator, fit_emulator, pooled_variances
from doe.threads import one_thread
from doe.unknown.screening import strongest

# An emulator is trusted that predicts this share of what noise leaves to predict.
TRUSTED = 0.8
# Ends of the range, and how many resamplings give their errors.
ENDS, DRAWS = (0.05, 0.5, 0.95), 64


class Share(NamedTuple):
    """A share of cases or of a variance, and the ends of its interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Runs:
    """Outputs (n,) of runs at quantiles (n, d) of their inputs; variances (n,) of these outputs by their replicates, and the
    degrees of freedom (n,) behind those; ``numerical``: variance that the integration adds."""

    quantiles: Array
    values: Array
    variances: Array
    freedom: Whole
    numerical: float = 0.0


@dataclass(frozen=True, eq=False)
class Emulated:
    """Emulator of an output over the quantiles of its inputs at ``columns``, of its logarithm where all runs are positive;
    ``noise``: mean variance of a run's output by its replicates, smoothed over the inputs."""

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
        """Outputs of the emulator's values."""
        return np.exp(values) if self.logarithmic else values

    @cached_property
    def residuals(self) -> Array:
        """What the other runs leave open of each (n,), in the emulator's values, drawn together by what of it is noise."""
        missed = self.emulator.values - self.emulator.leave_one_out()[0]
        whole = float((missed**2).mean())
        return missed * np.sqrt(residual_variance(self.emulator) / whole) if whole > 0.0 else missed


def residual_variance(emulator: Emulator) -> float:
    """Variance of what the other runs leave open of each, less that of noise: of inputs outside the emulator, and its own error."""
    missed = emulator.values - emulator.leave_one_out()[0]
    return max(float((missed**2).mean() - emulator.variances.mean()), 0.0)


@dataclass(frozen=True)
class Spread:
    """Range of an output over its inputs: its 5 %, 50 % and 95 % ends with their standard errors; shares of the variance of
    single runs; whether the inputs show above the noise."""

    low: float
    median: float
    high: float
    errors: tuple[float, ...]
    variance: dict[str, float]
    hidden: bool
    by_emulator: bool
    q2: float
    ceiling: float

    @property
    def known(self) -> float:
        """Standard error of the worse known end over the width of the range; infinite without a range."""
        width = self.high - self.low
        return max(self.errors[0], self.errors[2]) / width if width > 0.0 else np.inf


@one_thread
def emulated(runs: Runs, most: int | None = None, always: Sequence[int] = (), logarithms: bool = True) -> Emulated:
    """Emulator of the runs, their variances smoothed over the inputs.

    ``most``: inputs that it covers at most, those ``always`` and the ones that matter most in these runs; all unless given.
    ``logarithms``: whether outputs that are all positive are emulated by theirs. Raises ValueError for fewer than two runs.
    """
    logarithmic = logarithms and bool((runs.values > 0.0).all())
    values = np.log(runs.values) if logarithmic else runs.values
    unit = runs.values**2 if logarithmic else np.ones(len(values))
    smooth = pooled_variances(runs.quantiles, runs.variances / unit, runs.freedom)
    columns = np.arange(runs.quantiles.shape[1])
    if most is not None:
        # The last is an input that does nothing, which stays for comparison.
        columns = np.array([*strongest(runs.quantiles[:, :-1], values[:, None], most, always), columns[-1]])
    emulator = fit_emulator(runs.quantiles[:, columns], values, smooth, trend="linear")
    whole = float(values.var(ddof=1))
    ceiling = 1.0 - float(smooth.mean()) / whole if whole > 0.0 else 0.0
    return Emulated(emulator, columns, logarithmic, float((smooth * unit).mean()), emulator.q2(), ceiling)


@one_thread
def spread_of(runs: Runs, fitted: Emulated, fresh: Array, seed: int) -> Spread:
    """Range of an output; ``fresh``: quantiles (m, d) of many input sets as likely as those of the runs."""
    random = np.random.default_rng(seed)
    whole = float(runs.values.var(ddof=1))
    left = max(whole - fitted.noise - runs.numerical, 0.0)
    shares = {"simulation": fitted.noise, "numerical": runs.numerical, "inputs": left}
    total = sum(shares.values()) or 1.0
    shares = {name: value / total for name, value in shares.items()}
    ends, errors = _quantiles(fitted, fresh, random)
    by_emulator = fitted.trusted, fitted.q2, fitted.ceiling
    low, median, high = ends.tolist()
    return Spread(low, median, high, tuple(errors.tolist()), shares, left == 0.0, *by_emulator)


def _quantiles(fitted: Emulated, fresh: Array, random: np.random.Generator) -> tuple[Array, Array]:
    """The output at the ends and the middle of its range, and standard errors of these by resampling runs."""
    rest, others = fitted.residuals, fitted.emulator.leave_one_out()[0]
    count = len(rest)
    values = np.sort(fitted.emulator.mean(fresh[:, fitted.columns]) + random.choice(rest, len(fresh)))
    emulator = (np.arange(len(values)) + 0.5) / len(values)
    runs = (others + rest)[:, None] <= values
    control = np.searchsorted(np.sort(rest), values - others[:, None], side="right") / count
    off = runs - control
    # Between ends known from so few runs 90 % of further sets lie on average (Wilks 1941).
    levels = (np.array(ENDS) * (count + 1) - 0.5) / count
    # A distribution that a correction bends back is put in order (Chernozhukov, Fernandez-Val and Galichon 2010).
    found = [
        np.interp(levels, np.sort(emulator + weights @ off / count), values)
        for weights in (np.ones(count), *random.multinomial(count, np.full(count, 1.0 / count), DRAWS))
    ]
    ends, *again = fitted.back(np.array(found))
    return ends, np.std(again, axis=0, ddof=1)
