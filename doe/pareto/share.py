"""The share of manufactured parts that keep something, with all that is known to be open about it.

On drawn surfaces other parts keep it than on the fitted ones, and only some thousand parts are counted. On each draw the share
that k of n parts show has Jeffreys' beta distribution, of k + 1/2 and n - k + 1/2; that of all draws together is the mean of
theirs. The interval stated is the shortest that holds 95 % of it: shares pile up at 0 and at 1, which an interval with equal
tails would leave out.

Sources: Brown, Cai and DasGupta, Interval estimation for a binomial proportion, Statistical Science 16 (2001) 101; Box and
Tiao, Bayesian Inference in Statistical Analysis, section 2.8 (intervals of highest density).
"""

from typing import NamedTuple

import numpy as np
from scipy import special

from doe.arrays import Array

LEVEL = 0.95
# Shares that stand for the distribution of all draws, and of one of them at least.
SHARES, FEWEST = 4000, 20


class Interval(NamedTuple):
    """Ends of the 95 % interval of a share."""

    low: float
    high: float

    @property
    def words(self) -> str:
        """'71.3 to 99.8 %'."""
        return f"{percent(self.low)} to {percent(self.high)} %"


def interval_of_share(kept: Array, parts: int) -> Interval:
    """Interval of a share from the number of parts (d,), of so many, that keep it on each draw."""
    counts, times = np.unique(kept, return_counts=True)
    levels = max(SHARES // counts.size, FEWEST)
    quantiles = (np.arange(levels) + 0.5) / levels
    each = special.betaincinv(counts[:, None] + 0.5, parts - counts[:, None] + 0.5, quantiles).ravel()
    order = np.argsort(each, kind="stable")
    shares, behind = each[order], np.cumsum(np.repeat(times, levels)[order])
    # From every share the nearest one up to which the interval holds enough.
    enough = np.searchsorted(behind, np.append(0, behind[:-1]) + LEVEL * behind[-1] * (1.0 - 1e-12))
    whole = np.flatnonzero(enough < shares.size)
    first = int(whole[np.argmin(shares[enough[whole]] - shares[whole])])
    low, high = float(shares[first]), float(shares[enough[first]])
    # Where none and all keep it, the share reaches to 0 and to 1 (Brown, Cai and DasGupta).
    none = special.betaincinv(0.5, parts + 0.5, quantiles[-1])
    every = special.betaincinv(parts + 0.5, 0.5, quantiles[0])
    return Interval(0.0 if low <= none else low, 1.0 if high >= every else high)


def percent(share: float) -> str:
    """'71.3' of a share: to a tenth of a percent, and never '100.0' of less than all or '0.0' of more than none."""
    if 0.0 < share < 0.0005:
        return "below 0.1"
    return "above 99.9" if 0.9995 <= share < 1.0 else f"{100.0 * share:.1f}"
