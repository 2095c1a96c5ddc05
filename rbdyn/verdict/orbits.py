"""Class of a cage by its orbit: held, circling, in fast whirl, rattling or wandering.

An orbit is the complex position x + iy of the cage's centre, sampled evenly over whole cage turns. Radii are measured in the
radial play of what guides the cage, rates in the speed of the cage. The classes of replicates give the share of each class among
bearings alike, and the class that they name.
"""

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import astuple, fields
from typing import Literal, NamedTuple, get_args

import numpy as np

from rbdyn.base.arrays import Array, Complex
from rbdyn.base.records import Record, keyed
from rbdyn.base.words import counted

SAMPLES_A_TURN = 64
# Cage turns of a block, whose orbit has measures of its own.
BLOCK_TURNS = 10

# Outcomes of a replicate in the prior of a share: of its class, of another, undecided; the number of classes does not matter.
PRIOR_OF_CLASS, PRIOR_OF_OTHERS = 0.5, 1.0

CageClass = Literal["held", "circling", "fast whirl", "rattling", "wandering", "not judged"]


class Thresholds(Record):
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


class Orbit(Record):
    """Measures of an orbit: offset and rms radius over the play, share of the spectrum by its main line, rate over the cage's."""

    offset: float
    radius: float
    concentration: float
    rate: float


def orbit_measures(orbit: Complex, play: float, samples_per_turn: float = SAMPLES_A_TURN) -> Orbit:
    """Measures of an ``orbit`` (m, evenly sampled) of at least a cage turn in a radial ``play`` > 0 (m).

    The rate is the turn of the phase from the first sample to the last, over cage turns. The main line has all that lies
    within 10 % of its frequency, or two bins.
    """
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
    """
    length = round(BLOCK_TURNS * samples_per_turn)
    spare = len(orbit) - length
    starts = np.linspace(0, spare, round(2 * spare / length) + 1).astype(int)
    blocks = [orbit_measures(orbit[start : start + length], play, samples_per_turn) for start in starts]
    offset, _, concentration, rate = np.mean([astuple(block) for block in blocks], axis=0).tolist()
    return Orbit(offset, math.sqrt(sum(block.radius**2 for block in blocks) / len(blocks)), concentration, rate)


class Forcing(Record):
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


MEASURES = [measure.name for measure in fields(Orbit)]
# Difference of two classes over their joint scatter that shows two regimes; halves of one normal scatter are 1.9 apart.
TWO_REGIMES = 10.0


class Share(NamedTuple):
    """Share of a class among replicates: mean and 90 % interval."""

    mean: float
    low: float
    high: float


def class_shares(classes: Sequence[CageClass]) -> dict[str, Share]:
    """Share of each class among bearings alike, from those of replicates: Beta(k + 1/2, n - k + 1), mean and 90 % interval."""
    return {name: _share(classes.count(name), len(classes)) for name in get_args(CageClass) if classes.count(name)}


def verdict(shares: Mapping[str, Share], limits: Thresholds) -> str:
    """Class that has at least ``least_share`` of bearings alike, else undecided."""
    return next((name for name, share in shares.items() if share.mean >= limits.least_share), "undecided")


class Measure(NamedTuple):
    """Mean of a measure over replicates, and its standard error; None of a single replicate."""

    mean: float
    standard_error: float | None


class CageVerdict(Record):
    """Class of a cage by its orbit.

    - ``name``: the class, "undecided" or "not judged", with the ``reason`` of that; ``rule``: the class that the orbits name by themselves
    - ``shares``: of each class among bearings alike, mean and 90 % interval; ``replicates``: number of each class
    - ``distances``: of the measures to each threshold, in standard errors over the replicates, positive above it. "offset" is that
      of the orbit's centre to the radius of the orbit, and "forced_band" that of the rate to the nearest forced order
    - ``least_share``: that a class must have to be named
    - ``measures``: "offset" and "radius" over the radial play, "concentration" of the spectrum, "rate" over the speed of the cage, and
      "turnover" of its energy in a cage turn: mean and standard error
    """

    name: str = keyed("class")
    shares: dict[str, Share]
    distances: dict[str, float]
    rule: str
    replicates: dict[str, int]
    measures: dict[str, Measure]
    least_share: float
    reason: str | None = None

    @property
    def words(self) -> str:
        """The verdict in a sentence."""
        total = sum(self.replicates.values())
        alike = ", ".join(f"{name} in {count}" for name, count in self.replicates.items() if self.rule == "undecided")
        found = f"{alike or max(self.replicates.values(), default=0)} of {counted(total, 'replicate')}"
        if self.name == "not judged":
            by_rule = f"; its orbit is {self.rule} ({found})" if self.rule != self.name else ""
            return f"Cage: not judged, because {self.reason}{by_rule}"
        return f"Cage: {self.name} ({found}{'' if self.reason is None else f'; {self.reason}'})"

    @property
    def short_words(self) -> str:
        """The class with the replicates that have it."""
        total = sum(self.replicates.values())
        if self.name == "undecided":
            return f"{self.name} ({self.cell})"
        same = f"{self.replicates[self.name]} of " if self.name in self.replicates else ""
        return f"{self.name} ({same}{counted(total, 'replicate')})" if total else self.name

    @property
    def cell(self) -> str:
        """The class in a cell of a table: 'held 8/8', or 'held 5, circling 3' where it is undecided."""
        total = sum(self.replicates.values())
        if self.name == "undecided":
            return ", ".join(f"{name} {count}" for name, count in self.replicates.items())
        return f"{self.name} {self.replicates[self.name]}/{total}" if self.name in self.replicates else self.name

    @property
    def largest_share(self) -> float | None:
        """Share of bearings alike that have the commonest class; None without replicates."""
        return max((share.mean for share in self.shares.values()), default=None)

    def share_of(self, names: Collection[str]) -> float:
        """Share of bearings alike whose class is one of these; 0 without replicates."""
        total = sum(self.replicates.values())
        return _share(sum(self.replicates.get(name, 0) for name in names), total).mean if total else 0.0

    def part_of(self, names: Collection[str]) -> float:
        """Part of the replicates whose class is one of these; 0 where the classes are only noted."""
        total = sum(self.replicates.values()) if self.name == self.rule else 0
        return sum(self.replicates.get(name, 0) for name in names) / total if total else 0.0

    def is_one_of(self, names: Collection[str]) -> bool | None:
        """Whether the class is one of these; None where the share of neither these nor the others is large enough, or none is judged."""
        if self.name != self.rule:
            return None
        if self.share_of(names) >= self.least_share:
            return True
        return False if self.share_of(self._others(names)) >= self.least_share else None

    def part_other_than(self, names: Collection[str]) -> float:
        """Part of the replicates that are judged to have none of these classes."""
        return self.part_of(self._others(names))

    def _others(self, names: Collection[str]) -> list[str]:
        """Classes of replicates that are none of these; a motion that is not judged may rattle or wander."""
        doubtful = {"not judged"} if {"rattling", "wandering"} & {*names} else set()
        return [name for name in self.replicates if name not in {*names, *doubtful}]


def _share(count: int, total: int) -> Share:
    """Beta(k + 1/2, n - k + 1) of k in n, mean and 90 % interval."""
    from scipy.special import betaincinv

    a, b = count + PRIOR_OF_CLASS, total - count + PRIOR_OF_OTHERS
    low, high = betaincinv(a, b, (0.05, 0.95))
    return Share(a / (a + b), float(low), float(high))


class Trial(NamedTuple):
    """What a replicate shows: measures of its cage's orbit, and what drives it."""

    orbit: Orbit
    forcing: Forcing


