"""Backwards from a pick: the widest tolerances of its factors within which parts keep what the pick promises."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

from doe.pareto.manufacture import Distribution, Interval, error_of_share, interval_of_share, percent, random_offsets
from rbdyn.base.arrays import Array, Mask, Rows
from rbdyn.base.faults import MethodError

Costs = Callable[[Array], Array]
# Parts (n, k) to the number of them that keep all limits on each draw (d,) of what judges them.
Kept = Callable[[Array], Array]
Aim = Literal["ratios", "product", "sum"]

MARCH = 32  # steps up to the rim of the region in which the first loss is looked for
HALVINGS = 24
RIM = "the rim of the region"
MOST_JUDGED = 4096  # parts that are judged on every draw


@dataclass(frozen=True, eq=False)
class WidestTolerances:
    """Half widths (k,) of the widest tolerances, NaN of what has none, and what they keep.

    ``probability`` is the share of the parts that keep every limit, ``standard_error`` its Monte Carlo error alone;
    ``interval`` holds the true share with 95 %, as far as what was drawn shows.
    ``limited_by`` names the limit that parts break first beyond, or the rim of the region; ``at_rim`` (k,) the
    factors that reach it. ``sentence`` says it in words.
    """

    half_widths: Array
    probability: float
    standard_error: float
    interval: Interval
    limited_by: str
    at_rim: Mask
    sentence: str

    def as_dict(self, factors: Sequence[str]) -> dict[str, dict[str, Any]]:
        """JSON: factor to half width, probability with its error and interval, and what limits it."""
        sure: dict[str, Any] = {"probability": self.probability, "standard_error": self.standard_error}
        sure |= {"interval": list(self.interval)}
        return {
            name: {"half_width": float(width), **sure, "limited_by": RIM if rim else self.limited_by}
            for name, width, rim in zip(factors, self.half_widths, self.at_rim, strict=True)
            if not np.isnan(width)
        }

    def among(self, factors: Rows, count: int) -> Self:
        """The same as those of some of ``count`` factors, of which the others have none."""
        half, rim = np.full(count, np.nan), np.zeros(count, dtype=bool)
        half[factors], rim[factors] = self.half_widths, self.at_rim
        return replace(self, half_widths=half, at_rim=rim)


def widest_tolerances(
    objectives: Costs,
    pick: ArrayLike,
    limits: ArrayLike,
    ratios: ArrayLike,
    *,
    lower: ArrayLike,
    upper: ArrayLike,
    names: Sequence[str],
    probability: float = 0.95,
    distribution: Distribution = "normal",
    samples: int = 4096,
    seed: int = 1,
    aim: Aim = "ratios",
    promise: str = "keep all limits",
    drawn: Kept | None = None,
    open_errors: str = "",
) -> WidestTolerances:
    """Find the widest tolerances with which a part keeps all limits with a given probability.

    objectives : maps points (samples, k) to costs (samples, c). Row i always belongs to part i, so a surface of its
        own may be drawn for each part; then ``limits`` has a row a part too.
    pick : the nominal point (k,).
    limits : largest costs (c,) or (samples, c) that count as kept.
    ratios : half widths (k,) relative to each other; all are widened together.
    lower, upper : bounds (k,) of the region. No half width goes beyond, for no surface knows what is there.
    names : of the limits (c,), for the result.
    probability : share of the parts that must keep all limits.
    distribution : of the parts within the tolerance, see `doe.pareto.manufacture.offsets`.
    samples, seed : parts drawn; the same for every width (common random numbers).
    aim : "ratios" keeps them; "product" maximises the product of the half widths, "sum" their sum in units of the ratios, each
        within a twentieth to twenty times the given ratios.
    promise : what the parts do that count, in words, for the sentence.
    drawn : counts the parts that keep all limits on each draw of what judges them, for the interval; without it the
        parts drawn alone are uncertain.
    open_errors : sentence on what the interval holds and what it takes as exact.

    The widest is looked for from the pick outwards up to the first loss, so all narrower tolerances keep the limits
    too. Where even the exact pick breaks a limit, all widths are zero.

    Raises MethodError when a ratio is not positive, a probability is not in (0, 1), or the pick is outside the region.
    """
    centre, share = np.asarray(pick, float), np.asarray(ratios, float)
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    room = np.minimum(centre - low, high - centre)
    if (share <= 0.0).any() or not 0.0 < probability < 1.0:
        raise MethodError(f"ratios = {share.tolist()}, probability = {probability}: must be positive and in (0, 1)")
    if (room < -1e-9 * (high - low)).any():
        raise MethodError(f"pick = {centre.tolist()}: lies outside the region; pick a point within it")
    offsets = random_offsets(samples, centre.size, distribution, seed)
    said = promise, open_errors
    limit = np.asarray(limits, float)
    parts = _Parts(objectives, centre, limit, room.clip(0.0), offsets, names, probability, said, drawn)
    exact = np.zeros(centre.size)
    if parts.kept(exact) < probability:
        worst = parts.most_broken(exact)
        return parts.nothing(
            worst, f"even the exact pick keeps {worst} with a probability below the {parts.percent} demanded"
        )
    if aim != "ratios":
        share = _best_ratios(parts, share, aim)
    return _result(parts, parts.widest(share), share)


@dataclass(frozen=True, eq=False)
class _Parts:
    """Parts about a point, and the ``wanted`` probability with which they must keep limits of these names."""

    objectives: Costs
    centre: Array
    limits: Array
    room: Array
    offsets: Array
    names: Sequence[str]
    wanted: float
    said: tuple[str, str]
    drawn: Kept | None

    @property
    def percent(self) -> str:
        """The wanted probability in words."""
        return f"{100 * self.wanted:g} %"

    def keep(self, half: Array) -> Mask:
        """Whether each part keeps each limit, (samples, c)."""
        return np.asarray(self.objectives(self.centre + half * self.offsets) <= self.limits)

    def kept(self, half: Array) -> float:
        """Share of the parts that keep all limits."""
        return float(self.keep(half).all(axis=1).mean())

    def interval(self, half: Array) -> Interval:
        """Interval of the share that keep all limits."""
        if self.drawn is None:
            return interval_of_share(np.array([self.keep(half).all(axis=1).sum()]), len(self.offsets))
        some = self.offsets[:MOST_JUDGED]
        return interval_of_share(self.drawn(self.centre + half * some), len(some))

    def most_broken(self, half: Array) -> str:
        """The limit that most parts break."""
        return self.names[int((~self.keep(half)).sum(axis=0).argmax())]

    def half(self, ratios: Array, scale: float) -> Array:
        """Half widths at a scale, none beyond the region."""
        return np.minimum(ratios * scale, self.room)

    def widest(self, ratios: Array, march: int = MARCH) -> float:
        """Largest scale up to which the limits are kept."""

        def lost(scale: float) -> bool:
            return self.kept(self.half(ratios, scale)) < self.wanted

        steps = np.linspace(0.0, float((self.room / ratios).max()), march + 1).tolist()
        first = next((place for place in range(1, march + 1) if lost(steps[place])), None)
        if first is None:
            return steps[-1]
        good, bad = steps[first - 1], steps[first]
        for _ in range(HALVINGS):
            middle = (good + bad) / 2.0
            good, bad = (good, middle) if lost(middle) else (middle, bad)
        return good

    def nothing(self, limit: str, cause: str) -> WidestTolerances:
        """No tolerance, because of a limit."""
        zero, share = np.zeros_like(self.centre), self.kept(np.zeros_like(self.centre))
        sentence = f"No tolerance at all: {cause}; ask for less of the gain, or for less certainty."
        error = error_of_share(share, len(self.offsets))
        return WidestTolerances(zero, share, error, self.interval(zero), limit, zero.astype(bool), sentence)


def _best_ratios(parts: _Parts, share: Array, aim: Aim) -> Array:
    """Ratios whose widest tolerances have the largest product or sum."""
    reach = np.log(20.0)
    free = np.flatnonzero(parts.room > 0.0)

    def ratios(logarithms: Array) -> Array:
        changed = share.copy()
        changed[free] *= np.exp(logarithms - logarithms.mean())
        return changed

    def worth(logarithms: Array) -> float:
        trial = ratios(logarithms)
        half = parts.half(trial, parts.widest(trial, march=4))[free]
        return -float(np.log(half.clip(1e-300)).sum() if aim == "product" else (1.0 / share[free]) @ half)

    start, bounds = np.zeros(free.size), [(-reach, reach)] * free.size
    simplex = np.vstack([start, 0.7 * np.eye(free.size)])
    options = {"maxfev": 60 * max(free.size, 1), "xatol": 1e-3, "fatol": 1e-4, "initial_simplex": simplex}
    return ratios(minimize(worth, start, method="Nelder-Mead", bounds=bounds, options=options).x)


def _result(parts: _Parts, scale: float, ratios: Array) -> WidestTolerances:
    top = float((parts.room / ratios).max())
    if scale <= 1e-6 * top:
        first = parts.most_broken(parts.half(ratios, 1e-3 * top))
        return parts.nothing(first, f"as soon as parts differ, less than {parts.percent} of them keep {first}")
    half = parts.half(ratios, scale)
    at_rim = half >= parts.room * (1.0 - 1e-9)
    # Just beyond, the tolerances are limited by what most parts break.
    limit = RIM if at_rim.all() else parts.most_broken(parts.half(ratios, scale * 1.02))
    share = parts.kept(half)
    error = error_of_share(share, len(parts.offsets))
    interval, (promise, open_errors) = parts.interval(half), parts.said
    within = f"Within these tolerances {percent(share)} % ({interval.words}) of the parts {promise}, {parts.percent} demanded"
    rim = "Where a tolerance ends at the rim of the region, no run shows whether it may be wider."
    said = [f"{within}. They are limited by {limit}.", open_errors, rim if at_rim.any() else ""]
    return WidestTolerances(half, share, error, interval, limit, at_rim, " ".join(filter(None, said)))
