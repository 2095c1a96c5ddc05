"""Whether the pick is better over what is not known: in words and as JSON."""

from collections.abc import Sequence
from typing import Any

from doe.report.words import of_hundred
from doe.study.robust import Robust
from doe.study.robust_front import RobustFront
from doe.unknown.decision import Better
from rbdyn.cli.terminal import print_table
from rbdyn.records.words import counted, quantity, shown

# Gain in the chance of choosing rightly below which no measurement is proposed, and the share that is nearly all cases.
WORTH, NEARLY_ALL = 0.02, 0.9
# Share of a gain's variance that inputs must foretell before the lack of a deciding one means anything.
FORETOLD = 0.5


def robust_record(robust: Robust, factors: Sequence[str]) -> dict[str, Any]:
    """JSON of ``doe study --robust``."""
    return {
        **_better(robust.responses, robust.better),
        "decides": [
            {"key": each.key, "flip": each.flip, "worth": each.worth, "pick_above": each.above}
            for each in robust.decides
            if each.worth > 1e-3
        ],
        "pair": None if robust.pair is None else {"keys": list(robust.pair[:2]), "worth": robust.pair[2]},
        "halved": _halved(robust),
        "front": None if robust.front is None else _front(robust.front, robust.responses, factors),
        "foretold": dict(zip(robust.responses, robust.foretold, strict=True)),
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
        f"in {quantity(name)[0]} in {of_hundred(share)}"
        for name, share in zip(robust.responses, robust.better.each, strict=True)
    )
    whole = robust.better.all
    sure = f"the gains {'hold over' if whole.value >= NEARLY_ALL else 'depend on'} what is not known"
    return [
        f"Of 100 cases the pick is better {each}, and in all of these in {of_hundred(whole)}: {sure} ({counted(len(robust.inputs), 'input')}, "
        f"{robust.pairs} input sets, both designs at each).",
        _decision(robust),
        *_of_front(robust, factors),
        f"With ranges half as wide it would be better in all in about {100.0 * _halved(robust):.0f}.",
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
    lost = [quantity(name)[0] for name, q2 in zip(robust.responses, front.q2, strict=True) if q2 < FORETOLD]
    loose = f"; emulators foretell little of {' and '.join(lost)}, so a better one may exist" if lost else ""
    if best.better.all.value <= pick.better.all.value:
        return [f"No point of the robust front that was simulated gains in all in more cases than the pick{loose}."]
    place = ", ".join(
        f"{quantity(name)[0]} {shown(float(x))} {quantity(name)[1]}".rstrip()
        for name, x in zip(factors, best.point, strict=True)
    )
    return [
        f"Surer is {place}: better in all in {of_hundred(best.better.all)}, the pick at the same input sets in "
        f"{of_hundred(pick.better.all)}{loose}."
    ]


def print_robust_front(robust: Robust, factors: Sequence[str]) -> None:
    """The pick and points of the robust front, simulated at the same input sets."""
    if robust.front is None:
        return
    rows = [
        (
            name.removeprefix("robust "),
            *(shown(float(x)) for x in each.point),
            *(f"{100.0 * gain:.1f}, {of_hundred(p)}" for gain, p in zip(each.gains, each.better.each, strict=True)),
            of_hundred(each.better.all),
        )
        for name, each in robust.front.confirmed.items()
    ]
    if rows:
        header = ("", *(quantity(name)[0] for name in (*factors, *robust.responses)), "all")
        title = "over what is not known: gain that is kept [%], and in how many of 100 cases it is one"
        print_table(title, header, rows)


def _decision(robust: Robust) -> str:
    chance, p = next(iter(robust.decides), None), robust.better.all.value
    if chance is not None and chance.worth >= WORTH:
        unit = quantity(chance.key)[1]
        side = "below" if chance.above else "above"
        # Choices have no above.
        number = isinstance(chance.flip, float | int)
        keep = f" {side} {shown(chance.flip, 3)} {unit}".rstrip() + " keep the original;" if number else ""
        return (
            f"{chance.key} decides most:{keep} measure it first, which raises the chance of choosing rightly by "
            f"{100.0 * chance.worth:.0f} of 100."
        )
    if robust.pair is not None and robust.pair[2] >= WORTH:
        return (
            f"No input decides alone; {robust.pair[0]} and {robust.pair[1]} measured together would raise the chance of choosing "
            f"rightly by {100.0 * robust.pair[2]:.0f} of 100."
        )
    if p >= NEARLY_ALL or p <= 1.0 - NEARLY_ALL:
        return "No measurement would change the choice."
    foretold = zip(robust.responses, robust.foretold, strict=True)
    lost = [quantity(name)[0] for name, share in foretold if share < FORETOLD]
    told = f": the gain in {' and '.join(lost)} follows none of the inputs" if lost else ""
    return f"Which input decides cannot be told{told}."
