"""Numerical error of a statistic: a comparison with companions, a share of the replicates at another tolerance.

Chaos makes two runs from one start independent within a turn or so (correlations of pairs scatter about zero), so the
mean of all replicates is set against the mean of the companions, unpaired, and the half-width of their difference
counts as error. A companion at a tenth of the tolerance is dear, and the difference drowns in its half-width. At ten
times the tolerance it is cheap, and the bias is ten times as large: of a difference d the bias left at the tolerance
of the run is d / (r - 1), where r is the ratio of the biases (Richardson). r is taken as the ratio of the
tolerances, first order, though the power gap falls with rtol^1.2; where the power gap falls more slowly, r is its
ratio. For an order that is assumed, not observed, the bound is three times that (grid convergence index: Roache 1994,
*Journal of Fluids Engineering* 116, 405).

The power loss needs no companion. Its bias is what the power balance misses: input less losses less change of energy,
since integration errors act as one more loss that no law books and leave the input as it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from rbdyn.dynamics.batch_means import Estimate

if TYPE_CHECKING:
    from rbdyn.dynamics.metrics import Replicate

FACTOR = 10.0
# The loosest tolerance that a scene may have; beyond it the power balance no longer tells anything.
LOOSEST = 0.1
SAFETY = 3.0
# A power gap that hardly falls with the tolerance promises nothing better than this ratio of the biases.
SMALLEST_RATIO = 2.0


def companion_tolerance(rtol: float) -> float:
    """Tolerance of the companions: ten times looser, or ten times tighter where that would be too loose."""
    return FACTOR * rtol if FACTOR * rtol <= LOOSEST * (1.0 + 1e-9) else rtol / FACTOR


class Comparison(NamedTuple):
    """Mean sizes of the relative power gaps of the replicates and of their companions; whether these are looser."""

    gap: float
    companion_gap: float
    looser: bool

    @property
    def scale(self) -> float:
        """Bound of the bias over the difference between replicates and companions."""
        if not self.looser:
            return FACTOR / (FACTOR - 1.0)
        observed = self.companion_gap / self.gap if self.gap > 0.0 else FACTOR
        return SAFETY / (min(max(observed, SMALLEST_RATIO), FACTOR) - 1.0)


def compare(runs: Sequence[Replicate], companions: Sequence[Replicate], rtol: float) -> Comparison:
    """How far companions of replicates at ``rtol`` tell of their bias."""
    return Comparison(mean_gap(runs), mean_gap(companions), companion_tolerance(rtol) > rtol)


def mean_gap(runs: Sequence[Replicate]) -> float:
    """Size of the mean relative gap of the power balance: what is left of it when replicates are averaged."""
    return abs(sum(run.signed_power_gap for run in runs)) / len(runs)


def companion_error(ours: Estimate, theirs: Estimate, comparison: Comparison) -> float | None:
    """95 % bound of the bias of ``ours``; None where either has no half-width."""
    if ours.half_width is None or theirs.half_width is None:
        return None
    difference = abs(ours.value - theirs.value) + math.hypot(ours.half_width, theirs.half_width)
    return comparison.scale * difference


def missing_power(runs: Sequence[Replicate]) -> float:
    """Power [W] that the balance misses on the mean of all replicates: the numerical error of the power loss."""
    return abs(sum(run.missing_work for run in runs)) / sum(run.duration for run in runs)
