"""What holds the pick of an adaptive search where it is, factor by factor, by its emulators."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from doe.adaptive.emulators import Face
from doe.adaptive.search import NEAR
from doe.arrays import Array
from doe.study.adaptive import Adaptive, costs_foretold
from doe.study.goals import goals_of
from doe.study.limits import Limit
from doe.study_file import Study

AWAY = 0.1  # of the range of a factor: so far to both sides of the pick the emulators are asked
LITTLE = 0.01  # of the range of a cost on the front: what changes less does not pull


class Pull(NamedTuple):
    """A factor of the pick: the responses that get better with ``more`` of it, those with ``less``, those that ``turn``
    there. ``face``: that of the region searched it lies at, None inside."""

    factor: str
    at: float
    more: list[str]
    less: list[str]
    turn: list[str]
    face: Face | None


def pulls(study: Study, adaptive: Adaptive, pick: Array) -> list[Pull]:
    """How the responses with a goal pull at every factor of a point (k,) in factor units."""
    names = [study.responses[index] for index in goals_of(study).objectives]
    span = np.ptp(adaptive.found.front.goals.costs(adaptive.found.foretold), axis=0)
    found = []
    for index, (low, high) in enumerate(adaptive.edges.tolist()):
        sides = np.clip(pick[index] + AWAY * (high - low) * np.array([-1.0, 0.0, 1.0]), low, high)
        at = np.tile(pick, (3, 1))
        at[:, index] = sides
        below, here, above = costs_foretold(study, adaptive, at) / np.where(span > 0.0, span, 1.0)
        more = (here - above > LITTLE) & (above < below)
        less = (here - below > LITTLE) & (below <= above)
        turn = ~more & ~less & (np.maximum(above, below) - here > LITTLE)
        ways = [[name for name, one in zip(names, each, strict=True) if one] for each in (more, less, turn)]
        at_face = _face(study, adaptive, index, float(pick[index]))
        found.append(Pull(study.factors[index], float(pick[index]), ways[0], ways[1], ways[2], at_face))
    return found


def _face(study: Study, adaptive: Adaptive, index: int, at: float) -> Face | None:
    """The face that a factor lies at, as the search left it; where its own pick lay elsewhere, the "end" of the region that was
    searched, if that might have grown."""
    low, high = adaptive.edges[index].tolist()
    allowed = study.file.factor[index].allowed if study.file.adaptive.extend else None
    for side, end in ((-1, low), (1, high)):
        if abs(at - end) <= NEAR * (high - low):
            known = (face for face in adaptive.found.faces if (face.factor, face.side) == (index, side))
            open_end = allowed is not None and abs(allowed[int(side > 0)] - end) > NEAR * (high - low)
            return next(known, Face(index, side, float("nan"), float("nan"), "end" if open_end else "allowed"))
    return None


def near_limits(adaptive: Adaptive, study: Study, limits: Sequence[Limit]) -> list[Limit]:
    """The limits that have next to no room left, against the range of the response over all runs."""
    ranges = dict(zip(study.responses, np.ptp(adaptive.found.emulators.runs.values, axis=0).tolist(), strict=True))
    return [limit for limit in limits if limit.room <= NEAR * ranges[limit.response]]
