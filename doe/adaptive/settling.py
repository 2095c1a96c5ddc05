"""When a search may stop: it gains next to nothing, and fresh runs say what it foretells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import special

from doe.adaptive.emulators import Emulators
from doe.adaptive.result import Batch
from doe.adaptive.runs import Runs

SHARE = 0.25  # of the deviation of the hypervolume over the fronts drawn: a batch that gains less gains nothing
LEAST = 0.0025  # of the hypervolume: what the choice of the points that stand for a front may make of it
BATCHES = 3  # that gain nothing in a row; with the first alone prototypes stopped with 2 % still to gain
CHECKS = 8  # fresh runs on the front
DOUBT = 0.05  # chance of calling right emulators wrong


def nothing_gained(history: Sequence[Batch], since: int) -> bool:
    """Whether the last batches after the one numbered ``since`` gained nothing."""
    last = history[since + 1 :][-BATCHES:]
    return len(last) == BATCHES and all(
        each.gained < max(SHARE * each.deviation, LEAST * each.hypervolume) for each in last
    )


def missed(emulators: Emulators, runs: Runs) -> np.ndarray:
    """What runs (n, m) that the emulators do not know miss them by, in standard deviations of the two together."""
    means, deviations = emulators.predict(runs.points)
    own = emulators.scatter(runs.points) / runs.replicates[:, None] + emulators.nuggets()
    return np.asarray((runs.values - means) / np.sqrt(deviations**2 + own))


def as_foretold(emulators: Emulators, runs: Runs) -> bool:
    """Whether fresh runs lie within what the emulators foretell of them, all responses with a goal or a limit together."""
    goals = emulators.goals
    columns = sorted({*goals.objectives.tolist(), *(index for index, _, _ in goals.limited)})
    off = missed(emulators, runs.rows(runs.good))[:, columns]
    return off.size > 0 and bool(special.chdtrc(off.size, float((off**2).sum())) > DOUBT)
