"""Backwards from a pick: the widest tolerances of its factors within which parts keep what the pick promises."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

from doe.arrays import Array, Mask
from doe.pareto.manufacture import Distribution, error_of_share, random_offsets

Costs = Callable[[Array], Array]
Aim = Literal["ratios", "product", "sum"]

MARCH = 32  # steps up to the rim of the region in which the first loss is looked for
HALVINGS = 24
RIM = "the rim of the region"


@dataclass(frozen=True, eq=False)
class WidestTolerances:
    """Half widths (k,) of the widest tolerances and what they keep.

    ``probability`` is the share of the parts that keep every limit, ``standard_error`` its Monte Carlo error.
    ``limited_by`` names the limit that parts break first beyond, or the rim of the region; ``at_rim`` (k,) the
    factors that reach it. ``sentence`` says it in words.
    """

    half_widths: Array
    probability: float
    standard_error: float
    limited_by: str
    at_rim: Mask
    sentence: str

    def as_dict(self, factors: Sequence[str]) -> dict[str, dict[str, Any]]:
        """JSON: factor to half width, probability with its error, and what limits it."""
        return {
            name: {
                "half_width": float(width),
                "probability": self.probability,
                "standard_error": self.standard_error,
                "limited_by": RIM if rim else self.limited_by,
            }
            for name, width, rim in zip(factors, self.half_widths, self.at_rim, strict=True)
        }


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
    weights: ArrayLike | None = None,
) -> WidestTolerances:
    """Find the widest tolerances with which a part keeps all limits with a given probability.

    Parameters
    ----------
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
    aim : "ratios" keeps them; "product" maximises the product of the half widths to the power of ``weights``, "sum"
        their sum times ``weights`` (one over the ratios unless given), each within a twentieth to twenty times the given ratios.

    The widest is looked for from the pick outwards up to the first loss, so all narrower tolerances keep the limits
    too. Where even the exact pick breaks a limit, all widths are zero.

    Raises
    ------
    ValueError when a ratio is not positive, a probability is not in (0, 1), or the pick is outside the region.
    """
    centre, share = np.asarray(pick, float), np.asarray(ratios, float)
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    room = np.minimum(centre - low, high - centre)
    if (share <= 0.0).any() or not 0.0 < probability < 1.0:
        raise ValueError(f"ratios = {share.tolist()}, probability = {probability}: must be positive and in (0, 1)")
    if (room < -1e-9 * (high - low)).any():
        raise ValueError(f"pick = {centre.tolist()}: lies outside the region; pick a point within it")
    parts = _Parts(
        objectives,
        centre,
        np.asarray(limits, float),
        room.clip(0.0),
        random_offsets(samples, centre.size, distribution, seed),
    )
    if parts.kept(np.zeros(centre.size)) < probability:
        worst = names[int(parts.broken(np.zeros(centre.size)).argmax())]
        return _nothing(
            parts, worst, f"even the exact pick keeps {worst} with a probability below {100 * probability:g} %"
        )
    if aim != "ratios":
        usual = np.ones(centre.size) if aim == "product" else 1.0 / share
        weight = usual if weights is None else np.asarray(weights, float)
        share = _best_ratios(parts, share, probability, aim, weight)
    return _result(parts, parts.widest(share, probability), share, probability, names)


@dataclass(frozen=True, eq=False)
class _Parts:
    objectives: Costs
    centre: Array
    limits: Array
    room: Array
    offsets: Array

    def broken(self, half: Array) -> Array:
        """How many parts break each limit, (c,)."""
        costs = self.objectives(self.centre + half * self.offsets)
        return (~(costs <= self.limits)).sum(axis=0).astype(float)

    def kept(self, half: Array) -> float:
        """Share of the parts that keep all limits."""
        costs = self.objectives(self.centre + half * self.offsets)
        return float((costs <= self.limits).all(axis=1).mean())

    def probability(self, half: Array) -> tuple[float, float]:
        """Share of the parts that keep all limits and its standard error."""
        share = self.kept(half)
        return share, error_of_share(share, len(self.offsets))

    def half(self, ratios: Array, scale: float) -> Array:
        """Half widths at a scale, none beyond the region."""
        return np.minimum(ratios * scale, self.room)

    def widest(self, ratios: Array, probability: float, march: int = MARCH) -> float:
        """Largest scale up to which the limits are kept."""
        top = float((self.room / ratios).max())
        steps = np.linspace(0.0, top, march + 1)
        first = next((i for i in range(1, march + 1) if self.kept(self.half(ratios, steps[i])) < probability), None)
        if first is None:
            return top
        good, bad = float(steps[first - 1]), float(steps[first])
        for _ in range(HALVINGS):
            middle = (good + bad) / 2.0
            if self.kept(self.half(ratios, middle)) < probability:
                bad = middle
            else:
                good = middle
        return good


def _best_ratios(parts: _Parts, share: Array, probability: float, aim: Aim, weight: Array) -> Array:
    """Ratios whose widest tolerances have the largest product or sum."""
    reach = np.log(20.0)
    free = np.flatnonzero(parts.room > 0.0)

    def ratios(logarithms: Array) -> Array:
        changed = share.copy()
        changed[free] *= np.exp(logarithms - logarithms.mean())
        return changed

    def worth(logarithms: Array) -> float:
        trial = ratios(logarithms)
        half = parts.half(trial, parts.widest(trial, probability, march=4))[free]
        value = weight[free] @ np.log(half.clip(1e-300)) if aim == "product" else weight[free] @ half
        return -float(value)

    found = minimize(
        worth,
        np.zeros(free.size),
        method="Nelder-Mead",
        bounds=[(-reach, reach)] * free.size,
        options={
            "maxfev": 60 * max(free.size, 1),
            "xatol": 1e-3,
            "fatol": 1e-4,
            "initial_simplex": np.vstack([np.zeros(free.size), 0.7 * np.eye(free.size)]),
        },
    )
    return ratios(found.x)


def _nothing(parts: _Parts, limit: str, cause: str) -> WidestTolerances:
    zero = np.zeros_like(parts.centre)
    advice = "ask for less of the gain, or for less certainty"
    return WidestTolerances(
        zero,
        *parts.probability(zero),
        limited_by=limit,
        at_rim=np.zeros(zero.size, dtype=bool),
        sentence=f"No tolerance at all: {cause}; {advice}.",
    )


def _result(parts: _Parts, scale: float, ratios: Array, probability: float, names: Sequence[str]) -> WidestTolerances:
    top = float((parts.room / ratios).max())
    if scale <= 1e-6 * top:
        first = names[int(parts.broken(parts.half(ratios, 1e-3 * top)).argmax())]
        return _nothing(
            parts, first, f"as soon as parts differ, less than {100 * probability:g} % of them keep {first}"
        )
    half = parts.half(ratios, scale)
    at_rim = half >= parts.room * (1.0 - 1e-9)
    # Just beyond, the limit that parts break most is what holds the tolerances back.
    broken = parts.broken(parts.half(ratios, scale * 1.02))
    limit = RIM if at_rim.all() else names[int(broken.argmax())]
    share, error = parts.probability(half)
    kept = f"Within these tolerances {100 * share:.1f} ± {196 * error:.1f} % of the parts keep all limits"
    rim = " Where a tolerance ends at the rim of the region, no run tells whether it may be wider."
    sentence = f"{kept}; {limit} holds them back." + (rim if at_rim.any() else "")
    return WidestTolerances(half, share, error, limit, at_rim, sentence)
