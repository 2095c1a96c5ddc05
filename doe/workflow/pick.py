"""The pick of a front: which of its points are worth a simulation, what a search leaves open about it, what is to be had beyond the edge of
the region, and the widest tolerances within which parts keep its gains.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import special

from doe import clearance
from doe.clearance import Simulations
from doe.pareto import ParetoFront
from doe.pareto.simulated_tolerance import Neighbourhood, SimulatedAware, pick_among, simulated_aware
from doe.pareto.tolerance import WidestTolerances, widest_tolerances
from doe.response_surface import Surface
from doe.response_surface.model_error import REACH
from doe.running.store import Failure
from doe.study_file import Study
from doe.study_file.sections import Tolerances
from doe.workflow.adaptive import Adaptive, drawn_by_emulators
from doe.workflow.confirmation import (
    ORDER,
    Choice,
    Confirmed,
    Limit,
    confirm,
    confirmed_from,
    error_of_difference,
    limits_of,
    verdict_of,
)
from doe.workflow.front import (
    DRAWS,
    Conditioned,
    Drawn,
    Missed,
    draws_of,
    find_front,
    keeping,
    open_errors,
    standard_errors_of,
)
from doe.workflow.goals import beyond_runs, goals_of, known_tolerances, region_of, rigid, rounded_within, tolerance_box
from doe.workflow.surfaces import CHUNK, draw_all, jacobian, predict_all, predict_paired, quadratics
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError
from rbdyn.base.records import Record, derived, finite, keyed, outside_json
from rbdyn.base.words import improvement, quantity, shown


@dataclass(frozen=True, eq=False)
class SearchedPick:
    """A row of the searched front and why it was picked; ``aware`` is None where the study asks for no tolerances."""

    row: int
    reason: str
    aware: SimulatedAware | None


def searched_pick(
    study: Study, surfaces: Sequence[Surface], searched: Adaptive, simulated: Sequence[Confirmed] = (), failed: int = 0
) -> SearchedPick:
    """The point of the searched front by the study's rule, of what tolerances leave where the study asks for that.

    It keeps every limit with the probability that the study asks for, by the standard errors of its fresh runs and by
    what these missed at points ``simulated``, which are not picked again; each of the ``failed`` among them, picked and not
    kept, lets the back-off grow by its own size.
    """
    front, goals = searched.front, goals_of(study)
    coded = study.coded(front.points)
    shift, margin = _doubt(study, searched, coded, simulated)
    margin *= front.quantile(study.file.confirmation.limit_probability) * (1.0 + failed)
    below, above = margin - shift, margin + shift
    ran = front.baseline_values
    ran = None if ran is None or not np.isfinite(ran).all() else ran
    baselines = [] if ran is None else [goals.costs(ran)]
    costs, violations = front.costs, goals.violations(front.values - below, front.values + above)
    aware, after = None, ""
    if (box := tolerance_box(study)) is not None:
        here, base = neighbourhood(study, surfaces, searched, coded, front.values), None
        if ran is not None:
            at = study.coded(study.baseline)[None]
            base = neighbourhood(study, surfaces, searched, at, ran[None])
        aware = simulated_aware(box, here, goals, base, below, above)
        costs, violations = aware.costs, aware.violations
        if not (violations <= 0.0).all(axis=1).any():
            violations = goals.violations(front.values - below, front.values + above)
        baselines += [] if aware.robust_baseline is None else [aware.robust_baseline]
        after = ", at the ends of its tolerances"
    rounded = [rounded_within(study, point) for point in front.points]
    fresh = np.array([not any(np.array_equal(point, each.point) for each in simulated) for point in rounded])
    rows = np.flatnonzero(fresh) if fresh.any() else np.arange(len(front.points))
    row, reason = pick_among(costs[rows], violations[rows], goals, baselines, study.file.front.pick)
    words = f"{reason.replace('front points', f'points of the {searched.name} front')}{after}"
    return SearchedPick(int(rows[row]), words, aware)


def neighbourhood(
    study: Study, surfaces: Sequence[Surface], searched: Adaptive, coded: Array, values: Array
) -> Neighbourhood:
    """About coded points (n, k) of known responses (n, m), in the shape of the surfaces as the search's runs correct it."""
    forms, runs = quadratics(surfaces, len(study.factors)), searched.front.searched
    return Neighbourhood.of(forms, coded, values, study.coded(runs.points), runs.values)


