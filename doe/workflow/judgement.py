"""The answer of the robust judgement: its record, shaped like its JSON, and its sentences."""

import math
from dataclasses import field, replace
from typing import Any

from doe.running.store import Failure
from doe.unknown.decision import GainChances, Interval, Verdict
from doe.unknown.propagation import Share
from rbdyn.base.notes import Notes
from rbdyn.base.records import Record, outside_json, spread
from rbdyn.base.words import all_of, counted, quantity, shown
from rbdyn.scene.unknown import UnknownInput, is_number

# Share of cases from which gains hold; least increase in the chance of the right choice that is listed.
NEARLY_ALL, LEAST = 0.9, 1e-3
# Inputs named where the decisive one is undecided; most pairs that a study allows.
CANDIDATES, MOST_PAIRS = 4, 1024
# Share of a gain's variance below which inputs explain too little to call none decisive.
EXPLAINED = 0.5


class GainPoint(Record):
    """A predicted point of the robust front: its factors, and the mean or quantile of each gain over the inputs."""

    factors: dict[str, float]
    gains: dict[str, float]


class ConfirmedGain(Record):
    """A design simulated over the unknown inputs, the reason for its choice, its gains as above, and how likely it gains."""

    name: str
    reason: str
    factors: dict[str, float]
    gains: dict[str, float]
    chances: GainChances = spread()


class RobustFront(Record):
    """Predicted points, and ``confirmed`` ones, the plain pick first.

    ``q2``: predictivity of the emulator of each gain. ``note``: why there is no front; empty if there is one.
    """

    points: list[GainPoint]
    confirmed: list[ConfirmedGain]
    q2: dict[str, float]
    note: str = ""


class Decider(Record):
    """A deciding input: ``flip`` is the value at which the better design changes, None without one.

    ``worth``: gain in the probability of the right choice by measuring the input. ``pick_above``: whether the pick is better
    above the flip. Intervals are of 95 %; that of a flip which may not exist is None.
    """

    key: str
    flip: Any
    worth: float
    pick_above: bool
    flip_interval: tuple[Any, Any] | None
    worth_interval: Interval


class Pair(Record):
    """Two inputs that are worth most together, with the 95 % interval of that worth."""

    keys: tuple[str, str]
    worth: float
    worth_interval: Interval


class Decision(Record):
    """All inputs by worth, and whether the first of them is surely the first: the verdict, and the ``rivals`` by key, the best first.

    ``needed``: about how many pairs of runs decide between them.
    """

    inputs: list[Decider]
    verdict: Verdict
    rivals: list[str]
    needed: float


class Robust(Record, kw_only=True):
    """The robust judgement of the pick over all unknown ``inputs``.

    ``chances``: how likely each gain and all gains are. ``decides``: deciding inputs by worth, where one of them is surely the
    first; ``undecided``: the sentence where none is; ``pair``: the two that are worth most together. ``explained``: share of each gain's
    variance that the inputs predict. ``halved``: the probability of all gains if the ranges of the inputs were half as wide.
    ``front``: the robust front, None if the study asks for none.

    ``screened``: by key of the inputs outside the emulators, the largest share of a gain's variance by the main effect.
    ``pairs``, ``runs``, ``doubtful``: input sets, runs spent, and sets whose gain is in doubt. ``sentences``: all of this, with
    doubts about a posterior sample, and keys that do not vary. ``odds``: by limited response, the probability that the pick
    keeps its limits.
    """

    chances: GainChances = spread()
    decides: list[Decider] = field(default_factory=list)
    undecided: str | None
    pair: Pair | None
    halved: float
    front: RobustFront | None
    explained: dict[str, float]
    inputs: list[UnknownInput]
    screened: dict[str, float]
    pairs: int
    runs: int
    doubtful: int
    sentences: list[str] = field(default_factory=list)
    failures: tuple[Failure, ...] = outside_json(default=())
    odds: dict[str, Share] = outside_json(default_factory=dict)
    decision: Decision | None = outside_json(default=None)


