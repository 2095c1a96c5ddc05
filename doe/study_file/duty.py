"""The duty of a study: points of operation with their shares of the time, and how responses follow from their figures there.

Over a duty a response is one figure of all points. Its limits hold at points: each of them becomes a response of its own,
without a goal, so that every step of a study treats it like any other limit.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal

from pydantic import Field

from doe.study_file.sections import Goal, Name
from rbdyn.base.faults import Consistent, NonNegative, assignment_faults

Aggregate = Literal["mean", "worst", "worst_relative"]
MOST_POINTS = 12
# Largest distance of the sum of all shares from 1 that rounding explains.
SUM_SLACK = 1e-6


class DutyPoint(Consistent):
    """A point of the duty: its share of the time, and what changes in the scene there."""

    name: Name
    """Name of the point in tables and messages."""
    share: NonNegative
    """Share of the time; the shares of all points sum to 1. A point of share 0 counts for worst figures and limits only."""
    set: list[str] = []
    """Overrides of the scene's keys at this point, as "key=value": operation, temperatures, oil flow; not of factors and seeds."""

    def faults(self) -> Iterator[str]:
        if ": " in self.name:
            yield f"name = {self.name!r}: must not have a colon with a space; leave it out"


class OverDuty(Goal):
    """How a response follows from its figures at the points of the duty."""

    aggregate: Aggregate = "mean"
    """Figure over the points of [[duty]]: "mean" weighs them by their shares; "worst" is the worst of them for the goal, the
    largest without one; "worst_relative" is the worst ratio to the baseline at the same point."""
    points: Annotated[list[str], Field(min_length=1)] | None = None
    """Names of the points of [[duty]] at which the limits of the response hold; by default all."""


def at_point(point: str, figure: str) -> str:
    """Name of a figure at a point of the duty."""
    return f"{point}: {figure}"


def alike(points: Sequence[DutyPoint]) -> bool:
    """Whether all points have the same overrides, in whatever order."""
    return len({frozenset(point.set) for point in points}) <= 1


def shares_of(points: Sequence[DutyPoint]) -> dict[str, float]:
    """Shares of the time by name of the point, summing to 1, in the order of the names: they do not depend on that of the tables."""
    total = math.fsum(point.share for point in points)
    return {point.name: point.share / total for point in sorted(points, key=lambda point: point.name)}


def duty_faults(
    points: Sequence[DutyPoint],
    responses: Mapping[str, OverDuty],
    normalise: bool,
    claims: Mapping[tuple[str, ...], str],
    has_scene: bool,
) -> Iterator[str]:
    """Faults of a duty and of the responses' keys on it; ``claims``: keys that no
    point may set, with the reason."""
    if not points:
        if normalise:
            yield "normalise_shares = true: there is no [[duty]] with shares; add one or leave it out"
        yield from (
            f"response.{key} of {name}: needs points of a duty; add [[duty]] or leave it out"
            for name, response in responses.items()
            for key in ("aggregate", "points")
            if key in response.model_fields_set
        )
        return
    if not has_scene:
        yield "duty: there is no scene whose keys it can set; add [scene]"
    if len(points) > MOST_POINTS:
        yield f"duty: has {len(points)} points, more than {MOST_POINTS}; join or leave out some"
    names = [point.name for point in points]
    repeated = [name for name, count in Counter(names).items() if count > 1]
    yield from (f"duty.name = {name!r}: used more than once; name each once" for name in repeated)
    total = math.fsum(point.share for point in points)
    if not total > 0.0:
        yield "duty.share: is 0 at every point; state the shares of the time"
    elif not normalise and abs(total - 1.0) > SUM_SLACK:
        yield f"duty.share: sums to {total:.6g} over all points, not to 1; change a share or write normalise_shares = true"
    for point in points:
        yield from assignment_faults(f"duty.set of {point.name}", point.set, claims)
    for name, response in responses.items():
        yield from _limit_faults(name, response, names)


def _limit_faults(response_name: str, response: OverDuty, names: Sequence[str]) -> Iterator[str]:
    if response.points is None:
        return
    where = f"response.points of {response_name}"
    if response.lower is None and response.upper is None:
        yield f"{where}: the response has no limit to hold there; add lower or upper, or leave it out"
    for name, count in Counter(response.points).items():
        if name not in names:
            yield f"{where} = {name!r}: no such point of the duty; name one of {', '.join(dict.fromkeys(names))}"
        elif count > 1:
            yield f"{where} = {name!r}: used more than once; name each once"
