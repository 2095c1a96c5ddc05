"""Posterior samples of unknown inputs: the likelihood of measurements, sampling, what they identify, and offsets they do not see.

Emulators. The measured cells of a table are correlated, so a few principal components hold the effect of the inputs on all
of them; each component has an emulator of its own. Cells are in units of their allowed deviation. Components are left out once
the signal in the rest is small compared with it. The known part of the scatter is subtracted from components and rest.

Likelihood, in logarithms: z_cj = eta_j(c, theta) + b_j + o_j + e_cj + eps. Output j has in all rows c one bias of the
simulation, b_j ~ N(0, tau_j^2), and one offset of its sensor, o_j ~ N(0, a_j^2) of stated accuracy a_j; in each row it has an
error e_cj ~ N(0, (0.3 rho_j)^2). All three are integrated out: cells are jointly normal with covariance diag(V) + U U'.
U has a column for each output, of size (tau_j^2 + a_j^2)^(1/2) in its rows, and for each component of the emulators' error.
tau_j and rho_j are sampled with the inputs.

Each output is of one of three kinds, so that the sample itself shows whether the model explains it:
- as allowed: tau_j is half-normal of the allowed scale, rho_j = tau_j
- off in its level: tau_j is half-normal of the range of the output, rho_j is at most the allowed scale; a biased sensor,
  and so the heavy tail of o_j: a Student t for o_j itself would explain a biased sensor, which then is not found
- off row by row: the same tau_j, and rho_j = tau_j; missing physics
The odds of the last two kinds in the posterior over those in the prior are a Bayes factor.

Sampling is by sequential Monte Carlo: the likelihood is switched on in powers from 0 to 1. Particles are in normal scores,
whose prior is standard normal. At each power half of the particles still count; these are drawn again and moved by differences
of others, which point along ridges and from mode to mode. Each half is moved by differences within the other half, so every
move keeps the posterior.

Contraction is 1 - sd after / sd before in quantiles of the prior, so it does not depend on units or laws. Along a ridge no
input contracts and yet a combination is identified: one of logarithms whose variance is a small share of the prior's.

Unknown inputs can imitate an offset of a sensor, which a calibration then does not see. It is found by the Bayes factor of a bias beyond the allowed one. Near the posterior's mean the cells are
linear in the normal scores x of the inputs, with slopes G; their prior is N(0, I), and the errors that are allowed have the
covariance C. An offset o in all rows of output j, a vector 1_j, is then estimated with the variance 1/(1_j' M^-1 1_j), where
M = C + G G' without the bias of that output. What inputs imitate makes this variance large. The largest offset that is not seen
is the one at which the factor reaches what counts as strong. Taken for inputs it moves their mean by G'(C + G G')^-1 1_j o.

Sources: Kennedy and O'Hagan, Bayesian calibration of computer models, J. R. Statist. Soc. B 63 (2001) 425; Higdon, Gattiker,
Williams and Rightley, Computer model calibration using high-dimensional output, Journal of the American Statistical
Association 103 (2008) 570; Box and Tiao, A Bayesian approach to some outlier problems, Biometrika 55 (1968) 119, for the wide
alternative next to the usual error; Del Moral, Doucet and Jasra, Sequential Monte Carlo samplers (2006); Jasra et al.,
Inference for Levy-driven stochastic volatility models via adaptive SMC (2011) for the powers; ter Braak, Differential
evolution Markov chain (2006); Kass and Raftery, Bayes factors, J. Am. Statist. Assoc. 90 (1995) 773 (10: strong evidence); Brynjarsdottir and O'Hagan,
Learning about physical parameters: the importance of model discrepancy, Inverse Problems 30 (2014) 114007 (inputs that take up
a discrepancy).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import linalg, optimize, special

from doe.emulator import Emulator, NoisyValues, fit_emulator
from rbdyn.base.arrays import Array, Mask, Whole, one_thread
from rbdyn.base.faults import RunError
from rbdyn.base.records import Record, outside_json

# Signal that may be left out, as a share of the variance that a cell is compared with; components at most.
LEFT_OUT, MOST = 0.05, 12


class Cells(Record, eq=False):
    """Emulators of components: ``middle`` (c,) and ``axes`` (p, c) of the cells, and the variance (c,) of what is left out."""

    middle: Array
    axes: Array
    emulators: list[Emulator]
    left_out: Array

    def mean(self, quantiles: Array) -> Array:
        """Cells (n, c) at quantiles (n, d)."""
        return self.middle + np.column_stack([emulator.mean(quantiles) for emulator in self.emulators]) @ self.axes

    def predict(self, quantiles: Array) -> tuple[Array, Array]:
        """Cells (n, c) and their standard errors by component (n, c, p): their squares and ``left_out`` sum to the variance."""
        mean, sd = (
            np.column_stack(column) for column in zip(*(e.predict(quantiles) for e in self.emulators), strict=True)
        )
        return self.middle + mean @ self.axes, sd[:, None, :] * self.axes.T[None]


def fit_cells(
    quantiles: Array, values: Array, variances: Array, freedom: Whole, allowance: Array, before: Cells | None = None
) -> Cells:
    """Emulators of cells (n, c) at quantiles (n, d) with variances (n, c) by ``freedom`` (n, c) degrees of freedom.

    ``allowance`` (c,): variance that a deviation of each cell is compared with; ``before``: emulators of most of these runs.
    """
    unit = np.sqrt(allowance)
    noise = NoisyValues(values, variances, freedom).smooth(quantiles) / allowance
    middle = values.mean(axis=0)
    coded = (values - middle) / unit
    _, sizes, axes = np.linalg.svd(coded, full_matrices=False)
    # The variance of a component less the part of scatter.
    signal = (sizes**2 / len(coded) - axes**2 @ noise.mean(axis=0)).clip(0.0)
    remainder = np.append(np.cumsum(signal[::-1])[::-1][1:], 0.0)
    count = min(int(np.argmax(remainder <= LEFT_OUT * unit.size)) + 1, MOST, len(signal))
    axes = axes[:count]
    scores = coded @ axes.T
    # Scatter that the components do not contain.
    scatter = (np.eye(unit.size) - axes.T @ axes) ** 2 @ noise.mean(axis=0)
    left_out = ((coded - scores @ axes) ** 2).mean(axis=0) - scatter
    emulators = []
    for place, column in enumerate(scores.T):
        same = before is not None and place < len(before.emulators)
        start = before.emulators[place].hyperparameters if before is not None and same else None
        emulators.append(fit_emulator(quantiles, column, noise @ axes[place] ** 2, trend="quadratic", start=start))
    return Cells(middle, axes * unit, emulators, left_out.clip(0.0) * allowance)


# Scatter of the simulation's error from row to row, as a share of its bias.
BY_ROW = 0.3
# Allowed unless a scale is stated: this share of the scatter of an output over the unknown inputs. A tenth leaves the patterns
# of the inputs visible: if one output alone identifies an input, such an error moves it by a tenth of its range.
SHARE = 0.1
# Prior probability of each of the two kinds beyond what is allowed, and their least scale in allowed scales.
BEYOND, WIDER = 0.05, 3.0


class Errors(NamedTuple):
    """Sizes of the simulation's errors at n particles by output.

    level, rows : (n, m), tau of the bias and rho of the rows
    beyond : (n, m), whether they exceed what is allowed
    """

    level: Array
    rows: Array
    beyond: Mask


class Measured(Record, eq=False):
    """Measured cells, in logarithms.

    values, variances : (c,), measured, and variances of rig and integration
    output, row : (c,), to which each cell belongs
    scales : (m,), of the discrepancy that is allowed of each output; NaN until ``with_scales`` where none is stated
    validation : (c,), whether a cell is held out
    accuracy : (m,), standard deviation of the offset of each output's sensor
    spread : (m,), scatter of each output over the prior of the inputs
    """

    values: Array
    variances: Array
    output: Whole
    row: Whole
    scales: Array
    validation: Mask
    accuracy: Array
    spread: Array | None = None

    @property
    def learnt(self) -> Whole:
        """Places of the training cells."""
        return np.flatnonzero(~self.validation)

    @property
    def allowed(self) -> Array:
        """Scales (m,) of offsets of whole outputs that are allowed, of simulation and sensor together."""
        return np.hypot(self.scales, self.accuracy)

    @property
    def wide(self) -> Array:
        """Scales (m,) of discrepancies beyond the allowed ones."""
        spread = np.zeros(self.scales.size) if self.spread is None else self.spread
        return np.where(self.scales > 0.0, np.maximum(spread, WIDER * self.allowed), 0.0)

    def with_scales(self, simulated: Array) -> "Measured":
        """The same with default scales where none is stated, from cells (n, c) simulated over the prior of the inputs.

        A default is a share of the standard deviation within rows: differences between rows are no uncertainty of the inputs.
        """
        square = simulated.var(axis=0)
        outputs = range(self.scales.size)
        spread = np.sqrt([square[self.output == place].mean() for place in outputs]).clip(1e-6)
        return replace(self, scales=np.where(np.isnan(self.scales), SHARE * spread, self.scales), spread=spread)

    def errors(self, scores: Array) -> Errors:
        """Errors of the simulation at normal scores (n, m), which are quantiles of the prior of each output's errors."""
        quantiles = special.ndtr(scores)
        within = 1.0 - 2.0 * BEYOND
        beyond, rows_too = quantiles > within, quantiles > 1.0 - BEYOND
        share = np.where(beyond, (quantiles - np.where(rows_too, 1.0 - BEYOND, within)) / BEYOND, quantiles / within)
        size = special.ndtri(0.5 + 0.5 * share.clip(0.0, 1.0 - 1e-15))
        level = size * np.where(beyond, self.wide, self.scales)
        rows = np.where(beyond & ~rows_too, np.minimum(level, self.scales), level)
        return Errors(level, rows, beyond & (self.scales > 0.0))


