"""Designs of three levels a factor: Box-Behnken designs, without corners, all points but the centre on one sphere; definitive
screening designs, in hardly more than twice as many runs as factors."""

from itertools import product

import numpy as np

from doe.arrays import Array
from doe.designs.design import Design, assembled
from rbdyn.faults import MethodError

# Factors that vary together, in the order of the published tables, and how the design divides into blocks:
# by parts of that list (4 and 5 factors) or by the sign of the product of the three (6 and 7 factors).
TOGETHER = {
    3: ("AB", "AC", "BC"),
    4: ("AB", "CD", "AD", "BC", "AC", "BD"),
    5: ("AB", "AC", "CD", "DE", "BE", "AD", "AE", "BC", "BD", "CE"),
    6: ("ABD", "BCE", "CDF", "ADE", "BEF", "ACF"),
    7: ("DEF", "AFG", "BEG", "ABD", "CDG", "ACE", "BCF"),
}
BLOCKS = {4: 3, 5: 2, 6: 2, 7: 2}
MOST_SCREENED = 8  # factors; the primes 3, 5 and 7 give the conference matrices up to there


def box_behnken(factors: int, *, centre_replicates: int = 6, blocks: bool = False) -> Design:
    """Box-Behnken design in standard order, 3 to 7 factors.

    ``blocks``: the published division into orthogonal blocks (3 for 4 factors, 2 for 5 to 7), each with an
    equal share of the centre points.

    Raises MethodError when the number of factors is out of range, blocks do not exist for it, or the centre points
    cannot be shared equally.

    Source: Box and Behnken, Some new three level designs for the study of quantitative variables,
    Technometrics 2 (1960) 455-475.
    """
    if factors not in TOGETHER:
        mend = 'use kind = "central_composite"'
        raise MethodError(f"kind = 'box_behnken': tabulated for 3 to 7 factors, not for {factors}; {mend}")
    number = BLOCKS.get(factors, 1) if blocks else 1
    if blocks and number == 1:
        raise MethodError(f"blocks = true: a Box-Behnken design in {factors} factors has no orthogonal blocks")
    if centre_replicates % number:
        need = f"{number} blocks need equal shares of the centre points; give a multiple of {number}"
        raise MethodError(f"centre_replicates = {centre_replicates}: {need}")
    edges, of_run = [], []
    for place, letters in enumerate(TOGETHER[factors]):
        columns = ["ABCDEFG".index(letter) for letter in letters]
        for signs in product((-1.0, 1.0), repeat=len(columns)):
            point = np.zeros(factors)
            point[columns] = signs[::-1]
            edges.append(point)
            part = place * number // len(TOGETHER[factors])
            of_run.append(int(np.prod(signs) > 0) if len(columns) == 3 else part)
    centres = np.zeros((centre_replicates, factors))
    parts = [("edge", np.array(edges)), ("centre", centres)]
    return assembled(parts, [each % number for each in (*of_run, *range(centre_replicates))], 1.0, "ball")


def definitive_screening(factors: int, *, centre_replicates: int = 1) -> Design:
    """Definitive screening design in 2 to 8 factors: a conference matrix, its mirror image, and centre points.

    With one centre point 2k + 1 runs for an even number k of factors; an odd one takes a column less of the next even
    design. Main effects are orthogonal to each other and to all squares and products; squares can be told from each
    other and from products, products not all from each other: the model for it is "pure_quadratic".

    Raises MethodError when the number of factors is out of range.

    Source: Jones and Nachtsheim, A class of three-level designs for definitive screening in the presence of
    second-order effects, J. Qual. Technol. 43 (2011) 1-15; Xiao, Lin and Bai, Constructing definitive screening designs
    using conference matrices, J. Qual. Technol. 44 (2012) 2-8.
    """
    if not 2 <= factors <= MOST_SCREENED:
        mend = 'use kind = "d_optimal"'
        raise MethodError(
            f"kind = 'definitive_screening': is for 2 to {MOST_SCREENED} factors, not for {factors}; {mend}"
        )
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
