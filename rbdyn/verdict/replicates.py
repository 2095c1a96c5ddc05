"""Share of each class among bearings alike by the classes of replicates, and the class that they name."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import NamedTuple, get_args

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.records import Record, keyed
from rbdyn.base.words import counted
from rbdyn.verdict.orbits import CageClass, Forcing, Orbit, Thresholds, orbit_class

# Outcomes of a replicate in its prior: of a class, of another, undecided; the number of classes does not matter.
PRIOR_OF_CLASS, PRIOR_OF_OTHERS = 0.5, 1.0
MEASURES = [measure.name for measure in fields(Orbit)]


class Share(NamedTuple):
    """Share of a class among replicates: mean and 90 % interval."""

    mean: float
    low: float
    high: float


def class_shares(classes: Sequence[CageClass]) -> dict[str, Share]:
    """Share of each class among bearings alike, from those of replicates: Beta(k + 1/2, n - k + 1), mean and 90 % interval."""
    from scipy.special import betaincinv

    shares: dict[str, Share] = {}
    for name in get_args(CageClass):
        if count := classes.count(name):
            a, b = count + PRIOR_OF_CLASS, len(classes) - count + PRIOR_OF_OTHERS
            low, high = betaincinv(a, b, (0.05, 0.95))
            shares[name] = Share(a / (a + b), float(low), float(high))
    return shares


def verdict(shares: Mapping[str, Share], limits: Thresholds) -> str:
    """Class that has at least ``least_share`` of bearings alike, else undecided."""
    return next((name for name, share in shares.items() if share.mean >= limits.least_share), "undecided")


def fewest_replicates(limits: Thresholds) -> int:
    """Replicates that name a class where all are alike: least n with (n + 1/2)/(n + 3/2) at the least share."""
    share = limits.least_share
    prior = PRIOR_OF_CLASS + PRIOR_OF_OTHERS
    return max(math.ceil((prior * share - PRIOR_OF_CLASS) / (1.0 - share) - 1e-9), 1)


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
    - ``measures``: "offset" and "radius" over the radial play, "concentration" of the spectrum, "rate" over the speed of the cage, and
      "turnover" of its energy in a cage turn: mean and standard error
    """

    name: str = keyed("class")
    shares: dict[str, Share]
    distances: dict[str, float]
    rule: str
    replicates: dict[str, int]
    measures: dict[str, Measure]
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


class Trial(NamedTuple):
    """What a replicate shows: measures of its cage's orbit, and what drives it."""

    orbit: Orbit
    forcing: Forcing


def cage_verdict(trials: Sequence[Trial], limits: Thresholds, reason: str | None = None) -> CageVerdict:
    """Verdict on a cage by its replicates; ``reason``: why their classes are only noted, if they are."""
    classes = [orbit_class(*trial, limits) for trial in trials]
    shares = class_shares(classes)
    rule = name = verdict(shares, limits)
    needed = fewest_replicates(limits)
    if reason is not None:
        name = "not judged"
    elif rule == "not judged":
        reason = "it neither holds still nor goes round, and verdict.rattling_turnover has no value"
    elif rule == "undecided" and len(trials) < needed:
        reason = f"a class needs {needed} replicates alike"
    series = {key: np.array([getattr(trial.orbit, key) for trial in trials]) for key in MEASURES}
    if all(trial.forcing.turnover is not None for trial in trials):
        series["turnover"] = np.array([trial.forcing.turnover for trial in trials])
    return CageVerdict(
        name=name,
        shares=shares,
        distances=_distances(series, limits, [trial.forcing for trial in trials]) if len(trials) > 1 else {},
        rule=rule,
        replicates=dict(Counter(sorted(classes))),
        measures={key: Measure(float(values.mean()), _error(values)) for key, values in series.items()},
        reason=reason,
    )


def _error(values: Array) -> float | None:
    """Standard error of the mean; None of a single value."""
    return float(values.std(ddof=1) / math.sqrt(len(values))) if len(values) > 1 else None


def _distances(series: Mapping[str, Array], limits: Thresholds, forcing: Sequence[Forcing]) -> dict[str, float]:
    """Distance of the mean of each measure to its thresholds over its standard error; none of a measure that does not scatter."""
    radius, rate = series["radius"], series["rate"]
    fastest = np.array([max(limits.highest_rate, one.film_rate) for one in forcing])
    apart = [
        [abs(own - order) - limits.forced_band * abs(order) for order in one.orders]
        for own, one in zip(rate, forcing, strict=True)
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
