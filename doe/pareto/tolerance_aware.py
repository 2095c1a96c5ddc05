"""Tolerance-aware fronts: costs of what manufacture leaves of a point, not of the point itself.

A manufactured part lies somewhere in the tolerance box about its nominal point. The robust cost of a point is the
worst over that box, or the quantile of the parts. Nominal points keep their whole box inside the region, so no
surface is extrapolated.

Source: Deb and Gupta, Introducing robustness in multi-objective optimization (2006), robust solutions of type I
with the worst case or a quantile in place of the mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from doe.arrays import Array
from doe.pareto.archive import Archive, dominates, hypervolume
from doe.pareto.goals import Goals
from doe.pareto.manufacture import Distribution, error_of_share, even_offsets
from doe.pareto.nsga2 import Doubt, Judged, check_search, search
from doe.pareto.picks import NAMES, Rule, thinned
from doe.pareto.quadratic import Quadratic
from doe.pareto.share import Interval

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
    """NSGA-II on robust costs, and what it costs and gains beside the plain front; the same seed, the same bits.

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
