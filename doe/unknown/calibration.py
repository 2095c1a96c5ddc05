"""Unknown inputs from measurements: history matching, a posterior that is simulated again, and how far its predictions are right.

History matching. Input sets at which the simulation cannot agree with the measurements are ruled out, in waves. The
implausibility of a cell is |z - m|/sqrt(V): the distance of the measured value from the emulator's mean in standard deviations
of rig, its sensors, emulator, integration and discrepancy together. New input sets spread over the plausible rest.

Predictions. Rows held out are predicted from the training rows. If there are too few of them, every row is predicted from all
others: particles of the power that serves best are weighted by the likelihood of those others. Predicted are the measured
values, with biases as the conditioning rows determine them and with the errors of rig and simulation. Rows are also predicted
in turn, each from those before it, which shows predictions that are too wide or too narrow (``width``).

Sources: Vernon, Goldstein and Bower, Galaxy formation: a Bayesian uncertainty analysis, Bayesian Analysis 5 (2010) 619
(history matching); Gneiting and Raftery, Strictly proper scoring rules, J. Am. Statist. Assoc. 102 (2007) 359 (CRPS); Vehtari,
Gelman and Gabry, Practical Bayesian model evaluation using leave-one-out cross-validation (2017); Kass and Raftery, Bayes
factors, J. Am. Statist. Assoc. 90 (1995) 773.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy import special

from doe.unknown import posterior
from doe.unknown.inputs import nested, spread_out
from doe.unknown.posterior import PARTICLES, Cells, Errors, Joint, Level, Measured, Sampled, Unseen, joint, sampled
from doe.unknown.propagation import MEDIAN_FIRST
from doe.unknown.width import Power, Scores, Width, prequential, scores_of, width
from rbdyn.base.arrays import Array, Mask, Whole
from rbdyn.base.faults import given
from rbdyn.base.records import Record, keyed

# Implausibility from which an input set is ruled out.
RULED_OUT = 3.0
# Share of the other variances below which emulators are good enough; relative change below which a volume is steady.
GOOD, STEADY = 0.25, 0.1
# Rounds in which plausible input sets propose others, if there are few.
ROUNDS = 12


def implausibility(cells: Cells, measured: Measured, quantiles: Array) -> tuple[Array, Array]:
    """Implausibility (n, k) of the training cells at quantiles (n, d), and the emulators' variance as a share of the others.

    The others are the variances (n, k) of rig, integration and discrepancy by row."""
    learnt = measured.learnt
    mean, doubt = (prediction[:, learnt] for prediction in cells.predict(quantiles))
    emulator = (doubt**2).sum(axis=2) + cells.left_out[learnt]
    output = measured.output[learnt]
    apart, rig = np.abs(measured.values[learnt] - mean), measured.variances[learnt]
    by_row = rig + (posterior.BY_ROW * measured.scales[output]) ** 2
    return apart / np.sqrt(emulator + by_row + measured.allowed[output] ** 2), emulator / by_row


def plausible(implausible: Array, wave: int) -> Mask:
    """Plausible input sets (n,): in the first wave one cell may be off, as emulators are still poor."""
    place = max(implausible.shape[1] - (2 if wave == 0 else 1), 0)
    return np.partition(implausible, place, axis=1)[:, place] < RULED_OUT


def ruling_out(implausible: Array) -> Whole:
    """Places of the cells that rule out every input set (n, k); if no single one does, of the two worst."""
    alone = np.flatnonzero((implausible >= RULED_OUT).all(axis=0))
    return alone if alone.size else np.argsort(-np.median(implausible, axis=0))[:2]


def more_sets(plausible_sets: Array, fits: Callable[[Array], Mask], count: int, random: np.random.Generator) -> Array:
    """Plausible quantiles (n, d) and others near them that ``fits`` accepts, ``count`` or more if there are as many."""
    for _ in range(ROUNDS):
        if len(plausible_sets) >= count or len(plausible_sets) < 3:
            break
        scores = special.ndtri(plausible_sets)
        first, second, third = random.integers(0, len(plausible_sets), (3, 4 * count))
        proposals = special.ndtr(scores[first] + 0.5 * (scores[second] - scores[third]))
        proposals = proposals.clip(1e-6, 1.0 - 1e-6)
        plausible_sets = np.vstack([plausible_sets, proposals[fits(proposals)]])
    return plausible_sets


# Input sets of a wave, at least and per input; candidates that measure a volume; sets simulated from the posterior.
FEWEST, EACH, CANDIDATES, TRIED = 64, 10, 16384, 50
# Mean square of standardized residuals of the posterior's runs above which emulators fail to predict them.
MISSED = 2.0


class Batch(NamedTuple):
    """Simulated cells (n, c) in logarithms at quantiles (n, d), their variances (n, c) and degrees of freedom (n, c)."""

    quantiles: Array
    values: Array
    variances: Array
    freedom: Whole

    def joined(self, other: "Batch") -> "Batch":
        """Both batches as one."""
        return Batch(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


class Unknowns(Record, eq=False):
    """Number of unknown inputs; ``quantiles`` turns normal scores (n, d) into their quantiles by the inputs' dependence."""

    inputs: int
    quantiles: Callable[[Array], Array] = special.ndtr


