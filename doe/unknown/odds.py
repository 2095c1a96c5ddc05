"""How likely a design keeps the limits of a response while inputs are unknown.

Rows are input sets at which the design was simulated: values with variances of the simulation. They scatter more than the truth,
so each is shrunk towards the mean of all, as `doe.unknown.decision` does with gains: the true value of row i is normal about
m + V/(V + s_i^2) (y_i - m) with the variance V s_i^2/(V + s_i^2), V = var y - mean s^2. The probability is the mean over rows
that it lies between the limits; its interval is by resampling rows, and no shorter than Wilson's.
"""

import numpy as np
from scipy import special

from doe.arrays import Array
from doe.threads import one_thread
from doe.unknown.decision import resampled
from doe.unknown.spread import Share


@one_thread
def odds(values: Array, variances: Array, lower: float, upper: float, seed: int) -> Share:
    """Probability that the true value of an input set lies from ``lower`` to ``upper``, from simulated ``values`` (n,) with
    ``variances`` (n,); an end may be infinite."""
    (found,) = resampled(
        lambda rows: np.array([_share(values[rows], variances[rows], lower, upper)]),
        len(values),
        np.random.default_rng(seed),
    )
    return found


def _share(values: Array, variances: Array, lower: float, upper: float) -> float:
    middle = values.mean()
    between = max(float(values.var(ddof=1) - variances.mean()), 0.0)
    weight = np.divide(between, between + variances, out=np.zeros_like(variances), where=between + variances > 0.0)
    true, deviation = middle + weight * (values - middle), np.sqrt(weight * variances)
    sure = deviation <= 1e-12 * np.abs(true)
    below, above = (special.ndtr((end - true) / np.where(sure, 1.0, deviation)) for end in (lower, upper))
    return float(np.where(sure, (lower <= true) & (true <= upper), above - below).mean())
