"""The front found in few runs: emulators learn the simulator, and each run goes where it is expected to gain most. Fronts of one study on one scale, and what limits the pick, factor by factor."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.stats import qmc

from doe import clearance
from doe.adaptive import AdaptiveFront, Batch, Border, Plan, adaptive_front
from doe.adaptive import Runs as Known
from doe.adaptive.acquisition import Region
from doe.adaptive.emulators import Face
from doe.adaptive.search import NEAR, check_budget
from doe.clearance import Simulations
from doe.pareto.search import InfeasibleError, hypervolume, non_dominated
from doe.pareto.simulated import DRAWS, Samples, SimulatedFront, noisy_hypervolume
from doe.response_surface import Surface
from doe.running.runner import Progress
from doe.running.store import Failure, grouped
from doe.study_file import Study
from doe.threads import one_thread
from doe.workflow.confirmation import Limit
from doe.workflow.front import named_faults
from doe.workflow.goals import goals_of, region_of
from doe.workflow.runs import Runs, design_of, ordered_runs, runs_of
from doe.workflow.surfaces import independent_values, standard_errors
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, MethodError, RunError, check_all, refuse
from rbdyn.scene import Scene

SIGNIFICANT = 0.05
# Where a drawing has no resolution, points are twins within this share of the half range of the region.
ALIKE = 0.01
# What the emulators say about a finalist, for its tolerances: 2^6 points within half a level of the design.
ABOUT, HALF_LEVEL = 6, 0.5


@dataclass(frozen=True, eq=False)
class Adaptive:
    """Front found in few runs, every failed run, and wall time [s] of the search and of its emulators alone.

    ``edges`` (k, 2) are the ends of the region, in factor units, that was searched in the end. The categories of its pick are
    those of ``study``, of whose design are the ``runs``; ``front`` are the finalists of ``found`` with these categories.
    """

    name: ClassVar[str] = "adaptive"
    found: AdaptiveFront
    front: SimulatedFront
    study: Study
    runs: Runs
    edges: Array
    failures: tuple[Failure, ...]
    seconds: float


class Evaluator:
    """Runs batches of scenes on the simulator, every one with a seed of its own: a running number.

    So a search that is begun again asks for the same runs in the same order, and the store answers at once.
    """

    def __init__(self, study: Study, simulations: Simulations, progress: Progress, total: int) -> None:
        self._study, self._simulations = study, simulations
        self._progress, self._total = progress, total
        self.done = 0
        self.failures: list[Failure] = []

    def run(self, scenes: list[Scene], label: str) -> tuple[Array, Array, Whole]:
        """Responses (n, m) of scenes, 95 % half-widths (n, m) and how many values are behind these (n, m); NaN where a run
        failed."""
        labels = [f"{label} {self.done + row}" for row in range(1, len(scenes) + 1)]
        results = self._simulations.run(scenes, labels, self._watch)
        self.done += len(scenes)
        values = np.full((len(scenes), len(self._study.responses)), np.nan)
        errors, samples = values.copy(), np.zeros(values.shape, dtype=np.int64)
        for row, result in enumerate(results):
            if isinstance(result, Failure):
                self.failures.append(result)
            else:
                (values[row],), (errors[row],), (samples[row],) = clearance.figures(self._study.responses, [result])
        return values, errors, samples

    def _watch(self, done: int, total: int) -> None:
        self._progress(self.done + done, max(self._total, self.done + total))


def check_adaptive(study: Study, wanted: bool) -> None:
    """Raises InputError where a search that is ``wanted`` is impossible, or categories ask for one that is not."""
    if not wanted:
        refuse(
            f"{study.path}: factor.categories of {each.name}: only the adaptive search changes them; add --adaptive"
            for each in study.file.category
        )
        return
    border_of(study)
    every = study.every_level
    check_all([partial(clearance.adaptive_scenes, study.at(at), study.baseline[None], [2], 0) for at in every])
    try:
        check_budget(plan_of(study), sum(len(design_of(study.at(at)).coded) for at in every))
    except MethodError as error:
        raise InputError([f"{study.path}: adaptive.{error}"]) from None


def plan_of(study: Study) -> Plan:
    """How the search goes; a fresh run at a finalist has the replicates of a design run."""
    settings = study.file.adaptive
    usual = clearance.design_scenes(study, study.baseline[None])[0].numerics.replicates
    return Plan(settings.budget, settings.batch, settings.seed, usual=usual, pick=study.file.front.pick)


@one_thread
def find_adaptive(study: Study, runs: Runs, simulations: Simulations) -> Adaptive:
    """Search the front from the runs of the design on, in batches that are the same for any number of workers.

    Raises RunError where the runs of a stage fail, InputError for impossible settings or limits, KeyboardInterrupt.
    """
    plan, goals, started = plan_of(study), goals_of(study), time.perf_counter()
    each = {
        at: runs if at == study.every_level[0] else _design_at(study.at(at), simulations) for at in study.every_level
    }
    known = _known(study, each, plan)
    evaluate = _Evaluator(study, simulations, plan.budget - len(known.points))
    region = region_in_units(study)
    counts = len(region.levels)
    step = np.append(region_of(study) * study.step, np.ones(counts))
    with named_faults(study, goals, lambda point: point[: len(study.factors)], ""):
        try:
            found = adaptive_front(
                evaluate,
                np.append(study.centre, np.zeros(counts)),
                step,
                region,
                known,
                goals,
                plan,
                np.append(study.baseline, -np.ones(counts)),
                evaluate.report,
                border_of(study),
            )
        except InfeasibleError:
            raise
        except MethodError as error:
            if evaluate.failures:
                causes = "; ".join(group["cause"] for group in grouped(evaluate.failures))
                raise RunError(f"adaptive front: {error} ({causes})") from None
            raise InputError([f"{study.path}: adaptive.{error}"]) from None
    ends = np.column_stack([found.region.low, found.region.high])[: len(study.factors)]
    edges = study.centre[:, None] + step[: len(ends), None] * ends
    levels = levels_at(study, found.front.points[found.front.pick])
    chosen = study.at(levels)
    front = replace(_at_levels(study, found.front, levels), searched=_about(study, found, levels))
    failures = (
        *evaluate.failures,
        *(failure for at, one in each.items() if at != study.every_level[0] for failure in one.failures),
    )
    return Adaptive(found, front, chosen, each[levels], edges, failures, time.perf_counter() - started)


def predicted_costs(study: Study, adaptive: Adaptive, points: Array) -> Array:
    """Costs (n, q) that the emulators predict of points (n, k), as they are drawn and with the pick's categories."""
    found = adaptive.found
    beside = np.tile(_coded_levels(study, adaptive.study.levels), (len(points), 1))
    coded = np.hstack([study.coded(points) / region_of(study), beside])
    means, _ = found.emulators.predict(found.region.snap(coded))
    return adaptive.front.goals.costs(means)


