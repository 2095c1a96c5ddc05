"""From what one replicate kept, batch by batch, to the figures that are reported.

Numerical error of a statistic: a comparison with companions, a share of the replicates at another tolerance.

Chaos makes two runs from one start independent within a turn or so (correlations of pairs scatter about zero), so the
mean of all replicates is set against the mean of the companions, unpaired. A companion at a tenth of the tolerance is
dear, and the difference drowns in its noise. At ten times the tolerance it is cheap, and the bias is at least ten times
as large: from rtol 0.1 to 0.01 the impact of the bearing of Chen et al. 2022 goes from -0.57 to -0.05 +- 0.12 %, its whirl
from -4.0 to +0.1 +- 0.4 %, its loss from +0.025 to 0.000 +- 0.008 %. Of a difference d with the 95 % half-width w the bias
left at the tolerance of the run is d / 9 (Richardson, first order), known to w / 9; both count, as root sum of squares.
Where stability rules the steps, companions resolve more, and 10 d / 9 counts (``rbdyn.dynamics.companions``).
Companions scatter as the replicates do, and there are too few of them to decide: w is the half-width of the replicates
times sqrt(1 + n/m), for n turns counted of these and m of companions.

To the error of the power loss comes, likewise, what the power balance misses: input less losses less change of energy,
since integration errors act as one more loss that no law books and leave the input as it is.

Orbit of the cage: the whirl deviation ratio is one of speeds and says nothing of how far the cage moves. Rollers and film press
most cages to one place of their land, where the centre trembles. The radius of the orbit is the root mean square distance of the centre
from its mean place in each replicate: a circle about the guide has its own radius, a cage that rests off the middle none.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.dynamics.forces.equations import INNER_ROLLING, LOAD, LOSSES, POCKET_CONTACT_LOAD, POCKET_LOAD, SHAFT
from rbdyn.dynamics.statistics.batch_means import Estimate, estimate
from rbdyn.result import JITTER, Quantity
from rbdyn.scene import Scene

FACTOR = 10.0
# The loosest tolerance that a scene may have; beyond it the power balance no longer shows anything.
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


SLOWEST_CAGE = 1e-6  # [rad/s]


@dataclass(frozen=True)
class Replicate:
    """One run in batches. Times in s, works and energies in J, loads in N, angles in rad.

    Arrays over batches, from the start on; figures count from the batch ``first``, and ``per_window`` batches make an
    impact window. ``whirl``: samples, sum and sum of squares of the cage centre's speed; ``orbit``: samples, sums of the
    centre's places x, y and of x^2 + y^2; ``work``: integrals of the loss powers, of those that come in by shafts and loads,
    and of the rolling resistance of the inner race; ``largest``: loads; ``energy``: kinetic, elastic and
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
    orbit: Array = field(default_factory=lambda: np.zeros((0, 4)))

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


def _about_its_place(run: Replicate) -> Array:
    """Samples of the cage's centre in each batch, and the sum of their squared distances from its mean place in the run."""
    samples, x, y, squares = run.orbit[run.first :].T
    mean_x, mean_y = (place.sum() / max(samples.sum(), 1.0) for place in (x, y))
    about = squares - 2.0 * (mean_x * x + mean_y * y) + samples * (mean_x**2 + mean_y**2)
    return np.column_stack((samples, np.maximum(about, 0.0)))


IMPACT_FORCE = Figure(_windowed(POCKET_LOAD), mean)
IMPACT_CONTACT_FORCE = Figure(_windowed(POCKET_CONTACT_LOAD), mean)
WHIRL_DEVIATION_RATIO = Figure(lambda run: run.whirl[run.first :], _deviation_ratio)
POWER_LOSS = Figure(_timed(lambda run: run.work[:, :SHAFT].sum(axis=1)), mean)
CAGE_SPEED = Figure(_timed(lambda run: run.cage_angle), mean)
CAGE_SLIP = Figure(_timed(lambda run: np.column_stack((run.kinematic_angle, run.cage_angle))), _slip)
# Root mean square distance of the cage's centre from its mean place in a replicate [m].
ORBIT_RADIUS = Figure(_about_its_place, lambda sums: np.sqrt(sums[..., 1] / np.maximum(sums[..., 0], 1.0)))


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
    half-width ``slow`` of what changes slowly (``rbdyn.dynamics.statistics.error_bars``). Numerical: the ``share`` of the
    difference from companions, and of the power loss what the power balance misses (``rbdyn.dynamics.statistics.metrics``). None where it was not
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


def orbit_radius_share(scene: Scene, runs: Runs, companions: Runs, share: float) -> Quantity | None:
    """Radius of the cage's orbit over its radial play, with errors as of any figure; None for a cage without a play.

    ``share`` of the difference from the companions is the bias of the runs.
    """
    play = scene.cage_play_m
    if play is None:
        return None
    return quantity(ORBIT_RADIUS, runs, companions, share, 0.0, 1.0 / play)


def whirl_notes(scene: Scene, share: Quantity | None) -> tuple[str, ...]:
    """A note where the whirl deviation ratio is that of a jitter."""
    play = scene.cage_play_m
    if share is None or play is None or share.value >= JITTER:
        return ()
    where = "radial play in its pockets" if scene.guide_clearance_m is None else "radial guide clearance"
    what = "whirl deviation ratio: that of a jitter, for the cage does not whirl"
    return (f"{what}; its orbit has a radius of {1e6 * play * share.value:.2g} um, {share.value:.2g} of the {where}",)
