"""Canonical analysis of a quadratic: its stationary point, the axes of its curvature, and the errors of these.

Sources: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 6.3-6.4 for nature and ridges; Bisgaard
and Ankenman, Standard errors for the eigenvalues in second-order response surface models (1996).
"""

from string import ascii_uppercase
from typing import Literal

import numpy as np
from scipy import special

from doe.designs import to_actual
from doe.designs.model import Terms, model_matrix, second_order
from doe.response_surface.least_squares import Data
from rbdyn.base.arrays import Array
from rbdyn.base.estimate import LEVEL
from rbdyn.base.records import Record

FLAT = 1e-10  # curvature as a share of the largest coefficient below which it is rounding
Nature = Literal["minimum", "maximum", "saddle"]


class StationaryPoint(Record):
    """Point of zero gradient; ``eigenvalues`` of the matrix of second-order coefficients."""

    coded: list[float]
    actual: list[float]
    eigenvalues: list[float]
    nature: Nature


class Canonical(Record):
    """Curvature with its error, and the nature of the stationary point.

    ``eigenvalues`` ascend; ``eigenvalue_errors`` are half widths of their 95 % intervals, None without a residual.
    ``eigenvectors[i]`` is the axis of ``eigenvalues[i]`` in coded units. ``nature`` is "minimum", "maximum" or "saddle". When
    an eigenvalue is within its error of zero, it is "stationary ridge" with the stationary point in the region, else
    "rising ridge". ``inside``: whether the point is in the region of the runs. ``distance``: from the centre (coded).
    """

    eigenvalues: list[float]
    eigenvalue_errors: list[float] | None
    eigenvectors: list[list[float]]
    nature: str
    inside: bool | None
    distance: float | None


def canonical(
    terms: Terms, coefficients: Array, covariance: Array, dof: int, data: Data
) -> tuple[StationaryPoint | None, Canonical | None]:
    """The stationary point and the canonical analysis of a surface fitted to ``data``.

    The point is None where a direction has no curvature, the analysis None without second-order terms.
    """
    factors = data.points.shape[1]
    _, gradient, matrix = second_order(terms, coefficients, factors)
    if not any(len(term) > 1 for term in terms):
        return None, None
    eigenvalues, vectors = (part.astype(float) for part in np.linalg.eigh(matrix))
    vectors = vectors * np.sign(vectors[np.abs(vectors).argmax(axis=0), np.arange(factors)])
    errors = _errors(terms, vectors, covariance, dof) if covariance.any() else None
    flat = np.abs(eigenvalues) <= FLAT * np.abs(coefficients).max()
    unsure = flat if errors is None else flat | (np.abs(eigenvalues) <= errors)
    sign: Nature = "minimum" if eigenvalues.min() > 0 else "maximum" if eigenvalues.max() < 0 else "saddle"
    stationary, inside, distance = None, None, None
    if not flat.any():
        place = np.linalg.solve(-2 * matrix, gradient).astype(float)
        inside, distance = _inside(place, data.points), float(np.linalg.norm(place))
        actual = to_actual(place, data.centre, data.step).tolist()
        coded, values = place.tolist(), np.linalg.eigvalsh(matrix).tolist()
        stationary = StationaryPoint(coded=coded, actual=actual, eigenvalues=values, nature=sign)
    ridge = "stationary ridge" if inside else "rising ridge"
    return stationary, Canonical(
        eigenvalues=eigenvalues.tolist(),
        eigenvalue_errors=None if errors is None else errors.tolist(),
        eigenvectors=vectors.T.tolist(),
        nature=ridge if unsure.any() else sign,
        inside=inside,
        distance=distance,
    )


def describe_canonical(analysis: Canonical, place: StationaryPoint | None) -> str:
    """Canonical analysis in a sentence."""
    values = ", ".join(f"{value:.3g}" for value in analysis.eigenvalues)
    if place is None:
        return f"there is no single stationary point, for one direction has no curvature (eigenvalues {values})."
    where = ", ".join(f"{letter} = {x:.3g}" for letter, x in zip(ascii_uppercase, place.coded, strict=False))
    region = "inside" if analysis.inside else "outside"
    head = f"the stationary point at {where} (coded), {region} the region of the runs, is a {analysis.nature}"
    if "ridge" not in analysis.nature:
        if analysis.inside:
            return f"{head} (eigenvalues {values})."
        return f"{head} (eigenvalues {values}); the best point is on the border of the region."
    axis = int(np.argmin(np.abs(analysis.eigenvalues)))
    lettered = zip(ascii_uppercase, analysis.eigenvectors[axis], strict=False)
    direction = " ".join(f"{x:+.2f} {letter}" for letter, x in lettered)
    return (
        f"{head} (eigenvalues {values}, one within its error of zero): its position along {direction} is undetermined."
    )


def _errors(terms: Terms, vectors: Array, covariance: Array, dof: int) -> Array:
    """Half widths by first order: the eigenvalue v'Bv changes with the coefficient of x_i x_j by v_i v_j."""
    second = np.array([len(term) > 1 for term in terms])
    slopes = model_matrix(vectors.T, terms) * second
    variance = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    return special.stdtrit(dof, (1 + LEVEL) / 2) * np.sqrt(variance.clip(0.0))


def _inside(place: Array, points: Array) -> bool:
    """Within the box of the runs and no farther from the centre than the farthest of them."""
    in_box = bool(((points.min(axis=0) <= place) & (place <= points.max(axis=0))).all())
    return in_box and bool(np.linalg.norm(place) <= np.linalg.norm(points, axis=1).max())
