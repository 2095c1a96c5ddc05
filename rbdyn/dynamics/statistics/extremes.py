"""Return force of impacts: a force that so many impact windows exceed once on average, by Gumbel's law of maxima.

The law is fitted by its moments: the standard deviation of the maxima is pi/sqrt(6) times its scale, their mean lies 0.5772
scales above its location. Moments are sums over windows, so that the errors are those of any other figure.
"""

import math
from collections.abc import Sequence

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.notes import Note, Notes
from rbdyn.dynamics.forces.state import POCKET_LOAD
from rbdyn.dynamics.statistics.replicate import Replicate, Statistic

# Fewest windows of a fit, and the number of windows of which one exceeds the force.
FEWEST_WINDOWS, RETURN_WINDOWS = 30, 1000
# Kolmogorov and Smirnov's distance times the root of the number, for a law fitted to the same maxima: 5 % of samples of the law
# exceed 0.91 (30 maxima) to 0.95 (400).
LARGEST_DISTANCE = 0.93
# Chance below which replicates have no common law. Of the bearing of Chen et al. 2022 a third of the runs has no return force; in four
# of five of these a replicate stays in a regime of 88 N, others in one of 86 N, for 100 turns and more.
SAME_LAW = 0.01


def gumbel(sums: Array) -> tuple[Array, Array]:
    """Location and scale of the law from number, sum and sum of squares of maxima on the last axis; no scale for fewer than two."""
    count, total, squares = np.moveaxis(np.asarray(sums, float), -1, 0)
    mean = total / np.maximum(count, 1.0)
    scale = np.sqrt(6.0 * np.maximum(squares - count * mean**2, 0.0) / np.maximum(count - 1.0, 1.0)) / math.pi
    return mean - np.euler_gamma * scale, scale


def return_level(sums: Array) -> Array:
    """Value that one of ``RETURN_WINDOWS`` maxima exceeds, arguments as in ``gumbel``."""
    location, scale = gumbel(sums)
    return location - scale * math.log(-math.log1p(-1.0 / RETURN_WINDOWS))


def moments_of(maxima: Array) -> Array:
    """Number, value and square of each maximum (n, 3)."""
    return np.column_stack((np.ones(len(maxima)), maxima, maxima**2))


RETURN_FORCE = Statistic(lambda run: moments_of(run.windows(POCKET_LOAD)), return_level)


def distance(maxima: Array) -> float:
    """Largest difference of the shares of maxima from the fitted law, times the root of their number; infinite if all are equal."""
    location, scale = gumbel(moments_of(maxima).sum(axis=0))
    if scale <= 0.0:
        return math.inf
    law, count = np.exp(-np.exp(-(np.sort(maxima) - location) / scale)), len(maxima)
    steps = np.arange(count + 1) / count
    return float(max((steps[1:] - law).max(), (law - steps[:-1]).max()) * math.sqrt(count))


def is_fitted(runs: Sequence[Replicate]) -> bool:
    """Whether the runs have enough windows, whose maxima follow the law."""
    maxima = np.concatenate([run.windows(POCKET_LOAD) for run in runs])
    return len(maxima) >= FEWEST_WINDOWS and distance(maxima) <= LARGEST_DISTANCE


def least_windows(turns: float, window: float, replicates: int) -> int:
    """Whole impact windows of replicates of so many counted turns."""
    return replicates * math.floor(turns / window + 1e-9)


def chance_of_one_law(runs: Sequence[Replicate]) -> float:
    """Chance that mean maxima of replicates of one law differ as much as these (analysis of variance); 1 where it is undefined."""
    from scipy.special import fdtrc

    maxima = [run.windows(POCKET_LOAD) for run in runs]
    count, freedom = len(maxima), sum(map(len, maxima)) - len(maxima)
    within = sum(float(((each - each.mean()) ** 2).sum()) for each in maxima)
    if count < 2 or freedom < 1 or within == 0.0:
        return 1.0
    middle = np.concatenate(maxima).mean()
    between = sum(len(each) * (float(each.mean()) - middle) ** 2 for each in maxima)
    return float(fdtrc(count - 1, freedom, between / (count - 1) * freedom / within))


def return_force_notes(runs: Sequence[Replicate]) -> Notes:
    """A note where pockets are hit and there is no return force: too few windows, several motions, or another law than Gumbel's."""
    windows = sum(len(run.windows(POCKET_LOAD)) for run in runs)
    if is_fitted(runs) or not any(run.largest_load(POCKET_LOAD) for run in runs):
        return ()
    if windows < FEWEST_WINDOWS:
        why = (
            f"{windows} impact windows are fewer than {FEWEST_WINDOWS}; raise numerics.turns or numerics.replicates, or shorten "
            "numerics.impact_window_turns"
        )
    elif chance_of_one_law(runs) < SAME_LAW:
        why = (
            "largest forces differ more between replicates than within them: the cage has several lasting motions without a common "
            "law; choose impact_fatigue_force_N, or clearances with one motion"
        )
    else:
        why = (
            f"the largest forces of {windows} windows do not follow Gumbel's law; lengthen numerics.impact_window_turns and "
            "numerics.turns"
        )
    return (Note("remark", f"impact return force: it is not given, because {why}"),)
