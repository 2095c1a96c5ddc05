"""Whether inputs that were matched to measurements predict others, whether predictions are as wide as they state, and what may be claimed.

Rows held out are predicted from the rest; without enough of them every row is, from all others: particles of whichever
power serve best are weighed by the likelihood of those others. Predicted are the measured values themselves, with biases as
the other rows determine them and the errors of rig and simulation. How wide predictions are is tried in turn: half of the rows
predict the next, these together the one after it, and so on to the rows held out.

Sources: Gneiting and Raftery, Strictly proper scoring rules, J. Am. Statist. Assoc. 102 (2007) 359 (CRPS); Vehtari, Gelman
and Gabry, Practical Bayesian model evaluation using leave-one-out cross-validation (2017); Kass and Raftery, Bayes factors,
J. Am. Statist. Assoc. 90 (1995) 773.

Whether predictive distributions are as wide as they should be: too narrow and too wide both count against them.

Cells are predicted row by row, each row from those before it, so what is left over of one row shows nothing of the next.
Each cell becomes a normal score by its rank among the draws of its prediction (its probability integral transform), and the
scores of a row are made independent by their correlation among the draws. The sum of their squares is small where
predictions are too wide and large where they are too narrow. It is judged for all cells together and for each output apart;
the draws themselves, put in the place of the measured values, show how small the smallest of all these chances may be.

Sources: Dawid, Statistical theory: the prequential approach, J. R. Statist. Soc. A 147 (1984) 278; Westfall and Young,
Resampling-based multiple testing (1993), section 2.3, for the smallest of several chances.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import special

from doe.unknown.calibration import Matched
from doe.unknown.likelihood import BEYOND, Joint, Measured
from doe.unknown.posterior import Level, Sampled, effective
from rbdyn.base.arrays import Array, Mask, Whole

# Chance of a rejection, of either side, where predictions are right.
LEVEL = 0.05
# Predictions twice too wide, or too narrow, must be found at least this often, or the cells are too few to decide.
TWICE, OFTEN = 2.0, 0.5


class Scores(NamedTuple):
    """Predicted cells as independent standard normal scores: of the measured values (k,), of draws of the predictions
    (s, k), and the ``output`` (k,) that each belongs to."""

    measured: Array
    draws: Array
    output: Whole


@dataclass(frozen=True)
class Width:
    """How wide predictions of ``cells`` many cells are: the ``ratio`` of what the residuals scatter to what is predicted,
    the ``chance`` of as much in either direction, the ``output`` that shows it most (None: all together) and its own ratio;
    the ``power`` by which predictions twice too wide, and twice too narrow, would be rejected."""

    cells: int
    ratio: float
    chance: float
    output: int | None
    worst: float
    power: tuple[float, float]

    @property
    def rejected(self) -> bool:
        """Whether predictions are too wide or too narrow."""
        return self.chance <= LEVEL

    @property
    def enough(self) -> bool:
        """Whether the cells would show predictions that are twice too wide or too narrow."""
        return min(self.power) >= OFTEN


def scores_of(draws: Array, measured: Array, output: Whole) -> Scores:
    """Scores of the cells of a row, by draws (s, a) of its joint prediction."""
    count = len(draws)
    ranks = np.argsort(np.argsort(draws, axis=0, kind="stable"), axis=0)
    places = np.vstack([(draws < measured).sum(axis=0) * (count / (count + 1.0)), ranks])
    scores = special.ndtri((places + 0.5) / count)
    correlation = np.corrcoef(scores[1:].T).reshape(measured.size, measured.size)
    # Cells of one sensor may be as good as one.
    root = np.linalg.cholesky(correlation + 1e-6 * np.eye(measured.size))
    independent = np.linalg.solve(root, scores.T).T
    return Scores(independent[0], independent[1:], output)


def width(parts: Sequence[Scores]) -> Width:
    """How wide predictions are, of the scores of all rows that were predicted."""
    output = np.concatenate([each.output for each in parts])
    squares = np.hstack([np.vstack([each.measured, each.draws]) for each in parts]) ** 2
    names = np.unique(output)
    groups = np.column_stack([np.ones(output.size), *(output == name for name in names)]).astype(float)
    groups = groups if names.size > 1 else groups[:, :1]
    sums = squares @ groups
    sorted_sums = np.sort(sums[1:], axis=0)
    count = len(sorted_sums)

    def chances(of: Array) -> Array:
        """Chances (n, g) of sums (n, g) as small or as large among the draws, the smaller of both."""
        below = np.column_stack([np.searchsorted(s, v, "right") for s, v in zip(sorted_sums.T, of.T, strict=True)])
        above = count - np.column_stack([np.searchsorted(s, v) for s, v in zip(sorted_sums.T, of.T, strict=True)])
        return (1.0 + np.minimum(below, above)) / (count + 1.0)

    least = np.sort(chances(sums[1:]).min(axis=1))
    limit = least[max(int(LEVEL * count) - 1, 0)]
    found = chances(sums[:1])[0]
    worst = int(np.argmin(found))
    # Truths that scatter half as much as predicted, or twice.
    power = [float((chances(sums[1:] * by).min(axis=1) <= limit).mean()) for by in (TWICE**-2, TWICE**2)]
    ratios = np.sqrt(sums[0] / groups.sum(axis=0))
    chance = (1.0 + float(np.searchsorted(least, found.min(), "right"))) / (count + 1.0)
    name = None if worst == 0 else int(names[worst - 1])
    return Width(output.size, float(ratios[0]), chance, name, float(ratios[worst]), (power[0], power[1]))


# Rows held out that decide by themselves; share of cells that their interval is to hold.
ENOUGH, INSIDE = 3, 0.9
# Residuals beyond so many standard deviations are too large; Bayes factors from the first on show strongly that an output is
# not explained, and particles resolve them up to the second.
FAR, STRONG, MOST = 3.0, 10.0, 1e6
# Draws of a cell, of a row whose width is tried, and particles of each power that they are drawn from.
DRAWS, WIDTH_DRAWS, ENOUGH_OF = 800, 2000, 2000
ENDS = (0.5, 0.05, 0.95)
# A bias is seen from so many of its standard deviations on, which so many particles resolve.
TOLD, FEWEST = 3.0, 30

JointAt = Callable[[Array], Joint]


class Prediction(NamedTuple):
    """Cells predicted by the others: their ``places``, draws (s, k) after and before learning, and residuals (k,) in
    standard deviations."""

    places: Whole
    after: Array
    before: Array
    residuals: Array


@dataclass(frozen=True)
class Trial:
    """How well cells were predicted: whether ``held`` out, how many ``inside`` their 90 % interval of ``cells``, their mean
    CRPS after and before learning, and how wide predictions are."""

    held: bool
    cells: int
    inside: int
    crps: float
    crps_before: float
    width: Width


class Explanation(NamedTuple):
    """Whether the simulation explains an output: its ``name``, by how much measured values are constantly above simulated
    ones, the ``bias`` in logarithms (median, 5 and 95 %), the scale ``allowed``, the ``evidence``: the Bayes factor of an
    error beyond that (None where the simulation is exact); and the ``resolution``: the least bias that would be seen, as
    smaller ones pass for inputs (None: undecided)."""

    name: str
    bias: tuple[float, float, float]
    allowed: float
    evidence: float | None
    resolution: float | None

    @property
    def explained(self) -> bool:
        """Whether there is no strong evidence of an error beyond what is allowed; none is sought where none is allowed."""
        return self.evidence is None or self.evidence < STRONG


@dataclass(frozen=True, eq=False)
class Particles:
    """Some particles of every power, which come in no order, and the measured cells there."""

    levels: list[Level]
    joints: list[Joint]
    measured: Measured

    @classmethod
    def of(cls, found: Sampled, at: JointAt, measured: Measured) -> "Particles":
        """Those of a sample."""
        levels = [Level(each.power, each.points[:ENOUGH_OF], each.log_likelihood[:ENOUGH_OF]) for each in found.levels]
        return cls(levels, [at(level.points) for level in levels], measured)

    def draw(self, known: Whole, count: int, random: np.random.Generator) -> tuple[Array, Joint]:
        """Particles (count, d) of the posterior by some cells alone, of the power that serves it best, and the cells there."""
        weighed = [
            joint.log_density(self.measured.values, known) - level.power * level.log_likelihood
            for level, joint in zip(self.levels, self.joints, strict=True)
        ]
        best = int(np.argmax([effective(logs) for logs in weighed]))
        weights = np.exp(weighed[best] - weighed[best].max())
        rows = random.choice(len(weights), count, p=weights / weights.sum())
        return self.levels[best].points[rows], Joint(*(each[rows] for each in self.joints[best]))

    def predictions(self, known: Whole, asked: Whole, count: int, random: np.random.Generator) -> Array:
        """Draws (count, a) of asked cells where ``known`` ones are."""
        mean, own, roots = self.draw(known, count, random)[1].given(self.measured.values, known, asked)
        common = (roots @ random.standard_normal((count, roots.shape[2], 1)))[:, :, 0]
        return mean + common + np.sqrt(own) * random.standard_normal(mean.shape)


def by_others(particles: Particles, seed: int) -> Prediction:
    """Every training row, predicted by the others."""
    random, measured = np.random.default_rng(seed), particles.measured
    row = measured.row[measured.learnt]
    parts = [
        _prediction(particles, measured.learnt[row != each], measured.learnt[row == each], random)
        for each in np.unique(row)
    ]
    return Prediction(*(np.concatenate(each, axis=-1) for each in zip(*parts, strict=True)))


def held_out(particles: Particles, seed: int) -> Prediction:
    """The rows held out, predicted by all training rows."""
    measured = particles.measured
    return _prediction(particles, measured.learnt, np.flatnonzero(measured.held), np.random.default_rng(seed))


def reweighed(particles: Particles, known: Whole, seed: int) -> Array:
    """Particles (s, d) of the posterior by some cells alone."""
    return particles.draw(known, DRAWS, np.random.default_rng(seed))[0]


def _prediction(particles: Particles, known: Whole, asked: Whole, random: np.random.Generator) -> Prediction:
    after = particles.predictions(known, asked, DRAWS, random)
    before = particles.predictions(known[:0], asked, DRAWS, random)
    residuals = (particles.measured.values[asked] - after.mean(axis=0)) / after.std(axis=0)
    return Prediction(asked, after, before, residuals)


def sequential_scores(particles: Particles, seed: int) -> Iterator[Scores]:
    """Scores of half of the training rows and of the rows held out, each by all rows before it, in an order by chance."""
    random, measured = np.random.default_rng(seed), particles.measured
    rows = [
        [places[measured.row[places] == row] for row in random.permutation(np.unique(measured.row[places]))]
        for places in (measured.learnt, np.flatnonzero(measured.held))
    ]
    order, start = [*rows[0], *rows[1]], (len(rows[0]) + 1) // 2
    for place in range(start, len(order)):
        known, asked = np.concatenate(order[:place]), order[place]
        draws = particles.predictions(known, asked, WIDTH_DRAWS, random)
        yield scores_of(draws, measured.values[asked], measured.output[asked])


def trial(predicted: Prediction, particles: Particles, seed: int, *, held: bool) -> Trial:
    """How well cells were predicted."""
    truth = particles.measured.values[predicted.places]
    low, high = np.quantile(predicted.after, [0.5 - 0.5 * INSIDE, 0.5 + 0.5 * INSIDE], axis=0)
    inside = int(((truth >= low) & (truth <= high)).sum())
    after, before = (_crps(draws, truth) for draws in (predicted.after, predicted.before))
    return Trial(held, truth.size, inside, after, before, width(list(sequential_scores(particles, seed))))


def _crps(draws: Array, truth: Array) -> float:
    """Mean continuous ranked probability score of draws (s, k), in units of the truth (k,)."""
    half = len(draws) // 2
    apart = 0.5 * np.abs(draws[:half] - draws[half : 2 * half]).mean(axis=0)
    return float((np.abs(draws - truth).mean(axis=0) - apart).mean())


def explanations(names: Sequence[str], joint: Joint, beyond: Mask, measured: Measured, seed: int) -> list[Explanation]:
    """Of each output whether the simulation explains it, by particles of the posterior: cells there, and which errors
    go ``beyond`` (n, m) what is allowed."""
    middle, root = joint.latent(measured.values, measured.learnt)
    random = np.random.default_rng(seed)
    latent = middle + (root @ random.standard_normal((*middle.shape, 1)))[:, :, 0]
    listed = []
    for place, name in enumerate(names):
        cell = int(np.flatnonzero(measured.output == place)[0])
        biases = latent[:, place] * joint.roots[:, cell, place]
        median, low, high = np.quantile(biases, ENDS).tolist()
        # A bias beyond what is allowed is known no better than this, whatever it is.
        wide = biases[beyond[:, place]]
        resolution = float(TOLD * wide.std()) if wide.size >= FEWEST else None
        exact = measured.scales[place] == 0.0
        factor = None if exact else bayes_factor(float(beyond[:, place].mean()), 2.0 * BEYOND)
        listed.append(Explanation(name, (median, low, high), float(measured.scales[place]), factor, resolution))
    return listed


def bayes_factor(share: float, before: float) -> float:
    """Odds of a share of the posterior over those of its share before, as far as particles resolve them."""
    odds = share * (1.0 - before) / max((1.0 - share) * before, 1e-300)
    return float(np.clip(odds, 1.0 / MOST, MOST))


def joint_factor(beyond: Mask) -> float:
    """The Bayes factor of any output being beyond what is allowed, of particles (n, m)."""
    return bayes_factor(float(beyond.any(axis=1).mean()), 1.0 - (1.0 - 2.0 * BEYOND) ** beyond.shape[1])


@dataclass(frozen=True, eq=False)
class Judgement:
    """What may be claimed of a match: its ``trial``, each of the ``outputs``, the Bayes factor ``any_factor`` of any of them
    being off, ``residuals`` (c,) of all cells as the others predict them, and the ``particles`` behind it."""

    trial: Trial
    outputs: list[Explanation]
    any_factor: float
    residuals: Array
    particles: Particles


def judge(found: Matched, names: Sequence[str], seed: int) -> Judgement:
    """Judge a match that has a sample, whose outputs have names."""
    assert found.sampled is not None
    measured, points = found.measured, found.sampled.points
    particles = Particles.of(found.sampled, found.joint, measured)
    parts = [by_others(particles, seed)]
    enough = len(np.unique(measured.row[measured.held])) >= ENOUGH
    if enough:
        parts.append(held_out(particles, seed))
    residuals = np.zeros(measured.values.size)
    for part in parts:
        residuals[part.places] = part.residuals
    beyond = found.errors(points).beyond
    outputs = explanations(names, found.joint(points), beyond, measured, seed)
    return Judgement(
        trial(parts[-1], particles, seed, held=enough), outputs, joint_factor(beyond), residuals, particles
    )


def objections(given: Judgement, *, anything: bool, emulated: bool) -> list[str]:
    """Why inputs may not be called calibrated; nothing where they may. ``anything``: whether something was learned;
    ``emulated``: whether emulators predict the simulation there."""
    result, outputs = given.trial, given.outputs
    found = []
    for each in outputs:
        if not each.explained:
            off = f"{100.0 * np.expm1(each.bias[0]):+.2g} % off its level, {100.0 * each.allowed:.2g} % allowed"
            cause = "its sensor is biased or physics is missing"
            found.append(f"{each.name} is not explained: {off}, Bayes factor {each.evidence:.3g}; {cause}")
    if given.any_factor >= STRONG and not found:
        listed = " or ".join(each.name for each in sorted(outputs, key=lambda each: -(each.evidence or 0.0))[:2])
        found.append(f"{listed} is not explained, which of them is undecided: Bayes factor {given.any_factor:.3g}")
    if result.width.rejected:
        found.append(_width_words(result.width, [each.name for each in outputs]))
    elif not result.width.enough:
        wide, narrow = (100.0 * each for each in result.width.power)
        found.append(
            f"{result.width.cells} predicted values are too few to judge intervals: of tables like this, twice too wide shows in "
            f"{wide:.0f} %, twice too narrow in {narrow:.0f} %"
        )
    if not result.crps < result.crps_before:
        found.append("measured values are predicted no better than before")
    if not anything:
        found.append("no input or combination of inputs was learned")
    if not emulated:
        found.append("emulators do not predict the simulation at the inputs found")
    return found


def _width_words(given: Width, names: list[str]) -> str:
    """That predictions are too wide or too narrow, and where."""
    where = "measured values" if given.output is None else names[given.output]
    side = "wide" if given.worst < 1.0 else "narrow"
    words = f"predictions of {where} are too {side}: residuals scatter {given.worst:.2g} times as much as predicted"
    return f"{words} (chance {100.0 * given.chance:.2g} %)"
