"""The Pareto front of a study on its response surfaces, how sure it is, and what manufacture leaves of it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TypeVar

import numpy as np

from doe.arrays import Array
from doe.pareto import Goals, InfeasibleError, ParetoFront, front
from doe.pareto.front import FrontUncertainty, front_uncertainty
from doe.pareto.manufacture import ToleranceAware, ToleranceBox, tolerance_aware_front
from doe.pareto.search import Archive, Doubt
from doe.response_surface import Surface
from doe.study.back_off import SurfaceDoubt
from doe.study.confirmation import Confirmed
from doe.study.drawn import draw_all, predict_all, predict_draws, quadratics
from doe.study.goals import check_goals, goals_of, region_of, tolerance_box
from doe.study.shares import draws_of, surviving
from doe.study_file import Study
from doe.threads import one_thread
from rbdyn.faults import InputError, MethodError

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
        mend = "loosen a limit or widen the design"
        raise InputError([f"{study.path}: response.lower, response.upper: {none}; {mend}"]) from None
    except MethodError as error:
        raise InputError([f"{study.path}: front{after}: {error}"]) from None
