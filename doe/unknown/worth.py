"""Which unknown input decides between two designs, what measuring it is worth, and how well rows of pairs know both.

Gains are emulated over all inputs; what the emulators miss of a row, of all gains together, may be missed anywhere; p(t) is the probability that all
gains are positive given the input, its flip where it crosses a half, and its worth E max(p, 1 - p) - max(p, 1 - p): by how
much knowing it raises the chance of the right choice, less what an input that does nothing seems to be worth. An input that
is measured with an error is known by its reading instead: p is taken given that. The probability with all ranges half as wide
about their medians shows how much hangs on the ranges themselves, which are opinions.

Intervals are by resampling: half of the rows without replacement, emulated by the hyperparameters of the whole. The estimate
from n/2 of n rows scatters about that from all of them as this does about the truth (the delete-d jackknife at d = n/2), and
no row comes twice, which an emulator would take for a replicate. Fewer rows predict less, so the resamplings count by their
scatter about their mean; how far that lies from the estimate by all rows is the bias of this one, as of errors that fall
with the rows, and lengthens the interval on its side. So do what slices blur, and what the worth would be without the
emulators' own errors, which are no scatter where they go together along the input. The error of averages over fresh
input sets widens both sides. An input decides where it, and no other, is worth most in nearly all resamplings, the input that
does nothing counted, and where its interval leaves out 0.

Sources: Strong, Oakley and Brennan, Medical Decision Making 34 (2014) 311 (expected value of partial perfect information by
regression); Shao and Wu, Annals of Statistics 17 (1989) 1176 (the delete-d jackknife).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np
from scipy import sparse, special

from doe.designs.model import model_matrix
from doe.emulator import Emulator, fit_emulator
from doe.emulator.covariance import correlation
from doe.emulator.likelihood import covariance_of, solved
from doe.threads import one_thread
from doe.unknown.decision import CONFIDENCE
from rbdyn.base.arrays import Array, Whole

# Slices of an input's range in which the probability is taken; of a pair of inputs, along each.
BINS, PAIR_BINS = 64, 8
# Resamplings, the fresh input sets and slices of one, and the parts of all fresh sets that show the error of their averages.
RESAMPLES, POINTS, FEWER_BINS, PARTS = 200, 2048, 32, 8
# Share of resamplings in which an input must be worth most to decide, and the normal quantile of it.
SURE, SURE_Z = 0.95, 1.645
# Worth below which no measurement is proposed, and a probability so near 1 (or 0) that none could be worth much.
WORTH, NEARLY_ALL = 0.02, 0.9
# Share of the worth of the best pair below which an input alone decides nothing: it takes both.
ALONE = 0.5

Interval = tuple[float, float]
Verdict = Literal["decided", "nothing", "undecided"]


class Deciding(NamedTuple):
    """What knowing an input is worth, the quantile of it where the better design changes, None where it does not, whether
    the new design is better above that, and 95 % intervals, of a flip that few resamplings have None."""

    place: int
    flip: float | None
    worth: float
    above: bool
    flip_interval: Interval | None
    worth_interval: Interval


class Together(NamedTuple):
    """What knowing two inputs is worth, with its 95 % interval."""

    places: tuple[int, int]
    worth: float
    interval: Interval


@dataclass(frozen=True)
class Decides:
    """Inputs by their worth, the best first; the pair worth most, None where that is another one in many resamplings or worth no more than one input; share of
    each gain's variance that the inputs predict, of what noise leaves; by how much the probability that all gains are positive
    changes with ranges half as wide.

    ``verdict``: "decided" where the first input decides, "nothing" where none alone is worth measuring, else "undecided".
    ``rivals``: places of the inputs that may be worth most, the best first; ``needed``: about how many rows would decide
    between them, infinite where they are worth the same.
    """

    inputs: list[Deciding]
    pair: Together | None
    foretold: list[float]
    halved: float
    verdict: Verdict
    rivals: list[int]
    needed: float


@dataclass(frozen=True, eq=False)
class _Gain:
    """A gain (n,) with its variances, its emulator and that emulator's covariances (k, n) with fresh input sets."""

    emulator: Emulator
    fresh: Array

    @cached_property
    def columns(self) -> tuple[Array, Array]:
        """Trend columns at the rows and at fresh input sets."""
        terms = self.emulator.terms
        return model_matrix(self.emulator.points, terms), model_matrix(self.fresh, terms)

    @cached_property
    def across(self) -> Array:
        """Covariances (k, n) of fresh input sets with the rows."""
        by = self.emulator.hyperparameters
        return by.variance * correlation(self.fresh, self.emulator.points, by.lengths)

    @cached_property
    def covariance(self) -> Array:
        """Covariance (n, n) of the rows."""
        return covariance_of(self.emulator.points, self.emulator.variances, self.emulator.hyperparameters)

    def of(self, rows: Whole, sharp: bool = False) -> tuple[Array, Array]:
        """What ``rows`` predict at the fresh input sets (k,), and what they miss of each other (r,), of which noise is taken
        off, and where ``sharp`` what the emulator knows to be its own error; of equal hyperparameters."""
        here, there = self.columns
        gain, variances = self.emulator.values[rows], self.emulator.variances[rows]
        solution = solved(self.covariance[np.ix_(rows, rows)], here[rows], gain)
        projection = solution.projection
        alone = 1.0 / np.diag(projection)
        others = gain - alone * (projection @ gain)
        # What the other rows predict counts by as much as a row's gain follows it: nothing where it follows by chance only.
        follows = float(np.cov(gain, others)[0, 1] / max(others.var(ddof=1), 1e-300))
        slope, middle, mean = min(max(follows, 0.0), 1.0), float(others.mean()), float(gain.mean())
        missed = gain - mean - slope * (others - middle)
        whole = max(float((missed**2).mean()), 1e-300)
        # What noise makes of the misses is not the truth's.
        off = float((alone - self.emulator.hyperparameters.nugget if sharp else variances).mean())
        missed *= np.sqrt(max(whole - off, 0.0) / whole)
        foretold = there @ solution.coefficients + self.across[:, rows] @ solution.weights
        return mean + slope * (foretold - middle), missed

    @property
    def foretold(self) -> float:
        """Share of the gain's variance that the inputs predict, of what noise leaves."""
        missed = self.of(np.arange(self.emulator.values.size))[1]
        whole = float(self.emulator.values.var(ddof=1) - self.emulator.variances.mean())
        return max(1.0 - float((missed**2).mean()) / max(whole, 1e-300), 0.0)


