"""Points that could not be simulated: kept as records, grouped by cause."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from rbdyn.faults import RunError

T = TypeVar("T")

# Runs that fail alike say the same sentence with other numbers.
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True)
class Failure:
    """A point that failed: its label, why, its number in the design (None outside of it) and its factors."""

    label: str
    cause: str
    run: int | None = None
    factors: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.label}: {self.cause}"


def grouped(failures: Iterable[Failure]) -> list[dict[str, Any]]:
    """Failures by cause, the most frequent first: ``{"cause", "runs", "labels"}``.

    Causes that differ in their numbers only are one; the first of them stands for all.
    """
    groups: dict[str, list[Failure]] = {}
    for failure in failures:
        groups.setdefault(without_numbers(failure.cause), []).append(failure)
    return [
        {
            "cause": group[0].cause,
            "runs": [failure.run for failure in group if failure.run is not None],
            "labels": [failure.label for failure in group],
        }
        for group in sorted(groups.values(), key=len, reverse=True)
    ]


def without_numbers(text: str) -> str:
    """What two sentences that differ in their numbers only have in common."""
    return _NUMBER.sub("#", text)


def sentence(failures: Sequence[Failure]) -> str:
    """All failures in one sentence: each cause once, with the points that it stopped."""
    return "; ".join(f"{', '.join(group['labels'])}: {group['cause']}" for group in grouped(failures))


def successes(outcomes: Iterable[T | Failure]) -> list[T]:
    """What went well, where all must. Raises RunError that names the rest."""
    found, failures = list[T](), list[Failure]()
    for outcome in outcomes:
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            found.append(outcome)
    if failures:
        raise RunError(sentence(failures))
    return found
