"""The points of a front that are worth a simulation, each once; where the pick does not keep its limits, the next best is
tried."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from doe.arrays import Array
from doe.clearance import Simulations
from doe.pareto import ParetoFront
from doe.response_surface import Surface
from doe.running.store import Failure
from doe.study.adaptive import Adaptive
from doe.study.confirmation import Choice, Confirmed, confirm
from doe.study.front import find_front
from doe.study.goals import rounded_within
from doe.study.limits import ORDER, Limit, limits_of, verdict_of
from doe.study.searched_pick import SearchedPick, searched_pick
from doe.study_file import Study
from rbdyn.faults import InputError


@dataclass(frozen=True, eq=False)
class Chosen:
    """The front that the pick is of, the pick of the searched front if that was searched, all points simulated by name
    ("baseline", "pick", other picks, then "try_1" and so on: picks that did not keep their limits), and failures.

    ``tried`` counts the points simulated as the pick.
    """

    front: ParetoFront
    searched: SearchedPick | None
    confirmed: dict[str, Confirmed]
    failures: list[Failure]
    tried: int


def choose(
    study: Study, surfaces: Sequence[Surface], found: ParetoFront, searched: Adaptive | None, simulations: Simulations
) -> Chosen:
    """Simulate the pick; while a limit is not kept, back off by what was missed and simulate the next best point.

    Of points none of which keeps all limits, the best stands. Raises RunError, InputError, KeyboardInterrupt.
    """
    tried: list[tuple[Confirmed, ParetoFront, SearchedPick | None]] = []
    baseline: list[Confirmed] = []
    front = found
    while True:
        simulated = [*baseline, *(each for each, _, _ in tried)] if tried else []
        chosen = None if searched is None else searched_pick(study, surfaces, searched, simulated, len(tried))
        wanted = choices(study, front, searched, chosen)
        if any(np.array_equal(wanted["pick"].point, each.point) for each, _, _ in tried):
            break
        confirmed, _ = confirm(study, {"pick": wanted["pick"]}, simulations)
        baseline = [confirmed["baseline"]]
        tried.append((confirmed["pick"], front, chosen))
        kept = verdict_of(limits_of(study, confirmed["pick"])) == "kept"
        if kept or len(tried) == study.file.confirmation.tries:
            break
        if searched is None:
            try:
                front = find_front(study, surfaces, [*baseline, *(each for each, _, _ in tried)], len(tried))
            except InputError:
                # What was missed leaves no point that keeps all limits.
                break
    best = min(range(len(tried)), key=lambda place: _badness(limits_of(study, tried[place][0])))
    pick, front, chosen = tried[best]
    wanted = choices(study, front, searched, chosen)
    for number, (each, _, _) in enumerate(tried, 1):
        if each is not pick:
            wanted[f"try_{number}"] = Choice(each.point, f"try {number} for the pick: {each.reason}")
    wanted["pick"] = Choice(pick.point, pick.reason)
    confirmed, failures = confirm(study, wanted, simulations)
    return Chosen(front, chosen, confirmed, failures, len(tried))


def _badness(limits: Sequence[Limit]) -> tuple[int, float]:
    worst = min((limit.room / (abs(limit.bound) or 1.0) for limit in limits), default=0.0)
    return ORDER.index(verdict_of(limits)), -worst


def choices(
    study: Study, front: ParetoFront, searched: Adaptive | None, chosen: SearchedPick | None = None
) -> dict[str, Choice]:
    """The pick, then the picks by the other rules and of the searched front, by name.

    What was ``chosen`` of the searched front is the pick, and the pick of the surfaces stands beside it. Where the study asks
    for a tolerance-aware front, its pick is that of the surfaces. Of those that the drawing cannot tell apart
    the first stands for all, and its reason says so.
    """
    wanted: dict[str, Choice] = {}
    for name, point, reason in _candidates(study, front, searched, chosen):
        rounded = rounded_within(study, point)
        twin = next((known for known, each in wanted.items() if np.array_equal(each.point, rounded)), None)
        if twin is None:
            wanted[name] = Choice(rounded, reason)
        elif name != study.file.front.pick:
            wanted[twin] = Choice(rounded, f"{wanted[twin].reason}; also {reason}")
    return wanted


def _candidates(
    study: Study, front: ParetoFront, searched: Adaptive | None, chosen: SearchedPick | None
) -> Iterator[tuple[str, Array, str]]:
    aware, name = front.tolerance_aware, "pick"
    if searched is not None and chosen is not None:
        yield "pick", searched.front.points[chosen.row], chosen.reason
        name = "pick_of_surfaces"
    if aware is None:
        yield name, front.points[front.pick], front.pick_reason
    else:
        point = study.actual(aware.points[aware.pick])
        yield name, point, f"{aware.pick_reason}, judged at the ends of its tolerances"
        yield "without_tolerances", front.points[front.pick], front.pick_reason
    for rule, row in front.picks.items():
        yield rule, front.points[row], f"the pick by {rule}"
    if searched is not None:
        yield searched.name, searched.front.points[searched.front.pick], f"the pick of the {searched.name} front"
