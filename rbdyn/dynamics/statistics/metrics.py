"""From the batches of replicates to figures: impact, whirl, power loss, cage speed, slip and orbit, with their numerical errors.

Orbit of the cage: the whirl deviation ratio is one of speeds and does not show how far the cage moves. Rollers and film
press most cages to one place of their land, where the centre trembles. The radius of the orbit is the root mean square
distance of the centre from its mean place in each replicate. A circle about the guide has its own radius; a cage that rests
off the middle has none.

Numerical error: companions are a share of the replicates at another tolerance. Chaos makes two runs from one start
independent within a turn or so (correlations of pairs scatter about zero). So the mean of all replicates is compared with
the mean of the companions, unpaired. A companion at a tenth of the tolerance is expensive, and its noise exceeds the
difference. At ten times the tolerance it is cheap, and the bias is at least ten times as large. From rtol 0.1 to 0.01 the
impact of the bearing of Chen et al. 2022 goes from -0.9 to +0.1 +- 0.4 %. Its whirl goes from -4.0 to +0.2 +- 0.9 %, its loss
from +0.085 to -0.01 +- 0.02 %. Let d be the difference and s its standard error. The bias at the tolerance of the
run is d/9 (Richardson, first order), known to s/9; both count, as root sum of squares, which is the root mean square of what
the bias may be. There are too few companions for a scatter of their own: s is the standard error of the replicates times
sqrt(1 + n/m), for n turns counted of these and m of companions. The largest forces of single batches scatter half as much as
those of impact windows, but do not stand for them: at 2000 rpm and 1300 N they are 1.2 +- 0.6 % too low where the impact force
is 2.7 +- 0.8 % too high. The power loss also has the error that the power balance shows: input less losses less change of
energy. Integration errors act as one more loss that no law books, and they leave the input unchanged.

Companions at a looser tolerance do not show the bias of a step that stability limits, for it is the same there. Such a step
hurts in slow bearings. Rollers outside the load zone lie on the outer race by their centrifugal force alone, and jump on
it. A method damps this vibration of frequency omega by (h omega)^5/C a radian. C follows from its stability function, for
which |R(i x)| is 1 - x^6/C (Hairer and Wanner, Solving ODEs II, IV.2). It is 3600 for Dormand and Prince's pair, and 11 500
for RODAS4, which damps less where x is above 1. Velocity Verlet does not damp a vibration. But at its limit of stability it
leaves errors in every contact that excite one, and steps of changing size damp one. So runs of slow bearings take even steps
below that limit (``dynamics.run``). With rigid contacts their companions take steps of half that size, and d counts. With elastic
contacts even steps show no bias, and companions are the usual ones: an NU 210 at 3000 rpm, where stability limits four steps of five,
has +0.3 +- 1.6, -0.9 +- 0.9 and -0.01 +- 0.04 % (impact, whirl, loss), an NU 2205 at 1326 rpm -0.02 +- 0.06 % of the loss.

This damping matters in comparison with that of the race, which light contacts hardly engage. At 2000 rpm and 4 kN the
bearing of Chen et al. 2022 has a damping ratio of 4.9e-4 there. Its loss rises with the logarithm of the damping: by 1.5 %
a decade from 2e-5 to 2e-3, by 0.4 +- 0.4 % below, and hardly beyond. It does not matter whether law or method damps: the
loss rises by 1.2 % at a numerical damping ratio of 8e-3, by 0.5 % at 6e-4, and by 0.08 % at 2e-5 to 7e-5. So companions of
such runs take shorter steps, which leave a tenth of this bias, and 10 d/9 counts.

Filtered whirl: a rig and a run give the speed of the cage's centre from samples of its place. At high frequencies such a
speed is mostly noise, so it exists only below a cutoff. A cubic spline gives the velocity, with an error of 0.1 % at the
cutoff for ten samples a period. Butterworth's low pass of fourth order runs over it forward and backward: no delay, half
the amplitude at the cutoff. Runout turns with cage or shaft. Notches remove it, and any whirl that is as fast.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.notes import Note, Notes
from rbdyn.dynamics.parameters.state import LightContact, light_contact
from rbdyn.dynamics.statistics.batch_means import Estimate, estimate, student_factor
from rbdyn.dynamics.statistics.replicate import Replicate, Statistic
from rbdyn.result import JITTER, Quantity
from rbdyn.scene import Scene


def mean_gap(runs: Sequence[Replicate]) -> float:
    """Size of the relative gap of the power balance, averaged over replicates with its sign."""
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


def quantity(
    statistic: Statistic,
    runs: Runs,
    companions: Runs,
    share: float,
    slow: float,
    unit: float = 1.0,
    balanced: bool = False,
) -> Quantity:
    """A figure with its 95 % errors, times ``unit``.

    Statistical: batch means over all replicates (``batch_means``) and, as root sum of squares, the half-width ``slow`` of slow
    changes (``error_bars``). Numerical: the ``share`` of the difference from companions, and of a ``balanced`` figure also the gap
    of the power balance. None where it was not estimated.
    """
    ours = estimate([statistic.moments(run) for run in runs], statistic.of_sums)
    statistical = None if ours.half_width is None else math.hypot(ours.half_width, slow)
    numerical = None
    if companions:
        sums = np.sum([statistic.moments(run).sum(axis=0) for run in companions], axis=0)
        times_fewer = sum(run.duration for run in runs) / sum(run.duration for run in companions)
        numerical = companion_error(ours, float(statistic.of_sums(sums)), times_fewer, share)
    if balanced:
        missing = abs(sum(run.missing_work for run in runs)) / sum(run.duration for run in runs)
        numerical = math.hypot(missing, numerical or 0.0)
    statistical, numerical = (None if x is None else unit * x for x in (statistical, numerical))
    return Quantity(unit * ours.value, statistical, numerical, ours.effective_samples, ours.freedom)


def whirl_notes(scene: Scene, share: Quantity | None) -> Notes:
    """A note where the whirl deviation ratio shows a jitter, no whirl."""
    play = scene.cage_play_m
    if share is None or play is None or share.value >= JITTER:
        return ()
    clearance = "radial clearance in its pockets" if scene.guide_clearance_m is None else "radial guide clearance"
    sentence = (
        f"whirl deviation ratio: the cage does not whirl. Its orbit radius is {1e6 * play * share.value:.2g} um, {share.value:.2g} of "
        f"the {clearance}, so the ratio has little meaning"
    )
    return (Note("jitter", sentence),)


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
    """Root mean square bias of ``ours``: the ``share`` of its difference from companions with so many times fewer turns.

    The standard error of the difference counts. A half-width of 95 % in its place, with companions that resolve more, stated
    up to five times the bias. None where ours has no half-width.
    """
    if ours.half_width is None or ours.freedom is None:
        return None
    error = ours.half_width / student_factor(ours.freedom)
    return share * math.hypot(ours.value - theirs, error * math.sqrt(1.0 + times_fewer))


# C of each method, see above.
DAMPING_SCALE = {"rk45": 3600.0, "verlet": math.inf, "rosenbrock": 11_500.0}
# Numerical damping of a light contact, over that of the race, above which it counts.
NOTABLE_DAMPING = 0.2
# Damping ratios between which the loss depends on them most. Below them something else ends the jumps; above them rollers
# hardly jump.
LEAST_DAMPING, MOST_DAMPING = 2e-5, 2e-3
# Tolerance, over that of runs whose steps stability limits, that itself makes the steps short enough.
TIGHT = 1e-4


class Companions(NamedTuple):
    """How companions are integrated: tolerance, method, longest step [s].

    ``share`` of the difference between runs and companions is the bias of the runs.
    """

    rtol: float
    method: str
    longest_step: float
    share: float

    @property
    def resolve_more(self) -> bool:
        """Whether their steps are shorter than their tolerance requires."""
        return math.isfinite(self.longest_step)


def usual_companions(scene: Scene) -> Companions:
    """Companions of runs whose steps the tolerance limits."""
    numerics = scene.numerics
    return Companions(companion_tolerance(numerics.rtol), numerics.method, math.inf, bias_scale(numerics.rtol))


def companions_of(scene: Scene, runs: Sequence[Replicate]) -> Companions:
    """Companions of these runs, by the steps that they took."""
    light = light_contact(scene)
    if light is None:
        return usual_companions(scene)
    if all(run.method == "verlet" for run in runs):
        if scene.traction.elasticity:
            return usual_companions(scene)
        return Companions(scene.numerics.rtol, "verlet", 0.5 * mean_step(runs, "verlet"), 1.0)
    damping, method = max(
        (numerical_damping(light, mean_step(runs, kind), kind), kind) for kind in {run.method for run in runs}
    )
    race = max(light.damping, LEAST_DAMPING)
    if damping <= NOTABLE_DAMPING * race:
        return usual_companions(scene)
    step = longest_step(light, resolved_damping(damping, race), method)
    return Companions(scene.numerics.rtol / FACTOR, method, step, FACTOR / (FACTOR - 1.0))


def resolved_damping(damping: float, race: float) -> float:
    """Numerical damping ratio that leaves 1/FACTOR of the bias that ``damping`` adds to the damping ``race`` of the race.

    The bias grows with the logarithm of their sum.
    """
    return race * math.expm1(math.log1p(min(damping, max(MOST_DAMPING, NOTABLE_DAMPING * race)) / race) / FACTOR)


def mean_step(runs: Sequence[Replicate], method: str) -> float:
    """Mean step [s] of the runs by a method."""
    alike = [run for run in runs if run.method == method]
    return sum(float(run.durations.sum()) for run in alike) / sum(run.accepted_steps for run in alike)


def numerical_damping(light: LightContact, step: float, method: str) -> float:
    """Damping ratio that steps [s] of a method add to a light contact, at most."""
    return (step * light.frequency) ** 5 / DAMPING_SCALE[method]


def longest_step(light: LightContact, damping: float, method: str) -> float:
    """Step [s] of a method that adds so large a damping ratio."""
    return float((damping * DAMPING_SCALE[method]) ** 0.2 / light.frequency)


ORDER = 4
# Centre over width of a notch: it removes what turns within 5 % of the frequency, since cage speeds vary so much.
NOTCH_QUALITY = 10.0
# A notch this many times above the cutoff has nothing to remove.
NOTCH_REACH = 2.0
# Fewer periods of a notch in a record look like slow motion, and its filter rings to the end.
NOTCH_PERIODS = 10.0
# Periods of the cutoff at either end where the filter, which sees one side, passes fast motion. At 1 kHz it gives three times
# the speed of the bearing of Chen et al. 2022 in the last sample, and errs by less than a hundredth two periods before.
ENDS = 2.0


def filtered_speed(place: Array, rate: float, cutoff: float, notches: Sequence[float]) -> Array:
    """Speed (samples,) [m/s] of a point at ``place`` (2, samples) [m], sampled at ``rate``, below ``cutoff`` [Hz].

    It has no motion at those frequencies ``notches`` [Hz] that have ``NOTCH_PERIODS`` in the record. The ends get the speeds
    next to them, mirrored. Zero for fewer than two samples.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, iirnotch, sosfiltfilt, tf2sos

    samples = place.shape[1]
    if samples < 2:
        return np.zeros(samples)
    slowest = NOTCH_PERIODS * rate / samples
    removable = [frequency for frequency in notches if slowest <= frequency < NOTCH_REACH * cutoff]
    sections = [
        butter(ORDER, cutoff, fs=rate, output="sos"),
        *(tf2sos(*iirnotch(frequency, NOTCH_QUALITY, fs=rate)) for frequency in removable),
    ]
    # Reflected at the ends as far as the memory of the slowest part: velocities, since fast motion makes places step there.
    memory = rate / min([cutoff, *(frequency / NOTCH_QUALITY for frequency in removable)])
    reflected = min(samples - 1, int(memory))
    times = np.arange(samples) / rate
    velocity = CubicSpline(times, place, axis=1)(times, 1)
    speed = np.hypot(*sosfiltfilt(np.concatenate(sections), velocity, axis=1, padtype="even", padlen=reflected))
    end = min(round(ENDS * rate / cutoff), samples // 2)
    speed[:end] = speed[end : 2 * end][::-1]
    speed[samples - end :] = speed[samples - 2 * end : samples - end][::-1]
    return speed


def sums_until(moments: Array, ends: Sequence[int] | Whole) -> Array:
    """Sums (parts, m) of ``moments`` (m, samples) over parts that end before the samples ``ends``."""
    total = np.concatenate([np.zeros((len(moments), 1)), np.cumsum(moments, axis=1)], axis=1)
    return np.diff(total[:, [0, *ends]], axis=1).T


def speed_sums(speed: Array, ends: Sequence[int]) -> Array:
    """Samples, sum and sum of squares of the speed, as ``Replicate.whirl``, over parts as in ``sums_until``."""
    return sums_until(np.stack([np.ones_like(speed), speed, speed * speed]), ends)
