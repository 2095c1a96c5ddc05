"""Numerical error of a statistic: a comparison with companions, a share of the replicates at another tolerance.

Chaos makes two runs from one start independent within a turn or so (correlations of pairs scatter about zero), so the
mean of all replicates is set against the mean of the companions, unpaired. A companion at a tenth of the tolerance is
dear, and the difference drowns in its noise. At ten times the tolerance it is cheap, and the bias is at least ten times
as large: from rtol 0.1 to 0.01 the impact of the bearing of Chen et al. 2022 goes from -0.57 to -0.05 +- 0.12 %, its whirl
from -4.0 to +0.1 +- 0.4 %, its loss from +0.025 to 0.000 +- 0.008 %. Of a difference d with the 95 % half-width w the bias
left at the tolerance of the run is d / 9 (Richardson, first order), known to w / 9; both count, as root sum of squares.
Where stability rules the steps, companions resolve more, and 10 d / 9 counts (``rbdyn.dynamics.companions``).
Companions scatter as the replicates do, and there are too few of them to tell: w is the half-width of the replicates
times sqrt(1 + n/m), for n turns counted of these and m of companions.

To the error of the power loss comes, likewise, what the power balance misses: input less losses less change of energy,
since integration errors act as one more loss that no law books and leave the input as it is.
"""

import math

from rbdyn.dynamics.statistics.batch_means import Estimate

FACTOR = 10.0
# The loosest tolerance that a scene may have; beyond it the power balance no longer tells anything.
LOOSEST = 0.1


def companion_tolerance(rtol: float) -> float:
    """Tolerance of the companions: ten times looser, or ten times tighter where that would be too loose."""
    return FACTOR * rtol if FACTOR * rtol <= LOOSEST * (1.0 + 1e-9) else rtol / FACTOR


def bias_scale(rtol: float) -> float:
    """Bias of replicates at ``rtol`` over their difference from companions."""
    return 1.0 / (FACTOR - 1.0) if companion_tolerance(rtol) > rtol else FACTOR / (FACTOR - 1.0)


def companion_error(ours: Estimate, theirs: float, times_fewer: float, share: float) -> float | None:
    """95 % bound of the bias of ``ours``: the ``share`` of its difference from companions with so many times fewer turns;
    None where ours has no half-width."""
    if ours.half_width is None:
        return None
    return share * math.hypot(ours.value - theirs, ours.half_width * math.sqrt(1.0 + times_fewer))
