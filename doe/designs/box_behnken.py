"""Box-Behnken designs: three levels a factor, no corners, all points but the centre on one sphere."""

from itertools import product

import numpy as np

from doe.designs.design import Design, assembled

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


def box_behnken(factors: int, *, centre_replicates: int = 6, blocks: bool = False) -> Design:
    """Box-Behnken design in standard order, 3 to 7 factors.

    ``blocks``: the published division into orthogonal blocks (3 for 4 factors, 2 for 5 to 7), each with an
    equal share of the centre points.

    Raises ValueError when the number of factors is out of range, blocks do not exist for it, or the centre points
    cannot be shared equally.

    Source: Box and Behnken, Some new three level designs for the study of quantitative variables,
    Technometrics 2 (1960) 455-475.
    """
    if factors not in TOGETHER:
        mend = 'use kind = "central_composite"'
        raise ValueError(f"kind = 'box_behnken': tabulated for 3 to 7 factors, not for {factors}; {mend}")
    number = BLOCKS.get(factors, 1) if blocks else 1
    if blocks and number == 1:
        raise ValueError(f"blocks = true: a Box-Behnken design in {factors} factors has no orthogonal blocks")
    if centre_replicates % number:
        need = f"{number} blocks need equal shares of the centre points; give a multiple of {number}"
        raise ValueError(f"centre_replicates = {centre_replicates}: {need}")
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