def _doubt(study: Study, searched: Adaptive, coded: Array, simulated: Sequence[Confirmed]) -> tuple[Array, Array]:
    """Mean and standard deviation (f, m) of what the front's fresh runs err by, given what they missed at the points
    simulated, each next to its nearest row."""
    front = searched.front
    shift, deviation = np.zeros_like(front.values), front.standard_errors.copy()
    if not simulated:
        return shift, deviation
    at = study.coded(np.array([each.point for each in simulated]))
    rows = ((at[:, None] - coded[None]) ** 2).sum(axis=-1).argmin(axis=1)
    values, errors = np.array([each.values for each in simulated]), standard_errors_of(simulated)
    for index in range(values.shape[1]):
        misses = values[:, index] - front.values[rows, index]
        field = Conditioned(Missed(coded[rows], misses, errors[:, index], deviation[rows, index]))
        shift[:, index], left = field(coded, front.standard_errors[:, index])
        # The error of one more simulation counts too.
        deviation[:, index] = np.hypot(left, errors[:, index].max())
    return shift, deviation


def draws_about(study: Study, searched: Adaptive, here: Neighbourhood, pick: Confirmed, baseline: Confirmed) -> Drawn:
    """Draws of the responses of parts about a pick, coded points (n, k), and of the baseline, the last of them.

    Functions are drawn from the search's emulators, of which the change from the pick, ``here``, counts. The levels of pick and baseline are those of their own runs, with Student's errors.
    """

    def drawn(coded: Array) -> Iterator[Array]:
        parts, random = coded[:-1], np.random.default_rng(study.file.front.seed)
        for first in range(0, DRAWS, CHUNK):
            count = min(CHUNK, DRAWS - first)
            values = drawn_by_emulators(study, searched, np.vstack([parts, here.points]), count, random)
            change = values[:, :-1] - values[:, -1:]
            levels = [_levels(each, count, random)[:, None] for each in (pick, baseline)]
            yield np.concatenate([levels[0] + change, levels[1]], axis=1)

    return drawn


def _levels(confirmed: Confirmed, count: int, random: np.random.Generator) -> Array:
    """Responses (d, m) that a simulated point might as well have."""
    freedom = np.minimum(confirmed.joint_freedom, 1e9)
    student = random.standard_t(freedom, (count, freedom.size))
    return np.asarray(confirmed.values + confirmed.standard_error * student)


@dataclass(frozen=True, eq=False)
class Chosen:
    """The front that the pick is of, the pick of the searched front if that was searched, all points simulated by name
    ("baseline", "pick", other picks, then "try_1" and so on: picks that did not keep their limits), and failures.

    ``tried`` counts the points simulated as the pick.
    """

    front: ParetoFront
    searched: SearchedPick | None
    confirmed: dict[str, Confirmed]
    failures: list[Failure]
    tried: int


