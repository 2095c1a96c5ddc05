"""What remains of a region where runs of a design failed: the points nearest to runs that went well.

A point counts as lost where a failed run lies nearer to it than any that went well: half-spaces midway between the two, so that
neither the shape nor the cause of what is lost needs to be known.
"""

from dataclasses import dataclass

import numpy as np

from doe.designs.model import Terms, model_matrix
from rbdyn.base.arrays import Array

# Makes information matrices comparable that do not estimate all terms.
RIDGE = 1e-6


@dataclass(frozen=True, eq=False)
class Remaining:
    """The region about coded points (n, k) of runs that went well (``ran``), apart from those that ``failed`` (f, k)."""

    ran: Array
    failed: Array

    def excess(self, coded: Array) -> Array:
        """How much nearer (n,) coded points (n, k) lie to a failed run than to one that went well; at most 0 in what remains."""
        return _distance(coded, self.ran) - _distance(coded, self.failed)


def _distance(points: Array, others: Array) -> Array:
    """Distance (n,) of points to the nearest of others."""
    nearest = np.full(len(points), np.inf)
    for other in others:
        np.minimum(nearest, np.linalg.norm(points - other, axis=1), out=nearest)
    return nearest


def added_points(points: Array, candidates: Array, terms: Terms, count: int) -> Array:
    """Points (count, k) among the candidates (c, k) that, with those of earlier runs (n, k), estimate the terms of a model best.

    One after another the candidate that raises the determinant of X'X most, the first of equal ones.

    Source: Dykstra, The augmentation of experimental data to maximize |X'X|, Technometrics 13 (1971) 682-688.
    """
    rows, columns = model_matrix(points, terms), model_matrix(candidates, terms)
    information = rows.T @ rows + RIDGE * np.eye(len(terms))
    places = []
    for _ in range(count):
        gains = np.einsum("ij,ij->i", columns @ np.linalg.inv(information), columns)
        # Last bits do not decide between equal gains.
        places.append(int((gains >= (1.0 - 1e-6) * gains.max()).argmax()))
        information += np.outer(columns[places[-1]], columns[places[-1]])
    return np.asarray(candidates[places])
