"""What an output ranges over while its inputs are not known, and how much of that is noise of the simulation.

Runs at n input sets scatter for three causes: their inputs, their own statistical error, and the integration. The variance
that the inputs make is what is left of the whole, V_in = s^2(y) - mean s_i^2 - numerical variance. Where an emulator
foretells the runs about as well as their noise allows, the range is that of its mean over many fresh input sets;
elsewhere it is that of the runs, shrunk about their mean by sqrt(V_in/s^2(y)).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from doe.arrays import Array, Whole
from doe.emulator import Emulator, fit_emulator, pooled_variances
from doe.threads import one_thread

# An emulator is trusted that foretells this share of what noise leaves to foretell.
TRUSTED = 0.8
# Ends of the range, and how many draws or resamplings tell their errors.
ENDS, DRAWS = (0.05, 0.5, 0.95), 24


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
    """Emulator of an output over the quantiles of its inputs, of its logarithm where all runs are positive; ``noise``: mean
    variance of a run's output by its replicates, smoothed over the inputs."""

    emulator: Emulator
    logarithmic: bool
    noise: float
    q2: float
    ceiling: float

    @property
    def trusted(self) -> bool:
        """Whether it foretells runs about as well as their noise allows."""
        return self.ceiling > 0.0 and self.q2 >= TRUSTED * self.ceiling

    def __call__(self, quantiles: Array) -> Array:
        """The output (n,) at quantiles (n, d)."""
        return self.back(self.emulator.mean(quantiles))

    def draws(self, quantiles: Array, count: int, random: np.random.Generator) -> Array:
        """Outputs (count, n) of functions that the runs might as well have come from."""
        return self.back(self.emulator.draw(count, random)(quantiles))

    def back(self, values: Array) -> Array:
        """Outputs of the emulator's values."""
        return np.exp(values) if self.logarithmic else values


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
def emulated(runs: Runs) -> Emulated:
    """Emulator of the runs, their variances smoothed over the inputs. Raises ValueError for fewer than two runs."""
    logarithmic = bool((runs.values > 0.0).all())
    values = np.log(runs.values) if logarithmic else runs.values
    unit = runs.values**2 if logarithmic else np.ones(len(values))
    smooth = pooled_variances(runs.quantiles, runs.variances / unit, runs.freedom)
    emulator = fit_emulator(runs.quantiles, values, smooth, trend="linear")
    whole = float(values.var(ddof=1))
    ceiling = 1.0 - float(smooth.mean()) / whole if whole > 0.0 else 0.0
    return Emulated(emulator, logarithmic, float((smooth * unit).mean()), emulator.q2(), ceiling)


@one_thread
def spread_of(runs: Runs, fitted: Emulated, fresh: Array, seed: int) -> Spread:
    """Range of an output; ``fresh``: quantiles (m, d) of many input sets as likely as those of the runs."""
    random = np.random.default_rng(seed)
    whole = float(runs.values.var(ddof=1))
    left = max(whole - fitted.noise - runs.numerical, 0.0)
    shares = {"simulation": fitted.noise, "numerical": runs.numerical, "inputs": left}
    total = sum(shares.values()) or 1.0
    shares = {name: value / total for name, value in shares.items()}
    if fitted.trusted:
        ends = np.quantile(fitted(fresh), ENDS)
        others = np.quantile(fitted.draws(fresh[:2048], DRAWS, random), ENDS, axis=1)
    else:
        shrink = np.sqrt(left / whole) if whole > 0.0 else 0.0
        ends = np.quantile(_shrunk(runs.values, shrink), ENDS)
        resampled = random.choice(runs.values, (DRAWS, len(runs.values)))
        others = np.quantile(_shrunk(resampled, shrink), ENDS, axis=1)
    errors = tuple(others.std(axis=1, ddof=1).tolist())
    by_emulator = fitted.trusted, fitted.q2, fitted.ceiling
    low, median, high = ends.tolist()
    return Spread(low, median, high, errors, shares, left == 0.0, *by_emulator)


def _shrunk(values: Array, by: float) -> Array:
    middle = values.mean(axis=-1, keepdims=True)
    return middle + by * (values - middle)