def choose(
    study: Study, surfaces: Sequence[Surface], found: ParetoFront, searched: Adaptive | None, simulations: Simulations
) -> Chosen:
    """Simulate the pick; while a limit is not kept, back off by what was missed and simulate the next best point.

    Of points none of which keeps all limits, the best stands. Raises RunError, InputError, KeyboardInterrupt.
    """
    tried: list[tuple[Confirmed, ParetoFront, SearchedPick | None]] = []
    baseline: list[Confirmed] = []
    front = found
    while True:
        simulated = [*baseline, *(each for each, _, _ in tried)] if tried else []
        chosen = None if searched is None else searched_pick(study, surfaces, searched, simulated, len(tried))
        wanted = choices(study, front, searched, chosen)
        if any(np.array_equal(wanted["pick"].point, each.point) for each, _, _ in tried):
            break
        confirmed, _ = confirm(study, {"pick": wanted["pick"]}, simulations)
        baseline = [confirmed["baseline"]]
        tried.append((confirmed["pick"], front, chosen))
        kept = verdict_of(limits_of(study, confirmed["pick"])) == "kept"
        if kept or len(tried) == study.file.confirmation.tries:
            break
        if searched is None:
            try:
                front = find_front(study, surfaces, [*baseline, *(each for each, _, _ in tried)], len(tried))
            except InputError:
                # What was missed leaves no point that keeps all limits.
                break
    best = min(range(len(tried)), key=lambda place: _badness(limits_of(study, tried[place][0])))
    pick, front, chosen = tried[best]
    wanted = choices(study, front, searched, chosen)
    for number, (each, _, _) in enumerate(tried, 1):
        if each is not pick:
            wanted[f"try_{number}"] = Choice(each.point, f"try {number} for the pick: {each.reason}")
    wanted["pick"] = Choice(pick.point, pick.reason)
    confirmed, failures = confirm(study, wanted, simulations)
    return Chosen(front, chosen, confirmed, failures, len(tried))


def _badness(limits: Sequence[Limit]) -> tuple[int, float]:
    worst = min((limit.room / (abs(limit.bound) or 1.0) for limit in limits), default=0.0)
    return ORDER.index(verdict_of(limits)), -worst


def choices(
    study: Study, front: ParetoFront, searched: Adaptive | None, chosen: SearchedPick | None = None
) -> dict[str, Choice]:
    """The pick, then the picks by the other rules and of the searched front, by name.

    What was ``chosen`` of the searched front is the pick, and the pick of the surfaces stands next to it. Where the study asks
    for a tolerance-aware front, its pick is that of the surfaces. Of those that the drawing cannot distinguish
    the first stands for all, and its reason says so.
    """
    wanted: dict[str, Choice] = {}
    for name, point, reason in _candidates(study, front, searched, chosen):
        rounded = rounded_within(study, point)
        twin = next((known for known, each in wanted.items() if np.array_equal(each.point, rounded)), None)
        if twin is None:
            wanted[name] = Choice(rounded, reason)
        elif name != study.file.front.pick:
            wanted[twin] = Choice(rounded, f"{wanted[twin].reason}; also {reason}")
    return wanted


