"""Variances that few replicates tell, smoothed over the inputs."""

import numpy as np
from scipy import special

from rbdyn.base.arrays import Array, Whole


def pooled_variances(points: Array, variances: Array, freedom: Whole, new: Array | None = None) -> Array:
    """Variances (n,) of single replicates at points (n, k), as a log-linear function of the inputs; at ``new`` points, if
    given.

    ``freedom`` (n,) are the degrees of freedom behind each (0: not known at all). The logarithm of an estimate lies below
    that of the truth by psi(f/2) - log(f/2) on average and scatters by the root of psi'(f/2): the first is taken off, the
    second weighs the runs (Bartlett and Kendall, The statistical analysis of variance-heterogeneity, 1946). Zero where no
    run tells a variance.
    """
    at = points if new is None else new
    known = np.isfinite(variances) & (variances > 0.0) & (freedom > 0)
    if not known.any():
        return np.zeros(len(at))
    half = 0.5 * freedom[known]
    logs = np.log(variances[known]) - special.digamma(half) + np.log(half)
    weight = 1.0 / np.sqrt(special.polygamma(1, half))
    # Fewer runs than a plane needs twice over tell one level only.
    plane = known.sum() >= 2 * (points.shape[1] + 1)
    columns, wanted = (np.column_stack([np.ones(len(x)), *([x] if plane else [])]) for x in (points[known], at))
    return np.exp(wanted @ np.linalg.lstsq(columns * weight[:, None], logs * weight, rcond=None)[0])
