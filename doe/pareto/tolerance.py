"""The widest tolerances of a pick within which parts keep its gains, and the tolerances of a simulated front.

``Parts.widest`` widens the tolerances about a pick until the share of parts that keep all limits is at its target.

A simulated front has no surface for parts about its points. ``simulated_aware`` takes their shape from surfaces. A local
linear fit of the surfaces' errors at nearby runs corrects it (Cleveland, Robust locally weighted regression, 1979). The level is that of the fresh runs at the point. Parts may be outside the bounds of the search by the
tolerance, where the same shape applies.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np

from doe.pareto import manufacture
from doe.pareto.search import NAMES, Goals, Rule, dominates, non_dominated, pick_all
from rbdyn.base.arrays import Array, Mask, Rows
from rbdyn.base.records import Record

Costs = Callable[[Array], Array]
# Number (d,) of the parts (n, k) that keep all limits, on each draw of the surfaces or emulators.
PartCount = Callable[[Array], Array]

MARCH = 32  # steps up to the rim of the region in the search for the first loss
HALVINGS = 24
RIM = "the bound of the region"
MOST_JUDGED = 4096  # parts that are evaluated on every draw


class WidestTolerances(Record, eq=False):
    """Half widths (k,) of the widest tolerances, NaN for factors without one.

    ``probability``: share of the parts that keep every limit, with its Monte Carlo ``standard_error``. ``interval``: 95 %
    interval of the true share, with the uncertainty of the draws. ``limited_by``: the limit that parts break first beyond
    the tolerances, or the rim of the region. ``at_rim`` (k,): factors that reach the rim. ``sentence``: summary.
    """

    half_widths: Array
    probability: float
    standard_error: float
    interval: manufacture.Interval
    limited_by: str
    at_rim: Mask
    sentence: str

    def among(self, factors: Rows, count: int) -> Self:
        """The same tolerances for ``factors`` among ``count`` factors, the others without one."""
        half, rim = np.full(count, np.nan), np.zeros(count, dtype=bool)
        half[factors], rim[factors] = self.half_widths, self.at_rim
        return replace(self, half_widths=half, at_rim=rim)


class Parts(Record, eq=False, kw_only=True):
    """Parts about a nominal point ``centre`` (k,), which keep all limits with a stated ``probability``.

    objectives : maps points (samples, k) to costs (samples, c).
    limits, names : largest permitted costs (c,), and their names for the result.
    lower, upper : bounds (k,) of the region, which no half width exceeds, for no surface is valid beyond.
    distribution : of the parts within the tolerance, see `doe.pareto.manufacture.offsets`.
    samples, seed : of the random parts, the same for every width (common random numbers).
    promise : the condition on the parts in words, for the sentence.
    count_on_draws : number of parts that keep all limits on each draw of the surfaces or emulators, for the interval. By
        default the interval has only the error of the random parts.
    open_errors : sentence on the errors that the interval includes and excludes.
    """

    objectives: Costs
    centre: Array
    limits: Array
    lower: Array
    upper: Array
    names: Sequence[str]
    probability: float = 0.95
    distribution: manufacture.Distribution = "normal"
    samples: int = 4096
    seed: int = 1
    promise: str = "meet all limits"
    count_on_draws: PartCount | None = None
    open_errors: str = ""

    def widest(self, ratios: Array) -> WidestTolerances:
        """The widest tolerances within which a part keeps all limits, widened together in the ``ratios`` (k,) of their half widths.

        The search goes from the centre outwards up to the first loss, so all narrower tolerances keep the limits too. Where even
        the exact centre breaks a limit, all widths are zero.
        """
        exact = np.zeros(self.centre.size)
        if self.share(exact) < self.probability:
            worst = self.most_broken(exact)
            return self.nothing(
                worst,
                f"even the exact selected design keeps {worst} with a probability below the required {self.percent}",
            )
        return self._within(self.largest_scale(ratios), ratios)

    @cached_property
    def room(self) -> Array:
        """Distance (k,) of the centre from the nearer bound."""
        return np.minimum(self.centre - self.lower, self.upper - self.centre).clip(0.0)

    @cached_property
    def offsets(self) -> Array:
        """Offsets (samples, k) of the parts, in half widths."""
        return manufacture.random_offsets(self.samples, self.centre.size, self.distribution, self.seed)

    @property
    def percent(self) -> str:
        """The target share in words."""
        return f"{100 * self.probability:g} %"

    def keep(self, half: Array) -> Mask:
        """Whether each part keeps each limit, (samples, c)."""
        return np.asarray(self.objectives(self.centre + half * self.offsets) <= self.limits)

    def share(self, half: Array) -> float:
        """Share of the parts that keep all limits."""
        return float(self.keep(half).all(axis=1).mean())

    def interval(self, half: Array, share: float) -> manufacture.Interval:
        """Interval of the share of parts that keep all limits, which is ``share`` on the mean surfaces."""
        if self.count_on_draws is None:
            return manufacture.interval_of_share(np.array([self.keep(half).all(axis=1).sum()]), len(self.offsets))
        some = self.offsets[:MOST_JUDGED]
        interval = manufacture.interval_of_share(self.count_on_draws(self.centre + half * some), len(some))
        return interval.containing(share)

    def most_broken(self, half: Array) -> str:
        """The limit that most parts break."""
        return self.names[int((~self.keep(half)).sum(axis=0).argmax())]

    def half(self, ratios: Array, scale: float) -> Array:
        """Half widths at a scale, none beyond the region."""
        return np.minimum(ratios * scale, self.room)

    def largest_scale(self, ratios: Array) -> float:
        """Largest scale up to which the share of parts is at least the target."""

        def lost(scale: float) -> bool:
            return self.share(self.half(ratios, scale)) < self.probability

        steps = np.linspace(0.0, float((self.room / ratios).max()), MARCH + 1).tolist()
        first = next((place for place in range(1, MARCH + 1) if lost(steps[place])), None)
        if first is None:
            return steps[-1]
        good, bad = steps[first - 1], steps[first]
        for _ in range(HALVINGS):
            middle = (good + bad) / 2.0
            good, bad = (good, middle) if lost(middle) else (middle, bad)
        return good

    def nothing(self, limit: str, cause: str) -> WidestTolerances:
        """Result without any tolerance, because of a limit."""
        zero, share = np.zeros_like(self.centre), self.share(np.zeros_like(self.centre))
        sentence = f"No tolerance is possible: {cause}; require less of the gain or a lower probability."
        error = manufacture.error_of_share(share, len(self.offsets))
        return WidestTolerances(zero, share, error, self.interval(zero, share), limit, zero.astype(bool), sentence)

    def _within(self, scale: float, ratios: Array) -> WidestTolerances:
        """The tolerances at a scale, and what limits them."""
        top = float((self.room / ratios).max())
        if scale <= 1e-6 * top:
            first = self.most_broken(self.half(ratios, 1e-3 * top))
            return self.nothing(first, f"as soon as parts differ, less than {self.percent} of them keep {first}")
        half = self.half(ratios, scale)
        at_rim = half >= self.room * (1.0 - 1e-9)
        # The limit that most parts break just beyond is the limiting one.
        limit = RIM if at_rim.all() else self.most_broken(self.half(ratios, scale * 1.02))
        share = self.share(half)
        error, interval = manufacture.error_of_share(share, len(self.offsets)), self.interval(half, share)
        within = f"Within these tolerances {manufacture.percent(share)} % ({interval.words}) of the parts {self.promise}; {self.percent} are required."
        rim = "Where a tolerance ends at the bound of the region, no run shows whether it may be wider."
        sentences = [within, f"These tolerances are limited by {limit}.", self.open_errors, rim if at_rim.any() else ""]
        return WidestTolerances(half, share, error, interval, limit, at_rim, " ".join(filter(None, sentences)))


NEIGHBOURS = 10  # runs a coefficient of the local linear fit, of which tricube weights count about half
HARDLY_VARIED = 0.1  # share of the neighbours' largest spread below which a direction has no slope


class Neighbourhood(Record, eq=False):
    """Surfaces and their local correction by ``slopes`` (n, k, m) about coded points (n, k)."""

    surfaces: Sequence[manufacture.Quadratic]
    points: Array
    values: Array
    slopes: Array

    @classmethod
    def of(
        cls, surfaces: Sequence[manufacture.Quadratic], points: Array, values: Array, runs: Array, responses: Array
    ) -> Self:
        """Neighbourhood of coded points (n, k) with responses (n, m), by the search's ``runs`` (a, k) and ``responses`` (a, m)."""
        good = np.isfinite(responses).all(axis=1)
        runs, responses = runs[good], responses[good]
        missed = responses - np.column_stack([surface.predict(runs) for surface in surfaces])
        slopes = np.stack([_slope(runs - point, missed) for point in points])
        return cls(surfaces, points, values, slopes)

    def parts(self, offsets: Array) -> Array:
        """Responses (n, s, m) of parts at coded ``offsets`` (s, k) from every point."""
        points = self.points
        shape = [surface.around(points, offsets) - surface.predict(points)[:, None] for surface in self.surfaces]
        return self.values[:, None, :] + np.stack(shape, axis=-1) + np.einsum("sk,nkm->nsm", offsets, self.slopes)