def cage_verdict(trials: Sequence[Trial], limits: Thresholds, reason: str | None = None) -> CageVerdict:
    """Verdict on a cage by its replicates; ``reason``: why their classes are only noted, if they are."""
    classes = [orbit_class(*trial, limits) for trial in trials]
    shares = class_shares(classes)
    rule = name = verdict(shares, limits)
    series = {key: np.array([getattr(trial.orbit, key) for trial in trials]) for key in MEASURES}
    needed = limits.fewest_replicates
    if reason is not None:
        name = "not judged"
    elif rule == "not judged":
        reason = "it neither holds still nor goes round, and verdict.rattling_turnover has no value"
    elif rule == "undecided" and len(trials) < needed:
        reason = f"a class needs {needed} replicates alike"
    elif rule == "undecided" and any(_apart(classes, values) for values in series.values()):
        reason = "two regimes last, and the start decides which"
    if all(trial.forcing.turnover is not None for trial in trials):
        series["turnover"] = np.array([trial.forcing.turnover for trial in trials])
    return CageVerdict(
        name=name,
        shares=shares,
        distances=_distances(series, limits, [trial.forcing for trial in trials]) if len(trials) > 1 else {},
        rule=rule,
        replicates=dict(Counter(classes).most_common()),
        measures={key: Measure(float(values.mean()), _error(values)) for key, values in series.items()},
        least_share=limits.least_share,
        reason=reason,
    )


def _apart(classes: Sequence[CageClass], values: Array) -> bool:
    """Whether a measure of two classes of two replicates at least is so far apart that no single regime scatters over their limit."""
    (first, most), (second, fewer) = Counter(classes).most_common(2)
    values_a, values_b = (values[[name == place for place in classes]] for name in (first, second))
    scatter = math.hypot(values_a.std(), values_b.std())
    return min(most, fewer) > 1 and abs(float(values_a.mean() - values_b.mean())) > TWO_REGIMES * scatter


def _error(values: Array) -> float | None:
    """Standard error of the mean; None of a single value."""
    return float(values.std(ddof=1) / math.sqrt(len(values))) if len(values) > 1 else None


def _distances(series: Mapping[str, Array], limits: Thresholds, forcing: Sequence[Forcing]) -> dict[str, float]:
    """Distance of the mean of each measure to its thresholds over its standard error; none of a measure that does not scatter."""
    radius, rate = series["radius"], series["rate"]
    fastest = np.array([max(limits.highest_rate, force.film_rate) for force in forcing])
    apart = [
        [abs(frequency - order) - limits.forced_band * abs(order) for order in force.orders]
        for frequency, force in zip(rate, forcing, strict=True)
    ]
    above = {
        "still_radius": radius - limits.still_radius,
        "offset": series["offset"] - radius,
        "moving_radius": radius - limits.moving_radius,
        "concentration": series["concentration"] - limits.concentration,
        "lowest_rate": rate - limits.lowest_rate,
        "highest_rate": rate - fastest,
        "forced_band": np.min(apart, axis=1),
    }
    if limits.rattling_turnover is not None and "turnover" in series:
        above["rattling_turnover"] = series["turnover"] - limits.rattling_turnover
    return {key: float(values.mean()) / error for key, values in above.items() if (error := _error(values))}