def worded(robust: Robust, decision: Decision, notes: Notes = ()) -> Robust:
    """The judgement with its sentences: the odds of the pick, the decisive input, the effect of the ranges, a safer point."""
    chances = ", ".join(f"{quantity(name)[0]} {share.of_hundred} %" for name, share in robust.chances.gains.items())
    every = robust.chances.all
    statement = "hold over" if every.value >= NEARLY_ALL else "depend on"
    undecided = _undecided(robust, decision) if decision.verdict == "undecided" else None
    sure = [decider for decider in decision.inputs if decider.worth > LEAST and decision.verdict == "decided"]
    sentences = [
        f"Probability that the selected design is better: {chances}; in all of these {every.of_hundred} %. The gains {statement} the unknown inputs "
        f"({counted(len(robust.inputs), 'input')}, {robust.pairs} input sets, both designs at each).",
        f"{undecided or (_decided(decision) if decision.verdict == 'decided' else _nothing(robust, decision))}{_together(robust.pair)}",
        *_of_front(robust),
        f"With ranges half as wide it would be better in all with a probability of about {100.0 * robust.halved:.0f} %.",
        *(f"{note}." for note in notes),
    ]
    return replace(robust, decides=sure, undecided=undecided, sentences=sentences, decision=decision)


def _of_front(robust: Robust) -> list[str]:
    front = robust.front
    if front is None or not front.confirmed:
        return [] if front is None else [f"Robust front: {front.note}."]
    pick, *others = front.confirmed
    best = max(others, key=lambda point: point.chances.all.value)
    lost = [quantity(name)[0] for name, q2 in front.q2.items() if q2 < EXPLAINED]
    doubt = f"; the emulators predict little of {all_of(lost)}, so a better one may exist" if lost else ""
    if best.chances.all.value <= pick.chances.all.value:
        return [
            f"No simulated point of the robust front is better in all responses in more cases than the selected design{doubt}."
        ]
    place = ", ".join(
        f"{quantity(name)[0]} {shown(x)} {quantity(name)[1]}".rstrip() for name, x in best.factors.items()
    )
    return [
        f"Safer alternative: {place} (better in all responses in {best.chances.all.of_hundred} % of the cases; the selected design at the "
        f"same input sets in {pick.chances.all.of_hundred} %){doubt}."
    ]


def _decided(decision: Decision) -> str:
    best = decision.inputs[0]
    return f"Most decisive unknown: {best.key}.{_flip(best)} Measuring it raises the chance of the right choice by {_points(best)} points."


def _flip(best: Decider) -> str:
    """The side of the flip on which the original is better."""
    # Choices have no order.
    if not is_number(best.flip):
        return ""
    if best.flip_interval is None:
        return " The value at which it changes the choice is too uncertain to state."
    unit, side = quantity(best.key)[1], "Below" if best.pick_above else "Above"
    low, high = (shown(float(end), 3) for end in best.flip_interval)
    return f" {side} {shown(best.flip, 3)} ({low} to {high}) {unit}".rstrip() + " keep the baseline."


def _undecided(robust: Robust, decision: Decision) -> str:
    """The inputs that may be decisive, and how many pairs would decide between them."""
    worths = {decider.key: _points(decider) for decider in decision.inputs}
    best, *rivals = decision.rivals
    others = "".join(f", {key} by {worths[key]}" for key in rivals[: CANDIDATES - 1])
    more = len(rivals) - CANDIDATES + 1
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


def _nothing(robust: Robust, decision: Decision) -> str:
    """The sentence that no input is worth measuring, with the most that any could be worth."""
    p = robust.chances.all.value
    most = min(max((decider.worth_interval[1] for decider in decision.inputs), default=0.0), 1.0 - max(p, 1.0 - p))
    return (
        "No measurement of one unknown is worth making: it would raise the chance of the right choice by at most "
        f"{counted(math.ceil(100.0 * most), 'point')}{_lost(robust)}."
    )


def _lost(robust: Robust) -> str:
    """The gains that the inputs hardly explain, so that no input can show as decisive."""
    lost = [quantity(name)[0] for name, share in robust.explained.items() if share < EXPLAINED]
    return f"; the inputs explain less than half of the gain in {all_of(lost)}" if lost else ""


def _together(pair: Pair | None) -> str:
    """The worth of measuring the best pair."""
    if pair is None:
        return ""
    worth = Share(pair.worth, *pair.worth_interval).of_hundred
    return f" Measuring {all_of(pair.keys)} together raises that chance by {worth} points."


def _points(decider: Decider) -> str:
    """'12 (8 to 15)': a gain in a chance, in points of a hundred, with its interval."""
    return Share(decider.worth, *decider.worth_interval).of_hundred
