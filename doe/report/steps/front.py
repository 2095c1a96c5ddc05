"""The Pareto front, and the tolerance-aware one, as JSON; what was asked of both."""

from string import ascii_uppercase
from typing import Any

import numpy as np

from doe.arrays import Array
from doe.pareto import ParetoFront
from doe.pareto.manufacture import ToleranceAware
from doe.pareto.search import REFERENCE, dominates
from doe.report.steps.confirmation import gains_record, point_record
from doe.response_surface import Surface
from doe.study_file import Study
from doe.workflow.front import SurfaceDoubt, open_errors
from doe.workflow.pick import place_of
from doe.workflow.runs import goals_of, known_tolerances, region_of
from doe.workflow.surfaces import PredictedGain, half_widths, predict_all, predicted_gains, statement
from rbdyn.records.record import finite


def asked_record(study: Study) -> dict[str, Any]:
    """Factors with their ranges and responses with their goals."""
    reach, known = region_of(study), known_tolerances(study)
    low, high = (study.actual(side * reach) for side in (-1.0, 1.0))
    return {
        "factors": [
            {
                "letter": letter,
                **factor.model_dump(include={"name", "key", "centre", "step", "resolution"}),
                "low": float(low[index]),
                "high": float(high[index]),
                "tolerance": known.get(factor.name),
            }
            for index, (letter, factor) in enumerate(zip(ascii_uppercase, study.file.factor, strict=False))
        ],
        "responses": [response.model_dump() for response in study.file.response],
    }


def front_record(study: Study, surfaces: list[Surface], front: ParetoFront) -> dict[str, Any]:
    """JSON of ``doe front``: factor and response values in their own units and senses."""
    assert front.uncertainty is not None
    sure = front.uncertainty
    rows = zip(front.points, front.values, half_widths(surfaces, study.coded(front.points)), strict=True)
    points = [
        {**point_record(study, *row), "non_dominated_probability": float(probability)}
        for row, probability in zip(rows, sure.non_dominated, strict=True)
    ]
    gains = predicted_gains(study, surfaces, front.points[front.pick])
    place = place_of(study, front.points[front.pick])
    pick = "The pick" if front.tolerance_aware is None else "The pick without tolerances"
    picks: dict[str, Any] = {rule: points[row] for rule, row in front.picks.items()}
    record: dict[str, Any] = {
        "front": points,
        "hypervolume": front.hypervolume,
        "largest_hypervolume": REFERENCE ** front.costs.shape[1],
        "hypervolume_history": front.hypervolume_history.tolist(),
        "ideal": _extreme(study, front, front.costs.argmin(axis=0)),
        "nadir": _extreme(study, front, front.costs.argmax(axis=0)),
        "knee": points[front.knee],
        "pick": {
            **points[front.pick],
            "reason": front.pick_reason,
            "beyond_runs": place.beyond,
            "at_bounds": place.at_bounds,
        },
        "picks": picks,
        "baseline": predicted_record(study, surfaces, study.baseline),
        "pick_dominates_baseline": {
            "probability": sure.pick_dominates,
            "standard_error": sure.pick_dominates_error,
            "draws": sure.draws,
        },
        "predicted_gains": _with_optimism(gains, sure.optimism),
        "statement": f"{statement(gains)} {place.sentence(pick)}".rstrip(),
        "constraints": _limits(study, surfaces, front.points[front.pick]),
        "archive": front.archive_size,
        "feasible_share": front.feasible,
        **{key: getattr(front, key) for key in ("evaluations", "generations", "seed")},
    }
    if front.tolerance_aware is not None:
        record["tolerance_aware"] = tolerance_aware_record(study, surfaces, front.tolerance_aware)
        picks["tolerance_aware"] = record["tolerance_aware"]["pick"]
    return record


def predicted_record(study: Study, surfaces: list[Surface], point: Array) -> dict[str, Any]:
    """Factors, responses on the surfaces and their 95 % half widths at a point in factor units."""
    coded = study.coded(point)[None]
    return point_record(study, point, predict_all(surfaces, coded)[0], half_widths(surfaces, coded)[0])


