"""What keeps a study from its demands, all of it at once: missed limits, chains, tolerances; and what would have to change.

A missed limit is judged at the best point by simulation. It may be relaxed to what that point keeps with the demanded
probability, or factors may move beyond their bounds: the surfaces, shifted to the simulated point, are extrapolated there.

Before the design ends, the original design, simulated first, and then the corners of the region say what is known of the limits.
The runs are those of the confirmation and of the design, which find them in the store. That the original misses a limit says
nothing of the region; that all corners miss it too, also extrapolated to the bounds of the search, makes it likely that no
point keeps it.

A simulated point may be better than the pick in every response: the pick is chosen before it is simulated, by predicted responses,
at the ends of its tolerances where the study asks for that.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from doe import clearance
from doe.duty import Simulated
from doe.pareto import Goals, ParetoFront
from doe.running.runner import Progress
from doe.running.store import Failure
from doe.study_file.study import PointResponse
from doe.workflow import confirmation
from doe.workflow.adaptive import Adaptive
from doe.workflow.confirmation import ORDER, Confirmed, Limit, Verdict, class_limits, every_limit, limits_of, verdict_of
from doe.workflow.front import tolerance_box, tolerances_out_of_reach
from doe.workflow.pick import SearchedPick, place_of, sides_of
from doe.workflow.problem import Problem
from doe.workflow.runs import standard_errors
from doe.workflow.surfaces import predict_all, quadratics
from doe.workflow.tolerances import PickTolerances
from rbdyn.base.arrays import Array, Mask
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, finite
from rbdyn.base.words import Notice, all_of, counted, improvement, quantity, shown, with_error

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
        return cls.from_attributes(
            limit,
            response=name,
            point=point,
            value=finite(limit.value),
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
            f"is violated by {f'{with_error(self.excess, self.error)} {unit}'.rstrip()}"
            if self.excess > 0.0
            else "is met by less than the error"
        )
        return (
            f"Limit {words} {bound}{where} {miss} (simulated {value}); {self.sense} {f'{self.relaxed:g} {unit}'.rstrip()} would be "
            f"met with a probability of {self.probability:g}."
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
    ``cage``: sentence on the limit of its class by the verdict, empty where it is kept. ``sentences``: all of it in words, what is
    missed first.
    """

    reachable: bool
    limits: tuple[MissedLimit, ...]
    at_bounds: list[str]
    beyond: tuple[Beyond, ...]
    chains: dict[str, str]
    tolerances: str
    cage: dict[Verdict, str]
    sentences: list[str] = derived(lambda self: [str(note) for note in self._notes()])

    @property
    def notes(self) -> Notes:
        """The same as notes."""
        return tuple(self._notes())

    def _notes(self) -> Iterator[Note]:
        broken = any(limit.verdict == "broken" for limit in self.limits)
        worst = "broken-limit" if broken or not self.reachable else "open-limit"
        if not self.reachable:
            least = "No point of the region meets all limits: the selected clearances violate them least."
            yield Note(worst, least)
        for limit in self.limits:
            sure = limit.verdict == "broken" or not self.reachable
            yield Note("broken-limit" if sure else "open-limit", limit.sentence)
        if self.limits:
            yield Note(worst, self._remedy())
        for verdict, sentence in self.cage.items():
            yield Note("broken-limit" if verdict == "broken" else "open-limit", sentence)
        yield from (Note("missed-chain", f"Chain {name}: {why}.") for name, why in self.chains.items())
        if self.tolerances:
            yield Note("tolerances", self.tolerances)

    def _remedy(self) -> str:
        if self.beyond:
            ways = "; or ".join(way.words for way in self.beyond)
            return f"The limits may be met beyond the region, extrapolated by the surfaces: {ways}. Widen the design there."
        names = all_of(quantity(name)[0] for name in self.at_bounds)
        bounds = "its bound" if len(self.at_bounds) == 1 else "their bounds"
        why = (
            f"Moving {names} beyond {bounds} by half the region's width does not meet the limits, by the extrapolated surfaces"
            if names
            else "The best point lies within the bounds of all factors, so that a wider region does not help by the surfaces"
        )
        return f"{why}: relax the limits, or change a value that is not a factor."


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
    if front.tolerance_violations is not None and not (
        widest and widest.allows(tolerance_box(study), study.known_tolerances)
    ):
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
        {limit.verdict: _cage_sentence(study, pick) for limit in class_limits(study, pick) if limit.verdict != "kept"},
    )


