"""Share of each class among bearings alike by the classes of replicates, and the class that they name."""

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from typing import NamedTuple, get_args

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.records import Record, keyed
from rbdyn.base.words import counted
from rbdyn.verdict.orbits import PRIOR_OF_CLASS, PRIOR_OF_OTHERS, CageClass, Forcing, Orbit, Thresholds, orbit_class

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

    def mostly_other_than(self, names: Collection[str]) -> bool:
        """Whether more than half of the replicates are judged to have none of these classes."""
        return self.part_of(self._others(names)) > 0.5

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
