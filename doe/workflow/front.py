"""The Pareto front of a study on its response surfaces, its uncertainty, and the tolerance-aware front.

A point backs off from a limit by the errors of its prediction. Of the parts made about a point, the share that keeps its
gains has an interval.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import product
from typing import NamedTuple, TypeVar

import numpy as np
from scipy import special

from doe.pareto import InfeasibleError, ParetoFront, front, manufacture
from doe.pareto.front import FrontUncertainty, front_uncertainty
from doe.pareto.search import Archive, Doubt, dominates
from doe.pareto.tolerance import PartCount
from doe.response_surface import Surface
from doe.response_surface.adequacy import correlation
from doe.workflow.confirmation import Confirmed, run_where_possible
from doe.workflow.problem import Problem
from doe.workflow.surfaces import Simulated, draw_all, drawn_responses, predict_all, predict_draws, quadratics
from rbdyn.base.arrays import Array, Rows, one_thread
from rbdyn.base.faults import InputError, MethodError, given
from rbdyn.base.words import all_of

# Shares of the back-off from limits: the search takes the largest that any point keeps.
SHARES = (1.0, 0.5, 0.25, 0.0)
# Why a point is the pick that no other comes nearer to the limits than.
CLOSEST = "the point of the region that is expected to violate the limits least"
# Keys of [front] that are arguments of the searches.
SEARCH = {"population", "generations", "seed", "pick"}
AnyFront = TypeVar("AnyFront", ParetoFront, manufacture.ToleranceAware)


@one_thread
def find_front(study: Problem, simulated: Sequence[Confirmed] = (), failed: int = 0) -> ParetoFront:
    """The Pareto front on the surfaces with its uncertainty, and the tolerance-aware front if the study asks for it.

    Its points keep every limit with the probability that the study asks for. The back-off follows from the standard
    errors of the surfaces and from their misses at points ``simulated``; it shrinks where no point keeps all of it. Each
    of the ``failed`` earlier picks shows that the errors are larger: the back-off grows by its own size. Surfaces that exceed
    a limit everywhere are corrected by their misses at the simulated points.

    Where no point keeps all limits, the front is the point that is expected to miss them least (see `ParetoFront.violations`).
    Raises InputError when fewer than two responses have a goal, or a tolerance is missing.
    """
    goals, settings, reach = study.goals, study.file.front, study.reach
    check_goals(study)
    box = tolerance_box(study)
    doubt, remaining = SurfaceDoubt(study, simulated), study.remaining

    def plain(errors: Doubt, closest: bool = False) -> ParetoFront:
        return front(
            lambda points: predict_all(study.surfaces, study.coded(points)),
            study.actual(-reach),
            study.actual(reach),
            goals=goals,
            baseline=study.baseline,
            **settings.model_dump(include=SEARCH),
            doubt=lambda points: errors(study.coded(points)),
            closest=closest,
            barred=None if remaining is None else lambda points: remaining.excess(study.coded(points)),
        )

    with named_faults(study, lambda point: point, ""):
        try:
            pareto = _backed_off(study, plain, doubt, failed)
        except InfeasibleError:
            # Before any point is simulated nothing is expected but the surfaces.
            pareto = replace(plain(doubt.at_share(0.0, doubt.corrected), closest=True), pick_reason=CLOSEST)
    pareto = replace(pareto, uncertainty=_uncertainty(study, pareto))
    if box is None or pareto.violations is not None:
        return pareto
    with named_faults(study, study.actual, " after manufacture"):
        try:
            aware = _backed_off(study, partial(_tolerance_aware, study, pareto, box), doubt, failed)
        except InfeasibleError as error:
            return replace(pareto, tolerance_violations=error.violations)
    return replace(pareto, tolerance_aware=aware)


@one_thread
def with_survival(study: Problem, pareto: ParetoFront, confirmed: Mapping[str, Confirmed] | None = None) -> ParetoFront:
    """The front with the intervals of the shares of parts that dominate the baseline.

    The ``confirmed`` points, which were simulated, narrow the errors of the surfaces.
    """
    aware = pareto.tolerance_aware
    if aware is None:
        return pareto
    draws, found = draws_of(study, confirmed), aware.survival
    picks = (study.coded(pareto.points[pareto.pick]), found.plain_pick), (aware.points[aware.pick], found.pick)
    plain, pick = (survival(study, draws, point, aware.box).containing(share) for point, share in picks)
    shares = replace(found, plain_pick_interval=plain, pick_interval=pick, open_errors=open_errors(study.surfaces))
    return replace(pareto, tolerance_aware=replace(aware, survival=shares))


def _backed_off(study: Problem, search: Callable[[Doubt], AnyFront], doubt: "SurfaceDoubt", failed: int) -> AnyFront:
    """The front with the largest share of the back-off that any point keeps, by the surfaces or else by the expected responses.

    Raises InfeasibleError.
    """
    if not study.goals.limited:
        return search(doubt.at_share(0.0))
    shares = (1.0 + failed, *SHARES)[failed == 0 :]
    faults = []
    for expected, share in product((False, True)[: 1 + doubt.corrected], shares):
        try:
            searched = search(doubt.at_share(share, expected))
        except InfeasibleError as fault:
            faults.append(fault)
            continue
        margin = "the margin" if share >= 1.0 else f"{100.0 * share:g} % of the margin"
        words = f"; limits keep {margin} for the required probability of {study.file.confirmation.limit_probability:g}"
        source = ", corrected by the simulated points" if expected else ""
        return replace(searched, pick_reason=searched.pick_reason + words + source)
    raise faults[-1]


def _uncertainty(study: Problem, pareto: ParetoFront) -> FrontUncertainty:
    coefficients = draw_all(study.surfaces, study.file.front.draws, study.file.front.seed)
    points = np.vstack([pareto.points, study.baseline])
    values = predict_draws(study.surfaces, coefficients, study.coded(points), study.file.front.seed)
    baseline = values[:, -1], given(pareto.baseline_values)
    pick = pareto.goals, pareto.values, pareto.pick, study.file.front.pick
    return front_uncertainty(values[:, :-1], *pick, *baseline)


def part_ends(study: Problem) -> Array:
    """Ends (k, 2) of the parts in factor units: those of the region, and beyond by the tolerances where such a bearing is possible."""
    ends, without_scene = study.ends.copy(), run_where_possible(study, study.baseline) is None
    for place, name in enumerate(study.factors):
        for side, sign in enumerate((-1.0, 1.0)):
            point = study.baseline.copy()
            point[place] = ends[place, side] + sign * study.known_tolerances.get(name, 0.0)
            if without_scene or run_where_possible(study, point) is not None:
                ends[place, side] = point[place]
    return ends


def _tolerance_aware(
    study: Problem, pareto: ParetoFront, box: manufacture.ToleranceBox, doubt: Doubt
) -> manufacture.ToleranceAware:
    # Nominal points keep their tolerance away from a bound beyond which no bearing is possible.
    low, high = study.coded(part_ends(study).T)
    return manufacture.tolerance_aware_front(
        quadratics(study.surfaces, len(study.factors)),
        box,
        np.maximum(-study.reach, low + box.half),
        np.minimum(study.reach, high - box.half),
        pareto.goals,
        baseline=study.coded(study.baseline),
        plain=Archive(study.coded(pareto.points), pareto.costs),
        plain_pick=pareto.pick,
        doubt=doubt,
        barred=None if study.remaining is None else study.remaining.excess,
        **study.file.front.model_dump(include=SEARCH),
    )


@contextmanager
def named_faults(study: Problem, actual: Callable[[Array], Array], suffix: str) -> Iterator[None]:
    """Raises OutOfReachError for a search without a feasible point; ``actual`` gives points in factor units."""
    try:
        yield
    except InfeasibleError as error:
        raise out_of_reach(study, actual(error.point), error.violations, suffix) from None
    except MethodError as error:
        raise InputError(f"{study.path}: front{suffix}: {error}") from None


class OutOfReachError(InputError):
    """No point of a search keeps all limits."""


def out_of_reach(study: Problem, point: Array, violations: Array, suffix: str = "") -> OutOfReachError:
    """The fault of a study whose limits no point keeps: the closest ``point`` (k,) in factor units exceeds them by (c,)."""
    excess = excess_words(study, violations)
    position = ", ".join(f"{name} = {x:.5g}" for name, x in study.by_factor(point).items())
    return OutOfReachError(
        [
            f"{study.path}: response.lower, response.upper: no point of the region meets all limits{suffix}. The closest "
            f"({position}) violates {excess}; loosen a limit or widen the design"
        ]
    )


def tolerances_out_of_reach(study: Problem, violations: Array) -> str:
    """That no point keeps all limits within the factors' own tolerances; the closest exceeds them by ``violations`` (c,)."""
    return (
        "No point meets all limits at the ends of the factors' own tolerances: the closest violates "
        f"{excess_words(study, violations)}."
    )


