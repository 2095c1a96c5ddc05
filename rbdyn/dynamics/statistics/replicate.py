"""One run in batches, and figures as functions of sums over its batches."""

from collections.abc import Callable
from dataclasses import field, replace
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Complex
from rbdyn.base.records import Record
from rbdyn.losses import INNER_ROLLING, LOAD, POWER_TERMS, SHAFT


class Replicate(Record):
    """One run in batches. Times in s, works and energies in J, loads in N, angles in rad.

    Arrays over batches, from the start on; figures count from the batch ``first``, and ``per_window`` batches make an
    impact window.

    - ``whirl``: samples, sum and sum of squares of the speed of the cage's centre
    - ``orbit``: samples, sums of the places x, y of the cage's centre and of x^2 + y^2
    - ``work``: integrals of the powers in the order of ``POWER_TERMS`` and what follows there
    - ``largest``: loads in the order of ``forces.state``
    - ``pocket_width``: full Hertz width of a pocket's contact over the root of the force of all pockets [m/sqrt N]
    - ``impacts``: sums of each pocket (batches, rollers, sums) in the order of ``forces.state``
    - ``races``: samples of the races and entries (batches, quantities, sums), as there
    - ``energy``: kinetic, elastic and potential energy together, at the ends of batches
    - ``energy_scale``: load of a contact times its approach
    - ``stiffness``: as in ``advance.Carry``
    - ``group``: of its start, as in ``parameters.state``
    - ``cage_path``: of the cage's centre about its guide [m], complex, evenly in time; empty where it was not traced
    - ``traced``: samples of it in each batch, and those with a loaded contact of the inner race
    - ``end``: its last state, from which it can go on
    """

    first: int
    per_window: int
    durations: Array
    whirl: Array
    work: Array
    largest: Array
    cage_angle: Array
    kinematic_angle: Array
    energy: Array
    energy_scale: float
    accepted_steps: int
    rejected_steps: int
    derivatives: int
    cpu_s: float
    method: str = "rk45"
    stiffness: Array = field(default_factory=lambda: np.zeros(3))
    orbit: Array = field(default_factory=lambda: np.zeros((0, 4)))
    impacts: Array = field(default_factory=lambda: np.zeros((0, 0, 4)))
    races: Array = field(default_factory=lambda: np.zeros((0, 0, 2)))
    pocket_width: float = 0.0
    group: int = 0
    cage_path: Complex = field(default_factory=lambda: np.zeros(0, complex))
    traced: Array = field(default_factory=lambda: np.zeros((0, 2)))
    end: Array = field(default_factory=lambda: np.zeros(0))

    def counted_from(self, first: int) -> "Replicate":
        """The same run, counted from another batch."""
        return replace(self, first=first)

    @property
    def duration(self) -> float:
        """Time counted [s]."""
        return float(self.durations[self.first :].sum())

    def windows(self, force: int) -> Array:
        """Largest load of each whole impact window [N], by its place in the load vector."""
        forces = self.largest[self.first :, force]
        windows = len(forces) // self.per_window
        return forces[: windows * self.per_window].reshape(windows, self.per_window).max(axis=1)

    def _works(self) -> tuple[float, float, float]:
        """Work put in, work lost, change of energy [J]."""
        work = self.work[self.first :].sum(axis=0)
        return work[SHAFT] + work[LOAD], work[:SHAFT].sum(), self.energy[-1] - self.energy[self.first]

    @property
    def missing_work(self) -> float:
        """Work put in less losses less change of energy [J]."""
        put_in, lost, change = self._works()
        return float(put_in - lost - change)

    @property
    def signed_power_gap(self) -> float:
        """Missing work relative to the largest of its terms."""
        return self.missing_work / max(*map(abs, self._works()), self.energy_scale)

    @property
    def power_gap(self) -> float:
        """Size of the gap of the power balance."""
        return abs(self.signed_power_gap)

    def power(self, term: str) -> float:
        """Mean power [W] of one loss."""
        return float(self.work[self.first :, POWER_TERMS.index(term)].sum() / self.duration)

    @property
    def inner_rolling_resistance(self) -> float:
        """Mean power [W] of the rolling resistance at the inner race."""
        return float(self.work[self.first :, INNER_ROLLING].sum() / self.duration)

    def largest_load(self, force: int) -> float:
        """Largest load counted [N], by its place in the load vector."""
        return float(self.largest[self.first :, force].max())


class Statistic(NamedTuple):
    """A figure as a function of sums over batches (or impact windows), so that any set of batches has one value.

    ``moments``: (batches, sums) of the counted part of a replicate; ``of_sums``: from sums on the last axis. ``trend``: the statistic
    that shows in its place whether a run has settled.
    """

    moments: Callable[[Replicate], Array]
    of_sums: Callable[[Array], Array]
    trend: "Statistic | None" = None

    def value(self, run: Replicate) -> float:
        """The figure of one replicate."""
        return float(self.of_sums(self.moments(run).sum(axis=0)))


def mean(sums: Array) -> Array:
    """Second sum over the first: a mean over samples, windows or time."""
    return sums[..., 1] / sums[..., 0]


def windowed(force: int) -> Statistic:
    """Mean over the impact windows of the largest load, by its place in the load vector.

    Its trend is that of the largest load of each batch, since a run may have only one or two windows.
    """
    trend = timed(lambda run: run.durations * run.largest[:, force])
    return Statistic(lambda run: np.column_stack((np.ones(len(windows := run.windows(force))), windows)), mean, trend)


def timed(values: Callable[[Replicate], Array], of_sums: Callable[[Array], Array] = mean) -> Statistic:
    """A figure of the duration and other ``values`` of each batch, their rate unless stated."""
    return Statistic(lambda run: np.column_stack((run.durations, values(run)))[run.first :], of_sums)
