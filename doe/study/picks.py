"""The points of a front that are worth a confirmation, each once."""

from collections.abc import Iterator

import numpy as np

from doe.arrays import Array
from doe.designs import to_actual
from doe.pareto import ParetoFront
from doe.study.confirmation import Choice
from doe.study.direct import Direct
from doe.study.direct_pick import DirectPick
from doe.study.goals import rounded_within
from doe.study_file import Study


def choices(
    study: Study, front: ParetoFront, direct: Direct | None, chosen: DirectPick | None = None
) -> dict[str, Choice]:
    """The pick, then the picks by the other rules and of the direct front, by name.

    What was ``chosen`` of the direct front is the pick, and the pick of the surfaces stands beside it. Where the study asks
    for a tolerance-aware front, its pick is that of the surfaces. Of those that the drawing cannot tell apart
    the first stands for all, and its reason says so.
    """
    found: dict[str, Choice] = {}
    for name, point, reason in _candidates(study, front, direct, chosen):
        rounded = rounded_within(study, point)
        twin = next((known for known, each in found.items() if np.array_equal(each.point, rounded)), None)
        if twin is None:
            found[name] = Choice(rounded, reason)
        elif name != study.file.front.pick:
            found[twin] = Choice(rounded, f"{found[twin].reason}; also {reason}")
    return found


def _candidates(
    study: Study, front: ParetoFront, direct: Direct | None, chosen: DirectPick | None
) -> Iterator[tuple[str, Array, str]]:
    aware, name = front.tolerance_aware, "pick"
    if direct is not None and chosen is not None:
        yield "pick", direct.front.points[chosen.row], chosen.reason
        name = "pick_of_surfaces"
    if aware is None:
        yield name, front.points[front.pick], front.pick_reason
    else:
        point = to_actual(aware.points[aware.pick], study.centre, study.step)
        yield name, point, f"{aware.pick_reason}, by what its tolerances leave of it"
        yield "without_tolerances", front.points[front.pick], front.pick_reason
    for rule, row in front.picks.items():
        yield rule, front.points[row], f"the pick by {rule}"
    if direct is not None:
        yield "direct", direct.front.points[direct.front.pick], "the pick of the direct front"
