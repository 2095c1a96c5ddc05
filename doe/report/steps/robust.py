"""Whether the pick is better over what is not known: in words and as JSON."""

from typing import Any

from doe.study.robust import Robust
from doe.unknown.decision import Share
from rbdyn.records.words import quantity, shown

# Gain in the chance of choosing rightly below which no measurement is proposed, and the share that is nearly all cases.
WORTH, NEARLY_ALL = 0.02, 0.9
# Share of a gain's variance that inputs must foretell before the lack of a deciding one means anything.
FORETOLD = 0.5


def robust_record(robust: Robust) -> dict[str, Any]:
    """JSON of ``doe study --robust``."""
    return {
        "better": {name: list(share) for name, share in zip(robust.responses, robust.better.each, strict=True)},
        "all": list(robust.better.all),
        "decides": [
            {"key": each.key, "flip": each.flip, "worth": each.worth} for each in robust.decides if each.worth > 0.0
        ],
        "pair": None if robust.pair is None else {"keys": list(robust.pair[:2]), "worth": robust.pair[2]},
        "foretold": dict(zip(robust.responses, robust.foretold, strict=True)),
        "inputs": [
            {"key": each.key, "law": each.law.model_dump(exclude_none=True), "reason": each.reason}
            for each in robust.inputs
        ],
        "screened": dict(robust.screened),
        "pairs": robust.pairs,
        "runs": robust.runs,
        "doubtful": robust.doubtful,
        "sentences": robust_sentences(robust),
    }


def robust_sentences(robust: Robust) -> list[str]:
    """How likely the pick is better, and what decides that."""
    each = ", ".join(
        f"{quantity(name)[0]} in {_cases(share)}"
        for name, share in zip(robust.responses, robust.better.each, strict=True)
    )
    whole = robust.better.all
    sure = (
        "the gains hold over what is not known"
        if whole.value >= NEARLY_ALL
        else "the gains depend on what is not known"
    )
    return [
        f"Over {len(robust.inputs)} inputs that are not known ({robust.pairs} input sets, both designs at each) the pick is "
        f"better in {each} cases of 100, and in all of these in {_cases(whole)}: {sure}.",
        _decision(robust),
    ]


def _cases(share: Share) -> str:
    return f"{100.0 * share.value:.0f} ({100.0 * share.low:.0f} to {100.0 * share.high:.0f})"


def _decision(robust: Robust) -> str:
    chance, p = robust.decides[0], robust.better.all.value
    if chance.worth >= WORTH:
        where = "" if chance.flip is None else f" (the better design changes at {shown(chance.flip, 3)})"
        return (
            f"{chance.key} decides most{where}: measuring it first would raise the chance of choosing rightly by "
            f"{100.0 * chance.worth:.0f} of 100."
        )
    if robust.pair is not None and robust.pair[2] >= WORTH:
        return (
            f"No input decides alone; {robust.pair[0]} and {robust.pair[1]} measured together would raise the chance of choosing "
            f"rightly by {100.0 * robust.pair[2]:.0f} of 100."
        )
    if p >= NEARLY_ALL or p <= 1.0 - NEARLY_ALL:
        return "No measurement would change the choice."
    lost = [
        quantity(name)[0] for name, share in zip(robust.responses, robust.foretold, strict=True) if share < FORETOLD
    ]
    told = f": the gain in {' and '.join(lost)} follows none of the inputs" if lost else ""
    return f"Which input decides cannot be told{told}."
