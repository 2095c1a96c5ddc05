"""Residual diagnostics: leverage, studentized residuals, Cook's distance, normality, outliers.

Sources: Belsley, Kuh and Welsch, Regression Diagnostics (1980); Cook and Weisberg, Residuals and Influence in
Regression (1982); Shapiro and Wilk (1965).
"""

from typing import TypedDict, cast

import numpy as np
from scipy import stats

from doe.arrays import Array
from doe.response_surface.least_squares import LeastSquares
from rbdyn.records.record import finite

EXACT = 1e-12  # 1 - leverage below which a run is met exactly, whatever its value
INFLUENTIAL = 1.0  # Cook's distance above which leaving a run out moves the surface beyond its own error
HIGH_LEVERAGE = 2.0  # leverage in units of the mean leverage


class RunDiagnostics(TypedDict):
    """One run, on the scale of the fit. ``run`` counts from 1.

    ``standardized`` is the internally studentized residual r / (s sqrt(1 - h)), ``studentized`` the
    externally studentized one, with s from the fit without the run; None where undefined.
    """

    run: int
    observed: float
    predicted: float
    residual: float
    standardized: float | None
    studentized: float | None
    leverage: float
    cook: float | None


class Diagnostics(TypedDict):
    """Runs and tests: Shapiro-Wilk on the standardized residuals, the largest studentized one by Bonferroni.

    ``high_leverage`` and ``influential`` list runs (from 1).
    """

    runs: list[RunDiagnostics]
    normality: dict[str, float | str | None]
    outlier: dict[str, float | int | str | None]
    high_leverage: list[int]
    influential: list[int]


def diagnose(solution: LeastSquares, response: Array) -> Diagnostics:
    """Diagnostics of a least-squares fit to ``response`` (n,)."""
    free = 1.0 - solution.leverage
    tested = (free > EXACT) & (solution.mean_square > 0)
    weighted = solution.residuals * np.sqrt(solution.weights)
    safe = np.where(tested, free, 1.0)
    standardized = np.where(tested, weighted / np.sqrt(safe * (solution.mean_square or 1.0)), np.nan)
    # Of a run that takes up the whole residual nothing is left to judge it by.
    rest = solution.dof - standardized**2
    judged = tested & (rest > EXACT * solution.dof) & (solution.dof > 1)
    rescaled = standardized * np.sqrt(max(solution.dof - 1, 0) / np.where(judged, rest, 1.0))
    studentized = np.where(judged, rescaled, np.nan)
    cook = standardized**2 * solution.leverage / safe / len(solution.coefficients)
    predicted, runs = response - solution.residuals, range(1, len(response) + 1)
    figures = response, predicted, solution.residuals, standardized, studentized, solution.leverage, cook
    rows = zip(runs, *([finite(value) for value in each.tolist()] for each in figures), strict=True)
    high = solution.leverage > HIGH_LEVERAGE * len(solution.coefficients) / len(response)
    return Diagnostics(
        runs=[cast(RunDiagnostics, dict(zip(RunDiagnostics.__annotations__, row, strict=True))) for row in rows],
        normality=_normality(standardized[tested]),
        outlier=_outlier(studentized, solution.dof - 1),
        high_leverage=(np.flatnonzero(high) + 1).tolist(),
        influential=(np.flatnonzero(np.nan_to_num(cook) > INFLUENTIAL) + 1).tolist(),
    )


def press(solution: LeastSquares) -> float | None:
    """Prediction sum of squares: each run against the fit without it; None where a run is met exactly."""
    free = 1.0 - solution.leverage
    if (free <= EXACT).any():
        return None
    return float((solution.weights * (solution.residuals / free) ** 2).sum())


def describe_diagnostics(diagnostics: Diagnostics, alpha: float) -> list[str]:
    """Residual tests in sentences."""
    tests = _say_normality(diagnostics["normality"]["p"], alpha), _say_outlier(diagnostics["outlier"], alpha)
    return [*filter(None, tests), _say_runs(diagnostics)]


def _normality(standardized: Array) -> dict[str, float | str | None]:
    if len(standardized) < 3 or np.ptp(standardized) == 0:
        return {"test": "Shapiro-Wilk", "w": None, "p": None}
    test = stats.shapiro(standardized)
    return {"test": "Shapiro-Wilk", "w": float(test.statistic), "p": float(test.pvalue)}


def _outlier(studentized: Array, dof: int) -> dict[str, float | int | str | None]:
    known = np.flatnonzero(np.isfinite(studentized))
    test = "Bonferroni on the largest externally studentized residual"
    if not known.size:
        return {"test": test, "run": None, "studentized": None, "p": None}
    run = int(known[np.abs(studentized[known]).argmax()])
    p = min(1.0, known.size * 2 * float(stats.t.sf(abs(studentized[run]), dof)))
    return {"test": test, "run": run + 1, "studentized": float(studentized[run]), "p": p}


def _say_normality(p: float | str | None, alpha: float) -> str:
    if not isinstance(p, float):
        return ""
    if p > alpha:
        return f"the residuals look normal (Shapiro-Wilk, {p_text(p)}), as the tests and intervals assume."
    rough = "p values and intervals are rough; look for an outlier, a missing term or a transform"
    return f"the residuals are not normal (Shapiro-Wilk, {p_text(p)}): {rough}."


def _say_outlier(outlier: dict[str, float | int | str | None], alpha: float) -> str:
    p = outlier["p"]
    if not isinstance(p, float):
        return ""
    run = f"run {outlier['run']} (studentized residual {outlier['studentized']:+.2f}, Bonferroni {p_text(p)})"
    if p > alpha:
        return f"no run is an outlier; the most extreme is {run}."
    return f"{run} is an outlier: check how it was made before it is believed or left out."


def _say_runs(diagnostics: Diagnostics) -> str:
    parts = []
    if diagnostics["influential"]:
        listed = _list(diagnostics["influential"])
        parts.append(f"{listed} alone would move the surface beyond its own error (Cook's distance above 1)")
    if diagnostics["high_leverage"]:
        parts.append(f"{_list(diagnostics['high_leverage'])}: high leverage (above twice the mean)")
    return f"{'; '.join(parts)}." if parts else "no run has undue leverage or influence."


def p_text(p: float) -> str:
    """A p value as it is printed."""
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"


def _list(runs: list[int]) -> str:
    return f"run{'s' if len(runs) > 1 else ''} {', '.join(map(str, runs))}"