def drawn_by_emulators(
    study: Study, adaptive: Adaptive, coded: Array, draws: int, random: np.random.Generator
) -> Array:
    """Responses (d, n, m) at coded points (n, k), with the pick's categories, of functions drawn from the emulators; they scatter
    about the means as much more than the emulators say as runs that were left out did."""
    emulators = adaptive.found.emulators
    beside = np.tile(_coded_levels(study, adaptive.study.levels), (len(coded), 1))
    at = np.hstack([coded / region_of(study), beside])
    means = emulators.predict(at)[0]
    return np.asarray(means + emulators.stretch * (emulators.draws(draws, random)(at) - means))


def levels_at(study: Study, point: Array) -> tuple[int, ...]:
    """Places of the categories' values at a point (k + c,) of the search."""
    counts = [len(each.categories) for each in study.file.category]
    coded = point[len(study.factors) :].tolist()
    return tuple(round(0.5 * (x + 1.0) * (count - 1)) for x, count in zip(coded, counts, strict=True))


def _coded_levels(study: Study, levels: tuple[int, ...]) -> list[float]:
    counts = [len(each.categories) for each in study.file.category]
    return [2.0 * place / (count - 1) - 1.0 for place, count in zip(levels, counts, strict=True)]


def _design_at(study: Study, simulations: Simulations) -> Runs:
    words = ", ".join(study.categories.values())
    ordered = ordered_runs(study)
    ordered = replace(ordered, labels=[f"{label} with {words}" for label in ordered.labels])
    return runs_of(study, ordered, simulations, simulations.progress(f"design runs with {words}"))


def _at_levels(study: Study, front: SimulatedFront, levels: tuple[int, ...]) -> SimulatedFront:
    """The points of a front with categories at these places, in numbers alone."""
    rows = np.flatnonzero([levels_at(study, point) == levels for point in front.points])
    parts = ("points", "values", "standard_errors", "costs", "cost_errors", "freedom")
    some = {name: getattr(front, name)[rows] for name in parts}
    some["points"] = some["points"][:, : len(study.factors)]
    failures = front.failures[:, : len(study.factors)]
    return replace(front, **some, failures=failures, pick=int(np.flatnonzero(rows == front.pick)[0]))


