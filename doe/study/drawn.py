"""Surfaces seen through other coefficients: drawn ones, and how predictions change with them.

A surface whose ``coefficients`` are a matrix (p, d) predicts a column a draw, in the units of the response.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from doe.pareto.quadratic import Quadratic
    from doe.response_surface import Surface

Array = NDArray[np.float64]

SMALL_STEP = 1e-3  # of a derivative by a coefficient, in standard errors of it


def draw_surfaces(surfaces: Sequence[Surface], draws: int, seed: int) -> list[Surface]:
    """Surfaces whose coefficients (p, draws) are drawn from their multivariate t, independently by response."""
    from doe.pareto.uncertainty import draw_coefficients

    random = np.random.default_rng(seed)
    return [
        replace(
            surface,
            coefficients=draw_coefficients(
                surface.coefficients, surface.covariance, surface.residual_dof, draws, random
            ).T,
        )
        for surface in surfaces
    ]


def predict_all(surfaces: Sequence[Surface], coded: Array) -> Array:
    """Responses (n, m) at coded points (n, k)."""
    return np.column_stack([surface.predict(coded) for surface in surfaces])


def predict_draws(drawn: Sequence[Surface], coded: Array) -> Array:
    """Responses (d, n, m) of drawn surfaces at coded points (n, k)."""
    return np.stack([surface.predict(coded).T for surface in drawn], axis=-1)


def predict_paired(drawn: Sequence[Surface], coded: Array) -> Array:
    """Responses (n, m) at coded points (n, k), each on the drawn surfaces of its own row."""
    from doe.response_surface.surface import model_matrix

    columns = [
        link_of(surface)(np.einsum("np,pn->n", model_matrix(coded, surface.terms), surface.coefficients))
        for surface in drawn
    ]
    return np.column_stack(columns)


def jacobian(surface: Surface, coded: Array) -> Array:
    """Derivatives (p,) of the prediction at a coded point (k,) by the coefficients; the model's own row where the
    response was fitted as it is.
    """
    step = SMALL_STEP * np.sqrt(np.diag(surface.covariance))
    step = np.where(step > 0.0, step, SMALL_STEP)
    shifts = np.diag(step)
    both = surface.coefficients[:, None] + np.hstack([shifts, -shifts])
    values = replace(surface, coefficients=both).predict(coded)
    derivatives: Array = (values[: step.size] - values[step.size :]) / (2.0 * step)
    return derivatives


def link_of(surface: Surface) -> Callable[[Array], Array]:
    """From the linear predictor to the units of the response: identity unless the response was transformed."""
    from doe.pareto.quadratic import identity

    plain = getattr(surface, "transform", None) in (None, "none")
    return identity if plain else partial(_through, surface)


def _through(surface: Surface, predictor: Array) -> Array:
    """A surface of a constant alone predicts the link of that constant."""
    flat = predictor.ravel()
    coefficients = np.zeros((len(surface.terms), flat.size))
    coefficients[surface.terms.index("1")] = flat
    centre = np.zeros(max((ord(letter) - 64 for term in surface.terms for letter in term[:1]), default=1))
    values: Array = replace(surface, coefficients=coefficients).predict(centre)
    return values.reshape(predictor.shape)


def quadratics(surfaces: Sequence[Surface], factors: int) -> list[Quadratic]:
    """The surfaces as quadratics of the coded factors."""
    from doe.pareto.quadratic import Quadratic

    return [
        Quadratic.of(surface.terms, surface.coefficients, factors, link_of(surface)) for surface in surfaces
    ]
