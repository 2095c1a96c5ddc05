"""What keeps a study from its demands, all of it at once: missed limits, chains, tolerances; and what would have to change.

A missed limit is judged at the best point by simulation. It may be relaxed to what that point keeps with the demanded
probability, or factors may move beyond their bounds: the surfaces, shifted to the simulated point, are extrapolated there.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from doe.pareto import ParetoFront
from doe.study_file.study import PointResponse
from doe.workflow.confirmation import Confirmed, Limit, Verdict, every_limit
from doe.workflow.front import tolerances_out_of_reach
from doe.workflow.pick import place_of, sides_of
from doe.workflow.problem import Problem
from doe.workflow.surfaces import predict_all
from doe.workflow.tolerances import PickTolerances
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, finite
from rbdyn.base.words import quantity, shown, with_error

# Steps beyond a bound, up to half the width of the region again, at which the surfaces are asked.
STEPS = 20


class MissedLimit(Record):
    """A limit that the best point does not keep, by its simulated ``value`` (None: not reported) with the 95 % half-width ``error``.

    ``response``: the figure, at a ``point`` of the duty if there is one. ``excess``: how far the value is beyond the bound;
    negative where only the error is. ``relaxed``: the bound that this point keeps with the demanded probability.
    """

    response: str
    point: str | None
    sense: str
    bound: float
    value: float | None
    error: float | None
    verdict: Verdict
    excess: float | None
    relaxed: float | None
    probability: float

    @classmethod
    def of(cls, study: Problem, limit: Limit) -> "MissedLimit":
        """The record of a limit that is not kept."""
        asked = study.file.response[study.responses.index(limit.response)]
        name, point = (asked.figure, asked.point) if isinstance(asked, PointResponse) else (asked.name, None)
        return cls(
            response=name,
            point=point,
            sense=limit.sense,
            bound=limit.bound,
            value=finite(limit.value),
            error=limit.error,
            verdict=limit.verdict,
            excess=finite(-limit.room),
            relaxed=finite(limit.keepable),
            probability=study.file.confirmation.limit_probability,
        )

    @property
    def sentence(self) -> str:
        """By how much the limit is missed, and to what it would have to be relaxed."""
        words, unit = quantity(self.response)
        where = f" at {self.point}" if self.point else ""
        bound, value = f"{self.sense} {self.bound:g} {unit}".rstrip(), with_error(self.value, self.error)
        if self.excess is None or self.relaxed is None:
            return f"Limit {words} {bound}{where} cannot be judged: the simulation reports no value."
        miss = (
            f"is missed by {f'{with_error(self.excess, self.error)} {unit}'.rstrip()}"
            if self.excess > 0.0
            else "is kept by less than the error"
        )
        return (
            f"Limit {words} {bound}{where} {miss} (simulated {value}); {self.sense} {f'{self.relaxed:g} {unit}'.rstrip()} would be "
            f"kept with a probability of {self.probability:g}."
        )


class Beyond(Record):
    """Factors that, moved beyond their bounds, meet all missed limits by the extrapolated surfaces: values and bounds by name."""

    values: dict[str, float]
    bounds: dict[str, float]

    @property
    def words(self) -> str:
        """'guide clearance 0.14 mm (bound 0.17)' of each factor."""
        parts = []
        for name, value in self.values.items():
            words, unit = quantity(name)
            parts.append(f"{words} {f'{shown(value, 3)} {unit}'.rstrip()} (bound {shown(self.bounds[name], 3)})")
        return " with ".join(parts)


class Obstacles(Record):
    """All that keeps a study from its demands; empty for one that meets them.

    ``reachable``: whether a point of the region keeps all limits on the surfaces. ``at_bounds``: factors of the best point at a
    bound, and ``beyond``: changes of these each of which meets the missed limits by extrapolation; both empty where none is missed.
    ``chains``: why, by name of the chain. ``tolerances``: why none follow, or too fine ones; empty where nothing else is missed.
    ``sentences``: all of it in words, what is missed first.
    """

    reachable: bool
    limits: tuple[MissedLimit, ...]
    at_bounds: list[str]
    beyond: tuple[Beyond, ...]
    chains: dict[str, str]
    tolerances: str
    sentences: list[str] = derived(lambda self: [str(note) for note in self._notes()])

    @property
    def notes(self) -> Notes:
        """The same as notes."""
        return tuple(self._notes())

    def _notes(self) -> Iterator[Note]:
        broken = any(limit.verdict == "broken" for limit in self.limits)
        worst = "broken-limit" if broken or not self.reachable else "open-limit"
        if not self.reachable:
            least = "No point of the region keeps all limits: the chosen clearances are those that miss them least."
            yield Note(worst, least)
        for limit in self.limits:
            sure = limit.verdict == "broken" or not self.reachable
            yield Note("broken-limit" if sure else "open-limit", limit.sentence)
        if self.limits:
            yield Note(worst, self._remedy())
        yield from (Note("missed-chain", f"Chain {name}: {why}.") for name, why in self.chains.items())
        if self.tolerances:
            yield Note("tolerances", self.tolerances)

    def _remedy(self) -> str:
        if self.beyond:
            ways = "; or ".join(way.words for way in self.beyond)
            return f"The limits may be met beyond the region, extrapolated by the surfaces: {ways}. Widen the design there."
        names = " and ".join(quantity(name)[0] for name in self.at_bounds)
        bounds = "its bound" if len(self.at_bounds) == 1 else "their bounds"
        why = (
            f"Moving {names} beyond {bounds} by half the region's width does not meet the limits, by the extrapolated surfaces"
            if names
            else "The best point lies within the bounds of all factors, so that a wider region does not help by the surfaces"
        )
        return f"{why}: relax the limits, or change what is no factor."


def obstacles_of(
    study: Problem,
    front: ParetoFront,
    pick: Confirmed,
    chains: Mapping[str, str],
    widest: PickTolerances | None,
    searched: bool,
) -> Obstacles:
    """The obstacles at the simulated ``pick``, of the ``front`` unless it is of a ``searched`` one.

    ``chains``: those that miss their limits, and why; ``widest``: tolerances of the pick.
    """
    missed = [limit for limit in every_limit(study, pick) if limit.verdict != "kept"]
    reachable = searched or front.violations is None or not missed
    tolerances = ""
    if front.tolerance_violations is not None:
        tolerances = tolerances_out_of_reach(study, front.tolerance_violations)
    elif widest is not None and (missed or chains):
        tolerances = widest.warning if widest.any_width else widest.sentence
    return Obstacles(
        reachable,
        tuple(MissedLimit.of(study, limit) for limit in missed),
        list(place_of(study, pick.point).bounds) if missed else [],
        tuple(_beyond(study, pick)) if missed else (),
        dict(chains),
        tolerances,
    )


def without_broken(study: Problem, pick: Confirmed) -> Problem:
    """The study without the limits that the pick breaks: no tolerance would keep them."""
    broken = {(limit.response, limit.sense) for limit in every_limit(study, pick) if limit.verdict == "broken"}
    ends = {"lower": ">=", "upper": "<="}
    responses = [
        response.model_copy(update={end: None for end, sense in ends.items() if (response.name, sense) in broken})
        for response in study.file.response
    ]
    return study.with_file(response=responses)


def _beyond(study: Problem, pick: Confirmed) -> Iterator[Beyond]:
    """The least moves of each factor at a bound, else of all of them together, that meet all limits."""
    ends = study.ends
    sides = sides_of(pick.point[None], ends)[0]
    places = np.flatnonzero(sides).tolist()
    ways = [moved for place in places if (moved := _least_move(study, pick, sides, [place])) is not None]
    if not ways and len(places) > 1:
        ways = [moved for moved in [_least_move(study, pick, sides, places)] if moved is not None]
    for moved in ways:
        changed = np.flatnonzero(moved != pick.point).tolist()
        yield Beyond(
            {study.factors[place]: float(moved[place]) for place in changed},
            {study.factors[place]: float(ends[place, int(sides[place] > 0)]) for place in changed},
        )


def _least_move(study: Problem, pick: Confirmed, sides: Array, places: list[int]) -> Array | None:
    """The nearest point (k,) to the pick, along these factors outward, at which the surfaces meet the limits; None without one."""
    ends, outward = study.ends, np.zeros(pick.point.size)
    outward[places] = (0.5 * (ends[:, 1] - ends[:, 0]) * sides)[places]
    shares = np.linspace(0.0, 1.0, STEPS + 1)[1:]
    points = np.array([study.rounded(pick.point + share * outward) for share in shares])
    values = (
        pick.values
        + predict_all(study.surfaces, study.coded(points))
        - predict_all(study.surfaces, study.coded(pick.point[None]))
    )
    broken = np.zeros(len(points), dtype=bool)
    for limit in every_limit(study, pick):
        column = values[:, study.responses.index(limit.response)]
        beyond = column - limit.bound if limit.sense == "<=" else limit.bound - column
        broken |= beyond > -limit.margin
    for point in points[~broken]:
        try:
            study.confirmation_run(point)
        except InputError:
            # No scene has these values.
            return None
        return np.asarray(point)
    return None