class Joint(NamedTuple):
    """Cells as jointly normal at n input sets: mean (n, c), own variances (n, c), common roots U (n, c, r)."""

    mean: Array
    variances: Array
    roots: Array

    def log_density(self, values: Array, cells: Whole) -> Array:
        """Logarithm (n,) of the density of the ``values`` (c,) at the places ``cells`` (k,), by Woodbury's identity."""
        variances, roots = self.variances[:, cells], self.roots[:, cells]
        off = values[cells] - self.mean[:, cells]
        weighed = roots / variances[:, :, None]
        factor = np.linalg.cholesky(np.eye(roots.shape[2]) + np.swapaxes(roots, 1, 2) @ weighed)
        inside = np.linalg.solve(factor, np.einsum("ncr,nc->nr", weighed, off)[:, :, None])[:, :, 0]
        determinant = np.log(variances).sum(axis=1) + 2.0 * np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
        return -0.5 * (
            (off**2 / variances).sum(axis=1) - (inside**2).sum(axis=1) + determinant + cells.size * np.log(2.0 * np.pi)
        )

    def latent(self, values: Array, conditions: Whole) -> tuple[Array, Array]:
        """Mean (n, r) and root C (n, r, r) of the covariance CC' of the latent variables behind the common roots.

        They are conditional on the ``values`` (c,) at the places ``conditions`` (k,). U times them is common to all cells.
        """
        roots = np.swapaxes(self.roots[:, conditions] / self.variances[:, conditions, None], 1, 2)
        information = np.eye(self.roots.shape[2]) + roots @ self.roots[:, conditions]
        inverse = np.linalg.inv(np.linalg.cholesky(information))
        mean = np.swapaxes(inverse, 1, 2) @ (
            inverse @ (roots @ (values[conditions] - self.mean[:, conditions])[:, :, None])
        )
        return mean[:, :, 0], np.swapaxes(inverse, 1, 2)

    def conditional(self, values: Array, conditions: Whole, targets: Whole) -> tuple[Array, Array, Array]:
        """Cells at the places ``targets`` (a,), conditional on the ``values`` (c,) at the places ``conditions`` (k,).

        Returns their mean (n, a), own variances (n, a) and common roots (n, a, r).
        """
        middle, root = self.latent(values, conditions)
        across = self.roots[:, targets]
        return self.mean[:, targets] + (across @ middle[:, :, None])[:, :, 0], self.variances[:, targets], across @ root


