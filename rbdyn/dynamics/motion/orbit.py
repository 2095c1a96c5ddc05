"""What a history shows about cage and contacts: whirl, sections, spectra, loads and sliding around the bearing.

Functions of a ``History``; SI throughout. All work on its samples, so nothing faster than half the sampling rate is
seen, and the largest forces are those of this one replicate, not those of a result (which keeps every step).
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.contact.film_thickness import hertz_pressure
from rbdyn.dynamics.parameters.model import rolling_contacts

if TYPE_CHECKING:
    from rbdyn.dynamics.motion.history import History

Race = Literal["outer", "inner"]

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
SPREAD = (0.05, 0.95)
# Share of the samples left out of a histogram at either end: the whirl speed has no bound near the centre.
TAIL = 0.01
# Halves of the record that overlap by half: three periodograms to average, frequencies two over the record apart.
SEGMENT_SHARE = 0.5


def eccentricity(history: "History") -> Array:
    """Distance of the cage centre from that of its guide [m], (samples,)."""
    return np.hypot(*history.guide_eccentricity)


def whirl_speed(history: "History") -> Array:
    """Instantaneous whirl speed psi' = (x vy - y vx)/(x^2 + y^2) of the cage centre about its guide [rad/s], (samples,).

    Zero where the centres coincide. Close to the centre it grows without bound: take quantiles, not moments.
    """
    x, y = history.guide_eccentricity
    inner = history.scene.cage.guidance == "inner"
    guide = (history.ring_x, history.ring_y) if inner else (history.outer_x, history.outer_y)
    # Not among the samples: by central differences.
    guide_vx, guide_vy = (np.gradient(place, history.time) for place in guide)
    moment = x * (history.cage_vy - guide_vy) - y * (history.cage_vx - guide_vx)
    square = x * x + y * y
    return np.divide(moment, square, out=np.zeros_like(square), where=square > 0.0)


def mean_cage_speed(history: "History") -> float:
    """Angle that the cage turned over the time it took [rad/s]."""
    return float((history.cage_angle[-1] - history.cage_angle[0]) / (history.time[-1] - history.time[0]))


def whirl_ratio(history: "History") -> float:
    """Mean whirl speed over mean cage speed: 1 when the cage centre goes round with the cage, 0 when it stays.

    The mean of psi' over time is the angle gone round the guide's centre over the time; that form has no pole.
    """
    x, y = history.guide_eccentricity
    angle = np.unwrap(np.arctan2(y, x))
    turned = (angle[-1] - angle[0]) / (history.time[-1] - history.time[0])
    return float(turned) / mean_cage_speed(history)


def whirl_ratios(history: "History") -> Array:
    """Instantaneous whirl speed over mean cage speed, (samples,)."""
    return whirl_speed(history) / mean_cage_speed(history)


def whirl_quantiles(history: "History") -> dict[float, float]:
    """Quantiles of the instantaneous whirl ratio."""
    values = np.quantile(whirl_ratios(history), QUANTILES)
    return dict(zip(QUANTILES, values.tolist(), strict=True))


def whirl_histogram(history: "History", bins: int = 60) -> tuple[Array, Array]:
    """Probability density of the instantaneous whirl ratio: bin edges (bins + 1,), density (bins,).

    The bins hold all but one in a hundred samples at either end; the density is that of all samples.
    """
    values = whirl_ratios(history)
    low, high = np.quantile(values, (TAIL, 1.0 - TAIL))
    if high - low <= 1e-9 * max(abs(low), abs(high), 1.0):
        low, high = low - 0.5, high + 0.5
    count, edges = np.histogram(values, bins, (float(low), float(high)))
    return edges, count / (values.size * np.diff(edges))


def poincare(history: "History", turn_of: Literal["shaft", "cage"]) -> tuple[Array, Array]:
    """Poincare section: cage centre about its guide [m] once a turn of shaft or cage, x and y, each (turns,).

    A periodic orbit is a point, a quasi-periodic one a closed curve, a chaotic one a cloud. The section lies at the
    angle of the first sample; between samples a cubic spline holds. The time of a crossing is interpolated linearly:
    the speeds hardly change within a sample. The shaft is the ring that turns, the inner one where both do.
    """
    from scipy.interpolate import CubicSpline

    if turn_of == "cage":
        angle = history.cage_angle
    elif np.ptp(history.inner_angle) > 0.0:
        angle = history.inner_angle
    else:
        angle = 2.0 * np.pi * history.time / history.scene.turn_s
    # Forward, whichever way it turns; and never back, so that there is one time for an angle.
    gone = np.maximum.accumulate(np.abs(angle - angle[0]))
    crossings = 2.0 * np.pi * np.arange(math.floor(gone[-1] / (2.0 * np.pi) + 1e-9) + 1)
    when = np.interp(crossings, gone, history.time)
    place = CubicSpline(history.time, np.array(history.guide_eccentricity), axis=1)(when)
    return place[0], place[1]


class Spectrum(NamedTuple):
    """Frequencies [Hz] and the amplitude of a sine of each, in units of the signal. Arrays (frequencies,)."""

    frequency: Array
    amplitude: Array

    def peaks(self, count: int) -> list[tuple[float, float]]:
        """The ``count`` highest local maxima: frequency [Hz] and amplitude, largest first."""
        from scipy.signal import find_peaks

        places = find_peaks(self.amplitude)[0]
        highest = places[np.argsort(-self.amplitude[places])][:count]
        return [(float(self.frequency[i]), float(self.amplitude[i])) for i in highest]


def spectrum(history: "History", values: Array) -> Spectrum:
    """Amplitude spectrum of a sampled signal without its mean, by Welch's method (Welch 1967) with Hann's window.

    A sine has its amplitude at its frequency, and up to 15 % less where that lies between two frequencies.
    """
    from scipy.signal import welch

    interval = float(history.time[1] - history.time[0])
    segment = max(int(SEGMENT_SHARE * len(values)), 2)
    frequency, power = welch(values, 1.0 / interval, "hann", segment, scaling="spectrum")
    return Spectrum(frequency, np.sqrt(2.0 * power))


@dataclass(frozen=True)
class Profile:
    """A quantity of all rollers against azimuth: mean, 5 % and 95 % quantile in each bin, (bins,); NaN in empty bins.

    ``azimuth``: bin centres from the load direction, in [-pi, pi).
    """

    azimuth: Array
    mean: Array
    low: Array
    high: Array
    samples: Whole


def against_azimuth(history: "History", values: Array, bins: int = 72) -> Profile:
    """Bin values (samples, rollers) by the azimuth at which each roller stood."""
    share = (history.azimuth / (2.0 * np.pi) + 0.5) % 1.0
    place = np.minimum((share * bins).astype(np.int64), bins - 1).ravel()
    order = np.argsort(place, kind="stable")
    samples = np.bincount(place, minlength=bins)
    parts = np.split(values.ravel()[order], np.cumsum(samples)[:-1])
    figures = np.full((3, bins), np.nan)
    for index, part in enumerate(parts):
        if part.size:
            figures[0, index] = part.mean()
            figures[1:, index] = np.quantile(part, SPREAD)
    centres = 2.0 * np.pi * ((np.arange(bins) + 0.5) / bins - 0.5)
    return Profile(centres, figures[0], figures[1], figures[2], samples)


def contact_pressure(history: "History", race: Race) -> Array:
    """Hertz pressure p = sqrt(Q E'/(2 pi l R)) in the middle of the contact of plain cylinders [Pa], (samples, rollers).

    E' = 2/((1 - nu1^2)/E1 + (1 - nu2^2)/E2), l the effective length, R the reduced radius (Johnson 1985, 4.2c). A
    profile or a tilt raises it locally.
    """
    load = history.outer_load if race == "outer" else history.inner_load
    return np.asarray(hertz_pressure(rolling_contacts(history.scene)[race], load))


def pressure_velocity(history: "History", race: Race) -> Array:
    """Hertz pressure times sliding speed [W/m^2], (samples, rollers): friction over it is the heat per area."""
    slip = history.outer_slip if race == "outer" else history.inner_slip
    return contact_pressure(history, race) * np.abs(slip)


class Largest(NamedTuple):
    """A largest force [N], its time after the transient [s], and the roller, from 0; None where it is no roller's."""

    force: float
    time: float
    roller: int | None


def largest(history: "History", loads: Array) -> Largest:
    """Largest absolute value of loads (samples,) or (samples, rollers).

    The vertex of the parabola through the largest sample and its neighbours, which makes good most of what lies
    between samples.
    """
    size = np.abs(loads if loads.ndim == 2 else loads[:, None])
    sample, roller = np.unravel_index(int(size.argmax()), size.shape)
    force, time = float(size[sample, roller]), float(history.time[sample])
    if 0 < sample < len(size) - 1:
        before, after = float(size[sample - 1, roller]), float(size[sample + 1, roller])
        bend = before - 2.0 * force + after
        if bend < 0.0:
            shift = 0.5 * (before - after) / bend
            force -= 0.25 * (before - after) * shift
            time += shift * float(history.time[1] - history.time[0])
    return Largest(force, time, int(roller) if loads.ndim == 2 else None)