def excess_words(study: Problem, violations: Array) -> str:
    """'impact_force_N <= 40 by 3.2' of the limits that are exceeded, by their excess (c,)."""
    # Where runs failed, the last of the violations is that of no limit.
    by_limit = zip(study.goals.limited, violations.tolist(), strict=False)
    return all_of(
        f"{study.responses[index]} {sense} {limit:g} by {violation:.4g}"
        for (index, sense, limit), violation in by_limit
        if violation > 0.0
    )


def check_goals(study: Problem) -> None:
    """Raises InputError for a study without a front: too few goals, or no tolerances for the tolerance-aware one."""
    if len(study.goals.objectives) < 2:
        limited = [study.responses[index] for index in dict.fromkeys(index for index, _, _ in study.goals.limited)]
        hint = f'; {", ".join(limited)} may be one: write goal = "min" with its limit' if limited else ""
        raise InputError(f"{study.path}: response: a front needs two responses with a goal; add a second one{hint}")
    tolerance_box(study)


def tolerance_box(study: Problem) -> manufacture.ToleranceBox | None:
    """Parts of the tolerance-aware front; None where the study asks for none. Raises as ``study.coded_tolerances``."""
    front = study.file.front
    if front.tolerance_aware == "none":
        return None
    return manufacture.ToleranceBox(study.coded_tolerances, front.tolerance_aware, front.quantile, front.distribution)


