"""The Pareto front of a study on its response surfaces, how sure it is, and what manufacture leaves of it. How far a pick stays back from a limit because predictions err; shares of the parts
made about a point.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Self, TypeVar

import numpy as np
from scipy import special

from doe.pareto import Goals, InfeasibleError, ParetoFront, front
from doe.pareto.front import FrontUncertainty, front_uncertainty
from doe.pareto.manufacture import (
    SURVIVAL_PARTS,
    Interval,
    ToleranceAware,
    ToleranceBox,
    even_offsets,
    interval_of_share,
    tolerance_aware_front,
)
from doe.pareto.search import Archive, Doubt, dominates
from doe.pareto.tolerance import Kept
from doe.response_surface import Surface
from doe.response_surface.model_error import correlation
from doe.study_file import Study
from doe.threads import one_thread
from doe.workflow.confirmation import Confirmed
from doe.workflow.goals import check_goals, goals_of, region_of, tolerance_box
from doe.workflow.surfaces import Simulated, draw_all, drawn_responses, predict_all, predict_draws, quadratics
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.faults import InputError, MethodError

SCALES = np.geomspace(1.0, 100.0, 81)  # of the standard errors, tried against the misses
MOST_RUNS = 300  # design runs whose misses count; of more, evenly spread ones


@dataclass(frozen=True, eq=False)
class Missed:
    """What was simulated of one response at coded points (c, k) less what was predicted: ``misses`` (c,), with the
    standard errors of the simulation (c,) and of the forecast (c,)."""

    points: Array
    misses: Array
    errors: Array
    stated: Array

    def and_at(self, points: Array, misses: Array, errors: Array, stated: Array) -> Self:
        """With more points."""
        more = zip((self.points, self.misses, self.errors, self.stated), (points, misses, errors, stated), strict=True)
        return type(self)(*(np.concatenate(pair) for pair in more))


class Conditioned:
    """The error of a forecast as a field, given what was missed."""

    def __init__(self, missed: Missed) -> None:
        prior = correlation(missed.points, missed.points) * np.outer(missed.stated, missed.stated)
        self._missed, self._noise = missed, np.diag(missed.errors**2)
        self._scale = _scale(prior, self._noise, missed.misses)
        self._solve = np.linalg.pinv(self._scale**2 * prior + self._noise, hermitian=True)

    def __call__(self, coded: Array, stated: Array) -> tuple[Array, Array]:
        """Mean (n,) and standard deviation (n,) of the error at coded points (n, k) of ``stated`` standard errors (n,)."""
        link = self._scale**2 * correlation(coded, self._missed.points) * np.outer(stated, self._missed.stated)
        projected = link @ self._solve
        left = (self._scale * stated) ** 2 - (projected * link).sum(axis=1)
        return projected @ self._missed.misses, np.sqrt(left.clip(0.0))


class SurfaceDoubt:
    """How far the limited responses may lie off their surfaces, from what these missed at the design runs and at points
    ``simulated``."""

    def __init__(self, study: Study, surfaces: Sequence[Surface], simulated: Sequence[Confirmed] = ()) -> None:
        self._surfaces, self._probability = surfaces, study.file.confirmation.limit_probability
        self._fields: dict[int, Conditioned] = {}
        # The error of one more simulation counts too.
        self._more: dict[int, float] = {}
        for index in sorted({index for index, _, _ in goals_of(study).limited}):
            surface = surfaces[index]
            missed = _at_design(surface)
            if simulated:
                at = study.coded(np.array([each.point for each in simulated]))
                errors = standard_errors_of(simulated)[:, index]
                misses = np.array([each.values[index] for each in simulated]) - surface.predict(at)
                missed = missed.and_at(at, misses, errors, surface.prediction_standard_error(at))
                self._more[index] = float(errors.max())
            self._fields[index] = Conditioned(missed)

    def _off(self, index: int, coded: Array) -> tuple[Array, Array]:
        """Mean (n,) and standard deviation (n,) of what a response lies off its surface."""
        shift, deviation = self._fields[index](coded, self._surfaces[index].prediction_standard_error(coded))
        return shift, np.hypot(deviation, self._more.get(index, 0.0))

    def at_share(self, share: float) -> Doubt:
        """Range in which the responses lie with the study's probability, or a share of it."""

        def doubt(coded: Array) -> tuple[Array, Array]:
            shift, margin = np.zeros((2, len(coded), len(self._surfaces)))
            for index in self._fields:
                quantile = float(special.stdtrit(self._surfaces[index].interval_dof, self._probability))
                shift[:, index], deviation = self._off(index, coded)
                margin[:, index] = quantile * deviation
            # A limit is never loosened: the surface itself keeps it too.
            return share * (margin - shift).clip(0.0), share * (margin + shift).clip(0.0)

        return doubt

    def kept_with(self, index: int, sense: str, bound: float, coded: Array) -> float:
        """Probability with which a limited response keeps a bound ("<=" or ">=") at a coded point (k,)."""
        shift, deviation = (float(each[0]) for each in self._off(index, coded[None]))
        room = bound - float(self._surfaces[index].predict(coded)) - shift
        room = room if sense == "<=" else -room
        if deviation == 0.0:
            return float(room >= 0.0)
        return float(special.stdtr(self._surfaces[index].interval_dof, room / deviation))


