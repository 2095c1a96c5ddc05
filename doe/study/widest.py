"""The widest tolerances of a study's factors about a point, within which parts keep its gains."""

from collections.abc import Mapping, Sequence

import numpy as np

from doe.arrays import Array
from doe.pareto.simulated_tolerance import Neighbourhood
from doe.pareto.tolerance import WidestTolerances, widest_tolerances
from doe.response_surface import Surface
from doe.study.confirmation import Confirmed
from doe.study.drawn import draw_all, predict_all, predict_paired
from doe.study.goals import goals_of, known_tolerances, region_of, rigid
from doe.study.shares import Drawn, draws_of, keeping, open_errors
from doe.study_file import Study
from doe.study_file.sections import Tolerances


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