SCALES = np.geomspace(1.0, 100.0, 81)  # factors on the standard errors, compared by the likelihood of the misses
MOST_RUNS = 300  # design runs whose misses count; evenly spread if there are more


class Misses(NamedTuple):
    """Simulated less predicted values of one response at coded points (c, k): ``misses`` (c,).

    ``errors`` and ``forecast_errors`` (c,) are the standard errors of simulation and prediction.
    """

    points: Array
    misses: Array
    errors: Array
    forecast_errors: Array

    def joined(self, other: "Misses") -> "Misses":
        """Those of both."""
        return Misses(*map(np.concatenate, zip(self, other, strict=True)))


class ErrorField:
    """The error of a prediction as a Gaussian field, conditioned on its misses; ``more``: the standard error of one more simulation, which counts too."""

    def __init__(self, misses: Misses, more: float = 0.0) -> None:
        prior = correlation(misses.points, misses.points) * np.outer(misses.forecast_errors, misses.forecast_errors)
        self._misses, self._noise, self._more = misses, np.diag(misses.errors**2), more
        self._scale = _scale(prior, self._noise, misses.misses)
        self._solve = np.linalg.pinv(self._scale**2 * prior + self._noise, hermitian=True)

    def __call__(self, coded: Array, forecast_errors: Array) -> tuple[Array, Array]:
        """Mean (n,) and standard deviation (n,) of the error at coded points (n, k); ``forecast_errors`` (n,) are those stated."""
        stated = np.outer(forecast_errors, self._misses.forecast_errors)
        link = self._scale**2 * correlation(coded, self._misses.points) * stated
        projected = link @ self._solve
        variance = (self._scale * forecast_errors) ** 2 - (projected * link).sum(axis=1)
        return projected @ self._misses.misses, np.hypot(np.sqrt(variance.clip(0.0)), self._more)