class Matched(Record, eq=False):
    """The result of a calibration.

    volumes : share of the prior that is plausible after each wave
    refuted : places of the cells that rule out every input set, else none
    sampled : the posterior; None where everything is refuted and the simulation is taken as exact
    posterior_runs, misfit : simulations of the posterior, and the mean square of standardized residuals there
    """

    measured: Measured
    unknowns: Unknowns
    batch: Batch
    cells: Cells
    volumes: list[float]
    refuted: list[int]
    sampled: Sampled | None
    posterior_runs: Batch | None
    misfit: float

    def quantiles(self, points: Array) -> Array:
        """Quantiles (n, d) of the inputs of particles."""
        return self.unknowns.quantiles(points[:, : self.unknowns.inputs])

    def errors(self, points: Array) -> Errors:
        """Errors of the simulation at particles, by output."""
        return self.measured.errors(points[:, self.unknowns.inputs :])

    def joint(self, points: Array) -> Joint:
        """Measured cells at particles."""
        return joint(self.cells, self.measured, self.quantiles(points), self.errors(points))


Simulate = Callable[[Array, int], Batch]


def sets_a_wave(inputs: int) -> int:
    """Number of input sets that a wave simulates for so many unknown inputs."""
    return max(FEWEST, EACH * inputs)


def matched(
    simulate: Simulate, measured: Measured, unknowns: Unknowns, seed: int, waves: int = 4, particles: int = PARTICLES
) -> Matched:
    """Calibrate the inputs: find those whose simulation agrees with the measurements.

    ``simulate(quantiles, number)`` runs input sets of the stage of that number. Raises what that raises, and RunError.
    """
    random = np.random.default_rng(seed)
    count, inputs = sets_a_wave(unknowns.inputs), unknowns.inputs
    candidates = nested(inputs, CANDIDATES, seed)
    points, volumes, refuted, batch, cells = candidates[:count], list[float](), list[int](), None, None
    for wave in range(waves):
        new = simulate(_dependent(unknowns, points), wave)
        measured = measured.with_scales(new.values) if batch is None else measured
        batch = new if batch is None else batch.joined(new)
        cells = _emulated(batch, measured, cells)
        apart, share = implausibility(cells, measured, _dependent(unknowns, candidates))
        fits = plausible(apart, wave)
        volumes.append(float(fits.mean()))
        if not fits.any():
            refuted = measured.learnt[ruling_out(apart)].tolist()
            break
        steady = wave > 0 and abs(volumes[-1] - volumes[-2]) < STEADY * volumes[-2]
        if steady or float(np.median(share[fits], axis=0).max()) < GOOD or wave == waves - 1:
            break
        agrees = partial(_agrees, unknowns, cells, measured, wave)
        points = _spread_over(candidates[fits], agrees, count, random)
    match = Matched(measured, unknowns, given(batch), given(cells), volumes, refuted, None, None, 0.0)
    # A discrepancy beyond the allowed one may still show patterns; an exact simulation that is refuted identifies nothing.
    return match if refuted and not measured.scales.any() else _posterior(simulate, match, seed, particles, random)


def _posterior(simulate: Simulate, match: Matched, seed: int, particles: int, random: np.random.Generator) -> Matched:
    """Sample the posterior and simulate some of it; where emulators fail there, they learn from these runs and it is sampled again."""
    for stage in (0, 1):
        size = match.unknowns.inputs + match.measured.scales.size
        sample = sampled(partial(_density, match), size, seed, particles)
        rows = random.choice(particles, TRIED, replace=False)
        trial = simulate(match.quantiles(sample.points[rows]), 100 + stage)
        match = replace(match, sampled=sample, posterior_runs=trial, misfit=_misfit(match.cells, trial))
        if match.misfit < MISSED:
            break
        if stage == 0:
            batch = match.batch.joined(trial)
            match = replace(match, batch=batch, cells=_emulated(batch, match.measured, match.cells))
    return match


