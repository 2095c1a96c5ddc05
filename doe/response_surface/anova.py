"""Analysis of variance with partial (type III) sums of squares, what repeated runs say of the fit, R2 and its kin, and
backward elimination.

Weighted fits have weighted sums. Repeated runs count within a block. Where there are blocks, their differences
are a source of their own and no part of the model: R2 is judged on the scatter within blocks.

Source: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 2.4-2.7 and 7.5.
"""

import math
from collections.abc import Callable
from typing import Any, TypedDict

import numpy as np
from scipy import stats

from doe.arrays import Array, Whole
from doe.designs.design import replicate_groups
from doe.designs.model import Terms, needed
from doe.response_surface.diagnostics import press
from doe.response_surface.least_squares import LeastSquares

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

    ``solution`` is of the columns of ``terms`` followed by those that tell the blocks apart.
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