class SurfaceDoubt:
    """Errors of the surfaces of limited responses, from the misses at the design runs and at points ``simulated``."""

    def __init__(self, study: Problem, simulated: Sequence[Confirmed] = ()) -> None:
        self._surfaces, self._probability = study.surfaces, study.file.confirmation.limit_probability
        self._fields: dict[int, ErrorField] = {}
        # Points outside the design's runs are known.
        self.corrected = bool(simulated)
        for index in sorted({index for index, _, _ in study.goals.limited}):
            surface = study.surfaces[index]
            all_misses, error = _at_design(surface), 0.0
            if simulated:
                coded = study.coded(np.array([point.point for point in simulated]))
                errors = standard_errors_of(simulated)[:, index]
                misses = np.array([point.values[index] for point in simulated]) - surface.predict(coded)
                more = Misses(coded, misses, errors, surface.prediction_standard_error(coded))
                all_misses, error = all_misses.joined(more), float(errors.max())
            self._fields[index] = ErrorField(all_misses, error)

    def _off(self, index: int, coded: Array) -> tuple[Array, Array]:
        """Mean (n,) and standard deviation (n,) of a response less its surface."""
        return self._fields[index](coded, self._surfaces[index].prediction_standard_error(coded))

    def at_share(self, share: float, expected: bool = False) -> Doubt:
        """Range in which the responses lie with the study's probability, or a share of it.

        About the ``expected`` responses it may keep a limit that the surface exceeds.
        """

        def doubt(coded: Array) -> tuple[Array, Array]:
            shift, margin = self._shift_and_margin(coded)
            if expected:
                return share * margin - shift, share * margin + shift
            # The back-off never loosens a limit: the surface itself keeps it too.
            return share * (margin - shift).clip(0.0), share * (margin + shift).clip(0.0)

        return doubt

    def _shift_and_margin(self, coded: Array) -> tuple[Array, Array]:
        """Expected responses less the surfaces (n, m) at coded points (n, k), and the margin for the study's probability."""
        shift, margin = np.zeros((2, len(coded), len(self._surfaces)))
        for index in self._fields:
            quantile = float(special.stdtrit(self._surfaces[index].interval_dof, self._probability))
            shift[:, index], deviation = self._off(index, coded)
            margin[:, index] = quantile * deviation
        return shift, margin

    def kept_with(self, index: int, sense: str, bound: float, coded: Array) -> float:
        """Probability with which a limited response keeps a bound ("<=" or ">=") at a coded point (k,)."""
        shift, deviation = (float(array[0]) for array in self._off(index, coded[None]))
        room = bound - float(self._surfaces[index].predict(coded)) - shift
        room = room if sense == "<=" else -room
        if deviation == 0.0:
            return float(room >= 0.0)
        return float(special.stdtr(self._surfaces[index].interval_dof, room / deviation))


def standard_errors_of(simulated: Sequence[Confirmed]) -> Array:
    """Standard errors (c, m) of simulated points."""
    return np.array([point.standard_error for point in simulated])


