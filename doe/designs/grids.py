"""Designs that fill the box from -1 to +1: full factorials, Latin hypercubes and Sobol sequences."""

from itertools import product

import numpy as np

from doe.arrays import Array
from doe.designs.design import Design, assembled
from rbdyn.base.words import counted
from rbdyn.faults import MethodError

MOST_RUNS = 10_000
# More runs of a Latin hypercube are even enough by themselves, and exchanges among them take seconds.
MOST_EXCHANGED = 200


def full_factorial(factors: int, *, levels: int = 3, centre_replicates: int = 0) -> Design:
    """All combinations of ``levels`` equally spaced values of each factor, the first factor fastest.

    ``centre_replicates`` points are added at the centre. Raises MethodError beyond 10 000 combinations.
    """
    if (runs := levels**factors) > MOST_RUNS:
        mend = 'give fewer levels or use kind = "sobol"'
        raise MethodError(
            f"levels = {levels}: {counted(factors, 'factor')} give {runs} runs, more than {MOST_RUNS}; {mend}"
        )
    values = np.linspace(-1.0, 1.0, levels)
    return _filled("grid", np.array([each[::-1] for each in product(values, repeat=factors)]), centre_replicates)


def latin_hypercube(factors: int, *, runs: int = 60, seed: int = 1, centre_replicates: int = 0) -> Design:
    """Latin hypercube: in every factor one run in each of ``runs`` equal intervals, evenly spread by exchanges.

    Seeded; exchanges within columns lower the centred discrepancy of up to `MOST_EXCHANGED` runs.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979) 239-245; Fang, Li and Sudjianto, Design and
    Modeling for Computer Experiments (2006) (exchanges).
    """
    from scipy.stats import qmc

    exchanges = "random-cd" if runs <= MOST_EXCHANGED else None
    sample = qmc.LatinHypercube(factors, optimization=exchanges, seed=seed).random(runs)
    return _filled("sample", 2.0 * sample - 1.0, centre_replicates)


def sobol(factors: int, *, runs: int = 60, seed: int = 1, centre_replicates: int = 0) -> Design:
    """The first ``runs`` points of a scrambled Sobol sequence: more runs later keep those made.

    Powers of two are the most even.

    Source: Sobol, USSR Comput. Math. Math. Phys. 7 (1967) 86-112; Owen, scrambling, J. Complexity 14 (1998).
    """
    from scipy.stats import qmc

    sample = qmc.Sobol(factors, seed=seed).random_base2(max(runs - 1, 1).bit_length())[:runs]
    return _filled("sample", 2.0 * sample - 1.0, centre_replicates)


def _filled(kind: str, points: Array, centre_replicates: int) -> Design:
    centres = np.zeros((centre_replicates, points.shape[1]))
    blocks = [0] * (len(points) + centre_replicates)
    return assembled([(kind, points), ("centre", centres)], blocks, 1.0, "box")
