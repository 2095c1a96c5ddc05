"""Judgement of a least-squares fit: analysis of variance with partial (type III) sums of squares, R2 and its kin, backward elimination,
and residual diagnostics: leverage, studentized residuals, Cook's distance, normality, outliers.

Weighted fits have weighted sums. Repeated runs count within a block. Where there are blocks, their differences
are a source of their own and no part of the model: R2 is judged on the scatter within blocks.

Sources: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 2.4-2.7 and 7.5; Belsley, Kuh and Welsch,
Regression Diagnostics (1980); Cook and Weisberg, Residuals and Influence in Regression (1982); Shapiro and Wilk (1965).
"""

import math
from collections.abc import Callable
from typing import Any, TypedDict, cast

import numpy as np
from scipy import stats

from doe.designs.design import replicate_groups
from doe.designs.model import Terms, needed
from doe.response_surface.least_squares import LeastSquares
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.records import finite

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
    return (
        f"the residuals are not normal (Shapiro-Wilk, {p_text(p)}): p values and intervals are rough; look for an "
        "outlier, a missing term or a transform."
    )


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


KEEP_BELOW = 0.05  # p-value up to which a term stays in a reduced model


class AnovaRow(TypedDict):
    """One row of an analysis of variance; ``ss`` of a term is partial (type III).

    ``df`` is None for a variance that is known exactly.
    """

    source: str
    ss: float | None
    df: int | None
    ms: float | None
    f: float | None
    p: float | None


class Removal(TypedDict):
    """A term that went, with its F and p among the terms that were left then."""

    term: str
    f: float
    p: float


def row(source: str, ss: float | None, df: int, error: float | None = None, error_dof: float = 0) -> AnovaRow:
    """A row with its mean square, tested by F against the mean square ``error`` if there is one."""
    mean_square = None if ss is None else ratio(ss, df)
    f = None if mean_square is None or error is None else ratio(mean_square, error)
    p = None if f is None else float(stats.f.sf(f, df, error_dof))
    return AnovaRow(source=source, ss=ss, df=df, ms=mean_square, f=f, p=p)


def term_rows(terms: Terms, solution: LeastSquares) -> list[AnovaRow]:
    """Partial sum of squares, F and p of each coefficient."""
    count = len(terms)
    squares = (solution.coefficients[:count] ** 2 / np.diag(solution.inverse)[:count]).tolist()
    return [row(term, ss, 1, solution.mean_square, solution.dof) for term, ss in zip(terms, squares, strict=True)]


def anova(terms: Terms, solution: LeastSquares, response: Array, points: Array, block: Whole) -> list[AnovaRow]:
    """The table: model, terms, blocks if any, residual, lack of fit, pure error, total.

    ``solution`` is of the columns of ``terms`` followed by those that distinguish the blocks.
    """
    model_df, residual = len(terms) - 1, solution.residual_sum
    error = solution.mean_square, solution.dof
    block_columns = range(len(terms), len(solution.coefficients))
    groups = replicate_groups(points, block)
    within = sum_within(response, solution.weights, block)
    about_mean = sum_within(response, solution.weights, np.zeros_like(block))
    return [
        row("model", max(within - residual, 0.0), model_df, *error),
        *(each for each in term_rows(terms, solution) if each["source"] != "1"),
        *([row("block", solution.partial_sum(block_columns), len(block_columns), *error)] * bool(block_columns)),
        row("residual", residual, solution.dof),
        *_lack_of_fit(response, solution, groups),
        AnovaRow(source="total", ss=about_mean, df=len(response) - 1, ms=None, f=None, p=None),
    ]


def sum_within(values: Array, weights: Array, group: Whole) -> float:
    """Weighted sum of squares about the mean of each group; of equal values exactly zero."""
    total = 0.0
    for label in np.unique(group):
        # Measured from the first value, equal values leave no rounding.
        offset, weight = values[group == label] - values[group == label][0], weights[group == label]
        total += float((weight * (offset - weight @ offset / weight.sum()) ** 2).sum())
    return total


def find(rows: list[AnovaRow], source: str) -> AnovaRow:
    """The row of a source."""
    return next(each for each in rows if each["source"] == source)


def ratio(a: float, b: float) -> float | None:
    """a / b, or None where that is undefined."""
    return a / b if b > 0 and math.isfinite(a / b) else None


def complement(part: float, whole: float) -> float | None:
    """1 - part / whole, or None where that is undefined."""
    share = ratio(part, whole)
    return None if share is None else 1.0 - share


def _lack_of_fit(response: Array, solution: LeastSquares, groups: Whole) -> tuple[AnovaRow, AnovaRow]:
    pure_df = len(response) - len(np.unique(groups))
    if pure_df == 0:
        return row("lack_of_fit", None, solution.dof), row("pure_error", None, 0)
    pure = sum_within(response, solution.weights, groups)
    lack = max(solution.residual_sum - pure, 0.0)
    return (row("lack_of_fit", lack, solution.dof - pure_df, pure / pure_df, pure_df), row("pure_error", pure, pure_df))


def observation_variance(solution: LeastSquares) -> float:
    """Variance of a new run about the surface; of the mean run, where they differ."""
    return solution.mean_square * float((1.0 / solution.weights).mean())


def goodness(solution: LeastSquares, response: Array, predicted: Array, block: Whole) -> dict[str, Any]:
    """R2 and its kin on the scatter within blocks; the others by the definitions of Myers et al."""
    within = sum_within(response, solution.weights, block)
    free = len(response) - len(np.unique(block))
    missed, variance = press(solution), observation_variance(solution)
    size = len(solution.coefficients)
    mean = float(solution.weights @ response / solution.weights.sum())
    return {
        "r2": complement(solution.residual_sum, within),
        "adjusted_r2": complement(solution.mean_square, within / free),
        "predicted_r2": None if missed is None else complement(missed, within),
        "press": missed,
        "cv_percent": ratio(100 * math.sqrt(variance), abs(mean)),
        "adequate_precision": ratio(float(np.ptp(predicted)), math.sqrt(size * variance / len(response))),
    }


def eliminate(terms: Terms, solve_for: Callable[[Terms], LeastSquares]) -> tuple[Terms, list[Removal]]:
    """Terms left, and those removed in their order: the least significant goes, again and again, hierarchy kept.

    The term of largest p above `KEEP_BELOW` goes, except the constant and what a remaining interaction or
    square is built on. ``solve_for`` fits a set of terms.
    """
    removed: list[Removal] = []
    while True:
        removable = [
            Removal(term=each["source"], f=each["f"], p=each["p"])
            for each in term_rows(terms, solve_for(terms))
            if each["f"] is not None and each["p"] is not None and each["p"] > KEEP_BELOW
            if not needed(each["source"], terms)
        ]
        if not removable:
            return terms, removed
        removed.append(max(removable, key=lambda removal: (removal["p"], removal["term"])))
        terms = tuple(term for term in terms if term != removed[-1]["term"])