def _at_design(surface: Surface) -> Misses:
    """Misses at the surface's own runs; their errors are those of replicates, of repeated runs, or else the residuals."""
    data = surface.data
    rows = np.unique(np.linspace(0, len(data.values) - 1, MOST_RUNS).round().astype(int))
    if data.standard_errors is not None:
        errors = data.standard_errors
    else:
        pure = surface.pure_error.ms if surface.model_error is not None else None
        variance = surface.residual_mean_square if pure is None else pure
        errors = np.full(len(data.values), np.sqrt(variance if surface.transform is None else 0.0))
    points, misses = data.points[rows], data.values[rows] - surface.predict(data.points[rows])
    return Misses(points, misses, errors[rows], surface.prediction_standard_error(points))


def _scale(prior: Array, noise: Array, misses: Array) -> float:
    """The factor on the stated standard errors that makes the misses most likely; 1 at least."""
    likelihood = []
    for scale in SCALES:
        covariance = scale**2 * prior + noise
        sign, logarithm = np.linalg.slogdet(covariance)
        if sign <= 0:
            return 1.0
        likelihood.append(-0.5 * (logarithm + misses @ np.linalg.solve(covariance, misses)))
    return float(SCALES[int(np.argmax(likelihood))]) if likelihood else 1.0


SURFACE_DRAWS = 500  # draws of the surfaces of all responses
# From coded points (n, k) to their responses (d, n, m) on random draws of the surfaces, some draws at a time.
Draws = Callable[[Array], Iterator[Array]]


def draws_of(study: Problem, confirmed: Mapping[str, Confirmed] | None = None, draws: int = SURFACE_DRAWS) -> Draws:
    """Draws of the surfaces, conditioned on the ``confirmed`` points."""
    points = list((confirmed or {}).values())
    simulated = None
    if points:
        positions, values, errors = (
            np.array([getattr(point, name) for point in points]) for name in ("point", "values", "standard_error")
        )
        simulated = Simulated(study.coded(positions), values, errors)
    return partial(drawn_responses, study.surfaces, draws=draws, seed=study.file.front.seed, simulated=simulated)


def keeping(study: Problem, draws: Draws, point: Array, free: Rows, least_gains: Array) -> PartCount:
    """A count of the parts that gain at least ``least_gains`` (q,) over the baseline in every cost and keep all limits.

    Parts (n, f) are values of the ``free`` factors (f,) about a ``point`` (k,).
    """
    goals = study.goals

    def counts_of(parts: Array) -> Array:
        points = np.tile(point, (len(parts) + 1, 1))
        points[:-1, free] = parts
        points[-1] = study.baseline
        counts = []
        for values in draws(study.coded(points)):
            costs, part_values = goals.costs(values), values[:, :-1]
            gained = [costs[:, :-1, i] <= costs[:, -1:, i] - least for i, least in enumerate(least_gains)]
            kept = (goals.violations(part_values, part_values) <= 0.0).all(axis=2)
            counts.append((np.logical_and.reduce(gained) & kept).sum(axis=1))
        return np.concatenate(counts)

    return counts_of


def survival(study: Problem, draws: Draws, coded: Array, box: manufacture.ToleranceBox) -> manufacture.Interval:
    """Interval of the share of the parts made at a ``coded`` point (k,) that dominate the nominal baseline."""
    goals = study.goals
    parts = coded + box.half * manufacture.even_offsets(manufacture.SURVIVAL_PARTS, box.half.size, box.distribution)
    counts = []
    for values in draws(np.vstack([parts, study.coded(study.baseline)])):
        costs = goals.costs(values)
        counts.append(dominates(costs[:, :-1], costs[:, -1:]).sum(axis=1))
    return manufacture.interval_of_share(np.concatenate(counts), len(parts))


def open_errors(surfaces: Sequence[Surface], searched: bool = False) -> str:
    """The errors that the interval of a share of parts holds, and those that it leaves out, in a sentence."""
    source = "search" if searched else "surfaces"
    form = "" if searched or all(surface.model_error for surface in surfaces) else "the form of the surfaces, "
    return (
        f"The interval includes the errors of the {source} and the count of the parts; {form}numerical errors and the scene's "
        "inputs count as exact."
    )