def region_in_units(study: Study) -> Region:
    """The region of the design as -1 to 1, its points at the resolution of the drawing."""
    half = region_of(study) * study.step
    finest = np.array([factor.finest or np.nan for factor in study.file.factor]) / half
    apart = np.where(np.isnan(finest), ALIKE, finest * (1.0 + 1e-9))
    levels = tuple(len(each.categories) for each in study.file.category)
    one, between = np.ones(half.size + len(levels)), np.array([2.0 / (count - 1) for count in levels])
    origin = np.append(-study.centre / half, -np.ones(len(levels)))
    inactive = tuple(
        (category, place, tuple(map(study.factors.index, names)))
        for category, each in enumerate(study.file.category)
        for place in range(len(each.categories))
        if (names := each.inactive_at(place))
    )
    return Region(-one, one, origin, np.append(finest, between), np.append(apart, 0.5 * between), levels, inactive)


def border_of(study: Study) -> Border | None:
    """How far the region may grow; None where it may not at all. Raises InputError where it would have to shrink."""
    reach = region_of(study) * study.step
    inside = np.column_stack([study.centre - reach, study.centre + reach])
    ends = np.array([factor.allowed or own for factor, own in zip(study.file.factor, inside.tolist(), strict=True)])
    slack = 1e-9 * reach
    refuse(
        f"{study.path}: factor.allowed of {name} = {given.tolist()}: must reach over the region of the design, {own[0]:.6g} to "
        f"{own[1]:.6g}; widen it or narrow the design"
        for name, given, own, off in zip(study.factors, ends, inside, slack, strict=True)
        if given[0] > own[0] + off or given[1] < own[1] - off
    )
    if not study.file.adaptive.extend or all(factor.allowed is None for factor in study.file.factor):
        return None

    def possible(corners: Array) -> bool:
        try:
            for corner in corners:
                numbers = study.centre + reach * corner[: reach.size]
                (scene,) = clearance.adaptive_scenes(study.at(levels_at(study, corner)), numbers[None], [2], 0)
                if 1e3 * scene.mounted_clearance_mm < study.file.adaptive.least_clearance_um:
                    return False
        except InputError:
            return False
        return True

    low, high = (ends - study.centre[:, None]).T / reach
    levels = np.ones(len(study.file.category))
    return Border(np.append(low, -levels), np.append(high, levels), possible)


def advice(study: Study, surfaces: list[Surface]) -> list[str]:
    """Where surfaces miss more than noise explains, what the adaptive search would bring; else nothing."""
    lacking = [each.name for each in surfaces if (p := each.lack_of_fit["p"]) is not None and p < SIGNIFICANT]
    if not lacking:
        return []
    design = len(design_of(study).coded)
    return [
        f"lack of fit is significant for {', '.join(lacking)}: the front on the surfaces misses what bends there; --adaptive "
        f"would search it with emulators of the simulator, in {max(study.file.adaptive.budget - design, 0)} runs beyond the {design} "
        "of the design"
    ]


class _Evaluator(Evaluator):
    """Runs batches of points with replicates of their own; the bar shows where the search stands."""

    def __init__(self, study: Study, simulations: Simulations, total: int) -> None:
        super().__init__(study, simulations, simulations.progress("adaptive front"), total)

    def report(self, state: Batch, done: int, total: int) -> None:
        """A new bar a batch."""
        left = 100.0 * state.left / max(state.hypervolume, 1e-300)
        words = f"adaptive front: hypervolume {state.hypervolume:.3f}, at most {left:.1f} % to gain"
        self._progress = self._simulations.progress(words)

    def __call__(self, points: Array, replicates: Whole) -> tuple[Array, Array, Whole]:
        """Responses (n, m), their standard errors (n, m) and the degrees of freedom (n, m) of these."""
        # As a drawing writes them: no trace of how they were worked out.
        scenes = []
        for number, (point, count) in enumerate(zip(points, replicates.tolist(), strict=True), self.done):
            drawn = self._study.rounded(point[: len(self._study.factors)])
            study = self._study.at(levels_at(self._study, point))
            scenes += clearance.adaptive_scenes(study, drawn[None], [count], number)
        values, errors, samples = self.run(scenes, "adaptive run")
        return values, standard_errors(errors, samples), np.maximum(samples - 1, 0)


def _known(study: Study, each: Mapping[tuple[int, ...], Runs], plan: Plan) -> Known:
    """The runs of all designs as the search wants them."""
    parts = []
    for levels, runs in each.items():
        number = independent_values(runs)
        errors, count = standard_errors(runs.errors, number), len(runs.coded)
        points = np.hstack([runs.coded / region_of(study), np.tile(_coded_levels(study, levels), (count, 1))])
        parts.append(Known(points, runs.values, errors, np.maximum(number - 1, 0), np.full(count, plan.usual)))
    return reduce(Known.plus, parts)


