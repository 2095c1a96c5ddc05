"""Responses of parts within tolerances about a point: their range, robust costs, shares of parts, and robust fronts.

A part is somewhere in the tolerance box about its nominal point. The robust cost of a point is the worst in that box, or a
quantile of the parts. Parts may lie beyond the region of the nominal points by their tolerance, as those about any selected
design do.

Responses are quadratics of coded factors, with a monotone ``link`` for a transformed response. Their range over a box is
exact, and their values around a point are computed together.

The share of parts that keep a limit is uncertain: it depends on the errors of the surfaces, and only some thousand parts
are counted. On each draw of the surfaces, k of n parts give the share Jeffreys' beta distribution of k + 1/2 and n - k + 1/2.
The distribution of all draws is the mean of these. The stated interval is the shortest with 95 %, for shares accumulate
at 0 and at 1, which an interval with equal tails would exclude.

Sources: Deb and Gupta, Introducing robustness in multi-objective optimization (2006), robust solutions of type I with the worst case
or a quantile in place of the mean; Brown, Cai and DasGupta, Interval estimation for a binomial proportion, Statistical Science 16
(2001) 101; Box and Tiao, Bayesian Inference in Statistical Analysis, section 2.8 (intervals of highest density).
"""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from itertools import product
from typing import Literal, NamedTuple

import numpy as np
from scipy import special
from scipy.stats import norm, qmc

from doe.pareto import search
from rbdyn.base.arrays import Array
from rbdyn.base.estimate import LEVEL
from rbdyn.base.records import Record

EXACT_FACTORS = (
    4  # number of factors up to which every face of a box is searched; beyond, corners and lines along factors
)


def identity(values: Array) -> Array:
    """The link of a response without transform."""
    return values


class Quadratic(Record, eq=False):
    """``link`` of constant + linear · x + x · matrix · x at coded points x; ``matrix`` (k, k) is symmetric."""

    constant: float
    linear: Array
    matrix: Array
    link: Callable[[Array], Array] = identity

    def predict(self, points: Array) -> Array:
        """Values (...) at coded points (..., k)."""
        return self.link(self._form(points))

    def around(self, centres: Array, offsets: Array) -> Array:
        """Values (n, s) at every centre (n, k) plus every offset (s, k)."""
        slopes = self.linear + 2.0 * centres @ self.matrix
        bend = np.einsum("sj,jk,sk->s", offsets, self.matrix, offsets)
        return self.link(self._form(centres)[:, None] + slopes @ offsets.T + bend)

    def range_over_box(self, centres: Array, half: Array) -> tuple[Array, Array]:
        """Smallest and largest value (n,) over the boxes centres (n, k) +- half (k,).

        An extreme of a quadratic in a box is a stationary point of one of its faces, corners and the whole box included.
        Up to `EXACT_FACTORS` factors all faces are searched and the range is exact. Beyond, the search starts at the best
        corner and goes along one factor after the other.
        """
        lowest, highest = _extremes(self, centres, half)
        ends = self.link(lowest), self.link(highest)
        return np.minimum(*ends), np.maximum(*ends)

    def _form(self, points: Array) -> Array:
        return self.constant + points @ self.linear + np.einsum("...j,jk,...k->...", points, self.matrix, points)


def _extremes(surface: Quadratic, centres: Array, half: Array) -> tuple[Array, Array]:
    free = [axis for axis in range(half.size) if half[axis] > 0.0]
    # On the box of offsets t in [-1, 1] of the free factors.
    scale = half[free]
    start = surface._form(centres)
    slopes = (surface.linear + 2.0 * centres @ surface.matrix)[:, free] * scale
    bend = surface.matrix[np.ix_(free, free)] * np.outer(scale, scale)
    if len(free) > EXACT_FACTORS:
        return start - _climb(-slopes, -bend), start + _climb(slopes, bend)
    follow, fixed = _faces(bend.tobytes(), len(free))
    # Stationary point of each face (faces, n, free); points outside the box do not count.
    offset = np.einsum("fij,nj->fni", follow, slopes) + fixed[:, None, :]
    change = (offset * slopes).sum(axis=-1) + np.einsum("fnj,jk,fnk->fn", offset, bend, offset)
    inside = (np.abs(offset) <= 1.0).all(axis=-1)
    lowest = np.where(inside, change, np.inf).min(axis=0)
    return start + lowest, start + np.where(inside, change, -np.inf).max(axis=0)


