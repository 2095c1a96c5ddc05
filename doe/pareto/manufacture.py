"""What manufacture leaves of a point: parts within a tolerance, the range of responses over it, and fronts that allow for it.

A manufactured part lies somewhere in the tolerance box about its nominal point. The robust cost of a point is the
worst over that box, or the quantile of the parts. Nominal points keep their whole box inside the region, so no
surface is extrapolated.

Responses over a tolerance are quadratics of coded factors, seen through a monotone ``link`` where the response was transformed
before it was fitted: their range over a box is exact, and their values are found all around a point at once.

The share of parts that keep something: on drawn surfaces other parts keep it than on the fitted ones, and only some thousand parts are
counted. On each draw the share that k of n parts show has Jeffreys' beta distribution, of k + 1/2 and n - k + 1/2; that of all draws
together is the mean of theirs. The interval stated is the shortest that holds 95 % of it: shares pile up at 0 and at 1, which an
interval with equal tails would leave out.

Sources: Deb and Gupta, Introducing robustness in multi-objective optimization (2006), robust solutions of type I with the worst case
or a quantile in place of the mean; Brown, Cai and DasGupta, Interval estimation for a binomial proportion, Statistical Science 16
(2001) 101; Box and Tiao, Bayesian Inference in Statistical Analysis, section 2.8 (intervals of highest density).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import product
from typing import Literal, NamedTuple

import numpy as np
from scipy import special
from scipy.stats import norm, qmc

from doe.pareto.goals import NAMES, Goals, Rule, thinned
from doe.pareto.search import Archive, Doubt, Judged, check_search, dominates, hypervolume, search
from rbdyn.base.arrays import Array

EXACT_FACTORS = 4  # up to here every face of a box is searched; beyond, its corners and lines along the factors


def identity(values: Array) -> Array:
    """The link of a response that was fitted as it is."""
    return values


@dataclass(frozen=True, eq=False)
class Quadratic:
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

        An extreme of a quadratic over a box is a stationary point of one of the box's faces (corners and the box
        itself among them). Up to `EXACT_FACTORS` factors all are searched and the range is exact; beyond, the search
        starts at the best corner and goes along one factor after the other.
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
    # Stationary point of each face (faces, n, free); what falls outside the box is not on the face.
    offset = np.einsum("fij,nj->fni", follow, slopes) + fixed[:, None, :]
    change = (offset * slopes).sum(axis=-1) + np.einsum("fnj,jk,fnk->fn", offset, bend, offset)
    inside = (np.abs(offset) <= 1.0).all(axis=-1)
    lowest = np.where(inside, change, np.inf).min(axis=0)
    return start + lowest, start + np.where(inside, change, -np.inf).max(axis=0)


@lru_cache(maxsize=64)
def _faces(bend_bytes: bytes, free: int) -> tuple[Array, Array]:
    """Stationary points of all faces of the unit box, as follow @ slopes + fixed: (faces, k, k) and (faces, k).

    A face without curvature has its extremes on its own edge, which is a face too, and is left out.
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
    """Largest change (n,) found from the best corner along the factors in turn."""
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

    "normal": mean at mid tolerance, tolerance of 6 standard deviations, parts outside it sorted out; "uniform".
    """
    if distribution == "uniform":
        return 2.0 * shares - 1.0
    outside = norm.cdf(-SIGMAS)
    return norm.ppf(outside + shares * (1.0 - 2.0 * outside)) / SIGMAS


def even_offsets(count: int, factors: int, distribution: Distribution) -> Array:
    """Offsets (count, factors) that fill the tolerance box evenly (Sobol points, always the same)."""
    points = qmc.Sobol(factors, scramble=False).random(count)
    # Half a cell in, lest a point lie on the rim.
    return offsets((points + 0.5 / count) % 1.0, distribution)


def random_offsets(count: int, factors: int, distribution: Distribution, seed: int) -> Array:
    """Independent offsets (count, factors) of parts."""
    return offsets(np.random.default_rng(seed).uniform(size=(count, factors)), distribution)


def error_of_share(share: float, count: int) -> float:
    """Monte Carlo standard error of the share of ``count`` parts that keep something; never nil."""
    return math.sqrt(max(share * (1.0 - share), 1.0 / count) / count)


LEVEL = 0.95
# Shares that stand for the distribution of all draws, and of one of them at least.
SHARES, FEWEST = 4000, 20


class Interval(NamedTuple):
    """Ends of the 95 % interval of a share."""

    low: float
    high: float

    @property
    def words(self) -> str:
        """'71.3 to 99.8 %'."""
        return f"{percent(self.low)} to {percent(self.high)} %"


def interval_of_share(kept: Array, parts: int) -> Interval:
    """Interval of a share from the number of parts (d,), of so many, that keep it on each draw."""
    counts, times = np.unique(kept, return_counts=True)
    levels = max(SHARES // counts.size, FEWEST)
    quantiles = (np.arange(levels) + 0.5) / levels
    each = special.betaincinv(counts[:, None] + 0.5, parts - counts[:, None] + 0.5, quantiles).ravel()
    order = np.argsort(each, kind="stable")
    shares, behind = each[order], np.cumsum(np.repeat(times, levels)[order])
    # From every share the nearest one up to which the interval holds enough.
    enough = np.searchsorted(behind, np.append(0, behind[:-1]) + LEVEL * behind[-1] * (1.0 - 1e-12))
    whole = np.flatnonzero(enough < shares.size)
    first = int(whole[np.argmin(shares[enough[whole]] - shares[whole])])
    low, high = float(shares[first]), float(shares[enough[first]])
    # Where none and all keep it, the share reaches to 0 and to 1 (Brown, Cai and DasGupta).
    none = special.betaincinv(0.5, parts + 0.5, quantiles[-1])
    every = special.betaincinv(parts + 0.5, 0.5, quantiles[0])
    return Interval(0.0 if low <= none else low, 1.0 if high >= every else high)


def percent(share: float) -> str:
    """'71.3' of a share: to a tenth of a percent, and never '100.0' of less than all or '0.0' of more than none."""
    if 0.0 < share < 0.0005:
        return "below 0.1"
    return "above 99.9" if 0.9995 <= share < 1.0 else f"{100.0 * share:.1f}"


Kind = Literal["worst_case", "quantile"]

SURVIVAL_PARTS = 4096  # even offsets from which the share of surviving parts is counted


@dataclass(frozen=True, eq=False)
class ToleranceBox:
    """Half widths (k,) of the tolerances in coded units and what is made of the parts within them.

    "worst_case": the worst over the box, exact. "quantile": what all but a share 1 - ``quantile`` of the parts keep,
    for each response by itself, from ``samples`` even offsets of the ``distribution``.
    """

    half: Array
    kind: Kind = "worst_case"
    quantile: float = 0.95
    distribution: Distribution = "normal"
    samples: int = 256

    def judge(self, surfaces: Sequence[Quadratic], goals: Goals, points: Array, doubt: Doubt | None = None) -> Judged:
        """Robust costs (n, q) and violations (n, c) of coded points (n, k); limits hold all over the ``doubt``."""
        below, above = (0.0, 0.0) if doubt is None else doubt(points)
        if self.kind == "worst_case":
            pairs = [surface.range_over_box(points, self.half) for surface in surfaces]
            low, high = (np.column_stack(part) for part in zip(*pairs, strict=True))
            return Judged(goals.worst(low, high), goals.violations(low - below, high + above))
        return self.judge_parts(self.parts(surfaces, points), goals, below, above)

    def judge_parts(
        self, values: Array, goals: Goals, below: Array | float = 0.0, above: Array | float = 0.0
    ) -> Judged:
        """Robust costs (n, q) and violations (n, c) from the responses (n, s, m) of parts: of the worst of them, or the
        quantile that they keep."""
        share = 1.0 if self.kind == "worst_case" else self.quantile
        costs = np.quantile(goals.costs(values), share, axis=1)
        low, high = (np.quantile(values, side, axis=1) for side in (1.0 - share, share))
        return Judged(costs, goals.violations(low - below, high + above))

    def parts(self, surfaces: Sequence[Quadratic], points: Array, samples: int | None = None) -> Array:
        """Responses (n, s, m) of parts made at coded points (n, k)."""
        offset = self.half * even_offsets(samples or self.samples, self.half.size, self.distribution)
        return np.stack([surface.around(points, offset) for surface in surfaces], axis=-1)


@dataclass(frozen=True, eq=False)
class ToleranceAware:
    """Front of robust costs.

    ``points`` (f, k) coded; ``costs`` (f, q) robust; ``values`` (f, m) nominal responses. ``picks`` are rows.
    ``baseline_costs`` (q,) are the robust ones of the baseline. ``nominal_loss_percent``: how much less hypervolume the
    nominal values of this front have than the plain front's; ``robust_gain_percent``: how much more hypervolume its
    robust costs have than those of the plain front. ``plain_survives``, ``pick_survives``: share of the parts made at
    the plain pick, and at this front's, that still dominate the nominal baseline; ``survival_error`` is the
    standard error that as many random parts would have, an upper bound for even ones; ``plain_interval`` and ``pick_interval``
    hold these shares with what the surfaces leave open, None until that is drawn. Where the plain pick's box is not ``plain_inside`` the region, its figures extrapolate.
    """

    box: ToleranceBox
    points: Array
    costs: Array
    values: Array
    picks: dict[Rule, int]
    pick: int
    pick_reason: str
    baseline_costs: Array
    hypervolume: float
    nominal_loss_percent: float
    robust_gain_percent: float
    plain_pick_costs: Array
    plain_inside: bool
    plain_survives: float
    pick_survives: float
    survival_error: float
    plain_interval: Interval | None = None
    pick_interval: Interval | None = None


def tolerance_aware_front(
    surfaces: Sequence[Quadratic],
    box: ToleranceBox,
    lower: Array,
    upper: Array,
    goals: Goals,
    *,
    baseline: Array,
    plain: Archive,
    plain_pick: int,
    population: int = 100,
    generations: int = 200,
    seed: int = 1,
    keep: int = 200,
    pick: Rule = "knee",
    doubt: Doubt | None = None,
) -> ToleranceAware:
    """NSGA-II on robust costs, and what it costs and gains compared with the plain front; the same seed, the same bits.

    surfaces : of the m responses, in coded units.
    box : the tolerances.
    lower, upper : bounds (k,) of the region in coded units; the boxes of all points lie within.
    goals : what is wanted of the responses.
    baseline : coded point (k,) to improve on. Picks dominate its nominal costs with their robust ones where any
        point does; else they dominate what manufacture leaves of the baseline.
    plain : points (coded) and costs of the plain front, and ``plain_pick`` the row of its pick.
    population, generations, seed, keep, pick, doubt : as for `doe.pareto.front`, of coded points.

    Raises ValueError when a tolerance leaves no room in the region; InfeasibleError when no point keeps all limits.
    """
    low, high = lower + box.half, upper - box.half
    check_search(low, high, population, generations, keep)
    judge = partial(box.judge, surfaces, goals)
    history = search(partial(judge, doubt=doubt), low, high, population, generations, seed).archives
    points, costs = history[-1]
    nominal_baseline = goals.costs(_nominal(surfaces, baseline[None]))[0]
    baseline_costs = judge(baseline[None]).costs[0]
    survives_nominal = bool(dominates(costs, nominal_baseline).any())
    rows, picks, among = thinned(costs, goals, nominal_baseline if survives_nominal else baseline_costs, keep)
    values = _nominal(surfaces, points[rows])
    inside = ((plain.points >= low - 1e-12) & (plain.points <= high + 1e-12)).all(axis=1)
    robust_plain = judge(plain.points[inside]).costs if inside.any() else costs[:0]
    spans, robust_spans = ((each.min(axis=0), each.max(axis=0)) for each in (plain.costs, costs))
    losing = hypervolume(goals.costs(values), *spans), hypervolume(plain.costs, *spans)
    gaining = hypervolume(costs[rows], *robust_spans), hypervolume(robust_plain, *robust_spans)
    candidates = np.vstack([plain.points[plain_pick], points[rows[picks[pick]]]])
    made = goals.costs(box.parts(surfaces, candidates, SURVIVAL_PARTS))
    survives = np.mean(dominates(made, nominal_baseline), axis=1).tolist()
    return ToleranceAware(
        box=box,
        points=points[rows],
        costs=costs[rows],
        values=values,
        picks=picks,
        pick=picks[pick],
        pick_reason=f"{NAMES[pick]} {among}{' even after manufacture' if survives_nominal else ''}",
        baseline_costs=baseline_costs,
        hypervolume=hypervolume(costs, *robust_spans),
        nominal_loss_percent=100.0 * (1.0 - losing[0] / losing[1]) if losing[1] > 0.0 else 0.0,
        robust_gain_percent=100.0 * (gaining[0] / gaining[1] - 1.0) if gaining[1] > 0.0 else np.inf,
        plain_pick_costs=judge(plain.points[[plain_pick]]).costs[0],
        plain_inside=bool(np.take(inside, plain_pick)),
        plain_survives=survives[0],
        pick_survives=survives[1],
        survival_error=max(error_of_share(each, SURVIVAL_PARTS) for each in survives),
    )


def _nominal(surfaces: Sequence[Quadratic], points: Array) -> Array:
    return np.column_stack([surface.predict(points) for surface in surfaces])
