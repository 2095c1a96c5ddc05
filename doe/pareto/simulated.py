"""A front whose points were run on the simulator: fresh runs that had no part in the choice of the points are its figures."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from doe.pareto.goals import Goals
from doe.pareto.search import hypervolume
from rbdyn.base.arrays import Array, Mask

DRAWS = 200  # of the noise of a front


class Samples(NamedTuple):
    """Points (n, k) run, their responses (n, m) and standard errors (n, m); rows of NaN where a run failed."""

    points: Array
    values: Array
    errors: Array

    @property
    def failed(self) -> Mask:
        """Whether each point's run failed, (n,)."""
        return np.asarray(np.isnan(self.values).any(axis=1))

    def rows(self, which: Any) -> "Samples":
        """Some of them."""
        return Samples(*(part[which] for part in self))


@dataclass(frozen=True, eq=False)
class SimulatedFront:
    """Front of a noisy simulator, in ascending order of the first cost as it was selected.

    ``points`` (f, k); ``values`` and ``standard_errors`` (f, m) of ``repeats`` fresh runs each, which had no part in
    the selection, and their ``costs`` (f, q) and ``cost_errors`` (f, q). ``optimism`` (q,) is how much too small the
    search believed these to be on average, in shares of their range. ``searched`` are all runs of the search. ``pick``
    is a row. ``failures`` (x, k) are the points where a run failed.
    ``freedom`` (f, m): degrees of freedom of the standard errors, infinitely many unless given.
    """

    points: Array
    values: Array
    standard_errors: Array
    costs: Array
    cost_errors: Array
    optimism: Array
    pick: int
    pick_reason: str
    baseline_values: Array | None
    repeats: int
    failures: Array
    evaluations: int
    generations: int
    seed: int
    goals: Goals
    searched: Samples
    freedom: Array | None = None

    def quantile(self, probability: float) -> Array:
        """Student's quantile (f, m) of a probability, at the degrees of freedom of the standard errors."""
        freedom = np.full_like(self.values, np.inf) if self.freedom is None else self.freedom
        return np.asarray(special.stdtrit(freedom, probability))

    @property
    def half_widths(self) -> Array:
        """95 % half-widths (f, m) of the values."""
        return self.standard_errors * self.quantile(0.975)


def noisy_hypervolume(
    costs: Array, errors: Array, ideal: Array, nadir: Array, draws: int, seed: int = 1
) -> tuple[float, float]:
    """Hypervolume of means (n, q) with standard errors (n, q), and its standard error.

    Noise pushes a hypervolume up, for the lucky ones stand out. Draws of the noise show by how much, and that is taken
    off (parametric bootstrap: Efron and Tibshirani, An Introduction to the Bootstrap, section 10.6).
    """
    random = np.random.default_rng(seed)
    believed = hypervolume(costs, ideal, nadir)
    noisy = [hypervolume(costs + errors * random.standard_normal(costs.shape), ideal, nadir) for _ in range(draws)]
    return 2.0 * believed - float(np.mean(noisy)), float(np.std(noisy, ddof=1))