@lru_cache(maxsize=64)
def _faces(bend_bytes: bytes, free: int) -> tuple[Array, Array]:
    """Stationary points of all faces of the unit box, as follow @ slopes + fixed: (faces, k, k) and (faces, k).

    A face without curvature is omitted: its extremes are on its edges, which are faces too.
    """
    bend = np.frombuffer(bend_bytes).reshape(free, free)
    follow, fixed = [], []
    for face in product((-1.0, 0.0, 1.0), repeat=free):
        inside = np.array(face) == 0.0
        part = np.ix_(inside, inside)
        if inside.any() and np.linalg.cond(bend[part]) > 1e12:
            continue
        solve, place = np.zeros((free, free)), np.array(face)
        if inside.any():
            solve[part] = np.linalg.inv(-2.0 * bend[part])
            place[inside] = solve[part] @ (2.0 * bend[inside] @ np.array(face))
        follow.append(solve)
        fixed.append(place)
    return np.array(follow), np.array(fixed)


def _climb(slopes: Array, bend: Array, sweeps: int = 20) -> Array:
    """Largest change (n,) from the best corner, along the factors in turn."""
    corners = np.array(list(product((-1.0, 1.0), repeat=slopes.shape[1])))
    at_corners = slopes @ corners.T + np.einsum("sj,jk,sk->s", corners, bend, corners)
    offset = corners[at_corners.argmax(axis=1)]
    for axis in list(range(slopes.shape[1])) * sweeps:
        curvature = bend[axis, axis]
        gradient = slopes[:, axis] + 2.0 * (offset @ bend[:, axis] - offset[:, axis] * curvature)
        tries = np.stack([-np.ones(len(slopes)), np.ones(len(slopes))])
        if curvature < 0.0:
            tries = np.vstack([tries, (-gradient / (2.0 * curvature)).clip(-1.0, 1.0)])
        best = (gradient * tries + curvature * tries**2).argmax(axis=0)
        offset[:, axis] = np.take_along_axis(tries, best[None], axis=0)[0]
    return (offset * slopes).sum(axis=1) + np.einsum("nj,jk,nk->n", offset, bend, offset)


Distribution = Literal["normal", "uniform"]

SIGMAS = 3.0  # standard deviations in a half width: the tolerance is six of them


def offsets(shares: Array, distribution: Distribution) -> Array:
    """Offsets in [-1, 1] of cumulative shares in (0, 1), any shape.

    "normal": mean at mid tolerance and a tolerance of 6 standard deviations, without the parts outside; or "uniform".
    """
    if distribution == "uniform":
        return 2.0 * shares - 1.0
    outside = norm.cdf(-SIGMAS)
    return norm.ppf(outside + shares * (1.0 - 2.0 * outside)) / SIGMAS


@lru_cache(maxsize=8)
def even_offsets(count: int, factors: int, distribution: Distribution) -> Array:
    """Fixed offsets (count, factors) that fill the tolerance box evenly (Sobol points)."""
    points = qmc.Sobol(factors, scramble=False).random(count)
    # A shift by half a cell keeps the points off the rim.
    return offsets((points + 0.5 / count) % 1.0, distribution)


def random_offsets(count: int, factors: int, distribution: Distribution, seed: int) -> Array:
    """Independent offsets (count, factors) of parts."""
    return offsets(np.random.default_rng(seed).uniform(size=(count, factors)), distribution)


def error_of_share(share: float, count: int) -> float:
    """Monte Carlo standard error of a share of ``count`` parts, never zero."""
    return math.sqrt(max(share * (1.0 - share), 1.0 / count) / count)


# Number of shares that represent the distribution of all draws, and least number for one draw.
SHARES, FEWEST = 4000, 20


class Interval(NamedTuple):
    """Ends of the 95 % interval of a share."""

    low: float
    high: float

    @property
    def words(self) -> str:
        """'71.3 to 99.8 %'."""
        return f"{percent(self.low)} to {percent(self.high)} %"

    def containing(self, share: float | None) -> "Interval":
        """The interval, widened to the ``share`` on the mean surfaces, if known: the shortest one may leave it out."""
        return self if share is None else Interval(min(self.low, share), max(self.high, share))


