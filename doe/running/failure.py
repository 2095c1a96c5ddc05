"""Points that could not be simulated: kept as records, grouped by cause."""

import re
from collections.abc import Callable, Iterable, Sequence
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


class StoppedError(RunError):
    """Runs that something from outside has stopped; arguments: what, and the mend after which they go on."""

    def __str__(self) -> str:
        return "{}; finished runs are kept: {}".format(*self.args)


def grouped(failures: Iterable[Failure]) -> list[dict[str, Any]]:
    """Failures by cause, the most frequent first: ``{"cause", "runs", "labels"}``.

    Causes that differ in their numbers only are one; the first of them stands for all.
    """
    groups = []
    for group in sorted(alike(failures, lambda failure: failure.cause), key=len, reverse=True):
        runs = [failure.run for failure in group if failure.run is not None]
        groups.append({"cause": group[0].cause, "runs": runs, "labels": [failure.label for failure in group]})
    return groups


def alike(items: Iterable[T], text: Callable[[T], str]) -> list[list[T]]:
    """Items whose texts differ in their numbers only, together."""
    groups: dict[str, list[T]] = {}
    for item in items:
        groups.setdefault(_NUMBER.sub("#", text(item)), []).append(item)
    return list(groups.values())


def sentence(failures: Sequence[Failure]) -> str:
    """All failures in one sentence: each cause once, with the points that it stopped."""
    return "; ".join(f"{', '.join(group['labels'])}: {group['cause']}" for group in grouped(failures))
