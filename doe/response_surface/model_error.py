"""What the known variance of each run says next to the scatter of the runs, and what a surface misses beyond that scatter, as
an error of its predictions.

Known variances are those of replicates of the simulation. The residuals over them give a test of lack of fit that needs
no repeated design points; repeated points show whether the replicates know all of the scatter. A variance of few
replicates is itself uncertain: the tests allow for it, and with weights from few replicates they err on the safe side
(with 8, a true surface is doubted at 5 % in 1 to 2 % of fits; with equal weights in 5 %).

Where lack of fit is significant, the response is the model plus a random field: of mean zero, of one variance, alike
within a coded unit and strange to itself farther away, so that distinct runs of a design hardly share it. The mean
square of lack of fit less that of pure error, over the runs' share in it, estimates its variance (a component of
variance, by the expectation of the sum of squares). A prediction misses by the error of the coefficients and by the
field; an interval joins the two as root sum square, with Student's t on the degrees of freedom of the source of the field.
Where lack of fit is not significant there is no field, and every interval is that of the textbook.

Sources: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 2.7; Sacks, Welch, Mitchell and
Wynn, Design and analysis of computer experiments, Stat. Sci. 4 (1989), for the field; Searle, Casella and McCulloch,
Variance Components (1992), for the estimate; Satterthwaite, An approximate distribution of estimates of variance
components (1946), and Welch (1951), for known variances.
"""

import math
from typing import Literal

import numpy as np
from scipy import special

from doe.response_surface.anova import AnovaRow, find, p_text, ratio, sum_within
from doe.response_surface.least_squares import LeastSquares
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.records import Record, derived, keyed, outside_json

Source = Literal["repeats", "known variance"]

SIGNIFICANT = 0.05
REACH = 1.0  # coded units within which what a surface misses stays alike: half the edge of the cube of a design


class KnownVariance(Record):
    """Comparison of a fit with known variances.

    ``chi_square`` of the residual over the known variance, with ``df`` and ``p``; ``pure_error`` is the ANOVA
    row of the replicate variance at the repeated points, whose ``f`` is pure error over it and whose ``p`` is
    two-sided (f and p None without repeats); ``covariance`` of the surface's coefficients from the known
    variances alone and their ``standard_errors``; ``dof`` of the variance of one run (None: known exactly).
    """

    chi_square: float
    df: int
    p: float | None
    mean_square_ratio: float = derived(lambda self: self.chi_square / self.df)
    pure_error_ratio: float | None = derived(lambda self: self.pure_error["f"])
    pure_error_p: float | None = derived(lambda self: self.pure_error["p"])
    dof: float | None = keyed("variance_dof")
    standard_errors: Array = derived(lambda self: np.sqrt(np.diag(self.covariance)))
    covariance: Array
    pure_error: AnovaRow = outside_json()


def compare(
    fit: LeastSquares, matrix: Array, response: Array, variances: Array, replicates: Whole, groups: Whole, count: int
) -> KnownVariance:
    """Set the residual and the pure error of a fit against ``variances`` (n,) of the runs.

    ``matrix`` (n, p) is that of the fit, its first ``count`` columns those of the surface; ``groups`` (n,) marks
    repeated points; ``replicates`` (n,) are behind each variance (0: unknown, taken as known exactly). With weights
    1 / variance the residual sum is the chi-square; with equal weights it is divided by the mean variance.
    """
    unit = fit.weights * variances
    weighted = bool(np.ptp(fit.weights) > 0)
    few = replicates[replicates > 1]
    dof = 1.0 / float(np.mean(1.0 / (few - 1))) if few.size else None
    df = fit.dof
    chi_square = fit.residual_sum / float(unit.mean())
    project = fit.inverse[:count] @ (matrix * fit.weights[:, None]).T
    return KnownVariance(
        chi_square=chi_square,
        df=df,
        p=_upper_tail(unit, dof, weighted, chi_square, df),
        pure_error=_beside_pure_error(fit, response, unit, groups, dof, weighted),
        covariance=(project * variances) @ project.T,
        dof=dof,
    )


def describe_known_variance(known: KnownVariance, alpha: float) -> list[str]:
    """The comparison in sentences."""
    verdict = "too few replicates a run to say more)"
    if known.p is not None:
        verdict = f"{p_text(known.p)}), the surface misses {'no ' if known.p > alpha else ''}more than that explains"
    share = math.sqrt(known.mean_square_ratio)
    sentences = [
        f"against the known variance of the replicates chi-square is {known.chi_square:.4g} on {known.df} degrees of "
        f"freedom ({verdict}; standard errors here come from the residual and are {share:.3g} times those of the "
        "known variance alone."
    ]
    f, p = known.pure_error_ratio, known.pure_error_p
    if f is None or p is None:
        return sentences
    head = f"repeated runs scatter with {f:.3g} times the variance that their replicates give ({p_text(p)}): "
    if p > alpha:
        return [*sentences, head + "the two agree, so the errors of the runs can be relied on."]
    why = "the errors of the runs are too wide, or the repeated runs share their seeds"
    if f > 1:
        why = "more varies from run to run than the replicates show"
    return [*sentences, head + f"the two disagree; {why}, and tests against pure error count."]


