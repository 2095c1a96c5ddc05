"""What tolerances leave of the points of a simulated front, and its pick.

A simulator's front has no surface to show what parts about a point do. Here the shape about a point is that of given
surfaces, corrected by what the search's own runs near it say: a local straight line through what the surfaces missed
there (Cleveland, Robust locally weighted regression, 1979). The level is that of the fresh runs at the point itself. Parts
may lie beyond the bounds of the search by the tolerance, where the same shape goes on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np

from doe.pareto.goals import NAMES, Goals, Rule, pick_all
from doe.pareto.manufacture import SURVIVAL_PARTS, Quadratic, ToleranceBox, even_offsets
from doe.pareto.search import dominates, non_dominated
from rbdyn.base.arrays import Array

NEIGHBOURS = 10  # runs a coefficient of a local line: with tricube weights the half of them counts
HARDLY_VARIED = 0.1  # of the largest spread of the neighbours: along directions with less they show no slope


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """Surfaces with slopes (n, k, m) by which they are corrected about coded points (n, k)."""

    surfaces: Sequence[Quadratic]
    points: Array
    values: Array
    slopes: Array

    @classmethod
    def of(cls, surfaces: Sequence[Quadratic], points: Array, values: Array, runs: Array, responses: Array) -> Self:
        """About coded points (n, k) of responses (n, m), from the search's ``runs`` (a, k) and ``responses`` (a, m)."""
        good = np.isfinite(responses).all(axis=1)
        runs, responses = runs[good], responses[good]
        missed = responses - np.column_stack([surface.predict(runs) for surface in surfaces])
        slopes = np.stack([_slope(runs - point, missed) for point in points])
        return cls(surfaces, points, values, slopes)

    def parts(self, offsets: Array) -> Array:
        """Responses (n, s, m) of parts at coded ``offsets`` (s, k) from every point."""
        at = self.points
        shape = [surface.around(at, offsets) - surface.predict(at)[:, None] for surface in self.surfaces]
        return self.values[:, None, :] + np.stack(shape, axis=-1) + np.einsum("sk,nkm->nsm", offsets, self.slopes)


@dataclass(frozen=True, eq=False)
class SimulatedAware:
    """Robust costs (n, q) of the points of a simulated front, and how much of their parts break each limit (n, c).

    ``robust_baseline`` (q,) is what tolerances leave of the nominal ones of the baseline;
    ``survives`` (n,) is the share of the parts made at a point that still dominate the nominal baseline. Both None without a
    baseline that ran.
    """

    box: ToleranceBox
    costs: Array
    violations: Array
    robust_baseline: Array | None
    survives: Array | None


def simulated_aware(
    box: ToleranceBox, here: Neighbourhood, goals: Goals, baseline: Neighbourhood | None, below: Array, above: Array
) -> SimulatedAware:
    """What tolerances leave of points, whose responses may be lower by ``below`` and higher by ``above`` (n, m) when
    limits are judged."""
    offsets = _offsets(box)
    judged = box.judge_parts(here.parts(offsets), goals, below, above)
    if baseline is None:
        return SimulatedAware(box, judged.costs, judged.violations, None, None)
    nominal = goals.costs(baseline.values)[0]
    made = box.half * even_offsets(SURVIVAL_PARTS, box.half.size, box.distribution)
    return SimulatedAware(
        box=box,
        costs=judged.costs,
        violations=judged.violations,
        robust_baseline=box.judge_parts(baseline.parts(offsets), goals).costs[0],
        survives=np.mean(dominates(goals.costs(here.parts(made)), nominal), axis=1),
    )


def pick_among(
    costs: Array, violations: Array, goals: Goals, baselines: Sequence[Array], rule: Rule
) -> tuple[int, str]:
    """The row that a rule picks of points with costs (n, q), and why.

    Only points that keep every limit (violations (n, c)) stand for election, or those that break them least; of these the
    non-dominated, and of these those that dominate the first of ``baselines`` (q,) that any dominates.
    """
    broken = violations.sum(axis=1)
    rows = np.flatnonzero(broken <= 0.0)
    limits = " and keep their limits" if violations.shape[1] else ""
    if not rows.size:
        rows, limits = np.array([int(broken.argmin())]), ", none of which keeps all limits"
    rows = rows[non_dominated(costs[rows])]
    against = next((each for each in baselines if dominates(costs[rows], each).any()), None)
    if against is None and baselines:
        against = baselines[-1]
    picks, among = pick_all(costs[rows], goals, against)
    return int(rows[picks[rule]]), f"{NAMES[rule]} {among}{limits}"


def _offsets(box: ToleranceBox) -> Array:
    """Offsets (s, k) of the parts that are judged; for the worst case the corners of the box too."""
    even = box.half * even_offsets(box.samples, box.half.size, box.distribution)
    if box.kind == "quantile":
        return even
    return np.vstack([even, box.half * np.array(list(product((-1.0, 1.0), repeat=box.half.size)))])


def _slope(apart: Array, missed: Array) -> Array:
    """Slope (k, m) of what was missed (a, m) about offset zero, by weights that fall with the distance of ``apart``
    (a, k)."""
    count = min(NEIGHBOURS * (apart.shape[1] + 1), len(apart))
    far = np.linalg.norm(apart, axis=1)
    nearest = np.argsort(far, kind="stable")[:count]
    reach = far[nearest[-1]] * (1.0 + 1e-9) + 1e-300
    weight = np.sqrt((1.0 - (far[nearest] / reach) ** 3) ** 3)[:, None]
    mean = (weight**2 / (weight**2).sum()).T
    across, up = (weight * (part - mean @ part) for part in (apart[nearest], missed[nearest]))
    return np.linalg.lstsq(across, up, rcond=HARDLY_VARIED)[0]
