"""Predictions of several surfaces at once: on drawn coefficients, and how they change with the coefficients."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy import special

from doe.arrays import Array
from doe.designs.model import second_order
from doe.pareto.front import draw_coefficients
from doe.pareto.manufacture import Quadratic, identity
from doe.response_surface import Surface, model_matrix
from doe.response_surface.box_cox import backward, slope
from doe.response_surface.model_error import draw_fields


def predict_all(surfaces: Sequence[Surface], coded: Array) -> Array:
    """Responses (n, m) at coded points (n, k)."""
    return np.column_stack([surface.predict(coded) for surface in surfaces])


def half_widths(surfaces: Sequence[Surface], coded: Array) -> Array:
    """95 % half widths (n, m) of the mean responses at coded points (n, k)."""
    reach = [special.stdtrit(surface.interval_dof, 0.975) for surface in surfaces]
    return np.column_stack([surface.prediction_standard_error(coded) for surface in surfaces]) * reach


def draw_all(surfaces: Sequence[Surface], draws: int, seed: int) -> list[Array]:
    """Coefficients (draws, p) of each surface, drawn from their multivariate t independently by response."""
    random = np.random.default_rng(seed)
    known = [(surface.coefficients, surface.covariance, surface.residual_dof) for surface in surfaces]
    return [draw_coefficients(*each, draws, random) for each in known]


def predict_draws(surfaces: Sequence[Surface], drawn: Sequence[Array], coded: Array, seed: int = 1) -> Array:
    """Responses (d, n, m) on drawn coefficients, and with what the models may miss, at coded points (n, k)."""
    random = np.random.default_rng(seed)
    columns = [
        surface.draws(coded, coefficients, draw_fields(surface.model_error, coded, len(coefficients), random))
        for surface, coefficients in zip(surfaces, drawn, strict=True)
    ]
    return np.stack(columns, axis=-1)


def predict_paired(surfaces: Sequence[Surface], drawn: Sequence[Array], coded: Array) -> Array:
    """Responses (n, m) at coded points (n, k), each on the drawn coefficients (n, p) of its own row."""
    columns = []
    for surface, coefficients in zip(surfaces, drawn, strict=True):
        columns.append(link_of(surface)((model_matrix(coded, surface.terms) * coefficients).sum(axis=-1)))
    return np.column_stack(columns)


def jacobian(surface: Surface, coded: Array) -> Array:
    """Derivatives (p,) of the prediction at a coded point (k,) by the coefficients."""
    row = model_matrix(coded, surface.terms)
    if surface.transform is None:
        return row
    return np.asarray(row / slope(surface.predict(coded), surface.transform))


def link_of(surface: Surface) -> Callable[[Array], Array]:
    """From the scale of the fit to the units of the response."""
    return identity if surface.transform is None else partial(backward, exponent=surface.transform)


def quadratics(surfaces: Sequence[Surface], factors: int) -> list[Quadratic]:
    """The surfaces as quadratics of the coded factors."""
    forms = [second_order(surface.terms, surface.coefficients, factors) for surface in surfaces]
    return [Quadratic(*form, link_of(surface)) for form, surface in zip(forms, surfaces, strict=True)]
