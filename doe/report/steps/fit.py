"""Response surfaces as JSON and as tables."""

from collections.abc import Sequence
from typing import Any

from doe.response_surface import Surface, describe


def fit_record(surfaces: Sequence[Surface]) -> dict[str, Any]:
    """JSON of ``doe fit``."""
    return {"responses": {each.name: each.as_dict() | {"sentences": describe(each)} for each in surfaces}}


def fit_tables(surfaces: Sequence[Surface]) -> dict[str, list[dict[str, Any]]]:
    """Rows of each CSV file: the analysis of variance, the coefficients, the runs with their diagnostics."""
    return {
        "anova.csv": [{"response": s.name, **row} for s in surfaces for row in s.anova],
        "coefficients.csv": [
            {"response": s.name, **row, "actual_units": s.actual_coefficients[row["term"]]}
            for s in surfaces
            for row in s.coefficient_table()
        ],
        "runs.csv": [{"response": s.name, **run} for s in surfaces for run in s.diagnostics["runs"]],
    }
