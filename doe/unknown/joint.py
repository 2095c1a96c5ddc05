"""Inputs as they go together: evenly spread sets of them, and sets that share some inputs with others.

Declared inputs depend on each other through a Gaussian copula, those of a posterior sample by coming in its rows. The last
input of a set does nothing: it shows what chance does.
"""

from dataclasses import dataclass

import numpy as np
from scipy import special
from scipy.spatial import KDTree
from scipy.stats import qmc

from doe.arrays import Array
from doe.unknown.laws import EDGE, dependent

# Rows beside one of a sample that are as good as on it.
NEAR = 8


def nested(inputs: int, points: int, seed: int) -> Array:
    """Quantiles (points, inputs) of scrambled Sobol' points; ``points`` is a power of two, and half as many are the first half."""
    return qmc.Sobol(inputs, rng=np.random.default_rng(seed)).random_base2(int(points).bit_length() - 1)


@dataclass(frozen=True, eq=False)
class Joint:
    """How ``inputs`` many inputs depend on each other.

    ``factor`` (d, d): Cholesky factor of the correlations of their normal scores, None without any; ``rows`` (r, s):
    quantiles of a sample, whose columns are the inputs at ``columns`` (s,).
    """

    inputs: int
    factor: Array | None = None
    rows: Array | None = None
    columns: tuple[int, ...] = ()

    @property
    def independent(self) -> bool:
        """Whether no input tells anything of another."""
        return self.factor is None and self.rows is None

    def sets(self, points: int, seed: int) -> Array:
        """Quantiles (points, d + 1) of input sets; of a power of two the first half are those of half as many."""
        return self.placed(nested(self.inputs + 1, points, seed))

    def placed(self, even: Array) -> Array:
        """Quantiles (n, d + 1) of input sets, of evenly spread ones."""
        found = np.column_stack([dependent(even[:, :-1], self.factor), even[:, -1]])
        if self.rows is not None:
            found[:, self.columns] = self.rows[(even[:, self.columns[0]] * len(self.rows)).astype(np.int64)]
        return found

    def redrawn(self, sets: Array, shared: Array, fresh: Array) -> Array:
        """Other input sets (n, d + 1) that have the inputs where ``shared`` (d + 1,) in common with ``sets``, and of the rest
        what is likely beside these, by ``fresh`` evenly spread ones: drawn from the copula, or of a near row of the
        sample."""
        keep, redraw = (np.flatnonzero(shared[:-1] == which) for which in (True, False))
        found = np.where(shared, sets, fresh)
        if self.factor is not None:
            scores, even = (special.ndtri(each[:, :-1].clip(EDGE, 1.0 - EDGE)) for each in (sets, fresh))
            whole = self.factor @ self.factor.T
            slopes = np.linalg.solve(whole[np.ix_(keep, keep)], whole[np.ix_(keep, redraw)])
            root = np.linalg.cholesky(whole[np.ix_(redraw, redraw)] - whole[np.ix_(redraw, keep)] @ slopes)
            found[:, redraw] = special.ndtr(scores[:, keep] @ slopes + even[:, redraw] @ root.T)
        if self.rows is not None:
            columns = np.array(self.columns)
            known = shared[columns]
            if known.any():
                # The nearest is the row itself; one of the next few is drawn.
                several = KDTree(self.rows[:, known]).query(sets[:, columns[known]], k=min(NEAR + 1, len(self.rows)))[1]
                drawn = 1 + (fresh[:, columns[0]] * (several.shape[1] - 1)).astype(np.int64)
                near = several[np.arange(len(sets)), drawn]
            else:
                near = (fresh[:, columns[0]] * len(self.rows)).astype(np.int64)
            found[:, columns[~known]] = self.rows[near][:, ~known]
        return found