def _candidates(
    study: Study, front: ParetoFront, searched: Adaptive | None, chosen: SearchedPick | None
) -> Iterator[tuple[str, Array, str]]:
    aware, name = front.tolerance_aware, "pick"
    if searched is not None and chosen is not None:
        yield "pick", searched.front.points[chosen.row], chosen.reason
        name = "pick_of_surfaces"
    if aware is None:
        yield name, front.points[front.pick], front.pick_reason
    else:
        point = study.actual(aware.points[aware.pick])
        yield name, point, f"{aware.pick_reason}, judged at the ends of its tolerances"
        yield "without_tolerances", front.points[front.pick], front.pick_reason
    for rule, row in front.picks.items():
        yield rule, front.points[row], f"the pick by {rule}"
    if searched is not None:
        yield searched.name, searched.front.points[searched.front.pick], f"the pick of the {searched.name} front"


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
    "surfaces" or "simulation". ``goals``: what is wanted, by response; small by default.
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
    """Where the pick and the fronts' points (n, k) lie; beyond the bounds ``simulations`` show, else the surfaces.

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


def widest_of(
    study: Study,
    surfaces: Sequence[Surface],
    point: Array,
    settings: Tolerances,
    confirmed: Mapping[str, Confirmed] | None = None,
    here: Neighbourhood | None = None,
    drawn_about: Drawn | None = None,
) -> WidestTolerances | None:
    """Widest half widths, in factor units, about a point (k,) in factor units; None where no factor has a tolerance.

    ``confirmed`` are points that were simulated, "baseline" among them: they narrow what the surfaces leave open. ``here``,
    about a pick of a search, and the responses simulated at the baseline stand for the level of the surfaces; then parts may
    lie beyond the region by the factors' own tolerances, which the runs of the search bear out by their slopes, and
    ``drawn_about`` draws what the search leaves open.

    A part keeps its promise when every response with a goal has at least the share ``keep`` of the gain that the
    surfaces predict at the point (or, where they predict a loss, loses no more), and when all limits hold.
    """
    free = np.flatnonzero(~rigid(study))
    if not free.size:
        return None
    goals, simulated = goals_of(study), None if here is None or confirmed is None else confirmed["baseline"].values
    base, nominal = (study.coded(each)[None] for each in (study.baseline, point))
    ends = [predict_all(surfaces, each) for each in (base, nominal)]
    if here is not None and simulated is not None:
        ends = [simulated[None], here.values]
    gain = (goals.costs(ends[0]) - goals.costs(ends[1]))[0]
    keep = np.where(gain > 0.0, settings.keep * gain, gain)
    drawn = draw_all(surfaces, settings.samples, settings.seed) if settings.surface_uncertainty else None

    def responses(coded: Array) -> Array:
        return predict_all(surfaces, coded) if drawn is None else predict_paired(surfaces, drawn, coded)

    def objectives(parts: Array) -> Array:
        points = np.tile(point, (len(parts), 1))
        points[:, free] = parts
        coded = study.coded(points)
        values = responses(coded)
        if here is not None:
            values = values - centre_values + here.values + (coded - here.points) @ here.slopes[0]
        return np.hstack([goals.costs(values), goals.violations(values, values)])

    # Of every part its own nominal point and baseline: they may have surfaces of their own.
    centre_values, reference_values = (responses(np.repeat(each, settings.samples, axis=0)) for each in (nominal, base))
    if simulated is not None:
        reference_values = np.broadcast_to(simulated, reference_values.shape)
    reference = goals.costs(reference_values)
    held = np.zeros((settings.samples, len(goals.limited)))
    known = known_tolerances(study)
    ratios = np.array([known.get(name, np.nan) for name in study.factors])
    low, high = _box(study, point, None if here is None else np.nan_to_num(ratios))
    slack = 1e-9 * np.abs(gain).max()
    promise = f"keep {100.0 * settings.keep:g} % of every gain{' and all limits' if goals.limited else ''}"
    found = widest_tolerances(
        objectives,
        point[free],
        np.hstack([reference - keep, held]) + slack,
        (study.step if np.isnan(ratios[free]).any() else ratios)[free],
        lower=low[free],
        upper=high[free],
        names=_names(study),
        promise=promise,
        drawn=keeping(study, drawn_about or draws_of(study, surfaces, confirmed), point, free, keep - slack),
        open_errors=open_errors(surfaces, searched=here is not None),
        **settings.model_dump(include={"probability", "distribution", "samples", "seed", "aim"}),
    )
    return found.among(free, point.size)


def _names(study: Study) -> list[str]:
    """Names of all that parts must keep."""
    goals = goals_of(study)
    gains = (f"the gain of {study.responses[index]}" for index in goals.objectives)
    return [*gains, *(f"{study.responses[index]} {sense} {limit:g}" for index, sense, limit in goals.limited)]


def _box(study: Study, point: Array, beyond: Array | None) -> tuple[Array, Array]:
    """Ends (k,) of the region in which parts may lie, ``beyond`` (k,) from the point at least, if given."""
    reach = region_of(study) * study.step
    inside = study.centre - reach, study.centre + reach
    if beyond is None:
        return inside
    return np.minimum(inside[0], point - beyond), np.maximum(inside[1], point + beyond)
