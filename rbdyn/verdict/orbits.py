"""Class of a cage by its orbit: held, circling, in fast whirl, rattling or wandering.

An orbit is the complex position x + iy of the cage's centre, sampled evenly over whole cage turns. Radii are measured in the
radial play of what guides the cage, rates in the speed of the cage.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

CageClass = Literal["held", "circling", "fast whirl", "rattling", "wandering", "not judged"]


@dataclass(frozen=True)
class Thresholds:
    """Limits between the classes; radii over the radial play, rates over the speed of the cage."""

    still_radius: float = 0.2
    moving_radius: float = 0.3
    concentration: float = 0.6
    lowest_rate: float = -0.2
    highest_rate: float = 1.2
    forced_band: float = 0.05
    # Turnover above which a cage rattles; None: no value is known, and such a motion is not judged.
    rattling_turnover: float | None = None
    least_share: float = 0.85


@dataclass(frozen=True)
class Orbit:
    """Measures of an orbit: offset and rms radius over the play, share of the spectrum by its main line, rate over the cage's."""

    offset: float
    radius: float
    concentration: float
    rate: float


def orbit_measures(orbit: NDArray[np.complex128], play: float, samples_per_turn: int = 64) -> Orbit:
    """Measures of an ``orbit`` (m, evenly sampled) in a radial ``play`` (m).

    The rate is the turn of the phase from the first sample to the last, over cage turns. The main line has all that lies
    within 10 % of its frequency, or two bins.

    Raises ValueError where the play is not positive or the orbit has less than one cage turn.
    """
    if not play > 0:
        raise ValueError(f"The radial play of the cage is {play} m; the verdict needs a play above 0.")
    if len(orbit) < samples_per_turn:
        raise ValueError(
            f"The orbit has {len(orbit)} samples; the verdict needs at least a cage turn of {samples_per_turn}."
        )
    centre = orbit.mean()
    motion = orbit - centre
    power = np.abs(np.fft.fft(motion)) ** 2
    frequency = np.fft.fftfreq(len(orbit), 1 / samples_per_turn)
    line = frequency[np.argmax(power)]
    near = np.abs(frequency - line) <= max(0.1 * abs(line), 2 * samples_per_turn / len(orbit)) * (1 + 1e-9)
    total = float(power.sum())
    phase = np.unwrap(np.angle(motion))
    turns = (len(orbit) - 1) / samples_per_turn
    return Orbit(
        offset=float(abs(centre) / play),
        radius=float(np.sqrt(np.mean(np.abs(motion) ** 2)) / play),
        concentration=float(power[near].sum() / total) if total > 0 else 0.0,
        rate=float((phase[-1] - phase[0]) / (2 * np.pi * turns)),
    )


def orbit_class(
    orbit: Orbit, limits: Thresholds, forced_orders: Sequence[float] = (1.0,), turnover: float | None = None
) -> CageClass:
    """Class of an ``orbit``; ``forced_orders`` over the cage's speed, ``turnover`` of its energy by friction and damping."""
    if orbit.radius < limits.still_radius or orbit.offset > orbit.radius:
        return "held"
    if orbit.radius >= limits.moving_radius and orbit.concentration >= limits.concentration:
        slow = limits.lowest_rate <= orbit.rate <= limits.highest_rate
        forced = any(abs(orbit.rate - order) <= limits.forced_band * abs(order) for order in forced_orders)
        return "circling" if slow or forced else "fast whirl"
    if limits.rattling_turnover is None or turnover is None:
        return "not judged"
    return "rattling" if turnover > limits.rattling_turnover else "wandering"
