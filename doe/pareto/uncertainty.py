"""What the errors of fitted surfaces make of a front, of a pick and of its gain over a baseline.

Coefficients of a least-squares surface follow a multivariate t distribution about their estimates. One draw of them
is one surface that the runs might as well have come from; all points on it share its error, and so does a difference
of two points.

Source: Box and Tiao, Bayesian Inference in Statistical Analysis, section 2.7.
"""

import math
from dataclasses import dataclass

import numpy as np

from doe.arrays import Array, Mask
from doe.pareto.archive import dominates
from doe.pareto.goals import Goals
from doe.pareto.picks import Rule, pick_all

SELECTIONS = 300  # draws on which the rule picks anew; its own error then hides in that of the gain


@dataclass(frozen=True, eq=False)
class FrontUncertainty:
    """How sure a front is.

    ``non_dominated`` (f,): probability that a front point is dominated by none of the others. ``pick_dominates``: probability that the
    pick dominates the baseline. Probabilities carry their Monte Carlo standard errors. ``optimism`` (q,): by how much
    the rule promises too large a gain of each cost, because it picks what the errors flatter.
    """

    non_dominated: Array
    pick_dominates: float
    pick_dominates_error: float
    optimism: Array
    draws: int


def draw_coefficients(
    coefficients: Array, covariance: Array, dof: int, draws: int, random: np.random.Generator
) -> Array:
    """Draws (draws, p) of coefficients (p,) from the multivariate t of ``dof`` degrees of freedom.

    ``covariance`` (p, p) is the estimated covariance of the coefficients, the scale matrix of the distribution.
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(values.clip(0.0))
    normal = random.standard_normal((draws, coefficients.size)) @ root.T
    return coefficients + normal / np.sqrt(random.chisquare(dof, (draws, 1)) / dof)


def share(hits: Mask) -> tuple[Array, Array]:
    """Share of the draws (d, ...) that hit and its Monte Carlo standard error.

    The error is that of the share with one hit and one miss more, lest a few hundred hits of as many pass for sure.
    """
    count = len(hits)
    mean = hits.mean(axis=0)
    careful = (hits.sum(axis=0) + 1.0) / (count + 2.0)
    return mean, np.sqrt(careful * (1.0 - careful) / count)


def non_dominated_share(costs: Array) -> Array:
    """Probability (f,) that a point is dominated by no other, from drawn costs (d, f, q)."""
    from pymoo.util.nds.non_dominated_sorting import find_non_dominated

    undominated = np.zeros(costs.shape[:2], dtype=bool)
    for row, drawn in zip(undominated, costs, strict=True):
        row[find_non_dominated(drawn)] = True
    return undominated.mean(axis=0)


def front_uncertainty(
    drawn: Array, goals: Goals, values: Array, pick: int, rule: Rule, baseline: Array, original: Array
) -> FrontUncertainty:
    """How sure a front is, from drawn responses.

    drawn : responses (d, f, m) of the front's points on each drawn set of surfaces.
    goals : what is wanted of the responses.
    values : responses (f, m) on the fitted surfaces.
    pick, rule : row of the pick and the rule that made it.
    baseline, original : responses (d, m) of the baseline on the drawn surfaces and (m,) on the fitted ones.
    """
    costs, base = goals.costs(drawn), goals.costs(baseline)
    wins, error = share(dominates(costs[:, pick], base))
    real = goals.costs(original) - goals.costs(values)
    optimism = selection_optimism(costs[:SELECTIONS], base[:SELECTIONS], real, goals, rule)
    sure = float(wins), float(error)
    return FrontUncertainty(non_dominated_share(costs), *sure, optimism, len(drawn))


def selection_optimism(costs: Array, baseline: Array, real: Array, goals: Goals, rule: Rule) -> Array:
    """Mean excess (q,) of the gain that a rule promises at its pick over the gain that is there.

    With the fitted surfaces in the place of the truth and drawn ones in that of the fit (parametric bootstrap):
    ``costs`` (d, f, q) and ``baseline`` (d, q) are drawn, ``real`` (f, q) are the gains on the fitted surfaces.
    """
    excess = []
    for drawn, base in zip(costs, baseline, strict=True):
        row = pick_all(drawn, goals, base)[0][rule]
        excess.append(base - drawn[row] - real[row])
    return np.mean(excess, axis=0)


def contrast_error(jacobian: Array, covariance: Array) -> float:
    """Standard error of a difference of predictions: ``jacobian`` (p,) is the difference of their derivatives
    by the coefficients, ``covariance`` (p, p) that of the coefficients. The error that both share cancels.
    """
    return math.sqrt(max(float(jacobian @ covariance @ jacobian), 0.0))
