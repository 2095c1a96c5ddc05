"""Whether the pick is better over the unknown inputs: in words and as JSON."""

import math
from collections.abc import Sequence
from typing import Any

from doe.report.words import of_hundred
from doe.unknown.decision import Better
from doe.workflow.robust import Decider, Robust, RobustFront
from rbdyn.base.words import counted, quantity, shown
from rbdyn.scene.unknown import is_number

# Share that is nearly all cases; gain in the chance of the right choice that is not worth a line.
NEARLY_ALL, LEAST = 0.9, 1e-3
# Inputs named where it is undecided which decides; pairs that a study may ask for at most.
CANDIDATES, MOST_PAIRS = 4, 1024
# Share of a gain's variance that inputs must explain before the lack of a deciding one means anything.
EXPLAINED = 0.5


def robust_record(robust: Robust, factors: Sequence[str]) -> dict[str, Any]:
    """JSON of ``doe study --robust``."""
    return {
        **_better(robust.responses, robust.better),
        "decides": [
            {
                "key": each.key,
                "flip": each.flip,
                "worth": each.worth,
                "pick_above": each.above,
                "flip_interval": None if each.flip_interval is None else list(each.flip_interval),
                "worth_interval": list(each.worth_interval),
            }
            for each in robust.decides
            if each.worth > LEAST and robust.decision.verdict == "decided"
        ],
        "undecided": _undecided(robust) if robust.decision.verdict == "undecided" else None,
        "pair": _pair(robust),
        "halved": _halved(robust),
        "front": None if robust.front is None else _front(robust.front, robust.responses, factors),
        "foretold": dict(zip(robust.responses, robust.explained, strict=True)),
        "inputs": [
            {"key": each.key, "law": each.law.model_dump(exclude_none=True), "reason": each.reason}
            for each in robust.inputs
        ],
        "screened": dict(robust.screened),
        "pairs": robust.pairs,
        "runs": robust.runs,
        "doubtful": robust.doubtful,
        "sentences": robust_sentences(robust, factors),
    }


def _better(responses: Sequence[str], better: Better) -> dict[str, Any]:
    each = {name: list(share) for name, share in zip(responses, better.each, strict=True)}
    return {"better": each, "all": list(better.all)}


def _front(front: RobustFront, names: Sequence[str], factors: Sequence[str]) -> dict[str, Any]:
    def named(keys: Sequence[str], values: Any) -> dict[str, float]:
        return dict(zip(keys, map(float, values), strict=True))

    return {
        "points": [
            {"factors": named(factors, point), "gains": named(names, gains)}
            for point, gains in zip(front.points, front.gains, strict=True)
        ],
        "confirmed": [
            {
                "name": name,
                "reason": each.reason,
                "factors": named(factors, each.point),
                "gains": named(names, each.gains),
                **_better(names, each.better),
            }
            for name, each in front.confirmed.items()
        ],
        "q2": named(names, front.q2),
        "note": front.note,
    }


def robust_sentences(robust: Robust, factors: Sequence[str]) -> list[str]:
    """How likely the pick is better, what decides that, what hangs on the ranges, and what a robust point does."""
    each = ", ".join(
        f"{quantity(name)[0]} {of_hundred(share)} %"
        for name, share in zip(robust.responses, robust.better.each, strict=True)
    )
    whole = robust.better.all
    sure = f"The gains {'hold over' if whole.value >= NEARLY_ALL else 'depend on'} the unknown inputs"
    return [
        f"Probability that the pick is better: {each}; in all of these {of_hundred(whole)} %. {sure} "
        f"({counted(len(robust.inputs), 'input')}, {robust.pairs} input sets, both designs at each).",
        _decision(robust),
        *_of_front(robust, factors),
        f"With ranges half as wide it would be better in all with a probability of about {100.0 * _halved(robust):.0f} %.",
        *(f"{note}." for note in robust.notes),
    ]


def _halved(robust: Robust) -> float:
    """Chance of all gains with ranges half as wide."""
    return min(max(robust.better.all.value + robust.halved, 0.0), 1.0)


