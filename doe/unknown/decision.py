"""Whether one design is better than another over the unknown inputs, whether it keeps its limits, and which input is decisive.

Gains. Rows are pairs: both designs at the same input set, with relative gains D (n, m) and their variances s^2 (n, m) of the
simulation. Single gains scatter more than the true ones, so the noise is removed from their distribution. It begins as if the
true gains were normal, those of row i about m + V (V + S_i)^-1 (D_i - m), V = cov D - mean S, with a few points drawn for each
row. Steps of expectation maximisation then move the weights of all points to the distribution under which the gains are
likeliest, whatever its form. They end before it follows the noise; how far the share still moves lengthens its interval. A
probability is the weight of the points at which all gains are positive; its interval is by resampling rows, and no shorter than
Wilson's. Gains are joint, so their probabilities are never multiplied.

Limits. The noise is removed alike from values at input sets. The probability is the weight of the points between the limits.

Worth. Gains are emulated over all inputs; the joint residuals of a row may occur at any input set. p(t) is the probability that
all gains are positive, given the value t of an input. Its flip is where p(t) crosses a half. Its worth is
E max(p, 1 - p) - max(p, 1 - p): the increase in the chance of the right choice by knowing it. The apparent worth of an input
that does nothing is subtracted. The probability with all ranges
half as wide about their medians shows how much depends on the ranges themselves, which are opinions.

Intervals of worths and flips are by resampling: half of the rows without replacement, emulated by the hyperparameters of all.
The estimate from n/2 of n rows scatters about that from all rows as this does about the truth (the delete-d jackknife at
d = n/2). No row comes twice, which an emulator would take for a replicate. The mean of the resamplings differs from the
estimate by all rows. That difference is a bias, as of errors that decrease with more rows, and lengthens the interval on its
side. The blur by slices and the emulators' own errors are biases, too. The error of averages over fresh input sets widens
both sides. An input is decisive if it alone is worth most in nearly all resamplings, the input that does nothing included, and
if its interval excludes 0.

Sources: Laird, Journal of the American Statistical Association 73 (1978) 805 (likeliest distribution by expectation
maximisation); Lucy, Astronomical Journal 79 (1974) 745 (its end before convergence); Wilson, JASA 22 (1927) 209; Strong,
Oakley and Brennan, Medical Decision Making 34 (2014) 311 (expected value of partial perfect information by regression); Shao and
Wu, Annals of Statistics 17 (1989) 1176 (the delete-d jackknife).
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse, special

from doe.emulator import Emulator, fit_emulator, leave_one_out
from doe.unknown.propagation import Share
from rbdyn.base.arrays import Array, Whole, one_thread
from rbdyn.base.estimate import LEVEL, wilson
from rbdyn.base.records import Record, keyed

# Points of true values for a row and at most, steps of their weights and earlier ones.
POINTS_OF_ROW, MOST_POINTS, STEPS, EARLIER = 4, 1024, 100, 25
# Resamplings of up to 512 rows; of more rows fewer.
RESAMPLES, FEWEST_RESAMPLES, USUAL_ROWS = 200, 50, 512
LEAST_NOISE = 1e-9  # standard deviation over the size of the values; smaller noise is lost in rounding
Hits = Callable[[Array], NDArray[np.bool_]]  # from points (k, m) to whether each hits (k, q)


class GainChances(Record):
    """Probability that each gain is positive, by its name, and that all are, with 95 % intervals."""

    gains: dict[str, Share] = keyed("better")
    all: Share


@one_thread
def gain_chances(names: Sequence[str], gains: Array, variances: Array, seed: int) -> GainChances:
    """Probabilities that the true gains (n, m) are positive, from simulated gains and their smoothed variances (n, m).

    Raw variances of few replicates scatter, and the distribution would follow the noise of a row that seems sure by chance."""
    *alone, every = _likely_shares(
        gains, variances, lambda points: np.column_stack([points > 0.0, (points > 0.0).all(axis=1)]), seed
    )
    return GainChances(dict(zip(names, alone, strict=True)), every)


def _likely_shares(values: Array, variances: Array, hits: Hits, seed: int) -> list[Share]:
    """Shares of input sets whose true values hit, with 95 % intervals by drawing rows anew.

    ``values`` (n, m) are simulated, with ``variances`` (n, m).
    """
    random, count = np.random.default_rng(seed), len(values)
    noise = np.maximum(variances, LEAST_NOISE**2 * (values**2).mean(axis=0) + 1e-300)
    earlier, shares = _shares(values, noise, np.ones(count, dtype=np.int64), hits, random)
    # Every resampling begins anew, as the amount of noise is estimated from the same rows.
    resamples = max(RESAMPLES * USUAL_ROWS // max(count, USUAL_ROWS), FEWEST_RESAMPLES)
    drawn = (np.bincount(rows, minlength=count) for rows in random.integers(0, count, (resamples, count)))
    again = [_shares(values, noise, counts, hits, random)[1] for counts in drawn]
    ends = np.quantile(again, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], axis=0)
    moved = shares - earlier
    ends += [moved.clip(max=0.0), moved.clip(min=0.0)]
    intervals = []
    for value, low, high in zip(shares.tolist(), *ends.clip(0.0, 1.0).tolist(), strict=True):
        # Resampled rows that all agree show no scatter; Wilson's interval still has one.
        least, most = wilson(value, count)
        intervals.append(Share(value, min(low, least), max(high, most)))
    return intervals


def shrunk(gains: Array, variances: Array) -> Array:
    """Gains (n, m) shrunk towards their mean, so that they scatter as the true ones do."""
    total = gains.var(axis=0, ddof=1)
    signal = np.divide((total - variances.mean(axis=0)).clip(0.0), total, out=np.zeros_like(total), where=total > 0.0)
    middle: Array = gains.mean(axis=0)
    return middle + np.sqrt(signal) * (gains - middle)


def in_doubt(gains: Array, variances: Array) -> Whole:
    """Places of the rows with a gain within two standard errors of zero, the most doubtful first."""
    sure = (np.abs(gains) / np.sqrt(np.maximum(variances, 1e-300))).min(axis=1)
    ranked = np.argsort(sure, kind="stable")
    return ranked[sure[ranked] < 2.0]


def _shares(values: Array, variances: Array, counts: Whole, hits: Hits, random: np.random.Generator) -> Array:
    """Shares (2, q) of true values that hit, after `EARLIER` and after all steps, of rows that occur ``counts`` (n,) times."""
    there = counts > 0
    values, variances, weights = values[there], variances[there], counts[there] / counts.sum()
    middle = weights @ values
    covariance = np.cov(values.T, fweights=counts[there], ddof=1).reshape(len(middle), -1)
    between = _positive(covariance - np.diag(weights @ variances))
    pull = between @ np.linalg.inv(between + variances[:, :, None] * np.eye(len(middle)))
    # Points are spread over the rows by their weights, and evenly over their normal laws.
    count = min(POINTS_OF_ROW * len(values), MOST_POINTS)
    rows = np.searchsorted(np.cumsum(weights), (np.arange(count) + random.random()) / count).clip(max=len(values) - 1)
    ranks = random.permuted(np.tile(np.arange(count)[:, None], (1, len(middle))), axis=0)
    normal = special.ndtri((ranks + random.random(ranks.shape)) / count)
    start = middle + np.einsum("nij,nj->ni", pull, values - middle)
    points = start[rows] + np.einsum("nij,nj->ni", _root(between - pull @ between)[rows], normal)
    # Likelihood (n, k) of each row at each point.
    apart = np.sum([(values[:, [j]] - points[:, j]) ** 2 / variances[:, [j]] for j in range(len(middle))], axis=0)
    likelihood = np.exp(-0.5 * (apart - apart.min(axis=1, keepdims=True)))
    share, shares = np.full(count, 1.0 / count), []
    for step in range(1, STEPS + 1):
        share = share * (likelihood.T @ (weights / np.maximum(likelihood @ share, 1e-300)))
        if step in (EARLIER, STEPS):
            shares.append(np.round(share @ hits(points), 12))  # sums of shares are 1 but for rounding
    return np.array(shares)


def _positive(matrix: Array) -> Array:
    """The nearest matrix without negative eigenvalues."""
    sizes, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return (axes * sizes.clip(0.0)) @ axes.T


def _root(matrix: Array) -> Array:
    sizes, axes = np.linalg.eigh(0.5 * (matrix + np.swapaxes(matrix, -1, -2)))
    return axes * np.sqrt(sizes.clip(0.0))[..., None, :]


@one_thread
def odds(values: Array, variances: Array, lower: float, upper: float, seed: int) -> Share:
    """Probability that the true value of an input set is from ``lower`` to ``upper``; either may be infinite.

    ``values`` (n,) are simulated, with ``variances`` (n,) smoothed over the inputs as in ``gain_chances``.
    """
    (share,) = _likely_shares(
        values[:, None], variances[:, None], lambda points: (lower <= points) & (points <= upper), seed
    )
    return share


# Slices of an input's range in which the probability is taken; of a pair of inputs, along each.
BINS, PAIR_BINS = 64, 8
# Resamplings by half of the rows, the fresh input sets and slices of one, and parts of the fresh sets for the error of averages.
HALVES, POINTS, FEWER_BINS, AVERAGE_PARTS = 200, 2048, 32, 8
# Share of resamplings in which an input must be worth most to be decisive, and its normal quantile.
DECISIVE, DECISIVE_Z = 0.95, 1.645
# Worth below which no measurement is proposed, and probability of the better choice from which none can be worth much.
LEAST_WORTH, NEARLY_ALL = 0.02, 0.9
# Share of the worth of the best pair below which an input alone is not decisive.
ALONE = 0.5

Interval = tuple[float, float]
Verdict = Literal["decided", "nothing", "undecided"]


class InputWorth(NamedTuple):
    """What knowing an input is worth.

    place : of the input
    flip : its quantile where the better design changes; None where it does not
    worth : increase in the chance of the right choice
    above : whether the new design is better above the flip
    flip_interval, worth_interval : 95 %; of a flip that few resamplings have, None
    """

    place: int
    flip: float | None
    worth: float
    above: bool
    flip_interval: Interval | None
    worth_interval: Interval


class PairWorth(NamedTuple):
    """What knowing two inputs is worth, with its 95 % interval."""

    places: tuple[int, int]
    worth: float
    interval: Interval


class DecisiveInputs(Record):
    """Unknown inputs by their worth.

    inputs : the best first
    pair : the pair worth most; None where resamplings disagree or it is worth no more than one input
    explained : share of each gain's variance without noise that the inputs predict
    halved : change of the probability that all gains are positive, with ranges half as wide
    verdict : "decided" if the first input is decisive, "nothing" if none alone is worth measuring, else "undecided"
    rivals : places of the inputs that may be worth most, the best first
    needed : about how many rows would decide between them, infinite where they are worth the same
    """

    inputs: list[InputWorth]
    pair: PairWorth | None
    explained: list[float]
    halved: float
    verdict: Verdict
    rivals: list[int]
    needed: float


class _Gain(Record, eq=False):
    """A gain (n,) with its variances, its emulator and that emulator's covariances (k, n) with fresh input sets."""

    emulator: Emulator
    fresh: Array

    @cached_property
    def across(self) -> Array:
        """Prior covariances (n, k) of the rows with fresh input sets, those of a row side by side: resamplings take rows."""
        return np.ascontiguousarray(self.emulator.prior(self.fresh, self.emulator.points).T)

    @cached_property
    def covariance(self) -> Array:
        """Covariance (n, n) of the rows."""
        return self.emulator.prior(self.emulator.points, self.emulator.points) + np.diag(self.emulator.noise)

    def forecast(self, rows: Whole, sharp: bool = False) -> tuple[Array, Array]:
        """Predictions (k,) at the fresh input sets by ``rows`` (r,), and their residuals (r,), each row predicted by the others.

        Noise is subtracted from the residuals; where ``sharp``, the emulator's own error too. Hyperparameters stay the same.
        """
        gain, variances = self.emulator.values[rows], self.emulator.variances[rows]
        factor = linalg.cholesky(self.covariance[np.ix_(rows, rows)], lower=True, check_finite=False)
        weights = linalg.cho_solve((factor, True), gain - self.emulator.middle, check_finite=False)
        residuals, alone = leave_one_out(factor, weights)
        others = gain - residuals
        # The prediction by the other rows is weighted by the slope of the gains on it, which is 0 for a chance correlation.
        follows = float(np.cov(gain, others)[0, 1] / max(others.var(ddof=1), 1e-300))
        slope, middle, mean = min(max(follows, 0.0), 1.0), float(others.mean()), float(gain.mean())
        missed = gain - mean - slope * (others - middle)
        variance = max(float((missed**2).mean()), 1e-300)
        # Noise is no part of the true residuals.
        off = float((alone - self.emulator.hyperparameters.nugget if sharp else variances).mean())
        missed *= np.sqrt(max(variance - off, 0.0) / variance)
        predictions = self.emulator.middle + self.across[rows].T @ weights
        return mean + slope * (predictions - middle), missed

    @property
    def explained(self) -> float:
        """Share of the gain's variance without noise that the inputs predict."""
        missed = self.forecast(np.arange(self.emulator.values.size))[1]
        variance = float(self.emulator.values.var(ddof=1) - self.emulator.variances.mean())
        return max(1.0 - float((missed**2).mean()) / max(variance, 1e-300), 0.0)


