"""Where a pick or a front lies at the edge of the region, and what is to be had beyond it."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy import special

from doe import clearance
from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.response_surface import Surface
from doe.response_surface.model_error import REACH
from doe.running.store import Failure
from doe.study.confirmation import Choice, Confirmed, confirmed_from, error_of_difference
from doe.study.drawn import jacobian
from doe.study.goals import beyond_runs, goals_of, region_of
from doe.study_file import Study
from rbdyn.base.words import improvement, quantity, shown
from rbdyn.faults import InputError
from rbdyn.records.record import Record, derived, finite, keyed, outside_json

NEAR = 0.04  # of the range of a factor: as near to a bound a point lies at it
AHEAD = 0.5  # coded units beyond the pick at which the simulator is asked: half a level of the design
STEP = 1e-3  # coded units over which surfaces are differentiated
MICROMETRE_MM = 1e-3
BEYOND = "farther out than any run: the surfaces extrapolate there"


class Place(NamedTuple):
    """Where a point lies: by factor at a bound its side and that bound, and whether it is farther out than any run."""

    bounds: Mapping[str, tuple[str, float]]
    beyond: bool

    @property
    def at_bounds(self) -> dict[str, str]:
        """Side by factor, for JSON."""
        return {factor: side for factor, (side, _) in self.bounds.items()}

    def sentence(self, point: str) -> str:
        """Where the ``point`` of that name lies, in words; empty inside the region that the runs reach."""
        ends = [f"the {side} bound of {name}, {shown(bound)}" for name, (side, bound) in self.bounds.items()]
        where = [f"at {' and '.join(ends)}"] if ends else []
        where += [BEYOND] if self.beyond else []
        return f"{point} lies {', and '.join(where)}." if where else ""


class Outward(Record):
    """A factor whose pick lies at a bound of the region, and how each response with a goal changes beyond it.

    ``gains`` by response: [improvement, its 95 % half-width] in units of the response over ``unit`` (a micrometre of a
    factor in millimetres, else one unit of the factor); the half-width is NaN where it is not known. ``source`` is
    "surfaces" or "simulation". ``goals``: what is wanted, by response; small unless told.
    """

    factor: str = outside_json()
    side: str
    bound: float
    unit: str = keyed("per")
    source: str
    gains: Mapping[str, tuple[float, float]] = outside_json()
    goals: Mapping[str, str] = outside_json(default_factory=dict)
    gains_beyond: dict[str, dict[str, float | None]] = derived(
        lambda self: {name: {"value": gain, "error": finite(error)} for name, (gain, error) in self.gains.items()},
        "gains",
    )

    @property
    def sentence(self) -> str:
        """In words."""
        listed = ", ".join(
            f"{name} {improvement(gain, error, self.goals.get(name, 'min'), quantity(name)[1])}"
            for name, (gain, error) in self.gains.items()
        )
        at = f"{self.bound:.4g} {quantity(self.factor)[1]}".rstrip()
        return (
            f"{self.factor} is at its {self.side} bound, {at}. Extrapolated change per {self.unit} beyond it by "
            f"{self.source}: {listed}"
        )


class Edge(Record):
    """Factors of the pick at a bound, and the shares of the fronts within `NEAR` of one (None: no such front).

    ``beyond_runs``: whether the pick is farther out than any run of the design. ``sentence`` is all of it in words.
    """

    outward: tuple[Outward, ...] = outside_json()
    beyond_runs: bool
    factors: dict[str, Outward] = derived(lambda self: {each.factor: each for each in self.outward})
    front_share: float
    searched_share: float | None = keyed("direct_front_share")
    sentence: str = derived(lambda self: self._sentence())

    def _sentence(self) -> str:
        shares = f"{100.0 * self.front_share:.0f} % of the front on the surfaces"
        if self.searched_share is not None:
            shares += f" and {100.0 * self.searched_share:.0f} % of the simulator's own front"
        shares += f" lies within {100.0 * NEAR:g} % of a bound of the region"
        if not self.outward:
            where = f"between the bounds of the region, but {BEYOND}" if self.beyond_runs else "inside the region"
            return f"The pick lies {where}; {shares}."
        where = ". ".join(each.sentence for each in self.outward)
        where += f". It lies {BEYOND}" if self.beyond_runs else ""
        return f"The pick is at the edge of the design region: {where}. {shares}; a wider design may find more."


def share_at_edge(study: Study, points: Array) -> float:
    """Share of points (n, k) in factor units within `NEAR` of a bound of the region."""
    return float(_sides(points, ends_of(study)).any(axis=1).mean())


def ends_of(study: Study) -> Array:
    """Bounds (k, 2) of the region, in factor units."""
    reach = region_of(study) * study.step
    return np.column_stack([study.centre - reach, study.centre + reach])


def place_of(study: Study, point: Array) -> Place:
    """Where a point (k,) in factor units lies in the region of the design."""
    ends = ends_of(study)
    sides = zip(study.factors, _sides(point[None], ends)[0].tolist(), ends.tolist(), strict=True)
    bounds = {name: ("upper", high) if side > 0 else ("lower", low) for name, side, (low, high) in sides if side}
    return Place(bounds, beyond_runs(study, study.coded(point)))


def edge_of(
    study: Study,
    surfaces: Sequence[Surface],
    pick: Confirmed,
    front: Array,
    searched: Array | None,
    simulations: Simulations | None,
    ends: Array | None = None,
) -> Edge:
    """Where the pick and the fronts' points (n, k) lie; beyond the bounds ``simulations`` tell, else the surfaces.

    ``ends`` (k, 2), in factor units, of the region that the pick was searched in, where that has grown.
    """
    ends = ends_of(study) if ends is None else ends
    sides = _sides(pick.point[None], ends)[0]
    names = [(index, side) for index, side in enumerate(sides.tolist()) if side]
    gains_beyond = {} if simulations is None else _simulated(study, pick, names, simulations)
    outward = []
    for index, side in names:
        gains, source = gains_beyond.get(index), "simulation"
        if gains is None:
            gains, source = _on_surfaces(study, surfaces, pick.point, index, side), "the surfaces"
        unit, scale = ("µm", MICROMETRE_MM) if study.factors[index].endswith("_mm") else ("unit", 1.0)
        bound = float(ends[index, int(side > 0)])
        per_unit = {name: (gain * scale, error * scale) for name, (gain, error) in gains.items()}
        goals = {response.name: response.goal for response in study.file.response}
        which = "upper" if side > 0 else "lower"
        outward.append(Outward(study.factors[index], which, bound, unit, source, per_unit, goals))
    far = None if searched is None else float(_sides(searched, ends).any(axis=1).mean())
    return Edge(tuple(outward), beyond_runs(study, study.coded(pick.point)), share_at_edge(study, front), far)


def _sides(points: Array, ends: Array) -> Whole:
    """-1 at a lower bound, 1 at an upper one, else 0, for points (n, k) in a region with ``ends`` (k, 2)."""
    half = 0.5 * (ends[:, 1] - ends[:, 0])
    off = (points - ends.mean(axis=1)) / half
    return np.where(np.abs(off) >= 1.0 - 2.0 * NEAR, np.sign(off), 0.0).astype(np.int64)


def _on_surfaces(
    study: Study, surfaces: Sequence[Surface], point: Array, index: int, side: int
) -> dict[str, tuple[float, float]]:
    """Gains a unit of the factor outward, with the error of the slope: of the coefficients and of the model's own error."""
    goals = goals_of(study)
    coded = study.coded(point)
    ahead = coded + side * STEP * np.eye(coded.size)[index]
    gains = {}
    for column, response in enumerate(goals.objectives):
        surface = surfaces[response]
        ends = [float(surface.predict(at)) for at in (coded, ahead)]
        values = np.zeros(len(study.responses))
        values[response] = ends[0]
        slope = float(goals.slopes(values)[column])
        change = jacobian(surface, ahead) - jacobian(surface, coded)
        variance = float(change @ surface.covariance @ change) / STEP**2
        if surface.model_error is not None:
            # The slope of a field of correlation exp(-(d/REACH)^2) has 2/REACH^2 times its variance.
            by_field = float(jacobian(surface, coded)[surface.terms.index("1")])
            variance += by_field**2 * 2.0 / REACH**2 * surface.model_error.variance
        student = float(special.stdtrit(surface.interval_dof, 0.975))
        scale = 1.0 / study.step[index]
        gains[surface.name] = (-slope * (ends[1] - ends[0]) / STEP * scale, student * float(np.sqrt(variance)) * scale)
    return gains


