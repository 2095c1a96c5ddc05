"""From what one replicate kept, batch by batch, to the figures that are reported."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from rbdyn.arrays import Array
from rbdyn.dynamics.forces.equations import INNER_ROLLING, LOAD, LOSSES, POCKET_CONTACT_LOAD, POCKET_LOAD, SHAFT
from rbdyn.dynamics.statistics.batch_means import estimate
from rbdyn.dynamics.statistics.bias import companion_error
from rbdyn.result import Quantity

SLOWEST_CAGE = 1e-6  # [rad/s]


@dataclass(frozen=True)
class Replicate:
    """One run in batches. Times in s, works and energies in J, loads in N, angles in rad.

    Arrays over batches, from the start on; figures count from the batch ``first``, and ``per_window`` batches make an
    impact window. ``whirl``: samples, sum and sum of squares of the cage centre's speed; ``work``: integrals of the
    loss powers, of those that come in by shafts and loads, and of the rolling resistance of the inner race; ``largest``: loads; ``energy``: kinetic, elastic and
    load energy together at the ends of batches; ``energy_scale``: contact load times approach;
    ``stiffness``: as in ``runge_kutta.Carry``; ``decay_rates``: (states, motions) as in ``relaxation`` [1/s].
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
    decay_rates: Array = field(default_factory=lambda: np.zeros((0, 3)))

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
        whole = len(forces) // self.per_window
        return forces[: whole * self.per_window].reshape(whole, self.per_window).max(axis=1)

    @property
    def impact_force(self) -> float:
        """Mean over the windows of the largest force on a pocket wall [N]."""
        return float(self.windows(POCKET_LOAD).mean())

    @property
    def whirl_deviation_ratio(self) -> float:
        """Standard deviation over mean of the cage centre's speed; 0 for a cage at rest."""
        return self._figure(WHIRL_DEVIATION_RATIO)

    @property
    def power_loss(self) -> float:
        """Mean power turned into heat [W]."""
        return self._figure(POWER_LOSS)

    @property
    def cage_slip(self) -> float:
        """1 - cage speed over kinematic cage speed."""
        return self._figure(CAGE_SLIP)

    def _figure(self, figure: "Figure") -> float:
        return float(figure.of_sums(figure.moments(self).sum(axis=0)))

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
        return float(self.work[self.first :, LOSSES.index(term)].sum() / self.duration)

    @property
    def inner_rolling_resistance(self) -> float:
        """Mean power [W] of the rolling resistance at the inner race."""
        return float(self.work[self.first :, INNER_ROLLING].sum() / self.duration)

    def largest_load(self, force: int) -> float:
        """Largest load counted [N], by its place in the load vector."""
        return float(self.largest[self.first :, force].max())


class Figure(NamedTuple):
    """A figure as a function of sums over batches (or impact windows), so that any set of batches has one.

    ``moments``: (batches, sums) of the counted part of a replicate; ``of_sums``: from sums on the last axis.
    """

    moments: Callable[[Replicate], Array]
    of_sums: Callable[[Array], Array]


def mean(sums: Array) -> Array:
    """Mean of what was summed, weighted by the first sum."""
    return sums[..., 1] / sums[..., 0]


def _deviation_ratio(sums: Array) -> Array:
    """Standard deviation over mean (Ghaisas et al. 2004); 0 for a cage at rest."""
    samples, total, squares = np.moveaxis(sums, -1, 0)
    known = (samples > 1.5) & (total > 0.0)
    samples, total = np.where(known, samples, 2.0), np.where(known, total, 1.0)
    mean = total / samples
    variance = np.maximum(squares / samples - mean**2, 0.0) * samples / (samples - 1.0)
    return np.where(known, np.sqrt(variance) / mean, 0.0)


def _slip(sums: Array) -> Array:
    """0 where counter-rotation leaves the cage no speed to fall behind."""
    duration, rolling, turned = np.moveaxis(sums, -1, 0)
    known = np.abs(rolling) > SLOWEST_CAGE * duration
    return np.where(known, 1.0 - turned / np.where(known, rolling, 1.0), 0.0)


def _windowed(force: int) -> Callable[[Replicate], Array]:
    return lambda run: np.column_stack((np.ones(len(windows := run.windows(force))), windows))


def _timed(values: Callable[[Replicate], Array]) -> Callable[[Replicate], Array]:
    return lambda run: np.column_stack((run.durations, values(run)))[run.first :]


IMPACT_FORCE = Figure(_windowed(POCKET_LOAD), mean)
IMPACT_CONTACT_FORCE = Figure(_windowed(POCKET_CONTACT_LOAD), mean)
WHIRL_DEVIATION_RATIO = Figure(lambda run: run.whirl[run.first :], _deviation_ratio)
POWER_LOSS = Figure(_timed(lambda run: run.work[:, :SHAFT].sum(axis=1)), mean)
CAGE_SPEED = Figure(_timed(lambda run: run.cage_angle), mean)
CAGE_SLIP = Figure(_timed(lambda run: np.column_stack((run.kinematic_angle, run.cage_angle))), _slip)


def mean_gap(runs: Sequence[Replicate]) -> float:
    """Size of the mean relative gap of the power balance: what is left of it when replicates are averaged."""
    return abs(sum(run.signed_power_gap for run in runs)) / len(runs)


def work_done(runs: Sequence[Replicate]) -> dict[str, float]:
    """Cost of runs, warm-up included: processor time, steps, right-hand sides."""
    return {
        "cpu_s": sum(run.cpu_s for run in runs),
        "steps": sum(run.accepted_steps for run in runs),
        "rejected_steps": sum(run.rejected_steps for run in runs),
        "rhs_evaluations": sum(run.derivatives for run in runs),
    }


Runs = Sequence[Replicate]


def quantity(figure: Figure, runs: Runs, companions: Runs, share: float, slow: float, unit: float = 1.0) -> Quantity:
    """A figure with its 95 % errors, times ``unit``.

    Statistical: batch means over all replicates (``rbdyn.dynamics.statistics.batch_means``) and, as root sum of squares, the
    half-width ``slow`` of what changes slowly (``rbdyn.dynamics.statistics.drift``). Numerical: the ``share`` of the
    difference from companions, and of the power loss what the power balance misses (``rbdyn.dynamics.statistics.bias``). None where it was not
    estimated.
    """
    ours = estimate([figure.moments(run) for run in runs], figure.of_sums)
    statistical = None if ours.half_width is None else math.hypot(ours.half_width, slow)
    numerical = None
    if companions:
        sums = np.sum([figure.moments(run).sum(axis=0) for run in companions], axis=0)
        times_fewer = sum(run.duration for run in runs) / sum(run.duration for run in companions)
        numerical = companion_error(ours, float(figure.of_sums(sums)), times_fewer, share)
    if figure is POWER_LOSS:
        missing = abs(sum(run.missing_work for run in runs)) / sum(run.duration for run in runs)
        numerical = math.hypot(missing, numerical or 0.0)
    statistical, numerical = (None if x is None else unit * x for x in (statistical, numerical))
    return Quantity(unit * ours.value, statistical, numerical, ours.effective_samples, ours.freedom)
