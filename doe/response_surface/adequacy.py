"""Model adequacy of a least-squares fit: analysis of variance, backward elimination, residual diagnostics, model error.

- ``anova``: partial (type III) sums of squares, lack of fit, pure error; ``goodness``: R2 and similar figures
- ``eliminate``: backward elimination of terms
- ``diagnose``: leverage, studentized residuals, Cook's distance, normality, outliers
- ``compare``: scatter of the runs compared with their known variances; ``model_error``: lack of fit as an error of predictions

Repeated runs count within a block. Differences of blocks are a separate source and no part
of the model, so R2 refers to the scatter within blocks.

Known variances come from replicates of the simulation. The residuals over them give a test of lack of fit that needs no
repeated design points. Repeated points show whether the replicates contain all of the scatter. A variance of few replicates
is itself uncertain, and the tests allow for it.

The response is the model plus a random field of mean zero and constant variance. Its correlation length is one coded unit, so
that distinct runs of a design are nearly independent. The variance of the field is a variance component, estimated by the
expectation of a sum of squares: the residual beyond the known variance of the runs, or beyond the pure error of repeated runs
where that refutes the known variance or no variance is known, over the share of the field in it. Where nothing shows the scatter of
a run, the whole residual counts as field. An interval combines the error of the coefficients and the field as root sum square.
Student's t has the degrees of freedom of the source of the field. No test decides whether the field counts: a small field that a
test overlooks would make intervals too narrow. Where the estimate is not positive there is no field, and intervals are those of
textbooks.

Sources: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 2.4-2.7 and 7.5; Belsley, Kuh and Welsch,
Regression Diagnostics (1980); Cook and Weisberg, Residuals and Influence in Regression (1982); Shapiro and Wilk (1965).
Field: Sacks, Welch, Mitchell and Wynn, Design and analysis of computer experiments, Stat. Sci. 4 (1989). Its variance: Searle,
Casella and McCulloch, Variance Components (1992). Known variances: Satterthwaite, An approximate distribution of estimates of
variance components (1946); Welch (1951).
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from scipy import special, stats

from doe.designs.design import replicate_groups
from doe.designs.model import Terms, needed
from doe.response_surface.least_squares import LeastSquares
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.records import Record, derived, finite, keyed, shown

KEEP_BELOW = 0.05  # p-value up to which a term stays in a reduced model
EXACT = 1e-12  # 1 - leverage below which the fit passes through a run, whatever its value
INFLUENTIAL = 1.0  # Cook's distance above which omitting a run moves the surface beyond its own error
HIGH_LEVERAGE = 2.0  # leverage in units of the mean leverage
REFUTED = 0.05  # p-value up to which repeated runs refute known variances
REACH = 1.0  # correlation length of the model error in coded units, half the edge of the cube of a design
Source = Literal["repeats", "known variance", "residual"]


def probability(value: float | None) -> str:
    """A p-value, four decimals at most."""
    if value is None or not math.isfinite(value):
        return ""
    return "< 0.0001" if value < 1e-4 else f"{value:.4f}"


class AnovaRow(Record):
    """One row of an analysis of variance; ``ss`` of a term is partial (type III).

    ``df`` is None for a variance that is known exactly.
    """

    source: str = shown("source", lambda source: source.replace("_", " "))
    ss: float | None = shown("sum of squares", 5, unit="response squared", meaning="sum of squares")
    df: int | None = shown("df", meaning="degrees of freedom; sum of squares over them (mean square)")
    ms: float | None = shown("mean square", 5)
    f: float | None = shown("F", meaning="F ratio, and the probability of one as large by chance")
    p: float | None = shown("p", probability)


class Removal(Record):
    """A removed term, with its F and p among the terms at that time."""

    term: str
    f: float
    p: float


def anova(terms: Terms, solution: LeastSquares, response: Array, points: Array, block: Whole) -> list[AnovaRow]:
    """The table: model, terms, blocks if any, residual, lack of fit, pure error, total.

    ``solution`` has the columns of ``terms``, then those of the blocks.
    """
    model_df, residual = len(terms) - 1, solution.residual_sum
    error = solution.mean_square, solution.dof
    block_columns = range(len(terms), len(solution.coefficients))
    groups = replicate_groups(points, block)
    within = sum_within(response, block)
    about_mean = sum_within(response, np.zeros_like(block))
    return [
        row("model", max(within - residual, 0.0), model_df, *error),
        *(entry for entry in term_rows(terms, solution) if entry.source != "1"),
        *([row("block", solution.partial_sum(block_columns), len(block_columns), *error)] * bool(block_columns)),
        row("residual", residual, solution.dof),
        *_lack_of_fit(response, solution, groups),
        AnovaRow(source="total", ss=about_mean, df=len(response) - 1, ms=None, f=None, p=None),
    ]


def row(source: str, ss: float | None, df: int, error: float | None = None, error_dof: float = 0) -> AnovaRow:
    """A row with its mean square, and its F test against the mean square ``error`` if present."""
    mean_square = None if ss is None else ratio(ss, df)
    f = None if mean_square is None or error is None else ratio(mean_square, error)
    p = None if f is None else float(stats.f.sf(f, df, error_dof))
    return AnovaRow(source=source, ss=ss, df=df, ms=mean_square, f=f, p=p)


def term_rows(terms: Terms, solution: LeastSquares) -> list[AnovaRow]:
    """Partial sum of squares, F and p of each coefficient."""
    count = len(terms)
    squares = (solution.coefficients[:count] ** 2 / np.diag(solution.inverse)[:count]).tolist()
    return [row(term, ss, 1, solution.mean_square, solution.dof) for term, ss in zip(terms, squares, strict=True)]


def find(rows: list[AnovaRow], source: str) -> AnovaRow:
    """The row of a source."""
    return next(entry for entry in rows if entry.source == source)


def _lack_of_fit(response: Array, solution: LeastSquares, groups: Whole) -> tuple[AnovaRow, AnovaRow]:
    pure_df = len(response) - len(np.unique(groups))
    if pure_df == 0:
        return row("lack_of_fit", None, solution.dof), row("pure_error", None, 0)
    pure = sum_within(response, groups)
    lack = max(solution.residual_sum - pure, 0.0)
    tested = row("lack_of_fit", lack, solution.dof - pure_df, pure / pure_df, pure_df)
    if pure == 0.0 < lack:
        # Any miss is lack of fit where repeated runs agree exactly.
        tested = replace(tested, p=0.0)
    return tested, row("pure_error", pure, pure_df)


def sum_within(values: Array, group: Whole) -> float:
    """Sum of squares about the mean of each group, exactly zero for equal values."""
    total = 0.0
    for label in np.unique(group):
        # Relative to the first value, equal values have no rounding.
        offset = values[group == label] - values[group == label][0]
        total += float(((offset - offset.mean()) ** 2).sum())
    return total


def goodness(solution: LeastSquares, response: Array, prediction: Array, block: Whole) -> dict[str, Any]:
    """R2 and similar figures on the scatter within blocks, PRESS and precision, as defined by Myers et al."""
    within = sum_within(response, block)
    free = len(response) - len(np.unique(block))
    missed, variance = press(solution), solution.mean_square
    size = len(solution.coefficients)
    return {
        "r2": complement(solution.residual_sum, within),
        "adjusted_r2": complement(solution.mean_square, within / free),
        "predicted_r2": None if missed is None else complement(missed, within),
        "press": missed,
        "cv_percent": ratio(100 * math.sqrt(variance), abs(float(response.mean()))),
        "adequate_precision": ratio(float(np.ptp(prediction)), math.sqrt(size * variance / len(response))),
    }


def press(solution: LeastSquares) -> float | None:
    """Prediction sum of squares, each run against the fit without it; None where the fit passes through a run."""
    free = 1.0 - solution.leverage
    if (free <= EXACT).any():
        return None
    return float(((solution.residuals / free) ** 2).sum())


def ratio(a: float, b: float) -> float | None:
    """a / b, or None where that is undefined."""
    return a / b if b > 0 and math.isfinite(a / b) else None


def complement(part: float, total: float) -> float | None:
    """1 - part / whole, or None where that is undefined."""
    share = ratio(part, total)
    return None if share is None else 1.0 - share


def eliminate(terms: Terms, solve_for: Callable[[Terms], LeastSquares]) -> tuple[Terms, list[Removal]]:
    """Backward elimination: the remaining terms, and the removed ones in order.

    It removes the term of largest p above `KEEP_BELOW` again and again. Hierarchy keeps the constant and the factors of
    remaining interactions and squares. ``solve_for`` fits a set of terms.
    """
    removed: list[Removal] = []
    while True:
        removable = [
            Removal(term=entry.source, f=entry.f, p=entry.p)
            for entry in term_rows(terms, solve_for(terms))
            if entry.f is not None and entry.p is not None and entry.p > KEEP_BELOW
            if not needed(entry.source, terms)
        ]
        if not removable:
            return terms, removed
        removed.append(max(removable, key=lambda removal: (removal.p, removal.term)))
        terms = tuple(term for term in terms if term != removed[-1].term)


class RunDiagnostics(Record):
    """One run, on the scale of the fit. ``run`` counts from 1.

    ``standardized`` is the internally studentized residual r / (s sqrt(1 - h)), ``studentized`` the
    externally studentized one, with s from the fit without the run; None where undefined.
    """

    run: int = shown("run")
    observed: float = shown(
        "observed", 5, unit="of the response", meaning="simulated, by the surface, and their difference"
    )
    predicted: float = shown("predicted", 5)
    residual: float = shown("residual", 5)
    standardized: float | None = shown(
        "standardized", 5, meaning="residual over its standard deviation, with the run and without it"
    )
    studentized: float | None = shown("studentized", 5)
    leverage: float = shown("leverage", 5, meaning="weight of the run in its own prediction, 0 to 1")
    cook: float | None = shown("cook", 5, meaning="by how much the run moves all predictions (Cook's distance)")


class Normality(Record):
    """Test of Shapiro and Wilk on the standardized residuals; None where it is undefined."""

    test: str
    w: float | None
    p: float | None


class Outlier(Record):
    """Test of Bonferroni on the largest externally studentized residual, that of a ``run``; None where it is undefined."""

    test: str
    run: int | None
    studentized: float | None
    p: float | None


class Diagnostics(Record):
    """Runs and tests: Shapiro-Wilk on the standardized residuals, the largest studentized one by Bonferroni.

    ``high_leverage`` and ``influential`` list runs (from 1).
    """

    runs: list[RunDiagnostics]
    normality: Normality
    outlier: Outlier
    high_leverage: list[int]
    influential: list[int]


def diagnose(solution: LeastSquares, response: Array) -> Diagnostics:
    """Diagnostics of a least-squares fit to ``response`` (n,)."""
    free = 1.0 - solution.leverage
    tested = (free > EXACT) & (solution.mean_square > 0)
    safe = np.where(tested, free, 1.0)
    standardized = np.where(tested, solution.residuals / np.sqrt(safe * (solution.mean_square or 1.0)), np.nan)
    # A run with the whole residual leaves no scatter for its own test.
    deleted = solution.dof - standardized**2
    judged = tested & (deleted > EXACT * solution.dof) & (solution.dof > 1)
    rescaled = standardized * np.sqrt(max(solution.dof - 1, 0) / np.where(judged, deleted, 1.0))
    studentized = np.where(judged, rescaled, np.nan)
    cook = standardized**2 * solution.leverage / safe / len(solution.coefficients)
    prediction, runs = response - solution.residuals, range(1, len(response) + 1)
    figures = response, prediction, solution.residuals, standardized, studentized, solution.leverage, cook
    rows = zip(runs, *([finite(value) for value in column.tolist()] for column in figures), strict=True)
    high = solution.leverage > HIGH_LEVERAGE * len(solution.coefficients) / len(response)
    return Diagnostics(
        runs=[RunDiagnostics(*row) for row in rows],
        normality=_normality(standardized[tested]),
        outlier=_outlier(studentized, solution.dof - 1),
        high_leverage=(np.flatnonzero(high) + 1).tolist(),
        influential=(np.flatnonzero(np.nan_to_num(cook) > INFLUENTIAL) + 1).tolist(),
    )


def _normality(standardized: Array) -> Normality:
    if len(standardized) < 3 or np.ptp(standardized) == 0:
        return Normality("Shapiro-Wilk", None, None)
    test = stats.shapiro(standardized)
    return Normality("Shapiro-Wilk", float(test.statistic), float(test.pvalue))


def _outlier(studentized: Array, dof: int) -> Outlier:
    defined = np.flatnonzero(np.isfinite(studentized))
    test = "Bonferroni on the largest externally studentized residual"
    if not defined.size:
        return Outlier(test, None, None, None)
    run = int(defined[np.abs(studentized[defined]).argmax()])
    p = min(1.0, defined.size * 2 * float(stats.t.sf(abs(studentized[run]), dof)))
    return Outlier(test, run + 1, float(studentized[run]), p)


def describe_diagnostics(diagnostics: Diagnostics, alpha: float) -> list[str]:
    """Residual tests in sentences."""
    tests = _say_normality(diagnostics.normality.p, alpha), _say_outlier(diagnostics.outlier, alpha)
    return [*filter(None, tests), _say_runs(diagnostics)]


def _say_normality(p: float | None, alpha: float) -> str:
    if p is None:
        return ""
    if p > alpha:
        return f"the residuals look normal (Shapiro-Wilk, {p_text(p)}), as the tests and intervals assume."
    return (
        f"the residuals are not normal (Shapiro-Wilk, {p_text(p)}): p values and intervals are rough; look for an "
        "outlier, a missing term or a transform."
    )


def _say_outlier(outlier: Outlier, alpha: float) -> str:
    p = outlier.p
    if p is None:
        return ""
    run = f"run {outlier.run} (studentized residual {outlier.studentized:+.2f}, Bonferroni {p_text(p)})"
    if p > alpha:
        return f"no run is an outlier; the most extreme is {run}."
    return f"{run} is an outlier: check this run before you trust or remove it."


def _say_runs(diagnostics: Diagnostics) -> str:
    parts = []
    if diagnostics.influential:
        listed = _list(diagnostics.influential)
        parts.append(f"{listed} alone would move the surface beyond its own error (Cook's distance above 1)")
    if diagnostics.high_leverage:
        parts.append(f"{_list(diagnostics.high_leverage)}: high leverage (above twice the mean)")
    return f"{'; '.join(parts)}." if parts else "no run has undue leverage or influence."


def p_text(p: float) -> str:
    """Text of a p value."""
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"


def _list(runs: list[int]) -> str:
    return f"run{'s' if len(runs) > 1 else ''} {', '.join(map(str, runs))}"


class KnownVariance(Record):
    """Comparison of a fit with known variances.

    ``chi_square``: of the residual over the known variance, with ``df``, its mean for a true model, and ``p``.
    ``pure_error_ratio``: pure error over the replicate variance at the repeated points, with a two-sided ``pure_error_p``, both
    None without repeats. ``covariance``: of the surface's coefficients by the known variances alone, with ``standard_errors``.
    ``dof``: of the variance of one run, None where it is known exactly.
    """

    chi_square: float
    df: int
    p: float
    mean_square_ratio: float = derived(lambda self: self.chi_square / self.df)
    pure_error_ratio: float | None
    pure_error_p: float | None
    dof: float | None = keyed("variance_dof")
    standard_errors: Array = derived(lambda self: np.sqrt(np.diag(self.covariance)))
    covariance: Array

    @property
    def refuted(self) -> bool:
        """Whether repeated runs scatter by another variance."""
        return self.pure_error_p is not None and self.pure_error_p <= REFUTED


def compare(
    fit: LeastSquares, matrix: Array, response: Array, variances: Array, replicates: Whole, groups: Whole, count: int
) -> tuple[KnownVariance, AnovaRow]:
    """Compare the residual and the pure error of a fit with the ``variances`` (n,) of the runs; also the row of the latter.

    ``matrix`` (n, p): of the fit, with the surface in its first ``count`` columns. ``groups`` (n,): repeated points.
    ``replicates`` (n,): number behind each variance, 0 for variances taken as exact. The residual sum over the mean variance
    is the chi-square.
    """
    few = replicates[replicates > 1]
    dof = 1.0 / float(np.mean(1.0 / (few - 1))) if few.size else None
    df = fit.dof
    chi_square = fit.residual_sum / float(variances.mean())
    project = fit.inverse[:count] @ matrix.T
    pure_error = _pure_error_row(response, variances, groups, dof)
    known = KnownVariance(
        chi_square=chi_square,
        df=df,
        p=_upper_tail(variances, dof, chi_square, df),
        pure_error_ratio=pure_error.f,
        pure_error_p=pure_error.p,
        covariance=(project * variances) @ project.T,
        dof=dof,
    )
    return known, pure_error


def describe_known_variance(variance: KnownVariance, alpha: float) -> list[str]:
    """The comparison in sentences; the test of the residual belongs to that of lack of fit."""
    share = math.sqrt(variance.mean_square_ratio)
    sentences = [
        f"chi-square of the residual over the known variance is {variance.chi_square:.4g} on {variance.df} degrees of freedom"
        f". Standard errors come from the residual and are "
        f"{share:.3g} times the standard errors by the known variance alone."
    ]
    f, p = variance.pure_error_ratio, variance.pure_error_p
    if f is None or p is None:
        return sentences
    scatter = f"the variance of repeated runs is {f:.3g} times the variance of their replicates ({p_text(p)})"
    if p > alpha:
        return [*sentences, f"{scatter}: the two agree, so the errors of the runs are reliable."]
    cause = (
        "the runs differ by more than their replicates show"
        if f > 1
        else "the errors of the runs are too large, or repeated runs share seeds"
    )
    return [*sentences, f"{scatter}: {cause}; rely on tests against pure error."]


def _upper_tail(variances: Array, dof: float | None, chi_square: float, df: int) -> float:
    """Probability of a larger sum of squares in the unit of a variance known to ``dof`` degrees of freedom a run."""
    if dof is None:
        return float(special.chdtrc(df, chi_square))
    # The mean of all variances, each known to ``dof`` degrees of freedom.
    total = dof * float(variances.sum() ** 2 / (variances**2).sum())
    return float(special.fdtrc(df, total, chi_square / df))


def _pure_error_row(response: Array, variances: Array, groups: Whole, dof: float | None) -> AnovaRow:
    labels, sizes = np.unique(groups, return_counts=True)
    df = len(groups) - len(labels)
    if df == 0:
        return AnovaRow(source="replicate_variance", ss=None, df=None, ms=float(variances.mean()), f=None, p=None)
    means = [(1 - 1 / size) * variances[groups == label].sum() for label, size in zip(labels, sizes, strict=True)]
    mean_square = float(sum(means)) / df
    f = ratio(sum_within(response, groups) / df, mean_square)
    repeated = variances[sizes[np.searchsorted(labels, groups)] > 1]
    tail = None if f is None else _upper_tail(repeated, dof, f * df, df)
    total_dof = None if dof is None else round(dof * len(repeated))
    p = None if tail is None else 2 * min(tail, 1 - tail)
    ss = None if total_dof is None else mean_square * total_dof
    return AnovaRow(source="replicate_variance", ss=ss, df=total_dof, ms=mean_square, f=f, p=p)


class ModelError(Record):
    """Variance of the lack of fit at a point, on the scale of the fit, with its ``dof`` and its ``source``."""

    variance: float
    dof: int
    source: Source
    standard_deviation: float = derived(lambda self: math.sqrt(self.variance))


def model_error(
    solution: LeastSquares, matrix: Array, groups: Whole, table: list[AnovaRow], known_variance: KnownVariance | None
) -> ModelError | None:
    """The model error of a fit, None where the scatter of the runs explains the residual.

    ``matrix`` (n, p): of the fit. ``groups`` (n,): repeated points. Known variances that the repeated runs refute do not count.
    """
    share = _share(solution, matrix, groups)
    lack, pure = find(table, "lack_of_fit"), find(table, "pure_error")
    beyond, dof = solution.residual_sum, solution.dof
    source: Source = "residual"
    if known_variance is not None and not known_variance.refuted:
        beyond *= 1.0 - known_variance.df / known_variance.chi_square if known_variance.chi_square else 0.0
        source = "known variance"
    elif pure.df:
        beyond, dof, source = (lack.ss or 0.0) - (lack.df or 0) * (pure.ms or 0.0), lack.df or 0, "repeats"
    return ModelError(beyond / share, dof, source) if share > 0.0 and dof > 0 and beyond > 0.0 else None


def correlation(points: Array, others: Array) -> Array:
    """Correlation (n, l) of the model error at coded points (n, k) and (l, k)."""
    apart = ((points[:, None, :] - others[None, :, :]) ** 2).sum(axis=-1)
    return np.exp(-apart / REACH**2)


def draw_fields(error: ModelError | None, coded: Array, draws: int, random: np.random.Generator) -> Array | None:
    """Random model errors (draws, n) at coded points (n, k); None without a model error."""
    if error is None:
        return None
    values, vectors = np.linalg.eigh(correlation(coded, coded))
    root = vectors * np.sqrt(values.clip(0.0) * error.variance)
    wide = np.sqrt(error.dof / random.chisquare(error.dof, (draws, 1)))
    return wide * (random.standard_normal((draws, len(coded))) @ root.T)


def _share(solution: LeastSquares, matrix: Array, groups: Whole) -> float:
    """Expected residual sum of a field of variance 1: the trace of its part outside the model."""
    member = (groups[:, None] == np.unique(groups)[None, :]).astype(float)
    inside = matrix.T @ member
    return float((member**2).sum() - np.einsum("pg,pq,qg", inside, solution.inverse, inside))
