"""How likely measured cells are at input sets, where the simulation itself may err by an unknown share.

In logarithms z_cj = eta_j(c, theta) + b_j + e_cj + eps: output j is off by one bias b_j ~ N(0, tau_j^2) in all rows c and
by e_cj ~ N(0, (0.3 tau_j)^2) in each; tau_j is half-normal of a stated scale and sampled with the inputs. The bias takes the
level; only patterns over rows and outputs teach the inputs. Biases and errors are integrated out: cells are jointly normal
with covariance diag(V) + U U', where U holds a column for each bias and for each component of the emulator's doubt.

Source: Kennedy and O'Hagan, Bayesian calibration of computer models, J. R. Statist. Soc. B 63 (2001) 425.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import special

from doe.arrays import Array, Mask, Whole
from doe.unknown.cells import Cells

# What the simulation's error varies by from row to row, as a share of what all rows have in common.
BY_ROW = 0.3


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured cells, in logarithms: ``values`` (c,), ``variances`` (c,) of rig and integration, the ``output`` and the
    ``row`` (c,) each belongs to, ``scales`` (m,) of the discrepancy of each output, and whether a cell is ``held`` out."""

    values: Array
    variances: Array
    output: Whole
    row: Whole
    scales: Array
    held: Mask

    @property
    def learnt(self) -> Whole:
        """Places of the cells that may teach."""
        return np.flatnonzero(~self.held)

    def taus(self, scores: Array) -> Array:
        """Discrepancies (n, m) at normal scores (n, m): half-normal."""
        return self.scales * special.ndtri(0.5 + 0.5 * special.ndtr(scores).clip(0.0, 1.0 - 1e-15))


class Joint(NamedTuple):
    """Cells as jointly normal at n input sets: mean (n, c), variances of their own (n, c), common roots U (n, c, r)."""

    mean: Array
    own: Array
    roots: Array

    def log_density(self, values: Array, cells: Whole) -> Array:
        """Logarithm (n,) of the density of the values (c,) of some cells (k,), by Woodbury's identity."""
        own, roots = self.own[:, cells], self.roots[:, cells]
        off = values[cells] - self.mean[:, cells]
        weighed = roots / own[:, :, None]
        factor = np.linalg.cholesky(np.eye(roots.shape[2]) + np.swapaxes(roots, 1, 2) @ weighed)
        inside = np.linalg.solve(factor, np.einsum("ncr,nc->nr", weighed, off)[:, :, None])[:, :, 0]
        determinant = np.log(own).sum(axis=1) + 2.0 * np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
        return -0.5 * (
            (off**2 / own).sum(axis=1) - (inside**2).sum(axis=1) + determinant + cells.size * np.log(2.0 * np.pi)
        )

    def given(self, values: Array, known: Whole, asked: Whole) -> tuple[Array, Array]:
        """Mean (n, a) and standard deviation (n, a) of ``asked`` cells where the values (c,) of ``known`` ones are known."""
        if known.size == 0:
            return self.mean[:, asked], np.sqrt(self.own + (self.roots**2).sum(axis=2))[:, asked]
        roots = np.swapaxes(self.roots, 1, 2)
        across = self.roots[:, asked] @ roots[:, :, known]
        within = self.roots[:, known] @ roots[:, :, known] + self.own[:, known, None] * np.eye(known.size)
        weights = np.linalg.solve(within, np.swapaxes(across, 1, 2))
        mean = self.mean[:, asked] + np.einsum("nka,nk->na", weights, values[known] - self.mean[:, known])
        told = np.einsum("nak,nka->na", across, weights)
        variance = self.own[:, asked] + (self.roots[:, asked] ** 2).sum(axis=2) - told
        return mean, np.sqrt(variance.clip(1e-300))


def joint(cells: Cells, measured: Measured, quantiles: Array, taus: Array) -> Joint:
    """Measured cells at input sets (n, d) with discrepancies (n, m)."""
    mean, doubt = cells.predict(quantiles)
    tau = taus[:, measured.output]
    own = measured.variances + cells.rest + (BY_ROW * tau) ** 2
    biases = tau[:, :, None] * (measured.output[:, None] == np.arange(measured.scales.size))
    return Joint(mean, own, np.concatenate([biases, doubt], axis=2))
