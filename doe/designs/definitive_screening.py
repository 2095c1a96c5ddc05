"""Definitive screening designs: three levels a factor in hardly more than twice as many runs as factors."""

import numpy as np

from doe.arrays import Array
from doe.designs.design import Design, assembled

MOST = 8  # factors; the primes 3, 5 and 7 give the conference matrices up to there


def definitive_screening(factors: int, *, centre_replicates: int = 1) -> Design:
    """Definitive screening design in 2 to 8 factors: a conference matrix, its mirror image, and centre points.

    With one centre point 2k + 1 runs for an even number k of factors; an odd one takes a column less of the next even
    design. Main effects are orthogonal to each other and to all squares and products; squares can be told from each
    other and from products, products not all from each other: the model for it is "pure_quadratic".

    Raises ValueError when the number of factors is out of range.

    Source: Jones and Nachtsheim, A class of three-level designs for definitive screening in the presence of
    second-order effects, J. Qual. Technol. 43 (2011) 1-15; Xiao, Lin and Bai, Constructing definitive screening designs
    using conference matrices, J. Qual. Technol. 44 (2012) 2-8.
    """
    if not 2 <= factors <= MOST:
        mend = 'use kind = "d_optimal"'
        raise ValueError(f"kind = 'definitive_screening': is for 2 to {MOST} factors, not for {factors}; {mend}")
    half = conference_matrix(factors + factors % 2)[:, :factors]
    points = np.stack([half, -half], axis=1).reshape(-1, factors)
    parts = [("screening", points), ("centre", np.zeros((centre_replicates, factors)))]
    return assembled(parts, [0] * (len(points) + centre_replicates), 1.0, "box")


def conference_matrix(order: int) -> Array:
    """C (n, n) with zeros on the diagonal, else -1 and 1, and C'C = (n - 1) I; n - 1 is an odd prime or 1.

    Source: Paley, On orthogonal matrices, J. Math. Phys. 12 (1933) 311-320.
    """
    prime = order - 1
    squares = {place * place % prime for place in range(1, prime)}
    character = np.array([0, *(1 if place in squares else -1 for place in range(1, prime))], float)
    places = np.arange(prime)
    matrix = np.ones((order, order))
    matrix[1:, 1:] = character[(places[:, None] - places) % prime]
    matrix[1:, 0] = -1.0 if prime % 4 == 3 else 1.0
    matrix[0, 0] = 0.0
    return matrix
