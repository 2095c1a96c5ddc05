"""Confirmed points and their gains, as plain numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.study_file import Study
from doe.workflow.confirmation import Confirmed, Gain, Limit, every_limit, limits_of, statement
from doe.workflow.surfaces import PredictedGain
from doe.workflow.whole import StudyResult
from rbdyn.base.arrays import Array
from rbdyn.base.records import finite


def confirmation_record(outcome: StudyResult) -> dict[str, Any]:
    """Every confirmed point by name, with its gains over the baseline and whether they are real."""
    return {
        name: {
            "factors": outcome.study.by_factor(each.point),
            "reason": each.reason,
            "responses": _quantities(outcome.study, each),
            "power_terms_W": dict(each.power_terms),
            "limits": limits_record(limits_of(outcome.study, each)),
            "every_limit": [
                {"response": limit.response, **_limit(limit)} for limit in every_limit(outcome.study, each)
            ],
        }
        | ({} if each.friction_check is None else {"friction_check": dict(each.friction_check)})
        | {
            key: record(outcome.gains[name])
            for key, record in (("gains", gains_record), ("statement", statement))
            if name in outcome.gains
        }
        for name, each in outcome.confirmed.items()
    }


def judged_limits_record(outcome: StudyResult) -> dict[str, Any]:
    """Limits at the pick, each with the ``odds`` [p, low, high] that the pick keeps all limits of that response over the unknown
    inputs; None where that was not asked for."""
    odds = {} if outcome.robust is None else outcome.robust.odds
    record = limits_record(outcome.limits)
    return {name: {**each, "odds": list(odds[name]) if name in odds else None} for name, each in record.items()}


def limits_record(limits: Sequence[Limit]) -> dict[str, Any]:
    """Limits judged by simulation, by response: of a lower and an upper one that with the worse verdict, or less room."""
    return {limit.response: _limit(limit) for limit in limits}


def _limit(limit: Limit) -> dict[str, Any]:
    known = {key: getattr(limit, key) for key in ("bound", "sense", "value", "verdict")}
    return known | {"error": finite(limit.error), "probability": finite(limit.probability)}


def gains_record(gains: Sequence[Gain | PredictedGain]) -> dict[str, Any]:
    """JSON of gains, simulated or predicted, by response."""
    return {gain.response: gain.as_dict() for gain in gains}


def _quantities(study: Study, confirmed: Confirmed) -> Mapping[str, Any]:
    columns = (confirmed.values.tolist(), confirmed.statistical, confirmed.numerical)
    return {
        response: {"value": value, "statistical_error": finite(statistical), "numerical_error": finite(numerical)}
        for response, value, statistical, numerical in zip(study.responses, *columns, strict=True)
    }


def point_record(study: Study, point: Array, values: Array, errors: Array) -> dict[str, Any]:
    """Factors (k,), responses (m,) and their 95 % half widths (m,) of a point, by name."""
    return {
        "factors": study.by_factor(point),
        "responses": dict(zip(study.responses, values.tolist(), strict=True)),
        "errors": dict(zip(study.responses, map(finite, errors), strict=True)),
    }