def standard_errors_of(simulated: Sequence[Confirmed]) -> Array:
    """Standard errors (c, m) of simulated points."""
    return np.array([each.standard_error for each in simulated])


def _at_design(surface: Surface) -> Missed:
    """What the surface missed at its own runs, whose error is that of their replicates, of repeats, or of all the rest."""
    data = surface.data
    rows = np.unique(np.linspace(0, len(data.values) - 1, MOST_RUNS).round().astype(int))
    if data.standard_errors is not None:
        errors = data.standard_errors
    else:
        pure = surface.pure_error["ms"] if surface.model_error is not None else None
        one = surface.residual_mean_square if pure is None else pure
        errors = np.full(len(data.values), np.sqrt(one if surface.transform is None else 0.0))
    points, misses = data.points[rows], data.values[rows] - surface.predict(data.points[rows])
    return Missed(points, misses, errors[rows], surface.prediction_standard_error(points))


def _scale(prior: Array, noise: Array, misses: Array) -> float:
    """How many times the stated standard errors make the misses most likely; 1 at least."""
    likelihood = []
    for scale in SCALES:
        covariance = scale**2 * prior + noise
        sign, logarithm = np.linalg.slogdet(covariance)
        if sign <= 0:
            return 1.0
        likelihood.append(-0.5 * (logarithm + misses @ np.linalg.solve(covariance, misses)))
    return float(SCALES[int(np.argmax(likelihood))]) if likelihood else 1.0


DRAWS = 500  # surfaces, all responses of one draw together
# Coded points (n, k) to their responses (d, n, m) on drawn surfaces, some draws at a time.
Drawn = Callable[[Array], Iterator[Array]]


def draws_of(
    study: Study, surfaces: Sequence[Surface], confirmed: Mapping[str, Confirmed] | None = None, draws: int = DRAWS
) -> Drawn:
    """Draws of the surfaces; those of points that were simulated pass what was found there."""
    points = list((confirmed or {}).values())
    known = None
    if points:
        at, values, errors = (
            np.array([getattr(each, name) for each in points]) for name in ("point", "values", "standard_error")
        )
        known = Simulated(study.coded(at), values, errors)
    return partial(drawn_responses, surfaces, draws=draws, seed=study.file.front.seed, simulated=known)