def joint(cells: Cells, measured: Measured, quantiles: Array, errors: Errors) -> Joint:
    """Measured cells at input sets (n, d) with errors of the simulation (n, m)."""
    mean, doubt = cells.predict(quantiles)
    variances = measured.variances + cells.left_out + (BY_ROW * errors.rows[:, measured.output]) ** 2
    level = np.hypot(errors.level, measured.accuracy)[:, measured.output, None]
    biases = level * (measured.output[:, None] == np.arange(measured.scales.size))
    return Joint(mean, variances, np.concatenate([biases, doubt], axis=2))


PARTICLES = 4000
# Effective share of particles at the next power; accepted moves per particle there, and at the last power; most sweeps.
COUNTING, ACCEPTED, ACCEPTED_LAST, MOST_SWEEPS = 0.5, 2.0, 4.0, 24
# Acceptance rate that the length of moves aims at; share of moves of full length, from mode to mode; scatter off the line.
AIM, LEAPS, BESIDE = 0.25, 0.1, 1e-3

LogDensity = Callable[[Array], Array]


class Level(NamedTuple):
    """Particles (n, d) of the prior times the likelihood to a power, and the logarithms (n,) of the likelihood."""

    power: float
    points: Array
    log_likelihood: Array


class Sampled(Record):
    """Particles at every power, the last of which is 1, and the logarithm of the evidence, the prior mean of the likelihood."""

    levels: list[Level]
    log_evidence: float

    @property
    def points(self) -> Array:
        """Particles (n, d) of the posterior, in normal scores."""
        return self.levels[-1].points