def _density(match: Matched, points: Array) -> Array:
    return match.joint(points).log_density(match.measured.values, match.measured.learnt)


def _dependent(unknowns: Unknowns, quantiles: Array) -> Array:
    return unknowns.quantiles(special.ndtri(quantiles.clip(1e-9, 1.0 - 1e-9)))


def _agrees(unknowns: Unknowns, cells: Cells, measured: Measured, wave: int, quantiles: Array) -> Mask:
    """Plausible input sets (n,) among quantiles (n, d)."""
    return plausible(implausibility(cells, measured, _dependent(unknowns, quantiles))[0], wave)


def _spread_over(
    plausible_sets: Array, fits: Callable[[Array], Mask], count: int, random: np.random.Generator
) -> Array:
    """As many input sets evenly spread over the plausible ones."""
    candidates = more_sets(plausible_sets, fits, 4 * count, random)
    if len(candidates) > 20 * count:
        candidates = random.permutation(candidates)[: 20 * count]
    return spread_out(candidates, count)


def _emulated(batch: Batch, measured: Measured, before: Cells | None) -> Cells:
    allowance = measured.variances + (posterior.BY_ROW * measured.scales[measured.output]) ** 2
    # With an exact rig and no discrepancy the scatter of the runs themselves remains.
    allowance = np.maximum(allowance, 1e-3 * batch.values.var(axis=0) + 1e-12)
    return posterior.fit_cells(*batch, allowance=allowance, before=before)


def _misfit(cells: Cells, trial: Batch) -> float:
    """Mean square of residuals of simulations from the emulators, in standard deviations of emulators and runs."""
    mean, doubt = cells.predict(trial.quantiles)
    variances = (doubt**2).sum(axis=2) + cells.left_out + trial.variances.mean(axis=0)
    return float(((trial.values - mean) ** 2 / variances).mean())


# Validation rows that suffice by themselves; share of cells that an interval should hold.
ENOUGH, INSIDE = 3, 0.9
# Standard deviations beyond which a residual is an outlier; the largest Bayes factor that particles resolve.
FAR, MOST = 3.0, 1e6
# Draws of a cell, draws of a row for its width, and particles of each power that these are drawn from.
PREDICTION_DRAWS, WIDTH_DRAWS, ENOUGH_OF = 800, 2000, 2000

JointAt = Callable[[Array], Joint]


class Prediction(NamedTuple):
    """Cells at ``places`` predicted by the others: draws (s, k) after and before learning, ``residuals`` (k,) over their sd."""

    places: Whole
    after: Array
    before: Array
    residuals: Array


class Trial(Record):
    """How well the cells of a prediction were predicted, of rows "held out" or of "each condition in turn"."""

    rows: str
    cells: int = keyed("values")
    inside: int = keyed("inside_90_percent")
    crps: float
    crps_before: float
    width: Width


class Explanation(NamedTuple):
    """Whether the simulation explains an output.

    bias : how far measured values are constantly above simulated ones, in logarithms (median, 5 and 95 %)
    allowed, accuracy : scales of the bias that is allowed of the simulation, and of the sensor's offset
    evidence : Bayes factor of an error beyond these; None where the simulation is taken as exact
    unseen : the largest offset that inputs could imitate, where one is sought
    """

    name: str
    bias: tuple[float, float, float]
    allowed: float
    accuracy: float
    evidence: float | None
    unseen: Unseen | None

    @property
    def explained(self) -> bool:
        """Whether there is no strong evidence of an error beyond the allowed one; none is sought where none is allowed."""
        return self.evidence is None or self.evidence < posterior.STRONG


