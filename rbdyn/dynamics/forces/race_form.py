"""Form of a raceway: round, or with waviness and out-of-round as harmonics of its radius."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import kernel, law


class RoundRace(NamedTuple):
    """A perfect circle."""


class WavyRace(NamedTuple):
    """Radius R + sum_n (a_n cos(n phi) + b_n sin(n phi)), phi counted from a mark on the ring."""

    order: NDArray[np.int64]  # n
    cosine: NDArray[np.float64]  # a_n [m]
    sine: NDArray[np.float64]  # b_n [m]


def wavy_race(order: NDArray[np.int64], amplitude: NDArray[np.float64], phase: NDArray[np.float64]) -> WavyRace:
    """Harmonics of the radius: amplitude [m] cos(order (phi - phase)), so a lobe of the ring stands at ``phase`` [rad]."""
    return WavyRace(order, amplitude * np.cos(order * phase), amplitude * np.sin(order * phase))


def largest_rise(form: RoundRace | WavyRace) -> float:
    """Upper bound of the radius above its mean [m]."""
    return float(np.hypot(form.cosine, form.sine).sum()) if isinstance(form, WavyRace) else 0.0


@kernel
def turned_multiple(order, cosine, sine):
    """cos(n phi), sin(n phi) from cos(phi), sin(phi), by squaring."""
    real, imaginary = 1.0, 0.0
    while order > 0:
        if order & 1:
            real, imaginary = real * cosine - imaginary * sine, real * sine + imaginary * cosine
        cosine, sine = cosine * cosine - sine * sine, 2.0 * cosine * sine
        order >>= 1
    return real, imaginary


@law
def form_at(form, nx, ny, ring_cos, ring_sin):
    """Radius above the mean [m] and its slope over angle [m/rad], at the direction ``nx, ny`` from the ring's centre.

    ``ring_cos, ring_sin``: direction of the mark on the ring.
    """


@form_at.body(RoundRace)
def _(form, nx, ny, ring_cos, ring_sin):
    return 0.0, 0.0


@form_at.body(WavyRace)
def _(form, nx, ny, ring_cos, ring_sin):
    cosine, sine = nx * ring_cos + ny * ring_sin, ny * ring_cos - nx * ring_sin
    rise = slope = 0.0
    for i in range(form.order.size):
        real, imaginary = turned_multiple(form.order[i], cosine, sine)
        rise += form.cosine[i] * real + form.sine[i] * imaginary
        slope += form.order[i] * (form.sine[i] * real - form.cosine[i] * imaginary)
    return rise, slope


@law
def sloped(form, slope, size):
    """``slope`` times ``size``; nothing, and not computed, on a round race."""


@sloped.body(RoundRace)
def _(form, slope, size):
    return 0.0


@sloped.body(WavyRace)
def _(form, slope, size):
    return slope * size
