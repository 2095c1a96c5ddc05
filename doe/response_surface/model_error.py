"""What a surface misses beyond the scatter of its runs, as an error of its predictions.

Where lack of fit is significant, the response is the model plus a random field: of mean zero, of one variance, alike
within a coded unit and strange to itself farther away, so that distinct runs of a design hardly share it. The mean
square of lack of fit less that of pure error, over the runs' share in it, estimates its variance (a component of
variance, by the expectation of the sum of squares). A prediction misses by the error of the coefficients and by the
field; an interval joins the two as root sum square, with Student's t on the degrees of freedom of what told the field.
Where lack of fit is not significant there is no field, and every interval is that of the textbook.

Sources: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 2.7; Sacks, Welch, Mitchell and
Wynn, Design and analysis of computer experiments, Stat. Sci. 4 (1989), for the field; Searle, Casella and McCulloch,
Variance Components (1992), for the estimate.
"""

import math
from typing import Literal

import numpy as np

from doe.arrays import Array, Whole
from doe.response_surface.anova import AnovaRow, find
from doe.response_surface.known_variance import KnownVariance
from doe.response_surface.least_squares import LeastSquares
from rbdyn.records.record import Record, derived, keyed

Source = Literal["repeats", "known variance"]

SIGNIFICANT = 0.05
REACH = 1.0  # coded units within which what a surface misses stays alike: half the edge of the cube of a design


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

    ``matrix`` (n, p) is that of the fit and ``groups`` (n,) marks repeated points. Repeated runs tell it (lack of fit
    against pure error), or the known variance of the replicates; where both do, the larger counts. A known variance
    that the repeated runs refute tells nothing.
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
