"""Speed of a cage's centre from samples of its place, filtered: the same statistic of a rig's signal and of a run.

A velocity from places is mostly noise at high frequencies, so it exists only below a cutoff. Butterworth's low pass of
fourth order runs forward and backward (no delay, half the amplitude at the cutoff), and a cubic spline gives the velocity:
at the cutoff it errs by 0.1 % where there are ten samples a period. Runout goes round with cage or shaft; notches take it
out, and whatever whirls as fast with it.
"""

from collections.abc import Sequence

import numpy as np

from rbdyn.arrays import Array, Whole

ORDER = 4
# Centre over width of a notch: takes out what goes round within 5 % of the frequency, as far as cages wander.
NOTCH_QUALITY = 10.0
# A notch this many times above the cutoff has nothing left to take out.
NOTCHED = 2.0


def filtered_speed(place: Array, rate: float, cutoff: float, notches: Sequence[float]) -> Array:
    """Speed (samples,) [m/s] of what is at ``place`` (2, samples) [m], sampled at ``rate``, below ``cutoff`` and without
    the frequencies ``notches`` [Hz]. Nothing of fewer than two samples."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, iirnotch, sosfiltfilt, tf2sos

    samples = place.shape[1]
    if samples < 2:
        return np.zeros(samples)
    notched = [frequency for frequency in notches if frequency < NOTCHED * cutoff]
    sections = [
        butter(ORDER, cutoff, fs=rate, output="sos"),
        *(tf2sos(*iirnotch(frequency, NOTCH_QUALITY, fs=rate)) for frequency in notched),
    ]
    # Reflected at the ends as far as the slowest part remembers.
    slowest = min([cutoff, *(frequency / NOTCH_QUALITY for frequency in notched)])
    reflected = min(samples - 1, int(rate / slowest))
    centred = place - place.mean(axis=1, keepdims=True)
    smooth = sosfiltfilt(np.concatenate(sections), centred, axis=1, padlen=reflected)
    times = np.arange(samples) / rate
    return np.hypot(*CubicSpline(times, smooth, axis=1)(times, 1))


def sums_until(moments: Array, ends: Sequence[int] | Whole) -> Array:
    """Sums (parts, m) of ``moments`` (m, samples) over parts that end before the samples ``ends``."""
    total = np.concatenate([np.zeros((len(moments), 1)), np.cumsum(moments, axis=1)], axis=1)
    return np.diff(total[:, [0, *ends]], axis=1).T


def speed_sums(speed: Array, ends: Sequence[int]) -> Array:
    """Samples, sum and sum of squares of the speed, as ``metrics.Replicate.whirl``, over parts as in ``sums_until``."""
    return sums_until(np.stack([np.ones_like(speed), speed, speed * speed]), ends)