@dataclass(frozen=True, eq=False)
class _Slices:
    """Slices of ``fresh`` input sets and of what is ``read`` of them, both with the input that does nothing as the last: a row a
    slice of an input that could be known, which is 1 over its count at the sets (k,) in it; for pairs ``coarse`` ones (k, j), 1
    where a set is in the slice."""

    fresh: sparse.csr_array
    read: sparse.csr_array
    coarse: Array
    bins: int

    @classmethod
    def of(cls, fresh: Array, read: Array, bins: int) -> "_Slices":
        """Of quantiles (k, i + 1) of the inputs that could be known and of one that does nothing."""
        member, halves = _members(read, bins), _members(read, PAIR_BINS)
        return cls(_averaging(_members(fresh, bins)), _averaging(member), halves.T.toarray(), bins)

    def estimate(self, better: Array) -> "_Estimate":
        """Worths and flips by probabilities (k,) at the sets."""
        p, flips = float(better.mean()), [_flip(curve) for curve in self._curves(self.fresh, better)[:-1]]
        alone = _worths(self._curves(self.read, better), p)
        worths = alone[:-1] - alone[-1]
        at = np.array([np.nan if place is None else place for place, _ in flips])
        return _Estimate(worths, at, np.array([above for _, above in flips]), self._pairs(better, p, worths))

    def _curves(self, averaging: sparse.csr_array, better: Array) -> Array:
        """Mean probability (i + 1, bins) in each slice; in one without sets the mean of all."""
        empty = np.diff(averaging.indptr) == 0
        return np.where(empty, better.mean(), averaging @ better).reshape(-1, self.bins)

    def _pairs(self, better: Array, p: float, worths: Array) -> Array:
        """Worths of all pairs of inputs (p,); of each is taken off what its first input seems to be worth more with nothing than
        alone."""
        size = self.coarse.shape[1] // PAIR_BINS
        total, many = (
            matrix.reshape(size, PAIR_BINS, size, PAIR_BINS).swapaxes(1, 2).reshape(size, size, -1)
            for matrix in (self.coarse.T @ (self.coarse * better[:, None]), self.coarse.T @ self.coarse)
        )
        both = _worths(np.where(many > 0.0, total / np.maximum(many, 1.0), p), p)
        chance = (both[:-1, -1] - worths).clip(0.0)
        first, second = np.triu_indices(size - 1, 1)
        return np.asarray(both[first, second] - chance[first])