def _upper_tail(unit: Array, dof: float | None, weighted: bool, chi_square: float, df: int) -> float | None:
    """Probability of a larger sum of squares in units of a variance known to ``dof`` degrees of freedom a run, None where
    the replicates are too few to say."""
    if dof is None:
        return float(special.chdtrc(df, chi_square))
    if not weighted:
        # The mean of all variances, each known to dof degrees of freedom.
        total = dof * float(unit.sum() ** 2 / (unit**2).sum())
        return float(special.fdtrc(df, total, chi_square / df))
    if dof <= 4:
        return None
    # Each squared residual over its own estimated variance is an F(1, dof): equal mean and variance
    # give a multiple of a chi-square.
    mean = dof / (dof - 2)
    spread = 2 * dof**2 * (dof - 1) / ((dof - 2) ** 2 * (dof - 4))
    scale = spread / (2 * mean)
    return float(special.chdtrc(df * mean / scale, chi_square / scale))


def _beside_pure_error(
    solution: LeastSquares, response: Array, unit: Array, groups: Whole, dof: float | None, weighted: bool
) -> AnovaRow:
    labels, sizes = np.unique(groups, return_counts=True)
    df = len(groups) - len(labels)
    if df == 0:
        return AnovaRow(source="replicate_variance", ss=None, df=None, ms=float(unit.mean()), f=None, p=None)
    means = [(1 - 1 / size) * unit[groups == label].sum() for label, size in zip(labels, sizes, strict=True)]
    mean_square = float(sum(means)) / df
    f = ratio(sum_within(response, solution.weights, groups) / df, mean_square)
    repeated = unit[sizes[np.searchsorted(labels, groups)] > 1]
    tail = None if f is None else _upper_tail(repeated, dof, weighted, f * df, df)
    known = None if dof is None else round(dof * len(repeated))
    p = None if tail is None else 2 * min(tail, 1 - tail)
    ss = None if known is None else mean_square * known
    return AnovaRow(source="replicate_variance", ss=ss, df=known, ms=mean_square, f=f, p=p)


class ModelError(Record):
    """Variance of what a surface misses anywhere, on the scale of the fit and ``dof`` degrees of freedom; ``source``: what shows it."""

    variance: float
    dof: int
    source: Source = keyed("told_by")
    standard_deviation: float = derived(lambda self: math.sqrt(self.variance))


def model_error(
    solution: LeastSquares, matrix: Array, groups: Whole, table: list[AnovaRow], known: KnownVariance | None
) -> ModelError | None:
    """The model error of a fit, None where no test at 5 % shows any.

    ``matrix`` (n, p) is that of the fit and ``groups`` (n,) marks repeated points. Repeated runs show it (lack of fit
    against pure error), or the known variance of the replicates; where both do, the larger counts. A known variance
    that the repeated runs refute shows nothing.
    """
    share = _share(solution, matrix, groups)
    if share <= 0.0:
        return None
    lack, pure = find(table, "lack_of_fit"), find(table, "pure_error")
    candidates = []
    if lack["p"] is not None and lack["p"] <= SIGNIFICANT and lack["ss"] is not None and lack["df"]:
        beyond = lack["ss"] - lack["df"] * (pure["ms"] or 0.0)
        candidates.append(ModelError(beyond / share, lack["df"], "repeats"))
    if known is not None and known.p is not None and known.p <= SIGNIFICANT and not _refuted(known):
        beyond = solution.residual_sum * (1.0 - known.df / known.chi_square)
        candidates.append(ModelError(beyond / share, known.df, "known variance"))
    return max((each for each in candidates if each.variance > 0.0), key=lambda each: each.variance, default=None)


def correlation(one: Array, other: Array) -> Array:
    """Correlation (n, l) of what a surface misses at coded points (n, k) and (l, k)."""
    apart = ((one[:, None, :] - other[None, :, :]) ** 2).sum(axis=-1)
    return np.exp(-apart / REACH**2)


def draw_fields(error: ModelError | None, coded: Array, draws: int, random: np.random.Generator) -> Array | None:
    """Fields (draws, n) that the surface might as well miss at coded points (n, k); None without a model error."""
    if error is None:
        return None
    values, vectors = np.linalg.eigh(correlation(coded, coded))
    root = vectors * np.sqrt(values.clip(0.0) * error.variance)
    wide = np.sqrt(error.dof / random.chisquare(error.dof, (draws, 1)))
    return wide * (random.standard_normal((draws, len(coded))) @ root.T)


def _share(solution: LeastSquares, matrix: Array, groups: Whole) -> float:
    """How much of the residual sum a field of variance 1 makes: the trace of its part outside of the model."""
    member = (groups[:, None] == np.unique(groups)[None, :]) * np.sqrt(solution.weights)[:, None]
    scaled = matrix * np.sqrt(solution.weights)[:, None]
    inside = scaled.T @ member
    return float((member**2).sum() - np.einsum("pg,pq,qg", inside, solution.inverse, inside))


def _refuted(known: KnownVariance) -> bool:
    f, p = known.pure_error["f"], known.pure_error["p"]
    return f is not None and p is not None and f > 1.0 and p <= SIGNIFICANT
