"""What a search on the simulator leaves open about its pick: functions drawn from its emulators, at the level of fresh runs."""

from collections.abc import Iterator

import numpy as np

from doe.arrays import Array
from doe.pareto.simulated_tolerance import Neighbourhood
from doe.study.adaptive import Adaptive, drawn_by_emulators
from doe.study.confirmation import Confirmed
from doe.study.shares import DRAWS, Drawn
from doe.study.surface_draws import CHUNK
from doe.study_file import Study


def draws_about(study: Study, searched: Adaptive, here: Neighbourhood, pick: Confirmed, baseline: Confirmed) -> Drawn:
    """Draws of the responses of parts about a pick, coded points (n, k), and of the baseline, the last of them.

    Functions are drawn from the search's emulators, of which the change from the pick, ``here``, counts. The levels of pick and baseline are those of their own runs, with Student's errors.
    """

    def drawn(coded: Array) -> Iterator[Array]:
        parts, random = coded[:-1], np.random.default_rng(study.file.front.seed)
        for first in range(0, DRAWS, CHUNK):
            count = min(CHUNK, DRAWS - first)
            values = drawn_by_emulators(study, searched, np.vstack([parts, here.points]), count, random)
            change = values[:, :-1] - values[:, -1:]
            levels = [_levels(each, count, random)[:, None] for each in (pick, baseline)]
            yield np.concatenate([levels[0] + change, levels[1]], axis=1)

    return drawn


def _levels(confirmed: Confirmed, count: int, random: np.random.Generator) -> Array:
    """Responses (d, m) that a simulated point might as well have."""
    freedom = np.minimum(confirmed.joint_freedom, 1e9)
    student = random.standard_t(freedom, (count, freedom.size))
    return np.asarray(confirmed.values + confirmed.standard_error * student)
