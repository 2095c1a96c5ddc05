"""The pick and what simulation says of it: where it does not keep its limits, the next best point is tried."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from doe.pareto import ParetoFront
from doe.response_surface import Surface
from doe.running.failure import Failure
from doe.study.confirmation import Choice, Confirmed, confirm
from doe.study.direct import Direct
from doe.study.direct_pick import DirectPick, direct_pick
from doe.study.front import find_front
from doe.study.limits import ORDER, Limit, limits_of, verdict_of
from doe.study.picks import choices
from doe.study.simulations import Simulations
from doe.study_file import Study
from rbdyn.faults import InputError


@dataclass(frozen=True, eq=False)
class Chosen:
    """The front that the pick is of, the pick of the direct front if that was searched, all points simulated by name
    ("baseline", "pick", other picks, then "try_1" and so on: picks that did not keep their limits), and failures.

    ``tried`` counts the points simulated as the pick.
    """

    front: ParetoFront
    direct: DirectPick | None
    confirmed: dict[str, Confirmed]
    failures: list[Failure]
    tried: int


def choose(
    study: Study, surfaces: Sequence[Surface], found: ParetoFront, direct: Direct | None, simulations: Simulations
) -> Chosen:
    """Simulate the pick; while a limit is not kept, back off by what was missed and simulate the next best point.

    Of points none of which keeps all limits, the best stands. Raises RunError, InputError, KeyboardInterrupt.
    """
    tried: list[tuple[Confirmed, ParetoFront, DirectPick | None]] = []
    baseline: list[Confirmed] = []
    front = found
    while True:
        simulated = [*baseline, *(each for each, _, _ in tried)] if tried else []
        chosen = None if direct is None else direct_pick(study, surfaces, direct, simulated, len(tried))
        wanted = choices(study, front, direct, chosen)
        if any(np.array_equal(wanted["pick"].point, each.point) for each, _, _ in tried):
            break
        confirmed, _ = confirm(study, {"pick": wanted["pick"]}, simulations)
        baseline = [confirmed["baseline"]]
        tried.append((confirmed["pick"], front, chosen))
        if _kept(study, confirmed["pick"]) or len(tried) == study.file.confirmation.tries:
            break
        if direct is None:
            try:
                front = find_front(study, surfaces, [*baseline, *(each for each, _, _ in tried)], len(tried))
            except InputError:
                # What was missed leaves no point that keeps all limits.
                break
    best = min(range(len(tried)), key=lambda place: _badness(limits_of(study, tried[place][0])))
    pick, front, chosen = tried[best]
    wanted = choices(study, front, direct, chosen)
    wanted |= {
        f"try_{place + 1}": Choice(each.point, f"try {place + 1} for the pick: {each.reason}")
        for place, (each, _, _) in enumerate(tried)
        if place != best
    }
    wanted["pick"] = Choice(pick.point, pick.reason)
    confirmed, failures = confirm(study, wanted, simulations)
    return Chosen(front, chosen, confirmed, failures, len(tried))


def _kept(study: Study, pick: Confirmed) -> bool:
    return verdict_of(limits_of(study, pick)) == "kept"


def _badness(limits: Sequence[Limit]) -> tuple[int, float]:
    worst = min((limit.room / (abs(limit.bound) or 1.0) for limit in limits), default=0.0)
    return ORDER.index(verdict_of(limits)), -worst