@one_thread
def sampled(log_likelihood: LogDensity, inputs: int, seed: int, particles: int = PARTICLES) -> Sampled:
    """Sample a posterior over ``inputs`` normal scores by an even number of ``particles``.

    Raises RunError if no input set has a finite likelihood.
    """
    random = np.random.default_rng(seed)
    points = random.standard_normal((particles, inputs))
    logs = log_likelihood(points)
    if not np.isfinite(logs).any():
        raise RunError("calibration: no input set has a finite likelihood; check the measured values and their errors")
    levels, evidence, power, length = [Level(0.0, points, logs)], 0.0, 0.0, 1.0
    while power < 1.0:
        step = _step(logs, 1.0 - power)
        weights, mean = _weights(step * logs)
        evidence, power = evidence + mean, 1.0 if step == 1.0 - power else power + step
        rows = np.searchsorted(np.cumsum(weights), (np.arange(particles) + random.random()) / particles)
        rows = random.permutation(rows.clip(max=particles - 1))
        points, logs, length = _moved(points[rows], logs[rows], power, length, log_likelihood, random)
        levels.append(Level(power, points, logs))
    return Sampled(levels, evidence)


def effective(log_weights: Array) -> float:
    """Effective sample size: the number of equally weighted particles of the same variance."""
    return float(1.0 / (_weights(log_weights)[0] ** 2).sum())


def _weights(logs: Array) -> tuple[Array, float]:
    """Weights (n,) that sum to 1, and the logarithm of the mean of the weights before that."""
    most = float(logs.max())
    weights = np.exp(logs - most)
    return weights / weights.sum(), most + float(np.log(weights.mean()))


def _step(logs: Array, step: float) -> float:
    """Increase of the power, ``step`` at most, at which the effective share of particles falls to COUNTING."""
    if effective(step * logs) >= COUNTING * logs.size:
        return step
    low, high = 0.0, step
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle * logs) >= COUNTING * logs.size else (low, middle)
    # However steep the likelihood is, the power increases.
    return max(low, 1e-12)


def _moved(
    points: Array, logs: Array, power: float, length: float, log_likelihood: LogDensity, random: np.random.Generator
) -> tuple[Array, Array, float]:
    """Particles after enough accepted moves on average, the logarithms of their likelihood, and the length of moves."""
    points, logs = points.copy(), logs.copy()
    half, inputs = len(points) // 2, points.shape[1]
    usual, accepted = 2.38 / np.sqrt(2.0 * inputs), 0.0
    for _ in range(MOST_SWEEPS):
        share = []
        for mine, other in ((slice(None, half), slice(half, None)), (slice(half, None), slice(None, half))):
            here, there = points[mine], points[other]
            pairs = random.integers(0, len(there), (2, len(here)))
            leap = np.where(random.random(len(here)) < LEAPS, 1.0, length * usual)
            proposals = here + leap[:, None] * (there[pairs[0]] - there[pairs[1]])
            proposals += BESIDE * random.standard_normal(here.shape)
            densities = log_likelihood(proposals)
            ratio = power * (densities - logs[mine]) - 0.5 * ((proposals**2).sum(axis=1) - (here**2).sum(axis=1))
            take = np.log(random.random(len(here))) < ratio
            points[mine] = np.where(take[:, None], proposals, here)
            logs[mine] = np.where(take, densities, logs[mine])
            share.append(float(take.mean()))
        accepted += float(np.mean(share))
        length = float(np.clip(length * np.exp(np.mean(share) - AIM), 0.1, 2.0))
        if accepted >= (ACCEPTED if power < 1.0 else ACCEPTED_LAST):
            break
    return points, logs, length


