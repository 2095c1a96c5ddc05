"""Terms of a second-order polynomial in lettered factors: "1", "A", "AB" (product), "A^2" (square).

Which a model has, their columns, hierarchy, and the polynomial that they and their coefficients make. A prediction stands
in the innermost loop of every search, so no columns of powers are built here.
"""

from collections.abc import Collection, Sequence
from functools import cache
from itertools import combinations
from string import ascii_uppercase
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rbdyn.base.arrays import Array, Rows

Model = Literal["linear", "interaction", "pure_quadratic", "quadratic", "reduced"]
MODELS: tuple[str, ...] = get_args(Model)
Terms = tuple[str, ...]


def model_terms(factors: int, model: str, without: Collection[int] = ()) -> Terms:
    """Terms of a model: "linear", "interaction" (with products of two factors), "pure_quadratic" (with squares), else the
    full second order; none of the factors in the places ``without``.

    A model that is reduced by the data needs runs for all terms that it starts from.
    """
    letters = [letter for place, letter in enumerate(ascii_uppercase[:factors]) if place not in without]
    products = [a + b for a, b in combinations(letters, 2)] if model not in ("linear", "pure_quadratic") else []
    squares = [f"{letter}^2" for letter in letters] if model not in ("linear", "interaction") else []
    return ("1", *letters, *products, *squares)


def term_powers(terms: Sequence[str], factors: int) -> Rows:
    """Power of each factor in each term, shape (p, k)."""
    first, second = _pairs(tuple(terms))
    of_column = np.eye(factors + 1, dtype=np.intp)[:, 1:]
    return of_column[first] + of_column[second]


def needed(term: str, terms: Terms) -> bool:
    """Whether hierarchy keeps a term: the constant, or one that another term is built on."""
    return term == "1" or any(term in other for other in terms if other != term)


def model_matrix(coded: ArrayLike, terms: Sequence[str]) -> Array:
    """Columns of ``terms`` at coded points (..., k), shape (..., number of terms)."""
    points = np.asarray(coded, float)
    first, second = _pairs(tuple(terms))
    padded = np.concatenate([np.ones((*points.shape[:-1], 1)), points], axis=-1)
    return padded[..., first] * padded[..., second]


def second_order(terms: Terms, coefficients: Array, factors: int) -> tuple[float, Array, Array]:
    """Constant b0, gradient b (k,) and symmetric B (k, k) of b0 + b x + x' B x."""
    padded = np.zeros((factors + 1, factors + 1))
    for a, b, value in zip(*_pairs(terms), coefficients.tolist(), strict=True):
        padded[a, b] += value / 2
        padded[b, a] += value / 2
    return float(padded[0, 0]), 2 * padded[0, 1:], padded[1:, 1:]


def in_actual_units(terms: Terms, coefficients: Array, centre: Array, step: Array) -> Array:
    """Coefficients of the same terms in actual units, of a hierarchical model in coded ones."""
    constant, gradient, matrix = second_order(terms, coefficients, centre.size)
    matrix, gradient = matrix / np.outer(step, step), gradient / step
    constant += float(-gradient @ centre + centre @ matrix @ centre)
    gradient = gradient - 2 * matrix @ centre
    padded = np.block([[np.full((1, 1), constant), gradient[None] / 2], [gradient[:, None] / 2, matrix]])
    return np.array([padded[a, b] * (1 if a == b else 2) for a, b in zip(*_pairs(terms), strict=True)])


@cache
def _pairs(terms: Terms) -> tuple[list[int], list[int]]:
    """The two columns, of 1 and the factors, whose product each term is."""
    pairs = [_pair(term) for term in terms]
    return [a for a, _ in pairs], [b for _, b in pairs]


def _pair(term: str) -> tuple[int, int]:
    if term == "1":
        return 0, 0
    places = [ascii_uppercase.index(letter) + 1 for letter in term.removesuffix("^2")]
    if term.endswith("^2"):
        return places[0], places[0]
    return (0, places[0]) if len(places) == 1 else (places[0], places[1])