class _Estimate(NamedTuple):
    """Worths (i,) of inputs, their flips (i,), not a number where the choice does not change, whether the new design is better
    above (i,), and worths (p,) of pairs."""

    worths: Array
    flips: Array
    above: Array
    pairs: Array


def _members(at: Array, bins: int) -> sparse.csr_array:
    """Which of equal slices, those of the first input first, hold each of quantiles (k, i): 1 in (i bins, k)."""
    sets, inputs = at.shape
    rows = np.minimum((at * bins).astype(np.int64), bins - 1) + bins * np.arange(inputs)
    columns = np.repeat(np.arange(sets), inputs)
    return sparse.csr_array((np.ones(rows.size), (rows.ravel(), columns)), shape=(inputs * bins, sets))


def _averaging(members: sparse.csr_array) -> sparse.csr_array:
    """Means over the sets that each slice holds."""
    return sparse.csr_array(members.multiply(1.0 / np.maximum(np.diff(members.indptr), 1)[:, None]))


@one_thread
def decides(
    quantiles: Array,
    gains: Array,
    variances: Array,
    fresh: Array,
    seed: int,
    read: Array | None = None,
    knowable: Sequence[int] | None = None,
) -> Decides:
    """Which inputs decide, from rows at quantiles (n, d) of them, the last an input that does nothing.

    ``variances`` (n, m) are smooth over the inputs; ``fresh`` (k, d): quantiles of many input sets, a power of two, ``read``
    (k, d) those of what is read of them, with the errors of measurements; ``knowable``: places of the inputs that have one
    true value, all where left out.
    """
    random = np.random.default_rng(seed)
    count, inputs = len(quantiles), quantiles.shape[1]
    # Half of the rows must know the trend too.
    trend: Literal["linear", "constant"] = "linear" if 4 * (inputs + 1) <= count else "constant"
    columns = zip(gains.T, variances.T, strict=True)
    emulators = [fit_emulator(quantiles, gain, smooth, trend=trend) for gain, smooth in columns]
    every = np.arange(count)
    known, narrow, few = (
        [_Gain(emulator, at) for emulator in emulators] for at in (fresh, 0.25 + 0.5 * fresh, fresh[:POINTS])
    )
    better, halved = (_chances([gain.of(every) for gain in each]) for each in (known, narrow))
    halves = [np.sort(random.permutation(count)[: count // 2]) for _ in range(RESAMPLES)]
    places = list(range(inputs - 1) if knowable is None else knowable)
    at, seen = (sets[:, [*places, -1]] for sets in (fresh, fresh if read is None else read))
    fewer = _Slices.of(at[:POINTS], seen[:POINTS], FEWER_BINS)
    whole = _Slices.of(at, seen, BINS)
    by = _Estimates(
        whole.estimate(better),
        _Slices.of(at, seen, BINS // 2).estimate(better),
        whole.estimate(_chances([gain.of(every, sharp=True) for gain in known])),
        fewer.estimate(better[:POINTS]),
        [fewer.estimate(_chances([gain.of(rows) for gain in few])) for rows in halves],
        [
            _Slices.of(at[rows], seen[rows], FEWER_BINS).estimate(better[rows])
            for rows in np.split(np.arange(len(fresh)), PARTS)
        ],
    )
    measured = _measured(places, by)
    p = float(better.mean())
    return Decides(
        measured.inputs,
        measured.pair,
        [gain.foretold for gain in known],
        float(halved.mean()) - p,
        *measured.verdict(p, count),
    )


class _Estimates(NamedTuple):
    """Estimates by all rows, in slices twice as wide, without the emulators' own errors, and by the fewer fresh sets that
    resamplings take; by resamplings of the rows, and by parts of the fresh sets."""

    whole: _Estimate
    wide: _Estimate
    sharp: _Estimate
    fewer: _Estimate
    again: list[_Estimate]
    parts: list[_Estimate]


class _Figures(NamedTuple):
    """Values (i,), what resamplings make of them (b, i), not a number where one has none, and known biases (r, i)."""

    values: Array
    again: Array
    biases: Array

    @property
    def ends(self) -> Array:
        """Ends (2, i) of the 95 % intervals; a bias lengthens its own side only."""
        known = np.where(np.isfinite(self.again), self.again, self.values)
        low, high = np.quantile(known, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE], axis=0) - self.values
        # Biases add up; scatter is independent of them.
        below, above = (side.sum(axis=0) for side in (self.biases.clip(max=0.0), self.biases.clip(min=0.0)))
        return np.array([self.values - np.hypot(low, below), self.values + np.hypot(high, above)])


@dataclass(frozen=True, eq=False)
class _Measured:
    """Worths and flips (i,) of inputs at ``places``, whether the new design is better above, and worths of pairs (p,)."""

    places: Sequence[int]
    worths: _Figures
    flips: _Figures
    above: Array
    pairs: _Figures

    @property
    def order(self) -> list[int]:
        """The inputs by their worth, the best first; of equal ones the first."""
        return np.argsort(-self.worths.values.clip(0.0), kind="stable").tolist()

    @property
    def inputs(self) -> list[Deciding]:
        """The inputs by their worth, the best first."""
        worths, flips = self.worths.values.clip(0.0).tolist(), self.flips.values.tolist()
        (low, high), (first, last) = self.worths.ends.clip(0.0).tolist(), self.flips.ends.clip(0.0, 1.0).tolist()
        # A flip that few resamplings have is none to rely on.
        sure = (np.isfinite(self.flips.again).mean(axis=0) >= SURE).tolist()
        return [
            Deciding(
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
    def pair(self) -> Together | None:
        """The pair worth most, where it is that and worth more than any input in nearly all resamplings."""
        if not self.pairs.values.size:
            return None
        best, again = int(self.pairs.values.argmax()), self.pairs.again
        more = again[:, best] > self.worths.again.max(axis=1) + WORTH
        if ((again.argmax(axis=1) == best) & more).mean() < SURE:
            return None
        low, high = self.pairs.ends[:, best].clip(0.0).tolist()
        return Together(list(combinations(self.places, 2))[best], float(self.pairs.values[best]), (low, high))

    def verdict(self, p: float, count: int) -> tuple[Verdict, list[int], float]:
        """Whether one input decides at the probability ``p`` that all gains are positive; places of those that may; about how
        many rows of ``count`` ones it takes."""
        if not self.places or self.worths.ends[1].max() < WORTH:
            return "nothing", [], float(count)
        # The last is the input that does nothing.
        again = np.column_stack([self.worths.again, np.zeros(len(self.worths.again))])
        most = np.bincount(again.argmax(axis=1), minlength=again.shape[1]) / len(again)
        best = self.order[0]
        rivals = [place for place in self.order if most[place] > 1.0 - SURE or place == best]
        value, low, pair = float(self.worths.values[best]), float(self.worths.ends[0][best]), self.pair
        if pair is not None and value < ALONE * pair.worth:
            return "nothing", [], float(count)
        if most[best] >= SURE and low > 0.0:
            return "decided", [self.places[best]], float(count)
        if max(p, 1.0 - p) >= NEARLY_ALL:
            return "nothing", [], float(count)
        # The error of a difference falls as the root of the rows.
        less = self.worths.values[best] - np.append(self.worths.values, 0.0)
        error = (again[:, [best]] - again).std(axis=0, ddof=1)
        ratio = np.divide(SURE_Z * error, less, out=np.full(less.size, np.inf), where=less > 0.0)
        ratio[[best, *np.flatnonzero(most <= 0.0)]] = 0.0
        if low <= 0.0 < value:
            ratio[-1] = max(float(ratio[-1]), (value - low) / value)
        return "undecided", [self.places[place] for place in rivals], float(count * ratio.max() ** 2)


def _measured(places: Sequence[int], by: _Estimates) -> _Measured:
    """Worths and flips of inputs at ``places`` with all their errors."""
    whole = by.whole
    # A flip to the other side is none.
    again, parts = (
        [each._replace(flips=np.where(each.above == whole.above, each.flips, np.nan)) for each in many]
        for many in (by.again, by.parts)
    )

    def about(name: str) -> _Figures:
        value, wide, sharp, fewer = (getattr(each, name) for each in (whole, by.wide, by.sharp, by.fewer))
        scatter, averages = (np.array([getattr(each, name) for each in many]) for many in (again, parts))
        # Slices only ever blur a worth.
        blur = value - wide if name == "flips" else (value - wide).clip(0.0)
        biases = np.nan_to_num([blur, sharp - value, fewer - _mean(scatter)])
        return _Figures(value, _about(value, scatter, averages), biases)

    return _Measured(places, about("worths"), about("flips"), whole.above, about("pairs"))


def _about(values: Array, again: Array, parts: Array) -> Array:
    """Resamplings (b, i) moved so that their mean is the value (i,), and widened by the error of averages over fresh sets, which
    the scatter of parts (q, i) of these shows; what is not a number stays so."""
    off = again - _mean(again)
    variance = _mean(off**2)
    error = np.where(np.isfinite(parts).all(axis=0), parts, 0.0).var(axis=0, ddof=1) / len(parts)
    widening = np.sqrt(1.0 + np.divide(error, variance, out=np.zeros_like(error), where=variance > 0.0))
    return np.asarray(values + off * widening)


def _mean(again: Array) -> Array:
    """Mean (i,) of what is a number in resamplings (b, i), 0 where nothing is."""
    there = np.isfinite(again)
    return np.asarray(np.where(there, again, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1))


def _chances(gains: Sequence[tuple[Array, Array]]) -> Array:
    """Probability (k,) that all gains are positive, of what is predicted of each (k,) and missed (n,): what one row misses of all
    gains may be missed anywhere."""
    positive = np.ones((gains[0][1].size, gains[0][0].size), dtype=bool)
    for foretold, missed in gains:
        positive &= foretold > (missed.mean() - missed)[:, None]
    return positive.mean(axis=0)


def _worths(curves: Array, p: float) -> Array:
    """Gain in the chance of the right choice by knowing the slice, of probabilities (..., slices) in slices as likely as each
    other."""
    return np.asarray(np.maximum(curves, 1.0 - curves).mean(axis=-1) - max(p, 1.0 - p))


def _flip(curve: Array) -> tuple[float | None, bool]:
    """Quantile at which the probability crosses a half for good, by a logistic line through the slices, and whether it is
    larger above."""
    at = (np.arange(len(curve)) + 0.5) / len(curve)
    curve = _smooth(curve)
    sides = np.sign(curve - 0.5)
    if (sides >= 0.0).all() or (sides <= 0.0).all():
        return None, bool(curve.mean() > 0.5)
    # The crossing that leaves most slices on the side that their neighbours are on.
    crossings = np.flatnonzero(sides[:-1] * sides[1:] <= 0.0)
    fits = [abs(sides[: place + 1].sum()) + abs(sides[place + 1 :].sum()) for place in crossings]
    place = int(crossings[int(np.argmax(fits))])
    low, high = (special.logit(np.clip(curve[each], 1e-3, 1.0 - 1e-3)) for each in (place, place + 1))
    share = 0.5 if high == low else low / (low - high)
    return float(at[place] + np.clip(share, 0.0, 1.0) * (at[1] - at[0])), bool(sides[place + 1 :].sum() > 0.0)


def _smooth(curve: Array) -> Array:
    """Mean of each slice's neighbours within a 24th of the range, as many on either side: a straight line and the middle of a
    step stay where they are."""
    count = len(curve)
    at = np.arange(count)
    reach = np.minimum(np.minimum(at, count - 1 - at), count // 24)
    sums = np.concatenate([[0.0], np.cumsum(curve)])
    return np.asarray((sums[at + reach + 1] - sums[at - reach]) / (2 * reach + 1))
