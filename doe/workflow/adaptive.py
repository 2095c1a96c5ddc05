"""The adaptive search: emulators learn the simulator, and each run goes where its expected gain is largest.

Its front is compared with that on the surfaces on one scale. Factor by factor, the responses pull the pick to either side.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.stats import qmc

from doe import clearance
from doe.adaptive import AdaptiveFront, AdaptiveSearch, Batch, Border, Plan
from doe.adaptive import Runs as SearchRuns
from doe.adaptive.emulators import Region
from doe.adaptive.search import NEAR, Face, check_budget
from doe.clearance import Simulations
from doe.duty import Run, scenes_of
from doe.pareto.front import NOISE_DRAWS, Samples, SimulatedFront, noisy_hypervolume
from doe.pareto.search import InfeasibleError, hypervolume, non_dominated
from doe.response_surface.statistics import lack_of_fit_tests
from doe.running.store import Failure, grouped
from doe.workflow.confirmation import Limit
from doe.workflow.front import named_faults
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs, independent_values, standard_errors
from rbdyn.base.arrays import Array, Whole, one_thread
from rbdyn.base.faults import InputError, MethodError, RunError, refuse
from rbdyn.base.records import Record
from rbdyn.base.words import NORMAL, all_of, counted

SIGNIFICANT = 0.05
# Share of the half range of the region within which points are twins, if the drawing has no resolution.
ALIKE = 0.01
# Points about a finalist at which the emulators predict, for its tolerances: 2^6 within half a level of the design.
ABOUT, HALF_LEVEL = 6, 0.5


class Adaptive(Record, eq=False):
    """The front of an adaptive search, its failed runs and its wall time [s].

    ``edges`` (k, 2): ends of the finally searched region in factor units. ``front``: the finalists of ``search``.
    """

    name: ClassVar[str] = "adaptive"
    search: AdaptiveFront
    front: SimulatedFront
    edges: Array
    failures: tuple[Failure, ...]
    seconds: float


class Evaluator:
    """Runs batches of points, each with its number of replicates and its own seed: a running number.

    A repeated search asks for the same runs in the same order, and the store answers at once. The bar shows the state of the search.
    """

    def __init__(self, study: Problem, simulations: Simulations, total: int, title: str = "adaptive front") -> None:
        self._study, self._simulations = study, simulations
        self._progress, self._total = simulations.progress(title), total
        self.done = 0
        self.failures: list[Failure] = []

    def run(self, runs: Sequence[Run], label: str) -> tuple[Array, Array, Whole]:
        """Responses (n, m) of runs, their 95 % half-widths (n, m) and sample sizes (n, m); NaN for a failed run."""
        labels = [f"{label} {self.done + row}" for row in range(1, len(runs) + 1)]
        results = self._simulations.run(runs, labels, self._watch)
        self.done += len(runs)
        self.failures += [result for result in results if isinstance(result, Failure)]
        return clearance.figures(self._study.responses, results)

    def _watch(self, count: int, total: int) -> None:
        points = max(len(self._study.shares), 1)
        self._progress(points * self.done + count, max(points * self._total, points * self.done + total))

    def report(self, state: Batch, count: int, total: int) -> None:
        """A new bar for each batch."""
        gain_percent = 100.0 * state.remaining / max(state.hypervolume, 1e-300)
        words = f"adaptive front: hypervolume {state.hypervolume:.3f}, about {gain_percent:.1f} % to gain"
        self._progress = self._simulations.progress(words)

    def __call__(self, points: Array, replicates: Whole) -> tuple[Array, Array, Whole]:
        """Responses (n, m), their standard errors (n, m) and the degrees of freedom (n, m) of these; NaN for a failed run."""
        # Points at the resolution of the drawing, whatever their last bits were.
        scenes = []
        for number, (point, count) in enumerate(zip(points, replicates.tolist(), strict=True), self.done):
            scenes += self._study.adaptive_scenes(self._study.rounded(point)[None], [count], number)
        values, errors, samples = self.run(scenes, "adaptive run")
        return values, standard_errors(errors, samples), np.maximum(samples - 1, 0)


def check_adaptive(study: Problem) -> None:
    """Raises InputError for an impossible search."""
    border_of(study)
    study.adaptive_scenes(study.baseline[None], [Plan.least], 0)
    try:
        check_budget(plan_of(study), len(study.design.coded))
    except MethodError as error:
        raise InputError(f"{study.path}: adaptive.{error}") from None


def plan_of(study: Problem) -> Plan:
    """Settings of the search; a fresh run at a finalist has all replicates of the scene."""
    settings = study.file.adaptive
    usual = study.usual_replicates
    return Plan(settings.budget, settings.batch, settings.seed, usual=usual, pick=study.file.front.pick)


@one_thread
def find_adaptive(study: Problem, runs: Runs, simulations: Simulations) -> Adaptive:
    """Search the front, beginning with the runs of the design, in batches that do not depend on the number of workers.

    Raises RunError if the runs of a stage fail, InputError for impossible settings or limits, KeyboardInterrupt.
    """
    plan, goals, start_s = plan_of(study), study.goals, time.perf_counter()
    first_runs = _design_runs(study, runs)
    evaluator = Evaluator(study, simulations, plan.budget - len(first_runs.points))
    centre, region, step, border = study.centre, region_in_units(study), study.half_ranges, border_of(study)
    lost = None if study.remaining is None else study.remaining.failed / study.reach
    with named_faults(study, lambda point: point, ""):
        try:
            search = AdaptiveSearch(
                evaluator, centre, step, region, first_runs, goals, plan, study.baseline, evaluator.report, border, lost
            ).front()
        except InfeasibleError:
            raise
        except MethodError as error:
            if evaluator.failures:
                causes = "; ".join(group.cause for group in grouped(evaluator.failures))
                raise RunError(f"adaptive front: {error} ({causes})") from None
            raise InputError(f"{study.path}: adaptive.{error}") from None
    ends = np.column_stack([search.region.low, search.region.high])
    edges = centre[:, None] + step[:, None] * ends
    front = replace(search.front, searched=_samples_about_finalists(study, search))
    return Adaptive(search, front, edges, tuple(evaluator.failures), time.perf_counter() - start_s)


def predicted_costs(study: Problem, adaptive: Adaptive, points: Array) -> Array:
    """Costs (n, q) that the emulators predict at points (n, k) of the drawing."""
    search = adaptive.search
    means, _ = search.emulators.predict(search.region.snap(study.coded(points) / study.reach))
    return adaptive.front.goals.costs(means)


def emulator_draws(study: Problem, adaptive: Adaptive, coded: Array, draws: int, random: np.random.Generator) -> Array:
    """Responses (d, n, m) at coded points (n, k), of functions drawn from the emulators.

    Their scatter about the means is stretched by the errors of the emulators at runs that were left out.
    """
    emulators = adaptive.search.emulators
    points = coded / study.reach
    means = emulators.predict(points)[0]
    return np.asarray(means + emulators.stretch * (emulators.draws(draws, random)(points) - means))


def region_in_units(study: Problem) -> Region:
    """The region of the design, from -1 to 1, with its points at the resolution of the drawing."""
    half = study.half_ranges
    finest = np.array([factor.finest or np.nan for factor in study.file.factor]) / half
    apart = np.where(np.isnan(finest), ALIKE, finest * (1.0 + 1e-9))
    ones = np.ones(half.size)
    return Region(-ones, ones, -study.centre / half, finest, apart)


def border_of(study: Problem) -> Border | None:
    """Ends to which the region may grow; None if it may not. Raises InputError if ``allowed`` lies inside the region."""
    reach, region_ends = study.half_ranges, study.ends
    ends = np.array(
        [factor.allowed or bounds for factor, bounds in zip(study.file.factor, region_ends.tolist(), strict=True)]
    )
    slack = 1e-9 * reach
    refuse(
        f"{study.path}: factor.allowed of {name} = {allowed.tolist()}: must reach over the region of the design, {bounds[0]:.6g} to "
        f"{bounds[1]:.6g}; widen it or narrow the design"
        for name, allowed, bounds, margin in zip(study.factors, ends, region_ends, slack, strict=True)
        if allowed[0] > bounds[0] + margin or allowed[1] < bounds[1] - margin
    )
    if not study.file.adaptive.extend or all(factor.allowed is None for factor in study.file.factor):
        return None

    def possible(corners: Array) -> bool:
        try:
            for corner in corners:
                (run,) = study.adaptive_scenes((study.centre + reach * corner)[None], [Plan.least], 0)
                least_mm = min(scene.mounted_clearance_mm for scene in scenes_of(run))
                if 1e3 * least_mm < study.file.adaptive.least_clearance_um:
                    return False
        except InputError:
            return False
        return True

    low, high = (ends - study.centre[:, None]).T / reach
    return Border(low, high, possible)


def advice(study: Problem) -> list[str]:
    """Advice to search adaptively, for surfaces whose lack of fit is significant by every test; else none."""
    lacking = [
        surface.name
        for surface in study.surfaces
        if (tests := lack_of_fit_tests(surface)) and max(tests.values()) < SIGNIFICANT
    ]
    if not lacking:
        return []
    design = len(study.design.coded)
    where = "every response" if len(lacking) == len(study.surfaces) > 1 else all_of(lacking)
    return [
        f"The predicted front is biased by lack of fit in {where}. Use --adaptive "
        f"({counted(max(study.file.adaptive.budget - design, 0), 'more run')})"
    ]


def _design_runs(study: Problem, runs: Runs) -> SearchRuns:
    """The runs of the design as samples of the search."""
    number = independent_values(runs)
    errors, replicates = standard_errors(runs.errors, number), np.full(len(runs.coded), runs.replicates_a_point)
    return SearchRuns(runs.coded / study.reach, runs.values, errors, np.maximum(number - 1, 0), replicates)


def _samples_about_finalists(study: Problem, search: AdaptiveFront) -> Samples:
    """Predictions of the emulators about the finalists, in factor units; slopes of the front are taken from them."""
    factors = len(study.factors)
    offsets = HALF_LEVEL * (2.0 * qmc.Sobol(factors, seed=search.front.seed).random_base2(ABOUT) - 1.0)
    coded = (study.coded(search.front.points)[:, None] + offsets).reshape(-1, factors)
    means, deviations = search.emulators.predict(coded / study.reach)
    return Samples(study.actual(coded), means, deviations)


class FreshVolume(Record):
    """Hypervolume of the points of a search by their fresh runs, with a 95 % half width."""

    hypervolume: float
    error: float


class FrontComparison(Record):
    """Hypervolumes of fronts between one ``ideal`` and ``nadir``, those of the predicted front, in costs by response.

    By the last emulators: ``search``, of the predicted fronts before every batch and after the last; ``surfaces``, of
    the front on the surfaces at the resolution of the drawing. By the simulator: ``fresh``, of the finalists.
    """

    ideal: dict[str, float]
    nadir: dict[str, float]
    search: list[float]
    surfaces: float
    fresh: FreshVolume


def compare_fronts(study: Problem, adaptive: Adaptive, on_surfaces: Array) -> FrontComparison:
    """Fronts of a search and of the surfaces, (n, k) in factor units, on one scale."""
    search, goals = adaptive.search, adaptive.search.front.goals
    costs = goals.costs(search.predictions)
    best = costs[non_dominated(costs)]
    scale = best.min(axis=0), best.max(axis=0)
    ideal, nadir = (dict(zip(study.aims, ends.tolist(), strict=True)) for ends in scale)
    front = search.front
    fresh, error = noisy_hypervolume(front.costs, front.cost_errors, *scale, NOISE_DRAWS, front.seed)
    return FrontComparison(
        ideal,
        nadir,
        [hypervolume(goals.costs(search.emulators.predict(points)[0]), *scale) for points in search.fronts],
        hypervolume(predicted_costs(study, adaptive, on_surfaces), *scale),
        FreshVolume(fresh, NORMAL * error),
    )


AWAY = 0.1  # share of a factor's range to both sides of the pick at which the emulators predict
LITTLE = 0.01  # share of a cost's range on the front; a smaller change does not pull


class Pull(NamedTuple):
    """A factor of the pick: responses that improve with ``more`` of it, with ``less``, or that ``turn`` at it.

    ``face``: the face of the searched region at which the factor lies; None inside.
    """

    factor: str
    value: float
    more: list[str]
    less: list[str]
    turn: list[str]
    face: Face | None


def pulls(study: Problem, adaptive: Adaptive, pick: Array) -> list[Pull]:
    """For each factor of a point (k,) in factor units, the directions in which the responses with a goal improve."""
    span = np.ptp(adaptive.search.front.goals.costs(adaptive.search.predictions), axis=0)
    factor_pulls = []
    for index, (low, high) in enumerate(adaptive.edges.tolist()):
        sides = np.clip(pick[index] + AWAY * (high - low) * np.array([-1.0, 0.0, 1.0]), low, high)
        points = np.tile(pick, (3, 1))
        points[:, index] = sides
        costs_below, costs_here, costs_above = predicted_costs(study, adaptive, points) / np.where(
            span > 0.0, span, 1.0
        )
        more = (costs_here - costs_above > LITTLE) & (costs_above < costs_below)
        less = (costs_here - costs_below > LITTLE) & (costs_below <= costs_above)
        turn = ~more & ~less & (np.maximum(costs_above, costs_below) - costs_here > LITTLE)
        ways = [[name for name, flag in zip(study.aims, mask, strict=True) if flag] for mask in (more, less, turn)]
        at_face = _face(study, adaptive, index, float(pick[index]))
        factor_pulls.append(Pull(study.factors[index], float(pick[index]), ways[0], ways[1], ways[2], at_face))
    return factor_pulls


def _face(study: Problem, adaptive: Adaptive, index: int, position: float) -> Face | None:
    """The face at which a factor lies, as the search ended; None inside.

    If the search's own pick lay elsewhere, it is the "end" of a region that might have grown, or the "allowed" end.
    """
    low, high = adaptive.edges[index].tolist()
    allowed = study.file.factor[index].allowed if study.file.adaptive.extend else None
    for side, end in ((-1, low), (1, high)):
        if abs(position - end) <= NEAR * (high - low):
            faces = (face for face in adaptive.search.faces if (face.factor, face.side) == (index, side))
            open_end = allowed is not None and abs(allowed[int(side > 0)] - end) > NEAR * (high - low)
            return next(faces, Face(index, side, float("nan"), float("nan"), "end" if open_end else "allowed"))
    return None


def near_limits(adaptive: Adaptive, study: Problem, limits: Sequence[Limit]) -> list[Limit]:
    """The limits of responses whose room is within `NEAR` of the response's range over all runs."""
    ranges = dict(zip(study.responses, np.ptp(adaptive.search.emulators.runs.values, axis=0).tolist(), strict=True))
    return [limit for limit in limits if limit.response in ranges and limit.room <= NEAR * ranges[limit.response]]
