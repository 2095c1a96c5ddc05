"""From what one replicate kept to the figures that are reported."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rbdyn.dynamics.equations import INNER_LOAD, LAND_LOAD, LOAD, LOSSES, OUTER_LOAD, SHAFT
from rbdyn.result import Quantity

SLOWEST_CAGE = 1e-6  # [rad/s]


@dataclass(frozen=True)
class Replicate:
    """One counted run. Times in s, works in J, loads in N.

    ``impact_windows``: largest roller/cage force of each whole window; ``whirl``: samples, sum and sum of squares of
    the cage centre's speed; ``work``: integrals of the loss powers, then of those that come in by shafts and loads;
    ``energy_change``: of kinetic, elastic and load energy together; ``energy_scale``: contact load times approach, at least;
    ``stiffness``: as in ``runge_kutta.Carry``.
    """

    duration: float
    impact_windows: NDArray[np.float64]
    whirl: NDArray[np.float64]
    work: NDArray[np.float64]
    largest: NDArray[np.float64]
    cage_angle: float
    kinematic_cage_speed: float
    energy_change: float
    energy_scale: float
    accepted_steps: int
    rejected_steps: int
    derivatives: int
    cpu_s: float
    method: str = "rk45"
    stiffness: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    @property
    def impact_force(self) -> float:
        """Mean over the windows of the largest roller/cage force [N]."""
        return float(self.impact_windows.mean())

    @property
    def whirl_deviation_ratio(self) -> float:
        """Standard deviation over mean of the cage centre's speed (Ghaisas et al. 2004); 0 for a cage at rest."""
        samples, total, squares = self.whirl
        if samples < 2 or total == 0.0:
            return 0.0
        mean = total / samples
        variance = max(squares / samples - mean**2, 0.0) * samples / (samples - 1)
        return float(math.sqrt(variance) / mean)

    @property
    def power_loss(self) -> float:
        """Mean power turned into heat [W]."""
        return float(self.work[:SHAFT].sum() / self.duration)

    @property
    def cage_speed(self) -> float:
        """Mean cage speed [rad/s]."""
        return self.cage_angle / self.duration

    @property
    def cage_slip(self) -> float:
        """1 - cage speed over kinematic cage speed; 0 where counter-rotation leaves the cage no speed to fall behind."""
        if abs(self.kinematic_cage_speed) < SLOWEST_CAGE:
            return 0.0
        return 1.0 - self.cage_speed / self.kinematic_cage_speed

    @property
    def power_gap(self) -> float:
        """Work put in less losses less change of energy, relative to the largest of them."""
        put_in, lost = self.work[SHAFT] + self.work[LOAD], self.work[:SHAFT].sum()
        gap = put_in - lost - self.energy_change
        return float(abs(gap) / max(abs(put_in), abs(lost), abs(self.energy_change), self.energy_scale))

    def power(self, term: str) -> float:
        """Mean power [W] of one loss."""
        return float(self.work[LOSSES.index(term)] / self.duration)

    @property
    def max_inner_load(self) -> float:
        """Largest load between a roller and the inner race [N]."""
        return float(self.largest[INNER_LOAD])

    @property
    def max_outer_load(self) -> float:
        """Largest load between a roller and the outer race [N]."""
        return float(self.largest[OUTER_LOAD])

    @property
    def max_land_load(self) -> float:
        """Largest dry load between cage and guide land [N]."""
        return float(self.largest[LAND_LOAD])


def quantity(
    figure: Callable[[Replicate], float], replicates: Sequence[Replicate], companions: Sequence[Replicate]
) -> Quantity:
    """A figure with its 95 % errors.

    Statistical: Student's t over replicates, which are independent (each has its own seeded start). Numerical: the
    mean change when every replicate is repeated at a tenth of the tolerance, plus the 95 % half-width of that mean,
    since chaos makes the two runs of a pair all but independent; so an upper bound. None where it was not estimated.
    """
    values = np.array([figure(run) for run in replicates])
    statistical = student_half_width(values)
    numerical = None
    if companions:
        change = np.array([figure(run) for run in companions]) - values
        numerical = float(abs(change.mean())) + (student_half_width(change) or 0.0)
    return Quantity(float(values.mean()), statistical, numerical)


def student_half_width(values: NDArray[np.float64]) -> float | None:
    """Half-width of the 95 % interval of a mean of independent values; None for fewer than two."""
    from scipy.special import stdtrit

    count = len(values)
    if count < 2:
        return None
    return float(stdtrit(count - 1, 0.975) * values.std(ddof=1) / math.sqrt(count))
