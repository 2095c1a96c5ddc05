"""Limits of responses, judged by what was simulated: kept, broken or undecided."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from doe.study.confirmation import Confirmed
from doe.study.goals import goals_of
from doe.study.intervals import chance_above, one_sided
from doe.study_file import Study
from doe.unknown.propagation import Share
from rbdyn.base.words import chance, with_error

Verdict = Literal["kept", "undecided", "broken"]

# From the best to the worst.
ORDER: tuple[Verdict, ...] = ("kept", "undecided", "broken")


@dataclass(frozen=True)
class Limit:
    """A limit of a response against its simulated ``value`` with its joint 95 % half-width ``error`` (NaN: unknown).

    ``one_sided`` times the half-width is the error on one side at the probability that the study asks for; ``freedom``:
    degrees of freedom of the error.
    """

    response: str
    sense: str
    bound: float
    value: float
    error: float
    one_sided: float
    freedom: float = math.inf

    @property
    def room(self) -> float:
        """How far the value is on the good side of the bound; negative beyond it."""
        return self.bound - self.value if self.sense == "<=" else self.value - self.bound

    @property
    def verdict(self) -> Verdict:
        """Kept by more than the one-sided error, broken by more than the error, else undecided."""
        if self.room > self.one_sided * self.error:
            return "kept"
        return "broken" if -self.room > self.error else "undecided"

    @property
    def probability(self) -> float:
        """With which the bound is kept, by the error of the value; NaN where that is unknown."""
        if not self.error > 0.0:
            return math.nan if math.isnan(self.error) else float(self.room >= 0.0)
        return float(chance_above(self.room, self.error, self.freedom))

    @property
    def shown(self) -> str:
        """The limit with its value in words."""
        sure = "error unknown" if math.isnan(self.error) else f"probability {chance(self.probability)}"
        return f"{self.response} {self.sense} {self.bound:g} (simulated {with_error(self.value, self.error)}, {sure})"


def every_limit(study: Study, confirmed: Confirmed) -> list[Limit]:
    """All limits of the study at a simulated point, a lower and an upper one of a response each by itself."""
    freedom = confirmed.joint_freedom
    sides = one_sided(freedom, study.file.confirmation.limit_probability).tolist()
    columns = (confirmed.values.tolist(), confirmed.error.tolist(), sides, freedom.tolist())
    known = list(zip(*columns, strict=True))
    return [
        Limit(study.responses[index], sense, bound, *known[index]) for index, sense, bound in goals_of(study).limited
    ]


def limits_of(study: Study, confirmed: Confirmed) -> list[Limit]:
    """The limits of the study at a simulated point, one a response: of a lower and an upper one that with the worse
    verdict, or with less room."""
    worst: dict[str, Limit] = {}
    for limit in every_limit(study, confirmed):
        known = worst.get(limit.response)
        if known is None or _badness(limit) > _badness(known):
            worst[limit.response] = limit
    return [worst[name] for name in study.responses if name in worst]


def verdict_of(limits: Sequence[Limit]) -> Verdict:
    """The worst verdict; kept without limits."""
    return max((limit.verdict for limit in limits), key=ORDER.index, default="kept")


def sentence(limits: Sequence[Limit], probability: float, tried: int) -> str:
    """What became of the limits at the pick, the bad ones first; empty without limits."""
    if not limits:
        return ""
    words = {
        "broken": "LIMIT BROKEN at the pick: {}, beyond by more than its error",
        "undecided": "LIMIT UNDECIDED at the pick: {}, too near the bound for its error",
        "kept": f"Limit kept at the pick, probability {probability:g} demanded: {{}}",
    }
    parts = []
    for verdict in reversed(ORDER):
        group = [limit.shown for limit in limits if limit.verdict == verdict]
        parts += [words[verdict].format(", ".join(group))] if group else []
    tries = "the first point simulated" if tried == 1 else f"{tried} points were tried"
    return f"{'. '.join(parts)} ({tries})."


def odds_sentence(study: Study, odds: Mapping[str, Share] | None) -> str:
    """How likely the pick keeps its limits over the unknown inputs, or the command that tells; empty without limits."""
    if not goals_of(study).limited:
        return ""
    if odds is None:
        return f"The odds of keeping the limits over the unknown inputs: doe study {study.path.name} --robust."
    shares = ", ".join(
        f"{name} {100.0 * p:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f} %)" for name, (p, low, high) in odds.items()
    )
    return f"Probability that the pick keeps its limits over the unknown inputs: {shares}."


def _badness(limit: Limit) -> tuple[int, float]:
    return ORDER.index(limit.verdict), -limit.room
