"""How likely measured cells are at input sets: emulators of all cells of a table, and a simulation that may itself err.

Cells of a table go together, so a few principal components hold what the inputs do to all of them; each component has an
emulator of its own. Cells are in units of what they are compared with, so that what matters is kept: components are left
out once the signal in the rest is small compared with that. What scatter adds to components and to the rest is known and taken off.

Source: Higdon, Gattiker, Williams and Rightley, Computer model calibration using high-dimensional output, Journal of the
American Statistical Association 103 (2008) 570.

In logarithms z_cj = eta_j(c, theta) + b_j + e_cj + eps: output j is off by one bias b_j ~ N(0, tau_j^2) in all rows c and
by e_cj ~ N(0, (0.3 rho_j)^2) in each. The bias takes the level; only patterns over rows and outputs identify the inputs.
Biases and errors are integrated out: cells are jointly normal with covariance diag(V) + U U', where U holds a column for
each bias and for each component of the emulator's doubt; the sizes tau_j and rho_j are sampled with the inputs.

Each output is of one of three kinds, so that the sample itself weighs whether the model explains it:
- as allowed: tau_j is half-normal of the allowed scale, rho_j = tau_j
- off in its level: tau_j is half-normal of what the output can vary by, rho_j is at most the allowed scale; a biased sensor
- off row by row: the same tau_j, and rho_j = tau_j; missing physics
The share of the posterior in the last two over that of the prior is a Bayes factor.

Sources: Kennedy and O'Hagan, Bayesian calibration of computer models, J. R. Statist. Soc. B 63 (2001) 425; Box and Tiao,
A Bayesian approach to some outlier problems, Biometrika 55 (1968) 119, for the wide alternative next to the usual error.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import special

from doe.emulator import Emulator, fit_emulator, pooled_variances
from rbdyn.base.arrays import Array, Mask, Whole

# Signal that may be left out, as a share of the variance that a cell is compared with; components at most.
LEFT_OUT, MOST = 0.05, 12


@dataclass(frozen=True, eq=False)
class Cells:
    """Emulators of components: ``middle`` (c,) and ``axes`` (p, c) of the cells, and the variance (c,) of what is left out."""

    middle: Array
    axes: Array
    emulators: list[Emulator]
    rest: Array

    def mean(self, quantiles: Array) -> Array:
        """Cells (n, c) at quantiles (n, d)."""
        return self.middle + np.column_stack([each.mean(quantiles) for each in self.emulators]) @ self.axes

    def predict(self, quantiles: Array) -> tuple[Array, Array]:
        """Cells (n, c) and their doubt by component (n, c, p), whose squares sum to the variance that ``rest`` adds to."""
        mean, sd = (np.column_stack(each) for each in zip(*(e.predict(quantiles) for e in self.emulators), strict=True))
        return self.middle + mean @ self.axes, sd[:, None, :] * self.axes.T[None]


def fit_cells(
    quantiles: Array, values: Array, variances: Array, freedom: Whole, compared: Array, before: Cells | None = None
) -> Cells:
    """Emulators of cells (n, c) at quantiles (n, d) with variances (n, c) by ``freedom`` (n, c) degrees of freedom.

    ``compared`` (c,): variance of what each cell is compared with; ``before``: emulators of most of the same runs.
    """
    unit = np.sqrt(compared)
    noise = np.column_stack([pooled_variances(quantiles, v, f) for v, f in zip(variances.T, freedom.T, strict=True)])
    noise = noise / compared
    middle = values.mean(axis=0)
    coded = (values - middle) / unit
    _, sizes, axes = np.linalg.svd(coded, full_matrices=False)
    # What scatter alone makes of a component's variance.
    signal = (sizes**2 / len(coded) - axes**2 @ noise.mean(axis=0)).clip(0.0)
    left = np.append(np.cumsum(signal[::-1])[::-1][1:], 0.0)
    count = min(int(np.argmax(left <= LEFT_OUT * unit.size)) + 1, MOST, len(signal))
    axes = axes[:count]
    scores = coded @ axes.T
    # Of the scatter, components have taken their part.
    scatter = (np.eye(unit.size) - axes.T @ axes) ** 2 @ noise.mean(axis=0)
    rest = ((coded - scores @ axes) ** 2).mean(axis=0) - scatter
    emulators = []
    for place, column in enumerate(scores.T):
        same = before is not None and place < len(before.emulators)
        start = before.emulators[place].hyperparameters if before is not None and same else None
        emulators.append(fit_emulator(quantiles, column, noise @ axes[place] ** 2, trend="quadratic", start=start))
    return Cells(middle, axes * unit, emulators, rest.clip(0.0) * compared)


# What the simulation's error varies by from row to row, as a share of what all rows have in common.
BY_ROW = 0.3
# Allowed unless a scale is stated: this share of what the unknown inputs make an output vary by. A tenth leaves the patterns
# of the inputs visible: an error of that size moves an input by a tenth of its range where one output alone identifies it.
SHARE = 0.1
# Chance of each of the two kinds that go beyond what is allowed, and their scale in allowed ones at least.
BEYOND, WIDER = 0.05, 3.0


class Errors(NamedTuple):
    """Errors of the simulation at n particles by output: of the ``level`` tau (n, m) and of the ``rows`` rho (n, m), and
    whether they go ``beyond`` (n, m) what is allowed."""

    level: Array
    rows: Array
    beyond: Mask


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured cells, in logarithms: ``values`` (c,), ``variances`` (c,) of rig and integration, the ``output`` and the
    ``row`` (c,) each belongs to, ``scales`` (m,) of the discrepancy that is allowed of each output (NaN until ``with_scales``
    where none is stated), whether a cell is ``held`` out, and what each output can vary by as ``spread`` (m,)."""

    values: Array
    variances: Array
    output: Whole
    row: Whole
    scales: Array
    held: Mask
    spread: Array | None = None

    @property
    def learnt(self) -> Whole:
        """Places of the cells that may be trained on."""
        return np.flatnonzero(~self.held)

    @property
    def wide(self) -> Array:
        """Scales (m,) of discrepancies beyond the allowed ones."""
        spread = np.zeros(self.scales.size) if self.spread is None else self.spread
        return np.where(self.scales > 0.0, np.maximum(spread, WIDER * self.scales), 0.0)

    def with_scales(self, simulated: Array) -> "Measured":
        """With the default where no scale is stated, by cells (n, c) that are simulated over the prior of the inputs: the
        standard deviation within rows, as what differs from row to row is no doubt about the inputs."""
        square = simulated.var(axis=0)
        outputs = range(self.scales.size)
        spread = np.sqrt([square[self.output == place].mean() for place in outputs]).clip(1e-6)
        return replace(self, scales=np.where(np.isnan(self.scales), SHARE * spread, self.scales), spread=spread)

    def errors(self, scores: Array) -> Errors:
        """Errors of the simulation at normal scores (n, m): of each score the place in the prior of its output."""
        quantiles = special.ndtr(scores)
        within = 1.0 - 2.0 * BEYOND
        beyond, rows_too = quantiles > within, quantiles > 1.0 - BEYOND
        share = np.where(beyond, (quantiles - np.where(rows_too, 1.0 - BEYOND, within)) / BEYOND, quantiles / within)
        size = special.ndtri(0.5 + 0.5 * share.clip(0.0, 1.0 - 1e-15))
        level = size * np.where(beyond, self.wide, self.scales)
        rows = np.where(beyond & ~rows_too, np.minimum(level, self.scales), level)
        return Errors(level, rows, beyond & (self.scales > 0.0))


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

    def latent(self, values: Array, known: Whole) -> tuple[Array, Array]:
        """Mean (n, r) and root C (n, r, r) of the covariance CC' of what stands behind the common roots, where the values
        (c,) of ``known`` cells (k,) are known: U times it is what cells have in common."""
        roots = np.swapaxes(self.roots[:, known] / self.own[:, known, None], 1, 2)
        information = np.eye(self.roots.shape[2]) + roots @ self.roots[:, known]
        inverse = np.linalg.inv(np.linalg.cholesky(information))
        mean = np.swapaxes(inverse, 1, 2) @ (inverse @ (roots @ (values[known] - self.mean[:, known])[:, :, None]))
        return mean[:, :, 0], np.swapaxes(inverse, 1, 2)

    def given(self, values: Array, known: Whole, asked: Whole) -> tuple[Array, Array, Array]:
        """``asked`` cells (a,) where the values (c,) of ``known`` ones are known: their mean (n, a), variances of their own
        (n, a) and common roots (n, a, r)."""
        middle, root = self.latent(values, known)
        across = self.roots[:, asked]
        return self.mean[:, asked] + (across @ middle[:, :, None])[:, :, 0], self.own[:, asked], across @ root


def joint(cells: Cells, measured: Measured, quantiles: Array, errors: Errors) -> Joint:
    """Measured cells at input sets (n, d) with errors of the simulation (n, m)."""
    mean, doubt = cells.predict(quantiles)
    own = measured.variances + cells.rest + (BY_ROW * errors.rows[:, measured.output]) ** 2
    level = errors.level[:, measured.output, None]
    biases = level * (measured.output[:, None] == np.arange(measured.scales.size))
    return Joint(mean, own, np.concatenate([biases, doubt], axis=2))