def given_point_record(study: Study, surfaces: list[Surface], front: ParetoFront, point: Array) -> dict[str, Any]:
    """A point that was asked for: its gains over the baseline, and what the front makes of it."""
    gains = predicted_gains(study, surfaces, point)
    coded = study.coded(point)
    costs = goals_of(study).costs(predict_all(surfaces, coded[None])[0])
    place = place_of(study, point)
    return {
        **predicted_record(study, surfaces, point),
        "predicted_gains": gains_record(gains),
        "dominated_by": int(dominates(front.costs, costs).sum()),
        "beyond_runs": place.beyond,
        "at_bounds": place.at_bounds,
        "constraints": _limits(study, surfaces, point),
        "sentences": [gain.sentence for gain in gains],
        "statement": f"{statement(gains)} {place.sentence('The point')}".rstrip(),
    }


def _with_optimism(gains: list[PredictedGain], optimism: Array | None) -> dict[str, Any]:
    record = gains_record(gains)
    for gain, excess in zip(gains, [] if optimism is None else optimism.tolist(), strict=False):
        record[gain.response]["selection_optimism_percent"] = 100.0 * excess / abs(gain.baseline)
    return record


def _extreme(study: Study, front: ParetoFront, rows: Any) -> dict[str, float]:
    """The responses with a goal where each is best or worst."""
    pairs = zip(front.goals.objectives, rows, strict=True)
    return {study.responses[index]: float(front.values[row, index]) for index, row in pairs}


def _limits(study: Study, surfaces: list[Surface], point: Array) -> list[dict[str, Any]]:
    """Every limit at a point in factor units: what the surfaces say there, and the probability of keeping it."""
    coded = study.coded(point)
    values, errors = predict_all(surfaces, coded[None])[0], half_widths(surfaces, coded[None])[0]
    doubt = SurfaceDoubt(study, surfaces)
    return [
        {
            "response": study.responses[index],
            "sense": sense,
            "limit": limit,
            "value": float(values[index]),
            "error": finite(errors[index]),
            "kept": bool(values[index] <= limit if sense == "<=" else values[index] >= limit),
            "probability": doubt.kept_with(index, sense, limit, coded),
            "demanded_probability": study.file.confirmation.limit_probability,
        }
        for index, sense, limit in goals_of(study).limited
    ]


def tolerance_aware_record(study: Study, surfaces: list[Surface], found: ToleranceAware) -> dict[str, Any]:
    """JSON of a tolerance-aware front. ``robust``: what manufacture leaves of a response (of its distance from the
    target, where it has one).
    """
    wanted = [response for response in study.file.response if response.goal != "none"]
    named = [response.name for response in wanted]
    sign = np.array([-1.0 if response.goal == "max" else 1.0 for response in wanted])

    def robust(costs: Array) -> dict[str, float]:
        return dict(zip(named, (sign * costs).tolist(), strict=True))

    points = study.actual(found.points)
    front = [
        {
            "factors": study.by_factor(point),
            "responses": dict(zip(study.responses, values.tolist(), strict=True)),
            "robust": robust(costs),
        }
        for point, values, costs in zip(points, found.values, found.costs, strict=True)
    ]
    gains = predicted_gains(study, surfaces, points[found.pick])
    return {
        "kind": found.box.kind,
        "quantile": found.box.quantile if found.box.kind == "quantile" else None,
        "distribution": found.box.distribution,
        "half_widths": study.by_factor(found.box.half * study.step),
        "front": front,
        "hypervolume": found.hypervolume,
        "pick": {**front[found.pick], "reason": found.pick_reason},
        "picks": {rule: front[row] for rule, row in found.picks.items()},
        "baseline_robust": robust(found.baseline_costs),
        "plain_pick_robust": robust(found.plain_pick_costs),
        "plain_pick_inside": found.plain_inside,
        "nominal_loss_percent": found.nominal_loss_percent,
        "robust_gain_percent": finite(found.robust_gain_percent),
        "pick_gains_percent": {gain.response: gain.percent for gain in gains},
        "survival": {
            "plain_pick": found.plain_survives,
            "pick": found.pick_survives,
            "standard_error": found.survival_error,
            "plain_pick_interval": None if found.plain_interval is None else list(found.plain_interval),
            "pick_interval": None if found.pick_interval is None else list(found.pick_interval),
            "open_errors": open_errors(surfaces),
        },
    }