def _simulated(
    study: Study, pick: Confirmed, names: Sequence[tuple[int, int]], simulations: Simulations
) -> dict[int, dict[str, tuple[float, float]]]:
    """Gains a unit of each factor from runs beyond its bound, like those of the confirmation; none where a run fails."""
    scenes, reachable = [], []
    for index, side in names:
        point = pick.point.copy()
        point[index] += side * AHEAD * study.step[index]
        try:
            scenes.append(clearance.confirmation_scene(study, point))
        except InputError:
            # A factor cannot go there: nothing lies beyond the bound.
            continue
        reachable.append((index, point))
    labels = [f"beyond the bound of {study.factors[index]}" for index, _ in reachable]
    results = simulations.run(scenes, labels, simulations.progress("beyond the region")) if reachable else []
    goals = goals_of(study)
    wanted = [study.responses[index] for index in goals.objectives]
    gains_beyond = {}
    for (index, point), result in zip(reachable, results, strict=True):
        if isinstance(result, Failure):
            continue
        there = confirmed_from(study, Choice(point, ""), result)
        gain = (goals.costs(pick.values) - goals.costs(there.values)) / (AHEAD * study.step[index])
        joint = error_of_difference(pick, there)[0][goals.objectives]
        figures = zip(gain.tolist(), (joint / (AHEAD * study.step[index])).tolist(), strict=True)
        gains_beyond[index] = dict(zip(wanted, figures, strict=True))
    return gains_beyond
