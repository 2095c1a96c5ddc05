"""Class of a cage by its orbit: held, circling, in fast whirl, rattling or wandering.

An orbit is the complex position x + iy of the cage's centre, sampled evenly over whole cage turns. Radii are measured in the
radial play of what guides the cage, rates in the speed of the cage.
"""

import math
from dataclasses import astuple, dataclass
from typing import Literal

import numpy as np

from rbdyn.base.arrays import Complex

SAMPLES_A_TURN = 64
# Cage turns of a block, whose orbit has measures of its own.
BLOCK_TURNS = 10

# Outcomes of a replicate in the prior of a share: of its class, of another, undecided; the number of classes does not matter.
PRIOR_OF_CLASS, PRIOR_OF_OTHERS = 0.5, 1.0

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

    @property
    def fewest_replicates(self) -> int:
        """Replicates that name a class where all are alike: least n with (n + 1/2)/(n + 3/2) at the least share."""
        prior = PRIOR_OF_CLASS + PRIOR_OF_OTHERS
        return max(math.ceil((prior * self.least_share - PRIOR_OF_CLASS) / (1.0 - self.least_share) - 1e-9), 1)


@dataclass(frozen=True)
class Orbit:
    """Measures of an orbit: offset and rms radius over the play, share of the spectrum by its main line, rate over the cage's."""

    offset: float
    radius: float
    concentration: float
    rate: float


def orbit_measures(orbit: Complex, play: float, samples_per_turn: float = SAMPLES_A_TURN) -> Orbit:
    """Measures of an ``orbit`` (m, evenly sampled) in a radial ``play`` (m).

    The rate is the turn of the phase from the first sample to the last, over cage turns. The main line has all that lies
    within 10 % of its frequency, or two bins.

    Raises ValueError where the play is not positive or the orbit has less than one cage turn.
    """
    if not play > 0:
        raise ValueError(f"The radial clearance of the cage is {play} m; the verdict needs a clearance above 0.")
    if len(orbit) < samples_per_turn:
        raise ValueError(
            f"The orbit has {len(orbit)} samples; the verdict needs at least a cage turn of {samples_per_turn:g}."
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


def mean_measures(orbit: Complex, play: float, samples_per_turn: float = SAMPLES_A_TURN) -> Orbit:
    """Measures of a long ``orbit``: the mean over blocks of ten cage turns, which overlap by half and cover it.

    Blocks of one length make the measures of a longer orbit those of a shorter one. The radius is a root mean square.

    Raises ValueError as ``orbit_measures``, and for an orbit shorter than a block.
    """
    length = round(BLOCK_TURNS * samples_per_turn)
    if len(orbit) < length:
        raise ValueError(
            f"The orbit has {len(orbit) / samples_per_turn:.3g} cage turns; the verdict needs at least {BLOCK_TURNS}."
        )
    spare = len(orbit) - length
    starts = np.linspace(0, spare, round(2 * spare / length) + 1).astype(int)
    blocks = [orbit_measures(orbit[start : start + length], play, samples_per_turn) for start in starts]
    offset, _, concentration, rate = np.mean([astuple(block) for block in blocks], axis=0).tolist()
    return Orbit(offset, math.sqrt(sum(block.radius**2 for block in blocks) / len(blocks)), concentration, rate)


@dataclass(frozen=True)
class Forcing:
    """What else decides on the class of an orbit.

    ``orders``: of forces, over the speed of the cage, 1 for its imbalance; ``film_rate``: fastest rate, over that speed, at which a
    film drives an orbit; ``turnover``: work of friction and damping a cage turn over the energy of its rotation, None where unknown.
    """

    orders: tuple[float, ...] = (1.0,)
    film_rate: float = 0.5
    turnover: float | None = None


def orbit_class(orbit: Orbit, forcing: Forcing, limits: Thresholds) -> CageClass:
    """Class of an ``orbit`` under its ``forcing``."""
    if orbit.radius < limits.still_radius or orbit.offset > orbit.radius:
        return "held"
    if orbit.radius >= limits.moving_radius and orbit.concentration >= limits.concentration:
        slow = limits.lowest_rate <= orbit.rate <= max(limits.highest_rate, forcing.film_rate)
        forced = any(abs(orbit.rate - order) <= limits.forced_band * abs(order) for order in forcing.orders)
        return "circling" if slow or forced else "fast whirl"
    if limits.rattling_turnover is None or forcing.turnover is None:
        return "not judged"
    return "rattling" if forcing.turnover > limits.rattling_turnover else "wandering"
