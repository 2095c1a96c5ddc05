"""Terms of a polynomial in lettered factors and their columns: "1", "A", "AB" (product), "A^2" (square)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import combinations
from string import ascii_uppercase

import numpy as np
from numpy.typing import ArrayLike

from doe.arrays import Array, Rows


def model_terms(factors: int, model: str) -> tuple[str, ...]:
    """Terms of a model: "linear", "interaction" (with products of two factors), else the full second order.

    A model that is reduced by the data needs runs for all terms that it starts from.
    """
    letters = ascii_uppercase[:factors]
    products = [a + b for a, b in combinations(letters, 2)] if model != "linear" else []
    squares = [f"{letter}^2" for letter in letters] if model not in ("linear", "interaction") else []
    return ("1", *letters, *products, *squares)


def term_powers(terms: Sequence[str], factors: int) -> Rows:
    """Power of each factor in each term, shape (p, k)."""
    powers = np.zeros((len(terms), factors), dtype=np.intp)
    for row, term in enumerate(terms):
        for letter, power in re.findall(r"([A-Z])(?:\^(\d+))?", term):
            powers[row, ascii_uppercase.index(letter)] += int(power or 1)
    return powers


def term_columns(coded: ArrayLike, terms: Sequence[str]) -> Array:
    """Columns of ``terms`` at coded points (..., k), shape (..., p)."""
    points = np.asarray(coded, float)
    powers = term_powers(terms, points.shape[-1])
    columns = [np.prod([points[..., k] ** row[k] for k in np.flatnonzero(row)], axis=0) for row in powers]
    return np.stack(np.broadcast_arrays(*columns, points[..., 0])[:-1], axis=-1)