# Contraction from which an input is learned, or partly; share of the prior's variance below which a combination is identified.
LEARNED, PARTLY, KNOWN = 0.5, 0.2, 0.1
INSIDE = 0.9  # of an interval
# Standard errors by which the density beyond an end is lower. The shortest interval seeks out the emptiest ends: of a flat
# posterior these are more than 2.5 and 3.1 standard errors emptier in 5 and 1 of 100 samples.
EMPTIER = 3.0
# A range is too narrow if more than this share of the posterior is within so much of one of its ends.
CROWD, END = 0.2, 0.05
# Powers below this share of the largest, in standard deviations of their inputs, count as zero.
SMALL = 0.25
PRIOR_SD = 12.0**-0.5  # of a quantile


class Combination(Record):
    """A product of powers of inputs by their keys, and the standard deviation of its logarithm after and before learning [%]."""

    powers: dict[str, float]
    sd_percent: float
    sd_percent_before: float


class Learnt(Record):
    """Contraction of each input, identified combinations, and inputs whose posterior is at an end of the range, by their keys."""

    learned: dict[str, float]
    combinations: list[Combination]
    narrow: list[str] = outside_json(default_factory=list)

    @property
    def has_learned(self) -> bool:
        """Whether an input or a combination was learned."""
        return any(share >= LEARNED for share in self.learned.values()) or bool(self.combinations)


def learnt(keys: Sequence[str], quantiles: Array, logarithms: Array, before: Array) -> Learnt:
    """Learned inputs, from quantiles (n, d) of inputs after, and their logarithms (n, d) after and before.

    The logarithm of an input that has none is NaN.
    """
    crowded = np.maximum((quantiles < END).mean(axis=0), (quantiles > 1.0 - END).mean(axis=0))
    return Learnt(
        dict(zip(keys, contraction(quantiles).tolist(), strict=True)),
        _combinations(keys, logarithms, before),
        [keys[place] for place in np.flatnonzero(crowded > CROWD).tolist()],
    )


def contraction(quantiles: Array) -> Array:
    """1 - sd after / sd before (d,) of inputs by their quantiles (n, d), 0 where they spread more than before."""
    return (1.0 - quantiles.std(axis=0) / PRIOR_SD).clip(0.0)


def densest_intervals(quantiles: Array) -> Array:
    """Ends (2, d) of the intervals of highest density that hold the share INSIDE of quantiles (n, d), or more.

    They are the shortest ones if there is one mode. What lies beyond an end is left out only if the density is lower there, by
    more than chance: of a flat posterior the densest interval is the whole range, where the shortest is any.
    """
    ordered, count = np.sort(quantiles, axis=0), len(quantiles)
    span = int(np.ceil(INSIDE * count)) - 1
    first = np.argmin(ordered[span:] - ordered[: count - span], axis=0)
    columns = np.arange(quantiles.shape[1])
    low, high = ordered[first, columns], ordered[first + span, columns]
    density = (span + 1) / (high - low).clip(1e-300)
    left_out = [
        beyond < expected - EMPTIER * np.sqrt(expected)
        for beyond, expected in ((first, low * density), (count - span - 1 - first, (1.0 - high) * density))
    ]
    return np.array([np.where(left_out[0], low, 0.0), np.where(left_out[1], high, 1.0)])


def contraction_words(share: float) -> str:
    """A contraction in words, as reports write it."""
    return "learned" if share >= LEARNED else "partly" if share >= PARTLY else "not seen"


