"""The numbers behind the interactive pictures, and nothing else."""

from collections.abc import Mapping
from typing import Any

from doe.report.sections.answer import tolerance_of
from doe.report.sections.fronts import bounds, complete, fronts, picks
from doe.report.sections.record import Factor, Record, factors, fits, part, responses
from doe.report.words import rounded_down
from rbdyn.base.words import quantity


def page_data(summary: Record, motion: Mapping[str, Any]) -> dict[str, Any]:
    """Factors, surfaces, runs, fronts and motion, ready for JSON."""
    given = factors(summary)
    names = [each["name"] for each in responses(summary)]
    emulators = part(summary, "adaptive", "emulators")
    searched = emulators and emulators | {"region": [part(summary, "adaptive", "region", each.name) for each in given]}
    return {
        "factors": [
            {key: getattr(each, key) for key in ("name", "words", "unit", "letter", "centre", "step", "low", "high", "decimals")}
            | {"tolerance": rounded_down(tolerance) if (tolerance := tolerance_of(summary, each)) else None}
            for each in given
        ],
        "responses": [{"name": name, **_named(name)} for name in names],
        "surfaces": _surfaces(summary),
        "runs": [
            {
                "run": point.get("run"),
                "factors": [part(point, "factors", each.name) for each in given],
                "values": {name: part(point, "responses", name, "value") for name in names},
            }
            for point in part(summary, "design", "points") or []
        ],
        "marks": {
            name: [part(point, "factors", each.name) for each in given]
            for name, point in picks(summary).items()
            if name in ("baseline", "pick") and complete(point, summary)
        },
        "fronts": [
            {"words": each.words, "points": [_point(point, given, names) for point in each.points]}
            for each in fronts(summary)
        ],
        "beside": {name: _point(point, given, names) for name, point in picks(summary).items()},
        "motion": {name: each["moving"] for name, each in motion.items() if part(each, "moving")},
        **({"emulators": searched} if searched else {}),
    }  # fmt: skip


def _named(name: str) -> dict[str, str]:
    words, unit = quantity(name)
    return {"words": words, "unit": unit}


def _point(point: Record, given: list[Factor], names: list[str]) -> dict[str, Any]:
    """Short keys, for there are many: x factors, y responses, e half-widths, r values with tolerances."""
    found = {
        "x": [_rounded(part(point, "factors", each.name)) for each in given],
        "y": [_rounded(part(point, "responses", name)) for name in names],
        "e": [_rounded(part(point, "errors", name), 2) for name in names] if point.get("errors") else None,
        "r": [_rounded(part(point, "robust", name)) for name in names] if point.get("robust") else None,
    }
    return {key: value for key, value in found.items() if value is not None}


def _rounded(value: float | None, digits: int = 6) -> float | None:
    return None if value is None else float(f"{value:.{digits}g}")


def _surfaces(summary: Record) -> list[dict[str, Any]]:
    """Terms and coefficients; with the covariance also what a 95 % confidence interval needs."""
    from scipy.stats import t

    found, limits = [], bounds(summary)
    for name, fitted in fits(summary).items():
        coefficients = fitted["coefficients"]
        covariance, missed = fitted.get("covariance"), fitted.get("model_error") or {}
        residual = next((row["df"] for row in fitted.get("anova") or [] if row.get("source") == "residual"), None)
        found.append(
            {
                "name": name,
                "bounds": limits.get(name, []),
                **_named(name),
                "terms": list(coefficients),
                "coefficients": list(coefficients.values()),
                "covariance": covariance,
                "student": float(t.ppf(0.975, missed.get("dof") or residual)) if covariance and residual else None,
                "missed": missed.get("variance"),
                "power": fitted.get("transform"),
            }
        )
    return found
