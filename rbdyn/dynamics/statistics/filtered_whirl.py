"""Speed of a cage's centre from samples of its place, filtered: the same statistic of a rig's signal and of a run.

A velocity from places is mostly noise at high frequencies, so it exists only below a cutoff. A cubic spline gives the velocity,
which errs by 0.1 % at the cutoff where there are ten samples a period, and Butterworth's low pass of fourth order runs over it
forward and backward (no delay, half the amplitude at the cutoff). Runout goes round with cage or shaft; notches take it
out, and whatever whirls as fast with it.
"""

from collections.abc import Sequence

import numpy as np

from rbdyn.base.arrays import Array, Whole

ORDER = 4
# Centre over width of a notch: takes out what goes round within 5 % of the frequency, as far as cages wander.
NOTCH_QUALITY = 10.0
# A notch this many times above the cutoff has nothing left to take out.
NOTCHED = 2.0
# Periods of a notch in a record below which it cannot be distinguished from slow motion, and its filter rings to the end.
NOTCH_PERIODS = 10.0
# Periods of the cutoff at either end where the filter, which sees one side, lets through what is fast: three times the
# speed of the bearing of Chen et al. 2022 at 1 kHz in the last sample, less than a hundredth two periods before.
ENDS = 2.0


def filtered_speed(place: Array, rate: float, cutoff: float, notches: Sequence[float]) -> Array:
    """Speed (samples,) [m/s] of what is at ``place`` (2, samples) [m], sampled at ``rate``, below ``cutoff`` and without
    the frequencies ``notches`` [Hz] that have ``NOTCH_PERIODS`` in the record. Nothing of fewer than two samples.

    The ends are given the speeds next to them, mirrored.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, iirnotch, sosfiltfilt, tf2sos

    samples = place.shape[1]
    if samples < 2:
        return np.zeros(samples)
    slowest = NOTCH_PERIODS * rate / samples
    notched = [frequency for frequency in notches if slowest <= frequency < NOTCHED * cutoff]
    sections = [
        butter(ORDER, cutoff, fs=rate, output="sos"),
        *(tf2sos(*iirnotch(frequency, NOTCH_QUALITY, fs=rate)) for frequency in notched),
    ]
    # Reflected at the ends as far as the slowest part remembers: velocities, since places would step there by what is fast.
    memory = rate / min([cutoff, *(frequency / NOTCH_QUALITY for frequency in notched)])
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
    """Samples, sum and sum of squares of the speed, as ``metrics.Replicate.whirl``, over parts as in ``sums_until``."""
    return sums_until(np.stack([np.ones_like(speed), speed, speed * speed]), ends)
