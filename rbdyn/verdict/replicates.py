"""Share of each class among bearings alike by the classes of replicates, and the class that they name."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from rbdyn.verdict.orbits import CageClass, Thresholds

# Outcomes of a replicate in its prior: of a class, of another, undecided; the number of classes does not matter.
PRIOR_OF_CLASS, PRIOR_OF_OTHERS = 0.5, 1.0


@dataclass(frozen=True)
class Share:
    """Share of a class among replicates: mean and 90 % interval."""

    mean: float
    low: float
    high: float


def class_shares(classes: Sequence[CageClass]) -> dict[CageClass, Share]:
    """Share of each class among bearings alike, from those of replicates: Beta(k + 1/2, n - k + 1), mean and 90 % interval."""
    from scipy.special import betaincinv

    shares = {}
    for name in get_args(CageClass):
        if count := classes.count(name):
            a, b = count + PRIOR_OF_CLASS, len(classes) - count + PRIOR_OF_OTHERS
            low, high = betaincinv(a, b, (0.05, 0.95))
            shares[name] = Share(a / (a + b), float(low), float(high))
    return shares


def verdict(classes: Sequence[CageClass], limits: Thresholds) -> CageClass | Literal["undecided"]:
    """Class that has at least ``least_share`` of bearings alike by its replicates, else undecided."""
    for name, share in class_shares(classes).items():
        if share.mean >= limits.least_share:
            return name
    return "undecided"
