"""What response surfaces lose against the simulator itself: hypervolumes of two noisy fronts, with their errors."""

from dataclasses import dataclass

import numpy as np

from doe.arrays import Array
from doe.pareto.archive import hypervolume, non_dominated
from doe.pareto.direct import DirectFront
from rbdyn.base.words import signed_with_error
from rbdyn.faults import MethodError

DRAWS = 200  # of the noise of a front


@dataclass(frozen=True)
class SurrogateLoss:
    """Hypervolumes on a common scale with their 95 % half widths; the loss in percent of the direct one with its own.

    The loss is None where the direct front reaches nothing of the common scale.
    """

    hypervolume: float
    hypervolume_error: float
    surrogate_hypervolume: float
    surrogate_hypervolume_error: float
    loss_percent: float | None
    loss_error_percent: float | None

    @property
    def sentence(self) -> str:
        """Whether the surfaces lose anything that can be told from noise."""
        if self.loss_percent is None or self.loss_error_percent is None:
            return "The direct front lies wholly behind that of the surfaces; give the direct search more runs."
        figure = f"{signed_with_error(self.loss_percent, self.loss_error_percent)} % of the direct front's hypervolume"
        if abs(self.loss_percent) <= self.loss_error_percent:
            return f"The surfaces lose {figure}: nothing that can be told from the noise."
        if self.loss_percent > 0.0:
            return f"The surfaces lose {figure}."
        return f"The surfaces lose {figure}: they find more than the direct search does in its budget."


def noisy_hypervolume(
    costs: Array, errors: Array, ideal: Array, nadir: Array, draws: int, seed: int = 1
) -> tuple[float, float]:
    """Hypervolume of means (n, q) with standard errors (n, q), and its standard error.

    Noise pushes a hypervolume up, for the lucky ones stand out. Draws of the noise show by how much, and that is taken
    off (parametric bootstrap: Efron and Tibshirani, An Introduction to the Bootstrap, section 10.6).
    """
    random = np.random.default_rng(seed)
    believed = hypervolume(costs, ideal, nadir)
    noisy = [hypervolume(costs + errors * random.standard_normal(costs.shape), ideal, nadir) for _ in range(draws)]
    return 2.0 * believed - float(np.mean(noisy)), float(np.std(noisy, ddof=1))


def compare_with_surrogate(
    direct: DirectFront, surrogate_values: Array, surrogate_errors: Array, *, seed: int = 1
) -> SurrogateLoss:
    """Compare a direct front with a surrogate's, whose points were run on the simulator afresh.

    ``surrogate_values`` and ``surrogate_errors`` (s, m) are the means and standard errors of those runs; rows of NaN
    (failed runs) are left out. Both fronts are normalised to the ideal and nadir of the two together. A front of more
    points can cover more: compare equally many.

    Raises MethodError when no surrogate point is left.
    """
    goals = direct.goals
    good = np.isfinite(surrogate_values).all(axis=1)
    if not good.any():
        raise MethodError("every run at the surrogate's points failed; nothing can be compared")
    costs, errors = goals.costs(surrogate_values[good]), surrogate_errors[good][:, goals.objectives]
    both = np.vstack([direct.costs, costs])
    both = both[non_dominated(both)]
    ideal, nadir = both.min(axis=0), both.max(axis=0)
    ours, our_error = noisy_hypervolume(direct.costs, direct.cost_errors, ideal, nadir, DRAWS, seed)
    theirs, their_error = noisy_hypervolume(costs, errors, ideal, nadir, DRAWS, seed + 1)
    ratio = theirs / ours if ours > 0.0 else None
    error = None if ratio is None else 196.0 * float(np.hypot(ratio * our_error, their_error)) / ours
    return SurrogateLoss(
        hypervolume=ours,
        hypervolume_error=1.96 * our_error,
        surrogate_hypervolume=theirs,
        surrogate_hypervolume_error=1.96 * their_error,
        loss_percent=None if ratio is None else 100.0 * (1.0 - ratio),
        loss_error_percent=error,
    )
