"""summary.json: everything that a study found, as plain numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from doe.report.fit import fit_record
from doe.report.front import front_record
from rbdyn.result import versions

if TYPE_CHECKING:
    from doe.study import Outcome

FORMAT = "doe.study/1"


def summary(outcome: Outcome) -> dict[str, Any]:
    """JSON of ``doe study``."""
    study = outcome.study
    return {
        "format": FORMAT,
        "status": "ok",
        "design": {"runs": len(outcome.runs.coded), "factors": study.factors, "responses": study.responses},
        "fit": fit_record(outcome.surfaces),
        "front": front_record(study, outcome.surfaces, outcome.front),
        "pick": dict(zip(study.factors, outcome.pick.point.tolist(), strict=True)),
        "confirmation": {
            name: {
                "factors": dict(zip(study.factors, each.point.tolist(), strict=True)),
                "responses": {
                    response: {
                        "value": value,
                        "statistical_error": _or_none(s),
                        "numerical_error": _or_none(n),
                    }
                    for response, value, s, n in zip(
                        study.responses, each.values.tolist(), each.statistical, each.numerical, strict=True
                    )
                },
            }
            for name, each in (("baseline", outcome.baseline), ("pick", outcome.pick))
        },
        "gains": {
            gain.response: {"percent": gain.percent, "error_percent": gain.error, "verdict": gain.verdict}
            for gain in outcome.gains
        },
        "chains": {name: chain.as_dict() for name, chain in outcome.chains.items()},
        "beside_reference": {
            row.response: {
                "ours_min_mean_max": [float(x) for x in row.our_range],
                "theirs_min_mean_max": [float(x) for x in row.their_range],
                "linear_effects": {
                    factor: {"ours": ours[0], "theirs": theirs[0], "same_sign": ours[0] * theirs[0] > 0.0}
                    for factor, (ours, theirs) in row.effects.items()
                },
                "rank_correlation": row.rank_correlation,
                "verdict": row.verdict,
                "why": row.why,
            }
            for row in outcome.beside
        },
        "notes": list(outcome.runs.notes),
        "cost": outcome.cost,
        "versions": versions(),
    }


def _or_none(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
