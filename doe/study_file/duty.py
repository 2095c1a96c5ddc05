"""The duty of a study: points of operation with their shares of the time, and how responses follow from their figures there.

Over a duty a response is one figure of all points. Its limits hold at points: each of them becomes a response of its own,
without a goal, so that every step of a study treats it like any other limit.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal

from pydantic import Field

from doe.study_file.sections import Goal
from rbdyn.scene.duty import DutyPoint, point_faults, shares_of_time

Aggregate = Literal["mean", "worst", "worst_relative"]


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
    """Shares of the time by name of the point, in the order of the names: they do not depend on that of the tables."""
    return dict(sorted(zip((point.name for point in points), shares_of_time(points), strict=True)))


def duty_faults(
    points: Sequence[DutyPoint],
    responses: Mapping[str, OverDuty],
    normalise: bool,
    claims: Mapping[tuple[str, ...], str],
    has_scene: bool,
) -> Iterator[str]:
    """Faults of a duty and of the responses' keys on it; ``claims``: keys that no point may set, with the reasons."""
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
    yield from point_faults(points, normalise, claims)
    names = [point.name for point in points]
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
