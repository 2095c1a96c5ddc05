"""Whether inputs that were matched to measurements foretell others, and what may be claimed.

Rows held out are foretold from the rest; without enough of them every row is, from all others: particles of whichever
power serve best are weighed by the likelihood of those others. Foretold are the measured values themselves, with biases as
the other rows tell them and the errors of rig and simulation.

Sources: Gneiting and Raftery, Strictly proper scoring rules, J. Am. Statist. Assoc. 102 (2007) 359 (CRPS); Vehtari, Gelman
and Gabry, Practical Bayesian model evaluation using leave-one-out cross-validation (2017).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import stats

from doe.arrays import Array, Whole
from doe.unknown.discrepancy import Joint, Measured
from doe.unknown.sampler import Level, Sampled, effective

# Rows held out that tell by themselves; share of cells inside their interval; chance below which a coverage is rejected.
ENOUGH, INSIDE, REJECTED = 3, 0.9, 0.05
# A discrepancy above this many scales, and residuals beyond this many standard deviations, are too large.
GROWN, FAR = 2.0, 3.0
# Draws of a cell, and particles of each power that they are drawn from.
DRAWS, ENOUGH_OF = 800, 2000

JointAt = Callable[[Array], Joint]


class Foretold(NamedTuple):
    """Cells foretold by the others: their ``places``, draws (s, k) after and before learning, and residuals (k,) in
    standard deviations."""

    places: Whole
    after: Array
    before: Array
    residuals: Array


@dataclass(frozen=True)
class Trial:
    """How well cells were foretold: whether ``held`` out, how many ``inside`` their 90 % interval of ``cells``, their mean
    CRPS after and before learning, and the residual by cell."""

    held: bool
    cells: int
    inside: int
    crps: float
    crps_before: float

    @property
    def rejected(self) -> bool:
        """Whether so few inside are hardly chance."""
        return bool(stats.binom.cdf(self.inside, self.cells, INSIDE) < REJECTED)


def by_others(found: Sampled, at: JointAt, measured: Measured, seed: int) -> Foretold:
    """Every row that teaches, foretold by the other rows that do."""
    random = np.random.default_rng(seed)
    levels, joints = _levels(found, at)
    parts = []
    for row in np.unique(measured.row[measured.learnt]):
        asked = measured.learnt[measured.row[measured.learnt] == row]
        known = measured.learnt[measured.row[measured.learnt] != row]
        best, logs = _weighed(levels, joints, measured, known)
        parts.append(_foretold(joints[best], logs, at, found.levels[0], measured, known, asked, random))
    return Foretold(*(np.concatenate(each, axis=-1) for each in zip(*parts, strict=True)))


def reweighed(found: Sampled, at: JointAt, measured: Measured, known: Whole, seed: int) -> Array:
    """Particles (s, d) of the posterior by some cells alone."""
    levels, joints = _levels(found, at)
    best, logs = _weighed(levels, joints, measured, known)
    return levels[best].points[_drawn(logs, np.random.default_rng(seed))]


def _levels(found: Sampled, at: JointAt) -> tuple[list[Level], list[Joint]]:
    """Some particles of every power, which come in no order, and the cells there."""
    levels = [Level(each.power, each.points[:ENOUGH_OF], each.log_likelihood[:ENOUGH_OF]) for each in found.levels]
    return levels, [at(level.points) for level in levels]


def _weighed(levels: list[Level], joints: list[Joint], measured: Measured, known: Whole) -> tuple[int, Array]:
    """Which level serves best for the posterior by some cells alone, and logarithms (n,) of its particles' weights."""
    weighed = [
        joint.log_density(measured.values, known) - level.power * level.log_likelihood
        for level, joint in zip(levels, joints, strict=True)
    ]
    best = int(np.argmax([effective(logs) for logs in weighed]))
    return best, weighed[best]


def _drawn(logs: Array, random: np.random.Generator) -> Whole:
    weights = np.exp(logs - logs.max())
    return random.choice(len(logs), DRAWS, p=weights / weights.sum())


def held_out(found: Sampled, at: JointAt, measured: Measured, seed: int) -> Foretold:
    """The rows held out, foretold by all that teach."""
    points = found.points
    asked = np.flatnonzero(measured.held)
    random = np.random.default_rng(seed)
    return _foretold(at(points), np.zeros(len(points)), at, found.levels[0], measured, measured.learnt, asked, random)


def _foretold(
    joint: Joint, logs: Array, at: JointAt, prior: Level, measured: Measured, known: Whole, asked: Whole,
    random: np.random.Generator,
) -> Foretold:  # fmt: skip
    rows = _drawn(logs, random)
    mean, sd = Joint(*(each[rows] for each in joint)).given(measured.values, known, asked)
    after = mean + sd * random.standard_normal(mean.shape)
    mean, sd = at(prior.points[:DRAWS]).given(measured.values, known[:0], asked)
    before = mean + sd * random.standard_normal(mean.shape)
    residuals = (measured.values[asked] - after.mean(axis=0)) / after.std(axis=0)
    return Foretold(asked, after, before, residuals)


def trial(foretold: Foretold, measured: Measured, *, held: bool) -> Trial:
    """How well cells were foretold."""
    truth = measured.values[foretold.places]
    low, high = np.quantile(foretold.after, [0.5 - 0.5 * INSIDE, 0.5 + 0.5 * INSIDE], axis=0)
    inside = int(((truth >= low) & (truth <= high)).sum())
    return Trial(held, truth.size, inside, *(_crps(draws, truth) for draws in (foretold.after, foretold.before)))


def _crps(draws: Array, truth: Array) -> float:
    """Mean continuous ranked probability score of draws (s, k), in units of the truth (k,)."""
    half = len(draws) // 2
    apart = 0.5 * np.abs(draws[:half] - draws[half : 2 * half]).mean(axis=0)
    return float((np.abs(draws - truth).mean(axis=0) - apart).mean())


def objections(result: Trial, taus: dict[str, tuple[float, float]], *, anything: bool, foretells: bool) -> list[str]:
    """Why inputs may not be called calibrated; nothing where they may. ``taus``: discrepancy and its scale by output;
    ``anything``: whether something was learned; ``foretells``: whether emulators foretell the simulation there."""
    found = []
    if result.rejected:
        found.append(f"only {result.inside} of {result.cells} measured values lie in their 90 % interval")
    if not result.crps < result.crps_before:
        found.append("measured values are foretold no better than before")
    found += [
        f"{name} needs a discrepancy of {100.0 * tau:.0f} %, beyond twice the {100.0 * scale:.0f} % allowed: physics is missing"
        for name, (tau, scale) in taus.items()
        if scale > 0.0 and tau >= GROWN * scale
    ]
    if not anything:
        found.append("no input or combination of inputs was learned")
    if not foretells:
        found.append("emulators do not foretell the simulation at the inputs found")
    return found
