"""Emulators of many outputs at once: every measured cell of a table, over the inputs that all cells share.

Cells of a table go together, so a few principal components hold what the inputs do to all of them; each component has an
emulator of its own. Cells are in units of what they are compared with, so that what matters is kept: components are left
out once the signal in the rest is small beside that. What scatter adds to components and to the rest is known and taken off.

Source: Higdon, Gattiker, Williams and Rightley, Computer model calibration using high-dimensional output, Journal of the
American Statistical Association 103 (2008) 570.
"""

from dataclasses import dataclass

import numpy as np

from doe.arrays import Array, Whole
from doe.emulator import Emulator, fit_emulator, pooled_variances

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
