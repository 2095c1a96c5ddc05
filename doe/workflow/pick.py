"""The pick of a front: the points worth a simulation, and where the pick lies in the region.

A pick that does not keep its limits gives way to the next best point. At the edge of the region the change beyond it is
predicted. Where the study asks for a tolerance-aware front, parts at the ends of the factors' own tolerances beat the
baseline in every response with a goal, whichever gains the widest tolerances keep later.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import special

from doe.clearance import Simulations
from doe.designs.optimal import Remaining
from doe.pareto import ParetoFront
from doe.pareto.front import pick_shares
from doe.pareto.tolerance import Neighbourhood, SimulatedAware, pick_among, simulated_aware
from doe.response_surface.adequacy import REACH
from doe.running.store import Failure
from doe.workflow import confirmation
from doe.workflow.adaptive import Adaptive, emulator_draws
from doe.workflow.confirmation import ORDER, Choice, Confirmed, Limit, class_limits, every_limit, limits_of, verdict_of
from doe.workflow.front import SURFACE_DRAWS, Draws, ErrorField, Misses, find_front, standard_errors_of, tolerance_box
from doe.workflow.problem import Problem
from doe.workflow.runs import EstimatedValue
from doe.workflow.surfaces import CHUNK, jacobian, quadratics
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.records import Record, finite
from rbdyn.base.words import all_of, improvement, quantity, shown

# Student's t of more degrees of freedom is normal to all digits that count.
LARGE_FREEDOM = 1e9


class SearchedPick(Record, eq=False):
    """A row of the searched front and why it was picked; ``aware`` is None where the study asks for no tolerances.

    ``shares`` (f,): share of draws of the errors of the front's runs in which each row is the pick. The changes within the
    tolerances are not drawn.
    """

    row: int
    reason: str
    aware: SimulatedAware | None
    shares: Array


def searched_pick(
    study: Problem, searched: Adaptive, simulated: Sequence[Confirmed] = (), failed: int = 0
) -> SearchedPick:
    """The point of the searched front by the study's rule, at the ends of its tolerances where the study asks for that.

    It keeps every limit with the probability that the study asks for. The back-off follows from the standard errors of
    the front's fresh runs and from their misses at points ``simulated``, which are not picked again. Each of the
    ``failed`` picks lets the back-off grow by its own size.
    """
    front, goals = searched.front, study.goals
    coded = study.coded(front.points)
    shift, margin = _doubt(study, searched, coded, simulated)
    margin *= front.quantile(study.file.confirmation.limit_probability) * (1.0 + failed)
    below, above = margin - shift, margin + shift
    baseline_values = front.baseline_values
    baseline_values = None if baseline_values is None or not np.isfinite(baseline_values).all() else baseline_values
    baselines = [] if baseline_values is None else [goals.costs(baseline_values)]
    costs, violations = front.costs, goals.violations(front.values - below, front.values + above)
    aware, suffix = None, ""
    if (box := tolerance_box(study)) is not None:
        neighbours, base = neighbourhood(study, searched, coded, front.values), None
        if baseline_values is not None:
            coded_baseline = study.coded(study.baseline)[None]
            base = neighbourhood(study, searched, coded_baseline, baseline_values[None])
        aware = simulated_aware(box, neighbours, goals, base, below, above)
        costs, violations = aware.costs, aware.violations
        if not (violations <= 0.0).all(axis=1).any():
            violations = goals.violations(front.values - below, front.values + above)
        baselines += [] if aware.robust_baseline is None else [aware.robust_baseline]
        suffix = " also at the ends of their tolerances"
    rounded = [study.rounded_within(point) for point in front.points]
    is_new = np.array([not any(np.array_equal(point, confirmed.point) for confirmed in simulated) for point in rounded])
    rows = np.flatnonzero(is_new) if is_new.any() else np.arange(len(front.points))
    rule = study.file.front.pick
    row, reason = pick_among(costs[rows], violations[rows], goals, baselines, rule)

    def pick(drawn: Array, shift: Array) -> int:
        moved = [baseline + shift for baseline in baselines]
        return int(rows[pick_among(drawn[rows], violations[rows], goals, moved, rule)[0]])

    freedom = np.full_like(front.values, np.inf) if front.freedom is None else front.freedom
    freedom = np.minimum(freedom[:, goals.objectives], LARGE_FREEDOM)
    shares = pick_shares(pick, costs, front.cost_errors, freedom, study.file.front.seed)
    words = f"{reason.replace('front points', f'points of the {searched.name} front')}{suffix}"
    return SearchedPick(int(rows[row]), f"{words}{_share_words(shares, int(rows[row]))}", aware, shares)


def _share_words(shares: Array, row: int) -> str:
    """How often this point is the pick under the errors of its simulation, and the most frequent other one."""
    others = np.delete(shares, row)
    rival = f", another in {100.0 * others.max():.0f}" if others.size and others.max() >= 0.005 else ""
    return f"; the same point is selected in {100.0 * shares[row]:.0f} of 100 draws of the simulation's errors{rival}"


def neighbourhood(study: Problem, searched: Adaptive, coded: Array, values: Array) -> Neighbourhood:
    """Responses near coded points (n, k) with responses (n, m): the surfaces, corrected by the runs of the search."""
    forms, runs = quadratics(study.surfaces, len(study.factors)), searched.front.searched
    return Neighbourhood.of(forms, coded, values, study.coded(runs.points), runs.values)


def _doubt(study: Problem, searched: Adaptive, coded: Array, simulated: Sequence[Confirmed]) -> tuple[Array, Array]:
    """Mean and standard deviation (f, m) of the errors of the front's fresh runs.

    They follow from the misses at the points simulated, each compared with its nearest row.
    """
    front = searched.front
    shift, deviation = np.zeros_like(front.values), front.standard_errors.copy()
    if not simulated:
        return shift, deviation
    positions = study.coded(np.array([confirmed.point for confirmed in simulated]))
    rows = ((positions[:, None] - coded[None]) ** 2).sum(axis=-1).argmin(axis=1)
    values, errors = np.array([confirmed.values for confirmed in simulated]), standard_errors_of(simulated)
    for index in range(values.shape[1]):
        misses = values[:, index] - front.values[rows, index]
        error_field = ErrorField(
            Misses(coded[rows], misses, errors[:, index], deviation[rows, index]), errors[:, index].max()
        )
        shift[:, index], deviation[:, index] = error_field(coded, front.standard_errors[:, index])
    return shift, deviation


def draws_about(
    study: Problem, searched: Adaptive, neighbours: Neighbourhood, pick: Confirmed, baseline: Confirmed
) -> Draws:
    """Draws of the responses of parts about a pick, coded points (n, k), and of the baseline, the last of them.

    The change from the pick, ``neighbours``, is drawn from the search's emulators. The levels of pick and baseline are those
    of their own runs, with Student's errors.
    """

    def draws(coded: Array) -> Iterator[Array]:
        parts, random = coded[:-1], np.random.default_rng(study.file.front.seed)
        for first in range(0, SURFACE_DRAWS, CHUNK):
            count = min(CHUNK, SURFACE_DRAWS - first)
            values = emulator_draws(study, searched, np.vstack([parts, neighbours.points]), count, random)
            change = values[:, :-1] - values[:, -1:]
            levels = [_levels(confirmed, count, random)[:, None] for confirmed in (pick, baseline)]
            yield np.concatenate([levels[0] + change, levels[1]], axis=1)

    return draws


def _levels(confirmed: Confirmed, count: int, random: np.random.Generator) -> Array:
    """Draws (d, m) of the responses of a simulated point within its errors."""
    freedom = np.minimum(confirmed.joint_freedom, LARGE_FREEDOM)
    student = random.standard_t(freedom, (count, freedom.size))
    return np.asarray(confirmed.values + confirmed.standard_error * student)


# Picks that cannot be simulated, after which the study ends.
LOST = 3


class Selection(Record, eq=False):
    """The front with the pick, the pick of the searched front (None without a search), simulated points, and failures.

    ``confirmed`` by name: "baseline", "pick", other picks, then "try_1" and so on for picks that another one replaced.
    ``tries`` counts the points simulated as the pick.
    """

    front: ParetoFront
    searched: SearchedPick | None
    confirmed: dict[str, Confirmed]
    failures: list[Failure]
    tries: int


def choose(
    study: Problem, surface_front: ParetoFront, searched: Adaptive | None, baseline: Confirmed, simulations: Simulations
) -> Selection:
    """Simulate the pick; while a limit is not kept, back off by what was missed and simulate the next best point.

    Where no point is expected to keep all limits, that is the one expected to miss them least, as long as this is less than
    simulated so far. If it keeps them after all, a front that knows this follows. If no point keeps all limits, the best of
    them is the pick. Raises RunError, InputError, KeyboardInterrupt.
    """
    trials: list[tuple[Confirmed, ParetoFront, SearchedPick | None]] = []
    kept: list[bool] = []
    front, lost = surface_front, 0
    while True:
        tried = [point for point, _, _ in trials]
        simulated = [baseline, *tried] if tried else []
        candidate = None if searched is None else searched_pick(study, searched, simulated, len(trials))
        points = choices(study, front, searched, candidate)
        if any(np.array_equal(points["pick"].point, point.point) for point in tried):
            break
        try:
            found = _judged(study, baseline, points["pick"], simulations)
        except confirmation.LostPickError:
            # Its run failed like those of the design: the front stays away from there.
            lost += 1
            if searched is not None or lost > LOST:
                raise
            study = _without(study, points["pick"].point)
            front = find_front(study, simulated, len(trials))
            continue
        trials.append((found, front, candidate))
        kept.append(verdict_of(limits_of(study, found)) == "kept")
        # Where the closest point keeps its limits, so may points of a front.
        is_closest = front.violations is not None and searched is None and kept[-1] and sum(kept) == 1
        if len(trials) == study.file.confirmation.tries or (any(kept) and not is_closest):
            break
        if verdict_of(class_limits(study, found)) != "kept":
            # No surface has a class: the front stays away from there.
            study = _without(study, points["pick"].point)
        if searched is None:
            tried.append(found)
            front = find_front(study, [baseline, *tried], kept.count(False))
            if front.violations is not None and (any(kept) or not _promises_less(study, front, tried)):
                break
    # Of points that keep their limits the last one counts, which is of a front.
    best = min(
        range(len(trials)), key=lambda place: (-place * kept[place], *_badness(limits_of(study, trials[place][0])))
    )
    pick, front, candidate = trials[best]
    points = choices(study, front, searched, candidate)
    del points["pick"]
    others, failures = confirmation.confirm(study, baseline, points, simulations)
    tries = {
        f"{confirmation.TRY}{number}": replace(point, reason=f"try {number} for the selected design: {point.reason}")
        for number, (point, _, _) in enumerate(trials, 1)
        if point is not pick
    }
    confirmed = {"baseline": baseline, "pick": pick} | others | tries
    return Selection(front, candidate, confirmed, failures, len(trials))


def _judged(study: Problem, baseline: Confirmed, choice: Choice, simulations: Simulations) -> Confirmed:
    """The simulated pick, by twice the replicates where its own leave a limit undecided: they tell more than another point.

    Raises as ``confirm``.
    """
    found = confirmation.confirm(study, baseline, {"pick": choice}, simulations)[0]["pick"]
    if verdict_of(limits_of(study, found)) != "undecided":
        return found
    settings = study.file.confirmation
    more = study.with_file(confirmation=settings.model_copy(update={"replicates": 2 * settings.replicates}))
    reason = (
        f"{choice.reason}; by {2 * settings.replicates} replicates, as {settings.replicates} left a limit undecided"
    )
    return confirmation.confirm(more, baseline, {"pick": replace(choice, reason=reason)}, simulations)[0]["pick"]


def _promises_less(study: Problem, front: ParetoFront, simulated: Sequence[Confirmed]) -> bool:
    """Whether the closest point is expected to miss its worst limit by less, beyond the errors, than every ``simulated`` one."""
    assert front.violations is not None
    if not study.goals.limited:
        return False
    bounds = np.array([abs(bound) or 1.0 for _, _, bound in study.goals.limited])
    missed = min(
        max((-limit.room - (limit.error or 0.0)) / (abs(limit.bound) or 1.0) for limit in every_limit(study, point))
        for point in simulated
    )
    return bool((front.violations / bounds).max() < missed)


def _without(study: Problem, point: Array) -> Problem:
    """The study without the part of its region where a point (k,) failed, or its cage missed its limit."""
    remaining = study.remaining or Remaining(study.surfaces[0].data.points, np.empty((0, point.size)))
    failed = np.vstack([remaining.failed, study.coded(point)])
    return replace(study, remaining=replace(remaining, failed=failed))


def _badness(limits: Sequence[Limit]) -> tuple[int, float]:
    worst = min((limit.room / (abs(limit.bound) or 1.0) for limit in limits), default=0.0)
    return ORDER.index(verdict_of(limits)), -worst


def choices(
    study: Problem, front: ParetoFront, searched: Adaptive | None, search_pick: SearchedPick | None = None
) -> dict[str, Choice]:
    """The pick, then the picks by the other rules and of the searched front, by name.

    With a ``search_pick`` that is the pick, and the pick of the surfaces is simulated too. Where the study asks for a
    tolerance-aware front, its pick is that of the surfaces. Points that the drawing cannot distinguish are one, under
    the first name, and its reason says so.
    """
    points: dict[str, Choice] = {}
    for name, point, reason in _candidates(study, front, searched, search_pick):
        rounded = study.rounded_within(point)
        twin = next(
            (other_name for other_name, choice in points.items() if np.array_equal(choice.point, rounded)), None
        )
        if twin is None:
            points[name] = Choice(rounded, reason)
        elif name != study.file.front.pick:
            points[twin] = Choice(rounded, f"{points[twin].reason}; also {reason}")
    return points


def _candidates(
    study: Problem, front: ParetoFront, searched: Adaptive | None, search_pick: SearchedPick | None
) -> Iterator[tuple[str, Array, str]]:
    aware, name = front.tolerance_aware, "pick"
    if searched is not None and search_pick is not None:
        yield "pick", searched.front.points[search_pick.row], search_pick.reason
        name = "pick_of_surfaces"
    if aware is None:
        yield name, front.points[front.pick], front.pick_reason
    else:
        yield name, study.actual(aware.points[aware.pick]), aware.pick_reason
        yield "without_tolerances", front.points[front.pick], front.pick_reason
    for rule, row in () if front.violations is not None else front.picks.items():
        yield rule, front.points[row], f"selected by {rule}"
    if searched is not None:
        yield (searched.name, searched.front.points[searched.front.pick], f"selected from the {searched.name} front")


NEAR = 0.04  # share of a factor's range within which a point lies at a bound
AHEAD = 0.5  # coded units beyond the pick at which the simulator runs: half a level of the design
STEP = 1e-3  # coded units over which surfaces are differentiated
MICROMETRE_MM = 1e-3


class Place(NamedTuple):
    """Where a point lies: its side and bound, by factor at a bound, and whether it is farther out than any run."""

    bounds: Mapping[str, tuple[str, float]]
    beyond: bool

    @property
    def at_bounds(self) -> dict[str, str]:
        """Side by factor, for JSON."""
        return {factor: side for factor, (side, _) in self.bounds.items()}

    def sentence(self, point: str) -> str:
        """Where the ``point`` of that name lies, in words; empty inside the region that the runs reach."""
        ends = all_of(f"the {side} bound of {name} ({shown(bound)})" for name, (side, bound) in self.bounds.items())
        if ends and self.beyond:
            return f"{point} lies at {ends}, and farther out than any run: the surfaces extrapolate there."
        if ends:
            return f"{point} lies at {ends}."
        return f"{point} is farther out than any run: the surfaces extrapolate there." if self.beyond else ""


class Outward(Record):
    """A factor whose pick lies at a bound of the region, and how each response with a goal changes beyond it.

    ``gains`` by response: improvement in its unit over ``per``, a micrometre of a factor in millimetres, else one unit of the factor.
    ``source`` is "the surfaces" or "simulation".
    """

    side: str
    bound: float
    per: str
    source: str
    gains: dict[str, EstimatedValue]

    def sentence(self, factor: str, goals: Mapping[str, str]) -> str:
        """The bound and the change beyond it, in two sentences; ``goals`` by response, of a small value unless stated."""
        changes = ", ".join(
            f"{name} {improvement(gain.value, gain.error, goals.get(name, 'min'), quantity(name)[1])}"
            for name, gain in self.gains.items()
        )
        position = f"{self.bound:.4g} {quantity(factor)[1]}".rstrip()
        return (
            f"The selected design is at the {self.side} bound of {factor}, {position}. "
            f"Extrapolated change per {self.per} beyond it by {self.source}: {changes}."
        )


class Edge(Record):
    """Factors of the pick at a bound, and the shares of the fronts within `NEAR` of a bound (None: no such front).

    ``beyond_runs``: whether the pick is farther out than any run of the design. ``sentence`` says all of it in words.
    """

    beyond_runs: bool
    factors: dict[str, Outward]
    front_share: float
    direct_front_share: float | None
    sentence: str


def _edge_sentence(outward: Sequence[str], beyond_runs: bool, front_share: float, searched_share: float | None) -> str:
    """Where pick and fronts lie; ``outward``: sentences on the bounds at the pick."""
    near = f"within {100.0 * NEAR:g} % of a bound of the region"
    shares = f"{100.0 * front_share:.0f} % of the front on the surfaces lies {near}"
    if searched_share is not None:
        searched = f"{100.0 * searched_share:.0f} % of the simulator's own front"
        shares = f"{100.0 * front_share:.0f} % of the front on the surfaces and {searched} lie {near}"
    if outward:
        beyond = (
            " The selected design is farther out than any run: the surfaces extrapolate there." if beyond_runs else ""
        )
        return f"{' '.join(outward)}{beyond} {shares}; a wider design may find more."
    if beyond_runs:
        return f"The selected design lies between the bounds, but farther out than any run: the surfaces extrapolate there; {shares}."
    return f"The selected design lies inside the region; {shares}."


def share_at_edge(study: Problem, points: Array) -> float:
    """Share of points (n, k) in factor units within `NEAR` of a bound of the region."""
    return float(sides_of(points, study.ends).any(axis=1).mean())


def place_of(study: Problem, point: Array) -> Place:
    """Where a point (k,) in factor units lies in the region of the design."""
    ends = study.ends
    sides = zip(study.factors, sides_of(point[None], ends)[0].tolist(), ends.tolist(), strict=True)
    bounds = {name: ("upper", high) if side > 0 else ("lower", low) for name, side, (low, high) in sides if side}
    return Place(bounds, study.beyond_runs(study.coded(point)))


def edge_of(study: Problem, pick: Confirmed, front: Array, searched: Adaptive | None, simulations: Simulations) -> Edge:
    """Where the pick and the fronts' points (n, k) lie; the change beyond a bound is by the surfaces.

    After an adaptive search it is simulated, and the region is the one that was searched, which may have grown.
    """
    ends = study.ends if searched is None else searched.edges
    sides = sides_of(pick.point[None], ends)[0]
    names = [(index, side) for index, side in enumerate(sides.tolist()) if side]
    gains_beyond = {} if searched is None else _gains_by_simulation(study, pick, names, simulations)
    outward = {}
    for index, side in names:
        gains, source = gains_beyond.get(index), "simulation"
        if gains is None:
            gains, source = _gains_on_surfaces(study, pick.point, index, side), "the surfaces"
        unit, scale = ("µm", MICROMETRE_MM) if study.factors[index].endswith("_mm") else ("unit", 1.0)
        bound = float(ends[index, int(side > 0)])
        per_unit = {name: EstimatedValue(gain * scale, finite(error * scale)) for name, (gain, error) in gains.items()}
        outward[study.factors[index]] = Outward("upper" if side > 0 else "lower", bound, unit, source, per_unit)
    goals = {response.name: response.goal for response in study.file.response}
    sentences = [bound.sentence(name, goals) for name, bound in outward.items()]
    far = None if searched is None else float(sides_of(searched.front.points, ends).any(axis=1).mean())
    extrapolates, near = study.beyond_runs(study.coded(pick.point)), share_at_edge(study, front)
    return Edge(extrapolates, outward, near, far, _edge_sentence(sentences, extrapolates, near, far))


def sides_of(points: Array, ends: Array) -> Whole:
    """-1 at a lower bound, 1 at an upper one, else 0, for points (n, k) in a region with ``ends`` (k, 2)."""
    half = 0.5 * (ends[:, 1] - ends[:, 0])
    offsets = (points - ends.mean(axis=1)) / half
    return np.where(np.abs(offsets) >= 1.0 - 2.0 * NEAR, np.sign(offsets), 0.0).astype(np.int64)


def _gains_on_surfaces(study: Problem, point: Array, index: int, side: int) -> dict[str, tuple[float, float]]:
    """Gains per unit of the factor outward, with the error of the slope: that of the coefficients and the model's own."""
    goals = study.goals
    coded = study.coded(point)
    outward_point = coded + side * STEP * np.eye(coded.size)[index]
    gains = {}
    for column, response in enumerate(goals.objectives):
        surface = study.surfaces[response]
        ends = [float(surface.predict(position)) for position in (coded, outward_point)]
        values = np.zeros(len(study.responses))
        values[response] = ends[0]
        slope = float(goals.slopes(values)[column])
        change = jacobian(surface, outward_point) - jacobian(surface, coded)
        variance = float(change @ surface.covariance @ change) / STEP**2
        if surface.model_error is not None:
            # The slope of a field of correlation exp(-(d/REACH)^2) has 2/REACH^2 times its variance.
            by_field = float(jacobian(surface, coded)[surface.terms.index("1")])
            variance += by_field**2 * 2.0 / REACH**2 * surface.model_error.variance
        student = float(special.stdtrit(surface.interval_dof, 0.975))
        scale = 1.0 / study.step[index]
        gains[surface.name] = (-slope * (ends[1] - ends[0]) / STEP * scale, student * float(np.sqrt(variance)) * scale)
    return gains