def keeping(study: Study, drawn: Drawn, point: Array, free: Rows, least: Array) -> Kept:
    """Counts the parts that gain at least so much (q,) over the baseline in every cost and keep all limits.

    Parts (n, f) are values of the ``free`` factors (f,) about a ``point`` (k,).
    """
    goals = goals_of(study)

    def kept(parts: Array) -> Array:
        points = np.tile(point, (len(parts) + 1, 1))
        points[:-1, free] = parts
        points[-1] = study.baseline
        counts = []
        for values in drawn(study.coded(points)):
            costs, made = goals.costs(values), values[:, :-1]
            good = (costs[:, :-1] <= costs[:, -1:] - least).all(axis=2)
            counts.append((good & (goals.violations(made, made) <= 0.0).all(axis=2)).sum(axis=1))
        return np.concatenate(counts)

    return kept


def surviving(study: Study, drawn: Drawn, coded: Array, box: ToleranceBox) -> Interval:
    """Interval of the share of the parts made at a ``coded`` point (k,) that dominate the nominal baseline."""
    goals = goals_of(study)
    made = coded + box.half * even_offsets(SURVIVAL_PARTS, box.half.size, box.distribution)
    counts = []
    for values in drawn(np.vstack([made, study.coded(study.baseline)])):
        costs = goals.costs(values)
        counts.append(dominates(costs[:, :-1], costs[:, -1:]).sum(axis=1))
    return interval_of_share(np.concatenate(counts), len(made))


def open_errors(surfaces: Sequence[Surface], searched: bool = False) -> str:
    """What the interval of a share of parts holds, and what it takes as exact, in sentences."""
    form = "" if searched or all(surface.model_error for surface in surfaces) else "the form of the surfaces, "
    source = "what the search leaves open" if searched else "the errors of the surfaces"
    return (
        f"The interval holds {source} and the count of the parts; {form}numerical errors and the scene's inputs count as "
        "exact."
    )


Found = TypeVar("Found", "ParetoFront", "ToleranceAware")


# Shares of the back-off from limits that are tried: where no point keeps all of it, the largest that any point keeps.
SHARES = (1.0, 0.5, 0.25, 0.0)
# Keys of [front] that the searches know by the same names.
SEARCH = {"population", "generations", "seed", "pick"}


@one_thread
def find_front(
    study: Study, surfaces: Sequence[Surface], simulated: Sequence[Confirmed] = (), failed: int = 0
) -> ParetoFront:
    """Pareto front on the surfaces within the region of the design, with its uncertainty, and the tolerance-aware one
    where the study asks for it.

    Its points keep every limit with the probability that the study asks for, by the standard errors of the surfaces and
    by what these missed at points ``simulated``; where no point does, with as much of that back-off as any point keeps.
    Each of the ``failed`` points, picked so before and yet not kept, shows the errors to be larger: the back-off grows by
    its own size.

    Raises InputError when fewer than two responses have a goal, no point keeps all limits, or a tolerance is missing.
    """
    goals, settings, reach = goals_of(study), study.file.front, region_of(study)
    check_goals(study)
    box = tolerance_box(study)

    doubt = SurfaceDoubt(study, surfaces, simulated)

    def plain(share: float) -> ParetoFront:
        return front(
            lambda points: predict_all(surfaces, study.coded(points)),
            study.actual(-reach),
            study.actual(reach),
            goals=goals,
            baseline=study.baseline,
            **settings.model_dump(include=SEARCH),
            doubt=lambda points: doubt.at_share(share)(study.coded(points)),
        )

    with named_faults(study, goals, lambda point: point, ""):
        found = _idle_at(study, study.centre, _backed_off(study, plain, failed))
    found = replace(found, uncertainty=_uncertainty(study, surfaces, found))
    if box is None:
        return found
    with named_faults(study, goals, study.actual, " after manufacture"):
        aware = _backed_off(
            study, lambda share: _tolerance_aware(study, surfaces, found, box, doubt.at_share(share)), failed
        )
    return replace(found, tolerance_aware=_idle_at(study, np.zeros_like(study.centre), aware))