class SimulatedAware(Record, eq=False):
    """Robust costs (n, q) of the points of a simulated front, and their violations of each limit (n, c).

    ``robust_baseline`` (q,): robust costs of the baseline. ``survives`` (n,): share of the parts at a point that dominate the
    nominal baseline. Both are None without a simulated baseline.
    """

    costs: Array
    violations: Array
    robust_baseline: Array | None = None
    survives: Array | None = None


def simulated_aware(
    box: manufacture.ToleranceBox,
    here: Neighbourhood,
    goals: Goals,
    baseline: Neighbourhood | None,
    below: Array,
    above: Array,
) -> SimulatedAware:
    """Robust costs of points; limits must hold for responses lower by ``below`` and higher by ``above`` (n, m)."""
    offsets = _offsets(box)
    judged = box.judge_parts(here.parts(offsets), goals, below, above)
    if baseline is None:
        return SimulatedAware(judged.costs, judged.violations)
    nominal = goals.costs(baseline.values)[0]
    survival_offsets = box.half * manufacture.even_offsets(manufacture.SURVIVAL_PARTS, box.half.size, box.distribution)
    return SimulatedAware(
        costs=judged.costs,
        violations=judged.violations,
        robust_baseline=box.judge_parts(baseline.parts(offsets), goals).costs[0],
        survives=np.mean(dominates(goals.costs(here.parts(survival_offsets)), nominal), axis=1),
    )


