"""Backward elimination: the least significant term goes, again and again, hierarchy kept."""

from collections.abc import Callable
from typing import TypedDict

from doe.designs.model import needed
from doe.response_surface.anova import term_rows
from doe.response_surface.least_squares import LeastSquares

KEEP_BELOW = 0.05  # p-value up to which a term stays


class Removal(TypedDict):
    """A term that went, with its F and p among the terms that were left then."""

    term: str
    f: float
    p: float


def eliminate(
    terms: tuple[str, ...], solve_for: Callable[[tuple[str, ...]], LeastSquares]
) -> tuple[tuple[str, ...], list[Removal]]:
    """Terms left, and those removed in their order.

    The term of largest p above `KEEP_BELOW` goes, except the constant and what a remaining interaction or
    square is built on. ``solve_for`` fits a set of terms.
    """
    removed: list[Removal] = []
    while True:
        removable = [
            Removal(term=row["source"], f=row["f"], p=row["p"])
            for row in term_rows(terms, solve_for(terms))
            if row["f"] is not None
            and row["p"] is not None
            and row["p"] > KEEP_BELOW
            and not needed(row["source"], terms)
        ]
        if not removable:
            return terms, removed
        removed.append(max(removable, key=lambda removal: (removal["p"], removal["term"])))
        terms = tuple(term for term in terms if term != removed[-1]["term"])