@one_thread
def with_survival(
    study: Study, surfaces: Sequence[Surface], found: ParetoFront, confirmed: Mapping[str, Confirmed] | None = None
) -> ParetoFront:
    """The front with the intervals of the shares of parts that still dominate the baseline; ``confirmed`` points, which were
    simulated, narrow what the surfaces leave open."""
    aware = found.tolerance_aware
    if aware is None:
        return found
    drawn = draws_of(study, surfaces, confirmed)
    plain, pick = (
        surviving(study, drawn, point, aware.box)
        for point in (study.coded(found.points[found.pick]), aware.points[aware.pick])
    )
    return replace(found, tolerance_aware=replace(aware, plain_interval=plain, pick_interval=pick))


def _idle_at(study: Study, centre: Array, found: Found) -> Found:
    """The same points with the factors that mean nothing, for which the search takes anything, at a centre (k,)."""
    idle = np.isin(np.arange(centre.size), study.inactive)
    return replace(found, points=np.where(idle, centre, found.points)) if idle.any() else found


def _backed_off(study: Study, search: Callable[[float], Found], failed: int) -> Found:
    """What a search finds with the largest share of the back-off that leaves any point. Raises InfeasibleError."""
    if not goals_of(study).limited:
        return search(0.0)
    for share in (1.0 + failed, *SHARES)[failed == 0 :]:
        try:
            searched = search(share)
        except InfeasibleError:
            if share == SHARES[-1]:
                raise
            continue
        probability = study.file.confirmation.limit_probability
        words = f"; limits keep the margin for the demanded probability of {probability:g}"
        if share < 1.0:
            words = f"; limits keep {100.0 * share:g} % of the margin for the demanded probability of {probability:g}"
        return replace(searched, pick_reason=searched.pick_reason + words)
    raise AssertionError("the last share either returns or raises")


def _uncertainty(study: Study, surfaces: Sequence[Surface], pareto: ParetoFront) -> FrontUncertainty:
    assert pareto.baseline_values is not None
    drawn = draw_all(surfaces, study.file.front.draws, study.file.front.seed)
    points = np.vstack([pareto.points, study.baseline])
    values = predict_draws(surfaces, drawn, study.coded(points), study.file.front.seed)
    baseline = values[:, -1], pareto.baseline_values
    pick = pareto.goals, pareto.values, pareto.pick, study.file.front.pick
    return front_uncertainty(values[:, :-1], *pick, *baseline)


def _tolerance_aware(
    study: Study, surfaces: Sequence[Surface], pareto: ParetoFront, box: ToleranceBox, doubt: Doubt
) -> ToleranceAware:
    reach = region_of(study)
    return tolerance_aware_front(
        quadratics(surfaces, len(study.factors)),
        box,
        -reach,
        reach,
        pareto.goals,
        baseline=study.coded(study.baseline),
        plain=Archive(study.coded(pareto.points), pareto.costs),
        plain_pick=pareto.pick,
        doubt=doubt,
        **study.file.front.model_dump(include=SEARCH),
    )


@contextmanager
def named_faults(study: Study, goals: Goals, actual: Callable[[Array], Array], after: str) -> Iterator[None]:
    """Turns a search that finds nothing into a sentence; ``actual`` gives its points in factor units."""
    try:
        yield
    except InfeasibleError as error:
        by_limit = zip(goals.limited, error.violations.tolist(), strict=True)
        broken = [(study.responses[index], sense, limit, by) for (index, sense, limit), by in by_limit if by > 0.0]
        missed = " and ".join(f"{name} {sense} {limit:g} by {by:.4g}" for name, sense, limit, by in broken)
        where = ", ".join(f"{name} = {x:.5g}" for name, x in study.by_factor(actual(error.point)).items())
        none = f"no point of the region keeps all limits{after}; the closest ({where}) misses {missed}"
        fix = "loosen a limit or widen the design"
        raise InputError([f"{study.path}: response.lower, response.upper: {none}; {fix}"]) from None
    except MethodError as error:
        raise InputError([f"{study.path}: front{after}: {error}"]) from None