def pick_among(
    costs: Array, violations: Array, goals: Goals, baselines: Sequence[Array], rule: Rule
) -> tuple[int, str]:
    """The row of a rule's pick among points with costs (n, q), and the reason in words.

    Candidates are the points that keep every limit (violations (n, c)), or else the one that breaks them least. Of these,
    the non-dominated ones count, if possible those that dominate the first dominated one of ``baselines`` (q,).
    """
    broken = violations.sum(axis=1)
    rows = np.flatnonzero(broken <= 0.0)
    limits = " and meet their limits" if violations.shape[1] else ""
    if not rows.size:
        rows, limits = np.array([int(broken.argmin())]), ", none of which meets all limits"
    rows = rows[non_dominated(costs[rows])]
    against = next((baseline for baseline in baselines if dominates(costs[rows], baseline).any()), None)
    if against is None and baselines:
        against = baselines[-1]
    picks, among = pick_all(costs[rows], goals, against)
    return int(rows[picks[rule]]), f"{NAMES[rule]} {among}{limits}"


def _offsets(box: manufacture.ToleranceBox) -> Array:
    """Offsets (s, k) of the evaluated parts; for the worst case with the corners of the box."""
    even = box.half * manufacture.even_offsets(box.samples, box.half.size, box.distribution)
    if box.kind == "quantile":
        return even
    return np.vstack([even, box.half * np.array(list(product((-1.0, 1.0), repeat=box.half.size)))])


def _slope(apart: Array, missed: Array) -> Array:
    """Slope (k, m) at offset zero of the errors ``missed`` (a, m), with weights that fall with the distance of ``apart`` (a, k)."""
    count = min(NEIGHBOURS * (apart.shape[1] + 1), len(apart))
    far = np.linalg.norm(apart, axis=1)
    nearest = np.argsort(far, kind="stable")[:count]
    reach = far[nearest[-1]] * (1.0 + 1e-9) + 1e-300
    weight = np.sqrt((1.0 - (far[nearest] / reach) ** 3) ** 3)[:, None]
    mean = (weight**2 / (weight**2).sum()).T
    across, up = (weight * (part - mean @ part) for part in (apart[nearest], missed[nearest]))
    return np.linalg.lstsq(across, up, rcond=HARDLY_VARIED)[0]
