"""Central composite designs in coded units: centre 0, cube corners -1 and +1, one column a factor."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def central_composite(factors: int, *, alpha: float | str = "rotatable", centre_replicates: int = 6) -> Array:
    """Central composite design in standard order: cube (first factor fastest), axial, centre points.

    Parameters
    ----------
    factors : number of factors k, at least 2.
    alpha : axial distance in coded units, or "rotatable" for (2^k)^(1/4), which makes the variance of a
        predicted quadratic depend on the distance from the centre only.
    centre_replicates : number of centre points, from whose scatter pure error is estimated.

    Returns
    -------
    Coded points, shape (2^k + 2 k + centre_replicates, k).

    Raises
    ------
    ValueError when a number is out of its range or ``alpha`` is an unknown word.

    Source: Box and Hunter, Multi-factor experimental designs (1957).
    """
    if factors < 2:
        raise ValueError(f"factors = {factors}: a central composite design needs at least 2 factors")
    if centre_replicates < 0:
        raise ValueError(f"centre_replicates = {centre_replicates}: must be at least 0")
    distance = axial_distance(factors, alpha)
    cube = np.array([corner[::-1] for corner in product((-1.0, 1.0), repeat=factors)])
    axial = np.kron(np.eye(factors), [[-distance], [distance]])
    return np.vstack([cube, axial, np.zeros((centre_replicates, factors))])


def axial_distance(factors: int, alpha: float | str) -> float:
    """Axial distance of a full-cube design in coded units, from a number or the word "rotatable".

    Raises ValueError for an unknown word or a number that is not positive and finite.
    """
    if alpha == "rotatable":
        return math.pow(2.0, factors / 4)
    if isinstance(alpha, str):
        raise ValueError(f'alpha = {alpha!r}: write "rotatable" or a positive number')
    if not (math.isfinite(alpha) and alpha > 0):
        raise ValueError(f"alpha = {alpha}: must be a positive number")
    return float(alpha)