def _cage_sentence(study: Problem, pick: Confirmed) -> str:
    """The class of the cage where the limit of its class is not kept, and what to do."""
    classes = study.file.limits.classes
    open_points = {name: found for name, found in pick.cages.items() if found.is_one_of(classes) is not True}
    where = {name: f" at {name}" if study.duty else "" for name in open_points}
    words = "; ".join(f"{found.words.removeprefix('Cage: ')}{where[name]}" for name, found in open_points.items())
    return (
        f"Limit cage.verdict = {study.file.limits.cage.verdict}: the class of the selected design's cage is {words}. No surface predicts a class: change "
        "the bearing, its load or its speed, or state other classes."
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
    predicted, at_pick = (predict_all(study.surfaces, study.coded(place)) for place in (points, pick.point[None]))
    values = pick.values + predicted - at_pick
    broken = np.zeros(len(points), dtype=bool)
    for limit in every_limit(study, pick):
        column = values[:, study.responses.index(limit.response)]
        beyond = column - limit.bound if limit.sense == "<=" else limit.bound - column
        broken |= beyond > -limit.margin
    first = next(iter(points[~broken]), None)
    return None if first is None or confirmation.run_where_possible(study, first) is None else np.asarray(first)


def original_sentences(study: Problem, baseline: Confirmed) -> list[str]:
    """Figures of the original at each point of the duty, and the limits that it misses."""
    responses = zip(study.responses, baseline.values.tolist(), baseline.error.tolist(), strict=True)
    figures: Mapping[str, Mapping[str, tuple[float, float | None]]] = {
        f" at {point}": {name: (figure.value, figure.stated_error) for name, figure in at_point.items()}
        for point, at_point in baseline.at_points.items()
    } or {"": {name: (value, error) for name, value, error in responses}}
    sentences = [
        f"baseline design{point}: {', '.join(_figure(name, *figure) for name, figure in row.items())}"
        for point, row in figures.items()
    ]
    missed = [limit for limit in every_limit(study, baseline) if limit.verdict != "kept"]
    words = ", ".join(f"{limit.bound_words} by {limit.excess_words}" for limit in missed if limit.room < 0.0)
    open_words = ", ".join(limit.bound_words for limit in missed if limit.room >= 0.0)
    return [
        *sentences,
        *([f"the baseline violates {words}: the study looks for points that do not"] if words else []),
        *([f"the baseline meets {open_words} by less than its error"] if open_words else []),
    ]


def _figure(name: str, value: float, error: float | None) -> str:
    words, unit = quantity(name)
    return f"{words} {with_error(value, error)} {unit}".rstrip()


def first_look(study: Problem, folder: Path, original: Confirmed, progress: Progress, notice: Notice) -> Progress:
    """Show the original at once. Returns the same progress of the design runs, which shows what its corners say of the limits."""
    if notice is None:
        return progress
    for sentence in original_sentences(study, original):
        notice(sentence)
    missed = [limit for limit in every_limit(study, original) if limit.verdict == "broken"]
    if not missed:
        return progress
    ordered = study.plan
    rows = [row for row, kind in enumerate(ordered.design.kind) if kind == "cube"]
    runs, labels = [ordered.scenes[row] for row in rows], [ordered.labels[row] for row in rows]
    waiting = bool(rows)

    def watch(done: int, total: int) -> None:
        nonlocal waiting
        progress(done, total)
        if waiting and len(rows) <= done < total and (results := clearance.stored(folder, runs, labels)) is not None:
            waiting = False
            for sentence in unlikely(study, missed, ordered.design.coded[rows], results):
                notice(sentence)

    return watch


def unlikely(
    study: Problem, missed: Sequence[Limit], coded: Array, results: Sequence[Simulated | Failure]
) -> list[str]:
    """Sentences on the limits that the original and all corners miss, and a plane through these too.

    ``results`` (n) at ``coded`` corners (n, k); failed ones are left out. The plane is followed to the bounds of the search; it
    counts where it is beyond the limit by twice the standard error of a run.
    """
    sound = [(place, result) for place, result in zip(coded, results, strict=True) if not isinstance(result, Failure)]
    values, halves, number = clearance.figures(study.responses, [result for _, result in sound])
    errors = np.nan_to_num(standard_errors(halves, number))
    terms = np.array([[1.0, *place] for place, _ in sound])
    if len(sound) <= coded.shape[1] or np.linalg.matrix_rank(terms) < terms.shape[1]:
        return []
    sentences = []
    for limit in missed:
        column, sign = study.responses.index(limit.response), 1.0 if limit.sense == "<=" else -1.0
        excess = sign * (values[:, column] - limit.bound)
        plane = np.linalg.lstsq(terms, excess, rcond=None)[0]
        least = float(plane[0] - np.abs(plane[1:]) @ study.reach)
        if min(excess.min(), least) > 2.0 * errors[:, column].max():
            nearest, end = (shown(limit.bound + sign * value, 3) for value in (float(excess.min()), least))
            sentences.append(
                f"likely no point meets {limit.bound_words}: the nearest of {counted(len(sound), 'corner')} has {nearest}, and a plane "
                f"through them {end} at the bounds. To change the limit, stop with Ctrl-C (finished runs are kept)"
            )
    return sentences


class Prediction(NamedTuple):
    """Costs (q,) that count in the choice of the pick, and whether the point keeps all limits there."""

    costs: Array
    keeps: bool


class Forecast(Record, eq=False):
    """Predictions by which the pick of a study was chosen, and the ``source`` of these in words.

    ``searched`` and ``searched_pick`` are None where the pick is one of the front on the surfaces.
    """

    study: Problem
    front: ParetoFront
    searched: Adaptive | None
    searched_pick: SearchedPick | None

    @property
    def with_tolerances(self) -> bool:
        """Whether the ends of the tolerances count in the choice."""
        if self.searched_pick is not None:
            return self.searched_pick.aware is not None
        return self.front.tolerance_aware is not None

    @property
    def source(self) -> str:
        """What predicts the responses."""
        return "the surfaces predict" if self.searched is None else f"the runs of the {self.searched.name} front have"

    def at(self, point: Array) -> Prediction | None:
        """The prediction at a point (k,) in factor units; None for a point that was no candidate."""
        goals = self.study.goals
        if self.searched is None or self.searched_pick is None:
            return self._on_surfaces(goals, self.study.coded(point)[None])
        front, aware = self.searched.front, self.searched_pick.aware
        same = [np.array_equal(self.study.rounded_within(row), point) for row in front.points]
        if not any(same):
            return None
        costs, violations = (front.costs, goals.violations(front.values, front.values))
        if aware is not None:
            costs, violations = aware.costs, aware.violations
        row = same.index(True)
        return Prediction(costs[row], not (violations[row] > 0.0).any())

    def _on_surfaces(self, goals: Goals, coded: Array) -> Prediction:
        if (aware := self.front.tolerance_aware) is not None:
            judged = aware.box.judge(quadratics(self.study.surfaces, len(self.study.factors)), goals, coded)
            return Prediction(judged.costs[0], not (judged.violations[0] > 0.0).any())
        values = predict_all(self.study.surfaces, coded)
        return Prediction(goals.costs(values)[0], not (goals.violations(values, values)[0] > 0.0).any())


def better_points(study: Problem, confirmed: Mapping[str, Confirmed]) -> list[str]:
    """Names of the simulated points that are better than the pick in every response with a goal."""
    goals = study.goals
    costs = {name: goals.costs(point.values) for name, point in confirmed.items()}
    return [name for name in confirmed if name not in ("baseline", "pick") and (costs[name] < costs["pick"]).all()]


def rivals_sentences(forecast: Forecast, confirmed: Mapping[str, Confirmed]) -> list[str]:
    """For each point that is better than the pick in every response as simulated: why it is not the pick, in one sentence."""
    return [
        f"Point {confirmation.point_words(name)} is better than the selected design in every response as simulated"
        f"{_uncertain(forecast.study, confirmed[name], confirmed['pick'])}, {_reason(forecast, confirmed[name], confirmed['pick'])}."
        for name in better_points(forecast.study, confirmed)
    ]


def _uncertain(study: Problem, rival: Confirmed, pick: Confirmed) -> str:
    """The responses whose difference is within its error."""
    goals = study.goals
    apart = np.abs(rival.values - pick.values) <= np.nan_to_num((rival.estimate - pick.estimate).half_width, nan=np.inf)
    names = [quantity(study.responses[index])[0] for index in goals.objectives if apart[index]]
    return f" ({all_of(names)} only within the error)" if names else ""


def _reason(forecast: Forecast, rival: Confirmed, pick: Confirmed) -> str:
    """Why a point is not the pick, by what was known of both when the pick was chosen."""
    study = forecast.study
    limits = limits_of(study, rival)
    if ORDER.index(verdict_of(limits)) > ORDER.index(verdict_of(limits_of(study, pick))):
        worst = max(limits, key=lambda limit: ORDER.index(limit.verdict))
        bound = f"{quantity(worst.response)[0]} {worst.sense} {worst.bound:g}"
        return (
            f"but it violates the limit {bound}" if worst.verdict == "broken" else f"but its limit {bound} is undecided"
        )
    here, there = forecast.at(rival.point), forecast.at(pick.point)
    if here is None and forecast.searched is not None:
        return f"but it is not a point of the {forecast.searched.name} front, from which the design is selected"
    where = " at the ends of its tolerances" if forecast.with_tolerances else ""
    if here is not None and there is not None:
        if there.keeps and not here.keeps:
            return f"but {forecast.source} a violated limit{where}"
        if (worse := here.costs > there.costs).any():
            return f"but{where} {forecast.source} {_losses(study, here.costs, there.costs, worse, pick)} than at the selected design"
    return "and the study found no reason to reject it: consider it"


def _losses(study: Problem, costs: Array, pick_costs: Array, worse: Mask, pick: Confirmed) -> str:
    """'power loss 1.2 % more' of the responses in which a point is predicted worse than the pick."""
    goals = study.goals
    percent = 100.0 * (pick_costs - costs) / np.abs(pick.values[goals.objectives])
    return all_of(
        f"{quantity(study.responses[index])[0]} {improvement(float(change), None, study.file.response[index].goal)}"
        for index, change, loss in zip(goals.objectives, percent, worse, strict=True)
        if loss
    )