def _of_front(robust: Robust, factors: Sequence[str]) -> list[str]:
    front = robust.front
    if front is None or not front.confirmed:
        return [] if front is None else [f"Robust front: {front.note}."]
    pick, *others = front.confirmed.values()
    best = max(others, key=lambda each: each.better.all.value)
    lost = [quantity(name)[0] for name, q2 in zip(robust.responses, front.q2, strict=True) if q2 < EXPLAINED]
    loose = f"; the emulators predict little of {' and '.join(lost)}, so a better one may exist" if lost else ""
    if best.better.all.value <= pick.better.all.value:
        return [f"No point of the robust front that was simulated gains in all in more cases than the pick{loose}."]
    place = ", ".join(
        f"{quantity(name)[0]} {shown(float(x))} {quantity(name)[1]}".rstrip()
        for name, x in zip(factors, best.point, strict=True)
    )
    return [
        f"Safer alternative: {place} (better in all responses in {of_hundred(best.better.all)} of 100 cases; the pick at the "
        f"same input sets in {of_hundred(pick.better.all)}){loose}."
    ]


def _pair(robust: Robust) -> dict[str, Any] | None:
    interval = robust.decision.pair_interval
    if robust.pair is None or interval is None:
        return None
    return {"keys": list(robust.pair[:2]), "worth": robust.pair[2], "worth_interval": list(interval)}


def _decision(robust: Robust) -> str:
    """Which input decides, that none is worth measuring, or that it takes more pairs to say."""
    verdict = robust.decision.verdict
    first = _decided if verdict == "decided" else _undecided if verdict == "undecided" else _nothing
    return f"{first(robust)}{_together(robust)}"


def _decided(robust: Robust) -> str:
    best = robust.decides[0]
    return f"Most decisive unknown: {best.key}.{_flip(best)} Measuring it raises the chance of the right choice by {_points(best)} points."


def _flip(best: Decider) -> str:
    """On which side of which value the original is the better one."""
    # Choices have no above.
    if not is_number(best.flip):
        return ""
    if best.flip_interval is None:
        return " From which value on it changes the choice is not known well enough to state."
    unit, side = quantity(best.key)[1], "Below" if best.above else "Above"
    low, high = (shown(float(end), 3) for end in best.flip_interval)
    return f" {side} {shown(best.flip, 3)} ({low} to {high}) {unit}".rstrip() + " keep the original."


def _undecided(robust: Robust) -> str:
    """Which inputs may decide, and how many pairs would say which."""
    decision = robust.decision
    worths = {each.key: _points(each) for each in robust.decides}
    best, *rest = decision.rivals
    others = "".join(f", {key} by {worths[key]}" for key in rest[: CANDIDATES - 1])
    more = len(rest) - CANDIDATES + 1
    if more > 0:
        others += f", {counted(more, 'other input')} by less"
    many = 2 ** math.ceil(math.log2(decision.needed)) if decision.needed <= MOST_PAIRS else 0
    enough = (
        f"About {many} pairs would decide ([robust] points = {many})"
        if many
        else f"More than {MOST_PAIRS} pairs, the most that [robust] points allows, would be needed to decide"
    )
    return (
        "Undecided which unknown is most decisive: measuring "
        f"{best} raises the chance of the right choice by {worths[best]} points{others}. {enough}{_lost(robust)}."
    )


def _nothing(robust: Robust) -> str:
    """That no input is worth measuring, and how little any could be worth."""
    p = robust.better.all.value
    most = min(max((each.worth_interval[1] for each in robust.decides), default=0.0), 1.0 - max(p, 1.0 - p))
    return (
        "No measurement of one unknown is worth making: it would raise the chance of the right choice by at most "
        f"{math.ceil(100.0 * most):.0f} points{_lost(robust)}."
    )


def _lost(robust: Robust) -> str:
    """Which gains follow no input, so that none that decides would show."""
    explained = zip(robust.responses, robust.explained, strict=True)
    lost = [quantity(name)[0] for name, share in explained if share < EXPLAINED]
    return f"; the inputs explain less than half of the gain in {' and '.join(lost)}" if lost else ""


def _together(robust: Robust) -> str:
    """What measuring the best pair is worth."""
    interval = robust.decision.pair_interval
    if robust.pair is None or interval is None:
        return ""
    first, second, worth = robust.pair
    return f" Measuring {first} and {second} together raises that chance by {_hundredths(worth, interval)} points."


def _points(one: Decider) -> str:
    return _hundredths(one.worth, one.worth_interval)


def _hundredths(value: float, interval: Sequence[float]) -> str:
    """'12 (8 to 15)': a gain in a chance, in points of a hundred, with its interval."""
    low, high = interval
    return of_hundred((value, low, high))