def interval_of_share(hits: Array, parts: int) -> Interval:
    """Interval of a share from the hits (d,) among ``parts`` parts on each draw."""
    counts, times = np.unique(hits, return_counts=True)
    levels = max(SHARES // counts.size, FEWEST)
    quantiles = (np.arange(levels) + 0.5) / levels
    sample = special.betaincinv(counts[:, None] + 0.5, parts - counts[:, None] + 0.5, quantiles).ravel()
    order = np.argsort(sample, kind="stable")
    shares, behind = sample[order], np.cumsum(np.repeat(times, levels)[order])
    # For every lower end, the nearest upper end with enough probability.
    enough = np.searchsorted(behind, np.append(0, behind[:-1]) + LEVEL * behind[-1] * (1.0 - 1e-12))
    complete = np.flatnonzero(enough < shares.size)
    first = int(complete[np.argmin(shares[enough[complete]] - shares[complete])])
    low, high = float(shares[first]), float(shares[enough[first]])
    # With no hits the interval starts at 0, with all hits it ends at 1 (Brown, Cai and DasGupta).
    none = special.betaincinv(0.5, parts + 0.5, quantiles[-1])
    every = special.betaincinv(parts + 0.5, 0.5, quantiles[0])
    return Interval(0.0 if low <= none else low, 1.0 if high >= every else high)


def percent(share: float) -> str:
    """Text of a share in percent, such as '71.3'; only 0 and 1 become '0.0' and '100.0'."""
    if 0.0 < share < 0.0005:
        return "below 0.1"
    return "above 99.9" if 0.9995 <= share < 1.0 else f"{100.0 * share:.1f}"


Kind = Literal["worst_case", "quantile"]

SURVIVAL_PARTS = 4096  # even offsets that give the share of surviving parts


class ToleranceBox(Record, eq=False):
    """Half widths (k,) of the tolerances in coded units, and the robust cost of the parts within them.

    "worst_case": the exact worst in the box. "quantile": the ``quantile`` of each response alone, over ``samples`` even
    offsets of the ``distribution``.
    """

    half: Array
    kind: Kind = "worst_case"
    quantile: float = 0.95
    distribution: Distribution = "normal"
    samples: int = 256

    def judge(
        self, surfaces: Sequence[Quadratic], goals: search.Goals, points: Array, doubt: search.Doubt | None = None
    ) -> search.Judged:
        """Robust costs (n, q) and violations (n, c) of coded points (n, k); limits must hold within the ``doubt``."""
        below, above = (0.0, 0.0) if doubt is None else doubt(points)
        if self.kind == "worst_case":
            pairs = [surface.range_over_box(points, self.half) for surface in surfaces]
            low, high = (np.column_stack(part) for part in zip(*pairs, strict=True))
            return search.Judged(goals.worst(low, high), goals.violations(low - below, high + above))
        return self.judge_parts(self.parts(surfaces, points), goals, below, above)

    def judge_parts(
        self, values: Array, goals: search.Goals, below: Array | float = 0.0, above: Array | float = 0.0
    ) -> search.Judged:
        """Robust costs (n, q) and violations (n, c) from the responses (n, s, m) of parts, of the worst part or a quantile."""
        share = 1.0 if self.kind == "worst_case" else self.quantile
        costs = np.quantile(goals.costs(values), share, axis=1)
        if not goals.limited:
            return search.Judged(costs, np.zeros((*costs.shape[:-1], 0)))
        low, high = (np.quantile(values, side, axis=1) for side in (1.0 - share, share))
        return search.Judged(costs, goals.violations(low - below, high + above))

    def farthest(self, barred: search.Barred, points: Array) -> Array:
        """How far (n,) the farthest corner of the box about each of the points (n, k) lies in what is ``barred``."""
        corners = self.half * np.array(list(product((-1.0, 1.0), repeat=self.half.size)))
        return barred((points[:, None] + corners).reshape(-1, self.half.size)).reshape(len(points), -1).max(axis=1)

    def parts(self, surfaces: Sequence[Quadratic], points: Array, samples: int | None = None) -> Array:
        """Responses (n, s, m) of parts at coded nominal points (n, k)."""
        offset = self.half * even_offsets(samples or self.samples, self.half.size, self.distribution)
        return search.columns_of([surface.around(points, offset) for surface in surfaces])


class Survival(Record):
    """Shares of the parts that still dominate the nominal baseline, at the pick without tolerances and at that with them.

    ``standard_error``: of as many random parts, an upper bound for even ones. Intervals have the errors of the surfaces, None until
    they are drawn; ``open_errors``: the errors that they hold and leave out.
    """

    plain_pick: float | None
    pick: float | None
    standard_error: float | None
    plain_pick_interval: Interval | None
    pick_interval: Interval | None
    open_errors: str


class ToleranceAware(Record, eq=False):
    """Front of robust costs.

    ``points`` (f, k) are coded, ``costs`` (f, q) robust, ``values`` (f, m) nominal responses, ``picks`` rows.
    ``baseline_costs`` (q,): robust costs of the baseline. ``nominal_loss_percent``: loss of hypervolume by the nominal values
    compared with the plain front; ``robust_gain_percent``: gain of hypervolume by the robust costs.
    """

    box: ToleranceBox
    points: Array
    costs: Array
    values: Array
    picks: dict[search.Rule, int]
    pick: int
    pick_reason: str
    baseline_costs: Array
    hypervolume: float
    nominal_loss_percent: float
    robust_gain_percent: float
    plain_pick_costs: Array
    survival: Survival


def tolerance_aware_front(
    surfaces: Sequence[Quadratic],
    box: ToleranceBox,
    lower: Array,
    upper: Array,
    goals: search.Goals,
    *,
    baseline: Array,
    plain: search.Archive,
    plain_pick: int,
    population: int = 100,
    generations: int = 200,
    seed: int = 1,
    keep: int = 200,
    pick: search.Rule = "knee",
    doubt: search.Doubt | None = None,
    barred: search.Barred | None = None,
) -> ToleranceAware:
    """NSGA-II on robust costs, and the comparison with the plain front; the same seed gives the same bits.

    surfaces : of the m responses, in coded units.
    box : the tolerances.
    lower, upper : bounds (k,) of the nominal points in coded units.
    goals : of the responses.
    baseline : coded point (k,) to improve on. If robust costs of any point dominate its nominal costs, picks are among such
        points, else among those that dominate its robust costs.
    plain, plain_pick : coded points and costs of the plain front, and the row of its pick.
    population, generations, seed, keep, pick, doubt : as for `doe.pareto.front`, of coded points.
    barred : where no corner of a tolerance box may lie.

    Raises ValueError when a setting of the search is impossible; InfeasibleError when no point keeps all limits.
    """
    search.check_search(lower, upper, population, generations, keep)
    judge = partial(box.judge, surfaces, goals)
    barred_parts = None if barred is None else partial(box.farthest, barred)
    searched = search.search(
        search.barring(partial(judge, doubt=doubt), barred_parts), lower, upper, population, generations, seed
    )
    points, costs = searched.archive
    nominal_baseline = goals.costs(_nominal(surfaces, baseline[None]))[0]
    baseline_costs = judge(baseline[None]).costs[0]
    survives_nominal = bool(search.dominates(costs, nominal_baseline).any())
    rows, picks, among = search.thinning(costs, goals, nominal_baseline if survives_nominal else baseline_costs, keep)
    values = _nominal(surfaces, points[rows])
    robust_plain = judge(plain.points).costs
    spans, robust_spans = ((front.min(axis=0), front.max(axis=0)) for front in (plain.costs, costs))
    losing = search.hypervolume(goals.costs(values), *spans), search.hypervolume(plain.costs, *spans)
    gaining = search.hypervolume(costs[rows], *robust_spans), search.hypervolume(robust_plain, *robust_spans)
    candidates = np.vstack([plain.points[plain_pick], points[rows[picks[pick]]]])
    part_costs = goals.costs(box.parts(surfaces, candidates, SURVIVAL_PARTS))
    survives = np.mean(search.dominates(part_costs, nominal_baseline), axis=1).tolist()
    error = max(error_of_share(share, SURVIVAL_PARTS) for share in survives)
    return ToleranceAware(
        box=box,
        points=points[rows],
        costs=costs[rows],
        values=values,
        picks=picks,
        pick=picks[pick],
        pick_reason=f"{search.NAMES[pick]} {among}"
        + (" also at the ends of their tolerances" if survives_nominal else ""),
        baseline_costs=baseline_costs,
        hypervolume=search.hypervolume(costs, *robust_spans),
        # No nominal point is better than the plain front but by what that search missed.
        nominal_loss_percent=100.0 * max(1.0 - losing[0] / losing[1], 0.0) if losing[1] > 0.0 else 0.0,
        robust_gain_percent=100.0 * (gaining[0] / gaining[1] - 1.0) if gaining[1] > 0.0 else np.inf,
        plain_pick_costs=robust_plain[plain_pick],
        survival=Survival(survives[0], survives[1], error, None, None, ""),
    )


def _nominal(surfaces: Sequence[Quadratic], points: Array) -> Array:
    return np.column_stack([surface.predict(points) for surface in surfaces])
