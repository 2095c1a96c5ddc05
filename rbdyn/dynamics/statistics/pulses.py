"""Impact pulses in the force between a roller and the walls of its pocket, of a run and of a rig's sensor alike.

A force, sampled evenly, is low-passed and its absolute value is taken. A pulse is a stretch above the threshold. Its height
is the largest force in it, at the vertex of the parabola through the largest sample and its neighbours. Its impulse is the
integral of the force over it, and its time is that of its height. The dead time starts at a pulse: further pulses within it
belong to the first, which gets the larger height and both impulses. Stretches that the record cuts at an end are left out.

The low pass is a Gaussian that halves the power at the bandwidth f: exp(-ln 2/2 (nu/f)^2), of standard deviation
sqrt(ln 2)/(2 pi f) = 0.133/f in time. It has no overshoot, so one pulse never makes two. A pulse far shorter than 1/f, of
impulse J, becomes a Gaussian of height J f sqrt(2 pi/ln 2) = 3.01 J f. Its height then shows the impulse alone. Only pulses
longer than that show the stiffness of what they hit: a half sine of height H lasts pi J/(2 H) = pi sqrt(m/k).

A sensor sees every pulse through its own bandwidth and its sampling. So both are low-passed by the same Gaussian, whose
bandwidth lies below that of the sensor, and sampled so often that nothing is lost between samples.
"""

import math
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole

# Standard deviation in time, and height over impulse of a very short pulse, times and over the bandwidth.
SPREAD = math.sqrt(math.log(2.0)) / (2.0 * math.pi)
SHORTEST = math.sqrt(2.0 * math.pi / math.log(2.0))
# Standard deviations after which the filter ends: the rest is 6e-7 of it.
REACH = 5.0
# Pulses at most this many times as long as the filter leaves the shortest ones: their heights show the impulse alone.
AS_SHORT = 1.25


class Pulses(NamedTuple):
    """Pulses of one force in the order of their times [s]: heights [N] and impulses [N s]."""

    time: Array
    height: Array
    impulse: Array


def low_passed(force: Array, rate: float, bandwidth: float) -> Array:
    """Force (samples, ...) sampled at ``rate`` [Hz], without what is faster than ``bandwidth`` [Hz]; the ends repeat."""
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(force, SPREAD * rate / bandwidth, axis=0, mode="nearest", truncate=REACH))


def pulses_of(force: Array, rate: float, threshold: float, dead_time: float) -> Pulses:
    """Pulses of a force (samples,) [N] that is low-passed; ``rate`` [Hz], ``threshold`` [N], ``dead_time`` [s]."""
    size = np.abs(force)
    edges = np.diff((size >= threshold).astype(np.int8))
    begins, ends = np.flatnonzero(edges > 0) + 1, np.flatnonzero(edges < 0) + 1
    # A stretch from the first sample on has no begin, one to the last sample no end.
    ends = ends[np.searchsorted(ends, begins[0]) :] if begins.size else ends[:0]
    begins = begins[: ends.size]
    if not begins.size:
        return Pulses(np.zeros(0), np.zeros(0), np.zeros(0))
    peaks = _highest(size, begins, ends)
    before, top, after = size[peaks - 1], size[peaks], size[np.minimum(peaks + 1, size.size - 1)]
    bend = np.minimum(before - 2.0 * top + after, 0.0)
    shift = np.divide(0.5 * (before - after), bend, out=np.zeros(peaks.size), where=bend < 0.0)
    heights = top - 0.25 * (before - after) * shift
    pulses = Pulses((peaks + shift) / rate, heights, _impulses(size, begins, ends, threshold) / rate)
    return without_echoes(pulses, dead_time)


def _highest(size: Array, begins: Whole, ends: Whole) -> Whole:
    """Places of the largest sample in each stretch, the first of equal ones."""
    stretches = zip(begins.tolist(), ends.tolist(), strict=True)
    return np.array([begin + int(size[begin:end].argmax()) for begin, end in stretches])


def _impulses(size: Array, begins: Whole, ends: Whole, threshold: float) -> Array:
    """Sums of trapezoids [N samples] over each stretch, from crossing to crossing of the threshold on straight lines."""
    total = np.concatenate([[0.0], np.cumsum(size)])
    inside = total[ends] - total[begins] - 0.5 * (size[begins] + size[ends - 1])
    for first, beyond in ((begins, begins - 1), (ends - 1, ends)):
        rise = size[first] - size[beyond]
        share = np.divide(size[first] - threshold, rise, out=np.zeros(rise.size), where=rise > 0.0)
        inside = inside + 0.5 * share * (size[first] + threshold)
    return np.asarray(inside)


def without_echoes(pulses: Pulses, dead_time: float) -> Pulses:
    """The pulses, each with those that follow within the ``dead_time`` [s] as one."""
    firsts, place = list[int](), 0
    while place < pulses.time.size:
        firsts.append(place)
        place = max(int(np.searchsorted(pulses.time, pulses.time[place] + dead_time)), place + 1)
    if len(firsts) == pulses.time.size:
        return pulses
    heights, impulses = np.maximum.reduceat(pulses.height, firsts), np.add.reduceat(pulses.impulse, firsts)
    return Pulses(pulses.time[firsts], heights, impulses)


def pulse_sums(pulses: Pulses, ends: Array) -> Array:
    """Number of pulses, sums of heights [N] and of impulses [N s], (parts, 3), over parts that end at times ``ends`` [s]."""
    parts = np.searchsorted(ends, pulses.time, side="left")
    weights = (np.ones(pulses.time.size), pulses.height, pulses.impulse)
    return np.column_stack([np.bincount(parts, weight, len(ends) + 1)[: len(ends)] for weight in weights])


def as_short_as_the_filter(height: float, impulse: float, bandwidth: float) -> bool:
    """Whether pulses of a mean height [N] and impulse [N s] are as short as a low pass [Hz] lets them be."""
    return impulse * bandwidth * SHORTEST < AS_SHORT * height
