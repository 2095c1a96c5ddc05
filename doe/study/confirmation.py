"""Simulations at chosen points, and whether what they gain over the baseline is more than their error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from doe.study_file import Study

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Confirmed:
    """Simulated responses (m,) at a point, with 95 % statistical and numerical half-widths."""

    point: Array
    values: Array
    statistical: Array
    numerical: Array


@dataclass(frozen=True)
class Gain:
    """Relative improvement [%] of a response at the pick over the baseline, with its 95 % half-width."""

    response: str
    percent: float
    error: float

    @property
    def verdict(self) -> str:
        """Whether the change is larger than its error."""
        if abs(self.percent) <= self.error:
            return "within error"
        return "better" if self.percent > 0.0 else "worse"


def gains(study: Study, baseline: Confirmed, pick: Confirmed) -> list[Gain]:
    """Improvements with the statistical and numerical errors of both runs, taken as independent."""
    parts = (baseline.statistical, baseline.numerical, pick.statistical, pick.numerical)
    error = np.sqrt(sum(np.nan_to_num(part) ** 2 for part in parts))
    scale = 100.0 / np.abs(baseline.values)
    percent = study.signs * (baseline.values - pick.values) * scale
    return [
        Gain(name, float(p), float(e))
        for name, p, e in zip(study.responses, percent, error * scale, strict=True)
    ]


def with_errors(study: Study, record: dict[str, Any]) -> tuple[Array, Array, Array]:
    quantities = [record[name] for name in study.responses]
    keys = ("value", "statistical_error", "numerical_error")
    columns = [np.array([q[key] if q[key] is not None else np.nan for q in quantities]) for key in keys]
    return columns[0], columns[1], columns[2]