class Particles(Record, eq=False):
    """Some particles of every power, in no order, and the measured cells there."""

    levels: list[Level]
    joints: list[Joint]
    measured: Measured

    @classmethod
    def of(cls, sample: Sampled, joint_at: JointAt, measured: Measured) -> "Particles":
        """Particles of a sample."""
        levels = [
            Level(level.power, level.points[:ENOUGH_OF], level.log_likelihood[:ENOUGH_OF]) for level in sample.levels
        ]
        return cls(levels, [joint_at(level.points) for level in levels], measured)

    def draw(self, conditions: Whole, count: int, random: np.random.Generator) -> tuple[Array, Joint]:
        """Particles (count, d) of the posterior by the cells ``conditions`` alone, of the best power, and the cells there."""
        weighed = [
            joint.log_density(self.measured.values, conditions) - level.power * level.log_likelihood
            for level, joint in zip(self.levels, self.joints, strict=True)
        ]
        best = int(np.argmax([posterior.effective(logs) for logs in weighed]))
        weights = np.exp(weighed[best] - weighed[best].max())
        rows = random.choice(len(weights), count, p=weights / weights.sum())
        return self.levels[best].points[rows], Joint(*(array[rows] for array in self.joints[best]))

    def predictions(self, conditions: Whole, targets: Whole, count: int, random: np.random.Generator) -> Array:
        """Draws (count, a) of the cells ``targets``, conditional on the measured values of ``conditions``."""
        mean, variances, roots = self.draw(conditions, count, random)[1].conditional(
            self.measured.values, conditions, targets
        )
        common = (roots @ random.standard_normal((count, roots.shape[2], 1)))[:, :, 0]
        return mean + common + np.sqrt(variances) * random.standard_normal(mean.shape)


def by_others(particles: Particles, seed: int) -> Prediction:
    """Every training row, predicted by the others."""
    random, measured = np.random.default_rng(seed), particles.measured
    row = measured.row[measured.learnt]
    parts = [
        _prediction(particles, measured.learnt[row != number], measured.learnt[row == number], random)
        for number in np.unique(row)
    ]
    return Prediction(*(np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True)))


def held_out(particles: Particles, seed: int) -> Prediction:
    """The rows held out, predicted by all training rows."""
    measured = particles.measured
    return _prediction(particles, measured.learnt, np.flatnonzero(measured.validation), np.random.default_rng(seed))


def reweighed(particles: Particles, conditions: Whole, seed: int) -> Array:
    """Particles (s, d) of the posterior by the cells ``conditions`` alone."""
    return particles.draw(conditions, PREDICTION_DRAWS, np.random.default_rng(seed))[0]


def _prediction(particles: Particles, conditions: Whole, targets: Whole, random: np.random.Generator) -> Prediction:
    after = particles.predictions(conditions, targets, PREDICTION_DRAWS, random)
    before = particles.predictions(conditions[:0], targets, PREDICTION_DRAWS, random)
    residuals = (particles.measured.values[targets] - after.mean(axis=0)) / after.std(axis=0)
    return Prediction(targets, after, before, residuals)


def sequential_scores(particles: Particles, seed: int) -> Iterator[Scores]:
    """Scores of the rows that judge the width, each by all rows before it."""
    measured, random = particles.measured, np.random.default_rng(seed)
    order, start = prequential(measured.row, measured.validation, random)
    for place in range(start, len(order)):
        conditions, targets = np.concatenate(order[:place]), order[place]
        draws = particles.predictions(conditions, targets, WIDTH_DRAWS, random)
        yield scores_of(draws, measured.values[targets], measured.output[targets])


def trial(prediction: Prediction, particles: Particles, rows: str, seed: int, power: Power | None) -> Trial:
    """How well cells were predicted."""
    truth = particles.measured.values[prediction.places]
    low, high = np.quantile(prediction.after, [0.5 - 0.5 * INSIDE, 0.5 + 0.5 * INSIDE], axis=0)
    inside = int(((truth >= low) & (truth <= high)).sum())
    after, before = (_crps(draws, truth) for draws in (prediction.after, prediction.before))
    return Trial(rows, truth.size, inside, after, before, width(list(sequential_scores(particles, seed)), power))


def _crps(draws: Array, truth: Array) -> float:
    """Mean continuous ranked probability score of draws (s, k), in units of the truth (k,)."""
    half = len(draws) // 2
    apart = 0.5 * np.abs(draws[:half] - draws[half : 2 * half]).mean(axis=0)
    return float((np.abs(draws - truth).mean(axis=0) - apart).mean())


def explanations(names: Sequence[str], match: Matched, points: Array, seed: int) -> list[Explanation]:
    """Whether the simulation explains each output, by particles (n, d) of the posterior."""
    measured, joint, beyond = match.measured, match.joint(points), match.errors(points).beyond
    unseen = posterior.unseen_offsets(
        match.cells, measured, match.quantiles, points[:, : match.unknowns.inputs].mean(axis=0)
    )
    middle, root = joint.latent(measured.values, measured.learnt)
    latent = middle + (root @ np.random.default_rng(seed).standard_normal((*middle.shape, 1)))[:, :, 0]
    listed = []
    for place, name in enumerate(names):
        cell = int(np.flatnonzero(measured.output == place)[0])
        biases = latent[:, place] * joint.roots[:, cell, place]
        median, low, high = np.quantile(biases, MEDIAN_FIRST).tolist()
        scale, accuracy = float(measured.scales[place]), float(measured.accuracy[place])
        factor = None if scale == 0.0 else bayes_factor(float(beyond[:, place].mean()), 2.0 * posterior.BEYOND)
        listed.append(Explanation(name, (median, low, high), scale, accuracy, factor, unseen[place]))
    return listed


