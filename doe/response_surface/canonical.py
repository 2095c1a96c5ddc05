"""Canonical analysis: where the gradient vanishes, along which axes the surface bends, and how surely.

Sources: Myers, Montgomery and Anderson-Cook, 4th ed., 6.3-6.4 (nature, ridges); Bisgaard and Ankenman,
Standard errors for the eigenvalues in second-order response surface models (1996).
"""

from string import ascii_uppercase
from typing import Literal, TypedDict

import numpy as np
from scipy import special

from doe.arrays import Array
from doe.designs import to_actual
from doe.designs.model import model_matrix, second_order

FLAT = 1e-10  # curvature as a share of the largest coefficient below which it is rounding
SURE = 0.95  # probability of the intervals of the eigenvalues


class StationaryPoint(TypedDict):
    """Where the gradient vanishes; ``eigenvalues`` are those of the matrix of second-order coefficients."""

    coded: list[float]
    actual: list[float]
    eigenvalues: list[float]
    nature: Literal["minimum", "maximum", "saddle"]


class Canonical(TypedDict):
    """Curvature with its error, and what the stationary point is worth.

    ``eigenvalues`` ascend, ``eigenvalue_errors`` are half widths of their 95 % intervals (None without a
    residual), ``eigenvectors[i]`` is the axis of ``eigenvalues[i]`` in coded units. ``nature`` is "minimum",
    "maximum" or "saddle", or, when an eigenvalue is within its error of zero, "stationary ridge" (the
    stationary point lies in the region) or "rising ridge" (it lies outside or is none). ``inside`` says
    whether the point is in the region of the runs and ``distance`` how far it is from the centre (coded).
    """

    eigenvalues: list[float]
    eigenvalue_errors: list[float] | None
    eigenvectors: list[list[float]]
    nature: str
    inside: bool | None
    distance: float | None


def stationary_point(terms: tuple[str, ...], coefficients: Array, centre: Array, step: Array) -> StationaryPoint | None:
    """The single stationary point, or None where a direction does not bend."""
    _, gradient, matrix = second_order(terms, coefficients, centre.size)
    eigenvalues = np.linalg.eigvalsh(matrix).astype(float)
    if np.abs(eigenvalues).min() <= FLAT * np.abs(coefficients).max():
        return None
    coded = np.linalg.solve(-2 * matrix, gradient)
    return StationaryPoint(
        coded=coded.tolist(),
        actual=to_actual(coded, centre, step).tolist(),
        eigenvalues=eigenvalues.tolist(),
        nature=_nature(eigenvalues),
    )


def canonical(
    terms: tuple[str, ...], coefficients: Array, covariance: Array, dof: int, points: Array
) -> Canonical | None:
    """Canonical analysis of a surface fitted to runs at ``points`` (n, k); None without second-order terms."""
    factors = points.shape[1]
    _, gradient, matrix = second_order(terms, coefficients, factors)
    if not any(len(term) > 1 for term in terms):
        return None
    eigenvalues, vectors = (part.astype(float) for part in np.linalg.eigh(matrix))
    vectors = vectors * np.sign(vectors[np.abs(vectors).argmax(axis=0), np.arange(factors)])
    errors = _errors(terms, vectors, covariance, dof) if covariance.any() else None
    flat = np.abs(eigenvalues) <= FLAT * np.abs(coefficients).max()
    unsure = flat if errors is None else flat | (np.abs(eigenvalues) <= errors)
    place = None if flat.any() else np.linalg.solve(-2 * matrix, gradient).astype(float)
    inside = None if place is None else _inside(place, points)
    ridge = "stationary ridge" if inside else "rising ridge"
    return Canonical(
        eigenvalues=eigenvalues.tolist(),
        eigenvalue_errors=None if errors is None else errors.tolist(),
        eigenvectors=vectors.T.tolist(),
        nature=ridge if unsure.any() else _nature(eigenvalues),
        inside=inside,
        distance=None if place is None else float(np.linalg.norm(place)),
    )


def describe_canonical(name: str, found: Canonical, place: StationaryPoint | None) -> str:
    """Canonical analysis in a sentence."""
    values = ", ".join(f"{value:.3g}" for value in found["eigenvalues"])
    if place is None:
        return f"{name}: no single stationary point, for a direction does not bend (eigenvalues {values})."
    where = ", ".join(f"{letter} = {x:.3g}" for letter, x in zip(ascii_uppercase, place["coded"], strict=False))
    region = "inside" if found["inside"] else "outside"
    head = f"{name}: stationary point at {where} (coded), {region} the region of the runs, "
    if "ridge" not in found["nature"]:
        kind = f"a {found['nature']} (eigenvalues {values})"
        return head + kind + ("." if found["inside"] else "; the best point lies on the border of the region.")
    axis = int(np.argmin(np.abs(found["eigenvalues"])))
    direction = " ".join(
        f"{x:+.2f} {letter}" for letter, x in zip(ascii_uppercase, found["eigenvectors"][axis], strict=False)
    )
    return (
        f"{head}a {found['nature']}: an eigenvalue of {values} is within its error of zero, so the response "
        f"hardly bends along {direction} and the place along it is not determined."
    )


def _nature(eigenvalues: Array) -> Literal["minimum", "maximum", "saddle"]:
    return "minimum" if eigenvalues.min() > 0 else "maximum" if eigenvalues.max() < 0 else "saddle"


def _errors(terms: tuple[str, ...], vectors: Array, covariance: Array, dof: int) -> Array:
    """Half widths: an eigenvalue v'Bv changes with the coefficient of x_i x_j by v_i v_j, to first order."""
    second = np.array([len(term) > 1 for term in terms])
    slopes = model_matrix(vectors.T, terms) * second
    variance = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    return special.stdtrit(dof, (1 + SURE) / 2) * np.sqrt(variance.clip(0.0))


def _inside(place: Array, points: Array) -> bool:
    """Within the box of the runs and no farther from the centre than the farthest of them."""
    in_box = bool(((points.min(axis=0) <= place) & (place <= points.max(axis=0))).all())
    return in_box and bool(np.linalg.norm(place) <= np.linalg.norm(points, axis=1).max())