class _Slices(Record, eq=False):
    """Slices of the ranges of inputs that could be measured; the last input does nothing.

    averaging : averages over the sets of each slice: a row a slice, 1/count at its sets
    coarse : (k, j), 1 where a set is in a slice for pairs of inputs
    bins : slices of an input
    """

    averaging: sparse.csr_array
    coarse: Array
    bins: int

    @classmethod
    def of(cls, sets: Array, bins: int) -> "_Slices":
        """Slices of quantiles (k, i + 1); the last input does nothing."""
        return cls(_averaging(_members(sets, bins)), _members(sets, PAIR_BINS).T.toarray(), bins)

    def estimate(self, better: Array) -> "_Estimate":
        """Worths and flips from probabilities (k,) at the sets."""
        p, curves = float(better.mean()), self._curves(better)
        flips, alone = [_flip(curve) for curve in curves[:-1]], _worths(curves, p)
        worths = alone[:-1] - alone[-1]
        quantiles = np.array([np.nan if place is None else place for place, _ in flips])
        return _Estimate(worths, quantiles, np.array([above for _, above in flips]), self._pairs(better, p, worths))

    def _curves(self, better: Array) -> Array:
        """Mean probability (i + 1, bins) in each slice; in one without sets the mean of all."""
        empty = np.diff(self.averaging.indptr) == 0
        return np.where(empty, better.mean(), self.averaging @ better).reshape(-1, self.bins)

    def _pairs(self, better: Array, p: float, worths: Array) -> Array:
        """Worths of all pairs of inputs (p,).

        From each is subtracted the apparent gain of its first input when it is paired with the input that does nothing.
        """
        total, many = self._by_pairs(self.coarse * better[:, None]), self._counts
        both = _worths(np.where(many > 0.0, total / np.maximum(many, 1.0), p), p)
        chance = (both[:-1, -1] - worths).clip(0.0)
        first, second = np.triu_indices(len(both) - 1, 1)
        return np.asarray(both[first, second] - chance[first])

    def _by_pairs(self, weights: Array) -> Array:
        """Sums (i + 1, i + 1, cells) of weights (k, j) of the sets in the cells of each pair of inputs."""
        size = self.coarse.shape[1] // PAIR_BINS
        sums: Array = self.coarse.T @ weights
        return sums.reshape(size, PAIR_BINS, size, PAIR_BINS).swapaxes(1, 2).reshape(size, size, -1)

    @cached_property
    def _counts(self) -> Array:
        """Sets in the cells of each pair, the same for all resamplings."""
        return self._by_pairs(self.coarse)