def _gains_by_simulation(
    study: Problem, pick: Confirmed, names: Sequence[tuple[int, int]], simulations: Simulations
) -> dict[int, dict[str, tuple[float, float]]]:
    """Gains per unit of each factor from runs beyond its bound, like those of the confirmation; none where a run fails."""
    runs, reachable = [], []
    for index, side in names:
        point = pick.point.copy()
        point[index] += side * AHEAD * study.step[index]
        if (run := confirmation.run_where_possible(study, point)) is not None:
            runs.append(run)
            reachable.append((index, point))
    labels = [f"beyond the bound of {study.factors[index]}" for index, _ in reachable]
    results = simulations.run(runs, labels, simulations.progress("beyond the region")) if reachable else []
    goals = study.goals
    gains_beyond = {}
    for (index, point), result in zip(reachable, results, strict=True):
        if isinstance(result, Failure):
            continue
        outer_point = confirmation.confirmed_from(study, Choice(point, ""), result)
        gain = (goals.costs(pick.values) - goals.costs(outer_point.values)) / (AHEAD * study.step[index])
        joint = (pick.estimate - outer_point.estimate).half_width[goals.objectives]
        figures = zip(gain.tolist(), (joint / (AHEAD * study.step[index])).tolist(), strict=True)
        gains_beyond[index] = dict(zip(study.aims, figures, strict=True))
    return gains_beyond
