"""Drift of the figures over the counted turns: whether they have settled, and what a drift left over does to a mean.

Cages have slow regimes: loose ones change the way they whirl over 20 to 400 shaft turns, jumping at random moments, so no
curve fitted to a start tells where it leads. What can be tested is whether the counted turns drift. Each replicate
gives one difference between the figure of the later half and that of the earlier half; replicates are independent,
so Student's t of these differences needs no memory of the series (Heidelberger and Welch 1983, *Operations Research* 31,
1109, test a single series against its spectrum). The test is made on each figure and on the mean speed of the cage's
centre, which shows a change of regime first.

A drift d with standard error s that passes still hides a bias. Of a transient that at least halves from one half to the
next, the mean over both is off by at most 3 d/2; what of d stands above its noise, max(|d| - s, 0), counts so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.dynamics.batch_means import estimate, student_factor
from rbdyn.dynamics.equations import POCKET_LOAD
from rbdyn.dynamics.metrics import CAGE_SLIP, CAGE_SPEED, POWER_LOSS, WHIRL_DEVIATION_RATIO, Figure, Replicate

Array = NDArray[np.float64]

# Replicates from which their differences are tested as such; fewer are tested by batch means.
FEWEST_REPLICATES = 3
# Share of settled runs that a test of one figure lengthens in vain is one less this.
LEVEL = 0.9
# Mean of a transient that halves from half to half, over the difference of the halves: (1 + q)/(2 (1 - q)), q = 1/2.
BIAS_OF_DRIFT = 1.5


def _mean(sums: Array) -> Array:
    return sums[..., 1] / sums[..., 0]


# Batches, not impact windows: of these a run may hold one or two.
BATCH_IMPACT = Figure(
    lambda run: np.column_stack((run.durations, run.durations * run.largest[:, POCKET_LOAD]))[run.first :],
    _mean,
)
WHIRL_SPEED = Figure(lambda run: run.whirl[run.first :, :2], _mean)
TESTED = {
    "impact_force_N": BATCH_IMPACT,
    "whirl_deviation_ratio": WHIRL_DEVIATION_RATIO,
    "power_loss_W": POWER_LOSS,
    "cage_speed_rpm": CAGE_SPEED,
    "cage_slip": CAGE_SLIP,
    "whirl speed": WHIRL_SPEED,
}


class Drift(NamedTuple):
    """Later half of the counted part less the earlier one: mean over the replicates, its standard error, and the degrees
    of freedom of that."""

    size: float
    error: float
    freedom: int

    @property
    def significant(self) -> bool:
        """Whether the halves differ by more than their scatter."""
        return abs(self.size) > student_factor(self.freedom, LEVEL) * self.error

    @property
    def bias(self) -> float:
        """What the drift leaves in the mean of both halves."""
        return BIAS_OF_DRIFT * max(abs(self.size) - self.error, 0.0)


def drift_of(figure: Figure, runs: Sequence[Replicate]) -> Drift | None:
    """Drift of a figure over what is counted; None where that is too short to tell."""
    moments = [figure.moments(run) for run in runs]
    rows = min(len(part) for part in moments)
    half = rows // 2
    if half == 0:
        return None
    early, late = (
        [part[rows - 2 * half : rows - half] for part in moments],
        [part[-half:] for part in moments],
    )
    if len(runs) >= FEWEST_REPLICATES:
        change = np.array(
            [
                figure.of_sums(b.sum(axis=0)) - figure.of_sums(a.sum(axis=0))
                for a, b in zip(early, late, strict=True)
            ]
        )
        return Drift(float(change.mean()), float(change.std(ddof=1)) / math.sqrt(len(runs)), len(runs) - 1)
    before, after = (estimate(part, figure.of_sums) for part in (early, late))
    if before.half_width is None or after.half_width is None:
        return None
    freedom = max(len(runs) * half - 1, 1)
    error = math.hypot(before.half_width, after.half_width) / student_factor(freedom)
    return Drift(after.value - before.value, error, freedom)


def drifts(runs: Sequence[Replicate]) -> dict[str, Drift]:
    """Drift of every figure tested that can be told, by name."""
    found = {name: drift_of(figure, runs) for name, figure in TESTED.items()}
    return {name: drift for name, drift in found.items() if drift is not None}


def drifting(runs: Sequence[Replicate]) -> bool:
    """Whether any figure drifts beyond its scatter."""
    return any(drift.significant for drift in drifts(runs).values())