def bayes_factor(share: float, before: float) -> float:
    """Odds of a share of the posterior over the odds of the prior share, as far as particles resolve them."""
    odds = share * (1.0 - before) / max((1.0 - share) * before, 1e-300)
    return float(np.clip(odds, 1.0 / MOST, MOST))


def joint_factor(beyond: Mask) -> float:
    """The Bayes factor of an error beyond the allowed one in any output, from particles (n, m)."""
    return bayes_factor(float(beyond.any(axis=1).mean()), 1.0 - (1.0 - 2.0 * posterior.BEYOND) ** beyond.shape[1])


class Judgement(Record, eq=False):
    """What may be claimed of a calibration.

    trial, outputs : how well cells were predicted, and whether each output is explained
    any_factor : Bayes factor of an error beyond the allowed one in any output
    residuals : (c,), of all cells, each predicted by the others
    particles : those behind it
    """

    trial: Trial
    outputs: list[Explanation]
    any_factor: float
    residuals: Array
    particles: Particles


def judge(match: Matched, names: Sequence[str], seed: int, power: Power | None = None) -> Judgement:
    """Judge a calibration that has a sample; ``names`` are those of the outputs, ``power`` is that of the design."""
    measured, sample = match.measured, given(match.sampled)
    particles = Particles.of(sample, match.joint, measured)
    parts = [by_others(particles, seed)]
    enough = len(np.unique(measured.row[measured.validation])) >= ENOUGH
    if enough:
        parts.append(held_out(particles, seed))
    residuals = np.zeros(measured.values.size)
    for part in parts:
        residuals[part.places] = part.residuals
    beyond = match.errors(sample.points).beyond
    outputs = explanations(names, match, sample.points, seed)
    rows = "held out" if enough else "each condition in turn"
    result = trial(parts[-1], particles, rows, seed, power)
    return Judgement(result, outputs, joint_factor(beyond), residuals, particles)


def objections(judgement: Judgement, *, has_learned: bool, emulated: bool) -> list[str]:
    """Reasons why inputs may not be called calibrated; none where they may.

    ``has_learned``: whether anything was learned; ``emulated``: whether emulators predict the simulation there."""
    result, outputs = judgement.trial, judgement.outputs
    sentences = []
    for output in outputs:
        if not output.explained:
            off = f"{100.0 * np.expm1(output.bias[0]):+.2g} % off its level, {allowance_words(output.allowed, output.accuracy)}"
            cause = "its sensor is biased or physics is missing"
            sentences.append(f"{output.name} is not explained: {off}, Bayes factor {output.evidence:.3g}; {cause}")
    if judgement.any_factor >= posterior.STRONG and not sentences:
        listed = " or ".join(
            output.name for output in sorted(outputs, key=lambda output: -(output.evidence or 0.0))[:2]
        )
        sentences.append(
            f"{listed} is not explained, but it is undecided which: Bayes factor {judgement.any_factor:.3g}"
        )
    if result.width.rejected:
        sentences.append(_width_words(result.width, [output.name for output in outputs]))
    if not result.crps < result.crps_before:
        sentences.append("measured values are predicted no better than before")
    if not has_learned:
        sentences.append("no input or combination of inputs was learned")
    if not emulated:
        sentences.append("emulators do not predict the simulation at the inputs found")
    return sentences


def allowance_words(allowed: float, accuracy: float) -> str:
    """What an output may be off as a whole."""
    return f"{100.0 * allowed:.2g} % of the simulation and {100.0 * accuracy:.2g} % of the sensor allowed"


def _width_words(width: Width, names: list[str]) -> str:
    """The sentence that predictions are too wide or too narrow, and where."""
    where = "measured values" if width.output is None else names[width.output]
    side = "wide" if width.worst < 1.0 else "narrow"
    words = f"predictions of {where} are too {side}: residuals scatter {width.worst:.2g} times as much as predicted"
    return f"{words} (chance {100.0 * width.chance:.2g} %)"