def _about(study: Study, found: AdaptiveFront, levels: tuple[int, ...]) -> Samples:
    """What the emulators say about the finalists, in factor units: it stands for runs where slopes are asked for."""
    reach, factors = region_of(study), len(study.factors)
    offsets = HALF_LEVEL * (2.0 * qmc.Sobol(factors, seed=found.front.seed).random_base2(ABOUT) - 1.0)
    coded = (study.coded(found.front.points[:, :factors])[:, None] + offsets).reshape(-1, factors)
    beside = np.tile(_coded_levels(study, levels), (len(coded), 1))
    means, deviations = found.emulators.predict(np.hstack([coded / reach, beside]))
    return Samples(study.actual(coded), means, deviations)


@dataclass(frozen=True, eq=False)
class Compared:
    """Hypervolumes between ``ideal`` and ``nadir`` (q,), in costs, of the predicted front.

    By the last emulators: ``search`` (b,), of the predicted fronts before every batch and after the last, and ``surfaces``, of
    the polynomials' front as it is drawn. By the simulator, with its standard error: ``fresh``, of the search's points by
    their fresh runs.
    """

    ideal: Array
    nadir: Array
    search: Array
    surfaces: float
    fresh: tuple[float, float]


def compared(study: Study, adaptive: Adaptive, on_surfaces: Array) -> Compared:
    """Fronts of a search and of the surfaces, (n, k) in factor units, on one scale."""
    found, goals = adaptive.found, adaptive.found.front.goals
    costs = goals.costs(found.predictions)
    best = costs[non_dominated(costs)]
    scale = best.min(axis=0), best.max(axis=0)
    return Compared(
        *scale,
        search=np.array([hypervolume(goals.costs(found.emulators.predict(each)[0]), *scale) for each in found.fronts]),
        surfaces=hypervolume(predicted_costs(study, adaptive, on_surfaces), *scale),
        fresh=noisy_hypervolume(found.front.costs, found.front.cost_errors, *scale, DRAWS, found.front.seed),
    )


AWAY = 0.1  # of the range of a factor: so far to both sides of the pick the emulators are asked
LITTLE = 0.01  # of the range of a cost on the front: what changes less does not pull


class Pull(NamedTuple):
    """A factor of the pick: the responses that get better with ``more`` of it, those with ``less``, those that ``turn``
    there. ``face``: that of the region searched it lies at, None inside."""

    factor: str
    at: float
    more: list[str]
    less: list[str]
    turn: list[str]
    face: Face | None


def pulls(study: Study, adaptive: Adaptive, pick: Array) -> list[Pull]:
    """How the responses with a goal pull at every factor of a point (k,) in factor units."""
    names = [study.responses[index] for index in goals_of(study).objectives]
    span = np.ptp(adaptive.found.front.goals.costs(adaptive.found.predictions), axis=0)
    found = []
    for index, (low, high) in enumerate(adaptive.edges.tolist()):
        sides = np.clip(pick[index] + AWAY * (high - low) * np.array([-1.0, 0.0, 1.0]), low, high)
        at = np.tile(pick, (3, 1))
        at[:, index] = sides
        below, here, above = predicted_costs(study, adaptive, at) / np.where(span > 0.0, span, 1.0)
        more = (here - above > LITTLE) & (above < below)
        less = (here - below > LITTLE) & (below <= above)
        turn = ~more & ~less & (np.maximum(above, below) - here > LITTLE)
        ways = [[name for name, one in zip(names, each, strict=True) if one] for each in (more, less, turn)]
        at_face = _face(study, adaptive, index, float(pick[index]))
        found.append(Pull(study.factors[index], float(pick[index]), ways[0], ways[1], ways[2], at_face))
    return found


def _face(study: Study, adaptive: Adaptive, index: int, at: float) -> Face | None:
    """The face that a factor lies at, as the search left it; where its own pick lay elsewhere, the "end" of the region that was
    searched, if that might have grown."""
    low, high = adaptive.edges[index].tolist()
    allowed = study.file.factor[index].allowed if study.file.adaptive.extend else None
    for side, end in ((-1, low), (1, high)):
        if abs(at - end) <= NEAR * (high - low):
            known = (face for face in adaptive.found.faces if (face.factor, face.side) == (index, side))
            open_end = allowed is not None and abs(allowed[int(side > 0)] - end) > NEAR * (high - low)
            return next(known, Face(index, side, float("nan"), float("nan"), "end" if open_end else "allowed"))
    return None


def near_limits(adaptive: Adaptive, study: Study, limits: Sequence[Limit]) -> list[Limit]:
    """The limits that have next to no room left, against the range of the response over all runs."""
    ranges = dict(zip(study.responses, np.ptp(adaptive.found.emulators.runs.values, axis=0).tolist(), strict=True))
    return [limit for limit in limits if limit.room <= NEAR * ranges[limit.response]]