def _combinations(keys: Sequence[str], after: Array, before: Array) -> list[Combination]:
    """Identified combinations of two or more inputs, the best first: eigenvectors of one covariance relative to the other."""
    numbers = np.isfinite(after).all(axis=0) & np.isfinite(before).all(axis=0)
    places = np.flatnonzero(numbers & (before.std(axis=0) > 0.0))
    if places.size < 2:
        return []
    spread = before[:, places].std(axis=0)
    covariances = [np.cov(logs[:, places].T / spread[:, None]) for logs in (after, before)]
    shares, vectors = linalg.eigh(*covariances)
    combinations = []
    for share, vector in zip(shares, vectors.T, strict=True):
        part = np.where(np.abs(vector) >= SMALL * np.abs(vector).max(), vector, 0.0)
        if share >= KNOWN or (part != 0.0).sum() < 2:
            continue
        powers = part / spread
        powers = powers / powers[np.argmax(np.abs(powers))]
        sds = [float((logs[:, places] @ powers).std()) for logs in (after, before)]
        if sds[0] ** 2 < KNOWN * sds[1] ** 2:
            by_key = {
                keys[place]: float(power) for place, power in zip(places.tolist(), powers, strict=True) if power != 0.0
            }
            combinations.append(Combination(by_key, *(100.0 * sd for sd in sds)))
    return combinations


# Bayes factor that is strong evidence of an error beyond the allowed one; half of these errors are offsets of whole outputs.
STRONG, OFFSETS = 10.0, 0.5
# Half of the difference of normal scores that slopes are taken over; sizes of a half-normal distribution for its integral.
STEP = 0.5
SIZES = special.ndtri(0.5 + 0.5 * (np.arange(400) + 0.5) / 400)


class Unseen(NamedTuple):
    """The largest offset of an output that is not seen, in logarithms, and by how much it moves the scores (d,) of inputs."""

    offset: float
    moves: Array


def unseen_offsets(
    cells: Cells, measured: Measured, quantiles: Callable[[Array], Array], centre: Array
) -> list[Unseen | None]:
    """The largest unseen offset of each output; None of an exact simulation, and of an output that is only held out.

    ``centre`` (d,): mean of the posterior in normal scores, of which ``quantiles`` are those of the prior.
    """
    learnt, inputs = measured.learnt, centre.size
    steps = STEP * np.eye(inputs)
    means = cells.mean(quantiles(np.vstack([centre + steps, centre - steps])))[:, learnt]
    slopes = (means[:inputs] - means[inputs:]).T / (2.0 * STEP)
    scales = measured.scales[None]
    at = joint(cells, measured, quantiles(centre[None]), Errors(scales, scales, np.zeros(scales.shape, bool)))
    variances, roots = at.variances[0, learnt], np.hstack([at.roots[0, learnt], slopes])
    listed = list[Unseen | None]()
    for place, scale in enumerate(measured.scales):
        offset = (measured.output[learnt] == place).astype(float)
        if scale == 0.0 or not offset.any():
            listed.append(None)
            continue
        # The first columns of the roots are the biases of the outputs.
        variance = 1.0 / float(offset @ _weighed(variances, np.delete(roots, place, axis=1), offset))
        size = _largest(variance, float(scale), float(measured.wide[place]), float(measured.accuracy[place]))
        listed.append(Unseen(size, size * (slopes.T @ _weighed(variances, roots, offset))))
    return listed


def _weighed(variances: Array, roots: Array, vector: Array) -> Array:
    """The ``vector`` (k,) times the inverse of diag(own) + UU', by Woodbury's identity."""
    scaled = roots / variances[:, None]
    inner = np.eye(roots.shape[1]) + roots.T @ scaled
    weighed: Array = vector / variances - scaled @ np.linalg.solve(inner, scaled.T @ vector)
    return weighed


def _largest(variance: float, scale: float, wide: float, accuracy: float) -> float:
    """The offset whose estimate, of this ``variance``, makes the Bayes factor strong."""

    def missing(offset: float) -> float:
        wider, allowed = (_log_density(offset, variance + accuracy**2, size) for size in (wide, scale))
        return float(np.log(STRONG / OFFSETS) - (wider - allowed))

    high = float(np.sqrt(variance) + wide)
    while missing(high) > 0.0:
        high *= 2.0
    return float(optimize.brentq(missing, 0.0, high))


def _log_density(offset: float, variance: float, scale: float) -> float:
    """Logarithm of the density of an estimated offset with a bias whose scale is half-normal."""
    total = variance + (scale * SIZES) ** 2
    return float(special.logsumexp(-0.5 * (offset**2 / total + np.log(2.0 * np.pi * total))) - np.log(SIZES.size))