class _Estimate(NamedTuple):
    """Worths (i,) of inputs and (p,) of pairs, and flips (i,), NaN where the choice does not change.

    ``above`` (i,): whether the new design is better above the flip.
    """

    worths: Array
    flips: Array
    above: Array
    pairs: Array


def _members(quantiles: Array, bins: int) -> sparse.csr_array:
    """Membership (i bins, k) of quantiles (k, i) in equal slices, those of the first input first: 1 in its slice."""
    sets, inputs = quantiles.shape
    rows = np.minimum((quantiles * bins).astype(np.int64), bins - 1) + bins * np.arange(inputs)
    columns = np.repeat(np.arange(sets), inputs)
    return sparse.csr_array((np.ones(rows.size), (rows.ravel(), columns)), shape=(inputs * bins, sets))


def _averaging(members: sparse.csr_array) -> sparse.csr_array:
    """Membership as averages over the sets of each slice."""
    return sparse.csr_array(members.multiply(1.0 / np.maximum(np.diff(members.indptr), 1)[:, None]))


@one_thread
def decisive_inputs(
    quantiles: Array, gains: Array, variances: Array, fresh: Array, seed: int, knowable: Sequence[int] | None = None
) -> DecisiveInputs:
    """Which inputs are decisive, from rows at quantiles (n, d) of the inputs, the last of which does nothing.

    gains, variances : (n, m); variances are smooth over the inputs
    fresh : (k, d), quantiles of many input sets, k a power of two
    knowable : places of the inputs that have one true value; all where left out
    """
    random = np.random.default_rng(seed)
    count, inputs = len(quantiles), quantiles.shape[1]
    # Half of the rows must determine the trend too.
    trend: Literal["linear", "constant"] = "linear" if 4 * (inputs + 1) <= count else "constant"
    columns = zip(gains.T, variances.T, strict=True)
    emulators = [fit_emulator(quantiles, gain, smooth, trend=trend) for gain, smooth in columns]
    every = np.arange(count)
    gains_at, narrow, few = (
        [_Gain(emulator, sets) for emulator in emulators] for sets in (fresh, 0.25 + 0.5 * fresh, fresh[:POINTS])
    )
    better, halved = (_chances([gain.forecast(every) for gain in gains_of]) for gains_of in (gains_at, narrow))
    halves = [np.sort(random.permutation(count)[: count // 2]) for _ in range(HALVES)]
    places = list(range(inputs - 1) if knowable is None else knowable)
    sets = fresh[:, [*places, -1]]
    fewer, usual = _Slices.of(sets[:POINTS], FEWER_BINS), _Slices.of(sets, BINS)
    by = _Estimates(
        usual.estimate(better),
        _Slices.of(sets, BINS // 2).estimate(better),
        usual.estimate(_chances([gain.forecast(every, sharp=True) for gain in gains_at])),
        fewer.estimate(better[:POINTS]),
        [fewer.estimate(_chances([gain.forecast(rows) for gain in few])) for rows in halves],
        [
            _Slices.of(sets[rows], FEWER_BINS).estimate(better[rows])
            for rows in np.split(np.arange(len(fresh)), AVERAGE_PARTS)
        ],
    )
    measured = _measured(places, by)
    p = float(better.mean())
    return DecisiveInputs(
        measured.inputs,
        measured.pair,
        [gain.explained for gain in gains_at],
        float(halved.mean()) - p,
        *measured.verdict(p, count),
    )


class _Estimates(NamedTuple):
    """Estimates of worths and flips by variants of rows, slices and fresh sets.

    usual, wide, sharp : by all rows; in slices twice as wide; without the emulators' own errors
    fewer, again : by fewer fresh sets; the same by resamplings of the rows
    parts : by parts of the fresh sets
    """

    usual: _Estimate
    wide: _Estimate
    sharp: _Estimate
    fewer: _Estimate
    again: list[_Estimate]
    parts: list[_Estimate]


class _Figures(NamedTuple):
    """Values (i,), those of resamplings (b, i), NaN where one has none, and known biases (r, i)."""

    values: Array
    again: Array
    biases: Array

    @property
    def ends(self) -> Array:
        """Ends (2, i) of the 95 % intervals; a bias lengthens its own side only."""
        finite = np.where(np.isfinite(self.again), self.again, self.values)
        low, high = np.quantile(finite, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], axis=0) - self.values
        # Biases add up; scatter is independent of them.
        below, above = (side.sum(axis=0) for side in (self.biases.clip(max=0.0), self.biases.clip(min=0.0)))
        return np.array([self.values - np.hypot(low, below), self.values + np.hypot(high, above)])


class _Measured(Record, eq=False):
    """Worths and flips (i,) of inputs at ``places``, on which side the new design is better, and worths of pairs (p,)."""

    places: Sequence[int]
    worths: _Figures
    flips: _Figures
    above: Array
    pairs: _Figures

    @property
    def order(self) -> list[int]:
        """Places of the inputs by their worth, the best first; equal ones in their order."""
        return np.argsort(-self.worths.values.clip(0.0), kind="stable").tolist()

    @property
    def inputs(self) -> list[InputWorth]:
        """The inputs by their worth, the best first."""
        worths, flips = self.worths.values.clip(0.0).tolist(), self.flips.values.tolist()
        (low, high), (first, last) = self.worths.ends.clip(0.0).tolist(), self.flips.ends.clip(0.0, 1.0).tolist()
        # A flip is reported only if nearly all resamplings have one.
        sure = (np.isfinite(self.flips.again).mean(axis=0) >= DECISIVE).tolist()
        return [
            InputWorth(
                self.places[i],
                flips[i] if np.isfinite(flips[i]) else None,
                worths[i],
                bool(self.above[i]),
                (first[i], last[i]) if sure[i] else None,
                (low[i], high[i]),
            )
            for i in self.order
        ]

    @property
    def pair(self) -> PairWorth | None:
        """The pair worth most, if nearly all resamplings agree and it is worth more than any single input."""
        if not self.pairs.values.size:
            return None
        best, again = int(self.pairs.values.argmax()), self.pairs.again
        more = again[:, best] > self.worths.again.max(axis=1) + LEAST_WORTH
        if ((again.argmax(axis=1) == best) & more).mean() < DECISIVE:
            return None
        low, high = self.pairs.ends[:, best].clip(0.0).tolist()
        return PairWorth(list(combinations(self.places, 2))[best], float(self.pairs.values[best]), (low, high))

    def verdict(self, p: float, count: int) -> tuple[Verdict, list[int], float]:
        """Whether one input is decisive, places of those that may be, and about how many rows would decide between them.

        ``p``: probability that all gains are positive; ``count``: number of rows.
        """
        if not self.places or self.worths.ends[1].max() < LEAST_WORTH:
            return "nothing", [], float(count)
        # The last is the input that does nothing.
        again = np.column_stack([self.worths.again, np.zeros(len(self.worths.again))])
        most = np.bincount(again.argmax(axis=1), minlength=again.shape[1]) / len(again)
        best = self.order[0]
        rivals = [place for place in self.order if most[place] > 1.0 - DECISIVE or place == best]
        value, low, pair = float(self.worths.values[best]), float(self.worths.ends[0][best]), self.pair
        if pair is not None and value < ALONE * pair.worth:
            return "nothing", [], float(count)
        if most[best] >= DECISIVE and low > 0.0:
            return "decided", [self.places[best]], float(count)
        if max(p, 1.0 - p) >= NEARLY_ALL:
            return "nothing", [], float(count)
        # The error of a difference falls as the root of the rows.
        less = self.worths.values[best] - np.append(self.worths.values, 0.0)
        error = (again[:, [best]] - again).std(axis=0, ddof=1)
        ratio = np.divide(DECISIVE_Z * error, less, out=np.full(less.size, np.inf), where=less > 0.0)
        ratio[[best, *np.flatnonzero(most <= 0.0)]] = 0.0
        if low <= 0.0 < value:
            ratio[-1] = max(float(ratio[-1]), (value - low) / value)
        return "undecided", [self.places[place] for place in rivals], float(count * ratio.max() ** 2)


def _measured(places: Sequence[int], by: _Estimates) -> _Measured:
    """Worths and flips of inputs at ``places`` with all their errors."""
    usual = by.usual
    # A flip to the other side does not count.
    again, parts = (
        [estimate._replace(flips=np.where(estimate.above == usual.above, estimate.flips, np.nan)) for estimate in many]
        for many in (by.again, by.parts)
    )

    def about(name: str) -> _Figures:
        value, wide, sharp, fewer = (getattr(estimate, name) for estimate in (usual, by.wide, by.sharp, by.fewer))
        scatter, averages = (np.array([getattr(estimate, name) for estimate in many]) for many in (again, parts))
        # Slices can only lower a worth.
        blur = value - wide if name == "flips" else (value - wide).clip(0.0)
        biases = np.nan_to_num([blur, sharp - value, fewer - _mean(scatter)])
        return _Figures(value, _about(value, scatter, averages), biases)

    return _Measured(places, about("worths"), about("flips"), usual.above, about("pairs"))


def _about(values: Array, again: Array, parts: Array) -> Array:
    """Resamplings (b, i) shifted so that their mean is the value (i,); NaN stays.

    They are widened by the error of averages over fresh sets, which the scatter of parts (q, i) shows.
    """
    off = again - _mean(again)
    variance = _mean(off**2)
    error = np.where(np.isfinite(parts).all(axis=0), parts, 0.0).var(axis=0, ddof=1) / len(parts)
    widening = np.sqrt(1.0 + np.divide(error, variance, out=np.zeros_like(error), where=variance > 0.0))
    return np.asarray(values + off * widening)


def _mean(again: Array) -> Array:
    """Mean (i,) of the finite values of resamplings (b, i), 0 where there are none."""
    there = np.isfinite(again)
    return np.asarray(np.where(there, again, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1))


def _chances(gains: Sequence[tuple[Array, Array]]) -> Array:
    """Probability (k,) that all gains are positive, from predictions (k,) and residuals (n,) of each gain.

    The joint residuals of one row may occur at any input set.
    """
    positive = np.ones((gains[0][1].size, gains[0][0].size), dtype=bool)
    for predictions, missed in gains:
        positive &= predictions > (missed.mean() - missed)[:, None]
    return positive.mean(axis=0)


def _worths(curves: Array, p: float) -> Array:
    """Increase in the chance of the right choice by knowing the slice, from probabilities (..., slices) of equal weight."""
    return np.asarray(np.maximum(curves, 1.0 - curves).mean(axis=-1) - max(p, 1.0 - p))


def _flip(curve: Array) -> tuple[float | None, bool]:
    """Quantile at which the probability crosses a half, and whether it is larger above.

    It is found by a logistic line through the slices.
    """
    middles = (np.arange(len(curve)) + 0.5) / len(curve)
    curve = _smooth(curve)
    sides = np.sign(curve - 0.5)
    if (sides >= 0.0).all() or (sides <= 0.0).all():
        return None, bool(curve.mean() > 0.5)
    # The crossing with the most slices on the side of their neighbours.
    crossings = np.flatnonzero(sides[:-1] * sides[1:] <= 0.0)
    fits = [abs(sides[: place + 1].sum()) + abs(sides[place + 1 :].sum()) for place in crossings]
    place = int(crossings[int(np.argmax(fits))])
    low, high = (special.logit(np.clip(curve[number], 1e-3, 1.0 - 1e-3)) for number in (place, place + 1))
    share = 0.5 if high == low else low / (low - high)
    return float(middles[place] + np.clip(share, 0.0, 1.0) * (middles[1] - middles[0])), bool(
        sides[place + 1 :].sum() > 0.0
    )


def _smooth(curve: Array) -> Array:
    """Moving mean over the neighbours of each slice within a 24th of the range, as many on either side.

    A straight line and the middle of a step do not change.
    """
    count = len(curve)
    ranks = np.arange(count)
    reach = np.minimum(np.minimum(ranks, count - 1 - ranks), count // 24)
    sums = np.concatenate([[0.0], np.cumsum(curve)])
    return np.asarray((sums[ranks + reach + 1] - sums[ranks - reach]) / (2 * reach + 1))
